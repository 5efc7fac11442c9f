"""`uncertainty`: the effect of uncertain inputs on quantities such as the landing point.

Inputs are checked against the scene before anything runs. Shares of a variance (Sobol indices) are
estimated from three sets of points.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chutelab.scene import AnyScene, Scene, SceneError, load
from chutelab.scene.overrides import limits_of, parts_of, rule_at, value_at
from chutelab.scene.quantities import counted
from chutelab.scene.units import read_size, with_unit
from chutelab.scene.variants import Vary, quantity, reason, refuse_texts
from chutelab.studies.design.evaluation import INSIDE, Evaluator, each_once, measured, scipy
from chutelab.studies.sweep import TOUCHES
from chutelab.studies.sweep.rows import RARE
from chutelab.util.arrays import Floats, Progress
from chutelab.util.errors import InputError
from chutelab.util.files import csv_text
from chutelab.util.tables import Sheet, Shown, frame, plain

RESAMPLES: Final = 200
"""Of the bootstrap, enough for an interval of two digits."""

INTERVAL: Final = (0.025, 0.975)
"""Between these shares of a sample lies its 95 % interval."""


@dataclass(frozen=True, eq=False)
class Indices:
    """Sobol indices of one quantity, arrays of shape (K,) and (K, 2)."""

    # share of the variance that an input explains alone, and with all its interactions
    first: Floats
    total: Floats
    # bootstrap intervals at 95 %
    first_interval: Floats
    total_interval: Floats


def sampled(inputs: int, samples: int, seed: int) -> Floats:
    """Return sets of shares, 0 to 1, for computing a function's indices, (K + 2, N, K).

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

    Values may be NaN. `scipy.stats.sobol_indices` needs a value for every sample, and a power of 2
    of them. Its bootstrap has no seed, and takes time and memory proportional to the square of the
    samples: 3.1 s for 4096 of three inputs, against 0.1 s here.
    """
    # A point is left out of all sets if any of them has no value there.
    sets = sets[:, np.isfinite(sets).all(axis=0)]
    count = sets.shape[1]
    if count < 2:
        none = np.full((len(sets) - 2, 2), np.nan)
        return Indices(none[:, 0], none[:, 0], none, none)
    first, total = _estimates(sets)
    draws = np.random.default_rng(seed).integers(0, count, size=(RESAMPLES, count))
    again = np.array([_estimates(sets[:, rows]) for rows in draws])
    spans = np.quantile(again, INTERVAL, axis=0)
    return Indices(first, total, spans[:, 0].T, spans[:, 1].T)


def _estimates(sets: Floats) -> tuple[Floats, Floats]:
    (f_a, f_b), f_ab = sets[:2], sets[2:]
    middle, variance = sets[:2].mean(), sets[:2].var()
    if variance <= (1e-14 * np.abs(sets[:2]).max()) ** 2:
        return np.full(len(f_ab), np.nan), np.full(len(f_ab), np.nan)
    # Relative to the mean, so that products lose fewer digits and scatter less.
    saltelli = np.mean((f_b - middle) * (f_ab - f_a), axis=1) / variance
    jansen = 1.0 - 0.5 * np.mean((f_b - f_ab) ** 2, axis=1) / variance
    share = np.clip(jansen, 0.0, 1.0)
    first = share * jansen + (1.0 - share) * saltelli
    total = 0.5 * np.mean((f_a - f_ab) ** 2, axis=1) / variance
    return first, total


ASK: Final = "say what is uncertain, and by how much, such as a restitution of 0.5 by 0.05"

LAWS: Final = ("normal", "uniform")

HOMES: Final = ("plate", "incoming", "outgoing", "particle", "stream")
"""Tables in which a name without a table is searched, in this order."""

MOST: Final = 12
"""Most uncertain inputs at once."""


class Given(NamedTuple):
    """A number of the scene that is not known exactly, as `uncertainty` takes it."""

    key: str  # its table may be left out
    mean: float | str | None  # a text may have a unit; None is the scene's own value
    spread: float | str  # likewise, or in per cent of the mean
    law: str = "normal"  # or uniform: `spread` is the half-width

    @property
    def typed(self) -> str:
        """As on the command line."""
        mean = "" if self.mean is None else self.mean
        law = "" if self.law == "normal" else f":{self.law}"
        return f"--uncertainty {self.key}={mean}±{self.spread}{law}"


@dataclass(frozen=True)
class Spread:
    """A number of the scene that is not known exactly."""

    # its full path, and its unit
    key: str
    unit: str
    # normal: mean and standard deviation. Uniform: middle and half-width.
    mean: float
    spread: float
    law: str  # "normal" or "uniform"
    # the least and the largest value that the scene allows; the distribution is cut there
    low: float
    high: float

    @property
    def whole(self) -> Any:
        """The distribution of SciPy, uncut."""
        stats = scipy("stats")
        if self.law == "uniform":
            return stats.uniform(self.mean - self.spread, 2.0 * self.spread)
        return stats.norm(self.mean, self.spread)

    @property
    def cut(self) -> float:
        """Share of the distribution that the scene does not allow."""
        return float(self.whole.cdf(self.low) + self.whole.sf(self.high))

    def values(self, shares: Floats) -> Floats:
        """Return the quantiles of the (cut) distribution at given shares, 0 to 1."""
        low, high = self.whole.cdf([self.low, self.high])
        # Sobol points begin at 0, where a normal distribution has no value.
        found = self.whole.ppf(low + np.clip(shares, 1e-12, 1.0 - 1e-12) * (high - low))
        # Rounding must not move a value beyond what the scene allows.
        return np.asarray(np.clip(found, self.low, self.high))


def spreads(scene: Scene, asked: Sequence[Given]) -> tuple[Spread, ...]:
    """Return the distributions of inputs; each is tried on the scene."""

    def read(given: Given) -> Spread:
        key, typed = given.key, given.typed
        if given.law not in LAWS:
            known = " and ".join(LAWS)
            raise InputError(f"{given.law} is no distribution here; there are {known}", typed)
        homes = [
            home
            for home in HOMES
            if getattr(scene, home) is not None and key in Scene.tables()[home].model_fields
        ]
        if homes and key not in Scene.model_fields:
            key = f"{homes[0]}.{key}"
        about = quantity(scene, Vary(key, (0.0,), typed))

        def number(value: float | str, unit: str) -> float:
            if not isinstance(value, str):
                return float(value)
            try:
                size, found = read_size(value)
            except ValueError as error:
                raise InputError(f"{value or 'nothing'}: {error}", typed) from None
            if found not in ("", unit):
                allowed = f"it is in {unit}" if unit else "it is a pure number"
                raise InputError(f"wrong unit in {value}: {allowed}", typed)
            return size

        own, width = value_at(scene, about.path), given.spread
        if given.mean is not None:
            mean = number(given.mean, about.unit)
        elif isinstance(own, (int, float)):
            mean = float(own)
        else:
            raise InputError(f"{about.path} has no value in this scene: give the mean, too", typed)
        if isinstance(width, str) and width.endswith("%"):
            spread = abs(mean) * number(width.removesuffix("%"), "") / 100.0
        else:
            spread = number(width, about.unit)
        if not spread > 0.0:
            raise InputError(f"the spread {width} must be more than 0", typed)
        low, high = limits_of(rule_at(parts_of(about.path)) or {}) or (-np.inf, np.inf)
        for value in (mean, float(np.clip(mean + INSIDE * spread, low, high))):
            try:
                scene.with_values({about.path: value})
            except SceneError as error:
                raise InputError(reason(error), typed) from None
        return Spread(about.path, about.unit, mean, spread, given.law, low, high)

    return each_once("--uncertainty", asked, read, ASK, MOST)


QUANTITIES: Final = ("landing.x", "belt_work")
"""Default quantities for one particle."""

OF_A_STREAM: Final = ("arrival.x.mean", "ledger.by_surface.outgoing.belt_work")
"""Default quantities for several particles; the work counts up to ``run.until``."""

SAMPLES: Final = 1024
"""Samples in each of the K + 2 sets of points: gives indices to about a hundredth."""

NOTHING: Final = 1e-9
"""A smaller share of a distribution is not mentioned."""

FEWEST: Final = 64
MOST_SAMPLES: Final = 1 << 20


@dataclass(frozen=True, eq=False)
class Statistics:
    """Statistics of M quantities over some samples; those without a value do not count."""

    share: float  # of all samples
    # (M,); means and standard deviations; NaN without a single value
    mean: Floats
    deviation: Floats
    interval: Floats  # (M, 2); 95 % intervals


def statistics(outputs: Floats, total: int) -> Statistics:
    """Return the statistics of the quantities in some of a `total` of samples, (n, M)."""
    known = [column[np.isfinite(column)] for column in outputs.T]
    found = [
        (one.mean(), one.std(), *np.quantile(one, INTERVAL)) if len(one) else (np.nan,) * 4
        for one in known
    ]
    mean, deviation, *ends = np.array(found).T
    return Statistics(len(outputs) / total, mean, deviation, np.stack(ends, axis=1))


@dataclass(frozen=True, eq=False, repr=False)
class Uncertainty(Shown):
    """Effect of uncertain inputs: N samples of K inputs and M quantities.

    Attributes
    ----------
    scene : str
        Its title.
    spreads : tuple of Spread
        The inputs.
    quantities, units : tuple of str
        The quantities and their units.
    nominal : ndarray, shape (M,)
        The quantities with all inputs at their means.
    inputs, outputs : ndarray, shape (N, K) and (N, M)
        Samples of the inputs and their results, NaN if they did not happen.
    touches : ndarray of str, shape (N,)
        The kind of each outcome: the surfaces met, see `chutelab.studies.sweep.rows`.
    indices : tuple of Indices
        Of each quantity.
    lost : dict of str
        Reasons why samples lack a value, with the quantities and numbers.
    runs, samples, seed : int
        Variants that were run, samples of each set, and the seed of the points.
    """

    scene: str
    spreads: tuple[Spread, ...]
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    nominal: Floats
    inputs: Floats
    outputs: Floats
    touches: NDArray[Any]
    indices: tuple[Indices, ...]
    lost: dict[str, int]
    runs: int
    samples: int
    seed: int

    @cached_property
    def overall(self) -> Statistics:
        """Statistics of all samples, whatever they touch."""
        return statistics(self.outputs, len(self.outputs))

    @property
    def mean(self) -> Floats:
        """Means of the quantities, (M,); NaN without a single value."""
        return self.overall.mean

    @property
    def deviation(self) -> Floats:
        """Their standard deviations, (M,)."""
        return self.overall.deviation

    @property
    def interval(self) -> Floats:
        """Their 95 % intervals, (M, 2)."""
        return self.overall.interval

    @cached_property
    def kinds(self) -> dict[str, Statistics]:
        """Statistics of each kind of outcome, the most frequent one first."""
        counts = Counter(self.touches.tolist())
        return {
            kind: statistics(self.outputs[self.touches == kind], len(self.outputs))
            for kind, _ in sorted(counts.items(), key=lambda item: (-item[1], item[0]))
        }

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Inputs, outputs and touched surfaces by name, (N,) each."""
        names = (*(one.key for one in self.spreads), *self.quantities, TOUCHES)
        return dict(zip(names, (*self.inputs.T, *self.outputs.T, self.touches), strict=True))

    def frame(self) -> Any:
        """Return inputs and outputs as a pandas DataFrame; ImportError without pandas."""
        return frame(self.columns)

    def csv(self) -> str:
        """Return inputs and outputs as CSV; an empty cell is a sample without the quantity."""
        return csv_text(self.columns)

    def sheet(self) -> Sheet:
        """Return mean, interval and indices of each quantity."""
        given = ", ".join(
            f"{one.key} = {one.mean:g} ± {one.spread:g} {one.unit}".rstrip()
            + (" uniform" if one.law == "uniform" else "")
            for one in self.spreads
        )
        columns = ["", *(with_unit(n, u) for n, u in zip(self.quantities, self.units, strict=True))]
        nominal = tuple(f"{value:.6g}" for value in self.nominal)
        rows = [("all inputs at their means", *nominal), *_lines(self.overall)]
        foot: list[tuple[str, ...]] = []
        for k, one in enumerate(self.spreads):
            cells = []
            for about in self.indices:
                share, low, high = 100.0 * np.array([about.first[k], *about.first_interval[k]])
                known = np.isfinite(share)
                cells.append(f"{share:.1f} % ({low:.0f} .. {high:.0f})" if known else "-")
            foot.append((f"share of {one.key}", *cells))
        if len(self.kinds) > 1:
            for kind, found in self.kinds.items():
                if found.share > RARE:
                    foot += [(f"{100.0 * found.share:.1f} % touch {kind}",), *_lines(found)]
        return Sheet(
            f"{self.scene}: {given}", tuple(columns), tuple(rows), foot=tuple(foot),
            notes=tuple(self.notes()),
        )  # fmt: skip

    def notes(self) -> list[str]:
        """Return remarks on the numbers, in sentences."""
        said = [
            "Each ± is a standard deviation, of a uniform input the half-width.",
            "Shares are first-order Sobol indices, the part of the variance that an input explains"
            " alone, with their 95 % intervals.",
        ]
        said += [
            f"{100.0 * one.cut:.2g} % of {one.key} = {one.mean:g} ± {one.spread:g} lies outside"
            f" what is allowed, {one.low:g} to {one.high:g}: its distribution is cut there."
            for one in self.spreads
            if one.cut > NOTHING
        ]
        rare = [one.share for one in self.kinds.values() if one.share <= RARE]
        often = len(self.kinds) - len(rare)
        if len(self.kinds) == 1:
            said.append(f"All samples touch {', '.join(self.kinds)}.")
        elif often > 1:
            said.append(
                f"These are {often} kinds of outcome: the mean over all of them need not be near to"
                " any, and the shares above are of the variance between them, too."
            )
        if rare and len(self.kinds) > 1:
            others = f"{len(rare)} other ways" if len(rare) > 1 else "another way"
            said.append(f"{100.0 * sum(rare):.2g} % of the samples go {others}.")
        for name in self.quantities:
            if until := counted(name):
                said.append(f"{name} is counted {until}.")
        total = len(self.inputs)
        for why, count in sorted(self.lost.items(), key=lambda item: -item[1])[:3]:
            said.append(f"{count} of {total} samples are left out: {why}.")
        for name, found in zip(self.quantities, self.indices, strict=True):
            if np.isnan(found.first).all() and np.isfinite(self.outputs).any():
                said.append(f"{name} does not depend on these inputs.")
        return said


