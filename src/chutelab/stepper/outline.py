"""The outline of the solids, and when a flying disk first touches it: solved, not stepped."""

from __future__ import annotations

from math import hypot, inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chutelab.ballistics import crossing, first_descent
from chutelab.stepper.solids import HALF_THICKNESS, Solids

if TYPE_CHECKING:
    from collections.abc import Sequence

Floats = NDArray[np.float64]
Vector = tuple[float, float]

GRAZING = 1e-9
"""Share of a reach, or of a speed, within which a disk leaves a circle along its tangent, and is
not to meet it again by rounding."""


PARALLEL = 1e-14
"""Share of a speed, or of gravity, below which it has no part towards a face but rounding."""

END = 1e-9
"""Share of the radius within which a touch is at the very end of a face."""


class Touch(NamedTuple):
    """A contact between a disk and the outline.

    Attributes
    ----------
    t : float
        s from now; inf if there is none.
    solid : int
        Index of the solid, -1 if there is none.
    normal : tuple of float
        Unit normal towards the disk.
    curvature : float
        1/m, of the path round the contact; 0 on a face.
    gap : float
        m; negative if they overlap.
    """

    t: float
    solid: int = -1
    normal: tuple[float, float] = (0.0, 0.0)
    curvature: float = 0.0
    gap: float = 0.0


NOTHING = Touch(inf)


_Box = tuple[float, float, float, float]
"""Least x and y, largest x and y, m."""

_Circle = tuple[float, float, float, int]
"""Centre and reach, m, and which solid it belongs to."""


class _Slab(NamedTuple):
    """A slab by its struck face: start a, unit tangent t and normal n, length and thickness, m."""

    solid: int
    a: tuple[float, float]
    t: tuple[float, float]
    n: tuple[float, float]
    length: float
    thickness: float

    def corners(self) -> list[tuple[float, float]]:
        return [
            (
                self.a[0] + u * self.t[0] - w * self.n[0],
                self.a[1] + u * self.t[1] - w * self.n[1],
            )
            for u, w in (
                (0.0, 0.0),
                (self.length, 0.0),
                (self.length, self.thickness),
                (0.0, self.thickness),
            )
        ]


