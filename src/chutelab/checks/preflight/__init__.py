"""``check``: what will happen in a run, what it will cost, and what to watch out for.

`preflight` is all of it. Each warning says what would change it; settings for the machine are tried
before they are recommended.

- `trial`: `Preflight` and its parts: what will be built, what the closed form answers, what a run
  costs, estimated from one that is cut off after 1 s.
- `passing`: moving surfaces that pass through others.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from math import ceil, copysign, cos, degrees, floor, inf, isnan, log10, pi, radians
from time import process_time
from typing import Any, Final

import numpy as np

from chutelab.checks.preflight.passing import Passing, passings, turned
from chutelab.checks.preflight.trial import (
    Advice,
    Effort,
    Part,
    Preflight,
    Stepping,
    Trial,
    built,
    effort,
    extras,
    peak,
    skipped,
    stepping,
    trial_run,
)
from chutelab.engines.simulation import choose, unjoined
from chutelab.machine import DRIVE_PULLEY, Caution, Machine, build
from chutelab.machine.releases import squeeze
from chutelab.results import REASONS, Recording
from chutelab.results.arrival import Places, arrivals
from chutelab.results.summary import waits
from chutelab.scene import AnyScene, Scene, SceneError, load, shown
from chutelab.scene.materials import DENSEST, LIGHTEST, presets
from chutelab.scene.units import write_size
from chutelab.theory.prediction import Coverage, coverage
from chutelab.util.arrays import Bools, Floats, Ints

__all__ = ["Advice", "Coverage", "Effort", "Part", "Preflight", "Stepping", "preflight"]

Settings = dict[str, Any]
"""Values by key, to be changed together."""

EXIT = REASONS.index("exit")

LEAVE = "if it is meant, leave it; the first contact wins"
ROOM = "if no particle comes between them, leave it; or shorten one, or end the motion before"
LOOK = "look at the picture (--out DIR --only png) for what turns it away"
"""Advice if no setting is known to help: for surfaces that cross, for those that pass through each
other, and for other warnings."""

SMALL = 0.002
"""m; a smaller radius is beyond what pymunk resolves in SI units."""

MARGIN = 0.01
"""Margin of a recommended setting, m; of a rate as a share."""

MOST_CAUTIONS = 20
"""Most warnings about surfaces that cross or miss; for each some settings are tried."""

ON_RUBBER = 0.5
"""Coefficient of friction of bulk material on a belt: 0.5 to 0.7 by ISO 5048."""

SOME = 16
"""Most particles that are followed to the place where they miss the belt."""

LANDING_ROOM = 0.5
"""m of belt to spare before and behind a landing."""


def _densities(scene: Scene) -> Iterator[Advice]:
    """Warn of masses that no solid has at that size."""
    for n, kind in enumerate(scene.particles):
        if kind.outline or kind.radius == 0.0:
            continue
        density = kind.mass / (4.0 / 3.0 * pi * kind.radius**3)
        if LIGHTEST <= density <= DENSEST:
            continue
        path = scene.head("particle", n)
        steel = (kind.mass / (4.0 / 3.0 * pi * presets()["steel"].material.density)) ** (1.0 / 3.0)
        yield Advice(
            f"{path}: a sphere of {kind.radius:.4g} m radius and {kind.mass:.4g} kg would have a"
            f" density of {density:,.0f} kg/m³, {'less' if density < LIGHTEST else 'more'} than any"
            " solid",
            f"{path}.density or {path}.material instead of the mass; of steel, this mass has a"
            f" radius of {steel:.2g} m",
            {},
        )


GRAINS: Final = 3.0
"""In diameters of the largest grain: a stream may jam in a narrower gap."""

CELLS: Final = 64
"""Cells along each side of a `fill` box that is searched for walls."""


def places(scene: Scene, machine: Machine) -> Iterator[Advice]:
    """Yield warnings about a machine and the places where its particles start."""
    for belt in scene.conveyor:
        # Between its carrying and its returning side.
        way = np.subtract(belt.to, belt.from_)
        (x, y), (dx, dy) = (machine.releases.position - belt.from_).T, way / np.hypot(*way)
        along, aside = x * dx + y * dy, np.abs(x * dy - y * dx)
        inside = (along > 0.0) & (along < np.hypot(*way)) & (aside < belt.pulley_radius)
        if inside.any():
            yield Advice(
                f"{belt.name}: {np.count_nonzero(inside)} of {machine.count} particles start inside"
                " its loop, and fall on its returning side",
                "a release above its carrying side",
                {},
            )
    yield from _beyond_walls(scene, machine)
    yield from _joined_later(scene, machine)
    if machine.interact:
        yield from _narrow(scene, machine)


def _joined_later(scene: Scene, machine: Machine) -> Iterator[Advice]:
    """Warn of joints without a length between particles that are released at different times."""
    for table, joint in scene.joints:
        if joint.other is None or getattr(joint, "length", 0.0) is not None:
            continue
        first, last = sorted((joint.particle, joint.other), key=machine.releases.t.__getitem__)
        wait = float(machine.releases.t[last] - machine.releases.t[first])
        if not wait > 0.0:
            continue
        path = f"{table}[{getattr(scene, table).index(joint)}]"
        yield Advice(
            f"{path}: particle {last} is released {wait:.4g} s after particle {first}, and without"
            f" a length the {table} is as long as these two places are apart: it pulls at once if"
            " the first one has moved away",
            f"{path}.length, or releases at one time",
            {},
        )


def _narrow(scene: Scene, machine: Machine) -> Iterator[Advice]:
    """Warn of a plate whose lower end leaves a crowd little room above a belt."""
    lines = machine.segments
    largest = 2.0 * float(np.max(machine.particle.radius))
    belts = [n for n, name in enumerate(machine.surfaces) if name == "outgoing"]
    belts += [machine.surfaces.index(belt.name) for belt in scene.conveyor]
    for number, plate in enumerate(scene.plates):
        name = plate.name or "plate"
        (end,) = lines.start[lines.surface == machine.surfaces.index(name)]
        for k in np.flatnonzero(np.isin(lines.surface, belts)):
            belt = lines.of(k)
            gap = float(belt.gap(end))
            # Surfaces that cross are another warning.
            if not 0.0 < gap < GRAINS * largest or belt.away(end)[1] <= 0.0:
                continue
            path = f"{scene.head('plate', number)}.below"
            # Raise its end by what is missing, rounded to 1 mm.
            (length,) = lines.length[lines.surface == machine.surfaces.index(name)]
            shorter = (GRAINS * largest - gap) / cos(radians(plate.angle_deg))
            settings = {path: float(np.floor(1e3 * (length - plate.above - shorter)) / 1e3)}
            try:
                build(scene.with_values({**settings, "expect": None}))
            except SceneError:
                settings = {}
            yield Advice(
                f"{name}: its lower end leaves {write_size(gap, 'm')} above"
                f" {machine.surfaces[lines.surface[k]]}, less than {GRAINS:.0f} grains of up to"
                f" {write_size(largest, 'm')}: a stream may jam there",
                f"{path} = {settings[path]:g}" if settings else "a lower belt, or smaller grains",
                settings,
            )


def _beyond_walls(scene: Scene, machine: Machine) -> Iterator[Advice]:
    """Warn of a `fill` that walls cut into parts: particles in the smaller parts start outside."""
    starts = machine.releases
    # The surfaces at t = 0 as straight pieces: ends (P, 2, 2), m, and surface indices (P,).
    ends, owner = np.empty((0, 2, 2)), np.empty(0, dtype=np.int64)
    for part in machine.parts:
        for piece in map(part.of, np.flatnonzero(part.there(0.0))):
            way = piece.path()
            ends = np.concatenate([ends, np.stack([way[:-1], way[1:]], axis=1)])
            owner = np.append(owner, np.full(len(way) - 1, piece.surface))
    for number, stream in enumerate(scene.streams):
        if stream.fill is None:
            continue
        low, high = np.array(stream.fill)
        own = starts.position[starts.stream == number]
        parts, blocked = _parts(low, high, ends)
        column, row = np.clip((own - low) / (high - low) * CELLS, 0, CELLS - 1).astype(int).T
        counts = np.bincount(parts[row, column], minlength=CELLS * CELLS)
        outside = len(own) - counts.max()
        if not outside:
            continue
        held = counts[parts] > 0
        names = {
            machine.surfaces[owner[wall]]
            for (a, b), wall in blocked
            if parts[a] != parts[b] and (held[a] or held[b])
        }
        path = f"{scene.head('stream', number)}.fill"
        yield Advice(
            f"{path} reaches through {' and '.join(sorted(names))}: {outside} of {len(own)}"
            " particles start beyond",
            f"if it is meant, leave it; or a smaller {path}, or fewer particles",
            {},
        )


Side = tuple[tuple[int, int], tuple[int, int]]
"""Two cells (row, column) beside each other."""


def _parts(low: Floats, high: Floats, walls: Floats) -> tuple[Ints, list[tuple[Side, int]]]:
    """Return the part of a box, cut by walls, that each cell (row, column) belongs to.

    Cells beside each other are in one part unless a wall runs between their middles. Also those
    pairs of cells, and which wall.
    """
    scaled = (walls - low) / (high - low) * CELLS - 0.5  # middles are whole numbers
    open_: list[Bools] = []
    blocked: list[tuple[Side, int]] = []
    lines = np.arange(CELLS)[:, None]
    for axis in (0, 1):
        (a, c), (b, d) = scaled[:, 0].T[[axis, 1 - axis]], scaled[:, 1].T[[axis, 1 - axis]]
        crosses = (np.minimum(c, d) <= lines) & (lines < np.maximum(c, d))
        at, wall = np.nonzero(crosses)
        share = (at - c[wall]) / (d[wall] - c[wall])
        between = np.floor(a[wall] + share * (b[wall] - a[wall])).astype(int)
        inside = (between >= 0) & (between < CELLS - 1)
        free = np.ones((CELLS, CELLS - 1), dtype=bool)
        free[at[inside], between[inside]] = False
        open_.append(free)
        found = (at[inside].tolist(), between[inside].tolist(), wall[inside].tolist())
        for line, k, which in zip(*found, strict=True):
            pair = ((line, k), (line, k + 1)) if axis == 0 else ((k, line), (k + 1, line))
            blocked.append((pair, which))
    # Numbers of cells; connected cells have the same number.
    across, up = open_[0], open_[1].T
    label = np.arange(CELLS * CELLS).reshape(CELLS, CELLS)
    while True:
        before = label.copy()
        for one, other, side in (
            (label[:, :-1], label[:, 1:], across), (label[:-1], label[1:], up)
        ):  # fmt: skip
            np.copyto(one, np.minimum(one, other), where=side)
            np.copyto(other, np.minimum(one, other), where=side)
        if (label == before).all():
            return label, blocked


def advice(
    scene: Scene, machine: Machine, tried: Trial, steps: Stepping | None, cost: Effort
) -> Iterator[Advice]:
    """Yield warnings about a scene that works; `steps` is None for the exact engine."""
    for caution in machine.warnings[:MOST_CAUTIONS]:
        mended: Settings = {}
        for settings in _candidates(scene, machine, caution):
            with suppress(SceneError):
                changed = build(scene.with_values({**settings, "expect": None}))
                if len(changed.warnings) < len(machine.warnings):
                    mended = settings
                    break
        yield _advised(str(caution), mended, otherwise=LEAVE if caution.crosses else LOOK)
    if (more := len(machine.warnings) - MOST_CAUTIONS) > 0:
        yield _advised(f"{more:,} further pairs of surfaces cross", otherwise=LEAVE)
    passing = passings(machine, tried.recording)
    for one in passing[:MOST_CAUTIONS]:
        yield _through(scene, machine, one)
    if (more := len(passing) - MOST_CAUTIONS) > 0:
        yield _advised(f"{more:,} further pairs of surfaces pass through", otherwise=ROOM)
    yield from _densities(scene)
    yield from places(scene, machine)
    if steps is not None and not steps.safe and steps.way is not None and steps.longest is not None:
        yield _advised(
            f"a particle covers {write_size(steps.way, 'm')} in a step, but a surface catches it"
            f" only within {write_size(steps.bound, 'm')}: it may pass through",
            {"run.align": True},
            after=f", or run.dt = {_down(0.9 * steps.longest):g}",
        )
    if steps is not None and scene.particle.radius < SMALL:
        small = write_size(SMALL, "m")
        warning = f"particles of less than {small} radius are beyond what pymunk resolves"
        if scene.crowded:
            yield _advised(warning, {"particle.radius": SMALL})
        else:
            yield _advised(warning, {"run.engine": "auto"}, after=", for the exact engine")
    # If particles may pass through a surface, their ends need no further warning.
    if tried.recording is not None and (steps is None or steps.safe):
        yield from _ending(scene, machine, tried.recording)
    if tried.trouble:
        yield _advised(f"a trial run did not come to an end: {tried.trouble}")
    there = inf  # bytes of the machine's memory, where that can be told
    with suppress(AttributeError, ValueError, OSError):
        there = float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    if cost.memory > there:
        yield Advice(
            f"the run may need {cost.memory / 1e9:.2g} GB of memory, and the machine has"
            f" {there / 1e9:.2g} GB",
            "a smaller stream.count, or an earlier run.until; chutelab run --max-seconds stops a"
            " run and keeps what is recorded",
            {},
        )
    if tried.recording is not None:
        yield from _waiting(scene, tried.recording)
    start, rides = machine.releases, machine.releases.carried
    radius = np.broadcast_to(machine.particle.radius, machine.count)[rides]
    pressed = squeeze(scene, start.t[rides], start.position[rides], radius)
    if pressed is not None and scene.incoming is not None:
        # Do not recommend another speed: that would be another machine.
        yield _advised(
            f"of {machine.count} particles, {pressed}",
            {"incoming.friction": ON_RUBBER},
            after=", or what the material has on the belt: then layers push each other",
        )
    if scene.run.engine == "pymunk" and not machine.interact and machine.count > 1:
        yield _advised(
            f"pymunk steps {machine.count} particles one after the other, in about"
            f" {cost.seconds:.2g} s",
            {"run.engine": "auto"},
            after=", for the exact engine, which needs no steps",
        )


def _through(scene: Scene, machine: Machine, passing: Passing) -> Advice:
    """Warn of a surface that passes through another; recommend stops for a hinge."""
    warning = f"{passing}; a particle between them has nowhere to go"
    mover = machine.mover(machine.surfaces.index(passing.surface))
    if mover is None or mover.hinge is None:
        return _advised(warning, otherwise=ROOM)
    stops = [stop if abs(stop) <= pi else copysign(pi, stop) for stop in mover.hinge.stops]
    for one in turned(machine, mover, (stops[0], stops[1])):
        side = int(one.turned > 0.0)
        stops[side] = min(stops[side], one.turned, key=abs)
    # A stop at which it only touches, to 0.1 degrees.
    whole = [int(10.0 * degrees(stop)) / 10.0 for stop in stops]
    plates = {plate.name or "plate": n for n, plate in enumerate(scene.plates)}
    head = f"surface.{passing.surface}"
    if passing.surface in plates:
        head = scene.head("plate", plates[passing.surface])
    settings: Settings = {f"{head}.stops_deg": whole}
    try:
        build(scene.with_values({**settings, "expect": None}))
    except SceneError:
        settings = {}
    return _advised(
        warning, settings, after="; if no particle comes between them, leave it", otherwise=ROOM
    )


def _advised(
    warning: str, settings: Settings | None = None, *, after: str = "", otherwise: str = LOOK
) -> Advice:
    """Describe settings in words, with remarks; or say what to do if there are none."""
    written = [
        f"{key} = {f'{value:.6g}' if isinstance(value, float) else shown(value)}"
        for key, value in (settings or {}).items()
    ]
    return Advice(warning, " and ".join(written) + after if written else otherwise, settings or {})


def _candidates(scene: Scene, machine: Machine, caution: Caution) -> Iterator[Settings]:
    """Yield settings that might remove a warning about the machine, the smallest change first."""
    plate, out, pulley, r = (
        scene.plate,
        scene.outgoing,
        machine.pulley,
        machine.particle.of(0).radius,
    )
    if caution.surface == "plate" and plate is not None and pulley is not None:
        if caution.crosses == DRIVE_PULLEY:
            for share in (1.25, 1.5, 2.0, 4.0):
                yield {"plate.distance": _up(share * plate.distance)}
        elif not caution.crosses and isnan(caution.hit):
            for share in (0.9, 0.75, 0.5, 0.25, 0.0) if plate.angle_deg > 0.0 else ():
                yield {"plate.angle_deg": round(share * plate.angle_deg, 1)}
            for share in (0.5, 0.25, 0.1):
                yield {"plate.distance": _down(share * plate.distance)}
        elif not caution.crosses:
            off = abs(caution.hit) + MARGIN
            yield {"plate.above" if caution.hit > 0.0 else "plate.below": _up(off)}
            if out is not None:
                # The belt is so high that the plate above it ends too early.
                room = off + max(0.05, 3.0 * r)
                yield {"outgoing.drop": _up(pulley.radius - (plate.pivot_height or 0.0) + room)}
    elif caution.surface == "outgoing" and out is not None and pulley is not None:
        if caution.crosses == DRIVE_PULLEY:
            deeper = _belt_height(machine) + pulley.radius + 2.0 * r + MARGIN
            yield {"outgoing.drop": _up(out.drop + deeper)}
        elif caution.crosses == "plate" and plate is not None:
            clear = (plate.pivot_height or 0.0) - _belt_height(machine) - max(MARGIN, 3.0 * r)
            yield {"plate.below": _down(max(clear, 0.0) / cos(radians(plate.angle_deg)))}
    two = [caution.surface, caution.crosses]
    for free in scene.surface:
        other = two[free.name == two[0]]
        # An arc has no points; a straight one may be cut off before it.
        if free.points and free.name in two and other in machine.surfaces:
            for points in _shortened(np.array(free.points), machine, machine.surfaces.index(other)):
                yield {f"surface.{free.name}.points": points}


def _shortened(points: Floats, machine: Machine, other: int) -> Iterator[list[list[float]]]:
    """Yield a polyline with its last or first piece cut off before it crosses another surface."""
    room = max(MARGIN, 3.0 * float(np.max(machine.particle.radius)))
    for end, inner in ((-1, -2), (0, 1)):
        a, b = points[inner], points[end]
        for k in np.flatnonzero(machine.segments.surface == other):
            start, (tx, ty) = machine.segments.start[k], machine.segments.tangent[k]
            across = np.array([-ty, tx])
            towards = float((b - a) @ across)
            if towards == 0.0:
                continue
            share = float((start - a) @ across) / towards - room / abs(towards)
            if 0.0 < share < 1.0:
                cut = points.copy()
                cut[end] = np.round(a + share * (b - a), 4)
                yield cut.tolist()


def _belt_height(machine: Machine) -> float:
    """Return y of the outgoing belt, m."""
    return float(machine.segments.start[machine.segments.surface == machine.landing][0, 1])


def _waiting(scene: Scene, recording: Recording) -> Iterator[Advice]:
    """Advise on releases that wait, unless they come slower by less than `MARGIN`."""
    waited, stream = waits(recording), scene.stream
    if waited is None:
        return
    released = int(np.count_nonzero(recording.released))
    # Each waits for all that waited before it.
    later = waited.longest / max(1, released - 1)
    if later * stream.rate <= MARGIN:
        return
    rate: Any = (1.0 - MARGIN) / (1.0 / stream.rate + later)
    # In the unit in which it was given.
    tonnes = 3.6 * (stream.mass_rate or 0.0) * (rate / stream.rate)
    rate = f"{_down(tonnes):g} t/h" if stream.mass_rate is not None else _down(rate)
    key = "stream.rate" if len(scene.streams) == 1 else "stream[0].rate"
    yield _advised(
        f"of {released} particles tried, {waited}",
        {key: rate},
        after=", or a larger stream.bed_height",
    )


def _ending(scene: Scene, machine: Machine, tried: Recording) -> Iterator[Advice]:
    """Yield warnings about the ends of the trial's particles."""
    ended = [REASONS[reason] for reason in tried.ended.tolist()]
    gone, late = ended.count("exit"), ended.count("time") + ended.count("unreleased")
    lone = len(ended) == 1
    subject = "the particle" if lone else f"of {len(ended)} particles tried,"
    out = scene.outgoing
    if gone and out is not None:
        settings: Settings = {}
        # Where they are at the height of the belt for the last time, x, m.
        level, there = _belt_height(machine) + machine.particle.of(0).radius, Places(tried)
        crossed: list[float] = []
        for particle in np.flatnonzero(tried.ended == EXIT)[:SOME]:
            clock = tried.track(particle)["t"]
            times = np.linspace(clock[0], clock[-1], 2000)
            x, y = there.on(np.full(len(times), particle), times).T
            crossed += x[y >= level][-1:].tolist()
        if crossed:
            first = min(out.start, floor(10.0 * (min(crossed) - LANDING_ROOM)) / 10.0)
            last = max(out.start + out.length, ceil(10.0 * (max(crossed) + LANDING_ROOM)) / 10.0)
            settings = {"outgoing.start": first} if first < out.start else {}
            if settings or last > out.start + out.length:
                settings["outgoing.length"] = last - first
        came = np.isfinite(arrivals(tried)["t"]) & (tried.ended == EXIT)
        for many, what, are in (
            (gone - int(came.sum()), "miss", "misses"),
            (int(came.sum()), "go over an end of", "goes over an end of"),
        ):
            if many:
                yield _advised(
                    f"{subject} {are if lone else f'{many} {what}'} the outgoing belt", settings
                )
    if late and machine.until != "time":
        what = "has landed" if machine.until == "landed" else "is at rest"
        yield _advised(
            f"{subject} {'is' if lone else f'{late} are'} stopped at t = {machine.end_time:.6g} s"
            f" by run.max_time, before it {what}",
            {"run.max_time": _up(10.0 * scene.run.max_time)},
            after=f", or if it goes on for ever, run.until = {machine.end_time:g}",
        )


