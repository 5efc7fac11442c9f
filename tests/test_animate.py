import subprocess
import tempfile
from dataclasses import replace
from io import BytesIO
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.path import Path as Outline
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image, ImageDraw

import chutelab
from chutelab import scene
from chutelab.engines.simulation import judged, simulate
from chutelab.machine import build
from chutelab.machine.parts import Joint
from chutelab.pictures import animation as video
from chutelab.pictures.animation import (
    TRAIL,
    Moment,
    Stage,
    animate,
    film,
    lay_out,
    moments,
)
from chutelab.pictures.animation.actors import SIGNS
from chutelab.pictures.animation.drawing import Arrows, Canvas, Itself, painter
from chutelab.pictures.animation.files import palette, write_gif
from chutelab.pictures.animation.moments import sentence, slowness, span
from chutelab.pictures.plots import Window, style, window_of
from chutelab.pictures.plots.scenery import paid_by
from chutelab.results import Kind
from chutelab.results.recorder import Recorder
from handmade import (
    BELT_TIME,
    EPS,
    EXACT,
    MASS,
    MU,
    PARTICLE,
    TEXT,
    G,
    Line,
    R,
    Round,
    V,
    by_hand,
    conveyor,
    expected,
    machine_of,
    recording_of,
    seen,
    t_impact,
    t_landing,
)
from shared import call, some

WIDTH, HEIGHT = 800, 450
FLOOR = Line("floor", (-0.6, 0.0), (0.6, 0.0))


def moments_at(times):
    return tuple(Moment(t, 4, "") for t in times)


def laid_out(recording, width=WIDTH, height=HEIGHT, **more):
    return lay_out(recording, width=width, height=height, **more)


def stage_of(recording, at, slow=5.0, layout=None):
    return Stage(recording, layout or laid_out(recording), at, slow=slow)


def moved(stage, index):
    """Draw a moment; return what moves in the scene, by name."""
    stage.frame(index)
    return {one.get_gid(): one for one, _ in stage.moving if one.axes is stage.view}


def blocks_of(stage, index):
    """Return the heights of the entries in each bar at a moment: put in, and is now."""
    return [{name: up[index] for name, up in bar.heights.items()} for bar in stage.bars]


def clock(stage, index):
    return stage.writings[0].said[index]


def figures(stage, index):
    """Return what is written beneath the bars; clock and caption are written before."""
    names = [name for name in SIGNS if name not in ("spring", "damper_loss")]
    return {name: one.said[index] for name, one in zip(names, stage.writings[2:], strict=False)}


@pytest.fixture(scope="module")
def runs():
    names = (*EXACT, "free-fall")
    return {name: simulate(scene.load(scene.find(name))) for name in names}


def filmed(recording):
    begin, end = span(recording, laid_out(recording).window)
    slow = slowness(end - begin)
    return film(recording, begin, end, fps=25, slow=slow), slow


def recorded(*events):
    """Particle 0 with events of (kind, s, m/s along x, N s) on the incoming belt."""
    machine = build(scene.parse(TEXT))
    recorder = Recorder(machine)
    for kind, t, speed, push in events:
        velocity = np.array([speed, 0.0])
        recorder.knots([0], [t], np.zeros(2), velocity, 0.0)
        recorder.events(kind, [0], [t], np.zeros(2), velocity, surface=0, normal_impulse=push)
    return recorder.finish(engine="exact", steps=0)


# Which moments


@pytest.mark.parametrize(("fps", "delay"), [(25, 4), (50, 2)])
def test_film_runs_evenly_and_holds_at_both_impacts(fps, delay):
    slow = 8.0
    end = BELT_TIME + t_landing()
    shots = film(by_hand(), 0.4, end, fps=fps, slow=slow)
    times = np.array([shot.t for shot in shots])
    delays = np.array([shot.delay for shot in shots])
    struck = BELT_TIME + np.array([t_impact(), t_landing()])
    assert times[[0, -1]] == pytest.approx([0.4, end], abs=1e-15)
    held = np.flatnonzero(delays != delay)
    assert times[held] == pytest.approx(struck, abs=1e-15)
    assert (delays[held] == 130).all()
    step = 0.01 * delay / slow
    away = np.abs(times[:-1, None] - struck).min(axis=1) > 2.0 * step
    assert np.diff(times)[away] == pytest.approx(step, rel=0.02)
    # Beside a hold a step may be longer or shorter, by half.
    assert (np.diff(times) > 0.49 * step).all()
    assert (np.diff(times) < 1.51 * step).all()
    moving = 0.01 * delay * (len(times) - 2)
    assert moving == pytest.approx(slow * (end - 0.4), abs=3.0 * 0.01 * delay)


@pytest.mark.parametrize(
    ("pushes", "held"),
    [
        ([0.1, 1.0, 0.2, 0.8, 0.3, 0.9, 0.04, 0.7], [0.2, 0.4, 0.6, 0.8]),
        ([1.0] * 6, [0.1, 0.2, 0.3, 0.4]),  # the first of equals
    ],
)
def test_film_holds_at_the_hardest_four_impacts(pushes, held):
    impacts = [(Kind.IMPACT, 0.1 * (i + 1), 1.0, push) for i, push in enumerate(pushes)]
    shots = film(recorded((Kind.RELEASE, 0.0, 1.0, 0.0), *impacts), 0.0, 1.0, fps=25, slow=5.0)
    assert {shot.delay for shot in shots[:-1]} == {4, 75}
    assert [shot.t for shot in shots[:-1] if shot.delay != 4] == pytest.approx(held, abs=1e-15)


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        *(("lesson.gif", {"fps": fps}, "whole hundredths") for fps in (30, 60, 0, -25, 100)),
        *(("lesson.gif", {"slow": slow}, "allowed") for slow in (0.0, float("nan"), -1.0)),
        ("lesson.gif", {"width": 319}, "allowed"),
        ("lesson.gif", {"height": 100}, "allowed"),
        ("lesson.gif", {"show": ["energy", "spin"]}, "allowed"),
        ("lesson.gif", {"show": "wobble"}, "allowed"),
        ("lesson.mp4", {"width": 801}, "801 x 720 pixels: allowed in a video are even numbers"),
        *((f"lesson{end}", {}, r"allowed are files that end in \.gif, \.mp4, \.webm")
          for end in (".avi", "", ".gif.txt")),
    ],
)  # fmt: skip
def test_impossible_wishes_are_refused(name, options, said, tmp_path):
    if name.endswith(".mp4"):
        pytest.importorskip("imageio_ffmpeg")
    with pytest.raises(ValueError, match=said):
        animate(by_hand(), tmp_path / name, **options)
    assert not list(tmp_path.iterdir())


