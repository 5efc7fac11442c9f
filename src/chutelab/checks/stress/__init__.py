"""Numerical stability: the laws that a run must keep, whatever the scene.

===============  ==================================================================================
`barriers`       what a law looks at, how it answers; laws on where no particle may be, and on blows
`laws`           laws on energy, ledger, momentum and the record; all by name, `judge`
===============  ==================================================================================

Where surfaces are is said by `machine.shapes`, which no engine uses to find a contact. What every
run is judged by is `results.laws`, which also finds what is inside a surface.

The scenes that are hard on an engine, and what each asks for besides, are in ``tests/stress``.
"""

from chutelab.checks.stress.barriers import A_CONTACT, EPS, ROUNDINGS, Evidence, Verdict
from chutelab.checks.stress.laws import LAWS, judge, need_judged

__all__ = ["A_CONTACT", "EPS", "LAWS", "ROUNDINGS", "Evidence", "Verdict", "judge", "need_judged"]
