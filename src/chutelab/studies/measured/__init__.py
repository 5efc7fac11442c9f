"""Measured tracks: read, compare with the model, fit.

>>> from chutelab import load, measured
>>> film = measured.read("perpendicular-track")
>>> found = measured.fit(load("perpendicular"), film, ["plate.restitution", "incoming.speed"])
>>> [f"{value:.2f}" for value in found.values]
['0.62', '1.90']

`fit` finds by least squares the parameters with which the simulation agrees best with the measured
points: numbers of a scene, and the placement of the points in the world. Units and bounds are those
of the scene's own validation, read from its JSON Schema. It needs ``pip install "chutelab[fit]"``.

- `track`: a `Track`, points with their times, their placement in the world (`Placement`), and their
  distance from the simulation (`Residuals`).
- `reading`: the files that the video-analysis program Tracker exports, as tracks; the shipped one
  was made from a simulation with noise, so the right answer is known.
- `result`: the result of a fit, warnings about it, and its files.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from chutelab.results import Recording
from chutelab.scene import MISSING, AnyScene, Fault, Scene, SceneError, load, shown, to_dict
from chutelab.scene.overrides import at_path, joined, limits_of, names_of, resolved, rule_at
from chutelab.studies.measured import result
from chutelab.studies.measured.reading import find, read
from chutelab.studies.measured.result import Fit, Parameter
from chutelab.studies.measured.track import (
    LARGEST,
    LEAST,
    MeasuredError,
    Placement,
    Residuals,
    Track,
    best_t0,
    follow,
    inside,
    over,
    residuals,
    run,
)
from chutelab.util.arrays import Bools, Floats
from chutelab.util.errors import did_you_mean, library

__all__ = [
    "Fit", "MeasuredError", "Placement", "Residuals", "Track", "find", "fit", "read",
    "residuals",
]  # fmt: skip

SMALLEST: Final = 1e-6
"""Share of its start: lower bound in the search for a number that must be positive. A fit of
parameters that the points do not determine is driven to a bound by rounding, and next to 0 a length
has no direction."""


def placements(track: Track) -> dict[str, Parameter]:
    """Return the parameters of a track's `Placement` that can be fitted."""
    place, anything = track.placement, (-LARGEST, LARGEST)
    found = (
        Parameter("t0", "s", place.t0, *anything),
        Parameter("scale", "m per unit", place.scale, SMALLEST * place.scale, LARGEST),
        Parameter("origin.x", "file units", place.origin[0], *anything),
        Parameter("origin.y", "file units", place.origin[1], *anything),
    )
    return {one.key: one for one in found}


def resolve(scene: Scene, track: Track, keys: Sequence[str]) -> tuple[Parameter, ...]:
    """Return the parameters that keys name.

    Raises a `MeasuredError` with all keys that are unknown, not numbers, without a starting value,
    or given twice.
    """
    document, placed = to_dict(scene, defaults=True), placements(track)
    faults: list[Fault] = []
    found: list[Parameter] = []
    if not keys:
        faults.append(Fault("fit", None, "name at least one key, such as plate.restitution"))
    for key in keys:
        known = placed.get(key) or _of_scene(document, key, placed)
        if isinstance(known, str):
            faults.append(Fault(f"fit {key}", None, known))
        elif any(resolved(document, key) == resolved(document, one.key) for one in found):
            faults.append(Fault(f"fit {key}", None, "given twice"))
        else:
            found.append(known)
    if faults:
        raise MeasuredError(scene.source, faults)
    return tuple(found)


def changed(
    scene: Scene, track: Track, parameters: Sequence[Parameter], values: Sequence[float]
) -> tuple[Scene, Track]:
    """Return scene and track with the values of some parameters changed.

    Raises a `SceneError` if the scene refuses a value, or values contradict each other.
    """
    given = {one.key: float(value) for one, value in zip(parameters, values, strict=True)}
    place = {key: given.pop(key, one.start) for key, one in placements(track).items()}
    origin = place["origin.x"], place["origin.y"]
    moved = track.placed(t0=place["t0"], scale=place["scale"], origin=origin)
    return scene.with_values(given) if given else scene, moved


