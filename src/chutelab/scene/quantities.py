"""What a key of a scene may hold: strict types, units, ranges, and how a key is described.

Numbers are strict: a TOML integer will do for a float, but neither a boolean nor a string; NaN and
infinity are refused. Every quantity has an upper bound, so that a slip of the keyboard is refused
instead of overflowing, or of filling the memory, far from its cause.
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Annotated, Any, Final

from pydantic import AfterValidator, Field, WithJsonSchema

RESERVED_NAMES: Final = ("incoming", "plate", "outgoing", "particles")
"""Names in ledgers and events that a free surface may not take."""

NAME: Final = r"""^[^\s.=\[\]"']{1,40}$"""
"""A free surface's name, such that an override can name it in a path."""

LARGEST: Final = 1e6
"""Bound on every dimensional quantity, SI: far beyond any chute, far from overflow in v⁴."""

MOST_PARTICLES: Final = 10_000_000
"""Their knots alone would be gigabytes beyond this."""

MOST_SURFACES: Final = 1_000
MOST_POINTS: Final = 10_000
MOST_EXPECTATIONS: Final = 1_000


def _distinct(points: tuple[Point, ...]) -> tuple[Point, ...]:
    for first, second in pairwise(points):
        if first == second:
            raise ValueError(f"consecutive points must differ, [{first[0]}, {first[1]}] repeats")
    return points


def _free(name: str) -> str:
    if not re.fullmatch(NAME, name):
        raise ValueError("must be 1 to 40 characters without spaces, dots, =, brackets or quotes")
    if name in RESERVED_NAMES:
        raise ValueError(f"must not be one of the reserved names {', '.join(RESERVED_NAMES)}")
    return name


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Switch = Annotated[bool, Field(strict=True)]
Text = Annotated[str, Field(strict=True)]
Name = Annotated[Text, AfterValidator(_free), WithJsonSchema({"type": "string", "pattern": NAME})]
Coordinate = Annotated[Number, Field(ge=-LARGEST, le=LARGEST)]
Point = tuple[Coordinate, Coordinate]
Polyline = Annotated[
    tuple[Point, ...], Field(min_length=2, max_length=MOST_POINTS), AfterValidator(_distinct)
]
Friction = Annotated[Number, Field(ge=0.0, le=LARGEST)]
Duration = Annotated[Number, Field(gt=0.0, le=LARGEST)]


def described(default: Any, what: str, unit: str = "", **limits: Any) -> Any:
    """Describe one key: its default, its definition in a sentence, its unit and its range."""
    return Field(
        default,
        description=f"{what} ({unit})." if unit else f"{what}.",
        json_schema_extra={"x-unit": unit} if unit else None,
        **limits,
    )


def size(default: Any, what: str) -> Any:
    """Describe a length that cannot be 0."""
    return described(default, what, "m", gt=0.0, le=LARGEST)


def pair_restitution(default: float, pair: str) -> Any:
    """Describe the restitution of a pair, such as particle-plate."""
    return described(default, f"Coefficient of restitution of the pair {pair}", ge=0.0, le=1.0)


def pair_friction(default: float, pair: str) -> Any:
    """Describe the friction of a pair, such as particle-plate."""
    return described(default, f"Coulomb coefficient of friction µ of the pair {pair}")
