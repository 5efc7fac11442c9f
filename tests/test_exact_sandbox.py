"""The event-driven engine on inclined belts, gates and mixtures, against laws written here."""

from dataclasses import replace
from math import acos, cos, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chutelab.engines import contact, exact, pymunk, reference
from chutelab.results import REASONS, Kind
from chutelab.results.ledger import ledger
from machines import bent, face, gated, nominal, of_sizes, scene_of, thrown

G, WHEEL, RADIUS = 9.81, 0.3, 0.02
RHO = WHEEL + RADIUS
FAR = face("far", [5.0, -50.0], [6.0, -50.0])


def inclined(degrees, speed, friction, given=None, shape="disk", way=1.0):
    """A particle on a belt of 1 m that rises to the pulley, at a given speed or the belt's."""
    beta = radians(degrees)
    along, up = np.array([cos(beta), sin(beta)]), np.array([-sin(beta), cos(beta)])
    return scene_of(
        particle={"radius": RADIUS, "spin": "spin" in shape, "shape": shape.split()[-1]},
        incoming={"speed": speed, "pulley_radius": WHEEL, "friction": friction, "length": 1.0,
                  "incline_deg": degrees},
        stream={"at": (RHO * up - way * along).tolist(),
                "velocity": None if given is None else (given * along).tolist()},
        run={"until": 4.0},
    )  # fmt: skip


def test_a_belt_that_is_too_steep_lets_it_slide_back():
    """µ < tan β: it turns round after v²/2a, a = g (sin β + µ cos β), and µ pulls forwards then."""
    beta, mu, given = radians(30.0), 0.3, 3.0
    run = exact.run(inclined(30.0, 0.5, mu, given))
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


@pytest.mark.parametrize(
    ("degrees", "speed", "friction", "given", "shape"),
    [
        (12.0, 1.2, "adhesion", None, "disk"), (35.0, 1.7, "adhesion", None, "disk"),
        (-15.0, 0.6, "adhesion", None, "disk"), (15.0, 1.2, 0.45, 0.2, "disk"),
        (25.0, 1.0, 0.9, 2.5, "disk"), (20.0, 0.5, 0.3, 3.5, "disk"),
        (15.0, 1.0, 0.6, 3.5, "spinning disk"), (-10.0, 0.8, 0.2, 0.8, "spinning sphere"),
    ],
)  # fmt: skip
def test_a_rising_belt_lets_go_where_its_equation_of_motion_says(
    degrees, speed, friction, given, shape
):
    built = inclined(degrees, speed, friction, given, shape, way=0.9)
    found = exact.run(built)
    assert ledger(found).relative_residual < 1e-12
    left, known = (run.select(Kind.SEPARATION)[0] for run in (found, reference.run(built)))
    for name in ("t", "position", "velocity_after"):
        np.testing.assert_allclose(left[name], known[name], rtol=1e-12, atol=1e-13)
    stepped = contact.run(built).select(Kind.SEPARATION)[0]
    off = 1e-12 if friction == "adhesion" else 200.0 * built.dt**2
    np.testing.assert_allclose(stepped["position"], left["position"], rtol=0, atol=off)
    place, velocity, _ = nominal(built.scene)
    np.testing.assert_allclose(place, left["position"], atol=1e-12)
    np.testing.assert_allclose(velocity, left["velocity_after"], atol=1e-12)


# Kinds of particles


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


# Gates