class Outline:
    """Four faces and four corners of every slab, and the pulley, for disks of one radius.

    Parameters
    ----------
    solids : Solids
        What can be touched.
    rim : float
        Radius of the pulley, m.
    radius : float
        Of the disks, m.
    gravity : float
        m/s², downwards.
    """

    def __init__(self, solids: Solids, rim: float, radius: float, gravity: float) -> None:
        self._radius, self._gravity = radius, gravity
        # Faces, the box that holds all that touch a slab, and corners.
        self._slabs: list[tuple[_Slab, _Box, list[tuple[_Circle, _Box]]]] = []
        self._pulley: list[tuple[_Circle, _Box]] = []
        for k, (a, b, behind) in enumerate(
            zip(solids.a.tolist(), solids.b.tolist(), solids.behind.tolist(), strict=True)
        ):
            if solids.reach[k] > 0.0:
                reach = rim + radius
                self._pulley.append(((*a, reach, k), _box([tuple(a)], reach)))
                continue
            length = hypot(b[0] - a[0], b[1] - a[1])
            thickness = 2.0 * HALF_THICKNESS
            tangent = (b[0] - a[0]) / length, (b[1] - a[1]) / length
            out = -behind[0] / thickness, -behind[1] / thickness
            slab = _Slab(k, tuple(a), tangent, out, length, thickness)
            corners = slab.corners()
            round_ = [((*c, radius, k), _box([c], radius)) for c in corners]
            self._slabs.append((slab, _box(corners, radius * (1.0 + END)), round_))

    def first(self, x: float, y: float, vx: float, vy: float, until: float) -> Touch:
        """Return the first touch of a flight, at once where a disk that overlaps moves inwards.

        Parameters
        ----------
        x, y, vx, vy : float
            Position and velocity now, m and m/s.
        until : float
            s from now.
        """
        first, round_ = NOTHING, []
        left, right = _range(x, vx, 0.0, until)
        bottom, top = _range(y, vy, -self._gravity, until)
        for slab, (west, south, east, north), corners in self._slabs:
            # What touches the box of a slab from outside may touch the slab.
            if left <= east and right >= west and bottom <= north and top >= south:
                first = self._faces(slab, (x, y, vx, vy), until, first)
                round_ += corners
        if first.t < until:
            until = first.t
            left, right = _range(x, vx, 0.0, until)
            bottom, top = _range(y, vy, -self._gravity, until)
        near = [
            (circle, box)
            for circle, box in round_ + self._pulley
            if left < box[2] and right > box[0] and bottom < box[3] and top > box[1]
        ]
        if any(self._passes((x, y, vx, vy), until, box) for _, box in near):
            circles = [circle for circle, _ in near]
            return self._round(np.array([x, y]), np.array([vx, vy]), circles, until, first)
        return first

    def _passes(self, path: tuple[float, float, float, float], until: float, box: _Box) -> bool:
        """Tell whether a path may come within the height of a box while within its width."""
        (x, y, vx, vy), (west, south, east, north), g = path, box, self._gravity
        if vx == 0.0:
            return True
        begin, end = sorted(((west - x) / vx, (east - x) / vx))
        begin = max(begin, 0.0)
        span, hair = max(min(end, until) - begin, 0.0), END * self._radius
        at = y + begin * (vy - 0.5 * begin * g)
        bottom, top = _range(at, vy - begin * g, -g, span)
        return bottom - hair < north and top + hair > south

    def _faces(
        self, slab: _Slab, path: tuple[float, float, float, float], until: float, first: Touch
    ) -> Touch:
        """Return the first touch with a face, or `first` if that is sooner."""
        x, y, vx, vy = path
        solid, (ax, ay), (tx, ty), (nx, ny), length, thickness = slab
        r = self._radius
        still, free, hair = PARALLEL * hypot(vx, vy), PARALLEL * self._gravity, END * r
        u, w = (x - ax) * tx + (y - ay) * ty, (x - ax) * nx + (y - ay) * ny
        ru, rw = vx * tx + vy * ty, vx * nx + vy * ny
        au, aw = -self._gravity * ty, -self._gravity * ny
        for gap, rate, pull, foot, pace, turn, wide, out in (
            (w - r, rw, aw, u, ru, au, length, (nx, ny)),
            (-w - thickness - r, -rw, -aw, u, ru, au, length, (-nx, -ny)),
            (u - length - r, ru, au, -w, -rw, -aw, thickness, (tx, ty)),
            (-u - r, -ru, -au, -w, -rw, -aw, thickness, (-tx, -ty)),
        ):
            if rate >= -still and pull >= -free:
                continue
            # A disk a hair inside a face touches it: it neither sinks further nor falls through.
            inside = -r <= gap < 0.0 and 0.0 <= foot <= wide
            t = crossing(0.0 if inside else gap, rate, pull)
            if 0.0 <= t <= until and t < first.t:
                there, speed = foot + t * (pace + 0.5 * t * turn), pace + t * turn
                # Moving out over the very end is not a touch of the face.
                if hair * (speed < 0.0) <= there <= wide - hair * (speed > 0.0):
                    first = Touch(t, solid, out, gap=gap if inside else 0.0)
        return first

    def _round(
        self,
        x: Floats,
        v: Floats,
        near: list[_Circle],
        until: float,
        first: Touch,
    ) -> Touch:
        """Return the first touch with a circle, or `first` if that is sooner."""
        g = np.array([0.0, -self._gravity])
        circles = np.array(near)
        d, reach = x - circles[:, :2], circles[:, 2]
        distance = np.hypot(d[:, 0], d[:, 1])
        # |d + v t + g t²/2|² - reach², as a polynomial of t.
        gap = np.stack(
            [
                np.maximum((distance - reach) * (distance + reach), 0.0),
                2.0 * (d @ v),
                v @ v + d @ g,
                np.full(len(near), v @ g),
                np.full(len(near), 0.25 * (g @ g)),
            ]
        )
        grazing = (gap[0] <= GRAZING * reach**2) & (np.abs(gap[1]) <= GRAZING * reach * hypot(*v))
        gap[0, grazing] = gap[1, grazing] = 0.0
        gap[2] = np.where(grazing & (np.abs(gap[2]) <= GRAZING * (v @ v)), 0.0, gap[2])
        now = (gap[0] == 0.0) & ((gap[1] < 0.0) | ((gap[1] == 0.0) & (gap[2] < 0.0)))
        t = np.where(now, 0.0, inf)
        search = (~now & (gap < 0.0).any(axis=0)).nonzero()[0]
        if len(search):
            t[search] = first_descent(gap[:, search], np.full(len(search), until))
        best = int(np.argmin(t))
        s = float(t[best])
        if s >= first.t or s > until:
            return first
        nx, ny = (d[best] + s * (v + 0.5 * s * g)).tolist()
        size = hypot(nx, ny)
        depth = min(size - near[best][2], 0.0)
        return Touch(s, near[best][3], (nx / size, ny / size), 1.0 / near[best][2], depth)

    def around(
        self, x: float, y: float, velocity: Vector, acceleration: Vector
    ) -> list[tuple[float, float, float]]:
        """Return for each solid its gap to a disk (m), how fast that closes, and ever faster.

        All are convex: on a straight way no gap is ever less than these three have it (m, m/s and
        m/s²).
        """
        (vx, vy), (ax, ay), out = velocity, acceleration, []
        for slab, _, _ in self._slabs:
            _, (x0, y0), (tx, ty), (nx, ny), length, thickness = slab
            dx, dy = x - x0, y - y0
            u, w = dx * tx + dy * ty, dx * nx + dy * ny
            u = u if u < 0.0 else u - length if u > length else 0.0
            w = w if w > 0.0 else w + thickness if w < -thickness else 0.0
            dx, dy = u * tx + w * nx, u * ty + w * ny
            far = hypot(dx, dy)
            if far > 0.0:
                dx, dy = dx / far, dy / far
            out.append((far - self._radius, -dx * vx - dy * vy, -dx * ax - dy * ay))
        for (cx, cy, reach, _), _ in self._pulley:
            far = hypot(x - cx, y - cy)
            dx, dy = (x - cx) / far, (y - cy) / far
            out.append((far - reach, -dx * vx - dy * vy, -dx * ax - dy * ay))
        return out


def _box(points: Sequence[tuple[float, float]], margin: float) -> _Box:
    """Return the box around points and a margin."""
    x, y = zip(*points, strict=True)
    return min(x) - margin, min(y) - margin, max(x) + margin, max(y) + margin


def _range(x: float, v: float, a: float, until: float) -> tuple[float, float]:
    """Return the least and the largest of x + v t + a t²/2 up to `until`; a is not positive."""
    end = x + until * (v + 0.5 * until * a)
    high = x - 0.5 * v * v / a if v > 0.0 and v + until * a < 0.0 else max(x, end)
    return min(x, end), high
