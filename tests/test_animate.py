from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from chutelab import scene, theory
from chutelab.animate import animate, moments
from chutelab.animate.bars import SIGNS, stacks
from chutelab.animate.gif import PURE, shared_palette
from chutelab.animate.moments import Moment, film, slowness, span
from chutelab.animate.stage import VIEW, Stage
from chutelab.animate.words import contact_normal, sentence
from chutelab.machine import build
from chutelab.plots.sampling import energies
from chutelab.plots.scenery import machine_of, scene_of
from chutelab.plots.window import window_of
from chutelab.recorder import Recorder
from chutelab.recording import Kind, Recording
from chutelab.simulation import simulate
from test_plots import (
    BELT_TIME,
    DISTANCE,
    EPS,
    EXACT,
    MASS,
    MU,
    PARTICLE,
    TEXT,
    G,
    R,
    V,
    by_hand,
    expected,
    seen,
    t_impact,
    t_landing,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

WIDTH, HEIGHT = 800, 450


def moments_at(times: Sequence[float]) -> tuple[Moment, ...]:
    return tuple(Moment(t, 4, "") for t in times)


def stage_of(recording: Recording, at: tuple[Moment, ...], slow: float = 5.0) -> Stage:
    machine = machine_of(recording)
    return Stage(
        recording,
        machine,
        theory.predict(scene_of(recording)),
        window_of(recording, machine).fitted(VIEW[2] * WIDTH / (VIEW[3] * HEIGHT)),
        at,
        slow=slow,
        width=WIDTH,
        height=HEIGHT,
    )


@pytest.fixture(scope="module")
def runs() -> dict[str, Recording]:
    names = (*EXACT, "free-fall")
    return {name: simulate(scene.load(scene.find(name))) for name in names}


def filmed(recording: Recording) -> tuple[tuple[Moment, ...], float]:
    begin, end = span(recording, window_of(recording, machine_of(recording)))
    slow = slowness(end - begin)
    return film(recording, begin, end, fps=25, slow=slow), slow


def recorded(*events: tuple[Kind, float, float, float]) -> Recording:
    """Particle 0 with events of (kind, s, m/s along x, N s) on the incoming belt."""
    machine = build(scene.parse(TEXT))
    recorder = Recorder(1, machine.surfaces)
    for kind, t, speed, push in events:
        velocity = np.array([speed, 0.0])
        recorder.knots([0], [t], np.zeros(2), velocity, 0.0)
        recorder.events(kind, [0], [t], np.zeros(2), velocity, surface=0, normal_impulse=push)
    return recorder.finish(
        scene=machine.scene, title="Told", engine="exact", particle=machine.particle,
        gravity=G, steps=0, seconds=0.0,
    )  # fmt: skip


# Which moments


@pytest.mark.parametrize(("fps", "delay"), [(25, 4), (50, 2)])
def test_film_runs_evenly_and_holds_at_both_impacts(fps: int, delay: int) -> None:
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


def test_film_holds_at_the_hardest_four_impacts_in_their_order() -> None:
    pushes = [0.1, 1.0, 0.2, 0.8, 0.3, 0.9, 0.04, 0.7]
    impacts = [(Kind.IMPACT, 0.1 * (i + 1), 1.0, push) for i, push in enumerate(pushes)]
    shots = film(recorded((Kind.RELEASE, 0.0, 1.0, 0.0), *impacts), 0.0, 1.0, fps=25, slow=5.0)
    held = [shot.t for shot in shots[:-1] if shot.delay != 4]
    assert held == pytest.approx([0.2, 0.4, 0.6, 0.8], abs=1e-15)
    assert {shot.delay for shot in shots[:-1]} == {4, 75}
    # Of equally hard ones the first.
    impacts = [(Kind.IMPACT, 0.1 * (i + 1), 1.0, 1.0) for i in range(6)]
    shots = film(recorded((Kind.RELEASE, 0.0, 1.0, 0.0), *impacts), 0.0, 1.0, fps=25, slow=5.0)
    held = [shot.t for shot in shots[:-1] if shot.delay != 4]
    assert held == pytest.approx([0.1, 0.2, 0.3, 0.4], abs=1e-15)


@pytest.mark.parametrize("fps", [30, 60, 0, -25, 100])
def test_rates_a_gif_cannot_have_are_refused(fps: int, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="whole hundredths"):
        animate(by_hand(), tmp_path / "lesson.gif", fps=fps)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "options",
    [{"slow": 0.0}, {"slow": float("nan")}, {"slow": -1.0}, {"width": 319}, {"height": 100}],
)
def test_other_impossible_wishes_are_refused(options: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="allowed"):
        animate(by_hand(), tmp_path / "lesson.gif", **options)
    assert not list(tmp_path.iterdir())


