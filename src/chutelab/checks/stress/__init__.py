"""Numerical stability: the laws that a run must keep, whatever the scene.

===============  ==================================================================================
`evidence`       what a law looks at, and how it answers
`barriers`       laws on where no particle may be, and on what a blow may do
`laws`           laws on energy, ledger, momentum and the record; all by name, `judge`
===============  ==================================================================================

Where surfaces are is said by `machine.shapes`, which no engine uses to find a contact. What every
run is judged by is `results.laws`, which also finds what is inside a surface.

The scenes that are hard on an engine, and what each asks for besides, are in ``tests/stress``.
"""

from chutelab.checks.stress.evidence import A_CONTACT, EPS, ROUNDINGS, Evidence, Verdict
from chutelab.checks.stress.laws import LAWS, judge, need_judged

__all__ = ["A_CONTACT", "EPS", "LAWS", "ROUNDINGS", "Evidence", "Verdict", "judge", "need_judged"]
