"""Numerical stability: the laws that a run must keep, whatever the scene.

===============  ==================================================================================
`evidence`       what a law looks at, and how it answers
`surfaces`       where the surfaces are, and when
`barriers`       laws on where nobody may be
`blows`          laws on what a blow may do: restitution and friction of the pair
`laws`           laws on energy, ledger, momentum and the record; all by name, `judge`
===============  ==================================================================================

The scenes that are hard on an engine, and what each asks for besides, are in ``tests/stress``.
"""

from chutelab.checks.stress.evidence import EPS, ROUNDINGS, Evidence, Verdict
from chutelab.checks.stress.laws import A_CONTACT, LAWS, judge, need_judged

__all__ = ["A_CONTACT", "EPS", "LAWS", "ROUNDINGS", "Evidence", "Verdict", "judge", "need_judged"]
