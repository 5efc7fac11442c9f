"""`Sweep`: the rows of all variants, as plain arrays."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.frames import frame
from chutelab.sheet import Sheet, Shown, number
from chutelab.sweep.columns import NUMBERS, REASON
from chutelab.sweep.table import write

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from chutelab.variation import Quantity

MOST_REASONS = 5
"""Reasons that are listed."""

PARTIAL = (
    "belt_work, slip_heat and power are counted up to run.until. --set run.until=settled counts"
    " them until nothing slips on the belt, as the theory, solve and --uncertainty do."
)
"""Said where runs may end before the slip does."""


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Shown):
    """Many variants of one scene.

    Attributes
    ----------
    title : str
        Of the scene.
    quantities : dict of str to Quantity
        What each varied key is.
    columns : dict of str to ndarray, (N,)
        Read-only: the varied keys, then what came of each variant, see `chutelab.sweep.NUMBERS`
        (NaN where there is nothing to tell), then ``reason``: why there are no numbers, or not all.
    shape : tuple of int or None
        Values of each key in a grid, whose last key runs fastest; None for samples.
    settled : bool
        Whether all runs go on until nothing slips.
    """

    title: str
    quantities: Mapping[str, Quantity]
    columns: Mapping[str, NDArray[Any]]
    shape: tuple[int, ...] | None
    settled: bool = False

    def __post_init__(self) -> None:
        for values in self.columns.values():
            values.flags.writeable = False

    def __len__(self) -> int:
        return len(self.columns[REASON])

    def unit(self, column: str) -> str:
        """Return the unit of a column, "" for a pure number."""
        return self.quantities[column].unit if column in self.quantities else NUMBERS[column][1]

    def frame(self) -> Any:
        """Return a pandas DataFrame; a varied key or a result is a column. Needs pandas."""
        return frame(self.columns)

    def to_csv(self, path: str | Path) -> Path:
        """Write a CSV file, whole or not at all; NaN is an empty cell."""
        return write(self.columns, path, "csv")

    def to_parquet(self, path: str | Path) -> Path:
        """Write a Parquet file, whole or not at all; NaN is null. Needs pyarrow."""
        return write(self.columns, path, "parquet")

    def sheet(self) -> Sheet:
        """Return from where to where each column goes, and why rows have no numbers."""
        rows = []
        for name, values in self.columns.items():
            if name == REASON or not np.isfinite(values).any():
                continue
            unit = self.unit(name)
            known = values[np.isfinite(values)]
            low, high = float(known.min()), float(known.max())
            if name in self.quantities or low != high or low != 0.0:
                rows.append((name, unit, number(low), number(high), f"{len(known):,}"))
        notes = []
        if not self.settled and np.any(np.nan_to_num(self.columns["slip_heat"])):
            notes.append(PARTIAL)
        reasons = Counter(reason for reason in self.columns[REASON].tolist() if reason)
        notes += [f"{count:,} × {reason}" for reason, count in reasons.most_common(MOST_REASONS)]
        if len(reasons) > MOST_REASONS:
            notes.append(f"and {len(reasons) - MOST_REASONS:,} other reasons")
        return Sheet(
            f"{self.title}: {len(self):,} variant{'s' if len(self) != 1 else ''}",
            ("", "", "least", "most", "rows"),
            tuple(rows),
            texts=2,
            notes=tuple(notes),
        )
