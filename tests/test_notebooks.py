"""Notebooks of lessons: made of worksheet, own cells and exercise; what they call, `Book`."""

import json
import re
from math import atan2, degrees, sqrt

import pytest
from click.testing import CliRunner
from matplotlib.lines import Line2D

from chutelab.classroom.book import Book
from chutelab.classroom.grading import words_of as written_in
from chutelab.classroom.lessons import LessonError, read, shipped_lessons
from chutelab.classroom.lessons.building import build_notebook, notebook_of, start
from chutelab.cli import main
from chutelab.results.quantities import measure
from chutelab.util.errors import InputError

G = 9.81
LESSONS = shipped_lessons()


def cells_of(lesson):
    text = (lesson.folder / "exercise.ipynb").read_text(encoding="utf-8")
    return {cell["id"]: "".join(cell["source"]) for cell in json.loads(text)["cells"]}


def test_a_translated_worksheet_makes_a_notebook_in_its_language():
    made = []
    for english in LESSONS:
        lesson = read(english.folder, "de")
        text = notebook_of(lesson)
        assert bool(text) == ("README.de.md" not in lesson.untranslated)
        if not text:
            continue
        made.append(lesson.number)
        path = lesson.folder / "exercise.de.ipynb"
        assert path.read_bytes() == text.encode(), f"run: chutelab lesson build {lesson.number}"
        cells, theirs = json.loads(text)["cells"], cells_of(english)
        assert [cell["id"] for cell in cells] == list(theirs)
        for cell in cells:
            source = "".join(cell["source"])
            if cell["cell_type"] == "code":
                assert source.replace(', language="de"', "") == theirs[cell["id"]]
            else:
                assert source != theirs[cell["id"]]
                assert not re.search(r"\b(?:the|and|with|your)\b", re.sub(r"`.*?`", "", source))
        assert 'language="de"' in text.replace("\\", "")
        assert written_in(path) == {}
    assert {0, 1, 2, 3} <= set(made)


