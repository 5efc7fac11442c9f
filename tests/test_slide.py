"""Motion along a round chute against an ODE in time, energy and known cases; a belt's power."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from chutelab.engines.simulation import simulate
from chutelab.scene import from_dict
from chutelab.theory import belt_power, slide
from shared import seeds, some

G = 9.81


def by_ode(
    *, rho, start, end, speed, mu, side,
    k, slips_on,
):  # fmt: skip
    """Newton's law in time: how it ends, the angle, v, the rim's speed and t.

    `rim` is r times the turning in the sense of rolling. Friction of a body that rolls is what
    keeps v = rim, of one that slides µ N against the motion.
    """
    sense = 1.0 if end > start else -1.0

    def load(y):
        return side * (y[1] ** 2 / rho - G * math.sin(y[0]))

    def run(y, t, *, rolls):
        def rate(_, y):
            weight = -sense * G * math.cos(y[0])
            if rolls:
                gain = weight / (1.0 + k)
                return [sense * y[1] / rho, gain, gain]
            drag = mu * load(y)
            return [sense * y[1] / rho, weight - drag, drag / k if k else 0.0]

        def slipping(_, y):
            if not rolls:
                return 1.0
            return mu * load(y) - k / (1.0 + k) * G * abs(math.cos(y[0]))

        events = {
            "stops": lambda t, y: y[1], "lifts off": lambda t, y: load(y), "slips": slipping,
            "": lambda t, y: sense * (y[0] - end),
        }  # fmt: skip
        if slipping(0.0, y) < 0.0:
            return "slips", y, t
        for name, event in events.items():
            event.terminal, event.direction = True, 1.0 if name == "" else -1.0
        found = solve_ivp(
            rate, (t, t + 60.0), y, events=list(events.values()), method="DOP853", rtol=1e-13,
            atol=1e-15, max_step=0.01,
        )  # fmt: skip
        for name, times, states in zip(events, found.t_events, found.y_events, strict=True):
            if len(times):
                return name, states[0], times[0]
        raise AssertionError

    name, y, t = run([start, speed, speed], 0.0, rolls=k is not None)
    if name == "slips" and slips_on and sense * math.cos(y[0]) < 0.0:
        name, y, t = run(list(y), t, rolls=False)
    return name, *y, t


@pytest.mark.parametrize("kind", ["lump", "disk", "sphere"])
@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize("seed", seeds(4, 120))
def test_random_chutes_against_an_ode(seed, inside, kind):
    draw = np.random.default_rng(seed)
    k = {"disk": 0.5, "sphere": 0.4}.get(kind)
    radius, r, mu = draw.uniform(0.3, 2.0), draw.uniform(0.01, 0.1), draw.uniform(0.0, 0.8)
    side = 1.0 if inside else -1.0
    start = draw.uniform(-math.pi, 0.0) if inside else draw.uniform(0.2, math.pi - 0.2)
    way = draw.uniform(0.2, 6.0) * draw.choice([-1.0, 1.0])
    rho = radius - side * r
    fastest = 3.0 * math.sqrt(G * rho) if inside else math.sqrt(G * rho * math.sin(start))
    speed = draw.uniform(0.1, 1.0) * fastest
    found = slide(
        radius=radius, start=start, end=start + way, speed=speed, friction=mu, inside=inside,
        particle_radius=r, spin=k is not None, inertia=k or 0.5,
    )  # fmt: skip
    why, angle, v, rim, t = by_ode(
        rho=rho, start=start, end=start + way, speed=speed, mu=mu, side=side, k=k,
        slips_on=not inside,
    )  # fmt: skip
    assert found.reason == why
    assert found.angle == pytest.approx(angle, abs=1e-10)
    assert found.speed == pytest.approx(v, abs=1e-10 if why != "stops" else 1e-6)
    # A root of v that is not simple in the angle: the ODE's own time of standing is less sharp.
    assert found.time == pytest.approx(t, abs=1e-10)
    turning = 0.0 if k is None else -side * math.copysign(rim, way) / r
    assert found.omega == pytest.approx(turning, abs=1e-9 if why != "stops" else 1e-4)
    load = side * (v * v / rho - G * math.sin(angle)) / G
    assert found.load == pytest.approx(load, abs=1e-9)


@given(st.floats(0.05, 3.0), st.floats(0.0, 1.2), st.floats(0.1, 1.5))
def test_roberts_chute(radius, mu, turn):
    # His θ is from the horizontal down a quarter circle that is entered from rest at θ = 0:
    # v² = 2 g R/(1 + 4µ²) [(1 - 2µ²) sin θ + 3µ (cos θ - exp(-2µθ))].
    found = slide(radius=radius, start=-math.pi, end=-math.pi + turn, friction=mu)
    bracket = (1 - 2 * mu**2) * math.sin(turn) + 3 * mu * (
        math.cos(turn) - math.exp(-2 * mu * turn)
    )
    square = 2 * G * radius / (1 + 4 * mu**2) * bracket
    if found.reason == "":
        assert found.speed**2 == pytest.approx(square, rel=1e-11, abs=1e-14)
    else:
        assert found.reason == "stops"
        assert square < 1e-12


def test_a_pendulum_from_the_side_takes_a_quarter_of_its_period():
    # T = 4 sqrt(ρ/g) K(m), m = sin²(amplitude/2), down from rest; and up to where it stands.
    for start, end in [(-np.pi, -np.pi / 2), (-0.3, -np.pi / 2), (-np.pi + 1e-3, -np.pi / 2)]:
        found = slide(radius=0.7, start=start, end=end)
        period = 4.0 * math.sqrt(0.7 / G) * ellipk(math.sin(0.5 * abs(start + np.pi / 2)) ** 2)
        assert found.time == pytest.approx(period / 4.0, rel=1e-13)
        there = slide(radius=0.7, start=-np.pi / 2, end=0.0, speed=found.speed)
        if start != -np.pi:
            assert there.reason == "stops"
            assert there.time == pytest.approx(period / 4.0, rel=1e-7)
            assert there.angle == pytest.approx(-np.pi / 2 + abs(start + np.pi / 2), rel=1e-12)


@pytest.mark.parametrize(
    "changes",
    [{"radius": 0.0}, {"speed": -1.0}, {"friction": -0.1}, {"friction": np.inf}, {"end": 9.0},
     {"particle_radius": 1.0}, {"spin": True}, {"gravity": 0.0}, {"inertia": 2.0},
     {"start": np.nan}, {"start": 1.0}],
)  # fmt: skip
def test_outside(changes):
    found = slide(**({"radius": 1.0, "start": -3.0, "end": -1.0} | changes))
    assert str(found.reason).startswith("outside the model: ")
    assert np.isnan([found.angle, found.speed, found.omega, found.time, found.load]).all()


def test_the_power_of_a_belt_is_what_its_load_gains_and_its_slip_heats():
    # A second's load of 120 t/h, from -0.5 to 3 m/s and 4 m up; slip heat ½ m (v_b - v_x)².
    mass, fed, belt, rise = 120.0e3 / 3600.0, -0.5, 3.0, 4.0
    gain = 0.5 * mass * (belt**2 - fed**2) + mass * G * rise
    heat = 0.5 * mass * (belt - fed) ** 2
    power = belt_power(rate_t_h=120.0, belt_speed=belt, feed_speed=fed, lift=rise)
    assert power == pytest.approx(gain + heat, rel=1e-14)
    assert belt_power(rate_t_h=[0.0, 36.0], belt_speed=2.0).tolist() == [0.0, 40.0]


CHUTES = [
    (200.0, 265.0, 1.0, 0.3, True, False), (85.0, 60.0, 0.6, 0.1, False, False),
    (235.0, 300.0, 0.0, 0.4, True, True), (85.0, 30.0, 0.0, 0.4, False, True),
]  # fmt: skip


@pytest.mark.parametrize(
    ("start", "end", "speed", "mu", "inside", "spin", "engine", "off"),
    [
        *((*chute, engine, off) for engine, off in (("exact", 1e-12), ("contact", 2e-5))
          for chute in CHUTES),
        *some([(*chute, "pymunk", 2e-5) for chute in CHUTES[::-1]], 4),
    ],
)  # fmt: skip
def test_engines_find_the_same_on_a_chute(
    start, end, speed, mu, inside, spin, engine,
    off,
):  # fmt: skip
    radius, r = 1.0, 0.01
    first, last = math.radians(start), math.radians(end)
    found = slide(
        radius=radius, start=first, end=last, speed=speed, friction=mu, particle_radius=r,
        inside=inside, spin=spin,
    )  # fmt: skip
    rho, sense = radius - r if inside else radius + r, math.copysign(1.0, last - first)
    chute = {
        "name": "chute", "center": [0.0, 0.0], "radius": radius, "restitution": 0.0,
        "from_deg": 190.0 if inside else 0.0, "to_deg": 350.0 if inside else 180.0, "friction": mu,
    }  # fmt: skip
    stream = {
        "at": [rho * math.cos(first), rho * math.sin(first)],
        "velocity": [-sense * speed * math.sin(first), sense * speed * math.cos(first)],
    }
    one = from_dict(
        {"particle": {"radius": r, "mass": 0.01, "spin": spin}, "surface": [chute],
         "stream": stream, "run": {"until": float(found.time)}}, "test",
    )  # fmt: skip
    knot = simulate(one, engine=engine).track(0)[-1]
    x, y = knot["position"]
    assert math.remainder(math.atan2(y, x) - float(found.angle), 2.0 * math.pi) == pytest.approx(
        0.0, abs=off
    )
    assert math.hypot(*knot["velocity"]) == pytest.approx(float(found.speed), abs=10.0 * off)
    assert knot["omega"] == pytest.approx(float(found.omega), abs=1e3 * off)
