"""One-particle variants that differ in plain numbers, through the exact engine all at once.

A variant is a particle with a machine of its own. What is slow for one by one, validating and
building, is done on arrays too; and every number is, to the bit, the one that the variant gives by
itself. What does not fit is left over, to be run alone: that is never wrong, only slower.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.exact import CornerError, kinds, run
from chutelab.machine import RefusedError, build, members
from chutelab.recorder import StalledError
from chutelab.scene.family import family
from chutelab.sweep.alone import alone, one_line
from chutelab.sweep.columns import REASON, empty
from chutelab.sweep.rows import rows
from chutelab.sweep.screening import screened

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from chutelab.machine import Machine
    from chutelab.recording import Recording
    from chutelab.scene import Scene
    from chutelab.sweep.block import Block
    from chutelab.sweep.columns import Columns

    Ints = NDArray[np.int64]
    Reader = Callable[[Recording, Scene, Ints], None]


def swept(block: Block) -> Columns:
    """Return the rows of a block whose keys are plain numbers.

    See `chutelab.scene.family.is_plain`.
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
                out = np.array(list(refused.reasons))
                for row, fault in zip(which[out].tolist(), refused.reasons.values(), strict=True):
                    if fault:
                        self.faults[row] = fault
                    else:
                        self.left.append(row)
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
