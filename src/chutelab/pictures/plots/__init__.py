"""Pictures of recordings: `overlay`, `strobe`, and small functions that take and return `Axes`.

`overlay` draws a recording over its analytic parabola, `strobe` a still for print: the scene with
particle 0 at round times, like a stroboscopic photograph. `paper_figure` draws the paper's figures
from computed values, as printed on the left, corrected on the right.

===============  ==================================================================================
`style`          light or dark colours, language, text sizes, units; a figure that shows itself
`scenery`        what of a recording is worth drawing: particles, times, part of the world
`machinery`      machine and particles to scale, with names
`panels`         tracks, parabola, velocity, ledger; envelope, arrivals, flow, power, losses
`measures`       what is measured of a run, or on film: wear, loads, sensors, fields, velocities
`studies`        searches, uncertainty, sweeps, methods of discharge, run time against error
===============  ==================================================================================

Figures are drawn by Agg through `Figure` objects: no pyplot, no global state.
"""

from __future__ import annotations

from math import floor, log10
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from chutelab.pictures import BLUE, GREEN, ORANGE, VERMILION
from chutelab.pictures.plots import style
from chutelab.pictures.plots.machinery import (
    draw_bodies,
    draw_moved,
    draw_scene,
    halo,
    swept,
)
from chutelab.pictures.plots.panels import (
    Arc,
    analytic_of,
    arcs,
    draw_analytic,
    draw_arrivals,
    draw_envelope,
    draw_flow,
    draw_ledger,
    draw_losses,
    draw_power,
    draw_residual,
    draw_tracks,
    draw_velocity,
    flight,
    path_of_arcs,
)
from chutelab.pictures.plots.scenery import (
    Window,
    as_crowd,
    bodily,
    drawn_tracks,
    nominal,
    one_of_many,
    places,
    strobe_step,
    strobe_times,
    window_of,
)
from chutelab.pictures.plots.style import Picture, figures, look, say, stream_handles
from chutelab.results import Recording
from chutelab.results.quantities import need_recording
from chutelab.results.quantities import prediction as predicted
from chutelab.theory import Transfer
from chutelab.theory.figures import PaperFigure

__all__ = [
    "Arc", "Window", "analytic_of", "arcs", "draw_analytic", "draw_arrivals", "draw_envelope",
    "draw_flow", "draw_ledger", "draw_losses", "draw_power", "draw_residual", "draw_scene",
    "draw_tracks", "draw_velocity", "flight", "look", "overlay", "paper_figure", "strobe",
    "window_of",
]  # fmt: skip

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
        Draw only the scene with its tracks, into these axes; ``ax.legend()`` adds the legend.
    details : bool
        For experts: also the numerical error, the ledger's residual and the engine; for a crowd
        also particle 0.

    Returns
    -------
    Figure
        That of `ax`; or a new one, with scene and tracks, and velocity and energy ledger beside it;
        with `details` the distance from the analytic path beneath it. For a crowd: the envelope of
        its paths, with arrivals and the belts' power beneath it, and flow, ledger and losses by
        surface beside it. For many particles, boxes or strings without an analytic path: all
        particles at four moments beneath it.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If both `path` and `ax` are given.
    """
    need_recording(recording)
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
    drawn_ledger = draw_ledger(panels[1], recording, details=details)
    legend = figure.legend(
        *drawn_ledger.get_legend_handles_labels(),
        loc="lower center",
        bbox_to_anchor=(0.8075, 0.005),
        ncols=3,
        fontsize=style.SMALL,
        frameon=False,
        handlelength=1.4,
        columnspacing=1.0,
    )
    # Hinges and springs have entries of their own, in one more row.
    side.bottom = max(side.bottom, legend.get_window_extent().y1 / figure.bbox.height + 0.065)
    for row, panel in enumerate(panels):
        panel.set_position(side[row].get_position(figure))
    figure.headline(0.06, 0.965, recording.title)
    count = figures(recording.count, ",")
    said = say("one") if recording.count == 1 else say("all", count=count)
    drawn = len(drawn_tracks(recording))
    if drawn < recording.count:
        said = say("tracks", said=said, count=drawn)
    said = say("engine", engine=recording.engine, said=said) if details else said
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

    Moving surfaces are drawn at the beginning, dashed, at the end, and lightly at the times of the
    strobe dots. A `crowd` has the envelope of the paths instead of particle 0's track. With
    `bodies` the particles are drawn, too, and surfaces at their time instead of the end: the last
    time at which at least half of them are in sight.
    """
    style.dress(ax, say("x"), say("y"))
    machine = recording.machine
    t = fullest(recording) if bodies else float(recording.t[-1])
    ghosts = [] if bodies or not machine.movers else strobe_times(recording).tolist()
    draw_moved(ax, machine, t, ghosts)
    clear = [path_of_arcs(parts), *swept(recording)]
    draw_scene(ax, machine, window_of(recording), clear=clear)
    draw_analytic(ax, parts)
    draw_tracks(ax, recording, marks=not crowd)
    if crowd and not one_of_many(recording):
        draw_envelope(ax, recording)
    draw_sensors(ax, recording)
    handles = ax.get_legend_handles_labels()[0]
    shown = ["particles"] if bodies else []
    if bodies:
        draw_bodies(ax, recording, t, crowd=crowd)
        if not crowd:
            dot: dict[str, Any] = {"ls": "none", "marker": "o", "ms": 6.0, "color": style.STRIKE}
            handles.append(Line2D([], [], **dot, label=say("particle-0")))
    if machine.movers:
        shown = ["both"] if bodies else ["surfaces"]
    if shown:
        ax.set_xlabel(say(f"x-with-{shown[0]}", time=figures(t)))
    if len(machine.streams) > 1:
        handles += stream_handles(machine, all_of_them=bodies and crowd)
    if legend:
        style.legend_above(ax, 4, handles)
    return ax


