"""``tables``: the paper's tables, printed beside computed."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Literal

import click

if TYPE_CHECKING:
    from rich.console import RenderableType

    from chutelab.theory.tables import Table

NUMBERS = (1, 3, 4, 5)


@click.command(short_help="Compute the paper's tables anew, beside what is printed.")
@click.argument(
    "number", required=False, metavar="[NUMBER]", type=click.Choice([str(n) for n in NUMBERS])
)
@click.option(
    "--as-printed",
    "rebound",
    flag_value="as-printed",
    default=True,
    help="Compute with Eq. (9) as the paper prints it (the default here).",
)
@click.option(
    "--corrected", "rebound", flag_value="corrected", help="Compute with Eq. (9) put right."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def tables(number: str | None, rebound: Literal["as-printed", "corrected"], as_json: bool) -> None:
    """Compute Table 1, 3, 4 or 5 of the paper anew (all of them without NUMBER).

    Each cell holds the printed number, then the computed one, marked with * where it differs in a
    printed digit.
    """
    from chutelab.cli import console
    from chutelab.theory.tables import table

    found = [table(n, rebound) for n in ([int(number)] if number else NUMBERS)]
    if as_json:
        console.show_json({"format": 1, "tables": [_plain(t) for t in found]})
    else:
        console.show(*(part for t in found for part in _shown(t)))


def _plain(table: Table) -> dict[str, object]:
    return {**asdict(table), "cells": table.cells, "differing": table.differing}


def _shown(table: Table) -> list[RenderableType]:
    from rich.text import Text

    from chutelab.cli.report import plain_table, titled

    sheet = table.sheet()
    # Broken here, or the terminal breaks some of them elsewhere.
    columns = [column.replace(" = ", " =\n") for column in sheet.columns]
    drawn = plain_table(columns, width=max(len(text) for row in sheet.rows for text in row[1:]))
    for row in sheet.rows:
        drawn.add_row(*row)
    return [titled(sheet.title, drawn), Text("\n" + "\n".join(sheet.notes))]
