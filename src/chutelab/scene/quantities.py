"""The registry of all quantities of a run, one row each.

It defines the names used by scenes, sweeps, searches and lessons, the keys of the JSON summary and
their schema, the lists in ``--help``, the columns of sweeps, labels of plots, and the page's names
of numbers. `chutelab.results.quantities` computes them from a recording.

A name means the same everywhere. Each particle has a ``landing.x``: the bare name is for scenes of
one particle; with several, ``particles[0].landing.x`` belongs to the first one, and with a
statistic, ``landing.x.mean``, it is the stream's. ``landing.count`` is the number that have landed,
and ``by_stream.left.landing.x.mean`` belongs to one stream. The paper's symbols are those of
particle 0.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import chain
from typing import Any, Final, Literal, NamedTuple

from chutelab.util.errors import did_you_mean

Of = Literal["particle", "total", "nominal", "lone", "stream", "run"]
"""To what a quantity belongs: each particle; each particle, and their sum to the run; particle 0,
and others by a statistic; the only particle of a run; a stream, or all together; the run."""

Ending = Literal["any", "scene", "settled"]
"""How a run must end for a quantity: in any way, as the scene says, or without slip."""


class Quantity(NamedTuple):
    """A quantity of a run; ``SURFACE`` and ``SENSOR`` stand for any name."""

    name: str

    unit: str
    """ "" for a number of things."""

    meaning: str

    of: Of = "particle"

    needs: tuple[str, ...] = ()
    """Tables that a scene needs to have the quantity."""

    ending: Ending = "any"

    columns: tuple[str, ...] = ()
    """Statistics that are columns of a sweep; "" is the quantity itself."""

    symbol: str = ""
    """The page's short name of it, the paper's symbol if there is one."""

    theory: bool = False
    """Whether the closed form has it, too."""

    together: str = ""
    """The quantity that replaces it in a run of several particles."""

    @property
    def field(self) -> str:
        """Its name in `chutelab.theory.Transfer`, where angles are in radians."""
        return self.name.removeprefix(FIRST).removesuffix("_deg")

    @property
    def kind(self) -> str:
        """Its kind, which chooses the scale of its errors: lengths by a length; or ""."""
        return KINDS.get(self.unit, "")


KINDS: Final = {
    "degrees": "angle", "s": "time", "m": "length", "m/s": "speed", "J": "energy", "W": "power",
}  # fmt: skip
"""Kinds of quantities by their units."""

STATISTICS: Final = {
    "mean": "mean", "spread": "standard deviation", "min": "least", "max": "largest",
    "q02": "2 % have less", "q25": "a quarter has less", "q50": "median",
    "q75": "three quarters have less", "q98": "98 % have less",
}  # fmt: skip
"""Statistics over all particles; those without a value do not count."""

EVENTS: Final = {
    "separation": ("incoming", "the separation", "left the incoming belt"),
    "impact": ("plate", "the impact on the plate", "met the plate"),
    "landing": ("outgoing", "the landing on the belt itself", "touched the outgoing belt itself"),
    "arrival": ("outgoing", "the arrival on the belt or its load", "arrived on the outgoing belt"),
    "impact.SURFACE": ("", "the impact on SURFACE", "met SURFACE"),
    "sensor.SENSOR": ("", "the first passage of SENSOR", "passed SENSOR"),
}
"""First events of a particle: the table that they need, a noun and a verb."""

NEEDED: Final = {event: EVENTS[event][0] for event in ("separation", "impact", "landing")}
"""Events of the transfer, and their surfaces; impacts on free surfaces go by name."""

ENTRIES: Final = ("belt_work", "restitution_loss", "friction_loss")
ENDINGS: Final = ("time", "landed", "settled", "exit", "stopped", "unreleased")
"""Why a track ends; the last is for particles never released."""

FIRST: Final = "particles[0]."
"""Prefix of quantities of particle 0, required with several particles."""

BOTH, MEAN, ITSELF = ("mean", "spread"), ("mean",), ("",)
PAID: Final = "ledger.by_surface.outgoing.belt_work"
HEAT: Final = "ledger.by_surface.outgoing.friction_loss"


def _event(event: str) -> Iterator[Quantity]:
    """Yield the rows of an event: quantities of each particle, and the count."""
    home, what, verb = EVENTS[event]
    needs = (home,) if home else ()
    for key, unit, text, swept in (
        ("t", "s", "time of {}", {"landing": MEAN}),
        ("x", "m", "x of {}", {"landing": BOTH, "arrival": BOTH}),
        ("y", "m", "y of {}", {"landing": MEAN}),
        ("vx", "m/s", "forward velocity just before {}", {"landing": BOTH, "arrival": BOTH}),
        ("vy", "m/s", "upward velocity just before {}", {"landing": BOTH}),
        ("vx_after", "m/s", "forward velocity just after {}", {}),
        ("vy_after", "m/s", "upward velocity just after {}", {}),
        ("count", "", f"particles that {verb}", {"impact": ITSELF}),
        ("share", "", f"share of the particles that {verb}", {}),
    ):
        once = event in ("separation", "arrival", "sensor.SENSOR")
        if not (key.endswith("_after") and once) and (event, key) != ("sensor.SENSOR", "count"):
            of: Of = "stream" if key in ("count", "share") else "particle"
            columns = swept.get(event, ())
            yield Quantity(
                f"{event}.{key}", unit, text.format(what), of, needs, columns=columns,
                symbol=key if event == "landing" and of == "particle" else "",
            )  # fmt: skip


def _paper(name: str, symbol: str, unit: str, meaning: str) -> Quantity:
    """Return a row of one of the paper's quantities of a transfer."""
    needs = ("incoming", "plate")
    return Quantity(name, unit, meaning, "nominal", needs, symbol=symbol, theory=True)


