"""Particles of any size to scale, turned as they are; streams by colour; strings."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from chutelab.machine.parts import Joint
from chutelab.pictures.plots import Window, draw_scene, draw_tracks, overlay, style
from chutelab.pictures.plots.machinery import draw_bodies, placed
from chutelab.pictures.plots.scenery import energies, places, strings
from chutelab.pictures.plots.style import stream_colours
from chutelab.scene import parse
from handmade import Line, machine_of, recording_of

FLOOR = Line("floor", (-1.0, 0.0), (1.0, 0.0))
BOX = np.array([(-0.02, -0.05), (0.02, -0.05), (0.02, 0.05), (-0.02, 0.05)])


def still(place, end=1.0):
    return [(0.0, *place, 0.0, 0.0, 0.0), (end, *place, 0.0, 0.0, 0.0)]


def view(machine):
    figure = Figure(figsize=(7.0, 5.0))
    FigureCanvasAgg(figure)
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    return draw_scene(ax, machine, Window(-0.7, 0.7, -0.4, 0.6))


def many(count, ended="settled", at=1.0):
    spots = [(0.02 * (i % 30) - 0.3, 0.02 * (i // 30) + 0.01) for i in range(count)]
    machine = replace(machine_of(FLOOR, at=spots, radius=0.008), interact=True)
    return recording_of(machine, *(still(spot, at) for spot in spots), ended=ended)


# Turning


@given(
    st.lists(st.tuples(st.floats(0.01, 0.5), st.floats(-30.0, 30.0)), min_size=2, max_size=8),
    st.floats(0.0, 1.0),
)
def test_angles_are_the_integral_of_the_angular_velocity(knots, share):
    t = np.cumsum([step for step, _ in knots])
    omega = np.array([w for _, w in knots])
    rows = [(a, 0.0, 0.5, 0.0, 0.0, w) for a, w in zip(t, omega, strict=True)]
    # Another particle before it, with a spin of its own.
    other = [(0.0, 0.1, 0.5, 0.0, 0.0, 7.0), (9.0, 0.1, 0.5, 0.0, 0.0, 7.0)]
    recording = recording_of(machine_of(FLOOR, at=[(0, 1), (0, 1)]), other, rows)
    now = min(t[0] + share * (t[-1] - t[0]), t[-1])
    seen = recording.at(now)
    (angles,) = seen.angle
    assert seen.omega[0] == pytest.approx([7.0, np.interp(now, t, omega)], rel=1e-9, abs=1e-9)
    clock = np.union1d(t[t < now], [now])
    # The trapezoidal rule is exact for what is linear between its points.
    integral = np.sum(0.5 * np.diff(clock) * (lambda w: w[1:] + w[:-1])(np.interp(clock, t, omega)))
    assert angles == pytest.approx([7.0 * now, integral], rel=1e-9, abs=1e-9)


def test_an_angle_that_is_told_counts_more_than_the_sum_of_the_spin():
    """0.3 rad more than ω = 1/s makes of the second interval, 2 s long: 0.15 rad by its middle."""
    rows = [(0, 0, 0.5, 0, 0, 1), (1, 0, 0.5, 0, 0, 1), (3, 0, 0.5, 0, 0, 1)]
    machine = machine_of(FLOOR, radius=0.054, outlines=(BOX,))
    told = replace(recording_of(machine, rows), angle=np.array([0.0, 1.0, 3.3]))
    angle = told.at([0.5, 1.0, 2.0, 2.999999, 3.0]).angle[:, 0]
    assert angle == pytest.approx([0.5, 1.0, 2.15, 3.3, 3.3], abs=1e-5)


def test_a_spin_that_an_impact_changes_turns_at_once_with_the_new_one():
    rows = [
        (0, 0, 0.5, 0, 0, 2), (1, 0, 0.5, 0, 0, 2), (1, 0, 0.5, 0, 0, -3), (2, 0, 0.5, 0, 0, -3),
    ]  # fmt: skip
    recording = recording_of(machine_of(FLOOR), rows)
    angle = recording.at([0.5, 1.0, 1.5, 2.0, 2.1]).angle[:, 0]
    assert angle[:4] == pytest.approx([1.0, 2.0, 0.5, -1.0], abs=1e-14)
    assert np.isnan(angle[4])


def test_a_box_is_drawn_turned_counterclockwise():
    machine = machine_of(FLOOR, at=[(0.1, 0.3)], radius=0.054, outlines=(BOX,))
    # By π/2 in 1 s: what was its upper right corner is its upper left one.
    rows = [(0, 0.1, 0.3, 0, 0, np.pi / 2), (1, 0.1, 0.3, 0, 0, np.pi / 2)]
    ax = draw_bodies(view(machine), recording_of(machine, rows), 1.0)
    (boxes,) = [one for one in ax.collections if one.get_gid() == "particle 0 turned"]
    corners = boxes.get_paths()[0].vertices[:4]
    expected = [(0.15, 0.28), (0.15, 0.32), (0.05, 0.32), (0.05, 0.28)]
    assert corners == pytest.approx(np.array(expected), abs=1e-12)
    assert placed(BOX, np.zeros(2), 0.0) == pytest.approx(BOX)


# Streams


def seen_by(colour, matrix):
    """Return a colour's L*, a* and b* (CIE 1976, D65) as a dichromat sees it."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb > 0.04045, ((rgb + 0.055) / 1.055) ** 2.4, rgb / 12.92)
    linear = np.clip(matrix @ linear, 0.0, 1.0)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    white = np.array([0.9505, 1.0, 1.089])
    f = xyz @ linear / white
    f = np.where(f > (6 / 29) ** 3, np.cbrt(f), f / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


# Machado, Oliveira and Fernandes (2009), severity 1, for linear RGB.
EYES = {
    "normal": np.eye(3),
    "protanopia": np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                            [-0.003882, -0.048116, 1.051998]]),
    "deuteranopia": np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                              [-0.011820, 0.042940, 0.968881]]),
    "tritanopia": np.array([[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                            [0.004733, 0.691367, 0.303900]]),
}  # fmt: skip


