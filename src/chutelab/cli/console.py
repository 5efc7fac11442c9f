"""What commands print: text and JSON on standard output, a progress bar on standard error.

The bar appears after a second.
"""

from __future__ import annotations

import io
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from threading import Timer
from typing import TYPE_CHECKING, Any

import click

from chutelab.util.errors import printable, printable_lines

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.progress import Progress
    from rich.segment import Segment


class _Output(io.TextIOWrapper):
    """Standard output; its errors say "standard output", since it has no file name."""

    def write(self, text: str, /) -> int:
        with self._named():
            return super().write(text)

    def flush(self) -> None:
        with self._named():
            super().flush()

    @contextmanager
    def _named(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise OSError(error.errno, error.strerror, "standard output") from None


class _Errors(io.TextIOWrapper):
    """Standard error. If it cannot be written there is nowhere to say so: the exit code is left."""

    def write(self, text: str, /) -> int:
        with suppress(OSError):
            super().write(text)
        return len(text)

    def flush(self) -> None:
        with suppress(OSError):
            super().flush()


def open_streams() -> None:
    """Make the standard streams safe to write to, whatever they are.

    One that is closed becomes the null device: else the next file that is opened gets its number,
    and what others print. A title in Greek does not fail in a terminal that has no Greek.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        stream = getattr(sys, name)
        if stream is None:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            os.set_inheritable(number, True)
            setattr(sys, name, os.fdopen(number, "w" if number else "r", encoding="utf-8"))
        elif number and isinstance(stream, io.TextIOWrapper):
            if stream is not getattr(sys, f"__{name}__"):
                stream.reconfigure(errors="replace")
                continue
            kind = _Output if name == "stdout" else _Errors
            with_its = {"encoding": stream.encoding, "line_buffering": stream.line_buffering}
            setattr(sys, name, kind(stream.buffer, errors="replace", **with_its))


def say(text: str, *, err: bool = False, end: str = "\n") -> None:
    """Print a text; control characters in titles and names are escaped.

    All text goes through here, or through `show`.
    """
    click.echo(f"{printable_lines(text)}{end}", err=err, nl=False)


class _Shown:
    """What rich prints of something, with control characters escaped, colours aside."""

    def __init__(self, part: RenderableType) -> None:
        self.part = part

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment]:
        from rich.segment import Segment

        for text, style, control in console.render(self.part, options):
            yield Segment(text if control else printable_lines(text), style, control)


def show(*parts: RenderableType) -> None:
    """Print tables and texts; in colour on a terminal, unless NO_COLOR is set."""
    from rich.console import Console

    console = Console(highlight=False)
    with console.capture() as capture:
        for part in parts:
            # Escaped characters take more room: lines are not cut for that.
            console.print(_Shown(part), crop=False)
    # click flushes, and handles a closed pipe.
    click.echo(capture.get().removeprefix("\n"), nl=False)


def show_json(value: Any) -> None:
    """Print one JSON object, see `chutelab.util.tables.plain`."""
    from chutelab.util.tables import plain

    click.echo(json.dumps(plain(value), allow_nan=False))


def tell(
    told: Mapping[str, Any],
    *parts: RenderableType,
    as_json: bool,
    quiet: bool = False,
    wrote: str = "",
) -> None:
    """Print a command's answer: one JSON object, or tables and texts and what was written."""
    if as_json:
        show_json({"format": 1, **told})
    elif not quiet:
        show(*parts)
        if wrote:
            say(wrote)


PATIENCE = 1.0
"""s before a bar appears: shorter work needs none, nor the time its import takes."""


@contextmanager
def progress(
    what: str, *, quiet: bool = False, left: bool = False
) -> Iterator[Callable[[float], None] | None]:
    """Give a callable that takes the share of the task that is done; None if nothing is shown.

    With `left`, the bar also tells how long it may still take.
    """
    if quiet or not sys.stderr.isatty():
        yield None
        return
    done: float | None = None
    bars: list[Progress] = []  # the bar, once it is there

    def update(share: float) -> None:
        nonlocal done
        done = share
        for bar in bars:
            bar.update(bar.task_ids[0], completed=share, total=1.0)

    def appear() -> None:
        from rich import progress as rich
        from rich.console import Console

        bar = rich.Progress(
            rich.TextColumn("{task.description}", markup=False),
            rich.BarColumn(),
            rich.TimeElapsedColumn(),
            *([rich.TextColumn("left:"), rich.TimeRemainingColumn()] if left else []),
            console=Console(stderr=True),
            transient=True,
        )
        # Without a total the bar pulses.
        bar.add_task(printable(what), total=None)
        bar.start()
        bars.append(bar)
        if done is not None:
            update(done)

    timer = Timer(PATIENCE, appear)
    timer.daemon = True
    timer.start()
    try:
        yield update
    finally:
        timer.cancel()
        timer.join()
        for bar in bars:
            bar.stop()
