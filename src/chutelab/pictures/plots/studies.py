"""Pictures of many runs: searches, uncertainty, sweeps, discharge methods, run time against error.

A sweep is drawn as lines over one varied key, a heat map over two, dots for samples.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import ceil, floor, log10
from textwrap import fill, shorten, wrap
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from chutelab.checks.workprecision import METHODS, PACKAGES, Timing
from chutelab.pictures import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION
from chutelab.pictures.plots import style
from chutelab.pictures.plots.machinery import draw_scene
from chutelab.pictures.plots.scenery import around
from chutelab.pictures.plots.style import Picture
from chutelab.scene.quantities import counted
from chutelab.scene.units import symbol, with_unit
from chutelab.studies.design import Solution, Uncertainty
from chutelab.studies.discharge import SideBySide, stream_at
from chutelab.studies.repeats import Repeats
from chutelab.studies.sweep import COLUMNS, REASON, Sweep, no_column
from chutelab.studies.sweep.rows import ERROR, RARE, mean_and_error
from chutelab.theory.discharge import NAMES
from chutelab.util.arrays import Bools, Floats
from chutelab.util.tables import plus_minus

BARS = (BLUE, SKY)
KINDS = (SKY, ORANGE, GREEN, VERMILION, GREY)
"""Colours of the kinds of outcome; the last one also for all further ones."""

MISSING = "///"
"""Hatch where the plate is never met."""


TALL = 44
"""Most characters of a line beside axes; longer labels have two lines."""


def axis_label(name: str, unit: str, until: str | float | None = None, what: str = "") -> str:
    """Return the label of an axis: a quantity, or what it is, up to when it counts, its unit."""
    said = ", ".join(filter(None, [what or name, counted(name, until)]))
    return fill(with_unit(said, unit), TALL, break_long_words=False)


def scan(solution: Solution) -> Picture:
    """Draw a search over one key: the quantity, its target, answers and jumps.

    Each smooth piece is a line, so that jumps are gaps. Raises a `ValueError` if several keys were
    varied.
    """
    found = solution.scan
    if solution.outcomes is not None:
        return _searched(solution)
    if found is None:
        raise ValueError("several keys were varied: there is no line to draw")
    figure = Picture((9.0, 5.6))
    ax = figure.add_axes((0.105, 0.115, 0.865, 0.66))
    key, (name, *_), (unit, *_) = solution.ranges[0], solution.quantities, solution.units
    factor, said = style.scaled(found.values, unit)
    until = solution.base.run.until
    style.dress(ax, with_unit(key.key, key.unit), axis_label(name, said, until))
    for i, piece in enumerate(found.pieces):
        look: dict[str, Any] = {"color": style.TRACK, "lw": 1.8, "zorder": 4.0, "gid": "quantity"}
        ax.plot(piece.x, factor * piece.values[:, 0], label="" if i else style.plain(name), **look)
    if solution.goal == "solve":
        look = {"color": style.ANALYTIC, "lw": 1.6, "ls": "--", "zorder": 3.0, "gid": "target"}
        ax.plot(found.x, factor * found.values[:, 1], label="target", **look)
    for i, change in enumerate(solution.changes):
        label = "" if i else "the particle's way changes"
        ax.axvline(change.at, color=style.MUTED, lw=1.0, ls=":", zorder=1.0, label=label)
    for low, high in solution.everywhere:
        ax.axvspan(low, high, color=style.STEEL_LIGHT, zorder=0.5, label="all solve it")
    for jump in solution.jumps:
        ends = [factor * jump.before, factor * jump.after]
        ax.plot([jump.at] * 2, ends, color=style.STRIKE, lw=1.2, ls=":", zorder=2.0)
    # The answers, with the key's value beside each.
    shown = solution.answers or ((solution.nearest,) if solution.nearest else ())
    words = {"solve": "solution", "minimize": "least", "maximize": "most"}[solution.goal]
    for i, answer in enumerate(shown):
        x, y = answer.values[0], factor * answer.found[0]
        first = solution.goal == "solve" or i == 0
        text = words if solution.solved else "nearest"
        ax.plot(
            x, y,
            marker="o" if solution.solved else "X", markersize=9.0 if first else 6.0,
            linestyle="none", color=style.STRIKE, zorder=6.0,
            markerfacecolor=style.STRIKE if first else "white",
            label=text if i == 0 else "", gid=text, clip_on=False,
        )  # fmt: skip
        if first:
            left = x > 0.5 * sum(ax.get_xlim())
            ax.annotate(
                f"{x:.6g}", (x, y), xytext=(-9 if left else 9, 8), textcoords="offset points",
                fontsize=style.NORMAL, horizontalalignment="right" if left else "left", zorder=7.0,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
            )  # fmt: skip
    _titles(figure, solution.base.title, solution.asked)
    style.legend_above(ax, 4)
    return figure


def _searched(solution: Solution) -> Picture:
    """Draw the variants of a search with seeds: numbers with bars over one key, a map of two."""
    points, seeds = solution.variants, solution.outcomes
    assert points is not None
    assert seeds is not None
    mean, error = mean_and_error(np.moveaxis(seeds, 1, 0))
    figure = Picture((9.0, 5.6))
    ax = figure.add_axes((0.105, 0.115, 0.865, 0.66))
    name, unit = solution.quantities[0], solution.units[0]
    factor, said = style.scaled(mean[:, :1], unit)
    keys = [with_unit(one.key, one.unit) for one in solution.ranges[:2]]
    told = axis_label(name, said, solution.base.run.until)
    style.dress(ax, keys[0], keys[1] if len(keys) > 1 else told)
    best = solution.answer if solution.solved or solution.nearest else None
    if len(keys) > 1:
        known = ax.scatter(points[:, 0], points[:, 1], c=factor * mean[:, 0], cmap=COLORS, s=22.0)
        style.colour_bar(ax, known, told)
    else:
        look: dict[str, Any] = {"fmt": "o", "ms": 4.0, "color": style.TRACK, "capsize": 2.5}
        ax.errorbar(points[:, 0], factor * mean[:, 0], factor * error[:, 0], **look)
        if best is not None and best.wanted:
            ax.axhline(factor * best.wanted[0], color=style.ANALYTIC, ls="--", label="target")
    if best is not None and best.errors:
        up = best.values[1] if len(keys) > 1 else factor * best.found[0]
        size = best.errors[1] if len(keys) > 1 else factor * best.found_errors[0]
        text = "answer" if solution.solved else "nearest"
        look = {"fmt": "o" if solution.solved else "X", "ms": 8.0, "color": style.STRIKE}
        look |= {"capsize": 4.0, "zorder": 6.0, "label": text}
        ax.errorbar(best.values[0], up, size, best.errors[0], **look)
        ax.set_title(
            ", ".join(map(plus_minus, best.values, best.errors)), fontsize=style.NORMAL, loc="left"
        )
        ax.legend(loc="best", fontsize=style.SMALL)
    _titles(figure, solution.base.title, solution.asked)
    return figure


def repeats(found: Repeats) -> Picture:
    """Draw each quantity over seeds: dots are runs, bars the standard error of their mean.

    Quantities that are equal for all seeds are left out.
    """
    rows = [(row, one) for row, one in found.shown() if one.error > 0.0 and one.mean]
    figure = Picture((9.0, 1.6 + 0.19 * len(rows)))
    height = float(figure.get_figheight())
    ax = figure.add_axes((0.4, 0.6 / height, 0.57, 1.0 - 1.35 / height))
    style.dress(ax, "away from the mean, % of it", "")
    for place, (row, one) in enumerate(rows):
        size = 100.0 / abs(one.mean)
        values = size * (found.values[row.name] - one.mean)
        ax.plot(values, np.full(len(values), place), ".", ms=4.0, color=BLUE, alpha=0.45)
        ax.errorbar(0.0, place, xerr=size * one.error, fmt="|", color=style.INK, capsize=3.0)
    ax.set_yticks(range(len(rows)), [style.plain(row.name) for row, _ in rows])
    ax.tick_params(axis="y", labelsize=style.SMALL)
    ax.set_xscale("symlog", linthresh=1.0)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    said = f"{len(found)} seeds: dots are runs, bars ± the standard error of the mean"
    _titles(figure, found.scene.title, said)
    return figure


def spread(found: Uncertainty) -> Picture:
    """Draw the effect of uncertain inputs: distribution, strongest input, and shares."""
    rows = len(found.quantities)
    height = 1.4 + 3.1 * rows
    figure = Picture((13.0, height))
    grid = figure.add_gridspec(
        rows, 3, left=0.06, right=0.985, top=1.0 - 1.15 / height, bottom=0.55 / height,
        hspace=0.42, wspace=0.36, width_ratios=(1.0, 1.0, 1.0),
    )  # fmt: skip
    for row in range(rows):
        draw_distribution(figure.add_subplot(grid[row, 0]), found, row)
        draw_strongest(figure.add_subplot(grid[row, 1]), found, row)
        ax = draw_shares(figure.add_subplot(grid[row, 2]), found, row)
        if row < rows - 1:
            ax.set_xlabel("")
    given = ", ".join(
        f"{one.key} = {one.mean:g} ± {one.spread:.3g} {symbol(one.unit)}".rstrip()
        for one in found.spreads
    )
    _titles(figure, found.scene, given, wide=150)
    return figure


def draw_distribution(ax: Axes, found: Uncertainty, row: int) -> Axes:
    """Draw the distribution of a quantity, its mean and its 95 % interval."""
    values = found.outputs[:, row]
    values = values[np.isfinite(values)]
    factor, unit = style.scaled(values, found.units[row])
    name = found.quantities[row]
    style.dress(ax, axis_label(name, unit), "samples", name)
    if not len(values):
        return ax
    low, high = factor * found.interval[row]
    often = [kind for kind, one in found.kinds.items() if one.share > RARE][: len(KINDS) - 1]
    parts = {f"touch {kind}": factor * found.outputs[found.touches == kind, row] for kind in often}
    parts["others"] = factor * found.outputs[~np.isin(found.touches, often), row]
    parts = {name: one[np.isfinite(one)] for name, one in parts.items()}
    parts = {name: one for name, one in parts.items() if len(one)}
    ax.hist(
        list(parts.values()), 40, color=KINDS[: len(parts)], stacked=True, edgecolor="white",
        label=[style.plain(shorten(name, 34, placeholder=" …")) for name in parts], lw=0.3,
        zorder=3.0,
    )  # fmt: skip
    if len(parts) > 1:
        ax.legend(loc="best", fontsize=style.SMALL)
    ax.axvspan(low, high, color=style.STEEL_LIGHT, zorder=0.5)
    ax.axvline(factor * found.mean[row], color=style.INK, linewidth=1.4, zorder=4.0)
    style.note(ax, f"95 %: {low:.4g} to {high:.4g}")
    return ax


def draw_strongest(ax: Axes, found: Uncertainty, row: int) -> Axes:
    """Draw a quantity against the input that explains most of it."""
    first = np.nan_to_num(found.indices[row].first)
    k = int(np.argmax(first))
    one = found.spreads[k]
    values = found.outputs[:, row]
    factor, unit = style.scaled(values, found.units[row])
    quantity = axis_label(found.quantities[row], unit)
    style.dress(ax, with_unit(one.key, one.unit), quantity, f"against {one.key}")
    look: dict[str, Any] = {"color": style.TRACK, "ms": 3.0, "alpha": 0.5, "zorder": 3.0}
    ax.plot(found.inputs[:, k], factor * values, ".", **look)
    return ax


def draw_shares(ax: Axes, found: Uncertainty, row: int) -> Axes:
    """Draw the share of the variance that each input explains, alone and with interactions."""
    indices = found.indices[row]
    name = found.quantities[row]
    style.dress(ax, "share of the variance, %", "", f"{name}: what the spread comes from")
    places = np.arange(len(found.spreads), dtype=np.float64)
    for offset, label, values, spans, colour in (
        (-0.19, "alone", indices.first, indices.first_interval, BARS[0]),
        (0.19, "with interactions", indices.total, indices.total_interval, BARS[1]),
    ):
        shown = 100.0 * np.clip(np.nan_to_num(values), 0.0, None)
        reach = 100.0 * np.clip(np.nan_to_num(spans.T), 0.0, None)
        errors = np.clip(np.stack([shown - reach[0], reach[1] - shown]), 0.0, None)
        ax.barh(
            places + offset, shown, height=0.36, color=colour, zorder=3.0, label=label,
            xerr=errors, error_kw={"ecolor": style.INK, "elinewidth": 1.0, "capsize": 2.5},
        )  # fmt: skip
    names = [style.plain(fill(one.key, 18, break_long_words=False)) for one in found.spreads]
    ax.set_yticks(places, names)
    ax.invert_yaxis()
    ax.set_xlim(0.0, max(105.0, ax.get_xlim()[1]))
    ax.grid(visible=False, axis="y")
    if row == 0:
        room = max(0.45, 0.14 * len(places))
        ax.set_ylim(len(places) - 0.5 + room, -0.5)  # below the last bar, for the legend
        ax.legend(loc="lower center", ncols=2, fontsize=style.SMALL, frameon=False)
    return ax


def _titles(figure: Picture, title: str, text: str, wide: int = 95) -> None:
    """Write a title, and a line below it."""
    height = float(figure.get_figheight())
    figure.headline(0.02, 1.0 - 0.28 / height, title, 70)
    figure.remark(0.02, 1.0 - 0.47 / height, fill(text, wide))


MOST_LINES, DOTS = 8, 60
"""Most values of a second key with a line each (more make a heat map), and most values of a line
with markers."""

COLORS, LIGHTEST = "viridis", 0.88
"""From dark to light with growing values, also for colour-blind readers and in print; and the share
of it that is used for lines, as the rest is too light on white."""


def sweep_figure(swept: Sweep, column: str) -> Picture:
    """Draw one column of numbers of a sweep over its one or two varied keys.

    Raises a `ValueError` if more than two keys vary, or there is no such column.
    """
    if column not in COLUMNS:
        raise ValueError(no_column(column))
    figure = Picture((8.6, 5.4))
    draw_sweep(figure.add_subplot(), swept, column)
    # Room for the label of a colour bar.
    right = 0.97 if len(figure.axes) == 1 else 0.87
    figure.subplots_adjust(left=0.13, right=right, top=0.86, bottom=0.2)
    figure.headline(0.03, 0.955, swept.title)
    gone = np.flatnonzero(~np.isfinite(swept.columns[column]))
    reasons = Counter(reason for reason in swept.columns[REASON][gone].tolist() if reason)
    why = "".join(f", most: {reason}" for reason, _ in reasons.most_common(1))
    seeds = f"bars: ± the standard error of the mean of {swept.repeat} seeds"
    said = f"{len(gone):,} of {len(swept):,} have none{why}" if len(gone) else ""
    said = "; ".join(filter(None, (seeds if swept.repeat > 1 else "", said)))
    said = fill(said, 118, max_lines=2, placeholder=" …")
    figure.remark(0.03, 0.045, said, fontsize=style.SMALL, va="center")
    return figure


def draw_sweep(ax: Axes, swept: Sweep, column: str) -> Axes:
    """Draw one column: lines, a heat map over two keys with many values, or dots of samples.

    Dots over two keys have their values as colours; crosses are missing values.
    """
    keys = [key for key in swept.quantities if len(np.unique(swept.columns[key])) > 1]
    if len(keys) > 2:
        raise ValueError(f"a picture shows one or two varied keys, not {len(keys)}")
    keys = keys or list(swept.quantities)[:1]
    what, unit = COLUMNS[column].meaning.removesuffix(", mean"), swept.unit(column)
    what = what if what.startswith(("x ", "y ")) else what[0].upper() + what[1:]
    if column.endswith(".spread"):
        what = f"Standard deviation of {column.removesuffix('.spread')}"
    scale, unit = style.scaled(swept.columns[column], unit)
    told, z = axis_label(column, unit, swept.until, what), scale * swept.columns[column]
    bars = scale * swept.columns[f"{column}{ERROR}"] if swept.repeat > 1 else None
    counts = [len(np.unique(swept.columns[key])) for key in keys]
    sampled = swept.shape is None
    by_colour = len(keys) == 2 and (sampled or min(counts) > MOST_LINES)
    if not by_colour:
        # The key with the most values lies along the axis.
        keys = sorted(keys, key=lambda key: -len(np.unique(swept.columns[key])))
    first, second = (swept.columns[key] for key in (keys[0], keys[-1]))
    names = [with_unit(key, swept.unit(key)) for key in keys]
    style.dress(ax, names[0], names[1] if by_colour else told)
    if by_colour:
        known = np.isfinite(z)
        if sampled:
            ax.plot(first[~known], second[~known], "x", markersize=4.0, color=style.STEEL)
            painted: ScalarMappable = ax.scatter(
                first[known], second[known], c=z[known], cmap=COLORS, s=16.0
            )
        else:
            painted = draw_heat(ax, first, second, z, swept.columns["impact.count"] == 0.0)
        if known.any():
            if bars is not None and np.isfinite(bars).any():
                told += f" ± {np.nanmedian(bars):.2g}"
            style.colour_bar(ax, painted, told)
        return ax
    if sampled:
        ax.errorbar(first, z, bars, fmt="o", ms=3.5, color=style.TRACK, alpha=0.7, capsize=2.5)
    else:
        others = second if len(keys) == 2 else np.zeros(len(z))
        values = np.unique(others)
        shades = mpl.colormaps[COLORS](np.linspace(0.0, LIGHTEST, len(values)))
        for value, shade in zip(values.tolist(), shades, strict=True):
            chosen = np.flatnonzero(others == value)
            chosen = chosen[np.argsort(first[chosen], kind="stable")]
            ax.errorbar(
                first[chosen], z[chosen], bars[chosen] if bars is not None else None,
                capsize=2.5, color=shade if len(values) > 1 else style.TRACK,
                lw=1.8, marker="o" if len(chosen) <= DOTS else "", ms=4.0, label=f"{value:g}",
            )  # fmt: skip
    if len(keys) == 2:
        ax.legend(
            title=style.plain(names[1]), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=8,
            frameon=False, fontsize=style.SMALL, title_fontsize=style.SMALL, columnspacing=1.2,
            handlelength=1.4, borderaxespad=0.2, alignment="right",
        )  # fmt: skip
    low, high = float(first.min()), float(first.max())
    if low < high:  # the whole range, even without rows
        margin = 0.03 * (high - low)
        ax.set_xlim(low - margin, high + margin)
    return ax


def draw_heat(ax: Axes, x: Floats, y: Floats, z: Floats, missing: Bools) -> ScalarMappable:
    """Draw a heat map; grey where values are missing, hatched where the plate is missed."""
    (x, across), (y, up) = (np.unique(values, return_inverse=True) for values in (x, y))
    field = np.full((len(y), len(x)), np.nan)
    field[up, across] = z
    ax.set_facecolor(style.STEEL_LIGHT)
    ax.grid(visible=False)
    limits: dict[str, Any] = {"cmap": COLORS}
    if np.nanmin(field, initial=0.0) < 0.0 < np.nanmax(field, initial=0.0):
        # White where the sign changes, which is often the question.
        reach = float(np.nanmax(np.abs(field)))
        limits = {"cmap": "RdBu_r", "vmin": -reach, "vmax": reach}
    mesh = ax.pcolormesh(x, y, field, shading="nearest", rasterized=True, **limits)
    if missing.any():
        hatched = np.zeros(field.shape)
        hatched[up, across] = missing
        # Contours follow the edges of the cells where each cell has the same value at both.
        corners = np.asarray(mesh.get_coordinates())
        edges = [np.repeat(line, 2)[1:-1] for line in (corners[0, :, 0], corners[:, 0, 1])]
        whole = hatched.repeat(2, axis=0).repeat(2, axis=1)
        ax.contourf(*edges, whole, levels=[0.5, 1.5], colors="none", hatches=[MISSING], zorder=3.0)
        ax.contour(*edges, whole, levels=[0.5], colors=[style.INK], linewidths=0.6, zorder=3.0)
        never = Patch(facecolor="none", edgecolor=style.INK, hatch=MISSING)
        ax.legend(
            [never], ["never meets the plate"], loc="lower right", bbox_to_anchor=(1.0, 1.0),
            frameon=False, fontsize=style.SMALL, borderaxespad=0.2,
        )  # fmt: skip
    return mesh


METHOD_COLOURS = (ORANGE, GREEN, VERMILION, PURPLE, GREY)
"""Colours of the methods of discharge, in their order."""

METHOD_LINES = ("-", (0, (5.0, 1.5)), "-.", (0, (1.5, 1.0)), (0, (7.0, 1.5, 1.5, 1.5)))
"""Their lines, for readers without colours."""


HEIGHTS_OF_BAND = 80
"""Heights at which the simulated stream is cut for the picture."""


def discharge_figure(found: SideBySide) -> Picture:
    """Draw the stream by engineers' methods over the simulated one."""
    figure = Picture((9.6, 7.2))
    ax = figure.add_axes((0.08, 0.08, 0.89, 0.74))
    style.dress(ax, "x, m", "y, m")
    known = np.concatenate([rows.ravel() for rows in found.lines.values()])
    circles = [path.radius for one in found.methods.values() for path in one.paths]
    lowest, top = float(found.heights.min()), max(circles, default=0.0)
    right = float(np.nanmax(known, initial=top))
    corners = np.array([[-1.2 * top, 1.3 * top + 0.03], [1.03 * right, lowest]])
    draw_scene(ax, found.recording.machine, around(corners))
    # Below the place where the first part leaves, the whole stream has left the belt.
    first = min(
        (path.at([0.0])[0, 1] for one in found.methods.values() for path in one.paths), default=top
    )
    heights = np.linspace(first, lowest, HEIGHTS_OF_BAND)
    sides = [
        np.stack([x, heights], axis=-1)[np.isfinite(x)] for x in stream_at(found.recording, heights)
    ]
    ax.fill(
        *np.concatenate([sides[0], sides[2][::-1]]).T, color=style.STREAM, alpha=0.45, lw=0.0,
        zorder=3.0, gid="simulated", label="simulated, 2 to 98 %",
    )  # fmt: skip
    ax.plot(*sides[1].T, color=style.TRACK, lw=1.2, zorder=3.5)
    looks: dict[str, Any] = dict(
        zip(NAMES, zip(METHOD_COLOURS, METHOD_LINES, strict=True), strict=True)
    )
    for name, one in found.methods.items():
        colour, line = looks[name]
        label = NAMES[name]
        for path in one.paths:
            fall = 1.1 * (path.radius - lowest)
            last = (path.speed + np.sqrt(path.speed**2 + 2.0 * path.gravity * fall)) / path.gravity
            places = path.at(np.linspace(0.0, last, 200))
            ax.plot(*places.T, color=colour, ls=line, lw=1.5, zorder=5.0, gid=name, label=label)
            label = ""
    style.legend_above(ax, 4)
    figure.headline(0.04, 0.955, found.scene.title)
    said = [f"{name}: {why}" for name, why in found.refused.items()]
    figure.remark(0.04, 0.92, shorten("; ".join(said), 110, placeholder=" …"), va="center")
    return figure


