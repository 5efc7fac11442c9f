"""`Accuracy`: what was asked for and what was reached."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from chutelab.compare import QUANTITIES, compare

if TYPE_CHECKING:
    from chutelab.accuracy.wanted import Wanted
    from chutelab.recording import Recording


@dataclass(frozen=True)
class Accuracy:
    """What accuracy was asked for, and what was reached.

    Attributes
    ----------
    asked, unit : float, str
        As in `Wanted`.
    reached : float or None
        Estimated error in the same unit; None if it cannot be told.
    method : str
        How it was estimated.
    met : bool
        Whether `reached` is at most `asked`.
    worst : str
        Which answer is the least accurate.
    chaotic : bool
        Whether only the crowd as a whole can be computed, not the ways of its particles.
    dt : float or None
        Longest step of the run, s; None for the exact engine.
    runs : int
        How many runs it took.
    """

    asked: float
    unit: str
    reached: float | None
    method: str
    met: bool
    worst: str
    chaotic: bool
    dt: float | None
    runs: int


def judged(
    wanted: Wanted,
    reached: float,
    which: str,
    how: str,
    *,
    runs: int,
    dt: float | None = None,
    chaotic: bool = False,
) -> Accuracy:
    """Hold an error against what was asked for; inf is one that cannot be told."""
    return Accuracy(
        asked=wanted.size,
        unit=wanted.unit,
        reached=reached if isfinite(reached) else None,
        method=how,
        met=reached <= wanted.size,
        worst=which,
        chaotic=chaotic,
        dt=dt,
        runs=runs,
    )


def checked(
    found: Recording, wanted: Wanted, reached: float, which: str, how: str
) -> tuple[float, str, str]:
    """Take the error against the theory if it is the larger one."""
    compared = compare(found)
    errors = dict(compared.errors)
    if wanted.unit == "m":
        errors = {
            name: abs(compared.simulated[name] - compared.theory[name])
            for name in errors
            if QUANTITIES[name] == "length"
        }
    if not errors:
        return reached, which, how
    worst = max(errors, key=lambda name: errors[name])
    if errors[worst] > reached:
        return errors[worst], worst, f"{how}; the error against theory is larger"
    return reached, which, f"{how}; theory agrees"
