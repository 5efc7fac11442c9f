"""The question: possible targets and keys; and the one place where variants are run.

>>> from chutelab.scene import load
>>> left, right = target(load("perpendicular"), "landing.vx", "outgoing.speed")
>>> left.unit, right.name
('m/s', 'outgoing.speed')

Also here: the course of a particle (the surfaces that it touches up to its landing), and the
sensitivity of a quantity to each key: its slope, and the effect of one per cent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import groupby, product
from math import inf, nan
from operator import itemgetter
from time import monotonic
from typing import Any, Final, Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab import core
from chutelab.engines.simulation import simulate
from chutelab.results import REASONS, Kind, Recording
from chutelab.results.quantities import measured as read
from chutelab.scene import MISSING, AnyScene, Scene, SceneError, load
from chutelab.scene.overrides import value_at
from chutelab.scene.quantities import Ending, lookup, suggestion, whose
from chutelab.scene.units import read_size
from chutelab.scene.variants import (
    Range,
    Varied,
    Vary,
    is_plain,
    quantity,
    reason,
    reseeded,
    varied,
)
from chutelab.studies.sweep import Crew
from chutelab.studies.sweep.plan import Block, are_family, runs
from chutelab.studies.sweep.rows import touches
from chutelab.util.arrays import Bools, Floats, Ints, Progress
from chutelab.util.errors import InputError, library

T = TypeVar("T")


def each_once(
    option: str, given: Sequence[Any], read: Callable[[Any], T], ask: str, most: int
) -> tuple[T, ...]:
    """Read the values of an option given 1 to `most` times; each result has its own `key`."""
    if not given:
        raise InputError(ask, option)
    if len(given) > most:
        raise InputError(f"at most {most} keys are allowed", given[most].typed)
    found: dict[str, T] = {}
    for asked in given:
        one: Any = read(asked)
        if one.key in found:
            raise InputError(f"{one.key} is given already", asked.typed)
        found[one.key] = one
    return tuple(found.values())


def scipy(name: str) -> Any:
    """Return a module of SciPy, such as ``optimize``; the error says what to install."""
    return library(f"scipy.{name}", "SciPy is needed", "design")


MANY_TOUCHES: Final = int(core.number("MANY_TOUCHES"))
"""Touches of one surface in a row beyond this number are ignored: a particle that bounces to rest
has a thousand, and extra bounces do not change the sequence of contacts."""

LONGEST: Final = 6
"""Most surfaces that are named; longer sequences are cut off."""


def courses_of(recording: Recording) -> list[str]:
    """Return the surfaces that particle 0 of each variant touches up to its landing.

    Such as ``plate, outgoing``, or ``plate, never lands (exit)``.
    """
    each = recording.count // recording.variants
    touched: list[list[int]] = [[] for _ in range(recording.variants)]
    landed = [False] * recording.variants
    events, some = recording.events, recording.which(Kind.IMPACT, Kind.LANDING)
    some = some[events["particle"][some] % each == 0]
    columns = (events[name][some].tolist() for name in ("particle", "surface", "kind"))
    for particle, surface, kind in zip(*columns, strict=True):
        variant = particle // each
        if not landed[variant]:
            touched[variant].append(surface)
            landed[variant] = kind == Kind.LANDING

    @cache
    def course(surfaces: tuple[int, ...], end: str) -> str:
        names = []
        for surface, group in groupby(surfaces):
            times = len(list(group))
            often = {1: "", 2: " twice"}.get(times, f" {times} times")
            often = often if times < MANY_TOUCHES else " many times"
            names.append(f"{recording.surfaces[surface]}{often}")
        if len(names) > LONGEST:
            names[LONGEST - 1 :] = ["and so on"]
        return ", ".join([*names, end] if end else names)

    ends = [
        "" if down else f"never lands ({REASONS[reason]})"
        for down, reason in zip(landed, recording.ended[::each].tolist(), strict=True)
    ]
    return [course(tuple(one), end) for one, end in zip(touched, ends, strict=True)]


@dataclass(frozen=True)
class Quantity:
    """A number of a run, the value of a key of the scene, or a plain number."""

    name: str  # as it was asked for
    unit: str
    # for a run: its name, see `chutelab.scene.quantities`. For the scene: the full path.
    key: str = ""
    source: Literal["run", "scene", "number"] = "run"
    ending: Ending = "any"
    number: float = 0.0

    def of(self, recording: Recording) -> Any:
        """Return its value, for a family (N,); NaN if it did not happen."""
        value: Any = self.number
        if self.source == "scene":
            family = recording.family if is_plain(self.key) else None
            value = family.firsts.at(self.key) if family else value_at(recording.scene, self.key)
            return nan if value is None or value is MISSING or isinstance(value, str) else value
        if self.source == "run":
            value = read(recording, self.key)
            value = value if recording.family else value[0]
        return value


def measured(scene: Scene, name: str, typed: str = "") -> Quantity:
    """Return the quantity of a scene by name; messages call it `typed`.

    Raises an `InputError` if the scene has no such quantity.
    """
    row = lookup(name, scene.places, [str(stream.name) for stream in scene.streams])
    if row is None:
        allowed = f"no such quantity here; {suggestion(name, scene.places)}"
        raise InputError(allowed, typed or name)
    if which := whose(row, scene.count):
        raise InputError(which, typed or name)
    return Quantity(name, row.unit, name, ending=row.ending)


def target(
    scene: Scene, name: str, value: float | str, typed: str = ""
) -> tuple[Quantity, Quantity]:
    """Return a quantity, and the number, key or quantity that it should equal.

    Raises an `InputError` if one of them is unknown, or their units differ.
    """
    typed = typed or f"target {name}={value}"
    left = measured(scene, name, typed)
    try:
        number, unit = read_size(value) if isinstance(value, str) else (value, "")
        right = Quantity(f"{number:.12g} {unit}".strip(), unit, source="number", number=number)
    except ValueError as error:
        text = str(value)
        if text[0].isdigit() or text[0] in "+-.":
            allowed = f"{text} is no number of a quantity {_in(left.unit)}; {error}"
            raise InputError(allowed, typed) from None
        if lookup(text, scene.places) is not None:
            right = measured(scene, text, typed)
        else:
            try:
                found = quantity(scene, Vary(text, (0.0,), typed))
            except InputError as fault:
                allowed = f"{text} is neither a number, nor a quantity, nor a key of the scene"
                raise InputError(f"{allowed}: {fault.allowed}", typed) from None
            if not isinstance(value_at(scene, found.path), (int, float)):
                said = f"{found.path} has no number as its value in this scene"
                raise InputError(said, typed) from None
            right = Quantity(found.path, found.unit, found.path, "scene")
    if right.source == "number" and right.unit == "":
        right = replace(right, name=f"{right.name} {left.unit}".strip(), unit=left.unit)
    if right.unit != left.unit:
        raise InputError(
            f"{left.name} is {_in(left.unit)}, and {right.name} is {_in(right.unit)}", typed
        )
    if right == left:
        raise InputError("both sides are the same", typed)
    return left, right


def _in(unit: str) -> str:
    return f"in {unit}" if unit else "a pure number"


ASK: Final = "say what may vary, and between which ends, such as plate.angle_deg from 0 to 80"

MOST: Final = 8
"""Most keys that may vary at once; with more, a search over the whole range takes too long."""

INSIDE: Final = 0.3819660112501051
"""Share of a range at which a key is tried before the search; it gives no whole number."""


@dataclass(frozen=True)
class Span:
    """A key of the scene and the range that is searched, low < high."""

    key: str  # full path, free surfaces by index
    unit: str  # "" for a pure number
    low: float
    high: float
    start: float | None  # the scene's own value; None if it has none

    @property
    def width(self) -> float:
        """High less low."""
        return self.high - self.low


def ranges(scene: Scene, vary: Varied) -> tuple[Span, ...]:
    """Return the ranges of varied keys; each is tried on the scene."""

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
                # A value that only contradicts other keys is accepted here.
                if own := [fault for fault in error.faults if fault.key == about.path]:
                    raise InputError(str(own[0]), given.typed) from None
        if len(refused) == 3:
            raise InputError(reason(refused[0]), given.typed)
        value = value_at(scene, about.path)
        start = float(value) if isinstance(value, (int, float)) else None
        return Span(about.path, about.unit, low, high, start)

    return each_once("--vary", varied(vary, Range), read, ASK, MOST)


FEWEST: Final = 8
"""With at least so many variants it pays to run them at once."""

BLOCK: Final = 4096
"""Variants run at once: they need some tens of megabytes, and progress is reported between."""

NO_RUN: Final = "no run"
"""The course of a variant that is not a valid scene, or cannot be run."""


class Outcomes(NamedTuple):
    """Results of N variants."""

    values: Floats  # the M quantities of each, (N, M); NaN if they did not happen
    # surfaces touched by particle 0, such as ``plate, outgoing``; `NO_RUN` without a run
    courses: list[str]
    faults: list[str]  # why there was no run; "" if there was one
    # kind of each outcome, see `chutelab.studies.sweep.rows.touches`; `NO_RUN` without a run
    touches: list[str]


class Stopped(Exception):  # noqa: N818 - no fault: time is up
    """A search was ended early; its results so far are in `Evaluator.seen`."""


class Task(NamedTuple):
    """Variants to be run in one go; can be sent to another process."""

    rows: slice  # indices of the points
    block: Block
    quantities: Sequence[Quantity]
    apart: bool


def carried_out(task: Task) -> list[tuple[Ints, Floats, list[str], str, NDArray[Any]]]:
    """Run the variants of a task: rows, values, courses, why there is no run, and touches."""
    found = []
    for which, one in runs(task.block, apart=task.apart):
        rows, nothing = task.rows.start + which, np.full((len(which), len(task.quantities)), np.nan)
        if isinstance(one, str):
            none = np.full(len(which), NO_RUN, dtype=object)
            found.append((rows, nothing, [NO_RUN] * len(which), one, none))
            continue
        for column, wanted in enumerate(task.quantities):
            nothing[:, column] = wanted.of(one)
        found.append((rows, nothing, courses_of(one), "", touches(one, len(rows))))
    return found


@dataclass
class Evaluator:
    """Runs variants of a scene, whose `keys` (full paths) vary, and counts them."""

    scene: Scene
    keys: Sequence[str]
    quantities: Sequence[Quantity]
    # called now and then with the share that is done of the `expected` variants
    progress: Progress | None = None
    expected: int = 0
    team: Crew = field(default_factory=Crew)
    ends: float = inf  # `monotonic` at which it raises a `Stopped`
    runs: int = field(default=0, init=False)
    # the points (N, K) and values (N, M) of each call that is done
    seen: list[tuple[Floats, Floats]] = field(default_factory=list, init=False)
    stopped: Stopped | KeyboardInterrupt | None = field(default=None, init=False)
    ran: Bools = field(default_factory=lambda: np.empty(0, dtype=bool), init=False)

    def __call__(self, points: ArrayLike) -> Outcomes:
        """Run the variants at points, shape (N, K), K values of the keys each."""
        table = np.asarray(points, dtype=np.float64)
        values = np.full((len(table), len(self.quantities)), np.nan)
        courses, faults, kinds = np.full((3, len(table)), "", dtype=object)
        # The run that ends as the scene says comes last, so its values are kept where both have
        # them.
        wanted = {quantity.ending for quantity in self.quantities} - {"any"}
        endings = sorted(wanted, reverse=True) or ["scene"]
        # A family does not have these for each variant.
        together = ("contacts", "sensor", "wear")
        apart = len(table) < FEWEST
        apart |= any(one.key.split(".")[0] in together for one in self.quantities)
        tasks = []
        for start, ending in product(range(0, len(table), self.size), endings):
            rows = slice(start, start + self.size)
            block = Block(self.scene.with_values(_until(ending)), tuple(self.keys), table[rows])
            tasks.append((ending, Task(rows, block, self.quantities, apart)))
        results = self.results([task for _, task in tasks])
        for number, found in sorted(results, key=itemgetter(0)):
            ending = tasks[number][0]
            own = [n for n, one in enumerate(self.quantities) if one.ending in ("any", ending)]
            for rows, some, ways, fault, touched in found:
                values[np.ix_(rows, own)] = some[:, own]
                faults[rows], courses[rows], kinds[rows] = fault or faults[rows], ways, touched
        values[faults != ""] = np.nan
        courses[faults != ""] = kinds[faults != ""] = NO_RUN
        self.runs += len(table)
        self.seen.append((table, values))
        return Outcomes(values, courses.tolist(), faults.tolist(), kinds.tolist())

    @property
    def size(self) -> int:
        """Variants per task: one if each may take long and there are other processes."""
        together = are_family(self.scene, self.keys, None)
        return max(1, BLOCK // self.scene.count) if together or self.scene.count == 1 else 1

    def seeds(self, points: Floats, count: int) -> Floats:
        """Run variants at points (N, K) with `count` seeds, the same for all; values (N, S, M).

        If time is up or Ctrl-C is pressed, `stopped` is set, and `ran`, (N,), marks finished ones.
        """
        wanted = {quantity.ending for quantity in self.quantities} - {"any"}
        scene = self.scene.with_values(_until("settled" if "settled" in wanted else "scene"))
        seeded = [reseeded(scene, number) for number in range(count)]
        places = list(product(range(len(points)), range(count)))
        tasks = [
            Task(
                slice(0, 1), Block(seeded[s], tuple(self.keys), points[[n]]), self.quantities, True
            )
            for n, s in places
        ]
        values = np.full((len(points), count, len(self.quantities)), np.nan)
        left = np.full(len(points), count)
        try:
            for number, ((_, some, *_),) in self.results(tasks):
                values[places[number]] = some[0]
                left[places[number][0]] -= 1
        except (Stopped, KeyboardInterrupt) as stopped:
            self.stopped = stopped
        self.ran = left == 0
        self.runs += len(tasks) - int(left.sum())
        return values

    def results(self, tasks: Sequence[Task]) -> Iterator[tuple[int, Any]]:
        """Yield the number and result of each task; raises a `Stopped` if time is up."""
        variants = sum(len(task.block.values) for task in tasks)
        with closing(self.team.results(carried_out, enumerate(tasks))) as results:
            for done, found in enumerate(results, 1):
                yield found
                if monotonic() >= self.ends:
                    raise Stopped
                if self.progress is not None and self.expected:
                    share = self.runs + variants * done / len(tasks)
                    self.progress(min(share / self.expected, 1.0))


def _until(ending: str) -> dict[str, str]:
    return {"run.until": "settled"} if ending == "settled" else {}


def value(scene: AnyScene, name: str) -> float:
    """Run a scene and return one of its quantities; NaN if it did not happen.

    Names are those of `chutelab.scene.quantities`.

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