def test_loops_take_five_to_ten_seconds_at_a_round_slowness(runs):
    for name, recording in runs.items():
        shots, slow = filmed(recording)
        assert float(f"{slow:.1e}") == slow, name
        assert 5.0 <= 0.01 * sum(shot.delay for shot in shots) <= 10.2, name


def test_film_begins_as_the_particle_comes_into_view(runs):
    recording = runs["perpendicular"]
    window = window_of(recording)
    begin, end = span(recording, window)
    x = -1.0 + 2.0 * begin
    inset = moments.EDGE * max(window.width, window.height)
    assert window.left + inset < x < window.left + inset + 0.01
    assert end == recording.track(0)["t"][-1]
    # All of it is in the picture: 6 pt across.
    assert inset / window.width * 0.675 * 8.0 * 72.0 > 3.0


def test_a_long_stream_is_filmed_for_three_lives_of_particle_0():
    text = TEXT + "[stream]\ncount = 100\nrate = 10.0\nbed_height = 0.02\n"
    recording = simulate(scene.parse(text))
    begin, end = span(recording, laid_out(recording).window)
    life = recording.track(0)["t"][-1] - begin
    assert end - begin == pytest.approx(3.0 * life, rel=1e-12, abs=0.0)
    assert end < recording.knots["t"].max()


# Words


def test_a_landing_tells_of_the_flight_if_nothing_was_in_between():
    lesson = Path(__file__).parent.parent / "lessons" / "01-the-parabola"
    for speed in (2.0, 4.0):
        thrown = scene.load(lesson / "throw.toml", [f"incoming.speed={speed}"])
        flown = np.sqrt(2.0 * thrown.outgoing.drop / G)
        said = {shot.words for shot in film(simulate(thrown), 0.0, 5.0, fps=25, slow=4.0)}
        assert any(f"after {flown:.3f} s of flight" in words for words in said)
    said = {shot.words for shot in film(by_hand(), 0.4, 2.0, fps=25, slow=8.0)}
    assert not any("of flight" in words for words in said)


def test_words_tell_what_is_lost_in_the_step_of_an_engine_that_steps():
    """At v = 2 m/s on the plate, with m = 2.1 g: m v² (1 - ε²) / 2 = 3.15 mJ."""
    trust = Path(__file__).parent.parent / "lessons" / "08-trust" / "fixed-steps.toml"
    stepped = judged(scene.load(trust))
    said = [shot.words for shot in film(stepped, 0.4, 0.9, fps=25, slow=6.0)]
    assert any("strikes the plate" in words and "−3.15 mJ in" in words for words in said)
    assert not any("no energy lost" in words for words in said)


def test_words_tell_the_numbers_of_the_impacts():
    recording = by_hand()
    shots = film(recording, 0.4, BELT_TIME + t_landing(), fps=25, slow=8.0)
    said = {round(shot.t, 6): shot.words for shot in shots}
    at_plate = said[round(BELT_TIME + t_impact(), 6)]
    speed = np.hypot(V, G * t_impact())
    lost = 0.5 * MASS * V**2 * (1.0 - EPS**2)
    assert at_plate == (
        f"t = {BELT_TIME + t_impact():.3f} s: strikes the plate at {speed:.3g} m/s, ε = {EPS:g}\n"
        f"−{1e3 * lost:.1f} mJ in the rebound"
    )
    on_belt = said[round(BELT_TIME + t_landing(), 6)]
    push = min(MU * MASS * G * t_landing(), MASS * V * (1.0 + EPS))
    landing = np.hypot(EPS * V, G * t_landing())
    assert f"lands on the outgoing belt at {landing:.3g} m/s, ε = 0\n" in on_belt
    assert f"+{1e3 * push * V:.1f} mJ from the belt" in on_belt
    assert shots[0].words == "rides the incoming belt"
    # What happened is told for a while, then what goes on.
    news = f"t = {BELT_TIME:.3f} s: leaves the drive pulley at the top, at 2 m/s"
    flying = [shot for shot in shots if BELT_TIME < shot.t < BELT_TIME + t_impact()]
    last = BELT_TIME + moments.TOLD / 8.0
    assert [shot.words for shot in flying] == [
        news if shot.t <= last else "in flight" for shot in flying
    ]
    assert {shot.words for shot in flying} == {news, "in flight"}


def test_words_of_a_weak_impact_give_way_to_what_goes_on(runs):
    # It bounces ever lower, slides from 1.517 s on, and rides from 4.32 s on.
    shots, _ = filmed(runs["belt-landing"])
    bounces = runs["belt-landing"].select(Kind.IMPACT, surface="outgoing")["t"]
    assert bounces[-1] == pytest.approx(1.5173, abs=1e-4)
    told = max(shot.t for shot in shots if "strikes the outgoing belt" in shot.words)
    assert told < bounces[-1]
    sliding = {shot.words for shot in shots if bounces[-1] < shot.t < 4.3}
    assert sliding == {"slides on the outgoing belt"}
    flying = {shot.words for shot in shots if 1.2 < shot.t < 1.28}
    assert all(words.startswith("t = 0.936 s: lands on") for words in flying)
    assert shots[-1].words == "t = 4.323 s: has settled on the outgoing belt"


@pytest.mark.parametrize(("rode", "said"), [(2.0, False), (2.001, False), (2.1, True)])
def test_a_stick_right_after_release_is_told_if_the_speed_changed(rode, said):
    release, stick = (Kind.RELEASE, 0.0, 2.0, 0.0), (Kind.STICK, 0.1, rode, 0.0)
    recording = recorded(release, stick, (Kind.SEPARATION, 0.5, rode, 0.0))
    shots = film(recording, 0.0, 1.0, fps=25, slow=5.0)
    words = {shot.words for shot in shots if 0.15 < shot.t < 0.45}
    assert words == {
        f"t = 0.100 s: {sentence(recording, recording.events[1])}"
        if said
        else "rides the incoming belt"
    }
    # One that comes later is news at any speed.
    slip, left = (Kind.SLIP, 0.05, 2.0, 0.0), (Kind.SEPARATION, 0.5, 2.0, 0.0)
    recording = recorded(release, slip, stick, left)
    shots = film(recording, 0.0, 1.0, fps=25, slow=5.0)
    words = {shot.words for shot in shots if 0.15 < shot.t < 0.45}
    assert words == {f"t = 0.100 s: {sentence(recording, recording.events[2])}"}


