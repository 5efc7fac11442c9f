"""The three sheets of a lesson as Markdown, as a web page in one file, and as a PDF on A4.

All are made from the lesson's steps: the student's sheet has the questions, the explanation the
texts after each step, the teacher's sheet plan, answers, goals and mistakes, from the table
``[teacher]`` and the exercise. They are in the lesson's language.
"""

from __future__ import annotations

import base64
import json
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from html import escape
from importlib.util import find_spec
from itertools import zip_longest
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory
from typing import Final

from markdown_it.tree import SyntaxTreeNode
from PIL import Image

from chutelab.classroom.exercises import EXERCISES, UNNAMED, told
from chutelab.classroom.exercises.exercise import draw
from chutelab.classroom.exercises.judging import number_with_unit
from chutelab.classroom.lessons import Lesson, Page, Teacher, machine_of, picture_of
from chutelab.classroom.lessons.steps import PLACES, Ask, Step
from chutelab.classroom.lessons.texts import asset, parsed, parser, typeset
from chutelab.scene import shipped
from chutelab.scene.overrides import parts_of, unit_of, value_at
from chutelab.util.errors import MissingLibraryError
from chutelab.util.files import own_version
from chutelab.util.words import Words, words

SHEETS: Final = ("student", "teacher", "explanation")


def sheet(lesson: Lesson, which: str) -> str:
    """Return one of `SHEETS` of a lesson, as Markdown.

    The student's sheet has the questions, and no number of the answers.
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
    """Return the heading of a lesson's sheets and its notebook."""
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
    """Yield the parts of a step as Markdown: its text, its questions, its table."""
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
    """Return a function that gives a key's value in a step's machine, with its unit."""
    scene, said = machine_of(lesson, step), words(lesson.language)
    return lambda key: number_with_unit(value_at(scene, key), unit_of(parts_of(key)), said)


def with_values(lesson: Lesson, step: Step, text: str) -> str:
    """Return a text of a step with the machine's values in place of the page's fields."""
    value = values_of(lesson, step)
    return PLACES.sub(lambda found: value(found[1]), text).strip()


def table(step: Step, said: Words) -> str:
    """Return the table of a step as Markdown, with empty cells for results."""
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
    plan = ""
    for n, step in enumerate(lesson.steps, 1):
        text = step.text or " ".join(ask.text for ask in step.asks) or say("sheet-numbers")
        # The first sentence of its text.
        first, *_ = re.split(r"(?<=[.?!:])\s+", with_values(lesson, step, text), maxsplit=1)
        about = " ".join(first.split())
        plan += f"\n| {n} | {say(f'step-{step.kind}')} | {step.minutes} | {about} |"
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


def _answer(ask: Ask) -> str:
    """Return the answer to a question."""
    chosen = ask.choices[ask.right - 1] if ask.choices and ask.right else ""
    return f"{chosen}. {ask.answer}".strip() if chosen else ask.answer


def _of_exercise(lesson: Lesson, said: Words) -> dict[str, str]:
    """Return the answers to the exercise, and the mistakes that its replies name, as sections."""
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

    Raises a `LessonError` if the lesson has no such sheet; a `PrintError` if a PDF is asked for and
    the extra for it is not installed.
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


class PrintError(MissingLibraryError):
    """A sheet cannot be printed, and what to do about it."""


def _title(tree: SyntaxTreeNode) -> str:
    heads = [node for node in tree.children if node.tag == "h1"]
    return "".join(node.content for one in heads[:1] for node in one.walk() if node.type == "text")


def _pictures(folder: Path, tree: SyntaxTreeNode) -> Iterator[tuple[SyntaxTreeNode, Path]]:
    """Yield the pictures of a text that lie beside it, each with its file."""
    for node in tree.walk():
        if node.type == "image":
            path = folder / str(node.attrs["src"])
            if path.suffix in (".png", ".gif") and path in folder.iterdir():
                yield node, path


def web_page(
    tree: SyntaxTreeNode,
    folder: Path,
    asked: Sequence[SyntaxTreeNode] = (),
    language: str = "en",
    *,
    dense: bool = False,
) -> str:
    """Return Markdown as a page in one file with its pictures; `asked` and `dense` as in `pdf`."""
    for node in asked:
        node.attrs["class"] = "answer"
    for node, path in _pictures(folder, tree):
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        node.attrs["src"] = f"data:image/{path.suffix[1:]};base64,{data}"
    read = parser()
    body = str(read.renderer.render(tree.to_tokens(), read.options, {}))
    page = Template(asset("sheet.html"))
    title, version = escape(_title(tree)), escape(own_version())
    look = ' class="dense"' if dense else ""
    return page.substitute(body=body, title=title, language=language, version=version, look=look)


def need_typst() -> None:
    """Raise a `PrintError` if no PDF can be made."""
    if find_spec("typst") is None:
        raise PrintError(
            'a sheet as PDF needs what is not installed: pip install "chutelab[pdf]"; a web page'
            " needs nothing: --format html"
        )


