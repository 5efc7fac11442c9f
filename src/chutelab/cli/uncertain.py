"""What ``sweep --uncertainty`` does: uncertain inputs in, words, numbers and a picture out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from chutelab.cli.program import RefusedError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from chutelab.design import Uncertainty
    from chutelab.scene import Scene


def propagate(
    scene: Scene,
    given: Sequence[str],
    *,
    samples: int | None,
    seed: int,
    out: Path | None,
    plot: Path | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Propagate uncertain inputs, write what was asked for, and print the rest.

    Parameters
    ----------
    scene : Scene
        Loaded.
    given : sequence of str
        What ``--uncertainty`` was given.
    samples : int or None
        Of each set of points; None is the default.
    out, plot : Path or None
        A CSV file for all samples, and a picture.
    """
    from chutelab.cli import console
    from chutelab.cli.output import PICTURES, check_file, writing
    from chutelab.cli.progress import progress
    from chutelab.design.propagation import SAMPLES, as_dict

    check_file("--out", out, (".csv",))
    check_file("--plot", plot, PICTURES)
    count = SAMPLES if samples is None else samples
    with progress("propagating", quiet=quiet) as meter:
        found = _found(scene, given, count, seed, meter)
    with writing():
        _write(found, out, plot)
    if as_json:
        console.show_json(as_dict(found))
    elif not quiet:
        click.echo(str(found))
        for path in (out, plot):
            if path is not None:
                click.echo(f"wrote {path}")


def _found(
    scene: Scene,
    given: Sequence[str],
    samples: int,
    seed: int,
    meter: Callable[[float], None] | None,
) -> Uncertainty:
    from chutelab.design import DesignError, uncertainty
    from chutelab.variation import VaryError

    try:
        return uncertainty(scene, given, samples=samples, seed=seed, progress=meter)
    except (DesignError, VaryError, ImportError) as error:
        raise RefusedError(str(error)) from error


def _write(found: Uncertainty, out: Path | None, plot: Path | None) -> None:
    if out is not None:
        from chutelab.files import whole

        with whole(out) as unfinished:
            unfinished.write_text(found.csv(), encoding="utf-8")
    if plot is not None:
        from chutelab.plots.design import spread

        spread(found, path=plot)
