"""Many variants of a scene at once: the one place where a design runs them.

Ranges, ``KEY=FROM:TO``, are checked against the scene before anything runs. Beside its numbers each
variant has a *course*: which surfaces particle 0 touches up to its landing. Within one course the
numbers are smooth functions of the keys; where it changes, they may jump.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from chutelab.engines.simulation import simulate
from chutelab.results import ENTRIES, Recording
from chutelab.results.recorder import StalledError
from chutelab.scene import Scene, SceneError, rules
from chutelab.scene.overrides import value_at
from chutelab.scene.variants import is_plain, parse_range, quantity, reason
from chutelab.studies.design.quantities import (
    DesignError,
    Ending,
    Quantity,
    courses_of,
    each_once,
    measured,
)
from chutelab.studies.sweep.batch import Block, one_line, together
from chutelab.util.arrays import Floats, Ints, Progress

FORM: Final = "must be KEY=FROM:TO, such as plate.angle_deg=0:80"

ASK = f"say what may vary; it {FORM}"

MOST: Final = 8
"""Keys that may vary at once: beyond, a search over the whole range takes too long to be one."""

INSIDE: Final = 0.3819660112501051
"""Where in a range it is tried before the search: a share that makes no whole number."""


@dataclass(frozen=True)
class Span:
    """A key of the scene and the range that is searched.

    Attributes
    ----------
    key, unit, label : str
        Its full path, free surfaces by index; its unit, "" for a pure number; what it is.
    low, high : float
        Ends of the range, low < high.
    start : float or None
        The scene's own value; None if it has none.
    """

    key: str
    unit: str
    low: float
    high: float
    start: float | None
    label: str

    @property
    def width(self) -> float:
        """High less low."""
        return self.high - self.low


def ranges(scene: Scene, texts: Sequence[str]) -> tuple[Span, ...]:
    """Read what ``--vary`` takes, several times.

    Raises
    ------
    InputError
        If a range cannot be read, is empty, goes beyond what the scene allows, or is of a key that
        is unknown, no continuous number, or given twice.
    """

    def read(text: str) -> Span:
        if text.count(":") != 1:
            raise DesignError(f"--vary {text}", FORM)
        given = parse_range(text)
        home = given.key.partition(".")[0]
        if home in Scene.tables() and getattr(scene, home) in (None, ()):
            named = "[[surface]]" if home == "surface" else f"[{home}]"
            raise DesignError(given.typed, f"the scene has no {named}")
        about = quantity(scene, given)
        if about.whole:
            raise DesignError(given.typed, f"{about.path} is a whole number: it cannot be searched")
        low, high = given.values
        refused = []
        for tried in (low, low + INSIDE * (high - low), high):
            try:
                scene.with_values({about.path: tried})
            except SceneError as error:
                refused.append(error)
                # What only does not go with other keys may pass.
                if own := [fault for fault in error.faults if fault.key == about.path]:
                    raise DesignError(given.typed, str(own[0])) from None
        if len(refused) == 3:
            raise DesignError(given.typed, reason(refused[0]))
        value = value_at(scene, about.path)
        start = float(value) if isinstance(value, (int, float)) else None
        return Span(about.path, about.unit, low, high, start, about.label)

    return each_once("--vary", texts, read, ASK, MOST)


def suits(scene: Scene, keys: Sequence[str], quantities: Sequence[Quantity]) -> bool:
    """Tell whether variants of a scene can run at once, and all quantities be read off that."""

    def readable(quantity: Quantity) -> bool:
        match quantity.key.split("."):
            case _ if quantity.source != "run":
                return True
            case ["separation" | "impact" | "landing", *column]:
                return column[-1] not in ("count", *rules.STATISTICS)
            case ["ledger", name]:
                return name in ENTRIES
            case ["ledger", "by_surface", *_]:
                return True
            case [symbol]:
                return symbol in rules.SYMBOLS and symbol not in ("belt_work", "slip_heat")
        return False

    return (
        scene.stream.count == 1
        and scene.stream.at is None
        and scene.run.engine not in ("contact", "pymunk")
        and all(map(is_plain, keys))
        and all(map(readable, quantities))
    )


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
        Called now and then with the share that is done of the `expected` variants.
    runs : int
        Variants run so far.
    """

    scene: Scene
    keys: Sequence[str]
    quantities: Sequence[Quantity]
    progress: Progress | None = None
    expected: int = 0
    runs: int = field(default=0, init=False)
    _done: float = field(default=0.0, init=False)

    def __call__(self, points: ArrayLike) -> Outcomes:
        """Run the variants at points, shape (N, K), K values of the keys each."""
        table = np.asarray(points, dtype=np.float64)
        values = np.full((len(table), len(self.quantities)), np.nan)
        courses, faults = np.full((2, len(table)), "", dtype=object)
        wanted = [quantity.ending for quantity in self.quantities]
        common: Ending = "scene" if "scene" in wanted or "settled" not in wanted else "settled"
        endings: dict[Ending, list[int]] = {}
        for column, ending in enumerate(wanted):
            endings.setdefault(common if ending == "any" else ending, []).append(column)

        def read(rows: Ints, columns: list[int], recording: Recording) -> None:
            for column in columns:
                values[rows, column] = self.quantities[column].of(recording)
            courses[rows] = courses_of(recording, len(rows))

        def ran(runs: float) -> None:
            self._done += runs
            if self.progress is not None and self.expected:
                self.progress(min(self._done / self.expected, 1.0))

        left = set(range(len(table)))
        if len(table) >= MANY and suits(self.scene, self.keys, self.quantities):
            left = set()
            for rows in np.split(np.arange(len(table)), range(BLOCK, len(table), BLOCK)):
                for ending, columns in endings.items():
                    base = self.scene.with_values(_until(ending))
                    block = Block(base, tuple(self.keys), table[rows])
                    runs, refused, alone = together(block)
                    for recording, some in runs:
                        read(rows[some], columns, recording)
                    for row, fault in refused.items():
                        faults[rows[row]] = one_line(fault)
                    left |= set(rows[alone].tolist())
                    ran(len(rows) / len(endings))
        for row in sorted(left):
            given = dict(zip(self.keys, table[row].tolist(), strict=True))
            try:
                for ending, columns in endings.items():
                    recording = simulate(self.scene.with_values(given | _until(ending)))
                    read(np.array([row]), columns, recording)
            except (SceneError, StalledError) as error:
                faults[row] = reason(error) if isinstance(error, SceneError) else str(error)
            ran(1)
        values[faults != ""] = np.nan
        courses[faults != ""] = NO_RUN
        self.runs += len(table)
        return Outcomes(values, courses.tolist(), faults.tolist())


def _until(ending: str) -> dict[str, Any]:
    return {"run.until": "settled"} if ending == "settled" else {}


def value(scene: Scene, name: str) -> float:
    """Run a scene and return one of its quantities; NaN if it did not happen.

    Parameters
    ----------
    name : str
        See `chutelab.studies.design.quantities`.

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
    return float(wanted.of(simulate(scene.with_values(_until(wanted.ending)))))
