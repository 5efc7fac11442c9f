"""The look at a scene before it runs: what will happen, what it will cost, what to mind.

- `results`: `Preflight` and its parts: what will be built, what the closed form answers.
- `trial`: a run that is cut off after 1 s; contacts, run time and memory, estimated from it.
- `advice`: `preflight`, all of it, and the warnings, each with the key and the value that would do.
"""

from chutelab.checks.preflight.advice import preflight
from chutelab.checks.preflight.results import Advice, Coverage, Effort, Part, Preflight, Stepping

__all__ = ["Advice", "Coverage", "Effort", "Part", "Preflight", "Stepping", "preflight"]
