"""The stages of a transfer, one method each: separate, fly, rebound, fall and be taken along.

Each works in the world frame (x forward, y up), on flat arrays, and files its results under the
paper's symbols. Where a stage fails, a reason is stated and later stages answer NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chutelab.theory.reasons import Reason
from chutelab.theory.results import STAGES, Transfer
from chutelab.theory.separation import separation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Given:
    """The parameters of `transfer`, broadcast and flattened to (N,), and the shape to restore."""

    shape: tuple[int, ...]
    speed: Floats
    pulley_radius: Floats
    distance: Floats
    angle: Floats
    pivot_height: Floats
    restitution: Floats
    drop: Floats
    belt_speed: Floats
    particle_radius: Floats
    mass: Floats
    gravity: Floats
    friction: Floats
    spin: Bools
    plate_friction: Floats
    interval: Floats


class Stages:
    """Results as they come in, and why they stop coming, for each of N transfers."""

    def __init__(self, given: Given, *, timed: bool) -> None:
        self.given = given
        self.timed = timed
        self.values: dict[str, Floats] = {}
        self.reason = np.full(given.speed.shape, "", dtype=object)
        self.fine = np.full(given.speed.shape, True)

    def fail(self, where: Bools, reason: str) -> None:
        """State a reason where there is none yet."""
        self.reason[where & self.fine] = reason
        self.fine &= ~where

    def require(self, what: str, holds: Bools) -> None:
        """Object to parameters; NaN never holds."""
        self.fail(~holds, Reason.OUTSIDE.because(f"{what} is required"))

    def keep(self, **values: Floats) -> None:
        """Store results of a stage where nothing has gone wrong up to now."""
        self.values |= {name: np.where(self.fine, v, np.nan) for name, v in values.items()}

    def separate(self) -> None:
        """Ride the belt and the pulley."""
        p = self.given
        self.require("0 < speed < inf", (p.speed > 0.0) & (p.speed < np.inf))
        self.require(
            "0 < pulley_radius < inf", (p.pulley_radius > 0.0) & (p.pulley_radius < np.inf)
        )
        self.require(
            "0 <= particle_radius < inf", (p.particle_radius >= 0.0) & (p.particle_radius < np.inf)
        )
        self.require("particle_radius > 0 with spin", ~p.spin | (p.particle_radius > 0.0))
        self.require("0 <= gravity < inf", (p.gravity >= 0.0) & (p.gravity < np.inf))
        self.require("friction >= 0", p.friction >= 0.0)
        self.ride_radius = p.pulley_radius + p.particle_radius
        self.left = left = separation(
            speed=p.speed,
            ride_radius=self.ride_radius,
            gravity=p.gravity,
            friction=p.friction,
            spin=p.spin,
        )
        self.keep(phi1=left.phi1, v1=left.v1, omega1=self._turning(left.rim))

    def _turning(self, rim: Floats) -> Floats:
        # Adding 0 turns -0 into 0.
        return np.where(self.given.spin, rim / self.given.particle_radius, 0.0) + 0.0

    def fly(self, *, unbounded_plate: bool) -> None:
        """Fly to the plate: the gap between disk and plate's line is a quadratic in time."""
        p, left = self.given, self.left
        self.require("|angle| < π/2", np.abs(p.angle) < 0.5 * np.pi)
        self.require("finite distance and pivot_height", np.isfinite(p.distance + p.pivot_height))
        cos, sin = np.cos(p.angle), np.sin(p.angle)
        to_pivot = (p.pulley_radius + p.distance) * cos + p.pivot_height * sin - p.particle_radius
        # The gap on the pulley is least where the centre's radius is square to the plate.
        closest = np.clip(0.5 * np.pi - p.angle, 0.0, left.phi1)
        behind = to_pivot < self.ride_radius * np.sin(closest + p.angle)
        behind &= self.fine
        if unbounded_plate:
            self.fail(behind, Reason.EARLY.because("plate: its line is reached during the ride"))
            for name in STAGES["separation"]:
                self.values[name] = np.where(behind, np.nan, self.values[name])
        else:
            self.fail(behind, Reason.NO_IMPACT.because("the ride passes the plate's line"))
        gap = to_pivot - self.ride_radius * (left.sin * cos + left.cos * sin)
        closing = left.v1 * (left.cos * cos - left.sin * sin)
        discriminant = closing**2 - 2.0 * p.gravity * sin * gap
        self.fail(closing <= 0.0, Reason.NO_IMPACT.because("the velocity points off the plate"))
        self.fail(
            discriminant <= 0.0,
            Reason.NO_IMPACT.because("the flight turns away before it reaches the plate's line"),
        )
        self.normal = np.sqrt(discriminant)
        t2 = 2.0 * gap / (closing + self.normal)  # Eq. (5)
        x2 = left.v1 * t2 * left.cos  # Eq. (3)
        y2 = 0.5 * p.gravity * t2**2 + left.v1 * t2 * left.sin  # Eq. (4)
        v2x = left.v1 * left.cos
        v2y = left.v1 * left.sin + p.gravity * t2
        self.tangential = v2x * sin + v2y * cos
        self.keep(
            t2=t2,
            x2=x2,
            y2=y2,
            v2x=v2x,
            v2y=v2y,
            v2=np.hypot(v2x, v2y),  # Eq. (6)
            phi2=np.arctan2(self.normal, self.tangential),  # Eq. (7)
        )

    def rebound(self, *, as_printed: bool) -> None:
        """Leave the plate: normal and tangential (down the plate) velocity, and the rim's."""
        p = self.given
        self.require("0 <= restitution <= 1", (p.restitution >= 0.0) & (p.restitution <= 1.0))
        self.require("plate_friction >= 0", p.plate_friction >= 0.0)
        if as_printed:
            self.require(
                "plate_friction = 0 and angle = 0 for Eq. (9) as printed",
                (p.plate_friction == 0.0) & (p.angle == 0.0),
            )
            v2r = np.hypot(self.normal, p.restitution * self.tangential)  # Eq. (9) as printed
            phi2r = np.arctan2(p.restitution * self.normal, self.tangential)  # Eq. (8)
            self.away, self.down = v2r * np.sin(phi2r), v2r * np.cos(phi2r)
            self.rim = self.left.rim
        else:
            # Coulomb: the impulse that stops the slip, or as much of it as friction can give.
            slip = self.tangential - self.left.rim
            limit = p.plate_friction * (1.0 + p.restitution) * self.normal
            impulse = np.clip(slip * np.where(p.spin, 1.0 / 3.0, 1.0), -limit, limit)
            self.down = self.tangential - impulse
            self.rim = self.left.rim + np.where(p.spin, 2.0 * impulse, 0.0)
            self.away = p.restitution * self.normal
            v2r = np.hypot(self.away, self.down)  # Eq. (9) corrected
            phi2r = np.arctan2(self.away, self.down)  # Eq. (8)
        self.keep(phi2r=phi2r, v2r=v2r, omega2=self._turning(self.rim))

    def fall(self, *, unbounded_plate: bool) -> None:
        """Fall on the outgoing belt, and be taken along by it."""
        p, left = self.given, self.left
        self.require("0 <= drop < inf", (p.drop >= 0.0) & (p.drop < np.inf))
        self.require("finite belt_speed", np.isfinite(p.belt_speed))
        self.require("0 < mass < inf", (p.mass > 0.0) & (p.mass < np.inf))
        if self.timed:
            self.require("interval > 0", p.interval > 0.0)
        cos, sin = np.cos(p.angle), np.sin(p.angle)
        v3x = self.away * cos - self.down * sin
        sinking = self.away * sin + self.down * cos
        v3y = np.sqrt(sinking**2 + 2.0 * p.gravity * p.drop)
        # Eq. (12), the root that does not cancel for either sign of b
        t3 = np.where(sinking >= 0.0, 2.0 * p.drop / (sinking + v3y), (v3y - sinking) / p.gravity)
        t3 = np.where((p.drop == 0.0) & (sinking >= 0.0), 0.0, t3)
        self.fail(
            ~np.isfinite(t3), Reason.MISSES.because("without gravity it never comes down to it")
        )
        if unbounded_plate:
            pressing = -p.gravity * sin
            self.fail(
                (pressing > 0.0) & (2.0 * self.away < pressing * t3),
                Reason.SECOND.because("plate: its line is met again before the landing"),
            )
        dEk = 0.5 * p.mass * (v3x**2 + p.belt_speed**2)  # noqa: N806 - Eq. (14)
        slip = p.belt_speed + v3x - self.rim
        carried = np.where(p.spin, p.mass / 3.0, p.mass)  # effective mass at the contact point
        lost_height = left.sin**2 / (1.0 + left.cos)  # 1 - cos φ1
        self.keep(
            t3=t3,
            x3=v3x * t3,  # Eq. (10)
            y3=p.drop,  # Eq. (11), solved for t3
            v3x=v3x,
            v3y=v3y,
            v3=np.hypot(v3x, v3y),  # Eq. (13)
            d3=self.ride_radius * lost_height + self.values["y2"] + p.drop,  # Eq. (16)
            dEk=dEk,
            P=dEk / p.interval,  # Eq. (15)
            belt_work=carried * p.belt_speed * slip,
            slip_heat=0.5 * carried * slip**2,
        )

    def transfer(self) -> Transfer:
        """Return the results in the parameters' shape."""
        shape = self.given.shape
        reason = self.reason.astype(np.str_).reshape(shape)
        return Transfer(
            reason=reason, **{name: value.reshape(shape) for name, value in self.values.items()}
        )
