"""`build`: a scene, or a family of them, as a machine.

The core lays the surfaces. Where the nominal particle (no spread, lowest layer) meets the unbounded
line of the plate gives the height of the outgoing belt, and that the lower end of the plate. A
release that overlaps a surface is refused, or moved out where it is by rounding only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, inf, prod
from sys import float_info
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from chutelab.core.module import constants
from chutelab.machine.parts import Arcs, Caution, Machine, Particle, Pulley, Segments, Thread
from chutelab.machine.releases import Releases, draw
from chutelab.machine.rows import lay
from chutelab.scene import Fault, Scene, SceneError
from chutelab.scene.conflicts import ON_BELT
from chutelab.scene.units import polygon_moment
from chutelab.util.arrays import Bools, Floats, Ints, Numbers, Watch, unwatched
from chutelab.util.trig import RADIANS, hypot


class RefusedError(SceneError):
    """Scenes of a family that contradict themselves; its faults are those of the first one.

    Parameters
    ----------
    source : str
        What messages call the scenes.
    members : mapping of int to Fault
        What is wrong with each, by their numbers; a scene that is no family is number 0.
    """

    def __init__(self, source: str, members: Mapping[int, Fault]) -> None:
        super().__init__(source, [members[min(members)]])
        self.members = dict(members)


ROUNDING = 64.0 * float_info.epsilon
"""Share of the largest coordinate by which a contact may seem to overlap: the engines see to it."""


def _on_segment(places: Floats, ends: Floats) -> Floats:
    """Return the nearest points of a segment, (4,) or (4, N): x0, y0, x1, y1, (2, n), m."""
    x0, y0, x1, y1 = ends
    (x, y), dx, dy = places.T, x1 - x0, y1 - y0
    square = dx * dx + dy * dy
    along = (x - x0) * dx + (y - y0) * dy
    share = np.clip(along / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return np.stack([x0 + share * dx, y0 + share * dy])


def _when(pieces: Segments | Arcs, n: int) -> tuple[int, float, float]:
    """Return whose a piece is, and from when to when it is there, s."""
    return pieces.surface[n].item(), pieces.appears[n].item(), pieces.vanishes[n].item()


@dataclass(frozen=True, eq=False)
class _Room:
    """Where disks may be released: not in a surface that is there then."""

    scene: Scene
    names: Sequence[str]
    ends: Floats  # (4, S) or (4, S, N): x0, y0, x1, y1 of the segments, m
    segments: Segments
    arcs: Arcs

    def surfaces(self, low: Floats, high: Floats) -> Iterator[tuple[int, float, float, Any]]:
        """Yield what may reach into a box (m): whose, from when to when, and its nearest points."""
        a, b = self.ends[:2], self.ends[2:]
        beside = (np.maximum(a, b) > low[:, None]) & (np.minimum(a, b) < high[:, None])
        near = beside[0] & beside[1]
        for n in near.any(axis=(*range(1, near.ndim),)).nonzero()[0].tolist():
            yield (*_when(self.segments, n), partial(_on_segment, ends=self.ends[:, n]))
        if not len(self.arcs.surface):
            return
        center, reach = np.moveaxis(self.arcs.center, -1, 0), self.arcs.radius
        # Rounding must not leave one out that just touches.
        reach = reach + ROUNDING * (np.abs(center).max(axis=0, initial=0.0) + reach)
        beside = (center + reach > low[..., None]) & (center - reach < high[..., None])
        near = beside[0] & beside[1]
        for n in near.any(axis=(*range(near.ndim - 1),)).nonzero()[0].tolist():
            yield (*_when(self.arcs, n), partial(self.arcs.nearest, n))

    @property
    def wheels(self) -> list[tuple[str, Floats, Numbers]]:
        """Pulleys, which are solid: whose, axis (2, 1) and radius, m."""
        belt = self.scene.incoming
        found: list[tuple[str, Floats, Numbers]] = []
        if belt is not None:
            found.append(("incoming", np.zeros((2, 1)), belt.pulley_radius))
        axes = ((one, axis) for one in self.scene.conveyor for axis in (one.from_, one.to))
        found += [(one.name, np.array(axis)[:, None], one.pulley_radius) for one, axis in axes]
        return found

    def clear(self, places: Floats, radius: float) -> Bools:
        """Tell which places (n, 2), m, a disk (m) can be in."""
        free = np.ones(len(places), dtype=bool)
        if not len(places):
            return free
        for *_, nearest in self.surfaces(places.min(axis=0) - radius, places.max(axis=0) + radius):
            free &= hypot(*(places.T - nearest(places))) >= radius
        for _, axis, wheel in self.wheels:
            free &= hypot(*(places.T - axis)) >= wheel + radius
        return free

    def cleared(self, releases: Releases, radius: Numbers, watch: Watch) -> Releases:
        """Return releases of which none lies in a surface, or raise a `RefusedError`.

        One less than `ON_BELT` inside, as one written with ten digits may be, is moved out.
        """
        # Copied, for its minima are found ten times as fast where they lie side by side.
        places = releases.position.T.copy()
        low, high = places - radius, places + radius
        if not self.scene.shape:
            low, high = np.minimum.reduce(low, axis=1), np.maximum.reduce(high, axis=1)
        belt, walks = self.scene.incoming, ~releases.carried
        others = np.count_nonzero(walks) > 0
        for surface, appears, vanishes, nearest in self.surfaces(low, high):
            watch()
            onto = surface == 0 and belt is not None
            if onto and not others:
                continue
            there = (appears <= releases.t) & (releases.t < vanishes)
            if onto:
                there &= walks
            if np.count_nonzero(there):
                releases = self.out(releases, nearest, radius, there, self.names[surface])
        for name, axis, wheel in self.wheels:
            who = walks if name == "incoming" else np.ones_like(walks)
            if np.count_nonzero(who):
                # A point may start anywhere.
                reach = np.where(np.greater(radius, 0.0), wheel + radius, 0.0)
                releases = self.out(releases, lambda _, axis=axis: axis, reach, who, name)
        return releases

    def out(
        self, releases: Releases, nearest: Any, reach: Numbers, who: Bools, name: str
    ) -> Releases:
        """Return releases of which those told are at least `reach` (m) away from a surface."""
        scene, places = self.scene, releases.position
        points = nearest(places)
        away = places.T - points
        distance = hypot(*away)
        for kind, particle in enumerate(scene.particles):
            # A box reaches as far as its furthest corner that way.
            boxes = (releases.kind == kind).nonzero()[0] if particle.outline else []
            if len(boxes):
                towards = np.array(particle.outline) @ (-away[:, boxes] / distance[boxes])
                reach = np.array(np.broadcast_to(reach, distance.shape))
                reach[boxes] += towards.max(axis=0) - particle.radius
        depth = np.where(who, reach - distance, -inf)
        rounding = ROUNDING * np.maximum(np.abs(points).max(axis=0), np.abs(places).max(axis=1))
        inside = np.flatnonzero(depth > np.maximum(ON_BELT, rounding))
        if len(inside):
            every = len(depth) // prod(scene.shape)
            deepest = {i // every: i for i in sorted(inside.tolist(), key=depth.__getitem__)}
            reach = np.broadcast_to(reach, depth.shape)
            faults = {}
            for member, i in deepest.items():
                number = int(releases.stream[i])
                key = f"stream[{number}].at" if len(scene.streams) > 1 else "stream.at"
                allowed = (
                    f"at least {reach[i]:g} m from {name}: particle {i % every} would start"
                    f" {distance[i]:.6g} m from it, inside; move {key}, or the surface"
                )
                faults[member] = Fault(key, scene.streams[number].at, allowed)
            raise RefusedError(scene.source, faults)
        if not np.any(depth > rounding):
            return releases
        shift = np.where(depth > rounding, away * (depth / distance), 0.0)
        return replace(releases, position=places + shift.T)


def build(scene: Scene, watch: Watch = unwatched) -> Machine:
    """Resolve a validated scene, or a family of them.

    Parameters
    ----------
    scene : Scene
        Of a family (`chutelab.scene.variants`) each is resolved as it would be by itself; the
        machine has one particle for each, with surfaces of its own.
    watch : callable, optional
        Called now and then while particles are given their places, which may take long; what it
        raises ends the building.

    Raises
    ------
    RefusedError
        If the geometry contradicts itself: the nominal flight misses the plate whose impact should
        place the outgoing belt, the impact lies off the finite plate, or a particle starts inside a
        surface.
    """
    names, meeting = scene.surfaces, scene.meetings()
    kinds = range(1 if scene.shape else len(scene.particles))
    met = [[_with_grip(*meeting(kind, name)) for kind in kinds] for name in names]
    laid = lay(scene, meeting(scene.kinds[0], names[0])[1] if scene.incoming is not None else inf)
    warnings = _judged(scene, laid.nominal)
    segments = _pieces(Segments, laid.segments, scene, met)
    arcs = _pieces(Arcs, laid.arcs, scene, met) if laid.arcs.size else NO_ARCS
    belt, until, particles = scene.incoming, scene.run.until, scene.particles
    ends = np.concatenate([laid.segments["start"].T, laid.segments["end"].T])
    room = _Room(scene, names, ends, segments, arcs)
    releases, radius = draw(scene, room.clear, watch)
    particle = _particle(scene, releases.kind, radius)
    releases = room.cleared(releases, particle.radius, watch)
    bound = releases.t.max().item() + scene.run.max_time
    pulley = None
    if belt is not None:
        bounce, grip = zip(*met[0], strict=True)
        pulley = Pulley(
            radius=belt.pulley_radius,
            speed=belt.speed,
            friction=np.array(grip) if len(grip) > 1 else grip[0],
            restitution=np.array(bounce) if len(grip) > 1 else bounce[0],
            surface=0,
            incline=belt.incline_deg * RADIANS,
        )
    every = range(len(particles))
    pairs = np.array([[meeting(a, b) for b in every] for a in every])
    return Machine(
        scene=scene,
        surfaces=names,
        gravity=scene.gravity,
        particle=particle,
        segments=segments,
        arcs=arcs,
        pulley=pulley,
        releases=releases,
        landing=names.index("outgoing") if "outgoing" in names else -1,
        until=until if isinstance(until, str) else "time",
        end_time=bound if isinstance(until, str) else np.minimum(bound, until),
        dt=scene.run.dt,
        align=scene.run.align,
        interact=scene.crowded,
        pair_restitution=pairs[..., 0],
        pair_friction=pairs[..., 1],
        rolling=np.array([kind.rolling_friction for kind in particles]),
        outlines=tuple(np.array(kind.outline) if kind.outline else None for kind in particles),
        threads=_threads(scene, releases),
        streams=tuple(str(stream.name) for stream in scene.streams),
        engine=scene.run.engine,
        plate_warnings=warnings,
    )


Met = Sequence[Sequence[tuple[Any, Any]]]
"""Restitution and friction of each surface with each kind of particles; numbers or arrays (N,)."""

Some = TypeVar("Some", Segments, Arcs)


def _pieces(kind: type[Some], rows: NDArray[Any], scene: Scene, met: Met) -> Some:
    """Return segments or arcs of their rows, (S,) or of a family (N, S)."""
    known = [name for name in kind.__dataclass_fields__ if name in (rows.dtype.names or ())]
    own = {name: rows[name] for name in known}
    if scene.shape:
        # Those of all members lie side by side; they are there at the same times.
        own = {name: array.T.copy().T for name, array in own.items()}
        own |= {name: own[name][0] for name in ("surface", "appears", "vanishes")}
    surface = own["surface"].astype(np.int64)
    kinds = 1 if scene.shape else len(scene.particles)
    values = np.empty((2, len(met), kinds, *scene.shape))
    for number, pairs in enumerate(met):
        for n, pair in enumerate(pairs):
            values[0, number, n], values[1, number, n] = pair
    values = values[:, surface]
    restitution, friction = values[:, :, 0] if kinds == 1 else values
    return kind(**own | {"surface": surface}, restitution=restitution.T, friction=friction.T)


_NOTHING = np.empty(0)
NO_ARCS = Arcs(
    center=np.empty((0, 2)),
    radius=_NOTHING,
    begin=_NOTHING,
    extent=_NOTHING,
    speed=_NOTHING,
    restitution=_NOTHING,
    friction=_NOTHING,
    surface=np.empty(0, dtype=np.int64),
    appears=_NOTHING,
    vanishes=_NOTHING,
)
"""Of a machine of straight surfaces only."""


def _particle(scene: Scene, kind: Ints, radius: Floats | None) -> Particle:
    """Return the particles: numbers if all are alike, else arrays (N,)."""
    masses, inertias = [], []
    for one in scene.particles:
        masses.append(one.mass)
        turning = one.moment * one.mass * (one.radius * one.radius)
        if one.outline:
            turning = one.mass * polygon_moment(one.outline) if one.spin else 0.0
        inertias.append(turning)
    if radius is None and (len(masses) == 1 or len({*zip(masses, inertias, strict=True)}) == 1):
        return Particle(scene.particle.radius, masses[0], inertias[0])
    nominal = np.array([one.radius for one in scene.particles])[kind]
    radius = nominal if radius is None else radius
    size = radius / nominal
    # Powers of libraries differ in the last bit.
    square = size * size
    cube = square * size
    mass, inertia = np.array(masses)[kind], np.array(inertias)[kind]
    return Particle(radius, mass * cube, inertia * (cube * square))


def _threads(scene: Scene, releases: Releases) -> tuple[Thread, ...]:
    threads = []
    for string in scene.string:
        x, y = releases.position[string.particle].tolist()
        reach = hypot(x - string.from_[0], y - string.from_[1])
        threads.append(Thread(string.from_, string.particle, string.length or reach))
    return tuple(threads)


def _judged(scene: Scene, nominal: NDArray[Any]) -> tuple[Caution, ...]:
    """Return what may surprise about the plate; raise if the geometry contradicts itself."""
    plate, members = scene.plate, nominal.reshape(-1)
    faults = {
        n: _fault(scene, members[n], n) for n in members["contradiction"].nonzero()[0].tolist()
    }
    if faults:
        raise RefusedError(scene.source, faults)
    if plate is None:
        return ()
    found = []
    if np.count_nonzero(np.isnan(members["hit"])):
        found.append(Caution("plate"))
    off = members["off"].nonzero()[0]
    if len(off):
        found.append(Caution("plate", hit=members["along"][off[0]].item()))
    return tuple(found)


def _fault(scene: Scene, nominal: Any, member: int) -> Fault:
    """Return in words what is wrong with the geometry of a scene, or a member of a family."""
    kinds, plate = constants("Contradiction"), scene.plate
    if nominal["contradiction"] == kinds["NO_IMPACT"]:
        text = (
            "the nominal particle never meets the plate, so there is no impact to measure from;"
            ' set outgoing.drop_from = "top"'
        )
        return Fault("outgoing.drop_from", "impact", text)
    assert plate is not None
    above = np.broadcast_to(plate.above, scene.shape).flat[member].item()
    if nominal["contradiction"] == kinds["NO_LENGTH"]:
        return Fault("plate.above", above, "above + below must be more than 0 m")
    hit = nominal["along"].item()
    allowed = (
        f"{Caution('plate', hit=hit).text}: lengthen it to at least"
        f' {ceil(1e4 * abs(hit)) / 1e4:g} m, or set outgoing.drop_from = "top"'
    )
    if nominal["contradiction"] == kinds["HIT_ABOVE"]:
        return Fault("plate.above", above, allowed)
    return Fault("plate.below", nominal["below"].item(), allowed)


def _with_grip(restitution: Any, friction: Any) -> tuple[Any, Any]:
    """Return restitution and friction, where adhesion is friction without a bound."""
    return restitution, inf if isinstance(friction, str) else friction
