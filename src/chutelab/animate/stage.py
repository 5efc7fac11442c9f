"""The picture of the film: a background drawn once, and the artists that move on it."""

from __future__ import annotations

from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from chutelab.animate.actors import Crowd, Drives, Nominal
from chutelab.animate.bars import Bars
from chutelab.plots import style
from chutelab.plots.panels import analytic_of, draw_analytic
from chutelab.plots.sampling import energies, round_step
from chutelab.plots.scenery import draw_scene

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from chutelab.animate.moments import Moment
    from chutelab.machine import Machine
    from chutelab.plots.window import Window
    from chutelab.recording import Recording
    from chutelab.theory import Transfer

HEIGHT = 4.5
"""Inches that every picture is high: text keeps its share of the picture at any pixel size."""

VIEW = (0.015, 0.135, 0.675, 0.71)
BARS = (0.765, 0.43, 0.225, 0.415)
TABLE = (0.73, 0.125, 0.26, 0.245)
"""Left, bottom, width and height of the three parts, as shares of the picture."""


class Stage:
    """Draws the moments of a film.

    Parameters
    ----------
    recording : Recording
        From either engine.
    machine : Machine
        The one it was made on.
    prediction : Transfer
        For the analytic parabola.
    window : Window
        What to show.
    moments : tuple of Moment
        The film.
    slow : float
        Seconds on the screen for one second of the recording.
    width, height : int
        Pixels.
    """

    def __init__(
        self,
        recording: Recording,
        machine: Machine,
        prediction: Transfer,
        window: Window,
        moments: tuple[Moment, ...],
        *,
        slow: float,
        width: int,
        height: int,
    ) -> None:
        self.moments = moments
        self.pace = pace_words(slow)
        times = np.array([moment.t for moment in moments])
        # A hundredth of a pixel more: the canvas rounds down.
        inch = HEIGHT / height
        self.figure = Figure(figsize=((width + 0.01) * inch, (height + 0.01) * inch), dpi=1 / inch)
        self.canvas = _canvas(self.figure)
        self.view = self.figure.add_axes(VIEW)
        _draw_background(self.view, recording, machine, prediction, window)
        self.drives = Drives(self.view, machine)
        self.crowd = Crowd(self.view, recording, times)
        self.nominal = Nominal(self.view, recording)
        self.bars = Bars(
            self.figure.add_axes(BARS), self.figure.add_axes(TABLE), energies(recording, times)
        )
        self._add_legend()
        self._add_text(recording.title)
        self.canvas.draw()
        self._background = self.canvas.copy_from_bbox(self.figure.bbox)

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        actors = (self.drives, self.crowd, self.nominal, self.bars)
        return [*(artist for actor in actors for artist in actor.artists), self.clock, self.words]

    def show(self, index: int) -> None:
        """Move the artists to one moment."""
        moment = self.moments[index]
        self.drives.show(moment.t)
        self.crowd.show(index)
        self.nominal.show(moment.t)
        self.bars.show(index)
        self.clock.set_text(f"t = {moment.t:.3f} s, {self.pace}")
        self.words.set_text(moment.words)

    def frame(self, index: int) -> NDArray[np.uint8]:
        """Return the picture of one moment, (height, width, 3)."""
        self.show(index)
        self.canvas.restore_region(self._background)
        renderer = self.canvas.get_renderer()
        for artist in self.artists:
            artist.draw(renderer)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()

    def _add_legend(self) -> None:
        parabola = [line for line in self.view.lines if line.get_gid() == "analytic"]
        for line in parabola:
            line.set_label("analytic")
        self.view.legend(
            handles=[*self.nominal.legend(self.view), *parabola, *self.crowd.legend(self.view)],
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=4,
            fontsize=style.SMALL,
            frameon=False,
            borderaxespad=0.1,
            handlelength=1.8,
            columnspacing=1.2,
            handletextpad=0.5,
        )

    def _add_text(self, title: str) -> None:
        text = self.figure.text
        said = shorten(title, 52, placeholder=" …")
        text(0.02, 0.955, said, fontsize=style.LARGE, fontweight="bold", va="center")
        self.clock = text(0.99, 0.955, "", fontsize=style.NORMAL, ha="right", va="center")
        self.words = text(0.02, 0.055, "", fontsize=style.NORMAL, va="center", linespacing=1.25)
        for moving in (self.clock, self.words):
            moving.set_animated(True)


def _canvas(figure: Figure) -> Any:
    """Return a canvas of Agg; its drawing methods are not annotated."""
    return FigureCanvasAgg(figure)


def pace_words(slow: float) -> str:
    """Return how the film's clock runs.

    >>> pace_words(10.0), pace_words(1.0), pace_words(0.5)
    ('10× slower', 'real time', '2× faster')
    """
    if slow == 1.0:
        return "real time"
    return f"{slow:.3g}× slower" if slow > 1.0 else f"{1.0 / slow:.3g}× faster"


def _draw_background(
    ax: Axes, recording: Recording, machine: Machine, prediction: Transfer, window: Window
) -> None:
    draw_scene(ax, machine, window)
    ax.set_xticks([])
    ax.set_yticks([])
    for spine in ax.spines.values():
        spine.set_color(style.STEEL_LIGHT)
    parts, _ = analytic_of(recording, prediction)
    draw_analytic(ax, parts)
    _draw_scale(ax)


def _draw_scale(ax: Axes) -> None:
    """Draw a bar of round length in the upper left corner: the picture has no ticks."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    length = round_step(right - left, 6)
    x, y = left + 0.015 * (right - left), top - 0.08 * (top - bottom)
    ax.plot([x, x + length], [y, y], color=style.MUTED, linewidth=2.0, solid_capstyle="butt")
    ax.text(
        x + 0.5 * length,
        y + 0.012 * (top - bottom),
        f"{length:g} m",
        fontsize=style.SMALL,
        color=style.MUTED,
        ha="center",
        va="bottom",
    )
