"""Returned notebooks: run, marked anew, and never a stop."""

from __future__ import annotations

import asyncio
import csv
import json
from pathlib import Path

import pytest

import chutelab
from chutelab.classroom.exercises import EXERCISES, lesson
from chutelab.classroom.grading import Grade, grade, write_csv

pytest.importorskip("nbclient")

SOLUTIONS = Path(__file__).parent / "solutions"
LESSONS = Path(__file__).parent.parent / "lessons"
OPEN = 'from chutelab.classroom.exercises import lesson\ntask = lesson("the-bounce", student="{}")'
NOTEBOOKS = [
    name if name == "the-bounce" else pytest.param(name, marks=pytest.mark.slow)
    for name in EXERCISES
]

# What jupyter's own packages warn of when they are imported or closed is not ours to mend.
pytestmark = pytest.mark.filterwarnings("default")


def shipped(name):
    path = LESSONS / f"{EXERCISES[name].number:02}-{name}" / "exercise.ipynb"
    return json.loads(path.read_text(encoding="utf-8"))


def solved(name, student):
    """The shipped notebook as a student returns it: a name, and a number in every answer cell."""
    found = shipped(name)
    code = (SOLUTIONS / f"{name}.py").read_text(encoding="utf-8")
    for cell in found["cells"]:
        source = "".join(cell["source"])
        if cell["id"] == "name":
            cell["source"] = source.replace("your name", student) + "\n" + code
        if cell["id"].startswith("answer-"):
            cell["source"] = source.partition("\n")[2]
    return found


def saved(folder, name, *cells):
    """A notebook of the given code cells."""
    found = {
        "cells": [{"cell_type": "code", "source": source} for source in cells],
        "metadata": {"kernelspec": {"name": "some-other-kernel", "display_name": "x"}},
        "nbformat": 4,
        "nbformat_minor": 2,
    }
    path = folder / name
    path.write_text(json.dumps(found), encoding="utf-8")
    return path


async def run_through(found):
    """Run a notebook as a reader does, every error a failure; return its cells by id."""
    import nbformat
    from nbclient import NotebookClient

    book = nbformat.reads(json.dumps(found), 4)
    nbformat.validate(book)
    await NotebookClient(book, timeout=60, kernel_name="python3").async_execute()
    return {cell.id: cell for cell in book.cells}


def text_of(cell):
    return cell.outputs[-1]["data"]["text/plain"]


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_notebooks_run_as_shipped_and_say_not_attempted(name, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(chutelab.__file__).parent.parent))
    cells = asyncio.run(run_through(shipped(name)))
    for number in (1, 2, 3, 4):
        assert f"Question {number}: not attempted" in text_of(cells[f"answer-{number}"])
        assert "text/html" in cells[f"question-{number}"].outputs[-1]["data"]
    assert "0 of 4 done" in text_of(cells["progress"])
    assert "application/vnd.jupyter.widget-view+json" in cells["live"].outputs[-1]["data"]


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_every_solved_notebook_earns_full_marks(name, tmp_path):
    path = tmp_path / f"{name}.ipynb"
    path.write_text(json.dumps(solved(name, "Ada Lovelace")), encoding="utf-8")
    assert grade([path]) == [
        Grade(str(path), "Ada Lovelace", name, marks=(1, 1, 1, 1), out_of=4, reason="")
    ]


