"""benchmarks/work_precision.py: errors against formulas written here, fits on made-up rows."""

from __future__ import annotations

import getpass
import json
import re
import socket
from dataclasses import replace
from importlib import import_module
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.util.files import tsv_text
from chutelab.util.versions import environment
from work_precision import main
from workprecision import (
    METHODS,
    Record,
    Size,
    cases,
    claims,
    from_tsv,
    measure,
    scaling,
    whole_process,
)
from workprecision.cases import (
    FRAME,
    MissedError,
    Reference,
    frames_of,
    overlaps,
    typical,
    worst,
)
from workprecision.claims import exponent, order, slope, time_at, work_slope
from workprecision.measure import COMMANDS, size, stream
from workprecision.methods import Method
from workprecision.picture import LOOKS
from workprecision.picture import scaling as draw_scaling
from workprecision.picture import workprecision as draw

G, R, RADIUS, V, EPS, MU, DROP = 9.81, 0.1, 0.004, 2.0, 0.5, 0.3, 1.0
KNOWN = cases()
# A function of the package hides this module.
MEASURE = import_module("workprecision.measure")


def one(case, method, value=None):
    """One record, as little of it as possible."""
    trial = MEASURE.Trial(KNOWN[case], METHODS[method], value, patience=0.03)
    trial.repeat()
    return trial.record()


def flight(distance, height=0.0):
    """The transfer quantities of a particle that leaves the top, `height` up in its layer."""
    assert V**2 / (G * (R + RADIUS + height)) > 1.0  # or it would not leave there
    t2 = (R + distance - RADIUS) / V
    y2 = 0.5 * G * t2**2
    down = G * t2
    fall = (R + RADIUS + height - y2) - (R - DROP + RADIUS)
    t3 = (sqrt(down**2 + 2.0 * G * fall) - down) / G
    v3x, v3y = EPS * V, down + G * t3
    return {"t2": t2, "y2": y2, "t3": t3, "x3": v3x * t3, "v3x": v3x, "v3y": v3y}


# References, against formulas.


@pytest.mark.parametrize("index", range(5))
def test_the_reference_of_a_transfer(index):
    case = KNOWN["transfer"]
    found = case.reference(case.scenes[index])
    distance = case.scenes[index].plate.distance
    expected = flight(distance)
    assert {name: float(value[0]) for name, value in found.values.items()} == pytest.approx(
        expected, rel=1e-14, abs=0.0
    )
    v2 = sqrt(V**2 + (G * expected["t2"]) ** 2)
    assert found.sizes["x3"] == pytest.approx(R + distance, rel=1e-15, abs=0.0)
    assert found.sizes["v3x"] == pytest.approx(v2, rel=1e-14, abs=0.0)
    assert found.sizes["t3"] == pytest.approx(expected["t2"] + expected["t3"], rel=1e-14, abs=0.0)


def test_the_machines_of_a_case_differ_in_where_contacts_fall():
    for name in ("transfer", "belt"):
        scenes = KNOWN[name].scenes
        for dt in (1e-2, 1e-3, 1e-4):
            late = [(flight(s.plate.distance)["t2"] + s.incoming.length / V) / dt for s in scenes]
            assert np.ptp(np.mod(late, 1.0)) > 0.3


def test_the_reference_of_a_belt_landing():
    case = KNOWN["belt"]
    found = case.reference(case.scenes[0]).values
    down = flight(0.5)
    after = -down["v3x"] + MU * down["v3y"]
    assert after < V
    assert found["t_grip"][0] == pytest.approx((V - after) / (MU * G), rel=1e-13, abs=0.0)
    assert found["x_grip"][0] == pytest.approx(
        (V**2 - after**2) / (2.0 * MU * G), rel=1e-13, abs=0.0
    )


def test_the_reference_of_a_bounce_is_the_sum_of_all_bounces():
    case = KNOWN["bounce"]
    for scene in case.scenes:
        speed = sqrt(2.0 * G * (scene.stream.at[1] - RADIUS))
        time = speed / G + sum(2.0 * speed * EPS**k / G for k in range(1, 80))
        found = case.reference(scene)
        assert found.values["t_rest"][0] == pytest.approx(time, rel=1e-14, abs=0.0)
        assert found.values["y_rest"][0] == RADIUS


