"""Three sheets, and what they are printed as: Markdown, a web page in one file, a PDF on A4.

The student's is the worksheet, `README.md`, with a line for the name; it says nothing of what comes
out. The explanation is `explanation.md`. The teacher's is made of the table ``[teacher]`` of
``lesson.toml`` and of the exercise. All three are in the lesson's language.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Iterator
from html import escape
from importlib.util import find_spec
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory
from typing import Final

from markdown_it.tree import SyntaxTreeNode
from PIL import Image

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises.catalogue import UNNAMED, told
from chutelab.classroom.exercises.exercise import draw
from chutelab.classroom.exercises.judging import with_unit
from chutelab.classroom.lessons.reading import PARTS, Lesson, Teacher, unusable
from chutelab.classroom.lessons.texts import asset, parsed, parser, typeset
from chutelab.classroom.words import Words, words
from chutelab.util.errors import MissingLibraryError
from chutelab.util.versions import own_version

SHEETS: Final = ("student", "teacher", "explanation")


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
            # A worksheet that is not translated has the English headings.
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
            made = f"{head}\n\n{_for_the_teacher(lesson)}\n"
    if lesson.untranslated:
        title, _, rest = made.partition("\n")
        made = f"{title}\n\n*{say('untranslated')}*\n{rest}"
    return made


def _for_the_teacher(lesson: Lesson) -> str:
    """Return the sections of the teacher's sheet; those without a text are left out."""
    said = words(lesson.language)
    say, teacher = said.say, lesson.teacher or Teacher()
    lengths = (("sheet-basic", teacher.basic), ("sheet-stretch", teacher.stretch))
    sections = {
        "sheet-goals": "\n".join(f"- {goal}" for goal in teacher.goals),
        "sheet-say": teacher.say,
        "sheet-predictions": "\n".join(
            f"{n}. {answer}" for n, answer in enumerate(teacher.predictions, 1)
        ),
        **_of_exercise(lesson, said),
        "sheet-lengths": "\n".join(f"- {say(key)}: {text}" for key, text in lengths if text),
        "sheet-curriculum": teacher.curriculum
        if isinstance(teacher.curriculum, str)
        else "\n".join(f"- {one}" for one in teacher.curriculum),
    }
    level = say("sheet-level", level=say(f"level-{lesson.level}"), minutes=lesson.minutes)
    parts = (f"## {say(key)}\n\n{text}" for key, text in sections.items() if text)
    return "\n\n".join([f"{lesson.question}\n\n{level}", *parts])


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
        answer = say("answer", answer=with_unit(case.right, asked.unit, said))
        lines.append(f"{case.number}. *{asked.title}*: {way}. {answer}.")
        rows += [
            f"| {case.number} | {known.called or known.name} | {text(known.says)} |"
            for known in asked.mistakes
        ]
    numbers = "; ".join(
        f"{one.symbol} = {with_unit(given[one.name], one.unit, said)}"
        for one in exercise.parameters
    )
    shipped = say("sheet-shipped", name=UNNAMED, numbers=numbers)
    return {
        "sheet-key": "\n".join([f"{shipped}\n", *lines]),
        "sheet-mistakes": "\n".join([f"{say('sheet-besides')}\n", *rows]),
    }


FORMATS: Final = ("md", "html", "pdf")


class PrintError(MissingLibraryError):
    """A sheet cannot be printed, and what to do about it."""


def printed(lesson: Lesson, which: str, kind: str) -> bytes:
    """Return one of the `SHEETS` of a lesson as a file of one of `FORMATS`, in its language.

    Raises
    ------
    LessonError
        If the lesson has no such sheet.
    PrintError
        If it is to be a PDF, and the extra that sets it is not installed.
    """
    markdown = sheet(lesson, which)
    if kind == "md":
        return markdown.encode("utf-8")
    tree = SyntaxTreeNode(parser().parse(markdown))
    asked = _to_be_answered(tree) if which == "student" else []
    if kind == "html":
        return _page(lesson, tree, asked).encode("utf-8")
    return _pdf(lesson, tree, asked, words(lesson.language).say(f"sheet-kind-{which}"))


def _to_be_answered(tree: SyntaxTreeNode) -> list[SyntaxTreeNode]:
    """Return what is to be answered in writing.

    That is the items of the first part, the predictions, and a paragraph that asks at the end of
    the third, the comparison.
    """
    heads = [i for i, node in enumerate(tree.children) if node.tag == "h2"]
    heads.append(len(tree.children))
    first, third = (tree.children[slice(*heads[i : i + 2])] for i in (0, 2))
    lists = [node for node in first if node.type == "ordered_list"]
    asks = third[-1].type == "paragraph" and third[-1].children[0].content.endswith("?")
    return [item for node in lists for item in node.children] + third[-1:] * asks


