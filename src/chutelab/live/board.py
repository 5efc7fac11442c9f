"""Sliders and picture together."""

from __future__ import annotations

from html import escape
from math import isnan
from typing import TYPE_CHECKING, Any

import ipywidgets

from chutelab.exact import CornerError, run
from chutelab.live.controls import changed, controls
from chutelab.live.picture import draw, numbers, table, tracks, view_of
from chutelab.machine import build
from chutelab.scene import SceneError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chutelab.live.picture import View
    from chutelab.scene import Scene

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
        If the scene cannot be run.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = changed(scene, _simpler(scene))
        self.controls = controls(self.scene)
        self.view = self._view()
        self.before: list[NDArray[np.float64]] = []
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
            scene = changed(self.scene, values)
            machine = build(scene)
            recording = run(machine)
        except (SceneError, CornerError) as error:
            faults = getattr(error, "faults", [error])
            why = "; ".join(str(fault) for fault in faults)
            self._say(f"This setting cannot be run: {why}. The picture is the one before.")
            return
        drawn = draw(machine, recording, self.view, self.before)
        self.before = tracks(recording)[:1]
        found = numbers(scene, recording)
        lost = scene.outgoing is not None and isnan(found["x"])
        self._say("It does not land on the outgoing belt." if lost else "")
        self.picture.value = f"{drawn}{table(found).html()}"

    def _say(self, text: str) -> None:
        self.words.value = f"<b>{escape(text)}</b>" if text else ""

    def _view(self) -> View:
        """Return a view that need not jump: of the scene as it is, and at the sliders' ends."""
        view = view_of(self.scene, run(build(self.scene)))
        widest = view.padded(REACH)
        for control in self.controls:
            for value in (control.low, control.high):
                try:
                    scene = changed(self.scene, {control.key: value})
                    other = view_of(scene, run(build(scene)))
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
        machine = build(changed(scene, changes))
        height = machine.segments.start[machine.segments.surface == machine.landing][0, 1]
        changes["outgoing.drop_from"] = "top"
        changes["outgoing.drop"] = belt.pulley_radius - float(height)
    return changes
