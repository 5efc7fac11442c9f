"""The event-driven engine against formulas and differential equations written here."""

from __future__ import annotations

from dataclasses import replace
from math import acos, atan, cos, degrees, hypot, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from chutelab import exact, machine, scene
from chutelab.ledger import ledger
from chutelab.recording import Kind
from chutelab.releases import Releases

G = 9.81
FLOOR = {"name": "floor", "from": [-50.0, 0.0], "to": [50.0, 0.0]}


def run(document):
    return exact.run(machine.build(scene.from_dict(document)))


def thrown(at, velocity, *surfaces, until=3.0, radius=0.0, spin=False, max_time=600.0):
    return run(
        {
            "particle": {"radius": radius, "spin": spin, "mass": 0.1},
            "surface": list(surfaces),
            "stream": {"at": at, "velocity": velocity},
            "run": {"until": until, "max_time": max_time},
        }
    )


def conveyor(*, speed, friction, radius=0.004, pulley_radius=0.5, spin=False, **incoming):
    return run(
        {
            "particle": {"radius": radius, "spin": spin},
            "incoming": {
                "speed": speed,
                "pulley_radius": pulley_radius,
                "friction": friction,
                **incoming,
            },
            "run": {"until": 3.0},
        }
    )


def separation_of(recording):
    event = recording.select(Kind.SEPARATION, surface="incoming")[0]
    return degrees(np.arctan2(*event["position"])), hypot(*event["velocity_after"]), event


# Bouncing


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8, 0.99])
def test_bounces_end_after_the_sum_of_the_series(restitution):
    height = 0.7
    floor = {**FLOOR, "restitution": restitution, "friction": 0.0}
    recording = thrown([0.0, height], [0.0, 0.0], floor, until="settled")
    fall = sqrt(2.0 * height / G)
    series = 2.0 * restitution * G * fall / (G * (1.0 - restitution))
    assert recording.ended[0] == 2
    assert recording.select(Kind.SETTLE)["t"][0] == pytest.approx(fall + series, rel=1e-9)
    assert ledger(recording).restitution_loss == pytest.approx(0.1 * G * height, rel=1e-12)


def test_without_loss_it_bounces_as_high_for_ever():
    floor = {**FLOOR, "restitution": 1.0, "friction": 0.0}
    recording = thrown([0.0, 0.5], [0.3, 0.0], floor, until=60.0)
    fall = sqrt(2.0 * 0.5 / G)
    hits = recording.select(Kind.IMPACT)
    assert len(hits) == int((60.0 / fall + 1.0) / 2.0)
    np.testing.assert_allclose(hits["t"], (2 * np.arange(len(hits)) + 1) * fall, rtol=1e-13)
    np.testing.assert_allclose(hits["velocity_after"][:, 1], G * fall, rtol=1e-12)


@pytest.mark.slow
def test_a_thousandth_lost_at_each_bounce_does_not_hang():
    floor = {**FLOOR, "restitution": 0.999, "friction": 0.0}
    recording = thrown([0.0, 0.01], [0.0, 0.0], floor, until="settled")
    fall = sqrt(2.0 * 0.01 / G)
    total = fall + 2.0 * 0.999 * fall / 0.001
    assert recording.select(Kind.SETTLE)["t"][0] == pytest.approx(total, rel=1e-9)
    assert recording.contacts > 10_000


# Sliding and rolling


def test_friction_stops_a_slide_after_its_stopping_distance():
    floor = {**FLOOR, "friction": 0.3, "restitution": 0.0}
    recording = thrown([0.0, 0.02], [2.0, 0.0], floor, until="settled", radius=0.02)
    end = recording.track(0)[-1]
    assert end["position"][0] == pytest.approx(2.0**2 / (2.0 * 0.3 * G), rel=1e-14)
    assert end["t"] == pytest.approx(2.0 / (0.3 * G), rel=1e-14)
    assert ledger(recording).friction_loss == pytest.approx(0.5 * 0.1 * 2.0**2, rel=1e-14)


