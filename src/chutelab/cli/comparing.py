"""``compare``: measured points over simulation and parabola, and fits to them."""

from __future__ import annotations

import csv
from pathlib import Path

import click

from chutelab.cli.console import progress, tell
from chutelab.cli.output import destination, write_json
from chutelab.cli.parameters import (
    FileName,
    json_option,
    loaded_as_told,
    out_option,
    scene_argument,
    set_option,
)

FILES = ("compare.png", "points.csv", "fit.json")


def _point(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise click.BadParameter(f"{text!r}: two numbers X,Y, such as 320,95.5") from None
    return x, y


@click.command(short_help="Compare measured points with a scene; fit the scene to them.")
@scene_argument
@click.option(
    "--data",
    metavar="FILE",
    required=True,
    type=FileName(),
    help="A table with columns t, x, y, such as Tracker exports, or a shipped track.",
)
@click.option("--track", metavar="NAME", help="Which track, of a file that holds several.")
@click.option(
    "--columns",
    metavar="T,X,Y",
    default="",
    help="Which columns are t, x and y: names or numbers, such as 1,4,5; default: t,x,y.",
)
@click.option(
    "--fps",
    metavar="F",
    type=float,
    help="Frames per second, for a file without times: each line is a frame.",
)
@click.option(
    "--scale",
    metavar="M",
    type=float,
    help="Metres per unit of the file; by default what its header says, else 1.",
)
@click.option(
    "--origin",
    metavar="X,Y",
    default="0,0",
    type=_point,
    help="The origin of the scene, such as the pulley's axis, in the units of the file.",
)
@click.option("--flip-y", is_flag=True, help="y is counted downward in the file, as pixels are.")
@click.option(
    "--t0",
    metavar="S",
    type=float,
    default=0.0,
    help="Time in the file at which the particle is released: t = 0 of the simulation.",
)
@click.option(
    "--fit",
    "fitted",
    metavar="KEYS",
    multiple=True,
    help="Fit these, such as plate.restitution,incoming.speed. May be repeated.",
)
@click.option("--robust", is_flag=True, help="With --fit: give points far off less weight.")
@set_option
@out_option("Write compare.png, points.csv and, with --fit, fit.json into this folder.")
@json_option("Print one JSON object instead of tables.")
def compare(
    scene: str,
    data: str,
    track: str | None,
    columns: str,
    fps: float | None,
    scale: float | None,
    origin: tuple[float, float],
    flip_y: bool,
    t0: float,
    fitted: tuple[str, ...],
    robust: bool,
    overrides: tuple[str, ...],
    out: Path | None,
    as_json: bool,
) -> None:
    """Lay the points of a film over SCENE, and say how far off they are.

    FILE is a table with a line that names its columns t, x and y, such as the video-analysis
    program Tracker exports: tabs, semicolons or commas between cells, decimal points or commas,
    other columns and empty cells do no harm. Of other files --columns says which are t, x and y;
    a file of three columns of numbers needs no names. --fps is for files without times: with
    --columns X,Y every line is a frame, with --columns FRAME,X,Y the first counts them. In the
    world, x = M (x_file - X), and y likewise, with
    --flip-y downward; the clock is t_file - S.

    \b
    chutelab compare perpendicular --data perpendicular-track
    chutelab compare perpendicular --data perpendicular-track \\
        --fit plate.restitution,incoming.speed --out out
    chutelab compare my.toml --data film.txt --scale 0.0021 --origin 312,95 --flip-y --fit t0
    chutelab compare my.toml --data ball.csv --columns "frame,ball x,ball y" --fps 240

    The shipped track perpendicular-track is not a film: it was made from a simulation with
    restitution 0.62 and 1.9 m/s, seen at 120 frames a second with an error of 1 mm in each
    coordinate. So it is known what a fit to it should find.

    --fit takes any number of the scene, which starts at the scene's value and stays within what the
    scene allows, and t0 (which is searched for everywhere), scale, origin.x and origin.y. What the
    points cannot determine is refused by name. The uncertainties are standard deviations, s²
    (JᵀJ)⁻¹ from how the points respond to the parameters (J) and how much they scatter (s): they
    hold if errors are independent and the model is right. Needs pip install "chutelab[fit]".
    """  # noqa: D301 - click wants the backspace
    from rich.console import RenderableType
    from rich.text import Text

    from chutelab.studies import measured
    from chutelab.studies.measured.result import advice, as_dict, points_csv
    from chutelab.util.tables import wrapped

    keys = tuple(key.strip() for value in fitted for key in value.split(","))
    if robust and not keys:
        raise click.UsageError("--robust is for fits: name what to fit with --fit.")
    loaded = loaded_as_told(scene, overrides)
    film = measured.read(
        data, scale=scale, origin=origin, flip_y=flip_y, t0=t0, track=track,
        columns=next(csv.reader([columns], skipinitialspace=True), ()), fps=fps,
    )  # fmt: skip
    with destination(out, FILES) as place:
        with progress("fitting" if keys else "comparing"):
            fit = measured.fit(loaded, film, keys, robust=robust) if keys else None
            found = measured.residuals(loaded, film) if fit is None else fit.after
        if place is not None:
            from chutelab.pictures.plots.studies import measured as draw

            with progress("drawing"):
                draw(found, fit).write(place / "compare.png")
                (place / "points.csv").write_text(points_csv(found), encoding="utf-8")
                if fit is not None:
                    write_json(as_dict(found, fit), place / "fit.json")
    head = Text(found.recording.title, style="bold").append(f"\n{film.said()}", style="not bold")
    parts: list[RenderableType] = [head, found] if fit is None else [head, fit, found]
    if fit is None and (advised := advice(found)):
        parts.append(Text("\n" + "\n".join(wrapped(f"note: {advised}"))))
    names = [name for name in FILES if fit is not None or name != "fit.json"]
    wrote = f"wrote into {out}: {', '.join(names)}" if out else ""
    tell(as_dict(found, fit), *parts, as_json=as_json, wrote=wrote)
