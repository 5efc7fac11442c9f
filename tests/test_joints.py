"""Strings, rods, springs and pins: laws written out here, in the contact engine and in Pymunk."""

from math import atan2, cos, exp, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from chutelab import simulate, start
from chutelab.machine import build
from chutelab.results import Kind
from chutelab.scene import SceneError, from_dict
from shared import seeds

G = 9.81
BOTH = ("contact", "pymunk")


def scene(until, dt=1e-3, *, at=(0.0, 0.0), velocity=(0.0, 0.0), engine="contact", **tables):
    """Return a scene of small balls that do not turn, at once along a line or one at a point."""
    run = {"until": until, "max_time": until, "dt": dt, "engine": engine}
    stream = {"at": list(at), "velocity": list(velocity)} | tables.pop("stream", {})
    particle = {"radius": 0.01, "mass": 0.1, "spin": False} | tables.pop("particle", {})
    return {"particle": particle, "stream": stream, "run": run} | tables


def ledger_closes(recording):
    """Whether states and entries agree to 1e-11 of what was in play, in a run without a fault."""
    own = recording.ledger
    play = own.turned_over + max(abs(e) for e in (*own.potential, *own.spring))
    return not recording.laws and abs(own.residual) < 1e-11 * play


# Pendulums


ANGLE = radians(50.0)


def swing(kind, dt, angle=ANGLE, length=0.5, quarters=5, **tables):
    """Run a pendulum from rest for so many quarters of a period of 4 sqrt(I/(m g l)) K(sin²)."""
    gyration = tables.pop("gyration", 0.0)
    period = 4.0 * sqrt((gyration**2 + length**2) / (G * length)) * ellipk(sin(0.5 * angle) ** 2)
    at = (length * sin(angle), -length * cos(angle))
    hung = {kind: [{"from": [0.0, 0.0]}]}
    return simulate(scene(0.25 * quarters * period, dt, at=at, **hung, **tables))


@pytest.mark.parametrize("kind", ["string", "rod"])
def test_a_pendulum_keeps_its_length_energy_and_period(kind):
    errors = []
    for dt in (2e-3, 1e-3, 5e-4):
        run = swing(kind, dt)
        x, y = run.track(0)[-1]["position"]
        errors.append(abs(atan2(x, -y)))
        assert np.hypot(*run.track(0)["position"].T) == pytest.approx(0.5, rel=1e-13)
        assert ledger_closes(run)
        assert abs(run.ledger.restitution_loss) < 1e-15
    assert errors[-1] < 1e-5
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_a_disk_on_a_pin_is_a_physical_pendulum():
    # I/m = r²/2 about its centre, l² more about the pin.
    disk = {"shape": "disk", "radius": 0.2, "spin": True}
    runs = [swing("pin", dt, particle=disk, gyration=0.2 / sqrt(2.0)) for dt in (2e-3, 1e-3)]
    one, other = (abs(atan2(x, -y)) for x, y in (r.track(0)[-1]["position"] for r in runs))
    assert one / other == pytest.approx(4.0, rel=0.05)
    assert other < 1e-4
    knots = runs[0].track(0)
    # It turns as its centre goes round the pin.
    (x, y), (u, v) = knots["position"].T, knots["velocity"].T
    round_pin = (x * v - y * u) / 0.25
    assert knots["omega"] == pytest.approx(round_pin, abs=1e-4 * abs(knots["omega"]).max())
    assert all(map(ledger_closes, runs))


@pytest.mark.parametrize("engine", BOTH)
def test_a_box_that_is_released_turned_swings_about_its_pin(engine):
    """Let go level, after 1/4 of 4 K(1/2) sqrt((s²/6 + d²) / (g d)) it hangs, 90° further."""
    side, off = 0.05, 0.03
    until = sqrt((side**2 / 6.0 + off**2) / (G * off)) * ellipk(0.5)
    tables = scene(until, engine=engine, at=(off, 0.0), stream={"angle_deg": 30.0})
    box = {"shape": "box", "size": [side, side], "mass": 0.1, "spin": True}
    run = simulate(tables | {"particle": box, "pin": [{"from": [0.0, 0.0]}]})
    moved, end = run.at([run.track(0)["t"][-1]]), 1e-4 if engine == "contact" else 1e-3
    assert moved.position[0, 0] == pytest.approx([0.0, -off], abs=off * end)
    assert moved.angle[0, 0] == pytest.approx(radians(30.0 - 90.0), abs=end)


