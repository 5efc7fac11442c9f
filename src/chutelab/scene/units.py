"""Sizes as people write them, a number with its unit: "0.5 mm", "2 %", "1e-3 J"."""

from __future__ import annotations

import re
from math import isfinite
from typing import Final

_PREFIXES: Final = {"n": 1e-9, "µ": 1e-6, "u": 1e-6, "m": 1e-3, "c": 1e-2, "": 1.0, "k": 1e3}

UNITS: Final = {
    **{f"{prefix}m": ("m", size) for prefix, size in _PREFIXES.items()},
    **{f"{prefix}m/s": ("m/s", size) for prefix, size in _PREFIXES.items()},
    **{f"{prefix}{unit}": (unit, size) for unit in "sJW" for prefix, size in _PREFIXES.items()},
    "degrees": ("degrees", 1.0),
    "deg": ("degrees", 1.0),
    "°": ("degrees", 1.0),
    "%": ("%", 0.01),
    "": ("", 1.0),
}
"""Units that are understood, each as an SI unit (degrees for angles) and how many of those it is;
% is a share, and "" what is only counted."""

_SIZE: Final = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?) *([^\s\d]*)")


def read_size(text: str) -> tuple[float, str]:
    """Read a size: the number in the SI unit, and that unit.

    Raises
    ------
    ValueError
        If it is no finite number with a unit that is known.

    Examples
    --------
    >>> read_size("0.5 mm"), read_size("2%"), read_size("3")
    ((0.0005, 'm'), (0.02, '%'), (3.0, ''))
    """
    # Both signs of micro are on keyboards; they look alike.
    match = _SIZE.fullmatch(text.strip().replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}"))
    if match is None:
        raise ValueError("no number with a unit")
    if match[2] not in UNITS:
        raise ValueError(f"unknown unit {match[2]}")
    unit, size = UNITS[match[2]]
    # The shorter of two roundings: 0.5 mm is 0.0005 m, not 0.5 * 0.001 m.
    number = float(match[1]) / round(1.0 / size) if size < 1.0 else float(match[1]) * size
    if not isfinite(number):
        raise ValueError("too large a number")
    return number, unit


def symbol(unit: str) -> str:
    """Return a unit as tables and pictures have it.

    >>> symbol("degrees"), symbol("m/s")
    ('°', 'm/s')
    """
    return "°" if unit == "degrees" else unit


def with_unit(name: str, unit: str) -> str:
    """Return a name with its unit, for the head of a column or an axis.

    >>> with_unit("plate.angle_deg", "degrees"), with_unit("plate.restitution", "")
    ('plate.angle_deg, °', 'plate.restitution')
    """
    return f"{name}, {symbol(unit)}" if unit else name


def write_size(number: float, unit: str, digits: int = 3) -> str:
    """Write a size with the prefix that makes it easiest to read; a share as a bare number.

    Examples
    --------
    >>> write_size(0.0005, "m"), write_size(4.4e-8, "s"), write_size(1e-16, "m")
    ('0.5 mm', '44 ns', '1e-16 m')
    """
    size = abs(number)
    unit = symbol(unit)
    if unit in ("m", "s", "J", "m/s") and 1e-10 <= size < 0.1:
        prefix = next(p for p in ("m", "µ", "n") if size >= 0.1 * _PREFIXES[p])
        return f"{number * round(1.0 / _PREFIXES[prefix]):.{digits}g} {prefix}{unit}"
    return f"{number:.{digits}g} {unit}".strip() if unit != "%" else f"{number:.{digits}g}"
