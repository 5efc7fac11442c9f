"""How surfaces move: a `Mover` is where one is at any time; what hangs on a hinge, once it has run.

For what draws machines and checks runs, and for Pymunk's bodies; the core has its own (motion.c).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf, pi
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.util.arrays import Floats

SWING = np.dtype([
    ("t", "f8"), ("angle", "f8"), ("rate", "f8"), ("surface", "i4"), ("pad", "i4")
])  # fmt: skip
"""One state of what hangs on a hinge, in SI units.

- ``t``: when, s; two at one time are before and after a blow.
- ``angle``, ``rate``: how far it has turned from where it is written, rad, and how fast, rad/s.
- ``surface``: index into `Recording.surfaces`; ``pad`` is 0.
"""


@dataclass(frozen=True, eq=False)
class Hinge:
    """What hangs on a hinge: what acts on it, and once it has run its states."""

    inertia: float  # kg m2, about the hinge
    moment: tuple[float, float]  # kg m; mass times its centre's place from the hinge, as written
    spring: float  # N m/rad
    rest: float  # rad; where the spring is at rest
    damper: float  # N m s/rad
    stops: tuple[float, float]  # rad; infinite without
    motor: tuple[float, float]  # rad/s and N m; 0 without
    mass: float = 0.0  # kg; 0 without a weight
    gyration: float = 1.0  # m; root of the mean square distance from the hinge
    steered: bool = False  # it is turned by hand, and nothing else acts on it
    states: NDArray[Any] = field(default_factory=lambda: np.zeros(1, SWING))  # (k,) of `SWING`

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Return angle, rad, and its rate, rad/s, at times (...,), s: cubics between its states."""
        t, angle, rate = (self.states[name] for name in ("t", "angle", "rate"))
        if len(t) < 2:
            return np.full_like(times, angle[0]), np.full_like(times, rate[0])
        left = (np.searchsorted(t, times, side="right") - 1).clip(0, len(t) - 2)
        h = t[left + 1] - t[left]
        s = np.divide(times - t[left], h, out=np.ones_like(times), where=h > 0.0).clip(0.0, 1.0)
        gone, va, vb = angle[left + 1] - angle[left], h * rate[left], h * rate[left + 1]
        bent = (3.0 * gone - 2.0 * va - vb) + s * (va + vb - 2.0 * gone)
        pace = va + s * (2.0 * (3.0 * gone - 2.0 * va - vb) + 3.0 * s * (va + vb - 2.0 * gone))
        pace = np.divide(pace, h, out=np.array(rate[left + 1]), where=h > 0.0)
        return angle[left] + s * (va + s * bent), np.where(s < 1.0, pace, rate[left + 1])

    def energies(self, angle: Any, rate: Any, gravity: float, up: Floats) -> Any:
        """Return kinetic energy, that of its weight from its hinge's height, and its spring's, J.

        Of angles, rad, and rates, rad/s, of one shape; `up` is the direction against gravity, (2,).
        """
        x, y = self.moment
        sine, cosine = np.sin(angle), np.cos(angle)
        lifted = gravity * (up[0] * (x * cosine - y * sine) + up[1] * (x * sine + y * cosine))
        return 0.5 * self.inertia * rate**2, lifted, 0.5 * self.spring * (angle - self.rest) ** 2


