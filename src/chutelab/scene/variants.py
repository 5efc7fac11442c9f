"""Variants of one scene: the varied keys and their values.

Scenes that differ in plain numbers only are a `Family`: one of them, and a column for each key.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, reduce
from math import inf, isfinite, nan, prod
from operator import getitem
from typing import Any, Final

import numpy as np

from chutelab.scene import Scene, SceneError, from_dict, plain, to_dict
from chutelab.scene.conflicts import Check, checks
from chutelab.scene.look import EITHER, NO_MACHINE, Look
from chutelab.scene.materials import Material, Particle
from chutelab.scene.overrides import (
    Override,
    apply,
    joined,
    limits_of,
    parts_of,
    resolved,
    rule_at,
    unit_of,
)
from chutelab.scene.schema import DEFAULTS, plain_number
from chutelab.scene.tables import Stream
from chutelab.scene.units import Table, read_any, sphere_mass
from chutelab.util.arrays import Bools, Floats
from chutelab.util.errors import MISSING, InputError, about_comma

RANGE: Final = "must have two ends, such as -20 and 70"

NUMBERS: Final = "must be a list of numbers, or of texts such as 4 mm"


@dataclass(frozen=True)
class Vary:
    """A key of the scene and the values it takes."""

    key: str  # full path of the key, such as plate.angle_deg or surface.hood.speed
    values: tuple[float, ...]  # in the order of variation; in the key's unit
    # its name in messages; on the command line as it was typed
    typed: str = field(default="", compare=False)
    # the unit that was written with the values, "" for none; `quantity` refuses a wrong one
    unit: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if not self.typed:
            object.__setattr__(self, "typed", f"vary {self.key}")
        if not self.values:
            raise InputError("at least one value is needed", self.typed)
        if not all(isfinite(value) for value in self.values):
            raise InputError("only finite numbers are allowed", self.typed)


Varied = Sequence[Vary] | Mapping[str, Sequence[float | str]]
"""Keys that vary and their values, see `varied`."""


@dataclass(frozen=True)
class Range(Vary):
    """A key of the scene and the ends of a range from which samples are drawn."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.values) != 2:
            raise InputError(RANGE, self.typed)
        low, high = self.values
        if low >= high:
            raise InputError(f"the range is empty: from {low:g} to {high:g}", self.typed)


def refuse_texts(given: Any, option: str, example: str) -> None:
    """Refuse the form of the command line; show that of Python."""
    texts = [given] if isinstance(given, str) else () if isinstance(given, Mapping) else given
    if any(isinstance(one, str) for one in texts):
        raise InputError(f"KEY=... is for the command line; in Python it is {example}", option)


def varied(varies: Varied, kind: type[Vary]) -> list[Vary]:
    """Return the varied keys as a list of one kind, `Vary` or `Range`.

    It is given as such a list, or as values by key: numbers, or texts with a unit.
    """
    refuse_texts(varies, "vary", '{"plate.angle_deg": [0, 30, 60]}')
    if not isinstance(varies, Mapping):
        return list(varies)
    found = []
    for key, values in varies.items():
        typed = f"vary {key}"
        if isinstance(values, str) or not hasattr(values, "__len__"):
            raise InputError(NUMBERS, typed)
        read, unit = numbers(typed, plain(values), NUMBERS)
        # + 0.0: there is one zero.
        found.append(kind(key, tuple(number + 0.0 for number in read), typed, unit))
    return found


def numbers(typed: str, parts: Sequence[Any], form: str) -> tuple[tuple[float, ...], str]:
    """Return numbers, with or without unit, in the SI unit, and that unit; "" without one.

    Numbers are taken as they are, other parts are read as texts.

    Raises an `InputError` if one is not a number; its message has `form`, what is allowed.
    """
    values, units = [], set()
    for part in parts:
        value, unit = (part, "") if type(part) is float else read_any(str(part))
        if not isfinite(value):
            found = str(part).strip() or "nothing"
            raise InputError(f"{found} is not a number; it {form}{about_comma(found)}", typed)
        values.append(value)
        if unit or value != 0.0:
            units.add(unit)
    if len(units) > 1:
        raise InputError("give all numbers in one kind of unit, or all without", typed)
    return tuple(values), units.pop() if units else ""


