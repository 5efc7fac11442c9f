"""``stress``: one scene run and judged by the laws that every run must keep."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import TYPE_CHECKING, Any

import click

from chutelab.cli.parameters import (
    complete_scene,
    dt_option,
    engine_option,
    loaded_as_told,
    set_option,
)

if TYPE_CHECKING:
    from rich.text import Text

    from chutelab.checks.stress import Evidence, Finding

COLUMNS = "  {:<7} {:<22} {:>8} {:>8}  "
"""Whether a law is kept, its name, figure and bound; unit and place stand beside them."""


@click.command(short_help="Run a scene and judge it by laws that every run must keep.")
@click.argument("scene", shell_complete=complete_scene)
@engine_option
@dt_option
@set_option
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.pass_context
def stress(
    ctx: click.Context,
    scene: str,
    engine: str | None,
    dt: float | None,
    overrides: tuple[str, ...],
    as_json: bool,
) -> None:
    """Run SCENE and judge the run by laws that it must keep, whatever the scene.

    Nobody passes a surface, sinks into one or bounces off nothing; energy never rises but by a
    belt's work; ledger and momentum close. Each law that has something to say about the scene is a
    line, with what was found and what it must not exceed. What the engine does not promise for
    such a scene is told with the reason. Exit code 1 if a law is broken.
    """
    from chutelab.checks.stress import Evidence, judge
    from chutelab.cli import console
    from chutelab.engines.simulation import simulate
    from chutelab.machine import build
    from chutelab.results.recorder import StalledError

    loaded = loaded_as_told(scene, overrides, engine, dt)
    try:
        with console.progress("simulating") as update:
            recording = simulate(loaded, progress=update)
    except StalledError as stalled:
        raise console.StuckError(str(stalled)) from stalled
    run = Evidence(build(loaded), recording)
    found = judge(run)
    broken = sum(one.broken for one in found)
    if as_json:
        console.show_json(
            {
                "format": 1,
                "scene": scene,
                "title": recording.title,
                "engine": run.engine,
                "dt": run.dt,
                "broken": broken,
                "laws": [_plain(one) for one in found],
            }
        )
    else:
        console.show(*_shown(run, found))
        click.echo(f"{broken} of {len(found)} laws broken" if broken else _kept(found))
    if broken:
        ctx.exit(1)


def _plain(one: Finding) -> dict[str, Any]:
    return {
        "law": one.law,
        "figure": float(one.verdict.figure) if isfinite(one.verdict.figure) else None,
        "bound": float(one.verdict.bound) if isfinite(one.verdict.bound) else None,
        "detail": one.verdict.detail,
        "holds": bool(one.verdict.holds),
        "unpromised": one.unpromised,
    }


def _shown(run: Evidence, found: list[Finding]) -> Iterator[Text]:
    from rich.text import Text

    from chutelab.util.tables import WIDTH, wrapped

    steps = "" if run.dt is None else f", steps of {run.dt:.4g} s"
    yield Text(run.recording.title, style="bold")
    yield Text(f"engine {run.engine}{steps}")
    yield Text(COLUMNS.format("", "law", "figure", "bound").rstrip(), style="dim")
    for one in found:
        kept = "ok" if one.verdict.holds else "FAILED" if one.broken else "-"
        figure, bound = f"{one.verdict.figure:.2g}", f"{one.verdict.bound:.2g}"
        columns = COLUMNS.format(kept, one.law, figure, bound)
        said = one.verdict.detail
        if one.unpromised:
            said += f"; not promised: {one.unpromised}"
        for number, line in enumerate(wrapped(said, WIDTH - len(columns))):
            style = "bold red" if one.broken else ""
            yield Text((" " * len(columns) if number else columns) + line, style=style)


def _kept(found: list[Finding]) -> str:
    unpromised = sum(bool(one.unpromised) for one in found)
    return (
        f"all {len(found)} laws kept"
        if not unpromised
        else (f"{len(found) - unpromised} laws kept, {unpromised} not promised")
    )