def test_a_disk_put_on_a_belt_ends_at_a_third_of_its_speed():
    belt = {**FLOOR, "friction": 0.3, "restitution": 0.0, "speed": 3.0}
    recording = thrown([0.0, 0.01], [0.0, 0.0], belt, radius=0.01, spin=True)
    grip = recording.select(Kind.STICK)[0]
    assert grip["velocity_after"][0] == pytest.approx(3.0 / 3.0, rel=1e-14)
    assert grip["omega_after"] == pytest.approx(2.0 / 0.01, rel=1e-14)
    # slip fades at 3 µ g
    assert grip["t"] == pytest.approx(3.0 / (3.0 * 0.3 * G), rel=1e-14)
    books = ledger(recording)
    assert books.belt_work == pytest.approx(0.1 * 3.0 * 1.0, rel=1e-14)
    assert books.friction_loss == pytest.approx(0.1 / 6.0 * 3.0**2, rel=1e-14)


@pytest.mark.parametrize(
    ("spin", "friction", "pull"),
    [
        (False, 0.2, sin(0.6) - 0.2 * cos(0.6)),
        (False, 0.0, sin(0.6)),
        (False, 0.7, 0.0),
        (True, 0.7, 2.0 / 3.0 * sin(0.6)),
        (True, 0.1, sin(0.6) - 0.1 * cos(0.6)),
    ],
)
def test_down_a_slope_of_angle_06(spin, friction, pull):
    top, down = np.array([0.0, 2.0]), np.array([cos(0.6), -sin(0.6)])
    normal = np.array([sin(0.6), cos(0.6)])
    slope = {
        "name": "slope",
        "from": top.tolist(),
        "to": (top + 4.0 * down).tolist(),
        "friction": friction,
        "restitution": 0.0,
    }
    start = top + 0.5 * down + 0.01 * normal
    recording = thrown(start.tolist(), [0.0, 0.0], slope, until=0.8, radius=0.01, spin=spin)
    moved = recording.at([0.8])[0][0, 0] - start
    np.testing.assert_allclose(moved, 0.5 * pull * G * 0.8**2 * down, atol=1e-13)


def test_from_belt_to_wall_it_stays_in_the_corner_and_the_belt_pays_for_heat():
    belt = {"name": "belt", "from": [-1, 0], "to": [2, 0], "friction": 0.3, "speed": 2.0}
    wall = {"name": "wall", "from": [1, -0.5], "to": [1, 1], "restitution": 0.3, "friction": 0.0}
    recording = thrown([0.0, 0.02], [2.0, 0.0], belt, wall, until=10.0, radius=0.02)
    np.testing.assert_allclose(recording.track(0)[-1]["position"], [0.98, 0.02], atol=1e-12)
    resting = recording.energy_at([8.0, 9.0])["belt_work"]
    assert np.diff(resting) == pytest.approx(0.3 * 0.1 * G * 2.0, rel=1e-12)
    assert ledger(recording).relative_residual < 1e-12


def test_in_a_vee_it_comes_to_rest_touching_both_sides():
    vee = {"name": "vee", "points": [[-1, 1], [0, 0], [1, 1]], "restitution": 0.4, "friction": 0.1}
    recording = thrown([-0.4, 1.0], [0.1, 0.0], vee, until="settled", radius=0.02)
    assert recording.ended[0] == 2
    np.testing.assert_allclose(
        recording.track(0)[-1]["position"], [0.0, 0.02 * sqrt(2.0)], atol=1e-9
    )


# Ends, joints, grazing


@given(st.floats(-0.045, 0.045), st.floats(0.0, 1.0))
def test_a_disk_clips_the_end_of_a_surface(offset, restitution):
    r, drop = 0.05, 1.0
    post = {"name": "post", "from": [0, 0], "to": [0, -1], "restitution": restitution}
    recording = thrown([offset, drop], [0.0, 0.0], {**post, "friction": 0.0}, until=0.6, radius=r)
    hit = recording.select(Kind.IMPACT)[0]
    # contact where the centre is r from the end, which is the origin
    y = sqrt(r**2 - offset**2)
    normal = np.array([offset, y]) / r
    before = np.array([0.0, -sqrt(2.0 * G * (drop - y))])
    np.testing.assert_allclose(hit["position"], [offset, y], atol=1e-14)
    np.testing.assert_allclose(
        hit["velocity_after"],
        before - (1.0 + restitution) * (before @ normal) * normal,
        atol=1e-12,
    )


