"""Run cases on engines at their steps, judge them law by law, and put the results in a table.

A watchdog bounds the wall time of each run, whatever the run does.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields, replace
from itertools import groupby
from math import inf, isfinite
from pathlib import Path
from time import perf_counter
from types import FrameType
from typing import Any

from chutelab.checks.stress.case import ENGINES, Case, Tables, by_name, scene_of
from chutelab.checks.stress.evidence import Evidence, Verdict
from chutelab.checks.stress.laws import LAWS, demands, order, symmetric, unpromised
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.scene import SceneError
from chutelab.util.files import whole


class OverdueError(RuntimeError):
    """A run took longer than it may."""


@contextmanager
def bounded(seconds: float) -> Iterator[Callable[[float], None]]:
    """Give a progress callback that raises `OverdueError` when the time is up.

    An engine that has stopped to report progress is ended too, by an alarm of the operating system;
    where there is none (Windows, another thread than the main one) the callback alone has to do.

    Parameters
    ----------
    seconds : float
        Wall time, s.
    """
    end = perf_counter() + seconds

    def overdue() -> OverdueError:
        return OverdueError(f"not done after {seconds:g} s of wall time")

    def report(_share: float) -> None:
        if perf_counter() > end:
            raise overdue()

    def ring(_number: int, _frame: FrameType | None) -> None:
        raise overdue()

    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGALRM"):
        yield report
        return
    before = signal.signal(signal.SIGALRM, ring)
    # Later than the callback's own time, which tells more about where the engine was; and again,
    # because what is raised in a callback from C is lost.
    signal.setitimer(signal.ITIMER_REAL, 1.1 * seconds + 0.1, 0.1)
    try:
        yield report
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


RUNS = "runs to its end"
"""Law of a run that raised instead."""

REFUSED = "refused"
"""Law of a scene that an engine must refuse."""


@dataclass(frozen=True)
class Result:
    """One line of the table.

    Attributes
    ----------
    case, group, engine, law : str
        What was run, and what it was judged by.
    dt : float or None
        Step, s; None for the exact engine, and where several were taken.
    figure, bound : float or None
        What was found and what it must not exceed (`least`: fall short of); None where the run
        gave no figure.
    least : bool
        Whether `bound` is one from below.
    holds : bool
        Whether the law is kept.
    detail : str
        Unit, and where the worst was; what was said instead.
    seconds : float
        Wall time of the run that was judged, s.
    unpromised : str
        Why the engine does not promise to keep this law here, empty if it does.
    """

    case: str
    group: str
    engine: str
    dt: float | None
    law: str
    figure: float | None
    bound: float | None
    least: bool
    holds: bool
    detail: str
    seconds: float
    unpromised: str = ""

    @property
    def broken(self) -> bool:
        """Whether a promised law is not kept."""
        return not self.holds and not self.unpromised


def results(
    cases: Sequence[Case], engines: Collection[str] = ENGINES
) -> Iterator[tuple[int, Result]]:
    """Run cases; yield each result with the number of cases done before.

    No exception of an engine ends it: what a run raises is a line of the table.
    """
    for number, case in enumerate(cases):
        for engine in case.engines:
            if engine not in engines:
                continue
            if engine in case.unpromised:
                yield number, _Run(case, engine, None).left_out()
                continue
            if case.ladder is not None:
                yield number, _Run(case, engine, None).climb()
                continue
            for dt in (None,) if engine == "exact" else case.steps:
                for result in _Run(case, engine, dt).results():
                    yield number, result


class _Run:
    """One case on one engine at one step."""

    def __init__(self, case: Case, engine: str, dt: float | None) -> None:
        self.case, self.engine, self.dt = case, engine, dt
        self.begin = perf_counter()

    def results(self) -> Iterator[Result]:
        """Simulate and judge."""
        expected = self.case.refusals.get(self.engine, "")
        try:
            evidence = self.evidence(self.case.tables)
        except Exception as error:
            yield self.raised(error, expected)
            return
        if expected:
            yield self.failed(REFUSED, f"it runs, but ought to be refused for {expected}")
            return
        for name, law in LAWS.items():
            if (verdict := law(evidence)) is not None:
                yield self.judged(name, verdict, unpromised(evidence, name))
        for name, verdict in demands(self.case, evidence).items():
            yield self.judged(name, verdict, unpromised(evidence, name))
        if self.case.twin is not None:
            try:
                other = self.evidence(self.case.twin.tables)
            except Exception as error:
                yield self.raised(error, "")
            else:
                verdict = symmetric(evidence, other, self.case.twin)
                yield self.judged(self.case.twin.law, verdict)

    def climb(self) -> Result:
        """Run down the ladder of steps, with the exact engine as reference."""
        ladder, case = self.case.ladder, self.case
        assert ladder is not None
        try:
            with bounded(case.patience) as progress:
                exact = simulate(scene_of(case.tables, case.name, "exact", None), "exact", progress)
                reference, errors = ladder.quantity(exact), []
                for dt in ladder.steps:
                    scene = scene_of(case.tables, case.name, self.engine, dt)
                    found = ladder.quantity(simulate(scene, by_name(self.engine), progress))
                    errors.append(abs(found - reference))
        except Exception as error:
            return self.raised(error, "")
        return self.judged("convergence", order(ladder, errors))

    def evidence(self, tables: Tables) -> Evidence:
        with bounded(self.case.patience) as progress:
            scene = scene_of(tables, self.case.name, self.engine, self.dt)
            recording = simulate(scene, by_name(self.engine), progress)
        return Evidence(build(scene), recording, self.engine, self.dt)

    def left_out(self) -> Result:
        """Say why the case is not run."""
        result = self.failed(RUNS, "not run")
        return replace(result, unpromised=self.case.unpromised[self.engine])

    def judged(self, law: str, verdict: Verdict, unpromised: str = "") -> Result:
        result = self._result(
            law, verdict.holds, verdict.detail, verdict.figure, verdict.bound, verdict.least
        )
        return result if result.holds else replace(result, unpromised=unpromised)

    def raised(self, error: Exception, expected: str) -> Result:
        said = " ".join(str(error).split())
        if isinstance(error, SceneError):
            allowed = expected or self.case.may_refuse.get(self.engine, "")
            named = any(fault.key == allowed for fault in error.faults)
            return self._result(REFUSED, named, said)
        return self.failed(REFUSED if expected else RUNS, f"{type(error).__name__}: {said}")

    def failed(self, law: str, detail: str) -> Result:
        return self._result(law, False, detail)

    def _result(
        self,
        law: str,
        holds: bool,
        detail: str,
        figure: float | None = None,
        bound: float | None = None,
        least: bool = False,
    ) -> Result:
        return Result(
            case=self.case.name,
            group=self.case.group,
            engine=self.engine,
            dt=self.dt,
            law=law,
            figure=None if figure is None else float(figure),
            bound=None if bound is None else float(bound),
            least=least,
            holds=bool(holds),
            detail=detail,
            seconds=perf_counter() - self.begin,
        )


@dataclass(frozen=True)
class Run:
    """All laws of one case on one engine at one step.

    Attributes
    ----------
    worst : Result
        The law that comes nearest to its bound, or goes furthest beyond it.
    failed : tuple of Result
        The laws that are broken.
    kept : int
        How many are kept.
    laws : int
        How many it was judged by.
    """

    worst: Result
    failed: tuple[Result, ...]
    kept: int
    laws: int


def exhausted(result: Result) -> float:
    """Return how much of its bound a figure uses up: 1 is the limit, above it the law is broken."""
    if result.figure is None or result.bound is None:
        return 0.0 if result.holds else inf
    part, whole_ = (result.bound, result.figure) if result.least else (result.figure, result.bound)
    if whole_ > 0.0:
        return part / whole_
    return 0.0 if result.holds else inf


def runs(results: Iterable[Result]) -> Iterator[Run]:
    """Gather the results of each run, which follow each other."""
    for _, group in groupby(results, key=lambda r: (r.case, r.engine, r.dt)):
        laws = list(group)
        failed = tuple(law for law in laws if law.broken)
        kept = [law for law in laws if law.holds]
        yield Run(max(failed or kept or laws, key=exhausted), failed, len(kept), len(laws))


def plain(result: Result) -> dict[str, Any]:
    """Return a result as JSON has it: what is no finite number is null."""
    return {
        key: None if isinstance(value, float) and not isfinite(value) else value
        for key, value in asdict(result).items()
    }


def write(results: Sequence[Result], path: str | Path) -> None:
    """Write one line a result, with a header, whole or not at all."""
    names = [field.name for field in fields(Result)]
    with whole(path) as unfinished, unfinished.open("w", encoding="utf-8") as file:
        file.write("\t".join(names) + "\n")
        for result in results:
            file.write("\t".join(_cell(getattr(result, name)) for name in names) + "\n")


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) else " ".join(str(value).split())
