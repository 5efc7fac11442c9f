"""A report on a scene: inputs and results, for clients and for students.

The engineer's view has all of it: drawing, inputs with their sources, assumptions and what they
leave out, results, envelope, loads, power beside ISO 5048 and DIN 22101, wear, sensitivities, and
how to make it again. The teacher's view is the skeleton of a lab report, with empty boxes. It is
written as Markdown with pictures, and printed like lessons. Its quantities are those of the
registry.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, Literal

import numpy as np
from markdown_it.tree import SyntaxTreeNode

from chutelab.classroom.lessons.sheets import need_typst, pdf, web_page
from chutelab.classroom.lessons.texts import parser
from chutelab.engines.simulation import judged, simulate
from chutelab.pictures.plots import look, overlay
from chutelab.pictures.plots.measures import drawing
from chutelab.pictures.plots.measures import loads as draw_loads
from chutelab.pictures.plots.measures import wear as draw_wear
from chutelab.results import Recording
from chutelab.results.loads import sheet as load_sheet
from chutelab.results.quantities import compare, measure
from chutelab.results.stream import crowd
from chutelab.results.summary import NOTES, facts
from chutelab.results.wear import KEYS, touched
from chutelab.scene import AnyScene, Overrides, Scene, load, to_dict
from chutelab.scene.materials import presets
from chutelab.scene.overrides import Override, parts_of, unit_of
from chutelab.scene.quantities import lookup
from chutelab.studies.repeats import Repeats, repeat
from chutelab.theory.discharge import loading
from chutelab.util.errors import InputError
from chutelab.util.files import csv_lines, own_version, whole, write_lines
from chutelab.util.tables import Sheet, number, plus_minus, sentence
from chutelab.util.words import Words
from chutelab.util.words import words as words_of

View = Literal["engineer", "teacher"]

LOADS: Final = 0.01
"""s; bins of loads if the scene gives none."""

MOST: Final = 26
"""Rows of the table of inputs, at most; the scene file has the rest."""

BUDGET: Final = 30.0
"""s of computing for sensitivities, at most."""

CHANGED: Final = 0.01
"""Share by which a key is changed, up and down, for its sensitivity; angles by so many radians."""

ROUNDING: Final = 1e-9
"""Share of a result; smaller changes of it are reported as none."""

TURNED: Final = (
    "incoming.speed", "incoming.pulley_radius", "plate.angle_deg", "plate.restitution",
    "plate.distance", "outgoing.speed", "outgoing.drop", "outgoing.friction", "particle.radius",
)  # fmt: skip
"""Keys whose sensitivities are reported, if the scene has them."""

TOLD: Final = (
    "landing.x", "landing.vx", "landing.vy", "impact.t", "ledger.power", "power",
    "ledger.restitution_loss", "ledger.friction_loss", "loads.plate.normal.peak",
    "loads.plate.normal.mean", "loads.outgoing.normal.mean", "misses",
)  # fmt: skip
"""Quantities of results, sensitivities and the skeleton, if the scene has them."""


@dataclass
class Report:
    """A report: its Markdown, its tables, and its pictures by their names."""

    scene: Scene
    recording: Recording
    repeats: Repeats | None
    view: View
    command: str
    words: Words
    parts: list[str] = field(default_factory=list)
    tables: dict[str, Sheet] = field(default_factory=dict)
    pictures: dict[str, Any] = field(default_factory=dict)

    @property
    def markdown(self) -> str:
        """The whole text; pictures are files of their names, with .png."""
        return "\n\n".join(self.parts) + "\n"

    def add(self, title: str, *parts: str) -> None:
        """Add a section, if there is anything in it."""
        if said := [part for part in parts if part]:
            self.parts += [f"## {title}", *said]

    def table(self, name: str, sheet: Sheet) -> str:
        """Keep a table, and return it as Markdown with its notes."""
        if not sheet.rows:
            return ""
        self.tables[name] = sheet
        width = len(sheet.columns)
        lines = [sheet.columns, ("---",) * width, *sheet.rows, *sheet.foot]
        # Only cells that a student fills in are empty, and have room.
        empty = "" if name == "values" else "–"
        made = ""
        for n, row in enumerate(lines):
            cells = (_plain(cell.replace("\n", ", ")).replace("|", "/") for cell in row)
            filled = [cell or empty * bool(n) for cell in (*cells, *[""] * (width - len(row)))]
            made += f"| {' | '.join(filled)} |\n"
        said = " ".join(f"{_plain(sentence(note))}." for note in sheet.notes)
        return f"{made}\n{said}".rstrip()

    def picture(self, name: str, figure: Any, said: str) -> str:
        """Keep a picture, and return the Markdown that shows it."""
        self.pictures[name] = figure
        return f"![{said}]({name}.png)"

    def write(self, path: Path) -> list[Path]:
        """Write the report, .pdf or .html, and its tables as CSV into a folder beside it."""
        with TemporaryDirectory() as made:
            folder = Path(made)
            for name, figure in self.pictures.items():
                figure.savefig(folder / f"{name}.png", dpi=150)
            tree = SyntaxTreeNode(parser().parse(self.markdown))
            asked = [
                item
                for node in tree.children
                if self.view == "teacher" and node.type == "ordered_list"
                for item in node.children
            ]
            if path.suffix.lower() == ".pdf":
                kind = self.words.say("lab-kind") if self.view == "teacher" else "Report"
                language = self.words.language
                content = pdf(tree, folder, asked, kind=kind, language=language, dense=True)
            else:
                page = web_page(
                    tree, folder, asked, self.words.language, dense=self.view != "teacher"
                )
                content = page.encode("utf-8")
        with whole(path) as unfinished:
            unfinished.write_bytes(content)
        home = path.with_name(f"{path.stem}-tables")
        home.mkdir(exist_ok=True)
        return [
            path,
            *(
                write_lines(home / f"{name}.csv", csv_lines([one.columns, *one.rows, *one.foot]))
                for name, one in self.tables.items()
            ),
        ]


def _plain(text: str) -> str:
    """Return a text with Markdown's markup escaped."""
    return re.sub(r"([\\`*_$\[\]<>#])", r"\\\1", text.rstrip("."))


