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
from numpy.typing import ArrayLike

from chutelab.results.quantities import QUANTITIES, observed
from chutelab.results.recording import Recording
from chutelab.scene import Scene
from chutelab.scene.rules import SYMBOLS
from chutelab.scene.units import with_unit
from chutelab.theory import Transfer
from chutelab.util.arrays import Floats
from chutelab.util.tables import Sheet, Shown, number

MEANINGS = {
    "phi1": "angle of separation",
    "t2": "time of flight to the plate",
    "x2": "distance forward to the plate",
    "y2": "fall to the plate",
    "v2": "speed at the plate",
    "phi2": "angle to the plate, before",
    "phi2r": "angle to the plate, after",
    "v2r": "speed after the impact",
    "t3": "time of flight to the landing",
    "x3": "distance back from the plate",
    "y3": "fall from impact to landing",
    "v3x": "landing velocity, back",
    "v3y": "landing velocity, down",
    "v3": "landing speed",
    "d3": "height of the transfer",
    "dEk": "the paper's energy, Eq. (14)",
    "P": "the paper's power, Eq. (15)",
    "belt_work": "belt work until no slip",
    "slip_heat": "slip heat until no slip",
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

    def sheet(self, *, details: bool = False) -> Sheet:
        """Return every quantity that one of the two has, and the largest error.

        Beside the paper's power is the true one, the belt work at the same rate of particles.
        Errors are in percent; with `details` they are as they are, down to rounding.
        """

        def written(error: float) -> str:
            return f"{error:.1e}" if details else f"{100.0 * error:.3f}"

        rows = []
        energy, power = self.theory["dEk"], self.theory["P"]
        rate = power / energy if energy > 0.0 else nan
        for name, unit in zip(QUANTITIES, SYMBOLS.values(), strict=True):
            simulated, theory = self.simulated[name], self.theory[name]
            if unit == "degrees":
                simulated, theory = degrees(simulated), degrees(theory)
            if isfinite(simulated) or isfinite(theory):
                error = written(self.errors[name]) if name in self.errors else ""
                what = with_unit(MEANINGS[name], unit)
                rows.append((name, what, number(simulated), number(theory), error))
                if name == "belt_work" and isfinite(rate):
                    true = (number(rate * simulated), number(rate * theory))
                    rows.append(("", "its power, to compare with P, W", *true, ""))
        foot: list[tuple[str, ...]] = []
        if self.max is not None:
            foot = [("max", "largest relative error", "", "", written(self.max))]
        begun = any(isfinite(value) for value in self.theory.values())
        ends = "No closed form from here on" if begun else "No closed form"
        return Sheet(
            "Particle 0",
            ("", "", "simulated", "theory", "error" if details else "error, %"),
            tuple(rows),
            foot=tuple(foot),
            texts=2,
            notes=(f"{ends}; {self.reason}",) if self.reason else (),
        )


def compare(recording: Recording) -> Comparison:
    """Compare particle 0 with the theory's prediction for its scene."""
    scene, prediction = recording.scene, recording.prediction
    theory = {name: float(getattr(prediction, name)) for name in QUANTITIES}
    found = observed(recording)
    sizes = scales(scene, prediction)
    return Comparison(
        simulated=found,
        theory=theory,
        errors={
            name: float(relative_error(found[name], theory[name], sizes[kind]))
            for name, kind in QUANTITIES.items()
            if isfinite(theory[name]) and isfinite(found[name])
        },
        reason=str(prediction.reason),
    )


def relative_error(simulated: ArrayLike, theory: ArrayLike, scale: ArrayLike) -> Floats:
    """Return |simulated - theory| / max(|theory|, scale), of numbers or arrays.

    A scale of NaN counts as 0; where the theory is 0 as well, the difference itself is returned.
    """
    off = np.abs(np.subtract(simulated, theory))
    size = np.fmax(np.abs(theory), np.where(np.isfinite(scale), scale, 0.0))
    return np.asarray(off / np.where(size > 0.0, size, 1.0))


def scales(scene: Scene, prediction: Transfer) -> dict[str, Any]:
    """Return the scale of each kind of quantity in a scene; NaN where the theory has none.

    Floats, or arrays (N,) where scene and prediction have such.
    """
    v2, t2, t3 = prediction.v2, prediction.t2, prediction.t3
    energy = 0.5 * scene.particles[scene.kinds[0]].mass * (v2 * v2)
    d1: Any = nan
    if scene.incoming is not None and scene.plate is not None:
        d1 = scene.incoming.pulley_radius + scene.plate.distance
    found = {
        "length": d1,
        "speed": v2,
        "time": np.where(np.isfinite(t3), t2 + t3, t2),
        "angle": 1.0,
        "energy": energy,
        "power": energy * scene.rate,
    }
    return {kind: float(size) if np.ndim(size) == 0 else size for kind, size in found.items()}
