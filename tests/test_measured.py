import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from chutelab import measured
from chutelab.cli import main
from chutelab.engines.simulation import simulate
from chutelab.scene import load
from chutelab.studies.measured import MeasuredError
from chutelab.studies.measured.result import COLUMNS, advice, plus_minus
from chutelab.studies.measured.track import best_t0

KEYS = ("plate.restitution", "incoming.speed")
TRUTH = np.array([0.62, 1.9])
"""What the shipped track was made with; the scene itself says 0.5 and 2 m/s."""

NOISE = 0.001
"""m; how well a ball of 13 mm is marked by hand."""


def filmed(scene, *, frames=120.0, noise=NOISE, seed=4, begin=0.0):
    """Return what a camera would see of particle 0, to a tenth of a millimetre.

    120 frames a second are slow motion of a common telephone. The film begins at `begin`, s, on the
    clock of the simulation; the noise of each coordinate is independent and normal.
    """
    recording = simulate(scene)
    end = recording.track(0)["t"][-1]
    seconds = np.arange(np.ceil(begin * frames), np.floor(end * frames) + 1.0) / frames
    errors = noise * np.random.default_rng(seed).standard_normal((len(seconds), 2))
    points = np.round(recording.at(seconds)[0][:, 0] + errors, 4)
    lines = np.arange(len(seconds)) + 3
    return measured.Track("simulated_with_noise", "<simulated>", seconds, points, lines)


@pytest.fixture(scope="module")
def film():
    return measured.read("perpendicular-track")


@pytest.fixture(scope="module")
def scene():
    return load("perpendicular")


@pytest.fixture(scope="module")
def real():
    return load("perpendicular", ["plate.restitution=0.62", "incoming.speed=1.9"])


@pytest.fixture(scope="module")
def found(scene, film):
    return measured.fit(scene, film, KEYS)


def written(tmp_path, text, name="film.txt", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


# Reading

POINTS = [(0.0, 0.1, 0.2), (0.5, -0.15, 1e-3), (1.0, 0.2, -30.0)]


def rows(separator, comma=False, end=""):
    lines = [separator.join(f"{value:.9E}" for value in point) + end for point in POINTS]
    return "\n".join(lines).replace(".", "," if comma else ".")


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("mass_A\nt\tx\ty\n" + rows("\t"), "mass_A"),
        ("mass A\nt,x,y\n" + rows(","), "mass A"),
        ("\tmass A\t\t\nt\tx\ty\t\n" + rows("\t", end="\t"), "mass A"),
        (",A,,\nt,x,y,\n" + rows(",", end=","), "A"),
        ("t;x;y\n" + rows(";", comma=True), ""),
        ("Ball\nt\tx\ty\n" + rows("\t", comma=True), "Ball"),
        ("cm_A\nt      x      y\n" + rows("   "), "cm_A"),
        ('mass_A\nt,x,y\n"0,0","0,1","0,2"\n"0,5","-0,15","0,001"\n"1","0,2","-30"\n', "mass_A"),
        ("mass_A\nt (s)\tx (m)\ty (m)\n" + rows("\t"), "mass_A"),
        ("mass_A\nTime,X,Y\n\n# a remark\n" + rows(",") + "\n\n", "mass_A"),
        ("mass_A\nt\tx\ty\n0\t.1\t.2\n0.5\t−0.15\t1e-3\n1\t.2\t-30.\n", "mass_A"),
    ],
    ids=[
        "tabs", "commas", "tracker 6", "tracker 6 commas", "semicolons and decimal commas",
        "decimal commas", "spaces", "quoted", "units", "blank lines", "other numbers",
    ],
)  # fmt: skip
def test_reads_what_programs_write(tmp_path, text, name):
    for encoding, newline in (("utf-8", "\n"), ("utf-8-sig", "\r\n"), ("utf-16", "\r\n")):
        track = measured.read(written(tmp_path, text.replace("\n", newline), encoding=encoding))
        found = np.column_stack([track.t, track.position])
        assert (track.name, track.skipped) == (name, 0)
        assert found == pytest.approx(np.array(POINTS), abs=1e-15)


