"""The nominal particle up to the plate's line: what the machine's geometry is measured from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, inf, radians, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np

from chutelab.ballistics import closing_time, descent
from chutelab.releases import on_belt, release_point, release_velocity
from chutelab.ride import Circle, Outcome, advance, grip_slip, normal_force

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.scene import Scene


STEPS = 100_000
"""Knots of a ride after which it counts as one without an end; a quarter turn takes 65, the slowest
fall off the very top 2,000."""


@dataclass(frozen=True)
class Discharge:
    """Where free flight begins: position (m) and velocity (m/s), two floats each."""

    position: tuple[float, float]
    velocity: tuple[float, float]


def discharge(scene: Scene) -> Discharge | None:
    """Follow the nominal particle along belt and pulley until it flies.

    Returns
    -------
    Discharge or None
        None if it never leaves forwards (a belt at rest, or one that throws it off backwards).
    """
    position, velocity = release_point(scene), release_velocity(scene)
    if scene.incoming is None or not on_belt(scene) or velocity[1] != 0.0:
        return Discharge(position, velocity)
    rho = scene.incoming.pulley_radius + scene.particle.radius
    if scene.incoming.friction == "adhesion":
        return _let_go(scene, rho)
    pace = _along_belt(scene, velocity[0], -position[0])
    return None if pace is None else _round_pulley(scene, rho, *pace)


def _let_go(scene: Scene, rho: float) -> Discharge | None:
    """Leave by adhesion where cos φ1 = v²/(g ρ), at the top if that is 1 or more (Eq. (2))."""
    assert scene.incoming is not None
    speed = scene.incoming.speed
    if speed == 0.0:
        return None
    grip = speed**2 / (scene.gravity * rho) if scene.gravity > 0.0 else inf
    if grip >= 1.0:
        return Discharge((0.0, rho), (speed, 0.0))
    sine = sqrt((1.0 - grip) * (1.0 + grip))
    return Discharge((rho * sine, rho * grip), (speed * grip, -speed * sine))


def _along_belt(scene: Scene, w: float, distance: float) -> tuple[float, float] | None:
    """Return speed and r ω at the top of the pulley after slipping along the belt."""
    assert scene.incoming is not None
    belt, z = scene.incoming, 0.0
    drag = float(belt.friction) * scene.gravity
    slip = w - belt.speed
    if slip != 0.0 and drag > 0.0:
        pull = -drag if slip > 0.0 else drag
        until_grip = abs(slip) / (drag * (3.0 if scene.particle.spin else 1.0))
        reach = float(closing_time(distance, -w, -pull))
        t = min(until_grip, reach)
        distance -= w * t + 0.5 * pull * t * t
        w += pull * t
        z = 2.0 * pull * t if scene.particle.spin else 0.0
        if reach <= until_grip:
            return w, z
    return (w, z) if w > 0.0 else None


def _round_pulley(scene: Scene, rho: float, w: float, z: float) -> Discharge | None:
    assert scene.incoming is not None
    belt = scene.incoming

    def one(value: float) -> NDArray[np.float64]:
        return np.array([value])

    circle = Circle(
        phi=one(0.0), w=one(w), z=one(z), rho=one(rho), gravity=one(scene.gravity),
        friction=one(float(belt.friction)), belt=one(belt.speed), slip=one(0.0),
        turns=np.array([scene.particle.spin]), low=one(-1e-9), high=one(inf),
    )  # fmt: skip
    slip = w + z - belt.speed
    circle = replace(circle, slip=grip_slip(circle) if slip == 0.0 else one(np.sign(slip)))
    for _ in range(STEPS):
        if normal_force(circle)[0] <= 0.0:
            break
        step = advance(circle, one(inf))
        if not np.isfinite(step.dt[0]) or step.outcome[0] == Outcome.LOW:
            return None
        circle = replace(circle, phi=step.phi, w=step.w, z=step.z)
        if step.outcome[0] == Outcome.LIFT:
            break
        if step.outcome[0] in (Outcome.GRIP, Outcome.ONSET):
            pull = grip_slip(circle)
            onset = step.outcome[0] == Outcome.ONSET
            circle = replace(circle, slip=np.sign(np.sin(circle.phi)) if onset else pull)
    else:
        return None
    phi, w = float(circle.phi[0]), float(circle.w[0])
    return Discharge((rho * sin(phi), rho * cos(phi)), (w * cos(phi), -w * sin(phi)))


def plate_hit(scene: Scene, start: Discharge | None) -> tuple[float, float] | None:
    """Return the centre (m) as it meets the struck face of the unbounded plate, or None.

    The face's normal is (-cos α, -sin α); contact is when the centre is r in front of it.
    """
    if scene.plate is None or scene.incoming is None or start is None:
        return None
    alpha = radians(scene.plate.angle_deg)
    nx, ny = -cos(alpha), -sin(alpha)
    pivot_x = scene.incoming.pulley_radius + scene.plate.distance
    pivot_y = scene.plate.pivot_height or 0.0
    (x, y), (vx, vy) = start.position, start.velocity
    gap = (x - pivot_x) * nx + (y - pivot_y) * ny - scene.particle.radius
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = float(descent(np.float64(gap), np.float64(vx * nx + vy * ny), -scene.gravity * ny))
    if gap < 0.0 or not 0.0 <= t < inf or hypot(vx, vy) == 0.0 == scene.gravity:
        return None
    return x + vx * t, y + vy * t - 0.5 * scene.gravity * t * t
