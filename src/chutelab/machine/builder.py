"""`build`: the geometry of a scene, settled once for the nominal particle.

That is particle 0: no spread, lowest layer. Where it meets the unbounded line of the plate gives
the height of the outgoing belt, and that the lower end of the plate. A release that overlaps a
surface is refused, or moved out where it is by rounding only. A family of scenes becomes a family
of machines: NumPy's functions take a number and an array (N,) alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import ceil, inf, pi, prod
from sys import float_info
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chutelab.machine.nominal import plate_hit
from chutelab.machine.parts import Arcs, Caution, Machine, Particle, Pulley, Segments, Thread
from chutelab.machine.releases import Releases, draw, up_belt
from chutelab.scene import Conveyor, Fault, Plate, Scene, SceneError, Surface
from chutelab.scene.conflicts import ON_BELT
from chutelab.scene.units import polygon_moment
from chutelab.util.arrays import Bools, Floats, Ints, Numbers, Watch, unwatched
from chutelab.util.trig import RADIANS, hypot, sin_cos


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


REACH_WITHOUT_BELT = 2.0
"""m of plate below the pivot where there is no outgoing belt to stop short of."""

CLEARANCE = 0.05
"""m that the plate's lower end stays above the outgoing belt, at least."""

CLEARANCE_RADII = 3.0
"""The same in radii: a disk that lies on the belt passes under the plate, with one to spare."""


REACH_HANGING = 0.5
"""m of a further plate below its pivot."""

Point = tuple[Numbers, Numbers]
Line = tuple[Sequence[Point], Numbers]
"""A polyline (m), and the speed along it (m/s)."""

Bend = tuple[Numbers, Numbers, Numbers, Numbers, Numbers, Numbers]
"""An arc: centre x, y, radius (m), begin, extent (rad), clockwise speed (m/s), as `Arcs` has it."""


class Part(NamedTuple):
    """One surface of the machine: its lines and arcs, and when they are there, s."""

    name: str
    lines: Sequence[Line] = ()
    bends: Sequence[Bend] = ()
    gates: Sequence[tuple[float, float]] = ((-inf, inf),)


# A flight that never meets the plate's line has NaN for its impact.
@np.errstate(divide="ignore", invalid="ignore", over="ignore")
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
    parts, warnings = _conveyors(scene)
    lay: Any = {Plate: _hanging, Conveyor: _conveyor, Surface: _free}
    parts += [lay[type(table)](table) for table in scene.free]
    names = [part.name for part in parts]
    kinds, meeting = range(1 if scene.shape else len(scene.particles)), scene.meetings()
    met = [[_with_grip(*meeting(kind, name)) for kind in kinds] for name in names]
    lines: list[Piece] = []
    bends: list[Piece] = []
    for number, part in enumerate(parts):
        values = [value for row in zip(*met[number], strict=True) for value in row]
        for gate in part.gates:
            for points, speed in part.lines:
                lines += [(number, gate, (*a, *b, speed, *values)) for a, b in pairwise(points)]
            bends += [(number, gate, (*bend, *values)) for bend in part.bends]
    columns, common = _pieces(scene, lines, 5)
    along = columns[2:4] - columns[0:2]
    length = hypot(along[0], along[1])
    segments = Segments(
        start=columns[0:2].T,
        tangent=(along / length).T,
        length=length.T,
        speed=columns[4].T,
        **common,
    )
    arcs = _arcs(scene, bends) if bends else NO_ARCS
    belt, until, particles = scene.incoming, scene.run.until, scene.particles
    room = _Room(scene, names, columns[:4], segments, arcs)
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
        surfaces=tuple(names),
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
        plate_warnings=tuple(warnings),
    )


Piece = tuple[int, tuple[float, float], tuple[Any, ...]]
"""A segment or arc: its surface, when it is there (s), and its numbers; last restitution and then
friction of each kind of particles with it."""


