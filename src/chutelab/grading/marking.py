"""Marks from returned notebooks, and a CSV file for the class."""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chutelab.exercises import ExerciseError, Task, lesson
from chutelab.exercises.drawing import plain
from chutelab.exercises.task import UNNAMED
from chutelab.files import whole
from chutelab.grading.notebooks import NotebookError, code_of
from chutelab.grading.running import run

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence


@dataclass(frozen=True)
class Grade:
    """The row of one notebook.

    Attributes
    ----------
    file : str
        The notebook, as it was given.
    student, lesson : str
        As the notebook has them; empty if it has none.
    marks : tuple of int
        1 for a right answer, 0 for any other or none, by question; empty without a lesson.
    out_of : int
        Number of questions.
    revealed : tuple of int
        Questions whose working was shown before the end; they count all the same.
    reason : str
        What to know about this row, or empty.
    """

    file: str
    student: str = ""
    lesson: str = ""
    marks: tuple[int, ...] = ()
    out_of: int = 0
    revealed: tuple[int, ...] = ()
    reason: str = ""

    @property
    def total(self) -> int:
        """Sum of the marks."""
        return sum(self.marks)


def grade(
    paths: Iterable[str | Path],
    time_limit: float = 60.0,
    progress: Callable[[float], None] | None = None,
) -> list[Grade]:
    """Run returned notebooks and mark them. This runs the students' code.

    Parameters
    ----------
    paths : iterable of path
        Notebooks.
    time_limit : float
        s for each. One that hangs is stopped, and marked for what it had answered by then.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    list of Grade
        One per path, in their order; a notebook that cannot be read, run or marked has its reason.

    Raises
    ------
    ImportError
        Without nbclient, which the extra ``notebook`` brings.
    """
    files = [str(path) for path in paths]
    grades = []
    for index, file in enumerate(files):
        if progress is not None:
            progress(index / len(files))
        grades.append(_grade(file, time_limit))
    if progress is not None:
        progress(1.0)
    return _twins_noted(grades)


def write_csv(grades: Sequence[Grade], path: str | Path) -> Path:
    """Write a row per grade; the file is whole or not there.

    Names that a spreadsheet would take for a formula are put in its quotes.
    """
    most = max((len(row.marks) for row in grades), default=0)
    heads = [f"q{i + 1}" for i in range(most)]
    with (
        whole(path) as unfinished,
        unfinished.open("w", encoding="utf-8", errors="replace", newline="") as file,
    ):
        out = csv.writer(file)
        out.writerow(["file", "student", "lesson", *heads, "total", "out_of", "revealed", "reason"])
        for row in grades:
            marks = [*row.marks, *[""] * (most - len(row.marks))]
            revealed = " ".join(map(str, row.revealed))
            texts = [_harmless(text) for text in (row.file, row.student, row.lesson)]
            end = [row.total, row.out_of, revealed, _harmless(row.reason)]
            out.writerow([*texts, *marks, *end])
    return Path(path)


def _grade(file: str, time_limit: float) -> Grade:
    try:
        outcome = run(code_of(Path(file)), time_limit)
    except NotebookError as error:
        return Grade(file, reason=str(error))
    except (RuntimeError, OSError) as error:
        # The kernel could not be started, or was taken away: the next one may do.
        return Grade(file, reason=f"the kernel failed: {error}")
    task, notes = _task(outcome.tasks)
    reasons = [*filter(None, [outcome.trouble]), *notes]
    if task is None:
        return Grade(file, reason=reasons[0])
    questions = range(1, len(task.questions) + 1)
    # Checked once more here: a kernel that ran anybody's code is not asked for marks.
    right = tuple(int(task.check(n, task.answers.get(n)).right) for n in questions)
    if plain(task.student) == UNNAMED:
        reasons.append(f"the name was left at {UNNAMED!r}")
    return Grade(
        file=file,
        student=task.student,
        lesson=task.exercise.name,
        marks=right,
        out_of=len(right),
        revealed=task.revealed,
        reason="; ".join(reasons),
    )


def _task(reports: list[Any]) -> tuple[Task | None, list[str]]:
    """Return the task that was worked on, answered anew, and what there is to say about it."""
    tasks: dict[tuple[str, str], Task] = {}
    for report in reports:
        try:
            task = lesson(str(report["lesson"]), str(report["student"]))
            task = tasks.setdefault((task.exercise.name, plain(task.student)), task)
            for number, answer in report["answers"].items():
                if isfinite(answer):
                    task.check(int(number), float(answer))
            for number in report["revealed"]:
                task.reveal(int(number))
        except (ExerciseError, ArithmeticError, LookupError, TypeError, ValueError, AttributeError):
            continue
    if not tasks:
        return None, ["no exercise was opened: lesson(…) was never called"]
    found = list(tasks.values())[::-1]
    chosen = max(found, key=lambda task: len(task.answers))
    notes = [
        f"also answered {task.exercise.name} as {task.student}"
        for task in found
        if task is not chosen and task.answers
    ]
    return chosen, notes


def _twins_noted(grades: list[Grade]) -> list[Grade]:
    """Note rows that share student and lesson with an earlier one."""
    first: dict[tuple[str, str], str] = {}
    noted = []
    for row in grades:
        key = (row.lesson, plain(row.student))
        twin = first.setdefault(key, row.file) if row.lesson else row.file
        if twin != row.file:
            same = f"same lesson and student as {twin}"
            row = replace(row, reason="; ".join(filter(None, [row.reason, same])))
        noted.append(row)
    return noted


def _harmless(text: str) -> str:
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", "\r")) else text