def draw_sensors(ax: Axes, recording: Recording) -> Axes:
    """Draw the sensors of the scene: dashed lines with their names at the upper end."""
    for sensor in recording.scene.sensor:
        ends = np.array([sensor.from_, sensor.to])
        ax.plot(*ends.T, ls="--", lw=1.2, color=style.INK, marker="_", ms=7.0, gid="sensor")
        ax.annotate(
            style.plain(sensor.name), ends[ends[:, 1].argmax()], (0.0, 4.0), fontsize=style.SMALL,
            textcoords="offset points", ha="center", zorder=6.0,
        )  # fmt: skip
    return ax


def fullest(recording: Recording) -> float:
    """Return the last of some times, s, with half of the maximum number in sight."""
    clock = recording.knots["t"]
    times = np.linspace(clock.min(), clock.max(), 61)
    released = np.flatnonzero(recording.released)
    there = window_of(recording).holds(places(recording, released, times)).sum(axis=1)
    return float(times[np.flatnonzero(2 * there >= there.max())[-1]])


def draw_moments(figure: Picture, place: SubplotSpec, recording: Recording, *, crowd: bool) -> None:
    """Draw the scene small, without names, with all particles, at four equally spaced times."""
    window, clock = window_of(recording), recording.knots["t"]
    room = place.get_position(figure)
    size = np.array([room.height * SIZE[1], room.width * SIZE[0]])
    # Rows and columns in which they are largest.
    grid = max(
        ((1, 4), (2, 2), (4, 1)),
        key=lambda grid: float((size / grid / (window.height, window.width)).min()),
    )
    cells = place.subgridspec(*grid, wspace=0.08, hspace=0.2)
    times = np.linspace(clock.min(), clock.max(), 4)
    for t, cell in zip(times, np.ndindex(*grid), strict=True):
        ax = figure.add_subplot(cells[cell])
        draw_moved(ax, recording.machine, t)
        draw_scene(ax, recording.machine, window, small=True)
        draw_bodies(ax, recording, t, crowd=crowd)
        ax.set(xticks=[], yticks=[])
        for spine in ax.spines.values():
            spine.set_color(style.STEEL_LIGHT)
        said = ax.annotate(
            f"{figures(t)} s", (0.0, 1.0), xycoords="axes fraction", xytext=(3.0, -3.0),
            textcoords="offset points", va="top", gid="moment",
        )  # fmt: skip
        said.set(fontsize=style.SMALL, path_effects=halo(), zorder=8.0)


WIDE = 185
"""Most characters of a line of text below the panels."""

ROLES: dict[str, tuple[str, Any]] = {
    "first": (BLUE, "-"),
    "second": (VERMILION, (0, (5, 2))),
    "third": (GREEN, (0, (2, 1.4))),
    "fourth": (ORANGE, (0, (6, 1.5, 1.2, 1.5))),
    "plate": ("#000000", "-"),
    "belt": (GREEN, "-"),
}
"""Colour and dashes of lines, which can be distinguished without colour, too."""

MARGIN = 0.06
"""Margin on each side, as a share of the range."""

TEXT = 0.215
"""Height of a line of text, inches."""


