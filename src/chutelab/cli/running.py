"""``run`` and ``check``: what one does with a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from chutelab.cli.parameters import chosen, complete_scene, output_options, set_option
from chutelab.cli.recordings import tell

if TYPE_CHECKING:
    from pathlib import Path

    from chutelab.machine import Machine


@click.command(short_help="Simulate a scene and print a summary; write its files.")
@click.argument("scene", shell_complete=complete_scene)
@click.option(
    "--engine",
    type=click.Choice(["auto", "exact", "pymunk"]),
    help="Same as --set run.engine=...",
)
@click.option("--dt", metavar="S", type=float, help="Same as --set run.dt=S.")
@set_option
@output_options
def run(
    scene: str,
    engine: str | None,
    dt: float | None,
    overrides: tuple[str, ...],
    out: Path | None,
    only: tuple[str, ...] | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Simulate SCENE, a scene file or the name of a shipped one, and print a summary.

    Without --out nothing is written.
    """
    from chutelab.cli.output import destination, write
    from chutelab.cli.progress import progress
    from chutelab.scene import load
    from chutelab.scene.overrides import Setting
    from chutelab.simulation import simulate

    kinds = chosen(out, only)
    settings = list(overrides)
    if engine is not None:
        settings.append(Setting(f"run.engine={engine}", f"--engine {engine}"))
    if dt is not None:
        settings.append(Setting(f"run.dt={dt}", f"--dt {dt:.12g}"))
    loaded = load(scene, settings)
    with destination(out, kinds) as folder:
        with progress("simulating", quiet=quiet) as update:
            recording = simulate(loaded, progress=update)
        if folder is not None:
            write(recording, folder, kinds, quiet=quiet)
    tell(recording, out, kinds, as_json=as_json, quiet=quiet)


@click.command(short_help="Say what would be built, or all that is wrong.")
@click.argument(
    "scenes", metavar="SCENE...", nargs=-1, required=True, shell_complete=complete_scene
)
@set_option
@click.pass_context
def check(ctx: click.Context, scenes: tuple[str, ...], overrides: tuple[str, ...]) -> None:
    """Say what would be built from each SCENE, or all that is wrong with it."""
    from chutelab.machine import build
    from chutelab.scene import SceneError, load

    refused = False
    for name in scenes:
        try:
            machine = build(load(name, overrides))
        except SceneError as error:
            refused = True
            click.echo(f"Error: {error}", err=True)
        else:
            click.echo("\n".join(_described(name, machine)))
    if refused:
        ctx.exit(2)


def _described(name: str, machine: Machine) -> list[str]:
    from chutelab.simulation import choose

    lines = [f"{name}: {machine.title}"]
    segments, ends = machine.segments, machine.segments.end
    for index, surface in enumerate(machine.surfaces):
        for k in (segments.surface == index).nonzero()[0]:
            (x0, y0), (x1, y1) = segments.start[k], ends[k]
            moving = f", moving at {segments.speed[k]:.6g} m/s" if segments.speed[k] else ""
            lines.append(
                f"  {surface}: from ({x0:.6g}, {y0:.6g}) to ({x1:.6g}, {y1:.6g}) m{moving}"
            )
    if machine.pulley is not None:
        lines.append(f"  pulley: radius {machine.pulley.radius:.6g} m, axis at (0, 0)")
    releases, p = machine.releases, machine.particle
    (x, y), (vx, vy) = releases.position[0], releases.velocity[0]
    many = f"{machine.count} particles" if machine.count > 1 else "1 particle"
    lines += [
        f"  {many}: radius {p.radius:.6g} m, mass {p.mass:.6g} kg,"
        f" {'a free disk' if p.inertia else 'not turning'},"
        f" the first from ({x:.6g}, {y:.6g}) m at ({vx:.6g}, {vy:.6g}) m/s",
        f"  engine: {choose(machine)}, until {_ending(machine)}",
    ]
    return [*lines, *(f"  warning: {warning}" for warning in machine.warnings)]


def _ending(machine: Machine) -> str:
    if machine.until == "time":
        return f"t = {machine.end_time:.6g} s"
    return f"{machine.until}, at most to t = {machine.end_time:.6g} s"
