"""Marks from returned notebooks. It runs students' code: use a container for strangers.

A notebook runs in a kernel of its own, with a time limit. What it prints is not looked at: the
kernel hands over the numbers that were checked, and they are judged again here, against the numbers
of the student's name. `write_csv` writes the marks of a class.
"""

from __future__ import annotations

import json
import os
import secrets
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import ceil, isfinite
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from chutelab.classroom.exercises import ExerciseError, Task, lesson
from chutelab.classroom.exercises.catalogue import UNNAMED
from chutelab.classroom.exercises.exercise import plain
from chutelab.util.errors import InputError
from chutelab.util.files import csv_lines, write_lines

if TYPE_CHECKING:
    from nbclient import NotebookClient


LARGEST = 50 << 20
"""Bytes; a notebook with its pictures is a tenth of it."""


class NotebookError(InputError):
    """A file that is no notebook; its text says why."""


def code_of(path: Path) -> list[str]:
    """Return the code cells of a notebook, of any version that has cells.

    Raises
    ------
    NotebookError
        If it cannot be read.
    """
    try:
        size = path.stat().st_size
        text = path.read_text(encoding="utf-8") if size <= LARGEST else ""
    except OSError as error:
        raise NotebookError(f"cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise NotebookError("not a notebook: not UTF-8 text") from None
    if size > LARGEST:
        raise NotebookError(f"too large for a notebook, which has at most {LARGEST >> 20} MB")
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise NotebookError("not a notebook: not JSON") from None
    cells = _cells(found)
    if cells is None:
        raise NotebookError("not a notebook: it has no cells")
    return cells


def _cells(found: Any) -> list[str] | None:
    if not isinstance(found, dict) or not isinstance(found.get("cells"), list):
        return None
    code = [
        cell.get("source", "")
        for cell in found["cells"]
        if isinstance(cell, dict) and cell.get("cell_type") == "code"
    ]
    # A source is a text, or a list of lines.
    return ["".join(map(str, source)) for source in code]


PACKAGES = Path(__file__).parents[2]
"""Where this chutelab lies, for the kernel to find it too."""

LAST_WORD = 5
"""s for the kernel to hand over the answers after its time is up."""

QUIET = "--IPKernelApp.log_level=40"
"""Errors only: the kernel would warn of connections that never leave this machine."""

LONGEST = 200
"""Characters of an error that are told."""


@dataclass(frozen=True)
class Outcome:
    """What came out of a run.

    Attributes
    ----------
    tasks : list
        As `report` in `classroom.exercises.catalogue` gives them, unchecked: student's code ran
        there.
    trouble : str
        What went wrong first, or empty.
    """

    tasks: list[Any]
    trouble: str


def run(code: Sequence[str], time_limit: float) -> Outcome:
    """Run code cells in order; what raises an error does not keep the rest from running.

    Parameters
    ----------
    code : sequence of str
        The cells.
    time_limit : float
        s for all of them together, the kernel's start not counted.

    Raises
    ------
    ImportError
        Without nbclient.
    """
    try:
        import nbclient  # noqa: F401 - with it comes all that is needed
    except ModuleNotFoundError as error:
        message = 'grading needs nbclient: python -m pip install "chutelab[notebook]"'
        raise ImportError(message) from error
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        return _run(code, time_limit, folder)


def _run(code: Sequence[str], time_limit: float, folder: str) -> Outcome:
    from nbclient.exceptions import DeadKernelError

    client = _client(folder)
    trouble = ""
    with client.setup_kernel(cleanup_kc=True):
        deadline = monotonic() + time_limit
        for number, source in enumerate(code, start=1):
            try:
                problem = _execute(client, source, deadline - monotonic())[0]
            except DeadKernelError:
                return Outcome([], trouble or f"the kernel died in code cell {number}")
            if monotonic() >= deadline:
                trouble = f"stopped after {time_limit:g} s, in code cell {number}"
                break
            if problem:
                trouble = trouble or f"code cell {number}: {problem}"
        try:
            return Outcome(_answers(client), trouble)
        except DeadKernelError:
            return Outcome([], trouble or "the kernel died after the last cell")


def _client(folder: str) -> NotebookClient:
    """Return a client whose kernel is this Python with this chutelab, whatever else is installed.

    Start-up files and history of whoever grades are left out.
    """
    from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
    from jupyter_client.manager import AsyncKernelManager
    from nbclient import NotebookClient
    from nbformat.v4 import new_notebook

    paths = [str(PACKAGES), *filter(None, [os.environ.get("PYTHONPATH")])]
    spec = KernelSpec(
        argv=[sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}", QUIET],
        display_name="chutelab",
        language="python",
        env={"PYTHONPATH": os.pathsep.join(paths), "IPYTHONDIR": folder},
    )

    class Specs(KernelSpecManager):
        def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
            return spec

    manager = AsyncKernelManager(kernel_name="python3", kernel_spec_manager=Specs())
    return NotebookClient(
        new_notebook(),  # type: ignore[no-untyped-call]
        km=manager,
        allow_errors=True,
        # A cell whose time is up is interrupted and left, whether it stops or not.
        interrupt_on_timeout=True,
        error_on_timeout={"ename": "TimeoutError", "evalue": "", "traceback": []},
        shutdown_kernel="immediate",
        resources={"metadata": {"path": folder}},
    )


def _execute(client: NotebookClient, source: str, seconds: float) -> tuple[str, list[Any]]:
    """Run one cell; return its error in a line, if any, and its outputs."""
    from nbformat.v4 import new_code_cell

    cell = new_code_cell(source)  # type: ignore[no-untyped-call]
    client.nb.cells = [cell]
    client.timeout = max(1, ceil(seconds))
    client.execute_cell(cell, 0)
    for output in cell.outputs:
        if output.output_type == "error":
            return f"{output.ename}: {output.evalue}"[:LONGEST], cell.outputs
    return "", cell.outputs


def _answers(client: NotebookClient) -> list[Any]:
    """Ask the kernel for its tasks, under a name that no cell before could know."""
    name = f"application/x-chutelab-{secrets.token_hex(8)}+json"
    source = (
        "import chutelab.classroom.exercises.catalogue, IPython.display\n"
        "IPython.display.publish_display_data("
        f"{{{name!r}: chutelab.classroom.exercises.catalogue.report()}})"
    )
    for output in _execute(client, source, LAST_WORD)[1]:
        found = output.get("data", {}).get(name)
        if isinstance(found, list):
            return found
    return []


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
    rows = [["file", "student", "lesson", *heads, "total", "out_of", "revealed", "reason"]]
    for row in grades:
        texts = [_harmless(text) for text in (row.file, row.student, row.lesson)]
        marks = [*map(str, row.marks), *[""] * (most - len(row.marks))]
        revealed = " ".join(map(str, row.revealed))
        end = [str(row.total), str(row.out_of), revealed, _harmless(row.reason)]
        rows.append([*texts, *marks, *end])
    return write_lines(path, csv_lines(rows, end="\r\n"), errors="replace")


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