BOWL = Round("bowl", (0.0, 1.0), 0.5, 180.0, 180.0)
SLANTED = 0.5**0.5


@pytest.mark.parametrize(
    ("piece", "place", "normal"),
    [
        (FLOOR, (0.1, 0.004), (0.0, 1.0)),
        (Line("plate", (0.0, 0.0), (1.0, 1.0)), (0.5 - 3e-3, 0.5 + 3e-3), (-SLANTED, SLANTED)),
        (FLOOR, (0.6024, 0.0032), (0.6, 0.8)),  # its end
        (BOWL, (0.0, 0.504), (0.0, 1.0)),
        (BOWL, (0.0, 0.496), (0.0, -1.0)),
        (BOWL, (-0.496 * SLANTED, 1.0 - 0.496 * SLANTED), (SLANTED, SLANTED)),
        (BOWL, (0.5024, 1.0032), (0.6, 0.8)),  # its ends
        (BOWL, (-0.4976, 1.0032), (0.6, 0.8)),
    ],
)
def test_restitution_is_told_along_the_normal_at_the_contact(piece, place, normal):
    """v·n goes from -2 to 0.4 · 2 m/s, whatever is along the surface."""
    recorder = Recorder(machine_of(piece))
    out = np.array(normal)
    along = 0.7 * np.array([out[1], -out[0]])
    before, after = along - 2.0 * out, along + 0.8 * out
    recorder.knots([0], [0.0], place, before, 0.0)
    recorder.events(
        Kind.IMPACT, [0], [0.0], place, after, velocity_before=before, surface=0, normal_impulse=1.0
    )
    recording = recorder.finish(engine="exact", steps=0)
    assert ", ε = 0.4\n" in sentence(recording, recording.events[0])


def test_separation_is_told_by_its_angle(runs):
    recording = runs["low-speed"]
    (event,) = recording.select(Kind.SEPARATION).copy()
    past = np.degrees(np.arccos(2.0**2 / (9.81 * 0.5063)))
    assert f"{past:.1f}° past the top, at 2 m/s" in sentence(recording, event)
    event["position"] *= -1.0, 1.0
    assert f"leaves the drive pulley {past:.1f}° before the top" in sentence(recording, event)


def test_what_slides_on_to_another_surface_does_not_begin_to_slip_there():
    pair = {"restitution": 0.0, "friction": 0.0}
    bowl = {"center": [0.0, 0.3], "radius": 0.3, "from_deg": 180, "to_deg": 270}
    tables = {
        "surface": [{"name": "bowl", **bowl, **pair},
                    {"name": "floor", "from": [0.0, 0.0], "to": [0.6, 0.0], **pair}],
        "stream": {"at": [-0.25, 0.27], "velocity": [0.0, 0.0]}, "run": {"until": 1.5},
    }  # fmt: skip
    recording = simulate(tables)
    (slip,) = recording.select(Kind.SLIP)
    assert sentence(recording, slip) == "slides on “floor”"
    (slip,) = (ride := simulate(scene.load("slip"))).select(Kind.SLIP)
    assert sentence(ride, slip) == "begins to slip on the incoming belt"


def test_a_ramp_is_left_by_its_name():
    recording = simulate(
        scene.parse(
            "[[surface]]\nname = 'ramp'\nfrom = [0.0, 0.5]\nto = [1.0, 0.2]\nfriction = 0.1\n"
            "[stream]\nat = [0.3, 0.6]\nvelocity = [0.0, 0.0]\n[run]\nuntil = 1.5\n"
        )
    )
    (event,) = recording.select(Kind.SEPARATION)
    speed = np.hypot(*event["velocity_after"])
    assert sentence(recording, event) == f"leaves “ramp” at {speed:.3g} m/s"
    begin, end = span(recording, laid_out(recording).window)
    words = [shot.words for shot in film(recording, begin, end, fps=25, slow=3.0)]
    assert words[0] == "in flight"
    assert "slides on “ramp”" in words
    assert "rides the incoming belt" not in words


def test_what_was_struck_before_the_separation_does_not_bound_the_window():
    text = TEXT.split("[plate]")[0] + "friction = 0.5\n"
    text += "[stream]\nat = [-0.5, 0.3]\nvelocity = [2.0, 0.0]\n[run]\nuntil = 0.6\n"
    recording = simulate(scene.parse(text))
    (separation,) = recording.select(Kind.SEPARATION)
    assert (recording.select(Kind.IMPACT)["t"] < separation["t"]).all()
    assert laid_out(recording).window.holds(recording.at([0.6])[0][0]).all()


# The stage


def test_actors_stand_where_the_particle_is():
    recording = by_hand()
    times = BELT_TIME + np.array([0.1, t_impact() + 0.05])
    layout = laid_out(recording)
    stage = stage_of(recording, moments_at(times), layout=layout)
    for i, t in enumerate(times):
        drawn = moved(stage, i)
        known, pace = (values[0] for values in (expected(np.array([t - BELT_TIME]))))
        assert np.asarray(drawn["disk"].get_xydata())[0] == pytest.approx(known, abs=1e-14)
        trail = np.asarray(drawn["trail"].get_xydata())
        assert trail[-1] == pytest.approx(known, abs=1e-14)
        begun = expected(np.array([t - BELT_TIME - layout.reach(TRAIL, "trails")]))[0][0]
        assert trail[0] == pytest.approx(begun, abs=0.02)
        strobe = np.asarray(drawn["strobe"].get_xydata())
        passed = 0.05 * np.arange(int(t / 0.05) + 1)
        assert len(strobe) == len(passed)
        flown = passed > BELT_TIME + 1e-9
        assert strobe[flown] == pytest.approx(expected(passed[flown] - BELT_TIME)[0], abs=1e-13)
        assert f"t = {t:.2f} s" == clock(stage, i)
        # A component is drawn only beside another: here both, and the velocity itself.
        arrows = drawn["arrows"]
        assert (arrows.tips - arrows.tails) / layout.arrow == pytest.approx(
            np.array([(pace[0], 0.0), (0.0, pace[1]), pace]), abs=1e-9
        )
        assert arrows.tails == pytest.approx(np.tile(known, (3, 1)), abs=1e-14)


