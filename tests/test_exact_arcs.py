"""The event-driven engine on arcs, against differential equations integrated here."""

from decimal import Decimal, localcontext
from math import atan2, cos, degrees, exp, hypot, pi, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from chutelab.engines import contact, exact
from chutelab.machine import build
from chutelab.results import REASONS, Kind
from chutelab.results.ledger import ledger
from chutelab.scene.variants import Family
from machines import bent, face, of_sizes, scene_of

G = 9.81
FAR = face("far", [5.0, -5.0], [6.0, -5.0])


def at(position, velocity=(0.0, 0.0), *surfaces, radius=0.02, spin=False, until=2.0, gravity=G):
    return scene_of(
        gravity=gravity,
        particle={"radius": radius, "spin": spin},
        surface=list(surfaces) or [FAR],
        stream={"at": list(position), "velocity": list(velocity)},
        run={"until": until},
    )


def bowl(radius=1.0, **values):
    return {"center": (0.0, 0.0), "radius": radius, "begin": pi, "extent": pi, **values}


def on_the_bowl(angle, radius, length):
    """A place inside, that far from the lowest point, and the direction counterclockwise there."""
    reach = length - radius
    return np.array([reach * sin(angle), -reach * cos(angle)]), np.array([cos(angle), sin(angle)])


def inside(length, speed, angle, until, *, friction, belt=0.0, turning=0.0):
    """Integrate what slides or rolls inside a circle, from a slip to its end; (θ, w, z) at times.

    θ counterclockwise from the lowest point, w along it, z the spin's share of the slip w + z - b,
    and L θ'' = -g sin θ - σ µ N, z' = (m r²/I) F, N = g cos θ + w²/L.
    """

    def rates(_t, y):
        theta, w, z = y
        slip = w + z - belt
        force = -np.sign(slip) * friction * (G * cos(theta) + w * w / length)
        return [w / length, -G * sin(theta) + force, turning * force]

    def no_slip(_t, y):
        return y[1] + y[2] - belt

    no_slip.terminal = True
    return solve_ivp(
        rates, (0.0, until), [angle, speed, 0.0], method="DOP853", rtol=1e-13, atol=1e-14,
        dense_output=True, events=no_slip,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("radius", "share"), [(0.02, 0.0), (0.3, 0.0), (0.0, 0.0), (0.1, 0.5), (0.1, 0.4)]
)
def test_in_a_bowl_it_swings_like_a_pendulum(radius, share):
    """T = 4 sqrt((1 + k) L/g) K(sin²(θ/2)), L = R - r; at rest it is where it started.

    k = I/m r² is 0 of what slides without friction, 1/2 of a disk and 2/5 of a sphere that roll.
    """
    theta, length = 1.2, 1.0 - radius
    place, _ = on_the_bowl(theta, radius, 1.0)
    period = 4.0 * sqrt((1.0 + share) * length / G) * ellipk(sin(theta / 2) ** 2)
    built = at(place, until=3.0 * period, radius=radius, spin=share > 0.0)
    built = bent(built, bowl(friction=5.0 if share else 0.0))
    run = exact.run(of_sizes(built, np.array([radius]), 0.1, share) if share else built)
    end, track = run.track(0)[-1], run.track(0)
    np.testing.assert_allclose(end["position"], place, rtol=0, atol=1e-11)
    np.testing.assert_allclose(np.hypot(*track["position"].T), length, rtol=1e-13)
    fallen = place[1] - track["position"][:, 1]
    pace = (1.0 + share) * (track["velocity"] ** 2).sum(axis=1)
    np.testing.assert_allclose(pace, 2.0 * G * fallen, atol=1e-11)
    assert abs(ledger(run).residual) < 1e-13
    assert ledger(run).friction_loss == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("seed", range(8))
