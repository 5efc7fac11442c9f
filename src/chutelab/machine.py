"""A scene resolved to world-frame arrays: what both engines take, and all they take.

Geometry is settled here once, for the nominal particle (particle 0: no spread, lowest layer): where
it meets the unbounded line of the plate, from that the height of the outgoing belt, from that the
lower end of the plate.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import cos, inf, radians, sin
from typing import TYPE_CHECKING, Literal

import numpy as np

from chutelab.nominal import Discharge, discharge, plate_hit
from chutelab.recording import Particle
from chutelab.releases import Releases, draw
from chutelab.scene import Fault, SceneError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.scene import Scene


EXIT_MARGIN = 1.0
"""m below the lowest surface, or outside the box of all without gravity, where a track ends."""

REACH_WITHOUT_BELT = 2.0
"""m of plate below the pivot where there is no outgoing belt to stop short of."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Straight two-sided surfaces, world frame, SI units.

    Arrays have shape (S,) or (S, 2); or (N, S) and (N, S, 2) where each particle has its own.

    Attributes
    ----------
    start, tangent : ndarray, (..., S, 2)
        First end, and unit vector towards the second.
    length, speed, restitution, friction : ndarray, (..., S)
        Length (m), speed of the surface along the tangent (m/s), pair values with a particle.
    surface : ndarray, (S,)
        Index of the surface a segment belongs to, into `Machine.surfaces`.
    """

    start: NDArray[np.float64]
    tangent: NDArray[np.float64]
    length: NDArray[np.float64]
    speed: NDArray[np.float64]
    restitution: NDArray[np.float64]
    friction: NDArray[np.float64]
    surface: NDArray[np.int64]

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.flags.writeable = False

    @property
    def end(self) -> NDArray[np.float64]:
        """Second end, (..., S, 2), m."""
        return self.start + self.length[..., None] * self.tangent


@dataclass(frozen=True)
class Pulley:
    """The drive pulley, axis at the origin, turning clockwise (its top moves forward).

    The incoming belt is segment 0 of the machine and ends on its top.

    Attributes
    ----------
    radius, speed : float
        R (m), speed of the surface (m/s).
    friction, restitution : float
        Pair values; friction is inf with adhesion.
    surface : int
        Index into `Machine.surfaces`.
    """

    radius: float
    speed: float
    friction: float
    restitution: float
    surface: int


@dataclass(frozen=True, eq=False)
class Machine:
    """Everything an engine needs to run.

    Attributes
    ----------
    title, scene : str
        Title and canonical JSON of the scene, passed on to the recording.
    surfaces : tuple of str
        Names; several segments, or a segment and the pulley, may share one.
    gravity : float
        m/s², pointing down.
    particle : Particle
        Radius, mass, inertia (0 unless it may spin).
    segments : Segments
        All straight surfaces; the incoming belt is the first if there is one.
    pulley : Pulley or None
        None without an incoming conveyor.
    releases : Releases
        Where, when and how fast each particle starts; which of them ride by adhesion.
    landing : int
        Surface index of the outgoing belt, -1 without one.
    until : {"landed", "settled", "time"}
        When a particle's track ends.
    end_time : float
        s; no track goes on after it.
    dt : float
        s; longest step of the pymunk engine.
    interact : bool
        Whether particles meet each other.
    pair_restitution, pair_friction : float
        Of two particles.
    engine : {"auto", "exact", "pymunk"}
        What the scene asks for.
    warnings : tuple of str
        What `chutelab check` tells about a machine that works but may surprise.
    """

    title: str
    scene: str
    surfaces: tuple[str, ...]
    gravity: float
    particle: Particle
    segments: Segments
    pulley: Pulley | None
    releases: Releases
    landing: int
    until: Literal["landed", "settled", "time"]
    end_time: float
    dt: float
    interact: bool
    pair_restitution: float
    pair_friction: float
    engine: str
    warnings: tuple[str, ...]

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.releases.t)

    @property
    def exit_box(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top (m) beyond which a particle has left the scene.

        With gravity only the bottom is finite: what flies up comes back.
        """
        ends = np.concatenate([self.segments.start, self.segments.end], axis=-2).reshape(-1, 2)
        if self.pulley is not None:
            corner = np.full(2, self.pulley.radius)
            ends = np.concatenate([ends, [-corner, corner]])
        if not len(ends):
            ends = self.releases.position
        low, high = ends.min(axis=0) - EXIT_MARGIN, ends.max(axis=0) + EXIT_MARGIN
        if self.gravity > 0.0:
            return -inf, inf, float(low[1]), inf
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def build(scene: Scene) -> Machine:
    """Resolve a validated scene.

    Raises
    ------
    SceneError
        If the geometry contradicts itself: the nominal flight misses the plate whose impact should
        place the outgoing belt, the impact lies off the finite plate, or interacting particles
        cannot be released without overlap.
    """
    builder = _Builder(scene)
    start = discharge(scene)
    belt_height = builder.incoming_and_plate(start)
    if scene.outgoing is not None and belt_height is not None:
        out = scene.outgoing
        builder.add(
            "outgoing",
            [(out.start, belt_height), (out.start + out.length, belt_height)],
            out.speed,
            out.restitution,
            out.friction,
        )
    for free in scene.surface:
        builder.add(free.name, free.points, free.speed, free.restitution, free.friction)
    return builder.machine()


