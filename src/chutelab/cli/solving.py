"""``solve``: which value of a key makes a quantity what it should be, or least, or largest."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from chutelab.cli.console import progress, tell
from chutelab.cli.output import destination, write_json
from chutelab.cli.parameters import (
    json_option,
    loaded_as_told,
    out_option,
    retitled,
    scene_argument,
    set_option,
)

FILES = ("overlay.png", "scan.png", "solution.toml", "nearest.toml", "solve.json")
"""What ``--out`` may write: scan.png with one key, nearest.toml if there is no solution."""


@click.command(short_help="Find the angle, speed, distance ... that does what you want.")
@scene_argument
@click.option(
    "--vary",
    metavar="KEY=FROM:TO",
    multiple=True,
    required=True,
    help="A key of the scene and the range to search, such as plate.angle_deg=0:80. May be"
    " repeated.",
)
@click.option(
    "--target",
    "targets",
    metavar="QUANTITY=VALUE",
    multiple=True,
    help="What should be: VALUE is a number, with or without unit, a key of the scene or another"
    " quantity. May be repeated with as many --vary.",
)
@click.option("--minimize", metavar="QUANTITY", help="Make this as small as possible.")
@click.option("--maximize", metavar="QUANTITY", help="Make this as large as possible.")
@click.option(
    "--points",
    metavar="N",
    type=int,
    default=181,
    show_default=True,
    help="With one --vary: how many values to look at first.",
)
@click.option(
    "--seed",
    metavar="N",
    type=int,
    default=0,
    show_default=True,
    help="With several: of the random draws of the search.",
)
@set_option
@out_option(
    "Write the overlay at the answer, the scene there, a picture of the search and its"
    " numbers into this folder."
)
@json_option("Print one JSON object instead of tables.")
@click.option("--quiet", "-q", is_flag=True, help="Print no answer and no progress bar.")
def solve(
    scene: str,
    vary: tuple[str, ...],
    targets: tuple[str, ...],
    minimize: str | None,
    maximize: str | None,
    points: int,
    seed: int,
    overrides: tuple[str, ...],
    out: Path | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Change SCENE until a quantity has the value wanted, or is as small or as large as it can be.

    \b
    chutelab solve inclined-20 --vary plate.angle_deg=0:80 --target landing.vx=1
    chutelab solve inclined-20 --vary plate.angle_deg=0:80 --minimize belt_work
    chutelab solve inclined-20 --vary plate.angle_deg=20:60 \\
        --vary plate.restitution=0.1:0.9 --target landing.vx=1 --target landing.x=0.3

    Quantities are those of `chutelab quantities`, such as landing.x, x3, belt_work or
    ledger.by_surface.plate.restitution_loss. Of several particles say whose: particles[0].landing.x
    is the first one's, landing.x.mean and arrival.vx.spread are the stream's. Belt work falls
    steadily as particles land faster, and is negative above the belt's speed; what is least at that
    speed is slip_heat.

    With one key all solutions in its range are found, and jumps are not taken for solutions. The
    exit code is 1 if there is no solution; the nearest thing to one is shown then. It needs pip
    install "chutelab[design]".
    """  # noqa: D301 - click wants the backspace
    from rich.text import Text

    from chutelab.engines.simulation import simulate
    from chutelab.scene import to_toml
    from chutelab.studies import design
    from chutelab.studies.design.answers import as_dict

    if len([goal for goal in (targets, minimize, maximize) if goal]) != 1:
        raise click.UsageError("Give one of --target, --minimize and --maximize.")
    loaded = loaded_as_told(scene, overrides)
    written = []
    with destination(out, FILES) as place:
        with progress("searching", quiet=quiet) as meter:
            search = partial(design.solve, target=targets)
            if minimize:
                search = partial(design.minimize, quantity=minimize)
            if maximize:
                search = partial(design.maximize, quantity=maximize)
            found = search(loaded, vary, points=points, seed=seed, progress=meter)
        if place is not None:
            from chutelab.pictures.plots import overlay
            from chutelab.pictures.plots.studies import scan

            with progress("drawing", quiet=quiet):
                write_json(as_dict(found), place / "solve.json")
                if found.scan is not None:
                    scan(found).write(place / "scan.png")
                if found.solved or found.nearest:
                    values = zip(found.ranges, found.answer.values, strict=True)
                    told = [f"{one.key}={value:.4g}" for one, value in values]
                    at = retitled(found.scene, told)
                    outcome = "solution" if found.solved else "no solution, the nearest to one"
                    name = "solution.toml" if found.solved else "nearest.toml"
                    text = to_toml(at, f"{found.asked}: {outcome}.")
                    (place / name).write_text(text, encoding="utf-8")
                    overlay(simulate(at), path=place / "overlay.png")
            written = sorted(file.name for file in place.iterdir())
    title = Text(found.base.title, style="bold")
    wrote = f"\nwrote into {out}: {', '.join(written)}" if out else ""
    tell(as_dict(found), title, *found.sheets(), as_json=as_json, quiet=quiet, wrote=wrote)
    if not found.solved:
        click.get_current_context().exit(1)
