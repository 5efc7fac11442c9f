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
"""Friction coefficient that stands for inf, which Chipmunk would multiply with an impulse of 0."""

HAIR = 2e-11
"""Share of the radius by which a disk in the Space is larger than the particle, so that Chipmunk
sees a contact where centre and surface are one radius apart. Levers are off by as much."""

DIGITS = 16.0 * float(np.finfo(float).eps)
"""Share of the machine's size below which a gap is rounding."""

TINY = 1e-12
"""Share of `Machine.pace` in m/s plus the particle's speed; so slow an approach is no blow."""

LOW = 2.0
"""Hairs; bounces lower than this cannot be told from lying on the surface."""

SHORT = 1e-5
"""Share of a step; a contact that lasts less has ended, and a surface just left is looked at again
after that."""


JOINT = 0.0625
"""Hairs. Where another piece goes on from its end, an arc reaches past it, and what slides on to it
touches both; by so little that its way there is, whichever way both bend, never deeper in the arc
than 4 times this: less than the depth at which a step ends because a surface is met."""

ALIKE = 1e-9
"""Directions (rad), and curvatures as a share, that differ by less are one."""

ARC = 0.025
"""rad between knots round the pulley: ρ Δφ⁴/384, the curve's error, is 1e-9 of the radius."""

NONE = (Vec2d.zero(), Vec2d.zero())
"""Crowns of what has no ends."""


@dataclass(frozen=True, eq=False)
class Face:
    """A straight surface, as a segment without thickness, the pulley, as a circle, or a point.

    A point is the end of an arc; its tangent is the arc's there.
    """

    shape: pymunk.Shape  # on a body of its own
    surface: int  # index into `Machine.surfaces`
    tangent: Vec2d | None  # direction of a segment
    speed: float  # m/s
    restitution: float  # of the pair with a particle, and so is friction
    friction: float  # finite
    radius: float  # of the particle, m
    appears: float  # from when to when it is there, s
    vanishes: float
    one_sided: int  # 1 if it is solid on its left, -1 if on its right; of an arc outside, inside
    spin: float  # of a wheel, rad/s: what rolls on it rolls as fast as it turns against this
    crowns: tuple[Vec2d, Vec2d]  # see `World._crown`; at the first end and at the last

    @cached_property
    def ends(self) -> tuple[Vec2d, ...]:
        """Both ends of a segment (m)."""
        return (self.shape.a, self.shape.b) if isinstance(self.shape, pymunk.Segment) else ()

    @property
    def touched(self) -> pymunk.Shape:
        """The shape in the Space that a particle by itself is in contact with."""
        return self.shape

    @property
    def turns(self) -> bool:
        """Whether that shape turns with the surface's speed."""
        return self.tangent is None

    def put(self, x: Vec2d) -> None:
        """Make ready to be touched from a place (m)."""

    def gap(self, x: Vec2d) -> tuple[float, Vec2d]:
        """Return the gap (m) between the surface and a disk round a point, and the normal there.

        Nearer than 1e-5 m Chipmunk has a segment's own normal for it, on either side.
        """
        found = self.shape.point_query(x)
        normal = found.gradient if self.tangent is None else (x - found.point).normalized()
        return found.distance - self.radius, normal

    def side(self, x: Vec2d) -> float:
        """Return how far a place is on the solid side (m), less than 0 on the other; 0 if on both.

        Beyond an end that is the side of its straight way on.
        """
        if not self.one_sided or self.tangent is None or self.shape.body is None:
            return 0.0
        away = x - self.shape.point_query(x).point
        left = self.tangent.perpendicular().rotated(self.shape.body.angle)
        return self.one_sided * away.dot(left)

    def belt(self, normal: Vec2d) -> float:
        """Return the speed (m/s) of the surface along (n_y, -n_x) where a disk touches it.

        It is that of an end roller at the ends: the same on the rim as on the face on that side.
        """
        if self.tangent is None or self.crowns[self.tangent.dot(normal) > 0.0].dot(normal) >= 0.0:
            return self.speed
        return -self.speed

    def hollow(self, x: Vec2d) -> float:
        """Return 1 over the radius (1/m) on which a disk's centre follows a hollow side, or 0."""
        return 0.0

    def free(
        self, path: Flight | Carriage, x: Vec2d, v: Vec2d, gap: float, rate: float, pull: float
    ) -> float:
        """Return a time (s) in which a disk at a place on a path surely meets no surface.

        A convex one lies behind the plane through its nearest point: the gap stays above
        gap + rate τ + pull τ²/2, with the rate and the least acceleration along the normal there.
        """
        return falls(gap, rate, pull)


