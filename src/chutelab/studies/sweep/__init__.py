"""Many variants of one scene: grids and samples, a row for each.

>>> import chutelab
>>> from chutelab.studies.sweep import sweep
>>> varied = {"incoming.speed": [2.0, 4.0], "plate.restitution": [0.0, 1.0]}
>>> swept = sweep(chutelab.load("perpendicular"), varied)
>>> len(swept), swept.columns["landing.vx.mean"].round(3).tolist()
(4, [0.0, -2.0, 0.0, -4.0])

`sweep` runs variants here, in other processes, or on a Dask cluster, and collects the results.
SciPy, pyarrow, Dask and pandas are imported when needed.

- `plan`: checks what is to be varied before anything runs; runs blocks of variants.
- `rows`: the columns of a row, computed from a recording; `Sweep`, and CSV and Parquet files.
- `part`: the file with the finished rows of an unfinished sweep.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import re
import signal
import sys
from collections.abc import Callable, Container, Generator, Iterable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from itertools import chain, islice
from pathlib import Path
from threading import Event, Thread
from types import ModuleType
from typing import Any, Final

from chutelab.scene import AnyScene
from chutelab.scene.quantities import COLUMNS
from chutelab.scene.variants import Varied
from chutelab.studies.sweep.part import unfinished
from chutelab.studies.sweep.plan import DESIGNS, MOST_VARIANTS, Plan, planned, row_of, swept
from chutelab.studies.sweep.rows import (
    REASON,
    TEXTS,
    TOUCHES,
    Columns,
    Sweep,
    format_of,
    joined,
    no_column,
    synced,
    write,
    write_csv,
)
from chutelab.util.arrays import Progress
from chutelab.util.errors import InputError, library
from chutelab.util.files import own_version, writing

__all__ = [
    "COLUMNS", "DESIGNS", "MOST_VARIANTS", "REASON", "TEXTS", "TOUCHES", "Crew",
    "LostWorkersError", "Plan", "Sweep", "crew", "no_column", "planned", "row_of", "sweep",
    "sweep_to", "swept_by",
]  # fmt: skip

Job = tuple[int, Any]

ATTEMPTS: Final = 3
"""How often in a row all processes may die without finishing a job."""

PATIENCE: Final = 10.0
"""s that a scheduler may take to answer."""


LETS_GO: Final = 1.0
"""Most s that a pool may take to cancel jobs that have not begun."""

ADDRESS: Final = re.compile(r"(\w+://)?[^\s:/]+:\d{1,5}")
"""A host and a port."""


class LostWorkersError(RuntimeError):
    """All workers are lost; the text says what to do."""


class Crew:
    """An executor, how many jobs it has at a time, and how to get a new one if it breaks.

    `alive` is called while no result comes; it raises an error if none can come any more. Without
    an executor this process does the work.

    `concurrent.futures` does the work. What it lacks: `Executor.map` takes all jobs at once (2.3 kB
    each, and there may be a million) and gives results in their order only, so that a slow run
    would hold back the file of finished rows; and a process that dies breaks the pool with all its
    jobs. In joblib (1.6) it breaks them too; Dask copes, but installs 15 packages of 41 MB.
    """

    def __init__(
        self,
        executor: Executor | None = None,
        ahead: int = 1,
        anew: Callable[[], Executor] | None = None,
        alive: Callable[[], None] | None = None,
    ) -> None:
        self.executor, self.ahead, self.anew, self.alive = executor, ahead, anew, alive

    def results(
        self, work: Callable[[Any], Any], jobs: Iterable[Job]
    ) -> Generator[tuple[int, Any], None, None]:
        """Yield the number and result of each job, as they are finished.

        A `LostWorkersError` if processes keep dying, or a cluster is lost.
        """
        if self.executor is None:
            yield from ((number, work(job)) for number, job in jobs)
            return
        running: dict[Future[Any], int] = {}
        try:
            yield from self._results(work, jobs, running)
        finally:
            for future in running:  # The caller wants no more.
                future.cancel()

    def _results(
        self, work: Callable[[Any], Any], jobs: Iterable[Job], running: dict[Future[Any], int]
    ) -> Iterator[tuple[int, Any]]:
        """Yield the finished jobs of the executor's processes; `running` has the others."""
        assert self.executor is not None
        left, deaths = iter(jobs), 0
        given: dict[int, Any] = {}  # jobs that are not done, by number
        while True:
            try:
                for number, job in islice(left, self.ahead - len(running)):
                    given[number] = job
                    with _without_ctrl_c():
                        running[self.executor.submit(work, job)] = number
                if not running:
                    return
                finished = wait(running, PATIENCE, FIRST_COMPLETED).done
                if not finished and self.alive is not None:
                    self.alive()
                for future in finished:
                    result = future.result()
                    deaths = 0
                    del given[running[future]]
                    yield running.pop(future), result
            except BrokenExecutor:
                deaths += 1
                if self.anew is None or deaths > ATTEMPTS:
                    raise LostWorkersError(
                        "the worker processes keep dying, perhaps for want of memory: try fewer"
                        " with --jobs"
                    ) from None
                self.executor.shutdown(wait=False)
                self.executor = self.anew()
                left, given = chain(list(given.items()), left), {}
                running.clear()


