"""From recordings to rows: what a row holds, and how it is read off a recording.

A recording is of one variant with all its particles, or of many variants, each of which is one
particle with a machine of its own: V variants of M particles, where V or M is 1. Both go through
the same operations, so that a row does not depend on which it came from.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chutelab.results import ENTRIES, REASONS, Kind, Recording, balance
from chutelab.results.arrival import arrivals, fates, never
from chutelab.results.comparison import relative_error, scales
from chutelab.results.quantities import (
    QUANTITIES,
    column,
    end_times,
    first,
    from_events,
)
from chutelab.results.stream import told_fates
from chutelab.scene.rules import NEEDED
from chutelab.theory import unbounded
from chutelab.util.arrays import Bools, Floats, Ints

Columns = dict[str, NDArray[Any]]

PAID, HEAT = (f"ledger.by_surface.outgoing.{entry}" for entry in ("belt_work", "friction_loss"))

NUMBERS: dict[str, tuple[str, str]] = {
    "arrival.x.mean": (
        "x where particles come to the outgoing belt, or what lies on it, mean",
        "m",
    ),
    "arrival.x.spread": ("its standard deviation", "m"),
    "arrival.vx.mean": ("forward velocity just before the arrival, mean", "m/s"),
    "arrival.vx.spread": ("its standard deviation", "m/s"),
    "landing.x.mean": ("x of the landing on the outgoing belt itself, mean", "m"),
    "landing.x.spread": ("its standard deviation", "m"),
    "landing.y.mean": ("y of the landing, mean", "m"),
    "landing.vx.mean": ("forward velocity just before the landing, mean", "m/s"),
    "landing.vx.spread": ("its standard deviation", "m/s"),
    "landing.vy.mean": ("upward velocity just before the landing, mean", "m/s"),
    "landing.vy.spread": ("its standard deviation", "m/s"),
    "landing.t.mean": ("time of the landing, mean", "s"),
    "time": ("time from a particle's release to the end of its track, mean", "s"),
    PAID: ("what the outgoing belt's drive pays up to run.until, all particles", "J"),
    HEAT: ("heat of the slip on the outgoing belt up to run.until", "J"),
    "restitution_loss": ("loss of all bounces", "J"),
    "power": ("belt work up to run.until per particle times the rate of all the width", "W"),
    "plate_hits": ("particles that met the plate before a landing", ""),
    "misses": ("particles that never came to the outgoing belt, nor to what lies on it", ""),
    "residual": ("energy that the ledger cannot explain: the numerical error", "J"),
    "error": ("largest relative error of particle 0 against the theory", ""),
}
"""Columns of numbers, with their definitions and units; NaN where there is nothing to tell."""

EARLIER = {
    "belt_work": PAID, "slip_heat": HEAT,
    **{f"landing.{key}": f"landing.{key}.mean" for key in ("x", "y", "vx", "vy", "t")},
    **{f"landing.{key}_spread": f"landing.{key}.spread" for key in ("x", "vx", "vy")},
}  # fmt: skip
"""What columns were called that had a name which means another thing in a run, and are called."""

TOUCHES: Final = "touches"
"""The column that says which surfaces the particles meet, see `touches`; "" without a run."""

REASON: Final = "reason"
"""The column that says why there are no numbers, or not all; "" otherwise."""

TEXTS: Final = (TOUCHES, REASON)
"""The columns of words, which come last."""


def no_column(name: str) -> str:
    """Say which columns of numbers there are, or what an earlier name has become.

    >>> no_column("landing.x")
    'landing.x is called landing.x.mean now: in a run landing.x is of one particle'
    """
    if name in EARLIER:
        if name in ("belt_work", "slip_heat"):
            why = f"{name} is what is paid until nothing slips, this is up to run.until"
        else:
            why = f"in a run {name.partition('_')[0]} is of one particle"
        return f"{name} is called {EARLIER[name]} now: {why}"
    return f"{name}: one of {', '.join(NUMBERS)}"


class Named(dict[str, NDArray[Any]]):
    """Columns by name; asked for one that is not there, it says what it is called."""

    def __missing__(self, name: str) -> NDArray[Any]:
        """Raise a KeyError that says which columns there are."""
        raise KeyError(no_column(name))


def empty(count: int) -> Columns:
    """Return rows that tell nothing yet."""
    found: Columns = {name: np.full(count, np.nan) for name in NUMBERS}
    found |= {name: np.full(count, "", dtype=object) for name in TEXTS}
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
    some = np.isin(events["kind"], kinds) & (events["particle"] % every == 0) & ~known
    order = some.nonzero()[0]
    own = events.take(order[np.argsort(events["particle"][order], kind="stable")])
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
    "stopped": "still under way when the run was stopped",
    "unreleased": "never released",
    "settled": "came to rest elsewhere",
    "exit": "left the scene",
}
"""What became of a lone particle that did not arrive, by why its track ended."""


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
    came = arrivals(recording)
    for event, its in (("landing", first(recording, "landing")), ("arrival", came)):
        for key in ("x", "y", "vx", "vy", "t"):
            mean, spread = _mean_and_spread(column(its, key).reshape(shape))
            for statistic, value in (("mean", mean), ("spread", spread)):
                if (name := f"{event}.{key}.{statistic}") in found:
                    found[name] = value
    found["time"], _ = _mean_and_spread((end_times(recording) - began).reshape(shape))
    who = np.flatnonzero(released)
    kinetic_first, potential_first = recording.energies(begin, who)
    kinetic, potential = recording.energies(end, who)
    change = (kinetic - kinetic_first) + (potential - potential_first)
    whole = np.zeros((2, recording.count))
    whole[0, released] = change - balance(end["entries"])
    whole[1, released] = end["entries"][:, ENTRIES.index("restitution_loss")]
    found["residual"], found["restitution_loss"] = whole.reshape(2, *shape).sum(axis=2)
    found[TOUCHES] = touches(recording, variants)
    if scene.plate is not None:
        who, surface = _met(recording)
        met = np.unique(who[surface == recording.surface_index("plate")])
        found["plate_hits"] = np.bincount(met // shape[1], minlength=variants).astype(np.float64)
    if scene.outgoing is not None:
        paid = _paid(recording, variants)
        found[PAID], found[HEAT] = paid["belt_work"], paid["friction_loss"]
        found["power"] = np.asarray(found[PAID] / shape[1] * scene.rate)
        missed = np.isnan(came["t"]).reshape(shape)
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
    """Say what became of those that did not arrive, (V, M), and whose slip went on after that."""
    every, ended = missed.shape[1], recording.ended.reshape(missed.shape)
    restless = ~missed & (ended != REASONS.index("settled"))
    if recording.machine.until != "settled":
        restless[:] = False
    for row in np.flatnonzero((missed | restless).any(axis=1)).tolist():
        said = []
        if missed[row].any():
            # Of several particles a recording is of one variant.
            fate = (
                told_fates(Counter(fates(recording)[missed[row]].tolist()))
                if every > 1
                else FATES[REASONS[ended[row, 0]]]
            )
            who = f"{np.count_nonzero(missed[row])} of {every} particles" if every > 1 else "it"
            said.append(f"{who} missed the outgoing belt: {fate}")
        if restless[row].any():
            who = f"{restless[row].sum()} of {every} particles" if every > 1 else "it"
            said.append(f"{who} arrived, but never came to rest on a belt: {PAID} has only a part")
        reasons[row] = "; ".join(said)


LONGEST: Final = 6
"""Surfaces that are named: what is thrown to and fro longer goes by the same name."""

NOTHING: Final = "nothing"
"""What a particle touches that meets no surface."""

RARE: Final = 0.02
"""Share up to which a way of few is not told: of the particles of a crowd, of uncertain samples."""


def touches(recording: Recording, variants: int = 1) -> NDArray[Any]:
    """Return which surfaces the particles of each variant meet, (V,) of str.

    Such as ``plate, outgoing``: the kind of an outcome. Numbers of one kind vary smoothly, and a
    mean over several may be near to none of them. It ends with the landing, and impacts in a row on
    one surface count as one. Of a crowd the ways that more than `RARE` of it takes are told, the
    most frequent one first, such as ``plate, outgoing | outgoing``.
    """
    who, surface = _met(recording)
    place = np.arange(len(who)) - np.searchsorted(who, who)
    ways = np.full((recording.count, LONGEST + 1), -1)
    near = place <= LONGEST
    ways[who[near], place[near]] = surface[near]
    # A way as one number: `np.unique` of rows takes ten times as long.
    taken, kinds, some = np.zeros(recording.count, dtype=np.int64), 1, len(recording.surfaces) + 1
    for met in ways.T[: place.max(initial=-1) + 1]:
        if kinds * some > np.iinfo(np.int64).max:
            found, taken = np.unique(taken, return_inverse=True)
            kinds = len(found)
        taken, kinds = taken * some + met + 1, kinds * some
    _, example, taken = np.unique(taken, return_index=True, return_inverse=True)
    every = [[recording.surfaces[k] for k in way if k >= 0] for way in ways[example].tolist()]
    names = np.array(list(map(_named, every)), dtype=object)
    if recording.count == variants:
        texts: NDArray[Any] = names[taken]
        return texts
    texts = np.empty(variants, dtype=object)
    for row, taken_here in enumerate(taken.reshape(variants, -1).tolist()):
        counts = Counter(taken_here).most_common()
        often = [names[way] for way, count in counts if count > RARE * len(taken_here)]
        texts[row] = " | ".join(often or [names[counts[0][0]]])
    return texts


def _named(surfaces: list[str]) -> str:
    if len(surfaces) > LONGEST:
        surfaces[LONGEST - 1 :] = ["and so on"]
    return ", ".join(surfaces) or NOTHING


def _met(recording: Recording) -> tuple[Ints, Ints]:
    """Return particles and the surfaces that each meets up to its landing, (E,) each."""
    kind = recording.events["kind"]
    some = (kind == Kind.IMPACT) | (kind == Kind.LANDING) | (kind == Kind.SETTLE)
    order = some.nonzero()[0]
    order = order[np.argsort(recording.events["particle"][order], kind="stable")]
    # Columns are taken, not rows, which are ten times as large.
    who, surface = recording.events["particle"][order], recording.events["surface"][order]
    lands = kind[order] == Kind.LANDING
    landings = np.cumsum(lands) - lands
    kept = landings == landings[np.searchsorted(who, who)]
    kept[1:] &= (who[1:] != who[:-1]) | (surface[1:] != surface[:-1])
    return who[kept], surface[kept]