@given(st.floats(1e-3, 1e4))
def test_slowness_is_round_and_fills_the_time(length: float) -> None:
    slow = slowness(length)
    assert float(f"{slow:.1e}") == slow
    assert moments.RUNNING / 1.51 < slow * length <= moments.RUNNING * (1.0 + 1e-8)


def test_loops_take_five_to_ten_seconds(runs: dict[str, Recording]) -> None:
    for name, recording in runs.items():
        shots, _ = filmed(recording)
        assert 5.0 <= 0.01 * sum(shot.delay for shot in shots) <= 10.2, name


def test_film_begins_as_the_particle_comes_into_view(runs: dict[str, Recording]) -> None:
    recording = runs["perpendicular"]
    window = window_of(recording, machine_of(recording))
    begin, end = span(recording, window)
    x = -1.0 + 2.0 * begin
    assert window.left < x < window.left + 0.01
    assert end == recording.track(0)["t"][-1]


def test_a_long_stream_is_filmed_for_three_lives_of_particle_0() -> None:
    text = TEXT + "[stream]\ncount = 100\nrate = 10.0\nbed_height = 0.02\n"
    recording = simulate(scene.parse(text))
    begin, end = span(recording, window_of(recording, machine_of(recording)))
    life = recording.track(0)["t"][-1] - begin
    assert end - begin == pytest.approx(3.0 * life, rel=1e-12)
    assert end < recording.knots["t"].max()


# Words


def test_words_tell_the_numbers_of_the_impacts() -> None:
    recording = by_hand()
    shots = film(recording, 0.4, BELT_TIME + t_landing(), fps=25, slow=8.0)
    said = {round(shot.t, 6): shot.words for shot in shots}
    at_plate = said[round(BELT_TIME + t_impact(), 6)]
    speed = np.hypot(V, G * t_impact())
    lost = 0.5 * MASS * V**2 * (1.0 - EPS**2)
    assert at_plate == (
        f"t = {BELT_TIME + t_impact():.3f} s: strikes the plate at {speed:.3g} m/s;"
        f" normal speed 2 m/s → 1 m/s\n{1e3 * lost:.1f} mJ lost in the rebound"
    )
    on_belt = said[round(BELT_TIME + t_landing(), 6)]
    push = min(MU * MASS * G * t_landing(), MASS * V * (1.0 + EPS))
    assert f"lands on the outgoing belt at {np.hypot(EPS * V, G * t_landing()):.3g} m/s" in on_belt
    assert f"{1e3 * push * V:.1f} mJ paid by the belt" in on_belt
    assert shots[0].words == "rides the incoming belt"
    between = [shot.words for shot in shots if BELT_TIME < shot.t < BELT_TIME + t_impact()]
    assert set(between) == {"t = 0.500 s: leaves the drive pulley at the top, at 2 m/s"}


@pytest.mark.parametrize(("rode", "said"), [(2.0, False), (2.001, False), (2.1, True)])
def test_a_stick_right_after_release_is_told_if_the_speed_changed(rode: float, said: bool) -> None:
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
    recording = recorded(
        release, (Kind.SLIP, 0.05, 2.0, 0.0), stick, (Kind.SEPARATION, 0.5, 2.0, 0.0)
    )
    shots = film(recording, 0.0, 1.0, fps=25, slow=5.0)
    words = {shot.words for shot in shots if 0.15 < shot.t < 0.45}
    assert words == {f"t = 0.100 s: {sentence(recording, recording.events[2])}"}


@given(st.floats(-3.1, 3.1), st.floats(0.1, 5.0), st.floats(-5.0, 5.0), st.floats(0.001, 10.0))
def test_contact_normal_follows_from_the_impulses(
    angle: float, normal: float, tangential: float, mass: float
) -> None:
    n = np.array([np.cos(angle), np.sin(angle)])
    pushed = normal * n + tangential * np.array([n[1], -n[0]])
    event = {
        "velocity_before": np.zeros(2),
        "velocity_after": pushed / mass,
        "normal_impulse": normal,
        "tangential_impulse": tangential,
    }
    assert contact_normal(event, mass) == pytest.approx(n, abs=1e-14)


