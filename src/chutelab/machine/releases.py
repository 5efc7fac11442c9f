"""Where, when and how fast each particle of the stream starts."""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, degrees, inf, prod

import numpy as np

from chutelab.scene import Scene
from chutelab.scene.rules import ON_BELT
from chutelab.util.arrays import Bools, Floats, Ints
from chutelab.util.tables import number

TRIES = 1000
"""Draws of a height that may overlap an earlier particle before it has to wait for its place."""

DEEP = 0.01
"""Share of the radius. Riders of one layer that touch, 2 r of arc apart, are by r³/(3 ρ²) nearer on
the chord: by less than this where r < ρ/6."""


@dataclass(frozen=True, eq=False)
class Releases:
    """Start of each particle, read-only arrays.

    Attributes
    ----------
    t : ndarray, (N,)
        s, ascending.
    position, velocity : ndarray, (N, 2)
        m, m/s.
    carried : ndarray of bool, (N,)
        Rides the incoming belt by adhesion, at radius R + r + h round the pulley, until separation.
    stream : ndarray of int, (N,)
        Whose it is: particles of the first stream come first, then those of the next.
    kind : ndarray of int, (N,)
        Its row in the machine's tables of pairs; of a family each has a row of its own.
    """

    t: Floats
    position: Floats
    velocity: Floats
    carried: Bools
    stream: Ints
    kind: Ints

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.flags.writeable = False


def release_point(scene: Scene) -> tuple[float, float]:
    """Return the nominal release point, m; on the belt exactly at the riding height."""
    belt = scene.incoming
    if belt is None:
        assert scene.stream.at is not None
        return scene.stream.at
    riding = belt.pulley_radius + scene.particle.radius
    if scene.stream.at is None:
        return -belt.length, riding
    x, y = scene.stream.at
    return (x, riding) if abs(y - riding) <= ON_BELT and -belt.length <= x <= 0.0 else (x, y)


def release_velocity(scene: Scene) -> tuple[float, float]:
    """Return the nominal release velocity, m/s."""
    if scene.stream.velocity is not None:
        return scene.stream.velocity
    assert scene.incoming is not None
    return scene.incoming.speed, 0.0


def on_belt(scene: Scene) -> bool:
    """Tell whether the stream is released on the incoming belt."""
    if scene.incoming is None:
        return False
    if scene.stream.at is None:
        return True
    x, y = release_point(scene)
    riding = scene.incoming.pulley_radius + scene.particle.radius
    return y == riding and -scene.incoming.length <= x <= 0.0


def schedule(scene: Scene) -> Floats:
    """Return when each particle is due, s (N,); those of each scene of a family follow another."""
    return np.tile(np.arange(scene.stream.count), prod(scene.shape)) / scene.stream.rate


@dataclass(frozen=True)
class Squeeze:
    """Riders by adhesion that get into each other round the pulley.

    All layers of a bed have the belt's speed, the lower ones on smaller circles: where the pulley
    does not throw them off at its top, they turn ahead, into what rides above them.
    """

    particles: int  # how many are in another by more than `DEEP`
    deepest: float  # overlap of the worst two, m
    grip: float  # v²/(g ρ) of the highest rider: it stays on the pulley until cos φ is this

    def __str__(self) -> str:
        return (
            f"{self.particles} particles ride into others round the pulley,"
            f" {number(self.deepest)} m deep at most: adhesion carries all layers at one speed, the"
            f" lower ones on smaller circles, and v²/(g rho) = {self.grip:.3g} keeps the highest"
            f" there for {degrees(acos(self.grip)):.3g}°, past the top"
        )


