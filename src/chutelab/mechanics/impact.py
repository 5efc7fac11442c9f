"""Newton restitution with Coulomb friction: the impulses of one contact."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from chutelab.util.arrays import Floats

DISK_SHARE = 1.0 / 3.0
"""m*/m of a free disk: at its rim, with I = m r²/2, an impulse moves the contact point 3 times as
much as it would a particle that does not turn."""


def impulses(
    approach: ArrayLike, slip: ArrayLike, restitution: ArrayLike, friction: ArrayLike, share: float
) -> tuple[Floats, Floats]:
    """Return the normal and tangential impulse per mass (m/s) of an impact.

    J_n = (1 + ε) |v_n| and J_t = -m*/m · u clipped to ±µ J_n (design, section 5).

    Parameters
    ----------
    approach, slip : array_like
        Normal speed towards the surface (>= 0) and slip of the contact point before, m/s.
    restitution, friction : array_like
        ε and µ of the pair; µ may be inf.
    share : float
        m*/m: 1 for a particle that does not turn, `DISK_SHARE` for a free disk.

    Examples
    --------
    >>> n, t = impulses(2.0, 0.5, 0.5, 0.1, 1.0)
    >>> float(n), round(float(t), 12)
    (3.0, -0.3)
    """
    normal = (1.0 + np.asarray(restitution)) * np.asarray(approach)
    return np.asarray(normal), limited(slip, normal, friction, share)


def limited(slip: ArrayLike, normal: ArrayLike, friction: ArrayLike, share: float) -> Floats:
    """Return the impulse per mass that stops the slip, or the most that friction allows."""
    friction = np.asarray(friction, dtype=np.float64)
    sticks = np.isinf(friction)
    if np.count_nonzero(sticks):
        # Not inf · 0.
        bound = np.where(sticks, np.inf, np.where(sticks, 0.0, friction) * np.asarray(normal))
    else:
        bound = friction * np.asarray(normal)
    return np.minimum(np.maximum(-share * np.asarray(slip), -bound), bound)
