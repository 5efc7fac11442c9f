"""A case run within its time and judged; small runs with a number in them moved.

A watchdog bounds the processor time of each run: a busy machine makes none overdue.
"""

import json
import signal
import threading
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from time import process_time

from chutelab.checks.stress import Evidence, judge, unseen
from chutelab.engines.simulation import judged
from chutelab.results.recorder import StalledError
from chutelab.scene import SceneError
from stress.case import PATIENCE, by_name, scene_of, surface, thrown
from stress.demands import UNSEEN, demands, symmetric


class OverdueError(RuntimeError):
    """A run took longer than it may."""


@contextmanager
def bounded(seconds):
    """Give a progress callback that raises `OverdueError` when the time is up.

    An engine that has stopped to report progress is ended too, by an alarm of the operating system;
    where there is none (Windows, another thread than the main one) the callback alone has to do.

    Parameters
    ----------
    seconds : float
        Processor time, s.
    """
    end = process_time() + seconds

    def overdue():
        return OverdueError(f"not done after {seconds:g} s of processor time")

    def report(_share):
        if process_time() > end:
            raise overdue()

    def ring(_number, _frame):
        raise overdue()

    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGPROF"):
        yield report
        return
    before = signal.signal(signal.SIGPROF, ring)
    # Later than the callback's own time, which tells more about where the engine was; and again,
    # because what is raised in a callback from C is lost.
    signal.setitimer(signal.ITIMER_PROF, 1.1 * seconds + 0.1, 0.1)
    try:
        yield report
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def run(tables, engine, dt, patience=PATIENCE, name="test"):
    """Simulate a scene on one of `case.ENGINES`; dt is None for the exact one."""
    scene = scene_of(tables, name, engine, dt)
    with bounded(patience) as progress:
        recording = judged(scene, engine=by_name(engine), progress=progress)
    return Evidence(recording)


def findings(case, engine, dt):
    """Run a case and judge it by all laws and by what it asks for besides.

    Returns nothing if the engine refuses the scene, or says that it is stuck there, and must.

    Raises
    ------
    AssertionError
        If the engine runs what it must refuse, or what has no end.
    SceneError
        If it refuses what it must run, or for another reason.
    """
    expected = case.refusals.get(engine, "")
    try:
        e = run(case.tables, engine, dt, case.patience, case.name)
    except SceneError as error:
        allowed = expected or case.may_refuse.get(engine, "")
        if any(fault.key == allowed for fault in error.faults):
            return []
        raise
    except StalledError:
        if engine in case.driven:
            return []
        raise
    assert engine not in case.driven, "its blows have no end, and the engine does not tell"
    assert not expected, f"it runs, but ought to be refused for {expected}"
    found = judge(e)
    for name, verdict in demands(case, e).items():
        excused = name in UNSEEN and not verdict.holds
        found.append(replace(verdict, law=name, unpromised=unseen(e) if excused else ""))
    if case.twin is not None:
        other = run(case.twin.tables, engine, dt, case.patience, case.name)
        found.append(replace(symmetric(e, other, case.twin), law=case.twin.law))
    return found


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


ASIDE = {
    "lasts to the end": "a track that ends early is right as far as it goes",
    "bounces off something": "a run does not compare its table of events with its tracks",
    "friction of the pair": "a run does not compare its table of events with its tracks",
    "rebound of the pair": "a run does not compare its table of events with its tracks",
    "loads": "a run does not compare what its surfaces bear with its tracks",
    "released into room": "a run does not compare its table of events with its tracks",
}
"""Laws of `chutelab.checks.stress` that a run does not judge itself by, and why: what breaks only
these keeps places, sides, energy and ledger."""


@cache
def _kept(tables, engine, dt):
    return run(json.loads(tables), engine, dt)


def evidence(tables=HOP, engine="exact", dt=None, **changes):
    """Return a run, with the arrays named in `changes` handed to a function that may spoil them.

    A fault that is planted so and breaks a law of `chutelab.checks.stress` breaks one of those that
    every run judges itself by, too, unless it is one that `ASIDE` gives a reason for.
    """
    e = _kept(json.dumps(tables), engine, dt)
    spoilt = {name: getattr(e.recording, name).copy() for name in changes}
    for name, change in changes.items():
        change(spoilt[name])
    e = replace(e, recording=replace(e.recording, **spoilt))
    if changes and not e.recording.laws:
        assert {one.law for one in judge(e) if not one.holds} <= set(ASIDE)
    return e


def adder(field, row, amount):
    """Return a function that moves one number of a structured array."""

    def change(array):
        array[field][row] += amount

    return change
