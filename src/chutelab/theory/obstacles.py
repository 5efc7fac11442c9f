"""First contacts of one disk with finite surfaces: on the ride, in flight, with all their ends.

Only whether, when and with what; the velocities are `transfer`'s business. Surfaces are segments
and arcs without thickness, touched from either side at the disk's radius. Contacts are found where
a distance falls through the radius; a graze to within rounding may go either way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chutelab.util.arrays import Bools, Floats

Line = tuple[str, ArrayLike, ArrayLike]
"""A straight surface: its name and both ends, m."""

Bend = tuple[str, ArrayLike, float, float, float]
"""A round one: its name, centre and radius, m, begin and extent, rad, as `Arcs` has them."""

HALVINGS = 60
"""Bisections of a contact time: they exhaust a double's digits."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Named straight surfaces: names (S,), first and second ends (S, 2), m."""

    names: tuple[str, ...]
    start: Floats
    end: Floats

    @classmethod
    def of(cls, lines: Sequence[Line]) -> Segments:
        """Collect (name, first end, second end) triples."""
        ends = np.array([line[1:] for line in lines], dtype=np.float64).reshape(-1, 2, 2)
        return cls(tuple(line[0] for line in lines), ends[:, 0], ends[:, 1])

    @property
    def points(self) -> Floats:
        """All ends, (2S, 2): end i and end S + i belong to segment i."""
        return np.concatenate([self.start, self.end])

    def frames(self) -> tuple[Floats, Floats, Floats]:
        """Return unit tangents (S, 2), unit normals to their left (S, 2), lengths (S,)."""
        along = self.end - self.start
        length = np.hypot(along[:, 0], along[:, 1])
        tangent = along / length[:, None]
        return tangent, np.stack([-tangent[:, 1], tangent[:, 0]], axis=1), length

    def distances(self, point: Floats) -> Floats:
        """Return how far a point is from each, (S,), m."""
        tangent, _, length = self.frames()
        share = np.clip(np.sum((point - self.start) * tangent, axis=1), 0.0, length)
        gap = self.start + share[:, None] * tangent - point
        return np.asarray(np.hypot(gap[:, 0], gap[:, 1]))


@dataclass(frozen=True, eq=False)
class Arcs:
    """Named round surfaces: names (A,), centres (A, 2) and radii (A,), m, and where they are.

    `begin` is the angle of the first end from the x axis, counter-clockwise, and `extent` >= 0 how
    far an arc reaches from there, rad; 2π is a whole circle, which has no ends.
    """

    names: tuple[str, ...]
    center: Floats
    radius: Floats
    begin: Floats
    extent: Floats

    @classmethod
    def of(cls, bends: Sequence[Bend]) -> Arcs:
        """Collect (name, centre, radius, begin, extent) tuples."""
        center = np.array([bend[1] for bend in bends], dtype=np.float64).reshape(-1, 2)
        numbers = np.array([bend[2:] for bend in bends], dtype=np.float64).reshape(-1, 3)
        return cls(tuple(bend[0] for bend in bends), center, *numbers.T)

    @property
    def points(self) -> Floats:
        """All ends, (2A, 2): end i and end A + i belong to arc i; NaN of a whole circle."""
        angles = np.concatenate([self.begin, self.begin + self.extent])
        whole = np.tile(self.extent >= 2.0 * np.pi, 2)
        radius = np.where(whole, np.nan, np.tile(self.radius, 2))
        direction = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return np.asarray(np.tile(self.center, (2, 1)) + radius[:, None] * direction)

    @property
    def box(self) -> Floats:
        """Corners of boxes round the circles, (2A, 2), m."""
        return np.concatenate([
            self.center - self.radius[:, None], self.center + self.radius[:, None],
        ])  # fmt: skip

    def holds(self, index: int, points: Floats) -> Bools:
        """Tell whether the directions from an arc's centre to points (..., 2) are on the arc."""
        away = points - self.center[index]
        turned = np.arctan2(away[..., 1], away[..., 0]) - self.begin[index]
        return np.asarray(np.mod(turned, 2.0 * np.pi) <= self.extent[index])

    def distances(self, point: Floats) -> Floats:
        """Return how far a point is from each, (A,), m."""
        found = np.empty(len(self.names))
        ends = np.hypot(*(self.points - point).T).reshape(2, -1)
        for index, center in enumerate(self.center):
            on_it = abs(float(np.hypot(*(point - center))) - self.radius[index])
            found[index] = on_it if self.holds(index, point) else ends[:, index].min()
        return found

    def rings(self, radius: float) -> Iterator[tuple[int, float, bool]]:
        """Yield the circles of a disk's centre at contacts: arc, m, if it comes from inside."""
        for index, size in enumerate(self.radius.tolist()):
            yield index, size + radius, False
            if size > radius:
                yield index, size - radius, True


