"""How much an answer depends on each key.

Derivatives and what one per cent does, for a solution; shares of a variance (Sobol indices), from
three sets of points, for uncertain inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from chutelab.studies.design.evaluation import Evaluator, Span
from chutelab.studies.design.quantities import scipy
from chutelab.util.arrays import Floats

RESAMPLES: Final = 200
"""Of the bootstrap, enough for an interval of two digits."""

LEVEL: Final = 0.95


@dataclass(frozen=True, eq=False)
class Indices:
    """Sobol indices of one quantity, arrays of shape (K,) and (K, 2).

    Attributes
    ----------
    first, total : ndarray
        Share of the variance that an input explains alone, and with all its interactions.
    first_interval, total_interval : ndarray
        Bootstrap intervals at 95 %.
    """

    first: Floats
    total: Floats
    first_interval: Floats
    total_interval: Floats


def sampled(inputs: int, samples: int, seed: int) -> Floats:
    """Return sets of shares, 0 to 1, at which a function tells its indices, (K + 2, N, K).

    A and B are scrambled Sobol points, whose number N is a power of 2; then A with each of its K
    columns in turn taken from B.
    """
    sampler = scipy("stats").qmc.Sobol(d=2 * inputs, scramble=True, seed=seed)
    points = np.asarray(sampler.random_base2(int(samples).bit_length() - 1), dtype=np.float64)
    a, b = points[:, :inputs], points[:, inputs:]
    sets = np.stack([a, b, *[a] * inputs])
    for i in range(inputs):
        sets[2 + i, :, i] = b[:, i]
    return sets


def indices(sets: Floats, seed: int) -> Indices:
    """Estimate the indices of a function from its values at `sampled` points, (K + 2, N).

    They may be NaN. `scipy.stats.sobol_indices` takes no samples without a value, and a power of 2
    of the others. Its bootstrap has no seed, and takes time and memory with the square of the
    samples: 3.1 s for 4096 of three inputs, against 0.1 s here.
    """
    # A point is left out of all sets if one of them has no value there.
    sets = sets[:, np.isfinite(sets).all(axis=0)]
    count = sets.shape[1]
    if count < 2:
        none = np.full((len(sets) - 2, 2), np.nan)
        return Indices(none[:, 0], none[:, 0], none, none)
    first, total = _estimates(sets)
    draws = np.random.default_rng(seed).integers(0, count, size=(RESAMPLES, count))
    again = np.array([_estimates(sets[:, rows]) for rows in draws])
    spans = np.quantile(again, (0.5 * (1.0 - LEVEL), 0.5 * (1.0 + LEVEL)), axis=0)
    return Indices(first, total, spans[:, 0].T, spans[:, 1].T)


def _estimates(sets: Floats) -> tuple[Floats, Floats]:
    (f_a, f_b), f_ab = sets[:2], sets[2:]
    middle, variance = sets[:2].mean(), sets[:2].var()
    if variance <= (1e-14 * np.abs(sets[:2]).max()) ** 2:
        return np.full(len(f_ab), np.nan), np.full(len(f_ab), np.nan)
    # Around the mean: the products lose fewer digits, and scatter less.
    saltelli = np.mean((f_b - middle) * (f_ab - f_a), axis=1) / variance
    jansen = 1.0 - 0.5 * np.mean((f_b - f_ab) ** 2, axis=1) / variance
    share = np.clip(jansen, 0.0, 1.0)
    first = share * jansen + (1.0 - share) * saltelli
    total = 0.5 * np.mean((f_a - f_ab) ** 2, axis=1) / variance
    return first, total


STEPS: Final = (1e-3, 1e-4, 1e-5, 1e-6)
"""Of a range: over the largest, differences lose fewest digits to rounding, over the smallest they
see least of what bends the function."""

PERCENT: Final = 0.01

ROUNDING: Final = 1e-15
"""Relative error of a quantity: what a difference over a step must stay clear of."""

STEADY: Final = 0.01
"""By how much a one-sided slope may change when its step is halved."""


@dataclass(frozen=True)
class Sensitivity:
    """What a key does to a quantity at a point.

    Attributes
    ----------
    key, unit : str
        What is changed, and its unit.
    quantity, quantity_unit : str
        What changes.
    derivative : float
        In quantity_unit per unit; NaN where the course changes within a millionth of the range.
    step : float
        One per cent of the key's value; of its range, if its value is 0.
    lower, upper : float
        The quantity with the key one `step` less and more; NaN where it has none.
    courses : tuple of str
        The way of particle 0 there.
    """

    key: str
    unit: str
    quantity: str
    quantity_unit: str
    derivative: float
    step: float
    lower: float
    upper: float
    courses: tuple[str, str]


def sensitivities(
    evaluate: Evaluator, ranges: Sequence[Span], at: Floats, columns: Sequence[int]
) -> tuple[Sensitivity, ...]:
    """Return what each key does to some of the evaluator's quantities at a point, (K,)."""
    found = []
    for one, unit in zip(ranges, np.eye(len(at)), strict=True):
        derivative = _derivatives(evaluate, at, unit * one.width)
        step = PERCENT * (float(unit @ np.abs(at)) or one.width)
        sides = evaluate([at - step * unit, at + step * unit])
        for column in columns:
            quantity = evaluate.quantities[column]
            lower, upper = (float(value) for value in sides.values[:, column])
            found.append(
                Sensitivity(
                    one.key, one.unit, quantity.name, quantity.unit, float(derivative[column]),
                    step, lower, upper, (sides.courses[0], sides.courses[1]),
                )
            )  # fmt: skip
    return tuple(found)


def _derivatives(evaluate: Evaluator, at: Floats, along: Floats) -> Floats:
    """Return the derivatives of all quantities by one key; one-sided where the course ends.

    Differences over a step and half of it are extrapolated; of all steps the one counts at which
    the two agree best, since next to a jump the function may bend within any step. `along` is the
    range of the key in its own direction, (K,).
    """
    (here,), (course,), *_ = evaluate(at[np.newaxis])
    steps = np.multiply.outer(STEPS, (1.0, 0.5))
    shares = np.multiply.outer((1.0, -1.0), steps)
    found = evaluate(at + shares.reshape(-1, 1) * along)
    # Both sides, all steps, whole and half: (2, S, 2), and for values the M quantities.
    values = found.values.reshape(*shares.shape, -1)
    usable = (np.array(found.courses) == course).reshape(shares.shape).all(axis=2)
    steps = steps[..., np.newaxis] * along.sum()
    both = usable.all(axis=0)
    if both.any():
        far, half = np.moveaxis((values[0] - values[1])[both] / (2.0 * steps[both]), 1, 0)
        apart = np.abs(half - far) + ROUNDING * np.abs(here) / steps[both, 0]
        best = np.argmin(np.where(np.isfinite(apart), apart, np.inf), axis=0)
        chosen: Floats = np.take_along_axis((4.0 * half - far) / 3.0, best[np.newaxis], axis=0)[0]
        return chosen
    for side, sign in enumerate((1.0, -1.0)):
        if usable[side].any():
            smallest = np.flatnonzero(usable[side])[-1]
            far, half = (values[side, smallest] - here) / (sign * steps[smallest])
            # A slope that depends on the step is none: at a grazing blow it is infinite.
            steady = np.abs(half - far) <= STEADY * np.abs(half)
            slope: Floats = np.where(steady, 2.0 * half - far, np.nan)
            return slope
    return np.full(len(here), np.nan)