def pdf(
    tree: SyntaxTreeNode,
    folder: Path,
    asked: Sequence[SyntaxTreeNode] = (),
    *,
    kind: str,
    language: str = "en",
    dense: bool = False,
) -> bytes:
    """Return Markdown as a PDF on A4; a `PrintError` says what to install.

    Pictures are in a folder; a film is shown by its last picture. After `asked` there is room to
    write. With `dense` letters are smaller, and no table is split over pages.
    """
    need_typst()
    import typst

    with TemporaryDirectory() as made:
        place, found = Path(made), dict(_pictures(folder, tree))
        for node in tree.walk():
            if node.type == "image" and node not in found:
                node.attrs["src"] = ""  # show its words instead
        for node, path in found.items():
            with Image.open(path) as picture:
                # Of a film its last picture.
                picture.seek(getattr(picture, "n_frames", 1) - 1)
                picture.convert("RGB").save(place / f"{path.stem}.png")
            node.attrs["src"] = f"{path.stem}.png"
        look = asset("sheet.typ")
        said = {"title": _title(tree), "kind": kind, "language": language}
        options = ", ".join(f"{name}: {_text(text)}" for name, text in said.items())
        options += f", dense: {str(dense).lower()}"
        body = _blocks(tree.children, asked)
        if dense and not asked:
            look += "\n#let blank = []\n"
        source = place / "sheet.typ"
        source.write_text(f"{look}\n#show: sheet.with({options})\n{body}", encoding="utf-8")
        # With Typst's own fonts and no date, the file is the same everywhere.
        return typst.compile(source, format="pdf", ignore_system_fonts=True)


def _text(text: str) -> str:
    """Return a text as a Typst string, without markup."""
    kept = "".join(sign for sign in text if sign.isprintable() or sign == "\n")
    escaped = kept.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def _blocks(nodes: Iterable[SyntaxTreeNode], asked: Sequence[SyntaxTreeNode]) -> str:
    """Return blocks of Markdown in Typst's language, with room to write after those in `asked`.

    What introduces a table or commands stays on their page.
    """
    made = []
    for node, after in zip_longest(nodes := list(nodes), nodes[1:]):
        match node.type:
            case "heading":
                made.append(f"#heading(level: {node.tag[1]})[{_inline(node)}]")
            case "bullet_list" | "ordered_list":
                items = "".join(
                    f"[{_blocks(item.children, asked)}{'#room' * (item in asked)}]"
                    for item in node.children
                )
                name = "list" if node.type == "bullet_list" else "enum"
                made.append(f"#{name}{items}")
            case "fence" | "code_block":
                made.append(f"#raw({_text(node.content.rstrip())}, block: true)")
            case "math_block":
                made.append(f"$ {typeset(parsed(node.content))} $")
            case "table":
                rows = [[_inline(cell) for cell in row.children]
                        for part in node.children for row in part.children]  # fmt: skip
                blank = [not all(cells) for cells in zip(*rows[1:], strict=True)]
                # Columns with cells to be filled in share the free width.
                columns = ", ".join("1fr" if one else "auto" for one in blank)
                head, *body = ("".join(f"[{cell or '#blank'}]" for cell in row) for row in rows)
                table = f"#table(columns: ({columns},), table.header{head}){''.join(body)}"
                # A table that is filled in by hand stays on one page.
                made.append(f"#block(breakable: false)[{table}]" if any(blank) else table)
            case "hr":
                made.append("#line(length: 100%)")
            case "blockquote":
                made.append(f"#quote(block: true)[{_blocks(node.children, asked)}]")
            case _:
                text = f"{_inline(node)}{'#room' * (node in asked)}"
                leads = after is not None and after.type in ("table", "fence", "code_block")
                made.append(f"#block(spacing: 1em, sticky: true)[{text}]" if leads else text)
    return "\n\n".join(made)


def _inline(node: SyntaxTreeNode) -> str:
    """Return the text of a block in Typst's language."""
    inside = "".join(_inline(child) for child in node.children)
    match node.type:
        case "text":
            return f"#{_text(node.content)};"
        case "softbreak":
            return " "
        case "hardbreak":
            return "#linebreak()"
        case "strong" | "em":
            return f"#{'strong' if node.type == 'strong' else 'emph'}[{inside}]"
        case "code_inline":
            return f"#raw({_text(node.content)})"
        case "math_inline":
            return f"${typeset(parsed(node.content))}$"
        case "link" if str(node.attrs["href"]).startswith("https://"):
            return f"#link({_text(str(node.attrs['href']))})[{inside}]"
        case "image" if node.attrs["src"]:
            name = str(node.attrs["src"])
            return f"#align(center, image({_text(name)}, width: 78%, alt: {_text(node.content)}))"
        case _:
            return inside
