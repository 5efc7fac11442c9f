"""``bench``: run time against error of one scene, a row for each engine and step.

A time without an error says little. So each run is compared with an answer that its engine had no
part in, as ``--accuracy`` does (`chutelab.studies.accuracy`). Without such an answer there are no
figures, but the reason.
"""

from __future__ import annotations

import gc
import os
import platform
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from math import ceil, inf
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import TypeVar

from chutelab.engines.simulation import judged
from chutelab.scene import Scene
from chutelab.studies.accuracy import SMALLEST, STIR, UNABLE, LateError, Search, Wanted, because
from chutelab.util.arrays import Progress
from chutelab.util.files import version_of

T = TypeVar("T")

METHODS = ("exact", "contact", "pymunk", "fixed")
"""The engines; "fixed" is pymunk with ``run.align = false``."""

STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
"""s; of the engines that step."""

MANY_STEPS = (3e-3, 1e-3, 3e-4)
"""s; of many particles, whose runs take long."""

CROWD = (
    "of the crowd as a whole, its mean landing point and ledger: the largest difference between"
    f" this engine and another with the same step, each with and without a change of the inputs by"
    f" {STIR:g}"
)
"""How the error is found if particles meet."""

PACKAGES = ("chutelab", "numpy", "pymunk", "wasmtime", "scipy")
"""Packages on which figures depend, besides the processor."""

REPEATS = 9

BUDGET = 60.0
"""Default wall time for all rows together, s: a lesson does not wait longer."""

PATIENCE = 0.5
"""After so many s of repeats of one row no further repeat begins."""

LEAST = 0.02
"""Least time of a repeat, s: faster runs are repeated in a row, and the mean counts, as with
`timeit`. A single run of a millisecond would measure the state of the caches."""


@dataclass(frozen=True)
class Timing:
    """One engine on the scene with one step; None where it does not apply."""

    method: str  # one of `METHODS`
    parameter: str = ""  # "dt", or "" for the exact engine
    value: float | None = None  # the step, s
    first: float | None = None  # s of the first run, imports excluded
    repeats: int = 0  # runs after it
    median: float | None = None  # median of the repeats, s; the first run if it has no repeats
    error: float | None = None  # relative, the largest of all answers, see `studies.accuracy`
    quantity: str = ""  # the answer with this error
    against: str = ""  # the reference: "theory", "dop853" or an engine
    how: str = ""  # the error is known, in words
    failed: str = ""  # why there are no figures; "" if there are


def clocked(run: Callable[[], T], number: int = 1) -> tuple[float, T]:
    """Return the mean time of some calls, s, and the result of the last."""
    gc.collect()
    begin = perf_counter()
    found = run()
    for _ in range(number - 1):
        found = run()
    return (perf_counter() - begin) / number, found


class Stopwatch:
    """Repeats of a call whose first run took `first` s (and filled caches).

    After `patience` s of repeats no further one begins.
    """

    def __init__(self, run: Callable[[], object], first: float, patience: float) -> None:
        self.run, self.first, self.patience = run, first, patience
        self.times: list[float] = []
        self._spent = 0.0

    def repeat(self) -> None:
        """Measure once more, unless the time for repeats is over."""
        last = self.times[-1] if self.times else self.first
        if self._spent + last <= self.patience:
            number = ceil(LEAST / max(last, 1e-6))
            self.times.append(clocked(self.run, number)[0])
            self._spent += number * self.times[-1]

    @property
    def median(self) -> float:
        """Median of the repeats, s; the first run without any."""
        return median(self.times or [self.first])


