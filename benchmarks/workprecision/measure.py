"""Measuring: one record for each case, method and value of the parameter.

Also measured: the whole process with its imports, as one waits for it on the command line, and time
and memory against the number of particles.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import cast

import numpy as np

from chutelab.checks.workprecision import REPEATS, Stopwatch, clocked
from chutelab.results import Recording
from chutelab.results.ledger import ledger
from chutelab.scene import Scene, from_dict, to_dict
from chutelab.util.arrays import Floats
from workprecision.cases import (
    Answer,
    Case,
    MissedError,
    cases,
    frames_of,
    overlaps,
    typical,
    worst,
)
from workprecision.methods import METHODS, Method, UnableError
from workprecision.records import Record, Size

PATIENCE = 2.0
"""s of repeats of one measurement, after which no further one is begun."""

QUICK_PATIENCE = 0.5
"""The same in a quick run."""

TRACEABLE = 4.0
"""Runs that take longer than so many times the patience are not repeated under `tracemalloc`, which
takes two to three times as long."""


def measure(
    names: Sequence[str],
    methods: Sequence[str],
    *,
    repeats: int = REPEATS,
    quick: bool = False,
    progress: Callable[[float], None] | None = None,
) -> list[Record]:
    """Measure methods on cases.

    Parameters
    ----------
    names, methods : sequence of str
        Of `cases` and of `METHODS`.
    repeats : int
        Timed runs after the first one, at most; fewer where they take longer than `PATIENCE`.
    quick : bool
        Fewer values of the parameters, and less patience.
    progress : callable, optional
        Called with the share that is done.

    Returns
    -------
    list of Record
        Nothing is left out: what failed says why.
    """
    known, patience = cases(), QUICK_PATIENCE if quick else PATIENCE
    tasks = [
        [
            (known[name], METHODS[m], value)
            for m in methods
            for value in METHODS[m].chosen(name, quick=quick)
        ]
        for name in names
    ]
    total, done, records = sum(map(len, tasks)), 0, []
    for case in tasks:
        trials = []
        for task in case:
            if progress is not None:
                progress(done / total)
            trials.append(Trial(*task, patience=patience))
            done += 1
        # In turn, so that a machine that gets busy is busy for all.
        for _ in range(repeats):
            for trial in trials:
                trial.repeat()
        records += [trial.record() for trial in trials]
    return list(_shifted(records))


class Trial:
    """One method on one case with one value of its parameter, run once and judged.

    The first run is told apart from the repeats: it fills caches. Memory is the peak of what Python
    and NumPy allocate in a run of its own, under `tracemalloc`; what Pymunk's C code allocates is
    not in it.

    Parameters
    ----------
    patience : float
        s of repeats, after which no further one is begun.
    """

    def __init__(self, case: Case, method: Method, value: float | None, *, patience: float) -> None:
        self._case, self._patience = case, patience
        self._watch: Stopwatch | None = None
        parameter = "" if value is None else method.parameter
        self._said = Record(case.name, method.name, parameter, value)
        try:
            method.load()
            scenes = [method.prepare(scene, value) for scene in case.scenes]
            run = partial(method.run, case.name, scenes[0], value)
            first, found = clocked(run)
            # What a run says is looked at before it is repeated: a failure is not worth the time.
            others = [method.run(case.name, scene, value) for scene in scenes[1:]]
            self._said = judge(case, [found, *others], self._said)
            self._watch = Stopwatch(run, first, patience)
        except Exception as error:  # one method that breaks must not cost the others' figures
            self._said = replace(self._said, failed=reason(error))

    def repeat(self) -> None:
        """Measure once more, unless it failed or patience is at its end."""
        if self._watch is not None:
            self._watch.repeat()

    def record(self) -> Record:
        """Return what is known, with the memory of one more run."""
        watch = self._watch
        if watch is None:
            return self._said
        return replace(
            self._said,
            first=watch.first,
            repeats=len(watch.times),
            median=watch.median,
            memory=traced(watch.run) if watch.first <= TRACEABLE * self._patience else None,
        )


def reason(error: Exception) -> str:
    """Return why something failed, on one line."""
    said = " ".join(str(error).split())
    expected = isinstance(error, (UnableError, MissedError))
    return said if expected else f"{type(error).__name__}: {said}"


def traced(run: Callable[[], object]) -> int:
    """Return the peak (bytes) of what Python and NumPy allocate during a call."""
    gc.collect()
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def judge(case: Case, found: Sequence[object], blank: Record) -> Record:
    """Return a record with the error of what a method found, one thing for each machine.

    Raises
    ------
    MissedError
        If a particle did not get where the case ends.
    """
    recordings = [one for one in found if isinstance(one, Recording)]
    residual = max((ledger(one).relative_residual for one in recordings), default=None)
    blank = replace(blank, residual=residual)
    if case.reference is None or case.read is None:
        return _judged_crowd(case.scenes[0], found[0], blank)
    errors, missed = [], []
    for scene, one in zip(case.scenes, found, strict=True):
        answer = case.read(one) if isinstance(one, Recording) else cast("Answer", one)
        try:
            errors.append(worst(answer, case.reference(scene)))
        except MissedError as why:
            missed.append(str(why))
    if missed:
        where = f", in {len(missed)} of {len(found)} machines" if len(found) > 1 else ""
        raise MissedError(f"{missed[0]}{where}")
    error, quantity = max(errors)
    return replace(blank, error=error, quantity=quantity)


def _judged_crowd(scene: Scene, found: object, blank: Record) -> Record:
    seen = frames_of(found) if isinstance(found, Recording) else cast("Floats", found)
    belt, out = scene.incoming, scene.outgoing
    assert belt is not None
    assert out is not None
    last = seen[-1]
    # A particle that has left the scene is in no frame, and left it downwards.
    lost = int(np.count_nonzero(~(last[:, 1] > belt.pulley_radius - out.drop)))
    if lost:
        raise MissedError(f"{lost:,} of {len(last):,} fell through the belt")
    overlap = overlaps(seen, scene.particle.radius)
    return replace(
        blank,
        error=typical(overlap),
        quantity="overlap",
        overlap=float(overlap.max(initial=0.0)),
        place=float(last[:, 0].mean()),
    )


def _shifted(records: Sequence[Record]) -> Iterator[Record]:
    """Compare mean places with that of the finest run, the one that overlaps least."""
    placed = [(one.error, one.place) for one in records if one.error is not None]
    finest = min(((e, place) for e, place in placed if place is not None), default=(0.0, 0.0))[1]
    for one in records:
        shift = None if one.place is None else abs(one.place - finest)
        yield replace(one, place_shift=shift)


PROCESS = "process"

COMMANDS = {
    "run": ("-m", "chutelab", "run", "perpendicular", "--json"),
    "numpy": ("-c", "import numpy"),
}
"""What this Python is started with, by the name of the row."""


def whole_process(repeats: int) -> list[Record]:
    """Measure `COMMANDS` in turn, so that a busy machine slows all of them alike.

    The first round is told apart: it may find files that are not in memory yet. Memory is not
    measured.
    """
    rounds = [{name: _clocked(name) for name in COMMANDS} for _ in range(repeats + 1)]
    records = []
    for name in COMMANDS:
        times = [one[name][0] for one in rounds]
        error, failed = rounds[0][name][1:]
        records.append(
            Record(PROCESS, name, failed=failed)
            if failed
            else Record(
                PROCESS,
                name,
                first=times[0],
                repeats=len(times) - 1,
                median=float(np.median(times[1:] or times)),
                error=error,
            )
        )
    return records


def _clocked(name: str) -> tuple[float, float | None, str]:
    """Return the seconds of a process, the error it reports, and why it failed."""
    sources = str(Path(__file__).parents[2] / "src")
    path = os.pathsep.join([sources, *filter(None, [os.environ.get("PYTHONPATH")])])
    begin = perf_counter()
    done = subprocess.run(
        [sys.executable, *COMMANDS[name]],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path},
    )
    seconds = perf_counter() - begin
    if done.returncode:
        said = done.stderr.strip().splitlines()
        return seconds, None, f"exit status {done.returncode}: {said[-1] if said else 'no message'}"
    error = json.loads(done.stdout)["error"]["max"] if done.stdout else None
    return seconds, error, ""


COUNTS = {
    "independent": (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000),
    "interacting": (10, 30, 100, 300, 1_000, 3_000),
}
"""Particles, by case; a longer stream at the same rate, each until it has landed."""

QUICK = {"independent": 10_000, "interacting": 100}
"""The most of them in a quick run."""

RUNS = {"independent": ("exact", "contact"), "interacting": ("contact", "fixed")}
"""Methods, by case."""

STEP = 1e-3
"""s; step of the methods that have one."""

SCALING_PATIENCE = 3.0
"""s of repeats of one size, after which no further one is begun."""

TRACEABLE_SIZE = 60.0
"""s; longer runs are not repeated under `tracemalloc`."""


def scaling(
    names: Sequence[str],
    methods: Sequence[str],
    *,
    repeats: int = REPEATS,
    quick: bool = False,
    progress: Callable[[float], None] | None = None,
) -> list[Size]:
    """Measure the `RUNS` among some cases and methods for all `COUNTS`.

    Parameters are those of `workprecision.measure`.
    """
    tasks = [
        (case, method, count)
        for case in names
        for method in RUNS[case]
        if method in methods
        for count in COUNTS[case]
        if not quick or count <= QUICK[case]
    ]
    # A run's time goes about as its particles.
    work = sum(count for *_, count in tasks)
    done = 0
    sizes = []
    for case, method, count in tasks:
        if progress is not None:
            progress(done / work)
        sizes.append(size(case, method, count, repeats=repeats))
        done += count
    return sizes


def size(case: str, method: str, count: int, *, repeats: int = REPEATS) -> Size:
    """Measure one method on a stream of so many particles."""
    try:
        METHODS[method].load()
        scene = METHODS[method].prepare(stream(case, count), STEP)
        first, found = clocked(lambda: METHODS[method].run(case, scene, STEP))
        assert isinstance(found, Recording)
        events = len(found.events)
        del found  # or it would be in memory beside the next one

        def run() -> object:
            return METHODS[method].run(case, scene, STEP)

        watch = Stopwatch(run, first, SCALING_PATIENCE)
        for _ in range(repeats):
            watch.repeat()
        return Size(
            case,
            method,
            count,
            events=events,
            first=first,
            repeats=len(watch.times),
            median=watch.median,
            memory=traced(run) if first <= TRACEABLE_SIZE else None,
        )
    except Exception as error:  # a size too many must not cost the others' figures
        return Size(case, method, count, failed=reason(error))


def stream(case: str, count: int) -> Scene:
    """Return a case's stream with so many particles, each followed until it has landed."""
    tables = to_dict(cases()[case].scenes[0])
    run = {**tables.get("run", {}), "until": "landed"}
    return from_dict({**tables, "stream": {**tables["stream"], "count": count}, "run": run}, case)
