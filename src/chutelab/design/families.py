"""One-particle variants through the exact engine all at once, and their quantities as columns.

What `chutelab.sweep` does for its rows is done here for any quantity; every number is, to the bit,
the one that a run by itself gives.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.compare import from_events, never
from chutelab.design.courses import courses_of
from chutelab.design.quantities import Given, Measured
from chutelab.recording import ENTRIES, REASONS, Kind
from chutelab.scene import measures
from chutelab.scene.family import is_plain
from chutelab.scene.paths import value_at
from chutelab.sweep.alone import one_line
from chutelab.sweep.batch import Batch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from chutelab.design.quantities import Quantity
    from chutelab.recording import Floats, Recording
    from chutelab.scene import Scene
    from chutelab.sweep.block import Block

    Ints = NDArray[np.int64]


def suits(scene: Scene, keys: Sequence[str], quantities: Sequence[Quantity]) -> bool:
    """Tell whether variants of a scene can run at once, and all quantities be read off that."""
    return (
        scene.stream.count == 1
        and scene.stream.at is None
        and scene.run.engine not in ("contact", "pymunk")
        and all(is_plain(key) for key in keys)
        and all(_readable(quantity) for quantity in quantities)
    )


def _readable(quantity: Quantity) -> bool:
    if not isinstance(quantity, Measured):
        return True
    match quantity.key.split("."):
        case ["separation" | "impact" | "landing", *column]:
            return column[-1] not in ("count", *measures.STATISTICS)
        case ["ledger", name]:
            return name in ENTRIES
        case ["ledger", "by_surface", *_]:
            return True
        case [symbol]:
            return symbol in measures.SYMBOLS and symbol not in ("belt_work", "slip_heat")
    return False


class Family:
    """The quantities of variants that can be run at once.

    Parameters
    ----------
    block : Block
        Of a scene that `suits`.
    quantities : sequence of Quantity
        What is read off.

    Attributes
    ----------
    values : ndarray, shape (N, M)
        The quantities, NaN where they did not happen.
    courses : list of str
        "" for variants that did not run here.
    faults : list of str
        Why there was no run; "" where there was one.
    left : list of int
        Variants that have to run by themselves.
    """

    def __init__(self, block: Block, quantities: Sequence[Quantity]) -> None:
        self.quantities = quantities
        self.values = np.full((len(block.values), len(quantities)), np.nan)
        self.courses = [""] * len(block.values)
        batch = Batch(block, self._read)
        self.faults = [one_line(batch.faults.get(row, "")) for row in range(len(block.values))]
        self.left = batch.left

    def _read(self, recording: Recording, family: Scene, which: Ints) -> None:
        for column, quantity in enumerate(self.quantities):
            self.values[which, column] = _column(recording, family, quantity)
        for row, course in zip(which.tolist(), courses_of(recording), strict=True):
            self.courses[row] = course


def _column(recording: Recording, family: Scene, quantity: Quantity) -> Any:
    """Return a quantity of each variant of a recording, (N,), or a number for all."""
    if isinstance(quantity, Given):
        return value_at(family, quantity.name)
    if not isinstance(quantity, Measured):
        return quantity.value
    found = _measured(recording, family, quantity.key)
    if quantity.ending == "settled":
        found = np.where(recording.ended == REASONS.index("settled"), found, np.nan)
    return found * family.stream.rate if quantity.name == "power" else found


def _measured(recording: Recording, family: Scene, name: str) -> Any:
    match name.split("."):
        case ["ledger", "by_surface", surface, entry]:
            table = recording.by_surface.reshape(recording.count, -1, len(ENTRIES))
            if surface not in recording.surfaces:
                return np.zeros(recording.count)
            return table[:, recording.surface_index(surface), ENTRIES.index(entry)]
        case ["ledger", entry]:
            return recording.ends()[1]["entries"][:, ENTRIES.index(entry)]
        case ["separation" | "impact" | "landing" as event, *column]:
            return _of_event(recording, event, column)
    first = [_first(recording, event) for event in ("separation", "impact", "landing")]
    # Without the one before, the next says nothing in the paper's frame.
    for before, after in pairwise(first):
        after[np.isnan(before["t"])] = never(1)
    values = from_events(family, *first)
    return np.degrees(values[name.removesuffix("_deg")]) if name.endswith("_deg") else values[name]


def _of_event(recording: Recording, event: str, column: list[str]) -> Floats:
    surface = column.pop(0) if len(column) > 1 else None
    first = _first(recording, event, surface)
    key = column[0]
    if key in ("x", "y"):
        return np.asarray(first["position"][:, "xy".index(key)])
    if key == "t":
        return np.asarray(first["t"])
    when = "after" if key.endswith("_after") else "before"
    return np.asarray(first[f"velocity_{when}"][:, "xy".index(key[1])])


def _first(recording: Recording, event: str, surface: str | None = None) -> NDArray[Any]:
    """Return the first such event of each particle, NaN where there is none."""
    kind = {"separation": Kind.SEPARATION, "impact": Kind.IMPACT, "landing": Kind.LANDING}[event]
    found = recording.first(recording.select(kind, surface=surface or measures.NEEDED[event]))
    every = never(recording.count)
    every[found["particle"]] = found
    return every
