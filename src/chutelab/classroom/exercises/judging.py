"""From what a student hands over to a reply: right, a known mistake, or how far off.

Replies read well in a terminal and, as HTML without colours of background and text, in light and
dark notebooks.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from html import escape
from math import isinf, isnan
from typing import Any

import numpy as np

from chutelab.classroom.exercises.exercise import Case, shown
from chutelab.pictures import colours
from chutelab.util.tables import Sheet

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


WIDTH = 88
"""Columns of a reply in a terminal."""


class Verdict(StrEnum):
    """What became of an answer."""

    RIGHT = "right"
    MISTAKE = "known mistake"
    OFF = "off"
    UNREAD = "not a number"
    BLANK = "not attempted"
    UNKNOWN = "no such question"


MARKS = {
    Verdict.RIGHT: ("✓", GOOD),
    Verdict.MISTAKE: ("✗", WRONG),
    Verdict.OFF: ("✗", WRONG),
    Verdict.UNREAD: ("?", WARN),
    Verdict.BLANK: ("○", QUIET),
    Verdict.UNKNOWN: ("?", WARN),
}
"""Sign and colour of each verdict; the words always say it too."""


@dataclass(frozen=True, repr=False)
class Reply:
    """The answer to an answer.

    Attributes
    ----------
    question : int
        Number of the question; 0 if there is no such one.
    verdict : Verdict
        What became of it.
    mistake : str
        Name of the known mistake that it looks like, or empty.
    text : str
        What to tell the student.
    """

    question: int
    verdict: Verdict
    text: str
    mistake: str = ""

    @property
    def right(self) -> bool:
        """Whether the answer is right."""
        return self.verdict is Verdict.RIGHT

    @property
    def heading(self) -> str:
        """The reply in a few words."""
        words = f"looks like {self.mistake}" if self.mistake else str(self.verdict)
        return f"Question {self.question}: {words}" if self.question else "No such question"

    def __repr__(self) -> str:
        return filled(f"{MARKS[self.verdict][0]} {self.heading}. {self.text}")

    def _repr_html_(self) -> str:
        mark, colour = MARKS[self.verdict]
        return box(colour, f"{mark} {self.heading}", self.text)


@dataclass(frozen=True, repr=False)
class Passage:
    """Something to read: a question, a hint, the working.

    Attributes
    ----------
    number : int
        Of the question.
    title, text, unit : str
        Heading, what it says, unit of the answer that is asked for.
    """

    number: int
    title: str
    text: str
    unit: str = ""

    def __repr__(self) -> str:
        return f"{self.title}\n{filled(self.text)}"

    def _repr_html_(self) -> str:
        return box(INFO, self.title, self.text)


@dataclass(frozen=True)
class Standing:
    """How far a student got with one question.

    Attributes
    ----------
    number, title
        Of the question.
    verdict : Verdict
        Of the last answer.
    tries : int
        Answers given, blank ones not counted.
    hints : int
        Hints read.
    revealed : bool
        Whether the working was shown.
    """

    number: int
    title: str
    verdict: Verdict
    tries: int
    hints: int
    revealed: bool

    @property
    def remarks(self) -> str:
        """Tries, hints and whether the working was shown, in words."""
        words = [
            f"{count} {noun if count == 1 else plural}"
            for count, noun, plural in (
                (self.tries, "try", "tries"),
                (self.hints, "hint", "hints"),
            )
            if count
        ]
        return ", ".join([*words, *(["working shown"] if self.revealed else [])])


@dataclass(frozen=True, repr=False)
class Progress:
    """What is done of a task.

    Attributes
    ----------
    title : str
        Lesson and student.
    rows : tuple of Standing
        One per question.
    """

    title: str
    rows: tuple[Standing, ...]

    @property
    def done(self) -> int:
        """Number of right answers."""
        return sum(row.verdict is Verdict.RIGHT for row in self.rows)

    @property
    def summary(self) -> str:
        """The state in a line."""
        return f"{self.title}: {self.done} of {len(self.rows)} done"

    def __repr__(self) -> str:
        width = max(len(row.title) for row in self.rows)
        lines = [
            f"  {MARKS[row.verdict][0]} {row.number} {row.title:<{width}}  {row.verdict}"
            + (f" ({row.remarks})" if row.remarks else "")
            for row in self.rows
        ]
        return "\n".join([self.summary, *lines])

    def _repr_html_(self) -> str:
        cells = [
            (*MARKS[row.verdict], f"{row.number} {row.title}", str(row.verdict), row.remarks)
            for row in self.rows
        ]
        return progress(self.summary, cells)


def filled(text: str) -> str:
    """Return a text in lines that fit a terminal; its own line breaks are kept."""
    return "\n".join(textwrap.fill(line, WIDTH) for line in text.split("\n"))


_NUMBER = re.compile(r"\s*([-+−]?\d*[.,]?\d+(?:[eE][-+−]?\d+)?)\s*(.*)", re.DOTALL)
_LONGEST = 40
"""Characters of a student's text that are shown back."""


class Unreadable(Exception):  # noqa: N818 - nothing went wrong, it is only no number
    """Something that is not one number; its text says what to do."""


