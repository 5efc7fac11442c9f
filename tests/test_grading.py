"""Returned notebooks: run, marked anew, and never a stop."""

import asyncio
import json
import os
import resource
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep

import pytest
from click.testing import CliRunner

import chutelab
from chutelab.classroom import grading
from chutelab.classroom.exercises import EXERCISES, lesson
from chutelab.classroom.grading import LARGEST, Grade, grade, write_csv
from chutelab.classroom.kernel import Ran
from chutelab.classroom.lessons import find as find_lesson
from chutelab.cli import main
from shared import call

pytest.importorskip("nbclient")
psutil = pytest.importorskip("psutil")

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
    await NotebookClient(book, timeout=200, kernel_name="python3").async_execute()
    return {cell.id: cell for cell in book.cells}


def text_of(cell):
    return cell.outputs[-1]["data"]["text/plain"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NOTEBOOKS)
def test_notebooks_run_as_shipped_and_say_not_attempted(name, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(chutelab.__file__).parent.parent))
    # In a thread of its own: a browser that other tests have open keeps a loop in this one.
    with ThreadPoolExecutor(1) as thread:
        cells = thread.submit(asyncio.run, run_through(shipped(name))).result()
    for number in (1, 2, 3, 4):
        assert f"Question {number}: not attempted" in text_of(cells[f"answer-{number}"])
        assert "text/html" in cells[f"question-{number}"].outputs[-1]["data"]
    assert "0 of 4 done" in text_of(cells["progress"])
    steps = find_lesson(name).steps
    for n in [n for n, step in enumerate(steps, 1) if step.kind == "try"]:
        assert "application/vnd.jupyter.widget-view+json" in cells[f"step-{n}"].outputs[-1]["data"]
    for n in [n for n, step in enumerate(steps, 1) if step.kind == "note" and step.rows]:
        if any(column.value for column in steps[n - 1].columns):
            # The table, once.
            assert len(cells[f"step-{n}"].outputs) == 1
            assert steps[n - 1].rows[0].head[-3:] in text_of(cells[f"step-{n}"])


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_every_solved_notebook_earns_full_marks(name, tmp_path):
    path = tmp_path / f"{name}.ipynb"
    path.write_text(json.dumps(solved(name, "Ada Lovelace")), encoding="utf-8")
    assert list(grade([path])) == [
        Grade(str(path), "Ada Lovelace", name, marks=(1, 1, 1, 1), out_of=4, reason="")
    ]


def test_what_is_written_in_words_is_collected(tmp_path, monkeypatch):
    report = [one(student="Ada", answers={"1": -first_of("Ada")})]
    monkeypatch.setattr(grading, "run", lambda *_: Ran(report, ""))
    path = saved(tmp_path, "words.ipynb")
    found = json.loads(path.read_text(encoding="utf-8"))
    (cell,) = [one for one in shipped("the-bounce")["cells"] if one["id"] == "explanation"]
    for added, words in (([], {}), (["\nIt only ", "pushes."], {"explain": "It only pushes."})):
        written = {**cell, "source": [*cell["source"], *added]}
        path.write_text(json.dumps({**found, "cells": [*found["cells"], written]}))
        (row,) = grade([path])
        assert row.words == words
        assert row.mistakes == {1: "sign or direction"}


def first_of(student):
    """The right answer to question 1 of lesson 3."""
    given = lesson("the-bounce", student).given
    return -given.e * given.v0


def checked(student):
    """A cell in which it is checked."""
    return f"task.check(1, {first_of(student)})"


def gone(pid):
    """Whether a process is over, at the latest in a while."""
    until = monotonic() + 20.0
    while monotonic() < until:
        if not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE:
            return True
        sleep(0.02)
    return False


