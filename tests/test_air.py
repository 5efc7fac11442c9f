"""Drag of still air in a run, against closed forms and an ODE that are written here."""

from math import log, pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chutelab import scene as sc
from chutelab.engines.simulation import simulate
from chutelab.scene import SceneError
from chutelab.theory import predict

R, M, AIR, NU, G, E = 0.003, 2e-4, 1.2, 1.8e-5, 9.81, 0.6


def relief(speed, density=AIR, r=R, m=M):
    """½ ρ C π r² v / m with C of Schiller and Naumann (1933), 1/s."""
    re = 2.0 * r * speed * density / NU
    c = 24.0 / re * (1.0 + 0.15 * re**0.687) if re < 1000.0 else 0.44
    return 0.5 * density * c * pi * r**2 * speed / m


def thrown(engine="contact", dt=1e-3, air=AIR, until=1.2, **more):
    return sc.from_dict({
        "air_density": air, "particle": {"radius": R, "mass": M},
        "surface": [{"name": "floor", "from": [-9.0, 0.0], "to": [9.0, 0.0], "restitution": E,
                     "friction": 0.0}],
        "stream": {"at": [0.0, 1.0], "velocity": [4.0, 2.0]},
        "run": {"engine": engine, "dt": dt, "until": until}, **more,
    })  # fmt: skip


def by_ode(until, air):
    """Flight, bounce, flight: state at the end with the energy lost to air, and times of blows."""

    def rate(_, s):
        _, _, vx, vy, _ = s
        k = relief(np.hypot(vx, vy), air)
        return vx, vy, -k * vx, -k * vy - G, M * k * (vx * vx + vy * vy)

    def meets(_, s):
        return s[1] - R

    meets.terminal, meets.direction = True, -1
    state, t, blows = [0.0, 1.0, 4.0, 2.0, 0.0], 0.0, []
    while t < until:
        found = solve_ivp(rate, (t, until), state, events=meets, rtol=1e-11, atol=1e-13)
        t, state = found.t[-1], found.y[:, -1].copy()
        if found.status == 1:
            blows.append(t)
            state[3] *= -E
    return state, blows


@pytest.mark.parametrize(("until", "air"), [(0.6, AIR), (1.2, AIR), (0.45, 0.4)])
def test_flights_and_bounces_follow_the_ode_to_second_order(until, air):
    (x, y, vx, vy, lost), blows = by_ode(until, air)
    # In thin air the coefficient is Schiller's and Naumann's, Re < 1000, all the way.
    assert (2.0 * R * air * np.hypot(vx, vy) / NU < 1000.0) == (air < AIR)
    off = []
    for dt in (1e-3, 5e-4, 2.5e-4):
        run = simulate(thrown(dt=dt, until=until, air=air))
        at, v = run.knots["position"][-1], run.knots["velocity"][-1]
        off.append(max(*np.abs(at - (x, y)), *np.abs(v - (vx, vy))))
        assert run.select("impact")["t"] == pytest.approx(blows, abs=1e-7)
        assert run.ledger.air_loss == pytest.approx(lost, rel=2e-6)
        assert not run.laws
        assert run.ledger.relative_residual < 1e-11
        assert run.ledger.by_surface["still air"]["friction_loss"] == run.ledger.air_loss
        # The floor is smooth.
        assert run.ledger.friction_loss == pytest.approx(run.ledger.air_loss, rel=1e-12)
    assert off[0] < 2e-7
    # A blow comes anywhere in its step, so the error after it has another share of dt² each time.
    assert blows or (off[0] > 3.5 * off[1] > 12.0 * off[2])
    # Without, it would be centimetres further: this is no test of nothing.
    without = simulate(thrown(air=0.0, until=until)).knots["position"][-1, 0]
    assert without > x + 0.05 * until * air / AIR


