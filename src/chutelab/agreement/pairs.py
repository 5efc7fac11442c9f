"""Particle 0 alone in all answers: each against the theory, and against the first of the others.

What counts as agreement follows from how an engine works. Where all contacts are blows there is no
step to go wrong by: exact, contact and pymunk with aligned steps are held to `BLOWS`. Where
contacts last, and with steps that are all alike, the error depends on the step, and what is
promised is that it vanishes as steps shorten, at the order in `ORDERS`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, log, nan
from typing import TYPE_CHECKING, Final

import numpy as np

from chutelab import reference
from chutelab.accuracy.answers import apart, each, sizes
from chutelab.accuracy.witness import changed, stirred
from chutelab.compare import compare
from chutelab.machine import build
from chutelab.recorder import StalledError
from chutelab.recording import Kind
from chutelab.scene import SceneError
from chutelab.simulation import simulate

if TYPE_CHECKING:
    from chutelab.recording import Recording
    from chutelab.scene import Scene

ANSWERS: Final = {
    "theory": ("closed form, NumPy", "nothing, not even the machine"),
    "exact": ("the next event, solved", "mechanics, which place the belt too"),
    "contact": ("impacts, contact dynamics; C", "the machine's arrays"),
    "pymunk": ("Chipmunk's solver, stepped", "the machine's arrays"),
    "dop853": ("SciPy's ODE solver, events", "the machine's arrays"),
}
"""Who answers: how, and what it has in common with other answers. import-linter holds this."""

BLOWS: Final = {"exact": 1e-12, "dop853": 1e-12, "contact": 1e-10, "pymunk": 1e-9}
"""Relative error allowed where all contacts are blows, for inputs whose change comes out no larger
than it went in."""

ORDERS: Final = {"contact": 2.0, "pymunk": 1.0}
"""Order at which the error of a stepped engine vanishes, at least."""

REFINED: Final = 4.0
"""Ratio of one step to the next of the three that show an order."""

CHANCE: Final = {"contact": 0.5, "pymunk": 0.5}
"""By how much the observed order may fall short of `ORDERS`: an error depends on where within a
step things happen. Over two ratios of 4, half an order is a factor of 4 between the errors."""

STIR: Final = 1e-9
"""Share by which inputs are changed to see by how much a scene magnifies a change."""


@dataclass(frozen=True)
class Agreement:
    """One quantity in two answers.

    Attributes
    ----------
    pair : str
        Which two; one, of an answer that is left out.
    quantity : str
        What is compared; or why nothing is.
    difference : float or None
        Relative difference, or the order at which it vanishes; None if nothing is compared.
    tolerance : float or None
        What it must not exceed (with `least`: fall short of); None where nothing is promised.
    least : bool
        Whether the tolerance is one from below.
    """

    pair: str
    quantity: str
    difference: float | None
    tolerance: float | None
    least: bool = False

    @property
    def holds(self) -> bool:
        """Whether the promise, if there is one, is kept."""
        if self.tolerance is None:
            return True
        if self.difference is None:
            return False
        return (
            self.difference >= self.tolerance if self.least else self.difference <= self.tolerance
        )


def agreement(scene: Scene) -> tuple[Agreement, ...]:
    """Run particle 0 of a scene, alone, with every engine and SciPy; compare all answers.

    Raises
    ------
    SceneError
        If the geometry contradicts itself.
    """
    alone = changed(scene, "stream.count=1", "stream.interact=false", "run.engine=auto")
    build(alone)
    found: dict[str, Recording] = {}
    rows: list[Agreement] = []
    for name in ("exact", "dop853", "contact", "pymunk"):
        try:
            found[name] = _run(alone, name)
        except (SceneError, StalledError, reference.UnableError) as error:
            why = error.faults[0].allowed if isinstance(error, SceneError) else str(error)
            rows.append(Agreement(name, f"left out: {why}", None, None))
    if not found:
        return tuple(rows)
    base = next(iter(found))
    growth = _growth(alone, base, found[base])
    blows = not _lasts(alone, found[base])
    for name, recording in found.items():
        even = name not in ORDERS or (blows and (alone.run.align or name == "contact"))
        allowed = BLOWS[name] * growth if even and isfinite(growth) else None
        compared = compare(recording)
        if compared.max is not None:
            what = "largest relative error"
            rows.append(Agreement(f"{name}, theory", what, compared.max, allowed))
        elif name == base:
            rows.append(Agreement(f"{name}, theory", compared.reason, None, None))
        if name != base:
            rows.append(_with_base(alone, name, recording, found[base], allowed))
    if not isfinite(growth):
        rows.append(
            Agreement(base, f"a change of the inputs by {STIR:g} changes what happens", None, None)
        )
    return tuple(rows)


def _run(scene: Scene, name: str) -> Recording:
    return reference.run(build(scene)) if name == "dop853" else simulate(scene, name)


def _distance(one: Recording, other: Recording) -> tuple[float, str]:
    return apart(list(each(one)), list(each(other)), sizes(other), "relative")


def _growth(scene: Scene, name: str, found: Recording) -> float:
    """Return by how much a scene magnifies a change of its inputs, at least 1; inf if it breaks."""
    return max(1.0, _distance(_run(stirred(scene, STIR), name), found)[0] / STIR)


def _lasts(scene: Scene, found: Recording) -> bool:
    """Tell whether anything but gravity acts between blows, apart from the ride by adhesion."""
    track = found.track(0)
    if build(scene).releases.carried[0]:
        left = found.select(Kind.SEPARATION, surface="incoming")
        track = track[track["t"] >= (left["t"][0] if len(left) else inf)]
    time, velocity = np.diff(track["t"]), np.diff(track["velocity"], axis=0)
    velocity[:, 1] += found.gravity * time
    speed = float(np.hypot(*track["velocity"].T).max(initial=0.0))
    return bool((np.abs(velocity[time > 0.0]) > 1e-9 * speed).any())


def _with_base(
    scene: Scene, name: str, recording: Recording, base: Recording, allowed: float | None
) -> Agreement:
    pair = f"{name}, {base.engine}"
    error, which = _distance(recording, base)
    if allowed is None and error <= BLOWS.get(name, 0.0):
        allowed = BLOWS[name]  # no worse than where there is no step to go wrong by
    if allowed is not None or name not in ORDERS:
        what = "largest relative difference" if isfinite(error) else f"they differ in {which}"
        return Agreement(pair, what, error if isfinite(error) else None, allowed)
    errors = [error]
    for n in (1, 2):
        finer = changed(scene, f"run.dt={scene.run.dt / REFINED**n!r}")
        errors.append(_distance(_run(finer, name), base)[0])
    seen = ", ".join(f"{error:.0e}" for error in errors)
    least = ORDERS[name] - CHANCE[name]
    return Agreement(pair, f"order ({seen})", order(errors, REFINED, BLOWS[name]), least, True)


def order(errors: list[float], ratio: float, floor: float) -> float:
    """Return the order at which errors vanish from step to step; inf if all of them are rounding.

    An error may be small by luck, so that counts which is the largest at a step or any finer one.
    """
    worst = np.maximum.accumulate(np.array(errors)[::-1])[::-1]
    if not np.isfinite(worst).all():
        return nan
    if worst[0] <= floor:
        return inf
    last = max(float(worst[-1]), floor)
    # What is down to rounding before the last step got there sooner.
    steps = int(np.argmax(worst <= floor)) if (worst <= floor).any() else len(worst) - 1
    return log(float(worst[0]) / last) / (steps * log(ratio))
