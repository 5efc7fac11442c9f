"""Roots and minima of a function of one key over a range.

SciPy finds one root between two values, and one minimum, of a function that exists in between. A
range holds several of them; the function jumps where the particle's course changes, and for some
values of the key there is none. `brentq` takes a jump for a root: of landing.vx = -0.9 m/s over
7.97 to 8.5 degrees of the plate of inclined-20 it answers 7.98012, where vx jumps from -1.00 to
-0.84. So `scan` first divides the range into pieces with one course each. SciPy works on these:
between neighbours of different signs, and around points that are lower than their neighbours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Final, Literal, NamedTuple

import numpy as np

from chutelab.studies.design.evaluation import NO_RUN, Evaluator, scipy
from chutelab.util.arrays import Floats

Function = Callable[[float], float]


def bounded(function: Function, low: float, high: float, sign: float = 1.0) -> tuple[float, float]:
    """Return the place and value of the minimum of `sign` times a function in an interval.

    Near a smooth minimum the place is only known to about the square root of a rounding, because
    the function does not change over it.
    """
    options = {"xatol": 1e-10 * (high - low), "maxiter": 200}
    found = scipy("optimize").minimize_scalar(
        lambda x: sign * function(x), bounds=(float(low), float(high)), method="bounded",
        options=options,
    )  # fmt: skip
    return float(found.x), float(found.fun)


MOST_CHANGES: Final = 24
"""Most changes of course that are located; a range with more is too wide to be understood, and the
others stay between two points of the grid."""

SLIVER: Final = 1e-9
"""Pieces with another course that are shorter than this share of the range are left out: a clipped
edge, or rounding."""

ROUNDS: Final = 60
"""Halvings that reduce any interval to neighbouring numbers, 2⁻⁵³ of its ends, and a few more."""


@dataclass(frozen=True, eq=False)
class Change:
    """Two values of the key, as close as numbers get, between which the course changes."""

    low: float
    high: float
    values: Floats  # the M quantities on both sides, (2, M); NaN without a value
    courses: tuple[str, str]  # the way of particle 0 before and after
    fault: str = ""  # why there is no run on one of the sides, "" if there is

    @property
    def at(self) -> float:
        """The value of the key at the change."""
        return 0.5 * (self.low + self.high)

    @property
    def before(self) -> float:
        """The first quantity on the lower side."""
        return float(self.values[0, 0])

    @property
    def after(self) -> float:
        """The first quantity on the upper side."""
        return float(self.values[1, 0])


@dataclass(frozen=True, eq=False)
class Piece:
    """Ascending values of the key, x (P,), with one course, and the quantities there, (P, M)."""

    x: Floats
    values: Floats
    course: str


@dataclass(frozen=True, eq=False)
class Scan:
    """The whole range: pieces in order, the changes between them, and whether they are complete."""

    pieces: tuple[Piece, ...]
    changes: tuple[Change, ...]
    complete: bool

    @property
    def x(self) -> Floats:
        """All values of the key that were tried, ascending."""
        return np.concatenate([piece.x for piece in self.pieces])

    @property
    def values(self) -> Floats:
        """The quantities there, shape (N, M)."""
        return np.concatenate([piece.values for piece in self.pieces])

    @property
    def size(self) -> float:
        """The largest absolute value of the quantities; 0 without any."""
        return float(np.abs(self.values[np.isfinite(self.values)]).max(initial=0.0))


class _Point(NamedTuple):
    x: float
    values: Floats
    course: str
    fault: str


def scan(evaluate: Evaluator, low: float, high: float, points: int) -> Scan:
    """Try a grid over the range of the evaluator's only key, and locate changes of course.

    Each round halves the intervals in which the course changes. Values on the way are kept: they
    cluster where the function may be steepest, on both sides of a change.
    """
    seen: list[_Point] = []
    new, complete = np.linspace(low, high, points).tolist(), True
    for _ in range(1 + ROUNDS):
        found = evaluate(np.reshape(new, (-1, 1)))
        seen += map(_Point, new, found.values, found.courses, found.faults)
        seen.sort(key=lambda point: point.x)
        around = [(a.x, b.x) for a, b in pairwise(seen) if a.course != b.course]
        complete = len(around) <= MOST_CHANGES
        new = [0.5 * (a + b) for a, b in around[:MOST_CHANGES] if a < 0.5 * (a + b) < b]
        if not new:
            break
    parts = [list(part) for _, part in groupby(seen, lambda point: point.course)]
    wide = [part for part in parts if part[-1].x - part[0].x > SLIVER * (high - low)] or parts[:1]
    pieces = []
    for part in wide:
        x, values, courses, _ = zip(*part, strict=True)
        pieces.append(Piece(np.array(x), np.array(values), courses[0]))
    changes = []
    for (*_, a), (b, *_) in pairwise(wide):
        fault = a.fault if a.course == NO_RUN else b.fault
        sides = np.stack([a.values, b.values])
        changes.append(Change(a.x, b.x, sides, (a.course, b.course), fault))
    return Scan(tuple(pieces), tuple(changes), complete)


CLOSE: Final = 1e-9
"""A smaller value, relative to the size of the two sides, counts as 0: far above rounding (1e-15),
far below any real jump."""

EXACT: Final = 1e-3
"""Share of this that counts as 0 at an end of the range, where no change of sign can be located."""

LIMIT: Final = 100.0
"""The same for the end of a piece, which a function may approach like a square root: at a distance
of one rounding it is still off by the root of a rounding."""

SAME: Final = 1e-8
"""Two roots, or two minima, closer than this share of the range are one."""


def roots(
    found: Scan, function: Function
) -> tuple[list[float], list[tuple[float, float]], list[Change], float]:
    """Find the zeros of the difference of the two quantities of a scan.

    Returns
    -------
    at, everywhere, jumps, nearest
        Values of the key where it is 0, ascending; ranges in which it is 0 throughout; jumps over
        0, which are not solutions; and where it is closest to 0, NaN if it has no value.
    """
    brentq, zero = scipy("optimize").brentq, CLOSE * found.size
    ends, width = (found.x[0], found.x[-1]), float(np.ptp(found.x))
    at: list[float] = []
    everywhere: list[tuple[float, float]] = []
    jumps = []
    for change in found.changes:
        before, after = change.values[:, 0] - change.values[:, 1]
        if before * after < 0.0 and min(abs(before), abs(after)) > zero:
            jumps.append(change)
    least, nearest = np.inf, np.nan
    for piece in found.pieces:
        first, last = piece.x[[0, -1]].tolist()
        flat, rest = _flat(piece.x, piece.values[:, 0] - piece.values[:, 1], zero)
        everywhere += flat
        for x, f in (_turning(*part, function) for part in rest):
            size = np.abs(f)
            if np.nanmin(size, initial=np.inf) < least:
                least, nearest = float(np.nanmin(size)), float(x[np.nanargmin(size)])
            small = np.full(len(x), zero)
            for border in (0, -1):
                small[border] *= EXACT if x[border] in ends else LIMIT
            # Locate zeros next to a change of sign.
            signs, lone = np.sign(f), np.ones(len(x), dtype=bool)
            crossing = np.flatnonzero(signs[:-1] * signs[1:] < 0.0)
            lone[crossing] = lone[crossing + 1] = False
            met = x[(f == 0.0) | (size <= small) & lone].tolist()
            for low, high in zip(x[crossing].tolist(), x[crossing + 1].tolist(), strict=True):
                # It accepts no absolute tolerance of 0, and no relative one below four roundings.
                xtol, rtol = np.spacing(max(abs(low), abs(high))), 4.0 * np.finfo(float).eps
                met.append(brentq(function, low, high, xtol=xtol, rtol=rtol, maxiter=300))
            for root in met:
                if abs(function(root)) <= zero * (LIMIT if root in (first, last) else 1.0):
                    at.append(root)
                    continue
                # The bracket contains a jump, though the course does not change.
                step = 1e-12 * max(abs(root), last - first)
                low, high = np.clip([root - step, root + step], first, last).tolist()
                sides = np.array([[function(low)], [function(high)]])
                jumps.append(Change(low, high, sides, (piece.course, piece.course)))
    distinct: list[float] = []
    for root in sorted(at):
        if distinct and root - distinct[-1] <= SAME * width:
            # The same root, found from two sides.
            distinct[-1] = min(distinct[-1], root, key=lambda x: abs(function(x)))
        else:
            distinct.append(root)
    jumps.sort(key=lambda jump: jump.low)
    return distinct, everywhere, jumps, nearest


def _flat(
    x: Floats, f: Floats, zero: float
) -> tuple[list[tuple[float, float]], list[tuple[Floats, Floats]]]:
    """Split off runs of three or more points at which the function is 0."""
    flat: list[tuple[float, float]] = []
    rest, start = [], 0
    edges = np.flatnonzero(np.diff(np.abs(f) <= zero, prepend=False, append=False))
    for first, last in edges.reshape(-1, 2).tolist():
        if last - first >= 3:
            flat.append((float(x[first]), float(x[last - 1])))
            rest.append((x[start:first], f[start:first]))
            start = last
    rest.append((x[start:], f[start:]))
    return flat, [part for part in rest if len(part[0])]


def _turning(x: Floats, f: Floats, function: Function) -> tuple[Floats, Floats]:
    """Add the points between which the function comes closest to 0 without a change of sign.

    It may touch 0 there, or cross it twice.
    """
    points = dict(zip(x.tolist(), f.tolist(), strict=True))
    for i in range(len(x)):
        near = slice(max(i - 1, 0), i + 2)
        size, sign = np.abs(f[near]), float(np.sign(f[i]))
        if (np.sign(f[near]) == sign).all() and abs(f[i]) == size.min() < size.max():
            low, high = x[near][0], x[near][-1]
            place, value = bounded(function, low, high, sign)
            points.setdefault(place, sign * value)
    ascending = np.array(sorted(points.items()))
    return ascending[:, 0], ascending[:, 1]


Place = Literal["inside", "end", "change"]
"""Kind of a minimum: with a slope of 0 or a kink; at an end of the range, where the function still
falls; or at a change of course."""

APART: Final = 1e-6
"""Points closer than this share of the range are not compared: next to a change of course they
cluster, and differ only by rounding."""

EVEN: Final = 1e-12
"""A smaller relative change over the whole range counts as none."""


class Least(NamedTuple):
    """A local minimum: its place, value and kind."""

    at: float
    value: float
    place: Place


def minima(found: Scan, function: Function, sign: float = 1.0) -> tuple[Least, ...]:
    """Return the local minima of the quantity of a scan, the least of all first.

    With a sign of -1.0 the maxima, with negated values.
    """
    low, high = found.x[0], found.x[-1]
    step = EVEN * found.size

    def rounded(values: Floats) -> Floats:
        # Rounded, so that a level function has no minima.
        return sign * (np.round(values / step) * step if step > 0.0 else values)

    beyond = {}
    for change in found.changes:
        before, after = rounded(change.values[:, 0])
        beyond[change.low], beyond[change.high] = after, before
    out = []
    for piece in found.pieces:
        kept = [0]
        for i in range(1, len(piece.x) - 1):
            if min(piece.x[i] - piece.x[kept[-1]], piece.x[-1] - piece.x[i]) > APART * (high - low):
                kept.append(i)
        kept += [len(piece.x) - 1] if len(piece.x) > 1 else []
        x, f = piece.x[kept], rounded(piece.values[kept, 0])
        around = np.concatenate([[np.inf], f, [np.inf]])
        for i in range(len(x)):
            # The first point of a level stretch represents it; if the function is lower on the
            # other side of a change, there is no minimum.
            if not around[i] > f[i] <= around[i + 2] or f[i] > beyond.get(x[i], np.inf):
                continue
            inside = 0 < i < len(x) - 1
            kind: Place = "inside" if inside else "end" if x[i] in (low, high) else "change"
            one = Least(float(x[i]), float(f[i]), kind)
            if len(x) > 1:
                a, b = x[max(i - 1, 0)], x[min(i + 1, len(x) - 1)]
                place, value = bounded(function, a, b, sign)
                # The minimiser never reaches an end itself, so only a true minimum is lower than
                # the end.
                if value < one.value - (0.0 if inside else step):
                    one = Least(place, value, "inside")
            out.append(one)
    distinct: list[Least] = []
    for one in sorted(out, key=lambda least: least.value):
        if all(abs(one.at - other.at) > SAME * (high - low) for other in distinct):
            distinct.append(one)
    return tuple(distinct)


def level(found: Scan) -> bool:
    """Whether the quantity is constant over the whole range."""
    values = found.values[:, 0]
    values = values[np.isfinite(values)]
    return bool(len(values)) and float(np.ptp(values)) <= EVEN * float(np.abs(values).max())
