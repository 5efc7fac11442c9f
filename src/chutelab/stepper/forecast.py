"""What comes next: a calendar of impacts foretold, each void once one of its paths ends."""

from __future__ import annotations

from heapq import heappop, heappush
from itertools import count
from math import hypot, inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chutelab.ballistics import crossing
from chutelab.stepper.crowd import MOST
from chutelab.stepper.idle import QUIET
from chutelab.stepper.meetings import candidates, encounter, meeting, neighbours
from chutelab.stepper.solids import WEDGED
from chutelab.stepper.tracks import CARRIED, DONE, FLYING, RESTING, WAITING
from chutelab.stepper.wedge import hold_fast

if TYPE_CHECKING:
    from chutelab.stepper.outline import Outline, Touch
    from chutelab.stepper.state import Run

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

ROUNDING = 1e-13
"""Share of their speeds below which two disks do not approach, but rounding says so."""

NEAR = 1e-3
"""Share of the radius within which a solid that is approached slowly is left to pymunk's steps."""

UNBOUND = -2, 0.0, 0.0
"""No face (not even -1), since when (s) and what pace (m/s)."""

AT_ONCE = 100_000
"""Pairs of which it is asked in one expression when they meet; more would not fit the caches."""


class Appointment(NamedTuple):
    """An impact foretold.

    Attributes
    ----------
    particle, other : int
        Who meets whom; other is -1 for a solid.
    touch : Touch or None
        The contact with a solid.
    """

    particle: int
    other: int
    touch: Touch | None


