import re
from io import BytesIO
from math import sqrt

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from chutelab import scene, theory
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.pictures import animation, plots
from chutelab.pictures.animation import animate
from chutelab.pictures.plots import Window, style
from chutelab.pictures.plots.scenery import energies
from chutelab.results import Kind
from chutelab.results.ledger import ledger
from chutelab.util.errors import InputError
from handmade import (
    BELT_TIME,
    DISTANCE,
    EPS,
    MASS,
    PARTICLE,
    SHOWN,
    TEXT,
    G,
    R,
    V,
    assert_legible,
    by_hand,
    expected,
    t_impact,
    t_landing,
)
from shared import some


def axes(width=6.0, height=4.0):
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure.add_subplot()


def line(ax, gid):
    (found,) = [one for one in ax.lines if one.get_gid() == gid]
    return np.asarray(found.get_xydata())


def test_track_strobe_and_impacts_are_where_the_particle_is():
    ax = plots.draw_tracks(axes(), by_hand())
    track = line(ax, "track")
    flying = track[:, 0] > 1e-9
    descending = np.cumsum(flying) > np.argmax(track[flying, 0]) + 1
    since = np.where(
        descending,
        t_impact() + (R + DISTANCE - PARTICLE - track[:, 0]) / (EPS * V),
        track[:, 0] / V,
    )
    assert track[flying, 1] == pytest.approx(expected(since)[0][flying, 1], abs=1e-14)
    assert (track[~flying, 1] == R + PARTICLE).all()
    assert track[0, 0] == -1.0
    # 0.44 s of flight in about ten: every 0.05 s, of the recording's clock.
    strobe = line(ax, "strobe")
    times = 0.05 * np.arange(19)
    riding = times <= BELT_TIME
    assert strobe[riding, 0] == pytest.approx(-1.0 + V * times[riding], abs=1e-14)
    assert strobe[~riding] == pytest.approx(expected(times[~riding] - BELT_TIME)[0], abs=1e-13)
    assert {one.get_label() for one in ax.lines} >= {"every 0.05 s"}
    hits, _ = expected(np.array([t_impact(), t_landing()]))
    assert line(ax, "impacts") == pytest.approx(hits, abs=1e-14)


# The scene


BOUNCY = """
[particle]
radius = {r}
[stream]
at = [0.0, 0.3]
velocity = [0.05, 0.0]
[[surface]]
name = "floor"
points = [[-0.5, 0.0], [9.0, 0.0]]
restitution = 1.0
friction = 0.0
[run]
until = {until}
"""


@pytest.mark.parametrize("until", [3.0, 29.0])
def test_a_path_is_drawn_as_the_curve_it_is_however_long_the_run(until):
    # Hops over an elastic floor: y = h - g τ²/2 from one to the next, τ since the last apex.
    r, h, vx = 0.01, 0.3, 0.05
    recording = simulate(scene.parse(BOUNCY.format(r=r, until=until)))
    ax = axes()
    ax.set_xlim(0.0, 1.0)
    plots.draw_tracks(ax, recording, marks=False)
    drawn = line(ax, "track")
    assert drawn[0] == pytest.approx((0.0, h), abs=1e-12)
    assert drawn[-1, 0] == pytest.approx(vx * until, rel=1e-9)
    period = 2.0 * sqrt(2.0 * (h - r) / G)
    for share in (0.25, 0.5, 0.75):
        x, y = (drawn[:-1] + share * np.diff(drawn, axis=0)).T
        since = (x / vx + 0.5 * period) % period - 0.5 * period
        off = np.abs(y - (h - 0.5 * G * since**2))
        # Across a steep flight that is more in height than away from the line.
        steep = np.hypot(1.0, G * since / vx)
        assert (off / steep).max() < 3e-4


STEP = """
[particle]
radius = 0.002
[stream]
at = [-0.05, 0.03]
velocity = [0.4, 0.0]
[[surface]]
name = "step"
points = [[-0.06, 0.0], [0.0, 0.0]]
friction = 0.0
[run]
until = 5.0
"""


def test_the_fall_of_what_has_fallen_off_does_not_make_the_machine_a_dot():
    recording = simulate(scene.parse(STEP))
    end = recording.track(0)[-1]
    assert end["position"][1] == pytest.approx(-1.0, abs=1e-12)
    window = plots.window_of(recording)
    machine = [(-0.06, 0.0), (0.0, 0.0), (-0.05, 0.03)]
    assert window.holds(np.array(machine)).all()
    # Machine and path up to the edge are 6 cm wide; a good third of that is shown of the fall.
    assert window.bottom < -0.015
    assert max(window.width, window.height) < 0.18


