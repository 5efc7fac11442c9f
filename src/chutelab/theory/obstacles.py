"""First contacts of one disk with finite surfaces: on the ride, in flight, with all their ends.

Only whether, when and with what; the velocities are `transfer`'s business. Surfaces are segments
and arcs without thickness, touched from either side at the disk's radius.

A surface has features: the two sides of a face, the inside and the outside of an arc, and the
points where they end. The gap to each is a function of time (on the ride, of the angle) that is
followed between its turning points: the disk collides at the first instant at which a gap falls to
zero, touching included, in a place that is on the feature. A gap that is zero from the beginning
falls if the disk approaches or is pressed, and not if it leaves or goes along. Zero is what
rounding makes of the numbers, so a graze to within rounding is one.
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

ROUNDING = 2.0**-48
"""Share of the numbers that a gap is worked out from by which it may be off: 16 units of the last
place."""


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

    def rings(self, radius: float) -> Iterator[tuple[int, float, float]]:
        """Yield where a disk can touch: arc, the arc's radius (m), and 1 outside or -1 inside."""
        for index, size in enumerate(self.radius.tolist()):
            yield index, size, 1.0
            if size > radius:
                yield index, size, -1.0


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
    """Return when the centre first comes as close as `radius` to each point, (P,); inf if not."""
    first = np.full(len(points), np.inf)
    if radius <= 0.0 or horizon <= 0.0:
        return first
    stops = np.array([0.0, horizon])
    if flight.gravity > 0.0:
        apex = np.clip(flight.velocity[1] / flight.gravity, 0.0, horizon)
        stops = np.append(stops, apex)
    places = flight.at(stops)
    room = 1.001 * radius
    reach = (points >= places.min(axis=0) - room) & (points <= places.max(axis=0) + room)
    for index in np.flatnonzero(reach.all(axis=1)):
        first[index] = next(ring_times(flight, points[index], 0.0, radius, horizon), np.inf)
    return first


