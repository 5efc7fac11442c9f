"""``lesson grade``: returned notebooks, run and marked."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from chutelab.cli.program import RefusedError

if TYPE_CHECKING:
    from rich.console import RenderableType

    from chutelab.grading import Grade

LIMIT = 60.0
"""s that a notebook may run."""


@click.command(short_help="Run returned notebooks and mark them.")
@click.argument(
    "files",
    metavar="FILES...",
    nargs=-1,
    required=True,
    type=click.Path(exists=True, path_type=Path),
)
@click.option(
    "--out",
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the marks into this CSV file, a row for each notebook.",
)
@click.option(
    "--time-limit",
    metavar="S",
    default=LIMIT,
    show_default=True,
    type=click.FloatRange(1.0, 3600.0),
    help="Seconds that a notebook may run.",
)
@click.option("--quiet", "-q", is_flag=True, help="Print no table, and show no progress bar.")
def grade(files: tuple[Path, ...], out: Path | None, time_limit: float, quiet: bool) -> None:
    """Run the exercise notebooks that students returned, and mark each question.

    A folder stands for the notebooks in it. What a student checked is judged anew against the
    numbers that belong to that student's name; what a notebook prints does not count.

    THIS RUNS THE STUDENTS' CODE, with all that you may do on this computer. Grade the notebooks of
    strangers in a container.

    \b
    chutelab lesson grade returned/ --out class.csv
    chutelab lesson grade anna.ipynb ben.ipynb --time-limit 30
    """  # noqa: D301 - click wants the backspace
    from chutelab.cli import console
    from chutelab.cli.output import check_file, writing
    from chutelab.cli.progress import progress
    from chutelab.grading import grade as grade_notebooks
    from chutelab.grading import write_csv

    notebooks = [path for file in files for path in _notebooks(file)]
    check_file("--out", out)
    try:
        with progress("running the notebooks", quiet=quiet) as update:
            grades = grade_notebooks(notebooks, time_limit=time_limit, progress=update)
    except ImportError as error:
        raise RefusedError(str(error)) from error
    if not quiet:
        console.show(_marks(grades))
    if not any(one.marks for one in grades):
        raise RefusedError("nothing to mark: none of these is a notebook of a lesson's exercise")
    if out is not None:
        with writing(f"--out {out}"):
            write_csv(grades, out)
        click.echo(f"wrote {out}")


def _notebooks(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = sorted(path.glob("*.ipynb"))
    if not found:
        raise RefusedError(f"{path}: there is no notebook (*.ipynb) in this folder")
    return found


def _marks(grades: list[Grade]) -> RenderableType:
    from chutelab.cli.report import plain_table

    table = plain_table(["file", "student", "lesson", "marks", "remarks"], texts=5)
    table.columns[0].no_wrap = False
    table.columns[0].overflow = "fold"  # a long path must leave room for the remarks
    for one in grades:
        marks = " ".join(str(mark) for mark in one.marks)
        total = f"{one.total} of {one.out_of} ({marks})" if one.marks else "-"
        table.add_row(one.file, one.student, one.lesson, total, one.reason)
    return table