def test_ignores_other_columns_and_counts_frames_without_a_mark(tmp_path):
    text = (
        "A\nframe,t,v_{x},y,r,x\n" + "1,0,,2,9,1\n2,1,5,,9,1\n3,2,5,4,9,3\n4,3,5,NaN,9,\n5,4,,6,,5"
    )
    track = measured.read(written(tmp_path, text))
    assert track.position.tolist() == [[1, 2], [3, 4], [5, 6]]
    assert track.lines.tolist() == [3, 5, 7]
    assert track.skipped == 2
    assert "2 lines without a position" in str(track)
    assert [row[0] for row in track.sheet().rows] == ["time, s", "x, m", "y, m"]


MULTI = "#multi:\n\tcm A\t\tcm B\t\t\nt\tx\ty\tx\ty\t\n" + "".join(
    f"{i}\t{i}\t{2 * i}\t{3 * i}\t{4 * i}\t\n" for i in range(4)
)


def test_chooses_among_several_tracks(tmp_path):
    path = written(tmp_path, MULTI)
    for name, factors in (("cm A", (1, 2)), ("cm B", (3, 4))):
        track = measured.read(path, track=name)
        assert track.name == name
        assert track.points[3].tolist() == [3 * factor for factor in factors]
    with pytest.raises(MeasuredError, match='line 3: holds 2 tracks; choose one of "cm A", "cm B"'):
        measured.read(path)
    with pytest.raises(MeasuredError, match='"cm C": no such track; there are "cm A", "cm B"'):
        measured.read(path, track="cm C")


def test_places_points_in_the_world(tmp_path):
    pixels = written(tmp_path, "A\nt,x (px),y (px)\n2,100,50\n3,110,50\n4,110,70\n")
    track = measured.read(pixels, scale=0.01, origin=(100.0, 40.0), flip_y=True, t0=1.5)
    # x = scale (x_file - X), y = -scale (y_file - Y), t = t_file - t0
    assert track.position == pytest.approx(np.array([[0.0, -0.1], [0.1, -0.1], [0.1, -0.3]]))
    assert track.t.tolist() == [0.5, 1.5, 2.5]
    with pytest.raises(MeasuredError, match="line 2: x and y are in pixels: a scale"):
        measured.read(pixels)
    centimetres = written(tmp_path, "A\nt (ms),x [cm],y_cm\n0,1,2\n500,3,4\n1000,5,6\n", "cm.csv")
    track = measured.read(centimetres)
    assert track.position[2] == pytest.approx([0.05, 0.06])
    assert track.t[1] == pytest.approx(0.5)
    assert measured.read(centimetres, scale=2.0).x[0] == 2.0


HEAD = "A\nt,x,y\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "empty; no line names the columns t, x, y"),
        ("0,1,2,3\n1,2,3,4\n", 'line 1 = "0,1,2,3": no line names the columns t, x, y'),
        ("A\nt,x,z\n0,1,2\n", "line 2: no column y; t, x, y are needed"),
        (HEAD + "0,1,2\n1,two,3\n", 'line 4, column x = "two": must be a number from'),
        (HEAD + "0,1,2\n1,inf,3\n", 'line 4, column x = "inf": must be a number from'),
        (HEAD + "0,1,2\n1,1e400,3\n", 'line 4, column x = "1e400": must be a number from'),
        (HEAD + "0,1,2\n1,1_0,3\n", 'line 4, column x = "1_0": must be a number from'),
        (HEAD + "0,1,2\n1,2,3\n", "2 points with a time and a position; at least 3"),
        (HEAD + "0,1,2\n1,2,3\n1,2,3\n", "line 5, column t = 1.0: times must increase; the point"),
        (HEAD + "0,1,2\n1,2,3\n0.5,2,3\n", "before has 1 (line 4)"),
        (HEAD + "0,0,1,0,2,0\n", '"0,0,1,0,2,0": 6 cells under 3 columns; with decimal commas'),
        ("t;x;y\n0,1;1;2\n0.2;3;4\n1;1;1\n", "line 3 = "),
        ("t (s),x (m),y (cm)\n0,1,2\n1,1,2\n2,1,2\n", "line 1: x and y have different units"),
        ("A\0\nt,x,y", "not a text file"),
    ],
)  # fmt: skip
def test_says_what_is_wrong_with_a_file(tmp_path, text, said):
    path = written(tmp_path, text)
    with pytest.raises(MeasuredError) as error:
        measured.read(path)
    assert str(error.value).startswith(f"{path}: ")
    assert said in str(error.value)


FILMED = [[0.0, 1.0, -2.0], [0.25, 1.5, -2.5], [0.5, 2.0, -3.5]]


