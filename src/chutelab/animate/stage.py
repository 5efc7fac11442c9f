"""The picture of the film: a background drawn once, and what moves on it."""

from __future__ import annotations

from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from chutelab.animate.actors import Crowd, Drives, Nominal
from chutelab.animate.bars import Bars
from chutelab.animate.lettering import Label, Lettering, canvas_of, pixels_of
from chutelab.plots import style
from chutelab.plots.panels import analytic_of, draw_analytic
from chutelab.plots.sampling import energies, round_step
from chutelab.plots.scenery import draw_scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from matplotlib.text import Text
    from numpy.typing import NDArray

    from chutelab.animate.layout import Layout
    from chutelab.animate.moments import Moment
    from chutelab.animate.palette import Pixels
    from chutelab.machine import Machine
    from chutelab.plots.window import Window
    from chutelab.recording import Recording
    from chutelab.theory import Transfer

TITLE = 0.942
"""Height of the line that the title stands on, as a share of the picture's."""

LINE = 0.065
"""Share of the picture's height that a line below the title takes."""

RIGHT = 0.99
"""Where text ends, as a share of the picture's width."""

CAPTION = 0.125
"""Share of the picture's height, at the bottom, that the caption has to itself."""


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
    layout : Layout
        Where everything is, and which part of the world is shown.
    moments : tuple of Moment
        The film.
    slow : float
        Seconds on the screen for one second of the recording.
    """

    def __init__(
        self,
        recording: Recording,
        machine: Machine,
        prediction: Transfer,
        layout: Layout,
        moments: tuple[Moment, ...],
        *,
        slow: float,
    ) -> None:
        self.moments = moments
        times = np.array([moment.t for moment in moments])
        # A hundredth of a pixel more: the canvas rounds down.
        inches = (layout.width + 0.01) / layout.dpi, (layout.height + 0.01) / layout.dpi
        self.figure = Figure(figsize=inches, dpi=layout.dpi)
        self.canvas = canvas_of(self.figure)
        self.view = self.figure.add_axes(layout.view)
        shows = layout.shows
        _draw_background(self.view, machine, layout.window)
        if "parabola" in shows:
            draw_analytic(self.view, analytic_of(recording, prediction)[0])
        self.drives = Drives(self.view, machine)
        self.crowd = Crowd(self.view, recording, times, trail=layout.trail)
        self.nominal = Nominal(
            self.view,
            recording,
            times,
            trail=layout.trail,
            arrow=layout.arrow,
            strobe="strobe" in shows,
        )
        self.bars = None
        if "energy" in shows:
            axes, table = (self.figure.add_axes(box) for box in (layout.bars, layout.table))
            self.bars = Bars(axes, table, energies(recording, times))
        self._add_legend()
        self._add_text(layout, pace_words(slow))
        self.canvas.draw()
        self.pixels = pixels_of(self.canvas)
        self._background = self.pixels.copy()
        self._captions: dict[str, Pixels] = {}

    def show(self, index: int) -> None:
        """Move everything to one moment."""
        moment = self.moments[index]
        self.drives.show(moment.t)
        self.crowd.show(index)
        self.nominal.show(index)
        self.clock.text = f"t = {moment.t:.3f} s"
        self.words.set_text(moment.words)
        if self.bars is not None:
            self.bars.show(index)

    def paint(self, index: int) -> Pixels:
        """Return the picture of one moment, (height, width), to be read before the next."""
        self.show(index)
        self.pixels[:] = self._background
        renderer = self.canvas.get_renderer()
        for actor in (self.drives, self.crowd, self.nominal):
            for artist in actor.artists:
                artist.draw(renderer)
        if self.bars is not None:
            self.bars.paint(self.pixels)
        self.clock.paint(self.pixels)
        self._write_words(renderer)
        return self.pixels

    def frame(self, index: int) -> NDArray[np.uint8]:
        """Return the picture of one moment, (height, width, 3)."""
        height, width = self.pixels.shape
        return self.paint(index).view(np.uint8).reshape(height, width, 4)[..., :3].copy()

    def _write_words(self, renderer: Any) -> None:
        """Draw the caption, or paste it: it stays the same for many frames."""
        said = self.words.get_text()
        below = self.pixels[self._caption_top :]
        if said not in self._captions:
            self.words.draw(renderer)
            self._captions[said] = below.copy()
        below[:] = self._captions[said]

    def _add_legend(self) -> None:
        """Name what is drawn above the scene; the components of the velocity by their colours."""
        first, *rest = self.nominal.legend(self.view)
        parabola: list[Line2D] = []
        if any(line.get_gid() == "analytic" for line in self.view.lines):
            # Two dashes; the line's own would not fit.
            parabola = self.view.plot([], [], color=style.ANALYTIC, label="analytic")
            parabola[0].set(linewidth=3.0, linestyle=(0, (1.5, 0.85)))
        legend = self.view.legend(
            handles=[first, *self.crowd.legend(self.view), *parabola, *rest],
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=6,
            fontsize=style.SMALL,
            frameon=False,
            borderaxespad=0.1,
            borderpad=0.3,
            handlelength=1.5,
            columnspacing=0.8,
            handletextpad=0.3,
        )
        if self.nominal.arrows.scale:
            for place, (name, colour) in enumerate(style.VELOCITY.items()):
                self.view.annotate(
                    f"$v_{name[1]}$",
                    (1.0, 0.5),
                    xycoords=legend.get_texts()[-1],
                    xytext=(4.0 + 16.0 * place, 0.0),
                    textcoords="offset points",
                    fontsize=style.NORMAL,
                    color=colour,
                    va="center",
                    # Placed beside what the legend has placed before.
                    zorder=legend.get_zorder() + 1.0,
                )

    def _add_text(self, layout: Layout, pace: str) -> None:
        text = self.figure.text
        title = text(0.02, TITLE, layout.title, fontsize=style.LARGE, fontweight="bold")
        _shorten(title, RIGHT * layout.width)
        if layout.question:
            asked = text(0.02, TITLE - LINE, layout.question, fontsize=style.NORMAL)
            _shorten(asked, RIGHT * layout.width)
        # Near what moves: the rectangle around all of it is what a frame of the file costs.
        above = layout.view[1] + layout.view[3] + 0.02
        slowed = text(RIGHT, above, pace, fontsize=style.NORMAL, ha="right")
        lettering = Lettering(style.NORMAL, layout.dpi)
        right = slowed.get_window_extent().x0 - 2.5 * lettering.widths[" "]
        self.clock = Label(lettering, right, layout.height * (1.0 - above))
        self.words = text(0.02, 0.055, "", fontsize=style.NORMAL, va="center", linespacing=1.25)
        self.words.set_animated(True)
        self._caption_top = round(layout.height * (1.0 - CAPTION))


def _shorten(text: Text, right: float) -> None:
    """Cut a text off at the end of a word such that it ends before a column of pixels."""
    whole = text.get_text()
    length = len(whole)
    while text.get_window_extent().x1 > right and length > 1:
        length -= 1
        text.set_text(shorten(whole, length, placeholder=" …"))


def pace_words(slow: float) -> str:
    """Return how the film's clock runs.

    >>> pace_words(10.0), pace_words(1.0), pace_words(0.5)
    ('10× slower', 'real time', '2× faster')
    """
    if slow == 1.0:
        return "real time"
    return f"{slow:.3g}× slower" if slow > 1.0 else f"{1.0 / slow:.3g}× faster"


def _draw_background(ax: Axes, machine: Machine, window: Window) -> None:
    draw_scene(ax, machine, window)
    ax.set_xticks([])
    ax.set_yticks([])
    for spine in ax.spines.values():
        spine.set_color(style.STEEL_LIGHT)
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
