"""Contacts that are not stepped because nothing new happens: the same run as if they were."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from chutelab.ledger import ledger
from chutelab.machine import build
from chutelab.recording import Kind
from chutelab.scene import parse
from chutelab.stepper import run
from chutelab.stepper.idle import Idle, spread
from chutelab.stepper.solids import SLOP

G, R, DT = 9.81, 0.004, 1e-3

FLOOR = """
[[surface]]
name = "floor"
from = [-20.0, 0.0]
to = [20.0, 0.0]
restitution = 0.3
"""

SLOPE = """
[[surface]]
name = "slope"
from = [-1.0, 0.5]
to = [2.0, -1.0]
friction = 0.2
"""

TABLE = """
[[surface]]
name = "table"
from = [-1.0, 0.0]
to = [0.3, 0.0]
"""


def machine_of(surface, positions, velocities, times, *, until=1.0, spin=False, restitution=0.3):
    """Machine with particles released where and when told."""
    machine = build(
        parse(
            f"""
[particle]
spin = {str(spin).lower()}
[stream]
count = {len(times)}
rate = 1.0
at = [0.0, 1.0]
velocity = [0.0, 0.0]
bed_height = 0.01
interact = {str(len(times) > 1).lower()}
restitution = {restitution}
friction = 0.5
[run]
until = {until}
{surface}
"""
        )
    )
    releases = replace(
        machine.releases,
        t=np.array(times, dtype=float),
        position=np.array(positions, dtype=float),
        velocity=np.array(velocities, dtype=float),
    )
    return replace(machine, releases=releases)


@pytest.fixture
def both_ways(monkeypatch):
    """Run a machine, then again with nobody allowed to sleep; and how many slept at most."""

    def runs(machine):
        most, settle = [0], Idle.settle

        def watched(idle, *args):
            settle(idle, *args)
            most.append(int(np.count_nonzero(idle.asleep)))

        with monkeypatch.context() as patch:
            patch.setattr(Idle, "settle", watched)
            sleeping = run(machine)
        with monkeypatch.context() as patch:
            patch.setattr(Idle, "settle", lambda idle, *args: None)
            awake = run(machine)
        return sleeping, awake, max(most)

    return runs


def last(recording, what="position"):
    return np.array([recording.track(n)[-1][what] for n in range(recording.count)])


def alone(surface, speed, *, spin=False, until=1.0, at=(0.0, R)):
    return machine_of(surface, [at], [(speed, 0.0)], [0.0], until=until, spin=spin)


@pytest.mark.parametrize(
    "machine",
    [
        pytest.param(lambda: alone(FLOOR + "friction = 0.2", 1.0), id="slide to rest"),
        pytest.param(lambda: alone(FLOOR + "friction = 0.3\nspeed = 2.0", 0.0), id="ride"),
        pytest.param(lambda: alone(FLOOR + "friction = 0.2", 1.0, spin=True), id="roll"),
        pytest.param(lambda: alone(FLOOR + "friction = 0.0", 1.0), id="glide"),
        pytest.param(lambda: alone(SLOPE, 0.0, at=(0.0, 0.1)), id="down a slope"),
        pytest.param(lambda: alone(TABLE + "friction = 0.1", 1.0), id="off a table"),
        pytest.param(lambda: alone(TABLE + "speed = 2.0", 2.0), id="off a belt"),
    ],
)
def test_one_that_sleeps_goes_the_same_way(both_ways, machine):
    sleeping, awake, most = both_ways(machine())
    assert most == 1
    for name, tolerance in (("t", 1e-12), ("position", 1e-11), ("velocity", 1e-10)):
        assert last(sleeping, name) == pytest.approx(last(awake, name), abs=tolerance)
    assert last(sleeping, "omega") == pytest.approx(last(awake, "omega"), abs=1e-8)
    turned_over = ledger(awake).turned_over
    assert sleeping.by_surface == pytest.approx(awake.by_surface, abs=1e-12 * turned_over)
    # The same story, told at the same times.
    assert sleeping.events["kind"].tolist() == awake.events["kind"].tolist()
    assert sleeping.events["t"] == pytest.approx(awake.events["t"], abs=1e-12)
    # Between knots both may leave the curve by what a knot is worth.
    times = np.linspace(0.0, 0.99 * last(awake, "t").min(), 100)
    apart = np.nan_to_num(sleeping.at(times)[0] - awake.at(times)[0])
    assert np.abs(apart).max() < 5e-3 * R


def column(count):
    wall = 1.05 * R
    surface = f"""
