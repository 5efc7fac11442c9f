"""The geometry of a piece of a surface, straight or bent, in one place.

Nearest point, gap, normal, ends, box, and the path to draw it: for drawing machines, describing
their parts, and checking runs. Engines must not use it to find a contact, nor the core to judge a
run (`hits.c`): each has its own detection, so that none of them, nor a check that uses this
module, repeats another's mistake.

Arrays of S pieces are (S,), and vectors (S, 2), in a family (N, S) and (N, S, 2); `Pieces.of` picks
some of them, or one. Places (..., 2) are broadcast against the pieces: many places (c, 2) against
one piece, or each against its own.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from math import ceil, pi, radians
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from chutelab.util.arrays import Bools, Floats, Ints, sin_cos

FINE = radians(3.0)
"""rad between two points of a path to draw, which is then off by at most 3e-4 of the radius."""

VECTORS = {"start", "tangent", "center"}
"""Fields with two components, the last axis."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Pieces(ABC):
    """S pieces of surfaces, whatever their shape: read-only arrays.

    Attributes
    ----------
    speed : ndarray, (..., S)
        Speed of the surface, along the tangent of a segment, clockwise round an arc, m/s.
    restitution, friction : ndarray, (..., S)
        Of the pair with a particle; (K, S) where there are several kinds of particles.
    surface : ndarray, (S,)
        Index of the surface a piece belongs to, into `Machine.surfaces`.
    appears, vanishes : ndarray, (..., S)
        Time span in which it exists, s; -inf and inf if always.
    one_sided : ndarray, (S,)
        1 if it is solid only on its left (an arc: outside), -1 only on the other side; 0 on both.
    """

    speed: Floats
    restitution: Floats
    friction: Floats
    surface: Ints
    appears: Floats
    vanishes: Floats
    one_sided: Ints

    def __post_init__(self) -> None:
        for array in vars(self).values():
            if isinstance(array, np.ndarray):
                array.setflags(write=False)

    def of(self, which: Any) -> Self:
        """Return some pieces by their numbers, or a single one with numbers instead of arrays.

        One of a family is an array of those of its machines; what these have alike stays.
        """
        own: dict[str, Any] = {}
        for field in fields(self):
            array, rest = getattr(self, field.name), (slice(None),) * (field.name in VECTORS)
            several = np.ndim(array) > len(rest)
            own[field.name] = array[(..., which, *rest)][()] if several else array
        return type(self)(**own)

    @property
    def gate(self) -> Bools:
        """Which do not always exist."""
        return np.isfinite(self.appears) | np.isfinite(self.vanishes)

    def there(self, t: Any, late: float = 0.0) -> Bools:
        """Whether it exists at times (s), or did until at most `late` (s) before."""
        return np.asarray((self.appears <= t) & (t < self.vanishes + late))

    @property
    @abstractmethod
    def way(self) -> Floats:
        """Length of each, m."""

    @property
    @abstractmethod
    def whole(self) -> Bools:
        """Which are whole circles, without ends."""

    @property
    @abstractmethod
    def ends(self) -> tuple[Floats, Floats]:
        """First and last point, (..., S, 2) each, m; equal for those that are `whole`."""

    @property
    @abstractmethod
    def inward(self) -> tuple[Floats, Floats]:
        """Unit vectors along each from its first and from its last point, (..., S, 2) each."""

    @property
    @abstractmethod
    def boxes(self) -> tuple[Floats, Floats]:
        """Lower left and upper right corner of a box that holds each, (..., S, 2), m."""

    @property
    @abstractmethod
    def corners(self) -> Floats:
        """Points of each that span its bounding box, (..., C, 2), m."""

    @abstractmethod
    def away(self, places: Floats) -> Floats:
        """Return the vectors to places from the nearest points, (..., 2), m."""

    @abstractmethod
    def normal(self, places: Floats) -> Floats:
        """Return unit normals of the faces beside places, (..., 2), to the left of a segment."""

    @abstractmethod
    def at(self, way: ArrayLike) -> Floats:
        """Return the points of one piece at distances (m) along its direction of motion."""

    @abstractmethod
    def along(self, places: Floats) -> Floats:
        """Return the distances (m) along one piece of the points nearest to places; see `at`."""

    @abstractmethod
    def path(self) -> Floats:
        """Return the points (P, 2) through which to draw one piece, m, in the order of `at`."""

    @abstractmethod
    def told(self) -> dict[str, Floats]:
        """Return the numbers (..., S) of their places, by the core's names."""

    @abstractmethod
    def where(self) -> str:
        """Describe the place of one piece."""

    def nearest(self, places: Floats) -> Floats:
        """Return the nearest points to places, (..., 2), m."""
        return np.asarray(places - self.away(places))

    def gap(self, places: Floats, radius: ArrayLike = 0.0) -> Floats:
        """Return the gaps (...) to disks round places, m; negative where they overlap."""
        return np.asarray(np.hypot(*np.moveaxis(self.away(places), -1, 0)) - radius)

    def apart(self, outline: Floats) -> float:
        """Return the distance of a convex outline, (n, 2), from one piece, m; see `apart`."""
        ends = min(_corners_off(end[None], outline) for end in self.ends)
        return min(ends, float(self.gap(outline).min()))


