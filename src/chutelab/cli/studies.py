"""``sweep``, ``solve``, ``compare``, ``discharge``, ``field``: variants, film, formulas, fields."""

from __future__ import annotations

import csv
from contextlib import ExitStack
from functools import partial
from math import inf
from pathlib import Path
from typing import Annotated, Literal

import click
from click.shell_completion import CompletionItem

from chutelab.cli import console
from chutelab.cli.console import RefusedError, progress, tell
from chutelab.cli.options import (
    PICTURES,
    Command,
    Count,
    Engine,
    FileName,
    Folder,
    Jobs,
    Repeat,
    SceneName,
    Seconds,
    Texts,
    beginning,
    check_file,
    command,
    destination,
    limits,
    loaded_as_told,
    retitled,
    targets,
    uncertain,
    varied,
    write_json,
)
from chutelab.util.errors import InputError
from chutelab.util.files import csv_lines, write_lines, writing


def complete_column(begun: str) -> list[CompletionItem]:
    """Offer the columns of a sweep that begin with a text."""
    from chutelab.scene.quantities import COLUMNS

    return beginning({name: row.meaning for name, row in COLUMNS.items()}, begun)


class _Listing(Command):
    """A command whose help ends with the columns of a sweep."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the columns; the registry is loaded for this help only."""
        from chutelab.scene.quantities import COLUMNS
        from chutelab.scene.units import with_unit

        with formatter.section("Columns"):
            formatter.write_dl(
                [(n, with_unit(row.meaning, row.unit)) for n, row in COLUMNS.items()]
            )


