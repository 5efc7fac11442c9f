"""``check``, the look at a scene before it runs, and ``verify``, what scenes are to show."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from itertools import groupby
from math import isfinite
from typing import TYPE_CHECKING, Any

import click

from chutelab.cli.parameters import complete_scene, set_option

if TYPE_CHECKING:
    from rich.text import Text

    from chutelab.checks.agreement import Agreement, Finding, Verification
    from chutelab.checks.preflight import Coverage, Effort, Preflight, Stepping
    from chutelab.scene import Scene


NAMES = 16
"""Columns for the names at the left."""


@click.command(short_help="Look at a scene before it runs, or say all that is wrong.")
@click.argument(
    "scenes", metavar="SCENE...", nargs=-1, required=True, shell_complete=complete_scene
)
@set_option
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.pass_context
def check(
    ctx: click.Context, scenes: tuple[str, ...], overrides: tuple[str, ...], as_json: bool
) -> None:
    """Look at each SCENE before it runs, or say all that is wrong with it.

    Says what will be built and what is skipped, which engine runs and why, what a run will cost,
    what the closed form covers, and for each warning what to change.
    """
    from chutelab.checks.preflight import preflight
    from chutelab.cli import console
    from chutelab.scene import SceneError, load

    refused = False
    found: dict[str, Preflight] = {}
    for name in scenes:
        try:
            found[name] = preflight(load(name, overrides))
        except SceneError as error:
            refused = True
            click.echo(f"Error: {error}", err=True)
    if as_json:
        looks = [_plain(name, look) for name, look in found.items()]
        console.show_json({"format": 1, "scenes": looks})
    else:
        for number, (name, look) in enumerate(found.items()):
            if number:
                click.echo()
            click.echo("\n".join(_shown(name, look)))
    if refused:
        ctx.exit(2)


def _plain(name: str, look: Preflight) -> dict[str, Any]:
    out = {"scene": name, **asdict(look)}
    if look.stepping is not None:
        out["stepping"]["safe"] = look.stepping.safe
    return out


def _shown(name: str, look: Preflight) -> Iterator[str]:
    """Yield the lines on one scene."""
    yield f"{name}: {look.title}"
    yield "built"
    for part in look.built:
        yield from _item(part.name, part.what)
    yield "skipped"
    for part in look.skipped:
        yield from _item(part.name, part.what)
    yield "how it runs"
    yield from _item("engine", f"{look.engine}: {look.why}")
    yield from _item("ends", look.ends)
    if look.stepping is not None:
        yield from _steps(look.stepping)
    yield from _cost(look.effort)
    yield "closed form"
    yield from _theory(look.theory)
    if look.advice:
        yield "warnings" if len(look.advice) > 1 else "warning"
    for advice in look.advice:
        yield from _wrapped(f"- {advice.warning}", "  ", "    ")
        yield from _wrapped(f"change: {advice.change}", "    ", "            ")


def _steps(steps: Stepping) -> Iterator[str]:
    from chutelab.scene.units import write_size

    longest = write_size(steps.dt, "s")
    if steps.aligned:
        yield from _item("steps", f"at most {longest} while contacts last")
        yield from _item("tunnelling", "none at any speed: blows have their own instants")
    else:
        yield from _item("steps", f"all of {longest}")
        room = f"a surface catches it within {write_size(steps.bound, 'm')}"
        if steps.way is None or steps.longest is None:
            yield from _item("tunnelling", f"nothing moved in the trial run; {room}")
        else:
            verdict = "none" if steps.safe else "POSSIBLE"
            yield from _item(
                "tunnelling",
                f"{verdict}: at {steps.speed:.3g} m/s a particle covers"
                f" {write_size(steps.way, 'm')} in a step, and {room}:"
                f" safe below dt = {write_size(steps.longest, 's')}",
            )


def _cost(effort: Effort) -> Iterator[str]:
    about = "at least " if effort.at_least else "about "
    yield from _item("contacts", f"{about}{_rounded(effort.contacts)}")
    yield from _item("run time", f"{about}{_lasting(effort.seconds)}; {effort.how}")


def _lasting(seconds: float) -> str:
    """Write a duration that is known to one digit."""
    one = float(f"{seconds:.1g}")
    return f"{one:g} s" if one >= 0.1 else f"{1e3 * one:g} ms"


def _rounded(number: int) -> str:
    """Write a number with two digits that count, large ones with commas."""
    return f"{int(float(f'{number:.2g}')):,}" if number > 100 else str(number)


def _theory(theory: Coverage) -> Iterator[str]:
    if theory.covers:
        yield from _item("covers", ", ".join(theory.covers))
    if theory.leaves_out:
        missing = ", ".join(theory.leaves_out) if theory.covers else "all of it"
        yield from _item("leaves out", missing)
    yield from _item("because" if theory.reason else "in words", theory.words)


def _item(name: str, what: str) -> Iterator[str]:
    # A long name has its line to itself.
    if len(name) > NAMES - 3:
        yield f"  {name}"
        name = ""
    yield from _wrapped(what, f"  {name:<{NAMES - 2}}", " " * NAMES)


def _wrapped(text: str, first: str, later: str) -> Iterator[str]:
    from textwrap import wrap

    from chutelab.util.tables import WIDTH

    yield from wrap(
        text,
        WIDTH,
        initial_indent=first,
        subsequent_indent=later,
        break_on_hyphens=False,
        break_long_words=False,
    )


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
    from chutelab.checks import agreement
    from chutelab.cli import console
    from chutelab.cli.console import progress
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
        answers = [
            _plain_verification(name, loaded[name], answer) for name, answer in found.items()
        ]
        shares = {name: shared for name, (_, shared) in agreement.ANSWERS.items()}
        printed = {"format": 1, "failures": failures, "shares": shares, "scenes": answers}
        console.show_json(printed)
    else:
        for name, answer in found.items():
            console.show(*_shown_findings(name, loaded[name], answer))
        click.echo("What the answers have in common:")
        for one, (how, shared) in agreement.ANSWERS.items():
            click.echo(f"  {one:<9}{how:<30}{shared}")
        click.echo("Errors and tolerances are relative where they have no unit.")
        click.echo(f"{failures} outside the tolerance" if failures else "all within the tolerance")
    if failures:
        ctx.exit(1)


def _plain_verification(name: str, scene: Scene, answer: Verification) -> dict[str, Any]:
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


def _shown_findings(name: str, scene: Scene, answer: Verification) -> Iterator[Text]:
    """Yield the lines on one scene."""
    from rich.text import Text

    from chutelab.scene.units import with_unit
    from chutelab.util.tables import WIDTH, wrapped

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
    from chutelab.util.tables import WIDTH, wrapped

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
