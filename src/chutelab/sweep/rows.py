"""From recordings to rows.

A recording is of one variant with all its particles, or of many variants, each of which is one
particle with a machine of its own: V variants of M particles, where V or M is 1. Both go through
the same operations, so that a row does not depend on which it came from.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.recording import ENTRIES, REASONS, Kind, balance
from chutelab.sweep.columns import REASON, empty
from chutelab.sweep.deviation import deviation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.recording import Recording
    from chutelab.scene import Scene
    from chutelab.sweep.columns import Columns

    Floats = NDArray[np.float64]
    Bools = NDArray[np.bool_]

FATES = {
    "time": "still under way when the run ended",
    "settled": "came to rest elsewhere",
    "exit": "left the scene",
}
"""What became of particles that did not land, by why their tracks ended."""


def rows(recording: Recording, scene: Scene, variants: int = 1) -> Columns:
    """Return the rows of the variants of a recording.

    Parameters
    ----------
    recording : Recording
        Of one variant; or of as many as there are particles, each on a machine of its own.
    scene : Scene
        What was run: a family in the second case.
    variants : int
        How many.
    """
    found = empty(variants)
    shape = variants, recording.count // variants
    first, last = recording.ends()
    released = recording.offsets[1:] > recording.offsets[:-1]
    began = np.full(recording.count, np.nan)
    began[released] = first["t"]
    ended = np.full(recording.count, np.nan)
    ended[released] = last["t"]

    landings = recording.first(recording.select(Kind.LANDING, surface="outgoing"))
    who = landings["particle"]
    values = {
        "landing.x": landings["position"][:, 0],
        "landing.y": landings["position"][:, 1],
        "landing.vx": landings["velocity_before"][:, 0],
        "landing.vy": landings["velocity_before"][:, 1],
        "landing.t": landings["t"] - began[who],
    }
    landed = np.zeros(recording.count, dtype=bool)
    landed[who] = True
    for name, value in values.items():
        of_all = np.zeros(recording.count)
        of_all[who] = value
        found[name], spread = _mean_and_spread(of_all.reshape(shape), landed.reshape(shape))
        if f"{name}_spread" in found:
            found[f"{name}_spread"] = spread
    found["time"], _ = _mean_and_spread(
        np.where(released, ended - began, 0.0).reshape(shape), released.reshape(shape)
    )
    _balance(found, recording, scene, shape)
    if scene.outgoing is not None:
        found["misses"] = (shape[1] - landed.reshape(shape).sum(axis=1)).astype(np.float64)
        _tell_misses(found[REASON], recording.ended.reshape(shape), ~landed.reshape(shape))
        # Where it is varied, it is an array of numbers.
        if isinstance(scene.run.until, str) and scene.run.until == "settled":
            restless = landed & (recording.ended != REASONS.index("settled"))
            _tell_restless(found[REASON], restless.reshape(shape).sum(axis=1), shape[1])
    found["error"] = deviation(recording, scene, shape)
    return found


def _mean_and_spread(values: Floats, counted: Bools) -> tuple[Floats, Floats]:
    """Return mean and standard deviation over the particles that count, (V,) of (V, M)."""
    count = counted.sum(axis=1)
    some = np.maximum(count, 1)
    mean = np.where(counted, values, 0.0).sum(axis=1) / some
    square = np.where(counted, (values - mean[:, None]) ** 2, 0.0).sum(axis=1) / some
    return np.where(count > 0, mean, np.nan), np.where(count > 0, np.sqrt(square), np.nan)


def _balance(found: Columns, recording: Recording, scene: Scene, shape: tuple[int, int]) -> None:
    """Fill in the energies."""
    first, last = recording.ends()
    (kinetic_first, potential_first), (kinetic_last, potential_last) = (
        recording.energies(knots) for knots in (first, last)
    )
    change = (kinetic_last - kinetic_first) + (potential_last - potential_first)
    whole = np.zeros((2, recording.count))
    released = recording.offsets[1:] > recording.offsets[:-1]
    whole[0, released] = change - balance(last["entries"])
    whole[1, released] = last["entries"][:, ENTRIES.index("restitution_loss")]
    found["residual"], found["restitution_loss"] = whole.reshape(2, *shape).sum(axis=2)
    if scene.outgoing is not None:
        entries = recording.by_surface.reshape(shape[0], -1, len(ENTRIES))
        belt = entries[:, recording.surface_index("outgoing")]
        found["belt_work"] = belt[:, ENTRIES.index("belt_work")].copy()
        found["slip_heat"] = belt[:, ENTRIES.index("friction_loss")].copy()
        found["power"] = np.asarray(found["belt_work"] / shape[1] * scene.stream.rate)


def _tell_misses(reason: NDArray[Any], ended: NDArray[np.int8], missed: Bools) -> None:
    """Say what became of those that did not land."""
    for row in np.flatnonzero(missed.any(axis=1)).tolist():
        fates = [REASONS[k] for k in ended[row, missed[row]].tolist()]
        told = [f"{fates.count(name)} {fate}" for name, fate in FATES.items() if name in fates]
        of_all = f"{len(fates)} of {missed.shape[1]} particles" if missed.shape[1] > 1 else "it"
        if missed.shape[1] == 1:
            told = [FATES[fates[0]]]
        reason[row] = f"{of_all} missed the outgoing belt: {', '.join(told)}"


def _tell_restless(reason: NDArray[Any], restless: NDArray[Any], of: int) -> None:
    """Say that what the belt pays is not all, where a run until settled ended before that."""
    for row in np.flatnonzero(restless).tolist():
        who = f"{restless[row]} of {of} particles" if of > 1 else "it"
        more = f"{who} landed, but never came to rest on a belt: belt_work has only a part"
        reason[row] = f"{reason[row]}; {more}" if reason[row] else more