@dataclass(frozen=True)
class Quantity:
    """Description of a varied key."""

    path: str  # the key as messages have it; free surfaces by index
    # its definition, up to the first semicolon or colon; for a free surface after its name
    label: str
    unit: str  # "" for a pure number; "degrees" for angles
    whole: bool = False  # whether it takes whole numbers only


def quantity(scene: Scene, vary: Vary) -> Quantity:
    """Describe a varied key of a scene; an `InputError` if it is unknown, or not a number."""
    document = plain(to_dict(scene))
    faults, _ = apply(document, [Override(vary.key, plain_number(vary.values[0]))])
    if faults:
        raise InputError(faults[0].allowed, vary.typed)
    parts = resolved(document, vary.key)
    path, indexed = joined(parts), isinstance(parts[-1], int)
    while isinstance(parts[-1], int):
        parts.pop()
    about = rule_at(parts)
    if about is None:
        text = "unknown key; `chutelab schema` lists all"
        try:
            from_dict(document)
        except SceneError as error:
            # The scene's definition of it.
            said = (one for one in error.faults if one.value is not MISSING)
            text = next((one.allowed for one in said if path.startswith(one.key)), text)
        raise InputError(text, vary.typed)
    kinds = {kind.get("type") for kind in about.get("anyOf", [about])}
    if not (indexed or kinds & {"number", "integer"}) or parts[0] in NO_MACHINE:
        raise InputError(f"{path} is no number, and only numbers can be varied", vary.typed)
    unit = unit_of(parts)
    if vary.unit not in ("", unit) and (vary.unit, unit) != ("%", ""):
        own = f"is in {unit}" if unit else "is a pure number"
        raise InputError(f"{path} {own}, not in {vary.unit}; plain numbers will do", vary.typed)
    if indexed:
        return Quantity(path, path, unit)
    label = re.split("[;:]", str(about.get("description", path)))[0].removesuffix(".")
    label = label.removesuffix(f" ({unit})").replace("->", "→")
    if len(parts) > 2 and isinstance(parts[1], int):
        row = getattr(scene, EITHER.get(str(parts[0]), str(parts[0])))[parts[1]]
        name = getattr(row, "name", None) or f"{parts[0]}[{parts[1]}]"
        label = f"{name}: {label[0].lower()}{label[1:]}"
    return Quantity(path, label, unit, whole="number" not in kinds)


def quantities(scene: Scene, varies: Sequence[Vary]) -> tuple[Quantity, ...]:
    """Describe each of the varied keys; an `InputError` also if two are equal."""
    found: list[Quantity] = []
    for vary in varies:
        one = quantity(scene, vary)
        if any(one.path == other.path for other in found):
            raise InputError(f"{one.path} is varied already", vary.typed)
        found.append(one)
    return tuple(found)


def count_of(varies: Sequence[Vary], most: float = inf) -> int:
    """Return the number of combinations; an `InputError` if it is more than `most`."""
    total = prod(len(vary.values) for vary in varies)
    if total > most:
        counts = "".join(f"{len(vary.values)} × " for vary in varies[:-1])
        text = f"{counts}{len(varies[-1].values)} variants, at most {most} are allowed"
        raise InputError(text, varies[-1].typed)
    return total


MOST_SEEDS: Final = 1000
"""Most runs of one scene with other seeds; the error falls only with the root of their number."""


def reseeded(scene: Scene, number: int) -> Scene:
    """Return a scene with other draws: `number` is added to the seed of each stream."""
    if not number:
        return scene
    paths = [f"stream[{n}].seed" for n in range(len(scene.streams))]
    if len(paths) == 1:
        paths = ["stream.seed"]
    seeds = [(stream.seed + number) % 2**63 for stream in scene.streams]
    return scene.with_values(dict(zip(paths, seeds, strict=True)))