@pytest.mark.parametrize(
    ("text", "given"),
    [
        ("0,1,-2\n.25,1.5,-2.5\n.5,2,-3.5\n", {}),
        ("# mine\n\n0 1 -2\n.25 1.5 -2.5\n.5 2 -3.5\n", {}),
        ("0,0;1,0;-2\n,25;1,5;-2,5\n,5;2,0;-3,5\n", {}),
        ("7;-2;1;0\n7;-2,5;1,5;,25\n7;-3,5;2;,5\n", {"columns": (4, 3, 2)}),
        ("Zeit;hoch;weit\n0;-2;1\n,25;-2,5;1,5\n,5;-3,5;2\n", {"columns": ("1", "3", "2")}),
        ("A\nZeit (ms);hoch [cm];weit [cm]\n0;-200;100\n250;-250;150\n500;-350;200\n",
         {"columns": ("zeit", "Weit", "hoch [cm]")}),
        ("s,up (mm),far (mm)\n0,-2000,1000\n.25,-2500,1500\n.5,-3500,2000\n",
         {"columns": (1, 3, 2)}),
        ("x,y\n1,-2\n1.5,-2.5\n2,-3.5\n", {"fps": 4}),
        ("1,-2\n1.5,-2.5\n2,-3.5\n", {"fps": 4}),
        ("t,x,y\n9,1,-2\n9,1.5,-2.5\n9,2,-3.5\n", {"fps": 4, "columns": ("x", "y")}),
        ("n,x,y\n0,1,-2\n60,1.5,-2.5\n120,2,-3.5\n", {"fps": 240, "columns": ("n", "x", "y")}),
        ('"a, b",x,y\n0,1,-2\n.25,1.5,-2.5\n.5,2,-3.5\n', {"columns": ("a, b", "x", "y")}),
    ],
    ids=[
        "no names", "no names, spaces", "no names, decimal commas", "numbers",
        "numbers below names", "names and units", "numbers and units", "frames",
        "frames, no names", "times not believed",
        "numbers of frames", "a comma in a name",
    ],
)  # fmt: skip
def test_reads_columns_that_are_chosen_or_alone(tmp_path, text, given):
    track = measured.read(written(tmp_path, text), **given)
    assert np.column_stack([track.t, track.position]) == pytest.approx(np.array(FILMED), abs=1e-15)


def test_a_frame_without_a_mark_takes_its_time(tmp_path):
    path = written(tmp_path, "x,y\n,\n1,2\n,\n\n2,3\n3,4\n")
    for columns in ((), (1, 2), ("x", "y")):
        track = measured.read(path, fps=10.0, columns=columns)
        assert track.t.tolist() == [0.1, 0.3, 0.4]
        assert track.skipped == 2


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"fps": 0.0}, "fps = 0.0: must be a number > 0"),
        ({"fps": float("nan")}, "fps = nan: must be"),
        ({"fps": 25.0}, "line 1: has a column t, so no frames per second are needed"),
        ({"columns": ("t", "x")}, 'columns = "t,x": must be 3 different ones, for t,x,y'),
        ({"columns": ("t", "x", "X")}, "must be 3 different ones"),
        ({"columns": ("t", "x", "z")}, 'columns = "t,x,z": no line has these columns'),
        ({"columns": (1, 2, 9)}, 'columns = "1,2,9": no line has these columns'),
        ({"columns": (0, 1, 2)}, "numbers from 1"),
        ({"columns": (1, 2, 3), "track": "A"}, "give one of them"),
    ],
)
def test_says_which_columns_cannot_be_had(tmp_path, given, said):
    path = written(tmp_path, "t,x,y\n0,1,2\n1,2,3\n2,3,4\n")
    with pytest.raises(MeasuredError) as error:
        measured.read(path, **given)
    assert said in str(error.value)


# Residuals


