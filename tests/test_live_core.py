"""The page's host of the core does what Python's does, to the last bit."""

import numpy as np

from chutelab.core import module
from chutelab.engines import contact as engine
from chutelab.machine import build
from chutelab.scene import load
from live.machines import as_page_has_it, plain
from live.node import ask, needs_node

pytestmark = needs_node

SCENES = [
    "perpendicular", "inclined-40", "stream", "slip", "spoon", "cascade", "two-sizes",
    ("hopper", "stream.count=150"), ("stream", "stream.interact=true", "stream.count=60"),
    "inclined-conveyor",
]  # fmt: skip


def test_the_pages_host_runs_every_kind_of_scene_as_python_does():
    machines = []
    for row in SCENES:
        name, *overrides = (row,) if isinstance(row, str) else row
        machines.append(build(load(name, overrides)))
    answers = ask("core.mjs", plain([as_page_has_it(machine) for machine in machines]))
    for row, machine, answer in zip(SCENES, machines, answers, strict=True):
        job = engine.Job(module.Module(), machine)
        assert job.run(None) is None
        assert answer["state"] == "done"
        knots = np.concatenate(job.knots)
        ours = knots.view("<f8").reshape(-1, 10)[:, :9]
        its = np.array(answer["knots"]).reshape(-1, 10)
        assert np.array_equal(its[:, :9], ours), row
        assert np.array_equal(its[:, 9], knots["disk"]), row
        events = np.concatenate(job.events)
        assert [event["t"] for event in answer["events"]] == events["t"].tolist(), row
        assert [event["kind"] for event in answer["events"]] == events["kind"].tolist(), row
        books = job.module.array("books", engine.REAL, 3 * (job.owners + 1)).reshape(-1, 3)
        assert np.array_equal(np.array(answer["books"]), books), row
