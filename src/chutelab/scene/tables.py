"""The tables of a scene file as frozen Pydantic models, with their units, ranges and defaults.

Attributes mirror the TOML keys. Angles are degrees here (``_deg``) and nowhere else.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from chutelab.scene.conflicts import UNPROMISED, ConflictError, rules_of
from chutelab.scene.look import Look
from chutelab.scene.units import (
    LARGEST,
    MOST_PARTICLES,
    MOST_PRESETS,
    Amount,
    Angle,
    Box,
    Coordinate,
    Duration,
    Frequency,
    Inertia,
    Keys,
    Length,
    Mass,
    Name,
    Number,
    Point,
    Polyline,
    Ranges,
    Rate,
    Repeats,
    Resolved,
    Share,
    Speed,
    Stiffness,
    Stops,
    Switch,
    Table,
    Text,
    Torque,
    Turn,
    Values,
    Whole,
    Worded,
    described,
    pair_friction,
    pair_restitution,
    read_size,
    tonnes_per_hour,
)


class Incoming(Table):
    """The incoming conveyor and its drive pulley, whose axis is the origin."""

    speed: Speed = described(..., "Belt speed v0", "m/s")
    pulley_radius: Length = described(..., "Radius R of the drive pulley, with the belt", "m")
    length: Length = described(1.0, "Length of belt before the pulley", "m")
    incline_deg: Number = described(
        0.0,
        "Angle β at which the belt rises to the pulley; it ends where it is tangential to it",
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


class Shake(Table):
    """How a surface shakes: by · sin(2π frequency t + phase), at time t of the run."""

    by: Point = described(..., "Amplitude [x, y]", "m")
    frequency: Frequency = described(..., "How often, per second", "Hz")
    phase_deg: Angle = described(0.0, "Phase at t = 0", "degrees")


class Travel(Table):
    """Travel of a surface: constant acceleration for half of the time, then deceleration."""

    to: Point = described(..., "Place [x, y] at which its pivot stops", "m")
    at: Amount = described(0.0, "Time at which it begins", "s")
    in_: Duration = described(..., "Duration", "s", alias="in")


class When(Table):
    """Condition of a trigger."""

    touched: Name = described(..., "Surface that a particle has to touch")


class Motor(Table):
    """Motor of a hinge: it turns at this speed if its torque is sufficient."""

    speed_deg: Turn = described(..., "Speed, counterclockwise", "degrees/s")
    torque: Torque = described(..., "Largest torque", "N m")


class Moving(Table):
    """How a surface moves, or hangs on a hinge."""

    shake: Shake | None = described(
        None, "Vibration about its place: { by = [0, 0.002], frequency = 25 }"
    )
    travel: Travel | None = described(
        None, "Travel of its pivot to a place: { to = [x, y], at = 1, in = 0.5 }"
    )
    turn: Turn = described(
        0.0, "Speed at which it turns about its pivot, counterclockwise", "degrees/s"
    )
    hinge: Point | Literal["pivot"] | None = described(
        None,
        'Hinge on which it hangs freely: [x, y], or its "pivot"; needs a mass or an inertia',
        "m",
    )
    mass: Mass | None = described(
        None, "Mass if it hangs on a hinge, distributed evenly along it", "kg"
    )
    inertia: Inertia | None = described(
        None,
        "Moment of inertia about the hinge; default: from the mass; without a mass it has no"
        " weight",
        "kg m2",
    )
    spring: Amount = described(
        0.0, "Stiffness of a spring at the hinge, which turns it to rest_deg", "N m/rad"
    )
    rest_deg: Angle = described(
        0.0, "Angle from its place as written at which the spring is at rest", "degrees"
    )
    damper: Amount = described(0.0, "Torque of a damper at the hinge per rad/s", "N m s/rad")
    stops_deg: Stops | None = described(
        None,
        "Angles [least, greatest] of its stops; a stop has no restitution",
        "degrees",
    )
    motor: Motor | None = described(None, "Motor at the hinge: { speed_deg = 180, torque = 2 }")
    starts_when: When | None = described(
        None,
        'Trigger of its motion or motor: { touched = "bell" }, a surface; default: at once',
    )


class StillPlate(Table):
    """The keys of a plate except those of its motion, which follow them."""

    name: Name | None = described(None, "Name of a further plate, for events and the ledger")
    pivot: Point | None = described(None, "Pivot [x, y] of a further plate", "m")
    distance: Length = described(
        None,
        "Distance d_okr of the damping plate's pivot from the pulley's leading edge x = R",
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
        "belt, 2.0 m without [outgoing], 0.5 m for a further plate",
        "m",
    )
    restitution: Share = pair_restitution(0.5, "particle-plate")
    friction: Amount = pair_friction(0.0, "particle-plate")


class Plate(Moving, StillPlate):
    """A plate that hangs from a pivot: the damping plate, at a distance, or a further one."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["distance"]}, {"required": ["name", "pivot"]}]}
    )


