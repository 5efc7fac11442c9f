"""Laws on where nobody may be: beyond a surface, in a surface, in another particle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.recording import Kind
from chutelab.stress.evidence import PIECES, Verdict

if TYPE_CHECKING:
    from collections.abc import Iterator

    from chutelab.machine import Machine
    from chutelab.stress.evidence import Evidence, Floats

ON_ARCS = 1e-9
"""Share of its radius by which a cubic between two knots may leave a circle: the recording's
contract."""

ZOOMS = 12
"""Times that the place of a crossing is narrowed down to a `PIECES`-th: to rounding."""

INSTANTS = 60
"""Times at which the distances of all particles to each other are taken, besides collisions."""

COLLISIONS = 300
"""Collisions at which they are taken, at most."""


def no_one_through(e: Evidence) -> Verdict | None:
    """No centre passes a surface between its ends; the figure counts the passages."""
    s, segments = e.samples, e.machine.segments
    if not len(segments.length) or not len(s.t):
        return None
    clear = max(e.rounding, ON_ARCS * e.machine.particle.radius)
    passages, where = 0, ""
    for k in range(len(segments.length)):
        aside, _ = _beside(e, k, s.position)
        # Side on which it was last seen clearly, carried on through touches.
        seen = np.where(np.abs(aside) > clear, np.sign(aside), 0.0)
        last = np.maximum.accumulate(np.where(seen != 0.0, np.arange(len(seen)), 0))
        side = seen[last]
        flips = (side[1:] * side[:-1] < 0.0) & (s.particle[last[1:]] == s.particle[last[:-1]])
        for at in np.flatnonzero(flips).tolist():
            foot = _crossing(e, k, at, side[at])
            if clear < foot < segments.length[k] - clear:
                passages += 1
                name = e.machine.surfaces[segments.surface[k]]
                where = where or f"particle {s.particle[at]} through {name} at t = {s.t[at]:.6g} s"
    return Verdict(passages, 0.0, where or "passages")


def _beside(e: Evidence, k: int, position: Floats) -> tuple[Floats, Floats]:
    """Distances of places (c, 2) from the line of segment k, left positive, and along it, m."""
    from_start, tangent = position - e.machine.segments.start[k], e.machine.segments.tangent[k]
    return tangent[0] * from_start[:, 1] - tangent[1] * from_start[:, 0], from_start @ tangent


def _crossing(e: Evidence, k: int, at: int, side: float) -> float:
    """Return where along segment k a centre goes over from a side, between two samples, m."""
    s = e.samples
    if s.left[at] != s.left[at + 1]:
        # A jump, from one interval to the next.
        return float(_beside(e, k, s.position[at : at + 1])[1][0])
    low, high = s.share[at], s.share[at + 1]
    for _ in range(ZOOMS):
        shares = np.linspace(low, high, PIECES + 1)
        aside, foot = _beside(e, k, e.between(np.full(len(shares), s.left[at]), shares))
        # The last place on the old side: before it there may be a touch, where signs are rounding.
        before = int(np.flatnonzero(aside * side > 0.0)[-1:].sum())
        low, high = shares[before], shares[min(before + 1, PIECES)]
    return float(foot[before])


def depth(e: Evidence) -> Verdict | None:
    """No disk is deeper in a surface than rounding, or a step, allows; the figure is in m.

    What overlapped at the release may go on doing so, no deeper.
    """
    s, m = e.samples, e.machine
    r = m.particle.radius
    if not len(s.t) or not (len(m.segments.length) or m.pulley is not None):
        return None
    starts = np.flatnonzero(np.diff(s.particle, prepend=-1))
    worst, where = 0.0, "m"
    for name, gap in gaps(m, s.position):
        first = np.minimum(gap[starts], 0.0)
        deeper = np.repeat(first, np.diff(starts, append=len(gap))) - gap
        at = int(np.argmax(deeper))
        if deeper[at] > worst:
            worst = float(deeper[at])
            where = f"m, particle {s.particle[at]} in {name} at t = {s.t[at]:.6g} s"
    arcs = ON_ARCS * (r + (m.pulley.radius if m.pulley is not None else 0.0))
    return Verdict(worst, e.rounding + arcs + e.late, where)


def gaps(machine: Machine, position: Floats) -> Iterator[tuple[str, Floats]]:
    """Yield every surface's name and its distances from disks round places (c, 2), m."""
    seg, r = machine.segments, machine.particle.radius
    for k in range(len(seg.length)):
        from_start = position - seg.start[k]
        foot = np.clip(from_start @ seg.tangent[k], 0.0, seg.length[k])
        away = from_start - foot[:, None] * seg.tangent[k]
        yield machine.surfaces[seg.surface[k]], np.hypot(away[:, 0], away[:, 1]) - r
    if machine.pulley is not None:
        yield "pulley", np.hypot(position[:, 0], position[:, 1]) - machine.pulley.radius - r


def overlap(e: Evidence) -> Verdict | None:
    """No two disks overlap by more than they approach in a step; the figure is in m."""
    if not e.crowd:
        return None
    t = e.recording.knots["t"]
    collisions = np.unique(e.recording.select(Kind.COLLISION)["t"])
    times = np.concatenate(
        [
            np.linspace(t.min(), t.max(), INSTANTS),
            collisions[:: 1 + len(collisions) // COLLISIONS],
        ]
    )
    worst, where = 0.0, "m"
    for now in times:
        (position,), _ = e.recording.at([now])
        there = np.flatnonzero(np.isfinite(position[:, 0]))
        deep, i, j = closest(position[there], e.machine.particle.radius)
        if deep > worst:
            worst = deep
            where = f"m, particles {there[i]} and {there[j]} at t = {now:.6g} s"
    return Verdict(worst, e.rounding + 2.0 * e.late, where)


def closest(position: Floats, radius: float) -> tuple[float, int, int]:
    """Deepest overlap (m, negative if there is none) of places (n, 2), and of which two."""
    best = (-np.inf, 0, 0)
    order = np.argsort(position[:, 0])
    x, y = position[order].T
    for n in range(1, len(order)):
        dx = x[n:] - x[:-n]
        near = np.flatnonzero(dx < 2.0 * radius)
        if not len(near):
            break
        apart = np.hypot(dx[near], y[n:][near] - y[:-n][near])
        low = int(np.argmin(apart))
        found = 2.0 * radius - float(apart[low])
        if found > best[0]:
            best = (found, int(order[near[low]]), int(order[near[low] + n]))
    return best
