"""A block of variants run: many at once where they differ in plain numbers only, else one by one.

Many at once, a variant is a particle with a machine of its own. What is slow one by one, validating
and building, is done on arrays too; numbers agree with those of the variant alone to 1e-12. What
does not fit is left over, to be run alone: that is never wrong, only slower.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from chutelab.engines.exact import CornerError, kinds, run
from chutelab.engines.simulation import simulate
from chutelab.machine import Machine, RefusedError, build, members
from chutelab.results import Recording
from chutelab.results.recorder import StalledError
from chutelab.scene import Scene, SceneError
from chutelab.scene.variants import (
    Variant,
    accepted,
    family,
    is_plain,
    judged_by,
    reason,
    setting,
    variant,
)
from chutelab.studies.sweep.rows import REASON, Columns, empty, joined, rows
from chutelab.util.arrays import Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
class Block:
    """Variants to be simulated; plain data, so that it can be sent to another process.

    Attributes
    ----------
    document, source : dict, str
        The scene, as `chutelab.scene.to_dict` has it, and what messages call it.
    keys, paths : tuple of str
        What is varied, as it was written, and full paths, with free surfaces by index.
    values : ndarray, (n, K)
        The values of each variant.
    engine : str or None
        Overrides ``run.engine``.
    """

    document: dict[str, Any]
    source: str
    keys: tuple[str, ...]
    paths: tuple[str, ...]
    values: Floats
    engine: str | None


Reader = Callable[[Recording, Scene, Ints], None]


def screened(block: Block) -> tuple[Scene | None, Ints, dict[int, str]]:
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


def _of_bad_values(block: Block, good: Bools) -> dict[int, str]:
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


def _groups(values: Floats, keys: list[int]) -> tuple[Ints, Ints]:
    """Return the first variant of each combination of some keys, and the combination of each."""
    if not keys:
        return np.zeros(1, dtype=np.int64), np.zeros(len(values), dtype=np.int64)
    _, first, group = np.unique(values[:, keys], axis=0, return_index=True, return_inverse=True)
    return first, group.reshape(-1)


def _judged(block: Block, row: int) -> Variant:
    return variant(block.document, block.source, block.keys, tuple(block.values[row].tolist()))


def alone(block: Block, row: int) -> Columns:
    """Validate and simulate one variant of a block, and return its row."""
    made = variant(block.document, block.source, block.keys, tuple(block.values[row].tolist()))
    return because(made.fault) if made.scene is None else row_of(made.scene, block.engine)


def row_of(scene: Scene, engine: str | None = None) -> Columns:
    """Simulate a scene and return its row; if it cannot be run, one that says why."""
    try:
        recording = simulate(scene, engine)
    except SceneError as error:
        return because(reason(error))
    except StalledError as error:
        return because(f"the run got stuck: {error}")
    return rows(recording, scene)


def because(why: str) -> Columns:
    """Return a row without numbers."""
    found = empty(1)
    found[REASON][0] = one_line(why)
    return found


def one_line(why: str) -> str:
    """Return a text without line breaks."""
    return " ".join(why.split())


def swept_together(block: Block) -> Columns:
    """Return the rows of a block whose keys are plain numbers.

    See `chutelab.scene.variants.is_plain`.
    """
    found = empty(len(block.values))

    def put(which: Ints, columns: Columns) -> None:
        for name, values in columns.items():
            found[name][which] = values

    def read(recording: Recording, scenes: Scene, which: Ints) -> None:
        put(which, rows(recording, scenes, len(which)))

    batch = Batch(block, read)
    for row in batch.left:
        put(np.array([row]), alone(block, row))
    for row, fault in batch.faults.items():
        found[REASON][row] = one_line(fault)
    return found


class Batch:
    """Runs what can be run at once of a block, as it is made.

    Parameters
    ----------
    block : Block
        Whose keys are plain numbers.
    read : callable
        Takes a recording with a particle for each of N variants, their scenes as a family, and
        their rows in the block, (N,); called for each group of variants that went through.

    Attributes
    ----------
    faults : dict of int to str
        Why there is no run, by row.
    left : list of int
        Rows that have to be run alone.
    """

    def __init__(self, block: Block, read: Reader) -> None:
        self.block, self.read = block, read
        template, sound, self.faults = screened(block)
        self.left: list[int] = []
        if template is not None and _fits(template, block.paths, block.engine):
            self._run(template, sound)
        else:
            self.left += sound.tolist()

    def _scenes(self, template: Scene, which: Ints) -> Scene:
        values = self.block.values[which].T.copy()
        return family(template, dict(zip(self.block.paths, values, strict=True)))

    def _run(self, template: Scene, which: Ints) -> None:
        """Build all of them, sorting out those that cannot be built, and run what is alike."""
        while len(which):
            try:
                machine = build(self._scenes(template, which))
            except RefusedError as refused:
                out = list(refused.members)
                faults = map(str, refused.members.values())
                self.faults |= dict(zip(which[out].tolist(), faults, strict=True))
                which = np.delete(which, out)
            else:
                for alike in kinds(machine):
                    part = machine if len(alike) == len(which) else members(machine, alike)
                    self._together(part, which[alike], template)
                return

    def _together(self, machine: Machine, which: Ints, template: Scene) -> None:
        """Run machines that are alike; one that does not get through is left over."""
        try:
            recording = run(machine, apart=True)
        except (CornerError, StalledError):
            if len(which) == 1:
                self.left += which.tolist()
                return
            for half in np.array_split(np.arange(len(which)), 2):
                self._together(members(machine, half), which[half], template)
            return
        self.read(recording, self._scenes(template, which), which)


def _fits(scene: Scene, paths: tuple[str, ...], engine: str | None) -> bool:
    """Tell whether a scene and the like of it go through the exact engine, one particle each."""
    wanted = scene.run.engine if engine is None else engine
    if wanted in ("contact", "pymunk") or scene.stream.count > 1:
        return False
    # Whether such a release lies on the belt is a matter of the last digits.
    at_risk = {"particle.radius", "incoming.pulley_radius", "incoming.length"}
    return scene.stream.at is None or at_risk.isdisjoint(paths)


def swept(block: Block) -> Columns:
    """Return the rows of a block: together where that can be, else one by one."""
    if all(is_plain(path) for path in block.paths):
        return swept_together(block)
    return joined([alone(block, row) for row in range(len(block.values))])
