"""Notebooks of lessons: made of worksheet, own cells and exercise; what they call, `Book`."""

import json
import re
from math import hypot, sqrt

import pytest
from click.testing import CliRunner
from matplotlib.lines import Line2D

from chutelab.classroom.book import Book
from chutelab.classroom.grading import words_of as written_in
from chutelab.classroom.lessons import LessonError, read
from chutelab.classroom.lessons.building import build_notebook, notebook_of, start
from chutelab.classroom.lessons.sheets import sheet
from chutelab.classroom.lessons.steps import data_of, html_of
from chutelab.cli import main
from chutelab.results.quantities import measure
from chutelab.util.errors import InputError
from chutelab.util.words import LANGUAGES, words
from shared import find, lessons, some

G = 9.81
LESSONS = lessons()


def cells_of(lesson):
    text = (lesson.folder / "exercise.ipynb").read_text(encoding="utf-8")
    return {cell["id"]: "".join(cell["source"]) for cell in json.loads(text)["cells"]}


def test_a_translated_worksheet_makes_a_notebook_in_its_language():
    made = []
    for english in LESSONS:
        lesson = find(english.number, "de")
        text = notebook_of(lesson)
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
                assert source != theirs[cell["id"]] or "|" in source
                assert not re.search(r"\b(?:the|and|with|your)\b", re.sub(r"`.*?`", "", source))
        assert 'language="de"' in text.replace("\\", "")
        assert written_in(path) == {}
    assert made == [lesson.number for lesson in LESSONS]


def words_of(text):
    return " ".join(re.sub(r"[|*]", " ", text).split())


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.name)
def test_shipped_notebooks_are_what_their_lessons_make_of_them(lesson):
    shipped = (lesson.folder / "exercise.ipynb").read_bytes()
    assert shipped == notebook_of(lesson).encode(), f"run: chutelab lesson build {lesson.number}"


@pytest.mark.parametrize("lesson", some(LESSONS), ids=lambda lesson: lesson.name)
@pytest.mark.parametrize("language", LANGUAGES)
def test_page_worksheet_and_notebook_ask_the_same(lesson, language):
    """Each text, question, choice and row of each step is on all three."""
    one = find(lesson.number, language)
    paper = words_of(sheet(one, "student"))
    file = "exercise.ipynb" if language == "en" else f"exercise.{language}.ipynb"
    cells = json.loads((one.folder / file).read_text(encoding="utf-8"))["cells"]
    sources = {cell["id"]: "".join(cell["source"]) for cell in cells}
    book = words_of(" ".join(sources.values()))
    page = data_of(one.steps, tuple(one.page.live["controls"]), words(language))
    local = words(language).local
    for n, (step, told) in enumerate(zip(one.steps, page, strict=True), 1):
        asked = [step.text, *(part for ask in step.asks for part in (ask.text, *ask.choices))]
        if step.rows and not all(column.value for column in step.columns):
            asked += [local(row.head) for row in step.rows]
        for text in asked:
            # A value that stands in a text is another one on each.
            for part in re.split(r"\{(?:gravity|\w+(?:\.\w+)+)\}", text):
                assert words_of(part) in paper
                if step.kind != "numbers":
                    assert words_of(part) in book
        assert told["kind"] == step.kind
        assert [ask["text"] for ask in told["asks"]] == [
            html_of(ask.text, inline=True) for ask in step.asks
        ]
        assert [row["set"] for row in told["rows"]] == [row.set for row in step.rows]
        assert len(told["columns"]) == len(step.columns)
        if step.kind == "predict":
            given = re.search(r"\{.*\}", sources[f"step-{n}"], re.DOTALL)[0]
            assert eval(given) == dict.fromkeys(range(1, len(step.asks) + 1))
    assert "import math" in sources["machine"]