def _paid(name: str, unit: str, meaning: str, together: str, *, theory: bool = True) -> Quantity:
    """Return a row of the outgoing belt's work or heat until nothing slips on it."""
    return Quantity(
        name, unit, meaning, "lone", ("outgoing",), "settled", theory=theory, together=together
    )


def _run(
    name: str, meaning: str, unit: str = "J", of: Of = "run", needs: str = "", **swept: Any
) -> Quantity:
    """Return a row of a quantity of the whole run."""
    return Quantity(name, unit, meaning, of, tuple(needs.split()), "scene", **swept)


LOADS: Final = {
    "normal": ("N", "force that presses SURFACE"),
    "along": ("N", "force that drags SURFACE along"),
    "torque": ("N m", "torque on SURFACE about its pivot"),
}
"""Loads on a surface: unit and meaning."""

WEAR: Final = {
    "impact": "energy that impacts on SURFACE lose along the normal",
    "sliding": "slip heat on SURFACE",
    "erosion": "Finnie's m v² f(γ) of impacts on SURFACE",
    "abrasion": "Archard's load times sliding distance on SURFACE",
}
"""Wear of a surface, see `results.wear`."""

PARTS: Final = {
    "mean": "mean over time",
    "peak": "largest of a bin",
    "rms": "root mean square",
    "end": "mean of the last bin that the run filled",
}


def _load(part: str, unit: str, meaning: str, statistic: str) -> Iterator[Quantity]:
    """Yield the rows of loads on a surface; the plate's normal load is a column of sweeps, too."""
    said = f"{meaning}, {PARTS[statistic]}"
    row = Quantity(f"loads.SURFACE.{part}.{statistic}", unit, said, "run", ("run.loads",), "scene")
    yield row
    if part == "normal" and statistic != "end":
        name, said = (text.replace("SURFACE", "plate") for text in (row.name, said))
        yield row._replace(name=name, meaning=said, needs=("plate", "run.loads"), columns=ITSELF)


