"""A trial run of a stream's first particles, cut off after a moment."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING

from chutelab import scene as scenes
from chutelab.recorder import StalledError
from chutelab.scene import SceneError
from chutelab.simulation import simulate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from chutelab.recording import Recording
    from chutelab.scene import Scene

PATIENCE = 0.12
"""s of trial run at most: the look as a whole is to take less than half a second."""

INDEPENDENT, CROWD, ALONE = 16, 24, 1
"""Particles of a trial: not colliding, colliding, and one after the other in pymunk."""

WARMING = 0.05
"""s; a trial shorter than this is run once more, because its first time is mostly warming up."""


class _EnoughError(Exception):
    """The trial has taken its time."""


@dataclass(frozen=True)
class Trial:
    """A run of a stream's first particles.

    Attributes
    ----------
    count : int
        How many there were.
    recording : Recording or None
        None if it was cut off.
    seconds : float
        Time it took once warm, or had taken when it was cut off.
    rounds : int
        Rounds of the exact engine, if it was cut off.
    warming : float
        s that its first time took longer.
    landed : bool
        Whether it ended with the landings, though the scene goes on until all is at rest: coming to
        rest takes a crowd of any size too long for a trial.
    lone : Recording or None
        Particle 0 by itself, to the end and not stepped where that can be had; None if it would
        take too long, or the trial was not stepped either.
    trouble : str
        What stopped it, if the engine did not get on; "" otherwise.
    """

    count: int
    recording: Recording | None
    seconds: float
    rounds: int = 0
    warming: float = 0.0
    landed: bool = False
    lone: Recording | None = None
    trouble: str = ""


def is_crowd(scene: Scene) -> bool:
    """Tell whether particles meet each other."""
    return scene.stream.interact and scene.stream.count > 1


def trial(scene: Scene, engine: str) -> Trial:
    """Run the first particles of a scene until they end, or patience does.

    Raises
    ------
    SceneError
        If the engine that the scene asks for cannot run it.
    """
    crowd = is_crowd(scene)
    most = CROWD if crowd else ALONE if engine == "pymunk" else INDEPENDENT
    count = min(scene.stream.count, most)
    landed = crowd and scene.run.until == "settled" and scene.outgoing is not None
    run = {"until": "landed"} if landed else {}
    found = _warm(_with(scene, {"count": count}, run))
    if engine == "exact":
        return found
    alone = _with(scene, {"count": 1, "interact": False}, {"engine": "auto"})
    return replace(found, landed=landed, lone=_lone(alone))


def _with(scene: Scene, stream: Mapping[str, object], run: Mapping[str, object]) -> Scene:
    """Return a scene with other keys of stream and run, without its expectations."""
    tables = scenes.to_dict(scene)
    tables.pop("expect", None)
    tables["stream"] = {**tables.get("stream", {}), **stream}
    tables["run"] = {**tables.get("run", {}), **run}
    return scenes.from_dict(tables, scene.source)


def _warm(scene: Scene) -> Trial:
    cold = _timed(scene)
    if cold.recording is None or cold.seconds > WARMING:
        return cold
    warm = _timed(scene)
    return replace(warm, warming=max(0.0, cold.seconds - warm.seconds))


def _timed(scene: Scene) -> Trial:
    begin, rounds = perf_counter(), 0

    def watch(_share: float) -> None:
        nonlocal rounds
        rounds += 1
        if perf_counter() - begin > PATIENCE:
            raise _EnoughError

    recording, trouble = None, ""
    try:
        recording = simulate(scene, None, watch)
    except StalledError as stalled:
        trouble = str(stalled)
    except _EnoughError:
        pass
    seconds = perf_counter() - begin
    return Trial(scene.stream.count, recording, seconds, rounds, trouble=trouble)


def _lone(scene: Scene) -> Recording | None:
    try:
        return _timed(scene).recording
    except SceneError:
        return None
