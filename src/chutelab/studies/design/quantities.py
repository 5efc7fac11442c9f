"""What can be aimed at: numbers of a run, keys of the scene and plain numbers, with their units.

>>> from chutelab.scene import load
>>> left, right = target(load("perpendicular"), "landing.vx = outgoing.speed")
>>> left.unit, right.name
('m/s', 'outgoing.speed')

Also here: the course of a particle, which surfaces it touches up to its landing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby
from math import nan
from typing import Any, Final, Literal, TypeVar

from chutelab.results import REASONS, Kind, Recording
from chutelab.results.quantities import measured as read
from chutelab.scene import MISSING, Scene
from chutelab.scene.overrides import value_at
from chutelab.scene.quantities import Ending, lookup, suggestion, whose
from chutelab.scene.units import read_size
from chutelab.scene.variants import Vary, is_plain, quantity
from chutelab.util.errors import InputError
from chutelab.util.versions import library

T = TypeVar("T")


def each_once(
    option: str, given: Sequence[Any], read: Callable[[Any], T], ask: str, most: int
) -> tuple[T, ...]:
    """Read what an option takes, given 1 to `most` times; each result has another `key`."""

    def typed(one: Any) -> str:
        return one.typed if isinstance(one, Vary) else f"{option} {one}"

    if not given:
        raise InputError(ask, option)
    if len(given) > most:
        raise InputError(f"at most {most} keys are allowed", typed(given[most]))
    found: dict[str, T] = {}
    for text in given:
        one: Any = read(text)
        if one.key in found:
            raise InputError(f"{one.key} is given already", typed(text))
        found[one.key] = one
    return tuple(found.values())


def scipy(name: str) -> Any:
    """Return a module of SciPy, such as ``optimize``; without SciPy say what to install."""
    return library(f"scipy.{name}", "SciPy is needed", "design")


MANY: Final = 6
"""Touches of one surface in a row from which on they are not counted: a particle that bounces to
rest does so a thousand times, and extra bounces do not change the sequence of contacts."""

LONGEST: Final = 6
"""Surfaces that are named; longer sequences are cut off there."""


def courses_of(recording: Recording) -> list[str]:
    """Return the surfaces that each particle touches up to its landing.

    Such as ``plate, outgoing``, or ``plate, never lands (exit)``.
    """
    touched: list[list[int]] = [[] for _ in range(recording.count)]
    landed = [False] * recording.count
    events = recording.select(Kind.IMPACT, Kind.LANDING)
    columns = (events[name].tolist() for name in ("particle", "surface", "kind"))
    for particle, surface, kind in zip(*columns, strict=True):
        if not landed[particle]:
            touched[particle].append(surface)
            landed[particle] = kind == Kind.LANDING

    @cache
    def course(surfaces: tuple[int, ...], end: str) -> str:
        names = []
        for surface, group in groupby(surfaces):
            times = len(list(group))
            often = {1: "", 2: " twice"}.get(times, f" {times} times")
            often = often if times < MANY else " many times"
            names.append(f"{recording.surfaces[surface]}{often}")
        if len(names) > LONGEST:
            names[LONGEST - 1 :] = ["and so on"]
        return ", ".join([*names, end] if end else names)

    ends = [
        "" if down else f"never lands ({REASONS[reason]})"
        for down, reason in zip(landed, recording.ended.tolist(), strict=True)
    ]
    return [course(tuple(one), end) for one, end in zip(touched, ends, strict=True)]


@dataclass(frozen=True)
class Quantity:
    """A number of a run, the value of a key of the scene, or a plain number."""

    name: str
    """As it was asked for."""

    unit: str

    key: str = ""
    """Of a run: its name, see `chutelab.scene.quantities`. Of the scene: the full path."""

    source: Literal["run", "scene", "number"] = "run"
    ending: Ending = "any"
    number: float = 0.0

    def of(self, recording: Recording) -> Any:
        """Return its value, of each scene of a family (N,); NaN where it did not happen."""
        value: Any = self.number
        if self.source == "scene":
            family = recording.family if is_plain(self.key) else None
            value = family.at(self.key) if family else value_at(recording.scene, self.key)
            return nan if value is None or value is MISSING or isinstance(value, str) else value
        if self.source == "run":
            value = read(recording, self.key)
            value = value if recording.family else value[0]
        return value


def measured(scene: Scene, name: str, typed: str = "") -> Quantity:
    """Return the quantity of a scene that has this name; messages call it `typed`.

    Raises
    ------
    InputError
        If the scene has no such quantity.
    """
    row = lookup(name, scene.surfaces, [str(stream.name) for stream in scene.streams])
    if row is None:
        allowed = f"no such quantity here; {suggestion(name, scene.surfaces)}"
        raise InputError(allowed, typed or name)
    if which := whose(row, scene.count):
        raise InputError(which, typed or name)
    return Quantity(name, row.unit, name, ending=row.ending)


def target(scene: Scene, text: str) -> tuple[Quantity, Quantity]:
    """Read ``QUANTITY=VALUE``: a quantity, and the number, key or quantity that it is to equal.

    Raises
    ------
    InputError
        If it is not of that form, one of them is unknown, or their units differ.
    """
    typed = f"--target {text}"
    name, equals, given = (part.strip() for part in text.partition("="))
    if not (name and equals and given):
        raise InputError(
            "must be QUANTITY=VALUE, such as landing.x=1.2 or landing.vx=outgoing.speed", typed
        )
    left = measured(scene, name, typed)
    right = _right(scene, given, typed, left)
    if right.source == "number" and right.unit == "":
        right = replace(right, name=f"{right.name} {left.unit}".strip(), unit=left.unit)
    if right.unit != left.unit:
        raise InputError(
            f"{left.name} is {_in(left.unit)}, and {right.name} is {_in(right.unit)}", typed
        )
    if right == left:
        raise InputError("both sides are the same", typed)
    return left, right


def _in(unit: str) -> str:
    return f"in {unit}" if unit else "a pure number"


def _right(scene: Scene, text: str, typed: str, left: Quantity) -> Quantity:
    try:
        number, unit = read_size(text)
        return Quantity(f"{number:.12g} {unit}".strip(), unit, source="number", number=number)
    except ValueError as error:
        if text[0].isdigit() or text[0] in "+-.":
            allowed = f"{text} is no number of a quantity {_in(left.unit)}; {error}"
            raise InputError(allowed, typed) from None
    if lookup(text, scene.surfaces) is not None:
        return measured(scene, text, typed)
    try:
        found = quantity(scene, Vary(text, (0.0,), typed))
    except InputError as error:
        allowed = f"{text} is neither a number, nor a quantity, nor a key of the scene"
        raise InputError(f"{allowed}: {error.allowed}", typed) from None
    if not isinstance(value_at(scene, found.path), (int, float)):
        raise InputError(f"{found.path} has no number as its value in this scene", typed)
    return Quantity(found.path, found.unit, found.path, "scene")
