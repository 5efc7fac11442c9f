"""`build`: the geometry of a scene, settled once for the nominal particle.

That is particle 0: no spread, lowest layer. Where it meets the unbounded line of the plate gives
the height of the outgoing belt, and that the lower end of the plate. A release that overlaps a
surface is refused, or moved out where it is by rounding only. A family of scenes becomes a family
of machines: NumPy's functions take a number and an array (N,) alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil, inf, prod
from sys import float_info
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chutelab.machine.nominal import plate_hit
from chutelab.machine.parts import Arcs, Caution, Machine, Particle, Pulley, Segments
from chutelab.machine.releases import Releases, draw, release_point
from chutelab.scene import Fault, Scene, SceneError
from chutelab.scene.rules import ON_BELT
from chutelab.util.arrays import Floats, Numbers


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


def _cleared(
    scene: Scene, releases: Releases, ends: Floats, owner: Sequence[int], names: Sequence[str]
) -> Releases:
    """Return releases of which none lies in a surface, or raise a `RefusedError`.

    One less than `ON_BELT` inside, as one written with ten digits may be, is moved out. ``ends``,
    (4, S) or (4, S, N), are each segment's x0, y0, x1, y1 (m); ``owner`` says which of the surfaces
    in ``names`` a segment belongs to.
    """
    r = scene.particle.radius
    # All start in one column, above the release point.
    x, low = release_point(scene)
    high = low + scene.stream.bed_height
    x0, y0, x1, y1 = ends
    near = (np.maximum(x0, x1) > x - r) & (np.minimum(x0, x1) < x + r)
    near &= (np.maximum(y0, y1) > low - r) & (np.minimum(y0, y1) < high + r)
    carried = bool(releases.carried[0])
    for n, surface in enumerate(owner):
        if np.count_nonzero(near[n]) and not (carried and surface == 0):
            releases = _out(scene, releases, ends[:, n], r, names[surface])
    if scene.incoming is not None and not carried:
        # A point may start anywhere.
        reach = np.where(np.greater(r, 0.0), scene.incoming.pulley_radius + r, 0.0)
        releases = _out(scene, releases, np.zeros(4), reach, "incoming")
    return releases


def _out(scene: Scene, releases: Releases, ends: Floats, reach: Numbers, name: str) -> Releases:
    """Return releases at least `reach` (m) away from a segment, (4,) or (4, N), or from a point."""
    x0, y0, x1, y1 = ends
    (x, y), dx, dy = releases.position.T, x1 - x0, y1 - y0
    square = dx * dx + dy * dy
    along = (x - x0) * dx + (y - y0) * dy
    share = np.clip(along / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    away = np.stack([x - x0 - share * dx, y - y0 - share * dy])
    distance = np.hypot(*away)
    depth = reach - distance
    rounding = ROUNDING * np.maximum(np.abs(ends).max(axis=0), np.maximum(np.abs(x), np.abs(y)))
    inside = np.flatnonzero(depth > np.maximum(ON_BELT, rounding))
    if len(inside):
        every = len(depth) // prod(scene.shape)
        deepest = {i // every: i for i in sorted(inside.tolist(), key=depth.__getitem__)}
        reach = np.broadcast_to(reach, depth.shape)
        faults = {}
        for member, i in deepest.items():
            allowed = (
                f"at least {reach[i]:g} m from {name}: particle {i % every} would start"
                f" {distance[i]:.6g} m from it, inside; move stream.at, or the surface"
            )
            faults[member] = Fault("stream.at", scene.stream.at, allowed)
        raise RefusedError(scene.source, faults)
    if not np.any(depth > rounding):
        return releases
    moved = np.where(depth > rounding, away * (depth / distance), 0.0)
    return replace(releases, position=releases.position + moved.T)


REACH_WITHOUT_BELT = 2.0
"""m of plate below the pivot where there is no outgoing belt to stop short of."""

CLEARANCE = 0.05
"""m that the plate's lower end stays above the outgoing belt, at least."""

CLEARANCE_RADII = 3.0
"""The same in radii: a disk that lies on the belt passes under the plate, with one to spare."""


Part = tuple[str, Sequence[tuple[Numbers, Numbers]], Numbers, Numbers, Numbers]
"""A surface: its name, its points (m), its speed (m/s), restitution and friction."""


