"""Simulated against theory, quantity by quantity, for particle 0.

One error serves everywhere: |simulated - theory| / max(|theory|, scale), where the scale is what
the quantity is measured by in its scene: d1 for lengths, v2 for speeds, t2 + t3 for times, 1 rad
for angles, ½ m v2² for energies.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, isfinite, nan
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.results.ledger import ledger
from chutelab.results.recording import EVENT, REASONS, Kind, Recording
from chutelab.scene import Scene
from chutelab.theory import Transfer
from chutelab.util.arrays import Floats
from chutelab.util.tables import Sheet, Shown, number

QUANTITIES = {
    "phi1": "angle", "t2": "time", "x2": "length", "y2": "length", "v2": "speed", "phi2": "angle",
    "phi2r": "angle", "v2r": "speed", "t3": "time", "x3": "length", "y3": "length",
    "v3x": "speed", "v3y": "speed", "v3": "speed", "d3": "length", "dEk": "energy", "P": "power",
    "belt_work": "energy", "slip_heat": "energy",
}  # fmt: skip
"""What is compared, under the paper's symbols, and what kind of quantity it is."""

UNITS = {
    "angle": "°", "time": "s", "length": "m", "speed": "m/s", "energy": "J", "power": "W",
}  # fmt: skip
"""What each kind is shown in."""

MEANINGS = {
    "phi1": "angle of separation",
    "t2": "time from there to the plate",
    "x2": "way forward to the plate",
    "y2": "fall to the plate",
    "v2": "speed at the plate",
    "phi2": "angle to the plate, before",
    "phi2r": "angle to the plate, after",
    "v2r": "speed after the impact",
    "t3": "time from there to landing",
    "x3": "way back from the plate",
    "y3": "fall from impact to landing",
    "v3x": "landing velocity, back",
    "v3y": "landing velocity, down",
    "v3": "landing speed",
    "d3": "height of the transfer",
    "dEk": "energy, Eq. (14)",
    "P": "power, Eq. (15)",
    "belt_work": "belt work until no slip",
    "slip_heat": "slip heat until then",
}


ALONG = 1e-14
"""Share of the rebound speed below which its part away from the plate is rounding."""


@dataclass(frozen=True, repr=False)
class Comparison(Shown):
    """Particle 0 of a recording beside the theory, SI units and radians.

    Attributes
    ----------
    simulated, theory : dict of float
        All `QUANTITIES`; NaN where the particle, or the theory, does not get so far.
    errors : dict of float
        Relative errors of the quantities that both have.
    reason : str
        Why the theory stops, "" if it does not.
    """

    simulated: dict[str, float]
    theory: dict[str, float]
    errors: dict[str, float]
    reason: str

    @property
    def max(self) -> float | None:
        """Largest of the errors; None if nothing could be compared."""
        return max(self.errors.values(), default=None)

    def sheet(self) -> Sheet:
        """Return every quantity that one of the two has, and the largest error."""
        rows = []
        for name, kind in QUANTITIES.items():
            simulated, theory = (
                degrees(values[name]) if kind == "angle" else values[name]
                for values in (self.simulated, self.theory)
            )
            if isfinite(simulated) or isfinite(theory):
                error = f"{self.errors[name]:.1e}" if name in self.errors else ""
                what = f"{MEANINGS[name]}, {UNITS[kind]}"
                rows.append((name, what, number(simulated), number(theory), error))
        foot: list[tuple[str, ...]] = []
        if self.max is not None:
            foot = [("max", "largest relative error", "", "", f"{self.max:.1e}")]
        begun = any(isfinite(value) for value in self.theory.values())
        ends = "No closed form from here on" if begun else "No closed form"
        return Sheet(
            "Particle 0",
            ("", "", "simulated", "theory", "error"),
            tuple(rows),
            foot=tuple(foot),
            texts=2,
            notes=(f"{ends}; {self.reason}",) if self.reason else (),
        )


def compare(recording: Recording) -> Comparison:
    """Compare particle 0 with the theory's prediction for its scene."""
    scene, prediction = recording.scene, recording.prediction
    theory = {name: float(getattr(prediction, name)) for name in QUANTITIES}
    found = observed(recording, scene)
    sizes = scales(scene, prediction)
    return Comparison(
        simulated=found,
        theory=theory,
        errors={
            name: relative_error(found[name], theory[name], sizes[kind])
            for name, kind in QUANTITIES.items()
            if isfinite(theory[name]) and isfinite(found[name])
        },
        reason=str(prediction.reason),
    )


def relative_error(simulated: float, theory: float, scale: float) -> float:
    """Return |simulated - theory| / max(|theory|, scale).

    A scale of NaN counts as 0; where the theory is 0 as well, the difference itself is returned.
    """
    return float(relative_errors(simulated, theory, scale))


