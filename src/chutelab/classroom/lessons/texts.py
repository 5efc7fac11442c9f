r"""Markdown as HTML, as text for a terminal, as a web page in one file and as a PDF; its formulas.

Formulas stand between dollar signs, in a part of TeX that web pages, notebooks and matplotlib read
themselves: letters and numbers, `SYMBOLS`, ``_`` and ``^``, primes, ``\frac``, ``\sqrt``, ``\dot``,
and ``\,`` for a narrow space.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.util import find_spec
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory
from typing import Final

from markdown_it import MarkdownIt
from markdown_it.tree import SyntaxTreeNode

from chutelab.util.errors import MissingLibraryError
from chutelab.util.versions import own_version

SYMBOLS: Final = {
    "alpha": "α", "varepsilon": "ε", "mu": "µ", "varphi": "φ", "omega": "ω", "pi": "π",
    "rho": "ρ", "sigma": "σ", "Delta": "Δ", "cdot": "·", "le": "≤", "ge": "≥", "approx": "≈",
    "ne": "≠", "to": "→", "infty": "∞", "pm": "±", ",": " ", "sum": "Σ",
}  # fmt: skip
"""The character of each name after a backslash."""

FUNCTIONS: Final = ("sin", "cos", "tan", "arctan", "arccos", "arcsin", "log", "ln")

_ARGUMENTS: Final = {"frac": 2, "sqrt": 1, "dot": 1}
_TOKEN: Final = re.compile(r"\\([A-Za-z]+|.)|(\d+(?:\.\d+)?)|(\s+)|(.)", re.DOTALL)
_POWERS: Final = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass
class Part:
    """A piece of a formula: a text, or a command with arguments; and what is set below and above.

    `name` is "" for a text, "group", or the name of a command.
    """

    name: str
    text: str = ""
    arguments: list[list[Part]] = field(default_factory=list)
    below: list[Part] = field(default_factory=list)
    above: list[Part] = field(default_factory=list)
    primes: int = 0


def parsed(tex: str) -> list[Part]:
    r"""Return the parts of a formula; a brace that is not closed ends with it.

    >>> [(part.name or part.text, len(part.below)) for part in parsed(r"v_{3x} = \sqrt{2}")]
    [('v', 2), (' ', 0), ('=', 0), (' ', 0), ('sqrt', 0)]
    """
    return _row(_TOKEN.finditer(tex))


def _row(tokens: Iterator[re.Match[str]]) -> list[Part]:
    """Read parts to the end, or to a closing brace."""
    row: list[Part] = []
    for token in tokens:
        sign = token[4]
        if sign == "}":
            break
        if sign in ("_", "^") and row:
            inside = _one(tokens)
            if sign == "_":
                row[-1].below = inside
            else:
                row[-1].above = inside
        elif sign == "'" and row:
            row[-1].primes += 1
        else:
            row.append(_part(token, tokens))
    return row


def _one(tokens: Iterator[re.Match[str]]) -> list[Part]:
    """Read one part; a group is the parts in it."""
    for token in tokens:
        if not token[3]:
            part = _part(token, tokens)
            return part.arguments[0] if part.name == "group" else [part]
    return []


def _part(token: re.Match[str], tokens: Iterator[re.Match[str]]) -> Part:
    if token[4] == "{":
        return Part("group", arguments=[_row(tokens)])
    if token[1] is None:
        return Part("", " " if token[3] else token[0])
    count = _ARGUMENTS.get(token[1], 0)
    return Part(token[1], arguments=[_one(tokens) for _ in range(count)])


def as_text(row: list[Part]) -> str:
    r"""Return a formula in plain characters; a name that is not known stays.

    >>> as_text(parsed(r"v_2' = v_0 \sqrt{1 - \varepsilon^2}, \frac{1}{2} v_x \sin^2\varphi"))
    "v2' = v0 √(1 - ε²), ½ v_x sin² φ"
    """
    written = re.sub(r" +", " ", "".join(map(_plain, row)))
    return re.sub(rf"({'|'.join(FUNCTIONS)}) (?=\()", r"\1", written).strip()


def _plain(part: Part) -> str:
    inside = [as_text(argument) for argument in part.arguments]
    match part.name:
        case "":
            said = part.text
        case "group":
            said = inside[0]
        case "frac":
            half = inside == ["1", "2"]
            said = "½" if half else "/".join(map(_grouped, inside))
        case "sqrt":
            said = f"√{_grouped(inside[0])}"
        case "dot":
            said = f"{inside[0]}\N{COMBINING DOT ABOVE}"
        case name:
            said = name if name in FUNCTIONS else SYMBOLS.get(name, f"\\{name}")
    below, above = as_text(part.below), as_text(part.above)
    if below:
        said += below if below[0].isdigit() else f"_{below}"
    said += "'" * part.primes
    if above:
        said += above.translate(_POWERS) if above.isdigit() else f"^{_grouped(above)}"
    return f"{said} " if part.name in FUNCTIONS else said


def _grouped(text: str) -> str:
    return text if re.fullmatch(r"-?[\w.]+'*", text) else f"({text})"


def typeset(row: list[Part]) -> str:
    r"""Return a formula in Typst's language, without the dollar signs around it.

    >>> typeset(parsed(r"\frac{v_0^2}{g R_c} < \varepsilon"))
    'frac(attach(v, b: 0, t: 2), g attach(R, b: c)) \\< ε'
    """
    return " ".join(filter(None, map(_typeset, row)))


def _typeset(part: Part) -> str:
    inside = ", ".join(typeset(argument) or "zws" for argument in part.arguments)
    match part.name:
        case "":
            # In Typst all but letters and digits is markup unless escaped.
            known = {" ": "", "-": "−"}
            said = known.get(part.text, part.text if part.text[0].isalnum() else f"\\{part.text}")
        case "group":
            said = inside
        case "dot":
            said = f"accent({inside}, dot)"
        case ",":
            said = "thin"
        case "frac" | "sqrt" as name:
            said = f"{name}({inside})"
        case name:
            # The micro sign is upright, the letter is not.
            letter = SYMBOLS.get(name, "").replace("\N{MICRO SIGN}", "\N{GREEK SMALL LETTER MU}")
            said = name if name in FUNCTIONS else letter
    below, above = typeset(part.below), "′" * part.primes + typeset(part.above)
    if below or above:
        set_by = [f"{place}: {text}" for place, text in (("b", below), ("t", above)) if text]
        said = f"attach({said or 'zws'}, {', '.join(set_by)})"
    return said


ASSETS: Final = Path(__file__).parent / "assets"
INDEX: Final = "index.html"

_FORMULA: Final = re.compile(
    r"(```.*?```|`[^`]*`)|\$\$(.+?)\$\$|(?<![\\\w$])\$(?![\s$])([^$]+?)(?<![\s\\])\$(?!\w)",
    re.DOTALL,
)


def asset(name: str) -> str:
    """Return the text of a page's or a sheet's template, or of what belongs to it."""
    return (ASSETS / name).read_text(encoding="utf-8")


def parser() -> MarkdownIt:
    """Return a parser of lessons' Markdown, for which raw HTML is text."""
    from mdit_py_plugins.dollarmath import dollarmath_plugin

    made = MarkdownIt("commonmark", {"html": False}).enable("table")
    return made.use(
        dollarmath_plugin,
        allow_space=False,
        renderer=lambda tex, options: mathml(tex, display=options["display_mode"]),
    )


