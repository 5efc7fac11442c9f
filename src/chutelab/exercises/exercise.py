"""What an exercise is made of: parameters, questions, and the mistakes that are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from chutelab.exercises.values import Values

G = 9.81
"""m/s², the gravity of all exercises."""

AS_PRINTED = "the equation as printed"
RADIUS = "radius forgotten"
BACKWARDS = "direction lost"
"""Names of mistakes that several lessons know."""

Formula = Callable[["Values"], float]
"""A number from the parameters and what was solved for them."""


@dataclass(frozen=True)
class Parameter:
    """One number that is drawn for a student.

    Attributes
    ----------
    name : str
        By which templates and formulas call it; unique in its exercise.
    symbol, meaning, unit : str
        For the table of the student's numbers.
    values : tuple of float
        What is drawn from: round numbers.
    """

    name: str
    symbol: str
    meaning: str
    unit: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Mistake:
    """A way to go wrong that is recognised by the number it leads to.

    Attributes
    ----------
    name : str
        A few words; one of `chutelab.exercises.general` replaces that general mistake.
    says : str
        What the student is told: what seems to have happened, and never the right number. A
        template.
    number : callable
        The wrong answer.
    """

    name: str
    says: str
    number: Formula


@dataclass(frozen=True)
class Question:
    """One question with one number for an answer. All texts are templates.

    Attributes
    ----------
    title, text : str
        A few words, and the question itself.
    unit : str
        Of the answer; empty for a pure number.
    answer : callable
        The right number.
    mistakes : tuple of Mistake
        Those of this question; the general ones come on top.
    hints : tuple of str
        Each says more than the one before.
    working : str
        The way to the answer, with the answer.
    source : str
        Equation or law behind it.
    tolerance : float
        Relative difference within which an answer counts as right.
    """

    title: str
    text: str
    unit: str
    answer: Formula
    mistakes: tuple[Mistake, ...]
    hints: tuple[str, ...]
    working: str
    source: str
    tolerance: float = 0.01


def nothing(given: Values) -> Mapping[str, float]:
    """Return no further numbers."""
    return {}


def always(given: Values) -> bool:
    """Return that any draw will do."""
    return True


@dataclass(frozen=True)
class Exercise:
    """The exercise of one lesson.

    Attributes
    ----------
    number : int
        Of the lesson.
    name, title : str
        As in ``the-bounce``; as a heading.
    story : str
        What all questions share, a template.
    parameters : tuple of Parameter
        What is drawn.
    questions : tuple of Question
        What is asked.
    solve : callable
        What texts and formulas need besides: the theory's answer for the parameters.
    tell : callable
        Numbers that follow from the parameters and are told to the student too.
    fits : callable
        Whether a draw is one the lesson is about, judged before it is solved.
    """

    number: int
    name: str
    title: str
    story: str
    parameters: tuple[Parameter, ...]
    questions: tuple[Question, ...]
    solve: Callable[[Values], Mapping[str, float]]
    tell: Callable[[Values], Mapping[str, float]] = nothing
    fits: Callable[[Values], bool] = always


def falls_past_pulley(given: Values, radius: float, bed: float = 0.0) -> bool:
    """Tell whether what an upright plate throws back is below the pulley when it gets there.

    Else it would strike pulley or belt on its way to the landing. From the plate it has d - 2 r to
    the place where it could touch the pulley, at ε v0, and falls all the time.

    Parameters
    ----------
    given : Values
        With v0, R, d and e, of a ball that leaves the pulley at its top.
    radius, bed : float
        Of the ball, and how much higher than on the pulley its flight begins, m.
    """
    ride = given.R + radius
    flown = (given.R + given.d - radius) / given.v0 + (given.d - 2.0 * radius) / (
        given.e * given.v0
    )
    return 0.5 * G * flown**2 > 2.0 * ride + bed


def steps(first: float, last: float, step: float) -> tuple[float, ...]:
    """Return round numbers from first to last, both included.

    >>> steps(0.3, 0.5, 0.1)
    (0.3, 0.4, 0.5)
    """
    count = round((last - first) / step) + 1
    return tuple(round(first + i * step, 9) for i in range(count))