class _Builder:
    """Collects surfaces; one short-lived object per `build`."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.names: list[str] = []
        self.rows: list[tuple[float, ...]] = []
        self.owner: list[int] = []
        self.warnings: list[str] = []

    def add(
        self,
        name: str,
        points: list[tuple[float, float]] | tuple[tuple[float, float], ...],
        speed: float,
        restitution: float,
        friction: float,
    ) -> None:
        self.names.append(name)
        for (x0, y0), (x1, y1) in pairwise(points):
            self.rows.append((x0, y0, x1, y1, speed, restitution, friction))
            self.owner.append(len(self.names) - 1)

    def incoming_and_plate(self, start: Discharge | None) -> float | None:
        """Add the belt and the plate; return the height of the outgoing belt's surface."""
        scene = self.scene
        if scene.incoming is None:
            return None
        belt = scene.incoming
        top = belt.pulley_radius
        grip = inf if belt.friction == "adhesion" else float(belt.friction)
        self.add("incoming", [(-belt.length, top), (0.0, top)], belt.speed, belt.restitution, grip)
        plate, out, r = scene.plate, scene.outgoing, scene.particle.radius
        hit = plate_hit(scene, start) if plate is not None and start is not None else None
        height: float | None = None
        if out is not None and out.drop_from == "top":
            height = top - out.drop
        elif out is not None:
            if hit is None:
                raise self._fault(
                    "outgoing.drop_from",
                    "impact",
                    "the nominal particle never meets the plate, so there is no impact to measure"
                    ' from; set outgoing.drop_from = "top"',
                )
            height = hit[1] - out.drop - r
        if plate is None:
            return height
        alpha = radians(plate.angle_deg)
        up = np.array([-sin(alpha), cos(alpha)])
        pivot = np.array([top + plate.distance, float(plate.pivot_height or 0.0)])
        if plate.below is not None:
            below = plate.below
        elif height is None:
            below = REACH_WITHOUT_BELT
        else:
            below = max(0.0, (pivot[1] - height - max(0.05, 3.0 * r)) / cos(alpha))
        low, high = pivot - below * up, pivot + plate.above * up
        if below + plate.above <= 0.0:
            raise self._fault("plate.above", plate.above, "above + below must be more than 0 m")
        # Upwards, so that the struck face (-cos α, -sin α) lies to the left of the tangent.
        self.add("plate", [tuple(low), tuple(high)], 0.0, plate.restitution, plate.friction)
        self._check_hit(hit, pivot, up, below)
        self._warn_crossings(low, high, height)
        return height

    def _check_hit(
        self,
        hit: NDArray[np.float64] | None,
        pivot: NDArray[np.float64],
        up: NDArray[np.float64],
        below: float,
    ) -> None:
        scene = self.scene
        assert scene.plate is not None
        if hit is None:
            self.warnings.append("plate: the nominal particle never meets the plate's line")
            return
        along = float((hit - pivot) @ up)
        if -below <= along <= scene.plate.above:
            return
        where = (
            f"the nominal particle meets the plate's line {abs(along):.4g} m"
            f" {'above' if along > 0 else 'below'} the pivot"
        )
        if scene.outgoing is not None and scene.outgoing.drop_from == "impact":
            key = "plate.above" if along > 0 else "plate.below"
            value = scene.plate.above if along > 0 else below
            raise self._fault(
                key,
                value,
                f"{where}, off the finite plate: lengthen it to at least {abs(along):.4g} m,"
                ' or set outgoing.drop_from = "top"',
            )
        self.warnings.append(f"plate: {where}, off the finite plate")

    def _warn_crossings(
        self, low: NDArray[np.float64], high: NDArray[np.float64], height: float | None
    ) -> None:
        assert self.scene.incoming is not None
        radius = self.scene.incoming.pulley_radius
        along = high - low
        share = np.clip(-(low @ along) / (along @ along), 0.0, 1.0)
        if np.hypot(*(low + share * along)) < radius:
            self.warnings.append("plate: it crosses the drive pulley; the first contact wins")
        if height is not None and height > -radius:
            self.warnings.append(
                f"outgoing: the belt (y = {height:.4g} m) lies above the bottom of the drive"
                " pulley; surfaces cross, the first contact wins"
            )

    def _fault(self, key: str, value: object, allowed: str) -> SceneError:
        return SceneError(self.scene.source, [Fault(key, value, allowed)])

    def machine(self) -> Machine:
        scene = self.scene
        rows = np.array(self.rows, dtype=np.float64).reshape(-1, 7)
        along = rows[:, 2:4] - rows[:, 0:2]
        length = np.hypot(along[:, 0], along[:, 1])
        particle = Particle(
            radius=scene.particle.radius,
            mass=scene.particle.mass,
            inertia=0.5 * scene.particle.mass * scene.particle.radius**2
            if scene.particle.spin
            else 0.0,
        )
        pulley = None
        if scene.incoming is not None:
            belt = scene.incoming
            grip = inf if belt.friction == "adhesion" else float(belt.friction)
            pulley = Pulley(belt.pulley_radius, belt.speed, grip, belt.restitution, 0)
        releases = draw(scene)
        bound = float(releases.t[-1]) + scene.run.max_time
        timed = not isinstance(scene.run.until, str)
        return Machine(
            title=scene.title,
            scene=scene.model_dump_json(by_alias=True),
            surfaces=tuple(self.names),
            gravity=scene.gravity,
            particle=particle,
            segments=Segments(
                start=rows[:, 0:2].copy(),
                tangent=along / length[:, None],
                length=length,
                speed=rows[:, 4].copy(),
                restitution=rows[:, 5].copy(),
                friction=rows[:, 6].copy(),
                surface=np.array(self.owner, dtype=np.int64),
            ),
            pulley=pulley,
            releases=releases,
            landing=self.names.index("outgoing") if "outgoing" in self.names else -1,
            until="time" if timed else scene.run.until,
            end_time=min(bound, float(scene.run.until)) if timed else bound,
            dt=scene.run.dt,
            interact=scene.stream.interact and scene.stream.count > 1,
            pair_restitution=scene.stream.restitution,
            pair_friction=scene.stream.friction,
            engine=scene.run.engine,
            warnings=tuple(self.warnings),
        )