# Chipmunk tells how much a rod gives, not which way.
@pytest.mark.filterwarnings("ignore:LAW BROKEN, the ledger closes")
@pytest.mark.parametrize("engine", BOTH)
def test_what_is_thrown_against_its_joints_keeps_what_they_allow(engine):
    """Along a rod u and a tight string s impulses J solve ((1, u·s), (u·s, 2)) J = -m v."""
    places, speeds = np.array([[-0.05, 0.16], [0.05, 0.18]]), np.array([[-0.6, -0.7], [-0.2, 0.6]])
    top = np.array([0.0, 0.35])
    u, s = (d / hypot(*d) for d in (top - places[0], places[1] - places[0]))
    rod, string = np.linalg.solve(
        [[1.0, u @ s], [u @ s, 2.0]], [-u @ speeds[0], (speeds[1] - speeds[0]) @ s]
    )
    after = speeds + np.stack([rod * u + string * s, -string * s])
    assert string > 0.0
    rows = [{"at": list(at), "velocity": list(v), "interact": True}
            for at, v in zip(places.tolist(), speeds.tolist(), strict=True)]  # fmt: skip
    off = []
    for dt in (1e-3, 2.5e-4):
        tables = scene(0.01, dt, engine=engine, gravity=0.0) | {"stream": rows}
        joints = {"rod": [{"from": top.tolist(), "particle": 0}],
                  "string": [{"particle": 1, "other": 0}]}  # fmt: skip
        moved = simulate(tables | joints).at([1.5 * dt])
        off.append(np.abs(moved.velocity[0] - after).max())
    assert off[0] < 0.02
    assert off[1] < 0.3 * off[0]


@pytest.mark.slow
def test_after_a_hundred_seconds_a_pendulum_is_as_long_and_swings_as_high():
    run = simulate(scene(100.0, 1e-3, at=(0.3, -0.4), rod=[{"from": [0.0, 0.0]}]))
    knots = run.track(0)
    assert abs(np.hypot(*knots["position"].T) - 0.5).max() < 1e-9
    energy = 0.5 * (knots["velocity"] ** 2).sum(axis=1) + G * knots["position"][:, 1]
    assert np.ptp(energy) < 1e-12


def double_pendulum(until):
    """Where both balls are, by the textbook's equations of two equal masses and rods of 0.3 m."""
    length = 0.3

    def change(_, state):
        a, b, u, v = state
        d = a - b
        under = length * (3.0 - cos(2.0 * d))
        first = -G * 3.0 * sin(a) - G * sin(a - 2.0 * b)
        first -= 2.0 * sin(d) * length * (v * v + u * u * cos(d))
        then = 2.0 * sin(d) * (2.0 * u * u * length + 2.0 * G * cos(a) + v * v * length * cos(d))
        return u, v, first / under, then / under

    start = 0.5 * pi, 0.5 * pi, 0.0, 0.0
    a, b, *_ = solve_ivp(change, (0.0, until), start, rtol=1e-12, atol=1e-12).y[:, -1]
    one = length * np.array([sin(a), -cos(a)])
    return one, one + length * np.array([sin(b), -cos(b)])


def test_a_double_pendulum_is_of_order_two_and_keeps_its_energy():
    """Two balls, the second on the first, both let go level with the fixed end."""
    row = {"count": 2, "at": [0.3, 0.0], "to": [0.6, 0.0], "interact": True}
    rods = [{"from": [0.0, 0.0]}, {"other": 0, "particle": 1}]
    exact = np.array(double_pendulum(1.0))
    errors = []
    for dt in (2e-3, 1e-3):
        run = simulate(scene(1.0, dt, stream=row, rod=rods))
        errors.append(np.abs(run.ends()[1]["position"] - exact).max())
        assert ledger_closes(run)
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


PINS = [{"from": [0.2, 0.0]}, {"from": [0.45, 0.0], "other": 1}]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rod", "pin"])
def test_pymunk_has_the_same_at_its_order(kind):
    row = {"count": 2, "at": [0.3, 0.0], "to": [0.6, 0.0], "interact": True}
    disks = {"particle": {"shape": "disk", "radius": 0.1, "spin": True}, "pin": PINS}
    rods = {"rod": [{"from": [0.0, 0.0]}, {"other": 0, "particle": 1}]}
    coarse, fine, *others = (
        simulate(scene(1.0, dt, engine=engine, stream=row, **(rods if kind == "rod" else disks)))
        for engine in BOTH
        for dt in (2e-3, 1e-3)
    )
    ends = [run.ends()[1]["position"] for run in (coarse, fine, *others)]
    off = [np.abs(end - ends[1]).max() for end in ends]
    assert off[0] < 1e-3
    assert off[3] < 2e-3
    assert off[2] / off[3] > 1.8