def test_a_class_is_graded_whatever_comes_back(tmp_path):
    given = lesson("the-bounce", "Bo").given
    first = -given.e * given.v0
    files = [
        # Cells renamed, lost and broken: what was checked counts.
        saved(
            tmp_path, "broken.ipynb", OPEN.format("Bo").replace("task =", "mine ="),
            "import nothing_like_that", "this is no Python", f"x = {first}; mine.check(1, x)",
            "mine.reveal(2)\nmine.check(2, 1.0)\nmine.check(2, 'one')", "input('and now?')",
        ),
        # Printed praise and a bent check earn nothing.
        saved(
            tmp_path, "cheat.ipynb", OPEN.format("Cy"),
            "from chutelab.classroom.exercises.catalogue import Task\n"
            "old = Task.check\n"
            "Task.check = lambda self, n, x: (old(self, n, x), print('right'))[0]\n"
            "for n in (1, 2, 3, 4): task.check(n, 123.0)\n"
            "task.progress = lambda: '4 of 4 done'\n"
            "print('{\"marks\": [1, 1, 1, 1]}')",
        ),
        saved(tmp_path, "twin.ipynb", OPEN.format(" bo "), f"task.check(1, {first})"),
        saved(tmp_path, "unnamed.ipynb", OPEN.format("your name"), "import os; os._exit(1)"),
        saved(tmp_path, "empty.ipynb", "1 + 1"),
        tmp_path / "not-there.ipynb",
        tmp_path / "no-notebook.ipynb",
    ]  # fmt: skip
    files[-1].write_text("# my homework", encoding="utf-8")
    shares = []
    rows = {Path(row.file).name: row for row in grade(files, 30.0, shares.append)}
    assert shares == sorted(shares)
    assert (shares[0], shares[-1], len(shares)) == (0.0, 1.0, len(files) + 1)
    broken = rows["broken.ipynb"]
    assert (broken.student, broken.lesson, broken.marks) == ("Bo", "the-bounce", (1, 0, 0, 0))
    assert (broken.total, broken.out_of, broken.revealed) == (1, 4, (2,))
    assert broken.reason.startswith("code cell 2: ModuleNotFoundError")
    assert (rows["cheat.ipynb"].marks, rows["cheat.ipynb"].reason) == ((0, 0, 0, 0), "")
    assert rows["twin.ipynb"].marks == (1, 0, 0, 0)
    assert rows["twin.ipynb"].reason == f"same lesson and student as {files[0]}"
    assert rows["unnamed.ipynb"].reason == "the kernel died in code cell 2"
    assert rows["empty.ipynb"].reason.startswith("no exercise was opened")
    assert rows["not-there.ipynb"].reason == "cannot be read: No such file or directory"
    assert rows["no-notebook.ipynb"].reason == "not a notebook: not JSON"
    for name in ("empty.ipynb", "not-there.ipynb", "no-notebook.ipynb"):
        assert (rows[name].marks, rows[name].out_of) == ((), 0)


def test_what_hangs_is_stopped_and_marked_for_what_it_had(tmp_path):
    given = lesson("the-bounce", "Di").given
    answer = f"task.check(1, {-given.e * given.v0})"
    hung = saved(
        tmp_path, "hung.ipynb", OPEN.format("Di"), answer, "import time\ntime.sleep(60)", "1 / 0"
    )
    [row] = grade([hung], time_limit=4.0)
    assert (row.marks, row.reason) == ((1, 0, 0, 0), "stopped after 4 s, in code cell 3")


@pytest.mark.slow
def test_what_will_not_be_interrupted_is_stopped_too(tmp_path):
    stubborn = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\nwhile True: pass"
    [row] = grade([saved(tmp_path, "stubborn.ipynb", OPEN.format("Ed"), stubborn)], time_limit=3.0)
    assert (row.marks, row.reason) == ((), "stopped after 3 s, in code cell 2")


def test_the_csv_has_a_row_each_and_no_formula(tmp_path):
    grades = [
        Grade(
            "\ud800.ipynb", "=HYPERLINK(1)", "landing", (1, 0, 1, 1), 4, (2, 3), "late, but good"
        ),
        Grade("b.ipynb", reason="not a notebook: not JSON"),
    ]
    path = write_csv(grades, tmp_path / "class.csv")
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert rows == [
        ["file", "student", "lesson", "q1", "q2", "q3", "q4", "total", "out_of", "revealed",
         "reason"],
        ["?.ipynb", "'=HYPERLINK(1)", "landing", "1", "0", "1", "1", "3", "4", "2 3",
         "late, but good"],
        ["b.ipynb", "", "", "", "", "", "", "0", "0", "", "not a notebook: not JSON"],
    ]  # fmt: skip
    with pytest.raises(OSError, match="nowhere"):
        write_csv(grades, tmp_path / "nowhere" / "class.csv")
