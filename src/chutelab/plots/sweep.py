"""Pictures of sweeps: lines over one varied key, a heat map over two, dots for samples."""

from __future__ import annotations

from collections import Counter
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from chutelab.plots import style
from chutelab.plots.picture import DPI, Picture
from chutelab.scene.units import with_unit
from chutelab.sweep.columns import NUMBERS, REASON

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from chutelab.sweep import Sweep

    Floats = NDArray[np.float64]

SIZE = (8.6, 5.4)
"""Width and height of the figure, inches."""

MOST_LINES = 8
"""Values of a second key up to which each has a line; more make a heat map."""

DOTS = 60
"""Values up to which a line shows where they are."""

COLORS = "viridis"
"""From dark to light with growing values, also for colour-blind readers and in print."""

LIGHTEST = 0.88
"""Share of the colours that is used for lines: what follows is too light on white."""


def sweep_figure(swept: Sweep, column: str, *, path: str | Path | None = None) -> Figure:
    """Draw one column of a sweep over its varied keys.

    Parameters
    ----------
    swept : Sweep
        With one or two keys of more than one value.
    column : str
        Name of a column of numbers.
    path : path, optional
        Also write the figure there, whole or not at all; the suffix says the format.

    Raises
    ------
    ValueError
        If more than two keys vary, or there is no such column.
    """
    if column not in NUMBERS:
        raise ValueError(f"{column}: one of {', '.join(NUMBERS)}")
    figure = Picture(figsize=SIZE, dpi=DPI)
    ax = figure.add_subplot()
    axes = varied(swept)
    if swept.shape is None:
        draw_samples(ax, swept, column)
    elif len(axes) == 2 and min(len(np.unique(swept.columns[key])) for key in axes) > MOST_LINES:
        draw_heat(ax, swept, column)
    else:
        draw_lines(ax, swept, column)
    figure.subplots_adjust(left=0.115, right=0.97, top=0.86, bottom=0.18)
    figure.headline(0.03, 0.955, swept.title)
    figure.text(
        0.03, 0.03, _missing(swept, column), fontsize=style.SMALL, color=style.MUTED, va="center"
    )
    figure.write(path)
    return figure


def varied(swept: Sweep) -> list[str]:
    """Return the keys that have more than one value; the first key if none has.

    Raises
    ------
    ValueError
        If more than two have.
    """
    keys = [key for key in swept.quantities if len(np.unique(swept.columns[key])) > 1]
    if len(keys) > 2:
        raise ValueError(f"a picture shows one or two varied keys, not {len(keys)}")
    return keys or list(swept.quantities)[:1]


def draw_lines(ax: Axes, swept: Sweep, column: str) -> Axes:
    """Draw a line over the key with the most values, one for each value of the other key."""
    keys = sorted(varied(swept), key=lambda key: -len(np.unique(swept.columns[key])))
    scale, label = _axis(swept, column)
    x, y = swept.columns[keys[0]], swept.columns[column] * scale
    others = swept.columns[keys[1]] if len(keys) > 1 else np.zeros(len(x))
    values = np.unique(others)
    shades = mpl.colormaps[COLORS](np.linspace(0.0, LIGHTEST, len(values)))
    for value, shade in zip(values.tolist(), shades, strict=True):
        mine = np.flatnonzero(others == value)
        mine = mine[np.argsort(x[mine], kind="stable")]
        ax.plot(
            x[mine], y[mine], color=shade if len(values) > 1 else style.TRACK, linewidth=1.8,
            marker="o" if len(mine) <= DOTS else "", markersize=4.0, label=f"{value:g}",
        )  # fmt: skip
    _span(ax, x)
    style.dress(ax, _label(swept, keys[0]), label)
    if len(values) > 1:
        ax.legend(
            title=_label(swept, keys[1]), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=8,
            frameon=False, fontsize=style.SMALL, title_fontsize=style.SMALL, columnspacing=1.2,
            handlelength=1.4, borderaxespad=0.2, alignment="right",
        )  # fmt: skip
    return ax


