"""Where a function of one key is least: over the whole range, jumps and ends included."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from chutelab.design.roots import SAME
from chutelab.design.scalar import bounded

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.design.evaluation import Floats
    from chutelab.design.pieces import Scan

    Function = Callable[[float], float]

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
    return _distinct(sorted(out, key=lambda least: least.value), high - low)


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


def _distinct(sorted_minima: list[Least], width: float) -> tuple[Least, ...]:
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
