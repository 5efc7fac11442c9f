"""What a run leaves to read, as tables: a crowd or particle 0, the ledger, and notes."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from math import ceil, isnan

import numpy as np

from chutelab.results.comparison import compare
from chutelab.results.ledger import ledger
from chutelab.results.notes import (
    air_drag,
    layers,
    plugged,
    rolling,
    squeezed,
    stopped,
    waits,
)
from chutelab.results.record import REASONS, Kind
from chutelab.results.recording import Recording
from chutelab.results.stream import crowd, steady
from chutelab.util.tables import Sheet, number

STATIONS = 6
"""Contacts of particle 0 that are listed where no theory speaks of them."""

FLOW = 8
"""Particles that must have left for a word about how fast they came."""


def facts(recording: Recording, *, details: bool = False) -> str:
    """Return how much there was of what, and how it ended, in two lines.

    With `details` also the engine and its steps.
    """
    counted = Counter(recording.ended.tolist())
    told = [_many(recording.count, "particle"), _many(recording.contacts, "contact")]
    if details:
        steps = f"{recording.steps} {'rounds' if recording.engine == 'exact' else 'steps'}"
        told = [f"engine {recording.engine}", *told, steps]
    if not isnan(recording.seconds):
        told.append(f"computed in {recording.seconds:.3g} s")
    ended = ", ".join(f"{counted[k]} {REASONS[k]}" for k in sorted(counted))
    return f"{', '.join(told)}\nended: {ended}"


def sheets(recording: Recording, *, details: bool = False) -> list[Sheet]:
    """Return the tables of a run, and what there is to know about it, a sheet each.

    Of several particles these are all of them; particle 0 alone comes after them with `details`.
    With `details` errors are told down to rounding.
    """
    together = crowd(recording)
    parts = [] if together is None else [together.sheet(details=details)]
    nominal = _nominal(recording, details=details) if together is None or details else []
    if together is None:
        parts += nominal
    until = recording.scene.run.until
    # Belt work goes on after the landing: `belt_work` above is until nothing slips any more.
    ends = {"landed": "the landing", "settled": "all have settled"}.get(
        str(until), f"t = {until} s"
    )
    books = ledger(recording).sheet(details=details)
    parts.append(replace(books, title=f"Energy ledger until {ends}, J"))
    tell = (stopped, plugged, waits, squeezed, rolling, steady, air_drag)
    notes = [str(note) for one in tell if (note := one(recording)) is not None]
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
    notes = [*map(str, recording.laws), *notes]
    return [
        *parts,
        *(Sheet("", (), (), notes=(f"{note[0].upper()}{note[1:]}.",)) for note in notes),
        *(nominal if together is not None else ()),
    ]


def _nominal(recording: Recording, *, details: bool) -> list[Sheet]:
    """Return the tables of particle 0: beside the theory, and on its way where there is none."""
    compared = compare(recording).sheet(details=details)
    way = _way(recording)
    return [compared, way] if compared.notes and way.rows else [compared]


def _many(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _way(recording: Recording) -> Sheet:
    """Return where and when particle 0 touched or left something first, as no theory says it."""
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
