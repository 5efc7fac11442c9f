"""Where a ride round a circle is stopped by something else: angles, in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from chutelab.exact.obstacles import NONE, Floats, Ints, Obstacles, dot, pick, rows_of
from chutelab.many import Value, of

if TYPE_CHECKING:
    from numpy.typing import NDArray

NOW = 1e-12
"""rad; an obstacle this close to the present angle is met now."""

GRAZING = 1e-9
"""Sine of the angle between path and surface below which a ride only touches, and goes on."""


@dataclass(eq=False)
class Bounds:
    """Nearest angles (rad) below and above where a ride ends, and what is there; arrays (k,).

    ∓inf and obstacle -1 where the way is free. `handover` marks where something takes over without
    a blow: at an end of the circle a face of its segment, at the tip of a moving one, where the rim
    changes its direction, the other half of the circle.
    """

    low: Floats
    low_obstacle: Ints
    low_side: Floats
    low_handover: NDArray[np.bool_]
    high: Floats
    high_obstacle: Ints
    high_side: Floats
    high_handover: NDArray[np.bool_]

    @classmethod
    def free(cls, count: int) -> Self:
        """No obstacle in any direction."""

        def nothing(limit: float) -> tuple[Floats, Ints, Floats, NDArray[np.bool_]]:
            return (
                np.full(count, limit),
                np.full(count, NONE, dtype=np.int64),
                np.zeros(count),
                np.zeros(count, dtype=bool),
            )

        return cls(*nothing(-np.inf), *nothing(np.inf))

    def narrow(
        self, phi: Floats, angle: Floats, closing: Floats, met: NDArray[np.bool_],
        obstacle: Ints | int, side: Floats | int, handover: bool = False,
    ) -> None:  # fmt: skip
        """Take in one more obstacle, whose gap falls with φ at the rate `closing` at `angle`."""
        turn = 2.0 * np.pi
        ahead = phi + np.maximum(np.mod(angle - phi + NOW, turn) - NOW, 0.0)
        behind = phi - np.maximum(np.mod(phi - angle + NOW, turn) - NOW, 0.0)
        nearer = met & (closing > GRAZING) & (ahead < self.high)
        self.high = np.where(nearer, ahead, self.high)
        self.high_obstacle = np.where(nearer, obstacle, self.high_obstacle)
        self.high_side = np.where(nearer, side, self.high_side)
        self.high_handover = np.where(nearer, handover, self.high_handover)
        nearer = met & (closing < -GRAZING) & (behind > self.low)
        self.low = np.where(nearer, behind, self.low)
        self.low_obstacle = np.where(nearer, obstacle, self.low_obstacle)
        self.low_side = np.where(nearer, side, self.low_side)
        self.low_handover = np.where(nearer, handover, self.low_handover)


def bounds(
    obstacles: Obstacles, rows: Ints, circle: Ints, side: Floats, rho: Floats, phi: Floats,
    radius: Value,
) -> Bounds:  # fmt: skip
    """Find what stops rides round circles in both directions.

    Parameters
    ----------
    obstacles : Obstacles
        All of them.
    rows, circle : ndarray, (k,)
        Particles, and the circles (obstacle number less S) they ride.
    side : ndarray, (k,)
        On which half of it, see `Obstacles.rim_side`.
    rho, phi : ndarray, (k,)
        Radius of the centre's path (m) and angle now, from the top, clockwise (rad).
    radius : float, or ndarray, (k,)
        r, m.
    """
    found = Bounds.free(len(rows))
    center = pick(obstacles.center, rows, circle)
    on_pulley = circle + obstacles.segments == obstacles.pulley
    for segment in range(obstacles.segments):
        start = rows_of(obstacles.start[:, segment], rows)
        tangent = rows_of(obstacles.tangent[:, segment], rows)
        normal = rows_of(obstacles.normal[:, segment], rows)
        length = rows_of(obstacles.length[segment], rows)
        owned = obstacles.owns[circle, segment] | (on_pulley & (segment == 0))
        for face in (1, -1):
            # The gap to a face is ρ (cos(φ - tilt) - level).
            tilt = np.arctan2(face * normal[0], face * normal[1])
            level = (face * dot(start - center, normal) + radius) / rho
            half = np.arccos(np.clip(level, -1.0, 1.0))
            met = (np.abs(level) <= 1.0) & ~(owned & (~on_pulley | (face == 1)))
            for angle in (tilt - half, tilt + half):
                foot = dot(center + rho * _up(angle) - start, tangent)
                there = met & (foot >= 0.0) & (foot <= length)
                found.narrow(phi, angle, np.sin(angle - tilt), there, segment, face)
        # The circle belongs to a segment on the outer side of that segment's end.
        middle = start + 0.5 * length * tangent
        outward = np.where(dot(center - middle, tangent) > 0.0, 1.0, -1.0) * tangent
        tilt = np.arctan2(outward[0], outward[1])
        for angle in (tilt - 0.5 * np.pi, tilt + 0.5 * np.pi):
            side_there = np.where(dot(_up(angle), normal) > 0.0, 1, -1)
            found.narrow(phi, angle, np.sin(angle - tilt), owned, segment, side_there, True)
    crown, here = pick(obstacles.crown, rows, circle), circle + obstacles.segments
    tilt = np.arctan2(crown[0], crown[1])
    moves = ~on_pulley & (pick(obstacles.material, rows, here)[0] != 0.0)
    for angle in (tilt - 0.5 * np.pi, tilt + 0.5 * np.pi):
        found.narrow(phi, angle, side * np.sin(angle - tilt), moves, here, -side, True)
    for other in range(obstacles.center.shape[1]):
        # The gap to a circle grows with -cos(φ - tilt).
        apart = rows_of(obstacles.center[:, other], rows) - center
        distance = np.hypot(apart[0], apart[1])
        distinct = (circle != other) & (distance > of(obstacles.touch, rows))
        reach = rows_of(obstacles.rho[other], rows)
        level = (rho**2 + distance**2 - reach**2) / np.where(distinct, 2.0 * rho * distance, 1.0)
        met = distinct & (np.abs(level) < 1.0)
        half = np.arccos(np.clip(level, -1.0, 1.0))
        tilt = np.arctan2(apart[0], apart[1])
        for angle in (tilt - half, tilt + half):
            closing = -np.sin(angle - tilt)
            found.narrow(phi, angle, closing, met, other + obstacles.segments, 0)
    return found


def _up(angle: Floats) -> Floats:
    return np.stack([np.sin(angle), np.cos(angle)])
