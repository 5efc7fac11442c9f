"""Exercises that answer back: a student's own numbers, and replies that name the mistake.

>>> from chutelab.classroom.exercises import lesson
>>> task = lesson("the-bounce", student="any name")
>>> task.check(1, "quickly")
? Question 1: not a number. That is text (“quickly”). Give a number, without quotes.

`lesson` hands out a `Task`, with `question`, `check`, `hint`, `reveal` and `progress`; `data_of` is
an exercise as data for a live page, which judges as this package does. The data hold no answer: the
page draws a student's numbers from the name and computes right and wrong answers from them. The
working is a template without numbers.

- `exercise`: what an exercise is made of: parameters, drawn from a name, questions, known mistakes.
- `judging`: a number read and judged: right, a known mistake, or how far off; replies.
- ``the-parabola.toml`` and so on: the exercises themselves, a file a lesson: what is drawn,
  questions, and each answer and mistake as a formula.

Answers are computed from `chutelab.theory` for the parameters drawn; none is stored.
"""

from __future__ import annotations

import difflib
from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Final

from chutelab.classroom.exercises import judging
from chutelab.classroom.exercises.exercise import (
    GENERAL,
    ROUNDED,
    TOLERANCE,
    Case,
    Exercise,
    Mistake,
    Numbers,
    Parameter,
    Question,
    Values,
    draw,
    normalized,
    read,
    translated,
)
from chutelab.classroom.exercises.judging import (
    Passage,
    Progress,
    Reply,
    Standing,
    Verdict,
    number_of,
    number_with_unit,
)
from chutelab.scene.formulas import tree
from chutelab.util.errors import InputError
from chutelab.util.words import words

__all__ = [
    "EXERCISES", "Exercise", "ExerciseError", "Mistake", "Parameter", "Passage", "Progress",
    "Question", "Reply", "Standing", "Task", "Values", "Verdict", "find", "lesson",
]  # fmt: skip

OPENED: Final[deque[Task]] = deque(maxlen=64)
"""The tasks of this process in the order they were opened; grading reads the answers here."""

UNNAMED: Final = "your name"
"""Placeholder for the student's name in a notebook."""


LONGEST_NAME: Final = 200
"""Most characters of a student's name."""


