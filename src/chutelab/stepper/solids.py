"""Surfaces with a thickness: what a particle can touch in a stepped world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from chutelab.machine import Machine

Floats = NDArray[np.float64]

HALF_THICKNESS = 2e-3
"""m; half the thickness that belts, plate and free surfaces get behind the struck face. A particle
needs a step shorter than (r + this)/v not to pass through; thicker would make the backs of surfaces
stick out further."""

GRIP = 1e6
"""Coefficient of friction that stands for µ = ∞: finite, because pymunk multiplies it by 0."""

SLOP = 1e-3
"""Overlap, as a share of the radius, that pymunk leaves alone: parting what overlaps less would
raise it, and that energy comes from nowhere."""

DEEP = 5e-6
"""Share of the radius by which a particle is laid into what it rests on, so that pymunk sees the
contact. The pulley is smaller by twice as much: what lies a hair inside the belt must not feel it
behind x = 0."""

WEDGED = 0.1
"""Share of the radius; what faces drive to and fro is left to a step that leads less far."""


@dataclass(frozen=True, eq=False)
class Solids:
    """Slabs behind the lines from a to b; and, last, the pulley, a circle with a = b.

    The struck face is the surface of the machine, with its true ends: upper faces of the two belts,
    the left face (seen upwards) of the plate, for free surfaces the face that looks to the nominal
    release point (if that lies on their line: the upper, or left, one). Struck from behind, a
    surface is met 2 `HALF_THICKNESS` too early.

    Attributes
    ----------
    a, b : ndarray, (K, 2)
        Ends of the struck faces, m; the axis of the pulley.
    behind : ndarray, (K, 2)
        From the struck face to the back, m; zero for the pulley.
    reach : ndarray, (K,)
        Radius of the pulley, m; zero for slabs.
    tangent : ndarray, (K, 2)
        Direction in which a belt runs; zero for the pulley.
    speed, friction, restitution : ndarray, (K,)
        Speed of the surface (m/s), pair values with a particle; µ = ∞ is `GRIP`.
    surface : ndarray, (K,)
        Index into `Machine.surfaces`.
    pulley : int
        Index of the pulley, -1 without one.
    """

    a: Floats
    b: Floats
    behind: Floats
    reach: Floats
    tangent: Floats
    speed: Floats
    friction: Floats
    restitution: Floats
    surface: NDArray[np.int64]
    pulley: int

    @cached_property
    def lines(self) -> list[tuple[float, ...]]:
        """Beginnings of the faces, unit vectors along them and lengths: x, y, x, y and m, of K."""
        line = self.b - self.a
        length = np.hypot(*line.T)
        unit = line / np.where(length > 0.0, length, 1.0)[:, None]
        return [tuple(row) for row in np.column_stack([self.a, unit, length]).tolist()]

    def belt_at(self, solid: int, normal: tuple[float, float]) -> float:
        """Speed of the surface along (n_y, -n_x) at one contact."""
        if solid == self.pulley:
            return float(self.speed[solid])
        along = self.tangent[solid, 0] * normal[1] - self.tangent[solid, 1] * normal[0]
        return float(self.speed[solid] * along)

    def gaps(self, points: Floats, radius: float) -> Floats:
        """Distances (P, K) between disks of a radius around points (P, 2) and the faces, m."""
        line = self.b - self.a
        square = np.maximum((line**2).sum(axis=1), 1e-300)
        from_a = points[:, None, :] - self.a
        share = np.clip((from_a * line).sum(axis=2) / square, 0.0, 1.0)
        return np.asarray(
            np.linalg.norm(from_a - share[..., None] * line, axis=2) - self.reach - radius
        )


def solids(machine: Machine) -> Solids:
    """Give the surfaces of a machine their thickness, behind the struck face."""
    seg = machine.segments
    left = np.stack([-seg.tangent[:, 1], seg.tangent[:, 0]], axis=-1)
    toward = (machine.releases.position[0] - seg.start) * left
    side = toward.sum(axis=-1)
    upper = np.where(left[:, 1] != 0.0, np.sign(left[:, 1]), -np.sign(left[:, 0]))
    facing = np.where(np.abs(side) > 1e-9 * seg.length, np.sign(side), upper)
    conveyor = [
        machine.surfaces[s] in {"incoming", "outgoing", "plate"} for s in seg.surface.tolist()
    ]
    facing = np.where(conveyor, 1.0, facing)
    rows = [
        seg.start,
        seg.end,
        -2.0 * HALF_THICKNESS * facing[:, None] * left,
        np.zeros(len(seg.length)),
        seg.tangent,
        seg.speed,
        np.minimum(seg.friction, GRIP),
        seg.restitution,
        seg.surface,
    ]
    pulley = machine.pulley
    if pulley is not None:
        drum = pulley.radius - 2.0 * DEEP * machine.particle.radius
        last = [
            np.zeros(2), np.zeros(2), np.zeros(2), drum, np.zeros(2), pulley.speed,
            min(pulley.friction, GRIP), pulley.restitution, pulley.surface,
        ]  # fmt: skip
        rows = [np.concatenate([row, [end]]) for row, end in zip(rows, last, strict=True)]
    *values, surface = rows
    a, b, behind, reach, tangent, speed, friction, restitution = values
    return Solids(
        a, b, behind, reach, tangent, speed, friction, restitution,
        surface.astype(np.int64), len(seg.length) if pulley is not None else -1,
    )  # fmt: skip