@pytest.mark.parametrize("place", [(-0.5, -0.5, 0.25, 0.5), (40.0, 3.0, 41.0, 3.5)])
def test_a_view_is_what_pictures_show(tmp_path, place):
    x0, y0, x1, y1 = place
    recording = simulate(
        scene.load("perpendicular", [f"view.from=[{x0}, {y0}]", f"view.to=[{x1}, {y1}]"])
    )
    assert plots.window_of(recording) == Window(x0, x1, y0, y1)
    ax = plots.overlay(recording).axes[0]
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    assert (left, right) == pytest.approx((x0, x1)) or (bottom, top) == pytest.approx((y0, y1))
    assert left <= x0 < x1 <= right
    assert bottom <= y0 < y1 <= top
    # And so does the film, where velocities point out of it.
    layout = animation.lay_out(recording, width=800, height=450)
    assert layout.window == Window(x0, x1, y0, y1).fitted(0.675 * 800 / (0.71 * 450))
    assert animate(recording, tmp_path / "some.gif", fps=5).stat().st_size > 1000


def test_a_plate_leaning_back_reads_its_angle():
    leaning = build(scene.parse(TEXT.replace("[outgoing]", "angle_deg = 10\n[outgoing]")))
    labels = [text.get_text() for text in plots.draw_scene(axes(), leaning).texts]
    assert "plate, 10°\nε = 0.5" in labels
    assert "incoming belt, 2 m/s →" in labels
    backward = build(scene.parse(TEXT.replace("drop", "speed = -1.5\ndrop")))
    labels = [text.get_text() for text in plots.draw_scene(axes(), backward).texts]
    assert "outgoing belt, 1.5 m/s ←" in labels
    assert "plate, 0°\nε = 0.5" in labels


# The figure


@pytest.mark.parametrize("name", [*SHOWN, "flap-gate"])
def test_no_text_is_cut_off_overlapping_or_small(name):
    figure = plots.overlay(simulate(scene.load(name)))
    figure.canvas.draw()
    assert_legible(figure, 1.5)


@pytest.mark.parametrize("name", some(["vibrating-feeder", "loop"]))
def test_the_legend_of_the_velocities_lies_on_no_curve(name):
    figure = plots.overlay(simulate(scene.load(name)))
    figure.canvas.draw()
    (ax,) = (one for one in figure.axes if any(line.get_gid() == "vx" for line in one.lines))
    box = ax.get_legend().get_window_extent()
    for line in ax.lines:
        path = line.get_path().transformed(line.get_transform())
        assert not path.intersects_bbox(box, filled=False), line.get_label()


def test_overlay_holds_all_its_parts(tmp_path):
    figure = plots.overlay(by_hand(), path=tmp_path / "overlay.png", details=True)
    assert "engine exact" in " ".join(one.get_text() for one in figure.texts)
    gids = {one.get_gid() for ax in figure.axes for one in ax.lines}
    assert gids >= {"track", "analytic", "strobe", "impacts", "residual", "vx", "vy", "supplied"}
    assert [file.name for file in tmp_path.iterdir()] == ["overlay.png"]
    with Image.open(tmp_path / "overlay.png") as image:
        assert image.size == (1560, 912)


# A crowd


@pytest.fixture(scope="module")
def crowd():
    return simulate(
        scene.load("stream-independent", ["stream.count=60", "stream.rate=80", "run.until=settled"])
    )


@pytest.mark.parametrize("rain", [3, 30], ids=["few", "crowd"])
def test_no_picture_where_particle_0_never_found_a_place(rain, tmp_path):
    """It is due at 0.2 s where another one has lain from the start; the others fall beside it."""
    rest = {"velocity": [0.0, 0.0], "interact": True}
    recording = simulate(scene.from_dict({
        "particle": {"radius": 0.01},
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "restitution": 0.0}],
        "stream": [
            {"name": "late", "at": [0.0, 0.0105], "start": 0.2, "count": 1, **rest},
            {"name": "early", "at": [0.0, 0.0105], "count": 1, **rest},
            {"name": "rain", "at": [0.3, 0.2], "count": rain, "rate": 60.0, **rest},
        ],
        "run": {"until": 0.8},
    }))  # fmt: skip
    assert recording.released[:3].tolist() == [False, True, True]
    for draw, name in ((plots.overlay, "a.png"), (animate, "a.gif")):
        with pytest.raises(InputError, match="no place was free"):
            draw(recording, path=tmp_path / name)
    assert [*tmp_path.iterdir()] == []


NOMINAL = {"track", "strobe", "impacts", "vx", "vy", "residual"}