def test_crowd_is_at_the_recorded_positions_and_says_how_many():
    text = TEXT + "[stream]\ncount = 700\nrate = 1000.0\nbed_height = 0.05\n"
    recording = simulate(scene.parse(text))
    times = [0.3, 0.8, 1.2]
    stage = stage_of(recording, moments_at(times))
    # At 0.8 s all 700 fly, each in a place of its own.
    places = recording.at([0.8])[0][0]
    drawn = np.asarray(moved(stage, 1)["crowd"].get_xydata())
    same, particles = (drawn[:, None] == places).all(axis=2).nonzero()
    assert same.tolist() == list(range(299))
    assert len(set(particles) - {0}) == 299
    for i, t in enumerate(times):
        drawn = moved(stage, i)
        positions = recording.at([t])[0][0, particles]
        np.testing.assert_array_equal(drawn["crowd"].get_xydata(), positions)
        # Each trail ends at its particle, and NaN comes before the next one.
        trails = np.asarray(drawn["trails"].get_xydata()).reshape(299, min(i, 1) + 2, 2)
        np.testing.assert_array_equal(trails[:, -2], positions)
        assert np.isnan(trails[:, -1]).all()
    legend = stage.view.get_legend()
    assert legend is not None
    assert "300 of 700" in [entry.get_text() for entry in legend.get_texts()]


def test_particles_are_drawn_to_scale_or_visibly():
    def width(radius):
        text = f"{TEXT}[particle]\nradius = {radius}\n"
        stage = stage_of(simulate(scene.parse(text)), moments_at([0.6]))
        (x0, _), (x1, _) = stage.view.transData.transform([(0.0, 0.0), (2.0 * radius, 0.0)])
        return moved(stage, 0)["disk"].get_markersize() / 72.0 * stage.figure.dpi, x1 - x0

    drawn, true = width(0.05)
    assert drawn == pytest.approx(true, rel=1e-9)
    drawn, true = width(0.001)
    assert drawn == pytest.approx(6.0 / 72.0 * 100.0, rel=1e-9)
    assert drawn > true


def stacked(stage):
    """Return what is painted in each bar, from the bottom up: names, and rows of pixels."""
    shown = np.asarray(stage.frame(0))
    names = {bytes.fromhex(colour[1:]): name for name, colour in style.ENERGY.items()}
    found = []
    for x in (0.0, 1.0):
        column, base = stage.figure.axes[1].transData.transform((x, 0.0))
        pixels = shown[: HEIGHT - round(base), round(column)][::-1]
        rows = [names.get(pixel.tobytes()) for pixel in pixels]
        end = rows.index(None)
        found.append([(str(name), len(list(some))) for name, some in groupby(rows[:end])])
    return found


def test_bars_add_up_to_the_energies_at_all_times():
    times = [0.2, BELT_TIME + 0.2, BELT_TIME + t_impact(), BELT_TIME + t_landing()]
    stage = stage_of(by_hand(), moments_at(times))
    lowest = R + PARTICLE - 0.5 * G * t_landing() ** 2
    at_release = 1e3 * (0.5 * MASS * V**2 + MASS * G * (R + PARTICLE - lowest))
    push = min(MU * MASS * G * t_landing(), MASS * V * (1.0 + EPS))
    for i in range(4):
        put_in, is_now = blocks_of(stage, i)
        assert sum(put_in.values()) == pytest.approx(sum(is_now.values()), rel=1e-12, abs=0.0)
        assert put_in["start"] == pytest.approx(at_release, rel=1e-12, abs=0.0)
        assert figures(stage, i)["start"] == f"{at_release:.1f}"
    assert put_in["belt_work"] == pytest.approx(1e3 * push * V, rel=1e-12, abs=0.0)
    assert is_now["kinetic"] == pytest.approx(
        1e3 * 0.5 * MASS * (push / MASS - EPS * V) ** 2, rel=1e-12, abs=0.0
    )
    fall = 0.5 * G * 0.2**2
    _, is_now = blocks_of(stage, 1)
    assert is_now["kinetic"] == pytest.approx(
        1e3 * 0.5 * MASS * (V**2 + (0.2 * G) ** 2), rel=1e-12, abs=0.0
    )
    assert is_now["potential"] == pytest.approx(
        1e3 * MASS * G * (R + PARTICLE - fall - lowest), rel=1e-11
    )


@pytest.mark.parametrize("planted", [0.0, 0.003, -0.003])
def test_bars_add_up_with_the_residual_in_sight(planted):
    stage = stage_of(by_hand(residual=planted), moments_at([BELT_TIME + t_landing()]))
    put_in, is_now = blocks_of(stage, 0)
    assert sum(put_in.values()) == pytest.approx(sum(is_now.values()), rel=1e-12, abs=0.0)
    if planted:
        shown = put_in["residual"] - is_now["residual"]
        assert shown == pytest.approx(-1e3 * planted, rel=1e-9)
        assert figures(stage, 0)["residual"] == ("−3.0" if planted > 0 else "3.0")
    left, right = (dict(bar) for bar in stacked(stage))
    assert sum(left.values()) == sum(right.values())
    assert ("residual" in left) is (planted < 0.0)
    assert ("residual" in right) is (planted > 0.0)


def test_what_hangs_is_in_the_bars_and_in_the_words():
    """They are as high as the ledger at the end says; the blow is told by the plate's own speed."""
    recording = simulate(scene.load("damper-plate", ["run.until=1.5"]))
    stage = stage_of(recording, moments_at([1.0, 1.5]))
    for index in (0, 1):
        put_in, is_now = blocks_of(stage, index)
        assert sum(put_in.values()) == pytest.approx(sum(is_now.values()), rel=1e-12, abs=0.0)
    ledger = recording.ledger
    assert is_now["kinetic"] == pytest.approx(1e3 * ledger.kinetic[1], rel=1e-9)
    assert is_now["spring"] == pytest.approx(1e3 * ledger.spring[1], rel=1e-6)
    assert is_now["damper_loss"] == pytest.approx(1e3 * ledger.damper_loss, rel=1e-6)
    assert put_in["belt_work"] == pytest.approx(1e3 * ledger.belt_work, rel=1e-6)
    (blow,) = recording.select("impact", surface="plate")
    # Up to the blow nothing but the fall: the step that it ends begins earlier.
    almost = float(blow["t"]) - 1e-4
    falling = 0.5 * MASS * (V**2 + (G * (almost - 0.5)) ** 2)
    assert recording.energy_at([almost])["kinetic"][0] == pytest.approx(falling, rel=1e-9)
    words = sentence(recording, blow)
    assert words.endswith("ε = 0.5\n\N{MINUS SIGN}6.95 mJ in the rebound, −8.77 mJ to the swing")