REGISTRY: Final = {
    row.name: row
    for row in (
        *chain.from_iterable(map(_event, EVENTS)),
        Quantity("sensor.SENSOR.speed", "m/s", "speed at the first passage of SENSOR"),
        Quantity("sensor.SENSOR.count", "", "passages of SENSOR from the left of its line", "run"),
        Quantity("sensor.SENSOR.back", "", "passages of SENSOR the other way", "run"),
        Quantity("sensor.SENSOR.rate", "1/s", "particles per time through SENSOR", "run"),
        Quantity("sensor.SENSOR.mass_rate", "kg/s", "mass per time through SENSOR", "run"),
        Quantity("sensor.SENSOR.whole_rate", "t/h", "flow through SENSOR over all stream.width",
                 "run"),
        Quantity("sensor.SENSOR.depth", "m", "depth of the stream at SENSOR", "run"),
        *(
            row
            for part, about in LOADS.items()
            for statistic in PARTS
            for row in _load(part, *about, statistic)
        ),
        *(
            Quantity(f"wear.SURFACE.{part}.{which}", "J", f"{meaning}, {said}", "run", (), "scene")
            for part, meaning in WEAR.items()
            for which, said in (("sum", "in total"), ("peak", "largest of 50 pieces"))
        ),
        Quantity("flight.t", "s", "time of flight from the incoming belt",
                 needs=("incoming",), symbol="t"),
        Quantity("track.t", "s", "time from the release to the end", ending="scene", columns=MEAN),
        Quantity("ended.t", "s", "time at which the track ends", ending="scene"),
        Quantity("ended.x", "m", "x where the track ends", ending="scene"),
        Quantity("ended.y", "m", "y where the track ends", ending="scene"),
        _paper("phi1_deg", "φ₁", "degrees", "angle of separation"),
        _paper("v1", "v₁", "m/s", "speed at separation"),
        _paper("t2", "t₂", "s", "time of flight to the plate"),
        _paper("x2", "x₂", "m", "distance forward to the plate"),
        _paper("y2", "y₂", "m", "fall to the plate"),
        _paper("v2", "v₂", "m/s", "speed at the plate"),
        _paper("phi2_deg", "φ₂", "degrees", "angle to the plate, before"),
        _paper("phi2r_deg", "φ₂′", "degrees", "angle to the plate, after"),
        _paper("v2r", "v₂′", "m/s", "speed after the impact"),
        _paper("t3", "t₃", "s", "time of flight to the landing"),
        _paper("x3", "x₃", "m", "distance back from the plate"),
        _paper("y3", "d₂", "m", "fall from impact to landing"),
        _paper("v3x", "v₃ₓ", "m/s", "landing velocity, back"),
        _paper("v3y", "v₃ᵧ", "m/s", "landing velocity, down"),
        _paper("v3", "v₃", "m/s", "landing speed"),
        _paper("d3", "d₃", "m", "height of the transfer"),
        _paper("dEk", "ΔEₖ", "J", "the paper's energy, Eq. (14)"),
        _paper("P", "P", "W", "the paper's power, Eq. (15)"),
        _paid("belt_work", "J", "belt work until no slip", PAID),
        _paid("slip_heat", "J", "slip heat until no slip", HEAT),
        _paid("power", "W", "belt work until no slip, times rate", "ledger.power", theory=False),
        _run("contacts", "contacts of particles with anything", ""),
        _run("misses", "particles that never arrived", "", needs="outgoing", columns=ITSELF),
        *(_run(f"ended.{why}", f"particles whose track ended: {why}", "") for why in ENDINGS),
        _run("ledger.belt_work", "work of the drives of all belts", of="total"),
        _run("ledger.drive_work", "work of the drives of moving surfaces, and of motors"),
        _run("ledger.push_work", "work of forces by hand"),
        _run("ledger.restitution_loss", "loss in all bounces", of="total", columns=ITSELF),
        _run("ledger.friction_loss", "heat of all slip", of="total"),
        _run("ledger.air_loss", "part of the friction loss that is air drag"),
        _run("ledger.damper_loss", "loss in dampers"),
        _run("ledger.spring.start", "energy in springs at the start"),
        _run("ledger.spring.end", "energy in springs at the end"),
        _run("ledger.residual", "energy that the ledger cannot explain: the numerical error",
             columns=ITSELF),
        _run("ledger.turned_over", "energy turned over, to which the residual is relative"),
        _run("ledger.kinetic.start", "kinetic energy at the releases"),
        _run("ledger.kinetic.end", "kinetic energy at the ends of the tracks"),
        _run("ledger.potential.start",
             "potential energy at the releases; heights are from the origin"),
        _run("ledger.potential.end",
             "potential energy at the ends of the tracks; heights are from the origin"),
        _run(PAID, "work of the outgoing belt's drive", needs="outgoing", columns=ITSELF),
        _run(HEAT, "heat of the slip on the outgoing belt", needs="outgoing", columns=ITSELF),
        _run("ledger.power", "the outgoing belt's work per particle, times the rate over the"
             " whole width", "W", needs="outgoing", columns=ITSELF),
        _run("ledger.by_surface.SURFACE.belt_work", "work of the drive of the belt SURFACE"),
        _run("ledger.by_surface.SURFACE.drive_work", "work of the drive that moves SURFACE"),
        _run("ledger.by_surface.SURFACE.damper_loss", "loss in the damper of SURFACE"),
        _run("ledger.by_surface.SURFACE.restitution_loss", "loss in bounces on SURFACE"),
        _run("ledger.by_surface.SURFACE.friction_loss", "heat of the slip on SURFACE"),
        _run("error.max", "largest relative error of particle 0 against the theory", "",
             columns=ITSELF),
    )
}  # fmt: skip
"""Every quantity by its name. The ledger counts up to ``run.until``."""