def test_the_reference_of_many_is_that_of_each():
    case = KNOWN["independent"]
    found = case.reference(case.scenes[0]).values
    heights = build(case.scenes[0]).releases.position[:, 1] - R - RADIUS
    assert len(heights) == 1000
    for i in (0, 1, 499, 999):
        expected = flight(0.5, heights[i])
        assert {name: float(value[i]) for name, value in found.items()} == pytest.approx(
            expected, rel=1e-13, abs=0.0
        )


# Errors.


def test_an_error_is_the_worst_of_quantities_and_particles():
    reference = Reference(
        {"t2": np.array([2.0, 2.0]), "x3": np.array([0.1, -4.0])}, {"t2": 1.0, "x3": 0.5}
    )
    answer = {"t2": np.array([2.0, 2.002]), "x3": np.array([0.101, -4.0])}
    # 0.002 of 2 s; 0.001 m of the scale 0.5 m, which is more than 0.1 m.
    assert worst(answer, reference) == (pytest.approx(0.002, rel=1e-9), "x3")
    answer["x3"][0] = 0.1
    assert worst(answer, reference) == (pytest.approx(0.001, rel=1e-9), "t2")


def test_who_never_arrives_is_told():
    reference = Reference({"t3": np.array([1.0, 1.0])}, {"t3": 1.0})
    with pytest.raises(MissedError, match="1 of 2 never landed on the belt"):
        worst({"t3": np.array([1.0, np.nan])}, reference)


def test_overlaps_are_those_of_all_pairs():
    rng = np.random.default_rng(5)
    frames = rng.uniform(0.0, 0.1, (3, 60, 2))
    frames[1, ::2] = np.nan
    expected = []
    for frame in frames:
        for i in range(60):
            for j in range(i):
                distance = np.hypot(*(frame[i] - frame[j]))
                if distance < 2.0 * RADIUS:
                    expected.append(2.0 - distance / RADIUS)
    found = overlaps(frames, RADIUS)
    assert len(expected) > 20
    assert np.sort(found) == pytest.approx(np.sort(expected), rel=1e-12, abs=0.0)
    assert typical(np.linspace(0.0, 1.0, 101)) == pytest.approx(0.99, rel=1e-12, abs=0.0)
    assert typical(np.empty(0)) == 0.0


def test_frames_are_the_places_of_the_recording():
    recording = simulate(KNOWN["transfer"].scenes[0])
    frames = frames_of(recording)
    end = float(recording.knots["t"].max())
    assert len(frames) == round(end / FRAME)
    # On the belt at first, at 2 m/s.
    assert frames[9, 0] == pytest.approx([-1.0 + V * 10 * FRAME, R + RADIUS], abs=1e-12)
    assert frames[-1, 0] == pytest.approx(
        recording.at(min(len(frames) * FRAME, end))[0][0, 0], abs=1e-12
    )


def test_a_crowd_that_falls_through_has_failed():
    case = KNOWN["interacting"]
    frames = np.zeros((2, 3, 2))
    frames[-1, 1] = 0.0, R - DROP - 0.01
    frames[-1, 2] = np.nan
    with pytest.raises(MissedError, match="2 of 3 fell through"):
        MEASURE.judge(case, [frames], Record(case.name, "plain"))
    frames[-1, 1:] = [[0.2, 0.0], [0.2, 1.5 * RADIUS]]
    found = MEASURE.judge(case, [frames], Record(case.name, "plain"))
    # Two frames of particles in one place, and one pair half a radius too near.
    assert found.overlap == 2.0
    assert found.place == pytest.approx((0.0 + 0.2 + 0.2) / 3.0)


# Methods.


@pytest.mark.parametrize("case", ["transfer", "bounce", "belt", "independent"])
def test_exact_has_no_error_to_speak_of(case):
    found = one(case, "exact")
    assert not found.failed
    assert found.error < 1e-12
    assert found.residual < 1e-12
    assert found.parameter == ""
    assert found.memory > 1000


@pytest.mark.parametrize(
    ("case", "rtol", "bound"),
    [("transfer", 1e-10, 1e-13), ("belt", 1e-10, 1e-13), ("bounce", 1e-8, 3e-8),
     ("bounce", 1e-12, 3e-12)],
)  # fmt: skip
def test_dop853_is_as_accurate_as_it_is_asked_to_be(case, rtol, bound):
    pytest.importorskip("scipy")
    assert one(case, "dop853", rtol).error < bound


