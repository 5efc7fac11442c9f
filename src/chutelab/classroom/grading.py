"""Marks for the work that students return, and reports of a class. It runs notebooks' code.

Use a container for the notebooks of strangers. A notebook runs in a kernel of its own (`kernel`),
with limits. What it prints is ignored: the kernel hands over the numbers that were checked. A
result file of a lesson's live page contains those numbers, and no code of it runs. Neither is
trusted: answers are judged again, against right ones computed here. Each file is marked by itself,
whatever happens to the others. `write_csv` writes the marks of a class, each row as soon as it is
known, and `report` what the class did, lesson by lesson.
"""

from __future__ import annotations

import codecs
import json
import os
import re
import stat
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from html import escape
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from chutelab.classroom.exercises import EXERCISES, LONGEST_NAME, OPENED, UNNAMED
from chutelab.classroom.exercises.exercise import draw, normalized
from chutelab.classroom.exercises.judging import is_rounded, judge
from chutelab.classroom.kernel import ForgedError, run
from chutelab.classroom.lessons import OWN_WORDS
from chutelab.classroom.lessons.texts import asset
from chutelab.util.errors import (
    InputError,
    MissingLibraryError,
    cut,
    printable,
    printable_lines,
    too_old,
)
from chutelab.util.files import csv_lines
from chutelab.util.words import LANGUAGES, words

LARGEST: Final = 25 << 20
"""Most bytes of a notebook; one with pictures has a tenth. Parsed, it takes up to 30 times that."""

LARGEST_RESULT: Final = 256 << 10
"""Most bytes of a result file; it has four numbers and what the student wrote."""

RESULT: Final = ".json"
"""End of a result file's name. The page calls it ``the-bounce-Ada.chutelab.json``, and browsers and
learning platforms put more before the end."""


class ReturnedError(InputError):
    """A file that cannot be marked; the message says why."""


def _content(path: Path, kind: str, most: int) -> Any:
    """Return the content of a JSON file."""
    try:
        # Check the file before opening it, since opening triggers some devices, and again after
        # opening it without waiting, as it may have become a pipe.
        regular = stat.S_ISREG(path.stat().st_mode)
        data = b""
        if regular:
            flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
            with os.fdopen(os.open(path, flags), "rb") as file:
                # The reported size may be wrong, so count the bytes that are read.
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
    """Return the code cells of a notebook of version 4; None for a cell whose source is not text.

    The JSON is read here and not by nbformat, which refuses a notebook if one cell has lost its
    metadata or its source; the other cells should still count.

    Raises a `ReturnedError` if it cannot be read.
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

    Raises a `ReturnedError` if the notebook cannot be read.
    """
    found = _content(path, "notebook", LARGEST)
    written = {}
    for cell in found["cells"]:
        if cell.get("cell_type") == "markdown" and cell.get("id") == OWN_WORDS:
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
# JSON has texts for keys.
QuestionNumber = Annotated[int, Field(strict=False)]
Answer = Annotated[float, Field(allow_inf_nan=False)]
Times = Annotated[int, Field(ge=0, le=1_000_000)]
Key = Annotated[str, StringConstraints(max_length=40)]
Words = Annotated[str, StringConstraints(max_length=LONGEST_TEXT)]


class Work(BaseModel):
    """A student's work in one lesson: numbers and words, no verdicts.

    It comes from a result file, which has more for the page's own use, or from the kernel.
    """

    model_config = ConfigDict(strict=True)

    chutelab_result: Literal[1] = 1
    lesson: Key
    student: Name
    answers: Annotated[dict[QuestionNumber, Answer], Field(max_length=MOST_QUESTIONS)] = {}
    tries: Annotated[dict[QuestionNumber, Times], Field(max_length=MOST_QUESTIONS)] = {}
    hints: Annotated[dict[QuestionNumber, Times], Field(max_length=MOST_QUESTIONS)] = {}
    revealed: Annotated[list[int], Field(max_length=MOST_QUESTIONS)] = []
    words: Annotated[dict[Key, Words], Field(max_length=MOST_QUESTIONS)] = {}


def _work(found: object) -> Work:
    """Return a student's work; a `ValueError` names content that chutelab does not write."""
    try:
        work = Work.model_validate(found)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        why = first["msg"][:1].lower() + first["msg"][1:]
        raise ValueError(": ".join([*map(str, first["loc"]), why])) from None
    if work.lesson not in EXERCISES:
        raise ValueError(f"no lesson {work.lesson!r} has an exercise")
    count = len(EXERCISES[work.lesson].questions)
    if not {*work.answers, *work.revealed, *work.tries, *work.hints} <= set(range(1, count + 1)):
        raise ValueError(f"the lesson has questions 1 to {count} only")
    return work


