"""A still for print: the scene with particle 0 at round times, like a stroboscopic photograph."""

from __future__ import annotations

from math import floor, log10
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from chutelab.pictures.plots import style
from chutelab.pictures.plots.figure import draw_view
from chutelab.pictures.plots.machinery import HALO
from chutelab.pictures.plots.panels import analytic_of
from chutelab.pictures.plots.scenery import nominal, strobe_step, strobe_times
from chutelab.pictures.plots.style import Picture
from chutelab.results import Recording
from chutelab.theory import Transfer

SIZE = (9.0, 5.6)
"""Width and height of the figure, inches."""

DPI = 300

AWAY = 9.0
"""pt from the middle of a dot to the text beside it."""

GAP = 1.5
"""pt that stay free around such a text."""

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
    figure = Picture(SIZE, DPI)
    ax = figure.add_axes((0.095, 0.09, 0.885, 0.77))
    draw_view(ax, recording, analytic_of(recording, prediction)[0])
    draw_times(ax, recording)
    figure.headline(0.095, 0.955, recording.title, 70)
    figure.write(path)
    return figure


def draw_times(ax: Axes, recording: Recording) -> Axes:
    """Write the time beside each strobe dot, on the first of `SIDES` where it hides nothing.

    Its own dot must be the nearest of all to its middle, or it would be read as another's. Where no
    side is free there is no time.
    """
    times = strobe_times(recording)
    dots, _ = nominal(recording, times)
    digits = max(0, -floor(log10(strobe_step(recording)) + 1e-9))
    # All in pixels from here on: dots, texts and lines that are drawn already.
    pixels = ax.transData.transform(dots)
    half, gap = np.array([0.4 * AWAY, GAP]) * ax.figure.dpi / 72.0
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
        said = f"{t + 0.0:.{digits}f}".replace("-", "−")
        label = ax.annotate(said, dot, xytext=(0.0, 0.0), textcoords="offset points", gid="time")
        label.set(fontsize=style.SMALL, color=style.TRACK, path_effects=HALO, zorder=8.0)
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
    note = ax.text(1.0, 1.01, "beside the dots: time, s", ha="right", va="bottom")
    note.set(transform=ax.transAxes, fontsize=style.SMALL, color=style.TRACK)
    return ax
