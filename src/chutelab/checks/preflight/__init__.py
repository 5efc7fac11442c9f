"""The look at a scene before it runs: what will happen, what it will cost, what to mind.

- `results`: `Preflight` and its parts.
- `inventory`: what will be built, and what is skipped because the scene does not need it.
- `trial`: a short run of the first particles; `effort`: contacts and run time, estimated from it.
- `stepping`: what finite steps mean for this scene.
- `coverage`: what the closed form answers, in words.
- `advice`: warnings, each with the key and the value that would do.
- `look`: `preflight`, all of it.
"""

from chutelab.checks.preflight.advice import preflight
from chutelab.checks.preflight.results import Advice, Coverage, Effort, Part, Preflight, Stepping

__all__ = ["Advice", "Coverage", "Effort", "Part", "Preflight", "Stepping", "preflight"]
