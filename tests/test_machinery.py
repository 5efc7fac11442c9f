"""Arcs, pegs, conveyors and gates drawn to scale; each surface named once, no name on another."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from chutelab.pictures.plots import Window, draw_scene, style
from handmade import Line, Round, conveyor, machine_of


def drawn(machine, window=None, **options):
    figure = Figure(figsize=(7.0, 5.0))
    FigureCanvasAgg(figure)
    return draw_scene(figure.add_axes((0.0, 0.0, 1.0, 1.0)), machine, window, **options)


def lines(ax, name):
    return [np.asarray(one.get_xydata()) for one in ax.lines if one.get_gid() == f"surface {name}"]


def circles(ax):
    return [one for one in ax.patches if isinstance(one, Circle)]


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


def test_an_arc_is_drawn_round_its_centre_from_end_to_end():
    ax = drawn(machine_of(Round("spoon", (0.3, -0.1), 0.25, begin=170.0, extent=110.0)))
    (points,) = lines(ax, "spoon")
    away = points - (0.3, -0.1)
    assert np.hypot(*away.T) == pytest.approx(0.25, rel=1e-12)
    ends = 0.25 * np.array([[np.cos(a), np.sin(a)] for a in np.radians([170.0, 280.0])])
    assert sorted(map(tuple, away[[0, -1]])) == [
        pytest.approx(end) for end in sorted(map(tuple, ends))
    ]
    # The chords between its points leave it by R (1 - cos 1.5°) at most.
    middles = 0.5 * (away[1:] + away[:-1])
    assert np.hypot(*middles.T).min() > 0.25 * np.cos(np.radians(1.51))


def test_a_conveyor_is_a_belt_round_two_pulleys_named_once():
    ax = drawn(machine_of(*conveyor("second", (0.0, 0.0), (1.0, 0.3), 0.1, 1.5)))
    top, bottom = lines(ax, "second")
    along = np.array([1.0, 0.3]) / np.hypot(1.0, 0.3)
    up = 0.1 * np.array([-along[1], along[0]])
    assert top == pytest.approx(np.array([(0.0, 0.0), (1.0, 0.3)]) + up)
    assert bottom == pytest.approx(np.array([(1.0, 0.3), (0.0, 0.0)]) - up)
    assert [one.center for one in circles(ax)] == [(0.0, 0.0), (1.0, 0.3)]
    assert {to_rgb(one.get_edgecolor()[:3]) for one in circles(ax)} == {to_rgb(style.BELT)}
    assert said(ax) == ["second, 1.5 m/s →"]


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


def test_a_surface_of_many_pieces_is_named_once_beside_them():
    pegs = [
        Round("pegs", (0.06 * i - 0.03 * j, -0.05 * j), 0.01) for j in range(8) for i in range(8)
    ]
    ax = drawn(machine_of(*pegs))
    (label,) = ax.texts
    box = label.get_window_extent()
    for peg in circles(ax):
        x, y = ax.transData.transform(peg.center)
        assert not (box.x0 <= x <= box.x1 and box.y0 <= y <= box.y1)
    assert_apart_and_inside(ax)


def test_a_gate_is_dashed_and_faded_and_says_when_it_moves():
    ax = drawn(
        machine_of(
            Line("wall", (-1.0, 0.5), (-0.1, 0.0)),
            Line("gate", (-0.1, 0.0), (0.1, 0.0), vanishes=0.4),
            Line("flap", (0.5, 0.0), (0.9, 0.0), appears=1.25),
            Line("valve", (0.5, -0.5), (0.9, -0.5), vanishes=0.5),
            Line("valve", (0.5, -0.5), (0.9, -0.5), appears=2.0),
        )
    )
    look = {one.get_gid(): one for one in ax.lines}
    assert look["surface wall"].get_linestyle() == "-"
    assert to_rgb(look["surface wall"].get_color()) == (0.0, 0.0, 0.0)
    for gate in ("gate", "flap", "valve"):
        assert look[f"surface {gate}"].is_dashed()
        assert to_rgb(look[f"surface {gate}"].get_color())[0] == pytest.approx(0.5, abs=0.01)
    assert set(said(ax)) == {
        "wall", "gate, opens at 0.4 s", "flap, closes at 1.25 s",
        "valve, opens at 0.5 s, closes at 2 s",
    }  # fmt: skip


def test_the_name_of_a_gate_is_not_where_it_lets_fall():
    hopper = [Line("hopper", (s * 0.3, 0.4), (s * 0.05, 0.0)) for s in (-1.0, 1.0)]
    gate = Line("gate", (-0.05, 0.0), (0.05, 0.0), vanishes=0.4)
    bin_ = Line("bin", (-0.4, -0.5), (0.4, -0.5))
    ax = drawn(machine_of(*hopper, gate, bin_))
    (name,) = [text for text in ax.texts if text.get_text().startswith("gate")]
    box = name.get_window_extent()
    (left, low), (right, high) = ax.transData.transform([(-0.05, -0.25), (0.05, 0.0)])
    assert box.x1 < left or box.x0 > right or box.y1 < low or box.y0 > high


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
