"""Rows as text and back, to the bit; CSV and Parquet files, whole or not at all."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from chutelab.files import whole
from chutelab.sweep.columns import REASON

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    Rows = Mapping[str, NDArray[Any]]

SUFFIXES: Final = {".csv": "csv", ".parquet": "parquet"}
"""Endings of files, and the formats they stand for."""


class TableError(ValueError):
    """A file that cannot be written; the text says what is allowed."""


def format_of(path: str | Path) -> str:
    """Return the format of a file by its ending.

    Raises
    ------
    TableError
        If it is none that is known, or what it needs is not installed; or it is a folder, or in one
        that is not there.
    """
    if Path(path).is_dir():
        raise TableError(f"{path} is a folder, not a file")
    if not (folder := Path(path).parent).is_dir():
        raise TableError(f"{path}: there is no folder {folder}")
    found = SUFFIXES.get(Path(path).suffix.lower())
    if found is None:
        raise TableError(f"{path}: the name of a table ends with {' or '.join(SUFFIXES)}")
    if found == "parquet":
        _pyarrow()
    return found


def write(columns: Rows, path: str | Path, form: str) -> Path:
    """Write a table as "csv" or "parquet"."""
    if form == "csv":
        return write_csv(tuple(columns), [text_of(columns)], path)
    pa, parquet = _pyarrow()
    table = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
    with whole(path) as unfinished:
        parquet.write_table(table, unfinished)
    return Path(path)


def write_csv(names: Sequence[str], texts: Iterable[str], path: str | Path) -> Path:
    """Write a head and texts of rows as a CSV file."""
    with whole(path) as unfinished, unfinished.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(map(_quoted, names)) + "\n")
        file.writelines(texts)
    return Path(path)


def text_of(columns: Rows) -> str:
    """Return rows as lines of CSV, from which `columns_of` gets every bit back."""
    cells = [
        list(map(_quoted, values.tolist())) if name == REASON else _numbers(values)
        for name, values in columns.items()
    ]
    return "".join([f"{','.join(row)}\n" for row in zip(*cells, strict=True)])


def columns_of(names: Sequence[str], text: str) -> dict[str, NDArray[Any]]:
    """Read what `text_of` wrote."""
    cells = list(zip(*csv.reader(text.splitlines()), strict=True))
    return {
        name: np.array(column, dtype=object)
        if name == REASON
        else np.array([float(cell) if cell else np.nan for cell in column])
        for name, column in zip(names, cells, strict=True)
    }


def _numbers(values: NDArray[np.float64]) -> list[str]:
    """Write numbers in as few digits as give them back, whole ones without a point."""
    return ["" if x != x else repr(x).removesuffix(".0") for x in values.tolist()]


def _quoted(text: str) -> str:
    if '"' not in text and "," not in text:
        return text
    doubled = text.replace('"', '""')
    return f'"{doubled}"'


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise TableError('Parquet needs pyarrow: pip install "chutelab[parquet]"') from None
    return pa, parquet
