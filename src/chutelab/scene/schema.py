"""The tables of a scene file as frozen Pydantic models, with their units, ranges and defaults.

Attributes mirror the TOML keys. Angles are degrees here (``_deg``) and nowhere else.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, Self

from pydantic import ConfigDict, Field, PrivateAttr, model_validator

from chutelab.scene.rules import ConflictError, Expect, Look, conflicts, surface_conflicts
from chutelab.scene.units import (
    MOST_EXPECTATIONS,
    MOST_PARTICLES,
    MOST_SURFACES,
    Amount,
    Coordinate,
    Name,
    Number,
    Point,
    Polyline,
    Positive,
    Share,
    Switch,
    Table,
    Text,
    Whole,
    described,
    pair_friction,
    pair_restitution,
)


class Particle(Table):
    """The particles, all alike: disks, or mass points with radius 0."""

    radius: Amount = described(0.0063, "Radius r; 0 is a mass point", "m")
    mass: Positive = described(0.008, "Mass m", "kg")
    spin: Switch = described(False, "true: a free disk, I = m r²/2; false: never turns")


class Incoming(Table):
    """The incoming conveyor and its drive pulley, whose axis is the origin."""

    speed: Amount = described(..., "Belt speed v0", "m/s")
    pulley_radius: Positive = described(..., "Radius R of the drive pulley, with the belt", "m")
    length: Positive = described(1.0, "Length of belt before the pulley's axis", "m")
    friction: Literal["adhesion"] | Amount = described(
        "adhesion",
        'Grip of belt and pulley on a particle: "adhesion" (no slip until separation) or a Coulomb '
        "coefficient µ",
    )
    restitution: Share = pair_restitution(0.0, "particle-belt")


class Plate(Table):
    """The damping plate."""

    distance: Positive = described(
        ..., "d_okr, from the pulley's leading edge x = R to the pivot", "m"
    )
    angle_deg: Number = described(
        0.0,
        "Angle α from the vertical; positive leans the top back toward the incoming conveyor",
        "degrees",
        gt=-90.0,
        lt=90.0,
    )
    pivot_height: Coordinate = described(
        None, "Height y of the pivot; default: the pulley's radius", "m"
    )
    above: Amount = described(0.3, "Length of plate above the pivot, along the plate", "m")
    below: Amount | None = described(
        None,
        "Length of plate below the pivot; default: down to max(0.05 m, 3 r) above the outgoing "
        "belt, 2.0 m without [outgoing]",
        "m",
    )
    restitution: Share = pair_restitution(0.5, "particle-plate")
    friction: Amount = pair_friction(0.0, "particle-plate")


class Outgoing(Table):
    """The outgoing conveyor's belt."""

    speed: Coordinate = described(
        None, "Belt speed v_dop, may be negative; default: the incoming belt's", "m/s"
    )
    drop: Positive = described(..., "Fall to the belt, measured as drop_from says", "m")
    drop_from: Literal["impact", "top"] = described(
        "impact",
        '"impact": drop is d2, the fall of a particle\'s centre from plate impact to landing; '
        '"top": drop is d3, from the top of the pulley (y = R) down to the belt surface',
    )
    start: Coordinate = described(-2.0, "World x where the belt begins; it reaches forward", "m")
    length: Positive = described(6.0, "Length of the belt", "m")
    restitution: Share = pair_restitution(0.0, "particle-belt")
    friction: Amount = pair_friction(0.5, "particle-belt")


class Surface(Table):
    """A free surface, two-sided and without thickness: a chute, a hood, a floor, a ramp.

    Given by ``from`` and ``to`` or by ``points``; the attribute `points`, ((x, y), ...), always has
    the answer, and `from_` and `to` are empty once it does.
    """

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["from", "to"]}, {"required": ["points"]}]}
    )

    name: Name = described(..., "Unique name, for events and the ledger")
    from_: Point | None = Field(
        None, alias="from", description="First end [x, y] (m).", json_schema_extra={"x-unit": "m"}
    )
    to: Point | None = described(None, "Second end [x, y]", "m")
    points: Polyline = described(None, "Instead of from and to: a polyline [[x, y], ...]", "m")
    restitution: Share = pair_restitution(0.3, "particle-surface")
    friction: Amount = pair_friction(0.4, "particle-surface")
    speed: Coordinate = described(0.0, "Speed along from -> to; a belt when not 0", "m/s")

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

    count: Whole = described(1, "Number of particles", ge=1, le=MOST_PARTICLES)
    rate: Number = described(
        200.0, "Particles per second; particle i is released at i / rate", "1/s", ge=1e-6, le=1e9
    )
    bed_height: Amount = described(
        0.0, "Centres spread uniformly over this height above the lowest layer", "m"
    )
    speed_spread: Amount = described(0.0, "Uniform half-width around the release speed", "m/s")
    seed: Whole = described(0, "Seed of the random draws", ge=0, le=2**63 - 1)
    at: Point | None = described(
        None, "Release point [x, y] of the lowest layer; default: on the incoming belt's start", "m"
    )
    velocity: Point | None = described(
        None, "Release velocity [vx, vy]; default: the incoming belt's", "m/s"
    )
    interact: Switch = described(False, "Particle-particle contacts")
    restitution: Share = pair_restitution(0.5, "particle-particle")
    friction: Amount = pair_friction(0.3, "particle-particle")

    @property
    def crowded(self) -> bool:
        """Whether particles meet each other."""
        return self.interact and self.count > 1


