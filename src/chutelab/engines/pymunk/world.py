"""The machine as a `pymunk.Space`, paths between contacts, and the tracks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import acos, ceil, cos, inf, sin, sqrt
from typing import NamedTuple

import numpy as np
import pymunk
from numpy.typing import ArrayLike
from pymunk import Vec2d

from chutelab.machine import Machine
from chutelab.results import KNOT
from chutelab.results.recorder import Recorder
from chutelab.util.arrays import Bools, Floats

PARTICLE, SURFACE = 1, 2
"""Collision types of disks and of everything they meet."""

GRIP = 1e9
"""Friction coefficient that stands for inf, which Chipmunk would multiply with an impulse of 0."""

HAIR = 2e-11
"""Share of the radius by which a disk in the Space is larger than the particle, so that Chipmunk
sees a contact where centre and surface are one radius apart. Levers are off by as much."""

DIGITS = 16.0 * float(np.finfo(float).eps)
"""Share of the machine's size below which a gap is rounding."""

TINY = 1e-12
"""Share of 1 m/s plus the particle's speed; an approach this slow is a touch, no blow."""

LOW = 2.0
"""Hairs; bounces lower than this cannot be told from lying on the surface."""

FIRST = 1e-3
"""Share of a step after which a surface just left is looked at again."""

ROUGH = 1e-4
"""Share of the radius by which a track may be off between two knots."""

ARC = 0.025
"""rad between knots round the pulley: ρ Δφ⁴/384, the curve's error, is 1e-9 of the radius."""


@dataclass(frozen=True, eq=False)
class Face:
    """A straight surface, as a segment without thickness, or the pulley, as a circle."""

    shape: pymunk.Shape  # on a body of its own
    surface: int  # index into `Machine.surfaces`
    tangent: Vec2d | None  # direction of a segment
    speed: float  # m/s
    restitution: float  # of the pair with a particle, and so is friction
    friction: float  # finite
    radius: float  # of the particles, m

    @cached_property
    def ends(self) -> tuple[Vec2d, ...]:
        """Both ends of a segment (m)."""
        return (self.shape.a, self.shape.b) if isinstance(self.shape, pymunk.Segment) else ()

    def gap(self, x: Vec2d) -> tuple[float, Vec2d]:
        """Return the gap (m) between the surface and a disk round a point, and the normal there.

        Nearer than 1e-5 m Chipmunk has a segment's own normal for it, on either side.
        """
        found = self.shape.point_query(x)
        normal = found.gradient if self.tangent is None else (x - found.point).normalized()
        return found.distance - self.radius, normal

    def belt(self, normal: Vec2d) -> float:
        """Return the speed (m/s) of the surface along (n_y, -n_x) where a disk touches it.

        It is that of an end roller at the ends: the same on the rim as on the face on that side.
        """
        if self.tangent is None or self.tangent.cross(normal) >= 0.0:
            return self.speed
        return -self.speed


class Flight(NamedTuple):
    """Free flight from a place (m) at a velocity (m/s); `g` is gravity (m/s²)."""

    x: Vec2d
    v: Vec2d
    g: Vec2d

    def at(self, after: float) -> tuple[Vec2d, Vec2d]:
        """Return place (m) and velocity (m/s) after a time (s)."""
        return self.x + after * (self.v + 0.5 * after * self.g), self.v + after * self.g

    def pull(self, normal: Vec2d) -> float:
        """Return the acceleration (m/s²) along a normal."""
        return self.g.dot(normal)

    def leaves(self, box: tuple[float, float, float, float]) -> float:
        """Return the time (s) after which it leaves the exit box, inf if never."""
        left, right, bottom, top = box
        (x, y), (vx, vy), g = self.x, self.v, self.g.y
        return min(
            falls(x - left, vx, 0.0), falls(right - x, -vx, 0.0),
            falls(y - bottom, vy, g), falls(top - y, -vy, -g),
        )  # fmt: skip


def falls(gap: float, rate: float, pull: float) -> float:
    """Return the first time (s) at which gap + rate τ + pull τ²/2 falls to 0, inf if never."""
    ahead = max(gap, 0.0)
    square = rate * rate - 2.0 * pull * ahead
    if square >= 0.0 and rate < 0.0:
        return 2.0 * ahead / (sqrt(square) - rate)
    return (rate + sqrt(square)) / -pull if pull < 0.0 else inf


