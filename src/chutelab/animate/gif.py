"""A GIF, frame by frame: one shared palette, and of each frame only the rectangle that changed.

Inside it, what stays as it was is transparent, and transparent pixels in long runs cost next to
nothing. Pillow does the compression; the blocks around it are those of the GIF89a specification,
since neither Pillow nor imageio can be handed frames with indices into a palette they share.
"""

from __future__ import annotations

from struct import pack
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from PIL import Image

from chutelab.animate.palette import BITS, CLEAR, Palette, Pixels

if TYPE_CHECKING:
    from numpy.typing import NDArray

FOREVER = b"!\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"
"""The application extension that makes a GIF start again whenever it ends."""

LONGEST = 0xFFFF
"""Hundredths of a second that one frame can stay."""

KEEP, TRANSPARENT = 1 << 2, 1
"""Of a frame: the next one is drawn over it; it has a transparent index."""

Part = tuple[slice, slice]
"""Rows and columns of a picture, with starts and stops."""


class GifWriter:
    """Writes frames to a file; to be closed, or the last one is missing.

    Parameters
    ----------
    file : binary file
        Open for writing.
    width, height : int
        Pixels.
    """

    def __init__(self, file: BinaryIO, width: int, height: int) -> None:
        self._file = file
        self._palette = Palette()
        self._seen: Pixels | None = None
        self._screen: NDArray[np.uint8] = np.full((height, width), CLEAR, dtype=np.uint8)
        self._waiting: tuple[bytes, int] | None = None
        # A global table of 2**BITS colours, eight bits each; no background, square pixels.
        packed = 0x80 | 7 << 4 | (BITS - 1)
        file.write(pack("<6sHHBBB", b"GIF89a", width, height, packed, 0, 0))
        file.write(self._palette.bytes() + FOREVER)

    def add(self, pixels: Pixels, delay: int) -> None:
        """Append a picture.

        Parameters
        ----------
        pixels : ndarray, shape (height, width), uint32
            Red in the lowest byte; it may be overwritten afterwards.
        delay : int
            Hundredths of a second that it stays. A picture like the one before lengthens that.
        """
        data = self._data(pixels)
        if data is None and self._waiting is not None and self._waiting[1] + delay <= LONGEST:
            self._waiting = self._waiting[0], self._waiting[1] + delay
            return
        self._flush()
        # Nothing new, but too long for one frame: a pixel of nothing.
        self._waiting = data or _block(np.s_[0:1, 0:1], np.full((1, 1), CLEAR, np.uint8)), delay

    def close(self) -> None:
        """Write the last frame and the end."""
        self._flush()
        self._file.write(b";")

    def _flush(self) -> None:
        if self._waiting is not None:
            block, delay = self._waiting
            control = pack("<3sBHBB", b"!\xf9\x04", KEEP | TRANSPARENT, delay, CLEAR, 0)
            self._file.write(control + block)
        self._waiting = None

    def _data(self, pixels: Pixels) -> bytes | None:
        """Return the image block of what changed; None if nothing did."""
        whole = (slice(0, pixels.shape[0]), slice(0, pixels.shape[1]))
        if self._seen is None:
            self._seen = pixels.copy()
            self._screen = self._palette.indices(pixels.ravel()).reshape(pixels.shape)
            return _block(whole, self._screen)
        differs = pixels != self._seen
        self._seen[:] = pixels
        part = bounds(differs, whole)
        if part is None:
            return None
        changed = differs[part]
        screen = self._screen[part]
        new = self._palette.indices(pixels[part][changed])
        # Colours that differ may be shown as the same one.
        patch = np.full(changed.shape, CLEAR, dtype=np.uint8)
        patch[changed] = np.where(new == screen[changed], np.uint8(CLEAR), new)
        screen[changed] = new
        inner = bounds(patch != CLEAR, part)
        if inner is None:
            return None
        row, column = inner[0].start - part[0].start, inner[1].start - part[1].start
        rows, columns = inner[0].stop - inner[0].start, inner[1].stop - inner[1].start
        return _block(inner, patch[row : row + rows, column : column + columns])


def _block(part: Part, indices: NDArray[np.uint8]) -> bytes:
    """Return indices, (rows, columns), as the image block of a GIF."""
    rows, columns = indices.shape
    image = Image.frombytes("P", (columns, rows), indices.tobytes())
    place = pack("<cHHHHBB", b",", part[1].start, part[0].start, columns, rows, 0, BITS)
    return place + image.tobytes("gif", "P", BITS, 0) + b"\0"


def bounds(mask: NDArray[np.bool_], part: Part) -> Part | None:
    """Return the smallest part that holds all that is true in the mask of a part, None if nothing.

    >>> bounds(np.array([[False, True, True], [False, False, False]]), np.s_[10:12, 20:23])
    (slice(10, 11, None), slice(21, 23, None))
    """
    rows = np.flatnonzero(mask.any(axis=1))
    if not len(rows):
        return None
    columns = np.flatnonzero(mask[rows[0] : rows[-1] + 1].any(axis=0))
    top, left = part[0].start, part[1].start
    return (
        slice(top + int(rows[0]), top + int(rows[-1]) + 1),
        slice(left + int(columns[0]), left + int(columns[-1]) + 1),
    )
