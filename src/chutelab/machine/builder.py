"""`build`: the geometry of a scene, settled once for the nominal particle.

That is particle 0: no spread, lowest layer. Where it meets the unbounded line of the plate gives
the height of the outgoing belt, and that the lower end of the plate.
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from math import ceil, cos, inf, radians, sin
from typing import TYPE_CHECKING

import numpy as np

from chutelab.machine.clearance import cleared
from chutelab.machine.family import RefusedError
from chutelab.machine.parts import Machine, Pulley, Segments
from chutelab.many import Value, at, each, larger, smaller, some
from chutelab.nominal import Discharge, discharge, plate_hit
from chutelab.recording import Particle
from chutelab.releases import draw
from chutelab.scene import Fault, SceneError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from chutelab.scene import Scene

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
        Of a family (see `chutelab.scene.family`) each is resolved as it would be by itself, to the
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
        self.warnings: list[str] = []

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
            self.warnings.append("plate: the nominal particle never meets the plate's line")
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

        def told(place: int) -> str:
            where = at(along, place)
            return (
                f"the nominal particle meets the plate's line {abs(where):.4g} m"
                f" {'above' if where > 0 else 'below'} the pivot, off the finite plate"
            )

        def allowed(place: int) -> str:
            enough = ceil(1e4 * abs(at(along, place))) / 1e4
            return (
                f"{told(place)}: lengthen it to at least {enough:g} m,"
                ' or set outgoing.drop_from = "top"'
            )

        if scene.outgoing is not None and scene.outgoing.drop_from == "impact":
            self._refuse(off & (along > 0.0), "plate.above", above, allowed)
            self._refuse(off & (along < 0.0), "plate.below", below, allowed)
        elif scene.members is None:
            self.warnings.append(f"plate: {told(0)}")

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

    def _columns(self) -> NDArray[np.float64]:
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