@dataclass(frozen=True, eq=False, kw_only=True)
class Segments(Pieces):
    """Straight two-sided surfaces, world frame, SI units.

    Attributes
    ----------
    start, tangent : ndarray, (..., S, 2)
        First end, and unit vector towards the second.
    length : ndarray, (..., S)
        m.
    """

    start: Floats
    tangent: Floats
    length: Floats

    @property
    def end(self) -> Floats:
        """Second end, (..., S, 2), m."""
        return np.asarray(self.start + self.length[..., None] * self.tangent)

    @property
    def way(self) -> Floats:
        return self.length

    @property
    def whole(self) -> Bools:
        return np.zeros(self.length.shape, dtype=bool)

    @property
    def ends(self) -> tuple[Floats, Floats]:
        return self.start, self.end

    @property
    def inward(self) -> tuple[Floats, Floats]:
        return self.tangent, -self.tangent

    @property
    def boxes(self) -> tuple[Floats, Floats]:
        return np.minimum(self.start, self.end), np.maximum(self.start, self.end)

    @property
    def corners(self) -> Floats:
        return np.concatenate(self.ends, axis=-2)

    def along(self, places: Floats) -> Floats:
        way = ((places - self.start) * self.tangent).sum(axis=-1)
        return np.asarray(way.clip(0.0, self.length))

    def away(self, places: Floats) -> Floats:
        return np.asarray(places - self.start - self.along(places)[..., None] * self.tangent)

    def normal(self, places: Floats) -> Floats:
        left = np.stack([-self.tangent[..., 1], self.tangent[..., 0]], axis=-1)
        return np.broadcast_to(left, np.broadcast_shapes(left.shape, places.shape))

    def at(self, way: ArrayLike) -> Floats:
        return np.asarray(self.start + np.asarray(way)[..., None] * self.tangent)

    def path(self) -> Floats:
        return np.stack(self.ends)

    def told(self) -> dict[str, Floats]:
        start, tangent = self.start, self.tangent
        return {
            "x": start[..., 0], "y": start[..., 1], "tx": tangent[..., 0], "ty": tangent[..., 1],
            "length": self.length,
        }  # fmt: skip

    def where(self) -> str:
        # Rounding leaves 1e-17 instead of 0.
        (x0, y0), (x1, y1) = np.round(self.ends, 12) + 0.0
        return f"from ({x0:.6g}, {y0:.6g}) to ({x1:.6g}, {y1:.6g}) m"


