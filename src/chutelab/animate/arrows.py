"""The velocity of particle 0 as an arrow, with its components."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Polygon

from chutelab.plots import style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

LONGEST = 0.10
"""Share of the picture's width that the arrow of the highest speed is long."""

SHAFT, HEAD = 1.5, 7.0
"""pt; width of an arrow's shaft, and length of its head."""

COMPONENT = 0.7
"""Share of that for the arrow of a component."""

SEEN = 0.75
"""Heads that a component must be long to be drawn, beside an arrow that it hardly differs from."""


class Arrows:
    """Three arrows that start at one point; the velocity lies over its components.

    Parameters
    ----------
    ax : Axes
        With its final limits, at equal scales.
    scale : float
        m that an arrow is long for 1 m/s; 0: none are drawn.
    """

    def __init__(self, ax: Axes, scale: float) -> None:
        self.scale = scale
        self._point = float(np.ptp(ax.get_xlim())) / ax.get_window_extent().width
        self._point *= ax.figure.dpi / 72.0
        colours = {**style.VELOCITY, "v": style.INK}
        self.arrows = {
            name: Polygon(np.zeros((1, 2)), facecolor=colour, linewidth=0.0, animated=True)
            for name, colour in colours.items()
        }
        for arrow in self.arrows.values():
            ax.add_patch(arrow)

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        return [arrow for arrow in self.arrows.values() if self.scale and arrow.get_visible()]

    def show(self, position: Floats, velocity: Floats) -> None:
        """Let the arrows start at a position, m, and show a velocity, m/s; none if it is NaN."""
        along = self.scale * velocity
        parts = {"vx": along * (1.0, 0.0), "vy": along * (0.0, 1.0), "v": along}
        least = SEEN * COMPONENT * HEAD * self._point
        # A component is drawn where there are two of them.
        two = bool((np.abs(along) > least).all())
        for name, part in parts.items():
            self.arrows[name].set_visible(bool(np.hypot(*part) > 0.0) and (two or name == "v"))
            if self.arrows[name].get_visible():
                width = self._point * (1.0 if name == "v" else COMPONENT)
                self.arrows[name].set_xy(position + outline(part, SHAFT * width, HEAD * width))

    def legend(self, ax: Axes) -> list[Line2D]:
        """Return a handle for a legend; none without arrows."""
        if not self.scale:
            return []
        return ax.plot([], [], color=style.INK, linewidth=2.0, label="velocity")


def outline(along: Floats, shaft: float, head: float) -> Floats:
    """Return the corners (7, 2) of an arrow from the origin, its head no longer than itself.

    >>> outline(np.array([4.0, 0.0]), 1.0, 2.0).tolist()[:4]
    [[0.0, 0.5], [2.0, 0.5], [2.0, 0.8], [4.0, 0.0]]
    """
    length = float(np.hypot(*along))
    head = min(head, length)
    neck, half = length - head, 0.4 * head
    x = np.array([0.0, neck, neck, length, neck, neck, 0.0])
    y = np.array([0.5 * shaft, 0.5 * shaft, half, 0.0, -half, -0.5 * shaft, -0.5 * shaft])
    tangent = along / length
    return np.asarray(x[:, None] * tangent + y[:, None] * np.array([-tangent[1], tangent[0]]))
