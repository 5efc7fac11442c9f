"""A recording's summary as tables for people."""

from __future__ import annotations

from collections import Counter

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from chutelab.machine.releases import Squeeze
from chutelab.results import REASONS, Kind, Recording
from chutelab.results.comparison import compare
from chutelab.results.ledger import ledger
from chutelab.results.quantities import Rolling, Waits, rolling, squeezed, waits
from chutelab.studies.accuracy import Accuracy, Wanted
from chutelab.util.tables import Sheet, number, wrapped

STATIONS = 6
"""Contacts of particle 0 that are listed where no theory speaks of them."""


def report(recording: Recording, accuracy: Accuracy | None = None) -> list[RenderableType]:
    """Return what a run leaves to read: particle 0 beside the theory, the ledger, the accuracy."""
    compared = compare(recording).sheet()
    parts: list[RenderableType] = [_head(recording), compared]
    if compared.notes and (way := _way(recording)).rows:
        parts.append(way)
    parts.append(ledger(recording))
    if (late := waits(recording)) is not None:
        parts.append(Text("\n" + "\n".join(wrapped(_waited(late)))))
    if (pressed := squeezed(recording)) is not None:
        parts.append(Text("\n" + "\n".join(wrapped(_squeezed(pressed)))))
    if (left := rolling(recording)) is not None:
        parts.append(Text("\n" + "\n".join(wrapped(_rolling(left)))))
    return parts if accuracy is None else [*parts, _reached(accuracy)]


def _way(recording: Recording) -> Sheet:
    """Return where and when particle 0 touched or left something first, as no theory says it."""
    own = recording.events[recording.events["particle"] == 0]
    own = own[np.isin(own["kind"], [Kind.SEPARATION, Kind.IMPACT, Kind.LANDING])][:STATIONS]
    rows = []
    for event in own:
        name = recording.surfaces[event["surface"]]
        what = "leaves" if event["kind"] == Kind.SEPARATION else "meets"
        numbers = (event["t"], *event["position"], *event["velocity_before"])
        rows.append((f"{what} {name}", *(number(float(value)) for value in numbers)))
    heads = ("", "t, s", "x, m", "y, m", "vx, m/s", "vy, m/s")
    return Sheet("Particle 0, its first contacts", heads, tuple(rows))


def _head(recording: Recording) -> Text:
    one = recording.count == 1
    counted = Counter(recording.ended.tolist())
    endings = ", ".join(f"{counted[k]} {REASONS[k]}" for k in sorted(counted))
    rounds = "rounds" if recording.engine == "exact" else "steps"
    head = Text(recording.title, style="bold")
    head.append(
        f"\nengine {recording.engine}, {recording.count} particle{'' if one else 's'},"
        f" {recording.contacts} contact{'' if recording.contacts == 1 else 's'},"
        f" {recording.steps} {rounds}, {recording.seconds:.3g} s",
        style="not bold",
    )
    head.append(f"\nended: {endings}", style="not bold")
    return head


def _waited(late: Waits) -> str:
    """Say how many found their place taken, and how long."""
    said = []
    if late.particles:
        waited = "1 particle" if late.particles == 1 else f"{late.particles} particles"
        said.append(
            f"{waited} waited for a free place to be released, {number(late.longest)} s at most"
            f" and {number(late.mean)} s on average"
        )
    if late.never:
        said.append(f"{late.never} found no free place until the end")
    return "; ".join(said) + "."


def _squeezed(pressed: Squeeze) -> str:
    """Say how many ride into each other, how deep and why."""
    return (
        f"{pressed.particles} particles rode into others round the pulley,"
        f" {number(pressed.deepest)} m deep at most: adhesion carries all layers at one speed, the"
        f" lower ones on smaller circles, and v²/(g rho) = {pressed.grip:.3g} keeps the highest"
        " there past the top."
    )


def _rolling(left: Rolling) -> str:
    """Say that free disks roll on the outgoing belt, and what carrying them would have cost."""
    disks = "1 disk rolls" if left.particles == 1 else f"{left.particles} disks roll"
    return (
        f"{disks} on the outgoing belt: nothing slips, and nothing is carried along. The belt has"
        f" paid {number(left.belt_work)} J, loads that are carried take"
        f" {number(left.belt_work_carried)} J (a disk that arrives"
        " without turning takes a third of a carried load's work)."
    )


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
    text.append("\n".join(wrapped(line)), style="not bold")
    how = f"how it is known: {accuracy.method}"
    text.append("\n" + "\n".join(wrapped(how)), style="not bold")
    return text
