"""`chutelab bench`: run time against error of a scene; the errors are told by formulas here."""

import csv
import json
from dataclasses import replace
from functools import partial
from math import sqrt

import numpy as np
import pytest
from PIL import Image

import shared
from chutelab.checks import workprecision as bench
from chutelab.checks.workprecision import (
    MANY_STEPS,
    METHODS,
    Stopwatch,
    Timing,
    environment,
    measure,
)
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.pictures.plots.studies import LOOKS
from chutelab.pictures.plots.studies import workprecision as draw
from chutelab.scene import load

call = partial(shared.call, "bench")


# Clocks.


@pytest.fixture
def half_seconds(monkeypatch):
    """A clock on which everything takes half a second."""
    clock = iter(np.arange(0.0, 1000.0, 0.5))
    monkeypatch.setattr(bench, "perf_counter", lambda: float(next(clock)))


@pytest.mark.usefixtures("half_seconds")
def test_repeats_end_when_patience_does():
    calls = []
    watch = Stopwatch(lambda: calls.append(1), first=7.0, patience=6.0)
    watch.repeat()
    # The first took 7 s, more than patience allows for another.
    assert (watch.times, watch.median) == ([], 7.0)
    watch = Stopwatch(lambda: calls.append(1), first=0.5, patience=1.6)
    for _ in range(9):
        watch.repeat()
    assert watch.times == [0.5, 0.5, 0.5]
    assert len(calls) == 3


# Errors.


def test_errors_are_those_of_the_flight():
    """Semi-implicit steps fall ½ g dt t too deep, and see a contact up to a step late."""
    scene = load("perpendicular")
    rows = {
        (one.method, one.value): one
        for one in measure(scene, ("exact", "contact", "fixed"), (2e-3, 1e-3), repeats=0)
    }
    assert set(rows) == {
        ("exact", None), ("contact", 2e-3), ("contact", 1e-3), ("fixed", 2e-3), ("fixed", 1e-3)
    }  # fmt: skip
    assert all(one.against == "theory" for one in rows.values())
    assert max(one.error for (method, _), one in rows.items() if method != "fixed") < 1e-12
    belt, plate, r = scene.incoming, scene.plate, scene.particle.radius
    t2 = (belt.pulley_radius + plate.distance - r) / belt.speed
    assert belt.speed > sqrt(scene.gravity * (belt.pulley_radius + r))  # it leaves at the top
    y2 = 0.5 * scene.gravity * t2**2
    for dt in (2e-3, 1e-3):
        # y2 is measured by itself or by the way to the plate, which is longer.
        size = max(y2, belt.pulley_radius + plate.distance)
        least = 0.5 * scene.gravity * dt * t2 / size
        most = least + scene.gravity * t2 * 2.0 * dt / size + 2.0 * dt / t2
        assert least < rows["fixed", dt].error < most


def test_a_planted_error_is_told(monkeypatch):
    """The engine agrees with itself; the theory has had no part in it."""

    def wrong(scene, engine=None, progress=None):
        faster = scene.with_values({"gravity": scene.gravity * 1.001, "expect": None})
        return replace(simulate(faster, engine=engine, progress=progress), machine=build(scene))

    monkeypatch.setattr(bench, "judged", wrong)
    (row,) = measure(load("perpendicular"), ("exact",), repeats=0)
    # y2 = ½ g t2², with the same t2.
    assert 1e-4 < row.error < 2e-3


def test_without_the_theory_another_engine_is_the_witness():
    rows = measure(load("belt-landing"), ("exact", "contact"), (1e-3,), repeats=0)
    assert [one.method for one in rows] == ["exact", "contact"]
    for one in rows:
        assert one.against in {"exact", "dop853", "contact", "pymunk"} - {one.method}
        assert one.error < 1e-6


def test_what_there_is_no_time_for_is_left_out():
    rows = measure(load("stream"), repeats=0, max_seconds=1e-9)
    assert [(row.method, row.value) for row in rows] == [
        ("exact", None), *((name, dt) for name in ("contact", "pymunk") for dt in MANY_STEPS)
    ]  # fmt: skip
    late = "no time is left of the 1e-09 s for all (--max-seconds)"
    assert {row.failed for row in rows} == {late}
    assert all(row.error is row.first is row.median is None for row in rows)


@pytest.mark.slow
def test_a_crowd_is_judged_as_a_whole_and_exact_cannot_run_it():
    scene = load("stream", ["stream.count=3", "run.until=landed"])
    rows = measure(scene, steps=(1e-3,), repeats=0)
    assert [one.method for one in rows] == ["exact", "contact", "pymunk"]
    assert rows[0].failed == "must be contact or pymunk, because stream.interact = true"
    assert rows[0].median is None
    assert [one.against for one in rows[1:]] == ["pymunk", "contact"]
    assert all(one.how.startswith("of the crowd as a whole") for one in rows[1:])


def test_a_run_that_misses_the_plate_has_no_figures():
    (row,) = measure(load("perpendicular"), ("fixed",), (1e-2,), repeats=1)
    assert row.failed == "pymunk and the theory differ in what happens"
    assert (row.first, row.median, row.error, row.repeats) == (None, None, None, 0)