def report(
    scene: AnyScene,
    changes: Overrides = (),
    *,
    view: View = "engineer",
    runs: int = 1,
    engine: str | None = None,
    command: str = "",
    language: str = "en",
) -> Report:
    """Run a scene and report on it.

    Parameters
    ----------
    scene, changes
        As `chutelab.simulate` takes them; loads have bins of 0.01 s unless the scene gives them.
    view : {"engineer", "teacher"}
        The whole report, or the skeleton of a lab report.
    runs : int
        Number of seeds for results as mean ± standard error; 1 for the scene's own seed only.
    engine : str, optional
        Overrides ``run.engine``.
    command : str
        The command that makes the report again, printed in it.
    language : str
        Of the teacher's view, such as "de"; the engineer's is in English.

    Raises
    ------
    InputError
        If the view does not exist in the language.
    """
    if language != "en" and view != "teacher":
        raise InputError("the engineer's view is in English, en", "language", language)
    loaded = load(scene, changes)
    if loaded.run.loads is None:
        loaded = load(loaded, [Override("run.loads", LOADS)])
    recording = judged(loaded, engine=engine)
    repeats = repeat(loaded, runs) if runs > 1 else None
    made = Report(loaded, recording, repeats, view, command, words_of(language))
    title = made.words.title(loaded.title)
    made.parts.append(f"# {_plain(title)}")
    with look(language=language):
        (_for_students if view == "teacher" else _for_engineers)(made)
    return made