@dataclass(frozen=True, eq=False, kw_only=True)
class Arcs(Pieces):
    """Two-sided surfaces bent round a centre, and whole circles, world frame, SI units.

    Attributes
    ----------
    center : ndarray, (..., S, 2)
        m.
    radius : ndarray, (..., S)
        m; a particle may be inside or outside.
    begin, extent : ndarray, (..., S)
        Angle of the first end from the x axis, counterclockwise, and how far the arc reaches
        from there, counterclockwise, rad; 2π for a whole circle, which has no ends.
    """

    center: Floats
    radius: Floats
    begin: Floats
    extent: Floats

    @property
    def way(self) -> Floats:
        return np.asarray(self.radius * self.extent)

    @property
    def whole(self) -> Bools:
        return np.asarray(self.extent >= 2.0 * pi)

    def point(self, angle: ArrayLike) -> Floats:
        """Return the points of the arcs at angles (..., S) from the x axis, (..., S, 2), m."""
        sine, cosine = sin_cos(np.asarray(angle))
        direction = np.stack([cosine, sine], axis=-1)
        return np.asarray(self.center + self.radius[..., None] * direction)

    @cached_property
    def ends(self) -> tuple[Floats, Floats]:
        return self.point(self.begin), self.point(self.begin + self.extent)

    @property
    def inward(self) -> tuple[Floats, Floats]:
        first, last = self.begin, self.begin + self.extent
        return (
            np.stack([-np.sin(first), np.cos(first)], axis=-1),
            np.stack([np.sin(last), -np.cos(last)], axis=-1),
        )

    @property
    def boxes(self) -> tuple[Floats, Floats]:
        # Box of the whole circle: it is needed for thousands, only to find what may be near.
        reach = self.radius[..., None]
        return self.center - reach, self.center + reach

    @property
    def corners(self) -> Floats:
        quarters = 0.5 * pi * np.arange(4)[:, None]
        reach = np.mod(quarters - self.begin[..., None, :], 2.0 * pi)
        # If a quarter point is not on the arc, use its first end.
        inside = reach <= self.extent[..., None, :]
        angle = np.where(inside, self.begin[..., None, :] + reach, self.begin[..., None, :])
        points = [self.point(quarter) for quarter in np.moveaxis(angle, -2, 0)]
        return np.concatenate([*points, *self.ends], axis=-2)

    def _turned(self, out: Floats) -> Floats:
        """Return the angles of vectors from the centres, from the first ends on, 0 to 2π, rad."""
        return np.asarray(np.mod(np.arctan2(out[..., 1], out[..., 0]) - self.begin, 2.0 * pi))

    def away(self, places: Floats) -> Floats:
        out = places - self.center
        far = np.hypot(out[..., 0], out[..., 1]) - self.radius
        away = far[..., None] * self.normal(places)
        beyond = ~self.whole & (self._turned(out) > self.extent)
        if beyond.any():
            first, last = (places - end for end in self.ends)
            nearer = np.hypot(*np.moveaxis(first, -1, 0)) <= np.hypot(*np.moveaxis(last, -1, 0))
            ends = np.where(nearer[..., None], first, last)
            away = np.where(beyond[..., None], ends, away)
        return np.asarray(away)

    def normal(self, places: Floats) -> Floats:
        x, y = np.moveaxis(places - self.center, -1, 0)
        # Seen from the centre all points are equally far, so any direction will do.
        x = np.where(np.hypot(x, y) > 0.0, x, 1.0)
        return np.asarray(np.stack([x, y], axis=-1) / np.hypot(x, y)[..., None])

    def apart(self, outline: Floats) -> float:
        # The point of an edge that is nearest to the centre may be the nearest to the arc.
        edge = np.roll(outline, -1, axis=0) - outline
        share = ((self.center - outline) * edge).sum(axis=1) / (edge**2).sum(axis=1)
        feet = outline + share.clip(0.0, 1.0)[:, None] * edge
        return min(super().apart(outline), float(self.gap(feet).min()))

    def holds(self, place: Floats, near: float) -> Bools:
        """Whether points of the circles (..., 2) are on the arcs, and not `near` (m) an end."""
        way = self.radius * self._turned(place - self.center)
        return np.asarray(self.whole | ((way > near) & (way < self.way - near)))

    def at(self, way: ArrayLike) -> Floats:
        # Clockwise from the last end.
        return self.point(self.begin + self.extent - np.asarray(way) / self.radius)

    def along(self, places: Floats) -> Floats:
        turned = self._turned(places - self.center)
        # Beyond both ends the nearer one; a distance of 0 is the last end.
        nearer_first = turned > 0.5 * self.extent + pi
        turned = np.where(nearer_first, 0.0, np.minimum(turned, self.extent))
        return np.asarray(self.radius * (self.extent - turned))

    def path(self) -> Floats:
        return self.at(np.linspace(0.0, self.way, 1 + ceil(self.extent / FINE)))

    def told(self) -> dict[str, Floats]:
        return {"x": self.center[..., 0], "y": self.center[..., 1]} | {
            name: getattr(self, name) for name in ("radius", "begin", "extent")
        }

    def where(self) -> str:
        x, y = np.round(self.center, 12) + 0.0
        said = f"radius {self.radius:.6g} m, about ({x:.6g}, {y:.6g}) m"
        if self.whole:
            return said
        first, last = np.degrees([self.begin, self.begin + self.extent])
        return f"{said}, {first:.6g}° to {last:.6g}°"