def test_dop853_solves_many_one_by_one():
    ode = pytest.importorskip("workprecision.ode")
    scene = stream("independent", 5)
    found = ode.independent(scene, 1e-9)
    assert worst(found, KNOWN["independent"].reference(scene))[0] < 1e-13


def test_plain_pymunk_is_of_first_order():
    rows = [one("transfer", "plain", dt) for dt in (2e-3, 1e-3, 5e-4)]
    assert 0.5 < order(rows, "transfer", "plain") < 1.5
    assert all(1e-4 < row.error < 3e-2 for row in rows)
    # The error of the flight alone: y comes out ½ g dt t too low.
    assert rows[1].error > 0.5 * G * 1e-3 * 0.298 / (R + 0.5179)


@pytest.mark.parametrize(("case", "dt", "bound"), [("belt", 3e-4, 1e-2), ("bounce", 1e-3, 2e-2)])
def test_plain_pymunk_gets_to_the_end(case, dt, bound):
    found = one(case, "plain", dt)
    assert not found.failed
    assert found.error < bound
    assert found.residual is None


def test_plain_pymunk_passes_the_plate_with_long_steps():
    found = one("transfer", "plain", 1e-2)
    assert found.error is None
    assert found.median is None
    assert re.fullmatch(
        r"it never (met|landed on) the (plate|belt), in [1-5] of 5 machines", found.failed
    )


def test_plain_pymunk_with_many():
    from workprecision import plain

    scene = stream("independent", 30)
    known = KNOWN["independent"].reference(scene)
    coarse, fine = (worst(plain.independent(scene, dt), known)[0] for dt in (1e-3, 2.5e-4))
    assert fine < 0.5 * coarse < 0.01
    few = stream("interacting", 30)
    run = few.run.model_copy(update={"until": 0.3})
    frames = plain.interacting(few.model_copy(update={"run": run}), 1e-3)
    assert frames.shape == (30, 30, 2)
    # Particle 0 flies off the top: x = v t.
    assert frames[-1, 0, 0] == pytest.approx(V * 0.29, abs=0.05)
    assert np.isnan(frames[0, 20]).all()


def test_aligned_steps_leave_no_error_in_a_transfer():
    found = one("transfer", "aligned", 1e-3)
    assert found.error < 1e-8


@pytest.mark.parametrize(
    ("method", "why"), [("exact", "no contacts between particles"), ("dop853", "half a million")]
)
def test_what_cannot_be_done_is_shown_as_failed(method, why):
    rows = measure(["interacting"], [method])
    assert [why in row.failed for row in rows] == [True]
    assert rows[0].error is None


def test_a_method_that_is_not_installed_is_shown(monkeypatch):
    missing = replace(METHODS["dop853"], needs="chutelab_no_such_module.ivp")
    monkeypatch.setitem(METHODS, "dop853", missing)
    rows = measure(["transfer"], ["dop853"], quick=True)
    missing = 'chutelab_no_such_module is missing: pip install "chutelab[bench]"'
    assert {row.failed for row in rows} == {missing}


def test_a_method_that_breaks_costs_nobody_else_his_row(monkeypatch):
    def run(self, case, scene, value):
        if self.name == "aligned":
            raise ZeroDivisionError("no\n  luck")
        return simulate(scene)

    monkeypatch.setattr(Method, "run", run)
    rows = measure(["transfer"], ["aligned", "exact"], quick=True)
    assert rows[0].failed == "ZeroDivisionError: no luck"
    assert rows[-1].error < 1e-12


# Clocks and memory.


def test_memory_is_the_peak_of_a_run():
    peak = MEASURE.traced(lambda: np.ones(1_000_000).sum())
    assert 8_000_000 < peak < 8_200_000


def test_mean_places_are_compared_with_the_finest_run():
    rows = [
        Record("interacting", "plain", error=0.3, place=0.45),
        Record("interacting", "fixed", error=0.1, place=0.42),
        Record("transfer", "plain", error=1e-9),
    ]
    shifts = [row.place_shift for row in MEASURE._shifted(rows)]
    assert shifts == [pytest.approx(0.03), 0.0, None]


# Lines through points.


