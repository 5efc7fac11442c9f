"""The machine as a `pymunk.Space`, and what every contact in it is booked as."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pymunk
from pymunk import Vec2d

from chutelab.recording import KNOT, Kind

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.recorder import Recorder

PARTICLE, SURFACE = 1, 2
"""Collision types of disks and of everything they meet."""

ITERATIONS = 60
"""Of Chipmunk's solver; one is exact for one contact, a disk in a wedge needs more."""

GRIP = 1e9
"""Friction coefficient that stands for inf, which Chipmunk would multiply with an impulse of 0."""

HAIR = 2e-11
"""Share of the radius by which a disk in the Space is larger than the particle, so that Chipmunk
sees a contact where centre and surface are one radius apart. Levers are off by as much."""

DIGITS = 16.0 * float(np.finfo(float).eps)
"""Share of the machine's size below which a gap is rounding."""

ROUGH = 1e-5
"""Share of the radius by which a track between two knots of a lasting contact may be off."""

SAMPLES = 4
"""States between two knots that are held against the curve through the knots."""


@dataclass(frozen=True, eq=False)
class Face:
    """One straight surface, or the pulley.

    Attributes
    ----------
    shape : pymunk.Shape
        A segment without thickness, or the pulley's circle, on a body of its own.
    surface : int
        Index into `Machine.surfaces`.
    tangent : Vec2d or None
        Direction of a segment, None for the pulley.
    speed, restitution, friction : float
        Of the surface (m/s), pair values with a particle; friction is finite.
    """

    shape: pymunk.Shape
    surface: int
    tangent: Vec2d | None
    speed: float
    restitution: float
    friction: float

    @property
    def ends(self) -> tuple[Vec2d, ...]:
        """Both ends of a segment (m)."""
        return (self.shape.a, self.shape.b) if isinstance(self.shape, pymunk.Segment) else ()

    def belt(self, normal: Vec2d) -> float:
        """Return the speed (m/s) of the surface along (n_y, -n_x) where a disk touches it.

        It is that of an end roller at the ends: the same on the rim as on the face on that side.
        """
        if self.tangent is None or self.tangent.cross(normal) >= 0.0:
            return self.speed
        return -self.speed


class Contact(NamedTuple):
    """What Chipmunk did at one contact of a disk in one step; the impulse (N s) acts on it."""

    face: Face
    normal: Vec2d
    impulse: Vec2d


class World:
    """A Space with all surfaces of a machine.

    Parameters
    ----------
    machine : Machine
        Counted from near its own place, see `chutelab.machine.origin`.

    Attributes
    ----------
    faces : list of Face
        In the order of the segments, the pulley last.
    hair : float
        m; gaps up to this one are contact.
    """

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.space = pymunk.Space()
        self.space.iterations = ITERATIONS
        parts, r = machine.segments, machine.particle.radius
        size = float(np.abs([*parts.start.ravel(), *parts.end.ravel(), r]).max())
        self.rounding = DIGITS * size
        self.hair = max(HAIR * r, 4.0 * self.rounding)
        self.faces: list[Face] = []
        for n, (start, end) in enumerate(
            zip(parts.start.tolist(), parts.end.tolist(), strict=True)
        ):
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
            self._add(
                pymunk.Segment(body, start, end, 0.0), int(parts.surface[n]),
                Vec2d(*parts.tangent[n].tolist()), float(parts.speed[n]),
                float(parts.restitution[n]), float(parts.friction[n]),
            )  # fmt: skip
        if machine.pulley is not None:
            wheel = machine.pulley
            body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            body.angular_velocity = -wheel.speed / wheel.radius
            self._add(
                pymunk.Circle(body, wheel.radius), wheel.surface, None, wheel.speed,
                wheel.restitution, wheel.friction,
            )  # fmt: skip
        self.by_shape = {face.shape: face for face in self.faces}

    def _add(
        self, shape: pymunk.Shape, surface: int, tangent: Vec2d | None, speed: float,
        restitution: float, friction: float,
    ) -> None:  # fmt: skip
        assert shape.body is not None
        shape.collision_type = SURFACE
        self.space.add(shape.body, shape)
        self.faces.append(Face(shape, surface, tangent, speed, restitution, min(friction, GRIP)))

    def disk(self) -> tuple[pymunk.Body, pymunk.Circle]:
        """Return a new body with its shape, not yet in the Space."""
        p = self.machine.particle
        body = pymunk.Body(p.mass, p.inertia if p.inertia > 0.0 else inf)
        circle = pymunk.Circle(body, p.radius + self.hair)
        circle.collision_type = PARTICLE
        return body, circle


