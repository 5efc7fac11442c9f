"""The pymunk engine against formulas written here: flight, impacts, belts, piles, the ledger."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from math import acos, cos, hypot, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chutelab.ledger import ledger
from chutelab.machine import build
from chutelab.recording import REASONS, Kind, balance
from chutelab.scene import find, load, parse
from chutelab.stepper import HALF_THICKNESS, run
from machines import two_disks

G, R, M = 9.81, 0.004, 0.008


def simulated(text, *overrides):
    return run(build(parse(text, overrides=overrides)))


def shipped(name, *overrides):
    return run(build(load(find(name), overrides)))


def lone(at, velocity, until, *, surface="", spin=False):
    return simulated(
        f"""
[particle]
spin = {str(spin).lower()}
[stream]
at = [{at[0]}, {at[1]}]
velocity = [{velocity[0]}, {velocity[1]}]
[run]
until = {until}
{surface}
"""
    )


def floor(*, restitution=0.0, friction=0.0, speed=0.0, height=0.0):
    return f"""
[[surface]]
name = "floor"
from = [-20.0, {height}]
to = [20.0, {height}]
restitution = {restitution}
friction = {friction}
speed = {speed}
"""


def pair(velocities, *, offset=0.0, friction=0.0, spin=False, **told):
    """The second is released at 0.05 s where the first one comes to."""
    places = [(0.0, 1.0), (0.1, 1.0 + offset)]
    return two_disks(places, velocities, times=(0.0, 0.05), friction=friction, spin=spin, **told)


def relative_residual(recording):
    return ledger(recording).relative_residual


@settings(max_examples=40)
@given(
    vx=st.floats(-5.0, 5.0),
    vy=st.floats(-5.0, 5.0),
    end=st.floats(0.01, 1.0),
)
def test_free_flight_is_the_parabola(vx, vy, end):
    recording = lone((0.3, 2.0), (vx, vy), end, surface=floor(height=-50.0))
    last = recording.track(0)[-1]
    scale = hypot(0.3, 2.0) + hypot(vx, vy) * end + G * end**2
    x, y = 0.3 + vx * end, 2.0 + vy * end - 0.5 * G * end**2
    assert hypot(last["position"][0] - x, last["position"][1] - y) <= 1e-12 * scale
    assert abs(last["velocity"][1] - (vy - G * end)) <= 1e-12 * scale
    assert len(recording.track(0)) == 2
    assert relative_residual(recording) < 1e-12


@settings(max_examples=60)
@given(
    restitution=st.one_of(st.just(0.0), st.floats(0.05, 1.0)),
    friction=st.floats(0.0, 1.5),
    speed=st.floats(-3.0, 3.0),
    vx=st.floats(-3.0, 3.0),
    spin=st.booleans(),
)
def test_a_bounce_keeps_newtons_and_coulombs_laws(restitution, friction, speed, vx, spin):
    fall = 0.2
    recording = lone(
        (0.0, R + fall),
        (vx, 0.0),
        0.25,
        surface=floor(restitution=restitution, friction=friction, speed=speed),
        spin=spin,
    )
    hit = recording.select(Kind.IMPACT)[0]
    approach = sqrt(2.0 * G * fall)
    slip = vx - speed
    normal = M * (1.0 + restitution) * approach
    stop = (M / 3.0 if spin else M) * slip
    tangential = -np.clip(stop, -friction * normal, friction * normal)
    assert hit["t"] == pytest.approx(approach / G, rel=1e-11)
    assert hit["position"] == pytest.approx([vx * approach / G, R], abs=1e-11)
    assert hit["normal_impulse"] == pytest.approx(normal, rel=1e-10)
    assert hit["tangential_impulse"] == pytest.approx(tangential, abs=1e-10 * normal)
    assert hit["velocity_after"] == pytest.approx(
        [vx + tangential / M, restitution * approach], abs=1e-9
    )
    spun = tangential * R / (0.5 * M * R**2) if spin else 0.0
    assert hit["omega_after"] == pytest.approx(spun, abs=1e-6)


@settings(max_examples=40)
@given(angle=st.floats(-170.0, 170.0), restitution=st.floats(0.1, 1.0), skew=st.floats(-60.0, 60.0))
def test_the_struck_face_lies_on_the_surface_whatever_its_direction(angle, restitution, skew):
    # A surface through the origin, struck from 0.1 m away without gravity.
    t = np.array([cos(radians(angle)), sin(radians(angle))])
    n = np.array([-t[1], t[0]])
    course = -(cos(radians(skew)) * n + sin(radians(skew)) * t)
    start = -0.1 * course
    recording = simulated(
        f"""
