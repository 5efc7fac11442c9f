"""Scenes become rows and runs in the page's host of the core as in Python's, to the last bit."""

import numpy as np
import pytest

import sandbox
from chutelab import core as module
from chutelab.engines import contact as engine
from chutelab.machine import build
from chutelab.pictures.live.describe import describe
from chutelab.scene import from_dict, load, parse
from live.node import ask, needs_node, page_scene

pytestmark = needs_node

SCENES = [
    ("perpendicular",), ("inclined-40",), ("stream", "stream.count=30"), ("slip",), ("spoon",),
    ("cascade",), ("two-sizes",), ("hopper", "stream.count=40"), ("inclined-conveyor",),
    ("perpendicular", "incoming.friction=0.5", "run.until=settled"),
    ("belt-landing",), ("free-fall",), ("low-speed",), ("mixture", "stream.fines.count=30"),
    ("slip", "particle.shape=sphere", "particle.spin=true"),
    *(("stream", "stream.count=20", f"stream.seed={seed}") for seed in (2**32, 2**53 - 1)),
]  # fmt: skip
MANY = [("stream", "stream.count=60"), ("hopper", "stream.count=150")]


def same_runs(scenes):
    told = [page_scene(scene) for scene in scenes]
    lab = describe(load("perpendicular"))
    answers = ask("core.mjs", {"lab": lab, "scenes": [given for given, _ in told]})
    for (given, scene), answer in zip(told, answers, strict=True):
        assert parse(answer["toml"]) == scene, given
        job = engine.Job(module.Module(), build(scene))
        assert job.run(None) is None
        job.drain()
        assert answer["state"] == "done"
        knots = np.concatenate(job.knots)
        ours = knots.view("<f8").reshape(-1, 10)[:, :9]
        its = np.array(answer["knots"]).reshape(-1, 10)
        assert np.array_equal(its[:, :9], ours), given
        assert np.array_equal(its[:, 9], knots["disk"]), given
        events = np.concatenate(job.events)
        assert [event["t"] for event in answer["events"]] == events["t"].tolist(), given
        assert [event["kind"] for event in answer["events"]] == events["kind"].tolist(), given
        books = job.module.array("books", engine.REAL, 3 * (job.owners + 1)).reshape(-1, 3)
        assert np.array_equal(np.array(answer["books"]), books), given


@pytest.mark.parametrize("scenes", [SCENES, pytest.param(MANY, marks=pytest.mark.slow)])
def test_the_pages_host_runs_every_kind_of_scene_as_python_does(scenes):
    same_runs([load(name, overrides) for name, *overrides in scenes])


@pytest.mark.parametrize("count", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_it_runs_scenes_with_any_keys_as_python_does(count):
    same_runs([from_dict(sandbox.tables(seed)) for seed in range(count)])
