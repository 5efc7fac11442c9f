"""One-particle variants that differ in plain numbers, through the exact engine all at once.

A variant is a particle with a machine of its own. What is slow for one by one, validating and
building, is done on arrays too; and every row is, to the bit, the one that `alone` gives. What
does not fit goes to `alone` after all: that is never wrong, only slower.
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
    from chutelab.scene import Scene
    from chutelab.sweep.block import Block
    from chutelab.sweep.columns import Columns

    Ints = NDArray[np.int64]


class Batch:
    """The rows of a block, as they come in.

    Parameters
    ----------
    block : Block
        Whose keys are plain numbers, see `chutelab.scene.family.is_plain`.
    """

    def __init__(self, block: Block) -> None:
        self.block, self.paths = block, block.paths
        self.found = empty(len(block.values))
        self.single: list[int] = []

    def swept(self) -> Columns:
        """Return all rows."""
        template, sound, faults = screened(self.block)
        for row, fault in faults.items():
            self._refuse(row, fault)
        if template is not None and _fits(template, self.paths, self.block.engine):
            self._run(template, sound)
        else:
            self.single += sound.tolist()
        for row in self.single:
            self._put(np.array([row]), alone(self.block, row))
        return self.found

    def _refuse(self, row: int, fault: str) -> None:
        self.found[REASON][row] = one_line(fault)

    def _put(self, which: Ints, columns: Columns) -> None:
        for name, values in columns.items():
            self.found[name][which] = values

    def _scenes(self, template: Scene, which: Ints) -> Scene:
        values = self.block.values[which].T.copy()
        return family(template, dict(zip(self.paths, values, strict=True)))

    def _run(self, template: Scene, which: Ints) -> None:
        """Build all of them, sorting out those that cannot be built, and run what is alike."""
        while len(which):
            try:
                machine = build(self._scenes(template, which))
            except RefusedError as refused:
                out = np.array(list(refused.reasons))
                for row, fault in zip(which[out].tolist(), refused.reasons.values(), strict=True):
                    if fault:
                        self._refuse(row, fault)
                    else:
                        self.single.append(row)
                which = np.delete(which, out)
            else:
                for alike in kinds(machine):
                    part = machine if len(alike) == len(which) else members(machine, alike)
                    self._together(part, which[alike], lambda rows: self._scenes(template, rows))
                return

    def _together(self, machine: Machine, which: Ints, scenes: Callable[[Ints], Scene]) -> None:
        """Run machines that are alike; one that does not get through is run alone."""
        try:
            recording = run(machine, apart=True)
        except (CornerError, StalledError):
            if len(which) == 1:
                self.single += which.tolist()
                return
            for half in np.array_split(np.arange(len(which)), 2):
                self._together(members(machine, half), which[half], scenes)
            return
        self._put(which, rows(recording, scenes(which), len(which)))


def _fits(scene: Scene, paths: tuple[str, ...], engine: str | None) -> bool:
    """Tell whether a scene and the like of it go through the exact engine, one particle each."""
    wanted = scene.run.engine if engine is None else engine
    if wanted == "pymunk" or scene.stream.count > 1:
        return False
    # Whether such a release lies on the belt is a matter of the last digits.
    at_risk = {"particle.radius", "incoming.pulley_radius", "incoming.length"}
    return scene.stream.at is None or at_risk.isdisjoint(paths)
