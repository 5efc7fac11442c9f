"""Run time against error of one scene: a point for each run, a line for each engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, floor, log10
from textwrap import wrap
from typing import Any

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from chutelab.checks.workprecision import METHODS, Timing
from chutelab.pictures import BLUE, GREEN, ORANGE, SKY
from chutelab.pictures.plots import style
from chutelab.pictures.plots.style import Picture
from chutelab.util.versions import PACKAGES

WIDTH, PANEL = 8.5, 3.6
"""Width of the figure and height of the panel, inches."""

LINE, HEAD, FOOT = 0.19, 0.5, 0.9
"""Height of a line of text, over the panel and under it, inches."""

LEFT, RIGHT = 0.9, 2.1
"""Room left of the panel, and right of it for the legend, inches."""

CHARACTERS = 105
"""Characters of small text that go into a line."""

LOOKS: dict[str, dict[str, Any]] = {
    "fixed": {"color": ORANGE, "marker": "s", "markersize": 9.0},
    "pymunk": {"color": GREEN, "marker": "o", "markersize": 6.5},
    "contact": {"color": SKY, "marker": "P", "markersize": 8.0},
    "exact": {"color": BLUE, "marker": "*", "markersize": 15.0},
}
"""Colour and marker of each method: two signs, for readers who tell colours apart
badly. In the order of drawing: of two at one place, the upper is the smaller."""

TITLES = {"pymunk": "pymunk, aligned", "fixed": "pymunk, fixed step"}


def workprecision(timings: Sequence[Timing], title: str, about: Mapping[str, str]) -> Picture:
    """Draw run time against error, and below it what failed and what it ran on (`about`)."""
    below = failures(timings, CHARACTERS)
    said = [f"{key} {value}" if key in PACKAGES else value for key, value in about.items()]
    below += wrap(" · ".join(said), CHARACTERS)
    height = HEAD + PANEL + FOOT + LINE * len(below)
    figure = Picture((WIDTH, height))
    width = WIDTH - LEFT - RIGHT
    box = (LEFT / WIDTH, 1.0 - (HEAD + PANEL) / height, width / WIDTH, PANEL / height)
    ax = style.dress(figure.add_axes(box), "relative error", "run time, s", title)
    draw_timings(ax, timings)
    top = (0.2 + LINE * len(below)) / height
    figure.remark(0.2 / WIDTH, top, "\n".join(below), fontsize=style.SMALL, gid="below")
    return figure


def draw_timings(ax: Axes, timings: Sequence[Timing]) -> Axes:
    """Draw a line for each method; left is more accurate, down is faster."""
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
    return ax


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
    if last <= first:  # one power of ten alone tells nothing of the scale
        low = first = floor(low)
        last = first + 1
        high = max(high, last)
    step = ceil((last - first + 1) / ticks)
    axis.set_view_interval(10.0**low, 10.0**high, ignore=True)
    axis.set_major_locator(FixedLocator([10.0**k for k in range(last, first - 1, -step)]))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _power(value)))


def _power(value: float) -> str:
    """Return a power of ten; those near 1 in full.

    >>> _power(0.001), _power(1e-05), _power(1000.0)
    ('0.001', '$10^{-5}$', '1000')
    """
    power = round(log10(value))
    return f"{10.0**power:g}" if -3 <= power <= 3 else f"$10^{{{power}}}$"


def failures(timings: Sequence[Timing], width: int) -> list[str]:
    """Name what failed, in lines of at most `width` characters: with which steps, and why."""
    lines = []
    for method in METHODS:
        failed = [one for one in timings if one.method == method and one.failed]
        for why in dict.fromkeys(one.failed for one in failed):
            steps = [f"{one.value:.2g}" for one in failed if one.failed == why and one.value]
            at = f" at dt {', '.join(steps)}" if steps else ""
            line = f"✕ {TITLES.get(method, method)}{at}: {why}"
            lines += wrap(line, width, subsequent_indent="    ")
    return lines
