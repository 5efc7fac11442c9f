"""SciPy's bracketed root finder and bounded minimiser, set to the last bits of the key."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.design.errors import scipy

if TYPE_CHECKING:
    from collections.abc import Callable

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
