"""Rounds of the event-driven engine, block by block.

Machines of a family can run together, `kinds`, if their surfaces join in the same way.
"""

from __future__ import annotations

from itertools import combinations
from time import perf_counter

import numpy as np

from chutelab.engines.exact.layout import (
    JOINT,
    Bends,
    ahead_of,
    beginnings,
    corners_of,
    curvatures_of,
    obstacles,
    resting,
    size_of,
    touch_of,
)
from chutelab.engines.exact.motion import carry, fly, ride, slide
from chutelab.engines.exact.obstacles import COLLINEAR, FOLDED, along, dot
from chutelab.engines.exact.particle_state import Mode, State
from chutelab.machine import Machine, moved, origin
from chutelab.results.record import REASONS, Kind, Record
from chutelab.results.recorder import EnoughError, Recorder, StalledError
from chutelab.util.arrays import Bools, Ints, Progress


def kinds(machine: Machine) -> list[Ints]:
    """Group members of a family that share every trait taken from the first one.

    Traits are how pieces join, and whether there are points, points that may lie in a surface,
    gravity, and a belt at rest.

    Parameters
    ----------
    machine : Machine
        A family, see `Machine`.

    Returns
    -------
    list of ndarray
        Numbers of members that are alike; each member is in one of them.
    """
    bends = Bends.of(machine)
    ends, ahead = corners_of(machine, bends), ahead_of(machine, bends)
    size, radius = size_of(ends, bends, machine.releases.position), machine.particle.radius
    reach = JOINT * size
    curvature = curvatures_of(machine, bends)
    traits = [np.greater(radius, 0.0), radius <= touch_of(size), np.greater(machine.gravity, 0.0)]
    if machine.pulley is not None:
        traits.append(np.equal(machine.pulley.speed, 0.0))
    traits += [*np.atleast_2d(machine.arcs.whole).T]
    for arc, on in enumerate(resting(ends, bends, reach)):
        away = (ends - bends.center[:, arc, None]) / bends.shape[0, arc]
        flush = on & (np.abs(dot(away, ahead)) <= COLLINEAR)
        traits += [*on, *flush, *(flush & (dot(along(away), ahead) > 0.0))]
    traits += beginnings(machine, bends, ends, reach).values()
    # Most ends are never near each other.
    beyond = ends.min(axis=-1)[:, :, None] > ends.max(axis=-1)[:, None] + reach.max()
    beyond |= beyond.transpose(0, 2, 1)
    joins: dict[frozenset[int], Bools] = {}
    ordered: dict[frozenset[int], Bools] = {}
    for a, b in np.argwhere(np.triu(~beyond.any(axis=0), 1)).tolist():
        near: Bools = np.all(np.abs(ends[:, a] - ends[:, b]) <= reach, axis=0)
        joins[frozenset((a, b))] = near
        outward, onward = ahead[:, a], ahead[:, b]
        cross = outward[0] * onward[1] - outward[1] * onward[0]
        folded = near & (np.abs(outward - onward).max(axis=0) <= FOLDED)
        traits += [near, folded, near & (np.abs(cross) <= COLLINEAR)]
        tighter = curvature[a] > curvature[b]
        ordered[frozenset((a, b))] = np.where(folded, tighter, near & (cross > COLLINEAR))
    # Where three meet, their order round the place matters.
    for one, other in combinations(joins, 2):
        if len(one ^ other) == 2:
            traits += [ordered[one], ordered[other]]
    # Where a joins b and b joins c, but a does not join c, the order of the ends matters too.
    none = np.zeros(machine.count, dtype=bool)
    chained = none.copy()
    for one, other in combinations(joins, 2):
        if len(one ^ other) == 2:
            chained |= joins[one] & joins[other] & ~joins.get(one ^ other, none)
    apart = np.where(chained, 1 + np.arange(machine.count), 0)
    table = np.stack([np.broadcast_to(trait, machine.count) for trait in (*traits, apart)])
    order = np.lexsort(table)
    return np.split(order, 1 + np.flatnonzero(np.diff(table[:, order]).any(axis=0)))


MOVE = {Mode.FLIGHT: fly, Mode.CARRIED: carry, Mode.FACE: slide, Mode.ARC: ride}
"""What takes particles to their next event."""

CELLS = 2**15
"""Particles times obstacles in one block: some thirty arrays of that size stay near the cache."""

FEWEST, MOST = 64, 4096
"""Particles in a block: bounds."""

