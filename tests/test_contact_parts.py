"""Arcs, gates, mixtures, inclined belts, rolling friction in the contact engine, by their laws."""

from dataclasses import replace
from math import acos, atan, cos, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest

import chutelab
from chutelab.engines import contact, exact
from chutelab.engines.contact import run
from chutelab.engines.simulation import simulate
from chutelab.results import Kind
from chutelab.results.laws import LOSSES, judge
from chutelab.results.ledger import ledger
from chutelab.scene import SceneError
from cores import Core
from crowds import hollow
from machines import bent, face, gated, of_sizes, scene_of, thrown
from sandbox import bodies
from shared import seeds

G = 9.81
FAR = face("far", (-50.0, -90.0), (50.0, -90.0))
R = 0.01
"""m; of the disks."""


def arc_machine(*arcs, spin=False, surface=(), **tables):
    """Return a machine of arcs and surfaces, and gravity; nothing rubs unless told to."""
    machine = scene_of(particle={"spin": spin}, surface=[FAR, *surface], **tables)
    return bent(machine, *arcs)


def residual(recording):
    """Return what the ledger does not explain, over the energy turned over."""
    books = ledger(recording)
    return abs(books.residual) / books.turned_over


# Smooth joints


def slide_down(slope, joint, dt, *, apart=0.0, crowded=False):
    """A disk slides down a ramp, an arc of two pieces and a floor, tangential, without friction.

    Its speed on the floor is √(2 g h). `joint` is the share of the arc in the first piece, `apart`
    moves the second (m).
    """
    radius, along = 0.3, np.array([cos(slope), -sin(slope)])
    foot = np.array([-radius * sin(slope), radius * (1.0 - cos(slope))])
    normal = np.array([sin(slope), cos(slope)])
    first = {"center": (0.0, radius), "radius": radius, "begin": -0.5 * pi - slope,
             "extent": joint * slope, "restitution": 0.5}  # fmt: skip
    second = {**first, "center": (0.0, radius + apart), "begin": -0.5 * pi - (1.0 - joint) * slope,
              "extent": (1.0 - joint) * slope}  # fmt: skip
    ramp = face("ramp", foot - 0.5 * along, foot, friction=0.0, restitution=0.5)
    floor = face("floor", (0.0, 0.0), (3.0, 0.0), friction=0.0, restitution=0.5)
    machine = arc_machine(first, second, surface=[ramp, floor], run={"until": 0.8, "dt": dt})
    start = foot - 0.4 * along + R * normal
    places = [start, (2.5, R)] if crowded else [start]
    return thrown(machine, places), sqrt(2.0 * G * (start[1] - R))


@pytest.mark.parametrize("crowded", [False, True])
@pytest.mark.parametrize(("slope", "joint"), [(0.7, 0.4), (1.2, 0.73), (0.3, 0.5)])
def test_no_joint_of_a_smooth_chute_is_felt(slope, joint, crowded):
    steps, errors = [2e-3, 1e-3, 5e-4], []
    for dt in steps:
        machine, speed = slide_down(slope, joint, dt, crowded=crowded)
        recording = run(machine)
        last = recording.track(0)[-1]
        errors.append(abs(last["velocity"][0] - speed))
        assert abs(last["velocity"][1]) < 1e-12
        assert last["position"][1] == pytest.approx(R, abs=1e-3 * R)
        # It never leaves, and each next piece is no blow: it goes on slipping on another surface.
        told = recording.events["kind"][recording.events["particle"] == 0]
        assert told.tolist() == [Kind.RELEASE, Kind.SLIP, Kind.SLIP, Kind.SLIP]
        assert residual(recording) < 1e-12
    # Of second order; a bump, of half of what gravity does in a step, would be of first.
    assert (np.array(errors) < 20.0 * speed * np.square(steps)).all(), errors


@pytest.mark.parametrize("bend", [0.009, 1e-3, -1e-3, -0.009])
@pytest.mark.parametrize("beyond", ["a line", "a valley", "a hill"])
def test_a_slight_bend_costs_an_error_that_falls_with_the_step(bend, beyond):
    """Impacts and flights there are those of the exact engine; they were left out at any step."""
    usual = {"friction": 0.3, "restitution": 0.3}
    onward, up = np.array([cos(bend), sin(bend)]), np.array([-sin(bend), cos(bend)])
    way = 1.0 if beyond == "a valley" else -1.0
    middle, begin = 0.5 * way * up, -90.0 * way + 180.0 * bend / pi
    rest = {
        "center": middle.tolist(),
        "radius": 0.5,
        "from_deg": begin,
        "to_deg": begin + 40.0 * way,
    }
    if beyond == "a line":
        rest = {"points": [[0.0, 0.0], onward.tolist()]}
    off = []
    for engine, dt in (("exact", 1e-3), ("contact", 2e-3), ("contact", 2.5e-4)):
        tables = {
            "particle": {"radius": R, "mass": 0.05, "spin": True},
            "surface": [{"name": "floor", "from": [-0.5, 0.0], "to": [0.0, 0.0], **usual},
                        {"name": "rest", **rest, **usual}],
            "stream": {"at": [-0.4, R], "velocity": [1.0, 0.0]},
            "run": {"until": 0.62, "dt": dt},
        }  # fmt: skip
        off.append(simulate(tables, engine=engine).at(np.linspace(0.01, 0.61, 100)).position[:, 0])
    coarse, fine = (np.abs(one - off[0]).max() for one in off[1:])
    assert fine < 2e-7
    assert fine < coarse / 10.0 < 1e-6


