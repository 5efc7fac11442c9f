"""From a scene to a design: what to change so that a quantity becomes what it should be.

>>> import chutelab
>>> from chutelab import design
>>> scene = chutelab.load("inclined-20")
>>> found = design.solve(scene, "plate.angle_deg=0:60", "landing.vx=1")
>>> round(found.answer.values[0], 3)
47.255

- `solve`, `minimize`, `maximize`: in `solving`, from a question to a `Solution`;
- `uncertainty`: in `propagation`, how uncertain inputs spread, and whose fault it is: an
  `Uncertainty`;
- `quantities`, `ranges`, `spreads`: what can be aimed at, varied, and be uncertain;
- `evaluation`: the one place where variants are run; `value`, one quantity of one scene;
  `families`, many at once; `courses`, the surfaces that a particle touches;
- `pieces`, `roots`, `extrema`, `scalar`: one key: smooth pieces, all roots, all minima;
- `search`: several keys; `sensitivity`: slopes, and what one per cent does;
- `sobol`: Sobol points, and what each input contributes to a variance;
- `answers`, `words`, `documents`: results, in words, and as scene files.
"""

from chutelab.studies.design.answers import Answer, Solution
from chutelab.studies.design.evaluation import value
from chutelab.studies.design.quantities import DesignError
from chutelab.studies.design.solving import maximize, minimize, solve
from chutelab.studies.design.uncertainty import Uncertainty, uncertainty

__all__ = [
    "Answer",
    "DesignError",
    "Solution",
    "Uncertainty",
    "maximize",
    "minimize",
    "solve",
    "uncertainty",
    "value",
]
