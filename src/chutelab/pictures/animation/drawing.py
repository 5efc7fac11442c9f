"""Draw the moving parts of a film, and return the regions of the picture that may have changed.

Most pixels of a frame are those of the frame before. Matplotlib does much work for each artist that
a frame does not need, such as laying out a changed text. So lines, dots, arrows, bars and texts are
drawn here, in a fraction of the time and with the same pixels. Matplotlib draws all other artists.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from math import ceil, floor
from typing import Any, cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import GraphicsContextBase
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.lines import Line2D
from matplotlib.markers import MarkerStyle
from matplotlib.path import Path
from matplotlib.transforms import Affine2D
from PIL import Image, ImageDraw, ImageFont

from chutelab.pictures.plots import style
from chutelab.util.arrays import Floats

Part = tuple[slice, slice]
"""Rows and columns of a picture."""


class Canvas:
    """The pixels of a figure, at first without its animated artists, and renderers for them."""

    def __init__(self, figure: Figure) -> None:
        canvas = cast(Any, figure.canvas)  # its methods are not annotated
        canvas.draw()
        self.renderer = canvas.get_renderer()
        # Pillow writes where Matplotlib has drawn.
        self.rgba = np.asarray(canvas.buffer_rgba())
        size = canvas.get_width_height()
        shared = Image.frombuffer("RGBA", size, self.rgba, "raw", "RGBA", 0, 1)
        shared.readonly = 0
        self.text = ImageDraw.Draw(shared)
        self.pixels = self.rgba.view("<u4")[..., 0]
        self._clean = self.pixels.copy()

    def clear(self, parts: Iterable[Part]) -> None:
        """Restore regions of the picture without animated artists."""
        for part in parts:
            self.pixels[part] = self._clean[part]


class Frame:
    """The rectangle of axes whose limits do not change, and the transform of units to pixels."""

    def __init__(self, ax: Axes) -> None:
        # Agg rounds, and draws on the pixel beyond.
        self.box = np.array([np.floor(ax.bbox.min) - 1.0, np.ceil(ax.bbox.max) + 1.0])
        self.height = round(ax.figure.bbox.height)
        self.to_pixels = cast(Affine2D, ax.transData.get_affine().frozen())

    def parts(self, low: Floats, high: Floats) -> Iterator[Part]:
        """Yield the regions of the picture that boxes on the axes cover.

        `low` and `high` are their corners, (n, 2), pixels from the lower left; NaN is no box.
        """
        low, high = np.maximum(low, self.box[0]), np.minimum(high, self.box[1])
        for (left, bottom), (right, top) in zip(low.tolist(), high.tolist(), strict=True):
            if left < right and bottom < top:
                rows = slice(max(0, self.height - ceil(top)), self.height - floor(bottom))
                yield rows, slice(max(0, floor(left)), ceil(right))


def _context(ax: Axes, width: float, color: Any) -> GraphicsContextBase:
    """Return the drawing style of a path on axes; the width is in pt."""
    found = GraphicsContextBase()
    found.set_clip_rectangle(ax.bbox)
    found.set_linewidth(width)
    found.set_foreground(to_rgba(color), isRGBA=True)
    return found


APART = 32
"""Up to this number, each dot is a region of its own; more dots are one region together."""


class Strokes:
    """Draws a solid line, or dots."""

    def __init__(self, line: Line2D) -> None:
        ax, size = cast(Axes, line.axes), line.get_markersize()
        self.line, self.frame = line, Frame(ax)
        self.dots = line.get_linestyle() == "None"
        points = ax.figure.dpi / 72.0
        if self.dots:
            width, marker = line.get_markeredgewidth(), MarkerStyle(line.get_marker())
            self.context = _context(ax, width, line.get_markeredgecolor())
            self.context.set_joinstyle(marker.get_joinstyle())
            self.context.set_capstyle(marker.get_capstyle())
            self.context.set_snap(False)
            self.marker = (
                marker.get_path(),
                Affine2D(marker.get_transform().get_matrix()).scale(size * points),
            )
            self.face = to_rgba(line.get_markerfacecolor())
        else:
            size, width = 0.0, line.get_linewidth()
            self.context = _context(ax, width, line.get_color())
            self.context.set_joinstyle(line.get_solid_joinstyle())
            self.context.set_capstyle(line.get_solid_capstyle())
        self.room = points * (0.5 * size + width) + 2.0

    def paint(self, canvas: Canvas) -> Iterator[Part]:
        """Draw, and yield the regions that may have changed."""
        places = np.array(self.line.get_data(), dtype=float).T
        if not len(places) or not self.line.get_visible():
            return
        path, to_pixels = Path(places), self.frame.to_pixels
        if self.dots:
            canvas.renderer.draw_markers(self.context, *self.marker, path, to_pixels, self.face)
        else:
            canvas.renderer.draw_path(self.context, path, to_pixels)
        low = high = to_pixels.transform(places)
        if not self.dots or len(places) > APART:
            low, high = np.fmin.reduce(low)[None], np.fmax.reduce(high)[None]
        yield from self.frame.parts(low - self.room, high + self.room)


class Arrows(Artist):
    """Filled arrows from one point each to another, `tails` and `tips`, (n, 2), m.

    Width of the shaft, length and width of the head are in pixels; a short arrow is a small head.
    """

    def __init__(
        self, ax: Axes, colors: list[str], shaft: float, head: tuple[float, float], gid: str
    ) -> None:
        super().__init__()
        ax.add_artist(self)
        self.set(gid=gid, animated=True)
        self.tails = self.tips = np.zeros((len(colors), 2))
        self.frame, self.head = Frame(ax), head[0]
        self.looks = [(_context(ax, 0.0, color), to_rgba(color)) for color in colors]
        # Corners without a shaft, x + iy, and which of them are as far on as the shaft is long.
        half = [0.5j * shaft, 0.5j * shaft, 0.5j * head[1]]
        self.shape = np.array([*half, head[0], *np.conj(half[::-1])])
        self.far = np.array([0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
        self.as_it_is = Affine2D()

    def paint(self, canvas: Canvas) -> Iterator[Part]:
        """Draw, and yield the regions that may have changed."""
        ends = self.frame.to_pixels.transform(np.concatenate([self.tails, self.tips]))
        tails, tips = ends.view(complex).reshape(2, -1)
        for (context, face), tail, way in zip(self.looks, tails, tips - tails, strict=True):
            if (length := abs(way)) > 1e-6:
                shape = min(1.0, length / self.head) * self.shape
                corners = tail + way / length * (shape + max(0.0, length - self.head) * self.far)
                path = Path(corners.view(float).reshape(-1, 2))
                canvas.renderer.draw_path(context, path, self.as_it_is, face)
        room = self.head + 2.0
        yield from self.frame.parts(ends.min(axis=0)[None] - room, ends.max(axis=0)[None] + room)


class Itself:
    """An artist that Matplotlib draws."""

    def __init__(self, artist: Artist) -> None:
        self.artist = artist
        whole: Part = slice(0, None), slice(0, None)
        frame = Frame(cast(Axes, artist.axes))
        self.parts = [*frame.parts(*frame.box[:, None])] if artist.get_clip_on() else [whole]

    def paint(self, canvas: Canvas) -> Iterator[Part]:
        """Draw, and yield the regions that may have changed."""
        self.artist.draw(canvas.renderer)
        if self.artist.get_visible():
            yield from self.parts


def painter(artist: Artist) -> Strokes | Arrows | Itself:
    """Return the painter of an artist, on axes whose limits do not change."""
    if isinstance(artist, Arrows):
        return artist
    if isinstance(artist, Line2D) and artist.get_linestyle() in ("-", "None"):
        return Strokes(artist)
    return Itself(artist)


NOWHERE: Part = slice(0, 0), slice(0, 0)


class Bar:
    """A stacked bar of whole pixels, on axes whose limits do not change.

    `heights` are those of its blocks from the bottom up, (T,) each, at the moments of the film.
    """

    def __init__(
        self, ax: Axes, left: float, right: float, heights: dict[str, Floats], colors: list[str]
    ) -> None:
        self.heights = heights
        blocks = [*heights.values()]
        edges = np.cumsum([np.zeros_like(blocks[0]), *blocks], axis=0)
        zero = ax.transData.transform((0.0, 0.0))
        one = ax.transData.transform((1.0, 1.0)) - zero
        columns = np.floor(zero[0] + one[0] * np.array([left, right]) + 0.5).astype(int)
        self.columns = slice(*columns.tolist())
        # The ends of the blocks, from the top down, (T, blocks + 1).
        ups = np.floor(zero[1] + one[1] * edges[::-1].T + 0.5)
        self.rows = (round(ax.figure.bbox.height) - ups).astype(int)
        shares = np.array([to_rgba(color) for color in colors[::-1]])
        self.colors = np.round(255.0 * shares).astype(np.uint8).view("<u4")
        # The moment in the picture, and the region of the bar.
        self.now, self.part = -1, NOWHERE

    def stays(self, index: int) -> bool:
        """Whether its pixels at a moment are those in the picture."""
        return self.now >= 0 and bool((self.rows[index] == self.rows[self.now]).all())

    def paint(self, canvas: Canvas, index: int) -> Part:
        """Fill its pixels at a moment; return their region."""
        rows = self.rows[index]
        self.now, self.part = index, (slice(int(rows[0]), int(rows[-1])), self.columns)
        canvas.pixels[self.part] = np.repeat(self.colors, np.diff(rows), axis=0)
        return self.part


@cache
def _font(pixels: float) -> ImageFont.FreeTypeFont:
    path = findfont(FontProperties())
    return ImageFont.truetype(path, pixels, layout_engine=ImageFont.Layout.BASIC)


class Writing:
    """A text that changes from frame to frame, by Pillow; `said` has the text of each moment.

    The size is in pt, the place in pixels from the left and the top; `anchor`, as in Pillow, says
    which point of the text is there, such as "rs": the right end of the base line.
    """

    def __init__(
        self, size: float, dpi: float, x: float, y: float, anchor: str, said: list[str]
    ) -> None:
        self.font = _font(size * dpi / 72.0)
        self.place, self.anchor, self.said = (round(x), round(y)), anchor, said
        self.ink = style.INK
        # The mask of each text, and its upper left corner.
        self.masks: dict[str, tuple[tuple[int, int], Image.Image]] = {}
        # The text in the picture, and its region.
        self.now, self.part = "", NOWHERE

    def stays(self, index: int) -> bool:
        """Whether its text at a moment is the one in the picture."""
        return self.said[index] == self.now

    def paint(self, canvas: Canvas, index: int) -> Part:
        """Write the text of a moment; return the region that it covers."""
        self.now, gap = self.said[index], 0.35 * self.font.size
        if self.now not in self.masks:
            box = canvas.text.textbbox(self.place, self.now, self.font, self.anchor, gap)
            left, top, right, bottom = floor(box[0]), floor(box[1]), ceil(box[2]), ceil(box[3])
            mask = Image.new("L", (max(1, right - left), max(1, bottom - top)))
            place = self.place[0] - left, self.place[1] - top
            ImageDraw.Draw(mask).text(place, self.now, 255, self.font, self.anchor, spacing=gap)
            self.masks[self.now] = (left, top), mask
        (left, top), mask = self.masks[self.now]
        canvas.text.bitmap((left, top), mask, self.ink)
        self.part = slice(max(0, top), top + mask.height), slice(max(0, left), left + mask.width)
        return self.part
