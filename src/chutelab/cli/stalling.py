"""What becomes of a run that gets stuck: a message, exit code 1, and, if asked, its recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.recording import Recording

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
    from chutelab.recorder import StalledError

    try:
        return run(), None
    except StalledError as stalled:
        if keep and stalled.recording is not None:
            return stalled.recording, StuckError(f"{stalled}; what is written ends there")
        raise StuckError(f"{stalled}{'' if keep else ADVICE}") from stalled
