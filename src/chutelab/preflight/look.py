"""`preflight`: the look at a scene before it runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chutelab.machine import build
from chutelab.preflight.advice import advice
from chutelab.preflight.coverage import coverage
from chutelab.preflight.effort import effort
from chutelab.preflight.inventory import built, skipped
from chutelab.preflight.results import Preflight
from chutelab.preflight.stepping import stepping
from chutelab.preflight.trial import trial
from chutelab.simulation import choose

if TYPE_CHECKING:
    from chutelab.machine import Machine
    from chutelab.scene import Scene


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
        title=machine.title,
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
