"""What accuracy is asked for: a relative error, or a length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from chutelab.scene.units import read_size, write_size

SMALLEST, LARGEST_SHARE, LARGEST_LENGTH = 1e-15, 0.5, 1e3
"""Nothing is more exact than the rounding of a double; more than half of everything off is no
accuracy; and no machine is larger than a kilometre."""

ALLOWED = (
    "a relative error from 1e-15 to 0.5, such as 1e-6 or 0.1%, or a length from 1e-15 to 1000 m"
    " with its unit, such as 1mm (m, cm, mm, µm or um, nm)"
)


class AccuracyError(ValueError):
    """An accuracy that cannot be asked for; its text says what can."""


@dataclass(frozen=True)
class Wanted:
    """An accuracy.

    Attributes
    ----------
    size : float
        The largest error that is good enough.
    unit : {"relative", "m"}
        "relative": of every answer of a run, see `chutelab.accuracy.answers`; "m": of places only.
    """

    size: float
    unit: Literal["relative", "m"]

    def __post_init__(self) -> None:
        most = LARGEST_SHARE if self.unit == "relative" else LARGEST_LENGTH
        if not SMALLEST <= self.size <= most:
            raise AccuracyError(f"{self}: must be {ALLOWED}")

    def __str__(self) -> str:
        return self.written(self.size)

    def written(self, size: float) -> str:
        """Write another error in the same unit."""
        return f"{size:.2g}" if self.unit == "relative" else write_size(size, "m", 2)


def parse(text: str) -> Wanted:
    """Read an accuracy.

    Raises
    ------
    AccuracyError
        If it is none that can be asked for.

    Examples
    --------
    >>> parse("1e-6"), parse("1mm")
    (Wanted(size=1e-06, unit='relative'), Wanted(size=0.001, unit='m'))
    """
    try:
        size, unit = read_size(text)
    except ValueError:
        unit = "unknown"
    if unit not in ("", "%", "m"):
        raise AccuracyError(f"{text!r}: must be {ALLOWED}")
    try:
        return Wanted(size, "m" if unit == "m" else "relative")
    except AccuracyError:
        raise AccuracyError(f"{text!r}: must be {ALLOWED}") from None
