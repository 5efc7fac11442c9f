"""Text that changes with every frame: characters drawn once, then set side by side.

Each character is as wide as it is in a number, in whole pixels, so that a digit that comes back is
the same pixels again: quick to set, and small in the file.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties

if TYPE_CHECKING:
    from chutelab.animate.palette import Pixels

CHARACTERS = "0123456789.−e =tsJ"
"""What the clock and the figures are written with."""

ROOM = 4
"""Pixels between characters while they are drawn, so that none reaches into its neighbour."""


def canvas_of(figure: Figure) -> Any:
    """Return a canvas of Agg for a figure; its drawing methods are not annotated."""
    return FigureCanvasAgg(figure)


def pixels_of(canvas: Any) -> Pixels:
    """Return what a canvas shows, (height, width), red in the lowest byte; not a copy."""
    shown = np.asarray(canvas.buffer_rgba())
    return shown.view("<u4")[..., 0]


class Lettering:
    """One size of text, black on white.

    Parameters
    ----------
    size : float
        pt.
    dpi : float
        Pixels to the inch.
    """

    def __init__(self, size: float, dpi: float) -> None:
        font = FontProperties(size=size)
        figure = Figure(dpi=dpi)
        canvas = canvas_of(figure)
        measured = canvas.get_renderer().get_text_width_height_descent

        def wide(text: str) -> float:
            return float(measured(text, font, False)[0])

        pair = wide("00")
        self.widths = {one: round(wide(f"0{one}0") - pair) for one in CHARACTERS}
        self.ascent = ceil(1.05 * size * dpi / 72.0)
        self.height = self.ascent + ceil(0.35 * size * dpi / 72.0)
        starts = np.cumsum([ROOM, *(width + 2 * ROOM for width in self.widths.values())])
        # A hundredth of a pixel more: the canvas rounds down.
        figure.set_size_inches((starts[-1] + 0.01) / dpi, (self.height + 0.01) / dpi)
        base = 1.0 - self.ascent / self.height
        for one, start in zip(CHARACTERS, starts, strict=False):
            figure.text(start / starts[-1], base, one, fontproperties=font, va="baseline")
        canvas.draw()
        shown = pixels_of(canvas)
        self.tiles = {
            one: shown[:, start : start + self.widths[one]].copy()
            for one, start in zip(CHARACTERS, starts, strict=False)
        }
        self.strip = lru_cache(maxsize=512)(self._strip)

    def _strip(self, text: str) -> Pixels:
        """Return the picture of a text of `CHARACTERS`, (height, width)."""
        return np.hstack([self.tiles[one] for one in text])


class Label:
    """A text at a place in the picture that ends at a fixed column.

    Parameters
    ----------
    lettering : Lettering
        How it is written.
    right, base : float
        Where it ends, and the line it stands on; pixels from the left and the top.
    """

    def __init__(self, lettering: Lettering, right: float, base: float) -> None:
        self.lettering = lettering
        self.right = round(right)
        self.top = round(base) - lettering.ascent
        self.text = ""

    def paint(self, pixels: Pixels) -> None:
        """Write the text onto a picture, (height, width), whose ground is white there."""
        if self.text:
            strip = self.lettering.strip(self.text)
            rows = slice(self.top, self.top + len(strip))
            pixels[rows, self.right - strip.shape[1] : self.right] = strip
