"""``run``, ``show`` and ``live``: one scene simulated, a saved recording, a live page."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from time import perf_counter
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

    Without --out nothing is written. With --accuracy, --engine is kept, and --dt is the longest
    step that is tried; if the accuracy cannot be reached, everything is printed and written all the
    same, and the exit code is 1.

    Every run is judged: numbers are finite, nothing is inside a surface or passes one, energy rises
    only by drives, no loss is negative, the ledger closes. A law that is broken is told, and the
    exit code is 1; what is printed and written says so. Without --engine another engine runs then,
    if there is one that keeps the laws, and the summary says so.

    A run that --max-seconds ends counts as a run: its summary and files are of what was recorded,
    particles that had not ended have "stopped" as their end, and the exit code is 0. Ctrl-C ends a
    run the same way: with --out its files are written, and the exit code is 130.
    """
    from chutelab.engines.simulation import judged
    from chutelab.results import Recording
    from chutelab.results.recorder import StalledError

    if partial and output.out is None:
        raise click.UsageError("--partial keeps files of --out DIR: give --out too.")
    if max_seconds is not None and accuracy is not None:
        raise click.UsageError("--max-seconds ends one run, --accuracy makes several: give one.")
    if max_seconds is not None and not isfinite(max_seconds):
        raise click.UsageError(f"--max-seconds {max_seconds}: a finite number above 0 s.")
    began = perf_counter()
    loaded = loaded_as_told(scene, overrides, engine, dt)
    if max_seconds is not None:
        # It counts from the reading of the scene on.
        max_seconds = max(max_seconds - (perf_counter() - began), 1e-9)
    reached: Accuracy | None = None
    stuck, interrupted = "", None
    with destination(output.out, output.files) as folder:
        try:
            with progress("simulating", quiet=output.quiet, left=True) as update:
                if accuracy is None:
                    recording = judged(loaded, progress=update, max_seconds=max_seconds)
                else:
                    from chutelab.studies.accuracy import reach

                    recording, reached = reach(loaded, accuracy, update)
        except StalledError as stalled:
            kept = (
                "" if partial else "; add --out DIR --partial to keep what was recorded until then"
            )
            if kept or stalled.recording is None:
                raise click.ClickException(f"{stalled}{kept}") from stalled
            recording = Recording.of(stalled.recording)
            stuck = f"{stalled}; what is written ends there"
        except KeyboardInterrupt as error:
            if folder is None or not hasattr(error, "recording"):
                raise
            recording, interrupted = error.recording, error
            say(f"Interrupted: what was recorded is written to {output.out}.", err=True)
        if folder is not None:
            output.write(recording, folder, reached)
    if interrupted is not None:
        raise interrupted
    output.tell(recording, reached)
    if reached is not None and not reached.met:
        from chutelab.studies.accuracy import written

        best = "how much was, cannot be told"
        if reached.reached is not None:
            best = f"{written(reached.reached, reached.unit)} was"
        stuck = f"the accuracy of {accuracy} was not reached; {best}"
    if stuck:
        raise click.ClickException(stuck)
    output.end(recording)


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
    output.end(loaded)


@click.command(short_help="Open a scene as a page that answers when you drag it.")
@scene_argument
@set_option
@file_option(
    "-o", "--out", "--output", "output",
    text="The file to write, such as lab.html; default: one in a temporary folder, which is then"
    " opened in the browser.",
)  # fmt: skip
@click.option(
    "--language",
    type=click.Choice(["en", "de"]),
    default="en",
    show_default=True,
    help="Of all that the page says; texts of the scene stay as they are.",
)
@click.option("--quiet", "-q", is_flag=True, help="Print nothing.")
def live(
    scene: str,
    overrides: tuple[str, ...],
    output: Path | None,
    language: str,
    quiet: bool,
) -> None:
    """Show SCENE as a live page: drag the plate, and path, numbers and ledger follow.

    It is one HTML file with the contact engine in it, the same as in `chutelab run --engine
    contact`: any browser opens it, from a memory stick or on a phone, without installation or
    network. A file that is there is replaced. Without -o it opens in your browser; where there is
    none, it says where the page is, with exit code 1.

    What the page offers is the [live] table of the scene: predict = true hides path and numbers
    until the learner has set a mark; controls, panels, ranges and presets say what can be changed
    and what is shown.

    \b
    chutelab live inclined-40
    chutelab live inclined-40 --language de -o lab.html
    chutelab live perpendicular --set live.predict=true -o predict.html
    """  # noqa: D301 - click wants the backspace
    import webbrowser
    from tempfile import mkdtemp

    from chutelab.pictures.live.page import write

    check_file("-o", output)
    loaded = loaded_as_told(scene, overrides)
    name = f"{Path(scene).name.removesuffix('.toml')}.html"
    path = Path(mkdtemp(prefix="chutelab-")) / name if output is None else output
    with writing(str(path)):
        size = write(loaded, path, language=language)
    if output is None and not webbrowser.open(path.absolute().as_uri()):
        raise click.ClickException(f"no browser could be opened; the page is {path}")
    if not quiet:
        done = "opened" if output is None else "wrote"
        say(f"{done} {path}, {size / 1000:.0f} kB")
