"""The outline of the solids, and when a flying disk first touches it: solved, not stepped."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf

import numpy as np
from numpy.typing import NDArray

from chutelab.ballistics import closing_time, first_descent
from chutelab.stepper.solids import HALF_THICKNESS, Solids

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Touch:
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
    """

    t: float
    solid: int = -1
    normal: tuple[float, float] = (0.0, 0.0)
    curvature: float = 0.0


NOTHING = Touch(inf)


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
        slabs = np.flatnonzero(solids.reach == 0.0)
        a, b, behind = solids.a[slabs], solids.b[slabs], solids.behind[slabs]
        corners = np.stack([a, b, b + behind, a + behind])
        along = np.roll(corners, -1, axis=0) - corners
        self._start = corners.reshape(-1, 2)
        self._length = np.hypot(along[..., 0], along[..., 1]).reshape(-1)
        self._tangent = along.reshape(-1, 2) / self._length[:, None]
        out = -behind / (2.0 * HALF_THICKNESS)
        ends = along[0] / np.hypot(along[0, :, 0], along[0, :, 1])[:, None]
        self._normal = np.stack([out, ends, -out, -ends]).reshape(-1, 2)
        self._face_solid = np.tile(slabs, 4)
        round_ = np.flatnonzero(solids.reach > 0.0)
        self._center = np.concatenate([self._start, solids.a[round_]])
        self._reach = np.concatenate(
            [np.full(4 * len(slabs), radius), np.full(len(round_), rim + radius)]
        )
        self._circle_solid = np.concatenate([self._face_solid, round_])
        self._radius = radius
        self._g = np.array([0.0, -gravity])
        self._pull = self._normal @ self._g

    def first(self, x: Floats, v: Floats, until: float) -> Touch:
        """Return the first touch of a flight, at once where a disk that overlaps moves inwards.

        Parameters
        ----------
        x, v : ndarray, (2,)
            Position and velocity now, m and m/s.
        until : float
            s from now; may be inf.
        """
        if not len(self._circle_solid):
            return NOTHING
        t, face = self._faces(x, v, until)
        first = NOTHING
        if face >= 0:
            n = self._normal[face]
            first = Touch(t, int(self._face_solid[face]), (float(n[0]), float(n[1])))
        near = self._near(x, v, min(t, until))
        return self._round(x, v, near, min(t, until), first) if len(near) else first

    def _faces(self, x: Floats, v: Floats, until: float) -> tuple[float, int]:
        away = x - self._start
        normal, tangent = self._normal, self._tangent
        gap = away[:, 0] * normal[:, 0] + away[:, 1] * normal[:, 1] - self._radius
        rate = v[0] * normal[:, 0] + v[1] * normal[:, 1]
        foot = away[:, 0] * tangent[:, 0] + away[:, 1] * tangent[:, 1]
        over = (foot >= 0.0) & (foot <= self._length)
        # A disk a hair inside a face touches it: it neither sinks further nor falls through.
        inside = over & (gap < 0.0) & (gap >= -self._radius)
        t = closing_time(np.where(inside, 0.0, gap), rate, self._pull)
        t[(t < 0.0) | (t > until)] = inf
        there = np.where(t < inf, t, 0.0)
        pace = v[0] * tangent[:, 0] + v[1] * tangent[:, 1]
        foot += there * (pace + 0.5 * there * (tangent @ self._g))
        t[(foot < 0.0) | (foot > self._length)] = inf
        best = int(np.argmin(t)) if len(t) else 0
        return (float(t[best]), best) if len(t) and t[best] < inf else (inf, -1)

    def _near(self, x: Floats, v: Floats, until: float) -> Ints:
        """Circles that the box of the path up to `until` touches."""
        if until == inf:
            return np.arange(len(self._reach))
        end = x + until * (v + 0.5 * until * self._g)
        low, high = np.minimum(x, end), np.maximum(x, end)
        if self._g[1] < 0.0 < v[1] and -v[1] / self._g[1] < until:
            high[1] = x[1] - 0.5 * v[1] ** 2 / self._g[1]
        reach = self._reach
        cx, cy = self._center[:, 0], self._center[:, 1]
        return np.flatnonzero(
            (cx + reach > low[0])
            & (cx - reach < high[0])
            & (cy + reach > low[1])
            & (cy - reach < high[1])
        )

    def _round(self, x: Floats, v: Floats, near: Ints, until: float, first: Touch) -> Touch:
        d, g = x - self._center[near], self._g
        reach = self._reach[near]
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
        now = (gap[0] == 0.0) & (gap[1] < 0.0)
        # What leaves a circle along its tangent is not to meet it again by rounding.
        grazing = (gap[0] <= 1e-9 * reach**2) & (np.abs(gap[1]) <= 1e-9 * reach * hypot(*v))
        now &= ~grazing
        gap[0, grazing] = gap[1, grazing] = 0.0
        shut = grazing & (gap[2] < 0.0)
        gap[2] = np.where(grazing & (np.abs(gap[2]) <= 1e-9 * (v @ v)), 0.0, gap[2])
        t = np.where(now | (shut & (gap[2] < 0.0)), 0.0, inf)
        search = np.flatnonzero((t > 0.0) & (gap < 0.0).any(axis=0))
        if len(search):
            limit = until if until < inf else self._far(gap[:, search])
            t[search] = first_descent(gap[:, search], np.full(len(search), limit))
        best = int(np.argmin(t))
        if not t[best] < min(until, first.t):
            return first
        s = float(t[best])
        n = d[best] + s * (v + 0.5 * s * g)
        size = hypot(*n)
        return Touch(
            s,
            int(self._circle_solid[near[best]]),
            (float(n[0]) / size, float(n[1]) / size),
            1.0 / float(reach[best]),
        )

    @staticmethod
    def _far(gap: Floats) -> float:
        """Return a time after which straight flights cannot meet a circle any more, s."""
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = np.where(gap[2] > 0.0, -gap[1] / gap[2], 0.0)
        return float(np.maximum(turn.max(), 0.0)) + 1.0

    def supports(self, x: Floats, within: float) -> Floats:
        """Distances (P, K), m, of disks at (P, 2) from the faces and circles that are not touched.

        Those closer than `within` are left out (inf).
        """
        away = x[:, None] - self._start
        foot = np.clip((away * self._tangent).sum(axis=2), 0.0, self._length)
        line = np.hypot(*(away - foot[..., None] * self._tangent).transpose(2, 0, 1))
        gap = line - self._radius
        circles = self._center[len(self._start) :]
        if len(circles):
            d = x[:, None] - circles
            more = np.hypot(d[..., 0], d[..., 1]) - self._reach[len(self._start) :]
            gap = np.concatenate([gap, more], axis=1)
        return np.where(gap > within, gap, inf)
