"""From what a student hands over to a reply: right, a known mistake, or how far off.

Replies read well in a terminal and, as HTML without colours of background and text, in light and
dark notebooks.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from html import escape
from math import isinf, isnan
from typing import Any, Final

import numpy as np

from chutelab.classroom.exercises.exercise import DIGITS, GRAVITY, ROUNDED, TOLERANCE, Case, shown
from chutelab.pictures import GREEN, GREY, ORANGE, SKY, VERMILION
from chutelab.util.tables import Sheet

WIDTH: Final = 88
"""Columns of a reply in a terminal."""


class Verdict(StrEnum):
    """What became of an answer."""

    RIGHT = "right"
    MISTAKE = "known mistake"
    OFF = "off"
    UNREAD = "not a number"
    BLANK = "not attempted"
    UNKNOWN = "no such question"


MARKS: Final = {
    Verdict.RIGHT: ("✓", GREEN),
    Verdict.MISTAKE: ("✗", VERMILION),
    Verdict.OFF: ("✗", VERMILION),
    Verdict.UNREAD: ("?", ORANGE),
    Verdict.BLANK: ("○", GREY),
    Verdict.UNKNOWN: ("?", ORANGE),
}
"""Sign and colour of each verdict; the words always say it too."""


def filled(text: str) -> str:
    """Return a text in lines that fit a terminal; its own line breaks are kept."""
    return "\n".join(textwrap.fill(line, WIDTH) for line in text.split("\n"))


def box(heading: str, text: str, colour: str = SKY) -> str:
    """Return a heading and a text beside a coloured bar, as HTML."""
    body = escape(text).replace("\n", "<br>")
    return (
        f'<div style="border-left:5px solid {colour};padding:.2em .9em;margin:.4em 0;'
        f'max-width:46em;line-height:1.5"><b>{escape(heading)}</b><br>{body}</div>'
    )


def table(rows: Sequence[tuple[str, ...]]) -> str:
    """Return a table of words without a head, at least one row, as HTML."""
    width = len(rows[0])
    return Sheet("", ("",) * width, tuple(rows), texts=width).html()


@dataclass(frozen=True, repr=False)
class Reply:
    """The answer to an answer.

    Attributes
    ----------
    question
        Its number; 0 if there is no such one.
    verdict, text
        What became of the answer, and what to tell the student.
    mistake
        Name of the known mistake that it looks like, or empty.
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
        return box(f"{mark} {self.heading}", self.text, colour)


@dataclass(frozen=True, repr=False)
class Passage:
    """Something to read: a question, a hint, the working.

    `number` is that of the question, `unit` that of the answer which is asked for.
    """

    number: int
    title: str
    text: str
    unit: str = ""

    def __repr__(self) -> str:
        return f"{self.title}\n{filled(self.text)}"

    def _repr_html_(self) -> str:
        return box(self.title, self.text)


@dataclass
class Standing:
    """How far a student got with one question."""

    number: int
    title: str
    verdict: Verdict = Verdict.BLANK  # of the last answer
    answer: float | None = None  # the last number that was checked
    tries: int = 0  # blank answers are not counted
    hints: int = 0  # how many were read
    revealed: bool = False  # whether the working was shown

    @property
    def remarks(self) -> str:
        """Tries, hints and whether the working was shown, in words."""
        words = []
        if self.tries:
            words.append("1 try" if self.tries == 1 else f"{self.tries} tries")
        if self.hints:
            words.append("1 hint" if self.hints == 1 else f"{self.hints} hints")
        return ", ".join([*words, "working shown"] if self.revealed else words)

    @property
    def state(self) -> str:
        """Verdict and remarks."""
        return f"{self.verdict} ({self.remarks})" if self.remarks else str(self.verdict)


BAR, HEIGHT, GAP = 150, 12, 4
"""Pixels: length and height of a part of the progress bar, and what is between two."""

FAINT: Final = 0.35
"""Opacity of the parts that nothing was done about."""


