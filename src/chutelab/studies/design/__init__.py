"""From a scene to a design: what to change so that a quantity becomes what it should be.

>>> import chutelab
>>> from chutelab import design
>>> scene = chutelab.load("inclined-20")
>>> found = design.solve(scene, {"plate.angle_deg": (0, 60)}, {"landing.vx": 1.0})
>>> round(found.answer.values[0], 3)
47.829

`solve`, `minimize` and `maximize` go from a question in words to a `Solution`. One key is solved
piece by piece; several keys by a global search with a seed, and a polish.

- `evaluation`: what can be aimed at and varied, the one place where variants are run, and slopes.
- `roots`: one key: smooth pieces, all roots, all minima.
- `answers`: a `Solution`, in numbers and in words.
- `uncertainty`: how uncertain inputs spread, and which of them matters: an `Uncertainty`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from chutelab.scene import AnyScene, Scene, load
from chutelab.scene.variants import Varied, refuse_texts
from chutelab.studies.design import roots
from chutelab.studies.design.answers import Answer, Goal, Solution
from chutelab.studies.design.evaluation import (
    Evaluator,
    Quantity,
    Span,
    measured,
    ranges,
    scipy,
    sensitivities,
    value,
)
from chutelab.studies.design.evaluation import target as wish
from chutelab.studies.design.roots import CLOSE, Scan, level, minima
from chutelab.studies.design.uncertainty import Uncertainty, uncertainty
from chutelab.util.arrays import Floats, Progress
from chutelab.util.errors import InputError
from chutelab.util.errors import InputError as DesignError

__all__ = [
    "Answer",
    "DesignError",
    "Solution",
    "Uncertainty",
    "maximize",
    "minimize",
    "solve",
    "uncertainty",
    "value",
]

NOWHERE: Final = 1e30
"""Stands for a variant without the quantity: worse than any other, but a number still."""

POPULATION: Final = 12
"""Variants of a generation per key: enough to find a basin of a few per cent of the range."""

GENERATIONS: Final = 60
"""At most; the polish does the last digits."""

SIMPLEX: Final = {"xatol": 1e-12, "fatol": 1e-15, "maxiter": 600, "adaptive": True}


def least(
    function: Callable[[Floats], Floats], ranges: Sequence[Span], seed: int, *, squares: bool
) -> tuple[Floats, float]:
    """Return where a function of several keys is least, shape (K,), and how much it is.

    It takes points (N, K) and gives (N, 1), NaN where there is no value. With `squares` it gives
    (N, R), and what is least is the sum of their squares: the polish then is a least-squares one,
    which gets to the last digits.
    """
    optimize = scipy("optimize")
    low, high = np.array([(one.low, one.high) for one in ranges]).T

    def scaled(shares: Floats) -> Floats:
        # low + share * width may pass the end by a rounding, which a scene would refuse.
        return np.asarray(np.clip(low + shares * (high - low), low, high))

    def values(columns: Floats) -> Floats:
        found = function(scaled(np.atleast_2d(columns.T)))
        found = np.sum(found**2, axis=1) if squares else found[:, 0]
        return np.where(np.isfinite(found), found, NOWHERE)

    searched = optimize.differential_evolution(
        values, [(0.0, 1.0)] * len(ranges), seed=seed, popsize=POPULATION, maxiter=GENERATIONS,
        tol=1e-8, atol=1e-12, init="sobol", polish=False, vectorized=True, updating="deferred",
    )  # fmt: skip
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


POINTS: Final = 181
"""Of the scan over one key: a quarter of a second, and half a degree of a plate's angles."""

FEWEST: Final = 3
MOST: Final = 100_001

MORE: Final = 400
"""Variants beyond the scan that a search over one key runs, about; for the progress."""


