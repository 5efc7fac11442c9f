"""Run cases on engines at their steps, and judge them law by law."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING

from chutelab.machine import build
from chutelab.scene import SceneError
from chutelab.simulation import simulate
from chutelab.stress.case import ENGINES, by_name, scene_of
from chutelab.stress.demands import demands, order, symmetric
from chutelab.stress.evidence import Evidence, Verdict
from chutelab.stress.laws import LAWS, unpromised
from chutelab.stress.watchdog import bounded

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from chutelab.stress.case import Case, Tables

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
