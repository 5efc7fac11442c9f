"""Pymunk's answer to one impact: the two bodies alone, touching, for one vanishing step.

The pair is set up in the frame of its contact, the normal upwards, so that no digits are lost to
where in the scene it happens.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import pymunk

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.stepper.solids import Solids

Vector = tuple[float, float]

MOMENT = 1e-30
"""s; the step: too short for anything to move, even by a rounding."""

OVERLAP = 1e-12
"""Share of the radii by which the bodies overlap; pymunk finds no contact without."""


_VELOCITY, _OMEGA = (vars(pymunk.Body)[name].fset for name in ("velocity", "angular_velocity"))


def move(body: pymunk.Body, velocity: Vector, omega: float) -> None:
    """Set the velocities of a body: by the setters, which its attributes find at twice the cost."""
    _VELOCITY(body, velocity)
    _OMEGA(body, omega)


@dataclass(frozen=True)
class Disk:
    """A body's mass (kg), moment of inertia (kg m²; 0: it does not turn) and radius (m)."""

    mass: float
    inertia: float
    radius: float


@dataclass(frozen=True)
class Pair:
    """Pair values of a contact: coefficient of restitution, and of friction."""

    restitution: float
    friction: float


class Clash:
    """A Space with a disk above its partner: another disk, or something that cannot be moved.

    Parameters
    ----------
    upper : Disk
        The disk.
    lower : Disk or None
        The other disk; None for a solid.
    pair : Pair
        Pair values.
    """

    def __init__(self, upper: Disk, lower: Disk | None, pair: Pair) -> None:
        self._space = pymunk.Space()
        self._space.collision_slop = 1.0
        self._upper = self._body(upper)
        shape: pymunk.Shape = pymunk.Circle(self._upper, upper.radius)
        shape.elasticity, shape.friction = pair.restitution, pair.friction
        self._space.add(self._upper, shape)
        if lower is None:
            self._lower = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            shape = pymunk.Poly.create_box(self._lower, (8.0 * upper.radius, 2.0 * upper.radius))
        else:
            self._lower = self._body(lower)
            shape = pymunk.Circle(self._lower, lower.radius)
        shape.elasticity = shape.friction = 1.0
        self._space.add(self._lower, shape)
        below = upper.radius if lower is None else lower.radius
        self._upper.position = 0.0, upper.radius * (1.0 - OVERLAP)
        self._lower.position = 0.0, -below * (1.0 - OVERLAP)
        self._mass = upper.mass

    @staticmethod
    def _body(disk: Disk) -> pymunk.Body:
        return pymunk.Body(disk.mass, disk.inertia if disk.inertia > 0.0 else inf)

    def resolve(
        self,
        velocity: tuple[float, float],
        omega: float,
        other: tuple[float, float] = (0.0, 0.0),
        other_omega: float = 0.0,
    ) -> tuple[tuple[float, float], float]:
        """Return the impulse on the upper body (tangential, normal; N s), and its ω afterwards.

        Parameters
        ----------
        velocity, other : tuple of float
            Along (n_y, -n_x) and along the normal n towards the upper body, m/s. A belt is a solid
            that moves along.
        omega, other_omega : float
            Counter-clockwise, rad/s.
        """
        upper, lower = self._upper, self._lower
        # Where the bodies are they stay: the step is too short.
        move(upper, velocity, omega)
        move(lower, other, other_omega)
        self._space.step(MOMENT)
        after, mass = upper.velocity, self._mass
        impulse = mass * (after[0] - velocity[0]), mass * (after[1] - velocity[1])
        return impulse, upper.angular_velocity


class Clashes:
    """The pairs that a machine's particles can form, set up when they first meet.

    Parameters
    ----------
    machine : Machine
        The particles.
    solids : Solids
        What else they can meet.
    """

    def __init__(self, machine: Machine, solids: Solids) -> None:
        p = machine.particle
        self._disk = Disk(p.mass, p.inertia, p.radius)
        self._particles = Pair(machine.pair_restitution, machine.pair_friction)
        self._solids = solids
        self._known: dict[tuple[int, bool], Clash] = {}
        # The last one, -1, is that of particles with each other.
        self._grips: list[float] = [*solids.friction.tolist(), machine.pair_friction]

    def of(self, solid: int, *, free: bool) -> Clash:
        """Return a particle with a solid, or if that is -1 with a particle, free or carried."""
        key = solid, free
        if key not in self._known:
            self._known[key] = Clash(self._disk, self._disk if free else None, self._pair(solid))
        return self._known[key]

    def grip(self, solid: int) -> float:
        """Return the coefficient of friction with a solid, or if that is -1 with a particle."""
        return self._grips[solid]

    def _pair(self, solid: int) -> Pair:
        if solid < 0:
            return self._particles
        return Pair(float(self._solids.restitution[solid]), float(self._solids.friction[solid]))
