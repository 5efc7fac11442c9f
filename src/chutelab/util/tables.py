"""A small table for terminal and notebook; columns as a pandas DataFrame and as CSV, rows as TSV.

pandas is imported only where a DataFrame is asked for.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from html import escape
from importlib import import_module
from math import isfinite, isnan
from textwrap import wrap
from typing import Any

from numpy.typing import NDArray

WIDTH = 80
"""Columns of a line of prose in a terminal, at most."""

GAP = "  "


@dataclass(frozen=True)
class Sheet:
    """A table of words and numbers.

    Attributes
    ----------
    title : str
        What it shows, with units; "" for none.
    columns : tuple of str
        Heads, "" where a column needs none.
    rows, foot : tuple of tuple of str
        Cells; those of the foot stand below a line.
    texts : int
        How many columns hold words; the others hold numbers and are set to the right.
    notes : tuple of str
        Sentences below the table.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    foot: tuple[tuple[str, ...], ...] = ()
    texts: int = 1
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        every = [self.columns, *self.rows, *self.foot]
        widths = [max(map(len, column)) for column in zip(*every, strict=True)]
        line = GAP.join("-" * width for width in widths)
        head = [self._line(self.columns, widths), line] if any(self.columns) else []
        body = [self._line(row, widths) for row in self.rows]
        foot = [line, *(self._line(row, widths) for row in self.foot)] if self.foot else []
        said = ["\n".join(wrapped(note)) for note in self.notes]
        return "\n".join([*([self.title] if self.title else []), *head, *body, *foot, *said])

    def _line(self, cells: tuple[str, ...], widths: list[int]) -> str:
        return GAP.join(
            cell.ljust(width) if index < self.texts else cell.rjust(width)
            for index, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ).rstrip()

    def html(self) -> str:
        """Return the table as HTML that takes its colours from the page around it."""
        caption = (
            f'<caption style="text-align:left;font-weight:bold">{escape(self.title)}</caption>'
            if self.title
            else ""
        )
        head = f"<thead>{self._row(self.columns, 'th')}</thead>" if any(self.columns) else ""
        body = "".join(self._row(row) for row in self.rows)
        foot = "".join(self._row(row) for row in self.foot)
        if foot:
            foot = f'<tfoot style="border-top:1px solid">{foot}</tfoot>'
        notes = "".join(f'<p style="max-width:45em">{escape(note)}</p>' for note in self.notes)
        return f"<div><table>{caption}{head}<tbody>{body}</tbody>{foot}</table>{notes}</div>"

    def _repr_html_(self) -> str:
        return self.html()

    def _row(self, cells: tuple[str, ...], tag: str = "td") -> str:
        sides = ("left" if index < self.texts else "right" for index in range(len(cells)))
        return "<tr>{}</tr>".format(
            "".join(
                f'<{tag} style="text-align:{side};padding:.1em .8em .1em 0">{escape(cell)}</{tag}>'
                for side, cell in zip(sides, cells, strict=True)
            )
        )


class Shown:
    """Something that displays itself as its `sheet`, in a terminal and in a notebook."""

    def sheet(self) -> Sheet:
        """Return what is to be shown."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return str(self.sheet())

    def _repr_html_(self) -> str:
        return self.sheet().html()


def wrapped(text: str, width: int = WIDTH) -> list[str]:
    """Return a text in lines of at most `width` characters, broken between words."""
    return wrap(text, width, break_on_hyphens=False)


def number(value: float) -> str:
    """Return a number in six digits, "-" for one that is not finite.

    >>> number(0.29800000000000004), number(float("nan"))
    ('0.298', '-')
    """
    return f"{value:.6g}" if isfinite(value) else "-"


def frame(columns: Mapping[str, NDArray[Any]]) -> Any:
    """Return named columns of one length as a DataFrame.

    Raises
    ------
    ImportError
        Without pandas; says what to install.
    """
    try:
        pandas = import_module("pandas")
    except ImportError as error:
        raise ImportError(
            "A DataFrame needs pandas: pip install pandas. The arrays are there without it."
        ) from error
    return pandas.DataFrame(dict(columns))


def csv_text(columns: Mapping[str, NDArray[Any]]) -> str:
    """Return named columns of one length as CSV; NaN is an empty cell."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*(column.tolist() for column in columns.values()), strict=True):
        writer.writerow("" if isinstance(one, float) and isnan(one) else one for one in row)
    return out.getvalue()


def tsv_text(rows: Sequence[object], kind: type, about: Mapping[str, str]) -> str:
    """Return rows of a dataclass as tab-separated values.

    Lines of ``# key: value`` come first and say where the figures are from; then the names of the
    columns. What is None is empty. Numbers come back to the last bit.
    """
    text = io.StringIO()
    for key, value in about.items():
        text.write(f"# {key}: {value}\n")
    writer = csv.writer(text, dialect="excel-tab", lineterminator="\n")
    names = [field.name for field in fields(kind)]
    writer.writerow(names)
    for row in rows:
        values = (getattr(row, name) for name in names)
        writer.writerow(["" if value is None else value for value in values])
    return text.getvalue()