def test_a_joint_written_with_some_digits_is_smooth_too():
    # A step of 2 µm up, 2e-4 of the radius: a bump would cost √(2·2e-4) = 2 % of the speed.
    for crowded in (False, True):
        machine, speed = slide_down(0.7, 0.4, 1e-3, apart=2e-6, crowded=crowded)
        last = run(machine).track(0)[-1]
        assert last["velocity"][0] == pytest.approx(speed, rel=1e-3)


@pytest.mark.parametrize("restitution", [0.0, 0.6])
@pytest.mark.parametrize("dt", [1e-3, 2e-5])
def test_a_ledge_is_felt_as_far_as_steps_resolve_it(dt, restitution):
    """A floor ends a ledge a below the lowest point of an arc: a disk meets its edge at θ.

    cos θ = 1 - a/r, and what goes into the edge, v sin θ, comes back times ε. Over a smooth joint
    the disk is lifted by a in a step: that is slower where the step's way is longer than r θ / 2.
    """
    ledge, v, radius = 1e-6, 1.0, 0.3
    theta = acos(1.0 - ledge / R)
    values = {"friction": 0.0, "restitution": restitution}
    floor = face("floor", (-1.0, 0.0), (0.0, 0.0), **values)
    arc = {"center": (0.0, radius + ledge), "radius": radius, "begin": 1.5 * pi, "extent": 1.0}
    machine = arc_machine({**arc, **values}, surface=[floor], run={"until": 0.06, "dt": dt})
    recording = run(thrown(machine, (-0.05, R), (v, 0.0)))
    blows = recording.select(Kind.IMPACT)
    if v * dt > R * theta / 2.0:
        assert not len(blows)
        vx, vy = recording.at([0.0515])[1][0, 0]
        # On the arc it rises by (v t)^2 / (2 (R - r)).
        assert vx == pytest.approx(v, rel=1e-4)
        assert vy == pytest.approx(0.0015 * v * v / (radius - R), abs=2.0 * ledge / dt)
    else:
        back = (1.0 + restitution) * v * sin(theta)
        struck = 0.05 - R * sin(theta)
        assert blows["t"][0] == pytest.approx(struck / v, abs=1e-7)
        after = [v - back * sin(theta), back * cos(theta)]
        # It comes to the edge from a hop of one step.
        np.testing.assert_allclose(blows["velocity_after"][0], after, rtol=0, atol=2.0 * G * dt)


# Inside and outside of arcs


WHEEL = {"center": (0.0, 0.0), "radius": 0.31, "begin": 0.0, "extent": 2.0 * pi}
DOWN, TOP = (0.0, R - 0.31), (0.0, R + 0.31)


def conveyor():
    """Two pulleys, belts joined to them tangentially: it is carried up, and round the upper one."""
    ends, wheel, speed = np.array([[1.0, 0.5], [2.0, 0.7]]), 0.2, 0.8
    along = (ends[1] - ends[0]) / hypot(*(ends[1] - ends[0]))
    up = np.array([-along[1], along[0]])
    usual = {"friction": 1e6, "restitution": 0.0, "speed": speed}
    top, low = (ends + side * wheel * up for side in (1.0, -1.0))
    belts = [face("top", *top.tolist(), **usual), face("below", *low[::-1].tolist(), **usual)]
    wheels = [{**WHEEL, "center": end, "radius": wheel, **usual} for end in ends]
    machine = arc_machine(*wheels, surface=belts, run={"until": 1.6})
    return thrown(machine, top[0] + 0.3 * along + R * up, speed * along)


def ring(pace, until=0.7, *, place=DOWN, share=0.0, rolling=0.0, **values):
    """Inside or outside a ring, without friction or, as a body of I = share m r², rolling."""
    machine = arc_machine(WHEEL | values, spin=share > 0.0, run={"until": until})
    machine = thrown(machine, place, [pace, 0.0])
    sized = {"rolling": np.array([rolling])} if rolling else {}
    return of_sizes(machine, np.array([R]), 0.1, share, **sized) if share else machine


def chute(slope, end):
    """A straight chute that leads tangentially into an arc, with friction; that ends in the air."""
    size, mu, first, last = 0.4, 0.2, 1.5 * pi - slope, radians(end)
    onward, up = np.array([cos(slope), -sin(slope)]), np.array([sin(slope), cos(slope)])
    joint = size * np.array([cos(first), sin(first)])
    usual = {"friction": mu, "restitution": 0.0}
    straight = face("chute", joint - 0.3 * onward, joint, **usual)
    arc = {"center": (0.0, 0.0), "radius": size, "begin": first, "extent": last - first, **usual}
    machine = arc_machine(arc, surface=[straight], run={"until": 0.9})
    return thrown(machine, joint - 0.25 * onward + R * up)


