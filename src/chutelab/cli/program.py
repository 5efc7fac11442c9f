"""The command ``chutelab``: its own options, and one place where errors become exit codes.

0: done. 1: something failed that is not the user's to mend, ``verify`` or ``stress`` found what
does not hold, a run broke a law, or an accuracy was not reached.
2: what the user gave cannot be used. 130: interrupted with Ctrl-C. 143: terminated.
129: the terminal was closed. 143 and 129 leave nothing behind, and so does 130, but for what a
``run --out`` had recorded.
"""

from __future__ import annotations

import io
import sys
import warnings
from functools import partial
from typing import Any

import click

from chutelab.cli.console import open_streams, say
from chutelab.util.errors import InputError, LawWarning, MissingLibraryError
from chutelab.util.signals import INTERRUPTED, exit_code, raised


class RefusedError(click.ClickException):
    """Invalid input; exit code 2."""

    exit_code = 2


ORDER = [
    "run", "live", "check", "show", "sweep", "solve", "compare", "lesson", "figure", "tables",
    "scenes", "materials", "quantities", "new", "schema", "verify", "stress", "bench",
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
        """Run the program, and exit; what goes wrong becomes a message and an exit code.

        Without `standalone_mode` neither, as in click.
        """
        asked, ends = {"debug": False}, kwargs.get("standalone_mode", True)
        kwargs |= {"obj": asked, "standalone_mode": False}
        broken: list[str] = []
        with raised(), warnings.catch_warnings():
            warnings.simplefilter("always", LawWarning)
            warnings.showwarning = partial(_noted, broken, warnings.showwarning)
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


def _noted(
    broken: list[str], show: Any, message: Warning | str, category: type[Warning], *where: Any
) -> None:
    """Print a broken law on standard error and note it; show other warnings as usual."""
    if issubclass(category, LawWarning):
        say(str(message), err=True)
        broken.append(str(message))
    else:
        show(message, category, *where)


EXPECTED = (click.ClickException, InputError, MissingLibraryError)
"""Errors that ``--debug`` shows without a traceback, too."""


def _told(error: BaseException) -> int:
    """Say on standard error what went wrong; return the exit code."""
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