STEPS: Final = (1e-3, 1e-4, 1e-5, 1e-6)
"""Steps as shares of a range: with the largest, differences lose the fewest digits to rounding;
with the smallest they are least affected by curvature."""

PERCENT: Final = 0.01

ROUNDING: Final = 1e-15
"""Relative error of a quantity; a difference over a step must be well above it."""

STEADY: Final = 0.01
"""Largest relative change of a one-sided slope when its step is halved."""


@dataclass(frozen=True)
class Sensitivity:
    """The effect of a key on a quantity at a point."""

    # the key and its unit
    key: str
    unit: str
    # the quantity and its unit
    quantity: str
    quantity_unit: str
    # in quantity_unit per unit; NaN if the course changes within a millionth of the range
    derivative: float
    step: float  # one per cent of the key's value; of its range, if its value is 0
    # the quantity with the key one `step` less and more; NaN without a value
    lower: float
    upper: float
    courses: tuple[str, str]  # the way of particle 0 there


def sensitivities(
    evaluate: Evaluator, ranges: Sequence[Span], at: Floats, columns: Sequence[int]
) -> tuple[Sensitivity, ...]:
    """Return the effect of each key on some quantities at a point, (K,)."""
    found = []
    for one, unit in zip(ranges, np.eye(len(at)), strict=True):
        derivative = _derivatives(evaluate, at, unit * one.width)
        step = PERCENT * (float(unit @ np.abs(at)) or one.width)
        sides = evaluate([at - step * unit, at + step * unit])
        for column in columns:
            quantity = evaluate.quantities[column]
            lower, upper = (float(value) for value in sides.values[:, column])
            found.append(
                Sensitivity(
                    one.key, one.unit, quantity.name, quantity.unit, float(derivative[column]),
                    step, lower, upper, (sides.courses[0], sides.courses[1]),
                )
            )  # fmt: skip
    return tuple(found)