def fast_belt():
    """It comes to 2 m/s, too fast for the pulley: the circle below the belt presses it nowhere."""
    belt = {"name": "belt", "from": [-1.0, -0.1], "to": [1.0, -0.1], "speed": 2.0,
            "pulley_radius": 0.1, "friction": 0.4, "restitution": 0.0}  # fmt: skip
    machine = scene_of(particle={"spin": False}, conveyor=[belt], run={"until": 0.9})
    return thrown(machine, (0.0, R), (1.6, 0.0))


RIDES = {
    "round a loop": (ring(sqrt(5.5 * G * 0.3)), 130.0),
    "off a loop near its top": (ring(sqrt(4.0 * G * 0.3), 0.55), 30.0),
    "up and down a bowl": (ring(2.0, 1.2), 20.0),
    "off the outside": (ring(0.5, 0.8, place=TOP), 10.0),
    "a sphere that rolls in a bowl": (ring(1.3, 1.2, share=0.4, friction=5.0), 10.0),
    "slipping in a drum": (ring(0.0, 1.0, friction=0.3, speed=1.0), 10.0),
    "over a crest that grips": (ring(0.6, 0.5, place=TOP, share=0.5, friction=1e6), 10.0),
    "a conveyor": (conveyor(), 50.0),
    "a conveyor that throws": (fast_belt(), 10.0),
    "off a curved chute, soon": (chute(radians(45.0), 275.0), 40.0),
    "off a curved chute": (chute(radians(60.0), 262.0), 40.0),
}
"""What lasts on arcs, and how far the contact engine may be off, per dt², m/s²."""


def test_rolling_friction_in_a_bowl_comes_to_what_exact_says_in_first_order():
    machine = ring(1.3, 1.2, share=0.4, friction=5.0, rolling=0.1)
    known, times = exact.run(machine), np.linspace(0.0, 1.199, 300)
    for dt in (2e-3, 5e-4):
        found = run(replace(machine, dt=dt))
        assert np.abs(found.at(times)[0] - known.at(times)[0]).max() < 0.3 * dt
        assert residual(found) < 1e-12


@pytest.mark.parametrize("name", RIDES)
def test_what_lasts_on_arcs_comes_to_what_exact_says_in_second_order(name):
    machine, most = RIDES[name]
    known = exact.run(machine)
    times = np.linspace(0.0, machine.end_time * 0.999, 300)
    left = known.select(Kind.SEPARATION)
    for dt in (2e-3, 1.3e-3, 5e-4, 2.5e-4):
        found = run(replace(machine, dt=dt))
        error = np.abs(found.at(times)[0] - known.at(times)[0]).max()
        assert error < most * dt**2, (dt, error / dt**2)
        told = found.select(Kind.SEPARATION)
        assert told["surface"].tolist() == left["surface"].tolist()
        np.testing.assert_allclose(told["t"], left["t"], rtol=0, atol=60.0 * dt**2)
        assert residual(found) < 1e-12


@pytest.mark.parametrize("crowded", [False, True])
def test_pieces_in_one_place_are_one(crowded):
    """All pieces twice, and in a crowd a second disk that slides on a floor: the same paths."""
    bowl = {"center": (0.0, 0.0), "radius": 1.1 * R, "begin": 0.5 * pi, "extent": 1.5 * pi}
    floor = face("floor", (-0.1, -0.05), (0.1, -0.05), friction=0.3)
    ends = []
    for times in (1, 2):
        floors = [floor | {"name": f"floor{n}"} for n in range(times)]
        machine = arc_machine(*[bowl] * times, surface=floors, run={"until": 0.46})
        starts = np.array([[-0.09 * R, 0.0435 * R], [0.05, R - 0.05]])[: 1 + crowded]
        recording = run(thrown(machine, starts, np.array([[0.0, 0.0], [0.1, 0.0]])[: 1 + crowded]))
        ends.append(recording.at(np.linspace(0.0, 0.459, 100))[0])
    assert np.abs(ends[1] - ends[0]).max() < 1e-9 * R


def hollow_crowd(seed, extent, restitution, friction, **tables):
    """Twelve disks that slide along a hollow of 0.3 m, or fly in it, without gravity."""
    draw, size, count = np.random.default_rng(seed), 0.3, 12
    angle = pi + 0.15 + (np.arange(count) + draw.uniform(0.1, 0.4, count)) * (pi - 0.3) / count
    away = (size - R) * np.where(draw.random(count) < 0.5, 1.0, draw.uniform(0.7, 1.0, count))
    speed = draw.uniform(-2.0, 2.0, count)
    places = away * np.array([np.cos(angle), np.sin(angle)])
    arc = {"center": (0.0, 0.0), "radius": size, "begin": pi, "extent": extent,
           "restitution": restitution, "friction": friction}  # fmt: skip
    machine = arc_machine(
        arc, gravity=0.0, **tables, stream={"restitution": restitution, "friction": friction}
    )
    return run(thrown(machine, places.T, (speed * [-np.sin(angle), np.cos(angle)]).T))


