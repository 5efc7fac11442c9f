"""`build`: the geometry of a scene, settled once for the nominal particle.

That is particle 0: no spread, lowest layer. Where it meets the unbounded line of the plate gives
the height of the outgoing belt, and that the lower end of the plate. A release that overlaps a
surface is refused, or moved out where it is by rounding only. A family of scenes becomes a family
of machines, without those that cannot be built.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from math import ceil, cos, hypot, inf, radians, sin
from sys import float_info

import numpy as np

from chutelab.machine.nominal import Discharge, discharge, plate_hit
from chutelab.machine.parts import Caution, Machine, Particle, Pulley, Segments
from chutelab.machine.releases import ON_BELT, Releases, draw, release_point
from chutelab.scene import Fault, Scene, SceneError
from chutelab.util.arrays import Floats, Ints
from chutelab.util.many import Value, at, each, larger, of, smaller, some

Row = tuple[Value, ...]


class RefusedError(ValueError):
    """Some scenes of a family that contradict themselves.

    Parameters
    ----------
    reasons : mapping of int to str
        What is wrong, by their numbers; "" if only building one by itself can tell.
    """

    def __init__(self, reasons: Mapping[int, str]) -> None:
        super().__init__(f"{len(reasons)} scenes of the family cannot be built")
        self.reasons = dict(reasons)


def members(machine: Machine, places: Ints) -> Machine:
    """Return some members of a family of machines, as a family."""
    segments, start, pulley = machine.segments, machine.releases, machine.pulley
    own = ("start", "tangent", "length", "speed", "restitution", "friction")
    particle, wheel = machine.particle, ("radius", "speed", "friction", "restitution")
    return replace(
        machine,
        gravity=of(machine.gravity, places),
        particle=replace(
            particle, **{name: of(value, places) for name, value in vars(particle).items()}
        ),
        segments=replace(
            segments, **{name: np.take(getattr(segments, name), places, axis=0) for name in own}
        ),
        pulley=pulley
        and replace(pulley, **{name: of(getattr(pulley, name), places) for name in wheel}),
        releases=replace(start, **{name: value[places] for name, value in vars(start).items()}),
        end_time=of(machine.end_time, places),
    )


ROUNDING = 64.0 * float_info.epsilon
"""Share of the largest coordinate by which a contact may seem to overlap: the engines see to it."""


def cleared(
    scene: Scene,
    releases: Releases,
    rows: Sequence[Row],
    owner: Sequence[int],
    names: Sequence[str],
) -> Releases:
    """Return releases of which none lies in a surface.

    One less than `ON_BELT` inside, as one written with ten digits may be, is moved out.

    Parameters
    ----------
    scene : Scene
        For the radius, the drive pulley and messages.
    releases : Releases
        As drawn.
    rows : sequence of tuple of float
        Each segment's ends x0, y0, x1, y1, and more; arrays (N,) in a family.
    owner, names : sequence of int and of str
        Which surface a segment belongs to, and what surfaces are called.

    Raises
    ------
    SceneError
        If a particle starts further inside a surface.
    RefusedError
        If a particle of a family starts near one: each such scene has to be looked at by itself.
    """
    r: Value = scene.particle.radius
    if not some(r > 0.0):
        return releases
    # All start in one column, above the release point.
    x, low = release_point(scene)
    carried, drawn = bool(releases.carried[0]), releases
    for n, (x0, y0, x1, y1, *_) in enumerate(rows):
        if carried and owner[n] == 0:
            continue
        near = (larger(x0, x1) > x - r) & (smaller(x0, x1) < x + r) & (larger(y0, y1) > low - r)
        if some(near):
            near = near & (smaller(y0, y1) < _highest(scene, drawn, low) + r)
        if some(near):
            _one_by_one(scene, near)
            releases = _out(scene, releases, (x0, y0), (x1, y1), r, names[owner[n]])
    if scene.incoming is not None and not carried:
        reach = scene.incoming.pulley_radius + r
        high = _highest(scene, drawn, low)
        near = (abs(x) < reach) & (low < reach) & (high > -reach)
        if some(near):
            _one_by_one(scene, near)
            releases = _out(scene, releases, (0.0, 0.0), (0.0, 0.0), reach, "incoming")
    return releases


def _highest(scene: Scene, releases: Releases, low: Value) -> Value:
    """Return the height of the highest release, m."""
    return low if scene.members is not None else float(releases.position[:, 1].max())


def _one_by_one(scene: Scene, near: Value) -> None:
    """Refuse to look closer at scenes of a family."""
    if scene.members is not None:
        places = np.flatnonzero(np.broadcast_to(near, scene.members))
        raise RefusedError(dict.fromkeys(places.tolist(), ""))


def _out(
    scene: Scene,
    releases: Releases,
    start: tuple[float, float],
    end: tuple[float, float],
    reach: float,
    name: str,
) -> Releases:
    """Return releases at least `reach` (m) away from a segment, or from a point."""
    first, position = np.array(start), releases.position
    along = np.array(end) - first
    square = float(along @ along)
    share = np.clip((position - first) @ along / square, 0.0, 1.0) if square > 0.0 else 0.0
    away = position - first - np.multiply.outer(share, along)
    distance = np.hypot(away[:, 0], away[:, 1])
    depth = reach - distance
    worst = int(depth.argmax())
    size = max(map(abs, (*start, *end, *position[worst].tolist())))
    if depth[worst] <= ROUNDING * size:
        return releases
    if depth[worst] > max(ON_BELT, ROUNDING * size):
        far = hypot(*away[worst].tolist())
        allowed = (
            f"at least {reach:g} m from {name}: particle {worst} would start {far:.6g} m from it,"
            " inside; move stream.at, or the surface"
        )
        raise SceneError(scene.source, [Fault("stream.at", scene.stream.at, allowed)])
    moved = position + (np.maximum(depth, 0.0) / distance)[:, None] * away
    return Releases(releases.t, moved, releases.velocity, releases.carried)


REACH_WITHOUT_BELT = 2.0
"""m of plate below the pivot where there is no outgoing belt to stop short of."""

CLEARANCE = 0.05
"""m that the plate's lower end stays above the outgoing belt, at least."""