def test_sliding_in_a_bowl_obeys_its_equation_of_motion(seed):
    """Random angle, speed, friction, belt and spin, up to where the slip ends."""
    draw = np.random.default_rng(seed)
    angle, speed = draw.uniform(-1.2, 1.2), draw.uniform(-3.0, 3.0)
    friction, belt = draw.uniform(0.05, 0.8), draw.choice([0.0, 1.0, -2.0])
    spin = bool(seed % 2)
    place, along = on_the_bowl(angle, 0.05, 0.7)
    built = at(place, speed * along, radius=0.05, spin=spin, until=1.0)
    # Inside, a surface that moves clockwise runs against the angle θ.
    run = exact.run(bent(built, bowl(0.7, friction=friction, speed=-belt)))
    true = inside(
        0.65, speed, angle, 1.0, friction=friction, belt=belt, turning=2.0 if spin else 0.0
    )
    ends = true.t_events[0][0] if true.t_events[0].size else 1.0
    if ends < 1.0:
        theta, w, _ = true.y[:, -1]
        holds = abs(sin(theta)) * (1.0 / 3.0 if spin else 1.0)
        if G * holds < friction * (G * cos(theta) + w * w / 0.65):
            assert run.select(Kind.STICK)["t"][0] == pytest.approx(ends, abs=1e-10)
    track = run.track(0)
    track = track[track["t"] < ends - 1e-9]
    assert len(track) > 5
    theta, w, z = true.sol(track["t"])
    np.testing.assert_allclose(
        np.arctan2(track["position"][:, 0], -track["position"][:, 1]), theta, atol=1e-10
    )
    wanted = w[:, None] * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    np.testing.assert_allclose(track["velocity"], wanted, atol=1e-10)
    # θ grows as the disk turns clockwise.
    np.testing.assert_allclose(track["omega"] * 0.05, z, atol=1e-10)
    assert ledger(run).relative_residual < 1e-13


@pytest.mark.parametrize("speed", [0.3, 1.0, 1.9, 2.5])
def test_it_leaves_the_outside_where_its_weight_no_longer_holds_it(speed):
    """From a level ramp onto the top of a roller: cos φ = 2/3 + v²/(3 g ρ), without friction.

    Where v² > g ρ it flies off at the tangent.
    """
    ramp = face("ramp", [-1.0, 0.0], [0.0, 0.0], friction=0.0)
    roller = {"center": (0.0, -0.4), "radius": 0.4, "begin": 0.0, "extent": 2.0 * pi}
    run = exact.run(bent(at([-0.5, 0.02], [speed, 0.0], ramp, until=4.0), roller))
    (left,) = run.select(Kind.SEPARATION)
    phi = atan2(left["position"][0], left["position"][1] + 0.4)
    cosine = min(1.0, (2.0 + speed**2 / (G * 0.42)) / 3.0)
    assert cos(phi) == pytest.approx(cosine, rel=1e-13, abs=0.0)
    assert run.surfaces[left["surface"]] == ("arc 0" if cosine < 1.0 else "ramp")


def test_round_a_loop_it_comes_off_where_the_normal_force_is_gone():
    """In at the bottom at v² < 5 g L: off where v² = -g L cos φ, v² = v0² - 2 g L (1 - cos φ)."""
    floor = face("floor", [-2.0, 0.0], [0.0, 0.0], friction=0.0)
    length, v2 = 0.48, 4.6 * G * 0.48
    loop = {"center": (0.0, 0.5), "radius": 0.5, "begin": -0.5 * pi, "extent": 1.75 * pi}
    run = exact.run(bent(at([-1.0, 0.02], [sqrt(v2), 0.0], floor), loop))
    left = run.select(Kind.SEPARATION)[0]
    phi = atan2(left["position"][0], 0.5 - left["position"][1])
    assert cos(phi) == pytest.approx((2.0 - v2 / (G * length)) / 3.0, rel=1e-12, abs=0.0)
    again = run.select(Kind.IMPACT)[0]
    # The parabola meets the loop again, inside: |d| = L at that time and at none before.
    flight = np.linspace(1e-3, again["t"] - left["t"] - 1e-9, 200)[:, None]
    d = left["position"] - [0.0, 0.5] + left["velocity_after"] * flight
    d[:, 1] -= 0.5 * G * flight[:, 0] ** 2
    assert (np.hypot(*d.T) < length).all()
    assert hypot(*(again["position"] - [0.0, 0.5])) == pytest.approx(length, rel=1e-13, abs=0.0)


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_without_friction_and_gravity_it_goes_round_a_ring_as_often_as_there_is_time(way):
    """θ = v t/L, here for 40 turns."""
    length, speed = 0.08, 4.0
    until = 40.2 * 2.0 * pi * length / speed
    built = at([0.0, -length], [way * speed, 0.0], until=until, gravity=0.0)
    end = exact.run(bent(built, bowl(0.1, extent=2.0 * pi))).track(0)[-1]
    angle = way * 0.2 * 2.0 * pi
    place = [length * sin(angle), -length * cos(angle)]
    np.testing.assert_allclose(end["position"], place, rtol=0, atol=1e-10)