class World:
    """A Space with all surfaces of a machine, counted from near its place (`machine.origin`).

    `faces` are its segments, in their order, and the pulley. Gaps up to `hair` (m) are contact, and
    gaps of `rounding` (m) are none. `tiny` is the share of speeds below which one into a surface is
    rounding, which tilts normals.
    """

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.space = pymunk.Space()
        parts, r, wheel = machine.segments, machine.particle.radius, machine.pulley
        size = float(np.abs([*parts.start.ravel(), *parts.end.ravel(), r]).max())
        self.rounding = DIGITS * size
        self.hair = max(HAIR * r, 4.0 * self.rounding)
        self.tiny = max(TINY, self.rounding / r)
        self.by_shape: dict[pymunk.Shape, Face] = {}
        for n, (start, end) in enumerate(
            zip(parts.start.tolist(), parts.end.tolist(), strict=True)
        ):
            still = pymunk.Body(body_type=pymunk.Body.STATIC)
            self._add(
                pymunk.Segment(still, start, end, 0.0), int(parts.surface[n]),
                Vec2d(*parts.tangent[n].tolist()), float(parts.speed[n]),
                float(parts.restitution[n]), float(parts.friction[n]),
            )  # fmt: skip
        if wheel is not None:
            turning = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            turning.angular_velocity = -wheel.speed / wheel.radius
            self._add(
                pymunk.Circle(turning, wheel.radius), wheel.surface, None, wheel.speed,
                wheel.restitution, wheel.friction,
            )  # fmt: skip
        self.faces = list(self.by_shape.values())

    def _add(
        self, shape: pymunk.Shape, surface: int, tangent: Vec2d | None, speed: float,
        restitution: float, friction: float,
    ) -> None:  # fmt: skip
        assert shape.body is not None
        shape.collision_type = SURFACE
        self.space.add(shape.body, shape)
        r, friction = self.machine.particle.radius, min(friction, GRIP)
        self.by_shape[shape] = Face(shape, surface, tangent, speed, restitution, friction, r)

    def disk(self) -> tuple[pymunk.Body, pymunk.Circle]:
        """Return a new body with its shape, not yet in the Space."""
        p = self.machine.particle
        body = pymunk.Body(p.mass, p.inertia if p.inertia > 0.0 else inf)
        circle = pymunk.Circle(body, p.radius + self.hair)
        circle.collision_type = PARTICLE
        return body, circle

    def curved(self, face: Face, x: Vec2d) -> bool:
        """Tell whether what is nearest of a surface is the pulley or the end of a segment."""
        if face.tangent is None:
            return True
        point = face.shape.point_query(x).point
        return bool(min((point - end).length for end in face.ends) <= self.hair)

    def meets(
        self, path: Flight | Carriage, face: Face, span: float, leaving: bool = False
    ) -> float:
        """Return after what time (s) a disk on a path meets a surface, inf if not within `span`.

        All surfaces are convex, and so lie behind the plane through their nearest point: the gap
        stays above gap + rate τ + a τ²/2, a the least acceleration along the normal there. Stepping
        from root to root of that bound never passes a contact, and converges like Newton's method.
        A surface that is being left along its tangent gives no bound; it is looked at after times
        that grow by half.
        """
        r, g, hair = face.radius, self.machine.gravity, self.hair
        t = last = 0.0
        while True:
            x, v = path.at(t)
            gap, normal = face.gap(x)
            rate = v.dot(normal)
            slow = self.tiny * (1.0 + v.length)
            if leaving:
                if gap < -hair and t > 0.0:
                    return bisected(lambda t: face.gap(path.at(t)[0])[0] < -0.5 * hair, last, t)[0]
                leaving = gap <= hair and (rate <= slow or rate * rate <= 2.0 * LOW * g * hair)
            elif gap <= self.rounding or (gap <= hair and abs(rate) <= slow):
                # A hair deep or less a curve is grazed, not met; nor is what runs alongside.
                graze = v.length * sqrt(2.0 * hair / r)
                if rate < -slow and (rate < -graze or not self.curved(face, x)):
                    return t
                leaving = True
            tau = falls(gap, rate, path.pull(normal))
            if leaving and (speed := v.length + g * self.machine.dt) > 0.0:
                tau = max(tau, min(0.5 * t + FIRST * self.machine.dt, r / speed))
            if t + tau == t:
                return t
            if t == span:
                return inf
            last, t = t, min(t + tau, span)


