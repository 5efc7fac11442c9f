"""Whole figures: `overlay`, a recording on its analytic parabola, and the paper's figures.

The paper's figures are computed anew: as printed on the left, corrected on the right.
"""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from chutelab.pictures.plots import style
from chutelab.pictures.plots.bodies import draw_bodies, stream_handles
from chutelab.pictures.plots.crowd import (
    draw_arrivals,
    draw_envelope,
    draw_flow,
    draw_losses,
    draw_power,
)
from chutelab.pictures.plots.machinery import HALO, draw_scene
from chutelab.pictures.plots.panels import (
    Arc,
    analytic_of,
    draw_analytic,
    draw_ledger,
    draw_residual,
    draw_tracks,
    draw_velocity,
)
from chutelab.pictures.plots.scenery import (
    as_crowd,
    bodily,
    drawn_tracks,
    one_of_many,
    places,
    window_of,
)
from chutelab.pictures.plots.style import Picture
from chutelab.results import Recording
from chutelab.results.comparison import prediction as predicted
from chutelab.theory import Transfer
from chutelab.theory.figures import Panel, PaperFigure

SIZE = (13.0, 7.6)
"""Width and height of the figure, inches."""


def overlay(
    recording: Recording,
    prediction: Transfer | None = None,
    *,
    path: str | Path | None = None,
    ax: Axes | None = None,
    details: bool = False,
) -> Figure:
    """Draw a recording over its analytic parabola.

    Parameters
    ----------
    recording : Recording
        From either engine.
    prediction : Transfer, optional
        By default `chutelab.theory.predict` of the recording's scene.
    path : path, optional
        Also write the figure there, whole or not at all; the suffix says the format.
    ax : Axes, optional
        Draw only the scene with its tracks, and into these; ``ax.legend()`` adds the legend.
    details : bool
        For experts: also the numerical error, the ledger's residual and the engine; and of a crowd
        particle 0.

    Returns
    -------
    Figure
        That of `ax`; or a new one, with scene and tracks, velocity and energy ledger beside it;
        with `details` the distance from the analytic path beneath it. Of a crowd: the envelope of
        its paths, beneath it where particles arrive and the belts' power, and beside it flow,
        ledger and losses by surface. Where nothing is known analytically, of many particles, boxes
        or strings: beneath it all particles at four moments.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If both `path` and `ax` are given.
    """
    if prediction is None:
        prediction = predicted(recording)
    parts, start = analytic_of(recording, prediction)
    all_of_them = not parts and bodily(recording)
    if ax is not None:
        if path is not None:
            raise ValueError("path and ax: give one; what holds the axes is yours to save")
        crowd = as_crowd(recording) and not details
        draw_view(ax, recording, parts, bodies=all_of_them, crowd=crowd, legend=False)
        return ax.figure.canvas.figure
    figure = Picture(SIZE)
    crowd = as_crowd(recording) and not details
    beneath = all_of_them or details or (crowd and recording.machine.landing >= 0)
    ratios = [4.2, 1.0] if details and not all_of_them else [2.6, 1.0] if beneath else [1.0]
    grid = figure.add_gridspec(
        len(ratios), 1, height_ratios=ratios, left=0.06, right=0.56, top=0.88,
        bottom=0.02 if all_of_them else 0.08, hspace=0.28,
    )  # fmt: skip
    side = figure.add_gridspec(
        3 if crowd else 2, 1, left=0.63 if not crowd else 0.66, right=0.985, top=0.88,
        bottom=0.155, hspace=0.52 if crowd else 0.34,
    )  # fmt: skip
    view = figure.add_subplot(grid[0])
    draw_view(view, recording, parts, bodies=all_of_them, crowd=crowd)
    if all_of_them:
        draw_moments(figure, grid[1], recording, crowd=crowd)
    elif crowd and beneath:
        pair = grid[1].subgridspec(1, 2, wspace=0.28)
        draw_arrivals(figure.add_subplot(pair[0]), recording)
        draw_power(figure.add_subplot(pair[1]), recording)
    elif details:
        draw_residual(figure.add_subplot(grid[1]), recording, parts, start, str(prediction.reason))
    panels = [figure.add_subplot(side[row]) for row in range(side.nrows)]
    if crowd:
        draw_flow(panels[0], recording)
        draw_losses(panels[2], recording)
    else:
        draw_velocity(panels[0], recording, parts, start)
    books = draw_ledger(panels[1], recording, details=details)
    figure.legend(
        *books.get_legend_handles_labels(),
        loc="lower center",
        bbox_to_anchor=(0.8075, 0.005),
        ncols=3,
        fontsize=style.SMALL,
        frameon=False,
        handlelength=1.4,
        columnspacing=1.0,
    )
    figure.headline(0.06, 0.965, recording.title)
    said = "one particle" if recording.count == 1 else f"{recording.count:,} particles"
    drawn = len(drawn_tracks(recording))
    if drawn < recording.count:
        said += f", {drawn} tracks drawn"
    said = f"engine {recording.engine}, {said}" if details else said
    figure.remark(0.985, 0.965, said, ha="right", va="center")
    figure.write(path)
    return figure