def test_separation_is_told_by_its_angle(runs: dict[str, Recording]) -> None:
    recording = runs["low-speed"]
    (event,) = recording.select(Kind.SEPARATION)
    angle = np.degrees(np.arccos(2.0**2 / (9.81 * 0.504)))
    assert f"{angle:.1f}° past the top, at 2 m/s" in sentence(recording, event)


def test_every_kind_of_event_can_be_told(runs: dict[str, Recording]) -> None:
    told = {
        Kind(int(event["kind"])): sentence(runs[name], event)
        for name in runs
        for event in runs[name].events
        if event["particle"] == 0
    }
    assert told[Kind.SETTLE].startswith("has settled on")
    assert set(told) >= {Kind.RELEASE, Kind.SEPARATION, Kind.IMPACT, Kind.LANDING, Kind.SETTLE}


# The stage


def test_actors_stand_where_the_particle_is() -> None:
    recording = by_hand()
    times = BELT_TIME + np.array([0.1, t_impact() + 0.05])
    stage = stage_of(recording, moments_at(times))
    for i, t in enumerate(times):
        stage.show(i)
        known = expected(np.array([t - BELT_TIME]))[0]
        assert np.asarray(stage.nominal.dot.get_xydata()) == pytest.approx(known, abs=1e-14)
        trail = np.asarray(stage.nominal.trail.get_xydata())
        assert trail[-1] == pytest.approx(known[0], abs=1e-14)
        assert trail[0] == pytest.approx([-1.0, R + PARTICLE], abs=1e-15)
        strobe = np.asarray(stage.nominal.strobe.get_xydata())
        passed = 0.05 * np.arange(int(t / 0.05) + 1)
        assert len(strobe) == len(passed)
        flown = passed > BELT_TIME + 1e-9
        assert strobe[flown] == pytest.approx(expected(passed[flown] - BELT_TIME)[0], abs=1e-13)
        assert f"t = {t:.3f} s, 5× slower" == stage.clock.get_text()


def test_dashed_parabola_in_the_background_is_the_formula() -> None:
    stage = stage_of(by_hand(), moments_at([0.6]))
    (dashed,) = [one for one in stage.view.lines if one.get_gid() == "analytic"]
    assert dashed.is_dashed()
    assert not dashed.get_animated()
    x, y = np.asarray(dashed.get_xydata()).T
    down = np.arange(len(x)) <= np.argmax(x)
    hit = R + DISTANCE - PARTICLE
    since = np.where(down, x / V, t_impact() + (hit - x) / (EPS * V))
    assert y == pytest.approx(R + PARTICLE - 0.5 * G * since**2, abs=1e-14)


def test_crowd_is_at_the_recorded_positions_and_says_how_many() -> None:
    text = TEXT + "[stream]\ncount = 700\nrate = 1000.0\nbed_height = 0.05\n"
    recording = simulate(scene.parse(text))
    times = [0.3, 0.8, 1.2]
    stage = stage_of(recording, moments_at(times))
    assert len(stage.crowd.particles) == 299
    assert 0 not in stage.crowd.particles
    for i, t in enumerate(times):
        stage.show(i)
        positions = recording.at([t])[0][0, stage.crowd.particles]
        np.testing.assert_array_equal(stage.crowd.dots.get_xydata(), positions)
    legend = stage.view.get_legend()
    assert legend is not None
    assert "300 of 700 particles" in [entry.get_text() for entry in legend.get_texts()]


def test_particles_are_drawn_to_scale_or_visibly() -> None:
    def width(radius: float) -> tuple[float, float]:
        text = f"{TEXT}[particle]\nradius = {radius}\n"
        stage = stage_of(simulate(scene.parse(text)), moments_at([0.6]))
        (x0, _), (x1, _) = stage.view.transData.transform([(0.0, 0.0), (2.0 * radius, 0.0)])
        return stage.nominal.dot.get_markersize() / 72.0 * stage.figure.dpi, x1 - x0

    drawn, true = width(0.05)
    assert drawn == pytest.approx(true, rel=1e-9)
    drawn, true = width(0.001)
    assert drawn == pytest.approx(6.0 / 72.0 * 100.0, rel=1e-9)
    assert drawn > true


def heights(stage: Stage) -> list[dict[str, float]]:
    return [{name: bar.get_height() for name, bar in bars.items()} for bars in stage.bars.bars]


