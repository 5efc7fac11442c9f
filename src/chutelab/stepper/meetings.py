"""When disks that all fly with the same acceleration meet: relative to each other, straight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def meeting(offset: Floats, velocity: Floats, reach: float) -> tuple[Floats, Floats]:
    """Return when |offset + velocity t| falls to `reach`, and the speed of approach then.

    Parameters
    ----------
    offset, velocity : ndarray, (k, 2)
        Of one disk relative to another, m and m/s.
    reach : float
        Sum of their radii, m.

    Returns
    -------
    t, approach : ndarray, (k,)
        s, inf if they never meet and 0 if they overlap and approach; m/s.
    """
    x, y, u, v = offset[:, 0], offset[:, 1], velocity[:, 0], velocity[:, 1]
    closing = -(x * u + y * v)
    gap = x * x + y * y - reach * reach
    square = u * u + v * v
    # closing² - square gap, without cancellation where they graze.
    across = x * v - y * u
    under = np.where(gap > 0.0, reach * reach * square - across * across, closing * closing)
    meets = np.flatnonzero((closing > 0.0) & (under > 0.0))
    t, approach = np.full(len(x), np.inf), np.zeros(len(x))
    if len(meets):
        root = np.sqrt(under[meets])
        # The form of the first root without cancellation.
        t[meets] = np.maximum(gap[meets], 0.0) / (closing[meets] + root)
        approach[meets] = root / np.sqrt(reach * reach + np.minimum(gap[meets], 0.0))
    return t, approach


def neighbours(low: Floats, high: Floats) -> tuple[Ints, Ints]:
    """Return the pairs of boxes that overlap, swept along x.

    Parameters
    ----------
    low, high : ndarray, (n, 2)
        Corners of the boxes, m.

    Returns
    -------
    first, second : ndarray, (k,)
        Indices; each pair once. Time and memory grow with the pairs that overlap along x.
    """
    order = np.argsort(low[:, 0], kind="stable")
    left, right = low[order, 0], high[order, 0]
    end = np.searchsorted(left, right, side="right")
    begin = np.arange(1, len(order) + 1)
    width = np.maximum(end - begin, 0)
    total = int(width.sum())
    a = np.repeat(np.arange(len(order)), width)
    b = np.arange(total) - np.repeat(np.cumsum(width) - width, width) + a + 1
    a, b = order[a], order[b]
    near = (low[a, 1] <= high[b, 1]) & (low[b, 1] <= high[a, 1])
    return a[near], b[near]
