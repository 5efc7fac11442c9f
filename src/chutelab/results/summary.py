"""The JSON object of a run: what ``chutelab run --json`` prints and summary.json holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from math import degrees, isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.machine.releases import squeeze
from chutelab.results.comparison import compare
from chutelab.results.ledger import ledger
from chutelab.results.quantities import waits
from chutelab.results.recording import REASONS, Kind, Recording
from chutelab.scene import Scene
from chutelab.theory import Transfer, predict

FORMAT = 1
"""Version of the object; keys are only ever added to a version."""

CARRIED = 1e-3
"""m/s from the belt's speed, up to which a particle rides with it: the slip that counts as none."""

ANGLES = ("phi1", "phi2", "phi2r")
THEORY = (
    "phi1", "t2", "x2", "y2", "v2", "phi2", "phi2r", "v2r", "t3", "x3", "y3", "v3x", "v3y", "v3",
    "d3", "dEk", "P", "belt_work", "slip_heat",
)  # fmt: skip


def summary(recording: Recording, accuracy: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a recording's numbers as plain lists and floats, None for what did not happen.

    Lists have one entry a particle. Lengths, times and energies are in SI units, angles in degrees
    under names that end in ``_deg``. ``accuracy`` is None unless one was asked for, ``rolling``
    unless disks settled on the outgoing belt without being carried by it (see `rolling`), and
    ``waited`` unless particles found their place taken (see `results.quantities.Waits`), and
    ``squeezed`` unless riders by adhesion got into each other (see `machine.releases.Squeeze`).
    """
    scene = recording.scene
    compared = compare(recording)
    impacts = recording.select(Kind.IMPACT, surface="plate")
    landings = recording.select(Kind.LANDING)
    partings = recording.select(Kind.SEPARATION, surface="incoming")
    waited, released = waits(scene, recording), recording.select(Kind.RELEASE)
    squeezed = squeeze(scene, released["t"], released["position"])
    return {
        "format": FORMAT,
        "scene": recording.title,
        "engine": recording.engine,
        "particles": recording.count,
        "seconds": recording.seconds,
        "steps": recording.steps,
        "contacts": recording.contacts,
        "separation": _first(recording, partings, after=False),
        "impact": _first(recording, impacts, after=True),
        "landing": _first(recording, landings, after=True),
        "ended": _ended(recording),
        "rolling": rolling(recording),
        "waited": None if waited is None else asdict(waited),
        "squeezed": None if squeezed is None else asdict(squeezed),
        "ledger": asdict(ledger(recording)),
        "theory": _theory(recording.prediction),
        "theory_as_printed": _as_printed(scene),
        "error": {**compared.errors, "max": compared.max},
        "accuracy": None if accuracy is None else dict(accuracy),
    }


def _first(recording: Recording, events: NDArray[Any], *, after: bool) -> dict[str, list[Any]]:
    """Return the first of some events of each particle, by column."""
    first = recording.first(events)
    columns = {
        "t": first["t"],
        "x": first["position"][:, 0],
        "y": first["position"][:, 1],
        "vx": first["velocity_before"][:, 0],
        "vy": first["velocity_before"][:, 1],
    }
    if after:
        columns["vx_after"] = first["velocity_after"][:, 0]
        columns["vy_after"] = first["velocity_after"][:, 1]
    out: dict[str, list[Any]] = {}
    for name, values in columns.items():
        column: list[float | None] = [None] * recording.count
        for particle, value in zip(first["particle"].tolist(), values.tolist(), strict=True):
            column[particle] = value
        out[name] = column
    return out


def _ended(recording: Recording) -> dict[str, list[Any]]:
    released = np.diff(recording.offsets) > 0
    t: list[float | None] = [None] * recording.count
    _, last = recording.ends()
    for particle, end in zip(np.flatnonzero(released).tolist(), last["t"].tolist(), strict=True):
        t[particle] = end
    return {"t": t, "reason": [REASONS[reason] for reason in recording.ended.tolist()]}


def rolling(recording: Recording) -> dict[str, Any] | None:
    """Return what settled on the outgoing belt without being carried, None if nothing did.

    A free disk stops slipping when its contact point runs with the belt. Its centre, v_x, may then
    be far from the belt's speed v_b: it rolls, and the belt pays no more. Belt work so far and
    m v_b (v_b - v_x) together are what loads that are carried take.

    Returns
    -------
    dict or None
        ``particles``, how many; ``belt_work``, what the outgoing belt has paid for all particles,
        and ``belt_work_carried``, what it would have paid if these were carried, J.
    """
    belt = recording.scene.outgoing
    if belt is None or belt.speed is None or recording.particle.inertia == 0.0:
        return None
    settled = recording.select(Kind.SETTLE, surface="outgoing")
    missing = belt.speed - settled["velocity_after"][:, 0]
    missing = missing[np.abs(missing) > CARRIED]
    if not len(missing):
        return None
    paid = ledger(recording).by_surface["outgoing"]["belt_work"]
    due = recording.particle.mass * belt.speed * float(missing.sum())
    return {"particles": len(missing), "belt_work": paid, "belt_work_carried": paid + due}


def _theory(prediction: Transfer) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name in THEORY:
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
