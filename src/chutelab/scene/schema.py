"""The tables of a scene file as frozen Pydantic models, with their units, ranges and defaults.

Attributes mirror the TOML keys. Angles are degrees here (``_deg``) and nowhere else.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot, pi
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, PrivateAttr, model_validator

from chutelab.scene.materials import PRESETS, Material
from chutelab.scene.rules import EITHER, ConflictError, Expect, Look, conflicts, surface_conflicts
from chutelab.scene.units import (
    MOST_EXPECTATIONS,
    MOST_KINDS,
    MOST_PARTICLES,
    MOST_SURFACES,
    Amount,
    Angle,
    Box,
    Coordinate,
    Corners,
    Name,
    Number,
    Point,
    Polyline,
    Positive,
    Radius,
    Rate,
    Repeats,
    Share,
    Size,
    Switch,
    Table,
    Text,
    Two,
    Whole,
    about_centroid,
    described,
    pair_friction,
    pair_restitution,
    tonnes_per_hour,
)


class Particle(Table):
    """One kind of particles: disks, or mass points with radius 0; boxes and polygons."""

    name: Name | None = described(None, "Name of this kind; needed where there are several")
    shape: Literal["disk", "sphere", "box", "polygon"] = described(
        "disk",
        "What turns, with spin: a disk has I = m r²/2, a sphere 2/5 m r²; boxes and polygons are"
        " for the pymunk engine",
    )
    radius: Radius = described(
        0.0063,
        "Radius r, 0 is a mass point; or [from, to], drawn evenly for each particle, of which the"
        " first has the mean",
        "m",
    )
    size: Size | None = described(None, "Of a box: [width, height]", "m")
    points: Corners | None = described(
        None, "Of a polygon, convex: [[x, y], ...]; it turns about its centroid", "m"
    )
    mass: Positive = described(0.008, "Mass m; or a density, or a material that has one", "kg")
    density: Positive | None = described(
        None, "Instead of a mass: that of a solid sphere of the radius", "kg/m³"
    )
    material: Text | None = described(
        None,
        "Where density, restitution and friction come from, if not given: a name of `chutelab"
        " materials`, or of a [[material]]",
        max_length=40,
    )
    spin: Switch = described(False, "true: it turns freely; false: never turns")
    rolling_friction: Amount = described(
        0.0, "Rolling friction on everything, as the arm of the load over the radius; needs spin"
    )

    @property
    def outline(self) -> tuple[tuple[float, float], ...]:
        """Corners of a box or polygon about its centroid, m; () of what is round."""
        if self.size is not None:
            x, y = 0.5 * self.size[0], 0.5 * self.size[1]
            return ((-x, -y), (x, -y), (x, y), (-x, y))
        return about_centroid(self.points) if self.points is not None else ()

    @property
    def span(self) -> tuple[float, float] | None:
        """The range of its radii, m; None if all are alike."""
        span: tuple[float, float] | None = self._typed.get("radius")  # type: ignore[assignment]
        return span

    @property
    def mean_mass(self) -> float:
        """Mean mass, kg, which goes with the cube of the radius."""
        if self.span is None:
            return self.mass
        low, high = self.span
        return self.mass * 0.5 * (low + high) * (low * low + high * high) / self.radius**3

    @property
    def moment(self) -> float:
        """I/(m r²) of a disk or sphere that turns, 0 of one that does not."""
        return 0.0 if not self.spin else 0.4 if self.shape == "sphere" else 0.5


class Pair(Table):
    """What two meet with, instead of what their tables or materials say."""

    between: Two = described(..., "Two kinds of particles by name, or one and a surface")
    restitution: Share | None = pair_restitution(None, "of these two")
    friction: Amount | None = pair_friction(None, "of these two")


class Incoming(Table):
    """The incoming conveyor and its drive pulley, whose axis is the origin."""

    speed: Amount = described(..., "Belt speed v0", "m/s")
    pulley_radius: Positive = described(..., "Radius R of the drive pulley, with the belt", "m")
    length: Positive = described(1.0, "Length of belt before the pulley", "m")
    incline_deg: Number = described(
        0.0,
        "Angle β at which the belt rises to the pulley, which it meets where it is tangential",
        "degrees",
        ge=-60.0,
        le=60.0,
    )
    friction: Literal["adhesion"] | Amount = described(
        "adhesion",
        'Grip of belt and pulley on a particle: "adhesion" (no slip until separation) or a Coulomb '
        "coefficient µ",
    )
    restitution: Share = pair_restitution(0.0, "particle-belt")


class Plate(Table):
    """A plate that hangs from a pivot: the damping plate, at a distance, or a further one."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["distance"]}, {"required": ["name", "pivot"]}]}
    )

    name: Name | None = described(None, "Name of a further plate, for events and the ledger")
    pivot: Point | None = described(None, "Of a further plate: its pivot [x, y]", "m")
    distance: Positive = described(
        None,
        "Of the damping plate: d_okr, from the pulley's leading edge x = R to the pivot",
        "m",
    )
    angle_deg: Number = described(
        0.0,
        "Angle α from the vertical; positive leans the top back toward the incoming conveyor",
        "degrees",
        gt=-90.0,
        lt=90.0,
    )
    pivot_height: Coordinate = described(
        None, "Height y of the damping plate's pivot; default: the pulley's radius", "m"
    )
    above: Amount = described(0.3, "Length of plate above the pivot, along the plate", "m")
    below: Amount | None = described(
        None,
        "Length of plate below the pivot; default: down to max(0.05 m, 3 r) above the outgoing "
        "belt, 2.0 m without [outgoing]; of a further plate 0.5 m",
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


class Conveyor(Table):
    """A further belt between two pulleys: forward on top, and back below."""

    name: Name = described(..., "Unique name, for events and the ledger")
    from_: Point = Field(
        ..., alias="from", description="Axis [x, y] of the first pulley (m).",
        json_schema_extra={"x-unit": "m"},
    )  # fmt: skip
    to: Point = described(..., "Axis [x, y] of the second pulley", "m")
    pulley_radius: Positive = described(0.1, "Radius of both pulleys, with the belt", "m")
    speed: Coordinate = described(
        ..., "Speed on top, from the first to the second pulley; may be negative", "m/s"
    )
    restitution: Share = pair_restitution(0.0, "particle-belt")
    friction: Amount = pair_friction(0.5, "particle-belt")


class Surface(Table):
    """A free surface, two-sided and without thickness: a chute, a hood, a floor, a peg, a gate.

    Straight, given by ``from`` and ``to`` or by ``points``; or an arc, by ``center`` and
    ``radius``. The attribute `points`, ((x, y), ...), always has the answer of a straight one, and
    `from_` and `to` are empty once it does; of an arc it is empty.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [
                {"required": ["from", "to"]},
                {"required": ["points"]},
                {"required": ["center", "radius"]},
            ]
        }
    )

    name: Name = described(..., "Unique name, for events and the ledger")
    from_: Point | None = Field(
        None, alias="from", description="First end [x, y] (m).", json_schema_extra={"x-unit": "m"}
    )
    to: Point | None = described(None, "Second end [x, y]", "m")
    points: Polyline = described(None, "Instead of from and to: a polyline [[x, y], ...]", "m")
    center: Point | None = described(None, "Of an arc: its centre [x, y]", "m")
    radius: Positive | None = described(None, "Of an arc: its radius", "m")
    from_deg: Angle = described(
        0.0, "Of an arc: where it begins, counterclockwise from the x axis", "degrees"
    )
    to_deg: Angle = described(
        360.0, "Where it ends; less than from_deg if it goes clockwise", "degrees"
    )
    restitution: Share = pair_restitution(0.3, "particle-surface")
    friction: Amount = pair_friction(0.4, "particle-surface")
    material: Literal["steel", "rubber"] = described(
        "steel", "Which of a particle's material's values hold where none are given here"
    )
    speed: Coordinate = described(0.0, "Speed along from -> to; a belt when not 0", "m/s")
    opens_at: Coordinate | None = described(
        None, "When it goes, and what it held falls: a gate", "s"
    )
    closes_at: Coordinate | None = described(None, "When it comes", "s")
    repeat: Repeats = described(
        (),
        "Copies [[n, dx, dy], ...]: n of it, each moved on by (dx, dy) m; a second entry repeats"
        " that row. All are one surface",
        max_length=2,
    )

    @model_validator(mode="after")
    def _ends_become_points(self) -> Self:
        values = {name.rstrip("_"): getattr(self, name) for name in Surface.model_fields}
        given = {name.rstrip("_") for name in self.model_fields_set}
        values = {name: value if name in given else None for name, value in values.items()}
        if faults := list(surface_conflicts("surface", values)):
            raise ConflictError(faults)
        if self.from_ is not None:
            self._fill("points", (self.from_, self.to))
            self._fill("from_", None)
            self._fill("to", None)
            self.model_fields_set.difference_update({"from_", "to"})
            self.model_fields_set.add("points")
        return self


class String(Table):
    """A string without mass from a point to a particle's centre, for the pymunk engine."""

    from_: Point = Field(
        ..., alias="from", description="Fixed end [x, y] (m).", json_schema_extra={"x-unit": "m"}
    )
    particle: Whole = described(0, "Number of the particle, over all streams, from 0", ge=0)
    length: Positive | None = described(
        None, "Length; default: the distance at the particle's release", "m"
    )


class Stream(Table):
    """A stream of particles: how many, of what kind, when, where and how fast they are released."""

    name: Name | None = described(
        None, "Name of the stream; default: stream, then stream2, stream3 ..."
    )
    particle: Text | None = described(
        None, "Name of its kind of particles; default: the first", max_length=40
    )
    count: Whole = described(1, "Number of particles", ge=1, le=MOST_PARTICLES)
    rate: Rate = described(
        200.0,
        'Particles per second, or a text such as "120 t/h"; particle i is released at start +'
        " i / rate",
        "1/s",
    )
    start: Amount = described(0.0, "When the first is released", "s")
    bed_height: Amount = described(
        0.0, "Centres spread uniformly over this height above the lowest layer", "m"
    )
    speed_spread: Amount = described(0.0, "Uniform half-width around the release speed", "m/s")
    seed: Whole = described(0, "Seed of the random draws", ge=0, le=2**63 - 1)
    at: Point | None = described(
        None, "Release point [x, y] of the lowest layer; default: on the incoming belt's start", "m"
    )
    to: Point | None = described(
        None,
        "With at: releases along this line, each anywhere on it, drawn evenly; without a rate all"
        " at once, evenly spaced",
        "m",
    )
    fill: Box | None = described(
        None,
        "Instead of at: a box [[x, y], [x, y]] that is packed with all particles at once, from"
        " below, at rest",
        "m",
    )
    velocity: Point | None = described(
        None, "Release velocity [vx, vy]; default: the incoming belt's", "m/s"
    )
    interact: Switch = described(False, "Particle-particle contacts, of all streams if one says so")
    restitution: Share = pair_restitution(0.5, "particle-particle")
    friction: Amount = pair_friction(0.3, "particle-particle")

    @property
    def mass_rate(self) -> float | None:
        """The rate in kg/s, if it was given as a mass per time."""
        typed = self._typed.get("rate")
        return tonnes_per_hour(typed) / 3.6 if isinstance(typed, str) else None

    @property
    def at_once(self) -> bool:
        """Whether all of its particles are released at once."""
        return self.fill is not None or (
            self.to is not None and "rate" not in self.model_fields_set
        )


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


def _one_or_several(given: object) -> object:
    return (given,) if isinstance(given, Mapping | Table) else given


def _as_either(rule: dict[str, Any]) -> None:
    """Say in the JSON Schema that one table will do for a list of them."""
    several = {
        key: rule.pop(key) for key in ("type", "items", "minItems", "maxItems") if key in rule
    }
    rule.pop("default", None)
    rule["anyOf"] = [several["items"], several]


def _several(default: Any, **limits: Any) -> Any:
    return Field(default, json_schema_extra=_as_either, validate_default=False, **limits)


class Scene(Table):
    """A validated scene, all defaults filled in that need no geometry.

    Of tables of which there may be one or several, `particles`, `plates` and `streams` are all, and
    `particle`, `plate` and `stream` the first ones; of plates that at a distance from the pulley.

    Raises
    ------
    pydantic.ValidationError
        If built directly from bad values; `chutelab.scene.from_dict` says it in words.
    """

    title: Text = described("Untitled scene", "What the scene is called", max_length=200)
    gravity: Amount = described(9.81, "Gravity g, downward", "m/s²")
    particles: Annotated[tuple[Particle, ...], BeforeValidator(_one_or_several)] = _several(
        (Particle(),), alias="particle", min_length=1, max_length=MOST_KINDS
    )
    material: tuple[Material, ...] = Field((), max_length=MOST_KINDS)
    pair: tuple[Pair, ...] = Field((), max_length=MOST_EXPECTATIONS)
    incoming: Incoming | None = None
    plates: Annotated[tuple[Plate, ...], BeforeValidator(_one_or_several)] = _several(
        (), alias="plate", max_length=MOST_SURFACES
    )
    outgoing: Outgoing | None = None
    conveyor: tuple[Conveyor, ...] = Field((), max_length=MOST_SURFACES)
    surface: tuple[Surface, ...] = Field((), max_length=MOST_SURFACES)
    string: tuple[String, ...] = Field((), max_length=MOST_SURFACES)
    streams: Annotated[tuple[Stream, ...], BeforeValidator(_one_or_several)] = _several(
        (Stream(),), alias="stream", min_length=1, max_length=MOST_KINDS
    )
    run: Run = Field(default_factory=Run)
    expect: tuple[Expect, ...] = Field((), max_length=MOST_EXPECTATIONS)

    _source: str = PrivateAttr("<scene>")
    _shape: tuple[int, ...] = PrivateAttr(())

    @classmethod
    def tables(cls) -> dict[str, type[Table]]:
        """Model of each table by its key."""
        tables: tuple[type[Table], ...] = (
            Particle,
            Material,
            Pair,
            Incoming,
            Plate,
            Outgoing,
            Conveyor,
            Surface,
            String,
            Stream,
            Run,
            Expect,
        )
        return {table.__name__.lower(): table for table in tables}

    @property
    def particle(self) -> Particle:
        """The first kind of particles."""
        return self.particles[0]

    @property
    def plate(self) -> Plate | None:
        """The damping plate."""
        return next((plate for plate in self.plates if plate.pivot is None), None)

    @property
    def stream(self) -> Stream:
        """The first stream."""
        return self.streams[0]

    @property
    def kinds(self) -> tuple[int, ...]:
        """Which of the particles each stream consists of."""
        names = [kind.name for kind in self.particles]
        return tuple(
            0 if stream.particle is None else names.index(stream.particle)
            for stream in self.streams
        )

    @property
    def count(self) -> int:
        """Number of particles of all streams."""
        return sum(stream.count for stream in self.streams)

    @property
    def crowded(self) -> bool:
        """Whether particles meet each other."""
        return self.count > 1 and any(stream.interact for stream in self.streams)

    def met(self, kind: int, other: int | str) -> tuple[float, float]:
        """Return restitution and friction of a kind of particles and another kind, or a surface.

        What ``[[pair]]`` says of the two counts first, then what the surface (or a stream of the
        kind) says, then the material, then the default. Of two kinds that nothing is said of it is
        the geometric mean of what each has with itself, a mixing rule that is as good as any.
        """
        values = [self._own(kind, other, key) for key in ("restitution", "friction")]
        return values[0], values[1]

    def _own(self, kind: int, other: int | str, key: str) -> Any:
        particle = self.particles[kind]
        with_it = self.particles[other].name if isinstance(other, int) else other
        for pair in self.pair:
            if set(pair.between) == {particle.name, with_it} and getattr(pair, key) is not None:
                return getattr(pair, key)
        if isinstance(other, int) and other != kind:
            a, b = self._own(kind, kind, key), self._own(other, other, key)
            return (a * b) ** 0.5
        if isinstance(other, int):
            homes: tuple[Table, ...] = tuple(
                stream for stream, its in zip(self.streams, self.kinds, strict=True) if its == kind
            )
            column = ""
        else:
            table = self.surface_table(other)
            homes = (table,)
            steel = isinstance(table, Plate) or (
                isinstance(table, Surface) and table.material == "steel"
            )
            column = "_steel" if steel else "_rubber"
        for home in homes:
            if key in home.model_fields_set:
                return getattr(home, key)
        if isinstance(homes[0] if homes else None, Incoming) and key == "friction":
            return getattr(homes[0], key)
        material = self._material(particle)
        value = None if material is None else getattr(material, key + column)
        if value is not None:
            return value
        return getattr(homes[0], key) if homes else Stream.model_fields[key].default

    def _material(self, particle: Particle) -> Any:
        if particle.material is None:
            return None
        own = {material.name: material for material in self.material}
        return own.get(particle.material) or PRESETS[particle.material].material

    def surface_table(self, name: str) -> Incoming | Plate | Outgoing | Conveyor | Surface:
        """Return the table that a surface is from, by its name."""
        for key in ("incoming", "plate", "outgoing"):
            table: Incoming | Plate | Outgoing | None = getattr(self, key)
            if name == key and table is not None:
                return table
        return next(free for free in self.free if free.name == name)

    @property
    def free(self) -> tuple[Plate | Conveyor | Surface, ...]:
        """Surfaces with names of their own, in the order of the ledger."""
        hanging = tuple(plate for plate in self.plates if plate.pivot is not None)
        return (*hanging, *self.conveyor, *self.surface)

    @property
    def source(self) -> str:
        """The file the scene was read from, or ``<scene>``; for messages."""
        return self._source

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names of its surfaces, as the ledger has them."""
        tables = [name for name in ("incoming", "plate", "outgoing") if getattr(self, name)]
        return (*tables, *(str(free.name) for free in self.free))

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

    def alone(self) -> Scene:
        """Return the scene with its first particle only; nothing is expected of that."""
        tables = as_written(self)
        streams = tables.get("stream", {})
        first = streams[0] if isinstance(streams, tuple) else streams
        changes: dict[str, object] = {
            "stream": {**first, "count": 1, "interact": False},
            "expect": None,
        }
        if self.string:
            held = [row for row in tables["string"] if row.get("particle", 0) == 0]
            changes["string"] = held or None
        return self.with_values(changes)

    def __eq__(self, other: object) -> bool:
        # The same machine from another file is the same scene.
        return self.__dict__ == other.__dict__ if isinstance(other, Scene) else NotImplemented

    @model_validator(mode="after")
    def _judge_and_fill(self) -> Self:
        faults = list(conflicts(Look(as_written(self), Scene)))
        if faults:
            raise ConflictError(faults)
        self._fill_defaults()
        return self

    def _fill_defaults(self) -> None:
        if self.run.until is None:
            run = self.run.model_copy()
            run._fill("until", "landed" if self.outgoing else "settled")
            self._fill("run", run)
        self._fill("particles", tuple(map(self._with_mass, self.particles)))
        self._fill(
            "streams",
            tuple(
                self._with_rate(stream, number, kind)
                for number, (stream, kind) in enumerate(zip(self.streams, self.kinds, strict=True))
            ),
        )
        if self.incoming is None:
            return
        if self.outgoing is not None and self.outgoing.speed is None:
            outgoing = self.outgoing.model_copy()
            outgoing._fill("speed", self.incoming.speed)
            self._fill("outgoing", outgoing)
        plate = self.plate
        if plate is not None and plate.pivot_height is None:
            filled = plate.model_copy()
            filled._fill("pivot_height", self.incoming.pulley_radius)
            self._fill("plates", tuple(filled if p is plate else p for p in self.plates))

    def _with_mass(self, particle: Particle) -> Particle:
        """Return a kind of particles with its mean radius and the mass that goes with that."""
        material = self._material(particle)
        density = particle.density
        if density is None and material is not None and "mass" not in particle.model_fields_set:
            density = material.density
        shaped = particle.shape in ("box", "polygon")
        if shaped:
            density = None
        span: Any = particle.radius
        if density is None and not isinstance(span, tuple) and not shaped:
            return particle
        filled = particle.model_copy()
        if isinstance(span, tuple):
            filled._resolve("radius", 0.5 * (span[0] + span[1]))
        if shaped:
            filled._fill("radius", max(hypot(x, y) for x, y in filled.outline))
        if density is not None:
            filled._fill("mass", density * (4.0 / 3.0 * pi) * filled.radius**3)
        return filled

    def _with_rate(self, stream: Stream, number: int, kind: int) -> Stream:
        """Return a stream with its name, and its rate in particles per second."""
        typed: Any = stream._typed.get("rate", stream.rate)
        if stream.name is not None and not isinstance(typed, str):
            return stream
        filled = stream.model_copy()
        if stream.name is None:
            filled._fill("name", f"stream{number + 1}" if number else "stream")
        if isinstance(typed, str):
            filled._fill("rate", typed)
            mass = self.particles[kind].mean_mass
            filled._resolve("rate", tonnes_per_hour(typed) / 3.6 / mass)
        return filled


def as_written(scene: Scene, *, defaults: bool = False) -> dict[str, Any]:
    """Return the keys that were set, nested as in the file; one table is no list of one.

    With `defaults`, all keys.
    """
    tables: dict[str, Any] = scene.model_dump(
        by_alias=True, exclude_unset=not defaults, warnings=False
    )
    for key in EITHER:
        if len(rows := tables.get(key, ())) == 1:
            tables[key] = rows[0]
    return tables


def plain_number(value: object) -> object:
    """Return a whole float as an integer, which will do for a float, but not the other way round.

    Beyond 2**53 not every integer is a float.
    """
    whole = isinstance(value, float) and value.is_integer() and abs(value) < 2.0**53
    return int(value) if whole else value  # type: ignore[call-overload]