class Run(Table):
    """How the scene is simulated, and until when."""

    engine: Literal["auto", "exact", "contact", "pymunk"] = described(
        "auto", '"auto" takes exact where particles do not interact, else contact'
    )
    until: Literal["landed", "settled"] | Positive = described(
        None,
        'Ending: "landed", "settled" or a number of seconds; default: "landed" with [outgoing], '
        'else "settled"',
        "s",
    )
    max_time: Positive = described(
        30.0, "Bound on every ending, counted from the last release", "s"
    )
    dt: Number = described(
        0.001,
        "Step of contacts that last (contact engine), longest step (pymunk engine)",
        "s",
        ge=1e-7,
        le=0.1,
    )
    align: bool = described(
        True, "Whether the pymunk engine's steps of a lone particle end at contacts, or all last dt"
    )


class Scene(Table):
    """A validated scene, all defaults filled in that need no geometry.

    Raises
    ------
    pydantic.ValidationError
        If built directly from bad values; `chutelab.scene.from_dict` says it in words.
    """

    title: Text = described("Untitled scene", "What the scene is called", max_length=200)
    gravity: Amount = described(9.81, "Gravity g, downward", "m/s²")
    particle: Particle = Field(default_factory=Particle)
    incoming: Incoming | None = None
    plate: Plate | None = None
    outgoing: Outgoing | None = None
    surface: tuple[Surface, ...] = Field((), max_length=MOST_SURFACES)
    stream: Stream = Field(default_factory=Stream)
    run: Run = Field(default_factory=Run)
    expect: tuple[Expect, ...] = Field((), max_length=MOST_EXPECTATIONS)

    _source: str = PrivateAttr("<scene>")
    _shape: tuple[int, ...] = PrivateAttr(())

    @classmethod
    def tables(cls) -> dict[str, type[Table]]:
        """Model of each table by its key."""
        tables: tuple[type[Table], ...] = (
            Particle,
            Incoming,
            Plate,
            Outgoing,
            Surface,
            Stream,
            Run,
            Expect,
        )
        return {table.__name__.lower(): table for table in tables}

    @property
    def source(self) -> str:
        """The file the scene was read from, or ``<scene>``; for messages."""
        return self._source

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names of its surfaces, as the ledger has them."""
        tables = [name for name in ("incoming", "plate", "outgoing") if getattr(self, name)]
        return (*tables, *(free.name for free in self.surface))

    @property
    def shape(self) -> tuple[int, ...]:
        """(N,) of a family of scenes, see `chutelab.scene.variants.family`; () of one scene."""
        # As `self._shape`, for which pydantic takes ten times as long.
        private: dict[str, tuple[int, ...]] = self.__pydantic_private__ or {}
        return private.get("_shape", ())

    def with_values(self, values: Mapping[str, object]) -> Scene:
        """Return the scene with other values, validated, and with defaults filled in anew.

        Parameters
        ----------
        values
            By full path, such as ``plate.angle_deg``, ``surface.hood.speed`` or
            ``surface[0].speed``; also whole tables. None takes a key away, so that it has its
            default. A whole float such as 3.0 will do for a whole number.

        Raises
        ------
        SceneError
            With all values that the scene refuses, and those that do not go together.

        Examples
        --------
        >>> from chutelab.scene import load
        >>> load("perpendicular").with_values({"plate.angle_deg": 20.0}).plate.angle_deg
        20.0
        """
        # Here, because `loading` builds on the tables above.
        from chutelab.scene.loading import from_dict, plain, to_dict
        from chutelab.scene.overrides import Override

        overrides = [Override(key, plain_number(plain(value))) for key, value in values.items()]
        return from_dict(to_dict(self), self.source, overrides)

    def __eq__(self, other: object) -> bool:
        # The same machine from another file is the same scene.
        return self.__dict__ == other.__dict__ if isinstance(other, Scene) else NotImplemented

    @model_validator(mode="after")
    def _judge_and_fill(self) -> Self:
        faults = list(conflicts(Look(self.model_dump(by_alias=True, warnings=False), Scene)))
        if faults:
            raise ConflictError(faults)
        self._fill_defaults()
        return self

    def _fill_defaults(self) -> None:
        self._fill_table("run", "until", "landed" if self.outgoing else "settled")
        if self.incoming:
            self._fill_table("plate", "pivot_height", self.incoming.pulley_radius)
            self._fill_table("outgoing", "speed", self.incoming.speed)

    def _fill_table(self, table: str, key: str, value: object) -> None:
        given = getattr(self, table)
        if given is not None and getattr(given, key) is None:
            filled = given.model_copy()
            filled._fill(key, value)
            self._fill(table, filled)


def plain_number(value: object) -> object:
    """Return a whole float as an integer, which will do for a float, but not the other way round.

    Beyond 2**53 not every integer is a float.
    """
    whole = isinstance(value, float) and value.is_integer() and abs(value) < 2.0**53
    return int(value) if whole else value  # type: ignore[call-overload]