@pytest.mark.parametrize("engine", [exact, contact])
@pytest.mark.parametrize("aim", [-1.0, -0.4, 0.2, 0.9])
def test_a_blow_on_either_side_is_newtons_and_coulombs(engine, aim):
    """Shot from the centre and from far outside without gravity, on a rim that runs clockwise."""
    direction = np.array([cos(aim), sin(aim)])
    clockwise = np.array([direction[1], -direction[0]])
    for start, sense in (((0.0, 0.0), 1.0), (tuple(3.0 * direction), -1.0)):
        built = at(start, sense * 2.0 * direction, gravity=0.0)
        arc = {"center": (0.0, 0.0), "radius": 1.0, "begin": -1.5, "extent": 3.0,
               "speed": 3.0, "restitution": 0.5, "friction": 0.2}  # fmt: skip
        hit = engine.run(bent(built, arc)).select(Kind.IMPACT)[0]
        np.testing.assert_allclose(hit["position"], (1.0 - sense * 0.02) * direction, atol=1e-13)
        wanted = -sense * 1.0 * direction + 0.2 * 1.5 * 2.0 * clockwise
        np.testing.assert_allclose(hit["velocity_after"], wanted, atol=1e-13)


@pytest.mark.parametrize(("engine", "off"), [(exact, 1e-9), (contact, 3e-4)])
def test_what_is_larger_than_the_inside_of_an_arc_meets_its_ends(engine, off):
    """A disk of 0.3 over a cup of 0.2: it comes to rest on both of its rims.

    The contact engine leaves a thousandth of the radius of overlap alone.
    """
    cup = {"center": (0.0, 0.0), "radius": 0.2, "begin": pi, "extent": pi, "friction": 1.0}
    until, ended = ("settled", "settled") if engine is exact else (2.0, "time")
    run = engine.run(bent(at([0.0, 1.0], radius=0.3, until=until), cup))
    end = run.track(0)[-1]
    assert REASONS[run.ended[0]] == ended
    np.testing.assert_allclose(end["position"], [0.0, sqrt(0.3**2 - 0.2**2)], atol=off)


def hops(place, velocity, length, restitution, friction, share, least):
    """Fly inside a circle and rebound, with 40 digits, down to rebounds slower than `least`.

    Yield time, velocity and r ω after each impact. The gap falls to 0 at a root of
    |p + v t + g t²/2|² = L²; an impact follows Newton and Coulomb, with 1/share - 1 = m r²/I.
    """
    with localcontext() as context:
        context.prec = 40
        x, y, vx, vy, length = map(Decimal, (*place, *velocity, length))
        e, friction, share = map(Decimal, (restitution, friction, share))
        g, t, z, rebound = Decimal(G), Decimal(0), Decimal(0), Decimal(1)

        def out(time):
            return (x + vx * time) ** 2 + (y + (vy - g * time / 2) * time) ** 2 - length**2

        while rebound > least:
            high = rebound / 20 / g
            while out(high) <= 0:
                low, high = high, high * Decimal("1.05")
            while high - low > high * Decimal("1e-30"):
                middle = (low + high) / 2
                low, high = (low, middle) if out(middle) > 0 else (middle, high)
            x, y, vy = x + vx * low, y + (vy - g * low / 2) * low, vy - g * low
            t += low
            far = (x * x + y * y).sqrt()
            x, y = x * length / far, y * length / far
            nx, ny = -x / length, -y / length
            approach, pace = -(vx * nx + vy * ny), vx * ny - vy * nx
            rebound, most = e * approach, friction * (1 + e) * approach
            push = min(max(-share * (pace + z), -most), most)
            z += (1 / share - 1) * push
            vx = rebound * nx + (pace + push) * ny
            vy = rebound * ny - (pace + push) * nx
            yield float(t), (float(vx), float(vy)), float(z)


@pytest.mark.parametrize("spin", [False, True])
@pytest.mark.parametrize(("friction", "restitution"), [(0.0, 0.5), (0.1, 0.7), (0.4, 0.3)])
def test_ever_lower_hops_in_a_bowl_are_those_of_forty_digits(friction, restitution, spin):
    start, radius = ([-0.5, -0.3], [1.0, 0.5]), 0.02
    wanted = [*hops(*start, 1.0 - radius, restitution, friction, 1 / 3 if spin else 1.0, 1e-9)]
    arc = bowl(friction=friction, restitution=restitution)
    found = exact.run(bent(at(*start, radius=radius, spin=spin, until=6.0), arc)).select(
        Kind.IMPACT
    )
    assert len(found) >= len(wanted) - 1 > 15
    times, after, rims = zip(*wanted, strict=True)
    some = slice(len(wanted) - 1)
    np.testing.assert_allclose(found["t"][some], times[some], rtol=0, atol=1e-14)
    np.testing.assert_allclose(found["velocity_after"][some], after[some], rtol=0, atol=1e-13)
    np.testing.assert_allclose(radius * found["omega_after"][some], rims[some], rtol=0, atol=1e-13)


