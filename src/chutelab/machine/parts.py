"""`Machine` and its parts: what the engines take, and all they take.

Also here: surfaces that cross (allowed, the first contact wins, but rarely what was meant), and a
place near the machine to count positions from, since far from the world's origin coordinates have
few digits left.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, inf, isnan, log2, nan, pi
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from chutelab.machine.releases import Releases
from chutelab.scene import Scene
from chutelab.scene.variants import Family
from chutelab.util.arrays import Bools, Floats, Ints
from chutelab.util.trig import atan2, hypot, sin_cos

DRIVE_PULLEY = "the drive pulley"


@dataclass(frozen=True)
class Caution:
    """Something about a machine that works, but may surprise."""

    surface: str  # the surface it is about
    crosses: str = ""  # another surface or `DRIVE_PULLEY`; "" if the nominal particle misses it
    hit: float = nan  # where that meets the plate's line, m above the pivot; NaN if it never does

    @property
    def text(self) -> str:
        """It in words, without the name of the surface."""
        if self.crosses:
            return f"it crosses {self.crosses}"
        if isnan(self.hit):
            return "the nominal particle never meets the plate's line"
        return (
            f"the nominal particle meets the plate's line {abs(self.hit):.4g} m"
            f" {'above' if self.hit > 0 else 'below'} the pivot, off the finite plate"
        )

    def __str__(self) -> str:
        return f"{self.surface}: {self.text}"


TOUCHES = 1e-9
"""Share of the machine's size by which an arc and another piece must cross; joints only touch."""


def crossings(
    names: Sequence[str], segments: Segments, arcs: Arcs, pulley: float | None
) -> list[Caution]:
    """Return every two surfaces that cross; those that only touch, as at a shared end, do not.

    Nor do gates cross what is never there while they are.

    `pulley` is the radius of the drive pulley about the origin, m, if there is one. The incoming
    belt, which lies on it, is surface 0 then.
    """
    rows = np.concatenate([segments.start, segments.end], axis=1)
    owner = segments.surface.tolist()
    found: dict[tuple[int, int], None] = {}
    known = np.eye(len(names), dtype=bool)  # surfaces that need not be held against each other

    def note(pairs: Ints) -> None:
        found.update(dict.fromkeys(map(tuple, pairs.tolist())))
        known[pairs[:, 0], pairs[:, 1]] = known[pairs[:, 1], pairs[:, 0]] = True

    for one, other in _beside(segments, segments, known):
        one, other = one[one < other], other[one < other]
        crossed = _parts(rows[one], rows[other]) & _parts(rows[other], rows[one])
        note(segments.surface[np.stack([one, other], axis=1)[crossed]])
    if len(arcs.surface):
        near = TOUCHES * np.abs(np.concatenate([segments.end, arcs.corners])).max()
        for pieces in (segments, arcs):
            for one, other in _beside(pieces, arcs, known):
                with_it = arcs.some(other)
                crossed = (
                    _chords(segments, one, with_it, near)
                    if pieces is segments
                    else _lenses(arcs.some(one), with_it, near)
                )
                pairs = np.stack([pieces.surface[one[crossed]], arcs.surface[other[crossed]]])
                note(np.sort(pairs, axis=0).T)
    said = [Caution(names[b], names[a]) for a, b in found]
    if pulley is not None:
        start, along = rows[:, :2], rows[:, 2:] - rows[:, :2]
        share = np.clip(-(start * along).sum(axis=1) / (along * along).sum(axis=1), 0.0, 1.0)
        distance = np.hypot(*(start + share[:, None] * along).T).tolist()
        bent = range(len(arcs.surface))
        distance += [np.hypot(*arcs.nearest(n, np.zeros((1, 2)))).item() for n in bent]
        owner += arcs.surface.tolist()
        into = {o for o, far in zip(owner, distance, strict=True) if o != 0 and far < pulley}
        said += [Caution(names[o], DRIVE_PULLEY) for o in sorted(into)]
    return said


