"""Names and array types of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ENTRIES = ("belt_work", "restitution_loss", "friction_loss")
"""The three entries of the energy ledger, in the order of every array that holds them."""

PARTICLES = "particles"
"""Name under which the losses of particle-particle contacts are booked."""


class Kind(IntEnum):
    """What happened in an event."""

    RELEASE = 0
    SEPARATION = 1
    SLIP = 2
    IMPACT = 3
    LANDING = 4
    COLLISION = 5
    STICK = 6
    SETTLE = 7
    EXIT = 8


REASONS = ("time", "landed", "settled", "exit")
"""Why a particle's track ends; `Recording.ended` holds indices into this tuple."""

EVENT = np.dtype(
    [
        ("t", "f8"),
        ("particle", "i4"),
        ("other", "i4"),
        ("kind", "i1"),
        ("surface", "i2"),
        ("position", "f8", 2),
        ("velocity_before", "f8", 2),
        ("velocity_after", "f8", 2),
        ("omega_before", "f8"),
        ("omega_after", "f8"),
        ("normal_impulse", "f8"),
        ("tangential_impulse", "f8"),
    ]
)
"""One event: SI units; `other` is the partner or -1, `surface` an index into `Recording.surfaces`
or -1, `kind` a `Kind`; the impulses (N s) act on the particle, the normal one away from the
surface, the tangential one along (n_y, -n_x) for the contact normal n."""

KNOT = np.dtype(
    [
        ("t", "f8"),
        ("position", "f8", 2),
        ("velocity", "f8", 2),
        ("omega", "f8"),
        ("entries", "f8", 3),
    ]
)
"""One knot: time, state, and the cumulative ledger entries (J) of that particle, see `ENTRIES`."""


@dataclass(frozen=True)
class Particle:
    """The one kind of particle of a recording.

    Attributes
    ----------
    radius : float
        r, m; 0 for a mass point.
    mass : float
        m, kg.
    inertia : float
        Moment of inertia about the centre, kg m²; 0 for a particle that does not turn.
    """

    radius: float
    mass: float
    inertia: float

    def kinetic(self, vx: ArrayLike, vy: ArrayLike, omega: ArrayLike) -> Floats:
        """Return ½ m v² + ½ I ω² (J) for arrays of any one shape (m/s, rad/s)."""
        vx, vy, omega = np.asarray(vx), np.asarray(vy), np.asarray(omega)
        return np.asarray(0.5 * self.mass * (vx**2 + vy**2) + 0.5 * self.inertia * omega**2)


def balance(entries: NDArray[Any]) -> Floats:
    """Return the energy (J) that entries (..., 3) bring: belt work less both losses."""
    return np.asarray(entries[..., 0] - entries[..., 1] - entries[..., 2])