def paper_figure(found: PaperFigure) -> Picture:
    """Draw a figure of the paper: panels side by side, and the misprint's effect in words."""
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
        # Both panels of a pair have the same limits, since the eye compares heights.
        first = axes[-1] if i % 2 else None
        ax = figure.add_subplot(grid[i], sharex=first, sharey=first)
        axes.append(ax)
        ax.margins(MARGIN)
        style.dress(ax, panel.x_label, panel.y_label, panel.title)
        for line in panel.lines:
            (color, dashes), solid = ROLES[line.role], line.role in ("plate", "belt")
            ax.plot(
                line.x, line.y, color=color, ls=dashes, lw=3.0 if solid else 1.8, label=line.label,
                zorder=3.0 if solid else 4.0, gid=line.role,
            )  # fmt: skip
            if line.marks is not None:
                ax.plot(*line.marks.T, "o", color=color, ms=4.5, mfc="white", zorder=5.0)
        if panel.to_scale:
            ax.set_aspect("equal", adjustable="box")
        else:
            ax.legend(loc="best", fontsize=style.SMALL, framealpha=0.85, edgecolor="none")
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


AWAY = 9.0
"""pt from the middle of a dot to the text beside it."""

SIDES = ((0, 0.8), (1, 0), (-1, 0), (0.7, 0.6), (-0.7, 0.6), (0.7, -0.6), (-0.7, -0.6), (0, -0.8))
"""Directions from a dot in which its text may stand, the best first."""


def strobe(
    recording: Recording, prediction: Transfer | None = None, *, path: str | Path | None = None
) -> Figure:
    """Draw particle 0 at round times, with the times, over its analytic parabola.

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
        9 by 5.6 inches at 300 dots to the inch.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    figure = Picture((9.0, 5.6), dpi=300)
    ax = figure.add_axes((0.095, 0.09, 0.885, 0.77))
    draw_view(ax, recording, analytic_of(recording, prediction)[0])
    draw_times(ax, recording)
    figure.headline(0.095, 0.955, recording.title, 70)
    figure.write(path)
    return figure


def draw_times(ax: Axes, recording: Recording) -> Axes:
    """Write the time beside each strobe dot, on the first of `SIDES` where it hides nothing.

    Its own dot must be the nearest to its middle, or it would be read as another's. If no side is
    free, the time is left out.
    """
    times = strobe_times(recording)
    dots, _ = nominal(recording, times)
    digits = max(0, -floor(log10(strobe_step(recording)) + 1e-9))
    # In pixels from here on: dots, texts and lines drawn so far.
    pixels = ax.transData.transform(dots)
    half, gap = np.array([0.4 * AWAY, 1.5]) * ax.figure.dpi / 72.0
    taken = [text.get_window_extent() for text in ax.texts]
    taken += [Bbox([dot - half, dot + half]) for dot in pixels]
    lines = [line for line in ax.lines if line.get_linestyle() != "None"]
    paths = [line.get_path().transformed(line.get_transform()) for line in lines]
    tracks = [path for collection in ax.collections for path in collection.get_paths()]
    paths += [path.transformed(ax.transData) for path in tracks]
    filled = [patch.get_path().transformed(patch.get_transform()) for patch in ax.patches]
    inside = ax.get_window_extent().padded(-half)

    def free(box: Bbox, own: int) -> bool:
        return bool(
            inside.contains(box.x0, box.y0)
            and inside.contains(box.x1, box.y1)
            and np.hypot(*(pixels - np.mean(box.corners(), axis=0)).T).argmin() == own
            and not box.count_overlaps(taken)
            and not any(path.intersects_bbox(box, filled=False) for path in paths)
            and not any(path.intersects_bbox(box, filled=True) for path in filled)
        )

    for own, (t, dot) in enumerate(zip(times, dots, strict=True)):
        said = figures(t + 0.0, f".{digits}f")
        label = ax.annotate(said, dot, xytext=(0.0, 0.0), textcoords="offset points", gid="time")
        label.set(fontsize=style.SMALL, color=style.TRACK, path_effects=halo(), zorder=8.0)
        for x, y in SIDES:
            label.xyann = (AWAY * x, AWAY * y)
            label.set_horizontalalignment("left" if x > 0.0 else "right" if x < 0.0 else "center")
            label.set_verticalalignment("bottom" if y > 0.0 else "top" if y < 0.0 else "center")
            box = label.get_window_extent().padded(gap)
            if free(box, own):
                taken.append(box)
                break
        else:
            label.remove()
    note = ax.text(1.0, 1.01, say("times-beside"), ha="right", va="bottom")
    note.set(transform=ax.transAxes, fontsize=style.SMALL, color=style.TRACK)
    return ax
