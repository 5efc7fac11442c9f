"""Plain Pymunk, as most people write it: the method to beat, and no part of the product.

Bodies and segments, `Space.step(dt)` in a loop, the position read after every step. That is: a
fixed step; Pymunk's own contacts, defaults everywhere else (10 iterations, no damping); belts with
a surface velocity, on which particles ride. The particle has left the pulley when it is past its
top, met the plate when it moves back, and landed when it is at or under the belt's level, each
noticed after the step in which it happens; the landing velocity is the one before that step.

In four things it is better than what most people write, or it would be no contest: segments are
4 mm thick, so that little tunnels, and lie behind the faces, not across them; elasticities
and frictions are set so that Pymunk's products are the scene's pair values; `collision_slop` is 1 %
of the radius, for its default of 0.1, meant for pixels, lets a disk of 4 mm sink through a belt;
and where particles do not interact, those that have landed leave the Space.
"""

from __future__ import annotations

from math import ceil, inf, sqrt
from typing import Any

import numpy as np
import pymunk

from chutelab.machine import build
from chutelab.scene import Scene
from chutelab.util.arrays import Floats
from workprecision.cases import FRAME, Answer

SLOP = 0.01
"""Overlap, in radii, that is left alone."""

GRIP = 1e3
"""Coefficient of friction that stands for adhesion."""

ALIKE = 1e-9
"""Share of the belt's speed within which a particle is as fast as the belt."""

ASLEEP = 10
"""Steps after which Pymunk puts a body to sleep that moves no more; they are taken off again."""

BELOW = 1.0
"""m under the lowest surface, from where on nothing is met any more."""

HALF_THICKNESS = 2e-3
"""m; radius of segments."""


class _World:
    """A Space with the surfaces of a scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.space = pymunk.Space()
        self.space.gravity = (0.0, -scene.gravity)
        self.space.collision_slop = SLOP * scene.particle.radius
        self.elasticity = sqrt(scene.stream.restitution) if scene.stream.interact else 1.0
        self.friction = sqrt(scene.stream.friction) if scene.stream.interact else 1.0
        self.lowest = 0.0
        belt, plate, out = scene.incoming, scene.plate, scene.outgoing
        if belt is not None:
            top = belt.pulley_radius
            grip = GRIP if belt.friction == "adhesion" else float(belt.friction)
            self._line((-belt.length, top), (0.0, top), belt.restitution, grip, belt.speed)
            pulley = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            pulley.angular_velocity = -belt.speed / top
            drum = pymunk.Circle(pulley, top)
            self._surface(drum, belt.restitution, grip)
            self.space.add(pulley, drum)
            if plate is not None and plate.pivot_height is not None:
                x, y = top + plate.distance, plate.pivot_height
                low, high = y - (plate.below or 0.0), y + plate.above
                self._line((x, low), (x, high), plate.restitution, plate.friction)
            if out is not None:
                y = self.lowest = top - out.drop
                self._line(
                    (out.start, y), (out.start + out.length, y),
                    out.restitution, out.friction, out.speed,
                )  # fmt: skip
        for free in scene.surface:
            for a, b in zip(free.points, free.points[1:], strict=False):
                self._line(a, b, free.restitution, free.friction, free.speed)

    def _line(
        self,
        a: tuple[float, float],
        b: tuple[float, float],
        restitution: float,
        friction: float,
        speed: float = 0.0,
    ) -> None:
        """Add a surface whose struck face is the left one, seen from a to b."""
        along = (pymunk.Vec2d(*b) - a).normalized()
        behind = HALF_THICKNESS * pymunk.Vec2d(along.y, -along.x)
        line = pymunk.Segment(self.space.static_body, a + behind, b + behind, HALF_THICKNESS)
        self._surface(line, restitution, friction)
        line.surface_velocity = (speed, 0.0)
        self.space.add(line)

    def _surface(self, shape: pymunk.Shape, restitution: float, friction: float) -> None:
        shape.elasticity = restitution / self.elasticity
        shape.friction = friction / self.friction

    def add(self, position: Any, velocity: Any) -> pymunk.Body:
        """Put a particle in."""
        p = self.scene.particle
        body = pymunk.Body(p.mass, inf)
        shape = pymunk.Circle(body, p.radius)
        shape.elasticity, shape.friction = self.elasticity, self.friction
        if not self.scene.stream.interact:
            shape.filter = pymunk.ShapeFilter(group=1)
        body.position, body.velocity = tuple(position), tuple(velocity)
        self.space.add(body, shape)
        return body

    def remove(self, body: pymunk.Body) -> None:
        """Take a particle out."""
        self.space.remove(body, *body.shapes)


def transfer(scene: Scene, dt: float) -> Answer:
    """Step one particle until it has landed."""
    return _alone(scene, dt, grip=False)


def belt(scene: Scene, dt: float) -> Answer:
    """Step one particle until it is as fast as the outgoing belt."""
    return _alone(scene, dt, grip=True)


def _alone(scene: Scene, dt: float, *, grip: bool) -> Answer:
    world, out = _World(scene), scene.outgoing
    assert out is not None
    starts = build(scene).releases
    body = world.add(starts.position[0], starts.velocity[0])
    level = world.lowest + scene.particle.radius
    track = [(0.0, *body.position)]
    left = hit = down = None
    answer: dict[str, float] = {}
    for n in range(1, ceil(scene.run.max_time / dt) + 1):
        before = body.velocity
        world.space.step(dt)
        t, (x, y), v = n * dt, body.position, body.velocity
        track.append((t, x, y))
        if left is None and x >= 0.0:
            left = (t, y)
        if hit is None and left is not None and v.x < 0.0:
            hit = (t, x)
            answer |= {"t2": t - left[0], "y2": left[1] - y}
        if down is None and hit is not None and y <= level:
            down = (t, x)
            answer |= {"t3": t - hit[0], "x3": hit[1] - x, "v3x": -before.x, "v3y": -before.y}
            if not grip:
                break
        elif down is not None and abs(v.x - out.speed) <= ALIKE * abs(out.speed):
            answer |= {"t_grip": t - down[0], "x_grip": x - down[1]}
            break
        if y < world.lowest - BELOW:
            break
    names = ("t2", "y2", "t3", "x3", "v3x", "v3y", *(("t_grip", "x_grip") if grip else ()))
    return {name: np.array([answer.get(name, np.nan)]) for name in names}


def bounce(scene: Scene, dt: float) -> Answer:
    """Step one particle until Pymunk's own sleeping finds it at rest."""
    world = _World(scene)
    world.space.sleep_time_threshold = ASLEEP * dt
    assert scene.stream.at is not None
    body = world.add(scene.stream.at, (0.0, 0.0))
    track = [(0.0, *scene.stream.at)]
    for n in range(1, ceil(scene.run.max_time / dt) + 1):
        world.space.step(dt)
        track.append((n * dt, *body.position))
        if body.is_sleeping:
            break
    still = (n - ASLEEP) * dt if body.is_sleeping else np.nan
    return {"t_rest": np.array([still]), "y_rest": np.array([body.position.y])}


