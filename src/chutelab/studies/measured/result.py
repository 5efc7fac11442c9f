"""`Fit`: the result of a fit, reasons to doubt its uncertainties, its files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import isfinite
from typing import Any

import numpy as np

from chutelab.scene import Scene
from chutelab.scene.units import write_size
from chutelab.studies.measured.track import MeasuredError, Residuals, best_t0, over
from chutelab.util.arrays import Floats
from chutelab.util.files import csv_lines
from chutelab.util.tables import Sheet, Shown, plain, plus_minus, rounded

MAD = 1.4826
"""Standard deviations of a normal distribution in its median absolute deviation."""

CORRELATED = 0.9
BENT = 0.2
"""With a larger relative change of the Jacobian over one uncertainty the fit is not linear."""
ALIKE = 0.4
"""Correlation of neighbouring residuals that is not chance in a film of some tens of points."""
FEW = 10
"""Least number of points for this test."""
FAR = 6.0
"""Robust standard deviations; one point in 60 million lies so far off by chance."""
NAMED = 5
"""Most points that are named one by one."""


FAR_CLOSER = 10.0
"""Another t0 is advised if it makes the residuals so many times smaller."""
ASTRAY = 3.0
"""If the points are further from the simulated track than this, in sizes of the track, their
placement is doubted."""


def advice(found: Residuals) -> str:
    """Return what is probably wrong with the placement of the points, "" if nothing."""
    off = float(np.median(np.hypot(*found.values[found.used].T)))
    size = float(np.ptp(found.recording.track(0)["position"], axis=0).max())
    if off > ASTRAY * size:
        return (
            f"the points lie {off / size:.0f} times as far off as the simulated track is large:"
            " look at scale, origin and flip-y"
        )
    t0 = best_t0(found.recording, found.track)
    apart = abs(t0 - found.track.placement.t0)
    if apart == 0.0:
        return ""
    try:
        better = over(found.recording, found.track.placed(t0=t0))
    except MeasuredError:
        return ""
    times = float(np.hypot(*found.rms) / max(np.hypot(*better.rms), 1e-12))
    if times < FAR_CLOSER:
        return ""
    return (
        f"the clocks of film and simulation seem {apart:.2g} s apart: with t0 = {t0:.3g} the"
        f" residuals are {times:.0f} times smaller, and t0 can be fitted"
    )


def notes(fit: Fit, bent: Floats, *, settled: bool) -> Iterator[str]:
    """Yield remarks on a result.

    `bent`, (p,), is by how much the response to each parameter changes within its uncertainty,
    relatively; `settled`, whether the fit ended with the same points within the simulated time.
    """
    if doubt := advice(fit.after):
        # The other notes would be meaningless then.
        yield doubt
        return
    for key, parameter, value, error in zip(
        fit.keys, fit.parameters, fit.values, fit.errors, strict=True
    ):
        if value <= parameter.low + error or value >= parameter.high - error:
            yield f"{key} is at the edge of what is allowed: its uncertainty is one-sided"
        elif error > max(abs(value), parameter.size):
            yield f"{key} is hardly told by these points: uncertain by its own size"
    for i, k in combinations(range(len(fit.keys)), 2):
        if abs(fit.correlation[i, k]) > CORRELATED:
            yield (
                f"{fit.keys[i]} and {fit.keys[k]} are correlated ({fit.correlation[i, k]:+.3f}):"
                " the points tell a combination of them better"
            )
    for key, much in zip(fit.keys, bent, strict=True):
        if much > BENT:
            yield (
                f"within its uncertainty the track does not respond to {key} along a"
                " straight line: the uncertainty is rough"
            )
    left = fit.after.values[fit.after.used]
    deviation = MAD * float(np.median(np.abs(left)))
    distance = np.hypot(*left.T)
    far = np.flatnonzero(distance > max(FAR * deviation, 1e-12))
    if 0 < len(far) <= NAMED:
        lines = fit.after.track.lines[fit.after.used]
        said = ", ".join(f"line {lines[i]} ({write_size(float(distance[i]), 'm')})" for i in far)
        less = "" if fit.robust else "; a robust fit gives such points less weight"
        yield f"far off the others: {said}{less}"
    elif alike(left.ravel()):
        yield (
            f"neighbouring residuals are alike (correlation {_neighbours(left):.2f}): the points"
            " differ from the simulation in a way that is no noise, and the uncertainties are too"
            " small"
        )
    if not settled:
        yield "the fit did not come to rest; start it nearer to the result"


def alike(left: Floats) -> bool:
    """Whether residuals (2 n,), x and y of each point in turn, are more than noise."""
    points = left.reshape(-1, 2)
    return len(points) >= FEW and _neighbours(points) > ALIKE


def _neighbours(left: Floats) -> float:
    """Return the correlation of residuals (n, 2) with those of the next points."""
    total = float((left**2).sum())
    return float((left[1:] * left[:-1]).sum()) / total if total > 1e-20 else 0.0


@dataclass(frozen=True)
class Parameter:
    """A number that a fit may change."""

    # its name: a full path in the scene as it was given, or a key of `placements`; "" for the unit
    # of a pure number
    key: str
    unit: str
    start: float  # its value in the scene or the placement
    # range of the search: the allowed values, but not below `SMALLEST` times the start if 0 is not
    # allowed
    low: float
    high: float

    @property
    def size(self) -> float:
        """Typical size of its change: its own size, but not almost 0."""
        return max(abs(self.start), 0.1)


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Shown):
    """Result of a fit.

    Attributes
    ----------
    parameters : tuple of Parameter
        The fitted parameters: key, unit, start and bounds.
    values, errors : ndarray, shape (p,)
        The best values, and their standard uncertainties (one standard deviation).
    low, high : ndarray, shape (p,)
        Ends of the intervals that hold the true value with 95 % confidence (Student's t).
    correlation : ndarray, shape (p, p)
        Of the uncertainties.
    scatter : float
        Standard deviation of a measured coordinate, m, from the residuals.
    freedom : int
        Degrees of freedom: coordinates less parameters.
    before, after : Residuals
        With the starting values, and with the best ones.
    scene : Scene
        With the best values.
    robust : bool
        Whether points that lie far off were given less weight.
    notes : tuple of str
        Reasons why the result is less certain than it looks.

    Notes
    -----
    The uncertainties are those of linearised least squares: covariance s² (JᵀJ)⁻¹ with the Jacobian
    J at the best values and s² the sum of squares over the degrees of freedom. They hold if the
    errors of all coordinates are independent and alike, and the model is right. A robust fit has
    Huber's covariance, [Σψ²/(M - p)] / mean(ψ')² (JᵀJ)⁻¹ (Robust Statistics, 1981, 7.6).
    """

    parameters: tuple[Parameter, ...]
    values: Floats
    errors: Floats
    low: Floats
    high: Floats
    correlation: Floats
    scatter: float
    freedom: int
    before: Residuals
    after: Residuals
    scene: Scene
    robust: bool
    notes: tuple[str, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """The fitted keys."""
        return tuple(parameter.key for parameter in self.parameters)

    def sheet(self) -> Sheet:
        """Return the parameters with their uncertainties, and what makes them less certain."""
        rows = tuple(
            (
                parameter.key,
                plus_minus(value, error),
                parameter.unit,
                f"{rounded(low, error)} to {rounded(high, error)}",
                f"{parameter.start:.4g}",
            )
            for parameter, value, error, low, high in zip(
                self.parameters, self.values, self.errors, self.low, self.high, strict=True
            )
        )
        scatter, x, y = (write_size(size, "m") for size in (self.scatter, *self.after.rms))
        kind = "a coordinate, robustly" if self.robust else "a coordinate"
        notes = (
            f"scatter {scatter} {kind}, {self.freedom} degrees of freedom; RMS"
            f" residual {x} in x, {y} in y",
            *(f"note: {note}" for note in self.notes),
        )
        title = "Fit, ± one standard deviation"
        return Sheet(title, ("", "value", "", "95 %", "from"), rows, notes=notes)


COLUMNS = (
    "line", "t", "x", "y", "simulated_x", "simulated_y", "residual_x", "residual_y",
)  # fmt: skip


def as_dict(found: Residuals, fit: Fit | None = None) -> dict[str, Any]:
    """Return what is known of a comparison, SI units, ready for JSON."""

    def sizes(found: Residuals) -> dict[str, Any]:
        (rms_x, rms_y), (mean_x, mean_y) = found.rms, found.mean
        i = found.worst
        x, y = found.values[i]
        worst = {"line": found.track.lines[i], "t": found.track.t[i], "x": x, "y": y}
        return {"rms_x": rms_x, "rms_y": rms_y, "mean_x": mean_x, "mean_y": mean_y, "worst": worst}

    fitted = None
    if fit is not None:
        columns = zip(fit.parameters, fit.values, fit.errors, fit.low, fit.high, strict=True)
        fitted = {
            "parameters": {
                one.key: {
                    "value": value, "error": error, "low": low, "high": high,
                    "start": one.start, "unit": one.unit,
                }
                for one, value, error, low, high in columns
            },
            "correlation": fit.correlation,
            "scatter": fit.scatter,
            "freedom": fit.freedom,
            "robust": fit.robust,
            "notes": fit.notes,
            "before": sizes(fit.before),
        }  # fmt: skip
    track = found.track
    told = {
        "format": 1,
        "scene": found.recording.title,
        "data": track.source,
        "track": track.name,
        "points": len(track),
        "used": found.used.sum(),
        "left_out": found.left_out(),
        "skipped": track.skipped,
        "placement": track.placement,
        "residuals": sizes(found),
        "advice": advice(found),
        "fit": fitted,
    }
    return dict(plain(told))


def points_csv(found: Residuals) -> str:
    """Return a table of the points, in the world and on the simulation's clock.

    Points outside the simulated time have no simulated position and no residual.
    """
    track = found.track
    rows: list[Sequence[object]] = [COLUMNS]
    for line, t, measured, simulated, off in zip(
        track.lines, track.t, track.position, found.simulated, found.values, strict=True
    ):
        numbers = (t, *measured, *simulated, *off)
        rows.append([line, *(f"{value:.9g}" if isfinite(value) else "" for value in numbers)])
    return "".join(csv_lines(rows))
