"""One scene as the closed form sees it: its numbers, and the finite machine round them.

`transfer` supplies the numbers for an unbounded plate and belt. The finite machine follows from
them: where the nominal particle meets the plate's line sets the height of the outgoing belt, and
that the default lower end of the plate.
"""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.theory.obstacles import Flight
from chutelab.theory.transfer import transfer

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from chutelab.scene import Incoming, Plate, Scene
    from chutelab.theory.results import Transfer
    from chutelab.theory.transfer import Rebound

LEAST_CLEARANCE = 0.05
"""m of the default plate's lower end above the outgoing belt, for particles below 17 mm."""

RADII_CLEARANCE = 3.0
"""The same in particle radii, for larger ones."""

REACH_WITHOUT_BELT = 2.0
"""m of the default plate below its pivot where there is no outgoing belt."""


class Course:
    """Particle 0 on its way through one scene that has an incoming belt and a plate."""

    def __init__(self, scene: Scene, rebound: Rebound) -> None:
        assert scene.incoming is not None
        assert scene.plate is not None
        self.scene = scene
        self.rebound = rebound
        self.belt: Incoming = scene.incoming
        self.plate: Plate = scene.plate
        self.radius = scene.particle.radius
        self.ride_radius = self.belt.pulley_radius + self.radius
        self.angle = np.radians(self.plate.angle_deg)

    @cached_property
    def up(self) -> NDArray[np.float64]:
        """Unit vector up along the plate, (2,)."""
        return np.array([-np.sin(self.angle), np.cos(self.angle)])

    @cached_property
    def normal(self) -> NDArray[np.float64]:
        """Unit vector out of the struck face, (2,)."""
        return np.array([-np.cos(self.angle), -np.sin(self.angle)])

    @cached_property
    def pivot(self) -> NDArray[np.float64]:
        """Where the plate is hung, (2,), m."""
        ahead = self.belt.pulley_radius + self.plate.distance
        return np.array([ahead, self.plate.pivot_height], dtype=np.float64)

    @cached_property
    def found(self) -> Transfer:
        """What the equations say about unbounded plate and belt; of a family, arrays (N,)."""
        out = self.scene.outgoing
        if out is None:
            return self._transfer(drop=0.0, belt_speed=0.0)
        if out.drop_from == "impact":
            return self._transfer(drop=out.drop, belt_speed=out.speed)
        impact = self._transfer(drop=0.0, belt_speed=out.speed)
        # Eq. (16) solved for d2; `predict` refuses a belt above the impact
        sunk = self.ride_radius * (1.0 - np.cos(impact.phi1)) + impact.y2
        return self._transfer(drop=np.maximum(out.drop - sunk, 0.0), belt_speed=out.speed)

    def _transfer(self, **outgoing: ArrayLike) -> Transfer:
        scene = self.scene
        grip = self.belt.friction
        return transfer(
            speed=self.belt.speed,
            pulley_radius=self.belt.pulley_radius,
            distance=self.plate.distance,
            angle=self.angle,
            pivot_height=self.plate.pivot_height,
            restitution=self.plate.restitution,
            particle_radius=self.radius,
            mass=scene.particle.mass,
            gravity=scene.gravity,
            friction=np.inf if isinstance(grip, str) else grip,
            spin=scene.particle.spin,
            plate_friction=self.plate.friction,
            interval=1.0 / scene.stream.rate,
            rebound=self.rebound,
            unbounded_plate=False,
            **outgoing,
        )

    @cached_property
    def separation(self) -> Flight:
        """The flight from the pulley."""
        phi, speed = self.found.phi1, self.found.v1
        ahead, outward = np.array([np.cos(phi), -np.sin(phi)]), np.array([np.sin(phi), np.cos(phi)])
        return Flight(self.ride_radius * outward, speed * ahead, self.scene.gravity)

    @cached_property
    def impact(self) -> NDArray[np.float64]:
        """World position of the centre on the plate's line, (2,); NaN if it never gets there."""
        left = self.separation.position
        return np.array([left[0] + self.found.x2, left[1] - self.found.y2])

    @cached_property
    def rebounded(self) -> Flight:
        """The flight from the plate."""
        speed, angle = self.found.v2r, self.found.phi2r
        away, down = speed * np.sin(angle), speed * np.cos(angle)
        return Flight(self.impact, away * self.normal - down * self.up, self.scene.gravity)

    @property
    def belt_height(self) -> float | None:
        """World y of the outgoing belt; None if there is none or nothing to measure it from."""
        out = self.scene.outgoing
        if out is None:
            return None
        if out.drop_from == "top":
            return self.belt.pulley_radius - out.drop
        height = float(self.impact[1] - out.drop - self.radius)
        return height if np.isfinite(height) else None

    @cached_property
    def plate_reach(self) -> tuple[float, float]:
        """Ends of the plate, measured upwards from the pivot along it, m."""
        below, height = self.plate.below, self.belt_height
        if below is None:
            below = REACH_WITHOUT_BELT
            if height is not None:
                lowest = height + max(LEAST_CLEARANCE, RADII_CLEARANCE * self.radius)
                below = max((self.pivot[1] - lowest) / np.cos(self.angle), 0.0)
        return -below, self.plate.above

    @cached_property
    def lines(self) -> list[tuple[str, Any, Any]]:
        """Plate, outgoing belt and free surfaces, in this order."""
        low, high = self.plate_reach
        lines: list[tuple[str, Any, Any]] = [
            ("plate", self.pivot + low * self.up, self.pivot + high * self.up)
        ]
        out, height = self.scene.outgoing, self.belt_height
        if out is not None and height is not None:
            lines.append(("outgoing", (out.start, height), (out.start + out.length, height)))
        for free in self.scene.surface:
            lines += [(free.name, first, second) for first, second in pairwise(free.points)]
        return lines