def test_what_lies_or_slides_on_a_gate_flies_when_it_opens():
    """With `settled` too: at rest until then, however long, and beside those on firm ground."""
    floor, firm = (
        face(name, [x, 0.0], [x + 6.0, 0.0], friction=0.3, restitution=0.0)
        for name, x in (("gate", -1.0), ("firm", 9.0))
    )
    built = scene_of(
        particle={"radius": 0.02, "spin": False}, surface=[floor, firm],
        stream={"at": [0.0, 0.5]}, run={"until": "settled"},
    )  # fmt: skip
    built = thrown(built, [[0.0, 0.5], [9.5, 0.5], [0.0, 0.02]], [[0, 0], [0, 0], [5.0, 0]])
    run = exact.run(gated(replace(built, interact=False), 0, vanishes=1.0))
    assert [REASONS[n] for n in run.ended] == ["exit", "settled", "exit"]
    left = run.select(Kind.SEPARATION)
    assert left["t"].tolist() == [1.0, 1.0]
    np.testing.assert_array_equal(left["position"][0], [0.0, 0.02])
    speed, fall = 5.0 - 0.3 * G * 1.0, sqrt(2.0 * 1.02 / G)
    np.testing.assert_allclose(left["velocity_after"][1], [speed, 0.0], rtol=1e-13)
    # They leave 1 m below the lowest surface.
    for n, across in ((0, 0.0), (2, speed)):
        end = run.track(n)[-1]
        assert end["t"] == pytest.approx(1.0 + fall, rel=1e-13)
        np.testing.assert_allclose(end["velocity"], [across, -G * fall], rtol=1e-13)
    assert ledger(run).relative_residual < 1e-13


@pytest.mark.parametrize("engine", [exact, contact])
@pytest.mark.parametrize("post", [False, True])
def test_along_a_gate_that_shut_in_it_a_disk_leaves_past_the_end(engine, post):
    """The gate's end lies in the way, but the disk is in the gate; a post there it does strike."""
    radius, above, speed = 0.05, 0.02, 2.0
    parts = [face("gate", [0.0, 0.0], [1.0, 0.0], closes_at=0.1)]
    if post:
        parts.append(face("post", [1.0, 0.0], [1.0, -1.0], restitution=0.5, friction=0.0))
    built = scene_of(
        gravity=0.0, particle={"radius": radius, "spin": False}, surface=parts,
        stream={"at": [0.5, above], "velocity": [speed, 0.0]}, run={"until": 0.5},
    )  # fmt: skip
    run = engine.run(built)
    hits = run.select(Kind.IMPACT)
    if not post:
        assert len(hits) == 0
        np.testing.assert_allclose(run.track(0)[-1]["position"], [1.5, above], rtol=1e-12)
        return
    x = 1.0 - sqrt(radius**2 - above**2)
    assert hits["t"][0] == pytest.approx((x - 0.5) / speed, rel=1e-9)
    normal = np.array([x - 1.0, above]) / radius
    after = np.array([speed, 0.0]) - 1.5 * speed * normal[0] * normal
    np.testing.assert_allclose(hits["velocity_after"][0], after, rtol=1e-9)


@pytest.mark.parametrize("engine", [exact, contact])
def test_a_ride_along_a_gate_that_shut_in_it_goes_on_past_the_end(engine):
    """A bent gate about the same centre, through the middle of what swings in the bowl."""
    bowl = {"center": (0.0, 0.0), "radius": 1.0, "begin": pi, "extent": pi}
    gate = {"center": (0.0, 0.0), "radius": 0.94, "begin": 1.3 * pi, "extent": 0.2 * pi}
    theta, length = -0.6, 0.95
    built = scene_of(
        particle={"radius": 0.05, "spin": False}, surface=[FAR],
        stream={"at": [0.0, 5.0]}, run={"until": 0.8},
    )  # fmt: skip
    start = [[length * sin(theta), -length * cos(theta)]]
    free = engine.run(bent(thrown(built, start), bowl))
    with_gate = engine.run(bent(thrown(built, start), bowl, {**gate, "appears": 0.1}))
    times = np.linspace(0.0, 0.8, 81)
    place, _ = free.at(times)
    assert place[-1, 0, 0] > 0.2
    np.testing.assert_allclose(with_gate.at(times)[0], place, atol=1e-9)