def falling(*pieces, at=((0.0, 0.5),), **more):
    """Particles that lie at their places for a second, each."""
    rows = [[(0, x, y, 0, 0, 0), (1, x, y, 0, 0, 0)] for x, y in at]
    return recording_of(machine_of(FLOOR, *pieces, at=at, **more), *rows, ended="settled")


def test_rollers_turn_clockwise_and_marks_run_with_belts_and_round_arcs():
    belt = conveyor("second", (-0.3, 0.1), (0.3, 0.2), 0.05, 0.4)
    spoon = Round("spoon", (0.0, 0.5), 0.4, 180.0, 170.0, speed=0.8)
    stage = stage_of(falling(*belt, spoon), moments_at([0.2, 0.25]))
    seen_angles, seen_places = [], []
    forward = np.array([0.6, 0.1]) / np.hypot(0.6, 0.1)
    for index, t in enumerate((0.2, 0.25)):
        drawn = moved(stage, index)
        holes = [one for one, _ in stage.moving if one.get_gid() == "holes second"]
        places = [np.asarray(one.get_xydata()) for one in holes]
        for center, three in zip([(-0.3, 0.1), (0.3, 0.2)], places, strict=True):
            angle = 0.4 * t / 0.05
            first = 0.6 * 0.05 * np.array([np.sin(angle), np.cos(angle)])
            assert three[0] - center == pytest.approx(first, abs=1e-14)
            assert np.hypot(*(three - center).T) == pytest.approx(0.03, rel=1e-12)
        away = np.asarray(drawn["marks"].get_xydata()) - (0.0, 0.5)
        straight = (away - (-0.3, -0.4)) @ forward
        above = (away - (-0.3, -0.4)) @ [-forward[1], forward[0]]
        seen_places.append(straight[np.abs(above - 0.05) < 1e-9])
        on_spoon = away[np.abs(np.hypot(*away.T) - 0.4) < 1e-12]
        # Clockwise from the lowest point.
        seen_angles.append(np.arctan2(-on_spoon[:, 0], -on_spoon[:, 1]))
    for (first, later), moved_by in ((seen_angles, 0.8 * 0.05 / 0.4), (seen_places, 0.4 * 0.05)):
        assert len(first) > 1
        turned = np.abs(later[:, None] - first - moved_by).min(axis=1)
        # All but one that came in at an end.
        assert np.count_nonzero(turned < 1e-9) >= len(later) - 1


def test_a_gate_is_seen_while_it_is_there():
    gate = Line("gate", (-0.3, 0.25), (0.3, 0.25), vanishes=0.4)
    flap = Line("flap", (-0.3, 0.35), (0.3, 0.35), appears=0.7)
    times = [0.1, np.nextafter(0.4, 0.0), 0.4, 0.7, 0.9]
    recording = falling(gate, flap)
    layout = laid_out(recording)
    wide = Window(-0.6, 0.6, -0.1, 0.6).fitted(layout.window.width / layout.window.height)
    stage = stage_of(recording, moments_at(times), layout=replace(layout, window=wide))
    seen_there = []
    for index in range(len(times)):
        shown = np.asarray(stage.frame(index)).astype(int)
        rows = []
        for y in (0.25, 0.35):
            left, up = stage.view.transData.transform((-0.29, y))
            right = stage.view.transData.transform((0.29, y))[0]
            row = shown[HEIGHT - 1 - round(up), round(left) : round(right)]
            rows.append(bool((row.max(axis=1) < 60).all()))
        seen_there.append(rows)
    assert seen_there == [
        [True, False], [True, False], [False, False], [False, True], [False, True],
    ]  # fmt: skip


def test_names_go_along_with_what_leaves_its_place():
    turning = """
        [[surface]]
        name = "{name}"
        from = [{x}, -0.02]
        to = [{x}, 0.02]
        {moves}
    """
    turns = "pivot = [0.0, 0.0]\nturn = 90.0"
    shakes = "shake = { by = [0.0, 0.002], frequency = 5.0 }"
    text = """
        [run]
        until = 2.1
        [particle]
        radius = 0.01
        [stream]
        count = 1
        at = [0.0, 0.3]
        velocity = [0.0, 0.0]
    """ + "".join(
        turning.format(name=name, x=x, moves=moves)
        for name, x, moves in (("one", -0.2, turns), ("two", 0.2, turns), ("near", 0.1, shakes))
    )
    recording = simulate(scene.parse(text))
    layout = laid_out(recording)
    wide = Window(-0.4, 0.4, -0.4, 0.4).fitted(layout.window.width / layout.window.height)
    times = (0.0, 0.5, 1.0, 2.0)
    stage = stage_of(recording, moments_at(times), layout=replace(layout, window=wide))
    for index, t in enumerate(times):
        drawn = moved(stage, index)
        assert {gid for gid in drawn if "name" in gid} == {"name one", "name two"}
        for name, side in (("one", -1.0), ("two", 1.0)):
            turned = np.radians(90.0) * t
            middle = stage.view.transData.transform(
                (side * 0.2 * np.cos(turned), side * 0.2 * np.sin(turned))
            )
            box = drawn[f"name {name}"].get_window_extent()
            away = np.maximum(np.maximum(box.min - middle, middle - box.max), 0.0)
            # Half of its surface's length, and the gap beside it.
            assert np.hypot(*away) < 0.02 / wide.width * stage.view.get_window_extent().width + 12.0