# A flight that never meets the plate's line has NaN for its impact.
@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def build(scene: Scene) -> Machine:
    """Resolve a validated scene, or a family of them.

    Parameters
    ----------
    scene : Scene
        Of a family (`chutelab.scene.variants`) each is resolved as it would be by itself; the
        machine has one particle for each, with surfaces of its own.

    Raises
    ------
    RefusedError
        If the geometry contradicts itself: the nominal flight misses the plate whose impact should
        place the outgoing belt, the impact lies off the finite plate, or a particle starts inside a
        surface.
    """
    parts, warnings = _conveyors(scene)
    parts += [(s.name, s.points, s.speed, s.restitution, s.friction) for s in scene.surface]
    names = [name for name, *_ in parts]
    segments = sum(len(points) - 1 for _, points, *_ in parts)
    columns, owner = np.empty((7, segments, *scene.shape)), list[int]()
    for number, (_, points, *numbers) in enumerate(parts):
        for start, end in pairwise(points):
            for column, value in zip(columns, (*start, *end, *numbers), strict=True):
                column[len(owner)] = value
            owner.append(number)
    speed, restitution, friction = columns[4:]
    along = columns[2:4] - columns[0:2]
    length = np.hypot(along[0], along[1])
    disk, belt, until = scene.particle, scene.incoming, scene.run.until
    releases = _cleared(scene, draw(scene), columns[:4], owner, names)
    bound = releases.t[-1].item() + scene.run.max_time
    return Machine(
        scene=scene,
        surfaces=tuple(names),
        gravity=scene.gravity,
        particle=Particle(
            radius=disk.radius,
            mass=disk.mass,
            inertia=0.5 * disk.mass * (disk.radius * disk.radius) if disk.spin else 0.0,
        ),
        segments=Segments(
            start=columns[0:2].T,
            tangent=(along / length).T,
            length=length.T,
            speed=speed.T,
            restitution=restitution.T,
            friction=friction.T,
            surface=np.array(owner, dtype=np.int64),
            appears=np.full(segments, -inf),
            vanishes=np.full(segments, inf),
        ),
        arcs=Arcs(
            center=np.empty((*scene.shape, 0, 2)),
            **{
                name: np.empty((*scene.shape, 0))
                for name in ("radius", "begin", "extent", "speed", "restitution", "friction")
            },
            surface=np.empty(0, dtype=np.int64),
            appears=np.empty(0),
            vanishes=np.empty(0),
        ),
        pulley=None
        if belt is None
        else Pulley(belt.pulley_radius, belt.speed, _grip(belt.friction), belt.restitution, 0),
        releases=releases,
        landing=names.index("outgoing") if "outgoing" in names else -1,
        until=until if isinstance(until, str) else "time",
        end_time=bound if isinstance(until, str) else np.minimum(bound, until),
        dt=scene.run.dt,
        align=scene.run.align,
        interact=scene.stream.crowded,
        pair_restitution=np.full((1, 1), scene.stream.restitution),
        pair_friction=np.full((1, 1), scene.stream.friction),
        rolling=np.zeros(1),
        outlines=(None,),
        threads=(),
        streams=("stream",),
        engine=scene.run.engine,
        plate_warnings=tuple(warnings),
    )


def _conveyors(scene: Scene) -> tuple[list[Part], list[Caution]]:
    """Return the belts and the plate, and what may surprise about the plate."""
    belt, plate, out, r = scene.incoming, scene.plate, scene.outgoing, scene.particle.radius
    if belt is None:
        return [], []
    top, grip = belt.pulley_radius, _grip(belt.friction)
    ends: list[tuple[Numbers, Numbers]] = [(-belt.length, top), (0.0, top)]
    parts: list[Part] = [("incoming", ends, belt.speed, belt.restitution, grip)]
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
        alpha = np.radians(plate.angle_deg)
        sine, cosine = np.sin(alpha), np.cos(alpha)
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
        # Upwards, so that the struck face (-cos α, -sin α) lies to the left of the tangent.
        ends = [(x - reach * sine, y + reach * cosine) for reach in (-below, plate.above)]
        parts.append(("plate", ends, 0.0, plate.restitution, plate.friction))
        if np.count_nonzero(missed):
            warnings.append(Caution("plate"))
        warnings += _off_plate(scene, (y - hit[1]) * -cosine + (x - hit[0]) * sine, below)
    if out is not None:
        assert height is not None
        ends = [(out.start, height), (out.start + out.length, height)]
        parts.append(("outgoing", ends, out.speed, out.restitution, out.friction))
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


def _grip(friction: float | str) -> float:
    return inf if isinstance(friction, str) else friction
