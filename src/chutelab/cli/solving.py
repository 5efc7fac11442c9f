"""``solve``: which value of a key makes a quantity what it should be, or least, or largest.

What ``sweep --uncertainty`` does is here too: uncertain inputs in; words, numbers and a picture
out.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from chutelab.cli.console import progress, show, show_json
from chutelab.cli.output import PICTURES, check_file, destination, write_json, writing
from chutelab.cli.parameters import json_option, out_option, retitled, scene_argument, set_option

if TYPE_CHECKING:
    from chutelab.scene import Scene

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
@click.option("--minimize", metavar="QUANTITY", help="Make this as small as it gets.")
@click.option("--maximize", metavar="QUANTITY", help="Make this as large as it gets.")
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
    """Change SCENE until a quantity is what it should be, or as small or as large as it gets.

    \b
    chutelab solve inclined-20 --vary plate.angle_deg=0:80 --target landing.vx=1
    chutelab solve inclined-20 --vary plate.angle_deg=0:80 --minimize belt_work
    chutelab solve inclined-20 --vary plate.angle_deg=20:60 \\
        --vary plate.restitution=0.1:0.9 --target landing.vx=1 --target landing.x=0.3

    Quantities are the keys of `chutelab run --json`, such as landing.x, landing.t or
    ledger.by_surface.plate.restitution_loss, the paper's symbols, such as x3, and belt_work,
    slip_heat, power (what the outgoing belt pays until nothing slips on it), restitution_loss and
    friction_loss. Belt work falls steadily as particles land faster, and is negative above the
    belt's speed; what is least at that speed is slip_heat.

    With one key all solutions in its range are found, and jumps are told from them. The exit code
    is 1 if there is no solution; the nearest thing to one is shown then. It needs
    pip install "chutelab[design]".
    """  # noqa: D301 - click wants the backspace
    from chutelab.engines.simulation import simulate
    from chutelab.scene import load, to_toml
    from chutelab.studies import design
    from chutelab.studies.design.answers import as_dict

    if len([goal for goal in (targets, minimize, maximize) if goal]) != 1:
        raise click.UsageError("Give one of --target, --minimize and --maximize.")
    loaded = load(scene, overrides)
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
            from chutelab.pictures.plots.design import scan

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
    if as_json:
        show_json(as_dict(found))
    elif not quiet:
        from rich.text import Text

        show(Text(found.base.title, style="bold"), *found.sheets())
        if out is not None:
            click.echo(f"\nwrote into {out}: {', '.join(written)}")
    if not found.solved:
        click.get_current_context().exit(1)


def propagate(
    scene: Scene,
    given: Sequence[str],
    *,
    samples: int | None,
    seed: int,
    out: Path | None,
    plot: Path | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Propagate uncertain inputs, as ``--uncertainty`` has them; write what was asked for.

    `samples` is the number of each set of points, None for the default; `out` and `plot` are a CSV
    file for all samples, and a picture.
    """
    from chutelab.studies import design
    from chutelab.studies.design.uncertainty import SAMPLES, as_dict
    from chutelab.util.files import write_lines

    check_file("--out", out, (".csv",))
    check_file("--plot", plot, PICTURES)
    count = SAMPLES if samples is None else samples
    with progress("propagating", quiet=quiet) as meter:
        found = design.uncertainty(scene, given, samples=count, seed=seed, progress=meter)
    with writing():
        if out is not None:
            write_lines(out, [found.csv()])
        if plot is not None:
            from chutelab.pictures.plots.design import spread

            spread(found).write(plot)
    if as_json:
        show_json(as_dict(found))
    elif not quiet:
        show(found)
        for path in (out, plot):
            if path is not None:
                click.echo(f"wrote {path}")
