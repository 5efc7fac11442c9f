"""Many variants of a scene at once: the one place where a design runs them.

Ranges, ``KEY=FROM:TO``, are checked against the scene before anything runs. Beside its numbers each
variant has a *course*: which surfaces particle 0 touches up to its landing. Within one course the
numbers are smooth functions of the keys; where it changes, they may jump.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chutelab.engines.simulation import judged, simulate
from chutelab.results import Recording
from chutelab.results.recorder import StalledError
from chutelab.scene import AnyScene, Scene, SceneError, load
from chutelab.scene.overrides import value_at
from chutelab.scene.variants import Range, Varied, Vary, is_plain, quantity, reason, varied
from chutelab.studies.design.quantities import (
    Quantity,
    courses_of,
    each_once,
    measured,
)
from chutelab.studies.sweep.batch import Block, one_line, together
from chutelab.studies.sweep.rows import touches
from chutelab.util.arrays import Floats, Ints, Progress
from chutelab.util.errors import InputError

ASK: Final = "say what may vary, and between which ends, such as plate.angle_deg from 0 to 80"

MOST: Final = 8
"""Keys that may vary at once: beyond, a search over the whole range takes too long to be one."""

INSIDE: Final = 0.3819660112501051
"""Where in a range it is tried before the search: a share that makes no whole number."""


@dataclass(frozen=True)
class Span:
    """A key of the scene and the range that is searched, low < high."""

    key: str
    """Full path, free surfaces by index."""

    unit: str
    """ "" for a pure number."""

    low: float
    high: float

    start: float | None
    """The scene's own value; None if it has none."""

    @property
    def width(self) -> float:
        """High less low."""
        return self.high - self.low


def ranges(scene: Scene, vary: Varied) -> tuple[Span, ...]:
    """Return the ranges of keys that vary; each is tried on the scene."""

    def read(given: Vary) -> Span:
        home = given.key.partition(".")[0]
        if home in Scene.tables() and getattr(scene, home) in (None, ()):
            named = "[[surface]]" if home == "surface" else f"[{home}]"
            raise InputError(f"the scene has no {named}", given.typed)
        about = quantity(scene, given)
        if about.whole:
            raise InputError(f"{about.path} is a whole number: it cannot be searched", given.typed)
        low, high = given.values
        refused = []
        for tried in (low, low + INSIDE * (high - low), high):
            try:
                scene.with_values({about.path: tried})
            except SceneError as error:
                refused.append(error)
                # What only does not go with other keys may pass.
                if own := [fault for fault in error.faults if fault.key == about.path]:
                    raise InputError(str(own[0]), given.typed) from None
        if len(refused) == 3:
            raise InputError(reason(refused[0]), given.typed)
        value = value_at(scene, about.path)
        start = float(value) if isinstance(value, (int, float)) else None
        return Span(about.path, about.unit, low, high, start)

    return each_once("--vary", varied(vary, Range), read, ASK, MOST)


def suits(scene: Scene, keys: Sequence[str], quantities: Sequence[Quantity]) -> bool:
    """Tell whether variants of a scene can run at once, and all quantities be read off that."""
    return (
        scene.count == 1
        and scene.stream.at is None
        and scene.run.engine not in ("contact", "pymunk")
        and all(map(is_plain, keys))
        and all(quantity.key != "contacts" for quantity in quantities)
    )


MANY: Final = 8
"""Variants from which on it pays to run them at once."""

BLOCK: Final = 4096
"""Variants at once: what they need then is some tens of megabytes, and the progress moves."""

NO_RUN: Final = "no run"
"""The course of a variant that makes no scene, or cannot be run."""


class Outcomes(NamedTuple):
    """What became of N variants."""

    values: Floats
    """The M quantities of each, (N, M); NaN where they did not happen."""

    courses: list[str]
    """Surfaces touched by particle 0, such as ``plate, outgoing``; `NO_RUN` without a run."""

    faults: list[str]
    """Why there was no run; "" where there was one."""

    touches: list[str]
    """Kind of each outcome, see `chutelab.studies.sweep.rows.touches`; `NO_RUN` without a run."""


@dataclass
class Evaluator:
    """Runs variants of a scene, whose `keys` (full paths) vary, and counts them."""

    scene: Scene
    keys: Sequence[str]
    quantities: Sequence[Quantity]

    progress: Progress | None = None
    """Called now and then with the share that is done of the `expected` variants."""

    expected: int = 0
    runs: int = field(default=0, init=False)
    _done: float = field(default=0.0, init=False)

    def __call__(self, points: ArrayLike) -> Outcomes:
        """Run the variants at points, shape (N, K), K values of the keys each."""
        table = np.asarray(points, dtype=np.float64)
        if len(table) > BLOCK:
            parts = list(map(self, np.split(table, range(BLOCK, len(table), BLOCK))))
            return Outcomes(
                np.concatenate([part.values for part in parts]),
                [course for part in parts for course in part.courses],
                [fault for part in parts for fault in part.faults],
                [kind for part in parts for kind in part.touches],
            )
        values = np.full((len(table), len(self.quantities)), np.nan)
        courses, faults, kinds = np.full((3, len(table)), "", dtype=object)
        # The run that ends as the scene says comes last: what both runs know is read off that.
        wanted = {quantity.ending for quantity in self.quantities} - {"any"}
        endings = sorted(wanted, reverse=True) or ["scene"]

        def read(ending: str, recording: Recording, rows: Ints) -> None:
            for column, one in enumerate(self.quantities):
                if one.ending in ("any", ending):
                    values[rows, column] = one.of(recording)
            courses[rows] = courses_of(recording)[: len(rows)]
            kinds[rows] = touches(recording, len(rows))

        left = set(range(len(table)))
        if len(table) >= MANY and suits(self.scene, self.keys, self.quantities):
            left = set()
            for ending in endings:
                base = self.scene.with_values(_until(ending))
                runs, refused, alone = together(Block(base, tuple(self.keys), table))
                for recording, rows in runs:
                    read(ending, recording, rows)
                for row, fault in refused.items():
                    faults[row] = one_line(fault)
                left.update(alone)
                self._ran(len(table) / len(endings))
        for row in sorted(left):
            given = dict(zip(self.keys, table[row].tolist(), strict=True))
            try:
                for ending in endings:
                    recording = judged(self.scene.with_values(given | _until(ending)))
                    read(ending, recording, np.array([row]))
                    for broken in recording.laws[:1]:
                        faults[row] = str(broken)
            except (SceneError, StalledError) as error:
                faults[row] = reason(error) if isinstance(error, SceneError) else str(error)
            self._ran(1)
        values[faults != ""] = np.nan
        courses[faults != ""] = kinds[faults != ""] = NO_RUN
        self.runs += len(table)
        return Outcomes(values, courses.tolist(), faults.tolist(), kinds.tolist())

    def _ran(self, variants: float) -> None:
        self._done += variants
        if self.progress is not None and self.expected:
            self.progress(min(self._done / self.expected, 1.0))


def _until(ending: str) -> dict[str, str]:
    return {"run.until": "settled"} if ending == "settled" else {}


def value(scene: AnyScene, name: str) -> float:
    """Run a scene and return one of its quantities; NaN if it did not happen.

    Names are those of `chutelab.studies.design.quantities`.

    Raises
    ------
    InputError
        If the scene has no such quantity.
    SceneError
        If it cannot be run.

    Examples
    --------
    >>> round(value("perpendicular", "belt_work"), 9)
    0.048
    """
    scene = load(scene)
    wanted = measured(scene, name)
    return float(wanted.of(simulate(scene.with_values(_until(wanted.ending)))))
