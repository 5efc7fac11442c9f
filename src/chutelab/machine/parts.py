"""`Machine` and its parts, the only input of the engines.

Also here: the motion of surfaces. A `Mover` gives the place of one at any time, that of a hinged
one after its run. It is used to draw machines, to check runs, and for Pymunk's bodies; the core has
its own (motion.c).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, isnan, nan, pi, sqrt
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.machine.releases import Releases
from chutelab.machine.shapes import Arcs, Pieces, Segments, crossings
from chutelab.scene import Scene
from chutelab.scene.variants import Family
from chutelab.util.arrays import RADIANS, Floats, Watch, hypot, sin_cos, unwatched

DRIVE_PULLEY = "the drive pulley"


@dataclass(frozen=True)
class Caution:
    """A warning about a machine that works but may behave unexpectedly."""

    surface: str  # the surface it is about
    crosses: str = ""  # another surface or `DRIVE_PULLEY`; "" if the nominal particle misses it
    hit: float = nan  # where that meets the plate's line, m above the pivot; NaN if it never does

    @property
    def text(self) -> str:
        """The warning in words, without the name of the surface."""
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


@dataclass(frozen=True, eq=False)
class Particle:
    """The particles of a machine and its recording: numbers if all are alike, else arrays (N,)."""

    radius: Any  # r, m; 0 for a mass point; of a box or polygon that of the circle round it
    mass: Any  # m, kg
    inertia: Any  # moment of inertia about the centre, kg m²; 0 for a particle that does not turn

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Particle):
            return NotImplemented
        return all(np.array_equal(vars(self)[name], vars(other)[name]) for name in vars(self))

    def of(self, index: Any) -> Particle:
        """Return some of the particles by their numbers."""
        if not any(isinstance(value, np.ndarray) for value in vars(self).values()):
            return self
        own = (value[index] if np.ndim(value) else value for value in vars(self).values())
        return Particle(*own)

    @property
    def largest(self) -> float:
        """The largest radius, m."""
        return self.radius if isinstance(self.radius, float) else float(np.max(self.radius))

    def kinetic(self, vx: ArrayLike, vy: ArrayLike, omega: ArrayLike) -> Floats:
        """Return ½ m v² + ½ I ω² (J) for arrays of any one shape (m/s, rad/s)."""
        vx, vy, omega = np.asarray(vx), np.asarray(vy), np.asarray(omega)
        return np.asarray(0.5 * self.mass * (vx**2 + vy**2) + 0.5 * self.inertia * omega**2)


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

    @cached_property
    def rim(self) -> Arcs:
        """Its surface, one piece: (1,), or in a family (N, 1)."""
        own = {**vars(self), "begin": 0.0, "extent": 2.0 * pi, "appears": -inf, "vanishes": inf}
        own["one_sided"] = 0
        del own["incline"]
        arrays = {name: np.asarray(value)[..., None] for name, value in own.items()}
        return Arcs(center=np.zeros((1, 2)), **arrays)


@dataclass(frozen=True)
class Joint:
    """A string, rod, spring or pin of a particle, with a point or with another particle."""

    kind: str  # of `JOINTS`
    particle: int
    length: float  # m; of a spring at rest
    # m; of a pin where it is at the release, of a string between two the pulley that it runs over
    anchor: tuple[float, float] | None
    other: int = -1  # the other particle
    stiffness: float = 0.0  # N/m
    damper: float = 0.0  # N s/m

    def ends(self, positions: Floats) -> Floats:
        """Return both ends, (..., 2, 2), where particles are at `positions` (..., N, 2)."""
        own = positions[..., self.particle, :]
        far = np.broadcast_to(self.anchor or nan, own.shape)
        far = positions[..., self.other, :] if self.other >= 0 else far
        return np.stack([far, own], axis=-2)

    @property
    def over(self) -> tuple[float, float] | None:
        """The pulley that a string runs over, m."""
        return self.anchor if self.kind == "string" and self.other >= 0 else None

    def reach(self, positions: Floats) -> float:
        """Return how long it is, m, where particles are at `positions` (N, 2)."""
        far, own = self.ends(positions)
        if self.over is None:
            return float(hypot(*(own - far)))
        return float(hypot(*(own - self.over))) + float(hypot(*(far - self.over)))


class Trigger(NamedTuple):
    """Action of a surface when another one is touched for the first time."""

    surface: int  # index into `Machine.surfaces`
    doing: str  # opens, closes or starts
    by: int  # which surface is to be touched


UPRIGHT = np.array(sin_cos(-0.0))
"""The direction against gravity that points straight down."""

EARTH = 9.81
"""m/s²; gravity for which the engines' bounds on speeds and times hold, see `pace_of`."""