# Strings


# Chipmunk takes back over some steps by what a jerk has stretched a string: a loss below zero.
@pytest.mark.filterwarnings("ignore:LAW BROKEN, no loss is negative")
@pytest.mark.parametrize("engine", BOTH)
def test_a_string_that_is_pulled_tight_takes_the_speed_along_it(engine):
    # Thrown across under its point, slack: (1, 0) 0.3 m below it, tight where it is (0.4, -0.3).
    string = [{"from": [0.0, 0.0], "length": 0.5}]
    run = simulate(
        scene(1.0, at=(0.0, -0.3), velocity=(1.0, 0.0), engine=engine, string=string, gravity=0.0)
    )
    rel = 1e-12 if engine == "contact" else 1e-3
    last = run.track(0)[-1]
    assert hypot(*last["velocity"]) == pytest.approx(0.6, rel=rel)
    assert hypot(*last["position"]) == pytest.approx(0.5, rel=max(rel, 1e-9))
    assert run.by_surface[-1, 1] == pytest.approx(0.05 * (1.0 - 0.6**2), rel=rel)
    assert ledger_closes(run) or engine == "pymunk"


# The same.
@pytest.mark.filterwarnings("ignore:LAW BROKEN, no loss is negative")
@pytest.mark.parametrize("length", [0.1, 0.1502, 0.1504])
def test_a_string_of_pymunk_throws_back_no_faster_than_its_step_asks(length):
    """At 1 m/s a step of h overshoots by up to h, which comes back within 0.02 s: h / 0.02."""
    for dt in (1e-3, 2.5e-4):
        string = [{"from": [-0.1, 0.0], "length": length}]
        flies = scene(0.2, dt, velocity=(1.0, 0.0), engine="pymunk", string=string, gravity=0.0)
        u, v = simulate(flies).track(0)["velocity"][-1]
        assert -dt / 0.02 < u <= 0.0
        assert v == 0.0


def test_a_string_goes_slack_where_weight_bends_the_way_more():
    # v² = v0² - 2 g L (1 - cos φ) falls to -g L cos φ: it leaves its circle there, on a parabola.
    length, speed = 0.5, 4.3
    run = simulate(
        scene(1.5, 5e-4, at=(0.0, -length), velocity=(speed, 0.0), string=[{"from": [0.0, 0.0]}])
    )
    knots = run.track(0)
    away = np.hypot(*knots["position"].T)
    cosine = (speed**2 - 2.0 * G * length) / (-3.0 * G * length)
    slack = np.argmax(away < length - 1e-6)
    assert knots["position"][slack - 1, 1] == pytest.approx(-length * cosine, abs=0.03 * length)
    t = knots["t"][slack:] - knots["t"][slack]
    free = away[slack:] < length - 1e-9
    falls = knots["position"][slack, 1] + knots["velocity"][slack, 1] * t - 0.5 * G * t * t
    until = np.argmin(free) if not free.all() else len(free)
    assert knots["position"][slack:, 1][:until] == pytest.approx(falls[:until], abs=1e-9)
    assert run.ledger.restitution_loss > 0.0
    assert ledger_closes(run)


def test_two_balls_on_one_string_snap_to_one_speed_along_it():
    # One at rest, one flies off with 1 m/s: tight, both have half of it along the string.
    stream = {"count": 2, "at": [0.0, 0.0], "to": [0.1, 0.0], "interact": True}
    string = [{"particle": 0, "other": 1, "length": 0.3}]
    base = from_dict(scene(0.5, stream=stream, string=string, gravity=0.0))
    built = build(base)
    built.releases.velocity.flags.writeable = True
    built.releases.velocity[:] = [(0.0, 0.0), (1.0, 0.0)]
    from chutelab.engines.contact import run

    record = run(built)
    assert record.ends()[1]["velocity"][:, 0] == pytest.approx([0.5, 0.5], rel=1e-12)
    assert record.by_surface[-1, 1] == pytest.approx(0.1 * (0.5 - 2.0 * 0.125), rel=1e-12)


