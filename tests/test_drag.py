"""What air drag would do, against solutions in closed form, small-drag theory and SciPy."""

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp

from chutelab.cli.console import main
from chutelab.engines.simulation import simulate
from chutelab.results.summary import summary
from chutelab.scene import from_dict
from chutelab.theory import drag, predict
from chutelab.theory.drag import drag_coefficient

G = 9.81
AIR, VISCOSITY = 1.2, 1.8e-5


def scene(**tables):
    base = {
        "incoming": {"speed": 2.0, "pulley_radius": 0.1},
        "plate": {"distance": 0.5},
        "outgoing": {"drop": 0.5},
    }
    for name, table in tables.items():
        base[name] = {**base.get(name, {}), **table}
    return from_dict(base, "test")


def by_scipy(found, *, r, m, eps, alpha):
    """Height of the impact on the plate and x of the landing, with drag by Schiller and Naumann."""

    def rate(_, y):
        v = math.hypot(y[2], y[3])
        re = AIR * v * 2 * r / VISCOSITY
        cd = 0.44 if re >= 1000 else 24 / re * (1 + 0.15 * re**0.687)
        slow = 0.5 * AIR * cd * math.pi * r * r * v / m
        return [y[2], y[3], -slow * y[2], -slow * y[3] - G]

    n = np.array([-math.cos(alpha), -math.sin(alpha)])

    def plate(_, y):
        return float((np.asarray(y[:2]) - [0.6, 0.1]) @ n - r)

    rho = 0.1 + r
    start = rho * np.array([math.sin(found.phi1), math.cos(found.phi1)])
    velocity = found.v1 * np.array([math.cos(found.phi1), -math.sin(found.phi1)])
    hit = start + np.array([found.x2, -found.y2])
    level = hit[1] - 0.5

    def leg(place, v, event):
        event.terminal, event.direction = True, -1.0
        run = solve_ivp(
            rate, (0.0, 9.0), [*place, *v], events=event, method="DOP853", rtol=1e-12, atol=1e-14
        )
        return run.y_events[0][0]

    y = leg(start, velocity, plate)
    v = y[2:] - (1.0 + eps) * (y[2:] @ n) * n
    return float(y[1] - hit[1]), float(
        leg(y[:2], v, lambda t, y: y[1] - level)[0] - (hit[0] - found.x3)
    )


@pytest.mark.parametrize("degrees", [-15.0, 0.0, 12.0])
@pytest.mark.parametrize("r", [0.02, 0.004, 0.0006])
def test_the_shifts_against_scipy(r, degrees):
    m = 2650.0 * 4.0 / 3.0 * math.pi * r**3
    plate = {"angle_deg": degrees, "below": 2.0}
    one = scene(particle={"radius": r, "mass": m}, plate=plate)
    found = predict(one)
    assert found.reason == ""
    told = drag(one, found, 0.0)
    assert told is not None
    impact, landing = by_scipy(found, r=r, m=m, eps=0.5, alpha=math.radians(degrees))
    # Where the coefficient jumps, from 0.438 to 0.44, a step of either is of lower order.
    assert told.impact_shift == pytest.approx(impact, rel=1e-5)
    assert told.landing_shift == pytest.approx(landing, rel=1e-5)
    assert told.arrives


def test_the_coefficient_of_a_sphere():
    assert drag_coefficient(1e-6) * 1e-6 == pytest.approx(24.0, rel=1e-4)  # Stokes
    assert drag_coefficient(1.0) == pytest.approx(24.0 * 1.15)
    assert drag_coefficient(100.0) == pytest.approx(0.24 * (1.0 + 0.15 * 100.0**0.687))
    assert drag_coefficient(999.0) == pytest.approx(0.44, abs=3e-3)
    assert drag_coefficient(1e5) == 0.44
    assert math.isinf(drag_coefficient(0.0))


def test_the_share_of_the_weight():
    r, m, v = 0.01, 0.011, 5.0
    one = scene(particle={"radius": r, "mass": m})
    told = drag(one, predict(one), v)
    assert told is not None
    assert (told.speed, told.coefficient) == (v, 0.44)
    assert told.reynolds == pytest.approx(2 * r * v * AIR / VISCOSITY)
    force = 0.5 * AIR * 0.44 * math.pi * r**2 * v**2
    assert told.share_of_weight == pytest.approx(force / (m * G), rel=1e-14)
    point = scene(particle={"radius": 0.0})
    assert drag(point, predict(point), v) is None
    still = from_dict({"stream": {"at": [0.0, 1.0], "velocity": [0.0, 0.0]}}, "test")
    assert drag(still, predict(still), 0.0) is None
    weightless = scene(particle={"radius": r}, plate={"angle_deg": 20.0})
    floating = weightless.with_values({"gravity": 0.0})
    told = drag(floating, predict(floating), v)
    assert told is not None
    # Without a weight there is no share of it: ½ ρ c_w π r² v² / m is told.
    assert math.isnan(told.share_of_weight)
    slowed = force * (told.speed / v) ** 2 / floating.particle.mass
    assert told.slowing == pytest.approx(slowed, rel=1e-14)
    assert f"would be a deceleration of {slowed:.2g} m/s² at" in str(told)


def test_air_keeps_dust_from_the_plate():
    for r in (5e-5, 1e-6):
        one = scene(particle={"radius": r, "mass": 2650.0 * 4 / 3 * math.pi * r**3})
        told = drag(one, predict(one), 0.0)
        assert told is not None
        assert not told.arrives
        assert math.isnan(told.landing_shift)
        assert "times the weight" in str(told)
        assert "keep particle 0 from getting there" in str(told)


def test_summary_report_and_check_tell_it():
    one = scene()
    told = summary(simulate(one))["drag"]
    assert told["speed"] == pytest.approx(float(predict(one).v3), rel=1e-12)
    _, landing = by_scipy(predict(one), r=0.0063, m=0.008, eps=0.5, alpha=0.0)
    assert told["landing_shift"] == pytest.approx(landing, rel=1e-5)
    assert set(told) == {
        "speed", "reynolds", "coefficient", "slowing", "share_of_weight", "impact_shift",
        "landing_shift", "arrives",
    }  # fmt: skip
    run = CliRunner().invoke(main, ["run", "perpendicular"])
    words = " ".join(run.output.split())
    share = 50.0 * AIR * 0.44 * math.pi * 0.0063**2 * told["speed"] ** 2 / (0.008 * G)
    would = f"would be {share:.2f} % of the weight at 4.39 m/s"
    assert f"Air drag, left out, {would}, and particle 0" in words
    checked = CliRunner().invoke(main, ["check", "perpendicular", "--json"])
    parts = {
        part["name"]: part["what"] for part in json.loads(checked.output)["scenes"][0]["skipped"]
    }
    assert parts["air"].startswith(f"its drag {would}")


def test_without_a_closed_form_only_the_share_is_told():
    free = from_dict(
        {"stream": {"at": [0.0, 1.0], "velocity": [3.0, 0.0]}, "run": {"until": 0.25}}, "test"
    )
    told = summary(simulate(free))["drag"]
    assert told["speed"] == pytest.approx(math.hypot(3.0, G * 0.25), rel=1e-9)
    assert told["landing_shift"] is told["impact_shift"] is None
    assert told["arrives"]
