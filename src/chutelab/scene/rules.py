"""``[[expect]]``: what a scene should show, for ``chutelab verify``."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from chutelab.scene.units import (
    LARGEST,
    Number,
    Share,
    Table,
    Text,
    described,
    read_size,
)

THEORY: Final = "theory"
UNPROMISED: Final = "none"

Value = Annotated[Number, Field(ge=-(LARGEST**2), le=LARGEST**2)]
Words = Annotated[Text, Field(max_length=40)]


class Expect(Table):
    """A number that a run of the scene should show, how exactly, and the source."""

    quantity: Text = described(
        ...,
        "What is looked at: a paper's symbol such as x2 or phi1_deg, or a key of the JSON summary "
        "such as landing.x (of several particles particles[0].landing.x), landing.x.mean, "
        "ledger.by_surface.outgoing.belt_work",
        max_length=200,
    )
    value: Literal["theory"] | Value = described(
        ...,
        'What it should be, in its unit (SI; degrees for names in _deg), or "theory": what the '
        "closed form gives",
    )
    tolerance: Share | Words = described(
        ...,
        "What it may be off: a number is relative (0.01 is 1 %; of the value, or of what such "
        'quantities are measured by in the scene if that is more), a string absolute ("0.5 mm")',
    )
    tolerance_contact: Share | Words | None = described(
        None, 'The same for the contact engine, or "none"; default: tolerance'
    )
    tolerance_pymunk: Share | Words | None = described(
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
