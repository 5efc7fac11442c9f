"""Run time, ledger and overlaps of `stream`, beside a bare loop of `space.step`.

    python tests/benchmarks/stream.py [DT ...]

The bare loop has the same solids and disks, each from its release on, carried by a belt that holds
it, then free; it does nothing but step: no forecasts, no books, no recording. Overlaps are those of
all pairs and solids
that touch, looked at every millisecond, as shares of the radius.
"""

import sys
from math import acos, cos, sin
from statistics import median
from time import process_time

import numpy as np
import pymunk

from chutelab import load, simulate
from chutelab.ledger import ledger
from chutelab.machine import build
from chutelab.recording import Kind
from chutelab.stepper.solids import SLOP, solids

REPEATS = 3
LOOK = 1e-3
"""s between two looks at the overlaps."""


def entries(machine):
    """Time, place and velocity of each disk on the belt, and as it leaves it."""
    start = machine.releases
    for t, (x, rho), (v, _) in zip(start.t, start.position, start.velocity, strict=True):
        phi = acos(min(1.0, v**2 / (machine.gravity * rho)))
        place, course = (rho * sin(phi), rho * cos(phi)), (v * cos(phi), -v * sin(phi))
        yield t, ((x, rho), (v, 0.0)), t + (rho * phi - x) / v, (place, course)


def space_of(machine, shapes):
    space = pymunk.Space()
    space.gravity = (0.0, -machine.gravity)
    space.collision_slop = SLOP * machine.particle.radius
    own, grip = machine.pair_restitution**0.5, machine.pair_friction**0.5
    for k, (a, b, behind) in enumerate(zip(shapes.a, shapes.b, shapes.behind, strict=True)):
        if k == shapes.pulley:
            body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            body.angular_velocity = -float(shapes.speed[k] / shapes.reach[k])
            shape = pymunk.Circle(body, float(shapes.reach[k]))
        else:
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
            corners = [a, b, b + behind, a + behind]
            shape = pymunk.Poly(body, [tuple(c.tolist()) for c in corners])
            shape.surface_velocity = tuple((shapes.speed[k] * shapes.tangent[k]).tolist())
        shape.elasticity = float(shapes.restitution[k]) / own
        shape.friction = float(shapes.friction[k]) / grip
        space.add(body, shape)
    return space, own, grip


def bare(machine, shapes, dt, end, looks=None):
    """Return the seconds that `space.step` took, calling `looks(t, positions)` now and then."""
    space, own, grip = space_of(machine, shapes)
    p = machine.particle
    moments = []
    for n, (t, on_belt, away, leaving) in enumerate(entries(machine)):
        moments += [(t, n, True, on_belt), (away, n, False, leaving)]
    moments.sort(reverse=True)
    free = pymunk.ShapeFilter(categories=1)
    held = pymunk.ShapeFilter(categories=2, mask=1)
    bodies, seconds, next_look = {}, 0.0, 0.0
    for n in range(round(end / dt)):
        while moments and moments[-1][0] <= n * dt:
            _, k, carried, (place, course) = moments.pop()
            if carried:
                body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            else:
                space.remove(bodies[k], *bodies[k].shapes)
                body = pymunk.Body(p.mass, p.inertia if p.inertia > 0.0 else float("inf"))
            body.position, body.velocity = place, course
            shape = pymunk.Circle(body, p.radius)
            shape.elasticity, shape.friction = own, grip
            shape.filter = held if carried else free
            space.add(body, shape)
            bodies[k] = body
        begin = process_time()
        space.step(dt)
        seconds += process_time() - begin
        if looks is not None and n * dt >= next_look:
            moved = [b.position for b in bodies.values() if b.body_type == pymunk.Body.DYNAMIC]
            looks(n * dt, np.array(moved).reshape(-1, 2))
            next_look += LOOK
    return seconds


class Overlaps:
    """Collects overlaps, in radii, of what touches."""

    def __init__(self, machine, shapes):
        self.radius, self.shapes, self.found = machine.particle.radius, shapes, []

    def __call__(self, _t, x):
        if not len(x):
            return
        gaps = self.shapes.gaps(x, self.radius)
        apart = x[:, None] - x[None]
        pairs = np.hypot(apart[..., 0], apart[..., 1])[np.triu_indices(len(x), 1)]
        for gap in (gaps.ravel(), pairs - 2.0 * self.radius):
            self.found.append(-gap[gap < 0.0] / self.radius)

    def __str__(self):
        found = np.concatenate(self.found)
        return f"{100 * found.max():.2f} % at worst, {100 * np.percentile(found, 99):.3f} % at 99"


def looked_at(recording, machine, shapes):
    overlaps = Overlaps(machine, shapes)
    left = recording.first(recording.select(Kind.SEPARATION))["t"]
    times = np.arange(0.0, recording.events["t"][-1], LOOK)
    for some in np.array_split(times, max(1, len(times) // 200)):
        position, _ = recording.at(some)
        for t, x in zip(some, position, strict=True):
            overlaps(t, x[np.isfinite(x[:, 0]) & (left <= t)])
    return overlaps


def main(steps):
    for dt in steps:
        scene = load("stream", [f"run.dt={dt}"])
        machine = build(scene)
        shapes = solids(machine)
        ours, theirs = [], []
        for _ in range(REPEATS):
            begin = process_time()
            recording = simulate(scene)
            ours.append(process_time() - begin)
            end = float(recording.events["t"][-1])
            theirs.append(bare(machine, shapes, 1e-3, end))
        coarse, fine = Overlaps(machine, shapes), Overlaps(machine, shapes)
        bare(machine, shapes, 1e-3, end, coarse)
        slow = bare(machine, shapes, 1e-4, end, fine)
        print(f"dt = {dt:g} s, {recording.steps} steps, until {end:.2f} s")
        print(
            f"  chutelab         {median(ours):.2f} s, overlaps "
            f"{looked_at(recording, machine, shapes)},"
        )
        print(f"                   ledger residual {ledger(recording).relative_residual:.1e}")
        print(f"  bare, dt = 1e-3  {median(theirs):.2f} s, overlaps {coarse}")
        print(f"  bare, dt = 1e-4  {slow:.2f} s, overlaps {fine}")
        print(
            f"  ratio to bare at 1e-3: {median(ours) / median(theirs):.2f}, "
            f"at 1e-4: {median(ours) / slow:.2f}"
        )


if __name__ == "__main__":
    main([float(a) for a in sys.argv[1:]] or [1e-3])
