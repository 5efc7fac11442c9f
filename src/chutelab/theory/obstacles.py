"""The first straight or round surface that a disk meets, on a parabola or round a pulley.

Surfaces are segments and arcs without thickness, touched from either side at the disk's radius.

The gap to each side of a face or an arc, and to each end, is a function of time (on the ride, of
the angle) that is followed between its turning points: the disk collides at the first instant at
which a gap falls to zero, touching included. A gap that is zero from the beginning counts as
falling if the disk approaches or is pressed, but not if it leaves or moves along, even past an end.
Gaps within rounding count as zero, so a graze within rounding is a contact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chutelab.theory.slide import HALVINGS
from chutelab.util.arrays import Bools, Floats, Ints

Line = tuple[str, ArrayLike, ArrayLike]
"""A straight surface: its name and both ends, m."""


Bend = tuple[str, ArrayLike, float, float, float]
"""A round one: its name, centre and radius, m; the angle of its first end from the x axis,
counter-clockwise, and how far it reaches from there, rad. 2π is a whole circle, without ends."""


WHOLE = 2.0 * np.pi


ROUNDING = 2.0**-48
"""Error of a gap as a share of the numbers from which it is computed: 16 units of the last
place."""


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Straight and round surfaces, and all their ends."""

    names: tuple[str, ...]  # names of the S straight ones, then of the others
    # (S, 2): first ends of the straight ones, m, directions along them and to their left; lengths
    start: Floats
    tangent: Floats
    normal: Floats
    length: Floats
    # (C, ...): round surfaces, as in `Bend`; an end of a surface is a circle of radius 0
    center: Floats
    size: Floats
    begin: Floats
    extent: Floats
    owner: Ints  # index of the name of each of these

    @classmethod
    def of(cls, lines: Sequence[Line], bends: Sequence[Bend] = ()) -> Obstacles:
        """Collect surfaces."""
        ends = np.array([line[1:] for line in lines], dtype=np.float64).reshape(-1, 2, 2)
        way = ends[:, 1] - ends[:, 0]
        length = np.hypot(*way.T)
        tangent = way / length[:, None]
        # Of two that are met at once, the order is faces, points, rings, tips.
        points = [(x, y, 0.0, 0.0, WHOLE, i) for k in (0, 1) for i, (x, y) in enumerate(ends[:, k])]
        rings, tips = [], []
        for i, (_, center, size, begin, extent) in enumerate(bends, start=len(lines)):
            x, y = np.asarray(center)
            rings.append((x, y, size, begin, extent, i))
            for angle in (begin, begin + extent) if extent < WHOLE else ():
                tip = x + size * np.cos(angle), y + size * np.sin(angle)
                tips.append((*tip, 0.0, 0.0, WHOLE, i))
        table = np.array([*points, *rings, *tips], dtype=np.float64).reshape(-1, 6)
        size, begin, extent, owner = table[:, 2:].T
        return cls(
            (*(line[0] for line in lines), *(bend[0] for bend in bends)),
            ends[:, 0], tangent, tangent[:, ::-1] * np.array([-1.0, 1.0]), length,
            table[:, :2], size, begin, extent, owner.astype(np.int64),
        )  # fmt: skip

    @property
    def corners(self) -> Floats:
        """Corners of boxes around all round surfaces and ends, (2C, 2), m."""
        return np.concatenate([self.center - self.size[:, None], self.center + self.size[:, None]])

    def near(self, low: Floats, high: Floats, radius: float) -> bool:
        """Whether any may be closer than a radius (m) to a box with two corners (2,)."""
        ends = self.center[: 2 * len(self.start)].reshape(2, -1, 2)
        round_, size = self.center[ends.shape[1] * 2 :], self.size[ends.shape[1] * 2 :, None]
        lower = np.concatenate([ends.min(axis=0), round_ - size])
        upper = np.concatenate([ends.max(axis=0), round_ + size])
        room = 1.001 * radius + ROUNDING * (np.abs(lower) + np.abs(upper))
        return bool(((lower - room <= high) & (upper + room >= low)).all(axis=1).any())

    def on_face(self, points: Floats) -> Bools:
        """Whether the nearest points to points (S, 2) are on the straight surfaces."""
        foot = np.sum((points - self.start) * self.tangent, axis=1)
        return np.asarray((foot >= 0.0) & (foot <= self.length))

    def on_arc(self, points: Floats) -> Bools:
        """Whether the directions from the centres to points (C, 2) are on the arcs."""
        away = points - self.center
        turned = np.arctan2(away[:, 1], away[:, 0]) - self.begin
        return np.asarray(np.mod(turned, WHOLE) <= self.extent)

    def overlapped(self, point: Floats, radius: float) -> int:
        """Return the first that is closer to `point` than `radius`, -1 if none."""
        height = np.abs(np.sum((point - self.start) * self.normal, axis=1))
        faces = np.flatnonzero((height < radius) & self.on_face(point))
        gap = np.abs(np.hypot(*(point - self.center).T) - self.size)
        rings = self.owner[(gap < radius) & self.on_arc(point)]
        return min([*faces.tolist(), *rings.tolist()], default=-1)

    def earliest(self, faces: Floats, rings: Floats) -> tuple[float, int]:
        """Return the least of two rows of numbers, (S,) and (C,), and its surface; (inf, -1)."""
        both = np.append(faces, rings)
        if not np.isfinite(both).any():
            return np.inf, -1
        index = int(np.argmin(both))
        owner = index if index < len(faces) else int(self.owner[index - len(faces)])
        return float(both[index]), owner


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
            rise = self.position[1] - (float(targets.corners[:, 1].min()) - radius)
            speed = self.velocity[1]
            square = speed**2 + 2.0 * self.gravity * rise
            if square <= 0.0:
                return 0.0
            return max(float((speed + np.sqrt(square)) / self.gravity), 0.0)
        apart = targets.corners - self.position
        reach, pace = float(np.hypot(*apart.T).max()), float(np.hypot(*self.velocity))
        return (reach + 2.0 * radius) / pace if pace > 0.0 else 0.0


