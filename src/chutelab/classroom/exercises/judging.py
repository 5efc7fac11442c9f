"""Judge what a student enters: right, a known mistake, or how far off.

Replies read well in a terminal and, as HTML without colours of background and text, in light and
dark notebooks.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from html import escape
from math import isinf, isnan
from typing import Any, Final

import numpy as np

from chutelab.classroom.exercises.exercise import DIGITS, GRAVITY, ROUNDED, TOLERANCE, Case, shown
from chutelab.pictures import GREEN, GREY, ORANGE, SKY, VERMILION
from chutelab.util.tables import Sheet
from chutelab.util.words import Words, words

WIDTH: Final = 88
"""Columns of a reply in a terminal."""


class Verdict(StrEnum):
    """The result of judging an answer."""

    RIGHT = "right"
    MISTAKE = "known mistake"
    OFF = "not yet"
    UNREAD = "not a number"
    BLANK = "not attempted"
    UNKNOWN = "no such question"


MARKS: Final = {
    Verdict.RIGHT: ("✓", GREEN),
    Verdict.MISTAKE: ("↻", VERMILION),
    Verdict.OFF: ("↻", VERMILION),
    Verdict.UNREAD: ("?", ORANGE),
    Verdict.BLANK: ("○", GREY),
    Verdict.UNKNOWN: ("?", ORANGE),
}
"""Sign and colour of each verdict; the words always say the same."""


def in_words(verdict: Verdict, language: str) -> str:
    """Return a verdict in the learner's language."""
    return words(language).say(f"verdict-{verdict.name.lower()}")


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
    """The reply to an answer."""

    question: int  # number of the question; 0 if there is no such question
    verdict: Verdict
    text: str  # what to tell the student
    # the known mistake that it looks like, or empty: its name in English, and in `language`
    mistake: str = ""
    called: str = ""
    language: str = "en"

    @property
    def right(self) -> bool:
        """Whether the answer is right."""
        return self.verdict is Verdict.RIGHT

    @property
    def heading(self) -> str:
        """The reply in a few words."""
        say = words(self.language).say
        if not self.question:
            return say("heading-unknown")
        if self.mistake:
            return say("heading-mistake", number=self.question, mistake=self.called)
        return say("heading", number=self.question, verdict=in_words(self.verdict, self.language))

    def __repr__(self) -> str:
        return filled(f"{MARKS[self.verdict][0]} {self.heading}. {self.text}")

    def _repr_html_(self) -> str:
        mark, colour = MARKS[self.verdict]
        return box(f"{mark} {self.heading}", self.text, colour)


@dataclass(frozen=True, repr=False)
class Passage:
    """A text: a question, a hint, or the working.

    `number` is that of the question, `unit` that of its answer.
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
    language: str = "en"

    @property
    def remarks(self) -> str:
        """Tries, hints and whether the working was shown, in words."""
        say, remarks = words(self.language).say, []
        if self.tries:
            key = "tries-one" if self.tries == 1 else "tries"
            remarks.append(say(key, count=self.tries))
        if self.hints:
            key = "hints-one" if self.hints == 1 else "hints"
            remarks.append(say(key, count=self.hints))
        return ", ".join([*remarks, say("working-shown")] if self.revealed else remarks)

    @property
    def state(self) -> str:
        """Verdict and remarks."""
        verdict = in_words(self.verdict, self.language)
        return f"{verdict} ({self.remarks})" if self.remarks else verdict


BAR, HEIGHT, GAP = 150, 12, 4
"""In pixels: length and height of a part of the progress bar, and the gap between two parts."""

FAINT: Final = 0.35
"""Opacity of the parts that were not attempted."""


@dataclass(frozen=True, repr=False)
class Progress:
    """Progress in a task, one row per question; the title says lesson and student."""

    title: str
    rows: tuple[Standing, ...]
    language: str = "en"

    @property
    def done(self) -> int:
        """Number of right answers."""
        return sum(row.verdict is Verdict.RIGHT for row in self.rows)

    @property
    def summary(self) -> str:
        """The state in a line."""
        say = words(self.language).say
        return say("progress", title=self.title, done=self.done, count=len(self.rows))

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
"""Most characters of a student's text that a reply quotes."""


def number_of(answer: object, said: Words | None = None) -> float | str | None:
    """Return an answer as a number; None for no attempt; for anything else advice in words.

    The words are those of a language, by default of English.

    >>> number_of([2]), number_of("..."), number_of("2,5")
    (2.0, None, 'That is text. Give the number without quotes: 2.5.')
    """
    say = (said or words()).say
    try:
        return _read(answer, say)
    except OverflowError:
        return say("unread-infinite")
    except Exception:  # a student's object may raise anything
        return say("unread-object", type=type(answer).__name__[:_LONGEST])


