"""Particles that meet: impacts at their own instants, lasting contacts by contact dynamics.

The engine itself is in C, in `chutelab.core`; here `run` goes from a machine to a recording.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import inf, nan
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.core import REAL, AsideError, Module, Status, borrow, constants, dtype, give_back
from chutelab.machine import PASSES, SWING, Machine, Pieces, chooses, hand_over, pace_of
from chutelab.results.laws import take
from chutelab.results.loads import gather, gather_lasting
from chutelab.results.record import Record
from chutelab.results.recorder import EnoughError, Recorder, StalledError, read_knots
from chutelab.results.rows import REASONS
from chutelab.scene.look import JOINTS
from chutelab.util.arrays import Floats, Ints, Progress, unwatched

UNTIL = {name.removeprefix("UNTIL_").lower(): one for name, one in constants("Until").items()}

GREATEST = 1e300
"""Stands for unbounded friction; finite, so that it can be multiplied by zero."""

SLICE = 0.05
"""s of wall time between two checks for Ctrl-C, and reports of progress."""

MOST_STEPS = 512
"""Most steps between two checks: later ones may take a thousand times as long."""


def run(machine: Machine, progress: Progress | None = None) -> Record:
    """Run a machine with the contact engine.

    Parameters
    ----------
    machine : Machine
        From `chutelab.machine.build`; the radius must be more than 0.
    progress : callable, optional
        Called now and then with the share of the run that is done; it may end the run.

    Returns
    -------
    Record
        Flights and impacts are exact to rounding, lasting contacts of second order in `machine.dt`;
        bit-identical on every machine.

    Raises
    ------
    ValueError
        If the particle has no radius.
    StalledError
        If a particle gets stuck; it has the recording so far.
    """
    if machine.scene.cornered:
        machine.finish()
        machine = together(machine)
    if not machine.is_ahead and np.min(machine.particle.radius) <= 0.0:
        raise ValueError("particle.radius = 0: the contact engine needs a radius above 0 m")
    module, recorder = borrow(), Recorder(machine)
    try:
        job = Job(module, recorder.near, whole=not any(recorder.origin))
        stalled = job.run(progress)
        job.write(recorder)
        record = recorder.finish(engine="contact", steps=module.world.step_count)
        take(module, record)
        return recorder.whole(record, stalled)
    except AsideError:
        # Errors of the machine are raised below, without this one as context.
        pass
    finally:
        give_back(module)
    machine.finish(unwatched if progress is None else partial(progress, 0.0))
    return run(machine, progress)


def together(machine: Machine) -> Machine:
    """Return a machine whose particles all run at once, even if they do not interact."""
    if machine.interact:
        return machine
    passing = np.full_like(machine.pair_restitution, PASSES)
    return replace(machine, interact=True, pair_restitution=passing)


def parts(machine: Machine) -> dict[str, Pieces]:
    """Return the parts of all surfaces in the order of the core's, by the names of their shapes."""
    rim = {} if machine.pulley is None else {"CIRCLE": machine.pulley.rim}
    return {"SEGMENT": machine.segments, **rim, "ARC": machine.arcs}


def pieces(machine: Machine) -> NDArray[Any]:
    """Return all surfaces as rows of the core, with the fields that it needs."""
    every = parts(machine)
    rows = np.zeros(sum(part.surface.size for part in every.values()), dtype("Surface"))
    first = 0
    for shape, part in every.items():
        own = rows[first : (first := first + part.surface.size)]
        own["shape"] = constants("Shape")[shape]
        own["speed"], own["owner"] = part.speed, part.surface
        own["opens"], own["closes"] = part.appears, part.vanishes
        own["one_sided"] = part.one_sided
        for name, values in part.told().items():
            own[name] = values
    return rows


