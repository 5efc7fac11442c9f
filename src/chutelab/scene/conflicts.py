"""Rules that concern several keys or tables.

Every rule reports a fault only if a comparison is *true*. A `Look` returns NaN for a key that is
itself at fault, and no comparison with NaN is true. So the rules work on a partly invalid scene,
and all faults of a file come in one message. Rules about one row of a table are data, `RULES`; the
live page gets those that it needs.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from chutelab.scene.formulas import compiled
from chutelab.scene.look import ALWAYS, JOINTS, LIST, MOTIONS, SURFACES, WAITS, Look, Row
from chutelab.scene.materials import presets
from chutelab.scene.quantities import REGISTRY, lookup, suggestion, whose
from chutelab.scene.units import (
    LIGHTEST,
    MOST_PARTICLES,
    MOST_PIECES,
    apart,
    read_size,
    sphere_mass,
    write_size,
)
from chutelab.util.errors import MISSING, Fault, did_you_mean

THEORY: Final = "theory"
UNPROMISED: Final = "none"
"""Allowed words for the value and a tolerance of an expectation."""

LEAST_VIEW: Final = 1e-6
"""Least width and height of a ``[view]``, m: smaller ones vanish in rounding far from the
origin."""


class ConflictError(ValueError):
    """Passes the faults of a rule through Pydantic's validation."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__("; ".join(str(fault) for fault in faults))
        self.faults = list(faults)


RULES: Final[dict[str, list[list[str]]]] = {}
"""By tables: keys, condition, text of the page, text in Python; explained in the file."""

for tables, written in tomllib.loads(
    (Path(__file__).parent / "rules.toml").read_text(encoding="utf-8")
).items():
    for name in tables.split():
        RULES.setdefault(name, []).extend(written)


class _Names(dict[str, Any]):
    """Values of names in a rule: those given, all others by a function."""

    def __init__(self, other: Callable[[str], Any], **known: Any) -> None:
        super().__init__(known)
        self.other = other

    def __missing__(self, name: str) -> Any:
        return self.other(name)


Check = Callable[[], Iterator[Fault]]
"""Yields the faults of one rule; what it reads is not read before it is called."""


def rules_of(
    look: Look,
    table: str,
    rows: Sequence[Row],
    kinds: Sequence[Row] = (),
    streams: Sequence[Row] = (),
) -> Iterator[Check]:
    """Yield a check for each of `RULES` in each row of a table."""
    run = look.row("run")

    def near(a: object, b: object) -> bool:
        return isinstance(a, LIST) and isinstance(b, LIST) and not apart(a, b)

    for number, row in enumerate(rows):
        if not (row.content or row.sound()):
            continue
        earlier, kind = rows[:number], row
        if table == "stream":
            kind = next((one for one in kinds if one["name"] == row["particle"]), kinds[0])

        def other(name: str, row: Row = row) -> Any:
            if name == "count":
                return sum(stream["count"] for stream in streams)
            return look.gravity if name == "gravity" else row[name]

        names = _Names(
            other, abs=abs, radians=math.radians, near=near, run=run, has=look.has,
            number=lambda value: isinstance(value, int | float), given=row.given, sound=row.sound,
            before=lambda key, rows=earlier: any(one.given(key) for one in rows),
            value=row.__getitem__, kind=kind,
        )  # fmt: skip
        for rule in RULES[table]:
            yield partial(_contradictions, row, names, rule)


def _contradictions(row: Row, names: _Names, rule: Sequence[str]) -> Iterator[Fault]:
    """Yield the faults that one of `RULES` finds in a row."""
    keys, when, _, said = rule
    for key in keys.split():
        names["key"] = key
        if eval(compiled(when), {"__builtins__": {}}, names) and (row.given(key) or row.sound(key)):
            run, kind = names["run"], names["kind"]
            of = _Names(kind.path)
            words = _Names(row.path, its=row, run=run, count=names["count"], kind=kind, of=of)
            text = said.format_map(words)
            value = row[key]
            yield Fault(row.path(key), MISSING if value is None else value, text)


