"""Three sheets: the student's, the teacher's, and the explanation.

The student's is the worksheet, `README.md`, with a line for the name; it says nothing of what comes
out. The explanation is `explanation.md`. The teacher's comes of the table ``[teacher]`` of
``lesson.toml`` and of the exercise.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises.catalogue import UNNAMED
from chutelab.classroom.exercises.exercise import draw, shown
from chutelab.classroom.lessons.reading import Lesson, Teacher, unusable

SHEETS: Final = ("student", "teacher", "explanation")
PARTS: Final = ("Predict", "Run", "Compare")


def sheet(lesson: Lesson, which: str) -> str:
    """Return one of `SHEETS` of a lesson, as Markdown.

    Raises
    ------
    LessonError
        If the lesson's worksheet has not the parts "Predict", "Run" and "Compare", or if it has no
        explanation.
    """
    match which:
        case "student":
            text = lesson.text("README")
            heads = re.findall(r"^## (.*)$", text, flags=re.MULTILINE)
            if missing := [name for name in PARTS if name not in heads]:
                said = f"a sheet needs the parts ## {', ## '.join(missing)} of the worksheet"
                raise unusable(lesson.folder / "README.md", said)
            title, _, rest = text.partition("\n")
            return f"{title}\n\nName: ____________________  Date: ____________\n{rest}"
        case "explanation":
            if found := lesson.text("explanation"):
                return found
            raise unusable(lesson.folder / "explanation.md", "is not there, or empty")
        case _:
            number = "" if lesson.number is None else f"Lesson {lesson.number}. "
            head = f"# {number}{lesson.title}: for the teacher"
            return "\n\n".join([head, *_for_the_teacher(lesson)]) + "\n"


def _for_the_teacher(lesson: Lesson) -> Iterator[str]:
    yield f"{lesson.question}\n\nLevel: {lesson.level}. Time as taught: {lesson.minutes} minutes."
    teacher = lesson.teacher or Teacher()
    if teacher.goals:
        yield "## Goals\n\n" + "\n".join(f"- {goal}" for goal in teacher.goals)
    if teacher.say:
        yield f"## What to say\n\n{teacher.say}"
    if teacher.predictions:
        key = "\n".join(f"{n}. {answer}" for n, answer in enumerate(teacher.predictions, 1))
        yield f"## Key to the predictions\n\n{key}"
    yield from _of_exercise(lesson)
    lengths = (("Basic", teacher.basic), ("Stretch", teacher.stretch))
    if said := [f"- {name}: {text}" for name, text in lengths if text]:
        yield "## Shorter and longer\n\n" + "\n".join(said)
    if teacher.curriculum:
        yield f"## Where it sits\n\n{teacher.curriculum}"


def _of_exercise(lesson: Lesson) -> Iterator[str]:
    """Yield the key to the exercise, and the mistakes that its replies name."""
    exercise = EXERCISES.get(lesson.name)
    if exercise is None:
        return
    given, cases = draw(exercise, UNNAMED)
    lines = []
    for case in cases:
        asked = case.question
        way = "; ".join(case.numbers.text(line) for line in asked.working.strip().splitlines())
        answer = f"{shown(case.right)} {asked.unit}".strip()
        lines.append(f"{case.number}. *{asked.title}*: {way}. Answer: {answer}.")
    yield (
        "## Key to the exercise\n\nEach name has its own numbers; `chutelab lesson grade` knows"
        f" them all. As shipped, for “{UNNAMED}”: {given}.\n\n" + "\n".join(lines)
    )
    rows = [
        f"| {case.number} | {known.name} | {case.numbers.text(known.says)} |"
        for case in cases
        for known in case.question.mistakes
    ]
    head = "| question | mistake, as the reply names it | what the reply says |\n|---|---|---|\n"
    yield (
        "## Mistakes to expect\n\nBesides these, the replies name a wrong sign, a power of ten, a ½"
        " too many or too few, two of them at once, and the right answer for somebody else's"
        " numbers.\n\n" + head + "\n".join(rows)
    )
