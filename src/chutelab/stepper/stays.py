"""Who lies on which surface, since when, and whether it slips there."""

from __future__ import annotations

from math import isnan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.recording import Kind
from chutelab.stepper.tracks import RESTING

if TYPE_CHECKING:
    from chutelab.stepper.state import Run

Ints = NDArray[np.int64]

HOP = 10
"""Steps; a stepped disk hops along a curve. A flight between two contacts with one surface that is
shorter than this is no separation, and a contact shorter than this none to separate from."""


class Stays:
    """Contacts of particles with one surface each.

    Attributes
    ----------
    on, slipping : ndarray, (N,)
        Surface of the present contact or -1, and whether it slips.
    """

    def __init__(self, run: Run) -> None:
        self._run, count = run, run.count
        self.on = np.full(count, -1, dtype=np.int64)
        self.slipping = np.zeros(count, dtype=bool)
        self._since = np.zeros(count)
        self._left = np.full(count, np.nan)
        self._left_state = np.zeros((count, 5))

    def left(self, i: int, t: float) -> None:
        """Note that a particle lost its contact at t; if it separated, its flight will tell."""
        lasted = t - self._since[i] > (HOP - 0.5) * self._run.dt
        if self.on[i] >= 0 and isnan(self._left[i]) and lasted:
            k = self._run.tracks
            self._left[i] = t
            self._left_state[i, :2], self._left_state[i, 2:4] = k.x[i], k.v[i]
            self._left_state[i, 4] = k.omega[i]

    def hopped(self, particle: int, surface: int, t: float) -> bool:
        """Tell whether a contact renews one with the same surface that ended a moment ago."""
        since = t - float(self._left[particle])
        return bool(surface == self.on[particle] and since < HOP * self._run.dt)

    def arrive(self, who: Ints, surface: Ints, t: float) -> None:
        """Note what particles in contact lie on: one surface each; -1: several, or another one."""
        news = ((surface != self.on[who]) | ~np.isnan(self._left[who])).nonzero()[0]
        for i, on in zip(who[news].tolist(), surface[news].tolist(), strict=True):
            self.arrive_one(i, on, t)

    def arrive_one(self, i: int, surface: int, t: float) -> None:
        """Note the contact of one particle with a surface, -1 for another particle."""
        same = surface == self.on[i]
        if same and t - self._left[i] < HOP * self._run.dt:
            self._left[i] = np.nan
        elif not (same and self._run.tracks.mode[i] == RESTING):
            self.tell_separation(i)
            self._since[i] = t
            self.slipping[i] = True
        self.on[i] = surface

    def tell_separation(self, i: int) -> None:
        """Write the separation of a flight that turned out to be none but a hop."""
        left = self._left[i]
        if isnan(left):
            return
        who, s = np.array([i]), self._left_state[i]
        self._run.event(Kind.SEPARATION, who, left, s[:2], s[2:4], s[4], self.on[who])
        self._left[i] = np.nan
