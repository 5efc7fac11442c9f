"""From recordings to rows: what a row holds, and how it is read off a recording.

A recording is of one variant with all its particles, or of many variants, each of which is one
particle with a machine of its own: V variants of M particles, where V or M is 1. Both go through
the same operations, so that a row does not depend on which it came from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.results import ENTRIES, REASONS, Kind, Recording, balance
from chutelab.results.comparison import relative_error, scales
from chutelab.results.quantities import (
    QUANTITIES,
    column,
    end_times,
    first,
    from_events,
    never,
)
from chutelab.scene.rules import NEEDED
from chutelab.theory import unbounded
from chutelab.util.arrays import Bools, Floats

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


OTHER = (Kind.COLLISION, Kind.STICK, Kind.SETTLE)
"""Events that the theory's equations do not know of, before the landing or on another surface."""


def deviation(recording: Recording, shape: tuple[int, int]) -> Floats:
    """Return the largest relative error against the theory of V variants, (V,); NaN without one.

    Measured as in `results.comparison`. `predict` takes one scene at a time; so of each variant,
    of M particles, the events tell how far the equations hold. `shape` is (V, M).
    """
    (count, every), scene = shape, recording.scene
    if scene.incoming is None or scene.plate is None or (scene.stream.interact and every > 1):
        return np.full(count, np.nan)
    # Particle 0 has to be released on the belt, as fast as the belt is.
    belt, start = scene.incoming, recording.offsets[:-1:every]
    released = recording.offsets[1::every] > start
    release = recording.knots[np.where(released, start, 0)]
    (x, y), (vx, vy) = release["position"].T, release["velocity"].T
    begins = released & (y == belt.pulley_radius + scene.particle.radius) & (x <= 0.0)
    begins &= (-belt.length <= x) & (vx == belt.speed) & (vy == 0.0)
    left, hit, down = _described(recording, begins)
    own = scene.particle
    simulated = from_events(scene, left, hit, down, own.radius, own.mass)
    if every == 1 and "outgoing" in recording.surfaces:
        # What the outgoing belt paid is comparable where nothing slips on it any more.
        paid, over = _paid(recording, count), recording.ended == REASONS.index("settled")
        simulated["belt_work"] = np.where(over, paid["belt_work"], np.nan)
        simulated["slip_heat"] = np.where(over, paid["friction_loss"], np.nan)
    theory = unbounded(scene)
    sizes = scales(scene, theory)
    worst = np.full(count, np.nan)
    for name, found in simulated.items():
        errors = relative_error(found, getattr(theory, name), sizes[QUANTITIES[name]])
        worst = np.fmax(worst, np.where(np.isfinite(errors), errors, np.nan))
    return worst


def _described(recording: Recording, holds: Bools) -> list[NDArray[Any]]:
    """Return separation, impact and landing of particle 0 of each of V variants.

    The equations hold where these are its first three events, in this order. They did not happen
    from the first event on that is another one, nor in variants whose `holds`, (V,), is false.
    """
    events, every = recording.events, recording.count // len(holds)
    kinds = [int(kind) for kind in (Kind.SEPARATION, Kind.IMPACT, Kind.LANDING, *OTHER)]
    # Grip and slip on the belt and the pulley are in the equations.
    known = events["kind"] == Kind.STICK
    known &= events["surface"] == recording.surface_index("incoming")
    own = events[np.isin(events["kind"], kinds) & (events["particle"] % every == 0) & ~known]
    own = own[np.argsort(own["particle"], kind="stable")]
    variant = own["particle"] // every
    place = np.arange(len(own)) - np.searchsorted(variant, variant)
    found = []
    for n in range(len(NEEDED)):
        at, one = place == n, never(len(holds))
        one[variant[at]] = own[at]
        found.append(one)
    # A carried particle leaves the belt with a blow that throws it off, too.
    holds = holds & ~(found[0]["t"] >= found[1]["t"])
    for one, (event, surface) in zip(found, NEEDED.items(), strict=True):
        holds = holds & (one["kind"] == Kind[event.upper()])
        holds &= one["surface"] == recording.surface_index(surface)
        one[~holds] = never(1)
    return found