def draw_view(
    ax: Axes,
    recording: Recording,
    parts: tuple[Arc, ...],
    *,
    bodies: bool = False,
    crowd: bool = False,
    legend: bool = True,
) -> Axes:
    """Draw the scene to scale with tracks, strobe dots and the analytic parabola, and a legend.

    Of a `crowd` the envelope of the paths instead of what particle 0 does. With `bodies` also the
    particles, at the last moment at which half of them or more are there.
    """
    style.dress(ax, "x, m", "y, m")
    draw_scene(ax, recording.machine, window_of(recording))
    draw_analytic(ax, parts)
    draw_tracks(ax, recording, marks=not crowd)
    if crowd and not one_of_many(recording):
        draw_envelope(ax, recording)
    handles = ax.get_legend_handles_labels()[0]
    if bodies:
        t = fullest(recording)
        draw_bodies(ax, recording, t, crowd=crowd)
        ax.set_xlabel(f"x, m    (particles at t = {t:.3g} s)")
    if len(recording.machine.streams) > 1:
        handles += stream_handles(recording.machine)
    if legend:
        style.legend_above(ax, 4, handles)
    return ax


def fullest(recording: Recording) -> float:
    """Return the last of some even times, s, at which half of the most particles are in sight."""
    clock = recording.knots["t"]
    times = np.linspace(clock.min(), clock.max(), 61)
    released = np.flatnonzero(recording.released)
    there = window_of(recording).holds(places(recording, released, times)).sum(axis=1)
    return float(times[np.flatnonzero(2 * there >= there.max())[-1]])


MOMENTS = 4
"""Moments at which all particles are shown beneath the scene."""

GRIDS = ((1, 4), (2, 2), (4, 1))
"""Rows and columns in which they may stand."""


def draw_moments(figure: Picture, place: SubplotSpec, recording: Recording, *, crowd: bool) -> None:
    """Draw the scene small, without names, with all particles, at even times from first to last."""
    window, clock = window_of(recording), recording.knots["t"]
    room = place.get_position(figure)
    size = np.array([room.height * SIZE[1], room.width * SIZE[0]])
    grid = max(GRIDS, key=lambda grid: float((size / grid / (window.height, window.width)).min()))
    cells = place.subgridspec(*grid, wspace=0.08, hspace=0.2)
    times = np.linspace(clock.min(), clock.max(), MOMENTS)
    for row, column in np.ndindex(*grid):
        t = times[row * grid[1] + column]
        ax = figure.add_subplot(cells[row, column])
        draw_scene(ax, recording.machine, window, small=True)
        draw_bodies(ax, recording, t, crowd=crowd)
        ax.set(xticks=[], yticks=[])
        for spine in ax.spines.values():
            spine.set_color(style.STEEL_LIGHT)
        said = ax.annotate(
            f"{t:.3g} s", (0.0, 1.0), xycoords="axes fraction", xytext=(3.0, -3.0),
            textcoords="offset points", va="top", gid="moment",
        )  # fmt: skip
        said.set(fontsize=style.SMALL, path_effects=HALO, zorder=8.0)


