"""Three sheets: the student's, the teacher's, and the explanation.

The student's is the worksheet, `README.md`, with a line for the name; it says nothing of what comes
out. The explanation is `explanation.md`. The teacher's comes of the table ``[teacher]`` of
``lesson.toml`` and of the exercise. All three are in the lesson's language.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises.catalogue import UNNAMED, told
from chutelab.classroom.exercises.exercise import draw
from chutelab.classroom.exercises.judging import with_unit
from chutelab.classroom.lessons.reading import Lesson, Teacher, unusable
from chutelab.classroom.words import Words, words

SHEETS: Final = ("student", "teacher", "explanation")
PARTS: Final = ("part-predict", "part-run", "part-compare")
"""What a worksheet has, by the keys of their headings."""


def sheet(lesson: Lesson, which: str) -> str:
    """Return one of `SHEETS` of a lesson, as Markdown.

    Raises
    ------
    LessonError
        If the lesson's worksheet has not the parts "Predict", "Run" and "Compare", or if it has no
        explanation.
    """
    say = words(lesson.language).say
    match which:
        case "student":
            text = lesson.text("README")
            heads = re.findall(r"^## (.*)$", text, flags=re.MULTILINE)
            # A worksheet that is not translated has the English ones.
            for language in dict.fromkeys((lesson.language, "en")):
                parts = [words(language).say(key) for key in PARTS]
                if not (missing := [name for name in parts if name not in heads]):
                    break
            else:
                said = f"a sheet needs the parts ## {', ## '.join(missing)} of the worksheet"
                raise unusable(lesson.folder / "README.md", said)
            title, _, rest = text.partition("\n")
            made = f"{title}\n\n{say('sheet-name')}\n{rest}"
        case "explanation":
            made = lesson.text("explanation")
            if not made:
                raise unusable(lesson.folder / "explanation.md", "is not there, or empty")
        case _:
            title = lesson.title
            if lesson.number is not None:
                title = say("sheet-title", number=lesson.number, title=title)
            head = f"# {say('sheet-teacher', title=title)}"
            made = "\n\n".join([head, *_for_the_teacher(lesson)]) + "\n"
    if lesson.untranslated:
        title, _, rest = made.partition("\n")
        made = f"{title}\n\n*{say('untranslated')}*\n{rest}"
    return made


def _for_the_teacher(lesson: Lesson) -> Iterator[str]:
    said = words(lesson.language)
    say = said.say
    level = say("sheet-level", level=say(f"level-{lesson.level}"), minutes=lesson.minutes)
    yield f"{lesson.question}\n\n{level}"
    teacher = lesson.teacher or Teacher()
    if teacher.goals:
        yield f"## {say('sheet-goals')}\n\n" + "\n".join(f"- {goal}" for goal in teacher.goals)
    if teacher.say:
        yield f"## {say('sheet-say')}\n\n{teacher.say}"
    if teacher.predictions:
        key = "\n".join(f"{n}. {answer}" for n, answer in enumerate(teacher.predictions, 1))
        yield f"## {say('sheet-predictions')}\n\n{key}"
    yield from _of_exercise(lesson, said)
    lengths = (("sheet-basic", teacher.basic), ("sheet-stretch", teacher.stretch))
    if lines := [f"- {say(key)}: {text}" for key, text in lengths if text]:
        yield f"## {say('sheet-lengths')}\n\n" + "\n".join(lines)
    if teacher.curriculum:
        yield f"## {say('sheet-curriculum')}\n\n{teacher.curriculum}"


def _of_exercise(lesson: Lesson, said: Words) -> Iterator[str]:
    """Yield the key to the exercise, and the mistakes that its replies name."""
    if lesson.name not in EXERCISES:
        return
    exercise, say = told(lesson.name, lesson.language), said.say
    given, cases = draw(exercise, UNNAMED)
    lines = []
    for case in cases:
        asked = case.question
        way = "; ".join(case.numbers.text(line) for line in asked.working.strip().splitlines())
        answer = say("answer", answer=with_unit(case.right, asked.unit, said))
        lines.append(f"{case.number}. *{asked.title}*: {way}. {answer}.")
    numbers = "; ".join(
        f"{one.symbol} = {with_unit(given[one.name], one.unit, said)}"
        for one in exercise.parameters
    )
    shipped = say("sheet-shipped", name=UNNAMED, numbers=numbers)
    yield f"## {say('sheet-key')}\n\n{shipped}\n\n" + "\n".join(lines)
    rows = [
        f"| {case.number} | {known.called or known.name} | {case.numbers.text(known.says)} |"
        for case in cases
        for known in case.question.mistakes
    ]
    head = f"| {say('sheet-columns')} |\n|---|---|---|\n"
    yield f"## {say('sheet-mistakes')}\n\n{say('sheet-besides')}\n\n{head}" + "\n".join(rows)