def result_of(path: Path) -> Work:
    """Return the content of a result file.

    Raises a `ReturnedError` if it cannot be read, or has content that no page writes.
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
        return _work(found)
    except ValueError as error:
        raise ReturnedError(cut(f"not a result file: {error}", 200)) from None


def is_result(path: Path) -> bool:
    """Tell a result file from a notebook, by its name."""
    return path.suffix.casefold() == RESULT


@dataclass(frozen=True)
class Grade:
    """The row of one file; missing values are empty."""

    file: str  # as it was given
    student: str = ""
    lesson: str = ""
    marks: tuple[int, ...] = ()  # 1 for a right answer, 0 for any other or none, by question
    out_of: int = 0  # number of questions
    revealed: tuple[int, ...] = ()  # questions whose working was shown; they count all the same
    reason: str = ""  # remarks on this row
    answers: Mapping[int, float] = field(default_factory=dict, compare=False)  # by question
    mistakes: Mapping[int, str] = field(default_factory=dict, compare=False)  # known ones
    tries: Mapping[int, int] = field(default_factory=dict, compare=False)  # answers checked
    hints: Mapping[int, int] = field(default_factory=dict, compare=False)  # hints read
    words: Mapping[str, str] = field(default_factory=dict, compare=False)  # what was written

    @property
    def total(self) -> int:
        """Sum of the marks."""
        return sum(self.marks)


def grade(paths: Iterable[str | Path], time_limit: float = 60.0) -> Iterator[Grade]:
    """Mark what students returned, one after the other. This runs the code of notebooks.

    Yields a row per path, notebook or result file of a lesson's live page (``*.json``), in their
    order, each when it is done; a file that cannot be read, run or marked has its reason. A
    notebook that hangs is stopped after `time_limit`, s, and marked for what it had answered by
    then.

    Raises a `MissingLibraryError` for notebooks, without IPython and psutil, which the extra
    ``notebook`` brings.
    """
    files = list(map(str, paths))
    if not all(is_result(Path(file)) for file in files):
        missing = [name for name in ("IPython", "psutil") if find_spec(name) is None]
        if missing := missing or too_old("notebook"):
            install = 'python -m pip install "chutelab[notebook]"'
            said = f"grading notebooks needs {' and '.join(missing)}: {install}"
            raise MissingLibraryError(said)
    return _each(files, time_limit)


def _each(files: list[str], time_limit: float) -> Iterator[Grade]:
    first: dict[tuple[str, str], str] = {}
    rows: list[Grade] = []
    for file in files:
        try:
            result = is_result(Path(file))
            row = _marked(file, result_of(Path(file))) if result else _of_notebook(file, time_limit)
        except ReturnedError as error:
            row = Grade(file, reason=str(error))
        except ForgedError as error:
            row = Grade(file, reason=f"refused: {error}")
        except Exception as error:  # the others are marked all the same
            row = Grade(file, reason=f"cannot be graded: {type(error).__name__}: {error}")
        row = replace(
            row,
            student=printable(row.student),
            reason=printable(row.reason),
            words={printable(key): printable_lines(text) for key, text in row.words.items()},
        )
        entry = (row.lesson, normalized(row.student))
        if row.lesson and entry in first:
            same = printable(f"same lesson and student as {first[entry]}")
            row = replace(row, reason="; ".join(filter(None, [row.reason, same])))
        elif row.lesson:
            row = replace(row, reason="; ".join(filter(None, [row.reason, *_copied(row, rows)])))
            rows.append(row)
        first.setdefault(entry, file)
        yield row


def _copied(row: Grade, before: Sequence[Grade]) -> Iterator[str]:
    """Report wrong answers that are right for another student's numbers, or the other way round.

    Each report has the chance of this without copying: that wrong answers of one student are right
    for the numbers of any of the others.
    """
    others = [one for one in before if one.lesson == row.lesson]
    for other in others:
        for mine, its, said in (
            (row, other, f"are right for the numbers of {other.student}"),
            (other, row, f"of {other.file} are right for these numbers"),
        ):
            # An answer that follows from the student's own numbers by a known mistake is no sign.
            _, cases = draw(EXERCISES[mine.lesson], its.student)
            found = [
                n
                for n, mark in enumerate(mine.marks, 1)
                if not mark and n in mine.answers and n not in mine.mistakes
                and is_rounded(mine.answers[n], cases[n - 1].right)
            ]  # fmt: skip
            if found:
                seen = sum(
                    all(is_rounded(mine.answers[n], right[n - 1]) for n in found)
                    for right in _drawn(mine.lesson)
                )
                # An event that was never seen may still happen: Laplace's rule of succession gives
                # a bound.
                chance = 1.0 - (1.0 - (seen + 1) / (DRAWS + 2)) ** len(others)
                likely = f"by chance: {'' if seen else 'at most '}1 in {1.0 / chance:,.0f}"
                # A bound that is not small only says that there were few draws.
                likely = "this may be chance" if seen and chance >= LIKELY else likely
                listed = ", ".join(map(str, found))
                yield printable(f"answers {listed} {said} ({likely})")


LIKELY: Final = 0.05
"""From this chance on, an answer that is right for another student may be a coincidence."""

DRAWS: Final = 300
"""Number of made-up students used to find how often an answer is right for another one."""


@cache
def _drawn(lesson: str) -> tuple[tuple[float, ...], ...]:
    """Return the right answers of made-up students."""
    exercise = EXERCISES[lesson]
    return tuple(
        tuple(case.right for case in draw(exercise, f"nobody {n}")[1]) for n in range(DRAWS)
    )


def write_csv(grades: Iterable[Grade], path: str | Path, *, decimal_comma: bool = False) -> Path:
    """Write a row per grade, as soon as it is known; at the end the file is complete.

    Until then the rows are in a file beside it, ``NAME.part``. If `grades` or the disk raises an
    exception, or the program ends, this file stays if it has marks; each row in it is complete. It
    begins with a byte order mark, by which Excel recognises UTF-8. `decimal_comma` is for versions
    of Excel with a decimal comma; cells are then separated by semicolons.

    Raises a `FileExistsError` if ``NAME.part`` is there: earlier marks, or a grading that still
    runs.
    """
    path = Path(path)
    part = path.with_name(f"{path.name}.part")
    heads = [f"q{i + 1}" for i in range(max(len(one.questions) for one in EXERCISES.values()))]
    answers = [f"answer{i + 1}" for i in range(len(heads))]
    marked = False

    def rows() -> Iterator[list[object]]:
        nonlocal marked
        last = ["total", "out_of", "revealed", "reason", *answers, "mistakes", "tries", "hints"]
        yield ["file", "student", "lesson", *heads, *last]
        for row in grades:
            marks = [*row.marks, *[None] * (len(heads) - len(row.marks))]
            revealed = " ".join(map(str, row.revealed))
            cells = [row.file, row.student, row.lesson, *marks]
            numbers = [row.answers.get(n) for n in range(1, len(heads) + 1)]
            named = "; ".join(f"{n}: {mistake}" for n, mistake in row.mistakes.items())
            counts = sum(row.tries.values()), sum(row.hints.values())
            told = [row.total, row.out_of, revealed, row.reason, *numbers, named, *counts]
            yield [*cells, *told]
            marked = marked or bool(row.marks)

    with part.open("xb", buffering=0) as file:
        try:
            file.write(codecs.BOM_UTF8)
            signs = {"separator": ";", "decimal": ","} if decimal_comma else {}
            for line in csv_lines(rows(), **signs, end="\r\n"):
                size, left = file.tell(), line.encode("utf-8", "replace")
                try:
                    while left:
                        left = left[file.write(left) :]
                except BaseException:
                    file.truncate(size)
                    raise
            os.fsync(file.fileno())
        except BaseException:
            if not marked:
                part.unlink()
            raise
    return part.replace(path)


def _of_notebook(file: str, time_limit: float) -> Grade:
    """Mark the lesson and student with the most answers among those that a notebook reports.

    Raises a `ForgedError` if that is no report of a chutelab: unknown code ran there.
    """
    ran = run(code_of(Path(file)), time_limit)
    if not isinstance(ran.tasks, list) or len(ran.tasks) > (OPENED.maxlen or 0):
        raise ForgedError("its report is not a list of tasks, or too long a one")
    found: dict[tuple[str, str], Work] = {}
    for one in ran.tasks:
        try:
            work = _work(one)
        except ValueError as error:
            raise ForgedError(f"its report is not from chutelab: {error}") from None
        first = found.setdefault((work.lesson, normalized(work.student)), work)
        first.answers |= work.answers
        first.tries |= work.tries
        first.hints |= work.hints
        first.revealed += work.revealed
    # Each lesson and student once, in the order they were opened.
    works = list(found.values())
    if not works:
        nothing = "no exercise was opened: lesson(…) was never called"
        return Grade(file, reason=ran.trouble or nothing)
    work = max(reversed(works), key=lambda one: len(one.answers))
    others = (one for one in works if one is not work and one.answers)
    also = (f"also answered {one.lesson} as {one.student}" for one in others)
    work.words = words_of(Path(file))
    return _marked(file, work, [ran.trouble, *also])


def _marked(file: str, work: Work, reasons: Sequence[str] = ()) -> Grade:
    # The right answers are computed here: those of the kernel or the page may be forged.
    _, cases = draw(EXERCISES[work.lesson], work.student)
    replies = [judge(cases[n - 1], answer) for n, answer in sorted(work.answers.items())]
    right = {reply.question for reply in replies if reply.right}
    if normalized(work.student) == UNNAMED:
        reasons = [*reasons, f"the name was left at {UNNAMED!r}"]
    return Grade(
        file=file,
        student=work.student,
        lesson=work.lesson,
        marks=tuple(int(case.number in right) for case in cases),
        out_of=len(cases),
        revealed=tuple(sorted({*work.revealed})),
        reason="; ".join(filter(None, reasons)),
        answers=work.answers,
        tries=work.tries,
        hints=work.hints,
        mistakes={reply.question: reply.mistake for reply in replies if reply.mistake},
        words={key: text.strip() for key, text in work.words.items() if text.strip()},
    )


_MARKUP: Final = re.compile(r"[\\`*_\[\]<>|&~]")


def report(grades: Iterable[Grade]) -> str:
    """Return the report of a class as Markdown.

    All files with the same name count: two students may have it, or one returned twice, and this
    cannot be told apart. Students' texts are not markup in it.
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
        files.setdefault(normalized(row.student), []).append(row)
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
        which = f", {_literal(row.file)}" if normalized(row.student) in shared else ""
        for key, text in row.words.items():
            yield from (f"**{_literal(row.student)}** ({_literal(key)}{which}):", "")
            for line in text.splitlines():
                # An indented line is shown as it is.
                yield from textwrap.wrap(line, 90, initial_indent="    ", subsequent_indent="    ")
            yield ""


