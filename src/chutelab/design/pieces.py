"""A function of one key, cut into pieces on which it is smooth.

It is looked at on an even grid. Where two neighbours have different courses (the plate is missed,
another surface is struck first), the place of the change is closed in on, down to neighbouring
floating-point numbers: a jump is then between two pieces, never inside one.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from chutelab.design.evaluation import NO_RUN

if TYPE_CHECKING:
    from chutelab.design.evaluation import Evaluator, Floats

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
