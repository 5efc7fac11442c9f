"""Surfaces as one particle meets them: gaps by Chipmunk's distance query; free flight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import atan2, inf, pi, sqrt
from typing import Any, NamedTuple, Protocol

import pymunk
from pymunk import Vec2d
from pymunk._chipmunk_cffi import ffi, lib

from chutelab.util.arrays import Floats

HAIR = 2e-11
"""Share of the radius by which a disk in the Space is larger than the particle, so that Chipmunk
detects a contact when centre and surface are one radius apart. Levers have the same error."""


def no_rims() -> tuple[Vec2d, Vec2d]:
    """Return the crowns of a face without ends."""
    return Vec2d.zero(), Vec2d.zero()


def left_twice(along: Vec2d) -> tuple[Vec2d, Vec2d]:
    """Return the crowns of a face that does not move along itself."""
    return (along.perpendicular(),) * 2


Place = tuple[float, float]
"""x and y, m; often a plain pair, because a Vec2d takes ten times as long to make."""


def nearest(shape: pymunk.Shape, x: Place) -> Any:
    """Return the point of a shape that is nearest to a place (m): `distance`, `point`, `gradient`.

    As `Shape.point_query`, in a third of the time, without the objects that it makes.
    """
    found = ffi.new("cpPointQueryInfo *")
    lib.cpShapePointQuery(shape._shape, x, found)
    return found


def direction(begin: Place, end: Place) -> Vec2d:
    """Return the unit vector from one place to another, 0 if they are one."""
    (x, y), (u, v) = begin, end
    x, y = u - x, v - y
    far = sqrt(x * x + y * y) or 1.0
    return Vec2d(x / far, y / far)


def length(v: Place) -> float:
    """Return the length of a vector."""
    x, y = v
    return sqrt(x * x + y * y)


class Path(Protocol):
    """Motion of one particle between contacts."""

    @property
    def most(self) -> float:
        """The largest acceleration (m/s²) in any direction."""

    def at(self, after: float) -> tuple[Place, Place]:
        """Return place (m) and velocity (m/s) after a time (s)."""

    def pull(self, normal: Place, /) -> float:
        """Return the least acceleration (m/s²) along a normal."""


@dataclass(eq=False)
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
    rims: Callable[[], tuple[Vec2d, Vec2d]]  # see `Ends.crown`; at the first end and at the last

    @cached_property
    def crowns(self) -> tuple[Vec2d, Vec2d]:
        """The `rims`, of which most runs need few."""
        return self.rims()

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

    def gap(self, x: Place) -> tuple[float, Vec2d]:
        """Return the gap (m) between the surface and a disk round a point, and the normal there."""
        found = nearest(self.shape, x)
        # Closer than 1e-5 m Chipmunk returns a segment's own normal, on either side.
        if self.tangent is None:
            normal = Vec2d(found.gradient.x, found.gradient.y)
        else:
            normal = direction((found.point.x, found.point.y), x)
        return found.distance - self.radius, normal

    def side(self, x: Place) -> float:
        """Return the distance to the solid side (m), negative on the other; 0 if both are solid."""
        if not self.one_sided or self.tangent is None or self.shape.body is None:
            return 0.0
        point = nearest(self.shape, x).point
        away = Vec2d(x[0] - point.x, x[1] - point.y)
        left = self.tangent.perpendicular().rotated(self.shape.body.angle)
        return self.one_sided * away.dot(left)

    def belt(self, normal: Vec2d) -> float:
        """Return the speed (m/s) of the surface along (n_y, -n_x) where a disk touches it.

        At the ends it is that of an end roller: the same on the rim as on the adjoining face.
        """
        if self.tangent is None or self.crowns[self.tangent.dot(normal) > 0.0].dot(normal) >= 0.0:
            return self.speed
        return -self.speed

    def hollow(self, x: Place) -> float:
        """Return the curvature (1/m) of a centre's path inside an arc, 0 elsewhere."""
        return 0.0

    def free(self, path: Path, x: Place, v: Place, gap: float, rate: float, pull: float) -> float:
        """Return a time (s) within which a disk on a path cannot meet the surface.

        A convex one lies behind the plane through its nearest point: the gap stays above
        gap + rate τ + pull τ²/2, with the rate and the least acceleration along the normal there.
        """
        return falls(gap, rate, pull)


