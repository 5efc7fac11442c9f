"""Times and parts of a recording that are worth drawing."""

from __future__ import annotations

from dataclasses import replace
from math import floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.recording import REASONS, Kind, Recording

if TYPE_CHECKING:
    from collections.abc import Sequence

Floats = NDArray[np.float64]

STRUCK = (Kind.IMPACT, Kind.LANDING, Kind.COLLISION)
"""Kinds of event in which something is hit."""

STROBES = 10
"""Strobe dots aimed at from separation to the last impact."""


def subset(recording: Recording, particles: Sequence[int] | NDArray[np.int64]) -> Recording:
    """Return the recording of some particles only; its events are left out."""
    tracks = [recording.track(int(i)) for i in particles]
    offsets = np.concatenate([[0], np.cumsum([len(track) for track in tracks])]).astype(np.int64)
    return replace(
        recording,
        knots=np.concatenate(tracks) if tracks else recording.knots[:0],
        offsets=offsets,
        ended=recording.ended[np.asarray(particles, dtype=np.int64)],
        events=recording.events[:0],
    )


def spread(count: int, at_most: int) -> NDArray[np.int64]:
    """Return up to `at_most` particle indices, evenly spread, particle 0 among them."""
    return np.unique(np.linspace(0, count - 1, min(count, at_most)).astype(np.int64))


def round_step(span: float, wanted: int) -> float:
    """Return the step of 1, 2 or 5 times a power of ten that divides a span into about `wanted`.

    >>> round_step(0.6, 10), round_step(3.0, 10)
    (0.05, 0.2)
    """
    exact = span / wanted
    power = floor(log10(exact))
    mantissa = exact / 10.0**power
    # Geometric means are the borders between 1, 2, 5 and 10.
    borders = ((1, 2**0.5), (2, 10**0.5), (5, 50**0.5), (10, 10.0))
    factor = next(factor for factor, border in borders if mantissa <= border)
    return float(f"{factor}e{power}")


def round_times(begin: float, end: float, step: float) -> Floats:
    """Return the multiples of a step from `begin` to `end`, s."""
    slack = 1e-9 * step
    return step * np.arange(np.ceil((begin - slack) / step), np.floor((end + slack) / step) + 1.0)


def action(recording: Recording) -> tuple[float, float]:
    """Return when particle 0 begins to do something, and when it ends, s.

    It begins at its separation from the incoming belt, or at its release if it is not carried to
    one.
    """
    track = recording.track(0)
    separation = recording.select(Kind.SEPARATION, surface="incoming")
    separation = separation[separation["particle"] == 0]
    begin = separation["t"][0] if len(separation) else track["t"][0]
    return float(begin), float(track["t"][-1])


def struck_by_nominal(recording: Recording) -> NDArray[Any]:
    """Return the events in which particle 0 hits something or is hit."""
    struck = recording.select(*STRUCK)
    return np.asarray(struck[(struck["particle"] == 0) | (struck["other"] == 0)])


def strobe_step(recording: Recording) -> float:
    """Return the round time between strobe dots, s, made for the time until the last impact."""
    begin, end = action(recording)
    struck = struck_by_nominal(recording)["t"]
    last = float(struck[-1]) if len(struck) and struck[-1] > begin else end
    return round_step(max(last - begin, 1e-3), STROBES)


def track_times(recording: Recording, begin: float, end: float, count: int = 400) -> Floats:
    """Return even times, joined by the knots of particle 0 and the moments just before them.

    So a jump at an impact is drawn upright, not slanted.
    """
    knots = recording.track(0)["t"]
    if len(knots) > count:
        knots = recording.events["t"][recording.events["particle"] == 0][:count]
    return upright(np.linspace(begin, end, count), knots)


def upright(times: Floats, jumps: Floats) -> Floats:
    """Return ascending times joined by jumps between the first and last, and just before each."""
    jumps = jumps[(jumps >= times[0]) & (jumps <= times[-1])]
    before = np.nextafter(jumps, -np.inf)
    return np.unique(np.concatenate([times, jumps, before[before >= times[0]]]))


def energies(recording: Recording, times: ArrayLike) -> dict[str, Floats]:
    """Return `Recording.energy_at` with the energy at release, all potential energy above 0.

    Returns
    -------
    dict of ndarray, shape (T,)
        What `energy_at` gives, and ``start``, kinetic and potential energy at the release of all
        particles released so far; J. Potential energy is counted from the lowest point of the
        particles that stay in the scene (of all, if it is negative otherwise): it can be stacked.
    """
    times = np.atleast_1d(np.asarray(times, dtype=np.float64))
    books = recording.energy_at(times)
    first, _ = recording.ends()
    order = np.argsort(first["t"], kind="stable")
    at_release = np.concatenate([[0.0], np.cumsum(sum(recording.energies(first[order])))])
    released = np.searchsorted(first["t"][order], times, side="right")
    weight = released * recording.particle.mass * recording.gravity
    for zero in _lowest(recording):
        lifted = books["potential"] - weight * zero
        if (lifted >= 0.0).all():
            break
    books["potential"] = np.maximum(lifted, 0.0)
    books["start"] = at_release[released] - weight * zero
    return books


def _lowest(recording: Recording) -> tuple[float, float]:
    """Return the lowest knots (m) of the particles that stay in the scene, and of all."""
    heights = recording.knots["position"][:, 1]
    stays = recording.ended != REASONS.index("exit")
    staying = heights[np.repeat(stays, np.diff(recording.offsets))]
    lowest = float(heights.min(initial=np.inf))
    return float(staying.min()) if len(staying) else lowest, lowest
