"""Searches over several keys, and among streams, which differ from seed to seed.

Without chance a global search is followed by a local one: `least`, and `constrained` with limits.
With chance, `search`: each variant is run with some seeds, the same for all. A Gaussian process is
fitted to each number in question (scikit-learn: its regression takes the noise of the means, and it
is well maintained). The next variants are the answers of random functions that the fit considers
likely (Thompson sampling): they are spread over the range as long as little is known, and gather at
the answer. The error of the answer is the spread of such answers, and of answers from means over
redrawn seeds (bootstrap), which contains the error common to all variants.

Alternatives: `scikit-optimize` is archived, `noisyopt` dates from 2017; `Py-BOBYQA`, `cma`, Optuna
and `bayesian-optimization` minimise one function, without an error of the place, while targets and
limits are three functions or more; BoTorch needs PyTorch.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any, Final, NamedTuple

import numpy as np

from chutelab.studies.design.evaluation import Evaluator, Span, scipy
from chutelab.studies.sweep.rows import mean_and_error
from chutelab.util.arrays import Floats
from chutelab.util.errors import library

PENALTY: Final = 10.0
"""Penalty for missing a target or limit by its own spread over the range, in spreads of the
objective: more than the objective can gain."""


@dataclass(frozen=True)
class Wishes:
    """Targets, limits and objective for the quantities of a variant, M numbers for each of S seeds.

    Attributes
    ----------
    targets : tuple of (int, int)
        Pairs of quantities that should be equal in the mean.
    limits : tuple of (int, float)
        Quantities whose mean should be at least a number; ``~index`` (negative): at most.
    objective : int or None
        The quantity to be minimised.
    sign, deviations : float
        1 to minimise, -1 to maximise; standard deviations of one run that are added.
    """

    targets: tuple[tuple[int, int], ...] = ()
    limits: tuple[tuple[int, float], ...] = ()
    objective: int | None = None
    sign: float = 1.0
    deviations: float = 0.0

    def columns(self, values: Floats) -> Floats:
        """Return the columns to be judged, (..., C), from values (..., S, M).

        Differences of targets, margins of limits, and the objective; the last column is the share
        of seeds with all quantities, less a half.
        """
        seeds = np.moveaxis(values, -2, 0)
        mean, error = mean_and_error(seeds)
        found = [mean[..., left] - mean[..., right] for left, right in self.targets]
        for n, limit in self.limits:
            found.append(mean[..., n] - limit if n >= 0 else limit - mean[..., ~n])
        if self.objective is not None:
            best = self.sign * mean[..., self.objective]
            if self.deviations:
                count = np.isfinite(seeds[..., self.objective]).sum(axis=0)
                best = best + self.deviations * np.sqrt(count) * error[..., self.objective]
            found.append(best)
        found.append(np.isfinite(values).all(axis=-1).mean(axis=-1) - 0.5)
        return np.stack(found, axis=-1)

    def missed(self, columns: Floats, sizes: Floats) -> Floats:
        """Return the miss of each target and limit, (..., T + L + 1), in `sizes`."""
        off = columns / sizes
        count = len(self.targets)
        kept = [*range(count, count + len(self.limits)), -1]
        return np.concatenate([np.abs(off[..., :count]), np.maximum(0.0, -off[..., kept])], axis=-1)

    def merit(self, columns: Floats, sizes: Floats) -> Floats:
        """Return the merit (least at the answer), (...); infinite without a number."""
        missed = self.missed(columns, sizes)
        if self.objective is None:
            found = np.sum(missed**2, axis=-1)
        else:
            found = columns[..., -2] / sizes[-2] + PENALTY * np.sum(missed, axis=-1)
        return np.where(np.isfinite(found), found, np.inf)


def spreads_of(columns: Floats) -> Floats:
    """Return the spread of each column over some variants, (C,); 1 if it is constant."""
    finite = np.isfinite(columns)
    found = np.array(
        [
            one[known].std() if known.any() else 0.0
            for one, known in zip(columns.T, finite.T, strict=True)
        ]
    )
    return np.where(
        found > 1e-12 * np.max(np.abs(np.where(finite, columns, 0.0)), axis=0), found, 1.0
    )


NEEDS: Final = "Searches of streams need scikit-learn"

DRAWS: Final = 64
"""Draws of functions and of seeds from which errors are computed."""

CLOUD: Final = 400
"""Points among which the answer of a draw is searched."""

FIRST: Final = 8
"""First variants per key, spread over the range."""

BATCH: Final = 6
"""Variants that are then run together."""

ENOUGH: Final = 0.0025
"""Error of the answer, as a share of each range, at which the search ends."""

ZOOMS: Final = 10
"""Number of clouds, each around the best point of the one before."""


class Found(NamedTuple):
    """The answer, (K,), its error, and the variants (N, K) with values (N, S, M)."""

    at: Floats
    error: Floats
    points: Floats
    values: Floats
    elsewhere: float  # share of draws with an answer elsewhere
    quantities: Sequence[tuple[float, float]]  # each quantity there, mean over seeds, and its error


class Fit:
    """Fit to variants at `shares` of the ranges, (N, K), with values (N, S, M)."""

    def __init__(
        self, shares: Floats, values: Floats, wishes: Wishes, random: np.random.Generator
    ) -> None:
        self.wishes, self.random, self.seeds, self.done = wishes, random, values.shape[1], False
        columns = wishes.columns(values)
        self.sizes = spreads_of(columns)
        self.redrawn = random.integers(self.seeds, size=(DRAWS, self.seeds))
        again = np.stack([wishes.columns(values[:, one]) for one in self.redrawn])
        self.models = [
            Model(shares, columns[:, n], again[..., n], self.seeds) for n in range(columns.shape[1])
        ]

    def of_means(self, values: Floats) -> tuple[Floats, Floats]:
        """Return the means of a quantity (N, S) over seeds, (N,), and over redrawn ones."""
        mean, _ = mean_and_error(values.T)
        return mean, mean_and_error(np.moveaxis(values[:, self.redrawn], -1, 0))[0].T

    def merit(self, of: Sequence[Floats]) -> Floats:
        """Return the merit of points, (..., P), from their columns one by one."""
        return self.wishes.merit(np.stack(of, axis=-1), self.sizes)

    def best(self, keys: int) -> tuple[Floats, Floats, Floats]:
        """Return the answer, its error, and likely points in the whole range, (n, K)."""
        few = sqrt(self.seeds / (self.seeds - 1)) if self.seeds > 1 else 1.0
        everywhere = self.random.random((CLOUD, keys))
        centre = everywhere[
            np.argmin(self.merit([model.mean(everywhere) for model in self.models]))
        ]
        # The cloud is twice as wide as the spread of its answers, in each direction.
        shape, error = np.diag(np.full(keys, 0.25**2)), np.ones(keys)
        for _ in range(ZOOMS):
            steps = self.random.standard_normal((CLOUD, keys)) @ np.linalg.cholesky(shape).T
            cloud = np.clip(centre + steps, 0.0, 1.0)
            cloud[0] = centre
            centre = cloud[np.argmin(self.merit([model.mean(cloud) for model in self.models]))]
            known, seeds = (
                cloud[np.argmin(self.merit(of), axis=-1)] - centre
                for of in (
                    [model.draws(cloud, DRAWS, self.random) for model in self.models],
                    [model.redrawn(cloud) for model in self.models],
                )
            )
            parts = [np.sqrt(np.mean(one**2, axis=0)) for one in (known, few * seeds)]
            error = np.maximum(*parts)
            apart = np.concatenate([known, few * seeds])
            shape = 0.06 * shape + 4.0 * apart.T @ apart / len(apart)
            shape[np.diag_indices_from(shape)] += 1e-14
        wide = np.concatenate([everywhere, cloud])
        open_ = [model.draws(wide, DRAWS, self.random) for model in self.models]
        # More variants do not help if the error comes from the seeds.
        self.done = bool(np.all((error <= ENOUGH) | (parts[0] <= 0.5 * parts[1])))
        return centre, error, wide[np.argmin(self.merit(open_), axis=-1)]


class Model:
    """A Gaussian process through one column, (N,), and the same of redrawn seeds, (B, N)."""

    def __init__(self, shares: Floats, column: Floats, again: Floats, seeds: int) -> None:
        known = np.isfinite(column) & np.isfinite(again).all(axis=0)
        self.level = float(column[known].mean()) if known.any() else np.nan
        self.size = float(column[known].std()) if known.any() else 0.0
        self.fitted: Any = None
        if known.sum() < 2 or self.size <= 1e-12 * float(np.max(np.abs(column[known]))):
            return
        process = library("sklearn.gaussian_process", NEEDS, "design")
        kernels = process.kernels
        y, redrawn = ((one - self.level) / self.size for one in (column[known], again[:, known]))
        # The part common to all variants is not noise of the fit, but an error of its level.
        own = redrawn - y
        own = own - own.mean(axis=1, keepdims=True)
        noise = float(np.mean(own**2)) * (seeds / (seeds - 1) if seeds > 1 else 1.0)
        self.noise = max(noise, 1e-8)
        shape = kernels.Matern(np.full(shares.shape[1], 0.5), (0.05, 20.0), nu=2.5)
        self.fitted = process.GaussianProcessRegressor(
            kernels.ConstantKernel(1.0, (0.05, 400.0)) * shape, alpha=self.noise
        )
        with warnings.catch_warnings():
            # A length at its bound means that the column does not depend on the key.
            warnings.simplefilter("ignore")
            self.fitted.fit(shares[known], y)
        self.redrawn_weights = scipy("linalg").cho_solve((self.fitted.L_, True), redrawn.T)

    def mean(self, places: Floats) -> Floats:
        """Return the most likely values at points (P, K), (P,)."""
        if self.fitted is None:
            return np.full(len(places), self.level)
        return np.asarray(self.level + self.size * self.fitted.predict(places))

    def draws(self, places: Floats, count: int, random: np.random.Generator) -> Floats:
        """Return random functions of the fit at points (P, K): (count, P)."""
        if self.fitted is None:
            return np.full((count, len(places)), self.level)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warns of variances below 0 by rounding
            mean, spread = self.fitted.predict(places, return_cov=True)
        spread[np.diag_indices_from(spread)] += 1e-8
        root = np.linalg.cholesky(spread)
        found = mean + random.standard_normal((count, len(places))) @ root.T
        return np.asarray(self.level + self.size * found)

    def redrawn(self, places: Floats) -> Floats:
        """Return the fit through each redrawn set of seeds, (B, P)."""
        if self.fitted is None:
            return np.full((DRAWS, len(places)), self.level)
        found = self.fitted.kernel_(places, self.fitted.X_train_) @ self.redrawn_weights
        return np.asarray(self.level + self.size * found.T)

    def at(self, place: Floats) -> tuple[float, float]:
        """Return the number at a place (K,), and its error."""
        if self.fitted is None:
            return self.level, 0.0
        mean, error = self.fitted.predict(place[np.newaxis], return_std=True)
        seeds = self.redrawn(place[np.newaxis]).std()
        return self.level + self.size * float(mean[0]), max(
            self.size * float(error[0]), float(seeds)
        )


def search(
    evaluate: Evaluator, wishes: Wishes, ranges: Sequence[Span], seeds: int, most: int, seed: int
) -> Found:
    """Return the best point for the wishes, after at most `most` variants or when time is up."""
    library("sklearn.gaussian_process", NEEDS, "design")
    random, keys = np.random.default_rng(seed), len(ranges)
    low, width = np.array([(one.low, one.width) for one in ranges]).T
    high = low + width
    power = max(3, (min(FIRST * keys, most) - 1).bit_length())
    nexts = scipy("stats.qmc").Sobol(keys, seed=random).random_base2(power)[:most]
    shares, values = np.empty((0, keys)), np.empty((0, seeds, len(evaluate.quantities)))
    # With matrices of some hundred rows threads only wait for each other, which takes ten times as
    # long.
    with library("threadpoolctl", NEEDS, "design").threadpool_limits(1):
        while True:
            new = evaluate.seeds(np.clip(low + nexts * width, low, high), seeds)
            # If time is up, some have not run.
            ran = evaluate.ran
            shares = np.concatenate([shares, nexts[ran]])
            values = np.concatenate([values, new[ran]])
            known = np.flatnonzero(np.isfinite(wishes.columns(values)).all(axis=1))
            ends = evaluate.stopped is not None or len(shares) >= most
            if ends and len(known) < 2:
                # No fit: return the only variant that is known.
                at, error = shares[known].sum(axis=0), np.full(keys, 0.5 if len(known) else np.nan)
                means = zip(*mean_and_error(values[known].sum(axis=0)), strict=True)
                points = np.clip(low + shares * width, low, high)
                told = [(float(mean), float(own)) for mean, own in means]
                return Found(low + at * width, error * width, points, values, 0.0, told)
            try:
                fit = Fit(shares, values, wishes, random)
                at, error, open_ = fit.best(keys)
            except KeyboardInterrupt as interrupt:
                if evaluate.stopped is not None:
                    raise
                # Fit once more, to report the results so far.
                evaluate.stopped, nexts = interrupt, nexts[:0]
                continue
            if ends:
                break
            nexts = open_[: min(BATCH, most - len(shares))]
            if fit.done:
                # Beside a jump, such as where a plate is no longer met, a fit overshoots; so the
                # answer is a place where variants have run.
                if np.any(np.all(np.abs(shares - at) <= error + BESIDE, axis=1)):
                    break
                nexts = at[np.newaxis]
        apart = np.any(np.abs(open_ - at) > 5.0 * error + BESIDE, axis=1)
        points = np.clip(low + shares * width, low, high)
        reports = [
            Model(shares, *fit.of_means(values[..., n]), seeds).at(at)
            for n in range(values.shape[2])
        ]
    return Found(low + at * width, error * width, points, values, float(apart.mean()), reports)


BESIDE: Final = 0.02
"""Share of a range; two places that are no further apart are told as one."""


NOWHERE: Final = 1e30
"""Value of a variant without the quantity: worse than any other, but finite."""


POPULATION: Final = 12
"""Variants of a generation per key: enough to find a basin of a few per cent of the range."""


GENERATIONS: Final = 60
"""Most generations; the local search finds the last digits."""


SIMPLEX: Final = {"xatol": 1e-12, "fatol": 1e-15, "maxiter": 600, "adaptive": True}


def within(ranges: Sequence[Span], shares: Floats) -> Floats:
    """Return points (N, K) of ranges at shares of their widths."""
    low, high = np.array([(one.low, one.high) for one in ranges]).T
    # By rounding low + share * width may pass the end, which a scene would refuse.
    return np.asarray(np.clip(low + shares * (high - low), low, high))


def global_least(function: Callable[[Floats], Floats], keys: int, seed: int) -> Any:
    """Search a unit cube for the minimum of a function of columns, (K, N) to (N,)."""
    return scipy("optimize").differential_evolution(
        function, [(0.0, 1.0)] * keys, seed=seed, popsize=POPULATION, maxiter=GENERATIONS,
        tol=1e-8, atol=1e-12, init="sobol", polish=False, vectorized=True, updating="deferred",
    )  # fmt: skip


def least(
    function: Callable[[Floats], Floats], ranges: Sequence[Span], seed: int, *, squares: bool
) -> tuple[Floats, float]:
    """Return the minimum of a function of several keys: its place, (K,), and value.

    It takes points (N, K) and returns (N, 1), NaN without a value. With `squares` it returns (N,
    R), and the sum of squares is minimised: the local search is then a least-squares one, which
    finds the last digits.
    """
    optimize = scipy("optimize")

    def scaled(shares: Floats) -> Floats:
        return within(ranges, shares)

    def values(columns: Floats) -> Floats:
        found = function(scaled(np.atleast_2d(columns.T)))
        found = np.sum(found**2, axis=1) if squares else found[:, 0]
        return np.where(np.isfinite(found), found, NOWHERE)

    searched = global_least(values, len(ranges), seed)
    if searched.fun >= NOWHERE:
        return searched.x, np.nan
    if squares:
        polished = optimize.least_squares(
            lambda point: np.nan_to_num(function(scaled(point[np.newaxis]))[0], nan=1e6),
            searched.x, bounds=(0.0, 1.0), xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale=1.0,
            jac="3-point", diff_step=1e-6, max_nfev=60,
        )  # fmt: skip
    else:
        polished = optimize.minimize(
            lambda point: float(values(point)[0]), searched.x, method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * len(ranges), options=SIMPLEX,
        )  # fmt: skip
    at = np.clip(polished.x, 0.0, 1.0)
    value = float(values(at)[0])
    if value < searched.fun:
        return scaled(at), value
    return scaled(searched.x), float(searched.fun)


def constrained(
    columns: Callable[[Floats], Floats], wishes: Wishes, ranges: Sequence[Span], seed: int
) -> tuple[Floats, float]:
    """Return the best point for several wishes, (K,), and by how much they are missed.

    `columns` takes points (N, K) and returns `Wishes.columns`. A global search with penalties is
    followed by sequential quadratic programming.
    """
    optimize = scipy("optimize")

    def scaled(shares: Floats) -> Floats:
        return within(ranges, shares)

    spread = scipy("stats.qmc").Sobol(len(ranges), seed=seed).random_base2(6)
    sizes = spreads_of(columns(scaled(spread)))

    def merit(shares: Floats) -> Floats:
        found = wishes.merit(columns(scaled(np.atleast_2d(shares.T))), sizes)
        return np.where(np.isfinite(found), found, NOWHERE)

    searched = global_least(merit, len(ranges), seed)
    if searched.fun >= NOWHERE:
        return searched.x, np.nan
    count = len(wishes.targets)

    def part(start: int, stop: int) -> Callable[[Floats], Floats]:
        def of(shares: Floats) -> Floats:
            found = columns(scaled(shares[np.newaxis]))[0] / sizes
            return np.asarray(np.nan_to_num(found[start:stop], nan=NOWHERE))

        return of

    rules = [{"type": "eq", "fun": part(0, count)}] * bool(count)
    rules += [{"type": "ineq", "fun": part(count, count + len(wishes.limits))}] * bool(
        wishes.limits
    )
    least_of = part(-2, -1)
    polished = optimize.minimize(
        lambda shares: float(least_of(shares)[0]) if wishes.objective is not None else 0.0,
        searched.x, method="SLSQP", bounds=[(0.0, 1.0)] * len(ranges), constraints=rules,
        options={"ftol": 1e-14, "eps": 1e-7, "maxiter": 200},
    )  # fmt: skip
    # A limit kept to rounding is kept; of two such points the lower one counts.
    tried = np.stack([np.clip(polished.x, 0.0, 1.0), searched.x])
    found = columns(scaled(tried))
    missed = wishes.missed(found, sizes).max(axis=-1)
    best = int(np.argmin(np.where(missed <= KEPT, wishes.merit(found, sizes), np.inf)))
    if missed[best] > KEPT:
        best = int(np.argmin(np.nan_to_num(missed, nan=np.inf)))
    return scaled(tried[best]), float(missed[best])


KEPT: Final = 1e-6
"""A smaller miss of a target or limit, in its spread over the range, counts as none."""
