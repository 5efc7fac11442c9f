"""An accuracy that can be asked for: the step that reaches it, and what was reached.

- `wanted`: what is asked for, relative or a length, read from text.
- `answers`: what a run answers, and how far two runs are apart.
- `witness`: hold a run against an answer that its engine had no part in, and shorten steps until
  the two are near enough.
"""

from chutelab.accuracy.wanted import AccuracyError, Wanted, parse
from chutelab.accuracy.witness import Accuracy, reach

__all__ = ["Accuracy", "AccuracyError", "Wanted", "parse", "reach"]
