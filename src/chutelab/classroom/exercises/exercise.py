"""What an exercise is made of: parameters, questions, and the mistakes that are known.

An exercise is a file ``NAME.toml`` beside this module, without any code: what is drawn, formulas,
and four questions, each with its right answer and a row for each known mistake: name, formula,
reply. A formula is a Python expression of the parameters, of other formulas and of `FUNCTIONS`.
Texts are templates: ``{name}`` stands for a number, and a line break for a space.

Some mistakes any question knows: a sign, a power of ten, radians, ½. A student's own parameters are
drawn from the name, the same on every machine, and redrawn until every mistake can be told from the
others.
"""

from __future__ import annotations

import math
import re
import tomllib
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache, cached_property
from hashlib import sha256
from importlib.resources.abc import Traversable
from itertools import combinations
from math import degrees, isfinite, radians
from types import CodeType, SimpleNamespace
from typing import Any, Final

from chutelab.theory import transfer

DIGITS: Final = 4
"""Significant digits of numbers in texts: more than any tolerance here can tell apart."""

TOLERANCE: Final = 0.01
"""Relative difference within which an answer counts as right."""


class Values:
    """A student's numbers by name, read as attributes; SI units unless an exercise says otherwise.

    Parameters
    ----------
    numbers : mapping of float
        The numbers; they cannot be changed later.

    Examples
    --------
    >>> given = Values({"v0": 2.0, "h": 0.5})
    >>> given.v0, given
    (2.0, v0 = 2, h = 0.5)
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

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._numbers]

    def __repr__(self) -> str:
        return ", ".join(f"{name} = {shown(number)}" for name, number in self._numbers.items())


def shown(number: float) -> str:
    """Return a number as texts show it.

    >>> shown(2.0), shown(0.0123456), shown(2.5e-07)
    ('2', '0.01235', '2.5e-7')
    """
    mantissa, _, power = f"{number:.{DIGITS}g}".partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa


def _carried(**arguments: Any) -> SimpleNamespace:
    """Return what `chutelab.theory.transfer` finds, as numbers and lists of numbers."""
    found = transfer(**arguments)
    return SimpleNamespace(**{f.name: getattr(found, f.name).tolist() for f in fields(found)})


_OF_MATH: Final = (
    "acos", "asin", "atan", "atan2", "cos", "degrees", "hypot", "inf", "log", "log10", "radians",
    "sin", "sqrt",
)  # fmt: skip
FUNCTIONS: Final[dict[str, Any]] = {
    "__builtins__": {},
    "g": 9.81,
    "transfer": _carried,
    **{one.__name__: one for one in (abs, dict, round)},
    **{name: getattr(math, name) for name in _OF_MATH},
}
"""What formulas know besides the exercise's own names; g in m/s²."""


@cache
def _compiled(formula: str) -> CodeType:
    return compile(formula, f"<{formula}>", "eval")


class Numbers(dict[str, Any]):
    """All numbers of one draw by name; a formula is computed when it is first asked for.

    Parameters
    ----------
    drawn : mapping of float
        The parameters.
    formulas : mapping of str
        How the other numbers follow from them.
    """

    def __init__(self, drawn: Mapping[str, float], formulas: Mapping[str, str]) -> None:
        super().__init__(drawn)
        self.formulas = formulas

    def __missing__(self, name: str) -> Any:
        # A KeyError sends `eval` on to FUNCTIONS.
        self[name] = value = self.of(self.formulas[name])
        return value

    def of(self, formula: str) -> Any:
        """Return the value of a formula."""
        return eval(_compiled(formula), FUNCTIONS, self)

    def text(self, template: str) -> str:
        """Return a template with every ``{name}`` replaced by its number."""
        return re.sub(r"\{(\w+)\}", lambda match: shown(self[match[1]]), template)


