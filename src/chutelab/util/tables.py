"""A small table for terminal and notebook, plain data for JSON, and columns as a DataFrame.

NumPy, pandas and rich are not imported before they are needed.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from html import escape
from importlib import import_module
from math import floor, inf, isfinite, log10
from textwrap import wrap
from typing import Any

from chutelab.util.errors import printable

WIDTH = 80
"""Columns of a line of prose in a terminal, at most."""

LONG = 55
"""A first cell of a row with at least so many characters may be broken, such as a path."""

UNBOUNDED = 10_000
"""Width of a table that is only as wide as its cells."""

STYLES = {"ok": "green", "FAILED": "bold red"}
"""Colours of verdicts in a terminal; a failure colours its whole row."""


@dataclass(frozen=True)
class Sheet:
    """A table of words and numbers."""

    title: str  # title, with units; "" for none
    columns: tuple[str, ...]  # heads, "" where a column needs none
    # cells; those of the foot stand below a line. The first line of a cell of several is bold. A
    # row of one cell is a heading over the rows that follow
    rows: tuple[tuple[str, ...], ...]
    foot: tuple[tuple[str, ...], ...] = ()
    texts: int = 1  # how many columns hold words; the others hold numbers and are set to the right
    tail: int = 0  # how many columns at the end hold words again
    notes: tuple[str, ...] = ()  # sentences below the table

    def __rich__(self) -> Any:
        """Return what rich prints: title, table and notes, a blank line between the parts."""
        from rich import box
        from rich.console import Group
        from rich.padding import Padding
        from rich.table import Table
        from rich.text import Text

        rows = [*self.rows, *self.foot]
        cells = [row for row in rows if len(row) > 1]
        widest = [max((len(row[i]) for row in cells), default=0) for i in range(len(self.columns))]
        headed = any(len(row) == 1 for row in rows)
        parts: list[Any] = [Text(f"\n{self.title}", style="bold")] if self.title else []

        def cell(text: str) -> Text:
            first, end, rest = text.partition("\n")
            if end:
                return Text.assemble((first, "bold"), end, rest)
            return Text(text, STYLES.get(text, ""))

        def begun(*, header: bool) -> Table:
            table = Table(
                box=box.SIMPLE_HEAD,
                show_edge=False,
                pad_edge=False,
                collapse_padding=True,
                show_header=header,
            )
            for index, (name, width) in enumerate(zip(self.columns, widest, strict=True)):
                if not self._has_words(index):
                    # Tables under several headings should have the same columns.
                    least = max(width, len(name)) if headed else width
                    table.add_column(name, justify="right", min_width=least)
                elif index == 0 and width < LONG:
                    # The first cell of a row stays on one line, unless it is a long path.
                    table.add_column(name, no_wrap=True, min_width=width)
                else:
                    table.add_column(name, overflow="fold")
            parts.append(Padding(table, (0, 0, 0, 2), expand=False) if headed else table)
            return table

        table = begun(header=True) if rows and any(self.columns) else None
        for number, row in enumerate(rows):
            if len(row) == 1:
                parts.append(Text("\n".join(wrapped(row[0]))))
                table = None
                continue
            table = table or begun(header=False)
            if number == len(self.rows):
                table.add_section()
            table.add_row(*map(cell, row), style=STYLES["FAILED"] if "FAILED" in row else "")
        if self.notes:
            notes = [line for note in self.notes for line in wrapped(note)]
            parts.append(Text("\n".join(["", *notes])))
        return Group(*parts)

    def __str__(self) -> str:
        """Return what rich prints, without colours, in lines as long as it takes."""
        from rich.console import Console

        out = io.StringIO()
        # In a notebook rich would display the table instead of returning it.
        Console(file=out, width=UNBOUNDED, color_system=None, force_jupyter=False).print(self)
        return "\n".join(
            printable(line.rstrip()) for line in out.getvalue().strip("\n").split("\n")
        )

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
        # Notebooks take text between two dollar signs for mathematics unless told otherwise.
        table = f"<table>{caption}{head}<tbody>{body}</tbody>{foot}</table>"
        return f'<div class="tex2jax_ignore mathjax_ignore">{table}{notes}</div>'

    _repr_html_ = html

    def _row(self, cells: tuple[str, ...], tag: str = "td") -> str:
        if len(cells) == 1:
            head = f'<th colspan="{len(self.columns)}" style="text-align:left">'
            return f"<tr>{head}{escape(cells[0])}</th></tr>"
        row = ""
        for index, cell in enumerate(cells):
            side = "left" if self._has_words(index) else "right"
            style = f"text-align:{side};padding:.1em .8em .1em 0"
            row += f'<{tag} style="{style}">{escape(cell).replace(chr(10), "<br>")}</{tag}>'
        return f"<tr>{row}</tr>"

    def _has_words(self, column: int) -> bool:
        return not self.texts <= column < len(self.columns) - self.tail


class Shown:
    """An object that is displayed as its `sheet`, in a terminal and in a notebook."""

    def sheet(self) -> Sheet:
        """Return the sheet to be shown."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return str(self.sheet())

    def __rich__(self) -> Sheet:
        return self.sheet()

    def _repr_html_(self) -> str:
        return self.sheet().html()


def wrapped(text: str) -> list[str]:
    """Return a text in lines of at most `WIDTH` characters, broken between words."""
    return wrap(text, WIDTH, break_on_hyphens=False)


def sentence(text: str) -> str:
    """Return a text with a capital letter, and a full stop.

    >>> sentence("two of them rest")
    'Two of them rest.'
    """
    return f"{text[0].upper()}{text[1:]}."


def number(value: float) -> str:
    """Return a number in six digits, "-" for one that is not finite; no zero has a sign.

    >>> number(0.29800000000000004), number(float("nan")), number(-0.0)
    ('0.298', '-', '0')
    """
    return f"{value + 0.0:.6g}" if isfinite(value) else "-"


def plus_minus(value: float, error: float) -> str:
    """Return a value with its uncertainty, to the significant digits.

    >>> plus_minus(0.62134, 0.00213), plus_minus(1.9, 0.0)
    ('0.6213 ± 0.0021', '1.9 ± 0')
    """
    return f"{rounded(value, error)} ± {rounded(error, error)}"


def rounded(value: float, error: float) -> str:
    """Return a value to the second digit of its uncertainty."""
    if not 0.0 < error < inf:
        return f"{value:.9g}"
    digits = max(0, 1 - floor(log10(float(f"{error:.1e}"))))
    return f"{value:.{digits}f}" if digits < 10 else f"{value:.4g}"


def many(count: int, what: str, style: str = "") -> str:
    """Return a number of things; `style` is how the number is written, "," in groups of three.

    >>> many(1, "particle"), many(2000, "particle", ",")
    ('1 particle', '2,000 particles')
    """
    return f"{count:{style}} {what}{'' if count == 1 else 's'}"


def plain(value: Any) -> Any:
    """Return a value as plain data for JSON.

    Dataclasses become objects, arrays lists, and numbers that are not finite None.

    >>> plain({"x": (1.0, float("nan")), "n": (1, 2)})
    {'x': [1.0, None], 'n': [1, 2]}
    """
    if value is None or isinstance(value, str | int):
        return value
    if hasattr(value, "tolist"):  # arrays and numbers of NumPy
        value = value.tolist()
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    return value


def frame(columns: Mapping[str, Any]) -> Any:
    """Return named columns, arrays of one length, as a DataFrame.

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