class Carriage:
    """Ride of one particle at the belt's speed, not turning, at the height it is released at.

    It begins at `t` (s), is above the pulley's axis at `top`, and lasts `until` separation at
    cos φ1 = v²/(g ρ), at the top if that is 1 or more; or until another surface is met; or to the
    end of the run.
    """

    def __init__(self, machine: Machine, world: World, particle: int, t: float) -> None:
        assert machine.pulley is not None
        start = machine.releases
        self.particle, self.surface, self.t = particle, machine.pulley.surface, t
        self.weight = machine.particle.mass * machine.gravity
        self.x, self.rho = map(float, start.position[particle])
        self.speed = float(start.velocity[particle, 0])
        self.until, self.height, self.written = machine.end_time, self.rho, -inf
        self.top = inf
        if self.speed > 0.0:
            cosine = self.speed**2 / (machine.gravity * self.rho) if machine.gravity > 0.0 else inf
            path = max(0.0, -self.x) + self.rho * acos(min(cosine, 1.0))
            span = min(path / self.speed, self.until - t)
            others = (face for face in world.faces if face.surface != self.surface)
            span = min((world.meets(self, face, span) for face in others), default=span)
            self.until = min(t + path / self.speed, self.until, t + span)
            self.top = t + max(0.0, -self.x / self.speed)

    def at(self, after: float) -> tuple[Vec2d, Vec2d]:
        """Return place (m) and velocity (m/s) a time (s) after the start."""
        along = self.x + self.speed * after
        if along <= 0.0:
            return Vec2d(along, self.rho), Vec2d(self.speed, 0.0)
        c, s = cos(along / self.rho), sin(along / self.rho)
        return Vec2d(self.rho * s, self.rho * c), Vec2d(self.speed * c, -self.speed * s)

    def pull(self, _normal: Vec2d) -> float:
        """Return the least acceleration (m/s²) along any normal."""
        return -(self.speed**2) / self.rho

    def write(self, recorder: Recorder, end: float) -> None:
        """Write the knots up to a time (s), with what the belt pays: it lets the particle down."""
        turn = self.speed / self.rho * max(end - self.top, 0.0)
        round_it = np.linspace(self.top, end, ceil(turn / ARC) + 1).tolist() if turn else []
        for t in (self.t, *round_it, end):
            if t > self.written:
                x, v = self.at(t - self.t)
                recorder.book(self.particle, self.surface, self.weight * (x.y - self.height))
                recorder.knots(self.particle, t, tuple(x), tuple(v), 0.0)
                self.height, self.written = x.y, t


class Tracks:
    """Knots of particles that are stepped, only as many as the curve through them needs.

    Between knots a track is a cubic, which a constant acceleration makes exact: a new knot is due
    when the one of the first step since the last knot does not lead to where the particle is.
    """

    def __init__(self, recorder: Recorder, radius: float, particles: range) -> None:
        self.recorder, self.first, count = recorder, particles.start, len(particles)
        self.tolerance = ROUGH * radius
        self.t, self.x, self.v = np.zeros(count), np.zeros((2, count)), np.zeros((2, count))
        self.pull, self.fresh = np.zeros((2, count)), np.ones(count, dtype=bool)

    def knot(self, i: int, t: float, x: ArrayLike, v: ArrayLike, omega: float = 0.0) -> None:
        """Write a knot of the particle in a row, with the entries booked so far."""
        self.recorder.knots(self.first + i, t, x, v, omega)
        self.t[i], self.x[:, i], self.v[:, i], self.fresh[i] = t, x, v, True

    def step(self, rows: Bools, times: tuple[float, float], state: Floats, entries: Floats) -> None:
        """Note a step of the particles in some rows; write knots of the states before where due.

        `times` (s) and `state` (2, 5, N), of x, y, vx, vy and ω, are those at both ends; `entries`
        (3, N) are those before.
        """
        tau = times[1] - self.t
        x, v = state[1, :2], state[1, 2:4]
        new = self.fresh & rows
        if new.any():
            self.pull[:, new] = (v[:, new] - self.v[:, new]) / tau[new]
        gain = tau * self.pull
        off = np.abs(x - self.x - tau * (self.v + 0.5 * gain))
        # A cubic is off by 4/27 τ of what one of its end velocities is.
        off += 4.0 / 27.0 * tau * np.abs(v - self.v - gain)
        due = np.flatnonzero((off[0] + off[1] > self.tolerance) & rows & ~new)
        self.fresh &= ~rows
        if len(due):
            knots = np.empty(len(due), dtype=KNOT)
            before = state[0][:, due]
            knots["t"], knots["position"], knots["velocity"] = times[0], before[:2].T, before[2:4].T
            knots["omega"], knots["entries"] = before[4], entries[:, due].T
            self.recorder.add(self.first + due, knots)
            self.t[due], self.x[:, due], self.v[:, due] = times[0], before[:2], before[2:4]
            self.pull[:, due] = (v[:, due] - before[2:4]) / (times[1] - times[0])


def bisected(test: Callable[[float], object], low: float, high: float) -> tuple[float, float]:
    """Return neighbouring values of which a test, true at `high`, is false and true."""
    least = 1e-15 * high
    while low < (middle := 0.5 * (low + high)) < high and high - low > least:
        low, high = (low, middle) if test(middle) else (middle, high)
    return low, high