THEORY: Final = {row.field: row for row in REGISTRY.values() if row.theory}
"""Quantities that the closed form has, too, by its names."""

FORMER: Final = {
    "time": "track.t.mean", "restitution_loss": "ledger.restitution_loss",
    "friction_loss": "ledger.friction_loss", "residual": "ledger.residual", "error": "error.max",
    "plate_hits": "impact.count",
    **{f"landing.{key}_spread": f"landing.{key}.spread" for key in ("x", "vx", "vy")},
}  # fmt: skip
"""Former names of quantities, and their present ones."""


def _told(row: Quantity, statistic: str) -> Quantity | None:
    """Return a statistic of a quantity; "" is the quantity itself."""
    if not statistic:
        return row
    if row.of not in ("particle", "nominal") or statistic not in STATISTICS:
        return None
    meaning = f"{row.meaning}, {STATISTICS[statistic]}"
    return row._replace(name=f"{row.name}.{statistic}", meaning=meaning, of="stream", theory=False)


COLUMNS: Final = {
    row.name: row
    for base in REGISTRY.values()
    for statistic in base.columns
    if (row := _told(base, statistic)) is not None
}
"""The columns of numbers of a sweep."""


def lookup(name: str, surfaces: Collection[str], streams: Collection[str] = ()) -> Quantity | None:
    """Return a quantity by its name; None if the scene has none such.

    Names are such as ``x2``, ``landing.x``, ``particles[0].landing.x``, ``landing.x.mean``,
    ``arrival.vx.spread``, ``flight.t``, ``impact.ramp.t``, ``landing.count``, ``ended.settled``,
    ``ledger.belt_work``, ``ledger.kinetic.end`` or
    ``ledger.by_surface.outgoing.belt_work``; `surfaces` are all of the scene. Statistics and counts
    exist for one stream, too: ``by_stream.left.landing.x.mean``.

    Examples
    --------
    >>> lookup("landing.x.mean", ["incoming", "outgoing"]).unit, lookup("impact.t", [])
    ('m', None)
    """
    own = name.removeprefix(FIRST)
    found = _row(own, surfaces)
    if own != name:
        single = found is not None and found.of not in ("stream", "run")
        return found._replace(name=name, of="nominal") if found and single else None
    match name.split(".", 2):
        case ["by_stream", stream, rest] if stream in streams:
            found = lookup(rest, surfaces)
            return found._replace(name=name) if found and found.of == "stream" else None
    if found is None:
        base, _, statistic = name.rpartition(".")
        row = _row(base, surfaces)
        found = _told(row, statistic) if row and statistic else None
    return found


def _row(name: str, surfaces: Collection[str]) -> Quantity | None:
    """Return the row of a quantity without statistic."""
    row = REGISTRY.get(name)
    if row is None or "SURFACE" in name or "SENSOR" in name:
        parts = name.split(".")
        place = {"impact": 1, "sensor": 1, "loads": 1, "wear": 1, "ledger": 2}.get(
            parts[0], len(parts)
        )
        any_ = "SENSOR" if parts[0] == "sensor" else "SURFACE"
        surface = parts[place] if place < len(parts) else ""
        row = REGISTRY.get(".".join([*parts[:place], any_, *parts[place + 1 :]]))
        known = f"sensor.{surface}" if parts[0] == "sensor" else surface
        there = known in surfaces or (place == 2 and surface == "particles")
        if row is None or not there or (parts[0] == "impact" and surface in NEEDED.values()):
            return None
        row = row._replace(name=name, meaning=row.meaning.replace(any_, surface))
    return row if all(table in surfaces for table in row.needs) else None