class Job:
    """One run: fills the module's memory, and copies the results from it."""

    def __init__(self, module: Module, machine: Machine, *, whole: bool = True) -> None:
        self.module, self.machine = module, machine
        self.knots: list[tuple[Ints, NDArray[Any], Floats]] = []
        self.events: list[NDArray[Any]] = []
        # First disk of the part in which the run was stopped; later ones have not ended.
        self.stopped_from, self.owners = machine.count, len(machine.surfaces)
        scene = machine.scene
        usual = scene.run.dt / pace_of(scene.gravity)
        for name, value in (
            ("interact", machine.interact), ("is_whole", whole), ("until", UNTIL[machine.until]),
            ("landing", machine.landing), ("ride_owner", 0), ("dt", machine.dt),
            ("chosen", usual * chooses(scene)),
        ):  # fmt: skip
            setattr(module.world, name, value)
        loads = module.structs["Loads"]
        loads.every, loads.each = machine.loads, machine.stress
        self.begin = "run_world" if machine.is_ahead else "run_and_judge"
        if machine.is_ahead:
            hand_over(module, machine.scene)
        else:
            self.fill()

    def fill(self) -> None:
        """Hand the machine over."""
        module, machine = self.module, self.machine
        outlines = [np.empty((0, 2)) if one is None else one for one in machine.outlines]
        sizes = [len(one) for one in outlines]
        self.pieces, wheel = pieces(machine), machine.pulley
        self.kinds, self.materials = len(machine.rolling), len(self.pieces)
        for name, value in (
            ("disk_count", machine.count), ("surface_count", len(self.pieces)),
            ("kind_count", self.kinds), ("owner_count", self.owners),
            ("pulley", -1 if wheel is None else len(machine.segments.length)),
            ("ride_incline", 0.0 if wheel is None else wheel.incline),
            ("g", machine.gravity), ("tilt", machine.tilt),
            ("air", machine.air), ("end_time", machine.end_time),
            ("mover_count", len(machine.movers)), ("trigger_count", len(machine.triggers)),
            ("joint_count", len(machine.joints)), ("outline_count", sum(sizes)),
        ):  # fmt: skip
            setattr(module.world, name, value)
        module.work("lay_out_world")
        releases, particle = machine.releases, machine.particle
        disks = module.array("disks", dtype("Disk"), machine.count)
        disks["x"], disks["y"] = releases.position.T
        disks["vx"], disks["vy"] = releases.velocity.T
        disks["spin"], disks["turned"] = releases.omega, releases.angle
        disks["release"] = releases.t
        disks["radius"], disks["mass"] = particle.radius, particle.mass
        disks["inertia"] = particle.inertia
        disks["kind"] = releases.kind
        disks["rides"] = releases.carried
        disks["exit_box"] = releases.exit_box
        if any(sizes):
            disks["corners"] = np.array(sizes)[releases.kind]
            disks["outline"] = np.cumsum([0, *sizes[:-1]])[releases.kind]
            corners = module.array("outlines", REAL, 2 * sum(sizes))
            corners[:] = np.concatenate(outlines).ravel()
        module.array("surfaces", dtype("Surface"), len(self.pieces))[:] = self.pieces
        rows = module.array("movers", dtype("Mover"), len(machine.movers))
        for row, mover in zip(rows, machine.movers, strict=True):
            mover.tell(row)
        doings = constants("Doing")
        rows = module.array("triggers", dtype("Trigger"), len(machine.triggers))
        for row, one in zip(rows, machine.triggers, strict=True):
            doing = doings[{"opens": "GOES", "closes": "COMES", "starts": "STARTS"}[one.doing]]
            row["surface"], row["doing"], row["by"] = one.surface, doing, one.by
        rows = module.array("joints", dtype("Joint"), len(machine.joints))
        for row, joint in zip(rows, machine.joints, strict=True):
            row["kind"], row["length"] = JOINTS.index(joint.kind), joint.length
            row["from"], row["particle"] = joint.anchor or (nan, nan), joint.particle
            row["other"], row["stiffness"] = joint.other, joint.stiffness
            row["damper"] = joint.damper
        pairs = module.array("pairs", dtype("Pair"), self.kinds * (self.kinds + self.materials))
        pairs = pairs.reshape(self.kinds, -1)
        own = pairs[:, : self.kinds]
        own["restitution"], own["friction"] = machine.pair_restitution, machine.pair_friction
        own["rolling"] = np.maximum.outer(machine.rolling, machine.rolling)
        own["falls"] = np.maximum.outer(machine.falls, machine.falls)
        own["cohesion"], first = machine.cohesion[:, : self.kinds], self.kinds
        for part in parts(machine).values():
            others = pairs[:, first : (first := first + len(part.surface))]
            others["restitution"], others["friction"] = part.restitution, part.friction
            others["rolling"] = machine.rolling[:, None]
            others["falls"] = machine.falls[:, None]
            others["cohesion"] = machine.cohesion[:, self.kinds + part.surface]
        np.minimum(pairs["friction"], GREATEST, out=pairs["friction"])
        module.work("prepare_to_judge")

    def run(self, progress: Progress | None) -> StalledError | None:
        """Run to the end, or until a particle gets stuck, which is returned."""
        steps, status = 64, Status.PAUSED
        with suppress(EnoughError):
            while status not in (Status.DONE, Status.STALLED):
                begin = perf_counter()
                status = self.proceed(steps)
                if status is Status.PAUSED:
                    took = perf_counter() - begin
                    steps = min(2 * steps, MOST_STEPS) if took < SLICE else max(1, steps // 2)
                if progress is not None:
                    progress(1.0 if status is Status.DONE else self.share())
        if status not in (Status.DONE, Status.STALLED):
            status = self.stop()
        if status is Status.DONE:
            return None
        return self.stalled()

    def stalled(self) -> StalledError:
        """Return where the run got stuck, and why."""
        world = self.module.world
        disk = self.module.array("disks", dtype("Disk"), self.machine.count)[world.stalled]
        reason = (
            "too many impacts in one step; make run.dt shorter, move the surfaces there apart, or"
            " lower their restitution or speed"
        )
        if world.t + world.step == world.t:
            reason = "it has become too fast for any step; make run.dt shorter"
        return StalledError(world.stalled, world.now, (float(disk["x"]), float(disk["y"])), reason)

    def stop(self) -> Status:
        """End the run after the step that it is in."""
        while (status := self.proceed(0)) is Status.FULL:
            pass
        if status is Status.PAUSED:
            world = self.module.world
            self.stopped_from = world.low
            world.end_time = world.t
            # Disks that do not meet run one after the other: no further one is released.
            disks = self.module.array("disks", dtype("Disk"), self.machine.count)
            disks["release"][world.high :] = inf
            while status not in (Status.DONE, Status.STALLED):
                status = self.proceed(1)
        return status

    def proceed(self, steps: int) -> Status:
        """Run on for at most so many steps, and copy what was written."""
        module = self.module
        status = Status(module.run(self.begin, steps, Status.LACKING))
        self.begin = "run_and_judge"
        if status is Status.FULL:
            module.world.is_whole = False
            self.drain()
        return status

    def drain(self) -> None:
        """Copy what was written, so that there is room for more."""
        world, module = self.module.world, self.module
        if world.knot_count:
            rows = module.array("knots", dtype("Knot"), world.knot_count)
            self.knots.append((*read_knots(rows), rows["angle"].copy()))
            world.knot_count = 0
        if world.event_count:
            self.events.append(module.take_events())

    def share(self) -> float:
        """Return the share of the run that is done."""
        world, n = self.module.world, self.machine.count
        end, ended = world.end_time, world.done / n
        if self.machine.interact:
            return float(min(1.0, max(ended, world.t / end if end > 0.0 else 1.0)))
        # The particles run one after the other, each from its release on.
        disks = self.module.array("disks", dtype("Disk"), n)
        begin = float(disks["release"][world.low]) if world.low < n else end
        passed = (world.t - begin) / (end - begin) if begin < world.t < end else 0.0
        return float(min(1.0, ended + passed / n))

    def write(self, recorder: Recorder) -> None:
        """Write the recording."""
        self.drain()
        world, module = self.module.world, self.module
        # Each chunk is freed after copying, as together they take most of the memory.
        self.knots.reverse()
        self.events.reverse()
        while self.knots:
            recorder.add(*self.knots.pop())
        while self.events:
            recorder.take_events(self.events.pop())
        recorder.ended[:] = module.array("disks", dtype("Disk"), self.machine.count)["reason"]
        if self.stopped_from < self.machine.count:
            late = recorder.ended[self.stopped_from :]
            late[late == REASONS.index("time")] = REASONS.index("stopped")
        books = module.array("books", REAL, 3 * (self.owners + 1))
        recorder.by_surface[:] = books.reshape(-1, 3)
        recorder.drives[: self.owners] = module.array("drives", REAL, self.owners)
        if world.swing_count:
            for row in module.array("movers", dtype("Mover"), world.mover_count):
                work = row["worked"], row["stopped"], row["damped"], row["pushed"]
                by_hand = recorder.drives[row["surface"]], 0.0, 0.0, 0.0
                recorder.hinge_work[row["surface"]] = by_hand if row["steered"] else work
            swings = module.array("swings", dtype("Swing"), world.swing_count).view(SWING)
            order = np.argsort(swings["surface"], kind="stable")
            taken = module.array("swing_work", REAL, 3 * world.swing_count).reshape(-1, 3)
            recorder.swings, recorder.stopped = swings[order], taken[order, 0]
        if world.joint_count:
            joints = module.array("joints", dtype("Joint"), world.joint_count)
            own = joints[joints["kind"] == JOINTS.index("spring")]
            recorder.springs = np.column_stack([own["kept"], own["damped"], own["given"]])
        if world.trigger_count:
            triggers = module.array("triggers", dtype("Trigger"), world.trigger_count)
            recorder.triggered = triggers["t"].copy()
        recorder.contacts = world.impact_count
        recorder.gained, recorder.air_loss = world.gained, world.air_loss
        recorder.hastened = world.hastened
        if world.total_count:
            recorder.take_totals(module.array("totals", dtype("Total"), world.total_count))
        recorder.impulses = gather(module, self.owners)
        if module.structs["Loads"].each:
            recorder.lasting = gather_lasting(module)