def _of_scene(document: Mapping[str, Any], key: str, others: Iterable[str]) -> Parameter | str:
    """Return the parameter of a key of the scene, or why there is none, and similar keys."""
    rule = None
    with suppress(ValueError):
        parts = resolved(document, key)
        rule = rule_at(parts)
    if rule is None:
        known = [*numbers(document), *others]
        last = key.rpartition(".")[2]
        near = [name for name in known if name.rpartition(".")[2] == last]
        advice = f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(known)}"
        return f"unknown key; {did_you_mean(key, known, advice, most=3)}"
    head = str(parts[0])
    if document.get(head) in (None, ()):
        return f"the scene has no [{head}]"
    value: Any = at_path(document, parts)
    path, limits = joined(parts), limits_of(rule)
    if value is None or value is MISSING:
        if limits is None:
            return "not a number"
        return f"has no value in this scene; give one to start from, --set {path}=..."
    if limits is None or isinstance(value, (str, bool)):
        return f"{shown(value)} is not a number that can vary continuously"
    low, high = limits
    low = max(low, SMALLEST * value) if low > 0.0 else low
    return Parameter(key, rule.get("x-unit", ""), float(value), low, high)


def numbers(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield the keys of a scene's tables whose values are numbers that can be fitted."""
    tables = {"": document}
    tables |= {f"{head}.": table for head, table in document.items() if isinstance(table, dict)}
    for head, names in names_of(document).items():
        tables |= {f"{head}.{n}.": row for n, row in zip(names, document[head], strict=True)}
    for head, table in tables.items():
        yield from (f"{head}{key}" for key, value in table.items() if isinstance(value, float))


STEP = 1e-6
"""Step of differences, as a share of a parameter's size. Tracks of the exact engine are smooth to
rounding, so a difference over this step is accurate to about 1e-9, and almost no point is so near
an impact."""

SINGULAR = 1e-6
"""Least singular value, relative to the largest, of a Jacobian with columns of equal length: far
above the error of differences, far below what noise allows to measure."""

UNMOVED = 1e-7
"""m; a parameter that moves the points by less when it changes by its own size has no effect."""

PART = 0.1
"""A parameter with at least this share of a combination is named as part of it."""


class Problem:
    """The least-squares problem: p parameters, and which of the P points count, `used`, (P,)."""

    def __init__(self, scene: Scene, track: Track, parameters: tuple[Parameter, ...]) -> None:
        self.scene, self.track, self.parameters = scene, track, parameters
        self.start = np.array([parameter.start for parameter in parameters])
        self.sizes = np.array([parameter.size for parameter in parameters])
        self.used: Bools = np.ones(len(track), dtype=bool)

    def use(self, used: Bools) -> None:
        """Choose the points that count."""
        if 2 * used.sum() <= len(self.start):
            text = f"{2 * used.sum()} coordinates cannot tell {len(self.start)} parameters"
            raise self.refused(text)
        self.used = used

    def refused(self, *said: str) -> MeasuredError:
        """Return the error that says why there is no result."""
        return MeasuredError(self.track.source, [Fault("fit", None, text) for text in said])

    def run(self, values: Floats) -> tuple[Recording, Track]:
        """Return simulation and track with these values."""
        scene, track = changed(self.scene, self.track, self.parameters, values.tolist())
        return run(scene), track

    def tried(self, values: Floats) -> Floats:
        """Return the residuals, or very large ones if the scene refuses the values."""
        try:
            return self.residuals(values)
        except SceneError:
            reach = float(np.ptp(self.track.position)) + 1.0
            return np.full(2 * int(self.used.sum()), 10.0 * reach)

    def residuals(self, values: Floats) -> Floats:
        """Return measured minus simulated coordinates of the points that count, m."""
        recording, track = self.run(values)
        left = track.position[self.used] - follow(recording, track.t[self.used])
        return left.ravel()

    def derivatives(self, values: Floats, steps: ArrayLike = 0.0) -> Floats:
        """Return how the residuals change with the values, (M, p), by differences.

        The steps are small ones, or those given, if they are larger; one-sided at a bound. A column
        is 0 where the scene refuses a step to either side.
        """
        columns = []
        for k, step in enumerate(np.maximum(steps, STEP * self.sizes)):
            sides = []
            for side in (-step, step):
                moved = self.moved(values, k, side)
                try:
                    sides.append((moved[k], self.residuals(moved)))
                except SceneError:
                    sides.append((values[k], self.residuals(values)))
            (low, before), (high, after) = sides
            columns.append((after - before) / ((high - low) or 1.0))
        return np.stack(columns, axis=1)

    def moved(self, values: Floats, k: int, step: float) -> Floats:
        """Return the values with parameter k a step on, but not beyond its bounds."""
        moved = values.copy()
        moved[k] = np.clip(values[k] + step, self.parameters[k].low, self.parameters[k].high)
        return moved

    def elsewhere(self, values: Floats) -> Floats | None:
        """Return values with a smaller sum of squares, found by changing one at a time, or None.

        If the order of events changes (one bounce more before an edge, say), the sum of squares
        jumps, and a descent does not pass it.
        """
        least, best = float(np.sum(self.tried(values) ** 2)), None
        for k, size in enumerate(self.sizes):
            for part in np.linspace(-1.0, 1.0, SEARCHED):
                other = self.moved(values, k, part * size)
                cost = float(np.sum(self.tried(other) ** 2))
                if cost < least * (1.0 - 1e-6):
                    least, best = cost, other
        return best


def without_effect(derivatives: Floats, parameters: Sequence[Parameter]) -> list[str]:
    """Name the parameters that do not move the points at all; see `Problem.derivatives`."""
    moves = np.linalg.norm(derivatives, axis=0) / np.sqrt(len(derivatives))
    return [
        f"{parameter.key} does not move the particle where it was measured: leave it out"
        for parameter, move in zip(parameters, moves, strict=True)
        if move * parameter.size < UNMOVED
    ]


def inseparable(derivatives: Floats, parameters: Sequence[Parameter]) -> list[str]:
    """Name combinations of parameters that the points cannot separate, though each moves them."""
    directions = derivatives / np.linalg.norm(derivatives, axis=0)
    _, values, vectors = np.linalg.svd(directions, full_matrices=False)
    said = []
    for value, vector in zip(values, vectors, strict=True):
        if value < SINGULAR * values[0]:
            *first, last = (
                parameter.key
                for parameter, share in zip(parameters, vector, strict=True)
                if abs(share) > PART
            )
            said.append(
                f"{', '.join(first)} and {last} cannot be told apart: a change of one moves these"
                " points as a change of the others does; fit fewer of them"
            )
    return said


ROUNDS = 5
"""Most fits in a row, each with the points within the simulated time of the one before."""

SEARCHED = 41
"""Values of each parameter, over twice its size, tried when a fit is in a wrong minimum."""

KEPT = 0.9
"""Least share of the points that a better minimum must keep, since with fewer points every sum is
smaller."""

TUNING = 2.0
"""From so many standard deviations on, a robust fit gives a point less weight."""


def fit(scene: AnyScene, track: Track, keys: Sequence[str], *, robust: bool = False) -> Fit:
    """Fit parameters of a scene, or of the placement of a track in it, to a measured track.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        Its values are the start of the fit, its validation gives the bounds.
    track : Track
        See `chutelab.studies.measured.read`.
    keys : sequence of str
        Any numbers of the scene, such as ``plate.restitution``, and of the placement: ``t0``
        (searched everywhere, not only near its start), ``scale``, ``origin.x``, ``origin.y``.
    robust : bool
        Give points that lie far off less weight (soft L1 instead of squares).

    Raises
    ------
    MeasuredError
        If a key cannot be fitted, too few points lie within the simulated time, the points do not
        determine the parameters, or no minimum is found.
    SceneError
        If the scene cannot be run.
    MissingLibraryError
        Without SciPy; says what to install.
    """
    _scipy("optimize")
    scene = load(scene)
    parameters = resolve(scene, track, keys)
    if scene.crowded:
        text = "must be false for a fit, which follows one particle that meets no others"
        raise MeasuredError(scene.source, [Fault("stream.interact", True, text)])
    if "t0" in keys:
        track = track.placed(t0=best_t0(run(scene), track))
        parameters = resolve(scene, track, keys)
    problem = Problem(scene, track, parameters)
    before = over(*problem.run(problem.start))
    problem.use(before.used)
    if said := without_effect(problem.derivatives(problem.start), parameters):
        raise problem.refused(*said)
    best = _descended(problem, problem.start, robust=robust)
    if best is None:
        reason = result.advice(before) or "start nearer to the result"
        raise problem.refused(f"nothing was found near the starting values; {reason}")
    for _ in range(ROUNDS):
        if not result.alike(problem.residuals(best.values)):
            break
        other = problem.elsewhere(best.values)
        found = None if other is None else _descended(problem, other, robust=robust)
        if found is None or found.cost >= best.cost or found.used.sum() < KEPT * best.used.sum():
            problem.use(best.used)
            break
        best = found
    return _judged(problem, best, before, robust=robust)


@dataclass(frozen=True, eq=False)
class _Minimum:
    """The end of a descent, with the statistics of its residuals.

    `cost` is their mean square, m²; `threshold` the residual, m, from which on a robust fit gives a
    point less weight.
    """

    values: Floats
    used: Bools
    cost: float
    threshold: float
    settled: bool


def _descended(problem: Problem, values: Floats, *, robust: bool) -> _Minimum | None:
    """Return the minimum below some values, with the points that lie within its simulated time.

    None if it is so far off that hardly any do.
    """
    parameters = problem.parameters
    threshold, settled = 1.0, False
    used = inside(*problem.run(values))
    for turn in range(2 * ROUNDS if robust else ROUNDS):
        if used.sum() < LEAST:
            return None
        problem.use(used)
        # SciPy's own derivatives would take steps that the scene refuses, and stop there.
        solved = _scipy("optimize").least_squares(
            problem.tried,
            values,
            jac=problem.derivatives,
            bounds=([p.low for p in parameters], [p.high for p in parameters]),
            x_scale=problem.sizes,
            loss="soft_l1" if robust and threshold < 1.0 else "linear",
            f_scale=threshold,
            xtol=1e-12,
            ftol=1e-12,
            gtol=None,
        )
        values = np.asarray(solved.x)
        left = problem.residuals(values)
        # Clamp; 1.0 means off.
        deviation = result.MAD * float(np.median(np.abs(left)))
        previous, threshold = threshold, min(max(TUNING * deviation, 1e-9), 0.99)
        # From the third round on points are only removed, as one at the very end could come and go
        # forever.
        within = inside(*problem.run(values)) & (used | (turn < 2))
        settled = bool((within == used).all()) and bool(solved.success)
        if settled and (not robust or abs(threshold - previous) < 1e-3 * threshold):
            break
        used = within
    return _Minimum(values, problem.used, float(np.mean(left**2)), threshold, settled)


def _judged(problem: Problem, best: _Minimum, before: Residuals, *, robust: bool) -> Fit:
    """Return the result with its uncertainties; refuse undetermined parameters.

    `scipy.optimize.curve_fit` has the covariance of a plain fit, but not that of a robust one, and
    no warning about parameters that cannot be separated.
    """
    parameters, values = problem.parameters, best.values
    derivatives = problem.derivatives(values)
    if said := without_effect(derivatives, parameters) or inseparable(derivatives, parameters):
        raise problem.refused(*said)
    left = problem.residuals(values)
    freedom = len(left) - len(values)
    variance = float(left @ left) / freedom
    scatter = np.sqrt(variance)
    if robust:
        ratio = 1.0 + (left / best.threshold) ** 2
        variance = float((left**2 / ratio).sum()) / freedom / float((ratio**-1.5).mean()) ** 2
        scatter = best.threshold / TUNING
    lengths = np.linalg.norm(derivatives, axis=0)
    inverse = np.linalg.inv((derivatives / lengths).T @ (derivatives / lengths))
    spread = np.sqrt(np.diag(inverse))
    errors = np.sqrt(variance) * spread / lengths
    reach = float(_scipy("special").stdtrit(freedom, 0.975)) * errors
    wide = problem.derivatives(values, errors)
    after = over(*problem.run(values))
    scene, _ = changed(problem.scene, problem.track, parameters, values.tolist())
    found = Fit(
        parameters=parameters,
        values=values,
        errors=errors,
        low=values - reach,
        high=values + reach,
        correlation=inverse / np.outer(spread, spread),
        scatter=float(scatter),
        freedom=freedom,
        before=before,
        after=after,
        scene=scene,
        robust=robust,
        notes=(),
    )
    bent = np.linalg.norm(wide - derivatives, axis=0) / lengths
    return replace(found, notes=tuple(result.notes(found, bent, settled=best.settled)))


def _scipy(name: str) -> Any:
    return library(f"scipy.{name}", "a fit needs SciPy", "fit")