@dataclass(frozen=True)
class Mover:
    """A surface that shakes, travels and turns about its pivot, or hangs on a hinge there."""

    surface: int  # index into `Machine.surfaces`
    pivot: tuple[float, float]  # m; as written
    by: tuple[float, float]  # m; amplitude of its shaking ...
    frequency: float  # ... Hz, 0 if it does not ...
    phase: float  # ... and its phase at t = 0, rad
    way: tuple[float, float]  # m; how far it travels ...
    start: float  # ... s; from then on ...
    lasts: float  # ... and for so long, 0 if it does not
    turn: float  # rad/s, counterclockwise
    hinge: Hinge | None = None  # what it hangs on; then nothing else moves it
    begins: float = 0.0  # s; from when on it moves, and its times are counted

    @classmethod
    def of(cls, row: Any) -> Self:
        """Return what a row of the core's `Mover` says."""
        told: dict[str, Any] = {name: tuple(row[name].tolist()) for name in ("pivot", "by", "way")}
        told |= {name: float(row[name]) for name in ("frequency", "phase", "lasts", "turn")}
        if row["inertia"] > 0.0:
            pairs = ("moment", "stops", "motor")
            ones = ("inertia", "spring", "rest", "damper", "mass", "gyration")
            found: dict[str, Any] = {name: tuple(row[name].tolist()) for name in pairs}
            told["hinge"] = Hinge(**found | {name: float(row[name]) for name in ones})
        return cls(surface=int(row["surface"]), start=float(row["from"]), **told)

    @classmethod
    def steered(cls, surface: int, pivot: tuple[float, float]) -> Self:
        """Return that of a plate which is turned by hand."""
        none = (0.0, 0.0)
        hinge = Hinge(0.0, none, 0.0, 0.0, 0.0, (-inf, inf), none, steered=True)
        return cls(surface, pivot, none, 0.0, 0.0, none, 0.0, 0.0, 0.0, hinge)

    def swung(self, swings: NDArray[Any]) -> Mover:
        """Return it with the states, (k,) of `SWING`, in which it is found among them."""
        if self.hinge is None:
            return self
        own = swings[swings["surface"] == self.surface]
        return replace(self, hinge=replace(self.hinge, states=own))

    @property
    def rests(self) -> float:
        """From when on it is at rest for good, s; inf if never."""
        endless = self.hinge or self.turn or (self.frequency and any(self.by))
        return inf if endless else self.begins + self.start + self.lasts

    def back(self, t: float) -> Floats:
        """Return the matrix, (2, 2), that turns directions at a time (s) back to rest."""
        angle = self.pose(t)[2]
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, s], [-s, c]])

    def tell(self, row: Any) -> None:
        """Fill in what a row of the core's `Mover` is told."""
        own = dict(vars(self))
        hinge = own.pop("hinge")
        own |= {} if hinge is None else vars(hinge)
        own.pop("states", None)
        for name, number in own.items():
            row["from" if name == "start" else name] = number

    def pose(self, times: ArrayLike) -> Floats:
        """Return x and y (m) of the pivot and the angle it has turned by (rad) at times (s).

        Of times (T,) it is (T, 3). It travels with an even acceleration up to the middle, and the
        same against it from there on.
        """
        now = np.asarray(times, dtype=np.float64)
        t = np.maximum(now - self.begins, 0.0)
        swing = np.sin(2.0 * pi * self.frequency * t + self.phase)
        u = ((t - self.start) / self.lasts).clip(0.0, 1.0) if self.lasts else np.zeros_like(t)
        share = np.where(u < 0.5, 2.0 * u * u, 1.0 - 2.0 * (1.0 - u) ** 2)
        x, y = (self.pivot[n] + self.by[n] * swing + self.way[n] * share for n in (0, 1))
        return np.stack([x, y, self.hinge.at(now)[0] if self.hinge else self.turn * t], axis=-1)

    def velocity(self, times: ArrayLike) -> Floats:
        """Return the rates of what `pose` does: m/s, m/s and rad/s, (T, 3) of times (T,), s."""
        now = np.asarray(times, dtype=np.float64)
        t, moves = np.maximum(now - self.begins, 0.0), now >= self.begins
        rate = 2.0 * pi * self.frequency
        swing = rate * np.cos(rate * t + self.phase)
        pace = np.zeros_like(t)
        if self.lasts:
            u = (t - self.start) / self.lasts
            pace = 4.0 * np.minimum(u, 1.0 - u).clip(0.0) / self.lasts
        x, y = (self.by[n] * swing + self.way[n] * pace for n in (0, 1))
        turn = self.hinge.at(now)[1] if self.hinge else moves * self.turn
        return np.stack([moves * x, moves * y, turn], axis=-1)

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
