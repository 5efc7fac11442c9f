"""How exact the exact engine is: its rounding errors, and how they grow."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from chutelab.accuracy.answers import apart, each, sizes
from chutelab.accuracy.disturbed import disturbed
from chutelab.accuracy.result import checked, judged
from chutelab.recording import Kind

if TYPE_CHECKING:
    from chutelab.accuracy.result import Accuracy
    from chutelab.accuracy.runs import Runs
    from chutelab.accuracy.wanted import Wanted
    from chutelab.recording import Recording
    from chutelab.scene import Scene

TINY = 1e-12
"""Share by which inputs are changed to see how rounding errors grow: far above rounding, far below
anything anybody wants to know."""

EPS = float(np.finfo(np.float64).eps)

QUADRATURE = 1e-13
"""Relative error of the duration of a slip round the pulley, which is a quadrature."""


def rounding(scene: Scene, found: Recording, wanted: Wanted, runs: Runs) -> Accuracy:
    """Estimate the rounding error of the exact engine."""
    nudged = runs(disturbed(scene, TINY))
    answers = [list(each(found)), list(each(nudged))]
    measured = sizes(found)
    moved, which = apart(answers[0], answers[1], measured, wanted.unit)
    roundings = EPS * (1.0 + found.steps)
    slipped = found.select(Kind.SLIP, surface="incoming")
    if len(slipped):
        roundings = max(roundings, QUADRATURE)
    size = 1.0 if wanted.unit == "relative" else measured["place"]
    reached = roundings * max(moved / TINY, size)
    how = f"rounding, after {found.steps} rounds; from a run with inputs changed by {TINY:g}"
    if not isfinite(moved):
        how = f"none: a change of the inputs by {TINY:g} changes {which}"
    return judged(wanted, *checked(found, wanted, reached, which, how), runs=runs.count)
