"""A trial run of a stream's first particles, cut off after a moment.

From it contacts and run time of the whole stream are estimated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt
from time import process_time

import numpy as np

from chutelab.checks.preflight.results import Effort, Stepping
from chutelab.engines.simulation import simulate
from chutelab.machine import Machine
from chutelab.results import Kind, Recording
from chutelab.results.recorder import StalledError
from chutelab.scene import Scene, SceneError

PATIENCE = 0.12
"""s of processor time after the start of a trial: the look as a whole is to take less than half a
second, on a busy machine too."""

INDEPENDENT, CROWD, ALONE = 16, 24, 1
"""Particles of a trial: not colliding, colliding, and one after the other in pymunk."""

WARMING = 0.05
"""s; a trial shorter than this is run once more, because its first time is mostly warming up."""


class _EnoughError(Exception):
    """The trial has taken its time."""


@dataclass(frozen=True)
class Trial:
    """A run of a stream's first particles."""

    count: int  # of the particles
    recording: Recording | None  # None if it was cut off
    seconds: float  # taken once warm, or until it was cut off
    rounds: int = 0  # of the exact engine, if it was cut off
    warming: float = 0.0  # s that its first time took longer
    # It ended with the landings though the scene goes on until all is at rest, which takes a crowd
    # of any size too long for a trial.
    landed: bool = False
    # Particle 0 by itself, to the end and not stepped where that can be had; None if it would take
    # too long, or the trial was not stepped either.
    lone: Recording | None = None
    trouble: str = ""  # what stopped it, if the engine did not get on


def trial(scene: Scene, engine: str) -> Trial:
    """Run the first particles of a scene until they end, or patience does.

    Raises
    ------
    SceneError
        If the engine that the scene asks for cannot run it.
    """
    crowd = scene.stream.crowded
    most = CROWD if crowd else ALONE if engine == "pymunk" else INDEPENDENT
    count = min(scene.stream.count, most)
    landed = crowd and scene.run.until == "settled" and scene.outgoing is not None
    run = {"run.until": "landed"} if landed else {}
    some = scene.with_values({"stream.count": count, "expect": None, **run})
    found = _timed(some)
    if found.recording is not None and found.seconds <= WARMING:
        warm = _timed(some)
        found = replace(warm, warming=max(0.0, found.seconds - warm.seconds))
    if engine == "exact":
        return found
    alone = {"stream.count": 1, "stream.interact": False, "run.engine": "auto", "expect": None}
    try:
        lone = _timed(scene.with_values(alone)).recording
    except SceneError:
        lone = None
    return replace(found, landed=landed, lone=lone)


def _timed(scene: Scene) -> Trial:
    begin, started, rounds = process_time(), 0.0, 0

    def watch(_share: float) -> None:
        nonlocal rounds, started
        rounds += 1
        if rounds == 1:
            # The contact engine's core is compiled once in a process.
            started = process_time()
        elif process_time() - started > PATIENCE:
            raise _EnoughError

    recording, trouble = None, ""
    try:
        recording = simulate(scene, None, watch)
    except StalledError as stalled:
        trouble = str(stalled)
    except _EnoughError:
        pass
    seconds = process_time() - begin
    return Trial(scene.stream.count, recording, seconds, rounds, trouble=trouble)


def stepping(machine: Machine, engine: str, tried: Trial) -> Stepping:
    """Hold the way of a step against what a surface catches.

    The contact engine finds every blow at its own instant, as the pymunk engine does for a lone
    particle with aligned steps. Otherwise a contact is seen at the end of a step, and must be
    before the centre is on the other side: surfaces have no thickness.
    """
    bound = machine.particle.radius
    runs = (run for run in (tried.lone, tried.recording) if run is not None and len(run.knots))
    speed = way = None
    if (run := next(runs, None)) is not None:
        # Not every knot has the speed just before an impact; events do.
        seen = np.concatenate([run.knots["velocity"], run.events["velocity_before"]])
        speed = float(np.hypot(*seen.T).max())
        way = speed * machine.dt
    aligned = engine == "contact" or (machine.align and not machine.interact)
    return Stepping(
        dt=machine.dt,
        aligned=aligned,
        speed=speed,
        way=way,
        bound=bound,
        longest=bound / speed if speed else None,
        safe=aligned or way is None or way < bound,
    )