ABREAST = 256
"""Pieces that are held against all others together, so that their pairs fit into memory."""


def _beside(
    one: Segments | Arcs, other: Segments | Arcs, known: Bools
) -> Iterator[tuple[Ints, Ints]]:
    """Yield pairs of pieces, by numbers, whose boxes touch while both are there.

    Pieces of surfaces that are known to cross, (surfaces, surfaces), are left out.
    """
    (low, high), (low2, high2) = one.boxes, other.boxes
    for first in range(0, len(one.surface), ABREAST):
        some = slice(first, first + ABREAST)
        met = ~known[one.surface[some, None], other.surface]
        begin = np.maximum(one.appears[some, None], other.appears)
        met &= begin < np.minimum(one.vanishes[some, None], other.vanishes)
        for axis in (0, 1):
            met &= low[some, axis, None] <= high2[:, axis]
            met &= high[some, axis, None] >= low2[:, axis]
        index, which = met.nonzero()
        yield first + index, which


def _chords(segments: Segments, which: Ints, arcs: Arcs, near: float) -> Bools:
    """Tell which segments, by their numbers (n,), cross n arcs by more than `near` (m)."""
    start, tangent = segments.start[which], segments.tangent[which]
    away = arcs.center - start
    foot = (away * tangent).sum(axis=-1)
    off = np.abs(tangent[..., 0] * away[..., 1] - tangent[..., 1] * away[..., 0])
    half = np.sqrt(np.maximum(arcs.radius**2 - off**2, 0.0))
    crossed = np.zeros(off.shape, dtype=bool)
    for s in (foot - half, foot + half):
        on = (s > near) & (s < segments.length[which] - near)
        crossed |= on & arcs.holds(start + s[..., None] * tangent, near)
    return np.asarray(crossed & (off < arcs.radius - near))


def _lenses(first: Arcs, second: Arcs, near: float) -> Bools:
    """Tell of which pairs (n,) the left one of both crossings is on both arcs, by `near` (m)."""
    distance = np.hypot(*(second.center - first.center).T)
    crossed = (distance < first.radius + second.radius - near) & (
        distance > np.abs(first.radius - second.radius) + near
    )
    some = crossed.nonzero()[0]
    first, second, distance = first.some(some), second.some(some), distance[some]
    towards = (second.center - first.center) / distance[:, None]
    aside = np.stack([-towards[:, 1], towards[:, 0]], axis=-1)
    # The other way round it is the other crossing.
    a, b = first.radius, second.radius
    foot = 0.5 * (distance + (a - b) * (a + b) / distance)
    half = np.sqrt(np.maximum(a**2 - foot**2, 0.0))
    place = first.center + foot[:, None] * towards + half[:, None] * aside
    crossed[some] = second.holds(place, near) & first.holds(place, near)
    return np.asarray(crossed)


def _parts(line: Floats, ends: Floats) -> Bools:
    """Tell of pairs (n, 4) whether two ends lie strictly on two sides of a line."""
    (x0, y0, x1, y1), (u0, v0, u1, v1) = line.T, ends.T
    first = (x1 - x0) * (v0 - y0) - (y1 - y0) * (u0 - x0)
    second = (x1 - x0) * (v1 - y0) - (y1 - y0) * (u1 - x0)
    return np.asarray(first * second < 0.0)


@dataclass(frozen=True, eq=False)
class Particle:
    """The particles of a machine and its recording: numbers if all are alike, else arrays (N,).

    Attributes
    ----------
    radius : float or ndarray, (N,)
        r, m; 0 for a mass point; of a box or polygon that of the circle round it.
    mass : float or ndarray, (N,)
        m, kg.
    inertia : float or ndarray, (N,)
        Moment of inertia about the centre, kg m²; 0 for a particle that does not turn.
    """

    radius: Any
    mass: Any
    inertia: Any

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Particle):
            return NotImplemented
        return all(np.array_equal(vars(self)[name], vars(other)[name]) for name in vars(self))

    def of(self, index: Any) -> Particle:
        """Return some of the particles, by their numbers."""
        own = (value[index] if np.ndim(value) else value for value in vars(self).values())
        return Particle(*own)

    def kinetic(self, vx: ArrayLike, vy: ArrayLike, omega: ArrayLike) -> Floats:
        """Return ½ m v² + ½ I ω² (J) for arrays of any one shape (m/s, rad/s)."""
        vx, vy, omega = np.asarray(vx), np.asarray(vy), np.asarray(omega)
        return np.asarray(0.5 * self.mass * (vx**2 + vy**2) + 0.5 * self.inertia * omega**2)


