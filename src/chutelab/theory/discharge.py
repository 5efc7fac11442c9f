"""Where a bed leaves a pulley: the methods that engineers use, side by side.

A bed of depth h lies on a belt that runs round a pulley of radius R (the belt's thickness
included). Angles α are counted from the top of the pulley in running direction; a belt that rises
at β meets the pulley at α = -β. On a circle of radius r, with u = V²/(g r), the pulley presses with
n = cos α - u + s times the weight, s being adhesion over weight. Carried along, the bed slips where
sin α = µ_s n; slipping, du/dα = 2 (sin α - µ_k n); it leaves where n = 0. The methods differ in the
radius and the speed that they take, and in which of these effects they have:

==========  =======================================================================================
point       edges r = R and R + h, each at V_b, no slip: the mass point of the paper, Eq. (2)
cema        the centroid's path, r = R + a, at V_b r/R; its edges are parallel to it, no slip
booth       edges r = R and R + h, each at V_b, slip before they leave (Booth 1934)
golka       edges r = R and R + h', at speeds in proportion to r, no slip (Golka 1992)
korzen      the centroid's path, with two coefficients of friction, adhesion and then air drag
            (Korzen 1989)
==========  =======================================================================================

The originals were not available: the methods follow the reviews of D. B. Hastie and P. W. Wypych
(2005 to 2010). CEMA's choice of speed is from memory; Golka's h' is derived from continuity,
Korzen's slip from the balance of forces. M.H.E.A., Goodyear and Dunlop are left out, as their rules
are not known well enough.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import asin, atan, ceil, cos, exp, inf, isinf, pi, sin, sqrt, tan
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from chutelab.theory.drag import slowing, step
from chutelab.util.arrays import Floats
from chutelab.util.errors import InputError, did_you_mean

Method = Literal["point", "cema", "booth", "golka", "korzen"]

METHODS: Final[tuple[Method, ...]] = get_args(Method)

NAMES: Final[dict[str, str]] = {
    "point": "mass point", "cema": "CEMA", "booth": "Booth", "golka": "Golka", "korzen": "Korzen",
}  # fmt: skip
"""Names of the methods in pictures."""

LEFT_OUT: Final = ("M.H.E.A.", "Goodyear", "Dunlop")
"""Methods in use whose rules are not known well enough."""

HALVINGS = 64
"""Bisections of an angle or a time, enough for all digits of a double."""

STEP = 2e-3
"""Longest Runge-Kutta step in air, s."""


class DischargeError(InputError):
    """A value is out of range, or the bed does not leave the pulley by the method."""


@dataclass(frozen=True)
class Path:
    """The path of one layer of the bed from the pulley on.

    Attributes
    ----------
    angle, speed, radius : float
        α (rad) and V (m/s) where it leaves the circle of radius r (m) round the pulley's axis.
    gravity : float
        Acceleration on it, m/s², including a divergence coefficient.
    offset : float
        Distance of the layer from the path of that circle, along its upper normal, m.
    sphere : tuple of float, optional
        Radius (m) and mass (kg) of the spheres that air slows down.
    """

    angle: float
    speed: float
    radius: float
    gravity: float
    offset: float = 0.0
    sphere: tuple[float, float] | None = None

    def at(self, times: ArrayLike) -> Floats:
        """Return positions (x, y) (m) at increasing times (s) since the pulley was left, (T, 2)."""
        t = np.asarray(times, dtype=np.float64)
        place = self.radius * complex(sin(self.angle), cos(self.angle))
        velocity = self.speed * complex(cos(self.angle), -sin(self.angle))
        if self.sphere is None:
            v = velocity - 1j * self.gravity * t
            z = place + velocity * t - 0.5j * self.gravity * t**2 + 1j * self.offset * v / np.abs(v)
            return np.stack([z.real, z.imag], axis=-1)
        radius, mass = self.sphere

        def rate(v: complex) -> complex:
            return -slowing(abs(v), radius, mass) * v - 1j * self.gravity

        states, state = [], (place, velocity)
        for span in np.diff(t, prepend=0.0):
            for _ in range(count := ceil(span / STEP)):
                state = step(state, rate, span / count)
            states.append((state[0].real, state[0].imag))
        return np.array(states).reshape(-1, 2)

    def across(self, height: float) -> float:
        """Return x (m) where the path comes down to a height y (m); NaN if it begins below it."""
        low = max(0.0, -self.speed * sin(self.angle) / self.gravity)
        if self.at([low])[0, 1] < height:
            return np.nan
        high = 2.0 * low + 0.1
        while self.at([high])[0, 1] > height:
            low, high = high, 2.0 * high
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.at([middle])[0, 1] > height else (low, middle)
        return float(self.at([high])[0, 0])


@dataclass(frozen=True)
class Discharge:
    """The stream by a method: paths of its edges and of its centre; None if it has none.

    `high_speed`: whether it leaves where the belt meets the pulley.
    """

    method: Method
    lower: Path | None
    centre: Path | None
    upper: Path | None
    high_speed: bool

    @property
    def paths(self) -> tuple[Path, ...]:
        """The edges, or the centre if the method has no edges."""
        found = (self.lower, self.upper) if self.upper is not None else (self.centre,)
        return tuple(path for path in found if path is not None)


def discharge(
    method: Method,
    *,
    speed: float,
    radius: float,
    depth: float = 0.0,
    centroid: float | None = None,
    incline: float = 0.0,
    friction: float = inf,
    static_friction: float | None = None,
    adhesion: float = 0.0,
    unit_weight: float | None = None,
    sphere: tuple[float, float] | None = None,
    divergence: tuple[float, float] = (1.0, 1.0),
    gravity: float = 9.81,
) -> Discharge:
    """Return where a bed leaves its pulley, and its stream, by one of five methods.

    Parameters
    ----------
    method : {"point", "cema", "booth", "golka", "korzen"}
        See the module.
    speed, radius : float
        V_b of the belt (m/s) and R of the pulley with the belt's thickness (m).
    depth, centroid : float
        h of the bed and height a of its centroid above the belt, m; by default half of h.
    incline : float
        Angle β at which the belt rises to the pulley, rad.
    friction, static_friction : float
        µ_k (Booth, Korzen), and µ_s (Korzen) if it differs; inf for no slip.
    adhesion, unit_weight : float
        σ_a of bed and belt (N/m²) and weight of the bed over its volume (N/m³), Korzen.
    sphere : tuple of float, optional
        Radius (m) and mass (kg) of the spheres slowed down by air with Korzen; without it, none.
    divergence : tuple of float
        Golka's coefficients of lower and upper edge, which multiply the fall.
    gravity : float
        g, m/s².

    Raises
    ------
    DischargeError
        For a value out of range, and if the bed slips back or does not leave.

    Examples
    --------
    >>> found = discharge("cema", speed=1.2, radius=0.315, depth=0.06)
    >>> round(found.centre.across(-0.3), 3)
    0.442
    """
    if method not in METHODS:
        there = f"there are {', '.join(METHODS)}"
        raise DischargeError(did_you_mean(method, METHODS, there), "method", method)
    middle = 0.5 * depth if centroid is None else centroid
    holds = friction if static_friction is None else static_friction
    for name, value, fine, allowed in (
        ("speed", speed, 0.0 < speed < inf, "> 0 m/s"),
        ("radius", radius, 0.0 < radius < inf, "> 0 m"),
        ("depth", depth, 0.0 <= depth < inf, ">= 0 m"),
        ("centroid", middle, 0.0 <= middle <= depth, "between 0 and the depth"),
        ("incline", incline, abs(incline) < 0.5 * pi, "between -π/2 and π/2 rad"),
        ("friction", friction, friction > 0.0, "> 0"),
        ("static_friction", holds, holds >= friction, "at least the friction"),
        ("adhesion", adhesion, 0.0 <= adhesion < inf, ">= 0 N/m²"),
        ("gravity", gravity, 0.0 < gravity < inf, "> 0 m/s²"),
        ("divergence", divergence, min(divergence) > 0.0, "two numbers > 0"),
    ):
        if not fine:
            raise DischargeError(f"must be {allowed}", name, value)
    sticks = 0.0
    if adhesion:
        if unit_weight is None or not unit_weight > 0.0 or depth == 0.0:
            raise DischargeError("must be > 0 N/m³, and depth > 0, with adhesion",
                                 "unit_weight", unit_weight)  # fmt: skip
        sticks = adhesion / (unit_weight * depth)

    def path(r: float, v: float, slips: bool = False, stuck: float = 0.0) -> Path:
        grips = (holds, friction) if slips else (inf, inf)
        angle, u = left(v**2 / (gravity * r), incline, *grips, stuck)
        return Path(angle, sqrt(u * gravity * r), r, gravity)

    level, top = radius + middle, radius + depth
    lower = upper = None
    high = speed**2 >= gravity * radius * cos(incline)
    if method in ("point", "booth"):
        slips = method == "booth"
        lower, centre, upper = (path(r, speed, slips) for r in (radius, level, top))
    elif method == "cema":
        tested = speed * level / radius
        high = tested**2 >= gravity * level * cos(incline)
        centre = Path(-incline, speed, level, gravity) if high else path(level, tested)
        lower, upper = replace(centre, offset=-middle), replace(centre, offset=depth - middle)
    elif method == "golka":
        rim = top if high else radius * sqrt(1.0 + 2.0 * depth / radius)
        lower, centre = path(radius, speed), None
        upper = path(rim, speed if high else speed * rim / radius)
        lower, upper = (
            replace(edge, gravity=gravity * coefficient)
            for edge, coefficient in zip((lower, upper), divergence, strict=True)
        )
    else:
        centre = replace(path(level, speed, True, sticks), sphere=sphere)
        high = centre.angle == -incline
    return Discharge(method, lower, centre, upper, high)


def left(
    u: float, incline: float, static: float, kinetic: float, sticks: float
) -> tuple[float, float]:
    """Return the angle α (rad) at which a circle is left, and u = V²/(g r) there.

    Parameters are u and β where the belt meets the pulley, µ_s, µ_k and s. Booth's solution holds
    with adhesion too, u - s = [(4µ² - 2) cos α - 6 µ sin α]/(1 + 4µ²) + C exp(2µα).

    Raises a `DischargeError` if the bed slips back on a belt that rises, or sticks to the belt all
    round.
    """
    begin = -incline
    if cos(begin) - u + sticks <= 0.0:
        return begin, u
    if sin(incline) > static * (cos(begin) - u + sticks):
        raise DischargeError(
            "the bed slips back before it gets over the pulley", "incline", incline
        )
    rest = atan(static)  # the angle of repose on the belt
    lean = sin(rest) * (sticks - u)
    if lean > 1.0:
        raise DischargeError("the bed sticks to the belt all round the pulley", "adhesion", sticks)
    onset = max(begin, rest + asin(lean))
    if isinf(static):
        return onset, u
    mu = kinetic

    def free(angle: float) -> float:
        bends = (4.0 * mu**2 - 2.0) * cos(angle) - 6.0 * mu * sin(angle)
        return bends / (1.0 + 4.0 * mu**2)

    rest = u - sticks - free(onset)

    def above(angle: float) -> float:
        return free(angle) + rest * exp(2.0 * mu * (angle - onset))

    low, high = onset, pi
    if cos(pi) > above(pi):
        raise DischargeError("the bed sticks to the belt all round the pulley", "adhesion", sticks)
    for _ in range(HALVINGS):
        angle = 0.5 * (low + high)
        low, high = (angle, high) if cos(angle) > above(angle) else (low, angle)
    return high, cos(high) + sticks


def bed_area(*, width: float, roll: float, trough: float, surcharge: float) -> float:
    """Return the greatest cross-section A (m²) of the bed on a troughed belt of three rolls.

    ISO 5048: of a belt `width` B (m) b = 0.9 B - 0.05 carries; the middle roll bears l (m) of it,
    each side roll w = (b - l)/2, raised by the `trough` angle λ (rad); above that lies a cap with
    the `surcharge` angle θ (rad). A = (l + w cos λ) w sin λ + (l + 2 w cos λ)² tan θ / 6.

    >>> round(bed_area(width=1.2, roll=0.45, trough=0.6109, surcharge=0.3491), 3)
    0.166
    """
    b = 0.9 * width - 0.05
    if not 0.0 <= roll <= b:
        raise DischargeError(f"must be between 0 and {b:g} m, the part that carries", "roll", roll)
    side = 0.5 * (b - roll)
    across = side * cos(trough)
    return (roll + across) * side * sin(trough) + (roll + 2.0 * across) ** 2 * tan(surcharge) / 6.0


@dataclass(frozen=True)
class Loading:
    """Force and power needed to bring a stream to the speed of the belt it falls on.

    `force` (N) on the belt along its way, `length` (m) of the way on which it still slips, `power`
    (W) of the drive; the half of it or more that is slip heat is in it.
    """

    force: float
    length: float
    power: float


def loading(
    *, mass_rate: float, belt_speed: float, speed: float, friction: float, gravity: float = 9.81
) -> Loading:
    """Return force, acceleration length and power at a loading point, ISO 5048 and DIN 22101.

    F = ṁ (v_b - v_x), (v_b² - v_x²)/(2 g µ) and F v_b, with the stream's ṁ (kg/s) and its speed v_x
    (m/s) along the belt where it falls on it.

    >>> round(loading(mass_rate=800 / 3.6, belt_speed=2.0, speed=0.323, friction=0.5).power, 2)
    745.33
    """
    force = mass_rate * (belt_speed - speed)
    slips = abs(belt_speed**2 - speed**2) / (2.0 * gravity * friction)
    return Loading(force, slips, force * belt_speed)
