"""The pymunk side: bodies in, contacts and states out. No other module imports pymunk."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import TYPE_CHECKING

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk import batch

from chutelab.stepper.clash import move
from chutelab.stepper.partners import Partners
from chutelab.stepper.solids import SLOP, Solids

if TYPE_CHECKING:
    from chutelab.machine import Machine

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SMALLEST_SHARE = 1e-12
"""Pymunk multiplies the values of two shapes; a pair value of 0 becomes this, so that the others
can be divided by its root."""

ITERATIONS = 30
"""Of the contact solver; pymunk's 10 leave the lower layers of a pile pressed into each other."""

FREE, CARRIED, SOLID = 1, 2, 4
"""Categories of shapes: only pairs with a free particle in them collide."""

_ARBITER = (
    batch.ArbiterFields.BODY_A_ID
    | batch.ArbiterFields.BODY_B_ID
    | batch.ArbiterFields.TOTAL_IMPULSE
    | batch.ArbiterFields.NORMAL
)
_BODY = (
    batch.BodyFields.BODY_ID
    | batch.BodyFields.POSITION
    | batch.BodyFields.VELOCITY
    | batch.BodyFields.ANGULAR_VELOCITY
)


_Disk = tuple[pymunk.Body, pymunk.Circle, np.uintp]


@dataclass(eq=False, slots=True)
class Contacts:
    """Contacts of one step that pressed, sorted by their keys.

    Attributes
    ----------
    keys : ndarray, (M,)
        A number for each pair, the same in every step.
    first : ndarray, (M,)
        Particle.
    other : ndarray, (M,)
        Partner: another particle, or the number of particles plus a solid's index.
    normal : ndarray, (M, 2)
        Unit normal towards the first.
    impulse : ndarray, (2, M)
        Impulses of the whole step on the first, along the normal n and along (n_y, -n_x), N s.
    pairs, fixed : ndarray
        Rows of contacts with particles, and with solids.
    uses : ndarray, (N + K,)
        Number of contacts of each particle, and of each solid.
    """

    keys: Ints
    first: Ints
    other: Ints
    normal: Floats
    impulse: Floats
    pairs: Ints
    fixed: Ints
    uses: Ints

    def __len__(self) -> int:
        return len(self.first)

    def turned(self, rows: NDArray[np.bool_]) -> Contacts:
        """Return the contacts with the two particles of some rows exchanged."""
        return replace(
            self,
            first=np.where(rows, self.other, self.first),
            other=np.where(rows, self.first, self.other),
            normal=np.where(rows, -1.0, 1.0)[:, None] * self.normal,
        )


