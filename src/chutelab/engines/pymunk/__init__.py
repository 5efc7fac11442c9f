"""The machine in Pymunk: Chipmunk finds the contacts and solves them.

It shares only the machine and the recorder with the other engines: an independent check.

- `faces`: surfaces as one particle meets them; free flight.
- `world`: the surfaces as a `pymunk.Space`; where a path meets them; rides by adhesion.
- `lone`: one particle whose steps end at its contacts.
- `shared`: all particles in one Space, in steps of equal length.
- `moving`: moving surfaces; strings, rods, springs and pins; rolling friction; air drag.
- `shapes`: bodies and shapes, chains for arcs, and values for Chipmunk's contacts.
"""

from __future__ import annotations

from time import perf_counter

import numpy as np

from chutelab.engines.pymunk.lone import Lone
from chutelab.engines.pymunk.shared import Shared
from chutelab.engines.pymunk.world import World
from chutelab.machine import Machine
from chutelab.results.record import Record
from chutelab.results.recorder import EnoughError, Recorder, StalledError
from chutelab.results.rows import REASONS
from chutelab.util.arrays import Progress

LOOK, SLICE = 64, 0.05
"""A report of progress comes after so many steps or s of wall time, whichever is first."""


def run(machine: Machine, progress: Progress | None = None) -> Record:
    """Run a machine in Pymunk.

    `progress` is called now and then with the share of the run that is done, and may end the run.
    With `align`, impacts of a lone particle are exact to rounding and its lasting contacts of order
    2 in the step, which is at most `dt` and moves it by at most half a radius. Order 1 have
    particles that meet, boxes, joints, surfaces that move or are solid from one side, air, and
    steps of equal length: there `dt` times the speed should be less than the radius, or half a
    box's width, or particles overlap by as much, and pass through surfaces.

    Raises a `ValueError` if a particle has no radius; a `StalledError`, which has the recording so
    far, if a lone particle makes no progress.
    """
    if np.count_nonzero(np.less_equal(machine.particle.radius, 0.0)):
        raise ValueError("particle.radius = 0: pymunk needs disks with a radius above 0 m")
    recorder, steps, stuck = Recorder(machine), 0, None
    machine = recorder.near
    asked, told = 0, perf_counter()

    def report(share: float) -> None:
        nonlocal asked, told
        asked += 1
        if progress is not None and (asked % LOOK == 0 or perf_counter() - told > SLICE):
            told = perf_counter()
            progress(share)

    boxes = any(outline is not None for outline in machine.outlines)
    apart = not (machine.interact or boxes or machine.joints or machine.movers)
    apart = apart and not (machine.triggers or machine.scene.one_sided) and machine.align
    world = World(machine, alone=apart)
    try:
        if not apart:
            shared = Shared(machine, world, recorder)
            try:
                shared.run(report)
            finally:
                steps = shared.steps
        else:
            alike = len(machine.pair_restitution) == 1 and not np.ndim(machine.particle.radius)
            for i in range(machine.count):
                if not alike:
                    world = World(machine, i, alone=True)
                lone = Lone(machine, world, recorder, i, report)
                try:
                    lone.run()
                except EnoughError:
                    recorder.ended[i + 1 :] = REASONS.index("stopped")
                    raise
                finally:
                    steps += lone.steps
        if progress is not None:
            progress(1.0)
    except EnoughError:
        pass
    except StalledError as stalled:
        stuck = stalled
    if recorder.bins is not None:
        recorder.impulses = recorder.bins.counted()
    return recorder.whole(recorder.finish(engine="pymunk", steps=steps), stuck)