def _read(answer: Any, say: Callable[..., str]) -> float | str | None:
    if answer is None or answer is Ellipsis:
        return None
    if isinstance(answer, (bool, np.bool_)):
        return say("unread-truth", value=bool(answer))
    if isinstance(answer, (str, bytes)):
        text = answer if isinstance(answer, str) else answer.decode("utf-8", "replace")
        if not text.strip(" \t\n.?…_-"):
            return None
        found = _NUMBER.match(text)
        if found is None:
            return say("unread-text", text=text.strip()[:_LONGEST])
        if found[2].strip():
            return say("unread-unit")
        bare = found[1].replace(",", ".").replace("−", "-")[:_LONGEST]
        return say("unread-quoted", number=bare)
    if isinstance(answer, (complex, np.complexfloating)) and not isinstance(answer, float):
        return say("unread-complex")
    if isinstance(answer, (list, tuple, np.ndarray)):
        items = answer.ravel().tolist() if isinstance(answer, np.ndarray) else answer
        match answer:
            case (int(whole), int(digits)) if type(answer) is tuple and digits >= 0:
                # A decimal comma makes two numbers of one.
                return say("unread-comma", whole=whole, digits=digits)
        if len(items) > 1:
            return say("unread-several", count=len(items))
        return _read(items[0], say) if items else None
    if callable(answer):
        return say("unread-function")
    value = float(answer)
    if isnan(value):
        return say("unread-nan")
    return say("unread-divided") if isinf(value) else value


CLOSE: Final = 0.05
"""Up to this relative difference, rounding or another value of g is the likely reason."""


def is_close(answer: float, number: float) -> bool:
    """Tell whether an answer is a number within the tolerance."""
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

    It is right, a known mistake, another student's right answer, two mistakes at once, or off.
    `others` yields names and right answers of others to the same question; it is used only if
    needed.
    """
    said = words(case.numbers.language)

    def reply(verdict: Verdict, text: str, name: str = "", called: str = "") -> Reply:
        return Reply(case.number, verdict, text, name, called, said.language)

    if is_close(answer, case.right):
        found = number_with_unit(answer, case.question.unit, said)
        text = said.say("right", answer=found, percent=f"{100 * TOLERANCE:g}")
        return reply(Verdict.RIGHT, text)
    for trace in case.mistakes:
        if is_close(answer, trace.number):
            return reply(Verdict.MISTAKE, trace.says, trace.name, trace.called)
    for name, number in others:
        if is_rounded(answer, number):
            known, called = (one.say("mistake-others") for one in (words(), said))
            return reply(Verdict.MISTAKE, said.say("reply-others", name=name), known, called)
    # Name two mistakes only if exactly one pair gives this number.
    near = abs(answer / case.right - 1.0) <= CLOSE
    pairs = [trace for trace in case.pairs if is_close(answer, trace.number)]
    if len(pairs) == 1 and not near:
        return reply(Verdict.MISTAKE, pairs[0].says, pairs[0].name, pairs[0].called)
    return reply(Verdict.OFF, _distance(case, answer, said))


def number_with_unit(number: float, unit: str, said: Words) -> str:
    """Return a number with its unit, as texts show it."""
    return f"{said.local(shown(number))} {said.unit(unit)}".strip()


FAR: Final = 10.0
"""From this ratio on the reply says "more than 10 times" instead of a percentage."""


def _distance(case: Case, answer: float, said: Words) -> str:
    """Say how far off an answer is, without giving the right one away to all digits."""
    say = said.say
    more = say("python-hint", number=case.number)
    ratio = answer / case.right
    if ratio == 0.0:
        return f"{say('off-zero')} {more}"
    if ratio < 0.0:
        return f"{say('off-sign')} {more}"
    off = abs(ratio - 1.0)
    way = say("large" if ratio > 1.0 else "small")
    if off <= CLOSE:
        percent, gravity = f"{100 * off:.0f}", said.local(str(GRAVITY))
        key = "off-close-gravity" if case.feels_gravity else "off-close"
        return say(key, percent=percent, way=way, gravity=gravity)
    if 1.0 / FAR < ratio < FAR:
        factor = said.local(f"{max(ratio, 1.0 / ratio):.1f}")
        percent = f"{100 * off:.0f}"
        size = (
            say("off-percent", percent=percent) if off < 1.0 else say("off-factor", factor=factor)
        )
        return f"{say('off-about', size=size, way=way)} {more}"
    times = "10" if FAR <= max(ratio, 1.0 / ratio) < FAR**2 else "100"
    return f"{say('off-more', times=times, way=way)} {more}"
