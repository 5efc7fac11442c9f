"""What an exercise is made of: parameters, questions, and the mistakes that are known.

An exercise is a file ``NAME.toml`` beside this module, without any code: what is drawn, formulas,
and four questions, each with its right answer and a row for each known mistake: name, formula,
reply. A formula is a Python expression of the parameters, of other formulas and of `FUNCTIONS`.
Texts are templates: ``{name}`` stands for a number, and a line break for a space. ``NAME.de.toml``
has the texts in German, and nothing else: each takes the place of the English one.

Every question has a few general mistakes: a sign, a power of ten, radians, ½. A student's
parameters are drawn from the name, the same on every machine, and redrawn until all mistakes can be
told apart.
"""

from __future__ import annotations

import math
import re
import tomllib
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from hashlib import sha256
from itertools import combinations
from math import degrees, isclose, isfinite, radians
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

from chutelab.scene.formulas import compiled
from chutelab.theory import transfer
from chutelab.util.words import words

DIGITS: Final = 4
"""Significant digits of numbers in texts; their rounding is far below any tolerance here."""

TOLERANCE: Final = 0.01
"""Relative difference within which an answer counts as right."""

ROUNDED: Final = 3
"""Significant digits asked for in answers: rounding to them takes at most half the tolerance."""


class Values:
    """A student's numbers by name, read as attributes; SI units unless an exercise says otherwise.

    They cannot be changed.

    Examples
    --------
    >>> given = Values({"v0": 2.0, "h": 0.5})
    >>> given.v0, given
    (2.0, v0 = 2, h = 0.5)
    """

    def __init__(self, numbers: Mapping[str, float]) -> None:
        vars(self).update({name: float(number) for name, number in numbers.items()})

    def __getattr__(self, name: str) -> float:
        # Python calls this for names that are not among the numbers.
        raise AttributeError(f"no number {name!r} here; there are {', '.join(self)}")

    def __setattr__(self, name: str, value: object = None) -> None:
        raise AttributeError("these numbers are given; keep your own in variables of your own")

    __delattr__ = __setattr__

    def __getitem__(self, name: str) -> float:
        return float(vars(self)[name])

    def __iter__(self) -> Iterator[str]:
        return iter(vars(self))

    def __repr__(self) -> str:
        return ", ".join(f"{name} = {shown(self[name])}" for name in self)


def shown(number: float) -> str:
    """Return a number as texts show it.

    >>> shown(2.0), shown(0.0123456), shown(2.5e-07)
    ('2', '0.01235', '2.5e-7')
    """
    mantissa, _, power = f"{number:.{DIGITS}g}".partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa


_OF_MATH: Final = (
    "acos", "asin", "atan", "atan2", "cos", "degrees", "hypot", "inf", "log", "log10", "radians",
    "sin", "sqrt",
)  # fmt: skip
GRAVITY: Final = 9.81
"""m/s²."""

FUNCTIONS: Final[dict[str, Any]] = {
    "__builtins__": {},
    **{one.__name__: one for one in (abs, dict, round)},
    **{name: getattr(math, name) for name in _OF_MATH},
}
"""Names in formulas, besides the exercise's own, g and `chutelab.theory.transfer`."""


