"""`Machine` and its parts: what the engines take, and all they take.

Also here: a place near the machine to count positions from, since far from the world's origin
coordinates have few digits left.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, inf, isnan, log2, nan, pi
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chutelab.machine.movers import Mover
from chutelab.machine.releases import Releases
from chutelab.machine.shapes import Arcs, Pieces, Segments, crossings
from chutelab.scene import Scene
from chutelab.scene.variants import Family
from chutelab.util.arrays import RADIANS, Floats, Watch, sin_cos, unwatched

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
        """Return some of the particles, by their numbers."""
        own = (value[index] if np.ndim(value) else value for value in vars(self).values())
        return Particle(*own)

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
    anchor: tuple[float, float] | None  # m; of a pin where it is at the release
    other: int = -1  # the other particle
    stiffness: float = 0.0  # N/m
    damper: float = 0.0  # N s/m

    def ends(self, positions: Floats) -> Floats:
        """Return both ends, (..., 2, 2), where particles are at `positions` (..., N, 2)."""
        own = positions[..., self.particle, :]
        far = np.broadcast_to(self.anchor or nan, own.shape)
        far = positions[..., self.other, :] if self.other >= 0 else far
        return np.stack([far, own], axis=-2)


class Trigger(NamedTuple):
    """What a surface does when another one is touched for the first time."""

    surface: int  # index into `Machine.surfaces`
    doing: str  # opens, closes or starts
    by: int  # which surface is to be touched


EARTH = 9.81
"""m/s²; gravity for which engines' bounds on speeds and times are written, see `Machine.pace`."""


