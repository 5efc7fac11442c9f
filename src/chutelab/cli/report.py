"""A recording's summary as tables for people."""

from __future__ import annotations

from collections import Counter
from math import degrees, isfinite
from typing import TYPE_CHECKING

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from chutelab.accuracy.wanted import Wanted
from chutelab.compare import QUANTITIES, compare
from chutelab.ledger import ledger
from chutelab.recording import REASONS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import RenderableType

    from chutelab.accuracy import Accuracy
    from chutelab.compare import Comparison
    from chutelab.ledger import Ledger
    from chutelab.recording import Recording

WIDTH = 80
"""Columns of a line of prose, at most: a terminal's."""

UNITS = {
    "angle": "°", "time": "s", "length": "m", "speed": "m/s", "energy": "J", "power": "W",
}  # fmt: skip

MEANINGS = {
    "phi1": "angle of separation",
    "t2": "time from there to the plate",
    "x2": "way forward to the plate",
    "y2": "fall to the plate",
    "v2": "speed at the plate",
    "phi2": "angle to the plate, before",
    "phi2r": "angle to the plate, after",
    "v2r": "speed after the impact",
    "t3": "time from there to landing",
    "x3": "way back from the plate",
    "y3": "fall from impact to landing",
    "v3x": "landing velocity, back",
    "v3y": "landing velocity, down",
    "v3": "landing speed",
    "d3": "height of the transfer",
    "dEk": "energy, Eq. (14)",
    "P": "power, Eq. (15)",
    "belt_work": "work of the outgoing belt",
    "slip_heat": "heat of the slip on it",
}


def report(recording: Recording, accuracy: Accuracy | None = None) -> list[RenderableType]:
    """Return what a run leaves to read: particle 0 beside the theory, the ledger, the accuracy."""
    compared = compare(recording)
    parts: list[RenderableType] = [_head(recording)]
    if any(isfinite(value) for value in (*compared.simulated.values(), *compared.theory.values())):
        parts.append(_quantities(compared))
    if compared.reason:
        begun = any(isfinite(value) for value in compared.theory.values())
        ends = "No closed form from here on" if begun else "No closed form"
        parts.append(Text(f"\n{ends}; {compared.reason}"))
    parts += _books(ledger(recording))
    return parts if accuracy is None else [*parts, _reached(accuracy)]


def titled(title: str, table: Table) -> Group:
    """Return a table under its title, which may be wider than the table."""
    return Group(Text(f"\n{title}", style="bold"), table)


def plain_table(columns: Sequence[str], *, texts: int = 1, width: int | None = None) -> Table:
    """Return an empty table: `texts` columns of words, then numbers of at least `width`."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True)
    for index, column in enumerate(columns):
        if index < texts:
            table.add_column(column, no_wrap=index == 0)
        else:
            table.add_column(column, justify="right", min_width=width)
    return table


def wrapped(text: str, width: int) -> list[str]:
    """Return a text in lines of at most `width` characters, broken between words."""
    from textwrap import wrap

    return wrap(text, width, break_on_hyphens=False)


def _head(recording: Recording) -> Text:
    one = recording.count == 1
    counted = Counter(recording.ended.tolist())
    endings = ", ".join(f"{counted[k]} {REASONS[k]}" for k in sorted(counted))
    rounds = "rounds" if recording.engine == "exact" else "steps"
    head = Text(recording.title, style="bold")
    head.append(
        f"\nengine {recording.engine}, {recording.count} particle{'' if one else 's'},"
        f" {recording.contacts} contacts, {recording.steps} {rounds}, {recording.seconds:.3g} s",
        style="not bold",
    )
    head.append(f"\nended: {endings}", style="not bold")
    return head


def _quantities(compared: Comparison) -> Group:
    worst = compared.max
    table = plain_table(["", "", "simulated", "theory", "error"], texts=2)
    for name, kind in QUANTITIES.items():
        simulated, theory = (
            degrees(values[name]) if kind == "angle" else values[name]
            for values in (compared.simulated, compared.theory)
        )
        if not isfinite(simulated) and not isfinite(theory):
            continue
        error = compared.errors.get(name)
        table.add_row(
            name,
            f"{MEANINGS[name]}, {UNITS[kind]}",
            _number(simulated),
            _number(theory),
            "" if error is None else f"{error:.1e}",
        )
    if worst is not None:
        table.add_section()
        table.add_row("max", "largest relative error", "", "", f"{worst:.1e}")
    return titled("Particle 0", table)


def _books(books: Ledger) -> list[RenderableType]:
    table = plain_table(["", "belt work", "restitution loss", "friction loss"])
    for name, entries in books.by_surface.items():
        if any(entries.values()):
            table.add_row(name, *(_number(entry) for entry in entries.values()))
    table.add_section()
    table.add_row(
        "total",
        _number(books.belt_work),
        _number(books.restitution_loss),
        _number(books.friction_loss),
    )
    changes = Text(
        f"\nkinetic {_number(books.kinetic[0])} -> {_number(books.kinetic[1])} J,"
        f" potential {_number(books.potential[0])} -> {_number(books.potential[1])} J\n"
        f"residual {books.residual:.1e} J, {books.relative_residual:.1e} of the"
        f" {_number(books.turned_over)} J turned over"
    )
    return [titled("Energy ledger, J", table), changes]


def _reached(accuracy: Accuracy) -> Text:
    """Say how accurate the run is, and how that is known."""
    wanted = Wanted(accuracy.asked, "m" if accuracy.unit == "m" else "relative")
    what = "relative error" if accuracy.unit == "relative" else "error of places"
    if accuracy.reached is None:
        said = f"cannot be told; asked for {wanted}"
    else:
        found = wanted.written(accuracy.reached)
        said = f"about {found} ({accuracy.worst}); asked for {wanted}"
    text = Text("\nAccuracy\n", style="bold")
    line = f"{what} {said}, {'reached' if accuracy.met else 'NOT REACHED'}"
    text.append("\n".join(wrapped(line, WIDTH)), style="not bold")
    how = f"how it is known: {accuracy.method}"
    text.append("\n" + "\n".join(wrapped(how, WIDTH)), style="not bold")
    return text


def _number(value: float) -> str:
    return f"{value:.6g}" if isfinite(value) else "-"
