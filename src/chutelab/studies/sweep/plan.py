"""The plan of a sweep: keys, values and their order; blocks of variants and their runs.

Values are grids, or samples of several ranges at once: Latin hypercube or Sobol points. Variants
that differ only in plain numbers run many at once, and are validated and built as arrays, too,
which is slow one by one. Others run alone, which gives the same results, only slower.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from chutelab.engines.exact import CornerError, lent
from chutelab.engines.simulation import ENGINES, judged
from chutelab.machine import Machine, RefusedError, build
from chutelab.results import Recording
from chutelab.results.recorder import StalledError
from chutelab.scene import AnyScene, Scene, SceneError, load
from chutelab.scene.quantities import COLUMNS
from chutelab.scene.variants import (
    Family,
    Judge,
    Quantity,
    Range,
    Varied,
    Vary,
    accepted,
    count_of,
    drawn,
    is_plain,
    quantities,
    reason,
    reseeded,
    varied,
)
from chutelab.studies.sweep.rows import ERROR, REASON, TEXTS, Columns, averaged, empty, rows
from chutelab.util.arrays import Floats, Ints
from chutelab.util.errors import InputError, library

DESIGNS: Final = {"lhs": "LatinHypercube", "sobol": "Sobol"}
"""Names of the designs, and of the classes of `scipy.stats.qmc` that draw them."""

MOST_VARIANTS: Final = 1_000_000
"""Rows of one sweep: some 300 MB while it runs."""

MOST_KEYS: Final = 20
"""Keys varied at once."""

TOGETHER: Final = 24576
"""Particles of the variants in a block that goes through the exact engine at once."""

EXACT: Final = 16
"""The same for variants that run one by one, a millisecond each."""

ROOM: Final = 3 * 2**20
"""Numbers that the arrays of a block together hold, and more: 24 MB."""

STEPPED: Final = 1
"""The same for stepped variants, which may take seconds each."""


@dataclass(frozen=True, eq=False)
class Block:
    """Variants to be simulated; can be sent to another process."""

    scene: Scene  # what is varied
    paths: tuple[str, ...]  # full paths of the K keys that are, free surfaces by index
    values: Floats  # (n, K); the values of each variant
    engine: str | None = None  # overrides ``run.engine``
    repeat: int = 1  # seeds that each variant is run with
    judge: Judge | None = None  # of this scene and these paths; blocks in this process share it

    def __getstate__(self) -> dict[str, object]:
        """Another process finds its own judge."""
        return {**vars(self), "judge": None}

    def settings(self, row: int) -> dict[str, float]:
        """Return the values of one variant by path."""
        return dict(zip(self.paths, self.values[row].tolist(), strict=True))


def screened(block: Block) -> tuple[Scene | None, Ints, dict[int, str]]:
    """Validate the variants of a block whose keys are plain numbers.

    Each value is checked once for its key. Rules between keys check one variant for each
    combination of the values that they use; other keys cannot change the result. Returned are one
    valid variant (None if there is none), the numbers of all valid ones, and the faults of the
    others.
    """
    values = block.values
    good = np.stack([accepted(*column) for column in zip(block.paths, values.T, strict=True)]).T
    sound = np.asarray(good.all(axis=1))
    judge = block.judge or Judge(block.scene, block.paths)
    asked = np.array([judge.reads(path) or not sound.any() for path in block.paths])
    while True:
        telling = np.where(good & ~asked, 0.0, values)
        _, first, group = np.unique(
            np.hstack([telling, good]), axis=0, return_index=True, return_inverse=True
        )
        fair = [sound[row] and not judge.finds(block.settings(row)) for row in first.tolist()]
        more = [*map(judge.reads, block.paths)]
        if not np.any(more & ~asked):
            break
        asked |= more
    template, wrong = judge.example, dict[int, str]()
    for number, row in enumerate(first.tolist()):
        if template is not None and fair[number]:
            continue
        try:
            scene = block.scene.with_values(block.settings(row))
            template = template or scene
        except SceneError as error:
            wrong[number] = reason(error)
    judge.example = template
    faults = {n: wrong[g] for n, g in enumerate(group.ravel().tolist()) if g in wrong}
    return template, np.delete(np.arange(len(values)), list(faults)), faults


def runs(block: Block, *, apart: bool = False) -> Iterator[tuple[Ints, Recording | str]]:
    """Run the variants of a block: many at once if possible, else one by one.

    If many run at once, each particle has its own machine; numbers agree with those of the variant
    alone to 1e-12. `apart` runs all of them one by one.

    Yields
    ------
    which, found
        Rows of the block, (N,), and their recording, which breaks no law, for one variant or a
        family; that of a family is valid until the next is asked for. Or the reason, as text, why
        they have none.
    """
    which = np.arange(len(block.values))
    template = None
    if not apart and all(map(is_plain, block.paths)):
        template, which, faults = screened(block)
        yield from ((np.array([row]), one_line(why)) for row, why in faults.items())
    groups: list[Ints] = []
    if template is not None and are_family(template, block.paths, block.engine):
        each = template.count

        def built(some: Ints) -> Machine:
            columns = block.values[some].repeat(each, axis=0).T.copy()
            return build(Family(template, dict(zip(block.paths, columns, strict=True)), each))

        while len(which) and not groups:
            try:
                machine = built(which)
                groups = [which]
            except RefusedError as refused:
                for n, fault in refused.members.items():
                    yield which[[n]], one_line(str(fault))
                which = np.delete(which, list(refused.members))
        which = which[:0]
    left = which.tolist()
    while groups:
        which = groups.pop()
        with suppress(CornerError, StalledError):
            some = machine if each * len(which) == machine.count else built(which)
            with lent(some) as record:
                recording = Recording.of(record)
                if not recording.laws:
                    yield which, recording
                    # Its arrays are valid no longer.
                    vars(recording).clear()
                    continue
        # Variants that fail, or break a law, are found by halving.
        halves = np.array_split(which, 2) if len(which) > 1 else []
        groups += halves
        left += [] if halves else which.tolist()
    for row in left:
        try:
            found = alone(block.scene.with_values(block.settings(row)), block.engine)
        except SceneError as error:
            found = one_line(reason(error))
        yield np.array([row]), found


STEPPED_KEYS: Final = {"air_density", "gravity_deg", "turn", "shake", "travel", "count"}
"""Parts of keys that cannot vary in a family: they need the contact engine, or change the number of
particles."""


def are_family(scene: Scene, paths: Sequence[str], engine: str | None) -> bool:
    """Whether scenes that differ in some plain numbers run at once in the exact engine.

    Their particles do not interact, and if there are several, all are of one kind.
    """
    stepped = scene.crowded or scene.clings or scene.air_density > 0.0
    stepped |= (engine or scene.run.engine) in ("contact", "pymunk")
    stepped |= bool(scene.joints or scene.movers or scene.triggers or scene.one_sided)
    stepped |= scene.run.loads is not None or any(kind.outline for kind in scene.particles)
    stepped |= scene.count > 1 and len(scene.particles) > 1
    return not (stepped or any(STEPPED_KEYS & {*path.split(".")} for path in paths))


def alone(scene: Scene, engine: str | None = None) -> Recording | str:
    """Return the recording of a scene, or why there is no (reliable) one."""
    try:
        recording = judged(scene, engine=engine)
    except SceneError as error:
        return one_line(reason(error))
    except StalledError as error:
        return one_line(f"the run got stuck: {error}")
    return one_line(str(recording.laws[0])) if recording.laws else recording


def row_of(scene: Scene) -> Columns:
    """Simulate a scene and return its row; if it cannot be run, a row with the reason."""
    found = alone(scene)
    return empty(1, found) if isinstance(found, str) else rows(found)


def seeds_of(block: Block) -> Iterator[Block]:
    """Yield the block with each of its seeds, the same for all variants."""
    for number in range(block.repeat):
        yield replace(block, scene=reseeded(block.scene, number), repeat=1, judge=None)


def swept(block: Block, *, apart: bool = False) -> Columns:
    """Return the rows of a block, see `runs`; with several seeds means and their errors."""
    # glibc gives freed memory back to the system beyond twice the largest array freed so far, and
    # each block would have it mapped anew. An array that is not written to costs nothing.
    np.empty(ROOM)
    if block.repeat > 1:
        return averaged([swept(seed, apart=apart) for seed in seeds_of(block)])
    every = empty(len(block.values))
    for which, found in runs(block, apart=apart):
        own = {REASON: found} if isinstance(found, str) else rows(found, len(which))
        for name, values in own.items():
            every[name][which] = values
    return every


def one_line(why: str) -> str:
    """Return a text without line breaks."""
    return " ".join(why.split())


@dataclass(frozen=True, eq=False)
class Plan:
    """A scene and the variants of it, numbered from 0."""

    scene: Scene  # what is varied
    # keys, and the values of each in a grid, or the ends of what samples are drawn from
    varies: tuple[Vary, ...]
    quantities: tuple[Quantity, ...]  # descriptions of the K keys
    engine: str | None  # overrides run.engine
    # (N, K) values of the keys; None for the grid, in which the last key runs fastest
    samples: Floats | None
    repeat: int = 1  # seeds that each variant is run with, the same for all

    @property
    def keys(self) -> tuple[str, ...]:
        """The varied keys, as they were written."""
        return tuple(vary.key for vary in self.varies)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns, those of words last."""
        errors = [f"{name}{ERROR}" for name in COLUMNS if self.repeat > 1]
        return (*self.keys, *COLUMNS, *errors, *TEXTS)

    @property
    def count(self) -> int:
        """Number of variants N."""
        return count_of(self.varies) if self.samples is None else len(self.samples)

    @property
    def begins(self) -> range:
        """First numbers of the blocks; they depend only on the plan, so that it can resume."""
        stream, paths = self.scene.stream, [quantity.path for quantity in self.quantities]
        one = stream.count == 1 and "stream.count" not in self.keys
        wanted = self.engine or self.scene.run.engine
        if wanted in ("contact", "pymunk") or (stream.interact and not one):
            size = STEPPED
        elif all(map(is_plain, paths)) and are_family(self.scene, paths, self.engine):
            size = max(EXACT, TOGETHER // self.scene.count)
        else:
            size = EXACT
        return range(0, self.count, size)

    def block(self, first: int, last: int) -> Block:
        """Return the variants from `first` up to `last`, or the end."""
        last = min(last, self.count)
        if self.samples is not None:
            values = self.samples[first:last]
        else:
            axes = [np.array(vary.values) for vary in self.varies]
            places = np.unravel_index(np.arange(first, last), tuple(map(len, axes)))
            values = np.stack([axis[at] for axis, at in zip(axes, places, strict=True)], axis=1)
        # + 0.0: there is one zero.
        judge = self._judge
        return Block(self.scene, judge.paths, values + 0.0, self.engine, self.repeat, judge)

    @cached_property
    def _judge(self) -> Judge:
        return Judge(self.scene, tuple(quantity.path for quantity in self.quantities))


def planned(
    scene: AnyScene,
    varies: Varied,
    *,
    sample: int | None = None,
    design: str = "lhs",
    seed: int = 0,
    engine: str | None = None,
    repeat: int = 1,
) -> Plan:
    """Check a sweep before anything runs; takes the arguments of `sweep`.

    Raises
    ------
    InputError
        If a key cannot be varied, there are too many variants, or samples cannot be drawn.
    ValueError
        If there is no engine of that name.
    """
    if engine is not None and engine not in ENGINES:
        raise ValueError(f"engine = {engine!r}: one of {', '.join(ENGINES)}")
    scene, kind = load(scene), Vary if sample is None else Range
    varying = tuple(varied(varies, kind))
    for vary in varying:
        if not isinstance(vary, kind):
            raise InputError("samples are drawn between two ends, not from lists", vary.typed)
    if not varying:
        raise InputError("at least one key is to be varied, such as plate.angle_deg", "--vary")
    if len(varying) > MOST_KEYS:
        raise InputError(f"at most {MOST_KEYS} keys can be varied", varying[MOST_KEYS].typed)
    about = quantities(scene, varying)
    drawn(scene, repeat, [one.path for one in about])
    for vary, one in zip(varying, about, strict=True):
        if one.whole and not all(value.is_integer() for value in vary.values):
            raise InputError(f"{one.path} takes whole numbers only", vary.typed)
    if sample is None:
        count_of(varying, MOST_VARIANTS)
        return Plan(scene, varying, about, engine, None, repeat)
    samples = _samples(varying, about, sample, design, seed)
    return Plan(scene, varying, about, engine, samples, repeat)


def _samples(
    varies: Sequence[Vary], about: Sequence[Quantity], count: int, design: str, seed: int
) -> Floats:
    """Draw samples, (count, K); whole numbers include both ends, all equally likely."""
    if design not in DESIGNS:
        raise InputError(f"--design {design}: one of {', '.join(DESIGNS)}")
    if not 1 <= count <= MOST_VARIANTS:
        raise InputError(f"--sample {count}: a whole number from 1 to {MOST_VARIANTS}")
    if seed < 0:
        raise InputError(f"--seed {seed}: a whole number from 0")
    qmc = library("scipy.stats.qmc", "--sample needs SciPy", "design")
    sampler = getattr(qmc, DESIGNS[design])(d=len(varies), seed=np.random.default_rng(seed))
    if design == "sobol":
        # Take the first of a power of two points, as SciPy warns of all other numbers.
        shares = sampler.random_base2((count - 1).bit_length())[:count]
    else:
        shares = sampler.random(count)
    low, high = np.array([vary.values for vary in varies]).T
    whole = np.array([one.whole for one in about])
    points = low + shares * (high - low)
    steps = low + np.floor(shares * (high - low + 1.0))
    return np.asarray(np.where(whole, np.minimum(steps, high), points))
