"""What makes the result of a fit less certain than its uncertainties say."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from chutelab.measured.clock import best_t0
from chutelab.measured.residuals import over
from chutelab.measured.track import MeasuredError
from chutelab.scene.units import write_size

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from chutelab.measured.parameters import Parameter
    from chutelab.measured.residuals import Residuals
    from chutelab.measured.track import Floats

MAD = 1.4826
"""Standard deviations of a normal distribution in its median absolute deviation."""

CORRELATED = 0.9
BENT = 0.2
"""Relative change of the Jacobian over one uncertainty from which on it is no straight line."""
ALIKE = 0.4
"""Correlation of neighbouring residuals that is no accident in a film of some tens of points."""
FEW = 10
"""Points from which on that can be told."""
FAR = 6.0
"""Robust standard deviations; one point in 60 million lies so far off by chance."""
NAMED = 5
"""Points that are named one by one."""


FAR_CLOSER = 10.0
"""Times smaller that residuals must be for a t0 to be advised."""
ASTRAY = 3.0
"""Sizes of the simulated track that points must lie off it, for their placement to be doubted."""


def advice(found: Residuals) -> str:
    """Say what is probably wrong with how the points were placed, "" if nothing stands out."""
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


def notes(
    parameters: Sequence[Parameter],
    values: Floats,
    errors: Floats,
    correlation: Floats,
    derivatives: Floats,
    wide: Floats,
    after: Residuals,
    *,
    robust: bool,
    settled: bool,
) -> Iterator[str]:
    """Yield what should be said beside the result.

    Parameters
    ----------
    derivatives, wide : ndarray, shape (M, p)
        The Jacobian by a small step, and by one as large as the uncertainties.
    settled : bool
        Whether the fit came to an end with the same points within the simulated time.
    """
    if doubt := advice(after):
        # Then nothing else that could be said means anything.
        yield doubt
        return
    for k, parameter in enumerate(parameters):
        if values[k] <= parameter.low + errors[k] or values[k] >= parameter.high - errors[k]:
            yield f"{parameter.key} is at the edge of what is allowed: its uncertainty is one-sided"
        elif errors[k] > max(abs(values[k]), parameter.size):
            yield f"{parameter.key} is hardly told by these points: uncertain by its own size"
    for i, k in combinations(range(len(parameters)), 2):
        if abs(correlation[i, k]) > CORRELATED:
            yield (
                f"{parameters[i].key} and {parameters[k].key} are correlated"
                f" ({correlation[i, k]:+.3f}): the points tell a combination of them better"
            )
    change = np.linalg.norm(wide - derivatives, axis=0) / np.linalg.norm(derivatives, axis=0)
    for parameter, bent in zip(parameters, change, strict=True):
        if bent > BENT:
            yield (
                f"within its uncertainty the track does not respond to {parameter.key} along a"
                " straight line: the uncertainty is rough"
            )
    left = after.values[after.used]
    deviation = MAD * float(np.median(np.abs(left)))
    distance = np.hypot(*left.T)
    far = np.flatnonzero(distance > max(FAR * deviation, 1e-12))
    if 0 < len(far) <= NAMED:
        lines = after.track.lines[after.used]
        said = ", ".join(f"line {lines[i]} ({write_size(float(distance[i]), 'm')})" for i in far)
        less = "" if robust else "; a robust fit gives such points less weight"
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
    """Tell whether residuals (2 n,), x and y of each point in turn, are more than noise."""
    points = left.reshape(-1, 2)
    return len(points) >= FEW and _neighbours(points) > ALIKE


def _neighbours(left: Floats) -> float:
    """Return the correlation of residuals (n, 2) with those of the next points."""
    total = float((left**2).sum())
    return float((left[1:] * left[:-1]).sum()) / total if total > 1e-20 else 0.0
