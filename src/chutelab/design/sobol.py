"""What each uncertain input contributes to a variance, from three sets of points.

A and B are two independent samples; in AB_i the column i of A is that of B. First-order indices
after Saltelli et al. (Comput. Phys. Commun. 181, 259-270, 2010), which scatter least where an index
is small, and after Jansen (Comput. Phys. Commun. 117, 35-43, 1999), which do where it is large;
total ones after Jansen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from chutelab.design.errors import scipy

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

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


def design(inputs: int, samples: int, seed: int) -> tuple[Floats, Floats]:
    """Return A and B, shares 0 to 1 of shape (samples, inputs): scrambled Sobol points.

    Parameters
    ----------
    samples : int
        A power of 2.
    """
    sampler = scipy("stats").qmc.Sobol(d=2 * inputs, scramble=True, seed=seed)
    points = np.asarray(sampler.random_base2(int(samples).bit_length() - 1), dtype=np.float64)
    return points[:, :inputs], points[:, inputs:]


def crossed(a: Floats, b: Floats) -> Floats:
    """Return A with one column of B in turn, shape (inputs, samples, inputs)."""
    every = np.repeat(a[np.newaxis], a.shape[1], axis=0)
    for i in range(a.shape[1]):
        every[i, :, i] = b[:, i]
    return every


def indices(f_a: Floats, f_b: Floats, f_ab: Floats, seed: int) -> Indices:
    """Estimate the indices of a function.

    Parameters
    ----------
    f_a, f_b : ndarray, shape (N,)
        The function at A and B.
    f_ab : ndarray, shape (K, N)
        The function at `crossed` points.
    seed : int
        Of the bootstrap.
    """
    first, total = _estimates(f_a, f_b, f_ab)
    draws = np.random.default_rng(seed).integers(0, len(f_a), size=(RESAMPLES, len(f_a)))
    again = np.array([_estimates(f_a[rows], f_b[rows], f_ab[:, rows]) for rows in draws])
    tails = (0.5 * (1.0 - LEVEL), 0.5 * (1.0 + LEVEL))
    spans = np.quantile(again, tails, axis=0)
    return Indices(first, total, spans[:, 0].T, spans[:, 1].T)


def _estimates(f_a: Floats, f_b: Floats, f_ab: Floats) -> tuple[Floats, Floats]:
    both = np.concatenate([f_a, f_b])
    middle, variance = both.mean(), both.var()
    if variance <= (1e-14 * np.abs(both).max()) ** 2:
        return np.full(len(f_ab), np.nan), np.full(len(f_ab), np.nan)
    # Around the mean: the products lose fewer digits, and scatter less.
    saltelli = np.mean((f_b - middle) * (f_ab - f_a), axis=1) / variance
    jansen = 1.0 - 0.5 * np.mean((f_b - f_ab) ** 2, axis=1) / variance
    share = np.clip(jansen, 0.0, 1.0)
    first = share * jansen + (1.0 - share) * saltelli
    total = 0.5 * np.mean((f_a - f_ab) ** 2, axis=1) / variance
    return first, total
