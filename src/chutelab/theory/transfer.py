"""The paper's equations (2) to (16) in closed form, vectorised, with their generalisations.

Any plate angle, finite particles, friction and spin; the printed Eq. (9) beside the right one. A
transfer has four stages, one method each: separate, fly, rebound, fall and be taken along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from chutelab.theory.results import STAGES, Reason, Transfer
from chutelab.theory.separation import separation
from chutelab.util.arrays import Bools, Floats


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


Rebound = Literal["corrected", "as-printed"]


def transfer(
    *,
    speed: ArrayLike,
    pulley_radius: ArrayLike,
    distance: ArrayLike,
    angle: ArrayLike = 0.0,
    pivot_height: ArrayLike | None = None,
    restitution: ArrayLike = 0.5,
    drop: ArrayLike = 0.5,
    belt_speed: ArrayLike | None = None,
    particle_radius: ArrayLike = 0.0,
    mass: ArrayLike = 0.008,
    gravity: ArrayLike = 9.81,
    friction: ArrayLike = np.inf,
    spin: ArrayLike = False,
    plate_friction: ArrayLike = 0.0,
    interval: ArrayLike | None = None,
    rebound: Rebound = "corrected",
    unbounded_plate: bool = True,
) -> Transfer:
    """Carry a particle from the incoming belt over the plate to the outgoing belt.

    Plate and outgoing belt are unbounded here, and after the rebound neither pulley nor incoming
    belt are in the way; `chutelab.theory.predict` takes the finite machine into account.

    Parameters
    ----------
    speed : array_like
        v0 of the incoming belt, m/s, > 0.
    pulley_radius, distance : array_like
        R > 0, and d_okr from the pulley's leading edge x = R to the plate's pivot, m.
    angle : array_like
        Plate angle α, rad, within ±π/2; positive leans the top back toward the incoming belt.
    pivot_height : array_like, optional
        Height of the pivot above the pulley's axis, m; R if not given.
    restitution, plate_friction : array_like
        ε (0..1) and µ of particle and plate.
    drop : array_like
        d2 >= 0, fall of the centre from the impact to the landing, m.
    belt_speed : array_like, optional
        v_dop of the outgoing belt, m/s; `speed` if not given.
    particle_radius, mass : array_like
        r >= 0 (0: the paper's mass point), m; m > 0, kg.
    gravity : array_like
        g >= 0, m/s².
    friction : array_like
        µ of particle and incoming belt or pulley; infinite is adhesion, Eq. (1).
    spin : array_like of bool
        True: a free disk, I = m r²/2; needs r > 0.
    interval : array_like, optional
        Time per particle, s, the t that Eq. (15) leaves open; without it P is NaN.
    rebound : {"corrected", "as-printed"}
        Which Eq. (9). The printed one is defined for α = 0 without plate friction only.
    unbounded_plate : bool
        False: do not object when ride or rebound meet the plate's line elsewhere, as a rebound must
        for α < 0; for callers who know where the plate ends.

    Returns
    -------
    Transfer
        Arrays of the parameters' broadcast shape.

    Raises
    ------
    ValueError
        If `rebound` is neither form, or the parameters do not broadcast.

    Notes
    -----
    V. Molnár et al., Mech. Sci. 7, 167-177, 2016, doi:10.5194/ms-7-167-2016. Relative errors are a
    few units in the last place times the conditioning: 1/|1 - v²/(g Rc)| near the critical speed,
    v2/|v_n| near a grazing impact.

    Examples
    --------
    >>> point = transfer(speed=2.0, pulley_radius=[0.05, 0.1], distance=0.5)
    >>> point.y2.round(3), point.dEk.round(6)
    (array([0.371, 0.441]), array([0.02, 0.02]))
    """
    if rebound not in ("corrected", "as-printed"):
        raise ValueError(f'rebound must be "corrected" or "as-printed", not {rebound!r}')
    numbers = {
        "speed": speed,
        "pulley_radius": pulley_radius,
        "distance": distance,
        "angle": angle,
        "pivot_height": pulley_radius if pivot_height is None else pivot_height,
        "restitution": restitution,
        "drop": drop,
        "belt_speed": speed if belt_speed is None else belt_speed,
        "particle_radius": particle_radius,
        "mass": mass,
        "gravity": gravity,
        "friction": friction,
        "plate_friction": plate_friction,
        "interval": np.nan if interval is None else interval,
    }
    arrays = [np.asarray(value, dtype=np.float64) for value in numbers.values()]
    turning, *whole = np.broadcast_arrays(np.asarray(spin, dtype=np.bool_), *arrays)
    flat = dict(zip(numbers, (array.ravel() for array in whole), strict=True))
    given = Given(shape=turning.shape, spin=turning.ravel(), **flat)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        stages = Stages(given, timed=interval is not None)
        stages.separate()
        stages.fly(unbounded_plate=unbounded_plate)
        stages.rebound(as_printed=rebound == "as-printed")
        stages.fall(unbounded_plate=unbounded_plate)
        return stages.transfer()