@dataclass(frozen=True, repr=False)
class Progress:
    """What is done of a task, a row for each question; the title says lesson and student."""

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
            f"  {MARKS[row.verdict][0]} {row.number} {row.title:<{width}}  {row.state}"
            for row in self.rows
        ]
        return "\n".join([self.summary, *lines])

    def _repr_html_(self) -> str:
        summary = escape(self.summary)
        width = len(self.rows) * (BAR + GAP) - GAP
        parts = "".join(
            f'<rect x="{i * (BAR + GAP)}" width="{BAR}" height="{HEIGHT}" rx="3"'
            f' fill="{MARKS[row.verdict][1]}"'
            f' fill-opacity="{FAINT if row.verdict is Verdict.BLANK else 1}"/>'
            for i, row in enumerate(self.rows)
        )
        bar = (
            f'<svg role="img" aria-label="{summary}" width="{width}" height="{HEIGHT}"'
            f' viewBox="0 0 {width} {HEIGHT}" style="max-width:100%">{parts}</svg>'
        )
        lines = table(
            [(MARKS[row.verdict][0], f"{row.number} {row.title}", row.state) for row in self.rows]
        )
        return f'<div style="line-height:1.5"><b>{summary}</b><br>{bar}{lines}</div>'


_NUMBER: Final = re.compile(r"\s*([-+−]?\d*[.,]?\d+(?:[eE][-+−]?\d+)?)\s*(.*)", re.DOTALL)
_LONGEST: Final = 40
"""Characters of a student's text that are shown back."""


def number_of(answer: object) -> float | str | None:
    """Return the number that an answer is, None for no attempt, or else words: what to do instead.

    >>> number_of([2]), number_of("..."), number_of("2,5")
    (2.0, None, 'That is text. Give the number without quotes: 2.5.')
    """
    try:
        return _read(answer)
    except OverflowError:
        return "That is infinite, or nearly so. Was something multiplied?"
    except Exception:  # a student's object may raise anything
        return f"That is a {type(answer).__name__[:_LONGEST]}, and one number is asked for."


def _read(answer: Any) -> float | str | None:
    if answer is None or answer is Ellipsis:
        return None
    if isinstance(answer, (bool, np.bool_)):
        return f"That is {bool(answer)}, the result of a comparison. A number is asked for."
    if isinstance(answer, (str, bytes)):
        return _of_text(answer if isinstance(answer, str) else answer.decode("utf-8", "replace"))
    if isinstance(answer, (complex, np.complexfloating)) and not isinstance(answer, float):
        return "That is a complex number. Was there the square root of something negative?"
    if isinstance(answer, (list, tuple, np.ndarray)):
        items = answer.ravel().tolist() if isinstance(answer, np.ndarray) else answer
        if len(items) > 1:
            return _of_several(answer, items)
        return _read(items[0]) if items else None
    if callable(answer):
        return "That is a function, not its result. Call it, with its numbers in parentheses."
    value = float(answer)
    if isnan(value):
        return (
            "That is NaN, not a number: somewhere on the way something had no answer, such as the"
            " arccos of more than 1 or 0 / 0. Print the steps one by one."
        )
    return "That is infinite. Was something divided by zero?" if isinf(value) else value


def _of_several(answer: object, items: Sequence[Any]) -> str:
    """Say what to do about several values: one to pick, or a decimal comma, which makes two."""
    match answer:
        case (int(whole), int(digits)) if type(answer) is tuple and digits >= 0:
            return (
                f"Python takes {whole},{digits} for two numbers. Write the decimal comma as a"
                f" point: {whole}.{digits}."
            )
    return f"Those are {len(items)} values, and one number is asked for. Pick it, with [0] say."


