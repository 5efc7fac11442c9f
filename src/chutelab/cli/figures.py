"""``figure``: the paper's figures, as printed and corrected side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from chutelab.cli.parameters import folder
from chutelab.cli.program import RefusedError

if TYPE_CHECKING:
    from pathlib import Path

    from chutelab.figures import PaperFigure


@click.command(short_help="Draw the paper's figures anew, printed beside corrected.")
@click.argument("number", type=int, metavar="NUMBER")
@click.option(
    "--out",
    metavar="DIR",
    type=click.Path(),
    callback=folder,
    help="Write the picture, its numbers and its scenes into this folder.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def figure(number: int, out: Path | None, as_json: bool) -> None:
    """Compute Figure 6, 7, 8, 9, 11, 12 or 13 of the paper anew.

    Beside each other: what follows from Eq. (9) as the paper prints it, and what follows from it
    put right; and in words what the misprint does to the figure's conclusion. What the paper's text
    does not give is said, not guessed.

    \b
    chutelab figure 6
    chutelab figure 6 --out out
    """  # noqa: D301 - click wants the backspace
    from chutelab.cli import console
    from chutelab.cli.output import destination
    from chutelab.figures import FigureError
    from chutelab.figures import figure as compute

    try:
        found = compute(number)
    except FigureError as error:
        raise RefusedError(str(error)) from error
    written: list[str] = []
    with destination(out, _names(found)) as place:
        if place is not None:
            _write(found, place)
            written = sorted(file.name for file in place.iterdir())
    if as_json:
        console.show_json(
            {
                "format": 1,
                "figure": found.number,
                "title": found.title,
                "meaning": list(found.meaning),
                "missing": list(found.missing),
                "columns": {name: column.tolist() for name, column in found.columns.items()},
            }
        )
        return
    _tell(found)
    if out is not None:
        click.echo(f"\nwrote into {out}: {', '.join(written)}")
        if found.sweep:
            click.echo(
                "The corrected side with the engine, where landing.vx and landing.vy are -v3x and"
                f" -v3y: {found.sweep}"
            )


def _names(found: PaperFigure) -> list[str]:
    name = f"figure-{found.number}"
    return [f"{name}.png", f"{name}.csv", *(f"{scene}.toml" for scene in found.scenes)]


def _write(found: PaperFigure, place: Path) -> None:
    from chutelab.design.documents import to_toml
    from chutelab.plots.figures import paper_figure

    picture, table, *scenes = _names(found)
    paper_figure(found, path=place / picture)
    (place / table).write_text(found.csv(), encoding="utf-8")
    for name, scene in zip(scenes, found.scenes.values(), strict=True):
        (place / name).write_text(to_toml(scene, found.title), encoding="utf-8")


def _tell(found: PaperFigure) -> None:
    from rich.text import Text

    from chutelab.cli import console
    from chutelab.cli.report import drawn

    sheet = found.sheet()
    console.show(drawn(sheet), Text(), *(Text(note) for note in sheet.notes))
