"""Where to count positions from: far from the world's origin coordinates have few digits left."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, log2
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from chutelab.machine.parts import Machine

REMOTE = 8.0
"""Sizes of a machine that it must be away from the world's origin to be given one of its own."""


def origin(machine: Machine) -> tuple[float, float]:
    """Return the world point that the engine calculates from, m: near the machine.

    It is (0, 0) unless the machine is many times its own size away from there; and so round a
    number that taking it off a coordinate loses no digit.
    """
    start, end = machine.segments.start, machine.segments.end
    if machine.pulley is not None or not start.size:
        return 0.0, 0.0
    low, high = np.minimum(start, end), np.maximum(start, end)
    axes = tuple(range(low.ndim - 1))
    low, high = low.min(axis=axes), high.max(axis=axes)
    extent = float((high - low).max())
    middle = 0.5 * (low + high)
    if np.abs(middle).max() <= REMOTE * extent:
        return 0.0, 0.0
    unit = 2.0 ** ceil(log2(extent))
    x, y = (round(float(c) / unit) * unit for c in middle)
    return x, y


def moved(machine: Machine, x: float, y: float) -> Machine:
    """Return a machine without a pulley, moved by (x, y), m."""
    if not (x or y):
        return machine
    by = np.array([x, y])
    segments, releases = machine.segments, machine.releases
    return replace(
        machine,
        segments=replace(segments, start=segments.start + by),
        releases=replace(releases, position=releases.position + by),
    )
