"""What the closed form will and will not cover, in words."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from chutelab.compare import QUANTITIES
from chutelab.preflight.results import Coverage
from chutelab.theory import Reason, predict

if TYPE_CHECKING:
    from chutelab.scene import Scene

WORDS = {
    Reason.OUTSIDE: "The paper's equations are about another machine",
    Reason.EARLY: "The equations stop short of a contact they know nothing of",
    Reason.NO_IMPACT: "The particle flies past the plate, and the equations end with the flight",
    Reason.SECOND: "After the plate it meets something else before it lands",
    Reason.MISSES: "It does not come down on the outgoing belt",
}
"""What a reason means for somebody who sees the scene for the first time."""


def coverage(scene: Scene) -> Coverage:
    """Ask the theory about a scene; it speaks of particle 0."""
    found = predict(scene)
    given = [name for name in QUANTITIES if isfinite(float(getattr(found, name)))]
    reason = str(found.reason)
    kind = Reason.of(reason)
    if kind is None:
        words = "All of the transfer, belt to belt"
    else:
        words = f"{WORDS[kind]}: {reason.partition(': ')[2]}"
    notes = []
    if given and scene.stream.count > 1:
        notes.append("It speaks of particle 0 only.")
    settled = scene.stream.count == 1 and scene.run.until == "settled"
    if "belt_work" in given and not settled:
        alone = " of one particle" if scene.stream.count > 1 else ""
        notes.append(
            f"A simulation has belt_work and slip_heat to compare in a run{alone} until settled."
        )
    return Coverage(
        covers=tuple(given),
        leaves_out=tuple(name for name in QUANTITIES if name not in given),
        reason=reason,
        words=" ".join([f"{words}.", *notes]),
    )