@dataclass(frozen=True, eq=False, kw_only=True)
class Pieces:
    """What S pieces of surfaces have, straight or bent: read-only arrays.

    Attributes
    ----------
    speed : ndarray, (..., S)
        Speed of the surface, along the tangent of a segment, clockwise round an arc, m/s.
    restitution, friction : ndarray, (..., S)
        Of the pair with a particle; (K, S) where there are several kinds of particles.
    surface : ndarray, (S,)
        Index of the surface a piece belongs to, into `Machine.surfaces`.
    appears, vanishes : ndarray, (S,)
        From when to when it is there, s; -inf and inf if always.
    """

    speed: Floats
    restitution: Floats
    friction: Floats
    surface: Ints
    appears: Floats
    vanishes: Floats

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.flags.writeable = False


@dataclass(frozen=True, eq=False, kw_only=True)
class Segments(Pieces):
    """Straight two-sided surfaces, world frame, SI units.

    Arrays have shape (S,) or (S, 2); in a family (N, S) and (N, S, 2).

    Attributes
    ----------
    start, tangent : ndarray, (..., S, 2)
        First end, and unit vector towards the second.
    length : ndarray, (..., S)
        m.
    """

    start: Floats
    tangent: Floats
    length: Floats

    @property
    def end(self) -> Floats:
        """Second end, (..., S, 2), m."""
        return self.start + self.length[..., None] * self.tangent

    @property
    def boxes(self) -> tuple[Floats, Floats]:
        """Lower left and upper right corner of the box of each, (..., S, 2), m."""
        return np.minimum(self.start, self.end), np.maximum(self.start, self.end)


