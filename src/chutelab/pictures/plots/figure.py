"""Whole figures: `overlay`, a recording on its analytic parabola, and the paper's figures.

The paper's figures are computed anew: as printed on the left, corrected on the right.
"""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chutelab.pictures.plots import style
from chutelab.pictures.plots.panels import (
    STREAM_TRACKS,
    Arc,
    analytic_of,
    draw_analytic,
    draw_ledger,
    draw_residual,
    draw_tracks,
    draw_velocity,
)
from chutelab.pictures.plots.scenery import draw_scene, window_of
from chutelab.pictures.plots.style import Picture
from chutelab.results import Recording
from chutelab.theory import Transfer
from chutelab.theory.figures import Panel, PaperFigure

SIZE = (13.0, 7.6)
"""Width and height of the figure, inches."""


def overlay(
    recording: Recording, prediction: Transfer | None = None, *, path: str | Path | None = None
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

    Returns
    -------
    Figure
        Scene with tracks, residual beneath it, velocity and energy ledger beside it.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    if prediction is None:
        prediction = recording.prediction
    figure = Picture(SIZE)
    grid = figure.add_gridspec(
        2, 1, height_ratios=(4.2, 1.0), left=0.06, right=0.56, top=0.88, bottom=0.08, hspace=0.28
    )
    side = figure.add_gridspec(2, 1, left=0.63, right=0.985, top=0.88, bottom=0.155, hspace=0.34)
    parts, start = analytic_of(recording, prediction)
    view = figure.add_subplot(grid[0])
    draw_view(view, recording, parts)
    draw_residual(figure.add_subplot(grid[1]), recording, parts, start, str(prediction.reason))
    draw_velocity(figure.add_subplot(side[0]), recording, parts, start)
    books = draw_ledger(figure.add_subplot(side[1]), recording)
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
    if recording.count > STREAM_TRACKS:
        said += f", {STREAM_TRACKS} tracks drawn"
    figure.remark(0.985, 0.965, f"engine {recording.engine}, {said}", ha="right", va="center")
    figure.write(path)
    return figure


def draw_view(ax: Axes, recording: Recording, parts: tuple[Arc, ...]) -> Axes:
    """Draw the scene to scale with tracks, strobe dots and the analytic parabola, and a legend."""
    style.dress(ax, "x, m", "y, m")
    draw_scene(ax, recording.machine, window_of(recording))
    draw_tracks(draw_analytic(ax, parts), recording)
    style.legend_above(ax, 4)
    return ax


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