def solve(
    scene: AnyScene,
    vary: Varied,
    target: Mapping[str, float | str] | Sequence[tuple[str, float | str]],
    *,
    points: int = POINTS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Solution:
    """Find the values of some keys for which a quantity is what it should be.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        What `chutelab.load` takes.
    vary : mapping, or sequence of Range
        The keys and the ranges that are searched: ``{KEY: (FROM, TO)}``.
    target : mapping, or sequence of pairs
        ``{QUANTITY: VALUE}``: a quantity of the run, and the number, key of the scene or quantity
        that it is to equal. With several keys there may be several targets, up to one a key.
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
    >>> found = solve("inclined-20", {"plate.angle_deg": (0, 60)}, {"landing.vx": 1.0})
    >>> round(found.answer.values[0], 6)
    47.828951
    """
    scene = load(scene)
    refuse_texts(target, "--target", '{"landing.vx": 1.0}')
    pairs = list(target.items()) if isinstance(target, Mapping) else list(target)
    if not pairs:
        raise InputError("name at least one, such as landing.vx=outgoing.speed", "--target")
    wishes = [wish(scene, name, value) for name, value in pairs]
    last = "--target {}={}".format(*pairs[-1])
    if len({left.key for left, _ in wishes}) < len(wishes):
        raise InputError("this quantity has a target already", last)
    what = ", ".join(f"{left.name} = {right.name}" for left, right in wishes)
    sides = [side for wanted in wishes for side in wanted]
    search = _Search("solve", what, sides, scene, vary, points, seed, progress)
    keys = len(search.ranges)
    if len(wishes) > keys:
        raise InputError(f"{len(wishes)} targets need as many keys to vary, {keys} given", last)
    return search.roots() if keys == 1 else search.system(len(wishes))


def minimize(
    scene: AnyScene,
    vary: Varied,
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
    scene = load(scene)
    wanted = [measured(scene, quantity, f"--minimize {quantity}")]
    return _Search("minimize", quantity, wanted, scene, vary, points, seed, progress).extremum()


def maximize(
    scene: AnyScene,
    vary: Varied,
    quantity: str,
    *,
    points: int = POINTS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Solution:
    """Find the values of some keys for which a quantity is largest; see `minimize`."""
    scene = load(scene)
    wanted = [measured(scene, quantity, f"--maximize {quantity}")]
    return _Search("maximize", quantity, wanted, scene, vary, points, seed, progress).extremum()


class _Search:
    """One question: everything that can be refused is looked at before anything runs."""

    def __init__(
        self,
        goal: Goal,
        what: str,
        quantities: Sequence[Quantity],
        scene: Scene,
        vary: Varied,
        points: int,
        seed: int,
        progress: Progress | None,
    ) -> None:
        if not FEWEST <= points <= MOST:
            raise InputError(f"must be from {FEWEST} to {MOST}", f"--points {points}")
        if seed < 0:
            raise InputError("must be a whole number from 0", f"--seed {seed}")
        self.goal, self.what, self.points, self.seed = goal, what, points, seed
        self.ranges = ranges(scene, vary)
        scipy("optimize")
        keys = [one.key for one in self.ranges]
        runs = points + MORE if len(keys) == 1 else 800 * len(keys)
        # Of targets both sides, one after the other.
        self.evaluate = Evaluator(scene, keys, quantities, progress, runs)

    def scan(self) -> Scan:
        """Return the whole range of the only key."""
        (one,) = self.ranges
        return roots.scan(self.evaluate, one.low, one.high, self.points)

    def roots(self) -> Solution:
        """Solve for one key and one target."""
        (one,), seen = self.ranges, self.scan()

        def function(x: float) -> float:
            left, right = self.evaluate([[x]]).values[0]
            return float(left - right)

        at, everywhere, jumps, nearest = roots.roots(seen, function)
        own = one.start if one.start is not None else one.low
        edges = {x for change in seen.changes for x in (change.low, change.high)}
        answers = [self.answer([x], "change" if x in edges else "inside") for x in at]
        best = int(np.argmin([abs(x - own) for x in at])) if answers else 0
        near = self.answer([nearest]) if not answers and isfinite(nearest) else None
        if not answers and everywhere:
            low, high = everywhere[0]
            answers = [self.answer([min(max(own, low), high)])]
        return self.solution(
            answers, scan=seen, nearest=near, everywhere=tuple(everywhere), jumps=tuple(jumps),
            best=best,
        )  # fmt: skip

    def system(self, targets: int) -> Solution:
        """Solve for several keys and some targets."""

        def apart(points: Floats) -> Floats:
            sides = self.evaluate(points).values.reshape(-1, targets, 2)
            return np.asarray((sides[:, :, 0] - sides[:, :, 1]) / sizes)

        keys = len(self.ranges)
        middle = self.evaluate([[one.low + 0.5 * one.width for one in self.ranges]]).values[0]
        sizes = np.nanmax(np.abs(middle).reshape(targets, 2), axis=1, initial=0.0)
        sizes[sizes == 0.0] = 1.0
        at, value = least(apart, self.ranges, self.seed, squares=True)
        answer = self.answer(at) if isfinite(value) else None
        notes = []
        if targets < keys:
            notes.append(
                f"{targets} target and {keys} keys: this is one of many solutions,"
                " the one that the search came upon."
            )
        if answer and value**0.5 <= CLOSE:
            return self.solution([answer], notes)
        return self.solution([], notes, nearest=answer)

    def extremum(self) -> Solution:
        """Minimise or maximise the quantity."""
        sign = -1.0 if self.goal == "maximize" else 1.0
        if len(self.ranges) > 1:
            at, value = least(
                lambda points: sign * self.evaluate(points).values, self.ranges, self.seed,
                squares=False,
            )  # fmt: skip
            low, high = np.array([(one.low, one.high) for one in self.ranges]).T
            at_end = np.minimum(at - low, high - at) <= 1e-9 * (high - low)
            place = "end" if at_end.any() else "inside"
            return self.solution([self.answer(at, place)] if isfinite(value) else [])
        seen = self.scan()
        lows = minima(seen, lambda x: float(self.evaluate([[x]]).values[0, 0]), sign)
        answers = [self.answer([low.at], low.place, slopes=low is lows[0]) for low in lows]
        if not level(seen):
            return self.solution(answers, scan=seen)
        note = f"{self.what} is the same over the whole range: it does not depend on it."
        return self.solution([replace(answers[0], place="inside")], [note], scan=seen)

    def answer(self, at: ArrayLike, place: str = "inside", *, slopes: bool = True) -> Answer:
        """Return what is found at a point (K,)."""
        point = np.asarray(at, dtype=np.float64)
        outcome = self.evaluate(point[np.newaxis])
        values = outcome.values[0].tolist()
        every = 2 if self.goal == "solve" else 1
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
        answers: Sequence[Answer],
        notes: Sequence[str] = (),
        scan: Scan | None = None,
        **found: Any,
    ) -> Solution:
        """Return the result, with what holds for all questions."""
        quantities = self.evaluate.quantities
        said = []
        if any(quantity.ending == "settled" for quantity in quantities):
            said.append("What the belt pays is counted until nothing slips on it any more.")
        if scan is not None and not scan.complete:
            said.append(
                "The particle's way changes too often to find every place where it does: narrow"
                " the range, or raise --points."
            )
        verb = {"solve": "Solve", "minimize": "Minimise", "maximize": "Maximise"}[self.goal]
        spans = [
            f"{one.key} from {one.low:g} to {one.high:g} {one.unit}".rstrip() for one in self.ranges
        ]
        wanted = quantities[:: 2 if self.goal == "solve" else 1]
        return Solution(
            asked=", ".join([f"{verb} {self.what}", *spans]),
            goal=self.goal,
            ranges=self.ranges,
            quantities=tuple(one.name for one in wanted),
            units=tuple(one.unit for one in wanted),
            answers=tuple(answers),
            runs=self.evaluate.runs,
            seed=self.seed,
            notes=(*said, *notes),
            base=self.evaluate.scene,
            scan=scan,
            **found,
        )
