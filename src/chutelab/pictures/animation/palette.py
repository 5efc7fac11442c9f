"""The palette of every film, and text that changes with every frame.

The palette is fixed, so that no colour can flicker, and small, so that files are. It holds white,
the greys and the colours of `chutelab.pictures.plots.style` unmixed, and the mixtures at which
anti-aliased edges between them are read as smooth. Every other colour is shown as the nearest of
these. Text is set from characters that are drawn once.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations
from math import ceil
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from numpy.typing import NDArray

from chutelab.pictures.plots import style
from chutelab.util.arrays import Floats

Pixels = NDArray[np.uint32]

BITS = 6
"""Of an index; few codes make a small file."""

CLEAR = 2**BITS - 1
"""The index of what stays as it was in the frame before: no colour."""

GREYS = (style.MUTED, style.STEEL, style.STEEL_LIGHT, style.GRID, style.ENERGY["start"])
HUES = (
    style.TRACK,
    style.ANALYTIC,
    style.BELT,
    style.STRIKE,
    style.STREAM,
    style.ENERGY["friction_loss"],
)

OPAQUE = np.uint32(0xFFFFFF)
"""Masks the colour in a pixel."""


def tint(colour: str, share: float, ground: str = "#FFFFFF") -> str:
    """Return a colour mixed with a ground.

    >>> tint("#0072B2", 0.5), tint("#000000", 0.25)
    ('#80B8D8', '#BFBFBF')
    """
    above, below = _rgb(colour), _rgb(ground)
    mixed = np.rint(share * above + (1.0 - share) * below).astype(int)
    return "#{:02X}{:02X}{:02X}".format(*mixed)


def _rgb(colour: str) -> Floats:
    return np.array(list(bytes.fromhex(colour.removeprefix("#"))), dtype=np.float64)


def colours() -> tuple[str, ...]:
    """Return the palette, the most important colours first, `CLEAR` not counted."""
    pure = ("#FFFFFF", "#000000", *GREYS, *HUES)
    edges = [tint(hue, share) for share in (0.5, 0.75, 0.25) for hue in HUES]
    meeting = [tint(one, 0.5, other) for one, other in combinations(HUES, 2)]
    meeting += [tint(hue, 0.6, "#000000") for hue in HUES]
    return tuple(dict.fromkeys([*pure, *edges, *meeting]))[:CLEAR]


class Palette:
    """Looks pixels up among `colours`; each colour it meets is compared with them only once."""

    def __init__(self) -> None:
        self.table = np.array([_rgb(colour) for colour in colours()], dtype=np.int64)
        # The system gives memory only to the pages that are used.
        self._met = np.zeros(1 << 24, dtype=np.uint8)

    def bytes(self) -> bytes:
        """Return all 2**`BITS` colours, three bytes each."""
        full = np.zeros((CLEAR + 1, 3), dtype=np.uint8)
        full[: len(self.table)] = self.table
        return full.tobytes()

    def indices(self, pixels: Pixels) -> NDArray[np.uint8]:
        """Return the index of the nearest colour for pixels (P,), red in the lowest byte."""
        keys = pixels & OPAQUE
        # Kept one higher: zero is what no colour has been entered for.
        found = self._met[keys]
        new = found == 0
        if new.any():
            strangers = np.unique(keys[new])
            rgb = strangers.astype("<u4").view(np.uint8).reshape(-1, 4)[:, :3].astype(np.int64)
            apart = ((rgb[:, None] - self.table) ** 2).sum(axis=2)
            self._met[strangers] = apart.argmin(axis=1) + 1
            found = self._met[keys]
        return np.asarray(found - np.uint8(1))


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
