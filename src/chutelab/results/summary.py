"""The JSON object of a run: what ``chutelab run --json`` prints and summary.json holds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from chutelab.results.arrival import fates
from chutelab.results.comparison import compare, predicted, prediction
from chutelab.results.laws import judge
from chutelab.results.ledger import Ledger, ledger
from chutelab.results.notes import air_drag, plugged, rolling, squeezed, stopped, waits
from chutelab.results.quantities import each
from chutelab.results.record import REASONS, Record
from chutelab.results.stream import crowd, steady
from chutelab.scene.quantities import REGISTRY, THEORY, Quantity
from chutelab.theory import Transfer, predict
from chutelab.util.tables import plain

FORMAT = 1
"""Version of the object; keys are only ever added to a version."""

LISTS: dict[str, dict[str, Quantity]] = {}
"""What each particle has, a list each: rows of the registry by the two parts of their names."""

for _row in REGISTRY.values():
    if _row.of == "particle" and "SURFACE" not in _row.name:
        _home, _key = _row.name.split(".")
        LISTS.setdefault(_home, {})[_key] = _row

OTHERS = {
    "format": ("integer", "version of the object; keys are only ever added to a version"),
    "scene": ("string", "title of the scene"),
    "engine": ("string", "engine that ran"),
    "particles": ("integer", "how many there are"),
    "seconds": ("number", "from the validated scene to the recording, s; null of a recording that"
                " was loaded and in summary.json, where the same run leaves the same bytes"),
    "steps": ("integer", "steps, or rounds of the exact engine"),
    "contacts": ("integer", REGISTRY["contacts"].meaning),
    "fates": ("object", "how many particles ended where, see `results.arrival.fates`"),
    "crowd": ("object", "all particles together, see `results.stream.Crowd`; null of one"),
    "stopped": ("object", "how far a run got that was ended before, see `results.notes.Stopped`"),
    "rolling": ("object", "disks that settled on the outgoing belt without being carried by it, see"
                " `results.notes.Rolling`"),
    "plugged": ("object", "particles that got stuck, see `results.notes.Plug`"),
    "waited": ("object", "particles that found their place taken, see `results.notes.Waits`"),
    "squeezed": ("object", "riders by adhesion that got into each other, see"
                 " `machine.releases.Squeeze`"),
    "laws": ("array", "laws of every run that this one broke, see `results.laws.Broken`"),
    "instead": ("string", "why another engine ran first, see `Recording.instead`"),
    "drag": ("object", "what air drag, left out, would do, see `theory.Drag`"),
    "steady": ("object", "what the outgoing belt needs for streams that were given in t/h, see"
               " `results.stream.Steady`"),
    "ledger": ("object", "where the energy went, see `results.ledger.Ledger`"),
    "theory": ("object", "what the closed form predicts of particle 0, and why it stops"),
    "theory_as_printed": ("object", "the same with Eq. (9) as it is printed; null with friction of"
                          " the plate, or where it leans"),
    "error": ("object", "relative errors of particle 0 against the theory, and the largest"),
    "accuracy": ("object", "see `studies.accuracy`; null unless it was asked for"),
}  # fmt: skip
"""Keys that hold no list a particle: type and meaning. Null is what there is nothing to say of."""


def summary(recording: Record, accuracy: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a recording's numbers as plain lists and floats, None for what did not happen.

    What they are `schema` says. Lists have one entry a particle. Lengths, times and energies are in
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
        "stopped": stopped(recording),
        "rolling": rolling(recording),
        "plugged": plugged(recording),
        "waited": waits(recording),
        "squeezed": squeezed(recording),
        "laws": judge(recording),
        "instead": recording.instead or None,
        "drag": air_drag(recording),
        "steady": steady(recording),
        "ledger": ledger(recording),
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
