"""The first separation, impact and landing of each particle, and the paper's symbols from them."""

from __future__ import annotations

from math import nan
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from chutelab.results.arrival import never
from chutelab.results.recording import ENTRIES, REASONS, Recording
from chutelab.scene import Scene
from chutelab.scene.quantities import NEEDED
from chutelab.scene.variants import Family
from chutelab.util.arrays import Floats, Numbers

ALONG = 1e-14
"""Share of the rebound speed below which its part away from the plate is rounding."""


_known: WeakKeyDictionary[Recording, dict[tuple[str, str], NDArray[Any]]] = WeakKeyDictionary()


def first(recording: Recording, event: str, surface: str | None = None) -> NDArray[Any]:
    """Return the first "separation", "impact" or "landing" of each particle, (N,), dtype `EVENT`.

    From the incoming belt, on the plate and on the outgoing belt, unless another surface is given.
    NaN throughout where it did not happen. Read-only.
    """
    known, key = _known.setdefault(recording, {}), (event, surface or NEEDED[event])
    if key not in known:
        events = never(recording.count)
        if key[1] in recording.surfaces:
            found = recording.first(recording.select(event, surface=key[1]))
            events[found["particle"]] = found
        events.flags.writeable = False
        known[key] = events
    return known[key]


def column(events: NDArray[Any], name: str) -> Floats:
    """Return ``t``, ``x``, ``y``, ``vx``, ``vy``, ``vx_after`` or ``vy_after`` of events, SI."""
    if name == "t":
        return np.asarray(events["t"])
    if name in ("x", "y"):
        return np.asarray(events["position"][:, "xy".index(name)])
    when = "after" if name.endswith("_after") else "before"
    return np.asarray(events[f"velocity_{when}"][:, "xy".index(name[1])])


def paid(recording: Recording, surface: str, entry: str) -> Floats:
    """Return an entry of a surface of each variant, (V,), J; of a family V = N, else 1."""
    books = recording.by_surface.reshape(-1, len(recording.surfaces), len(ENTRIES))
    return np.asarray(books[:, recording.surface_index(surface), ENTRIES.index(entry)])


def symbols(recording: Recording) -> dict[str, Floats]:
    """Return `THEORY` of each particle, (N,), SI units and radians; NaN without one."""
    left, hit, down = (first(recording, event).copy() for event in NEEDED)
    # In the paper's frame an impact is counted from the separation, a landing from the impact.
    hit[np.isnan(left["t"])] = never(1)
    down[np.isnan(hit["t"])] = never(1)
    own = recording.particle
    found = from_events(recording.machine.scenes, left, hit, down, own.radius, own.mass)
    return found | until_no_slip(recording, down["t"])


def until_no_slip(recording: Recording, landed: Floats) -> dict[str, Floats]:
    """Return the theory's belt work and slip heat of each particle that landed then (s), (N,), J.

    Known of a lone particle that slips no more, and met nothing but the belt since it landed.
    """
    found = np.full((2, recording.count), nan)
    if (recording.count == 1 or recording.family) and "outgoing" in recording.surfaces:
        events = recording.events
        there = np.isfinite(landed) & (recording.ended == REASONS.index("settled"))
        away = events["surface"] != recording.surface_index("outgoing")
        away &= events["t"] > landed[events["particle"]]
        there[events["particle"][away]] = False
        for row, entry in zip(found, ("belt_work", "friction_loss"), strict=True):
            row[there] = paid(recording, "outgoing", entry)[there]
    return dict(zip(("belt_work", "slip_heat"), found, strict=True))


def from_events(
    scenes: Scene | Family,
    left: NDArray[Any],
    hit: NDArray[Any],
    down: NDArray[Any],
    radius: Numbers,
    mass: Numbers,
) -> dict[str, Floats]:
    """Return what separation, impact and landing tell of `THEORY`, in the paper's frame.

    x2, y2 are counted from the separation point, y down; x3 and v3x back from the plate. The events
    are (N,), of one scene or a family of N, and NaN, as `never` has it, where one did not happen;
    radius (m) and mass (kg) are the particles'.
    """
    value, scene = scenes.value, scenes.scene
    plate = scene.plate
    top = nan if scene.incoming is None else value(scene.incoming, "pulley_radius")
    belt = nan if scene.outgoing is None else value(scene.outgoing, "speed")
    alpha = np.radians(nan if plate is None else value(plate, "angle_deg"))
    (x1, y1), (x2, y2), (x3, y3) = (event["position"].T for event in (left, hit, down))
    (ux, uy), (wx, wy) = hit["velocity_before"].T, hit["velocity_after"].T
    vx, vy = down["velocity_before"].T
    sine, cosine = np.sin(alpha), np.cos(alpha)
    away, along = -(wx * cosine + wy * sine), wx * sine - wy * cosine
    # Rounding must not choose between π and -π for a rebound up along the plate.
    away = np.where(np.abs(away) <= ALONG * np.hypot(wx, wy), 0.0, away)
    energy = 0.5 * mass * (vx * vx + belt * belt)
    return {
        "phi1": np.arctan2(x1, y1),
        "v1": np.hypot(*left["velocity_after"].T),
        "t2": hit["t"] - left["t"],
        "x2": x2 - x1,
        "y2": y1 - y2,
        "v2": np.hypot(ux, uy),
        "v2r": np.hypot(wx, wy),
        "phi2": np.arctan2(ux * cosine + uy * sine, ux * sine - uy * cosine),
        "phi2r": np.arctan2(away, along + 0.0),  # + 0.0: the angle of no rebound is 0, not -π
        "t3": down["t"] - hit["t"],
        "x3": x2 - x3,
        "y3": y2 - y3,
        "v3x": -vx,
        "v3y": -vy,
        "v3": np.hypot(vx, vy),
        "d3": top + radius - y3,
        "dEk": energy,
        "P": energy * scenes.rate,
    }
