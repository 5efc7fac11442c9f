"""What no single key can answer for: conflicts between keys, and between tables.

Every rule is written so that it speaks only when a comparison is *true*. A `Look` answers NaN for
a key that is itself at fault, and nothing is true of NaN: so the rules can be asked about a
half-broken scene, and all faults of a file come out in one message.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, Final

from chutelab.scene.materials import presets
from chutelab.scene.quantities import REGISTRY, lookup, suggestion, whose
from chutelab.scene.units import (
    LIGHTEST,
    MOST_PARTICLES,
    MOST_PIECES,
    SHORTEST,
    apart,
    read_size,
    sphere_mass,
    write_size,
)
from chutelab.util.errors import MISSING, Fault, did_you_mean
from chutelab.util.trig import RADIANS, sin_cos

THEORY: Final = "theory"
UNPROMISED: Final = "none"
"""What an expectation may have for its value and for a tolerance."""

ON_BELT: Final = 1e-9
"""How near to the belt's height R + r a release counts as lying on the belt, m."""


class ConflictError(ValueError):
    """Carries the faults of a rule through Pydantic's validation."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__("; ".join(str(fault) for fault in faults))
        self.faults = list(faults)


EITHER: Final = {"particle": "particles", "plate": "plates", "stream": "streams"}
"""Tables of which a file has one, ``[stream]``, or several, ``[[stream]]``; all of them in code."""

ALWAYS: Final = ("particle", "stream", "run")
"""Tables that a scene has without writing them."""

NO_MACHINE: Final = ("expect", "view", "live")
"""Tables that say nothing of the machine."""

LEAST_VIEW: Final = 1e-6
"""Least width and height of a ``[view]``, m: less is not told apart far from the origin."""

LIST: Final = (list, tuple)

SURFACES: Final = ("plate", "conveyor", "surface")
"""Lists of tables that are surfaces with names of their own."""


class Look:
    """Read-only look at a scene's tables, as its file has them or as it dumps them, sound or not.

    `defaults` has those of the keys of each table; `faulty` holds the full paths that are already
    known to be at fault, `asked` the keys whose values were asked for: the rules can depend on no
    others. Of tables of which there may be several, a key is that of the first unless a row says
    otherwise, a number from 0.
    """

    def __init__(
        self,
        document: Mapping[str, Any],
        defaults: Mapping[str, Mapping[str, Any]],
        faulty: Collection[str] = (),
    ) -> None:
        self._document = document
        self._defaults = defaults
        self._faulty = faulty
        self.asked: set[str] = set()

    def sound(self, path: str) -> bool:
        """Whether neither the key, nor its table, nor anything inside it is at fault."""
        return not self._faulty or not any(
            f == path
            or f.startswith((path + ".", path + "["))
            or path.startswith((f + ".", f + "["))
            for f in self._faulty
        )

    def has(self, table: str) -> bool:
        """Whether the table is there, sound or not; one that is only misspelt is at fault."""
        return self._document.get(table) not in (None, (), []) or table in self._faulty

    def rows(self, table: str) -> int:
        """Return how many there are of a table of which there may be several."""
        found = self._document.get(table)
        return len(found) if isinstance(found, LIST) else int(isinstance(found, dict))

    def path(self, table: str, key: str = "", row: int = 0) -> str:
        """Return the full path of a key, or of a table."""
        several = isinstance(self._document.get(table), LIST)
        head = f"{table}[{row}]" if several else table
        return f"{head}.{key}" if key else head

    def given(self, table: str, key: str, row: int = 0) -> bool:
        """Whether the key is written out, sound or not."""
        return self._content(table, row).get(key) is not None

    def __call__(self, table: str, key: str, row: int = 0) -> Any:
        """Return the value of a key, or its default; NaN if it is at fault or its table absent."""
        path = self.path(table, key, row)
        self.asked.add(path)
        if self._faulty and not self.sound(path):
            return math.nan
        value = self._content(table, row).get(key)
        if value is not None:
            return value
        if table not in ALWAYS and not self.has(table):
            return math.nan
        return self._defaults[table][key]

    def several(self, key: str) -> list[Any]:
        """Return a list of tables such as ``[[surface]]``, as far as it is one at all."""
        found = self._document.get(key)
        return list(found) if isinstance(found, LIST) else []

    def _content(self, table: str, row: int) -> dict[str, Any]:
        """Return the keys of a table, none of what is no table."""
        found = self._document.get(table)
        if isinstance(found, dict):
            return {} if row else found
        found = found[row] if isinstance(found, LIST) and row < len(found) else None
        return found if isinstance(found, dict) else {}


def conflicts(look: Look) -> Iterator[Fault]:
    """Yield every conflict between keys; each names all the keys concerned."""
    yield from _tables(look)
    yield from _names(look)
    for row in range(max(1, look.rows("particle"))):
        yield from _kind(look, row)
    yield from _engine(look)
    for row in range(max(1, look.rows("stream"))):
        yield from _release(look, row)
    for row in range(look.rows("plate")):
        yield from _plate(look, row)
    for row, surface in enumerate(look.several("surface")):
        if isinstance(surface, Mapping):
            path = f"surface[{row}]"
            known = {
                key: value if look.sound(f"{path}.{key}") else math.nan
                for key, value in surface.items()
            }
            yield from surface_conflicts(path, known)
    for row, conveyor in enumerate(look.several("conveyor")):
        path = f"conveyor[{row}]"
        if (
            isinstance(conveyor, Mapping)
            and look.sound(path)
            and not apart(conveyor["from"], conveyor["to"])
        ):
            yield Fault(f"{path}.to", conveyor["to"], _differ(path))
    yield from _pieces(look)
    yield from _strings(look)
    yield from _expectations(look)
    low, high = look("view", "from"), look("view", "to")
    corners = isinstance(low, LIST) and isinstance(high, LIST)
    if corners and any(b - a < LEAST_VIEW for a, b in zip(low, high, strict=True)):
        text = f"must lie right of view.from = {list(low)} and above it, by 1e-6 m at least"
        yield Fault("view.to", list(high), text)


def _tables(look: Look) -> Iterator[Fault]:
    damps = any(look.given("plate", "distance", row) for row in range(look.rows("plate")))
    damps |= look.has("plate") and not look.rows("plate")
    needy = ["[plate]"] * damps + ["[outgoing]"] * look.has("outgoing")
    if needy and not look.has("incoming"):
        need = "needs" if len(needy) == 1 else "need"
        yield Fault("incoming", MISSING, f"{' and '.join(needy)} {need} the table [incoming]")
    if look("outgoing", "drop_from") == "impact" and not (damps or _broken_plate(look)):
        text = 'needs the table [plate]; without one write outgoing.drop_from = "top"'
        yield Fault("outgoing.drop_from", "impact", text)
    if look("run", "until") == "landed" and not look.has("outgoing"):
        text = 'needs the table [outgoing]; without one "settled" or a number of seconds'
        yield Fault("run.until", "landed", text)


def _broken_plate(look: Look) -> bool:
    """Whether there is a plate that lacks what would tell of which sort it is."""
    return any(not look.given("plate", "pivot", row) for row in range(look.rows("plate")))


def _names(look: Look) -> Iterator[Fault]:
    """Say which names are there twice, or missing, or lead nowhere."""
    surfaces: dict[object, str] = {}
    for table in (*SURFACES, "particle", "stream", "material"):
        known = surfaces if table in SURFACES else {}
        for row in range(look.rows(table)):
            name = look(table, "name", row)
            if name is None and table != "particle":
                continue
            path = look.path(table, "name", row)
            if not isinstance(name, str):
                if table == "particle" and look.rows(table) > 1 and look.sound(path):
                    yield Fault(path, MISSING, "a name; needed where there are several kinds")
                continue
            if name in known:
                yield Fault(path, name, f"must be unique; {known[name]} is the same")
            known.setdefault(name, path)
            if table == "particle" and name in surfaces:
                yield Fault(path, name, f"must be unique; {surfaces[name]} is the same")
    kinds = [look("particle", "name", row) for row in range(look.rows("particle"))]
    for row in range(look.rows("stream")):
        name = look("stream", "particle", row)
        if isinstance(name, str) and name not in kinds and look.sound("particle"):
            allowed = did_you_mean(
                name, [k for k in kinds if isinstance(k, str)], _there_are(kinds)
            )
            yield Fault(look.path("stream", "particle", row), name, f"no such kind; {allowed}")
    own = [m.get("name") for m in look.several("material") if isinstance(m, Mapping)]
    for row in range(look.rows("particle")):
        name = look("particle", "material", row)
        if isinstance(name, str) and look.sound("material") and name not in (*own, *presets()):
            there = [n for n in own if isinstance(n, str)] + list(presets())
            allowed = did_you_mean(name, there, "`chutelab materials` lists them")
            yield Fault(
                look.path("particle", "material", row), name, f"no such material; {allowed}"
            )
    tables = [table for table in ("incoming", "plate", "outgoing") if look.has(table)]
    anything = [n for n in (*kinds, *surfaces, *tables) if isinstance(n, str)]
    # Skip checks of references if names are invalid.
    if not all(map(look.sound, ("particle", *SURFACES))):
        return
    for row, pair in enumerate(look.several("pair")):
        between = pair.get("between") if isinstance(pair, Mapping) else None
        if not (isinstance(between, list | tuple) and look.sound(f"pair[{row}]")):
            continue
        if not any(name in kinds for name in between):
            text = f"one of them must be the name of a [[particle]]; {_there_are(kinds)}"
            yield Fault(f"pair[{row}].between", list(between), text)
        for place, name in enumerate(between):
            if name not in anything:
                allowed = did_you_mean(str(name), anything, _there_are(anything))
                yield Fault(
                    f"pair[{row}].between[{place}]", name, f"no such kind or surface; {allowed}"
                )


def _there_are(names: Iterable[object]) -> str:
    known = [name for name in names if isinstance(name, str)]
    return f"there are {', '.join(known)}" if known else "none has a name"


def _kind(look: Look, row: int) -> Iterator[Fault]:
    """Say what is wrong with a kind of particles."""

    def path(key: str) -> str:
        return look.path("particle", key, row)

    shape, radius = look("particle", "shape", row), look("particle", "radius", row)
    spin = look("particle", "spin", row)
    density, shaped = look("particle", "density", row), shape in ("box", "polygon")
    if look.given("particle", "mass", row) and look.given("particle", "density", row):
        yield Fault(path("density"), density, f"give either {path('mass')} or this, not both")
    if radius == 0.0 and not shaped:
        if spin is True:
            text = f"{path('radius')} is 0, and a mass point cannot turn"
            yield Fault(path("spin"), True, text)
        if look.given("particle", "density", row):
            yield Fault(path("density"), density, f"{path('radius')} is 0: give a mass")
        if look.given("particle", "material", row) and not look.given("particle", "mass", row):
            yield Fault(path("mass"), MISSING, f"kg, because {path('radius')} is 0")
    elif not shaped:
        yield from _lightness(look, row)
    if look("particle", "rolling_friction", row) > 0.0 and spin is False and not shaped:
        text = f"needs {path('spin')} = true: what never turns never rolls"
        yield Fault(path("rolling_friction"), look("particle", "rolling_friction", row), text)
    for key, needed in (("size", "box"), ("points", "polygon")):
        if shape == needed and not look.given("particle", key, row) and look.sound(path(key)):
            what = "[width, height]" if key == "size" else "its corners [[x, y], ...]"
            yield Fault(path(key), MISSING, f"{what}, m; a {needed} needs them")
        elif look.given("particle", key, row) and shape != needed and look.sound(path("shape")):
            text = f'is for {path("shape")} = "{needed}"'
            yield Fault(path(key), look("particle", key, row), text)
    if shaped:
        for key in ("radius", "density"):
            if look.given("particle", key, row):
                text = f"is for what is round; a {shape} has a mass, and a size of its own"
                yield Fault(path(key), look("particle", key, row), text)


def _lightness(look: Look, row: int) -> Iterator[Fault]:
    """Say if a density makes a kind of particles lighter than anything."""
    key, density = "density", look("particle", "density", row)
    if density is None and not look.given("particle", "mass", row):
        key, name = "material", look("particle", "material", row)
        own = [m for m in look.several("material") if isinstance(m, Mapping) and name is not None]
        found = [m.get("density") for m in own if m.get("name") == name]
        if not found and isinstance(name, str) and name in presets():
            found = [presets()[name].material.density]
        density = found[0] if found and look.sound("material") else None
    radius = look("particle", "radius", row)
    if isinstance(radius, LIST):
        radius = 0.5 * sum(radius)
    if density is not None and sphere_mass(density, radius) < LIGHTEST:
        path = look.path("particle", key, row)
        text = f"with {look.path('particle', 'radius', row)} = {radius:g} m a mass of at least"
        mass = sphere_mass(density, radius)
        yield Fault(path, look("particle", key, row), f"{text} {LIGHTEST:g} kg, not {mass:.3g} kg")


def _engine(look: Look) -> Iterator[Fault]:
    engine = look("run", "engine")
    streams, kinds = max(1, look.rows("stream")), max(1, look.rows("particle"))
    counts = [look("stream", "count", row) for row in range(streams)]
    sizes = [look("particle", "radius", row) for row in range(kinds)]
    for row in range(kinds):
        path = look.path("particle", "radius", row)
        shape = look("particle", "shape", row)
        if shape in ("box", "polygon"):
            if engine in ("exact", "contact"):
                text = f'{look.path("particle", "shape", row)} = "{shape}" needs pymunk'
                yield Fault("run.engine", engine, text)
        elif sizes[row] == 0.0:
            if any(size != 0.0 for size in sizes if size is not math.nan):
                text = "more than 0, or 0 of all kinds: no engine has points beside disks"
                yield Fault(path, 0.0, text)
            if engine in ("contact", "pymunk"):
                text = f"{path} is 0, and {engine} needs disks (> 0)"
                yield Fault("run.engine", engine, text)
            for stream in range(streams):
                if look("stream", "interact", stream) is True:
                    text = f"{path} is 0, and mass points never meet"
                    yield Fault(look.path("stream", "interact", stream), True, text)
    for row in range(streams):
        if look("stream", "interact", row) is True and engine == "exact" and sum(counts) > 1:
            path = look.path("stream", "interact", row)
            many = f"{look.path('stream', 'count', row)} = {counts[row]}"
            text = f"{path} with {many} needs contact or pymunk"
            yield Fault("run.engine", engine, text)
    if sum(counts) > MOST_PARTICLES:
        text = f"at most {MOST_PARTICLES} particles in all streams together, not {sum(counts)}"
        yield Fault(look.path("stream", "count", counts.index(max(counts))), max(counts), text)
    if look.several("string") and engine in ("exact", "contact"):
        yield Fault("run.engine", engine, "string[0] needs pymunk")


def _release(look: Look, row: int) -> Iterator[Fault]:
    """Say what is wrong with where and how fast a stream is released."""

    def path(key: str) -> str:
        return look.path("stream", key, row)

    def given(key: str) -> bool:
        return look.given("stream", key, row)

    start, until = look("stream", "start", row), look("run", "until")
    if isinstance(until, int | float) and start >= until:
        text = f"less than run.until = {until:g} s, when the run ends: nothing would be released"
        yield Fault(path("start"), start, text)
    fills = given("fill")
    for key in ("at", "to", "rate", "bed_height", "speed_spread"):
        if fills and given(key):
            text = f"{path('fill')} releases all at once in its box"
            yield Fault(path(key), look("stream", key, row), text)
    if given("to") and not (given("at") or fills):
        yield Fault(path("at"), MISSING, f"a point [x, y], m, to go with {path('to')}")
    if given("to") and given("bed_height"):
        text = f"is a height above a point; {path('to')} makes a line of it"
        yield Fault(path("bed_height"), look("stream", "bed_height", row), text)
    kind = _kind_of(look, row)
    if (
        given("width")
        and look.sound(path("width"))
        and look.sound(look.path("particle", "radius", kind))
    ):
        width, radius = look("stream", "width", row), look("particle", "radius", kind)
        size = sum(radius) if isinstance(radius, list | tuple) else 2.0 * radius
        if look("particle", "shape", kind) in ("box", "polygon") or size == 0.0:
            text = "is for disks and spheres: the slice that is simulated is as thick as they are"
            yield Fault(path("width"), width, text)
        elif width < size:
            text = f"must be at least the diameter of a particle, {size:g} m: one slice"
            yield Fault(path("width"), width, text)
    if not look.has("incoming"):
        for key, what in (("at", "release point [x, y], m"), ("velocity", "[vx, vy], m/s")):
            if not given(key) and not fills and look.sound(path(key)):
                yield Fault(path(key), MISSING, f"{what}; required without [incoming]")
        return
    on_belt = not given("at") and not fills
    if given("at") and look.sound(path("at")) and not given("to"):
        x, y = look("stream", "at", row)
        radius = look("particle", "radius", kind)
        if isinstance(radius, list | tuple):
            radius = 0.5 * sum(radius)
        height = look("incoming", "pulley_radius") + radius
        on_belt = beside(x, y, height, look("incoming", "length"), look("incoming", "incline_deg"))
    if look("incoming", "friction") != "adhesion" or not on_belt:
        return
    advice = 'incoming.friction = "adhesion" releases every particle at incoming.speed'
    if look("stream", "speed_spread", row) > 0.0:
        text = f"{advice}; give a Coulomb coefficient, or speed_spread = 0"
        yield Fault(path("speed_spread"), look("stream", "speed_spread", row), text)
    if given("velocity") and look.sound(path("velocity")):
        velocity, speed = look("stream", "velocity", row), look("incoming", "speed")
        sine, cosine = sin_cos(look("incoming", "incline_deg") * RADIANS)
        wanted = speed * cosine, speed * sine
        if any(abs(v - w) > 1e-12 * abs(speed) for v, w in zip(velocity, wanted, strict=True)):
            text = f"{advice}; give a Coulomb coefficient, or leave the velocity out"
            yield Fault(path("velocity"), velocity, text)


def _kind_of(look: Look, stream: int) -> int:
    """Return the row of a stream's kind of particles, the first if that is not to be found."""
    name = look("stream", "particle", stream)
    rows = range(look.rows("particle"))
    return next((row for row in rows if look("particle", "name", row) == name), 0)


