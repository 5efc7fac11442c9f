"""The event-driven engine against formulas and differential equations written here."""

from dataclasses import replace
from math import cos, hypot, log, sin, sqrt

import numpy as np
import pytest

from chutelab import machine, scene
from chutelab.engines import exact, reference
from chutelab.machine.releases import Releases
from chutelab.results import Kind
from chutelab.results.laws import judge
from chutelab.results.ledger import energy_at, ledger
from chutelab.results.recorder import StalledError
from chutelab.studies.accuracy import apart, each, sizes

G = 9.81
FLOOR = {"name": "floor", "from": [-50.0, 0.0], "to": [50.0, 0.0]}


def run(document):
    return exact.run(machine.build(scene.from_dict(document)))


def flight(at, velocity, *surfaces, until=3.0, radius=0.0, spin=False):
    return {
        "particle": {"radius": radius, "spin": spin, "mass": 0.1},
        "surface": list(surfaces),
        "stream": {"at": at, "velocity": velocity},
        "run": {"until": until, "max_time": 600.0},
    }


def thrown(*given, **options):
    return run(flight(*given, **options))


def conveyor(friction, spin=False):
    """At 2 m/s over a pulley of 0.5 m, with a particle of 4 mm."""
    return {
        "particle": {"radius": 0.004, "spin": spin},
        "incoming": {"speed": 2.0, "pulley_radius": 0.5, "friction": friction},
        "run": {"until": 3.0},
    }


# Bouncing


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8, 0.99])
def test_bounces_end_after_the_sum_of_the_series(restitution):
    height = 0.7
    floor = {**FLOOR, "restitution": restitution, "friction": 0.0}
    recording = thrown([0.0, height], [0.0, 0.0], floor, until="settled")
    fall = sqrt(2.0 * height / G)
    series = 2.0 * restitution * G * fall / (G * (1.0 - restitution))
    assert recording.ended[0] == 2
    assert recording.select(Kind.SETTLE)["t"][0] == pytest.approx(fall + series, rel=1e-13)
    assert ledger(recording).restitution_loss == pytest.approx(0.1 * G * height, rel=1e-12, abs=0.0)


def test_without_loss_it_bounces_as_high_for_ever():
    floor = {**FLOOR, "restitution": 1.0, "friction": 0.0}
    recording = thrown([0.0, 0.5], [0.3, 0.0], floor, until=60.0)
    fall = sqrt(2.0 * 0.5 / G)
    hits = recording.select(Kind.IMPACT)
    assert len(hits) == int((60.0 / fall + 1.0) / 2.0)
    np.testing.assert_allclose(hits["t"], (2 * np.arange(len(hits)) + 1) * fall, rtol=1e-13)
    np.testing.assert_allclose(hits["velocity_after"][:, 1], G * fall, rtol=1e-12)


# Sliding and rolling


def test_from_belt_to_wall_it_stays_in_the_corner_and_the_belt_pays_for_heat():
    belt = {"name": "belt", "from": [-1, 0], "to": [2, 0], "friction": 0.3, "speed": 2.0}
    wall = {"name": "wall", "from": [1, -0.5], "to": [1, 1], "restitution": 0.3, "friction": 0.0}
    recording = thrown([0.0, 0.02], [2.0, 0.0], belt, wall, until=10.0, radius=0.02)
    np.testing.assert_allclose(recording.track(0)[-1]["position"], [0.98, 0.02], rtol=0, atol=1e-12)
    resting = energy_at(recording, [8.0, 9.0])["belt_work"]
    assert np.diff(resting) == pytest.approx(0.3 * 0.1 * G * 2.0, rel=1e-12, abs=0.0)
    assert ledger(recording).relative_residual < 1e-12


def test_in_a_vee_it_comes_to_rest_touching_both_sides():
    vee = {"name": "vee", "points": [[-1, 1], [0, 0], [1, 1]], "restitution": 0.4, "friction": 0.1}
    recording = thrown([-0.4, 1.0], [0.1, 0.0], vee, until="settled", radius=0.02)
    assert recording.ended[0] == 2
    np.testing.assert_allclose(
        recording.track(0)[-1]["position"], [0.0, 0.02 * sqrt(2.0)], rtol=0, atol=1e-9
    )


# Ends, joints, grazing