@dataclass(frozen=True, eq=False)
class Bend(Face):
    """An arc, met from inside and outside, or a whole circle; the ends of an arc are other faces.

    Chipmunk has no hollow shape. Its distance query on the circle tells the gap, on either side; to
    be pushed, a disk is given a point to lie on, put where the circle is nearest.
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
        """Put the foot where the arc is nearest to a place (m), or out of reach beside an arc."""
        assert self.foot.body is not None
        assert isinstance(self.shape, pymunk.Circle)
        beside = self.gap(x)[0] == inf
        away = x + Vec2d(4.0 * self.radius, 0.0)
        onto = self.center + self.shape.radius * self.outward(x)
        self.foot.body.position = away if beside else onto

    def outward(self, x: Vec2d) -> Vec2d:
        """Return the direction of a place from the centre.

        Nearer to the centre than 1e-5 m Chipmunk has its own, the same for all places.
        """
        away = x - self.center
        return away.normalized() if away.length > 0.0 else Vec2d(0.0, 1.0)

    def gap(self, x: Vec2d) -> tuple[float, Vec2d]:
        """Return the gap (m) and the normal; inf where an end is nearer than all between them."""
        distance, away = self.shape.point_query(x).distance, self.outward(x)
        side = 1.0 if distance >= 0.0 else -1.0
        if (atan2(away.y, away.x) - self.begin) % (2.0 * pi) > self.extent:
            return inf, side * away
        return side * distance - self.radius, side * away

    def side(self, x: Vec2d) -> float:
        """Return how far a place is on the solid side (m): outside of it, or inside."""
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
        """Return a time (s) in which it is not met; see `Face.free` for the outside.

        Beside an arc that is the time to a line through the centre and an end. Inside, with c from
        the centre to the place, ρ² - c² starts at the gap times ρ + c, changes at -2 c·v, and that
        by -2 (v² + c·a), which is bounded for the time that it takes to go some ρ.
        """
        away = x - self.center
        if gap == inf:
            lines = (Vec2d.from_polar(1.0, self.begin + turn) for turn in (0.0, self.extent))
            sides = [line.perpendicular() for line in lines]
            sides = [side if away.dot(side) >= 0.0 else -side for side in sides]
            ahead = min(falls(away.dot(n), v.dot(n), path.pull(n)) for n in sides)
            # Past the line, or it might take itself to be on either side of it.
            pace = max(v.length, sqrt(path.most * self.radius))
            # What lies still where nothing pulls never gets there.
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
        # Number by number: operators of Vec2d take ten times as long.
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
    """A Space with all surfaces of a machine, counted from near its place (`recorder.origin`).

    `faces` are its segments, in their order, the pulley, the arcs and their ends, as one particle
    meets them; `gates` tells whether some are not there all the time. Gaps up to `hair` (m) are
    contact, and gaps of `rounding` (m) are none. `tiny` is the share of speeds below which one into
    a surface is rounding, which tilts normals.
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
        """Return what a face knows of a segment or arc; pair values are (S,), or (K, S)."""
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
        """Add an arc, and its ends (m), each with the way into the arc there."""
        arcs = self.machine.arcs
        radius, begin, extent = (float(of[n]) for of in (arcs.radius, arcs.begin, arcs.extent))
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        body.position = center
        # A shape that is not in the Space does not keep its body.
        self.space.add(body)
        circle = pymunk.Circle(body, radius)
        circle.cache_bb()
        base = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        base.position = center  # feet in one place would all be pairs in every step
        foot = pymunk.Circle(base, 0.0)
        about["spin"] = -about["speed"] / radius
        if extent >= 2.0 * pi:
            about |= {"begin": 0.0, "extent": inf}
            self._add(Bend(circle, tangent=None, foot=foot, crowns=NONE, **about))
            return
        # Of the centre's way there, which bends no more than the sharpest arc.
        more = sqrt(2.0 * JOINT * self.hair * float(arcs.radius.min())) / (radius + self.radius)
        # Where another piece goes on from the end, turning by less than that.
        before, after = (
            more if (np.hypot(*(self._from(end.tolist())[0] + inward).T) <= more).any() else 0.0
            for end, inward in ends
        )
        self._add(Bend(
            circle, tangent=None, foot=foot, begin=begin - before, extent=extent + before + after,
            crowns=NONE, **about,
        ))  # fmt: skip
        # Out of it is along the surface at the first end, against it at the last.
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
        """Ends of all pieces from left to right, n of [x, y], m, and the ways on into each.

        These are directions, (n, 2), and curvatures, (n,), 1/m, > 0 to the left.
        """
        sides = [
            (end, way, turn / part.radius if isinstance(part, Arcs) else np.zeros(len(end)))
            for part in (each.of(~each.whole) for each in self.machine.parts if each.surface.size)
            for end, way, turn in zip(part.ends, part.inward, (1.0, -1.0), strict=True)
        ]
        ends, ways, bends = (np.concatenate(each) for each in zip(*sides, strict=True))
        order = ends[:, 0].argsort(kind="stable")
        return ends[order].tolist(), ways[order], bends[order]

    def _from(self, end: Sequence[float]) -> tuple[Floats, Floats]:
        """Return the ways on, as of `_onward`, into all pieces that end in a place (m)."""
        (ends, ways, bends), (x, y) = self._onward, end
        low, high = (bisect_left(ends, [x + share * self.hair]) for share in (-1.0, 1.01))
        near = [n for n in range(low, high) if dist(ends[n], (x, y)) <= self.hair]
        return ways[near], bends[near]

    def _crown(self, end: Sequence[float], out: Vec2d, bend: float = 0.0) -> Vec2d:
        """Return the way to the middle of the half of an end's rim that goes on from a left side.

        That is the side of the way out of a piece, which bends by so much (1/m) on the way back. At
        a free end it is the left normal. Where others end, a disk rolls round the end only in the
        angle between two pieces that is more than π: all of that rim goes on from the side of
        either that faces it.
        """
        ways, bends = self._from(end)
        if len(ways) == 1:
            return out.perpendicular()
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
        """Return mass (kg) and moment of inertia (kg m²), inf of what does not turn."""
        own = self.machine.particle.of(particle)
        return float(own.mass), float(own.inertia) or inf

    def curved(self, face: Face, x: Vec2d) -> bool:
        """Tell whether what is nearest of a surface is an arc, the pulley or the end of a face."""
        if not face.ends:
            return True
        point = face.shape.point_query(x).point
        return bool(min((point - end).length for end in face.ends) <= self.hair)

    def meets(
        self, path: Flight | Carriage, face: Face, span: float, leaving: bool = False,
        begin: float = 0.0, near: tuple[float, Vec2d] | None = None,
    ) -> float:  # fmt: skip
        """Return after what time (s) a disk on a path meets a surface, inf if not within `span`.

        It goes on by the times in which surely nothing is met, see `Face.free`: that never passes a
        contact, and converges like Newton's method. A surface that is being left along its tangent
        gives no bound; it is looked at after times that grow by half. `near` is its gap and normal
        where the path begins, if they are known.
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
                # A hair deep or less a curve is grazed, not met; nor is what runs alongside.
                graze = v.length * sqrt(2.0 * hair / r)
                if rate < -slow and (rate < -graze or not self.curved(face, x)):
                    return t
                leaving = True
            tau = face.free(path, x, v, gap, rate, path.pull(normal))
            if leaving and (speed := v.length + g * self.machine.dt) > 0.0:
                tau = max(tau, min(0.5 * t + SHORT * self.machine.dt, r / speed))
            if t + tau == t:
                return t
            if t == span:
                return inf
            last, t = t, min(t + tau, span)

    def clear(self, path: Flight | Carriage, face: Face, span: float, begin: float = 0.0) -> float:
        """Return when (s) a disk on a path is clear of what spares it, at most `span`.

        It is looked for after each tenth of a radius' way.
        """
        t = begin
        while t < span:
            x, v = path.at(t)
            if face.gap(x)[0] >= -self.hair and face.side(x) >= 0.0:
                return t
            t += 0.1 * self.radius / max(v.length, sqrt(path.most * self.radius), self.tiny)
        return span

    def meets_gate(self, path: Flight | Carriage, face: Face, span: float, t: float) -> float:
        """Return what `meets` does of a path that begins at a time (s), while the face is there."""
        begin, span = max(face.appears - t, 0.0), min(span, face.vanishes - t)
        if begin > 0.0:
            begin = self.clear(path, face, span, begin)
        met = self.meets(path, face, span, begin=begin) if begin < span else inf
        while met < inf and face.side(path.at(met)[0]) < 0.0:
            begin = self.clear(path, face, span, met)
            met = self.meets(path, face, span, begin=begin) if begin < span else inf
        return met


class Carriage:
    """Ride of one particle at the belt's speed, not turning, at the height it is released at.

    It begins at `t` (s), comes to the pulley at `top`, at the angle -β from its axis, and lasts
    `until` separation: there if v² ≥ g ρ cos β, else at cos φ1 = v²/(g ρ); or until another surface
    is met; or to the end of the run.
    """

    def __init__(self, machine: Machine, world: World, particle: int, t: float) -> None:
        assert machine.pulley is not None
        start, self.incline = machine.releases, machine.pulley.incline
        self.particle, self.surface, self.t = particle, machine.pulley.surface, t
        self.mass, self.g = float(machine.particle.of(particle).mass), machine.gravity
        self.weight, self.radius = self.mass * self.g, machine.pulley.radius
        # Along the belt and square to it.
        self.along = Vec2d(cos(self.incline), sin(self.incline))
        self.up = self.along.perpendicular()
        place = Vec2d(*start.position[particle].tolist())
        self.x, self.rho = place.dot(self.along), place.dot(self.up)
        self.speed = Vec2d(*start.velocity[particle].tolist()).dot(self.along)
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
            return self.along * way + self.up * self.rho, self.along * self.speed
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
        """Write the knots up to a time (s), with what the belt pays: it lets the particle down."""
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
        """Return where on the belt it lies at times (s), (2, ...) m, and the normal there."""
        way = self.x + self.speed * (np.asarray(t) - self.t)
        angle = np.maximum(way, 0.0) / self.rho - self.incline
        normal, back = np.stack([np.sin(angle), np.cos(angle)]), np.minimum(way, 0.0)
        return self.radius * normal + np.multiply.outer(self.along, back), normal

    def _bear(self, bins: Bins, begin: float, end: float) -> None:
        """Count what the belt bears between two times (s)."""
        times = np.linspace(begin, end, ceil((end - begin) / bins.every) + 1)
        span = np.diff(times)
        x, y = self.mass * self.speed * np.diff(self.foot(times)[1])
        weight = self.mass * self.g * span
        surfaces = np.full(len(span), self.surface)
        bins.bear(
            surfaces, times[:-1], times[1:], *self.foot(times[:-1] + 0.5 * span), (y, weight - x)
        )
