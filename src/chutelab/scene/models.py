"""The tables of a scene file as frozen Pydantic models, with their units, ranges and defaults.

Attributes mirror the TOML keys. Angles are degrees here (``_deg``) and nowhere else. Numbers are
strict: a TOML integer will do for a float, but neither a boolean nor a string; NaN and infinity
are refused. Every quantity has an upper bound, so that a slip of the keyboard is refused instead of
overflowing, or of filling the memory, far from its cause.
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Annotated, Any, Final, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PrivateAttr,
    WithJsonSchema,
    model_validator,
)

from chutelab.scene.rules import ConflictError, Look, conflicts, surface_conflicts

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


def _key(default: Any, what: str, unit: str = "", **limits: Any) -> Any:
    """Describe one key: its default, its definition in a sentence, its unit and its range."""
    return Field(
        default,
        description=f"{what}, {unit}." if unit else f"{what}.",
        json_schema_extra={"x-unit": unit} if unit else None,
        **limits,
    )


def _size(default: Any, what: str) -> Any:
    return _key(default, what, "m", gt=0.0, le=LARGEST)


def _restitution(default: float, pair: str) -> Any:
    return _key(default, f"Coefficient of restitution of the pair {pair}", ge=0.0, le=1.0)


def _friction(default: float, pair: str) -> Any:
    return _key(default, f"Coulomb coefficient of friction µ of the pair {pair}")


class Table(BaseModel):
    """What all tables share: frozen, and strangers refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    def _fill(self, key: str, value: object) -> None:
        # A default that depends on another key: not counted among the keys that were set, so that
        # a scene taken apart and changed gets it anew.
        object.__setattr__(self, key, value)


class Particle(Table):
    """The particles, all alike: disks, or mass points with radius 0."""

    radius: Number = _key(0.004, "Radius r; 0 is a mass point", "m", ge=0.0, le=LARGEST)
    mass: Number = _key(0.008, "Mass m", "kg", gt=0.0, le=LARGEST)
    spin: Switch = _key(False, "true: a free disk, I = m r²/2; false: never turns")


class Incoming(Table):
    """The incoming conveyor and its drive pulley, whose axis is the origin."""

    speed: Number = _key(..., "Belt speed v0", "m/s", ge=0.0, le=LARGEST)
    pulley_radius: Number = _size(..., "Radius R of the drive pulley, with the belt")
    length: Number = _size(1.0, "Length of belt before the pulley's axis")
    friction: Literal["adhesion"] | Friction = _key(
        "adhesion",
        'Grip of belt and pulley on a particle: "adhesion" (no slip until separation) or a Coulomb '
        "coefficient µ",
    )
    restitution: Number = _restitution(0.0, "particle-belt")


class Plate(Table):
    """The damping plate."""

    distance: Number = _size(..., "d_okr, from the pulley's leading edge x = R to the pivot")
    angle_deg: Number = _key(
        0.0,
        "Angle α from the vertical; positive leans the top back toward the incoming conveyor",
        "degrees",
        gt=-90.0,
        lt=90.0,
    )
    pivot_height: Number = _key(
        None, "Height y of the pivot; default: the pulley's radius", "m", ge=-LARGEST, le=LARGEST
    )
    above: Number = _key(
        0.3, "Length of plate above the pivot, along the plate", "m", ge=0.0, le=LARGEST
    )
    below: Number | None = _key(
        None,
        "Length of plate below the pivot; default: down to max(0.05 m, 3 r) above the outgoing "
        "belt, 2.0 m without [outgoing]",
        "m",
        ge=0.0,
        le=LARGEST,
    )
    restitution: Number = _restitution(0.5, "particle-plate")
    friction: Friction = _friction(0.0, "particle-plate")


class Outgoing(Table):
    """The outgoing conveyor's belt."""

    speed: Number = _key(
        None,
        "Belt speed v_dop, may be negative; default: the incoming belt's",
        "m/s",
        ge=-LARGEST,
        le=LARGEST,
    )
    drop: Number = _size(..., "Fall to the belt, measured as drop_from says")
    drop_from: Literal["impact", "top"] = _key(
        "impact",
        '"impact": drop is d2, the fall of a particle\'s centre from plate impact to landing; '
        '"top": drop is d3, from the top of the pulley (y = R) down to the belt surface',
    )
    start: Coordinate = _key(-2.0, "World x where the belt begins; it reaches forward", "m")
    length: Number = _size(6.0, "Length of the belt")
    restitution: Number = _restitution(0.0, "particle-belt")
    friction: Friction = _friction(0.5, "particle-belt")