TOGETHER = 400.0
"""Particles that cost the exact engine as much again as a round costs by itself."""

BODIES = 50.0
"""The same for a step of an engine with steps."""

IN_THE_JET = 2.5
"""Contacts of a particle in a crowd up to its landing, where no trial tells."""

TO_REST, NEIGHBOURS = 12.0, 10.0
"""Contacts from there to rest where they come to lie side by side, and the number of particles of
which half of those that are to be met are there."""

STEP = 3e-4
"""s for a step with a few particles, where no trial tells: of Chipmunk, the slower engine."""

ROUNDS = 10
"""Rounds of the exact engine for a contact, at most about: a slip round the pulley takes the most;
while it bounces, each round is one."""


def effort(scene: Scene, engine: str, tried: Trial) -> Effort:
    """Scale a trial up to the whole stream."""
    count, some, recording = scene.stream.count, tried.count, tried.recording
    who = f"the first {some} of {count:,} particles"
    if some == count:
        who = "the only particle" if count == 1 else f"all {count} particles"
    elif some == 1:
        who = f"the first of {count:,} particles"
    # How much longer a step takes with all particles than with a few.
    fuller = (BODIES + count) / (BODIES + some)
    if scene.stream.crowded and (tried.landed or recording is None):
        return _crowd(scene, tried, who, fuller)
    if recording is None:
        each = max(1, tried.rounds // ROUNDS) if tried.lone is None else tried.lone.contacts
        how = f"a trial run of {who} was cut off after {tried.seconds:.1g} s"
        return Effort(each * count, tried.seconds * count / some, True, how)
    collided = int(np.count_nonzero(recording.events["kind"] == Kind.COLLISION))
    alone, crowding = recording.contacts - collided, sqrt(count / some)
    contacts = round((alone + collided * crowding) * count / some)
    growth = count / some
    if engine == "exact":
        growth = (TOGETHER + count) / (TOGETHER + some)
    elif scene.stream.crowded:
        lasted = float(recording.ends()[1]["t"].max(initial=0.0))
        later = (count - some) / scene.stream.rate
        growth = (1.0 + later / lasted if lasted > 0.0 else 1.0) * fuller
    seconds = tried.warming + tried.seconds * growth
    how = "timed in" if some == count else "scaled up from"
    return Effort(contacts, seconds, False, f"{how} a trial run of {who}")


def _crowd(scene: Scene, tried: Trial, who: str, fuller: float) -> Effort:
    """Estimate a crowd that comes to rest, or whose trial was cut off."""
    count, recording, out = scene.stream.count, tried.recording, scene.outgoing
    each, step, what = IN_THE_JET, STEP, "nominal figures"
    if recording is not None and recording.steps:
        each = recording.contacts / tried.count
        step = tried.seconds / recording.steps
        what = f"a trial run of {who} up to their landing, and nominal figures"
    life = scene.run.max_time
    if tried.lone is not None:
        each = max(each, float(tried.lone.contacts))
        life = float(np.ptp(tried.lone.knots["t"]))
    if scene.run.until != "landed":
        # The share of the outgoing belt that the particles cover, side by side.
        diameter = 2.0 * scene.particle.radius
        way = 0.0 if out is None else abs(out.speed) / scene.stream.rate
        covered = diameter / way if way > diameter else 1.0
        each += TO_REST * covered * count / (count + NEIGHBOURS)
    contacts = round(each * count)
    steps = (count / scene.stream.rate + life) / scene.run.dt + contacts
    return Effort(contacts, steps * step * fuller, False, f"roughly, from {what}")