def draw_heat(ax: Axes, swept: Sweep, column: str) -> Axes:
    """Draw a heat map over two keys; grey where there is nothing to tell."""
    first, second = varied(swept)
    (x, across), (y, up) = (
        np.unique(swept.columns[key], return_inverse=True) for key in (first, second)
    )
    scale, label = _axis(swept, column)
    field = np.full((len(y), len(x)), np.nan)
    field[up, across] = swept.columns[column] * scale
    ax.set_facecolor(style.STEEL_LIGHT)
    diverges = np.nanmin(field, initial=0.0) < 0.0 < np.nanmax(field, initial=0.0)
    reach = float(np.nanmax(np.abs(field), initial=0.0))
    limits: dict[str, Any] = {"cmap": COLORS}
    if diverges:
        # White where the sign changes: that is often what is looked for.
        limits = {"cmap": "RdBu_r", "vmin": -reach, "vmax": reach}
    mesh = ax.pcolormesh(_edges(x), _edges(y), field, rasterized=True, **limits)
    style.dress(ax, _label(swept, first), _label(swept, second))
    ax.grid(visible=False)
    if np.isfinite(field).any():
        _bar(ax, mesh, label)
    return ax


def draw_samples(ax: Axes, swept: Sweep, column: str) -> Axes:
    """Draw a dot for each sample, over one key, or over two with its value as the colour."""
    keys = varied(swept)
    scale, label = _axis(swept, column)
    z = swept.columns[column] * scale
    if len(keys) == 1:
        ax.plot(swept.columns[keys[0]], z, "o", markersize=3.5, color=style.TRACK, alpha=0.7)
        _span(ax, swept.columns[keys[0]])
        return style.dress(ax, _label(swept, keys[0]), label)
    x, y = (swept.columns[key] for key in keys)
    known = np.isfinite(z)
    ax.plot(x[~known], y[~known], "x", markersize=4.0, color=style.STEEL)
    dots = ax.scatter(x[known], y[known], c=z[known], cmap=COLORS, s=16.0)
    style.dress(ax, _label(swept, keys[0]), _label(swept, keys[1]))
    if known.any():
        _bar(ax, dots, label)
    return ax


def _span(ax: Axes, x: Floats) -> None:
    """Show the whole range, also where there are no rows."""
    low, high = float(x.min()), float(x.max())
    if low < high:
        margin = 0.03 * (high - low)
        ax.set_xlim(low - margin, high + margin)


def _bar(ax: Axes, painted: Any, label: str) -> None:
    """Add the scale of colours."""
    bar = ax.figure.colorbar(painted, ax=ax, pad=0.02)
    bar.set_label(label, fontsize=style.NORMAL)
    bar.ax.tick_params(labelsize=style.SMALL)


def _label(swept: Sweep, key: str) -> str:
    return with_unit(key, swept.unit(key))


def _axis(swept: Sweep, column: str) -> tuple[float, str]:
    """Return the factor that makes a column easy to read, and its label."""
    what, unit = NUMBERS[column][0].split(",")[0], swept.unit(column)
    what = what if what.startswith(("x ", "y ")) else what[0].upper() + what[1:]
    if column.endswith("_spread"):
        what = f"Standard deviation of {column.removesuffix('_spread')}"
    values = swept.columns[column]
    known = np.abs(values[np.isfinite(values)])
    if not unit or not len(known):
        return 1.0, what
    factor, name = style.scaled(float(known.max()), unit)
    return factor, f"{what}, {name}"


def _edges(values: Floats) -> Floats:
    """Return the borders between values, and beyond the first and the last one."""
    middle = 0.5 * (values[1:] + values[:-1])
    return np.concatenate(
        [[values[0] - (middle[0] - values[0])], middle, [values[-1] + (values[-1] - middle[-1])]]
    )


def _missing(swept: Sweep, column: str) -> str:
    """Say how many variants are not in the picture, and the commonest reason."""
    gone = np.flatnonzero(~np.isfinite(swept.columns[column]))
    if not len(gone):
        return ""
    reasons = Counter(reason for reason in swept.columns[REASON][gone].tolist() if reason)
    why = "".join(f", most: {reason}" for reason, _ in reasons.most_common(1))
    return shorten(f"{len(gone):,} of {len(swept):,} have none{why}", 118, placeholder=" …")
