"""What an exercise is made of: parameters, questions, and the mistakes that are known.

Some mistakes any question knows: a sign, a power of ten, radians, ½. A student's own parameters are
drawn from the name, the same on every machine, and redrawn until every mistake can be told from the
others.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from itertools import combinations
from math import degrees, isfinite, radians

DIGITS = 4
"""Significant digits of numbers in texts: more than any tolerance here can tell apart."""


class Values:
    """Numbers by name, read as attributes; SI units unless an exercise says otherwise.

    Parameters
    ----------
    numbers : mapping of float
        The numbers; they cannot be changed later.

    Examples
    --------
    >>> given = Values({"v0": 2.0, "h": 0.5})
    >>> given.v0, given.text("from {h} m at {v0} m/s")
    (2.0, 'from 0.5 m at 2 m/s')
    """

    __slots__ = ("_numbers",)

    _numbers: dict[str, float]

    def __init__(self, numbers: Mapping[str, float]) -> None:
        object.__setattr__(self, "_numbers", {name: float(n) for name, n in numbers.items()})

    def __getattr__(self, name: str) -> float:
        if not name.startswith("_"):
            numbers = self._numbers
            if name in numbers:
                return numbers[name]
            raise AttributeError(f"no number {name!r} here; there are {', '.join(numbers)}")
        raise AttributeError(name)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("these numbers are given; keep your own in variables of your own")

    def __getitem__(self, name: str) -> float:
        return self._numbers[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._numbers)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._numbers]

    def __repr__(self) -> str:
        return ", ".join(f"{name} = {shown(number)}" for name, number in self._numbers.items())

    def joined(self, more: Mapping[str, float]) -> Values:
        """Return these numbers and more."""
        return Values({**self._numbers, **more})

    def text(self, template: str) -> str:
        """Return a template with every ``{name}`` replaced by its number."""
        return template.format_map({name: shown(n) for name, n in self._numbers.items()})


def shown(number: float) -> str:
    """Return a number as texts show it.

    >>> shown(2.0), shown(0.0123456), shown(2.5e-07)
    ('2', '0.01235', '2.5e-7')
    """
    mantissa, _, power = f"{number:.{DIGITS}g}".partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa


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
        A few words; one of `chutelab.classroom.exercises.exercise` replaces that general mistake.
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


SIGN = "sign or direction"
TENS = "power of ten"
ANGLE = "radians for degrees"
DOUBLE = "a missing ½"
HALF = "a ½ too many"

MOST_TENS = 6
"""Powers of ten, either way: from micro to mega."""


@dataclass(frozen=True)
class Trace:
    """A wrong number, the mistake it tells of, and what to say about it."""

    name: str
    says: str
    number: float


def traces(right: float, unit: str) -> list[Trace]:
    """Return what the general mistakes make of the right answer.

    Parameters
    ----------
    right : float
        The right answer, not 0.
    unit : str
        Its unit; angles are asked for in ``degrees``.
    """
    found = [
        Trace(
            SIGN,
            "The size is right, but the sign is not. Which way does it point, and which way counts"
            " as positive here?",
            -right,
        ),
        Trace(DOUBLE, "Twice what it should be. Is a ½ missing?", 2.0 * right),
        Trace(HALF, "Half of what it should be. Is there a ½ too many, or a 2 missing?", right / 2),
    ]
    if unit == "degrees":
        found += [
            Trace(ANGLE, "That is the angle in radians; degrees are asked for.", radians(right)),
            Trace(
                ANGLE,
                "An angle that was in degrees seems to have been turned into degrees once more.",
                degrees(right),
            ),
        ]
    for power in range(-MOST_TENS, MOST_TENS + 1):
        if power != 0:
            size = f"10{_raised(abs(power))} = {10 ** abs(power):,} times too".replace(",", " ")
            size += " large" if power > 0 else " small"
            unit_too = " Is it all in SI units: kg for g, m for mm, J for mJ?"
            says = f"The digits are right, but it is {size}.{unit_too}"
            found.append(Trace(TENS, says, right * 10.0**power))
            also = f"{says} And the sign is the other way round."
            found.append(Trace(TENS, also, -right * 10.0**power))
    return found


def _raised(power: int) -> str:
    return str(power).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))


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
