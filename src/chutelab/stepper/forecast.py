"""What comes next: a calendar of impacts foretold, each void once one of its paths ends."""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count
from math import hypot, inf
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.stepper.crowd import MOST
from chutelab.stepper.meetings import meeting, neighbours
from chutelab.stepper.tracks import CARRIED, DONE, FLYING, RESTING, WAITING

if TYPE_CHECKING:
    from chutelab.stepper.outline import Outline, Touch
    from chutelab.stepper.state import Run

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ROUNDING = 1e-13
"""Share of their speeds below which two disks do not approach, but rounding says so."""

NEAR = 1e-3
"""Share of the radius within which a solid is left to pymunk's steps."""


@dataclass(frozen=True)
class Appointment:
    """An impact foretold.

    Attributes
    ----------
    particle, other : int
        Who meets whom; other is -1 for a solid.
    touch : Touch or None
        The contact with a solid.
    versions : tuple of int
        Of the paths of the two.
    """

    particle: int
    other: int
    touch: Touch | None
    versions: tuple[int, int]


class Forecast:
    """Predicts contacts of paths, and hands them out in the order of time."""

    def __init__(self, run: Run, outline: Outline) -> None:
        self._run, self._outline = run, outline
        self._heap: list[tuple[float, int, Appointment]] = []
        self._number = count()
        self._safe_until = np.full(run.count, -inf)
        self._fastest = float(np.abs(run.solids.speed).max(initial=0.0))
        self._crowd = run.machine.interact and run.count > 1
        self.beside = np.zeros(run.count, dtype=bool)

    def next(self) -> float:
        """Return the time of the next impact, inf if none is foretold."""
        while self._heap:
            t, _, what = self._heap[0]
            version = self._run.version
            if version[what.particle] == what.versions[0] and (
                what.other < 0 or version[what.other] == what.versions[1]
            ):
                return t
            heappop(self._heap)
        return inf

    def take(self) -> Appointment:
        """Return the next impact."""
        return heappop(self._heap)[2]

    def _push(self, t: float, i: int, j: int, touch: Touch | None = None) -> None:
        v = self._run.version
        what = Appointment(i, j, touch, (int(v[i]), int(v[j]) if j >= 0 else 0))
        heappush(self._heap, (t, next(self._number), what))

    def refresh(self, now: float, tick: float) -> None:
        """Foretell the impacts of particles on new paths."""
        run, k = self._run, self._run.tracks
        everybody = None
        for i in dict.fromkeys(run.fresh):
            mode = k.mode[i]
            if mode in (WAITING, DONE):
                continue
            until = min(float(k.exit[i]) if mode == FLYING else tick, run.machine.end_time)
            if mode != CARRIED:
                until = min(until, self._solid(i, now, until - now))
            if self._crowd:
                if everybody is None:
                    everybody = k.all_at(now)
                self._row(i, everybody, now, until, tick)
        run.fresh.clear()

    def _solid(self, i: int, now: float, span: float) -> float:
        k = self._run.tracks
        x, y, vx, vy = k.state(i, now)
        touch = self._outline.first(x, y, vx, vy, span)
        if k.mode[i] == RESTING:
            self._safe_until[i] = -inf
            fall = vy - touch.t * self._run.machine.gravity
            if -(vx * touch.normal[0] + fall * touch.normal[1]) <= self._run.soft:
                return inf
        if touch.t == inf:
            return inf
        self._push(now + touch.t, i, -1, touch)
        return now + touch.t

    def _row(
        self, i: int, everybody: tuple[Floats, ...], now: float, until: float, tick: float
    ) -> None:
        """Foretell what one particle meets, of all there are."""
        run, mode = self._run, self._run.tracks.mode
        x, y, u, v = (a - a[i] for a in everybody)
        t, approach = meeting(x, y, u, v, 2.0 * run.radius)
        soon = (t <= until - now).nonzero()[0]
        if not len(soon):
            return
        rounding = ROUNDING * (hypot(everybody[2][i], everybody[3][i]) + run.soft)
        impacts, crowd = run.crowd.impacts, run.crowd.stepped
        stepped, carried = mode[i] != FLYING or crowd[i], mode[i] == CARRIED
        for j in soon.tolist():
            if mode[j] == WAITING or mode[j] == DONE:
                continue
            held = mode[j] != FLYING
            if held and (now + t[j] > tick or (carried and mode[j] == CARRIED)):
                continue
            floor = rounding
            if stepped and (held or crowd[j]):
                floor = run.crowd.calm(max(impacts[i], impacts[j]))
            if approach[j] > floor:
                self._pair(now + float(t[j]), i, j)

    def _pair(self, t: float, i: int, j: int) -> None:
        if max(self._run.crowd.impacts[i], self._run.crowd.impacts[j]) > MOST:
            return
        if self._run.tracks.mode[i] == CARRIED:
            i, j = j, i
        self._push(t, i, j)

    def window(self, now: float, tick: float) -> None:
        """Foretell up to the next step what those meet that do not fly, and pairs with them."""
        run, k = self._run, self._run.tracks
        resting = (k.mode == RESTING).nonzero()[0]
        if len(resting):
            self._solids(resting, now, tick)
        self.beside[:] = False
        if not self._crowd:
            return
        who = ((k.mode != WAITING) & (k.mode != DONE)).nonzero()[0]
        modes = k.mode[who]
        if (modes == FLYING).all() or (modes == CARRIED).all():
            return
        x, v = k.flight(who, now)
        span = tick - now
        way = span * v + 0.5 * span * span * run.gravity
        margin = run.radius * (1.0 + NEAR)
        margin2 = 2.0 * margin
        a, b = neighbours(np.minimum(x, x + way) - margin, np.maximum(x, x + way) + margin)
        both = modes[a] * 8 + modes[b]
        asked = (both != FLYING * 9) & (both != CARRIED * 9)
        a, b, both = a[asked], b[asked], both[asked]
        if not len(a):
            return
        dx, dv = x[b] - x[a], v[b] - v[a]
        t, approach = meeting(dx[:, 0], dx[:, 1], dv[:, 0], dv[:, 1], 2.0 * run.radius)
        flies = (modes == FLYING) & ~run.crowd.stepped[who]
        flies = flies[a] | flies[b]
        impacts = run.crowd.impacts[who]
        calm = run.crowd.calm(np.maximum(impacts[a], impacts[b]))
        floor = np.where(flies, ROUNDING * run.soft, calm)
        for n in ((t <= span) & (approach > floor)).nonzero()[0].tolist():
            self._pair(now + float(t[n]), int(who[a[n]]), int(who[b[n]]))
        carried = (modes[a] == CARRIED) | (modes[b] == CARRIED)
        touching = (~flies & ~carried & (np.hypot(dx[:, 0], dx[:, 1]) <= margin2)).nonzero()[0]
        run.idle.stir(
            who[a[touching]], who[b[touching]], np.where(t <= span, approach, 0.0)[touching]
        )
        self.beside[who[a[carried & ~flies]]] = self.beside[who[b[carried & ~flies]]] = True

    def _solids(self, resting: Ints, now: float, tick: float) -> None:
        """Foretell impacts on solids of those in contact; most are far from any other solid."""
        run, k = self._run, self._run.tracks
        due = resting[self._safe_until[resting] < tick]
        if not len(due):
            return
        x, v = k.flight(due, now)
        gap = self._outline.clearance(x, NEAR * run.radius)
        speed = np.maximum(np.hypot(v[:, 0], v[:, 1]), self._fastest)
        pace = speed + np.sqrt(run.machine.gravity * gap)
        with np.errstate(divide="ignore", invalid="ignore"):
            safe = np.where(gap < inf, gap / np.where(pace > 0.0, pace, 1.0), inf)
        self._safe_until[due] = now + safe
        close = due[now + safe < tick]
        # What is asleep is not stepped: nothing would stop it there.
        run.idle.wake(close)
        for i in close.tolist():
            self._solid(i, now, tick - now)