def squeeze(scene: Scene, t: Floats, position: Floats) -> Squeeze | None:
    """Return who rides into others; None if nobody does.

    A ride that something ends early counts as if it went on. Two that would be in each other on the
    belt already do not count: one of them waits.

    Parameters
    ----------
    scene : Scene
        What is released, and where.
    t, position : ndarray, (N,) and (N, 2)
        When and where particles are released, s and m: planned, or of a run.
    """
    belt, radius = scene.incoming, scene.particle.radius
    if belt is None or not isinstance(belt.friction, str) or not on_belt(scene):
        return None
    if not scene.stream.interact or belt.speed == 0.0 or scene.gravity == 0.0:
        return None
    x, rho = position.T
    top = t - x / belt.speed
    grip = belt.speed**2 / (scene.gravity * rho)
    order = np.argsort(top)
    top, rho = top[order], rho[order]
    leaves = top + rho * np.arccos(np.minimum(grip[order], 1.0)) / belt.speed
    depth = np.zeros(len(top))
    for lag in range(1, len(top)):
        # The later one is on the pulley from its own top, both are until one leaves.
        begin, end = top[lag:], np.minimum(leaves[:-lag], leaves[lag:])
        if (begin >= leaves[:-lag]).all():
            break
        mine, its = rho[:-lag], rho[lag:]
        waits_for = np.hypot(belt.speed * (begin - top[:-lag]), mine - its) < 2.0 * radius
        angle = belt.speed * np.array(
            [(now - top[:-lag]) / mine - (now - begin) / its for now in (begin, end)]
        )
        angle = np.where(angle[1] > 0.0, angle.min(axis=0), 0.0)
        apart = np.hypot(mine - its, 2.0 * np.sqrt(mine * its) * np.sin(0.5 * angle))
        found = np.where((begin < end) & ~waits_for, 2.0 * radius - apart, 0.0)
        depth[:-lag] = np.maximum(depth[:-lag], found)
        depth[lag:] = np.maximum(depth[lag:], found)
    particles = int(np.count_nonzero(depth > DEEP * radius))
    return Squeeze(particles, float(depth.max()), float(grip.min())) if particles else None


def draw(scene: Scene) -> Releases:
    """Draw the releases of a scene; the same scene and seed give the same numbers.

    Of a family each scene has one particle. Particles that meet start where no other is, as far as
    the bed has room: an engine lets the others wait until their place is free.
    """
    stream, t = scene.stream, schedule(scene)
    crowded, count = stream.crowded, len(t)
    position, velocity = np.empty((2, count, 2))
    velocity[:, 0], velocity[:, 1] = release_velocity(scene)
    height = np.zeros(count)
    # The first one has no spread. Making a generator takes as long as all other preparations.
    if stream.count > 1 and (stream.bed_height > 0.0 or stream.speed_spread > 0.0 or crowded):
        rng = np.random.default_rng(stream.seed)
        height = stream.bed_height * rng.random(count)
        height[0] = 0.0
        spread = stream.speed_spread * rng.uniform(-1.0, 1.0, count)
        spread[0] = 0.0
        x, y = release_velocity(scene)
        speed = float(np.hypot(x, y))
        velocity += spread[:, None] * ((x / speed, y / speed) if speed > 0.0 else (1.0, 0.0))
    rides = on_belt(scene)
    adheres = rides and scene.incoming is not None and isinstance(scene.incoming.friction, str)
    if crowded:
        fall = 0.0 if adheres else 0.5 * scene.gravity
        floor = 0.0 if rides else -inf
        _spread_apart(scene, t, height, velocity, fall, floor, rng)
    position[:, 0], low = release_point(scene)
    position[:, 1] = low + height
    carried = np.zeros(count, dtype=bool)
    carried[:] = adheres
    stream_of = np.zeros(count, dtype=np.int64)
    kind = np.arange(count) if scene.shape else stream_of.copy()
    return Releases(t, position, velocity, carried, stream_of, kind)


def _spread_apart(
    scene: Scene,
    t: Floats,
    height: Floats,
    velocity: Floats,
    fall: float,
    floor: float,
    rng: np.random.Generator,
) -> None:
    """Redraw heights, in place, so that no particle starts inside one released before it.

    One that finds no free place in the bed keeps what was drawn last, and waits when it is due.

    Earlier particles are taken to have moved on at their release velocity, and to have fallen by
    ``fall`` (m/s²) times their age squared, but not below ``floor`` (m above the lowest layer).
    """
    stream, diameter = scene.stream, 2.0 * scene.particle.radius
    # Who may still be in the way: whoever has moved on by a diameter, or has fallen below the bed
    # by one, stays away for good.
    close = np.zeros(0, dtype=np.int64)
    for i in range(1, stream.count):
        close = np.append(close, i - 1)
        age = t[i] - t[close]
        dx = velocity[close, 0] * age
        dy = height[close] + velocity[close, 1] * age - fall * age**2
        sinks = velocity[close, 1] <= 2.0 * fall * age
        near = (np.abs(dx) < diameter) & ~(sinks & (np.maximum(dy, floor) <= -diameter))
        close, dx, dy = close[near], dx[near], np.maximum(dy[near], floor)
        for _ in range(TRIES if stream.bed_height > 0.0 else 0):
            if np.all(dx**2 + (dy - height[i]) ** 2 >= diameter**2):
                break
            height[i] = stream.bed_height * rng.random()
