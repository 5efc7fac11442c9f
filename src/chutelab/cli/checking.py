"""``check``, ``verify`` and ``stress``: is a scene, an answer, a run to be trusted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import groupby
from math import isfinite
from typing import TYPE_CHECKING

import click

from chutelab.cli import console
from chutelab.cli.console import progress
from chutelab.cli.parameters import (
    complete_scene,
    dt_option,
    engine_option,
    json_option,
    loaded_as_told,
    scene_argument,
    set_option,
)
from chutelab.cli.program import StuckError

if TYPE_CHECKING:
    from chutelab.checks.agreement import Verification
    from chutelab.checks.preflight import Preflight
    from chutelab.util.tables import Sheet


@click.command(short_help="Look at a scene before it runs, or say all that is wrong.")
@click.argument(
    "scenes", metavar="SCENE...", nargs=-1, required=True, shell_complete=complete_scene
)
@set_option
@json_option()
@click.pass_context
def check(
    ctx: click.Context, scenes: tuple[str, ...], overrides: tuple[str, ...], as_json: bool
) -> None:
    """Look at each SCENE before it runs, or say all that is wrong with it.

    Says what will be built and what is skipped, which engine runs and why, what a run will cost,
    what the closed form covers, and for each warning what to change.
    """
    from chutelab.checks.preflight import preflight
    from chutelab.scene import SceneError, load
    from chutelab.util.tables import plain

    refused = False
    found: dict[str, Preflight] = {}
    for name in scenes:
        try:
            found[name] = preflight(load(name, overrides))
        except SceneError as error:
            refused = True
            click.echo(f"Error: {error}", err=True)
    if as_json:
        looks = [{"scene": name, **plain(look)} for name, look in found.items()]
        console.show_json({"format": 1, "scenes": looks})
    else:
        titled = (replace(look, title=f"{name}: {look.title}") for name, look in found.items())
        console.show(*titled)
    if refused:
        ctx.exit(2)


@click.command(short_help="Check what scenes promise; compare independent answers.")
@click.argument("scenes", metavar="[SCENE]...", nargs=-1, shell_complete=complete_scene)
@json_option()
@click.pass_context
def verify(ctx: click.Context, scenes: tuple[str, ...], as_json: bool) -> None:
    """Check what each SCENE is expected to show (default: all shipped ones).

    Every [[expect]] of a scene is looked at on each engine that can run it, and in the theory.
    Then theory, exact, contact, pymunk and, where SciPy is installed, its DOP853 are compared on
    its particle 0, taken alone. Exit code 1 if an error is larger than its tolerance.
    """
    from chutelab.checks import agreement
    from chutelab.scene import load, shipped
    from chutelab.util.tables import Sheet, plain

    loaded = {name: load(name) for name in scenes or shipped()}
    found: dict[str, Verification] = {}
    with progress("verifying") as update:
        for done, (name, scene) in enumerate(loaded.items()):
            if update is not None:
                update(done / len(loaded))
            found[name] = agreement.verify(scene)
    failures = sum(answer.failures for answer in found.values())
    if as_json:
        answers = [
            {
                "scene": name,
                "title": loaded[name].title,
                "expectations": [{**plain(row), "holds": row.holds} for row in answer.findings],
                "agreement": [
                    {**plain(row), "pair": row.pair.split(", "), "holds": row.holds}
                    for row in answer.agreements
                ],
                "skipped": answer.skipped,
            }
            for name, answer in found.items()
        ]
        shares = {name: shared for name, (_, shared) in agreement.ANSWERS.items()}
        console.show_json({"format": 1, "failures": failures, "shares": shares, "scenes": answers})
    else:
        rows = tuple((name, *told) for name, told in agreement.ANSWERS.items())
        common = Sheet("What the answers have in common", ("", "", ""), rows, texts=3)
        sheets = (_sheets(f"{name}: {loaded[name].title}", found[name]) for name in found)
        console.show(*(sheet for both in sheets for sheet in both), common)
        click.echo("Errors and tolerances are relative where they have no unit.")
        click.echo(f"{failures} outside the tolerance" if failures else "all within the tolerance")
    if failures:
        ctx.exit(1)


def _sheets(title: str, answer: Verification) -> Iterator[Sheet]:
    """Yield what a scene is to show, and its particle 0 in one answer against another."""
    from chutelab.scene.units import with_unit, write_size
    from chutelab.util.tables import Sheet

    rows: list[tuple[str, ...]] = []
    for (quantity, source, unit), findings in groupby(
        answer.findings, lambda row: (row.quantity, row.source, row.unit)
    ):
        rows.append((f"{with_unit(quantity, unit)}: {source}",))
        for row in findings:
            size = "%" if row.relative else row.unit
            rows.append((
                row.engine,
                *(f"{x:.8g}" if isfinite(x) else "-" for x in (row.expected, row.simulated)),
                write_size(row.error, size, 2) if isfinite(row.error) else "-",
                "-" if row.tolerance is None else write_size(row.tolerance, size),
                "" if row.tolerance is None else "ok" if row.holds else "FAILED",
            ))  # fmt: skip
    heads: tuple[str, ...] = ("", "expected", "simulated", "error", "tolerance", "")
    notes = tuple(f"{engine} is left out: {why}" for engine, why in answer.skipped.items())
    yield Sheet(title, heads if rows else ("",) * 6, tuple(rows), tail=1, notes=notes)
    pairs, notes = [], ()
    for one in answer.agreements:
        said = f"{one.pair.replace(', ', ' - ')}: {one.quantity}"
        if one.difference is None and one.tolerance is None:
            notes += (said,)
            continue
        form = ".1f" if one.least else ".1e"
        pairs.append((
            said,
            "-" if one.difference is None else f"{one.difference:{form}}",
            ">= " * one.least + ("-" if one.tolerance is None else f"{one.tolerance:{form}}"),
            "" if one.tolerance is None else "ok" if one.holds else "FAILED",
        ))  # fmt: skip
    alone = "Particle 0 alone, one answer against another"
    heads = ("", "difference", "tolerance", "")
    yield Sheet(alone, heads, tuple(pairs), tail=1, notes=notes)


@click.command(short_help="Run a scene and judge it by laws that every run must keep.")
@scene_argument
@engine_option
@dt_option
@set_option
@json_option()
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
    from chutelab.engines.simulation import simulate
    from chutelab.machine import build
    from chutelab.results.recorder import StalledError
    from chutelab.util.tables import Sheet, plain

    loaded = loaded_as_told(scene, overrides, engine, dt)
    try:
        with console.progress("simulating") as update:
            recording = simulate(loaded, progress=update)
    except StalledError as stalled:
        raise StuckError(str(stalled)) from stalled
    run = Evidence(build(loaded), recording)
    found = judge(run)
    broken = sum(one.broken for one in found)
    if as_json:
        about = {"scene": scene, "title": recording.title, "engine": run.engine, "dt": run.dt}
        laws = [
            {"law": one.law, **plain(one.verdict), "holds": one.verdict.holds,
             "unpromised": one.unpromised}
            for one in found
        ]  # fmt: skip
        console.show_json({"format": 1, **about, "broken": broken, "laws": laws})
    else:
        rows = []
        for one in found:
            kept = "ok" if one.verdict.holds else "FAILED" if one.broken else "-"
            said = "; not promised: ".join(filter(None, [one.verdict.detail, one.unpromised]))
            figures = (f"{one.verdict.figure:.2g}", f"{one.verdict.bound:.2g}")
            rows.append((kept, one.law, *figures, said))
        steps = "" if run.dt is None else f", steps of {run.dt:.4g} s"
        title = f"{recording.title}\nengine {run.engine}{steps}"
        console.show(Sheet(title, ("", "law", "figure", "bound", ""), tuple(rows), texts=2, tail=1))
        unpromised = sum(bool(one.unpromised) for one in found)
        if broken:
            click.echo(f"{broken} of {len(found)} laws broken")
        elif unpromised:
            click.echo(f"{len(found) - unpromised} laws kept, {unpromised} not promised")
        else:
            click.echo(f"all {len(found)} laws kept")
    if broken:
        ctx.exit(1)
