"""What will be built from a scene, and what is skipped because it does not need it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.preflight.results import Part

if TYPE_CHECKING:
    from collections.abc import Iterator

    from chutelab.machine import Machine
    from chutelab.scene import Scene


def built(machine: Machine) -> Iterator[Part]:
    """Yield the parts of a machine, world frame."""
    segments, ends = machine.segments, machine.segments.end
    for index, surface in enumerate(machine.surfaces):
        for k in (segments.surface == index).nonzero()[0]:
            # Rounding leaves 1e-17 where 0 is meant.
            (x0, y0), (x1, y1) = np.round([segments.start[k], ends[k]], 12) + 0.0
            moving = f", moving at {segments.speed[k]:.6g} m/s" if segments.speed[k] else ""
            yield Part(surface, f"from ({x0:.6g}, {y0:.6g}) to ({x1:.6g}, {y1:.6g}) m{moving}")
        if machine.pulley is not None and machine.pulley.surface == index:
            yield Part("pulley", f"radius {machine.pulley.radius:.6g} m, axis at (0, 0)")
    releases, p = machine.releases, machine.particle
    (x, y), (vx, vy) = releases.position[0], releases.velocity[0]
    turning = "a free disk" if p.inertia else "not turning"
    kind = "a mass point" if p.radius == 0.0 else f"radius {p.radius:.6g} m"
    many = f"{machine.count:,} of them, each " if machine.count > 1 else ""
    yield Part("particle", f"{many}{kind}, mass {p.mass:.6g} kg, {turning}")
    last = f", the last at t = {releases.t[-1]:.6g} s" if machine.count > 1 else ""
    yield Part("release", f"the first from ({x:.6g}, {y:.6g}) m at ({vx:.6g}, {vy:.6g}) m/s{last}")


def skipped(scene: Scene, machine: Machine, engine: str) -> Iterator[Part]:
    """Yield what the scene does without, and why."""
    for table in ("incoming", "plate", "outgoing", "surface"):
        if not getattr(scene, table):
            written = f"[[{table}]]" if table == "surface" else f"[{table}]"
            name = "surfaces" if table == "surface" else table
            yield Part(name, f"the scene has no {written}")
    if machine.particle.inertia == 0.0:
        yield Part("rotation", "particle.spin = false")
    if not machine.interact:
        why = "stream.count = 1" if machine.count == 1 else "stream.interact = false"
        yield Part("collisions", f"of particles with each other: {why}")
    if engine == "exact":
        yield Part("steps", "the next event is solved for, so no flight is stepped")
    elif engine == "contact" or (machine.align and not machine.interact):
        yield Part("flights", "only contacts that last are stepped, blows have their own instants")
    if machine.until == "landed":
        yield Part("what follows", 'the first touch of the outgoing belt: run.until = "landed"')
