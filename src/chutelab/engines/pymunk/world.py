"""The machine as a `pymunk.Space`, and paths between contacts."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import acos, atan2, ceil, cos, dist, inf, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
import pymunk
from numpy.typing import ArrayLike
from pymunk import Vec2d

from chutelab.machine import Arcs, Machine, Segments
from chutelab.results.loads import Bins
from chutelab.results.recorder import Recorder
from chutelab.util.arrays import Floats, bisected

PARTICLE, SURFACE = 1, 2
"""Collision types of disks and of everything they meet."""

GRIP = 1e9
"""Friction coefficient for inf, which Chipmunk would multiply with an impulse of 0."""

HAIR = 2e-11
"""Share of the radius by which a disk in the Space is larger than the particle, so that Chipmunk
detects a contact when centre and surface are one radius apart. Levers have the same error."""

DIGITS = 16.0 * float(np.finfo(float).eps)
"""Share of the machine's size below which a gap is rounding."""

TINY = 1e-12
"""Share of the sum of `Machine.pace` (m/s) and the particle's speed; a slower approach is no
impact."""

LOW = 2.0
"""In hairs; lower bounces cannot be distinguished from rest on the surface."""

SHORT = 1e-5
"""Share of a step: a shorter contact has ended, and a surface just left is checked again after this
time."""

JOINT = 0.0625
"""In hairs, by which an arc is longer where another piece continues it: what slides onto it touches
both. It is then at most 4 times this deep in the arc, and no step ends for that."""

ALIKE = 1e-9
"""Directions (rad) and curvatures (relative) that differ by less count as equal."""

ARC = 0.025
"""rad between knots round the pulley: ρ Δφ⁴/384, the curve's error, is 1e-9 of the radius."""

NONE = (Vec2d.zero(), Vec2d.zero())
"""Crowns of a face without ends."""


def direction(begin: Vec2d, end: Vec2d) -> Vec2d:
    """Return the unit vector from one place to another, 0 if they are one."""
    (x, y), (u, v) = begin, end
    x, y = u - x, v - y
    far = sqrt(x * x + y * y) or 1.0
    return Vec2d(x / far, y / far)


@dataclass(frozen=True, eq=False)
class Face:
    """A straight surface, as a segment without thickness, the pulley, as a circle, or a point.

    A point is the end of an arc; its tangent is the arc's there.
    """

    shape: pymunk.Shape  # on a body of its own
    surface: int  # index into `Machine.surfaces`
    tangent: Vec2d | None  # direction of a segment
    speed: float  # m/s
    restitution: float  # of the pair with a particle, as is friction
    friction: float  # finite
    radius: float  # of the particle, m
    appears: float  # time span in which it exists, s
    vanishes: float
    one_sided: int  # 1 if it is solid on its left, -1 if on its right; of an arc outside, inside
    spin: float  # angular velocity of a wheel, rad/s; rolling is relative to it
    crowns: tuple[Vec2d, Vec2d]  # see `World._crown`; at the first end and at the last

    @cached_property
    def ends(self) -> tuple[Vec2d, ...]:
        """Both ends of a segment (m)."""
        return (self.shape.a, self.shape.b) if isinstance(self.shape, pymunk.Segment) else ()

    @property
    def touched(self) -> pymunk.Shape:
        """The shape in the Space that a lone particle touches."""
        return self.shape

    @property
    def turns(self) -> bool:
        """Whether that shape turns with the surface's speed."""
        return self.tangent is None

    def put(self, x: Vec2d) -> None:
        """Prepare for contact with a particle at a place (m)."""

    def gap(self, x: Vec2d) -> tuple[float, Vec2d]:
        """Return the gap (m) between the surface and a disk round a point, and the normal there."""
        found = self.shape.point_query(x)
        # Closer than 1e-5 m Chipmunk returns a segment's own normal, on either side.
        normal = found.gradient if self.tangent is None else direction(found.point, x)
        return found.distance - self.radius, normal

    def side(self, x: Vec2d) -> float:
        """Return the distance to the solid side (m), negative on the other; 0 if both are solid."""
        if not self.one_sided or self.tangent is None or self.shape.body is None:
            return 0.0
        away = x - self.shape.point_query(x).point
        left = self.tangent.perpendicular().rotated(self.shape.body.angle)
        return self.one_sided * away.dot(left)

    def belt(self, normal: Vec2d) -> float:
        """Return the speed (m/s) of the surface along (n_y, -n_x) where a disk touches it.

        At the ends it is that of an end roller: the same on the rim as on the adjoining face.
        """
        if self.tangent is None or self.crowns[self.tangent.dot(normal) > 0.0].dot(normal) >= 0.0:
            return self.speed
        return -self.speed

    def hollow(self, x: Vec2d) -> float:
        """Return the curvature (1/m) of a centre's path inside an arc, 0 elsewhere."""
        return 0.0

    def free(
        self, path: Flight | Carriage, x: Vec2d, v: Vec2d, gap: float, rate: float, pull: float
    ) -> float:
        """Return a time (s) within which a disk on a path cannot meet the surface.

        A convex one lies behind the plane through its nearest point: the gap stays above
        gap + rate τ + pull τ²/2, with the rate and the least acceleration along the normal there.
        """
        return falls(gap, rate, pull)


