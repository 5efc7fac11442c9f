"""Processes of a sweep: its rows depend neither on how many there are, nor on whether one dies."""

import os
import re
import signal
import socket
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from threading import Thread, active_count
from time import monotonic, sleep

import pytest
from click.testing import CliRunner

import chutelab
from chutelab.cli import main
from chutelab.scene import load
from chutelab.studies.sweep import LostWorkersError, crew, sweep_to
from chutelab.studies.sweep.part import part_of
from typed import planned, sweep


@pytest.fixture(scope="module")
def stepped(tmp_path_factory):
    """A sweep of 16 rows in blocks of one, and its file as this process writes it."""
    out = tmp_path_factory.mktemp("whole") / "rows.csv"
    plan = planned(load("perpendicular"), ["plate.angle_deg=-20:20:16"], engine="pymunk")
    with crew() as team:
        sweep_to(plan, out, team)
    return plan, out.read_bytes()


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def deadly(job):
    """Return a number; the first process that gets to the third one dies of it."""
    # Ctrl-C is for the first process: others would print tracebacks.
    assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    number, mark = job
    if number == 3 and not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def test_processes_write_the_same_bytes_and_one_that_dies_costs_time_only(stepped, tmp_path):
    plan, whole = stepped
    jobs = [(number, (number, str(tmp_path / "mark"))) for number in range(8)]
    with crew(2) as team:
        sweep_to(plan, "rows.csv", team)
        assert Path("rows.csv").read_bytes() == whole
        assert sorted(team.results(deadly, jobs)) == [(n, n * n) for n in range(8)]
    assert (tmp_path / "mark").exists()


@pytest.mark.slow
def test_processes_that_keep_dying_are_given_up():
    with pytest.raises(LostWorkersError, match="keep dying"), crew(2) as team:
        list(team.results(signal.raise_signal, [(0, signal.SIGKILL)]))


def test_any_executor_will_do():
    scene = load("perpendicular", ["stream.count=2"])
    with ProcessPoolExecutor(1) as executor:
        found = sweep(scene, ["plate.angle_deg=0:10:3"], executor=executor)
    here = sweep(scene, ["plate.angle_deg=0:10:3"])
    assert found.to_csv("there.csv").read_bytes() == here.to_csv("here.csv").read_bytes()


@pytest.mark.slow
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


# schedulers that are none, or go ------------------------------------------------------------------


def served(stack, answer):
    """Listen at a port, answer with these bytes, and return the port."""
    listening = stack.enter_context(socket.create_server(("127.0.0.1", 0)))

    def serve():
        while True:
            try:
                caller, _ = listening.accept()
            except OSError:
                return
            stack.callback(caller.close)
            if answer is not None:
                caller.sendall(answer)

    Thread(target=serve, daemon=True).start()
    return listening.getsockname()[1]


@pytest.mark.parametrize("answer", [None, b"HTTP/1.1 400 Bad Request\r\n\r\n", b"\xff" * 4096])
def test_another_program_at_the_port_is_no_scheduler(monkeypatch, capfd, answer):
    pytest.importorskip("distributed")
    monkeypatch.setattr("chutelab.studies.sweep.PATIENCE", 1.0)
    with ExitStack() as stack:
        address = f"tcp://127.0.0.1:{served(stack, answer)}"
        refused = swept_at(address)
    assert refused.exit_code == 2
    assert f"--scheduler {address}: no Dask scheduler answers" in refused.stderr
    assert refused.stderr.count("\n") == 1
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("tcp://127.0.0.1:9", "nothing in 1 s"),
        ("tls://127.0.0.1:9", "TLS expects"),
        ("foo://127.0.0.1:9", "unknown address scheme 'foo'"),
        ("127.0.0.1", "must be like tcp://10.0.0.1:8786"),
    ],
)
def test_an_address_without_a_scheduler_is_refused(monkeypatch, capfd, address, said):
    pytest.importorskip("distributed")
    monkeypatch.setattr("chutelab.studies.sweep.PATIENCE", 1.0)
    before = active_count()
    refused = swept_at(address)
    # A thread that goes on asking would draw random numbers in the midst of other tests.
    assert active_count() == before
    assert refused.exit_code == 2
    assert f"--scheduler {address}: " in refused.stderr
    assert said in refused.stderr
    assert refused.stderr.count("\n") == 1
    assert capfd.readouterr().err == ""


