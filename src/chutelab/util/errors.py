"""Invalid input, its faults and suggestions; libraries that are missing or too old."""

from __future__ import annotations

import difflib
import json
import os
import re
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Final


def did_you_mean(word: str, known: Iterable[str], otherwise: str, *, most: int = 1) -> str:
    """Suggest up to `most` names similar to a word; say something else if there are none.

    >>> did_you_mean("hod", ["hood", "floor"], "there are hood, floor")
    'did you mean hood?'
    >>> did_you_mean("x", ["hood", "floor"], "there are hood, floor")
    'there are hood, floor'
    """
    near = difflib.get_close_matches(word, list(known), n=most)
    return f"did you mean {' or '.join(near)}?" if near else otherwise


def nearest(key: str, known: Iterable[str]) -> list[str]:
    """Return the most similar known key in a list; an empty list if none is similar.

    >>> nearest("pivot", ["pivot_height", "above"])
    ['pivot_height']
    """
    known = list(known)
    # Compare keys with and without their unit: angel is angle_deg.
    names = {name.removesuffix("_deg"): name for name in known} | {name: name for name in known}
    near = difflib.get_close_matches(key, names, n=1, cutoff=0.55)
    return [names[name] for name in near]


_VALUE_WIDTH: Final = 48
"""Longest value shown in a message, characters: one line of a terminal holds key and value."""

_KEY_WIDTH: Final = 80
_TEXT_WIDTH: Final = 400
_LISTED: Final = 40
"""Most faults spelled out in one message; `InputError.faults` always holds all of them."""

_DECIMAL_COMMA: Final = re.compile(r"(?:^|=\s*)([-+]?\d+),(\d+)\s*\S*$")


def about_comma(text: str) -> str:
    """Return what to add to a message if a text ends with a decimal comma, else "".

    >>> about_comma("speed=2,5 m/s")
    '; write 2.5, with a decimal point'
    """
    comma = _DECIMAL_COMMA.search(text)
    return f"; write {comma[1]}.{comma[2]}, with a decimal point" if comma else ""


class _Missing:
    def __repr__(self) -> str:
        return "missing"

    def __reduce__(self) -> str:
        return "MISSING"


MISSING: Final = _Missing()
"""The value of a fault if its key is missing."""


@dataclass(frozen=True)
class Fault:
    """One fault of an input.

    Parameters
    ----------
    key
        Full path of the key, such as ``plate.angle_deg`` or ``surface[1].restitution``; an option
        as it was typed; a place in the text (``line 3, column 5``) for a syntax error; empty if the
        whole file is at fault.
    value
        The value found; `MISSING` if a required key is missing; None if there is nothing to show
        (TOML has no null).
    allowed
        What would be right, in words.
    """

    key: str
    value: object
    allowed: str

    def __str__(self) -> str:
        allowed = cut(self.allowed, _TEXT_WIDTH)
        if not self.key:
            return allowed
        key = cut(self.key, _KEY_WIDTH)
        if self.value is MISSING:
            return f"{key} is missing: {allowed}"
        if self.value is None:
            return f"{key}: {allowed}"
        comma = about_comma(self.value) if isinstance(self.value, str) else ""
        return f"{key} = {shown(self.value)}: {allowed}{comma}"


class InputError(ValueError):
    """Invalid input; the text lists every fault.

    The command line ends with it, and exit code 2.

    Parameters
    ----------
    allowed, key, value
        The fault, see `Fault`.
    file
        The file, or a placeholder such as ``<scene>``; "" for none.

    Attributes
    ----------
    faults : list of Fault
        At least one; `key`, `value` and `allowed` are those of the first.
    hint : str
        What to do next, if there is something better than correcting each fault.
    """

    def __init__(self, allowed: str, key: str = "", value: object = None, file: str = "") -> None:
        super().__init__(allowed, key, value, file)
        self.file = file
        self.faults = [Fault(key, value, allowed)]
        self.hint = ""

    @property
    def key(self) -> str:
        """Full path of the key that is at fault, or the option as it was typed."""
        return self.faults[0].key

    @property
    def value(self) -> object:
        """The value found."""
        return self.faults[0].value

    @property
    def allowed(self) -> str:
        """What would be right, in words."""
        return self.faults[0].allowed

    def __str__(self) -> str:
        place = f"{cut(printable(self.file), 200)}: " if self.file else ""
        if len(self.faults) == 1:
            text = f"{place}{self.faults[0]}"
        else:
            lines = [f"{place}{len(self.faults)} faults"]
            lines += [f"  {fault}" for fault in self.faults[:_LISTED]]
            if len(self.faults) > _LISTED:
                lines.append(f"  and {len(self.faults) - _LISTED} more")
            text = "\n".join(lines)
        return f"{text}\n{self.hint}" if self.hint else text


