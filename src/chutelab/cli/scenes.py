"""Commands for writing scenes, for checking scenes and runs, and for the paper's tables.

``scenes``, ``materials``, ``quantities``, ``schema`` and ``new``; ``check``, ``verify``, ``stress``
and ``bench``; ``tables`` and ``figure``, the paper's as printed beside computed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import click
from click.shell_completion import CompletionItem

from chutelab.cli.console import RefusedError, progress, say, tell
from chutelab.cli.options import (
    Count,
    Engine,
    FileName,
    Folder,
    Number,
    SceneName,
    Seconds,
    Texts,
    beginning,
    check_file,
    command,
    complete_scene,
    destination,
    loaded_as_told,
)
from chutelab.util.files import whole, writing

if TYPE_CHECKING:
    from chutelab.checks.workprecision import Timing
    from chutelab.scene.materials import Preset
    from chutelab.util.tables import Sheet

STANDARD_OUTPUT = Path("-")


@command()
def scenes(*, json_: bool) -> None:
    """List the shipped scenes; `run` takes their names."""
    from chutelab.scene import about
    from chutelab.util.tables import Sheet

    listed = [{**asdict(scene), "path": str(scene.path)} for scene in about()]
    rows = [(s.name, f"{s.title}\n{s.look[0] if s.look else ''}") for s in about()]
    table = Sheet("", ("scene", "what it shows"), tuple(rows), texts=2)
    tell({"scenes": listed}, table, as_json=json_)


def complete_material(begun: str) -> list[CompletionItem]:
    """Offer the materials that begin with a text."""
    from chutelab.scene.materials import presets

    return beginning({name: preset.about for name, preset in presets().items()}, begun)


@command("List the materials of particles: density, bounce, friction.")
def materials(material: Annotated[str | None, complete_material] = None, *, json_: bool) -> None:
    """List the materials that a scene may name, or show MATERIAL alone, to copy and change.

    The density is that of the solid, without the voids of a heap. Restitution (the share of the
    normal velocity that an impact gives back, 0 to 1) and friction are coefficients of a pair. Each
    material has three of each: with itself, with steel (plates, chutes) and with the rubber of a
    belt.

    Each number has its usual range and its source. If a result depends on one, run both ends of the
    range, and measure your own material.

    chutelab materials
    chutelab materials coal
    """
    from chutelab.scene.materials import VALUES, presets
    from chutelab.util.errors import InputError, did_you_mean
    from chutelab.util.tables import Sheet

    if material is not None and material not in presets():
        known = f"there are {', '.join(presets())}"
        raise InputError(did_you_mean(material, presets(), known), "material", material)
    shown = list(presets().values()) if material is None else [presets()[material]]
    texts = dict.fromkeys(text for one in shown for row in one.sources.values() for text in row)
    numbers = {text: number for number, text in enumerate(texts, 1)}
    notes = tuple(f"[{number}] {text}" for text, number in numbers.items())
    told = [
        {
            "about": one.about,
            "material": one.material.model_dump(),
            "spread": one.spread,
            "sources": {key: [numbers[text] for text in row] for key, row in one.sources.items()},
        }
        for one in shown
    ]

    def said(one: Preset, key: str) -> tuple[str, str]:
        digits = "g" if key == "density" else ".2f"
        low, high = one.spread[key]
        return f"{getattr(one.material, key):{digits}}", f"{low:{digits}}-{high:{digits}}"

    def cited(one: Preset, *keys: str) -> str:
        cited = {numbers[text] for key in keys for text in one.sources[key]}
        return " ".join(map(str, sorted(cited)))

    if material is None:
        rows = [
            (one.material.name, one.about, *said(one, "density"), cited(one, "density"))
            for one in shown
        ]
        heads: tuple[str, ...] = ("", "", "kg/m³", "spread", "source")
        tables = [Sheet("Materials, and their density", heads, tuple(rows), texts=2, tail=1)]
        heads = ("", "with itself", "with steel", "with rubber", "source")
        for kind, symbol in (("restitution", "ε"), ("friction", "µ")):
            keys = (kind, f"{kind}_steel", f"{kind}_rubber")
            cells = (["  ".join(said(one, key)) for key in keys] for one in shown)
            pairs = [
                (one.material.name, *found, cited(one, *keys))
                for one, found in zip(shown, cells, strict=True)
            ]
            last = notes if kind == "friction" else ()
            title = f"Coefficient of {kind} {symbol}"
            tables.append(Sheet(title, heads, tuple(pairs), tail=1, notes=last))
        to_copy = ""
    else:
        (one,) = shown
        values = [
            (f"{key}, kg/m³" if key == "density" else key, *said(one, key), cited(one, key))
            for key in VALUES
        ]
        heads = ("", "value", "usual spread", "source")
        tables = [Sheet(f"{material}: {one.about}", heads, tuple(values), tail=1, notes=notes)]
        to_copy = TO_COPY.format(name=material) + "\n".join(
            f"{key} = {getattr(one.material, key)!r}" for key in VALUES
        )
    tell({"materials": told, "sources": list(numbers)}, *tables, as_json=json_, wrote=to_copy)


TO_COPY = """
In a scene:

