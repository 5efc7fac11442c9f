"""Scene, track and parameters as a function from values to residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.measured.jacobian import STEP, jacobian
from chutelab.measured.parameters import changed
from chutelab.measured.residuals import follow, inside, over, run
from chutelab.measured.track import MeasuredError
from chutelab.scene import Fault, SceneError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.measured.parameters import Parameter
    from chutelab.measured.residuals import Residuals
    from chutelab.measured.track import Floats, Track
    from chutelab.scene import Scene


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
        self.used: NDArray[np.bool_] = np.ones(len(track), dtype=bool)

    def use(self, used: NDArray[np.bool_]) -> None:
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

    def within(self, values: Floats) -> NDArray[np.bool_]:
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