def test_residuals_are_measured_minus_parabola(real):
    """Before the pulley x = v t - 1 m; then y falls by ½ g t²; the errors are put in by hand."""
    t = np.array([0.25, 1.0 / 1.9 + 0.2])
    track = measured.Track(
        "A", "<test>", np.array([*t, 0.9]), np.zeros((3, 2)), np.array([3, 4, 5])
    )
    clean = measured.residuals(real, track)
    x = 1.9 * t - 1.0
    y = [0.1063, 0.1063 - 0.5 * 9.81 * 0.2**2]
    assert clean.simulated[:2] == pytest.approx(np.column_stack([x, y]), abs=1e-14)
    errors = np.array([[0.003, 0.0], [0.0, -0.004], [0.0, 0.0]])
    moved = measured.Track("A", "<test>", track.seconds, clean.simulated + errors, track.lines)
    found = measured.residuals(real, moved)
    assert found.values == pytest.approx(errors, abs=1e-14)
    assert found.rms == pytest.approx((0.003 / 3**0.5, 0.004 / 3**0.5))
    assert found.mean == pytest.approx((0.001, -0.004 / 3))
    assert found.worst == 1
    rows = {name: cells for name, *cells in found.sheet().rows}
    assert rows["RMS"] == ["1.73 mm", "2.31 mm", "2.89 mm"]
    assert rows["worst point"][1:] == ["-4 mm", "4 mm"]
    assert "3 of 3 points compared; the worst one is line 4: 0.7263 s, x = 0.38 m" in str(found)


def test_points_outside_the_simulated_time_are_named_and_left_out(real):
    track = filmed(real).placed(t0=0.1)
    found = measured.residuals(real, track)
    early = int((track.t < -1e-9).sum())
    assert early == 12
    assert found.left_out() == "12 points before the release at 0 s (lines 3 to 14)"
    assert np.isnan(found.values[:early]).all()
    assert np.isfinite(found.values[early:]).all()
    late = measured.residuals(real, track.placed(t0=-0.009))
    assert late.left_out() == f"1 point after the end at 0.9731 s (line {track.lines[-1]})"
    with pytest.raises(MeasuredError, match="column t: 0 of 117 points lie within"):
        measured.residuals(real, track.placed(t0=9.0))


# Fits


def test_the_shipped_track_is_what_its_generator_makes(film, real):
    track = filmed(real, begin=0.4)
    points = zip(track.seconds, track.points, strict=True)
    lines = [track.name, "t,x,y", *(f"{t:.6f},{x:.4f},{y:.4f}" for t, (x, y) in points)]
    assert Path(film.source).read_text(encoding="utf-8") == "\n".join([*lines, ""])
    assert "simulated" in film.name


def test_uncertainty_of_a_belt_speed_is_the_textbook_one(real):
    """On the belt x = v t - 1 and y is fixed, so σ_v = s / √Σt², s² = Σr² / (2n - 1)."""
    track = filmed(real, frames=60.0, seed=7)
    track = measured.Track("A", "<belt>", track.seconds[:30], track.points[:30], track.lines[:30])
    fitted = measured.fit(load("perpendicular"), track, ["incoming.speed"])
    t = track.t
    speed = float((track.x + 1.0) @ t / (t @ t))
    off = np.concatenate([track.x + 1.0 - speed * t, track.y - 0.1063])
    assert fitted.values[0] == pytest.approx(speed, abs=1e-9)
    sigma = np.sqrt(off @ off / (2 * 30 - 1) / (t @ t))
    assert fitted.errors[0] == pytest.approx(sigma, rel=1e-6)
    assert fitted.freedom == 59


@pytest.mark.slow
def test_uncertainties_cover_the_truth_as_often_as_they_say(scene, real):
    """Of the fits to other noise, 68 % and 95 % lie within 1 and 2 standard deviations.

    The counts of each parameter lie in the central 99.8 % of their binomial distributions.
    """
    from scipy.stats import binom

    fits, off = 64, []
    for seed in range(fits):
        track = filmed(real, frames=60.0, seed=1000 + seed, begin=0.4)
        fitted = measured.fit(scene, track, KEYS)
        off.append(np.abs(fitted.values - TRUTH) / fitted.errors)
    for within, share in ((1.0, 0.6827), (2.0, 0.9545)):
        low, high = binom.interval(0.998, fits, share)
        for count in (np.array(off) < within).sum(axis=0):
            assert low <= count <= high


def test_finds_the_clock_from_anywhere(scene, real):
    track = filmed(real, begin=0.45, seed=3).placed(t0=-40.0)
    fitted = measured.fit(scene, track, [*KEYS, "t0"])
    assert fitted.values == pytest.approx([*TRUTH, 0.0], abs=0.01)
    assert (np.abs(fitted.values - [*TRUTH, 0.0]) < 3.0 * fitted.errors).all()
    assert fitted.after.track.placement.t0 == fitted.values[2]
    assert any("correlated" in note for note in fitted.notes)
    assert best_t0(measured.residuals(real, filmed(real)).recording, track) == (
        pytest.approx(0.0, abs=0.002)
    )