def test_a_slope_is_the_exponent():
    x = np.array([1e-5, 1e-4, 1e-2])
    assert slope(list(zip(x, 3.0 * x**-1.5, strict=True))) == pytest.approx(
        -1.5, rel=1e-12, abs=0.0
    )
    assert slope([(1.0, 1.0)]) is None
    assert slope([(1.0, 1.0), (2.0, 5.0)]) is None
    assert slope([(0.0, 1.0), (2.0, 5.0)]) is None


def rows_of(method, law, steps=(1e-2, 1e-3, 1e-4), case="transfer"):
    """Rows of a method whose error and time follow a law of its step."""
    return [
        Record(case, method, "dt", dt, first=1.0, repeats=3, median=law(dt)[1], error=law(dt)[0])
        for dt in steps
    ]


def test_orders_and_slopes_leave_rounding_out():
    rows = rows_of("plain", lambda dt: (5.0 * dt**2, 1e-3 / dt))
    rows.append(Record("transfer", "plain", "dt", 1e-9, median=9e9, error=1e-15))
    assert order(rows, "transfer", "plain") == pytest.approx(2.0, rel=1e-12, abs=0.0)
    assert work_slope(rows, "transfer", "plain") == pytest.approx(-0.5, rel=1e-12, abs=0.0)
    assert work_slope(rows, "transfer", "fixed") is None


def test_an_exponent_is_that_of_the_large_sizes():
    counts = [1, 10, 100, 1000, 10_000, 100_000]
    sizes = [
        Size("independent", "exact", n, median=1e-6 * n**1.1 if n > 100 else 1e-3, memory=170 * n)
        for n in counts
    ]
    assert exponent(sizes, "independent", "exact") == pytest.approx(1.1, rel=1e-12, abs=0.0)
    assert exponent(sizes, "independent", "exact", "memory") == pytest.approx(
        1.0, rel=1e-12, abs=0.0
    )
    assert exponent(sizes, "interacting", "exact") is None


def test_the_time_at_an_error():
    law = [(2.0 * dt, 1e-3 / dt) for dt in (1e-2, 1e-3, 1e-4)]
    # error 2 dt and time 1e-3 / dt: time = 2e-3 / error.
    assert time_at(law, 5e-4) == pytest.approx(4.0, rel=1e-12, abs=0.0)
    assert time_at(law, 2e-4) == pytest.approx(10.0, rel=1e-12, abs=0.0)
    # A run that another beats in both does not count.
    assert time_at([*law, (1e-1, 5.0)], 5e-4) == pytest.approx(4.0, rel=1e-12, abs=0.0)
    # The fastest is accurate enough; nobody is.
    assert time_at(law, 0.5) == pytest.approx(0.1, rel=1e-12, abs=0.0)
    assert time_at(law, 1e-6) is None
    assert time_at([], 1.0) is None
    assert time_at([(1e-2, 1.0), (0.0, 2.0)], 1e-3) == pytest.approx(1.0, rel=0.01)


def test_claims_follow_from_the_rows():
    rows = [
        Record("transfer", "exact", median=5e-4, error=2e-16),
        # error dt / 5, time 4e-6 / dt: 1e-4 at dt = 5e-4, in 8 ms.
        *rows_of("plain", lambda dt: (0.2 * dt, 4e-6 / dt)),
        Record("transfer", "dop853", "rtol", 1e-9, median=7e-4, error=1e-15),
    ]
    said = {claim.sentence: claim.value for claim in claims(rows)}
    assert said == {
        "at an error of 0.0001 exact is 16 times faster than plain Pymunk: 500 µs, 8 ms":
            pytest.approx(16.0),
        "at an error of 0.0001 exact is 1.4 times faster than SciPy DOP853: 500 µs, 700 µs":
            pytest.approx(1.4),
        "exact, with an error of 2e-16, is 8.0 times faster than plain Pymunk at dt = 0.001 s,"
        " with one of 2e-04": pytest.approx(8.0),
    }  # fmt: skip