def swept_at(address):
    command = ["sweep", "perpendicular", "--vary", "plate.angle_deg=0:10:3", "--scheduler", address]
    return CliRunner().invoke(main, command)


LOST = """
import sys
import distributed
from chutelab.cli import main
from chutelab.studies import sweep as sweeping

if __name__ == "__main__":
    sweeping.PATIENCE = 2.0
    sys.exit(main())
"""


@pytest.mark.slow
@pytest.mark.parametrize("lost", ["killed", "stopped", "workers"])
def test_a_cluster_that_is_lost_ends_a_sweep_in_one_message(lost):
    """Of the scheduler killed, or stopped, or of all workers killed."""
    pytest.importorskip("distributed")
    Path("lost.py").write_text(LOST)
    with ExitStack() as stack:
        address, scheduler, worker = clustered(stack)
        command = ["sweep", "perpendicular", "--vary", "plate.angle_deg=-20:20:5000"]
        command += ["--engine", "pymunk", "--out", "rows.csv", "--scheduler", address]
        running = begun(stack, "lost.py", *command, stderr=subprocess.PIPE, text=True)
        part = part_of(Path("rows.csv"))
        waited(lambda: part.exists() and part.read_bytes().count(b"\n") > 3)
        if lost == "workers":
            worker.kill()
        else:
            scheduler.send_signal(signal.SIGKILL if lost == "killed" else signal.SIGSTOP)
        _, said = running.communicate(timeout=30)
    assert running.returncode == 1
    assert said.count("\n") == 1
    assert "the workers or the scheduler are gone" in said
    assert "rows.csv.part has the finished rows; --resume goes on" in said


@pytest.mark.slow
def test_a_worker_with_another_version_is_refused():
    pytest.importorskip("distributed")
    other = Path("other/chutelab-9.9.dist-info")
    other.mkdir(parents=True)
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: chutelab\nVersion: 9.9\n")
    with ExitStack() as stack:
        address, *_ = clustered(stack, path=[str(other.parent.absolute())])
        refused = swept_at(address)
    assert refused.exit_code == 2
    assert re.search(r"tcp://\S+ has chutelab 9\.9, and here is \d", refused.stderr)
    assert refused.stderr.count("\n") == 1


def begun(stack, *command, path=(), **how):
    """Start a Python process that ends with the stack; `path` goes before this chutelab."""
    sources = [*path, str(Path(chutelab.__file__).parent.parent)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sources)}
    running = subprocess.Popen([sys.executable, *command], env=environment, **how)
    stack.callback(running.wait)
    stack.callback(running.kill)
    return running


def clustered(stack, path=()):
    """Start a scheduler and a worker; return the address and both."""
    where = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    alone = ["--nthreads", "1", "--no-nanny", "--no-dashboard"]
    with Path("log").open("w") as log:
        scheduler = begun(stack, "-m", "distributed.cli.dask_scheduler", *where, stderr=log)
        address = waited(lambda: re.search(r"tcp://127.0.0.1:\d+", Path("log").read_text()))[0]
        start = ["-m", "distributed.cli.dask_worker", address, *alone]
        worker = begun(stack, *start, path=path, stderr=log)
    waited(lambda: "Registered to:" in Path("log").read_text())
    return address, scheduler, worker


def waited(holds):
    """Wait until something holds, for a minute at most, and return what it gives."""
    patience = monotonic() + 60.0
    while not (found := holds()):
        assert monotonic() < patience
        sleep(0.1)
    return found