def number_of(answer: object) -> float | None:
    """Return the number that an answer is, None if nothing was attempted.

    Raises
    ------
    Unreadable
        If it is something else, with a kind text.
    """
    try:
        return _read(answer)
    except Unreadable:
        raise
    except OverflowError:
        raise Unreadable("That is infinite, or nearly so. Was something multiplied?") from None
    except Exception:  # a student's object may raise anything
        kind = type(answer).__name__[:_LONGEST]
        raise Unreadable(f"That is a {kind}, and one number is asked for.") from None


def _read(answer: Any) -> float | None:
    if answer is None or answer is Ellipsis:
        return None
    if isinstance(answer, (bool, np.bool_)):
        raise Unreadable(
            f"That is {bool(answer)}, the result of a comparison. A number is asked for."
        )
    if isinstance(answer, (str, bytes)):
        return _text(answer if isinstance(answer, str) else answer.decode("utf-8", "replace"))
    if isinstance(answer, (complex, np.complexfloating)) and not isinstance(answer, float):
        raise Unreadable(
            "That is a complex number. Was there the square root of something negative?"
        )
    if isinstance(answer, (list, tuple, np.ndarray)):
        return _several(answer)
    if callable(answer):
        raise Unreadable(
            "That is a function, not its result. Call it, with its numbers in parentheses."
        )
    return _finite(float(answer))


def _finite(value: float) -> float:
    if isnan(value):
        raise Unreadable(
            "That is NaN, not a number: somewhere on the way something had no answer, such as the"
            " arccos of more than 1 or 0 / 0. Print the steps one by one."
        )
    if isinf(value):
        raise Unreadable("That is infinite. Was something divided by zero?")
    return value


def _several(answer: Any) -> float | None:
    items = answer.ravel().tolist() if isinstance(answer, np.ndarray) else list(answer)
    if len(items) > 1:
        raise Unreadable(
            f"Those are {len(items)} values, and one number is asked for. Pick it, with [0] say."
        )
    return _read(items[0]) if items else None


def _text(text: str) -> float | None:
    if not text.strip(" \t\n.?…_-"):
        return None
    found = _NUMBER.match(text)
    if found is None:
        short = text.strip()[:_LONGEST]
        raise Unreadable(f"That is text (“{short}”). Give a number, without quotes.")
    bare = found[1].replace(",", ".").replace("−", "-")[:_LONGEST]
    if found[2].strip():
        raise Unreadable(
            "That is text with a unit in it. Give the number alone, without quotes and unit, in the"
            " unit that is asked for."
        )
    raise Unreadable(f"That is text. Give the number without quotes: {bare}.")


CLOSE = 0.05
"""Relative difference up to which rounding, or another g, is the likely reason."""

FAR = 10.0
"""Ratio from which on a percentage says less than a factor."""


def judge(number: int, case: Case, answer: float) -> Reply:
    """Judge an answer: the right number first, then the question's mistakes, then the general ones.

    Parameters
    ----------
    number : int
        Of the question, for the reply.
    case : Case
        The question with the student's parameters.
    answer : float
        A finite number, in the unit that was asked for.
    """
    question = case.question
    if case.matches(answer, case.right):
        found = f"{shown(answer)} {question.unit}".strip()
        text = f"{found} is within {100 * question.tolerance:g} % of what the theory gives."
        return Reply(number, Verdict.RIGHT, text)
    for trace in case.mistakes:
        if case.matches(answer, trace.number):
            return Reply(number, Verdict.MISTAKE, trace.says, trace.name)
    return Reply(number, Verdict.OFF, _distance(number, answer, case.right))


def blank(number: int) -> Reply:
    """Return the reply to nothing."""
    text = f"Put your number in place of None, and run the cell. Stuck? task.hint({number})"
    return Reply(number, Verdict.BLANK, text)


def unread(number: int, problem: str) -> Reply:
    """Return the reply to what is no number."""
    return Reply(number, Verdict.UNREAD, problem)


def _distance(number: int, answer: float, right: float) -> str:
    """Say how far off an answer is, without giving the right one away to all digits."""
    more = f" Try task.hint({number})."
    ratio = answer / right
    if ratio == 0.0:
        return f"It is not 0.{more}"
    if ratio < 0.0:
        return f"The sign is the other way round, and the size is not right either.{more}"
    off = abs(ratio - 1.0)
    way = "large" if ratio > 1.0 else "small"
    if off <= CLOSE:
        return (
            f"Close: about {100 * off:.0f} % too {way}. Were numbers rounded on the way, or is g"
            " not 9.81 m/s²?"
        )
    if 1.0 / FAR < ratio < FAR:
        factor = max(ratio, 1.0 / ratio)
        size = f"{100 * off:.0f} %" if off < 1.0 else f"a factor of {factor:.1f}"
        return f"It looks like no mistake I know. It is about {size} too {way}.{more}"
    power = "10" if FAR <= max(ratio, 1.0 / ratio) < FAR**2 else "100"
    return f"It looks like no mistake I know. It is more than {power} times too {way}.{more}"
