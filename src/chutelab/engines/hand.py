"""A run by hand: stepped, with pushes, plates that are turned, and speeds that are changed.

`start` begins one on the contact engine. A run that is only stepped is bit for bit that of
`chutelab.simulate`.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.core import Status, borrow, constants, dtype
from chutelab.engines.contact import MOST_STEPS, Job, pieces, together
from chutelab.engines.simulation import must_fit, refused
from chutelab.machine import build
from chutelab.results import Recording
from chutelab.results.record import must_move
from chutelab.results.recorder import Recorder, StalledError
from chutelab.scene import AnyScene, Overrides, load
from chutelab.util.arrays import RADIANS, Floats
from chutelab.util.errors import InputError
from chutelab.util.tables import many, number

SET = "plate.angle_deg, the speed of a belt, or the speed_deg and torque of a motor"
"""Keys that can be set during a run."""


@dataclass(frozen=True)
class Touch:
    """A lasting contact in the latest step of the engine."""

    particle: int
    other: int  # the other particle, -1 if it is a surface
    surface: str  # its name, "" if it is a particle
    normal: tuple[float, float]  # unit vector towards the particle
    pressed: float  # normal force on the particle, N
    rubbed: float  # friction on the particle along (n_y, -n_x), N


def start(scene: AnyScene, changes: Overrides = ()) -> Run:
    """Begin a run that is stepped by hand.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        As that of `chutelab.simulate`.
    changes : mapping, str, or several
        Laid over it.

    Returns
    -------
    Run
        On the contact engine, whatever the scene asks for; all particles run together.

    Raises
    ------
    SceneError
        If the scene cannot be loaded, or the contact engine cannot run it.

    Examples
    --------
    >>> run = start("perpendicular")
    >>> run.step(0.1)
    >>> run.positions.shape
    (1, 2)
    """
    return Run(load(scene, changes))


class Run:
    """A run by hand, see `start`.

    Attributes
    ----------
    t : float
        Time reached, s. The engine chooses its own steps, so that the same scene has the same bits:
        a `step` ends with the first of them that ends no earlier than asked.
    done : bool
        Whether the run has ended by ``run.until``; it does not go on.
    """

    def __init__(self, scene: Any) -> None:
        machine = build(scene)
        must_fit(machine, "contact")
        machine = together(machine)
        self.scene, self.t, self.done = scene, 0.0, False
        self._machine, self._due = machine, 0.0
        self._module, recorder = borrow(), Recorder(machine)
        self._origin, self._near = np.array(recorder.origin), recorder.near
        self._job = Job(self._module, self._near, whole=not any(recorder.origin))
        self._torque = 0.0
        self._angles: dict[int, float] = {}
        self._pushed: set[int] = set()
        self._turned: set[int] = set()
        self._proceed(0)

    def __repr__(self) -> str:
        way = f"{many(int(self._under_way.sum()), 'particle', ',')} under way"
        made = many(self._module.world.step_count, "step", ",") + ", done" * self.done
        return f"<Run of {self.scene.source}: t = {number(self.t)} s, {way}, {made}>"

    def _proceed(self, steps: int) -> None:
        status = self._job.proceed(steps)
        while status is Status.FULL:
            status = self._job.proceed(steps)
        self.done = self.done or status in (Status.DONE, Status.STALLED)
        self.t = float(self._module.world.t)
        if status is Status.STALLED:
            found = self._job.stalled()
            place = tuple(np.add(found.position, self._origin).tolist())
            raise StalledError(found.particle, found.t, place, found.reason)

    @property
    def _disks(self) -> NDArray[Any]:
        return self._module.array("disks", dtype("Disk"), self._machine.count)

    @property
    def _under_way(self) -> NDArray[Any]:
        return ~np.isin(self._disks["mode"], [_MODES["WAITING"], _MODES["GONE"]])

    def step(self, seconds: float) -> None:
        """Go on by so many seconds, more than 0; less if the run ends earlier."""
        if not (isfinite(seconds) and seconds > 0.0):
            raise InputError("a finite number above 0 s", "seconds", seconds)
        module = self._module
        self._due = max(self._due, self.t) + seconds
        for surface, angle in self._angles.items():
            x, y = np.array(self._machine.steered(surface).pivot) - self._origin
            if not self.done and not module.call("steer", surface, x, y, angle, self._due):
                raise MemoryError("the core gets no more memory")
        # A remainder by rounding is no step. A step ends where a plate stops.
        module.world.pause = self._due if self._angles else self._due * (1.0 - 1e-12)
        self._angles.clear()
        while not self.done and module.world.t < module.world.pause:
            self._proceed(MOST_STEPS)
        for i in self._pushed:
            module.call("push_disk", i, 0.0, 0.0)
        for surface in self._turned:
            module.call("turn_hinge", surface, 0.0)
        self._pushed.clear()
        self._turned.clear()

    def push(
        self, body: int | str, force: Sequence[float], at: Sequence[float] | None = None
    ) -> None:
        """Push with a force (x, y), N, during the next `step`.

        Either a particle, by its number, at its centre; particles that the incoming belt carries by
        adhesion, or that are not under way, are not moved. Or a hinged surface, by its name, at a
        place `at`, m; the force turns with it, so that its torque is constant.
        """
        if np.shape(force) != (2,) or not all(map(isfinite, force)):
            raise InputError("two finite numbers, N", "force", force)
        if isinstance(body, str):
            hung = {self._machine.surfaces[one.surface]: one for one in self._machine.movers
                    if one.hinge is not None}  # fmt: skip
            if body not in hung:
                allowed = f"a particle's number, or what hangs: {', '.join(hung) or 'nothing does'}"
                raise InputError(allowed, "body", body)
            if at is None or np.shape(at) != (2,) or not all(map(isfinite, at)):
                raise InputError("two finite numbers, m: where it is pushed", "at", at)
            mover, (x, y), (fx, fy) = hung[body], map(float, at), map(float, force)
            torque = (x - mover.pivot[0]) * fy - (y - mover.pivot[1]) * fx
            self._module.call("turn_hinge", mover.surface, torque)
            self._turned.add(mover.surface)
            return
        if at is not None:
            raise InputError("nothing: a particle is pushed at its centre", "at", at)
        if not 0 <= body < self._machine.count:
            raise InputError(f"0 to {self._machine.count - 1}", "body", body)
        self._module.call("push_disk", body, *map(float, force))
        self._pushed.add(body)

    def set(self, key: str, value: Any) -> None:
        """Change a key of the scene from now on.

        The angle of a plate, to which it turns at a constant rate during the next `step`, as a
        drive would turn it; the speed of a belt; speed and torque of a motor.

        Raises
        ------
        SceneError
            If the key cannot have that value, or cannot be set during a run.
        """
        old, new = self.scene, load(self.scene, {key: value})
        module, last, first = self._module, key.split(".")[-1], self._machine.scene.plates
        turned = {
            plate.name or "plate": plate.angle_deg - first[n].angle_deg
            for n, plate in enumerate(new.plates)
            if plate.angle_deg != old.plates[n].angle_deg
        }
        carried = new.incoming != old.incoming and bool(self._disks["rides"].any())
        if turned and not turned.keys() & old.movers.keys():
            for name, angle in turned.items():
                self._angles[old.surfaces.index(name)] = angle * RADIANS
        elif last in ("speed_deg", "torque"):
            rows = module.array("movers", dtype("Mover"), module.world.mover_count)
            for mover in build(new).movers:
                if mover.hinge is not None:
                    rows["motor"][rows["surface"] == mover.surface] = mover.hinge.motor
                    self._torque = max(self._torque, mover.hinge.motor[1])
        elif last == "speed" and new.streams == old.streams and not carried:
            rows = module.array("surfaces", dtype("Surface"), module.world.surface_count)
            speeds, material = pieces(build(new))["speed"], rows["material"]
            rows["speed"] = speeds[material]
            for particle in {*range(self._machine.count)} - self._pushed:
                module.call("push_disk", particle, 0.0, 0.0)
        elif new != old:
            raise refused(old, key, value, f"left as it is while the run goes on: {SET} can be set")
        self.scene = new

    @property
    def positions(self) -> Floats:
        """Positions of the centres, (N, 2), m; NaN if not under way."""
        x, y, _, _ = self._moved()
        return np.asarray(np.stack([x, y], axis=-1) + self._origin)

    @property
    def velocities(self) -> Floats:
        """Velocities of the centres, (N, 2), m/s; NaN if not under way.

        In lasting contact it is the velocity in the middle of the engine's last step.
        """
        _, _, vx, vy = self._moved()
        return np.stack([vx, vy], axis=-1)

    def _moved(self) -> tuple[Floats, Floats, Floats, Floats]:
        disks, world = self._disks, self._module.world
        owed = disks["owed"]
        h, on = world.t - disks["t"], self._under_way
        half = np.where((disks["supports"] > 0) & (disks["mode"] == _MODES["FREE"]), 0.5, 0.0)
        fell, light = h - half * world.length, np.where(half > 0.0, 0.0, disks["inv_mass"])
        found = []
        for n, name in enumerate("xy"):
            pull, v = (world.gx, world.gy)[n], disks[f"v{name}"]
            # A push still owes the second half of its impulse in the last step.
            late = light * owed[:, n]
            found.append(np.where(on, disks[name] + (v + 0.5 * pull * h) * h, np.nan))
            found.append(np.where(on, v + pull * fell + late, np.nan))
        x, vx, y, vy = found
        return x, y, vx, vy

    @property
    def angles(self) -> Floats:
        """How far particles are turned, (N,), rad, as `Motion.angle`; NaN if not under way."""
        return np.where(self._under_way, self._disks["turned"], np.nan)

    @property
    def contacts(self) -> list[Touch]:
        """Lasting contacts of the latest step with their forces, but not of sleeping particles."""
        module, names = self._module, self._machine.surfaces
        world, found = module.world, list[Touch]()
        rows = module.array("earlier", dtype("Contact"), world.earlier_count)
        for row in rows[rows["impulse"][:, 0] > 0.0]:
            # Half of the impulse of a halved contact comes at the end of a step.
            span = 0.5 * (world.length if row["halved"] else world.length_before + world.length)
            pressed, rubbed, _ = (row["impulse"] / span).tolist()
            i, j, normal = (
                int(row["i"]),
                max(int(row["j"]), -1),
                (row["nx"].item(), row["ny"].item()),
            )
            name = names[row["owner"]] if j < 0 else ""
            found.append(Touch(i, j, name, normal, pressed, rubbed))
        return found

    def pose(self, surface: str) -> Floats:
        """Return the pose of a moving surface: x, y of its pivot, m, and its angle, rad, (3,).

        Raises an `InputError` if no surface of that name moves.
        """
        rows = self._module.array("movers", dtype("Mover"), self._module.world.mover_count)
        names = [self._machine.surfaces[index] for index in rows["surface"]]
        must_move(surface, names)
        row, machine = rows[names.index(surface)], self._machine
        known = {mover.surface: mover for mover in machine.movers}
        mover = known.get(row["surface"]) or machine.steered(row["surface"])
        pose = replace(mover, begins=row["begins"]).pose(self.t)
        if mover.hinge is not None:
            late = min(self.t, row["until"]) - row["since"] if row["steered"] else 0.0
            pose[2] = row["angle"] + late * row["rate"]
        return pose

    @property
    def recording(self) -> Recording:
        """The run so far; tracks that have not ended have the reason ``"stopped"``."""
        module, job, kept = self._module, copy(self._job), self._module.snapshot()
        job.knots, job.events = [*job.knots], [*job.events]
        recorder = Recorder(self._machine)
        try:
            module.world.pause = 0.0
            if not self.done:
                job.stop()
            job.write(recorder)
            recorder.torque = self._torque
            return Recording.of(recorder.finish(engine="contact", steps=module.world.step_count))
        finally:
            module.restore(kept)


_MODES = constants("Mode")
