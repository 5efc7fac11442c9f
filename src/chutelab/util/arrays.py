"""Types of arrays and callbacks; sine, cosine and their inverses; bisection.

Those of libraries differ in the last bit. These use only + - * / and square roots: the same bits
everywhere, also in the core, whose ``trig.c`` (used by the page, too) has the same operations in
the same order. The polynomials are those of fdlibm (Sun Microsystems, 1993), which are free to use.
All take numbers or arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

Numbers = Floats | float
"""A number, or an array (N,) where a family of scenes differs in it."""

Progress = Callable[[float], None]
"""Called now and then with the share of the work that is done, 0 to 1. One that an engine calls may
raise `results.recorder.EnoughError`: the run ends there, with what is recorded."""

Watch = Callable[[], None]
"""Called now and then in work that may take long; an exception that it raises ends the work."""


def unwatched() -> None:
    """Do nothing: the work goes on however long it takes."""


def put(rows: NDArray[Any], places: Ints, values: NDArray[Any]) -> None:
    """Put records at some places, as bytes: fifty times as fast as field by field."""
    items = rows.view(f"V{rows.itemsize}")
    np.put(items, places, values.view(items.dtype))


def sorted_by(numbers: Ints, most: int) -> Ints:
    """Return the order that sorts numbers from 0 to `most`; fast if two bytes hold them."""
    return np.argsort(numbers.astype(np.min_scalar_type(most)), kind="stable")


def begins(numbers: Ints, most: int) -> Ints:
    """Return for each of some numbers from 0 to `most`, in order, where those equal to it begin.

    >>> begins(np.array([0, 0, 2, 2, 2]), 3)
    array([0, 0, 2, 2, 2])
    """
    sizes = np.bincount(numbers, minlength=most)
    found: Ints = (sizes.cumsum() - sizes)[numbers]
    return found


RADIANS = np.pi / 180.0
"""Of one degree."""

LARGEST_ANGLE = 1e6
"""rad; for larger angles π/2 in three parts of 33 bits is no longer subtracted exactly."""

_ROUND = 1.5 * 2.0**52
"""Adding and subtracting it rounds to a whole number."""

_QUARTERS = 6.36619772367581382433e-01  # 2/π
_PART1, _PART2, _PART3, _REST = (
    1.57079632673412561417e00, 6.07710050630396597660e-11,
    2.02226624871116645580e-21, 8.47842766036889956997e-32,
)  # fmt: skip
_S1, _S2, _S3, _S4, _S5, _S6 = (
    -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
    2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10,
)  # fmt: skip
_C1, _C2, _C3, _C4, _C5, _C6 = (
    4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
    -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11,
)  # fmt: skip
_A0, _A1, _A2, _A3, _A4, _A5, _A6, _A7, _A8, _A9, _A10 = (
    3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01,
    -1.11111104054623557880e-01, 9.09088713343650656196e-02, -7.69187620504482999495e-02,
    6.66107313738753120669e-02, -5.83357013379057348645e-02, 4.97687799461593236017e-02,
    -3.65315727442169155270e-02, 1.62858201153657823623e-02,
)  # fmt: skip

# Angles and their rounding errors as doubles: the arc tangent of 1/2, π/4, π/2 and π.
_HALF, _HALF_LOW = 4.63647609000806093515e-01, 2.26987774529616870924e-17
_EIGHTH, _EIGHTH_LOW = 7.85398163397448278999e-01, 3.06161699786838301793e-17
_QUARTER, _QUARTER_LOW = 1.57079632679489655800e00, 6.12323399573676603587e-17
_STRAIGHT, _STRAIGHT_LOW = 3.14159265358979311600e00, 1.22464679914735317723e-16


def sin_cos(angle: Any) -> tuple[Any, Any]:
    """Return sine and cosine, each to less than 1 unit in the last place.

    Parameters
    ----------
    angle : float or ndarray
        rad; the result is NaN beyond `LARGEST_ANGLE`.

    Examples
    --------
    >>> float(sin_cos(0.5 * np.pi)[1])
    6.123233995736766e-17
    """
    if isinstance(angle, np.ndarray) and angle.size == 1:
        sine, cosine = sin_cos(float(angle.item()))
        return np.full(angle.shape, sine)[()], np.full(angle.shape, cosine)[()]
    if isinstance(angle, float):
        # The same operations in a twentieth of the time.
        if not abs(angle) <= LARGEST_ANGLE:
            return np.float64(np.nan), np.float64(np.nan)
        sine, cosine, turns = _within_a_quarter(float(angle))
        turned = (sine, cosine, -sine, -cosine, sine)
        quarter = int(turns) & 3
        return np.float64(turned[quarter]), np.float64(turned[quarter + 1])
    angle = np.where(np.abs(angle) <= LARGEST_ANGLE, angle, np.nan)[()]
    sine, cosine, turns = _within_a_quarter(angle)
    quarter = turns - 4.0 * np.floor(0.25 * turns)
    odd = (quarter == 1.0) | (quarter == 3.0)
    up, across = np.where(odd, cosine, sine), np.where(odd, sine, cosine)
    return (
        np.where(quarter >= 2.0, -up, up)[()],
        np.where((quarter == 1.0) | (quarter == 2.0), -across, across)[()],
    )


def _within_a_quarter(angle: Any) -> tuple[Any, Any, Any]:
    """Return sine and cosine of an angle less quarter turns, and their number."""
    turns = (angle * _QUARTERS + _ROUND) - _ROUND
    # The rest as the sum of x and a tail, without cancellation of its leading digits.
    first = angle - turns * _PART1
    second = first - turns * _PART2
    lost = (first - second) - turns * _PART2
    third = second - turns * _PART3
    tail = lost + ((second - third) - turns * _PART3) - turns * _REST
    x = third + tail
    tail = (third - x) + tail
    z = x * x
    w = z * z
    v = z * x
    r = _S2 + z * (_S3 + z * _S4) + z * w * (_S5 + z * _S6)
    sine = x - ((z * (0.5 * tail - v * r) - tail) - v * _S1)
    r = z * (_C1 + z * (_C2 + z * _C3)) + w * w * (_C4 + z * (_C5 + z * _C6))
    half = 0.5 * z
    one = 1.0 - half
    return sine, one + (((1.0 - one) - half) + (z * r - x * tail)), turns


def atan2(y: Any, x: Any) -> Any:
    """Return the angle of a vector from the x axis, to 1.5 units in the last place.

    Parameters
    ----------
    y, x : float or ndarray
        Finite; the sign of a zero does not matter, and the vector (0, 0) has the angle 0.

    Returns
    -------
    float or ndarray
        rad, more than -π, at most π.
    """
    up, across = np.abs(y), np.abs(x)
    steep, back = up > across, x < 0.0
    low, high = np.where(steep, across, up), np.where(steep, up, across)
    middle, most = low > 0.4375 * high, low > 0.6875 * high
    at = np.where(middle, np.where(most, 1.0, 0.5), 0.0)
    t = (low - at * high) / np.where(high == 0.0, 1.0, high + at * low)
    angle = np.where(middle, np.where(most, _EIGHTH, _HALF), 0.0)
    rest = np.where(middle, np.where(most, _EIGHTH_LOW, _HALF_LOW), 0.0)
    base = np.where(steep, _QUARTER, np.where(back, _STRAIGHT, 0.0))
    lack = np.where(steep, _QUARTER_LOW, np.where(back, _STRAIGHT_LOW, 0.0))
    # base + lack + sign (angle + rest + the arc tangent of t), rounded once
    sign = np.where(steep != back, -1.0, 1.0)
    z = t * t
    w = z * z
    odd = z * (_A0 + w * (_A2 + w * (_A4 + w * (_A6 + w * (_A8 + w * _A10)))))
    even = w * (_A1 + w * (_A3 + w * (_A5 + w * (_A7 + w * _A9))))
    part = sign * angle
    whole = base + part
    lost = part - (whole - base)
    turned = whole + (((lost + lack) + sign * rest) + sign * (t - t * (odd + even)))
    return np.where(y < 0.0, -turned, turned)[()]


def arc_cos(cosine: Any) -> Any:
    """Return the angle from 0 to π (rad) of a cosine, to 2.5 units in the last place, or NaN."""
    square = (1.0 - cosine) * (1.0 + cosine)
    return atan2(np.sqrt(np.where(square >= 0.0, square, np.nan)), cosine)


def hypot(x: Any, y: Any) -> Any:
    """Return the length of a vector whose squares neither overflow nor vanish."""
    return np.sqrt(x * x + y * y)


def bisected(test: Callable[[float], object], low: float, high: float) -> tuple[float, float]:
    """Return neighbouring values with a test false and true; it is true at `high`."""
    least = 1e-15 * high
    while low < (middle := 0.5 * (low + high)) < high and high - low > least:
        low, high = (low, middle) if test(middle) else (middle, high)
    return low, high