class World:
    """A Space with the machine's solids and up to `count` particles, known by their numbers.

    Velocities given and returned are those pymunk moves bodies with: half a step of gravity ahead
    in flight (a step moves positions first, velocities then).

    Attributes
    ----------
    partners : Partners
        What particles find in each other and in solids.
    """

    def __init__(self, machine: Machine, solids: Solids, count: int) -> None:
        self.count = count
        self.partners = Partners(machine, solids, count)
        self._machine = machine
        self._space = pymunk.Space()
        self._space.gravity = (0.0, -machine.gravity)
        self._space.collision_slop = SLOP * machine.particle.radius
        self._space.iterations = ITERATIONS
        # A contact that ends is forgotten at once: what pymunk remembers longer it reports as part
        # of the impulse when the pair meets again, without applying it.
        self._space.collision_persistence = 1
        self._restitution = self._friction = 1.0
        if machine.interact:
            self._restitution = sqrt(max(machine.pair_restitution, SMALLEST_SHARE))
            self._friction = sqrt(max(machine.pair_friction, SMALLEST_SHARE))
        self._disks: dict[int, _Disk] = {}
        # Bodies to use again, of free and of carried particles: a new one costs more than a step.
        self._spare: tuple[list[_Disk], list[_Disk]] = [], []
        self._fixed = [self._solid(solids, k) for k in range(len(solids.reach))]
        self._buffer = batch.Buffer()
        # Sorted ids of all bodies, and which particle or, beyond them, solid each stands for.
        self._ids = np.empty(0, dtype=np.uintp)
        self._codes = np.empty(0, dtype=np.int64)
        for code, body in enumerate(self._fixed, count):
            self._enrol(body, code)

    def _solid(self, solids: Solids, k: int) -> pymunk.Body:
        speed, reach = float(solids.speed[k]), float(solids.reach[k])
        turning = k == solids.pulley and speed != 0.0
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC if turning else pymunk.Body.STATIC)
        shape: pymunk.Shape
        if k == solids.pulley:
            body.angular_velocity = -speed / reach
            shape = pymunk.Circle(body, reach)
        else:
            face = [tuple(solids.a[k].tolist()), tuple(solids.b[k].tolist())]
            back = [tuple((end + solids.behind[k]).tolist()) for end in (solids.b[k], solids.a[k])]
            shape = pymunk.Poly(body, [*face, *back])
            shape.surface_velocity = tuple(speed * solids.tangent[k])
        shape.elasticity = float(solids.restitution[k]) / self._restitution
        shape.friction = float(solids.friction[k]) / self._friction
        shape.filter = pymunk.ShapeFilter(categories=SOLID, mask=FREE)
        self._space.add(body, shape)
        return body

    def add(self, particle: int, *, carried: bool = False) -> None:
        """Put a particle in, to be placed; a carried one pushes but is not pushed."""
        spare = self._spare[carried]
        disk = body, shape, name = spare.pop() if spare else self._disk(carried=carried)
        self._space.add(body, shape)
        self._disks[particle] = disk
        self._codes[self._ids.searchsorted(name)] = particle

    def _enrol(self, body: pymunk.Body, code: int) -> np.uintp:
        name = np.uintp(body.id)
        place = self._ids.searchsorted(name)
        self._ids = np.insert(self._ids, place, name)
        self._codes = np.insert(self._codes, place, code)
        return name

    def _disk(self, *, carried: bool) -> _Disk:
        p = self._machine.particle
        if carried:
            body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        else:
            body = pymunk.Body(p.mass, p.inertia if p.inertia > 0.0 else inf)
        shape = pymunk.Circle(body, p.radius)
        shape.elasticity, shape.friction = self._restitution, self._friction
        shape.filter = (
            pymunk.ShapeFilter(categories=CARRIED, mask=FREE)
            if carried
            else pymunk.ShapeFilter(categories=FREE)
        )
        return body, shape, self._enrol(body, -1)

    def remove(self, particle: int) -> None:
        """Take a particle out."""
        disk = body, shape, _ = self._disks.pop(particle)
        self._space.remove(body, shape)
        body.force = 0.0, 0.0
        self._spare[body.body_type == pymunk.Body.KINEMATIC].append(disk)

    def place(
        self,
        particle: int,
        position: tuple[float, float],
        velocity: tuple[float, float],
        omega: float = 0.0,
    ) -> None:
        """Overwrite the state of a particle."""
        body = self._disks[particle][0]
        body.position = position
        move(body, velocity, omega)

    def steer(
        self, particle: int, velocity: tuple[float, float], force: tuple[float, float]
    ) -> None:
        """Overwrite a velocity, and add a force (N) that acts in the next step, after the move."""
        body = self._disks[particle][0]
        body.velocity, body.force = velocity, force

    def step(self, dt: float) -> None:
        """Advance by one step."""
        self._space.step(dt)

    def contacts(self) -> Contacts | None:
        """Return the contacts of the last step, None if there were none."""
        self._buffer.clear()
        batch.get_space_arbiters(self._space, _ARBITER, self._buffer)
        raw = self._buffer.int_buf()
        if not len(raw):
            return None
        codes = self._codes[self._ids.searchsorted(np.frombuffer(raw, dtype=np.uintp))]
        values = np.frombuffer(self._buffer.float_buf()).reshape(-1, 4)
        a, b = codes[::2], codes[1::2]
        span = self.count + len(self._fixed)
        first, other = np.minimum(a, b), np.maximum(a, b)
        keys = first * span + other
        order = keys.argsort()
        # What does not press has an impulse of 0.
        pressed = (values[:, 0] != 0.0) | (values[:, 1] != 0.0)
        if np.count_nonzero(pressed) < len(pressed):
            order = order[pressed[order]]
            if not len(order):
                return None
        # Pymunk's impulse acts on body A, its normal points from A to B.
        toward = np.sign(a - b)[order]
        first, other = first[order], other[order]
        px, py, nx, ny = values.take(order, axis=0).T
        normal, impulse = np.empty((len(order), 2)), np.empty((2, len(order)))
        normal[:, 0], normal[:, 1] = toward * nx, toward * ny
        impulse[0], impulse[1] = -(px * nx + py * ny), py * nx - px * ny
        solid = other >= self.count
        return Contacts(
            keys[order], first, other, normal, impulse, (~solid).nonzero()[0], solid.nonzero()[0],
            np.bincount(np.concatenate((first, other)), minlength=span),
        )  # fmt: skip

    def states(self) -> tuple[Floats, Floats]:
        """Return positions (N + K, 2) and motions (N + K, 3): vx, vy (m/s) and ω (rad/s).

        Particles that are not inside have 0, as have solids: what a surface moves with is its
        belt's.
        """
        self._buffer.clear()
        batch.get_space_bodies(self._space, _BODY, self._buffer)
        ids = np.frombuffer(self._buffer.int_buf(), dtype=np.uintp)
        codes = self._codes[self._ids.searchsorted(ids)]
        values = np.frombuffer(self._buffer.float_buf()).reshape(-1, 5)
        span = self.count + len(self._fixed)
        x, motion = np.zeros((span, 2)), np.zeros((span, 3))
        x[codes], motion[codes] = values[:, :2], values[:, 2:]
        motion[self.count :] = 0.0
        return x, motion