def checks(look: Look) -> Iterator[Check]:
    """Yield all checks, in order. Which there are does not depend on numbers in the tables."""
    kinds, streams = look.rows("particle", 1), look.rows("stream", 1)
    yield partial(_tables, look)
    yield partial(_names, look)
    yield partial(_references, look)
    for kind in kinds:
        yield partial(_mass, look, kind)
    yield partial(_sizes, look, kinds, streams)
    yield partial(_engine, look, streams)
    for stream in streams:
        yield partial(_width, stream, kinds)
    for table in RULES:
        rows = look.rows(table, int(table in ALWAYS))
        yield from rules_of(look, table, rows, kinds, streams)
    yield partial(_pieces, look)
    yield partial(_strings, look)
    yield partial(_expectations, look, streams)
    yield partial(_view, look)


def conflicts(look: Look) -> Iterator[Fault]:
    """Yield every conflict between keys; each names all the keys concerned."""
    for check in checks(look):
        yield from check()


def _strings(look: Look) -> Iterator[Fault]:
    for joint in look.rows("string"):
        if joint.given("over") and look.row("run")["engine"] == "pymunk":
            text = f"{joint.path('over')} needs contact: Chipmunk has no string over a pulley"
            yield look.row("run").fault("engine", text)


def _view(look: Look) -> Iterator[Fault]:
    view = look.row("view")
    low, high = view["from"], view["to"]
    corners = isinstance(low, LIST) and isinstance(high, LIST)
    if corners and any(b - a < LEAST_VIEW for a, b in zip(low, high, strict=True)):
        text = f"must lie right of view.from = {list(low)} and above it, by 1e-6 m at least"
        yield Fault("view.to", list(high), text)


def _tables(look: Look) -> Iterator[Fault]:
    plates = look.rows("plate")
    damps = look.damps or (look.has("plate") and not plates)
    turned = look.document.get("gravity_deg")
    if turned and look.has("incoming") and look.sound("gravity_deg"):
        text = "must be 0 with [incoming]: the paper's machine stands upright"
        yield Fault("gravity_deg", turned, text)
    needy = ["[plate]"] * damps + ["[outgoing]"] * look.has("outgoing")
    if needy and not look.has("incoming"):
        need = "needs" if len(needy) == 1 else "need"
        yield Fault("incoming", MISSING, f"{' and '.join(needy)} {need} the table [incoming]")
    # A plate without a pivot may be meant for either kind; the missing key is another fault.
    damps |= any(not plate.given("pivot") for plate in plates)
    if look.row("outgoing")["drop_from"] == "impact" and not damps:
        text = 'needs the table [plate]; without one write outgoing.drop_from = "top"'
        yield Fault("outgoing.drop_from", "impact", text)


def _names(look: Look) -> Iterator[Fault]:
    """Report names that are given twice, missing, or unknown."""
    surfaces: dict[object, str] = {}
    for table in (*SURFACES, "particle", "stream", "material", "sensor"):
        known = surfaces if table in SURFACES else {}
        rows = look.rows(table)
        for row in rows:
            name, path = row["name"], row.path("name")
            if not isinstance(name, str):
                if table == "particle" and len(rows) > 1 and row.sound("name"):
                    yield row.missing("name", "a name; needed where there are several kinds")
                continue
            if name in known:
                yield row.fault("name", f"must be unique; {known[name]} is the same")
            known.setdefault(name, path)
            if table == "particle" and name in surfaces:
                yield row.fault("name", f"must be unique; {surfaces[name]} is the same")
    kinds = _texts(look.rows("particle"))
    for row in look.rows("stream"):
        name = row["particle"]
        if isinstance(name, str) and name not in kinds and look.sound("particle"):
            allowed = did_you_mean(name, kinds, _there_are(kinds))
            yield row.fault("particle", f"no such kind; {allowed}")
    own = _texts(look.rows("material"))
    for row in look.rows("particle"):
        name = row["material"]
        if isinstance(name, str) and name not in (*own, *presets()) and look.sound("material"):
            allowed = did_you_mean(name, [*own, *presets()], "`chutelab materials` lists them")
            yield row.fault("material", f"no such material; {allowed}")


def _texts(rows: Iterable[Row]) -> list[str]:
    """Return the names that rows have."""
    return [text for row in rows if isinstance(text := row["name"], str)]


def _there_are(names: Sequence[str]) -> str:
    return f"there are {', '.join(names)}" if names else "none has a name"


