"""An accuracy that can be asked for: the engine and the step that reach it, and what was reached.

- `wanted`: what is asked for, relative or a length, read from text.
- `answers`: what a run answers, and how far two runs are apart.
- `disturbed`: the same scene with inputs changed by next to nothing.
- `runs`: runs, counted.
- `rounding`: how exact the exact engine is; `search`: the step at which pymunk is exact enough.
- `result`: `Accuracy`, what was reached.
- `reach`: run until it is accurate enough, and say how accurate it is.
"""

from chutelab.accuracy.reach import reach
from chutelab.accuracy.result import Accuracy
from chutelab.accuracy.wanted import AccuracyError, Wanted, parse

__all__ = ["Accuracy", "AccuracyError", "Wanted", "parse", "reach"]
