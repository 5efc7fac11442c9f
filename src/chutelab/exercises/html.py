"""Replies as HTML: no background and no text colour of their own, so right on light and on dark.

What colours say, a sign and words always say too.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from chutelab import colours
from chutelab.sheet import Sheet

if TYPE_CHECKING:
    from collections.abc import Sequence

GOOD, WRONG, WARN = colours.GREEN, colours.VERMILION, colours.ORANGE
INFO, QUIET = colours.SKY, colours.GREY

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


def table(rows: Sequence[tuple[str, ...]]) -> str:
    """Return a table of words without a head, at least one row."""
    width = len(rows[0])
    return Sheet("", ("",) * width, tuple(rows), texts=width).html()
