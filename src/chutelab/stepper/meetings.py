"""When disks that all fly with the same acceleration meet: relative to each other, straight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def meeting(x: Floats, y: Floats, u: Floats, v: Floats, reach: float) -> tuple[Floats, Floats]:
    """Return when the distance of disks falls to `reach`, and the speed of approach then.

    Parameters
    ----------
    x, y, u, v : ndarray
        Position and velocity of one disk relative to another, m and m/s.
    reach : float
        Sum of their radii, m.

    Returns
    -------
    t, approach : ndarray
        s, inf if they never meet and 0 if they overlap and approach; m/s.
    """
    closing = -(x * u + y * v)
    # closing² - square gap, without cancellation where they graze.
    across = x * v - y * u
    under = (reach * reach) * (u * u + v * v) - across * across
    t, approach = np.empty(x.shape), np.zeros(x.shape)
    t.fill(np.inf)
    meets = ((closing > 0.0) & (under > 0.0)).nonzero()
    if len(meets[0]):
        xm, ym, closing = x[meets], y[meets], closing[meets]
        gap = xm * xm + ym * ym - reach * reach
        root = np.where(gap > 0.0, np.sqrt(under[meets]), closing)
        # The form of the first root without cancellation.
        t[meets] = np.maximum(gap, 0.0) / (closing + root)
        approach[meets] = root / np.sqrt(reach * reach + np.minimum(gap, 0.0))
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