def test_claims_say_what_is_not_reached():
    rows = [
        Record("transfer", "exact", median=0.1, error=2e-16),
        *rows_of("plain", lambda dt: (10.0 * dt, 1e-6 / dt)),
    ]
    first, second = claims(rows)
    assert first.sentence == (
        "plain Pymunk does not reach an error of 0.0001: at best 1.0e-03, in 10 ms; exact does in"
        " 100 ms"
    )
    assert first.value is None
    assert "100 times slower" in second.sentence
    assert second.value == pytest.approx(0.01)
    assert claims(rows_of("plain", lambda dt: (dt, 1.0))) == []


# Files.


def test_rows_come_back_from_a_file_to_the_last_bit():
    rows = [
        Record("transfer", "plain", "dt", 1.0 / 3.0, 0.1, 9, 1e-17 / 3.0, 2.0**-52, "t2", 12345),
        Record("bounce", "exact", failed='said "no", and left'),
    ]
    about = {"processor": "Some: CPU, 2 cores", "numpy": "2.4"}
    text = tsv_text(rows, Record, about)
    assert from_tsv(text, Record) == (rows, about)
    sizes = [Size("independent", "exact", 10, 40, 0.1, 3, 0.2, 99)]
    assert from_tsv(tsv_text(sizes, Size, {}), Size) == (sizes, {})
    with pytest.raises(ValueError, match="expected the columns"):
        from_tsv(text, Size)


def test_the_environment_names_nobody():
    text = json.dumps(environment())
    assert "core" in text
    for name in (socket.gethostname(), str(Path.home()), str(Path.cwd())):
        assert name not in text
    assert getpass.getuser() not in text.split()


# The whole process, and scaling.


def test_whole_process():
    run, bare = whole_process(0)
    assert (run.method, bare.method) == tuple(COMMANDS)
    assert run.error < 1e-12
    assert bare.error is None
    assert run.median == run.first
    said = claims([replace(run, median=0.31), replace(bare, median=0.12)])
    assert [claim.value for claim in said] == [pytest.approx(0.19)]
    assert "takes 310 ms, 190 ms more than importing NumPy" in said[0].sentence


def test_a_process_that_fails_is_shown(monkeypatch):
    monkeypatch.setitem(COMMANDS, "run", ("-c", "raise SystemExit('no such thing')"))
    run, bare = whole_process(0)
    assert run.failed == "exit status 1: no such thing"
    assert run.median is None
    assert not bare.failed


def test_scaling_counts_particles_and_events():
    found = size("independent", "exact", 7, repeats=1)
    # Release, separation, impact, landing.
    assert (found.particles, found.events, found.repeats) == (7, 28, 1)
    assert found.memory > 1000


def test_scaling_measures_every_size(monkeypatch):
    monkeypatch.setitem(MEASURE.COUNTS, "independent", (1, 150, 600))
    sizes = scaling(["independent", "interacting"], ["exact"], repeats=1, quick=True)
    assert [one.particles for one in sizes] == [1, 150, 600]
    assert exponent(sizes, "independent", "exact", "memory") == pytest.approx(1.0, abs=0.2)


def test_a_size_that_breaks_is_shown(monkeypatch):
    monkeypatch.setattr(Method, "run", lambda *_: [][1])
    assert size("independent", "exact", 3).failed == "IndexError: list index out of range"


# Pictures.


def rows_for_a_picture():
    """All cases and methods, with failures and long reasons."""
    rows = []
    for case in KNOWN:
        rows += [
            Record(case, "exact", failed="no contacts between particles")
            if case == "interacting"
            else Record(case, "exact", median=5e-4, error=0.0),
            *rows_of("plain", lambda dt: (3.0 * dt, 2e-5 / dt), (1e-3, 1e-4, 1e-5), case),
            *rows_of("contact", lambda dt: (1e-8 * dt, 4e-4), (1e-2, 1e-3), case),
            *rows_of("aligned", lambda dt: (1e-9 * dt, 2e-3), (1e-2, 1e-3), case),
            *rows_of("fixed", lambda dt: (dt, 2e-4 / dt), (1e-3, 1e-4), case),
            *(
                Record(case, method, "dt", dt, failed="it never met the plate, in 5 of 5 machines")
                for method, dt in (("plain", 1e-2), ("plain", 3e-3), ("fixed", 1e-2))
            ),
            Record(case, "dop853", failed='scipy is missing: pip install "chutelab[bench]"'),
        ]
    return rows


