"""Pictures of measurements: of a run, and of points from a film.

Wear as bands along the surfaces, fields, flow through sensors, loads, the velocity at an impact;
points of a film, and their residuals.
"""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from textwrap import fill
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from chutelab.pictures import BLUE, VERMILION
from chutelab.pictures.plots import style
from chutelab.pictures.plots.machinery import draw_scene
from chutelab.pictures.plots.panels import analytic_of, draw_analytic
from chutelab.pictures.plots.scenery import (
    FAR,
    FINE,
    Window,
    around,
    path_of,
    struck_by_nominal,
    window_of,
)
from chutelab.pictures.plots.style import Picture, figures, named, say, spoken
from chutelab.results import Kind, Recording
from chutelab.results.fields import NAMES, Fields
from chutelab.results.loads import borne, pivot_of
from chutelab.results.sensors import flow, readings, sensed
from chutelab.results.wear import KEYS, Wear, touched
from chutelab.scene.units import write_size
from chutelab.studies.measured import Fit, Residuals
from chutelab.util.arrays import Floats
from chutelab.util.tables import many, number, plus_minus

BANDS: Final = ("erosion", "abrasion")
"""Quantities of bands, one picture each."""


def wear(recording: Recording, *, curves: bool = True) -> Picture:
    """Draw the wear of surfaces: bands on the machine, and four measures along each surface.

    Bands are relative to the largest piece of all surfaces, curves to the largest of their surface.
    Without `curves` there are only the bands.
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
    """Draw bands along surfaces, coloured relative to the largest piece, and their bar."""
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
    style.colour_bar(ax, band, say("share-of-largest"))
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
    """Draw a field in colours on the machine, with its bar; empty where density is small.

    The bar has the range of the picture.
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
    style.colour_bar(ax, mesh, f"{say(f'field-{name}')}, {NAMES[name]}")
    return figure


def drawing(recording: Recording) -> Picture:
    """Draw the machine to scale with the names of its parts and its main lengths.

    These are the distance of the first plate's pivot from the pulley's axis and of the outgoing
    belt from the pulley's top; for another machine its width and height, if all of it is in the
    picture.
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


BINS = 40
"""Bins of the flow through a sensor over time, and of the places along it."""


def sensors(recording: Recording) -> Picture:
    """Draw for each sensor of the scene the flow over time, and the places of passages."""
    told = readings(recording)
    figure, pairs = in_pairs(recording, len(told))
    last = float(recording.knots["t"].max(initial=1e-9))
    for (name, one), (left, right) in zip(told.items(), pairs, strict=True):
        found = sensed(recording, name)
        edges, counted = flow(found, last / BINS, last)
        style.dress(left, say("time"), say("per-second"), name)
        left.stairs(counted / (last / BINS), edges, fill=True, color=style.STREAM)
        rate = spoken().local(number(one.rate))
        style.note(left, say("passed", count=one.count, back=one.back, rate=rate))
        style.dress(right, say("along-sensor"), say("particles"), "")
        right.hist(found["along"][found["way"] > 0], BINS // 2, color=style.STREAM)
        if isfinite(one.depth):
            style.note(right, say("depth", depth=style.quantity(one.depth, "m")))
    return figure


def in_pairs(recording: Recording, rows: int) -> tuple[Picture, list[tuple[Axes, Axes]]]:
    """Return a figure with the recording's title, and two axes beside each other in each row."""
    high = 1.7 + 2.6 * max(1, rows)
    figure = Picture((9.6, high))
    figure.headline(0.04, 1.0 - 0.35 / high, recording.title)
    grid = figure.add_gridspec(
        max(1, rows), 2, left=0.085, right=0.975, top=1.0 - 1.35 / high, bottom=0.6 / high,
        hspace=0.6, wspace=0.24,
    )  # fmt: skip
    return figure, [
        (figure.add_subplot(grid[row, 0]), figure.add_subplot(grid[row, 1])) for row in range(rows)
    ]


