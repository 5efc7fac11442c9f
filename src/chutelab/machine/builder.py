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
from chutelab.machine.parts import Machine, Pulley, Segments
from chutelab.nominal import Discharge, discharge, plate_hit
from chutelab.recording import Particle
from chutelab.releases import draw
from chutelab.scene import Fault, SceneError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chutelab.scene import Scene

REACH_WITHOUT_BELT = 2.0
"""m of plate below the pivot where there is no outgoing belt to stop short of."""

CLEARANCE = 0.05
"""m that the plate's lower end stays above the outgoing belt, at least."""

CLEARANCE_RADII = 3.0
"""The same in radii: a disk that lies on the belt passes under the plate, with one to spare."""


def build(scene: Scene) -> Machine:
    """Resolve a validated scene.

    Raises
    ------
    SceneError
        If the geometry contradicts itself: the nominal flight misses the plate whose impact should
        place the outgoing belt, the impact lies off the finite plate, a particle starts inside a
        surface, or interacting particles cannot be released without overlap.
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
        points: Sequence[tuple[float, float]],
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
        x, y = top + plate.distance, float(plate.pivot_height or 0.0)
        if plate.below is not None:
            below = plate.below
        elif height is None:
            below = REACH_WITHOUT_BELT
        else:
            below = max(0.0, (y - height - max(CLEARANCE, CLEARANCE_RADII * r)) / cos(alpha))
        if below + plate.above <= 0.0:
            raise self._fault("plate.above", plate.above, "above + below must be more than 0 m")
        # Upwards, so that the struck face (-cos α, -sin α) lies to the left of the tangent.
        low, high = (
            (x - reach * sin(alpha), y + reach * cos(alpha)) for reach in (-below, plate.above)
        )
        self.add("plate", [low, high], 0.0, plate.restitution, plate.friction)
        if hit is None:
            self.warnings.append("plate: the nominal particle never meets the plate's line")
        else:
            self._check_hit((y - hit[1]) * -cos(alpha) + (x - hit[0]) * sin(alpha), below)
        return height

    def _check_hit(self, along: float, below: float) -> None:
        """Look whether a hit that far above the pivot, m, is on the plate."""
        scene = self.scene
        assert scene.plate is not None
        if -below <= along <= scene.plate.above:
            return
        where = (
            f"the nominal particle meets the plate's line {abs(along):.4g} m"
            f" {'above' if along > 0 else 'below'} the pivot"
        )
        if scene.outgoing is not None and scene.outgoing.drop_from == "impact":
            key = "plate.above" if along > 0 else "plate.below"
            value = scene.plate.above if along > 0 else below
            enough = ceil(1e4 * abs(along)) / 1e4
            raise self._fault(
                key,
                value,
                f"{where}, off the finite plate: lengthen it to at least {enough:g} m,"
                ' or set outgoing.drop_from = "top"',
            )
        self.warnings.append(f"plate: {where}, off the finite plate")

    def _fault(self, key: str, value: object, allowed: str) -> SceneError:
        return SceneError(self.scene.source, [Fault(key, value, allowed)])

    def machine(self) -> Machine:
        scene = self.scene
        columns = np.array(self.rows, dtype=np.float64).reshape(-1, 7).T.copy()
        speed, restitution, friction = columns[4:]
        along = columns[2:4] - columns[0:2]
        length = np.hypot(along[0], along[1])
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
                length=length,
                speed=speed,
                restitution=restitution,
                friction=friction,
                surface=np.array(self.owner, dtype=np.int64),
            ),
            pulley=pulley,
            releases=releases,
            landing=self.names.index("outgoing") if "outgoing" in self.names else -1,
            until=until if isinstance(until, str) else "time",
            end_time=bound if isinstance(until, str) else min(bound, until),
            dt=scene.run.dt,
            align=scene.run.align,
            interact=scene.stream.interact and scene.stream.count > 1,
            pair_restitution=scene.stream.restitution,
            pair_friction=scene.stream.friction,
            engine=scene.run.engine,
            plate_warnings=tuple(self.warnings),
        )