def _pieces(scene: Scene, pieces: Sequence[Piece], count: int) -> tuple[Floats, dict[str, Any]]:
    """Return the first numbers of S pieces, (count, S), or of a family (count, S, N); and the rest.

    Of that restitution and friction are (S,), (K, S), or of a family (N, S).
    """
    kinds = 1 if scene.shape else len(scene.particles)
    columns = np.empty((count + 2 * kinds, len(pieces), *scene.shape))
    for n, (_, _, numbers) in enumerate(pieces):
        if not scene.shape:
            columns[:, n] = numbers
            continue
        for column, value in zip(columns, numbers, strict=True):
            column[n] = value
    appears, vanishes = np.array([gate for _, gate, _ in pieces]).reshape(-1, 2).T.copy()
    restitution, friction = columns[count : count + kinds], columns[count + kinds :]
    return columns[:count], {
        "restitution": restitution if kinds > 1 else restitution[0].T,
        "friction": friction if kinds > 1 else friction[0].T,
        "surface": np.array([owner for owner, _, _ in pieces], dtype=np.int64),
        "appears": appears,
        "vanishes": vanishes,
    }


def _arcs(scene: Scene, bends: Sequence[Piece]) -> Arcs:
    columns, common = _pieces(scene, bends, 6)
    return Arcs(
        center=columns[:2].T,
        radius=columns[2].T,
        begin=columns[3].T,
        extent=columns[4].T,
        speed=columns[5].T,
        **common,
    )


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


def _turned(x: Numbers, y: Numbers, alpha: Numbers, below: Numbers, above: Numbers) -> list[Point]:
    """Return the ends of a plate that hangs from a pivot (m), at an angle (rad) from upright."""
    # Upwards, so that the struck face (-cos α, -sin α) lies to the left of the tangent.
    sine, cosine = sin_cos(alpha)
    return [(x - reach * sine, y + reach * cosine) for reach in (-below, above)]


def _hanging(plate: Plate) -> Part:
    assert plate.pivot is not None
    below = REACH_HANGING if plate.below is None else plate.below
    ends = _turned(*plate.pivot, plate.angle_deg * RADIANS, below, plate.above)
    return Part(str(plate.name), [(ends, 0.0)])


def _conveyor(belt: Conveyor) -> Part:
    """Lay a belt round two pulleys: forward on top, which is clockwise to the right, and back."""
    (x0, y0), (x1, y1), r = belt.from_, belt.to, belt.pulley_radius
    way = hypot(x1 - x0, y1 - y0)
    dx, dy = (x1 - x0) / way, (y1 - y0) / way
    clockwise = 1.0 if dx >= 0.0 else -1.0
    nx, ny = -clockwise * dy * r, clockwise * dx * r
    top = [(x0 + nx, y0 + ny), (x1 + nx, y1 + ny)]
    back = [(x1 - nx, y1 - ny), (x0 - nx, y0 - ny)]
    speed = clockwise * belt.speed
    pulleys: list[Bend] = [(x, y, r, 0.0, 2.0 * pi, speed) for x, y in (belt.from_, belt.to)]
    return Part(belt.name, [(top, belt.speed), (back, belt.speed)], pulleys)


def _free(surface: Surface) -> Part:
    """Lay a free surface, with its copies and its gate."""
    shifts = [(0.0, 0.0)]
    for count, dx, dy in surface.repeat:
        shifts = [(x + n * dx, y + n * dy) for n in range(count) for x, y in shifts]
    opens, closes = surface.opens_at, surface.closes_at
    gates: list[tuple[float, float]]
    if opens is not None and closes is not None and opens < closes:
        gates = [(-inf, opens), (closes, inf)]
    else:
        gates = [(-inf if closes is None else closes, inf if opens is None else opens)]
    if surface.center is None:
        lines = [([(x + a, y + b) for x, y in surface.points], surface.speed) for a, b in shifts]
        return Part(surface.name, lines, gates=gates)
    assert surface.radius is not None
    (x, y), r = surface.center, surface.radius
    first, last = surface.from_deg * RADIANS, surface.to_deg * RADIANS
    speed = surface.speed if surface.to_deg < surface.from_deg else -surface.speed
    begin, extent = np.minimum(first, last), np.abs(last - first)
    bends = [(x + a, y + b, r, begin, extent, speed) for a, b in shifts]
    return Part(surface.name, bends=bends, gates=gates)


