"""Every case under every law, a test for each engine and step."""

import pytest

from stress.cases import all_cases
from stress.demands import order
from stress.runs import errors, findings


def runs(*, climbing):
    """The cases with a ladder of steps or those without, each engine and step on its own."""
    for case in all_cases():
        for engine in case.engines if (case.ladder is not None) == climbing else ():
            reason = case.unpromised.get(engine)
            steps = (None,) if climbing or engine == "exact" or reason else case.steps
            for dt in steps:
                marks = [pytest.mark.skip(reason=f"not promised: {reason}")] if reason else []
                if engine in case.slow and dt in (None, min(case.steps)):
                    marks.append(pytest.mark.slow)
                arguments = (case, engine) if climbing else (case, engine, dt)
                step = "" if dt is None else f"-{dt:.2g}s"
                yield pytest.param(*arguments, id=f"{case.name}-{engine}{step}", marks=marks)


@pytest.mark.parametrize(("case", "engine", "dt"), list(runs(climbing=False)))
def test_it_keeps_the_laws(case, engine, dt):
    found = findings(case, engine, dt)
    for one in found:
        if one.unpromised:
            print(f"not promised: {one.law}, {one.detail}; {one.unpromised}")  # noqa: T201
    assert [one for one in found if one.broken] == []


@pytest.mark.parametrize(("case", "engine"), list(runs(climbing=True)))
def test_the_error_falls_with_the_step(case, engine):
    found = errors(case, engine)
    assert order(case.ladder, found) >= case.ladder.order, found