gravity = 0.0
[stream]
at = [{start[0]}, {start[1]}]
velocity = [{course[0]}, {course[1]}]
[run]
until = 0.15
[[surface]]
name = "wall"
from = [{-t[0]}, {-t[1]}]
to = [{t[0]}, {t[1]}]
restitution = {restitution}
friction = 0.0
"""
    )
    hit = recording.select(Kind.IMPACT)[0]
    assert hit["position"] @ n == pytest.approx(R, abs=1e-12)
    assert hit["velocity_after"] @ n == pytest.approx(restitution * cos(radians(skew)), abs=1e-11)
    assert hit["velocity_after"] @ t == pytest.approx(course @ t, abs=1e-11)


@settings(max_examples=40)
@given(u=st.floats(0.1, 3.0), v=st.floats(-3.0, 0.0), restitution=st.floats(0.0, 1.0))
def test_equal_disks_head_on(u, v, restitution):
    recording = pair([(u, 0.0), (v, 0.0)], restitution=restitution, until=1.5)
    reach = 0.1 - 2.0 * R - 0.05 * u
    if reach < 1e-3:  # they would meet before the second is there
        return
    (hit,) = recording.select(Kind.COLLISION)
    assert hit["t"] == pytest.approx(0.05 + reach / (u - v), rel=1e-10)
    first, second = (recording.track(i)[-1]["velocity"][0] for i in (0, 1))
    assert first == pytest.approx(0.5 * ((u + v) - restitution * (u - v)), abs=1e-10)
    assert second == pytest.approx(0.5 * ((u + v) + restitution * (u - v)), abs=1e-10)
    books = ledger(recording).by_surface["particles"]
    lost = 0.25 * M * (1.0 - restitution**2) * (u - v) ** 2
    assert books["restitution_loss"] == pytest.approx(lost, abs=1e-12)
    entries = [recording.track(i)[-1]["entries"][1] for i in (0, 1)]
    assert entries[0] == entries[1]
    assert relative_residual(recording) < 1e-12


@settings(max_examples=40)
@given(offset=st.floats(-1.8 * R, 1.8 * R), friction=st.floats(0.0, 2.0), spin=st.booleans())
def test_oblique_disks_keep_momentum_and_turn(offset, friction, spin):
    restitution = 0.7
    recording = pair(
        [(1.0, 0.0), (-1.0, 0.0)],
        restitution=restitution,
        friction=friction,
        spin=spin,
        offset=offset,
    )
    # Line of centres at the touch, from the first to the second.
    c = np.array([sqrt(4.0 * R**2 - offset**2), offset]) / (2.0 * R)
    t = np.array([-c[1], c[0]])
    relative = np.array([2.0, 0.0])
    push = 0.5 * M * (1.0 + restitution) * (relative @ c)
    mass = 0.5 * M / 3.0 if spin else 0.5 * M
    rub = np.clip(mass * (relative @ t), -friction * push, friction * push)
    first = np.array([1.0, 0.0]) - (push * c + rub * t) / M
    second = np.array([-1.0, 0.0]) + (push * c + rub * t) / M
    ends = [recording.track(i)[-1] for i in (0, 1)]
    assert ends[0]["velocity"] == pytest.approx(first, abs=1e-9)
    assert ends[1]["velocity"] == pytest.approx(second, abs=1e-9)
    spun = -rub * R / (0.5 * M * R**2) if spin else 0.0
    assert [end["omega"] for end in ends] == pytest.approx([spun, spun], abs=1e-6)
    assert relative_residual(recording) < 1e-12


@pytest.mark.parametrize(
    ("spin", "speed", "work", "heat"),
    # Section 5 of the model: m v_b (v_b - v_x), and a third of both for a free disk.
    [
        (False, 2.0, M * 2.0 * 2.0, 0.5 * M * 4.0),
        (False, -1.0, M * 1.0 * 1.0, 0.5 * M * 1.0),
        (True, 2.0, M * 2.0 * 2.0 / 3.0, M * 4.0 / 6.0),
    ],
)
def test_a_belt_pays_for_the_speed_it_gives(spin, speed, work, heat):
    recording = lone((0.0, R), (0.0, 0.0), 3.0, surface=floor(friction=0.3, speed=speed), spin=spin)
    books = ledger(recording)
    assert books.belt_work == pytest.approx(work, rel=1e-12)
    assert books.friction_loss == pytest.approx(heat, rel=1e-12)
    assert recording.track(0)[-1]["velocity"][0] == pytest.approx(
        speed / 3.0 if spin else speed, rel=1e-12
    )
    # It lies a hair lower than it touched: 5e-6 of r, and half a step's gravity to get there.
    assert books.relative_residual < 1e-5


def test_a_slide_stops_where_friction_says():
    # v² / (2 µ g); a hair deep.
    recording = lone((0.0, R), (1.0, 0.0), '"settled"', surface=floor(friction=0.2))
    end = recording.track(0)[-1]
    assert end["position"][0] == pytest.approx(1.0 / (2.0 * 0.2 * G), abs=1e-6)
    assert end["position"][1] == pytest.approx(R, abs=1e-5 * R)
    assert REASONS[recording.ended[0]] == "settled"
    assert len(recording.track(0)) < 10


def test_bounces_come_to_rest_in_the_time_of_the_closed_form():
    fall, restitution = 0.1, 0.5
    recording = lone(
        (0.0, R + fall), (0.0, 0.0), '"settled"', surface=floor(restitution=restitution)
    )
    down = sqrt(2.0 * fall / G)
    # Down once, then 2 ε^n times as long for every further bounce; a few steps of rest at the end.
    total = down * (1.0 + 2.0 * restitution / (1.0 - restitution))
    assert recording.track(0)[-1]["t"] == pytest.approx(total, abs=5e-3)
    assert ledger(recording).restitution_loss == pytest.approx(M * G * fall, rel=2e-5)


def test_adhesion_lets_go_at_the_critical_angle():
    recording = shipped("low-speed")
    rho, v = 0.5 + R, 2.0
    phi = acos(v**2 / (G * rho))
    (away,) = recording.select(Kind.SEPARATION)
    assert away["t"] == pytest.approx((1.0 + rho * phi) / v, rel=1e-14)
    assert away["position"] == pytest.approx([rho * sin(phi), rho * cos(phi)], rel=1e-13)
    assert away["velocity_after"] == pytest.approx([v * cos(phi), -v * sin(phi)], rel=1e-13)
    # The belt brakes the fall round the pulley, and the ride between knots stays on the circle.
    books = ledger(recording).by_surface["incoming"]
    assert books["belt_work"] == pytest.approx(-M * G * rho * (1.0 - cos(phi)), rel=1e-12)
    times = np.linspace(0.5, away["t"], 500)
    position, _ = recording.at(times)
    assert np.abs(np.hypot(*position[:, 0].T) / rho - 1.0).max() < 1e-9
    # What follows is a flight from that very point.
    hit = recording.select(Kind.IMPACT)[0]
    fly = (hit["position"][0] - away["position"][0]) / (v * cos(phi))
    assert hit["position"][1] == pytest.approx(
        rho * cos(phi) - v * sin(phi) * fly - 0.5 * G * fly**2, abs=1e-11
    )


def slip_law(friction, *, spin, speed=2.0, radius=0.5, pieces=20000):
    """Angle at which a disk leaves a pulley that grips with Coulomb friction, in degrees.

    With y = v²/(g ρ): held, y stays (not turning) or grows by 4/3 sin φ dφ (rolling), and holding
    takes a friction of m g sin φ, or a third of it; as soon as that is more than the µ m g
    (cos φ - y) there is, it slips, and y grows by 2 (sin φ - µ (cos φ - y)) dφ. It leaves at
    cos φ = y.
    """
    y, held, step = speed**2 / (G * (radius + R)), True, 1.0 / pieces
    share, gain = (1.0 / 3.0, 4.0 / 3.0) if spin else (1.0, 0.0)

    def slope(phi, y):
        return gain * sin(phi) if held else 2.0 * (sin(phi) - friction * (cos(phi) - y))

    phi = 0.0
    while cos(phi) > y:
        held = held and share * sin(phi) <= friction * (cos(phi) - y)
        middle = y + 0.5 * step * slope(phi, y)
        last, y, phi = (phi, y), y + step * slope(phi + 0.5 * step, middle), phi + step
    # The last piece, straight.
    over, under = y - cos(phi), cos(last[0]) - last[1]
    return np.degrees(last[0] + step * under / (under + over))


def angle_of_separation(*overrides):
    recording = shipped("slip", *overrides)
    away = recording.first(recording.select(Kind.SEPARATION))[0]
    return np.degrees(np.arctan2(*away["position"]))


def test_the_slip_law_is_the_one_of_the_design():
    assert slip_law(0.5, spin=False) == pytest.approx(22.913, abs=5e-4)
    # A disk that rolls until it leaves: cos φ = (3 v²/(g ρ) + 4) / 7.
    rolls = np.degrees(acos((3.0 * 4.0 / (G * 0.504) + 4.0) / 7.0))
    assert slip_law(1e9, spin=True) == pytest.approx(rolls, abs=5e-4)


@pytest.mark.parametrize(
    ("spin", "friction"),
    [
        (False, 0.5),
        (True, 0.5),
        (True, 1e6),
    ],
)
def test_friction_lets_go_where_the_slip_law_says(spin, friction):
    found = angle_of_separation(
        f"incoming.friction={friction}", f"particle.spin={str(spin).lower()}"
    )
    assert found == pytest.approx(slip_law(friction, spin=spin), abs=0.05)


@pytest.mark.parametrize(("spin", "friction"), [(False, 0.5), (True, 0.5), (True, 1e6)])
@pytest.mark.parametrize("dt", [1 / 60, 0.99e-3, 1.003e-3, 5e-4, 2e-4])
def test_the_slip_law_holds_wherever_the_steps_fall(spin, friction, dt):
    found = angle_of_separation(
        f"incoming.friction={friction}", f"particle.spin={str(spin).lower()}", f"run.dt={dt}"
    )
    assert found == pytest.approx(slip_law(friction, spin=spin), abs=0.05)


@pytest.mark.parametrize("dt", [1e-3, 1e-4])
def test_a_transfer_lands_where_the_parabolas_meet(dt):
    recording = shipped("perpendicular", f"run.dt={dt}")
    d, v = 0.6 - R, 2.0
    t = d / v
    (hit,), (land,) = (recording.select(k) for k in (Kind.IMPACT, Kind.LANDING))
    assert hit["position"] == pytest.approx([d, 0.1 + R - 0.5 * G * t**2], abs=1e-11)
    u = G * t
    fall = (-u + sqrt(u**2 + 2.0 * G * 0.5)) / G
    assert land["t"] == pytest.approx(0.5 + t + fall, abs=1e-11)
    assert land["position"][0] == pytest.approx(d - 0.5 * v * fall, abs=1e-11)
    assert REASONS[recording.ended[0]] == "landed"
    assert recording.contacts == 2


BOOKS = {
    "perpendicular": 1e-15,
    "belt-landing": 1e-6,
    "slip": 1e-6,
    "free-fall": 1e-6,
    "stream": 2e-5,
}


@pytest.mark.parametrize("name", BOOKS)
def test_the_ledger_closes(name):
    few = ["stream.count=80"] if name == "stream" else []
    assert relative_residual(shipped(name, *few)) < BOOKS[name]


def test_a_wrong_end_velocity_moves_the_residual():
    recording = shipped("perpendicular")
    knots = recording.knots.copy()
    knots["velocity"][-1, 0] += 1e-3
    v = recording.knots["velocity"][-1, 0]
    moved = ledger(replace(recording, knots=knots)).residual - ledger(recording).residual
    assert moved == pytest.approx(0.5 * M * (2e-3 * v + 1e-6), rel=1e-9)


def test_a_stream_meets_itself_and_settles():
    recording = shipped("stream", "stream.count=80")
    assert len(recording.select(Kind.COLLISION)) >= 100
    assert recording.contacts >= len(recording.select(Kind.COLLISION))
    assert {REASONS[i] for i in recording.ended} <= {"settled", "exit"}
    assert np.count_nonzero(recording.ended == REASONS.index("settled")) > 60
    books = ledger(recording).by_surface["particles"]
    assert books["restitution_loss"] > 0.0
    assert books["friction_loss"] > 0.0
    assert np.all(np.diff(recording.events["t"]) >= 0.0)
    for particle in range(recording.count):
        assert np.all(np.diff(recording.track(particle)["t"]) >= 0.0)


@pytest.mark.parametrize("name", ["stream", "belt-landing"])
def test_two_runs_agree_to_the_bit(name):
    few = ["stream.count=20"] if name == "stream" else []
    a, b = shipped(name, *few), shipped(name, *few)
    assert a.knots.tobytes() == b.knots.tobytes()
    assert a.events.tobytes() == b.events.tobytes()
    assert a.by_surface.tobytes() == b.by_surface.tobytes()
    assert (a.steps, a.contacts) == (b.steps, b.contacts)


def test_a_carried_particle_pushes_and_is_not_pushed():
    # Dropped in the way of a carried one, which keeps its ride.
    machine = build(load(find("stream"), ["stream.count=2", "stream.rate=1.0", "run.max_time=1.0"]))
    start = machine.releases
    releases = replace(
        start,
        t=np.array([0.0, 0.01]),
        position=np.array([[-1.0, 0.104], [-0.9, 0.115]]),
        velocity=np.array([[2.0, 0.0], [0.0, 0.0]]),
        carried=np.array([True, False]),
    )
    recording = run(replace(machine, releases=releases))
    away = recording.first(recording.select(Kind.SEPARATION, surface="incoming"))[0]
    assert away["t"] == pytest.approx(0.5, rel=1e-14)
    assert away["velocity_after"] == pytest.approx([2.0, 0.0])
    assert len(recording.select(Kind.COLLISION)) >= 1
    assert relative_residual(recording) < 1e-4


def test_a_ride_ends_where_something_is_in_its_way():
    recording = simulated(
        """
