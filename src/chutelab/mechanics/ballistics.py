"""Motion with constant acceleration: when a gap closes, in forms that keep their digits.

A gap is a polynomial in time, positive while two things are apart. Only the crossing from positive
to negative is a contact; the other one is a departure.
"""

from __future__ import annotations

from itertools import pairwise
from math import comb

import numpy as np
from numpy.typing import ArrayLike

from chutelab.util.arrays import Floats, Numbers

ITERATIONS = 120
"""Bound on the refinements of a root: Newton's method takes about 8, a double root by halving up to
this many."""

BERNSTEIN = np.array(
    [[comb(j, i) / comb(4, i) for i in range(5)] for j in range(5)], dtype=np.float64
)
"""Takes the coefficients of a quartic on [0, 1] to its Bernstein form, which bounds it."""


def descent(gap: Numbers, rate: Numbers, acceleration: Numbers) -> Floats:
    """Return when gap + rate t + acceleration t²/2 crosses zero downwards; NaN or ∓inf if never.

    A parabola crosses any level downwards at most once, with derivative -S, where
    S² = rate² - 2 acceleration gap. Of the two forms of that root the one without cancellation
    is taken: 2 gap / (S - rate) while closing, -(rate + S) / acceleration while opening. Without
    a crossing S is not a number or a denominator is missing, for which NumPy warns, unless told.

    Parameters
    ----------
    gap, rate, acceleration : float, or ndarray
        m, m/s, m/s²; broadcast together.

    Returns
    -------
    ndarray
        s; may be negative where the crossing lies in the past.

    Examples
    --------
    >>> float(descent(0.5, 0.0, -9.81)) == (2 * 0.5 / 9.81) ** 0.5
    True
    """
    span = np.abs(rate) + np.sqrt(rate * rate - (acceleration + acceleration) * gap)
    opening = rate > 0.0
    numerator = gap + gap
    if np.count_nonzero(opening):
        t = np.where(opening, span, numerator) / np.where(opening, -acceleration, span)
    else:
        t = numerator / span
    flat = span == 0.0
    if np.count_nonzero(flat):
        # Neither gap nor rate: it closes at once if it is pulled.
        t = np.asarray(t)
        t[flat & (gap == 0.0) & (acceleration < 0.0)] = 0.0
    return np.asarray(t)


def descents(coefficients: Floats, until: Floats) -> Floats:
    """Return each t in (0, until] where a polynomial of degree up to 4 becomes negative.

    The stationary points of each derivative split the time axis into pieces on which the next one
    down is monotonic, so no root is missed or mistaken for another. Touching zero
    without crossing is not a contact.

    Parameters
    ----------
    coefficients : ndarray, (5, k)
        Constant term first.
    until : ndarray, (k,)
        Finite end of the search.

    Returns
    -------
    ndarray, (4, k)
        In the order of time; inf where there is none.
    """
    found = np.full((4, coefficients.shape[1]), np.inf)
    until = np.asarray(until, dtype=np.float64)
    scaled = coefficients * until ** np.arange(5)[:, None]
    # A polynomial lies above the smallest of its Bernstein coefficients.
    open_ = np.flatnonzero((BERNSTEIN @ scaled < 0.0).any(axis=0))
    if not len(open_):
        return found
    coefficients, until = coefficients[:, open_], until[open_]
    derivatives = [coefficients]
    for _ in range(3):
        powers = np.arange(1, len(derivatives[-1]))[:, None]
        derivatives.append(derivatives[-1][1:] * powers)
    zero = np.zeros(len(open_))
    knots = [zero, until]
    for derivative in reversed(derivatives[1:]):
        knots = [zero, *(_crossing(derivative, a, b) for a, b in pairwise(knots)), until]
    # At 0 it may be 0 and go either way.
    before = polynomial(coefficients, zero) < 0.0
    for n, (a, b) in enumerate(pairwise(knots)):
        after = polynomial(coefficients, b) < 0.0
        falls = after & ~before
        if falls.any():
            found[n, open_] = np.where(falls, _crossing(coefficients, a, b), np.inf)
        before = after
    return found


def polynomial(coefficients: Floats, t: ArrayLike) -> Floats:
    """Evaluate polynomials (constant term first along axis 0) at t by Horner's rule."""
    t = np.asarray(t, dtype=np.float64)
    value = np.zeros(np.broadcast_shapes(coefficients.shape[1:], t.shape))
    for c in coefficients[::-1]:
        value = value * t + c
    return value


def _crossing(coefficients: Floats, low: Floats, high: Floats) -> Floats:
    """Return where a polynomial, monotonic on each [low, high], changes sign, or `high`.

    Newton's method kept inside a shrinking bracket, halving where it would leave it.
    """
    at_low, at_high = polynomial(coefficients, low), polynomial(coefficients, high)
    sign = np.where(at_high < at_low, 1.0, -1.0)
    out = np.where(sign * at_low <= 0.0, low, high)
    which = np.flatnonzero((sign * at_high < 0.0) & (sign * at_low > 0.0))
    if not len(which):
        return out
    c, low, high = sign[which] * coefficients[:, which], low[which], high[which]
    slope = c[1:] * np.arange(1, len(c))[:, None]
    t = 0.5 * (low + high)
    for _ in range(ITERATIONS):
        value, rate = polynomial(c, t), polynomial(slope, t)
        low, high = np.where(value >= 0.0, t, low), np.where(value >= 0.0, high, t)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = t - value / rate
        inside = (newton > low) & (newton < high)
        new = np.where(inside, newton, np.where(value == 0.0, t, 0.5 * (low + high)))
        done = np.all(np.abs(new - t) <= 2.0**-53 * np.abs(t))
        t = new
        if done:
            break
    out[which] = t
    return out