def test_bars_add_up_to_the_energies_at_all_times() -> None:
    times = [0.2, BELT_TIME + 0.2, BELT_TIME + t_impact(), BELT_TIME + t_landing()]
    stage = stage_of(by_hand(), moments_at(times))
    lowest = R + PARTICLE - 0.5 * G * t_landing() ** 2
    at_release = 1e3 * (0.5 * MASS * V**2 + MASS * G * (R + PARTICLE - lowest))
    push = min(MU * MASS * G * t_landing(), MASS * V * (1.0 + EPS))
    for i in range(4):
        stage.show(i)
        put_in, is_now = heights(stage)
        assert sum(put_in.values()) == pytest.approx(sum(is_now.values()), rel=1e-12)
        assert put_in["start"] == pytest.approx(at_release, rel=1e-12)
    assert put_in["belt_work"] == pytest.approx(1e3 * push * V, rel=1e-12)
    assert is_now["kinetic"] == pytest.approx(
        1e3 * 0.5 * MASS * (push / MASS - EPS * V) ** 2, rel=1e-12
    )
    stage.show(1)
    fall = 0.5 * G * 0.2**2
    _, is_now = heights(stage)
    assert is_now["kinetic"] == pytest.approx(1e3 * 0.5 * MASS * (V**2 + (0.2 * G) ** 2), rel=1e-12)
    assert is_now["potential"] == pytest.approx(
        1e3 * MASS * G * (R + PARTICLE - fall - lowest), rel=1e-11
    )
    # Each bar rests on the one before it.
    for bars in stage.bars.bars:
        base = 0.0
        for bar in bars.values():
            assert bar.get_y() == pytest.approx(base, abs=1e-12)
            base += bar.get_height()


@pytest.mark.parametrize("planted", [0.003, -0.003])
def test_bars_add_up_with_the_residual_in_sight(planted: float) -> None:
    stage = stage_of(by_hand(residual=planted), moments_at([BELT_TIME + t_landing()]))
    stage.show(0)
    put_in, is_now = heights(stage)
    assert sum(put_in.values()) == pytest.approx(sum(is_now.values()), rel=1e-12)
    shown = put_in["residual"] - is_now["residual"]
    assert shown == pytest.approx(-1e3 * planted, rel=1e-9)
    assert stage.bars.values["residual"].get_text() == ("−3e−3 J" if planted > 0 else "3e−3 J")


@given(st.fixed_dictionaries({name: st.floats(-1e3, 1e3) for name in SIGNS if name != "residual"}))
def test_stacks_are_positive_and_equal_when_the_books_balance(books: dict[str, float]) -> None:
    spent = sum(books[n] for n in ("kinetic", "potential", "restitution_loss", "friction_loss"))
    books["residual"] = spent - books["start"] - books["belt_work"]
    put_in, is_now = stacks(books)
    assert all(value >= 0.0 for side in (put_in, is_now) for value in side.values())
    assert sum(put_in.values()) == pytest.approx(sum(is_now.values()), rel=1e-12, abs=1e-9)


def test_books_of_every_run_balance_at_every_moment(runs: dict[str, Recording]) -> None:
    for name, recording in runs.items():
        shots, _ = filmed(recording)
        books = energies(recording, np.array([shot.t for shot in shots]))
        total = sum(sign * books[entry] for entry, sign in SIGNS.items())
        assert np.abs(total).max() <= 1e-13 * np.abs(books["start"]).max(), name


def test_pulley_turns_and_belt_marks_run_with_the_belt() -> None:
    stage = stage_of(by_hand(), moments_at([0.60, 0.61]))
    stage.show(0)
    tip, marks = np.asarray(stage.drives.spoke.get_xydata())[1], stage.drives.marks.get_xydata()
    angle = V * 0.6 / R
    assert tip == pytest.approx(0.9 * R * np.array([np.sin(angle), np.cos(angle)]), abs=1e-14)
    stage.show(1)
    moved = np.asarray(stage.drives.marks.get_xydata())
    shift = np.abs(moved[:, None, 0] - np.asarray(marks)[None, :, 0] - V * 0.01).min(axis=1)
    assert np.mean(shift < 1e-12) > 0.9  # all but those that came in at an end


def test_frames_leave_no_traces_in_each_other(runs: dict[str, Recording]) -> None:
    stage = stage_of(runs["perpendicular"], moments_at([0.5, 0.7, 0.9]))
    first = stage.frame(0)
    last = stage.frame(2)
    assert (first != last).any()
    np.testing.assert_array_equal(stage.frame(0), first)
    assert first.shape == (HEIGHT, WIDTH, 3)
    fresh = stage_of(runs["perpendicular"], moments_at([0.9]))
    # The scale of the bars is another with other times; the scene is not.
    np.testing.assert_array_equal(fresh.frame(0)[60:390, :555], last[60:390, :555])


