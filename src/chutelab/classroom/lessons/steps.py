"""Steps of a lesson: questions, keys that may be changed, runs of a table.

Page, worksheet, teacher's sheet and notebook are made from them, so all four ask the same.
`data_of` is the data for the page; ``lessons/README.md`` describes the keys.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import inf
from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, Field

from chutelab.classroom.lessons.texts import parser
from chutelab.scene import MISSING, Fault, Scene, SceneError
from chutelab.scene.formulas import of_quantities, tree
from chutelab.scene.overrides import value_at
from chutelab.scene.quantities import lookup, suggestion, whose
from chutelab.scene.units import Table, Text, Whole, flat
from chutelab.util.words import LANGUAGES, Words

MOST: Final = 20
"""Most entries of a list: a lesson that needs more is two lessons."""

LONGEST: Final = 200
"""Most characters of a text that must fit on a slide."""

Said = Annotated[Text, Field(min_length=1, max_length=LONGEST)]
Names = Annotated[tuple[Said, ...], Field(max_length=MOST)]
Markdown = Annotated[Text, Field(max_length=20_000)]


def key(default: Any, what: str, allowed: str, **limits: Any) -> Any:
    """Describe one key: its default, its definition in a sentence, and what it allows."""
    return Field(default, description=f"{what}.", json_schema_extra={"allowed": allowed}, **limits)


def in_language(value: Any, language: str, untranslated: list[str], path: str = "") -> Any:
    """Return a document with each ``{en = ..., de = ...}`` replaced by its text in a language.

    Without such a text the English one is taken, and its path appended to `untranslated`.

    >>> in_language({"title": {"en": "Fall", "de": "Fall"}, "minutes": 45}, "de", [])
    {'title': 'Fall', 'minutes': 45}
    """
    if isinstance(value, list):
        return [in_language(v, language, untranslated, f"{path}[{n}]") for n, v in enumerate(value)]
    if not isinstance(value, dict):
        return value
    if value and value.keys() <= {*LANGUAGES}:
        if language not in value:
            untranslated.append(path)
        return value.get(language, next(iter(value.values())))
    return {
        name: in_language(v, language, untranslated, f"{path}.{name}".lstrip("."))
        for name, v in value.items()
    }


Settings = Annotated[dict[Said, Any], BeforeValidator(flat), Field(max_length=MOST)]
SETTINGS: Final = 'a table of keys of the scene such as { "plate.angle_deg" = 20 }'


class Ask(Table):
    """One question: answered by a flag in the picture, a choice, a sketch, or in words."""

    text: Markdown = key(..., "What is asked", "a text")
    mark: Said | None = key(
        None, "The quantity whose place is marked in the picture", "landing.x or separation.x"
    )
    choices: Names = key((), "Sentences to choose from", f"a list of at most {MOST} texts")
    replies: Names = key(
        (), "What is said to each of choices, when it is explained", "a text for each of choices"
    )
    right: Whole | None = key(
        None, "Which of choices is right, from 1 on", "a whole number from 1 on", ge=1, le=MOST
    )
    sketch: bool = key(False, "Whether the path is drawn into the picture", "true or false")
    answer: Markdown = key("", "The answer, for the teacher", "a text")


class Row(Table):
    """One run for a table."""

    head: Said = key(..., "What the row is called", f"a text of 1 to {LONGEST} characters")
    set: Settings = key({}, "What is changed for it", SETTINGS)


class Column(Table):
    """A column of a table; without `value` and `given` it is filled in by hand."""

    head: Said = key(..., "What the column is called", f"a text of 1 to {LONGEST} characters")
    value: Said | None = key(
        None,
        "What is noted, a formula of quantities of the run",
        "a formula such as 1000 * ledger.belt_work",
    )
    unit: Annotated[Text, Field(max_length=20)] = key("", "Its unit", "a text such as m/s")
    given: Annotated[tuple[Text | float | int, ...], Field(max_length=MOST)] = key(
        (), "What stands there already", "an entry for each of rows"
    )


class Step(Table):
    """One step of a lesson."""

    kind: Literal["predict", "try", "note", "explain", "numbers"] = key(
        ..., "What one does", '"predict", "try", "note", "explain" or "numbers"'
    )
    minutes: Whole = key(
        5, "Time in the teacher's plan", "a whole number from 1 to 200", ge=1, le=200
    )
    text: Markdown = key("", "What is said first, Markdown", "a text")
    set: Settings = key({}, "The machine of this step: what is changed at its beginning", SETTINGS)
    controls: Names | None = key(
        None,
        "Keys that can be changed in this step; default: of try and note all of the page's",
        "a list of keys that are among page.live.controls",
    )
    asks: Annotated[tuple[Ask, ...], Field(max_length=MOST)] = key(
        (), "What is asked", f"at most {MOST} tables"
    )
    columns: Annotated[tuple[Column, ...], Field(max_length=MOST)] = key(
        (), "What the table of this step tells of each run", f"at most {MOST} tables"
    )
    rows: Annotated[tuple[Row, ...], Field(max_length=MOST)] = key(
        (), "The runs that the table wants", f"at most {MOST} tables"
    )
    free: Whole = key(0, "Rows for runs of one's own", "a whole number up to 20", ge=0, le=MOST)
    then: Markdown = key("", "What is said when the step is done, Markdown", "a text")

    def open(self, controls: tuple[str, ...]) -> tuple[str, ...]:
        """Return the keys that can be changed in this step, of those of the page."""
        if self.controls is not None:
            return self.controls
        return controls if self.kind in ("try", "note") else ()


TABLES: Final[dict[str, type[Table]]] = {
    "steps": Step, "asks": Ask, "columns": Column, "rows": Row,
}  # fmt: skip
"""Model of each table of a step by its key."""

PLACES: Final = re.compile(r"\{(gravity|[a-z]\w*(?:\.\w+)+)\}")
"""Pattern of keys whose values stand in a text, such as ``{outgoing.speed}``; not TeX groups."""

FUNCTIONS: Final = ("abs", "acos", "atan2", "cos", "degrees", "hypot", "radians", "sin", "sqrt")
"""Functions in formulas of columns."""


def quantities_in(formula: str) -> list[str]:
    """Return the quantities in a column's formula, sorted; a `SyntaxError` if it is no formula.

    >>> quantities_in("hypot(landing.vx, landing.vy) / 2")
    ['landing.vx', 'landing.vy']
    """
    names = {one.id for one in ast.walk(of_quantities(formula)) if isinstance(one, ast.Name)}
    return sorted(names.difference(FUNCTIONS))


def faults_of(
    steps: Sequence[Step], machine: Callable[[Mapping[str, Any]], Scene], live: Mapping[str, Any]
) -> Iterator[Fault]:
    """Yield the parts of the steps that cannot be done on the page.

    These are keys that cannot be changed there, values out of their range, quantities that the
    machine lacks, and lists of different length. `machine` loads the machine with keys changed, or
    raises a `SceneError`; `live` has what the page offers, ``controls`` and ``ranges``.
    """
    controls, ranges = tuple(live.get("controls", ())), live.get("ranges", {})
    for n, step in enumerate(steps):
        here = f"steps[{n}]"
        own = step.open(controls)
        for one in own:
            if controls and one not in controls:
                yield Fault(f"{here}.controls", one, "must be one of page.live.controls")
        try:
            scene = machine(step.set)
        except SceneError as error:
            yield Fault(f"{here}.set", step.set, str(error.faults[0]))
            continue
        texts = (step.text, step.then, *(ask.text for ask in step.asks))
        for place in PLACES.findall(" ".join(texts)):
            if place not in own or value_at(scene, place) is MISSING:
                yield Fault(f"{here}.text", place, "must be one of the step's controls")
        for m, row in enumerate(step.rows):
            there = f"{here}.rows[{m}].set"
            for name, value in row.set.items():
                low, high = ranges.get(name, (-inf, inf))
                if name not in own:
                    yield Fault(f"{there}.{name}", value, "must be one of the step's controls")
                elif isinstance(value, float | int) and not low <= value <= high:
                    yield Fault(f"{there}.{name}", value, f"must be from {low} to {high}")
            try:
                machine({**step.set, **row.set})
            except SceneError as error:
                yield Fault(there, row.set, str(error.faults[0]))
        for m, column in enumerate(step.columns):
            there = f"{here}.columns[{m}]"
            if column.given and len(column.given) != len(step.rows):
                yield Fault(f"{there}.given", list(column.given), "must have an entry for each row")
            try:
                names = quantities_in(column.value) if column.value else []
            except (SyntaxError, ValueError):
                yield Fault(f"{there}.value", column.value, "must be a formula of quantities")
                continue
            for name in names:
                row_of = lookup(name, scene.places)
                if row_of is None or (said := whose(row_of, scene.count)):
                    hint = said if row_of else suggestion(name, scene.places)
                    yield Fault(f"{there}.value", name, f"no quantity of this machine; {hint}")
        for m, ask in enumerate(step.asks):
            if len(ask.replies) != len(ask.choices):
                text = "must have a text for each of choices"
                yield Fault(f"{here}.asks[{m}].replies", list(ask.replies), text)
            if ask.choices and not 1 <= (ask.right or 0) <= len(ask.choices):
                text = "must say which of choices is right, from 1 on"
                yield Fault(f"{here}.asks[{m}].right", ask.right, text)
            if ask.mark is not None and lookup(ask.mark, scene.places) is None:
                text = f"no quantity of this machine; {suggestion(ask.mark, scene.places)}"
                yield Fault(f"{here}.asks[{m}].mark", ask.mark, text)


def html_of(text: str, *, inline: bool = False) -> str:
    """Return Markdown as HTML; ``{outgoing.speed}`` becomes a place for that value.

    >>> html_of("Set it to {outgoing.speed}.", inline=True)
    'Set it to <span data-key="outgoing.speed"></span>.'
    """
    made = parser().renderInline(text) if inline else parser().render(text)
    return PLACES.sub(r'<span data-key="\1"></span>', str(made)).strip()


BEFORE_UNIT: Final = re.compile(r"(?<=\d) (?=\S{1,3}(?:[\s,]|$))")
"""A space that keeps a number and its unit on one line of a table."""


def data_of(steps: Sequence[Step], controls: tuple[str, ...], said: Words) -> list[dict[str, Any]]:
    """Return steps as plain data for the JSON of a page.

    Texts are HTML with MathML, heads and choices without paragraphs; `controls` of a step are all
    keys that can be changed in it. The value of a column is a formula as `scene.formulas.tree`
    returns it, in which a quantity is a name with dots. The teacher's parts are left out.
    """
    return [
        {
            "kind": step.kind,
            "text": html_of(step.text),
            "set": step.set,
            "controls": list(step.open(controls)),
            "asks": [
                {
                    "text": html_of(ask.text, inline=True),
                    "mark": ask.mark,
                    "sketch": ask.sketch,
                    "choices": [html_of(one, inline=True) for one in ask.choices],
                    "replies": [html_of(one, inline=True) for one in ask.replies],
                    "right": ask.right,
                }
                for ask in step.asks
            ],
            "columns": [
                {
                    "head": html_of(one.head, inline=True),
                    "unit": said.unit(one.unit),
                    "value": tree(one.value, dotted=True) if one.value else None,
                    "given": [said.local(str(cell)) for cell in one.given],
                }
                for one in step.columns
            ],
            "rows": [
                {
                    "head": html_of(
                        BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", said.local(one.head)), inline=True
                    ),
                    "set": one.set,
                }
                for one in step.rows
            ],
            "free": step.free,
            "then": html_of(step.then),
        }
        for step in steps
    ]
