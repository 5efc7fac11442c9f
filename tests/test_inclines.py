"""The pulley of an inclined conveyor, and bodies with any moment of inertia, against ODEs."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from chutelab.theory import transfer
from shared import seeds

G = 9.81
INERTIA = {"disk": 0.5, "sphere": 0.4, "hoop": 1.0}


def crossing(function, direction=0.0):
    function.terminal, function.direction = True, direction
    return function


class Rider:
    """A body on belt and pulley by Newton's law and Coulomb's: position, v and r ω in time.

    k is I/(m r²), None if it does not turn. Positions are counted along the path of the centre.
    """

    def __init__(self, v0, radius, mu, k, beta):
        self.v0, self.radius, self.mu, self.k, self.beta = v0, radius, mu, k, beta
        self.share = 1.0 if k is None else k / (1.0 + k)

    def along(self, place):
        """Weight along the path, m/s²; the belt ends at 0."""
        return G * math.sin(-self.beta + max(place, 0.0) / self.radius)

    def load(self, place, v, *, belt):
        turn = 0.0 if belt else v * v / self.radius
        return G * math.cos(-self.beta + max(place, 0.0) / self.radius) - turn

    def go(self, place, v, rim, *, belt):
        """Ride until the belt ends, or the pulley is left, or it stands."""
        slip = None
        for _ in range(9):
            need = self.share * abs(self.along(place)) - self.mu * self.load(place, v, belt=belt)
            if slip is None and need > 0.0:
                slip = math.copysign(1.0, self.along(place))
            name, place, v, rim = self.phase(place, v, rim, slip, belt=belt)
            if name in ("end", "leaves", "stands"):
                return name, (place, v, rim, slip)
            slip = math.copysign(1.0, self.along(place)) if name == "slips" else None
        raise AssertionError

    def phase(self, place, v, rim, slip, *, belt):
        """Hold, or slip in one direction, up to the next event."""

        def way(y):
            # On the belt also beyond its end: a step that the end is found in has no bend in it.
            return 0.0 if belt else y[0]

        def rate(_, y):
            weight, load = self.along(way(y)), self.load(way(y), y[1], belt=belt)
            if slip is None:
                gain = (1.0 - self.share) * weight
                return [y[1], gain, -gain]
            drag = -slip * self.mu * load
            return [y[1], weight + drag, drag / self.k if self.k else 0.0]

        def need(_, y):
            load = self.load(way(y), y[1], belt=belt)
            return self.share * abs(self.along(way(y))) - self.mu * load

        events = {
            "stands": lambda t, y: y[1],
            "end": lambda t, y: y[0] if belt else 1.0,
            "leaves": lambda t, y: 1.0 if belt else self.load(y[0], y[1], belt=False),
            "slips": need if slip is None else lambda t, y: 1.0,
            "holds": lambda t, y: y[1] + y[2] - self.v0 if slip else 1.0,
        }
        start = [place, v, rim]
        # What has just ended must not be found again at once; slip begins at none.
        begun = {n: abs(f(0.0, start)) < 1e-11 for n, f in events.items() if n != "holds"}
        if not belt and self.load(place, v, belt=False) <= 0.0:
            return "leaves", place, v, rim
        names = [n for n in events if not begun.get(n)]
        watched = [crossing(events[n], -slip if n == "holds" and slip else 0.0) for n in names]
        # Events are found on polynomials of order 7 between steps, which no tolerance bounds.
        run = solve_ivp(
            rate, (0.0, 60.0), start, events=watched, method="DOP853", rtol=1e-13, atol=1e-14,
            max_step=0.005,
        )  # fmt: skip
        for name, states in zip(names, run.y_events, strict=True):
            if len(states):
                return name, *states[0]
        raise AssertionError


def ride(rider, length):
    """φ1, v1 and r ω1; None if it does not get so far."""
    name, (_, v, rim, slip) = rider.go(-length, rider.v0, 0.0, belt=True)
    if name == "stands":
        return None
    if slip is None or rider.load(0.0, v, belt=False) <= 0.0:
        name, (place, v, rim, _) = rider.go(0.0, v, rim, belt=False)
    else:
        name, place, v, rim = rider.phase(0.0, v, rim, slip, belt=False)
        if name == "holds":
            name, (place, v, rim, _) = rider.go(place, v, rim, belt=False)
    return None if name == "stands" else (-rider.beta + place / rider.radius, v, rim)


@pytest.mark.parametrize("kind", ["lump", *INERTIA])
@pytest.mark.parametrize("seed", seeds(4, 80))
def test_inclined_conveyor_against_an_ode(seed, kind):
    draw = np.random.default_rng(seed)
    beta = draw.uniform(-0.45, 0.45) * (seed % 4 > 0)
    rider = Rider(
        v0=draw.uniform(0.5, 2.5), radius=draw.uniform(0.2, 0.8),
        mu=draw.choice([0.1, 0.3, 0.5, 0.8]) * draw.uniform(0.8, 1.2), k=INERTIA.get(kind),
        beta=beta,
    )  # fmt: skip
    length, r = draw.uniform(0.0, 0.6), 0.01
    found = transfer(
        speed=rider.v0, pulley_radius=rider.radius - r, particle_radius=r, distance=1.5,
        friction=rider.mu, spin=kind != "lump", inertia=rider.k or 0.5, incline=beta,
        ride_length=length, unbounded_plate=False,
    )  # fmt: skip
    if "slips back" in str(found.reason):
        assert kind != "lump"
        assert beta > 0.0
        return
    known = ride(rider, length)
    if known is None:
        assert str(found.reason).startswith("outside the model: it does not get")
        return
    phi, v, rim = known
    assert found.phi1 == pytest.approx(phi, abs=1e-12)
    assert found.v1 == pytest.approx(v, rel=1e-12)
    assert found.omega1 * r == pytest.approx(rim if rider.k else 0.0, abs=1e-12)


@given(st.floats(1.0, 3.0), st.floats(0.1, 0.6), st.floats(0.02, 0.5))
def test_a_slow_throw_up_the_pulley_comes_down_on_it(v, radius, beta):
    # A parabola that touches the circle from outside at -β; sampled, does it come inside again?
    ratio = v**2 / (G * radius)
    assume(ratio > math.cos(beta) * (1.0 + 1e-4))
    assume(abs(ratio * math.cos(beta) - 1.0) > 1e-3)
    found = transfer(
        speed=v, pulley_radius=radius, distance=50.0, incline=beta, unbounded_plate=False
    )
    t = np.linspace(0.0, 2.0 * v / G, 4001)[1:]
    x = -radius * math.sin(beta) + v * math.cos(beta) * t
    y = radius * math.cos(beta) + v * math.sin(beta) * t - 0.5 * G * t**2
    inside = (np.hypot(x, y) < radius) & (y > 0.0)
    early = str(found.reason).startswith("early contact: pulley")
    assert early == bool(inside.any())
    assert early == (ratio * math.cos(beta) < 1.0)


@pytest.mark.parametrize("kind", INERTIA)
def test_bodies_that_turn_by_their_moment_of_inertia(kind):
    k, r, m, belt = INERTIA[kind], 0.01, 0.3, 1.5
    found = transfer(
        speed=1.0, pulley_radius=0.5, distance=0.3, particle_radius=r, spin=True, inertia=k,
        friction=0.4, plate_friction=5.0, mass=m, belt_speed=belt,
    )  # fmt: skip
    # On the plate it grips: angular momentum about the contact point stays, and it rolls after.
    before, rim = float(found.v2y), float(found.omega1) * r
    down = float(found.v2r * np.cos(found.phi2r))
    after = float(found.omega2) * r
    assert after == pytest.approx(down, rel=1e-14)
    assert down + k * after == pytest.approx(before + k * rim, rel=1e-14)
    # On the belt it ends rolling: v + r ω = belt, with v - k r ω as before.
    vx, rim = -float(found.v3x), after
    end = (k * (belt - rim) + vx) / (1.0 + k)
    assert found.belt_work == pytest.approx(m * belt * (end - vx), rel=1e-13)
    gain = 0.5 * m * (end**2 - vx**2) + 0.5 * k * m * ((belt - end) ** 2 - rim**2)
    assert found.slip_heat == pytest.approx(found.belt_work - gain, rel=1e-12)


@pytest.mark.parametrize("kind", INERTIA)
def test_with_endless_grip_it_leaves_where_a_rolling_body_would(kind):
    # Energy of a body that rolls round, N = 0: u = u0 + 2/(1+k) (1 - cos φ) = cos φ.
    ratio, radius = np.random.default_rng(1).uniform([[0.002], [0.2]], [[0.99], [0.6]], (2, 200))
    k, speed = INERTIA[kind], np.sqrt(ratio * G * radius)
    found = transfer(
        speed=speed, pulley_radius=radius - 0.01, particle_radius=0.01, distance=1.0, spin=True,
        inertia=k, friction=1e12, unbounded_plate=False,
    )  # fmt: skip
    cosine = (ratio + 2.0 / (1.0 + k)) / (1.0 + 2.0 / (1.0 + k))
    assert np.cos(found.phi1) == pytest.approx(cosine, rel=1e-10)