def test_a_string_pulls_on_where_the_one_behind_it_goes_slack():
    """A row turns as one; the outermost is struck inwards, the others stay on their circles."""
    rate, apart, r = 3.0, 0.2, 0.01
    out = np.array([cos(0.1 * rate), sin(0.1 * rate)])
    on = np.array([-out[1], out[0]])
    rows = [{"at": [apart * k, 0.0], "velocity": [0.0, apart * k * rate]} for k in (1, 2, 3)]
    # It comes in at 2 m/s beside the outermost, which it meets after 0.1 s: they change speeds.
    speed = 3.0 * apart * rate * on - 2.0 * out
    at = (3.0 * apart + 2.0 * r) * out - 0.1 * speed
    rows.append({"at": at.tolist(), "velocity": speed.tolist()})
    strings = [{"particle": 1, "other": 0}, {"particle": 2, "other": 1}]
    tables = scene(0.25, gravity=0.0, rod=[{"particle": 0, "from": [0.0, 0.0]}], string=strings)
    rows = [row | {"interact": True, "restitution": 1.0} for row in rows]
    run = simulate(tables | {"stream": rows})
    assert run.contacts == 1
    assert ledger_closes(run)
    for particle in (0, 1):
        away = np.hypot(*run.track(particle)["position"].T)
        assert away == pytest.approx(apart * (particle + 1), abs=1e-12)
    assert atan2(*run.track(1)["position"][-1][::-1]) == pytest.approx(0.25 * rate, abs=1e-6)
    # Struck by what is as heavy, it has the other's speed inwards.
    assert run.track(2)["velocity"][-1] == pytest.approx(speed, abs=1e-3)


# Over a pulley


def atwood(until, heavy, light, places, dt=1e-3, *, down=0.0, **tables):
    """Two balls that pass each other on a string over the origin, the second let go downwards."""
    kinds = [{"name": name, "radius": 0.01, "mass": m} for name, m in (("a", heavy), ("b", light))]
    return simulate({
        "particle": kinds, "pair": [{"between": ["a", "b"], "meet": False}],
        "stream": [{"particle": kind, "at": at, "velocity": [0.0, -speed], "interact": True}
                   for kind, at, speed in zip("ab", places, (0.0, down), strict=True)],
        "string": [{"other": 1, "over": [0.0, 0.0]}],
        "run": {"until": until, "dt": dt, **tables.pop("run", {})}, **tables,
    })  # fmt: skip


def test_atwoods_machine_falls_as_it_should_and_bears_what_its_string_does_not():
    # a = g (m1 - m2)/(m1 + m2); at rest on a floor, that bears m1 g - T with T = m2 g.
    heavy, light = 0.3, 0.2
    a = G * (heavy - light) / (heavy + light)
    run = atwood(0.5, heavy, light, ([0.0, -1.0], [0.0, -1.3]))
    last = run.ends()[1]
    assert last["velocity"][:, 1] == pytest.approx([-0.5 * a, 0.5 * a], rel=1e-9)
    fell = 0.5 * a * 0.5**2
    assert last["position"] == pytest.approx(np.array([(0, -1 - fell), (0, -1.3 + fell)]), abs=1e-9)
    assert ledger_closes(run)
    floor = [{"name": "floor", "from": [-0.1, -1.01], "to": [0.1, -1.01]}]
    run = atwood(1.0, heavy, light, ([0.0, -1.0], [0.0, -1.3]), surface=floor, run={"loads": 1.0})
    assert run.impulses["force"][0, 0] == pytest.approx([0.0, -(heavy - light) * G], rel=5e-6)
    assert ledger_closes(run)


def swinging(until, dt):
    """Run an Atwood's machine of which the lighter ball swings; both of its ways, m, at knots."""
    run = atwood(until, 2.0, 1.0, ([-0.3, -2.0], [0.8, -1.0]), dt)
    one, other = run.track(0), run.track(1)
    _, i, j = np.intersect1d(one["t"], other["t"], return_indices=True)
    return run, np.hypot(*one["position"][i].T), np.hypot(*other["position"][j].T)


def test_a_ball_that_swings_on_atwoods_machine_goes_as_its_equations_say():
    """By Lagrange's in polar coordinates about the pulley, r and l - r, angles from below."""
    m1, m2 = 2.0, 1.0
    x = np.array([-0.3, 0.8]), np.array([-2.0, -1.0])
    (r1, r2), (p, q) = np.hypot(*x), np.arctan2(x[0], -x[1])
    whole = r1 + r2

    def change(_, state):
        r, p, q, v, u, w = state
        s = whole - r
        pull = m1 * (r * u * u + G * cos(p)) - m2 * (s * w * w + G * cos(q))
        return (v, u, w, pull / (m1 + m2), (-G * sin(p) - 2.0 * v * u) / r,
                (-G * sin(q) + 2.0 * v * w) / s)  # fmt: skip

    r, p, q = solve_ivp(change, (0.0, 1.0), (r1, p, q, 0.0, 0.0, 0.0), rtol=1e-12,
                        atol=1e-12).y[:3, -1]  # fmt: skip
    exact = np.array([(r * sin(p), -r * cos(p)), ((whole - r) * sin(q), -(whole - r) * cos(q))])
    errors = []
    for dt in (2e-3, 1e-3):
        run = swinging(1.0, dt)[0]
        errors.append(np.abs(run.ends()[1]["position"] - exact).max())
        assert ledger_closes(run)
    assert errors[1] < 1e-5
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.slow
def test_after_a_hundred_seconds_a_string_over_a_pulley_is_as_long():
    run, one, other = swinging(100.0, 1e-3)
    assert len(one) > 40
    assert np.abs(one + other - one[0] - other[0]).max() < 1e-9
    assert abs(run.ledger.residual) < 1e-11 * run.ledger.turned_over
    assert abs(run.ledger.restitution_loss) < 1e-9


