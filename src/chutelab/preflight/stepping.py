"""What finite steps mean for a scene that an engine with steps runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.preflight.results import Stepping

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.recording import Recording


def stepping(machine: Machine, engine: str, *recordings: Recording | None) -> Stepping:
    """Hold the way of a step against what a surface catches.

    The contact engine finds every blow at its own instant, as the pymunk engine does for a lone
    particle with aligned steps. Otherwise a contact is seen at the end of a step, and must be
    before the centre is on the other side: surfaces have no thickness.

    Parameters
    ----------
    machine : Machine
        The scene, resolved.
    engine : {"contact", "pymunk"}
        Which one runs it.
    *recordings : Recording or None
        Trial runs, as far as there are any; the first tells the highest speed.
    """
    bound = machine.particle.radius
    recording = next((found for found in recordings if found and len(found.knots)), None)
    speed = None
    if recording is not None:
        # Not every knot has the speed just before an impact; events do.
        seen = [recording.knots["velocity"], recording.events["velocity_before"]]
        speed = float(np.hypot(*np.concatenate(seen).T).max())
    return Stepping(
        dt=machine.dt,
        aligned=engine == "contact" or (machine.align and not machine.interact),
        speed=speed,
        way=None if speed is None else speed * machine.dt,
        bound=bound,
        longest=bound / speed if speed else None,
    )
