"""Mistakes that any question knows: they turn the right answer into a number that tells of them."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, radians

SIGN = "sign or direction"
TENS = "power of ten"
ANGLE = "radians for degrees"
DOUBLE = "a missing ½"
HALF = "a ½ too many"

MOST_TENS = 6
"""Powers of ten, either way: from micro to mega."""


@dataclass(frozen=True)
class Trace:
    """A wrong number, the mistake it tells of, and what to say about it."""

    name: str
    says: str
    number: float


def traces(right: float, unit: str) -> list[Trace]:
    """Return what the general mistakes make of the right answer.

    Parameters
    ----------
    right : float
        The right answer, not 0.
    unit : str
        Its unit; angles are asked for in ``degrees``.
    """
    found = [
        Trace(
            SIGN,
            "The size is right, but the sign is not. Which way does it point, and which way counts"
            " as positive here?",
            -right,
        ),
        Trace(DOUBLE, "Twice what it should be. Is a ½ missing?", 2.0 * right),
        Trace(HALF, "Half of what it should be. Is there a ½ too many, or a 2 missing?", right / 2),
    ]
    if unit == "degrees":
        found += [
            Trace(ANGLE, "That is the angle in radians; degrees are asked for.", radians(right)),
            Trace(
                ANGLE,
                "An angle that was in degrees seems to have been turned into degrees once more.",
                degrees(right),
            ),
        ]
    for power in range(-MOST_TENS, MOST_TENS + 1):
        if power != 0:
            size = f"10{_raised(abs(power))} = {10 ** abs(power):,} times too".replace(",", " ")
            size += " large" if power > 0 else " small"
            unit_too = " Is it all in SI units: kg for g, m for mm, J for mJ?"
            says = f"The digits are right, but it is {size}.{unit_too}"
            found.append(Trace(TENS, says, right * 10.0**power))
            also = f"{says} And the sign is the other way round."
            found.append(Trace(TENS, also, -right * 10.0**power))
    return found


def _raised(power: int) -> str:
    return str(power).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))