def _references(look: Look) -> Iterator[Fault]:
    """Report triggers and pairs that name something unknown."""
    # Skip checks of references if names are invalid.
    if not all(map(look.sound, SURFACES)):
        return
    free = dict.fromkeys(name for table in SURFACES for name in _texts(look.rows(table)))
    usual = [*filter(look.has, ("incoming", "plate", "outgoing"))]
    there = [*usual, *free]
    for row in (*look.rows("plate"), *look.rows("surface")):
        for key in filter(row.given, WAITS):
            name = row[key].get("touched") if isinstance(row[key], dict) else None
            if isinstance(name, str) and name not in there:
                allowed = f"no such surface; {did_you_mean(name, there, _there_are(there))}"
                yield Fault(row.path(f"{key}.touched"), name, allowed)
    kinds = _texts(look.rows("particle"))
    anything = [*kinds, *free, *usual]
    for pair in look.rows("pair") if look.sound("particle") else ():
        between = pair["between"]
        if not (isinstance(between, LIST) and pair.sound()):
            continue
        if not any(name in kinds for name in between):
            text = f"one of them must be the name of a [[particle]]; {_there_are(kinds)}"
            yield Fault(pair.path("between"), list(between), text)
        elif pair["meet"] is False and not all(name in kinds for name in between):
            yield pair.fault("meet", "true with a surface: it is for two kinds of particles")
        for place, name in enumerate(between):
            if name not in anything:
                allowed = did_you_mean(str(name), anything, _there_are(anything))
                path = pair.path(f"between[{place}]")
                yield Fault(path, name, f"no such kind or surface; {allowed}")


def _mass(look: Look, kind: Row) -> Iterator[Fault]:
    """Report a density of round particles that gives too small a mass."""
    radius = kind["radius"]
    if radius == 0.0 or kind["shape"] in ("box", "polygon"):
        return
    key, density, name = "density", kind["density"], kind["material"]
    if density is None and not kind.given("mass") and isinstance(name, str):
        own = [row["density"] for row in look.rows("material") if row["name"] == name]
        if not own and name in presets():
            own = [presets()[name].material.density]
        key, density = "material", own[0] if own and look.sound("material") else None
    radius = 0.5 * sum(radius) if isinstance(radius, LIST) else radius
    if density is not None and (mass := sphere_mass(density, radius)) < LIGHTEST:
        text = f"with {kind.path('radius')} = {radius:g} m a mass of at least {LIGHTEST:g} kg"
        yield kind.fault(key, f"{text}, not {mass:.3g} kg")


def _sizes(look: Look, kinds: Sequence[Row], streams: Sequence[Row]) -> Iterator[Fault]:
    """Report shapes, and points, that an engine does not have."""
    run, sizes = look.row("run"), [kind["radius"] for kind in kinds]
    engine = run["engine"]
    for kind, size in zip(kinds, sizes, strict=True):
        shape, path = kind["shape"], kind.path("radius")
        if shape in ("box", "polygon"):
            if engine == "exact":
                text = f'{kind.path("shape")} = "{shape}" needs contact or pymunk'
                yield run.fault("engine", text)
        elif size == 0.0:
            if any(size != 0.0 for size in sizes if size is not math.nan):
                text = "more than 0, or 0 of all kinds: no engine has points beside disks"
                yield kind.fault("radius", text)
            if engine in ("contact", "pymunk"):
                yield run.fault("engine", f"{path} is 0, and {engine} needs disks (> 0)")
            for stream in streams:
                if stream["interact"] is True:
                    yield stream.fault("interact", f"{path} is 0, and mass points never meet")


def _engine(look: Look, streams: Sequence[Row]) -> Iterator[Fault]:
    run = look.row("run")
    joined = [table for table in JOINTS if look.rows(table)]
    engine, count = run["engine"], sum(stream["count"] for stream in streams)
    meet = [stream for stream in streams if stream["interact"] is True]
    for stream in meet if engine == "exact" and count > 1 else ():
        many = f"{stream.path('count')} = {stream['count']}"
        text = f"{stream.path('interact')} with {many} needs contact or pymunk"
        yield run.fault("engine", text)
    if count > MOST_PARTICLES:
        text = f"at most {MOST_PARTICLES} particles in all streams together, not {count}"
        yield max(streams, key=lambda stream: stream["count"]).fault("count", text)
    for row in (*look.rows("plate"), *look.rows("surface")):
        motions = (*MOTIONS, "hinge")
        keys = [key for key in motions if row.given(key) and row[key] != 0.0]
        if keys and engine == "exact":
            yield run.fault("engine", f"{row.path(keys[0])} moves it: contact or pymunk has that")
        waits = [*filter(row.given, WAITS)][:1]
        for key in [*filter(row.given, ["passes"]), *waits] if engine == "exact" else ():
            yield run.fault("engine", f"{row.path(key)} needs contact or pymunk")
        for key in [*waits, *filter(row.given, ["hinge"])] if count > 1 and not meet else ():
            text = f"{row.path(key)} couples particles: several of them have to meet"
            yield streams[0].fault("interact", text)
    for joint in (joint for table in joined for joint in look.rows(table)):
        if joint.given("other") and count > 1 and not meet:
            text = f"{joint.path('other')} couples particles: they have to meet"
            yield streams[0].fault("interact", text)
    if engine == "exact" and joined:
        yield run.fault("engine", f"{joined[0]}[0] needs contact or pymunk")


