"""Whether the answers agree: with each other, and with what a scene is expected to show.

`agreement` runs particle 0 alone through all engines and compares each with the theory, and with
the first of the others. `verify` shows the ``[[expect]]`` of a scene beside what each engine and
the theory give.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import groupby, product
from math import inf, isfinite, log, nan, radians
from types import MappingProxyType
from typing import Final

import numpy as np

from chutelab.machine import build
from chutelab.results import Recording
from chutelab.results.ledger import ledger
from chutelab.results.quantities import compare, each, measure, predicted, relative_error, scales
from chutelab.scene import Scene
from chutelab.scene.quantities import lookup
from chutelab.scene.units import with_unit, write_size
from chutelab.studies.accuracy import (
    STIR,
    UNABLE,
    answer,
    because,
    distance,
    stirred,
    whole_distance,
)
from chutelab.theory import predict
from chutelab.util.tables import Sheet

ANSWERS: Final = {
    "theory": ("closed form, NumPy", "nothing, not even the machine"),
    "exact": ("the next event, solved; C", "the machine's arrays"),
    "contact": ("impacts, contact dynamics; C", "the machine's arrays"),
    "pymunk": ("Chipmunk's solver, stepped", "the machine's arrays"),
    "dop853": ("SciPy's ODE solver, events", "the machine's arrays"),
}
"""The answers: how each is found, and what it shares with others."""

BLOWS: Final = {"exact": 1e-12, "dop853": 1e-12, "contact": 1e-10, "pymunk": 1e-9}
"""Relative error allowed if all contacts are impacts and a change of the inputs is not
magnified."""

STEADY: Final = 1e6
"""Magnification of a change of the inputs beyond which the order is not checked: then even a step's
error of 1e-7 leads the particle on another path through the machine."""

ORDERS: Final = {"contact": 2.0, "pymunk": 1.0}
"""Least order of convergence of a stepped engine."""

REFINED: Final = {"contact": ((1.0, 4.0, 16.0),), "pymunk": ((0.5, 1.0), (1.0, 2.0))}
"""Divisors of the scene's step with which the order is measured. The second set is used if the
first shows no order; Pymunk begins with the coarser one, since its steps are slow."""

NEARBY: Final = (1.0, 0.85, 0.7)
"""Each step is also run at these shares of it, and the largest error counts: a single one may be
small by chance, see `CHANCE`."""

CHANCE: Final = {"contact": 0.5, "pymunk": 0.5}
"""By how much the observed order may fall short of `ORDERS`: an error depends on where within a
step things happen. Over two ratios of 4, half an order is a factor of 4 between the errors, over
one of 2 one of 1.4."""

LIES: Final = 1e-6, 1e-4
"""In radii: a particle that never moves by more counts as at rest, and no order is measured. Other
answers may then differ by this at the end, in radii and in weight times radius."""


@dataclass(frozen=True)
class Agreement:
    """One quantity in two answers."""

    pair: tuple[str, ...]  # the two answers; only one if the other is left out
    quantity: str  # what is compared; or why nothing is
    # relative difference, or the order at which it vanishes; None if nothing is compared
    difference: float | None = None
    # upper bound (with `least`: lower bound) of the difference; None if nothing is promised
    tolerance: float | None = None
    least: bool = False  # whether the tolerance is a lower bound

    @property
    def holds(self) -> bool:
        """Whether the promise, if there is one, is kept."""
        if self.tolerance is None or self.difference is None:
            return self.tolerance is None
        beyond = self.difference - self.tolerance
        return beyond >= 0.0 if self.least else beyond <= 0.0


PATIENCE: Final = 300.0
"""Most wall time of one answer, s, so that `verify` ends whatever an engine does."""


def agreement(
    scene: Scene,
    max_seconds: float = PATIENCE,
    known: Mapping[str, Recording] = MappingProxyType({}),
) -> tuple[Agreement, ...]:
    """Run particle 0 of a scene, alone, with every engine and SciPy; compare all answers.

    An answer that takes longer than `max_seconds`, wall time, is left out. If the scene has only
    this particle, the runs in `known` (by engine) are used instead of new ones.

    Raises a `SceneError` if the geometry contradicts itself.
    """
    alone = scene.alone()
    build(alone)
    found: dict[str, Recording] = {}
    rows: list[Agreement] = []
    same = alone == scene.with_values({"expect": None, "live": None})
    for name in ("exact", "dop853", "contact", "pymunk"):
        try:
            ready = known.get(name) if same else None
            found[name] = ready or answer(alone, name, max_seconds=max_seconds)
        except UNABLE as error:
            rows.append(Agreement((name,), f"left out: {because(error)}"))
    if not found:
        return tuple(rows)
    base = next(iter(found))
    if len(found) == 1 and compare(found[base]).max is None:
        return (*rows, Agreement((base, "theory"), compare(found[base]).reason))
    # Magnification of a small change of the inputs; inf if it leads to other contacts.
    try:
        moved = answer(stirred(alone, STIR), base, max_seconds=max_seconds)
        growth = max(1.0, distance(moved, found[base])[0] / STIR)
    except UNABLE:
        growth = inf
    # Whether forces other than gravity act between impacts, apart from the ride by adhesion.
    track = found[base].track(0)
    if found[base].machine.releases.carried[0]:
        # None if it never leaves.
        track = track[track["t"] >= each(found[base], "separation.t")[0]]
    t, velocities = track["t"], track["velocity"]
    time, velocity = np.diff(t), np.diff(velocities, axis=0)
    velocity += found[base].gravity * time[:, None] * found[base].machine.up
    speed = float(np.hypot(*velocities.T).max(initial=0.0))
    way = float(np.ptp(track["position"], axis=0).max(initial=0.0))
    lies = way <= LIES[0] * np.min(found[base].particle.radius)
    blows = not (np.abs(velocity[time > 0.0]) > 1e-9 * speed).any()
    for name, recording in found.items():
        # Pymunk's steps end at impacts only for a lone particle among fixed two-sided surfaces.
        apart = alone.run.align and not (alone.movers or alone.one_sided)
        stepped = name == "pymunk" and not apart
        even = name not in ORDERS or (blows and not stepped)
        allowed = BLOWS[name] * growth if even and isfinite(growth) else None
        if lies and allowed is None:
            allowed = LIES[1]
        compared = compare(recording)
        if compared.max is not None:
            what = "largest relative error"
            rows.append(Agreement((name, "theory"), what, compared.max, allowed))
        elif name == base:
            rows.append(Agreement((name, "theory"), compared.reason))
        if name != base:
            if name in ORDERS and allowed is None and STEADY < growth < inf:
                what = f"a change of the inputs comes out {growth:.0e} times as large"
                rows.append(Agreement((name, base), what))
                continue
            wide = stepped and base not in ("exact", "dop853")
            rows.append(
                _with_base(alone, name, recording, found[base], allowed, max_seconds, wide=wide)
            )
    if not isfinite(growth):
        rows.append(Agreement((base,), f"a change of the inputs by {STIR:g} changes what happens"))
    return tuple(rows)


Off = Callable[[Recording, Recording], tuple[float, str]]
"""Largest difference between two runs, and the quantity that differs most."""


def _with_base(
    scene: Scene, name: str, recording: Recording, base: Recording, allowed: float | None,
    max_seconds: float, *, wide: bool,
) -> Agreement:  # fmt: skip
    """Compare an answer with the base.

    If both engines step over impacts, it depends on chance which grazing contacts they report. With
    `wide`, only the end of the track and the ledger have to converge.
    """
    pair = (name, base.engine)
    error, which = distance(recording, base)
    if allowed is None and error <= BLOWS.get(name, 0.0):
        allowed = BLOWS[name]  # the same tolerance as for an engine without steps
    if allowed is not None or name not in ORDERS:
        what = "largest relative difference" if isfinite(error) else f"they differ in {which}"
        return Agreement(pair, what, error if isfinite(error) else None, allowed)
    runs = {scene.run.dt: recording}
    least = ORDERS[name] - CHANCE[name]
    offs: list[Off] = [distance, *[whole_distance] * wide]
    for parts, off in product(REFINED[name], offs):
        found = _order(scene, name, parts, runs, base, max_seconds, off)
        if isinstance(found, tuple) and found[1] >= least:
            break
    if isinstance(found, str):
        return Agreement(pair, found)
    seen = ", ".join(f"{error:.0e}" for error in found[0])
    return Agreement(pair, f"order ({seen})", found[1], least, True)


def _order(
    scene: Scene, name: str, refined: tuple[float, ...], runs: dict[float, Recording],
    base: Recording, max_seconds: float, off: Off,
) -> tuple[list[float], float] | str:  # fmt: skip
    """Return the errors of an engine at shares of its step and their order; or why there is none.

    Known runs in `runs` (by step) are used, and new ones added. An error that is not finite ends
    the search: its order is NaN, and those of longer steps are not looked for.
    """
    ratio, least = refined[1] / refined[0], ORDERS[name] - CHANCE[name]
    errors, found = [0.0 for _ in refined], nan
    # The longest steps come last: once one of their errors shows the order, larger steps need not
    # be run.
    for level, parts in reversed(list(enumerate(refined))):
        for share in NEARBY:
            step = scene.run.dt / parts * share
            if found >= least and isfinite(found):
                break
            finer = scene.with_values({"run.dt": step, "expect": None})
            try:
                if step not in runs:
                    runs[step] = answer(finer, name, max_seconds=max_seconds)
            except UNABLE as why:
                return f"no order, with steps of {step:.2g} s: {because(why)}"
            errors[level] = max(errors[level], off(runs[step], base)[0])
            if not isfinite(errors[level]):
                return errors[level:], nan
            if not level:
                found = order(errors, ratio, BLOWS[name])
    return errors, found


def order(errors: list[float], ratio: float, floor: float) -> float:
    """Return the order at which errors vanish from step to step; inf if all of them are rounding.

    An error may be small by chance, so each step counts with the largest error at it or any finer
    one.
    """
    worst = np.maximum.accumulate(np.array(errors)[::-1])[::-1]
    if not np.isfinite(worst).all():
        return nan
    if worst[0] <= floor:
        return inf
    last = max(float(worst[-1]), floor)
    # Steps count up to the first whose error is rounding.
    steps = int(np.argmax(worst <= floor)) if (worst <= floor).any() else len(worst) - 1
    return log(float(worst[0]) / last) / (steps * log(ratio))


ENGINES = ("exact", "contact", "pymunk")

MOST_ALONE = 10
"""Each particle that meets no other gets its own Pymunk space; beyond this number only particle 0
is compared."""


@dataclass(frozen=True)
class Finding:
    """One expectation of a scene, checked in one answer."""

    # quantity, unit, and source of the expected value
    quantity: str
    unit: str
    source: str
    engine: str  # ``exact``, ``contact``, ``pymunk`` or ``theory``
    # in `unit`; NaN where the theory, or the run, has none
    expected: float
    simulated: float
    # relative (see `chutelab.results.quantities`), or in `unit`; NaN if one of the two is
    error: float
    tolerance: float | None  # what the error must not exceed; None where nothing is promised
    relative: bool  # whether error and tolerance are relative

    @property
    def holds(self) -> bool:
        """Whether the promise, if there is one, is kept; NaN keeps none."""
        return self.tolerance is None or self.error <= self.tolerance


@dataclass(frozen=True)
class Verification:
    """All that `chutelab verify` finds out about a scene."""

    # in the order of the file, each with a row for every answer that has the quantity
    findings: tuple[Finding, ...]
    agreements: tuple[Agreement, ...]  # particle 0 alone, in the three answers
    skipped: dict[str, str]  # engines that did not run the scene, and why

    @property
    def failures(self) -> int:
        """How many promises are broken."""
        rows: tuple[Finding | Agreement, ...] = (*self.findings, *self.agreements)
        return sum(not row.holds for row in rows)

    def sheets(self, title: str) -> tuple[Sheet, Sheet]:
        """Return what the scene is to show, and its particle 0 in one answer against another."""
        rows: list[tuple[str, ...]] = []
        for (quantity, source, unit), findings in groupby(
            self.findings, lambda row: (row.quantity, row.source, row.unit)
        ):
            rows.append((f"{with_unit(quantity, unit)}: {source}",))
            for row in findings:
                size = "%" if row.relative else unit
                rows.append((
                    row.engine,
                    *(f"{x:.8g}" if isfinite(x) else "-" for x in (row.expected, row.simulated)),
                    write_size(row.error, size, 2) if isfinite(row.error) else "-",
                    "-" if row.tolerance is None else write_size(row.tolerance, size),
                    _verdict(row),
                ))  # fmt: skip
        heads = ("", "expected", "simulated", "error", "tolerance", "") if rows else ("",) * 6
        left_out = tuple(f"{engine} is left out: {why}" for engine, why in self.skipped.items())
        pairs, notes = [], []
        for one in self.agreements:
            said = f"{' - '.join(one.pair)}: {one.quantity}"
            form = ".1f" if one.least else ".1e"
            difference, tolerance = (
                "-" if x is None else f"{x:{form}}" for x in (one.difference, one.tolerance)
            )
            if difference == tolerance == "-":
                notes.append(said)
            else:
                pairs.append((said, difference, ">= " * one.least + tolerance, _verdict(one)))
        alone = "Particle 0 alone, one answer against another"
        return (
            Sheet(title, heads, tuple(rows), tail=1, notes=left_out),
            Sheet(
                alone, ("", "difference", "tolerance", ""), tuple(pairs), tail=1, notes=tuple(notes)
            ),
        )


def _verdict(row: Finding | Agreement) -> str:
    return "" if row.tolerance is None else "ok" if row.holds else "FAILED"


def verify(scene: Scene, *, max_seconds: float = PATIENCE) -> Verification:
    """Run a scene on every engine that applies; look at what it is expected to show.

    An engine that gets stuck, or takes longer than `max_seconds` of wall time, is left out. If none
    is left, all expectations fail.

    Raises a `SceneError` if the geometry contradicts itself.
    """
    build(scene)
    skipped: dict[str, str] = {}
    recordings: dict[str, Recording] = {}
    for engine in ENGINES if scene.expect else ():
        if engine == "pymunk" and recordings and scene.count > MOST_ALONE and not scene.crowded:
            skipped[engine] = (
                f"of {scene.count} particles that do not meet it runs particle 0 alone"
            )
            continue
        promised = any(expect.allowed(engine) is not None for expect in scene.expect)
        if recordings and scene.crowded and not promised:
            skipped[engine] = "nothing is expected of it"
            continue
        try:
            recordings[engine] = answer(scene, engine, max_seconds=max_seconds)
        except UNABLE as error:
            skipped[engine] = because(error)
    prediction = predict(scene)
    findings: list[Finding] = []
    for expect in scene.expect:
        quantity, names = expect.quantity, [str(stream.name) for stream in scene.streams]
        row = lookup(quantity, scene.places, names)
        assert row is not None
        told = predicted(prediction, row)
        values = {engine: measure(recordings[engine], quantity) for engine in recordings}
        if not values:
            values = dict.fromkeys(skipped, nan)
        expected = told
        if not isinstance(expect.value, str):
            expected = float(expect.value)
            # The theory's value of an expectation that has another source.
            if isfinite(told):
                values["theory"] = told
        for engine, simulated in values.items():
            tolerance, size = expect.allowed(engine) or (None, "%")
            # Errors of entries are relative to them, that of the residual to what was turned over.
            scale = 0.0
            if quantity == "ledger.residual":
                scale = ledger(recordings[engine]).turned_over if recordings else nan
            elif row.unit and not quantity.startswith("ledger."):
                scale = scales(scene, prediction).get(row.kind, 0.0)
            off = abs(simulated - expected)
            if size == "%":
                one, other = simulated, expected
                if row.unit == "degrees":
                    one, other = radians(one), radians(other)
                off = float(relative_error(one, other, scale))
            findings.append(
                Finding(
                    quantity, row.unit, expect.source, engine, expected, simulated, off,
                    tolerance, relative=size == "%",
                )
            )  # fmt: skip
    return Verification(tuple(findings), agreement(scene, max_seconds, recordings), skipped)