@dataclass(frozen=True, eq=False)
class Bend(Face):
    """An arc, met from inside and outside, or a whole circle; the ends of an arc are other faces.

    Chipmunk has no concave shape: its distance query on the circle gives the gap on either side,
    and a disk lies on a point, placed where the circle is nearest.
    """

    foot: pymunk.Circle  # without radius, on a body of its own
    begin: float  # rad, as those of `Arcs`
    extent: float

    @property
    def touched(self) -> pymunk.Shape:
        """The point that a disk lies on."""
        return self.foot

    @property
    def turns(self) -> bool:
        """A point has no rim to turn with."""
        return False

    @property
    def center(self) -> Vec2d:
        """Centre of the circle (m)."""
        assert self.shape.body is not None
        return self.shape.body.position

    def put(self, x: Vec2d) -> None:
        """Move the point to where the arc is nearest (m), or out of reach beside it."""
        assert self.foot.body is not None
        assert isinstance(self.shape, pymunk.Circle)
        beside = self.gap(x)[0] == inf
        away = x + Vec2d(4.0 * self.radius, 0.0)
        onto = self.center + self.shape.radius * self.outward(x)
        self.foot.body.position = away if beside else onto

    def outward(self, x: Vec2d) -> Vec2d:
        """Return the direction of a place from the centre."""
        center = self.center
        # Closer than 1e-5 m Chipmunk returns a fixed direction.
        return direction(center, x) if x != center else Vec2d(0.0, 1.0)

    def gap(self, x: Vec2d) -> tuple[float, Vec2d]:
        """Return the gap (m) and the normal; inf where an end is nearest."""
        distance, away = self.shape.point_query(x).distance, self.outward(x)
        side = 1.0 if distance >= 0.0 else -1.0
        if (atan2(away.y, away.x) - self.begin) % (2.0 * pi) > self.extent:
            return inf, side * away
        return side * distance - self.radius, side * away

    def side(self, x: Vec2d) -> float:
        """Return the distance to the solid side (m): outside of the arc, or inside."""
        return self.one_sided * self.shape.point_query(x).distance

    def belt(self, normal: Vec2d) -> float:
        """Return the speed (m/s) along (n_y, -n_x): the surface runs clockwise."""
        assert self.foot.body is not None
        outside = (self.foot.body.position - self.center).dot(normal) >= 0.0
        return self.speed if outside else -self.speed

    def hollow(self, x: Vec2d) -> float:
        """Return 1/(R - r) inside, 0 outside."""
        assert isinstance(self.shape, pymunk.Circle)
        room = self.shape.radius - self.radius
        return 1.0 / room if room > 0.0 and (x - self.center).length < self.shape.radius else 0.0

    def free(
        self, path: Flight | Carriage, x: Vec2d, v: Vec2d, gap: float, rate: float, pull: float
    ) -> float:
        """Return a time (s) within which it cannot be met; for the outside see `Face.free`.

        Beside an arc until a line through the centre and an end. Inside, c away from the centre,
        ρ² - c² begins at the gap times ρ + c, at the rate -2 c·v, and bends by -2 (v² + c·a).
        """
        away = x - self.center
        if gap == inf:
            lines = (Vec2d.from_polar(1.0, self.begin + turn) for turn in (0.0, self.extent))
            sides = [line.perpendicular() for line in lines]
            sides = [side if away.dot(side) >= 0.0 else -side for side in sides]
            ahead = min(falls(away.dot(n), v.dot(n), path.pull(n)) for n in sides)
            # Go past the line, so that the side is certain.
            pace = max(v.length, sqrt(path.most * self.radius))
            # A particle at rest without gravity never gets there.
            return ahead + HAIR * self.radius / pace if pace else inf
        if not (hollow := self.hollow(x)):
            return falls(gap, rate, pull)
        rho, c = 1.0 / hollow, away.length
        horizon = rho / (v.length + sqrt(path.most * rho))
        bend = 2.0 * ((v.length + path.most * horizon) ** 2 + rho * path.most)
        return min(falls(gap * (rho + c), -2.0 * away.dot(v), -bend), horizon)


