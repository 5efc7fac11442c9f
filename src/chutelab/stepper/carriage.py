"""The ride by adhesion: along the belt, then round the pulley, in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, ceil, cos, inf, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.ride import STEP_ANGLE

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.stepper.solids import Solids

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Vector = tuple[float, float]

LOOK = 0.25
"""Share of the radius between the points of a ride where other surfaces are looked for."""


@dataclass(frozen=True)
class Carriage:
    """Ride of one particle at constant speed, not turning.

    Attributes
    ----------
    t, x, speed, rho : float
        Release time (s) and place along the belt (m), speed (m/s), height above the axis (m).
    until : float
        s; separation, at cos φ1 = v²/(g ρ), or where another surface is met; inf on a belt at rest.
    """

    t: float
    x: float
    speed: float
    rho: float
    until: float

    def state(self, t: float) -> tuple[Vector, Vector]:
        """Return position (m) and velocity (m/s) at a time up to `until`."""
        along = self.x + self.speed * (t - self.t)
        if along <= 0.0:
            return (along, self.rho), (self.speed, 0.0)
        phi = along / self.rho
        c, s = cos(phi), sin(phi)
        return (self.rho * s, self.rho * c), (self.speed * c, -self.speed * s)

    def times(self, end: float) -> list[float]:
        """Return the times of the knots after the release that a track needs, `end` the last."""
        if self.speed == 0.0:
            return [end]
        top = self.t - self.x / self.speed
        if end <= top:
            return [end]
        pieces = max(1, ceil((end - top) * self.speed / self.rho / STEP_ANGLE))
        return [top, *(top + (end - top) * n / pieces for n in range(1, pieces)), end]


class Carriages:
    """The rides of many, as arrays (N,); NaN for who does not ride.

    Parameters
    ----------
    rides : dict
        By particle.
    count : int
        Number of particles N.
    """

    def __init__(self, rides: dict[int, Carriage], count: int) -> None:
        self._columns = np.full((4, count), np.nan)
        for n, ride in rides.items():
            self._columns[:, n] = ride.t, ride.x, ride.speed, ride.rho
        self._ahead = inf, b"", np.empty((0, 2))

    def chord(self, who: Ints, now: float, then: float) -> tuple[Floats, Floats]:
        """Return positions (k, 2), m, and mean velocities until `then`, m/s."""
        known, riders, begin = self._ahead
        # Unless somebody came or left, it was asked where they are now at the last step.
        if known != now or riders != who.tobytes():
            begin = self.position(who, now)
        end = self.position(who, then)
        self._ahead = then, who.tobytes(), end
        return begin, (end - begin) / (then - now)

    def position(self, who: Ints, t: float) -> Floats:
        """Return positions (k, 2) at a time, m."""
        begin, x, speed, rho = self._columns[:, who]
        along = x + speed * (t - begin)
        places = np.empty((len(along), 2))
        places[:, 0], places[:, 1] = along, rho
        round_ = (along > 0.0).nonzero()[0]
        if len(round_):
            phi, rho = along[round_] / rho[round_], rho[round_]
            places[round_, 0], places[round_, 1] = rho * np.sin(phi), rho * np.cos(phi)
        return places


def carriage(machine: Machine, solids: Solids, particle: int) -> Carriage:
    """Return the ride of a carried particle."""
    start, pulley = machine.releases, machine.pulley
    assert pulley is not None
    t, (x, rho) = float(start.t[particle]), start.position[particle].tolist()
    speed = float(start.velocity[particle, 0])
    if speed == 0.0:
        return Carriage(t, x, speed, rho, inf)
    cosine = speed**2 / (machine.gravity * rho) if machine.gravity > 0.0 else inf
    path = max(0.0, -x) + rho * acos(min(cosine, 1.0))
    whole = Carriage(t, x, speed, rho, t + path / speed)
    radius = machine.particle.radius
    # Only what comes near the box that holds the whole ride can be in its way.
    (right, low), _ = whole.state(whole.until)
    margin = solids.reach[:, None] + radius
    floor, roof = np.minimum(solids.a, solids.b) - margin, np.maximum(solids.a, solids.b) + margin
    near = (floor <= [max(right, 0.0), rho]).all(axis=1) & (roof >= [x, low]).all(axis=1)
    others = np.flatnonzero(near & (solids.surface != pulley.surface))
    if not len(others) or path == 0.0:
        return whole
    looks = np.linspace(t, whole.until, 2 + ceil(path / (LOOK * radius)))

    def met(time: float) -> bool:
        return bool((solids.gaps(np.array([whole.state(time)[0]]), radius)[:, others] < 0.0).any())

    points = np.array([whole.state(time)[0] for time in looks.tolist()])
    inside = np.flatnonzero((solids.gaps(points, radius)[:, others] < 0.0).any(axis=1))
    if not len(inside):
        return whole
    low, high = float(looks[max(inside[0] - 1, 0)]), float(looks[inside[0]])
    while (middle := 0.5 * (low + high)) not in (low, high):
        low, high = (low, middle) if met(middle) else (middle, high)
    return Carriage(t, x, speed, rho, low)
