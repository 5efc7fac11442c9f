"""Rows of the tables in a recording, and the names of its events and ledger entries."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.scene import quantities
from chutelab.util.arrays import Floats
from chutelab.util.errors import InputError, did_you_mean

ENTRIES = quantities.ENTRIES
"""The three entries of the energy ledger, in the order of every array that holds them."""

REASONS = quantities.ENDINGS
"""Why a particle's track ends; `Recording.ended` holds indices into this tuple."""

ENGINES = ("exact", "contact", "pymunk")
"""Engines that make a `Recording`, in the order in which they are tried."""

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


def kind_of(kind: Kind | str) -> Kind:
    """Return a kind of event by its name, in any case; `InputError` if there is none."""
    if isinstance(kind, str):
        names = [one.lower() for one in Kind.__members__]
        if kind.lower() not in names:
            there = f"there are {', '.join(names)}"
            raise InputError(did_you_mean(kind, names, there), "kind", kind)
        return Kind[kind.upper()]
    return Kind(kind)


EVENT = np.dtype([
    ("t", "f8"), ("particle", "i4"), ("other", "i4"), ("kind", "i1"), ("surface", "i2"),
    ("position", "f8", 2), ("velocity_before", "f8", 2), ("velocity_after", "f8", 2),
    ("omega_before", "f8"), ("omega_after", "f8"),
    ("normal_impulse", "f8"), ("tangential_impulse", "f8"),
])  # fmt: skip
"""One event, in SI units.

- ``t``: time, s.
- ``particle``, ``other``: its number, and that of the particle it meets, or -1.
- ``kind``: a `Kind`.
- ``surface``: index into `Recording.surfaces`, or -1.
- ``position``: of the particle's centre, m.
- ``velocity_before``, ``velocity_after``: of its centre, m/s.
- ``omega_before``, ``omega_after``: its angular velocity, counterclockwise, rad/s.
- ``normal_impulse``: on the particle along n, away from the surface or the other particle, N s.
- ``tangential_impulse``: along (n_y, -n_x), N s.
"""

KNOT = np.dtype([
    ("t", "f8"), ("position", "f8", 2), ("velocity", "f8", 2), ("omega", "f8"), ("entries", "f8", 3)
])  # fmt: skip
"""One knot, in SI units.

- ``t``: when, s.
- ``position``, ``velocity``: of the particle's centre, m and m/s.
- ``omega``: its angular velocity, counterclockwise, rad/s.
- ``entries``: of the energy ledger of this particle since its release, J, see `ENTRIES`.
"""

TOTAL = np.dtype([("t", "f8"), ("kinetic", "f8"), ("potential", "f8"), ("entries", "f8", 3)])
"""Sums over all released particles of a crowd at the beginning of a step, in SI units.

- ``t``: when, s.
- ``kinetic``, ``potential``: rotation included; y = 0 is the zero, J. Particles that have ended
  count with their last state; those in lasting contact halfway through their impulses, as in the
  tracks.
- ``entries``: of the energy ledger, J, see `ENTRIES`.
"""

LOAD = np.dtype([
    ("normal", "f8"), ("along", "f8"), ("force", "f8", 2), ("moment", "f8"), ("at", "f8", 2)
])  # fmt: skip
"""The load on a surface in a bin of time: impulses, in SI units.

- ``normal``: the impulse that presses it, N s.
- ``along``: the impulse along (n_y, -n_x), n the normal towards the particle, N s.
- ``force``: the whole impulse, N s.
- ``moment``: its moment about the origin, N m s.
- ``at``: sum of contact points times their normal impulses, N m s.
"""

LASTING = np.dtype([
    ("particle", "i4"), ("other", "i4"), ("from", "f8"), ("to", "f8"), ("impulse", "f8", 2),
    ("stress", "f8", (2, 2)),
])  # fmt: skip
"""Impulse of a lasting contact on a particle between two times, in SI units.

Those of impacts at one instant that were solved together are here, too: their events have the
change of momentum of all of them.

- ``other``: the other particle, which got the opposite impulse; or -1 less the index of a surface.
- ``impulse``: J, N s.
- ``stress``: sums of J_a b_b, N m s; b to the particle's centre from the other's, or from the
  contact point on the surface.
"""


def balance(entries: NDArray[Any]) -> Floats:
    """Return the energy (J) from entries (..., 3): belt work less both losses."""
    return np.asarray(entries[..., 0] - entries[..., 1] - entries[..., 2])