@pytest.mark.parametrize("extent", [pi, 2.0 * pi])
@pytest.mark.parametrize("seed", range(3))
def test_in_an_elastic_hollow_without_gravity_a_crowd_keeps_its_energy(seed, extent):
    """Sliding along it, struck off it, and over its ends: Σ m v² / 2 stays, at every knot."""
    recording = hollow_crowd(seed, extent, 1.0, 0.0, run={"until": 0.5})
    books = ledger(recording)
    assert books.kinetic[1] == pytest.approx(books.kinetic[0], rel=1e-12)
    steps = np.concatenate([np.diff(recording.track(n)["entries"], axis=0) for n in range(12)])
    assert np.abs(steps).max() < 1e-12 * books.kinetic[0]
    # What the first chord of the fastest would gain, J: nothing allows for it.
    knots, mass = recording.knots.copy(), recording.particle.mass
    row = int((np.hypot(*knots["velocity"].T) * (knots["t"] > 0.0)).argmax())
    lift = 0.5 * recording.machine.dt * np.hypot(*knots["velocity"][row]) ** 2 / (0.3 - R)
    knots["entries"][row:, 1] -= 0.5 * mass * lift**2
    planted = replace(recording, knots=knots)
    assert judge(recording) == ()
    assert LOSSES in {broken.law for broken in judge(planted)}


@pytest.mark.parametrize("count", [10, pytest.param(300, marks=pytest.mark.slow)])
def test_no_crowd_in_hollows_breaks_a_law(count):
    """And those in which one had sunk in, came over a slit's end, or lay in a wedge of two."""
    seeds = [*range(count), 863, 2197, 2558, 6262, 7916]
    broken = {seed: [law.told for law in judge(run(hollow(seed)))] for seed in seeds}
    assert {seed: told for seed, told in broken.items() if told} == {}


@pytest.mark.parametrize("crowded", [False, True])
@pytest.mark.parametrize("size", [1.05, 1.3, 4.0])
def test_in_an_elastic_drum_without_gravity_all_chords_are_alike(size, crowded):
    # Chords of the circle of the centre, l = R - r, that make an angle α with it: 2 l sin α long.
    # A fast one crosses the drum many times in a step.
    length, speed, alpha = (size - 1.0) * R, 2.0, 0.8
    arc = {"center": (0.3, 0.2), "radius": size * R, "begin": 0.4, "extent": 2.0 * pi,
           "restitution": 1.0}  # fmt: skip
    machine = arc_machine(arc, gravity=0.0, run={"until": 0.1, "dt": 1e-3})
    start = np.array([0.3, 0.2]) + (length * cos(alpha) * np.array([0.0, -1.0]))
    places = [start, (1.0, 1.0)] if crowded else [start]
    recording = run(thrown(machine, places, [speed, 0.0]))
    met = recording.select(Kind.IMPACT)
    chord = 2.0 * length * sin(alpha) / speed
    assert len(met) == int(0.1 / chord + 0.5)
    np.testing.assert_allclose(met["t"], (np.arange(len(met)) + 0.5) * chord, rtol=1e-9, atol=1e-14)
    assert hypot(*met["velocity_after"][-1]) == pytest.approx(speed, rel=1e-12)


@pytest.mark.parametrize("crowded", [False, True])
@pytest.mark.parametrize("dt", [1e-3, 1e-5])
@pytest.mark.parametrize("room", [5e-6, 1e-4, 1e-2])
def test_a_disk_comes_off_a_hollow_however_tight_it_is(room, dt, crowded):
    """It is struck with u and comes off with ε u: at α = atan(ε u / v) to the wall.

    The arc ends before α, so that it passes the end. That is so whatever the arc's radius and the
    step are, down to α of a hundredth.
    """
    v, u, bounce = 3.0, 1.0, 0.3
    half = 0.5 * atan(bounce * u / v)
    cup = {
        "center": (0.0, 0.0),
        "radius": R + room,
        "begin": -0.5 * pi - half,
        "extent": 2.0 * half,
    }
    machine = arc_machine(
        {**cup, "restitution": bounce}, gravity=0.0, run={"until": 0.02, "dt": dt}
    )
    places = [(0.0, -room), (5.0, 5.0)] if crowded else [(0.0, -room)]
    last = run(thrown(machine, places, [(v, -u), (0.0, 0.0)][: len(places)])).track(0)[-1]
    np.testing.assert_allclose(last["velocity"], [v, bounce * u], rtol=1e-12)
    np.testing.assert_allclose(last["position"], [0.02 * v, 0.02 * bounce * u - room], rtol=1e-12)


def test_in_a_crowd_a_disk_struck_inside_a_tight_arc_slides_on_as_fast_as_it_came_along():
    """Without restitution, friction and gravity v cos α is left, α to the wall, and it stays.

    Each step turns it by a tenth of a radian or more: whatever a chord of its way is off by, or how
    much energy the mean of two of its velocities lacks, shows as another speed.
    """
    length, speed, alpha = 0.3 * R, 2.0, 0.8
    arc = {"center": (0.0, 0.0), "radius": 1.3 * R, "begin": 0.4, "extent": 2.0 * pi,
           "restitution": 0.0}  # fmt: skip
    machine = arc_machine(arc, gravity=0.0, run={"until": 0.1, "dt": 1e-3})
    places = [(0.0, -length * cos(alpha)), (1.0, 1.0)]
    recording = run(thrown(machine, places, [(speed, 0.0), (0.0, 0.0)]))
    last = recording.track(0)[-1]
    assert hypot(*last["velocity"]) == pytest.approx(speed * cos(alpha), rel=1e-12)
    assert judge(recording) == ()