def _up(value: float) -> float:
    """Round up to three digits."""
    step = 10.0 ** (floor(log10(abs(value))) - 2) if value else 1.0
    return float(f"{ceil(value / step - 1e-9) * step:.3g}")


def _down(value: float) -> float:
    """Round down to three digits."""
    return -_up(-value)


def preflight(scene: AnyScene) -> Preflight:
    """Look at a scene before it runs.

    Besides the set-up it takes some 2 s of processor time at most: a trial run is cut off after
    1 s; loads are counted in shorter ones.

    Raises
    ------
    SceneError
        If the geometry contradicts itself.
    """
    scene = load(scene)
    begin, before = process_time(), peak()
    machine = build(scene)
    setup = process_time() - begin
    engine = choose(machine)
    tried = trial_run(machine, engine)
    grown = peak() - before
    if scene.run.engine != "auto":
        why = f'run.engine = "{engine}" asks for it'
    elif engine == "pymunk":
        why = unjoined(machine) if machine.joints else ""
        why = why or "the contact engine does not have all of it with boxes and polygons"
    elif machine.joints:
        why = "the exact engine has no strings, rods, springs and pins"
    elif scene.cornered:
        why = "the exact engine has no boxes and polygons"
    elif machine.interact:
        why = "particles meet each other, which the exact engine cannot run"
    elif machine.count == 1:
        why = "a single particle meets only surfaces"
    else:
        why = "particles do not meet each other"
    if tried.recording is not None and tried.recording.engine != engine:
        engine = tried.recording.engine
        why = "the exact engine cannot run a spinning disk between two surfaces of which one moves"
    ends = f"at t = {machine.end_time:.6g} s"
    if machine.until != "time":
        what = "each particle when it has landed or has left the scene"
        if machine.until == "settled":
            what = "each particle when it is at rest or has left the scene"
            if machine.interact:
                what = "when all are at rest or have left the scene"
        ends = f"{what}, at most {ends}"
    steps = None if engine == "exact" else stepping(machine, engine, tried)
    cost = effort(machine, tried, setup, grown)
    cost = replace(cost, extras=tuple(extras(machine, tried, cost)))
    return Preflight(
        title=scene.title,
        built=tuple(built(machine)),
        skipped=tuple(skipped(scene, machine, engine, tried.recording)),
        engine=engine,
        why=why,
        ends=ends,
        stepping=steps,
        effort=cost,
        theory=coverage(scene),
        advice=tuple(advice(scene, machine, tried, steps, cost)),
    )
