"""The palette of every film: fixed, so that no colour can flicker, and small, so that files are.

It holds white, the greys and the colours of `chutelab.plots.style` unmixed, and the mixtures at
which anti-aliased edges between them are read as smooth. Every other colour is shown as the nearest
of these.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from chutelab.plots import style

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


def _rgb(colour: str) -> NDArray[np.float64]:
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
