"""Sizes with units, such as "0.5 mm" or "1e-3 J", and the types and ranges of keys."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from itertools import pairwise
from math import hypot, isfinite, nan, pi
from operator import add, lt
from typing import TYPE_CHECKING, Annotated, Any, Final

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    WithJsonSchema,
    model_serializer,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from chutelab.util.errors import about_comma


class Table(BaseModel):
    """Base of all tables: frozen, unknown keys refused."""

    # A table's validator is built when first needed; most are part of that of a whole scene.
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    def _fill(self, key: str, value: object) -> None:
        # A default that depends on another key does not count as set, so that a changed scene gets
        # it again.
        object.__setattr__(self, key, value)


class Resolved(Table):
    """A table with resolved values, such as a rate in t/h; its file keeps the text."""

    _typed: dict[str, object] = PrivateAttr(default_factory=dict)

    def _resolve(self, key: str, value: object) -> None:
        self._typed = {**self._typed, key: getattr(self, key)}
        self._fill(key, value)

    @model_serializer(mode="wrap")
    def _as_typed(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        told: dict[str, Any] = handler(self)
        return told | {key: value for key, value in self._typed.items() if key in told}


_PREFIXES: Final = {"n": 1e-9, "µ": 1e-6, "u": 1e-6, "m": 1e-3, "c": 1e-2, "": 1.0, "k": 1e3}

UNITS: Final = {
    **{f"{prefix}m": ("m", size) for prefix, size in _PREFIXES.items()},
    **{f"{prefix}m/s": ("m/s", size) for prefix, size in _PREFIXES.items()},
    **{f"{prefix}{unit}": (unit, size) for unit in "sJWN" for prefix, size in _PREFIXES.items()},
    **{f"{prefix}g": ("kg", 1e-3 * size) for prefix, size in _PREFIXES.items()},
    **dict.fromkeys(("m/s²", "m/s^2"), ("m/s²", 1.0)),
    **{unit: (unit, 1.0) for unit in ("1/s", "kg/s", "t/h")},
    "degrees": ("degrees", 1.0),
    "deg": ("degrees", 1.0),
    "°": ("degrees", 1.0),
    "%": ("%", 0.01),
    "": ("", 1.0),
}
"""Known units, each as an SI unit (degrees for angles) and its factor; % is a share, and "" a
count."""

SIZE: Final = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?) *((?<= )1/s|[^\s\d,+-].*)?")
"""A number and its unit, if there is one."""


def read_size(text: str) -> tuple[float, str]:
    """Read a size: the number in the SI unit, and that unit.

    Raises a `ValueError` if it is no finite number with a unit that is known.

    Examples
    --------
    >>> read_size("0.5 mm"), read_size("2%"), read_size("3")
    ((0.0005, 'm'), (0.02, '%'), (3.0, ''))
    """
    # Both signs of micro are on keyboards; they look alike.
    match = SIZE.fullmatch(text.strip().replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}"))
    if match is None:
        raise ValueError(f"no number with a unit{about_comma(text)}")
    written = match[2] or ""
    if written not in UNITS:
        raise ValueError(f"unknown unit {written}")
    unit, size = UNITS[written]
    # The shorter of two roundings: 0.5 mm is 0.0005 m, not 0.5 * 0.001 m.
    number = float(match[1]) / round(1.0 / size) if size < 1.0 else float(match[1]) * size
    if not isfinite(number):
        raise ValueError("too large a number")
    return number, unit


def read_any(text: str) -> tuple[float, str]:
    """Read a size as `read_size` does, or one whose unit has no prefixes; NaN if it is neither.

    >>> read_any("4 mm"), read_any("3 kg/m³"), read_any("x")
    ((0.004, 'm'), (3.0, 'kg/m³'), (nan, ''))
    """
    try:
        return read_size(text)
    except ValueError:
        match = SIZE.fullmatch(text.strip())
        return (float(match[1]), match[2] or "") if match else (nan, "")


def size_in(text: str, unit: str) -> float | None:
    """Return a size in the required SI unit; None if it has none, or another.

    >>> size_in("4 mm", "m"), size_in("20°", "degrees"), size_in("4 s", "m"), size_in("4", "m")
    (0.004, 20.0, None, None)
    """
    number, found = read_any(text)
    return number if found == (unit or "%") else None


def units_of(unit: str) -> list[str]:
    """Return the units in which a size of this SI unit can be written.

    >>> units_of("degrees"), units_of("kg/m³")
    (['degrees', 'deg', '°'], ['kg/m³'])
    """
    return [written for written, (known, _) in UNITS.items() if known == unit] or [unit]


def symbol(unit: str) -> str:
    """Return a unit as tables and pictures show it.

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
    >>> write_size(1e-10, "J")
    '0.1 nJ'
    """
    size = abs(number)
    unit = symbol(unit)
    if unit in ("m", "s", "J", "m/s") and 1e-10 <= size < 0.1:
        prefix = next((p for p in ("m", "µ") if size >= 0.1 * _PREFIXES[p]), "n")
        return f"{number * round(1.0 / _PREFIXES[prefix]):.{digits}g} {prefix}{unit}"
    return f"{number:.{digits}g} {unit}".strip() if unit != "%" else f"{number:.{digits}g}"


RESERVED_NAMES: Final = ("incoming", "plate", "outgoing", "particles")
"""Names in ledgers and events that a free surface may not take."""

_SIGN: Final = r"""[^\s\x1c-\x1f\x85\ufeff.=\[\]"']"""
"""Pattern of a character of a name. Characters that are blank only in Python, or only in
JavaScript, are not allowed."""

WORDS: Final = f"{_SIGN}+(?: {_SIGN}+)*"
NAME: Final = f"^{WORDS}$"
"""A free surface's name, such that an override can name it in a path."""

LONGEST_NAME: Final = 40
"""Most characters of a name."""

LARGEST: Final = 1e6
"""Bound on every dimensional quantity, SI: far beyond any chute, far from overflow in v⁴."""

SHORTEST: Final = 1e-9
"""m; a few atoms. Nothing smaller has a surface, and releases on a belt are at least so far apart.

This and the following are far from underflow in squares and products, too."""

LIGHTEST: Final = 1e-27
"""kg; less than the lightest atom, 1.7e-27 kg."""

THINNEST: Final = 1e-3
"""kg/m³; less than any solid, and than air at a thousandth of its pressure."""

BRIEFEST: Final = 1e-9
"""s; shorter than an impact of the smallest grains, which has no duration here."""

WEAKEST: Final = 1e-9
"""m/s²; the pull of a grain of 1 mm on another, about. For weaker gravity write 0."""

SLOWEST: Final = 1e-9
"""m/s; 3 cm in a year, as continents drift. For anything slower write 0."""

MOST_PARTICLES: Final = 10_000_000
"""With more, the knots alone would be gigabytes."""

MOST_SURFACES: Final = 1_000
MOST_PIECES: Final = 10_000
"""Straight and bent pieces of all surfaces with their copies: engines look at each."""
MOST_KINDS: Final = 100
"""Most kinds of particles, and most streams."""
MOST_KEYS: Final = 200
"""Most that a page lists."""
MOST_PRESETS: Final = 20
MOST_POINTS: Final = 10_000
MOST_EXPECTATIONS: Final = 1_000


def apart(first: Sequence[float], second: Sequence[float]) -> bool:
    """Whether two points, m, are far enough apart for a surface."""
    return hypot(second[0] - first[0], second[1] - first[1]) >= SHORTEST


def _distinct(points: tuple[Point, ...]) -> tuple[Point, ...]:
    for first, second in pairwise(points):
        if not apart(first, second):
            raise ValueError(
                f"consecutive points must differ by at least {SHORTEST:g} m,"
                f" [{first[0]}, {first[1]}] repeats"
            )
    return points


def _free(name: str) -> str:
    if len(name) > LONGEST_NAME or not re.fullmatch(NAME, name):
        allowed = "dots, =, brackets, quotes or blanks other than single spaces between words"
        raise ValueError(f"must be 1 to {LONGEST_NAME} characters without {allowed}")
    if name in RESERVED_NAMES:
        raise ValueError(f"must not be one of the reserved names {', '.join(RESERVED_NAMES)}")
    return name


def _must(holds: Callable[[Any], bool], words: str) -> AfterValidator:
    """Refuse values that break a rule; say what they must be."""

    def judged(value: Any) -> Any:
        if not holds(value):
            raise ValueError(f"must be {words}")
        return value

    return AfterValidator(judged)


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Switch = Annotated[bool, Field(strict=True)]
Text = Annotated[str, Field(strict=True)]
Name = Annotated[
    Text,
    AfterValidator(_free),
    WithJsonSchema({"type": "string", "pattern": NAME, "maxLength": LONGEST_NAME}),
]
Coordinate = Annotated[Number, Field(ge=-LARGEST, le=LARGEST)]
"""Any number of a sane size, negative ones too."""

Amount = Annotated[Number, Field(ge=0.0, le=LARGEST)]
Point = tuple[Coordinate, Coordinate]
Polyline = Annotated[
    tuple[Point, ...], Field(min_length=2, max_length=MOST_POINTS), AfterValidator(_distinct)
]
Length = Annotated[Number, Field(ge=SHORTEST, le=LARGEST)]
Mass = Annotated[Number, Field(ge=LIGHTEST, le=LARGEST)]
Density = Annotated[Number, Field(ge=THINNEST, le=LARGEST)]
Duration = Annotated[Number, Field(ge=BRIEFEST, le=LARGEST)]
Share = Annotated[Number, Field(ge=0.0, le=1.0)]
Angle = Annotated[Number, Field(ge=-720.0, le=720.0)]
Turn = Annotated[Number, Field(ge=-36_000.0, le=36_000.0)]
"""degrees/s; 6,000 turns a minute."""
Stops = Annotated[
    tuple[Angle, Angle],
    _must(lambda stops: stops[0] <= 0.0 <= stops[1] and stops[0] < stops[1],
          "[least, greatest], degrees, round the 0 where it begins"),
]  # fmt: skip
Stiffness = Annotated[Number, Field(gt=0.0, le=LARGEST)]
Inertia = Annotated[Number, Field(ge=1e-9, le=LARGEST)]
Torque = Annotated[Number, Field(gt=0.0, le=LARGEST)]
Frequency = Annotated[Number, Field(ge=1e-6, le=10_000.0)]


class Worded:
    """Describes a list in words, for messages; a `Field` would be overruled by that of a key."""

    def __init__(self, words: str) -> None:
        self.words = words

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {**handler(schema), "x-words": self.words}


class OrLeast:
    """Allows 0, or a number that is at least the smallest meaningful one."""

    def __init__(self, least: float) -> None:
        self.least = least

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        def judged(number: float) -> float:
            if 0.0 < number < self.least:
                # Its words are taken from the JSON Schema.
                raise PydanticCustomError("least", "too small a number")
            return number

        return core_schema.no_info_after_validator_function(judged, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        between = {"exclusiveMinimum": 0.0, "exclusiveMaximum": self.least}
        return {**handler(schema), "not": between}


Pace = Annotated[Number, Field(ge=SLOWEST, le=LARGEST)]
Gravity = Annotated[Amount, OrLeast(WEAKEST)]
Speed = Annotated[Amount, OrLeast(SLOWEST)]


_ASCENDING: Final = _must(lambda ends: ends[0] < ends[1], "[from, to] with from < to")


def flat(given: object) -> Any:
    """Join the keys of tables inside each other: ``plate.angle_deg = 20`` is one key."""
    if not isinstance(given, Mapping):
        return given
    found: dict[str, object] = {}
    for key, value in given.items():
        inner = flat(value)
        found |= (
            {f"{key}.{k}": v for k, v in inner.items()} if isinstance(inner, dict) else {key: value}
        )
    return found


Keys = Annotated[
    tuple[Text, ...],
    Field(max_length=MOST_KEYS),
    Worded('a list of keys such as ["plate.angle_deg", "incoming.speed"]'),
]
"""Full paths of keys of the scene."""

Ranges = Annotated[
    dict[Text, Annotated[tuple[Number, Number], _ASCENDING, Worded("[from, to] with from < to")]],
    BeforeValidator(flat),
    Field(max_length=MOST_KEYS),
    Worded("a table of keys, each with its [from, to]"),
]
Values = Annotated[
    dict[Text, Any],
    BeforeValidator(flat),
    Field(min_length=1, max_length=MOST_KEYS),
    Worded("a table of keys of the scene and their values, such as { gravity = 1.62 }"),
]

Span = Annotated[tuple[Length, Length], _ASCENDING, Worded("a range [from, to] with from < to")]
"""A range [from, to]."""


Box = Annotated[
    tuple[Point, Point],
    _must(lambda box: all(map(lt, *box)), "[[left, bottom], [right, top]]"),
    Worded("a box [[left, bottom], [right, top]]"),
]
Size = Annotated[tuple[Length, Length], Worded(f"[width, height] of two numbers from {SHORTEST:g}")]
Two = Annotated[tuple[Text, Text], Worded('two names ["a", "b"]')]


def is_convex(points: tuple[Point, ...]) -> bool:
    """Tell whether points are the corners of a convex polygon, in their order."""
    turns = [
        (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
        for a, b, c in zip(points, points[1:] + points[:1], points[2:] + points[:2], strict=True)
    ]
    return all(turn > 0.0 for turn in turns) or all(turn < 0.0 for turn in turns)


def _plain_sum(numbers: list[float]) -> float:
    """Return a sum that is rounded after each number, as in pages; newer Pythons' `sum` is not."""
    return reduce(add, numbers)


def about_centroid(points: tuple[Point, ...]) -> tuple[Point, ...]:
    """Return the corners of a polygon, counterclockwise, moved so that its centroid is (0, 0)."""
    following = points[1:] + points[:1]
    crosses = [a[0] * b[1] - a[1] * b[0] for a, b in zip(points, following, strict=True)]
    twice = _plain_sum(crosses)
    x, y = (
        _plain_sum([(a[n] + b[n]) * c for a, b, c in zip(points, following, crosses, strict=True)])
        / (3.0 * twice)
        for n in (0, 1)
    )
    moved = tuple((px - x, py - y) for px, py in points)
    return moved if twice > 0.0 else moved[::-1]


def polygon_moment(points: tuple[Point, ...]) -> float:
    """Return I/m (m²) of a polygon about its centroid, which is the origin, counterclockwise."""
    following = points[1:] + points[:1]
    crosses = [a[0] * b[1] - a[1] * b[0] for a, b in zip(points, following, strict=True)]
    squares = [
        a[0] * a[0] + a[0] * b[0] + b[0] * b[0] + a[1] * a[1] + a[1] * b[1] + b[1] * b[1]
        for a, b in zip(points, following, strict=True)
    ]
    moments = [c * s for c, s in zip(crosses, squares, strict=True)]
    return _plain_sum(moments) / (6.0 * _plain_sum(crosses))


Corners = Annotated[
    tuple[Point, ...],
    Field(min_length=3, max_length=32),
    _must(is_convex, "the corners of a convex polygon, in their order"),
]

Copies = Annotated[
    tuple[Annotated[Whole, Field(ge=1, le=1_000)], Coordinate, Coordinate],
    Worded("[n, dx, dy]: a whole number from 1 to 1000, and a shift"),
]
Repeats = Annotated[tuple[Copies, ...], Worded("one or two copies [[n, dx, dy], ...]")]


def sphere_mass(density: float, radius: float) -> float:
    """Return the mass of a solid sphere, kg."""
    return density * (4.0 / 3.0 * pi) * (radius * radius * radius)


def tonnes_per_hour(text: str) -> float:
    """Read a rate such as "120 t/h"; NaN of other text.

    >>> tonnes_per_hour("120 t/h")
    120.0
    """
    match = re.fullmatch(r" *(\d+\.?\d*(?:[eE][+-]?\d+)?) *t/h *", text)
    return float(match[1]) if match else nan


# A scene resolves both to a number; other code sees only that.
if TYPE_CHECKING:
    Rate = float
    Radius = float
else:
    Radius = Annotated[Amount, OrLeast(SHORTEST)] | Span
    Rate = Annotated[
        Annotated[Number, Field(ge=1e-6, le=1e9)]
        | Annotated[Text, Field(max_length=40), Worded('a text such as "120 t/h"')],
        _must(
            lambda rate: not isinstance(rate, str) or 1e-6 <= tonnes_per_hour(rate) <= 1e6,
            'a number from 1e-06 to 1000000000, or a text such as "120 t/h"',
        ),
    ]


def described(default: Any, what: str, unit: str = "", **limits: Any) -> Any:
    """Describe one key: its default, its definition in a sentence, its unit and its range."""
    return Field(
        default,
        description=f"{what} ({unit})." if unit else f"{what}.",
        json_schema_extra={"x-unit": unit} if unit else None,
        **limits,
    )


def pair_restitution(default: float | None, pair: str) -> Any:
    """Describe the restitution of a pair, such as particle-plate."""
    return described(default, f"Coefficient of restitution of the pair {pair}")


def pair_friction(default: float | None, pair: str) -> Any:
    """Describe the friction of a pair, such as particle-plate."""
    return described(default, f"Coulomb coefficient of friction µ of the pair {pair}")
