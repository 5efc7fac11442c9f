"""Three sheets from one source: the student's, the teacher's, and the explanation.

The source is the worksheet, `README.md`, with its four parts, the table ``[teacher]`` of
``lesson.toml``, and the exercise. The student's sheet has no picture and nothing of what is under
"Explain": whoever predicts has not seen what comes out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises.catalogue import UNNAMED
from chutelab.classroom.exercises.exercise import draw, shown
from chutelab.classroom.lessons.building import plain_of
from chutelab.classroom.lessons.reading import Lesson, unusable

SHEETS: Final = ("student", "teacher", "explanation")
PARTS: Final = ("Predict", "Run", "Compare", "Explain")

_SAID: Final = re.compile(r"^\*For the teacher\.\* *(.*?)(?:\n\n|\Z)", re.MULTILINE | re.DOTALL)


def sheet(lesson: Lesson, which: str) -> str:
    """Return one of `SHEETS` of a lesson, as Markdown.

    Raises
    ------
    LessonError
        If the lesson has no worksheet with the parts "Predict", "Run", "Compare" and "Explain".
    """
    found = lesson.worksheet.read_text(encoding="utf-8") if lesson.worksheet.is_file() else ""
    said = " ".join(" ".join(_SAID.findall(found)).split())
    opening, *pieces = re.split(r"^## (.*)\n+", plain_of(_SAID.sub("", found)), flags=re.MULTILINE)
    parts = dict(zip(pieces[::2], pieces[1::2], strict=True))
    if missing := [name for name in PARTS if name not in parts]:
        text = f"a sheet needs the parts ## {', ## '.join(missing)} of the worksheet"
        raise unusable(lesson.worksheet, text)
    number = "" if lesson.number is None else f"Lesson {lesson.number}. "
    head = f"# {number}{lesson.title}"
    match which:
        case "student":
            body = [f"## {name}\n\n{parts[name].strip()}" for name in PARTS[:3]]
            if lesson.name in EXERCISES:
                own = "The notebook `exercise.ipynb` asks four questions with numbers of your own."
                body.append(f"## Your own numbers\n\n{own}")
            lines = [head, "Name: ____________________  Date: ____________", opening.strip(), *body]
        case "explanation":
            lines = [f"{head}: explanation", "*To be opened afterwards.*", parts["Explain"].strip()]
        case _:
            lines = [f"{head}: for the teacher", *_for_the_teacher(lesson, said)]
    return "\n\n".join(lines) + "\n"


def _for_the_teacher(lesson: Lesson, said: str) -> Iterator[str]:
    yield f"{lesson.question}\n\nLevel: {lesson.level}. Time as taught: {lesson.minutes} minutes."
    teacher = lesson.teacher
    if teacher is not None:
        yield "## Goals\n\n" + "\n".join(f"- {goal}" for goal in teacher.goals)
    if said:
        yield f"## What to say\n\n{said}"
    if teacher is not None:
        key = "\n".join(f"{n}. {answer}" for n, answer in enumerate(teacher.predictions, 1))
        yield f"## Key to the predictions\n\n{key}"
    yield from _of_exercise(lesson)
    if teacher is not None:
        yield f"## Shorter and longer\n\n- Basic: {teacher.basic}\n- Stretch: {teacher.stretch}"
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
