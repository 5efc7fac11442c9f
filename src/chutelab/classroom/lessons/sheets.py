"""Three sheets, and what they are printed as: Markdown, a web page in one file, a PDF on A4.

All are made of the lesson's steps: the student's asks, the explanation has what is said when steps
are done, the teacher's has plan, key, goals and mistakes, with the table ``[teacher]`` and the
exercise. They are in the lesson's language.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable, Iterator
from typing import Final

from markdown_it.tree import SyntaxTreeNode

from chutelab.classroom.exercises import EXERCISES, UNNAMED, told
from chutelab.classroom.exercises.exercise import draw
from chutelab.classroom.exercises.judging import number_with_unit
from chutelab.classroom.lessons import Lesson, Page, Teacher, machine_of, picture_of
from chutelab.classroom.lessons.steps import PLACES, Ask, Step
from chutelab.classroom.lessons.texts import parser, pdf, web_page
from chutelab.scene import shipped
from chutelab.scene.overrides import parts_of, unit_of, value_at
from chutelab.util.words import Words, words

SHEETS: Final = ("student", "teacher", "explanation")


def sheet(lesson: Lesson, which: str) -> str:
    """Return one of `SHEETS` of a lesson, as Markdown.

    The student's sheet asks, and has no number of the answer on it.
    """
    say, title = words(lesson.language).say, titled(lesson)
    film = f"![{lesson.picture.film or lesson.title}]({picture_of(lesson, 'lesson.gif')})"
    match which:
        case "student":
            parts = [say("sheet-name"), worksheet(lesson)]
        case "explanation":
            parts = [film, *(step.then for step in lesson.steps)]
        case _:
            title = say("sheet-teacher", title=title)
            parts = [_for_the_teacher(lesson)]
    if lesson.untranslated:
        parts.insert(0, f"*{say('untranslated')}*")
    return "\n\n".join([f"# {title}", *(part.strip() for part in parts if part)]) + "\n"


def titled(lesson: Lesson) -> str:
    """Return what stands above a lesson's sheets and its notebook."""
    number, title = lesson.number, lesson.title
    say = words(lesson.language).say
    return title if number is None else say("sheet-title", number=number, title=title)


def worksheet(lesson: Lesson) -> str:
    """Return the steps of a lesson as Markdown, and in an appendix the commands for its tables."""
    said = words(lesson.language)
    shown = f"![{lesson.picture.machine or lesson.title}]({picture_of(lesson, 'machine.png')})"
    parts = [f"**{lesson.question}**", shown, said.say("sheet-page")]
    for n, step in enumerate(lesson.steps, 1):
        parts += [f"## {n}. {said.say(f'step-{step.kind}')}", *asked(lesson, step)]
    commands = "\n".join(dict.fromkeys(_commands(lesson)))
    appendix = f"```sh\n{commands}\n```" if commands else ""
    if appendix and not all(name in shipped() for name in lesson.scenes):
        model = lesson.name if lesson.number is None else lesson.number
        copy = f"chutelab lesson new my-copy --from {model}"
        appendix = f"{said.say('sheet-copy', command=copy)}\n\n{appendix}"
    if appendix or lesson.terminal:
        parts += [f"## {said.say('sheet-terminal')}", appendix, lesson.terminal]
    return "\n\n".join(part.strip() for part in parts if part)


def asked(lesson: Lesson, step: Step) -> Iterator[str]:
    """Yield the parts of what a step asks, as Markdown: its text, its questions, its table."""
    said = words(lesson.language)
    yield with_values(lesson, step, step.text)
    for n, ask in enumerate(step.asks, 1):
        how = "mark" if ask.mark else "sketch" if ask.sketch else ""
        hint = f" *{said.say(f'sheet-{how}')}*" if how else ""
        choices = "".join(f"\n   - ☐ {one}" for one in ask.choices)
        yield f"{n}. {with_values(lesson, step, ask.text)}{hint}{choices}"
    if step.columns:
        yield table(step, said)
    if step.kind == "numbers" and lesson.name in EXERCISES:
        questions = told(lesson.name, lesson.language).questions
        rows = "".join(
            f"\n| {n}. {one.title}, {said.unit(one.unit)} | |".replace(",  |", " |")
            for n, one in enumerate(questions, 1)
        )
        yield said.say("sheet-numbers")
        yield f"| {said.say('sheet-question')} | {said.say('sheet-answer')} |\n|---|---|{rows}"


def values_of(lesson: Lesson, step: Step) -> Callable[[str], str]:
    """Return what says the value that a key has in a step's machine, with its unit."""
    scene, said = machine_of(lesson, step), words(lesson.language)
    return lambda key: number_with_unit(value_at(scene, key), unit_of(parts_of(key)), said)


def with_values(lesson: Lesson, step: Step, text: str) -> str:
    """Return a text of a step in which the machine's values stand where a page has fields."""
    value = values_of(lesson, step)
    return PLACES.sub(lambda found: value(found[1]), text).strip()


