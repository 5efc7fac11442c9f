"""What a class did, lesson by lesson, as Markdown: marks, mistakes, and what was written."""

from __future__ import annotations

import re
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Final

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises.exercise import plain
from chutelab.classroom.grading import Grade

_MARKUP: Final = re.compile(r"[\\`*_\[\]<>|&~]")


def report(grades: Iterable[Grade]) -> str:
    """Return the report of a class as Markdown.

    Files with one name on them all count: two students may have it, or one returned twice, and
    nothing here can tell. Nothing that a student wrote is markup in it.
    """
    rows = list(grades)
    lines = ["# Class report", ""]
    for name in EXERCISES:
        if of_lesson := [row for row in rows if row.marks and row.lesson == name]:
            lines += _lesson(name, of_lesson)
    if rest := [row for row in rows if not row.marks]:
        lines += ["## Not counted", "", "| file | why |", "|---|---|"]
        lines += [f"| {_literal(row.file)} | {_literal(row.reason)} |" for row in rest]
        lines += [""]
    return "\n".join(lines)


def _lesson(name: str, rows: list[Grade]) -> Iterator[str]:
    exercise = EXERCISES[name]
    files: dict[str, list[Grade]] = {}
    for row in rows:
        files.setdefault(plain(row.student), []).append(row)
    shared = {name: found for name, found in files.items() if len(found) > 1}
    handed = "1 student" if len(files) == 1 else f"{len(files)} students"
    handed += f", {len(rows)} files" if shared else ""
    yield from (f"## Lesson {exercise.number}: {exercise.title}", "", handed, "")
    for found in shared.values():
        several = ", ".join(_literal(row.file) for row in found)
        yield from (
            f"{_literal(found[0].student)}: several files have this name, and all count: {several}",
            "",
        )
    yield "| question | right | not right | no answer | working shown |"
    yield "|---|--:|--:|--:|--:|"
    for number, asked in enumerate(exercise.questions, 1):
        right = sum(row.marks[number - 1] for row in rows)
        tried = sum(number in row.answers for row in rows)
        shown = sum(number in row.revealed for row in rows)
        counts = f"{right} | {tried - right} | {len(rows) - tried} | {shown}"
        yield f"| {number} {_literal(asked.title)} | {counts} |"
    counted = Counter((n, mistake) for row in rows for n, mistake in row.mistakes.items())
    if counted:
        yield from ("", "| question | mistake | how many |", "|---|---|--:|")
        for (number, mistake), many in sorted(counted.items(), key=lambda one: (-one[1], one[0])):
            yield f"| {number} | {_literal(mistake)} | {many} |"
    yield ""
    for row in rows:
        which = f", {_literal(row.file)}" if plain(row.student) in shared else ""
        for key, text in row.words.items():
            yield from (f"**{_literal(row.student)}** ({_literal(key)}{which}):", "")
            for line in text.splitlines():
                # An indented line is shown as it is.
                yield from textwrap.wrap(line, 90, initial_indent="    ", subsequent_indent="    ")
            yield ""


def _literal(text: str) -> str:
    """Return a text for a cell of Markdown that shows just that."""
    return _MARKUP.sub(r"\\\g<0>", " ".join(text.split()))
