"""What students return, read without trust: notebooks, and result files of a lesson's live page."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from chutelab.classroom.exercises.catalogue import LONGEST_NAME
from chutelab.classroom.lessons.cells import EXPLANATION
from chutelab.classroom.words import LANGUAGES, words
from chutelab.util.errors import InputError, cut

LARGEST: Final = 25 << 20
"""Bytes; a notebook with its pictures is a tenth of it. As JSON it takes up to 30 times that."""

LARGEST_RESULT: Final = 256 << 10
"""Bytes; a result file has four numbers and what its student wrote."""

RESULT: Final = ".json"
"""End of a result file's name. The page calls it ``the-bounce-Ada.chutelab.json``, and browsers and
learning platforms put more before the end."""


class ReturnedError(InputError):
    """A file that cannot be marked; its text says why."""


def _content(path: Path, kind: str, most: int) -> Any:
    """Return what a file of JSON has in it."""
    try:
        # Asked before it is opened, which alone would set off some devices; and not waited for, if
        # it has become a pipe since then.
        regular = stat.S_ISREG(path.stat().st_mode)
        data = b""
        if regular:
            flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
            with os.fdopen(os.open(path, flags), "rb") as file:
                # A size that is told may be wrong.
                regular = stat.S_ISREG(os.fstat(file.fileno()).st_mode)
                data = file.read(most + 1) if regular else b""
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else ""
        raise ReturnedError(f"cannot be read: {reason or error}") from None
    if not regular:
        raise ReturnedError(f"not a {kind}: not a regular file")
    if len(data) > most:
        size = f"{most >> 20} MB" if most >> 20 else f"{most >> 10} kB"
        raise ReturnedError(f"too large for a {kind}, which has at most {size}")
    try:
        return json.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise ReturnedError(f"not a {kind}: not UTF-8 text") from None
    except (ValueError, RecursionError):
        raise ReturnedError(f"not a {kind}: not JSON") from None


def code_of(path: Path) -> list[str | None]:
    """Return the code cells of a notebook of version 4, None for one whose source is no text.

    The JSON is read here and not by nbformat: that refuses a notebook with a cell that has lost its
    metadata or its source, and what was checked in the other cells counts.

    Raises
    ------
    ReturnedError
        If it cannot be read.
    """
    found = _content(path, "notebook", LARGEST)
    try:
        cells = found["cells"]
        sources = [one.get("source", "") for one in cells if one.get("cell_type") == "code"]
    except (AttributeError, LookupError, TypeError):
        raise ReturnedError("not a notebook: it has no cells") from None
    return list(map(_text, sources))


def words_of(path: Path) -> dict[str, str]:
    """Return what was written into a notebook's cell for words, as "explain"; {} without any.

    Raises
    ------
    ReturnedError
        If the notebook cannot be read.
    """
    found = _content(path, "notebook", LARGEST)
    written = {}
    for cell in found["cells"]:
        if cell.get("cell_type") == "markdown" and cell.get("id") == EXPLANATION:
            said = _text(cell.get("source", "")) or ""
            for language in LANGUAGES:
                said = said.replace(words(language).say("notebook-words"), "")
            if said.strip():
                written["explain"] = said.strip()[:LONGEST_TEXT]
    return written


def _text(source: Any) -> str | None:
    """Return the source of a cell: a text, or a list of lines."""
    lines = source if isinstance(source, list) else [source]
    return "".join(lines) if all(isinstance(line, str) for line in lines) else None


MOST_QUESTIONS: Final = 20
LONGEST_TEXT: Final = 10_000
"""Characters of one text that a student wrote."""

Name = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=LONGEST_NAME)
]
QuestionNumber = Annotated[str, StringConstraints(pattern=r"^[1-9][0-9]?$")]
Answer = Annotated[float, Field(allow_inf_nan=False)]
Key = Annotated[str, StringConstraints(max_length=40)]
Words = Annotated[str, StringConstraints(max_length=LONGEST_TEXT)]


class Result(BaseModel):
    """A result file: numbers and words, no verdicts. What else is in it is for the page alone."""

    model_config = ConfigDict(strict=True, frozen=True)

    chutelab_result: Literal[1]
    lesson: Key
    student: Name
    answers: Annotated[dict[QuestionNumber, Answer], Field(max_length=MOST_QUESTIONS)] = {}
    revealed: Annotated[list[int], Field(max_length=MOST_QUESTIONS)] = []
    words: Annotated[dict[Key, Words], Field(max_length=MOST_QUESTIONS)] = {}


def result_of(path: Path) -> Result:
    """Return what is in a result file.

    Raises
    ------
    ReturnedError
        If it cannot be read, or has anything in it that no page writes.
    """
    found = _content(path, "result file", LARGEST_RESULT)
    match found:
        case {"chutelab_result": int(version)} if version > 1:
            raise ReturnedError("a result file of a newer chutelab: upgrade to read it")
        case {"chutelab_result": _}:
            pass
        case _:
            raise ReturnedError('not a result file: it has no "chutelab_result"')
    try:
        return Result.model_validate(found)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        why = first["msg"][:1].lower() + first["msg"][1:]
        said = ": ".join(["not a result file", *map(str, first["loc"]), why])
        raise ReturnedError(cut(said, 200)) from None


def is_result(path: Path) -> bool:
    """Tell a result file from a notebook, by its name."""
    return path.suffix.casefold() == RESULT
