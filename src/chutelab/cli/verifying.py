"""``verify``: the three answers to the same scene, side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from chutelab.cli.parameters import complete_scene

if TYPE_CHECKING:
    from chutelab.agreement import Agreement


@click.command(short_help="Compare theory, exact and pymunk on scenes.")
@click.argument("scenes", metavar="[SCENE]...", nargs=-1, shell_complete=complete_scene)
@click.pass_context
def verify(ctx: click.Context, scenes: tuple[str, ...]) -> None:
    """Compare theory, exact and pymunk on each SCENE (default: shipped ones of one particle).

    Of a stream, particle 0 is taken alone. Exit code 1 if two of them disagree by more than their
    tolerance.
    """
    from chutelab.agreement import agreement
    from chutelab.cli import console
    from chutelab.cli.progress import progress
    from chutelab.cli.report import plain_table
    from chutelab.scene import load, shipped

    loaded = {name: load(name) for name in scenes or shipped()}
    if not scenes:
        loaded = {name: scene for name, scene in loaded.items() if scene.stream.count == 1}
    found = {}
    with progress("verifying") as update:
        for name, scene in loaded.items():
            found[name] = agreement(scene)
            if update is not None:
                update(len(found) / len(loaded))
    table = plain_table(["scene", "", "quantity", "difference", "tolerance"], texts=3)
    for name, answers in found.items():
        for row in answers:
            table.add_row(name, *_row(row))
            name = ""
    console.show(table)
    failed = sum(not row.holds for answers in found.values() for row in answers)
    click.echo(f"{failed} outside the tolerance" if failed else "all within the tolerance")
    if failed:
        ctx.exit(1)


def _row(row: Agreement) -> tuple[str, ...]:
    if row.tolerance is None:
        return row.pair, row.quantity, _size(row.difference), "-"
    mark = "" if row.holds else " FAILED"
    return row.pair, row.quantity, _size(row.difference), f"{row.tolerance:.1e}{mark}"


def _size(difference: float | None) -> str:
    return "-" if difference is None else f"{difference:.1e}"
