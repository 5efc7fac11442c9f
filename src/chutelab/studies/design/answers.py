"""The result of `solve`, `minimize` and `maximize`: `Solution`, as numbers and in words.

The words give the number of answers, the ends of solutions, jumps, and the effect of one per cent.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final, Literal

import numpy as np

from chutelab.engines.simulation import simulate
from chutelab.results import Recording
from chutelab.scene import Scene
from chutelab.scene.units import symbol, with_unit, write_size
from chutelab.studies.design.evaluation import NO_RUN, Sensitivity, Span
from chutelab.studies.design.roots import Change, Scan
from chutelab.util.arrays import Floats
from chutelab.util.tables import Sheet, Shown, frame, plain, plus_minus

DIGITS: Final = 10
"""Significant digits shown of an answer, which has more."""


Goal = Literal["solve", "minimize", "maximize"]


@dataclass(frozen=True)
class Answer:
    """One point of the search.

    Attributes
    ----------
    values : tuple of float
        Of the varied keys, in their order.
    found : tuple of float
        The quantities asked for: the left sides of the targets, the one that is least or largest,
        and the limited ones.
    wanted : tuple of float
        The right sides of the targets; empty without targets.
    course : str
        Surfaces that particle 0 touches up to its landing; with several seeds those that the
        particles of the scene's own seed touch, as in `sweep`.
    place : str
        "inside" the range, at an "end" of it, or at a "change" of the course.
    sensitivities : tuple of Sensitivity
        The effect of each key on each quantity here; empty for minor answers.
    errors, found_errors : tuple of float
        With several seeds, the standard errors of `values` and `found`; else empty.
    """

    values: tuple[float, ...]
    found: tuple[float, ...]
    wanted: tuple[float, ...]
    course: str
    place: str = "inside"
    sensitivities: tuple[Sensitivity, ...] = ()
    errors: tuple[float, ...] = ()
    found_errors: tuple[float, ...] = ()

    @property
    def off(self) -> tuple[float, ...]:
        """By how much the targets are missed."""
        return tuple(f - w for f, w in zip(self.found, self.wanted, strict=False))

    def told(self, quantity: str, value: float) -> float:
        """Return a quantity for tables: 0 if it is rounding, judged by its value 1 % away."""
        near = [s for s in self.sensitivities if s.quantity == quantity]
        sizes = [abs(side) for s in near for side in (s.lower, s.upper) if isfinite(side)]
        return 0.0 if sizes and abs(value) <= ROUNDING * max(sizes) else value


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Shown):
    """Result of a search over one or several keys.

    Attributes
    ----------
    asked, goal : str
        The question in words, and its kind.
    ranges : tuple of Span
        The varied keys.
    quantities, units : tuple of str
        The quantities of an answer, and their units.
    answers : tuple of Answer
        All solutions in order of the key, or all minima, the least first; empty if there is none.
    runs, seed : int
        Number of variants that were run, each seed counted; seed of the search over several keys.
    variants : ndarray, (N, K), and outcomes : ndarray, (N, S, M), or None
        With several seeds, the variants that were run, and all quantities of each seed.
    finished : bool
        Whether the search was completed; otherwise it was interrupted, or its time was up.
    notes : tuple of str
        Further remarks.
    base : Scene
        The scene that was varied.
    scan : Scan or None
        With one key, the values that were tried.
    nearest : Answer or None
        Without a solution, the point that misses the targets by least.
    everywhere : tuple of (float, float)
        Ranges of the key in which every value is a solution.
    jumps : tuple of Change
        Jumps of the quantity over the target, which are not solutions.
    best : int
        Index of the answer of `scene`: of several solutions the one nearest to the scene's own
        value.
    """

    asked: str
    goal: Goal
    ranges: tuple[Span, ...]
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    answers: tuple[Answer, ...]
    runs: int
    seed: int
    notes: tuple[str, ...]
    base: Scene
    scan: Scan | None = None
    nearest: Answer | None = None
    everywhere: tuple[tuple[float, float], ...] = ()
    jumps: tuple[Change, ...] = ()
    best: int = 0
    variants: Floats | None = None
    outcomes: Floats | None = None
    finished: bool = True

    @property
    def changes(self) -> tuple[Change, ...]:
        """All values of the key at which the course changes."""
        return () if self.scan is None else self.scan.changes

    @property
    def solved(self) -> bool:
        """Whether there is an answer."""
        return bool(self.answers)

    @property
    def answer(self) -> Answer:
        """The answer that is shown: the best, or else the nearest.

        Raises
        ------
        ValueError
            If there is none, because no variant has the quantity.
        """
        if self.answers:
            return self.answers[self.best]
        if self.nearest is None:
            raise ValueError(f"{self.asked}: no variant in the range has these quantities")
        return self.nearest

    @property
    def points(self) -> Floats:
        """Values of the keys at all answers, shape (answers, keys)."""
        return np.array([answer.values for answer in self.answers]).reshape(-1, len(self.ranges))

    @property
    def scene(self) -> Scene:
        """The scene at the `answer`."""
        keys = [one.key for one in self.ranges]
        return self.base.with_values(dict(zip(keys, self.answer.values, strict=True)))

    def recording(self) -> Recording:
        """Run the scene at the `answer`."""
        return simulate(self.scene)

    def frame(self) -> Any:
        """Return the values tried with one key as a pandas DataFrame.

        Raises
        ------
        ImportError
            Without pandas.
        ValueError
            If several keys were varied: the search keeps no table.
        """
        if self.scan is None:
            raise ValueError("with several keys the search keeps no table of what it looked at")
        names = (self.ranges[0].key, *self.quantities)
        values = self.scan.values[:, : len(self.quantities)]
        return frame(dict(zip(names, (self.scan.x, *values.T), strict=True)))

    def sheet(self) -> Sheet:
        """Return the answers in a table, with remarks."""
        keys = [with_unit(one.key, one.unit) for one in self.ranges]
        names = [with_unit(*one) for one in zip(self.quantities, self.units, strict=True)]
        rows = []
        for i, answer in enumerate(self.answers or filter(None, [self.nearest])):
            head = {"solve": "solution", "minimize": "least", "maximize": "most"}[self.goal]
            if not self.solved:
                head = "nearest"
            elif self.goal != "solve":
                head = "also" if i else head
            elif len(self.answers) > 1:
                head += f" {i + 1}"
            found = map(answer.told, self.quantities, answer.found)
            numbers: Iterator[str] = (f"{value:.{DIGITS}g}" for value in (*answer.values, *found))
            if answer.errors:
                values, errors = (
                    (*answer.values, *answer.found),
                    answer.errors + answer.found_errors,
                )
                numbers = (
                    plus_minus(value, error) if error else f"{value:.{DIGITS}g}"
                    for value, error in zip(values, errors, strict=True)
                )  # fmt: skip
            rows.append((head, *numbers, answer.course))
        columns = ("", *keys, *names, "touches")
        return Sheet(self.asked, columns, tuple(rows), notes=tuple(remarks(self)))

    def slopes(self) -> Sheet:
        """Return the slope of each quantity by each key at the answer, and the effect of 1 %."""
        rows = []
        for s in self.answer.sensitivities if self.solved else ():
            unit = symbol(s.unit)
            per = f"{s.quantity_unit} per {unit}" if unit else s.quantity_unit
            size = max(abs(s.lower), abs(s.upper)) if isfinite(s.lower + s.upper) else 0.0
            nothing = abs(s.derivative * s.step) <= ROUNDING * size
            number = "0" if nothing else f"{s.derivative:.6g}"
            slope = f"{number} {per}".strip() if isfinite(s.derivative) else "none here"
            rows.append((f"{s.quantity} by {s.key}", slope))
            sides = (("less", s.lower, s.courses[0]), ("more", s.upper, s.courses[1]))
            for word, value, course in sides:
                shown = _size(value, s.quantity_unit) if isfinite(value) else course
                rows.append((f"  with 1 % ({_size(s.step, s.unit)}) {word}", shown))
        return Sheet("", ("Sensitivity", "slope"), tuple(rows))

    def __repr__(self) -> str:
        return "\n\n".join(map(str, self.sheets()))

    def _repr_html_(self) -> str:
        return "".join(part.html() for part in self.sheets())

    def sheets(self) -> list[Sheet]:
        """Return the tables that are shown: the answers and, if there are any, their slopes."""
        return [self.sheet(), self.slopes()] if self.solved else [self.sheet()]


def as_dict(solution: Solution) -> dict[str, Any]:
    """Return a solution as plain lists and floats, for JSON."""

    def some(one: object, *names: str) -> dict[str, Any]:
        return {name: getattr(one, name) for name in names}

    def answer(one: Answer) -> dict[str, Any]:
        about = "key", "quantity", "derivative", "step", "lower", "upper", "courses"
        return {
            "values": dict(zip((r.key for r in solution.ranges), one.values, strict=True)),
            "found": dict(zip(solution.quantities, one.found, strict=True)),
            **some(one, "wanted", "course", "place", "errors", "found_errors"),
            "sensitivities": [some(each, *about) for each in one.sensitivities],
        }

    def change(one: Change) -> dict[str, Any]:
        return some(one, "at", "before", "after", "courses", "fault")

    told = {
        "format": 1,
        "scene": solution.base.title,
        **some(solution, "asked", "goal", "solved"),
        "ranges": solution.ranges,
        "quantities": dict(zip(solution.quantities, solution.units, strict=True)),
        "answers": [answer(one) for one in solution.answers],
        "best": solution.best if solution.solved else None,
        "nearest": answer(solution.nearest) if solution.nearest else None,
        "everywhere": solution.everywhere,
        "jumps": [change(one) for one in solution.jumps],
        "changes": [change(one) for one in solution.changes],
        **some(solution, "runs", "seed", "finished", "notes"),
    }
    return dict(plain(told))


MOST: Final = 6
"""Most changes of one kind that are listed."""

ROUNDING: Final = 1e-9
"""A smaller relative change over one per cent of a key counts as none: a minimum is found only to
half of the digits, so its slope is not quite 0, nor is a root of 0."""

KINK: Final = 1e-4
"""A smaller relative change of a quantity across a change of course is not a jump."""


def remarks(solution: Solution) -> Iterator[str]:
    """Yield sentences below the table: how many answers, how near one came, where it jumps."""
    one, count = solution.ranges[0], len(solution.answers)
    for low, high in solution.everywhere:
        yield (
            f"Every {one.key} from {_size(low, one.unit)} to {_size(high, one.unit)} is a solution:"
            " the target does not depend on it there."
        )
    if count and solution.answer.place == "end":
        yield "It is at the end of the range: beyond it there may be better ones."
    if count and solution.answer.place == "change":
        yield "It is a limit: right beyond it the particle goes another way."
    if solution.goal == "solve" and count > 1:
        yield (
            f"{count} solutions; pictures and scene are of solution {solution.best + 1}, the"
            " nearest to the scene's own value. A narrower range chooses another."
        )
    if not count and solution.nearest is not None:
        near = solution.nearest
        numbers = zip(solution.quantities, solution.units, near.found, near.wanted, strict=False)
        parts = [
            f"{name} = {_size(found, unit)} instead of {_size(wanted, unit)}"
            for name, unit, found, wanted in numbers
        ]
        parts = parts or [
            f"{name} = {_size(found, unit)}"
            for name, unit, found in zip(
                solution.quantities, solution.units, near.found, strict=True
            )
        ]
        where = "in the range" if solution.finished else "yet"
        yield f"No solution {where}. Nearest to one: {', '.join(parts)}."
    elif not count and not solution.finished:
        yield "No solution yet: no variant that has run has all of this."
    elif not count and solution.goal == "solve":
        yield "No solution: no variant in the range has these quantities."
    elif not count:
        yield "No variant in the range has this quantity."
    unit, quantity = solution.units[0], solution.quantities[0]
    for jump in solution.jumps[:MOST]:
        yield (
            f"No solution at {one.key} = {_size(jump.at, one.unit)}: there {quantity} jumps over"
            f" the target, from {_size(jump.before, unit)} to {_size(jump.after, unit)}"
            f"{_ways(jump)}."
        )
    others = [
        change
        for change in solution.changes
        if change not in solution.jumps
        and not abs(change.after - change.before)
        <= KINK * max(abs(change.after), abs(change.before))
    ]
    for change in others[:MOST]:
        place = f"At {one.key} = {_size(change.at, one.unit)}"
        if NO_RUN in change.courses:
            side = "below" if change.courses[0] == NO_RUN else "above"
            yield f"{place} the runs end; {side} it: {change.fault}."
        elif isfinite(change.before + change.after):
            yield (
                f"{place} {quantity} jumps from {_size(change.before, unit)} to"
                f" {_size(change.after, unit)}{_ways(change)}."
            )
        else:
            side = "below" if isfinite(change.after) else "above"
            yield f"{place} {quantity} ends; {side} it there is none{_ways(change)}."
    if len(others) > MOST:
        yield f"There are {len(others) - MOST} further changes, see solve.json."
    yield from solution.notes


def _ways(change: Change) -> str:
    if change.courses[0] == change.courses[1]:
        return ""
    return f", as the particle touches [{change.courses[1]}] instead of [{change.courses[0]}]"


def _size(value: float, unit: str) -> str:
    if not isfinite(value):
        return "none"
    return write_size(value, unit, digits=6) if unit else f"{value:.6g}"