def test_fits_how_the_points_lie(real):
    track = filmed(real, seed=5)
    # As a camera would have it: pixels of 2 mm, from the upper left, y downward.
    pixels = track.points * [500.0, -500.0] + [310.0, 95.0]
    camera = measured.Track(
        "A", "<camera>", track.seconds, pixels, track.lines,
        measured.Placement(scale=0.0021, origin=(300.0, 100.0), flip_y=True),
    )  # fmt: skip
    fitted = measured.fit(real, camera, ["scale", "origin.x", "origin.y"])
    truth = np.array([0.002, 310.0, 95.0])
    assert (np.abs(fitted.values - truth) < 3.0 * fitted.errors).all()
    assert fitted.errors == pytest.approx([0.0, 0.2, 0.2], abs=0.2)
    assert fitted.errors[0] < 1e-6


def test_a_robust_fit_believes_an_outlier_less(scene, real):
    track = filmed(real, seed=6, begin=0.4)
    points = track.points.copy()
    points[[20, 60]] += [[0.3, 0.0], [0.0, 0.25]]
    spoilt = measured.Track("A", "<spoilt>", track.seconds, points, track.lines)
    plain = measured.fit(scene, spoilt, KEYS)
    robust = measured.fit(scene, spoilt, KEYS, robust=True)
    assert any("line 23 (0.3 m), line 63" in note for note in plain.notes)
    assert (np.abs(robust.values - TRUTH) < 3.0 * robust.errors).all()
    assert (robust.errors < 0.3 * plain.errors).all()
    assert (np.abs(robust.values - TRUTH) < np.abs(plain.values - TRUTH)).all()
    assert robust.scatter == pytest.approx(0.001, rel=0.3)


def test_stays_within_what_the_scene_allows(scene):
    real = load("perpendicular", ["plate.restitution=1.0"])
    at_the_edge = 0
    for seed in range(3):
        track = filmed(real, seed=seed, noise=0.01)
        fitted = measured.fit(scene, track, ["plate.restitution"])
        assert fitted.values[0] <= 1.0
        if fitted.values[0] > 1.0 - 1e-6:
            at_the_edge += 1
            assert any("edge of what is allowed" in note for note in fitted.notes)
    assert at_the_edge > 0


def test_names_what_the_points_cannot_tell(scene, film):
    for keys, said in (
        (["particle.mass"], "fit: particle.mass does not move the particle"),
        (["plate.restitution", "run.max_time"], "run.max_time does not move the particle"),
        (["t0", "incoming.length"], "t0 and incoming.length cannot be told apart"),
        (["outgoing.friction"], "outgoing.friction does not move"),
    ):
        with pytest.raises(MeasuredError, match=said) as error:
            measured.fit(scene, film, keys)
        assert str(error.value).startswith(film.source)


def test_says_when_the_model_is_not_what_was_filmed(scene, film):
    fitted = measured.fit(scene, film, ["plate.restitution"])
    assert any("neighbouring residuals are alike" in note for note in fitted.notes)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ([], "name at least one key"),
        (["plate.restitutoin"], "did you mean plate.restitution"),
        (["restitution"], "did you mean .*plate.restitution"),
        (["stream.count"], "1 is not a number that can vary continuously"),
        (["incoming.friction"], '"adhesion" is not a number'),
        (["particle.spin"], "false is not a number"),
        (["title"], "is not a number"),
        (["plate"], "is not a number"),
        (["plate.below"], "has no value in this scene; give one to start from, --set plate.below="),
        (["stream.at[0]"], r"give one to start from, --set stream.at\[0\]="),
        (["surface[0].speed"], r"the scene has no \[surface\]"),
        (["t0", "t0"], "fit t0: given twice"),
        (["", "."], "2 faults"),
    ],
)  # fmt: skip
def test_says_which_keys_cannot_be_fitted(scene, film, keys, said):
    with pytest.raises(MeasuredError, match=said):
        measured.fit(scene, film, keys)


@pytest.mark.parametrize("off", [0.01, -0.02])
def test_gets_over_a_jump(off):
    """From 1 cm beside, the particle bounces once less on the ramp, and there is a minimum."""
    plain = load("free-fall")
    real = filmed(plain, noise=0.001, seed=2)
    start = load("free-fall", [f"stream.at=[{plain.stream.at[0] + off}, {plain.stream.at[1]}]"])
    fitted = measured.fit(start, real, ["stream.at[0]"])
    assert abs(fitted.values[0] - plain.stream.at[0]) < 3.0 * fitted.errors[0]


