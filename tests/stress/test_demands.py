"""Every demand of single cases can fail, the watchdog bites, the cases are all there."""

import time

import pytest

from chutelab.scene import SceneError
from stress import runs
from stress.case import Case, merged
from stress.runs import HOP


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
            end = time.process_time() + 0.005
            while time.process_time() < end:
                pass
            if calls:
                progress(0.5)

    monkeypatch.setattr(runs, "judged", hangs)
    begin = time.process_time()
    with pytest.raises(runs.OverdueError, match=r"not done after 0\.05 s of processor time"):
        runs.findings(Case("hang", "test", HOP, patience=0.05), "exact", None)
    assert time.process_time() - begin < 2.0
