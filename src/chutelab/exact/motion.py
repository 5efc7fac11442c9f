"""Particles on their way: what detection has to know about them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from chutelab.exact.obstacles import bare

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chutelab.exact.obstacles import Floats, Ints

    Bools = NDArray[np.bool_]

PARALLEL = 1e-14
"""Share of a speed or an acceleration along a surface below which it has no part towards it."""


@dataclass(slots=True, eq=False)
class Past:
    """What tells the side of a segment that points touch; arrays (k,) and (2, k).

    Attributes
    ----------
    obstacle, side : ndarray, (k,)
        What they touched before what they touch or leave now, and its face; -1 for nothing.
    place : ndarray, (2, k)
        Where they were when they last were away from what they touch now, m.
    """

    obstacle: Ints
    side: Floats
    place: Floats

    def of(self, who: Ints) -> Past:
        """Return that of some particles."""
        return Past(self.obstacle[who], self.side[who], self.place.take(who, axis=1))


@dataclass(slots=True, eq=False)
class Motion:
    """Particles that move with constant acceleration until something happens, arrays (k, ...).

    Attributes
    ----------
    rows : ndarray, (k,)
        Which particles they are.
    position, velocity : ndarray, (2, k)
        SI units.
    acceleration : ndarray, (2, k) or (2, 1)
        m/s².
    left, left_side, order : ndarray, (k,)
        Obstacle (and face of it) in contact now that is being left, or -1; how many of the leading
        coefficients of the gap to it are zero: 1 after a rebound, 2 when leaving tangentially, 3
        when lifting off a circle. They are exactly zero, so they are divided out.
    on : ndarray, (k,), or None
        Segment the particles slide on, which they cannot meet.
    never : ndarray of bool, (S + C,), or None
        Obstacles that none of them can meet.
    past : Past or None
        Of points: on which side of what they touch they are. A disk that touches a face cannot be
        on its other side, a point could.
    """

    rows: Ints
    position: Floats
    velocity: Floats
    acceleration: Floats
    left: Ints
    left_side: Floats
    order: Ints
    on: Ints | None = None
    never: Bools | None = None
    past: Past | None = None
    _known: tuple[Floats, Floats] | None = None

    def after(self, t: Floats) -> Floats:
        """Return where they are after times (k,), (2, k), m; of the same array it is known."""
        if self._known is None or self._known[0] is not t:
            mean = self.velocity + bare(0.5 * t) * self.acceleration
            place = self.position + bare(t) * mean
            self._known = t, place
        return self._known[1]
