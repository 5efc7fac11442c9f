"""``run``, ``show`` and ``page``: one scene simulated, a saved recording, one HTML file."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import click

from chutelab.cli.console import progress, say
from chutelab.cli.output import KINDS, Output, check_file, destination, output_options
from chutelab.cli.parameters import (
    FileName,
    Number,
    dt_option,
    engine_option,
    file_option,
    loaded_as_told,
    scene_argument,
    set_option,
)
from chutelab.cli.program import RefusedError
from chutelab.util.errors import InputError
from chutelab.util.files import writing

if TYPE_CHECKING:
    from chutelab.studies.accuracy import Accuracy, Wanted


def _accuracy(text: str) -> Wanted:
    from chutelab.studies.accuracy import parse

    try:
        return parse(text)
    except InputError as error:
        raise click.BadParameter(str(error)) from error


@click.command(short_help="Simulate a scene and print a summary; write its files.")
@scene_argument
@engine_option
@dt_option
@click.option(
    "--accuracy",
    metavar="A",
    type=_accuracy,
    help="Choose engine and step so that errors are at most this: relative, such as 1e-6, or a"
    " length, such as 1mm; say what was reached.",
)
@click.option(
    "--max-seconds",
    metavar="S",
    type=Number(min=0.0, min_open=True),
    help="End the simulation after S seconds with what is recorded; the summary says so.",
)
@set_option
@output_options
@click.option(
    "--partial",
    is_flag=True,
    help="With --out: if the run gets stuck, write what was recorded until then.",
)
def run(
    scene: str,
    engine: str | None,
    dt: float | None,
    accuracy: Wanted | None,
    max_seconds: float | None,
    overrides: tuple[str, ...],
    output: Output,
    partial: bool,
) -> None:
    """Simulate SCENE, a scene file or the name of a shipped one, and print a summary.

    Without --out nothing is written. With --accuracy, --engine is kept to and --dt is the longest
    step that is tried; if the accuracy cannot be reached, everything is printed and written all
    the same, and the exit code is 1. A run that --max-seconds ends is a run: its summary and files
    are of what is recorded, particles that had not ended have "stopped" as their end, and the exit
    code is 0.
    """
    from chutelab.engines.simulation import simulate
    from chutelab.results.recorder import StalledError

    if partial and output.out is None:
        raise click.UsageError("--partial keeps files of --out DIR: give --out too.")
    if max_seconds is not None and accuracy is not None:
        raise click.UsageError("--max-seconds ends one run, --accuracy makes several: give one.")
    if max_seconds is not None and not isfinite(max_seconds):
        raise click.UsageError(f"--max-seconds {max_seconds}: a finite number above 0 s.")
    loaded = loaded_as_told(scene, overrides, engine, dt)
    reached: Accuracy | None = None
    stuck = ""
    with destination(output.out, output.files) as folder:
        try:
            with progress("simulating", quiet=output.quiet) as update:
                if accuracy is None:
                    recording = simulate(loaded, progress=update, max_seconds=max_seconds)
                else:
                    from chutelab.studies.accuracy import reach

                    recording, reached = reach(loaded, accuracy, update)
        except StalledError as stalled:
            kept = (
                "" if partial else "; add --out DIR --partial to keep what was recorded until then"
            )
            if kept or stalled.recording is None:
                raise click.ClickException(f"{stalled}{kept}") from stalled
            recording, stuck = stalled.recording, f"{stalled}; what is written ends there"
        if folder is not None:
            output.write(recording, folder, reached)
    output.tell(recording, reached)
    if reached is not None and not reached.met:
        from chutelab.studies.accuracy import written

        best = "how much was, cannot be told"
        if reached.reached is not None:
            best = f"{written(reached.reached, reached.unit)} was"
        stuck = f"the accuracy of {accuracy} was not reached; {best}"
    if stuck:
        raise click.ClickException(stuck)


@click.command(short_help="Print the summary of a recording.npz; make its files again.")
@click.argument("recording", type=FileName(path_type=Path))
@output_options
def show(recording: Path, output: Output) -> None:
    """Print the summary of RECORDING, a recording.npz; with --out make its files again."""
    from chutelab.results import Recording
    from chutelab.results.storage import RecordingError

    try:
        loaded = Recording.load(recording)
    except RecordingError as error:
        from chutelab.scene import shipped

        meant = ""
        if (inside := recording / KINDS["npz"][0]).is_file():
            meant = f"; did you mean {inside}?"
        elif recording.suffix == ".toml" or str(recording) in shipped():
            meant = f"; show takes a recording.npz; for a scene: chutelab run {recording}"
        raise RefusedError(f"{error}{meant}") from error
    with destination(output.out, output.files) as folder:
        if folder is not None:
            output.write(loaded, folder)
    output.tell(loaded)


@click.command(short_help="Write a page with sliders that any browser opens.")
@scene_argument
@click.option(
    "--vary",
    "varies",
    metavar="KEY=FROM:TO:COUNT",
    multiple=True,
    help="A slider: a key of the scene and its values, such as plate.angle_deg=-20:70:46 or"
    " incoming.speed=1,2,4. May be given twice.",
)
@set_option
@file_option(
    "-o", "--out", "--output", "output",
    text="The file to write; default: the scene's name with .html, here.",
)  # fmt: skip
@click.option("--quiet", "-q", is_flag=True, help="Print nothing, and no progress bar.")
def page(
    scene: str,
    varies: tuple[str, ...],
    overrides: tuple[str, ...],
    output: Path | None,
    quiet: bool,
) -> None:
    """Write one HTML file that plays SCENE, with a slider for each quantity that is varied.

    It holds everything: no network, no server. Every variant is simulated now; those that cannot
    be run say so on their positions. A file that is there is replaced.
    """
    from chutelab.pictures.live.page import write
    from chutelab.scene import load
    from chutelab.scene.variants import parse

    sliders = [parse(text) for text in varies]
    loaded = load(scene, overrides)
    path = output or Path(f"{Path(scene).name.removesuffix('.toml')}.html")
    check_file("-o" if output else "", path)
    with writing(str(path)), progress(f"simulating {scene}", quiet=quiet) as update:
        written = write(loaded, sliders, path, progress=update)
    if not quiet:
        variants = "1 variant" if written.variants == 1 else f"{written.variants} variants"
        say(f"wrote {written.path}, {written.size / 1000:.0f} kB: {variants}")
        for values, fault in list(written.faults.items())[:1]:
            say(
                f"{len(written.faults)} of them cannot be run, and the page says why; the first,"
                f" at {', '.join(f'{value:g}' for value in values)}: {fault}"
            )
