"""`solve`, `minimize` and `maximize`: from a question in words to a `Solution`.

One key is solved piece by piece, see `roots`; several keys by a global search with a seed, and a
polish.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from chutelab.scene import Scene
from chutelab.studies.design.answers import Answer, Goal, Solution, asked
from chutelab.studies.design.evaluation import Evaluator, ranges
from chutelab.studies.design.quantities import Quantity, measured, scipy
from chutelab.studies.design.quantities import target as wish
from chutelab.studies.design.roots import CLOSE, Scan, level, minima, roots, scan
from chutelab.studies.design.sensitivity import sensitivities
from chutelab.util.arrays import Floats, Progress
from chutelab.util.errors import InputError

NOWHERE: Final = 1e30
"""Stands for a variant without the quantity: worse than any other, but a number still."""

POPULATION: Final = 12
"""Variants of a generation per key: enough to find a basin of a few per cent of the range."""

GENERATIONS: Final = 60
"""At most; the polish does the last digits."""

SIMPLEX: Final = {"xatol": 1e-12, "fatol": 1e-15, "maxiter": 600, "adaptive": True}


def least(
    batch: Callable[[Floats], Floats],
    keys: int,
    seed: int,
    residuals: Callable[[Floats], Floats] | None = None,
) -> tuple[Floats, float]:
    """Return where a function over the unit cube is least, shape (keys,), and how much it is.

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
    if searched.fun >= NOWHERE:
        return searched.x, np.nan
    if residuals is None:
        polished = optimize.minimize(
            lambda point: float(energies(point)[0]), searched.x, method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * keys, options=SIMPLEX,
        )  # fmt: skip
    else:
        polished = optimize.least_squares(
            lambda point: np.nan_to_num(residuals(point), nan=1e6), searched.x, bounds=(0.0, 1.0),
            xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale=1.0, jac="3-point", diff_step=1e-6,
            max_nfev=60,
        )  # fmt: skip
    at: Floats = np.clip(polished.x, 0.0, 1.0)
    value = float(energies(at)[0])
    return (at, value) if value < searched.fun else (searched.x, float(searched.fun))


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
    InputError
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
    search = _Search(scene, vary, points, seed, progress)
    texts = [target] if isinstance(target, str) else list(target)
    if not texts:
        raise InputError("name at least one, such as landing.vx=outgoing.speed", "--target")
    wishes = [wish(scene, text) for text in texts]
    keys, count = len(search.ranges), len(wishes)
    if count > keys:
        raise InputError(
            f"{count} targets need as many keys to vary, {keys} given", f"--target {texts[-1]}"
        )
    if len({left.key for left, _ in wishes}) < count:
        raise InputError("this quantity has a target already", f"--target {texts[-1]}")
    search.look_at([side for wanted in wishes for side in wanted])
    found = search.roots() if keys == 1 else search.system(count)
    return search.solution(
        "solve", ", ".join(f"{left.name} = {right.name}" for left, right in wishes), **found
    )


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
    return _extremum("minimize", quantity, _Search(scene, vary, points, seed, progress))


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
    return _extremum("maximize", quantity, _Search(scene, vary, points, seed, progress))


