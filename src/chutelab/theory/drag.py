"""What air drag, which all else leaves out, would do to a scene: an estimate.

The particle is taken for a sphere of its radius in still air of 20 °C; long or flat pieces have
more drag. The flights of particle 0 are integrated with it; its impact on the plate is as without.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, inf, isnan, nan, pi
from typing import TYPE_CHECKING

import numpy as np

from chutelab.theory.prediction import Course
from chutelab.theory.results import Transfer
from chutelab.theory.transfer import rebounded

if TYPE_CHECKING:
    from chutelab.scene import Scene

AIR_DENSITY = 1.2
"""kg/m³, at 20 °C and sea level."""

AIR_VISCOSITY = 1.8e-5
"""Pa s, there."""

STEPS = 64
"""Fourth-order steps of a flight; what they miss is 1e-7 of what drag does."""

MOST_STEPS = 20_000
"""Dust, which air stops within microns, would take more: no answer."""

State = tuple[float, float, float, float]
"""x, y (m) and vx, vy (m/s)."""


TOLD = 1e-6
"""m; a shift of less is not told, and one that is NaN."""


@dataclass(frozen=True)
class Drag:
    """What air drag would do, for people as text.

    Attributes
    ----------
    speed : float
        Speed for which the next three are told, the highest known, m/s.
    reynolds, coefficient : float
        Reynolds number and drag coefficient of a sphere of the particle's radius.
    slowing : float
        Drag over mass, m/s².
    share_of_weight : float
        Drag over weight; NaN without gravity.
    impact_shift : float
        How much higher particle 0 would meet the plate, m (negative: lower); NaN without a closed
        form, or if it would not get so far.
    landing_shift : float
        How much farther forward it would come down on the outgoing belt, m; NaN likewise.
    arrives : bool
        False if air would keep it from getting as far as the closed form has it.
    """

    speed: float
    reynolds: float
    coefficient: float
    slowing: float
    share_of_weight: float
    impact_shift: float
    landing_shift: float
    arrives: bool

    def __str__(self) -> str:
        share = f"{100.0 * self.share_of_weight:.2g} % of the weight"
        if self.share_of_weight >= 1.0:
            share = f"{self.share_of_weight:.3g} times the weight"
        if isnan(self.share_of_weight):
            share = f"a deceleration of {self.slowing:.2g} m/s²"
        said = f"air drag, left out, would be {share} at {self.speed:.3g} m/s"
        if not self.arrives:
            said += ", and air would keep particle 0 from getting there"
        elif abs(self.landing_shift) >= TOLD:
            way = "forward" if self.landing_shift >= 0.0 else "back"
            far = f"{1000.0 * abs(self.landing_shift):.2g} mm farther {way}"
            said += f", and particle 0 would land {far}"
        return said


def drag_coefficient(reynolds: float) -> float:
    """Return the drag coefficient of a sphere from its Reynolds number, inf at 0.

    L. Schiller, A. Naumann, Über die grundlegenden Berechnungen bei der Schwerkraftaufbereitung, Z.
    VDI 77, 318-320, 1933: 24/Re (1 + 0.15 Re^0.687) up to Re = 1000; beyond, 0.44.
    """
    if reynolds >= 1000.0:
        return 0.44
    return 24.0 / reynolds * (1.0 + 0.15 * reynolds**0.687) if reynolds > 0.0 else inf


def slowing(speed: float, radius: float, mass: float) -> float:
    """Return the deceleration by drag over the speed, 1/s, of a sphere (m, kg) at a speed (m/s)."""
    reynolds = 2.0 * radius * speed * AIR_DENSITY / AIR_VISCOSITY
    if reynolds == 0.0:
        return 6.0 * pi * AIR_VISCOSITY * radius / mass  # Stokes
    return 0.5 * AIR_DENSITY * pi * radius**2 * drag_coefficient(reynolds) * speed / mass


def drag(
    scene: Scene, found: Transfer, speed: float, radius: float | None = None,
    mass: float | None = None,
) -> Drag | None:  # fmt: skip
    """Estimate air drag in a scene; None for mass points, which have none, and where nothing moves.

    Parameters
    ----------
    scene : Scene
        A validated scene.
    found : Transfer
        What `predict` says of it.
    speed : float
        Highest speed that a particle has, m/s; particle 0 at its landing may be faster.
    radius, mass : float, optional
        Of the particle that has it, if it is not particle 0.
    """
    own = scene.particles[scene.kinds[0]]
    fastest = [speed, *(float(part) for part in (found.v2, found.v3) if np.isfinite(part))]
    if max(fastest) > speed or radius is None or mass is None:
        radius, mass, speed = own.radius, own.mass, max(fastest)
    if radius == 0.0 or speed == 0.0:
        return None
    reynolds = 2.0 * radius * speed * AIR_DENSITY / AIR_VISCOSITY
    slowed = slowing(speed, radius, mass) * speed
    impact, landing = nan, nan
    if np.isfinite(found.t2) and own.radius > 0.0:
        impact, landing = _shifts(Course(scene, found))
    return Drag(
        speed=speed,
        reynolds=reynolds,
        coefficient=drag_coefficient(reynolds),
        slowing=slowed,
        share_of_weight=slowed / scene.gravity if scene.gravity > 0.0 else nan,
        impact_shift=impact,
        landing_shift=landing,
        arrives=not (np.isfinite(found.t2) and np.isnan(impact))
        and not (np.isfinite(found.t3) and np.isnan(landing)),
    )


def _shifts(course: Course) -> tuple[float, float]:
    """Return `Drag.impact_shift` and `Drag.landing_shift`."""
    found, own = course.found, course.own
    restitution, friction = course.scene.met(course.scene.kinds[0], "plate")

    def rate(vx: float, vy: float) -> tuple[float, float]:
        slow = slowing(hypot(vx, vy), own.radius, own.mass)
        return -slow * vx, -slow * vy - course.scene.gravity

    start = course.separation
    (nx, ny), (ux, uy) = course.normal, course.up
    px, py = course.pivot

    def before_plate(state: State) -> float:
        return float((state[0] - px) * nx + (state[1] - py) * ny - own.radius)

    met = fly((*start.position, *start.velocity), rate, before_plate, float(found.t2))
    if met is None:
        return nan, nan
    x, y, vx, vy = met
    shift = float(y - course.impact[1])
    if not np.isfinite(found.t3):
        return shift, nan
    away, down, _ = rebounded(
        normal=np.array(-vx * nx - vy * ny), tangential=np.array(-vx * ux - vy * uy),
        rim=np.array(own.radius * float(found.omega1)), restitution=np.array(restitution),
        friction=np.array(friction), spin=np.array(own.spin), inertia=np.array(own.moment or 0.5),
    )  # fmt: skip
    level = float(course.impact[1] - found.y3)
    after = (x, y, float(away * nx - down * ux), float(away * ny - down * uy))
    landed = fly(after, rate, lambda state: state[1] - level, float(found.t3))
    if landed is None:
        return shift, nan
    return shift, float(landed[0] - (course.impact[0] - found.x3))


def fly(
    start: State,
    rate: Callable[[float, float], tuple[float, float]],
    gap: Callable[[State], float],
    about: float,
) -> State | None:
    """Fly until a gap closes; None if it does not in three times the time that it takes about, s.

    `rate` gives the acceleration (m/s²) from the velocity. Classical Runge-Kutta; the last step is
    cut where the gap, taken for linear and then by secants, is 0.
    """
    vx, vy = start[2:]
    relief = -rate(vx, vy)[0] / vx if vx else 0.0
    h = min(about / STEPS, 0.25 / relief) if relief > 0.0 else about / STEPS
    if not h > 0.0 or 3.0 * about / h > MOST_STEPS:
        return start if about == 0.0 else None
    state, before = start, gap(start)
    for _ in range(int(3.0 * about / h) + 1):
        ahead = _step(state, rate, h)
        after = gap(ahead)
        if after <= 0.0:
            break
        state, before = ahead, after
    else:
        return None
    low, high = 0.0, h
    for _ in range(8):
        cut = high - after * (high - low) / (after - before)
        low, before, high = high, after, cut
        ahead = _step(state, rate, cut)
        after = gap(ahead)
        if abs(after) <= 1e-15 or after == before:
            break
    return ahead


def _step(state: State, rate: Callable[[float, float], tuple[float, float]], h: float) -> State:
    """Return the state a step of h (s) later."""
    x, y, vx, vy = state
    a = rate(vx, vy)
    b = rate(vx + 0.5 * h * a[0], vy + 0.5 * h * a[1])
    c = rate(vx + 0.5 * h * b[0], vy + 0.5 * h * b[1])
    d = rate(vx + h * c[0], vy + h * c[1])
    return (
        x + h * (vx + h / 6.0 * (a[0] + b[0] + c[0])),
        y + h * (vy + h / 6.0 * (a[1] + b[1] + c[1])),
        vx + h / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]),
        vy + h / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1]),
    )
