"""The ``[[expect]]`` of a scene beside what each engine, and the theory, give."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, isfinite, nan, radians
from typing import TYPE_CHECKING

from chutelab.agreement.measure import measure
from chutelab.agreement.pairs import Agreement, agreement
from chutelab.compare import relative_error, scales
from chutelab.ledger import ledger
from chutelab.scene import SceneError
from chutelab.scene.measures import SYMBOLS, unit_of
from chutelab.simulation import simulate
from chutelab.theory import predict

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.recording import Recording
    from chutelab.scene import Expect, Scene
    from chutelab.theory import Transfer

ENGINES = ("exact", "contact", "pymunk")

MOST_ALONE = 50
"""Particles that do not meet get a pymunk space each; beyond this many it takes minutes."""

KINDS = {
    "m": "length", "m/s": "speed", "s": "time", "degrees": "angle", "J": "energy", "W": "power",
}  # fmt: skip
"""Kind of quantity, as `chutelab.compare.scales` has them, by unit."""


@dataclass(frozen=True)
class Finding:
    """One expectation of a scene, looked at in one answer.

    Attributes
    ----------
    quantity, unit, source : str
        What was looked at, in what unit, and who says what it should be.
    engine : str
        ``exact``, ``contact``, ``pymunk`` or ``theory``.
    expected, simulated : float
        In `unit`; NaN where the theory, or the run, has none.
    error : float
        Relative (see `chutelab.compare`), or in `unit`; NaN if one of the two is.
    tolerance : float or None
        What the error must not exceed; None where nothing is promised.
    relative : bool
        Whether error and tolerance are relative.
    """

    quantity: str
    unit: str
    source: str
    engine: str
    expected: float
    simulated: float
    error: float
    tolerance: float | None
    relative: bool

    @property
    def holds(self) -> bool:
        """Whether the promise, if there is one, is kept; NaN keeps none."""
        return self.tolerance is None or self.error <= self.tolerance


@dataclass(frozen=True)
class Verification:
    """All that `chutelab verify` finds out about a scene.

    Attributes
    ----------
    findings : tuple of Finding
        In the order of the file, each with a row for every answer that has the quantity.
    agreements : tuple of Agreement
        Particle 0 alone, in the three answers.
    skipped : dict of str
        Engines that did not run the scene, and why.
    """

    findings: tuple[Finding, ...]
    agreements: tuple[Agreement, ...]
    skipped: dict[str, str]

    @property
    def failures(self) -> int:
        """How many promises are broken."""
        rows: tuple[Finding | Agreement, ...] = (*self.findings, *self.agreements)
        return sum(not row.holds for row in rows)


def verify(scene: Scene, progress: Callable[[float], None] | None = None) -> Verification:
    """Run a scene on every engine that applies; look at what it is expected to show.

    Raises
    ------
    SceneError
        If no engine can run it.
    """
    skipped = _skipped(scene) if scene.expect else {}
    recordings: dict[str, Recording] = {}
    for engine in ENGINES:
        if scene.expect and engine not in skipped:
            try:
                recordings[engine] = simulate(scene, engine, progress)
            except SceneError as error:
                if error.faults[0].key != "run.engine":
                    raise
                skipped[engine] = error.faults[0].allowed
    prediction = predict(scene)
    findings: list[Finding] = []
    for expect in scene.expect:
        findings += [
            _found(scene, expect, engine, recording, prediction)
            for engine, recording in recordings.items()
        ]
        findings += _by_theory(scene, expect, prediction)
    return Verification(tuple(findings), agreement(scene), skipped)


def _skipped(scene: Scene) -> dict[str, str]:
    """Return the engines that a scene is not for, with the reason."""
    stream = scene.stream
    if stream.interact and stream.count > 1:
        return {"exact": "particles meet each other"}
    if scene.particle.radius == 0.0:
        return dict.fromkeys(("contact", "pymunk"), "it has no mass points")
    if stream.count > MOST_ALONE:
        return {"pymunk": f"{stream.count} particles that do not meet would take it minutes"}
    return {}


def _found(
    scene: Scene, expect: Expect, engine: str, recording: Recording, prediction: Transfer
) -> Finding:
    simulated = measure(recording, expect.quantity, scene)
    scale = None
    if expect.quantity.startswith("ledger."):
        # Each entry is measured by itself, but what should be nothing by what was turned over.
        residual = expect.quantity == "ledger.residual"
        scale = ledger(recording).turned_over if residual else 0.0
    return _finding(scene, expect, engine, simulated, prediction, scale)


def _by_theory(scene: Scene, expect: Expect, prediction: Transfer) -> list[Finding]:
    """Return what the theory has to say of an expectation that is not its own."""
    if expect.value == "theory" or expect.quantity not in SYMBOLS:
        return []
    answer = _predicted(prediction, expect.quantity)
    if not isfinite(answer):
        return []
    return [_finding(scene, expect, "theory", answer, prediction, None)]


def _predicted(prediction: Transfer, symbol: str) -> float:
    if symbol.endswith("_deg"):
        return degrees(float(getattr(prediction, symbol.removesuffix("_deg"))))
    return float(getattr(prediction, symbol))


def _finding(
    scene: Scene,
    expect: Expect,
    engine: str,
    simulated: float,
    prediction: Transfer,
    scale: float | None,
) -> Finding:
    unit = unit_of(expect.quantity, scene.surfaces)
    assert unit is not None
    expected = (
        _predicted(prediction, expect.quantity)
        if isinstance(expect.value, str)
        else float(expect.value)
    )
    allowed = expect.allowed(engine)
    relative = allowed is None or allowed[1] == "%"
    if scale is None:
        scale = scales(scene, prediction)[KINDS[unit]] if unit else 0.0
    if not isfinite(expected) or not isfinite(simulated):
        error = nan
    elif not relative:
        error = abs(simulated - expected)
    elif unit == "degrees":
        error = relative_error(radians(simulated), radians(expected), scale)
    else:
        error = relative_error(simulated, expected, scale)
    return Finding(
        quantity=expect.quantity,
        unit=unit,
        source=expect.source,
        engine=engine,
        expected=expected,
        simulated=simulated,
        error=error,
        tolerance=None if allowed is None else allowed[0],
        relative=relative,
    )
