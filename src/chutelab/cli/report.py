"""A recording's summary for people, in a terminal."""

from __future__ import annotations

from rich.console import RenderableType
from rich.text import Text

from chutelab.results import Recording
from chutelab.results.report import facts, sheets
from chutelab.studies.accuracy import Accuracy, written
from chutelab.util.tables import wrapped


def report(
    recording: Recording, accuracy: Accuracy | None = None, *, details: bool = False
) -> list[RenderableType]:
    """Return what a run leaves to read: particle 0 beside the theory, the ledger, the accuracy.

    With `details` also the engine and its steps, and errors down to rounding.
    """
    head = Text(recording.title, style="bold")
    head.append(f"\n{facts(recording, details=details)}", style="not bold")
    parts: list[RenderableType] = [head, *sheets(recording, details=details)]
    if accuracy is not None:
        what = "relative error" if accuracy.unit == "relative" else "error of places"
        said = "cannot be told"
        if accuracy.reached is not None:
            said = f"about {written(accuracy.reached, accuracy.unit)} ({accuracy.worst})"
        met = "reached" if accuracy.met else "NOT REACHED"
        found = wrapped(f"{what} {said}; asked for {written(accuracy.asked, accuracy.unit)}, {met}")
        how = wrapped(f"how it is known: {accuracy.method}")
        parts += [Text("\nAccuracy", style="bold"), Text("\n".join([*found, *how]))]
    return parts