@dataclass(frozen=True)
class Parameter:
    """One number that is drawn for a student.

    Attributes
    ----------
    name : str
        By which templates and formulas call it; unique in its exercise.
    symbol, unit, meaning : str
        For the table of the student's numbers.
    values : tuple of float
        What is drawn from: round numbers.
    """

    name: str
    symbol: str
    unit: str
    meaning: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Mistake:
    """A way to go wrong that is recognised by the number it leads to.

    Attributes
    ----------
    name : str
        A few words; that of a general mistake replaces it.
    formula : str
        The wrong answer.
    says : str
        What the student is told: what seems to have happened, and never the right number. A
        template.
    """

    name: str
    formula: str
    says: str


@dataclass(frozen=True)
class Question:
    """One question with one number for an answer. All texts are templates.

    Attributes
    ----------
    title, text : str
        A few words, and the question itself.
    unit : str
        Of the answer; empty for a pure number. Angles are asked for in ``degrees``.
    answer : str
        Formula of the right number.
    mistakes : tuple of Mistake
        Those of this question; the general ones come on top.
    hints : tuple of str
        Each says more than the one before.
    working : str
        The way to the answer, with the answer, line by line.
    source : str
        Equation or law behind it.
    """

    title: str
    text: str
    unit: str
    answer: str
    mistakes: tuple[Mistake, ...]
    hints: tuple[str, ...]
    working: str
    source: str


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
    formulas : mapping of str
        What texts and other formulas need besides.
    tell : tuple of str
        Formulas whose numbers are told to the student too.
    fits : tuple of str
        Conditions of a draw that the lesson is about.
    """

    number: int
    name: str
    title: str
    story: str
    parameters: tuple[Parameter, ...]
    questions: tuple[Question, ...]
    formulas: Mapping[str, str]
    tell: tuple[str, ...]
    fits: tuple[str, ...]


def read(file: Traversable) -> Exercise:
    """Read the exercise in a TOML file."""
    found = tomllib.loads(file.read_text(encoding="utf-8"))
    questions = tuple(
        Question(
            title=asked["title"],
            text=_folded(asked["text"]),
            unit=asked["unit"],
            answer=asked["answer"],
            mistakes=tuple(
                Mistake(name, formula, _folded(says)) for name, formula, says in asked["mistakes"]
            ),
            hints=tuple(map(_folded, asked["hints"])),
            working="\n".join(map(str.strip, asked["working"].splitlines())),
            source=asked["source"],
        )
        for asked in found["questions"]
    )
    return Exercise(
        number=found["number"],
        name=file.name.removesuffix(".toml"),
        title=found["title"],
        story=_folded(found["story"]),
        parameters=tuple(
            Parameter(
                name,
                symbol,
                unit,
                meaning,
                _steps(**values) if isinstance(values, dict) else tuple(map(float, values)),
            )
            for name, symbol, unit, meaning, values in found["parameters"]
        ),
        questions=questions,
        formulas=found["formulas"],
        tell=tuple(found.get("tell", ())),
        fits=tuple(found.get("fits", ())),
    )


def _folded(text: str) -> str:
    return " ".join(text.split())


def _steps(**ends: float) -> tuple[float, ...]:
    """Return round numbers from first to last, both included."""
    first, last, step = ends["from"], ends["to"], ends["step"]
    count = round((last - first) / step) + 1
    return tuple(round(float(first + i * step), 9) for i in range(count))


@dataclass(frozen=True)
class Trace:
    """A wrong number, the mistake it tells of, and what to say about it."""

    name: str
    says: str
    number: float


MOST_TENS: Final = 6
"""Powers of ten, either way: from micro to mega."""

_RAISED: Final = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def traces(right: float, unit: str) -> Iterator[Trace]:
    """Yield what the general mistakes make of a right answer in a unit."""
    yield Trace(
        "sign or direction",
        "The size is right, but the sign is not. Which way does it point, and which way counts"
        " as positive here?",
        -right,
    )
    yield Trace("a missing ½", "Twice what it should be. Is a ½ missing?", 2.0 * right)
    half = "Half of what it should be. Is there a ½ too many, or a 2 missing?"
    yield Trace("a ½ too many", half, right / 2)
    if unit == "degrees":
        angle = "radians for degrees"
        says = "That is the angle in radians; degrees are asked for."
        yield Trace(angle, says, radians(right))
        says = "An angle that was in degrees seems to have been turned into degrees once more."
        yield Trace(angle, says, degrees(right))
    for power in range(-MOST_TENS, MOST_TENS + 1):
        if power != 0:
            times = f"{10 ** abs(power):,}".replace(",", " ")
            says = (
                f"The digits are right, but it is 10{str(abs(power)).translate(_RAISED)} = {times}"
                f" times too {'large' if power > 0 else 'small'}."
                " Is it all in SI units: kg for g, m for mm, J for mJ?"
            )
            yield Trace("power of ten", says, right * 10.0**power)
            also = f"{says} And the sign is the other way round."
            yield Trace("power of ten", also, -right * 10.0**power)


LEAST: Final = 1e-9
"""An answer smaller than that in its unit has no digits to judge."""


@dataclass(frozen=True)
class Case:
    """One question for one student: the numbers behind it."""

    question: Question
    numbers: Numbers

    @cached_property
    def right(self) -> float:
        """The right answer."""
        return float(self.numbers.of(self.question.answer))

    @cached_property
    def mistakes(self) -> tuple[Trace, ...]:
        """The question's own mistakes first, then the general ones that it does not replace."""
        numbers = self.numbers
        own = [
            Trace(known.name, numbers.text(known.says), float(numbers.of(known.formula)))
            for known in self.question.mistakes
        ]
        names = {trace.name for trace in own}
        return (*own, *(t for t in traces(self.right, self.question.unit) if t.name not in names))

    @property
    def clear(self) -> bool:
        """Whether the right answer and every mistake can be told from each other."""
        wrong = [trace.number for trace in self.mistakes]
        numbers = [self.right, *wrong]
        if not all(map(isfinite, numbers)) or abs(self.right) < LEAST or 0.0 in wrong:
            return False
        return all(abs(a - b) > TOLERANCE * (abs(a) + abs(b)) for a, b in combinations(numbers, 2))


