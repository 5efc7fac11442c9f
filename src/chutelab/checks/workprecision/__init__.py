"""Run time against error: work-precision diagrams, in the manner of the SciML benchmarks.

===============  ==================================================================================
`cases`          what is solved, what a method says about it, and its error
`methods`        who solves it, with which parameter, and who cannot
`plain`          plain Pymunk as most people write it (the one module here to import pymunk)
`ode`            SciPy's DOP853 with events, by hand (needs the extra ``bench``)
`measure`        clocks, memory, the whole process; one `Record` for each case and method
`records`        the rows, and their TSV files
`claims`         what the rows say, in sentences
===============  ==================================================================================
"""

from chutelab.checks.workprecision.cases import Case, cases
from chutelab.checks.workprecision.claims import Claim, claims
from chutelab.checks.workprecision.measure import (
    PROCESS,
    REPEATS,
    RUNS,
    measure,
    scaling,
    whole_process,
)
from chutelab.checks.workprecision.methods import METHODS
from chutelab.checks.workprecision.records import Record, Size, from_tsv, to_tsv
from chutelab.util.versions import environment

__all__ = [
    "METHODS",
    "PROCESS",
    "REPEATS",
    "RUNS",
    "Case",
    "Claim",
    "Record",
    "Size",
    "cases",
    "claims",
    "environment",
    "from_tsv",
    "measure",
    "scaling",
    "to_tsv",
    "whole_process",
]
