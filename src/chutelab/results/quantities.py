"""The readers of the registry: the one place where quantities are read off a recording.

`measure` gives a quantity of a run by its name, such as ``landing.x.mean``, `each` that of each
particle, such as ``landing.x``, and `measured` that of each variant of a family. A quantity's row
is in `chutelab.scene.quantities`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import nan
from typing import Any

import numpy as np

from chutelab.results.arrival import arrivals
from chutelab.results.comparison import column, first, paid, symbols, worst
from chutelab.results.ledger import ledger, ledger_of_each
from chutelab.results.record import ENTRIES, REASONS, Record
from chutelab.scene.quantities import FIRST, lookup, suggestion, whose
from chutelab.util.arrays import Bools, Floats

_STATISTICS: dict[str, Callable[[Floats], Any]] = {
    "mean": np.mean, "spread": np.std, "min": np.min, "max": np.max,
    "q50": np.median,
    **{f"q{percent:02}": partial(np.quantile, q=percent / 100) for percent in (2, 25, 75, 98)},
}  # fmt: skip


def each(recording: Record, name: str) -> Floats:
    """Return a quantity of each particle, (N,), in its unit; NaN without one.

    Names are such as ``x2``, ``landing.x``, ``flight.t``, ``impact.hood.t``, ``ended.t`` or
    ``ledger.belt_work``. Of a family of scenes, each particle is a scene of its own.

    Raises
    ------
    KeyError
        If particles have no such quantity.
    """
    match name.split("."):
        case ["ended", "t"]:
            return _at_end(recording, recording.ends()[1]["t"])
        case ["ended", "x" | "y" as axis]:
            return _at_end(recording, recording.ends()[1]["position"][:, "xy".index(axis)])
        case ["track", "t"]:
            begin, end = recording.ends()
            return _at_end(recording, end["t"] - begin["t"])
        case ["ledger", *rest]:
            found, entry = ledger_of_each(recording), ".".join(rest)
            entries, fall = found["entries"], found["potential.end"] - found["potential.start"]
            found |= dict(zip(ENTRIES, entries.T, strict=True))
            found["turned_over"] = (
                found["kinetic.start"] + np.abs(entries).sum(axis=1) + np.abs(fall)
            )
            return _at_end(recording, found[entry])
        case ["flight", "t"]:
            # From the incoming belt to what is met next.
            left = column(first(recording, "separation"), "t")
            met = (column(first(recording, event), "t") for event in ("impact", "landing"))
            return np.asarray(np.fmin(*met) - left)
        case ["impact", surface, key]:
            return column(first(recording, "impact", surface), key)
        case ["separation" | "impact" | "landing" as event, key]:
            return column(first(recording, event), key)
        case ["arrival", key]:
            return column(arrivals(recording), key)
        case ["belt_work" | "slip_heat" | "power" as what]:
            # What the belt pays until a lone particle does not slip.
            settled = recording.ended_by("settled") & (
                recording.count == 1 or bool(recording.family)
            )
            entry = "friction_loss" if what == "slip_heat" else "belt_work"
            work = np.where(settled, paid(recording, "outgoing", entry), nan)
            return np.asarray(work * (recording.machine.scenes.rate if what == "power" else 1.0))
    values = symbols(recording)[name.removesuffix("_deg")]
    return np.degrees(values) if name.endswith("_deg") else values


def _at_end(recording: Record, values: Any) -> Floats:
    """Return what the released particles have, (n,), as that of all, (N,)."""
    found = np.full(recording.count, nan)
    found[recording.released] = values
    return found


def measured(recording: Record, name: str) -> Floats:
    """Return a quantity that the scene has of each of V variants, (V,); NaN without one.

    V is 1, or of a family as many as there are particles.
    """
    many = recording.count if recording.family else 1
    shape = many, recording.count // many
    parts, own = name.split("."), np.ones(recording.count, dtype=bool)
    if name.startswith(FIRST):
        return each(recording, name.removeprefix(FIRST))[:: shape[1]]
    if parts[0] == "by_stream":
        stream = recording.machine.streams.index(parts[1])
        parts, own = parts[2:], recording.machine.releases.stream == stream

    def count(which: Bools) -> Floats:
        return np.asarray((which & own).reshape(shape).sum(axis=1), dtype=np.float64)

    match parts:
        case ["contacts"]:
            # Of a family they are counted together.
            return np.full(many, nan if recording.family else float(recording.contacts))
        case ["ended", reason] if reason in REASONS:
            return count(recording.ended_by(reason))
        case ["misses"]:
            return count(np.isnan(each(recording, "arrival.t")))
        case ["error", "max"]:
            return worst(recording)
        case ["ledger", "by_surface", surface, entry]:
            return paid(recording, surface, entry)
        case ["ledger", "power"]:
            work = paid(recording, "outgoing", "belt_work")
            return np.asarray(work / shape[1] * recording.machine.scenes.rate)
        case ["ledger", *_] if recording.family:
            return each(recording, name)
        case ["ledger", stored, end]:
            return np.array([getattr(ledger(recording), stored)[("start", "end").index(end)]])
        case ["ledger", entry]:
            return np.array([getattr(ledger(recording), entry)])
        case [*event, "count"]:
            return count(np.isfinite(each(recording, ".".join([*event, "t"]))))
        case [*quantity, statistic] if statistic in _STATISTICS:
            values = each(recording, ".".join(quantity))
            if shape[1] == 1:
                # Of one particle all statistics are its value, but the spread.
                return values - values if statistic == "spread" else values
            values = values[own & np.isfinite(values)]
            return np.array([_STATISTICS[statistic](values) if len(values) else nan])
    return each(recording, name)[:: shape[1]]


def measure(recording: Record, name: str) -> float:
    """Return a quantity of a recording, in its unit; NaN if it did not happen.

    Names are those of `chutelab.scene.quantities`, such as ``x2``, ``landing.x.mean`` or
    ``ledger.by_surface.plate.restitution_loss``. One that each particle has goes by its bare name
    where there is one particle; of several, ``particles[0].landing.x`` is the first one's.
    ``spread`` is the standard deviation, ``q02`` what 2 % of the particles are below. After
    ``by_stream.NAME.`` it is that of the particles of one stream.

    Raises
    ------
    KeyError
        If the scene has no quantity of that name, or the name does not say of which particle.
    """
    surfaces = recording.scene.surfaces
    row = lookup(name, surfaces, recording.machine.streams)
    if row is None:
        raise KeyError(f"no quantity {name!r}; {suggestion(name, surfaces)}")
    if which := whose(row, recording.count):
        raise KeyError(f"{name!r}: {which}")
    return float(measured(recording, name)[0])
