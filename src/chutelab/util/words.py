"""Texts in each language: a catalogue of templates, ``strings/LANGUAGE.json``.

A translation is a file. Templates have ``{names}`` for values. Keys that begin with ``picture-``
are used in films and pictures. Exercises in live pages use the same files, except keys that begin
with ``python-``, which are about cells and ``task``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final

from chutelab.util.errors import InputError

STRINGS: Final = Path(__file__).parent / "strings"

LANGUAGES: Final = tuple(sorted((path.stem for path in STRINGS.glob("*.json")), key="en".__ne__))
"""English first."""


_MARKS: Final = {".": "decimal-mark", ",": "thousands-mark", "-": "−"}


class LanguageError(InputError):
    """A language without a catalogue."""


class Words:
    """The catalogue of one language; `words` hands it out."""

    def __init__(self, language: str, catalogue: Mapping[str, str]) -> None:
        self.language = language
        self.catalogue = catalogue

    def say(self, key: str, /, **values: object) -> str:
        """Return a template with its names filled in.

        >>> words("en").say("question-title", number=2, title="the fall")
        'Question 2: the fall'
        """
        return re.sub(r"\{(\w+)\}", lambda match: str(values[match[1]]), self.catalogue[key])

    def local(self, number: str) -> str:
        """Return a number's digits as this language writes them.

        >>> words("de").local("0.35")
        '0,35'
        """
        return number.replace(".", self.catalogue["decimal-mark"])

    def figures(self, value: float, form: str = "g") -> str:
        """Return a number, in a form of Python's, in the digits of this language.

        >>> words("de").figures(1234.5, ",.1f"), words("en").figures(-0.25, ".3g")
        ('1.234,5', '−0.25')
        """
        said = {mark: self.catalogue.get(key, key) for mark, key in _MARKS.items()}
        return "".join(said.get(sign, sign) for sign in format(value, form))

    def titles(self) -> dict[str, str]:
        """Return the titles of the shipped scenes in this language, by their own titles.

        >>> words("de").titles()["A see-saw"]
        'Eine Wippe'
        """
        own = {key: text for key, text in words().catalogue.items() if key.startswith("title-")}
        return {text: self.catalogue[key] for key, text in own.items()}

    def title(self, title: str) -> str:
        """Return the title of a scene; those of shipped ones exist in each language."""
        return self.titles().get(title, title)

    def unit(self, unit: str) -> str:
        """Return a unit as it is written behind a number."""
        return self.catalogue.get(f"unit-{unit}", unit)


@cache
def words(language: str = "en") -> Words:
    """Return the words of a language, such as "de"; missing ones are in English.

    Raises a `LanguageError` if there is no such language; the message lists those there are.
    """
    if language not in LANGUAGES:
        listed = ", ".join(LANGUAGES)
        raise LanguageError(f"no language {language[:40]!r}; there are {listed}", "language")
    said: dict[str, str] = {}
    for one in ("en", language):
        said |= json.loads((STRINGS / f"{one}.json").read_text(encoding="utf-8"))
    return Words(language, said)
