"""`predict`: the theory's answer for a scene, or the reason why it has none.

The finite machine is laid over the numbers of `transfer`: what is touched before the plate, whether
the plate is there, what is touched between rebound and landing, whether the belt is there.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from chutelab.theory.obstacles import (
    Bend,
    Flight,
    Line,
    Obstacles,
    corner_times,
    first_in_flight,
    first_on_pulley,
    ring_times,
)
from chutelab.theory.results import Reason, Transfer, cut, unanswered
from chutelab.theory.transfer import Rebound, transfer
from chutelab.util.trig import RADIANS, hypot, sin_cos

if TYPE_CHECKING:
    # The paper's tables are there without the model of a scene.
    from chutelab.scene import AnyScene, Scene
    from chutelab.scene.variants import Family

LEAST_CLEARANCE = 0.05
"""m of the default plate's lower end above the outgoing belt, for particles below 17 mm."""

RADII_CLEARANCE = 3.0
"""The same in particle radii, for larger ones."""

REACH_WITHOUT_BELT = 2.0
"""m of the default plate below its pivot where there is no outgoing belt."""

REACH_HANGING = 0.5
"""m of a further plate below its pivot by default."""


class Course:
    """Particle 0 on its way through one scene that has an incoming belt and a plate.

    `found` is what the equations say about unbounded plate and belt, 0-d. Places and lengths are
    world coordinates, m.
    """

    def __init__(self, scene: Scene, found: Transfer) -> None:
        assert scene.incoming is not None
        assert scene.plate is not None
        self.scene, self.found = scene, found
        self.belt, plate, out = scene.incoming, scene.plate, scene.outgoing
        self.kind = scene.kinds[0]
        self.own = scene.particles[self.kind]
        self.radius = self.own.radius
        self.ride_radius = self.belt.pulley_radius + self.radius
        self.angle = plate.angle_deg * RADIANS
        # Up along the plate, and out of its struck face.
        sin, cos = sin_cos(self.angle)
        self.up = np.array([-sin, cos])
        self.normal = np.array([-cos, -sin])
        ahead = self.belt.pulley_radius + plate.distance
        self.pivot = np.array([ahead, plate.pivot_height], dtype=np.float64)
        self.incline = self.belt.incline_deg * RADIANS
        # Up along the incoming belt, and out of its upper side.
        sin, cos = sin_cos(self.incline)
        self.along = np.array([cos, sin])
        self.above = np.array([-sin, cos])

        sin, cos = sin_cos(float(found.phi1))
        left = self.ride_radius * np.array([sin, cos])
        self.separation = Flight(left, found.v1 * np.array([cos, -sin]), scene.gravity)
        # The centre on the plate's line; NaN if it never gets there.
        self.impact = np.array([left[0] + found.x2, left[1] - found.y2])
        away, down = (found.v2r * part for part in sin_cos(float(found.phi2r)))
        self.rebounded = Flight(self.impact, away * self.normal - down * self.up, scene.gravity)

        # None if there is no outgoing belt, or nothing to measure its height from.
        self.belt_height: float | None = None
        if out is not None and out.drop_from == "top":
            self.belt_height = self.belt.pulley_radius - out.drop
        elif out is not None and np.isfinite(self.impact[1]):
            self.belt_height = float(self.impact[1] - out.drop - self.radius)
        below = plate.below
        if below is None:
            below = REACH_WITHOUT_BELT
            if self.belt_height is not None:
                lowest = self.belt_height + max(LEAST_CLEARANCE, RADII_CLEARANCE * self.radius)
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
        self.gates = {
            free.name for free in scene.surface if (free.opens_at, free.closes_at) != (None, None)
        }

    @property
    def belt_line(self) -> Line:
        """The straight part of the incoming belt."""
        end = self.belt.pulley_radius * self.above
        return "incoming", end - self.belt.length * self.along, end

    def meets(self, claim: Reason, name: str, how: str) -> str:
        """Return the reason for which the equations end at a surface."""
        if name in self.gates:
            return Reason.OUTSIDE.because(f"{name}: it is a gate, and in the way while it is shut")
        return claim.because(f"{name}: {how}")


def free_surfaces(scene: Scene) -> tuple[list[Line], list[Bend]]:
    """Return the straight and round pieces of further plates, conveyors and free surfaces."""
    lines: list[Line] = []
    bends: list[Bend] = []
    for plate in scene.plates:
        if plate.pivot is not None:
            sin, cos = sin_cos(plate.angle_deg * RADIANS)
            up = np.array([-sin, cos])
            below = REACH_HANGING if plate.below is None else plate.below
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


