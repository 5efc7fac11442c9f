"""How surfaces move whose motion is prescribed: a `Mover` is where one is at any time.

For what draws machines and checks runs, and for Pymunk's bodies; the core has its own (motion.c).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from chutelab.util.arrays import Floats


@dataclass(frozen=True)
class Mover:
    """A surface that shakes, travels and turns about its pivot, as a function of the run's time."""

    surface: int  # index into `Machine.surfaces`
    pivot: tuple[float, float]  # m; as written
    by: tuple[float, float]  # m; amplitude of its shaking ...
    frequency: float  # ... Hz, 0 if it does not ...
    phase: float  # ... and its phase at t = 0, rad
    way: tuple[float, float]  # m; how far it travels ...
    start: float  # ... s; from then on ...
    lasts: float  # ... and for so long, 0 if it does not
    turn: float  # rad/s, counterclockwise

    @classmethod
    def of(cls, row: Any) -> Self:
        """Return what a row of the core's `Mover` says."""
        told: dict[str, Any] = {name: tuple(row[name].tolist()) for name in ("pivot", "by", "way")}
        told |= {name: float(row[name]) for name in ("frequency", "phase", "lasts", "turn")}
        return cls(surface=int(row["surface"]), start=float(row["from"]), **told)

    @property
    def rests(self) -> float:
        """From when on it is at rest for good, s; inf if never."""
        endless = self.turn or (self.frequency and any(self.by))
        return inf if endless else self.start + self.lasts

    def back(self, t: float) -> Floats:
        """Return the matrix, (2, 2), that turns directions at a time (s) back to rest."""
        c, s = np.cos(self.turn * t), np.sin(self.turn * t)
        return np.array([[c, s], [-s, c]])

    def tell(self, row: Any) -> None:
        """Fill in what a row of the core's `Mover` is told."""
        for name, number in vars(self).items():
            row["from" if name == "start" else name] = number

    def pose(self, times: ArrayLike) -> Floats:
        """Return x and y (m) of the pivot and the angle it has turned by (rad) at times (s).

        Of times (T,) it is (T, 3). It travels with an even acceleration up to the middle, and the
        same against it from there on.
        """
        t = np.asarray(times, dtype=np.float64)
        swing = np.sin(2.0 * pi * self.frequency * t + self.phase)
        u = ((t - self.start) / self.lasts).clip(0.0, 1.0) if self.lasts else np.zeros_like(t)
        share = np.where(u < 0.5, 2.0 * u * u, 1.0 - 2.0 * (1.0 - u) ** 2)
        x, y = (self.pivot[n] + self.by[n] * swing + self.way[n] * share for n in (0, 1))
        return np.stack([x, y, self.turn * t], axis=-1)

    def velocity(self, times: ArrayLike) -> Floats:
        """Return the rates of what `pose` does: m/s, m/s and rad/s, (T, 3) of times (T,), s."""
        t = np.asarray(times, dtype=np.float64)
        rate = 2.0 * pi * self.frequency
        swing = rate * np.cos(rate * t + self.phase)
        pace = np.zeros_like(t)
        if self.lasts:
            u = (t - self.start) / self.lasts
            pace = 4.0 * np.minimum(u, 1.0 - u).clip(0.0) / self.lasts
        x, y = (self.by[n] * swing + self.way[n] * pace for n in (0, 1))
        return np.stack([x, y, np.full_like(t, self.turn)], axis=-1)

    def velocity_at(self, place: ArrayLike, t: float) -> Floats:
        """Return the velocity, m/s, (2,), of its point that is at `place`, (2,), m, at `t`, s.

        It is that of the pivot and ω x r, r from the pivot to the place.
        """
        (x, y, _), (vx, vy, omega) = self.pose(t), self.velocity(t)
        px, py = np.asarray(place)
        return np.array([vx - omega * (py - y), vy + omega * (px - x)])

    def carried(self, places: ArrayLike, times: ArrayLike) -> Floats:
        """Return where it carries places (..., 2), m, as written, at times (...,), s."""
        pose, off = self.pose(times), np.asarray(places) - np.array(self.pivot)
        c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
        x = pose[..., 0] + c * off[..., 0] - s * off[..., 1]
        return np.stack([x, pose[..., 1] + s * off[..., 0] + c * off[..., 1]], axis=-1)

    def at_rest(self, places: ArrayLike, times: ArrayLike) -> Floats:
        """Return what it carries to places (..., 2), m, at times (...,), s: as written."""
        pose = self.pose(times)
        off, c, s = np.asarray(places) - pose[..., :2], np.cos(pose[..., 2]), np.sin(pose[..., 2])
        x = self.pivot[0] + c * off[..., 0] + s * off[..., 1]
        return np.stack([x, self.pivot[1] - s * off[..., 0] + c * off[..., 1]], axis=-1)
