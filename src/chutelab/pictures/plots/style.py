"""Colours, text sizes and units that every picture, page and notebook shares.

The colours are those of the look that holds, see `look`. `Picture` is a figure with a headline,
which writes itself to a file and shows itself in a notebook.
"""

from __future__ import annotations

from io import BytesIO
from math import floor, log10
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ticker import ScalarFormatter
from numpy.typing import ArrayLike

from chutelab.pictures.plots.look import colours, spoken
from chutelab.util.errors import printable
from chutelab.util.files import whole

GROUND: str
INK: str
MUTED: str
STEEL: str
STEEL_LIGHT: str
WALL: str
BELT_BODY: str
CLEAT: str
TRACK: str
ANALYTIC: str
BELT: str
BELT_NAME: str
STRIKE: str
STREAM: str
VELOCITY: dict[str, str]
ENERGY: dict[str, str]
DASHED: dict[str, Any]
RINGS: dict[str, Any]


def __getattr__(name: str) -> Any:
    """Return one of the colours above, of the look that holds, see `look.colours`."""
    try:
        return colours()[name]
    except KeyError:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None


SMALL, NORMAL, LARGE = 9.5, 10.5, 13.0
"""Text sizes, pt; nothing is smaller, so that a projected picture stays readable."""

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M"}

PREFIXED = ("J", "W", "m")
"""Units that are scaled: millimetres a second and millidegrees are hard to read."""


def scaled(values: ArrayLike, unit: str) -> tuple[float, str]:
    """Return a factor and the prefixed unit that bring the largest value to between 1 and 1000.

    Units that are not in `PREFIXED` stay as they are.

    >>> scaled([0.0202, -0.01, float("nan")], "J"), scaled(0.3, "m/s")
    ((1000.0, 'mJ'), (1.0, 'm/s'))
    """
    sizes = np.abs(values)
    largest = float(np.max(sizes, initial=0.0, where=np.isfinite(sizes)))
    if largest == 0.0 or unit not in PREFIXED:
        return 1.0, unit
    power = min(max(3 * floor(log10(largest) / 3), -15), 6)
    return float(f"1e{-power}"), _PREFIXES[power] + unit


def quantity(value: float, unit: str) -> str:
    """Return a value to three digits with a prefixed unit.

    >>> quantity(0.0202, "J"), quantity(0.0, "J"), quantity(-1.5, "m/s")
    ('20.2 mJ', '0 J', '−1.50 m/s')
    """
    factor, name = scaled(float(f"{value:.2e}"), unit)
    shown = format(factor * value, "#.3g").rstrip(".") if value else "0"
    return f"{spoken().local(shown)} {name}".replace("-", "−")


def tint(colour: str, share: float, ground: str | None = None) -> str:
    """Return a colour mixed with a ground, by default that of the picture.

    >>> tint("#0072B2", 0.5), tint("#000000", 0.25)
    ('#80B8D8', '#BFBFBF')
    """
    ground = colours()["GROUND"] if ground is None else ground
    above, below = bytes.fromhex(colour[1:]), bytes.fromhex(ground[1:])
    mixed = (round(share * a + (1.0 - share) * b) for a, b in zip(above, below, strict=True))
    return "#" + bytes(mixed).hex().upper()


def drawable(text: str) -> str:
    """Return a text with another sign for each character that the font lacks.

    So matplotlib, which draws the text in bold or not, need not warn of any.
    """
    fonts = [
        [get_font(findfont(FontProperties(family=[name], weight=weight))) for name in families]
        for families in [FontProperties().get_family()]
        for weight in ("normal", "bold")
    ]

    def has(c: str) -> bool:
        within = (any(font.get_char_index(ord(c)) for font in every) for every in fonts)
        return printable(c) == c and all(within)

    other = "\N{REPLACEMENT CHARACTER}" if has("\N{REPLACEMENT CHARACTER}") else "?"
    return "".join(c if c == "\n" or has(c) else other for c in text)


