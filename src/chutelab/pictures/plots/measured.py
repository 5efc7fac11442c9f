"""Measured points over simulation and parabola, and what is left between them over time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from chutelab.pictures.plots import style
from chutelab.pictures.plots.figure import SIZE
from chutelab.pictures.plots.machinery import draw_scene
from chutelab.pictures.plots.panels import analytic_of, draw_analytic
from chutelab.pictures.plots.scenery import (
    FAR,
    FINE,
    around,
    path_of,
    struck_by_nominal,
    window_of,
)
from chutelab.pictures.plots.style import Picture
from chutelab.results import Kind, Recording
from chutelab.scene.units import write_size
from chutelab.studies.measured import Fit, Residuals
from chutelab.studies.measured.result import plus_minus
from chutelab.studies.measured.track import counted

PARAMETERS = 6
"""Fitted parameters that are written into the figure."""

AXES = ("x", "y")

POINTS: dict[str, Any] = {"ls": "none", "marker": "+", "ms": 7.0, "mew": 1.3}
"""How measured points are drawn."""


def measured(found: Residuals, fit: Fit | None = None) -> Picture:
    """Draw a measured track over the simulation and its analytic parabola, and the residuals.

    With a fit, whose residuals are its `after`, also the track before it and the fitted values.
    """
    figure = Picture(SIZE)
    lines = 0 if fit is None else min(len(fit.parameters), PARAMETERS)
    top = 0.88 - 0.032 * max(0, lines - 1)
    view = figure.add_axes((0.06, 0.08, 0.5, 0.8))
    draw_measured(view, found, None if fit is None else fit.before.recording)
    grid = figure.add_gridspec(2, 1, left=0.64, right=0.985, top=top, bottom=0.08, hspace=0.3)
    upper = figure.add_subplot(grid[0])
    draw_residuals(upper, found, 0)
    upper.set_xlabel("")
    draw_residuals(figure.add_subplot(grid[1]), found, 1)
    figure.headline(0.06, 0.965, found.recording.title, 60)
    said = [f"{len(found.track)} measured points, nothing fitted"]
    if fit is not None:
        fitted = zip(fit.parameters[:PARAMETERS], fit.values, fit.errors, strict=False)
        said = [
            f"{one.key} = {plus_minus(x, error)} {one.unit}".rstrip() for one, x, error in fitted
        ]
    for i, text in enumerate(said):
        figure.remark(0.985, 0.965 - 0.032 * i, text, ha="right", va="center")
    return figure


def draw_measured(ax: Axes, found: Residuals, before: Recording | None = None) -> Axes:
    """Draw the machine, the simulated track, the analytic parabola, and the measured points.

    The run that a fit started from is dotted.
    """
    recording, position = found.recording, found.track.position
    window = window_of(recording)
    far = window.padded(*[FAR] * 4)
    corners = np.array([[window.left, window.bottom], [window.right, window.top]])
    style.dress(ax, "x, m", "y, m")
    shown = far.holds(position)
    draw_scene(ax, recording.machine, around(np.concatenate([corners, position[shown]])))
    parts, _ = analytic_of(recording)
    draw_analytic(ax, parts)
    for run, gid, colour, line, label in (
        (before, "before", style.MUTED, ":", "before the fit"),
        (recording, "track", style.TRACK, "-", "simulation"),
    ):
        if run is not None:
            path = path_of(run, 0, FINE * float(np.ptp(ax.get_xlim())))
            ax.plot(*path.T, line, color=colour, lw=1.6, zorder=5.0, gid=gid, label=label)
    for chosen, colour, label in (
        (found.used, style.STRIKE, "measured"),
        (~found.used, style.STEEL, "measured, left out"),
    ):
        if chosen.any():
            points = {**POINTS, "color": colour, "gid": label, "label": label}
            ax.plot(*position[chosen].T, **points, zorder=8.0)
    if not shown.all():
        ax.text(
            0.5, 0.97, f"{counted(int((~shown).sum()), 'point')} outside the picture",
            transform=ax.transAxes, fontsize=style.NORMAL, color=style.STRIKE,
            horizontalalignment="center", verticalalignment="top",
        )  # fmt: skip
    style.legend_above(ax, 3)
    return ax


def draw_residuals(ax: Axes, found: Residuals, axis: int) -> Axes:
    """Draw measured minus simulated x (axis 0) or y (axis 1) over time, with the impacts."""
    used = found.used
    times, values = found.track.t[used], found.values[used, axis]
    factor, unit = style.scaled(values, "m")
    name, rms = AXES[axis], found.rms[axis]
    style.dress(
        ax,
        "time, s",
        f"residual in {name}, {unit}",
        f"Measured − simulated {name}: RMS {write_size(rms, 'm')}",
    )
    ax.axhspan(-factor * rms, factor * rms, color=style.STEEL_LIGHT, zorder=0.5, gid="rms")
    ax.axhline(0.0, color=style.TRACK, linewidth=1.6, zorder=2.0)
    points = {**POINTS, "color": style.STRIKE, "gid": f"residual {name}"}
    ax.plot(times, factor * values, **points, zorder=3.0)
    bottom, top = ax.get_ylim()
    ax.set_ylim(bottom, top + 0.12 * (top - bottom))
    style.note(ax, "grey: ± RMS")
    low, high = float(times[0]), float(times[-1])
    margin = 0.03 * (high - low)
    ax.set_xlim(low - margin, high + margin)
    for event in struck_by_nominal(found.recording)[:10]:
        if low - margin <= event["t"] <= high + margin:
            ax.axvline(event["t"], color=style.MUTED, linewidth=1.0, linestyle=":", zorder=1.0)
            ax.annotate(
                Kind(event["kind"]).name.lower(),
                (event["t"], 1.0), xycoords=("data", "axes fraction"), xytext=(-3, -3),
                textcoords="offset points", fontsize=style.SMALL, color=style.MUTED,
                horizontalalignment="right", verticalalignment="top",
            )  # fmt: skip
    return ax