ON_BELT = 1e-12
"""m; a release this close to the riding height differs from it by the rounding of a sum only."""


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
        0-d arrays. NaN from the stage on that is not reached as the equations assume, with a
        `reason`: see `chutelab.theory.Reason` for what each claims. ``P`` takes 1 / stream.rate for
        the time per particle. ``belt_work`` and ``slip_heat`` are what the outgoing belt pays once
        the particle no longer slips on it.

    Notes
    -----
    It is the first particle of the first stream. Surface names in reasons are the scene's own, with
    ``plate``, ``outgoing``, ``incoming`` (the belt's straight part) and ``pulley``. A gate in the
    way ends the answer, shut or open. What happens after the landing is not looked at. Contacts
    that graze to within rounding may be judged either way.
    """
    # Here, because the equations alone need no scene files, and none of Pydantic.
    from chutelab.scene import load

    scene = load(scene)
    fault = _outside(scene)
    if fault:
        return cut(unanswered(), "separation", Reason.OUTSIDE.because(fault))
    found = unbounded(scene, rebound)
    if np.isnan(found.phi1):
        return found
    course = Course(scene, found)
    if scene.outgoing is not None and course.belt_height is None:
        # Nothing places the belt, nor the plate's lower end: there is no machine to look at.
        return cut(found, "separation", str(found.reason))
    low, high = course.plate_reach
    if high <= low:
        return cut(found, "impact", Reason.OUTSIDE.because("the plate has no length"))
    trouble = _on_the_ride(course) or _before_the_plate(course)
    if trouble is None and scene.outgoing is None and np.isfinite(found.v2r):
        trouble = "landing", Reason.OUTSIDE.because("there is no outgoing conveyor")
    if trouble is None and Reason.of(found.reason) in (None, Reason.MISSES):
        trouble = _after_the_rebound(course)
    return found if trouble is None else cut(found, *trouble)


def unbounded(scenes: Scene | Family, rebound: Rebound = "corrected") -> Transfer:
    """Return what the equations say of a scene if nothing else were in the way.

    Plate and outgoing belt are without ends, the pulley is met no more, and what the scene says of
    releases is not looked at. The scene has an incoming conveyor and a plate; the arrays are 0-d,
    those of a family of such scenes (see `chutelab.scene.variants.Family`) are (N,).
    """
    value, scene = scenes.value, scenes.scene
    belt, plate, out = scene.incoming, scene.plate, scene.outgoing
    assert belt is not None
    assert plate is not None
    kind, stream = scene.kinds[0], scene.stream
    own = scene.particles[kind]
    restitution, plate_friction = scenes.met(kind, "plate")
    _, friction = scenes.met(kind, "incoming")
    pulley_radius, radius = value(belt, "pulley_radius"), value(own, "radius")
    incline = value(belt, "incline_deg") * RADIANS
    ride_length = value(belt, "length")
    if stream.at is not None:
        sin, cos = sin_cos(incline)
        ride_length = -(stream.at[0] * cos + stream.at[1] * sin)

    def found(drop: ArrayLike, belt_speed: ArrayLike) -> Transfer:
        return transfer(
            speed=value(belt, "speed"),
            pulley_radius=pulley_radius,
            distance=value(plate, "distance"),
            angle=value(plate, "angle_deg") * RADIANS,
            pivot_height=value(plate, "pivot_height"),
            restitution=restitution,
            drop=drop,
            belt_speed=belt_speed,
            particle_radius=radius,
            mass=value(own, "mass"),
            gravity=value(scene, "gravity"),
            friction=np.inf if isinstance(friction, str) else friction,
            spin=own.spin,
            inertia=0.4 if own.shape == "sphere" else 0.5,
            incline=incline,
            ride_length=ride_length,
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
    sunk = (pulley_radius + radius) * (1.0 - sin_cos(impact.phi1)[1]) + impact.y2
    return found(np.maximum(drop - sunk, 0.0), belt_speed)


def _outside(scene: Scene) -> str:
    """Return what makes the scene another problem than the paper's, "" if nothing does."""
    if scene.incoming is None:
        return "there is no incoming conveyor"
    if scene.plate is None:
        return "there is no damping plate"
    own, stream, belt = scene.particles[scene.kinds[0]], scene.stream, scene.incoming
    if own.outline:
        return "it is about disks and spheres"
    if own.spin and own.rolling_friction > 0.0:
        return "rolling friction"
    if any(string.particle == 0 for string in scene.string):
        return "the particle hangs on a string"
    if stream.fill is not None or stream.to is not None:
        return "the stream is not released at a point of the incoming belt"
    sin, cos = sin_cos(belt.incline_deg * RADIANS)
    if stream.at is not None:
        x, y = stream.at
        above = y * cos - x * sin - belt.pulley_radius - own.radius
        if abs(above) > ON_BELT or not -belt.length <= x * cos + y * sin <= 0.0:
            return "the release point stream.at is not on the incoming belt"
    if stream.velocity is not None and stream.velocity != (belt.speed * cos, belt.speed * sin):
        return "the release velocity stream.velocity is not the incoming belt's"
    if scene.crowded:
        return "particles interact"
    return ""


Trouble = tuple[str, str] | None
"""The first stage that is not reached as the equations assume, and the reason; None if all are."""


def _on_the_ride(course: Course) -> Trouble:
    obstacles = Obstacles.of(course.lines, course.bends)
    at, radius, begin = course.scene.stream.at, course.radius, -course.incline
    way = course.belt.length if at is None else -float(np.array(at) @ course.along)
    start = course.ride_radius * course.above - way * course.along
    index = obstacles.overlapped(start, radius)
    if index < 0:
        straight = Flight(start, course.along, 0.0)
        index = first_in_flight(straight, obstacles, radius, way)[1]
    if index < 0:
        last = float(course.found.phi1)
        index = first_on_pulley(course.ride_radius, begin, last, obstacles, radius)[1]
    if index < 0:
        return None
    what = "it is in the way of the ride"
    return "separation", course.meets(Reason.EARLY, obstacles.names[index], what)


def _before_the_plate(course: Course) -> Trouble:
    found, radius, flight = course.found, course.radius, course.separation
    low, high = course.plate_reach
    foot = float((course.impact - course.pivot) @ course.up)
    hit = low <= foot <= high  # false for NaN: the line is not met
    plate = Obstacles.of(course.lines[:1])
    obstacles = Obstacles.of(course.lines[1:] if hit else course.lines, course.bends)
    horizon = float(found.t2) if hit else flight.horizon(plate, radius)
    # Thrown up slowly, it may come down on the pulley again. Faster, it would only seem to at once,
    # by rounding: it starts on the circle.
    centre, rides, again = np.zeros(2), course.ride_radius, np.inf
    slow = found.v1 * found.v1 * sin_cos(found.phi1)[1] < flight.gravity * rides
    if found.phi1 < 0.0 and slow:
        again = next(ring_times(flight, centre, rides, 0.0, horizon), np.inf)
    hops = again < horizon
    index = first_in_flight(flight, obstacles, radius, min(horizon, again))[1]
    # What is in the way of a flight that misses the plate anyway does not matter.
    stopped = hit or hops or np.isfinite(first_in_flight(flight, plate, radius, horizon)[0])
    if stopped and index >= 0:
        name = obstacles.names[index]
        how = "its end or its back is touched" if name == "plate" else "it is touched first"
        return "impact", course.meets(Reason.EARLY, name, how)
    if hops:
        return "impact", Reason.EARLY.because("pulley: the flight comes down on it again")
    if hit:
        return None
    if np.isnan(foot):
        return "impact", str(found.reason)
    where = f"{foot - high:.4g} m above" if foot > high else f"{low - foot:.4g} m below"
    what = f"the plate's line is met {where} the end of the plate"
    return "impact", Reason.NO_IMPACT.because(what)


def _after_the_rebound(course: Course) -> Trouble:
    found, radius, out = course.found, course.radius, course.scene.outgoing
    height = course.belt_height
    assert out is not None
    assert height is not None
    if course.impact[1] - radius < height:
        return "landing", Reason.MISSES.because("the plate is met below the belt")
    lands = bool(np.isfinite(found.t3))
    flight, top = course.rebounded, course.belt.pulley_radius
    around = Obstacles.of([("pulley", (-top, -top), (top, top)), *course.lines], course.bends)
    horizon = float(found.t3) if lands else flight.horizon(around, radius)
    solid = Obstacles.of([course.belt_line, *course.lines[2:]], course.bends)
    time, index = first_in_flight(flight, solid, radius, horizon)
    time, name = min(
        (time, solid.names[index]),
        (_plate_again(course, horizon), "plate"),
        (corner_times(flight, np.zeros((1, 2)), course.ride_radius, horizon)[0], "pulley"),
    )
    # The outgoing belt is not among them: no part of it, ends included, is met above its level.
    if np.isfinite(time):
        what = f"{time:.4g} s after the rebound"
        return "landing", course.meets(Reason.SECOND, name, what)
    x = float(course.impact[0] - found.x3)
    if lands and not out.start <= x <= out.start + out.length:
        what = f"it comes down at x = {x:.4g} m, off the belt"
        return "landing", Reason.MISSES.because(what)
    return None


def _plate_again(course: Course, horizon: float) -> float:
    """Return when the plate is touched again, inf if not before `horizon`."""
    flight = course.rebounded
    pressing = -flight.gravity * sin_cos(course.angle)[0]
    if pressing <= 0.0:
        return np.inf
    low, high = course.plate_reach
    face = np.inf
    away = flight.velocity @ course.normal
    if 2.0 * away < pressing * horizon:
        again = 2.0 * away / pressing
        foot = float((flight.at(np.array(again)) - course.pivot) @ course.up)
        face = float(again) if low <= foot <= high else np.inf
    clipped = corner_times(
        flight, Obstacles.of(course.lines[:1]).segments.points, course.radius, horizon
    )
    return float(min(face, clipped.min()))