class Numbers(dict[str, Any]):
    """The parameters of one draw and all that follows from them, by name.

    A formula is computed when its number is first asked for; g is `gravity`, m/s². Texts have
    their numbers as `language` writes them.
    """

    def __init__(
        self,
        drawn: Mapping[str, float],
        formulas: Mapping[str, str],
        gravity: float = GRAVITY,
        language: str = "en",
    ) -> None:
        super().__init__(drawn)
        self.language = language
        self.drawn = tuple(drawn)
        self.formulas = formulas

        def carried(**arguments: Any) -> SimpleNamespace:
            """Return what `chutelab.theory.transfer` finds, as numbers and lists of numbers."""
            found = vars(transfer(**arguments, gravity=gravity))
            return SimpleNamespace(**{name: array.tolist() for name, array in found.items()})

        self.known = {**FUNCTIONS, "g": gravity, "transfer": carried}

    def __missing__(self, name: str) -> Any:
        # After a KeyError `eval` looks in FUNCTIONS.
        self[name] = value = self.of(self.formulas[name])
        return value

    def of(self, formula: str) -> Any:
        """Return the value of a formula."""
        return eval(compiled(formula), self.known, self)

    def text(self, template: str) -> str:
        """Return a template on one line, with every ``{name}`` replaced by its number."""
        line = " ".join(template.split())
        local = words(self.language).local
        return re.sub(r"\{(\w+)\}", lambda match: local(shown(self[match[1]])), line)


@dataclass(frozen=True)
class Parameter:
    """One number that is drawn for a student from round `values`.

    Templates and formulas call it by its name; the student's table has symbol, unit and meaning.
    """

    name: str
    symbol: str
    unit: str
    meaning: str
    values: Sequence[float]


@dataclass(frozen=True)
class Mistake:
    """A mistake that is recognised by the number it leads to.

    The reply is a template: it says what seems to have happened, never the right number.
    """

    name: str  # a few words in English; a general mistake of this name is left out
    formula: str  # formula of the wrong answer
    says: str
    called: str = ""  # its name in the learner's language; "": `name`


@dataclass(frozen=True)
class Question:
    """One question with one number for an answer. All texts are templates."""

    title: str
    text: str
    unit: str  # of the answer; "" for a pure number, "degrees" for an angle
    answer: str  # formula of the right number
    mistakes: Sequence[Mistake]  # of this question; the general ones are added
    hints: Sequence[str]  # each says more than the one before
    working: str  # the way to the answer, line by line
    source: str  # equation or law behind it
    # The answer as a formula of quantities of a run of `Exercise.machine`, by their names: of
    # ``separation``, ``impact`` and ``landing``, and of ``ledger.by_surface``.
    measured: str = ""


@dataclass(frozen=True)
class Exercise:
    """The exercise of one lesson."""

    number: int  # of the lesson
    name: str  # such as the-bounce
    title: str
    story: str  # text common to all questions, a template
    parameters: Sequence[Parameter]
    questions: Sequence[Question]
    formulas: Mapping[str, str]  # further formulas for texts and other formulas
    tell: Sequence[str] = ()  # formulas whose numbers the student sees, too
    fits: Sequence[str] = ()  # conditions that a draw must fulfil for the lesson
    # Keys of the lesson's scene, and their formulas: a machine with the student's numbers in it.
    # If a question has `measured`, the lesson's page takes the right answer from that machine.
    machine: Mapping[str, str] = field(default_factory=dict)
    language: str = "en"  # of the texts
    whole: bool = True  # whether all texts are in that language


def read(file: Path) -> Exercise:
    """Read the exercise in a TOML file."""
    found = tomllib.loads(file.read_text(encoding="utf-8"))
    for asked in found["questions"]:
        asked["mistakes"] = [Mistake(*row) for row in asked["mistakes"]]
    found["questions"] = [Question(**asked) for asked in found["questions"]]
    for row in found["parameters"]:
        if isinstance(row[-1], dict):
            # The round numbers of a range, its ends included.
            first, last, step = (row[-1][key] for key in ("from", "to", "step"))
            row[-1] = [round(first + i * step, 9) for i in range(round((last - first) / step) + 1)]
    found["parameters"] = [Parameter(*row) for row in found["parameters"]]
    return Exercise(name=file.stem, **found)


