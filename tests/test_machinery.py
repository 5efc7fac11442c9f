"""Arcs, pegs, conveyors and gates drawn to scale; each surface named once, no name on another."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from chutelab.engines.simulation import simulate
from chutelab.pictures.plots import Window, draw_scene
from handmade import Line, Round, machine_of


def drawn(machine, window=None, **options):
    figure = Figure(figsize=(7.0, 5.0))
    FigureCanvasAgg(figure)
    return draw_scene(figure.add_axes((0.0, 0.0, 1.0, 1.0)), machine, window, **options)


def lines(ax, name):
    return [np.asarray(one.get_xydata()) for one in ax.lines if one.get_gid() == f"surface {name}"]


def said(ax):
    return [text.get_text() for text in ax.texts]


def assert_apart_and_inside(ax):
    frame = ax.get_window_extent()
    boxes = [text.get_window_extent() for text in ax.texts]
    for i, box in enumerate(boxes):
        assert frame.x0 <= box.x0, ax.texts[i]
        assert box.x1 <= frame.x1, ax.texts[i]
        assert frame.y0 <= box.y0, ax.texts[i]
        assert box.y1 <= frame.y1, ax.texts[i]
        assert not box.count_overlaps(boxes[:i]), ax.texts[i]


@pytest.mark.parametrize(
    ("end", "speed", "arrow"),
    [
        ((1.0, 0.1), 2.0, "→"), ((1.0, 0.1), -2.0, "←"), ((-1.0, 0.1), 2.0, "←"),
        ((0.0, 1.0), 2.0, "↑"), ((0.7, -0.7), 2.0, "↘"), ((0.7, 0.7), -2.0, "↙"),
    ],
)  # fmt: skip
def test_the_arrow_of_a_belt_shows_where_it_moves_to(end, speed, arrow):
    assert said(drawn(machine_of(Line("belt", (0.0, 0.0), end, speed)))) == [f"belt, 2 m/s {arrow}"]


@pytest.mark.parametrize(("speed", "arrow"), [(0.5, "↻"), (-0.5, "↺")])
def test_a_roller_shows_how_it_turns(speed, arrow):
    ax = drawn(machine_of(Round("roller", (0.0, 0.0), 0.1, speed=speed)))
    assert said(ax) == [f"roller, 0.5 m/s {arrow}"]


PLACES = st.tuples(st.floats(-1.0, 1.0), st.floats(-0.7, 0.7))


@given(st.lists(st.tuples(PLACES, PLACES, st.booleans()), min_size=1, max_size=14))
@settings(max_examples=25, deadline=None)
def test_names_never_lie_on_each_other_or_leave_the_picture(drawn_pieces):
    pieces = []
    for i, (a, b, bent) in enumerate(drawn_pieces):
        if bent or np.hypot(b[0] - a[0], b[1] - a[1]) < 1e-3:
            pieces.append(Round(f"surface {i}", a, 0.02 + abs(b[0]), 180.0 * b[1], 200.0))
        else:
            pieces.append(Line(f"surface {i}", a, b))
    ax = drawn(machine_of(*pieces), Window(-1.0, 1.0, -0.7, 0.7))
    assert_apart_and_inside(ax)
    assert len(set(said(ax))) == len(ax.texts)


@pytest.mark.parametrize("name", ["perpendicular", "inclined-40", "cascade", "inclined-conveyor"])
def test_thickness_is_drawn_where_no_particle_comes(name):
    recording = simulate(name)
    times = np.linspace(*recording.t[[0, -1]], 2000)
    places = recording.at(times)[0].reshape(-1, 2)
    ax = drawn(recording.machine)
    bodies = [one for one in ax.patches if one.get_zorder() < 2.0]
    assert len(bodies) >= 5
    for body in bodies:
        outline = body.get_path().transformed(body.get_patch_transform())
        assert not outline.contains_points(places[np.isfinite(places[:, 0])]).any()
