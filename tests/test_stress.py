"""Stress: every law can fail, the cases are all there, the table and what the command prints."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import chutelab
from chutelab import cli, machine, scene
from chutelab.checks import stress
from chutelab.checks.stress import ENGINES, Case, Evidence, Ladder, Twin, cases, harness, laws
from chutelab.checks.stress.case import TRANSFER, by_name, merged, scene_of, surface, thrown
from chutelab.cli import main
from chutelab.engines.simulation import simulate
from chutelab.results import Kind
from chutelab.results.recorder import StalledError

SOURCES = str(Path(chutelab.__file__).parent.parent)

FLOOR = surface("floor", (-1.0, 0.0), (2.0, 0.0), restitution=0.5, friction=0.3)
HOP = {
    "surface": [FLOOR],
    **thrown((0.0, 0.3), (0.5, 0.0), count=2, rate=10.0),
    "run": {"until": 1.0},
}
PAIR = {
    "gravity": 0.0,
    "particle": {"radius": 0.02, "spin": True},
    **thrown((0.0, 0.0), (1.0, 0.0), count=2, rate=5.0, bed_height=0.03, speed_spread=0.9,
             interact=True, seed=8),
    "run": {"until": 2.0},
}  # fmt: skip


def listed(folder):
    return sorted(path.name for path in folder.iterdir())


def evidence(tables=HOP, engine="exact", dt=None, **changes):
    """A run, with the arrays named in `changes` handed to a function that may spoil them."""
    loaded = scene_of(tables, "test", engine, dt)
    recording = simulate(loaded, by_name(engine))
    spoilt = {name: getattr(recording, name).copy() for name in changes}
    for name, change in changes.items():
        change(spoilt[name])
    return Evidence(machine.build(loaded), replace(recording, **spoilt), engine, dt)


def adder(field, row, amount):
    def change(array):
        array[field][row] += amount

    return change


def teller(law, name, row, field, amount, tables=HOP):
    """What a law says of a run as it is, and of one with a number in it moved."""
    return law(evidence(tables)), law(evidence(tables, **{name: adder(field, row, amount)}))


# Laws: kept by a run as it is, broken by a perturbed one


@pytest.mark.parametrize(
    ("name", "field"),
    [("knots", "velocity"), ("knots", "omega"), ("events", "normal_impulse"), ("events", "t")],
)
def test_a_number_that_is_none_breaks_finite(name, field):
    good, bad = teller(laws.finite, name, 1, field, nan)
    assert good.holds
    assert not bad.holds
    assert bad.figure >= 1


def test_a_knot_before_the_last_breaks_the_order_of_time():
    good, bad = teller(laws.ordered, "knots", 1, "t", -1.0)
    assert (good.figure, good.bound) == (0.0, 0.0)
    assert bad.figure == pytest.approx(1.0, abs=0.5)


def test_a_particle_without_a_track_is_lost():
    def forget(offsets):
        offsets[1] = 0

    assert laws.released(evidence()).holds
    assert laws.released(evidence(offsets=forget)).figure == 1


def test_a_track_that_ends_early_does_not_last():
    good, bad = teller(laws.lasting, "knots", -1, "t", -1e-9)
    assert good.holds
    assert bad.figure == pytest.approx(1e-9, rel=1e-3)
    assert not bad.holds


def test_a_hair_below_the_surface_is_too_deep():
    good, bad = teller(laws.depth, "knots", 1, "position", [0.0, -1e-8])
    assert good.holds
    assert bad.figure == pytest.approx(1e-8, rel=1e-3)
    assert not bad.holds
    assert "particle 0 in floor" in bad.detail


def test_what_starts_in_a_surface_may_stay_but_not_sink():
    lying = merged(HOP, {"stream": {"at": [0.0, 0.004], "velocity": [0.1, 0.0], "count": 1}})

    def sink(knots):
        knots["position"][:, 1] -= 1e-3

    def sink_on(knots):
        knots["position"][:, 1] -= 1e-3
        knots["position"][-1, 1] -= 1e-6

    assert laws.depth(evidence(lying, knots=sink)).holds
    assert laws.depth(evidence(lying, knots=sink_on)).figure == pytest.approx(1e-6, rel=1e-6)


def test_the_pulley_is_a_surface_too():
    tables = {
        "incoming": {"speed": 0.5, "pulley_radius": 0.1, "length": 0.1},
        "run": {"until": 0.4},
    }
    assert laws.depth(evidence(tables)).holds

    def inside(knots):
        on_top = np.argmax(knots["position"][:, 0] > 0.0)
        knots["position"][on_top] *= 0.99

    bad = laws.depth(evidence(tables, knots=inside))
    assert not bad.holds
    assert "pulley" in bad.detail


@pytest.mark.parametrize("place", [0.3, 0.999])
def test_a_centre_on_the_other_side_went_through(place):
    wall = surface("wall", (1.0, 0.0), (1.0, 1.0))
    flight = {
        "gravity": 0.0,
        "particle": {"radius": 0.0},
        "surface": [wall],
        **thrown((0.0, place), (1.0, 0.0)),
        "run": {"until": 0.5},
    }

    def jump(knots):
        knots["position"][-1, 0] = 1.5
        knots["velocity"][-1] = knots["velocity"][0] = [3.0, 0.0]

    assert laws.no_one_through(evidence(flight)).holds
    bad = laws.no_one_through(evidence(flight, knots=jump))
    assert bad.figure == 1
    assert "particle 0 through wall" in bad.detail
    past = merged(flight, {"stream": {"at": [0.0, 1.0 + place]}})
    assert laws.no_one_through(evidence(past, knots=jump)).holds


def test_a_passage_there_and_back_within_one_interval_is_seen():
    # A flight of one interval whose middle lies beyond the ceiling.
    ceiling = surface("ceiling", (-1.0, 0.3), (2.0, 0.3))
    thrown_up = {**thrown((0.0, 0.0), (0.5, 2.0)), "run": {"until": 0.4}}
    hidden = merged(thrown_up, {"surface": [surface("away", (5.0, 0.5), (6.0, 0.5))]})
    recording = evidence(hidden).recording
    built = machine.build(scene_of({**thrown_up, "surface": [ceiling]}, "test", "exact", None))
    assert np.count_nonzero(np.abs(recording.knots["position"][:, 1]) < 0.02) == 2
    under = replace(recording, knots=recording.knots.copy())
    assert laws.no_one_through(Evidence(built, under, "exact", None)).holds
    up = recording.knots.copy()
    up["velocity"][:, 1] *= 2.0
    over = Evidence(built, replace(recording, knots=up), "exact", None)
    assert laws.no_one_through(over).figure == 2


def test_energy_from_nothing_is_seen():
    good, bad = teller(laws.energy, "knots", 3, "velocity", [0.0, -1e-9])
    assert good.holds
    # ½ m ((v + δ)² - v²) of what is in play.
    v = -evidence().recording.knots["velocity"][3, 1]
    assert bad.figure == pytest.approx(0.008 * v * 1e-9 / evidence().energy, rel=0.05)
    assert not bad.holds


def test_a_belt_may_raise_energy_only_by_its_work():
    belt = merged(HOP, {"surface": [{**FLOOR, "speed": 3.0}]})

    def unpaid(knots):
        knots["entries"][:, 0] *= 0.4  # half of it is heat

    assert np.ptp(evidence(belt).recording.knots["entries"][:, 0]) > 1e-3
    assert laws.energy(evidence(belt)).holds
    assert not laws.energy(evidence(belt, knots=unpaid)).holds


@pytest.mark.parametrize(
    ("field", "amount"), [("velocity", [0.0, 1e-4]), ("entries", [0, 0, 1e-11])]
)
def test_a_perturbed_end_opens_the_ledger(field, amount):
    good, bad = teller(laws.residual, "knots", -1, field, amount)
    assert good.holds
    assert not bad.holds


def crowd(**changes):
    return evidence(PAIR, "contact", 1e-3, **changes)


def test_a_crowd_keeps_the_laws_and_meets():
    whole = crowd()
    assert whole.recording.contacts == 1
    found = {name: law(whole) for name, law in laws.LAWS.items()}
    assert {"momentum", "angular momentum", "no overlap"} <= {n for n, v in found.items() if v}
    assert [name for name, verdict in found.items() if verdict and not verdict.holds] == []


@pytest.mark.parametrize("law", [laws.momentum, laws.spin, laws.energy])
def test_one_faster_particle_breaks_the_laws_of_a_crowd(law):
    def push(knots):
        knots["velocity"][-1] *= 2.0

    assert law(crowd()).holds
    assert not law(crowd(knots=push)).holds


def test_a_turn_more_breaks_angular_momentum_only():
    change = adder("omega", -1, 400.0)
    assert not laws.spin(crowd(knots=change)).holds
    assert laws.momentum(crowd(knots=change)).holds


def test_two_in_one_place_overlap():
    def together(knots):
        half = len(knots) // 2
        knots["position"][half:] = knots["position"][half - 1] + [0.001, 0.0]
        knots["position"][:half] = knots["position"][half - 1]
        knots["velocity"] = 0.0

    good, bad = laws.overlap(crowd()), laws.overlap(crowd(knots=together))
    assert good.holds
    assert bad.figure == pytest.approx(0.039, rel=1e-9)
    assert not bad.holds


def test_nobody_stays_in_another_for_longer_than_a_step():
    """Two disks of 2 cm, 4 mm deep in each other from the middle on: 0.2 r, and more than 5 %."""

    def still(knots):
        knots["velocity"] = 0.0
        half = len(knots) // 2
        knots["position"][:half] = knots["position"][half - 1]
        knots["position"][half:] = knots["position"][half - 1] + [0.036, 0.0]

    good, bad = laws.pressed(crowd()), laws.pressed(crowd(knots=still))
    assert good.holds
    assert bad.figure == pytest.approx(0.2, rel=1e-9)
    assert not bad.holds


def test_slow_disks_whose_centres_come_within_a_radius_went_through_each_other():
    """One at rest, one that passes 15 mm from its centre at 1 m/s: a 20th of the radius a step."""

    def ghosts(knots):
        half = len(knots) // 2
        first, second = knots[:half], knots[half:]
        first["velocity"], second["velocity"] = [0.0, 0.0], [1.0, 0.0]
        first["position"] = [1.0, 0.0]
        second["position"][:, 0] = 0.5 + second["t"] - second["t"][0]
        second["position"][:, 1] = 0.015

    good, bad = (laws.no_one_through_another(e) for e in (crowd(), crowd(knots=ghosts)))
    assert (good.figure, good.bound) == (0, 0.0)
    assert bad.figure == 1
    assert "0 and 1" in bad.detail


def test_a_bounce_beside_the_surface_is_off_nothing():
    """An impact 1 nm above the floor, or one that names another surface."""
    hits = np.flatnonzero(evidence().recording.events["kind"] == Kind.IMPACT)
    good, bad = teller(laws.on_something, "events", hits[0], "position", [0.0, 1e-9])
    assert good.holds
    assert bad.figure == pytest.approx(1e-9, rel=1e-3)
    assert not bad.holds
    assert "off floor" in bad.detail
    wall = merged(HOP, {"surface": [FLOOR, surface("wall", (2.0, 0.0), (2.0, 1.0))]})
    hits = np.flatnonzero(evidence(wall).recording.events["kind"] == Kind.IMPACT)
    other = laws.on_something(evidence(wall, events=adder("surface", hits[0], 1)))
    assert other.figure > 1.0


def test_a_collision_with_one_that_is_elsewhere_is_off_nothing():
    (hit,) = crowd().recording.select(Kind.COLLISION)
    row = np.flatnonzero(crowd().recording.events["kind"] == Kind.COLLISION)[0]
    good = laws.on_something(crowd())
    away = hit["position"] - crowd().recording.at([hit["t"]])[0][0][hit["other"]]
    bad = laws.on_something(crowd(events=adder("position", row, 0.2 * away)))
    assert good.holds
    # 20 % farther from its partner than two radii of 2 cm.
    assert bad.figure == pytest.approx(0.2 * 0.04, rel=1e-3)
    assert not bad.holds


def test_one_released_in_another_or_in_a_surface_has_no_room():
    starts = np.flatnonzero(crowd().recording.events["kind"] == Kind.RELEASE)
    there = crowd().recording.at([crowd().recording.events["t"][starts[1]]])[0][0][0]
    here = crowd().recording.events["position"][starts[1]]

    def inside(events):
        events["position"][starts[1]] += (1.0 - 0.03 / np.hypot(*(there - here))) * (there - here)

    assert laws.released_free(crowd()).holds
    bad = laws.released_free(crowd(events=inside))
    assert bad.figure == pytest.approx(0.01, rel=1e-9)
    assert "particle 1 in 0" in bad.detail
    good, low = teller(laws.released_free, "events", 0, "position", [0.0, -0.297])
    assert good.holds
    assert low.figure == pytest.approx(0.001, rel=1e-9)
    assert "in floor" in low.detail


def test_what_rides_on_a_belt_that_will_throw_it_has_not_settled():
    """Of the surfaces that move, only the outgoing belt is one to settle on."""
    lying = merged(HOP, {
        "surface": [{**FLOOR, "speed": 0.0}],
        "stream": {"at": [0.0, 0.004], "velocity": [0.1, 0.0], "count": 1},
        "run": {"until": "settled"},
    })  # fmt: skip
    assert laws.settled_to_stay(evidence()) is None
    e = evidence(lying)
    assert laws.settled_to_stay(e).holds
    moving = scene_of(merged(lying, {"surface": [{**FLOOR, "speed": 1.0}]}), "test", "exact", None)
    bad = laws.settled_to_stay(replace(e, machine=machine.build(moving)))
    assert bad.figure == 1
    assert "0 on floor" in bad.detail
    carried = evidence(merged(TRANSFER, {"run": {"until": "settled"}}))
    assert carried.machine.segments.speed[-1] != 0.0
    assert laws.settled_to_stay(carried).holds


def test_momentum_on_a_frictionless_floor_holds_along_it_only():
    slides = merged(
        PAIR, {"surface": [{**FLOOR, "friction": 0.0, "points": [[-9.0, -0.5], [9.0, -0.5]]}]}
    )

    def pushed(direction):
        return lambda knots: np.add.at(knots["velocity"], -1, direction)

    verdicts = [
        laws.momentum(evidence(slides, "contact", 1e-3, knots=pushed(direction)))
        for direction in ([0.0, 0.0], [0.0, 0.1], [0.1, 0.0])
    ]
    assert [verdict.holds for verdict in verdicts] == [True, True, False]
    rough = merged(slides, {"surface": [{**slides["surface"][0], "friction": 0.1}]})
    assert laws.momentum(evidence(rough, "contact", 1e-3)) is None


# Demands of single cases


def test_endings_boxes_and_rest_can_be_broken():
    e = evidence()
    assert laws.ended(e, ("time",)).holds
    assert laws.ended(e, ("settled", "landed")).figure == 2
    assert laws.inside(e, (-1.0, 2.0, 0.0, 1.0)).holds
    assert laws.inside(e, (-1.0, 2.0, 0.0, 0.2)).figure == 2
    assert not laws.still(evidence(merged(HOP, {"run": {"until": 0.3}}))).holds
    resting = merged(HOP, {"stream": {"at": [0.0, 0.004], "velocity": [0.0, 0.0], "count": 1}})
    assert laws.still(evidence(resting)).holds
    assert laws.sunk(evidence(resting)).holds
    low = evidence(resting, knots=adder("position", -1, [0.0, -0.0002]))
    assert laws.sunk(low).figure == pytest.approx(0.05, rel=1e-9)
    assert not laws.sunk(low).holds


MIRROR = Twin("mirror symmetry", {}, lambda p: p * [-1.0, 1.0])


def test_a_twin_that_moves_elsewhere_is_no_twin():
    one, other = evidence(HOP), evidence(cases.mirrored(HOP))
    assert laws.symmetric(one, other, MIRROR).figure < 1e-15
    assert laws.symmetric(one, other, MIRROR).holds
    off = evidence(cases.mirrored(HOP), knots=adder("position", 1, [1e-6, 0.0]))
    assert laws.symmetric(one, off, MIRROR).figure == pytest.approx(1e-6, rel=0.1)
    assert not laws.symmetric(one, off, MIRROR).holds
    assert not laws.symmetric(one, evidence(HOP), MIRROR).holds
    shorter = evidence(merged(cases.mirrored(HOP), {"run": {"until": 0.9}}))
    assert not laws.symmetric(one, shorter, MIRROR).holds


def test_moved_and_mirrored_scenes_are_that():
    there = cases.moved(HOP, 3.0, 4.0)
    assert there["surface"][0]["points"] == [[2.0, 4.0], [5.0, 4.0]]
    assert there["stream"]["at"] == [3.0, 4.3]
    assert there["stream"]["velocity"] == [0.5, 0.0]
    assert cases.mirrored(HOP)["stream"]["velocity"] == [-0.5, 0.0]
    assert HOP["stream"]["at"] == [0.0, 0.3]


def ladder(errors, floor=1e-10):
    steps = tuple(2.0**-n for n in range(len(errors)))
    return laws.order(Ladder(steps, lambda recording: 0.0, floor), errors)


def test_the_order_of_convergence_is_the_slope_until_rounding():
    assert ladder([1e-2 / 4**n for n in range(5)]).figure == pytest.approx(2.0)
    assert ladder([1e-2 / 2**n for n in range(5)]).figure == pytest.approx(1.0)
    assert not ladder([1e-2 / 2 ** (n / 3) for n in range(5)]).holds
    assert not ladder([1e-2] * 5).holds
    assert ladder([1e-6, 1e-9, 1e-11, 1e-12, 1e-11]).holds
    assert ladder([1e-2, 1e-4, 2.5e-3, 1e-6, 6e-4]).figure == pytest.approx(1.0, abs=0.05)
    assert ladder([1e-11, 1e-12, 1e-11]).holds
    assert not ladder([1e-6, 1e-11, 1e-11, 1e-6]).holds
    assert not ladder([1e-11, 1e-6, 1e-6, 1e-6]).holds
    assert not ladder([1e-2, 1e-3, nan, 1e-5]).holds


# The harness


def one(case, engine="exact"):
    return [result for _, result in harness.results([case], [engine])]


def test_a_run_is_judged_by_every_law_that_applies():
    found = one(Case("hop", "test", HOP, ends=("time",)))
    names = [result.law for result in found]
    assert names == [
        "finite numbers", "time goes forward", "nobody lost", "lasts to the end",
        "no one through", "no one inside", "bounces off something", "released into room",
        "energy never rises", "ledger closes", "ends as it must",
    ]  # fmt: skip
    assert all(result.holds for result in found)
    assert all(result.dt is None and result.seconds > 0.0 for result in found)


def test_steps_and_engines_are_all_run(monkeypatch):
    asked = []

    def note(loaded, engine, progress):
        asked.append((engine, loaded.run.engine, loaded.run.dt, loaded.run.align))
        return simulate(loaded, "exact")

    monkeypatch.setattr(harness, "simulate", note)
    case = Case("hop", "test", HOP, engines=ENGINES, steps=(0.01, 0.02))
    list(harness.results([case]))
    assert asked == [
        ("exact", "exact", 1e-3, True),
        ("contact", "contact", 0.01, True),
        ("contact", "contact", 0.02, True),
        ("pymunk", "pymunk", 0.01, True),
        ("pymunk", "pymunk", 0.02, True),
        ("pymunk", "pymunk", 0.01, False),
        ("pymunk", "pymunk", 0.02, False),
    ]


def test_a_scene_that_must_be_refused_and_one_that_must_not():
    point = merged(HOP, {"particle": {"radius": 0.0}})
    must = Case("point", "test", point, engines=("pymunk",), refusals={"pymunk": "run.engine"})
    (right, *_) = one(must, "pymunk")
    assert (right.law, right.holds, right.figure) == ("refused", True, None)
    assert "mass point" in right.detail or "pymunk needs disks" in right.detail
    (other, *_) = one(must.but(refusals={"pymunk": "plate.above"}), "pymunk")
    assert not other.holds
    (wrong, *_) = one(must.but(refusals={}), "pymunk")
    assert (wrong.law, wrong.holds) == ("refused", False)
    (runs,) = one(Case("hop", "test", HOP, refusals={"exact": "run.engine"}))
    assert not runs.holds
    assert "ought to be refused" in runs.detail


@pytest.mark.parametrize(
    "error", [ZeroDivisionError("oh"), StalledError(3, 1.25, (0.5, 0.1), "it hops in place")]
)
def test_what_an_engine_raises_is_a_line_of_the_table(monkeypatch, error):
    def raises(*_arguments):
        raise error

    monkeypatch.setattr(harness, "simulate", raises)
    for case in (
        Case("hop", "test", HOP),
        Case("steps", "test", HOP, ladder=Ladder((0.1, 0.05), lambda r: 0.0, 0.0)),
    ):
        (line,) = one(case)
        assert (line.law, line.holds) == ("runs to its end", False)
        assert type(error).__name__ in line.detail
        assert str(error) in line.detail


@pytest.mark.parametrize("calls", [True, False])
def test_the_watchdog_ends_what_never_would(monkeypatch, calls):
    def hangs(_loaded, _engine, progress):
        while True:
            time.sleep(0.005)
            if calls:
                progress(0.5)

    monkeypatch.setattr(harness, "simulate", hangs)
    begin = time.perf_counter()
    (line,) = one(Case("hang", "test", HOP, patience=0.05))
    assert time.perf_counter() - begin < 2.0
    assert line.detail == "OverdueError: not done after 0.05 s of wall time"


def test_the_watchdog_leaves_no_alarm_behind():
    before = signal.getsignal(signal.SIGALRM)
    with harness.bounded(0.05):
        pass
    time.sleep(0.2)
    assert signal.getsignal(signal.SIGALRM) is before


def test_fast_disks_in_steps_all_alike_are_promised_no_surface():
    """Who goes farther than its radius in a step may be beyond a surface before it is seen."""
    slow, fast = (evidence(PAIR, "pymunk", dt) for dt in (1e-3, 0.1))
    radii = np.hypot(*fast.recording.knots["velocity"].T).max() * 0.1 / 0.02
    assert laws.unpromised(slow, "no one through") == ""
    assert laws.unpromised(fast, "no one through").startswith(f"up to {radii:.2g} radii in a step")
    assert laws.unpromised(fast, "ledger closes") == ""
    assert laws.unpromised(evidence(PAIR, "contact", 0.1), "no one through") == ""
    assert laws.unpromised(evidence(HOP, "pymunk", 0.1), "no one through") == ""


def test_what_is_not_promised_is_a_line_and_no_failure():
    (line,) = one(Case("hop", "test", HOP, unpromised={"exact": "too long"}))
    assert (line.law, line.holds, line.broken) == ("runs to its end", False, False)
    assert (line.detail, line.unpromised) == ("not run", "too long")
    (run,) = harness.runs([line])
    assert (run.failed, run.kept, run.laws) == ((), 0, 1)


@pytest.mark.parametrize(
    "name",
    ["radius-1e-0?", "radius-*-drop", "restitution-0-box", "belt--2*", "end-dead-on", "mirror-*",
     "corner-vee-sharp", "bounces-10000", "late-*", "restitution-0-swarm"],
)  # fmt: skip
def test_pymunk_keeps_the_laws_that_it_promises(name):
    found = [r for _, r in stress.results(stress.chosen([name]), ["pymunk"])]
    assert found
    assert [(r.case, r.law, r.figure, r.bound) for r in found if r.broken] == []


# The cases


def test_the_quick_set_on_the_exact_engine_keeps_all_laws():
    names = [c.name for c in stress.all_cases() if not c.name.startswith("bounces")]
    found = [r for _, r in stress.results(stress.chosen(names), ["exact"])]
    assert len({r.case for r in found}) > 100
    assert [(r.case, r.law, r.figure, r.bound) for r in found if not r.holds] == []


def test_every_case_of_the_list_is_there():
    groups = {case.group for case in stress.all_cases(full=True)}
    assert groups == {
        "200 m/s against a 2 mm plate", "radius", "mass", "restitution", "friction", "belt speed",
        "g = 0", "grazing plates", "v²/(g R) within 1e-15 of 1", "a plate's very end",
        "released in contact or overlapping", "two impacts at one instant",
        "ten thousand bounces", "10^6 s of flight without gravity", "time far from zero",
        "a pile left alone", "dt 1/30", "shifted by 10^6 m", "mirrored",
        "steps halved until rounding takes over", "drawn at random",
    }  # fmt: skip


def test_names_are_unique_and_short_enough_for_the_table():
    names = [case.name for case in stress.all_cases(full=True)]
    assert len(set(names)) == len(names)
    assert max(len(name) for name in names) <= 23


def test_cases_are_chosen_by_name_and_pattern():
    assert [c.name for c in stress.chosen(["pile-2000"])] == ["pile-2000"]
    assert {c.name for c in stress.chosen(["mass-1", "pile-*"])} == {
        "mass-1", "pile-60", "pile-2000",
    }  # fmt: skip
    assert "pile-2000" not in {c.name for c in stress.chosen([])}
    assert "pile-2000" in {c.name for c in stress.chosen([], full=True)}
    with pytest.raises(ValueError, match="nonsense"):
        stress.chosen(["mass-1", "nonsense"])


def test_the_scenes_are_what_they_are_called():
    tables = {case.name: case.tables for case in stress.all_cases(full=True)}
    speed = scene_of(tables["critical-+0"], "test", "exact", None).incoming.speed
    assert abs(speed**2 / (9.81 * 0.104) - 1.0) < 1e-15
    points = tables["plate-200"]["surface"][0]["points"]
    assert np.ptp([x for x, _ in points]) == pytest.approx(0.002)
    assert tables["plate-200"]["stream"]["velocity"] == [200.0, 0.0]
    assert tables["pile-2000"]["stream"]["count"] == 2000
    # From u to 1e-9 m/s, where what is left is summed.
    drop = tables["bounces-10000"]["stream"]["at"][1] - 0.004
    restitution = tables["bounces-10000"]["surface"][0]["restitution"]
    bounces = np.log(1e-9 / np.sqrt(2.0 * 9.81 * drop)) / np.log(restitution)
    assert bounces == pytest.approx(10_000, rel=0.01)


# The table


def result(**changes):
    values = {
        "case": "c", "group": "g", "engine": "exact", "dt": None, "law": "l", "figure": 1.0,
        "bound": 2.0, "least": False, "holds": True, "detail": "d", "seconds": 0.1,
    }  # fmt: skip
    return stress.Result(**{**values, **changes})


def test_the_worst_is_the_one_nearest_to_its_bound_or_furthest_beyond():
    near, far = result(law="near", figure=1.9), result(law="far", figure=0.1)
    none = result(law="none", figure=0.0, bound=0.0)
    (run,) = harness.runs([far, near, none])
    assert (run.worst, run.failed, run.laws) == (near, (), 3)
    beyond = result(law="beyond", figure=3.0, holds=False)
    raised = result(law="raised", figure=None, bound=None, holds=False)
    (run,) = harness.runs([near, beyond])
    assert (run.worst, run.failed) == (beyond, (beyond,))
    (run,) = harness.runs([beyond, raised])
    assert run.worst == raised
    assert harness.exhausted(result(figure=2.0, bound=1.0, least=True)) == 0.5
    assert harness.exhausted(result(figure=-inf, bound=1.0, least=True, holds=False)) == inf
    assert [r.worst.dt for r in harness.runs([result(dt=1.0), result(dt=2.0)])] == [1.0, 2.0]


def test_the_file_has_every_figure_to_the_last_digit(tmp_path):
    found = [result(figure=1.0 / 3.0, detail="a\tb\nc"), result(figure=None, holds=False, dt=0.1)]
    harness.write(found, tmp_path / "out.tsv")
    assert listed(tmp_path) == ["out.tsv"]
    with (tmp_path / "out.tsv").open() as file:
        one, two = csv.DictReader(file, delimiter="\t")
    assert float(one["figure"]) == 1.0 / 3.0
    assert (one["detail"], one["holds"], one["dt"]) == ("a b c", "true", "")
    assert (two["figure"], two["holds"], two["dt"]) == ("", "false", "0.1")


# The command


def call(*arguments, code=0):
    outcome = CliRunner().invoke(main, ["stress", *map(str, arguments)])
    assert outcome.exit_code == code, outcome.output
    assert "Traceback" not in outcome.output
    return outcome


def test_the_command_prints_a_table_of_eighty_columns():
    shown = call("--engine", "exact", "--case", "end-dead-on*", "--case", "critical-+0").stdout
    assert re.search(r"\n3 cases, \d+ figures: all laws kept\n$", shown)
    assert "a plate's very end" in shown
    (row,) = re.findall(r"^ critical-\+0 .*$", shown, re.M)
    assert re.search(r"exact +- +(\d+)/\1 +\S+e\S+ +\S+e\S+  \w", row)
    assert max(len(line) for line in shown.splitlines()) <= 80


@pytest.fixture
def broken(monkeypatch):
    monkeypatch.setitem(laws.LAWS, "ledger closes", lambda e: laws.Verdict(inf, 1e-12, "of it all"))


@pytest.mark.usefixtures("broken")
def test_a_broken_law_is_told_and_is_exit_code_1(tmp_path):
    out = tmp_path / "all.tsv"
    shown = call("--engine", "exact", "--case", "mass-1", "--out", out, code=1).stdout
    assert "FAILED mass-1, exact: ledger closes: inf, more than 1e-12 of it all" in shown
    assert re.search(r"\n1 case, \d+ figures: 1 broken\n$", shown)
    assert "mass-1\tmass\texact\t\tledger closes\tinf\t1e-12\tfalse\tfalse" in out.read_text()
    told = json.loads(call("--engine", "exact", "--case", "mass-1", "--json", code=1).stdout)
    assert (told["format"], told["failed"]) == (1, 1)
    (bad,) = (r for r in told["results"] if not r["holds"])
    assert (bad["law"], bad["figure"], bad["bound"]) == ("ledger closes", None, 1e-12)
    quiet = call("--engine", "exact", "--case", "m*-1", "--case", "radius-0", "-q", code=1).stdout
    assert "FAILED mass-1" in quiet


def test_quiet_prints_only_what_fails():
    shown = call("--engine", "exact", "--case", "mass-1", "-q").stdout
    assert re.fullmatch(r"1 case, \d+ figures: all laws kept\n", shown)


def test_what_is_not_promised_is_told_with_its_reason():
    arguments = ["--engine", "pymunk", "--case", "plate-200-volley", "--case", "flight-1e6", "-q"]
    shown = call(*arguments).stdout
    assert "not promised flight-1e6, pymunk: runs to its end: not run; a flight is step" in shown
    assert re.search(r"not promised plate-200-volley, pymunk at dt = 0.001 s: no one th.*40", shown)
    assert re.search(r"\n2 cases, \d+ figures: all laws kept, 3 not promised\n$", shown)
    told = json.loads(call(*arguments, "--json").stdout)
    assert (told["failed"], told["unpromised"]) == (0, 3)


def test_the_list_names_cases_and_runs_nothing(monkeypatch):
    monkeypatch.setattr(harness, "simulate", None)
    lines = call("--list").stdout.splitlines()
    assert "plate-200\t200 m/s against a 2 mm plate" in lines
    assert not any(line.startswith("pile-2000") for line in lines)
    assert any(
        line.startswith("pile-2000") for line in call("--list", "--full").stdout.splitlines()
    )


def test_the_command_knows_the_engines():
    assert cli.stressing.ENGINES == stress.ENGINES


def test_ctrl_c_during_stress_writes_nothing(monkeypatch, tmp_path):
    def interrupts(*_arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(harness, "simulate", interrupts)
    call("--case", "mass-1", "--out", tmp_path / "out.tsv", code=130)
    assert listed(tmp_path) == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--case", "nonsense"], "nonsense"),
        (["--engine", "warp"], "warp"),
        (["--case", "pile-60", "--engine", "exact"], "none of these cases"),
        (["--case", "mass-1", "--out", "nowhere/x.tsv"], "there is no folder nowhere"),
        (["--case", "mass-1", "--out", "."], "directory"),
        (["one-too-many"], "one-too-many"),
    ],
)
def test_bad_input_is_exit_code_2(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = call(*arguments, code=2)
    assert outcome.stdout == ""
    assert said in outcome.stderr
    assert listed(tmp_path) == []


# A run that gets stuck; a run that is interrupted

ENDLESS = """
[[surface]]
name = "floor"
from = [-1.0, 0.0]
to = [1.0, 0.0]
restitution = 1.0
[stream]
at = [0.0, 0.005]
velocity = [0.0, 0.0]
[run]
until = 1e6
max_time = 1e6
"""


def stuck(loaded, **_options):
    recording = simulate(scene.from_dict(HOP))
    raise StalledError(0, 0.75, (0.25, 0.004), "it rattles", recording)


def run_stuck(monkeypatch, tmp_path, *arguments, code=1):
    monkeypatch.setattr("chutelab.engines.simulation.simulate", stuck)
    monkeypatch.chdir(tmp_path)
    outcome = CliRunner().invoke(main, ["run", "perpendicular", *arguments])
    assert outcome.exit_code == code
    return outcome.stderr


def test_a_stuck_run_says_who_and_where_and_writes_nothing(monkeypatch, tmp_path):
    said = run_stuck(monkeypatch, tmp_path, "--out", "out")
    assert "particle 0 is stuck at t = 0.75 s, x = 0.25 m, y = 0.004 m: it rattles" in said
    assert "--partial" in said
    assert listed(tmp_path) == []


def test_a_stuck_run_writes_what_there_is_if_asked(monkeypatch, tmp_path):
    said = run_stuck(monkeypatch, tmp_path, "--out", "out", "--partial", "--only", "npz,csv")
    assert "it rattles; what is written ends there" in said
    assert (listed(tmp_path / "out")) == ["events.csv", "recording.npz", "trajectory.csv"]
    saved = chutelab.Recording.load(tmp_path / "out" / "recording.npz")
    assert saved.knots.tobytes() == simulate(scene.from_dict(HOP)).knots.tobytes()


def test_partial_needs_out(monkeypatch, tmp_path):
    assert "--out" in run_stuck(monkeypatch, tmp_path, "--partial", code=2)


def interrupted(folder, *arguments, when):
    """Start a run in a folder, send SIGINT as soon as `when()` is true; return how it ends."""
    process = subprocess.Popen(
        [sys.executable, "-m", "chutelab", "run", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": SOURCES},
    )
    deadline = time.monotonic() + 60.0
    while not when() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    assert process.poll() is None, process.communicate()
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60.0)
    return process.returncode, said


def test_ctrl_c_during_a_run_leaves_nothing(tmp_path):
    (tmp_path / "endless.toml").write_text(ENDLESS)
    begun = []

    def when():
        # The folder it will write to is there: half a second later it is in the middle of the run.
        if list(tmp_path.glob(".chutelab-*")):
            begun.append(time.monotonic())
        return bool(begun) and time.monotonic() > begun[0] + 0.5

    code, said = interrupted(tmp_path, "endless.toml", "--out", "out", when=when)
    assert code == cli.program.INTERRUPTED == 130
    assert "Interrupted." in said
    assert "Traceback" not in said
    assert listed(tmp_path) == ["endless.toml"]


@pytest.mark.parametrize("name", ["overlay.png", ".lesson.gif-*"])
def test_ctrl_c_during_writing_leaves_nothing(tmp_path, name):
    def when():
        return bool(list(tmp_path.glob(f".chutelab-*/{name}")))

    code, said = interrupted(tmp_path, "free-fall", "--out", "out", when=when)
    assert code == 130
    assert "Traceback" not in said
    assert listed(tmp_path) == []