@pytest.mark.parametrize("name", [*EXACT, "free-fall"])
def test_no_text_is_cut_off_overlapping_or_small(name: str, runs: dict[str, Recording]) -> None:
    shots, slow = filmed(runs[name])
    stage = stage_of(runs[name], shots, slow)
    longest = max(range(len(shots)), key=lambda i: max(map(len, shots[i].words.split("\n"))))
    stage.frame(longest)
    boxes = [(text, text.get_window_extent()) for text in seen(stage.figure)]
    for text, box in boxes:
        assert text.get_fontsize() >= 9.0
        assert min(box.x0, box.y0) >= 0.0, text
        assert box.x1 <= WIDTH, text
        assert box.y1 <= HEIGHT, text
    for i, (text, box) in enumerate(boxes):
        for other, near in boxes[:i]:
            overlap = min(box.x1, near.x1) - max(box.x0, near.x0)
            above = min(box.y1, near.y1) - max(box.y0, near.y0)
            assert min(overlap, above) < 1.5, (text, other)


# The file


def test_gif_reads_back_frame_by_frame(tmp_path: Path) -> None:
    recording = by_hand()
    path = animate(recording, tmp_path / "lesson.gif", slow=4.0, fps=50, width=640, height=360)
    assert path == tmp_path / "lesson.gif"
    assert list(tmp_path.iterdir()) == [path]
    window = window_of(recording, machine_of(recording)).fitted(VIEW[2] * 640 / (VIEW[3] * 360))
    begin, end = span(recording, window)
    shots = film(recording, begin, end, fps=50, slow=4.0)
    stage = stage_of(recording, shots, 4.0)
    assert stage.frame(0).shape == (HEIGHT, WIDTH, 3)
    with Image.open(path) as gif:
        assert gif.size == (640, 360)
        assert gif.info["loop"] == 0
        assert gif.n_frames == len(shots)
        for i, shot in enumerate(shots):
            gif.seek(i)
            assert gif.info["duration"] == 10 * shot.delay


def test_gif_frames_are_the_stage_s_in_nearly_its_colours(tmp_path: Path) -> None:
    recording = by_hand()
    path = animate(recording, tmp_path / "lesson.gif", slow=2.0, fps=5)
    machine = machine_of(recording)
    window = window_of(recording, machine).fitted(VIEW[2] * WIDTH / (VIEW[3] * HEIGHT))
    shots = film(recording, *span(recording, window), fps=5, slow=2.0)
    stage = stage_of(recording, shots, 2.0)
    with Image.open(path) as gif:
        for i in range(len(shots)):
            gif.seek(i)
            seen_in_file = np.asarray(gif.convert("RGB")).astype(int)
            drawn = stage.frame(i).astype(int)
            off = np.abs(seen_in_file - drawn).max(axis=2)
            assert off.mean() < 0.3
            assert np.quantile(off, 0.999) <= 24
            assert (seen_in_file[drawn.min(axis=2) == 255] == 255).all()


def test_palette_holds_the_colours_that_mean_something() -> None:
    stage = stage_of(by_hand(), moments_at([0.6, 0.9]))
    palette = shared_palette([stage.frame(0), stage.frame(1)]).getpalette()
    assert palette is not None
    table = {tuple(palette[i : i + 3]) for i in range(0, len(palette), 3)}
    assert {tuple(bytes.fromhex(colour[1:])) for colour in PURE} <= table
    assert len(palette) <= 3 * 255  # one index is free


def test_failure_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "lesson.gif"
    path.write_text("old")
    drawn = Stage.frame

    def breaks(self: Stage, index: int) -> Any:
        if index == 7:
            raise RuntimeError("planted")
        return drawn(self, index)

    monkeypatch.setattr(Stage, "frame", breaks)
    with pytest.raises(RuntimeError, match="planted"):
        animate(by_hand(), path, fps=10, slow=4.0)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_same_recording_gives_the_same_file(tmp_path: Path) -> None:
    files = [
        animate(by_hand(), tmp_path / f"{i}.gif", fps=5, slow=1.0, width=400, height=225)
        for i in (1, 2)
    ]
    assert files[0].read_bytes() == files[1].read_bytes()