_NAMED: Final = r"(?:<mi>[a-z]{2,}</mi>|<(msu[bp])><mi>[a-z]{2,}</mi>.*?</\1>)"
_BESIDE: Final = re.compile(rf"{_NAMED}(?=<m[isf])|</m(?!o)\w+>(?={_NAMED.replace('1', '2')})")


def mathml(tex: str, *, display: bool = False) -> str:
    r"""Return a formula as MathML; functions such as cos stand apart from what is beside them.

    >>> mathml(r"2 \sin x").count("<mspace")
    2
    """
    from latex2mathml.converter import convert

    made: str = convert(tex.strip(), display="block" if display else "inline")
    return _BESIDE.sub(r'\g<0><mspace width="0.167em" />', made)


def html_of(markdown: str) -> str:
    """Return the HTML of a worksheet, without its title and its pictures, which the page has.

    Raw HTML is shown, not obeyed; formulas are MathML.
    """
    read = parser()
    worksheet = SyntaxTreeNode(read.parse(markdown))
    worksheet.children = [
        part for part in worksheet.children if part.tag != "h1" and not _elsewhere(part)
    ]
    made = str(read.renderer.render(worksheet.to_tokens(), read.options, {}))
    # Wide tables and code scroll by themselves, with the keyboard, too.
    return re.sub("<(pre|table)>", r'<\1 tabindex="0">', made)


def _elsewhere(part: SyntaxTreeNode) -> bool:
    """Tell whether a paragraph is a picture that the page shows elsewhere or leaves out."""
    inside = [one for line in part.children for one in line.children]
    if part.type != "paragraph" or [one.type for one in inside] != ["image"]:
        return False
    name = str(inside[0].attrs["src"])
    return name == "machine.png" or not re.fullmatch(r"[\w-]+\.png", name)


def plain_of(markdown: str) -> str:
    r"""Return a text for a terminal, which shows no pictures, under a title of its own.

    >>> plain_of("# Title\n\n![x](x.gif)\n\nSee [it](it.ipynb), [doi](https://doi.org/1).\n")
    'See it, [doi](https://doi.org/1).\n'
    """
    text = re.sub(r"\A# .*\n+|^!\[[^\]]*\]\([^)]*\)\n+", "", markdown, flags=re.MULTILINE)
    text = re.sub(r"(?<!!)\[([^\]]+)\]\((?!https?:)[^)]*\)", r"\1", text)
    return without_tex(text)


def without_tex(markdown: str) -> str:
    r"""Return a text whose formulas are written with plain characters.

    >>> without_tex(r"It costs $5. $v_2' = v_0 \sqrt{1 - \varepsilon^2}$, `$x`, $\frac{1}{2} v_x$")
    "It costs $5. v2' = v0 √(1 - ε²), `$x`, ½ v_x"
    """

    def written(found: re.Match[str]) -> str:
        code, display, inline = found.groups()
        return str(code) if code else as_text(parsed(display or inline))

    return _FORMULA.sub(written, markdown)


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
    from PIL import Image

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
