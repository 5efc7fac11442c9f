"""Rounds of the event-driven engine."""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact.round import ride
from chutelab.exact.straight import straight
from chutelab.exact.swarm import Mode, Swarm
from chutelab.recording import Kind

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.machine import Machine
    from chutelab.recording import Recording


def run(machine: Machine, progress: Callable[[float], None] | None = None) -> Recording:
    """Run a machine whose particles do not interact.

    Parameters
    ----------
    machine : Machine
        From `chutelab.machine.build`.
    progress : callable, optional
        Called with the share of particles that have ended, after every round.

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
    """
    if machine.interact:
        raise ValueError("the exact engine has no contacts between particles")
    begin = perf_counter()
    s = Swarm(machine)
    _release(s)
    rounds = 0
    while True:
        moving = s.active(Mode.FLIGHT, Mode.FACE)
        riding = s.active(Mode.ARC, Mode.ARC)
        if not len(moving) and not len(riding):
            break
        rounds += 1
        if len(moving):
            straight(s, moving)
        if len(riding):
            ride(s, riding)
        if progress is not None:
            progress(1.0 - float(np.count_nonzero(s.mode)) / machine.count)
    return s.recorder.finish(
        scene=machine.scene,
        title=machine.title,
        engine="exact",
        particle=machine.particle,
        gravity=machine.gravity,
        steps=rounds,
        seconds=perf_counter() - begin,
    )


def _release(s: Swarm) -> None:
    """Start every particle whose time comes before the end of the run."""
    late = np.flatnonzero(s.stop <= 0.0)
    s.finish(late, "time")
    who = np.flatnonzero(s.stop > 0.0)
    s.knots(who)
    s.event(Kind.RELEASE, who)
    if s.machine.until == "settled" and s.machine.pulley and s.machine.pulley.speed == 0.0:
        rests = who[s.mode[who] == Mode.CARRIED]
        s.event(Kind.SETTLE, rests, s.machine.pulley.surface)
        s.finish(rests, "settled")
