"""The analytic parabola of a transfer, as arcs that can be drawn and compared with.

An arc of free flight is fixed by where it begins, how far it goes and how long it takes, so the
paper's own quantities suffice: (x2, y2) in t2 from the separation point to the plate, equations
(3)-(5), and (x3, y3) in t3 from the plate to the outgoing belt, equations (10)-(12). Without a
plate the paper has nothing to say; there is one arc, from where the pulley is left.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, isfinite, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.releases import on_belt, release_velocity
from chutelab.theory.separation import separation

if TYPE_CHECKING:
    from chutelab.scene import Incoming, Scene
    from chutelab.theory import Transfer

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Arc:
    """Free flight between two times, SI units, world frame.

    Attributes
    ----------
    begin, end : float
        s, on the clock that starts at separation.
    position, velocity : tuple of float
        m and m/s, at `begin`.
    gravity : float
        m/s², pointing down.
    """

    begin: float
    end: float
    position: tuple[float, float]
    velocity: tuple[float, float]
    gravity: float

    def at(self, times: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and velocities, (T, 2) each, at times (T,) since separation."""
        t = np.asarray(times, dtype=np.float64)[:, None] - self.begin
        pull = np.array([0.0, -self.gravity])
        velocity = np.array(self.velocity)
        return np.array(self.position) + t * (velocity + 0.5 * pull * t), velocity + pull * t


def arcs(prediction: Transfer, scene: Scene) -> tuple[Arc, ...]:
    """Return the flight to the plate and the one from the plate to the belt, as far as known.

    Parameters
    ----------
    prediction : Transfer
        Of the scene, see `chutelab.theory.predict`; what is NaN in it is left out.
    scene : Scene
        For the radius R + r of the separation point, and for gravity.
    """
    phi1 = float(prediction.phi1)
    if scene.incoming is not None and scene.plate is None:
        return _thrown(scene, scene.incoming)
    if scene.incoming is None or not isfinite(phi1):
        return ()
    riding = scene.incoming.pulley_radius + scene.particle.radius
    point, begin = (riding * sin(phi1), riding * cos(phi1)), 0.0
    found = []
    # The paper counts x3 back from the plate, and both y downwards.
    for forward, down, duration in (
        (float(prediction.x2), float(prediction.y2), float(prediction.t2)),
        (-float(prediction.x3), float(prediction.y3), float(prediction.t3)),
    ):
        if not (isfinite(forward) and isfinite(down) and 0.0 < duration < float("inf")):
            break
        velocity = (forward / duration, 0.5 * scene.gravity * duration - down / duration)
        found.append(Arc(begin, begin + duration, point, velocity, scene.gravity))
        point, begin = (point[0] + forward, point[1] - down), begin + duration
    return tuple(found)


def _thrown(scene: Scene, belt: Incoming) -> tuple[Arc, ...]:
    """Return the flight from the pulley down to the outgoing belt, where nothing is in the way."""
    out, g, r = scene.outgoing, scene.gravity, scene.particle.radius
    if out is None or scene.surface or not g:
        return ()
    carried = on_belt(scene) and release_velocity(scene) == (belt.speed, 0.0) and belt.speed > 0.0
    if not carried or (scene.stream.interact and scene.stream.count > 1):
        return ()
    riding = belt.pulley_radius + r
    left = separation(
        speed=np.array([belt.speed]),
        ride_radius=np.array([riding]),
        gravity=np.array([g]),
        friction=np.array([np.inf if belt.friction == "adhesion" else float(belt.friction)]),
        spin=np.array([scene.particle.spin]),
    )
    sine, cosine, speed = (float(part[0]) for part in (left.sin, left.cos, left.v1))
    point, velocity = (riding * sine, riding * cosine), (speed * cosine, -speed * sine)
    fall = point[1] - (belt.pulley_radius - out.drop + r)
    if not fall > 0.0:
        return ()
    duration = (velocity[1] + sqrt(velocity[1] ** 2 + 2.0 * g * fall)) / g
    landing = point[0] + velocity[0] * duration
    if not out.start <= landing <= out.start + out.length:
        return ()
    return (Arc(0.0, duration, point, velocity, g),)


def flight(parts: tuple[Arc, ...], times: ArrayLike) -> tuple[Floats, Floats]:
    """Return positions and velocities, (T, 2), NaN off the arcs; at an impact, the state after."""
    times = np.asarray(times, dtype=np.float64)
    position, velocity = np.full((2, len(times), 2), np.nan)
    for arc in parts:
        inside = (times >= arc.begin) & (times <= arc.end)
        position[inside], velocity[inside] = arc.at(times[inside])
    return position, velocity
