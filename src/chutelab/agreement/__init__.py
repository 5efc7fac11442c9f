"""Whether the answers agree: with each other, and with what a scene is expected to show.

- `pairs`: particle 0 alone in all answers, each against the theory and against another.
- `measure`: a number of a recording by its name, such as ``landing.x.mean``.
- `expected`: the ``[[expect]]`` of a scene beside what each engine and the theory give.
"""

from chutelab.agreement.expected import Finding, Verification, verify
from chutelab.agreement.measure import measure
from chutelab.agreement.pairs import ANSWERS, Agreement, agreement

__all__ = ["ANSWERS", "Agreement", "Finding", "Verification", "agreement", "measure", "verify"]
