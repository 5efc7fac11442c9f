"""Arcs, gates, mixtures, inclined belts, rolling friction in the contact engine, by their laws."""

from __future__ import annotations

from dataclasses import replace
from math import acos, asin, atan, cos, hypot, pi, sin, sqrt

import numpy as np
import pytest

from chutelab.engines.contact import run
from chutelab.results import REASONS, Kind
from chutelab.results.laws import LOSSES
from chutelab.results.ledger import ledger
from crowds import hollow
from machines import bent, face, gated, of_sizes, scene_of, thrown

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


def rk4(rate, y, span, steps=4000):
    """Return y after a span, by the classical method of fourth order."""
    h = span / steps
    for _ in range(steps):
        k1 = rate(y)
        k2 = rate(y + 0.5 * h * k1)
        k3 = rate(y + 0.5 * h * k2)
        k4 = rate(y + h * k3)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return y


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


@pytest.mark.parametrize("whole", [False, True])
def test_a_bead_loops_inside_an_arc_or_leaves_it_near_its_top(whole):
    # v² = v0² - 2 g l (1 - cos θ), l = R - r; it needs v² >= g l cos ψ, ψ = π - θ: so it goes round
    # if v0² >= 5 g l, else leaves at cos ψ = (v0²/(g l) - 2)/3.
    radius, length = 0.31, 0.3
    extent = 2.0 * pi if whole else 1.9 * pi
    arc = {"center": (0.4, 0.5), "radius": radius, "begin": pi if whole else 1.05 * pi,
           "extent": extent}  # fmt: skip
    for u0 in (5.5, 4.0):
        v0 = sqrt(u0 * G * length)
        machine = arc_machine(arc, run={"until": 0.7, "dt": 5e-4})
        recording = run(thrown(machine, [0.4, 0.5 - length], [v0, 0.0]))
        left = recording.select(Kind.SEPARATION)
        if u0 > 5.0:
            turn = rk4(
                lambda y: np.array([y[1], -G / length * sin(y[0])]), np.array([0.0, v0 / length]),
                0.45,
            )  # fmt: skip
            place, velocity = (one[0, 0] for one in recording.at([0.45]))
            assert turn[0] > pi  # beyond the top
            where = [0.4 + length * sin(turn[0]), 0.5 - length * cos(turn[0])]
            np.testing.assert_allclose(place, where, rtol=0, atol=2e-4)
            assert hypot(*velocity) == pytest.approx(length * turn[1], rel=1e-3)
            assert not len(left) or left["t"][0] > 0.45
        else:
            psi = acos((u0 - 2.0) / 3.0)
            away = left["position"][0] - [0.4, 0.5]
            assert np.arctan2(away[0], away[1]) == pytest.approx(psi, abs=3e-3)
            assert hypot(*left["velocity_after"][0]) == pytest.approx(
                sqrt(G * length * cos(psi)), rel=3e-3
            )


def test_a_sphere_rolls_inside_an_arc_as_a_pendulum_of_seven_fifths_its_mass():
    # Without slip, with I = 2/5 m r²: 7/5 m l θ'' = -m g sin θ.
    radius, length, angle = 0.26, 0.25, 0.9
    arc = {"center": (0.0, 0.0), "radius": radius, "begin": -pi, "extent": pi, "friction": 5.0}
    machine = arc_machine(arc, spin=True, run={"until": 1.0, "dt": 5e-4})
    machine = of_sizes(
        thrown(machine, length * np.array([sin(angle), -cos(angle)])), radius - length, 0.1, 0.4
    )
    recording = run(machine)
    for t in (0.3, 0.6, 0.9):
        theta, rate = rk4(
            lambda y: np.array([y[1], -G / (1.4 * length) * sin(y[0])]), np.array([angle, 0.0]), t
        )
        place, velocity = (one[0, 0] for one in recording.at([t]))
        np.testing.assert_allclose(
            place, [length * sin(theta), -length * cos(theta)], rtol=0, atol=1e-4
        )
        assert velocity @ [cos(theta), sin(theta)] == pytest.approx(length * rate, abs=2e-3)
    assert residual(recording) < 1e-12