def beside(x: float, y: float, height: float, length: float, incline_deg: float) -> bool:
    """Tell whether a point (m) lies on the incoming belt, at a height above the pulley's axis.

    The height is the pulley's radius and the particle's, m; the belt rises by the angle to where it
    is tangential to the pulley.
    """
    sine, cosine = sin_cos(incline_deg * RADIANS)
    along = x * cosine + y * sine
    above = y * cosine - x * sine
    return -length <= along <= 0.0 and abs(above - height) <= ON_BELT


def _plate(look: Look, row: int) -> Iterator[Fault]:
    """Say what is wrong with a plate: of two sorts, of which the first is there once at most."""

    def path(key: str) -> str:
        return look.path("plate", key, row)

    hangs, damps = look.given("plate", "pivot", row), look.given("plate", "distance", row)
    if look("plate", "above", row) == 0.0 and look("plate", "below", row) == 0.0:
        yield Fault(path("above"), 0.0, f"a plate needs a length; {path('below')} is 0 too")
    if hangs and damps:
        text = f"give either {path('distance')}, of the damping plate, or this, of a further one"
        yield Fault(path("pivot"), look("plate", "pivot", row), text)
    elif hangs:
        if not look.given("plate", "name", row) and look.sound(path("name")):
            yield Fault(path("name"), MISSING, "a name; a plate with a pivot needs one")
        if look.given("plate", "pivot_height", row):
            text = f"is the damping plate's; {path('pivot')} has the height"
            yield Fault(path("pivot_height"), look("plate", "pivot_height", row), text)
    elif not damps and look.sound(path("distance")) and look.sound(path("pivot")):
        text = "m from the pulley to the pivot; or of a further plate name and pivot = [x, y]"
        yield Fault(path("distance"), MISSING, text)
    elif damps:
        if look.given("plate", "name", row):
            text = f"is for a further plate, with {path('pivot')}; this one is called plate"
            yield Fault(path("name"), look("plate", "name", row), text)
        if any(look.given("plate", "distance", other) for other in range(row)):
            text = "there is a damping plate already; a further one has name and pivot"
            yield Fault(path("distance"), look("plate", "distance", row), text)


