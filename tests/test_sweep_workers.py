"""Who does the work of a sweep: nothing depends on it, nor on whether they all stay alive."""

from __future__ import annotations

import os
import signal
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from chutelab.scene import load
from chutelab.studies.sweep import LostWorkersError, crew, planned, sweep, sweep_to


@pytest.fixture(scope="module")
def stepped(tmp_path_factory):
    """A sweep of 40 rows in blocks of one, and its file as this process writes it."""
    out = tmp_path_factory.mktemp("whole") / "rows.csv"
    plan = planned(load("perpendicular"), ["plate.angle_deg=-20:20:40"], engine="pymunk")
    with crew() as team:
        sweep_to(plan, out, team)
    return plan, out.read_bytes()


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def deadly(job):
    """Return a number; the first process that gets to the third one dies of it."""
    number, mark = job
    if number == 3 and not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def fatal(_):
    os.kill(os.getpid(), signal.SIGKILL)


def test_processes_write_the_same_bytes(stepped):
    plan, whole = stepped
    with crew(2) as team:
        sweep_to(plan, "rows.csv", team)
    assert Path("rows.csv").read_bytes() == whole


def test_a_process_that_dies_costs_time_only(tmp_path):
    jobs = [(number, (number, str(tmp_path / "mark"))) for number in range(8)]
    with crew(2) as team:
        assert sorted(team.results(deadly, jobs)) == [(n, n * n) for n in range(8)]
    assert (tmp_path / "mark").exists()


def test_processes_that_keep_dying_are_given_up():
    with pytest.raises(LostWorkersError, match="keep dying"), crew(2) as team:
        list(team.results(fatal, [(0, 0)]))


def test_any_executor_will_do():
    scene = load("perpendicular", ["stream.count=2"])
    with ProcessPoolExecutor(1) as executor:
        found = sweep(scene, ["plate.angle_deg=0:10:3"], executor=executor)
    here = sweep(scene, ["plate.angle_deg=0:10:3"])
    assert found.to_csv("there.csv").read_bytes() == here.to_csv("here.csv").read_bytes()


def test_a_cluster_that_loses_a_worker_writes_the_same_bytes(stepped):
    distributed = pytest.importorskip("distributed")
    plan, whole = stepped
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        silence_logs=False,
    ) as cluster:  # fmt: skip
        first = next(iter(cluster.workers.values())).pid
        killed = []

        def kill(share):
            if share > 0.2 and not killed:
                killed.append(share)
                os.kill(first, signal.SIGKILL)

        with crew(scheduler=cluster.scheduler_address) as team:
            sweep_to(plan, "rows.csv", team, progress=kill)
    assert killed
    assert Path("rows.csv").read_bytes() == whole
