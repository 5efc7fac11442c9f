"""`predict`: the theory's answer for a scene, or the reason why it has none.

The finite machine is compared with the numbers of `transfer`: what is touched before the plate,
whether the plate is hit, what is touched between rebound and landing, whether the belt is hit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import nan, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from chutelab.theory.obstacles import (
    WHOLE,
    Bend,
    Flight,
    Line,
    Obstacles,
    first_in_flight,
    first_on_pulley,
    ring_times,
)
from chutelab.theory.slide import Reason
from chutelab.theory.transfer import Rebound, Transfer, cut, transfer, unanswered
from chutelab.util.arrays import RADIANS, hypot, sin_cos

if TYPE_CHECKING:
    # The paper's tables do not need the model of a scene.
    from chutelab.scene import AnyScene, Scene
    from chutelab.scene.variants import Family


class Course:
    """The path of particle 0 through a scene with an incoming belt and a plate.

    `found` has the results of the equations for unbounded plate and belt, 0-d. Places are in world
    coordinates, m.
    """

    def __init__(self, scene: Scene, found: Transfer) -> None:
        assert scene.incoming is not None
        assert scene.plate is not None
        self.scene, self.found = scene, found
        self.belt, plate, out = scene.incoming, scene.plate, scene.outgoing
        self.own, self.radius = scene.particle, scene.particle.radius
        self.ride_radius = self.belt.pulley_radius + self.radius
        self.angle = plate.angle_deg * RADIANS
        # Up along the plate, and out of its struck face.
        sin, cos = sin_cos(self.angle)
        self.up, self.normal = np.array([-sin, cos]), np.array([-cos, -sin])
        self.pivot = np.array([self.belt.pulley_radius + plate.distance, plate.pivot_height])
        self.incline = self.belt.incline_deg * RADIANS
        # Up along the incoming belt, and out of its upper side.
        sin, cos = sin_cos(self.incline)
        self.along, self.above = np.array([cos, sin]), np.array([-sin, cos])

        sin, cos = sin_cos(float(found.phi1))
        left = self.ride_radius * np.array([sin, cos])
        self.separation = Flight(left, found.v1 * np.array([cos, -sin]), scene.gravity)
        # The centre on the plate's line; NaN if it never gets there.
        self.impact = np.array([left[0] + found.x2, left[1] - found.y2])
        away, down = (found.v2r * part for part in sin_cos(float(found.phi2r)))
        self.rebounded = Flight(self.impact, away * self.normal - down * self.up, scene.gravity)

        # None if there is no outgoing belt, or no reference for its height.
        self.belt_height: float | None = None
        if out is not None and out.drop_from == "top":
            self.belt_height = self.belt.pulley_radius - out.drop
        elif out is not None and np.isfinite(height := self._height_at_plate()):
            self.belt_height = height - out.drop - self.radius
        below = plate.below
        if below is None:
            below = 2.0
            if self.belt_height is not None:
                # Room for a particle, and 5 cm at least.
                lowest = self.belt_height + max(0.05, 3.0 * self.radius)
                below = max((self.pivot[1] - lowest) / sin_cos(self.angle)[1], 0.0)
        # From the pivot upwards along the plate.
        self.plate_reach = -below, plate.above
        # Plate, outgoing belt and free surfaces, in this order; and round ones.
        self.lines: list[Line] = [
            ("plate", self.pivot - below * self.up, self.pivot + plate.above * self.up)
        ]
        if out is not None and self.belt_height is not None:
            y = self.belt_height
            self.lines.append(("outgoing", (out.start, y), (out.start + out.length, y)))
        lines, self.bends = free_surfaces(scene)
        self.lines += lines
        end = self.belt.pulley_radius * self.above
        self.belt_line: Line = "incoming", end - self.belt.length * self.along, end

    def _height_at_plate(self) -> float:
        """Return the height of the centre on the plate's line, m, as if the pulley were not there.

        A machine is built so. The equations end before where the flight comes down on the pulley.
        """
        if np.isfinite(self.impact[1]):
            return float(self.impact[1])
        flight, sin = self.separation, -float(self.normal[1])
        gap = float((flight.position - self.pivot) @ self.normal) - self.radius
        closing = -float(flight.velocity @ self.normal)
        square = closing * closing - 2.0 * flight.gravity * sin * gap
        t = 2.0 * gap / (closing + sqrt(square)) if square > 0.0 else nan  # Eq. (5)
        y, v = float(flight.position[1]), float(flight.velocity[1])
        return y + v * t - 0.5 * flight.gravity * t * t if t > 0.0 else nan

    def meets(self, claim: Reason, name: str, how: str) -> str:
        """Return the reason why the equations end at a surface."""
        for free in self.scene.surface:
            if free.name == name and (free.opens_at, free.closes_at) != (None, None):
                claim, how = Reason.OUTSIDE, "it is a gate, and in the way while it is shut"
            elif free.name == name and free.passes:
                claim, how = Reason.OUTSIDE, "it is in the way from one side"
        return claim.because(f"{name}: {how}")


def free_surfaces(scene: Scene) -> tuple[list[Line], list[Bend]]:
    """Return the straight and round pieces of further plates, conveyors and free surfaces."""
    lines, bends = list[Line](), list[Bend]()
    for plate in scene.plates:
        if plate.pivot is not None:
            sin, cos = sin_cos(plate.angle_deg * RADIANS)
            up = np.array([-sin, cos])
            below = 0.5 if plate.below is None else plate.below
            pivot = np.array(plate.pivot)
            lines.append((str(plate.name), pivot - below * up, pivot + plate.above * up))
    for belt in scene.conveyor:
        axes, r = np.array([belt.from_, belt.to]), belt.pulley_radius
        way = axes[1] - axes[0]
        off = r / hypot(*way) * np.array([-way[1], way[0]])
        lines += [(belt.name, axes[0] + side, axes[1] + side) for side in (off, -off)]
        bends += [(belt.name, axis, r, 0.0, 2.0 * np.pi) for axis in axes]
    for free in scene.surface:
        shifts = np.zeros((1, 2))
        for count, *step in free.repeat:
            rows = np.arange(count)[:, None, None] * np.array(step)
            shifts = (shifts + rows).reshape(-1, 2)
        for shift in shifts:
            if free.center is None or free.radius is None:
                points = shift + np.array(free.points)
                lines += [(free.name, first, second) for first, second in pairwise(points)]
            else:
                first, last = free.from_deg * RADIANS, free.to_deg * RADIANS
                place = shift + np.array(free.center)
                bends.append((free.name, place, free.radius, min(first, last), abs(last - first)))
    return lines, bends


def predict(scene: AnyScene, rebound: Rebound = "corrected") -> Transfer:
    """Predict particle 0 of a scene in closed form.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        What `chutelab.load` takes; its particle 0 is nominal (no spread, lowest layer).
    rebound : {"corrected", "as-printed"}
        Which Eq. (9), see `transfer`.

    Returns
    -------
    Transfer
        0-d arrays. NaN from the first stage on that is not reached as the equations assume, with a
        `reason`: see `chutelab.theory.Reason` for the meaning of each. ``P`` takes 1 / stream.rate
        for the time per particle. ``belt_work`` and ``slip_heat`` are those of the outgoing belt
        until the particle no longer slips.

    Notes
    -----
    Particle 0 is the first particle of the first stream. Surface names in reasons are the scene's
    own, with ``plate``, ``outgoing``, ``incoming`` (the belt's straight part) and ``pulley``. A
    gate in the way ends the answer, shut or open. The motion after the landing is not considered.
    Contacts that graze within rounding may be judged either way.
    """
    # Imported here, because the equations alone need neither scene files nor Pydantic.
    from chutelab.scene import load

    scene = load(scene)
    if fault := next((why for holds, why in outside(scene) if holds), ""):
        return cut(unanswered(), "separation", Reason.OUTSIDE.because(fault))
    found = unbounded(scene, rebound)
    if np.isnan(found.phi1):
        return found
    course = Course(scene, found)
    if scene.outgoing is not None and course.belt_height is None:
        # The belt and the plate's lower end have no place, so there is no machine to compare with.
        return cut(found, "separation", str(found.reason))
    return cut(found, *trouble) if (trouble := hindrance(course)) else found


def unbounded(scenes: Scene | Family, rebound: Rebound = "corrected") -> Transfer:
    """Return the results of the equations for a scene if nothing else were in the way.

    Plate and outgoing belt have no ends, the pulley is not met again, and the scene's releases are
    not considered. The scene must have an incoming conveyor and a plate; the arrays are 0-d, those
    of a family of such scenes (see `chutelab.scene.variants.Family`) are (N,).
    """
    value, scene = scenes.value, scenes.scene
    belt, plate, out = scene.incoming, scene.plate, scene.outgoing
    assert belt is not None
    assert plate is not None
    restitution, plate_friction = scenes.met(scene.kinds[0], "plate")
    ride = ride_of(scenes)

    def found(drop: ArrayLike, belt_speed: ArrayLike) -> Transfer:
        return transfer(
            **ride,
            distance=value(plate, "distance"),
            angle=value(plate, "angle_deg") * RADIANS,
            pivot_height=value(plate, "pivot_height"),
            restitution=restitution,
            drop=drop,
            belt_speed=belt_speed,
            mass=value(scene.particle, "mass"),
            plate_friction=plate_friction,
            interval=1.0 / scenes.rate,
            rebound=rebound,
            unbounded_plate=False,
        )

    if out is None:
        return found(0.0, 0.0)
    drop, belt_speed = value(out, "drop"), value(out, "speed")
    if out.drop_from == "impact":
        return found(drop, belt_speed)
    impact = found(0.0, belt_speed)
    # Eq. (16) solved for d2; `predict` refuses a belt above the impact
    ride_radius = ride["pulley_radius"] + ride["particle_radius"]
    sunk = ride_radius * (1.0 - sin_cos(impact.phi1)[1]) + impact.y2
    return found(np.maximum(drop - sunk, 0.0), belt_speed)


def ride_of(scenes: Scene | Family) -> dict[str, Any]:
    """Return the arguments of `transfer` for particle 0's ride on the incoming conveyor."""
    value, scene = scenes.value, scenes.scene
    belt, own, at = scene.incoming, scene.particle, value(scene.stream, "at")
    assert belt is not None
    incline, ride_length = value(belt, "incline_deg") * RADIANS, value(belt, "length")
    if at is not None:
        sin, cos = sin_cos(incline)
        ride_length = -(at[0] * cos + at[1] * sin)
    friction = scenes.met(scene.kinds[0], "incoming")[1]
    return {
        "speed": value(belt, "speed"),
        "pulley_radius": value(belt, "pulley_radius"),
        "particle_radius": value(own, "radius"),
        "gravity": value(scene, "gravity"),
        "friction": np.inf if isinstance(friction, str) else friction,
        "spin": own.spin,
        "inertia": 0.4 if own.shape == "sphere" else 0.5,
        "incline": incline,
        "ride_length": ride_length,
    }


def not_carried(scenes: Scene | Family) -> Iterator[tuple[Any, str]]:
    """Yield the reasons why particle 0 is not released on the incoming belt at its speed.

    They are conditions, in a family (N,) or one for all, with their words.
    """
    value, belt, stream = scenes.value, scenes.scene.incoming, scenes.scene.stream
    assert belt is not None
    away = stream.fill is not None or stream.to is not None
    yield away, "the stream is not released at a point of the incoming belt"
    sin, cos = sin_cos(value(belt, "incline_deg") * RADIANS)
    if stream.at is not None:
        x, y = value(stream, "at")
        radius = value(belt, "pulley_radius") + value(scenes.scene.particle, "radius")
        way, off = x * cos + y * sin, y * cos - x * sin - radius
        near = (np.abs(off) <= 1e-9) & (-value(belt, "length") <= way) & (way <= 0.0)  # m
        yield ~near, "the release point stream.at is not on the incoming belt"
    if stream.velocity is not None:
        u, v = value(stream, "velocity")
        other = (u != value(belt, "speed") * cos) | (v != value(belt, "speed") * sin)
        yield other, "the release velocity stream.velocity is not the incoming belt's"
    yield np.not_equal(value(stream, "omega"), 0.0), "the particle spins at its release"


def outside(scenes: Scene | Family) -> Iterator[tuple[Any, str]]:
    """Yield reasons why the scene is another problem than the paper's, like `not_carried`."""
    scene, own = scenes.scene, scenes.scene.particle
    yield scene.incoming is None, "there is no incoming conveyor"
    yield not scene.plates, "there is no damping plate"
    yield scene.plate is None, "the plate is placed by its pivot, not ahead of the belt"
    yield bool(own.outline), "it is about disks and spheres"
    rolls = scenes.value(own, "rolling_friction")
    yield np.logical_and(own.spin, np.greater(rolls, 0.0)), "rolling friction"
    yields = scenes.value(own, "restitution_speed") is not None
    yield yields, "the restitution falls with speed"
    yield scene.clings, "the particle clings to what it touches"
    yield np.greater(scenes.value(scene, "air_density"), 0.0), "air slows the particle down"
    for table, joint in scene.joints:
        yield 0 in (joint.particle, joint.other), f"the particle hangs on a {table}"
    for name in scene.movers:
        yield True, f"{name} moves"
    for name, *_ in scene.triggers:
        yield True, f"{name} waits until something is touched"
    yield from not_carried(scenes)
    yield scene.crowded, "particles interact"


def hindrance(course: Course) -> tuple[str, str] | None:
    """Return the first stage that is not reached as assumed, and why; None if all are.

    Obstacles are searched along the ride, the flight to the plate, and the fall from it.
    """
    found, radius, out = course.found, course.radius, course.scene.outgoing
    low, high = course.plate_reach
    if high <= low:
        return "impact", Reason.OUTSIDE.because("the plate has no length")

    # The ride on the belt and round the pulley.
    obstacles = Obstacles.of(course.lines, course.bends)
    way = float(ride_of(course.scene)["ride_length"])
    start = course.ride_radius * course.above - way * course.along
    index = obstacles.overlapped(start, radius)
    if index < 0:
        index = first_in_flight(Flight(start, course.along, 0.0), obstacles, radius, way)[1]
    if index < 0:
        last = float(found.phi1)
        index = first_on_pulley(course.ride_radius, -course.incline, last, obstacles, radius)[1]
    if index >= 0:
        what = "it is in the way of the ride"
        return "separation", course.meets(Reason.EARLY, obstacles.names[index], what)

    # The flight to the plate.
    flight = course.separation
    foot = float((course.impact - course.pivot) @ course.up)
    hit = low <= foot <= high  # false for NaN: the line is not met
    obstacles = Obstacles.of(course.lines[1:] if hit else course.lines, course.bends)
    plate = obstacles if hit else Obstacles.of(course.lines[:1])
    horizon = float(found.t2) if hit else flight.horizon(plate, radius)
    # Thrown up slowly, it may come down on the pulley again. Otherwise the pulley is not checked,
    # as the flight starts on the circle and would seem to meet it by rounding.
    again = np.inf
    slow = found.v1 * found.v1 * sin_cos(found.phi1)[1] < flight.gravity * course.ride_radius
    if found.phi1 < 0.0 and slow:
        falls = ring_times(flight, np.zeros(2), course.ride_radius, 0.0, horizon)
        again = next(falls, np.inf)
    hops = again < horizon
    index = first_in_flight(flight, obstacles, radius, min(horizon, again))[1]
    # Obstacles do not matter to a flight that misses the plate anyway.
    stopped = hit or hops or np.isfinite(first_in_flight(flight, plate, radius, horizon)[0])
    if stopped and index >= 0:
        name = obstacles.names[index]
        how = "its end or its back is touched" if name == "plate" else "it is touched first"
        return "impact", course.meets(Reason.EARLY, name, how)
    if hops:
        return "impact", Reason.EARLY.because("pulley: the flight comes down on it again")
    if np.isnan(foot):
        return "impact", str(found.reason)
    if not hit:
        where = f"{foot - high:.4g} m above" if foot > high else f"{low - foot:.4g} m below"
        what = f"the plate's line is met {where} the end of the plate"
        return "impact", Reason.NO_IMPACT.because(what)
    if out is None and np.isfinite(found.v2r):
        return "landing", Reason.OUTSIDE.because("there is no outgoing conveyor")
    if Reason.of(found.reason) not in (None, Reason.MISSES):
        return None

    # The fall to the outgoing belt.
    height = course.belt_height
    assert out is not None
    assert height is not None
    if course.impact[1] - radius < height:
        return "landing", Reason.MISSES.because("the plate is met below the belt")
    lands, flight = bool(np.isfinite(found.t3)), course.rebounded
    pulley: Bend = ("pulley", (0.0, 0.0), course.belt.pulley_radius, 0.0, WHOLE)
    # The outgoing belt is left out: no part of it, ends included, is met above its level.
    bends = [*course.bends, pulley]
    if lands:
        horizon = float(found.t3)
    else:
        horizon = flight.horizon(Obstacles.of(course.lines, bends), radius)
    again, pressing = np.inf, -flight.gravity * sin_cos(course.angle)[0]
    if pressing > 0.0:
        # Gravity brings it back to a plate that leans away: to its face, where it is now, or an
        # end.
        bends += [("plate", end, 0.0, 0.0, WHOLE) for end in course.lines[0][1:]]
        back = 2.0 * float(flight.velocity @ course.normal) / pressing
        foot = float((flight.at(np.array(back)) - course.pivot) @ course.up)
        again = back if back < horizon and low <= foot <= high else np.inf
    obstacles = Obstacles.of([course.belt_line, *course.lines[2:]], bends)
    time, index = first_in_flight(flight, obstacles, radius, horizon)
    if min(time, again) < np.inf:
        name = obstacles.names[index] if time <= again else "plate"
        what = f"{min(time, again):.4g} s after the rebound"
        return "landing", course.meets(Reason.SECOND, name, what)
    x = float(course.impact[0] - found.x3)
    if lands and not out.start <= x <= out.start + out.length:
        return "landing", Reason.MISSES.because(f"it comes down at x = {x:.4g} m, off the belt")
    return None


@dataclass(frozen=True)
class Coverage:
    """Which quantities of a scene the closed form has."""

    covers: tuple[str, ...]  # the paper's symbols that it gives
    leaves_out: tuple[str, ...]  # and those that it does not
    reason: str  # why it stops, a reason of `chutelab.theory`; "" if it does not
    words: str  # the same for people


WORDS = {
    Reason.OUTSIDE: "The paper's equations do not hold for this machine",
    Reason.EARLY: "The equations stop short of a contact they know nothing of",
    Reason.NO_IMPACT: "The particle flies past the plate, and the equations end with the flight",
    Reason.SECOND: "After the plate it meets something else before it lands",
    Reason.MISSES: "It does not come down on the outgoing belt",
}
"""Meaning of a reason, in words for ``check``."""


def coverage(scene: Scene) -> Coverage:
    """Find which quantities of particle 0 the theory has for a scene."""
    from chutelab.scene.quantities import THEORY

    found, lone = predict(scene), scene.count == 1
    given = tuple(name for name in THEORY if np.isfinite(getattr(found, name)))
    reason = str(found.reason)
    kind = Reason.of(reason)
    words = "All of the transfer, belt to belt."
    if kind is not None:
        words = f"{WORDS[kind]}: {reason.partition(': ')[2]}."
    if given and not lone:
        words += " It speaks of particle 0 only."
    if "belt_work" in given and not (lone and scene.run.until == "settled"):
        words += " A simulation has belt_work and slip_heat to compare in a run"
        words += " until settled." if lone else " of one particle until settled."
    return Coverage(given, tuple(name for name in THEORY if name not in given), reason, words)
