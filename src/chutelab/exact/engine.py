"""Rounds of the event-driven engine, block by block."""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact.obstacles import NONE
from chutelab.exact.round import ride
from chutelab.exact.straight import carry, fly, slide
from chutelab.exact.swarm import Mode, Swarm
from chutelab.exact.world import World
from chutelab.many import at
from chutelab.recorder import Recorder, StalledError
from chutelab.recording import Kind

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.exact.obstacles import Floats
    from chutelab.machine import Machine
    from chutelab.recording import Recording

    Progress = Callable[[float], None]

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
"""Rounds after which it is asked whether everybody gets on."""

TICK = 1e-12
"""s; mean time between events below which nobody gets on: the last bounces before rest, at 1e-9
m/s, are 200 times as far apart."""


def run(
    machine: Machine,
    progress: Progress | None = None,
    began: float | None = None,
    *,
    apart: bool = False,
) -> Recording:
    """Run a machine whose particles do not interact.

    Parameters
    ----------
    machine : Machine
        From `chutelab.machine.build`.
    progress : callable, optional
        Called with the share of particles that have ended, after every round.
    began : float, optional
        Reading of `time.perf_counter` from which `Recording.seconds` counts; now by default.
    apart : bool
        Keep the books of the particles apart: `Recording.by_surface` is (N, S, 3) then. For a
        family of machines, alike in what `chutelab.exact.kinds` tells apart.

    Returns
    -------
    Recording
        Events to rounding error; bit-identical for the same machine.

    Raises
    ------
    ValueError
        If the particles interact.
    CornerError
        If a spinning disk is held between surfaces of which one moves.
    StalledError
        If a particle goes on without getting on; with what was recorded until then.
    """
    if machine.interact:
        raise ValueError("the exact engine has no contacts between particles")
    begin = perf_counter() if began is None else began
    recorder = Recorder(machine.count, machine.surfaces, apart=apart)
    rounds = 0

    def recording() -> Recording:
        return recorder.finish(
            scene=machine.text,
            title=machine.title,
            engine="exact",
            particle=machine.particle,
            gravity=machine.gravity,
            steps=rounds,
            seconds=perf_counter() - begin,
        )

    world = World.of(machine)
    size = _block(len(world.obstacles.surface))
    # Roots that do not exist come out as inf or NaN, and are looked for as such.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for first in range(0, machine.count, size):
            s = Swarm(world, first, min(first + size, machine.count))
            try:
                _to_the_end(s, progress)
            except StalledError as stalled:
                rounds = max(rounds, s.rounds)
                s.hand_over(recorder)
                stalled.recording = recording()
                raise
            rounds = max(rounds, s.rounds)
            s.hand_over(recorder)
    return recording()


def _block(obstacles: int) -> int:
    """Return how many particles run together; what they do does not depend on it."""
    return max(FEWEST, min(MOST, CELLS // max(1, obstacles)))


def _to_the_end(s: Swarm, progress: Progress | None) -> None:
    """Run a block of particles until all have ended."""
    _release(s)
    then = s.age.copy()
    while parties := s.parties():
        if s.rounds >= ROUNDS:
            reason = f"{ROUNDS} events, and no end of them; lower run.max_time"
            raise s.stalled(int(s.mode.argmax()), reason)
        if s.rounds and s.rounds % WINDOW == 0:
            _look_for_rattling(s, s.age - then)
            then = s.age.copy()
        s.rounds += 1
        for mode, who in parties:
            MOVE[mode](s, who)
        if progress is not None:
            ended = s.first + len(s.mode) - int(np.count_nonzero(s.mode))
            progress(ended / s.machine.count)


def _look_for_rattling(s: Swarm, passed: Floats) -> None:
    """Raise if a particle hardly got on in the time (k,), s, that a window of rounds took it."""
    stuck = ((s.mode != Mode.DONE) & (passed < WINDOW * TICK)).nonzero()[0]
    if len(stuck):
        reason = (
            f"{WINDOW} events took {passed[stuck[0]]:.2g} s: it is driven to and fro in a narrow"
            " place; move the surfaces there apart, or lower their restitution"
        )
        raise s.stalled(int(stuck[0]), reason)


def _release(s: Swarm) -> None:
    """Start every particle whose time comes before the end of the run."""
    who = (s.stop > 0.0).nonzero()[0]
    if len(who) < len(s.stop):
        s.finish((s.stop <= 0.0).nonzero()[0], "time")
    state = s.now(who)
    s.journal.knots(who, state)
    s.journal.events(int(Kind.RELEASE), who, NONE, state)
    if s.machine.until == "settled" and s.machine.pulley and at(s.machine.pulley.speed, 0) == 0.0:
        rests = who[s.mode[who] == Mode.CARRIED]
        s.event(int(Kind.SETTLE), rests, s.machine.pulley.surface)
        s.finish(rests, "settled")
