"""From a scene to a design: what to change so that a quantity becomes what it should be.

>>> import chutelab
>>> from chutelab import design
>>> scene = chutelab.load("inclined-20")
>>> found = design.solve(scene, {"plate.angle_deg": (0, 60)}, {"landing.vx": 1.0})
>>> round(found.answer.values[0], 3)
47.829

- `evaluation`: what can be aimed at and varied, the one place where variants are run, and slopes.
- `roots`: one key: smooth pieces, all roots, all minima.
- `solving`: `solve`, `minimize` and `maximize`; several keys.
- `answers`: a `Solution`, in numbers and in words.
- `uncertainty`: how uncertain inputs spread, and which of them matters: an `Uncertainty`.
"""

from chutelab.studies.design.answers import Answer, Solution
from chutelab.studies.design.evaluation import value
from chutelab.studies.design.solving import maximize, minimize, solve
from chutelab.studies.design.uncertainty import Uncertainty, uncertainty
from chutelab.util.errors import InputError as DesignError

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
