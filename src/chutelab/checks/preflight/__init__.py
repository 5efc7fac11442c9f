"""The look at a scene before it runs: what will happen, what it will cost, what to mind.

- `trial`: `Preflight` and its parts: what will be built, what the closed form answers, what a run
  costs, estimated from one that is cut off after 1 s.
- `advice`: `preflight`, all of it, and the warnings, each with the key and the value that would do.
"""

from chutelab.checks.preflight.advice import preflight
from chutelab.checks.preflight.trial import Advice, Coverage, Effort, Part, Preflight, Stepping

__all__ = ["Advice", "Coverage", "Effort", "Part", "Preflight", "Stepping", "preflight"]
