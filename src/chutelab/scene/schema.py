"""All tables of a scene file, and the defaults that depend on other tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import sqrt
from typing import Annotated, Any, Final, Self

from pydantic import BeforeValidator, Field, PrivateAttr, model_validator

from chutelab.scene.conflicts import ConflictError, conflicts, stream_name
from chutelab.scene.look import EITHER, JOINTS, Look
from chutelab.scene.materials import Material, Pair, Particle, presets
from chutelab.scene.tables import (
    Conveyor,
    Expect,
    Incoming,
    Joint,
    Live,
    Outgoing,
    Pin,
    Plate,
    Rod,
    Run,
    Sensor,
    Spring,
    Stream,
    String,
    Surface,
    View,
)
from chutelab.scene.units import (
    MOST_EXPECTATIONS,
    MOST_KINDS,
    MOST_SURFACES,
    Amount,
    Angle,
    Gravity,
    Table,
    Text,
    described,
    sphere_mass,
    tonnes_per_hour,
)
from chutelab.util.tables import many

TABLES: Final[dict[str, type[Table]]] = {
    "particle": Particle,
    "material": Material,
    "pair": Pair,
    "incoming": Incoming,
    "plate": Plate,
    "outgoing": Outgoing,
    "conveyor": Conveyor,
    "surface": Surface,
    "string": String,
    "rod": Rod,
    "spring": Spring,
    "pin": Pin,
    "stream": Stream,
    "run": Run,
    "sensor": Sensor,
    "expect": Expect,
    "view": View,
    "live": Live,
}

DEFAULTS: Final = {
    name: {field.alias or key: field.default for key, field in table.model_fields.items()}
    for name, table in TABLES.items()
}
"""Of the keys of each table."""


def _one_or_several(given: object) -> object:
    return (given,) if isinstance(given, Mapping | Table) else given


def _several(default: Any, **limits: Any) -> Any:
    """Return a list of tables, for which the JSON Schema also allows a single table."""

    def either(rule: dict[str, Any]) -> None:
        keys = ("type", "items", "minItems", "maxItems")
        several = {key: rule.pop(key) for key in keys if key in rule}
        rule.pop("default", None)
        rule["anyOf"] = [several["items"], several]

    return Field(default, json_schema_extra=either, **limits)


def _usual() -> Any:
    """Return a table with its defaults, made by the scene's validator."""
    return Field(default_factory=dict, validate_default=True)


Reader = Callable[[Table, str], Any]
"""Returns the value of a key of a table."""


