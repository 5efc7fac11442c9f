"""What no single key can answer for: conflicts between keys, and ``[[expect]]``.

Every rule is written so that it speaks only when a comparison is *true*. A `Look` answers NaN for
a key that is itself at fault, and nothing is true of NaN: so the rules can be asked about a
half-broken scene, and all faults of a file come out in one message.

What a scene is expected to show, for ``chutelab verify``, goes by the names of a run's quantities,
which are listed here with their units.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from chutelab.scene.units import (
    LARGEST,
    Number,
    Share,
    Table,
    Text,
    described,
    read_size,
    write_size,
)
from chutelab.util.errors import MISSING, Fault, did_you_mean

SYMBOLS: Final = {
    "phi1_deg": "degrees", "t2": "s", "x2": "m", "y2": "m", "v2": "m/s", "phi2_deg": "degrees",
    "phi2r_deg": "degrees", "v2r": "m/s", "t3": "s", "x3": "m", "y3": "m", "v3x": "m/s",
    "v3y": "m/s", "v3": "m/s", "d3": "m", "dEk": "J", "P": "W", "belt_work": "J",
    "slip_heat": "J",
}  # fmt: skip
"""Particle 0 under the paper's symbols, with units: what the theory has, too."""

_UNITS: Final = {
    "t": "s", "x": "m", "y": "m", "vx": "m/s", "vy": "m/s", "vx_after": "m/s", "vy_after": "m/s",
}  # fmt: skip
STATISTICS: Final = ("mean", "spread", "min", "max")
ENTRIES: Final = ("belt_work", "restitution_loss", "friction_loss")
STORED: Final = ("kinetic", "potential")
TOTALS: Final = (*ENTRIES, "residual", "turned_over")
ENDINGS: Final = ("time", "landed", "settled", "exit", "stopped")
NEEDED: Final = {"separation": "incoming", "impact": "plate", "landing": "outgoing"}
"""Events, and the table without which there are none; impacts on free surfaces go by name."""


def unit_of(name: str, surfaces: Iterable[str]) -> str | None:
    """Return the unit of a quantity, "" for a number of things; None if the scene has none such.

    Names are such as ``x2``, ``landing.x``, ``landing.x.mean``, ``impact.ramp.t``,
    ``landing.count``, ``ended.settled``, ``ledger.belt_work``, ``ledger.kinetic.end`` or
    ``ledger.by_surface.outgoing.belt_work``; the surfaces are all that the scene has.

    Examples
    --------
    >>> unit_of("landing.x.mean", ["incoming", "outgoing"]), unit_of("impact.t", [])
    ('m', None)
    """
    return _units(tuple(surfaces)).get(name)


@lru_cache(maxsize=8)
def _units(surfaces: tuple[str, ...]) -> dict[str, str]:
    """Return the units of all quantities of a scene with these surfaces, by name."""
    events = {event: _UNITS for event, home in NEEDED.items() if home in surfaces}
    if "separation" in events:
        events["separation"] = {k: u for k, u in _UNITS.items() if not k.endswith("_after")}
    events |= {f"impact.{name}": _UNITS for name in surfaces if name not in NEEDED.values()}
    units = dict(SYMBOLS) if {"incoming", "plate"} <= set(surfaces) else {}
    units |= {"contacts": "", **{f"ended.{ending}": "" for ending in ENDINGS}}
    units |= {f"{event}.count": "" for event in events}
    for event, columns in {**events, "ended": {"t": "s"}}.items():
        for column, unit in columns.items():
            units[f"{event}.{column}"] = unit
            units |= {f"{event}.{column}.{statistic}": unit for statistic in STATISTICS}
    units |= {f"ledger.{total}": "J" for total in TOTALS}
    units |= {f"ledger.{stored}.{end}": "J" for stored in STORED for end in ("start", "end")}
    for name in (*surfaces, "particles"):
        units |= {f"ledger.by_surface.{name}.{entry}": "J" for entry in ENTRIES}
    return units


def suggestion(name: str, surfaces: Iterable[str]) -> str:
    """Say which quantity was probably meant, or else which there are."""
    known = list(surfaces)
    absent = [table for table in NEEDED.values() if table not in known]
    for tables in (*([table] for table in absent), absent):
        if tables and unit_of(name, [*known, *tables]) is not None:
            return f"it needs {' and '.join(f'[{table}]' for table in tables)}"
    some = [f"{event}.x" for event, home in NEEDED.items() if home in known]
    keys = ", ".join([*some, "contacts", "ledger.belt_work"])
    theirs = "phi1_deg to slip_heat, " if {"incoming", "plate"} <= set(known) else ""
    there_are = f"there are {theirs}{keys} and other keys of `chutelab run --json`"
    # Of a thousand surfaces some will do: looking for likeness takes long.
    return did_you_mean(name, _units(tuple(known[:50])), there_are)


THEORY: Final = "theory"
UNPROMISED: Final = "none"

Value = Annotated[Number, Field(ge=-(LARGEST**2), le=LARGEST**2)]
Words = Annotated[Text, Field(max_length=40)]