R, EDGE = 0.05, {"restitution": 0.0, "friction": 0.0}
TABLE = {"name": "table", "from": [-1, 0], "to": [0, 0], **EDGE}
POST = {"name": "post", "from": [0, 0], "to": [0, -1], **EDGE}


def on_the_post(angle, speed=0.0):
    return [R * sin(angle), R * cos(angle)], [speed * cos(angle), -speed * sin(angle)]


@pytest.mark.parametrize(
    ("place", "velocity", "surface", "spin"),
    [
        ([-0.5, R], [0.1, 0.0], TABLE, False),
        *((*on_the_post(nudge), POST, False) for nudge in (1e-3, 1e-7)),
        # Pushed over the top of an upright belt: there the speed of the rim turns round.
        *((*on_the_post(-0.2, 0.3), {**POST, "friction": 0.1, "speed": speed}, spin)
          for speed in (5.0, -5.0) for spin in (True, False)),
    ],
)  # fmt: skip
def test_over_an_end_it_goes_as_its_equation_of_motion_says(place, velocity, surface, spin):
    document = flight(place, velocity, surface, until=6.0, radius=R, spin=spin)
    found = by_the_equation_of_motion(document)
    if surface["friction"] == 0.0:
        # It leaves where cos φ = (2 cos φ0 + v²/(g r)) / 3.
        parting = found.select(Kind.SEPARATION)[0]
        start = place[1] / R if surface is POST else 1.0
        cosine = (2.0 * start + velocity[0] ** 2 / (G * R)) / 3.0
        assert parting["position"][1] == pytest.approx(R * cosine, rel=1e-13, abs=0.0)
        assert hypot(*parting["velocity_after"]) == pytest.approx(sqrt(G * R * cosine), rel=1e-13)


def by_the_equation_of_motion(document):
    """Run, and hold all answers against those of SciPy's DOP853."""
    built = machine.build(scene.from_dict(document))
    found, known = exact.run(built), reference.run(built)
    off, which = apart(list(each(found)), list(each(known)), sizes(known), "relative")
    assert off < 1e-12, which
    assert ledger(found).relative_residual < 1e-13
    return found


def test_over_a_flat_joint_nothing_happens():
    flat = {"name": "flat", "points": [[-1, 0], [0, 0], [3, 0]], "friction": 0.1}
    for radius in (0.0, 0.03):
        recording = thrown([-0.5, radius], [2.0, 0.0], flat, until="settled", radius=radius)
        moved = recording.track(0)[-1]["position"][0] + 0.5
        assert moved == pytest.approx(4.0 / (0.2 * G), rel=1e-14, abs=0.0)
        assert recording.contacts == 0


@pytest.mark.parametrize("bend", [1e-6, 1e-9, 3e-10, 1e-11])
def test_a_slide_into_a_slight_bend_goes_on(bend):
    """The blow there takes v sin² of the angle at most, then g sin of it slows the slide."""
    floor = {"name": "floor", "points": [[-1.0, 0.0], [0.0, 0.0], [1.0, bend]], "friction": 0.0}
    end = thrown([-6e-4, 0.0], [1e-3, 0.0], floor, until=1.0).track(0)[-1]
    assert hypot(*end["velocity"]) == pytest.approx(1e-3 - G * bend * 0.4, rel=1e-9)


@pytest.mark.parametrize("speed", [0.05, 0.5])
@pytest.mark.parametrize("bend", [3e-12, 1e-11, 1e-10, 1e-9, 3e-9, 1e-8])
def test_a_disk_stays_on_a_floor_with_a_slight_hollow_bend(bend, speed):
    """It meets the second piece r/2 times the bend before the first one ends, about rounding.

    From there on it goes up at `bend`, not along a cubic that starts level: that would be lower by
    up to 4/27 of the way times the bend.
    """
    floor = {"name": "floor", "points": [[-1.0, 0.0], [0.0, 0.0], [1.0, bend]], "friction": 0.0}
    run = thrown([-6e-4, 0.02], [speed, 0.0], floor, until=1.0, radius=0.02)
    assert run.track(0)[-1]["position"] == pytest.approx([speed - 6e-4, 0.02], abs=2e-7)
    x, y = run.at(np.linspace(0.0, 1.0, 100)).position[:, 0].T
    assert np.all(y - 0.02 > bend * np.maximum(x, 0.0) - 1e-11 * speed)
    assert judge(run) == ()