def ring_times(
    flight: Flight, center: Floats, size: float, radius: float, horizon: float, side: float = 1.0
) -> Iterator[float]:
    """Yield when a disk comes to a circle of a size (m) from outside, or inside (-1.0), in order.

    The distance, squared, is a quartic. Between the roots of its derivative it is monotone, so no
    approach is overlooked, and none found that is not there.
    """
    drop = np.array([0.0, -0.5 * flight.gravity])
    apart = flight.position - center
    quartic = np.array(
        [
            drop @ drop,
            2.0 * flight.velocity @ drop,
            flight.velocity @ flight.velocity + 2.0 * apart @ drop,
            2.0 * apart @ flight.velocity,
            apart @ apart - (size + side * radius) ** 2,
        ]
    )
    # Complex roots only add breakpoints, which do no harm.
    turns = np.roots(np.polyder(quartic)).real
    marks = np.sort(np.concatenate([[0.0, horizon], turns[(turns > 0.0) & (turns < horizon)]]))
    reach = np.abs(flight.position).sum() + np.abs(center).sum() + size + radius
    off = ROUNDING * (np.polyval(np.abs(quartic), marks) + (size + side * radius) * reach)
    gap = side * quartic
    values = np.polyval(gap, marks)
    values[np.abs(values) <= off] = 0.0
    for index in np.flatnonzero((values[:-1] >= 0.0) & (values[1:] <= 0.0)):
        low, high = marks[index : index + 2]
        if values[index] == 0.0:
            # Where the gap is zero first, the fall begins there, if it is one.
            if values[index + 1] < 0.0:
                yield float(low)
            continue
        for _ in range(HALVINGS if values[index + 1] < 0.0 else 0):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if np.polyval(gap, middle) < 0.0 else (middle, high)
        yield float(high)


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
    off = ROUNDING * (np.abs(flight.position).sum() + np.abs(segments.start).sum(axis=1) + radius)
    for side in (1.0, -1.0):
        # Where c + b t + a t² falls to 0, without cancellation; NaN if nowhere.
        c, b, a = side * height - radius, side * speed, side * bend
        c[np.abs(c) <= off] = 0.0
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            square = b**2 - 4.0 * a * c
            root = np.sqrt(np.where(np.abs(square) <= 4.0 * np.abs(a) * off, 0.0, square))
            t = np.where(b > 0.0, -(b + root) / (2.0 * a), 2.0 * c / (root - b))
        t[(c == 0.0) & (b == 0.0) & (a < 0.0)] = 0.0
        met = (t >= 0.0) & (t <= horizon)
        foot = np.full(len(t), -1.0)
        foot[met] = np.sum((flight.at(t[met]) - segments.start[met]) * tangent[met], axis=1)
        faces = np.minimum(faces, np.where((foot >= 0.0) & (foot <= length), t, np.inf))
    corners = corner_times(flight, segments.points, radius, horizon)
    straight = _earliest(np.concatenate([faces, corners]), len(segments.names))
    if not arcs.names or horizon <= 0.0:
        return straight
    faces = np.full(len(arcs.names), np.inf)
    for index, size, side in arcs.rings(radius):
        for time in ring_times(flight, arcs.center[index], size, radius, horizon, side):
            if arcs.holds(index, flight.at(np.array(time))):
                faces[index] = min(faces[index], time)
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
            spread = _spread((level + side) / ride_radius)
            for angle in (lean - spread, lean + spread):
                place = ride_radius * np.stack([np.sin(angle), np.cos(angle)], axis=1)
                foot = np.sum((place - segments.start) * tangent, axis=1)
                angles.append(np.where((foot >= 0.0) & (foot <= length), angle, np.inf))
        if radius > 0.0:
            angles += _on_circle(ride_radius, segments.points, radius)
        touched = _turned(np.concatenate(angles), begin)
        touched[~(touched <= last - begin)] = np.inf
        straight = _earliest(touched, len(segments.names))
        if not arcs.names:
            return straight
        angles = list(_on_circle(ride_radius, arcs.points, radius)) if radius > 0.0 else []
        for index, size, side in arcs.rings(radius):
            for angle in _on_circle(ride_radius, arcs.center[index], size + side * radius):
                place = ride_radius * np.array([np.sin(angle), np.cos(angle)])
                row = np.full(len(arcs.names), np.inf)
                row[index] = angle if arcs.holds(index, place) else np.inf
                angles.append(row)
        touched = _turned(np.concatenate(angles), begin)
        touched[~(touched <= last - begin)] = np.inf
    turned, index = _earliest(touched, len(arcs.names))
    return straight if straight[0] <= turned else (turned, len(segments.names) + index)


def _on_circle(ride_radius: float, points: Floats, radius: float) -> tuple[Floats, Floats]:
    """Return from the top where the ride is `radius` away from points (..., 2); NaN if nowhere."""
    far = np.hypot(points[..., 0], points[..., 1])
    lean = np.arctan2(points[..., 0], points[..., 1])
    with np.errstate(all="ignore"):
        cosine = (ride_radius**2 + far**2 - radius**2) / (2.0 * ride_radius * far)
        spread = _spread(cosine)
    return lean - spread, lean + spread


def _spread(cosine: Floats) -> Floats:
    """Return the angle of a cosine, which may be beyond 1 by rounding; NaN if it is by more."""
    over = np.abs(cosine) - 1.0
    return np.asarray(np.arccos(np.where(np.abs(over) <= ROUNDING, np.sign(cosine), cosine)))


def _turned(angle: Floats, begin: float) -> Floats:
    """Return how far angles are from where a ride begins, from 0 to 2π, rad."""
    turned = np.mod(angle - begin, 2.0 * np.pi)
    return np.asarray(np.where(turned >= 2.0 * np.pi - ROUNDING, 0.0, turned))


def _earliest(times: Floats, count: int) -> tuple[float, int]:
    if not times.size or not np.isfinite(times).any():
        return np.inf, -1
    index = int(np.argmin(times))
    return float(times[index]), index % count
