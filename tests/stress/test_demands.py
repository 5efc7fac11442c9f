"""Every demand of single cases can fail, the watchdog bites, the cases are all there."""

import signal
import time
from math import inf, isnan, nan

import numpy as np
import pytest

from chutelab.checks.stress import Verdict, laws
from chutelab.engines.simulation import simulate
from chutelab.scene import SceneError
from stress import cases, demands, runs
from stress.case import ENGINES, Case, Ladder, Twin, merged, scene_of
from stress.runs import HOP, PAIR, adder, evidence


def test_endings_boxes_and_rest_can_be_broken():
    e = evidence()
    assert demands.ended(e, ("time",)).holds
    assert demands.ended(e, ("settled", "landed")).figure == 2
    assert demands.inside(e, (-1.0, 2.0, 0.0, 1.0)).holds
    assert demands.inside(e, (-1.0, 2.0, 0.0, 0.2)).figure == 2
    assert not demands.still(evidence(merged(HOP, {"run": {"until": 0.3}}))).holds
    resting = merged(HOP, {"stream": {"at": [0.0, 0.004], "velocity": [0.0, 0.0], "count": 1}})
    assert demands.still(evidence(resting)).holds
    assert demands.sunk(evidence(resting)).holds
    low = evidence(resting, knots=adder("position", -1, [0.0, -0.0002]))
    assert demands.sunk(low).figure == pytest.approx(0.05, rel=1e-9)
    assert not demands.sunk(low).holds


MIRROR = Twin("mirror symmetry", {}, lambda p: p * [-1.0, 1.0])


def test_a_twin_that_moves_elsewhere_is_no_twin():
    one, other = evidence(HOP), evidence(cases.mirrored(HOP))
    assert demands.symmetric(one, other, MIRROR).figure < 1e-15
    assert demands.symmetric(one, other, MIRROR).holds
    off = evidence(cases.mirrored(HOP), knots=adder("position", 1, [1e-6, 0.0]))
    assert demands.symmetric(one, off, MIRROR).figure == pytest.approx(1e-6, rel=0.1)
    assert not demands.symmetric(one, off, MIRROR).holds
    assert not demands.symmetric(one, evidence(HOP), MIRROR).holds
    shorter = evidence(merged(cases.mirrored(HOP), {"run": {"until": 0.9}}))
    assert not demands.symmetric(one, shorter, MIRROR).holds


def test_moved_and_mirrored_scenes_are_that():
    there = cases.moved(HOP, 3.0, 4.0)
    assert there["surface"][0]["points"] == [[2.0, 4.0], [5.0, 4.0]]
    assert there["stream"]["at"] == [3.0, 4.3]
    assert there["stream"]["velocity"] == [0.5, 0.0]
    assert cases.mirrored(HOP)["stream"]["velocity"] == [-0.5, 0.0]
    assert HOP["stream"]["at"] == [0.0, 0.3]


def fitted(errors, floor=1e-10):
    steps = tuple(2.0**-n for n in range(len(errors)))
    return demands.order(Ladder(steps, lambda recording: 0.0, floor), errors)


def test_the_order_of_convergence_is_the_slope_until_rounding():
    assert fitted([1e-2 / 4**n for n in range(5)]) == pytest.approx(2.0)
    assert fitted([1e-2 / 2**n for n in range(5)]) == pytest.approx(1.0)
    assert fitted([1e-2 / 2 ** (n / 3) for n in range(5)]) == pytest.approx(1.0 / 3.0)
    assert fitted([1e-2] * 5) == pytest.approx(0.0)
    assert fitted([1e-6, 1e-9, 1e-11, 1e-12, 1e-11]) > 2.0
    assert fitted([1e-2, 1e-4, 2.5e-3, 1e-6, 6e-4]) == pytest.approx(1.0, abs=0.05)
    assert fitted([1e-11, 1e-12, 1e-11]) == inf
    assert fitted([1e-6, 1e-11, 1e-11, 1e-6]) == pytest.approx(0.0)
    assert fitted([1e-11, 1e-6, 1e-6, 1e-6]) == pytest.approx(0.0)
    assert isnan(fitted([1e-2, 1e-3, nan, 1e-5]))


def test_two_of_the_halvings_are_left_to_chance():
    steps = (1.0, 0.5, 0.25, 0.125, 0.0625)
    assert Ladder(steps, lambda recording: 0.0, 1e-9).order == 0.5
    assert Ladder(steps, lambda recording: 0.0, 1e-9, claimed=2.0).order == 1.5


# A case, run and judged


def test_a_run_is_judged_by_every_law_that_applies():
    found = runs.findings(Case("hop", "test", HOP, ends=("time",)), "exact", None)
    assert [one.law for one in found] == [
        "finite numbers", "time goes forward", "none lost", "lasts to the end",
        "no one through", "no one inside", "bounces off something", "released into room",
        "friction of the pair", "rebound of the pair", "energy never rises", "ledger closes",
        "ends as it must",
    ]  # fmt: skip
    assert all(one.holds for one in found)