@contextmanager
def crew(jobs: int = 1, scheduler: str | None = None) -> Iterator[Crew]:
    """Give the workers.

    Parameters
    ----------
    jobs : int
        Processes; 1 is this one. 0 is one for each processor.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``.

    Raises
    ------
    InputError
        If Dask is not installed, no scheduler answers, or it has no workers.
    """
    if scheduler is not None:
        yield from _cluster(scheduler)
        return
    count = jobs or os.cpu_count() or 1
    if count == 1:
        yield Crew()
        return
    # Not forked: there may be threads.
    processes = partial(
        ProcessPoolExecutor,
        count,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_serve,
    )
    others = {child.pid for child in multiprocessing.active_children()}
    team = Crew(processes(), 2 * count, processes)
    try:
        yield team
    except BaseException:
        if team.executor is not None:
            # Cancel jobs first: the pool's thread fails at a job that is cancelled when its process
            # dies.
            gone = Event()
            with suppress(RuntimeError), _without_ctrl_c():
                team.executor.submit(int).add_done_callback(lambda _: gone.set())
            team.executor.shutdown(wait=False, cancel_futures=True)
            gone.wait(LETS_GO)
        for child in multiprocessing.active_children():
            if child.pid not in others:
                child.terminate()
        raise
    if team.executor is not None:
        team.executor.shutdown()


@contextmanager
def _without_ctrl_c() -> Iterator[None]:
    """Delay Ctrl-C; processes that begin meanwhile never get it, not even while they import.

    A terminal sends it to all of its processes; here the first one ends the others.
    """
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve() -> None:
    """Prepare a worker process: it ends when its parent tells it to, or has died."""

    def follow() -> None:
        if (parent := multiprocessing.parent_process()) is not None:
            parent.join()
            os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    Thread(target=follow, daemon=True).start()


def _cluster(address: str) -> Iterator[Crew]:
    dask = library("distributed", "--scheduler needs Dask", "cluster")
    if not ADDRESS.fullmatch(address):
        raise InputError(f"--scheduler {address}: must be like tcp://10.0.0.1:8786")
    _ask(dask, address)
    client = dask.Client(address, timeout=PATIENCE, set_as_default=False)

    def alive() -> None:
        client.sync(client.scheduler.identity, callback_timeout=PATIENCE)
        client.wait_for_workers(1, timeout=PATIENCE)

    try:
        threads = sum(client.nthreads().values())
        if threads:
            _check_same_version(client, address)
            yield Crew(client.get_executor(pure=False), 2 * threads, alive=alive)
    except Exception as error:
        gone = isinstance(error, (dask.KilledWorker, CancelledError, TimeoutError))
        if client.status == "running" and not gone:
            raise
        raise LostWorkersError(
            f"--scheduler {address}: the workers or the scheduler are gone"
            f" ({' '.join(str(error).split()) or type(error).__name__})"
        ) from error
    finally:
        # Jobs that are not done are dropped with it.
        with suppress(Exception):
            client.close(PATIENCE)
    if not threads:
        raise InputError(f"--scheduler {address}: it has no workers; start some with `dask`")


def _check_same_version(client: Any, address: str) -> None:
    """Refuse workers with another version of chutelab, whose rows could differ.

    A worker that does not report its version has no chutelab, or one too old for that.
    """
    own = own_version()
    others = {
        worker: said if isinstance(said, str) else "no chutelab that could be asked"
        for worker, said in client.run(own_version, on_error="return").items()
        if said != own
    }
    if others:
        worker, said = next(iter(sorted(others.items())))
        count = f"{len(others)} of its workers, such as {worker}," if len(others) > 1 else worker
        verb = "have" if len(others) > 1 else "has"
        raise InputError(
            f"--scheduler {address}: {count} {verb} chutelab {said}, and here is {own}: install"
            " the same on all"
        )


def _ask(dask: ModuleType, address: str) -> None:
    """Refuse an address at which no Dask scheduler answers in time.

    A client waits for ever for a server that accepts a connection and sends nothing, and prints a
    traceback of other faults after 20 s. The thread that asks stops in time too: as long as it
    tries again, Dask draws its pauses from `random`, and so changes the caller's random numbers.
    """
    found: str | Exception = TimeoutError(f"nothing in {PATIENCE:g} s")

    async def ask() -> str:
        security = dask.Security().get_connection_args("client")
        async with (
            asyncio.timeout(PATIENCE),
            dask.rpc(address, connection_args=security) as scheduler,
        ):
            return str((await scheduler.identity())["type"])

    def run() -> None:
        nonlocal found
        try:
            found = asyncio.run(ask())
        except TimeoutError:
            pass
        except Exception as error:
            found = error

    asking = Thread(target=run, daemon=True)
    asking.start()
    asking.join(PATIENCE + 1.0)
    if found != "Scheduler":
        said = " ".join(f"{found}".split()) or type(found).__name__
        raise InputError(f"--scheduler {address}: no Dask scheduler answers: {said}")


