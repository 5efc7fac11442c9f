"""Judging a number: right, a known mistake, or how far off."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chutelab.exercises.replies import Reply, Verdict
from chutelab.exercises.values import shown

if TYPE_CHECKING:
    from chutelab.exercises.drawing import Case

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
