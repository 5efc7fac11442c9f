"""Look of pictures: colours and language within a block, text sizes, units, and figures.

`look` chooses the colours, light or dark, and the language. Drawing functions use colours by name,
such as ``style.TRACK``, and `say` for words, and get those of the present look. `Picture` is a
figure with a headline that can be written to a file and shown in a notebook.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from io import BytesIO
from math import floor, log10
from pathlib import Path
from textwrap import shorten
from typing import Any, Final

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.lines import Line2D
from matplotlib.ticker import ScalarFormatter
from numpy.typing import ArrayLike

from chutelab.machine import Machine
from chutelab.pictures import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION
from chutelab.util.errors import printable
from chutelab.util.files import whole
from chutelab.util.words import Words, words

LOOKS: Final = {
    "GROUND": ("#FFFFFF", "#0E141A"),
    "INK": ("#000000", "#EDF2F6"),
    "MUTED": ("#595959", "#AFBCC7"),
    "STEEL": (GREY, "#8B99A5"),
    "STEEL_LIGHT": ("#E6E6E6", "#2A3540"),
    "WALL": ("#000000", "#93A3B0"),
    "BELT_BODY": ("#2B3841", "#3B4A56"),
    "CLEAT": ("#3CCFA2", "#45DBAE"),
    "TRACK": (BLUE, "#62BAF0"),
    "ANALYTIC": (ORANGE, "#E6B45A"),
    "BELT": (GREEN, "#2FC79A"),
    "BELT_NAME": ("#00805D", "#2FC79A"),
    "STRIKE": (VERMILION, "#F4843C"),
    "STREAM": (SKY, "#7A9FB8"),
    "START": ("#BFBFBF", "#7C858D"),
}
"""Colours by name, in the light and in the dark; the dark ones are those of the live page."""

_DARK: ContextVar[bool] = ContextVar("dark", default=False)
_WORDS: ContextVar[Words] = ContextVar("words")


def colours() -> dict[str, Any]:
    """Return the colours of the present look by name, and styles made from them.

    Each has one meaning in every panel. The ledger has the same hues in both looks.
    """
    base = {name: pair[_DARK.get()] for name, pair in LOOKS.items()}
    ink, track, strike, analytic = (base[name] for name in ("INK", "TRACK", "STRIKE", "ANALYTIC"))
    return {
        **base,
        "VELOCITY": {"vx": track, "vy": strike},
        "ENERGY": {
            "start": base["START"],
            "kinetic": ORANGE,
            "potential": SKY,
            "spring": BLUE,
            "belt_work": GREEN,
            "restitution_loss": VERMILION,
            "friction_loss": PURPLE,
            "damper_loss": "#8A7A00",
            "residual": ink,
        },
        # Styles of analytic lines, drawn under simulated ones; strobe dots.
        "DASHED": {"color": analytic, "lw": 4.0, "ls": (0, (2.2, 1.1))},
        "RINGS": {"ls": "none", "marker": "o", "mfc": base["GROUND"], "mec": track},
    }


def __getattr__(name: str) -> Any:
    """Return one of the colours above, of the present look, see `colours`."""
    try:
        return colours()[name]
    except KeyError:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None


def say(key: str, /, **values: object) -> str:
    """Return the text ``picture-KEY`` in the present language, filled in."""
    return spoken().say(f"picture-{key}", **values)


def paid_words(parts: Sequence[str]) -> str:
    """Return the name of the work of several parts, see `scenery.paid_by`; "" of none."""
    if tuple(parts) == ("drives",):
        return say("ledger-drives")
    return ", ".join(say(f"by-{part}") for part in parts)


def spoken() -> Words:
    """Return the words of the present language."""
    return _WORDS.get(words())


def figures(value: float, form: str = ".3g") -> str:
    """Return a number as written in the present language."""
    return spoken().figures(value, form)


def named(text: str) -> str:
    """Return the name of a surface; most are the same in every language."""
    return spoken().catalogue.get(f"picture-name-{text}", text)


@contextmanager
def look(*, dark: bool = False, language: str = "en") -> Iterator[None]:
    """Use the light or the dark colours, and a language, until the end of the block.

    Titles of shipped scenes are in that language, too; names that a scene gives stay as they are.

    Raises
    ------
    LanguageError
        If there is no such language; the message lists those there are.
    """
    told, shown = _WORDS.set(words(language)), _DARK.set(dark or _DARK.get())
    ground, ink, muted = (colours()[name] for name in ("GROUND", "INK", "MUTED"))
    settings: Any = {
        **dict.fromkeys(("figure.facecolor", "axes.facecolor"), ground),
        **dict.fromkeys(("text.color", "axes.labelcolor", "xtick.labelcolor"), ink),
        **dict.fromkeys(("ytick.labelcolor", "legend.labelcolor"), ink),
        **dict.fromkeys(
            ("axes.edgecolor", "xtick.color", "ytick.color", "legend.edgecolor"), muted
        ),
    }
    try:
        with rc_context(settings if dark else {}):
            yield
    finally:
        _WORDS.reset(told)
        _DARK.reset(shown)


SMALL, NORMAL, LARGE = 9.5, 10.5, 13.0
"""Text sizes, pt; none is smaller, so that a projected picture stays readable."""

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

    >>> quantity(0.0202, "J"), quantity(0.0, "J"), quantity(-1.5, "m/s"), quantity(1252.3, "N")
    ('20.2 mJ', '0 J', '−1.50 m/s', '1250 N')
    """
    rounded = float(f"{value:.2e}")
    factor, name = scaled(rounded, unit)
    digits = "#.3g" if abs(factor * rounded) < 1000.0 else ".0f"
    shown = format(factor * rounded, digits).rstrip(".") if value else "0"
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

    So matplotlib does not warn about missing characters, in bold or not.
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
    r"""Return a text that matplotlib writes literally, without mathematics in ``$``.

    Use it for all text from users: titles, names, keys.

    >>> plain("5 $ or $x_1$"), plain("\x1b[31m")
    ('5 \\$ or \\$x_1\\$', '�[31m')
    """
    return drawable(text).replace("$", r"\$")


