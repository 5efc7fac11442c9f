"""Validation of many variants at once: key by key, and rules between keys where they matter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.scene.family import accepted, judged_by
from chutelab.variation import setting, variant

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.scene import Scene
    from chutelab.sweep.block import Block
    from chutelab.variation import Variant

    Ints = NDArray[np.int64]


def screened(block: Block) -> tuple[Scene | None, NDArray[np.int64], dict[int, str]]:
    """Validate the variants of a block.

    A value is judged by its key, once for each. The rules between keys judge one variant for each
    combination of what they ask for; other keys cannot change what they say.

    Parameters
    ----------
    block : Block
        Whose keys are plain numbers.

    Returns
    -------
    scene, sound, faults
        One of the sound variants (None if there is none), the numbers of all of them, and what is
        wrong with each of the others.
    """
    values, paths = block.values, block.paths
    good = np.stack([accepted(path, column) for path, column in zip(paths, values.T, strict=True)])
    faults = _of_bad_values(block, good)
    sound = np.flatnonzero(good.all(axis=0))
    template: Scene | None = None
    asked: set[int] = set()
    while len(sound):
        verdicts: dict[int, Variant] = {}
        more = set(asked)
        first, group = _groups(values[sound], sorted(asked))
        for row in sound[first].tolist():
            verdicts[row] = _judged(block, row)
            more |= _asked(block, row)
        if more != asked:
            asked = more
            continue
        reasons = np.array([verdicts[row].fault for row in sound[first].tolist()], dtype=object)
        bad = reasons[group] != ""
        faults |= dict(zip(sound[bad].tolist(), reasons[group][bad].tolist(), strict=True))
        sound = sound[~bad]
        template = next((v.scene for v in verdicts.values() if v.scene is not None), None)
        break
    return template, sound, faults


def _of_bad_values(block: Block, good: NDArray[np.bool_]) -> dict[int, str]:
    """Say what is wrong with variants that have a value which its key does not take."""
    bad = np.flatnonzero(~good.all(axis=0))
    asked = set(range(len(block.paths)))
    for row in np.flatnonzero(good.all(axis=0))[:1].tolist():
        asked = _asked(block, row)
    faults: dict[int, str] = {}
    known: dict[tuple[object, ...], str] = {}
    for row in bad.tolist():
        wrong = ~good[:, row]
        # The same faults have the same words.
        told = tuple(
            float(value) if wrong[k] or k in asked else None
            for k, value in enumerate(block.values[row].tolist())
        )
        if told not in known:
            known[told] = _judged(block, row).fault
        faults[row] = known[told]
    return faults


def _asked(block: Block, row: int) -> set[int]:
    """Return which of the varied keys the rules ask for in a variant."""
    values = block.values[row].tolist()
    asked = judged_by(block.document, [*map(setting, block.keys, values)])
    return {k for k, path in enumerate(block.paths) if path in asked}


def _groups(values: NDArray[np.float64], keys: list[int]) -> tuple[Ints, Ints]:
    """Return the first variant of each combination of some keys, and the combination of each."""
    if not keys:
        return np.zeros(1, dtype=np.int64), np.zeros(len(values), dtype=np.int64)
    _, first, group = np.unique(values[:, keys], axis=0, return_index=True, return_inverse=True)
    return first, group.reshape(-1)


def _judged(block: Block, row: int) -> Variant:
    return variant(block.document, block.source, block.keys, tuple(block.values[row].tolist()))
