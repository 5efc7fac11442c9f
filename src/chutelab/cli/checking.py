"""``check``: the look at a scene before it runs."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from chutelab.cli.parameters import complete_scene, set_option

if TYPE_CHECKING:
    from collections.abc import Iterator

    from chutelab.preflight import Coverage, Effort, Preflight, Stepping

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
    from chutelab.cli import console
    from chutelab.preflight import preflight
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

    from chutelab.sheet import WIDTH

    yield from wrap(
        text,
        WIDTH,
        initial_indent=first,
        subsequent_indent=later,
        break_on_hyphens=False,
        break_long_words=False,
    )
