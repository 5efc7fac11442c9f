"""When disks that all fly with the same acceleration meet: relative to each other, straight."""

from __future__ import annotations

from math import inf, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Sequence

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ROUNDING = 1e-9
"""Share by which rounding may hide a meeting from the bound on how fast distances fall."""


def meeting(apart: Floats, reach: float, span: Floats | float) -> tuple[Ints, Floats, Floats]:
    """Return which distances of disks fall to `reach`, when, and the speed of approach then.

    Parameters
    ----------
    apart : ndarray, (4, ...)
        Position x, y and velocity of one disk relative to another, m and m/s.
    reach : float
        Sum of their radii, m.
    span : array_like
        s from now, within which it is asked; broadcast against (...).

    Returns
    -------
    which : ndarray, (k,)
        Flat indices of all that meet within `span`, and of some others.
    t, approach : ndarray, (k,)
        s, 0 if they overlap and approach; m/s.
    """
    x, v, square = apart[:2], apart[2:], reach * reach
    parts, areas, squares = x * v, x * v[::-1], apart * apart
    opening, across = parts[0] + parts[1], areas[0] - areas[1]
    distance, speed = squares[::2] + squares[1::2]
    # opening² - square gap, without cancellation where they graze.
    under = square * speed - across * across
    # No distance falls faster than at first.
    soon = distance + (2.0 + ROUNDING) * span * opening <= square * (1.0 + ROUNDING)
    which = ((opening < 0.0) & (under > 0.0) & soon).ravel().nonzero()[0]
    if not len(which):
        return which, np.empty(0), np.empty(0)
    closing, apart = -opening.take(which), distance.take(which)
    gap = apart - square
    root = np.where(gap > 0.0, np.sqrt(under.take(which)), closing)
    # The form of the first root without cancellation.
    t = np.maximum(gap, 0.0) / (closing + root)
    return which, t, root / np.sqrt(np.minimum(apart, square))


def candidates(apart: Floats, reach: float, span: Floats) -> Ints:
    """Return which distances of disks may fall to `reach`, as `meeting`: all that do, and others.

    For who asks `encounter` then, where few are left.
    """
    x, square = apart[:2], reach * reach
    products = apart.reshape(2, 2, *apart.shape[1:]) * x
    distance, opening = products[:, 0] + products[:, 1]
    # No distance falls faster than at first.
    soon = distance + (2.0 + ROUNDING) * span * opening <= square * (1.0 + ROUNDING)
    return np.asarray(soon.ravel().nonzero()[0])


def encounter(apart: Sequence[float], reach: float) -> tuple[float, float]:
    """Return when one distance falls to `reach`, and the speed of approach then, as `meeting`.

    In plain numbers, for who asks for one after another; inf if it never does.
    """
    x, y, u, v = apart
    opening, square = x * u + y * v, reach * reach
    if opening >= 0.0:
        return inf, 0.0
    across = x * v - y * u
    under = square * (u * u + v * v) - across * across
    if under <= 0.0:
        return inf, 0.0
    distance = x * x + y * y
    if distance > square:
        root = sqrt(under)
        return (distance - square) / (root - opening), root / sqrt(square)
    return 0.0, -opening / sqrt(distance)


def neighbours(low: Floats, high: Floats) -> tuple[Ints, Ints]:
    """Return the pairs of boxes that overlap, swept along x.

    Parameters
    ----------
    low, high : ndarray, (2, n)
        Corners of the boxes, m.

    Returns
    -------
    first, second : ndarray, (k,)
        Indices; each pair once. Time and memory grow with the pairs that overlap along x.
    """
    order = low[0].argsort(kind="stable")
    (left, bottom), (right, top) = low.take(order, axis=1), high.take(order, axis=1)
    begin = np.arange(1, len(order) + 1)
    width = left.searchsorted(right, side="right") - begin
    a = (begin - 1).repeat(width)
    b = (begin - width.cumsum() + width).repeat(width) + np.arange(len(a))
    near = (bottom.take(a) <= top.take(b)) & (bottom.take(b) <= top.take(a))
    return order.take(a.compress(near)), order.take(b.compress(near))
