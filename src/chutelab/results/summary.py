"""The summary of a run: notes, tables for people, and the JSON object.

A note exists only if it applies: particles that waited, got stuck or roll. It is a key of the
object, and ``str`` of it is printed below the tables.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from math import ceil, isnan
from typing import Any

import numpy as np

from chutelab.machine.releases import Squeeze, squeeze
from chutelab.results.arrival import CARRIED, arrivals, fates
from chutelab.results.laws import judge
from chutelab.results.ledger import Ledger, ledger
from chutelab.results.loads import sheet as load_sheet
from chutelab.results.loads import told as loads_told
from chutelab.results.quantities import column, compare, each, first, predicted, prediction
from chutelab.results.record import Record
from chutelab.results.rows import REASONS, Kind
from chutelab.results.sensors import readings
from chutelab.results.sensors import sheet as sensor_sheet
from chutelab.results.stream import FLOW, crowd, steady
from chutelab.scene.quantities import REGISTRY, THEORY, Quantity
from chutelab.theory import Drag, Transfer, drag, predict
from chutelab.util.tables import Sheet, many, number, plain, sentence

FORMAT = 1
"""Version of the object; keys are only ever added to a version."""

STATIONS = 6
"""Contacts of particle 0 that are listed if there is no theory of them."""

STILL = 1e-3
"""m/s; particles of a trembling bed are slower, sliding or falling ones only briefly."""


@dataclass(frozen=True)
class Stopped:
    """A run that was stopped, as ``--max-seconds`` does.

    Numbers of particles under way and not yet released, and the time up to which everything is
    recorded, s.
    """

    particles: int
    unreleased: int
    t: float

    def __str__(self) -> str:
        after = f" and {self.unreleased:,} not yet released" if self.unreleased else ""
        return (
            f"STOPPED before the end, with {many(self.particles, 'particle', ',')} under way"
            f"{after}: recorded up to t = {number(self.t)} s, and all sums count up to then"
        )


def stopped(recording: Record) -> Stopped | None:
    """Return when a run was stopped; None if it was not."""
    halted = recording.ended_by("stopped")
    if not halted.any():
        return None
    under_way = halted & recording.released
    t = float(recording.knots["t"].max(initial=0.0))
    if not recording.machine.interact:
        # Each particle is simulated alone, so some are further on than others.
        last = recording.knots["t"][recording.offsets[1:][under_way] - 1]
        due = recording.machine.releases.t[halted & ~recording.released]
        t = min(float(last.min(initial=t)), float(due.min(initial=t)))
    released = int(np.count_nonzero(under_way))
    return Stopped(released, int(np.count_nonzero(halted)) - released, t)


@dataclass(frozen=True)
class Waits:
    """Particles that were released late because their place was taken.

    Number that waited and were released, and their longest and mean waiting time, s (0 if none
    did); `never` is the number that were due and found no place until the end of the run.
    """

    particles: int
    longest: float
    mean: float
    never: int

    def __str__(self) -> str:
        said = []
        if self.particles:
            said.append(
                f"{many(self.particles, 'particle')} waited for a free place to be released,"
                f" {number(self.longest)} s at most and {number(self.mean)} s on average"
            )
        if self.never:
            said.append(f"{self.never} found no free place until the end")
        return "; ".join(said)


def waits(recording: Record) -> Waits | None:
    """Return the particles that waited for a place; None if none did."""
    due, dt = recording.machine.releases.t, recording.machine.dt
    # The pymunk engine releases at the beginning of a step, so a delay of up to a step does not
    # count.
    least = (1.0 + 1e-6) * dt if recording.engine == "pymunk" else 1e-9
    released = recording.select(Kind.RELEASE)
    late = released["t"] - due[released["particle"]]
    late = late[late > least]
    halt = stopped(recording)
    end = recording.knots["t"].max(initial=0.0) if halt is None else halt.t
    missing = int(np.count_nonzero(due[~recording.released] < end - dt))
    if not len(late) and not missing:
        return None
    longest, mean = (float(late.max()), float(late.mean())) if len(late) else (0.0, 0.0)
    return Waits(len(late), longest, mean, missing)


@dataclass(frozen=True)
class Plug:
    """Interacting particles that lie still in the machine at the end of a run.

    Their number, and that of particles that have left it or arrived on the outgoing belt.
    """

    still: int
    through: int

    def __str__(self) -> str:
        return (
            f"{many(self.still, 'particle', ',')} {'lies' if self.still == 1 else 'lie'} still in"
            f" the machine at the end, {self.through:,} got through: the machine is plugged, or"
            " they lie where nothing moves them on"
        )


def plugged(recording: Record) -> Plug | None:
    """Return the particles that got stuck; None if none did, or there was no way out.

    For particles that meet, if some got through or there is an outgoing belt, in a run that was not
    stopped. Particles are still if they are slower than `STILL`, or have settled: then their
    contacts are at rest, though a grain on trembling ones may be a little faster.
    """
    machine = recording.machine
    if not machine.interact or stopped(recording) is not None:
        return None
    through = recording.ended_by("exit")
    if recording.scene.outgoing is not None:
        through |= np.isfinite(arrivals(recording)["t"])
    still = np.zeros(recording.count, dtype=bool)
    still[recording.released] = np.hypot(*recording.ends()[1]["velocity"].T) < STILL
    still |= recording.ended_by("settled")
    lying, gone = int(np.count_nonzero(still & ~through)), int(np.count_nonzero(through))
    if not lying or not (gone or recording.scene.outgoing is not None):
        return None
    return Plug(lying, gone)


def air_drag(recording: Record) -> Drag | None:
    """Return what air drag would do, by the fastest moment of a recording.

    None for mass points, and for a run with air.
    """
    if recording.scene.air_density:
        return None
    speeds = np.hypot(*recording.knots["velocity"].T)
    if not len(speeds):
        return drag(recording.scene, prediction(recording), 0.0)
    fastest = int(np.argmax(speeds))
    speed = float(speeds[fastest])
    # Not every knot has the speed just before an impact; events do.
    met = np.hypot(*recording.events["velocity_before"].T)
    particle = int(np.searchsorted(recording.offsets, fastest, side="right")) - 1
    if len(met) and met.max() > speed:
        speed, particle = float(met.max()), int(recording.events["particle"][np.argmax(met)])
    radius, mass = float(recording.radius[particle]), float(recording.mass[particle])
    return drag(recording.scene, prediction(recording), speed, radius, mass)


def squeezed(recording: Record) -> Squeeze | None:
    """Return the riders that overlap by adhesion, see `machine.releases.squeeze`; or None."""
    released = recording.select(Kind.RELEASE)
    whose = released["particle"]
    carried = recording.machine.releases.carried[whose]
    released, radius = released[carried], recording.radius[whose[carried]]
    return squeeze(recording.scene, released["t"], released["position"], radius)


@dataclass(frozen=True)
class Rolling:
    """Disks that settled on the outgoing belt without being carried by it.

    A free disk stops slipping when its contact point has the belt's speed. Its centre's speed v_x
    may then differ much from the belt's speed v_b: it rolls, and the belt does no more work.
    Carried loads would take the belt work so far plus m v_b (v_b - v_x).

    `particles` is the number that roll, `belt_work` the outgoing belt's work on all particles, J,
    and `belt_work_carried` its work if those that roll were carried, J.
    """

    particles: int
    belt_work: float
    belt_work_carried: float

    def __str__(self) -> str:
        rolls = "rolls" if self.particles == 1 else "roll"
        return (
            f"{many(self.particles, 'disk')} {rolls} on the outgoing belt without slip, instead of"
            f" being carried. The belt work is {number(self.belt_work)} J; carried loads would take"
            f" {number(self.belt_work_carried)} J (a disk that arrives without turning takes a"
            " third of a carried load's work)"
        )


def rolling(recording: Record) -> Rolling | None:
    """Return the disks that settled on the outgoing belt without being carried, or None."""
    belt = recording.scene.outgoing
    if belt is None or belt.speed is None or np.all(recording.particle.inertia == 0.0):
        return None
    settled = recording.select(Kind.SETTLE, surface="outgoing")
    missing = belt.speed - settled["velocity_after"][:, 0]
    astray = np.abs(missing) > CARRIED
    if not astray.any():
        return None
    paid = ledger(recording).by_surface["outgoing"]["belt_work"]
    masses = recording.mass[settled["particle"]]
    due = belt.speed * float((masses * missing)[astray].sum())
    return Rolling(int(astray.sum()), paid, paid + due)


def layers(recording: Record) -> tuple[float, float] | None:
    """Return the landing places of the lowest and the highest layer of a bed, x, m.

    None if all are released at one height, or if one of the two does not land on the belt.
    """
    if recording.count < 2 or recording.scene.stream.bed_height == 0.0:
        return None
    landed = column(first(recording, "landing"), "x")[recording.released]
    heights = recording.ends()[0]["position"][:, 1]
    ends = landed[[np.argmin(heights), np.argmax(heights)]]
    return (float(ends[0]), float(ends[1])) if np.isfinite(ends).all() else None


NOTES: dict[str, tuple[Callable[[Record], Any], str]] = {
    "stopped": (stopped, "how far a run got that was ended before, see `results.summary.Stopped`"),
    "plugged": (plugged, "particles that got stuck, see `results.summary.Plug`"),
    "waited": (waits, "particles that found their place taken, see `results.summary.Waits`"),
    "squeezed": (squeezed, "riders by adhesion that got into each other, see"
                 " `machine.releases.Squeeze`"),
    "rolling": (rolling, "disks that settled on the outgoing belt without being carried by it, see"
                " `results.summary.Rolling`"),
    "steady": (steady, "what the outgoing belt needs for streams that were given in t/h, see"
               " `results.stream.Steady`"),
    "drag": (air_drag, "what air drag, left out, would do, see `theory.Drag`"),
}  # fmt: skip
"""Notes by their keys in the JSON object: reader and meaning, in the order of printing.
"""


def facts(recording: Record, *, details: bool = False) -> str:
    """Return counts of particles, events and ends, in two lines.

    With `details` also the engine and its steps.
    """
    counted = Counter(recording.ended.tolist())
    told = [many(recording.count, "particle"), many(recording.contacts, "contact")]
    if details:
        steps = f"{recording.steps} {'rounds' if recording.engine == 'exact' else 'steps'}"
        told = [f"engine {recording.engine}", *told, steps]
    if not isnan(recording.seconds):
        told.append(f"computed in {recording.seconds:.3g} s")
    words = {"time": "at the end of the time", "exit": "out of the scene"}
    ended = ", ".join(f"{counted[k]} {words.get(REASONS[k], REASONS[k])}" for k in sorted(counted))
    return f"{', '.join(told)}\nended: {ended}"


def sheets(recording: Record, *, details: bool = False) -> list[Sheet]:
    """Return the tables of a run and its notes, one sheet each.

    With several particles the tables are about all of them; with `details` particle 0 follows, and
    errors are shown down to rounding.
    """
    together = crowd(recording)
    parts = [] if together is None else [together.sheet(details=details)]
    nominal = []
    if together is None or details:
        nominal = [compare(recording).sheet(details=details)]
        if nominal[0].notes and (way := _way(recording)).rows:
            nominal.append(way)
    if together is None:
        parts += nominal
    until = recording.scene.run.until
    # Belt work goes on after the landing; `belt_work` above counts until nothing slips.
    ends = {"landed": "the landing", "settled": "all have settled or left"}.get(str(until))
    ends = ends or f"t = {number(float(until))} s"
    balance = ledger(recording).sheet(details=details)
    parts.append(replace(balance, title=f"Energy ledger until {ends}, J"))
    if (sensors := sensor_sheet(recording)) is not None:
        parts.append(sensors)
    if (loads := load_sheet(recording)) is not None:
        parts.append(loads)
    notes = [str(note) for read, _ in NOTES.values() if (note := read(recording)) is not None]
    if (layered := layers(recording)) is not None:
        notes.insert(
            0,
            "the lowest layer lands at x = {} m, the highest at {} m".format(*map(number, layered)),
        )
    left = np.sort(recording.select(Kind.EXIT)["t"])
    if recording.machine.interact and len(left) >= FLOW:
        quarters = (f"{left[ceil(part * len(left) / 4) - 1]:.3f}" for part in (1, 2, 3, 4))
        said = "{} fell out of the machine: a quarter by {} s, half by {} s, three quarters by {} s"
        notes.insert(0, f"{said}, the last at {{}} s".format(len(left), *quarters))
    if recording.instead:
        notes.insert(0, f"{recording.instead}; {recording.engine} ran instead, and keeps them")
    notes = [*map(str, judge(recording)), *notes]
    return [
        *parts,
        *(Sheet("", (), (), notes=(sentence(note),)) for note in notes),
        *(nominal if together is not None else ()),
    ]


def _way(recording: Record) -> Sheet:
    """Return where and when particle 0 first touched or left surfaces, without theory."""
    own = recording.events[recording.events["particle"] == 0]
    own = own[np.isin(own["kind"], [Kind.SEPARATION, Kind.IMPACT, Kind.LANDING])][:STATIONS]
    rows = []
    for event in own:
        name = recording.surfaces[event["surface"]]
        what = "leaves" if event["kind"] == Kind.SEPARATION else "meets"
        numbers = (event["t"], *event["position"], *event["velocity_before"])
        rows.append((f"{what} {name}", *(number(float(value)) for value in numbers)))
    heads = ("", "t, s", "x, m", "y, m", "vx, m/s", "vy, m/s")
    notes: tuple[str, ...] = ()
    if len(own) > 1 and own["kind"][0] == Kind.SEPARATION:
        flown = float(own["t"][1] - own["t"][0])
        notes = (f"time of flight, from the first to the second: {number(flown)} s",)
    return Sheet("Particle 0, its first contacts", heads, tuple(rows), notes=notes)


LISTS: dict[str, dict[str, Quantity]] = {}
"""Quantities of each particle, one list each: rows of the registry by the two parts of their
names."""

for _row in REGISTRY.values():
    if _row.of == "particle" and _row.name == _row.name.replace("SURFACE", "").replace(
        "SENSOR", ""
    ):
        _home, _key = _row.name.split(".")
        LISTS.setdefault(_home, {})[_key] = _row

OTHERS = {
    "format": ("integer", "version of the object; keys are only ever added to a version"),
    "scene": ("string", "title of the scene"),
    "engine": ("string", "engine that ran"),
    "particles": ("integer", "how many there are"),
    "seconds": ("number", "from the validated scene to the recording, s; null of a recording that"
                " was loaded and in summary.json, where the same run leaves the same bytes"),
    "steps": ("integer", "steps; of the exact engine the most events that a particle took"),
    "contacts": ("integer", REGISTRY["contacts"].meaning),
    "fates": ("object", "how many particles ended where, see `results.arrival.fates`"),
    "crowd": ("object", "all particles together, see `results.stream.Crowd`; null of one"),
    **{key: ("object", meaning) for key, (_, meaning) in NOTES.items()},
    "laws": ("array", "laws of every run that this one broke, see `results.laws.Broken`"),
    "instead": ("string", "why another engine ran first, see `Recording.instead`"),
    "ledger": ("object", "where the energy went, see `results.ledger.Ledger`"),
    "sensors": ("object", "what the scene's sensors tell, see `results.sensors.Reading`"),
    "loads": ("object", "what each surface bears, see `results.loads.Part`, with run.loads"),
    "theory": ("object", "what the closed form predicts of particle 0, and why it stops"),
    "theory_as_printed": ("object", "the same with Eq. (9) as it is printed; null with friction of"
                          " the plate, or where it leans"),
    "error": ("object", "relative errors of particle 0 against the theory, and the largest"),
    "accuracy": ("object", "see `studies.accuracy`; null unless it was asked for"),
}  # fmt: skip
"""Keys without a list of particles: type and meaning. Null if they do not apply."""


def summary(recording: Record, accuracy: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a recording's numbers as plain lists and floats, None for what did not happen.

    `schema` describes them. Lists have one entry per particle. Lengths, times and energies are in
    SI units, angles in degrees under names that end in ``_deg``.
    """
    error, scene = compare(recording), recording.scene
    as_printed = None
    if scene.plate is not None and scene.plate.friction == scene.plate.angle_deg == 0.0:
        # The printed Eq. (9) is for a frictionless upright plate.
        as_printed = _theory(predict(scene, rebound="as-printed"))
    lists: dict[str, dict[str, Any]] = {
        home: {key: each(recording, row.name) for key, row in rows.items()}
        for home, rows in LISTS.items()
    }
    lists["ended"]["reason"] = [REASONS[k] for k in recording.ended]
    told: dict[str, Any] = plain({
        "format": FORMAT,
        "scene": recording.title,
        "engine": recording.engine,
        "particles": recording.count,
        "seconds": recording.seconds,
        "steps": recording.steps,
        "contacts": recording.contacts,
        **lists,
        "fates": Counter(fates(recording).tolist()),
        "crowd": crowd(recording),
        **{key: read(recording) for key, (read, _) in NOTES.items()},
        "laws": judge(recording),
        "instead": recording.instead or None,
        "ledger": ledger(recording),
        "sensors": readings(recording),
        "loads": loads_told(recording),
        "theory": _theory(prediction(recording)),
        "theory_as_printed": as_printed,
        "error": {**error.errors, "max": error.max},
        "accuracy": accuracy,
    })  # fmt: skip
    return told


