"""``[[expect]]``: what a scene should show, for ``chutelab verify``.

It goes by the names of a run's quantities, which are listed here with their units.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import lru_cache
from typing import Annotated, Final, Literal

from pydantic import Field

from chutelab.scene.units import (
    LARGEST,
    Number,
    Share,
    Table,
    Text,
    described,
    read_size,
)
from chutelab.util.errors import did_you_mean

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
STATISTICS: Final = ("mean", "spread", "min", "max", "q02", "q50", "q98")
ENTRIES: Final = ("belt_work", "restitution_loss", "friction_loss")
STORED: Final = ("kinetic", "potential")
TOTALS: Final = (*ENTRIES, "residual", "turned_over")
ENDINGS: Final = ("time", "landed", "settled", "exit", "stopped", "unreleased")
"""Why a track ends; the last is that of a particle that was not released until the run was over."""

FIRST: Final = "particles[0]."
"""What a quantity of particle 0 begins with; it has to where there are several particles."""


NEEDED: Final = {"separation": "incoming", "impact": "plate", "landing": "outgoing"}
"""Events, and the table without which there are none; impacts on free surfaces go by name."""

ARRIVAL: Final = "arrival"
"""The first touch of the outgoing belt, or of what lies on it; the landing is that of the belt."""


def unit_of(name: str, surfaces: Iterable[str], streams: Collection[str] = ()) -> str | None:
    """Return the unit of a quantity, "" for a number of things; None if the scene has none such.

    Names are such as ``x2``, ``landing.x``, ``particles[0].landing.x``, ``landing.x.mean``,
    ``arrival.vx.spread``, ``flight.t``, ``impact.ramp.t``, ``landing.count``, ``ended.settled``,
    ``ledger.belt_work``, ``ledger.kinetic.end`` or
    ``ledger.by_surface.outgoing.belt_work``; the surfaces are all that the scene has. What has a
    statistic or a count is also of one stream, by its name: ``by_stream.left.landing.x.mean``.

    Examples
    --------
    >>> unit_of("landing.x.mean", ["incoming", "outgoing"]), unit_of("impact.t", [])
    ('m', None)
    """
    units = _units(tuple(surfaces))
    if name.startswith(FIRST):
        own = name.removeprefix(FIRST)
        particular = own in SYMBOLS or own.rpartition(".")[2] in (*_UNITS, *ENTRIES)
        return units.get(own) if particular and not own.startswith("ledger.by_surface.") else None
    match name.split(".", 2):
        case ["by_stream", stream, rest]:
            many = rest.rpartition(".")[2] in ("count", *STATISTICS)
            return units.get(rest) if many and stream in streams else None
    return units.get(name)


@lru_cache(maxsize=8)
def _units(surfaces: tuple[str, ...]) -> dict[str, str]:
    """Return the units of all quantities of a scene with these surfaces, by name."""
    events = {event: _UNITS for event, home in NEEDED.items() if home in surfaces}
    before = {column: unit for column, unit in _UNITS.items() if not column.endswith("_after")}
    if "separation" in events:
        events["separation"] = before
    if "landing" in events:
        events[ARRIVAL] = before
    events |= {f"impact.{name}": _UNITS for name in surfaces if name not in NEEDED.values()}
    units = dict(SYMBOLS) if {"incoming", "plate"} <= set(surfaces) else {}
    units |= {"contacts": "", **{f"ended.{ending}": "" for ending in ENDINGS}}
    units |= {f"{event}.count": "" for event in events}
    if "separation" in events and len(events) > 1:
        events["flight"] = {"t": "s"}
    for event, columns in {**events, "ended": {"t": "s", "x": "m", "y": "m"}}.items():
        for column, unit in columns.items():
            units[f"{event}.{column}"] = unit
            units |= {f"{event}.{column}.{statistic}": unit for statistic in STATISTICS}
    units |= {f"ledger.{total}": "J" for total in TOTALS}
    units |= {f"ledger.{stored}.{end}": "J" for stored in STORED for end in ("start", "end")}
    for name in (*surfaces, "particles"):
        units |= {f"ledger.by_surface.{name}.{entry}": "J" for entry in ENTRIES}
    return units


def whose(name: str, count: int) -> str:
    """Say how a name has to go on where there are several particles; "" if it says whose it is.

    So of landings and arrivals, and of what the outgoing belt pays: those of particle 0 are not
    those of the stream.

    Examples
    --------
    >>> whose("landing.x", 1), whose("landing.x.mean", 200)
    ('', '')
    >>> whose("landing.x", 200)
    'of 200 particles: particles[0].landing.x, or landing.x.mean of the stream'
    """
    if count <= 1:
        return ""
    match name.split("."):
        case ["landing" | "arrival", column] if column in _UNITS:
            all_of = f"{name}.mean of the stream"
        case ["belt_work" | "slip_heat"]:
            entry = "belt_work" if name == "belt_work" else "friction_loss"
            all_of = f"ledger.by_surface.outgoing.{entry} of the stream"
        case _:
            return ""
    return f"of {count} particles: {FIRST}{name}, or {all_of}"


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
    """A number that a run of the scene should show, how exactly, and the source."""

    quantity: Text = described(
        ...,
        "What is looked at: a paper's symbol such as x2 or phi1_deg, or a key of the JSON summary "
        "such as landing.x (of several particles particles[0].landing.x), landing.x.mean, "
        "ledger.by_surface.outgoing.belt_work",
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
