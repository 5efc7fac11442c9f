"""Simulated against theory, quantity by quantity, for particle 0.

One error serves everywhere: |simulated - theory| / max(|theory|, scale), where the scale is what
the quantity is measured by in its scene: d1 for lengths, v2 for speeds, t2 + t3 for times, 1 rad
for angles, ½ m v2² for energies.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from math import atan2, cos, degrees, hypot, isfinite, nan, radians, sin
from typing import TYPE_CHECKING, Any

from chutelab import scene as scenes
from chutelab.ledger import ledger
from chutelab.recording import REASONS, Kind
from chutelab.sheet import Sheet, Shown, number
from chutelab.theory import predict

if TYPE_CHECKING:
    from chutelab.recording import Recording
    from chutelab.scene import Scene
    from chutelab.theory import Transfer

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
    "belt_work": "work of the outgoing belt",
    "slip_heat": "heat of the slip on it",
}


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


def scene_of(recording: Recording) -> Scene:
    """Return the scene a recording was made from."""
    return scenes.from_dict(json.loads(recording.scene), recording.title)


def compare(recording: Recording) -> Comparison:
    """Compare particle 0 with the theory's prediction for its scene."""
    scene = scene_of(recording)
    prediction = predict(scene)
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
    size = max(abs(theory), scale if isfinite(scale) else 0.0)
    return abs(simulated - theory) / size if size > 0.0 else abs(simulated - theory)


def scales(scene: Scene, prediction: Transfer) -> dict[str, float]:
    """Return the scale of each kind of quantity in a scene; NaN where the theory has none."""
    v2, t2, t3 = (float(getattr(prediction, name)) for name in ("v2", "t2", "t3"))
    energy = 0.5 * scene.particle.mass * v2**2
    d1 = nan
    if scene.incoming is not None and scene.plate is not None:
        d1 = scene.incoming.pulley_radius + scene.plate.distance
    return {
        "length": d1,
        "speed": v2,
        "time": t2 + t3 if isfinite(t3) else t2,
        "angle": 1.0,
        "energy": energy,
        "power": energy * scene.stream.rate,
    }


def observed(recording: Recording, scene: Scene) -> dict[str, float]:
    """Return the `QUANTITIES` of particle 0 as the recording has them, in the paper's frame.

    x2, y2 are counted from the separation point, y down; x3 and v3x back from the plate.
    """
    out = dict.fromkeys(QUANTITIES, nan)
    own = recording.events[recording.events["particle"] == 0]
    left = _first(recording, own, "incoming", Kind.SEPARATION)
    hit = _first(recording, own, "plate", Kind.IMPACT)
    down = _first(recording, own, "outgoing", Kind.LANDING)
    if left is not None:
        out["phi1"] = atan2(*left["position"])
    if hit is not None and left is not None and scene.plate is not None:
        alpha = radians(scene.plate.angle_deg)
        before, after = hit["velocity_before"], hit["velocity_after"]
        out["t2"] = float(hit["t"] - left["t"])
        out["x2"] = float(hit["position"][0] - left["position"][0])
        out["y2"] = float(left["position"][1] - hit["position"][1])
        out["v2"], out["v2r"] = hypot(*before), hypot(*after)
        for name, (vx, vy), sign in (("phi2", before, 1.0), ("phi2r", after, -1.0)):
            into = sign * (vx * cos(alpha) + vy * sin(alpha))
            out[name] = atan2(into, vx * sin(alpha) - vy * cos(alpha))
    if down is not None and hit is not None and scene.outgoing is not None:
        vx, vy = (float(component) for component in down["velocity_before"])
        mass = recording.particle.mass
        out["t3"] = float(down["t"] - hit["t"])
        out["x3"] = float(hit["position"][0] - down["position"][0])
        out["y3"] = float(hit["position"][1] - down["position"][1])
        out["v3x"], out["v3y"], out["v3"] = -vx, -vy, hypot(vx, vy)
        top = scene.incoming.pulley_radius if scene.incoming is not None else nan
        out["d3"] = top + recording.particle.radius - float(down["position"][1])
        out["dEk"] = 0.5 * mass * (vx**2 + scene.outgoing.speed**2)
        out["P"] = out["dEk"] * scene.stream.rate
    # What the belt pays until there is no slip is known only of a particle that got there.
    if recording.count == 1 and REASONS[recording.ended[0]] == "settled":
        entries = ledger(recording).by_surface.get("outgoing")
        if entries is not None:
            out["belt_work"], out["slip_heat"] = entries["belt_work"], entries["friction_loss"]
    return out


def _first(recording: Recording, events: Any, surface: str, kind: Kind) -> Any | None:
    """Return the first event of a kind on a surface, None if there is none."""
    match = (events["kind"] == kind) & (events["surface"] == recording.surface_index(surface))
    return events[match][0] if match.any() else None
