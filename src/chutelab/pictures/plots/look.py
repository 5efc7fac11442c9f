"""How pictures look for a while: `look` chooses their colours, light or dark, and their language.

Whatever draws asks `plots.style` for its colours by name, such as ``style.TRACK``, and `say` for
its words, and is given those of the look that holds.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Final

from matplotlib import rc_context

from chutelab.pictures import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION
from chutelab.util.words import Words, words

LIGHT: Final[dict[str, str]] = {
    "GROUND": "#FFFFFF",
    "INK": "#000000",
    "MUTED": "#595959",
    "STEEL": GREY,
    "STEEL_LIGHT": "#E6E6E6",
    "WALL": "#000000",
    "BELT_BODY": "#2B3841",
    "CLEAT": "#3CCFA2",
    "TRACK": BLUE,
    "ANALYTIC": ORANGE,
    "BELT": GREEN,
    "BELT_NAME": "#00805D",
    "STRIKE": VERMILION,
    "STREAM": SKY,
    "START": "#BFBFBF",
}

DARK: Final[dict[str, str]] = {
    "GROUND": "#0E141A",
    "INK": "#EDF2F6",
    "MUTED": "#AFBCC7",
    "STEEL": "#8B99A5",
    "STEEL_LIGHT": "#2A3540",
    "WALL": "#93A3B0",
    "BELT_BODY": "#3B4A56",
    "CLEAT": "#45DBAE",
    "TRACK": "#62BAF0",
    "ANALYTIC": "#E6B45A",
    "BELT": "#2FC79A",
    "BELT_NAME": "#2FC79A",
    "STRIKE": "#F4843C",
    "STREAM": "#7A9FB8",
    "START": "#7C858D",
}
"""Those of the live page in the dark."""

_COLOURS: ContextVar[dict[str, str]] = ContextVar("colours", default=LIGHT)
_WORDS: ContextVar[Words] = ContextVar("words")


def colours() -> dict[str, Any]:
    """Return the colours of the look that holds by name, and what is made of them.

    Each stands for one thing in every panel. The ledger has the same hues in the light and in the
    dark.
    """
    base = _COLOURS.get()
    ink, track, strike, analytic = (base[name] for name in ("INK", "TRACK", "STRIKE", "ANALYTIC"))
    return {
        **base,
        "VELOCITY": {"vx": track, "vy": strike},
        "ENERGY": {
            "start": base["START"],
            "kinetic": ORANGE,
            "potential": SKY,
            "belt_work": GREEN,
            "restitution_loss": VERMILION,
            "friction_loss": PURPLE,
            "residual": ink,
        },
        # How lines known analytically are drawn, under those that are simulated; strobe dots.
        "DASHED": {"color": analytic, "lw": 4.0, "ls": (0, (2.2, 1.1))},
        "RINGS": {"ls": "none", "marker": "o", "mfc": base["GROUND"], "mec": track},
    }


def say(key: str, /, **values: object) -> str:
    """Return what pictures say in the language that holds: a template, ``picture-KEY``."""
    return spoken().say(f"picture-{key}", **values)


def spoken() -> Words:
    """Return the words of the language that holds."""
    return _WORDS.get(words())


def figures(value: float, form: str = ".3g") -> str:
    """Return a number in the digits of the language that holds."""
    return spoken().figures(value, form)


def named(text: str) -> str:
    """Return how a surface or a stream is called; most names are the same in every language."""
    return spoken().catalogue.get(f"picture-name-{text}", text)


@contextmanager
def look(*, dark: bool = False, language: str = "en") -> Iterator[None]:
    """Draw in the light or the dark colours, and in a language, until the end of the block.

    Titles and names that a scene gives stay as they are.

    Raises
    ------
    LanguageError
        If there is no such language; the message lists those there are.
    """
    told = _WORDS.set(words(language))
    try:
        with _colours(dark=dark):
            yield
    finally:
        _WORDS.reset(told)


@contextmanager
def _colours(*, dark: bool) -> Iterator[None]:
    if not dark:
        yield
        return
    ground, ink, muted = (DARK[name] for name in ("GROUND", "INK", "MUTED"))
    settings: Any = {
        **dict.fromkeys(("figure.facecolor", "axes.facecolor"), ground),
        **dict.fromkeys(("text.color", "axes.labelcolor", "xtick.labelcolor"), ink),
        **dict.fromkeys(("ytick.labelcolor", "legend.labelcolor"), ink),
        **dict.fromkeys(
            ("axes.edgecolor", "xtick.color", "ytick.color", "legend.edgecolor"), muted
        ),
    }
    token = _COLOURS.set(DARK)
    try:
        with rc_context(settings):
            yield
    finally:
        _COLOURS.reset(token)
