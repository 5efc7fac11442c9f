"""What particles find in those they touch: by number, other particles and, beyond them, solids."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.stepper.solids import Solids

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Partners:
    """Tables of N particles and K solids, for all contacts of a step at once.

    Attributes
    ----------
    surface : ndarray, (N + K,)
        Under which contacts are booked.
    share : ndarray, (N + K,)
        -1/2 times the share of a contact's work that is the first's: all with a solid, half with
        another particle.
    unsettling : ndarray of bool, (N + K,)
        Belts, but for the outgoing one: nothing settles there.
    slope : ndarray of bool, (N + K,)
        Belts on a slope: what they pay, they pay for good.
    """

    def __init__(self, machine: Machine, solids: Solids, count: int) -> None:
        size = count + len(solids.reach)
        moving = solids.speed != 0.0
        self.surface = np.full(size, len(machine.surfaces))
        self.surface[count:] = solids.surface
        self.share = np.full(size, -0.25)
        self.share[count:] = -0.5
        self.unsettling, self.slope = np.zeros((2, size), dtype=bool)
        self.unsettling[count:] = moving & (solids.surface != machine.landing)
        self.slope[count:] = moving & (np.abs(solids.tangent[:, 1]) > 0.0)
        # Tangent, 1 for the pulley, and speed.
        self._belts = np.zeros((size, 4))
        self._belts[count:, :2], self._belts[count:, 3] = solids.tangent, solids.speed
        if solids.pulley >= 0:
            self._belts[count + solids.pulley, 2] = 1.0
        # Beginning of a face, the line from there, and between which multiples it is flat.
        self._faces = np.zeros((size, 6))
        self._faces[:count, 4:] = -np.inf, np.inf
        line = solids.b - solids.a
        self._faces[count:, :2], self._faces[count:, 2:4] = solids.a, line
        self._faces[count:, 5] = (line**2).sum(axis=1)

    def belt(self, partner: Ints, nx: Floats, ny: Floats) -> Floats:
        """Speed of the surface along (n_y, -n_x) at contacts (M,) with normals n."""
        tx, ty, drum, speed = self._belts.take(partner, axis=0).T
        return np.asarray(speed * (tx * ny - ty * nx + drum))

    def rounded(self, partner: Ints, points: Floats) -> Mask:
        """Tell where disks around points (M, 2) touch the pulley or the end of a face, (M,)."""
        ax, ay, lx, ly, begin, end = self._faces.take(partner, axis=0).T
        along = (points[:, 0] - ax) * lx + (points[:, 1] - ay) * ly
        return np.asarray((along <= begin) | (along >= end))