FATES = {
    "time": "still under way when the run ended",
    "settled": "came to rest elsewhere",
    "exit": "left the scene",
}
"""What became of particles that did not land, by why their tracks ended."""


def rows(recording: Recording, variants: int = 1) -> Columns:
    """Return the rows of the variants of a recording.

    Parameters
    ----------
    recording : Recording
        Of one variant; or of as many as there are particles, each on a machine of its own: its
        scene is a family then.
    variants : int
        How many.
    """
    found, scene, released = empty(variants), recording.scene, recording.released
    shape = variants, recording.count // variants
    begin, end = recording.ends()
    began = np.full(recording.count, np.nan)
    began[released] = begin["t"]
    landings = first(recording, "landing")
    values = {f"landing.{name}": column(landings, name) for name in ("x", "y", "vx", "vy")}
    values |= {"landing.t": landings["t"] - began, "time": end_times(recording) - began}
    for name, value in values.items():
        found[name], spread = _mean_and_spread(value.reshape(shape))
        if f"{name}_spread" in found:
            found[f"{name}_spread"] = spread
    who = np.flatnonzero(released)
    kinetic_first, potential_first = recording.energies(begin, who)
    kinetic, potential = recording.energies(end, who)
    change = (kinetic - kinetic_first) + (potential - potential_first)
    whole = np.zeros((2, recording.count))
    whole[0, released] = change - balance(end["entries"])
    whole[1, released] = end["entries"][:, ENTRIES.index("restitution_loss")]
    found["residual"], found["restitution_loss"] = whole.reshape(2, *shape).sum(axis=2)
    if scene.outgoing is not None:
        paid = _paid(recording, variants)
        found["belt_work"], found["slip_heat"] = paid["belt_work"], paid["friction_loss"]
        found["power"] = np.asarray(found["belt_work"] / shape[1] * scene.stream.rate)
        missed = np.isnan(landings["t"]).reshape(shape)
        found["misses"] = missed.sum(axis=1).astype(np.float64)
        _tell(found[REASON], recording, missed)
    found["error"] = deviation(recording, shape)
    return found


def _mean_and_spread(values: Floats) -> tuple[Floats, Floats]:
    """Return mean and standard deviation over the particles that have a value, (V,) of (V, M)."""
    has = np.isfinite(values)
    count = has.sum(axis=1)
    some = np.maximum(count, 1)
    mean = np.where(has, values, 0.0).sum(axis=1) / some
    square = np.where(has, (values - mean[:, None]) ** 2, 0.0).sum(axis=1) / some
    return np.where(count > 0, mean, np.nan), np.where(count > 0, np.sqrt(square), np.nan)


def _paid(recording: Recording, count: int) -> dict[str, Floats]:
    """Return the ledger's entries of the outgoing belt, (V,) each."""
    entries = recording.by_surface.reshape(count, -1, len(ENTRIES))
    belt = entries[:, recording.surface_index("outgoing")].T.copy()
    return dict(zip(ENTRIES, belt, strict=True))


def _tell(reasons: NDArray[Any], recording: Recording, missed: Bools) -> None:
    """Say what became of those that did not land, (V, M), and whose slip went on after that."""
    every, ended = missed.shape[1], recording.ended.reshape(missed.shape)
    restless = ~missed & (ended != REASONS.index("settled"))
    if recording.machine.until != "settled":
        restless[:] = False
    for row in np.flatnonzero((missed | restless).any(axis=1)).tolist():
        said = []
        if missed[row].any():
            fates = [REASONS[k] for k in ended[row, missed[row]].tolist()]
            told = [f"{fates.count(name)} {fate}" for name, fate in FATES.items() if name in fates]
            who = f"{len(fates)} of {every} particles" if every > 1 else "it"
            fate = ", ".join(told) if every > 1 else FATES[fates[0]]
            said.append(f"{who} missed the outgoing belt: {fate}")
        if restless[row].any():
            who = f"{restless[row].sum()} of {every} particles" if every > 1 else "it"
            said.append(
                f"{who} landed, but never came to rest on a belt: belt_work has only a part"
            )
        reasons[row] = "; ".join(said)
