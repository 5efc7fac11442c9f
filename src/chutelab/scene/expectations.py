"""``[[expect]]``: what a scene is expected to show, for ``chutelab verify`` to look at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from pydantic import Field

from chutelab.scene import measures
from chutelab.scene.errors import Fault
from chutelab.scene.quantities import LARGEST, Number, Text, described
from chutelab.scene.tables import Table
from chutelab.scene.units import read_size, write_size

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

THEORY: Final = "theory"
UNPROMISED: Final = "none"

Value = Annotated[Number, Field(ge=-(LARGEST**2), le=LARGEST**2)]
Tolerance = Annotated[Number, Field(ge=0.0, le=1.0)]
Words = Annotated[Text, Field(max_length=40)]


class Expect(Table):
    """A number that a run of the scene should show, how exactly, and who says so."""

    quantity: Text = described(
        ...,
        "What is looked at: a paper's symbol such as x2 or phi1_deg, or a key of the JSON summary "
        "such as landing.x, landing.x.mean, ledger.by_surface.outgoing.belt_work",
        max_length=200,
    )
    value: Literal["theory"] | Value = described(
        ...,
        'What it should be, in its unit (SI; degrees for names in _deg), or "theory": what the '
        "closed form gives",
    )
    tolerance: Tolerance | Words = described(
        ...,
        "What it may be off: a number is relative (0.01 is 1 %; of the value, or of what such "
        'quantities are measured by in the scene if that is more), a string absolute ("0.5 mm")',
    )
    tolerance_contact: Tolerance | Words | None = described(
        None, 'The same for the contact engine, or "none"; default: tolerance'
    )
    tolerance_pymunk: Tolerance | Words | None = described(
        None, 'The same for the pymunk engine, or "none"; default: tolerance'
    )
    source: Text = described(
        ..., "Who says so: an equation or a table of the paper, a closed form", max_length=200
    )

    def allowed(self, engine: str) -> tuple[float, str] | None:
        """Return the tolerance for an engine: its size, and its unit ("%" if it is relative).

        None if nothing is promised.
        """
        own = {"contact": self.tolerance_contact, "pymunk": self.tolerance_pymunk}.get(engine)
        tolerance = self.tolerance if own is None else own
        if tolerance == UNPROMISED:
            return None
        return read_size(tolerance) if isinstance(tolerance, str) else (tolerance, "%")


def expectation_conflicts(
    path: str, given: Mapping[str, Any], surfaces: Sequence[str]
) -> Iterator[Fault]:
    """Yield what is wrong with one expectation of a scene that has these surfaces."""
    name = given.get("quantity")
    if not isinstance(name, str):
        return
    unit = measures.unit_of(name, surfaces)
    if unit is None:
        text = f"no such quantity here; {measures.suggestion(name, surfaces)}"
        yield Fault(f"{path}.quantity", name, text)
        return
    if given.get("value") == THEORY and name not in measures.SYMBOLS:
        text = f"a number; the theory has no {name}, only {', '.join(measures.SYMBOLS)}"
        yield Fault(f"{path}.value", THEORY, text)
    for key in ("tolerance", "tolerance_contact", "tolerance_pymunk"):
        tolerance = given.get(key)
        if not isinstance(tolerance, str) or (key != "tolerance" and tolerance == UNPROMISED):
            continue
        if not _fits(tolerance, unit):
            example = write_size(0.0005, unit) if unit != "degrees" else "0.1 degrees"
            example = example if unit else "3"
            none = ' or "none"' if key != "tolerance" else ""
            text = f'must be a number from 0 to 1 (relative), a string such as "{example}"{none}'
            yield Fault(f"{path}.{key}", tolerance, f"{text}; {name} is {_measured(unit)}")


def _fits(tolerance: str, unit: str) -> bool:
    try:
        size, found = read_size(tolerance)
    except ValueError:
        return False
    return size >= 0.0 and found in (unit, "%")


def _measured(unit: str) -> str:
    return f"in {unit}" if unit else "a number of things"
