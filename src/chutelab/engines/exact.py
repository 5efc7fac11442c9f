"""The event-driven engine: particles move on exact arcs, the next event is solved, not stepped.

It is in C, in `chutelab.core` (exact*.c), and shares nothing with the contact engine; here `run`
goes from a machine to a recording. There is no contact between particles.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from math import prod
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.core import (
    INTEGER,
    REAL,
    AsideError,
    Module,
    borrow,
    constants,
    dtype,
    give_back,
    number,
)
from chutelab.machine import Machine, hand_over
from chutelab.results.laws import take
from chutelab.results.loads import gather
from chutelab.results.record import Record
from chutelab.results.recorder import EnoughError, Recorder, StalledError, read_knots
from chutelab.results.rows import EVENT, KNOT, REASONS
from chutelab.util.arrays import Progress, unwatched

ROUNDS = 500_000
"""Most events of a particle. One at ε = 0.999 comes to rest within some 20,000, at 0.9999 within
200,000; one that rattles at 7 ms a period for the default max_time needs 10,000."""

WINDOW = 10_000
"""Events between two checks whether a particle makes progress."""

TICK = 1e-12
"""s, divided by `Machine.pace`: if the mean time between events is shorter, a particle makes no
progress. The last bounces before rest, at 1e-9 m/s, are 200 times as long."""

SLICE = 0.02
"""s of wall time between two checks for Ctrl-C, and reports of progress."""

FIRST, MOST = 16, 100_000
"""Events up to the first check, as most runs of one particle have fewer, and between two checks."""

COURSE = constants("Course")

UNTIL = {name.removeprefix("UNTIL_").lower(): one for name, one in constants("Until").items()}


_PLACES = [
    ("t", 0), ("disk", 0), ("other", 0), ("kind", 0), ("surface", 0), ("x", 0),
    ("before", 0), ("after", 0), ("before", 16), ("after", 16), ("normal", 0), ("tangent", 0),
]  # fmt: skip


def _events() -> np.dtype[Any]:
    own, names = dtype("Event"), EVENT.names or ()
    fields: Any = own.fields
    offsets = [fields[field][1] + more for field, more in _PLACES]
    formats = [EVENT[name] for name in names]
    return np.dtype(
        {"names": names, "formats": formats, "offsets": offsets, "itemsize": own.itemsize}
    )


EVENTS = _events()
"""`EVENT` as it lies in the core's own rows."""


class CornerError(RuntimeError):
    """A spinning disk is held between moving surfaces, which the exact engine cannot run."""


def run(machine: Machine, progress: Progress | None = None) -> Record:
    """Run a machine whose particles do not interact; the same machine gives the same bits.

    Events are right to rounding error. `progress` is called now and then with the share of
    particles that have ended, and may end the run.

    Raises a `ValueError` if the particles interact, or some but not all are points; a `CornerError`
    if a spinning disk is held between surfaces of which one moves; a `StalledError` if a particle
    has events without progress: its track ends there, and the recording has all others.
    """
    if machine.interact:
        raise ValueError("the exact engine has no contacts between particles")
    if machine.tilt:
        machine.finish(unwatched if progress is None else partial(progress, 0.0))
    ahead = machine.is_ahead
    module = borrow()
    recorder = Recorder(machine, turned=machine.tilt != 0.0)
    try:
        if ahead:
            hand_over(module, machine.scene)
            ask(module, machine, 0.0, False)
        else:
            fill(module, recorder.near, max(map(abs, recorder.origin)), False)
        stalled = follow(module, recorder, progress, "run_exact" if ahead else "follow_and_judge")
        return ended(module, recorder, stalled)
    except AsideError:
        # Errors of the machine are raised below, without this one as context.
        pass
    finally:
        give_back(module)
    machine.finish(unwatched if progress is None else partial(progress, 0.0))
    return run(machine, progress)


@contextmanager
def lent(machine: Machine) -> Iterator[Record]:
    """Run a family; its record lies in the core's memory, and is valid within the context only.

    `Record.by_surface` is (N, S, 3), entries of each particle. Tracks of particles that landed or
    settled have only their ends, others no knots inside rides round circles. Raises what `run`
    does.
    """
    module = borrow()
    recorder = Recorder(machine, apart=True, turned=machine.tilt != 0.0, lent=True)
    try:
        fill(module, recorder.near, max(map(abs, recorder.origin)), True)
        yield ended(module, recorder, follow(module, recorder, None))
    finally:
        give_back(module)


