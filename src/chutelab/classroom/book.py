"""What a lesson's notebook calls: its machine, its runs, what was predicted beside what came out.

>>> from chutelab.classroom.book import Book
>>> book = Book("the-parabola")
>>> runs = book.run("throw.toml", "throw.toml --set incoming.speed=4")
>>> [round(float(one.events["position"][-1, 0]), 3) for one in runs]
[0.808, 1.615]

A run is said as on the command line, without ``chutelab run``.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from math import isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chutelab.classroom.lessons.reading import Lesson, beside, find, scene_of, unit_in
from chutelab.engines.simulation import simulate
from chutelab.results import Recording
from chutelab.results.comparison import compare, predicted
from chutelab.results.ledger import ledger
from chutelab.results.quantities import measure
from chutelab.results.summary import facts, sheets
from chutelab.scene import Scene
from chutelab.scene.overrides import Override
from chutelab.scene.quantities import lookup, whose
from chutelab.util.errors import InputError
from chutelab.util.tables import Sheet, Shown, number

if TYPE_CHECKING:
    from chutelab.pictures.plots.style import Picture

AT_HAND = "--set", "--engine", "--dt"
"""Options of ``chutelab run`` that a notebook knows, besides ``--details``."""


@dataclass(frozen=True, repr=False)
class Runs(Shown):
    """Runs of a lesson: its quantities side by side, and the summary of each to unfold."""

    lesson: Lesson
    recordings: Mapping[str, Recording]  # by what was said
    details: bool = False

    def __getitem__(self, index: int) -> Recording:
        return list(self.recordings.values())[index]

    def __len__(self) -> int:
        return len(self.recordings)

    def sheet(self) -> Sheet:
        """Return the quantities that the lesson looks at, a column for each run."""
        rows = []
        for name, words in self.lesson.quantities.items():
            unit = unit_in(self.lesson, name)
            values = (number(_value(one, name)) for one in self.recordings.values())
            rows.append((f"{words}, {unit}" if unit else words, *values))
        return Sheet("", ("", *self.recordings), tuple(rows))

    def _repr_html_(self) -> str:
        unfold = ""
        for said, one in self.recordings.items():
            head = escape(facts(one, details=self.details)).replace("\n", "<br>")
            parts = "".join(part.html() for part in sheets(one, details=self.details))
            unfold += f"<details><summary>{escape(said)}: the summary</summary>{head}{parts}"
            unfold += "</details>"
        return self.sheet().html() + unfold


def _value(recording: Recording, name: str) -> float:
    """Return a quantity: the theory's if it was not simulated, such as work until no slip.

    NaN where the scene has none, or one for each of several particles.
    """
    row = lookup(name, recording.scene.surfaces, recording.machine.streams)
    if row is None or whose(row, recording.count):
        return nan
    found = measure(recording, name)
    return predicted(recording.prediction, row) if isnan(found) else found


class Book:
    """A lesson as its notebook has it.

    Parameters
    ----------
    lesson : str or int
        By number or name, as `chutelab.classroom.lessons.find` takes it; "." is that of the folder
        the notebook is in.

    Raises
    ------
    LessonError
        If there is none.
    """

    def __init__(self, lesson: str | int) -> None:
        self._lesson = find(lesson)
        self._runs: dict[str, Recording] = {}
        self._details = False

    def machine(self) -> Picture:
        """Draw the lesson's machine before anything happens."""
        from chutelab.pictures.plots.machinery import draw_bodies, draw_scene
        from chutelab.pictures.plots.scenery import action, window_of
        from chutelab.pictures.plots.style import Picture, dress

        chosen = self._lesson.picture
        recording = simulate(scene_of(self._lesson, chosen.scene, chosen.set))
        figure = Picture((9.0, 5.0))
        axes = dress(figure.add_subplot(), "x, m", "y, m", self._lesson.title)
        draw_scene(axes, recording.machine, window_of(recording))
        # The place of separation is an answer, so it is drawn halfway there.
        released = float(recording.track(0)["t"][0])
        draw_bodies(axes, recording, 0.5 * (released + action(recording)[0]))
        return figure

    def run(self, *said: str) -> Runs:
        """Run scenes of the lesson, each as on the command line: "throw.toml --set gravity=1.62".

        Raises
        ------
        SceneError
            With all faults of a scene and its settings.
        """
        found: dict[str, Recording] = {}
        for one in said:
            scene, settings, details = _read(one)
            found[one] = simulate(scene_of(self._lesson, scene, settings))
            self._details = self._details or details
        self._runs |= found
        return Runs(self._lesson, found, self._details)

    def scene(self, name: str, *settings: str) -> Scene:
        """Load a scene of the lesson, with settings such as "gravity=1.62" laid over it.

        Raises
        ------
        SceneError
            With all faults of the scene and its settings.
        """
        return scene_of(self._lesson, name, settings)

    def file(self, name: str) -> Path:
        """Return where a file of the lesson is.

        Raises
        ------
        InputError
            If it has none of this name.
        """
        if (path := beside(self._lesson, name)) is None:
            raise InputError(f"lesson {self._lesson.name} has no file {name}")
        return path

    def errors(self, runs: Runs) -> Sheet:
        """Return how far off runs are: from the closed form, and in the balance of energy."""
        rows = []
        for said, recording in runs.recordings.items():
            error = compare(recording).max
            residual = f"{ledger(recording).relative_residual:.1e}"
            rows.append((said, "-" if error is None else f"{error:.1e}", residual))
        heads = ("", "largest relative error", "residual, share of the energy turned over")
        return Sheet("", heads, tuple(rows))

    def compare(self, predictions: Mapping[int, Any]) -> Sheet:
        """Return all runs so far side by side, with what was predicted beneath."""
        mine = [f"{n}. {said}" for n, said in predictions.items() if said not in (None, "", ...)]
        head = f"You predicted: {'; '.join(mine)}" if mine else "You wrote down no prediction yet."
        if not self._runs:
            return Sheet("", (), (), notes=(head,))
        sheet = Runs(self._lesson, self._runs).sheet()
        # A row for each run: many columns are hard to read.
        rows = tuple(zip(*[sheet.columns, *sheet.rows], strict=True))
        return Sheet("What came out", rows[0], rows[1:], notes=(head,))

    def landings(self, runs: Runs) -> Picture:
        """Draw where the particles of some runs land, mean, spread, lowest and highest layer."""
        from chutelab.pictures.plots.panels import draw_arrivals
        from chutelab.pictures.plots.style import Picture

        figure = Picture((9.0, 2.2 * len(runs) + 0.8))
        panels = figure.subplots(len(runs), sharex=True, squeeze=False)
        for axes, (said, recording) in zip(panels[:, 0], runs.recordings.items(), strict=True):
            draw_arrivals(axes, recording, said)
        figure.tight_layout()
        return figure

    def live(self) -> Any:
        """Return the lesson's live page as a widget."""
        from chutelab.pictures.live import live

        page = self._lesson.page
        if page is None:
            raise InputError(f"lesson {self._lesson.name} has no page: [page] is not in its plan")
        # The student has predicted already.
        shown = [*page.settings, Override("live.predict", False)]
        return live(scene_of(self._lesson, page.scene, shown))


def _read(said: str) -> tuple[str, list[str], bool]:
    """Return scene and settings of a run that is said as on the command line."""
    name, *words = shlex.split(said)
    settings, details = [], False
    while words:
        option = words.pop(0)
        if option == "--details":
            details = True
        elif option in AT_HAND and words:
            value = words.pop(0)
            settings.append(value if option == "--set" else f"run.{option[2:]}={value}")
        else:
            raise InputError(f"{option}: a notebook knows {', '.join(AT_HAND)} and --details")
    return name, settings, details
