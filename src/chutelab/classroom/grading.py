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
from typing import TYPE_CHECKING, Any, Final

from chutelab.classroom.exercises import ExerciseError, Task, lesson
from chutelab.classroom.exercises.catalogue import UNNAMED
from chutelab.classroom.exercises.exercise import plain
from chutelab.util.errors import InputError, MissingLibraryError
from chutelab.util.files import csv_lines, write_lines

if TYPE_CHECKING:  # of the extra "notebook"
    from nbclient import NotebookClient

LARGEST: Final = 50 << 20
"""Bytes; a notebook with its pictures is a tenth of it."""


class NotebookError(InputError):
    """A file that is no notebook; its text says why."""


def code_of(path: Path) -> list[str]:
    """Return the code cells of a notebook of version 4.

    The JSON is read here and not by nbformat: that refuses a notebook with a cell that has lost its
    metadata or its source, and what was checked in the other cells counts. With it, reading one
    takes 0.15 s more for the import.

    Raises
    ------
    NotebookError
        If it cannot be read.
    """
    try:
        data = path.read_bytes() if path.stat().st_size <= LARGEST else None
    except OSError as error:
        raise NotebookError(f"cannot be read: {error.strerror or error}") from None
    if data is None:
        raise NotebookError(f"too large for a notebook, which has at most {LARGEST >> 20} MB")
    try:
        cells = json.loads(data.decode("utf-8"))["cells"]
        code = [one.get("source", "") for one in cells if one.get("cell_type") == "code"]
        # A source is a text, or a list of lines.
        return ["".join(map(str, source)) for source in code]
    except UnicodeDecodeError:
        raise NotebookError("not a notebook: not UTF-8 text") from None
    except (ValueError, RecursionError):
        raise NotebookError("not a notebook: not JSON") from None
    except (AttributeError, LookupError, TypeError):
        raise NotebookError("not a notebook: it has no cells") from None


PACKAGES: Final = Path(__file__).parents[2]
"""Where this chutelab lies, for the kernel to find it too."""

LAST_WORD: Final = 5
"""s for the kernel to hand over the answers after its time is up."""

QUIET: Final = "--IPKernelApp.log_level=40"
"""Errors only: the kernel would warn of connections that never leave this machine."""

LONGEST: Final = 200
"""Characters of an error that are told."""


def run(code: Sequence[str], time_limit: float) -> tuple[list[Any], str]:
    """Run code cells in order; what raises an error does not keep the rest from running.

    Parameters
    ----------
    code : sequence of str
        The cells.
    time_limit : float
        s for all of them together, the kernel's start not counted.

    Returns
    -------
    tasks : list
        As `report` in `classroom.exercises.catalogue` gives them, unchecked: student's code ran
        there.
    trouble : str
        What went wrong first, or empty.
    """
    from nbclient.exceptions import DeadKernelError

    tasks: list[Any] = []
    trouble = ""
    # No cell before could know this name.
    name = f"application/x-chutelab-{secrets.token_hex(8)}+json"
    handing_over = (
        "import chutelab.classroom.exercises.catalogue, IPython.display\n"
        "IPython.display.publish_display_data("
        f"{{{name!r}: chutelab.classroom.exercises.catalogue.report()}})"
    )
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        client = _client(folder)
        with client.setup_kernel(cleanup_kc=True):
            deadline = monotonic() + time_limit
            place = ""
            try:
                for number, source in enumerate(code, start=1):
                    place = f"in code cell {number}"
                    outputs = _execute(client, source, deadline - monotonic())
                    if monotonic() >= deadline:
                        trouble = f"stopped after {time_limit:g} s, {place}"
                        break
                    errors = [one for one in outputs if one.output_type == "error"]
                    if errors and not trouble:
                        said = f"{errors[0].ename}: {errors[0].evalue}"[:LONGEST]
                        trouble = f"code cell {number}: {said}"
                else:
                    place = "after the last cell"
                for output in _execute(client, handing_over, LAST_WORD):
                    found = output.get("data", {}).get(name)
                    tasks = found if isinstance(found, list) else tasks
            except DeadKernelError:
                trouble = trouble or f"the kernel died {place}"
    return tasks, trouble


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


def _execute(client: NotebookClient, source: str, seconds: float) -> list[Any]:
    """Run one cell; return its outputs."""
    from nbformat.v4 import new_code_cell

    cell = new_code_cell(source)  # type: ignore[no-untyped-call]
    client.nb.cells = [cell]
    client.timeout = max(1, ceil(seconds))
    client.execute_cell(cell, 0)
    outputs: list[Any] = cell.outputs
    return outputs


@dataclass(frozen=True)
class Grade:
    """The row of one notebook; what it does not have is empty."""

    file: str  # as it was given
    student: str = ""
    lesson: str = ""
    marks: tuple[int, ...] = ()  # 1 for a right answer, 0 for any other or none, by question
    out_of: int = 0  # number of questions
    revealed: tuple[int, ...] = ()  # questions whose working was shown; they count all the same
    reason: str = ""  # what to know about this row

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
    paths
        Notebooks.
    time_limit
        s for each. One that hangs is stopped, and marked for what it had answered by then.
    progress
        Called with the share that is done, 0 to 1.

    Returns
    -------
    list of Grade
        One per path, in their order; a notebook that cannot be read, run or marked has its reason.

    Raises
    ------
    MissingLibraryError
        Without nbclient, which the extra ``notebook`` brings.
    """
    try:
        import nbclient  # noqa: F401 - with it come nbformat and jupyter_client
    except ModuleNotFoundError as error:
        message = 'grading needs nbclient: python -m pip install "chutelab[notebook]"'
        raise MissingLibraryError(message) from error
    files = [str(path) for path in paths]
    grades: list[Grade] = []
    for index, file in enumerate(files):
        if progress is not None:
            progress(index / len(files))
        row = _grade(file, time_limit)
        who = (row.lesson, plain(row.student))
        twins = [one for one in grades if row.lesson and who == (one.lesson, plain(one.student))]
        if twins:
            same = f"same lesson and student as {twins[0].file}"
            row = replace(row, reason="; ".join(filter(None, [row.reason, same])))
        grades.append(row)
    if progress is not None:
        progress(1.0)
    return grades


def write_csv(grades: Sequence[Grade], path: str | Path) -> Path:
    """Write a row per grade; the file is whole or not there."""
    most = max((len(row.marks) for row in grades), default=0)
    heads = [f"q{i + 1}" for i in range(most)]
    rows = [["file", "student", "lesson", *heads, "total", "out_of", "revealed", "reason"]]
    for row in grades:
        marks = [*map(str, row.marks), *[""] * (most - len(row.marks))]
        revealed = " ".join(map(str, row.revealed))
        cells = [row.file, row.student, row.lesson, *marks]
        rows.append([*cells, str(row.total), str(row.out_of), revealed, row.reason])
    return write_lines(path, csv_lines(rows, end="\r\n"), errors="replace")


def _grade(file: str, time_limit: float) -> Grade:
    try:
        tasks, trouble = run(code_of(Path(file)), time_limit)
    except NotebookError as error:
        return Grade(file, reason=str(error))
    except (RuntimeError, OSError) as error:
        # The kernel could not be started, or was taken away: the next one may do.
        return Grade(file, reason=f"the kernel failed: {error}")
    task, notes = _task(tasks)
    reasons = [*filter(None, [trouble]), *notes]
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