WIDTH, PANEL = 8.5, 3.6
"""Width of the figure and height of the panel, inches."""

LINE, HEAD, FOOT = 0.19, 0.5, 0.9
"""Height of a line of text, over the panel and under it, inches."""

LEFT, RIGHT = 0.9, 2.1
"""Room left of the panel, and right of it for the legend, inches."""

CHARACTERS = 105
"""Characters of small text that fit into a line."""

LOOKS: dict[str, dict[str, Any]] = {
    "fixed": {"color": ORANGE, "marker": "s", "markersize": 9.0},
    "pymunk": {"color": GREEN, "marker": "o", "markersize": 6.5},
    "contact": {"color": SKY, "marker": "P", "markersize": 8.0},
    "exact": {"color": BLUE, "marker": "*", "markersize": 15.0},
}
"""Colour and marker of each method, so that colour is not needed. In the order of drawing: of two
at one place, the upper is the smaller."""

TITLES = {"pymunk": "pymunk, aligned", "fixed": "pymunk, fixed step"}


def workprecision(timings: Sequence[Timing], title: str, about: Mapping[str, str]) -> Picture:
    """Draw run time against error, and below it what failed and what it ran on (`about`).

    Each method is a line; left is more accurate, down is faster.
    """
    below = failures(timings, CHARACTERS)
    said = [f"{key} {value}" if key in PACKAGES else value for key, value in about.items()]
    below += wrap(" · ".join(said), CHARACTERS)
    height = HEAD + PANEL + FOOT + LINE * len(below)
    figure = Picture((WIDTH, height))
    width = WIDTH - LEFT - RIGHT
    box = (LEFT / WIDTH, 1.0 - (HEAD + PANEL) / height, width / WIDTH, PANEL / height)
    ax = style.dress(figure.add_axes(box), "relative error", "run time, s", title)
    ax.set(xscale="log", yscale="log")
    drawn: list[tuple[float, float]] = []
    for method, look in LOOKS.items():
        xy = [
            (one.error, one.median)
            for one in timings
            if one.method == method and one.error is not None and one.median is not None
        ]
        if xy:
            ax.plot(
                *zip(*xy, strict=True), **look, linewidth=1.8, markeredgecolor="white",
                markeredgewidth=0.8, gid=method, label=TITLES.get(method, method),
            )  # fmt: skip
        drawn += xy
    decades(ax.xaxis, [error for error, _ in drawn], 7)
    decades(ax.yaxis, [time for _, time in drawn], 6)
    if drawn:
        ax.legend(
            loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=style.SMALL, frameon=False,
        )  # fmt: skip
    top = (0.2 + LINE * len(below)) / height
    figure.remark(0.2 / WIDTH, top, "\n".join(below), fontsize=style.SMALL, gid="below")
    return figure