def words_of(text):
    return " ".join(re.sub(r"[|*]", " ", text).split())


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.name)
def test_shipped_notebooks_are_what_their_lessons_make_of_them(lesson):
    shipped = (lesson.folder / "exercise.ipynb").read_bytes()
    assert shipped == notebook_of(lesson).encode(), f"run: chutelab lesson build {lesson.number}"


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.name)
def test_worksheet_and_notebook_ask_the_same(lesson):
    """All that stands under "Predict" and "Compare" is in the notebook, and each number asked."""
    text, cells = lesson.text("README"), cells_of(lesson)
    for part in ("Predict", "Compare"):
        asked = re.search(rf"^## {part}\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)[1]
        assert words_of(asked) in words_of(cells[f"{part.lower()}-text"])
    asked = re.search(r"^## Predict\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)[1]
    numbers = re.findall(r"^(\d+)\. ", asked, re.MULTILINE)
    assert eval(cells["predict"].partition("= ")[2]) == dict.fromkeys(map(int, numbers))
    opening = re.search(r"^# .*?\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)[1]
    # Of the picture the notebook has its own.
    opening = re.sub(r"^!\[.*\]\(machine.png\)$", "", opening, flags=re.MULTILINE)
    assert words_of(opening) in words_of(cells["title"])
    assert "In a terminal" not in " ".join(cells.values())
    assert "Write a decimal point, 0.05" in cells["questions-text"]


def test_a_new_lesson_has_a_notebook_too(tmp_path):
    folder = start(tmp_path / "my-lesson")
    cells = cells_of(read(folder))
    assert cells["machine"].endswith('book = Book(".")\nbook.machine()')
    assert '"perpendicular",' in cells["run"]
    assert {"predict", "compare", "explanation", "live"} <= set(cells)
    assert not {"name", "questions-text", "progress"} & set(cells)
    readme = (folder / "README.md").read_text(encoding="utf-8")
    (folder / "README.md").write_text(readme.replace("everybody", "nobody"), encoding="utf-8")
    built = CliRunner().invoke(main, ["lesson", "build", str(folder)])
    assert "exercise.ipynb: written" in built.stdout
    assert "nobody" in cells_of(read(folder))["predict-text"]
    assert not build_notebook(read(folder)).made


def test_cells_of_its_own_stand_where_they_say(tmp_path):
    folder = start(tmp_path / "my-lesson")
    own = folder / "notebook.py"
    own.write_text(
        "# needs: notebook,fit\n\n# %% Run 1\nfirst = 1\n\n# %% Run 1\nsecond = 2\n\n"
        "# %% [markdown] Run\n# In *words*.\n#\n# Twice.\n\n# %% Compare\nlast = 3\n",
        encoding="utf-8",
    )
    build_notebook(read(folder))
    cells = cells_of(read(folder))
    assert [cells[name] for name in ("run", "run-1-own-1", "compare-own-1")] == [
        "first = 1", "second = 2", "last = 3",
    ]  # fmt: skip
    assert "In *words*.\n\nTwice." in cells.values()
    assert "chutelab[notebook,fit]" in cells["title"]
    own.write_text("# %% Elsewhere\nx = 1\n", encoding="utf-8")
    with pytest.raises(LessonError, match="no place for a cell # %% Elsewhere"):
        build_notebook(read(folder))


def test_a_book_runs_what_is_said_as_on_the_command_line():
    book = Book("the-parabola")
    runs = book.run("throw.toml", "throw.toml --set incoming.speed=4 --set gravity=1.62")
    fall = sqrt(2 * 0.8 / 1.62)
    assert measure(runs[1], "flight.t") == pytest.approx(fall, rel=1e-12)
    assert "time of the fall, from one belt to the other, s" in runs._repr_html_()
    assert measure(runs[1], "landing.x") == pytest.approx(4.0 * fall, rel=1e-12)
    assert measure(runs[0], "landing.x") == pytest.approx(2.0 * sqrt(2 * 0.8 / G), rel=1e-12)
    page = runs._repr_html_()
    assert page.count("<details>") == len(runs) == 2
    assert "time of flight, from the first to the second" in page
    assert not re.search(r"engine|rounds|residual|turned over|e-1\d", page + repr(runs[0]))
    # What was not simulated is the theory's, in the same unit; of several particles there is none.
    sheet = (
        Book("the-bounce")
        .run("perpendicular --set run.until=0.6", "perpendicular --set stream.count=2")
        .sheet()
    )
    rows = {words: cells for words, *cells in sheet.rows}
    phi2 = rows["angle between plate and velocity, before the impact, degrees"]
    expected = degrees(atan2(2.0, 0.29685 * G))
    assert [float(cell) for cell in phi2] == pytest.approx([expected, expected], rel=1e-5)
    told = str(book.compare({1: 0.4, 2: None, 3: "the same"}))
    assert "You predicted: 1. 0.4; 3. the same" in told
    assert "throw.toml --set incoming.speed=4" in told
    assert "no prediction yet" in str(Book(1).compare({1: None}))
    with pytest.raises(InputError, match="--out: a notebook knows --set"):
        book.run("throw.toml --out here")


def test_the_spread_of_a_stream_is_drawn_with_its_layers():
    book = Book("a-stream")
    runs = book.run("bed.toml", "perpendicular")
    first, single = book.landings(runs).axes
    drawn = {line.get_gid(): float(line.get_xdata()[0]) for line in first.lines}
    # Back with ε v0 while it falls from the plate, by d2 or by d2 and the bed's height.
    t2 = (0.6 - 0.0063) / 2.0
    down = G * t2
    lowest = 0.6 - 0.0063 - (sqrt(down**2 + 2 * G * 0.5) - down) / G
    highest = 0.6 - 0.0063 - (sqrt(down**2 + 2 * G * 0.55) - down) / G
    assert drawn["lowest"] == pytest.approx(lowest, rel=1e-9)
    assert highest - 1e-9 < drawn["highest"] < highest + 5e-4
    assert drawn["mean"] == pytest.approx(measure(runs[0], "landing.x.mean"))
    assert sum(bar.get_height() for bar in first.containers[0]) == 40
    assert {line.get_gid() for line in single.lines} == {"mean"}


@pytest.mark.parametrize("name", ["letting-go", "grip-or-slip"])
def test_the_picture_at_the_beginning_does_not_show_where_it_lets_go(name):
    (axes,) = Book(name).machine().axes
    drawn = {one.get_gid(): one for one in (*axes.lines, *axes.collections)}
    assert not {"track", "analytic", "strobe", "impacts"} & set(drawn)
    particle = drawn["particle 0"]
    places = particle.get_xydata() if isinstance(particle, Line2D) else particle.get_offsets()
    # On the belt, not yet on the pulley, whose axis is at x = 0 and whose radius is 0.5 m.
    assert places[0][0] < 0.0
    assert places[0][1] > 0.5