def test_where_the_coefficient_is_0_44_a_shot_follows_its_closed_form():
    """dv/dt = -k v²: x = ln(1 + k v₀ t) / k, v = v₀ / (1 + k v₀ t)."""
    r, m, v0, t = 0.02, 0.01, 20.0, 1.5
    k = 0.22 * AIR * pi * r**2 / m
    assert 2.0 * r * AIR * v0 / (1.0 + k * v0 * t) / NU > 1000.0
    run = simulate({
        "gravity": 0.0, "air_density": AIR, "particle": {"radius": r, "mass": m},
        "surface": [{"name": "below", "from": [0.0, -1.0], "to": [30.0, -1.0]}],
        "stream": {"at": [0.0, 0.0], "velocity": [v0, 0.0]}, "run": {"until": t},
    })  # fmt: skip
    assert run.engine == "contact"
    end = run.knots[-1]
    assert end["position"][0] == pytest.approx(log(1.0 + k * v0 * t) / k, rel=1e-7)
    assert end["velocity"][0] == pytest.approx(v0 / (1.0 + k * v0 * t), rel=1e-7)


@pytest.mark.parametrize("r", [2e-5, 5e-6, 1.5e-6])
@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_dust_falls_at_its_terminal_speed(engine, r):
    """At Re << 1 Stokes: m g = 6 π η r v; what is left of Schiller's and Naumann's term is told.

    Steps are short enough for it: drag takes a twentieth of the speed in one, and the mean speed is
    off by 0.05² / 12; where it is within a step adds a little.
    """
    m = 4.0 / 3.0 * pi * r**3 * 2500.0
    slow = m / (6.0 * pi * NU * r)  # s; time in which it settles
    run = simulate({
        "air_density": AIR, "particle": {"radius": r, "mass": m},
        "stream": {"at": [0.0, 0.0], "velocity": [0.0, 0.0]},
        "run": {"until": 20.0 * slow, "engine": engine},
    })  # fmt: skip
    (_, high), (_, low) = run.at([14.0 * slow, 19.0 * slow]).position[:, 0]
    speed = (high - low) / (5.0 * slow)
    assert relief(speed, r=r, m=m) * speed == pytest.approx(G, rel=5e-4)
    assert speed == pytest.approx(slow * G, rel=0.15)


def test_what_air_stops_at_once_is_refused():
    """6 π η r / m above 1e5 1/s: here 1.7e5 1/s."""
    light = {"particle": {"radius": 0.05, "mass": 1e-10}}
    with pytest.raises(SceneError, match=r"particle\.mass = 1e-10: at least 1\.7e-10 kg with air_"):
        simulate(thrown(**light))
    assert simulate(thrown(air=0.0, until=0.1, **light)).count == 1


def crowd(**more):
    return sc.from_dict({
        "air_density": AIR, "particle": {"radius": 0.01, "mass": 1e-3, "spin": True},
        "surface": [{"name": "box", "points": [[-0.3, 0.5], [-0.3, 0.0], [0.3, 0.0], [0.3, 0.5]],
                     "restitution": 0.5, "friction": 0.3}],
        "stream": {"count": 60, "fill": [[-0.29, 0.1], [0.29, 2.0]], "restitution": 0.5,
                   "friction": 0.3, "interact": True},
        "run": {"until": 0.6, "dt": 2.5e-4}, **more,
    })  # fmt: skip


def test_a_crowd_s_ledger_closes_and_has_the_work_of_the_drag_along_its_tracks():
    run = simulate(crowd())
    assert run.engine == "contact"
    assert not run.laws
    assert run.ledger.relative_residual < 1e-11
    parts = run.ledger.by_surface.values()
    assert sum(p["friction_loss"] for p in parts) == pytest.approx(run.ledger.friction_loss, 1e-12)
    times = np.linspace(0.0, 0.6, 6001)
    speed = np.hypot(*np.moveaxis(run.at(times)[1], -1, 0))
    speed[~(speed > 1e-9)] = 1e-9
    drag = np.vectorize(lambda v: relief(v, r=0.01, m=1e-3))(speed)
    work = np.trapezoid((1e-3 * drag * speed**2).sum(axis=1), times)
    assert run.ledger.air_loss == pytest.approx(work, rel=2e-3)


