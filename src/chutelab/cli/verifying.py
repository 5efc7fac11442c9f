"""``verify``: what scenes are expected to show, and all answers side by side."""

from __future__ import annotations

from itertools import groupby
from math import isfinite
from typing import TYPE_CHECKING, Any

import click

from chutelab.cli.parameters import complete_scene

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.text import Text

    from chutelab.agreement import Agreement, Finding, Verification
    from chutelab.scene import Scene

OK, FAILED = "ok", "FAILED"


@click.command(short_help="Check what scenes promise; compare independent answers.")
@click.argument("scenes", metavar="[SCENE]...", nargs=-1, shell_complete=complete_scene)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.pass_context
def verify(ctx: click.Context, scenes: tuple[str, ...], as_json: bool) -> None:
    """Check what each SCENE is expected to show (default: all shipped ones).

    Every [[expect]] of a scene is looked at on each engine that can run it, and in the theory.
    Then theory, exact, contact, pymunk and, where SciPy is installed, its DOP853 are compared on
    its particle 0, taken alone. Exit code 1 if an error is larger than its tolerance.
    """
    from chutelab import agreement
    from chutelab.cli import console
    from chutelab.cli.progress import progress
    from chutelab.scene import load, shipped

    loaded = {name: load(name) for name in scenes or shipped()}
    found: dict[str, Verification] = {}
    with progress("verifying") as update:
        for done, (name, scene) in enumerate(loaded.items()):
            if update is not None:
                update(done / len(loaded))
            found[name] = agreement.verify(scene)
    failures = sum(answer.failures for answer in found.values())
    if as_json:
        answers = [_plain(name, loaded[name], answer) for name, answer in found.items()]
        shares = {name: shared for name, (_, shared) in agreement.ANSWERS.items()}
        printed = {"format": 1, "failures": failures, "shares": shares, "scenes": answers}
        console.show_json(printed)
    else:
        for name, answer in found.items():
            console.show(*_shown(name, loaded[name], answer))
        click.echo("What the answers have in common:")
        for one, (how, shared) in agreement.ANSWERS.items():
            click.echo(f"  {one:<9}{how:<30}{shared}")
        click.echo("Errors and tolerances are relative where they have no unit.")
        click.echo(f"{failures} outside the tolerance" if failures else "all within the tolerance")
    if failures:
        ctx.exit(1)


def _plain(name: str, scene: Scene, answer: Verification) -> dict[str, Any]:
    return {
        "scene": name,
        "title": scene.title,
        "expectations": [
            {
                "quantity": row.quantity,
                "unit": row.unit,
                "source": row.source,
                "engine": row.engine,
                "expected": _or_null(row.expected),
                "simulated": _or_null(row.simulated),
                "error": _or_null(row.error),
                "tolerance": row.tolerance,
                "relative": row.relative,
                "holds": row.holds,
            }
            for row in answer.findings
        ],
        "agreement": [
            {
                "pair": row.pair.split(", "),
                "quantity": row.quantity,
                "difference": None if row.difference is None else _or_null(row.difference),
                "tolerance": row.tolerance,
                "least": row.least,
                "holds": row.holds,
            }
            for row in answer.agreements
        ],
        "skipped": answer.skipped,
    }


def _or_null(value: float) -> float | None:
    return value if isfinite(value) else None


def _shown(name: str, scene: Scene, answer: Verification) -> Iterator[Text]:
    """Yield the lines on one scene."""
    from rich.text import Text

    from chutelab.scene.units import with_unit
    from chutelab.sheet import WIDTH, wrapped

    yield Text(f"{name}: {scene.title}", style="bold")
    if answer.findings:
        yield Text(
            f"  {'expected':>26}{'simulated':>16}{'error':>13}{'tolerance':>13}", style="dim"
        )
    for (quantity, source, unit), rows in groupby(
        answer.findings, lambda row: (row.quantity, row.source, row.unit)
    ):
        head = f"{with_unit(quantity, unit)}: {source}"
        for number, line in enumerate(wrapped(head, WIDTH - 4)):
            yield Text(f"  {'  ' if number else ''}{line}")
        for row in rows:
            yield _judged(_columns(row), row.holds, promised=row.tolerance is not None)
    for engine, reason in answer.skipped.items():
        yield Text(f"  {engine} is left out: {reason}")
    yield Text("  particle 0 alone, one answer against another:")
    for pair in answer.agreements:
        yield from _compared(pair)
    yield Text("")


def _columns(row: Finding) -> str:
    from chutelab.scene.units import write_size

    unit = "%" if row.relative else row.unit
    error = write_size(row.error, unit, 2) if isfinite(row.error) else "-"
    tolerance = "-" if row.tolerance is None else write_size(row.tolerance, unit)
    return (
        f"    {row.engine:<8}{_number(row.expected):>16}{_number(row.simulated):>16}"
        f"{error:>13}{tolerance:>13}"
    )


def _number(value: float) -> str:
    return f"{value:.8g}" if isfinite(value) else "-"


def _judged(columns: str, holds: bool, *, promised: bool) -> Text:
    from rich.text import Text

    line = Text(columns)
    if promised:
        line.append(f"  {OK if holds else FAILED}", style="green" if holds else "bold red")
    return line


def _compared(row: Agreement) -> Iterator[Text]:
    from chutelab.sheet import WIDTH, wrapped

    pair = f"{row.pair.replace(', ', ' - ')}: {row.quantity}"
    if row.difference is None and row.tolerance is None:
        from rich.text import Text

        for number, line in enumerate(wrapped(pair, WIDTH - 6)):
            yield Text(f"    {'  ' if number else ''}{line}")
        return
    form = ".1f" if row.least else ".1e"
    difference = "-" if row.difference is None else f"{row.difference:{form}}"
    tolerance = "-" if row.tolerance is None else f"{row.tolerance:{form}}"
    least = ">= " if row.least else ""
    columns = f"    {pair:<48}{difference:>8}{least + tolerance:>13}"
    yield _judged(columns, row.holds, promised=row.tolerance is not None)
