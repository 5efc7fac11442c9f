"""`sweep`: all variants of a scene, by whoever does the work, and what came of each."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from chutelab.scene.family import is_plain
from chutelab.sweep.block import Block, swept
from chutelab.sweep.columns import NUMBERS, REASON, joined
from chutelab.sweep.part import Part
from chutelab.sweep.plan import Plan, planned
from chutelab.sweep.result import Sweep
from chutelab.sweep.table import columns_of, format_of, text_of, write, write_csv
from chutelab.sweep.workers import Crew, crew

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from concurrent.futures import Executor

    from chutelab.scene import Scene
    from chutelab.sweep.columns import Columns
    from chutelab.variation import Vary

TOGETHER: Final = 8192
"""Variants in a block that goes through the exact engine at once."""

EXACT: Final = 16
"""The same of variants that go one by one, a millisecond each."""

STEPPED: Final = 1
"""The same of variants that are stepped: each may take seconds."""


AHEAD: Final = 64
"""Blocks that an executor of the caller's has at a time."""


def sweep(
    scene: Scene,
    varies: Sequence[Vary | str] | Mapping[str, Any],
    *,
    sample: int | None = None,
    design: str = "lhs",
    seed: int = 0,
    engine: str | None = None,
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> Sweep:
    """Simulate many variants of a scene.

    Variants of one particle that differ in plain numbers go through the exact engine together;
    every row is the one that `chutelab.simulate` of its variant gives, to the bit.

    Parameters
    ----------
    scene : Scene
        From `chutelab.load`.
    varies : sequence of Vary or str, or mapping
        ``KEY=FROM:TO:COUNT`` or ``KEY=a,b,c`` each, or values by key; a grid of all combinations,
        whose last key runs fastest. With `sample`, ``KEY=FROM:TO``, or two ends by key.
    sample : int, optional
        Draw so many samples from the ranges instead; needs SciPy.
    design, seed : {"lhs", "sobol"}, int
        Latin hypercube or Sobol points, and the seed.
    engine : {"auto", "exact", "contact", "pymunk"}, optional
        Overrides the scene's ``run.engine``.
    jobs : int
        Processes to spread the work over; 0 is one for each processor.
    executor : concurrent.futures.Executor, optional
        Who does the work instead, such as that of a Dask client.
    progress : callable, optional
        Called now and then with the share that is done, 0 to 1.

    Returns
    -------
    Sweep
        Also of variants that cannot be, or miss: with the reason.

    Raises
    ------
    VaryError, SampleError
        If the variants cannot be made so; before anything runs.

    Examples
    --------
    >>> import chutelab
    >>> swept = sweep(chutelab.load("perpendicular"), ["plate.restitution=0:1:3"])
    >>> swept.columns["landing.vx"]
    array([ 0., -1., -2.])
    """
    plan = planned(scene, varies, sample=sample, design=design, seed=seed, engine=engine)
    with ExitStack() as stack:
        team = Crew(executor, AHEAD, None) if executor else stack.enter_context(crew(jobs))
        return swept_by(plan, team, progress=progress)


def swept_by(plan: Plan, team: Crew, *, progress: Callable[[float], None] | None = None) -> Sweep:
    """Carry a plan out; see `sweep_to`."""
    found = dict(_work(plan, team, {}, progress))
    return _gathered(plan, [found[begin] for begin in sorted(found)])


def sweep_to(
    plan: Plan,
    out: str | Path,
    team: Crew,
    *,
    resume: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Sweep:
    """Carry a plan out and write its rows to a file, whole or not at all.

    Finished rows are kept beside it meanwhile, see `chutelab.sweep.part`; an interrupted sweep goes
    on from there with `resume`, and writes the same file as one that was not.

    Parameters
    ----------
    plan : Plan
        From `planned`.
    out : str or Path
        A .csv or .parquet file.
    team : Crew
        Who does the work, from `chutelab.sweep.workers.crew`.
    resume : bool
        Whether to go on with an interrupted sweep, if there is one.
    progress : callable, optional
        Called now and then with the share that is done, 0 to 1.

    Raises
    ------
    TableError, PartError
        If the file is of no known format or a folder, or there are rows of another sweep.
    """
    out, form = Path(out), format_of(out)
    names = (*plan.keys, *NUMBERS, REASON)
    with Part(out, plan, resume=resume) as part:
        texts = {begin: text for begin, text in part.done.items() if begin < plan.count}
        blocks = {begin: columns_of(names, text) for begin, text in texts.items()}
        for begin, columns in _work(plan, team, texts, progress):
            blocks[begin] = columns
            texts[begin] = text_of(columns)
            part.add(begin, len(columns[REASON]), texts[begin])
        order = sorted(texts)
        result = _gathered(plan, [blocks[begin] for begin in order])
        if form == "csv":
            write_csv(names, (texts[begin] for begin in order), out)
        else:
            write(result.columns, out, form)
    return result


def _work(
    plan: Plan,
    team: Crew,
    done: Mapping[int, object],
    progress: Callable[[float], None] | None,
) -> Iterator[tuple[int, Columns]]:
    """Yield where blocks begin, and their rows, but for those that are done."""
    size = _size(plan)
    begins = [begin for begin in range(0, plan.count, size) if begin not in done]
    paths = tuple(quantity.path for quantity in plan.quantities)

    def block(begin: int) -> Block:
        values = plan.values(begin, min(begin + size, plan.count))
        return Block(plan.document, plan.source, plan.keys, paths, values, plan.engine)

    over = plan.count - sum(min(size, plan.count - begin) for begin in begins)
    for begin, columns in team.results(swept, ((begin, block(begin)) for begin in begins)):
        over += len(columns[REASON])
        if progress is not None:
            progress(over / plan.count)
        values = plan.values(begin, begin + len(columns[REASON]))
        yield begin, {**dict(zip(plan.keys, values.T.copy(), strict=True)), **columns}


def _size(plan: Plan) -> int:
    """Return how many variants make a block; it depends on the plan only, so that it can resume."""
    stream, run = plan.document.get("stream", {}), plan.document.get("run", {})
    one = stream.get("count", 1) == 1 and "stream.count" not in plan.keys
    wanted = plan.engine or run.get("engine", "auto")
    if wanted in ("contact", "pymunk") or (stream.get("interact", False) and not one):
        return STEPPED
    plain = all(is_plain(quantity.path) for quantity in plan.quantities)
    return TOGETHER if one and plain else EXACT


def _gathered(plan: Plan, blocks: Sequence[Columns]) -> Sweep:
    return Sweep(
        title=plan.title,
        quantities=dict(zip(plan.keys, plan.quantities, strict=True)),
        columns=joined(blocks),
        shape=None if plan.samples is not None else tuple(len(v.values) for v in plan.varies),
        settled=plan.document.get("run", {}).get("until") == "settled",
    )
