"""Sliders and picture together; which quantities of a scene get a slider, from where to where.

This is the only module that needs ipywidgets.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from math import isnan
from typing import Any

import ipywidgets

from chutelab.engines.exact import CornerError, run
from chutelab.machine import build
from chutelab.pictures.live.picture import UNSHOWN, View, draw, numbers, table, tracks, view_of
from chutelab.scene import Scene, SceneError, need_plain
from chutelab.util.arrays import Floats


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


def _speed(key: str, label: str, value: float, low: float) -> Control:
    return Control(key, label, min(low, value), max(2.0 * abs(value), 1.0), 0.05, value)


def _share(key: str, label: str, value: float, most: float = 1.0) -> Control:
    return Control(key, label, 0.0, max(most, value), 0.05, value)


def _friction(key: str, label: str, value: float) -> Control:
    return Control(key, label, 0.0, max(1.0, 4.0 * value), 0.05, value)


MOST_PARTICLES = 40
"""More tracks than that are a blot."""

REACH = 0.5
"""Share of the first view's size by which the sliders' ends may widen the view."""


class Board:
    """A scene with its sliders; the picture follows them.

    Parameters
    ----------
    scene : Scene
        What the sliders start from.

    Attributes
    ----------
    box : ipywidgets.VBox
        All of it.
    sliders : dict of ipywidgets.FloatSlider
        By key of the scene.
    picture, words : ipywidgets.HTML
        Picture and table; what is wrong with a setting, or empty.

    Raises
    ------
    SceneError
        If the scene cannot be run, or shown.
    """

    def __init__(self, scene: Scene) -> None:
        need_plain(scene, UNSHOWN)
        self.scene = scene.with_values(_simpler(scene))
        self.controls = controls(self.scene)
        self.view = self._view()
        self.before: list[Floats] = []
        self.sliders = {
            control.key: ipywidgets.FloatSlider(
                value=control.value,
                min=control.low,
                max=control.high,
                step=control.step,
                description=control.label,
                style={"description_width": "13em"},
                layout={"width": "34em"},
            )
            for control in self.controls
        }
        self.picture, self.words = ipywidgets.HTML(), ipywidgets.HTML()
        self.box = ipywidgets.VBox([*self.sliders.values(), self.words, self.picture])
        for slider in self.sliders.values():
            slider.observe(self.redraw, names="value")
        self.redraw()

    def redraw(self, change: dict[str, Any] | None = None) -> None:
        """Run the scene with the sliders' values, and show it; or say why that cannot be."""
        values = {key: float(slider.value) for key, slider in self.sliders.items()}
        try:
            scene = self.scene.with_values(values)
            recording = run(build(scene))
        except (SceneError, CornerError) as error:
            faults = getattr(error, "faults", [error])
            why = "; ".join(str(fault) for fault in faults)
            self._say(f"This setting cannot be run: {why}. The picture is the one before.")
            return
        drawn = draw(recording, self.view, self.before)
        self.before = tracks(recording)[:1]
        found = numbers(recording)
        lost = scene.outgoing is not None and isnan(found["x"])
        self._say("It does not land on the outgoing belt." if lost else "")
        self.picture.value = f"{drawn}{table(found).html()}"

    def _say(self, text: str) -> None:
        self.words.value = f"<b>{escape(text)}</b>" if text else ""

    def _view(self) -> View:
        """Return a view that need not jump: of the scene as it is, and at the sliders' ends."""
        view = view_of(run(build(self.scene)))
        widest = view.padded(REACH)
        for control in self.controls:
            for value in (control.low, control.high):
                try:
                    scene = self.scene.with_values({control.key: value})
                    other = view_of(run(build(scene)))
                except (SceneError, CornerError):
                    continue
                view = view.joined(other.within(widest))
        return view


def _simpler(scene: Scene) -> dict[str, Any]:
    """Return what is changed for the sliders' sake.

    A run has to take milliseconds: a few particles, none in another's way. And the outgoing belt
    stays where it is when the impact that would place it moves.
    """
    changes: dict[str, Any] = {
        "stream.interact": False,
        "stream.count": min(scene.stream.count, MOST_PARTICLES),
    }
    belt, out = scene.incoming, scene.outgoing
    if belt is not None and out is not None and out.drop_from == "impact":
        machine = build(scene.with_values(changes))
        height = machine.segments.start[machine.segments.surface == machine.landing][0, 1]
        changes["outgoing.drop_from"] = "top"
        changes["outgoing.drop"] = belt.pulley_radius - float(height)
    return changes