def test_what_is_pulled_tight_over_a_pulley_shares_its_speed():
    """Nothing weighs; one flies off with 1 m/s: tight, both have m2/(m1 + m2) of it along it."""
    run = atwood(0.5, 0.2, 0.3, ([-0.3, -0.4], [0.0, -0.9]), gravity=0.0, down=1.0,
                 string=[{"other": 1, "over": [0.0, 0.0], "length": 1.6}])  # fmt: skip
    last, way = run.ends()[1], np.array([0.6, 0.8])
    assert last["velocity"] == pytest.approx(np.array([0.6 * way, (0.0, -0.6)]), rel=1e-12)
    assert last["position"][1] == pytest.approx([0.0, -1.1 - 0.3 * 0.6], rel=1e-12)
    assert run.ledger.restitution_loss == pytest.approx(0.15 - 0.25 * 0.36, rel=1e-12)
    assert ledger_closes(run)


def test_pymunk_has_no_string_over_a_pulley():
    with pytest.raises(SceneError, match="no string over a pulley"):
        atwood(1.0, 0.3, 0.2, ([0.0, -1.0], [0.0, -1.3]), run={"engine": "pymunk"})
    with pytest.raises(SceneError, match="a pulley"):
        simulate(atwood(0.1, 0.3, 0.2, ([0.0, -1.0], [0.0, -1.3])).machine.scene, engine="pymunk")


# Blows


def test_a_ball_hits_a_dumbbell_as_its_whole_mass():
    """A rod passes a blow on at once: ε = 1 against twice the mass, 1/3 of the speed comes back."""
    row = {"count": 3, "at": [-0.2, 0.0], "to": [0.2, 0.0], "interact": True}
    tables = {"rod": [{"particle": 1, "other": 2}], "gravity": 0.0}
    stream = row | {"restitution": 1.0, "friction": 0.0}
    built = build(from_dict(scene(0.5, stream=stream, **tables)))
    built.releases.velocity.flags.writeable = True
    built.releases.velocity[:] = [(1.0, 0.0), (0.0, 0.0), (0.0, 0.0)]
    from chutelab.engines.contact import run

    last = run(built).ends()[1]
    third = 1.0 / 3.0
    assert last["velocity"][:, 0] == pytest.approx([-third, 2 * third, 2 * third], rel=1e-10)


def test_a_dumbbell_that_lands_on_one_end_turns_up_the_other():
    """Held by a level rod, one end strikes the floor: its speed is that of a free end there.

    A rod without mass passes nothing across it: the struck ball alone turns back.
    """
    stream = {"count": 2, "at": [0.0, 0.2], "to": [0.3, 0.2], "interact": True, "restitution": 0.5}
    floor = [{"name": "floor", "from": [-0.1, 0.0], "to": [0.1, 0.0], "restitution": 0.5}]
    rod = [{"particle": 0, "other": 1}]
    run = simulate(scene(0.3, stream=stream, surface=floor, rod=rod))
    struck = run.events[run.events["surface"] == 0][0]
    fall = -sqrt(2.0 * G * 0.19)
    assert struck["velocity_before"][1] == pytest.approx(fall, rel=1e-9)
    assert struck["velocity_after"][1] == pytest.approx(-0.5 * fall, rel=1e-9)
    assert ledger_closes(run)