def _theory(answer: Transfer) -> dict[str, Any]:
    told = {row.name: predicted(answer, row) for row in THEORY.values()}
    return {**told, "reason": str(answer.reason) or None}


def schema() -> dict[str, Any]:
    """Return the JSON Schema of what `summary` returns; ``x-unit`` is the unit of a number."""

    def said(row: Quantity, form: Mapping[str, Any]) -> dict[str, Any]:
        return {**form, "description": row.meaning, "x-unit": row.unit}

    number = {"type": ["number", "null"]}
    keys: dict[str, Any] = {
        home: {
            "type": "object",
            "properties": {
                key: said(row, {"type": "array", "items": number}) for key, row in rows.items()
            },
        }
        for home, rows in LISTS.items()
    }
    keys["ended"]["properties"]["reason"] = {"type": "array", "items": {"enum": list(REASONS)}}
    keys |= {
        key: {"type": [form, "null"], "description": what} for key, (form, what) in OTHERS.items()
    }
    theory = {row.name: said(row, number) for row in THEORY.values()}
    for key in ("theory", "theory_as_printed"):
        keys[key]["properties"] = {**theory, "reason": {"type": ["string", "null"]}}
    keys["error"]["properties"] = {**dict.fromkeys(THEORY, number), "max": number}
    pair = {"type": "array", "items": number, "minItems": 2, "maxItems": 2}
    keys["ledger"]["properties"] = {
        one.name: said(row, number)
        if (row := REGISTRY.get(f"ledger.{one.name}"))
        else (pair if f"ledger.{one.name}.end" in REGISTRY else {"type": "object"})
        for one in fields(Ledger)
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Chutelab run",
        "type": "object",
        "properties": keys,
        "required": list(keys),
    }
