"""Flights over a plate, with Eq. (9) as printed or corrected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from chutelab.figures.model import GRAVITY, RESTITUTION
from chutelab.theory import transfer
from chutelab.theory.tables import FALL

if TYPE_CHECKING:
    from chutelab.figures.model import Floats, Form

POINTS: Final = 61
"""Of each flight's line."""


@dataclass(frozen=True, eq=False)
class Flight:
    """A flight in the world frame: times (P,) since its start, positions and velocities (P, 2)."""

    t: Floats
    position: Floats
    velocity: Floats

    @classmethod
    def of(cls, start: Floats, velocity: Floats, until: float) -> Flight:
        """Fly from a point with a velocity until a time, SI units."""
        t = np.linspace(0.0, until, POINTS)
        fall = np.array([0.0, -GRAVITY])
        elapsed = t[:, np.newaxis]
        position = start + velocity * elapsed + 0.5 * fall * elapsed**2
        return cls(t, position, velocity + fall * elapsed)


@dataclass(frozen=True, eq=False)
class Path:
    """What becomes of the particle.

    Attributes
    ----------
    first, second : Flight
        To the plate, and from there to the belt.
    """

    first: Flight
    second: Flight

    @property
    def landing(self) -> Floats:
        """Velocity at the belt, m/s."""
        last: Floats = self.second.velocity[-1]
        return last

    @property
    def speeds(self) -> tuple[float, float]:
        """Speeds before and after the plate, m/s."""
        before, after = self.first.velocity[-1], self.second.velocity[0]
        return float(np.hypot(*before)), float(np.hypot(*after))


def path(speed: float, angle: float, ahead: float, form: Form, radius: float = 0.1) -> Path:
    """Carry a mass point over a plate, with Eq. (9) in either form.

    Parameters
    ----------
    speed : float
        m/s.
    angle : float
        Of the plate, degrees from the vertical.
    ahead : float
        d1, m from the point where the belt is left to the plate's pivot, at the same height.
    radius : float
        Of the pulley, m, left at the top.
    """
    found = transfer(
        speed=speed, pulley_radius=radius, distance=ahead - radius, angle=np.radians(angle),
        restitution=RESTITUTION, drop=FALL, gravity=GRAVITY, unbounded_plate=False,
    )  # fmt: skip
    before = float(found.phi2)
    v2 = float(found.v2)
    if form == "as-printed":
        size = v2 * np.hypot(np.sin(before), RESTITUTION * np.cos(before))  # Eq. (9), as printed
    else:
        size = v2 * np.hypot(np.cos(before), RESTITUTION * np.sin(before))
    down = np.array([np.sin(np.radians(angle)), -np.cos(np.radians(angle))])
    away = np.array([-np.cos(np.radians(angle)), -np.sin(np.radians(angle))])
    turned = float(found.phi2r)  # Eq. (8)
    after = size * (np.cos(turned) * down + np.sin(turned) * away)
    start = np.array([0.0, radius])
    impact = start + np.array([float(found.x2), -float(found.y2)])
    until = (after[1] + np.sqrt(after[1] ** 2 + 2.0 * GRAVITY * FALL)) / GRAVITY
    return Path(
        Flight.of(start, np.array([speed, 0.0]), float(found.t2)), Flight.of(impact, after, until)
    )