@pytest.mark.parametrize("start", [0.09, 0.055, 0.047])
def test_a_fast_disk_meets_the_far_side_of_a_ring_that_it_enters_in_the_same_step(start):
    # A C of radius 0.05 m, open to the left: at 100 m/s it goes all through it within 1 ms.
    ring = {"center": (0.0, 0.0), "radius": 0.05, "begin": -0.8 * pi, "extent": 1.6 * pi}
    machine = arc_machine(ring, gravity=0.0, run={"until": 0.01, "dt": 5e-3})
    met = run(thrown(machine, [-start, 0.003], [100.0, 0.0])).select(Kind.IMPACT)
    far = sqrt((0.05 - R) ** 2 - 0.003**2)
    assert met["t"][0] == pytest.approx((start + far) / 100.0, rel=1e-12)
    assert met["position"][0][0] == pytest.approx(far, rel=1e-12)


def first_within(place, velocity, center, reach):
    """Return when a parabola comes within reach of a centre: the first root of a quartic."""
    x, y = np.subtract(place, center)
    fall = [-0.5 * G, velocity[1], y]
    gap = np.polyadd(np.polymul([velocity[0], x], [velocity[0], x]), np.polymul(fall, fall))
    roots = np.roots(np.polysub(gap, [reach**2]))
    return roots.real[(np.abs(roots.imag) < 1e-12) & (roots.real > 0.0)].min()


@pytest.mark.parametrize("crowded", [False, True])
@pytest.mark.parametrize("aside", [0.002, 0.004, 0.007, 0.0099])
def test_the_end_of_an_arc_is_struck_by_what_comes_in_at_the_opening(aside, crowded):
    # The upper end of a half circle that opens to the left; the disk would go by inside, too near.
    end, speed = (0.0, 0.31), 10.0
    bowl = {"center": (0.0, 0.0), "radius": 0.31, "begin": -0.5 * pi, "extent": pi,
            "restitution": 0.5}  # fmt: skip
    place, velocity = (-0.2, end[1] - aside), (speed, 0.5 * G * 0.2 / speed)
    machine = arc_machine(bowl, run={"until": 0.2})
    recording = run(thrown(machine, [place, (9.0, 9.0)] if crowded else [place], velocity))
    hit = recording.select(Kind.IMPACT)[0]
    t = first_within(place, velocity, end, R)
    x = np.array([place[0] + velocity[0] * t, place[1] + velocity[1] * t - 0.5 * G * t**2])
    assert hit["t"] == pytest.approx(t, abs=1e-11)
    np.testing.assert_allclose(hit["position"], x, atol=1e-11)
    normal, v = (x - end) / R, np.array([velocity[0], velocity[1] - G * t])
    np.testing.assert_allclose(hit["velocity_after"], v - 1.5 * (v @ normal) * normal, atol=1e-9)


def test_what_flies_away_over_an_arc_is_not_struck_by_its_inside():
    # Beside a bowl, below its rim, it falls on the ground: one blow.
    bowl = {"center": (0.0, 1.0), "radius": 0.4, "begin": -pi, "extent": pi}
    ground = face("ground", (-1.0, 0.61), (-0.28, 0.61), restitution=0.8, friction=0.0)
    machine = arc_machine(bowl, surface=[ground], run={"until": 0.3})
    recording = run(thrown(machine, [(-0.33, 0.67)], (0.0, -0.5)))
    hit, v = recording.select(Kind.IMPACT)[0], sqrt(0.25 + 2.0 * G * (0.06 - R))
    assert hit["t"] == pytest.approx((v - 0.5) / G, abs=1e-12)
    assert hit["velocity_after"][1] == pytest.approx(0.8 * v, rel=1e-12)


@pytest.mark.parametrize("late", np.linspace(0.0, 1e-3, 7).tolist())
def test_a_disk_that_brushes_a_peg_from_below_is_struck(late):
    # At the top it would be 0.4 µm in the peg, less than its way bends in a step, 1.2 µm.
    peg, reach, speed = 0.003, R + 0.003, 1.0
    rise = 0.01 + late
    place = (-speed * rise, -reach + 4e-7 - 0.5 * G * rise**2)
    machine = arc_machine({"center": (0.0, 0.0), "radius": peg, "begin": 0.0, "extent": 2.0 * pi,
                           "restitution": 0.5}, run={"until": 0.05})  # fmt: skip
    recording = run(thrown(machine, [place], (speed, G * rise)))
    hit = recording.select(Kind.IMPACT)[0]
    assert hit["t"] == pytest.approx(
        first_within(place, (speed, G * rise), (0.0, 0.0), reach), abs=1e-9
    )