AHEAD: Final = 64
"""Blocks that an executor of the caller's has at a time."""


def sweep(
    scene: AnyScene,
    varies: Varied,
    *,
    sample: int | None = None,
    design: str = "lhs",
    seed: int = 0,
    engine: str | None = None,
    repeat: int = 1,
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """Simulate many variants of a scene.

    Variants of one particle that differ in plain numbers go through the exact engine together;
    every row agrees with `chutelab.simulate` of its variant to 1e-12, relative.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        What `chutelab.load` takes.
    varies : mapping, or sequence of Vary
        Values by key; a grid of all combinations, whose last key runs fastest. With `sample`, the
        two ends of a range by key.
    sample : int, optional
        Draw so many samples from the ranges instead of a grid; needs SciPy.
    design, seed : {"lhs", "sobol"}, int
        Latin hypercube or Sobol points, and the seed.
    engine : {"auto", "exact", "contact", "pymunk"}, optional
        Overrides the scene's ``run.engine``.
    repeat : int
        Run each variant with so many seeds, the same for all: columns are means then, and
        ``NAME.error`` is the standard error of each.
    jobs : int
        Processes to spread the work over; 0 is one for each processor.
    executor : concurrent.futures.Executor, optional
        Runs the work instead, such as that of a Dask client.
    progress : callable, optional
        Called now and then with the share that is done, 0 to 1.

    Returns
    -------
    Sweep
        With a row for impossible variants and misses, too, with the reason.

    Raises
    ------
    InputError
        If the variants are invalid; before anything runs.

    Examples
    --------
    >>> swept = sweep("perpendicular", {"plate.restitution": [0.0, 0.5, 1.0]})
    >>> swept.columns["landing.vx.mean"]
    array([ 0., -1., -2.])
    """
    plan = planned(
        scene, varies, sample=sample, design=design, seed=seed, engine=engine,
        repeat=repeat,
    )  # fmt: skip
    with ExitStack() as stack:
        team = Crew(executor, AHEAD) if executor else stack.enter_context(crew(jobs))
        return swept_by(plan, team, progress=progress)


def swept_by(plan: Plan, team: Crew, *, progress: Progress | None = None) -> Sweep:
    """Carry a plan out; see `sweep_to`."""
    found = dict(_work(plan, team, (), progress))
    return _gathered(plan, [found[begin] for begin in sorted(found)])


def sweep_to(
    plan: Plan,
    out: str | Path,
    team: Crew,
    *,
    resume: bool = False,
    progress: Progress | None = None,
) -> Sweep:
    """Carry a plan out and write its rows to a .csv or .parquet file, whole or not at all.

    Finished rows are kept beside it meanwhile, see `sweep.part`; with `resume` an interrupted
    sweep, if there is one, goes on from there, and writes the same file as one that was not.

    Raises
    ------
    InputError
        If the file is of no known format, a folder or cannot be written, or there are rows that
        this sweep cannot go on with.
    """
    out, form = Path(out), format_of(out)
    with unfinished(out, plan, resume=resume) as part:
        for begin, columns in _work(plan, team, part.done, progress):
            with writing(out):
                part.add(begin, columns)
        texts, blocks = zip(*(part.done[begin] for begin in plan.begins), strict=True)
        result = _gathered(plan, blocks)
        with writing(out):
            if form == "csv":
                write_csv(plan.columns, texts, out)
            else:
                write(result.columns, out, form)
            synced(out)
    return result


def _work(
    plan: Plan, team: Crew, done: Container[int], progress: Progress | None
) -> Iterator[tuple[int, Columns]]:
    """Yield the beginnings of blocks and their rows, without finished ones."""
    size = plan.begins.step
    begins = [begin for begin in plan.begins if begin not in done]
    jobs = ((begin, plan.block(begin, begin + size)) for begin in begins)
    over = plan.count - sum(min(size, plan.count - begin) for begin in begins)
    for begin, columns in team.results(swept, jobs):
        over += len(columns[REASON])
        if progress is not None:
            progress(over / plan.count)
        varied = plan.block(begin, begin + size).values.T.copy()
        yield begin, {**dict(zip(plan.keys, varied, strict=True)), **columns}


def _gathered(plan: Plan, blocks: Sequence[Columns]) -> Sweep:
    return Sweep(
        title=plan.scene.title,
        quantities=dict(zip(plan.keys, plan.quantities, strict=True)),
        columns=joined(blocks),
        shape=None if plan.samples is not None else tuple(len(v.values) for v in plan.varies),
        until=plan.scene.run.until,
        repeat=plan.repeat,
    )
