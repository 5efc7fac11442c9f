"""Why the theory has no answer: a class for machines, then words for people."""

from __future__ import annotations

from enum import StrEnum


class Reason(StrEnum):
    """First words of every non-empty `Transfer.reason`, up to its colon.

    What a reason claims, so that a simulation can confirm it:

    OUTSIDE
        A parameter or the scene is not what the equations describe. Claims nothing about the
        motion.
    EARLY
        The named surface is touched during the ride or in the first flight, and that contact is not
        the impact on the struck face of the plate. It is the first one after the release.
    NO_IMPACT
        Neither the ride nor the free flight from the pulley ever touches the plate; where the
        impact on its unbounded line should place the outgoing belt, there is no such impact.
    SECOND
        After the rebound, and before the landing, the named surface is the first to be touched.
    MISSES
        After the rebound the fall does not end on the upper face of the finite belt, and nothing
        is touched on the way down to its level. Below that, the disk may still clip the belt's end.
    """

    OUTSIDE = "outside the model"
    EARLY = "early contact"
    NO_IMPACT = "no impact"
    SECOND = "second contact"
    MISSES = "misses the outgoing belt"

    def because(self, what: str) -> str:
        """Return the full reason.

        Examples
        --------
        >>> Reason.SECOND.because("pulley")
        'second contact: pulley'
        """
        return f"{self.value}: {what}"

    @classmethod
    def of(cls, reason: object) -> Reason | None:
        """Return the class of a full reason, None for the empty one.

        Examples
        --------
        >>> Reason.of("no impact: passes below")
        <Reason.NO_IMPACT: 'no impact'>
        """
        text = str(reason)
        return cls(text.partition(":")[0]) if text else None