ABOUT = {"processor": "Some Long Processor Name 9000, 128 cores", "system": "Linux",
         "python": "CPython 3.11.7", "chutelab": "0.1.0", "numpy": "2.4.6", "pymunk": "7.3.1",
         "scipy": "1.17.1"}  # fmt: skip


def test_the_picture_shows_every_method_slope_and_failure(tmp_path):
    figure = draw(rows_for_a_picture(), ABOUT)
    figure.write(tmp_path / "a.png")
    assert len(figure.axes) == len(KNOWN) + 1
    for ax, case in zip(figure.axes, KNOWN.values(), strict=False):
        assert ax.get_title(loc="left") == case.title
        assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
        lines = {line.get_gid(): line for line in ax.lines}
        assert set(lines) >= {"plain", "contact", "aligned", "fixed"}
        slopes = {t.get_gid(): t.get_text() for t in ax.texts}
        assert slopes["slope plain"] == "−1.0"
        assert slopes["slope fixed"] == "−1.0"
        failed = " ".join(slopes["failed"].split())
        assert "✕ plain Pymunk: dt 0.01, 0.003" in failed
        assert '✕ SciPy DOP853: scipy is missing: pip install "chutelab[bench]"' in failed
        low, high = ax.get_xlim()
        for line in lines.values():
            assert ((line.get_xdata() > low) & (line.get_xdata() < high)).all()
    said = next(t.get_text() for t in figure.texts if t.get_gid() == "environment")
    assert said == (
        "Some Long Processor Name 9000, 128 cores · CPython 3.11.7 · chutelab 0.1.0 · numpy 2.4.6"
        " · pymunk 7.3.1 · scipy 1.17.1"
    )
    with Image.open(tmp_path / "a.png") as image:
        assert image.size[0] == 1200
        seen = np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)
    for look in LOOKS.values():
        assert (seen == [int(look["color"][k : k + 2], 16) for k in (1, 3, 5)]).all(axis=1).any()


def test_nothing_in_the_picture_is_cut_or_covered():
    figure = draw(rows_for_a_picture(), ABOUT)
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    boxes = [(t.get_gid(), t.get_window_extent(renderer)) for t in figure.texts]
    for ax in figure.axes:
        if ax.axison:
            boxes += [
                (name, text.get_window_extent(renderer))
                for name, text in (
                    ("title", ax._left_title),
                    ("x", ax.xaxis.label),
                    ("y", ax.yaxis.label),
                    *((t.get_gid(), t) for t in ax.texts if t.get_gid() == "failed"),
                    *((f"tick {t.get_text()}", t) for t in ax.get_xticklabels()),
                    *((f"tick {t.get_text()}", t) for t in ax.get_yticklabels()),
                )
                if text.get_text()
            ]
        else:
            boxes.append(("legend", ax.get_legend().get_window_extent(renderer)))
            boxes += [("how to", t.get_window_extent(renderer)) for t in ax.texts]
    width, height = figure.canvas.get_width_height()
    for name, box in boxes:
        assert box.x0 >= 0.0 and box.y0 >= 0.0, name  # noqa: PT018
        assert box.x1 <= width and box.y1 <= height, name  # noqa: PT018
    for i, (name, box) in enumerate(boxes):
        for other, against in boxes[:i]:
            assert not box.overlaps(against), (name, other)


@pytest.mark.parametrize("names", [["transfer"], ["interacting"], ["bounce", "belt"]])
def test_some_cases_make_a_picture_too(names):
    rows = [row for row in rows_for_a_picture() if row.case in names]
    assert len(draw(rows, ABOUT).axes) == len(names) + 1


def test_a_case_in_which_all_fails_makes_a_picture():
    rows = [Record("transfer", "plain", "dt", 1e-2, failed="it never met the plate")]
    ax = draw(rows, ABOUT).axes[0]
    assert [t.get_gid() for t in ax.texts] == ["failed"]
    assert not ax.lines


