"""Several keys at once: a global search with a seed, and a polish.

The search is SciPy's differential evolution, which needs no slopes and goes on over jumps; one
generation of it is one batch of variants. Its result is the same for the same seed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chutelab.design.errors import scipy

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.design.evaluation import Floats

NOWHERE: Final = 1e30
"""Stands for a variant without the quantity: worse than any other, but a number still."""

POPULATION: Final = 12
"""Variants of a generation per key: enough to find a basin of a few per cent of the range."""

GENERATIONS: Final = 60
"""At most; the polish does the last digits."""

SIMPLEX: Final = {"xatol": 1e-12, "fatol": 1e-15, "maxiter": 600, "adaptive": True}


@dataclass(frozen=True, eq=False)
class Found:
    """Where the function is least, in shares of the ranges, 0 to 1, and how much it is."""

    at: Floats
    value: float


def least(
    batch: Callable[[Floats], Floats],
    keys: int,
    seed: int,
    residuals: Callable[[Floats], Floats] | None = None,
) -> Found:
    """Minimise a function over the unit cube.

    Parameters
    ----------
    batch : callable
        Points (N, keys) to values (N,); NaN where there is none.
    keys : int
        Dimensions.
    seed : int
        Of the random draws.
    residuals : callable, optional
        A point (keys,) to residuals whose squares the function is the sum of: the polish then is a
        least-squares one, which gets to the last digits.
    """
    optimize = scipy("optimize")

    def energies(columns: Floats) -> Floats:
        values = batch(np.atleast_2d(columns.T))
        return np.where(np.isfinite(values), values, NOWHERE)

    searched = optimize.differential_evolution(
        energies,
        [(0.0, 1.0)] * keys,
        seed=seed,
        popsize=POPULATION,
        maxiter=GENERATIONS,
        tol=1e-8,
        atol=1e-12,
        init="sobol",
        polish=False,
        vectorized=True,
        updating="deferred",
    )
    best = Found(np.asarray(searched.x, dtype=np.float64), float(searched.fun))
    if best.value >= NOWHERE:
        return Found(best.at, np.nan)
    for polished in _polished(optimize, batch, best, keys, residuals):
        value = float(energies(polished[:, np.newaxis])[0])
        if value < best.value:
            best = Found(polished, value)
    return best


def _polished(
    optimize: Any,
    batch: Callable[[Floats], Floats],
    best: Found,
    keys: int,
    residuals: Callable[[Floats], Floats] | None,
) -> list[Floats]:
    """Return points from which the last digits were looked for."""

    def single(point: Floats) -> float:
        value = float(batch(point[np.newaxis])[0])
        return value if np.isfinite(value) else NOWHERE

    if residuals is not None:

        def safe(point: Floats) -> Floats:
            return np.nan_to_num(residuals(point), nan=1e6)

        solved = optimize.least_squares(
            safe, best.at, bounds=(0.0, 1.0), xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale=1.0,
            jac="3-point", diff_step=1e-6, max_nfev=60,
        )  # fmt: skip
        return [np.clip(solved.x, 0.0, 1.0)]
    simplex = optimize.minimize(
        single, best.at, method="Nelder-Mead", bounds=[(0.0, 1.0)] * keys, options=SIMPLEX
    )
    return [np.clip(simplex.x, 0.0, 1.0)]