def _literal(text: str) -> str:
    """Return a text with all Markdown escaped."""
    return _MARKUP.sub(r"\\\g<0>", " ".join(text.split()))


def page(grades: Iterable[Grade]) -> str:
    """Return the report of a class as one HTML page: by lesson, students and their questions.

    Each answer is right, a mistake by its name, or a number, with how often it was tried and how
    many hints were read. Below are the students' texts, and the files that did not count.
    """
    rows = list(grades)
    parts = []
    for name, exercise in EXERCISES.items():
        of_lesson = [row for row in rows if row.marks and row.lesson == name]
        if not of_lesson:
            continue
        heads = "".join(
            f"<th scope=col>{n}. {escape(one.title)}" for n, one in enumerate(exercise.questions, 1)
        )
        right = ""
        for n, marks in enumerate(zip(*(row.marks for row in of_lesson), strict=True), 1):
            right += f"<td>{sum(marks)} of {len(of_lesson)}"
            made = Counter(row.mistakes[n] for row in of_lesson if n in row.mistakes)
            for mistake, many in made.most_common(1):
                right += f"<small>{many} × {escape(mistake)}</small>"
        lines = "".join(
            f"<tr><th scope=row>{escape(row.student)}<td>{row.total} of {row.out_of}"
            f"{''.join(_cell(row, n) for n in range(1, row.out_of + 1))}<td>{escape(row.reason)}"
            for row in sorted(of_lesson, key=lambda row: normalized(row.student))
        )
        parts.append(
            f"<h2>{exercise.number}. {escape(exercise.title)}</h2>\n<table><thead><tr>"
            f"<th scope=col>student<th scope=col>marks{heads}<th scope=col>remarks</thead>"
            f"<tbody>{lines}</tbody><tfoot><tr><th scope=row>right<td>{right}<td></tfoot></table>"
        )
        said = "".join(
            f"<dt>{escape(row.student)}<dd>{escape(text)}"
            for row in of_lesson
            for text in row.words.values()
        )
        parts.append(f"<h3>What they wrote</h3>\n<dl>{said}</dl>" if said else "")
    rest = "".join(
        f"<tr><th scope=row>{escape(row.file)}<td>{escape(row.reason)}"
        for row in rows
        if not row.marks
    )
    if rest:
        parts.append(f"<h2>Not counted</h2>\n<table><tr><th>file<th>why{rest}</table>")
    return Template(asset("report.html")).substitute(body="\n".join(parts))


def _cell(row: Grade, number: int) -> str:
    """Return what a student did in a question."""
    kind, said = "none", "no answer"
    if row.marks[number - 1]:
        kind, said = "right", "✓ right"
    elif number in row.answers:
        shown = f"✗ {row.answers[number]:.4g}"
        kind, said = "wrong", escape(row.mistakes.get(number, shown))
    counts = [
        f"{many} {what if many == 1 else whats}"
        for many, what, whats in (
            (row.tries.get(number, 0), "try", "tries"),
            (row.hints.get(number, 0), "hint", "hints"),
        )
        if many
    ]
    counts += ["working shown"] if number in row.revealed else []
    return f"<td class={kind}>{said}<small>{', '.join(counts)}</small>"