class Forecast:
    """Predicts contacts of paths, and hands them out in the order of time."""

    def __init__(self, run: Run, outline: Outline) -> None:
        self._run, self._outline = run, outline
        # When, a number for the order of those at one time, who, how, and on which paths.
        self._heap: list[tuple[float, int, int, int, Touch | None, int, int]] = []
        self._number = count()
        # Until when who is in contact can meet no other solid; who slept then, if it sleeps on.
        # Awake that is bound by the pace it began with, and holds asleep if near one face alone.
        self._safe_until = np.full(run.count, -inf)
        self._slept = np.zeros(run.count, dtype=bool)
        self._bound = [UNBOUND] * run.count
        self._fastest = float(np.abs(run.solids.speed).max(initial=0.0))
        self._crowd = run.machine.interact and run.count > 1
        self.beside = np.zeros(run.count, dtype=bool)

    def next(self) -> float:
        """Return the time of the next impact, inf if none is foretold."""
        heap, version = self._heap, self._run.version
        while heap:
            t, _, i, j, _, mine, theirs = heap[0]
            if version[i] == mine and (j < 0 or version[j] == theirs):
                return t
            heappop(heap)
        return inf

    def take(self) -> Appointment:
        """Return the next impact."""
        return Appointment(*heappop(self._heap)[2:5])

    def _push(self, t: float, i: int, j: int, touch: Touch | None = None) -> None:
        v = self._run.version
        theirs = int(v[j]) if j >= 0 else 0
        heappush(self._heap, (t, next(self._number), i, j, touch, int(v[i]), theirs))

    def refresh(self, now: float, tick: float) -> None:
        """Foretell the impacts of particles on new paths."""
        run, k = self._run, self._run.tracks
        who, spans = [], []
        for i in dict.fromkeys(run.fresh):
            mode = int(k.mode[i])
            if mode in (WAITING, DONE):
                continue
            until = min(float(k.exit[i]) if mode == FLYING else tick, run.machine.end_time)
            if mode != CARRIED:
                until = min(until, self._solid(i, now, until - now))
            who.append(i)
            spans.append(until - now)
        run.fresh.clear()
        if self._crowd and who:
            everybody = k.all_at(now)
            some = max(1, AT_ONCE // run.count)
            for n in range(0, len(who), some):
                self._rows(who[n : n + some], spans[n : n + some], everybody, now, tick)

    def _solid(self, i: int, now: float, span: float) -> float:
        """Foretell what solid a particle meets; return when, or inf."""
        k = self._run.tracks
        self._safe_until[i] = -inf
        x, y, vx, vy = k.state(i, now)
        rests, speed = bool(k.mode[i] == RESTING), hypot(vx, vy)
        worn_out = rests and self._run.crowd.impacts[i] > MOST
        if worn_out and speed * self._run.dt < WEDGED * self._run.radius:
            # Two faces that drive it into each other are left to the step.
            return inf
        touch = self._outline.first(x, y, vx, vy, span)
        if worn_out and self._run.count == 1 and touch.t * speed <= NEAR * self._run.radius:
            hold_fast(self._run, i, touch.solid)
            return inf
        if rests:
            fall = vy - touch.t * self._run.machine.gravity
            if -(vx * touch.normal[0] + fall * touch.normal[1]) <= self._run.soft:
                return inf
        if touch.t == inf:
            return inf
        self._push(now + touch.t, i, -1, touch)
        return now + touch.t

    def _rows(
        self, who: list[int], spans: list[float], everybody: Floats, now: float, tick: float
    ) -> None:
        """Foretell what some particles meet within their spans, of all there are."""
        run, mode = self._run, self._run.tracks.mode
        apart = everybody[:, None] - everybody.take(who, axis=1)[:, :, None]
        reach, crowd = 2.0 * run.radius, run.crowd.stepped
        which = candidates(apart, reach, np.array(spans)[:, None])
        paths = apart.reshape(4, -1).take(which, axis=1).T.tolist()
        for flat, path in zip(which.tolist(), paths, strict=True):
            n, j = divmod(flat, run.count)
            t_j, speed = encounter(path, reach)
            if t_j > spans[n]:
                continue
            i, other = who[n], int(mode[j])
            if other in (WAITING, DONE):
                continue
            mine, held = int(mode[i]), other != FLYING
            if held and (now + t_j > tick or (other == CARRIED and mine == CARRIED)):
                continue
            if (mine != FLYING or crowd[i]) and (held or crowd[j]):
                floor = self._least(i, j)
            else:
                floor = ROUNDING * (hypot(everybody[2, i], everybody[3, i]) + run.soft)
            if speed > floor:
                self._pair(now + t_j, i, j)

    def _least(self, i: int, j: int) -> float:
        """Return what two that are stepped approach too slowly with to be foretold, m/s."""
        crowd = self._run.crowd
        return crowd.least_approach(max(int(crowd.impacts[i]), int(crowd.impacts[j])))

    def _pair(self, t: float, i: int, j: int) -> None:
        if max(self._run.crowd.impacts[i], self._run.crowd.impacts[j]) > MOST:
            return
        if self._run.tracks.mode[i] == CARRIED:
            i, j = j, i
        self._push(t, i, j)

    def window(self, now: float, tick: float) -> None:
        """Foretell up to the next step what those meet that do not fly, and pairs with them."""
        run, k = self._run, self._run.tracks
        resting, carried, flying = k.mode == RESTING, k.mode == CARRIED, k.mode == FLYING
        self._solids(resting, now, tick)
        self.beside[:] = False
        some = np.count_nonzero
        belt = some(carried)
        if not self._crowd or not (some(resting) or (belt and some(flying))):
            return
        everybody, span = k.all_at(now), tick - now
        who = (resting | carried | flying).nonzero()[0]
        x, way = everybody.take(who, axis=1).reshape(2, 2, -1)
        way[1] += 0.5 * span * run.gravity[1]
        way *= span
        margin = run.radius * (1.0 + NEAR)
        low = np.minimum(way, 0.0) + x
        i, j = neighbours(low - margin, low + np.abs(way) + margin)
        i, j = who.take(i), who.take(j)
        kind = k.mode.take(i)
        # Two in flight were foretold when they took off; two on the belt never meet.
        asked = (kind != k.mode.take(j)) | (kind == RESTING)
        if not some(asked):
            return
        i, j = i.compress(asked), j.compress(asked)
        apart = everybody.take(j, axis=1) - everybody.take(i, axis=1)
        which, t, approach = meeting(apart, 2.0 * run.radius, span)
        free = flying & ~run.crowd.stepped
        flies = free.take(i) | free.take(j)
        closing = np.zeros(len(i))
        soon = (t <= span).nonzero()[0]
        if len(soon):
            which, t, approach = which.take(soon), t.take(soon), approach.take(soon)
            closing[which] = approach
            first, second = i.take(which), j.take(which)
            # Most are at rest to each other, but for rounding.
            fast = (flies.take(which) & (approach > ROUNDING * run.soft)) | (approach > run.slow)
            for n in fast.nonzero()[0].tolist():
                one, other = int(first[n]), int(second[n])
                if flies[which[n]] or approach[n] > self._least(one, other):
                    self._pair(now + float(t[n]), one, other)
        if belt:
            held = carried.take(i) | carried.take(j)
            beside = held & ~flies
            self.beside[i[beside]] = self.beside[j[beside]] = True
            flies |= held
        parts = apart[:2] * apart[:2]
        touching = (~flies & (parts[0] + parts[1] <= 4.0 * margin * margin)).nonzero()[0]
        run.idle.stir(i.take(touching), j.take(touching), closing.take(touching))

    def _solids(self, resting: Mask, now: float, tick: float) -> None:
        """Foretell impacts on solids of those in contact; most are far from any other solid."""
        run = self._run
        due = resting & ((self._safe_until < tick) | (self._slept != run.idle.asleep))
        for i in due.nonzero()[0].tolist():
            asleep = bool(run.idle.asleep[i])
            self._slept[i] = asleep
            if self._safe_until[i] >= tick and self._holds(i, now):
                continue
            until = now + (self._dormant(i, now) if asleep else self._undisturbed(i, now))
            self._safe_until[i] = until
            if until < tick:
                if asleep:
                    # What is asleep is not stepped: nothing would stop it there.
                    run.idle.wake(np.array([i]))
                self._solid(i, now, tick - now)

    def _holds(self, i: int, now: float) -> bool:
        """Tell whether a bound found awake holds for who fell asleep since, or woke up."""
        alone_on, begin, pace = self._bound[i]
        if alone_on != self._run.tracks.face[i]:
            return False
        u, v = self._run.tracks.w[i].tolist()
        return hypot(u, v) <= pace + (now - begin) * self._run.machine.gravity

    def _dormant(self, i: int, now: float) -> float:
        """Return for how long a sleeper can meet no other solid, s."""
        run, out = self._run, inf
        x, y, _, _ = run.tracks.state(i, now)
        velocity, force = tuple(run.tracks.w[i].tolist()), run.idle.acceleration(i)
        self._bound[i] = UNBOUND
        for gap, approach, pull in self._outline.around(x, y, velocity, force):
            # What it lies on it neither leaves nor approaches.
            lies = gap <= NEAR * run.radius and abs(approach) <= QUIET
            if not (lies and abs(pull) * run.dt <= QUIET):
                out = min(out, crossing(max(gap, 0.0), -approach, -pull))
        return out

    def _undisturbed(self, i: int, now: float) -> float:
        """Return for how long a particle in contact can meet no other solid, s."""
        run, near, nearest = self._run, NEAR * self._run.radius, inf
        x, y, u, v = run.tracks.state(i, now)
        beside = []
        around = self._outline.around(x, y, (u, v), (0.0, 0.0))
        for solid, (gap, approach, _) in enumerate(around):
            if gap <= near:
                beside.append(solid)
            if gap < nearest and (gap > near or approach > run.soft):
                nearest = gap
        face, pace = int(run.tracks.face[i]), max(hypot(u, v), self._fastest)
        self._bound[i] = (face, now, pace) if beside == [face] else UNBOUND
        if nearest == inf:
            return inf
        return crossing(max(nearest, 0.0), -pace, -run.machine.gravity)