class Task:
    """One lesson's exercise with a student's own numbers, made by `lesson`.

    None of its methods raises an error for a student's input; they reply in words. It holds no
    right answer: that is computed for a reply, and forgotten.

    Attributes
    ----------
    lesson : str
        Name of the lesson.
    student : str
        The student's name.
    given : Values
        The student's parameters, as attributes.
    language : str
        Language of the task.
    """

    def __init__(self, exercise: Exercise, student: str) -> None:
        self.lesson = exercise.name
        self.student = student
        self.language = exercise.language
        self.given, _ = draw(exercise, student)
        self._standings = [
            Standing(number, asked.title, language=exercise.language)
            for number, asked in enumerate(exercise.questions, 1)
        ]
        OPENED.append(self)

    @property
    def questions(self) -> tuple[Passage, ...]:
        """All questions, with this student's numbers."""
        return tuple(_asked(_case(self, one.number)) for one in self._standings)

    @property
    def answers(self) -> dict[int, float]:
        """The last number that was checked, by question."""
        return {one.number: one.answer for one in self._standings if one.answer is not None}

    @property
    def revealed(self) -> tuple[int, ...]:
        """Questions whose working was shown."""
        return tuple(one.number for one in self._standings if one.revealed)

    def question(self, number: object = None) -> Passage | Reply:
        """Show a question with this student's numbers."""
        found = self._found(number)
        return self._unknown if found is None else _asked(_case(self, found.number))

    def check(self, number: object = None, answer: object = None) -> Reply:
        """Judge an answer.

        Parameters
        ----------
        number : int
            Which question, from 1 on.
        answer : object
            The student's number, or any other object given instead.
        """
        standing = self._found(number)
        if standing is None:
            return self._unknown
        said, n = words(self.language), standing.number
        value = number_of(answer, said)
        if value is None:
            text = f"{said.say('python-blank')} {said.say('python-stuck', number=n)}"
            return Reply(n, Verdict.BLANK, text, language=self.language)
        if isinstance(value, str):
            reply = Reply(n, Verdict.UNREAD, value, language=self.language)
        else:
            standing.answer = value
            reply = judging.judge(_case(self, n), value, _of_others(self, n))
        standing.tries += 1
        standing.verdict = reply.verdict
        return reply

    def hint(self, number: object = None) -> Passage | Reply:
        """Give the next hint to a question; the last one again when there are no more."""
        standing = self._found(number)
        if standing is None:
            return self._unknown
        case = _case(self, standing.number)
        hints = case.question.hints
        standing.hints = min(standing.hints + 1, len(hints))
        n, say = case.number, words(self.language).say
        title = say("hint-title", hint=standing.hints, hints=len(hints), number=n)
        text = case.numbers.text(hints[standing.hints - 1])
        if standing.hints == len(hints):
            text += f"\n{say('hint-last')} {say('python-reveal', number=n)}"
        return Passage(case.number, title, text)

    def reveal(self, number: object = None) -> Passage | Reply:
        """Show the working of a question, with the answer. It is noted that you asked."""
        standing = self._found(number)
        if standing is None:
            return self._unknown
        case = _case(self, standing.number)
        standing.revealed = True
        asked = case.question
        lines = [case.numbers.text(line) for line in asked.working.splitlines()]
        said = words(self.language)
        right = said.say("answer", answer=number_with_unit(case.right, asked.unit, said))
        text = "\n".join([*lines, right, said.say("source", source=asked.source)])
        title = said.say("working-title", number=case.number)
        return Passage(case.number, title, text, asked.unit)

    def progress(self) -> Progress:
        """Draw what is done."""
        rows = tuple(replace(standing) for standing in self._standings)
        return Progress(f"{_exercise(self).title}, {self.student}", rows, self.language)

    def _found(self, number: object) -> Standing | None:
        """Return the student's progress with a question, None if there is no such question."""
        if isinstance(number, str) and number.isdecimal():
            number = float(number)
        wanted = number_of(number)
        return next((one for one in self._standings if one.number == wanted), None)

    @property
    def _unknown(self) -> Reply:
        text = words(self.language).say("python-unknown", count=len(self._standings))
        return Reply(0, Verdict.UNKNOWN, text, language=self.language)

    def _told(self) -> tuple[str, list[tuple[str, str, str]], str]:
        """Return the title, the rows of numbers, and the story."""
        exercise, said = _exercise(self), words(self.language)
        rows = [
            (one.symbol, number_with_unit(self.given[one.name], one.unit, said), one.meaning)
            for one in exercise.parameters
        ]
        story = _case(self, 1).numbers.text(exercise.story)
        if not exercise.whole:
            story = f"{story}\n{said.say('untranslated')}"
        return said.say("lesson-title", number=exercise.number, title=exercise.title), rows, story

    def __repr__(self) -> str:
        title, rows, story = self._told()
        say = words(self.language).say
        left, middle = (max(len(row[i]) for row in rows) for i in (0, 1))
        lines = [f"  {s:<{left}} = {value:<{middle}}  {meaning}" for s, value, meaning in rows]
        head = f"{title}\n{say('numbers-of', student=self.student)}"
        questions = [f"  {one.number} {one.title}" for one in self._standings]
        return "\n".join([head, *lines, judging.filled(story), say("questions"), *questions])

    def _repr_html_(self) -> str:
        title, rows, story = self._told()
        say = words(self.language).say
        head = say("numbers-of-title", title=title, student=self.student)
        cells = [(f"{s} = {value}", meaning) for s, value, meaning in rows]
        return f"{judging.box(head, story)}{judging.table(cells)}"


def _exercise(task: Task) -> Exercise:
    """Return the exercise of a task in its language."""
    return told(task.lesson, task.language)


def _case(task: Task, number: int, given: Values | None = None) -> Case:
    """Return a question with a student's numbers, or with those given, and its computed values."""
    exercise, drawn = _exercise(task), given or task.given
    numbers = Numbers(
        {name: drawn[name] for name in drawn}, exercise.formulas, language=exercise.language
    )
    return Case(number, exercise.questions[number - 1], numbers)


def _of_others(task: Task, number: int) -> Iterator[tuple[str, float]]:
    """Yield the right answers for the other names of this process's tasks, and for no name."""
    given = {normalized(UNNAMED): (UNNAMED, draw(EXERCISES[task.lesson], UNNAMED)[0])}
    for one in list(OPENED):  # another thread may be opening one
        if one.lesson == task.lesson:
            given.setdefault(normalized(one.student), (one.student, one.given))
    given.pop(normalized(task.student), None)
    for name, values in given.values():
        yield name, _case(task, number, values).right


def _asked(case: Case) -> Passage:
    asked = case.question
    said = words(case.numbers.language)
    unit = said.unit(asked.unit) or said.say("pure-number")
    needed = said.say("answer-in", unit=unit, digits=ROUNDED, percent=f"{100 * TOLERANCE:g}")
    title = said.say("question-title", number=case.number, title=asked.title)
    return Passage(case.number, title, f"{case.numbers.text(asked.text)}\n{needed}", asked.unit)


def report() -> list[dict[str, object]]:
    """Return what was done in all tasks of this process, as JSON."""
    return [
        {
            "lesson": task.lesson,
            "student": task.student,
            "answers": {str(number): answer for number, answer in task.answers.items()},
            "revealed": list(task.revealed),
            "tries": {str(one.number): one.tries for one in task._standings if one.tries},
            "hints": {str(one.number): one.hints for one in task._standings if one.hints},
        }
        for task in list(OPENED)  # another thread may be opening one
    ]


_HERE: Final = Path(__file__).parent