def gids(figure):
    return {str(one.get_gid()) for ax in figure.axes for one in (*ax.lines, *ax.patches)}


def test_the_overlay_of_a_crowd_leads_with_the_crowd(crowd, tmp_path):
    figure = plots.overlay(crowd, path=tmp_path / "crowd.png")
    titles = {ax.get_title("left").split(":")[0] for ax in figure.axes} - {""}
    assert titles == {"Arrivals", "Belt power", "Flow", "Energy ledger", "Losses by surface"}
    assert {"envelope", "median"} <= gids(figure)
    assert not gids(figure) & NOMINAL
    # Particle 0 on request.
    asked = plots.overlay(crowd, details=True)
    assert gids(asked) >= NOMINAL
    assert "Velocity of particle 0" in {ax.get_title("left") for ax in asked.axes}
    assert "envelope" not in gids(asked)


@pytest.mark.slow
def test_an_envelope_ends_where_its_particles_come_to_lie():
    # Of a rock box: half of them stay on the ledge, at y = -0.55 m, x = 0.22 to 0.5 m.
    ax = plots.draw_envelope(axes(), simulate(scene.load("rock-box")))
    way = line(ax, "median")
    steps = np.hypot(*np.diff(way, axis=0).T)
    assert steps.max() < 4.0 * np.median(steps)
    assert -0.55 < way[-1, 1] < -0.35
    assert 0.22 < way[-1, 0] < 0.5


def test_a_film_of_a_crowd_tells_how_many_come(crowd):
    layout = animation.lay_out(crowd, width=800, height=450)
    assert layout.shows == {"parabola", "trails", "energy"}
    asked = animation.lay_out(crowd, width=800, height=450, shows=frozenset(("velocity", "trails")))
    assert asked.shows == {"velocity", "trails"}
    shots = animation.moments.film(crowd, 0.5, 1.0, fps=10, slow=1.0, crowd=True)
    first = crowd.select(Kind.LANDING)["t"]
    for shot in shots:
        # 80 a second from t = 0 on.
        released = min(60, int(shot.t * 80.0 + 1e-9) + 1)
        said = f"{released} released, {(first <= shot.t).sum()} arrived"
        assert (shot.delay, shot.words) == (10 if shot is not shots[-1] else 120, said)


def test_the_flow_is_that_of_the_feed(crowd):
    ax = plots.draw_flow(axes(), crowd)
    # 80 particles a second arrive as they were released: each falls as long as the others of its
    # layer, and the layers of a bed are mixed.
    t, number = line(ax, "arrived").T
    assert number[[0, -1]].tolist() == [0.0, 60.0]
    assert np.interp(30.0, number, t) == pytest.approx(0.5 * (t[1] + t[-2]), abs=0.03)
    released = line(ax, "released")
    assert released[1:-1, 0] == pytest.approx(np.arange(60) / 80.0, abs=1e-12)
    (said,) = re.findall(r"([\d.]+) t/h arrive, of the slice", ax.get_title("right"))
    assert float(said) == pytest.approx(3.6 * 80.0 * MASS, rel=0.05)


def test_power_and_losses_add_up_to_the_ledger(crowd):
    books = ledger(crowd)
    ax = plots.draw_power(axes(), crowd)
    (steps,) = [one for one in ax.patches if one.get_gid() == "power"]
    power, edges, _ = steps.get_data()
    factor = {"W": 1.0, "mW": 1e-3}[ax.get_ylabel().removeprefix("power, ")]
    assert factor * (power * np.diff(edges)).sum() == pytest.approx(books.belt_work, rel=1e-9)
    ax = plots.draw_losses(axes(), crowd)
    factor = {"J": 1.0, "mJ": 1e-3}[ax.get_xlabel().removeprefix("loss, ")]
    for key in ("restitution_loss", "friction_loss"):
        bars = [one.get_width() for one in ax.patches if one.get_gid() == key]
        assert factor * sum(bars) == pytest.approx(getattr(books, key), rel=1e-12)
    assert next(text.get_text() for text in ax.get_yticklabels()) == max(
        books.by_surface, key=lambda n: sum(books.by_surface[n][k] for k in
                                           ("restitution_loss", "friction_loss"))
    )  # fmt: skip


def test_given_axes_get_the_scene_and_keep_what_is_theirs(tmp_path):
    figure = Figure()
    mine, other = figure.subplots(1, 2)
    mine.set_title("A", loc="left")
    assert plots.overlay(by_hand(), ax=mine) is figure
    assert {one.get_gid() for one in mine.lines} >= {"track", "analytic", "strobe", "impacts"}
    assert mine.get_title("left") == "A"
    assert figure.axes == [mine, other]
    assert not other.has_data()
    with pytest.raises(ValueError, match="path and ax"):
        plots.overlay(by_hand(), ax=mine, path=tmp_path / "overlay.png")