def _pieces(look: Look) -> Iterator[Fault]:
    """Say if surfaces and their copies are more pieces than an engine can look at."""
    belts = ("incoming", "outgoing")
    count = sum(map(look.has, belts)) + look.rows("plate") + 4 * look.rows("conveyor")
    for row in range(look.rows("surface")):
        if not look.sound(f"surface[{row}]"):
            continue
        points, repeat = (look("surface", key, row) for key in ("points", "repeat"))
        opens, closes = (look("surface", key, row) for key in ("opens_at", "closes_at"))
        pieces = max(1, len(points or ()) - 1) * math.prod(copies[0] for copies in repeat)
        if opens is not None and closes is not None and opens < closes:
            pieces *= 2
        count += pieces
        if count > MOST_PIECES:
            key = "repeat" if repeat else "points"
            value = look("surface", key, row)
            text = f"at most {MOST_PIECES} pieces of surfaces, copies too, in all"
            yield Fault(f"surface[{row}].{key}", value, f"{text}, not {count}")
            return


def _strings(look: Look) -> Iterator[Fault]:
    counts = [look("stream", "count", row) for row in range(max(1, look.rows("stream")))]
    for row, string in enumerate(look.several("string")):
        number = string.get("particle", 0) if isinstance(string, Mapping) else math.nan
        if isinstance(number, int) and number >= sum(counts):
            text = f"there are {sum(counts)} particles, from 0; stream.count says how many"
            yield Fault(f"string[{row}].particle", number, text)