@pytest.mark.parametrize(("share", "speed", "friction"), [(0.8, 0.5, 2.4), (0.9, 0.2, 2.4)])
def test_a_disk_that_a_hollow_belt_carries_up_stays_at_its_wall(share, speed, friction):
    """Friction speeds it up within a step: its way bends more than it did at the step's beginning.

    Its centre is R - r from the arc's, to a hundred thousandth of r at any of a thousand steps.
    """
    size = R / share
    drum = {"center": (0.0, 0.0), "radius": size, "begin": 0.0, "extent": 2.0 * pi}
    machine = arc_machine(drum | {"speed": speed, "friction": friction}, run={"until": 1.0})
    track = run(thrown(machine, (0.0, R - size))).track(0)
    off = np.hypot(*track["position"].T) - (size - R)
    assert np.hypot(*track["velocity"].T).max() > 0.5 * speed
    assert off.max() < 1e-5 * R


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


@pytest.mark.parametrize("dt", [4e-3, 1e-3])
def test_a_disk_of_a_crowd_keeps_its_speed_in_a_drum_without_gravity(dt):
    """Its path is a row of chords v dt long between points of a circle of radius l = R - r.

    Each turns it by 2 asin(v dt / 2 l), and none of the impulses between them does work. Steps are
    so short that (v² / l) dt² / 8 is a thousandth of the radius at most.
    """
    length, speed, end = 0.2, 1.5, 0.8
    step = min(dt, sqrt(8e-3 * R * length) / speed)
    drum = {"center": (0.0, 0.0), "radius": length + R, "begin": 0.3, "extent": 2.0 * pi}
    machine = arc_machine(drum, gravity=0.0, run={"until": end, "dt": dt})
    recording = run(thrown(machine, [(0.0, -length), (5.0, 5.0)], [(speed, 0.0), (0.0, 0.0)]))
    track = recording.track(0)
    turned = round(end / step) * 2.0 * asin(speed * step / (2.0 * length))
    np.testing.assert_allclose(np.hypot(*track["velocity"].T), speed, rtol=1e-12)
    np.testing.assert_allclose(
        track["position"][-1], length * np.array([sin(turned), -cos(turned)]), atol=1e-9 * length
    )
    assert np.abs(track["entries"]).max() < 1e-12 * speed**2 * recording.particle.mass


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
@pytest.mark.parametrize("seed", range(6))
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
    assert recording.laws == ()
    assert LOSSES in {broken.law for broken in planted.laws}


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("friction", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("seed", [0, 1, 2, 3, 24, 60])
def test_in_a_hollow_without_gravity_a_crowd_only_loses(seed, friction, restitution):
    for spin in (False, True):
        recording = hollow_crowd(seed, pi, restitution, friction, spin=spin, run={"until": 0.5})
        books = ledger(recording)
        assert residual(recording) < 1e-12
        assert recording.laws == ()
        assert min(books.restitution_loss, books.friction_loss) >= 0.0


def test_no_crowd_in_hollows_breaks_a_law():
    """300, and those in which one had sunk in, came over a slit's end, or lay in a wedge of two."""
    seeds = [*range(300), 863, 2197, 6262, 7916]
    broken = {seed: [law.told for law in run(hollow(seed)).laws] for seed in seeds}
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


def test_a_disk_larger_than_the_inside_of_a_cup_comes_to_rest_on_its_rims():
    # Half a circle open upwards, R < r: the centre is √(r² - R²) above the rims.
    cup = {"center": (0.0, 0.0), "radius": 0.8 * R, "begin": pi, "extent": pi, "friction": 0.3}
    machine = arc_machine(cup, spin=True, run={"until": 1.0})
    recording = run(thrown(machine, [0.002, 0.05]))
    last = recording.track(0)[-1]
    # A thousandth of the radius of overlap is left alone.
    np.testing.assert_allclose(last["position"], [0.0, 0.6 * R], rtol=0, atol=1e-3 * R)
    assert hypot(*last["velocity"]) < 1e-5
    assert residual(recording) < 1e-12


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


def test_who_flies_away_over_an_arc_is_not_struck_by_its_inside():
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


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("whole", [False, True])
def test_a_moving_arc_turns_clockwise(inside, whole):
    # A gripping blow on what runs clockwise at s: a disk that does not slide gets a third of it.
    arc = {"center": (3.0, 1.0), "radius": 0.2, "begin": -0.3 if whole else 0.2 * pi,
           "extent": 2.0 * pi if whole else 0.6 * pi, "speed": 1.5, "friction": 1e3,
           "restitution": 0.5}  # fmt: skip
    machine = arc_machine(arc, spin=True, gravity=0.0, run={"until": 0.2})
    start, way = ([3.0, 1.0], 0.2 - R) if inside else ([3.0, 1.3], 0.1 - R)
    event = run(thrown(machine, start, [0.0, 1.0 if inside else -1.0])).select(Kind.IMPACT)[0]
    assert event["t"] == pytest.approx(way, rel=1e-12)
    # At the top of the circle clockwise is to the right.
    assert event["velocity_after"][0] == pytest.approx(0.5, rel=1e-12)
    side = -1.0 if inside else 1.0
    assert event["omega_after"] * R == pytest.approx(side * 1.0, rel=1e-12)


def test_a_conveyor_carries_up_and_round_its_pulley():
    # Two pulleys away from the origin, belts joined to them tangentially: a disk that grips and
    # does not turn leaves the upper one where cos φ = v²/(g ρ).
    (x0, y0), (x1, y1), wheel, speed = (1.0, 0.5), (2.0, 0.7), 0.2, 0.8
    beta = np.arctan2(y1 - y0, x1 - x0)
    up, along = np.array([-sin(beta), cos(beta)]), np.array([cos(beta), sin(beta)])
    ends = np.array([[x0, y0], [x1, y1]])
    top, low = ends + wheel * up, ends - wheel * up
    usual = {"friction": 1e6, "restitution": 0.0, "speed": speed}
    belts = [face("top", *top.tolist(), **usual), face("below", *low[::-1].tolist(), **usual)]
    wheels = [{"center": c, "radius": wheel, "begin": 0.0, "extent": 2.0 * pi, **usual}
              for c in ends]  # fmt: skip
    machine = arc_machine(*wheels, surface=belts, run={"until": 1.6, "dt": 1e-3})
    start = top[0] + 0.3 * along + R * up
    recording = run(thrown(machine, start, speed * along))
    left = recording.select(Kind.SEPARATION)[-1]
    rho = wheel + R
    phi = acos(speed**2 / (G * rho))
    away = left["position"] - ends[1]
    assert np.arctan2(away[0], away[1]) == pytest.approx(phi, abs=0.01)
    assert hypot(*left["velocity_after"]) == pytest.approx(speed, rel=1e-3)
    length = hypot(x1 - x0, y1 - y0) - 0.3
    assert left["t"] == pytest.approx((length + rho * (phi + beta)) / speed, rel=2e-3)
    # The belts paid for the lifting.
    paid = recording.by_surface[:, 0].sum()
    assert paid == pytest.approx(0.1 * G * (left["position"][1] - start[1]), rel=0.02)
    assert residual(recording) < 1e-12


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_a_fast_conveyor_lets_go_where_its_pulley_begins(speed):
    # v² > g ρ: what has come to the belt's speed by Coulomb friction leaves at the end of the top.
    mu, drop, wheel = 0.2, 0.3 - R, 0.1
    belt = {"name": "belt", "from": [-1.2, -wheel], "to": [1.2, -wheel], "speed": speed}
    belt |= {"pulley_radius": wheel, "friction": mu}
    machine = scene_of(particle={"spin": False}, conveyor=[belt], run={"until": 1.5})
    recording = run(thrown(machine, (0.0, 0.3), (0.5 * speed, 0.0)))
    fall, gain = sqrt(2.0 * drop / G), 0.5 * abs(speed)
    # Friction turns the blow's impulse, and then the weight's, into speed: µ (g t + v_n) in all.
    slips = max(gain - mu * G * fall, 0.0) / (mu * G)
    after = min(gain, mu * G * fall)
    way = 0.5 * abs(speed) * fall + (0.5 * abs(speed) + after) * slips + 0.5 * mu * G * slips**2
    left = recording.select(Kind.SEPARATION)[-1]
    assert left["t"] == pytest.approx(fall + slips + (1.2 - way) / abs(speed), abs=2e-6)
    assert left["position"] == pytest.approx([np.sign(speed) * 1.2, R], abs=3e-6)
    assert left["velocity_after"] == pytest.approx([speed, 0.0], abs=1e-9)


# Gates


@pytest.mark.parametrize("crowded", [False, True])
@pytest.mark.parametrize("arc", [False, True])
def test_a_gate_shuts_on_nobody_and_holds_who_comes_later(arc, crowded):
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
        recording = run(thrown(machine, places))
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


def test_a_gate_opens_and_shuts_again_to_the_instant():
    # Two pieces of one surface: there until 0.1 s, and from 0.3 s on.
    gate = {"name": "gate", "points": [[-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0]], "friction": 0.5,
            "restitution": 0.0}  # fmt: skip
    machine = gated(scene_of(surface=[gate, FAR], run={"until": 0.6}), 0, vanishes=0.1)
    machine = gated(machine, 1, appears=0.3)
    for late, low in ((0.0, None), (0.31, R)):
        one = thrown(machine, [0.0, R], t=late)
        y = run(one).at([0.59])[0][0, 0, 1]
        expected = low if low is not None else R - 0.5 * G * (0.59 - 0.1) ** 2
        assert y == pytest.approx(expected, abs=1e-6)


def test_a_particle_waits_until_a_gate_in_its_place_opens():
    for count in (1, 2):
        floor = face("gate", (-9.0, 0.0), (9.0, 0.0))
        machine = gated(scene_of(surface=[floor, FAR], run={"until": 0.5}), 0, vanishes=0.2)
        recording = run(thrown(machine, [[0.1 * n, 0.0] for n in range(count)]))
        released = recording.select(Kind.RELEASE)["t"]
        np.testing.assert_allclose(released, 0.2, rtol=0, atol=1e-12)


# Mixtures


def test_an_elastic_blow_between_disks_of_different_masses():
    # Head on: u1 = ((m1 - m2) v1 + 2 m2 v2)/(m1 + m2), when the gap is used up.
    machine = scene_of(gravity=0.0, particle={"spin": False}, surface=[FAR],
                       stream={"count": 2, "interact": True, "rate": 1.0, "bed_height": 1.0},
                       run={"until": 0.5})  # fmt: skip
    machine = thrown(machine, [[0.0, 0.0], [0.5, 0.0]], [[1.0, 0.0], [-2.0, 0.0]])
    radius, mass = np.array([0.004, 0.04]), np.array([0.02, 3.0])
    machine = of_sizes(machine, radius, mass, 0.4, pair_restitution=np.ones((1, 1)))
    event = run(machine).select(Kind.COLLISION)[0]
    assert event["t"] == pytest.approx((0.5 - 0.044) / 3.0, rel=1e-13)
    expected = ((0.02 - 3.0) * 1.0 + 2.0 * 3.0 * -2.0) / 3.02
    assert event["velocity_after"][0] == pytest.approx(expected, rel=1e-12)


def test_each_kind_has_its_own_values_with_each_surface():
    # (K, S): two kinds dropped on a segment and on an arc, e² of the height comes back.
    floor = face("floor", (-1.0, 0.0), (1.0, 0.0))
    ball = {"center": (3.0, -0.5), "radius": 0.5, "begin": 0.0, "extent": pi}
    machine = bent(scene_of(surface=[floor], run={"until": 0.3}), ball)
    machine = thrown(machine, [[-0.1, 0.1], [0.1, 0.1], [3.0, 0.1], [3.0, 0.4]], t=0.0)
    rest, none = np.array([[0.2], [0.7]]), np.zeros((2, 2))
    machine = of_sizes(
        replace(machine, interact=False), np.array([0.01, 0.02, 0.01, 0.02]), 0.1, 0.5,
        [0, 1, 1, 0], pair_restitution=none, pair_friction=none, rolling=np.zeros(2),
        segments=replace(machine.segments, restitution=rest, friction=0.0 * rest),
        arcs=replace(machine.arcs, restitution=rest + 0.1, friction=0.0 * rest),
    )  # fmt: skip
    met = run(machine).select(Kind.IMPACT)
    first = [met[met["particle"] == n][0] for n in range(4)]
    ratio = [-one["velocity_after"][1] / one["velocity_before"][1] for one in first]
    np.testing.assert_allclose(ratio, [0.2, 0.7, 0.8, 0.3], rtol=1e-12)


def test_small_disks_lie_between_large_ones_in_a_box():
    # Radii from 3 to 30 mm, drawn by their logarithms.
    rng = np.random.default_rng(5)
    radius = 0.003 * 10.0 ** rng.uniform(0.0, 1.0, 80)
    mass = 2000.0 * 4.0 / 3.0 * pi * radius**3
    walls = {"name": "box", "points": [[-0.2, 2.0], [-0.2, 0.0], [0.2, 0.0], [0.2, 2.0]],
             "restitution": 0.3, "friction": 0.4}  # fmt: skip
    machine = scene_of(
        surface=[walls],
        stream={"count": 2, "interact": True, "rate": 1.0, "bed_height": 1.0},
        run={"until": 1.2},
    )
    k = np.arange(80)
    place = np.stack([-0.15 + 0.1 * (k % 4), 0.05 + 0.07 * (k // 4)], axis=1)
    machine = of_sizes(
        thrown(machine, place), radius, mass, 0.4, pair_friction=np.full((1, 1), 0.4)
    )
    recording = run(machine)
    x = recording.at(np.linspace(0.01, 1.19, 60))[0]
    gap = np.hypot(*np.moveaxis(x[:, :, None] - x[:, None], -1, 0)) - (radius + radius[:, None])
    gap[:, k, k] = np.inf
    assert (gap / np.minimum(radius, radius[:, None])).min() > -0.03
    wall = np.minimum(np.minimum(x[..., 0] + 0.2, 0.2 - x[..., 0]), x[..., 1]) - radius
    assert (wall / radius).min() > -0.03
    assert residual(recording) < 1e-10


def test_streams_are_released_each_at_its_own_times():
    t = np.array([0.0, 0.2, 0.4, 0.1, 0.3, 0.05])
    machine = scene_of(
        surface=[FAR],
        stream={"count": 2, "interact": True, "rate": 1.0, "bed_height": 1.0},
        run={"until": 0.6},
    )
    machine = thrown(machine, [[0.1 * n, 1.0] for n in range(6)])
    machine = replace(machine, releases=replace(machine.releases, t=t))
    for interact in (True, False):
        recording = run(replace(machine, interact=interact))
        y = recording.at([0.59])[0][0, :, 1]
        np.testing.assert_allclose(y, 1.0 - 0.5 * G * (0.59 - t) ** 2, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(recording.select(Kind.RELEASE)["t"], np.sort(t))


# Inclined belts


def inclined(beta, speed, height=0.0):
    """A disk that rides an adhesive belt, which rises by an angle, half a metre to the pulley."""
    machine = scene_of(
        particle={"spin": False}, incoming={"speed": 2.0, "pulley_radius": 0.3},
        stream={"at": None, "velocity": None}, run={"until": 3.0},
    )  # fmt: skip
    up, along = np.array([-sin(beta), cos(beta)]), np.array([cos(beta), sin(beta)])
    segments = machine.segments
    end = 0.3 * up
    segments = replace(
        segments, start=(end - along)[None], tangent=along[None], speed=np.array([speed])
    )
    place = end - 0.5 * along + (R + height) * up
    releases = replace(machine.releases, position=place[None], velocity=speed * along[None])
    pulley = replace(machine.pulley, incline=beta, speed=speed)
    return replace(machine, segments=segments, pulley=pulley, releases=releases)


@pytest.mark.parametrize("height", [0.0, 0.02])
@pytest.mark.parametrize("speed", [0.6, 1.5, 3.0])
@pytest.mark.parametrize("beta", [0.35, -0.35, 0.0])
def test_an_inclined_belt_throws_off_where_the_law_says(beta, speed, height):
    # At the tangent point if v² >= g ρ cos β, else rides on until cos φ = v²/(g ρ).
    rho = 0.3 + R + height
    c = speed**2 / (G * rho)
    phi = -beta if c >= cos(beta) else acos(c)
    recording = run(inclined(beta, speed, height))
    event = recording.select(Kind.SEPARATION)[0]
    t = (0.5 + rho * (phi + beta)) / speed
    assert event["t"] == pytest.approx(t, rel=1e-13)
    place = rho * np.array([sin(phi), cos(phi)])
    np.testing.assert_allclose(event["position"], place, rtol=0, atol=1e-13)
    velocity = speed * np.array([cos(phi), -sin(phi)])
    np.testing.assert_allclose(event["velocity_after"], velocity, rtol=0, atol=1e-13)
    # Until then all that the belt paid is the lifting.
    track = recording.track(0)
    riding = track[track["t"] <= t]
    lifted = 0.1 * G * (riding["position"][:, 1] - riding["position"][0, 1])
    np.testing.assert_allclose(riding["entries"][:, 0], lifted, rtol=0, atol=1e-13)
    # A straight ride is two knots; round the pulley one each 24 mrad.
    assert len(riding) <= 3 + (phi + beta) / 0.024
    times = np.linspace(0.0, t, 200)
    way = speed * times - 0.5
    angle = np.maximum(way, 0.0) / rho - beta
    straight = np.minimum(way, 0.0)
    x = rho * np.sin(angle) + straight * np.cos(angle)
    y = rho * np.cos(angle) - straight * np.sin(angle)
    found = recording.at(times)[0][:, 0]
    np.testing.assert_allclose(found, np.stack([x, y], axis=1), rtol=0, atol=1e-9 * rho)
    assert residual(recording) < 1e-12


def test_a_rider_stops_at_a_gate_that_shuts_before_it_and_passes_one_that_shuts_on_it():
    # It comes to x = -0.2 with its rim after (0.3 - r)/v.
    speed = 0.5
    usual = {"stream": {"at": None, "velocity": None}, "run": {"until": 2.5}}
    wall = face("wall", (-0.2, 0.301), (-0.2, 0.6), friction=0.5, restitution=0.0)
    machine = scene_of(
        particle={"spin": False}, incoming={"speed": speed, "pulley_radius": 0.3, "length": 0.5},
        surface=[wall], **usual,
    )  # fmt: skip
    for shuts, passes in ((0.3, False), (0.3 / speed, True), (0.9, True)):
        recording = run(gated(machine, 1, appears=shuts))
        met = recording.select(Kind.IMPACT)
        if passes:
            assert recording.select(Kind.SEPARATION)["t"][0] > 1.0
        else:
            assert recording.select(Kind.SEPARATION)["t"][0] == pytest.approx(
                (0.3 - R) / speed, rel=1e-9
            )
            assert met["surface"][0] == 1


# Rolling friction


@pytest.mark.parametrize("share", [0.4, 0.5])
@pytest.mark.parametrize("rolling", [0.02, 0.3, 5.0])
@pytest.mark.parametrize("friction", [0.05, 10.0])
@pytest.mark.parametrize("omega", [-60.0, 3.0, 150.0])
def test_in_a_blow_rolling_friction_takes_what_its_arm_allows(share, rolling, friction, omega):
    # Of all impulses J_t, J_3 with |J_t| <= µ J_n and |J_3| <= b J_n, b = rolling r, those that
    # leave the least energy: the slip left is against J_t, or 0 if |J_t| < µ J_n; alike the spin.
    floor = face("floor", (-9.0, 0.0), (9.0, 0.0), restitution=0.5, friction=friction)
    machine = scene_of(surface=[floor], run={"until": 0.3})
    machine = thrown(machine, [0.0, 0.1], [1.2, -1.0])
    machine = of_sizes(machine, R, 0.1, share, rolling=np.array([rolling]))
    from cores import Core

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


@pytest.mark.parametrize("crowded", [False, True])
def test_a_rolling_sphere_comes_to_rest_in_a_bowl_by_its_rolling_friction(crowded):
    # It settles somewhere within the slope that the arm holds: tan θ <= rolling.
    rolling, length = 0.05, 0.25
    bowl = {"center": (0.0, 0.0), "radius": length + R, "begin": -pi, "extent": pi, "friction": 1.0}
    until = 8.0 if crowded else "settled"
    machine = arc_machine(bowl, spin=True, run={"until": until, "max_time": 20.0})
    machine = thrown(machine, length * np.array([sin(0.8), -cos(0.8)]))
    machine = of_sizes(machine, R, 0.1, 0.4, rolling=np.array([rolling]))
    recording = run(replace(machine, interact=crowded))
    last = recording.track(0)[-1]
    assert REASONS[recording.ended[0]] == ("time" if crowded else "settled")
    assert last["t"] > 2.0
    assert abs(asin(last["position"][0] / length)) <= np.arctan(rolling) * 1.001
    books = recording.by_surface.sum(axis=0)
    fall = 0.1 * G * length * (last["position"][1] / length + cos(0.8))
    assert books[2] == pytest.approx(-fall, rel=5e-3)
    assert residual(recording) < 1e-12
