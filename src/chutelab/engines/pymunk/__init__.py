"""The machine in Pymunk: Chipmunk finds the contacts and solves them.

Nothing here is shared with the other engines but the machine and the recorder: the check from
outside.

- `world`: the machine as a `pymunk.Space`; tracks and books.
- `carriage`: the adhesion ride, in closed form.
- `lone`: one particle whose steps end at its contacts.
- `shared`: particles in one Space, in steps that are all alike.
"""

from __future__ import annotations

from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

from chutelab.engines.pymunk.lone import Lone
from chutelab.engines.pymunk.shared import Shared
from chutelab.engines.pymunk.world import World
from chutelab.machine import moved, origin
from chutelab.recorder import Recorder, StalledError

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.machine import Machine
    from chutelab.recording import Recording


def run(machine: Machine, progress: Callable[[float], None] | None = None) -> Recording:
    """Run a machine in Pymunk.

    Parameters
    ----------
    machine : Machine
        From `chutelab.machine.build`; the radius must be more than 0.
    progress : callable, optional
        Called with the share of the run that is done.

    Returns
    -------
    Recording
        With `align`, a lone particle's blows to rounding error and its lasting contacts of order 2
        in the step, which is no longer than `dt` and half a radius' way. Particles that meet, and
        steps that are all alike, of order 1.

    Raises
    ------
    ValueError
        If the particle has no radius.
    StalledError
        If a lone particle goes on without getting on; it has the recording so far.
    """
    if machine.particle.radius <= 0.0:
        raise ValueError("particle.radius = 0: pymunk needs disks with a radius above 0 m")
    begin, steps = perf_counter(), 0
    place = origin(machine)
    machine = moved(machine, -place[0], -place[1])
    recorder = Recorder(machine.count, machine.surfaces)

    def finished() -> Recording:
        return recorder.finish(
            scene=machine.text, title=machine.title, engine="pymunk", particle=machine.particle,
            gravity=machine.gravity, steps=steps, seconds=perf_counter() - begin, origin=place,
        )  # fmt: skip

    def report(done: int, share: float) -> None:
        if progress is not None:
            progress((done + share) / len(groups))

    everybody = range(machine.count)
    groups = [everybody] if machine.interact else [range(i, i + 1) for i in everybody]
    lone = machine.align and not machine.interact
    world = World(machine)
    try:
        for n, group in enumerate(groups):
            part: Lone | Shared
            if lone:
                part = Lone(machine, world, recorder, group[0])
            else:
                part = Shared(machine, World(machine), recorder, group)
            try:
                part.run(partial(report, n))
            finally:
                steps += part.steps
        report(len(groups), 0.0)
    except StalledError as stalled:
        stalled.recording = finished()
        x, y = stalled.position
        stalled.position = x + place[0], y + place[1]
        raise
    return finished()
