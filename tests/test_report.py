"""Reports: the registry's numbers, whole pages, tables as CSV, and the skeleton without answers."""

import csv
import re

import numpy as np
import pytest
from click.testing import CliRunner
from pypdf import PdfReader

import chutelab
from chutelab.classroom.report import report
from chutelab.cli import main
from chutelab.util.tables import number
from shared import call


def rows_of(folder, name):
    lines = (folder / f"{name}.csv").read_text("utf-8").splitlines()
    return list(csv.reader(lines))


def test_a_particle_has_two_pages_with_the_numbers_of_its_run(tmp_path):
    out = tmp_path / "report.pdf"
    call("report", "inclined-40", "-o", str(out))
    pages = [page.extract_text() for page in PdfReader(out).pages]
    assert len(pages) == 2
    text = "\n".join(pages)
    heads = ("The machine", "Inputs", "Assumptions, and what is left out", "Results", "Sensitivity",
             "Beside the theory", "Loads", "Power at the loading point", "Wear",
             "How to make it again")  # fmt: skip
    assert all(f"{head}\n" in text for head in heads)
    run = chutelab.simulate("inclined-40", loads=0.01)
    results = {row[0]: row[2] for row in rows_of(tmp_path / "report-tables", "results")[1:]}
    for name in ("landing.x", "landing.vx", "ledger.power", "ledger.restitution_loss"):
        assert results[name] == number(run.measure(name))
        assert results[name] in text
    worn = {row[0]: row for row in rows_of(tmp_path / "report-tables", "wear")[1:]}
    assert worn["plate"][3] == number(run.measure("wear.plate.erosion.sum"))
    assert "chutelab report inclined-40 -o report.pdf" in re.sub(r"\s+", " ", text)


def test_power_is_that_of_iso_5048():
    """F = ṁ (v - v₀), l = |v² - v₀²| / (2 g µ), P = F v, of 8 g at the scene's rate."""
    made = report("inclined-40")
    run = made.recording
    flow, v0, v = 0.008 * run.machine.scenes.rate, run.measure("landing.vx"), 2.0
    mu = run.scene.met(run.scene.kinds[0], "outgoing")[1]
    told = {row[0].split(" ")[0]: row[1] for row in made.tables["power"].rows}
    assert told["force"] == number(flow * (v - v0))
    assert told["acceleration"] == number((v * v - v0 * v0) / (2 * 9.81 * mu))
    assert [row[1] for row in made.tables["power"].rows if row[0] == "power F v"] == [
        number(flow * (v - v0) * v)
    ]


def test_sensitivities_are_differences_of_two_runs():
    made = report("inclined-40")
    (row,) = [row for row in made.tables["sensitivity"].rows if row[0].startswith("incoming.speed")]
    low, high = (
        chutelab.simulate("inclined-40", {"incoming.speed": speed}).measure("landing.x")
        for speed in (1.98, 2.02)
    )
    assert row[1] == f"{(high - low) / 2:.3g}"
    # The place of landing does not depend on how the drop changes the time on the belt.
    assert row[0] == "incoming.speed + 0.02"


@pytest.mark.slow
def test_a_stream_has_its_envelope_and_error_bars(tmp_path):
    made = report("stream", {"stream.count": 12}, runs=2)
    assert {"machine", "stream", "loads", "wear"} <= made.pictures.keys()
    values = [made.repeats.values["landing.x.mean"]]
    told = {row[0]: row[2] for row in made.tables["results"].rows}["landing.x.mean"]
    mean, error = np.mean(values), np.std(values, ddof=1) / np.sqrt(2)
    assert "±" in told
    shown, off = (float(part) for part in told.split("±"))
    assert shown == pytest.approx(mean, abs=error)
    assert off == pytest.approx(error, rel=0.1)
    assert "2 seeds" in made.markdown
    page = tmp_path / "report.html"
    made.write(page)
    text = page.read_text("utf-8")
    assert text.count("data:image/png;base64") == len(made.pictures)
    assert "<h2>The stream</h2>" in text


@pytest.mark.slow
def test_a_web_page_cuts_no_table_off(opened, tmp_path):
    report("coal-transfer", {"stream.count": 20}).write(tmp_path / "report.html")
    page = opened(tmp_path / "report.html")
    wide = page.evaluate("[...document.querySelectorAll('table')].map("
                         "(one) => one.scrollWidth - one.clientWidth)")  # fmt: skip
    assert len(wide) == 9
    assert max(wide) == 0
    inputs = page.locator("table").first.inner_text()
    assert "stream.rate\t800 t/h\t–" in inputs
    assert "stream.interact\ttrue\t–" in inputs


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["stream", "coal-transfer"])
def test_a_shipped_stream_has_four_pages(scene, tmp_path):
    made = report(scene, command=f"chutelab report {scene} -o report.pdf")
    made.write(tmp_path / "report.pdf")
    assert len(PdfReader(tmp_path / "report.pdf").pages) == 4


def test_the_skeleton_asks_and_has_no_answer(tmp_path):
    made = report("perpendicular", view="teacher")
    run = made.recording
    for name in ("landing.x", "landing.vx", "ledger.power"):
        assert number(run.measure(name)) not in made.markdown.split("## Values")[1]
    assert all(row[1:] == ("", "", "", "") for row in made.tables["values"].rows)
    assert [head for head in ("Hypothesis", "hypothesis", "Conclusion") if head in made.markdown]
    made.write(tmp_path / "lab.pdf")
    pages = [page.extract_text() for page in PdfReader(tmp_path / "lab.pdf").pages]
    assert len(pages) == 2
    assert "What is the answer to your question?" in pages[1]


@pytest.mark.parametrize("scene", ["perpendicular", "stream"])
def test_the_skeleton_in_german_has_no_english_left(scene, tmp_path):
    changes = {"stream.count": 20} if scene == "stream" else {}
    made = report(scene, changes, view="teacher", language="de")
    english = report(scene, changes, view="teacher").markdown
    # What stands in both: keys of the scene, names and units of quantities.
    both = {line for line in made.markdown.splitlines() if line} & set(english.splitlines())
    assert all(re.match(r"\||!\[", line) for line in both), both
    for words in (" the ", "scene file", "default", "bounces"):
        assert words in english
        assert words not in made.markdown
    out = tmp_path / "lab.html"
    called = ["report", scene, "--view", "teacher", "--language", "de", "-o", str(out)]
    assert CliRunner().invoke(main, called).exit_code == 0
    page = out.read_text("utf-8")
    assert '<html lang="de">' in page
    assert "Wie lautet die Antwort auf deine Frage?" in page


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["report", "slip", "-o", "report.txt"], "give a name that ends in .pdf or .html"),
        (["report", "slip"], "Missing option '-o'"),
        (["report", "slop", "-o", "report.pdf"], "slop"),
        (["report", "stream", "-o", "report.pdf", "--repeat", "0"], "0 is not in the range"),
        (["report", "slip", "-o", "report.pdf", "--view", "boss"], "is not one of"),
        (["report", "slip", "-o", "report.pdf", "--language", "de"], "is for --view teacher"),
        (["report", "slip", "-o", "no/such/report.pdf"], "there is no folder no/such"),
    ],
)
def test_bad_calls_are_refused_and_leave_nothing(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = call(*arguments, code=2)
    assert said in result.output
    assert not list(tmp_path.iterdir())