class Outgoing(Table):
    """The outgoing conveyor's belt."""

    speed: Coordinate = described(
        None, "Belt speed v_dop, may be negative; default: the incoming belt's", "m/s"
    )
    drop: Length = described(..., "Fall to the belt, measured as drop_from says", "m")
    drop_from: Literal["impact", "top"] = described(
        "impact",
        '"impact": drop is d2, the fall of a particle\'s centre from plate impact to landing; '
        '"top": drop is d3, from the top of the pulley (y = R) down to the belt surface',
    )
    start: Coordinate = described(
        -2.0, "World x where the belt begins; it extends forward from there", "m"
    )
    length: Length = described(6.0, "Length of the belt", "m")
    restitution: Share = pair_restitution(0.0, "particle-belt")
    friction: Amount = pair_friction(0.5, "particle-belt")


class Conveyor(Table):
    """A further belt between two pulleys: forward on top, and back below."""

    name: Name = described(..., "Unique name, for events and the ledger")
    from_: Point = described(..., "Axis [x, y] of the first pulley", "m", alias="from")
    to: Point = described(..., "Axis [x, y] of the second pulley", "m")
    pulley_radius: Length = described(0.1, "Radius of both pulleys, with the belt", "m")
    speed: Coordinate = described(
        ..., "Speed on top, from the first to the second pulley; may be negative", "m/s"
    )
    restitution: Share = pair_restitution(0.0, "particle-belt")
    friction: Amount = pair_friction(0.5, "particle-belt")


class StillSurface(Table):
    """The keys of a surface except those of its motion, which follow them, and its copies."""

    name: Name = described(..., "Unique name, for events and the ledger")
    from_: Point | None = described(None, "First end [x, y]", "m", alias="from")
    to: Point | None = described(None, "Second end [x, y]", "m")
    points: Polyline = described(None, "Polyline [[x, y], ...], instead of from and to", "m")
    center: Point | None = described(None, "Centre [x, y] of an arc", "m")
    radius: Length | None = described(None, "Radius of an arc", "m")
    from_deg: Angle = described(
        0.0, "Angle at which an arc begins, counterclockwise from the x axis", "degrees"
    )
    to_deg: Angle = described(
        360.0, "Angle at which an arc ends; less than from_deg if it is clockwise", "degrees"
    )
    restitution: Share = pair_restitution(0.3, "particle-surface")
    friction: Amount = pair_friction(0.4, "particle-surface")
    material: Literal["steel", "rubber"] = described(
        "steel",
        "Values of a particle's material that hold here if none are given",
    )
    speed: Coordinate = described(
        0.0, "Speed from the first to the second end; a belt if it is not 0", "m/s"
    )
    opens_at: Coordinate | None = described(None, "Time at which it vanishes (a gate)", "s")
    closes_at: Coordinate | None = described(None, "Time at which it appears", "s")
    opens_when: When | None = described(
        None, 'Trigger by which it vanishes: { touched = "bell" }, another surface'
    )
    closes_when: When | None = described(
        None, 'Trigger by which it appears: { touched = "bell" }, another surface'
    )
    passes: Literal["up", "down", "left", "right", "in", "out"] | None = described(
        None,
        "Direction in which particles pass through it, while those in the opposite direction are"
        ' stopped, whichever way it is drawn; "in" or "out" for an arc. "up": particles from below'
        " pass, those from above are carried",
    )
    pivot: Point | None = described(
        None,
        "Point [x, y] about which it turns, and which travels; default: its first point, the centre"
        " of an arc",
        "m",
    )


