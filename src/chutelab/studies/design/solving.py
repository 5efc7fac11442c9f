"""`solve`, `minimize` and `maximize`: from a question in words to a `Solution`.

One key is solved piece by piece, see `roots`; several keys by a global search with a seed, and a
polish.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, Final, Literal

import numpy as np

from chutelab.scene import Scene
from chutelab.studies.design.answers import Answer, Solution, asked
from chutelab.studies.design.evaluation import Evaluator, ranges
from chutelab.studies.design.quantities import (
    DesignError,
    Quantity,
    Target,
    measured,
    scipy,
    target,
)
from chutelab.studies.design.roots import CLOSE, Change, Scan, level, minima, roots, scan
from chutelab.studies.design.sensitivity import sensitivities
from chutelab.util.arrays import Floats, Progress

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


POINTS: Final = 181
"""Of the scan over one key: a quarter of a second, and half a degree of a plate's angles."""

FEWEST: Final = 3
MOST: Final = 100_001

MORE: Final = 400
"""Variants beyond the scan that a search over one key runs, about; for the progress."""


def solve(
    scene: Scene,
    vary: str | Sequence[str],
    target: str | Sequence[str],
    *,
    points: int = POINTS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Solution:
    """Find the values of some keys for which a quantity is what it should be.

    Parameters
    ----------
    scene : Scene
        From `chutelab.load`.
    vary : str or sequence of str
        ``KEY=FROM:TO``, the keys and the ranges that are searched.
    target : str or sequence of str
        ``QUANTITY=VALUE``: a quantity of the run, and the number, key of the scene or quantity that
        it is to equal. With several keys there may be several targets, up to one a key.
    points : int
        With one key: how many values are looked at first. Two solutions between neighbours are
        found only if the quantity bends visibly between them.
    seed : int
        With several keys: of the global search.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    Solution
        All solutions, with one key. With several keys, one.

    Raises
    ------
    DesignError, VaryError
        If the question makes no sense for the scene. Nothing has run then.
    SceneError
        If the scene itself cannot be run.
    ImportError
        Without SciPy.

    Examples
    --------
    >>> from chutelab.scene import load
    >>> found = solve(load("inclined-20"), "plate.angle_deg=0:60", "landing.vx=1.0")
    >>> round(found.answer.values[0], 6)
    47.254812
    """
    wishes = [target] if isinstance(target, str) else list(target)
    return _Search(scene, vary, points, seed, progress).solve(wishes)


def minimize(
    scene: Scene,
    vary: str | Sequence[str],
    quantity: str,
    *,
    points: int = POINTS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Solution:
    """Find the values of some keys for which a quantity is least.

    Parameters, result and errors are those of `solve`, with a quantity such as ``belt_work`` or
    ``landing.t`` for the target.
    """
    return _Search(scene, vary, points, seed, progress).extremum(quantity, "minimize")


def maximize(
    scene: Scene,
    vary: str | Sequence[str],
    quantity: str,
    *,
    points: int = POINTS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Solution:
    """Find the values of some keys for which a quantity is largest; see `minimize`."""
    return _Search(scene, vary, points, seed, progress).extremum(quantity, "maximize")


class _Search:
    """One question: everything that can be refused is looked at before anything runs."""

    def __init__(
        self,
        scene: Scene,
        vary: str | Sequence[str],
        points: int,
        seed: int,
        progress: Progress | None,
    ) -> None:
        if not FEWEST <= points <= MOST:
            raise DesignError(f"--points {points}", f"must be from {FEWEST} to {MOST}")
        if seed < 0:
            raise DesignError(f"--seed {seed}", "must be a whole number from 0")
        self.scene = scene
        self.ranges = ranges(scene, [vary] if isinstance(vary, str) else list(vary))
        self.points, self.seed, self.progress = points, seed, progress

    def _evaluator(self, quantities: Sequence[Quantity]) -> Evaluator:
        scipy("optimize")
        keys = [one.key for one in self.ranges]
        evaluate = Evaluator(self.scene, keys, quantities, self.progress)
        evaluate.expect(self.points + MORE if len(keys) == 1 else 800 * len(keys))
        return evaluate

    def solve(self, texts: Sequence[str]) -> Solution:
        """Answer `solve`."""
        if not texts:
            raise DesignError("--target", "name at least one, such as landing.vx=outgoing.speed")
        targets = [target(self.scene, text) for text in texts]
        if len(targets) > len(self.ranges):
            raise DesignError(
                f"--target {texts[-1]}",
                f"{len(targets)} targets need as many keys to vary, {len(self.ranges)} given",
            )
        if len({wish.left.key for wish in targets}) < len(targets):
            raise DesignError(f"--target {texts[-1]}", "this quantity has a target already")
        evaluate = self._evaluator([side for wish in targets for side in (wish.left, wish.right)])
        if len(self.ranges) == 1:
            return self._roots(evaluate, targets)
        return self._system(evaluate, targets)

    def _roots(self, evaluate: Evaluator, targets: Sequence[Target]) -> Solution:
        (one,), (wish,) = self.ranges, targets
        seen = scan(evaluate, one.low, one.high, self.points)

        def function(x: float) -> float:
            left, right = evaluate([[x]]).values[0]
            return float(left - right)

        sizes = np.abs(seen.values[np.isfinite(seen.values)])
        found = roots(seen, function, float(sizes.max()) if len(sizes) else 0.0)
        edges = {x for change in seen.changes for x in (change.low, change.high)}
        answers = [
            self._answer(evaluate, np.array([x]), "change" if x in edges else "inside")
            for x in found.at
        ]
        nearest = None
        if not answers and isfinite(found.nearest):
            nearest = self._answer(evaluate, np.array([found.nearest]), "inside")
        own = one.start if one.start is not None else one.low
        best = int(np.argmin([abs(x - own) for x in found.at])) if answers else 0
        if not answers and found.everywhere:
            low, high = found.everywhere[0]
            answers = [self._answer(evaluate, np.array([min(max(own, low), high)]), "inside")]
        return Solution(
            asked("solve", str(wish), self.ranges), "solve", self.ranges, (wish.left.name,),
            (wish.left.unit,), tuple(answers), nearest, found.everywhere, found.jumps, seen.changes,
            best, evaluate.runs, self.seed, self._notes(evaluate, seen.complete), self.scene, seen,
        )  # fmt: skip

    def _system(self, evaluate: Evaluator, targets: Sequence[Target]) -> Solution:
        sizes = np.ones(len(targets))

        def misses(points: Floats) -> Floats:
            values = evaluate(self._scaled(points)).values
            apart: Floats = (values[:, ::2] - values[:, 1::2]) / sizes
            return apart

        first = evaluate(self._scaled(np.full((1, len(self.ranges)), 0.5))).values[0]
        for i in range(len(targets)):
            size = float(np.nanmax(np.abs(first[2 * i : 2 * i + 2]), initial=0.0))
            sizes[i] = size if size > 0.0 else 1.0
        found = least(
            lambda points: np.sum(misses(points) ** 2, axis=1), len(self.ranges), self.seed,
            lambda point: misses(point[np.newaxis])[0],
        )  # fmt: skip
        solved = isfinite(found.value) and found.value**0.5 <= CLOSE
        answer = None
        if isfinite(found.value):
            answer = self._answer(evaluate, self._scaled(found.at), "inside")
        notes = self._notes(evaluate, True)
        if len(targets) < len(self.ranges):
            notes += (
                f"{len(targets)} target and {len(self.ranges)} keys: this is one of many solutions,"
                " the one that the search came upon.",
            )
        return Solution(
            asked("solve", ", ".join(map(str, targets)), self.ranges), "solve", self.ranges,
            tuple(wish.left.name for wish in targets), tuple(wish.left.unit for wish in targets),
            (answer,) if answer and solved else (), None if solved else answer, (), (), (), 0,
            evaluate.runs, self.seed, notes, self.scene, None,
        )  # fmt: skip

    def extremum(self, name: str, goal: Literal["minimize", "maximize"]) -> Solution:
        """Answer `minimize` and `maximize`."""
        quantity = measured(self.scene, name, f"--{goal} {name}")
        evaluate = self._evaluator([quantity])
        sign = 1.0 if goal == "minimize" else -1.0
        seen: Scan | None = None
        changes: tuple[Change, ...] = ()
        if len(self.ranges) == 1:
            (one,) = self.ranges
            seen = scan(evaluate, one.low, one.high, self.points)
            lows = minima(seen, lambda x: float(evaluate([[x]]).values[0, 0]), sign)
            answers = [
                self._answer(evaluate, np.array([low.at]), low.place, slopes=low is lows[0])
                for low in lows
            ]
            changes, notes = seen.changes, self._notes(evaluate, seen.complete)
            if level(seen):
                answers = [replace(answers[0], place="inside")]
                notes += (f"{name} is the same over the whole range: it does not depend on it.",)
        else:
            found = least(
                lambda points: sign * evaluate(self._scaled(points)).values[:, 0],
                len(self.ranges), self.seed,
            )  # fmt: skip
            answers, notes = [], self._notes(evaluate, True)
            if isfinite(found.value):
                end = bool(np.any((found.at <= 1e-9) | (found.at >= 1.0 - 1e-9)))
                place = "end" if end else "inside"
                answers = [self._answer(evaluate, self._scaled(found.at), place)]
        return Solution(
            asked(goal, name, self.ranges), goal, self.ranges, (quantity.name,), (quantity.unit,),
            tuple(answers), None, (), (), changes, 0, evaluate.runs, self.seed, notes,
            self.scene, seen,
        )  # fmt: skip

    def _scaled(self, shares: Floats) -> Floats:
        low = np.array([one.low for one in self.ranges])
        high = np.array([one.high for one in self.ranges])
        # low + share * width may pass the end by a rounding, which a scene would refuse.
        scaled: Floats = np.clip(low + shares * (high - low), low, high)
        return scaled

    def _answer(
        self, evaluate: Evaluator, at: Floats, place: str, *, slopes: bool = True
    ) -> Answer:
        outcome = evaluate(at[np.newaxis])
        values = [float(value) for value in outcome.values[0]]
        two = len(values) > 1
        columns = range(0, len(values), 2 if two else 1)
        return Answer(
            tuple(float(value) for value in at),
            tuple(values[column] for column in columns),
            tuple(values[1::2]) if two else (),
            outcome.courses[0],
            place,
            sensitivities(evaluate, self.ranges, at, columns) if slopes else (),
        )

    def _notes(self, evaluate: Evaluator, complete: bool) -> tuple[str, ...]:
        notes: tuple[str, ...] = ()
        if any(quantity.ending == "settled" for quantity in evaluate.quantities):
            notes += ("What the belt pays is counted until nothing slips on it any more.",)
        if not complete:
            notes += (
                "The particle's way changes too often to find every place where it does: narrow"
                " the range, or raise --points.",
            )
        return notes