def _for_engineers(made: Report) -> None:
    recording, many = made.recording, made.recording.count > 1
    said = facts(recording, details=True).split(", computed in")[0].replace("\n", "; ")
    made.parts.append(f"Simulated with chutelab {own_version()}: {_plain(said)}.")
    if recording.laws:
        broken = "; ".join(str(law) for law in recording.laws)
        made.parts.append(f"**The run breaks laws; do not use its numbers:** {_plain(broken)}.")
    made.add("The machine", made.picture("machine", drawing(recording), "The machine, to scale"))
    made.add("Inputs", made.table("inputs", inputs(made.scene, made.words)), materials(made))
    made.add("Assumptions, and what is left out", "\n".join(f"- {one}" for one in left_out(made)))
    together, balance = crowd(recording), made.table("ledger", recording.ledger.sheet())
    made.add("Results", made.table("results", results(made)), balance)
    made.add("Sensitivity", made.table("sensitivity", sensitivities(made)))
    if together is None:
        made.add("Beside the theory", made.table("theory", compare(recording).sheet()))
    else:
        figure = made.picture("stream", overlay(recording), "Envelope, flow and energies")
        made.add("The stream", made.table("crowd", together.sheet()), figure)
    if (borne := load_sheet(recording)) is not None:
        shown = made.picture("loads", draw_loads(recording), "Loads over time") if many else ""
        made.add("Loads", made.table("loads", borne), shown)
    if (paid := power(recording)) is not None:
        made.add("Power at the loading point", made.table("power", paid))
    shown = made.picture("wear", draw_wear(recording, curves=many), "Where it wears")
    made.add("Wear", made.table("wear", wear(recording)), shown)
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    command = f"`{made.command}`; " if made.command else ""
    made.add(
        "How to make it again",
        f"{command}chutelab {own_version()}, Python {python}, NumPy {np.__version__}. The same"
        " scene, seed and engine give the same bits. All tables are beside this report as CSV.",
    )


def _for_students(made: Report) -> None:
    recording, scene, say = made.recording, made.scene, made.words.say
    made.parts.append(say("lab-name"))
    made.add(say("lab-machine"), made.picture("machine", drawing(recording), say("lab-scale")))
    made.add(say("lab-given"), made.table("inputs", inputs(scene, made.words)))
    for part in ("question", "procedure"):
        made.add(say(f"lab-{part}"), say(f"lab-{part}-asks"))
    units = {name: unit for name, _, unit, _ in _values(recording) if unit}
    rows = tuple((f"{name}, {unit}", "", "", "", "") for name, unit in units.items())
    heads = tuple(say("lab-values-columns").split(" | "))
    meanings = []
    for name in units:
        # It may be the mean over the particles of one of `TOLD`.
        own = name if name in TOLD else name.removesuffix(".mean")
        mean = "" if own == name else f", {say('lab-mean')}"
        meanings.append(f"{_plain(name)}: {say(f'lab-of-{own}')}{mean}")
    made.add(say("lab-values"), made.table("values", Sheet("", heads, rows)), "; ".join(meanings))
    for part in ("evaluation", "errors", "conclusion"):
        made.add(say(f"lab-{part}"), say(f"lab-{part}-asks"))


def inputs(scene: Scene, words: Words) -> Sheet:
    """Return the values in the scene file, key by key, with unit and source."""
    rows, from_file = [], words.say("lab-from-scene")
    for key, value in _leaves(to_dict(scene)):
        if key.split(".")[0].split("[")[0] in ("title", "expect", "live", "view", "sensor"):
            continue
        if key == "run.loads":
            continue
        unit = "" if isinstance(value, str) else unit_of(parts_of(key))
        said = str(value).lower() if isinstance(value, bool) else str(value)
        if isinstance(value, float):
            said = words.local(number(value))
        rows.append((key, said, unit, from_file))
    given = {row[0] for row in rows}
    for key, value, unit in (
        ("gravity", scene.gravity, "m/s²"),
        ("particle.radius", scene.particle.radius, "m"),
        ("particle.mass", scene.particle.mass, "kg"),
    ):
        if key not in given and isinstance(value, float):
            rows.append((key, words.local(number(value)), unit, words.say("lab-from-default")))
    notes: tuple[str, ...] = (words.say("lab-spread"),)
    if len(rows) > MOST:
        notes = (words.say("lab-more", count=len(rows) - MOST), *notes)
    heads = tuple(words.say("lab-given-columns").split(" | "))
    return Sheet("", heads, tuple(rows[:MOST]), texts=4, notes=notes)


