"""Whether the answers agree: with each other, and with what a scene is expected to show.

- `pairs`: particle 0 alone, exact against theory and pymunk against exact.
- `measure`: a number of a recording by its name, such as ``landing.x.mean``.
- `expected`: the ``[[expect]]`` of a scene beside what each engine and the theory give.
"""

from chutelab.agreement.expected import Finding, Verification, verify
from chutelab.agreement.measure import measure
from chutelab.agreement.pairs import Agreement, agreement

__all__ = ["Agreement", "Finding", "Verification", "agreement", "measure", "verify"]