def ring_times(
    flight: Flight, center: Floats, size: float, radius: float, horizon: float, side: float = 1.0
) -> Iterator[float]:
    """Yield the times when a disk reaches a circle from outside, or inside (-1.0), in order.

    The squared distance is a quartic. Between the roots of its derivative it is monotone, so every
    approach is found, and no false one.
    """
    drop, v = np.array([0.0, -0.5 * flight.gravity]), flight.velocity
    apart, far = flight.position - center, size + side * radius
    powers = (drop @ drop, 2.0 * v @ drop, v @ v + 2.0 * apart @ drop, 2.0 * apart @ v)
    quartic = np.array([*powers, apart @ apart - far**2])
    # Complex roots only add breakpoints, which do no harm.
    turns = np.roots(np.polyder(quartic)).real
    marks = np.sort(np.concatenate([[0.0, horizon], turns[(turns > 0.0) & (turns < horizon)]]))
    reach = np.abs(flight.position).sum() + np.abs(center).sum() + size + radius
    off = ROUNDING * (np.polyval(np.abs(quartic), marks) + far * reach)
    gap = side * quartic
    values = np.polyval(gap, marks)
    values[np.abs(values) <= off] = 0.0
    for index in np.flatnonzero((values[:-1] >= 0.0) & (values[1:] <= 0.0)):
        low, high = marks[index : index + 2]
        if values[index] == 0.0:
            # If the gap is zero at the beginning, it may begin to fall there.
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
    turn = flight.velocity[1] / flight.gravity if flight.gravity > 0.0 else 0.0
    places = flight.at(np.array([0.0, horizon, min(max(turn, 0.0), horizon)]))
    low, high = places.min(axis=0), places.max(axis=0)
    if not obstacles.near(low, high, radius):
        return np.inf, -1
    start, normal = obstacles.start, obstacles.normal
    center, size = obstacles.center, obstacles.size
    height = np.sum((flight.position - start) * normal, axis=1)
    speed = normal @ flight.velocity
    bend = -0.5 * flight.gravity * normal[:, 1]
    speed[np.abs(speed) <= ROUNDING * np.abs(flight.velocity).sum()] = 0.0
    bend[np.abs(bend) <= ROUNDING * flight.gravity] = 0.0
    along = (speed == 0.0) & (bend == 0.0) & obstacles.on_face(flight.position)
    faces, rings = np.full(len(start), np.inf), np.full(len(size), np.inf)
    off = ROUNDING * (np.abs(flight.position).sum() + np.abs(start).sum(axis=1) + radius)
    for side in (1.0, -1.0):
        # Time at which c + b t + a t² falls to 0, without cancellation; NaN if never.
        c, b, a = side * height - radius, side * speed, side * bend
        c[np.abs(c) <= off] = 0.0
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            square = b**2 - 4.0 * a * c
            root = np.sqrt(np.where(np.abs(square) <= 4.0 * np.abs(a) * off, 0.0, square))
            t = np.where(b > 0.0, -(b + root) / (2.0 * a), 2.0 * c / (root - b))
        t[(c == 0.0) & (b == 0.0) & (a < 0.0)] = 0.0
        met = (t >= 0.0) & (t <= horizon)
        met &= obstacles.on_face(flight.at(np.where(met, t, 0.0)))
        faces = np.minimum(faces, np.where(met, t, np.inf))
    # Circles near the bounding box of the flight.
    room = 1.001 * (size + radius)[:, None]
    near = (center >= low - room) & (center <= high + room)
    along &= np.abs(np.abs(height) - radius) <= off
    ends = (size == 0.0) & np.isin(obstacles.owner, np.flatnonzero(along))
    for index in np.flatnonzero(near.all(axis=1) & ~ends) if horizon > 0.0 else ():
        for side in (1.0, -1.0):
            if size[index] + side * radius <= 0.0:
                continue
            for time in ring_times(flight, center[index], size[index], radius, horizon, side):
                if obstacles.on_arc(flight.at(np.array(time)))[index]:
                    rings[index] = min(rings[index], time)
                    break
    return obstacles.earliest(faces, rings)


