"""Time and memory against the number of particles."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING

from chutelab.recording import Recording
from chutelab.scene import from_dict, to_dict
from chutelab.workprecision.cases import cases
from chutelab.workprecision.measure import REPEATS, clocked, reason, repeated, traced
from chutelab.workprecision.methods import METHODS
from chutelab.workprecision.records import Size

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from chutelab.scene import Scene

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

PATIENCE = 3.0
"""s of repeats of one size, after which no further one is begun."""

TRACEABLE = 60.0
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

    Parameters are those of `chutelab.workprecision.measure`.
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

        times = repeated(run, first, repeats, PATIENCE)
        return Size(
            case,
            method,
            count,
            events=events,
            first=first,
            repeats=len(times),
            median=median(times) if times else first,
            memory=traced(run) if first <= TRACEABLE else None,
        )
    except Exception as error:  # a size too many must not cost the others' figures
        return Size(case, method, count, failed=reason(error))


def stream(case: str, count: int) -> Scene:
    """Return a case's stream with so many particles, each followed until it has landed."""
    tables = to_dict(cases()[case].scenes[0])
    run = {**tables.get("run", {}), "until": "landed"}
    return from_dict({**tables, "stream": {**tables["stream"], "count": count}, "run": run}, case)
