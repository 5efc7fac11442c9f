"""A solution in words: how many, where they stop, what is a jump and what one per cent does."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Final

from chutelab.design.evaluation import NO_RUN
from chutelab.scene.units import symbol, write_size
from chutelab.sheet import Sheet

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from chutelab.design.answers import Solution
    from chutelab.design.pieces import Change
    from chutelab.design.ranges import Span
    from chutelab.design.sensitivity import Sensitivity

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