# Pictures.

ROWS = [
    Timing("exact", median=5e-4, error=1e-14),
    *(Timing("contact", "dt", dt, median=3e-4, error=1e-13) for dt in (1e-2, 1e-3)),
    *(Timing("pymunk", "dt", dt, median=1e-5 / dt, error=2e-13) for dt in (1e-2, 1e-3)),
    *(Timing("fixed", "dt", dt, median=1e-4 / dt, error=dt) for dt in (1e-3, 1e-4)),
    *(Timing("fixed", "dt", dt, failed="it fell through, " + 20 * "so ") for dt in (1e-2, 5e-3)),
]
ABOUT = {"processor": "Some Long Processor Name 9000, 128 cores", "system": "Linux",
         "python": "CPython 3.11.7", "chutelab": "0.1.0", "numpy": "2.4.6", "pymunk": "7.3.1",
         "wasmtime": "50.0.1", "scipy": "1.17.1"}  # fmt: skip


@pytest.mark.slow
def test_the_picture_shows_every_engine_and_failure(tmp_path):
    figure = draw(ROWS, "A scene", ABOUT)
    figure.write(tmp_path / "a.png")
    (ax,) = figure.axes
    assert ax.get_title(loc="left") == "A scene"
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    lines = {line.get_gid(): line for line in ax.lines}
    assert set(lines) == set(METHODS)
    assert lines["fixed"].get_xdata().tolist() == [1e-3, 1e-4]
    (low, high), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    for line in lines.values():
        assert ((line.get_xdata() > low) & (line.get_xdata() < high)).all()
        assert ((line.get_ydata() > bottom) & (line.get_ydata() < top)).all()
    below = " ".join(figure.texts[0].get_text().split())
    assert "✕ pymunk, fixed step at dt 0.01, 0.005: it fell through" in below
    assert "128 cores · Linux · CPython 3.11.7 · chutelab 0.1.0" in below
    with Image.open(tmp_path / "a.png") as image:
        seen = np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)
    for look in LOOKS.values():
        assert (seen == [int(look["color"][k : k + 2], 16) for k in (1, 3, 5)]).all(axis=1).any()


def test_a_scene_in_which_all_fails_makes_a_picture():
    (ax,) = draw([Timing("exact", failed="no")], "A scene", ABOUT).axes
    assert not ax.lines


# The command.


def test_bench_prints_a_table_and_writes_both_files(tmp_path):
    out = tmp_path / "new" / "out"
    engines = "--engine", "exact", "--engine", "fixed", "--dt", 1e-2, "--dt", 1 / 700
    changed = "--set", "incoming.speed=2.5"
    said = call("perpendicular", *engines, *changed, "--repeats", 1, "--out", out).stdout
    assert "with incoming.speed=2.5" in said
    assert "error of exact, fixed: difference from the closed form" in said
    assert f"wrote into {out}: work-precision.tsv, work-precision.png" in said
    assert sorted(file.name for file in out.iterdir()) == [
        "work-precision.png", "work-precision.tsv"
    ]  # fmt: skip
    lines = (out / "work-precision.tsv").read_text(encoding="utf-8").splitlines()
    about = dict(line[2:].split(": ", 1) for line in lines if line.startswith("# "))
    assert about.pop("scene").endswith("with incoming.speed=2.5")
    assert about == environment()
    rows = list(csv.DictReader(lines[len(about) + 1 :], dialect="excel-tab"))
    assert [(row["method"], row["value"]) for row in rows] == [
        ("exact", ""), ("fixed", "0.01"), ("fixed", repr(1 / 700))
    ]  # fmt: skip
    assert float(rows[0]["error"]) < 1e-12


def test_bench_json(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = json.loads(call("perpendicular", "--engine", "exact", "--repeats", 1, "--json").stdout)
    assert set(said) == {"format", "scene", "environment", "records"}
    assert said["format"] == 1
    (row,) = said["records"]
    assert set(row) == set(Timing.__dataclass_fields__)
    assert row["first"] > 0.0 < row["median"]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "allowed"),
    [
        (["transfers"], "no such file, and no shipped scene of this name"),
        (["perpendicular", "--engine", "box2d"], "'exact', 'contact', 'pymunk', 'fixed'"),
        (["perpendicular", "--repeats", "0"], "1<=x<=1000"),
        (["perpendicular", "--dt", "0"], "1e-07<=x<=0.1"),
        (["perpendicular", "--out", ""], "the name of a folder is empty"),
    ],
)  # fmt: skip
def test_what_bench_cannot_use_is_refused(arguments, allowed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = call(*arguments, code=2)
    assert allowed in " ".join(result.output.split())
    assert not list(tmp_path.iterdir())


def test_an_interrupt_leaves_no_files(tmp_path, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("chutelab.pictures.plots.studies.workprecision", interrupt)
    out = tmp_path / "out"
    call("perpendicular", "--engine", "exact", "--repeats", 1, "--out", out, code=130)
    assert not list(tmp_path.iterdir())
