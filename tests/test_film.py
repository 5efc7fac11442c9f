"""Lesson 0: the track is what it says it is, and fits find what the explanation says."""

import re
from math import pi, sqrt

import numpy as np
import pytest

from chutelab.classroom.lessons import scene_of
from chutelab.classroom.lessons.sheets import sheet
from chutelab.classroom.lessons.texts import without_tex
from chutelab.engines.simulation import simulate
from chutelab.studies import measured
from shared import find, some

TRUTH = {"surface.table.restitution": 0.8, "gravity": 9.81}
KEYS = ["gravity", "surface.table.restitution", "t0"]
RADIUS = 0.02  # m
FRAMES = np.arange(75) / 30.0  # s
"""Of the film, which begins 13 ms after the ball was let go, and ends before 2.5 s."""


@pytest.fixture(scope="module")
def lesson():
    return find(0)


@pytest.fixture(scope="module")
def scene(lesson):
    return scene_of(lesson)


@pytest.fixture(scope="module")
def film(lesson):
    return measured.read(lesson.folder / "ball.csv")


def explained(lesson):
    return " ".join(without_tex(sheet(lesson, "explanation")).split())


def heights(t, e=0.8, g=9.81, h=1.0):
    """Height of the fall that is left at the times t, s: 0 when the ball touches the table."""
    y = np.empty_like(t)
    for i, left in enumerate(t.tolist()):
        flight, top = sqrt(2.0 * h / g), h
        begin = -flight  # as if it had been thrown up before
        while left - begin > 2.0 * flight:
            begin, flight, top = begin + 2.0 * flight, e * flight, e**2 * top
        y[i] = top - 0.5 * g * (left - begin - flight) ** 2
    return y


def test_the_track_is_made_as_the_explanation_says(lesson, film):
    errors = 0.002 * np.random.default_rng(4).standard_normal((len(FRAMES), 2))
    points = np.column_stack([np.zeros(len(FRAMES)), heights(FRAMES + 0.013) + RADIUS]) + errors
    marks = 0.002 * np.round(points / 0.002) + 0.0
    rows = [f"{t:.4f},{x:.3f},{y:.3f}\n" for t, (x, y) in zip(FRAMES, marks, strict=True)]
    text = (lesson.folder / "ball.csv").read_text(encoding="utf-8")
    assert text == "".join(["made_not_filmed\n", "t,x,y\n", *rows])
    assert (len(film), film.name) == (75, "made_not_filmed")
    said = sheet(lesson, "student")
    assert "made, not filmed" in said
    # The marks that the worksheet gives: the tops, and the lowest marks beside the bounces.
    rows = re.findall(
        r"^\| (?:release|top|\d\w\w bounce) \| (\S+) \| (\S*) ?\|$", said, re.MULTILINE
    )
    times, tops = [float(t) for t, _ in rows], [float(y) for _, y in rows if y]
    y = marks[:, 1]
    lows = [i for i in range(1, len(y) - 1) if y[i] < min(y[i - 1], y[i + 1])]
    highs = [i for i in range(1, len(y) - 1) if y[i - 1] < y[i] >= y[i + 1] and y[i] > 0.2]
    assert times[1::2] == pytest.approx([FRAMES[i] for i in lows[:3]], abs=5e-4)
    assert times[2::2] == pytest.approx([FRAMES[i] for i in highs[:3]], abs=5e-4)
    assert tops == [y[0], *(y[i] for i in highs[:3])]


def test_the_scene_does_not_tell_what_is_to_be_found(scene):
    assert scene.surface[0].restitution == 0.7
    real = scene.with_values(TRUTH)
    track = simulate(real).at(FRAMES + 0.013)[0][:, 0]
    assert track[:, 1] - RADIUS == pytest.approx(heights(FRAMES + 0.013), abs=1e-12)


def test_the_fit_finds_what_the_explanation_says(lesson, scene, film):
    found = measured.fit(scene, film, KEYS)
    (g, e, t0), (dg, de, _) = found.values, found.errors
    assert f"finds ε = {e:.4f} ± {de:.4f} and g = {g:.3f} ± {dg:.3f} m/s²" in explained(lesson)
    for value, error, true in zip(found.values, found.errors, (9.81, 0.8, -0.013), strict=True):
        assert abs(value - true) < 2.0 * error
    assert t0 < 0.0
    assert found.notes == ()
    assert "surface.table.restitution" in str(found)


def test_a_wrong_stick_or_clock_spoils_g_and_not_epsilon(scene, film):
    g, e, _ = measured.fit(scene, film, KEYS).values
    longer = scene.with_values({"particle.radius": 1.05 * RADIUS, "stream.at": [0.0, 1.05 * 1.02]})
    stretched = measured.fit(longer, film.placed(scale=1.05), KEYS).values
    assert stretched[:2] == pytest.approx([1.05 * g, e], rel=1e-5)
    slow = measured.Track("", "<half the rate>", 2.0 * film.seconds, film.points, film.lines)
    found = measured.fit(scene.with_values({"run.until": 5.0, "gravity": 2.5}), slow, KEYS).values
    assert found[:2] == pytest.approx([g / 4.0, e], rel=1e-5)


def in_air(mass, e=0.8, g=9.81, step=1e-5):
    """Heights at 30 frames a second, in air of 1.2 kg/m³ with c_w 0.45; midpoint steps."""
    k = 0.5 * 0.45 * 1.2 * pi * RADIUS**2 / mass
    y, v, seen, every = 1.0, 0.0, [], round(1.0 / 30.0 / step)
    for i in range(every * len(FRAMES)):
        if i % every == 0:
            seen.append(y)
        middle = v - 0.5 * step * (g + k * v * abs(v))
        v -= step * (g + k * middle * abs(middle))
        y += step * middle
        if y < 0.0 and v < 0.0:
            y, v = -e * y, -e * v
    return np.array(seen)


@pytest.mark.parametrize(
    ("mass", "said"),
    some([(0.037, "ε = {e:.3f} and g = {g:.2f} m/s²"), (0.0027, "gives {e:.2f} and {g:.1f} m/s²")]),
)
def test_air_is_taken_for_the_tables_fault_as_the_explanation_says(lesson, scene, mass, said):
    y = in_air(mass) + RADIUS
    points = np.column_stack([np.zeros(len(y)), y])
    seconds = round(1.0 / 30.0 / 1e-5) * 1e-5 * np.arange(len(y))
    film = measured.Track("", "<air>", seconds, points, np.arange(len(y)))
    found = measured.fit(scene, film, KEYS)
    g, e, _ = found.values
    assert said.format(e=e, g=g) in explained(lesson)
    assert "neighbouring residuals are alike" in " ".join(found.notes)
