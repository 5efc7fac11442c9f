"""The energy ledger as two stacked bars of equal height: what was put in, and where it is now."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.patches import Rectangle

from chutelab.plots import style

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

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
        style.dress(ax, title=f"Energy, {self.unit}")
        ax.grid(visible=False, axis="x")
        ax.set_xlim(-0.6, 1.6)
        ax.set_ylim(0.0, 1.06 * self.factor * max(heights) or 1.0)
        ax.set_xticks([0, 1], ["put in", "is now"], fontsize=style.SMALL)
        ax.tick_params(axis="x", length=0)
        self.bars = [{name: self._bar(ax, x, name) for name in SIGNS} for x in (-0.4, 0.6)]
        table.set_axis_off()
        table.set_xlim(0.0, 1.0)
        table.set_ylim(len(SIGNS), 0.0)
        self.values = {}
        for row, name in enumerate(SIGNS):
            table.add_patch(Rectangle((0.0, row + 0.2), 0.05, 0.6, color=style.ENERGY[name]))
            table.text(0.08, row + 0.5, style.ENERGY_LABEL[name], fontsize=style.SMALL, va="center")
            self.values[name] = table.text(
                1.0, row + 0.5, "", fontsize=style.SMALL, va="center", ha="right", animated=True
            )

    @property
    def artists(self) -> list[Artist]:
        """What moves."""
        return [*self.bars[0].values(), *self.bars[1].values(), *self.values.values()]

    def show(self, index: int) -> None:
        """Set the bars and figures to the books at a time index."""
        now = self._at(index)
        for bars, values in zip(self.bars, stacks(now), strict=True):
            base = 0.0
            for name, bar in bars.items():
                bar.set_y(base)
                bar.set_height(self.factor * values[name])
                base += self.factor * values[name]
        for name, text in self.values.items():
            text.set_text(
                style.scientific(now[name], "J")
                if name == "residual"
                else f"{round(self.factor * now[name], 1) + 0.0:.1f}".replace("-", "−")
            )

    def _at(self, index: int) -> dict[str, float]:
        return {name: float(self.books[name][index]) for name in SIGNS}

    @staticmethod
    def _bar(ax: Axes, x: float, name: str) -> Rectangle:
        bar = Rectangle((x, 0.0), 0.8, 0.0, color=style.ENERGY[name], linewidth=0.0, animated=True)
        ax.add_patch(bar)
        return bar
