"""Run time against error: work-precision diagrams, in the manner of the SciML benchmarks.

===============  ==================================================================================
`cases`          what is solved, what a method says about it, and its error
`methods`        what solves it, with which parameter, and what cannot
`plain`          plain Pymunk as most people write it
`ode`            SciPy's DOP853 with events, by hand (needs the extra ``bench``)
`measure`        clocks, memory, the whole process; one `Record` for each case and method
`records`        the rows, and how they come back from TSV files
`claims`         what the rows say, in sentences
`picture`        the diagrams
===============  ==================================================================================
"""

from workprecision.cases import Case, cases
from workprecision.claims import Claim, claims
from workprecision.measure import (
    PROCESS,
    RUNS,
    measure,
    scaling,
    whole_process,
)
from workprecision.methods import METHODS
from workprecision.records import Record, Size, from_tsv

__all__ = [
    "METHODS",
    "PROCESS",
    "RUNS",
    "Case",
    "Claim",
    "Record",
    "Size",
    "cases",
    "claims",
    "from_tsv",
    "measure",
    "scaling",
    "whole_process",
]
