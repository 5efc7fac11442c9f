"""The JSON object of a run: what ``chutelab run --json`` prints and summary.json holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import degrees, isfinite
from typing import Any

from chutelab.machine.releases import Squeeze
from chutelab.results.comparison import compare
from chutelab.results.ledger import ledger
from chutelab.results.quantities import (
    QUANTITIES,
    Rolling,
    Waits,
    column,
    end_times,
    first,
    rolling,
    squeezed,
    waits,
)
from chutelab.results.recording import REASONS, Recording
from chutelab.scene import Scene
from chutelab.theory import Transfer, predict
from chutelab.util.arrays import Floats

FORMAT = 1
"""Version of the object; keys are only ever added to a version."""

BEFORE, AFTER = ("t", "x", "y", "vx", "vy"), ("vx_after", "vy_after")

ANGLES = ("phi1", "phi2", "phi2r")


def summary(recording: Recording, accuracy: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a recording's numbers as plain lists and floats, None for what did not happen.

    Lists have one entry a particle. Lengths, times and energies are in SI units, angles in degrees
    under names that end in ``_deg``. ``accuracy`` is None unless one was asked for, ``rolling``
    unless disks settled on the outgoing belt without being carried by it (see `rolling`), and
    ``waited`` unless particles found their place taken (see `results.quantities.Waits`), and
    ``squeezed`` unless riders by adhesion got into each other (see `machine.releases.Squeeze`).
    """
    compared = compare(recording)
    ended = {"t": _column(end_times(recording)), "reason": [REASONS[k] for k in recording.ended]}
    return {
        "format": FORMAT,
        "scene": recording.title,
        "engine": recording.engine,
        "particles": recording.count,
        "seconds": recording.seconds,
        "steps": recording.steps,
        "contacts": recording.contacts,
        "separation": _events(recording, "separation", BEFORE),
        "impact": _events(recording, "impact", (*BEFORE, *AFTER)),
        "landing": _events(recording, "landing", (*BEFORE, *AFTER)),
        "ended": ended,
        "rolling": _told(rolling(recording)),
        "waited": _told(waits(recording)),
        "squeezed": _told(squeezed(recording)),
        "ledger": asdict(ledger(recording)),
        "theory": _theory(recording.prediction),
        "theory_as_printed": _as_printed(recording.scene),
        "error": {**compared.errors, "max": compared.max},
        "accuracy": None if accuracy is None else dict(accuracy),
    }


def _events(recording: Recording, event: str, names: Sequence[str]) -> dict[str, list[Any]]:
    events = first(recording, event)
    return {name: _column(column(events, name)) for name in names}


def _column(values: Floats) -> list[float | None]:
    return [value if isfinite(value) else None for value in values.tolist()]


def _told(found: Waits | Squeeze | Rolling | None) -> dict[str, Any] | None:
    return None if found is None else asdict(found)


def _theory(prediction: Transfer) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name in QUANTITIES:
        value = float(getattr(prediction, name))
        if name in ANGLES:
            name, value = f"{name}_deg", degrees(value)
        out[name] = value if isfinite(value) else None
    return {**out, "reason": str(prediction.reason) or None}


def _as_printed(scene: Scene) -> dict[str, Any] | None:
    """Return the theory with the printed Eq. (9), which only a frictionless upright plate has."""
    if scene.plate is None or scene.plate.friction != 0.0 or scene.plate.angle_deg != 0.0:
        return None
    return _theory(predict(scene, rebound="as-printed"))