def _derivatives(evaluate: Evaluator, at: Floats, along: Floats) -> Floats:
    """Return the derivatives of all quantities by one key; one-sided next to a change of course.

    Differences over a step and half of it are extrapolated. Of all steps the one at which the two
    agree best counts, since next to a jump the function may bend within any step. `along` is the
    range of the key in its own direction, (K,).
    """
    (here,), (course,), *_ = evaluate(at[np.newaxis])
    steps = np.multiply.outer(STEPS, (1.0, 0.5))
    shares = np.multiply.outer((1.0, -1.0), steps)
    found = evaluate(at + shares.reshape(-1, 1) * along)
    # Both sides, all steps, whole and half: (2, S, 2), and for values the M quantities.
    values = found.values.reshape(*shares.shape, -1)
    usable = (np.array(found.courses) == course).reshape(shares.shape).all(axis=2)
    steps = steps[..., np.newaxis] * along.sum()
    both = usable.all(axis=0)
    if both.any():
        far, half = np.moveaxis((values[0] - values[1])[both] / (2.0 * steps[both]), 1, 0)
        apart = np.abs(half - far) + ROUNDING * np.abs(here) / steps[both, 0]
        best = np.argmin(np.where(np.isfinite(apart), apart, np.inf), axis=0)
        chosen: Floats = np.take_along_axis((4.0 * half - far) / 3.0, best[np.newaxis], axis=0)[0]
        return chosen
    for side, sign in enumerate((1.0, -1.0)):
        if usable[side].any():
            smallest = np.flatnonzero(usable[side])[-1]
            far, half = (values[side, smallest] - here) / (sign * steps[smallest])
            # A slope that depends on the step does not exist: at a grazing impact it is infinite.
            steady = np.abs(half - far) <= STEADY * np.abs(half)
            slope: Floats = np.where(steady, 2.0 * half - far, np.nan)
            return slope
    return np.full(len(here), np.nan)
