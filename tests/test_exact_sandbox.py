"""The event-driven engine on inclined belts, gates and mixtures, against laws written here."""

from __future__ import annotations

from dataclasses import replace
from math import acos, atan2, cos, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chutelab.engines import exact
from chutelab.results import Kind
from chutelab.results.ledger import ledger
from machines import bent, face, of_sizes, scene_of, thrown

G, WHEEL, RADIUS = 9.81, 0.3, 0.02
RHO = WHEEL + RADIUS
FAR = face("far", [5.0, -50.0], [6.0, -50.0])


def inclined(degrees, speed, friction, *, length=1.0, given=None, spin=False, until=1.5):
    """A particle on a belt that rises to the pulley, at the belt's speed or at another."""
    built = scene_of(
        particle={"radius": RADIUS, "spin": spin, "mass": 0.1},
        incoming={"speed": speed, "pulley_radius": WHEEL, "friction": friction, "length": length},
        stream={"at": [-length, RHO], "velocity": [speed, 0.0]},
        run={"until": until},
    )
    beta = radians(degrees)
    turn = np.array([[cos(beta), -sin(beta)], [sin(beta), cos(beta)]])
    segments, releases = built.segments, built.releases
    velocity = releases.velocity if given is None else np.array([[given, 0.0]])
    return replace(
        built,
        pulley=replace(built.pulley, incline=beta),
        segments=replace(
            segments, start=segments.start @ turn.T, tangent=segments.tangent @ turn.T
        ),
        releases=replace(releases, position=releases.position @ turn.T, velocity=velocity @ turn.T),
    )


def left_at(run):
    event = run.select(Kind.SEPARATION)[0]
    return atan2(*event["position"]), hypot(*event["velocity_after"]), event


@pytest.mark.parametrize("degrees", [0.0, 12.0, 35.0, -15.0])
@pytest.mark.parametrize("speed", [0.6, 1.2, 1.7, 3.0])
def test_adhesion_on_a_rising_belt(degrees, speed):
    """Off at the tangent point where v² ≥ g ρ cos β, else at cos φ1 = v²/(g ρ)."""
    run = exact.run(inclined(degrees, speed, "adhesion", until=4.0))
    phi, left, event = left_at(run)
    ratio, beta = speed**2 / (G * RHO), radians(degrees)
    wanted = -beta if ratio >= cos(beta) else acos(ratio)
    assert phi == pytest.approx(wanted, abs=1e-12)
    assert left == pytest.approx(speed, rel=1e-13)
    assert event["t"] == pytest.approx((1.0 + RHO * (wanted + beta)) / speed, rel=1e-12)
    start = -1.0 * sin(beta) + RHO * cos(beta)
    lifted = 0.1 * G * (RHO * cos(wanted) - start)
    # It may fall on the pulley again: where the rim rises the weight gets heavier on it.
    track = run.track(0)
    work = track[track["t"] <= event["t"]][-1]["entries"][0]
    assert work == pytest.approx(lifted, abs=1e-13)
    assert abs(ledger(run).residual) < 1e-13


def over_the_top(beta, speed, friction, w, way, turning):
    """Integrate along the belt and round the pulley; (angle, speed) where the normal force is gone.

    The state is (way along belt and rim from the tangent point, speed, spin's share of the slip);
    slip or none is decided as the force says, and changes where the slip is used up.
    """
    lever, s, z = turning, -way, 0.0

    def angle(s):
        return max(s, 0.0) / RHO - beta

    def forces(s, w):
        phi = angle(s)
        load = G * cos(phi) - (w * w / RHO if s >= 0.0 else 0.0)
        return load, G * sin(phi)

    slip = np.sign(w + z - speed)
    if slip == 0.0:
        load, pull = forces(s, w)
        slip = 0.0 if abs(pull) / (1.0 + lever) <= friction * load else np.sign(pull)
    for _ in range(12):
        for reach in (0.0, np.inf) if s < 0.0 else (np.inf,):

            def rates(_t, y, slip=slip):
                load, pull = forces(y[0], y[1])
                grip = -pull / (1.0 + lever)
                force = grip if slip == 0.0 else -slip * friction * load
                return [y[1], pull + force, lever * force]

            def lifts(_t, y):
                return forces(y[0], y[1])[0]

            def arrives(_t, y, reach=reach):
                return y[0] - min(reach, 1e3)

            def changes(_t, y, slip=slip):
                load, pull = forces(y[0], y[1])
                if slip == 0.0:
                    return friction * load - abs(pull) / (1.0 + lever)
                return slip * (y[1] + y[2] - speed)

            for event in (lifts, arrives, changes):
                event.terminal, event.direction = True, -1.0
            arrives.direction = 1.0
            found = solve_ivp(
                rates, (0.0, 20.0), [s, w, z], method="DOP853", rtol=1e-13, atol=1e-14,
                events=[lifts, arrives, changes], max_step=0.01,
            )  # fmt: skip
            s, w, z = found.y[:, -1]
            if found.t_events[0].size:
                return angle(s), w
            if found.t_events[1].size:
                s = 0.0
                load, pull = forces(s, w)
                if load <= 0.0:
                    return -beta, w
                if slip == 0.0 and abs(pull) / (1.0 + lever) > friction * load:
                    slip = np.sign(pull)
                continue
            break
        load, pull = forces(s, w)
        if slip == 0.0:
            slip = np.sign(pull)
        else:
            slip = 0.0 if abs(pull) / (1.0 + lever) <= friction * load else np.sign(pull)
    raise AssertionError("too many phases")


