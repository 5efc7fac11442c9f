"""Laws on where nobody may be: beyond a surface, in one, in another particle, on nothing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.checks.stress.evidence import PIECES, PRESSED, Evidence, Verdict
from chutelab.machine import Machine
from chutelab.results import REASONS, Kind
from chutelab.util.arrays import Floats, Ints

AT_SURFACES = (Kind.IMPACT, Kind.LANDING, Kind.STICK, Kind.SLIP, Kind.SETTLE)
"""What happens at a surface, if one is named."""

ON_ARCS = 1e-9
"""Share of its radius by which a cubic between two knots may leave a circle: the recording's
contract."""

ZOOMS = 12
"""Times that the place of a crossing is narrowed down to a `PIECES`-th: to rounding."""

INSTANTS, PLACES = 1000, 200_000
"""Times at which pairs of particles are looked at, and places, all particles together, at most."""

COLLISIONS = 300
"""Collisions, and releases, at which that is done besides, at most."""


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
    worst, where = 0.0, "m"
    for now in np.concatenate([_instants(e), _some(e, Kind.COLLISION)["t"]]):
        (position,), _ = e.recording.at([now])
        there = np.flatnonzero(np.isfinite(position[:, 0]))
        deep, i, j = closest(position[there], e.machine.particle.radius)
        if deep > worst:
            worst = deep
            where = f"m, particles {there[i]} and {there[j]} at t = {now:.6g} s"
    return Verdict(worst, e.rounding + 2.0 * e.late, where)


def pressed(e: Evidence) -> Verdict | None:
    """No two disks stay in each other for longer than a step; the figure is a share of the radius.

    It is the least overlap of a pair at two instants a step apart. Chipmunk parts what it finds
    over several steps, a fifth in a millisecond, so it promises nothing on how long: there the
    bound is that of `overlap`.
    """
    if not e.crowd or e.dt is None:
        return None
    worst, where, r = 0.0, "r", e.machine.particle.radius
    for now, first, last, pairs in _pairs(e):
        deep = 2.0 - np.maximum(*(_apart(place, pairs) for place in (first, last))) / r
        at = int(np.argmax(deep))
        if deep[at] > worst:
            worst = float(deep[at])
            where = f"r, particles {pairs[0][at]} and {pairs[1][at]} at t = {now:.6g} s"
    return Verdict(worst, PRESSED if e.engine == "contact" else 2.0 * e.late / r, where)


def no_one_through_another(e: Evidence) -> Verdict | None:
    """Slow disks do not pass through each other; the figure counts the pairs.

    Slow are two that come nearer by less than a radius in a step: an engine sees them in touch
    before they are inside. They pass where the centre of one gets into the other.
    """
    if not e.crowd or e.dt is None:
        return None
    passed: set[tuple[int, int]] = set()
    r, where = e.machine.particle.radius, ""
    for now, first, last, (i, j) in _pairs(e):
        start = first[j] - first[i]
        along = last[j] - last[i] - start
        way = np.hypot(*along.T)
        # Closest approach on the straight way of a step.
        share = -(start * along).sum(axis=1) / np.where(way > 0.0, way, 1.0) ** 2
        nearest = np.hypot(*(start + np.clip(share, 0.0, 1.0)[:, None] * along).T)
        for k in np.flatnonzero((way < r) & (nearest < r)).tolist():
            a, b = sorted((int(i[k]), int(j[k])))
            passed.add((a, b))
            where = where or f"pairs: {a} and {b} at t = {now:.6g} s"
    return Verdict(len(passed), 0.0, where or "pairs")


def _instants(e: Evidence) -> Floats:
    """Return times at which pairs are looked at, s: every step, or as many as are allowed."""
    t = e.recording.knots["t"]
    step = e.dt or np.ptp(t)
    most = min(INSTANTS, PLACES // max(1, e.recording.count))
    count = min(most, int(np.ptp(t) / step) + 1)
    return np.linspace(t.min(), t.max(), max(2, count))


def _some(e: Evidence, *kinds: Kind) -> NDArray[Any]:
    events = e.recording.select(*kinds)
    return events[:: 1 + len(events) // COLLISIONS]


def _pairs(e: Evidence) -> Iterator[tuple[float, Floats, Floats, tuple[Ints, Ints]]]:
    """Yield instants, places (N, 2) then and a step later, and pairs in touch at either time."""
    assert e.dt is not None
    reach = 2.0 * e.machine.particle.radius
    for now in _instants(e):
        (first, last), _ = e.recording.at([now, now + e.dt])
        there = np.flatnonzero(np.isfinite(first[:, 0]) & np.isfinite(last[:, 0]))
        room = reach + 2.0 * np.abs(last[there] - first[there]).max(initial=0.0)
        pairs = there[_neighbours(first[there, 0], room)]
        i, j = pairs[:, np.minimum(_apart(first, pairs), _apart(last, pairs)) < reach]
        if len(i):
            yield float(now), first, last, (i, j)


def _neighbours(x: Floats, room: float) -> Ints:
    """Return all pairs (2, k) whose x differ by less than `room`, m."""
    order = np.argsort(x, kind="stable")
    index = np.arange(len(x))
    ends = np.searchsorted(x[order], x[order] + room)
    left = np.repeat(index, np.maximum(ends - index - 1, 0))
    right = left + 1 + np.arange(len(left)) - np.searchsorted(left, left)
    return order[np.stack([left, right])]


def _apart(place: Floats, pairs: tuple[Ints, Ints] | Ints) -> Floats:
    i, j = pairs
    return np.asarray(np.hypot(*(place[j] - place[i]).T))


def on_something(e: Evidence) -> Verdict | None:
    """Nobody bounces off nothing: what happens at a surface, or a particle, happens there.

    The figure is the largest distance of an event's place from what it names, less the radius, m.
    """
    r, events = e.machine.particle.radius, e.recording.select(*AT_SURFACES)
    worst, where = 0.0, "m"
    off = np.full((len(e.machine.surfaces), len(events)), np.inf)
    for name, gap in gaps(e.machine, events["position"]):
        # The pulley is part of the incoming belt's surface.
        row = 0 if name == "pulley" else e.machine.surfaces.index(name)
        off[row] = np.minimum(off[row], np.abs(gap))
    named = events["surface"]
    on = np.flatnonzero(named < len(e.machine.surfaces))
    on = on[named[on] >= 0]
    if len(on):
        far = off[named[on], on]
        at = int(np.argmax(far))
        if far[at] > worst:
            hit = events[on[at]]
            worst = float(far[at])
            where = f"m, particle {hit['particle']} off {e.recording.surfaces[hit['surface']]}"
            where += f" at t = {hit['t']:.6g} s"
    for hit in _some(e, Kind.COLLISION):
        i, j = int(hit["particle"]), int(hit["other"])
        (place,), _ = e.recording.at([hit["t"]])
        far = abs(float(np.hypot(*(place[j] - hit["position"]))) - 2.0 * r)
        if not far <= worst:
            worst, where = far, f"m, particles {i} and {j} at t = {hit['t']:.6g} s"
    if not len(on) and not len(e.recording.select(Kind.COLLISION)):
        return None
    arcs = ON_ARCS * (r + (e.machine.pulley.radius if e.machine.pulley is not None else 0.0))
    return Verdict(worst, e.rounding + arcs + (2.0 if e.crowd else 1.0) * e.late, where)


def released_free(e: Evidence) -> Verdict | None:
    """Nobody is released inside another or a surface; the figure is how deep, m."""
    if not e.crowd and not len(e.machine.surfaces):
        return None
    worst, where, r = 0.0, "m", e.machine.particle.radius
    releases = e.recording.select(Kind.RELEASE)
    if not len(releases):
        return None
    for name, gap in gaps(e.machine, releases["position"]):
        at = int(np.argmin(gap))
        if -gap[at] > worst:
            worst, where = -float(gap[at]), f"m, particle {releases['particle'][at]} in {name}"
    for event in _some(e, Kind.RELEASE) if e.crowd else ():
        (place,), _ = e.recording.at([event["t"]])
        apart = np.hypot(*(place - event["position"]).T)
        apart[event["particle"]] = np.inf
        other = int(np.argmin(np.where(np.isfinite(apart), apart, np.inf)))
        if 2.0 * r - apart[other] > worst:
            worst = float(2.0 * r - apart[other])
            where = f"m, particle {event['particle']} in {other} at t = {event['t']:.6g} s"
    # One that is released just behind another, in touch, may be seen a rounding too near.
    return Verdict(worst, e.rounding, where)


def settled_to_stay(e: Evidence) -> Verdict | None:
    """Nothing is settled that moves with a surface it will be thrown from; the figure counts them.

    That is any surface that moves, but for the outgoing belt.
    """
    m = e.machine
    settled = np.flatnonzero(e.recording.ended == REASONS.index("settled"))
    settled = settled[np.diff(e.recording.offsets)[settled] > 0]
    if not len(settled):
        return None
    last = e.recording.knots[e.recording.offsets[settled + 1] - 1]
    near = e.rounding + ON_ARCS * e.machine.particle.radius + e.late
    throws = [*(m.segments.speed != 0.0) & (m.segments.surface != m.landing)]
    throws.append(m.pulley is not None and m.pulley.speed != 0.0)
    thrown, where = np.zeros(len(settled), dtype=bool), ""
    for moving, (name, gap) in zip(throws, gaps(m, last["position"]), strict=False):
        lies = (gap < near) & moving
        thrown |= lies
        if lies.any() and not where:
            where = f"particles: {settled[np.argmax(lies)]} on {name}"
    return Verdict(int(np.count_nonzero(thrown)), 0.0, where or "particles")


def closest(position: Floats, radius: float) -> tuple[float, int, int]:
    """Deepest overlap (m, negative if there is none) of places (n, 2), and of which two."""
    i, j = pairs = _neighbours(position[:, 0], 2.0 * radius)
    if not len(i):
        return -np.inf, 0, 0
    apart = _apart(position, pairs)
    low = int(np.argmin(apart))
    return 2.0 * radius - float(apart[low]), int(i[low]), int(j[low])
