"""``bench``: run time against error of a scene, as a table and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from chutelab.cli.console import progress, tell
from chutelab.cli.output import destination
from chutelab.cli.parameters import (
    Count,
    Number,
    json_option,
    loaded_as_told,
    max_seconds_option,
    out_option,
    scene_argument,
    set_option,
)

if TYPE_CHECKING:
    from chutelab.checks.workprecision import Timing
    from chutelab.util.tables import Sheet

METHODS = ("exact", "contact", "pymunk", "fixed")
REPEATS = 9


@click.command(short_help="Measure run time against error of a scene, and draw the diagram.")
@scene_argument
@click.option(
    "--engine",
    "engines",
    type=click.Choice(METHODS),
    multiple=True,
    help="Only this engine; fixed is pymunk with run.align = false. May be repeated.",
)
@click.option(
    "--dt",
    "steps",
    metavar="S",
    type=Number(1e-7, 0.1),
    multiple=True,
    help="A step of the engines that step, in place of the usual ones. May be repeated.",
)
@click.option(
    "--repeats",
    metavar="N",
    type=Count(1, 1000),
    default=REPEATS,
    show_default=True,
    help="Timed runs after the first, at most; fewer of what takes long.",
)
@max_seconds_option(
    60.0, "Leave out what is not measured after S seconds, repeats aside: short steps of crowds."
)
@set_option
@out_option("Write work-precision.tsv and work-precision.png into this folder.")
@json_option("Print one JSON object instead of a table.")
def bench(
    scene: str,
    engines: tuple[str, ...],
    steps: tuple[float, ...],
    repeats: int,
    max_seconds: float,
    overrides: tuple[str, ...],
    out: Path | None,
    as_json: bool,
) -> None:
    """Measure how long each engine takes on SCENE with each step, and how wrong it is.

    SCENE is a scene file or the name of a shipped one. Its run.engine, run.dt and run.align are
    ignored.

    Errors are relative, the largest of all answers of a run, against one that the engine had no
    part in, as with `run --accuracy`: the closed form where it speaks of the whole run, else an
    engine that shares no formula with the first. Of particles that meet, only totals are compared.
    A step may be right by luck, where it happens to end at a contact: look at several. Of many
    particles there are fewer steps, and fixed is left out unless it is asked for. Long steps come
    first; what there is no time for is listed.

    The first run is reported separately from the median of the repeats (what is over in less than
    20 ms runs several times in a row); imports are never timed.

    How to read the diagram: a point is one run with one step, further left is more accurate,
    further down is faster, and both axes count powers of ten. A line is an engine: where it lies
    lower, take that engine for the accuracy you need.
    """
    from chutelab.checks.workprecision import Timing, measure
    from chutelab.util.files import tsv_text
    from chutelab.util.versions import environment, measured_on

    loaded = loaded_as_told(scene, overrides)
    about = environment()
    files = ["work-precision.tsv", "work-precision.png"]
    with destination(out, files) as into:
        with progress("measuring") as update:
            timings = measure(
                loaded, engines, steps, repeats=repeats, max_seconds=max_seconds, progress=update
            )
        if into is not None:
            from chutelab.pictures.plots.studies import workprecision

            text = tsv_text(timings, Timing, {"scene": loaded.title, **about})
            (into / files[0]).write_text(text, encoding="utf-8")
            workprecision(timings, loaded.title, about).write(into / files[1])
    told = {"scene": loaded.title, "environment": about, "records": timings}
    table = _table(loaded.title, timings, measured_on(about))
    wrote = f"wrote into {out}: {', '.join(files)}" if out else ""
    tell(told, table, as_json=as_json, wrote=wrote)


def _table(title: str, timings: Sequence[Timing], measured: str) -> Sheet:
    """Return the table of a scene, why runs failed, how errors are known, and what it ran on."""
    from chutelab.util.tables import Sheet

    rows = [
        (
            "" if before is not None and before.method == one.method else one.method,
            "" if one.value is None else f"{one.value:.0e}",
            duration(one.first),
            duration(one.median),
            "" if one.median is None else str(one.repeats),
            "failed" if one.error is None else f"{one.error:.1e}",
            one.quantity,
        )
        for one, before in zip(timings, [None, *timings], strict=False)
    ]
    heads = ("engine", "dt", "first", "median", "runs", "error", "of")
    notes = [
        f"{one.method} failed{'' if one.value is None else f' at dt {one.value:.0e}'}: {one.failed}"
        for one in timings
        if one.failed
    ]
    for how in dict.fromkeys(one.how for one in timings if one.how):
        methods = dict.fromkeys(one.method for one in timings if one.how == how)
        notes.append(f"error of {', '.join(methods)}: {how}")
    return Sheet(title, heads, tuple(rows), tail=1, notes=(*notes, measured))


def duration(seconds: float | None) -> str:
    """Return a time in three digits, with its unit; "" for none."""
    if seconds is None:
        return ""
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.0f} ns"
