"""``run``: from a scene to a summary and its files."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from chutelab.cli.parameters import (
    chosen,
    complete_scene,
    output_options,
    retitled,
    set_option,
)
from chutelab.cli.recordings import tell
from chutelab.cli.stalling import partial_option, salvaged

if TYPE_CHECKING:
    from pathlib import Path

    from chutelab.accuracy import Accuracy, Wanted
    from chutelab.recording import Recording


class MissedError(click.ClickException):
    """The accuracy that was asked for could not be reached."""

    exit_code = 1

    def __init__(self, asked: Wanted, reached: Accuracy) -> None:
        best = "how much was, cannot be told"
        if reached.reached is not None:
            best = f"{asked.written(reached.reached)} was"
        super().__init__(f"the accuracy of {asked} was not reached; {best}")


def _accuracy(_ctx: click.Context, _parameter: click.Parameter, text: str | None) -> Wanted | None:
    if text is None:
        return None
    from chutelab.accuracy import AccuracyError, parse

    try:
        return parse(text)
    except AccuracyError as error:
        raise click.BadParameter(str(error)) from error


@click.command(short_help="Simulate a scene and print a summary; write its files.")
@click.argument("scene", shell_complete=complete_scene)
@click.option(
    "--engine",
    type=click.Choice(["auto", "exact", "contact", "pymunk"]),
    help="Same as --set run.engine=...",
)
@click.option("--dt", metavar="S", type=float, help="Same as --set run.dt=S.")
@click.option(
    "--accuracy",
    metavar="A",
    callback=_accuracy,
    help="Choose engine and step so that errors are at most this: relative, such as 1e-6, or a"
    " length, such as 1mm; say what was reached.",
)
@set_option
@output_options
@partial_option
def run(
    scene: str,
    engine: str | None,
    dt: float | None,
    accuracy: Wanted | None,
    overrides: tuple[str, ...],
    out: Path | None,
    only: tuple[str, ...] | None,
    film: str | None,
    as_json: bool,
    quiet: bool,
    partial: bool,
) -> None:
    """Simulate SCENE, a scene file or the name of a shipped one, and print a summary.

    Without --out nothing is written. With --accuracy, --engine is kept to and --dt is the longest
    step that is tried; if the accuracy cannot be reached, everything is printed and written all
    the same, and the exit code is 1.
    """
    from chutelab.cli.output import destination, files_of, write
    from chutelab.cli.progress import progress
    from chutelab.scene import load
    from chutelab.scene.overrides import Setting
    from chutelab.simulation import simulate

    kinds = chosen(out, only, film)
    if partial and out is None:
        raise click.UsageError("--partial keeps files of --out DIR: give --out too.")
    settings = list(overrides)
    if engine is not None:
        settings.append(Setting(f"run.engine={engine}", f"--engine {engine}"))
    if dt is not None:
        settings.append(Setting(f"run.dt={dt}", f"--dt {dt:.12g}"))
    loaded = retitled(load(scene, settings), overrides)
    reached: Accuracy | None = None

    def simulated() -> Recording:
        nonlocal reached
        if accuracy is None:
            return simulate(loaded, progress=update)
        from chutelab.accuracy import reach

        found, reached = reach(loaded, accuracy, update)
        return found

    with destination(out, files_of(kinds)) as folder:
        with progress("simulating", quiet=quiet) as update:
            recording, stuck = salvaged(simulated, keep=partial)
        if folder is not None:
            write(recording, folder, kinds, quiet=quiet, accuracy=reached)
    tell(recording, out, kinds, as_json=as_json, quiet=quiet, accuracy=reached)
    if stuck is not None:
        raise stuck
    if accuracy is not None and reached is not None and not reached.met:
        raise MissedError(accuracy, reached)
