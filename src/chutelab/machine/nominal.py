"""The nominal particle up to the plate's line: what the machine's geometry is measured from.

Of a family of scenes, the nominal particles of all: what depends on a varied key is an array (N,).
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan

import numpy as np

from chutelab.machine.releases import on_belt, release_point, release_velocity
from chutelab.mechanics.ballistics import descent
from chutelab.mechanics.contact import (
    DISK_SHARE,
    Circle,
    Outcome,
    advance,
    grip_slip,
    normal_force,
)
from chutelab.scene import Scene
from chutelab.util.arrays import Bools, Floats, Ints, Numbers

STEPS = 100_000
"""Knots of a ride after which it counts as one without an end; a quarter turn takes 65, the slowest
fall off the very top 2,000."""


Pair = tuple[Numbers, Numbers]
"""A place (m) or a velocity (m/s) in the world frame."""


def discharge(scene: Scene) -> tuple[Pair, Pair]:
    """Return where free flight of the nominal particle begins: position (m) and velocity (m/s).

    It is followed along belt and pulley. NaN if it never leaves forwards (a belt at rest, or one
    that throws it off backwards).
    """
    position, velocity = release_point(scene), release_velocity(scene)
    if scene.incoming is None or not on_belt(scene) or velocity[1] != 0.0:
        return position, velocity
    rho, speed = scene.incoming.pulley_radius + scene.particle.radius, scene.incoming.speed
    if not isinstance(scene.met(scene.kinds[0], "incoming")[1], str):
        return _slip_round(scene, rho, velocity[0], -position[0])
    # Adhesion lets go where cos φ1 = v²/(g ρ), at the top if that is 1 or more: Eq. (2).
    ratio = np.divide(speed * speed, scene.gravity * rho)
    grip = np.where(np.greater(speed, 0.0), np.minimum(ratio, 1.0), nan)
    sine = np.sqrt((1.0 - grip) * (1.0 + grip))
    return (rho * sine, rho * grip), (speed * grip, 0.0 - speed * sine)


def _slip_round(scene: Scene, rho: Numbers, speed: Numbers, distance: Numbers) -> tuple[Pair, Pair]:
    """Go along belt and pulley with Coulomb friction."""
    assert scene.incoming is not None
    given = (
        rho, speed, distance, scene.gravity, scene.met(scene.kinds[0], "incoming")[1],
        scene.incoming.speed,
    )  # fmt: skip
    shape = np.broadcast_shapes(*map(np.shape, given))
    rho, speed, distance, gravity, friction, belt = (
        np.broadcast_to(values, shape).ravel() for values in given
    )
    share = np.full(len(rho), DISK_SHARE if scene.particle.spin else 1.0)
    w, z = _along_belt(speed, distance, friction * gravity, belt, share)
    nothing = np.zeros(len(rho))
    circle = Circle(
        phi=nothing, w=w, z=z, rho=rho, gravity=gravity, friction=friction, belt=belt,
        slip=nothing, share=share, low=nothing - 1e-9, high=nothing + inf,
    )  # fmt: skip
    slip = w + z - belt
    circle = replace(circle, slip=np.where(slip == 0.0, grip_slip(circle), np.sign(slip)))
    phi, w = (values.reshape(shape) for values in _round_pulley(circle))
    rho, sine, cosine = rho.reshape(shape), np.sin(phi), np.cos(phi)
    return (rho * sine, rho * cosine), (w * cosine, -w * sine)


def _along_belt(
    w: Floats, distance: Floats, drag: Floats, belt: Floats, share: Floats
) -> tuple[Floats, Floats]:
    """Return speed and r ω at the top of the pulley after slipping along the belt, NaN if never."""
    slip = w - belt
    slips = (slip != 0.0) & (drag > 0.0)
    pull = np.where(slip > 0.0, -drag, drag)
    until_grip = np.where(slips, np.abs(slip) / np.where(slips, drag * (1.0 / share), 1.0), 0.0)
    reach = descent(distance, -w, -pull)
    reach = np.where(np.isfinite(reach), reach, inf)
    t = np.minimum(until_grip, reach)
    pace = np.where(slips, w + pull * t, w)
    z = np.where(slips, (1.0 / share - 1.0) * pull * t, 0.0)
    arrives = np.where(slips & (reach <= until_grip), True, pace > 0.0)
    return np.where(arrives, pace, nan), z


def _round_pulley(circle: Circle) -> tuple[Floats, Floats]:
    """Return angle from the top and speed where particles lift off the pulley, NaN if never."""
    phi, w = np.full((2, len(circle.phi)), nan)
    who = np.flatnonzero(np.isfinite(circle.w))
    circle = _some(circle, who)
    for _ in range(STEPS):
        lifts = normal_force(circle) <= 0.0
        phi[who[lifts]], w[who[lifts]] = circle.phi[lifts], circle.w[lifts]
        if lifts.any():
            who, circle = who[~lifts], _some(circle, ~lifts)
        if not len(who):
            break
        step = advance(circle, np.full(len(who), inf))
        gone = step.outcome == Outcome.LIFT
        phi[who[gone]], w[who[gone]] = step.phi[gone], step.w[gone]
        goes_on = ~gone & np.isfinite(step.dt) & (step.outcome != Outcome.LOW)
        circle = replace(circle, phi=step.phi, w=step.w, z=step.z)
        onset = np.sign(np.sin(circle.phi))
        slip = np.where(step.outcome == Outcome.GRIP, grip_slip(circle), circle.slip)
        circle = replace(circle, slip=np.where(step.outcome == Outcome.ONSET, onset, slip))
        if not goes_on.all():
            who, circle = who[goes_on], _some(circle, goes_on)
    return phi, w


def _some(circle: Circle, which: Ints | Bools) -> Circle:
    given = {name: array for name, array in vars(circle).items() if array is not None}
    return Circle(**{name: array[which] for name, array in given.items()})


def plate_hit(scene: Scene) -> Pair:
    """Return the centre (m) as it meets the struck face of the unbounded plate; NaN if never.

    The face's normal is (-cos α, -sin α); contact is when the centre is r in front of it.
    """
    if scene.plate is None or scene.incoming is None:
        return nan, nan
    alpha = np.radians(scene.plate.angle_deg)
    nx, ny = -np.cos(alpha), -np.sin(alpha)
    pivot_x = scene.incoming.pulley_radius + scene.plate.distance
    pivot_y = scene.plate.pivot_height
    (x, y), (vx, vy) = discharge(scene)
    gap = (x - pivot_x) * nx + (y - pivot_y) * ny - scene.particle.radius
    pace, pull = vx * nx + vy * ny, -scene.gravity * ny
    t = descent(gap, pace, pull)
    moves = (vx != 0.0) | (vy != 0.0) | (scene.gravity != 0.0)
    t = np.where((gap >= 0.0) & (t >= 0.0) & (t < inf) & moves, t, nan)
    return x + vx * t, y + vy * t - 0.5 * scene.gravity * t * t
