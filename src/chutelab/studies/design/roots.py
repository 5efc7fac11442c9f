"""Roots and minima of a function of one key over a range.

The function is cut into pieces on which it is smooth. Every root on a piece is found, and none is
reported that is only a jump between two pieces; minima include jumps and the ends of the range.
SciPy's bracketed root finder and bounded minimiser do the work on a piece.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from chutelab.studies.design.evaluation import NO_RUN, Evaluator
from chutelab.studies.design.quantities import scipy
from chutelab.util.arrays import Floats

Function = Callable[[float], float]


def bracketed(function: Function, low: float, high: float) -> float:
    """Return a root between two values at which the function has different signs."""
    # brentq takes no absolute width of 0, and no relative one below four roundings.
    width = float(np.spacing(max(abs(low), abs(high))))
    rtol = 4.0 * float(np.finfo(float).eps)
    found = scipy("optimize").brentq(function, low, high, xtol=width, rtol=rtol, maxiter=300)
    return float(found)


def bounded(function: Function, low: float, high: float) -> tuple[float, float]:
    """Return where a function is least between two values, and how much it is there.

    Near a smooth minimum the place is only known to about the square root of a rounding, because
    the function does not change over it.
    """
    options = {"xatol": 1e-10 * (high - low), "maxiter": 200}
    found = scipy("optimize").minimize_scalar(
        function, bounds=(float(low), float(high)), method="bounded", options=options
    )
    return float(found.x), float(found.fun)


MOST_CHANGES: Final = 24
"""Changes of course that are closed in on; a range with more of them is too wide to be understood,
and what is left stays between two points of the grid."""

SLIVER: Final = 1e-9
"""Share of the range below which a course is none of its own: a clipped edge, or rounding."""

ROUNDS: Final = 60
"""Halvings that bring any interval down to neighbouring numbers, 2⁻⁵³ of its ends, and some."""


@dataclass(frozen=True, eq=False)
class Change:
    """Two neighbouring values of the key between which the course changes.

    Attributes
    ----------
    low, high : float
        The values, as close as numbers get.
    before, after : float
        The quantity there; NaN where it has no value.
    courses : tuple of str
        The way of particle 0 before and after.
    fault : str
        Why there is no run on one of the sides, "" if there is.
    """

    low: float
    high: float
    before: float
    after: float
    courses: tuple[str, str]
    fault: str = ""

    @property
    def at(self) -> float:
        """The value of the key, either side of which is meant."""
        return 0.5 * (self.low + self.high)


@dataclass(frozen=True, eq=False)
class Piece:
    """Values of the key, ascending, with one course, and the quantities there.

    Attributes
    ----------
    x : ndarray, shape (P,)
        The key.
    values : ndarray, shape (P, M)
        The quantities.
    course : str
        The way of particle 0.
    """

    x: Floats
    values: Floats
    course: str


@dataclass(frozen=True, eq=False)
class Scan:
    """The whole range: `pieces` in order, and the `changes` between them.

    Attributes
    ----------
    complete : bool
        Whether all changes were closed in on.
    """

    pieces: tuple[Piece, ...]
    changes: tuple[Change, ...]
    complete: bool

    @property
    def ends(self) -> tuple[float, float]:
        """The range."""
        return float(self.pieces[0].x[0]), float(self.pieces[-1].x[-1])

    @property
    def x(self) -> Floats:
        """All values of the key that were looked at, ascending."""
        return np.concatenate([piece.x for piece in self.pieces])

    @property
    def values(self) -> Floats:
        """The quantities there, shape (N, M)."""
        return np.concatenate([piece.values for piece in self.pieces])


@dataclass(frozen=True, eq=False)
class _Point:
    x: float
    values: Floats
    course: str
    fault: str


def scan(evaluate: Evaluator, low: float, high: float, points: int) -> Scan:
    """Look at a range of the evaluator's only key.

    Parameters
    ----------
    evaluate : Evaluator
        Of one key. Changes are those of its first quantity.
    low, high : float
        The range.
    points : int
        Of the grid, at least 3.
    """
    grid = np.linspace(low, high, points)
    found = _at(evaluate, grid)
    every = [found[0]]
    changes = 0
    complete = True
    for point in found[1:]:
        while every[-1].course != point.course:
            if changes >= MOST_CHANGES:
                complete = False
                break
            changes += 1
            first, second, between = _closed(evaluate, every[-1], point)
            every += [*between, first]
            if second.x == point.x:
                break
            every.append(second)
        every.append(point)
    parts = _parts(sorted({point.x: point for point in every}.values(), key=lambda point: point.x))
    wide = [part for part in parts if part[-1].x - part[0].x > SLIVER * (high - low)] or parts[:1]
    pieces = [
        Piece(
            np.array([point.x for point in part]),
            np.array([point.values for point in part]),
            part[0].course,
        )
        for part in wide
    ]
    seams = [_change(before[-1], after[0]) for before, after in pairwise(wide)]
    return Scan(tuple(pieces), tuple(seams), complete)


def _parts(points: list[_Point]) -> list[list[_Point]]:
    """Split points where the course changes."""
    parts: list[list[_Point]] = []
    for point in points:
        if parts and parts[-1][-1].course == point.course:
            parts[-1].append(point)
        else:
            parts.append([point])
    return parts


def _at(evaluate: Evaluator, x: Floats) -> list[_Point]:
    outcomes = evaluate(x[:, np.newaxis])
    return [
        _Point(float(value), outcomes.values[i], outcomes.courses[i], outcomes.faults[i])
        for i, value in enumerate(x)
    ]


def _closed(
    evaluate: Evaluator, first: _Point, second: _Point
) -> tuple[_Point, _Point, list[_Point]]:
    """Return the last point with the course of the first, the one after it, and those on the way.

    The latter crowd where the function may be steepest, on both sides of the change.
    """
    goal, seen = second.course, []
    for _ in range(ROUNDS):
        x = 0.5 * (first.x + second.x)
        if not first.x < x < second.x:
            break
        (middle,) = _at(evaluate, np.array([x]))
        seen.append(middle)
        if middle.course == first.course:
            first = middle
        else:
            second = middle
    if second.course != goal:
        # A third course lies between: what is beyond it is looked at again.
        seen = [point for point in seen if point.x <= first.x]
    return first, second, [point for point in seen if point.course in (first.course, goal)]


def _change(first: _Point, second: _Point) -> Change:
    return Change(
        first.x,
        second.x,
        float(first.values[0]),
        float(second.values[0]),
        (first.course, second.course),
        first.fault if first.course == NO_RUN else second.fault,
    )


CLOSE: Final = 1e-9
"""What counts as 0, relative to the size of the two sides: far above rounding (1e-15), far below
any jump worth the name."""

EXACT: Final = 1e-3
"""Share of that which is 0 at an end of the range, where no change of sign can be closed in on."""

LIMIT: Final = 100.0
"""The same for the end of a piece, to which a function may come as steeply as a square root does: a
rounding from it, it still is the root of a rounding away."""

SAME: Final = 1e-8
"""Share of the range within which two roots are one."""


@dataclass(frozen=True, eq=False)
class Roots:
    """What a range holds.

    Attributes
    ----------
    at : tuple of float
        Values of the key at which the two sides are equal, ascending.
    everywhere : tuple of (float, float)
        Ranges in which they are equal throughout.
    jumps : tuple of Change
        Where one side jumps over the other: no solutions.
    nearest : float
        The value at which they differ least; NaN if they have none anywhere.
    off : float
        By how much they differ there.
    """

    at: tuple[float, ...]
    everywhere: tuple[tuple[float, float], ...]
    jumps: tuple[Change, ...]
    nearest: float
    off: float


def roots(found: Scan, function: Function, scale: float) -> Roots:
    """Find where a function is 0.

    Parameters
    ----------
    found : Scan
        Of two quantities, whose difference the function is.
    function : callable
        The difference of the two at a value of the key.
    scale : float
        Size of the quantities.
    """
    at: list[float] = []
    everywhere: list[tuple[float, float]] = []
    jumps = [
        change
        for change, before, after in _borders(found)
        if before * after < 0.0 and min(abs(before), abs(after)) > CLOSE * scale
    ]
    best = (np.inf, np.nan)
    for piece in found.pieces:
        f = piece.values[:, 0] - piece.values[:, 1]
        flat, rest = _flat(piece.x, f, CLOSE * scale)
        everywhere += flat
        for x, values in rest:
            best = min(best, _least(x, values, function))
            for root in _in_piece(x, values, function, CLOSE * scale, found.ends):
                off = abs(function(root))
                border = root in (piece.x[0], piece.x[-1])
                if off <= CLOSE * scale * (LIMIT if border else 1.0):
                    at.append(root)
                else:
                    jumps.append(_inside(root, function, piece))
    at = _distinct(sorted(at), function, float(np.ptp(found.x)))
    if at:
        best = min((abs(function(root)), root) for root in at)
    return Roots(
        tuple(at), tuple(everywhere), tuple(sorted(jumps, key=lambda jump: jump.low)),
        best[1], best[0],
    )  # fmt: skip


def _borders(found: Scan) -> list[tuple[Change, float, float]]:
    """Return the changes with the function before and after each."""
    out = []
    for change in found.changes:
        sides = []
        for x in (change.low, change.high):
            row = found.values[np.searchsorted(found.x, x)]
            sides.append(float(row[0] - row[1]))
        out.append((change, sides[0], sides[1]))
    return out


def _flat(
    x: Floats, f: Floats, tolerance: float
) -> tuple[list[tuple[float, float]], list[tuple[Floats, Floats]]]:
    """Split off runs of three points and more at which the function is 0 throughout."""
    zero = np.abs(f) <= tolerance
    edges = np.flatnonzero(np.diff(np.concatenate([[False], zero, [False]]).astype(int)))
    flat, rest, start = [], [], 0
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if last - first >= 3:
            flat.append((float(x[first]), float(x[last - 1])))
            rest.append((x[start:first], f[start:first]))
            start = last
    rest.append((x[start:], f[start:]))
    return flat, [(a, b) for a, b in rest if len(a)]


def _least(x: Floats, f: Floats, function: Function) -> tuple[float, float]:
    """Return the least |f| of a piece, and where it is."""
    size = np.abs(f)
    if np.isnan(size).all():
        return np.inf, np.nan
    i = int(np.nanargmin(size))
    best = (float(size[i]), float(x[i]))
    low, high = x[max(i - 1, 0)], x[min(i + 1, len(x) - 1)]
    if low < high and np.isfinite(size[max(i - 1, 0) : i + 2]).all():
        place, least = bounded(lambda value: abs(function(value)), low, high)
        best = min(best, (least, place))
    return best


def _in_piece(
    x: Floats, f: Floats, function: Function, tolerance: float, span: tuple[float, float]
) -> list[float]:
    """Return where a function that is smooth changes sign, or touches 0."""
    ends = [
        i for i in (0, len(x) - 1) if abs(f[i]) <= tolerance * (EXACT if x[i] in span else LIMIT)
    ]
    out = [float(x[i]) for i in {*np.flatnonzero(f == 0.0), *ends}]
    signs = np.sign(f)
    out += [
        bracketed(function, x[i], x[i + 1])
        for i in np.flatnonzero(signs[:-1] * signs[1:] < 0.0).tolist()
    ]
    for i in range(1, len(x) - 1):
        size = np.abs(f[i - 1 : i + 2])
        one_side = bool(np.all(f[i - 1 : i + 2] > 0.0) or np.all(f[i - 1 : i + 2] < 0.0))
        if one_side and size[1] <= size[0] and size[1] <= size[2] and size[1] < size.max():
            out += _touching(function, float(np.sign(f[i])), x[i - 1 : i + 2], tolerance)
    return out


def _touching(function: Function, sign: float, x: Floats, tolerance: float) -> list[float]:
    """Look between three points for a hidden pair of roots, or one where it only touches 0."""
    place, least = bounded(lambda value: sign * function(value), x[0], x[2])
    if least < -tolerance:
        return [bracketed(function, x[0], place), bracketed(function, place, x[2])]
    return [place] if least <= tolerance else []


def _inside(root: float, function: Function, piece: Piece) -> Change:
    """Return the jump that a bracket closed in on, though the course stays."""
    step = 1e-12 * max(abs(root), float(np.ptp(piece.x)))
    low, high = max(root - step, float(piece.x[0])), min(root + step, float(piece.x[-1]))
    return Change(low, high, function(low), function(high), (piece.course, piece.course))


def _distinct(values: list[float], function: Function, width: float) -> list[float]:
    """Keep the best of what is the same root, seen from two sides."""
    out: list[float] = []
    for value in values:
        if out and value - out[-1] <= SAME * width:
            out[-1] = min(out[-1], value, key=lambda x: abs(function(x)))
        else:
            out.append(value)
    return out


Place = Literal["inside", "end", "change"]
"""A minimum with a slope of 0 or a kink; one at an end of the range, where the function still
falls; one where the course changes."""

APART: Final = 1e-6
"""Share of the range within which points are not compared."""

EVEN: Final = 1e-12
"""Relative change over the whole range that is none."""


@dataclass(frozen=True)
class Least:
    """A local minimum: where, how much, and of which kind."""

    at: float
    value: float
    place: Place


def minima(found: Scan, function: Function, sign: float = 1.0) -> tuple[Least, ...]:
    """Return the local minima of a range, the least of all first.

    Parameters
    ----------
    found : Scan
        Of one quantity.
    function : callable
        The quantity at a value of the key.
    sign : float
        -1.0 for maxima, which then are negative.
    """
    out: list[Least] = []
    low, high = found.ends
    largest = np.abs(found.values[np.isfinite(found.values)]).max(initial=0.0)
    step = EVEN * float(largest)
    beyond = _beyond(found, sign, step)
    for piece in found.pieces:
        apart = _apart(piece.x, APART * (high - low))
        x, f = piece.x[apart], sign * _rounded(piece.values[apart, 0], step)
        for i in range(len(x)):
            before = f[i - 1] if i else np.inf
            after = f[i + 1] if i < len(x) - 1 else np.inf
            # The first point of a level stretch stands for all of it.
            if not (f[i] < before and f[i] <= after) or f[i] > beyond.get(x[i], np.inf):
                continue
            if 0 < i < len(x) - 1:
                place, value = bounded(lambda at: sign * function(at), x[i - 1], x[i + 1])
                best = min((value, place), (float(f[i]), float(x[i])))
                out.append(Least(best[1], best[0], "inside"))
            else:
                end = Least(float(x[i]), float(f[i]), "end" if x[i] in (low, high) else "change")
                if len(x) > 1:
                    other = float(x[1] if i == 0 else x[-2])
                    end = _beside(end, other, lambda at: sign * function(at), step)
                out.append(end)
    return _distinct_minima(sorted(out, key=lambda least: least.value), high - low)


def _apart(x: Floats, least: float) -> list[int]:
    """Return which points to look at: both ends, and others that are not too close.

    Next to a change of course points crowd, and differ by nothing but rounding.
    """
    kept = [0]
    for i in range(1, len(x) - 1):
        if x[i] - x[kept[-1]] > least and x[-1] - x[i] > least:
            kept.append(i)
    return [*kept, len(x) - 1] if len(x) > 1 else kept


def _rounded(values: Floats, step: float) -> Floats:
    """Leave out digits in which a level function would have minima of rounding."""
    rounded: Floats = np.round(values / step) * step if step > 0.0 else values
    return rounded


def _beyond(found: Scan, sign: float, step: float) -> dict[float, float]:
    """Return the function on the other side of each change: what is lower there is no minimum."""
    other = {}
    for change in found.changes:
        before, after = _rounded(np.array([change.before, change.after]), step)
        other[change.low], other[change.high] = sign * float(after), sign * float(before)
    return {x: value for x, value in other.items() if np.isfinite(value)}


def _distinct_minima(sorted_minima: list[Least], width: float) -> tuple[Least, ...]:
    out: list[Least] = []
    for one in sorted_minima:
        if all(abs(one.at - other.at) > SAME * width for other in out):
            out.append(one)
    return tuple(out)


def _beside(end: Least, other: float, function: Function, step: float) -> Least:
    """Return the minimum at the end of a piece, or one between it and its neighbour."""
    place, value = bounded(function, min(end.at, other), max(end.at, other))
    # The minimiser never reaches the end itself: only a true minimum is lower than it.
    return Least(place, value, "inside") if value < end.value - step else end


def level(found: Scan) -> bool:
    """Tell whether the quantity is the same over the whole range."""
    values = found.values[:, 0]
    values = values[np.isfinite(values)]
    return bool(len(values)) and float(np.ptp(values)) <= EVEN * float(np.abs(values).max())
