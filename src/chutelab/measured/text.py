"""The bytes of a table in a text file as lines of cells, and the cells as numbers.

Spreadsheets and video analysis write tables in many ways: UTF-8 with or without a byte-order mark,
UTF-16, Latin-1; cells apart by tabs, semicolons, commas or spaces; numbers with a decimal point or
a comma.
"""

from __future__ import annotations

import csv
import re
from typing import TYPE_CHECKING, Final

from chutelab.measured.track import MeasuredError
from chutelab.scene import Fault

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

LARGEST_FILE: Final = 20_000_000
"""Bytes; an hour of film at 50 frames a second is a quarter of it."""

SEPARATORS: Final = ("\t", ";", ",", " ")
"""Tried in this order: a comma may be a decimal mark where a tab or a semicolon stands."""

NAMES: Final = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "spaces"}

_NUMBER: Final = re.compile(r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?")

_EMPTY: Final = ("", "nan", "null", "na", "n/a", "-", "--")
"""What stands for no value, in small letters."""


def lines_of(path: Path) -> list[str]:
    """Return the lines of a text file.

    Raises
    ------
    MeasuredError
        If it cannot be read, is too large, or holds no text.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise refused(path, "", f"cannot be read: {reason}") from None
    if len(data) > LARGEST_FILE:
        raise refused(path, "", f"too large for a track: at most {LARGEST_FILE // 10**6} MB")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        if b"\0" in data:
            raise refused(path, "", "not a text file; a table with columns t, x, y is needed")
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            # Only a track's name can hold letters that are not ASCII: any 8-bit code will do.
            text = data.decode("latin-1")
    return re.split(r"\r\n|\r|\n", text)


def cells_of(line: str, separator: str) -> list[str]:
    """Split a line at a separator that is not in quotes; blanks around cells are cut off.

    >>> cells_of('0,02;"1,5"; 2', ";")
    ['0,02', '1,5', '2']
    """
    if separator == " ":
        return line.split()
    # One line at a time: a quote that is never closed must not swallow the rest of the file.
    try:
        rows = list(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error:
        # A cell too large for the reader, which is no number anyway.
        rows = [line.split(separator)]
    return [cell.strip() for cell in rows[0]] if rows else []


def is_empty(cell: str) -> bool:
    """Tell whether a cell stands for no value."""
    return cell.lower() in _EMPTY


def number(cell: str) -> float | None:
    """Return the number in a cell, with decimal point or comma; None if there is none.

    >>> number("1,5E-1"), number("−0.5"), number("1.234,5")
    (0.15, -0.5, None)
    """
    cell = cell.replace("\N{MINUS SIGN}", "-")
    if len(cell) > 60 or not _NUMBER.fullmatch(cell):
        return None
    return float(cell.replace(",", "."))


def marks(cells: Iterable[str]) -> set[str]:
    """Return which decimal marks the numbers use: of "." and ","."""
    return {mark for cell in cells for mark in ".," if mark in cell}


def refused(source: object, place: str, allowed: str, value: object = None) -> MeasuredError:
    """Return the error that says what is wrong at a place of a file."""
    return MeasuredError(str(source), [Fault(place, value, allowed)])