class Flight(NamedTuple):
    """Free flight from a place (m) at a velocity (m/s); `g` is gravity (m/s²)."""

    x: Vec2d
    v: Vec2d
    g: Vec2d

    def at(self, after: float) -> tuple[Vec2d, Vec2d]:
        """Return place (m) and velocity (m/s) after a time (s)."""
        # In plain numbers, as operators of Vec2d take ten times as long.
        (x, y), (vx, vy), (gx, gy) = self
        half = 0.5 * after
        place = Vec2d(x + after * (vx + half * gx), y + after * (vy + half * gy))
        return place, Vec2d(vx + after * gx, vy + after * gy)

    def pull(self, normal: Vec2d) -> float:
        """Return the acceleration (m/s²) along a normal."""
        return self.g.dot(normal)

    @property
    def most(self) -> float:
        """The largest acceleration (m/s²) in any direction."""
        return self.g.length

    def leaves(self, box: Floats) -> float:
        """Return the time (s) after which it leaves the exit box, see `Releases`, inf if never."""
        (left, bottom, right, top), ((x, y), (vx, vy), (gx, gy)) = box.tolist(), self
        return min(
            falls(x - left, vx, gx), falls(right - x, -vx, -gx),
            falls(y - bottom, vy, gy), falls(top - y, -vy, -gy),
        )  # fmt: skip


def falls(gap: float, rate: float, pull: float) -> float:
    """Return the first time (s) at which gap + rate τ + pull τ²/2 falls to 0, inf if never."""
    if gap == inf:
        return inf
    ahead = max(gap, 0.0)
    square = rate * rate - 2.0 * pull * ahead
    if square >= 0.0 and rate < 0.0:
        return 2.0 * ahead / (sqrt(square) - rate)
    return (rate + sqrt(square)) / -pull if pull < 0.0 else inf