def _of_text(text: str) -> str | None:
    """Say what to do about a text: a number in quotes, one with a unit, or words."""
    if not text.strip(" \t\n.?…_-"):
        return None
    found = _NUMBER.match(text)
    if found is None:
        return f"That is text (“{text.strip()[:_LONGEST]}”). Give a number, without quotes."
    if found[2].strip():
        return (
            "That is text with a unit in it. Give the number alone, without quotes and unit, in the"
            " unit that is asked for."
        )
    bare = found[1].replace(",", ".").replace("−", "-")[:_LONGEST]
    return f"That is text. Give the number without quotes: {bare}."


CLOSE: Final = 0.05
"""Relative difference up to which rounding, or another g, is the likely reason."""


def is_close(answer: float, number: float) -> bool:
    """Tell whether an answer stands for a number: whether it is within the tolerance."""
    return abs(answer - number) <= TOLERANCE * abs(number)


def is_rounded(answer: float, number: float) -> bool:
    """Tell whether an answer is a number, rounded to three digits or more.

    >>> is_rounded(0.452, 0.45189), is_rounded(0.4519, 0.45189), is_rounded(0.4512, 0.45189)
    (True, True, False)
    """
    digits = f"{answer:.15e}".partition("e")[0].rstrip("0")
    kept = min(max(sum(map(str.isdigit, digits)), ROUNDED), DIGITS)
    return f"{answer:.{kept - 1}e}" == f"{number:.{kept - 1}e}"


def judge(case: Case, answer: float, others: Iterable[tuple[str, float]] = ()) -> Reply:
    """Judge a finite answer.

    It is the right one, or a known mistake, or the right one of somebody else, or two mistakes at
    once, or off.

    Parameters
    ----------
    others
        Name and right answer to the same question of others; looked at only if need be.
    """
    if is_close(answer, case.right):
        found = f"{shown(answer)} {case.question.unit}".strip()
        text = f"{found} is within {100 * TOLERANCE:g} % of what the theory gives."
        return Reply(case.number, Verdict.RIGHT, text)
    for trace in case.mistakes:
        if is_close(answer, trace.number):
            return Reply(case.number, Verdict.MISTAKE, trace.says, trace.name)
    for name, number in others:
        if is_rounded(answer, number):
            says = f"That is right for the numbers of {name}, and yours are different ones."
            return Reply(case.number, Verdict.MISTAKE, says, "somebody else's numbers")
    # What is close has hardly two mistakes in it, and what two pairs lead to tells of neither.
    near = abs(answer / case.right - 1.0) <= CLOSE
    pairs = [trace for trace in case.pairs if is_close(answer, trace.number)]
    if len(pairs) == 1 and not near:
        return Reply(case.number, Verdict.MISTAKE, pairs[0].says, pairs[0].name)
    return Reply(case.number, Verdict.OFF, _distance(case, answer))


FAR: Final = 10.0
"""Ratio from which on a percentage says less than a factor."""


def _distance(case: Case, answer: float) -> str:
    """Say how far off an answer is, without giving the right one away to all digits."""
    more = f" Try task.hint({case.number})."
    ratio = answer / case.right
    if ratio == 0.0:
        return f"It is not 0.{more}"
    if ratio < 0.0:
        return f"The sign is the other way round, and the size is not right either.{more}"
    off = abs(ratio - 1.0)
    way = "large" if ratio > 1.0 else "small"
    if off <= CLOSE:
        gravity = f", or is g not {GRAVITY} m/s²" if case.feels_gravity else ""
        return (
            f"Close: about {100 * off:.0f} % too {way}. Were numbers rounded on the way{gravity}?"
        )
    if 1.0 / FAR < ratio < FAR:
        factor = max(ratio, 1.0 / ratio)
        size = f"{100 * off:.0f} %" if off < 1.0 else f"a factor of {factor:.1f}"
        return f"It looks like no mistake I know. It is about {size} too {way}.{more}"
    power = "10" if FAR <= max(ratio, 1.0 / ratio) < FAR**2 else "100"
    return f"It looks like no mistake I know. It is more than {power} times too {way}.{more}"
