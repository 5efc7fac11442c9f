"""Many variants of one scene: grids and samples, a row for each.

>>> import chutelab
>>> from chutelab.studies.sweep import sweep
>>> varied = {"incoming.speed": [2.0, 4.0], "plate.restitution": [0.0, 1.0]}
>>> swept = sweep(chutelab.load("perpendicular"), varied)
>>> len(swept), swept.columns["landing.vx.mean"].round(3).tolist()
(4, [0.0, -2.0, 0.0, -4.0])

- `plan`: what is to be varied, looked at before anything runs; blocks of variants, run.
- `rows`: what a row holds, read off a recording; `Sweep`, and CSV and Parquet files.
- `part`: the file of the finished rows of a sweep that is not finished.
- `sweeping`: `sweep`: variants run here, in processes, or on a Dask cluster.

SciPy, pyarrow, Dask and pandas are imported when they are needed.
"""

from chutelab.scene.quantities import COLUMNS
from chutelab.studies.sweep.plan import DESIGNS, MOST_VARIANTS, Plan, planned, row_of
from chutelab.studies.sweep.rows import REASON, TEXTS, TOUCHES, Sweep, no_column
from chutelab.studies.sweep.sweeping import (
    Crew,
    LostWorkersError,
    crew,
    sweep,
    sweep_to,
    swept_by,
)

__all__ = [
    "COLUMNS",
    "DESIGNS",
    "MOST_VARIANTS",
    "REASON",
    "TEXTS",
    "TOUCHES",
    "Crew",
    "LostWorkersError",
    "Plan",
    "Sweep",
    "crew",
    "no_column",
    "planned",
    "row_of",
    "sweep",
    "sweep_to",
    "swept_by",
]
