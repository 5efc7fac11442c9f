"""The machine as the exact engine sees it: faces to meet, circles to meet, and how they join.

A disk of radius r touches a segment's face when its centre is r away, and its end when the centre
is on a circle of radius r about it. The pulley is one more circle, of radius R + r. Obstacles are
numbered: segments first, then circles.

Arrays have the particles last, and the two components of vectors first, so that what one operation
reads lies together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from sys import float_info

import numpy as np

from chutelab.machine import Machine
from chutelab.util.arrays import Bools, Floats, Ints

NONE = -1

FOLDED = 1e-9
"""Difference of two directions below which one segment lies on the other."""

PER_PARTICLE = (
    "faces", "length", "center", "rho", "material", "low", "high", "touch",
)  # fmt: skip
"""Arrays of `Obstacles` whose last axis may be the particles."""


@dataclass(frozen=True, eq=False)
class Obstacles:
    """S segments and C circles; n is 1 or the number of particles."""

    # Of the segments, (2, 4, S, 1, n), components first: unit normal, unit tangent to the right of
    # it, first end (m), and from where to where along a segment a place counts as beside it (m).
    faces: Floats
    length: Floats  # (S, n), m
    center: Floats  # (2, C, n), of the circles: segment ends, then the pulley, m
    rho: Floats  # (C, n), distance of a particle's centre from the circle's at contact, m
    # (3, S + C, n): speed of the surface (m/s), of segments and their ends along the segment, of
    # the pulley clockwise; restitution and friction of the pair.
    material: Floats
    low: Floats  # (2, S + C, n), box that a particle's centre is in when it touches, m
    high: Floats
    surface: Ints  # (S + C,), index into `Machine.surfaces`
    spots: tuple[tuple[int, int], ...]  # (S,), places where segments begin and end, by number
    end_circle: Ints  # (S, 2), obstacle number of the circle at each end, or -1 for a point
    pulley: int  # obstacle number of the pulley, or -1
    touch: Floats  # (n,), m; gaps smaller than this are rounding

    @property
    def segments(self) -> int:
        """Number of segments S."""
        return int(self.length.shape[0])

    @property
    def normal(self) -> Floats:
        """Unit vectors to the left of the segments, (2, S, n)."""
        return self.faces[:, 0, :, 0]

    @property
    def tangent(self) -> Floats:
        """Unit vectors along the segments, (2, S, n)."""
        return self.faces[:, 1, :, 0]

    @property
    def start(self) -> Floats:
        """First ends of the segments, (2, S, n), m."""
        return self.faces[:, 2, :, 0]

    @cached_property
    def owns(self) -> Bools:
        """Tell of which segments a circle is an end, (C, S)."""
        circle = np.arange(self.segments, len(self.surface))[:, None]
        owns = (self.end_circle[:, 0] == circle) | (self.end_circle[:, 1] == circle)
        # The pulley only stands for one.
        return np.asarray(owns & (circle != self.pulley))

    @cached_property
    def bound(self) -> tuple[Floats, Floats]:
        """Lower and upper sides of boxes that hold those of all particles, (2, S + C) each, m."""
        return self.low.min(axis=-1), self.high.max(axis=-1)

    @cached_property
    def under_belt(self) -> Bools:
        """Return what particles held on the incoming belt cannot meet at any height, (S + C,)."""
        held = np.zeros(len(self.surface), dtype=bool)
        held[0] = held[self.pulley] = True
        held[self.end_circle[0]] = True
        return held

    @cached_property
    def follow(self) -> Ints:
        """Return which segment goes on where another ends, (S, 2), -1 if none; the first one wins.

        Segments that fold back onto each other do not go on from each other.
        """
        follow = np.full((self.segments, 2), NONE, dtype=np.int64)
        meeting: dict[int, list[tuple[int, int]]] = {}
        for segment, pair in enumerate(self.spots):
            for end, spot in enumerate(pair):
                meeting.setdefault(spot, []).append((segment, end))
        along = self.tangent[:, :, 0]
        for ends in meeting.values():
            for n, (s, e) in enumerate(ends):
                for other, f in ends[n + 1 :]:
                    if other == s or follow[s, e] != NONE or follow[other, f] != NONE:
                        continue
                    outward = along[:, s] if e else -along[:, s]
                    there = along[:, other] if f else -along[:, other]
                    if np.abs(outward - there).max() > FOLDED:
                        follow[s, e], follow[other, f] = other, s
        return follow

    @cached_property
    def crown(self) -> Floats:
        """Vectors, (2, C, n), to the middle of the half that joins the left face of a segment.

        At an end that is the segment's left normal, at a joint the sum of both. The pulley, which
        turns clockwise all round, has 0.
        """
        crown = np.zeros((2, len(self.rho), self.length.shape[-1]))
        for segment, end in reversed(list(np.ndindex(self.end_circle.shape))):
            circle, joined = self.end_circle[segment, end], self.follow[segment, end]
            if circle in (NONE, self.pulley):
                continue
            crown[:, circle - self.segments] = self.normal[:, segment]
            if joined != NONE:
                goes_on = self.end_circle[joined, 1 - end] == circle
                crown[:, circle - self.segments] += (1 if goes_on else -1) * self.normal[:, joined]
        return crown

    def of(self, first: int, last: int) -> Obstacles:
        """Return the obstacles of the particles from `first` up to `last`."""
        if self.length.shape[-1] == 1:
            return self
        return replace(
            self, **{name: getattr(self, name)[..., first:last] for name in PER_PARTICLE}
        )

    def normal_at(self, rows: Ints, obstacle: Ints, side: Floats, position: Floats) -> Floats:
        """Contact normals, (2, k), of particles touching an obstacle, pointing at the particle.

        `position` (2, n) is that of all particles.
        """
        normal = side * pick(self.normal, rows, obstacle)
        round_ = (obstacle >= self.segments).nonzero()[0]
        if len(round_):
            circle = obstacle[round_] - self.segments
            away = position[:, rows[round_]] - pick(self.center, rows[round_], circle)
            normal[:, round_] = away / np.hypot(away[0], away[1])
        return np.asarray(normal)

    def rim_side(self, rows: Ints, obstacle: Ints, normal: Floats) -> Floats:
        """Return which half of circles (k,) normals (2, k) are on: 1, or -1 away from the crown.

        Round the end of a segment of speed v the surface moves with ±v along (n_y, -n_x), which is
        v along the segment on both its faces.
        """
        crown = pick(self.crown, rows, obstacle - self.segments)
        return np.where(dot(normal, crown) >= 0.0, 1.0, -1.0)


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar product along the first axis; exact zeros stay exact."""
    product: Floats = a * b
    return np.asarray(product[0] + product[1])