def plain(student: str) -> str:
    """Return a name without what people do not mean to differ in: case, spaces, Unicode forms.

    >>> plain("  Ada  LOVELACE ")
    'ada lovelace'
    """
    return " ".join(unicodedata.normalize("NFKC", student).casefold().split())


def attempt(exercise: Exercise, student: str, number: int) -> tuple[Case, ...] | None:
    """Return the cases of one draw, or None if it does not fit, or some mistake is not clear."""
    drawn = {}
    for parameter in exercise.parameters:
        key = "\n".join((exercise.name, plain(student), parameter.name, str(number)))
        random = int.from_bytes(sha256(key.encode("utf-8", "replace")).digest()[:8])
        drawn[parameter.name] = parameter.values[random % len(parameter.values)]
    numbers = Numbers(drawn, exercise.formulas)
    cases = tuple(Case(question, numbers) for question in exercise.questions)
    try:
        fits = all(map(numbers.of, exercise.fits)) and all(case.clear for case in cases)
    except ValueError:
        # A mistake may lead out of a function's domain, such as arccos of more than 1.
        return None
    return cases if fits else None


MOST_DRAWS: Final = 1000
"""A lesson whose draws fit less often than that is badly made."""


def draw(exercise: Exercise, student: str) -> tuple[Values, tuple[Case, ...]]:
    """Return a student's parameters and the cases of all questions.

    Raises
    ------
    RuntimeError
        If none of many draws fits: the exercise is wrongly made.
    """
    for number in range(MOST_DRAWS):
        cases = attempt(exercise, student, number)
        if cases is not None:
            told = [*(parameter.name for parameter in exercise.parameters), *exercise.tell]
            return Values({name: cases[0].numbers[name] for name in told}), cases
    raise RuntimeError(f"{exercise.name}: none of {MOST_DRAWS} draws fits")
