"""The error of a crowd, which is chaotic and has no reference.

Two runs that differ in the last digit have particles at other places after a few collisions, so
places say nothing. But rigid particles do not overlap, however chaotic their ways: the overlaps
are the error here, the same for every method, and they vanish as steps shorten. Of them the 99th
percentile is *the* error; the largest is the luck of a single pair, and is kept beside it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from chutelab.recording import Recording

Floats = NDArray[np.float64]

FRAME = 0.01
"""s between the frames in which overlaps are looked for."""

PERCENTILE = 99.0


def frames_of(recording: Recording) -> Floats:
    """Return places every `FRAME` seconds, (T, N, 2), NaN where a particle is not there."""
    _, last = recording.ends()
    end = float(last["t"].max())
    times = np.arange(1, 1 + round(end / FRAME)) * FRAME
    return recording.at(np.minimum(times, end))[0]


def overlaps(frames: Floats, radius: float) -> Floats:
    """Return by how much pairs of disks overlap, in radii, over all frames (T, N, 2).

    Only pairs that do are listed, once for each frame in which they do.
    """
    found = [np.empty(0)]
    for frame in frames:
        there = frame[np.isfinite(frame[:, 0])]
        there = there[np.argsort(there[:, 0], kind="stable")]
        # In the order of x, partners are at most a few places apart.
        for ahead in range(1, len(there)):
            apart = there[ahead:] - there[:-ahead]
            apart = apart[apart[:, 0] < 2.0 * radius]
            if not len(apart):
                break
            overlap = 2.0 - np.hypot(apart[:, 0], apart[:, 1]) / radius
            found.append(overlap[overlap > 0.0])
    return np.concatenate(found)


def typical(overlap: Floats) -> float:
    """Return the `PERCENTILE` of some overlaps, 0 of none."""
    return float(np.percentile(overlap, PERCENTILE)) if len(overlap) else 0.0