[incoming]
speed = 1.0
pulley_radius = 0.1
[[surface]]
name = "scraper"
from = [-0.5, 0.2]
to = [-0.5, 0.1]
restitution = 0.5
[run]
until = 0.6
"""
    )
    hit = recording.select(Kind.IMPACT, surface="scraper")[0]
    assert hit["t"] == pytest.approx(0.5 - R, abs=1e-12)
    assert hit["velocity_after"][0] == pytest.approx(-0.5, abs=1e-9)


def test_what_misses_everything_leaves_a_metre_below():
    recording = lone((30.0, 1.0), (0.0, 0.0), '"settled"', surface=floor())
    (gone,) = recording.select(Kind.EXIT)
    assert gone["position"][1] == pytest.approx(-1.0, abs=1e-12)
    assert gone["t"] == pytest.approx(sqrt(2.0 * 2.0 / G), rel=1e-12)
    assert REASONS[recording.ended[0]] == "exit"


def test_independent_particles_pass_through_each_other():
    together = shipped("stream", "stream.interact=false", "stream.count=3", "run.until=0.9")
    assert not len(together.select(Kind.COLLISION))
    alone = shipped("perpendicular", "run.until=0.9")
    assert together.track(0).tobytes() == alone.track(0).tobytes()


def test_a_pile_in_a_box_stays_in_it_and_gains_nothing():
    recording = simulated(
        """