def test_scaling_is_drawn_with_its_exponents(tmp_path):
    sizes = [
        Size("independent", "exact", n, 4 * n, 1.0, 3, 1e-6 * n, 170 * n) for n in (10, 1000, 10**5)
    ]
    sizes += [
        Size("interacting", m, n, 9 * n, 1.0, 3, 1e-5 * n**1.25, 900 * n)
        for m in ("contact", "fixed")
        for n in (10, 100, 1000)
    ]
    sizes.append(Size("interacting", "contact", 3000, failed="StalledError: particle 7"))
    figure = draw_scaling(sizes, ABOUT)
    figure.write(tmp_path / "s.png")
    labels = [[t.get_text() for t in ax.get_legend().get_texts()] for ax in figure.axes]
    assert labels == [
        ["exact, ∝ N$^{1.00}$"],
        ["exact, ∝ N$^{1.00}$"],
        ["pymunk, fixed step, ∝ N$^{1.25}$", "contact, ∝ N$^{1.25}$"],
        ["pymunk, fixed step, ∝ N$^{1.00}$", "contact, ∝ N$^{1.00}$"],
    ]
    assert (tmp_path / "s.png").exists()


def test_every_method_has_its_own_look():
    assert set(LOOKS) == set(METHODS)
    assert len({look["color"] for look in LOOKS.values()}) == len(METHODS)
    assert len({look["marker"] for look in LOOKS.values()}) == len(METHODS)


# The command.


@pytest.fixture(autouse=True)
def hasty(monkeypatch):
    """No measurement is repeated for long: what is measured is not looked at."""
    monkeypatch.setattr(MEASURE, "QUICK_PATIENCE", 0.02)
    monkeypatch.setattr(MEASURE, "SCALING_PATIENCE", 0.02)


def call(*arguments, code=0):
    result = CliRunner().invoke(main, [*map(str, arguments)])
    assert result.exit_code == code, result.output
    assert "Traceback" not in result.output
    return result


def test_the_script_prints_tables_and_writes_both_files(tmp_path):
    out = tmp_path / "new" / "out"
    said = call(
        "transfer", "interacting", "--quick", "--repeats", 1, "--method", "exact", "--out", out
    ).stdout
    assert "Single transfer" in said
    assert "1,000 interacting particles" in said
    assert "exact failed: no contacts between particles" in said
    assert f"wrote into {out}: work-precision.tsv, work-precision.png" in said
    assert sorted(file.name for file in out.iterdir()) == [
        "work-precision.png", "work-precision.tsv"
    ]  # fmt: skip
    rows, about = from_tsv((out / "work-precision.tsv").read_text(encoding="utf-8"), Record)
    assert [(row.case, row.method, bool(row.failed)) for row in rows] == [
        ("transfer", "exact", False),
        ("interacting", "exact", True),
    ]
    assert rows[0].error < 1e-12
    assert about == environment()


def test_the_scripts_json(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = json.loads(call("transfer", "--quick", "--repeats", 1, "--method", "exact",
                           "--method", "dop853", "--json").stdout)  # fmt: skip
    assert set(said) == {"format", "environment", "records", "claims"}
    assert [row["method"] for row in said["records"]] == ["exact", "dop853", "dop853"]
    assert set(said["records"][0]) == set(Record.__dataclass_fields__)
    assert not list(tmp_path.iterdir())


def test_the_scripts_scaling(tmp_path, monkeypatch):
    monkeypatch.setitem(MEASURE.COUNTS, "independent", (1, 10, 100))
    said = call("--scaling", "independent", "--quick", "--repeats", 1, "--out", tmp_path).stdout
    assert "Independent, exact: time ∝ N^" in said
    assert "400" in said
    assert sorted(file.name for file in tmp_path.iterdir()) == ["scaling.png", "scaling.tsv"]
    sizes, _ = from_tsv((tmp_path / "scaling.tsv").read_text(encoding="utf-8"), Size)
    assert [one.events for one in sizes] == 2 * [4, 40, 400]  # exact, contact


@pytest.mark.parametrize(
    ("arguments", "allowed"),
    [
        (["transfers"], "'transfer', 'bounce', 'belt', 'independent', 'interacting', 'process'"),
        (["--method", "box2d"], "'exact', 'contact', 'aligned', 'fixed', 'plain', 'dop853'"),
        (["--repeats", "0"], "1<=x<=1000"),
        (["--scaling", "transfer"], "independent and interacting"),
        (["--scaling", "--method", "plain"], "exact, contact, fixed"),
        (["--out", ""], "the name of a folder is empty"),
    ],
)
def test_what_the_script_cannot_use_is_refused(arguments, allowed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = call(*arguments, code=2)
    assert allowed in " ".join(result.output.split())
    assert not list(tmp_path.iterdir())