def pace_of(gravity: Any) -> Any:
    """Return the factor of bounds on speeds, and divisor of bounds on times, for gravities, m/s².

    √(g / 9.81 m/s²), and 1 without gravity: a run repeats if all its speeds are twice as high, all
    its times half as long, and gravity is four times as strong.
    """
    if isinstance(gravity, float):
        return sqrt((gravity if gravity > 0.0 else EARTH) / EARTH)
    return np.sqrt(np.where(np.greater(gravity, 0.0), gravity, EARTH) / EARTH)


@dataclass(frozen=True, eq=False, repr=False)
class Machine:
    """The complete input of an engine.

    A family of machines, a copy of one for each particle, is one machine in which surfaces,
    gravity, radius and mass of the particle, the pulley's numbers and the end time have a value for
    each, (N,).

    If it `is_ahead`, it has only what needs no geometry, and `build`; the rest is built when it is
    first needed, which is never if the core builds the machine itself.
    """

    scenes: Scene | Family  # what it was built from
    surfaces: tuple[str, ...]  # names; several segments, or one and the pulley, may share one
    gravity: float  # m/s², along -`up`
    air: float  # kg/m³, density of still air; 0 without
    particle: Particle
    segments: Segments  # all straight surfaces; the incoming belt is the first if there is one
    arcs: Arcs
    pulley: Pulley | None  # None without an incoming conveyor
    releases: Releases
    landing: int  # surface index of the outgoing belt, -1 without one
    until: Literal["landed", "settled", "time"]  # when a particle's track ends
    end_time: float  # s; all tracks end by this time
    dt: float  # s; longest step of the contact engine; Pymunk's are `step_of`
    align: bool  # whether the pymunk engine's steps of a lone particle end at contacts; not in air
    interact: bool  # whether particles meet each other
    pair_restitution: Floats  # (K, K), of two particles by their kinds; negative if they never meet
    pair_friction: Floats
    rolling: Floats  # (K,), rolling friction of each kind: its arm over the radius
    cohesion: Floats  # (K, K + S), N; cohesion of a kind with another, and with a surface
    outlines: tuple[Floats | None, ...]  # (K); of boxes and polygons corners (n, 2)
    joints: tuple[Joint, ...]
    movers: tuple[Mover, ...]
    triggers: tuple[Trigger, ...]
    streams: tuple[str, ...]  # names; `Releases.stream` tells whose a particle is
    falls: Floats  # (K,), s/m: inverse of the speed up to which a kind's restitution is constant
    engine: str  # what the scene asks for: "auto", "exact", "contact" or "pymunk"
    plate_warnings: tuple[Caution, ...]  # of a nominal particle that misses the plate

    @property
    def is_ahead(self) -> bool:
        """Whether the machine is not built yet."""
        return "releases" not in vars(self)

    @property
    def is_told(self) -> bool:
        """Whether its scene alone tells all of it to the core, as no part has been replaced."""
        return "build" in vars(self)

    def finish(self, watch: Watch = unwatched) -> None:
        """Build the missing parts, see `chutelab.machine.build`."""
        if self.is_ahead:
            vars(self).update(vars(vars(self)["build"](self.scenes, watch)))

    def __getattr__(self, name: str) -> Any:
        if name not in Machine.__dataclass_fields__ or not self.is_ahead:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        self.finish()
        return vars(self)[name]

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

    def step_of(self, engine: str) -> float:
        """Return the longest step of an engine, s; 0 for the exact one."""
        if engine == "pymunk":
            return min(self.dt, self.scene.run.dt)
        return 0.0 if engine == "exact" else self.dt

    @property
    def tilt(self) -> float:
        """Angle of gravity from straight down, counterclockwise, rad."""
        return self.scene.gravity_deg * RADIANS

    @cached_property
    def up(self) -> Floats:
        """The direction against gravity, (2,)."""
        return np.array(sin_cos(-self.tilt)) if self.tilt else UPRIGHT

    @cached_property
    def frame(self) -> Floats:
        """Unit vectors (rows) of the frame in which gravity points down, (2, 2)."""
        x, y = self.up
        return np.array([[y, -x], [x, y]])

    def height(self, position: Floats) -> Floats:
        """Return the heights (...) of places (..., 2), m: against gravity, from the origin."""
        found: Floats = self.up[0] * position[..., 0] + self.up[1] * position[..., 1]
        return found

    @cached_property
    def pace(self) -> Any:
        """See `pace_of`; (N,) in a family."""
        return pace_of(self.gravity)

    @property
    def loads(self) -> float:
        """Width of the bins in which loads on surfaces are counted, s; 0 if they are not."""
        return 0.0 if self.family is not None else self.scene.run.loads or 0.0

    @property
    def stress(self) -> float:
        """Width of the bins in which lasting contacts are recorded, s; 0 if they are not."""
        return 0.0 if self.family is not None else self.scene.run.stress or 0.0

    @cached_property
    def loose(self) -> float:
        """Additional error of tracks on circles between two knots, as a share of the radius.

        0 except in a family, whose tracks are not read between knots; its laws overlook less than a
        ten thousandth of a particle's radius.
        """
        if self.family is None:
            return 0.0
        bends: list[Any] = [self.arcs.radius]
        bends += [] if self.pulley is None else [self.pulley.radius]
        widest = max((float(np.max(one)) for one in bends if np.size(one)), default=inf)
        return min(1e-6, 1e-4 * float(np.min(self.particle.radius)) / widest)

    @cached_property
    def count(self) -> int:
        """Number of particles."""
        return len(self.releases.t)

    def mover(self, surface: int) -> Mover | None:
        """Return the mover of a surface, by its index; None if it is fixed."""
        return next((mover for mover in self.movers if mover.surface == surface), None)

    def when(self, times: Floats) -> Machine:
        """Return the machine with the times of its triggers, s; inf for those that did not act."""
        parts: dict[str, Any] = {"segments": self.segments, "arcs": self.arcs}
        movers = list(self.movers)
        for (surface, doing, _), t in zip(self.triggers, times.tolist(), strict=True):
            if doing == "starts":
                movers = [replace(m, begins=t) if m.surface == surface else m for m in movers]
                continue
            clock = "vanishes" if doing == "opens" else "appears"
            for name, part in parts.items():
                own = np.where(part.surface == surface, t, getattr(part, clock))
                parts[name] = replace(part, **{clock: own})
        return replace(self, movers=tuple(movers), **parts)

    def steered(self, surface: int) -> Mover:
        """Return the mover of a plate, by its index, that is turned by hand about its pivot."""
        named = {plate.name or "plate": plate for plate in self.scene.plates}
        plate, belt = named[self.surfaces[surface]], self.scene.incoming
        pivot = plate.pivot
        if pivot is None:
            assert belt is not None
            pivot = belt.pulley_radius + plate.distance, plate.pivot_height
        return Mover.steered(surface, pivot)

    @property
    def parts(self) -> tuple[Segments, Arcs]:
        """All surfaces but the drive pulley, by kind of piece."""
        return self.segments, self.arcs

    @property
    def broad(self) -> Any:
        """Radius of the circle with the area of each particle, m, (N,)."""
        found = np.broadcast_to(np.asarray(self.particle.radius, dtype=float), self.count).copy()
        for kind, corners in enumerate(self.outlines):
            if corners is not None:
                (x, y), (u, v) = corners.T, np.roll(corners, -1, axis=0).T
                found[self.releases.kind == kind] = np.sqrt(0.5 * (x * v - y * u).sum() / np.pi)
        return found

    @property
    def last_gate(self) -> float:
        """Last time at which a surface appears, vanishes or moves, s; -inf if none does."""
        times = np.concatenate([[p.appears, p.vanishes] for p in self.parts], axis=1)
        rest = max((mover.rests for mover in self.movers), default=-inf)
        return max(rest, float(times[np.isfinite(times)].max(initial=-inf)))

    @property
    def corners(self) -> Floats:
        """Points whose bounding box holds all segments and arcs, (..., C, 2), m."""
        parts = [part for part in self.parts if part.surface.size]
        return np.concatenate([part.corners for part in parts or [self.segments]], axis=-2)

    @cached_property
    def pieces(self) -> tuple[Pieces, ...]:
        """All pieces of its surfaces one by one: straight ones, arcs, and the drive pulley last."""
        found = [part.of(k) for part in self.parts for k in range(len(part.surface))]
        return (*found, self.pulley.rim.of(0)) if self.pulley is not None else (*found,)

    @property
    def names(self) -> list[str]:
        """Names of the surfaces of all `pieces`; of the drive pulley ``"pulley"``."""
        found = [self.surfaces[piece.surface] for piece in self.pieces]
        return found if self.pulley is None else [*found[:-1], "pulley"]

    @cached_property
    def warnings(self) -> tuple[Caution, ...]:
        """Warnings of `chutelab check` about a machine that works."""
        crossed = crossings(len(self.surfaces), self.segments, self.arcs)
        said = [Caution(self.surfaces[b], self.surfaces[a]) for a, b in crossed]
        if self.pulley is not None:
            into = [part.surface[part.gap(np.zeros(2)) < self.pulley.radius] for part in self.parts]
            # The incoming belt, which lies on the pulley, is surface 0.
            owners = np.setdiff1d(np.concatenate(into), [0])
            said += [Caution(self.surfaces[owner], DRIVE_PULLEY) for owner in owners]
        return (*self.plate_warnings, *said)


