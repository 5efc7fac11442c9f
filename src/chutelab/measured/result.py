"""`Fit`: what a fit found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chutelab.scene.units import write_size
from chutelab.sheet import Sheet, Shown

if TYPE_CHECKING:
    from chutelab.measured.parameters import Parameter
    from chutelab.measured.residuals import Residuals
    from chutelab.measured.track import Floats
    from chutelab.scene import Scene


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Shown):
    """What a fit found.

    Attributes
    ----------
    parameters : tuple of Parameter
        What was fitted: key, unit, start and bounds.
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
        What makes the result less certain than it looks.

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


def plus_minus(value: float, error: float) -> str:
    """Return a value with its uncertainty, to the digits that mean something.

    >>> plus_minus(0.62134, 0.00213), plus_minus(1.9, 0.0)
    ('0.6213 ± 0.0021', '1.9 ± 0')
    """
    return f"{rounded(value, error)} ± {rounded(error, error)}"


def rounded(value: float, error: float) -> str:
    """Return a value to the second digit of its uncertainty."""
    if not 0.0 < error < np.inf:
        return f"{value:.9g}"
    digits = max(0, 1 - int(np.floor(np.log10(float(f"{error:.1e}")))))
    return f"{value:.{digits}f}"