class Surface(Table):
    """A free surface, two-sided and without thickness: a chute, a hood, a floor, a ramp.

    Given by ``from`` and ``to`` or by ``points``; the attribute `points`, ((x, y), ...), always has
    the answer, and `from_` and `to` are empty once it does.
    """

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["from", "to"]}, {"required": ["points"]}]}
    )

    name: Name = _key(..., "Unique name, for events and the ledger")
    from_: Point | None = Field(None, alias="from", description="First end [x, y], m.")
    to: Point | None = _key(None, "Second end [x, y]", "m")
    points: Polyline = _key(None, "Instead of from and to: a polyline [[x, y], ...]", "m")
    restitution: Number = _restitution(0.3, "particle-surface")
    friction: Friction = _friction(0.4, "particle-surface")
    speed: Number = _key(
        0.0,
        "Speed along from -> to; a belt when not 0",
        "m/s",
        ge=-LARGEST,
        le=LARGEST,
    )

    @model_validator(mode="after")
    def _ends_become_points(self) -> Self:
        values = {"from": self.from_, "to": self.to, "points": self.points}
        if faults := list(surface_conflicts("surface", values)):
            raise ConflictError(faults)
        if self.from_ is not None:
            self._fill("points", (self.from_, self.to))
            self._fill("from_", None)
            self._fill("to", None)
            self.model_fields_set.difference_update({"from_", "to"})
            self.model_fields_set.add("points")
        return self


class Stream(Table):
    """The stream of particles: how many, when, where and how fast they are released."""

    count: Whole = _key(1, "Number of particles", ge=1, le=MOST_PARTICLES)
    rate: Number = _key(
        200.0, "Particles per second; particle i is released at i / rate", "1/s", ge=1e-6, le=1e9
    )
    bed_height: Number = _key(
        0.0,
        "Centres spread uniformly over this height above the lowest layer",
        "m",
        ge=0.0,
        le=LARGEST,
    )
    speed_spread: Number = _key(
        0.0, "Uniform half-width around the release speed", "m/s", ge=0.0, le=LARGEST
    )
    seed: Whole = _key(0, "Seed of the random draws", ge=0, le=2**63 - 1)
    at: Point | None = _key(
        None,
        "Release point [x, y] of the lowest layer; default: on the incoming belt's start",
        "m",
    )
    velocity: Point | None = _key(
        None, "Release velocity [vx, vy]; default: the incoming belt's", "m/s"
    )
    interact: Switch = _key(False, "Particle-particle contacts")
    restitution: Number = _restitution(0.5, "particle-particle")
    friction: Friction = _friction(0.3, "particle-particle")


class Run(Table):
    """How the scene is simulated, and until when."""

    engine: Literal["auto", "exact", "pymunk"] = _key(
        "auto", '"auto" takes exact where particles do not interact, else pymunk'
    )
    until: Literal["landed", "settled"] | Duration = _key(
        None,
        'Ending: "landed", "settled" or a number of seconds; default: "landed" with [outgoing], '
        'else "settled"',
        "s",
    )
    max_time: Duration = _key(30.0, "Bound on every ending, counted from the last release", "s")
    dt: Number = _key(0.001, "Longest step of the pymunk engine", "s", ge=1e-7, le=0.1)


class Scene(Table):
    """A validated scene, all defaults filled in that need no geometry.

    Raises
    ------
    pydantic.ValidationError
        If built directly from bad values; `chutelab.scene.from_dict` says it in words.
    """

    title: Text = _key("Untitled scene", "What the scene is called", max_length=200)
    gravity: Number = _key(9.81, "Gravity g, downward", "m/s²", ge=0.0, le=LARGEST)
    particle: Particle = Field(default_factory=Particle)
    incoming: Incoming | None = None
    plate: Plate | None = None
    outgoing: Outgoing | None = None
    surface: tuple[Surface, ...] = Field((), max_length=MOST_SURFACES)
    stream: Stream = Field(default_factory=Stream)
    run: Run = Field(default_factory=Run)

    _source: str = PrivateAttr("<scene>")

    @classmethod
    def tables(cls) -> dict[str, type[Table]]:
        """Model of each table by its key."""
        return {
            "particle": Particle,
            "incoming": Incoming,
            "plate": Plate,
            "outgoing": Outgoing,
            "surface": Surface,
            "stream": Stream,
            "run": Run,
        }

    @property
    def source(self) -> str:
        """The file the scene was read from, or ``<scene>``; for messages."""
        return self._source

    @model_validator(mode="after")
    def _judge_and_fill(self) -> Self:
        faults = list(conflicts(Look(self.model_dump(by_alias=True, warnings=False), Scene)))
        if faults:
            raise ConflictError(faults)
        self._fill_table("run", "until", "landed" if self.outgoing else "settled")
        if self.incoming:
            self._fill_table("plate", "pivot_height", self.incoming.pulley_radius)
            self._fill_table("outgoing", "speed", self.incoming.speed)
        return self

    def _fill_table(self, table: str, key: str, value: object) -> None:
        given = getattr(self, table)
        if given is not None and getattr(given, key) is None:
            filled = given.model_copy()
            filled._fill(key, value)
            self._fill(table, filled)