class World:
    """A Space with all surfaces of a machine, relative to `recorder.origin`.

    `faces` are its segments, in order, the pulley, the arcs and their ends, as one particle meets
    them; `gates` says whether some do not always exist. Gaps up to `hair` (m) are contact, those of
    `rounding` (m) are 0. `tiny` is the share of speeds that tilted normals make by rounding.
    """

    def __init__(self, machine: Machine, particle: int = 0) -> None:
        self.machine, self.particle = machine, particle
        self.space = pymunk.Space()
        parts, arcs, wheel = machine.segments, machine.arcs, machine.pulley
        r = self.radius = float(machine.particle.of(particle).radius)
        size = float(np.abs([*machine.corners.ravel(), r]).max())
        self.rounding = DIGITS * size
        self.hair = max(HAIR * r, 4.0 * self.rounding)
        self.tiny, self.pace = max(TINY, self.rounding / r), float(machine.pace)
        self.by_shape: dict[pymunk.Shape, Face] = {}
        ways = parts.start.tolist(), parts.end.tolist(), parts.tangent.tolist()
        for n, (start, end, along) in enumerate(zip(*ways, strict=True)):
            still = pymunk.Body(body_type=pymunk.Body.STATIC)
            shape, tangent = pymunk.Segment(still, start, end, 0.0), Vec2d(*along)
            about = self._about(parts, n)
            crowns = (tangent.perpendicular(),) * 2
            if about["speed"]:
                crowns = -self._crown(start, -tangent), self._crown(end, tangent)
            self._add(Face(shape, tangent=tangent, crowns=crowns, **about))
        if wheel is not None:
            turning = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            turning.angular_velocity = -wheel.speed / wheel.radius
            about = self._about(wheel.rim, 0) | {"spin": turning.angular_velocity}
            rim = pymunk.Circle(turning, wheel.radius)
            self._add(Face(rim, tangent=None, crowns=NONE, **about))
        if arcs.surface.size:
            sides = [zip(*pair, strict=True) for pair in zip(arcs.ends, arcs.inward, strict=True)]
            for n, (center, *ends) in enumerate(zip(arcs.center.tolist(), *sides, strict=True)):
                self._bend(n, Vec2d(*center), ends, self._about(arcs, n))
        self.faces = list(self.by_shape.values())
        self.gates = any(face.appears > -inf or face.vanishes < inf for face in self.faces)

    def _about(self, parts: Segments | Arcs, n: int) -> dict[str, Any]:
        """Return the values of a face for a segment or arc; pair values are (S,), or (K, S)."""
        several = len(self.machine.pair_restitution) > 1
        at = (self.machine.releases.kind[self.particle], n) if several else n
        return {
            "surface": int(parts.surface[n]), "speed": float(parts.speed[n]),
            "restitution": float(parts.restitution[at]),
            "friction": min(float(parts.friction[at]), GRIP),
            "radius": self.radius,
            "appears": float(parts.appears[n]), "vanishes": float(parts.vanishes[n]), "spin": 0.0,
            "one_sided": int(parts.one_sided[n]),
        }  # fmt: skip

    def _bend(
        self, n: int, center: Vec2d, ends: list[tuple[Floats, Floats]], about: dict[str, Any]
    ) -> None:
        """Add an arc and its ends (m), each with the direction into the arc."""
        arcs = self.machine.arcs
        radius, begin, extent = (float(of[n]) for of in (arcs.radius, arcs.begin, arcs.extent))
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        body.position = center
        # A shape that is not in the Space does not keep its body.
        self.space.add(body)
        circle = pymunk.Circle(body, radius)
        circle.cache_bb()
        base = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        base.position = center  # points in one place would all be pairs in every step
        foot = pymunk.Circle(base, 0.0)
        about["spin"] = -about["speed"] / radius
        if extent >= 2.0 * pi:
            about |= {"begin": 0.0, "extent": inf}
            self._add(Bend(circle, tangent=None, foot=foot, crowns=NONE, **about))
            return
        # rad; extension of the arc at an end, see `JOINT`, for the sharpest arc.
        more = sqrt(2.0 * JOINT * self.hair * float(arcs.radius.min())) / (radius + self.radius)
        # Whether another piece continues from the end, turning by less than that.
        _, ways, _ = self._onward
        before, after = (
            more if (np.hypot(*(ways[self._from(end.tolist())] + inward).T) <= more).any() else 0.0
            for end, inward in ends
        )
        self._add(Bend(
            circle, tangent=None, foot=foot, begin=begin - before, extent=extent + before + after,
            crowns=NONE, **about,
        ))  # fmt: skip
        # The outward direction is along the surface at the first end, against it at the last.
        for (place, inward), way in zip(ends, (1.0, -1.0), strict=True):
            end = place.tolist()
            still = pymunk.Body(body_type=pymunk.Body.STATIC)
            point = pymunk.Circle(still, 0.0, end)
            out = Vec2d(*(-inward).tolist())
            crown = self._crown(end, out, way / radius) if about["speed"] else out.perpendicular()
            self._add(Face(
                point, tangent=out, crowns=(crown, crown),
                **about | {key: about[key] * int(way) for key in ("speed", "one_sided")},
            ))  # fmt: skip

    @cached_property
    def _onward(self) -> tuple[list[list[float]], Floats, Floats]:
        """Ends of all pieces by x, n of [x, y], m, and the continuation into each piece.

        Continuations are directions, (n, 2), and curvatures, (n,), 1/m, positive to the left.
        """
        sides = [
            (end, way, turn / part.radius if isinstance(part, Arcs) else np.zeros(len(end)))
            for part in (each.of(~each.whole) for each in self.machine.parts if each.surface.size)
            for end, way, turn in zip(part.ends, part.inward, (1.0, -1.0), strict=True)
        ]
        ends, ways, bends = (np.concatenate(each) for each in zip(*sides, strict=True))
        order = ends[:, 0].argsort(kind="stable")
        return ends[order].tolist(), ways[order], bends[order]

    def _from(self, end: Sequence[float]) -> list[int]:
        """Return which pieces, of `_onward`, end at a place (m)."""
        ends, (x, y) = self._onward[0], end
        low, high = (bisect_left(ends, [x + share * self.hair]) for share in (-1.0, 1.01))
        return [n for n in range(low, high) if dist(ends[n], (x, y)) <= self.hair]

    def _crown(self, end: Sequence[float], out: Vec2d, bend: float = 0.0) -> Vec2d:
        """Return the direction to the middle of the rim that continues a left side.

        Left as seen outward from a piece, which has the curvature `bend` (1/m) backward. At a free
        end it is the left normal. Where other pieces end, a disk rolls round the end only in an
        angle of more than π between two; all of that rim continues the faces of both.
        """
        near = self._from(end)
        if len(near) == 1:
            return out.perpendicular()
        ways, bends = (each[near] for each in self._onward[1:])
        dots, crosses = ways @ -np.array(out), ways[:, 0] * out.y - ways[:, 1] * out.x
        turns, curls = np.arctan2(crosses, dots), bends - bend
        alike = np.abs(turns) <= ALIKE
        turns = np.where(alike, np.where(curls > 0.0, 0.0, 2.0 * pi), turns % (2.0 * pi))
        others = np.flatnonzero(~alike | (np.abs(curls) > ALIKE * abs(bend)))
        left = out.perpendicular()
        if not len(others):
            return left
        low, high = others[turns[others].argmin()], others[turns[others].argmax()]
        if turns[low] >= pi - ALIKE:
            other, side = -Vec2d(*ways[low].tolist()), 1.0
        elif turns[high] <= pi + ALIKE:
            other, side = -Vec2d(*ways[high].tolist()), -1.0
        else:
            return left
        return left - other.perpendicular() - side * (out + other)

    def _add(self, face: Face) -> None:
        shape = face.touched
        assert shape.body is not None
        shape.collision_type = SURFACE
        self.space.add(shape.body, shape)
        self.by_shape[shape] = face

    def disk(self, particle: int) -> tuple[pymunk.Body, pymunk.Circle]:
        """Return a new body with its shape, not yet in the Space."""
        body, own = pymunk.Body(*self.heft(particle)), self.machine.particle.of(particle)
        circle = pymunk.Circle(body, float(own.radius) + self.hair)
        circle.collision_type = PARTICLE
        return body, circle

    def heft(self, particle: int) -> tuple[float, float]:
        """Return mass (kg) and moment of inertia (kg m²), inf without rotation."""
        own = self.machine.particle.of(particle)
        return float(own.mass), float(own.inertia) or inf

    def curved(self, face: Face, x: Vec2d) -> bool:
        """Whether the nearest part of a surface is an arc, the pulley or the end of a face."""
        if not face.ends:
            return True
        point = face.shape.point_query(x).point
        return bool(min((point - end).length for end in face.ends) <= self.hair)

    def meets(
        self, path: Flight | Carriage, face: Face, span: float, leaving: bool = False,
        begin: float = 0.0, near: tuple[float, Vec2d] | None = None,
    ) -> float:  # fmt: skip
        """Return the time (s) at which a disk on a path meets a surface, inf if not within `span`.

        It advances by times within which nothing can be met, see `Face.free`, and converges like
        Newton's method. A surface that is left along its tangent is checked after times that grow
        by half. `near` is its gap and normal at the beginning, if known.
        """
        r, g, hair = face.radius, self.machine.gravity, self.hair
        t = last = begin
        while True:
            x, v = path.at(t)
            gap, normal = near or face.gap(x)
            near, rate = None, v.dot(normal)
            slow = self.tiny * (self.pace + v.length)
            if leaving:
                if gap < -hair and t > 0.0:
                    return bisected(lambda t: face.gap(path.at(t)[0])[0] < -0.5 * hair, last, t)[0]
                leaving = gap <= hair and (rate <= slow or rate * rate <= 2.0 * LOW * g * hair)
            elif gap <= self.rounding or (gap <= hair and abs(rate) <= slow):
                # A curve that is entered by at most a hair is grazed, not met; nor is a surface
                # alongside met.
                graze = v.length * sqrt(2.0 * hair / r)
                if rate < -slow and (rate < -graze or not self.curved(face, x)):
                    return t
                leaving = True
            tau = face.free(path, x, v, gap, rate, path.pull(normal))
            if leaving and (speed := v.length + g * self.machine.step_of("pymunk")) > 0.0:
                tau = max(tau, min(0.5 * t + SHORT * self.machine.step_of("pymunk"), r / speed))
            if t + tau == t:
                return t
            if t == span or (not leaving and t + tau > span):
                return inf
            last, t = t, min(t + tau, span)

    def clear(self, path: Flight | Carriage, face: Face, span: float, begin: float = 0.0) -> float:
        """Return the time (s) when a disk is clear of a face that ignores it, up to `span`.

        It is checked after each tenth of a radius.
        """
        t = begin
        while t < span:
            x, v = path.at(t)
            if face.gap(x)[0] >= -self.hair and face.side(x) >= 0.0:
                return t
            t += 0.1 * self.radius / max(v.length, sqrt(path.most * self.radius), self.tiny)
        return span

    def meets_gate(self, path: Flight | Carriage, face: Face, span: float, t: float) -> float:
        """Return `meets` for a path that begins at a time (s), while the face exists."""
        begin, span = max(face.appears - t, 0.0), min(span, face.vanishes - t)
        if begin > 0.0:
            begin = self.clear(path, face, span, begin)
        met = self.meets(path, face, span, begin=begin) if begin < span else inf
        while met < inf and face.side(path.at(met)[0]) < 0.0:
            begin = self.clear(path, face, span, met)
            met = self.meets(path, face, span, begin=begin) if begin < span else inf
        return met