@command("Simulate many variants of a scene; a row for each.", cls=_Listing)
def sweep(
    scene: SceneName,
    *,
    vary: Texts,
    uncertainty: Texts,
    sample: int | None,
    design: Literal["lhs", "sobol"] = "lhs",
    seed: int = 0,
    engine: Engine,
    set_: Texts,
    out: Path | None,
    resume: bool,
    plot: Path | None,
    of: Annotated[str, complete_column] = "landing.vx.mean",
    repeat: Repeat = 1,
    jobs: Jobs = 1,
    scheduler: str | None,
    json_: bool,
    quiet: bool,
) -> None:
    """Simulate all variants of SCENE and write a row of results for each.

    A variant that is impossible, or misses the outgoing belt, is a row with its reason. Finished
    rows are kept beside --out FILE until all are finished. --resume continues an interrupted sweep,
    and writes the same file as one without interruption. It refuses rows that were changed
    meanwhile, and a file that another sweep is writing.

    The columns are the varied keys, those listed below, in SI units, touches (the surfaces that
    particles touch, in order, up to the landing; repeated bounces on one surface count once) and
    reason (why numbers are missing). Maps are hatched where no particle meets the plate.

    With --uncertainty, there are also statistics for each sequence of touched surfaces. A stream
    that misses the plate in half of all cases has two kinds of outcome, and the mean over both may
    be near to neither.

    The ledger counts up to run.until, by default the landing, so it leaves out slip after that. Use
    --set run.until=settled to include it. belt_work and slip_heat, in chutelab solve and with
    --uncertainty, always include it.

    With --repeat columns are means over the seeds, NAME.error is the standard error of NAME, and
    pictures have error bars.

    chutelab sweep stream --vary plate.angle_deg=0:40:5 --repeat 12 --jobs 0 --plot angle.png

    --vary KEY=FROM:TO:COUNT  A key of the scene and its values, such as plate.angle_deg=0:60:61 or
        incoming.speed=2,4. May be repeated: all combinations are simulated.
    --uncertainty KEY=VALUE±SPREAD  Instead of --vary: an uncertain key, such as
        plate.restitution=0.5±0.05, where 0.05 is the standard deviation (with :uniform at the end
        the half-width). The result is the uncertainty of landing and belt work, for each kind of
        outcome, and which key contributes most.
    --sample N  Draw N samples from ranges, --vary KEY=FROM:TO, instead of a grid.
    --design  How samples are drawn: a Latin hypercube, or Sobol points.
    --seed  Seed of the samples. [default]
    --out FILE  Write all rows into this file, .csv or .parquet.
    --resume  Continue an interrupted sweep with the same --out.
    --plot FILE  Draw one or two varied keys into this file: lines, or a heat map.
    --of COLUMN  What to draw. [default]
    --json  Print one JSON object with all columns.
    -q, --quiet  Print no summary and no progress bar.
    """
    from chutelab.studies.sweep import (
        COLUMNS,
        LostWorkersError,
        crew,
        no_column,
        planned,
        sweep_to,
        swept_by,
    )

    wrote = "\n".join(f"wrote {path}" for path in (out, plot) if path is not None)
    if bool(vary) == bool(uncertainty):
        raise click.UsageError("Give either --vary, what to vary, or --uncertainty.")
    if scheduler is not None and jobs != 1:
        raise click.UsageError("--jobs and --scheduler: give one of them.")
    if resume and out is None:
        raise click.UsageError("--resume goes on with the file of --out: give --out too.")
    if uncertainty:
        if resume or scheduler is not None or jobs != 1 or repeat != 1:
            raise click.UsageError(
                "--resume, --repeat, --jobs and --scheduler go with --vary only."
            )
        from chutelab.studies.design.uncertainty import SAMPLES, as_dict
        from chutelab.studies.design.uncertainty import uncertainty as propagate

        loaded = loaded_as_told(scene, set_, engine)
        check_file("--out", out, (".csv",))
        check_file("--plot", plot, PICTURES)
        samples = SAMPLES if sample is None else sample
        with progress("propagating", quiet=quiet) as meter:
            given = uncertain(uncertainty)
            spread = propagate(loaded, given, samples=samples, seed=seed, progress=meter)
        with writing():
            if out is not None:
                write_lines(out, [spread.csv()])
            if plot is not None:
                from chutelab.pictures.plots.studies import spread as draw

                draw(spread).write(plot)
        tell(as_dict(spread), spread, as_json=json_, quiet=quiet, wrote=wrote)
        return
    loaded = loaded_as_told(scene, set_)
    if of not in COLUMNS:
        raise RefusedError(f"--of {no_column(of)}")
    variations = varied(vary, ranges=sample is not None)
    check_file("--plot", plot, PICTURES)
    check_file("--out", out)
    try:
        plan = planned(
            loaded, variations, sample=sample, design=design, seed=seed, engine=engine,
            repeat=repeat,
        )  # fmt: skip
        several = sum(len(set(one.values)) > 1 for one in plan.varies)
        if plot is not None and several > 2:
            raise RefusedError(f"--plot draws one or two varied keys, not {several}")
        what = f"{plan.count:,} variants"
        with ExitStack() as stack:
            if scheduler:
                import logging

                # Dask logs tracebacks; one message here says what failed.
                stack.callback(logging.disable, logging.root.manager.disable)
                logging.disable()
            team = stack.enter_context(crew(jobs, scheduler))
            update = stack.enter_context(progress(what, quiet=quiet, left=True))
            if out is None:
                found = swept_by(plan, team, progress=update)
            else:
                found = sweep_to(plan, out, team, resume=resume, progress=update)
    except LostWorkersError as error:
        raise click.ClickException(". ".join(filter(None, (str(error), _kept(out))))) from error
    except KeyboardInterrupt:
        if said := _kept(out):
            console.say(f"\n{said}", err=True)
        raise
    if plot is not None:
        from chutelab.pictures.plots.studies import sweep_figure

        with writing(f"--plot {plot}"):
            sweep_figure(found, of).write(plot)
    told = {"scene": found.title, "variants": len(found), "columns": found.columns}
    tell(told, found, as_json=json_, quiet=quiet, wrote=wrote)


def _kept(out: Path | None) -> str:
    """Say where the finished rows are, if there are some."""
    from chutelab.studies.sweep.part import part_of

    if out is None or not part_of(out).exists():
        return ""
    return f"{part_of(out)} has the finished rows; --resume goes on."


SOLVED = ("overlay.png", "scan.png", "solution.toml", "nearest.toml", "solve.json")
"""What ``--out`` may write: scan.png with one key, nearest.toml if there is no solution."""


