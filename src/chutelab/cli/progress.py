"""A progress bar on standard error, for people who wait longer than a second."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from threading import Timer
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rich.progress import Progress

PATIENCE = 1.0
"""s without a bar: what is over sooner needs none, and should not wait for its import."""


class Meter:
    """A task that may take long: `update` it with the share that is done, 0 to 1.

    With `left`, the bar also tells how long it may still take.
    """

    def __init__(self, what: str, *, left: bool = False) -> None:
        self.what, self.left = what, left
        self.share: float | None = None
        self.bar: Progress | None = None

    def update(self, share: float) -> None:
        """Say how much is done."""
        self.share = share
        if self.bar is not None:
            self.bar.update(self.bar.task_ids[0], completed=share, total=1.0)

    def appear(self) -> None:
        """Start drawing."""
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TimeElapsedColumn(),
            *([TextColumn("left:"), TimeRemainingColumn()] if self.left else []),
            console=Console(stderr=True),
            transient=True,
        )
        # Without a total it pulses: nobody has said yet how far it is.
        bar.add_task(self.what, total=None)
        bar.start()
        self.bar = bar
        if self.share is not None:
            self.update(self.share)


@contextmanager
def progress(
    what: str, *, quiet: bool = False, left: bool = False
) -> Iterator[Callable[[float], None] | None]:
    """Give a callable that takes the share of the task that is done; None if nobody looks."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    meter = Meter(what, left=left)
    timer = Timer(PATIENCE, meter.appear)
    timer.daemon = True
    timer.start()
    try:
        yield meter.update
    finally:
        timer.cancel()
        timer.join()
        if meter.bar is not None:
            meter.bar.stop()
