r"""A lesson's Markdown as HTML and as text for a terminal, and its formulas.

Formulas stand between dollar signs, in a part of TeX that web pages, notebooks and matplotlib read
themselves: letters and numbers, `SYMBOLS`, ``_`` and ``^``, primes, ``\frac``, ``\sqrt``, ``\dot``,
and ``\,`` for a narrow space.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from markdown_it import MarkdownIt
from markdown_it.tree import SyntaxTreeNode

SYMBOLS: Final = {
    "alpha": "α", "varepsilon": "ε", "mu": "µ", "varphi": "φ", "omega": "ω", "pi": "π",
    "rho": "ρ", "sigma": "σ", "theta": "θ", "delta": "δ", "Delta": "Δ", "cdot": "·", "le": "≤",
    "ge": "≥", "approx": "≈", "ne": "≠", "to": "→", "infty": "∞", "pm": "±", ",": " ", "sum": "Σ",
}  # fmt: skip
"""The character of each name after a backslash."""

FUNCTIONS: Final = ("sin", "cos", "tan", "arctan", "arccos", "arcsin", "log", "ln")

_ARGUMENTS: Final = {"frac": 2, "sqrt": 1, "dot": 1}
_TOKEN: Final = re.compile(r"\\([A-Za-z]+|.)|(\d+(?:\.\d+)?)|(\s+)|(.)", re.DOTALL)
_POWERS: Final = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass
class Part:
    """A piece of a formula: a text, or a command with arguments; with its sub- and superscript.

    `name` is "" for a text, "group", or the name of a command.
    """

    name: str
    text: str = ""
    arguments: list[list[Part]] = field(default_factory=list)
    below: list[Part] = field(default_factory=list)
    above: list[Part] = field(default_factory=list)
    primes: int = 0


def parsed(tex: str) -> list[Part]:
    r"""Return the parts of a formula; an open brace is closed at its end.

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
    """Return the text of a template of a page or sheet, or of a file that belongs to it."""
    return (ASSETS / name).read_text(encoding="utf-8")


def parser() -> MarkdownIt:
    """Return a parser of lessons' Markdown that treats raw HTML as text."""
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

    Raw HTML is shown as text; formulas are MathML.
    """
    read = parser()
    worksheet = SyntaxTreeNode(read.parse(markdown))

    def elsewhere(part: SyntaxTreeNode) -> bool:
        """Whether a paragraph is a picture that the page shows elsewhere or leaves out."""
        inside = [one for line in part.children for one in line.children]
        if part.type != "paragraph" or [one.type for one in inside] != ["image"]:
            return False
        name = str(inside[0].attrs["src"])
        return name == "machine.png" or not re.fullmatch(r"[\w-]+\.png", name)

    worksheet.children = [
        part for part in worksheet.children if part.tag != "h1" and not elsewhere(part)
    ]
    made = str(read.renderer.render(worksheet.to_tokens(), read.options, {}))
    # Wide tables and code scroll by themselves, with the keyboard, too.
    return re.sub("<(pre|table)>", r'<\1 tabindex="0">', made)


def plain_of(markdown: str) -> str:
    r"""Return a text for a terminal, without pictures and without its title.

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