@command("Find the angle, speed, distance ... that does what you want.")
def solve(
    scene: SceneName,
    *,
    vary: Texts,
    target: Texts,
    minimize: str | None,
    maximize: str | None,
    subject_to: Texts,
    repeat: Repeat | None,
    deviations: float = 0.0,
    points: int | None,
    seed: int = 0,
    jobs: Jobs = 1,
    scheduler: str | None,
    max_seconds: Seconds | None,
    set_: Texts,
    out: Folder,
    json_: bool,
    quiet: bool,
) -> None:
    r"""Change SCENE until a quantity has the value wanted, or is as small or as large as it can be.

    chutelab solve inclined-20 --vary plate.angle_deg=0:80 --target landing.vx=1
    chutelab solve inclined-20 --vary plate.angle_deg=0:80 --minimize belt_work
    chutelab solve inclined-20 --vary plate.angle_deg=20:60 \
        --vary plate.restitution=0.1:0.9 --target landing.vx=1 --target landing.x=0.3

    Quantities are those of `chutelab quantities`, such as landing.x, x3, belt_work or
    ledger.by_surface.plate.restitution_loss. With several particles a name also says which one is
    meant: particles[0].landing.x is that of the first particle, landing.x.mean and
    arrival.vx.spread are those of all. Belt work decreases as particles land faster, and is
    negative above the belt's speed; slip_heat is least at the belt's speed.

    With one key all solutions in its range are found, and jumps are not taken for solutions. If
    there is no solution, the variant nearest to one is shown, and the exit code is 1. It needs pip
    install "chutelab[design]".

    --target together with --minimize finds the best of all solutions. --subject-to sets limits on
    other quantities.

    chutelab solve inclined-20 --vary plate.angle_deg=0:60 \
        --vary incoming.speed=1:3 --target landing.vx=1 --minimize landing.t
    chutelab solve stream --vary plate.angle_deg=0:40 --maximize arrival.vx.mean \
        --subject-to "arrival.share>=0.95" --jobs 0

    Where particles meet, each variant runs with 8 seeds, the same for all. The answer has a
    standard error, and no more digits than that error allows. Only one solution is given then.
    After --max-seconds, or Ctrl-C, the search stops and gives the best answer so far.

    --vary KEY=FROM:TO  A key of the scene and the range to search, such as plate.angle_deg=0:80.
        May be repeated. [required]
    --target QUANTITY=VALUE  The value wanted: VALUE is a number, with or without unit, a key of the
        scene or another quantity. May be repeated with as many --vary.
    --minimize QUANTITY  Make this as small as possible.
    --maximize QUANTITY  Make this as large as possible.
    --subject-to LIMIT  QUANTITY>=VALUE or QUANTITY<=VALUE, such as "arrival.share>=0.95": a limit
        that an answer has to keep. May be repeated.
    --repeat N  Run each variant with N seeds; default: 8 where particles meet, else 1.
    --deviations K  With several seeds: minimize the mean plus K standard deviations of one run, or
        maximize the mean minus K of them. [default]
    --points N  With one --vary: the number of values tried first; default: 181. With several seeds:
        the most variants; default: 96.
    --seed N  With several --vary or seeds: the seed of the search's random draws. [default]
    --max-seconds S  Stop the search after S seconds and give the best answer so far.
    --out DIR  Write the overlay at the answer, the scene there, a picture of the search and its
        numbers into this folder.
    -q, --quiet  Print no answer and no progress bar.
    """
    from rich.text import Text

    from chutelab.engines.simulation import simulate
    from chutelab.scene import to_toml
    from chutelab.studies import design
    from chutelab.studies.design.answers import as_dict
    from chutelab.studies.sweep import crew
    from chutelab.util.signals import answer

    if (minimize and maximize) or not (target or minimize or maximize):
        raise click.UsageError(
            "Give --target, --minimize or --maximize, or --target and one of the others."
        )
    if scheduler is not None and jobs != 1:
        raise click.UsageError("--jobs and --scheduler: give one of them.")
    loaded = loaded_as_told(scene, set_)
    written, interrupted = [], None
    with destination(out, SOLVED) as place:
        with ExitStack() as meter_and_team:
            meter = meter_and_team.enter_context(progress("searching", quiet=quiet))
            team = meter_and_team.enter_context(crew(jobs, scheduler))
            search = partial(design.solve, target=targets(target))
            if target:
                search = partial(search, minimize=minimize, maximize=maximize)
            elif minimize or maximize:
                kind = design.minimize if minimize else design.maximize
                search = partial(kind, quantity=str(minimize or maximize))
            try:
                found = search(
                    loaded, varied(vary, ranges=True), subject_to=limits(subject_to),
                    repeat=repeat, deviations=deviations, points=points, seed=seed, team=team,
                    max_seconds=inf if max_seconds is None else max_seconds, progress=meter,
                )  # fmt: skip
            except KeyboardInterrupt as error:
                if not hasattr(error, "solution"):
                    raise
                found, interrupted = error.solution, error
                answer()
        if place is not None:
            from chutelab.pictures.plots import overlay
            from chutelab.pictures.plots.studies import scan

            with progress("drawing", quiet=quiet):
                write_json(as_dict(found), place / "solve.json")
                if found.scan is not None or found.outcomes is not None:
                    scan(found).write(place / "scan.png")
                if found.solved or found.nearest:
                    values = zip(found.ranges, found.answer.values, strict=True)
                    told = [f"{one.key}={value:.4g}" for one, value in values]
                    at = retitled(found.scene, told)
                    outcome = "solution" if found.solved else "no solution, the nearest to one"
                    name = "solution.toml" if found.solved else "nearest.toml"
                    text = to_toml(at, f"{found.asked}: {outcome}.")
                    (place / name).write_text(text, encoding="utf-8")
                    overlay(simulate(at), path=place / "overlay.png")
            written = sorted(file.name for file in place.iterdir())
    title = Text(found.base.title, style="bold")
    wrote = f"\nwrote into {out}: {', '.join(written)}" if out else ""
    tell(as_dict(found), title, *found.sheets(), as_json=json_, quiet=quiet, wrote=wrote)
    if interrupted is not None:
        raise interrupted
    if not found.solved:
        click.get_current_context().exit(1)