def loads(recording: Recording) -> Picture:
    """Draw for each loaded surface its forces over time, and the torque on it."""
    told = borne(recording)
    figure, pairs = in_pairs(recording, len(told))
    for (name, one), (left, right) in zip(told.items(), pairs, strict=True):
        style.dress(left, say("time"), say("load-force"), named(name))
        pressing, along = say("load-pressing"), say("load-along")
        left.stairs(one.normal, one.edges, fill=True, color=style.STREAM, label=pressing)
        left.stairs(one.along, one.edges, color=style.STRIKE, lw=1.2, label=along)
        mean, peak, *_ = one.part("normal")
        left.axhline(mean, color=style.INK, lw=1.0, ls="--", label=say("load-mean"))
        size = style.quantity
        style.note(left, say("load-told", mean=size(mean, "N"), peak=size(peak, "N")))
        if not figure.legends:
            top = 1.0 - 0.45 / figure.get_figheight()
            figure.legend(loc="upper left", bbox_to_anchor=(0.03, top), ncols=3)
        style.dress(right, say("time"), say("load-torque"), "")
        right.stairs(one.torque, one.edges, color=style.TRACK, lw=1.2)
        x, y = (figures(value, ".4g") for value in one.pivot)
        style.note(right, say("load-pivot", x=x, y=y))
        for ax in (left, right):
            ax.set_xlim(0.0, float(one.edges[-1]))
    return figure


ALONG, INTO = BLUE, VERMILION
"""Colours of the component along the surface, and of the one into it."""


LETTERS = 14.0
"""pt; of symbols."""


def split_velocity(
    recording: Recording, path: str | Path | None = None, *, surface: str = "plate"
) -> Picture:
    """Draw the velocities before and after the first impact on a surface, with components.

    They are to scale, with the theory's symbols and no number: v_2 before and v_2' after, v_t along
    the surface, v_n into it, φ_2 between surface and v_2, α between surface and the vertical.

    Raises a `ValueError` if no particle hits that surface; an `OSError` if the file cannot be
    written.
    """
    impacts = recording.select(Kind.IMPACT, surface=surface)
    if not len(impacts):
        raise ValueError(f"no particle hits a surface {surface!r}")
    before, after = impacts[0]["velocity_before"], impacts[0]["velocity_after"]
    segments = recording.machine.segments
    tangent = segments.tangent[segments.surface == impacts[0]["surface"]][0]
    tangent = tangent if tangent @ before > 0.0 else -tangent
    normal = np.array([-tangent[1], tangent[0]])
    normal = normal if normal @ before < 0.0 else -normal
    speed, here = float(np.hypot(*before)), np.zeros(2)
    figure = Picture((7.2, 3.9))
    left, right = (figure.add_axes((place, 0.02, 0.48, 0.96)) for place in (0.01, 0.51))
    for ax in (left, right):
        ax.set_aspect("equal")
        ax.set_axis_off()
        ends = np.outer([-1.2 * speed, 1.2 * speed], tangent)
        ax.plot(*ends.T, color=style.INK, lw=4.0, solid_capstyle="butt", gid="surface")
    into = normal * (normal @ before)
    _arrow(left, -before, here, style.INK, "$v_2$", -before / speed, 0.0)
    _arrow(left, -before, -into, ALONG, "$v_t$", normal)
    _arrow(left, -into, here, INTO, "$v_n$", tangent)
    _angle(left, here, -tangent, -before, 0.6 * speed, r"$\varphi_2$")
    back = normal * (normal @ after)
    _arrow(right, here, after, style.INK, "$v_2'$", after / np.hypot(*after), 1.0)
    _arrow(right, back, after, ALONG, "$v_t' = v_t$", normal)
    _arrow(right, here, back, INTO, r"$v_n' = \varepsilon v_n$", (normal - tangent) / 2.0**0.5, 1.0)
    foot = min(ends.tolist(), key=lambda end: end[1])
    leaning, up = -np.array(foot), np.array([0.0, 1.0])
    if abs(leaning[0]) > 1e-9 * speed:
        line = np.stack([foot, foot + 0.9 * speed * up])
        right.plot(*line.T, color=style.MUTED, lw=1.0, ls="--")
        _angle(right, np.array(foot), up, leaning, 0.6 * speed, r"$\alpha$")
    for ax in (left, right):
        ax.set(xlim=(-1.25 * speed, 1.25 * speed), ylim=(-1.25 * speed, 1.25 * speed))
    figure.write(path)
    return figure


