"""Where a lone particle leaves the drive pulley, and how fast: adhesion, finite friction, spin.

With u = v² / (g Rc), Rc = R + r the radius of the centre's path and φ the angle from the top, the
normal force is m g w, w = cos φ - u, and the particle leaves where w = 0. While it slips forward
on the pulley, w' = 2 µ w - 3 sin φ.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from chutelab.util.arrays import Bools, Floats

MOST_ROUNDS = 100
"""Newton rounds; fewer than 20 are ever used, as it starts within e² of the root."""

MOST_FRICTION = 1e100
"""Squares safely; by far too large to tell from infinity once slip has begun."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PANELS = 24
"""Quadrature of the spin: panels halve towards the onset of slip, where 1/√u may be nearly singular
at low belt speed; 12 nodes on each give 1e-16 even for a singularity at the onset itself."""


@dataclass(frozen=True, eq=False)
class Separation:
    """State of the centre where the pulley is left, arrays of one shape.

    φ1 is the angle from the top of the pulley, rad, its cosine and sine are each to full relative
    precision; v1 is the speed, m/s, and `rim` is r ω, m/s, ω counter-clockwise: the velocity of the
    lowest point relative to the centre.
    """

    phi1: Floats
    cos: Floats
    sin: Floats
    v1: Floats
    rim: Floats


def separation(
    *, speed: Floats, ride_radius: Floats, gravity: Floats, friction: Floats, spin: Bools
) -> Separation:
    """Separate from the pulley after a ride that starts at its top with the belt's speed, no spin.

    All are (N,): v0 (m/s), Rc (m), g (m/s²), µ of belt and pulley, and whether it is a free disk,
    which first rolls. Infinite µ is adhesion: carried at v0, not turning, Eq. (2).

    Adhesion and the onset of slip are closed forms, the separation after slip is Newton's to the
    last bit or two. The spin of a slipping disk is a quadrature, to about 1e-14.
    """
    unit = gravity * ride_radius  # v² at u = 1
    with np.errstate(divide="ignore", over="ignore"):
        start = np.minimum(speed**2 / unit, 1.0)
    # Eq. (2), generalised to Rc
    cos = start.copy()
    sin = np.sqrt((1.0 - cos) * (1.0 + cos))
    phi1 = np.arctan2(sin, cos)
    v1 = speed.copy()
    rim = np.zeros_like(speed)
    slips = (start < 1.0) & np.isfinite(friction)
    if slips.any():
        slip = _Slip(start[slips], friction[slips], spin[slips])
        root = slip.separation()
        phi1[slips] = slip.onset + root
        cos[slips] = np.cos(phi1[slips])
        sin[slips] = np.sin(phi1[slips])
        v1[slips] = np.sqrt(unit[slips] * cos[slips])
        rim[slips] = np.where(spin[slips], np.sqrt(unit[slips]) * slip.rim(root), 0.0)
    return Separation(phi1, cos, sin, v1, rim)


class _Slip:
    """The slipping part of the ride; angles x are counted from its onset.

    A particle that does not turn holds on until sin φ = µ w, at constant u. A free disk rolls,
    u = u0 + (4/3) (1 - cos φ), until sin φ = 3 µ w. Put together, both read sin φ = G (cos φ - k).
    """

    def __init__(self, start: Floats, friction: Floats, spin: Bools) -> None:
        self.start = start
        self.friction = friction = np.minimum(friction, MOST_FRICTION)
        grip = np.where(spin, 7.0, 1.0) * friction
        k = np.where(spin, (3.0 * start + 4.0) / 7.0, start)
        short = np.where(spin, 3.0 / 7.0, 1.0) * (1.0 - start)  # 1 - k
        # In T = tan(φ/2) the onset is a quadratic; this form of its root does not cancel.
        base = 1.0 + np.hypot(1.0, grip * np.sqrt(short * (1.0 + k)))
        tangent = grip * short / base
        self.onset = 2.0 * np.arctan(tangent)
        self.cos_onset = np.cos(self.onset)
        self.fallen = 2.0 * tangent**2 / (1.0 + tangent**2)  # 1 - cos φ at the onset
        # w at the onset, sin φ / µ or sin φ / 3µ, in a form that is right for µ = 0 too.
        self.pressed = np.where(spin, 7.0 / 3.0, 1.0) * 2.0 * short / (base * (1.0 + tangent**2))
        turn = np.where(spin, 14.0, 2.0)
        self.swell = (1.0 - turn * friction**2) * self.pressed - 3.0 * self.cos_onset
        # With endless grip it would leave at cos φ = k; slip makes it faster, so it leaves earlier.
        last = np.sqrt(short / (1.0 + k))
        latest = 2.0 * np.arctan((last - tangent) / (1.0 + last * tangent))
        # From the slope at the onset x <= 1/µ as well, which keeps the exponential below e².
        with np.errstate(divide="ignore"):
            self.latest = np.minimum(latest, 1.0 / friction)

    def normal(self, x: Floats) -> Floats:
        """Return w, the normal force over m g: the slip law solved from its onset.

        Written in differences from the onset, so that short slips lose no digits.
        """
        half, middle = np.sin(0.5 * x), self.onset + 0.5 * x
        change = (
            12.0 * self.friction * np.cos(middle) * half
            - 6.0 * np.sin(middle) * half
            + self.swell * np.expm1(2.0 * self.friction * x)
        )
        return self.pressed + change / (1.0 + 4.0 * self.friction**2)

    def separation(self) -> Floats:
        """Return x where w = 0.

        w falls and is concave, so Newton from the right comes down monotonically.
        """
        x = self.latest
        for _ in range(MOST_ROUNDS):
            w = self.normal(x)
            slope = 2.0 * self.friction * w - 3.0 * np.sin(self.onset + x)
            lower = np.maximum(x - w / np.where(slope < 0.0, slope, -np.inf), 0.0)
            if not (lower < x).any():
                break
            x = np.minimum(x, lower)
        return x

    def rim(self, root: Floats) -> Floats:
        """Return r ω / sqrt(g Rc) of a free disk at the separation `root`."""
        risen = np.sqrt(self.start + 4.0 / 3.0 * self.fallen)
        rolled = -4.0 / 3.0 * self.fallen / (risen + np.sqrt(self.start))
        edges = np.append(0.0, 0.5 ** np.arange(PANELS, -1, -1))
        total = np.zeros_like(root)
        for low, high in pairwise(edges):
            for node, weight in zip(NODES, WEIGHTS, strict=True):
                x = root * (0.5 * (low + high) + 0.5 * (high - low) * node)
                w = self.normal(x)
                u = np.cos(self.onset + x) - w
                share = np.divide(w, np.sqrt(u), out=np.zeros_like(w), where=u > 0.0)
                total += 0.5 * (high - low) * weight * share
        spun: Floats = rolled - 2.0 * self.friction * root * total
        return spun
