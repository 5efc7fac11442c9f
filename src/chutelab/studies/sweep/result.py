"""`Sweep`: the rows of all variants, and their files.

Rows are written as text that gives them back to the bit, in CSV or Parquet, whole or not at all.
The finished rows of an unfinished sweep are in a file beside the one it is to write.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import chain
from math import isnan
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chutelab.scene import to_dict
from chutelab.scene.variants import Quantity
from chutelab.studies.sweep.plan import Plan
from chutelab.studies.sweep.rows import NUMBERS, REASON
from chutelab.util.errors import InputError
from chutelab.util.files import csv_lines, unquoted, whole, write_lines
from chutelab.util.tables import Sheet, Shown, frame, number
from chutelab.util.versions import library, version_of

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


def text_of(columns: Rows) -> str:
    """Return rows as lines of CSV, from which `columns_of` gets every bit back."""
    cells = [
        values.tolist() if name == REASON else list(map(_number, values.tolist()))
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
        if name == REASON
        else np.array([float(cell) if cell else np.nan for cell in column])
        for name, column in zip(names, cells, strict=True)
    }


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
        Read-only: the varied keys, then what came of each variant, see `NUMBERS`
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


FORMAT: Final = 2
"""Of the file of finished rows."""

WORDS: Final = {
    "format": "the format of the file",
    "chutelab": "the version of chutelab",
    "scene": "the scene",
    "vary": "what --vary says",
    "samples": "--sample, --design or --seed",
    "engine": "--engine",
}
"""What a sweep can differ in, for people."""


def part_of(out: Path) -> Path:
    """Return where the finished rows are kept while the sweep goes on."""
    return out.with_name(f"{out.name}.part")


@contextmanager
def unfinished(
    out: Path, plan: Plan, *, resume: bool
) -> Iterator[tuple[dict[int, str], Callable[[int, str], None]]]:
    """Keep the rows of a sweep that are finished beside the file it is to write, until all are.

    The first line of the file is about the sweep; each other one has the number that a block begins
    with, and its rows as text, in JSON.

    Gives the texts that are there, by the beginnings of their blocks; and a function that adds a
    block to them and to the file.

    Raises
    ------
    InputError
        If the file is of another sweep, there although not to `resume`, or cannot be written.
    """
    samples = None if plan.samples is None else hashlib.sha256(plan.samples.tobytes()).hexdigest()
    head = {
        "format": FORMAT,
        "chutelab": version_of("chutelab"),
        "scene": to_dict(plan.scene),
        "vary": [[vary.key, vary.values] for vary in plan.varies],
        "samples": samples,
        "engine": plan.engine,
    }
    path, line = part_of(out), json.dumps(head).encode() + b"\n"
    done: dict[int, str] = {}

    def add(begin: int, text: str) -> None:
        done[begin] = text
        file.write(json.dumps([begin, text]).encode() + b"\n")
        file.flush()

    try:
        data = path.read_bytes() if path.exists() else b""
        # It may have been cut off in its first line.
        new = len(data) < len(line) and line.startswith(data)
        if not new and not resume:
            raise InputError(
                f"{path} holds the finished rows of a sweep that was interrupted: go on"
                " with --resume, or remove the file"
            )
        length = 0
        if not new:
            first, *blocks = data.splitlines(keepends=True)
            _check_same(path, first, line)
            length = len(first)
            # The last one may have been cut off; nothing counts from there on.
            with suppress(ValueError):
                for block in blocks:
                    if not block.endswith(b"\n"):
                        break
                    begin, text = json.loads(block)
                    done[begin] = text
                    length += len(block)
        file = path.open("r+b" if data else "wb")
        file.truncate(length)
        file.seek(length)
        if new:
            file.write(line)
            file.flush()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    complete = False
    try:
        yield done, add
        complete = True
    finally:
        file.close()
        if complete or not done:
            path.unlink()


def _check_same(path: Path, first: bytes, line: bytes) -> None:
    """Refuse a file whose first line is not that of this sweep, and say in what it differs."""
    try:
        found = json.loads(first)
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise InputError(f"{path} holds no rows of a sweep: remove it, or choose --out")
    head = json.loads(line)
    if other := [words for key, words in WORDS.items() if found.get(key) != head[key]]:
        raise InputError(
            f"{path} is of another sweep, with a difference in {', '.join(other)}: repeat"
            " that command, or remove the file and begin anew"
        )
