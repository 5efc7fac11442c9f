"""Arguments and options that several commands take, and how a shell completes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from chutelab.cli.program import RefusedError

if TYPE_CHECKING:
    from chutelab.scene import Scene

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

KINDS = {
    "png": ("overlay.png",),
    "gif": ("lesson.gif",),
    "csv": ("events.csv", "trajectory.csv"),
    "npz": ("recording.npz",),
    "json": ("summary.json",),
    "mp4": ("lesson.mp4",),
    "webm": ("lesson.webm",),
    "strobe": ("strobe.png",),
}
"""What ``--only`` takes, and the files it stands for."""

FILMS = ("gif", "mp4", "webm")
"""Those that are the lesson picture; ``--format`` chooses one."""

USUAL = ("png", "gif", "csv", "npz", "json")
"""Those that are written unless ``--only`` chooses."""


def complete_scene(
    _ctx: click.Context, _parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Offer the shipped scenes that begin so, and files."""
    from chutelab.scene import about

    names = [
        CompletionItem(scene.name, help=scene.title)
        for scene in about()
        if scene.name.startswith(incomplete)
    ]
    return [*names, CompletionItem(incomplete, type="file")]


def complete_kinds(
    _ctx: click.Context, _parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Offer `KINDS` after the last comma."""
    before, comma, begun = incomplete.rpartition(",")
    return [CompletionItem(f"{before}{comma}{kind}") for kind in KINDS if kind.startswith(begun)]


def _kinds(
    _ctx: click.Context, _parameter: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...] | None:
    if not values:
        return None
    asked = {kind.strip().lower() for value in values for kind in value.split(",")}
    if asked - KINDS.keys():
        raise click.BadParameter(f"{','.join(values)!r}: choose from {','.join(KINDS)}")
    return tuple(kind for kind in KINDS if kind in asked)


def folder(_ctx: click.Context, _parameter: click.Parameter, value: str | None) -> Path | None:
    """Return a path from an option, for a folder to be made."""
    if value == "":
        raise click.BadParameter("the name of a folder is empty")
    return None if value is None else Path(value)


set_option = click.option(
    "--set",
    "overrides",
    metavar="KEY=VALUE",
    multiple=True,
    help="Change a key of the scene, such as plate.angle_deg=20. May be repeated.",
)

engine_option = click.option(
    "--engine",
    type=click.Choice(["auto", "exact", "contact", "pymunk"]),
    help="Same as --set run.engine=...",
)
dt_option = click.option("--dt", metavar="S", type=float, help="Same as --set run.dt=S.")


def loaded_as_told(
    name: str, overrides: Sequence[str], engine: str | None, dt: float | None
) -> Scene:
    """Load a scene with what ``--set``, ``--engine`` and ``--dt`` change; its title says so."""
    from chutelab.scene import load
    from chutelab.scene.overrides import Override

    settings: list[str | Override] = list(overrides)
    if engine is not None:
        settings.append(Override("run.engine", engine, f"--engine {engine}"))
    if dt is not None:
        settings.append(Override("run.dt", dt, f"--dt {dt:.12g}"))
    return retitled(load(name, settings), overrides)


def retitled(scene: Scene, changes: Sequence[str]) -> Scene:
    """Return a scene whose title says what was changed of its machine, each ``KEY=VALUE``.

    Titles name numbers, such as "2 m/s": a picture of another machine must not go by them alone.
    """
    if any(change.partition("=")[0].strip() == "title" for change in changes):
        return scene
    told = [change.strip() for change in changes if not change.strip().startswith("run.")]
    if not told:
        return scene
    title = f"{scene.title}; with {', '.join(told)}"
    return scene.model_copy(update={"title": title if len(title) <= 200 else f"{title[:198]} …"})


def output_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--out``, ``--only``, ``--format``, ``--json`` and ``--quiet``."""
    options: tuple[Decorator, ...] = (
        click.option(
            "--out",
            metavar="DIR",
            type=click.Path(),
            callback=folder,
            help="Write pictures, tables and the recording into this folder.",
        ),
        click.option(
            "--only",
            metavar="KINDS",
            multiple=True,
            callback=_kinds,
            shell_complete=complete_kinds,
            help=f"With --out: only some of {','.join(KINDS)}; without, the first"
            f" {len(USUAL)}. May be repeated.",
        ),
        click.option(
            "--format",
            "film",
            type=click.Choice(FILMS),
            help="With --out: the lesson picture as this instead of a GIF; mp4 and webm need the"
            " extra chutelab[video].",
        ),
        click.option(
            "--json", "as_json", is_flag=True, help="Print one JSON object instead of tables."
        ),
        click.option("--quiet", "-q", is_flag=True, help="Print no summary and no progress bar."),
    )
    for option in reversed(options):
        command = option(command)
    return command


def chosen(
    out: Path | None, only: tuple[str, ...] | None, film: str | None = None
) -> tuple[str, ...]:
    """Return the kinds of files to write.

    Refuse ``--only`` and ``--format`` where nothing is written, ``--format`` where there is no
    film, and a film that cannot be written here.
    """
    if out is None:
        for option, given in (("--only chooses among", only), ("--format is for one of", film)):
            if given is not None:
                raise click.UsageError(f"{option} the files of --out DIR: give --out too.")
    kinds = USUAL if only is None else only
    if film is not None:
        if not set(kinds) & set(FILMS):
            raise click.UsageError(
                f"--format {film} is for the lesson picture, which --only {','.join(kinds)}"
                " leaves out: add gif to --only."
            )
        kinds = tuple(kind for kind in KINDS if kind == film or kind in set(kinds) - set(FILMS))
    for kind in kinds:
        if kind in FILMS and kind != "gif":
            from chutelab.pictures.animation import VideoError, need_video

            try:
                need_video(kind)
            except VideoError as error:
                raise RefusedError(str(error)) from error
    return kinds
