"""Surfaces that move: kinematic bodies, which are told where; what hangs by its own joints."""

from __future__ import annotations

from dataclasses import replace
from math import exp
from typing import Final

import numpy as np
import pymunk
from pymunk import Vec2d

from chutelab.engines.pymunk.world import Face, World
from chutelab.machine import Machine, Mover
from chutelab.util.arrays import Floats, Ints

COMES_BACK: Final = 0.02
"""s; in which what has gone beyond a stop within a step comes back to it, but for 1/e."""

SWEEPS: Final = 10
"""Iterations of Chipmunk for each face that hangs on a hinge with others: each turns with the first
one alone, so what strikes one takes as many sweeps as there are faces to reach them all."""


class Hanging:
    """What hangs on a hinge: a body a face, which pivots there; all of a surface turn together.

    Like a particle's place its angle in the Space is half a step behind, and is read so. Chipmunk
    tells of a joint's impulse its size only: a stop pushes inwards, and a motor, which drives and
    brakes, as what else acts and the change of momentum ask for.
    """

    def __init__(self, space: pymunk.Space, mover: Mover, bodies: list[pymunk.Body]) -> None:
        hinge, still, many = mover.hinge, space.static_body, len(bodies)
        assert hinge is not None
        self.hinge, self.surface, self.body, self.bodies = hinge, mover.surface, bodies[0], bodies
        x, y = hinge.moment
        pivot, weighs = Vec2d(*mover.pivot), hinge.mass > 0.0
        self.pivot, self.gravity = pivot, space.gravity
        # What has no weight has its mass at the hinge, where it does nothing.
        mass = hinge.mass if weighs else hinge.inertia / hinge.gyration**2
        middle = Vec2d(x, y) / mass if weighs else Vec2d.zero()
        space.iterations = max(space.iterations, SWEEPS * many)
        for body in bodies:
            body.body_type = pymunk.Body.DYNAMIC
            body.mass = mass / many
            body.moment = (hinge.inertia - mass * middle.dot(middle) * weighs) / many
            place = body.position
            body.center_of_gravity = pivot + middle - place
            body.position = place
            joints: list[pymunk.Constraint] = [pymunk.PivotJoint(still, body, pivot)]
            if body is not self.body:
                joints.append(pymunk.GearJoint(self.body, body, 0.0, 1.0))
            for joint in joints:
                joint.error_bias = 0.0
                space.add(joint)
        self.stop = pymunk.RotaryLimitJoint(still, self.body, *np.clip(hinge.stops, -1e9, 1e9))
        # What has gone beyond it comes back slowly: a stop that does so at once throws it back.
        self.stop.error_bias = exp(-1.0 / COMES_BACK)
        self.motor = pymunk.SimpleMotor(self.body, still, hinge.motor[0])
        self.motor.max_force = hinge.motor[1] if mover.begins == 0.0 else 0.0
        spring = pymunk.DampedRotarySpring(self.body, still, hinge.rest, hinge.spring, hinge.damper)
        space.add(self.stop, spring, *[self.motor] * (hinge.motor[1] > 0.0))
        self.before, self.work = 0.0, np.zeros(4)
        self.states = [(0.0, 0.0, 0.0, mover.surface, 0)]

    @property
    def rate(self) -> float:
        """How fast it turns, rad/s."""
        return float(self.body.angular_velocity)

    def step(self, t: float, h: float) -> None:
        """Note its state after a step that ended at a time (s), and what acted on it."""
        rate, mean = self.rate, 0.5 * (self.rate + self.before)
        inwards = -1.0 if self.body.angle > 0.5 * sum(np.clip(self.hinge.stops, -1e9, 1e9)) else 1.0
        stopped = inwards * self.stop.impulse
        if self.hinge.motor[1] > 0.0:
            asked = self.hinge.inertia * (rate - self.before) - stopped - self._moment(h, mean)
            self.work[0] += np.sign(asked) * self.motor.impulse * mean
        self.work[1] -= stopped * mean
        self.work[2] += self.hinge.damper * h * mean * mean
        self.states.append((t, self.body.angle + 0.5 * h * rate, rate, self.surface, 0))

    def _moment(self, h: float, rate: float) -> float:
        """Sum what weight, spring and contacts gave about the pivot in a step, N m s."""
        sprung = self.hinge.spring * (self.hinge.rest - self.body.angle) - self.hinge.damper * rate
        given = [h * sprung]

        def touched(arbiter: pymunk.Arbiter) -> None:
            for point in arbiter.contact_point_set.points:
                off, impulse = point.point_a - self.pivot, arbiter.total_impulse
                given.append(off.cross(impulse) / len(arbiter.contact_point_set.points))

        for body in self.bodies:
            weight = body.mass * self.gravity * h
            given.append((body.local_to_world(body.center_of_gravity) - self.pivot).cross(weight))
            body.each_arbiter(touched)
        return sum(given)


