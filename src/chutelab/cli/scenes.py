"""What you need to write a scene, and the paper: seven commands.

``scenes``, ``materials``, ``quantities``, ``schema`` and ``new``; ``tables`` and ``figure``, the
paper's tables and figures as printed beside computed.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from click.shell_completion import CompletionItem

from chutelab.cli import console
from chutelab.cli.console import RefusedError
from chutelab.cli.options import FileName, Folder, beginning, check_file, command, destination
from chutelab.util.files import whole, writing

if TYPE_CHECKING:
    from chutelab.scene.materials import Preset

STANDARD_OUTPUT = Path("-")


@command()
def scenes(*, json_: bool) -> None:
    """List the shipped scenes; `run` takes their names."""
    from chutelab.scene import about
    from chutelab.util.tables import Sheet

    listed = [{**asdict(scene), "path": str(scene.path)} for scene in about()]
    rows = [(s.name, f"{s.title}\n{s.look[0] if s.look else ''}") for s in about()]
    table = Sheet("", ("scene", "what it shows"), tuple(rows), texts=2)
    console.tell({"scenes": listed}, table, as_json=json_)


def complete_material(begun: str) -> list[CompletionItem]:
    """Offer the materials that begin so."""
    from chutelab.scene.materials import PRESETS

    return beginning({name: preset.about for name, preset in PRESETS.items()}, begun)


@command("List the materials of particles: density, bounce, friction.")
def materials(material: Annotated[str | None, complete_material] = None, *, json_: bool) -> None:
    """List the materials that a scene may name, or show MATERIAL alone, to copy and change.

    The density is that of the solid, without the voids of a heap. A coefficient of restitution (how
    much of the normal velocity a blow gives back, 0 to 1) or friction belongs to a pair: each
    material has three, with itself, with steel (plates, chutes) and with the rubber of a belt.

    Behind each number is how far it usually spreads, and its source. Where a result depends on
    one, run both ends of its spread, and measure your own material.

    chutelab materials
    chutelab materials coal
    """
    from chutelab.scene.materials import PRESETS, VALUES
    from chutelab.util.errors import InputError, did_you_mean
    from chutelab.util.tables import Sheet

    if material is not None and material not in PRESETS:
        known = f"there are {', '.join(PRESETS)}"
        raise InputError(did_you_mean(material, PRESETS, known), "material", material)
    shown = list(PRESETS.values()) if material is None else [PRESETS[material]]
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
    console.tell(
        {"materials": told, "sources": list(numbers)}, *tables, as_json=json_, wrote=to_copy
    )


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

    console.say(json.dumps(described(), indent=2))


@command("List the quantities of a run: names, units, meanings.")
def quantities(*, json_: bool) -> None:
    """List the quantities of a run, for [[expect]], solve and sweep, and from Python measure.

    SURFACE is the name of any surface. Of several particles, particles[0].landing.x is that of the
    first one, landing.x.mean the stream's (likewise .spread, .min, .max, and .q02, .q25, .q50,
    .q75, .q98, what so many percent are below), and by_stream.NAME.landing.x.mean that of one
    stream. The ledger counts up to run.until.
    """
    from chutelab.scene.quantities import REGISTRY
    from chutelab.util.tables import Sheet

    keys = ("name", "symbol", "unit", "meaning", "of")
    told = [{key: getattr(row, key) for key in keys} for row in REGISTRY.values()]
    rows = tuple((row.name, row.unit, row.meaning) for row in REGISTRY.values())
    listed = Sheet("Quantities of a run", ("", "", ""), rows, texts=3)
    console.tell({"quantities": told}, listed, as_json=json_)


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
        console.say(template(), end="")
        return
    check_file("", path)
    if path.exists() and not force:
        raise RefusedError(f"{path} is there already; --force overwrites it.")
    with writing(str(path)), whole(path) as unfinished:
        unfinished.write_text(template(), encoding="utf-8")
    console.say(f"wrote {path}; run it with: chutelab run {path}")


@command("Compute the paper's tables anew, beside what is printed.")
def tables(
    number: Literal["1", "3", "4", "5"] | None = None,
    *,
    as_printed: bool = True,
    json_: bool,
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
    console.tell({"tables": told}, *found, as_json=json_)


@command("Draw the paper's figures again, as printed and corrected.")
def figure(number: int, *, out: Folder, json_: bool) -> None:
    """Compute Figure 6, 7, 8, 9, 11, 12 or 13 of the paper anew.

    Side by side: what follows from Eq. (9) as the paper prints it, and what follows from it
    corrected; and in words what the misprint does to the figure's conclusion. What the paper's text
    does not give is said, not guessed.

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
            from chutelab.pictures.plots.figure import paper_figure

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
    console.tell({"figure": found.number, **told}, found, as_json=json_, wrote=wrote)