STRESS = 0.01
"""s; bins of lasting contacts for ``field`` if the scene gives none."""

COMPARED = ("compare.png", "points.csv", "fit.json")


@command("Compare measured points with a scene; fit the scene to them.")
def compare(
    scene: SceneName,
    *,
    data: Annotated[str, FileName()],
    track: str | None,
    columns: str = "",
    fps: float | None,
    scale: float | None,
    origin: str = "0,0",
    flip_y: bool,
    t0: float = 0.0,
    fit: Texts,
    robust: bool,
    set_: Texts,
    out: Folder,
    json_: bool,
) -> None:
    r"""Compare the points of a film with SCENE: draw both, and print the differences.

    FILE is a table with a line that names its columns t, x and y, as the video-analysis program
    Tracker exports it. It may have tabs, semicolons or commas between cells, decimal points or
    commas, other columns, and empty cells. For other files --columns says which columns are t, x
    and y; a file of three columns of numbers needs no names. --fps is for files without times: with
    --columns X,Y every line is a frame, with --columns FRAME,X,Y the first column counts frames. A
    point of the file is at x = M (x_file - X), y likewise (downward with --flip-y), at the time
    t_file - S, with --scale M, --origin X,Y and --t0 S.

    chutelab compare perpendicular --data perpendicular-track
    chutelab compare perpendicular --data perpendicular-track \
        --fit plate.restitution,incoming.speed --out out
    chutelab compare my.toml --data film.txt --scale 0.0021 --origin 312,95 --flip-y --fit t0
    chutelab compare my.toml --data ball.csv --columns "frame,ball x,ball y" --fps 240

    The shipped track perpendicular-track is not a film: it was made from a simulation with
    restitution 0.62 and 1.9 m/s, at 120 frames a second with an error of 1 mm in each coordinate.
    So the right result of a fit is known.

    --fit takes numbers of the scene, and t0, scale, origin.x and origin.y. A number of the scene
    starts at the scene's value and stays in the range that the scene allows; t0 is searched over
    all times. Parameters that the points cannot determine are refused by name. The uncertainties
    are standard deviations, from the covariance s² (JᵀJ)⁻¹ with the sensitivities J of the points
    and their scatter s. They hold if errors are independent and the model is right. Needs pip
    install "chutelab[fit]".

    --data FILE  A table with columns t, x, y, such as Tracker exports, or a shipped track.
        [required]
    --track NAME  Which track, of a file that holds several.
    --columns T,X,Y  Which columns are t, x and y: names or numbers, such as 1,4,5; default: t,x,y.
    --fps F  Frames per second, for a file without times: each line is a frame.
    --scale M  Metres per unit of the file; by default what its header says, else 1.
    --origin X,Y  The origin of the scene, such as the pulley's axis, in the units of the file.
    --flip-y  y is counted downward in the file, as pixels are.
    --t0 S  Time in the file at which the particle is released: t = 0 of the simulation.
    --fit KEYS  Fit these, such as plate.restitution,incoming.speed. May be repeated.
    --robust  With --fit: give points far off less weight.
    --out DIR  Write compare.png, points.csv and, with --fit, fit.json into this folder.
    """
    from rich.console import RenderableType
    from rich.text import Text

    from chutelab.studies import measured
    from chutelab.studies.measured.result import advice, as_dict, points_csv
    from chutelab.util.tables import wrapped

    keys = tuple(key.strip() for value in fit for key in value.split(","))
    if robust and not keys:
        raise click.UsageError("--robust is for fits: name what to fit with --fit.")
    try:
        x, y = map(float, origin.split(","))
    except ValueError:
        said = f"{origin!r}: two numbers X,Y, such as 320,95.5"
        raise click.BadParameter(said, param_hint="'--origin'") from None
    loaded = loaded_as_told(scene, set_)
    film = measured.read(
        data, scale=scale, origin=(x, y), flip_y=flip_y, t0=t0, track=track,
        columns=next(csv.reader([columns], skipinitialspace=True), ()), fps=fps,
    )  # fmt: skip
    with destination(out, COMPARED) as place:
        with progress("fitting" if keys else "comparing"):
            fitted = measured.fit(loaded, film, keys, robust=robust) if keys else None
            found = measured.residuals(loaded, film) if fitted is None else fitted.after
        if place is not None:
            from chutelab.pictures.plots.measures import measured as draw

            with progress("drawing"):
                draw(found, fitted).write(place / "compare.png")
                (place / "points.csv").write_text(points_csv(found), encoding="utf-8")
                if fitted is not None:
                    write_json(as_dict(found, fitted), place / "fit.json")
    head = Text(found.recording.title, style="bold").append(f"\n{film.said()}", style="not bold")
    parts: list[RenderableType] = [head, found] if fitted is None else [head, fitted, found]
    if fitted is None and (advised := advice(found)):
        parts.append(Text("\n" + "\n".join(wrapped(f"note: {advised}"))))
    names = [name for name in COMPARED if fitted is not None or name != "fit.json"]
    wrote = f"wrote into {out}: {', '.join(names)}" if out else ""
    tell(as_dict(found, fitted), *parts, as_json=json_, wrote=wrote)