@pytest.mark.parametrize(
    ("degrees", "speed", "friction", "given", "spin"),
    [
        (15.0, 1.0, 0.6, 1.0, False),
        (15.0, 1.2, 0.45, 0.2, False),
        (25.0, 1.0, 0.9, 2.5, False),
        (-10.0, 1.0, 0.4, 1.0, False),
        (15.0, 1.0, 0.6, 3.5, True),
        (-10.0, 0.8, 0.2, 0.8, True),
    ],
)
def test_with_coulombs_friction_on_a_rising_belt(degrees, speed, friction, given, spin):
    built = inclined(degrees, speed, friction, given=given, spin=spin, until=4.0)
    run = exact.run(built)
    phi, left, _ = left_at(run)
    wanted = over_the_top(radians(degrees), speed, friction, given, 1.0, 2.0 if spin else 0.0)
    assert (phi, left) == pytest.approx(wanted, abs=1e-9)
    assert ledger(run).relative_residual < 1e-12


def test_a_belt_that_is_too_steep_lets_it_slide_back():
    """µ < tan β: it turns round after v²/2a, a = g (sin β + µ cos β), and µ pulls forwards then."""
    beta, mu, given = radians(30.0), 0.3, 3.0
    run = exact.run(inclined(30.0, 0.5, mu, given=given, until=4.0))
    slower = G * (sin(beta) + mu * cos(beta))
    slip_ends = (given - 0.5) / slower
    way = (given**2 - 0.5**2) / (2.0 * slower)
    # From the belt's speed on the belt is the faster one.
    back = G * (sin(beta) - mu * cos(beta))
    end = run.select(Kind.SEPARATION)[0]
    assert hypot(*end["velocity_after"]) == pytest.approx(
        sqrt(0.5**2 + 2.0 * back * way), rel=1e-12
    )
    time = slip_ends + (0.5 + sqrt(0.5**2 + 2.0 * back * way)) / back
    assert end["t"] == pytest.approx(time, rel=1e-12)
    assert end["velocity_after"][0] < 0.0


# Kinds of particles


def test_points_beside_disks_are_refused():
    built = thrown(scene_of(surface=[FAR]), [[0.0, 1.0], [1.0, 1.0]])
    mixed = of_sizes(replace(built, interact=False), np.array([0.0, 0.1]), 0.1)
    with pytest.raises(ValueError, match="points beside disks"):
        exact.run(mixed)