def drawn(scene: Scene, repeat: int, keys: Sequence[str] = ()) -> None:
    """Refuse an invalid number of seeds, or a scene in which nothing is drawn.

    Raises an `InputError`; `keys` are those that vary.
    """
    typed = f"--repeat {repeat}"
    if not 1 <= repeat <= MOST_SEEDS:
        raise InputError(f"must be a whole number from 1 to {MOST_SEEDS}", typed)
    several = scene.count > len(scene.streams) or any(key.endswith("count") for key in keys)
    if repeat > 1 and not several:
        raise InputError(
            "nothing is drawn at random for a single particle: all seeds give the same", typed
        )


def reason(error: SceneError) -> str:
    """Return the faults of a scene without its file, in one line."""
    return "; ".join(str(fault) for fault in error.faults)


COORDINATES: Final = ("at", "center", "pivot", "points", "velocity")
"""Keys of points and vectors, whose entries may differ within a `Family`."""


def is_plain(path: str) -> bool:
    """Whether scenes that differ in a key, or a coordinate, are a `Family`: a plain number."""
    parts = parts_of(path)
    key = next(part for part in reversed(parts) if isinstance(part, str))
    single = isinstance(parts[-1], str) or key in COORDINATES
    return single and limits_of(rule_at(parts) or {}) is not None


def accepted(path: str, values: Floats) -> Bools:
    """Return which values a key that `is_plain` accepts by itself, (N,)."""
    rule = rule_at(parts_of(path)) or {}
    low, high = limits_of(rule) or (nan, nan)
    too_little = rule.get("not", {"exclusiveMinimum": low, "exclusiveMaximum": low})
    little = (too_little["exclusiveMinimum"] < values) & (values < too_little["exclusiveMaximum"])
    return np.asarray(np.isfinite(values) & (low <= values) & (values <= high) & ~little)


class Judge:
    """Finds scenes that contradict themselves, among variants whose keys are valid by themselves.

    Expectations do not concern varied numbers, so they are left out. A check that reads none of the
    varied keys finds the same in all variants, and is made once.
    """

    def __init__(self, scene: Scene, paths: tuple[str, ...]) -> None:
        self.scene, self.paths = scene, paths
        self.example: Scene | None = None  # a variant that is valid, if one is known
        self._document = plain(to_dict(scene)) | {"expect": []}
        self._places: dict[str, tuple[Any, Any]] = {}
        self._telling: list[Check] = []
        self._always = False
        self.look: Look | None = None

    def reads(self, path: str) -> bool:
        """Whether the value of a key decided a result; others have no effect."""
        # A rule uses a whole point, of which one coordinate may vary.
        asked = () if self.look is None else self.look.asked
        return any(f"{path}[".startswith(f"{key}[") for key in asked)

    def finds(self, values: Mapping[str, float]) -> bool:
        """Whether the scene with some values, by full path, has a fault.

        Each call takes all keys that vary.
        """
        if self.look is None:
            self._begin(values)
        for path, value in values.items():
            table, key = self._places[path]
            table[key] = value
        # All are made: what one reads is told by `reads`.
        faults = [fault for check in self._telling for fault in check()]
        return self._always or bool(faults)

    def _begin(self, values: Mapping[str, float]) -> None:
        """Write all keys that vary, and find which checks read them."""
        apply(self._document, [Override(path, value) for path, value in values.items()])
        for path in values:
            *way, key = resolved(self._document, path)
            self._places[path] = reduce(getitem, way, self._document), key
        self.look = Look(self._document, DEFAULTS)
        asked = set[str]()
        for check in checks(self.look):
            self.look.asked = set()
            found = any([*check()])
            asked |= self.look.asked
            if any(map(self.reads, values)):
                self._telling.append(check)
            else:
                self._always |= found
        self.look.asked = asked


