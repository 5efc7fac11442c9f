"""What is measured of a run, on its machine: wear as bands along the surfaces, and fields."""

from __future__ import annotations

from textwrap import fill
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from chutelab.pictures.plots import style
from chutelab.pictures.plots.machinery import draw_scene
from chutelab.pictures.plots.scenery import Window, window_of
from chutelab.pictures.plots.style import Picture, named, say
from chutelab.results import Recording
from chutelab.results.fields import NAMES, Fields
from chutelab.results.loads import pivot_of
from chutelab.results.wear import KEYS, Wear, touched

BANDS: Final = ("erosion", "abrasion")
"""What bands show, a picture each."""


def wear(recording: Recording, *, curves: bool = True) -> Picture:
    """Draw where surfaces wear: bands on the machine, and each surface's four measures along it.

    Bands are shares of the largest piece of all surfaces, curves of the largest of their surface.
    Without `curves` there are the bands alone.
    """
    told = touched(recording)
    rows = max(1, len(told))
    figure = Picture((11.0, 5.9 + 2.0 * rows if curves else 3.6))
    high = figure.get_figheight()
    if curves:
        figure.headline(0.04, 1.0 - 0.35 / high, recording.title)
    above = figure.add_gridspec(
        1, 2, left=0.07, right=0.94, wspace=0.36,
        top=1.0 - (1.0 if curves else 0.4) / high, bottom=1.0 - 4.6 / high if curves else 0.16,
    )  # fmt: skip
    for n, key in enumerate(BANDS):
        ax = style.dress(figure.add_subplot(above[n]), say("x"), say("y"), say(f"wear-{key}"))
        draw_scene(ax, recording.machine, window_of(recording))
        draw_band(ax, told, key)
    if not curves:
        return figure
    below = figure.add_gridspec(
        rows, 1, left=0.07, right=0.95, top=1.0 - 5.75 / high, bottom=0.55 / high, hspace=0.9
    )
    for row, (name, one) in enumerate(told.items()):
        ax = figure.add_subplot(below[row])
        style.dress(ax, say("along-surface"), say("share"), named(name))
        draw_wear(ax, one)
        if row == 0:
            figure.legend(
                *ax.get_legend_handles_labels(), ncols=4, fontsize=style.SMALL, frameon=False,
                loc="upper center", bbox_to_anchor=(0.5, 1.0 - 5.1 / high),
            )  # fmt: skip
    return figure


def draw_band(ax: Axes, told: dict[str, Wear], key: str) -> Axes:
    """Draw bands along surfaces, coloured by shares of the largest piece of all, and their bar."""
    every = [getattr(one, key) for one in told.values()]
    most = max((float(np.nanmax(values, initial=0.0)) for values in every), default=0.0)
    lines, shares = [], []
    for one, values in zip(told.values(), every, strict=True):
        for part in np.flatnonzero(values > 0.0).tolist():
            lines.append(one.places[part])
            shares.append(values[part] / most)
    band = LineCollection(
        lines, cmap="YlOrRd", linewidths=7.0, capstyle="butt", zorder=4.0, gid=f"wear {key}"
    )
    band.set(array=np.array(shares), clim=(0.0, 1.0))
    ax.add_collection(band, autolim=False)
    bar = ax.figure.canvas.figure.colorbar(
        band, ax=ax, format=style.Digits(), fraction=0.035, pad=0.02
    )
    bar.set_label(say("share-of-largest"), fontsize=style.SMALL)
    bar.ax.tick_params(labelsize=style.SMALL)
    return ax


def draw_wear(ax: Axes, one: Wear) -> Axes:
    """Draw the four measures of a surface's wear along it, each by its largest piece."""
    colours = style.INK, style.TRACK, style.STRIKE, style.BELT
    for key, colour, line in zip(KEYS, colours, ("-", "-", "--", ":"), strict=True):
        values = getattr(one, key)
        most = float(np.nanmax(values, initial=0.0))
        shares = values / most if most > 0.0 else np.zeros_like(values)
        ax.stairs(shares, one.edges, color=colour, ls=line, lw=1.5, label=say(f"wear-{key}"))
    ax.set(xlim=(0.0, one.edges[-1]), ylim=(0.0, 1.05))
    return ax


