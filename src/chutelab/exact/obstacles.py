"""The machine as the exact engine sees it: faces to meet, circles to meet, and how they join.

A disk of radius r touches a segment's face when its centre is r away, and its end when the centre
is on a circle of radius r about it. The pulley is one more circle, of radius R + r. Obstacles are
numbered: segments first, then circles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from chutelab.machine import Machine

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

JOINT = 1e-12
"""Share of the scene's size within which two ends are one joint."""

FOLDED = 1e-9
"""Difference of two directions below which one segment lies on the other."""

TOUCH_ULPS = 256.0
"""Rounding of a coordinate, in units of the last place of the scene's size: closer is touching."""

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
    cap_of : ndarray, (C, 2)
        The one or two segments a circle is an end of; -1 for the pulley.
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
    cap_of: Ints
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


def obstacles(machine: Machine) -> Obstacles:
    """Resolve a machine's surfaces into obstacles."""
    seg, r = machine.segments, machine.particle.radius
    shared = seg.length.ndim == 1

    def wide(array: Floats) -> Floats:
        return array[None] if shared else array

    start, tangent, length = wide(seg.start), wide(seg.tangent), wide(seg.length)
    speed = wide(seg.speed)
    rows, count = length.shape
    end = start + length[..., None] * tangent
    extent = [np.abs(start).max(initial=0.0), np.abs(end).max(initial=0.0)]
    extent.append(np.abs(machine.releases.position).max(initial=0.0))
    size = max(float(e) for e in extent)
    follow = _joints(start[0], end[0], tangent[0], JOINT * size)

    centers: list[Floats] = []
    caps: list[tuple[int, int]] = []
    end_circle = np.full((count, 2), NONE, dtype=np.int64)
    if r > 0.0:
        for s in range(count):
            for side, ends in ((0, start), (1, end)):
                partner = int(follow[s, side])
                on_pulley = machine.pulley is not None and s == 0 and side == 1
                if on_pulley or (partner != NONE and partner < s):
                    continue
                end_circle[s, side] = count + len(centers)
                if partner != NONE:
                    joined = 0 if follow[partner, 0] == s else 1
                    end_circle[partner, joined] = end_circle[s, side]
                centers.append(ends[:, s])
                caps.append((s, partner))
    owner = [cap[0] for cap in caps]
    pulley = NONE
    rho = [np.full(rows, r)] * len(centers)
    surface = np.concatenate([seg.surface, seg.surface[owner]]).astype(np.int64)
    belt = speed[..., None] * tangent
    belt = np.concatenate([belt, belt[:, owner]], axis=1)
    restitution, friction = wide(seg.restitution), wide(seg.friction)
    restitution = np.concatenate([restitution, restitution[:, owner]], axis=1)
    friction = np.concatenate([friction, friction[:, owner]], axis=1)
    if machine.pulley is not None:
        p = machine.pulley
        pulley = count + len(centers)
        end_circle[0, 1] = pulley
        centers.append(np.zeros((rows, 2)))
        caps.append((NONE, NONE))
        rho = [*rho, np.full(rows, p.radius + r)]
        surface = np.append(surface, p.surface)
        belt = np.concatenate([belt, np.zeros((rows, 1, 2))], axis=1)
        restitution = np.concatenate([restitution, np.full((rows, 1), p.restitution)], axis=1)
        friction = np.concatenate([friction, np.full((rows, 1), p.friction)], axis=1)
    return Obstacles(
        start=start,
        tangent=tangent,
        normal=np.stack([-tangent[..., 1], tangent[..., 0]], axis=-1),
        length=length,
        center=np.stack(centers, axis=1) if centers else np.empty((rows, 0, 2)),
        rho=np.stack(rho, axis=1) if rho else np.empty((rows, 0)),
        belt=belt,
        restitution=restitution,
        friction=friction,
        surface=surface,
        end_circle=end_circle,
        follow=follow,
        cap_of=np.array(caps, dtype=np.int64).reshape(-1, 2),
        pulley=pulley,
        pulley_speed=machine.pulley.speed if machine.pulley is not None else 0.0,
        touch=TOUCH_ULPS * float(np.finfo(np.float64).eps) * size,
    )


def _joints(start: Floats, end: Floats, tangent: Floats, tolerance: float) -> Ints:
    """Which segment goes on where another ends, (S, 2); the first one found wins.

    Segments that lie on each other do not go on from each other.
    """
    follow = np.full((len(start), 2), NONE, dtype=np.int64)
    ends, outward = np.stack([start, end], axis=1), np.stack([-tangent, tangent], axis=1)
    for s, e in np.ndindex(follow.shape):
        for other, f in np.ndindex(follow.shape):
            if other == s or follow[s, e] != NONE or follow[other, f] != NONE:
                continue
            apart = np.abs(ends[s, e] - ends[other, f]).max()
            folded = np.abs(outward[s, e] - outward[other, f]).max() <= FOLDED
            if apart <= tolerance and not folded:
                follow[s, e], follow[other, f] = other, s
    return follow
