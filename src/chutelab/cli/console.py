"""The command ``chutelab`` itself, the output of all commands, and the handling of errors.

Text and JSON go to standard output, a progress bar, which appears after a second, to standard
error. Exit codes: 0: done. 1: chutelab failed, ``verify`` or ``stress`` found a broken promise, a
run broke a law, or an accuracy was not reached. 2: invalid input. 130: interrupted with Ctrl-C.
143: terminated. 129: the terminal was closed. 141: the reader of its output has gone, as `head`
does, which is no failure and gets no message. 143 and 129 leave no files behind; 130 leaves only
those of what ``run --out`` had recorded.
"""

from __future__ import annotations

import io
import json
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from threading import Timer
from typing import TYPE_CHECKING, Any

import click

from chutelab.util.errors import (
    InputError,
    LawWarning,
    MissingLibraryError,
    printable,
    printable_lines,
)
from chutelab.util.signals import INTERRUPTED, exit_code, raised

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.progress import Progress
    from rich.segment import Segment


UNREAD = 141
"""Exit code, as of tools that SIGPIPE (13) ends."""


class _Output(io.TextIOWrapper):
    """Standard output; its errors say "standard output", since it has no file name.

    If its reader has gone, what is still printed on the way out is dropped.
    """

    _unread = False

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
        except BrokenPipeError:
            if not self._unread:
                self._unread = True
                raise click.exceptions.Exit(UNREAD) from None
        except OSError as error:
            raise OSError(error.errno, error.strerror, "standard output") from None


class _Errors(io.TextIOWrapper):
    """Standard error. If it cannot be written, only the exit code shows that."""

    def write(self, text: str, /) -> int:
        with suppress(OSError):
            super().write(text)
        return len(text)

    def flush(self) -> None:
        with suppress(OSError):
            super().flush()


def open_streams() -> None:
    """Make the standard streams safe to write to, whatever they are.

    A closed stream becomes the null device; otherwise the next file that is opened would get its
    number, and all output. Characters that the terminal's encoding lacks are replaced.
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

    All text is printed here or by `show`.
    """
    click.echo(f"{printable_lines(text)}{end}", err=err, nl=False)


class _Shown:
    """What rich prints for an object, with control characters escaped except colours."""

    def __init__(self, part: RenderableType) -> None:
        self.part = part

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment]:
        from rich.segment import Segment

        for text, style, control in console.render(self.part, options):
            yield Segment(text if control else printable_lines(text), style, control)


def show(*parts: RenderableType) -> None:
    """Print tables and texts; in colour on a terminal, unless NO_COLOR is set."""
    from rich.console import Console

    console = Console(highlight=False, emoji=False)
    with console.capture() as capture:
        for part in parts:
            # Escaped characters take more room; lines are not cut for that.
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
"""s before a bar appears; shorter work does not need it, nor the import."""


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


class RefusedError(click.ClickException):
    """Invalid input; exit code 2."""

    exit_code = 2


ORDER = [
    "run", "live", "check", "show", "sweep", "solve", "compare", "discharge", "field", "report",
    "lesson", "figure", "tables", "scenes", "materials", "quantities", "new", "schema", "verify",
    "stress", "bench",
]  # fmt: skip
"""The commands as help lists them."""


class InOrder(click.Group):
    """A group of commands, listed in the order they were added."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands in the order of help."""
        return list(self.commands)


class Program(click.Group):
    """The commands of ``chutelab``, which never show a traceback."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands in the order of help."""
        return ORDER

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the program, and exit; errors become a message and an exit code.

        Without `standalone_mode` errors are raised, as in click.
        """
        asked, ends = {"debug": False}, kwargs.get("standalone_mode", True)
        kwargs |= {"obj": asked, "standalone_mode": False}
        broken: list[str] = []
        with raised(), warnings.catch_warnings():
            warnings.simplefilter("always", LawWarning)
            others = warnings.showwarning

            def noted(message: Any, category: Any, *at: Any, **more: Any) -> None:
                if issubclass(category, LawWarning):
                    say(str(message), err=True)
                    broken.append(str(message))
                else:
                    others(message, category, *at, **more)

            warnings.showwarning = noted
            try:
                open_streams()
                code = super().main(*args, **kwargs) or int(bool(broken))
            except (KeyboardInterrupt, Exception) as error:
                if not ends:
                    raise
                if asked["debug"] and not isinstance(error, EXPECTED) and not exit_code(error):
                    raise
                code = _told(error)
            if ends:
                sys.exit(code or 0)
            return code


EXPECTED = (click.ClickException, InputError, MissingLibraryError)
"""Errors shown without a traceback even with ``--debug``."""


def _told(error: BaseException) -> int:
    """Print an error on standard error; return the exit code."""
    if code := exit_code(error):
        say("Interrupted." if code == INTERRUPTED else "Terminated.", err=True)
        return code
    if isinstance(error, (InputError, MissingLibraryError)):
        error = RefusedError(str(error))
    if isinstance(error, click.ClickException):
        text = io.StringIO()
        error.show(text)
        say(text.getvalue(), err=True, end="")
        return error.exit_code
    said = str(error)
    if isinstance(error, MemoryError):
        said = f"not enough memory; fewer particles need less. ({error})"
    elif isinstance(error, OSError):
        said = ": ".join(filter(None, (error.filename, error.strerror))) or said
    else:
        said = (
            f"{type(error).__name__}: {' '.join(said.split()) or 'no message'}; please"
            " report it, with what `chutelab --debug ...` prints for the same command"
        )
    say(f"chutelab failed: {said}", err=True)
    return 1


def _version(ctx: click.Context, _parameter: click.Parameter, asked: bool) -> None:
    if asked and not ctx.resilient_parsing:
        import chutelab

        say(f"chutelab {chutelab.__version__}")
        ctx.exit()


@click.group(
    cls=Program,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="A first run: chutelab run perpendicular --out out",
)
@click.option(
    "--debug", is_flag=True, envvar="CHUTELAB_DEBUG", help="Show the traceback of a failure."
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_version,
    help="Show the version and exit.",
)
@click.pass_obj
def main(asked: dict[str, bool], debug: bool) -> None:
    """Simulate a belt, a damping plate and a second belt, and account for every joule."""
    # `Program.main` reads it when it catches an error.
    asked["debug"] = debug