class Digits(ScalarFormatter):
    """Numbers at ticks, written in the language in which the axes were made."""

    def __init__(self) -> None:
        super().__init__()
        self._words = spoken()

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a tick."""
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
            axis.set_major_formatter(Digits())
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    return ax


def note(ax: Axes, text: str) -> None:
    """Write a remark above axes, at the right."""
    ax.set_title(plain(text), fontsize=SMALL, loc="right", color=colours()["MUTED"])


def colour_bar(ax: Axes, drawn: ScalarMappable, label: str) -> None:
    """Add a colour bar beside axes."""
    bar = ax.figure.canvas.figure.colorbar(drawn, ax=ax, format=Digits(), fraction=0.035, pad=0.02)
    bar.set_label(label, fontsize=NORMAL)
    bar.ax.tick_params(labelsize=SMALL)


def legend_above(ax: Axes, columns: int, handles: list[Any] | None = None) -> None:
    """Add a legend right above axes, by default of all that has a label.

    It is one line if that fits, else it has up to `columns` columns that fit the width of the axes.
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


def stream_colours(count: int) -> list[str]:
    """Return a colour for each stream; the sixth to the tenth are nearer to the ink.

    Orange, the colour of analytic curves, comes as late as possible.
    """
    hues = (colours()["STREAM"], PURPLE, ORANGE, BLUE, GREEN)
    every = [*hues, *(tint(hue, 0.6, colours()["INK"]) for hue in hues)]
    return [every[i % len(every)] for i in range(count)]


LONGEST = 20
"""Most characters of a stream's name in a legend."""


def stream_handles(machine: Machine, *, all_of_them: bool = False) -> list[Line2D]:
    """Return handles for a legend of the streams.

    One of particle 0 alone is left out, as it has its own handle, but with `all_of_them`.
    """
    hues = stream_colours(len(machine.streams))
    sizes = np.bincount(machine.releases.stream, minlength=len(hues))
    return [
        Line2D([], [], ls="none", marker="o", ms=6.0, color=hue, label=plain(one[:LONGEST]))
        for i, (one, hue) in enumerate(zip(machine.streams, hues, strict=True))
        if i or sizes[0] > 1 or all_of_them
    ]


def scientific(value: float, unit: str) -> str:
    """Return a value in scientific notation, with its unit.

    >>> scientific(-1.4e-17, "J"), scientific(0.0, "J")
    ('−1e−17 J', '0 J')
    """
    return f"{value:.0e} {unit}".replace("-", "−").replace("e−0", "e−") if value else f"0 {unit}"


UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""By format, metadata that keep the time of writing out of a file."""


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
            x, y, plain(shorten(spoken().title(title), longest, placeholder=" …")),
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
