"""Lines through measured points on logarithmic axes: slopes, exponents, times at an error."""

from __future__ import annotations

from math import exp, log
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chutelab.workprecision.records import Record, Size

    Point = tuple[float, float]

ROUNDING = 1e-13
"""Errors below this are rounding: they do not follow the parameter any more."""

LEAST_SPAN = 3.0
"""Ratio of the largest to the smallest of the abscissae that a line is fitted through."""

SHARE = 0.5
"""Part of the sizes, the largest ones, to which an exponent is fitted; overheads rule the rest."""


def points(records: Sequence[Record], case: str, method: str) -> list[Point]:
    """Return (error, median time) of a method's runs that succeeded."""
    return [
        (one.error, one.median)
        for one in records
        if (one.case, one.method) == (case, method)
        and one.error is not None
        and one.median is not None
    ]


def slope(xy: Sequence[Point]) -> float | None:
    """Return the exponent p of y ∝ x^p by least squares in the logarithms.

    None through fewer than two points, or where x spans less than `LEAST_SPAN`.
    """
    if len(xy) < 2:
        return None
    x, y = np.array(xy, dtype=np.float64).T
    if x.min() <= 0.0 or x.max() < LEAST_SPAN * x.min():
        return None
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def work_slope(records: Sequence[Record], case: str, method: str) -> float | None:
    """Return p of time ∝ error^p: -1 where ten times the accuracy costs ten times the time."""
    return slope([(e, t) for e, t in points(records, case, method) if e > ROUNDING])


def order(records: Sequence[Record], case: str, method: str) -> float | None:
    """Return the order p of a method in a case: error ∝ parameter^p."""
    return slope(
        [
            (one.value, one.error)
            for one in records
            if (one.case, one.method) == (case, method)
            and one.value is not None
            and one.error is not None
            and one.error > ROUNDING
        ]
    )


def exponent(sizes: Sequence[Size], case: str, method: str, what: str = "median") -> float | None:
    """Return p of time (or memory) ∝ particles^p, fitted to the larger `SHARE` of the sizes."""
    xy = sorted(
        (float(one.particles), float(getattr(one, what)))
        for one in sizes
        if (one.case, one.method) == (case, method) and getattr(one, what) is not None
    )
    return slope(xy[-max(2, round(SHARE * len(xy))) :])


def time_at(xy: Sequence[Point], error: float) -> float | None:
    """Return the time (s) in which an error is reached; None if it never is.

    Only points count that no other beats in both; between two neighbours the line is straight on
    logarithmic axes. Where even the fastest point is better, its time is the answer.
    """
    front: list[Point] = []
    for e, t in sorted(xy, key=lambda point: (point[1], point[0])):
        if not front or e < front[-1][0]:
            front.append((e, t))
    if not front or front[-1][0] > error:
        return None
    if front[0][0] <= error:
        return front[0][1]
    after = next(k for k, (e, _) in enumerate(front) if e <= error)
    (e0, t0), (e1, t1) = front[after - 1], front[after]
    # An error of 0 has no logarithm; smaller than the smallest rounding it makes no difference.
    low = max(e1, 1e-300)
    share = (log(error) - log(e0)) / (log(low) - log(e0))
    return exp(log(t0) + share * (log(t1) - log(t0)))
