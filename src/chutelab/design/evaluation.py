"""Many variants of a scene at once: the one place where they are run.

Beside its numbers each variant has a *course*: which surfaces particle 0 touches up to its landing.
Within one course the numbers are smooth functions of the keys; where it changes, they may jump.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from chutelab.design.courses import course_of
from chutelab.design.families import Family, suits
from chutelab.design.quantities import measured
from chutelab.design.ranges import varied
from chutelab.recorder import StalledError
from chutelab.scene import SceneError, to_dict
from chutelab.simulation import simulate
from chutelab.sweep.block import Block
from chutelab.variation import reason

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike, NDArray

    from chutelab.design.quantities import Quantity
    from chutelab.scene import Scene

    Floats = NDArray[np.float64]


MANY: Final = 8
"""Variants from which on it pays to run them at once."""

BLOCK: Final = 4096
"""Variants at once: what they need then is some tens of megabytes, and the progress moves."""

NO_RUN: Final = "no run"
"""The course of a variant that makes no scene, or cannot be run."""


@dataclass(frozen=True, eq=False)
class Outcomes:
    """What became of N variants.

    Attributes
    ----------
    values : ndarray, shape (N, M)
        The M quantities of each, NaN where they did not happen.
    courses : list of str, length N
        Surfaces touched by particle 0, such as ``plate, outgoing``; `NO_RUN` without a run.
    faults : list of str, length N
        Why there was no run; "" where there was one.
    """

    values: Floats
    courses: list[str]
    faults: list[str]


@dataclass
class Evaluator:
    """Runs variants of a scene, and counts them.

    Attributes
    ----------
    scene : Scene
        What is varied.
    keys : sequence of str
        Full paths of the keys that are.
    quantities : sequence of Quantity
        What is looked at.
    progress : callable, optional
        Called now and then with the share that is done; see `expect`.
    runs : int
        Variants run so far.
    """

    scene: Scene
    keys: Sequence[str]
    quantities: Sequence[Quantity]
    progress: Callable[[float], None] | None = None
    runs: int = field(default=0, init=False)
    _done: float = field(default=0.0, init=False)
    _expected: int = field(default=0, init=False)

    def expect(self, runs: int) -> None:
        """Say how many variants there will be about, for the progress."""
        self._expected = runs

    def __call__(self, points: ArrayLike) -> Outcomes:
        """Run the variants at points, shape (N, K), K values of the keys each."""
        table = np.asarray(points, dtype=np.float64)
        values = np.full((len(table), len(self.quantities)), np.nan)
        courses, faults = [""] * len(table), [""] * len(table)
        left = list(range(len(table)))
        if len(table) >= MANY and suits(self.scene, self.keys, self.quantities):
            left = self._together(table, values, courses, faults)
        for row in left:
            courses[row], faults[row] = self._one(table[row], values[row])
            self._tell(1)
        self.runs += len(table)
        return Outcomes(values, courses, faults)

    def _together(
        self, table: Floats, values: Floats, courses: list[str], faults: list[str]
    ) -> list[int]:
        """Fill in what can be run at once; return the rows that are left."""
        left: set[int] = set()
        for ending, columns in self._endings().items():
            base = varied(self.scene, [], [], _until(ending))
            chosen = [self.quantities[column] for column in columns]
            keys = tuple(self.keys)
            for start in range(0, len(table), BLOCK):
                rows = slice(start, start + BLOCK)
                block = Block(to_dict(base), base.source, keys, keys, table[rows], None)
                family = Family(block, chosen)
                values[rows, columns] = family.values
                for row, (course, fault) in enumerate(
                    zip(family.courses, family.faults, strict=True), start
                ):
                    courses[row], faults[row] = (NO_RUN, fault) if fault else (course, "")
                left |= {start + row for row in family.left}
                self._tell(len(family.values) / len(self._endings()))
        for row in left:
            values[row] = np.nan
        refused = [row for row, fault in enumerate(faults) if fault]
        values[refused] = np.nan
        return sorted(left)

    def _tell(self, runs: float) -> None:
        self._done += runs
        if self.progress is not None and self._expected:
            self.progress(min(self._done / self._expected, 1.0))

    def _endings(self) -> dict[str, list[int]]:
        """Return how the runs must end, and which quantities are read off which."""
        wanted = [quantity.ending for quantity in self.quantities]
        first = "scene" if "scene" in wanted or "settled" not in wanted else "settled"
        endings: dict[str, list[int]] = {}
        for column, ending in enumerate(wanted):
            endings.setdefault(first if ending == "any" else ending, []).append(column)
        return endings

    def _one(self, point: Floats, out: Floats) -> tuple[str, str]:
        """Fill in the quantities of one variant; return its course, or why it has none."""
        course = ""
        try:
            for ending, columns in self._endings().items():
                scene = varied(self.scene, self.keys, point.tolist(), _until(ending))
                recording = simulate(scene)
                course = course_of(recording)
                for column in columns:
                    out[column] = self.quantities[column].of(recording, scene)
        except (SceneError, StalledError) as error:
            out[:] = np.nan
            return NO_RUN, reason(error) if isinstance(error, SceneError) else str(error)
        return course, ""


def _until(ending: str) -> list[str]:
    return ['run.until="settled"'] if ending == "settled" else []


def value(scene: Scene, name: str) -> float:
    """Run a scene and return one of its quantities; NaN if it did not happen.

    Parameters
    ----------
    name : str
        See `chutelab.design.quantities`.

    Raises
    ------
    DesignError
        If the scene has no such quantity.
    SceneError
        If it cannot be run.

    Examples
    --------
    >>> from chutelab.scene import load
    >>> round(value(load("perpendicular"), "belt_work"), 9)
    0.048
    """
    wanted = measured(scene, name)
    given = varied(scene, [], [], _until(wanted.ending))
    return wanted.of(simulate(given), given)
