"""Arithmetic on one number, or on one for each of many variants, with the same result to the bit.

A plain number stays a plain number, for which Python is several times as fast as NumPy. Functions
that are not rounded correctly, such as the cosine, are Python's for every element of an array too:
NumPy's may differ from them in the last place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

Value = Any
"""A float, or an array (N,); truths likewise."""


def each(function: Callable[[float], float], value: Value) -> Value:
    """Apply a function of one number.

    >>> each(math.cos, 0.0), each(math.cos, np.array([0.0, 0.0]))
    (1.0, array([1., 1.]))
    """
    if not isinstance(value, np.ndarray):
        return function(value)
    # Grids repeat their values.
    distinct, place = np.unique(value, return_inverse=True)
    return np.array([function(x) for x in distinct.tolist()], dtype=np.float64)[place]


def root(value: Value) -> Value:
    """Return the square root.

    >>> root(4.0), root(np.array([4.0]))
    (2.0, array([2.]))
    """
    return np.sqrt(value) if isinstance(value, np.ndarray) else math.sqrt(value)


def where(condition: Value, yes: Value, no: Value) -> Value:
    """Return the one or the other.

    >>> where(True, 1.0, 2.0), where(np.array([True, False]), 1.0, 2.0)
    (1.0, array([1., 2.]))
    """
    if isinstance(condition, np.ndarray):
        return np.where(condition, yes, no)
    return yes if condition else no


def larger(a: Value, b: Value) -> Value:
    """Return the larger of two."""
    return where(a >= b, a, b)


def smaller(a: Value, b: Value) -> Value:
    """Return the smaller of two."""
    return where(a <= b, a, b)


def ratio(a: Value, b: Value) -> Value:
    """Return a / b; inf for a positive number over 0, NaN for 0 over 0.

    >>> ratio(1.0, 0.0), ratio(1.0, np.array([0.0, 2.0]))
    (inf, array([inf, 0.5]))
    """
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.divide(a, b)
    if b != 0.0:
        return a / b
    return math.inf if a > 0.0 else math.nan


def some(condition: Value) -> bool:
    """Tell whether it is true anywhere.

    >>> some(False), some(np.array([False, True]))
    (False, True)
    """
    return bool(condition.any()) if isinstance(condition, np.ndarray) else bool(condition)


def at(value: Value, place: int) -> Value:
    """Return the number of one variant.

    >>> at(2.0, 1), at(np.array([1.0, 3.0]), 1)
    (2.0, 3.0)
    """
    return value[place].item() if isinstance(value, np.ndarray) else value


def of(value: Value, places: Any) -> Value:
    """Return the numbers of some variants, or the number of all.

    >>> of(2.0, [1]), of(np.array([1.0, 3.0]), [1])
    (2.0, array([3.]))
    """
    return value[places] if isinstance(value, np.ndarray) else value
