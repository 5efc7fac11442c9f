"""``page``: a scene and its variants as one HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from chutelab.cli.parameters import complete_scene, set_option
from chutelab.cli.program import RefusedError

if TYPE_CHECKING:
    from chutelab.page import Written
    from chutelab.variation import Vary


def _varies(
    _ctx: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]
) -> tuple[Vary, ...]:
    from chutelab.variation import VaryError, parse

    try:
        return tuple(parse(text) for text in texts)
    except VaryError as error:
        raise RefusedError(str(error)) from error


@click.command(short_help="Write a page with sliders that any browser opens.")
@click.argument("scene", shell_complete=complete_scene)
@click.option(
    "--vary",
    "varies",
    metavar="KEY=FROM:TO:COUNT",
    multiple=True,
    callback=_varies,
    help="A slider: a key of the scene and its values, such as plate.angle_deg=-20:70:46 or"
    " incoming.speed=1,2,4. May be given twice.",
)
@set_option
@click.option(
    "-o",
    "--out",
    "--output",
    "output",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="The file to write; default: the scene's name with .html, here.",
)
@click.option("--quiet", "-q", is_flag=True, help="Print nothing, and no progress bar.")
def page(
    scene: str,
    varies: tuple[Vary, ...],
    overrides: tuple[str, ...],
    output: Path | None,
    quiet: bool,
) -> None:
    """Write one HTML file that plays SCENE, with a slider for each quantity that is varied.

    It holds everything: no network, no server. Every variant is simulated now; those that cannot
    be run say so on their positions. A file that is there is replaced.
    """
    from chutelab.cli.output import writing
    from chutelab.cli.progress import progress
    from chutelab.page import PageError, write
    from chutelab.scene import load
    from chutelab.variation import VaryError

    path = _destination(scene, output)
    loaded = load(scene, overrides)
    try:
        with writing(str(path)), progress(f"simulating {scene}", quiet=quiet) as update:
            written = write(loaded, varies, path, progress=update)
    except (VaryError, PageError) as error:
        raise RefusedError(str(error)) from error
    if not quiet:
        click.echo(_told(written))


def _destination(scene: str, output: Path | None) -> Path:
    """Return the file to write, before anything runs."""
    path = Path(f"{Path(scene).name.removesuffix('.toml')}.html") if output is None else output
    if path.is_dir():
        raise RefusedError(f"{path} is a folder; give the name of a file, such as {path}/page.html")
    if not path.parent.is_dir():
        raise RefusedError(f"{path}: there is no folder {path.parent}")
    return path


def _told(written: Written) -> str:
    variants = "1 variant" if written.variants == 1 else f"{written.variants} variants"
    lines = [f"wrote {written.path}, {written.size / 1000:.0f} kB: {variants}"]
    if written.faults:
        values, fault = next(iter(written.faults.items()))
        at = ", ".join(f"{value:g}" for value in values)
        lines.append(
            f"{len(written.faults)} of them cannot be run, and the page says why; the first,"
            f" at {at}: {fault}"
        )
    return "\n".join(lines)
