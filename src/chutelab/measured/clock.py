"""When the clock of a film and the clock of the simulation agree: a search, not a refinement."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.measured.residuals import ends, follow

if TYPE_CHECKING:
    from chutelab.measured.track import Track
    from chutelab.recording import Recording

STEPS = 2000
"""Moments tried; a fit from the best one finds what is between two."""

POINTS = 200
"""Points that are looked at, evenly spread; no more are needed for this."""


def best_t0(recording: Recording, track: Track) -> float:
    """Return the t0 (s, in the time of the file) that brings track and simulation closest.

    Each point counts the square of its distance, but no more than the size of the track, and a
    little more than that where there is no simulation: so points cannot be hidden before the
    release or after the end. The t0 that the track has is kept if no other is better.
    """
    begin, end = ends(recording)
    some = slice(None, None, 1 + len(track) // POINTS)
    seconds, position = track.seconds[some], track.position[some]
    reach = float(np.ptp(position, axis=0).max())
    now = track.placement.t0
    tried = np.append(np.linspace(seconds[0] - end, seconds[-1] - begin, STEPS), now)
    # Linear between so many samples is far closer than the points lie.
    moments = np.linspace(begin, end, 4 * STEPS)
    path = follow(recording, moments)
    clock = seconds - tried[:, None]
    x, y = (np.interp(clock, moments, path[:, axis]) for axis in (0, 1))
    squares = np.minimum((x - position[:, 0]) ** 2 + (y - position[:, 1]) ** 2, reach**2)
    outside = (clock < begin) | (clock > end)
    costs = np.where(outside, 1.01 * reach**2, squares).sum(axis=1)
    best = int(np.argmin(costs))
    return float(tried[best]) if costs[best] < costs[-1] else now
