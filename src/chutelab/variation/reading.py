"""What ``--vary`` takes, as it is written: keys, and the values or ranges of each.

>>> parse("plate.angle_deg=0:60:4").values
(0.0, 20.0, 40.0, 60.0)
>>> parse("incoming.speed=1,2.5").values
(1.0, 2.5)
>>> parse("plate.distance=50cm,1m").values
(0.5, 1.0)
>>> parse_range("plate.angle_deg=0:60").values
(0.0, 60.0)
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from math import isfinite
from typing import TYPE_CHECKING, Final

from chutelab.scene.units import read_size

if TYPE_CHECKING:
    from collections.abc import Sequence

MOST_VALUES: Final = 10_000
"""Values of one key; more would be a slip of the keyboard."""

FORM: Final = "must be KEY=FROM:TO:COUNT, such as plate.angle_deg=-20:70:46, or KEY=a,b,c"

RANGE_FORM: Final = "must be KEY=FROM:TO, such as plate.angle_deg=-20:70"

_WITH_UNIT: Final = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?) *([^\s\d].*)?")


class VaryError(ValueError):
    """What cannot be varied so; the text says what was given, and what is allowed."""

    def __init__(self, typed: str, allowed: str) -> None:
        super().__init__(f"{typed}: {allowed}")


@dataclass(frozen=True)
class Vary:
    """A key of the scene and the values it takes.

    Attributes
    ----------
    key : str
        Full path of the key, such as ``plate.angle_deg`` or ``surface.hood.speed``.
    values : tuple of float
        In the order they are gone through; in the key's unit.
    typed : str
        What messages call it; by default as on the command line.
    unit : str
        The unit that was written with the values, "" for none; `quantity` refuses a wrong one.
    """

    key: str
    values: tuple[float, ...]
    typed: str = field(default="", compare=False)
    unit: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if not self.typed:
            object.__setattr__(self, "typed", f"--vary {self.key}=...")
        if not self.values:
            raise VaryError(self.typed, "at least one value is needed")
        if not all(isfinite(value) for value in self.values):
            raise VaryError(self.typed, "only finite numbers are allowed")


@dataclass(frozen=True)
class Range(Vary):
    """A key of the scene and the two ends of what it may be, to draw samples from."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.values) != 2:
            raise VaryError(self.typed, RANGE_FORM)
        low, high = self.values
        if low >= high:
            raise VaryError(self.typed, f"the range is empty: from {low:g} to {high:g}")


def parse(text: str) -> Vary:
    """Read what ``--vary`` takes; numbers may have a unit, such as 0.5mm.

    Raises
    ------
    VaryError
        If it is not of the form, no number, an empty range, or too many values.
    """
    typed, key, given = _parted(text, FORM)
    if ":" not in given:
        parts = given.split(",")
        if len(parts) > MOST_VALUES:
            raise VaryError(typed, f"{len(parts)} values, at most {MOST_VALUES} are allowed")
        values, unit = _numbers(typed, parts, FORM)
        return Vary(key, values, typed, unit)
    parts = given.split(":")
    if len(parts) != 3:
        raise VaryError(typed, FORM)
    (first, last), unit = _numbers(typed, parts[:2], FORM)
    count = _count(typed, parts[2])
    if count > 1 and first == last:
        raise VaryError(typed, f"the range is empty: from {first:g} to {last:g}")
    return Vary(key, _even(first, last, count), typed, unit)


def parse_range(text: str) -> Range:
    """Read what ``--vary`` takes where samples are drawn: ``KEY=FROM:TO``.

    Raises
    ------
    VaryError
        If it is not of the form, no number, or an empty range.
    """
    typed, key, given = _parted(text, RANGE_FORM)
    parts = given.split(":")
    if len(parts) != 2:
        raise VaryError(typed, f"samples are drawn between two ends: it {RANGE_FORM}")
    values, unit = _numbers(typed, parts, RANGE_FORM)
    return Range(key, values, typed, unit)


def _parted(text: str, form: str) -> tuple[str, str, str]:
    typed = f"--vary {text}"
    key, equals, given = (part.strip() for part in text.partition("="))
    if not (key and equals and given):
        raise VaryError(typed, form)
    return typed, key, given


def _numbers(typed: str, parts: Sequence[str], form: str) -> tuple[tuple[float, ...], str]:
    """Return numbers in the SI unit, and which that is; "" if none was written."""
    read = [_number(typed, part, form) for part in parts]
    units = {unit for value, unit in read if unit or value != 0.0}
    if len(units) > 1:
        raise VaryError(typed, "give all numbers in one kind of unit, or all without")
    return tuple(value for value, _ in read), units.pop() if units else ""


def _number(typed: str, text: str, form: str) -> tuple[float, str]:
    try:
        return read_size(text)
    except ValueError:
        # A unit without prefixes, such as kg, is as good if it is the key's.
        match = _WITH_UNIT.fullmatch(text.strip())
    value = float(match[1]) if match else float("nan")
    if match is None or not isfinite(value):
        raise VaryError(typed, f"{text.strip() or 'nothing'} is not a number; it {form}")
    return value, match[2]


def _count(typed: str, text: str) -> int:
    allowed = f"COUNT = {text.strip() or 'nothing'}; it must be a whole number from 1"
    try:
        count = int(text)
    except ValueError:
        raise VaryError(typed, f"{allowed} to {MOST_VALUES}") from None
    if not 1 <= count <= MOST_VALUES:
        raise VaryError(typed, f"{allowed} to {MOST_VALUES}")
    return count


def _even(first: float, last: float, count: int) -> tuple[float, ...]:
    """Return evenly spaced values; 0.3 is 0.3, not 0.30000000000000004."""
    if count == 1:
        return (first,)
    size = max(abs(first), abs(last))
    digits = 12
    values = []
    for i in range(count):
        value = first + (last - first) * i / (count - 1)
        # What is left of a 0 by rounding is a 0.
        values.append(0.0 if abs(value) < 1e-13 * size else float(f"{value:.{digits}g}"))
    values[0], values[-1] = first, last
    return tuple(values)
