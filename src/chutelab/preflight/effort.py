"""Contacts and run time, estimated from a trial run of the stream's first particles.

Independent particles all cost alike, so contacts follow by rule of three. In a jet of colliding
particles each meets a little more of them the more there are. On the way to rest it meets its
neighbours, the more the denser they come to lie on the belt. Counted on `stream` with 8 to 200
particles, 50 and 200 a second, and on `free-fall` with 30 particles that meet, the estimate is good
to a factor of three.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from chutelab.preflight.results import Effort
from chutelab.preflight.trial import is_crowd
from chutelab.recording import Kind

if TYPE_CHECKING:
    from chutelab.preflight.trial import Trial
    from chutelab.scene import Scene

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
    if is_crowd(scene) and (tried.landed or tried.recording is None):
        return _crowd(scene, tried)
    count, some, recording = scene.stream.count, tried.count, tried.recording
    who = _who(count, some)
    if recording is None:
        if tried.lone is not None:
            contacts = tried.lone.contacts * count
        else:
            contacts = max(1, tried.rounds // ROUNDS) * count
        how = f"a trial run of {who} was cut off after {tried.seconds:.1g} s"
        return Effort(contacts, tried.seconds * count / some, True, how)
    collided = int(np.count_nonzero(recording.events["kind"] == Kind.COLLISION))
    alone, crowding = recording.contacts - collided, sqrt(count / some)
    contacts = round((alone + collided * crowding) * count / some)
    growth = count / some
    if engine == "exact":
        growth = (TOGETHER + count) / (TOGETHER + some)
    elif is_crowd(scene):
        lasted = float(recording.ends()[1]["t"].max(initial=0.0))
        later = (count - some) / scene.stream.rate
        growth = (1.0 + later / lasted if lasted > 0.0 else 1.0) * _bodies(count, some)
    how = "timed in" if some == count else "scaled up from"
    return Effort(
        contacts, tried.warming + tried.seconds * growth, False, f"{how} a trial run of {who}"
    )


def _crowd(scene: Scene, tried: Trial) -> Effort:
    """Estimate a crowd that comes to rest, or whose trial was cut off."""
    count, some, recording = scene.stream.count, tried.count, tried.recording
    each, step, what = IN_THE_JET, STEP, "nominal figures"
    if recording is not None and recording.steps:
        each = recording.contacts / some
        step = tried.seconds / recording.steps
        what = f"a trial run of {_who(count, some)} up to their landing, and nominal figures"
    life = scene.run.max_time
    if tried.lone is not None:
        each = max(each, float(tried.lone.contacts))
        life = float(np.ptp(tried.lone.knots["t"]))
    if scene.run.until != "landed":
        each += TO_REST * _density(scene) * count / (count + NEIGHBOURS)
    contacts = round(each * count)
    steps = (count / scene.stream.rate + life) / scene.run.dt + contacts
    seconds = steps * step * _bodies(count, some)
    return Effort(contacts, seconds, False, f"roughly, from {what}")


def _density(scene: Scene) -> float:
    """Return the share of the outgoing belt that the particles cover, side by side; at most 1."""
    if scene.outgoing is None:
        return 1.0
    way = abs(scene.outgoing.speed) / scene.stream.rate
    diameter = 2.0 * scene.particle.radius
    return diameter / way if way > diameter else 1.0


def _bodies(count: int, some: int) -> float:
    """Return how much longer a step takes with all particles than with a few."""
    return (BODIES + count) / (BODIES + some)


def _who(count: int, some: int) -> str:
    if some == 1:
        return "the only particle" if count == 1 else f"the first of {count:,} particles"
    return f"all {count} particles" if some == count else f"the first {some} of {count:,} particles"