[stream]
count = 30
rate = 100.0
at = [0.0, 0.05]
velocity = [0.3, 0.0]
bed_height = 0.1
interact = true
[run]
until = 2.0
[[surface]]
name = "box"
points = [[-0.05, 0.2], [-0.05, 0.0], [0.05, 0.0], [0.05, 0.2]]
friction = 0.5
restitution = 0.3
"""
    )
    last = np.array([recording.track(i)[-1]["position"] for i in range(30)])
    assert np.all(np.abs(last[:, 0]) < 0.05 - 0.9 * R)
    assert np.all(last[:, 1] > 0.9 * R)
    gaps = np.linalg.norm(last[:, None] - last, axis=2)[np.triu_indices(30, 1)]
    assert gaps.min() > 1.9 * R
    assert relative_residual(recording) < 5e-3


def test_progress_rises_to_one_and_is_rare():
    machine = build(load(find("belt-landing")))
    shares = []
    recording = run(machine, shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert len(shares) <= 2 + recording.seconds / 0.05


def test_a_mass_point_is_refused():
    machine = build(load(find("perpendicular"), ["particle.radius=0.0"]))
    with pytest.raises(ValueError, match=r"particle\.radius"):
        run(machine)


def test_with_fixed_steps_a_surface_is_thick_enough_for_the_promised_speed():
    # v dt just below r + half the thickness: met, not passed, wherever the step falls.
    v = 0.95 * (R + HALF_THICKNESS) / 1e-3
    for shift in np.linspace(0.0, v * 1e-3, 7):
        recording = lone(
            (0.0, 0.2 + shift), (0.0, -v), "0.1\nalign = false", surface=floor(restitution=1.0)
        )
        assert len(recording.select(Kind.IMPACT)) == 1


@pytest.mark.parametrize("dt", [1 / 60, 1e-3])
@pytest.mark.parametrize("speed", [20.0, 200.0, 2000.0])
@pytest.mark.parametrize("lean", [0.0, 40.0, -70.0])
def test_nothing_is_too_fast_to_be_stopped(dt, speed, lean):
    # r = 2 mm against a plate 1 m away, whose normal leans by an angle; without gravity.
    r, a = 0.002, radians(lean)
    recording = simulated(
        f"""
