"""The overlay: one figure that shows a recording on top of its analytic parabola."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chutelab.compare import scene_of
from chutelab.plots import style
from chutelab.plots.panels import (
    STREAM_TRACKS,
    analytic_of,
    draw_analytic,
    draw_ledger,
    draw_residual,
    draw_tracks,
    draw_velocity,
)
from chutelab.plots.picture import DPI, Picture
from chutelab.plots.scenery import draw_scene, machine_of
from chutelab.plots.window import window_of
from chutelab.theory import predict

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from chutelab.plots.analytic import Arc
    from chutelab.recording import Recording
    from chutelab.theory import Transfer

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
        prediction = predict(scene_of(recording))
    figure = Picture(figsize=SIZE, dpi=DPI)
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
    engine = figure.text(0.985, 0.965, _said(recording), fontsize=style.NORMAL, color=style.MUTED)
    engine.set(horizontalalignment="right", verticalalignment="center")
    figure.write(path)
    return figure


def draw_view(ax: Axes, recording: Recording, parts: tuple[Arc, ...]) -> Axes:
    """Draw the scene to scale with tracks, strobe dots and the analytic parabola, and a legend."""
    machine = machine_of(recording)
    style.dress(ax, "x, m", "y, m")
    draw_scene(ax, machine, window_of(recording, machine))
    draw_tracks(draw_analytic(ax, parts), recording)
    style.legend_above(ax, 4)
    return ax


def _said(recording: Recording) -> str:
    if recording.count == 1:
        return f"engine {recording.engine}, one particle"
    said = f"engine {recording.engine}, {recording.count:,} particles"
    if recording.count > STREAM_TRACKS:
        said += f", {STREAM_TRACKS} tracks drawn"
    return said