@dataclass(frozen=True, eq=False, kw_only=True)
class Arcs(Pieces):
    """Two-sided surfaces bent round a centre, and whole circles, world frame, SI units.

    Arrays have shape (A,) or (A, 2); in a family (N, A) and (N, A, 2).

    Attributes
    ----------
    center : ndarray, (..., A, 2)
        m.
    radius : ndarray, (..., A)
        m; a particle may be inside or outside.
    begin, extent : ndarray, (..., A)
        Angle of the first end from the x axis, counterclockwise, and how far the arc reaches
        from there, counterclockwise, rad; 2π for a whole circle, which has no ends.
    """

    center: Floats
    radius: Floats
    begin: Floats
    extent: Floats

    @property
    def whole(self) -> Bools:
        """Which are circles all round, (..., A)."""
        return np.asarray(self.extent >= 2.0 * pi)

    def point(self, angle: ArrayLike) -> Floats:
        """Return the points of the arcs at angles (..., A) from the x axis, (..., A, 2), m."""
        sine, cosine = sin_cos(np.asarray(angle))
        direction = np.stack([cosine, sine], axis=-1)
        return np.asarray(self.center + self.radius[..., None] * direction)

    def nearest(self, n: int, places: Floats) -> Floats:
        """Return the points of arc n nearest to places (k, 2), one each in a family, (2, k), m."""
        center, radius = self.center[..., n, :].T, self.radius[..., n]
        first, last = (end[..., n, :].T - center for end in self.ends)
        if center.ndim == 1:
            center, first, last = center[:, None], first[:, None], last[:, None]
        away = places.T - center
        away = np.where(hypot(*away) > 0.0, away, np.array([[1.0], [0.0]]))
        angle = np.mod(atan2(away[1], away[0]) - self.begin[..., n], 2.0 * pi)
        on_it = radius * away / hypot(*away)
        nearer = hypot(*(away - first)) <= hypot(*(away - last))
        found = np.where(angle <= self.extent[..., n], on_it, np.where(nearer, first, last))
        return np.asarray(found + center)

    def holds(self, place: Floats, near: float) -> Bools:
        """Tell whether points of the circles (..., A, 2) are on the arcs, not `near` (m) an end."""
        away = place - self.center
        way = self.radius * np.mod(np.arctan2(away[..., 1], away[..., 0]) - self.begin, 2.0 * pi)
        between = (way > near) & (way < self.radius * self.extent - near)
        return np.asarray(self.whole | between)

    @property
    def boxes(self) -> tuple[Floats, Floats]:
        """Lower left and upper right corner of the box of each whole circle, (..., A, 2), m."""
        reach = self.radius[..., None]
        return self.center - reach, self.center + reach

    def some(self, which: Ints) -> Arcs:
        """Return some of the arcs, by their numbers."""
        own = {name: getattr(self, name) for name in ("center", "radius", "begin", "extent")}
        return replace(self, **{name: np.array(value[which]) for name, value in own.items()})

    @property
    def ends(self) -> tuple[Floats, Floats]:
        """First and last point of each, counterclockwise, (..., A, 2), m."""
        return self.point(self.begin), self.point(self.begin + self.extent)

    @property
    def corners(self) -> Floats:
        """Points of each that its box goes through, (..., 6 A, 2), m."""
        quarters = 0.5 * pi * np.arange(4)[:, None]
        reach = np.mod(quarters - self.begin[..., None, :], 2.0 * pi)
        # Where a quarter is not on the arc, its first end instead.
        inside = reach <= self.extent[..., None, :]
        angle = np.where(inside, self.begin[..., None, :] + reach, self.begin[..., None, :])
        points = [*np.moveaxis(angle, -2, 0), self.begin, self.begin + self.extent]
        return np.concatenate([self.point(angle) for angle in points], axis=-2)


@dataclass(frozen=True)
class Pulley:
    """The drive pulley, axis at the origin, turning clockwise (its top moves forward).

    The incoming belt is segment 0 of the machine and ends on it, where it is tangential: `incline`
    before its top. It is not listed in `arcs`.

    Attributes
    ----------
    radius, speed : float
        R (m), speed of the surface (m/s).
    friction, restitution : float
        Pair values; friction is inf with adhesion.
    surface : int
        Index into `Machine.surfaces`.
    incline : float
        Angle β at which the incoming belt rises, rad.

    Numbers are arrays (N,) in a family, see `Machine`; the pair values (K,) where there are several
    kinds of particles.
    """

    radius: float
    speed: float
    friction: Any
    restitution: Any
    surface: int
    incline: float = 0.0


@dataclass(frozen=True)
class Thread:
    """A string without mass from a point to the centre of a particle; it pulls, but cannot push."""

    anchor: tuple[float, float]  # m
    particle: int
    length: float  # m


EARTH = 9.81
"""m/s²; gravity for which engines' bounds on speeds and times are written, see `Machine.pace`."""


