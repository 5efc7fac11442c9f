"""Every demand of single cases can fail, the watchdog bites, the cases are all there."""

import time
from math import inf

import pytest

from chutelab.checks.stress import Verdict, laws
from chutelab.scene import SceneError
from stress import cases, demands, runs
from stress.case import Case, Twin, merged
from stress.runs import HOP, adder, evidence


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


# A case, run and judged


def test_a_broken_law_a_broken_demand_and_another_twin_are_found(monkeypatch):
    monkeypatch.setitem(laws.LAWS, "ledger closes", lambda e: Verdict(inf, 1e-12, "of it all"))
    away = Twin("mirror symmetry", HOP, lambda p: p * [-1.0, 1.0])
    case = Case("hop", "test", HOP, ends=("settled",), twin=away)
    found = runs.findings(case, "exact", None)
    broken = [one.law for one in found if one.broken]
    assert broken == ["ledger closes", "ends as it must", "mirror symmetry"]


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


# The cases