@pytest.mark.slow
def test_a_new_lesson_has_a_notebook_too(tmp_path):
    folder = start(tmp_path / "my-lesson")
    cells = cells_of(read(folder))
    assert cells["machine"].endswith('book = Book(".")\nbook.machine()')
    assert cells["step-3"] == "book.note(3)"
    assert {"step-1", "step-2", "explanation", "step-4"} <= set(cells)
    assert not {"name", "progress"} & set(cells)
    plan = (folder / "lesson.toml").read_text(encoding="utf-8")
    plan = plan.replace("Where does the particle land?", "Where will it land?")
    for big, small in (
        ("fps = 25", "fps = 10"),
        ("800", "320"),
        ("450", "180"),
        ("# slow = 8 ", "slow = 2 "),
    ):
        plan = plan.replace(big, small, 1)
    (folder / "lesson.toml").write_text(plan, encoding="utf-8")
    built = CliRunner().invoke(main, ["lesson", "build", str(folder)])
    assert "exercise.ipynb: written" in built.stdout
    assert "Where will it land?" in cells_of(read(folder))["step-1-text"]
    assert not build_notebook(read(folder)).made


def test_cells_of_its_own_stand_where_they_say(tmp_path):
    folder = start(tmp_path / "my-lesson")
    own = folder / "notebook.py"
    own.write_text(
        "# needs: notebook,fit\n\n# %% 3\nfirst = 1\n\n# %% 3\nsecond = 2\n\n"
        "# %% [markdown:en] 2\n# In *words*.\n#\n# Twice.\n\n# %% [markdown:de] 2\n# Deutsch.\n\n"
        "# %% 4\nlast = 3\n",
        encoding="utf-8",
    )
    build_notebook(read(folder))
    cells = cells_of(read(folder))
    assert [cells[name] for name in ("step-3-own-1", "step-3-own-2", "step-4-own-1")] == [
        "first = 1", "second = 2", "last = 3",
    ]  # fmt: skip
    assert cells["step-2-own-1"] == "In *words*.\n\nTwice."
    assert "Deutsch." in notebook_of(read(folder, "de"))
    assert "chutelab[notebook,fit]" in cells["title"]
    own.write_text("# %% Elsewhere\nx = 1\n", encoding="utf-8")
    with pytest.raises(LessonError, match="no place for a cell # %% Elsewhere"):
        build_notebook(read(folder))


def test_a_table_is_filled_by_its_runs_and_explained_by_what_was_expected():
    """Fall of 0.8 m from 2 and 4 m/s: √(2 h/g), v t, and Pythagoras."""
    book = Book("the-parabola")
    rows = {head: [float(cell) for cell in cells] for head, *cells in book.note(3).sheet().rows}
    for head, v, g in (("2 m/s", 2.0, G), ("4 m/s", 4.0, G), ("Moon", 2.0, 1.62)):
        t = sqrt(2.0 * 0.8 / g)
        assert rows[head] == pytest.approx([t, v * t, hypot(v, g * t)], rel=1e-5)
    assert rows["10 × mass"] == rows["2 m/s"]
    assert measure(book.noted[3][1], "landing.x") == pytest.approx(rows["4 m/s"][1], rel=1e-5)
    assert "the time of the fall" not in str(book.predict(1, {1: None}))
    assert "You expected" not in str(book.explain(4))
    assert "0.9" in str(book.predict(1, {1: 0.9, 2: 2}))
    told = str(book.explain(4))
    assert "You expected: **2** doubles. *It flies twice as far" in told
    assert "0.404 s" in told


def test_a_book_runs_what_is_said_as_on_the_command_line():
    book = Book("the-parabola")
    runs = book.run("throw.toml", "throw.toml --set incoming.speed=4 --set gravity=1.62")
    fall = sqrt(2 * 0.8 / 1.62)
    assert measure(runs[1], "flight.t") == pytest.approx(fall, rel=1e-12)
    assert "time of the fall, s" in runs._repr_html_()
    assert measure(runs[1], "landing.x") == pytest.approx(4.0 * fall, rel=1e-12)
    assert measure(runs[0], "landing.x") == pytest.approx(2.0 * sqrt(2 * 0.8 / G), rel=1e-12)
    page = runs._repr_html_()
    assert page.count("<details>") == len(runs) == 2
    assert "time of flight, from the first to the second" in page
    assert not re.search(r"engine|rounds|residual|turned over|e-1\d", page + repr(runs[0]))
    # What was not simulated is the theory's, in the same unit; of several particles there is none.
    told = (
        Book("turning-the-plate")
        .run("any-angle.toml --set run.until=0.1", "any-angle.toml --set stream.count=2")
        .sheet()
    )
    rows = {said: cells for said, *cells in told.rows}
    assert {*rows} >= {"φ2, degrees", "v2', m/s"}
    assert len(set(rows["v2', m/s"])) == 1
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