def test_over_a_shut_trapdoor_it_slides_and_into_an_open_one_it_falls():
    """Floor, trapdoor, floor in one line: flush while it is shut."""
    parts = [
        face(name, [x, 0.0], [x + 1.0, 0.0], friction=0.0, restitution=0.0)
        for name, x in (("before", -1.0), ("door", 0.0), ("behind", 1.0))
    ]
    built = scene_of(
        particle={"radius": 0.02}, surface=parts,
        stream={"at": [-0.5, 0.02], "velocity": [1.0, 0.0]}, run={"until": 2.4},
    )  # fmt: skip
    shut = exact.run(gated(built, 1, vanishes=1.6))
    assert [*shut.select(Kind.SEPARATION)["t"]] == []
    assert [*shut.select(Kind.IMPACT)["t"]] == []
    np.testing.assert_allclose(shut.track(0)[-1]["position"], [1.9, 0.02], atol=1e-12)
    dropped = exact.run(gated(built, 1, vanishes=1.0))
    assert dropped.select(Kind.SEPARATION)["t"][0] == 1.0
    gone = exact.run(gated(built, 1, vanishes=0.2))
    edge = gone.select(Kind.SEPARATION)[0]
    # Faster than sqrt(g r), it flies off at the edge.
    np.testing.assert_allclose(edge["position"], [0.0, 0.02], atol=1e-12)
    # A door that shuts later is there for what comes then.
    late = exact.run(gated(built, 1, appears=0.45))
    np.testing.assert_allclose(late.track(0)[-1]["position"], [1.9, 0.02], atol=1e-12)


def test_in_a_corner_of_a_gate_it_waits_until_that_opens():
    """A block on a slope against a gate; when it opens it slides off as from rest."""
    slope, mu = 0.5, 0.1
    down = np.array([cos(slope), -sin(slope)])
    up = np.array([sin(slope), cos(slope)])
    ramp = face("ramp", [0.0, 0.0], (3.0 * down).tolist(), friction=mu, restitution=0.0)
    gate = face("gate", (1.0 * down).tolist(), (1.0 * down + up).tolist(), friction=0.0,
                restitution=0.0)  # fmt: skip
    place = (0.5 * down + 0.02 * up).tolist()
    built = scene_of(
        particle={"radius": 0.02, "spin": False}, surface=[ramp, gate],
        stream={"at": place}, run={"until": 2.0},
    )  # fmt: skip
    run = exact.run(gated(built, 1, vanishes=1.5))
    end = run.track(0)[-1]
    pull = G * (sin(slope) - mu * cos(slope))
    np.testing.assert_allclose(end["velocity"], pull * 0.5 * down, rtol=1e-11)
    wanted = (0.98 + 0.5 * pull * 0.25) * down + 0.02 * up
    np.testing.assert_allclose(end["position"], wanted, rtol=1e-11)
    assert ledger(run).relative_residual < 1e-12


def test_an_arc_that_opens_lets_go_of_what_rides_in_it():
    arc = {"center": (0.0, 0.0), "radius": 1.0, "begin": pi, "extent": pi, "vanishes": 0.4}
    theta, length = -0.8, 0.98
    built = scene_of(particle={"radius": 0.02, "spin": False}, surface=[FAR],
                     stream={"at": [0.0, 5.0]}, run={"until": 0.7})  # fmt: skip
    built = bent(thrown(built, [[length * sin(theta), -length * cos(theta)]]), arc)
    run = exact.run(built)
    (left,) = run.select(Kind.SEPARATION)
    assert left["t"] == 0.4
    true = solve_ivp(lambda _t, y: [y[1], -G / length * sin(y[0])], (0.0, 0.4), [theta, 0.0],
                     method="DOP853", rtol=1e-13, atol=1e-14)  # fmt: skip
    angle, rate = true.y[:, -1]
    velocity = length * rate * np.array([cos(angle), sin(angle)])
    np.testing.assert_allclose(left["velocity_after"], velocity, atol=1e-11)
    end = run.track(0)[-1]["velocity"]
    np.testing.assert_allclose(end, velocity - [0.0, G * 0.3], atol=1e-11)


