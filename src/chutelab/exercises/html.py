"""Replies as HTML: no background and no text colour of their own, so right on light and on dark.

The colours are those of Okabe and Ito (2008), told apart with any common colour blindness; a sign
and words always say the same.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

GOOD = "#009E73"
WRONG = "#D55E00"
WARN = "#E69F00"
INFO = "#56B4E9"
QUIET = "#8C8C8C"

BAR, HEIGHT, GAP = 150, 12, 4
"""Pixels: length and height of a part of the progress bar, and what is between two."""

FAINT = 0.35
"""Opacity of the parts that nothing was done about."""


def box(colour: str, heading: str, text: str) -> str:
    """Return a heading and a text beside a coloured bar."""
    body = escape(text).replace("\n", "<br>")
    return (
        f'<div style="border-left:5px solid {colour};padding:.2em .9em;margin:.4em 0;'
        f'max-width:46em;line-height:1.5"><b>{escape(heading)}</b><br>{body}</div>'
    )


def progress(summary: str, rows: Sequence[tuple[str, str, str, str, str]]) -> str:
    """Return a bar with a part per question, and a line for each.

    Parameters
    ----------
    summary : str
        What a screen reader says of the bar.
    rows : sequence of (sign, colour, title, verdict, remarks)
        One per question.
    """
    width = len(rows) * (BAR + GAP) - GAP
    parts = "".join(
        f'<rect x="{i * (BAR + GAP)}" width="{BAR}" height="{HEIGHT}" rx="3" fill="{row[1]}"'
        f' fill-opacity="{FAINT if row[1] == QUIET else 1}"/>'
        for i, row in enumerate(rows)
    )
    bar = (
        f'<svg role="img" aria-label="{escape(summary)}" width="{width}" height="{HEIGHT}"'
        f' viewBox="0 0 {width} {HEIGHT}" style="max-width:100%">{parts}</svg>'
    )
    lines = [
        (sign, title, f"{verdict} ({remarks})" if remarks else verdict)
        for sign, _, title, verdict, remarks in rows
    ]
    return f'<div style="line-height:1.5"><b>{escape(summary)}</b><br>{bar}{table(lines)}</div>'


def table(rows: Iterable[Sequence[str]]) -> str:
    """Return a plain table, its cells aligned to the left."""
    body = "".join(
        "<tr>"
        + "".join(
            f'<td style="text-align:left;padding:.1em .8em .1em 0">{escape(cell)}</td>'
            for cell in row
        )
        + "</tr>"
        for row in rows
    )
    return f'<table style="margin:.3em 0">{body}</table>'
