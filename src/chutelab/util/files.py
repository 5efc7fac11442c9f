"""Files that are written whole or not at all, and tables in them: CSV and TSV.

It imports no NumPy: commands that need none answer at once.
"""

from __future__ import annotations

import csv
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from errno import ENOENT
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

from chutelab.util.errors import printable


@contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """Give a path to write to; it becomes `path` at the end, or is removed after an exception.

    It lies in the same directory, so that the last step is one atomic rename.
    """
    path = Path(path)
    if not path.parent.exists():
        # Else the error would name the temporary folder.
        raise FileNotFoundError(ENOENT, "there is no such folder", str(path.parent))
    with tempfile.TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as folder:
        unfinished = Path(folder) / path.name
        yield unfinished
        unfinished.replace(path)


_FORMULA: Final = r"((?:\A|[;\t\r\n])[\s\"']*)({}[=+\-@\uff1d\uff0b\uff0d\uff20])"
"""What a spreadsheet takes for a formula, at the start of a cell or of what becomes one where
semicolons or tabs separate the cells; the last four are Japanese keyboards' =, +, - and @."""

_BARE: Final = re.compile(_FORMULA.format(""))
_QUOTED: Final = re.compile(_FORMULA.format("'"))


def harmless(cell: object) -> object:
    """Return a cell with a quote before whatever a spreadsheet would take for a formula.

    Numbers stay as they are, also those that are written out.

    >>> harmless("=1+1"), harmless("a;=1+1"), harmless("-0.5"), harmless(-0.5)
    ("'=1+1", "a;'=1+1", '-0.5', -0.5)
    """
    if not isinstance(cell, str) or not cell:
        return cell
    try:
        float(cell)
    except ValueError:
        return _BARE.sub(r"\1'\2", cell)
    return cell


def unquoted(cell: str) -> str:
    """Return the text that `harmless` made this cell of."""
    return _QUOTED.sub(lambda found: found[1] + found[2].removeprefix("'"), cell)


def csv_lines(
    rows: Iterable[Iterable[object]], *, separator: str = ",", end: str = "\n"
) -> Iterator[str]:
    r"""Yield rows as lines of CSV, cells quoted where they must be.

    None is an empty cell, numbers come back to the last bit; no text is a formula, see `harmless`.

    >>> list(csv_lines([("t", "what"), (0.1, "a, b"), (1, None)]))
    ['t,what\n', '0.1,"a, b"\n', '1,\n']
    """
    # `writerow` returns what `write` does: the line.
    # Cells are only quoted for the line ends that it writes itself, so it writes both.
    out = csv.writer(SimpleNamespace(write=str), delimiter=separator, lineterminator="\r\n")
    return (out.writerow(map(harmless, row)).removesuffix("\r\n") + end for row in rows)


def write_lines(path: str | Path, texts: Iterable[str], *, errors: str = "strict") -> Path:
    """Write lines, each with its end, to a UTF-8 file, whole or not at all."""
    with (
        whole(path) as unfinished,
        unfinished.open("w", encoding="utf-8", errors=errors, newline="") as file,
    ):
        file.writelines(texts)
    return Path(path)


def csv_text(columns: Mapping[str, Any]) -> str:
    """Return named columns, arrays of one length, as CSV; NaN is an empty cell."""
    # Only NaN differs from itself.
    cells = ([None if x != x else x for x in column.tolist()] for column in columns.values())
    return "".join(csv_lines([columns, *zip(*cells, strict=True)]))


def tsv_text(rows: Sequence[object], kind: type, about: Mapping[str, str]) -> str:
    """Return rows of a dataclass as tab-separated values.

    Lines of ``# key: value`` come first and say where the figures are from; then the names of the
    columns.
    """
    names = [field.name for field in fields(kind)]
    cells = [[getattr(row, name) for name in names] for row in rows]
    head = "".join(f"# {key}: {printable(value)}\n" for key, value in about.items())
    return head + "".join(csv_lines([names, *cells], separator="\t"))
