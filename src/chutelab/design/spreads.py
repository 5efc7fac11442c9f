"""Uncertain inputs: ``KEY=MEAN±SPREAD``, checked against the scene before anything runs.

>>> from chutelab.scene import load
>>> (one,) = spreads(load("perpendicular"), ["restitution=0.5+-0.05"])
>>> one.key, one.mean, one.spread, one.law
('plate.restitution', 0.5, 0.05, 'normal')
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from chutelab.design.errors import DesignError, each_once, scipy
from chutelab.design.ranges import INSIDE, varied, without_source
from chutelab.scene import Scene, SceneError
from chutelab.scene.paths import limits_of, parts_of, rule_at, value_at
from chutelab.scene.units import read_size
from chutelab.variation import Vary, quantity, reason

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chutelab.design.evaluation import Floats

FORM: Final = (
    "must be KEY=MEAN±SPREAD, such as restitution=0.5±0.05 or incoming.speed=2+-1% (or ±SPREAD"
    " alone, around the scene's value); :uniform at the end makes SPREAD a half-width"
)

ASK = f"say what is uncertain; it {FORM}"

LAWS: Final = ("normal", "uniform")

HOMES: Final = ("plate", "incoming", "outgoing", "particle", "stream")
"""Tables in which a name without one is looked for, in this order."""

MOST: Final = 12
"""Uncertain inputs at once."""

_SIGN: Final = re.compile(r"±|\+/-|\+-")


@dataclass(frozen=True)
class Spread:
    """A number of the scene that is not known exactly.

    Attributes
    ----------
    key, unit : str
        Its full path, and its unit.
    mean, spread : float
        Normal: mean and standard deviation. Uniform: middle and half-width.
    law : {"normal", "uniform"}
        How it is distributed.
    low, high : float
        The least and the largest value that the scene allows; the distribution is cut there.
    """

    key: str
    unit: str
    mean: float
    spread: float
    law: Literal["normal", "uniform"]
    low: float
    high: float

    @property
    def cut(self) -> float:
        """Share of the distribution that the scene does not allow."""
        below, above = self._tails()
        return below + above

    def _tails(self) -> tuple[float, float]:
        if self.law == "normal":
            ndtr = scipy("special").ndtr
            return (
                float(ndtr((self.low - self.mean) / self.spread)),
                float(ndtr((self.mean - self.high) / self.spread)),
            )
        width = 2.0 * self.spread
        below = (self.low - self.mean + self.spread) / width
        above = (self.mean + self.spread - self.high) / width
        return float(np.clip(below, 0.0, 1.0)), float(np.clip(above, 0.0, 1.0))

    def values(self, shares: Floats) -> Floats:
        """Return the values below which given shares, 0 to 1, of the (cut) distribution lie."""
        below, above = self._tails()
        inside = below + shares * (1.0 - below - above)
        if self.law == "normal":
            # Sobol points begin at 0, where a normal distribution has no value.
            safe = np.clip(inside, 1e-12, 1.0 - 1e-12)
            found = self.mean + self.spread * scipy("special").ndtri(safe)
        else:
            found = self.mean + self.spread * (2.0 * inside - 1.0)
        inside_limits: Floats = np.clip(found, self.low, self.high)
        return inside_limits


def spreads(scene: Scene, texts: Sequence[str]) -> tuple[Spread, ...]:
    """Read what ``--uncertainty`` takes, several times.

    Raises
    ------
    DesignError, VaryError
        If one cannot be read, or is of a key that is unknown, no continuous number, or given twice.
    """
    return each_once("--uncertainty", texts, lambda text: _read(scene, text), ASK, MOST)


def _read(scene: Scene, text: str) -> Spread:
    typed = f"--uncertainty {text}"
    key, equals, given = (part.strip() for part in text.partition("="))
    given, _, law = (part.strip() for part in given.partition(":"))
    parts = [part.strip() for part in _SIGN.split(given)]
    if not (key and equals) or len(parts) != 2 or not parts[1]:
        raise DesignError(typed, FORM)
    if law not in ("", *LAWS):
        raise DesignError(typed, f"{law} is no distribution here; there are {' and '.join(LAWS)}")
    about = quantity(scene, Vary(_full(scene, key), (0.0,), typed))
    own = value_at(scene, about.path)
    if not isinstance(own, (int, float)):
        own = None
    if own is None and not parts[0]:
        raise DesignError(typed, f"{about.path} has no value in this scene: give the mean, too")
    mean = float(own) if own is not None and not parts[0] else _number(parts[0], about.unit, typed)
    spread = _size(parts[1], mean, about.unit, typed)
    low, high = limits_of(rule_at(parts_of(about.path)) or {}) or (-np.inf, np.inf)
    for value in (mean, float(np.clip(mean + INSIDE * spread, low, high))):
        try:
            varied(scene, [about.path], [value])
        except SceneError as error:
            raise DesignError(typed, without_source(reason(error))) from None
    return Spread(
        about.path, about.unit, mean, spread, "uniform" if law == "uniform" else "normal", low, high
    )


def _full(scene: Scene, key: str) -> str:
    """Add the table to a name that has none."""
    if "." in key or "[" in key or key in Scene.model_fields:
        return key
    for home in HOMES:
        if getattr(scene, home) is not None and key in Scene.tables()[home].model_fields:
            return f"{home}.{key}"
    return key


def _number(text: str, unit: str, typed: str) -> float:
    try:
        value, found = read_size(text)
    except ValueError as error:
        raise DesignError(typed, f"{text or 'nothing'}: {error}; it {FORM}") from None
    if found not in ("", unit):
        allowed = f"it is in {unit}" if unit else "it is a pure number"
        raise DesignError(typed, f"wrong unit in {text}: {allowed}")
    return value


def _size(text: str, mean: float, unit: str, typed: str) -> float:
    value = mean
    if text.endswith("%"):
        value = abs(mean) * _number(text.removesuffix("%"), "", typed) / 100.0
    else:
        value = _number(text, unit, typed)
    if not value > 0.0:
        raise DesignError(typed, f"the spread {text} must be more than 0; it {FORM}")
    return value