ROUNDS = 500_000
"""Most rounds of a block. A particle at ε = 0.999 comes to rest within some 20,000, at 0.9999
within 200,000; one that rattles at 7 ms a period for the default max_time needs 10,000."""

WINDOW = 10_000
"""Progress check interval, in rounds."""

TICK = 1e-12
"""s over `Machine.pace`; mean time between events below which a particle makes no progress: the
last bounces before rest, at 1e-9 m/s, are 200 times as far apart."""


def run(
    machine: Machine,
    progress: Progress | None = None,
    *,
    apart: bool = False,
) -> Record:
    """Run a machine whose particles do not interact.

    Parameters
    ----------
    machine : Machine
        From `chutelab.machine.build`.
    progress : callable, optional
        Called with the share of particles that have ended, after every round; may end the run.
    apart : bool
        Keep the books of the particles apart: `Recording.by_surface` is (N, S, 3) then. For a
        family of machines, alike in what `chutelab.engines.exact.kinds` tells apart.

    Returns
    -------
    Record
        Events to rounding error; bit-identical for the same machine.

    Raises
    ------
    ValueError
        If the particles interact, or some but not all are points.
    CornerError
        If a spinning disk is held between surfaces of which one moves.
    StalledError
        If a particle has event after event without progress; with what was recorded until then.
    """
    if machine.interact:
        raise ValueError("the exact engine has no contacts between particles")
    points = np.equal(machine.particle.radius, 0.0)
    if 0 < np.count_nonzero(points) < points.size and machine.segments.start.ndim == 2:
        raise ValueError("the exact engine has no points beside disks")
    begin = perf_counter()
    recorder = Recorder(machine, apart=apart)
    rounds, stalled, enough = 0, None, False
    place = origin(machine)
    near = moved(machine, -place[0], -place[1])
    surfaces = obstacles(near, max(map(abs, place)))
    # What particles do does not depend on how many run together.
    size = max(FEWEST, min(MOST, CELLS // max(1, len(surfaces.surface))))
    # Roots that do not exist come out as inf or NaN, and are looked for as such.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for first in range(0, machine.count, size):
            s = State(near, surfaces, first, min(first + size, machine.count))
            try:
                _to_the_end(s, progress)
            except StalledError as error:
                stalled = error
            except EnoughError:
                s.finish(s.mode.nonzero()[0], "stopped")
                recorder.ended[first + size :] = REASONS.index("stopped")
                enough = True
            rounds = max(rounds, s.rounds)
            s.close(recorder)
            if enough or stalled is not None:
                break
    recording = recorder.finish(
        engine="exact", steps=rounds, seconds=perf_counter() - begin, origin=place
    )
    if stalled is not None:
        (x, y), (dx, dy) = stalled.position, place
        raise StalledError(stalled.particle, stalled.t, (x + dx, y + dy), stalled.reason, recording)
    return recording


def _to_the_end(s: State, progress: Progress | None) -> None:
    """Run a block of particles until all have ended."""
    _release(s)
    then = s.age.copy()
    while parties := s.parties():
        if s.rounds >= ROUNDS:
            reason = f"{ROUNDS} events, and no end of them; lower run.max_time"
            raise s.stalled(int(s.mode.argmax()), reason)
        if s.rounds and s.rounds % WINDOW == 0:
            passed = s.age - then
            stuck = ((s.mode != Mode.DONE) & (passed < WINDOW * TICK / s.pace)).nonzero()[0]
            if len(stuck):
                reason = (
                    f"{WINDOW} events took {passed[stuck[0]]:.2g} s: it is driven to and fro in a"
                    " narrow place; move the surfaces there apart, or lower their restitution"
                )
                raise s.stalled(int(stuck[0]), reason)
            then = s.age.copy()
        s.rounds += 1
        for mode, index in parties:
            MOVE[mode](s, index)
        if progress is not None:
            ended = s.first + len(s.mode) - int(np.count_nonzero(s.mode))
            progress(ended / s.machine.count)


def _release(s: State) -> None:
    """Start every particle whose time comes before the end of the run."""
    index = (s.stop > 0.0).nonzero()[0]
    if len(index) < len(s.stop):
        s.finish((s.stop <= 0.0).nonzero()[0], "time")
    s.knots(index)
    s.event(int(Kind.RELEASE), index)
    if (
        s.machine.until == "settled"
        and s.machine.pulley
        and np.ravel(s.machine.pulley.speed)[0] == 0.0
    ):
        rests = index[s.mode[index] == Mode.CARRIED]
        s.event(int(Kind.SETTLE), rests, s.machine.pulley.surface)
        s.finish(rests, "settled")
