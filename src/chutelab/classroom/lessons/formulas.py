r"""Formulas of lessons: the part of TeX that they may use, in plain characters and for print.

Web pages, notebooks and matplotlib read TeX themselves. The part: letters and numbers, `SYMBOLS`,
``_`` and ``^``, primes, ``\frac``, ``\sqrt``, ``\dot``, and ``\,`` for a narrow space.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

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


def plain(row: list[Part]) -> str:
    r"""Return a formula in plain characters; a name that is not known stays.

    >>> plain(parsed(r"v_2' = v_0 \sqrt{1 - \varepsilon^2}, \frac{1}{2} v_x \sin^2\varphi"))
    "v2' = v0 √(1 - ε²), ½ v_x sin² φ"
    """
    written = re.sub(r" +", " ", "".join(map(_plain, row)))
    return re.sub(rf"({'|'.join(FUNCTIONS)}) (?=\()", r"\1", written).strip()


def _plain(part: Part) -> str:
    inside = [plain(argument) for argument in part.arguments]
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
    below, above = plain(part.below), plain(part.above)
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
            # All but letters and digits means something there, unless it is escaped.
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
