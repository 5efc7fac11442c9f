"""The paper's figures: printed and corrected equations written out, and the engine beside them."""

import csv
import io

import numpy as np
import pytest
from PIL import Image

import chutelab
from chutelab.pictures.plots import paper_figure
from chutelab.results import Kind
from chutelab.theory.figures import CASES, DRAWINGS, NUMBERS, FigureError, figure, path
from shared import call

G, EPSILON, FALL, MASS = 9.81, 0.5, 0.5, 0.008


@pytest.fixture(scope="module")
def found():
    return {number: figure(number) for number in NUMBERS}


def paper(v, radius, distance, *, printed):
    """Eqs. (2) to (12) for an upright plate; returns v2, v2', v3x, t3."""
    cosine = np.minimum(v**2 / (G * radius), 1.0)
    sine = np.sqrt(1.0 - cosine**2)
    t2 = (radius + distance - radius * sine) / (v * cosine)
    vx, vy = v * cosine, v * sine + G * t2
    v2, phi2 = np.hypot(vx, vy), np.arctan2(vx, vy)
    turned = np.arctan(EPSILON * np.tan(phi2))
    if printed:
        after = v2 * np.sqrt(np.sin(phi2) ** 2 + EPSILON**2 * np.cos(phi2) ** 2)
    else:
        after = v2 * np.sqrt(np.cos(phi2) ** 2 + EPSILON**2 * np.sin(phi2) ** 2)
    back, down = after * np.sin(turned), after * np.cos(turned)
    t3 = (-down + np.sqrt(down**2 + 2.0 * G * FALL)) / G
    return v2, after, back, t3


@pytest.mark.parametrize(("number", "speed"), [(6, 2.0), (7, 4.0)])
@pytest.mark.parametrize("form", ["as-printed", "corrected"])
@pytest.mark.parametrize("distance", [0.5, 1.0])
def test_energy_against_the_radius(found, number, speed, form, distance):
    columns = found[number].columns
    radius = columns["R, m"]
    _, _, back, _ = paper(speed, radius, distance, printed=form == "as-printed")
    expected = 1000.0 * 0.5 * MASS * (back**2 + speed**2)
    energy = columns[f"ΔE_k, mJ, {form}, d_okr = {distance:g} m"]
    np.testing.assert_allclose(energy, expected, rtol=1e-12)
    if form == "as-printed":
        assert (np.diff(energy) < 0.0).all()
    elif number == 7:
        np.testing.assert_allclose(energy, 80.0, rtol=1e-12)


def test_the_printed_form_is_what_table_1_was_made_from(found):
    for number, speed, first in ((8, 2.0, 0.137), (9, 4.0, 0.548)):
        columns = found[number].columns
        _, after, back, t3 = paper(speed, columns["R, m"], 0.5, printed=True)
        assert back[0] * t3[0] == pytest.approx(first, abs=5e-4)
        np.testing.assert_allclose(columns["v3x, m/s, as-printed"], back, rtol=1e-12)
        np.testing.assert_allclose(columns["v2', m/s, as-printed"], after, rtol=1e-12)


@pytest.mark.parametrize("number", [6, 7])
def test_its_scene_has_the_energy_of_the_first_radius(found, number):
    (scene,) = found[number].scenes.values()
    energy = found[number].columns["ΔE_k, mJ, corrected, d_okr = 0.5 m"]
    assert 1000.0 * chutelab.theory.predict(scene).dEk == pytest.approx(energy[0], rel=1e-12)


@pytest.mark.parametrize("number", [11, 12, 13])
def test_the_engine_runs_the_corrected_paths(found, number):
    for case, scene in zip(CASES[number], found[number].scenes.values(), strict=True):
        recording = chutelab.simulate(scene, engine="exact")
        landing = recording.first(recording.select(Kind.LANDING))[0]
        assert scene.incoming.pulley_radius == case.radius
        last = path(case, "corrected")[1, -1]
        np.testing.assert_allclose(landing["position"], last["position"], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(landing["velocity_before"], last["velocity"], rtol=1e-12)


def test_words_carry_the_numbers(found):
    assert "10 % less" in found[6].meaning[0]
    assert "0.408 m" in found[6].meaning[0]
    assert "the whole trend is the misprint" in found[7].meaning[0]
    assert "2.412 m/s instead of 2.877 m/s" in found[8].meaning[0]
    assert "2.000 m/s throughout" in found[9].meaning[1]
    assert "0.436 m back from the plate, as printed 0.585 m" in found[11].meaning[0]
    # Section 5 of the design: +0.29 at 1 m/s, -0.40 at 2 m/s.
    assert "1 m/s, 20°: +0.29 m/s" in found[12].meaning[0]
    assert "-0.40 m/s" in found[12].meaning[1]
    assert "1.71 m/s forward" in found[13].meaning[0]
    for one in found.values():
        assert one.missing


@pytest.mark.parametrize("number", NUMBERS)
def test_picture_has_both_forms_on_the_same_axes(found, number):
    drawn = paper_figure(found[number])
    assert len(drawn.axes) == len(found[number].panels)
    for left, right in zip(drawn.axes[::2], drawn.axes[1::2], strict=True):
        assert left.get_ylim() == right.get_ylim()
        assert left.get_xlim() == right.get_xlim()
        assert "as printed" in left.get_title(loc="left")
        assert "corrected" in right.get_title(loc="left")
    said = " ".join(text.get_text() for text in drawn.texts).replace("\n", " ")
    for text in (*found[number].meaning, *found[number].missing):
        assert text in said


@pytest.mark.parametrize("number", [7, pytest.param(12, marks=pytest.mark.slow)])
def test_command_writes_picture_numbers_and_scenes(number, tmp_path):
    result = call("figure", str(number), "--out", str(tmp_path / "out"))
    assert "misprint" in result.output
    names = {7: ["figure-7"], 12: ["figure-12-left", "figure-12-right"]}[number]
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == sorted(
        [f"figure-{number}.png", f"figure-{number}.csv", *(f"{name}.toml" for name in names)]
    )
    for name in names:
        scene = chutelab.load(tmp_path / "out" / f"{name}.toml")
        assert scene == figure(number).scenes[name]
    text = (tmp_path / "out" / f"figure-{number}.csv").read_text(encoding="utf-8")
    head, *rows = csv.reader(io.StringIO(text))
    columns = figure(number).columns
    assert head == list(columns)
    assert len(rows) == len(next(iter(columns.values())))
    assert float(rows[5][-1]) == columns[head[-1]][5]
    picture = np.asarray(Image.open(tmp_path / "out" / f"figure-{number}.png"))
    assert len(np.unique(picture)) > 50


@pytest.mark.parametrize("number", [10, 1, 14, -3])
def test_figures_without_results_are_refused_with_a_reason(number):
    result = call("figure", "--", str(number), code=2)
    assert DRAWINGS.get(number, "the paper has no figure") in result.output
    assert "6, 7, 8, 9, 11, 12, 13" in result.output
    with pytest.raises(FigureError):
        figure(number)