NO_ARCS = Arcs.of([])


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Straight and round surfaces together; indices count the segments first."""

    segments: Segments
    arcs: Arcs

    @classmethod
    def of(cls, lines: Sequence[Line], bends: Sequence[Bend] = ()) -> Obstacles:
        """Collect both, see `Segments.of` and `Arcs.of`."""
        return cls(Segments.of(lines), Arcs.of(bends) if bends else NO_ARCS)

    @property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        return self.segments.names + self.arcs.names

    @property
    def points(self) -> Floats:
        """Points round which the box of all goes, m."""
        return np.concatenate([self.segments.points, self.arcs.box])

    def overlapped(self, point: Floats, radius: float) -> int:
        """Return the first that is closer to `point` than `radius`, -1 if none."""
        far = self.segments.distances(point)
        if self.arcs.names:
            far = np.append(far, self.arcs.distances(point))
        near = np.flatnonzero(far < radius)
        return int(near[0]) if near.size else -1


@dataclass(frozen=True, eq=False)
class Flight:
    """A parabola from t = 0: position and velocity (2,), m and m/s, gravity m/s² downward."""

    position: Floats
    velocity: Floats
    gravity: float

    def at(self, t: Floats) -> Floats:
        """Return the positions (..., 2) at times (...)."""
        place = self.position + np.multiply.outer(t, self.velocity)
        place[..., 1] -= 0.5 * self.gravity * t**2
        return place

    def horizon(self, targets: Obstacles, radius: float) -> float:
        """Return a time after which a disk has passed all targets."""
        if self.gravity > 0.0:
            rise = self.position[1] - (float(targets.points[:, 1].min()) - radius)
            speed = self.velocity[1]
            square = speed**2 + 2.0 * self.gravity * rise
            if square <= 0.0:
                return 0.0
            return max(float((speed + np.sqrt(square)) / self.gravity), 0.0)
        apart = targets.points - self.position
        reach = float(np.hypot(apart[:, 0], apart[:, 1]).max()) + 2.0 * radius
        pace = float(np.hypot(*self.velocity))
        return reach / pace if pace > 0.0 else 0.0


def corner_times(flight: Flight, points: Floats, radius: float, horizon: float) -> Floats:
    """Return when the centre first comes as close as `radius` to each point, (P,); inf if not.

    The distance, squared, is a quartic. Between the roots of its derivative it is monotone, so no
    approach is overlooked, and none found that is not there.
    """
    first = np.full(len(points), np.inf)
    if radius <= 0.0 or horizon <= 0.0:
        return first
    stops = np.array([0.0, horizon])
    if flight.gravity > 0.0:
        apex = np.clip(flight.velocity[1] / flight.gravity, 0.0, horizon)
        stops = np.append(stops, apex)
    places = flight.at(stops)
    reach = (points >= places.min(axis=0) - radius) & (points <= places.max(axis=0) + radius)
    for index in np.flatnonzero(reach.all(axis=1)):
        quartic, marks = _distance(flight, points[index], radius, horizon)
        inside = np.flatnonzero(np.polyval(quartic, marks) < 0.0)
        if inside.size:
            first[index] = _falls(quartic, marks[max(inside[0] - 1, 0)], marks[inside[0]])
    return first


def _distance(
    flight: Flight, point: Floats, radius: float, horizon: float
) -> tuple[Floats, Floats]:
    """Return the square of the distance from a point, less that of `radius`, as a quartic in time.

    And times, from 0 to `horizon`, between which it rises or falls all the way.
    """
    drop = np.array([0.0, -0.5 * flight.gravity])
    apart = flight.position - point
    quartic = np.array(
        [
            drop @ drop,
            2.0 * flight.velocity @ drop,
            flight.velocity @ flight.velocity + 2.0 * apart @ drop,
            2.0 * apart @ flight.velocity,
            apart @ apart - radius**2,
        ]
    )
    # Complex roots only add breakpoints, which do no harm.
    turns = np.roots(np.polyder(quartic)).real
    inner = turns[(turns > 0.0) & (turns < horizon)]
    return quartic, np.sort(np.concatenate([[0.0, horizon], inner]))


def _falls(quartic: Floats, low: float, high: float) -> float:
    """Return where a polynomial that is negative at `high` falls through 0."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if np.polyval(quartic, middle) < 0.0 else (middle, high)
    return high


def ring_times(
    flight: Flight, center: Floats, radius: float, horizon: float, *, outward: bool = False
) -> Iterator[float]:
    """Yield when the centre of a disk comes into a circle, or goes out of it, in order."""
    quartic, marks = _distance(flight, center, radius, horizon)
    if outward:
        quartic = -quartic
    values = np.polyval(quartic, marks)
    for index in np.flatnonzero((values[:-1] >= 0.0) & (values[1:] < 0.0)):
        yield _falls(quartic, marks[index], marks[index + 1])