[[surface]]
name = "channel"
points = [[{-wall}, 0.2], [{-wall}, 0.0], [{wall}, 0.0], [{wall}, 0.2]]
friction = 0.5
"""
    places = [(0.02 * R * (-1) ** n, 0.06) for n in range(count)]
    times = [0.2 * n for n in range(count)]
    return machine_of(surface, places, [(0, 0)] * count, times, until=1.0, restitution=0.0)


def pyramid():
    wall = 2.5 * R
    surface = f"""
[[surface]]
name = "box"
points = [[{-wall}, 0.2], [{-wall}, 0.0], [{wall}, 0.0], [{wall}, 0.2]]
friction = 0.5
"""
    places = [(-1.5 * R, R), (1.5 * R, R), (0.0, 0.06)]
    return machine_of(surface, places, [(0, 0)] * 3, [0.0, 0.0, 0.2], until=1.0, restitution=0.0)


@pytest.mark.parametrize("machine", [lambda: column(3), pyramid], ids=["column", "pyramid"])
def test_a_pile_that_sleeps_lies_as_one_that_is_stepped(both_ways, machine):
    sleeping, awake, most = both_ways(machine())
    assert most == 3
    assert last(sleeping) == pytest.approx(last(awake), abs=0.05 * R)
    assert np.abs(last(sleeping, "velocity")).max() < 1e-6
    assert ledger(sleeping).relative_residual < 5e-5
    # Left alone for longer it does not stir.
    longer = run(replace(machine(), end_time=4.0))
    # What rests may lie anywhere within the slop, layer by layer.
    assert last(longer) == pytest.approx(last(sleeping), abs=4.0 * SLOP * R)
    # The step is fitted to the end of the run, so it falls together a little differently.
    assert abs(len(longer.knots) - len(sleeping.knots)) <= 10


def test_a_sleeper_hit_from_the_side_slides_on(both_ways):
    # The second comes with v and leaves ½ (1 + ε) v to the first, which slides v² / (2 µ g) far.
    machine = machine_of(
        FLOOR + "friction = 0.1",
        [(0.0, R), (-0.2, R)],
        [(0, 0), (1.0, 0)],
        [0.0, 0.3004],
        until=1.5,
    )
    sleeping, awake, most = both_ways(machine)
    assert most == 2
    assert last(sleeping) == pytest.approx(last(awake), abs=1e-10)
    (hit,) = sleeping.select(Kind.COLLISION)
    v = sqrt(1.0 - 2.0 * 0.1 * G * (0.2 - 2.0 * R))
    assert abs(hit["velocity_before"][0] - hit["velocity_after"][0]) == pytest.approx(
        0.65 * v, abs=1e-3
    )
    push = 0.65 * v
    assert last(sleeping)[0, 0] == pytest.approx(push**2 / (2.0 * 0.1 * G), abs=push * DT)


def test_a_sleeper_is_woken_by_what_falls_on_it(both_ways):
    machine = machine_of(
        FLOOR + "friction = 0.5", [(0.0, R), (0.5 * R, 0.2)], [(0, 0), (0, 0)], [0.0, 0.3]
    )
    sleeping, awake, most = both_ways(machine)
    assert most >= 1
    assert last(sleeping) == pytest.approx(last(awake), abs=1e-10)
    (hit, *_) = sleeping.select(Kind.COLLISION)
    # Centres 2 r apart, the upper one ½ r to the right.
    fall = 0.2 - R - sqrt(4.0 - 0.25) * R
    # The lower one lies up to the slop deep in the floor.
    assert hit["t"] == pytest.approx(
        0.3 + sqrt(2.0 * fall / G), abs=SLOP * R / sqrt(2.0 * fall * G)
    )
    assert last(sleeping)[0] == pytest.approx([0.0, R], abs=0.5 * R)
    assert last(sleeping)[1, 0] > 2.0 * R  # it rolled off to the right


def test_a_sleeper_is_woken_by_the_end_of_its_support():
    # Friction leaves √(v² - 2 µ g L) of its speed at the end of the table; then it falls.
    recording = run(alone(TABLE + "friction = 0.1", 1.0))
    speed = sqrt(1.0 - 2.0 * 0.1 * G * 0.3)
    end = recording.track(0)[-1]
    fall = end["t"] - (1.0 - speed) / (0.1 * G)
    assert end["t"] == 1.0
    # The end of the table is seen by a step: it rubs that much longer at most.
    assert end["velocity"][0] == pytest.approx(speed, abs=0.1 * G * DT)
    assert end["position"][0] == pytest.approx(0.3 + speed * fall, abs=speed * DT)
    assert end["position"][1] == pytest.approx(R - 0.5 * G * fall**2, abs=0.02)


def test_a_sleeper_is_woken_by_a_neighbour_that_leaves():
    # Two on the floor carry a third; a fourth knocks the left one away, and the third comes down.
    top = (1.0 + sqrt(3.0)) * R
    places = [(-R, R), (R, R), (0.0, top + 1e-4), (-0.1, R)]
    machine = machine_of(
        FLOOR + "friction = 0.5",
        places,
        [(0, 0), (0, 0), (0, 0), (3.0, 0)],
        [0.0, 0.0, 0.2, 0.6004],
    )
    recording = run(machine)
    assert recording.at(np.array([0.6]))[0][0, 2] == pytest.approx([0.0, top], abs=0.02 * R)
    ends = last(recording)
    assert ends[2, 1] < top - 0.2 * R
    for n in range(4):
        apart = np.hypot(*(np.delete(ends, n, axis=0) - ends[n]).T)
        assert apart.min() > 1.98 * R
        # It lies on the floor, or on somebody: nobody hangs in the air.
        assert ends[n, 1] < 1.001 * R or apart.min() < 2.005 * R


def test_a_sleeper_is_woken_when_the_one_it_lies_on_is_struck_away(both_ways):
    # The second lies on the first between walls that end above it. Under them a third comes fast
    # and nearly stops at the first one, which is gone before the next step looks.
    walls = "".join(
        f"""