gravity = 0.0
[particle]
radius = {r}
[stream]
at = [-1.0, 0.0]
velocity = [{speed}, 0.0]
[run]
until = {1.5 / speed}
dt = {dt}
[[surface]]
name = "wall"
from = [{-sin(a)}, {-cos(a)}]
to = [{sin(a)}, {cos(a)}]
restitution = 0.5
friction = 0.0
"""
    )
    (hit,) = recording.select(Kind.IMPACT)
    way = 1.0 - r / cos(a)
    assert hit["t"] == pytest.approx(way / speed, rel=1e-13)
    assert hit["position"] == pytest.approx([-r / cos(a), 0.0], abs=1e-13)
    # (1 + ε) of the normal velocity is given back along the normal (-cos a, sin a).
    given_back = 1.5 * speed * cos(a)
    after = np.array([speed - given_back * cos(a), given_back * sin(a)])
    assert hit["velocity_after"] == pytest.approx(after, abs=1e-11 * speed)
    end = recording.track(0)[-1]
    assert end["position"] == pytest.approx(
        hit["position"] + after * (1.5 - way) / speed, abs=1e-11
    )


def test_with_fixed_steps_what_is_fast_enough_passes():
    # Three times as far in a step as disk and surface are thick: it is seen by luck.
    way, seen = 3.0 * (R + HALF_THICKNESS), Counter()
    for align in ("true", "false"):
        for shift in np.linspace(0.0, way, 9, endpoint=False):
            recording = simulated(
                f"""
