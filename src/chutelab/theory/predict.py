"""`predict`: the theory's answer for a scene, or the reason why it has none.

`transfer` supplies the numbers for an unbounded plate and belt; here the finite machine is laid
over them: what is touched before the plate, whether the plate is there, what is touched between
rebound and landing, whether the belt is there.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.theory.obstacles import (
    Flight,
    Segments,
    corner_times,
    face_times,
    first_in_flight,
    first_on_arc,
)
from chutelab.theory.reasons import Reason
from chutelab.theory.transfer import STAGES, Rebound, Transfer, transfer

if TYPE_CHECKING:
    from chutelab.scene import Incoming, Plate, Scene

LEAST_CLEARANCE = 0.05
"""m of the default plate's lower end above the outgoing belt, for particles below 17 mm."""

RADII_CLEARANCE = 3.0
"""The same in particle radii, for larger ones."""

REACH_WITHOUT_BELT = 2.0
"""m of the default plate below its pivot where there is no outgoing belt."""


def predict(scene: Scene, rebound: Rebound = "corrected") -> Transfer:
    """Predict particle 0 of a scene in closed form.

    Parameters
    ----------
    scene : Scene
        A validated scene; its particle 0 is nominal (no spread, lowest layer).
    rebound : {"corrected", "as-printed"}
        Which Eq. (9), see `transfer`.

    Returns
    -------
    Transfer
        0-d arrays. NaN from the stage on that is not reached as the equations assume, with a
        `reason`: see `chutelab.theory.Reason` for what each claims. ``P`` takes 1 / stream.rate for
        the time per particle. ``belt_work`` and ``slip_heat`` are what the outgoing belt pays once
        the particle no longer slips on it.

    Notes
    -----
    Surface names in reasons are the scene's own, with ``plate``, ``outgoing``, ``incoming`` (the
    belt's straight part) and ``pulley``. What happens after the landing is not looked at. Contacts
    that graze to within rounding may be judged either way.
    """
    fault = _outside(scene)
    if fault:
        return _cut(_nothing(), "separation", Reason.OUTSIDE.because(fault))
    return _Course(scene, rebound).answer()


def _outside(scene: Scene) -> str:
    """Return what makes the scene another problem than the paper's, "" if nothing does."""
    if scene.incoming is None:
        return "there is no incoming conveyor"
    if scene.plate is None:
        return "there is no damping plate"
    ride_height = scene.incoming.pulley_radius + scene.particle.radius
    at, velocity = scene.stream.at, scene.stream.velocity
    if at is not None and not (-scene.incoming.length <= at[0] <= 0.0 and at[1] == ride_height):
        return "the release point stream.at is not on the incoming belt"
    if velocity is not None and tuple(velocity) != (scene.incoming.speed, 0.0):
        return "the release velocity stream.velocity is not the incoming belt's"
    if scene.stream.interact and scene.stream.count > 1:
        return "particles interact"
    return ""


def _nothing() -> Transfer:
    names = [name for stage in STAGES.values() for name in stage]
    return Transfer(reason=np.array(""), **dict.fromkeys(names, np.array(np.nan)))


def _cut(found: Transfer, stage: str, reason: str) -> Transfer:
    """Blank a stage and all later ones, and say why."""
    order = list(STAGES)
    lost = [name for later in order[order.index(stage) :] for name in STAGES[later]]
    return replace(found, reason=np.array(reason), **dict.fromkeys(lost, np.array(np.nan)))


class _Course:
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
        self.angle = float(np.radians(self.plate.angle_deg))
        self.up = np.array([-np.sin(self.angle), np.cos(self.angle)])
        self.normal = np.array([-np.cos(self.angle), -np.sin(self.angle)])
        self.pivot = np.array(
            [self.belt.pulley_radius + self.plate.distance, self.plate.pivot_height]
        )

    @cached_property
    def found(self) -> Transfer:
        """What the equations say about unbounded plate and belt."""
        out = self.scene.outgoing
        if out is None:
            return self._transfer(drop=0.0, belt_speed=0.0)
        if out.drop_from == "impact":
            return self._transfer(drop=out.drop, belt_speed=out.speed)
        impact = self._transfer(drop=0.0, belt_speed=out.speed)
        # Eq. (16) solved for d2; a belt above the impact is `answer`'s to refuse
        sunk = self.ride_radius * (1.0 - np.cos(impact.phi1)) + impact.y2
        return self._transfer(drop=max(float(out.drop - sunk), 0.0), belt_speed=out.speed)

    def _transfer(self, **outgoing: float) -> Transfer:
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
            friction=np.inf if grip == "adhesion" else float(grip),
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
    def impact(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """World position of the centre on the plate's line, (2,); NaN if it never gets there."""
        return self.separation.position + [self.found.x2, -self.found.y2]

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
            lines += [(free.name, *pair) for pair in zip(free.points, free.points[1:], strict=False)]
        return lines

    def answer(self) -> Transfer:
        """Lay the finite machine over the numbers, in the order of events."""
        found = self.found
        if np.isnan(self.separation.position[0]) and Reason.of(found.reason) is Reason.OUTSIDE:
            return found
        return (
            self._on_the_ride() or self._before_the_plate() or self._after_the_rebound() or found
        )

    def _on_the_ride(self) -> Transfer | None:
        obstacles = Segments.of(self.lines)
        at = self.scene.stream.at
        start = np.array([-self.belt.length if at is None else at[0], self.ride_radius])
        index = obstacles.overlapped(start, self.radius)
        if index < 0:
            straight = Flight(start, np.array([1.0, 0.0]), 0.0)
            index = first_in_flight(straight, obstacles, self.radius, -start[0])[1]
        if index < 0:
            index = first_on_arc(self.ride_radius, self.phi1, obstacles, self.radius)[1]
        if index < 0:
            return None
        what = f"{obstacles.names[index]}: it is in the way of the ride"
        return _cut(self.found, "separation", Reason.EARLY.because(what))
