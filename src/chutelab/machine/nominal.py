"""The nominal particle up to the plate's line: what the machine's geometry is measured from.

Of a family of scenes, the nominal particles of all: what depends on a varied key is an array (N,).
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan

import numpy as np

from chutelab.machine.releases import on_belt, release_point, release_velocity, up_belt
from chutelab.mechanics.ballistics import descent
from chutelab.mechanics.contact import (
    Circle,
    Outcome,
    advance,
    grip_slip,
    normal_force,
    rim_share,
)
from chutelab.scene import Scene
from chutelab.util.arrays import Bools, Floats, Ints, Numbers
from chutelab.util.trig import RADIANS, sin_cos

STEPS = 100_000
"""Knots of a ride after which it counts as one without an end; a quarter turn takes 65, the slowest
fall off the very top 2,000."""


PHASES = 3
"""Sliding, gripping or not, and sliding back: what can follow each other on a belt."""

ALONG = 1e-12
"""Share of a speed across the belt that is rounding."""

Pair = tuple[Numbers, Numbers]
"""A place (m) or a velocity (m/s) in the world frame."""


def discharge(scene: Scene) -> tuple[Pair, Pair]:
    """Return where free flight of the nominal particle begins: position (m) and velocity (m/s).

    It is followed along belt and pulley. NaN if it never leaves forwards (a belt at rest, or one
    that throws it off backwards).
    """
    position, velocity = release_point(scene), release_velocity(scene)
    if scene.incoming is None or not on_belt(scene):
        return position, velocity
    (x, y), (vx, vy), (cosine, sine) = position, velocity, up_belt(scene)
    if scene.stream.velocity is not None:
        across = np.abs(vy * cosine - vx * sine)
        if np.count_nonzero(across > ALONG * np.hypot(vx, vy)):
            return position, velocity
    rho, speed = scene.incoming.pulley_radius + scene.particle.radius, scene.incoming.speed
    _, friction = scene.met(scene.kinds[0], "incoming")
    if not isinstance(friction, str):
        way = 0.0 - (x * cosine + y * sine)
        return _slip_round(scene, rho, vx * cosine + vy * sine, way, friction)
    # Adhesion lets go where cos φ1 = v²/(g ρ), Eq. (2), or where the belt ends if that is more.
    ratio = np.divide(speed * speed, scene.gravity * rho)
    grip = np.where(np.greater(speed, 0.0), np.minimum(ratio, cosine), nan)
    side = np.sqrt((1.0 - grip) * (1.0 + grip))
    if np.count_nonzero(sine):
        side = np.where(grip < cosine, side, grip * 0.0 - sine)
    return (rho * side, rho * grip), (speed * grip, 0.0 - speed * side)


def _slip_round(
    scene: Scene, rho: Numbers, speed: Numbers, distance: Numbers, friction: Numbers
) -> tuple[Pair, Pair]:
    """Go along belt and pulley with Coulomb friction."""
    belt = scene.incoming
    assert belt is not None
    given = (
        rho, speed, distance, scene.gravity, friction, belt.speed, np.radians(belt.incline_deg),
        belt.length,
    )  # fmt: skip
    shape = np.broadcast_shapes(*map(np.shape, given))
    rho, speed, distance, gravity, friction, pace, incline, length = (
        np.broadcast_to(values, shape).ravel() for values in given
    )
    share = np.full(len(rho), rim_share(1.0, 1.0, scene.particle.moment))
    start = 0.0 - incline
    circle = Circle(
        phi=start, w=speed, z=np.zeros(len(rho)), rho=rho, gravity=gravity, friction=friction,
        belt=pace, slip=np.zeros(len(rho)), share=share, low=start - 1e-9, high=start + inf,
    )  # fmt: skip
    w, z = _along_belt(circle, distance, length)
    circle = replace(circle, w=w, z=z)
    slip = w + z - pace
    circle = replace(circle, slip=np.where(slip == 0.0, grip_slip(circle), np.sign(slip)))
    phi, w = (values.reshape(shape) for values in _round_pulley(circle))
    rho, sine, cosine = rho.reshape(shape), np.sin(phi), np.cos(phi)
    return (rho * sine, rho * cosine), (w * cosine, -w * sine)


# A way that is never gone comes out as inf or NaN.
@np.errstate(divide="ignore", invalid="ignore")
def _along_belt(circle: Circle, distance: Floats, length: Floats) -> tuple[Floats, Floats]:
    """Return speed and r ω where the belt meets the pulley, NaN if the particle never gets there.

    It slides until it grips, is carried or rolls then, or slides the other way where the belt is
    too steep for its friction.
    """
    w, z, lever = circle.w, circle.z, circle.lever
    load, pull = circle.gravity * np.cos(circle.phi), circle.gravity * np.sin(circle.phi)
    still = w + z == circle.belt
    arrives, lost = np.zeros((2, len(w)), dtype=bool)
    for _ in range(PHASES):
        holds = still & (circle.share * np.abs(pull) <= circle.friction * load)
        slides = np.where(still, np.sign(pull), np.sign(w + z - circle.belt))
        force = np.where(holds, -circle.share * pull, -slides * circle.friction * load)
        pace, twist = pull + force, lever * force
        fades = ~still & (slides * (pace + twist) < 0.0)
        rate = np.where(fades, np.abs(pace + twist), 1.0)
        until_grip = np.where(fades, np.abs(w + z - circle.belt) / rate, inf)
        reach, back = descent(distance, -w, -pace), descent(length - distance, w, pace)
        reach, back = (np.where(when >= 0.0, when, inf) for when in (reach, back))
        t = np.where(arrives | lost, 0.0, np.minimum(np.minimum(until_grip, reach), back))
        lost |= ~arrives & ((back < np.minimum(reach, until_grip)) | np.isinf(t))
        arrives |= ~lost & (reach <= until_grip)
        t = np.where(np.isfinite(t), t, 0.0)
        distance = distance - t * (w + 0.5 * pace * t)
        w, z, still = w + pace * t, z + twist * t, still | fades
    return np.where(arrives, w, nan), z


def _round_pulley(circle: Circle) -> tuple[Floats, Floats]:
    """Return angle from the top and speed where particles lift off the pulley, NaN if never."""
    phi, w = np.full((2, len(circle.phi)), nan)
    index = np.flatnonzero(np.isfinite(circle.w))
    circle = _some(circle, index)
    for _ in range(STEPS):
        lifts = normal_force(circle) <= 0.0
        phi[index[lifts]], w[index[lifts]] = circle.phi[lifts], circle.w[lifts]
        if lifts.any():
            index, circle = index[~lifts], _some(circle, ~lifts)
        if not len(index):
            break
        step = advance(circle, np.full(len(index), inf))
        gone = step.outcome == Outcome.LIFT
        phi[index[gone]], w[index[gone]] = step.phi[gone], step.w[gone]
        goes_on = ~gone & np.isfinite(step.dt) & (step.outcome != Outcome.LOW)
        circle = replace(circle, phi=step.phi, w=step.w, z=step.z)
        onset = np.sign(np.sin(circle.phi))
        slip = np.where(step.outcome == Outcome.GRIP, grip_slip(circle), circle.slip)
        circle = replace(circle, slip=np.where(step.outcome == Outcome.ONSET, onset, slip))
        if not goes_on.all():
            index, circle = index[goes_on], _some(circle, goes_on)
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
    sine, cosine = sin_cos(scene.plate.angle_deg * RADIANS)
    nx, ny = -cosine, -sine
    pivot_x = scene.incoming.pulley_radius + scene.plate.distance
    pivot_y = scene.plate.pivot_height
    (x, y), (vx, vy) = discharge(scene)
    gap = (x - pivot_x) * nx + (y - pivot_y) * ny - scene.particle.radius
    pace, pull = vx * nx + vy * ny, -scene.gravity * ny
    t = descent(gap, pace, pull)
    moves = (vx != 0.0) | (vy != 0.0) | (scene.gravity != 0.0)
    t = np.where((gap >= 0.0) & (t >= 0.0) & (t < inf) & moves, t, nan)
    return x + vx * t, y + vy * t - 0.5 * scene.gravity * t * t
