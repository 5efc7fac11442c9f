"""`Sweep`: the rows of all variants, and their files.

Rows are written as text that gives them back to the bit, in CSV or Parquet, whole or not at all.
"""

from __future__ import annotations

import csv
import io
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from math import isnan
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chutelab.scene.quantities import COLUMNS, HEAT
from chutelab.scene.variants import Quantity
from chutelab.studies.sweep.rows import REASON, TEXTS, TOUCHES, Named
from chutelab.util.errors import InputError
from chutelab.util.files import csv_lines, unquoted, whole, write_lines
from chutelab.util.tables import Sheet, Shown, frame, number
from chutelab.util.versions import library

Rows = Mapping[str, NDArray[Any]]

SUFFIXES: Final = {".csv": "csv", ".parquet": "parquet"}
"""Endings of files, and the formats they stand for."""

PARQUET: Final = ("Parquet needs pyarrow", "parquet")
"""What to say without it, and the extra that brings it."""


def format_of(path: str | Path) -> str:
    """Return the format of a file by its ending; an `InputError` if it cannot be written."""
    if Path(path).is_dir():
        raise InputError(f"{path} is a folder, not a file")
    if not (folder := Path(path).parent).is_dir():
        raise InputError(f"{path}: there is no folder {folder}")
    found = SUFFIXES.get(Path(path).suffix.lower())
    if found is None:
        raise InputError(f"{path}: the name of a table ends with {' or '.join(SUFFIXES)}")
    if found == "parquet":
        library("pyarrow", *PARQUET)
    return found


def write(columns: Rows, path: str | Path, form: str) -> Path:
    """Write a table as "csv" or "parquet"."""
    if form == "csv":
        return write_csv(tuple(columns), [text_of(columns)], path)
    pa, parquet = library("pyarrow", *PARQUET), library("pyarrow.parquet", *PARQUET)
    table = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
    with whole(path) as unfinished:
        parquet.write_table(table, unfinished)
    return Path(path)


def write_csv(names: Sequence[str], texts: Iterable[str], path: str | Path) -> Path:
    """Write a head and texts of rows as a CSV file."""
    return write_lines(path, chain(csv_lines([names]), texts))


def synced(path: Path) -> None:
    """Have a file that was written, and its name, survive a power cut."""
    for place, flags in ((path, os.O_RDWR), (path.parent, os.O_RDONLY)):
        with suppress(PermissionError):  # Windows opens no folders.
            handle = os.open(place, flags)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)


def text_of(columns: Rows) -> str:
    """Return rows as lines of CSV, from which `columns_of` gets every bit back."""
    cells = [
        values.tolist() if name in TEXTS else list(map(_number, values.tolist()))
        for name, values in columns.items()
    ]
    return "".join(csv_lines(zip(*cells, strict=True)))


def _number(x: float) -> str:
    """Write a number in as few digits as give it back, a whole one without a point."""
    return "" if isnan(x) else repr(x).removesuffix(".0")


def columns_of(names: Sequence[str], text: str) -> dict[str, NDArray[Any]]:
    """Read what `text_of` wrote."""
    cells = list(zip(*csv.reader(io.StringIO(text, newline="")), strict=True))
    return {
        name: np.array(list(map(unquoted, column)), dtype=object)
        if name in TEXTS
        else np.array([float(cell) if cell else np.nan for cell in column])
        for name, column in zip(names, cells, strict=True)
    }


MOST_REASONS = 5
"""Reasons that are listed."""

PARTIAL = (
    "The outgoing belt's work, its slip heat and power are counted up to run.until. --set"
    " run.until=settled counts them until nothing slips on the belt, as the theory, solve and"
    " --uncertainty do."
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
        Read-only: the varied keys, then what came of each variant, see `COLUMNS`
        (NaN where there is nothing to tell), then ``touches``: which surfaces the particles meet,
        and ``reason``: why there are no numbers, or not all.
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
        object.__setattr__(self, "columns", Named(self.columns))
        for values in self.columns.values():
            values.flags.writeable = False

    def __len__(self) -> int:
        return len(self.columns[REASON])

    def unit(self, column: str) -> str:
        """Return the unit of a column, "" for a pure number."""
        return self.quantities[column].unit if column in self.quantities else COLUMNS[column].unit

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
            if name in TEXTS or not np.isfinite(values).any():
                continue
            unit = self.unit(name)
            known = values[np.isfinite(values)]
            low, high = float(known.min()), float(known.max())
            if name in self.quantities or low != high or low != 0.0:
                rows.append((name, unit, number(low), number(high), f"{len(known):,}"))
        notes = []
        if not self.settled and np.any(np.nan_to_num(self.columns[HEAT])):
            notes.append(PARTIAL)
        ways = Counter(way for way in self.columns[TOUCHES].tolist() if way)
        if len(ways) > 1:
            told = [f"{count:,} touch {way}" for way, count in ways.most_common(MOST_REASONS)]
            told += [f"others go {len(ways) - MOST_REASONS:,} other ways"] * (len(ways) > len(told))
            notes.append("; ".join(told))
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
