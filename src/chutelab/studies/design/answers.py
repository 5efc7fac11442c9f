"""What `solve`, `minimize` and `maximize` answer: `Solution`, as numbers and in words.

The words say how many answers there are, where they stop, what is a jump, and what one per cent
does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, isnan
from typing import Any, Final

import numpy as np

from chutelab.engines.simulation import simulate
from chutelab.results import Recording
from chutelab.scene import Scene
from chutelab.scene.units import symbol, with_unit, write_size
from chutelab.studies.design.evaluation import NO_RUN, Span
from chutelab.studies.design.roots import Change, Scan
from chutelab.studies.design.sensitivity import Sensitivity
from chutelab.util.arrays import Floats
from chutelab.util.tables import Sheet, Shown, frame

DIGITS: Final = 10
"""Significant digits in which an answer is shown; it has more."""


@dataclass(frozen=True)
class Answer:
    """One point of the search.

    Attributes
    ----------
    values : tuple of float
        Of the varied keys, in their order.
    found : tuple of float
        The quantities asked for: the left sides of the targets, or what is least or largest.
    wanted : tuple of float
        The right sides of the targets; empty without targets.
    course : str
        Surfaces that particle 0 touches up to its landing.
    place : str
        "inside" the range, at an "end" of it, or at a "change" of the course.
    sensitivities : tuple of Sensitivity
        What each key does to each quantity here; empty for further answers of no interest.
    """

    values: tuple[float, ...]
    found: tuple[float, ...]
    wanted: tuple[float, ...]
    course: str
    place: str = "inside"
    sensitivities: tuple[Sensitivity, ...] = ()

    @property
    def off(self) -> tuple[float, ...]:
        """By how much the targets are missed."""
        return tuple(f - w for f, w in zip(self.found, self.wanted, strict=True))


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Shown):
    """What a search over one key or several found.

    Attributes
    ----------
    asked : str
        The question in words.
    goal : {"solve", "minimize", "maximize"}
        Its kind.
    ranges : tuple of Span
        The varied keys.
    quantities, units : tuple of str
        What the numbers of an answer are.
    answers : tuple of Answer
        All solutions in order of the key, or all minima, the least first; empty if there is none.
    nearest : Answer or None
        Without a solution, where the targets are missed by least.
    everywhere : tuple of (float, float)
        Ranges of the key in which every value is a solution.
    jumps : tuple of Change
        Where the target is jumped over, which is no solution.
    changes : tuple of Change
        All values of the key at which the course changes.
    best : int
        Which answer `scene` is at: of several solutions, the one nearest to the scene's own value.
    runs, seed : int
        How many variants were run; of the search over several keys.
    notes : tuple of str
        What else to know.
    base : Scene
        What was varied.
    scan : Scan or None
        What was looked at on the way, with one key.
    """

    asked: str
    goal: str
    ranges: tuple[Span, ...]
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    answers: tuple[Answer, ...]
    nearest: Answer | None
    everywhere: tuple[tuple[float, float], ...]
    jumps: tuple[Change, ...]
    changes: tuple[Change, ...]
    best: int
    runs: int
    seed: int
    notes: tuple[str, ...]
    base: Scene
    scan: Scan | None

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
            If there is not even that: no variant has the quantity.
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
        """Return what was looked at with one key as a pandas DataFrame.

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
        """Return the answers in a table, with what to know of them."""
        shown = self.answers or ((self.nearest,) if self.nearest else ())
        columns = ["", *(with_unit(one.key, one.unit) for one in self.ranges)]
        for name, unit in zip(self.quantities, self.units, strict=True):
            columns.append(with_unit(name, unit))
        rows = []
        for i, answer in enumerate(shown):
            name = "nearest" if not self.solved else self._name(i)
            numbers = (*answer.values, *answer.found)
            rows.append((name, *(f"{value:.{DIGITS}g}" for value in numbers), answer.course))
        return Sheet(self.asked, (*columns, "touches"), tuple(rows), notes=tuple(remarks(self)))

    def slopes(self) -> Sheet:
        """Return what each key does to each quantity at the answer, and what 1 % of it does."""
        return slopes(self.answer.sensitivities if self.solved else ())

    def __repr__(self) -> str:
        parts = (self.sheet(), self.slopes()) if self.solved else (self.sheet(),)
        return "\n\n".join(map(str, parts))

    def _repr_html_(self) -> str:
        parts = (self.sheet(), self.slopes()) if self.solved else (self.sheet(),)
        return "".join(part.html() for part in parts)

    def _name(self, i: int) -> str:
        if self.goal == "solve":
            return "solution" if len(self.answers) == 1 else f"solution {i + 1}"
        return {"minimize": "least", "maximize": "most"}[self.goal] if i == 0 else "also"


def finite(value: float) -> float | None:
    """Return a number as JSON has it: None for NaN and infinities."""
    return value if isfinite(value) else None