def test_drawing_leaves_the_settings_alone():
    before = dict(mpl.rcParams)
    plots.overlay(by_hand())
    assert dict(mpl.rcParams) == before


# Colours and figures


@given(st.floats(1e-14, 1e8) | st.floats(-1e8, -1e-14))
def test_quantities_read_back_to_three_digits(value):
    number, unit = style.quantity(value, "J").replace("−", "-").split()
    powers = {"fJ": -15, "pJ": -12, "nJ": -9, "µJ": -6, "mJ": -3, "J": 0, "kJ": 3, "MJ": 6}
    assert float(number) * 10.0 ** powers[unit] == pytest.approx(
        value, rel=0.051 if "e" in number else 0.0051
    )


BARE = """
[particle]
radius = 0.01
{particle}
[incoming]
pulley_radius = 0.2
{incoming}
[outgoing]
drop = 1.2
drop_from = "top"
"""


@pytest.mark.parametrize(
    ("incoming", "particle"),
    [
        ("speed = 1.0\nfriction = 0.5", ""), ("speed = 1.0\nincline_deg = -15", ""),
        ("speed = 1.0\nfriction = 0.6", "shape = 'disk'\nspin = true"),
        ("speed = 1.0\nfriction = 0.6", "shape = 'sphere'\nspin = true"),
        ("speed = 1.0\nincline_deg = 18", ""), ("speed = 2.5\nincline_deg = 40", ""),
    ],
)  # fmt: skip
def test_without_a_plate_a_parabola_leads_to_the_landing(incoming, particle):
    thrown = scene.parse(BARE.format(incoming=incoming, particle=particle))
    (arc,) = plots.arcs(theory.predict(thrown), thrown)
    recording = simulate(thrown, engine="exact")
    left, landing = recording.select(Kind.SEPARATION)[0], recording.select(Kind.LANDING)[0]
    assert arc.position == pytest.approx(left["position"], abs=1e-12)
    assert arc.velocity == pytest.approx(left["velocity_after"], abs=1e-11)
    assert arc.at([arc.end])[0][0] == pytest.approx(landing["position"], abs=1e-9)


@pytest.mark.parametrize(
    "more",
    [
        "start = 5.0", "speed = 1.0\n[[surface]]\nname = 'hood'\nfrom = [0, 1]\nto = [1, 1]",
        "[[conveyor]]\nname = 'b'\nfrom = [2, -0.3]\nto = [3, -0.3]\nspeed = 1.0",
        "[[plate]]\nname = 'p'\npivot = [1.0, 0.0]",
        "[stream]\nat = [0.5, 1.0]\nvelocity = [1.0, 0.0]", "[stream]\ncount = 9\ninteract = true",
    ],
)  # fmt: skip
def test_no_parabola_where_something_else_may_happen(more):
    text = (
        '[incoming]\nspeed = 2.0\npulley_radius = 0.1\n[outgoing]\ndrop = 0.8\ndrop_from = "top"\n'
    )
    other = scene.parse(text + more)
    assert plots.arcs(theory.predict(other), other) == ()


def test_a_picture_shows_itself_in_a_notebook(tmp_path):
    figure = plots.overlay(simulate(scene.load("perpendicular")), path=tmp_path / "overlay.png")
    shown = figure._repr_png_()
    with Image.open(BytesIO(shown)) as screen, Image.open(tmp_path / "overlay.png") as written:
        width, height = figure.get_size_inches()
        assert screen.size == (round(80 * width), round(80 * height))
        assert written.width > screen.width


def test_where_a_potential_energy_is_read_its_zero_is_told():
    """The picture has m g (y - y_min), the table m g y."""
    run = simulate(scene.load("perpendicular"))
    t, y = run.knots["t"], run.knots["position"][:, 1]
    weight = run.particle.mass * run.gravity
    stacked = energies(run, t)["potential"]
    # Twice a knot has the same time: before an impact and after.
    assert stacked == pytest.approx(weight * (y - y.min()), abs=1e-12)
    legend = [text.get_text() for text in plots.overlay(run).findobj(Text)]
    assert "potential, from the\nlowest place reached" in legend
    said = " ".join(str(run.ledger).split())
    told = re.search(r"potential above the origin (\S+) -> (\S+) J", said)
    assert [float(told[n]) for n in (1, 2)] == pytest.approx(weight * y[[0, -1]], rel=1e-5)
