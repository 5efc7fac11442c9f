"""The surfaces of a machine as laws see them: where they are, and when.

Distances are worked out here, from the ends of straight pieces and from centres, radii and angles
of bent ones, so that they share nothing with how an engine finds a contact.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from math import inf, pi
from typing import Any

import numpy as np

from chutelab.machine import Machine
from chutelab.util.arrays import Bools, Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class Piece(ABC):
    """One straight or bent piece of a surface."""

    name: str
    surface: int  # index into `Machine.surfaces`
    speed: float  # m/s
    restitution: Any  # a number, or one for each kind of particles (K,)
    friction: Any
    appears: float = -inf  # from when to when it is there, s
    vanishes: float = inf

    @abstractmethod
    def away(self, position: Floats) -> Floats:
        """Return the way from the nearest point of it to places (c, 2), m."""

    def gap(self, position: Floats, radius: Floats) -> Floats:
        """Return distances (c,) from disks round places (c, 2), m."""
        return np.asarray(np.hypot(*self.away(position).T) - radius)

    def there(self, t: Floats, late: float = 0.0) -> Bools:
        """Tell at which times (c,) it is there, or was until no longer than `late` (s) ago.

        That is a step: whether contacts last is known at the ends of steps only.
        """
        return np.asarray((t >= self.appears) & (t < self.vanishes + late))


@dataclass(frozen=True, eq=False, kw_only=True)
class Line(Piece):
    """A straight piece."""

    start: Floats
    tangent: Floats
    length: float

    def away(self, position: Floats) -> Floats:  # noqa: D102
        from_start = position - self.start
        foot = np.clip(from_start @ self.tangent, 0.0, self.length)
        return np.asarray(from_start - foot[:, None] * self.tangent)


@dataclass(frozen=True, eq=False, kw_only=True)
class Bow(Piece):
    """A bent piece, or a whole circle, which has no ends."""

    center: Floats
    radius: float
    begin: float = 0.0  # rad, counterclockwise from the x axis
    extent: float = 2.0 * pi
    ends: Floats = field(init=False)  # (2, 2), m

    def __post_init__(self) -> None:
        angle = np.array([self.begin, self.begin + self.extent])
        ends = self.center + self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        object.__setattr__(self, "ends", ends)

    def _along(self, position: Floats) -> Floats:
        x, y = (position - self.center).T
        return np.asarray(np.mod(np.arctan2(y, x) - self.begin, 2.0 * pi))

    def away(self, position: Floats) -> Floats:  # noqa: D102
        out = position - self.center
        far = np.hypot(*out.T)
        away = out * (1.0 - self.radius / np.where(far > 0.0, far, inf))[:, None]
        # From its centre all of it is as near: any point will do.
        away[far == 0.0] = [self.radius, 0.0]
        if self.extent < 2.0 * pi:
            beyond = np.flatnonzero(self._along(position) > self.extent)
            first, last = (position[beyond] - end for end in self.ends)
            nearer = np.hypot(*first.T) <= np.hypot(*last.T)
            away[beyond] = np.where(nearer[:, None], first, last)
        return np.asarray(away)


def pieces(machine: Machine) -> list[Piece]:
    """Return all pieces: the straight ones, the bent ones, and the drive pulley last."""
    found: list[Piece] = []
    for part in (machine.segments, machine.arcs):
        straight = part is machine.segments
        shape = ("start", "tangent", "length") if straight else (
            "center", "radius", "begin", "extent"
        )  # fmt: skip
        for k, surface in enumerate(part.surface.tolist()):
            common: dict[str, Any] = {
                "name": machine.surfaces[surface],
                "surface": surface,
                "speed": float(part.speed[k]),
                "restitution": part.restitution[..., k],
                "friction": part.friction[..., k],
                "appears": float(part.appears[k]),
                "vanishes": float(part.vanishes[k]),
            }
            at = {name: getattr(part, name)[k] for name in shape}
            found.append(Line(**common, **at) if straight else Bow(**common, **at))
    if (wheel := machine.pulley) is not None:
        found.append(
            Bow(
                name="pulley",
                surface=wheel.surface,
                speed=wheel.speed,
                restitution=wheel.restitution,
                friction=wheel.friction,
                center=np.zeros(2),
                radius=wheel.radius,
            )
        )
    return found
