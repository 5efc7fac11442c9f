"""A student's own parameters, drawn from the name: the same on every machine, for ever.

The draw is a hash (SHA-256) of lesson, name and parameter, so it depends on no random generator's
version. A draw for which two mistakes could not be told apart is thrown away and drawn again.
"""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from itertools import combinations
from math import isfinite
from typing import TYPE_CHECKING

from chutelab.exercises.general import Trace, traces
from chutelab.exercises.values import Values

if TYPE_CHECKING:
    from chutelab.exercises.exercise import Exercise, Question

MOST_DRAWS = 1000
"""A lesson whose draws fit less often than that is badly made."""

LEAST = 1e-9
"""An answer smaller than that in its unit has no digits to judge."""


@dataclass(frozen=True)
class Case:
    """One question for one student: the numbers behind it.

    Attributes
    ----------
    question : Question
        What is asked.
    values : Values
        The student's parameters, and what the theory makes of them.
    """

    question: Question
    values: Values

    @cached_property
    def right(self) -> float:
        """The right answer."""
        return float(self.question.answer(self.values))

    @cached_property
    def mistakes(self) -> tuple[Trace, ...]:
        """The question's own mistakes first, then the general ones that it does not replace."""
        own = [
            Trace(known.name, self.values.text(known.says), float(known.number(self.values)))
            for known in self.question.mistakes
        ]
        names = {trace.name for trace in own}
        general = [t for t in traces(self.right, self.question.unit) if t.name not in names]
        return (*own, *general)

    def matches(self, answer: float, number: float) -> bool:
        """Tell whether an answer is that number, within the tolerance."""
        return abs(answer - number) <= self.question.tolerance * abs(number)

    @property
    def clear(self) -> bool:
        """Whether the right answer and every mistake can be told from each other."""
        numbers = [self.right, *(trace.number for trace in self.mistakes)]
        if not all(isfinite(n) for n in numbers) or abs(self.right) < LEAST:
            return False
        if any(trace.number == 0.0 for trace in self.mistakes):
            return False
        twice = self.question.tolerance
        return all(abs(a - b) > twice * (abs(a) + abs(b)) for a, b in combinations(numbers, 2))


def plain(student: str) -> str:
    """Return a name without what people do not mean to differ in: case, spaces, Unicode forms.

    >>> plain("  Ada  LOVELACE ")
    'ada lovelace'
    """
    return " ".join(unicodedata.normalize("NFKC", student).casefold().split())


def draws(exercise: Exercise, student: str, attempt: int) -> Values:
    """Return what a student's attempt draws, whether it fits or not, and what is told besides."""
    drawn = {}
    for parameter in exercise.parameters:
        key = "\n".join((exercise.name, plain(student), parameter.name, str(attempt)))
        number = int.from_bytes(sha256(key.encode("utf-8", "replace")).digest()[:8])
        drawn[parameter.name] = parameter.values[number % len(parameter.values)]
    given = Values(drawn)
    return given.joined(exercise.tell(given))


def solved(exercise: Exercise, given: Values) -> tuple[Case, ...] | None:
    """Return the cases of all questions, or None if the draw does not fit or is not clear."""
    if not exercise.fits(given):
        return None
    try:
        values = given.joined(exercise.solve(given))
        cases = tuple(Case(question, values) for question in exercise.questions)
        return cases if all(case.clear for case in cases) else None
    except ValueError:
        # A mistake may lead out of a function's domain, such as arccos of more than 1.
        return None


def draw(exercise: Exercise, student: str) -> tuple[Values, tuple[Case, ...]]:
    """Return a student's parameters and the cases of all questions.

    Raises
    ------
    RuntimeError
        If none of many draws fits: the exercise is wrongly made.
    """
    for attempt in range(MOST_DRAWS):
        given = draws(exercise, student, attempt)
        cases = solved(exercise, given)
        if cases is not None:
            return given, cases
    raise RuntimeError(f"{exercise.name}: none of {MOST_DRAWS} draws fits")
