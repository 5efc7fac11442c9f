"""``check``, ``verify`` and ``stress``: is a scene, an answer, a run to be trusted."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import partial
from itertools import chain

import click

from chutelab.cli.console import progress, say, tell
from chutelab.cli.parameters import (
    complete_scene,
    dt_option,
    engine_option,
    jobs_option,
    json_option,
    loaded_as_told,
    max_seconds_option,
    scene_argument,
    set_option,
)


@click.command(short_help="Look at a scene before it runs, or say all that is wrong.")
@click.argument(
    "scenes", metavar="SCENE...", nargs=-1, required=True, shell_complete=complete_scene
)
@set_option
@json_option()
def check(scenes: tuple[str, ...], overrides: tuple[str, ...], as_json: bool) -> None:
    """Look at each SCENE before it runs, or say all that is wrong with it.

    Says what will be built and what is skipped, which engine runs and why, what a run will cost in
    time and memory, what the closed form covers, and for each warning what to change: surfaces that
    cross, a plate that leaves a crowd less than three grains above the belt, a box that is filled
    through walls, a bed that rides a slow belt by adhesion. What a run costs comes from a trial of
    the whole of it, cut off after 1 s: the cost of longer ones is estimated from how far it got, or
    not given.
    """
    from chutelab.checks.preflight import Preflight, preflight
    from chutelab.scene import SceneError, load
    from chutelab.util.tables import plain

    refused = False
    found: dict[str, Preflight] = {}
    for name in scenes:
        try:
            found[name] = preflight(load(name, overrides))
        except SceneError as error:
            refused = True
            say(f"Error: {error}", err=True)
    looks = [{"scene": name, **plain(look)} for name, look in found.items()]
    titled = (replace(look, title=f"{name}: {look.title}") for name, look in found.items())
    tell({"scenes": looks}, *titled, as_json=as_json)
    if refused:
        click.get_current_context().exit(2)


@click.command(short_help="Check what scenes promise; compare independent answers.")
@click.argument("scenes", metavar="[SCENE]...", nargs=-1, shell_complete=complete_scene)
@max_seconds_option(300.0, "Leave out an answer that takes longer than S seconds.")
@jobs_option(0, "Spread the scenes over N processes")
@json_option()
def verify(scenes: tuple[str, ...], max_seconds: float, jobs: int, as_json: bool) -> None:
    """Check what each SCENE is expected to show (default: all shipped ones).

    Every [[expect]] of a scene is looked at on each engine that can run it, and in the theory.
    Then theory, exact, contact, pymunk and, where SciPy is installed, its DOP853 are compared on
    its particle 0, taken alone. Exit code 1 if an error is larger than its tolerance.
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
            "agreement": [
                {**plain(row), "pair": row.pair.split(", "), "holds": row.holds}
                for row in answer.agreements
            ],
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
        as_json=as_json,
        wrote="Errors and tolerances are relative where they have no unit.\n"
        + (f"{failures} outside the tolerance" if failures else "all within the tolerance"),
    )
    if failures:
        click.get_current_context().exit(1)


@click.command(short_help="Run a scene and judge it by laws that every run must keep.")
@scene_argument
@engine_option
@dt_option
@set_option
@json_option()
def stress(
    scene: str, engine: str | None, dt: float | None, overrides: tuple[str, ...], as_json: bool
) -> None:
    """Run SCENE and judge the run by laws that it must keep, whatever the scene.

    No particle passes a surface, sinks into one or bounces off nothing; energy rises only by a
    belt's work; ledger and momentum close. Each law that has something to say about the scene is a
    line, with what was found and what it must not exceed. What the engine does not promise for such
    a scene is listed with the reason. Exit code 1 if a law is broken. For scenes of disks without
    strings.
    """
    from chutelab.checks.stress import Evidence, judge, need_judged
    from chutelab.engines.simulation import judged
    from chutelab.results.recorder import StalledError
    from chutelab.util.tables import Sheet, plain

    loaded = loaded_as_told(scene, overrides, engine, dt)
    need_judged(loaded)
    try:
        with progress("simulating") as update:
            recording = judged(loaded, progress=update)
    except StalledError as stalled:
        raise click.ClickException(str(stalled)) from stalled
    run = Evidence(recording)
    found = judge(run)
    broken = sum(one.broken for one in found)
    about = {"scene": scene, "title": recording.title, "engine": run.engine, "dt": run.dt}
    laws = [{"law": one.law, **plain(one), "holds": one.holds} for one in found]
    rows = []
    for one in found:
        kept = "ok" if one.holds else "FAILED" if one.broken else "-"
        said = "; not promised: ".join(filter(None, [one.detail, one.unpromised]))
        rows.append((kept, one.law, f"{one.figure:.2g}", f"{one.bound:.2g}", said))
    steps = "" if run.dt is None else f", steps of {run.dt:.4g} s"
    title = f"{recording.title}\nengine {run.engine}{steps}"
    table = Sheet(title, ("", "law", "figure", "bound", ""), tuple(rows), texts=2, tail=1)
    unpromised = sum(bool(one.unpromised) for one in found)
    verdict = f"all {len(found)} laws kept"
    if broken:
        verdict = f"{broken} of {len(found)} laws broken"
    elif unpromised:
        verdict = f"{len(found) - unpromised} laws kept, {unpromised} not promised"
    tell({**about, "broken": broken, "laws": laws}, table, as_json=as_json, wrote=verdict)
    if broken:
        click.get_current_context().exit(1)
