"""The same scene with its inputs changed by next to nothing, to see what becomes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from chutelab import scene as scenes

if TYPE_CHECKING:
    from chutelab.scene import Scene


def disturbed(scene: Scene, share: float) -> Scene:
    """Return a scene with gravity and speeds lower by a share, a tiny one.

    Lower, because many keys have an upper bound and none of these a lower one but 0. The belt and
    what is released on it keep the same speed.
    """
    tables = scenes.to_dict(scene)
    tables.pop("expect", None)
    less = 1.0 - share
    tables["gravity"] = scene.gravity * less
    if scene.incoming is not None:
        tables["incoming"] = {**tables["incoming"], "speed": scene.incoming.speed * less}
    if scene.stream.velocity is not None:
        velocity = [component * less for component in scene.stream.velocity]
        tables["stream"] = {**tables["stream"], "velocity": velocity}
    return scenes.from_dict(tables, scene.source)


def with_step(scene: Scene, dt: float) -> Scene:
    """Return a scene with another longest step, s."""
    tables: dict[str, Any] = scenes.to_dict(scene)
    tables["run"] = {**tables.get("run", {}), "dt": dt}
    return scenes.from_dict(tables, scene.source)
