"""Where everything is in the picture, and which part of the world it shows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from chutelab.animate.arrows import LONGEST
from chutelab.animate.moments import span
from chutelab.plots.sampling import subset, track_times
from chutelab.plots.window import Window, around, window_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.machine import Machine
    from chutelab.recording import Recording

    Floats = NDArray[np.float64]
    Box = tuple[float, float, float, float]

SHOWS = ("parabola", "trails", "strobe", "velocity", "energy")
"""What a picture can show besides the machine and the particles."""

INCHES = (8.0, 4.5)
"""Width and height of the picture at least: text keeps its share of it at any pixel size."""

LEAST = (320, 180)
"""Pixels below which text cannot be read."""

TRAIL = 0.07
"""Share of the window's width that the trail of the fastest particle is long."""

NAME = 0.21
"""Share of the window's width for the incoming belt's name, which stands left of the pulley."""

ROOM = 0.015
"""Share of the window's width between its edges and what moves."""


@dataclass(frozen=True)
class Layout:
    """Where everything is; boxes are left, bottom, width and height as shares of the picture.

    Attributes
    ----------
    width, height : int
        Pixels.
    title, question : str
        What stands above the scene; the question may be empty.
    shows : frozenset of str
        Some of `SHOWS`.
    window : Window
        What of the world is shown, of the shape of `view`.
    fastest : float
        m/s; particle 0's highest speed while it is in the window.
    """

    width: int
    height: int
    title: str
    question: str
    shows: frozenset[str]
    window: Window
    fastest: float

    @property
    def arrow(self) -> float:
        """Length of the arrow of the velocity for 1 m/s, m; 0: there is none."""
        return self._reach(LONGEST) if "velocity" in self.shows else 0.0

    @property
    def trail(self) -> float:
        """Time that trails reach back, s; 0: there are none."""
        return self._reach(TRAIL) if "trails" in self.shows else 0.0

    def _reach(self, share: float) -> float:
        return share * self.window.width / self.fastest if self.fastest > 0.0 else 0.0

    @property
    def dpi(self) -> float:
        """Pixels to the inch."""
        return min(self.width / INCHES[0], self.height / INCHES[1])

    @property
    def view(self) -> Box:
        """The scene."""
        return _view(self.shows, self.question)

    @property
    def bars(self) -> Box:
        """The energy bars; above them is room for their title, and the clock."""
        _, bottom, _, height = self.view
        return (0.765, 0.43, 0.225, bottom + height - 0.06 - 0.43)

    @property
    def table(self) -> Box:
        """The names and figures of the bars."""
        return (0.73, 0.125, 0.26, 0.245)


def _view(shows: frozenset[str], question: str) -> Box:
    return (0.015, 0.135, 0.675 if "energy" in shows else 0.97, 0.65 if question else 0.71)


def lay_out(
    recording: Recording,
    machine: Machine,
    *,
    width: int,
    height: int,
    title: str | None = None,
    question: str = "",
    shows: frozenset[str] = frozenset(SHOWS),
) -> Layout:
    """Choose the window such that everything that moves, arrows included, is in the picture.

    Raises
    ------
    ValueError
        If the picture is too small, or `shows` has an unknown name.
    """
    if width < LEAST[0] or height < LEAST[1]:
        raise ValueError(f"{width} x {height} pixels: allowed are at least {LEAST[0]} x {LEAST[1]}")
    if unknown := sorted(shows - set(SHOWS)):
        raise ValueError(f"show = {unknown[0]!r}: allowed are {', '.join(SHOWS)}")
    view = _view(shows, question)
    aspect = view[2] * width / (view[3] * height)
    window = window_of(recording, machine).fitted(aspect)
    position, velocity = _seen(recording, window)
    fastest = float(np.hypot(*velocity.T).max(initial=0.0))
    said = recording.title if title is None else title
    tight = Layout(width, height, said, question, shows, window, fastest)
    corners = [(window.left, window.bottom), (window.right, window.top)]
    if machine.pulley is not None:
        corners.append((-machine.pulley.radius - NAME * window.width, 0.0))
    room = ROOM * window.width
    tips = position + tight.arrow * velocity
    grown = around(np.concatenate([corners, tips - room, tips + room]))
    return replace(tight, window=grown.fitted(aspect))


def _seen(recording: Recording, window: Window) -> tuple[Floats, Floats]:
    """Return positions and velocities of particle 0, (P, 2), while it is filmed in the window.

    What has left it for good shall not make all else small.
    """
    begin, end = span(recording, window)
    times = track_times(recording, begin, min(end, float(recording.track(0)["t"][-1])))
    position, velocity = (values[:, 0] for values in subset(recording, [0]).at(times))
    inside = window.holds(position)
    return position[inside], velocity[inside]
