"""Which quantities of a scene get a slider, from where to where."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chutelab.scene import overridden

if TYPE_CHECKING:
    from collections.abc import Mapping

    from chutelab.scene import Scene


@dataclass(frozen=True)
class Control:
    """One slider.

    Attributes
    ----------
    key : str
        Of the scene, as in ``plate.angle_deg``.
    label : str
        Name, symbol and unit.
    low, high, step, value : float
        Where it reaches from and to, and where it stands at first; in the key's unit.
    """

    key: str
    label: str
    low: float
    high: float
    step: float
    value: float


def controls(scene: Scene) -> tuple[Control, ...]:
    """Return the sliders of a scene: plate angle, belt speeds, ε and µ of what it has."""
    found = []
    belt, plate, out = scene.incoming, scene.plate, scene.outgoing
    if belt is not None:
        # A slipping ride is followed in steps: a crawl takes longer than anybody waits.
        slowest = 0.5 if belt.friction == "adhesion" else 0.6 * belt.speed
        found.append(_speed("incoming.speed", "belt speed v0 (m/s)", belt.speed, slowest))
        if belt.friction != "adhesion":
            found.append(_friction("incoming.friction", "grip µ of the belt", belt.friction))
    if plate is not None:
        angle = plate.angle_deg
        found += [
            Control(
                "plate.angle_deg",
                "plate angle α (°)",
                min(-20.0, angle),
                max(75.0, angle),
                1.0,
                angle,
            ),
            _share("plate.restitution", "restitution ε", plate.restitution),
            _friction("plate.friction", "friction µ of the plate", plate.friction),
        ]
    if out is not None:
        found += [
            _speed("outgoing.speed", "outgoing speed v_b (m/s)", out.speed, -2.0 * abs(out.speed)),
            _friction("outgoing.friction", "friction µ of that belt", out.friction),
        ]
    for i, surface in enumerate(scene.surface):
        # With more, what falls on a floor bounces hundreds of times.
        label = f"restitution ε of {surface.name}"
        found.append(_share(f"surface[{i}].restitution", label, surface.restitution, 0.9))
    return tuple(found)


def changed(scene: Scene, values: Mapping[str, float | bool | str]) -> Scene:
    """Return a scene with other values.

    Parameters
    ----------
    scene : Scene
        The one to start from.
    values : mapping
        By key.

    Raises
    ------
    SceneError
        If it cannot be used.
    """
    overrides = [f"{key}={json.dumps(value)}" for key, value in values.items()]
    return overridden(scene, overrides)


def _speed(key: str, label: str, value: float, low: float) -> Control:
    return Control(key, label, min(low, value), max(2.0 * abs(value), 1.0), 0.05, value)


def _share(key: str, label: str, value: float, most: float = 1.0) -> Control:
    return Control(key, label, 0.0, max(most, value), 0.05, value)


def _friction(key: str, label: str, value: float) -> Control:
    return Control(key, label, 0.0, max(1.0, 4.0 * value), 0.05, value)