@pytest.mark.parametrize("engine", [exact, pytest.param(contact, marks=pytest.mark.slow)])
def test_gates_across_the_way_of_a_carried_particle(engine):
    """A bar beside the pulley, in the way at 30°: passed before it is there, else struck."""
    built = inclined(10.0, 0.8, "adhesion")
    bar = {"radius": 0.02, "begin": 0.0, "extent": 2.0 * pi}
    bar["center"] = (0.5 * 0.35, 0.5 * sqrt(3.0) * 0.35)
    # It touches where the centres are 0.04 apart.
    beta, apart = radians(10.0), acos((RHO**2 + 0.35**2 - 0.04**2) / (2.0 * RHO * 0.35))
    there = (1.0 + RHO * (beta + radians(30.0) - apart)) / 0.8
    for appears, struck in ((there - 0.01, True), (there + 0.01, False), (0.5, True)):
        run = engine.run(bent(built, {**bar, "appears": appears}))
        hits = run.select(Kind.IMPACT)
        hits = hits[np.abs(hits["t"] - there) < 1e-9]
        assert bool(len(hits)) is struck


# Rolling friction


def rolling(built, share, kappa, radius=0.02):
    """Return the machine with one particle, I = share m r², and rolling friction."""
    return of_sizes(built, np.array([radius]), 0.1, np.array([share]), rolling=np.array([kappa]))


@pytest.mark.parametrize(
    ("engine", "off"),
    [(exact, 1e-12), (contact, 1e-3), pytest.param(pymunk, 1e-7, marks=pytest.mark.slow)],
)
@pytest.mark.parametrize("share", [0.5, pytest.param(0.4, marks=pytest.mark.slow)])
def test_a_roller_slows_down_and_stops(share, engine, off):
    """m v' = -F and I ω' = F r - κ N r: v' = -κ g/(1 + I/m r²), and what it has becomes heat."""
    floor = face("floor", [-1.0, 0.0], [9.0, 0.0], friction=0.5, restitution=0.0)
    built = scene_of(surface=[floor], stream={"at": [0.0, 0.5]}, run={"until": "settled"})
    built = thrown(built, [[0.0, 0.02]], velocity=(0.9, 0.0))
    run = engine.run(rolling(built, share, 0.02))
    grip = run.select(Kind.STICK)[0]
    speed, x = grip["velocity_after"][0], grip["position"][0]
    end = run.track(0)[-1]
    slower = 0.02 * G / (1.0 + share)
    assert end["position"][0] - x == pytest.approx(speed**2 / (2.0 * slower), rel=off)
    if engine is not contact:  # in pymunk it stops at the end of a step
        late = 0.0 if engine is exact else 1.1e-3
        assert end["t"] - grip["t"] == pytest.approx(speed / slower, rel=off, abs=late)
    assert (REASONS[run.ended[0]], end["omega"]) == ("settled", pytest.approx(0.0, abs=off**2))
    books = ledger(run)
    assert books.friction_loss == pytest.approx(0.5 * 0.1 * 0.9**2, rel=off)
    assert books.relative_residual < (1e-11 if engine is pymunk else 1e-12)


@pytest.mark.parametrize(("engine", "off"), [(exact, 1e-12), (contact, 1e-4)])
@pytest.mark.parametrize(("slope", "kappa"), [(0.3, 0.1), (0.3, 0.2), (0.05, 0.2)])
def test_down_a_ramp_it_rolls_only_if_that_is_steeper_than_rolling_friction(
    slope, kappa, engine, off
):
    """a = g (sin - κ cos)/(1 + I/m r²), none for tan ≤ κ."""
    down, up = np.array([cos(slope), -sin(slope)]), np.array([sin(slope), cos(slope)])
    ramp = face("ramp", (-down).tolist(), (20.0 * down).tolist(), friction=1.0, restitution=0.0)
    built = scene_of(surface=[ramp], stream={"at": [0.0, 1.0]}, run={"until": 1.0})
    run = engine.run(rolling(thrown(built, [0.02 * up]), 0.4, kappa))
    pull = max(G * (sin(slope) - kappa * cos(slope)), 0.0) / 1.4
    end = run.track(0)[-1]
    np.testing.assert_allclose(end["velocity"], pull * down, atol=off)
    assert abs(ledger(run).residual) < 1e-13