@pytest.mark.parametrize("outside", [False, True])
def test_the_end_of_a_moving_arc_runs_as_its_nearer_face(outside):
    # It falls on the end of a quarter, whose tangent there is upright, a little outside or inside:
    # round the end the arc runs clockwise where it is nearer to the outside, else the other way.
    quarter = {"center": (0.0, 0.0), "radius": 0.4, "begin": -0.5 * pi, "extent": 0.5 * pi,
               "speed": 1.0, "friction": 0.1, "restitution": 0.5}  # fmt: skip
    aside = 0.015 * R if outside else -0.015 * R
    machine = arc_machine(quarter, run={"until": 0.3})
    recording = run(thrown(machine, [(0.4 + aside, 0.2)]))
    hit = recording.select(Kind.IMPACT)[0]
    normal = np.array([aside, sqrt(R**2 - aside**2)]) / R
    approach = -(hit["velocity_before"] @ normal)
    along = np.array([normal[1], -normal[0]])
    slip = hit["velocity_before"] @ along - (1.0 if outside else -1.0)
    push = -np.sign(slip) * 0.1 * 1.5 * approach
    expected = hit["velocity_before"] + 1.5 * approach * normal + push * along
    np.testing.assert_allclose(hit["velocity_after"], expected, atol=1e-9)


# Gates


@pytest.mark.parametrize(("engine", "crowded"), [(contact, False), (contact, True), (exact, False)])
@pytest.mark.parametrize("arc", [False, True])
def test_a_gate_that_shuts_ignores_what_it_overlaps_and_holds_what_comes(arc, engine, crowded):
    # Three fall past y = 0: one in it when it shuts falls on freely, as does one just beyond it;
    # the third meets it as the parabola does.
    shut = 0.2001
    fallen = 0.5 * G * shut**2
    floor = face("floor", (-9.0, 0.0), (9.0, 0.0), restitution=0.0, friction=0.5)
    machine = scene_of(
        surface=[floor, FAR],
        stream={"count": 2, "interact": True, "rate": 1.0, "bed_height": 1.0},
        run={"until": 0.5},
    )
    if arc:
        machine = gated(machine, 0, vanishes=-1.0)
        machine = bent(machine, {"center": (0.0, -500.0), "radius": 500.0, "begin": 0.4 * pi,
                                 "extent": 0.2 * pi, "appears": shut})  # fmt: skip
    else:
        machine = gated(machine, 0, appears=shut)
    heights = [fallen + 0.3 * R, fallen - 1.1 * R, fallen + 3.0 * R]
    for chosen in ([0, 1, 2],) if crowded else ([0], [1], [2]):
        places = [[0.05 * n, heights[n]] for n in chosen]
        recording = engine.run(thrown(machine, places))
        for k, n in enumerate(chosen):
            track = recording.track(k)
            y = recording.at([0.49])[0][0, k, 1]
            if n < 2:
                assert y == pytest.approx(heights[n] - 0.5 * G * 0.49**2, abs=1e-9)
            else:
                below = -0.5 * (0.05 * n) ** 2 / 500.0 if arc else 0.0
                met = recording.select(Kind.IMPACT)
                met = met[met["particle"] == k][0]
                t = sqrt(2.0 * (heights[n] - R - below) / G)
                assert met["t"] == pytest.approx(t, abs=1e-6 if arc else 1e-12)
                assert track[-1]["position"][1] == pytest.approx(R + below, abs=1e-3 * R)


@pytest.mark.parametrize("engine", [contact, exact])
def test_a_gate_opens_and_shuts_again_to_the_instant(engine):
    # Two pieces of one surface: there until 0.1 s, and from 0.3 s on.
    gate = {"name": "gate", "points": [[-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0]], "friction": 0.5,
            "restitution": 0.0}  # fmt: skip
    machine = gated(scene_of(surface=[gate, FAR], run={"until": 0.6}), 0, vanishes=0.1)
    machine = gated(machine, 1, appears=0.3)
    for late, low in ((0.0, None), (0.31, R)):
        one = thrown(machine, [0.0, R], t=late)
        y = engine.run(one).at([0.59])[0][0, 0, 1]
        expected = low if low is not None else R - 0.5 * G * (0.59 - 0.1) ** 2
        assert y == pytest.approx(expected, abs=1e-6)


FLOOR = {"name": "floor", "from": [0.0, 0.0], "to": [0.5, 0.0], "friction": 0.3}


def beside_a_gate(shape, x, **gate):
    """Where a particle ends that is dropped near the end of FLOOR, with such a gate and without."""
    tables = {"particle": {"mass": 0.1, "spin": True} | shape, "run": {"until": 0.4},
              "stream": {"at": [x, 0.05], "velocity": [0.0, 0.0]}}  # fmt: skip
    runs = [
        chutelab.simulate(tables | {"surface": surfaces}, engine="contact")
        for surfaces in ([FLOOR, {"name": "gate", "radius": 0.2} | gate], [FLOOR])
    ]
    assert not any(recording.laws for recording in runs)
    return [recording.ends()[1]["position"][0] for recording in runs]


@pytest.mark.parametrize("shape", [{"shape": "box", "size": [0.06, 0.06]}, {"radius": 0.03}])
def test_where_a_gate_has_opened_all_is_as_if_it_had_never_been(shape):
    """The end of a floor that an arc continued smoothly is a tip again; boxes fell through it."""
    above = {"center": [0.0, 0.2], "from_deg": 180.0, "to_deg": 270.0}
    below = {"center": [0.0, -0.2], "from_deg": 90.0, "to_deg": 180.0}
    for arc in (above, below):
        for x in (-0.02, -0.01, 0.01):
            assert np.allclose(*beside_a_gate(shape, x, **arc, opens_at=0.005), atol=1e-9)