class Expect(Table):
    """A number that a run of the scene should show, how exactly, and who says so."""

    quantity: Text = described(
        ...,
        "What is looked at: a paper's symbol such as x2 or phi1_deg, or a key of the JSON summary "
        "such as landing.x, landing.x.mean, ledger.by_surface.outgoing.belt_work",
        max_length=200,
    )
    value: Literal["theory"] | Value = described(
        ...,
        'What it should be, in its unit (SI; degrees for names in _deg), or "theory": what the '
        "closed form gives",
    )
    tolerance: Share | Words = described(
        ...,
        "What it may be off: a number is relative (0.01 is 1 %; of the value, or of what such "
        'quantities are measured by in the scene if that is more), a string absolute ("0.5 mm")',
    )
    tolerance_contact: Share | Words | None = described(
        None, 'The same for the contact engine, or "none"; default: tolerance'
    )
    tolerance_pymunk: Share | Words | None = described(
        None, 'The same for the pymunk engine, or "none"; default: tolerance'
    )
    source: Text = described(
        ..., "Who says so: an equation or a table of the paper, a closed form", max_length=200
    )

    def allowed(self, engine: str) -> tuple[float, str] | None:
        """Return the tolerance for an engine: its size, and its unit ("%" if it is relative).

        None if nothing is promised.
        """
        own = {"contact": self.tolerance_contact, "pymunk": self.tolerance_pymunk}.get(engine)
        tolerance = self.tolerance if own is None else own
        if tolerance == UNPROMISED:
            return None
        return read_size(tolerance) if isinstance(tolerance, str) else (tolerance, "%")


ON_BELT: Final = 1e-9
"""How near to the belt's height R + r a release counts as lying on the belt, m."""