def table(step: Step, said: Words) -> str:
    """Return the table of a step as Markdown, with empty cells for what is to be found."""
    heads = (f"{one.head}, {said.unit(one.unit)}" if one.unit else one.head for one in step.columns)
    lines = [[said.say("sheet-run"), *heads], ["---"] * (1 + len(step.columns))]
    for n, row in enumerate(step.rows):
        given = (said.local(str(one.given[n])) if one.given else "" for one in step.columns)
        lines.append([said.local(row.head), *given])
    lines += [[""] * len(lines[0])] * step.free
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _commands(lesson: Lesson) -> Iterator[str]:
    """Yield the commands that make the runs of the tables."""
    page = lesson.page or Page()
    scene = page.scene or lesson.scenes[0]
    for step in lesson.steps:
        for row in step.rows:
            changed = {**step.set, **row.set}.items()
            texts = ((k, v if isinstance(v, str) else json.dumps(v)) for k, v in changed)
            keys = [*page.set, *(f"{key}={text}" for key, text in texts)]
            # The last one of a key counts.
            kept = {one.partition("=")[0]: one for one in keys}.values()
            sets = "".join(f" --set {shlex.quote(one)}" for one in kept if "title" not in one)
            if any(column.value for column in step.columns):
                yield f"chutelab run {scene}{sets}"


def _for_the_teacher(lesson: Lesson) -> str:
    """Return the sections of the teacher's sheet; those without a text are left out."""
    said = words(lesson.language)
    say, teacher = said.say, lesson.teacher or Teacher()
    lengths = (("sheet-basic", teacher.basic), ("sheet-stretch", teacher.stretch))
    plan = "".join(
        f"\n| {n} | {say(f'step-{step.kind}')} | {step.minutes} | {_first(lesson, step)} |"
        for n, step in enumerate(lesson.steps, 1)
    )
    beliefs = "".join(f"\n| {idea} | {question} |" for idea, question in teacher.misconceptions)
    answers = [
        f"- {n}.{m} {with_values(lesson, step, ask.text)} **{_answer(ask)}**"
        for n, step in enumerate(lesson.steps, 1)
        for m, ask in enumerate(step.asks, 1)
        if _answer(ask)
    ]
    sections = {
        "sheet-goals": "\n".join(f"- {goal}" for goal in teacher.goals),
        "sheet-plan": f"| {say('sheet-plan-columns')} |\n|---|---|---|---|{plan}",
        "sheet-say": teacher.say,
        "sheet-misconceptions": beliefs
        and f"| {say('sheet-misconceptions-columns')} |\n|---|---|{beliefs}",
        "sheet-predictions": "\n".join(answers),
        **_of_exercise(lesson, said),
        "sheet-lengths": "\n".join(f"- {say(key)}: {text}" for key, text in lengths if text),
        "sheet-curriculum": "\n".join(f"- {one}" for one in teacher.curriculum),
    }
    level = say("sheet-level", level=say(f"level-{lesson.level}"), minutes=lesson.minutes)
    parts = (f"## {say(key)}\n\n{text}" for key, text in sections.items() if text)
    return "\n\n".join([f"{lesson.question}\n\n{level}", *parts])


def _first(lesson: Lesson, step: Step) -> str:
    """Return the first sentence of what a step says, for the plan."""
    asks = " ".join(ask.text for ask in step.asks)
    text = step.text or asks or words(lesson.language).say("sheet-numbers")
    said = with_values(lesson, step, text)
    return re.split(r"(?<=[.?!:]) ", " ".join(said.split()))[0]


def _answer(ask: Ask) -> str:
    """Return the key to a question."""
    chosen = ask.choices[ask.right - 1] if ask.choices and ask.right else ""
    return f"{chosen}. {ask.answer}".strip() if chosen else ask.answer


def _of_exercise(lesson: Lesson, said: Words) -> dict[str, str]:
    """Return the key to the exercise, and the mistakes that its replies name, as sections."""
    if lesson.name not in EXERCISES:
        return {}
    exercise, say = told(lesson.name, lesson.language), said.say
    given, cases = draw(exercise, UNNAMED)
    lines, rows = [], [f"| {say('sheet-columns')} |", "|---|---|---|"]
    for case in cases:
        asked, text = case.question, case.numbers.text
        way = "; ".join(map(text, asked.working.strip().splitlines()))
        answer = say("answer", answer=number_with_unit(case.right, asked.unit, said))
        lines.append(f"{case.number}. *{asked.title}*: {way}. {answer}.")
        rows += [
            f"| {case.number} | {known.called or known.name} | {text(known.says)} |"
            for known in asked.mistakes
        ]
    numbers = "; ".join(
        f"{one.symbol} = {number_with_unit(given[one.name], one.unit, said)}"
        for one in exercise.parameters
    )
    shipped = say("sheet-shipped", name=UNNAMED, numbers=numbers)
    return {
        "sheet-key": "\n".join([f"{shipped}\n", *lines]),
        "sheet-mistakes": "\n".join([f"{say('sheet-besides')}\n", *rows]),
    }


FORMATS: Final = ("md", "html", "pdf")


def printed(lesson: Lesson, which: str, kind: str) -> bytes:
    """Return one of the `SHEETS` of a lesson as a file of one of `FORMATS`, in its language.

    Raises a `LessonError` if the lesson has no such sheet; a `PrintError` if it is to be a PDF, and
    the extra that sets it is not installed.
    """
    markdown = sheet(lesson, which)
    if kind == "md":
        return markdown.encode("utf-8")
    tree = SyntaxTreeNode(parser().parse(markdown))
    # In writing: numbered questions without choices.
    asked = [
        item
        for node in tree.children
        if which == "student" and node.type == "ordered_list"
        for item in node.children
        if not any(part.type == "bullet_list" for part in item.children)
    ]
    if kind == "html":
        return web_page(tree, lesson.folder, asked, lesson.language).encode("utf-8")
    said = words(lesson.language).say(f"sheet-kind-{which}")
    return pdf(tree, lesson.folder, asked, kind=said, language=lesson.language)