def test_off_the_edge_of_a_table_slower_than_it_would_fly():
    # Frictionless, round the edge: N = 0 where cos φ = (2 + v²/(g r)) / 3.
    r, v = 0.05, 0.1
    table = {"name": "table", "from": [-1, 0], "to": [0, 0], "friction": 0.0, "restitution": 0.0}
    recording = thrown([-0.5, r], [v, 0.0], table, until=8.0, radius=r)
    parting = recording.select(Kind.SEPARATION)[0]
    cosine = (2.0 + v**2 / (G * r)) / 3.0
    assert parting["position"][1] == pytest.approx(r * cosine, rel=1e-13)
    assert hypot(*parting["velocity_after"]) == pytest.approx(sqrt(G * r * cosine), rel=1e-13)
    turn = solve_ivp(
        lambda _, y: [y[1], G / r * sin(y[0])],
        [0.0, 2.0],
        [0.0, v / r],
        events=stop(lambda _, y: cos(y[0]) - cosine),
        rtol=1e-12,
        atol=1e-14,
    )
    assert parting["t"] == pytest.approx(0.5 / v + turn.t[-1], rel=1e-10)


@pytest.mark.parametrize("nudge", [1e-3, 1e-7, 1e-12])
def test_from_the_very_top_of_a_post_it_falls_as_slowly_as_it_must(nudge):
    # On the post's end, off the top by almost nothing: φ'' = g/r sin φ.
    r = 0.03
    post = {"name": "post", "from": [0, 0], "to": [0, -1], "restitution": 0.0, "friction": 0.0}
    recording = thrown([r * sin(nudge), r * cos(nudge)], [0.0, 0.0], post, until=5.0, radius=r)
    parting = recording.select(Kind.SEPARATION)[0]
    lift = acos(2.0 / 3.0 * cos(nudge))
    assert np.arctan2(*parting["position"]) == pytest.approx(lift, abs=1e-12)
    fall = solve_ivp(
        lambda _, y: [y[1], G / r * sin(y[0])],
        [0.0, 5.0],
        [nudge, 0.0],
        events=stop(lambda _, y: y[0] - lift),
        method="DOP853",
        rtol=1e-13,
        atol=1e-20,
    )
    assert parting["t"] == pytest.approx(fall.t[-1], rel=1e-9 if nudge > 1e-10 else 1e-3)
    assert ledger(recording).relative_residual < 1e-13


def stop(function):
    function.terminal = True
    return function


def test_over_a_flat_joint_nothing_happens():
    flat = {"name": "flat", "points": [[-1, 0], [0, 0], [3, 0]], "friction": 0.1}
    for radius in (0.0, 0.03):
        recording = thrown([-0.5, radius], [2.0, 0.0], flat, until="settled", radius=radius)
        moved = recording.track(0)[-1]["position"][0] + 0.5
        assert moved == pytest.approx(4.0 / (0.2 * G), rel=1e-14)
        assert recording.contacts == 0


def test_beyond_the_matching_angle_the_plate_is_passed():
    # A point off the top meets a plate through (R + d, R) only if tan α <= v²/(2 g d1).
    v, radius, distance = 2.0, 0.1, 0.2
    limit = degrees(atan(v**2 / (2.0 * G * (radius + distance))))
    for angle, meets in ((limit - 1e-6, True), (limit + 1e-6, False)):
        recording = run(
            {
                "particle": {"radius": 0.0},
                "incoming": {"speed": v, "pulley_radius": radius},
                "plate": {"distance": distance, "angle_deg": angle, "above": 1.0, "below": 1.0},
                "run": {"until": 1.0},
            }
        )
        assert bool(len(recording.select(Kind.IMPACT))) is meets


