"""Arcs, pegs, conveyors and gates drawn to scale; each surface named once, no name on another."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.path import Path

from chutelab import scene
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.pictures.plots import Window, draw_scene, overlay
from chutelab.pictures.plots.measures import drawing
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


def struck(ax):
    """Names with a line of the machine in their box: a surface, a strand, a wheel, an arrow."""
    lines = [
        Path(ax.transData.transform(one.get_xydata()))
        for one in ax.lines if str(one.get_gid()).startswith(("surface ", "last "))
    ]  # fmt: skip
    for body in (one for one in ax.patches if one.get_zorder() < 2.0):
        outline = body.get_path().transformed(body.get_patch_transform() + ax.transData)
        lines += [Path(corners) for corners in outline.to_polygons()]
    for arrow in (one for one in ax.texts if str(one.get_gid()).startswith("passage ")):
        tip = ax.transData.transform(arrow.xy)
        lines.append(Path([tip, tip + np.array(arrow.xyann) * ax.figure.dpi / 72.0]))
    boxes = {text.get_text(): text.get_window_extent() for text in ax.texts if text.get_text()}
    return {name for name, box in boxes.items() for one in lines if one.intersects_bbox(box, False)}


@pytest.mark.parametrize(
    "size",
    [(7.0, 3.8), pytest.param((10.0, 3.3), marks=pytest.mark.slow)],
    ids=["overlay", "report"],
)
def test_no_name_of_a_shipped_scene_is_struck_through(size):
    belts = 0
    for name, file in scene.shipped().items():
        machine = build(scene.load(file))
        if not len(machine.corners):
            continue
        figure = Figure(figsize=size)
        FigureCanvasAgg(figure)
        ax = draw_scene(figure.add_axes((0.0, 0.0, 1.0, 1.0)), machine)
        assert not struck(ax), name
        found = {text.split(",")[0] for text in said(ax)}
        wanted = {one for one in ("incoming", "outgoing") if one in machine.surfaces}
        assert {f"{one} belt" for one in wanted} <= found, name
        belts += len(wanted)
    assert belts > 20


@pytest.mark.slow
@pytest.mark.parametrize("name", scene.shipped())
def test_no_name_in_a_picture_of_a_run_is_struck_through(name):
    recording = simulate(name)
    # Also without any surface there is a drawing.
    figure = drawing(recording)
    if len(recording.machine.corners):
        assert not struck(figure.axes[0])
    assert not struck(overlay(recording).axes[0])


def test_balls_lie_on_the_plank_that_carries_them():
    (ax, *_) = overlay(simulate("see-saw")).axes
    drawn_lines = {str(one.get_gid()): np.asarray(one.get_xydata()) for one in ax.lines}
    start, end = drawn_lines["last plank"]
    along = (end - start) / np.hypot(*(end - start))
    for gid, r in (("particle 0", 0.01), ("stream heavy", 0.01)):
        (middle,) = drawn_lines[gid] - start
        # The distance from a straight line is the cross product with its direction.
        assert along[0] * middle[1] - along[1] * middle[0] == pytest.approx(r, rel=1e-3), gid