[stream]
at = [0.0, {0.2 + shift}]
velocity = [0.0, {-way / 1e-3}]
[run]
until = 0.1
dt = 1e-3
align = {align}
"""
                + floor(restitution=1.0, friction=0.1)
            )
            seen[align] += len(recording.select(Kind.IMPACT)) > 0
    assert seen["true"] == 9
    assert 0 < seen["false"] < 9


@pytest.mark.parametrize("name", ["perpendicular", "inclined-40"])
def test_with_fixed_steps_an_impact_is_seen_up_to_a_step_late(name):
    shares = []
    for dt in (1.1e-3, 1e-3, 7e-4, 5e-4, 3e-4):
        precise, late = (
            shipped(name, f"run.dt={dt}", f"run.align={align}").select(Kind.IMPACT)[0]
            for align in ("true", "false")
        )
        shares.append((late["t"] - precise["t"]) / dt)
        off = late["position"] - precise["position"]
        assert hypot(*off) <= 1.01 * dt * hypot(*precise["velocity_before"])
        assert hypot(*(late["velocity_before"] - precise["velocity_before"])) <= 1.01 * G * dt
    assert min(shares) >= -1e-6
    assert max(shares) <= 1.0 + 1e-6
    assert max(shares) > 0.1


@pytest.mark.parametrize("name", ["inclined-20", "inclined-40"])
def test_with_fixed_steps_the_books_close_to_first_order(name):
    residuals = [
        relative_residual(shipped(name, f"run.dt={dt}", "run.align=false"))
        for dt in (2e-3, 1e-3, 5e-4)
    ]
    orders = np.log2(np.divide(residuals[:-1], residuals[1:]))
    assert orders == pytest.approx([1.0, 1.0], abs=0.1)


def test_alignment_closes_the_books_of_a_stream():
    few = ("stream.count=40",)
    aligned, plain = (shipped("stream", *few, f"run.align={a}") for a in ("true", "false"))
    assert relative_residual(aligned) < 1e-5
    assert relative_residual(plain) > 50.0 * relative_residual(aligned)


def test_collisions_keep_momentum():
    recording = shipped("stream", "stream.count=40")
    counted = 0
    for hit in recording.select(Kind.COLLISION):
        tracks = [recording.track(hit[who]) for who in ("particle", "other")]
        knots = [track[track["t"] == hit["t"]] for track in tracks]
        if [len(of_one) for of_one in knots] != [2, 2]:
            continue  # more happened at that instant
        before, after = knots[0]["velocity"] + knots[1]["velocity"]
        assert after == pytest.approx(before, abs=1e-14)
        counted += 1
    assert counted >= 30


def test_energy_never_rises_where_nothing_is_driven():
    recording = shipped("free-fall")
    # In contact half a step of gravity is given back at once, the other half is lost until then.
    hop = 0.5 * M * (0.5 * G * 1e-3) ** 2
    for particle in range(recording.count):
        track = recording.track(particle)
        energy = np.sum(recording.energies(track), axis=0)
        assert np.diff(energy).max() <= 1.02 * hop
        assert energy[-1] < 0.1 * energy[0]


def test_energy_never_rises_in_a_box():
    recording = simulated(
        """