def translated(exercise: Exercise, file: Path, language: str) -> Exercise:
    """Return an exercise with the texts of a TOML file; other texts stay as they are."""
    found = tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    whole = True

    def texts(there: Any, english: Any, *names: str) -> Any:
        """Lay a table of texts over an object."""
        nonlocal whole
        kept = {name: there[name] for name in names if name in there}
        whole = whole and len(kept) == len(names)
        return replace(english, **kept)

    questions = []
    for i, asked in enumerate(exercise.questions):
        there = dict(enumerate(found.get("questions", ()))).get(i, {})
        mistakes = [
            texts(dict(zip(("called", "says"), row, strict=False)), known, "called", "says")
            for known in asked.mistakes
            for row in [there.get("mistakes", {}).get(known.name, ())]
        ]
        question = texts(there, asked, "title", "text", "hints", "working", "source")
        questions.append(replace(question, mistakes=mistakes))
    meanings = found.get("parameters", {})
    parameters = [
        texts({"meaning": meanings[one.name]} if one.name in meanings else {}, one, "meaning")
        for one in exercise.parameters
    ]
    new: Exercise = texts(found, exercise, "title", "story")
    return replace(new, questions=questions, parameters=parameters, language=language, whole=whole)


@dataclass(frozen=True)
class Trace:
    """A wrong number, the mistake that leads to it, and the reply."""

    name: str  # in English
    called: str  # in the learner's language
    says: str
    number: float


GENERAL: Final = (
    ("mistake-sign", "reply-sign", -1.0),
    ("mistake-half-missing", "reply-half-missing", 2.0),
    ("mistake-half-too-many", "reply-half-too-many", 0.5),
)
"""General mistakes of any question, besides powers of ten: keys of name and reply, and the wrong
answer if the right one is 1."""

OF_ANGLES: Final = (
    ("mistake-radians", "reply-radians", radians(1.0)),
    ("mistake-radians", "reply-degrees", degrees(1.0)),
)
"""General mistakes of answers in degrees."""

BESIDES: Final = (
    ("mistake-sign", "besides-sign", -1.0),
    ("mistake-ten", "besides-large", 1e3),
    ("mistake-ten", "besides-small", 1e-3),
)
"""Common second mistakes, combined with one of the question's own."""

MOST_TENS: Final = 6
"""Most powers of ten up or down: from micro to mega."""

_RAISED: Final = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@cache
def _general(language: str, *, angle: bool) -> tuple[Trace, ...]:
    """Return the general mistakes of any question, and those of angles, in a language."""
    said = words(language)

    def trace(name: str, says: str, number: float) -> Trace:
        return Trace(words().say(name), said.say(name), says, number)

    found = [trace(name, said.say(says), factor) for name, says, factor in GENERAL]
    for power in range(1, MOST_TENS + 1):
        raised, times = str(power).translate(_RAISED), f"{10**power:,}".replace(",", " ")
        for way, factor in (("large", 10.0**power), ("small", 10.0**-power)):
            # An angle has no kg or g.
            key = "reply-ten-angle" if angle else "reply-ten"
            says = said.say(key, power=raised, times=times, way=said.say(way))
            found.append(trace("mistake-ten", says, factor))
            found.append(trace("mistake-ten", f"{says} {said.say('reply-ten-sign')}", -factor))
    if angle:
        found += [trace(name, said.say(says), factor) for name, says, factor in OF_ANGLES]
    return tuple(found)


LEAST: Final = 1e-9
"""Smallest right answer, in its unit; a smaller one would not show enough digits to judge."""


