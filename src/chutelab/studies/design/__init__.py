"""From a scene to a design: find the changes that give a quantity a wanted value.

>>> import chutelab
>>> from chutelab import design
>>> scene = chutelab.load("inclined-20")
>>> found = design.solve(scene, {"plate.angle_deg": (0, 60)}, {"landing.vx": 1.0})
>>> round(found.answer.values[0], 3)
47.829

`solve`, `minimize` and `maximize` turn a question in words into a `Solution`. One key is solved
piece by piece; several keys by a global search with a seed, followed by a local one.

- `evaluation`: possible targets and keys; runs all variants; slopes.
- `roots`: one key: smooth pieces, all roots, all minima.
- `searches`: several keys; streams, whose numbers differ from seed to seed.
- `answers`: a `Solution`, in numbers and in words.
- `uncertainty`: the effect of uncertain inputs, and which of them matters: an `Uncertainty`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from math import inf, isfinite
from time import monotonic
from typing import Any, Final, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from chutelab.scene import AnyScene, Scene, load
from chutelab.scene.variants import Varied, drawn, refuse_texts
from chutelab.studies.design import roots
from chutelab.studies.design.answers import Answer, Goal, Solution
from chutelab.studies.design.evaluation import (
    Evaluator,
    Quantity,
    Stopped,
    measured,
    ranges,
    scipy,
    sensitivities,
    value,
)
from chutelab.studies.design.evaluation import target as wish
from chutelab.studies.design.roots import CLOSE, Scan, level, minima
from chutelab.studies.design.searches import (
    KEPT,
    Found,
    Wishes,
    constrained,
    least,
    search,
    spreads_of,
)
from chutelab.studies.design.uncertainty import Uncertainty, uncertainty
from chutelab.studies.sweep import Crew, crew
from chutelab.util.arrays import Floats, Progress
from chutelab.util.errors import InputError
from chutelab.util.errors import InputError as DesignError
from chutelab.util.tables import rounded

__all__ = [
    "Answer", "DesignError", "How", "Solution", "Uncertainty", "maximize", "minimize", "solve",
    "uncertainty", "value",
]  # fmt: skip


REPEAT: Final = 8
"""Seeds of a search among streams whose particles meet."""

NOISY_POINTS: Final = 96
"""Most variants of such a search."""

POINTS: Final = 181
"""Points of the scan over one key: a quarter of a second, and half a degree of plate angle."""

FEWEST: Final = 3
MOST: Final = 100_001

MORE: Final = 400
"""About how many variants a search over one key runs after the scan; for the progress."""


class How(TypedDict, total=False):
    """How `solve`, `minimize` and `maximize` search.

    Attributes
    ----------
    subject_to : mapping
        Limits of quantities: ``{"arrival.share": (0.95, None)}``, least and most.
    repeat : int
        Seeds that each variant is run with; default: `REPEAT` where particles meet, else 1. With
        several, quantities are means, and the answer has its error.
    deviations : float
        The mean is minimised or maximised, made worse by so many standard deviations of one run.
    points : int
        With one key and one seed: number of values of the scan, `POINTS`. Two solutions between
        neighbouring values are found only if the quantity bends visibly between them. With several
        seeds: most variants, `NOISY_POINTS`.
    seed : int
        Seed of the draws of the search, with several keys or seeds.
    jobs, team : int, Crew
        Processes to spread the runs over, 0 is one for each processor; or a
        `chutelab.studies.sweep.crew`.
    max_seconds : float
        After this time the search ends with what is known.
    progress : callable
        Called with the share that is done, 0 to 1.
    """

    subject_to: Mapping[str, tuple[float | str | None, float | str | None]]
    repeat: int | None
    deviations: float
    points: int | None
    seed: int
    jobs: int
    team: Crew | None
    max_seconds: float
    progress: Progress | None


def solve(
    scene: AnyScene,
    vary: Varied,
    target: Mapping[str, float | str] | Sequence[tuple[str, float | str]],
    *,
    minimize: str | None = None,
    maximize: str | None = None,
    **how: Unpack[How],
) -> Solution:
    """Find the values of some keys for which a quantity has a wanted value.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        What `chutelab.load` takes.
    vary : mapping, or sequence of Range
        The keys and the ranges that are searched: ``{KEY: (FROM, TO)}``.
    target : mapping, or sequence of pairs
        ``{QUANTITY: VALUE}``: a quantity of the run, and the number, key of the scene or quantity
        that it is to equal. With several keys there may be several targets, up to one a key.
    minimize, maximize : str, optional
        Of all solutions, the one where this quantity is least or largest; with more keys than
        targets.
    **how
        See `How`.

    Returns
    -------
    Solution
        With one key and one seed all solutions; otherwise one, with its error if there are several
        seeds.

    Raises
    ------
    InputError
        If the question makes no sense for the scene. Nothing has run then.
    SceneError
        If the scene itself cannot be run.
    ImportError
        Without SciPy; with several seeds also without scikit-learn.
    KeyboardInterrupt
        With the `Solution` that is known so far as its ``solution``, if any variant has run.

    Examples
    --------
    >>> found = solve("inclined-20", {"plate.angle_deg": (0, 60)}, {"landing.vx": 1.0})
    >>> round(found.answer.values[0], 6)
    47.828951
    """
    scene = load(scene)
    refuse_texts(target, "target", '{"landing.vx": 1.0}')
    pairs = list(target.items()) if isinstance(target, Mapping) else list(target)
    if not pairs:
        raise InputError("name at least one, such as landing.vx=outgoing.speed", "target")
    wishes = [wish(scene, name, value) for name, value in pairs]
    last = "target {}={}".format(*pairs[-1])
    if len({left.key for left, _ in wishes}) < len(wishes):
        raise InputError("this quantity has a target already", last)
    if minimize and maximize:
        raise InputError("minimize and maximize: give one of them", f"--maximize {maximize}")
    search = _Search(
        scene, vary, wishes, minimize or maximize, "maximize" if maximize else "minimize", how
    )
    keys, spare = len(search.ranges), bool(minimize or maximize)
    if len(wishes) + spare > keys:
        more = f" and something to {search.goal}" if spare else ""
        raise InputError(
            f"{len(wishes)} targets{more} need as many keys to vary, {keys} given", last
        )
    return search.answered()


def minimize(scene: AnyScene, vary: Varied, quantity: str, **how: Unpack[How]) -> Solution:
    """Find the values of some keys for which a quantity is least.

    Parameters, result and errors are those of `solve`, with a quantity such as ``belt_work`` or
    ``landing.t`` for the target.
    """
    return _Search(load(scene), vary, (), quantity, "minimize", how).answered()


def maximize(scene: AnyScene, vary: Varied, quantity: str, **how: Unpack[How]) -> Solution:
    """Find the values of some keys for which a quantity is largest; see `minimize`."""
    return _Search(load(scene), vary, (), quantity, "maximize", how).answered()


SHARP: Final = 1e-4
"""Share of a range below which the error of an answer at its end is that of the search alone."""

ELSEWHERE: Final = 0.5
"""If a larger share of the likely answers is elsewhere, this is reported."""


def _limits(
    scene: Scene,
    given: Mapping[str, tuple[float | str | None, float | str | None]],
    quantities: list[Quantity],
) -> tuple[tuple[tuple[int, float], ...], list[str]]:
    """Read limits: index of each among the quantities (extended by them), and words."""
    found: list[tuple[int, float]] = []
    said = []
    for name, ends in given.items():
        for end, sense, sign in zip(ends, (">=", "<="), (1.0, -1.0), strict=True):
            if end is None:
                continue
            left, right = wish(scene, name, end, f"--subject-to {name}{sense}{end}")
            if right.source != "number":
                raise InputError("a limit is a number", f"--subject-to {name}{sense}{end}")
            n = len(quantities)
            if found and quantities[-1] == left:
                n -= 1
            else:
                quantities.append(left)
            found.append((n if sign > 0.0 else ~n, right.number))
            said.append(f"{left.name} {sense} {right.name}")
    if given and not found:
        raise InputError("give a least or a largest value", f"--subject-to {next(iter(given))}")
    return tuple(found), said


class _Search:
    """One question; everything that can be refused is checked before anything runs."""

    def __init__(
        self,
        scene: Scene,
        vary: Varied,
        targets: Sequence[tuple[Quantity, Quantity]],
        objective: str | None,
        best: Literal["minimize", "maximize"],
        how: How,
    ) -> None:
        self.goal: Goal = "solve" if objective is None else best
        self.targets, self.how, self.seed = len(targets), how, how.get("seed", 0)
        self.what = ", ".join(f"{left.name} = {right.name}" for left, right in targets)
        quantities = [side for wanted in targets for side in wanted]
        if objective is not None:
            quantities.append(measured(scene, objective, f"--{best} {objective}"))
        limits, said = _limits(scene, how.get("subject_to") or {}, quantities)
        self.deviations = how.get("deviations", 0.0)
        self.wishes = Wishes(
            tuple((2 * n, 2 * n + 1) for n in range(len(targets))),
            limits,
            2 * len(targets) if objective is not None else None,
            -1.0 if best == "maximize" else 1.0,
            self.deviations,
        )
        rest = ", ".join(filter(None, (self.what if objective else "", *said)))
        if objective is not None:
            worse = f" {'-' if best == 'maximize' else '+'} {self.deviations:g} s"
            self.what = f"{objective}{worse if self.deviations else ''}"
        self.what += f", with {rest}" if rest else ""
        meets = any(stream.interact for stream in scene.streams) and scene.count > 1
        self.repeat = how.get("repeat") or (REPEAT if meets else 1)
        drawn(scene, self.repeat)
        if self.deviations and self.repeat == 1:
            said_of = f"--deviations {self.deviations:g}"
            raise InputError("one run has none: give --repeat N too, from 3", said_of)
        if not 0.0 <= self.deviations <= 100.0:
            raise InputError("must be from 0 to 100", f"--deviations {self.deviations:g}")
        if self.deviations and objective is None:
            said_of = f"--deviations {self.deviations:g}"
            raise InputError("it is of what is least or largest: give --minimize", said_of)
        self.points = how.get("points") or (NOISY_POINTS if self.repeat > 1 else POINTS)
        if not FEWEST <= self.points <= MOST:
            raise InputError(f"must be from {FEWEST} to {MOST}", f"--points {self.points}")
        if self.seed < 0:
            raise InputError("must be a whole number from 0", f"--seed {self.seed}")
        self.ranges = ranges(scene, vary)
        scipy("optimize")
        keys = [one.key for one in self.ranges]
        runs = self.points + MORE if len(keys) == 1 else 800 * len(keys)
        if self.repeat > 1:
            runs = self.points * self.repeat
        self.evaluate = Evaluator(scene, keys, quantities, how.get("progress"), runs)

    @property
    def shown(self) -> list[int]:
        """Indices of the quantities shown: of targets the left sides."""
        rest = range(2 * self.targets, len(self.evaluate.quantities))
        return [*range(0, 2 * self.targets, 2), *rest]

    def answered(self) -> Solution:
        """Search, as long as there is time."""
        limit = self.how.get("max_seconds", inf)
        self.evaluate.ends = monotonic() + limit
        team = self.how.get("team")
        with nullcontext(team) if team is not None else crew(self.how.get("jobs", 1)) as workers:
            self.evaluate.team = workers
            try:
                if self.repeat > 1:
                    return self.noisy()
                if self.wishes.limits or (self.targets and self.goal != "solve"):
                    return self.limited()
                if self.goal != "solve":
                    return self.extremum()
                return self.roots() if len(self.ranges) == 1 else self.system(self.targets)
            except Stopped:
                return self.known(f"stopped after {limit:g} s")
            except KeyboardInterrupt as interrupt:
                if self.evaluate.seen:
                    interrupt.solution = self.known("interrupted")  # type: ignore[attr-defined]
                raise

    def known(self, why: str) -> Solution:
        """Return the best result of a search that was ended early."""
        if not self.evaluate.seen:
            return self.solution([], [f"Not finished: {why}; no variant has run."], finished=False)
        points, values = (np.concatenate(part) for part in zip(*self.evaluate.seen, strict=True))
        columns = self.wishes.columns(values[:, np.newaxis])
        merit = self.wishes.merit(columns, spreads_of(columns))
        best = int(np.argmin(merit))
        note = f"Not finished: {why}; of {len(points)} variants this one is the nearest."
        if not isfinite(merit[best]):
            return self.solution([], [note], finished=False)
        found, wanted = self.told(values[best])
        near = Answer(tuple(points[best].tolist()), found, wanted, "not looked at")
        return self.solution([], [note], nearest=near, finished=False)

    def told(self, values: Floats) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return an answer's quantities from (M,): those shown, and the wanted values."""
        numbers = values.tolist()
        return (
            tuple(numbers[n] for n in self.shown),
            tuple(numbers[n] for n in range(1, 2 * self.targets, 2)),
        )

    def noisy(self) -> Solution:
        """Search among variants with several seeds each."""
        found = search(self.evaluate, self.wishes, self.ranges, self.repeat, self.points, self.seed)
        notes, stopped = [], self.evaluate.stopped
        if stopped is not None:
            why = "interrupted" if isinstance(stopped, KeyboardInterrupt) else "time was up"
            notes.append(f"Not finished: {why} after {len(found.points)} variants.")
        answers, near = [], None
        if len(found.points) and np.isfinite(found.error).all():
            answer = self.rounded(found)
            columns = self.wishes.columns(found.values)
            there = np.array([[mean for mean, _ in found.quantities]])
            here = self.wishes.columns(there)
            missed = self.wishes.missed(here, spreads_of(columns))
            room = 2.0 * np.array([error for _, error in found.quantities])
            slack = [room[left] + room[right] for left, right in self.wishes.targets]
            slack += [room[n if n >= 0 else ~n] for n, _ in self.wishes.limits]
            allowed = np.array([*slack, 0.0]) / spreads_of(columns)[[*range(len(slack)), -1]]
            answers = [answer] if np.all(missed <= allowed + KEPT) else []
            near = None if answers else answer
        notes.append(
            f"± is the standard error over {self.repeat} seeds, the same for all variants: the"
            " search gives no more digits than that. --repeat with more seeds makes it smaller."
        )
        if found.elsewhere > ELSEWHERE:
            notes.append(
                "Other places may be as good: a narrower range, or more seeds, tells them apart."
            )
        solution = self.solution(
            answers, notes, nearest=near, variants=found.points, outcomes=found.values,
            finished=stopped is None,
        )  # fmt: skip
        if isinstance(stopped, KeyboardInterrupt):
            stopped.solution = solution  # type: ignore[attr-defined]
            raise stopped
        return solution

    def rounded(self, found: Found) -> Answer:
        """Return an answer with its numbers rounded to their errors."""
        numbers = [
            (float(rounded(value, error)), error)
            for value, error in (
                *zip(found.at.tolist(), found.error.tolist(), strict=True),
                *(found.quantities[n] for n in self.shown),
            )
        ]
        at_end = False
        for n, one in enumerate(self.ranges):
            value, error = numbers[n]
            end = one.low if value - one.low < one.high - value else one.high
            at_end |= abs(value - end) <= error
            if abs(value - end) <= error < SHARP * one.width:
                # If no seed has the answer elsewhere, the end of the range has no error.
                numbers[n] = end, 0.0
            else:
                numbers[n] = min(max(value, one.low), one.high), error
        values, errors = zip(*numbers, strict=True)
        keys = len(self.ranges)
        _, wanted = self.told(np.array([mean for mean, _ in found.quantities]))
        course = "not looked at"
        if self.evaluate.stopped is None:
            course = self.evaluate(np.reshape(values[:keys], (1, keys))).touches[0]
        return Answer(
            values[:keys], values[keys:], wanted, course,
            "end" if self.goal != "solve" and at_end else "inside",
            errors=errors[:keys], found_errors=errors[keys:],
        )  # fmt: skip

    def limited(self) -> Solution:
        """Search with limits, or for the best of all solutions; one seed."""
        at, missed = constrained(
            lambda points: self.wishes.columns(self.evaluate(points).values[:, np.newaxis]),
            self.wishes, self.ranges, self.seed,
        )  # fmt: skip
        if not isfinite(missed):
            return self.solution([])
        answer = self.answer(at, "inside" if self.goal == "solve" else self.place(at))
        return self.solution([answer]) if missed <= KEPT else self.solution([], nearest=answer)

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
            return self.solution([self.answer(at, self.place(at))] if isfinite(value) else [])
        seen = self.scan()
        lows = minima(seen, lambda x: float(self.evaluate([[x]]).values[0, 0]), sign)
        answers = [self.answer([low.at], low.place, slopes=low is lows[0]) for low in lows]
        if not level(seen):
            return self.solution(answers, scan=seen)
        note = f"{self.what} is the same over the whole range: it does not depend on it."
        return self.solution([replace(answers[0], place="inside")], [note], scan=seen)

    def place(self, at: Floats) -> str:
        """Return whether a point (K,) is "inside" or at an "end" of a range."""
        low, high = np.array([(one.low, one.high) for one in self.ranges]).T
        return "end" if np.any(np.minimum(at - low, high - at) <= 1e-9 * (high - low)) else "inside"

    def answer(self, at: ArrayLike, place: str = "inside", *, slopes: bool = True) -> Answer:
        """Return the answer at a point (K,)."""
        point = np.asarray(at, dtype=np.float64)
        outcome = self.evaluate(point[np.newaxis])
        return Answer(
            tuple(point.tolist()),
            *self.told(outcome.values[0]),
            outcome.courses[0],
            place,
            sensitivities(self.evaluate, self.ranges, point, self.shown) if slopes else (),
        )

    def solution(
        self,
        answers: Sequence[Answer],
        notes: Sequence[str] = (),
        scan: Scan | None = None,
        **found: Any,
    ) -> Solution:
        """Return the solution, with the parts common to all questions."""
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
        wanted = [quantities[n] for n in self.shown]
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