[stream]
count = 6
rate = 50.0
at = [0.0, 0.08]
velocity = [0.3, 0.0]
bed_height = 0.03
interact = true
restitution = 0.9
[run]
until = 0.5
[[surface]]
name = "box"
points = [[-0.05, 0.2], [-0.05, 0.0], [0.05, 0.0], [0.05, 0.2]]
friction = 0.3
restitution = 0.9
"""
    )
    # Everybody's energy just before and just after each instant at which something happened, from
    # the last release on: the energy of each track is constant between its knots.
    times, changes = [], []
    for particle in range(recording.count):
        track = recording.track(particle)
        energy = np.sum(recording.energies(track), axis=0)
        times.append(track["t"][1:])
        changes.append(np.diff(energy))
    order = np.argsort(np.concatenate(times), kind="stable")
    when, change = np.concatenate(times)[order], np.concatenate(changes)[order]
    instants, index = np.unique(np.round(when, 12), return_inverse=True)
    sums = np.bincount(index, weights=change)
    assert len(instants) > 20
    assert sums.max() < 1e-6 * M * G * 0.08
    assert sums.sum() < -0.5 * M * G * 0.08


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("spin", [True, False])
@pytest.mark.parametrize("dt", [1e-3, 1e-4])
def test_a_disk_that_belts_wedge_rests_where_it_touches_both(dt, spin, restitution):
    # Belts at 40° to each other draw it in, and tan 20° < µ: friction holds it against any push.
    wedge = f"""
[particle]
radius = 0.05
spin = {str(spin).lower()}
[stream]
at = [0.0, 1.2]
velocity = [0.0, 0.0]
[run]
until = 3.0
dt = {dt}
[[surface]]
name = "left"
from = [-0.37, 1.0]
to = [-0.01, 0.0]
friction = 0.6
restitution = {restitution}
speed = 0.7
[[surface]]
name = "right"
from = [0.37, 1.0]
to = [0.01, 0.0]
friction = 0.6
restitution = {restitution}
speed = 0.7
"""
    recording = simulated(wedge)
    last = recording.track(0)[-1]
    # From the lower end (-0.01, 0) of a face along (0.36, -1), its normal (1, 0.36): r away.
    height = (0.05 * hypot(1.0, 0.36) - 0.01) / 0.36
    assert last["t"] == 3.0
    assert last["position"] == pytest.approx([0.0, height], abs=1e-3 * 0.05)
    assert not last["velocity"].any()
    assert last["omega"] == 0.0
    assert relative_residual(recording) < 1e-6


@pytest.mark.parametrize("speed", [0.1, 0.5, 2.0])
@pytest.mark.parametrize("degrees", [0.5, 2.0, 8.0])
def test_a_narrow_wedge_of_slow_belts_is_no_way_through(speed, degrees):
    # Both faces touch a disk at the origin, and go on below it.
    r, c, s = 0.02, cos(radians(degrees)), sin(radians(degrees))
    walls = "".join(
        f"""
