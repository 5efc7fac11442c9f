"""``stress``: hard scenes on every engine, judged by laws."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from chutelab.cli.program import RefusedError

if TYPE_CHECKING:
    from rich.text import Text

    from chutelab.checks.stress import Result
    from chutelab.checks.stress.harness import Run


ENGINES = ("exact", "contact", "pymunk", "fixed")

HEAD = " {:<22} {:<7} {:>6} {:>5} {:>7} {:>7}  {}"
"""A line of at most 80 columns."""


def _complete_case(
    _ctx: click.Context, _parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    from chutelab.checks.stress import all_cases

    names = [case.name for case in all_cases(full=True)]
    return [CompletionItem(name) for name in names if name.startswith(incomplete)]


@click.command(short_help="Put the engines through scenes that are hard on them.")
@click.option(
    "--case",
    "names",
    metavar="NAME",
    multiple=True,
    shell_complete=_complete_case,
    help="Only this case; * stands for anything. May be repeated.",
)
@click.option(
    "--engine",
    "engines",
    type=click.Choice(ENGINES),
    multiple=True,
    help="Only this engine; fixed is pymunk with run.align = false. May be repeated.",
)
@click.option("--full", is_flag=True, help="Also what takes longer than a minute.")
@click.option("--list", "listed", is_flag=True, help="List the cases and run nothing.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.option(
    "--out",
    metavar="FILE",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write all figures into this file, tab-separated.",
)
@click.option("--quiet", "-q", is_flag=True, help="Print no progress, and only what fails.")
@click.pass_context
def stress(
    ctx: click.Context,
    names: tuple[str, ...],
    engines: tuple[str, ...],
    full: bool,
    listed: bool,
    as_json: bool,
    out: Path | None,
    quiet: bool,
) -> None:
    """Run scenes that are hard on the engines, and judge each run by laws that it must keep.

    Exit code 1 if one is broken.
    """
    from chutelab.checks.stress import chosen, results
    from chutelab.checks.stress.harness import plain, write
    from chutelab.cli import console
    from chutelab.cli.console import progress
    from chutelab.cli.output import check_file, writing

    try:
        cases = chosen(names, full=full)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--case") from error
    if listed:
        for case in cases:
            click.echo(f"{case.name}\t{case.group}")
        return
    check_file("--out", out)
    found: list[Result] = []
    with progress("stressing", quiet=quiet) as update:
        for done, result in results(cases, engines or ENGINES):
            found.append(result)
            if update is not None:
                update(done / len(cases))
    if not found:
        raise RefusedError("none of these cases is for that engine")
    if out is not None:
        with writing(f"--out {out}"):
            write(found, out)
    failed = sum(result.broken for result in found)
    unpromised = sum(bool(result.unpromised) for result in found)
    if as_json:
        shown = {"format": 1, "results": [plain(result) for result in found]}
        console.show_json({**shown, "failed": failed, "unpromised": unpromised})
    else:
        _print(found, quiet=quiet)
        broken = f"{failed} broken" if failed else "all laws kept"
        broken += f", {unpromised} not promised" if unpromised else ""
        ran = len({result.case for result in found})
        click.echo(f"{ran} case{'s' if ran > 1 else ''}, {len(found)} figures: {broken}")
    if failed:
        ctx.exit(1)


def _print(results: Sequence[Result], *, quiet: bool) -> None:
    from rich.text import Text

    from chutelab.checks.stress.harness import runs
    from chutelab.cli import console

    lines: list[Text] = []
    group, case = "", ""
    for run in runs(results):
        if quiet and not run.failed:
            continue
        if run.worst.group != group:
            group = run.worst.group
            lines += [Text(), Text(group, style="bold")]
        lines.append(_line(run, run.worst.case if run.worst.case != case else ""))
        case = run.worst.case
    if lines:
        head = HEAD.format("case", "engine", "dt, s", "kept", "figure", "bound", "nearest law")
        console.show(Text(head, style="dim"), *lines, Text())
    for result in results:
        where = f"{result.engine} at dt = {result.dt:.4g} s" if result.dt else result.engine
        if result.broken:
            click.echo(f"FAILED {result.case}, {where}: {result.law}: {_said(result)}")
        elif result.unpromised:
            said = f"{_said(result)}; {result.unpromised}"
            click.echo(f"not promised {result.case}, {where}: {result.law}: {said}")


def _line(run: Run, case: str) -> Text:
    from rich.text import Text

    worst = run.worst
    line = HEAD.format(
        case,
        worst.engine,
        "-" if worst.dt is None else f"{worst.dt:.2g}",
        f"{run.kept}/{run.laws}",
        _number(worst.figure),
        _number(worst.bound),
        worst.law,
    )
    return Text(line, style="bold red" if run.failed else "")


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"


def _said(result: Result) -> str:
    if result.figure is None or result.bound is None:
        return result.detail
    relation = "less than" if result.least else "more than"
    return f"{result.figure:.3g}, {relation} {result.bound:.3g} {result.detail}"
