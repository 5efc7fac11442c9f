"""Tables that read well in a terminal and in a notebook."""

import io
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from rich.console import Console

import chutelab
from chutelab import theory
from chutelab.results.ledger import ledger
from chutelab.util.tables import Sheet, plain

SHEET = Sheet(
    "What & where",
    ("name", "unit", "value"),
    (("x", "m", "1.25"), ("a<b", "", "-10")),
    foot=(("sum", "", "-8.75"),),
    texts=2,
    notes=("x " * 60,),
)


def rows_of(html):
    """Return the cells of an HTML table; a tag that is not closed raises."""
    rows = ET.fromstring(html).iter("tr")
    return [["".join(cell.itertext()) for cell in row] for row in rows]


def test_text_is_aligned_words_left_and_numbers_right():
    assert str(SHEET).splitlines()[:7] == [
        "What & where",
        "name  unit  value",
        "─────────────────",
        "x     m      1.25",
        "a<b           -10",
        "",
        "sum         -8.75",
    ]
    notes = str(SHEET).splitlines()[8:]
    assert len(notes) == 2
    assert max(map(len, notes)) <= 80


def test_html_has_the_same_cells_escaped():
    text = SHEET._repr_html_()
    # No notebook is to take what is between dollar signs for mathematics.
    assert text.startswith('<div class="tex2jax_ignore mathjax_ignore">')
    assert "a&lt;b" in text
    assert "What &amp; where" in text
    assert rows_of(text) == [list(SHEET.columns), *map(list, SHEET.rows + SHEET.foot)]
    assert text.count("text-align:right") == 4  # the head and three numbers


@pytest.fixture(scope="module")
def recording():
    return chutelab.simulate(chutelab.load("perpendicular", ["stream.count=3"]))


def test_a_recording_says_what_it_holds(recording):
    rows = dict(recording.sheet().rows)
    assert not {"engine", "knots", "run time"} & set(rows)
    details = dict(recording.sheet(details=True).rows)
    assert details.items() >= rows.items()
    assert details["engine"] == "exact"
    assert rows["particles"] == "3"
    assert rows["events"] == "3 release, 3 separation, 3 impact, 3 landing"
    assert rows["ended"] == "3 landed"
    # Belt 1 m at 2 m/s, 0.29685 s to the plate, then 1 m of fall in all; two more, 5 ms apart.
    assert rows["time"] == "0 to 0.945955 s"
    assert repr(recording).startswith("Perpendicular damping plate, 2 m/s\nparticles  3\n")


def test_a_comparison_shows_what_one_of_the_two_has(recording):
    rows = {row[0]: row[1:] for row in chutelab.compare(recording).sheet().rows}
    assert rows["x2"][:3] == ("distance forward to the plate, m", "0.5937", "0.5937")
    # tan φ2 = v0 / (g t2)
    angle = f"{np.degrees(np.arctan(2.0 / (9.81 * 0.29685))):.4f}"
    assert rows["phi2"][:3] == ("angle to the plate, before, °", angle, angle)
    assert rows["belt_work"][1] == "-"
    assert rows["belt_work"][3] == ""
    missed = chutelab.simulate(chutelab.load("free-fall"))
    told = chutelab.compare(missed).sheet()
    assert (told.rows, told.foot) == ((), ())
    assert told.notes[0].startswith("No closed form; ")


def test_a_ledger_closes_in_its_own_table(recording):
    sheet = ledger(recording).sheet()
    numbers = [[float(cell) for cell in row[1:]] for row in sheet.rows]
    total = [float(cell) for cell in sheet.foot[0][1:]]
    assert [sum(column) for column in zip(*numbers, strict=True)] == pytest.approx(total, rel=1e-5)
    assert sheet.notes[-1].endswith("cannot explain: 0.000 %")
    assert ledger(recording).sheet(details=True).notes[-1].startswith("residual ")


def test_the_papers_tables_mark_what_differs():
    sheet = theory.table(1, "corrected").sheet()
    assert sum(cell.endswith("*") for row in sheet.rows for cell in row) == 22
    assert sheet.notes[0] == "22 of 88 cells differ in a printed digit."
    assert len(rows_of(theory.table(3)._repr_html_())) == 3


def test_json_has_lists_for_arrays_and_null_for_what_is_not_finite():
    found = plain({"sheet": replace(SHEET, notes=()), "x": np.array([[1.0, np.inf]]), "n": None})
    assert found["x"] == [[1.0, None]]
    assert found["n"] is None
    assert found["sheet"]["columns"] == ["name", "unit", "value"]
    assert plain(np.float64(np.nan)) is None


def test_a_row_of_one_cell_is_a_heading_and_columns_stay_below_each_other():
    rows = (("first",), ("a", "1.25", "ok"), ("second",), ("longer", "10", "FAILED"))
    sheet = Sheet("", ("", "value", ""), rows, tail=1)
    head, _, *body = str(sheet).splitlines()
    assert head.index("value") + 5 == body[1].index("1.25") + 4 == body[3].index("10") + 2
    assert body == ["first", "  a        1.25  ok", "second", "  longer     10  FAILED"]
    assert '<th colspan="3" style="text-align:left">second</th>' in sheet._repr_html_()
    terminal = Console(file=io.StringIO(), force_terminal=True, color_system="standard")
    terminal.print(sheet)
    assert "\x1b[1;31mlonger" in terminal.file.getvalue()
    assert "\x1b[32mok" in terminal.file.getvalue()
