"""Sheets as files: Markdown, a web page in one file, and a PDF on A4 that Typst sets."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from functools import cache
from html import escape
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory
from typing import Final, cast

from markdown_it.tree import SyntaxTreeNode
from PIL import Image

from chutelab.classroom.lessons.formulas import parsed, typeset
from chutelab.classroom.lessons.reading import Lesson
from chutelab.classroom.lessons.sheets import sheet
from chutelab.classroom.lessons.texts import parser
from chutelab.util.errors import MissingLibraryError
from chutelab.util.versions import own_version

FORMATS: Final = ("md", "html", "pdf")
_ASSETS: Final = Path(__file__).parent / "assets"


class PrintError(MissingLibraryError):
    """A sheet cannot be printed, and what to do about it."""


def printed(lesson: Lesson, which: str, kind: str, language: str = "en") -> bytes:
    """Return one sheet of a lesson as a file of one of `FORMATS`.

    Raises
    ------
    LessonError
        If the lesson has no such sheet.
    PrintError
        If it is to be a PDF, and the extra that sets it is not installed.
    """
    markdown = sheet(lesson, which, language)
    if kind == "md":
        return markdown.encode("utf-8")
    tree = SyntaxTreeNode(parser().parse(markdown))
    title = _words(next(node for node in tree.walk() if node.tag == "h1"))
    lists = _to_be_answered(tree) if which == "student" else []
    if kind == "html":
        return _page(lesson, tree, lists, title, language).encode("utf-8")
    return _pdf(lesson, tree, lists, title, which, language)


def _to_be_answered(tree: SyntaxTreeNode) -> list[SyntaxTreeNode]:
    """Return the numbered lists of the first part: what is predicted has to be written down."""
    heads = [i for i, node in enumerate(tree.children) if node.tag == "h2"]
    first = slice(*heads[:2]) if len(heads) > 1 else slice(0)
    return [node for node in tree.children[first] if node.type == "ordered_list"]


def _words(node: SyntaxTreeNode) -> str:
    return "".join(part.content for part in node.walk() if part.type in ("text", "code_inline"))


def _shown(lesson: Lesson, name: str) -> tuple[str, bytes] | None:
    """Return kind and bytes of a picture of a lesson, None if it has none of that name."""
    kind = Path(name).suffix.removeprefix(".")
    path = lesson.folder / Path(name).name
    known = kind in ("png", "gif") and path.name == name and path.is_file()
    return (kind, path.read_bytes()) if known else None


# A web page --------------------------------------------------------------------------------------


def _page(
    lesson: Lesson, tree: SyntaxTreeNode, lists: list[SyntaxTreeNode], title: str, language: str
) -> str:
    """Return a page that is whole: pictures are in it."""
    for node in lists:
        node.attrs["class"] = "predict"
    for node in tree.walk():
        found = _shown(lesson, str(node.attrs["src"])) if node.type == "image" else None
        if found:
            data = base64.b64encode(found[1]).decode("ascii")
            node.attrs["src"] = f"data:image/{found[0]};base64,{data}"
    read = parser()
    body = str(read.renderer.render(tree.to_tokens(), read.options, {}))
    page = Template((_ASSETS / "sheet.html").read_text(encoding="utf-8"))
    return page.substitute(
        body=body, title=escape(title), language=language, version=escape(own_version())
    )


# A PDF -------------------------------------------------------------------------------------------


def _pdf(
    lesson: Lesson,
    tree: SyntaxTreeNode,
    lists: list[SyntaxTreeNode],
    title: str,
    which: str,
    language: str,
) -> bytes:
    if find_spec("typst") is None:
        raise PrintError(
            'a sheet as PDF needs what is not installed: pip install "chutelab[pdf]"; a web page'
            " needs nothing: --format html"
        )
    import typst

    with TemporaryDirectory() as folder:
        for node in tree.walk():
            found = _shown(lesson, str(node.attrs["src"])) if node.type == "image" else None
            if found:
                with Image.open(BytesIO(found[1])) as picture:
                    # Of a film its end, when all has happened.
                    picture.seek(getattr(picture, "n_frames", 1) - 1)
                    picture.convert("RGB").save(Path(folder) / f"{node.attrs['src']}.png")
        said = {"title": title, "kind": KINDS[which], "language": language}
        options = ", ".join(f"{name}: {_text(text)}" for name, text in said.items())
        body = "".join(_Setter(Path(folder), lists).blocks(tree.children))
        source = Path(folder) / "sheet.typ"
        look = (_ASSETS / "sheet.typ").read_text(encoding="utf-8")
        source.write_text(f"{look}\n#show: sheet.with({options})\n{body}", encoding="utf-8")
        made = typst.compile(str(source), format="pdf", font_paths=_fonts(), timestamp=0)
    return cast(bytes, made)
