"""What a row of a sweep holds: the columns, what they mean, and how many of them are kept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    Columns = dict[str, NDArray[Any]]

NUMBERS: dict[str, tuple[str, str]] = {
    "landing.x": ("x of the landing on the outgoing belt, mean over the particles", "m"),
    "landing.x_spread": ("its standard deviation", "m"),
    "landing.y": ("y of the landing, mean", "m"),
    "landing.vx": ("forward velocity just before the landing, mean", "m/s"),
    "landing.vx_spread": ("its standard deviation", "m/s"),
    "landing.vy": ("upward velocity just before the landing, mean", "m/s"),
    "landing.vy_spread": ("its standard deviation", "m/s"),
    "landing.t": ("time from a particle's release to its landing, mean", "s"),
    "time": ("time from a particle's release to the end of its track, mean", "s"),
    "belt_work": ("what the outgoing belt's drive pays up to run.until, all particles", "J"),
    "slip_heat": ("heat of the slip on the outgoing belt up to run.until", "J"),
    "restitution_loss": ("loss of all bounces", "J"),
    "power": ("belt work up to run.until per particle times stream.rate", "W"),
    "misses": ("particles that never landed on the outgoing belt", ""),
    "residual": ("energy that the ledger cannot explain: the numerical error", "J"),
    "error": ("largest relative error of particle 0 against the theory", ""),
}
"""Columns of numbers, with their definitions and units; NaN where there is nothing to tell."""

REASON = "reason"
"""The column that says why there are no numbers, or not all; "" otherwise."""


def empty(count: int) -> Columns:
    """Return rows that tell nothing yet."""
    found: Columns = {name: np.full(count, np.nan) for name in NUMBERS}
    found[REASON] = np.full(count, "", dtype=object)
    return found


def joined(parts: Sequence[Mapping[str, NDArray[Any]]]) -> Columns:
    """Put rows below each other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