ARC: Final = ("radius", "from_deg", "to_deg")


def _differ(path: str) -> str:
    return f"must differ from {path}.from by at least {SHORTEST:g} m"


def surface_conflicts(path: str, surface: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield what is wrong with how one free surface is laid out; `path` is the surface's own."""
    start, to, points = (surface.get(key) for key in ("from", "to", "points"))
    center, opens = surface.get("center"), surface.get("opens_at")
    if opens is not None and opens == surface.get("closes_at"):
        yield Fault(f"{path}.opens_at", opens, f"must differ from {path}.closes_at")
    if center is None:
        for key in ARC:
            if surface.get(key) not in (None, *([0.0, 360.0] if key != "radius" else [])):
                yield Fault(f"{path}.center", MISSING, f"a point [x, y], to go with {path}.{key}")
                return
    else:
        for key, value in (("from", start), ("to", to), ("points", points)):
            if value is not None:
                text = (
                    f"give either {path}.center and radius, of an arc, or this, of a straight one"
                )
                yield Fault(f"{path}.{key}", value, text)
        if surface.get("radius") is None:
            yield Fault(f"{path}.radius", MISSING, f"m, to go with {path}.center")
        begin = surface.get("from_deg")
        begin, end = 0.0 if begin is None else begin, surface.get("to_deg")
        end = 360.0 if end is None else end
        angles = isinstance(begin, int | float) and isinstance(end, int | float)
        if angles and (begin == end or abs(end - begin) > 360.0):
            text = f"must be another angle than {path}.from_deg, at most 360 from it"
            yield Fault(f"{path}.to_deg", end, text)
        elif angles and abs(end - begin) * RADIANS * (surface.get("radius") or 1.0) < SHORTEST:
            text = f"so far from {path}.from_deg that the arc is {SHORTEST:g} m long, at least"
            yield Fault(f"{path}.to_deg", end, text)
        return
    if points is not None:
        for key, value in (("from", start), ("to", to)):
            if value is not None:
                text = f"give either from and to, or {path}.points, not both"
                yield Fault(f"{path}.{key}", value, text)
    elif start is None and to is None:
        text = "give from and to, or points = [[x, y], ...], or of an arc center and radius"
        yield Fault(f"{path}.points", MISSING, text)
    elif start is None or to is None:
        key, other = ("from", "to") if start is None else ("to", "from")
        yield Fault(f"{path}.{key}", MISSING, f"a point [x, y], to go with {path}.{other}")
    elif isinstance(start, LIST) and isinstance(to, LIST) and not apart(start, to):
        yield Fault(f"{path}.to", to, _differ(path))


def stream_name(row: int) -> str:
    """Return what a stream is called that has no name of its own."""
    return f"stream{row + 1}" if row else "stream"


def _expectations(look: Look) -> Iterator[Fault]:
    if not look.several("expect") or not all(map(look.sound, SURFACES)):
        return
    surfaces = [table for table in ("incoming", "outgoing") if look.has(table)]
    if any(look.given("plate", "distance", row) for row in range(look.rows("plate"))):
        surfaces.append("plate")
    free = [look(table, "name", row) for table in SURFACES for row in range(look.rows(table))]
    surfaces += [name for name in free if isinstance(name, str)]
    streams, counts = [], []
    for row in range(max(1, look.rows("stream"))):
        many = look("stream", "count", row)
        counts.append(many if isinstance(many, int) else 1)
        called = look("stream", "name", row)
        streams.append(called if isinstance(called, str) else stream_name(row))
    for index, given in enumerate(look.several("expect")):
        path = f"expect[{index}]"
        if not (isinstance(given, Mapping) and look.sound(path)):
            continue
        name = given.get("quantity")
        if not isinstance(name, str):
            continue
        about = lookup(name, surfaces, streams)
        if about is None:
            text = f"no such quantity here; {suggestion(name, surfaces)}"
            yield Fault(f"{path}.quantity", name, text)
            continue
        if text := whose(about, sum(counts)):
            yield Fault(f"{path}.quantity", name, text)
            continue
        if given.get("value") == THEORY and not about.theory:
            has = ", ".join(one.name for one in REGISTRY.values() if one.theory)
            text = f"a number; the theory has no {name}, only {has}"
            yield Fault(f"{path}.value", THEORY, text)
        for key in ("tolerance", "tolerance_contact", "tolerance_pymunk"):
            tolerance, none = given.get(key), "" if key == "tolerance" else f' or "{UNPROMISED}"'
            if not isinstance(tolerance, str) or (none and tolerance == UNPROMISED):
                continue
            with suppress(ValueError):
                size, found = read_size(tolerance)
                if size >= 0.0 and found in (about.unit, "%"):
                    continue
            examples = {"": "3", "degrees": "0.1 degrees"}
            example = examples.get(about.unit) or write_size(0.0005, about.unit)
            text = f'must be a number from 0 to 1 (relative), a string such as "{example}"{none}'
            kind = f"in {about.unit}" if about.unit else "a number of things"
            yield Fault(f"{path}.{key}", tolerance, f"{text}; {name} is {kind}")