# Round the pulley


def test_adhesion_lets_go_at_the_critical_angle_and_the_belt_takes_the_fall():
    recording = conveyor(speed=2.0, friction="adhesion")
    angle, speed, event = separation_of(recording)
    ride = 0.504
    assert angle == pytest.approx(degrees(acos(2.0**2 / (G * ride))), abs=1e-12)
    assert speed == pytest.approx(2.0, rel=1e-15)
    assert event["t"] == pytest.approx(1.0 / 2.0 + radians(angle) * ride / 2.0, rel=1e-14)
    fall = ride * (1.0 - cos(radians(angle)))
    assert ledger(recording).belt_work == pytest.approx(-0.008 * G * fall, rel=1e-13)


@pytest.mark.parametrize("friction", [0.2, 0.5, 3.0, "adhesion"])
def test_a_grip_ends_when_the_equation_of_motion_says(friction):
    # Carried at v: φ' = v/ρ. It ends when g sin φ takes more friction than µ N, or N is used up.
    v, ride = 2.0, 0.504

    def load(f):
        return G * cos(f) - v**2 / ride

    if friction == "adhesion":
        end, kind = (lambda _, y: load(y[0])), Kind.SEPARATION
    else:
        end, kind = (lambda _, y: friction * load(y[0]) - G * sin(y[0])), Kind.SLIP
    turn = solve_ivp(
        lambda _, y: [v / ride], [0.0, 2.0], [0.0], events=stop(end), rtol=1e-12, atol=1e-14
    )
    event = conveyor(speed=v, friction=friction).select(kind)[0]
    assert np.arctan2(*event["position"]) == pytest.approx(turn.y[0, -1], abs=1e-12)
    assert event["t"] - 1.0 / v == pytest.approx(turn.t[-1], abs=1e-12)


@pytest.mark.parametrize("friction", [0.2, 0.5, 1.0, 3.0])
def test_a_gripped_particle_slips_before_it_leaves(friction):
    v, ride = 2.0, 0.504
    kappa = v**2 / (G * ride)
    onset = brentq(lambda f: sin(f) - friction * (cos(f) - kappa), 0.0, acos(kappa), xtol=1e-15)
    slide = solve_ivp(
        lambda _, y: [
            y[1] / ride,
            G * sin(y[0]) - friction * (G * cos(y[0]) - y[1] ** 2 / ride),
        ],
        [0.0, 2.0],
        [onset, v],
        events=stop(lambda _, y: G * cos(y[0]) - y[1] ** 2 / ride),
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
    )
    recording = conveyor(speed=v, friction=friction)
    began = recording.select(Kind.SLIP)[0]
    assert np.arctan2(*began["position"]) == pytest.approx(onset, abs=1e-12)
    angle, speed, event = separation_of(recording)
    assert radians(angle) == pytest.approx(slide.y[0, -1], abs=1e-9)
    assert speed == pytest.approx(slide.y[1, -1], rel=1e-9)
    assert event["t"] == pytest.approx(0.5 + onset * ride / v + slide.t[-1], rel=1e-9)
    assert ledger(recording).relative_residual < 1e-14


def test_the_figures_of_the_slip_law():
    angle, speed, _ = separation_of(conveyor(speed=2.0, friction=0.5))
    assert angle == pytest.approx(22.913, abs=5e-4)
    assert speed == pytest.approx(2.1340, abs=5e-5)