def _leaves(tables: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the keys of nested tables with their values; places and ranges are values."""
    if isinstance(tables, Mapping):
        for key, value in tables.items():
            yield from _leaves(value, f"{path}.{key}" if path else str(key))
    elif isinstance(tables, list | tuple) and any(isinstance(one, Mapping) for one in tables):
        for n, one in enumerate(tables):
            yield from _leaves(one, f"{path}[{n}]")
    else:
        yield path, tables


def materials(made: Report) -> str:
    """Return a table of the presets that are used, with spread, and the sources below it."""
    rows, sources = [], dict[str, int]()
    for name in dict.fromkeys(kind.material for kind in made.scene.particles):
        preset = presets().get(str(name))
        for key, spread in preset.spread.items() if preset else ():
            low, high = (number(value) for value in spread)
            value = number(getattr(preset.material, key)) if preset else ""
            named = preset.sources[key] if preset else ()
            marks = ", ".join(f"[{sources.setdefault(one, len(sources) + 1)}]" for one in named)
            rows.append((f"{name}: {key}", value, f"{low} to {high}", marks))
    heads, notes = (
        ("material", "value", "spread", "source"),
        (f"[{n}] {s}" for s, n in sources.items()),
    )
    return made.table("materials", Sheet("", heads, tuple(rows), texts=4, notes=tuple(notes)))


def left_out(made: Report) -> list[str]:
    """Return what is assumed and left out, and how much it matters if that is known."""
    recording, scene = made.recording, made.scene
    share = recording.ledger.relative_residual
    said = [
        "Two dimensions: a slice one particle thick; nothing moves across the width.",
        "Bodies are rigid, with Coulomb friction."
        + (
            ""
            if any(kind.falls for kind in scene.particles)
            else " Restitution is the same at all speeds."
        )
        + ("" if scene.clings else " Nothing clings."),
        f"Numerical error: {100.0 * share:.2g} % of the energy turned over is unexplained by the"
        f" ledger; engine {recording.engine}.",
    ]
    if scene.streams[0].width is not None:
        said.append(f"What is told per width is of {number(scene.slices())} slices.")
    if made.repeats is None and recording.count > 1:
        said.append("One seed: results have no error bars; ask for several seeds.")
    notes = (read(recording) for read, _ in NOTES.values())
    return said + [_plain(sentence(str(note))) + "." for note in notes if note is not None]


def _values(recording: Recording) -> Iterator[tuple[str, str, str, float]]:
    """Yield name, meaning, unit and value of each of `TOLD`; of a stream its mean."""
    for name in TOLD:
        for one in (name, f"{name}.mean"):
            row = lookup(one, recording.scene.places, recording.machine.streams)
            if row is None:
                continue
            try:
                value = measure(recording, one)
            except KeyError:
                continue
            if isfinite(value):
                yield one, row.meaning, row.unit, value
                break


def results(made: Report) -> Sheet:
    """Return the main quantities; with several seeds as mean ± standard error."""
    rows = []
    for name, meaning, unit, value in _values(made.recording):
        said = number(value)
        if made.repeats is not None and name in made.repeats.values:
            mean = made.repeats[name]
            said = plus_minus(mean.mean, mean.error) if mean.runs > 1 else said
        if not (made.recording.count == 1 and name.startswith(("loads", "misses"))):
            rows.append((name, meaning, said, unit))
    seeds = len(made.repeats) if made.repeats is not None else 1
    notes = (f"Means over {seeds} seeds ± their standard errors",) if seeds > 1 else ()
    return Sheet("", ("quantity", "what it is", "value", "unit"), tuple(rows), texts=2, tail=1,
                 notes=notes)  # fmt: skip


def power(recording: Recording) -> Sheet | None:
    """Return force, acceleration length and power of the outgoing belt; None without one."""
    scene = recording.scene
    belt = scene.outgoing
    if belt is None or not belt.speed:
        return None
    suffix = ".mean" if recording.count > 1 else ""
    speed = measure(recording, f"arrival.vx{suffix}")
    friction = float(scene.met(scene.kinds[0], "outgoing")[1])
    if not (isfinite(speed) and 0.0 < friction < np.inf):
        return None
    flow = float(np.mean(recording.mass)) * float(recording.machine.scenes.rate)
    found = loading(
        mass_rate=flow, belt_speed=belt.speed, speed=speed, friction=friction,
        gravity=recording.gravity,
    )  # fmt: skip
    simulated = measure(recording, "ledger.power")
    rows = (
        ("mass flow ṁ, all the width", number(flow), "kg/s"),
        ("speed along the belt on arrival, v₀", number(speed), "m/s"),
        ("belt speed v", number(belt.speed), "m/s"),
        ("force F = ṁ (v - v₀), ISO 5048, DIN 22101", number(found.force), "N"),
        ("acceleration length (v² - v₀²) / (2 g µ)", number(found.length), "m"),
        ("power F v", number(found.power), "W"),
        ("power of the drive, simulated, until the run ends", number(simulated), "W"),
    )
    note = (
        "The formulas bring loads to the belt's speed; what rolls, or a run that ends at the"
        " landing, takes less"
    )
    return Sheet("", ("", "value", "unit"), rows, tail=1, notes=(note,))


def wear(recording: Recording) -> Sheet:
    """Return the sums of wear of each surface, and where it is largest."""
    rows = []
    for name, one in touched(recording).items():
        sums = [float(getattr(one, key).sum()) for key in KEYS]
        x, y = one.places[int(np.argmax(one.impact + one.sliding)), 1]
        rows.append((name, *map(number, (*sums, float(x), float(y)))))
    heads = (
        "surface", "impacts, J", "sliding, J", "Finnie, J", "Archard, J", "most at x, m", "y, m",
    )  # fmt: skip
    note = "Relative: multiply by k (m³/J) and by K/H (1/Pa) of the pair of materials for volumes"
    return Sheet("", heads, tuple(rows), notes=(note,))


def sensitivities(made: Report) -> Sheet:
    """Return by how much results change when a key is changed by 1 %, or an angle by 0.57°."""
    scene, base = made.scene, list(_values(made.recording))[:5]
    given = dict(_leaves(to_dict(scene)))
    keys = [key for key in TURNED if isinstance(given.get(key), int | float)]
    cost = made.recording.seconds
    room = int(BUDGET / (2.0 * cost)) if cost > 0.0 else len(keys)
    keys, skipped = keys[:room], keys[room:]
    rows = []
    for key in keys:
        value = float(given[key])
        step = np.degrees(CHANGED) if key.endswith("_deg") else CHANGED * abs(value)
        changed = []
        for sign in (-1.0, 1.0):
            try:
                run = simulate(scene.with_values({key: value + sign * step}))
            except ValueError:
                break
            changed.append({name: found for name, _, _, found in _values(run)})
        if step > 0.0 and len(changed) == 2:
            low, high = changed
            told = []
            for name, *_ in base:
                if name not in low or name not in high:
                    told.append("–")
                    continue
                half, size = 0.5 * (high[name] - low[name]), max(abs(low[name]), abs(high[name]))
                told.append(f"{half:.3g}" if abs(half) > ROUNDING * size else "0")
            rows.append((f"{key} + {number(step)}", *told))
    heads = ("", *(f"{name}, {unit}" if unit else name for name, _, unit, _ in base))
    notes: list[str] = []
    if rows:
        notes = [
            "By so much a result changes with a key that is larger by what stands beside it: half"
            " the difference of a run with the key so much larger and of one with it smaller"
        ]
        if made.recording.count > 1:
            notes.append("All runs have the same seed, but grains meet differently in each: noise")
    if skipped:
        limit = f"they would take more than the {BUDGET:g} s that there are for all"
        notes.append(f"Left out: {', '.join(skipped)}; {limit}")
    return Sheet("", heads, tuple(rows), notes=tuple(notes))


def check(path: Path) -> None:
    """Raise a `PrintError` if a report cannot be written there."""
    if path.suffix.lower() == ".pdf":
        need_typst()
