"""Where the alignment gives way: crowds, in which impacts follow each other ever faster.

Particles that lose energy when they meet would meet infinitely often within a moment (inelastic
collapse). Who is in a crowd is stepped even in flight, and what comes together slowly there is left
to the step; the faster a crowd would meet, the more counts as slow, but for what a step would press
together by `DEEPER`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.recorder import StalledError
from chutelab.stepper.tracks import FLYING

if TYPE_CHECKING:
    from chutelab.stepper.state import Run

MANY = 10
"""Impacts of a particle lately, beyond which it is in a crowd. Lately: since the last step, and
half of what it was then."""

MOST = 200
"""Impacts of a particle lately, beyond which it does not bounce any more."""

LOAD = 100, 0.05
"""Impacts of all particles lately, at least and per particle, beyond which each counts for more:
some tens are resolved within the time of a step of pymunk's and its books."""

DEEPER = 0.01
"""Share of the radius by which a step may bring two deeper into each other: up to `MOST`, what
approaches faster is foretold in whatever crowd. Many such steps would add up, for overlaps are
parted slowly."""

BOUND = 10_000, 1_000
"""Impacts within one step, and of these per particle, beyond which a run does not get on."""


class Crowd:
    """Counts impacts.

    Attributes
    ----------
    impacts : ndarray, (N,)
        Of each particle lately.
    stepped : ndarray of bool, (N,)
        Whether it was in a crowd at the last step, and is stepped even in flight.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self.impacts = np.zeros(run.count, dtype=np.int64)
        self.stepped = np.zeros(run.count, dtype=bool)
        self._until, self._load, self._within = run.start, 0, 0
        # The largest number of impacts, and whether anybody is stepped.
        self._most, self._any = 0, False
        self._allowed = max(LOAD[0], LOAD[1] * run.count)
        self._fast = max(run.slow, DEEPER * run.radius / run.dt)
        self._bound = BOUND[0] + BOUND[1] * run.count

    def count(self, i: int, j: int, t: float) -> int:
        """Count an impact of i and j, perhaps the same; return how many one of them had lately.

        Raises
        ------
        StalledError
            If there were too many within one step.
        """
        self._forget(t)
        most = 0
        for n in {i, j}:
            impacts = int(self.impacts[n]) + 1
            self.impacts[n], most = impacts, max(most, impacts)
            self._load += 1
        self._within += 1
        self._most = max(self._most, most)
        if self._within > self._bound:
            run = self._run
            x, y, _, _ = run.tracks.state(i, t)
            reason = (
                f"{self._within} impacts within one step of {run.dt:.3g} s; lower run.dt, the "
                "number of particles, or the speeds"
            )
            raise StalledError(int(run.ids[i]), t, (x, y), reason)
        return most

    def _forget(self, t: float) -> None:
        """Halve what was counted with each step that is over."""
        if t < self._until - 1e-3 * self._run.dt:
            return
        tick = self._run.next_tick(t)
        if tick > self._until:
            if self._most:
                steps = min(round((tick - self._until) / self._run.dt), 60)
                self.impacts >>= steps
                self._most >>= steps
                self._load = int(self.impacts.sum())
            self._within, self._until = 0, tick

    def look(self, t: float) -> None:
        """Note at a step who is in a crowd; who is in none any more flies on as foretold."""
        self._forget(t)
        run = self._run
        if run.count == 1:
            return
        if not (self._any or self.is_in(self._most)):
            return
        stepped = self.impacts * self._pressure > MANY
        out = (self.stepped & ~stepped & (run.tracks.mode == FLYING)).nonzero()[0]
        self.stepped, self._any = stepped, self.is_in(self._most)
        for n in out.tolist():
            run.changed(n)

    def is_in(self, impacts: int) -> bool:
        """Tell whether that many impacts lately make a crowd."""
        return impacts * self._pressure > MANY

    def least_approach(self, impacts: int) -> float:
        """Return what approaches too slowly to be foretold where all are stepped, m/s.

        It is `Run.slow` or more.
        """
        p = self._pressure
        factor = p * max(impacts * p / MANY, 1.0)
        return min(self._run.slow * (factor * factor), self._fast)

    @property
    def _pressure(self) -> float:
        return max(1.0, self._load / self._allowed)
