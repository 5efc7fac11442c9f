"""Numerical stability: scenes that are hard on an engine, and the laws that they must keep.

===============  ==================================================================================
`case`           `Case`: a scene, its engines and steps, and what is asked of it
`extremes`       speed, mass, materials and belts at their limits; what lasts, piles, coarse steps
`geometry`       grazing, critical speed, ends, corners, contact from the start
`cases`          all cases, and how they are chosen; far away, in a mirror, drawn at random
`evidence`       what a law looks at, and how it answers
`laws`           the laws for all, one function each, and what single cases ask for
`barriers`       laws on where nobody may be
`conservation`   laws on energy, ledger and momentum
`harness`        run, judge, yield a `Result` a line; results as a table
===============  ==================================================================================
"""

from chutelab.checks.stress.case import ENGINES, Case, Ladder, Twin
from chutelab.checks.stress.cases import all_cases, chosen
from chutelab.checks.stress.evidence import Evidence, Verdict
from chutelab.checks.stress.harness import Result, results
from chutelab.checks.stress.laws import LAWS

__all__ = [
    "ENGINES",
    "LAWS",
    "Case",
    "Evidence",
    "Ladder",
    "Result",
    "Twin",
    "Verdict",
    "all_cases",
    "chosen",
    "results",
]
