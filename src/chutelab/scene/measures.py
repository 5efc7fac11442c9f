"""What a scene can be expected to show: the names of a run's numbers, and their units.

Names are the keys of the JSON object that ``chutelab run --json`` prints, joined by dots. A list
there has one entry a particle; a name stands for particle 0's, and with ``.mean``, ``.spread``
(standard deviation), ``.min`` or ``.max`` for all particles to which it happened.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from chutelab.hints import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

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
ENDINGS: Final = ("time", "landed", "settled", "exit")
NEEDED: Final = {"separation": "incoming", "impact": "plate", "landing": "outgoing"}
"""Events, and the table without which there are none; impacts on free surfaces go by name."""


_NEAR: Final = 0.6
"""Likeness of a misspelt quantity and the one that was meant: phi1 is taken for phi1_deg."""


def unit_of(name: str, surfaces: Iterable[str]) -> str | None:
    """Return the unit of a quantity, "" for a number of things; None if the scene has none such.

    Parameters
    ----------
    name
        Such as ``x2``, ``landing.x``, ``landing.x.mean``, ``impact.ramp.t``, ``landing.count``,
        ``ended.settled``, ``ledger.belt_work``, ``ledger.kinetic.end`` or
        ``ledger.by_surface.outgoing.belt_work``.
    surfaces
        Names of the scene's surfaces: incoming, plate, outgoing and free ones, as far as there.

    Examples
    --------
    >>> unit_of("landing.x.mean", ["incoming", "outgoing"]), unit_of("impact.t", [])
    ('m', None)
    """
    known = list(surfaces)
    match name.split("."):
        case [symbol] if symbol in SYMBOLS:
            return SYMBOLS[symbol] if {"incoming", "plate"} <= set(known) else None
        case ["contacts"]:
            return ""
        case ["ended", "t", *statistic]:
            return _column("t", statistic)
        case ["ended", ending] if ending in ENDINGS:
            return ""
        case ["ledger", total] if total in TOTALS:
            return "J"
        case ["ledger", stored, "start" | "end"] if stored in STORED:
            return "J"
        case ["ledger", "by_surface", surface, entry] if entry in ENTRIES:
            return "J" if surface in (*known, "particles") else None
        case [event, *column] if event in NEEDED:
            return _event(event, column, known)
    return None


def _event(event: str, column: list[str], surfaces: list[str]) -> str | None:
    home = NEEDED[event]
    if event == "impact" and column and column[0] in surfaces and column[0] not in NEEDED.values():
        home, column = column[0], column[1:]
    if home not in surfaces or not column:
        return None
    if column == ["count"]:
        return ""
    if event == "separation" and column[0].endswith("_after"):
        return None
    return _column(column[0], column[1:])


def _column(column: str, statistic: list[str]) -> str | None:
    fits = not statistic or (len(statistic) == 1 and statistic[0] in STATISTICS)
    return _UNITS.get(column) if fits else None


def suggestion(name: str, surfaces: Iterable[str]) -> str:
    """Say which quantity was probably meant, or else which there are."""
    known = list(surfaces)
    absent = [table for table in NEEDED.values() if table not in known]
    for tables in (*([table] for table in absent), absent):
        if tables and unit_of(name, [*known, *tables]) is not None:
            return f"it needs {' and '.join(f'[{table}]' for table in tables)}"
    return did_you_mean(name, _names(known), f"there are {_families(known)}", cutoff=_NEAR)


def _names(surfaces: list[str]) -> Iterator[str]:
    """Yield all quantities of a scene, those of at most 50 surfaces."""
    some = surfaces[:50]
    events = [*NEEDED, "ended", *(f"impact.{name}" for name in some)]
    candidates = [*SYMBOLS, *NEEDED, "contacts", *(f"ended.{ending}" for ending in ENDINGS)]
    for event in events:
        columns = [f"{event}.{column}" for column in (*_UNITS, "count")]
        candidates += columns
        candidates += [f"{column}.{statistic}" for column in columns for statistic in STATISTICS]
    candidates += [f"ledger.{name}" for name in TOTALS]
    candidates += [f"ledger.{name}.{end}" for name in STORED for end in ("start", "end")]
    for name in (*some, "particles"):
        candidates += [f"ledger.by_surface.{name}.{entry}" for entry in ENTRIES]
    return (name for name in candidates if unit_of(name, surfaces) is not None)


def _families(surfaces: list[str]) -> str:
    """Say which quantities a scene has, one of each kind."""
    some = [f"{event}.x" for event, home in NEEDED.items() if home in surfaces]
    keys = ", ".join([*some, "contacts", "ledger.belt_work"])
    theirs = "phi1_deg to slip_heat, " if {"incoming", "plate"} <= set(surfaces) else ""
    return f"{theirs}{keys} and other keys of `chutelab run --json`"