[[surface]]
name = "wall{side}"
from = [{1.05 * side * R}, {2.2 * R}]
to = [{1.05 * side * R}, 0.2]
"""
        for side in (-1, 1)
    )
    top = R + sqrt(4.0 - 0.05**2) * R
    machine = machine_of(
        FLOOR + "friction = 0.5" + walls,
        [(0.0, R), (0.05 * R, top), (0.5, R)],
        [(0, 0), (0, 0), (-20.0, 0)],
        [0.0, 0.0, 0.8],
        restitution=0.9,
        until=0.9,
    )
    sleeping, _, most = both_ways(machine)
    assert most >= 2
    hits = sleeping.select(Kind.COLLISION)
    hit = hits[hits["t"] > 0.8][0]
    assert {hit["particle"], hit["other"]} == {0, 2}
    fall = 0.005
    (before, after), _ = sleeping.at(np.array([0.8, hit["t"] + fall]))
    assert before[1] == pytest.approx([0.05 * R, top], abs=0.01 * R)
    assert before[1, 1] - after[1, 1] == pytest.approx(0.5 * G * fall**2, abs=G * fall * DT)


def test_one_that_comes_at_the_instant_of_a_step_is_not_stepped_before_its_time():
    # While the first sleeps steps go on; the second is released in contact, sliding.
    machine = machine_of(
        FLOOR + "friction = 0.1", [(-1.0, R), (0.0, R)], [(0, 0), (1.0, 0)], [0.0, 0.3], until=0.8
    )
    end = run(machine).track(1)[-1]
    assert end["velocity"][0] == pytest.approx(1.0 - 0.1 * G * 0.5, abs=1e-6)
    assert end["position"][0] == pytest.approx(0.5 - 0.05 * G * 0.25, abs=1e-6)


def test_a_mark_spreads_along_pairs():
    mark = np.array([True, False, False, False, False, False])
    spread(mark, np.array([3, 1, 4]), np.array([1, 0, 5]))
    assert mark.tolist() == [True, True, False, True, False, False]


def test_who_slides_for_long_leaves_few_knots():
    few = len(run(alone(FLOOR + "friction = 1e-4", 5.0, until=0.2)).track(0))
    many = len(run(alone(FLOOR + "friction = 1e-4", 5.0, until=3.0)).track(0))
    assert few == many < 10


def test_the_way_of_a_slide_is_a_parabola_between_its_knots():
    recording = run(alone(FLOOR + "friction = 0.2", 1.0, until=0.4))
    times = np.linspace(0.05, 0.4, 50)
    position, velocity = recording.at(times)
    assert velocity[:, 0, 0] == pytest.approx(1.0 - 0.2 * G * times, abs=1e-12)
    assert position[:, 0, 0] == pytest.approx(times - 0.1 * G * times**2, abs=1e-12)
    assert position[:, 0, 1] == pytest.approx(np.full(50, R), abs=1e-5 * R)