def test_refuses_to_follow_one_of_a_crowd(film):
    with pytest.raises(MeasuredError, match=r"stream.interact = true: must be false for a fit"):
        measured.fit(load("stream"), film, ["incoming.speed"])


def test_shows_itself(found, film):
    text = str(found)
    assert "0.6178 ± 0.0018" in text
    assert "0.6141 to 0.6214" in text
    assert "RMS residual 0.961 mm in" in text
    for shown, said in ((found, "incoming.speed"), (found.after, "worst point")):
        assert f">{said}</td>" in shown._repr_html_()
    assert "69 points" in film._repr_html_()
    assert plus_minus(123.456, 9.99) == "123 ± 10"


# The command


def run(*arguments):
    return CliRunner().invoke(main, ["compare", *map(str, arguments)])


ARGUMENTS = ("perpendicular", "--data", "perpendicular-track")


def test_advises_a_clock_that_fits():
    result = run("perpendicular", "--data", "perpendicular-track", "--t0", "0.3", "--set",
                 "plate.restitution=0.62", "--set", "incoming.speed=1.9")  # fmt: skip
    assert result.exit_code == 0
    t0 = re.search(r"0\.3 s apart: with t0 = (-?[\d.e-]+)", result.output)
    assert abs(float(t0[1])) < 1e-3


def test_doubts_points_that_lie_far_from_everything(scene, film):
    """As when a scale is forgotten: the numbers are millimetres."""
    found = measured.residuals(scene, film.placed(scale=1000.0))
    assert re.match(r"the points lie \d+ times as far off .*: look at scale", advice(found))
    assert advice(measured.residuals(scene, film)) == ""
    with pytest.raises(MeasuredError, match=r"fit: nothing was found .* look at scale, origin"):
        measured.fit(scene, film.placed(scale=1000.0), ["t0"])
    fitted = measured.fit(scene, film.placed(origin=(50.0, 0.0)), ["incoming.speed"])
    assert fitted.notes[0].startswith("the points lie")


def test_writes_a_picture_the_points_and_the_fit(tmp_path, found):
    out = tmp_path / "new" / "out"
    result = run(*ARGUMENTS, "--fit", ",".join(KEYS), "--out", out, "--json")
    assert result.exit_code == 0, result.output
    assert {path.name for path in out.iterdir()} == {"compare.png", "points.csv", "fit.json"}
    told = json.loads(result.stdout)
    assert told == json.loads((out / "fit.json").read_text(encoding="utf-8"))
    fitted = told["fit"]["parameters"]["plate.restitution"]
    assert fitted["value"] == found.values[0]
    assert fitted["error"] == found.errors[0]
    assert told["fit"]["correlation"][0][1] == found.correlation[0, 1]
    assert told["residuals"]["rms_x"] == found.after.rms[0]
    lines = (out / "points.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == ",".join(COLUMNS)
    assert len(lines) == 70
    table = np.genfromtxt(lines[1:], delimiter=",")
    assert table[:, 6:] == pytest.approx(table[:, 2:4] - table[:, 4:6], abs=1e-8)
    assert table[:, 6:] == pytest.approx(found.after.values, abs=1e-8)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--data", "nowhere.csv"), "nowhere.csv: no such file, and no shipped track"),
        (("--scale", "0"), "scale = 0.0: must be a number > 0"),
        (("--scale", "1e308"), "scale = 1e+308: must be a number > 0 and <= 1e+09"),
        (("--scale", "x"), "'x' is not a valid float"),
        (("--origin", "1"), "two numbers X,Y"),
        (("--fit", "plate.restitutoin"), "did you mean plate.restitution"),
        (("--fit", "plate.restitution,,incoming.speed"), "unknown key"),
        (("--robust",), "name what to fit with --fit"),
        (("--t0", "99"), "points lie within the simulated time"),
        (("--track", "B"), 'no such track; there are "simulated_with_noise"'),
        (("--set", "plate.restitution=2"), "plate.restitution = 2"),
    ],
)
def test_refuses_with_words_and_writes_nothing(tmp_path, arguments, said):
    out = tmp_path / "out"
    result = run(*ARGUMENTS, *arguments, "--out", out)
    assert result.exit_code == 2
    assert said in result.output
    assert list(tmp_path.iterdir()) == []