def along(normal: Floats) -> Floats:
    """Tangential direction (n_y, -n_x) of a contact: clockwise round a circle."""
    out = np.empty_like(normal)
    out[0] = normal[1]
    np.negative(normal[0], out=out[1])
    return out


def length_of(vector: Floats) -> Floats:
    """Length of vectors, (2, k) to (k,), without care for overflow."""
    return np.sqrt(dot(vector, vector))


def rows_of(array: Floats, rows: Ints) -> Floats:
    """Columns of a per-particle array, or the one column that all particles share.

    `rows` ascend: as many as there are columns are all of them.
    """
    return array if array.shape[-1] in (1, len(rows)) else array.take(rows, axis=-1)


def pick(array: Floats, rows: Ints, which: Ints) -> Floats:
    """Obstacle `which` for each particle, shape (..., k); numbers too large mean the last one."""
    if array.shape[-1] == 1:
        return array[..., 0].take(which, axis=-1, mode="clip")
    return np.asarray(array[..., np.minimum(which, array.shape[-2] - 1), rows])


FOOT = 1e-12
"""Share of a segment's length by which its face reaches past its ends, so that no particle slips
through the joint of two segments by rounding."""

JOINT = 1e-12
"""Share of the scene's size within which two ends are one joint."""

TOUCH_ULPS = 256.0
"""Rounding of a coordinate, in units of the last place of the scene's size: closer is touching."""

GIVEN_ULPS = 1.0
"""The same of a coordinate in the scene file, for one far from the origin."""

BOX_TOUCHES = 64.0
"""Width, in `Obstacles.touch`, by which the boxes of faces are larger than they need be."""