@dataclass(eq=False)
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

    def outward(self, x: Place) -> Vec2d:
        """Return the direction of a place from the centre."""
        center = self.center
        # Closer than 1e-5 m Chipmunk returns a fixed direction.
        return direction(center, x) if x != center else Vec2d(0.0, 1.0)

    def gap(self, x: Place) -> tuple[float, Vec2d]:
        """Return the gap (m) and the normal; inf where an end is nearest."""
        distance, away = nearest(self.shape, x).distance, self.outward(x)
        side = 1.0 if distance >= 0.0 else -1.0
        if (atan2(away.y, away.x) - self.begin) % (2.0 * pi) > self.extent:
            return inf, side * away
        return side * distance - self.radius, side * away

    def side(self, x: Place) -> float:
        """Return the distance to the solid side (m): outside of the arc, or inside."""
        return float(self.one_sided * nearest(self.shape, x).distance)

    def belt(self, normal: Vec2d) -> float:
        """Return the speed (m/s) along (n_y, -n_x): the surface runs clockwise."""
        assert self.foot.body is not None
        outside = (self.foot.body.position - self.center).dot(normal) >= 0.0
        return self.speed if outside else -self.speed

    def hollow(self, x: Place) -> float:
        """Return 1/(R - r) inside, 0 outside."""
        assert isinstance(self.shape, pymunk.Circle)
        room = self.shape.radius - self.radius
        return 1.0 / room if room > 0.0 and (x - self.center).length < self.shape.radius else 0.0

    def free(self, path: Path, x: Place, v: Place, gap: float, rate: float, pull: float) -> float:
        """Return a time (s) within which it cannot be met; for the outside see `Face.free`.

        Beside an arc until a line through the centre and an end. Inside, c away from the centre,
        ρ² - c² begins at the gap times ρ + c, at the rate -2 c·v, and bends by -2 (v² + c·a).
        """
        away = x - self.center
        if gap == inf:
            lines = (Vec2d.from_polar(1.0, self.begin + turn) for turn in (0.0, self.extent))
            sides = [line.perpendicular() for line in lines]
            sides = [side if away.dot(side) >= 0.0 else -side for side in sides]
            ahead = min(falls(away.dot(n), n.dot(v), path.pull(n)) for n in sides)
            # Go past the line, so that the side is certain.
            pace = max(length(v), sqrt(path.most * self.radius))
            # A particle at rest without gravity never gets there.
            return ahead + HAIR * self.radius / pace if pace else inf
        if not (hollow := self.hollow(x)):
            return falls(gap, rate, pull)
        rho, c = 1.0 / hollow, away.length
        horizon = rho / (length(v) + sqrt(path.most * rho))
        bend = 2.0 * ((length(v) + path.most * horizon) ** 2 + rho * path.most)
        return min(falls(gap * (rho + c), -2.0 * away.dot(v), -bend), horizon)


class Flight(NamedTuple):
    """Free flight from a place (m) at a velocity (m/s); `g` is gravity (m/s²)."""

    x: Vec2d
    v: Vec2d
    g: Vec2d

    def at(self, after: float) -> tuple[Place, Place]:
        """Return place (m) and velocity (m/s) after a time (s)."""
        # In plain numbers, as operators of Vec2d take ten times as long.
        (x, y), (vx, vy), (gx, gy) = self
        half = 0.5 * after
        place = x + after * (vx + half * gx), y + after * (vy + half * gy)
        return place, (vx + after * gx, vy + after * gy)

    def pull(self, normal: Place) -> float:
        """Return the acceleration (m/s²) along a normal."""
        (x, y), (u, v) = self.g, normal
        return x * u + y * v

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