@pytest.mark.parametrize("seed", range(3))
def test_in_a_bowl_it_rolls_to_and_fro_until_it_stops(seed):
    """(1 + I/m r²) w' = -g sin θ - τ κ N, N = g cos θ + w²/L, from stop to stop, then none."""
    draw = np.random.default_rng(seed)
    share, kappa, theta = draw.uniform(0.3, 0.6), draw.uniform(0.02, 0.2), draw.uniform(0.3, 1.0)
    arc = {"center": (0.0, 0.0), "radius": 1.0, "begin": pi, "extent": pi, "friction": 3.0}
    length, radius = 0.9, 0.1
    built = bent(scene_of(surface=[FAR], stream={"at": [0.0, 5.0]}, run={"until": 9.0}), arc)
    built = thrown(built, [[length * sin(theta), -length * cos(theta)]])
    run = exact.run(rolling(built, share, kappa, radius))
    track, began = run.track(0), 0.0
    for _ in range(100):
        if abs(np.tan(theta)) <= kappa:
            break
        way = -np.sign(theta)

        def rates(_t, y, way=way):
            normal = G * cos(y[0]) + y[1] ** 2 / length
            return [y[1] / length, (-G * sin(y[0]) - way * kappa * normal) / (1.0 + share)]

        def stops(_t, y, way=way):
            return way * y[1]

        stops.terminal, stops.direction = True, -1.0
        true = solve_ivp(rates, (0.0, 5.0), [theta, 0.0], method="DOP853", rtol=1e-13,
                         atol=1e-14, dense_output=True, events=stops)  # fmt: skip
        lasts = true.t_events[0][0]
        some = track[(track["t"] > began + 1e-6) & (track["t"] < min(began + lasts, 9.0) - 1e-6)]
        angle, pace = true.sol(some["t"] - began)
        found = np.arctan2(some["position"][:, 0], -some["position"][:, 1])
        np.testing.assert_allclose(found, angle, atol=1e-10)
        np.testing.assert_allclose(some["omega"] * radius, -pace, atol=1e-9)
        theta, began = true.y[0, -1], began + lasts
    if began < 8.0:
        end = track[-1]
        assert np.arctan2(end["position"][0], -end["position"][1]) == pytest.approx(theta, abs=1e-9)
        np.testing.assert_allclose(end["velocity"], 0.0, atol=1e-12)
    assert ledger(run).relative_residual < 1e-12


def test_on_a_roller_that_turns_it_is_the_spin_against_the_rollers_that_counts():
    """Held on top of a wheel by both frictions it goes round with it, as if it were glued on."""
    wheel = {"center": (0.0, 0.0), "radius": 0.5, "begin": 0.0, "extent": 2.0 * pi,
             "friction": 2.0, "speed": 0.2}  # fmt: skip
    built = bent(scene_of(surface=[FAR], stream={"at": [0.0, 5.0]}, run={"until": 0.5}), wheel)
    place = [-0.6 * sin(0.1), 0.6 * cos(0.1)]
    velocity = (0.24 * cos(0.1), 0.24 * sin(0.1))
    built = rolling(thrown(built, [place], velocity), 0.5, 1.5, radius=0.1)
    run = exact.run(built)
    end = run.track(0)[-1]
    # The contact point moves at 0.2 round 0.5, ω = -0.4, so the centre at 0.2 + 0.1 · 0.4.
    assert end["omega"] == pytest.approx(-0.4, rel=1e-12)
    assert hypot(*end["velocity"]) == pytest.approx(0.24, rel=1e-12)
    assert ledger(run).relative_residual < 1e-12