def _extremum(goal: Literal["minimize", "maximize"], name: str, search: _Search) -> Solution:
    search.look_at([measured(search.scene, name, f"--{goal} {name}")])
    sign = 1.0 if goal == "minimize" else -1.0
    found = search.minima(name, sign) if len(search.ranges) == 1 else search.minimum(sign)
    return search.solution(goal, name, **found)


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
            raise InputError(f"must be from {FEWEST} to {MOST}", f"--points {points}")
        if seed < 0:
            raise InputError("must be a whole number from 0", f"--seed {seed}")
        self.scene = scene
        self.ranges = ranges(scene, [vary] if isinstance(vary, str) else list(vary))
        self.points, self.seed, self.progress = points, seed, progress

    def look_at(self, quantities: Sequence[Quantity]) -> None:
        """Choose the quantities; of targets both sides, one after the other."""
        scipy("optimize")
        keys = [one.key for one in self.ranges]
        runs = self.points + MORE if len(keys) == 1 else 800 * len(keys)
        self.evaluate = Evaluator(self.scene, keys, quantities, self.progress, runs)

    def scan(self) -> Scan:
        """Return the whole range of the only key."""
        (one,) = self.ranges
        return scan(self.evaluate, one.low, one.high, self.points)

    def roots(self) -> dict[str, Any]:
        """Return what a `Solution` holds for one key and one target."""
        (one,), seen = self.ranges, self.scan()

        def function(x: float) -> float:
            left, right = self.evaluate([[x]]).values[0]
            return float(left - right)

        found = roots(seen, function)
        own = one.start if one.start is not None else one.low
        edges = {x for change in seen.changes for x in (change.low, change.high)}
        answers = [self.answer([x], "change" if x in edges else "inside") for x in found.at]
        best = int(np.argmin([abs(x - own) for x in found.at])) if answers else 0
        nearest = None
        if not answers and isfinite(found.nearest):
            nearest = self.answer([found.nearest])
        if not answers and found.everywhere:
            low, high = found.everywhere[0]
            answers = [self.answer([min(max(own, low), high)])]
        return {
            "answers": answers, "nearest": nearest, "everywhere": found.everywhere,
            "jumps": found.jumps, "best": best, "scan": seen,
        }  # fmt: skip

    def system(self, targets: int) -> dict[str, Any]:
        """Return what a `Solution` holds for several keys and some targets."""

        def apart(shares: Floats) -> Floats:
            sides = self.evaluate(self.scaled(shares)).values.reshape(-1, targets, 2)
            return sides[:, :, 0] - sides[:, :, 1]

        keys = len(self.ranges)
        middle = self.evaluate(self.scaled(np.full((1, keys), 0.5))).values[0]
        sizes = np.nanmax(np.abs(middle).reshape(targets, 2), axis=1, initial=0.0)
        sizes[sizes == 0.0] = 1.0
        at, value = least(
            lambda shares: np.sum((apart(shares) / sizes) ** 2, axis=1),
            keys,
            self.seed,
            lambda share: apart(share[np.newaxis])[0] / sizes,
        )
        answer = self.answer(self.scaled(at)) if isfinite(value) else None
        notes = []
        if targets < keys:
            notes.append(
                f"{targets} target and {keys} keys: this is one of many solutions,"
                " the one that the search came upon."
            )
        if answer and value**0.5 <= CLOSE:
            return {"answers": [answer], "notes": notes}
        return {"answers": [], "nearest": answer, "notes": notes}

    def minima(self, name: str, sign: float) -> dict[str, Any]:
        """Return what a `Solution` holds for one key and the least (sign 1) or largest (-1)."""
        seen = self.scan()
        lows = minima(seen, lambda x: float(self.evaluate([[x]]).values[0, 0]), sign)
        answers = [self.answer([low.at], low.place, slopes=low is lows[0]) for low in lows]
        notes = []
        if level(seen):
            answers = [replace(answers[0], place="inside")]
            notes.append(f"{name} is the same over the whole range: it does not depend on it.")
        return {"answers": answers, "scan": seen, "notes": notes}

    def minimum(self, sign: float) -> dict[str, Any]:
        """Return the same for several keys."""
        at, value = least(
            lambda shares: sign * self.evaluate(self.scaled(shares)).values[:, 0],
            len(self.ranges),
            self.seed,
        )
        place = "end" if np.any((at <= 1e-9) | (at >= 1.0 - 1e-9)) else "inside"
        return {"answers": [self.answer(self.scaled(at), place)] if isfinite(value) else []}

    def scaled(self, shares: Floats) -> Floats:
        """Return values of the keys, 0 to 1 each from one end of its range to the other."""
        low, high = np.array([(one.low, one.high) for one in self.ranges]).T
        # low + share * width may pass the end by a rounding, which a scene would refuse.
        scaled: Floats = np.clip(low + shares * (high - low), low, high)
        return scaled

    def answer(self, at: ArrayLike, place: str = "inside", *, slopes: bool = True) -> Answer:
        """Return what is found at a point (K,)."""
        point = np.asarray(at, dtype=np.float64)
        outcome = self.evaluate(point[np.newaxis])
        values = outcome.values[0].tolist()
        every = 2 if len(values) > 1 else 1
        columns = range(0, len(values), every)
        return Answer(
            tuple(point.tolist()),
            tuple(values[::every]),
            tuple(values[1::2]),
            outcome.courses[0],
            place,
            sensitivities(self.evaluate, self.ranges, point, columns) if slopes else (),
        )

    def solution(
        self,
        goal: Goal,
        what: str,
        *,
        answers: Sequence[Answer],
        notes: Sequence[str] = (),
        scan: Scan | None = None,
        **found: Any,
    ) -> Solution:
        """Return the result, with what holds for all questions."""
        said = []
        if any(quantity.ending == "settled" for quantity in self.evaluate.quantities):
            said.append("What the belt pays is counted until nothing slips on it any more.")
        if scan is not None and not scan.complete:
            said.append(
                "The particle's way changes too often to find every place where it does: narrow"
                " the range, or raise --points."
            )
        wanted = self.evaluate.quantities[:: 2 if goal == "solve" else 1]
        return Solution(
            asked=asked(goal, what, self.ranges),
            goal=goal,
            ranges=self.ranges,
            quantities=tuple(one.name for one in wanted),
            units=tuple(one.unit for one in wanted),
            answers=tuple(answers),
            runs=self.evaluate.runs,
            seed=self.seed,
            notes=(*said, *notes),
            base=self.scene,
            scan=scan,
            **found,
        )
