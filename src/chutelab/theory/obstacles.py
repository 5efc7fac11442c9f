"""First contacts of one disk with finite surfaces: on the ride, in flight, with all their ends.

Only whether, when and with what; the velocities are `transfer`'s business. Surfaces are segments
without thickness, touched from either side at the disk's radius. Contacts are found where a
distance falls through the radius; a graze to within rounding may go either way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chutelab.util.arrays import Floats

HALVINGS = 60
"""Bisections of a contact time: they exhaust a double's digits."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Named straight surfaces: names (S,), first and second ends (S, 2), m."""

    names: tuple[str, ...]
    start: Floats
    end: Floats

    @classmethod
    def of(cls, lines: Sequence[tuple[str, Sequence[float], Sequence[float]]]) -> Segments:
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

    def overlapped(self, point: Floats, radius: float) -> int:
        """Return the first segment closer to `point` than `radius`, -1 if none."""
        tangent, _, length = self.frames()
        share = np.clip(np.sum((point - self.start) * tangent, axis=1), 0.0, length)
        gap = self.start + share[:, None] * tangent - point
        near = np.flatnonzero(np.hypot(gap[:, 0], gap[:, 1]) < radius)
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

    def horizon(self, targets: Segments, radius: float) -> float:
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
    drop = np.array([0.0, -0.5 * flight.gravity])
    for index in np.flatnonzero(reach.all(axis=1)):
        apart = flight.position - points[index]
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
        marks = np.sort(np.concatenate([[0.0, horizon], turns[(turns > 0.0) & (turns < horizon)]]))
        inside = np.flatnonzero(np.polyval(quartic, marks) < 0.0)
        if inside.size:
            low, high = marks[max(inside[0] - 1, 0)], marks[inside[0]]
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if np.polyval(quartic, middle) < 0.0 else (middle, high)
            first[index] = high
    return first


def first_in_flight(
    flight: Flight, segments: Segments, radius: float, horizon: float
) -> tuple[float, int]:
    """Return when and with which segment the disk first collides up to `horizon`; (inf, -1)."""
    tangent, normal, length = segments.frames()
    height = np.sum((flight.position - segments.start) * normal, axis=1)
    speed = normal @ flight.velocity
    bend = -0.5 * flight.gravity * normal[:, 1]
    faces = np.full(len(length), np.inf)
    for side in (1.0, -1.0):
        # Where c + b t + a t² falls through 0, without cancellation; NaN if nowhere.
        c, b, a = side * height - radius, side * speed, side * bend
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(b**2 - 4.0 * a * c)
            t = np.where(b > 0.0, -(b + root) / (2.0 * a), 2.0 * c / (root - b))
        met = (t >= 0.0) & (t <= horizon)
        foot = np.full(len(t), -1.0)
        foot[met] = np.sum((flight.at(t[met]) - segments.start[met]) * tangent[met], axis=1)
        faces = np.minimum(faces, np.where((foot >= 0.0) & (foot <= length), t, np.inf))
    corners = corner_times(flight, segments.points, radius, horizon)
    return _earliest(np.concatenate([faces, corners]), len(segments.names))


def first_on_arc(
    ride_radius: float, last: float, segments: Segments, radius: float
) -> tuple[float, int]:
    """Return angle from the top and segment of the first collision of the ride; (inf, -1) if none.

    The centre's path has radius Rc (m) round the origin and ends at the angle `last` (rad).
    """
    tangent, normal, length = segments.frames()
    level = np.sum(segments.start * normal, axis=1)
    angles = []
    with np.errstate(invalid="ignore"):
        for side in (radius, -radius):
            lean = np.arctan2(normal[:, 0], normal[:, 1])
            spread = np.arccos((level + side) / ride_radius)
            for angle in (lean - spread, lean + spread):
                turned = np.mod(angle, 2.0 * np.pi)
                place = ride_radius * np.stack([np.sin(turned), np.cos(turned)], axis=1)
                foot = np.sum((place - segments.start) * tangent, axis=1)
                angles.append(np.where((foot >= 0.0) & (foot <= length), turned, np.inf))
        if radius > 0.0:
            far = np.hypot(segments.points[:, 0], segments.points[:, 1])
            lean = np.arctan2(segments.points[:, 0], segments.points[:, 1])
            with np.errstate(divide="ignore"):
                cosine = (ride_radius**2 + far**2 - radius**2) / (2.0 * ride_radius * far)
            spread = np.arccos(cosine)
            angles += [np.mod(lean - spread, 2.0 * np.pi), np.mod(lean + spread, 2.0 * np.pi)]
    touched = np.concatenate(angles) if angles else np.empty(0)
    touched[~(touched <= last)] = np.inf
    return _earliest(touched, len(segments.names))


def _earliest(times: Floats, count: int) -> tuple[float, int]:
    if not times.size or not np.isfinite(times).any():
        return np.inf, -1
    index = int(np.argmin(times))
    return float(times[index]), index % count