def _title(tree: SyntaxTreeNode) -> str:
    heads = [node for node in tree.children if node.tag == "h1"]
    return "".join(node.content for one in heads[:1] for node in one.walk() if node.type == "text")


def _pictures(lesson: Lesson, tree: SyntaxTreeNode) -> Iterator[tuple[SyntaxTreeNode, Path]]:
    """Yield the pictures of a text that lie beside it, each with its file."""
    for node in tree.walk():
        if node.type == "image":
            path = lesson.folder / str(node.attrs["src"])
            if path.suffix in (".png", ".gif") and path in lesson.folder.iterdir():
                yield node, path


# A web page --------------------------------------------------------------------------------------


def _page(lesson: Lesson, tree: SyntaxTreeNode, asked: list[SyntaxTreeNode]) -> str:
    """Return a page in one file, pictures included."""
    for node in asked:
        node.attrs["class"] = "answer"
    for node, path in _pictures(lesson, tree):
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        node.attrs["src"] = f"data:image/{path.suffix[1:]};base64,{data}"
    read = parser()
    body = str(read.renderer.render(tree.to_tokens(), read.options, {}))
    page = Template(asset("sheet.html"))
    title, version = escape(_title(tree)), escape(own_version())
    return page.substitute(body=body, title=title, language=lesson.language, version=version)


# A PDF -------------------------------------------------------------------------------------------


def _pdf(lesson: Lesson, tree: SyntaxTreeNode, asked: list[SyntaxTreeNode], kind: str) -> bytes:
    if find_spec("typst") is None:
        raise PrintError(
            'a sheet as PDF needs what is not installed: pip install "chutelab[pdf]"; a web page'
            " needs nothing: --format html"
        )
    import typst

    with TemporaryDirectory() as made:
        folder = Path(made)
        found = dict(_pictures(lesson, tree))
        for node in tree.walk():
            if node.type == "image" and node not in found:
                node.attrs["src"] = ""  # its words stand for it
        for node, path in found.items():
            with Image.open(path) as picture:
                # Of a film its last picture.
                picture.seek(getattr(picture, "n_frames", 1) - 1)
                picture.convert("RGB").save(folder / f"{path.stem}.png")
            node.attrs["src"] = f"{path.stem}.png"
        look = asset("sheet.typ")
        said = {"title": _title(tree), "kind": kind, "language": lesson.language}
        options = ", ".join(f"{name}: {_text(text)}" for name, text in said.items())
        body = _blocks(tree.children, asked)
        source = folder / "sheet.typ"
        source.write_text(f"{look}\n#show: sheet.with({options})\n{body}", encoding="utf-8")
        # With Typst's own fonts and no date, the file is the same everywhere.
        return typst.compile(source, format="pdf", ignore_system_fonts=True)


def _text(text: str) -> str:
    """Return a text as a Typst string, without markup."""
    kept = "".join(sign for sign in text if sign.isprintable() or sign == "\n")
    escaped = kept.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def _blocks(nodes: Iterable[SyntaxTreeNode], asked: list[SyntaxTreeNode]) -> str:
    """Return blocks of Markdown as Typst has them, with room to write after those of `asked`."""
    made = []
    for node in nodes:
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
                made.append(_table(node))
            case "hr":
                made.append("#line(length: 100%)")
            case "blockquote":
                made.append(f"#quote(block: true)[{_blocks(node.children, asked)}]")
            case _:
                made.append(f"{_inline(node)}{'#room' * (node in asked)}")
    return "\n\n".join(made)


def _table(table: SyntaxTreeNode) -> str:
    """Return a table; columns with cells to be filled in share the free width."""
    rows = [
        [_inline(cell) for cell in row.children] for part in table.children for row in part.children
    ]
    blank = [not all(cells) for cells in zip(*rows[1:], strict=True)]
    columns = ", ".join("1fr" if one else "auto" for one in blank)
    head, *body = ("".join(f"[{cell or '#blank'}]" for cell in row) for row in rows)
    made = f"#table(columns: ({columns},), table.header{head}){''.join(body)}"
    # A table that is filled in by hand stays on one page.
    return f"#block(breakable: false)[{made}]" if any(blank) else made


def _inline(node: SyntaxTreeNode) -> str:
    """Return what is within a block as Typst has it."""
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
