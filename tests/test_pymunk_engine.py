"""The Pymunk engine against the exact one and against laws written out here."""

from math import sqrt

import numpy as np
import pymunk
import pytest

import chutelab
from chutelab.engines.exact import run as exact
from chutelab.engines.pymunk import run
from chutelab.machine import build
from chutelab.results import Kind
from chutelab.results.ledger import ledger
from chutelab.scene import from_dict
from machines import face

LONE = ("perpendicular", "perpendicular-fast", "inclined-20", "inclined-40", "inclined-60",
        "low-speed", "belt-landing")  # fmt: skip


def machine(name, *overrides):
    return build(chutelab.load(name, overrides))


def final(recording):
    knot = recording.knots[-1]
    return np.array([knot["t"], *knot["position"], *knot["velocity"]])


def off(recording, reference):
    return float(np.abs(final(recording) - final(reference)).max())


@pytest.mark.parametrize("name", LONE)
@pytest.mark.parametrize("dt", ["0.001", "0.016666666"])
def test_blows_are_those_of_the_exact_engine(name, dt):
    m = machine(name, 'run.until="landed"', f"run.dt={dt}")
    got, want = run(m), exact(m)
    assert got.engine == "pymunk"
    kinds = [Kind.RELEASE, Kind.SEPARATION, Kind.IMPACT, Kind.LANDING]
    a, b = got.select(*kinds), want.select(*kinds)
    assert a["kind"].tolist() == b["kind"].tolist()
    for field in ("t", "position", "velocity_before", "velocity_after", "normal_impulse"):
        np.testing.assert_allclose(a[field], b[field], rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(got.by_surface, want.by_surface, rtol=1e-9, atol=1e-12)
    assert ledger(got).relative_residual < 1e-12


CASES = {
    "grips, slips, leaves": ("slip", []),
    "slips at once": ("slip", ["incoming.friction=0.2", "incoming.speed=1.0"]),
    "no friction": ("slip", ["incoming.friction=0.0", "incoming.speed=1.0"]),
    "rolls": ("slip", ["particle.spin=true", "incoming.friction=0.8", "incoming.speed=1.0"]),
}


@pytest.mark.parametrize(
    "case",
    [
        "grips, slips, leaves",
        pytest.param("rolls", marks=pytest.mark.slow),
        pytest.param("slips at once", marks=pytest.mark.slow),
        pytest.param("no friction", marks=pytest.mark.slow),
    ],
)
def test_a_ride_round_the_pulley_converges(case):
    name, overrides = CASES[case]
    want = exact(machine(name, *overrides))
    coarse, fine = (
        off(run(machine(name, *overrides, f"run.dt={dt}")), want) for dt in (1e-3, 2.5e-4)
    )
    assert coarse < 1e-4
    assert fine < 1e-5
    order = np.log(coarse / fine) / np.log(4.0)
    assert order > 1.0 or coarse < 1e-6


def dropped(at, velocity, *surfaces, **tables):
    particle = {"radius": 0.01} | tables.pop("particle", {})
    stream = {"at": list(at), "velocity": list(velocity)} | tables.pop("stream", {})
    given = {"particle": particle, "stream": stream, "surface": list(surfaces), **tables}
    return build(from_dict(given))


@pytest.mark.parametrize("align", [True, False])
def test_end_rollers_drive_as_their_faces_do(align):
    # A ball on the rim of a belt meets v (n_y, -n_x): the tangential impulse of a gripping rim is
    # J_t = -m (v·t - speed), t = (n_y, -n_x), for the normal n of the contact.
    n = np.array([-0.6, 0.8])
    belt = face("belt", (0.0, 0.0), (1.0, 0.0), friction=100.0, restitution=0.0, speed=1.5)
    m = dropped(
        (0.1 + 0.2 * 3.0) * n, -3.0 * n, belt, gravity=0.0, particle={"radius": 0.1, "mass": 2.0},
        run={"until": 0.3, "align": align},
    )  # fmt: skip
    hit = run(m).select(Kind.IMPACT)[0]
    assert hit["t"] == pytest.approx(0.2, abs=1e-12 if align else 1.1e-3)
    assert hit["normal_impulse"] == pytest.approx(2.0 * 3.0, rel=1e-12)
    assert hit["tangential_impulse"] == pytest.approx(2.0 * 1.5, rel=1e-9)


def test_steps_all_alike_converge_in_order_one():
    want = exact(machine("perpendicular"))
    errors = []
    for dt in (4e-3, 5e-4):
        got = run(machine("perpendicular", "run.align=false", f"run.dt={dt}"))
        errors.append(off(got, want))
    assert errors[-1] < 1e-2
    assert errors[-1] < 0.25 * errors[0]


@pytest.mark.parametrize("align", ["true", "false"])
@pytest.mark.parametrize(("low", "high"), [(0.5, 9.0), (0.1, 0.5)])
def test_a_wall_ends_the_ride_on_a_belt_that_holds(low, high, align):
    # The centre is r above the belt. A wall from low·r to high·r is met with its face, or with its
    # upper end if that is lower than the centre.
    r = 0.02
    m = machine(
        "belt-landing", f"particle.radius={r}", f"run.align={align}", "run.until=0.4",
        f"surface=[{{name='wall', from=[-0.3, {0.1 + low * r}], to=[-0.3, {0.1 + high * r}]}}]",
    )  # fmt: skip
    got = run(m)
    x = -0.3 - r * sqrt(1.0 - max(1.0 - high, 0.0) ** 2)
    left = got.select(Kind.SEPARATION, surface="incoming")[0]
    belt = m.releases
    assert left["position"] == pytest.approx([x, 0.1 + r], abs=1e-13)
    assert left["t"] == pytest.approx((x - belt.position[0, 0]) / belt.velocity[0, 0], abs=1e-13)
    hit = got.select(Kind.IMPACT, surface="wall")[0]
    assert hit["t"] == pytest.approx(left["t"], abs=1e-10 if align == "true" else 2e-3)


def test_a_lone_run_far_away_is_that_of_here_moved_there():
    def fall(x):
        floor = {"name": "floor", "from": [x - 1.0, 0.0], "to": [x + 1.0, 0.0]}
        return chutelab.simulate({
            "particle": {"radius": 0.01, "mass": 0.1}, "surface": [floor],
            "stream": {"at": [x, 0.5], "velocity": [0.5, 0.0]}, "run": {"until": 1.0},
        }, engine="pymunk")  # fmt: skip

    here, there = fall(0.0), fall(4096.0)
    assert len(here.select("impact")) > 1
    for name in ("knots", "events"):
        moved = getattr(here, name)["position"] + [4096.0, 0.0]
        assert getattr(there, name)["position"] == pytest.approx(moved, abs=1e-12)


def test_the_bits_do_not_depend_on_where_shapes_lie_in_memory():
    # Chipmunk keeps contacts by the addresses of their shapes: other ones alive move the next.
    m, alive = machine("stream", "stream.count=5", "run.until=1.0"), []
    first = run(m)
    for n in range(2):
        alive += [pymunk.Circle(pymunk.Body(1.0, 1.0), 1.0) for _ in range(37 * n + 1)]
        again = run(m)
        for name in ("knots", "events", "by_surface"):
            assert getattr(again, name).tobytes() == getattr(first, name).tobytes()


def stepped(surface, *places, velocity=(0.0, 0.0)):
    """A run in steps that are all alike of disks of 10 mm from some places."""
    streams = [
        {"name": f"s{n}", "at": place, "velocity": velocity, "interact": len(places) > 1}
        for n, place in enumerate(places)
    ]
    tables = {"particle": {"radius": 0.01}, "surface": [surface], "stream": streams}
    run_table = {"until": 0.4, "align": False}
    return chutelab.simulate({**tables, "run": run_table}, engine="pymunk")


@pytest.mark.parametrize(("share", "waits"), [(5e-10, False), (5e-8, True)])
def test_disks_that_touch_are_released_together_and_none_inside_another(share, waits):
    floor = face("floor", (-1.0, 0.0), (1.0, 0.0))
    begins = stepped(floor, (0.0, 1.0), (0.02 - share * 0.01, 1.0)).select("release")["t"]
    assert (begins[0], begins[1] > 0.0) == (0.0, waits)


def test_a_ride_of_some_steps_ends_in_a_separation_and_a_bounce_in_none():
    """0.2 m at 2 m/s are 100 steps; the table ends at x = 0."""
    table = face("table", (-1.0, 0.0), (0.0, 0.0), friction=0.0, restitution=1.0)
    left = stepped(table, (-0.2, 0.01), velocity=(2.0, 0.0)).select("separation")
    assert left["position"] == pytest.approx(np.array([[0.0, 0.01]]), abs=1e-12)
    bounced = stepped(table, (-0.5, 0.06))
    assert len(bounced.select("impact")) == 2
    assert not len(bounced.select("separation"))


# Bounds of a lone particle: what counts, and what is rounding.


def sliding(turn):
    """At 1 m/s over a joint of two smooth floors, of which the second one rises by an angle."""
    floors = [face("a", (-1.0, 0.0), (0.0, 0.0)), face("b", (0.0, 0.0), (1.0, turn))]
    smooth = [floor | {"friction": 0.0, "restitution": 0.5} for floor in floors]
    return dropped((-0.02, 0.01), (1.0, 0.0), *smooth, run={"until": 0.04})


def on_a_slope(rise, friction=0.0, **run_table):
    floor = face("slope", (-1.0, rise), (1.0, -rise), friction=friction, restitution=0.0)
    size = np.hypot(1.0, rise)
    return dropped(0.01 / size * np.array([rise, 1.0]), (0.0, 0.0), floor, run=run_table)


def touching(speed, radius=0.01, gravity=0.0):
    """Into a small floor that it touches."""
    floor = face("floor", (-2.0 * radius, 0.0), (2.0 * radius, 0.0), friction=0.0, restitution=0.5)
    return dropped(
        (0.0, radius), (0.0, -speed), floor, gravity=gravity, particle={"radius": radius},
        run={"until": 0.01},
    )  # fmt: skip


def in_a_ring(speed, size=1.0, friction=0.0, **run_table):
    """Inside a ring at its lowest place, where nothing weighs."""
    ring = {"name": "ring", "center": [0.0, 0.0], "radius": size, "restitution": 0.0}
    return dropped(
        (0.0, 0.1 - size), (speed, 0.0), ring | {"friction": friction}, gravity=0.0,
        particle={"radius": 0.1}, run=run_table,
    )  # fmt: skip


def rebound(height):
    """Speed (m/s) from which ε = 0.5 lifts a ball of 1 m by some of its hairs, of 2e-11 m."""
    return sqrt(2.0 * 9.81 * height * 2e-11) / 0.5


SETTLES = {"until": "settled", "max_time": 0.02}


@pytest.mark.parametrize(
    ("given", "told"),
    [
        # A bend of 1e-5 rad is a blow, one of 1e-7 is gone over.
        (sliding(1e-5), ["IMPACT", "SEPARATION", "IMPACT"]), (sliding(1e-7), ["SLIP"]),
        # A slope of 1e-5 is slid down, one of 3e-7 is level.
        (on_a_slope(1e-5, **SETTLES), []), (on_a_slope(3e-7, **SETTLES), ["STICK", "SETTLE"]),
        # Friction of 1e-8 more than it takes holds, of 1e-10 more it is used up.
        (on_a_slope(0.5 * (1.0 - 1e-8), 0.5, until=0.01), ["STICK"]),
        (on_a_slope(0.5 * (1.0 - 1e-10), 0.5, until=0.01), []),
        # 1e-11 m/s into a surface is a blow, 2e-13 m/s is rounding.
        (touching(1e-11), ["IMPACT"]), (touching(2e-13), ["SEPARATION"]),
        # Where nothing weighs, in a ring a load of 1e-11 of the momentum counts, so that it goes
        # round; along a floor there is none.
        (in_a_ring(1e-6, friction=0.5, until=1e-4, dt=1e-5), []),
        (dropped((-0.3, 0.01), (2.0, 0.0), face("floor", (-2.0, 0.0), (2.0, 0.0)), gravity=0.0,
                 run={"until": 0.02}), []),
    ],
)  # fmt: skip
def test_what_is_rounding_is_no_event(given, told):
    assert [Kind(kind).name for kind in run(given).events["kind"]][1:] == told


@pytest.mark.parametrize(("height", "lifts"), [(10.0, True), (0.5, False)])
def test_a_bounce_of_some_hairs_is_one_and_a_lower_one_is_rest(height, lifts):
    hit = run(touching(rebound(height), radius=1.0, gravity=9.81)).events[1]
    assert (hit["velocity_after"][1] > 0.0) == lifts


@pytest.mark.parametrize(("slip", "at"), [(0.0, 0.0), (1e-9, 1e-3)])
def test_in_little_gravity_it_is_the_rim_that_is_off_by_a_hair(slip, at):
    """What rolls at 1 m/s rolls but for 4e-11 m/s of rounding; what slips grips within a step."""
    floor = face("floor", (-0.1, 0.0), (100.0, 0.0), friction=0.5, restitution=0.0)
    m = dropped(
        (0.0, 0.01), (1.0, 0.0), floor, gravity=1e-3, particle={"radius": 0.01, "spin": True},
        stream={"omega": -(1.0 - slip) / 0.01}, run=SETTLES,
    )  # fmt: skip
    assert run(m).select(Kind.SETTLE)["t"].tolist() == [at]


def test_a_ride_on_a_curve_takes_two_steps_a_radius_and_few_knots():
    """Long steps are half a radius. A knot's parabola is left by 1e-4 r: v³/ρ² (1/6 + 2/27) τ³."""
    coarse = run(in_a_ring(1.0, until=5.0, dt=0.1))
    assert coarse.steps == pytest.approx(4 * 5.0 / (0.5 * 0.1), rel=0.05)
    fine = run(in_a_ring(1.0, until=2.0, dt=0.005))
    jerk = 1.0**3 / 0.9**2
    every = (1e-4 * 0.1 / (jerk * (1.0 / 6.0 + 2.0 / 27.0))) ** (1.0 / 3.0)
    assert len(fine.knots) == pytest.approx(2.0 / every, rel=0.25)


def test_a_contact_ends_within_a_hundred_thousandth_of_a_step():
    """Off the end of a rough table: 20 mm from 1 m/s on, at -µ g; and over a post, in few steps."""
    table = face("table", (-1.0, 0.0), (0.0, 0.0), friction=0.3, restitution=0.0)
    left = run(dropped((-0.02, 0.01), (1.0, 0.0), table, run={"until": 0.03, "dt": 0.004}))
    slows = 0.3 * 9.81
    t = (1.0 - sqrt(1.0 - 2.0 * slows * 0.02)) / slows
    assert left.select(Kind.SEPARATION)["t"] == pytest.approx([t], abs=5e-8)
    post = face("post", (0.0, 0.0), (0.0, -1.0), friction=0.0, restitution=0.0)
    assert run(dropped((0.001, 0.2), (0.0, 0.0), post, run={"until": 0.5})).steps < 600
