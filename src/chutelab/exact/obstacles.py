"""The machine as the exact engine sees it: faces to meet, circles to meet, and how they join.

A disk of radius r touches a segment's face when its centre is r away, and its end when the centre
is on a circle of radius r about it. The pulley is one more circle, of radius R + r. Obstacles are
numbered: segments first, then circles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NONE = -1


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Faces, shape (n, S), and circles, (n, C), where n is 1 or the number of particles.

    Attributes
    ----------
    start, tangent, normal : ndarray, (n, S, 2)
        Segments; the normal is to the left of the tangent.
    length : ndarray, (n, S)
        m.
    center : ndarray, (n, C, 2)
        Centres of the circles: segment ends, then the pulley.
    rho : ndarray, (n, C)
        Distance of a particle's centre from the circle's at contact, m.
    belt : ndarray, (n, S + C, 2)
        Surface velocity of segments and ends as a world vector, m/s.
    restitution, friction : ndarray, (n, S + C)
        Pair values.
    surface : ndarray, (S + C,)
        Index into `Machine.surfaces`.
    end_circle : ndarray, (S, 2)
        Obstacle number of the circle at a segment's first and second end, or -1 for a point.
    follow : ndarray, (S, 2)
        Segment that shares the end, or -1.
    owns : ndarray of bool, (C, S)
        Of which segments a circle is an end.
    pulley : int
        Obstacle number of the pulley, or -1.
    pulley_speed : float
        Speed of the pulley's rim, clockwise, m/s.
    touch : float
        m; gaps smaller than this are rounding.
    """

    start: Floats
    tangent: Floats
    normal: Floats
    length: Floats
    center: Floats
    rho: Floats
    belt: Floats
    restitution: Floats
    friction: Floats
    surface: Ints
    end_circle: Ints
    follow: Ints
    owns: NDArray[np.bool_]
    pulley: int
    pulley_speed: float
    touch: float

    @property
    def segments(self) -> int:
        """Number of segments S."""
        return int(self.start.shape[1])

    def normal_at(self, rows: Ints, obstacle: Ints, side: Ints, position: Floats) -> Floats:
        """Contact normals, (k, 2), of particles touching an obstacle, pointing at the particle."""
        normal = np.empty((len(rows), 2))
        flat = obstacle < self.segments
        normal[flat] = side[flat, None] * pick(self.normal, rows[flat], obstacle[flat])
        circle = obstacle[~flat] - self.segments
        away = position[~flat] - pick(self.center, rows[~flat], circle)
        normal[~flat] = away / np.hypot(away[:, 0], away[:, 1])[:, None]
        return normal

    def snapped(self, rows: Ints, obstacle: Ints, side: Ints, position: Floats, r: float) -> Floats:
        """Positions, (k, 2), put exactly at contact distance, so that rounding cannot add up."""
        out = position.copy()
        flat = obstacle < self.segments
        f, o = rows[flat], obstacle[flat]
        normal = pick(self.normal, f, o)
        gap = dot(position[flat] - pick(self.start, f, o), normal) - side[flat] * r
        out[flat] -= gap[:, None] * normal
        circle = obstacle[~flat] - self.segments
        center = pick(self.center, rows[~flat], circle)
        away = position[~flat] - center
        distance = np.hypot(away[:, 0], away[:, 1])
        rho = pick(self.rho, rows[~flat], circle)
        out[~flat] = center + (rho / distance)[:, None] * away
        return out

    def belt_speed(self, rows: Ints, obstacle: Ints, normal: Floats) -> Floats:
        """Speed of the surface along (n_y, -n_x) at a contact with that normal, (k,), m/s."""
        speed = dot(pick(self.belt, rows, obstacle), along(normal))
        return np.where(obstacle == self.pulley, self.pulley_speed, speed)


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar product along the last axis; exact zeros stay exact."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])


def along(normal: Floats) -> Floats:
    """Tangential direction (n_y, -n_x) of a contact: clockwise round a circle."""
    return np.stack([normal[..., 1], -normal[..., 0]], axis=-1)


def rows_of(array: Floats, rows: Ints) -> Floats:
    """Rows of a per-particle array, or the one row that all particles share."""
    return array if len(array) == 1 else array[rows]


def pick(array: Floats, rows: Ints, column: Ints) -> Floats:
    """Entry `column` of each particle's row, shape (k, ...)."""
    return array[np.zeros_like(rows) if len(array) == 1 else rows, column]