def first_on_pulley(
    ride_radius: float, begin: float, last: float, obstacles: Obstacles, radius: float
) -> tuple[float, int]:
    """Return angle and obstacle of the first collision of the ride; (inf, -1) if none.

    The centre's path has radius Rc (m) round the origin and goes from the angle `begin` from the
    top to `last` (rad); the angle returned is counted from `begin`.
    """
    if not obstacles.near(np.full(2, -ride_radius), np.full(2, ride_radius), radius):
        return np.inf, -1

    def turned(lean: Floats, cosine: Floats, on_it: Callable[[Floats], Bools]) -> Floats:
        """Return the angle from `begin` to the first of the angles lean ± acos; inf if none."""
        # A cosine may be beyond 1 by rounding.
        over = np.abs(cosine) - 1.0
        spread = np.arccos(np.where(np.abs(over) <= ROUNDING, np.sign(cosine), cosine))
        first = np.full(len(lean), np.inf)
        for angle in (lean - spread, lean + spread):
            way = np.mod(angle - begin, WHOLE)
            way = np.where(way >= WHOLE - ROUNDING, 0.0, way)
            there = on_it(ride_radius * np.stack([np.sin(angle), np.cos(angle)], axis=1))
            first = np.where(there & (way <= last - begin), np.minimum(first, way), first)
        return first

    normal, center, size = obstacles.normal, obstacles.center, obstacles.size
    level = np.sum(obstacles.start * normal, axis=1)
    far = np.hypot(*center.T)
    faces, rings = np.full(len(level), np.inf), np.full(len(size), np.inf)
    with np.errstate(all="ignore"):
        for side in (radius, -radius):
            lean, cosine = np.arctan2(*normal.T), (level + side) / ride_radius
            faces = np.minimum(faces, turned(lean, cosine, obstacles.on_face))
            reach = np.where(size + side > 0.0, size + side, np.nan)
            cosine = (ride_radius**2 + far**2 - reach**2) / (2.0 * ride_radius * far)
            rings = np.minimum(rings, turned(np.arctan2(*center.T), cosine, obstacles.on_arc))
    return obstacles.earliest(faces, rings)