class ConflictError(ValueError):
    """Carries the faults of a rule through Pydantic's validation."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__("; ".join(str(fault) for fault in faults))
        self.faults = list(faults)


class Look:
    """Read-only look at a scene's tables, as its file has them or as it dumps them, sound or not.

    The defaults come from `model`, which is `Scene`; `faulty` holds the full paths that are already
    known to be at fault, `asked` the keys whose values were asked for: the rules can depend on no
    others.
    """

    def __init__(self, document: Mapping[str, Any], model: Any, faulty: Collection[str] = ()):
        self._document = document
        self._model = model
        self._faulty = faulty
        self.asked: set[str] = set()

    def sound(self, path: str) -> bool:
        """Whether neither the key, nor its table, nor anything inside it is at fault."""
        return not any(
            f == path or f.startswith((path + ".", path + "[")) or path.startswith(f + ".")
            for f in self._faulty
        )

    def has(self, table: str) -> bool:
        """Whether the table is there, sound or not; one that is only misspelt is at fault."""
        return self._document.get(table) is not None or table in self._faulty

    def given(self, table: str, key: str) -> bool:
        """Whether the key is written out, sound or not."""
        content = self._document.get(table)
        return isinstance(content, Mapping) and content.get(key) is not None

    def __call__(self, table: str, key: str) -> Any:
        """Return the value of a key, or its default; NaN if it is at fault or its table absent."""
        self.asked.add(f"{table}.{key}")
        if not self.sound(f"{table}.{key}"):
            return math.nan
        if self.given(table, key):
            return self._document[table][key]
        if not self.has(table) and self._model.model_fields[table].default is None:
            return math.nan
        return self._model.tables()[table].model_fields[key].default

    def several(self, key: str) -> list[Any]:
        """Return ``[[surface]]`` or ``[[expect]]``, as far as it is a list at all."""
        found = self._document.get(key)
        return list(found) if isinstance(found, list | tuple) else []


def conflicts(look: Look) -> Iterator[Fault]:
    """Yield every conflict between keys; each names all the keys concerned."""
    yield from _tables(look)
    yield from _engine(look)
    yield from _release(look)
    yield from _surfaces(look)
    yield from _expectations(look)


def _tables(look: Look) -> Iterator[Fault]:
    needy = [f"[{table}]" for table in ("plate", "outgoing") if look.has(table)]
    if needy and not look.has("incoming"):
        need = "needs" if len(needy) == 1 else "need"
        yield Fault("incoming", MISSING, f"{' and '.join(needy)} {need} the table [incoming]")
    if look("plate", "above") == 0.0 and look("plate", "below") == 0.0:
        yield Fault("plate.above", 0.0, "a plate needs a length; plate.below is 0 too")
    if look("outgoing", "drop_from") == "impact" and not look.has("plate"):
        text = 'needs the table [plate]; without one write outgoing.drop_from = "top"'
        yield Fault("outgoing.drop_from", "impact", text)
    if look("run", "until") == "landed" and not look.has("outgoing"):
        text = 'needs the table [outgoing]; without one "settled" or a number of seconds'
        yield Fault("run.until", "landed", text)


def _engine(look: Look) -> Iterator[Fault]:
    radius, engine = look("particle", "radius"), look("run", "engine")
    interact = look("stream", "interact") is True
    if radius == 0.0:
        if look("particle", "spin") is True:
            text = "particle.radius is 0, and a mass point cannot turn"
            yield Fault("particle.spin", True, text)
        if engine in ("contact", "pymunk"):
            text = f"particle.radius is 0, and {engine} needs disks (> 0)"
            yield Fault("run.engine", engine, text)
        if interact:
            text = "particle.radius is 0, and mass points never meet"
            yield Fault("stream.interact", True, text)
    count = look("stream", "count")
    if interact and engine == "exact" and count > 1:
        text = f"stream.interact with stream.count = {count} needs contact or pymunk"
        yield Fault("run.engine", engine, text)


def _release(look: Look) -> Iterator[Fault]:
    if not look.has("incoming"):
        for key, what in (("at", "release point [x, y], m"), ("velocity", "[vx, vy], m/s")):
            if not look.given("stream", key) and look.sound(f"stream.{key}"):
                yield Fault(f"stream.{key}", MISSING, f"{what}; required without [incoming]")
        return
    on_belt = not look.given("stream", "at")
    if look.given("stream", "at") and look.sound("stream.at"):
        x, y = look("stream", "at")
        height = look("incoming", "pulley_radius") + look("particle", "radius")
        on_belt = -look("incoming", "length") <= x <= 0.0 and abs(y - height) <= ON_BELT
    if look("incoming", "friction") != "adhesion" or not on_belt:
        return
    advice = 'incoming.friction = "adhesion" releases every particle at incoming.speed'
    if look("stream", "speed_spread") > 0.0:
        text = f"{advice}; give a Coulomb coefficient, or speed_spread = 0"
        yield Fault("stream.speed_spread", look("stream", "speed_spread"), text)
    if look.given("stream", "velocity") and look.sound("stream.velocity"):
        velocity, speed = look("stream", "velocity"), look("incoming", "speed")
        if abs(velocity[0] - speed) > 1e-12 * abs(speed) or velocity[1] != 0.0:
            text = f"{advice}; give a Coulomb coefficient, or leave the velocity out"
            yield Fault("stream.velocity", velocity, text)


def _surfaces(look: Look) -> Iterator[Fault]:
    first: dict[str, int] = {}
    for index, surface in enumerate(look.several("surface")):
        if not isinstance(surface, Mapping):
            continue
        yield from surface_conflicts(f"surface[{index}]", surface)
        name = surface.get("name")
        if isinstance(name, str):
            if name in first:
                text = f"must be unique; surface[{first[name]}].name is the same"
                yield Fault(f"surface[{index}].name", name, text)
            first.setdefault(name, index)


def surface_conflicts(path: str, surface: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield what is wrong with how one free surface is laid out; `path` is the surface's own."""
    start, to, points = (surface.get(key) for key in ("from", "to", "points"))
    if points is not None:
        for key, value in (("from", start), ("to", to)):
            if value is not None:
                text = f"give either from and to, or {path}.points, not both"
                yield Fault(f"{path}.{key}", value, text)
    elif start is None and to is None:
        yield Fault(f"{path}.points", MISSING, "give from and to, or points = [[x, y], ...]")
    elif start is None or to is None:
        key, other = ("from", "to") if start is None else ("to", "from")
        yield Fault(f"{path}.{key}", MISSING, f"a point [x, y], to go with {path}.{other}")
    elif start == to:
        yield Fault(f"{path}.to", to, f"must differ from {path}.from")


def _expectations(look: Look) -> Iterator[Fault]:
    if not look.several("expect") or not look.sound("surface"):
        return
    surfaces = [table for table in ("incoming", "plate", "outgoing") if look.has(table)]
    surfaces += [str(free["name"]) for free in look.several("surface")]
    for index, given in enumerate(look.several("expect")):
        path = f"expect[{index}]"
        if not (isinstance(given, Mapping) and look.sound(path)):
            continue
        name = given.get("quantity")
        if not isinstance(name, str):
            continue
        unit = unit_of(name, surfaces)
        if unit is None:
            text = f"no such quantity here; {suggestion(name, surfaces)}"
            yield Fault(f"{path}.quantity", name, text)
            continue
        if given.get("value") == THEORY and name not in SYMBOLS:
            text = f"a number; the theory has no {name}, only {', '.join(SYMBOLS)}"
            yield Fault(f"{path}.value", THEORY, text)
        for key in ("tolerance", "tolerance_contact", "tolerance_pymunk"):
            tolerance, none = given.get(key), "" if key == "tolerance" else f' or "{UNPROMISED}"'
            if not isinstance(tolerance, str) or (none and tolerance == UNPROMISED):
                continue
            with suppress(ValueError):
                size, found = read_size(tolerance)
                if size >= 0.0 and found in (unit, "%"):
                    continue
            examples = {"": "3", "degrees": "0.1 degrees"}
            example = examples.get(unit) or write_size(0.0005, unit)
            text = f'must be a number from 0 to 1 (relative), a string such as "{example}"{none}'
            kind = f"in {unit}" if unit else "a number of things"
            yield Fault(f"{path}.{key}", tolerance, f"{text}; {name} is {kind}")
