"""The machine as a `pymunk.Space`, where a path meets its surfaces, and rides by adhesion."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from functools import cached_property, partial
from itertools import chain
from math import acos, ceil, cos, dist, inf, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
import pymunk
from numpy.typing import ArrayLike
from pymunk import Vec2d

from chutelab.engines.pymunk.faces import (
    HAIR,
    Bend,
    Face,
    Path,
    Place,
    left_twice,
    length,
    nearest,
    no_rims,
)
from chutelab.machine import Arcs, Machine, Segments
from chutelab.results.loads import Bins
from chutelab.results.recorder import Recorder
from chutelab.util.arrays import Floats, Ints, bisected

PARTICLE, SURFACE = 1, 2
"""Collision types of disks and of everything they meet."""

GRIP = 1e9
"""Friction coefficient for inf, which Chipmunk would multiply with an impulse of 0."""

ROUNDING = float(np.finfo(float).eps)
"""Share by which rounding changes a number."""

DIGITS = 16.0 * ROUNDING
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


class Onward(NamedTuple):
    """The continuation of the surface from the end (m) of a piece into the piece."""

    end: list[float]
    way: list[float]  # direction
    bend: float  # curvature, 1/m, positive to the left
    piece: int  # its number: lines, then arcs


class Ends:
    """The ends of all straight and bent pieces, and what continues from them.

    Straight pieces are given by both ends (m) and their direction. Ends less than `hair` (m) apart
    are at one place. Of the pieces in `faces` only those count that exist at the time `now` (s).
    """

    def __init__(self, lines: Sequence[Sequence[Any]], arcs: Arcs, hair: float) -> None:
        self.lines, self.arcs, self.hair = lines, arcs, hair
        self.faces, self.now = dict[int, Face](), 0.0

    def rims(self, start: list[float], end: list[float], along: Vec2d) -> tuple[Vec2d, Vec2d]:
        """Return the crowns at both ends of a straight piece."""
        return -self.crown(start, -along), self.crown(end, along)

    def rim(self, end: list[float], out: Vec2d, bend: float) -> tuple[Vec2d, Vec2d]:
        """Return the crown at an end of an arc, twice."""
        return (self.crown(end, out, bend),) * 2

    @cached_property
    def _onward(self) -> tuple[list[float], list[Onward]]:
        """The ends of all pieces by x (m), and what continues from them."""
        found = list[Onward]()
        for n, (start, end, (x, y)) in enumerate(self.lines):
            found += Onward(start, [x, y], 0.0, n), Onward(end, [-x, -y], 0.0, n)
        if self.arcs.surface.size:
            arcs = self.arcs.of(~self.arcs.whole)
            pieces = (len(self.lines) + np.flatnonzero(~self.arcs.whole)).tolist()
            for ends, ways, turn in zip(arcs.ends, arcs.inward, (1.0, -1.0), strict=True):
                bends = (turn / arcs.radius).tolist()
                found += map(Onward, ends.tolist(), ways.tolist(), bends, pieces)
        found.sort(key=lambda one: one.end[0])
        return [one.end[0] for one in found], found

    def at(self, end: Sequence[float]) -> list[Onward]:
        """Return the pieces that end at a place (m)."""
        (places, found), x, hair = self._onward, end[0], self.hair
        low, high = bisect_left(places, x - hair), bisect_left(places, x + 1.01 * hair)
        near = (one for one in found[low:high] if dist(one.end, end) <= hair)
        return [one for one in near if self._is_there(one.piece)]

    def _is_there(self, piece: int) -> bool:
        face = self.faces.get(piece)
        return face is None or face.appears <= self.now < face.vanishes

    def crown(self, end: Sequence[float], out: Vec2d, bend: float = 0.0) -> Vec2d:
        """Return the direction to the middle of the rim that continues a left side.

        Left as seen outward from a piece, which has the curvature `bend` (1/m) backward. At a free
        end it is the left normal. Where other pieces end, a disk rolls round the end only in an
        angle of more than π between two; all of that rim continues the faces of both.
        """
        near = self.at(end)
        # Alone there; or the piece itself is not, and nothing touches its rim.
        if len(near) < 2:
            return out.perpendicular()
        ways, bends = np.array([one.way for one in near]), np.array([one.bend for one in near])
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


class World:
    """A Space with all surfaces of a machine, relative to `recorder.origin`.

    `faces` are its segments, in order, the pulley, the arcs and their ends, as one particle meets
    them; `gates` says whether some do not always exist. Gaps up to `hair` (m) are contact, those of
    `rounding` (m) are 0. `tiny` is the share of speeds that tilted normals make by rounding. With
    `alone` one body has all fixed surfaces.
    """

    def __init__(self, machine: Machine, particle: int = 0, *, alone: bool = False) -> None:
        self.machine, self.particle, self.alone = machine, particle, alone
        self.space = pymunk.Space()
        parts, arcs, wheel = machine.segments, machine.arcs, machine.pulley
        r = self.radius = float(machine.particle.of(particle).radius)
        ways = parts.start.tolist(), parts.end.tolist(), parts.tangent.tolist()
        bends = arcs.corners.tolist() if arcs.surface.size else []
        size = max([r, *map(abs, chain.from_iterable((*ways[0], *ways[1], *bends)))])
        self.rounding = DIGITS * size
        self.hair = max(HAIR * r, 4.0 * self.rounding)
        self.tiny, self.pace = max(TINY, self.rounding / r), float(machine.pace)
        self.dt = machine.step_of("pymunk")
        self.by_shape: dict[pymunk.Shape, Face] = {}
        self.ends = Ends([*zip(*ways, strict=True)], arcs, self.hair)
        for n, (start, end, along) in enumerate(self.ends.lines):
            still, tangent = self._still(), Vec2d(*along)
            shape = pymunk.Segment(still, start, end, 0.0)
            about = self._about(parts, n)
            rims = partial(left_twice, tangent)
            if about["speed"]:
                rims = partial(self.ends.rims, start, end, tangent)
            self.ends.faces[n] = Face(shape, tangent=tangent, rims=rims, **about)
            self._add(self.ends.faces[n])
        if wheel is not None:
            turning = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            turning.angular_velocity = -wheel.speed / wheel.radius
            about = self._about(wheel.rim, 0) | {"spin": turning.angular_velocity}
            rim = pymunk.Circle(turning, wheel.radius)
            self._add(Face(rim, tangent=None, rims=no_rims, **about))
        if arcs.surface.size:
            sides = [zip(*pair, strict=True) for pair in zip(arcs.ends, arcs.inward, strict=True)]
            for n, (center, *ends) in enumerate(zip(arcs.center.tolist(), *sides, strict=True)):
                self._bend(n, Vec2d(*center), ends, self._about(arcs, n))
        self.faces = list(self.by_shape.values())
        self.gates = any(face.appears > -inf or face.vanishes < inf for face in self.faces)

    def set_clock(self, now: float) -> None:
        """Let the crowns of all faces be those among the pieces that exist at a time (s)."""
        self.ends.now = now
        for face in self.faces:
            vars(face).pop("crowns", None)

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
            self._add(Bend(circle, tangent=None, foot=foot, rims=no_rims, **about))
            return
        # rad; extension of the arc at an end, see `JOINT`, for the sharpest arc.
        more = sqrt(2.0 * JOINT * self.hair * float(arcs.radius.min())) / (radius + self.radius)
        # Whether another piece continues from the end, turning by less than that.
        before, after = (
            more
            if any(dist(one.way, -inward) <= more for one in self.ends.at(end.tolist()))
            else 0.0
            for end, inward in ends
        )
        face = Bend(
            circle, tangent=None, foot=foot, begin=begin - before, extent=extent + before + after,
            rims=no_rims, **about,
        )  # fmt: skip
        self.ends.faces[len(self.ends.lines) + n] = face
        self._add(face)
        # The outward direction is along the surface at the first end, against it at the last.
        for (place, inward), way in zip(ends, (1.0, -1.0), strict=True):
            end = place.tolist()
            still = self._still()
            point = pymunk.Circle(still, 0.0, end)
            out = Vec2d(*(-inward).tolist())
            rims = partial(left_twice, out)
            if about["speed"]:
                rims = partial(self.ends.rim, end, out, way / radius)
            self._add(Face(
                point, tangent=out, rims=rims,
                **about | {key: about[key] * int(way) for key in ("speed", "one_sided")},
            ))  # fmt: skip

    def _still(self) -> pymunk.Body:
        """Return a body for a fixed surface; a shape that is not in the Space does not keep it."""
        return self.space.static_body if self.alone else pymunk.Body(body_type=pymunk.Body.STATIC)

    def _add(self, face: Face) -> None:
        shape, body = face.touched, face.touched.body
        assert body is not None
        shape.collision_type = SURFACE
        if body is not self.space.static_body:
            self.space.add(body)
        self.space.add(shape)
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

    def curved(self, face: Face, x: Place) -> bool:
        """Whether the nearest part of a surface is an arc, the pulley or the end of a face."""
        if not face.ends:
            return True
        point = nearest(face.shape, x).point
        return bool(min(dist((point.x, point.y), end) for end in face.ends) <= self.hair)

    def meets(
        self, path: Path, face: Face, span: float, leaving: bool = False,
        begin: float = 0.0, near: tuple[float, Vec2d] | None = None,
    ) -> float:  # fmt: skip
        """Return the time (s) at which a disk on a path meets a surface, inf if not within `span`.

        It advances by times within which nothing can be met, see `Face.free`, and converges like
        Newton's method. A surface that is left along its tangent is checked after times that grow
        by half. `near` is its gap and normal at the beginning, if known.
        """
        r, g, hair, dt = face.radius, self.machine.gravity, self.hair, self.dt
        t = last = begin
        while True:
            x, v = path.at(t)
            gap, normal = near or face.gap(x)
            # In plain numbers, as in `Flight`.
            (vx, vy), (nx, ny) = v, normal
            near, rate, speed = None, vx * nx + vy * ny, length(v)
            slow = self.tiny * (self.pace + speed)
            if leaving:
                if gap < -hair and t > 0.0:
                    return bisected(lambda t: face.gap(path.at(t)[0])[0] < -0.5 * hair, last, t)[0]
                leaving = gap <= hair and (rate <= slow or rate * rate <= 2.0 * LOW * g * hair)
            elif gap <= self.rounding or (gap <= hair and abs(rate) <= slow):
                # A curve that is entered by at most a hair is grazed, not met; nor is a surface
                # alongside met.
                graze = speed * sqrt(2.0 * hair / r)
                if rate < -slow and (rate < -graze or not self.curved(face, x)):
                    return t
                leaving = True
            tau = face.free(path, x, v, gap, rate, path.pull(normal))
            if leaving and (speed := speed + g * dt) > 0.0:
                tau = max(tau, min(0.5 * t + SHORT * dt, r / speed))
            if t + tau == t:
                return t
            if t == span or (not leaving and t + tau > span):
                return inf
            last, t = t, min(t + tau, span)

    def clear(self, path: Path, face: Face, span: float, begin: float = 0.0) -> float:
        """Return the time (s) when a disk is clear of a face that ignores it, up to `span`.

        It is checked after each tenth of a radius.
        """
        t = begin
        while t < span:
            x, v = path.at(t)
            if face.gap(x)[0] >= -self.hair and face.side(x) >= 0.0:
                return t
            t += 0.1 * self.radius / max(length(v), sqrt(path.most * self.radius), self.tiny)
        return span

    def meets_gate(self, path: Path, face: Face, span: float, t: float) -> float:
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
        # The largest acceleration (m/s²) in any direction: none before the top.
        self.top, self.most = inf, 0.0
        if self.speed > 0.0:
            cosine = self.speed**2 / (machine.gravity * self.rho) if machine.gravity > 0.0 else inf
            angle = acos(cosine) if cosine < self.along.x else -self.incline
            path = max(0.0, -self.x) + self.rho * (angle + self.incline)
            if self.x > 0.0 or angle + self.incline > 0.0:
                self.most = self.speed**2 / self.rho
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

    def pull(self, _normal: Place) -> float:
        """Return the least acceleration (m/s²) along any normal."""
        return -self.most

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
                recorder.knot(self.particle, t, x, v, 0.0)
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


def balance(losses: Floats, energy: Floats, one: Ints, other: Ints, count: int) -> None:
    """Change losses of contacts, (2, k), of which only the sum of each island is meaningful.

    Contacts that are solved together may seem to give energy that others take: within an island of
    particles that touch each other, negative losses are set against positive ones, in proportion,
    first those along the normal and those along the surface for themselves. Losses that are
    negative by rounding alone remain.

    Parameters
    ----------
    energy
        p²/m of the impulse p of each contact, J, added up over the masses m of both particles; of
        this the rounding of velocities changes the losses by the share `ROUNDING`.
    one, other
        The rows of each contact: a particle, and another one or a surface.
    count
        How many particles there are; their rows come first.
    """
    if -np.minimum(losses, 0.0).sum() <= ROUNDING * energy.sum():
        return
    other = np.where(other < count, other, one)
    island, before = np.arange(count), None
    mine, others = one[one != other], other[one != other]
    while before is None or (island != before).any():
        before = island.copy()
        least = np.minimum(island[mine], island[others])
        np.minimum.at(island, island[mine], least)
        np.minimum.at(island, island[others], least)
        island = island[island]
    of = island[one]
    for rows in (slice(0, 1), slice(1, 2), slice(0, 2)):
        some = losses[rows]
        less = np.minimum(some, 0.0)
        if not less.any():
            continue
        more = some - less
        plus, minus = (np.bincount(of, part.sum(axis=0), count) for part in (more, less))
        left = plus + minus
        up = np.divide(np.maximum(left, 0.0), plus, out=np.zeros(count), where=plus > 0.0)
        down = np.divide(np.minimum(left, 0.0), minus, out=np.zeros(count), where=minus < 0.0)
        losses[rows] = more * up[of] + less * down[of]