def decades(
    axis: Axis, values: Sequence[float], ticks: int, limits: tuple[float, float] | None = None
) -> None:
    """Set limits a bit around values, with powers of ten as ticks, at most so many."""
    axis.set_minor_locator(NullLocator())
    if not values:
        axis.set_ticks([])
        return
    low, high = (log10(end) for end in limits or (min(values), max(values)))
    if limits is None:
        room = max(0.08 * (high - low), 0.3)
        low, high = low - room, high + room
    first, last = ceil(low), floor(high)
    if last <= first:  # a single power of ten does not show the scale
        low = first = floor(low)
        last = first + 1
        high = max(high, last)
    step = ceil((last - first + 1) / ticks)
    axis.set_view_interval(10.0**low, 10.0**high, ignore=True)
    axis.set_major_locator(FixedLocator([10.0**k for k in range(last, first - 1, -step)]))

    def written(value: float, _: object) -> str:
        power = round(log10(value))
        return f"{10.0**power:g}" if -3 <= power <= 3 else f"$10^{{{power}}}$"

    axis.set_major_formatter(FuncFormatter(written))


def failures(timings: Sequence[Timing], width: int) -> list[str]:
    """List failures in lines of at most `width` characters: steps and reasons."""
    lines = []
    for method in METHODS:
        failed = [one for one in timings if one.method == method and one.failed]
        for why in dict.fromkeys(one.failed for one in failed):
            steps = [f"{one.value:.2g}" for one in failed if one.failed == why and one.value]
            at = f" at dt {', '.join(steps)}" if steps else ""
            line = f"✕ {TITLES.get(method, method)}{at}: {why}"
            lines += wrap(line, width, subsequent_indent="    ")
    return lines
