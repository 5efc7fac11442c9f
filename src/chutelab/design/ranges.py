"""What may vary, and how far: ``KEY=FROM:TO``, checked against the scene before anything runs."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Final

from chutelab.design.errors import DesignError, each_once
from chutelab.scene import Scene, SceneError, overridden
from chutelab.scene.paths import value_at
from chutelab.variation import parse_range, quantity, reason, setting

if TYPE_CHECKING:
    from collections.abc import Sequence


FORM: Final = "must be KEY=FROM:TO, such as plate.angle_deg=0:80"

ASK = f"say what may vary; it {FORM}"

MOST: Final = 8
"""Keys that may vary at once: beyond, a search over the whole range takes too long to be one."""

INSIDE: Final = 0.3819660112501051
"""Where in a range it is tried before the search: a share that makes no whole number."""


@dataclass(frozen=True)
class Span:
    """A key of the scene and the values it may take.

    Attributes
    ----------
    key : str
        Its full path; free surfaces by index.
    unit : str
        "" for a pure number.
    low, high : float
        Ends of the range, low < high.
    start : float or None
        The scene's own value; None if it has none.
    label : str
        Its definition in words.
    """

    key: str
    unit: str
    low: float
    high: float
    start: float | None
    label: str

    @property
    def width(self) -> float:
        """High less low."""
        return self.high - self.low


def ranges(scene: Scene, texts: Sequence[str]) -> tuple[Span, ...]:
    """Read what ``--vary`` takes, several times.

    Raises
    ------
    DesignError, VaryError
        If a range cannot be read, is empty, goes beyond what the scene allows, or is of a key that
        is unknown, no continuous number, or given twice.
    """
    return each_once("--vary", texts, lambda text: _read(scene, text), ASK, MOST)


def _read(scene: Scene, text: str) -> Span:
    if text.count(":") != 1:
        raise DesignError(f"--vary {text}", FORM)
    given = parse_range(text)
    home = given.key.partition(".")[0]
    if home in Scene.tables() and getattr(scene, home) in (None, ()):
        named = "[[surface]]" if home == "surface" else f"[{home}]"
        raise DesignError(given.typed, f"the scene has no {named}")
    low, high = given.values
    about = quantity(scene, given)
    if about.whole:
        raise DesignError(given.typed, f"{about.path} is a whole number: it cannot be searched")
    _allowed(scene, about.path, (low, low + INSIDE * (high - low), high), given.typed)
    value = value_at(scene, about.path)
    start = float(value) if isinstance(value, (int, float)) else None
    return Span(about.path, about.unit, low, high, start, about.label)


def _allowed(scene: Scene, path: str, values: Sequence[float], typed: str) -> None:
    """Refuse values that the key cannot have; those that only do not go with others may pass."""
    refused = []
    for value in values:
        try:
            varied(scene, [path], [value])
        except SceneError as error:
            refused.append(error)
            for fault in error.faults:
                if fault.key == path and isfinite(value):
                    raise DesignError(typed, without_source(str(fault))) from None
    if len(refused) == len(values):
        raise DesignError(typed, without_source(reason(refused[0])))


def without_source(text: str) -> str:
    """Leave out of a fault which override it came from: none that anybody typed.

    >>> without_source("plate.angle_deg = 90: less than 90 (from --vary plate.angle_deg=90)")
    'plate.angle_deg = 90: less than 90'
    """
    return re.sub(r" \(from --[^)]*\)", "", text)


def varied(
    scene: Scene, keys: Sequence[str], values: Sequence[float], extra: Sequence[str] = ()
) -> Scene:
    """Return a scene with other values of some keys.

    Parameters
    ----------
    extra : sequence of str
        Further ``KEY=VALUE``.

    Raises
    ------
    SceneError
        If the scene refuses a value, or two that do not go together.
    """
    overrides = [setting(key, float(value)) for key, value in zip(keys, values, strict=True)]
    return overridden(scene, [*overrides, *extra])