@pytest.fixture
def in_own_tmp(tmp_path, monkeypatch):
    """Temporary folders are made in here, and none is left."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    yield
    until = monotonic() + 20.0
    while list(folder.iterdir()) and monotonic() < until:
        sleep(0.02)
    assert list(folder.iterdir()) == []


@pytest.mark.slow
def test_a_class_is_graded_whatever_comes_back(tmp_path, in_own_tmp):
    files = [
        # Cells renamed, lost and broken: what was checked counts.
        saved(
            tmp_path, "broken.ipynb", OPEN.format("Bo").replace("task =", "mine ="), None, 5,
            [1, "x"], "x = '\ud800'", "import nothing_like_that", "this is no Python",
            "%matplotlib inline", "exit()", "import asyncio\nawait asyncio.sleep(0)",
            f"mine.check(2, 1.0)\n{checked('Bo')}".replace("task", "mine"),
            "mine.reveal(2)\nmine.check(2, 'one')", "input('and now?')",
        ),
        # Printed praise and a bent check earn nothing.
        saved(
            tmp_path, "cheat.ipynb", OPEN.format("Cy"),
            "from chutelab.classroom.exercises import Task\n"
            "old = Task.check\n"
            "Task.check = lambda self, n, x: (old(self, n, x), print('right'))[0]\n"
            "for n in (1, 2, 3, 4): task.check(n, 123.0)\n"
            "task.progress = lambda: '4 of 4 done'\n"
            "print('{\"marks\": [1, 1, 1, 1]}')",
        ),
        saved(tmp_path, "twin.ipynb", OPEN.format(" bo "), checked("bo")),
        saved(tmp_path, "unnamed.ipynb", OPEN.format("your name"), "import os; os._exit(1)"),
        saved(tmp_path, "empty.ipynb", "1 + 1"),
        tmp_path / "not-there.ipynb",
        tmp_path / "no-notebook.ipynb",
        tmp_path / "endless.ipynb",
        tmp_path / "pipe.ipynb",
        tmp_path / "large.ipynb",
        tmp_path,
    ]  # fmt: skip
    (tmp_path / "no-notebook.ipynb").write_text("# my homework", encoding="utf-8")
    (tmp_path / "endless.ipynb").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe.ipynb")
    with (tmp_path / "large.ipynb").open("wb") as large:
        large.truncate(LARGEST + 1)
    rows = {Path(row.file).name: row for row in grade(files, 30.0)}
    broken = rows["broken.ipynb"]
    assert (broken.student, broken.lesson, broken.marks) == ("Bo", "the-bounce", (1, 0, 0, 0))
    assert (broken.total, broken.out_of, broken.revealed) == (1, 4, (2,))
    assert broken.reason == "code cell 2: TypeError: its source is no text"
    assert (rows["cheat.ipynb"].marks, rows["cheat.ipynb"].reason) == ((0, 0, 0, 0), "")
    assert rows["twin.ipynb"].marks == (1, 0, 0, 0)
    assert rows["twin.ipynb"].reason == f"same lesson and student as {files[0]}"
    unnamed = "the kernel died in code cell 2; the name was left at 'your name'"
    assert rows["unnamed.ipynb"].reason == unnamed
    assert rows["empty.ipynb"].reason.startswith("no exercise was opened")
    reasons = {
        "not-there.ipynb": "cannot be read: No such file or directory",
        "no-notebook.ipynb": "not a notebook: not JSON",
        "endless.ipynb": "not a notebook: not a regular file",
        "pipe.ipynb": "not a notebook: not a regular file",
        "large.ipynb": "too large for a notebook, which has at most 25 MB",
        tmp_path.name: "not a notebook: not a regular file",
    }
    assert {name: rows[name].reason for name in reasons} == reasons
    for name in ("empty.ipynb", *reasons):
        assert (rows[name].marks, rows[name].out_of) == ((), 0)


@pytest.mark.slow
def test_the_table_marks_working_that_was_shown_and_others_right_answers(tmp_path, monkeypatch):
    monkeypatch.setattr(grading, "run", lambda cells, _: Ran(json.loads(cells[0]), ""))
    monkeypatch.setattr(grading, "_drawn", lambda _: ())
    for student, whose, revealed in (
        ("Ada", "Ada", [2]), ("Ben", "Ada", []), ("Cora", "Dan", []), ("Dan", "Dan", []),
    ):  # fmt: skip
        report = one(student=student, answers={"1": first_of(whose)}, revealed=revealed)
        saved(tmp_path, f"{student.lower()}.ipynb", json.dumps([report]))
    reasons = [row.reason for row in grade(sorted(tmp_path.glob("*.ipynb")))]
    assert [reason.partition(" (by chance: ")[0] for reason in reasons] == [
        "",
        "answers 1 are right for the numbers of Ada",
        "",
        f"answers 1 of {tmp_path / 'cora.ipynb'} are right for these numbers",
    ]
    shown = CliRunner().invoke(main, ["lesson", "grade", str(tmp_path / "ada.ipynb")])
    assert "*: working shown" in shown.output
    assert "1 of 4 (1 0* 0 0)" in shown.output


def test_what_hangs_and_prints_is_stopped_and_marked_for_what_it_had(tmp_path, in_own_tmp):
    flood = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
    flood += f"{checked('Di')}\nwhile True: print('x' * 1_000_000)"
    hung = saved(tmp_path, "hung.ipynb", OPEN.format("Di"), flood, "1 / 0")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    [row] = grade([hung], time_limit=2.0)
    assert (row.marks, row.reason) == ((1, 0, 0, 0), "stopped after 2 s, in code cell 2")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000


@pytest.mark.parametrize(
    ("sent", "remark"),
    [
        pytest.param("SIGTERM", "it sent its parent process a signal", marks=pytest.mark.slow),
        ("SIGKILL", "the kernel died in code cell 3"),
        pytest.param("SIGSTOP", "", marks=pytest.mark.slow),
    ],
)
def test_a_notebook_ends_with_all_it_started_whatever_it_does_to_its_parent(
    tmp_path, in_own_tmp, sent, remark
):
    pids = tmp_path / "pids"
    start = (
        "import os, signal, subprocess\nfrom pathlib import Path\n"
        "child = subprocess.Popen(['sleep', '600'], start_new_session=True)\n"
        f"Path({str(pids)!r}).write_text(str(child.pid))\n"
        f"os.kill(os.getppid(), signal.{sent})\n"
        "import time; time.sleep(0.5)"
    )
    bad = saved(tmp_path, "bad.ipynb", OPEN.format("Ed"), checked("Ed"), start)
    [row] = grade([bad], time_limit=20.0)
    assert (row.marks, row.reason) == ((1, 0, 0, 0), remark)
    assert gone(int(pids.read_text()))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cell", "remark"),
    [
        ("x = bytearray(2 << 30)", "code cell 3: MemoryError"),
        (
            "import os, time\n"
            "for _ in range(4):\n"
            "    if os.fork() == 0:\n"
            "        x = b'x' * (600 << 20)\n"
            "        time.sleep(60)\n"
            "time.sleep(60)",
            "the kernel died in code cell 3; it took more than 1536 MB of memory",
        ),
        (
            "import subprocess, time\n"
            "for _ in range(80): subprocess.Popen(['sleep', '60'])\n"
            "time.sleep(60)",
            "the kernel died in code cell 3; it started more than 64 processes",
        ),
        ("import os\nfor _ in range(1500): os.mkdir('x'); os.chdir('x')\nos.chmod('.', 0)", ""),
        ("10 ** 10 ** 10", "stopped after 10 s, in code cell 3"),
    ],
)
def test_what_takes_too_much_is_stopped(tmp_path, in_own_tmp, cell, remark):
    bad = saved(tmp_path, "bad.ipynb", OPEN.format("Gus"), checked("Gus"), cell)
    [row] = grade([bad], time_limit=10.0)
    assert (row.marks, row.reason) == ((1, 0, 0, 0), remark)


def one(**changes):
    return {
        "lesson": "the-bounce", "student": "Hal", "answers": {"1": 1.0}, "revealed": [], **changes
    }  # fmt: skip


@pytest.mark.parametrize(
    "report",
    [
        # Sizes.
        [one(student=f"s{i}") for i in range(20_000)],
        [one(student=f"s{i}") for i in range(65)],
        [one(student="x" * 201)],
        # Shapes.
        {},
        [5],
        [one(student="")],
        [one(lesson="no-such")],
        [one(lesson=["the-bounce"])],
        [one(answers=[1.0])],
        [one(answers={"5": 1.0})],
        [one(answers={"1": True})],
        [one(answers={"1": "1.0"})],
        [one(answers={"1": 10**400})],
        [one(answers={"1": float("nan")})],  # a task takes no such answer
        [one(revealed=[True])],
        [one(revealed=[[1]])],
        [one(revealed=list(range(1000)))],
    ],
)
def test_a_forged_report_is_refused(monkeypatch, tmp_path, report):
    monkeypatch.setattr(grading, "run", lambda *_: Ran(report, "a trouble"))
    [row] = grade([saved(tmp_path, "forged.ipynb")])
    assert (row.student, row.marks) == ("", ())
    assert row.reason.startswith("refused: its report")


@pytest.mark.parametrize(
    "said",
    [
        "b'x' * 10_000_000",
        *(
            pytest.param(one, marks=pytest.mark.slow)
            for one in ("b'[' * 100_000 + b'\\n'", "b'5\\n'")
        ),
    ],
)
def test_what_a_notebook_says_in_place_of_its_kernel_is_refused(tmp_path, in_own_tmp, said):
    pipes = (
        "import os\nfor one in range(3, 50):\n    try: os.write(one, {})\n    except OSError: pass"
    )
    [row] = grade([saved(tmp_path, "x.ipynb", OPEN.format("Ida"), pipes.format(said))], 20.0)
    assert (row.marks, row.reason) == ((), "refused: its kernel said what no chutelab says")


HEAD = (
    "\ufefffile,student,lesson,q1,q2,q3,q4,total,out_of,revealed,reason,"
    "answer1,answer2,answer3,answer4,mistakes,tries,hints\r\n"
)


def test_the_csv_has_a_row_each_and_no_formula(tmp_path):
    grades = [
        Grade(
            "\ud800.ipynb",
            "=HYPERLINK(1)",
            "landing",
            (1, 0, 1, 1),
            4,
            (2, 3),
            "late, but good",
            answers={1: -0.5, 2: 3.0},
            mistakes={2: "a missing ½"},
            tries={1: 2, 2: 1},
            hints={2: 3},
        ),
        Grade("b.ipynb", reason="not a notebook: not JSON"),
        Grade("c.ipynb", "a;=1+1"),
    ]
    path = write_csv(grades, tmp_path / "class.csv")
    assert path.read_bytes().decode() == HEAD + (
        '?.ipynb,\'=HYPERLINK(1),landing,1,0,1,1,3,4,2 3,"late, but good",'
        "-0.5,3.0,,,2: a missing ½,3,3\r\n"
        "b.ipynb,,,,,,,0,0,,not a notebook: not JSON,,,,,,0,0\r\n"
        "c.ipynb,a;'=1+1,,,,,,0,0,,,,,,,,0,0\r\n"
    )
    german = write_csv(grades, tmp_path / "class.csv", decimal_comma=True)
    first = german.read_text(encoding="utf-8-sig").splitlines()[1]
    assert first.endswith(";2 3;late, but good;-0,5;3,0;;;2: a missing ½;3;3")
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(OSError, match="nowhere"):
        write_csv(grades, tmp_path / "nowhere" / "class.csv")


def test_rows_are_on_the_disk_as_they_come_and_a_full_one_tears_none(tmp_path):
    path, part = tmp_path / "class.csv", tmp_path / "class.csv.part"
    path.write_text("what was there before", encoding="utf-8")
    row = Grade("a.ipynb", "Ada", "landing", (1, 0, 1, 1), 4)
    written = HEAD + "a.ipynb,Ada,landing,1,0,1,1,3,4,,,,,,,,0,0\r\n"
    seen = []

    def rows():
        yield Grade("b.ipynb", reason="nothing")
        yield row
        seen.append(part.read_bytes().decode())
        yield replace(row, reason="x" * 2000)

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(OSError, match="too large"):
            write_csv(rows(), path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert seen == [written.replace("\na", "\nb.ipynb,,,,,,,0,0,,nothing,,,,,,0,0\r\na")]
    assert part.read_bytes().decode() == seen[0]
    assert path.read_text(encoding="utf-8") == "what was there before"
    # A second call does not write over it.
    with pytest.raises(FileExistsError):
        write_csv([row], path)
    part.unlink()
    assert write_csv([row], path).read_bytes().decode() == written


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sent", "code"),
    [
        (signal.SIGTERM, 143),
        pytest.param(signal.SIGKILL, -signal.SIGKILL, marks=pytest.mark.slow),
        pytest.param(signal.SIGINT, 130, marks=pytest.mark.slow),
    ],
)
def test_whatever_ends_the_grading_keeps_the_marks_so_far(tmp_path, in_own_tmp, sent, code):
    pids = tmp_path / "pids"
    hangs = (
        "import os, subprocess\n"
        "child = subprocess.Popen(['sleep', '600'], start_new_session=True)\n"
        f"open({str(pids)!r}, 'w').write(f'{{os.getpid()}} {{os.getppid()}} {{child.pid}}\\n')\n"
        "while True: pass"
    )
    saved(tmp_path, "1.ipynb", OPEN.format("Kim"), checked("Kim"))
    saved(tmp_path, "2.ipynb", OPEN.format("Lee"), hangs)
    with subprocess.Popen(
        [sys.executable, "-m", "chutelab", "lesson", "grade", ".", "--out", "class.csv"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(chutelab.__file__).parent.parent)},
    ) as process:
        until = monotonic() + 60.0
        while not (pids.exists() and pids.read_text().endswith("\n")) and monotonic() < until:
            sleep(0.02)
        process.send_signal(sent)
        out, said = process.communicate(timeout=60.0)
    assert process.returncode == code
    kept = (tmp_path / "class.csv.part").read_bytes().decode()
    answer = kept.rpartition(",,,,,")[0].rpartition(",")[2]
    row = f"1.ipynb,Kim,the-bounce,1,0,0,0,1,4,,,{answer},,,,,1,0\r\n"
    assert kept == HEAD + row
    if sent != signal.SIGKILL:
        assert "1 of 4 (1 0 0 0)" in out
        assert said.startswith("the marks of 1 of 2 files are in class.csv.part\n")
        assert "Traceback" not in said
    assert all(map(gone, map(int, pids.read_text().split())))
    names = ["1.ipynb", "2.ipynb", "class.csv.part", "pids", "temporary"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names


def test_no_marks_and_no_notebook_are_written_over(tmp_path):
    book = saved(tmp_path, "1.ipynb", OPEN.format("Max"))
    before = book.read_bytes()
    refused = CliRunner().invoke(main, ["lesson", "grade", str(tmp_path), "--out", str(book)])
    assert (refused.exit_code, book.read_bytes()) == (2, before)
    assert "one of the files that were returned" in refused.stderr
    longest = str(tmp_path / ("x" * 252))  # one more than leaves room for .part
    refused = call("lesson", "grade", str(tmp_path), "--out", longest, code=2)
    assert "name too long" in refused.stderr
    (tmp_path / "class.csv.part").write_text("marks", encoding="utf-8")
    out = ["--out", str(tmp_path / "class.csv")]
    refused = call("lesson", "grade", str(tmp_path), *out, code=2)
    assert "class.csv.part" in refused.stderr
    assert (tmp_path / "class.csv.part").read_text(encoding="utf-8") == "marks"
