"""The paper's figures, computed anew: as printed on the left, corrected on the right."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from chutelab.plots import style
from chutelab.plots.picture import DPI, Picture

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from chutelab.figures import Line, Panel, PaperFigure

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


def paper_figure(found: PaperFigure, *, path: str | Path | None = None) -> Figure:
    """Draw a figure of the paper: panels side by side, and in words what the misprint does.

    Parameters
    ----------
    found : PaperFigure
        From `chutelab.figures.figure`.
    path : path, optional
        Also write the figure there, whole or not at all; the suffix says the format.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    texts = [fill(text, WIDE) for text in found.meaning]
    texts += [fill(f"Not in the paper's text: {text}", WIDE) for text in found.missing]
    lines = sum(text.count("\n") + 1 for text in texts)
    panels = [panel for pair in found.panels for panel in pair]
    below = TEXT * lines + 0.85
    height = 1.0 + 4.1 + below
    figure = Picture(figsize=(13.0, height), dpi=DPI)
    grid = figure.add_gridspec(
        1, len(panels), left=0.06, right=0.985, top=1.0 - 1.0 / height, bottom=below / height,
        wspace=0.16 if len(panels) == 2 else 0.3,
    )  # fmt: skip
    axes = [draw_panel(figure.add_subplot(grid[i]), panel) for i, panel in enumerate(panels)]
    for i in range(0, len(panels), 2):
        _alike(axes[i], axes[i + 1])
    if panels[0].to_scale:
        figure.legend(
            *axes[0].get_legend_handles_labels(), loc="upper right",
            bbox_to_anchor=(0.985, 1.0 - 0.12 / height), ncols=4, fontsize=style.SMALL,
            frameon=False,
        )  # fmt: skip
    title = f"Figure {found.number}: {found.title}"
    figure.headline(0.02, 1.0 - 0.3 / height, title, 150)
    y = below - 0.65
    for i, text in enumerate(texts):
        figure.text(
            0.02, y / height, text, fontsize=style.SMALL, verticalalignment="top",
            color=style.INK if i < len(found.meaning) else style.MUTED,
        )  # fmt: skip
        y -= TEXT * (text.count("\n") + 1)
    figure.write(path)
    return figure


def draw_panel(ax: Axes, panel: Panel) -> Axes:
    """Draw one panel."""
    style.dress(ax, panel.x_label, panel.y_label, panel.title)
    for line in panel.lines:
        _draw(ax, line)
    if panel.to_scale:
        ax.set_aspect("equal", adjustable="box")
    else:
        ax.legend(loc="best", fontsize=style.SMALL, framealpha=0.85, edgecolor="none")
    return ax


def _draw(ax: Axes, line: Line) -> None:
    solid = line.role in ("plate", "belt")
    ax.plot(
        line.x, line.y,
        color=COLOURS[line.role], linewidth=3.0 if solid else 1.8,
        linestyle=DASHES.get(line.role, "-"), label=line.label, zorder=3.0 if solid else 4.0,
        gid=line.role,
    )  # fmt: skip
    if line.marks is not None:
        ax.plot(
            line.marks[:, 0], line.marks[:, 1],
            linestyle="none", marker="o", markersize=4.5, color=COLOURS[line.role],
            markerfacecolor="white", zorder=5.0,
        )  # fmt: skip


def _alike(left: Axes, right: Axes) -> None:
    """Give two panels the same axes: the eye compares heights."""
    corners = np.concatenate([ax.dataLim.get_points() for ax in (left, right)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = MARGIN * (high - low)
    for ax in (left, right):
        ax.set_xlim(low[0] - margin[0], high[0] + margin[0])
        ax.set_ylim(low[1] - margin[1], high[1] + margin[1])
        if low[1] > 2.0 * margin[1]:
            ax.set_title("axis not from 0", fontsize=style.SMALL, loc="right", color=style.MUTED)