@pytest.mark.parametrize(
    ("name", "surface"), [("flap-gate", "flap"), ("see-saw", "plank"), ("drum", "drum")]
)
def test_no_surface_moves_over_a_name_that_stays(name, surface):
    recording = simulate(name)
    stage = stage_of(recording, moments_at(tuple(np.linspace(*recording.t[[0, -1]], 40))))
    (still,) = (one for one in stage.view.texts if one.get_gid() == f"name {surface}")
    box = still.get_window_extent()
    for index in range(40):
        (own,) = (one for gid, one in moved(stage, index).items() if gid == f"surface {surface}")
        line = stage.view.transData.transform(own.get_xydata())
        assert not Outline(line).intersects_bbox(box, filled=False), index


def test_a_film_of_many_is_of_all_of_them_to_the_end():
    spots = [(0.015 * (i % 40) - 0.3, 0.01 + 0.015 * (i // 40)) for i in range(400)]
    machine = machine_of(
        FLOOR, Line("gate", (-0.1, 0.3), (0.1, 0.3), vanishes=0.4), at=spots, radius=0.007,
        interact=True,
    )  # fmt: skip
    # Particle 0 leaves early; nothing repeats after it.
    rows = [[(0, x, y, 0, 0, 0), (0.1 if not i else 2, x, y, 0, 0, 0)]
            for i, (x, y) in enumerate(spots)]  # fmt: skip
    recording = recording_of(machine, *rows, ended="exit")
    shots, slow = filmed(recording)
    assert shots[-1].t == 2.0
    assert {shot.delay for shot in shots[:-1]} == {4}
    gate = "t = 0.400 s: “gate” opens"
    for shot in shots:
        told = 0.4 <= shot.t <= 0.4 + moments.TOLD / slow
        left = 0 if shot.t < 0.1 else 1 if shot.t < 2.0 else 400
        assert shot.words == (gate if told else f"400 released, {left} left the scene")
    stage = stage_of(recording, shots, slow)
    drawn = moved(stage, 10)
    assert len(np.asarray(drawn["crowd"].get_xydata())) == 399
    # To scale: none covers its neighbours.
    (x0, _), (x1, _) = stage.view.transData.transform([(0.0, 0.0), (0.014, 0.0)])
    assert drawn["crowd"].get_markersize() / 72.0 * stage.figure.dpi == pytest.approx(x1 - x0)
    assert not set(drawn) & {"strobe", "arrows", "trails"}
    assert_readable(stage, 10)


def test_strings_end_at_their_particles():
    joints = (Joint("string", 0, 0.4, (0.0, 0.9)), Joint("string", 1, 0.5, (0.3, 0.9)))
    recording = falling(at=[(0.0, 0.5), (0.3, 0.5)], joints=joints)
    path = np.asarray(moved(stage_of(recording, moments_at([0.5])), 0)["strings"].get_xydata())
    first, second, _ = np.split(path, np.flatnonzero(np.isnan(path[:, 0])) + 1)
    assert first[[0, -2]] == pytest.approx(np.array([(0.0, 0.9), (0.0, 0.5)]))
    assert second[[0, -2]] == pytest.approx(np.array([(0.3, 0.9), (0.3, 0.5)]))


def test_what_is_not_asked_for_is_not_shown():
    recording, at = by_hand(), moments_at([BELT_TIME + 0.2])
    full = stage_of(recording, at)
    bare = stage_of(recording, at, layout=laid_out(recording, shows=frozenset()))
    assert set(moved(full, 0)) - set(moved(bare, 0)) == {"trail", "strobe", "arrows"}
    assert any(blocks_of(full, 0))
    assert not any(blocks_of(bare, 0))
    analytic = [{line.get_gid() for line in stage.view.lines} for stage in (full, bare)]
    assert ["analytic" in one for one in analytic] == [True, False]


def test_title_and_question_are_shown_and_cut_at_words():
    recording, at = by_hand(), moments_at([0.6])
    asked = "Where does it land?"
    stage = stage_of(recording, at, layout=laid_out(recording, title="Mine", question=asked))
    said = [text.get_text() for text in stage.figure.texts]
    assert "Mine" in said
    assert asked in said
    assert recording.title not in said
    long = "word " * 40
    stage = stage_of(recording, at, layout=laid_out(recording, title=long, question=long))
    cut = [text for text in stage.figure.texts if text.get_text().startswith("word")]
    assert len(cut) == 2
    for text in cut:
        assert text.get_text().endswith("word …")
        assert 0.8 * WIDTH < text.get_window_extent().x1 <= 0.99 * WIDTH


def test_frames_leave_no_traces_in_each_other(runs):
    stage = stage_of(runs["perpendicular"], moments_at([0.5, 0.7, 0.9]))
    first = np.asarray(stage.frame(0))
    last = np.asarray(stage.frame(2))
    assert (first != last).any()
    np.testing.assert_array_equal(stage.frame(0), first)
    assert first.shape == (HEIGHT, WIDTH, 3)
    fresh = stage_of(runs["perpendicular"], moments_at([0.9]))
    # The scale of the bars is another with other times; the scene is not.
    scene_alone = np.s_[75:390, :555]
    np.testing.assert_array_equal(np.asarray(fresh.frame(0))[scene_alone], last[scene_alone])


@pytest.mark.parametrize("name", some(["domino-gate", "see-saw", "bucket-elevator", "hopper"], 2))
def test_parts_hold_all_that_changes_and_lines_are_as_matplotlib_draws_them(name):
    recording = simulate(name)
    shots, slow = filmed(recording)
    shots = shots[:: len(shots) // 7]
    stage, plain = (stage_of(recording, shots, slow) for _ in range(2))
    plain._painters = [
        artist if isinstance(artist, Arrows) else Itself(artist) for artist, _ in plain.moving
    ]
    before = np.array(stage.frame(0))
    for index in range(1, len(shots)):
        shown, parts = stage.paint(index)
        still = np.ones((HEIGHT, WIDTH), dtype=bool)
        for part in parts:
            still[part] = False
        changes = (shown[..., :3] != before).any(axis=2)
        assert changes.any()
        assert not changes[still].any()
        before = shown[..., :3].copy()
        np.testing.assert_array_equal(before, plain.frame(index))


@pytest.mark.parametrize("look", [{"ls": "none", "marker": "o", "ms": 9.0}, {"lw": 5.0}])
def test_parts_hold_what_is_drawn_on_the_edges_of_axes(look):
    """The axes begin between two of 100 pixels."""
    around = [0.0, 0.0, 1.0, 1.0, 0.0], [0.0, 1.0, 1.0, 0.0, 0.0]
    for share in (0.3, 0.301, 0.304, 0.305, 0.306, 0.309):
        figure = style.Picture((1.0, 1.0), 100)
        axes = figure.add_axes((share, share, 0.4, 0.4), xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        axes.set_axis_off()
        (line,) = axes.plot(*around, animated=True, **look)
        canvas = Canvas(figure)
        still, before = np.ones((100, 100), dtype=bool), canvas.pixels.copy()
        for part in painter(line).paint(canvas):
            still[part] = False
        changes = canvas.pixels != before
        assert changes.any()
        assert not changes[still].any()


def boxes_of(stage, index):
    """Return where text is in the picture, what is painted as pixels included."""
    found = [(text.get_text(), text.get_window_extent()) for text in seen(stage.figure)]
    for text in seen(stage.figure):
        assert text.get_fontsize() >= 9.0, text
    draw = ImageDraw.Draw(Image.new("RGB", (WIDTH, HEIGHT)))
    for one in stage.writings:
        text = one.said[index]
        left, top, right, bottom = draw.textbbox(one.place, text, one.font, one.anchor)
        found.append((text, Bbox.from_extents(left, HEIGHT - bottom, right, HEIGHT - top)))
    return found


def assert_readable(stage, index):
    stage.frame(index)
    boxes = boxes_of(stage, index)
    for text, box in boxes:
        assert min(box.x0, box.y0) >= 0.0, text
        assert box.x1 <= WIDTH, text
        assert box.y1 <= HEIGHT, text
    for i, (text, box) in enumerate(boxes):
        for other, near in boxes[:i]:
            overlap = min(box.x1, near.x1) - max(box.x0, near.x0)
            above = min(box.y1, near.y1) - max(box.y0, near.y0)
            assert min(overlap, above) < 1.5, (text, other)


@pytest.mark.parametrize("name", some([*EXACT, "free-fall"]))
def test_no_text_is_cut_off_overlapping_or_small(name, runs):
    shots, slow = filmed(runs[name])
    layout = laid_out(runs[name], question="How much of the energy is left when it lands?")
    stage = stage_of(runs[name], shots, slow, layout)
    longest = max(range(len(shots)), key=lambda i: max(map(len, shots[i].words.split("\n"))))
    for index in (0, longest, len(shots) - 1):
        assert_readable(stage, index)


# The file


class Block(NamedTuple):
    left: int
    top: int
    width: int
    height: int
    delay: int
    keeps: bool


def blocks(data):
    """Read the frames of a GIF by its specification; no frame may have colours of its own."""
    at, found = 13 + 3 * 2 ** ((data[10] & 7) + 1), []
    delay, keeps = 0, False
    while data[at : at + 1] != b";":
        if data[at : at + 2] == b"!\xf9":
            delay, keeps = int.from_bytes(data[at + 4 : at + 6], "little"), data[at + 3] >> 2 == 1
        if data[at : at + 1] == b",":
            left, top, width, height = np.frombuffer(data[at + 1 : at + 9], "<u2").tolist()
            assert data[at + 9] == 0, "a palette of its own"
            found.append(Block(left, top, width, height, delay, keeps))
            at += 11
        else:
            at += 2
        while data[at]:
            at += data[at] + 1
        at += 1
    assert at == len(data) - 1
    return found


def test_gif_reads_back_frame_by_frame_and_is_the_same_again(tmp_path):
    recording, fps = by_hand(), 25
    size = {"slow": 1.5, "fps": fps, "width": 320, "height": 180}
    path = animate(recording, tmp_path / "lesson.gif", **size)
    assert path == tmp_path / "lesson.gif"
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == animate(by_hand(), tmp_path / "again.gif", **size).read_bytes()
    begin, end = span(recording, laid_out(recording, 320, 180).window)
    shots = film(recording, begin, end, fps=fps, slow=1.5)
    with Image.open(path) as gif:
        assert gif.size == (320, 180)
        assert gif.info["loop"] == 0
        assert gif.n_frames == len(shots)
        for i, shot in enumerate(shots):
            gif.seek(i)
            assert gif.info["duration"] == 10 * shot.delay
    frames = blocks(path.read_bytes())
    assert [frame.delay for frame in frames] == [shot.delay for shot in shots]
    # Exactly 25 frames a second, but for the holds.
    assert {frame.delay for frame in frames} == {4, 130}
    assert all(frame.keeps for frame in frames)
    assert frames[0][:4] == (0, 0, 320, 180)
    assert all(frame.width * frame.height < 320 * 180 for frame in frames[1:])


@pytest.mark.slow
def test_colours_are_nearly_the_stages_and_what_stands_still_keeps_its_own(runs, tmp_path):
    recording = runs["free-fall"]
    path = animate(recording, tmp_path / "lesson.gif", fps=2, width=WIDTH, height=HEIGHT)
    shots, slow = filmed(recording)
    shots = film(recording, shots[0].t, shots[-1].t, fps=2, slow=slow)
    stage = stage_of(recording, shots, slow)
    drawn = np.array([stage.frame(i) for i in range(len(shots))]).astype(int)
    with Image.open(path) as gif:
        assert gif.n_frames == len(shots)
        shown = []
        for i in range(len(shots)):
            gif.seek(i)
            shown.append(np.asarray(gif.convert("RGB")))
    # Nearly the stage's own colours, and white is white.
    off = np.abs(np.array(shown).astype(int) - drawn).max(axis=3)
    assert off.mean() < 0.8
    assert np.quantile(off, 0.999) <= 40
    assert (np.array(shown)[drawn.min(axis=3) == 255] == 255).all()
    still = (drawn == drawn[0]).all(axis=(0, 3))
    assert 0.8 < still.mean() < 1.0
    assert (np.array(shown)[:, still] == shown[0][still]).all()
    # And the same colour is shown as the same one wherever and whenever it is drawn.
    place = np.array([1, 256, 65536])
    drawn, shown = drawn @ place, np.array(shown) @ place
    shows = np.zeros(1 << 24, dtype=np.int64)
    shows[drawn] = shown
    assert (shows[drawn] == shown).all()


def written(pictures, delays):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "written.gif"
        opaque = (np.dstack([one, np.full(one.shape[:2], 255, np.uint8)]) for one in pictures)
        whole = [(slice(0, None), slice(0, None))]
        write_gif(path, ((one, whole) for one in opaque), delays)
        return path.read_bytes()


@given(st.integers(0, 2**32 - 1), st.integers(2, 40), st.integers(1, 30), st.integers(2, 5))
@settings(max_examples=20)
def test_any_pictures_come_back_from_the_file(seed, w, h, count):
    draw = np.random.default_rng(seed)
    table = np.array([list(bytes.fromhex(colour[1:])) for colour in palette()], np.uint8)
    pictures = [draw.integers(0, len(table), (h, w))]
    for _ in range(count - 1):
        pictures.append(pictures[-1].copy())
        pictures[-1][draw.random((h, w)) < 0.1] = draw.integers(len(table))
    # So that no two in a row are alike.
    for i, picture in enumerate(pictures):
        picture[0, 0] = i % 2
    coloured = [table[picture] for picture in pictures]
    with Image.open(BytesIO(written(coloured, [4] * count))) as gif:
        assert gif.n_frames == count
        for i, picture in enumerate(coloured):
            gif.seek(i)
            np.testing.assert_array_equal(np.asarray(gif.convert("RGB")), picture)


def test_only_what_changed_is_in_a_frame_and_what_stays_is_one_frame():
    white = np.full((20, 30, 3), 255, dtype=np.uint8)
    dotted = white.copy()
    dotted[7:9, 11:14] = 0
    data = written([white, white, dotted, dotted, white], [4, 4, 130, 4, 4])
    assert [frame[:5] for frame in blocks(data)] == [
        (0, 0, 30, 20, 8), (11, 7, 3, 2, 134), (11, 7, 3, 2, 4),
    ]  # fmt: skip


def test_failure_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "lesson.gif"
    path.write_text("old")
    drawn = Stage.paint

    def breaks(self, index):
        if index == 7:
            raise RuntimeError("planted")
        return drawn(self, index)

    monkeypatch.setattr(Stage, "paint", breaks)
    with pytest.raises(RuntimeError, match="planted"):
        animate(by_hand(), path, fps=10, slow=4.0)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


# Videos


@pytest.mark.parametrize("kind", some(video.VIDEOS, len(video.VIDEOS)))
def test_video_shows_the_stage_at_its_rate(kind, tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    recording = by_hand()
    path = animate(recording, tmp_path / f"lesson.{kind}", fps=10, slow=1.0, width=320, height=180)
    assert list(tmp_path.iterdir()) == [path]
    layout = laid_out(recording, 320, 180)
    shots = film(recording, *span(recording, layout.window), fps=10, slow=1.0)
    stage = stage_of(recording, shots, 1.0, layout)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert frames == sum(shot.delay for shot in shots) / 10
    assert seconds == pytest.approx(0.1 * frames, abs=0.01)
    done = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    )
    decoded = np.frombuffer(done.stdout, np.uint8).reshape(frames, 180, 320, 3).astype(int)
    for shown, index in ((decoded[0], 0), (decoded[-1], len(shots) - 1)):
        assert np.abs(shown - np.asarray(stage.frame(index))).mean() < 4.0


# The command line


@pytest.mark.slow
def test_films_and_the_still_can_be_chosen(tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    arguments = ["--only", "json,gif,strobe", "--format", "mp4"]
    files, out = ["lesson.mp4", "strobe.png", "summary.json"], tmp_path / "out"
    short = ["run", "perpendicular", "--set", "run.until=0.2"]
    result = call(*short, "--out", str(out), *arguments)
    assert all(name in result.output.partition("wrote into")[2] for name in files)
    assert sorted(path.name for path in out.iterdir()) == files


@pytest.mark.parametrize(
    ("name", "by"),
    [
        ("see-saw", ()),
        ("damper-plate", ("belt_work",)),
        ("slip", ("belt_work",)),
        ("drum", ("drives",)),
        ("arch", ()),
    ],
)
def test_hinges_whose_energy_is_known_of_whole_runs_only_are_told_as_what_gives_it(name, by):
    assert paid_by(simulate(name)) == by
    assert name != "see-saw" or paid_by(simulate(name, engine="pymunk")) == ("hinges",)


@pytest.mark.parametrize(
    ("turned", "pushed", "paid"),
    [
        (False, True, "belt work, pushes"), (True, True, "drives, hinges, pushes"),
        pytest.param(False, False, "belt work", marks=pytest.mark.slow),
        pytest.param(True, False, "drives, hinges", marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_what_pushes_do_beside_belts_and_a_plate_turned_by_hand_has_their_name(
    turned, pushed, paid
):
    run = chutelab.start("perpendicular")
    run.step(0.3)
    if turned:
        run.set("plate.angle_deg", 5.0)
    if pushed:
        run.push(0, (0.01, 0.0))
    run.step(0.2)
    made = run.recording
    stage = stage_of(made, moments_at((0.1, 0.4)))
    assert paid in {one.get_text() for one in stage.figure.findobj(Text)}
    (line,) = chutelab.overlay(made).findobj(lambda one: one.get_gid() == "supplied")
    assert " ".join(line.get_label().split()) == f"at release + {paid}"


@pytest.mark.parametrize(("height", "places"), [(5.0, 1), (20.0, 2)])
def test_the_rows_of_a_ledger_add_up_in_three_digits(height, places):
    """20 g that fall from 5 m have m g h = 981 mJ, from 20 m 3.92 J; ε² of it is left."""
    run = simulate(scene.from_dict({
        "particle": {"radius": 0.01, "mass": 0.02},
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "restitution": 0.95}],
        "stream": {"at": [0.0, height + 0.01], "velocity": [0.0, 0.0]}, "run": {"until": 2.5},
    }))  # fmt: skip
    energy = 0.02 * 9.81 * height
    factor = 1.0 if energy >= 1.0 else 1e3
    rows = [one.said[0] for one in stage_of(run, moments_at([2.5])).writings[2:]]
    names = ("start", "kinetic", "potential", "restitution_loss", "friction_loss")
    told = dict(zip(names, rows, strict=True))
    assert told["start"] == f"{factor * energy:.{places}f}"
    blows = len(run.select(Kind.IMPACT))
    lost = energy * (1.0 - 0.95 ** (2 * blows))
    assert told["restitution_loss"] == f"{factor * lost:.{places}f}"
    now = sum(float(told[name]) for name in ("kinetic", "potential", "restitution_loss"))
    assert now == pytest.approx(factor * energy, abs=2.0 * 10.0**-places)
