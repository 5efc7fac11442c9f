"""The pymunk side: bodies in, contacts and states out. No other module imports pymunk."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import TYPE_CHECKING

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk import batch

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
_BODY = batch.BodyFields.POSITION | batch.BodyFields.VELOCITY | batch.BodyFields.ANGULAR_VELOCITY


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts of one step that pressed, sorted by particle and partner.

    Attributes
    ----------
    first : ndarray, (M,)
        Particle.
    other : ndarray, (M,)
        Partner: a particle with a higher number, or the number of particles plus a solid's index.
    normal, impulse : ndarray, (M, 2)
        Unit normal towards, and impulse (N s) of the whole step on, the first.
    """

    first: Ints
    other: Ints
    normal: Floats
    impulse: Floats

    def __len__(self) -> int:
        return len(self.first)

    def take(self, keep: NDArray[np.bool_]) -> Contacts:
        """Return some of the contacts."""
        return Contacts(self.first[keep], self.other[keep], self.normal[keep], self.impulse[keep])

    def turned(self, rows: NDArray[np.bool_]) -> Contacts:
        """Return the contacts with the two particles of some rows exchanged."""
        sign = np.where(rows, -1.0, 1.0)[:, None]
        return Contacts(
            np.where(rows, self.other, self.first),
            np.where(rows, self.first, self.other),
            sign * self.normal,
            sign * self.impulse,
        )


class World:
    """A Space with the machine's solids and up to `count` particles, known by their numbers.

    Velocities given and returned are those pymunk moves bodies with: half a step of gravity ahead
    in flight (a step moves positions first, velocities then).
    """

    def __init__(self, machine: Machine, solids: Solids, count: int) -> None:
        self.count = count
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
        self._bodies: dict[int, pymunk.Body] = {}
        self._shapes: dict[int, pymunk.Circle] = {}
        self._fixed = [self._solid(solids, k) for k in range(len(solids.reach))]
        self._codes_of = {body.id: count + k for k, body in enumerate(self._fixed)}
        self._buffer = batch.Buffer()
        self._stale = True
        self._ids = np.empty(0, dtype=np.uintp)
        self._codes = self._order = np.empty(0, dtype=np.int64)

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
        self._space.add(body, shape)
        self._bodies[particle], self._shapes[particle] = body, shape
        self._codes_of[body.id] = particle
        self._stale = True

    def remove(self, particle: int) -> None:
        """Take a particle out."""
        body = self._bodies.pop(particle)
        del self._codes_of[body.id]
        self._space.remove(body, self._shapes.pop(particle))
        self._stale = True

    def place(
        self,
        particle: int,
        position: tuple[float, float],
        velocity: tuple[float, float],
        omega: float = 0.0,
    ) -> None:
        """Overwrite the state of a particle."""
        body = self._bodies[particle]
        body.position, body.velocity, body.angular_velocity = position, velocity, omega

    def steer(
        self, particle: int, velocity: tuple[float, float], force: tuple[float, float]
    ) -> None:
        """Overwrite a velocity, and add a force (N) that acts in the next step, after the move."""
        body = self._bodies[particle]
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
        ids, values = np.frombuffer(raw, dtype=np.uintp), np.frombuffer(self._buffer.float_buf())
        if self._stale:
            # Numbering reuses the buffer.
            ids, values = ids.copy(), values.copy()
            self._number()
        pair = self._codes[np.searchsorted(self._ids, ids)].reshape(-1, 2)
        impulse, normal = values.reshape(-1, 2, 2).transpose(1, 0, 2)
        # Pymunk's impulse acts on body A, its normal points from A to B.
        swap = np.where(pair[:, 0] <= pair[:, 1], 1.0, -1.0)[:, None]
        first, other = pair.min(axis=1), pair.max(axis=1)
        order = np.lexsort((other, first))
        out = Contacts(first[order], other[order], (-swap * normal)[order], (swap * impulse)[order])
        pressing = (out.impulse != 0.0).any(axis=1)
        return out if pressing.all() else out.take(pressing) if pressing.any() else None

    def states(self) -> tuple[Floats, Floats, Floats]:
        """Return positions (N, 2), velocities (N, 2) and ω (N,); NaN for particles not inside."""
        if self._stale:
            self._number()
        self._buffer.clear()
        batch.get_space_bodies(self._space, _BODY, self._buffer)
        out = np.full((self.count + len(self._fixed), 5), np.nan)
        out[self._order] = np.frombuffer(self._buffer.float_buf()).reshape(-1, 5)
        out = out[: self.count]
        return out[:, 0:2], out[:, 2:4], out[:, 4]

    def _number(self) -> None:
        """Learn anew which body stands where in pymunk's lists: body ids are reused addresses."""
        known = self._codes_of
        ids = np.fromiter(known, dtype=np.uintp, count=len(known))
        order = np.argsort(ids)
        self._ids = ids[order]
        codes = np.fromiter(known.values(), dtype=np.int64, count=len(known))
        self._codes = codes[order]
        self._buffer.clear()
        batch.get_space_bodies(self._space, batch.BodyFields.BODY_ID, self._buffer)
        listed = np.frombuffer(self._buffer.int_buf(), dtype=np.uintp)
        self._order = self._codes[np.searchsorted(self._ids, listed)]
        self._stale = False
