"""Who does the work: this process, processes of this computer, or a Dask cluster.

All are executors in the sense of `concurrent.futures`, so that there is one way through.
"""

from __future__ import annotations

import multiprocessing
import os
import re
import signal
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    Job = tuple[int, Any]

ATTEMPTS: Final = 3
"""Times in a row that all processes may die without finishing anything."""

PATIENCE: Final = 10.0
"""s that a scheduler may take to answer."""


ADDRESS: Final = re.compile(r"(\w+://)?[^\s:/]+:\d{1,5}")
"""A host and a port."""


class WorkersError(ValueError):
    """Nobody is there to do the work; the text says what is wrong with what was asked for."""


class LostWorkersError(RuntimeError):
    """Those who did the work are gone; the text says what to do."""


class Here(Executor):
    """Does at once what is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call a function; what it raises is raised here."""
        done: Future[Any] = Future()
        done.set_result(fn(*args, **kwargs))
        return done


class Crew:
    """An executor, how many jobs it is to have at a time, and how to get a new one if it breaks."""

    def __init__(self, executor: Executor, ahead: int, anew: Callable[[], Executor] | None) -> None:
        self.executor, self.ahead, self.anew = executor, ahead, anew

    def results(self, work: Callable[[Any], Any], jobs: Iterable[Job]) -> Iterator[tuple[int, Any]]:
        """Yield a number and what came of it for each job, as they are finished.

        Raises
        ------
        LostWorkersError
            If processes keep dying, or a cluster is gone.
        """
        left, broken = iter(jobs), 0
        running: dict[Future[Any], Job] = {}
        again: list[Job] = []
        while True:
            while len(running) < self.ahead:
                job = again.pop() if again else next(left, None)
                if job is None:
                    break
                try:
                    running[self.executor.submit(work, job[1])] = job
                except BrokenExecutor:
                    again.append(job)
                    break
            if not running and not again:
                return
            finished = wait(running, return_when=FIRST_COMPLETED).done if running else set()
            died = not finished
            for future in finished:
                job = running.pop(future)
                try:
                    result = future.result()
                except BrokenExecutor:
                    again.append(job)
                    died = True
                else:
                    broken = 0
                    yield job[0], result
            if died:
                broken += 1
                again += running.values()
                running.clear()
                self._renew(broken)

    def _renew(self, broken: int) -> None:
        if self.anew is None or broken > ATTEMPTS:
            raise LostWorkersError(
                "the worker processes keep dying, perhaps for want of memory: try fewer with --jobs"
            )
        self.executor.shutdown(wait=False)
        self.executor = self.anew()


@contextmanager
def crew(jobs: int = 1, scheduler: str | None = None) -> Iterator[Crew]:
    """Give those who do the work.

    Parameters
    ----------
    jobs : int
        Processes; 1 is this one. 0 is one for each processor.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``.

    Raises
    ------
    WorkersError
        If Dask is not installed, no scheduler answers, or it has no workers.
    """
    if scheduler is not None:
        yield from _cluster(scheduler)
        return
    count = jobs or os.cpu_count() or 1
    if count == 1:
        yield Crew(Here(), 1, None)
        return

    def processes() -> Executor:
        # Not forked: there may be threads.
        spawning = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(count, mp_context=spawning, initializer=_ignore_interrupts)

    others = {child.pid for child in multiprocessing.active_children()}
    team = Crew(processes(), 2 * count, processes)
    try:
        yield team
    except BaseException:
        team.executor.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            if child.pid not in others:
                child.terminate()
        raise
    team.executor.shutdown()


def _ignore_interrupts() -> None:
    # Ctrl-C goes to all processes of a terminal; the first one tells the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _cluster(address: str) -> Iterator[Crew]:
    try:
        from distributed import Client, KilledWorker
    except ImportError:
        raise WorkersError('--scheduler needs Dask: pip install "chutelab[cluster]"') from None
    if not ADDRESS.fullmatch(address):
        raise WorkersError(f"--scheduler {address}: must be like tcp://10.0.0.1:8786")
    connect: Any = Client
    try:
        client = connect(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise WorkersError(f"--scheduler {address}: no Dask scheduler answers: {error}") from error
    with client:
        threads = sum(client.nthreads().values())
        if not threads:
            raise WorkersError(f"--scheduler {address}: it has no workers; start some with `dask`")
        try:
            with client.get_executor(pure=False) as executor:
                yield Crew(executor, 2 * threads, None)
        except (KilledWorker, CancelledError) as error:
            raise LostWorkersError(
                f"--scheduler {address}: the workers or the scheduler are gone: {error}"
            ) from error
