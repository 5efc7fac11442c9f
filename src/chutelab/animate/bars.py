"""The energy ledger as two stacked bars of equal height: what was put in, and where it is now."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Rectangle

from chutelab.animate.lettering import Label, Lettering
from chutelab.plots import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from chutelab.animate.palette import Pixels

SIGNS = {
    "start": 1,
    "belt_work": 1,
    "kinetic": -1,
    "potential": -1,
    "restitution_loss": -1,
    "friction_loss": -1,
    "residual": 1,
}
"""The ledger with everything on one side: start + belt work + residual - K - U - losses = 0."""

BASE = 0.78
"""Share of a row above the line that its text stands on."""


def stacks(books: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Split a ledger into what was put in and where it is, all values positive.

    An entry of the other sign changes sides: work that a braking belt takes out belongs to where
    the energy is. Both sides add up to the same, see `SIGNS`.

    Parameters
    ----------
    books : dict of float
        J, at one time, as `chutelab.plots.sampling.energies` names them.
    """
    put_in, is_now = {}, {}
    for name, sign in SIGNS.items():
        value = sign * books[name]
        put_in[name], is_now[name] = max(value, 0.0), max(-value, 0.0)
    return put_in, is_now


class Bars:
    """Two bars with a column of figures beneath; `show` moves them to one time.

    Parameters
    ----------
    ax, table : Axes
        For the bars, and for the list of names and values under them.
    books : dict of ndarray, shape (T,)
        J, see `chutelab.plots.sampling.energies`; the highest bar sets the scale.
    """

    def __init__(self, ax: Axes, table: Axes, books: dict[str, NDArray[np.float64]]) -> None:
        self.books = books
        heights = [sum(stacks(self._at(i))[0].values()) for i in range(len(books["start"]))]
        self.factor, self.unit = style.scaled(max(heights), "J")
        self.ax = style.dress(ax, title=f"Energy, {self.unit}")
        ax.grid(visible=False, axis="x")
        ax.set_xlim(-0.6, 1.6)
        ax.set_ylim(0.0, 1.06 * self.factor * max(heights) or 1.0)
        ax.set_xticks([0, 1], ["put in", "is now"], fontsize=style.SMALL)
        ax.tick_params(axis="x", length=0)
        self.heights: tuple[dict[str, float], dict[str, float]] = ({}, {})
        table.set_axis_off()
        table.set_xlim(0.0, 1.0)
        table.set_ylim(len(SIGNS), 0.0)
        lettering = Lettering(style.SMALL, ax.figure.dpi)
        high = ax.figure.bbox.height
        self.values = {}
        for row, name in enumerate(SIGNS):
            table.add_patch(Rectangle((0.0, row + 0.2), 0.05, 0.6, color=style.ENERGY[name]))
            table.text(0.08, row + BASE, style.ENERGY_LABEL[name], fontsize=style.SMALL)
            right, up = table.transData.transform((1.0, row + BASE))
            self.values[name] = Label(lettering, right, high - up)

    def show(self, index: int) -> None:
        """Set the bars and figures to the books at a time index."""
        now = self._at(index)
        put_in, is_now = (
            {name: self.factor * value for name, value in side.items()} for side in stacks(now)
        )
        self.heights = put_in, is_now
        for name, label in self.values.items():
            label.text = (
                style.scientific(now[name], "J")
                if name == "residual"
                else f"{round(self.factor * now[name], 1) + 0.0:.1f}".replace("-", "−")
            )

    def paint(self, pixels: Pixels) -> None:
        """Paint bars and figures onto a picture, (height, width), in whole pixels."""
        for x, heights in zip((0.0, 1.0), self.heights, strict=True):
            edges = np.cumsum([0.0, *heights.values()])
            across, up = self.ax.transData.transform(
                np.column_stack([np.resize([x - 0.4, x + 0.4], len(edges)), edges])
            ).T
            columns = slice(round(across[0]), round(across[1]))
            rows = np.rint(len(pixels) - up).astype(int)
            for name, top, bottom in zip(heights, rows[1:], rows, strict=False):
                pixels[top:bottom, columns] = _COLOURS[name]
        for label in self.values.values():
            label.paint(pixels)

    def _at(self, index: int) -> dict[str, float]:
        return {name: float(self.books[name][index]) for name in SIGNS}


def _pixel(colour: str) -> np.uint32:
    """Return an opaque pixel, red in the lowest byte."""
    return np.uint32(int.from_bytes(bytes.fromhex(colour.removeprefix("#")) + b"\xff", "little"))


_COLOURS = {name: _pixel(colour) for name, colour in style.ENERGY.items()}
