"""Run time against error: work-precision diagrams, in the manner of the SciML benchmarks.

===============  ==================================================================================
`cases`          what is solved: single transfer, bounce to rest, belt landing, many particles
`answers`        what a method says about a case, and its error against the closed form
`crowd`          the error of particles that meet each other, where there is no closed form
`methods`        who solves it, with which parameter, and who cannot
`plain`          plain Pymunk as most people write it (the one module here to import pymunk)
`ode`            SciPy's DOP853 with events, by hand (needs the extra ``bench``)
`measure`        clocks, memory, and one `Record` for each case, method and parameter
`process`        the whole process, imports and all
`scaling`        time and memory against the number of particles
`records`        the rows, and their TSV files
`fit`            slopes, exponents, times at an error
`claims`         what the rows say, in sentences
`environment`    the machine and the versions
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
