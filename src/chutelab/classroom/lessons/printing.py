"""Markdown with its pictures as a web page in one file, and as a PDF on A4, which Typst sets."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from importlib.util import find_spec
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory

from markdown_it.tree import SyntaxTreeNode
from PIL import Image

from chutelab.classroom.lessons.texts import asset, parsed, parser, typeset
from chutelab.util.errors import MissingLibraryError
from chutelab.util.versions import own_version


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


# A web page --------------------------------------------------------------------------------------


def web_page(
    tree: SyntaxTreeNode, folder: Path, asked: Sequence[SyntaxTreeNode] = (), language: str = "en"
) -> str:
    """Return Markdown as a page in one file with its pictures; after `asked` there is room."""
    for node in asked:
        node.attrs["class"] = "answer"
    for node, path in _pictures(folder, tree):
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        node.attrs["src"] = f"data:image/{path.suffix[1:]};base64,{data}"
    read = parser()
    body = str(read.renderer.render(tree.to_tokens(), read.options, {}))
    page = Template(asset("sheet.html"))
    title, version = escape(_title(tree)), escape(own_version())
    return page.substitute(body=body, title=title, language=language, version=version)


# A PDF -------------------------------------------------------------------------------------------


def need_typst() -> None:
    """Raise a `PrintError` if no PDF can be set."""
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

    Pictures lie in a folder; of a film it shows the last one. After `asked` there is room to write.
    With `dense` letters are smaller, and no table is broken over pages.
    """
    need_typst()
    import typst

    with TemporaryDirectory() as made:
        place, found = Path(made), dict(_pictures(folder, tree))
        for node in tree.walk():
            if node.type == "image" and node not in found:
                node.attrs["src"] = ""  # its words stand for it
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