@pytest.mark.parametrize(("friction", "restitution"), [(0.3, 0.3), (0.2, 0.4), (0.15, 0.5)])
def test_bounces_that_are_left_out_act_like_the_ride_that_follows(friction, restitution):
    """Lone runs leave out bounces slower than 1e-9 m/s, families those of the last microsecond.

    Down to 1e-15 m/s they are computed with 40 digits here. Then w² = A cos θ + B sin θ +
    C exp(-2 µ θ), up to the end of the arc, solves d(w²)/dθ = -2 L (g sin θ + µ (g cos θ + w²/L)).
    """
    start, length, ends = ([-0.8, 0.0], [0.5, -2.0]), 0.98, 0.4
    *_, (_, velocity, _) = hops(*start, length, restitution, friction, 1.0, 1e-15)
    sine = -6.0 * friction * length * G / (1.0 + 4.0 * friction**2)
    cosine = 2.0 * (length * G + friction * sine)

    def steady(theta):
        return cosine * cos(theta) + sine * sin(theta)

    theta = atan2(velocity[1], velocity[0])
    rest = hypot(*velocity) ** 2 - steady(theta)
    wanted = sqrt(steady(ends) + rest * exp(2.0 * friction * (theta - ends)))
    arc = {"name": "bowl", "center": [0.0, 0.0], "radius": 1.0, "from_deg": 180.0}
    arc |= {"to_deg": degrees(1.5 * pi + ends), "friction": friction}
    built = at(*start, {**arc, "restitution": restitution}, until=6.0)
    lone = exact.run(built)
    with exact.lent(build(Family(built.scene, {"gravity": np.full(2, G)}))) as family:
        for run in (lone, family):
            velocity = run.select(Kind.SEPARATION)["velocity_after"][0]
            assert hypot(*velocity) == pytest.approx(wanted, rel=0, abs=1e-13)
        assert family.contacts <= 2 * lone.contacts - 10


LARGE = 0.1
HOP = ([-0.3, -0.75], [0.8, -0.5])
"""A throw of a disk of this radius into the bowl: it hops less far than it is wide."""


def first_hop():
    """Times of the rebound with ε = 0.3 from the bowl, and of the next; place and velocity."""
    (t, velocity, _), (back, *_) = list(hops(*HOP, 1.0 - LARGE, 0.3, 0.0, 1.0, 0.01))[:2]
    place = [HOP[0][0] + 0.8 * t, HOP[0][1] - (0.5 + G * t / 2.0) * t]
    return t, back, np.array(place), np.array(velocity)


def after(time, place, velocity):
    """Return place and velocity of a flight."""
    fallen = np.array([0.0, G * time])
    return place + (velocity - 0.5 * fallen) * time, velocity - fallen


@pytest.mark.parametrize("deep", [-1e-9, 1e-9, 1e-3])
def test_a_hop_ends_where_it_meets_the_end_of_a_wall(deep):
    """It hangs so deep into the middle of the first hop, from above."""
    t, back, *start = first_hop()
    place, velocity = after(0.5 * (back - t), *start)
    tip = place + (LARGE - deep) * np.array([-velocity[1], velocity[0]]) / hypot(*velocity)
    built = at(*HOP, face("wall", tip, (tip[0], 1.0)), radius=LARGE)
    hits = exact.run(bent(built, bowl(restitution=0.3))).select(Kind.IMPACT)
    assert hits["t"][0] == pytest.approx(t, rel=1e-13)
    assert (hits["surface"][1] != hits["surface"][0]) == (deep > 0.0)
    if deep > 0.0:
        assert hypot(*(hits["position"][1] - tip)) == pytest.approx(LARGE, rel=1e-12)
        assert t < hits["t"][1] < 0.5 * (t + back)


def test_a_hop_ends_at_a_wall():
    t, _, place, velocity = first_hop()
    ahead = 0.01
    wall = place[0] + LARGE + ahead
    built = at(*HOP, face("wall", (wall, -2.0), (wall, 2.0)), radius=LARGE)
    hit = exact.run(bent(built, bowl(restitution=0.3))).select(Kind.IMPACT, surface="wall")[0]
    assert hit["t"] == pytest.approx(t + ahead / velocity[0], rel=1e-13)


def test_a_hop_may_lead_past_the_end_of_an_arc():
    """The arc ends just before it would be back; it meets the end a little later."""
    t, back, *start = first_hop()
    place, _ = after(back - t, *start)
    over = atan2(*place[::-1]) + pi - 0.01
    run = exact.run(bent(at(*HOP, radius=LARGE), bowl(restitution=0.3, extent=over)))
    first, second = run.select(Kind.IMPACT)[:2]
    assert first["t"] == pytest.approx(t, rel=1e-13)
    away = second["position"] - [-cos(over), -sin(over)]
    assert hypot(*away) == pytest.approx(LARGE, rel=1e-12)
    assert second["t"] > back