[particle]
material = "{name}"

Or with what you measured, as material = "my-{name}":

[[material]]
name = "my-{name}"
"""


@command("Print the JSON Schema of scene files, for editors.")
def schema(*, run: bool) -> None:
    """Print the JSON Schema of scene files, for editors that complete them.

    --run  Print that of `chutelab run --json` instead.
    """
    if run:
        from chutelab.results.summary import schema as described
    else:
        from chutelab.scene import schema as described

    say(json.dumps(described(), indent=2))


@command("List the quantities of a run: names, units, meanings.")
def quantities(*, json_: bool) -> None:
    """List the quantities of a run, for [[expect]], solve and sweep, and from Python measure.

    SURFACE is the name of any surface, SENSOR that of any sensor. With several particles,
    particles[0].landing.x is that of the first particle, and landing.x.mean the mean over all.
    Other statistics are .spread (the standard deviation), .min, .max, and the quantiles .q02, .q25,
    .q50, .q75 and .q98. by_stream.NAME.landing.x.mean is the mean over one stream. The ledger
    counts up to run.until.
    """
    from chutelab.scene.quantities import REGISTRY
    from chutelab.util.tables import Sheet

    keys = ("name", "symbol", "unit", "meaning", "of")
    told = [{key: getattr(row, key) for key in keys} for row in REGISTRY.values()]
    rows = tuple((row.name, row.unit, row.meaning) for row in REGISTRY.values())
    listed = Sheet("Quantities of a run", ("", "", ""), rows, texts=3)
    tell({"quantities": told}, listed, as_json=json_)


@command("Write a complete, commented scene to start from.")
def new(
    path: Annotated[Path, FileName(path_type=Path, allow_dash=True)] = Path("scene.toml"),
    *,
    force: bool,
) -> None:
    """Write a complete, commented scene to start from (scene.toml, or PATH; - prints it).

    --force  Overwrite a file that is there.
    """
    from chutelab.scene import template

    if path == STANDARD_OUTPUT:
        say(template(), end="")
        return
    check_file("", path)
    if path.exists() and not force:
        raise RefusedError(f"{path} is there already; --force overwrites it.")
    with writing(str(path)), whole(path) as unfinished:
        unfinished.write_text(template(), encoding="utf-8")
    say(f"wrote {path}; run it with: chutelab run {path}")


@command("Compute the paper's tables anew, beside what is printed.")
def tables(
    number: Literal["1", "3", "4", "5"] | None = None, *, as_printed: bool = True, json_: bool
) -> None:
    """Compute Table 1, 3, 4 or 5 of the paper anew (all of them without NUMBER).

    Each cell holds the printed number, then the computed one, marked with * where it differs in a
    printed digit.

    --as-printed / --corrected  Compute with Eq. (9) as the paper prints it (the default here), or
        corrected.
    """
    from chutelab.theory import table

    rebound: Literal["as-printed", "corrected"] = "as-printed" if as_printed else "corrected"
    found = [table(int(n), rebound) for n in ([number] if number else "1345")]
    told = [{**asdict(t), "cells": t.cells, "differing": t.differing} for t in found]
    tell({"tables": told}, *found, as_json=json_)


@command("Draw the paper's figures again, as printed and corrected.")
def figure(number: int, *, out: Folder, json_: bool) -> None:
    """Compute Figure 6, 7, 8, 9, 11, 12 or 13 of the paper anew.

    It shows side by side what follows from Eq. (9) as the paper prints it, and from the corrected
    equation, and says what the misprint does to the figure's conclusion. Values that are missing in
    the paper's text are listed, with those used instead.

    chutelab figure 6
    chutelab figure 6 --out out

    --out DIR  Write the picture, its numbers and its scenes into this folder.
    """
    from chutelab.scene import to_toml
    from chutelab.theory.figures import figure as compute

    found = compute(number)
    picture, numbers = f"figure-{found.number}.png", f"figure-{found.number}.csv"
    files = {f"{name}.toml": to_toml(scene, found.title) for name, scene in found.scenes.items()}
    files[numbers] = found.csv()
    with destination(out, [picture, *files]) as place:
        if place is not None:
            from chutelab.pictures.plots import paper_figure

            paper_figure(found).write(place / picture)
            for name, text in files.items():
                (place / name).write_text(text, encoding="utf-8")
    wrote = "" if out is None else f"\nwrote into {out}: {', '.join(sorted([picture, *files]))}"
    if wrote and found.sweep:
        wrote += (
            "\nThe corrected side with the engine, where landing.vx and landing.vy are -v3x and"
            f" -v3y: {found.sweep}"
        )
    told = {key: getattr(found, key) for key in ("title", "meaning", "missing", "columns")}
    tell({"figure": found.number, **told}, found, as_json=json_, wrote=wrote)


@command("Check a scene before it runs: errors, time, memory, warnings.")
def check(scenes: Annotated[Texts, complete_scene], *, set_: Texts, json_: bool) -> None:
    """Check each SCENE before it runs; list all errors.

    For a scene without errors it says what is built and what is skipped, which engine runs and why,
    how much time and memory a run takes, what the closed form covers, and for each warning what to
    change. There are warnings, for example, for surfaces that cross, a moving surface that passes
    through another, a plate that leaves a crowd less than three grains above the belt, a box that
    is filled through walls, and a bed that rides a slow belt by adhesion.

    Time and memory are measured in a trial run, which is stopped after 1 s. For longer runs they
    are estimated from how much of the run the trial covered, or are not given. The additional cost
    of loads, sensors and wear is measured in the same way.
    """
    from chutelab.checks.preflight import Preflight, preflight
    from chutelab.scene import SceneError, load
    from chutelab.util.tables import plain

    refused = False
    found: dict[str, Preflight] = {}
    for name in scenes:
        try:
            found[name] = preflight(load(name, set_))
        except SceneError as error:
            refused = True
            say(f"Error: {error}", err=True)
    looks = [{"scene": name, **plain(look)} for name, look in found.items()]
    titled = (replace(look, title=f"{name}: {look.title}") for name, look in found.items())
    tell({"scenes": looks}, *titled, as_json=json_)
    if refused:
        click.get_current_context().exit(2)


@command("Check what scenes promise; compare independent answers.")
def verify(
    scenes: Annotated[Texts, complete_scene] = (),
    *,
    max_seconds: Seconds = 300.0,
    jobs: Annotated[int, Count(min=0)] = 0,
    json_: bool,
) -> None:
    """Check what each SCENE is expected to show (default: all shipped ones).

    Each [[expect]] of a scene is checked on each engine that can run the scene, and in the theory.
    Then the answers of theory, exact, contact, pymunk and, if SciPy is installed, its DOP853 are
    compared for particle 0 alone. The exit code is 1 if an error is larger than its tolerance.

    --max-seconds S  Leave out an answer that takes longer than S seconds. [default]
    --jobs N  Spread the scenes over N processes; 0, the default, is one for each processor.
    """
    from chutelab.checks import agreement
    from chutelab.scene import load, shipped
    from chutelab.studies.sweep import crew
    from chutelab.util.tables import Sheet, plain

    loaded = {name: load(name) for name in scenes or shipped()}
    work = partial(agreement.verify, max_seconds=max_seconds)
    answered: dict[int, agreement.Verification] = {}
    with (
        progress("verifying") as update,
        crew(min(len(loaded), jobs or os.cpu_count() or 1)) as team,
    ):
        for number, answer in team.results(work, enumerate(loaded.values())):
            answered[number] = answer
            if update is not None:
                update(len(answered) / len(loaded))
    found = {name: answered[number] for number, name in enumerate(loaded)}
    failures = sum(answer.failures for answer in found.values())
    answers = [
        {
            "scene": name,
            "title": loaded[name].title,
            "expectations": [{**plain(row), "holds": row.holds} for row in answer.findings],
            "agreement": [{**plain(row), "holds": row.holds} for row in answer.agreements],
            "skipped": answer.skipped,
        }
        for name, answer in found.items()
    ]
    shares = {name: shared for name, (_, shared) in agreement.ANSWERS.items()}
    rows = tuple((name, *told) for name, told in agreement.ANSWERS.items())
    common = Sheet("What the answers have in common", ("", "", ""), rows, texts=3)
    both = (found[name].sheets(f"{name}: {loaded[name].title}") for name in found)
    tell(
        {"failures": failures, "shares": shares, "scenes": answers},
        *chain.from_iterable(both),
        common,
        as_json=json_,
        wrote="Errors and tolerances are relative where they have no unit.\n"
        + (f"{failures} outside the tolerance" if failures else "all within the tolerance"),
    )
    if failures:
        click.get_current_context().exit(1)


@command("Run a scene and judge it by laws that every run must keep.")
def stress(scene: SceneName, *, engine: Engine, dt: float | None, set_: Texts, json_: bool) -> None:
    """Run SCENE and judge the run by laws that it must keep, whatever the scene.

    No particle passes a surface, sinks into one or bounces where there is no surface; energy rises
    only by drives; ledger and momentum close. Each law that applies to the scene is a line,
    with the value found and its bound. Laws that the engine does not promise for such a scene are
    listed with the reason. The exit code is 1 if a law is broken.
    """
    from chutelab.checks.stress import Evidence, judge
    from chutelab.engines.simulation import judged
    from chutelab.results.recorder import StalledError
    from chutelab.util.tables import Sheet, plain

    loaded = loaded_as_told(scene, set_, engine, dt, loads=1000.0)
    try:
        with progress("simulating") as update:
            recording = judged(loaded, progress=update)
    except StalledError as stalled:
        raise click.ClickException(str(stalled)) from stalled
    run = Evidence(recording)
    found = judge(run)
    broken = sum(one.broken for one in found)
    about = {"scene": scene, "title": recording.title, "engine": recording.engine, "dt": run.dt}
    laws = [{"law": one.law, **plain(one), "holds": one.holds} for one in found]
    rows = []
    for one in found:
        kept = "ok" if one.holds else "FAILED" if one.broken else "-"
        said = "; not promised: ".join(filter(None, [one.detail, one.unpromised]))
        rows.append((kept, one.law, f"{one.figure:.2g}", f"{one.bound:.2g}", said))
    steps = "" if run.dt is None else f", steps of {run.dt:.4g} s"
    title = f"{recording.title}\nengine {recording.engine}{steps}"
    table = Sheet(title, ("", "law", "figure", "bound", ""), tuple(rows), texts=2, tail=1)
    unpromised = sum(bool(one.unpromised) for one in found)
    verdict = f"all {len(found)} laws kept"
    if broken:
        verdict = f"{broken} of {len(found)} laws broken"
    elif unpromised:
        verdict = f"{len(found) - unpromised} laws kept, {unpromised} not promised"
    tell({**about, "broken": broken, "laws": laws}, table, as_json=json_, wrote=verdict)
    if broken:
        click.get_current_context().exit(1)


@command("Measure run time against error of a scene, and draw the diagram.")
def bench(
    scene: SceneName,
    *,
    engine: tuple[Literal["exact", "contact", "pymunk", "fixed"], ...],
    dt: Annotated[tuple[float, ...], Number(1e-7, 0.1)],
    repeats: Annotated[int, Count(1, 1000)] = 9,
    max_seconds: Seconds = 60.0,
    set_: Texts,
    out: Folder,
    json_: bool,
) -> None:
    """Measure how long each engine takes on SCENE with each step, and how wrong it is.

    SCENE is a scene file or the name of a shipped one. Its run.engine, run.dt and run.align are
    ignored.

    Errors are relative: the largest of all results of a run, compared with an independent answer as
    with `run --accuracy`. That is the closed form if it covers the whole run, else an engine that
    shares no formula with the first. For particles that meet, only totals are compared. A single
    step may be exact by chance, because it ends at a contact: look at several steps. With many
    particles there are fewer steps, and fixed is left out unless it is asked for. Long steps run
    first; those for which there is no time are listed.

    The first run is reported separately from the median of the repeats. Runs of less than 20 ms are
    repeated in a row, and their mean counts. Imports are never timed.

    How to read the diagram: each point is a run with one step. Further left is more accurate,
    further down is faster, and both axes count powers of ten. Each line is an engine. For the
    accuracy you need, choose the engine with the lowest line.

    --engine  Only this engine; fixed is pymunk with run.align = false. May be repeated.
    --dt S  A step of the engines with time steps, instead of the usual ones. May be repeated.
    --repeats N  Most timed runs after the first; long runs have fewer. [default]
    --max-seconds S  Leave out steps that are not measured after S seconds, without the repeats:
        these are short steps of crowds. [default]
    --out DIR  Write work-precision.tsv and work-precision.png into this folder.
    """
    from chutelab.checks.workprecision import Timing, environment, measure, measured_on
    from chutelab.util.files import tsv_text

    loaded = loaded_as_told(scene, set_)
    about = environment()
    files = ["work-precision.tsv", "work-precision.png"]
    with destination(out, files) as into:
        with progress("measuring") as update:
            timings = measure(
                loaded, engine, dt, repeats=repeats, max_seconds=max_seconds, progress=update
            )
        if into is not None:
            from chutelab.pictures.plots.studies import workprecision

            text = tsv_text(timings, Timing, {"scene": loaded.title, **about})
            (into / files[0]).write_text(text, encoding="utf-8")
            workprecision(timings, loaded.title, about).write(into / files[1])
    told = {"scene": loaded.title, "environment": about, "records": timings}
    table = _table(loaded.title, timings, measured_on(about))
    wrote = f"wrote into {out}: {', '.join(files)}" if out else ""
    tell(told, table, as_json=json_, wrote=wrote)


def _table(title: str, timings: Sequence[Timing], measured: str) -> Sheet:
    """Return the table of a scene, with notes: failures, how errors are known, the machine."""
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