class SceneTables(Table):
    """The tables of a scene, with all defaults that need no geometry."""

    title: Text = described("Untitled scene", "Title of the scene", max_length=200)
    gravity: Gravity = described(9.81, "Gravity g", "m/s²")
    gravity_deg: Angle = described(
        0.0, "Direction of gravity: 0 is down, 90 to the right; not with [incoming]", "degrees"
    )
    air_density: Amount = described(
        0.0,
        "Density of still air; its drag slows particles down as spheres of their radius"
        " (Schiller and Naumann); 0 is no air",
        "kg/m³",
    )
    particles: Annotated[tuple[Particle, ...], BeforeValidator(_one_or_several)] = _several(
        ({},), alias="particle", min_length=1, max_length=MOST_KINDS, validate_default=True
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
    rod: tuple[Rod, ...] = Field((), max_length=MOST_SURFACES)
    spring: tuple[Spring, ...] = Field((), max_length=MOST_SURFACES)
    pin: tuple[Pin, ...] = Field((), max_length=MOST_SURFACES)
    streams: Annotated[tuple[Stream, ...], BeforeValidator(_one_or_several)] = _several(
        ({},), alias="stream", min_length=1, max_length=MOST_KINDS, validate_default=True
    )
    run: Run = _usual()
    sensor: tuple[Sensor, ...] = Field((), max_length=MOST_KINDS)
    expect: tuple[Expect, ...] = Field((), max_length=MOST_EXPECTATIONS)
    view: View | None = None
    live: Live = _usual()

    _source: str = PrivateAttr("<scene>")
    _told: Any = PrivateAttr(None)
    """Data for the core, see `chutelab.machine.builder.told`."""
    _ahead: Any = PrivateAttr(None)
    """Its machine before it is built, see `chutelab.machine.builder.ahead`."""

    @classmethod
    def validated(cls, document: Mapping[str, Any]) -> Self:
        """Return the scene of a document, or raise Pydantic's own ValidationError."""
        scene = cls.__new__(cls)
        Table.__init__(scene, **document)
        return scene

    @classmethod
    def tables(cls) -> dict[str, type[Table]]:
        """Model of each table by its key."""
        return TABLES

    @property
    def particle(self) -> Particle:
        """The kind of particles of the first stream."""
        return self.particles[self.kinds[0]]

    @property
    def plate(self) -> Plate | None:
        """The damping plate."""
        for plate in self.plates:
            if plate.pivot is None:
                return plate
        return None

    @property
    def stream(self) -> Stream:
        """The first stream."""
        return self.streams[0]

    @property
    def kinds(self) -> tuple[int, ...]:
        """Which of the particles each stream consists of."""
        if len(self.particles) == 1:
            return (0,) * len(self.streams)
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
    def scene(self) -> Self:
        """Itself; of a family (`chutelab.scene.variants.Family`) one of its scenes."""
        return self

    def value(self, table: Table, key: str) -> Any:
        """Return the value of a key of one of its tables; an array if it varies in a family."""
        return getattr(table, key)

    def slices(self, number: int = 0, value: Reader = getattr) -> Any:
        """Return the width of a stream's material in slices of one particle's thickness.

        It is the width over the mean diameter of its particles; 1 without a width. Rates of the
        whole material are so many times those of a slice.
        """
        width, particle = value(self.streams[number], "width"), self.particles[self.kinds[number]]
        return 1.0 if width is None else width / (2.0 * value(particle, "radius"))

    @property
    def rate(self) -> Any:
        """Particles per second of the first stream, over its whole width."""
        return self.stream.rate * self.slices()

    @property
    def crowded(self) -> bool:
        """Whether particles meet each other."""
        return self.count > 1 and any(stream.interact for stream in self.streams)

    def met(self, kind: int, other: int | str) -> tuple[float, float]:
        """Return restitution and friction of two kinds of particles, see `meetings`."""
        return self.meetings()(kind, other)

    def passes(self, kind: int, other: int) -> bool:
        """Tell whether two kinds pass through each other."""
        names = {self.particles[kind].name, self.particles[other].name}
        return any(not pair.meet and set(pair.between) == names for pair in self.pair)

    @property
    def cornered(self) -> bool:
        """Whether some kind of particles is a box or a polygon."""
        return any(kind.outline for kind in self.particles)

    @property
    def clings(self) -> bool:
        """Whether there is any cohesion."""
        return any(pair.clings for pair in self.pair)

    @property
    def one_sided(self) -> str | None:
        """The name of a surface that is solid from one side, if any is."""
        return next((one.name for one in self.surface if one.passes), None)

    def cohesion(self, kind: int, other: int | str) -> float:
        """Return the force (N) that it takes to pull a kind off another, or off a surface.

        A bond number gives it in weights of the lighter kind at its mean radius.
        """
        name = other if isinstance(other, str) else self.particles[other].name
        names = {self.particles[kind].name, name}
        pair = next((pair for pair in self.pair if {*pair.between} == names), None)
        if pair is None or not pair.bond_number:
            return 0.0 if pair is None else pair.cohesion
        mass = min(one.mass for one in self.particles if one.name in names)
        return pair.bond_number * (mass * self.gravity)

    def meetings(self, value: Reader = getattr) -> Callable[[int, int | str], tuple[float, float]]:
        """Return a function for restitution and friction of two kinds, or a kind and a surface.

        Values come first from ``[[pair]]``, then from the surface (or a stream of the kind), then
        from the material, then from the default. For two different kinds without a value it is the
        geometric mean of the values of each with itself, a mixing rule that is as good as any.
        """
        tables: dict[str, Any] = {
            "incoming": self.incoming,
            "plate": self.plate,
            "outgoing": self.outgoing,
        }
        tables |= {str(free.name): free for free in self.free}
        pairs: dict[frozenset[str | None], dict[str, float]] = {}
        for pair in self.pair:
            said = {key: value(pair, key) for key in ("restitution", "friction")}
            told = {key: one for key, one in said.items() if one is not None}
            # The first one counts.
            names = frozenset(pair.between)
            pairs[names] = told | pairs.get(names, {})
        # No recursive inner function: only the garbage collector would free it.
        return partial(self._met, value, tables, pairs, {})

    def _met(
        self, value: Reader, tables: Mapping[str, Any],
        pairs: Mapping[frozenset[str | None], dict[str, float]],
        known: dict[tuple[int, int | str], tuple[float, float]], kind: int, other: int | str,
    ) -> tuple[float, float]:  # fmt: skip
        if (kind, other) in known:
            return known[kind, other]
        particle = self.particles[kind]
        with_it: str | None
        if isinstance(other, str):
            with_it, table = other, tables[other]
            steel = isinstance(table, Plate) or (
                isinstance(table, Surface) and table.material == "steel"
            )
            values = self._own(value, particle, (table,), "_steel" if steel else "_rubber")
        elif other == kind:
            with_it, rows = particle.name, zip(self.streams, self.kinds, strict=True)
            own = [stream for stream, its in rows if its == kind]
            values = self._own(value, particle, own or [Stream()])
        else:
            with_it = self.particles[other].name
            mine, theirs = (self._met(value, tables, pairs, known, k, k) for k in (kind, other))
            products: list[Any] = [a * b for a, b in zip(mine, theirs, strict=True)]
            # A power of ½ differs from a square root in the last bit.
            values = tuple(sqrt(p) if isinstance(p, float) else p**0.5 for p in products)
        restitution, friction = values
        said = pairs.get(frozenset((particle.name, with_it)), {}) if pairs else {}
        found = said.get("restitution", restitution), said.get("friction", friction)
        known[kind, other] = found
        return found

    def _own(
        self, value: Reader, particle: Particle, homes: Sequence[Any], column: str = ""
    ) -> Any:
        """Return the value of the tables, else of the material, else the default of the first."""
        if particle.material is None and len(homes) == 1:
            return value(homes[0], "restitution"), value(homes[0], "friction")
        material, values = self._material(particle), []
        for key in ("restitution", "friction"):
            said = [home for home in homes if key in home.model_fields_set]
            # A material does not set the friction of the incoming belt.
            grips = key == "friction" and isinstance(homes[0], Incoming)
            if material is not None and not said and not grips:
                values.append(value(material, key + column))
            else:
                values.append(value((said or homes)[0], key))
        return values

    def _material(self, particle: Particle) -> Any:
        if particle.material is None:
            return None
        own = {material.name: material for material in self.material}
        return own.get(particle.material) or presets()[particle.material].material

    def head(self, table: str, number: int) -> str:
        """Return the path of a particle, plate or stream: with its number if there are several.

        >>> from chutelab.scene import load
        >>> load("perpendicular").head("stream", 0), load("mixture").head("particle", 1)
        ('stream', 'particle[1]')
        """
        return f"{table}[{number}]" if len(getattr(self, EITHER[table])) > 1 else table

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
        """Names of its surfaces, in the order of the ledger."""
        tables = [name for name in ("incoming", "plate", "outgoing") if getattr(self, name)]
        return (*tables, *(str(free.name) for free in self.free))

    @property
    def movers(self) -> dict[str, Plate | Surface]:
        """Surfaces that move, by their names in the ledger."""
        named: list[tuple[str, Plate | Surface]]
        named = [(plate.name or "plate", plate) for plate in self.plates]
        named += [(surface.name, surface) for surface in self.surface]
        return {
            name: one for name, one in named if one.turn or one.shake or one.travel or one.hinge
        }

    @property
    def triggers(self) -> tuple[tuple[str, str, str], ...]:
        """Triggers: a surface, its action, and the surface to be touched."""
        named: list[tuple[str, Any]] = [(one.name or "plate", one) for one in self.plates]
        named += [(one.name, one) for one in self.surface]
        return tuple(
            (name, doing, when.touched)
            for name, one in named
            for doing in ("opens", "closes", "starts")
            if (when := vars(one).get(f"{doing}_when")) is not None
        )

    @property
    def joints(self) -> tuple[tuple[str, Joint], ...]:
        """All strings, rods, springs and pins, with the names of their tables, in this order."""
        return tuple((table, joint) for table in JOINTS for joint in getattr(self, table))

    @property
    def hinges(self) -> bool:
        """Whether there are hinges."""
        return any(one.hinge for one in self.movers.values())

    @property
    def places(self) -> tuple[str, ...]:
        """Names of all that has quantities: surfaces, and ``sensor.NAME`` for sensors.

        ``run.loads`` is among them if it is given.
        """
        sensors = (f"sensor.{sensor.name}" for sensor in self.sensor)
        return (*self.surfaces, *sensors, *["run.loads"] * (self.run.loads is not None))

    def __repr__(self) -> str:
        names = self.surfaces
        surfaces = ", ".join(names) if len(names) <= 6 else f"{len(names):,} surfaces"
        return (
            f"<Scene {self.source}: {self.title}; {many(self.count, 'particle', ',')}, {surfaces}>"
        )

    def __eq__(self, other: object) -> bool:
        # Scenes of the same machine from different files are equal.
        return self.__dict__ == other.__dict__ if isinstance(other, SceneTables) else NotImplemented

    @model_validator(mode="after")
    def _judge_and_fill(self) -> Self:
        faults = list(conflicts(Look(to_dict(self), DEFAULTS)))
        if faults:
            raise ConflictError(faults)
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
            return self
        if self.outgoing is not None and self.outgoing.speed is None:
            outgoing = self.outgoing.model_copy()
            outgoing._fill("speed", self.incoming.speed)
            self._fill("outgoing", outgoing)
        plate = self.plate
        if plate is not None and plate.pivot_height is None:
            filled = plate.model_copy()
            filled._fill("pivot_height", self.incoming.pulley_radius)
            self._fill("plates", tuple(filled if p is plate else p for p in self.plates))
        return self

    def density(self, particle: Particle, value: Reader = getattr) -> Any:
        """Return the density from which the mass of a kind of particles follows, or None."""
        if particle.shape in ("box", "polygon"):
            return None
        material = self._material(particle)
        own = material is None or "mass" in particle.model_fields_set
        return value(particle if own or particle.density is not None else material, "density")

    def _with_mass(self, particle: Particle) -> Particle:
        """Return a kind of particles with its mean radius and the mass at that radius."""
        density, shaped = self.density(particle), particle.shape in ("box", "polygon")
        span: Any = particle.radius
        if density is None and not isinstance(span, tuple) and not shaped:
            return particle
        filled = particle.model_copy()
        if isinstance(span, tuple):
            filled._resolve("radius", 0.5 * (span[0] + span[1]))
        if shaped:
            filled._fill("radius", max(sqrt(x * x + y * y) for x, y in filled.outline))
        if density is not None:
            filled._fill("mass", sphere_mass(density, filled.radius))
        return filled

    def _with_rate(self, stream: Stream, number: int, kind: int) -> Stream:
        """Return a stream with its name, and its rate in particles per second."""
        typed: Any = stream._typed.get("rate", stream.rate)
        if stream.name is not None and not isinstance(typed, str):
            return stream
        filled = stream.model_copy()
        if stream.name is None:
            filled._fill("name", stream_name(number))
        if isinstance(typed, str):
            filled._fill("rate", typed)
            mass = self.particles[kind].mean_of(self.particles[kind].mass)
            filled._resolve("rate", tonnes_per_hour(typed) / 3.6 / mass / self.slices(number))
        return filled


def to_dict(scene: SceneTables, *, defaults: bool = False) -> dict[str, Any]:
    """Return the keys that were set, nested as in the file: `from_dict` makes the scene again.

    A single table is not a list of one. With `defaults`, all keys.
    """
    tables: dict[str, Any] = scene.model_dump(
        by_alias=True, exclude_unset=not defaults, warnings=False
    )
    for key in EITHER:
        if len(rows := tables.get(key, ())) == 1:
            tables[key] = rows[0]
    return tables


def plain_number(value: object) -> object:
    """Return a whole float as an integer, which is accepted for a float, but not vice versa.

    Beyond 2**53 not every integer is a float.
    """
    whole = isinstance(value, float) and value.is_integer() and abs(value) < 2.0**53
    return int(value) if whole else value  # type: ignore[call-overload]
