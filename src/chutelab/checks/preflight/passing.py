"""Moving surfaces that pass through other surfaces, where what comes between them is squeezed.

A moving surface is followed through times so close to each other that it advances by little. In the
frame of the other surface a point of it has passed through if it was on one side, is now on the
other, and was on the surface in between; at an end of it only if they cross afterwards. The other
surface is followed in the same way in the frame of the first.
Surfaces that only touch, as a board that is hinged at the end of a wall or a floor that travels
between walls, do not pass through each other. What is found does pass through; a passage of less
than 3e-4 of the radius of an arc may be missed, and so may one later than `MOST` steps of a motion
that does not end.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, hypot, inf, isfinite, nan, radians

import numpy as np

from chutelab.machine import DRIVE_PULLEY, SWING, Machine, Mover
from chutelab.machine.shapes import TOUCHES, Pieces
from chutelab.results import Recording
from chutelab.util.arrays import Bools, Floats, Ints

MOST = 1000
"""Most times at which a motion is looked at."""

FINE_TURN = radians(2.0)
"""Most that a surface turns from one time to the next, rad."""

FINE_SHAKE = 24
"""Times in a period of a shake."""

FINE_WAY = 0.25
"""Most that a surface advances from one time to the next, in sizes of its smallest piece."""


@dataclass(frozen=True)
class Passing:
    """A surface that passes through another one."""

    surface: str  # it moves
    through: str  # another surface or `DRIVE_PULLEY`
    place: tuple[float, float]  # where it does so first, m
    turned: float  # rad; by how much `surface` is turned then
    t: float  # s; NaN of a hinge that may turn so far within its stops

    def __str__(self) -> str:
        x, y = np.round(self.place, 9) + 0.0
        angle = f"turned by {np.degrees(self.turned):.4g}°"
        within, when = "within its stops ", angle
        if not np.isnan(self.t):
            within, when = "", f"at t = {self.t:.4g} s" + f", {angle}" * bool(self.turned)
        return (
            f"{self.surface}: {within}it passes through {self.through}, first {when}, at"
            f" ({x:.4g}, {y:.4g}) m"
        )


def passings(machine: Machine, tried: Recording | None) -> list[Passing]:
    """Return the pairs of surfaces of which one passes through the other, each where it is first.

    Hinges move as in a trial run, if there is one, and besides between their stops. Pairs that
    cross as they are written are left out.
    """
    moving = machine if tried is None else tried.machine
    known = {frozenset((one.surface, one.crosses)) for one in machine.warnings}
    times = [_times(moving, mover) for mover in moving.movers]
    found = _first(moving, np.unique(np.concatenate(times))) if times else []
    for mover in machine.movers:
        if mover.hinge is not None and isfinite(mover.hinge.stops[1]):
            found += turned(machine, mover, mover.hinge.stops)
    each: dict[frozenset[str], Passing] = {}
    for one in found:
        each.setdefault(frozenset((one.surface, one.through)), one)
    return [one for pair, one in each.items() if pair not in known]


def turned(machine: Machine, mover: Mover, stops: tuple[float, float]) -> list[Passing]:
    """Return what a hinged surface passes through between two stops (rad), the others as written.

    It turns from its place as written to one stop, and from there to the other one.
    """
    assert mover.hinge is not None
    found: list[Passing] = []
    for stop in sorted(stops, key=abs):
        span, way = abs(stop), 1.0 if stop > 0.0 else -1.0
        if not span:
            continue
        # At 1 rad/s, so that times are angles.
        states = np.zeros(2, SWING)
        states["t"], states["angle"], states["rate"] = (0.0, span), (0.0, stop), way
        alone = replace(
            machine, movers=(replace(mover, hinge=replace(mover.hinge, states=states)),)
        )
        times = np.linspace(0.0, span, 1 + ceil(span / _fine_turn(machine, mover)))
        found += (replace(one, t=nan) for one in _first(alone, times, timed=False))
    return sorted(found, key=lambda one: abs(one.turned))


def _own(machine: Machine, mover: Mover) -> list[Floats]:
    return [piece.path() for piece in machine.pieces if piece.surface == mover.surface]


def _size(paths: list[Floats]) -> float:
    """Return the size of the smallest of some pieces, m."""
    return min(float(np.hypot(*np.ptp(path, axis=0))) for path in paths)


def _fine_turn(machine: Machine, mover: Mover) -> float:
    """Return by how much a surface may turn from one time to the next, rad."""
    paths = _own(machine, mover)
    reach = max(float(np.hypot(*(path - mover.pivot).T).max()) for path in paths)
    return min(FINE_TURN, FINE_WAY * _size(paths) / reach)


def _times(machine: Machine, mover: Mover) -> Floats:
    """Return the times at which a surface is looked at, s."""
    end, begin = machine.end_time, mover.begins
    found = [np.array([0.0, end])]
    if mover.hinge is not None:
        states = mover.hinge.states["t"]
        found.append(states[:: 1 + len(states) // MOST])
    elif isfinite(begin):
        finest = (
            _fine_turn(machine, mover) / abs(mover.turn) if mover.turn else inf,
            1.0 / (FINE_SHAKE * mover.frequency) if mover.frequency else inf,
        )
        found += [
            begin + fine * np.arange(1, 1 + min(MOST, (end - begin) / fine)) for fine in finest
        ]
        if mover.lasts:
            many = 8 * ceil(hypot(*mover.way) / (8 * FINE_WAY * _size(_own(machine, mover))))
            way = np.linspace(0.0, mover.lasts, 1 + min(max(many, 64), MOST))
            found.append(begin + mover.start + way)
    times = np.concatenate(found)
    return times[times <= end]


def _first(machine: Machine, times: Floats, *, timed: bool = True) -> list[Passing]:
    """Return the first passage of each pair of surfaces in ascending times, (T,), s.

    If it is not `timed`, all gates are there at all times.
    """
    pieces = machine.pieces
    names = [DRIVE_PULLEY if name == "pulley" else name for name in machine.names]
    movers = [machine.mover(int(piece.surface)) for piece in pieces]
    # Points of each piece; a middle one for two that turn through each other about a common end.
    points = [np.concatenate([one.path(), one.at([0.5 * one.way])]) for one in pieces]
    # Boxes round each piece in each step, (T - 1, 2), or (1, 2), and in all of them, (S, 2).
    lows, highs = [], []
    for own, mover in zip(points, movers, strict=True):
        way = own[None] if mover is None else mover.carried(own, times[:, None])
        low, high = way.min(axis=1), way.max(axis=1)
        lows.append(low if mover is None else np.minimum(low[:-1], low[1:]))
        highs.append(high if mover is None else np.maximum(high[:-1], high[1:]))
    least = np.array([low.min(axis=0) for low in lows])
    most = np.array([high.max(axis=0) for high in highs])
    size = float(np.abs([least, most]).max())
    near, slack = TOUCHES * size, 1e-3 * size
    found: dict[tuple[str, str], Passing] = {}
    for i, mover in enumerate(movers):
        if mover is None:
            continue
        beside = ((least[i] - slack <= most) & (least - slack <= most[i])).all(axis=1)
        for j in np.flatnonzero(beside).tolist():
            other, pair = movers[j], (names[i], names[j])
            if pieces[i].surface == pieces[j].surface or (other is not None and j < i):
                continue
            there = (lows[i] - slack <= highs[j]) & (lows[j] - slack <= highs[i])
            steps = np.flatnonzero(there.all(axis=1))
            if pair in found:
                steps = steps[times[steps] < found[pair].t]
            one, two = (pieces[i], mover), (pieces[j], other)
            for sides in (_Sides(*one, points[i], *two), _Sides(*two, points[j], *one)):
                t, (x, y) = sides.first(times, steps, near, timed=timed)
                if t < inf and (pair not in found or t < found[pair].t):
                    found[pair] = Passing(*pair, (x, y), float(mover.pose(t)[2]), t)
    return list(found.values())


@dataclass(frozen=True)
class _Sides:
    """On which side of a piece the points of another one are."""

    own: Pieces  # the points are on this piece ...
    mover: Mover | None
    points: Floats  # ... as written, (P, 2), m; its middle is the last
    other: Pieces
    theirs: Mover | None

    def at(self, times: Floats, points: Floats) -> Floats:
        """Return places of points (..., 2) at times (...) in the frame of the other piece, m."""
        there = points if self.mover is None else self.mover.carried(points, times)
        return there if self.theirs is None else self.theirs.at_rest(there, times)

    def side(self, places: Floats) -> Floats:
        """Return how far places in that frame are on the left of the piece or outside, m."""
        return np.asarray((self.other.away(places) * self.other.normal(places)).sum(axis=-1))

    def first(
        self, times: Floats, steps: Ints, near: float, *, timed: bool
    ) -> tuple[float, Floats]:
        """Return when and where a point passes through first in some steps; inf if none does."""
        if not len(steps):
            return inf, np.full(2, nan)
        k = np.union1d(steps, steps + 1)
        places = self.at(times[k, None], self.points)  # (K, P, 2)
        side = self.side(places)
        sign = np.sign(side) * (np.abs(side) > near)
        # What touches the piece at the beginning is where most of its own piece is.
        sign[0] = np.where(sign[0] == 0.0, sign[0, -1], sign[0])
        # The last sample before, in a row of steps, at which a point was on one side.
        rows = np.arange(len(k))[:, None]
        begins = np.concatenate([[True], np.diff(k) > 1])[:, None]
        last = np.maximum.accumulate(np.where((sign != 0.0) | begins, rows, 0), axis=0)
        before = last[:-1]
        changes: Bools = np.take_along_axis(sign, before, axis=0) * sign[1:] < 0.0
        changes &= ~begins[1:]
        t, where, row = inf, np.full(2, nan), len(k)
        for n, p in np.argwhere(changes):
            if n > row:
                break
            way = np.hypot(*(places[n + 1, p] - places[before[n, p], p]))
            if self.other.gap(places[n + 1, p]) > 2.0 * way + near:
                continue
            low, high = times[k[before[n, p]]], times[k[n + 1]]
            for _ in range(60):
                middle = 0.5 * (low + high)
                now = self.side(self.at(middle, self.points[p]))
                low, high = (low, middle) if now * sign[n + 1, p] > 0.0 else (middle, high)
            place = self.at(high, self.points[p])
            there = not timed or bool(self.own.there(high) and self.other.there(high))
            through = self.within(place, near) or self.crosses(places[n + 1, :-1], near)
            if high < t and there and through and float(self.other.gap(place)) <= near:
                where = place if self.theirs is None else self.theirs.carried(place, high)
                t, row = float(high), n
        return t, where

    def within(self, places: Floats, near: float) -> Bools:
        """Whether the points of the other piece nearest to places (..., 2) are not its ends."""
        along = self.other.along(places)
        return self.other.whole | ((along > near) & (along < self.other.way - near))

    def crosses(self, places: Floats, near: float) -> bool:
        """Whether the piece whose points are at places (P, 2) crosses the other one."""
        side = self.side(places)
        (a, b), (p, q) = (side[:-1], side[1:]), (places[:-1], places[1:])
        apart = (a * b < 0.0) & (np.minimum(np.abs(a), np.abs(b)) > near)
        share = np.divide(a, a - b, out=np.zeros_like(a), where=apart)
        return bool((apart & self.within(p + share[:, None] * (q - p), near)).any())
