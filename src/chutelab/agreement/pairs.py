"""Particle 0 alone in three answers: exact against theory, pymunk against exact."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab import scene as scenes
from chutelab.compare import compare
from chutelab.recording import Kind
from chutelab.simulation import simulate
from chutelab.theory import predict

if TYPE_CHECKING:
    from chutelab.recording import Recording
    from chutelab.scene import Scene

CLOSED_FORM = 1e-12
"""Relative error allowed to the exact engine: some hundred roundings of a double."""

GRAZING = 1e-3
"""|v_n| / v2 at the plate below which the time of impact loses digits, as 1 over that number."""

NEAR_CRITICAL = 1e-6
"""|1 - v0² / (g Rc)| below which the angle of separation loses digits likewise."""

ALIGNED = 1e-8
"""Distance allowed to steps that end at impacts, as a share of the track's extent."""

STEPS = 3.0
"""Steps' worth of way allowed to fixed steps, which see each contact up to a step late."""

LEAST_RADIUS = 0.002
"""m; smaller disks are beyond what a space in SI units resolves."""


@dataclass(frozen=True)
class Agreement:
    """One quantity in two answers.

    Attributes
    ----------
    pair : str
        Which two.
    quantity : str
        What is compared, with its unit; or why nothing is.
    difference : float or None
        None if one of the two has no such quantity.
    tolerance : float or None
        What it must not exceed; None where no bound is promised.
    """

    pair: str
    quantity: str
    difference: float | None
    tolerance: float | None

    @property
    def holds(self) -> bool:
        """Whether the promise, if there is one, is kept."""
        return self.tolerance is None or (
            self.difference is not None and self.difference <= self.tolerance
        )


def agreement(scene: Scene) -> tuple[Agreement, ...]:
    """Run particle 0 of a scene, alone, with both engines; compare with theory and each other.

    Where the exact engine cannot follow it, that is said instead.

    Raises
    ------
    SceneError
        If the geometry contradicts itself.
    """
    tables = scenes.to_dict(scene)
    stream = {**tables.get("stream", {}), "count": 1, "interact": False}
    run = {**tables.get("run", {}), "engine": "auto"}
    alone = scenes.from_dict({**tables, "stream": stream, "run": run}, scene.source)
    try:
        exact = simulate(alone, engine="exact")
    except scenes.SceneError as error:
        if error.faults[0].key != "run.engine":
            raise
        return (Agreement("exact, theory", error.faults[0].allowed, None, None),)
    return _with_theory(alone, exact), *_with_pymunk(alone, exact)


def _with_theory(scene: Scene, exact: Recording) -> Agreement:
    pair, compared = "exact, theory", compare(exact)
    if compared.max is None:
        return Agreement(pair, compared.reason, None, None)
    return Agreement(pair, "largest relative error", compared.max, CLOSED_FORM / _condition(scene))


def _condition(scene: Scene) -> float:
    """Return by what the rounding errors of a scene have to be divided, 1 for most."""
    found, belt = predict(scene), scene.incoming
    worst = 1.0
    if isfinite(float(found.phi2)) and abs(sin(float(found.phi2))) < GRAZING:
        worst = abs(sin(float(found.phi2)))
    if belt is not None and scene.gravity > 0.0:
        ride = belt.pulley_radius + scene.particle.radius
        critical = abs(1.0 - belt.speed**2 / (scene.gravity * ride))
        if critical < NEAR_CRITICAL:
            worst = min(worst, critical)
    return max(worst, float(np.finfo(float).eps))


def _with_pymunk(scene: Scene, exact: Recording) -> tuple[Agreement, ...]:
    pair = "pymunk, exact"
    if scene.particle.radius == 0.0:
        return (Agreement(pair, "pymunk has no mass points", None, None),)
    stepped = simulate(scene, engine="pymunk")
    allowed = _allowed(scene, exact)
    ways = [_contacts(stepped), _contacts(exact)]
    if ways[0] != ways[1]:
        met, instead = (", ".join(names) or "nothing" for names in ways)
        return (Agreement(pair, f"it meets {met} instead of {instead}", None, allowed),)
    rows = []
    for kind, what in ((Kind.IMPACT, "place of the impact, m"), (Kind.LANDING, "landing, m")):
        mine, other = _first(stepped, kind), _first(exact, kind)
        if mine is not None and other is not None:
            apart = float(np.hypot(*(mine["position"] - other["position"])))
            rows.append(Agreement(pair, what, apart, allowed))
    return tuple(rows) or (Agreement(pair, "they touch nothing", None, None),)


def _allowed(scene: Scene, exact: Recording) -> float | None:
    """Return how far the pymunk engine may be off, m; None where no bound is promised."""
    track = exact.track(0)
    if scene.particle.radius < LEAST_RADIUS:
        return None
    # A grip that slips is stepped, and converges too slowly for a bound.
    if scene.incoming is not None and scene.incoming.friction != "adhesion":
        return None
    if scene.run.align:
        return ALIGNED * float(np.abs(track["position"]).max())
    from chutelab.stepper import HALF_THICKNESS

    way = scene.run.dt * float(np.hypot(*track["velocity"].T).max())
    return STEPS * way if way < scene.particle.radius + HALF_THICKNESS else None


def _first(recording: Recording, kind: Kind) -> Any | None:
    """Return the first event of a kind of particle 0, None if there is none."""
    events = recording.select(kind)
    own = events[events["particle"] == 0]
    return own[0] if len(own) else None


def _contacts(recording: Recording) -> list[str]:
    """Return the surfaces that particle 0 meets up to its landing, or the first without one."""
    own = recording.events[recording.events["particle"] == 0]
    met = own[np.isin(own["kind"], [Kind.IMPACT, Kind.LANDING])]
    landed = np.flatnonzero(met["kind"] == Kind.LANDING)
    last = landed[0] if landed.size else 0
    return [recording.surfaces[surface] for surface in met["surface"][: last + 1]]
