"""The command ``chutelab``: its own options, and one place where errors become exit codes.

0: done. 1: something failed that is not the user's to mend, ``verify`` or ``stress`` found what
does not hold, or an accuracy was not reached.
2: what the user gave cannot be used. 130: interrupted with Ctrl-C.
"""

from __future__ import annotations

import io
import sys
from typing import Any

import click

from chutelab.util.errors import InputError, MissingLibraryError

INTERRUPTED = 130
"""128 + SIGINT, as shells have it."""


class RefusedError(click.ClickException):
    """What the user gave cannot be used."""

    exit_code = 2


class InOrder(click.Group):
    """A group of commands, listed in the order they were added."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands in the order of help."""
        return list(self.commands)


class Program(InOrder):
    """The commands of ``chutelab``, which never show a traceback."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the program; Ctrl-C between two commands' worth of code is Ctrl-C all the same."""
        try:
            return super().main(*args, **kwargs)
        except KeyboardInterrupt:
            raise SystemExit(INTERRUPTED) from None
        except SystemExit as end:
            if _was_interrupted(end.__context__):
                raise SystemExit(INTERRUPTED) from None
            raise

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; turn what goes wrong into a message and an exit code."""
        for stream in (sys.stdout, sys.stderr):
            # A title in Greek must not fail in a terminal that has no Greek.
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            click.echo("\nInterrupted.", err=True)
            ctx.exit(INTERRUPTED)
        except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
            raise
        except Exception as error:
            if _was_interrupted(error):
                click.echo("\nInterrupted.", err=True)
                ctx.exit(INTERRUPTED)
            if isinstance(error, (InputError, MissingLibraryError)):
                raise RefusedError(str(error)) from error
            if ctx.params["debug"]:
                raise
            said = str(error)
            if isinstance(error, MemoryError):
                said = f"not enough memory; fewer particles need less. ({error})"
            elif not isinstance(error, OSError):
                said = (
                    f"{type(error).__name__}: {' '.join(said.split()) or 'no message'}; please"
                    " report it, with what `chutelab --debug ...` prints for the same command"
                )
            click.echo(f"chutelab failed: {said}", err=True)
            ctx.exit(1)


def _was_interrupted(error: BaseException | None) -> bool:
    """Tell whether Ctrl-C is behind an error: compiled code may turn it into another one."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _version(ctx: click.Context, _parameter: click.Parameter, asked: bool) -> None:
    if asked and not ctx.resilient_parsing:
        import chutelab

        click.echo(f"chutelab {chutelab.__version__}")
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
def main(debug: bool) -> None:
    """Simulate a belt, a damping plate and a second belt, and account for every joule."""
    # `debug` is read where errors are caught, in `Program.invoke`.
    del debug
