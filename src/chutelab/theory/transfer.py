"""The paper's equations (2) to (16) in closed form, vectorised, with their generalisations.

Any plate angle, finite particles, friction and spin; the printed Eq. (9) beside the correct one.
`belt_power` is for a steady stream.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.theory.slide import FAULTS, Answers, Arrays, Reason, separation
from chutelab.util.arrays import Bools, Floats, atan2, hypot, sin_cos

Rebound = Literal["corrected", "as-printed"]


@dataclass(frozen=True, eq=False)
class Transfer(Arrays):
    """One transfer from belt to belt, or many: read-only arrays of one shape, SI units, radians.

    NaN where there is no answer; `reason` then says why, see `chutelab.theory.Reason`. Stages
    before that keep their values.

    Attributes
    ----------
    phi1, v1 : ndarray
        Angle from the top of the pulley and speed at separation, Eqs. (1), (2).
    omega1 : ndarray
        Angular velocity from there on, rad/s, counter-clockwise; 0 unless a free disk slipped or
        rolled.
    t2, x2, y2 : ndarray
        Flight time to the plate; distance forward and *down* from the separation point,
        Eqs. (3)-(5).
    v2, v2x, v2y : ndarray
        Speed at the plate, forward and *down* components, Eq. (6).
    phi2 : ndarray
        Angle between the plate and the velocity before the impact, Eq. (7).
    phi2r, v2r, omega2 : ndarray
        The same angle, speed and angular velocity after it (the paper's φ2', v2'), Eqs. (8), (9).
    t3, x3, y3 : ndarray
        Time from impact to landing; distance *back* from the impact point, fall, Eqs. (10)-(12).
    v3, v3x, v3y : ndarray
        Speed at landing, components *back* (world v_x = -v3x) and down, Eq. (13).
    d3 : ndarray
        Height of the transfer, Eq. (16).
    dEk, P : ndarray
        Energy (J) and power (W) as the paper has them, Eqs. (14), (15). The sign of v3x is lost.
    belt_work, slip_heat : ndarray
        Work of the outgoing belt's drive until the particle no longer slips, and the heat, J.
    reason : ndarray of str
        Empty if there is none.
    """

    phi1: Floats
    t2: Floats
    x2: Floats
    y2: Floats
    v1: Floats
    v2: Floats
    v2x: Floats
    v2y: Floats
    phi2: Floats
    phi2r: Floats
    v2r: Floats
    t3: Floats
    x3: Floats
    y3: Floats
    v3x: Floats
    v3y: Floats
    v3: Floats
    d3: Floats
    dEk: Floats  # noqa: N815 - the paper's symbol
    P: Floats
    belt_work: Floats
    slip_heat: Floats
    omega1: Floats
    omega2: Floats
    reason: NDArray[np.str_]


STAGES = {
    "separation": ("phi1", "v1", "omega1"),
    "impact": ("t2", "x2", "y2", "v2", "v2x", "v2y", "phi2"),
    "rebound": ("phi2r", "v2r", "omega2"),
    "landing": ("t3", "x3", "y3", "v3", "v3x", "v3y", "d3", "dEk", "P", "belt_work", "slip_heat"),
}
"""Quantities by the stage that yields them, in the order of events."""


def unanswered() -> Transfer:
    """Return a 0-d transfer that is all NaN, with no reason yet."""
    names = [name for stage in STAGES.values() for name in stage]
    return Transfer(reason=np.array(""), **dict.fromkeys(names, np.array(np.nan)))


def cut(found: Transfer, stage: str, reason: str) -> Transfer:
    """Return a 0-d transfer without a stage and all later ones, with the reason."""
    order = list(STAGES)
    lost = [name for later in order[order.index(stage) :] for name in STAGES[later]]
    return replace(found, reason=np.array(reason), **dict.fromkeys(lost, np.array(np.nan)))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
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
    inertia: ArrayLike = 0.5,
    incline: ArrayLike = 0.0,
    ride_length: ArrayLike = 0.0,
    plate_friction: ArrayLike = 0.0,
    interval: ArrayLike | None = None,
    rebound: Rebound = "corrected",
    unbounded_plate: bool = True,
) -> Transfer:
    """Compute the transfer of a particle over the plate to the outgoing belt.

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
        True: a body that rotates freely, such as a disk; needs r > 0.
    inertia : array_like
        I/(m r²) if it rotates, 0 < I/(m r²) <= 1: 1/2 of a disk, 2/5 of a sphere.
    incline : array_like
        Angle β at which the incoming belt rises towards the pulley, rad, within ±π/2.
    ride_length : array_like
        Distance on the belt up to the pulley, m, >= 0. It matters only on an incline with finite
        friction, if particles slide or roll.
    interval : array_like, optional
        Time per particle, s, the t that Eq. (15) leaves open; without it P is NaN.
    rebound : {"corrected", "as-printed"}
        Which Eq. (9). The printed one is defined for α = 0 without plate friction only.
    unbounded_plate : bool
        False: accept that ride or rebound meet the plate's line elsewhere, as a rebound must for α
        < 0; for callers that know where the plate ends.

    Returns
    -------
    Transfer
        Arrays of the parameters' broadcast shape.

    Raises
    ------
    ValueError
        If `rebound` is neither form, or the parameters do not broadcast.

    Warns
    -----
    UserWarning
        If an angle is beyond ±π/2, which looks like degrees.

    Notes
    -----
    V. Molnár et al., Mech. Sci. 7, 167-177, 2016, doi:10.5194/ms-7-167-2016. Relative errors are a
    few units in the last place times the conditioning: `1/|1 - v²/(g Rc)|` near the critical speed,
    `v2/|v_n|` near a grazing impact.

    Examples
    --------
    >>> point = transfer(speed=2.0, pulley_radius=[0.05, 0.1], distance=0.5)
    >>> point.y2.round(3), point.dEk.round(6)
    (array([0.371, 0.441]), array([0.02, 0.02]))
    """
    if rebound not in ("corrected", "as-printed"):
        raise ValueError(f'rebound must be "corrected" or "as-printed", not {rebound!r}')
    timed, as_printed = interval is not None, rebound == "as-printed"
    numbers = (
        speed, pulley_radius, distance, angle, restitution, drop, particle_radius, mass, gravity,
        friction, inertia, incline, ride_length, plate_friction,
        pulley_radius if pivot_height is None else pivot_height,
        speed if belt_speed is None else belt_speed, np.nan if interval is None else interval,
    )  # fmt: skip
    arrays = [np.asarray(value, dtype=np.float64) for value in numbers]
    whole = np.broadcast_arrays(np.asarray(spin, dtype=np.bool_), *arrays)
    spin, *flat = (part.ravel() for part in whole)
    (
        speed, pulley_radius, distance, angle, restitution, drop, particle_radius, mass, gravity,
        friction, inertia, incline, ride_length, plate_friction, pivot_height, belt_speed, interval,
    ) = flat  # fmt: skip
    for name, values in (("angle", angle), ("incline", incline)):
        if len(beyond := values[np.abs(values) > np.pi / 2]):
            warnings.warn(
                f"{name} = {beyond[0]:g} is in radians, and beyond ±π/2; of degrees take"
                f" np.radians({beyond[0]:g})",
                stacklevel=3,
            )
    found = Answers(len(speed))

    def turning(rim: Floats) -> Floats:
        # Adding 0 turns -0 into 0.
        return np.where(spin, rim / particle_radius, 0.0) + 0.0

    # Ride the belt and the pulley.
    found.require(
        {
            "0 < speed < inf": (speed > 0.0) & (speed < np.inf),
            "0 < pulley_radius < inf": (pulley_radius > 0.0) & (pulley_radius < np.inf),
            "0 <= particle_radius < inf": (particle_radius >= 0.0) & (particle_radius < np.inf),
            "particle_radius > 0 with spin": ~spin | (particle_radius > 0.0),
            "0 <= gravity < inf": (gravity >= 0.0) & (gravity < np.inf),
            "friction >= 0": friction >= 0.0,
            "0 < inertia <= 1": (inertia > 0.0) & (inertia <= 1.0),
            "|incline| < π/2": np.abs(incline) < 0.5 * np.pi,
            "0 <= ride_length < inf": (ride_length >= 0.0) & (ride_length < np.inf),
        }
    )
    ride_radius = pulley_radius + particle_radius
    left = separation(
        speed=speed, ride_radius=ride_radius, gravity=gravity, friction=friction, spin=spin,
        inertia=inertia, incline=incline, ride_length=ride_length,
    )  # fmt: skip
    if left.fault.any():
        for fault in range(1, len(FAULTS)):
            found.fail(left.fault == fault, Reason.OUTSIDE.because(FAULTS[fault]))
    found.keep(phi1=left.phi1, v1=left.v1, omega1=turning(left.rim))

    # Fly to the plate: the gap between disk and plate's line is a quadratic in time.
    found.require(
        {
            "|angle| < π/2": np.abs(angle) < 0.5 * np.pi,
            "finite distance and pivot_height": np.isfinite(distance + pivot_height),
        }
    )
    sin, cos = sin_cos(angle)
    to_pivot = (pulley_radius + distance) * cos + pivot_height * sin - particle_radius
    # The gap on the pulley is least where the centre's radius is perpendicular to the plate.
    closest = np.clip(0.5 * np.pi - angle, -incline, left.phi1)
    behind = to_pivot < ride_radius * sin_cos(closest + angle)[0]
    behind &= found.fine
    if unbounded_plate:
        found.fail(behind, Reason.EARLY.because("plate: its line is reached during the ride"))
        for name in STAGES["separation"]:
            found.values[name] = np.where(behind, np.nan, found.values[name])
    else:
        found.fail(behind, Reason.NO_IMPACT.because("the ride passes the plate's line"))
    gap = to_pivot - ride_radius * (left.sin * cos + left.cos * sin)
    closing = left.v1 * (left.cos * cos - left.sin * sin)
    discriminant = closing**2 - 2.0 * gravity * sin * gap
    normal = np.sqrt(discriminant)
    t2 = 2.0 * gap / (closing + normal)  # Eq. (5)
    # Thrown up steeply, it meets a plate that leans away only when it comes down again.
    parts = (closing <= 0.0) & (sin >= 0.0)
    comes_down = np.isfinite(left.again) & ~(~parts & (t2 <= left.again))
    found.fail(comes_down, Reason.EARLY.because("pulley: the flight comes down on it again"))
    found.fail(parts, Reason.NO_IMPACT.because("the velocity points off the plate"))
    found.fail(
        discriminant <= 0.0,
        Reason.NO_IMPACT.because("the flight turns away before it reaches the plate's line"),
    )
    x2 = left.v1 * t2 * left.cos  # Eq. (3)
    y2 = 0.5 * gravity * t2**2 + left.v1 * t2 * left.sin  # Eq. (4)
    v2x = left.v1 * left.cos
    v2y = left.v1 * left.sin + gravity * t2
    tangential = v2x * sin + v2y * cos
    v2, phi2 = hypot(v2x, v2y), atan2(normal, tangential)  # Eqs. (6), (7)
    found.keep(t2=t2, x2=x2, y2=y2, v2x=v2x, v2y=v2y, v2=v2, phi2=phi2)

    # Leave the plate: normal and tangential (down the plate) velocity, and the rim's.
    found.require(
        {
            "0 <= restitution <= 1": (restitution >= 0.0) & (restitution <= 1.0),
            "plate_friction >= 0": plate_friction >= 0.0,
        }
    )
    if as_printed:
        upright = (plate_friction == 0.0) & (angle == 0.0)
        found.require({"plate_friction = 0 and angle = 0 for Eq. (9) as printed": upright})
        v2r = hypot(normal, restitution * tangential)  # Eq. (9) as printed
        phi2r = atan2(restitution * normal, tangential)  # Eq. (8)
        away, down = (v2r * part for part in sin_cos(phi2r))
        rim = left.rim
    else:
        away, down, rim = rebounded(
            normal=normal, tangential=tangential, rim=left.rim, restitution=restitution,
            friction=plate_friction, spin=spin, inertia=inertia,
        )  # fmt: skip
        v2r = hypot(away, down)  # Eq. (9) corrected
        phi2r = atan2(away, down)  # Eq. (8)
    found.keep(phi2r=phi2r, v2r=v2r, omega2=turning(rim))

    # Fall on the outgoing belt, which takes it along.
    found.require(
        {
            "0 <= drop < inf": (drop >= 0.0) & (drop < np.inf),
            "finite belt_speed": np.isfinite(belt_speed),
            "0 < mass < inf": (mass > 0.0) & (mass < np.inf),
            "interval > 0": (interval > 0.0) | (not timed),
        }
    )
    v3x = away * cos - down * sin
    sinking = away * sin + down * cos
    v3y = np.sqrt(sinking**2 + 2.0 * gravity * drop)
    # Eq. (12), the root that does not cancel for either sign of b
    t3 = np.where(sinking >= 0.0, 2.0 * drop / (sinking + v3y), (v3y - sinking) / gravity)
    t3 = np.where((drop == 0.0) & (sinking >= 0.0), 0.0, t3)
    found.fail(~np.isfinite(t3), Reason.MISSES.because("without gravity it never comes down to it"))
    if unbounded_plate:
        pressing = -gravity * sin
        found.fail(
            (pressing > 0.0) & (2.0 * away < pressing * t3),
            Reason.SECOND.because("plate: its line is met again before the landing"),
        )
    dEk = 0.5 * mass * (v3x**2 + belt_speed**2)  # noqa: N806 - Eq. (14)
    slip = belt_speed + v3x - rim
    carried = np.where(
        spin, mass / ((1.0 + inertia) / inertia), mass
    )  # effective mass at the contact point
    lost_height = left.sin**2 / (1.0 + left.cos)  # 1 - cos φ1
    found.keep(
        t3=t3,
        x3=v3x * t3,  # Eq. (10)
        y3=drop,  # Eq. (11), solved for t3
        v3x=v3x,
        v3y=v3y,
        v3=hypot(v3x, v3y),  # Eq. (13)
        d3=ride_radius * lost_height + found.values["y2"] + drop,  # Eq. (16)
        dEk=dEk,
        P=dEk / interval,  # Eq. (15)
        belt_work=carried * belt_speed * slip,
        slip_heat=0.5 * carried * slip**2,
    )
    shape = whole[0].shape
    answers = {name: values.reshape(shape) for name, values in found.values.items()}
    return Transfer(reason=found.reason.astype(np.str_).reshape(shape), **answers)


def rebounded(
    *,
    normal: Floats,
    tangential: Floats,
    rim: Floats,
    restitution: Floats,
    friction: Floats,
    spin: Bools,
    inertia: Floats,
) -> tuple[Floats, Floats, Floats]:
    """Return velocities off the plate and down along it, and the rim's, after an impact, m/s.

    Before the impact they are `normal` (into the plate), `tangential` and `rim`.
    """
    # Coulomb: the impulse that stops the slip, or as much of it as friction can give.
    slip = tangential - rim
    limit = friction * (1.0 + restitution) * normal
    share = np.where(spin, inertia / (1.0 + inertia), 1.0)  # m*/m
    impulse = np.clip(slip * share, -limit, limit)
    return restitution * normal, tangential - impulse, rim + np.where(spin, impulse / inertia, 0.0)


def belt_power(
    *,
    rate_t_h: ArrayLike,
    belt_speed: ArrayLike,
    feed_speed: ArrayLike = 0.0,
    lift: ArrayLike = 0.0,
    gravity: ArrayLike = 9.81,
) -> Floats:
    """Return the power, W, that a belt needs for a steady stream, besides running empty.

    P = ṁ v_b (v_b - v_x) + ṁ g H: the load is brought to the belt's speed, slip heat included,
    and lifted.

    Parameters
    ----------
    rate_t_h : array_like
        ṁ in tonnes an hour, 3.6 t/h = 1 kg/s.
    belt_speed, feed_speed : array_like
        v_b of the belt, and v_x of the load along the belt at its arrival, m/s. It must not roll on
        the belt.
    lift : array_like
        H, by which the belt rises, m; negative where it falls.
    gravity : array_like
        g, m/s².

    Examples
    --------
    >>> float(belt_power(rate_t_h=360.0, belt_speed=2.0, feed_speed=-1.0, lift=5.0))
    5505.0
    """
    flow, v_b, v_x = (np.asarray(part) for part in (rate_t_h, belt_speed, feed_speed))
    height = np.multiply(gravity, lift)
    return np.asarray(flow / 3.6 * (v_b * (v_b - v_x) + height), dtype=np.float64)