CLEARANCE_RADII = 3.0
"""The same in radii: a disk that lies on the belt passes under the plate, with one to spare."""


def build(scene: Scene) -> Machine:
    """Resolve a validated scene, or a family of them.

    Parameters
    ----------
    scene : Scene
        Of a family (`chutelab.scene.variants`) each is resolved as it would be by itself, to the
        bit; the machine has one particle for each, with surfaces of its own.

    Raises
    ------
    SceneError
        If the geometry contradicts itself: the nominal flight misses the plate whose impact should
        place the outgoing belt, the impact lies off the finite plate, a particle starts inside a
        surface, or interacting particles cannot be released without overlap.
    RefusedError
        Likewise of a family: which of them, and why.
    """
    builder = _Builder(scene)
    belt_height = builder.incoming_and_plate(discharge(scene))
    if scene.outgoing is not None:
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
        self.rows: list[tuple[Value, ...]] = []
        self.owner: list[int] = []
        self.warnings: list[Caution] = []

    def add(
        self,
        name: str,
        points: Sequence[tuple[Value, Value]],
        speed: Value,
        restitution: Value,
        friction: Value,
    ) -> None:
        self.names.append(name)
        for (x0, y0), (x1, y1) in pairwise(points):
            self.rows.append((x0, y0, x1, y1, speed, restitution, friction))
            self.owner.append(len(self.names) - 1)

    def incoming_and_plate(self, start: Discharge) -> Value | None:
        """Add the belt and the plate; return the height of the outgoing belt's surface."""
        scene = self.scene
        if scene.incoming is None:
            return None
        belt = scene.incoming
        top: Value = belt.pulley_radius
        self.add("incoming", [(-belt.length, top), (0.0, top)], belt.speed, belt.restitution,
                 _grip(belt.friction))  # fmt: skip
        plate, out, r = scene.plate, scene.outgoing, scene.particle.radius
        hit = plate_hit(scene, start)
        missed = hit[1] != hit[1]  # NaN
        height: Value | None = None
        if out is not None and out.drop_from == "top":
            height = top - out.drop
        elif out is not None:
            self._refuse(
                missed,
                "outgoing.drop_from",
                "impact",
                lambda _: (
                    "the nominal particle never meets the plate, so there is no impact to measure"
                    ' from; set outgoing.drop_from = "top"'
                ),
            )
            height = hit[1] - out.drop - r
        if plate is None:
            return height
        alpha = each(radians, plate.angle_deg)
        sine, cosine = each(sin, alpha), each(cos, alpha)
        x, y = top + plate.distance, plate.pivot_height
        below: Value
        if plate.below is not None:
            below = plate.below
        elif height is None:
            below = REACH_WITHOUT_BELT
        else:
            below = larger((y - height - larger(CLEARANCE, CLEARANCE_RADII * r)) / cosine, 0.0)
        self._refuse(
            below + plate.above <= 0.0,
            "plate.above",
            plate.above,
            lambda _: "above + below must be more than 0 m",
        )
        # Upwards, so that the struck face (-cos α, -sin α) lies to the left of the tangent.
        low, high = ((x - reach * sine, y + reach * cosine) for reach in (-below, plate.above))
        self.add("plate", [low, high], 0.0, plate.restitution, plate.friction)
        if some(missed):
            self.warnings.append(Caution("plate"))
        self._check_hit((y - hit[1]) * -cosine + (x - hit[0]) * sine, below)
        return height

    def _check_hit(self, along: Value, below: Value) -> None:
        """Look whether a hit that far above the pivot, m, is on the plate; NaN is no hit."""
        scene = self.scene
        assert scene.plate is not None
        above: Value = scene.plate.above
        off = (along < -below) | (along > above)
        if not some(off):
            return

        def allowed(place: int) -> str:
            hit = at(along, place)
            return (
                f"{Caution('plate', hit=hit).text}: lengthen it to at least"
                f" {ceil(1e4 * abs(hit)) / 1e4:g} m,"
                ' or set outgoing.drop_from = "top"'
            )

        if scene.outgoing is not None and scene.outgoing.drop_from == "impact":
            self._refuse(off & (along > 0.0), "plate.above", above, allowed)
            self._refuse(off & (along < 0.0), "plate.below", below, allowed)
        elif scene.members is None:
            self.warnings.append(Caution("plate", hit=along))

    def _refuse(self, bad: Value, key: str, value: Value, allowed: Callable[[int], str]) -> None:
        """Raise if something is wrong; of a family, with those of which it is."""
        if not some(bad):
            return
        if self.scene.members is None:
            raise SceneError(self.scene.source, [Fault(key, value, allowed(0))])
        raise RefusedError(
            {
                place: str(Fault(key, at(value, place), allowed(place)))
                for place in np.flatnonzero(np.broadcast_to(bad, self.scene.members)).tolist()
            }
        )

    def _columns(self) -> Floats:
        """Return ends, speed, restitution and friction of the segments, (7, S) or (7, S, N)."""
        count = self.scene.members
        if count is None:
            return np.array(self.rows, dtype=np.float64).reshape(-1, 7).T.copy()
        columns = np.empty((7, len(self.rows), count))
        for s, row in enumerate(self.rows):
            for column, value in zip(columns, row, strict=True):
                column[s] = value
        return columns

    def machine(self) -> Machine:
        scene = self.scene
        columns = self._columns()
        speed, restitution, friction = columns[4:]
        along = columns[2:4] - columns[0:2]
        length = np.hypot(along[0], along[1])
        particle = Particle(
            radius=scene.particle.radius,
            mass=scene.particle.mass,
            inertia=0.5 * scene.particle.mass * (scene.particle.radius * scene.particle.radius)
            if scene.particle.spin
            else 0.0,
        )
        pulley = None
        if scene.incoming is not None:
            belt = scene.incoming
            pulley = Pulley(
                belt.pulley_radius, belt.speed, _grip(belt.friction), belt.restitution, 0
            )
        releases = cleared(scene, draw(scene), self.rows, self.owner, self.names)
        bound = float(releases.t[-1]) + scene.run.max_time
        until = scene.run.until
        return Machine(
            title=scene.title,
            text=partial(scene.model_dump_json, by_alias=True),
            surfaces=tuple(self.names),
            gravity=scene.gravity,
            particle=particle,
            segments=Segments(
                start=columns[0:2].T,
                tangent=(along / length).T,
                length=length.T,
                speed=speed.T,
                restitution=restitution.T,
                friction=friction.T,
                surface=np.array(self.owner, dtype=np.int64),
            ),
            pulley=pulley,
            releases=releases,
            landing=self.names.index("outgoing") if "outgoing" in self.names else -1,
            until=until if isinstance(until, str) else "time",
            end_time=bound if isinstance(until, str) else smaller(bound, until),
            dt=scene.run.dt,
            align=scene.run.align,
            interact=scene.stream.interact and scene.stream.count > 1,
            pair_restitution=scene.stream.restitution,
            pair_friction=scene.stream.friction,
            engine=scene.run.engine,
            plate_warnings=tuple(self.warnings),
        )


def _grip(friction: Value) -> Value:
    return inf if isinstance(friction, str) else friction