class Surface(Moving, StillSurface):
    """A free surface, two-sided and without thickness: a chute, a hood, a floor, a peg, a gate.

    Straight, given by ``from`` and ``to`` or by ``points``; or an arc, by ``center`` and
    ``radius``. The attribute `points`, ((x, y), ...), always has the points of a straight one, and
    `from_` and `to` are then empty; for an arc it is empty.
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

    repeat: Repeats = described(
        (),
        "Copies [[n, dx, dy], ...]: n copies, each shifted by (dx, dy) m; a second entry repeats"
        " that row. All are one surface",
        max_length=2,
    )

    @model_validator(mode="after")
    def _ends_become_points(self) -> Self:
        given = {name.rstrip("_"): getattr(self, name) for name in self.model_fields_set}
        defaults = {name.rstrip("_"): field.default for name, field in Surface.model_fields.items()}
        look = Look({"surface": given}, {"surface": defaults, "run": {}})
        rules = rules_of(look, "surface", [look.row("surface")])
        if faults := [fault for check in rules for fault in check()]:
            raise ConflictError(faults)
        if self.from_ is not None:
            self._fill("points", (self.from_, self.to))
            self._fill("from_", None)
            self._fill("to", None)
            self.model_fields_set.difference_update({"from_", "to"})
            self.model_fields_set.add("points")
        return self


class Joint(Table):
    """A joint from the centre of a particle to a point, or to another particle; without mass."""

    from_: Point | None = described(None, "Fixed end [x, y]", "m", alias="from")
    particle: Whole = described(0, "Number of the particle, over all streams, from 0", ge=0)
    other: Whole | None = described(
        None, "Number of the particle at the other end, instead of a point", ge=0
    )


class String(Joint):
    """A string: it pulls, or is slack; a particle that pulls it tight loses its speed along it."""

    over: Point | None = described(
        None,
        "Pulley [x, y] over which a string between two particles runs, a point without mass and"
        " friction; not in Pymunk",
        "m",
    )
    length: Length | None = described(
        None, "Length; default: the distance at the particle's release (over the pulley)", "m"
    )


class Rod(Joint):
    """A rod, whose length is the distance at the release; particles that it joins do not meet."""


class Spring(Joint):
    """A spring that pulls and pushes, with a damper."""

    length: Length | None = described(
        None, "Length at rest; default: the distance at the particle's release", "m"
    )
    stiffness: Stiffness = described(..., "Force per m of extension", "N/m")
    damper: Amount = described(0.0, "Force per m/s of extension rate", "N s/m")


class Pin(Joint):
    """A pin that a particle turns about, or that holds two together; they do not meet."""

    from_: Point = described(..., "Place [x, y] of the pin at the release", "m", alias="from")
    other: Whole | None = described(
        None, "Number of the other particle; default: pinned to the ground", ge=0
    )


class Stream(Resolved):
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
    width: Length | None = described(
        None,
        "Width of the material on the belt; rates in t/h and results per time are for this width,"
        " of which a slice one particle thick is simulated; default: for the slice",
        "m",
    )
    start: Amount = described(0.0, "Time at which the first particle is released", "s")
    bed_height: Amount = described(
        0.0, "Centres spread uniformly over this height above the lowest layer", "m"
    )
    speed_spread: Amount = described(
        0.0,
        "Half-width of a uniform distribution around the release speed; with fill (a gas) the"
        " standard deviation of both velocity components, normally distributed",
        "m/s",
    )
    seed: Whole = described(0, "Seed of the random draws", ge=0, le=2**63 - 1)
    at: Point | None = described(
        None, "Release point [x, y] of the lowest layer; default: on the incoming belt's start", "m"
    )
    to: Point | None = described(
        None,
        "Second end of a line from at; each release is at a random place on it, or, without a rate,"
        " all are released at once, evenly spaced",
        "m",
    )
    fill: Box | None = described(
        None,
        "Box [[x, y], [x, y]] that is packed with all particles at once, from below, at rest;"
        " instead of at",
        "m",
    )
    velocity: Point | None = described(
        None, "Release velocity [vx, vy]; default: the incoming belt's", "m/s"
    )
    omega: Number = described(
        0.0, "Spin at the release, counterclockwise; needs spin", "rad/s", ge=-1e6, le=1e6
    )
    angle_deg: Angle = described(
        0.0,
        "Angle by which boxes and polygons are turned at the release, counterclockwise",
        "degrees",
    )
    interact: Switch = described(
        False, "Whether particles meet each other; one stream sets it for all"
    )
    restitution: Share = pair_restitution(0.5, "particle-particle")
    friction: Amount = pair_friction(0.3, "particle-particle")

    @property
    def mass_rate(self) -> float | None:
        """The rate in kg/s, of its whole width, if it was given as a mass per time."""
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
    until: Literal["landed", "settled"] | Duration = described(
        None,
        'Ending: "landed", "settled" or a number of seconds; default: "landed" with [outgoing], '
        'else "settled". A particle 1 m below the lowest surface has left the scene',
        "s",
    )
    max_time: Duration = described(
        30.0, "Longest time after the last release, whatever until says", "s"
    )
    dt: Number = described(
        0.001,
        "Longest step; without it the contact engine takes up to 2 ms if 100 particles or more"
        " meet, as far as hops and overlaps allow",
        "s",
        ge=1e-7,
        le=0.1,
    )
    align: bool = described(
        True,
        "Whether the pymunk engine's steps of a single particle end at contacts, or all last dt",
    )
    loads: Number | None = described(
        None,
        "Width of the bins of time in which loads on surfaces are recorded; default: no loads",
        "s",
        ge=1e-5,
        le=1e3,
    )
    stress: Number | None = described(
        None,
        "Width of the bins of time in which the contact engine records the impulses of lasting"
        " contacts, for the stress of fields; default: none",
        "s",
        ge=1e-5,
        le=1e3,
    )


class Sensor(Table):
    """A line across a stream that counts the particles that pass. Engines ignore it."""

    name: Name = described(..., "Name of the sensor")
    from_: Point = described(
        ...,
        "First end [x, y]; particles from the left of the line count forward",
        "m",
        alias="from",
    )
    to: Point = described(..., "Second end [x, y]", "m")


class View(Table):
    """The window of pictures, film and page, instead of their own choice. Engines ignore it."""

    from_: Point = described(..., "Lower left corner [x, y]", "m", alias="from")
    to: Point = described(..., "Upper right corner [x, y]", "m")


class Preset(Table):
    """A set of values under one name: the Moon, a rough belt."""

    name: Text = described(..., "Name", min_length=1, max_length=40)
    set: Values = described(..., "Keys of the scene, and their values")

    def __hash__(self) -> int:
        # Equal presets need equal hashes, though values may be lists.
        return hash((self.name, *self.set))


Panels = Annotated[
    tuple[Literal["energy", "numbers", "landing", "curves", "tools", "edit", "share"], ...],
    Worded('a list of "energy", "numbers", "landing", "curves", "tools", "edit", "share"'),
]
Presets = Annotated[
    tuple[Preset, ...],
    Field(max_length=MOST_PRESETS),
    Worded('a list of tables such as { name = "Moon", set = { gravity = 1.62 } }'),
]


class Live(Table):
    """Settings of the scene's live page. Engines ignore them."""

    predict: Switch = described(
        False, "Whether path, landing and numbers are hidden until a flag is set and play pressed"
    )
    controls: Keys | None = described(
        None, "Keys of the scene that can be changed in the page; default: all that have a handle"
    )
    panels: Panels | None = described(None, "Panels beside the picture; default: all")
    ranges: Ranges = described({}, "Ranges [from, to] of keys that can be changed")
    presets: Presets = described((), "Buttons, each of which sets some values")

    def __hash__(self) -> int:
        return hash((self.predict, self.controls, self.panels, *self.ranges, *self.presets))