@dataclass(frozen=True, eq=False, repr=False)
class Machine:
    """Everything an engine needs to run.

    A family of machines, one for each particle, is one machine in which surfaces, gravity, radius
    and mass of the particle, the pulley's numbers and the end time have a value for each, (N,).
    """

    scenes: Scene | Family  # what it was built from
    surfaces: tuple[str, ...]  # names; several segments, or one and the pulley, may share one
    gravity: float  # m/s², pointing down
    particle: Particle
    segments: Segments  # all straight surfaces; the incoming belt is the first if there is one
    arcs: Arcs
    pulley: Pulley | None  # None without an incoming conveyor
    releases: Releases
    landing: int  # surface index of the outgoing belt, -1 without one
    until: Literal["landed", "settled", "time"]  # when a particle's track ends
    end_time: float  # s; no track goes on after it
    dt: float  # s; step of lasting contacts (contact), longest step (pymunk)
    align: bool  # whether the pymunk engine's steps of a lone particle end at contacts
    interact: bool  # whether particles meet each other
    pair_restitution: Floats  # (K, K), of two particles by their kinds, see `Releases.kind`
    pair_friction: Floats
    rolling: Floats  # (K,), rolling friction of a kind on everything: its arm over the radius
    outlines: tuple[Floats | None, ...]  # (K); of boxes and polygons corners (n, 2)
    threads: tuple[Thread, ...]
    streams: tuple[str, ...]  # names; `Releases.stream` tells whose a particle is
    engine: str  # what the scene asks for: "auto", "exact", "contact" or "pymunk"
    plate_warnings: tuple[Caution, ...]  # of a nominal particle that misses the plate

    def __repr__(self) -> str:
        return f"<Machine of {self.scene!r}>"

    @property
    def scene(self) -> Scene:
        """What it was built from; of a family one of its scenes."""
        return self.scenes.scene

    @property
    def family(self) -> Family | None:
        """All scenes that it was built from, if there are several."""
        return self.scenes if isinstance(self.scenes, Family) else None

    @cached_property
    def pace(self) -> Any:
        """What bounds on speeds are multiplied by, and bounds on times divided; (N,) of a family.

        √(g / 9.81 m/s²), and 1 without gravity: a run repeats if all its speeds are twice as high,
        all its times half as long, and gravity is four times as strong.
        """
        return np.sqrt(np.where(np.greater(self.gravity, 0.0), self.gravity, EARTH) / EARTH)

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.releases.t)

    @property
    def last_gate(self) -> float:
        """When a surface comes or goes for the last time, s; -inf if none does."""
        pieces = self.segments, self.arcs
        times = np.concatenate([[p.appears, p.vanishes] for p in pieces], axis=1)
        return float(times[np.isfinite(times)].max(initial=-inf))

    @property
    def corners(self) -> Floats:
        """Points round which the box of all segments and arcs goes, (..., C, 2), m."""
        parts = [self.segments.start, self.segments.end]
        if len(self.arcs.surface):
            parts.append(self.arcs.corners)
        return np.concatenate(parts, axis=-2)

    @cached_property
    def warnings(self) -> tuple[Caution, ...]:
        """What `chutelab check` tells about a machine that works but may surprise."""
        radius = self.pulley.radius if self.pulley is not None else None
        return (*self.plate_warnings, *crossings(self.surfaces, self.segments, self.arcs, radius))


REMOTE = 8.0
"""Distance from the world's origin, in machine sizes, beyond which a local origin is used."""


def origin(machine: Machine) -> tuple[float, float]:
    """Return the world point that the engine calculates from, m: near the machine.

    It is (0, 0) unless the machine is many times its own size away from there; and so round a
    number that taking it off a coordinate loses no digit.
    """
    if machine.pulley is not None or not (corners := machine.corners).size:
        return 0.0, 0.0
    axes = tuple(range(corners.ndim - 1))
    low, high = corners.min(axis=axes), corners.max(axis=axes)
    extent = float((high - low).max())
    middle = 0.5 * (low + high)
    if np.abs(middle).max() <= REMOTE * extent:
        return 0.0, 0.0
    unit = 2.0 ** ceil(log2(extent))
    x, y = (round(float(c) / unit) * unit for c in middle)
    return x, y


def moved(machine: Machine, x: float, y: float) -> Machine:
    """Return a machine without a pulley, moved by (x, y), m."""
    if not (x or y):
        return machine
    by = np.array([x, y])
    segments, releases = machine.segments, machine.releases
    return replace(
        machine,
        segments=replace(segments, start=segments.start + by),
        arcs=replace(machine.arcs, center=machine.arcs.center + by),
        releases=replace(
            releases,
            position=releases.position + by,
            exit_box=releases.exit_box + np.tile(by, 2),
        ),
        threads=tuple(
            replace(thread, anchor=(thread.anchor[0] + x, thread.anchor[1] + y))
            for thread in machine.threads
        ),
    )
