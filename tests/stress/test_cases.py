"""Every case under every law, a test for each engine and step."""

import pytest

from stress.cases import all_cases
from stress.runs import findings


def runs():
    """Each case on each engine at each step."""
    for number, case in enumerate(all_cases()):
        for engine in case.engines:
            reason = case.unpromised.get(engine)
            for dt in (None,) if engine == "exact" or reason else case.steps:
                marks = [pytest.mark.skip(reason=f"not promised: {reason}")] if reason else []
                # By default contact takes the usual step, pymunk the coarse one in each third case.
                other = dt == case.steps[-1 if engine == "contact" else 0] and len(case.steps) > 1
                other |= engine == "pymunk" and number % 3 > 0
                if other or (engine in case.slow and dt in (None, min(case.steps))):
                    marks.append(pytest.mark.slow)
                step = "" if dt is None else f"-{dt:.2g}s"
                yield pytest.param(case, engine, dt, id=f"{case.name}-{engine}{step}", marks=marks)


@pytest.mark.parametrize(("case", "engine", "dt"), list(runs()))
def test_it_keeps_the_laws(case, engine, dt):
    assert [one for one in findings(case, engine, dt) if one.broken] == []