class Track:
    """Knots, events and books of one particle."""

    def __init__(self, machine: Machine, recorder: Recorder, particle: int) -> None:
        self.recorder, self.particle = recorder, particle
        self.radius, self.mass = machine.particle.radius, machine.particle.mass
        self.rows: list[tuple[Any, ...]] = []
        self.pending: list[tuple[Any, ...]] = []
        self.entries = recorder.entries[particle]

    def knot(self, t: float, x: Vec2d, v: Vec2d, omega: float) -> None:
        """Write a knot."""
        self.rows += self.pending[-1:]
        self.pending.clear()
        row = (t, tuple(x), tuple(v), omega, tuple(self.entries.tolist()))
        if not self.rows or row != self.rows[-1]:
            self.rows.append(row)

    def sample(self, t: float, x: Vec2d, v: Vec2d, omega: float) -> None:
        """Note the state after a step of a lasting contact; a knot where the curve asks for one."""
        row = (t, tuple(x), tuple(v), omega, tuple(self.entries.tolist()))
        if not all(_near(self.rows[-1], row, s, ROUGH * self.radius) for s in self.pending):
            self.rows.append(self.pending[-1])
            self.pending.clear()
        self.pending.append(row)
        if len(self.pending) > SAMPLES:
            del self.pending[:-1:2]

    def book(
        self, contact: Contact, before: tuple[Vec2d, float], after: tuple[Vec2d, float]
    ) -> None:
        """Book an impulse J: J·(u before + u after)/2, u the relative velocity at the contact."""
        face, n, impulse = contact
        t = Vec2d(n.y, -n.x)
        belt = face.belt(n)
        normal = 0.5 * (before[0] + after[0]).dot(n)
        spin = 0.5 * self.radius * (before[1] + after[1])
        slip = 0.5 * (before[0] + after[0]).dot(t) + spin - belt
        push, rub = impulse.dot(n), impulse.dot(t)
        self.pay(face.surface, rub * belt, -push * normal, -rub * slip)

    def pay(self, surface: int, belt: float, restitution: float, friction: float) -> None:
        """Book entries (J) on the particle and on a surface."""
        for row in (self.entries, self.recorder.by_surface[surface]):
            row[0] += belt
            row[1] += restitution
            row[2] += friction

    def event(
        self, kind: Kind, t: float, x: Vec2d, after: tuple[Vec2d, float],
        before: tuple[Vec2d, float] | None = None, contact: Contact | None = None,
        surface: int = -1,
    ) -> None:  # fmt: skip
        """Write an event; of a contact with its impulses."""
        n, impulse = (contact.normal, contact.impulse) if contact else (Vec2d(0, 0), Vec2d(0, 0))
        before = before or after
        self.recorder.events(
            kind, self.particle, t, tuple(x), tuple(after[0]), after[1],
            velocity_before=tuple(before[0]), omega_before=before[1],
            surface=contact.face.surface if contact else surface,
            normal_impulse=impulse.dot(n), tangential_impulse=impulse.dot(Vec2d(n.y, -n.x)),
        )  # fmt: skip

    def finish(self, reason: int) -> None:
        """Hand the knots over."""
        self.rows += self.pending[-1:]
        self.pending.clear()
        knots = np.array(self.rows, dtype=KNOT)
        self.recorder.add(np.full(len(knots), self.particle), knots)
        self.recorder.ended[self.particle] = reason


def _near(a: tuple[Any, ...], b: tuple[Any, ...], s: tuple[Any, ...], tolerance: float) -> bool:
    """Tell whether the cubic from knot a to knot b passes a state s."""
    h = b[0] - a[0]
    if h <= 0.0:
        return True
    u = (s[0] - a[0]) / h
    w = 1.0 - u
    for axis in (0, 1):
        place = w * w * ((1.0 + 2.0 * u) * a[1][axis] + u * h * a[2][axis]) + u * u * (
            (1.0 + 2.0 * w) * b[1][axis] - w * h * b[2][axis]
        )
        if abs(place - s[1][axis]) > tolerance:
            return False
    return True