@dataclass(frozen=True, eq=False, repr=False)
class Machine:
    """Everything an engine needs to run.

    A family of machines, a copy of one for each particle, is one machine in which surfaces,
    gravity, radius and mass of the particle, the pulley's numbers and the end time have a value for
    each, (N,).

    One that `is_ahead` has only what needs no geometry, and `build`; the rest is built when it is
    first asked for. An engine that has the core build it never asks.
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
    end_time: float  # s; no track goes on after it
    dt: float  # s; step of lasting contacts (contact), longest step (pymunk)
    align: bool  # whether the pymunk engine's steps of a lone particle end at contacts; not in air
    interact: bool  # whether particles meet each other
    pair_restitution: Floats  # (K, K), of two particles by their kinds; below 0: they never meet
    pair_friction: Floats
    rolling: Floats  # (K,), rolling friction of a kind on everything: its arm over the radius
    cohesion: Floats  # (K, K + S), N; pulls a kind to another, and to a surface
    outlines: tuple[Floats | None, ...]  # (K); of boxes and polygons corners (n, 2)
    joints: tuple[Joint, ...]
    movers: tuple[Mover, ...]
    triggers: tuple[Trigger, ...]
    streams: tuple[str, ...]  # names; `Releases.stream` tells whose a particle is
    falls: Floats  # (K,), s/m: 1 over the speed up to which a kind's restitution is what it is
    engine: str  # what the scene asks for: "auto", "exact", "contact" or "pymunk"
    plate_warnings: tuple[Caution, ...]  # of a nominal particle that misses the plate

    @property
    def is_ahead(self) -> bool:
        """Whether it is not built yet."""
        return "releases" not in vars(self)

    def finish(self, watch: Watch = unwatched) -> None:
        """Build what is not built yet, see `chutelab.machine.build`."""
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

    @property
    def tilt(self) -> float:
        """By which gravity is turned from straight down, counterclockwise, rad."""
        return self.scene.gravity_deg * RADIANS

    @cached_property
    def up(self) -> Floats:
        """The direction against gravity, (2,)."""
        return np.array(sin_cos(-self.tilt))

    @cached_property
    def frame(self) -> Floats:
        """Unit vectors of a frame that is upright where gravity points down, rows, (2, 2)."""
        x, y = self.up
        return np.array([[y, -x], [x, y]])

    def height(self, position: Floats) -> Floats:
        """Return how high places (..., 2) are, (...), m: against gravity, from the origin."""
        found: Floats = self.up[0] * position[..., 0] + self.up[1] * position[..., 1]
        return found

    @cached_property
    def pace(self) -> Any:
        """What bounds on speeds are multiplied by, and bounds on times divided; (N,) of a family.

        √(g / 9.81 m/s²), and 1 without gravity: a run repeats if all its speeds are twice as high,
        all its times half as long, and gravity is four times as strong.
        """
        return np.sqrt(np.where(np.greater(self.gravity, 0.0), self.gravity, EARTH) / EARTH)

    @property
    def loads(self) -> float:
        """Width of the bins in which loads on surfaces are counted, s; 0 if they are not."""
        return 0.0 if self.family is not None else self.scene.run.loads or 0.0

    @property
    def stress(self) -> float:
        """Width of the bins in which lasting contacts are kept, s; 0 if they are not."""
        return 0.0 if self.family is not None else self.scene.run.stress or 0.0

    @cached_property
    def count(self) -> int:
        """Number of particles."""
        return len(self.releases.t)

    def mover(self, surface: int) -> Mover | None:
        """Return what moves a surface, by its index; None if it stays where it is."""
        return next((mover for mover in self.movers if mover.surface == surface), None)

    def when(self, times: Floats) -> Machine:
        """Return it with the times at which its triggers acted, s; inf of what still waits."""
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
        """Return what moves a plate, by its index, that is turned by hand about its pivot."""
        named = {plate.name or "plate": plate for plate in self.scene.plates}
        plate, belt = named[self.surfaces[surface]], self.scene.incoming
        pivot = plate.pivot
        if pivot is None:
            assert belt is not None
            pivot = belt.pulley_radius + plate.distance, plate.pivot_height
        return Mover.steered(surface, pivot)

    @property
    def parts(self) -> tuple[Segments, Arcs]:
        """All surfaces but the drive pulley, a kind of piece each."""
        return self.segments, self.arcs

    @property
    def last_gate(self) -> float:
        """When a surface comes, goes or moves for the last time, s; -inf if none does."""
        times = np.concatenate([[p.appears, p.vanishes] for p in self.parts], axis=1)
        rest = max((mover.rests for mover in self.movers), default=-inf)
        return max(rest, float(times[np.isfinite(times)].max(initial=-inf)))

    @property
    def corners(self) -> Floats:
        """Points round which the box of all segments and arcs goes, (..., C, 2), m."""
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
        """What `chutelab check` tells about a machine that works but may surprise."""
        crossed = crossings(len(self.surfaces), self.segments, self.arcs)
        said = [Caution(self.surfaces[b], self.surfaces[a]) for a, b in crossed]
        if self.pulley is not None:
            into = [part.surface[part.gap(np.zeros(2)) < self.pulley.radius] for part in self.parts]
            # The incoming belt, which lies on it, is surface 0.
            owners = np.setdiff1d(np.concatenate(into), [0])
            said += [Caution(self.surfaces[owner], DRIVE_PULLEY) for owner in owners]
        return (*self.plate_warnings, *said)


def upright(machine: Machine) -> Machine:
    """Return a machine that stays where it is, turned so that gravity is straight down."""
    frame = machine.frame.T
    segments, arcs, releases = machine.segments, machine.arcs, machine.releases
    return replace(
        machine,
        segments=replace(segments, start=segments.start @ frame, tangent=segments.tangent @ frame),
        arcs=replace(arcs, center=arcs.center @ frame, begin=arcs.begin - machine.tilt),
        releases=replace(
            releases,
            position=releases.position @ frame,
            velocity=releases.velocity @ frame,
        ),
    )


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
        joints=tuple(
            replace(joint, anchor=joint.anchor and (joint.anchor[0] + x, joint.anchor[1] + y))
            for joint in machine.joints
        ),
        movers=tuple(
            replace(mover, pivot=(mover.pivot[0] + x, mover.pivot[1] + y))
            for mover in machine.movers
        ),
    )
