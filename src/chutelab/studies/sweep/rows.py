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

from chutelab.results import REASONS, Kind, Recording
from chutelab.results.arrival import arrivals, fates
from chutelab.results.quantities import measured
from chutelab.results.stream import told_fates
from chutelab.scene.quantities import COLUMNS, FORMER, PAID, REGISTRY, lookup
from chutelab.util.arrays import Bools, Ints

Columns = dict[str, NDArray[Any]]

TOUCHES: Final = "touches"
"""The column that says which surfaces the particles meet, see `touches`; "" without a run."""

REASON: Final = "reason"
"""The column that says why there are no numbers, or not all; "" otherwise."""

TEXTS: Final = (TOUCHES, REASON)
"""The columns of words, which come last."""


def no_column(name: str) -> str:
    """Say which columns of numbers there are, or what is called otherwise in a sweep.

    >>> no_column("landing.x")
    'landing.x is called landing.x.mean now: in a run landing.x is of one particle'
    """
    if (row := REGISTRY.get(name)) and row.of == "lone":
        why = f"{name} is what is paid until nothing slips, this is up to run.until"
        return f"{name} is called {row.together} now: {why}"
    if f"{name}.mean" in COLUMNS:
        return f"{name} is called {name}.mean now: in a run {name} is of one particle"
    if name in FORMER:
        return f"{name} is called {FORMER[name]} now"
    return f"{name}: one of {', '.join(COLUMNS)}"


class Named(dict[str, NDArray[Any]]):
    """Columns by name; asked for one that is not there, it says what it is called."""

    def __missing__(self, name: str) -> NDArray[Any]:
        """Raise a KeyError that says which columns there are."""
        raise KeyError(no_column(name))


def empty(count: int) -> Columns:
    """Return rows that tell nothing yet."""
    found: Columns = {name: np.full(count, np.nan) for name in COLUMNS}
    found |= {name: np.full(count, "", dtype=object) for name in TEXTS}
    return found


def joined(parts: Sequence[Mapping[str, NDArray[Any]]]) -> Columns:
    """Put rows below each other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


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
    found, scene = empty(variants), recording.scene
    for name in found:
        if name in COLUMNS and lookup(name, scene.surfaces):
            found[name] = measured(recording, name)
    found[TOUCHES] = touches(recording, variants)
    if scene.outgoing is not None:
        _tell(found[REASON], recording, np.isnan(arrivals(recording)["t"]).reshape(variants, -1))
    return found


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
            many = f"{np.count_nonzero(missed[row])} of {every} particles" if every > 1 else "it"
            said.append(f"{many} missed the outgoing belt: {fate}")
        if restless[row].any():
            many = f"{restless[row].sum()} of {every} particles" if every > 1 else "it"
            said.append(f"{many} arrived, but never came to rest on a belt: {PAID} has only a part")
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
    particle, surface = _met(recording)
    place = np.arange(len(particle)) - np.searchsorted(particle, particle)
    ways = np.full((recording.count, LONGEST + 1), -1)
    near = place <= LONGEST
    ways[particle[near], place[near]] = surface[near]
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
    particle, surface = recording.events["particle"][order], recording.events["surface"][order]
    lands = kind[order] == Kind.LANDING
    landings = np.cumsum(lands) - lands
    kept = landings == landings[np.searchsorted(particle, particle)]
    kept[1:] &= (particle[1:] != particle[:-1]) | (surface[1:] != surface[:-1])
    return particle[kept], surface[kept]