@dataclass(frozen=True, eq=False)
class Family:
    """Scenes that differ only in plain numbers: a batch, one row of numbers each.

    There is a row for each of the N particles, scene by scene.
    """

    scene: Scene  # one of them, validated, with the values that do not vary
    columns: Mapping[str, Floats]  # the numbers of each key that varies, by its full path
    each: int = 1  # particles of a scene, which do not meet and are of one kind

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @cached_property
    def firsts(self) -> Family:
        """The same with one row per scene."""
        if self.each == 1:
            return self
        return Family(self.scene, {key: rows[:: self.each] for key, rows in self.columns.items()})

    @cached_property
    def _own(self) -> dict[tuple[int, str], dict[tuple[int, ...], Floats]]:
        """The columns by table and key, and by their place in a list; () without one."""
        found: dict[tuple[int, str], dict[tuple[int, ...], Floats]] = {}
        for path, numbers in self.columns.items():
            table, key, place = self._home(path)
            found.setdefault((id(table), key), {})[place] = numbers
        return found

    def _home(self, path: str) -> tuple[Table, str, tuple[int, ...]]:
        """Return the table of a path, its key there, and the place in the key's list."""
        parts, place = list(parts_of(path)), tuple[int, ...]()
        while isinstance(parts[-1], int):
            place = (int(parts.pop()), *place)
        *parts, key = parts
        table: Any = self.scene
        if parts:
            table = getattr(table, EITHER.get(str(parts[0]), str(parts[0])))
        if isinstance(table, tuple):
            table = table[int(parts[1]) if len(parts) > 1 else 0]
        return table, str(key), place

    def at(self, path: str) -> Any:
        """Return the number at a path, see `is_plain`; an array (N,) if it varies."""
        table, key, place = self._home(path)
        found = self.value(table, key)
        for n in place:
            found = found[n]
        return found

    def value(self, table: Table, key: str) -> Any:
        """Return the value of a key of a table of `scene`.

        An array (N,) if it varies, or is a default that follows from varied keys; for a point or
        vector one for each varied coordinate.
        """
        scene, own = self.scene, self._own.get((id(table), key))

        def laid(entry: Any, *place: int) -> Any:
            """Return a number, or a list of them, with the columns in their places."""
            if own and place in own:
                return own[place]
            nested = isinstance(entry, tuple)
            return tuple(laid(e, *place, n) for n, e in enumerate(entry)) if nested else entry

        if own:
            return laid(getattr(table, key))
        if isinstance(table, Particle) and key == "mass":
            density = scene.density(table, self.value)
            if density is not None:
                return sphere_mass(density, self.value(table, "radius"))
        elif isinstance(table, Stream) and key == "rate" and table.mass_rate is not None:
            number = next(n for n, stream in enumerate(scene.streams) if stream is table)
            kind = scene.particles[scene.kinds[number]]
            mass = kind.mean_of(self.value(kind, "mass"))
            return table.mass_rate / mass / scene.slices(number, self.value)
        elif key in table.model_fields_set:
            return getattr(table, key)
        elif isinstance(table, Material) and key.endswith(("_steel", "_rubber")):
            return self.value(table, key.partition("_")[0])
        elif table is scene.outgoing and key == "speed" and scene.incoming is not None:
            return self.value(scene.incoming, "speed")
        elif table is scene.plate and key == "pivot_height" and scene.incoming is not None:
            return self.value(scene.incoming, "pulley_radius")
        return getattr(table, key)

    def met(self, kind: int, other: int | str) -> tuple[Any, Any]:
        """Return restitution and friction of two, see `Scene.met`; arrays (N,) where they vary."""
        return self.scene.meetings(self.value)(kind, other)

    @property
    def rate(self) -> Any:
        """Particles per second of the first stream, of all its width."""
        return self.value(self.scene.stream, "rate") * self.scene.slices(0, self.value)
