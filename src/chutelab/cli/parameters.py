"""Arguments and options that several commands take, and how a shell completes them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from errno import EINVAL, ELOOP, ENAMETOOLONG
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from chutelab.util.errors import cut, printable

if TYPE_CHECKING:
    from chutelab.scene import Scene

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


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


class Number(click.FloatRange):
    """A number in a range, called so in what click says of anything else."""

    name = "number"


class Count(click.IntRange):
    """A whole number in a range, called so in what click says of anything else."""

    name = "whole number"


DEEPEST = 200
"""Folders inside each other in a name; each made needs a call inside the one before."""


class FileName(click.Path):
    """The name of a file or folder, refused where the system can have none that is called so."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the name as `click.Path` does."""
        said = cut(printable(str(value)), 60)
        try:
            os.lstat(value)
        except ValueError:
            self.fail(f"'{said}': no file can have this name.", param, ctx)
        except OSError as error:
            if error.errno in (EINVAL, ELOOP, ENAMETOOLONG):
                self.fail(f"'{said}': {error.strerror}.", param, ctx)
        if len(Path(value).parts) > DEEPEST:
            self.fail(f"'{said}': more than {DEEPEST} folders deep.", param, ctx)
        return super().convert(value, param, ctx)


def _folder(_ctx: click.Context, _parameter: click.Parameter, value: str | None) -> Path | None:
    if value == "":
        raise click.BadParameter("the name of a folder is empty")
    return None if value is None else Path(value)


def out_option(text: str, *names: str, required: bool = False) -> Decorator:
    """Return ``--out``, by more names if wanted: a folder that is made where there is none."""
    return click.option(
        *names,
        "--out",
        metavar="DIR",
        required=required,
        type=FileName(),
        callback=_folder,
        help=text,
    )


def file_option(*names: str, text: str) -> Decorator:
    """Return an option that takes the name of a file to write."""
    return click.option(*names, metavar="FILE", type=FileName(path_type=Path), help=text)


def json_option(text: str = "Print one JSON object.") -> Decorator:
    """Return ``--json``."""
    return click.option("--json", "as_json", is_flag=True, help=text)


def max_seconds_option(default: float, text: str) -> Decorator:
    """Return ``--max-seconds``, more than 0."""
    return click.option(
        "--max-seconds",
        metavar="S",
        type=Number(min=0.0, min_open=True),
        default=default,
        show_default=True,
        help=text,
    )


def jobs_option(default: int, text: str) -> Decorator:
    """Return ``--jobs``; 0 is one process for each processor."""
    text += "; 0, the default, is one" if default == 0 else "; 0 is one"
    return click.option(
        "--jobs",
        metavar="N",
        type=Count(min=0),
        default=default,
        help=f"{text} for each processor.",
    )


scene_argument = click.argument("scene", shell_complete=complete_scene)

set_option = click.option(
    "--set",
    "overrides",
    metavar="KEY=VALUE",
    multiple=True,
    help="Change a key of the scene, such as plate.angle_deg=20 or particle.radius=4mm. May be"
    " repeated.",
)

engine_option = click.option(
    "--engine",
    type=click.Choice(["auto", "exact", "contact", "pymunk"]),
    help="Same as --set run.engine=...",
)
dt_option = click.option("--dt", metavar="S", type=float, help="Same as --set run.dt=S.")


def loaded_as_told(
    name: str, overrides: Sequence[str], engine: str | None = None, dt: float | None = None
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
    stripped = [change.strip() for change in changes]
    told = [change for change in stripped if not change.startswith(("run.", "live."))]
    if not told:
        return scene
    title = f"{scene.title}; with {', '.join(told)}"
    return scene.model_copy(update={"title": title if len(title) <= 200 else f"{title[:198]} …"})