def _pair(place: Floats) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def _arrow(
    ax: Axes, tail: Floats, tip: Floats, color: str, said: str, aside: Floats, at: float = 0.5
) -> None:
    """Draw an arrow, and its symbol at a share of its length, on the side of `aside`."""
    look = {"arrowstyle": "-|>", "color": color, "lw": 2.2, "shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", _pair(tip), _pair(tail), arrowprops={**look, "mutation_scale": 14.0})
    across, up = (0 if abs(part) < 0.3 else int(np.sign(part)) for part in aside)
    ax.annotate(
        said,
        _pair(tail + at * (tip - tail)),
        _pair((8.0 if across else 13.0) * aside),
        textcoords="offset points",
        color=color,
        fontsize=LETTERS,
        ha=("center", "left", "right")[across],
        va=("center", "bottom", "top")[up if across else 0],
    )


def _angle(ax: Axes, at: Floats, one: Floats, other: Floats, radius: float, said: str) -> None:
    """Draw the arc of the angle between two directions, with its symbol inside."""
    first, second = (float(np.arctan2(*direction[::-1])) for direction in (one, other))
    turn = (second - first + np.pi) % (2.0 * np.pi) - np.pi
    angles = first + turn * np.linspace(0.0, 1.0, 40)
    arc = at + radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ax.plot(*arc.T, color=style.MUTED, lw=1.2)
    middle = first + 0.5 * turn
    x, y = at + 0.72 * radius * np.array([np.cos(middle), np.sin(middle)])
    ax.text(x, y, said, color=style.MUTED, fontsize=LETTERS, ha="center", va="center")


PARAMETERS = 6
"""Most fitted parameters that are written into the figure."""


POINTS: dict[str, Any] = {"ls": "none", "marker": "+", "ms": 7.0, "mew": 1.3}
"""Style of measured points."""


def measured(found: Residuals, fit: Fit | None = None) -> Picture:
    """Draw a measured track over the simulation and its analytic parabola, and the residuals.

    With a fit, whose residuals are `after`, the starting track is drawn, too, dotted, with the
    fitted values.
    """
    figure = Picture((13.0, 7.6))
    lines = 0 if fit is None else min(len(fit.parameters), PARAMETERS)
    top = 0.88 - 0.032 * max(0, lines - 1)
    ax = figure.add_axes((0.06, 0.08, 0.5, 0.8))
    recording, position = found.recording, found.track.position
    window = window_of(recording)
    far = window.padded(*[FAR] * 4)
    corners = np.array([[window.left, window.bottom], [window.right, window.top]])
    style.dress(ax, "x, m", "y, m")
    shown = far.holds(position)
    draw_scene(ax, recording.machine, around(np.concatenate([corners, position[shown]])))
    parts, _ = analytic_of(recording)
    draw_analytic(ax, parts)
    before = None if fit is None else fit.before.recording
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
            0.5, 0.97, f"{many(int((~shown).sum()), 'point')} outside the picture",
            transform=ax.transAxes, fontsize=style.NORMAL, color=style.STRIKE,
            horizontalalignment="center", verticalalignment="top",
        )  # fmt: skip
    style.legend_above(ax, 3)
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


def draw_residuals(ax: Axes, found: Residuals, axis: int) -> Axes:
    """Draw measured minus simulated x (axis 0) or y (axis 1) over time, with the impacts."""
    used = found.used
    times, values = found.track.t[used], found.values[used, axis]
    factor, unit = style.scaled(values, "m")
    name, rms = "xy"[axis], found.rms[axis]
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