SWING = np.dtype([
    ("t", "f8"), ("angle", "f8"), ("rate", "f8"), ("surface", "i4"), ("pad", "i4")
])  # fmt: skip
"""One state of a hinged surface, in SI units.

- ``t``: time, s; two states at one time are before and after an impact.
- ``angle``, ``rate``: angle from its place as written, rad, and angular velocity, rad/s.
- ``surface``: index into `Recording.surfaces`; ``pad`` is 0.
"""


@dataclass(frozen=True, eq=False)
class Hinge:
    """A hinge: what acts on it and, after its run, its states."""

    inertia: float  # kg m2, about the hinge
    moment: tuple[float, float]  # kg m; mass times its centre's place from the hinge, as written
    spring: float  # N m/rad
    rest: float  # rad; where the spring is at rest
    damper: float  # N m s/rad
    stops: tuple[float, float]  # rad; infinite without
    motor: tuple[float, float]  # rad/s and N m; 0 without
    mass: float = 0.0  # kg; 0 without a weight
    gyration: float = 1.0  # m; root of the mean square distance from the hinge
    steered: bool = False  # whether it is turned by hand only
    states: NDArray[Any] = field(default_factory=lambda: np.zeros(1, SWING))  # (k,) of `SWING`

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Return angle, rad, and rate, rad/s, at times (...,), s, by cubics between its states."""
        t, angle, rate = (self.states[name] for name in ("t", "angle", "rate"))
        if len(t) < 2:
            return np.full_like(times, angle[0]), np.full_like(times, rate[0])
        left = (np.searchsorted(t, times, side="right") - 1).clip(0, len(t) - 2)
        h = t[left + 1] - t[left]
        s = np.divide(times - t[left], h, out=np.ones_like(times), where=h > 0.0).clip(0.0, 1.0)
        gone, va, vb = angle[left + 1] - angle[left], h * rate[left], h * rate[left + 1]
        bent = (3.0 * gone - 2.0 * va - vb) + s * (va + vb - 2.0 * gone)
        pace = va + s * (2.0 * (3.0 * gone - 2.0 * va - vb) + 3.0 * s * (va + vb - 2.0 * gone))
        pace = np.divide(pace, h, out=np.array(rate[left + 1]), where=h > 0.0)
        return angle[left] + s * (va + s * bent), np.where(s < 1.0, pace, rate[left + 1])

    def energies(self, angle: Any, rate: Any, gravity: float, up: Floats) -> Any:
        """Return kinetic energy, potential energy above the hinge's height, and spring energy, J.

        Angles, rad, and rates, rad/s, have one shape; `up` is the direction against gravity, (2,).
        """
        x, y = self.moment
        sine, cosine = np.sin(angle), np.cos(angle)
        lifted = gravity * (up[0] * (x * cosine - y * sine) + up[1] * (x * sine + y * cosine))
        return 0.5 * self.inertia * rate**2, lifted, 0.5 * self.spring * (angle - self.rest) ** 2


@dataclass(frozen=True)
class Mover:
    """A surface that shakes, travels and turns about its pivot, or hangs on a hinge there."""

    surface: int  # index into `Machine.surfaces`
    pivot: tuple[float, float]  # m; as written
    by: tuple[float, float]  # m; amplitude of its shaking ...
    frequency: float  # ... Hz, 0 if it does not ...
    phase: float  # ... and its phase at t = 0, rad
    way: tuple[float, float]  # m; how far it travels ...
    start: float  # ... s; from then on ...
    lasts: float  # ... and for so long, 0 if it does not
    turn: float  # rad/s, counterclockwise
    hinge: Hinge | None = None  # its hinge, if it has one; then it has no other motion
    begins: float = 0.0  # s; start of the motion, from which its times count

    @classmethod
    def of(cls, row: Any) -> Self:
        """Return the mover of a row of the core's `Mover`."""
        told: dict[str, Any] = {name: tuple(row[name].tolist()) for name in ("pivot", "by", "way")}
        told |= {name: float(row[name]) for name in ("frequency", "phase", "lasts", "turn")}
        if row["inertia"] > 0.0:
            pairs = ("moment", "stops", "motor")
            ones = ("inertia", "spring", "rest", "damper", "mass", "gyration")
            found: dict[str, Any] = {name: tuple(row[name].tolist()) for name in pairs}
            told["hinge"] = Hinge(**found | {name: float(row[name]) for name in ones})
        return cls(surface=int(row["surface"]), start=float(row["from"]), **told)

    @classmethod
    def steered(cls, surface: int, pivot: tuple[float, float]) -> Self:
        """Return the mover of a plate that is turned by hand."""
        none = (0.0, 0.0)
        hinge = Hinge(0.0, none, 0.0, 0.0, 0.0, (-inf, inf), none, steered=True)
        return cls(surface, pivot, none, 0.0, 0.0, none, 0.0, 0.0, 0.0, hinge)

    def swung(self, swings: NDArray[Any]) -> Mover:
        """Return the mover with its own states among all states, (k,) of `SWING`."""
        if self.hinge is None:
            return self
        own = swings[swings["surface"] == self.surface]
        return replace(self, hinge=replace(self.hinge, states=own))

    @property
    def rests(self) -> float:
        """Time from which it stays at rest, s; inf if never."""
        endless = self.hinge or self.turn or (self.frequency and any(self.by))
        return inf if endless else self.begins + self.start + self.lasts

    def back(self, t: float) -> Floats:
        """Return the matrix, (2, 2), that turns directions at a time (s) back to rest."""
        angle = self.pose(t)[2]
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, s], [-s, c]])

    def tell(self, row: Any) -> None:
        """Fill in a row of the core's `Mover`."""
        own = dict(vars(self))
        hinge = own.pop("hinge")
        own |= {} if hinge is None else vars(hinge)
        own.pop("states", None)
        for name, number in own.items():
            row["from" if name == "start" else name] = number

    def pose(self, times: ArrayLike) -> Floats:
        """Return x and y (m) of the pivot and the angle it has turned by (rad) at times (s).

        For times (T,) it is (T, 3). It travels with a constant acceleration up to the middle, and
        with the opposite one from there on.
        """
        now = np.asarray(times, dtype=np.float64)
        t = np.maximum(now - self.begins, 0.0)
        swing = np.sin(2.0 * pi * self.frequency * t + self.phase)
        u = ((t - self.start) / self.lasts).clip(0.0, 1.0) if self.lasts else np.zeros_like(t)
        share = np.where(u < 0.5, 2.0 * u * u, 1.0 - 2.0 * (1.0 - u) ** 2)
        x, y = (self.pivot[n] + self.by[n] * swing + self.way[n] * share for n in (0, 1))
        return np.stack([x, y, self.hinge.at(now)[0] if self.hinge else self.turn * t], axis=-1)

    def velocity(self, times: ArrayLike) -> Floats:
        """Return the rates of `pose`: m/s, m/s and rad/s, (T, 3) for times (T,), s."""
        now = np.asarray(times, dtype=np.float64)
        t, moves = np.maximum(now - self.begins, 0.0), now >= self.begins
        rate = 2.0 * pi * self.frequency
        swing = rate * np.cos(rate * t + self.phase)
        pace = np.zeros_like(t)
        if self.lasts:
            u = (t - self.start) / self.lasts
            pace = 4.0 * np.minimum(u, 1.0 - u).clip(0.0) / self.lasts
        x, y = (self.by[n] * swing + self.way[n] * pace for n in (0, 1))
        turn = self.hinge.at(now)[1] if self.hinge else moves * self.turn
        return np.stack([moves * x, moves * y, turn], axis=-1)

    def velocity_at(self, place: ArrayLike, t: float) -> Floats:
        """Return the velocity, m/s, (2,), of its point at `place`, (2,), m, at the time `t`, s.

        It is that of the pivot and ω x r, r from the pivot to the place.
        """
        (x, y, _), (vx, vy, omega) = self.pose(t), self.velocity(t)
        px, py = np.asarray(place)
        return np.array([vx - omega * (py - y), vy + omega * (px - x)])

    def carried(self, places: ArrayLike, times: ArrayLike) -> Floats:
        """Return the positions at times (...,), s, of points (..., 2) given as written, m."""
        pose, off = self.pose(times), np.asarray(places) - np.array(self.pivot)
        c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
        x = pose[..., 0] + c * off[..., 0] - s * off[..., 1]
        return np.stack([x, pose[..., 1] + s * off[..., 0] + c * off[..., 1]], axis=-1)

    def at_rest(self, places: ArrayLike, times: ArrayLike) -> Floats:
        """Return the points as written that are at places (..., 2), m, at times (...,), s."""
        pose = self.pose(times)
        off, c, s = np.asarray(places) - pose[..., :2], np.cos(pose[..., 2]), np.sin(pose[..., 2])
        x = self.pivot[0] + c * off[..., 0] + s * off[..., 1]
        return np.stack([x, self.pivot[1] - s * off[..., 0] + c * off[..., 1]], axis=-1)