def test_of_a_mixture_each_does_what_it_does_alone():
    """Radii, masses, disks, spheres and what does not turn, pairs by kind: to the last bit."""
    floor = face("floor", [-1.0, 0.0], [4.0, -1.0], restitution=0.4, friction=0.3)
    built = scene_of(
        surface=[floor], stream={"at": [0.0, 1.0], "velocity": [1.0, 0.0]}, run={"until": 1.2}
    )
    built = bent(built, {"center": (3.0, 0.0), "radius": 0.5, "begin": 0.0, "extent": 2.0 * pi})
    many = thrown(built, [[0.0, 1.0 + 0.1 * n] for n in range(4)], velocity=(1.0, 0.0))
    radius, mass = np.array([0.02, 0.05, 0.01, 0.3]), np.array([0.1, 0.2, 0.3, 0.4])
    share, kind = np.array([0.5, 0.4, 0.0, 0.5]), np.array([0, 1, 2, 1])
    pairs = {
        "restitution": np.array([[0.4], [0.7], [0.0]]),
        "friction": np.array([[0.3], [0.1], [2.0]]),
    }
    many = of_sizes(replace(many, interact=False), radius, mass, share, kind, rolling=np.zeros(3))
    many = replace(
        many,
        segments=replace(many.segments, **pairs),
        arcs=replace(many.arcs, **pairs),
    )
    together = exact.run(many)
    for n in range(4):
        one = thrown(built, [[0.0, 1.0 + 0.1 * n]], velocity=(1.0, 0.0))
        one = of_sizes(one, radius[n], mass[n], share[n])
        one = replace(
            one,
            particle=replace(
                one.particle,
                **{
                    name: float(value[0] if np.ndim(value) else value)
                    for name, value in vars(one.particle).items()
                },
            ),
        )
        own = {name: table[kind[n]] for name, table in pairs.items()}
        one = replace(one, segments=replace(one.segments, **own), arcs=replace(one.arcs, **own))
        np.testing.assert_array_equal(together.track(n), exact.run(one).track(0))
    assert ledger(together).relative_residual < 1e-13


def test_a_sphere_rolls_down_with_five_sevenths_and_a_disk_with_two_thirds():
    slope = 0.4
    ramp = face("ramp", [0.0, 0.0], [50.0 * cos(slope), -50.0 * sin(slope)], friction=1.0)
    up = np.array([sin(slope), cos(slope)])
    built = scene_of(surface=[ramp], stream={"at": [1.0, 1.0]}, run={"until": 1.0})
    radius = np.array([0.02, 0.05, 0.03])
    place = 0.5 * np.array([cos(slope), -sin(slope)]) + radius[:, None] * up
    many = replace(thrown(built, place), interact=False)
    run = exact.run(of_sizes(many, radius, 0.1, np.array([0.5, 0.4, 1.0])))
    for n, share in enumerate((2.0 / 3.0, 5.0 / 7.0, 0.5)):
        speed = hypot(*run.track(n)[-1]["velocity"])
        assert speed == pytest.approx(share * G * sin(slope) * 1.0, rel=1e-12)


def test_a_sphere_in_a_bowl_swings_with_five_sevenths():
    """θ'' = -5/7 g sin θ/L: energy 7/10 v² + g h, and the time from integration."""
    bowl = {"center": (0.0, 0.0), "radius": 1.0, "begin": pi, "extent": pi, "friction": 3.0}
    built = bent(scene_of(surface=[FAR], stream={"at": [0.0, 5.0]}, run={"until": 1.3}), bowl)
    theta, length = -1.1, 0.9
    built = thrown(built, [[length * sin(theta), -length * cos(theta)]])
    run = exact.run(of_sizes(built, np.array([0.1]), 0.2, np.array([0.4])))
    track = run.track(0)
    true = solve_ivp(
        lambda _t, y: [y[1], -5.0 / 7.0 * G * sin(y[0]) / length], (0.0, 1.3), [theta, 0.0],
        method="DOP853", rtol=1e-13, atol=1e-14, dense_output=True,
    )  # fmt: skip
    found = np.arctan2(track["position"][:, 0], -track["position"][:, 1])
    np.testing.assert_allclose(found, true.sol(track["t"])[0], atol=1e-10)


def test_a_blow_on_a_sphere():
    """J_t = -2/7 m u while friction holds, and what the spin gets of it is 5/2 J_t / m r."""
    floor = face("floor", [-5.0, 0.0], [5.0, 0.0], restitution=0.5, friction=1.0)
    built = scene_of(surface=[floor], stream={"at": [0.0, 0.5]}, run={"until": 0.5})
    built = thrown(built, [[0.0, 0.5]], velocity=(1.4, 0.0))
    hit = exact.run(of_sizes(built, np.array([0.05]), 0.2, np.array([0.4]))).select(Kind.IMPACT)[0]
    assert hit["velocity_after"][0] == pytest.approx(1.4 * 5.0 / 7.0, rel=1e-13)
    assert hit["omega_after"] * 0.05 == pytest.approx(-1.4 * 5.0 / 7.0, rel=1e-13)
