"""A bound on the wall time of a run, whatever the run does."""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager
from time import perf_counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType


class OverdueError(RuntimeError):
    """A run took longer than it may."""


@contextmanager
def bounded(seconds: float) -> Iterator[Callable[[float], None]]:
    """Give a progress callback that raises `OverdueError` when the time is up.

    An engine that has stopped to report progress is ended too, by an alarm of the operating system;
    where there is none (Windows, another thread than the main one) the callback alone has to do.

    Parameters
    ----------
    seconds : float
        Wall time, s.
    """
    end = perf_counter() + seconds

    def overdue() -> OverdueError:
        return OverdueError(f"not done after {seconds:g} s of wall time")

    def report(_share: float) -> None:
        if perf_counter() > end:
            raise overdue()

    def ring(_number: int, _frame: FrameType | None) -> None:
        raise overdue()

    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGALRM"):
        yield report
        return
    before = signal.signal(signal.SIGALRM, ring)
    # Later than the callback's own time, which tells more about where the engine was; and again,
    # because what is raised in a callback from C is lost.
    signal.setitimer(signal.ITIMER_REAL, 1.1 * seconds + 0.1, 0.1)
    try:
        yield report
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
