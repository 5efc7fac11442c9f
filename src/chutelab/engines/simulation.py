"""From a scene to a recording: choosing the engine."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace
from math import inf
from time import perf_counter

import numpy as np

from chutelab.machine import Machine, ahead
from chutelab.results import Recording, rows
from chutelab.results.recorder import EnoughError, StalledError
from chutelab.scene import AnyScene, Fault, Overrides, Scene, SceneError, load
from chutelab.scene.overrides import Override
from chutelab.util.arrays import Progress
from chutelab.util.errors import LawWarning
from chutelab.util.signals import ctrl_c_waits

ENGINES = ("auto", *rows.ENGINES)


def choose(machine: Machine, engine: str | None = None) -> str:
    """Return the engine that runs first: exact, unless the scene needs or asks for another.

    `engine` overrides the scene's ``run.engine``. Raises a `ValueError` if there is no such engine.
    """
    wanted = machine.engine if engine is None else engine
    if wanted not in ENGINES:
        raise ValueError(f"engine = {wanted!r}: one of {', '.join(ENGINES)}")
    if wanted != "auto":
        return wanted
    if machine.scene.cornered or machine.joints:
        lacks = any(uncornered(machine)) or (machine.joints and unjoined(machine))
        return "pymunk" if lacks else "contact"
    stepped = machine.interact or machine.movers or machine.triggers or np.any(machine.air)
    scene = machine.scene
    return "contact" if stepped or scene.clings or scene.one_sided else "exact"


def simulate(
    scene: AnyScene,
    changes: Overrides = (),
    *,
    engine: str | None = None,
    progress: Progress | None = None,
    max_seconds: float | None = None,
    loads: float | None = None,
) -> Recording:
    """Run a scene.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        A scene, or what `chutelab.load` makes one of: a file, a name, nested mappings.
    changes : mapping, str, or several
        Laid over the scene as `chutelab.load` does: ``{"plate.angle_deg": 20}``.
    engine : {"auto", "exact", "contact", "pymunk"}, optional
        Overrides the scene's ``run.engine``. With auto, the contact engine runs what the exact one
        cannot follow (a spinning disk between a moving surface and another); and if a run breaks a
        law of every run, the next capable engine runs instead: `Recording.instead`.
    progress : callable, optional
        Called now and then with the share of the run that is done, 0 to 1.
    max_seconds : float, optional
        Wall time, s, after which the run ends with what is recorded: particles that have not ended
        have the reason ``"stopped"``, and `results.summary.stopped` says up to when the recording
        is complete. Checked after about each step, which may take some tenths of a second with a
        large crowd.
    loads : float, optional
        Record loads on surfaces in bins of so many seconds, like ``run.loads``; `Recording.loads`.

    Returns
    -------
    Recording
        The same scene, seed and engine give the same numbers to the last bit; only `seconds`, the
        wall time from the validated scene to the recording, differs.

    Raises
    ------
    SceneError
        If the scene cannot be loaded, its geometry contradicts itself, or the engine cannot run it;
        if `max_seconds` are over before all particles have a place to start from.
    ValueError
        If `max_seconds` is not a finite number above 0, or there is no such engine.

    Exceptions that `progress` raises, and the KeyboardInterrupt of Ctrl-C, end the run; they have
    its ``recording``, as after `max_seconds`.

    Warns
    -----
    LawWarning
        For each law that the run breaks, see `Recording.laws`: what, which particle, where, when,
        and what to do.
    """
    if loads is not None:
        changes = [changes, Override("run.loads", loads)]
    recording = judged(scene, changes, engine=engine, progress=progress, max_seconds=max_seconds)
    for broken in recording.laws:
        warnings.warn(str(broken), LawWarning, stacklevel=2)
    return recording


def judged(
    scene: AnyScene,
    changes: Overrides = (),
    *,
    engine: str | None = None,
    progress: Progress | None = None,
    max_seconds: float | None = None,
) -> Recording:
    """Simulate without warnings, for callers that read `Recording.laws`."""
    began = perf_counter()
    if max_seconds is not None and not 0.0 < max_seconds < inf:
        raise ValueError(f"max_seconds = {max_seconds!r}: a finite number above 0 s")

    scene, cut = load(scene, changes), list[BaseException]()
    lone = scene.count == 1
    with ctrl_c_waits(lazily=lone) as interrupted:

        def look() -> None:
            interrupted()
            if max_seconds is not None and perf_counter() - began > max_seconds:
                raise EnoughError

        def watched(share: float) -> None:
            try:
                if progress is not None:
                    progress(share)
                if share < 1.0 or not lone:
                    look()
            except EnoughError:
                raise
            except BaseException as error:
                cut.append(error)
                raise EnoughError from None

        machine = ahead(scene)
        try:
            if choose(machine, engine) == "pymunk":
                machine.finish(look)
            recording = follow(machine, engine, watched)
        except StalledError as stalled:
            if not cut or stalled.recording is None:
                raise
            recording = Recording.of(stalled.recording)
        except EnoughError:
            if cut:
                raise cut[0] from None
            counts = [stream.count for stream in scene.streams]
            most = counts.index(max(counts))
            key = f"{scene.head('stream', most)}.count"
            allowed = "fewer, or more seconds: those allowed were over before all had a place to"
            raise refused(scene, key, counts[most], f"{allowed} start") from None
        if (engine or machine.engine) == "auto" and not cut and recording.laws:
            recording = _instead(machine, recording, watched)
    # In place, since a copy would be judged again.
    object.__setattr__(recording, "seconds", perf_counter() - began)
    for error in cut:
        error.recording = recording  # type: ignore[attr-defined]
        raise error
    return recording


def _instead(machine: Machine, broken: Recording, progress: Progress | None) -> Recording:
    """Run a machine with the engines after the one that broke a law, until one keeps all laws.

    If none does, the first run stands, with its laws.
    """
    said = []
    recording, order = broken, rows.ENGINES
    for name in order[order.index(broken.engine) + 1 :]:
        said.append(
            f"{recording.engine} did not keep the laws of every run ({recording.laws[0].told})"
        )
        try:
            recording = follow(machine, name, progress)
        except (SceneError, StalledError):
            break
        if not recording.laws:
            return replace(recording, instead="; ".join(said))
    return broken


def follow(machine: Machine, engine: str | None, progress: Progress | None) -> Recording:
    """Run a machine with the engine asked for, or the one that it needs; see `simulate`."""
    name = choose(machine, engine)
    must_fit(machine, name)
    if name == "exact":
        from chutelab.engines.exact import CornerError, run

        try:
            return Recording.of(run(machine, progress))
        except CornerError as error:
            if "exact" in (engine, machine.scene.run.engine):
                allowed = f"contact, because {error}"
                raise refused(machine.scene, "run.engine", "exact", allowed) from error
            name = "contact"
            must_fit(machine, name)
    if name == "contact":
        from chutelab.engines.contact import run as stepped
    else:
        from chutelab.engines.pymunk import run as stepped
    return Recording.of(stepped(machine, progress))


def must_fit(machine: Machine, name: str) -> None:
    """Raise a `SceneError` if an engine lacks a feature that the machine needs."""
    scene = machine.scene
    if name == "contact":
        for key, value, allowed in uncornered(machine):
            raise refused(scene, key, value, allowed)
    if name == "exact":
        for n, outline in enumerate(machine.outlines):
            if outline is not None:
                key, shape = f"{scene.head('particle', n)}.shape", scene.particles[n].shape
                allowed = 'a disk or sphere with run.engine = "exact"; contact and pymunk have it'
                raise refused(scene, key, shape, allowed)
    if name != "pymunk" and machine.joints:
        table = machine.joints[0].kind
        if name == "exact" or (why := unjoined(machine)):
            engines = "contact or pymunk" if name == "exact" else "pymunk"
            why = f"because {table}[0] joins what moves" if name == "exact" else f"because {why}"
            raise refused(scene, "run.engine", name, f"{engines}, {why}")
    if name == "exact":
        if machine.triggers:
            waits = machine.surfaces[machine.triggers[0].surface]
            allowed = f"contact or pymunk, because {waits} waits until something is touched"
            raise refused(scene, "run.engine", "exact", allowed)
        if machine.movers:
            moving = machine.surfaces[machine.movers[0].surface]
            allowed = f"contact or pymunk, because {moving} moves: no closed form has its blows"
            raise refused(scene, "run.engine", "exact", allowed)
        if scene.one_sided:
            allowed = f"contact or pymunk, because {scene.one_sided} is solid from one side"
            raise refused(scene, "run.engine", "exact", allowed)
        if machine.interact:
            allowed = "contact or pymunk, because stream.interact = true"
            raise refused(scene, "run.engine", "exact", allowed)
        if scene.clings:
            raise refused(scene, "run.engine", "exact", "contact, because a pair has cohesion")
        if machine.air:
            allowed = "0 with the exact engine: it has no closed form for a flight in air"
            raise refused(scene, "air_density", machine.air, allowed)
        return
    for n, kind in enumerate(scene.particles):
        if name == "pymunk" and kind.falls:
            allowed = "left out with the pymunk engine: Chipmunk's restitution is one number"
            key = f"{scene.head('particle', n)}.restitution_speed"
            raise refused(scene, key, kind.restitution_speed, allowed)
    if name == "pymunk" and any(joint.over for joint in machine.joints):
        allowed = "contact, because a string runs over a pulley: Chipmunk has no such joint"
        raise refused(scene, "run.engine", "pymunk", allowed)
    for n, pair in enumerate(scene.pair):
        if (pull := pair.clings) and (name == "pymunk" or scene.hinges):
            what = "the pymunk engine" if name == "pymunk" else "what hangs on hinges"
            raise refused(scene, f"pair[{n}].{pull}", getattr(pair, pull), f"0 with {what}")
    if any(scene.particles[kind].radius == 0.0 for kind in scene.kinds):
        raise refused(scene, "particle.radius", 0.0, f'more than 0 with run.engine = "{name}"')


def uncornered(machine: Machine) -> Iterator[tuple[str, object, str]]:
    """Yield what the contact engine lacks for boxes: keys, values, and why."""
    scene, why = machine.scene, "boxes and polygons; the pymunk engine has them"
    if not scene.cornered:
        return
    for n, kind in enumerate(scene.particles):
        if kind.outline and kind.rolling_friction:
            key = f"{scene.head('particle', n)}.rolling_friction"
            yield key, kind.rolling_friction, "0 with boxes and polygons: they do not roll"
    carried = set(machine.releases.kind[machine.releases.carried])
    if any(scene.particles[kind].outline for kind in carried):
        allowed = f"a Coulomb coefficient if it carries {why}"
        yield "incoming.friction", "adhesion", allowed
    for n, pair in enumerate(scene.pair):
        if pull := pair.clings:
            allowed = "0 with boxes and polygons: it pulls at the one point where round ones touch"
            yield f"pair[{n}].{pull}", getattr(pair, pull), allowed


def unjoined(machine: Machine) -> str:
    """Return why the contact engine cannot run a machine with joints, or nothing."""
    if machine.count > 1 and not machine.interact:
        return "several particles that do not meet hang on joints"
    for joint in machine.joints:
        reach = joint.reach(machine.releases.position)
        if joint.kind == "string" and reach > (1.0 + TAUT) * joint.length:
            return "a string is shorter than the distance at the release"
    return ""


TAUT = 1e-9
"""Share of its length by which a string may be too short, by rounding."""


def refused(scene: Scene, key: str, value: object, allowed: str) -> SceneError:
    """Return the error that says which part of a scene cannot be run."""
    return SceneError(scene.source, [Fault(key, value, f"must be {allowed}")])
