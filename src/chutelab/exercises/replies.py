"""What a task answers: made to be read, in a terminal and in a notebook."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from enum import StrEnum

from chutelab.exercises import html

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
    Verdict.RIGHT: ("✓", html.GOOD),
    Verdict.MISTAKE: ("✗", html.WRONG),
    Verdict.OFF: ("✗", html.WRONG),
    Verdict.UNREAD: ("?", html.WARN),
    Verdict.BLANK: ("○", html.QUIET),
    Verdict.UNKNOWN: ("?", html.WARN),
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
        return html.box(colour, f"{mark} {self.heading}", self.text)


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
        return html.box(html.INFO, self.title, self.text)


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
        return html.progress(self.summary, cells)


def filled(text: str) -> str:
    """Return a text in lines that fit a terminal; its own line breaks are kept."""
    return "\n".join(textwrap.fill(line, WIDTH) for line in text.split("\n"))