@pytest.mark.parametrize("eyes", EYES)
def test_streams_and_particle_0_can_be_told_apart_by_all_eyes(eyes):
    colours = [seen_by(colour, EYES[eyes]) for colour in (*stream_colours(5), style.STRIKE)]
    for one, other in combinations(colours, 2):
        # 2.3 is a just noticeable difference.
        assert np.hypot.reduce(one - other) > 12.0


def test_tracks_and_particles_have_the_colours_of_their_streams_and_a_legend_names_them():
    spots = [(-0.2, 0.3), (0.0, 0.3), (0.2, 0.3)]
    machine = machine_of(FLOOR, at=spots, stream=[0, 0, 1], streams=("coarse", "fine"))
    recording = recording_of(machine, *map(still, spots))
    (tracks,) = draw_tracks(view(machine), recording).collections
    first, second = stream_colours(2)
    assert [to_rgb(color[:3]) for color in tracks.get_colors()] == [to_rgb(first), to_rgb(second)]
    legend = overlay(recording).axes[0].get_legend()
    assert legend is not None
    named = {
        text.get_text(): handle.get_color()
        for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True)
    }
    assert (named["coarse"], named["fine"]) == (first, second)


# Strings


def test_a_taut_string_is_straight_and_a_slack_one_sags():
    machine = machine_of(FLOOR, at=[(0.0, 0.5), (0.2, 0.5)])
    joints = (Joint("string", 0, 0.3, (0.0, 0.8)), Joint("string", 1, 0.5, (0.2, 0.8)))
    recording = recording_of(replace(machine, joints=joints), still((0.0, 0.5)), still((0.2, 0.5)))
    taut, slack = strings(recording, np.array([0.5]))(0)
    assert taut[:, 0] == pytest.approx(0.0, abs=1e-12)
    assert taut[[0, -1], 1] == pytest.approx([0.8, 0.5])
    assert np.diff(taut[:, 1]).max() <= 0.0
    assert slack[[0, -1]] == pytest.approx(np.array([(0.2, 0.8), (0.2, 0.5)]))
    assert slack[:, 1].min() < 0.5
    ax = draw_bodies(view(recording.machine), recording, 0.5)
    assert len([line for line in ax.lines if line.get_gid() == "string"]) == 2
    # Where gravity points to the right, the slack one sags as far to the right.
    text = "gravity_deg = 90\n[stream]\nat = [0.0, 1.0]\nvelocity = [0.0, 0.0]\n"
    aside = replace(machine, joints=joints, scenes=parse(text))
    turned = strings(recording_of(aside, still((0.0, 0.5)), still((0.2, 0.5))), np.array([0.5]))(0)
    straight = np.linspace(0.8, 0.5, len(slack))
    assert turned[1][:, 0] - 0.2 == pytest.approx(straight - slack[:, 1], abs=1e-12)
    assert turned[1][:, 1] == pytest.approx(straight)


# Many


def test_of_many_those_that_lie_stay_to_be_seen():
    recording = many(90)
    particles = np.arange(90)
    assert np.isfinite(places(recording, particles, np.array([0.5, 3.0]))).all()
    assert not np.isfinite(places(many(90, "exit"), particles, np.array([3.0]))).any()
    assert not np.isfinite(places(many(20), particles[:20], np.array([3.0]))).any()


def test_the_overlay_of_many_shows_all_of_them_at_four_moments():
    figure = overlay(many(90))
    small = [ax for ax in figure.axes if any(text.get_gid() == "moment" for text in ax.texts)]
    assert [ax.texts[0].get_text() for ax in small] == ["0 s", "0.333 s", "0.667 s", "1 s"]
    for ax in (figure.axes[0], *small):
        (crowd,) = [line for line in ax.lines if line.get_gid() == "stream stream"]
        assert len(crowd.get_xdata()) == 90
    (tracks,) = figure.axes[0].collections
    assert len(tracks.get_paths()) == 12
    gids = {line.get_gid() for line in figure.axes[0].lines}
    assert not gids & {"track", "strobe", "impacts"}


def test_potential_energy_of_different_masses_can_be_stacked():
    spots = [(0.0, 0.5), (0.2, 0.3)]
    machine = machine_of(FLOOR, at=spots)
    machine = replace(machine, particle=replace(machine.particle, mass=np.array([0.2, 0.7])))
    books = energies(recording_of(machine, *map(still, spots)), np.array([0.0, 1.0]))
    # Above 0.3 m, the lowest place.
    assert books["potential"] == pytest.approx(0.2 * 9.81 * 0.2)
    assert books["start"] == pytest.approx(0.2 * 9.81 * 0.2)
