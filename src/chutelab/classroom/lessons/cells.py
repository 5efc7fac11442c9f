"""A lesson's notebook, ``exercise.ipynb``, made of its worksheet, its own cells and its exercise.

The worksheet's parts are the notebook's; a translated worksheet makes one in its language. A block
of commands becomes a cell that runs the same (`classroom.book`); paragraphs that begin with ``*In a
terminal`` are left out. ``notebook.py``, in
the percent format, has what only the notebook has: a cell ``# %% Run`` follows what stands under
"Run", a cell ``# %% Run 2`` takes the place of its second block, and ``# %% [markdown] Run`` is
text; a line ``# needs: notebook,fit`` names the extras of the package that it takes. The same files
make the same bytes.
"""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Callable, Iterator
from typing import Any, Final

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises.catalogue import UNNAMED
from chutelab.classroom.lessons.reading import Lesson, shipped_lessons, unusable
from chutelab.classroom.words import words

OWN: Final = "notebook.py"

PARTS: Final = {"Predict": "part-predict", "Run": "part-run", "Compare": "part-compare"}
"""Those of the worksheet, in the order of the notebook, with the keys of their headings."""

_NEEDS: Final = re.compile(r"^# needs: *(.*)$", re.MULTILINE)

EXPLANATION: Final = "explanation"
"""Id of the cell in which a student writes in words; "notebook-words" is in it until then."""

Cell = dict[str, Any]


def name_of(language: str) -> str:
    """Return the name of a notebook's file."""
    return "exercise.ipynb" if language == "en" else f"exercise.{language}.ipynb"


