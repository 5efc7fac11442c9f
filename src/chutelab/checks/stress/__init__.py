"""Numerical stability: scenes that are hard on an engine, and the laws that they must keep.

===============  ==================================================================================
`case`           `Case`: a scene, its engines and steps, and what is asked of it
`extremes`       speed, radius, mass, restitution, friction, belts, no gravity
`geometry`       grazing, critical speed, ends, corners, contact from the start
`lasting`        many bounces, long flights, late releases, piles, coarse steps
`symmetric`      the machine far away and in a mirror; steps halved again and again
`drawn`          machines drawn at random
`cases`          all of them, and how they are chosen
`evidence`       what a law looks at, and how it answers
`laws`           the laws for all, one function each, with
`barriers`       those on where nobody may be, and
`conservation`   those on energy, ledger and momentum
`demands`        what single cases ask for besides
`watchdog`       a bound on the wall time of a run
`harness`        run, judge, yield a `Result` a line
`table`          results as TSV and for JSON, and the worst of each law
===============  ==================================================================================
"""

from chutelab.checks.stress.case import ENGINES, Case, Ladder, Twin
from chutelab.checks.stress.cases import cases, chosen
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
    "cases",
    "chosen",
    "results",
]