class Moving:
    """The faces of a world that move; `rows` are theirs among all bodies.

    Of these `center`, (2, bodies), is kept as they go.

    Chipmunk looks for contacts half-way through a step, and gives impulses with the velocities at
    its end: so a body is placed such that the step takes it to where its surface is half-way, at
    the velocity that it has at the end.
    """

    def __init__(self, machine: Machine, world: World, first: int, center: Floats) -> None:
        movers = {mover.surface: mover for mover in machine.movers}
        self.faces: list[tuple[Face, pymunk.Body, Mover, Vec2d, list[pymunk.Segment]]] = []
        rows = []
        for row, face in enumerate(world.faces, first):
            body, mover = face.shape.body, movers.get(face.surface)
            if mover is None or body is None:
                continue
            if mover.hinge is None:
                body.body_type = pymunk.Body.KINEMATIC
            # As written it is here; its shapes are counted from there.
            shapes = [shape for shape, its in world.by_shape.items() if its is face]
            links = [shape for shape in shapes if isinstance(shape, pymunk.Segment)]
            self.faces.append((face, body, mover, body.position, links))
            rows.append(row)
        self.rows = np.array(rows, dtype=np.int64)
        self.hanging: dict[int, Hanging] = {}
        # Bodies that are free would meet each other.
        for shape in world.by_shape if machine.scene.hinges else ():
            shape.filter = pymunk.ShapeFilter(group=2)
        for surface, mover in movers.items():
            if mover.hinge is not None:
                bodies = [body for face, body, *_ in self.faces if face.surface == surface]
                self.hanging[surface] = Hanging(world.space, mover, bodies)
        size = first + len(world.faces)
        self.place, self.velocity = np.zeros((2, 2, size))
        # Before a step and after it.
        self.turn = np.zeros((2, size))
        self.turn[:, self.rows] = [mover.velocity(0.0)[2] for _, _, mover, _, _ in self.faces]
        self.angle, self.center = np.zeros(size), center

    def start(self, surface: int, t: float) -> None:
        """Have a surface begin to move, or its motor, at a time (s)."""
        for k, (face, body, mover, written, links) in enumerate(self.faces):
            if face.surface == surface:
                self.faces[k] = face, body, replace(mover, begins=t), written, links
                self.turn[:, self.rows[k]] = mover.turn
        if surface in self.hanging:
            hanging = self.hanging[surface]
            hanging.motor.max_force = hanging.hinge.motor[1]

    def put(self, t: float, h: float) -> None:
        """Place all for a step that begins at a time (s)."""
        motion: dict[int, tuple[list[float], ...]] = {}
        for row, one in zip(self.rows, self.faces, strict=True):
            face, body, mover, written, links = one
            if mover.hinge is not None:
                self.hanging[face.surface].before = self.turn[0, row] = body.angular_velocity
                continue
            if face.surface not in motion:
                poses = mover.pose([t + 0.5 * h, t + h]).tolist()
                turned = ([*pose, np.cos(pose[2]), np.sin(pose[2])] for pose in poses)
                motion[face.surface] = *turned, mover.velocity(t + h).tolist()
            (x, y, angle, c, s), end, (vx, vy, turn) = motion[face.surface]
            ox, oy = written[0] - mover.pivot[0], written[1] - mover.pivot[1]
            place = Vec2d(x + c * ox - s * oy, y + s * ox + c * oy)
            x1, y1, _, c, s = end
            off = x1 + c * ox - s * oy - x1, y1 + s * ox + c * oy - y1
            velocity = Vec2d(vx - turn * off[1], vy + turn * off[0])
            body.position, body.angle = place - h * velocity, angle - h * turn
            body.velocity = velocity
            wheel = isinstance(face.shape, pymunk.Circle) and face.shape.radius > 0.0
            body.angular_velocity = turn + (face.spin if wheel else 0.0)
            self.place[:, row], self.velocity[:, row] = (x, y), (vx, vy)
            self.center[:, row] = place
            self.angle[row] = angle
            self._run(face, links, angle)

    def _run(self, face: Face, links: list[pymunk.Segment], angle: float) -> None:
        """Have a belt run along its surface at an angle (rad)."""
        for link in links if face.speed else ():
            along = (link.b - link.a).normalized().rotated(angle)
            back = -1.0 if face.tangent is None else 1.0
            link.surface_velocity = back * face.speed * along

    def swing(self, t: float, h: float) -> None:
        """Note what hangs on hinges after a step that ended at a time (s)."""
        for one in self.hanging.values():
            one.step(t, h)
        for row, (face, body, mover, written, links) in zip(self.rows, self.faces, strict=True):
            if mover.hinge is None:
                continue
            turned = Vec2d(*(written - mover.pivot)).rotated(body.angle)
            self.place[:, row], self.center[:, row] = mover.pivot, mover.pivot + turned
            self.angle[row], self.turn[1, row] = body.angle, body.angular_velocity
            self._run(face, links, body.angle)

    def back(self, rows: Ints, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return directions (k,) at bodies, by their rows, as they are where these are at rest."""
        c, s = np.cos(self.angle[rows]), np.sin(self.angle[rows])
        return c * x + s * y, c * y - s * x

    def at(self, rows: Ints, places: Floats) -> Floats:
        """Return velocities (m/s) at places (2, k), m, of bodies (k,) by their rows.

        Before the step and after it, (2, 2, k).
        """
        x, y = places - self.place[:, rows]
        turn = self.turn[:, rows]
        return np.asarray(self.velocity[:, rows] + np.stack([-turn * y, turn * x], axis=1))