def measure(
    scene: Scene,
    methods: Sequence[str] = (),
    steps: Sequence[float] = (),
    *,
    repeats: int = REPEATS,
    max_seconds: float = BUDGET,
    progress: Progress | None = None,
) -> list[Timing]:
    """Measure engines on a scene, long steps first; failed or omitted rows have the reason.

    Parameters
    ----------
    methods : sequence of str
        Some of `METHODS`; by default all, with many particles all but "fixed".
    steps : sequence of float
        ``run.dt``, s; by default `STEPS` or `MANY_STEPS`. A witness that steps takes the shortest.
    repeats : int
        Timed runs after the first, at most; fewer where they take longer than `PATIENCE`.
    max_seconds : float
        Wall time of all first runs and of the runs for their errors; rows beyond it are left out.
    progress : callable, optional
        Called now and then with the share that is done.
    """
    begin = perf_counter()

    def bounded(_: float) -> None:
        spent = (perf_counter() - begin) / max_seconds
        if spent > 1.0:
            raise LateError(f"no time is left of the {max_seconds:g} s for all (--max-seconds)")
        if progress is not None:
            progress(max(len(rows) / len(tasks), spent))

    many = scene.count > 1
    steps = sorted(set(steps or (MANY_STEPS if many else STEPS)), reverse=True)
    methods = methods or (METHODS[:-1] if many else METHODS)
    finest = scene.with_values({"run.dt": steps[-1], "expect": None})
    search = Search(finest, Wanted(SMALLEST, "relative"), bounded)
    tasks = [
        (method, step)
        for method in METHODS
        if method in methods
        for step in ([None] if method == "exact" else steps)
    ]
    rows: dict[tuple[str, float | None], tuple[Timing, Stopwatch | None]] = {}
    # All engines begin with the longest step, which is the fastest, in case time runs out.
    for method, step in sorted(tasks, key=lambda task: -(task[1] or inf)):
        rows[method, step] = _judged(scene, method, step, search, bounded)
    # The repeats of all rows take turns: other load on the computer then slows all of them.
    watches = [watch for _, watch in rows.values() if watch is not None]
    for _ in range(repeats):
        for watch in watches:
            watch.repeat()
    return [
        row
        if watch is None
        else replace(row, first=watch.first, repeats=len(watch.times), median=watch.median)
        for row, watch in map(rows.__getitem__, tasks)
    ]


def _judged(
    scene: Scene, method: str, step: float | None, search: Search, bounded: Progress
) -> tuple[Timing, Stopwatch | None]:
    """Run once and find the error before any repeat: a method that fails is not timed."""
    blank = Timing(method, "" if step is None else "dt", step)
    engine = "pymunk" if method == "fixed" else method
    if step is not None:
        aligned = method != "fixed"
        scene = scene.with_values({"run.dt": step, "run.align": aligned, "expect": None})
    import_module(f"chutelab.engines.{engine}")  # or its import would be timed
    run = partial(judged, scene, engine=engine)
    try:
        bounded(0.0)
        first, found = clocked(partial(run, progress=bounded))
        known = search.judged(found)
    except UNABLE as error:
        return replace(blank, failed=because(error)), None
    if known.reached is None:
        return replace(blank, failed=known.method.removeprefix("none: ")), None
    row = replace(
        blank,
        error=known.reached,
        quantity=known.worst,
        against=known.against or "",
        how=CROWD if known.chaotic else known.method,
    )
    return row, Stopwatch(run, first, PATIENCE)


def environment() -> dict[str, str]:
    """Return processor, number of cores, system, Python and versions of packages.

    Packages that are not installed are left out; it has no host, user or path.
    """
    cores = os.cpu_count() or 1
    processor = platform.processor() or platform.machine()
    with suppress(OSError):
        told = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        if named := re.search(r"^model name[^:\n]*:(.*)", told, re.MULTILINE):
            processor = " ".join(named[1].split())
    found = {
        "processor": f"{processor}, {cores} core{'s' if cores > 1 else ''}",
        "system": platform.system(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
    }
    versions = {package: version_of(package) for package in PACKAGES}
    return found | {package: version for package, version in versions.items() if version}


def measured_on(about: Mapping[str, str]) -> str:
    """Return an `environment` as a line of text."""
    return f"measured on {', '.join(f'{key} {value}' for key, value in about.items())}"