def test_a_broken_law_a_broken_demand_and_another_twin_are_found(monkeypatch):
    monkeypatch.setitem(laws.LAWS, "ledger closes", lambda e: Verdict(inf, 1e-12, "of it all"))
    away = Twin("mirror symmetry", HOP, lambda p: p * [-1.0, 1.0])
    case = Case("hop", "test", HOP, ends=("settled",), twin=away)
    found = runs.findings(case, "exact", None)
    broken = [one.law for one in found if one.broken]
    assert broken == ["ledger closes", "ends as it must", "mirror symmetry"]


def test_engine_step_and_alignment_are_those_that_are_asked_for(monkeypatch):
    asked = []

    def note(loaded, *, engine, progress):
        asked.append((engine, loaded.run.engine, loaded.run.dt, loaded.run.align))
        return simulate(loaded, engine="exact")

    monkeypatch.setattr(runs, "judged", note)
    for engine in ENGINES:
        runs.run(HOP, engine, None if engine == "exact" else 0.02)
    assert asked == [
        ("exact", "exact", 1e-3, True),
        ("contact", "contact", 0.02, True),
        ("pymunk", "pymunk", 0.02, True),
        ("pymunk", "pymunk", 0.02, False),
    ]


def test_a_scene_that_must_be_refused_and_one_that_must_not():
    point = merged(HOP, {"particle": {"radius": 0.0}})
    must = Case("point", "test", point, refusals={"pymunk": "run.engine"})
    assert runs.findings(must, "pymunk", 1e-3) == []
    may = must.but(refusals={}, may_refuse={"pymunk": "run.engine"})
    assert runs.findings(may, "pymunk", 1e-3) == []
    for wrong in ({"pymunk": "plate.above"}, {}):
        with pytest.raises(SceneError, match=r"run\.engine"):
            runs.findings(must.but(refusals=wrong), "pymunk", 1e-3)
    with pytest.raises(AssertionError, match="ought to be refused"):
        runs.findings(Case("hop", "test", HOP, refusals={"exact": "run.engine"}), "exact", None)


@pytest.mark.parametrize("calls", [True, False])
def test_the_watchdog_ends_what_never_would(monkeypatch, calls):
    def hangs(_loaded, *, engine, progress):
        while True:
            time.sleep(0.005)
            if calls:
                progress(0.5)

    monkeypatch.setattr(runs, "judged", hangs)
    begin = time.perf_counter()
    with pytest.raises(runs.OverdueError, match=r"not done after 0\.05 s of wall time"):
        runs.findings(Case("hang", "test", HOP, patience=0.05), "exact", None)
    assert time.perf_counter() - begin < 2.0


def test_the_watchdog_leaves_no_alarm_behind():
    before = signal.getsignal(signal.SIGALRM)
    with runs.bounded(0.05):
        pass
    time.sleep(0.2)
    assert signal.getsignal(signal.SIGALRM) is before


def test_demands_on_places_are_not_promised_where_disks_outrun_their_steps():
    """A disk at 200 m/s and steps of 0.1 s: it leaves the box, 1000 radii a step."""
    box = merged(PAIR, {"stream": {"velocity": [200.0, 0.0]}, "run": {"until": 1.0}})
    case = Case("away", "test", box, inside=(-0.5, 0.5, -0.5, 0.5), ends=("landed",))
    found = {one.law: one for one in runs.findings(case, "pymunk", 0.1)}
    assert "radii in a step" in found["nobody leaves"].unpromised
    assert not found["nobody leaves"].broken
    assert found["ends as it must"].broken
    promised = {one.law: one for one in runs.findings(case, "contact", 0.1)}
    assert promised["nobody leaves"].broken


# The cases


def test_every_case_of_the_list_is_there():
    groups = {case.group for case in cases.all_cases()}
    assert groups == {
        "200 m/s against a 2 mm plate", "radius", "mass", "restitution", "friction", "belt speed",
        "g = 0", "grazing plates", "v²/(g R) within 1e-15 of 1", "a plate's very end",
        "released in contact or overlapping", "two impacts at one instant",
        "ten thousand bounces", "10^6 s of flight without gravity", "time far from zero",
        "a pile left alone", "dt 1/30", "shifted by 10^6 m", "mirrored",
        "steps halved until rounding takes over", "drawn at random",
    }  # fmt: skip


def test_names_are_unique_on_each_engine():
    for engine in ENGINES:
        names = [case.name for case in cases.all_cases() if engine in case.engines]
        assert names
        assert len(set(names)) == len(names)


def test_the_scenes_are_what_they_are_called():
    tables = {case.name: case.tables for case in cases.all_cases()}
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
