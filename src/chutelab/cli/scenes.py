"""``scenes``, ``schema`` and ``new``: what one needs to write a scene."""

from __future__ import annotations

import json
from pathlib import Path

import click

from chutelab.cli.program import RefusedError

STANDARD_OUTPUT = Path("-")


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def scenes(as_json: bool) -> None:
    """List the shipped scenes; `run` takes their names."""
    from chutelab.cli import console
    from chutelab.scene import about

    found = about()
    if as_json:
        listed = [
            {"name": s.name, "title": s.title, "look": list(s.look), "path": str(s.path)}
            for s in found
        ]
        console.show_json({"format": 1, "scenes": listed})
        return
    from rich.text import Text

    from chutelab.cli.report import plain_table

    table = plain_table(["scene", "what it shows"], texts=2)
    for scene in found:
        what = Text(scene.title, style="bold")
        what.append(f"\n{scene.look[0] if scene.look else ''}", style="not bold")
        table.add_row(scene.name, what)
    console.show(table)


@click.command(short_help="Print the JSON Schema of scene files, for editors.")
def schema() -> None:
    """Print the JSON Schema of scene files, for editors that complete them."""
    from chutelab.scene import schema as schema_of_scenes

    click.echo(json.dumps(schema_of_scenes(), indent=2))


@click.command(short_help="Write a complete, commented scene to start from.")
@click.argument("path", default="scene.toml", type=click.Path(path_type=Path, allow_dash=True))
@click.option("--force", is_flag=True, help="Overwrite a file that is there.")
def new(path: Path, force: bool) -> None:
    """Write a complete, commented scene to start from (scene.toml, or PATH; - prints it)."""
    from chutelab.cli.output import writing
    from chutelab.files import whole
    from chutelab.scene import template

    if path == STANDARD_OUTPUT:
        click.echo(template(), nl=False)
        return
    if path.is_dir():
        raise RefusedError(f"{path} is a folder; give the name of a file.")
    if path.exists() and not force:
        raise RefusedError(f"{path} is there already; --force overwrites it.")
    with writing(str(path)), whole(path) as unfinished:
        unfinished.write_text(template(), encoding="utf-8")
    click.echo(f"wrote {path}; run it with: chutelab run {path}")