def first_in_flight(
    flight: Flight, obstacles: Obstacles, radius: float, horizon: float
) -> tuple[float, int]:
    """Return when and with what the disk first collides up to `horizon`; (inf, -1)."""
    segments, arcs = obstacles.segments, obstacles.arcs
    tangent, normal, length = segments.frames()
    height = np.sum((flight.position - segments.start) * normal, axis=1)
    speed = normal @ flight.velocity
    bend = -0.5 * flight.gravity * normal[:, 1]
    faces = np.full(len(length), np.inf)
    for side in (1.0, -1.0):
        # Where c + b t + a t² falls through 0, without cancellation; NaN if nowhere.
        c, b, a = side * height - radius, side * speed, side * bend
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            root = np.sqrt(b**2 - 4.0 * a * c)
            t = np.where(b > 0.0, -(b + root) / (2.0 * a), 2.0 * c / (root - b))
        met = (t >= 0.0) & (t <= horizon)
        foot = np.full(len(t), -1.0)
        foot[met] = np.sum((flight.at(t[met]) - segments.start[met]) * tangent[met], axis=1)
        faces = np.minimum(faces, np.where((foot >= 0.0) & (foot <= length), t, np.inf))
    corners = corner_times(flight, segments.points, radius, horizon)
    straight = _earliest(np.concatenate([faces, corners]), len(segments.names))
    if not arcs.names or horizon <= 0.0:
        return straight
    faces = np.full(len(arcs.names), np.inf)
    for index, size, outward in arcs.rings(radius):
        for t in ring_times(flight, arcs.center[index], size, horizon, outward=outward):
            if arcs.holds(index, flight.at(np.array(t))):
                faces[index] = min(faces[index], t)
                break
    corners = corner_times(flight, arcs.points, radius, horizon)
    time, index = _earliest(np.concatenate([faces, corners]), len(faces))
    return straight if straight[0] <= time else (time, len(segments.names) + index)


def first_on_pulley(
    ride_radius: float, begin: float, last: float, obstacles: Obstacles, radius: float
) -> tuple[float, int]:
    """Return angle and obstacle of the first collision of the ride; (inf, -1) if none.

    The centre's path has radius Rc (m) round the origin and goes from the angle `begin` from the
    top to `last` (rad); the angle returned is counted from `begin`.
    """
    segments, arcs = obstacles.segments, obstacles.arcs
    tangent, normal, length = segments.frames()
    level = np.sum(segments.start * normal, axis=1)
    angles = []
    with np.errstate(invalid="ignore"):
        for side in (radius, -radius):
            lean = np.arctan2(normal[:, 0], normal[:, 1])
            spread = np.arccos((level + side) / ride_radius)
            for angle in (lean - spread, lean + spread):
                place = ride_radius * np.stack([np.sin(angle), np.cos(angle)], axis=1)
                foot = np.sum((place - segments.start) * tangent, axis=1)
                angles.append(np.where((foot >= 0.0) & (foot <= length), angle, np.inf))
        if radius > 0.0:
            angles += _on_circle(ride_radius, segments.points, radius)
        touched = np.mod(np.concatenate(angles) - begin, 2.0 * np.pi)
        touched[~(touched <= last - begin)] = np.inf
        straight = _earliest(touched, len(segments.names))
        if not arcs.names:
            return straight
        angles = list(_on_circle(ride_radius, arcs.points, radius)) if radius > 0.0 else []
        for index, size, _ in arcs.rings(radius):
            for angle in _on_circle(ride_radius, arcs.center[index], size):
                place = ride_radius * np.array([np.sin(angle), np.cos(angle)])
                row = np.full(len(arcs.names), np.inf)
                row[index] = angle if arcs.holds(index, place) else np.inf
                angles.append(row)
        touched = np.mod(np.concatenate(angles) - begin, 2.0 * np.pi)
        touched[~(touched <= last - begin)] = np.inf
    angle, index = _earliest(touched, len(arcs.names))
    return straight if straight[0] <= angle else (angle, len(segments.names) + index)


def _on_circle(ride_radius: float, points: Floats, radius: float) -> tuple[Floats, Floats]:
    """Return from the top where the ride is `radius` away from points (..., 2); NaN if nowhere."""
    far = np.hypot(points[..., 0], points[..., 1])
    lean = np.arctan2(points[..., 0], points[..., 1])
    with np.errstate(all="ignore"):
        cosine = (ride_radius**2 + far**2 - radius**2) / (2.0 * ride_radius * far)
        spread = np.arccos(cosine)
    return lean - spread, lean + spread


def _earliest(times: Floats, count: int) -> tuple[float, int]:
    if not times.size or not np.isfinite(times).any():
        return np.inf, -1
    index = int(np.argmin(times))
    return float(times[index]), index % count