def relative_errors(simulated: ArrayLike, theory: ArrayLike, scale: ArrayLike) -> Floats:
    """Return what `relative_error` does, of arrays."""
    off = np.abs(np.subtract(simulated, theory))
    size = np.fmax(np.abs(theory), np.where(np.isfinite(scale), scale, 0.0))
    return np.asarray(off / np.where(size > 0.0, size, 1.0))


def scales(scene: Scene, prediction: Transfer) -> dict[str, Any]:
    """Return the scale of each kind of quantity in a scene; NaN where the theory has none.

    Floats, or arrays (N,) where scene and prediction have such.
    """
    v2, t2, t3 = prediction.v2, prediction.t2, prediction.t3
    energy = 0.5 * scene.particle.mass * (v2 * v2)
    d1: Any = nan
    if scene.incoming is not None and scene.plate is not None:
        d1 = scene.incoming.pulley_radius + scene.plate.distance
    found = {
        "length": d1,
        "speed": v2,
        "time": np.where(np.isfinite(t3), t2 + t3, t2),
        "angle": 1.0,
        "energy": energy,
        "power": energy * scene.stream.rate,
    }
    return {kind: float(size) if np.ndim(size) == 0 else size for kind, size in found.items()}


def observed(recording: Recording, scene: Scene) -> dict[str, float]:
    """Return the `QUANTITIES` of particle 0 as the recording has them, see `from_events`."""
    out = dict.fromkeys(QUANTITIES, nan)
    own = recording.events[recording.events["particle"] == 0]
    left = _first(recording, own, "incoming", Kind.SEPARATION)
    hit = _first(recording, own, "plate", Kind.IMPACT)
    down = _first(recording, own, "outgoing", Kind.LANDING)
    landing = recording.surface_index("outgoing")
    hit = hit if left is not None else None
    down = down if hit is not None else None
    events = (_NEVER if event is None else event for event in (left, hit, down))
    out |= {name: float(value) for name, value in from_events(scene, *events).items()}
    # What the belt pays until there is no slip is known only of a particle that got there, and had
    # nothing but the belt to do with since it landed.
    settled = recording.count == 1 and REASONS[recording.ended[0]] == "settled"
    if down is not None and settled and (own["surface"][own["t"] > down["t"]] == landing).all():
        entries = ledger(recording).by_surface.get("outgoing")
        if entries is not None:
            out["belt_work"], out["slip_heat"] = entries["belt_work"], entries["friction_loss"]
    return out


def from_events(scene: Scene, left: Any, hit: Any, down: Any) -> dict[str, Any]:
    """Return what separation, impact and landing tell of the `QUANTITIES`, in the paper's frame.

    x2, y2 are counted from the separation point, y down; x3 and v3x back from the plate.

    Parameters
    ----------
    scene : Scene
        One, or a family of them, see `chutelab.scene.variants`.
    left, hit, down : of dtype `EVENT`
        One of each, or arrays (N,); with NaN, as `never` has it, where one did not happen.
    """
    plate, top, belt = scene.plate, nan, nan
    if scene.incoming is not None:
        top = scene.incoming.pulley_radius
    if scene.outgoing is not None:
        belt = scene.outgoing.speed
    alpha = np.radians(nan if plate is None else plate.angle_deg)
    (x1, y1), (x2, y2), (x3, y3) = (np.moveaxis(e["position"], -1, 0) for e in (left, hit, down))
    (ux, uy), (wx, wy) = (np.moveaxis(hit[f"velocity_{w}"], -1, 0) for w in ("before", "after"))
    vx, vy = np.moveaxis(down["velocity_before"], -1, 0)
    sine, cosine = np.sin(alpha), np.cos(alpha)
    away, along = -(wx * cosine + wy * sine), wx * sine - wy * cosine
    # Rounding must not choose between π and -π for a rebound up along the plate.
    away = np.where(np.abs(away) <= ALONG * np.hypot(wx, wy), 0.0, away)
    energy = 0.5 * scene.particle.mass * (vx * vx + belt * belt)
    return {
        "phi1": np.arctan2(x1, y1),
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
        "d3": top + scene.particle.radius - y3,
        "dEk": energy,
        "P": energy * scene.stream.rate,
    }


def never(count: int) -> NDArray[Any]:
    """Return events (count,) that did not happen: NaN throughout."""
    events = np.zeros(count, dtype=EVENT)
    for name in ("t", "position", "velocity_before", "velocity_after"):
        events[name] = nan
    return events


_NEVER = never(1)[0]


def _first(recording: Recording, events: Any, surface: str, kind: Kind) -> Any | None:
    """Return the first event of a kind on a surface, None if there is none."""
    match = (events["kind"] == kind) & (events["surface"] == recording.surface_index(surface))
    return events[match][0] if match.any() else None
