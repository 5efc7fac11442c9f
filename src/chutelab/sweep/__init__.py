"""Many variants of one scene: grids and samples, a row for each.

>>> import chutelab
>>> from chutelab.sweep import sweep
>>> swept = sweep(chutelab.load("perpendicular"), ["incoming.speed=2,4", "plate.restitution=0,1"])
>>> len(swept), swept.columns["landing.vx"].round(3).tolist()
(4, [0.0, -2.0, 0.0, -4.0])

- `plan`: what is to be varied, looked at before anything runs; `samples`: Latin hypercubes and
  Sobol points.
- `columns`, `rows`: what a row holds, and how it is read off a recording; `deviation`: the error
  against the theory.
- `alone`: one variant at a time, the reference; `batch`: many at once through the exact engine;
  `screening`: validation of many at once.
- `block`: a unit of work; `workers`: who does it, this process, several, or a Dask cluster.
- `table`, `part`: CSV and Parquet files, and the rows of a sweep that is not finished.
- `sweeping`, `result`: `sweep`, and the `Sweep` it returns.

SciPy, pyarrow, Dask and pandas are imported when they are needed.
"""

from chutelab.sweep.alone import row_of
from chutelab.sweep.columns import NUMBERS, REASON
from chutelab.sweep.part import PartError
from chutelab.sweep.plan import MOST_VARIANTS, Plan, planned
from chutelab.sweep.result import Sweep
from chutelab.sweep.samples import DESIGNS, SampleError
from chutelab.sweep.sweeping import sweep, sweep_to, swept_by
from chutelab.sweep.table import TableError
from chutelab.sweep.workers import Crew, LostWorkersError, WorkersError, crew

__all__ = [
    "DESIGNS",
    "MOST_VARIANTS",
    "NUMBERS",
    "REASON",
    "Crew",
    "LostWorkersError",
    "PartError",
    "Plan",
    "SampleError",
    "Sweep",
    "TableError",
    "WorkersError",
    "crew",
    "planned",
    "row_of",
    "sweep",
    "sweep_to",
    "swept_by",
]