@command("Compare engineers' discharge methods with the simulated stream.")
def discharge(
    scene: SceneName, *, heights: str = "", set_: Texts, out: Folder, json_: bool
) -> None:
    """Compare the stream that leaves SCENE's pulley, by five methods, with the simulated one.

    Only the incoming belt, its particles and its first stream are simulated; the particles fly
    freely. The table gives edges and centre of the stream at heights above the pulley's axis; the
    picture shows all streams.

    The methods: point, the mass point of the paper; cema; booth, which has slip; golka, with a
    path for each edge; korzen, with air drag. Those of M.H.E.A., Goodyear and Dunlop are left out,
    as their rules are not known well enough.

    chutelab discharge slip
    chutelab discharge stream --set incoming.friction=0.6 --heights 0,-0.5,-1 --out out

    --heights Y,Y,...  Heights above the pulley's axis, m; default: 0,-0.2,-0.4,-0.6,-0.8,-1.
    --out DIR  Write discharge.png and discharge.json into this folder.
    """
    from rich.text import Text

    from chutelab.studies.discharge import HEIGHTS, side_by_side

    try:
        wanted = [float(part) for part in heights.split(",")] if heights else HEIGHTS
    except ValueError:
        raise InputError(f"{heights!r}: must be numbers such as 0,-0.5,-1", "--heights") from None
    loaded = loaded_as_told(scene, set_)
    names = ("discharge.png", "discharge.json")
    with destination(out, names) as place:
        with progress("simulating") as update:
            found = side_by_side(loaded, wanted, progress=update)
        if place is not None:
            from chutelab.pictures.plots.studies import discharge_figure

            with progress("drawing"):
                discharge_figure(found).write(place / names[0])
            write_json(found.as_dict(), place / names[1])
    wrote = f"wrote into {out}: {', '.join(names)}" if out else ""
    title = Text(found.scene.title, style="bold")
    tell(found.as_dict(), title, found.sheet(), as_json=json_, wrote=wrote)


