"""The picture of the film: a background drawn once, and the artists that move on it."""

from __future__ import annotations

from textwrap import shorten
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from chutelab.animate.bars import Bars
from chutelab.plots import style
from chutelab.plots.panels import STROBES, analytic_of, draw_analytic
from chutelab.plots.sampling import action, energies, round_step, round_times, subset, track_times
from chutelab.plots.scenery import draw_scene

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from numpy.typing import NDArray

    from chutelab.animate.film import Moment
    from chutelab.machine import Machine
    from chutelab.plots.scenery import Window
    from chutelab.recording import Recording
    from chutelab.theory import Transfer

    Floats = NDArray[np.float64]

HEIGHT = 4.5
"""Inches that every picture is high: text keeps its share of the picture at any pixel size."""

VIEW = (0.015, 0.135, 0.675, 0.71)
BARS = (0.765, 0.44, 0.225, 0.445)
TABLE = (0.73, 0.125, 0.26, 0.245)
"""Left, bottom, width and height of the three parts, as shares of the picture."""

DRAWN = 300
"""Particles that are drawn at most."""

SMALLEST = 5.0
"""pt; the diameter a particle is drawn with if to scale it would be smaller."""

MARKS = 14
"""Marks on a belt across the window; they move with it."""


class Stage:
    """Draws the moments of a film.

    Parameters
    ----------
    recording : Recording
    machine : Machine
        The one it was made on.
    prediction : Transfer
        For the analytic parabola.
    window : Window
        What to show.
    moments : sequence of Moment
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
        self.recording, self.machine, self.moments = recording, machine, moments
        self.times = np.array([moment.t for moment in moments])
        # A hundredth of a pixel more: the canvas rounds down.
        inch = HEIGHT / height
        self.figure = Figure(figsize=((width + 0.01) * inch, (height + 0.01) * inch), dpi=1 / inch)
        self.canvas = FigureCanvasAgg(self.figure)
        self.view = self.figure.add_axes(VIEW)
        self._draw_background(prediction, window, slow)
        self._add_particles()
        self._add_nominal()
        self._add_belts(window)
        self.bars = Bars(
            self.figure.add_axes(BARS),
            self.figure.add_axes(TABLE),
            energies(recording, self.times),
        )
        self.clock = self.figure.text(
            0.99, 0.955, "", fontsize=style.NORMAL, ha="right", va="center", animated=True
        )
        self.words = self.figure.text(
            0.02, 0.055, "", fontsize=style.NORMAL, va="center", linespacing=1.25, animated=True
        )
        self.slow_words = pace_words(slow)
        self.canvas.draw()
        self._background = self.canvas.copy_from_bbox(self.figure.bbox)

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        return [
            self.spoke,
            self.marks,
            self.trail,
            self.others,
            self.strobe,
            self.nominal,
            *self.bars.artists,
            self.clock,
            self.words,
        ]

    def show(self, index: int) -> None:
        """Move the artists to one moment."""
        moment = self.moments[index]
        self._show_nominal(moment.t)
        self.others.set_data(*self._positions[index].T)
        self._show_belts(moment.t)
        self.bars.show(index)
        self.clock.set_text(f"t = {moment.t:.3f} s, {self.slow_words}")
        self.words.set_text(moment.words)

    def frame(self, index: int) -> NDArray[np.uint8]:
        """Return the picture of one moment, (height, width, 3)."""
        self.show(index)
        self.canvas.restore_region(self._background)
        renderer = self.canvas.get_renderer()
        for artist in self.artists:
            artist.draw(renderer)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()

    def _draw_background(self, prediction: Transfer, window: Window, slow: float) -> None:
        ax = self.view
        draw_scene(ax, self.machine, window)
        ax.set_xticks([])
        ax.set_yticks([])
        for spine in ax.spines.values():
            spine.set_color(style.STEEL_LIGHT)
        parts, _ = analytic_of(self.recording, prediction)
        draw_analytic(ax, parts)
        _draw_scale(ax)
        self.figure.text(
            0.02,
            0.955,
            shorten(self.recording.title, 58, placeholder=" …"),
            fontsize=style.LARGE,
            fontweight="bold",
            va="center",
        )

    def _add_particles(self) -> None:
        """Choose the particles to draw: those on stage during the film, evenly thinned out."""
        recording = self.recording
        first, last = recording.ends()
        released = np.flatnonzero(recording.offsets[1:] > recording.offsets[:-1])
        on_stage = released[(first["t"] <= self.times[-1]) & (last["t"] >= self.times[0])]
        on_stage = on_stage[on_stage != 0]
        chosen = on_stage[
            np.unique(
                np.linspace(0, max(len(on_stage) - 1, 0), min(len(on_stage), DRAWN - 1)).astype(int)
            )
        ]
        self.drawn = chosen
        self._positions = subset(recording, chosen).at(self.times)[0]
        self.thinned = len(on_stage) > len(chosen)
        self.others = self._dots(style.STREAM)

    def _dots(self, color: str) -> Line2D:
        pixels = self.view.get_window_extent().width / np.ptp(self.view.get_xlim())
        points = 2.0 * self.recording.particle.radius * pixels * 72.0 / self.figure.dpi
        (dots,) = self.view.plot(
            [],
            [],
            linestyle="none",
            marker="o",
            markersize=max(points, SMALLEST),
            markeredgewidth=0.4,
            markeredgecolor="white",
            markerfacecolor=color,
            animated=True,
        )
        return dots

    def _add_nominal(self) -> None:
        track = self.recording.track(0)
        begin, end = float(track["t"][0]), float(track["t"][-1])
        self._nominal = subset(self.recording, [0])
        self._trail_times = track_times(self.recording, begin, end)
        self._trail = self._nominal.at(self._trail_times)[0][:, 0]
        since = action(self.recording)[0]
        self.strobe_step = round_step(max(end - since, 1e-9), STROBES)
        self._strobe_times = round_times(begin, end, self.strobe_step)
        self._strobe = self._nominal.at(self._strobe_times)[0][:, 0]
        (self.trail,) = self.view.plot([], [], color=style.TRACK, linewidth=1.6, animated=True)
        (self.strobe,) = self.view.plot(
            [],
            [],
            linestyle="none",
            marker="o",
            markersize=4.5,
            markerfacecolor="white",
            markeredgecolor=style.TRACK,
            animated=True,
        )
        self.nominal = self._dots(style.STRIKE)
        self._add_legend()

    def _add_legend(self) -> None:
        ax = self.view
        (dot,) = ax.plot([], [], "o", color=style.STRIKE, markersize=6.0, label="particle 0")
        (ring,) = ax.plot(
            [],
            [],
            "o",
            markersize=4.5,
            markerfacecolor="white",
            markeredgecolor=style.TRACK,
            label=f"every {self.strobe_step:g} s",
        )
        handles = [dot, ring]
        handles += [line for line in ax.lines if line.get_label() == "analytic parabola"]
        count = self.recording.count
        if count > 1:
            said = f"{count} particles"
            if self.thinned:
                said += f", {len(self.drawn) + 1} drawn"
            handles += ax.plot([], [], "o", color=style.STREAM, markersize=6.0, label=said)
        ax.legend(
            handles=handles,
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

    def _show_nominal(self, t: float) -> None:
        now = self._nominal.at([t])[0][0]
        self.nominal.set_data(*now.T)
        past = self._trail[self._trail_times < t]
        self.trail.set_data(*np.concatenate([past, now]).T)
        self.strobe.set_data(*self._strobe[self._strobe_times <= t].T)

    def _add_belts(self, window: Window) -> None:
        (self.marks,) = self.view.plot(
            [], [], linestyle="none", marker="o", markersize=1.8, color="white", animated=True
        )
        (self.spoke,) = self.view.plot([], [], color=style.STEEL, linewidth=1.6, animated=True)
        self._spacing = (window.right - window.left) / MARKS

    def _show_belts(self, t: float) -> None:
        """Move marks along what moves, and turn the pulley, clockwise at v0/R."""
        segments, marks = self.machine.segments, [np.empty((0, 2))]
        for i in np.flatnonzero(segments.speed):
            along = np.arange(
                (segments.speed[i] * t) % self._spacing, segments.length[i], self._spacing
            )
            marks.append(segments.start[i] + along[:, None] * segments.tangent[i])
        self.marks.set_data(*np.concatenate(marks).T)
        pulley = self.machine.pulley
        if pulley is not None:
            angle = pulley.speed * t / pulley.radius
            rim = 0.9 * pulley.radius * np.array([np.sin(angle), np.cos(angle)])
            self.spoke.set_data([-rim[0], rim[0]], [-rim[1], rim[1]])


def pace_words(slow: float) -> str:
    """Return how the film's clock runs.

    >>> pace_words(10.0), pace_words(1.0), pace_words(0.5)
    ('10× slower', 'real time', '2× faster')
    """
    if slow == 1.0:
        return "real time"
    return f"{slow:.3g}× slower" if slow > 1.0 else f"{1.0 / slow:.3g}× faster"


def _draw_scale(ax: Axes) -> None:
    """Draw a bar of round length in the lower left corner: the picture has no ticks."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    length = round_step(right - left, 6)
    x, y = left + 0.02 * (right - left), bottom + 0.035 * (top - bottom)
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