def placed(outline: Floats, position: Floats, angle: float) -> Floats:
    """Return the corners of an outline, turned counterclockwise (rad) and moved, (n, 2), m."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.asarray(position + outline @ np.array([[cosine, sine], [-sine, cosine]]))


def apart(one: Floats, other: Floats) -> float:
    """Return the distance of two convex outlines, (n, 2) and (m, 2), that do not overlap, m.

    It is that of a corner of one from an edge of the other. An outline may be a single point. If
    the outlines overlap a little, it is about the depth.
    """
    return min(_corners_off(one, other), _corners_off(other, one))


def _corners_off(corners: Floats, outline: Floats) -> float:
    off, edge = corners[:, None] - outline, np.roll(outline, -1, axis=0) - outline
    square = (edge**2).sum(axis=1)
    share = (off * edge).sum(axis=2) / np.where(square > 0.0, square, 1.0)
    off -= share.clip(0.0, 1.0)[..., None] * edge
    return float(np.hypot(*np.moveaxis(off, -1, 0)).min())


KINDS: dict[str, type[Segments] | type[Arcs]] = {"Segment": Segments, "Arc": Arcs}
"""Each kind of piece by the name of the core's rows; in small letters and with an s it is the name
of the part of a `Machine`."""

TOUCHES = 1e-9
"""Share of the machine's size by which an arc and another piece must overlap to cross; joints only
touch."""


def crossings(names: int, segments: Segments, arcs: Arcs) -> list[tuple[int, int]]:
    """Return the pairs of surfaces that cross, by their numbers, the lower one first.

    Surfaces that only touch, as at a shared end, do not cross, nor do gates and surfaces that never
    exist at the same time.
    """
    rows = np.concatenate(segments.ends, axis=1)
    found: dict[tuple[int, int], None] = {}
    known = np.eye(names, dtype=bool)  # pairs of surfaces that need not be compared

    def note(pairs: Ints) -> None:
        found.update(dict.fromkeys(map(tuple, pairs.tolist())))
        known[pairs[:, 0], pairs[:, 1]] = known[pairs[:, 1], pairs[:, 0]] = True

    for one, other in _beside(segments, segments, known):
        one, other = one[one < other], other[one < other]
        crossed = _parts(rows[one], rows[other]) & _parts(rows[other], rows[one])
        note(segments.surface[np.stack([one, other], axis=1)[crossed]])
    if len(arcs.surface):
        near = TOUCHES * np.abs(np.concatenate([segments.end, arcs.corners])).max()
        for pieces in (segments, arcs):
            for one, other in _beside(pieces, arcs, known):
                with_it = arcs.of(other)
                crossed = (
                    _chords(segments, one, with_it, near)
                    if pieces is segments
                    else _lenses(arcs.of(one), with_it, near)
                )
                pairs = np.stack([pieces.surface[one[crossed]], arcs.surface[other[crossed]]])
                note(np.sort(pairs, axis=0).T)
    return list(found)


ABREAST = 256
"""Pieces that are compared with all others at once, so that the pairs fit into memory."""


def _beside(
    one: Segments | Arcs, other: Segments | Arcs, known: Bools
) -> Iterator[tuple[Ints, Ints]]:
    """Yield pairs of pieces, by numbers, whose boxes touch while both exist.

    Pairs of surfaces that are known to cross, (surfaces, surfaces), are left out.
    """
    (low, high), (low2, high2) = one.boxes, other.boxes
    for first in range(0, len(one.surface), ABREAST):
        some = slice(first, first + ABREAST)
        met = ~known[one.surface[some, None], other.surface]
        begin = np.maximum(one.appears[some, None], other.appears)
        met &= begin < np.minimum(one.vanishes[some, None], other.vanishes)
        for axis in (0, 1):
            met &= low[some, axis, None] <= high2[:, axis]
            met &= high[some, axis, None] >= low2[:, axis]
        index, which = met.nonzero()
        yield first + index, which


def _chords(segments: Segments, which: Ints, arcs: Arcs, near: float) -> Bools:
    """Return which of the segments, by numbers (n,), cross n arcs by more than `near` (m)."""
    start, tangent = segments.start[which], segments.tangent[which]
    away = arcs.center - start
    foot = (away * tangent).sum(axis=-1)
    off = np.abs(tangent[..., 0] * away[..., 1] - tangent[..., 1] * away[..., 0])
    half = np.sqrt(np.maximum(arcs.radius**2 - off**2, 0.0))
    crossed = np.zeros(off.shape, dtype=bool)
    for s in (foot - half, foot + half):
        on = (s > near) & (s < segments.length[which] - near)
        crossed |= on & arcs.holds(start + s[..., None] * tangent, near)
    return np.asarray(crossed & (off < arcs.radius - near))


def _lenses(first: Arcs, second: Arcs, near: float) -> Bools:
    """Return for which pairs (n,) the left crossing is on both arcs, by `near` (m)."""
    distance = np.hypot(*(second.center - first.center).T)
    crossed = (distance < first.radius + second.radius - near) & (
        distance > np.abs(first.radius - second.radius) + near
    )
    some = crossed.nonzero()[0]
    first, second, distance = first.of(some), second.of(some), distance[some]
    towards = (second.center - first.center) / distance[:, None]
    aside = np.stack([-towards[:, 1], towards[:, 0]], axis=-1)
    # With the arcs swapped it is the other crossing.
    a, b = first.radius, second.radius
    foot = 0.5 * (distance + (a - b) * (a + b) / distance)
    half = np.sqrt(np.maximum(a**2 - foot**2, 0.0))
    place = first.center + foot[:, None] * towards + half[:, None] * aside
    crossed[some] = second.holds(place, near) & first.holds(place, near)
    return np.asarray(crossed)


def _parts(line: Floats, ends: Floats) -> Bools:
    """Return for pairs (n, 4) whether two ends lie strictly on different sides of a line."""
    (x0, y0, x1, y1), (u0, v0, u1, v1) = line.T, ends.T
    first = (x1 - x0) * (v0 - y0) - (y1 - y0) * (u0 - x0)
    second = (x1 - x0) * (v1 - y0) - (y1 - y0) * (u1 - x0)
    return np.asarray(first * second < 0.0)