Value = Annotated[Number, Field(ge=-(LARGEST**2), le=LARGEST**2)]
Words = Annotated[Text, Field(max_length=40)]


class Expect(Table):
    """A number that a run of the scene should show, how exactly, and the source."""

    quantity: Text = described(
        ...,
        "Name of a quantity: a symbol of the paper such as x2 or phi1_deg, or a name such as "
        "landing.x (with several particles particles[0].landing.x), landing.x.mean, "
        "ledger.by_surface.outgoing.belt_work",
        max_length=200,
    )
    value: Literal["theory"] | Value = described(
        ...,
        'Expected value, in its unit (SI; degrees for names in _deg), or "theory": that of the '
        "closed form",
    )
    tolerance: Share | Words = described(
        ...,
        "Largest error: a number is relative (0.01 is 1 %) to the value, or to the scale of such "
        'quantities in the scene if that is larger; a string is absolute ("0.5 mm")',
    )
    tolerance_contact: Share | Words | None = described(
        None, 'The same for the contact engine, or "none"; default: tolerance'
    )
    tolerance_pymunk: Share | Words | None = described(
        None, 'The same for the pymunk engine, or "none"; default: tolerance'
    )
    source: Text = described(
        ..., "Source: an equation or a table of the paper, a closed form", max_length=200
    )

    def allowed(self, engine: str) -> tuple[float, str] | None:
        """Return the tolerance for an engine: its size, and its unit ("%" if it is relative).

        None if nothing is promised.
        """
        own = {"contact": self.tolerance_contact, "pymunk": self.tolerance_pymunk}.get(engine)
        tolerance = self.tolerance if own is None else own
        if tolerance == UNPROMISED:
            return None
        return read_size(tolerance) if isinstance(tolerance, str) else (tolerance, "%")