def obstacles(machine: Machine, far: float = 0.0) -> Obstacles:
    """Resolve the surfaces of a machine, moved here from that far away (m), into obstacles.

    How segments join, and whether particles are points, is read off the first row where each
    particle has its own: see `chutelab.engines.exact.kinds`. Of segments that
    lie on each other the first one counts, as it does when two are met at once.
    """
    seg, r, wheel = machine.segments, machine.particle.radius, machine.pulley
    tangent, length = _vectors(seg.tangent), _scalars(seg.length)
    corners = corners_of(machine)
    size = size_of(corners, machine.releases.position)
    touch = touch_of(size, far)
    spots = spots_of(corners[..., 0], JOINT * size[0].item())
    seen: dict[frozenset[int], int] = {}
    for s, pair in enumerate(spots):
        seen.setdefault(frozenset(pair), s)
    kept = list(seen.values())
    if len(kept) < len(spots):
        corners = corners[:, [*kept, *(s + len(spots) for s in kept)]]
        spots, tangent, length = [spots[s] for s in kept], tangent[:, kept], length[kept]

    # Segments, then their ends, then the pulley.
    flat = len(length)
    # Each place where segments of disks end is a circle; a point meets it with probability zero.
    known: dict[int, int] = {}
    ends: list[tuple[int, int]] = []
    end_circle = np.full((flat, 2), NONE)
    for s, pair in enumerate(spots if np.ravel(r)[0] > 0.0 else ()):
        for e, spot in enumerate(pair):
            if wheel is not None and (s, e) == (0, 1):
                continue
            if spot not in known:
                known[spot] = flat + len(ends)
                ends.append((s, e))
            end_circle[s, e] = known[spot]
    where = [s + e * flat for s, e in ends]
    owner = kept + [kept[s] for s, _ in ends]
    if wheel is not None:
        end_circle[0, 1] = flat + len(ends)
        # It stands in for an end of the first segment until its own values are put in.
        where.append(0)
        owner.append(0)
    center = corners.take(np.array(where, dtype=np.int64), axis=1)
    rho = np.empty(center.shape[1:])
    rho[:] = r
    which = np.array(owner, dtype=np.int64)
    values = (_scalars(column) for column in (seg.speed, seg.restitution, seg.friction))
    material, surface = np.stack([*values]).take(which, axis=1), seg.surface.take(which)
    pulley = NONE
    if wheel is not None:
        pulley = flat + len(ends)
        center[:, -1], rho[-1], surface[-1] = 0.0, wheel.radius + r, wheel.surface
        for row, value in enumerate((wheel.speed, wheel.restitution, wheel.friction)):
            material[row, -1] = value
    first, second = corners[:, :flat], corners[:, flat:]
    faces = np.empty((2, 4, flat, 1, length.shape[1]))
    faces[0, 0], faces[1, 0] = -tangent[1][:, None], tangent[0][:, None]
    faces[:, 1, :, 0], faces[:, 2, :, 0] = tangent, first
    over = FOOT * length[:, None]
    faces[0, 3], faces[1, 3] = -over, over + length[:, None]
    # A circle's box is smaller: what only touches it does not meet it.
    reach, inner = r + BOX_TOUCHES * touch, rho - touch
    return Obstacles(
        faces=faces,
        length=length,
        center=center,
        rho=rho,
        material=material,
        low=np.concatenate([np.minimum(first, second) - reach, center - inner], axis=1),
        high=np.concatenate([np.maximum(first, second) + reach, center + inner], axis=1),
        surface=surface,
        spots=tuple(spots),
        end_circle=end_circle,
        pulley=pulley,
        touch=touch,
    )


def corners_of(machine: Machine) -> Floats:
    """Return all first ends of the segments, then all second ones, (2, 2 S, n), m."""
    segments = machine.segments
    return np.concatenate([_vectors(segments.start), _vectors(segments.end)], axis=1)


def touch_of(size: Floats, far: float = 0.0) -> Floats:
    """Return `Obstacles.touch` of a scene of a size, counted from a point that far away, m."""
    # Far away the scene's own numbers are rounded, each by half a last place.
    return float_info.epsilon * (TOUCH_ULPS * size + GIVEN_ULPS * far)


def size_of(corners: Floats, places: Floats) -> Floats:
    """Return the largest coordinate, m, (n,): of each particle, where each has its own corners."""
    count = corners.shape[-1]
    # Not their methods, which take twice as long.
    size = np.maximum.reduce(np.abs(corners), axis=(0, 1), initial=0.0)
    farthest: Floats = np.maximum.reduce(np.abs(places.reshape(count, -1)), axis=1)
    return np.asarray(np.maximum(size, farthest))


def _vectors(array: Floats) -> Floats:
    """(S, 2) or (N, S, 2) to (2, S, n)."""
    return np.array(array, ndmin=3).T.copy()


def _scalars(array: Floats) -> Floats:
    """(S,) or (N, S) to (S, n)."""
    return np.array(array, ndmin=2).T.copy()


def spots_of(ends: Floats, tolerance: float) -> list[tuple[int, int]]:
    """Return numbers of the places where segments begin and end; within the tolerance one place.

    `ends` is (2, 2 S): all the first ones, then all the second ones.
    """
    x, y = ends.tolist()
    count = len(x) // 2
    number = list(range(2 * count))
    window: list[int] = []
    for n in sorted(number, key=x.__getitem__):
        while window and x[n] - x[window[0]] > tolerance:
            del window[0]
        for m in window:
            if abs(y[n] - y[m]) <= tolerance:
                number[n] = number[m]
                break
        window.append(n)
    return list(zip(number[:count], number[count:], strict=True))