@dataclass(frozen=True)
class Case:
    """One question for one student: its number (from 1), and the student's values."""

    number: int
    question: Question
    numbers: Numbers

    @cached_property
    def right(self) -> float:
        """The right answer."""
        return float(self.numbers.of(self.question.answer))

    @cached_property
    def mistakes(self) -> tuple[Trace, ...]:
        """The question's own mistakes first, then the general ones that it does not replace."""
        value, text, language = self.numbers.of, self.numbers.text, self.numbers.language
        own = [
            Trace(one.name, one.called or one.name, text(one.says), float(value(one.formula)))
            for one in self.question.mistakes
        ]
        replaced = {trace.name for trace in own}
        more = _general(language, angle=self.question.unit == "degrees")
        kept = [trace for trace in more if trace.name not in replaced]
        return (*own, *(replace(trace, number=self.right * trace.number) for trace in kept))

    @property
    def pairs(self) -> Iterator[Trace]:
        """A mistake of the question's own, and one of `BESIDES` on top of it."""
        own = {known.name for known in self.question.mistakes}
        english, say = words().say, words(self.numbers.language).say
        of_angle = "-angle" if self.question.unit == "degrees" else ""
        for first in self.mistakes[: len(own)]:
            for key, besides, factor in BESIDES:
                if english(key) not in own:
                    says = besides + of_angle if key == "mistake-ten" else besides
                    name = english("pair", first=first.name, second=english(key))
                    called = say("pair", first=first.called, second=say(key))
                    yield Trace(name, called, f"{first.says} {say(says)}", factor * first.number)

    @cached_property
    def feels_gravity(self) -> bool:
        """Whether the right answer depends on g."""
        given = {name: self.numbers[name] for name in self.numbers.drawn}
        other = Numbers(given, self.numbers.formulas, 1.001 * GRAVITY)
        return not isclose(float(other.of(self.question.answer)), self.right, rel_tol=1e-9)

    @property
    def clear(self) -> bool:
        """Whether the right answer and all mistakes can be told apart."""
        wrong = [trace.number for trace in self.mistakes]
        numbers = [self.right, *wrong]
        if not all(map(isfinite, numbers)) or abs(self.right) < LEAST or 0.0 in wrong:
            return False
        return all(abs(a - b) > TOLERANCE * (abs(a) + abs(b)) for a, b in combinations(numbers, 2))


def normalized(student: str) -> str:
    """Return a name in lower case, with single spaces and in one Unicode form, first name first.

    >>> normalized("  Ada  LOVELACE "), normalized("Berg, Mia")
    ('ada lovelace', 'mia berg')
    """
    last, comma, first = unicodedata.normalize("NFKC", student).casefold().partition(",")
    # Learning platforms write "Berg, Mia".
    turned = comma and last.strip() and first.strip() and "," not in first
    return " ".join((f"{first} {last}" if turned else last + comma + first).split())


def attempt(exercise: Exercise, student: str, number: int) -> tuple[Case, ...] | None:
    """Return the cases of one draw; None if it breaks a condition or a mistake is not clear."""
    drawn = {}
    for parameter in exercise.parameters:
        key = "\n".join((exercise.name, normalized(student), parameter.name, str(number)))
        random = int.from_bytes(sha256(key.encode("utf-8", "replace")).digest()[:8])
        drawn[parameter.name] = float(parameter.values[random % len(parameter.values)])
    numbers = Numbers(drawn, exercise.formulas, language=exercise.language)
    cases = tuple(Case(n, asked, numbers) for n, asked in enumerate(exercise.questions, start=1))
    try:
        fits = all(map(numbers.of, exercise.fits)) and all(case.clear for case in cases)
    except (ValueError, ArithmeticError):
        # A mistake may lead out of a function's domain, such as arccos of more than 1 or 1 / 0.
        return None
    return cases if fits else None


MOST_DRAWS: Final = 1000
"""Most draws for a student; if none fits, the exercise is badly made."""


def draw(exercise: Exercise, student: str) -> tuple[Values, tuple[Case, ...]]:
    """Return a student's parameters and the cases of all questions.

    Raises a `RuntimeError` if none of `MOST_DRAWS` draws fits: the exercise is badly made.
    """
    for number in range(MOST_DRAWS):
        cases = attempt(exercise, student, number)
        if cases is not None:
            told = [*(parameter.name for parameter in exercise.parameters), *exercise.tell]
            return Values({name: cases[0].numbers[name] for name in told}), cases
    raise RuntimeError(f"{exercise.name}: none of {MOST_DRAWS} draws fits")
