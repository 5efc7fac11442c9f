"""`preflight`, the look at a scene before it runs, and its warnings.

Each warning comes with what would change it: settings are tried before they are recommended.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import acos, ceil, cos, degrees, floor, log10, radians, sqrt
from typing import Any

import numpy as np

from chutelab import scene as scenes
from chutelab.checks.preflight.results import (
    Advice,
    Effort,
    Preflight,
    Stepping,
    built,
    coverage,
    skipped,
)
from chutelab.checks.preflight.trial import Trial, effort, trial
from chutelab.engines.simulation import choose
from chutelab.machine import Machine, build
from chutelab.machine.releases import squeeze
from chutelab.results import REASONS, Recording
from chutelab.results.quantities import waits
from chutelab.scene import Scene, SceneError


def stepping(machine: Machine, engine: str, *recordings: Recording | None) -> Stepping:
    """Hold the way of a step against what a surface catches.

    The contact engine finds every blow at its own instant, as the pymunk engine does for a lone
    particle with aligned steps. Otherwise a contact is seen at the end of a step, and must be
    before the centre is on the other side: surfaces have no thickness.

    Parameters
    ----------
    machine : Machine
        The scene, resolved.
    engine : {"contact", "pymunk"}
        Which one runs it.
    *recordings : Recording or None
        Trial runs, as far as there are any; the first tells the highest speed.
    """
    bound = machine.particle.radius
    recording = next((found for found in recordings if found and len(found.knots)), None)
    speed = None
    if recording is not None:
        # Not every knot has the speed just before an impact; events do.
        seen = [recording.knots["velocity"], recording.events["velocity_before"]]
        speed = float(np.hypot(*np.concatenate(seen).T).max())
    return Stepping(
        dt=machine.dt,
        aligned=engine == "contact" or (machine.align and not machine.interact),
        speed=speed,
        way=None if speed is None else speed * machine.dt,
        bound=bound,
        longest=bound / speed if speed else None,
    )


LEAVE = "if it is meant, leave it; the first contact wins"
LOOK = "look at the picture (--out DIR --only png) for what turns it away"
"""What is left to say where no setting is known to help: surfaces that cross, and others."""

SMALL = 0.002
"""m; a smaller radius is beyond what pymunk resolves in SI units."""

MARGIN = 0.01
"""m to spare beyond what would just do."""

LANDING_ROOM = 0.5
"""m of belt to spare before and behind a landing."""


def advice(
    scene: Scene,
    machine: Machine,
    tried: Trial,
    steps: Stepping | None,
    cost: Effort,
) -> Iterator[Advice]:
    """Yield what may surprise about a scene that works.

    Parameters
    ----------
    scene, machine : Scene, Machine
        The scene, and the same resolved.
    tried : Trial
        A run of its first particles.
    steps : Stepping or None
        None for the exact engine.
    cost : Effort
        What the run is estimated to cost.
    """
    for warning in machine.warnings:
        candidates = list(_candidates(scene, machine, warning))
        mended = next((setting for setting in candidates if _mends(scene, machine, setting)), None)
        otherwise = LEAVE if "crosses" in warning else LOOK
        yield Advice(warning.partition("; ")[0], _written(*mended) if mended else otherwise)
    if steps is not None:
        yield from _steps(scene, steps)
    # What passes through a surface goes astray for no other reason.
    if tried.recording is not None and (steps is None or steps.safe):
        yield from _ending(scene, machine, tried.recording)
    if tried.trouble:
        yield Advice(f"a trial run did not come to an end: {tried.trouble}", LOOK)
    if tried.recording is not None:
        yield from _waiting(scene, tried.recording)
    yield from _squeezed(scene, machine)
    if scene.run.engine == "pymunk" and not machine.interact and machine.count > 1:
        yield Advice(
            f"pymunk steps {machine.count} particles one after the other, in about"
            f" {cost.seconds:.2g} s",
            'run.engine = "auto", for the exact engine: all of them at once',
        )


def _waiting(scene: Scene, tried: Recording) -> Iterator[Advice]:
    """Yield how many of the trial's particles found their place taken, and how long they waited."""
    waited = waits(scene, tried)
    if waited is not None and waited.particles:
        # Each waits for all that waited before it.
        period = 1.0 / scene.stream.rate + waited.longest / max(1, tried.count - 1)
        slower = _down((1.0 - MARGIN) / period)
        yield Advice(
            f"of {tried.count} particles tried, {waited.particles} wait for a free place to"
            f" be released, up to {waited.longest:.3g} s",
            f"stream.rate = {slower:g}, or a larger stream.bed_height",
        )


