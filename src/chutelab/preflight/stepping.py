"""What finite steps mean for a scene that the pymunk engine runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.preflight.results import Stepping

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.recording import Recording


def stepping(machine: Machine, *recordings: Recording | None) -> Stepping:
    """Hold the way of a step against what a surface catches.

    Parameters
    ----------
    machine : Machine
        The scene, resolved.
    *recordings : Recording or None
        Trial runs, as far as there are any; the first tells the highest speed.
    """
    # Not for a scene that the exact engine runs: this imports pymunk.
    from chutelab.stepper import HALF_THICKNESS
    from chutelab.stepper.solids import SLOP

    radius = machine.particle.radius
    bound = radius + HALF_THICKNESS
    recording = next((found for found in recordings if found and len(found.knots)), None)
    speed = None
    if recording is not None:
        # Not every knot has the speed just before an impact; events do.
        seen = [recording.knots["velocity"], recording.events["velocity_before"]]
        speed = float(np.hypot(*np.concatenate(seen).T).max())
    return Stepping(
        dt=machine.dt,
        aligned=machine.align,
        speed=speed,
        way=None if speed is None else speed * machine.dt,
        bound=bound,
        longest=bound / speed if speed else None,
        slop=SLOP * radius,
        slop_to_radius=SLOP,
    )