EXERCISES: Final[dict[str, Exercise]] = {
    one.name: one
    for one in sorted(
        (read(file) for file in _HERE.glob("*.toml") if "." not in file.stem),
        key=lambda one: one.number,
    )
}
"""All exercises by name, in the order of the lessons."""


@cache
def told(name: str, language: str) -> Exercise:
    """Return an exercise in a language; texts without a translation are in English."""
    english = EXERCISES[name]
    file = _HERE / f"{name}.{language}.toml"
    return english if language == "en" else translated(english, file, language)


class ExerciseError(InputError):
    """There is no exercise of such a lesson."""


def find(name: str | int) -> Exercise:
    """Return an exercise by number or name: 3, "3", "the-bounce" or "03-the-bounce".

    Raises
    ------
    ExerciseError
        If there is none; the message lists them.
    """
    wanted = str(name).strip().casefold().replace("_", "-").replace(" ", "-")
    for exercise in EXERCISES.values():
        number = str(exercise.number)
        names = (exercise.name, number, f"0{number}", f"0{number}-{exercise.name}")
        if wanted in names:
            return exercise
    near = difflib.get_close_matches(wanted, EXERCISES, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    listed = ", ".join(f"{exercise.number} {name}" for name, exercise in EXERCISES.items())
    raise ExerciseError(f"no lesson {str(name)[:40]!r}.{hint} There are: {listed}")


def lesson(name: str | int, student: object = "", language: str = "en") -> Task:
    """Hand out a lesson's exercise with a student's own numbers.

    Parameters
    ----------
    name : str or int
        The lesson, by name or number.
    student : object
        Any name; its text counts. The same name gives the same numbers on every machine; capitals
        and spaces do not matter.
    language : str
        "en", or the language of a translation, such as "de"; texts without a translation are in
        English. The numbers are the same.

    Returns
    -------
    Task
        With `question`, `check`, `hint`, `reveal` and `progress`.

    Raises
    ------
    ExerciseError
        If there is no such lesson, or the name is longer than `LONGEST_NAME`.
    LanguageError
        If there is no such language.

    Examples
    --------
    >>> task = lesson("the-bounce", student="any name")
    >>> task.check(1).verdict
    <Verdict.BLANK: 'not attempted'>
    """
    name_given = str(student).strip() or "anybody"
    if len(name_given) > LONGEST_NAME:
        said = f"a name has at most {LONGEST_NAME} characters; this one has {len(name_given)}"
        raise ExerciseError(said, "student", name_given)
    return Task(told(find(name).name, words(language).language), name_given)


SAID: Final = (
    "answer", "besides", "decimal", "heading", "hint", "hints", "large", "mistake", "numbers",
    "off", "pair", "pure", "question", "reply", "right", "small", "source", "tries",
    "untranslated", "verdict", "working",
)  # fmt: skip
"""Prefixes of the catalogue's keys that pages need (not those of cells, sheets and packages)."""


def data_of(exercise: Exercise, explain: str = "") -> dict[str, Any]:
    """Return an exercise as plain data for JSON, in its language, which is the page's.

    `explain` is the question that students answer in their own words; "" for none.
    """
    said = words(exercise.language)
    return {
        "name": exercise.name,
        "number": exercise.number,
        "title": exercise.title,
        "language": exercise.language,
        "whole": exercise.whole,
        "story": _line(exercise.story),
        "explain": explain,
        "unnamed": UNNAMED,
        "parameters": [
            [one.name, one.symbol, said.unit(one.unit), one.meaning, list(one.values)]
            for one in exercise.parameters
        ],
        "formulas": {name: tree(formula) for name, formula in exercise.formulas.items()},
        "tell": list(exercise.tell),
        "fits": [tree(condition) for condition in exercise.fits],
        "machine": {key: tree(formula) for key, formula in exercise.machine.items()},
        "questions": [_question(asked, exercise.language) for asked in exercise.questions],
        "words": {
            key: text for key, text in said.catalogue.items() if key.partition("-")[0] in SAID
        },
    }


def _question(asked: Question, language: str) -> dict[str, Any]:
    own = {mistake.name for mistake in asked.mistakes}
    known = [key for key, *_ in GENERAL] + ["mistake-ten"]
    if asked.unit == "degrees":
        known.append("mistake-radians")
    return {
        "title": asked.title,
        "text": _line(asked.text),
        "unit": words(language).unit(asked.unit),
        "angle": asked.unit == "degrees",
        "answer": tree(asked.answer),
        "measured": tree(asked.measured) if asked.measured else None,
        "mistakes": [
            [one.called or one.name, tree(one.formula), _line(one.says)] for one in asked.mistakes
        ],
        "general": [key for key in known if words().say(key) not in own],
        "hints": [_line(hint) for hint in asked.hints],
        "working": [_line(line) for line in asked.working.splitlines()],
        "source": asked.source,
    }


def _line(text: str) -> str:
    return " ".join(text.split())