@command("Compute density, velocity, temperature and stress of a crowd on a grid.")
def field(
    scene: SceneName,
    *,
    of: Texts,
    between: str = "",
    width: float | None,
    cell: float | None,
    samples: Annotated[int, Count(1)] = 50,
    vtk: bool,
    set_: Texts,
    engine: Engine,
    out: Folder,
    json_: bool,
) -> None:
    """Run SCENE, and describe its particles as a continuum: fields on a grid.

    Coarse graining: each particle is spread by Lucy's kernel, which ends at its width, and the
    fields are means over a window of time. The table has the least, mean and largest value of each
    field; pictures show them on the machine. The fields are density, vx, vy, speed, temperature
    (granular), pressure, sxx, sxy, syx, syy (stress; compression is negative). Stress has parts
    from fluctuations, from impacts and, in the contact engine, from lasting contacts, recorded in
    bins of run.stress (0.01 s if the scene gives none). Other engines leave out lasting contacts;
    the table says which share of all impulses they are.

    chutelab field hopper --between 0.6,1 --of speed --of density --out out
    chutelab field stream --width 4cm --cell 5mm --vtk --out out

    --of FIELD  Which field to draw; default: speed. May be repeated.
    --between T,T  The window of time, s; default: all of the run.
    --width M  Where the kernel ends, m; default: three mean diameters.
    --cell M  Edge of a cell, m; default: a quarter of the width.
    --samples N  Number of times in the window at which tracks are sampled. [default]
    --vtk  With --out: also fields.vti, for ParaView; needs pip install "chutelab[vtk]".
    --out DIR  Write a picture of each field asked for, and fields.csv, into this folder.
    """
    from rich.text import Text

    from chutelab.engines.simulation import simulate
    from chutelab.results.fields import NAMES, fields, need_vtk

    wanted = dict.fromkeys(of or ("speed",))
    for name in wanted:
        if name not in NAMES:
            raise InputError(f"one of {', '.join(NAMES)}", "--of", name)
    if (of or vtk) and out is None:
        raise click.UsageError("--of and --vtk are for files: give --out DIR too.")
    if vtk:
        need_vtk()
    try:
        window = [float(part) for part in between.split(",")] if between else [None, None]
        begin, end = window
    except ValueError:
        raise InputError("two times such as 0.5,1.2, in s", "--between", between) from None
    loaded = loaded_as_told(scene, set_, engine)
    names = [*(f"field-{name}.png" for name in wanted), "fields.csv", *["fields.vti"] * vtk]
    with destination(out, names) as place:
        with progress("simulating") as update:
            bins = {"run.stress": loaded.run.stress or STRESS}
            recording = simulate(loaded, bins, progress=update)
        with progress("spreading"):
            found = fields(recording, begin, end, samples=samples, width=width, cell=cell)
        if place is not None:
            from chutelab.pictures.plots.measures import field as draw

            for name in wanted:
                draw(recording, found, name).write(place / f"field-{name}.png")
            write_lines(place / "fields.csv", csv_lines(found.rows()))
            if vtk:
                found.write_vtk(place / "fields.vti")
    wrote = f"wrote into {out}: {', '.join(names)}" if out else ""
    title = Text(recording.title, style="bold")
    tell(found.as_dict(), title, found.sheet(), as_json=json_, wrote=wrote)