@pytest.mark.parametrize("shape", [{"shape": "box", "size": [0.06, 0.06]}, {"radius": 0.03}])
def test_what_a_gate_has_closed_on_still_lies_on_the_surface_that_it_continues(shape):
    """It ignores the gate, which is no face of the floor for it then."""
    for x in (-0.02, -0.012):
        gate = {"center": [0.0, 0.2], "from_deg": 180.0, "to_deg": 270.0, "closes_at": 0.08}
        assert np.allclose(*beside_a_gate(shape, x, **gate), atol=1e-3)


def drawn_piece(rng, name, angle):
    """A line or an arc that begins or ends at the origin and goes that way; some are belts."""
    way, side = np.array([cos(angle), sin(angle)]), rng.choice([-1.0, 1.0])
    piece = {"name": name, "friction": 0.5, "restitution": 0.5, "speed": rng.uniform(-2.0, 2.0)}
    if rng.random() < 0.5:
        ends = [[0.0, 0.0], (0.4 * way).tolist()][:: int(side)]
        return piece | {"from": ends[0], "to": ends[1]}
    radius, extent = rng.uniform(0.1, 0.3), side * rng.uniform(20.0, 150.0)
    center = radius * side * np.array([-way[1], way[0]])
    first = float(np.degrees(np.arctan2(*-center[::-1])))
    first, last = sorted([first, first + extent])
    return piece | {"center": center.tolist(), "radius": radius, "from_deg": first, "to_deg": last}


@pytest.mark.parametrize(
    ("engine", "crowded", "near", "count"),
    [("exact", False, 1e-9, 60), ("contact", False, 1e-9, 60), ("contact", True, 1e-9, 60),
     ("pymunk", False, 1e-4, 60), ("pymunk", True, 1e-3, 12),
     pytest.param("pymunk", True, 1e-3, 60, marks=pytest.mark.slow)],
)  # fmt: skip
def test_round_an_end_a_belt_runs_as_if_no_gate_had_been_there(engine, crowded, near, count):
    """Which way the rim of an end runs, and of what it is, the pieces say that are there."""
    met = 0
    for seed in range(count):
        rng = np.random.default_rng([3, seed])
        belt, gate = (drawn_piece(rng, name, rng.uniform(0.0, 2.0 * pi)) for name in ("on", "off"))
        angle, off = rng.uniform(0.0, 2.0 * pi), rng.uniform(-0.035, 0.035)
        way = np.array([cos(angle), sin(angle)])
        start = off * np.array([-way[1], way[0]]) - 0.2 * way
        scenes = [
            {"gravity": 0.0, "particle": {"radius": 0.03, "mass": 0.1, "spin": True},
             "surface": surfaces, "run": {"until": 0.15},
             "stream": {"count": 1 + crowded, "at": start.tolist(), "to": (start - way).tolist(),
                        "velocity": (2.0 * way).tolist(), "interact": crowded}}
            for surfaces in ([belt], [belt, gate | {"closes_at": 5.0}],
                             [belt, gate | {"opens_at": 0.0005}],
                             [gate | {"opens_at": 0.0005}, belt | {"closes_at": 0.0001}])
        ]  # fmt: skip
        try:
            runs = [chutelab.simulate(scene, engine=engine) for scene in scenes]
        except SceneError:
            # It would begin inside one of them.
            continue
        alone, *others = (one.ends()[1]["position"][0] for one in runs)
        assert np.allclose(others, alone, atol=near), seed
        met += not np.allclose(alone, start + 0.3 * way)
    assert met > count / 3


@pytest.mark.parametrize("seed", seeds(3, 100))
def test_a_gate_that_never_appears_changes_no_bit(seed):
    """Bodies in a machine whose lines go on in gates, but only after the end of the run."""
    tables = bodies(seed, both=False)
    rng, end, gates = np.random.default_rng([4, seed]), tables["run"]["until"], []
    moves = {"turn", "shake", "travel", "hinge"}
    for line in (one for one in tables["surface"] if "from" in one and not moves & one.keys()):
        for first, last in ((line["from"], line["to"]), (line["to"], line["from"])):
            way = np.subtract(last, first)
            piece = drawn_piece(rng, f"gate {len(gates)}", float(np.arctan2(*way[::-1])))
            for key in piece.keys() & {"from", "to", "center"}:
                piece[key] = np.add(piece[key], last).tolist()
            gates.append(piece | {"closes_at": end + 1.0})
    alone, beside = (
        chutelab.simulate(tables | {"surface": surfaces}, engine="contact").knots
        for surfaces in (tables["surface"], tables["surface"] + gates)
    )
    assert alone.tobytes() == beside.tobytes()


def test_a_particle_waits_until_a_gate_in_its_place_opens():
    for count in (1, 2):
        floor = face("gate", (-9.0, 0.0), (9.0, 0.0))
        machine = gated(scene_of(surface=[floor, FAR], run={"until": 0.5}), 0, vanishes=0.2)
        recording = run(thrown(machine, [[0.1 * n, 0.0] for n in range(count)]))
        released = recording.select(Kind.RELEASE)["t"]
        np.testing.assert_allclose(released, 0.2, rtol=0, atol=1e-12)