def _squeezed(scene: Scene, machine: Machine) -> Iterator[Advice]:
    """Yield how many particles ride into others round the pulley, how deep, and why."""
    found = squeeze(scene, machine.releases.t, machine.releases.position)
    if found is None or scene.incoming is None:
        return
    highest = scene.incoming.pulley_radius + scene.particle.radius + scene.stream.bed_height
    change = f"incoming.speed = {_up(sqrt(scene.gravity * highest)):g}, to leave at the top"
    if scene.stream.bed_height > 0.0:
        change += ", or stream.bed_height = 0"
    yield Advice(
        f"of {machine.count} particles, {found.particles} ride into others round the pulley, up"
        f" to {1e3 * found.deepest:.3g} mm deep: all layers run at {scene.incoming.speed:g} m/s, "
        f"the lower ones on smaller circles, and v²/(g rho) = {found.grip:.3g} keeps the highest"
        f" there for {degrees(acos(found.grip)):.3g}°",
        change,
    )


def _written(key: str, value: Any) -> str:
    return f"{key} = {scenes.shown(value)}"


def _mends(scene: Scene, machine: Machine, setting: tuple[str, Any]) -> bool:
    """Tell whether a machine with a setting has fewer warnings."""
    key, value = setting
    try:
        changed = build(scene.with_values({key: value, "expect": None}))
    except SceneError:
        return False
    return len(changed.warnings) < len(machine.warnings)


def _candidates(scene: Scene, machine: Machine, warning: str) -> Iterator[tuple[str, Any]]:
    """Yield settings that might do away with a warning of the machine, the mildest first."""
    name, _, said = warning.partition(": ")
    if name == "plate" and scene.plate is not None:
        plate = scene.plate
        if "never meets" in said:
            if plate.angle_deg > 0.0:
                for share in (0.9, 0.75, 0.5, 0.25, 0.0):
                    yield "plate.angle_deg", round(share * plate.angle_deg, 1)
            for share in (0.5, 0.25, 0.1):
                yield "plate.distance", _round(share * plate.distance)
        elif "off the finite plate" in said:
            key = "plate.above" if "above the pivot" in said else "plate.below"
            off = float(said.partition("plate's line ")[2].partition(" m ")[0])
            yield key, _up(off + MARGIN)
            if scene.outgoing is not None and machine.pulley is not None:
                # The belt is so high that the plate above it ends too early.
                pivot = float(plate.pivot_height or 0.0)
                room = max(0.05, 3.0 * scene.particle.radius) + MARGIN
                yield "outgoing.drop", _up(machine.pulley.radius - pivot + off + room)
        elif "drive pulley" in said:
            for share in (1.25, 1.5, 2.0, 4.0):
                yield "plate.distance", _up(share * plate.distance)
    if name == "outgoing" and scene.outgoing is not None:
        height = _height(machine)
        if "drive pulley" in said and machine.pulley is not None:
            deeper = height + machine.pulley.radius + 2.0 * scene.particle.radius + MARGIN
            yield "outgoing.drop", _up(scene.outgoing.drop + deeper)
        if "crosses plate" in said and scene.plate is not None:
            pivot = float(scene.plate.pivot_height or 0.0)
            clear = pivot - height - max(MARGIN, 3.0 * scene.particle.radius)
            yield (
                "plate.below",
                _down(max(clear, 0.0) / cos(radians(scene.plate.angle_deg))),
            )
    for free in scene.surface:
        if free.name in (name, said.partition("crosses ")[2].partition(";")[0]):
            yield from _shortened(free, machine, name, said)


def _shortened(free: Any, machine: Machine, name: str, said: str) -> Iterator[tuple[str, Any]]:
    """Yield a free surface with its first or last piece cut off before it crosses another."""
    other = said.partition("crosses ")[2].partition(";")[0] if name == free.name else name
    if other not in machine.surfaces:
        return
    points = [list(point) for point in free.points]
    room = max(MARGIN, 3.0 * machine.particle.radius)
    for end, inner in ((-1, -2), (0, 1)):
        for k in np.flatnonzero(machine.segments.surface == machine.surfaces.index(other)):
            start, tangent = machine.segments.start[k], machine.segments.tangent[k]
            a, b = np.array(points[inner]), np.array(points[end])
            across = np.array([-tangent[1], tangent[0]])
            towards = float((b - a) @ across)
            if towards == 0.0:
                continue
            share = float((start - a) @ across) / towards - room / abs(towards)
            if 0.0 < share < 1.0:
                cut = [round(float(value), 4) for value in a + share * (b - a)]
                changed = [*points[:-1], cut] if end == -1 else [cut, *points[1:]]
                yield f"surface.{free.name}.points", changed


def _height(machine: Machine) -> float:
    """Return y of the outgoing belt, m."""
    return float(machine.segments.start[machine.segments.surface == machine.landing][0, 1])