def test_a_cart_of_two_rolls_down_as_one():
    """Two balls on a rod slide down a slope of 30° without friction: g sin α, and stay on it."""
    slope = [{"name": "slope", "from": [-1.0, 0.0], "to": [2.0, -3.0 * sqrt(1.0 / 3.0)],
              "restitution": 0.0, "friction": 0.0}]  # fmt: skip
    n = np.array([0.5, sqrt(0.75)])
    along = np.array([sqrt(0.75), -0.5])
    start = np.array([-1.0, 0.0]) + 0.3 * along + 0.01 * n
    stream = {"count": 2, "at": start.tolist(), "to": (start + 0.1 * along).tolist(),
              "interact": True, "restitution": 0.0, "friction": 0.0}  # fmt: skip
    run = simulate(scene(0.5, stream=stream, surface=slope, rod=[{"particle": 0, "other": 1}]))
    last = run.ends()[1]["position"]
    assert (last - start) @ along == pytest.approx(np.array([0.0, 0.1]) + 0.125 * G * 0.5, rel=1e-4)
    assert np.hypot(*(last[1] - last[0])) == pytest.approx(0.1, rel=1e-12)
    assert not run.laws


# Springs


@pytest.mark.parametrize("kind", ["string", "rod", "spring", "pin"])
def test_what_leaves_the_scene_one_after_the_other_leaves_no_energy_over(kind):
    """Until the one has left, a joint's pull is that of both; then the other flies on freely."""
    more = {"spring": {"stiffness": 5.0, "damper": 0.1}, "pin": {"from": [0.15, 0.1]}}.get(kind, {})
    joined = {
        "particle": [{"mass": 0.1, "radius": 0.04, "spin": True}],
        "stream": [
            {"at": [0.0, 0.0], "velocity": [0.4, 0.5], "interact": True},
            {"at": [0.3, 0.2], "velocity": [0.0, 0.0]},
        ],
        kind: [{"particle": 0, "other": 1, **more}],
        "run": {"until": 2.0, "engine": "contact"},
    }
    recording = simulate(joined)
    assert recording.ended_by("exit").all()
    first, last = np.sort(recording.ends()[1]["t"])
    assert last > first + 3e-3
    assert ledger_closes(recording)


@pytest.mark.parametrize("engine", ["contact", pytest.param("pymunk", marks=pytest.mark.slow)])
def test_a_spring_with_a_damper_swings_as_its_equation_says(engine):
    k, m, c = 40.0, 0.1, 0.3
    decay = 0.5 * c / m
    turn = sqrt(k / m - decay**2)
    place = 0.5 + 0.1 * exp(-decay) * (cos(turn) + decay / turn * sin(turn))
    spring = [{"from": [0.0, 0.0], "length": 0.5, "stiffness": k, "damper": c}]
    errors, lost = [], []
    for dt in (2e-3, 1e-3):
        run = simulate(scene(1.0, dt, at=(0.6, 0.0), engine=engine, spring=spring, gravity=0.0))
        errors.append(abs(run.ends()[1]["position"][0, 0] - place))
        ledger = run.ledger
        assert ledger.spring[0] == pytest.approx(0.5 * k * 0.01, rel=1e-2)
        lost.append(ledger.kinetic[1] + ledger.spring[1] + ledger.damper_loss - ledger.spring[0])
        if engine == "contact":
            assert ledger_closes(run)
            assert abs(lost[-1]) < 1e-14
    assert errors[1] < 5e-4
    assert errors[0] / errors[1] > (3.9 if engine == "contact" else 1.7)
    assert abs(lost[1]) < 1e-5


def test_a_stiff_spring_is_stable_at_any_step():
    """1 MN/m on 0.1 kg turns 3,162 rad/s: at 1 ms its energy is what it was all the same."""
    spring = [{"from": [0.0, 0.0], "length": 0.5, "stiffness": 1e6}]
    run = simulate(scene(0.5, at=(0.5001, 0.0), spring=spring, gravity=0.0))
    own = run.ledger
    assert own.kinetic[1] + own.spring[1] == pytest.approx(0.005, rel=1e-9)
    assert ledger_closes(run)


# Random machines


