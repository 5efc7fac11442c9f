"""Least squares: the parameters with which the simulation follows the measured points best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from chutelab.scene import Fault, Scene, SceneError
from chutelab.studies.measured import result
from chutelab.studies.measured.parameters import (
    STEP,
    Parameter,
    changed,
    inseparable,
    jacobian,
    resolve,
    without_effect,
)
from chutelab.studies.measured.residuals import LEAST, Residuals, best_t0, follow, inside, over, run
from chutelab.studies.measured.result import Fit
from chutelab.studies.measured.track import MeasuredError, Track
from chutelab.util.arrays import Bools, Floats


class Problem:
    """What a fit makes small.

    Attributes
    ----------
    start, sizes : ndarray, shape (p,)
        Of the parameters.
    used : ndarray, shape (P,)
        The points that count.
    """

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

    def at(self, values: Floats) -> tuple[Scene, Track]:
        """Return scene and track with these values."""
        return changed(self.scene, self.track, self.parameters, list(values))

    def laid(self, values: Floats) -> Residuals:
        """Return all points over the simulation with these values."""
        scene, track = self.at(values)
        return over(run(scene), track)

    def within(self, values: Floats) -> Bools:
        """Return which points lie within the simulated time with these values."""
        scene, track = self.at(values)
        return inside(run(scene), track)

    def tried(self, values: Floats) -> Floats:
        """Return the residuals, or very large ones if the scene refuses the values."""
        try:
            return self.residuals(values)
        except SceneError:
            reach = float(np.ptp(self.track.position)) + 1.0
            return np.full(2 * int(self.used.sum()), 10.0 * reach)

    def residuals(self, values: Floats) -> Floats:
        """Return measured minus simulated coordinates of the points that count, m."""
        scene, track = self.at(values)
        recording = run(scene)
        left = track.position[self.used] - follow(recording, track.t[self.used])
        return left.ravel()

    def derivatives(self, values: Floats, steps: Floats | None = None) -> Floats:
        """Return how the residuals change with the values, (M, p), by differences.

        The steps are small ones, or those given, if they are larger.
        """
        small = STEP * self.sizes
        wanted = small if steps is None else np.maximum(steps, small)
        return jacobian(self.residuals, values, wanted, self.parameters)


ROUNDS = 5
"""Fits in a row, each with the points that lie within the time simulated by the one before."""

SEARCHED = 41
"""Values tried of each parameter, over twice its size, when a fit is caught in a wrong minimum."""

KEPT = 0.9
"""Share of the points that a better minimum must keep: it must not do by losing them."""

TUNING = 2.0
"""Standard deviations from which on a robust fit begins to believe a point less."""


def fit(scene: Scene, track: Track, keys: Sequence[str], *, robust: bool = False) -> Fit:
    """Fit parameters of a scene, or of how a track lies in it, to a measured track.

    Parameters
    ----------
    scene : Scene
        Its values are where the fit starts, its validation gives the bounds.
    track : Track
        See `chutelab.studies.measured.read`.
    keys : sequence of str
        Any numbers of the scene, such as ``plate.restitution``, and of the placement: ``t0``
        (looked for everywhere, not only near its start), ``scale``, ``origin.x``, ``origin.y``.
    robust : bool
        Give points that lie far off less weight (soft L1 instead of squares).

    Raises
    ------
    MeasuredError
        If a key cannot be fitted, too few points lie within the simulated time, the points cannot
        tell the parameters, or nothing is found.
    SceneError
        If the scene cannot be run.
    ImportError
        Without SciPy; says what to install.
    """
    least_squares, student = _scipy()
    parameters = resolve(scene, track, keys)
    if scene.stream.interact and scene.stream.count > 1:
        text = "must be false for a fit, which follows one particle that meets no others"
        raise MeasuredError(scene.source, [Fault("stream.interact", True, text)])
    if "t0" in keys:
        started = track.placed(t0=best_t0(run(scene), track))
        parameters = resolve(scene, started, keys)
    else:
        started = track
    problem = Problem(scene, started, parameters)
    before = problem.laid(problem.start)
    problem.use(before.used)
    if said := without_effect(problem.derivatives(problem.start), parameters):
        raise problem.refused(*said)
    best = _descended(problem, problem.start, least_squares, robust=robust)
    if best is None:
        reason = result.advice(before) or "start nearer to the result"
        raise problem.refused(f"nothing was found near the starting values; {reason}")
    for _ in range(ROUNDS):
        if not result.alike(problem.residuals(best.values)):
            break
        other = _elsewhere(problem, best.values)
        found = None
        if other is not None:
            found = _descended(problem, other, least_squares, robust=robust)
        if found is None or found.cost >= best.cost or found.used.sum() < KEPT * best.used.sum():
            problem.use(best.used)
            break
        best = found
    return _judged(problem, best, before, student, robust=robust)


@dataclass(frozen=True, eq=False)
class _Minimum:
    """Where a descent came to rest, and what it says of the residuals there.

    `cost` is their mean square, m²; `threshold` the residual, m, from which on a robust fit
    believes a point less.
    """

    values: Floats
    used: Bools
    cost: float
    threshold: float
    settled: bool


def _descended(
    problem: Problem, values: Floats, least_squares: Any, *, robust: bool
) -> _Minimum | None:
    """Return the minimum below some values, with the points that lie within its simulated time.

    None if it lies so far off that hardly any do.
    """
    parameters = problem.parameters
    threshold, settled = 1.0, False
    used = problem.within(values)
    for turn in range(2 * ROUNDS if robust else ROUNDS):
        if used.sum() < LEAST:
            return None
        problem.use(used)
        solved = least_squares(
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
        previous, threshold = threshold, _threshold(left)
        within = problem.within(values)
        # From the third turn on points only leave: one at the very end could come and go forever.
        within &= used | (turn < 2)
        settled = bool((within == used).all()) and bool(solved.success)
        if settled and (not robust or abs(threshold - previous) < 1e-3 * threshold):
            break
        used = within
    return _Minimum(values, problem.used, float(np.mean(left**2)), threshold, settled)


def _elsewhere(problem: Problem, values: Floats) -> Floats | None:
    """Return values with a smaller sum of squares, found by changing one at a time, or None.

    Where the order of events changes, one bounce more before an edge, the sum of squares jumps, and
    a descent does not get over it.
    """
    least, best = float(np.sum(problem.tried(values) ** 2)), None
    for k, parameter in enumerate(problem.parameters):
        for part in np.linspace(-1.0, 1.0, SEARCHED):
            other = values.copy()
            other[k] = np.clip(values[k] + part * problem.sizes[k], parameter.low, parameter.high)
            cost = float(np.sum(problem.tried(other) ** 2))
            if cost < least * (1.0 - 1e-6):
                least, best = cost, other
    return best


def _threshold(left: Floats) -> float:
    """Return the residual, m, from which on a robust fit believes a point less."""
    # Neither 0, for points without noise, nor so large that it could not be told from none.
    return min(max(TUNING * result.MAD * float(np.median(np.abs(left))), 1e-9), 0.99)


def _judged(
    problem: Problem, best: _Minimum, before: Residuals, student: Any, *, robust: bool
) -> Fit:
    """Return the result with its uncertainties; refuse what the points cannot tell."""
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
    errors = np.sqrt(variance * np.diag(inverse)) / lengths
    spread = np.sqrt(np.diag(inverse))
    reach = float(student(freedom, 0.975)) * errors
    scene, track = problem.at(values)
    after = over(run(scene), track)
    wide = problem.derivatives(values, errors)
    return Fit(
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
        notes=tuple(
            result.notes(
                parameters,
                values,
                errors,
                inverse / np.outer(spread, spread),
                derivatives,
                wide,
                after,
                robust=robust,
                settled=best.settled,
            )
        ),
    )


def _scipy() -> tuple[Any, Any]:
    try:
        from scipy.optimize import least_squares
        from scipy.special import stdtrit
    except ImportError as error:
        text = 'a fit needs SciPy: pip install "chutelab[fit]"'
        raise ImportError(text, name=error.name) from error
    return least_squares, stdtrit
