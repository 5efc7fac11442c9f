"""What commands print: text and JSON, a progress bar, and what becomes of a run that gets stuck.

The bar is on standard error, for people who wait longer than a second. A run that gets stuck ends
with a message, exit code 1 and, if asked for, its recording.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.progress import Progress

    from chutelab.results import Recording


def show(*parts: RenderableType) -> None:
    """Print tables and texts; in colour on a terminal, unless NO_COLOR is set."""
    from rich.console import Console

    console = Console(highlight=False)
    with console.capture() as capture:
        for part in parts:
            console.print(part)
    # Through click: it flushes, and knows what to do when the reader has gone.
    click.echo(capture.get().removeprefix("\n"), nl=False)


def show_json(value: Any) -> None:
    """Print one JSON object, see `chutelab.util.tables.plain`."""
    from chutelab.util.tables import plain

    click.echo(json.dumps(plain(value), allow_nan=False))


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


ADVICE = "; add --out DIR --partial to keep what was recorded until then"

partial_option = click.option(
    "--partial",
    is_flag=True,
    help="With --out: if the run gets stuck, write what was recorded until then.",
)


class StuckError(click.ClickException):
    """A run got stuck; it is not the user's to mend."""

    exit_code = 1


def salvaged(run: Callable[[], Recording], *, keep: bool) -> tuple[Recording, StuckError | None]:
    """Run; if it gets stuck, return what was recorded and the error to end with.

    Parameters
    ----------
    run : callable
        Makes the recording.
    keep : bool
        Whether the recording so far is wanted; if not, the error is raised.

    Raises
    ------
    StuckError
        If the run gets stuck and nothing is to be kept, or nothing was recorded.
    """
    from chutelab.results.recorder import StalledError

    try:
        return run(), None
    except StalledError as stalled:
        if keep and stalled.recording is not None:
            return stalled.recording, StuckError(f"{stalled}; what is written ends there")
        raise StuckError(f"{stalled}{'' if keep else ADVICE}") from stalled