@pytest.mark.parametrize("friction", [0.15, 0.5, 2.0])
def test_a_free_disk_rolls_then_slips_then_leaves(friction):
    v, ride = 2.0, 0.504
    u0 = v**2 / (G * ride)

    def rolled(f):
        return u0 + 4.0 / 3.0 * (1.0 - cos(f))

    end = acos((3.0 * u0 + 4.0) / 7.0)
    onset = brentq(lambda f: sin(f) - 3.0 * friction * (cos(f) - rolled(f)), 0.0, end, xtol=1e-15)
    w = sqrt(G * ride * rolled(onset))

    def slipping(_, y):
        load = G * cos(y[0]) - y[1] ** 2 / ride
        return [y[1] / ride, G * sin(y[0]) - friction * load, -2.0 * friction * load]

    slide = solve_ivp(
        slipping,
        [0.0, 2.0],
        [onset, w, v - w],
        events=stop(lambda _, y: G * cos(y[0]) - y[1] ** 2 / ride),
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
    )
    recording = conveyor(speed=v, friction=friction, spin=True)
    angle, speed, event = separation_of(recording)
    assert radians(angle) == pytest.approx(slide.y[0, -1], abs=1e-9)
    assert speed == pytest.approx(slide.y[1, -1], rel=1e-9)
    assert event["omega_after"] * 0.004 == pytest.approx(slide.y[2, -1], abs=1e-9)
    assert ledger(recording).relative_residual < 1e-13


def test_a_disk_that_cannot_slip_leaves_where_rolling_says():
    u0 = 2.0**2 / (G * 0.504)
    angle, _, _ = separation_of(conveyor(speed=2.0, friction=1e6, spin=True))
    assert angle == pytest.approx(degrees(acos((3.0 * u0 + 4.0) / 7.0)), abs=1e-4)


def test_knots_on_the_pulley_are_close_enough_for_the_curve_between_them():
    recording = conveyor(speed=2.0, friction="adhesion")
    _, _, event = separation_of(recording)
    times = np.linspace(0.5, float(event["t"]), 5000)
    position, _ = recording.at(times)
    assert np.abs(np.hypot(*position[:, 0].T) - 0.504).max() < 1e-9 * 0.504


# Streams


def test_each_layer_of_the_bed_leaves_at_its_own_angle():
    document = {
        "particle": {"radius": 0.004},
        "incoming": {"speed": 2.0, "pulley_radius": 0.6},
        "stream": {"count": 50, "bed_height": 0.08, "seed": 3},
        "run": {"until": 2.0},
    }
    built = machine.build(scene.from_dict(document))
    recording = exact.run(built)
    partings = recording.first(recording.select(Kind.SEPARATION))
    rho = built.releases.position[:, 1]
    angle = np.arctan2(*partings["position"].T)
    np.testing.assert_allclose(angle, np.arccos(4.0 / (G * rho)), atol=1e-13)


def test_alone_or_in_a_crowd_a_particle_does_the_same_to_the_bit():
    document = {
        "particle": {"radius": 0.01},
        "surface": [{**FLOOR, "restitution": 0.6, "friction": 0.2}],
        "stream": {"count": 5, "rate": 50.0, "at": [0, 1], "velocity": [1, 0], "bed_height": 0.4},
        "run": {"until": "settled"},
    }
    alone = {**document, "stream": {**document["stream"], "count": 1}}
    assert run(document).track(0).tobytes() == run(alone).track(0).tobytes()


def test_particles_may_have_surfaces_of_their_own():
    base = scene.to_dict(scene.load("low-speed"))
    built = [
        machine.build(scene.from_dict({**base, "plate": {**base["plate"], "angle_deg": angle}}))
        for angle in (0.0, 10.0, -20.0)
    ]
    each = [m.segments for m in built]
    rows = {
        name: np.stack([getattr(s, name) for s in each])
        for name in ("start", "tangent", "length", "speed", "restitution", "friction")
    }
    releases = [
        np.concatenate([getattr(m.releases, name) for m in built])
        for name in ("t", "position", "velocity", "carried")
    ]
    batch = replace(
        built[0],
        segments=machine.Segments(**rows, surface=each[0].surface.copy()),
        releases=Releases(*releases),
    )
    together = exact.run(batch)
    for n, alone in enumerate(built):
        assert together.track(n).tobytes() == exact.run(alone).track(0).tobytes()


def test_interacting_particles_are_refused():
    built = machine.build(scene.load("stream"))
    with pytest.raises(ValueError, match="between particles"):
        exact.run(built)