WIDE = 185
"""Characters of a line of text below the panels."""

COLOURS = {
    "first": style.TRACK, "second": style.STRIKE, "third": style.BELT, "fourth": style.ANALYTIC,
    "plate": style.INK, "belt": style.BELT,
}  # fmt: skip
DASHES = {"second": (0, (5, 2)), "third": (0, (2, 1.4)), "fourth": (0, (6, 1.5, 1.2, 1.5))}
"""So that lines are told apart without colour, too."""

MARGIN = 0.06
"""Of the range of what is drawn, on each side."""

TEXT = 0.215
"""Height of a line of text, inches."""


def paper_figure(found: PaperFigure) -> Picture:
    """Draw a figure of the paper: panels side by side, and in words what the misprint does."""
    texts = [fill(text, WIDE) for text in found.meaning]
    texts += [fill(f"Not in the paper's text: {text}", WIDE) for text in found.missing]
    lines = sum(text.count("\n") + 1 for text in texts)
    below = TEXT * lines + 0.85
    height = 1.0 + 4.1 + below
    figure = Picture((13.0, height))
    grid = figure.add_gridspec(
        1, len(found.panels), left=0.06, right=0.985, top=1.0 - 1.0 / height, bottom=below / height,
        wspace=0.16 if len(found.panels) == 2 else 0.3,
    )  # fmt: skip
    axes: list[Axes] = []
    for i, panel in enumerate(found.panels):
        # Both of a pair have the same limits: the eye compares heights.
        first = axes[-1] if i % 2 else None
        ax = figure.add_subplot(grid[i], sharex=first, sharey=first)
        ax.margins(MARGIN)
        axes.append(draw_panel(ax, panel))
    for ax in axes:
        low, high = ax.get_ylim()
        if low > MARGIN * (high - low):
            style.note(ax, "axis not from 0")
    if found.panels[0].to_scale:
        figure.legend(
            *axes[0].get_legend_handles_labels(), loc="upper right",
            bbox_to_anchor=(0.985, 1.0 - 0.12 / height), ncols=4, fontsize=style.SMALL,
            frameon=False,
        )  # fmt: skip
    title = f"Figure {found.number}: {found.title}"
    figure.headline(0.02, 1.0 - 0.3 / height, title, 150)
    y = below - 0.65
    for i, text in enumerate(texts):
        color = style.INK if i < len(found.meaning) else style.MUTED
        figure.remark(0.02, y / height, text, fontsize=style.SMALL, color=color)
        y -= TEXT * (text.count("\n") + 1)
    return figure


def draw_panel(ax: Axes, panel: Panel) -> Axes:
    """Draw one panel."""
    style.dress(ax, panel.x_label, panel.y_label, panel.title)
    for line in panel.lines:
        color, solid = COLOURS[line.role], line.role in ("plate", "belt")
        (drawn,) = ax.plot(line.x, line.y, color=color, label=line.label, gid=line.role)
        drawn.set(linewidth=3.0 if solid else 1.8, zorder=3.0 if solid else 4.0)
        drawn.set_linestyle(DASHES.get(line.role, "-"))
        if line.marks is not None:
            ax.plot(*line.marks.T, "o", color=color, ms=4.5, mfc="white", zorder=5.0)
    if panel.to_scale:
        ax.set_aspect("equal", adjustable="box")
    else:
        ax.legend(loc="best", fontsize=style.SMALL, framealpha=0.85, edgecolor="none")
    return ax
