"""Where, when and how fast each particle of the stream starts."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from chutelab.scene import Fault, SceneError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.scene import Scene

ON_BELT = 1e-9
"""m; a release point this close to the riding height counts as on the belt."""

TRIES = 1000
"""Draws of a height that may overlap an earlier particle before the scene is refused."""


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
    """

    t: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    carried: NDArray[np.bool_]

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.flags.writeable = False


def release_point(scene: Scene) -> tuple[float, float]:
    """Return the nominal release point, m."""
    if scene.stream.at is not None:
        return scene.stream.at
    assert scene.incoming is not None
    return -scene.incoming.length, scene.incoming.pulley_radius + scene.particle.radius


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
    x, y = release_point(scene)
    riding = scene.incoming.pulley_radius + scene.particle.radius
    return abs(y - riding) <= ON_BELT and -scene.incoming.length <= x <= 0.0


def draw(scene: Scene) -> Releases:
    """Draw the releases of a scene; the same scene and seed give the same numbers.

    Raises
    ------
    SceneError
        If interacting particles cannot be placed in the bed without overlap.
    """
    stream = scene.stream
    rng = np.random.default_rng(stream.seed)
    t = np.arange(stream.count) / stream.rate
    height = stream.bed_height * rng.random(stream.count)
    height[0] = 0.0
    velocity = np.tile(np.array(release_velocity(scene), dtype=np.float64), (stream.count, 1))
    spread = stream.speed_spread * rng.uniform(-1.0, 1.0, stream.count)
    spread[0] = 0.0
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    forward = np.divide(
        velocity,
        speed[:, None],
        out=np.tile([1.0, 0.0], (stream.count, 1)),
        where=speed[:, None] > 0.0,
    )
    velocity += spread[:, None] * forward
    rides = on_belt(scene)
    adheres = rides and scene.incoming is not None and scene.incoming.friction == "adhesion"
    if stream.interact and stream.count > 1:
        fall = 0.0 if adheres else 0.5 * scene.gravity
        floor = 0.0 if rides else -inf
        _spread_apart(scene, t, height, velocity, fall, floor, rng)
    position = np.tile(np.array(release_point(scene), dtype=np.float64), (stream.count, 1))
    position[:, 1] += height
    return Releases(t, position, velocity, np.full(stream.count, adheres))


def _spread_apart(
    scene: Scene,
    t: NDArray[np.float64],
    height: NDArray[np.float64],
    velocity: NDArray[np.float64],
    fall: float,
    floor: float,
    rng: np.random.Generator,
) -> None:
    """Redraw heights, in place, until no particle starts inside one released before it.

    Earlier particles are taken to have moved on at their release velocity, and to have fallen by
    ``fall`` (m/s²) times their age squared, but not below ``floor`` (m above the lowest layer).
    """
    stream, diameter = scene.stream, 2.0 * scene.particle.radius
    for i in range(1, stream.count):
        age = t[i] - t[:i]
        dx = velocity[:i, 0] * age
        near = np.flatnonzero(np.abs(dx) < diameter)
        dy = height[near] + velocity[near, 1] * age[near] - fall * age[near] ** 2
        dy = np.maximum(dy, floor)
        for _ in range(TRIES):
            if np.all(dx[near] ** 2 + (dy - height[i]) ** 2 >= diameter**2):
                break
            height[i] = stream.bed_height * rng.random()
        else:
            allowed = (
                f"particle {i} finds no free place in the bed at stream.rate = {stream.rate} per"
                " second: raise stream.bed_height, lower stream.rate, or set"
                " stream.interact = false"
            )
            raise SceneError(scene.source, [Fault("stream.bed_height", stream.bed_height, allowed)])