class LawWarning(UserWarning):
    """A run broke a law that every run must keep, see `Recording.laws`: do not trust its numbers.

    ``warnings.simplefilter("error", chutelab.LawWarning)`` makes it an error.
    """


class MissingLibraryError(ImportError):
    """A library is not installed, or too old; the text says what to install."""


def library(module: str, what: str, extra: str) -> Any:
    """Return a module of a package that only one of Chutelab's extras installs.

    Raises a `MissingLibraryError` without it, or if it is too old; says `what`, such as "a fit
    needs SciPy", and what to install.
    """
    install = f'pip install "chutelab[{extra}]"'
    if old := too_old(extra):
        raise MissingLibraryError(f"{what}, {'; '.join(old)}: {install}")
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingLibraryError(f"{what}: {install}", name=error.name) from error


_BOUND = re.compile(
    r"^Requires-Dist: ([\w.-]+)[^>;\n]*>=([\d.]+)(?:.*extra == .([\w-]+))?", re.MULTILINE
)


def installed() -> dict[str, tuple[str, str]]:
    """Return version and folder of metadata of each installed package, by its name.

    Names are in small letters, with hyphens. As `importlib.metadata` finds them, but only by the
    names of the folders: a tenth of the time.
    """
    found = {}
    for place in reversed(sys.path):
        with suppress(OSError):
            for folder in os.listdir(place or "."):  # noqa: PTH208
                if folder.endswith("-info") and folder.count("-") > 1:
                    package, version = folder.removesuffix(".dist-info").split("-")[:2]
                    found[_plain(package)] = (
                        version.removesuffix(".egg"),
                        f"{place or '.'}/{folder}",
                    )
    return found


def _plain(package: str) -> str:
    return package.replace("_", "-").replace(".", "-").lower()


def too_old(extra: str | None = None) -> list[str]:
    """Return the installed packages that are older than chutelab's lower bounds.

    Such as "pydantic>=2.9 (2.7.0 is installed)". By default of those that it always needs, else of
    one extra. Empty if chutelab itself is not installed.
    """
    found, there = list[str](), installed()
    needs = ""
    with suppress(KeyError, OSError):
        needs = Path(there["chutelab"][1], "METADATA").read_text(encoding="utf-8")
    for package, bound, brings in _BOUND.findall(needs):
        # Missing packages are reported by their import.
        version, _ = there.get(_plain(package), ("", ""))
        if version and brings == (extra or "") and _numbers(version) < _numbers(bound):
            found.append(f"{package}>={bound} ({version} is installed)")
    return found


def _numbers(version: str) -> tuple[int, ...]:
    """Return the first three numbers of a version."""
    return (*map(int, re.findall(r"\d+", version)), 0, 0, 0)[:3]


def need_all() -> None:
    """Raise a `MissingLibraryError` if a package that chutelab always needs is too old.

    Some old versions do not fail, but do less.
    """
    if old := too_old():
        needed = " ".join(f'"{line.partition(" ")[0]}"' for line in old)
        raise MissingLibraryError(f"chutelab needs {'; '.join(old)}: pip install {needed}")


def cut(text: str, width: int) -> str:
    """Shorten a text to at most `width` characters, the last three of them dots."""
    return text if len(text) <= width else text[: width - 3] + "..."


_KEPT: Final = "\u00a0\u2007\u2009\u202f\u200c\u200d"
"""Characters that Python does not count as printable, though many languages need them: non-breaking
spaces, and those that join or separate letters."""


def printable(text: str) -> str:
    r"""Replace characters that control a terminal, or that it cannot show, by escapes.

    These are control characters, and those that change the direction of text.

    >>> print(printable("\x1b[31m\u202e"), printable("café, 漢字"))
    \x1b[31m\u202e café, 漢字
    """
    if text.isprintable():
        return text
    return "".join(
        c
        if c.isprintable() or c in _KEPT
        else c.encode("unicode_escape", "surrogatepass").decode("ascii")
        for c in text
    )


def printable_lines(text: str) -> str:
    """Return a text of several lines, each of them `printable`."""
    return "\n".join(map(printable, text.split("\n")))


def shown(value: object) -> str:
    """Write a value as a scene file would, cut to one short line."""
    return cut(_toml(value, depth=0), _VALUE_WIDTH)


def _toml(value: object, depth: int) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case int() if value.bit_length() > 256:
            # Python refuses to print integers of thousands of digits.
            return f"a whole number of {value.bit_length()} bits"
        case int() | float():
            return repr(value)
        case str():
            return printable(json.dumps(cut(value, _VALUE_WIDTH), ensure_ascii=False))
        case Mapping():
            return "a table"
        case list() | tuple():
            if depth > 2:
                return "[...]"
            # Enough elements to fill the line, never all of a long list.
            inner = [_toml(item, depth + 1) for item in value[:_VALUE_WIDTH]]
            return f"[{', '.join(inner)}]"
        case None:
            return "nothing"
    return printable(str(value))