@pytest.mark.parametrize("scene", ["slip", "stream-independent"])
def test_without_air_a_run_has_the_bits_that_it_had(scene):
    usual, vacuum = (
        simulate(scene, {"run.engine": "contact", **more}) for more in ({}, {"air_density": 0.0})
    )
    assert usual.events.tobytes() == vacuum.events.tobytes()
    assert usual.knots.tobytes() == vacuum.knots.tobytes()


def test_pymunk_has_it_by_a_formula_of_its_own():
    (x, y, *_, lost), _ = by_ode(0.6, AIR)  # still in its first flight
    run = simulate(thrown("pymunk", dt=5e-4, until=0.6))
    assert run.knots["position"][-1] == pytest.approx((x, y), abs=1e-6)
    assert run.ledger.air_loss == pytest.approx(lost, rel=1e-5)
    assert run.ledger.relative_residual < 1e-11
    assert not run.laws


def test_a_box_is_slowed_down_as_a_sphere_whose_disk_has_its_area():
    """By ODE, at order 2; it turns on as it did."""
    box, until = {"shape": "box", "size": [2.0 * R, 1.3 * R], "mass": M, "spin": True}, 0.5
    r = sqrt(2.0 * R * 1.3 * R / pi)

    def rate(_, s):
        k = relief(np.hypot(s[2], s[3]), r=r)
        return s[2], s[3], -k * s[2], -k * s[3] - G

    x, y, *_ = solve_ivp(rate, (0.0, until), [0.0, 2.0, 4.0, 2.0], rtol=1e-11, atol=1e-13).y[:, -1]
    stream = {"at": [0.0, 2.0], "velocity": [4.0, 2.0], "omega": 30.0}
    for engine in ("contact", "pymunk"):
        off = []
        for dt in (1e-3, 5e-4):
            run = simulate(thrown(engine, dt, until=until, particle=box, stream=stream))
            assert not run.laws
            last = run.ends()[1]
            assert last["omega"][0] == 30.0
            off.append(np.abs(last["position"][0] - (x, y)).max())
        assert off[0] < 5e-7
        assert off[0] > 3.5 * off[1]


def test_what_does_not_have_it_says_so():
    with pytest.raises(SceneError, match=r"air_density = 1\.2: must be 0 with the exact engine"):
        simulate(thrown("exact"))
    with pytest.raises(SceneError, match="air_density = -1"):
        thrown(air=-1.0)
    found = predict(sc.load("perpendicular", {"air_density": 1.2}))
    assert "air slows" in str(found.reason)


def test_a_recording_keeps_what_air_took(tmp_path):
    run = simulate(thrown())
    run.save(tmp_path / "air.npz")
    assert type(run).load(tmp_path / "air.npz").ledger == run.ledger
    assert run.measure("ledger.air_loss") == run.ledger.air_loss


@pytest.mark.parametrize("x", [-0.1, -0.099, -0.098])
def test_air_gives_nothing_back_where_a_blow_ends_a_step(x):
    """What it takes is known up to the instant of the blow: 1/2 m v² only falls in flight."""
    box = {"shape": "box", "size": [2.0 * R, 2.0 * R], "mass": M, "spin": True}
    run = simulate(sc.from_dict({
        "air_density": AIR, "gravity": 0.0, "particle": box,
        "stream": [{"at": [x, 0.0], "velocity": [3.0, 0.0], "interact": True, "restitution": 0.0},
                   {"at": [0.1, 0.0], "velocity": [-2.0, 0.0]}],
        "run": {"engine": "contact", "dt": 2e-3, "until": 0.1},
    }))  # fmt: skip
    assert not run.laws
    for knots in (run.track(i) for i in range(2)):
        assert np.diff(knots["entries"][:, 2]).min() >= 0.0