# Round the pulley


@pytest.mark.parametrize(
    ("friction", "spin"),
    [*((mu, False) for mu in (0.2, 0.5, 1.0, 3.0)), *((mu, True) for mu in (0.15, 0.5, 2.0))],
)
def test_round_the_pulley_it_grips_or_rolls_then_slips_then_leaves(friction, spin):
    found = by_the_equation_of_motion(conveyor(friction, spin))
    began = found.select(Kind.SLIP)[0]
    # With u = v²/(g ρ) the slip begins at sin φ = µ (cos φ - u), of what rolls at three times µ.
    phi, ride = np.arctan2(*began["position"]), 0.504
    u = (began["velocity_before"] ** 2).sum() / (G * ride)
    share = 3.0 if spin else 1.0
    assert sin(phi) == pytest.approx(share * friction * (cos(phi) - u), abs=1e-12)
    rolled = 4.0 / 3.0 * (1.0 - cos(phi)) if spin else 0.0
    assert u == pytest.approx(2.0**2 / (G * ride) + rolled, rel=1e-12)


def test_what_a_wall_stops_on_a_belt_without_slip_is_rolling_at_once():
    """A blow across the way turns the pace w into -ε w and makes no slip's normal impulse.

    Adhesion stops the slip -(1 + ε) w all the same, for a disk by (1 + ε) w/3 of its pace.
    """
    v, wheel, r, restitution = 1.0, 0.5, 0.004, 0.9
    ride = wheel + r

    def out(angle):
        return np.array([sin(angle), cos(angle)])

    foot = (wheel + 0.001) * out(0.3) + r * out(0.3 + np.pi / 2.0)
    top = foot + 5.0 * r * out(0.3)
    stop = {"name": "wall", "from": foot.tolist(), "to": top.tolist(), "friction": 0.0}
    recording = run({
        "particle": {"radius": r, "spin": True},
        "incoming": {"speed": v, "pulley_radius": wheel, "friction": "adhesion"},
        "surface": [{**stop, "restitution": restitution}],
        "stream": {
            "at": (ride * out(0.1)).tolist(), "velocity": (v * out(0.1 + np.pi / 2.0)).tolist(),
        },
        "run": {"until": 0.5},
    })  # fmt: skip
    # It rolls down from 0.1 to 0.3 rad first.
    w = sqrt(v**2 + 4.0 / 3.0 * G * ride * (cos(0.1) - cos(0.3)))
    hit = recording.select(Kind.IMPACT, surface="wall")[0]
    after = recording.events[recording.events["t"] == hit["t"]][-1]
    along = out(0.3 + np.pi / 2.0)
    assert hit["velocity_before"] @ along == pytest.approx(w, rel=1e-12)
    assert hit["velocity_after"] @ along == pytest.approx(-restitution * w, rel=1e-12)
    pace = -restitution * w + (1.0 + restitution) * w / 3.0
    assert after["velocity_after"] @ along == pytest.approx(pace, rel=1e-12)
    assert after["omega_after"] * r == pytest.approx(v - pace, rel=1e-12)
    assert ledger(recording).relative_residual < 1e-13


def test_an_arc_that_lies_on_the_pulley_is_left_with_it():
    """However the angle at which it leaves, cos φ = v²/(g ρ), is rounded."""
    cover = {"name": "cover", "center": [0.0, 0.0], "radius": 0.3, "from_deg": 90, "to_deg": -60}
    for speed in np.linspace(0.3, 1.6, 27).tolist():
        belt = {"speed": speed, "pulley_radius": 0.3, "friction": "adhesion"}
        tables = {"particle": {"radius": 0.02, "spin": False}, "incoming": belt, "surface": [cover]}
        told = run({**tables, "run": {"until": 9.0}}).events
        assert told["kind"].tolist() == [Kind.RELEASE, Kind.SEPARATION, Kind.EXIT]
        assert told["position"][1, 1] == pytest.approx(speed**2 / G, rel=1e-12)


# Streams