def ask(module: Module, machine: Machine, far: float, apart: bool) -> None:
    """Set the core's run parameters; coordinates were rounded at the distance `far` (m)."""
    exact: Any = module.structs["Exact"]
    exact.apart, exact.until = apart, UNTIL[machine.until]
    exact.landing, exact.far, exact.loose = machine.landing, far, machine.loose
    # The core judges the run in its own frame.
    exact.is_whole = far == 0.0 and machine.tilt == 0.0
    # Sensors may be passed within a ride.
    exact.brief = exact.is_whole and machine.family is not None and not machine.scene.sensor
    exact.most, exact.window, exact.tick = ROUNDS, WINDOW, TICK
    module.structs["Loads"].every = machine.loads


def fill(module: Module, machine: Machine, far: float, apart: bool) -> None:
    """Hand a machine over to the core; its coordinates were rounded at the distance `far` (m)."""
    count, segments, arcs = machine.count, machine.segments, machine.arcs
    points = np.equal(machine.particle.radius, 0.0)
    if 0 < np.count_nonzero(points) < np.size(points) and segments.start.ndim == 2:
        raise ValueError("the exact engine has no points beside disks")
    family, wheel = machine.family, machine.pulley
    each = 0 if family is None else family.each
    members = count // each if each else 1
    s, a, w = segments.length.shape[-1], len(arcs.surface), int(wheel is not None)
    columns, owners = s + a + w, len(machine.surfaces) + 1
    kinds = members if each else len(machine.rolling)
    exact: Any = module.structs["Exact"]
    for name, value in (
        ("segment_count", s), ("arc_count", a), ("wheel_count", w), ("lone_count", count),
        ("surface_count", owners), ("kind_count", kinds), ("each", each),
    ):  # fmt: skip
        setattr(exact, name, value)
    ask(module, machine, far, apart)
    module.work("lay_out_exact")

    def rows(name: str, kind: str, *shape: int) -> NDArray[Any]:
        found = module.array(name, dtype(kind), prod(shape), of="Exact")
        return found.reshape(shape)

    def shared(numbers: Any) -> Any:
        """Return the values that all particles of a scene share; for a family one row per scene."""
        return numbers[::each] if each > 1 and np.ndim(numbers) else numbers

    materials = rows("materials", "Pair", kinds, columns)
    for name, kind, part, first, many in (
        ("segments", "Segment", segments, 0, s), ("arcs", "Arc", arcs, s, a),
    ):  # fmt: skip
        if not many:
            continue
        own = rows(name, kind, members, many)
        own["surface"] = part.surface
        for field in {*(own.dtype.names or ())} - {"end", "surface"}:
            own[field] = shared(getattr(part, field))
        for field in ("restitution", "friction"):
            materials[field][:, first : first + many] = shared(getattr(part, field))
    if wheel is not None:
        own = rows("wheels", "Wheel", members)
        for field in ("radius", "speed", "incline", "surface"):
            own[field] = shared(getattr(wheel, field))
        materials["restitution"][:, -1] = shared(wheel.restitution)
        materials["friction"][:, -1] = shared(wheel.friction)
    falls = shared(machine.falls[machine.releases.kind[0]]) if each else machine.falls
    materials["falls"] = np.broadcast_to(falls, kinds)[:, None]
    lones, releases = rows("lones", "Lone", count), machine.releases
    lones["release"], lones["stop"] = releases.t, machine.end_time - releases.t
    for field in ("position", "velocity", "omega"):
        lones[field] = getattr(releases, field)
    for field in ("radius", "mass", "inertia"):
        lones[field] = getattr(machine.particle, field)
    lones["gravity"], lones["pace"] = machine.gravity, machine.pace
    several = len(machine.rolling) > 1
    lones["rolling"] = machine.rolling[releases.kind] if several else machine.rolling[0]
    lones["kind"] = releases.kind // each if each else releases.kind
    lones["carried"] = releases.carried
    lones["exit_box"], lones["up"] = releases.exit_box, machine.up