def plain(text: str) -> str:
    r"""Return a text such that matplotlib writes it as it is, and takes no ``$`` for mathematics.

    Use it for all text from users: titles, names, keys.

    >>> plain("5 $ or $x_1$"), plain("\x1b[31m")
    ('5 \\$ or \\$x_1\\$', '�[31m')
    """
    return drawable(text).replace("$", r"\$")


class _Local(ScalarFormatter):
    """Numbers beside ticks in the digits of the language that held as the axes were dressed."""

    def __init__(self) -> None:
        super().__init__()
        self._words = spoken()

    def __call__(self, x: float, pos: int | None = None) -> str:
        return self._words.local(super().__call__(x, pos))


def dress(ax: Axes, x: str = "", y: str = "", title: str = "") -> Axes:
    """Give axes the common look, light grid, two spines, readable text; see `plain`."""
    ax.set_xlabel(plain(x), fontsize=NORMAL)
    ax.set_ylabel(plain(y), fontsize=NORMAL)
    if title:
        ax.set_title(plain(title), fontsize=NORMAL, loc="left", fontweight="bold")
    now = colours()
    ax.tick_params(labelsize=SMALL, color=now["MUTED"])
    ax.grid(visible=True, color=now["STEEL_LIGHT"], linewidth=0.6)
    if spoken().language != "en":
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter(_Local())
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    return ax


def note(ax: Axes, text: str) -> None:
    """Write a remark above axes, at the right."""
    ax.set_title(plain(text), fontsize=SMALL, loc="right", color=colours()["MUTED"])


def legend_above(ax: Axes, columns: int, handles: list[Any] | None = None) -> None:
    """Add a legend right above axes, by default of all that has a label.

    It is one line if that fits, else as many `columns`, or fewer, as are no wider than the axes.
    """
    options: dict[str, Any] = {
        "handles": handles,
        "loc": "lower left",
        "bbox_to_anchor": (-0.01, 1.0),
        "fontsize": SMALL,
        "frameon": False,
        "borderaxespad": 0.3,
        "handlelength": 2.2,
    }
    for ncols in (max(columns, len(handles or ())), *range(columns, 0, -1)):
        legend = ax.legend(**options, ncols=ncols)
        if legend.get_window_extent().x1 <= ax.get_window_extent().x1:
            return


def scientific(value: float, unit: str) -> str:
    """Return a value that is read for its power of ten.

    >>> scientific(-1.4e-17, "J"), scientific(0.0, "J")
    ('−1e−17 J', '0 J')
    """
    return f"{value:.0e} {unit}".replace("-", "−").replace("e−0", "e−") if value else f"0 {unit}"


UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""By format, what keeps the time at which a picture is written out of its file."""


class Picture(Figure):
    """A matplotlib figure of a size in inches with its canvas, made without pyplot.

    Files have 120 dots to the inch, unless it is for print.
    """

    def __init__(self, size: tuple[float, float], dpi: float = 120) -> None:
        super().__init__(figsize=size, dpi=dpi)
        FigureCanvasAgg(self)

    def headline(self, x: float, y: float, title: str, longest: int = 80) -> None:
        """Write a title at a place, in shares of the figure, cut at `longest` characters."""
        self.text(
            x, y, plain(shorten(title, longest, placeholder=" …")),
            fontsize=LARGE, fontweight="bold", verticalalignment="center",
        )  # fmt: skip

    def remark(self, x: float, y: float, text: str, **look: Any) -> None:
        """Write grey text at a place, in shares of the figure; its upper left corner is there."""
        self.text(
            x,
            y,
            plain(text),
            **{"fontsize": NORMAL, "color": colours()["MUTED"], "va": "top", **look},
        )

    def write(self, path: str | Path | None) -> None:
        """Write the figure, whole or not at all; nothing without a path.

        The suffix says the format, PNG without one. The same figure makes the same bytes.
        """
        if path is None:
            return
        form = Path(path).suffix.lstrip(".").lower() or "png"
        with whole(path) as unfinished, rc_context({"svg.hashsalt": "chutelab"}):
            self.savefig(unfinished, format=form, metadata=UNDATED.get(form))

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png", dpi=80)  # of a notebook; files have the figure's own
        return buffer.getvalue()