THIN: Final = 1e-3
"""Share of the largest density below which a cell is left empty."""


def field(recording: Recording, found: Fields, name: str) -> Picture:
    """Draw a field in colours on the machine, with its bar; empty where next to nothing is.

    The bar is of what the picture shows.
    """
    figure = Picture((11.0, 7.0))
    figure.headline(0.04, 0.955, recording.title)
    figure.remark(0.04, 0.925, fill(found.note, 130), fontsize=style.SMALL)
    ax = style.dress(figure.add_axes((0.07, 0.09, 0.86, 0.74)), say("x"), say("y"))
    draw_scene(ax, recording.machine, window_of(recording))
    edges = [np.append(one - 0.5 * found.cell, one[-1] + 0.5 * found.cell)
             for one in (found.x, found.y)]  # fmt: skip
    inside = [
        (one > low - 0.5 * found.cell) & (one < high + 0.5 * found.cell)
        for one, (low, high) in ((found.x, ax.get_xlim()), (found.y, ax.get_ylim()))
    ]
    thin = (found.density < THIN * found.density.max()) | ~np.logical_and.outer(*inside)
    values = np.ma.masked_invalid(np.where(thin, np.nan, found[name])).T
    signed = bool(values.count()) and values.min() < 0.0 < values.max()
    reach = float(np.abs(values).max()) if signed else None
    mesh = ax.pcolormesh(
        *edges, values, cmap="RdBu_r" if signed else "viridis", rasterized=True, zorder=0.6,
        vmin=-reach if reach else None, vmax=reach, gid="field",
    )  # fmt: skip
    bar = figure.colorbar(mesh, ax=ax, format=style.Digits(), fraction=0.03, pad=0.02)
    bar.set_label(f"{say(f'field-{name}')}, {NAMES[name]}", fontsize=style.NORMAL)
    return figure


def drawing(recording: Recording) -> Picture:
    """Draw the machine to scale with the names of its parts and its main lengths.

    These are how far the first plate's pivot is from the pulley's axis and the outgoing belt below
    the pulley's top; of another machine its width and height, if all of it is in the picture.
    """
    figure = Picture((11.0, 4.0))
    ax = style.dress(figure.add_axes((0.07, 0.14, 0.9, 0.82)), say("x"), say("y"))
    machine = recording.machine
    # The lengths stand left of the machine and below it.
    window = window_of(recording)
    left, bottom = window.left - 0.06 * window.width, window.bottom - 0.15 * window.height
    draw_scene(ax, machine, Window(left, window.right, bottom, window.top))
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    if not len(machine.corners):
        return figure
    low, high = machine.corners.min(axis=0), machine.corners.max(axis=0)
    names, wheel = machine.surfaces, machine.pulley
    if wheel is not None:
        low[1], high[1] = high[1], wheel.radius
        if "plate" in names:
            low[0], high[0] = 0.0, pivot_of(machine, names.index("plate"))[0]
        if "outgoing" in names:
            low[1] = pivot_of(machine, names.index("outgoing"))[1]
    x, y = left + 0.03 * (right - left), bottom + 0.03 * (top - bottom)
    for begin, end, seen in (
        ((low[0], y), (high[0], y), left <= low[0] < high[0] <= right),
        ((x, low[1]), (x, high[1]), bottom <= low[1] < high[1] <= top),
    ):
        if not seen:
            continue
        ax.annotate("", begin, end, arrowprops={"arrowstyle": "<->", "color": style.MUTED})
        lies = begin[1] == end[1]
        ax.annotate(
            style.quantity(float(np.hypot(*np.subtract(end, begin))), "m"),
            tuple(0.5 * np.add(begin, end)), (0.0, 4.0) if lies else (-4.0, 0.0),
            textcoords="offset points", ha="center" if lies else "right",
            va="bottom" if lies else "center", rotation=0 if lies else 90, fontsize=style.SMALL,
            color=style.MUTED, gid="dimension",
        )  # fmt: skip
    return figure