def follow(
    module: Module, recorder: Recorder, progress: Progress | None, begin: str = "follow_and_judge"
) -> StalledError | None:
    """Run to the end; return which particle first made no progress.

    The core continues from `begin`: it builds the machine, or has it already.
    """
    stalled, course, events = None, COURSE["PAUSING"], FIRST
    with suppress(EnoughError):
        while course != COURSE["FINISHED"]:
            began = perf_counter()
            course = module.run(begin, events, COURSE["NO_MEMORY"])
            begin = "follow_and_judge"
            early = perf_counter() - began < SLICE
            events = min(2 * events, MOST) if early else max(FIRST, events // 2)
            exact: Any = module.structs["Exact"]
            if course == COURSE["FILLED"]:
                exact.is_whole = False
                drain(module, recorder)
            elif course == COURSE["HELD"]:
                a, b = (recorder.machine.surfaces[surface] for surface in exact.other)
                raise CornerError(
                    f"particle {exact.lone}, a spinning disk, is held between {a!r} and {b!r}, of"
                    " which one moves: the exact engine cannot follow that"
                )
            if (why := stuck(course, exact.passed)) and stalled is None:
                stalled = StalledError(exact.lone, exact.t, (exact.x, exact.y), why)
            if progress is not None:
                progress(exact.lone / exact.lone_count)
        return stalled
    recorder.ended[module.structs["Exact"].lone :] = REASONS.index("stopped")
    return stalled


def stuck(course: int, passed: float) -> str:
    """Return why a particle makes no progress, "" if it does; its latest events took `time` s."""
    if course == COURSE["NO_PROGRESS"]:
        return (
            f"{number('MOST_IDLE')} events in a row took no time; look for surfaces that nearly"
            " touch where it is, and join their ends or move them apart"
        )
    if course == COURSE["DRIVEN"]:
        took = f"{WINDOW} events took {passed:.2g} s" if passed else "its blows never end"
        return (
            f"{took}: it is driven to and fro in a narrow place;"
            " move the surfaces there apart, or lower their restitution"
        )
    if course == COURSE["TOO_LONG"]:
        return f"{ROUNDS} events, and no end of them; lower run.max_time"
    return ""


def ended(module: Module, recorder: Recorder, stalled: StalledError | None) -> Record:
    """Return the record of a run; if a particle is stuck, raise the error with it."""
    collect(module, recorder)
    rounds: int = module.structs["Exact"].rounds
    record = recorder.finish(engine="exact", steps=rounds)
    take(module, record)
    exact: Any = module.structs["Exact"]
    if recorder.lent and exact.brief:
        labels = module.array("labels", INTEGER, 3 * len(record.events), of="Exact").reshape(-1, 3)
        kinds = np.int64, np.int8, np.int16
        particle, kind, surface = map(np.ndarray.astype, labels.T, kinds)
        vars(record)["labels"] = kind, surface, particle
    return recorder.whole(record, stalled)


def drain(module: Module, recorder: Recorder) -> None:
    """Copy what was written, so that there is room for more."""
    exact: Any = module.structs["Exact"]
    if recorder.lent and exact.brief:
        offsets = module.array("offsets", INTEGER, exact.lone_count + 1, of="Laws")
        owners = np.repeat(np.arange(exact.lone_count), np.diff(offsets))
        recorder.add(owners, module.array("knots", KNOT, exact.knot_count, of="Exact"))
    elif exact.knot_count:
        rows = module.array("knots", dtype("Knot"), exact.knot_count, of="Exact")
        recorder.add(*read_knots(rows))
    exact.knot_count = 0
    if recorder.lent and exact.brief:
        recorder.take_events(module.array("events", EVENTS, exact.event_count, of="Exact"))
        exact.event_count = 0
    elif exact.event_count:
        recorder.take_events(module.take_events("Exact"))


def collect(module: Module, recorder: Recorder) -> None:
    """Copy the rest: reasons, and ledger entries by surface."""
    drain(module, recorder)
    exact: Any = module.structs["Exact"]
    lones = module.array("lones", dtype("Lone"), exact.lone_count, of="Exact")
    # Particles from `lone` on were stopped.
    recorder.ended[: exact.lone] = lones["reason"][: exact.lone]
    books = module.array("books", REAL, recorder.by_surface.size, of="Exact")
    books = books if recorder.lent else books.copy()
    recorder.by_surface = books.reshape(recorder.by_surface.shape)
    recorder.contacts = exact.contacts
    recorder.impulses = gather(module, len(recorder.machine.surfaces))
