"""The JSON object of a run: what ``chutelab run --json`` prints and summary.json holds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from math import degrees
from typing import Any

from chutelab.results.arrival import fates
from chutelab.results.comparison import compare
from chutelab.results.ledger import ledger
from chutelab.results.notes import air_drag, plugged, rolling, squeezed, stopped, waits
from chutelab.results.quantities import each
from chutelab.results.recording import REASONS, Recording
from chutelab.results.stream import crowd, steady
from chutelab.scene.quantities import REGISTRY, THEORY
from chutelab.theory import Transfer, predict
from chutelab.util.tables import plain

FORMAT = 1
"""Version of the object; keys are only ever added to a version."""


def summary(recording: Recording, accuracy: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a recording's numbers as plain lists and floats, None for what did not happen.

    Lists have one entry a particle. Lengths, times and energies are in SI units, angles in degrees
    under names that end in ``_deg``. ``seconds`` is None of a recording that was loaded, and in
    summary.json, where the same run leaves the same bytes. ``accuracy`` is None unless one was
    asked for, ``stopped`` unless the run was ended before it was over (see
    `results.quantities.Stopped`), ``rolling`` unless disks settled on the outgoing belt without
    being carried by it (see `rolling`), ``plugged`` unless particles got stuck (see
    `results.quantities.Plug`), ``waited`` unless particles found their place taken (see
    `results.quantities.Waits`), ``squeezed`` unless riders by adhesion got into each other (see
    `machine.releases.Squeeze`); ``laws`` is the list of `Recording.laws`, a table each, ``instead``
    is None unless another engine ran first (see `Recording.instead`). ``drag`` is what air drag,
    left out, would do (see `theory.Drag`), and ``steady`` is None unless streams were given in t/h
    (see `results.stream.Steady`). ``landing`` is the first touch of the outgoing belt itself,
    ``arrival`` that of the belt or of what lies on it. ``fates`` says how many particles ended
    where (see `results.arrival.fates`), and ``crowd`` is None of one particle (see
    `results.stream.Crowd`).
    """
    error, scene = compare(recording), recording.scene
    as_printed = None
    if scene.plate is not None and scene.plate.friction == scene.plate.angle_deg == 0.0:
        # The printed Eq. (9) is for a frictionless upright plate.
        as_printed = _theory(predict(scene, rebound="as-printed"))

    lists: dict[str, dict[str, Any]] = {}
    for name, row in REGISTRY.items():
        if row.of == "particle" and "SURFACE" not in name:
            home, key = name.split(".")
            lists.setdefault(home, {})[key] = each(recording, name)
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
        "laws": recording.laws,
        "instead": recording.instead or None,
        "drag": air_drag(recording),
        "steady": steady(recording),
        "ledger": ledger(recording),
        "theory": _theory(recording.prediction),
        "theory_as_printed": as_printed,
        "error": {**error.errors, "max": error.max},
        "accuracy": accuracy,
    })  # fmt: skip
    return told


def _theory(prediction: Transfer) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for field, row in THEORY.items():
        value = float(getattr(prediction, field))
        out[row.name] = degrees(value) if row.unit == "degrees" else value
    return {**out, "reason": str(prediction.reason) or None}