def _width(stream: Row, kinds: Sequence[Row]) -> Iterator[Fault]:
    """Report a stream that is narrower than its slice."""
    name = stream["particle"]
    kind = next((kind for kind in kinds if kind["name"] == name), kinds[0])
    radius, width = kind["radius"], stream["width"] if stream.given("width") else math.nan
    if width == width and kind.sound("radius"):
        size = sum(radius) if isinstance(radius, LIST) else 2.0 * radius
        if kind["shape"] in ("box", "polygon") or size == 0.0:
            text = "is for disks and spheres: the slice that is simulated is as thick as they are"
            yield stream.fault("width", text)
        elif width < size:
            text = f"must be at least the diameter of a particle, {size:g} m: one slice"
            yield stream.fault("width", text)


def _pieces(look: Look) -> Iterator[Fault]:
    """Report surfaces and copies with more pieces than an engine can handle."""
    count = look.has("incoming") + look.has("outgoing")
    count += len(look.rows("plate")) + 4 * len(look.rows("conveyor"))
    for surface in look.rows("surface"):
        if not surface.sound():
            continue
        points, repeat = surface["points"], surface["repeat"]
        if (way := surface["passes"]) and not surface.given("center"):
            across = int(way in ("left", "right"))
            places = [point[across] for point in points or (surface["from"], surface["to"])]
            steps = [b - a for a, b in pairwise(places)]
            if min(steps) <= 0.0 <= max(steps):
                text = f"another way: each of its points must have {'xy'[across]} beyond that of"
                yield surface.fault("passes", f"{text} the one before")
        opens, closes = surface["opens_at"], surface["closes_at"]
        pieces = max(1, len(points or ()) - 1) * math.prod(copies[0] for copies in repeat)
        if opens is not None and closes is not None and opens < closes:
            pieces *= 2
        count += pieces
        if count > MOST_PIECES:
            text = f"at most {MOST_PIECES} pieces of surfaces, copies too, in all, not {count}"
            yield surface.fault("repeat" if repeat else "points", text)
            return


def stream_name(row: int) -> str:
    """Return the name of a stream that has none."""
    return f"stream{row + 1}" if row else "stream"


def _expectations(look: Look, streams: Sequence[Row]) -> Iterator[Fault]:
    if not all(map(look.sound, (*SURFACES, "sensor"))):
        return
    surfaces = [*filter(look.has, ("incoming", "outgoing")), *["plate"] * look.damps]
    surfaces += [name for table in SURFACES for name in _texts(look.rows(table))]
    surfaces += [f"sensor.{name}" for name in _texts(look.rows("sensor"))]
    surfaces += ["run.loads"] * look.row("run").given("loads")
    names = [
        name if isinstance(name := stream["name"], str) else stream_name(number)
        for number, stream in enumerate(streams)
    ]
    count = sum(many if isinstance(many := stream["count"], int) else 1 for stream in streams)
    for row in look.rows("expect"):
        name = row["quantity"]
        if not (row.sound() and isinstance(name, str)):
            continue
        about = lookup(name, surfaces, names)
        if about is None:
            yield row.fault("quantity", f"no such quantity here; {suggestion(name, surfaces)}")
            continue
        if text := whose(about, count):
            yield row.fault("quantity", text)
            continue
        if row["value"] == THEORY and not about.theory:
            has = ", ".join(one.name for one in REGISTRY.values() if one.theory)
            yield row.fault("value", f"a number; the theory has no {name}, only {has}")
        for key in ("tolerance", "tolerance_contact", "tolerance_pymunk"):
            tolerance, none = row[key], "" if key == "tolerance" else f' or "{UNPROMISED}"'
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
            yield row.fault(key, f"{text}; {name} is {kind}")