def one_of(built, n):
    """The machine of particle n alone."""

    def rows(part):
        return {
            name: value[n : n + 1].copy() if np.shape(value) == (built.count,) else value
            for name, value in vars(part).items()
        }

    rows_of = [getattr(built.releases, name)[n : n + 1].copy() for name in vars(built.releases)]
    particle = replace(built.particle, **rows(built.particle))
    return replace(built, releases=Releases(*rows_of), particle=particle)


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("stream-independent", ("stream.count=150", "run.until=settled")),
        ("low-speed", ("stream.count=40", "stream.bed_height=0.02")),
        ("low-speed", ("stream.count=40", "incoming.friction=0.4", "particle.spin=true")),
        ("two-sizes", ("stream[0].interact=false", "stream[1].interact=false")),
    ],
)  # fmt: skip
def test_each_of_a_crowd_does_what_it_does_alone(name, overrides):
    built = machine.build(scene.load(name, overrides))
    together = exact.run(built)
    for n in (1, 17, built.count - 1):
        assert together.track(n).tobytes() == exact.run(one_of(built, n)).track(0).tobytes()


def test_events_at_one_time_go_by_particle():
    # Particle 10 is released at 10/20 s, when the belt, 1 m at 2 m/s, lets particle 0 go.
    events = exact.run(
        machine.build(scene.load("stream-independent", ("stream.count=30", "stream.rate=20")))
    ).events
    same = events["t"][1:] == events["t"][:-1]
    assert same.any()
    assert (np.diff(events["particle"])[same] > 0).all()


# Limits


def test_a_run_without_an_end_is_stopped_and_keeps_what_it_recorded(monkeypatch):
    monkeypatch.setattr(exact, "ROUNDS", 20)
    floor = {**FLOOR, "restitution": 1.0, "friction": 0.0}
    with pytest.raises(StalledError, match=r"particle 0 .* 20 events.* lower run.max_time") as end:
        thrown([0.0, 0.5], [0.3, 0.0], floor, until=60.0)
    period = 2.0 * sqrt(2.0 * 0.5 / G)
    assert end.value.particle == 0
    assert end.value.t == pytest.approx(19.5 * period, rel=1e-12, abs=0.0)
    assert end.value.position == pytest.approx((0.3 * 19.5 * period, 0.0), abs=1e-12)
    recording = end.value.recording
    assert recording.contacts == recording.steps == 20
    assert recording.ended[0] == 0
    assert recording.track(0)[-1]["t"] == end.value.t
    assert ledger(recording).relative_residual < 1e-12


@pytest.mark.slow
def test_a_run_without_an_end_is_stopped_after_half_a_million_events():
    floor = {**FLOOR, "restitution": 1.0, "friction": 0.0}
    with pytest.raises(StalledError, match="500000 events, and no end of them"):
        thrown([0.0, 1e-6], [0.0, 0.0], floor, until=500_001.0 * 2.0 * sqrt(2.0 * 1e-6 / G))


def test_a_lively_particle_comes_to_rest_before_that():
    """Each of n bounces keeps 0.999 of the speed, from sqrt(2 g h) down to 1e-9 m/s."""
    recording = thrown([0.0, 0.1], [0.0, 0.0], {**FLOOR, "restitution": 0.999}, until="settled")
    assert recording.ended_by("settled").all()
    bounces = log(sqrt(2.0 * G * 0.1) / 1e-9) / -log(0.999)
    assert recording.contacts == pytest.approx(bounces, rel=0.01)


def test_a_particle_that_hardly_gets_on_is_stopped(monkeypatch):
    # Two bounces a second are too many here.
    monkeypatch.setattr(exact, "WINDOW", 4)
    monkeypatch.setattr(exact, "TICK", 0.5)
    floor = {**FLOOR, "restitution": 1.0, "friction": 0.0}
    period = 2.0 * sqrt(2.0 * 0.25 / G)
    with pytest.raises(StalledError, match=f"4 events took {3.5 * period:.2g} s: .* narrow"):
        thrown([0.0, 0.25], [0.0, 0.0], floor, until=60.0)
    assert thrown([0.0, 2.0], [0.0, 0.0], floor, until=60.0).ended[0] == 0