def _conveyors(scene: Scene) -> tuple[list[Part], list[Caution]]:
    """Return the belts and the plate, and what may surprise about the plate."""
    belt, plate, out, r = scene.incoming, scene.plate, scene.outgoing, scene.particle.radius
    if belt is None:
        return [], []
    top, (cosine, sine) = belt.pulley_radius, up_belt(scene)
    x, y = -top * sine, top * cosine
    ends: list[Point] = [(x - belt.length * cosine, y - belt.length * sine), (x, y)]
    parts = [Part("incoming", [(ends, belt.speed)])]
    warnings: list[Caution] = []
    hit = plate_hit(scene)
    missed = np.isnan(hit[1])
    height: Numbers | None = None  # of the outgoing belt's surface
    if out is not None and out.drop_from == "top":
        height = top - out.drop
    elif out is not None:
        text = (
            "the nominal particle never meets the plate, so there is no impact to measure from;"
            ' set outgoing.drop_from = "top"'
        )
        _refuse(scene, missed, "outgoing.drop_from", "impact", lambda _: text)
        height = hit[1] - out.drop - r
    if plate is not None:
        alpha = plate.angle_deg * RADIANS
        sine, cosine = sin_cos(alpha)
        x, y = top + plate.distance, plate.pivot_height
        below: Numbers = REACH_WITHOUT_BELT
        if plate.below is not None:
            below = plate.below
        elif height is not None:
            lowest = height + np.maximum(CLEARANCE, CLEARANCE_RADII * r)
            below = np.maximum((y - lowest) / cosine, 0.0)
        none = np.less_equal(below + plate.above, 0.0)
        least = "above + below must be more than 0 m"
        _refuse(scene, none, "plate.above", plate.above, lambda _: least)
        parts.append(Part("plate", [(_turned(x, y, alpha, below, plate.above), 0.0)]))
        if np.count_nonzero(missed):
            warnings.append(Caution("plate"))
        warnings += _off_plate(scene, (y - hit[1]) * -cosine + (x - hit[0]) * sine, below)
    if out is not None:
        assert height is not None
        ends = [(out.start, height), (out.start + out.length, height)]
        parts.append(Part("outgoing", [(ends, out.speed)]))
    return parts, warnings


def _off_plate(scene: Scene, along: Numbers, below: Numbers) -> list[Caution]:
    """Warn of a hit that far above the pivot (m; NaN is no hit) if it is off the finite plate.

    It is refused where the outgoing belt is placed by it.
    """
    assert scene.plate is not None
    above = scene.plate.above
    too_low, too_high = np.less(along, -below), np.greater(along, above)
    off = too_low | too_high
    # Several times as fast as `any` where there is one number.
    if not np.count_nonzero(off):
        return []
    if scene.outgoing is None or scene.outgoing.drop_from != "impact":
        return [Caution("plate", hit=_at(scene, along, int(np.argmax(off))))]

    def allowed(place: int) -> str:
        hit = _at(scene, along, place)
        return (
            f"{Caution('plate', hit=hit).text}: lengthen it to at least"
            f' {ceil(1e4 * abs(hit)) / 1e4:g} m, or set outgoing.drop_from = "top"'
        )

    _refuse(scene, too_high, "plate.above", above, allowed)
    _refuse(scene, too_low, "plate.below", below, allowed)
    return []


def _refuse(
    scene: Scene, bad: ArrayLike, key: str, value: ArrayLike, allowed: Callable[[int], str]
) -> None:
    """Raise if something is wrong with a key of some scenes of a family, or of the one."""
    if np.count_nonzero(bad):
        places = np.flatnonzero(np.broadcast_to(bad, scene.shape)).tolist()
        faults = {n: Fault(key, _at(scene, value, n), allowed(n)) for n in places}
        raise RefusedError(scene.source, faults)


def _at(scene: Scene, value: ArrayLike, place: int) -> Any:
    """Return a number of one scene of a family, as Python has it."""
    return np.broadcast_to(value, scene.shape).flat[place].item()


def _with_grip(restitution: Any, friction: Any) -> tuple[Any, Any]:
    """Return restitution and friction, where adhesion is friction without a bound."""
    return restitution, inf if isinstance(friction, str) else friction