# Rolling friction


@pytest.mark.parametrize("share", [0.4, 0.5])
@pytest.mark.parametrize("rolling", [0.02, 5.0])
@pytest.mark.parametrize("friction", [0.05, 10.0])
@pytest.mark.parametrize("omega", [-60.0, 3.0, 150.0])
def test_in_a_blow_rolling_friction_takes_what_its_arm_allows(share, rolling, friction, omega):
    # Of all impulses J_t, J_3 with |J_t| <= µ J_n and |J_3| <= b J_n, b = rolling r, those that
    # leave the least energy: the slip left is against J_t, or 0 if |J_t| < µ J_n; alike the spin.
    floor = face("floor", (-9.0, 0.0), (9.0, 0.0), restitution=0.5, friction=friction)
    machine = scene_of(surface=[floor], run={"until": 0.3})
    machine = thrown(machine, [0.0, 0.1], [1.2, -1.0])
    machine = of_sizes(machine, R, 0.1, share, rolling=np.array([rolling]))
    core = Core(machine)
    core.disks["spin"] = omega
    recording = core.run()
    event = recording.select(Kind.IMPACT)[0]
    inertia = share * 0.1 * R**2
    normal, tangent = event["normal_impulse"], event["tangential_impulse"]
    couple = inertia * (event["omega_after"] - omega) - R * tangent
    slip = event["velocity_after"][0] + R * event["omega_after"]
    assert 0.1 * (event["velocity_after"][0] - 1.2) == pytest.approx(tangent, abs=1e-12)
    for impulse, most, left, scale in (
        (tangent, friction * normal, slip, 1.0), (couple, rolling * R * normal,
                                                  event["omega_after"], 100.0),
    ):  # fmt: skip
        assert abs(impulse) <= most * (1.0 + 1e-9)
        if abs(impulse) < most * (1.0 - 1e-9):
            assert abs(left) < 1e-9 * scale
        else:
            assert left * impulse <= 1e-12
    before = 0.5 * 0.1 * 1.2**2 + 0.5 * inertia * omega**2
    after = 0.5 * 0.1 * event["velocity_after"][0] ** 2 + 0.5 * inertia * event["omega_after"] ** 2
    track = recording.track(0)
    heat = track[np.searchsorted(track["t"], event["t"], side="right") - 1]["entries"][2]
    assert heat == pytest.approx(before - after, rel=1e-9, abs=1e-12)
    assert residual(recording) < 1e-12


def passing(meet):
    """Two balls that run into each other on a floor, of two kinds; and a third, as the first."""
    each = {"interact": True, "velocity": [0.0, 0.0], "restitution": 1.0, "friction": 0.0}
    return {
        "particle": [{"name": "a", "radius": 0.01, "mass": 0.008},
                     {"name": "b", "radius": 0.02, "mass": 0.02}],
        "pair": [{"between": ["a", "b"], "meet": meet}],
        "surface": [{"name": "floor", "from": [-2.0, 0.0], "to": [2.0, 0.0], "friction": 0.0}],
        "stream": [{"name": "s", "particle": "a", **each, "at": [-0.2, 0.01],
                    "velocity": [1.0, 0.0]},
                   {"name": "t", "particle": "b", **each, "at": [0.0, 0.02]},
                   {"name": "u", "particle": "a", **each, "at": [0.2, 0.01]}],
        "run": {"until": 0.5},
    }  # fmt: skip


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_two_kinds_pass_through_each_other_and_the_others_meet(engine):
    """The first hands all of its speed on to the third, as if nothing were between them."""
    recording = chutelab.simulate(passing(False), engine=engine)
    assert not recording.laws
    assert [{e["particle"], e["other"]} for e in recording.select("collision")] == [{0, 2}]
    (first, between, last) = recording.at([0.49])[1][0]
    assert last == pytest.approx([1.0, 0.0], abs=1e-2)
    assert np.abs([first, between]).max() < 1e-2
    stopped = chutelab.simulate(passing(True), engine=engine)
    assert {0, 1} in [{e["particle"], e["other"]} for e in stopped.select("collision")]


def test_what_passes_wakes_nothing_and_waits_for_nothing():
    """One lies in the place of the other, which is released there at once, and both sleep on."""
    scene = passing(False)
    first, other, _ = scene["stream"]
    late = {"at": [0.0, 0.01], "velocity": [0.0, 0.0], "start": 0.4}
    scene["stream"] = [other, first | late]
    recording = chutelab.simulate(scene | {"run": {"until": 1.0}})
    assert recording.select("release")["t"].tolist() == pytest.approx([0.0, 0.4])
    assert not len(recording.select("collision"))


def test_a_pair_that_does_not_meet_has_no_restitution_and_is_of_two_kinds():
    spoilt = passing(False)
    spoilt["pair"] = [{"between": ["a", "b"], "meet": False, "restitution": 0.5}]
    with pytest.raises(SceneError, match=r"pair\[0\].restitution = 0.5: is of what meets"):
        chutelab.load(spoilt)
    spoilt["pair"] = [{"between": ["a", "floor"], "meet": False}]
    with pytest.raises(SceneError, match=r"pair\[0\].meet = false: true with a surface"):
        chutelab.load(spoilt)