def machine_of_joints(seed):
    """Return a row of disks over floor, wall and peg, joined as drawn, which fall."""
    rng = np.random.default_rng(seed)
    count, apart = int(rng.integers(2, 7)), rng.uniform(0.05, 0.12)
    meets = {"restitution": float(rng.choice([0.0, 0.5, 0.9])),
             "friction": float(rng.choice([0.0, 0.3]))}  # fmt: skip
    tables = {
        "particle": {"shape": "disk", "radius": 0.02, "spin": bool(rng.integers(2))},
        "stream": {"count": count, "to": [apart * (count - 1), 0.5], "interact": True} | meets,
        "surface": [
            {"name": "floor", "from": [-3.0, 0.0], "to": [3.0, 0.0]} | meets,
            {"name": "wall", "from": [1.0, 0.0], "to": [1.3, 1.0]} | meets,
            {"name": "peg", "center": [0.2, 0.2], "radius": 0.05, "from_deg": 0.0, "to_deg": 360.0}
            | meets,
        ],
    }
    for i in range(count):
        kind = str(rng.choice(["string", "rod", "spring", "pin", "none"]))
        row = {"particle": i}
        if i == 0 or rng.random() < 0.2:
            row["from"] = [apart * i, 0.53 if kind == "pin" else 0.8]
        elif kind == "pin":
            row |= {"from": [apart * (i - 0.5), 0.5], "other": i - 1}
        else:
            row["other"] = i - 1
        if kind == "spring":
            row |= {"stiffness": float(10.0 ** rng.uniform(1, 4)),
                    "damper": float(rng.choice([0.0, 0.5]))}  # fmt: skip
        if kind != "none":
            tables.setdefault(kind, []).append(row)
    return scene(1.5, at=(0.0, 0.5), velocity=rng.normal(size=2).tolist(), **tables)


@pytest.mark.parametrize("seed", seeds(6, 60))
def test_random_machines_keep_the_laws(seed):
    run = simulate(machine_of_joints(seed))
    assert not run.laws
    own = run.ledger
    play = own.turned_over + max(abs(e) for e in (*own.potential, *own.spring))
    assert abs(own.residual) < 1e-9 * play


def test_what_is_pushed_by_hand_keeps_its_rod():
    """A push along the circle does the work force times way; one along the rod does none."""
    run = start(scene(1.0, at=(0.0, -0.5), rod=[{"from": [0.0, 0.0]}], gravity=0.0))
    run.push(0, (0.0, -5.0))
    run.step(0.1)
    assert run.positions[0] == pytest.approx([0.0, -0.5], abs=1e-15)
    run.push(0, (0.2, 0.0))
    run.step(0.1)
    run.push(0, (0.0, 0.0))
    run.step(0.1)
    assert np.hypot(*run.positions[0]) == pytest.approx(0.5, rel=1e-13)
    ledger = run.recording.ledger
    assert ledger.push_work == pytest.approx(ledger.kinetic[1], rel=1e-11)
    # 0.2 N for 0.1 s on 0.1 kg: 0.2 m/s, along a way of 10 mm.
    assert ledger.push_work == pytest.approx(0.2 * 0.01, rel=1e-3)


def test_what_folds_on_a_short_arm_spins_up_and_down_again_by_the_same_energy():
    """1/2 m v² + 1/2 I ω² + m g y stays, at 100 rad/s too, where a usual step finds no pull."""
    boxes = [{"name": name, "shape": "box", "size": [size, size], "mass": mass, "spin": True}
             for name, size, mass in (("heavy", 0.02, 0.1), ("light", 0.023, 0.01))]  # fmt: skip
    run = simulate({
        "particle": boxes, "run": {"until": 0.7},
        "stream": [
            {"particle": "heavy", "at": [-0.3, 0.145], "velocity": [0.0, 0.0], "interact": True},
            {"particle": "light", "at": [-0.15, 0.281], "velocity": [0.0, 0.0]},
        ],
        "pin": [{"particle": 0, "from": [-0.344, 0.1], "other": 1}],
        "string": [{"particle": 1, "from": [0.13, 0.525]}],
    }, engine="contact")  # fmt: skip
    assert ledger_closes(run)
    assert run.unsolved.max() < 1e-8
    assert run.steps < 1400


# A cradle, and what is refused


def test_the_cradle_hands_on_a_blow_ten_times_nearer_than_its_scene_allows_pymunk():
    run = simulate("cradle")
    assert run.engine == "contact"
    assert run.contacts == 16
    assert run.ledger.kinetic[1] < 5e-5
    assert run.ledger.restitution_loss < 1e-6
    assert ledger_closes(run)


def test_what_no_engine_joins_is_refused_by_its_key():
    for short in (0.7, 1e-8):
        hung = {"string": [{"from": [0.0, 0.0], "length": 0.3 * (1.0 - short)}]}
        with pytest.raises(SceneError, match="a string is shorter"):
            simulate(scene(1.0, at=(0.3, 0.0), **hung))
    # Short by rounding of a length that was typed.
    hung = {"string": [{"from": [0.0, 0.0], "length": 0.3 * (1.0 - 1e-10)}]}
    assert not simulate(scene(0.01, at=(0.3, 0.0), **hung)).laws
    two = {"stream": {"count": 2, "at": [0.3, 0.0], "to": [0.6, 0.0]}}
    with pytest.raises(SceneError, match="do not meet"):
        simulate(scene(1.0, **two, string=[{"from": [0.0, 0.0]}]))
    with pytest.raises(SceneError, match="interact"):
        from_dict(scene(1.0, **two, rod=[{"other": 1}]))