def test_a_run_that_is_looked_at_after_each_event_is_the_same(monkeypatch):
    floor = {**FLOOR, "restitution": 0.9, "friction": 0.2}
    whole = thrown([0.0, 0.5], [0.3, 0.0], floor, until="settled")
    monkeypatch.setattr(exact, "FIRST", 1)
    monkeypatch.setattr(exact, "SLICE", 0.0)
    pieces = thrown([0.0, 0.5], [0.3, 0.0], floor, until="settled")
    for array in ("knots", "offsets", "events", "by_surface"):
        assert getattr(whole, array).tobytes() == getattr(pieces, array).tobytes()


@pytest.mark.parametrize(
    ("at", "depth"), [([0.0, 0.009], 0.001), ([0.0, -0.004], 0.006), ([50.003, 0.004], 0.005)]
)
def test_nothing_starts_inside_a_surface(at, depth):
    with pytest.raises(scene.SceneError, match=r"stream\.at") as refused:
        thrown(at, [0.0, 0.0], FLOOR, radius=0.01)
    assert f"would start {0.01 - depth:.6g} m from it" in str(refused.value)
    assert "floor" in str(refused.value)


def test_a_contact_written_with_few_digits_is_a_contact():
    recording = thrown([0.0, 0.01 - 5e-10], [1.0, 0.0], FLOOR, radius=0.01)
    assert recording.track(0)[0]["position"][1] == 0.01
    assert recording.contacts == 0
    assert recording.track(0)[-1]["position"][1] == 0.01


# Corners that fuzzing found


@pytest.mark.parametrize(
    ("radius", "faces", "restitution", "belt", "at", "velocity", "side"),
    [
        # Down a slope into the corner with a belt that crosses it.
        (0.0, [[[0.9927846994735305, 0.75], [-0.875, -0.625]],
               [[-0.5367946015887366, 0.0], [0.2645640303077017, 0.02615828168520129]]],
         0.0, {"friction": 0.6, "speed": 1.5}, [-0.125, 1.25], [1.25, 0.8019713382657905], -1),
        # Into a wedge whose other side returns nearly all.
        (0.03, [[[0.38777654175846776, 0.0], [0.4883749450981132, 0.5045674775881257]],
                [[0.75, -0.4528713779684288], [0.20104447842882522, 0.375]]],
         0.999, {}, [0.25, 1.25], [0.75, -1.75], 1),
    ],
)  # fmt: skip
def test_in_a_wedge_it_stays_on_its_side(radius, faces, restitution, belt, at, velocity, side):
    (first, end), other = np.array(faces[0]), faces[1]
    slope = {"name": "slope", "points": faces[0], "restitution": 0.0, "friction": 0.0}
    crossing = {"name": "other", "points": other, "restitution": restitution, "friction": 0.0}
    recording = thrown(at, velocity, slope, {**crossing, **belt}, until=1.5, radius=radius)
    along = (end - first) / hypot(*(end - first))
    place = recording.track(0)["position"]
    foot = (place - first) @ along
    height = side * ((place - first) @ [-along[1], along[0]])
    met = (foot > 0.0) & (foot < hypot(*(end - first)))
    assert height[met].min() >= radius - 1e-12
    assert met.sum() > 5


@pytest.mark.parametrize(("friction", "rests"), [(5.0, True), (0.05, False)])
def test_from_a_slope_onto_a_tip_that_alone_can_hold_it(friction, rests):
    # A tip sticks out of a slope; a disk stopped between them is pulled over the tip, unless the
    # tip's friction holds it: its normal leans by 0.12.
    r, slope, lean = 0.03, np.array([-sqrt(0.5), sqrt(0.5)]), np.array([-sin(0.12), cos(0.12)])
    stop = r * slope
    tip = stop - r * lean
    surfaces = (
        {"name": "slope", "from": [0.5, 0.5], "to": [-0.5, -0.5], "friction": 0.0},
        {"name": "post", "from": tip.tolist(), "to": [tip[0], -1.0], "friction": friction},
    )
    start = stop + 1e-9 * np.array([1.0, 1.0])
    recording = thrown(
        start.tolist(),
        [0.0, 0.0],
        *({**s, "restitution": 0.0} for s in surfaces),
        until="settled",
        radius=r,
    )
    end = recording.track(0)[-1]
    assert bool(recording.ended[0] == 2) is rests
    assert bool(hypot(*(end["position"] - stop)) < 1e-8) is rests
    assert abs(ledger(recording).residual) < 1e-15