def _ending(scene: Scene, machine: Machine, tried: Recording) -> Iterator[Advice]:
    """Yield what is odd about how the trial's particles end."""
    ended = [REASONS[reason] for reason in tried.ended.tolist()]
    gone, late = ended.count("exit"), ended.count("time")
    who = "the particle" if len(ended) == 1 else f"of {len(ended)} particles tried,"
    if gone and scene.outgoing is not None:
        found = _below_the_belt(machine, tried, ended)
        if found is not None:
            start, length = scene.outgoing.start, scene.outgoing.length
            first = min(start, floor(10.0 * (min(found) - LANDING_ROOM)) / 10.0)
            last = max(start + length, ceil(10.0 * (max(found) + LANDING_ROOM)) / 10.0)
            changes = [f"outgoing.start = {first:.6g}"] if first < start else []
            if last > start + length or first < start:
                changes.append(f"outgoing.length = {last - first:.6g}")
            change = " and ".join(changes) or LOOK
        else:
            change = LOOK
        many = "misses" if len(ended) == 1 else f"{gone} miss"
        yield Advice(f"{who} {many} the outgoing belt", change)
    if late and machine.until != "time":
        many = "is" if len(ended) == 1 else f"{late} are"
        bound = machine.end_time
        what = "has landed" if machine.until == "landed" else "is at rest"
        yield Advice(
            f"{who} {many} stopped at t = {bound:.6g} s by run.max_time, before it {what}",
            f"run.max_time = {_up(10.0 * scene.run.max_time):g}, or if it goes on for ever,"
            f" run.until = {bound:g}",
        )


def _below_the_belt(machine: Machine, tried: Recording, ended: list[str]) -> list[float] | None:
    """Return x where particles that leave cross the belt's height for the last time, m."""
    level = _height(machine) + machine.particle.radius
    found = []
    for particle, reason in enumerate(ended):
        if reason != "exit":
            continue
        track = tried.track(particle)
        times = np.linspace(track["t"][0], track["t"][-1], 2000)
        places = tried.at(times)[0][:, particle]
        above = np.flatnonzero(places[:, 1] >= level)
        if len(above):
            found.append(float(places[above[-1], 0]))
    return found or None


def _steps(scene: Scene, steps: Stepping) -> Iterator[Advice]:
    """Yield what is odd about finite steps."""
    if not steps.safe and steps.way is not None and steps.longest is not None:
        yield Advice(
            f"a particle covers {1e3 * steps.way:.3g} mm in a step, but a surface catches it only"
            f" within {1e3 * steps.bound:.3g} mm: it may pass through",
            f"run.align = true, or run.dt = {_down(0.9 * steps.longest):g}",
        )
    if scene.particle.radius < SMALL:
        yield Advice(
            f"particles of less than {1e3 * SMALL:g} mm radius are beyond what pymunk resolves",
            f"particle.radius = {SMALL:g}"
            if scene.stream.interact and scene.stream.count > 1
            else 'run.engine = "auto", for the exact engine',
        )


def _step(value: float) -> float:
    """Return the unit of the third significant digit."""
    return float(10.0 ** (floor(log10(abs(value))) - 2)) if value else 1.0


def _round(value: float) -> float:
    return float(f"{value:.2g}")


def _up(value: float) -> float:
    """Round up to three digits."""
    step = _step(value)
    return float(f"{ceil(value / step - 1e-9) * step:.3g}")


def _down(value: float) -> float:
    """Round down to three digits."""
    step = _step(value)
    return float(f"{floor(value / step + 1e-9) * step:.3g}")


def preflight(scene: Scene) -> Preflight:
    """Look at a scene before it runs.

    Takes less than half a second, of which a trial run of a few particles is the most.

    Raises
    ------
    SceneError
        If the geometry contradicts itself.
    """
    machine = build(scene)
    engine = choose(machine)
    tried = trial(scene, engine)
    recording = tried.recording
    why = _why(scene, machine, engine)
    if recording is not None and recording.engine != engine:
        engine = recording.engine
        why = "a spinning disk between surfaces of which one moves is beyond the exact engine"
    steps = None if engine == "exact" else stepping(machine, engine, tried.lone, recording)
    cost = effort(scene, engine, tried)
    return Preflight(
        title=machine.scene.title,
        built=tuple(built(machine)),
        skipped=tuple(skipped(scene, machine, engine)),
        engine=engine,
        why=why,
        ends=_ends(machine),
        stepping=steps,
        effort=cost,
        theory=coverage(scene),
        advice=tuple(advice(scene, machine, tried, steps, cost)),
    )


def _why(scene: Scene, machine: Machine, engine: str) -> str:
    if scene.run.engine != "auto":
        return f'run.engine = "{engine}" asks for it'
    if machine.interact:
        return "particles meet each other, which the exact engine does not follow"
    if machine.count == 1:
        return "a lone particle meets surfaces only"
    return "particles do not meet each other"


def _ends(machine: Machine) -> str:
    if machine.until == "time":
        return f"at t = {machine.end_time:.6g} s"
    what = {"landed": "each particle when it has landed", "settled": "each particle at rest"}
    if machine.interact and machine.until == "settled":
        what["settled"] = "when all are at rest"
    return f"{what[machine.until]} (or gone), at most at t = {machine.end_time:.6g} s"
