"""What a lesson's notebook calls: its machine, its runs, predictions beside results.

>>> from chutelab.classroom.book import Book
>>> book = Book("the-parabola")
>>> runs = book.run("throw.toml", "throw.toml --set incoming.speed=4")
>>> [round(float(one.events["position"][-1, 0]), 3) for one in runs]
[0.808, 1.615]

A run is written as on the command line, without ``chutelab run``.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from math import isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chutelab.classroom.lessons import Lesson, beside, find, machine_of, scene_of
from chutelab.classroom.lessons.steps import FUNCTIONS, Ask, Column, quantities_in
from chutelab.classroom.lessons.texts import without_tex
from chutelab.engines.simulation import simulate
from chutelab.results import Recording
from chutelab.results.ledger import ledger
from chutelab.results.quantities import compare, measure, predicted
from chutelab.results.summary import facts, sheets
from chutelab.scene import Scene
from chutelab.scene.formulas import of_quantities
from chutelab.scene.overrides import Override
from chutelab.scene.quantities import lookup, whose
from chutelab.util.errors import InputError
from chutelab.util.tables import Sheet, Shown, number
from chutelab.util.words import Words, words

if TYPE_CHECKING:
    from chutelab.pictures.plots.style import Picture

KNOWN = {"__builtins__": {}, "abs": abs, "nan": nan} | {
    name: getattr(math, name) for name in FUNCTIONS if name != "abs"
}
"""Names in formulas of columns, besides quantities."""

AT_HAND = "--set", "--engine", "--dt"
"""Options of ``chutelab run`` that a notebook accepts, besides ``--details``."""


@dataclass(frozen=True, repr=False)
class Runs(Shown):
    """Runs of a lesson: quantities side by side, and the summary of each run to unfold."""

    lesson: Lesson
    recordings: Mapping[str, Recording]  # by the text that was given
    details: bool = False
    noted: Sheet | None = None
    """The table that they fill."""

    def __getitem__(self, index: int) -> Recording:
        return list(self.recordings.values())[index]

    def __len__(self) -> int:
        return len(self.recordings)

    def sheet(self) -> Sheet:
        """Return the quantities that the lesson looks at, a column for each run."""
        if self.noted is not None:
            return self.noted
        rows = []
        for column in self.lesson.columns.values():
            values = (number(value_of(one, column)) for one in self.recordings.values())
            rows.append((_head(column, words(self.lesson.language)), *values))
        return Sheet("", ("", *self.recordings), tuple(rows))

    def _repr_html_(self) -> str:
        unfold = ""
        for said, one in self.recordings.items():
            head = escape(facts(one, details=self.details)).replace("\n", "<br>")
            parts = "".join(part.html() for part in sheets(one, details=self.details))
            unfold += f"<details><summary>{escape(said)}: the summary</summary>{head}{parts}"
            unfold += "</details>"
        return self.sheet().html() + unfold


def _head(column: Column, said: Words) -> str:
    unit = said.unit(column.unit)
    return without_tex(f"{column.head}, {unit}" if unit else column.head)


def value_of(recording: Recording, column: Column) -> float:
    """Return the value of a column for a run; NaN if the machine has no such part."""
    formula = of_quantities(column.value or "nan")
    names = quantities_in(column.value or "nan")
    told = dict.fromkeys(names, nan)
    for name in names:
        row = lookup(name, recording.scene.places, recording.machine.streams)
        if row is not None and not whose(row, recording.count):
            found = measure(recording, name)
            # The theory has what was not simulated, such as work until no slip.
            told[name] = predicted(recording.prediction, row) if isnan(found) else found
    return float(eval(compile(formula, "<column>", "eval"), KNOWN, told))


class Book:
    """A lesson in its notebook.

    Parameters
    ----------
    lesson : str or int
        By number or name, as `chutelab.classroom.lessons.find` takes it; "." is that of the folder
        the notebook is in.
    language : str
        Of its texts.

    Raises
    ------
    LessonError
        If there is none.
    """

    def __init__(self, lesson: str | int, language: str = "en") -> None:
        self._lesson = find(lesson, language)
        self._expected: dict[str, tuple[Ask, Any]] = {}
        self.noted: dict[int, Runs] = {}
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
        # The place of separation is an answer, so the particle is drawn halfway to it.
        released = float(recording.track(0)["t"][0])
        draw_bodies(axes, recording, 0.5 * (released + action(recording)[0]))
        return figure

    def run(self, *said: str) -> Runs:
        """Run scenes of the lesson, each as on the command line: "throw.toml --set gravity=1.62".

        Raises a `SceneError` with all faults of a scene and its settings.
        """
        found: dict[str, Recording] = {}
        for one in said:
            (scene, *rest), settings = shlex.split(one), list[str]()
            while rest:
                option, *rest = rest
                if option == "--details":
                    self._details = True
                elif option in AT_HAND and rest:
                    value, *rest = rest
                    settings.append(value if option == "--set" else f"run.{option[2:]}={value}")
                else:
                    known = f"a notebook knows {', '.join(AT_HAND)} and --details"
                    raise InputError(f"{option}: {known}")
            found[one] = simulate(scene_of(self._lesson, scene, settings))
        return Runs(self._lesson, found, self._details)

    def scene(self, name: str, *settings: str) -> Scene:
        """Load a scene of the lesson, with settings such as "gravity=1.62" laid over it.

        Raises a `SceneError` with all faults of the scene and its settings.
        """
        return scene_of(self._lesson, name, settings)

    def file(self, name: str) -> Path:
        """Return where a file of the lesson is.

        Raises an `InputError` if it has none of this name.
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

    def predict(self, step: int, predictions: Mapping[int, Any]) -> Sheet:
        """Keep what is predicted in a step, by question; `explain` shows it again."""
        asks = self._lesson.steps[step - 1].asks
        kept = {
            without_tex(asks[n - 1].text): (asks[n - 1], said)
            for n, said in predictions.items()
            if said not in (None, "", ...) and 1 <= n <= len(asks)
        }
        self._expected |= kept
        rows = tuple((text, str(said)) for text, (_, said) in kept.items())
        say = words(self._lesson.language).say
        return Sheet("", (say("book-expected"), ""), rows, texts=2)

    def note(self, step: int) -> Runs:
        """Make the runs of a step's table, and fill it in; they are kept in `noted`.

        Raises a `SceneError` with all faults of a scene and its settings.
        """
        one, said = self._lesson.steps[step - 1], words(self._lesson.language)
        rows, found = [], {}
        for n, row in enumerate(one.rows):
            recording = simulate(machine_of(self._lesson, one, row))
            cells = []
            for column in one.columns:
                # Less than a trillionth is rounding.
                value = number(round(value_of(recording, column), 12)) if column.value else ""
                cells.append(said.local(str(column.given[n]) if column.given else value))
            head = without_tex(said.local(row.head))
            found[head] = recording
            rows.append((head, *cells))
        heads = (said.say("sheet-run"), *(_head(column, said) for column in one.columns))
        self.noted[step] = Runs(self._lesson, found, noted=Sheet("", heads, tuple(rows)))
        return self.noted[step]

    def explain(self, step: int) -> Explanation:
        """Return the explanation of a step, and the replies to the predictions."""
        expected, self._expected = self._expected, {}
        return Explanation(self._lesson, expected, self._lesson.steps[step - 1].then)

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

    def live(self, step: int = 1) -> Any:
        """Return the lesson's live page, with the machine of a step, as a widget."""
        from chutelab.pictures.live import live

        page = self._lesson.page
        if page is None:
            raise InputError(f"lesson {self._lesson.name} has no page: [page] is not in its plan")
        # The student has predicted already.
        changed = {**self._lesson.steps[step - 1].set, "live.predict": False}
        shown = [*page.settings, *(Override(key, value) for key, value in changed.items())]
        return live(scene_of(self._lesson, page.scene, shown))


@dataclass(frozen=True, repr=False)
class Explanation:
    """The explanation after a step; a notebook shows it."""

    lesson: Lesson
    expected: Mapping[str, tuple[Ask, Any]]
    then: str

    def __repr__(self) -> str:
        return without_tex(self._repr_markdown_())

    def _repr_markdown_(self) -> str:
        say, lines = words(self.lesson.language).say, []
        for ask, said in self.expected.values():
            lines.append(f"{' '.join(ask.text.split())} {say('book-expected')} **{said}**")
            if ask.choices and isinstance(said, int) and 1 <= said <= len(ask.choices):
                lines[-1] += f" {ask.choices[said - 1]}. *{ask.replies[said - 1]}*"
        return "\n\n".join([*lines, self.then.strip()])
