"""``show``: what a saved recording holds, and its pictures once more."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from chutelab.cli.parameters import KINDS, chosen, output_options
from chutelab.cli.program import RefusedError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chutelab.accuracy import Accuracy
    from chutelab.recording import Recording


@click.command(short_help="Print the summary of a recording.npz; make its files again.")
@click.argument("recording", type=click.Path(path_type=Path))
@output_options
def show(
    recording: Path,
    out: Path | None,
    only: tuple[str, ...] | None,
    film: str | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Print the summary of RECORDING, a recording.npz; with --out make its files again."""
    from chutelab.cli.output import destination, files_of, write
    from chutelab.recording import Recording
    from chutelab.storage import RecordingError

    kinds = chosen(out, only, film)
    try:
        loaded = Recording.load(recording)
    except RecordingError as error:
        raise RefusedError(f"{error}{_advice(recording)}") from error
    with destination(out, files_of(kinds)) as folder:
        if folder is not None:
            write(loaded, folder, kinds, quiet=quiet)
    tell(loaded, out, kinds, as_json=as_json, quiet=quiet)


def _advice(given: Path) -> str:
    """Say what was probably meant by what is no recording."""
    from chutelab.scene import shipped

    inside = given / KINDS["npz"][0]
    if inside.is_file():
        return f"; did you mean {inside}?"
    if given.suffix == ".toml" or str(given) in shipped():
        return f"; show takes a recording.npz; for a scene: chutelab run {given}"
    return ""


def tell(
    recording: Recording,
    out: Path | None,
    kinds: Sequence[str],
    *,
    as_json: bool,
    quiet: bool,
    accuracy: Accuracy | None = None,
) -> None:
    """Print a recording's summary and what was written, as JSON or as tables."""
    from chutelab.cli import console

    if as_json:
        from chutelab.summary import summary

        console.show_json(summary(recording, accuracy))
    elif not quiet:
        from chutelab.cli.report import report

        console.show(*report(recording, accuracy))
        if out is not None:
            names = ", ".join(name for kind in kinds for name in KINDS[kind])
            click.echo(f"wrote into {out}: {names}")
