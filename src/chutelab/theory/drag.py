"""An estimate of the effect of air drag on a scene without it.

The particle counts as a sphere of its radius in still air of 20 °C; long or flat pieces have more
drag. The flights of particle 0 are integrated with drag; its impact on the plate is unchanged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isnan, nan, pi
from typing import TYPE_CHECKING

import numpy as np

from chutelab.theory.prediction import Course
from chutelab.theory.transfer import Transfer, rebounded

if TYPE_CHECKING:
    from chutelab.scene import Scene

AIR_DENSITY = 1.2
"""kg/m³, at 20 °C and sea level."""

AIR_VISCOSITY = 1.8e-5
"""Pa s, under the same conditions."""

STEPS = 24
"""Fourth-order steps of a flight; their error is 1e-7 of the effect of drag."""

MOST_STEPS = 20_000
"""Most steps; dust, which air stops within microns, would take more and gets no answer."""

State = tuple[complex, complex]
"""Place, x + i y (m), and velocity (m/s) likewise."""


@dataclass(frozen=True)
class Drag:
    """Effect of air drag; as text for people.

    Attributes
    ----------
    speed : float
        The highest known speed, for which the next three hold, m/s.
    reynolds, coefficient : float
        Reynolds number and drag coefficient of a sphere of the particle's radius.
    slowing : float
        Drag over mass, m/s².
    share_of_weight : float
        Drag over weight; NaN without gravity.
    impact_shift : float
        How much higher particle 0 would meet the plate, m (negative: lower); NaN without a closed
        form, or if it would not get there.
    landing_shift : float
        How much farther forward it would come down on the outgoing belt, m; NaN likewise.
    arrives : bool
        False if with air it would not get as far as in the closed form.
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
        return f"air drag, left out, would be {self.effect}"

    @property
    def effect(self) -> str:
        """Size and effect of the drag, in words."""
        share = f"{100.0 * self.share_of_weight:.2g} % of the weight"
        if self.share_of_weight >= 1.0:
            share = f"{self.share_of_weight:.3g} times the weight"
        if isnan(self.share_of_weight):
            share = f"a deceleration of {self.slowing:.2g} m/s²"
        said = f"{share} at {self.speed:.3g} m/s"
        if not self.arrives:
            said += ", and air would keep particle 0 from getting there"
        elif abs(self.landing_shift) >= 1e-6:  # m; not NaN either
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
    """Estimate air drag in a scene; None for mass points, which have none, and if nothing moves.

    Parameters
    ----------
    scene : Scene
        A validated scene.
    found : Transfer
        The result of `predict` for it.
    speed : float
        Highest speed that a particle has, m/s; particle 0 at its landing may be faster.
    radius, mass : float, optional
        Radius and mass of the fastest particle, if it is not particle 0.
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
        impact, landing = shifts(Course(scene, found))
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


def shifts(course: Course) -> tuple[float, float]:
    """Return `Drag.impact_shift` and `Drag.landing_shift`."""
    found, own, leaves = course.found, course.own, course.separation
    restitution, friction = course.scene.met(course.scene.kinds[0], "plate")
    normal, up, pivot, place, speed, impact = (
        complex(*vector)
        for vector in (
            course.normal, course.up, course.pivot, leaves.position, leaves.velocity, course.impact,
        )
    )  # fmt: skip

    def rate(v: complex) -> complex:
        return -slowing(abs(v), own.radius, own.mass) * v - 1j * course.scene.gravity

    def along(vector: complex, direction: complex) -> float:
        return (vector * direction.conjugate()).real

    t2, t3 = float(found.t2), float(found.t3)
    met = fly((place, speed), rate, lambda z: along(z - pivot, normal) - own.radius, t2)
    if met is None:
        return nan, nan
    z, v = met
    shift = (z - impact).imag
    if not np.isfinite(t3):
        return shift, nan
    away, down, _ = (
        float(part)
        for part in rebounded(
            normal=np.array(-along(v, normal)), tangential=np.array(-along(v, up)),
            rim=own.radius * found.omega1, restitution=np.array(restitution),
            friction=np.array(friction), spin=np.array(own.spin),
            inertia=np.array(own.moment or 0.5),
        )
    )  # fmt: skip
    lands = impact - complex(found.x3, found.y3)
    after = z, away * normal - down * up
    landed = fly(after, rate, lambda z: (z - lands).imag, t3)
    return shift, nan if landed is None else (landed[0] - lands).real


def step(state: State, rate: Callable[[complex], complex], h: float) -> State:
    """Return the state h (s) later, by one classical Runge-Kutta step; `rate` as in `fly`."""
    z, v = state
    a = rate(v)
    b = rate(v + 0.5 * h * a)
    c = rate(v + 0.5 * h * b)
    d = rate(v + h * c)
    return z + h * (v + h / 6.0 * (a + b + c)), v + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)


def fly(
    start: State, rate: Callable[[complex], complex], gap: Callable[[complex], float], about: float
) -> State | None:
    """Fly until a gap closes; None if it does not in three times the expected time, s.

    `rate` gives the acceleration (m/s²) from the velocity, `gap` a distance (m) from the place.
    The last step is shortened to where the gap is 0, by linear interpolation and then secants.
    """
    vx = start[1].real
    relief = -rate(start[1]).real / vx if vx else 0.0
    h = min(about / STEPS, 0.25 / relief) if relief > 0.0 else about / STEPS
    if not h > 0.0 or 3.0 * about / h > MOST_STEPS:
        return start if about == 0.0 else None
    state, before = start, gap(start[0])
    for _ in range(int(3.0 * about / h) + 1):
        ahead = step(state, rate, h)
        after = gap(ahead[0])
        if after <= 0.0:
            break
        state, before = ahead, after
    else:
        return None
    low, high = 0.0, h
    for _ in range(8):
        cut = high - after * (high - low) / (after - before)
        low, before, high = high, after, cut
        ahead = step(state, rate, cut)
        after = gap(ahead[0])
        if abs(after) <= 1e-15 or after == before:
            break
    return ahead
