"""Pictures of measurements: run time against error, and time and memory against particles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from textwrap import wrap
from typing import Any

import matplotlib.patheffects as pe
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from chutelab.pictures import PURPLE, VERMILION
from chutelab.pictures.plots import style
from chutelab.pictures.plots.studies import LOOKS as ENGINES
from chutelab.pictures.plots.studies import decades
from chutelab.pictures.plots.style import Picture
from workprecision import METHODS, Record, Size, cases
from workprecision.claims import exponent, points, work_slope

WIDTH, PANEL = 10.0, 2.35
"""Width of a figure and height of a panel, inches."""

TITLE, LABEL, LINE, FOOT = 0.42, 0.62, 0.19, 0.42
"""Height over a panel, under it, of a line of text below that, and of the foot, inches."""

LEFT, GAP, RIGHT = 0.8, 0.85, 0.2
"""Room left of panels, between them and right of them, inches."""

CHARACTERS = 14.0
"""Characters of small text that go into an inch."""

ERRORS = 1e-17, 0.2
"""Where the axes of relative errors end, the same for all cases."""

LEAST = 1e-16
"""Errors are drawn no smaller: that is the last digit of a double."""

LOOKS: dict[str, dict[str, Any]] = {
    "plain": {"color": VERMILION, "marker": "^", "markersize": 8.0},
    "dop853": {"color": PURPLE, "marker": "D", "markersize": 6.5},
    "fixed": ENGINES["fixed"],
    "aligned": ENGINES["pymunk"],
    "contact": ENGINES["contact"],
    "exact": ENGINES["exact"],
}
"""Colour and marker of each method, in the order of drawing."""

HALO = [pe.withStroke(linewidth=3.0, foreground="white")]

STEEP = 0.5
"""Slope from which on a line leaves room beside it rather than under it."""

MEMORY = 1e6
"""Bytes in a megabyte."""


def workprecision(records: Sequence[Record], about: Mapping[str, str]) -> Picture:
    """Draw run time against error, a panel for each case.

    Parameters
    ----------
    records : sequence of Record
        From `workprecision.measure`; rows of other cases are left out.
    about : mapping
        The machine and the versions, from `chutelab.checks.workprecision`.
    """
    shown = [case for case in cases().values() if any(one.case == case.name for one in records)]
    columns = min(3, len(shown) + 1)
    rows = {case.name: [one for one in records if one.case == case.name] for case in shown}
    width = round(CHARACTERS * (_width(columns) + 0.7 * GAP))
    failed = [_failures(rows[case.name], width) for case in shown]
    figure, cells = _page([*map(len, failed), 0], columns, about)
    for ax, case, lines in zip(cells, shown, failed, strict=False):
        crowd = case.reference is None
        what = "overlap of particles, radii" if crowd else "relative error"
        style.dress(ax, what, "run time, s", case.title)
        draw_case(ax, rows[case.name], case.name, None if crowd else ERRORS)
        ax.text(
            0.0, -LABEL / PANEL, "\n".join(lines), transform=ax.transAxes, fontsize=style.SMALL,
            color=style.MUTED, verticalalignment="top", gid="failed",
        )  # fmt: skip
    used = [name for name in METHODS if any(one.method == name for one in records)]
    _explain(cells[-1], used)
    return figure


def draw_case(
    ax: Axes, records: Sequence[Record], case: str, errors: tuple[float, float] | None = None
) -> Axes:
    """Draw the rows of one case, a line for each method, with its slope.

    The axis of errors ends where it is said, or around the errors.
    """
    ax.set(xscale="log", yscale="log")
    for method, look in LOOKS.items():
        xy = points(records, case, method)
        if not xy:
            continue
        xy.sort(key=lambda point: point[1])
        x, y = [max(e, LEAST) for e, _ in xy], [t for _, t in xy]
        ax.plot(
            x, y, **look, linewidth=1.8, markeredgecolor="white", markeredgewidth=0.8, gid=method,
            zorder=5.0 if method == "exact" else 3.0,
        )  # fmt: skip
        power = work_slope(records, case, method)
        if power is not None:
            _mark(ax, power, x, y, method)
    drawn = [point for method in LOOKS for point in points(records, case, method)]
    decades(ax.xaxis, [max(e, LEAST) for e, _ in drawn], 5, errors)
    decades(ax.yaxis, [t for _, t in drawn], 5)
    return ax


def scaling(sizes: Sequence[Size], about: Mapping[str, str]) -> Picture:
    """Draw time and memory against the number of particles, a row for each case.

    Parameters are those of `workprecision`, the rows those of `measure`.
    """
    shown = [case for case in cases().values() if any(one.case == case.name for one in sizes)]
    figure, cells = _page([0] * (2 * len(shown)), 2, about)
    for row, case in enumerate(shown):
        kind = "Independent" if case.name == "independent" else "Interacting"
        for ax, what, unit in (
            (cells[2 * row], "median", "run time, s"),
            (cells[2 * row + 1], "memory", "peak memory, MB"),
        ):
            style.dress(ax, "particles", unit, f"{kind} particles: {unit.partition(',')[0]}")
            draw_sizes(ax, [one for one in sizes if one.case == case.name], case.name, what)
    return figure


def draw_sizes(ax: Axes, sizes: Sequence[Size], case: str, what: str) -> Axes:
    """Draw one quantity (``"median"`` or ``"memory"``) against particles, with its exponent."""
    ax.set(xscale="log", yscale="log")
    per = MEMORY if what == "memory" else 1.0
    drawn: list[tuple[float, float]] = []
    for method, look in LOOKS.items():
        xy = sorted(
            (one.particles, getattr(one, what) / per)
            for one in sizes
            if one.method == method and getattr(one, what) is not None
        )
        if not xy:
            continue
        drawn += xy
        power = exponent(sizes, case, method, what)
        label = METHODS[method].title + ("" if power is None else f", ∝ N$^{{{power:.2f}}}$")
        ax.plot(
            *zip(*xy, strict=True), **look, linewidth=1.8, markeredgecolor="white",
            markeredgewidth=0.8, gid=method, label=label,
        )  # fmt: skip
    decades(ax.xaxis, [x for x, _ in drawn], 7)
    decades(ax.yaxis, [y for _, y in drawn], 6)
    if drawn:
        ax.legend(loc="upper left", fontsize=style.SMALL, frameon=False, borderaxespad=0.2)
    return ax


def _mark(ax: Axes, power: float, x: Sequence[float], y: Sequence[float], method: str) -> None:
    """Write a slope beside the upper end of a steep line, under the middle of a flat one."""
    k = len(x) // 2
    where = x[-1], y[-1]
    if abs(power) < STEEP:
        where = sqrt(x[k - 1] * x[k]), sqrt(y[k - 1] * y[k])
    text = f"{round(power, 1) + 0.0:.1f}"  # no -0
    right = method == "fixed"
    ax.annotate(
        text.replace("-", "−"), where, xytext=(8.0, 3.0) if right else (-8.0, -3.0),
        textcoords="offset points", fontsize=style.SMALL, color=LOOKS[method]["color"],
        horizontalalignment="left" if right else "right",
        verticalalignment="bottom" if right else "top",
        fontweight="bold", path_effects=HALO, zorder=6.0, gid=f"slope {method}",
    )  # fmt: skip


def _failures(records: Sequence[Record], width: int) -> list[str]:
    """Name what failed, a line for each method: why, if it always did, or with which parameter."""
    lines = []
    for name, method in METHODS.items():
        mine = [one for one in records if one.method == name]
        failed = [one for one in mine if one.failed]
        if not failed:
            continue
        if len(failed) == len(mine):
            how = f": {failed[0].failed.partition(', in')[0]}"
        else:
            values = ", ".join(f"{one.value:.2g}" for one in failed)
            how = f": {failed[0].parameter} {values}"
        lines += wrap(f"✕ {method.title}{how}", width, subsequent_indent="    ")
    return lines


def _width(columns: int) -> float:
    """Return the width of a panel, inches."""
    return (WIDTH - LEFT - RIGHT - (columns - 1) * GAP) / columns


def _page(
    lines: Sequence[int], columns: int, about: Mapping[str, str]
) -> tuple[Picture, list[Axes]]:
    """Return a figure with axes that have so many lines of text under them, and its foot."""
    below = [max(lines[k : k + columns]) for k in range(0, len(lines), columns)]
    heights = [TITLE + PANEL + LABEL + LINE * count for count in below]
    height = sum(heights) + FOOT
    figure = Picture((WIDTH, height))
    width = _width(columns)
    cells = []
    for k in range(len(lines)):
        row, column = divmod(k, columns)
        left, top = LEFT + column * (width + GAP), height - sum(heights[:row]) - TITLE
        box = (left / WIDTH, (top - PANEL) / height, width / WIDTH, PANEL / height)
        cells.append(figure.add_axes(box))
    said = [about[key] for key in ("processor", "python") if key in about]
    said += [f"{key} {about[key]}" for key in about if key not in ("processor", "system", "python")]
    figure.text(
        LEFT / WIDTH, 0.5 * FOOT / height, " · ".join(said), fontsize=style.SMALL,
        color=style.MUTED, verticalalignment="center", gid="environment",
    )  # fmt: skip
    return figure, cells


def _explain(ax: Axes, used: Sequence[str]) -> None:
    """Turn a cell into the legend and how to read the panels."""
    ax.set_axis_off()
    handles = [
        Line2D([], [], **LOOKS[name], linewidth=1.8, markeredgecolor="white", label=method.title)
        for name, method in METHODS.items()
        if name in used
    ]
    ax.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(-0.05, 1.05), fontsize=style.NORMAL,
        frameon=False, borderaxespad=0.0, handlelength=2.4, labelspacing=0.55,
    )  # fmt: skip
    ax.text(
        -0.02, 0.40,
        "Left is more accurate, down is faster.\n"
        "Numbers at lines are slopes: with −1,\nten times the accuracy costs\nten times the time.\n"
        "✕ is what failed.",
        transform=ax.transAxes, fontsize=style.SMALL, color=style.MUTED, verticalalignment="top",
        linespacing=1.35,
    )  # fmt: skip
