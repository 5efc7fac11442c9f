"""Surfaces that move, as kinematic bodies: Chipmunk is told where they are, and how fast."""

from __future__ import annotations

import numpy as np
import pymunk
from pymunk import Vec2d

from chutelab.engines.pymunk.world import Face, World
from chutelab.machine import Machine, Mover
from chutelab.util.arrays import Floats, Ints


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
            body.body_type = pymunk.Body.KINEMATIC
            # As written it is here; its shapes are counted from there.
            shapes = [shape for shape, its in world.by_shape.items() if its is face]
            links = [shape for shape in shapes if isinstance(shape, pymunk.Segment)]
            self.faces.append((face, body, mover, body.position, links))
            rows.append(row)
        self.rows = np.array(rows, dtype=np.int64)
        size = first + len(world.faces)
        self.place, self.velocity = np.zeros((2, 2, size))
        self.turn = np.zeros(size)
        self.turn[self.rows] = [mover.turn for _, _, mover, _, _ in self.faces]
        self.angle, self.center = np.zeros(size), center

    def put(self, t: float, h: float) -> None:
        """Place all for a step that begins at a time (s)."""
        for row, one in zip(self.rows, self.faces, strict=True):
            face, body, mover, written, links = one
            x, y, angle = mover.pose(t + 0.5 * h).tolist()
            vx, vy, turn = mover.velocity(t + h).tolist()
            place = Vec2d(*mover.carried(written, t + 0.5 * h).tolist())
            off = mover.carried(written, t + h) - mover.pose(t + h)[:2]
            velocity = Vec2d(vx - turn * off[1], vy + turn * off[0])
            body.position, body.angle = place - h * velocity, angle - h * turn
            body.velocity = velocity
            wheel = isinstance(face.shape, pymunk.Circle) and face.shape.radius > 0.0
            body.angular_velocity = turn + (face.spin if wheel else 0.0)
            self.place[:, row], self.velocity[:, row] = (x, y), (vx, vy)
            self.center[:, row] = place
            self.angle[row] = angle
            for link in links if face.speed else ():
                along = (link.b - link.a).normalized().rotated(angle)
                back = -1.0 if face.tangent is None else 1.0
                link.surface_velocity = back * face.speed * along

    def back(self, rows: Ints, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return directions (k,) at bodies, by their rows, as they are where these are at rest."""
        c, s = np.cos(self.angle[rows]), np.sin(self.angle[rows])
        return c * x + s * y, c * y - s * x

    def at(self, rows: Ints, places: Floats) -> Floats:
        """Return the velocity (m/s) at places (2, k), m, of bodies (k,) by their rows."""
        x, y = places - self.place[:, rows]
        turn = self.turn[rows]
        return np.asarray(self.velocity[:, rows] + np.stack([-turn * y, turn * x]))