def independent(scene: Scene, dt: float) -> Answer:
    """Step all particles in one Space, filtered not to collide, each until it has landed.

    Each is put in before the first step that begins no earlier than its release, and its times
    count from there.
    """
    world, starts = _World(scene), build(scene).releases
    count, level = len(starts.t), world.lowest + scene.particle.radius
    names = ("t2", "y2", "t3", "x3", "v3x", "v3y")
    answer = {name: np.full(count, np.nan) for name in names}
    begun, hit_at = np.zeros(count), np.zeros((count, 2))
    flying: dict[int, pymunk.Body] = {}
    speed: dict[int, pymunk.Vec2d] = {}
    struck: set[int] = set()
    due = 0
    for n in range(1, ceil((float(starts.t[-1]) + scene.run.max_time) / dt) + 1):
        while due < count and starts.t[due] <= (n - 1) * dt:
            flying[due] = world.add(starts.position[due], starts.velocity[due])
            begun[due] = (n - 1) * dt
            due += 1
        for i, body in flying.items():
            speed[i] = body.velocity
        world.space.step(dt)
        gone = []
        for i, body in flying.items():
            (x, y), v = body.position, body.velocity
            if i not in struck and v.x < 0.0:
                struck.add(i)
                hit_at[i] = n * dt, x
                answer["t2"][i] = n * dt - begun[i]
                answer["y2"][i] = starts.position[i, 1] - y
            if i in struck and y <= level:
                gone.append(i)
                answer["t3"][i], answer["x3"][i] = n * dt - hit_at[i, 0], hit_at[i, 1] - x
                answer["v3x"][i], answer["v3y"][i] = -speed[i].x, -speed[i].y
            elif y < world.lowest - BELOW:
                gone.append(i)
        for i in gone:
            world.remove(flying.pop(i))
        if due == count and not flying:
            break
    return answer


def interacting(scene: Scene, dt: float) -> Floats:
    """Step all particles in one Space for the time asked for; return frames (T, N, 2)."""
    world, starts = _World(scene), build(scene).releases
    count, end = len(starts.t), float(scene.run.until)
    bodies: list[pymunk.Body] = []
    frames: list[Floats] = []
    for n in range(1, round(end / dt) + 1):
        while len(bodies) < count and starts.t[len(bodies)] <= (n - 1) * dt:
            i = len(bodies)
            bodies.append(world.add(starts.position[i], starts.velocity[i]))
        world.space.step(dt)
        if n * dt >= (len(frames) + 1) * FRAME - 0.5 * dt:
            frame = np.full((count, 2), np.nan)
            frame[: len(bodies)] = [body.position for body in bodies]
            frames.append(frame)
    return np.array(frames)
