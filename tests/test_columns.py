"""Tall columns and silos: no solve and no blow makes energy, however contacts wedge."""

from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from chutelab.engines.contact import run
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.results import Kind, laws
from chutelab.results.ledger import ledger
from chutelab.scene import from_dict
from columns import G, column

ROOT = Path(__file__).parents[1]


def check(seed, count):
    """No law is broken, and what solves gained, which no law allows for, is rounding."""
    found = run(build(from_dict(column(seed, count))))
    assert laws.judge(found) == ()
    assert found.gained <= 1e-12 * ledger(found).turned_over


@pytest.mark.parametrize("seed", [2, 8, 16, 20])
def test_a_column_makes_no_energy(seed):
    check(seed, 60)


@pytest.mark.parametrize(
    ("seed", "count", "until"),
    [
        (8, 120, None),
        pytest.param(9, 150, None, marks=pytest.mark.slow),
        # Belts press some 300 disks on a floor, wedged as they are.
        pytest.param(1, 1379, 1.25, marks=pytest.mark.slow),
    ],
)
def test_what_jams_is_not_pressed_into_each_other(seed, count, until):
    """By 5 % of the lesser radius, the promise of the engine, at most."""
    scene = column(seed, count)
    scene["run"]["until"] = until or scene["run"]["until"]
    found = run(build(from_dict(scene)))
    i, j = np.triu_indices(count, 1)
    radii, deepest = np.broadcast_to(found.machine.particle.radius, count), 0.0
    for places in found.at(np.linspace(0.0, found.knots["t"].max(), 60))[0]:
        depth = radii[i] + radii[j] - np.hypot(*(places[i] - places[j]).T)
        deepest = max(deepest, np.nanmax(depth / np.minimum(radii[i], radii[j]), initial=0.0))
    assert deepest < 0.05
    assert laws.judge(found) == ()


def test_belts_that_lock_a_column_do_not_press_it_together():
    """At 10 g, by two slow belts: they stall, and pay for some weights, not for millions.

    Per second F v, with v the belts' speed and F the sum of all frictions on them.
    """
    scene, g = column(82, 30), 10.0 * G
    scene["gravity"] = g
    # The column locks at 1.2 s. If gaps that a belt closes slowly were good enough, 2e6 would be
    # paid by 1.5 s.
    scene["run"]["until"] = 1.5
    found = run(build(from_dict(scene)))
    assert laws.judge(found) == ()
    weight, v = found.count * found.particle.mass * g, scene["surface"][0]["speed"]
    assert found.by_surface[:, 0].sum() < 100.0 * weight * v * scene["run"]["until"]


LONG = pytest.mark.skip(
    reason="1,379 disks that belts press on a floor: 42 % of its 4.2 s take 400 s of a processor;"
    " its first 1.25 s are above"
)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [pytest.param(n, marks=LONG) if n == 1 else n for n in range(20)])
def test_twenty_columns_and_silos_make_no_energy(seed):
    check(seed, 1000 + 379 * seed % 1001)


@pytest.mark.slow
def test_where_blows_make_energy_a_law_tells(with_fault):
    """The planted fault: two disks part 1.2 times as fast as they met."""
    with_fault("impacts.c", "-c.rest * u[0]", "-(c.two ? 1.2 : c.rest) * u[0]")
    spoilt = [run(build(from_dict(column(seed, 60)))) for seed in (5, 9, 13, 16)]
    told = [{broken.law for broken in laws.judge(found)} for found in spoilt]
    assert all(laws.LOSSES in one or laws.ENERGY in one for one in told)


@pytest.mark.parametrize(
    ("engine", "e"),
    [
        ("contact", 0.0),
        ("contact", 0.4),
        ("contact", 1.0),
        pytest.param("pymunk", 0.4, marks=pytest.mark.slow),
    ],
)
def test_one_of_two_disks_may_leave_faster_than_both_came(engine, e):
    """Both have the speed V = 1: why in a column a disk may be faster than a free fall.

    One has A, the other B, and they meet along the normal n. Then B keeps its part along the
    surface, and its normal part becomes c A_n + (1 - c) B_n, c = (1 + e) / 2 of equal masses. That
    is most with A along n and B_n = (1 - e) / (3 - e): 2 / sqrt(3 - e).
    """
    most, c = 2.0 / sqrt(3.0 - e), 0.5 * (1.0 + e)
    # Speeds below V would not do better, as the result is convex in A and in B.
    a, b = np.meshgrid(*2 * [np.linspace(0.0, np.pi, 1001)])
    after = np.hypot(np.sin(b), c * np.cos(a) + (1.0 - c) * np.cos(b))
    assert most - 1e-5 < after[np.cos(a) > np.cos(b)].max() <= most + 1e-15
    r, until, normal = 0.01, 0.04, (1.0 - e) / (3.0 - e)
    ways = [1.0, 0.0], [normal, sqrt(1.0 - normal**2)]
    scene = {
        "gravity": 0.0,
        "particle": {"radius": r},
        "stream": [
            {"at": [x - until * vx, -until * vy], "velocity": [vx, vy], "interact": True,
             "restitution": e, "friction": 0.0}
            for x, (vx, vy) in zip((0.0, 2.0 * r), ways, strict=True)
        ],
        "run": {"until": 2.0 * until, "dt": 1e-5},
    }  # fmt: skip
    found = simulate(from_dict(scene), engine=engine)
    speeds = np.hypot(*found.ends()[1]["velocity"].T)
    # Pymunk sees them meet up to a step late.
    assert abs(speeds[1] - most) < {"contact": 1e-14, "pymunk": 1e-6}[engine]
    assert speeds[1] > 1.15 > 1.0 > speeds[0]


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_disks_that_just_touch_are_there_from_the_start(engine):
    """Six in a pile: where 0.03 and 0.05 are rounded, neighbours overlap in the last digit."""
    scene = {
        "particle": {"radius": 0.01, "spin": True},
        "surface": [{"name": "f", "from": [-0.5, 0.0], "to": [0.5, 0.0], "restitution": 0.0}],
        "stream": {
            "count": 6, "at": [0.0, 0.01], "to": [0.0, 0.11], "velocity": [0.0, 0.0],
            "interact": True, "restitution": 0.0,
        },
        "run": {"until": 0.05},
    }  # fmt: skip
    released = simulate(from_dict(scene), engine=engine).select(Kind.RELEASE)
    assert released["t"].tolist() == [0.0] * 6