def notebook_of(lesson: Lesson) -> str:
    """Return the text of a lesson's notebook, JSON; "" if its worksheet has not all of `PARTS`.

    The worksheet is that in the lesson's language; so is the notebook.

    Raises
    ------
    LessonError
        If a cell of ``notebook.py`` belongs to no part.
    """
    text = lesson.text("README")
    opening, *pieces = re.split(r"^## (.*)\n+", text, flags=re.MULTILINE)
    found = dict(zip(pieces[::2], pieces[1::2], strict=True))
    heads = {name: words(lesson.language).say(key) for name, key in PARTS.items()}
    if not found.keys() >= set(heads.values()):
        return ""
    parts = {name: found[head] for name, head in heads.items()}
    own = _own(lesson)
    title, _, opening = opening.partition("\n")
    # The notebook draws the machine itself: it may be all that a student has.
    opening = re.sub(r"^!\[.*\n+", "", opening, flags=re.MULTILINE)
    needs = _NEEDS.search(_source(lesson))
    opened = f"{title}\n\n{_prose(opening, words(lesson.language).say('notebook-terminal'))}"
    cells = list(_cells(lesson, parts, own, needs[1] if needs else "notebook", opened))
    if left := [place for place in own if place not in {cell["of"] for cell in cells}]:
        said = f"there is no place for a cell # %% {left[0]}"
        raise unusable(lesson.folder / OWN, said)
    for cell in cells:
        del cell["of"]
    book = {
        "cells": cells,
        "metadata": {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    return json.dumps(book, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


def _source(lesson: Lesson, name: str = OWN) -> str:
    path = lesson.folder / name
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def _own(lesson: Lesson) -> dict[str, list[tuple[str, str]]]:
    """Return the kinds and sources of the cells in ``notebook.py`` by their places.

    In another language the texts, in their order, are those of ``notebook.LANGUAGE.py``.
    """
    found = _cells_in(_source(lesson))
    told = _cells_in(_source(lesson, f"notebook.{lesson.language}.py"))
    for place, cells in told.items():
        texts = iter(cells)
        found[place] = [
            next(texts, cell) if cell[0] == "markdown" else cell for cell in found.get(place, ())
        ]
    return found


def _cells_in(source: str) -> dict[str, list[tuple[str, str]]]:
    found: dict[str, list[tuple[str, str]]] = {}
    pieces = re.split(r"^# %% *(\[markdown\])? *(.*)\n", source, flags=re.MULTILINE)
    for markdown, place, source in zip(pieces[1::3], pieces[2::3], pieces[3::3], strict=True):
        kind = "markdown" if markdown else "code"
        if markdown:
            source = re.sub(r"^# ?", "", source, flags=re.MULTILINE)
        found.setdefault(place.strip(), []).append((kind, source.strip("\n")))
    return found


def _cells(
    lesson: Lesson,
    parts: dict[str, str],
    own: dict[str, list[tuple[str, str]]],
    needs: str,
    opening: str,
) -> Iterator[Cell]:
    exercise = EXERCISES.get(lesson.name)

    def added(place: str) -> Iterator[Cell]:
        for n, (kind, source) in enumerate(own.get(place, ()), start=1):
            name = f"{place}-own-{n}".lower().replace(" ", "-")
            yield _cell(kind, name, source, place)

    say = words(lesson.language).say

    language = "" if lesson.language == "en" else f', language="{lesson.language}"'

    def head(part: str) -> str:
        return f"## {say(PARTS[part])}\n\n"

    def prose(text: str) -> str:
        return _prose(text, say("notebook-terminal"))

    order = say("notebook-order-exercise" if exercise is not None else "notebook-order")
    yield _cell(
        "markdown",
        "title",
        f"{opening}\n\n{order}\n\n{say('notebook-needs', extras=needs)}",
    )
    shipped = any(one.folder == lesson.folder for one in shipped_lessons())
    called = json.dumps(lesson.name if shipped else ".")
    yield _cell(
        "code",
        "machine",
        f"from chutelab.classroom.book import Book\n\nbook = Book({called})\nbook.machine()",
    )
    if exercise is not None:
        yield _cell(
            "markdown", "name-text", f"## {say('notebook-name-head')}\n\n{say('notebook-name')}"
        )
        yield _cell(
            "code",
            "name",
            "from chutelab.classroom.exercises import lesson\n"
            f'\nstudent = "{UNNAMED}"\n'
            f'task = lesson("{exercise.name}", student=student{language})\ntask',
        )
    asked = re.findall(r"^(\d+)\. ", parts["Predict"], flags=re.MULTILINE)
    yield _cell(
        "markdown",
        "predict-text",
        f"{head('Predict')}{prose(parts['Predict'])}\n\n{say('notebook-predict')}",
    )
    lines = "".join(f"    {number}: None,\n" for number in asked)
    yield _cell("code", "predict", f"predictions = {{\n{lines}}}")
    yield from added("Predict")
    yield from _run(parts["Run"], own, head("Run"), prose)
    yield from added("Run")
    text = prose(parts["Compare"])
    fill = f"\n\n{say('notebook-fill')}" if "|---" in text else ""
    yield _cell("markdown", "compare-text", f"{head('Compare')}{text}{fill}")
    yield _cell("code", "compare", "book.compare(predictions)")
    yield from added("Compare")
    explain = f"## {say('notebook-explain-head')}\n\n{say('notebook-explain')}"
    yield _cell("markdown", "explain-text", explain)
    yield _cell("markdown", EXPLANATION, say("notebook-words"))
    if exercise is not None:
        first = exercise.parameters[0].name
        text = f"## {say('notebook-questions-head')}\n\n{say('notebook-questions', first=first)}"
        yield _cell("markdown", "questions-text", text)
        yield from added("Questions")
        for n in range(1, len(exercise.questions) + 1):
            yield _cell("code", f"question-{n}", f"task.question({n})")
            answer = f"answer_{n}"
            yield _cell("code", f"answer-{n}", f"{answer} = None\ntask.check({n}, {answer})")
    if lesson.page is not None:
        (_, text), *_ = own.get("Try it live", [("markdown", "")])
        yield _cell(
            "markdown", "live-text", f"## {say('notebook-live')}\n\n{text}".strip(), "Try it live"
        )
        yield _cell("code", "live", "book.live()")
    if exercise is not None:
        yield _cell("markdown", "progress-text", f"## {say('notebook-progress')}")
        yield _cell("code", "progress", "task.progress()")


def _run(
    part: str, own: dict[str, list[tuple[str, str]]], head: str, prose: Callable[[str], str]
) -> Iterator[Cell]:
    """Yield the texts under "Run", and a cell for each block of commands."""
    text, *pieces = re.split(r"^```sh\n(.*?)^```$", part, flags=re.MULTILINE | re.DOTALL)
    for n, (block, after) in enumerate(zip(pieces[::2], pieces[1::2], strict=True), start=1):
        name, place = "run" if n == 1 else f"run-{n}", f"Run {n}"
        if said := f"{head}{prose(text)}".strip():
            yield _cell("markdown", f"{name}-text", said)
        cells = own.get(place) or [("code", _commands(block))]
        for i, (kind, source) in enumerate(cells):
            yield _cell(kind, name if i == 0 else f"run-{n}-own-{i}", source, place)
        if place not in own and " --out " in block:
            drawn = "import chutelab\n\nchutelab.overlay(runs[0])"
            yield _cell("code", f"{name}-picture", drawn, place)
        head, text = "", after
    if rest := prose(text):
        yield _cell("markdown", "run-end", rest)


def _commands(block: str) -> str:
    """Return the cell that runs the scenes of ``chutelab run`` in a block; other commands are left.

    What is left needs a cell in `OWN`.
    """
    found = re.findall(r"^chutelab run (.*?)$", block, flags=re.MULTILINE)
    runs = [re.sub(r" --(out|only) \S+", "", line) for line in found]
    lines = "".join(f"    {json.dumps(run, ensure_ascii=False)},\n" for run in runs)
    return f"runs = book.run(\n{lines})\nruns"


def _prose(text: str, terminal: str) -> str:
    """Return paragraphs on a line each, without those that are for a terminal."""
    paragraphs = re.split(r"\n{2,}", text.strip())
    kept = (one for one in paragraphs if not one.startswith(f"*{terminal}"))
    return "\n\n".join(map(_unbroken, kept))


def _unbroken(paragraph: str) -> str:
    """Return a paragraph without its line breaks; lists and tables keep theirs."""
    lines: list[str] = []
    for line in textwrap.dedent(paragraph).splitlines():
        begins = re.match(r"\s*(?:[-*] |\||\d+\. )|#", line)
        if lines and not begins:
            lines[-1] += f" {line.strip()}"
        else:
            lines.append(line)
    return "\n".join(lines)


def _cell(kind: str, name: str, source: str, place: str = "") -> Cell:
    cell: Cell = {"cell_type": kind, "id": name, "metadata": {}, "of": place}
    if kind == "code":
        cell |= {"execution_count": None, "outputs": []}
    return cell | {"source": source.splitlines(keepends=True)}