def every(surfaces: Collection[str], count: int) -> Iterator[Quantity]:
    """Yield all quantities of a scene's whole run, in the order of the registry.

    With several particles their quantities have mean and standard deviation.

    >>> [row.name for row in every(["incoming"], 200)][:2]
    ['separation.t.mean', 'separation.t.spread']
    """
    for row in REGISTRY.values():
        names = [row.name]
        if "SURFACE" in row.name:
            names = [row.name.replace("SURFACE", one) for one in surfaces]
        if "SENSOR" in row.name:
            sensors = [one for one in surfaces if one.startswith("sensor.")]
            names = [row.name.replace("sensor.SENSOR", one) for one in sensors]
        if count > 1 and row.of in ("nominal", "lone"):
            continue
        if count > 1 and row.of == "particle":
            names = [f"{name}.{statistic}" for name in names for statistic in BOTH]
        for name in names:
            if found := lookup(name, surfaces):
                yield found


def counted(name: str, until: str | float | None = None) -> str:
    """Return up to when a quantity of the ledger is counted in runs up to `run.until`, or "".

    Examples
    --------
    >>> counted("belt_work"), counted("ledger.belt_work", "landed"), counted("landing.x")
    ('until nothing slips', 'up to the landing', '')
    """
    paid = name in REGISTRY and REGISTRY[name].of == "lone"
    if not (paid or name.startswith("ledger.")):
        return ""
    said = {
        "landed": "up to the landing",
        "settled": "until nothing slips",
        "None": "up to run.until",
    }
    return said.get("settled" if paid else str(until), f"up to t = {until} s")


def whose(row: Quantity, count: int) -> str:
    """Return how to name one of several particles; "" if the name does so already.

    Examples
    --------
    >>> whose(REGISTRY["landing.x"], 1)
    ''
    >>> whose(REGISTRY["landing.x"], 200)
    'of 200 particles: particles[0].landing.x, or landing.x.mean of the stream'
    """
    if count <= 1 or row.of not in ("particle", "lone"):
        return ""
    together = row.together or f"{row.name}.mean"
    return f"of {count} particles: {FIRST}{row.name}, or {together} of the stream"


def suggestion(name: str, surfaces: Collection[str]) -> str:
    """Return the present name of a quantity, or similar names, or all names."""
    if name in FORMER:
        return f"it is called {FORMER[name]} now"
    if "run.loads" not in surfaces and lookup(name, [*surfaces, "run.loads"]):
        return "it needs run.loads, how long bins are, such as 0.01 s"
    missing = [table for table in NEEDED.values() if table not in surfaces]
    if row := lookup(name, [*surfaces, *missing]):
        return f"it needs {' and '.join(f'[{table}]' for table in row.needs if table in missing)}"
    some = [f"{event}.x" for event, home in NEEDED.items() if home in surfaces]
    keys = ", ".join([*some, "contacts", "ledger.belt_work"])
    theirs = "phi1_deg to slip_heat, " if {"incoming", "plate"} <= {*surfaces} else ""
    there_are = f"there are {theirs}{keys} and other keys of `chutelab run --json`"
    # A search for similar names takes long, so only some of a thousand surfaces are tried.
    known: list[str] = []
    for row in REGISTRY.values():
        statistics = STATISTICS if row.of == "particle" else ()
        for surface in list(surfaces)[:50] if "S" in row.name else [""]:
            one = row.name.replace("SURFACE", surface)
            if surface.startswith("sensor."):
                one = row.name.replace("sensor.SENSOR", surface)
            if lookup(one, surfaces):
                known += [one, *(f"{one}.{statistic}" for statistic in statistics)]
    return did_you_mean(name, known, there_are)