class Carriage:
    """Ride of one particle at the belt's speed, without rotation, at its height of release.

    It begins at `t` (s), comes to the pulley at `top`, at the angle -β from the top, and lasts
    `until` separation, there if v² ≥ g ρ cos β, else at cos φ1 = v²/(g ρ); a surface; or the end.
    """

    def __init__(self, machine: Machine, world: World, particle: int, t: float) -> None:
        assert machine.pulley is not None
        start, self.incline = machine.releases, machine.pulley.incline
        self.particle, self.surface, self.t = particle, machine.pulley.surface, t
        self.mass, self.g = float(machine.particle.of(particle).mass), machine.gravity
        self.weight, self.radius = self.mass * self.g, machine.pulley.radius
        # Along the belt and perpendicular to it.
        self.along = Vec2d(cos(self.incline), sin(self.incline))
        self.up = self.along.perpendicular()
        place = Vec2d(*start.position[particle].tolist())
        self.x, self.rho = place.dot(self.along), place.dot(self.up)
        self.speed = Vec2d(*start.velocity[particle].tolist()).dot(self.along)
        self.pace = self.along * self.speed
        self.until, self.height, self.written = machine.end_time, place.y, -inf
        self.top = inf
        if self.speed > 0.0:
            cosine = self.speed**2 / (machine.gravity * self.rho) if machine.gravity > 0.0 else inf
            angle = acos(cosine) if cosine < self.along.x else -self.incline
            path = max(0.0, -self.x) + self.rho * (angle + self.incline)
            span = min(path / self.speed, self.until - t)
            others = (face for face in world.faces if face.surface != self.surface)
            span = min((world.meets_gate(self, face, span, t) for face in others), default=span)
            self.until = min(t + path / self.speed, self.until, t + span)
            self.top = t + max(0.0, -self.x / self.speed)

    def at(self, after: float) -> tuple[Vec2d, Vec2d]:
        """Return place (m) and velocity (m/s) a time (s) after the start."""
        way = self.x + self.speed * after
        if way <= 0.0:
            # In plain numbers, as in `Flight`.
            (x, y), (u, v), rho = self.along, self.up, self.rho
            return Vec2d(x * way + u * rho, y * way + v * rho), self.pace
        angle = way / self.rho - self.incline
        c, s = cos(angle), sin(angle)
        return Vec2d(self.rho * s, self.rho * c), Vec2d(self.speed * c, -self.speed * s)

    @property
    def most(self) -> float:
        """The largest acceleration (m/s²) in any direction."""
        return self.speed**2 / self.rho

    def pull(self, _normal: Vec2d) -> float:
        """Return the least acceleration (m/s²) along any normal."""
        return -(self.speed**2) / self.rho

    def write(self, recorder: Recorder, end: float) -> None:
        """Write the knots up to a time (s), with the belt's work, which is negative going down."""
        turn = self.speed / self.rho * max(end - self.top, 0.0)
        round_it = np.linspace(self.top, end, ceil(turn / ARC) + 1).tolist() if turn else []
        for t in (self.t, *round_it, end):
            if t > self.written:
                if recorder.bins is not None and t > self.t:
                    self._bear(recorder.bins, max(self.written, self.t), t)
                x, v = self.at(t - self.t)
                recorder.book(self.particle, self.surface, self.weight * (x.y - self.height))
                recorder.knots(self.particle, t, tuple(x), tuple(v), 0.0)
                self.height, self.written = x.y, t

    def foot(self, t: ArrayLike) -> tuple[Floats, Floats]:
        """Return its contact points on the belt at times (s), (2, ...) m, and the normals there."""
        way = self.x + self.speed * (np.asarray(t) - self.t)
        angle = np.maximum(way, 0.0) / self.rho - self.incline
        normal, back = np.stack([np.sin(angle), np.cos(angle)]), np.minimum(way, 0.0)
        return self.radius * normal + np.multiply.outer(self.along, back), normal

    def _bear(self, bins: Bins, begin: float, end: float) -> None:
        """Count the belt's load between two times (s)."""
        times = np.linspace(begin, end, ceil((end - begin) / bins.every) + 1)
        span = np.diff(times)
        x, y = self.mass * self.speed * np.diff(self.foot(times)[1])
        weight = self.mass * self.g * span
        surfaces = np.full(len(span), self.surface)
        bins.bear(
            surfaces, times[:-1], times[1:], *self.foot(times[:-1] + 0.5 * span), (y, weight - x)
        )
