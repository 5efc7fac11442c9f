"""`run`: a machine in, a recording out; the core does the rest."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from math import inf, pi
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.engines.contact.module import Module, Status, borrow, constants, dtype, give_back
from chutelab.machine import Machine, moved, origin
from chutelab.results import EVENT, KNOT, REASONS, Recording
from chutelab.results.recorder import EnoughError, Recorder, StalledError
from chutelab.util.arrays import Progress

GREATEST = 1e300
"""Friction without a bound, as a number that can be multiplied by zero."""

JOINED, SMOOTH = 1e-3, 1e-2
"""Radii, rad: pieces whose ends are no further apart and whose directions there differ by no more
are one smooth surface, as one whose points are written with some digits is meant to be."""

INTEGER, REAL = np.dtype("<i4"), np.dtype("<f8")

GROWING = {
    "knot": (("knots", dtype("Knot"), 1),),
    "event": (("events", dtype("Event"), 1),),
    "contact": (
        ("contacts", dtype("Contact"), 1), ("earlier", dtype("Contact"), 1), ("links", INTEGER, 2)
    ),
    "near": (("near", INTEGER, 2),),
}  # fmt: skip
"""Arrays that may become full: name, type, rows for each knot, event, contact or pair near."""

FULL = {
    Status.FULL_KNOTS: "knot", Status.FULL_EVENTS: "event",
    Status.FULL_CONTACTS: "contact", Status.FULL_NEAR: "near",
}  # fmt: skip

SLICE = 0.05
"""s of wall time between two looks at Ctrl-C and reports of progress."""

MOST_STEPS = 512
"""Steps between two looks, at most: what follows may take a thousand times as long as what was."""

SWEEPS, SWEEPS_ALONE = 100, 500
"""Most sweeps of the contact solver in a step: with 60 a pile of 2,000 hardly comes to rest."""


def run(machine: Machine, progress: Progress | None = None) -> Recording:
    """Run a machine with the contact engine.

    Parameters
    ----------
    machine : Machine
        From `chutelab.machine.build`; the radius must be more than 0.
    progress : callable, optional
        Called now and then with the share of the run that is done; may end the run.

    Returns
    -------
    Recording
        Flights and blows to rounding error, lasting contacts of second order in `machine.dt`;
        bit-identical on every machine, but for `seconds`.

    Raises
    ------
    ValueError
        If the particle has no radius.
    StalledError
        If a particle does not get on; it has the recording so far.
    """
    if np.min(machine.particle.radius) <= 0.0:
        raise ValueError("particle.radius = 0: the contact engine needs a radius above 0 m")
    begin = perf_counter()
    place = origin(machine)
    module = borrow()
    try:
        job = Job(module, moved(machine, -place[0], -place[1]))
        stalled = job.run(progress)
        recording = job.recording(machine, place, perf_counter() - begin)
    finally:
        give_back(module)
    if stalled is not None:
        particle, t, (x, y) = stalled
        reason = "too many impacts in one step; make run.dt shorter, or lower the restitution there"
        raise StalledError(particle, t, (x + place[0], y + place[1]), reason, recording)
    return recording


def pieces(machine: Machine) -> NDArray[Any]:
    """Return the pieces of all surfaces, segments, pulley and arcs, as rows of the core."""
    seg, arcs, wheel = machine.segments, machine.arcs, machine.pulley
    s, w = len(seg.length), int(wheel is not None)
    # A piece is met in one place at a time: an arc of which a disk can touch both ends is two.
    half, r = 0.5 * arcs.extent, np.max(machine.particle.radius)
    narrow = (arcs.radius <= r) | ((half > 0.5 * pi) & (arcs.radius * np.sin(half) <= r))
    parts = np.where(narrow & ~arcs.whole, 2, 1)
    which = np.repeat(np.arange(len(parts)), parts)
    arcs = replace(arcs, **{name: values[which] for name, values in vars(arcs).items()
                            if name not in ("restitution", "friction")})  # fmt: skip
    a, half = len(which), half[which] / parts[which]
    second = np.append(False, which[1:] == which[:-1])[:a]
    arcs = replace(arcs, begin=arcs.begin + np.where(second, 2.0 * half, 0.0), extent=2.0 * half)
    rows = np.zeros(s + w + a, dtype("Surface"))
    rows["material"] = np.append(np.arange(s + w), s + w + which)
    rows["opens"], rows["closes"], rows["mates"] = -inf, inf, -1
    shapes = constants("Shape")
    flat, bent = rows[:s], rows[s + w :]
    flat["x"], flat["y"] = seg.start.T
    flat["tx"], flat["ty"] = seg.tangent.T
    flat["length"], flat["speed"], flat["owner"] = seg.length, seg.speed, seg.surface
    flat["opens"], flat["closes"] = seg.appears, seg.vanishes
    flat["end"][:, :2], flat["end"][:, 2:] = seg.start, seg.end
    low, high = np.minimum(seg.start, seg.end), np.maximum(seg.start, seg.end)
    flat["box"][:, :2], flat["box"][:, 2:] = low, high
    if wheel is not None:
        rows["shape"][s] = shapes["CIRCLE"]
        rows["radius"][s], rows["speed"][s] = wheel.radius, wheel.speed
        rows["owner"][s] = wheel.surface
        rows["box"][s] = -wheel.radius, -wheel.radius, wheel.radius, wheel.radius
    if a:
        bent["shape"] = np.where(arcs.whole, shapes["CIRCLE"], shapes["ARC"])
        bent["x"], bent["y"] = arcs.center.T
        bent["tx"], bent["ty"] = np.cos(arcs.begin + half), np.sin(arcs.begin + half)
        bent["cos_half"] = np.cos(np.minimum(half, pi))
        bent["radius"], bent["speed"], bent["owner"] = arcs.radius, arcs.speed, arcs.surface
        bent["opens"], bent["closes"] = arcs.appears, arcs.vanishes
        bent["end"][:, :2], bent["end"][:, 2:] = arcs.ends
        corners = arcs.corners.reshape(-1, a, 2)
        bent["box"][:, :2], bent["box"][:, 2:] = corners.min(axis=0), corners.max(axis=0)
        _join(rows, s, s + w, float(np.min(machine.particle.radius)))
    comes = np.isfinite(rows["opens"]) | np.isfinite(rows["closes"])
    rows["gate"] = np.where(comes, np.cumsum(comes) - 1, -1)
    return rows


def _join(rows: NDArray[Any], straight: int, bent: int, radius: float) -> None:
    """Note which pieces go on smoothly beyond an end: an arc, or beyond a segment an arc or circle.

    The first `straight` rows are segments, those from `bent` on arcs and circles.
    """
    circle = rows["shape"] == constants("Shape")["CIRCLE"]
    circle[:bent] = False
    ended = np.flatnonzero(
        (np.arange(len(rows)) < straight) | ((np.arange(len(rows)) >= bent) & ~circle)
    )
    # Ends by piece: where, and which way the piece would go on.
    place = rows["end"][ended].reshape(-1, 2, 2)
    onward = np.stack([rows["tx"], rows["ty"]], axis=1)[ended]
    onward = np.stack([-onward, onward], axis=1)
    of_arc = ended >= bent
    center = np.stack([rows["x"], rows["y"]], axis=1)
    out = (place - center[ended][:, None])[of_arc] / rows["radius"][ended][of_arc][:, None, None]
    onward[of_arc] = np.stack([out[..., 1], -out[..., 0]], axis=-1) * [[1.0], [-1.0]]
    for n, piece in enumerate(ended):
        for end in range(2):
            near = np.hypot(*np.moveaxis(place - place[n, end], -1, 0)) <= JOINED * radius
            near &= np.hypot(*np.moveaxis(onward + onward[n, end], -1, 0)) <= SMOOTH
            near[n] = False
            near &= of_arc[:, None] | of_arc[n]
            if near.any():
                rows["mates"][piece, end] = ended[np.flatnonzero(near.any(axis=1))[0]]
                continue
            away = place[n, end] - center
            distance = np.hypot(*away.T)
            on = circle & (np.abs(distance - rows["radius"]) <= JOINED * radius)
            on &= np.abs(away @ onward[n, end]) <= SMOOTH * distance
            if on.any():
                rows["mates"][piece, end] = np.flatnonzero(on)[0]


class Job:
    """One run: fills the module's memory, drains what it writes, makes room where it is full."""

    def __init__(self, module: Module, machine: Machine) -> None:
        self.module, self.machine = module, machine
        self.knots: list[NDArray[Any]] = []
        self.events: list[NDArray[Any]] = []
        # Whoever is under way or to come when the run is ended, from the first disk of this part.
        self.stopped_from = machine.count
        n = machine.count
        self.pieces = pieces(machine)
        count = self.surface_count = len(self.pieces)
        self.kinds = len(machine.rolling)
        self.materials = int(self.pieces["material"].max(initial=-1)) + 1
        gates = int(self.pieces["gate"].max(initial=-1)) + 1
        self.owners = len(machine.surfaces)
        buckets = 1 << (4 * n + 16).bit_length() if machine.interact else 1
        cells = 12 * n + 64 if machine.interact else 1
        module.place(
            ("disks", dtype("Disk"), n), ("tracks", dtype("Track"), n),
            ("surfaces", dtype("Surface"), count),
            ("pairs", dtype("Pair"), self.kinds * (self.kinds + self.materials)),
            ("books", REAL, 3 * (self.owners + 1)), ("cells", dtype("Cell"), cells),
            ("heads", INTEGER, buckets), ("heap", INTEGER, n), ("queue", INTEGER, n + 1),
            ("moved", INTEGER, n), ("found", INTEGER, 2 * n),
            ("spared", INTEGER, n * gates),
        )  # fmt: skip
        self.make_room("knot", (100 if machine.releases.carried.any() else 30) * n + 200)
        self.make_room("event", 40 * n + 1200)
        self.make_room("contact", 8 * n + 16)
        self.make_room("near", 16 * n + 16 if machine.interact else 1)
        self.settings(buckets, cells, gates)
        self.fill()

    def make_room(self, what: str, room: int) -> None:
        """Make room for so many, in the arrays of `GROWING`."""
        self.module.place(*((name, kind, rows * room) for name, kind, rows in GROWING[what]))
        setattr(self.module.world, f"{what}_room", room)

    def settings(self, buckets: int, cells: int, gates: int) -> None:
        """Fill in the numbers of the world."""
        machine, world = self.machine, self.module.world
        alone = not machine.interact
        left, right, bottom, top = machine.exit_box
        for name, value in (
            ("disk_count", machine.count), ("surface_count", self.surface_count),
            ("kind_count", self.kinds), ("material_count", self.materials),
            ("gate_count", gates),
            ("owner_count", self.owners), ("bucket_count", buckets), ("cell_room", cells),
            ("interact", machine.interact),
            ("until", constants("Until")[f"UNTIL_{machine.until.upper()}"]),
            ("landing", machine.landing), ("ride_owner", 0),
            ("ride_incline", 0.0 if machine.pulley is None else machine.pulley.incline),
            ("sweeps", SWEEPS_ALONE if alone else SWEEPS), ("sleeps", not alone),
            ("gy", -machine.gravity), ("g", machine.gravity), ("dt", machine.dt),
            ("end_time", machine.end_time),
            ("smooth_x", 1e-5 if alone else 1e-4), ("smooth_v", 1e-4),
            ("accurate", 1e-15 if alone else 3e-4),
        ):  # fmt: skip
            setattr(world, name, value)
        world.exit_box[:] = left, bottom, right, top

    def fill(self) -> None:
        """Fill in disks, surfaces and pairs."""
        machine, module = self.machine, self.module
        releases, particle = machine.releases, machine.particle
        disks = module.array("disks", dtype("Disk"), machine.count)
        disks["x"], disks["y"] = releases.position.T
        disks["vx"], disks["vy"] = releases.velocity.T
        disks["release"] = releases.t
        disks["radius"], disks["mass"] = particle.radius, particle.mass
        disks["inertia"] = particle.inertia
        disks["kind"] = releases.kind
        carried = releases.carried
        if machine.pulley is not None and carried.any():
            sine, cosine = np.sin(machine.pulley.incline), np.cos(machine.pulley.incline)
            (x, y), (vx, vy) = releases.position[carried].T, releases.velocity[carried].T
            disks["ride_x"][carried] = x * cosine + y * sine
            disks["ride_rho"][carried] = y * cosine - x * sine
            disks["ride_speed"][carried] = vx * cosine + vy * sine
        module.array("surfaces", dtype("Surface"), self.surface_count)[:] = self.pieces
        pairs = module.array("pairs", dtype("Pair"), self.kinds * (self.kinds + self.materials))
        pairs = pairs.reshape(self.kinds, -1)
        own, wheel = pairs[:, : self.kinds], machine.pulley
        own["restitution"], own["friction"] = machine.pair_restitution, machine.pair_friction
        own["rolling"] = np.maximum.outer(machine.rolling, machine.rolling)
        others = pairs[:, self.kinds :]
        for name in ("restitution", "friction"):
            values = [getattr(machine.segments, name), getattr(machine.arcs, name)]
            if wheel is not None:
                values.insert(1, np.asarray(getattr(wheel, name))[..., None])
            values = [np.broadcast_to(each, (self.kinds, each.shape[-1])) for each in values]
            others[name] = np.concatenate(values, axis=1)
        others["rolling"] = machine.rolling[:, None]
        np.minimum(pairs["friction"], GREATEST, out=pairs["friction"])

    def run(self, progress: Progress | None) -> tuple[int, float, tuple[float, float]] | None:
        """Run to the end, or until a particle stalls: return which one, when and where."""
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
        world = self.module.world
        disk = self.module.array("disks", dtype("Disk"), self.machine.count)[world.stalled]
        return world.stalled, world.now, (float(disk["x"]), float(disk["y"]))

    def stop(self) -> Status:
        """Have the run be over at the end of the step that it is in."""
        while (status := self.proceed(0)) in FULL:
            pass
        if status is Status.PAUSED:
            world = self.module.world
            self.stopped_from = world.low
            world.end_time = world.t
            # Without contacts between them disks run one after the other: no further one does.
            disks = self.module.array("disks", dtype("Disk"), self.machine.count)
            disks["release"][world.high :] = inf
            while status not in (Status.DONE, Status.STALLED):
                status = self.proceed(1)
        return status

    def proceed(self, steps: int) -> Status:
        """Run on for at most so many steps, take what was written, make room where it is full."""
        module = self.module
        status, counts = module.run(steps), {}
        for what, kept in (("knot", self.knots), ("event", self.events)):
            counts[what] = count = getattr(module.world, f"{what}_count")
            if count:
                kept.append(module.array(f"{what}s", dtype(what.title()), count).copy())
                setattr(module.world, f"{what}_count", 0)
        if status in FULL:
            what = FULL[status]
            room = getattr(module.world, f"{what}_room")
            # Taking many knots or events has made room.
            if counts.get(what, 0) <= room // 2:
                # Of what was there, only contacts of the step before are needed.
                count = module.world.earlier_count if what == "contact" else 0
                earlier = module.array("earlier", dtype("Contact"), count).copy()
                self.make_room(what, 2 * room)
                module.array("earlier", dtype("Contact"), count)[:] = earlier
        return status

    def share(self) -> float:
        """Return the share of the run that is done."""
        world, n = self.module.world, self.machine.count
        end, ended = self.machine.end_time, world.done / n
        if self.machine.interact:
            return float(min(1.0, max(ended, world.t / end if end > 0.0 else 1.0)))
        # One after the other, each from its release on.
        begin = float(self.machine.releases.t[world.low]) if world.low < n else end
        passed = (world.t - begin) / (end - begin) if begin < world.t < end else 0.0
        return float(min(1.0, ended + passed / n))

    def recording(self, machine: Machine, place: tuple[float, float], seconds: float) -> Recording:
        """Return what was recorded."""
        recorder = Recorder(machine)
        world, module = self.module.world, self.module
        # Chunks are let go as they are handed over: all of them are most of the memory.
        self.knots.reverse()
        self.events.reverse()
        while self.knots:
            rows = self.knots.pop()
            owner = rows["disk"].astype(np.int64)
            recorder.add(owner, rows.view("<f8").reshape(-1, 10)[:, :9].copy().view(KNOT)[:, 0])
        while self.events:
            rows = self.events.pop()
            events = np.empty(len(rows), EVENT)
            for name, source in (("t", "t"), ("particle", "disk"), ("other", "other"),
                                 ("kind", "kind"), ("surface", "surface"),
                                 ("normal_impulse", "normal"),
                                 ("tangential_impulse", "tangent")):  # fmt: skip
                events[name] = rows[source]
            events["position"][:, 0], events["position"][:, 1] = rows["x"], rows["y"]
            for when in ("before", "after"):
                events[f"velocity_{when}"] = rows[when][:, :2]
                events[f"omega_{when}"] = rows[when][:, 2]
            recorder.tell(events)
        disks = module.array("disks", dtype("Disk"), machine.count)
        reasons, late = disks["reason"].copy(), np.arange(machine.count) >= self.stopped_from
        reasons[late & (reasons == REASONS.index("time"))] = REASONS.index("stopped")
        recorder.ended[:] = reasons
        books = module.array("books", REAL, 3 * (self.owners + 1))
        recorder.by_surface[:] = books.reshape(-1, 3)
        recorder.contacts = world.impact_count
        return recorder.finish(
            engine="contact", steps=world.step_count, seconds=seconds, origin=place
        )