def as_dict(solution: Solution) -> dict[str, Any]:
    """Return a solution as plain lists and floats, for JSON."""

    def answer(one: Answer) -> dict[str, Any]:
        return {
            "values": dict(zip((r.key for r in solution.ranges), one.values, strict=True)),
            "found": dict(zip(solution.quantities, map(finite, one.found), strict=True)),
            "wanted": [finite(value) for value in one.wanted],
            "course": one.course,
            "place": one.place,
            "sensitivities": [
                {
                    "key": s.key, "quantity": s.quantity, "derivative": finite(s.derivative),
                    "step": s.step, "lower": finite(s.lower), "upper": finite(s.upper),
                    "courses": list(s.courses),
                }
                for s in one.sensitivities
            ],
        }  # fmt: skip

    def change(one: Change) -> dict[str, Any]:
        return {
            "at": one.at, "before": finite(one.before), "after": finite(one.after),
            "courses": list(one.courses), "fault": one.fault,
        }  # fmt: skip

    return {
        "format": 1,
        "scene": solution.base.title,
        "asked": solution.asked,
        "goal": solution.goal,
        "solved": solution.solved,
        "ranges": [
            {"key": r.key, "unit": r.unit, "low": r.low, "high": r.high, "start": r.start}
            for r in solution.ranges
        ],
        "quantities": dict(zip(solution.quantities, solution.units, strict=True)),
        "answers": [answer(one) for one in solution.answers],
        "best": solution.best if solution.solved else None,
        "nearest": answer(solution.nearest) if solution.nearest else None,
        "everywhere": [list(span) for span in solution.everywhere],
        "jumps": [change(one) for one in solution.jumps],
        "changes": [change(one) for one in solution.changes if not isnan(one.at)],
        "runs": solution.runs,
        "seed": solution.seed,
        "notes": list(solution.notes),
    }


MOST: Final = 6
"""Changes of one kind that are spelled out."""

ROUNDING: Final = 1e-10
"""Relative change over one per cent of a key that is none: a minimum is found to half of the
digits, and the slope there is what that leaves."""

KINK: Final = 1e-4
"""Relative change of a quantity across a change of course that is no jump."""


def asked(goal: str, what: str, ranges: Sequence[Span]) -> str:
    """Return the question in words."""
    spans = ", ".join(
        f"{one.key} from {one.low:g} to {one.high:g} {one.unit}".rstrip() for one in ranges
    )
    verb = {"solve": "Solve", "minimize": "Minimise", "maximize": "Maximise"}[goal]
    return f"{verb} {what}, {spans}"


def remarks(solution: Solution) -> list[str]:
    """Return sentences to be read below the table of answers."""
    said = [*_outcome(solution)]
    if solution.ranges and solution.scan is not None:
        said += _jumps(solution)
    return [*said, *solution.notes]


def _outcome(solution: Solution) -> Iterator[str]:
    key = solution.ranges[0].key
    unit = solution.ranges[0].unit
    for low, high in solution.everywhere:
        yield (
            f"Every {key} from {_size(low, unit)} to {_size(high, unit)} is a solution: the"
            " target does not depend on it there."
        )
    if solution.goal == "solve":
        yield from _solved(solution)
        return
    if not solution.answers:
        yield "No variant in the range has this quantity."
        return
    yield from _placed(solution)


def _placed(solution: Solution) -> Iterator[str]:
    if solution.answer.place == "end":
        yield "It is at the end of the range: beyond it there may be better ones."
    elif solution.answer.place == "change":
        yield "It is a limit: right beyond it the particle goes another way."


def _solved(solution: Solution) -> Iterator[str]:
    count = len(solution.answers)
    if count:
        yield from _placed(solution)
    if count > 1:
        yield (
            f"{count} solutions; pictures and scene are of solution {solution.best + 1}, the"
            " nearest to the scene's own value. A narrower range chooses another."
        )
    elif not count and not solution.everywhere:
        if solution.nearest is None:
            yield "No solution: no variant in the range has these quantities."
            return
        near = solution.nearest
        parts = [
            f"{name} = {_size(found, unit)} instead of {_size(wanted, unit)}"
            for name, unit, found, wanted in zip(
                solution.quantities, solution.units, near.found, near.wanted, strict=True
            )
        ]
        yield f"No solution in the range. Nearest to one: {', '.join(parts)}."


def _jumps(solution: Solution) -> Iterator[str]:
    unit, quantity = solution.units[0], solution.quantities[0]
    key = solution.ranges[0]
    for jump in solution.jumps[:MOST]:
        yield (
            f"No solution at {key.key} = {_size(jump.at, key.unit)}: there {quantity} jumps over"
            f" the target, from {_size(jump.before, unit)} to {_size(jump.after, unit)}"
            f"{_ways(jump)}."
        )
    others = [change for change in solution.changes if _tells(change, solution)]
    for change in others[:MOST]:
        place = f"At {key.key} = {_size(change.at, key.unit)}"
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


def _tells(change: Change, solution: Solution) -> bool:
    """Tell whether a change is worth a sentence: no kink, and not told as a jump already."""
    if change in solution.jumps:
        return False
    apart = abs(change.after - change.before)
    return not apart <= KINK * max(abs(change.after), abs(change.before))


def _ways(change: Change) -> str:
    if change.courses[0] == change.courses[1]:
        return ""
    return f", as the particle touches [{change.courses[1]}] instead of [{change.courses[0]}]"


def slopes(found: Sequence[Sensitivity]) -> Sheet:
    """Return sensitivities as a table."""
    rows = []
    for s in found:
        unit = symbol(s.unit)
        per = f"{s.quantity_unit} per {unit}" if unit else s.quantity_unit
        size = max(abs(s.lower), abs(s.upper)) if isfinite(s.lower + s.upper) else 0.0
        nothing = abs(s.derivative * s.step) <= ROUNDING * size
        number = "0" if nothing else f"{s.derivative:.6g}"
        slope = f"{number} {per}".strip() if isfinite(s.derivative) else "none here"
        rows.append((f"{s.quantity} by {s.key}", slope))
        for less, value, course in (
            ("less", s.lower, s.courses[0]), ("more", s.upper, s.courses[1])
        ):  # fmt: skip
            shown = _size(value, s.quantity_unit) if isfinite(value) else course
            rows.append((f"  with 1 % ({_size(s.step, s.unit)}) {less}", shown))
    return Sheet("", ("Sensitivity", "slope"), tuple(rows))


def _size(value: float, unit: str) -> str:
    if not isfinite(value):
        return "none"
    return write_size(value, unit, digits=6) if unit else f"{value:.6g}"