def _lines(found: Statistics) -> list[tuple[str, ...]]:
    return [
        ("mean", *(f"{value:.6g}" for value in found.mean)),
        ("standard deviation", *(f"{value:.3g}" for value in found.deviation)),
        ("95 % interval", *(f"{low:.5g} .. {high:.5g}" for low, high in found.interval)),
    ]


def uncertainty(
    scene: AnyScene,
    given: Sequence[Given] | Mapping[str, Sequence[Any]],
    quantities: Sequence[str] | None = None,
    *,
    samples: int = SAMPLES,
    seed: int = 0,
    progress: Progress | None = None,
) -> Uncertainty:
    """Propagate uncertain inputs through a scene.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        What `chutelab.load` takes.
    given : mapping, or sequence of Given
        ``{KEY: (MEAN, SPREAD)}``: numbers, or texts with a unit; MEAN may be None, the scene's own
        value, and SPREAD in per cent of it. SPREAD is a standard deviation, or with "uniform" as a
        third entry a half-width.
    quantities : sequence of str
        Names, see `chutelab.scene.quantities`; default: `QUANTITIES`, or `OF_A_STREAM`.
    samples : int
        Points of each of the K + 2 sets, a power of 2 (else the next one is taken).
    seed : int
        Of the Sobol points.
    progress : callable, optional
        Called with the share that is done.

    Raises
    ------
    InputError
        If the question makes no sense for the scene. Nothing has run then.
    ImportError
        Without SciPy.

    Examples
    --------
    >>> found = uncertainty(
    ...     "perpendicular", {"restitution": (0.5, 0.05), "plate.distance": (None, "1%")},
    ...     ["landing.x"], samples=64,
    ... )
    >>> bool(found.indices[0].first[0] > found.indices[0].first[1])
    True
    """
    scene = load(scene)
    refuse_texts(given, "--uncertainty", '{"plate.restitution": (0.5, 0.05)}')
    if isinstance(given, Mapping):
        given = [Given(key, *entries) for key, entries in given.items()]
    inputs = spreads(scene, given)
    if quantities is None:
        quantities = QUANTITIES if scene.count == 1 else OF_A_STREAM
    names = list(dict.fromkeys(quantities))
    wanted = [measured(scene, name, f"quantity {name}") for name in names]
    if not wanted:
        raise InputError("name at least one, such as landing.x", "quantities")
    if not FEWEST <= samples <= MOST_SAMPLES:
        raise InputError(f"must be from {FEWEST} to {MOST_SAMPLES}", f"samples {samples}")
    if seed < 0:
        raise InputError("must be a whole number from 0", f"seed {seed}")
    samples = 1 << (int(samples) - 1).bit_length()
    runs = samples * (len(inputs) + 2) + 1
    evaluate = Evaluator(scene, [one.key for one in inputs], wanted, progress, runs)
    nominal = evaluate(np.array([[one.mean for one in inputs]])).values[0]
    shares = sampled(len(inputs), samples, seed).reshape(-1, len(inputs))
    points = np.column_stack(
        [one.values(column) for one, column in zip(inputs, shares.T, strict=True)]
    )
    outcomes = evaluate(points)
    used = 2 * samples
    missing = np.flatnonzero(~np.isfinite(outcomes.values[:used]).all(axis=1))
    lost: Counter[str] = Counter()
    for i in missing.tolist():
        absent = [name for name, x in zip(names, outcomes.values[i], strict=True) if np.isnan(x)]
        why = f"no {' and no '.join(absent)} (touches {outcomes.courses[i]})"
        lost[outcomes.faults[i] or why] += 1
    return Uncertainty(
        scene.title, inputs, tuple(names), tuple(one.unit for one in wanted), nominal,
        points[:used], outcomes.values[:used], np.array(outcomes.touches[:used], dtype=object),
        tuple(
            indices(sets, seed)
            for sets in outcomes.values.T.reshape(len(wanted), -1, samples)
        ),
        dict(lost), evaluate.runs, samples, seed,
    )  # fmt: skip


def as_dict(found: Uncertainty) -> dict[str, Any]:
    """Return the result as plain lists and floats, for JSON; without the samples."""
    inputs = ("key", "unit", "mean", "spread", "law", "cut")

    def told_of(one: Statistics, m: int) -> dict[str, Any]:
        return {of: getattr(one, of)[m] for of in ("mean", "deviation", "interval")}

    told = {
        "format": 1,
        "scene": found.scene,
        "inputs": [{name: getattr(one, name) for name in inputs} for one in found.spreads],
        "quantities": {
            name: {
                "unit": found.units[m],
                "nominal": found.nominal[m],
                **told_of(found.overall, m),
                "first": found.indices[m].first,
                "total": found.indices[m].total,
            }
            for m, name in enumerate(found.quantities)
        },
        "touches": {
            kind: {
                "share": one.share,
                "quantities": {
                    name: told_of(one, m)
                    for m, name in enumerate(found.quantities if one.share > RARE else ())
                },
            }
            for kind, one in found.kinds.items()
        },
        "lost": found.lost,
        "runs": found.runs,
        "samples": found.samples,
        "seed": found.seed,
    }
    return dict(plain(told))