@pytest.mark.parametrize("slack", [1e-4, pytest.param(1e-3, marks=pytest.mark.slow)])
def test_a_rope_bridge_hangs_between_two_fixed_points(slack):
    """Of 20 balls, by `slack` of each string longer than its span: no string gets longer.

    A span of 1 m with the slack s sags by sqrt(3 s / 8) m as a parabola, 6 mm at the least here;
    what swings has fallen by at most twice as much. Tracks are off by two hops, g dt² / 8 each, at
    both ends of a string. (A step whose pull is no number is halved.)
    """
    count, x = 20, np.linspace(-0.5, 0.5, 22)
    length = (1.0 + slack) / (count + 1)
    ends = [{"particle": 0, "from": [-0.5, 0.0]}, {"particle": count - 1, "from": [0.5, 0.0]}]
    inner = [{"particle": n, "other": n - 1} for n in range(1, count)]
    run = simulate({
        "particle": {"radius": 0.02, "mass": 0.05, "spin": True},
        "surface": [{"name": "floor", "from": [-1.0, -0.6], "to": [1.0, -0.6]}],
        "string": [{**one, "length": length} for one in (*ends, *inner)],
        "stream": [{"at": [at, 0.0], "velocity": [0.0, 0.0], "interact": True} for at in x[1:-1]],
        "run": {"until": 0.3},
    }, engine="contact")  # fmt: skip
    assert not run.laws
    places = run.at(np.linspace(0.0, 0.299, 100)).position
    fixed = np.broadcast_to([[[-0.5, 0.0]], [[0.5, 0.0]]], (2, len(places), 2))
    rope = np.concatenate([fixed[0][:, None], places, fixed[1][:, None]], axis=1)
    assert np.hypot(*np.diff(rope, axis=1).T).max() < length + 4.0 * 1.23e-6
    sag = (3.0 * slack / 8.0) ** 0.5
    assert 0.5 * sag < -rope[..., 1].min() < 2.0 * sag


def test_what_is_released_beside_a_pendulum_is_in_the_sums_at_once():
    """K + U stays what it was at the releases, but for 1e-10 J by cubics between two steps."""
    lying = {"velocity": [0.0, 0.0], "interact": True}
    tables = scene(0.1, at=(-0.35, 0.31), rod=[{"from": [-0.05, 0.31], "particle": 0}])
    tables["surface"] = [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0]}]
    tables["stream"] = [{**tables["stream"], "interact": True}] + [
        {"at": [x, 0.01], **lying} for x in (0.0, 0.1, 0.2)
    ]
    recording = simulate(tables)
    found = recording.energy_at(np.linspace(0.0, 0.01, 41))
    total = found["kinetic"] + found["potential"]
    assert total == pytest.approx(0.1 * G * (0.31 + 3 * 0.01), abs=1e-9)
    assert np.abs(found["residual"]).max() < 1e-12


@pytest.mark.parametrize("joint", [{}, {"string": {"length": 5.0}}, {"rod": {}}])
def test_an_impact_turns_a_disk_with_rolling_friction_whatever_joint_it_has(joint):
    """Its moment is f r J about the centre, on which strings and rods act: ω' = ω - f r J / I.

    The wall is smooth; before, the disk kept its 80 rad/s if it had a joint, even a slack one.
    """
    r, m, f, spin = 0.01, 0.05, 0.1, 80.0
    tables = {
        "particle": {"radius": r, "mass": m, "spin": True, "rolling_friction": f},
        "surface": [{"name": "wall", "from": [0.0, -1.0], "to": [0.0, 1.0], "restitution": 0.5,
                     "friction": 0.0}],
        "stream": {"at": [-0.06, 0.0], "velocity": [1.0, 0.0], "omega": spin, "interact": True},
        "gravity": 0.0,
        "run": {"until": 0.1},
    }  # fmt: skip
    for kind, keys in joint.items():
        tables[kind] = [{"particle": 0, "from": [-0.06, 0.4], **keys}]
    events = simulate(tables, engine="contact").events
    (blow,) = events[events["kind"] == Kind.IMPACT][:1]
    turned = f * r * blow["normal_impulse"] / (0.5 * m * r**2)
    assert turned > 25.0
    assert blow["omega_after"] == pytest.approx(spin - turned, rel=1e-12)