[[surface]]
name = "{name}"
from = [{side * (r * c + s)}, {-r * s + c}]
to = [{side * (r * c - 0.1 * s)}, {-r * s - 0.1 * c}]
friction = 0.6
speed = {speed}
"""
        for name, side in (("left", -1.0), ("right", 1.0))
    )
    recording = simulated(
        f"[particle]\nradius = {r}\n[stream]\nat = [0.0, 0.1]\nvelocity = [0.0, 0.0]\n"
        f"[run]\nuntil = 1.0\n{walls}"
    )
    last = recording.track(0)[-1]
    assert not last["velocity"].any()
    # Half a percent of the radius in each face at most.
    assert -last["position"][1] * s < 0.005 * r
    assert last["position"][1] < 1e-3 * r


def test_what_belts_wedge_does_not_settle():
    belts = "".join(
        f"""
[[surface]]
name = "{name}"
from = [{side * 0.37}, 1.0]
to = [{side * 0.01}, 0.0]
friction = 0.6
speed = 0.7
"""
        for name, side in (("left", -1.0), ("right", 1.0))
    )
    recording = simulated(
        "[particle]\nradius = 0.05\n[stream]\nat = [0.0, 1.2]\nvelocity = [0.0, 0.0]\n"
        f'[run]\nuntil = "settled"\nmax_time = 2.0\n{belts}'
    )
    assert not recording.track(0)[-1]["velocity"].any()
    assert REASONS[recording.ended[0]] == "time"
    assert not len(recording.select(Kind.SETTLE))


def test_no_belt_wedges_a_disk_that_it_rolls_out_of_a_corner():
    # The belt under it runs away from the wall: it rests there only as long as it does not grip.
    corner = """
[particle]
radius = 0.05
[stream]
at = [0.06, 0.3]
velocity = [-0.5, 0.0]
[run]
until = 1.0
[[surface]]
name = "wall"
from = [0.0, 1.0]
to = [0.0, -0.1]
[[surface]]
name = "belt"
from = [-0.1, 0.0]
to = [3.0, 0.0]
friction = 0.6
speed = 0.7
"""
    last = simulated(corner).track(0)[-1]
    assert last["velocity"] == pytest.approx([0.7, 0.0], abs=1e-6)
    assert last["position"][1] == pytest.approx(0.05, abs=1e-3 * 0.05)


def test_what_a_carried_partner_gives_is_booked_when_it_is_given():
    machine = build(load(find("stream"), ["stream.count=2", "stream.rate=1.0", "run.max_time=0.3"]))
    releases = replace(
        machine.releases,
        t=np.array([0.0, 0.01]),
        position=np.array([[-1.0, 0.104], [-0.78, 0.16]]),
        velocity=np.array([[2.0, 0.0], [0.0, 0.0]]),
        carried=np.array([True, False]),
    )
    recording = run(replace(machine, releases=releases))
    assert len(recording.select(Kind.COLLISION)) >= 1
    track, p = recording.track(1), recording.particle
    kinetic = p.kinetic(track["velocity"][:, 0], track["velocity"][:, 1], track["omega"])
    energy = kinetic + p.mass * recording.gravity * track["position"][:, 1]
    unbooked = energy - energy[0] - balance(track["entries"])
    # m (g dt)²/8 is what a hop has; the blow, m v²/2, is ten thousand times as much.
    assert np.abs(unbooked).max() < 2.0 * p.mass * (recording.gravity * 1e-3) ** 2 / 8.0
    assert np.ptp(track["entries"][:, 0]) > 1e-3


@pytest.mark.parametrize("spin", [False, True])
def test_books_of_surfaces_and_particles_agree_however_a_slide_is_cut(spin):
    # At the end of the slip, µ g t = v, and around it, where a sleeper is woken for its last step.
    mu, v = 0.3, 1.0
    end = v / (mu * G) / (3.0 if spin else 1.0)
    for until in np.linspace(end - 3e-3, end + 3e-3, 25):
        belt = floor(friction=mu, speed=v)
        recording = lone((0.0, R), (0.0, 0.0), until, surface=belt, spin=spin)
        entries = recording.track(0)[-1]["entries"]
        assert recording.by_surface.sum(axis=0) == pytest.approx(entries, abs=1e-15)
        # Steps: the last one may end within the slip.
        paid = mu * M * G * v * min(until, end)
        assert entries[0] == pytest.approx(paid, abs=0.5 * mu * M * G * v * 1e-3)
