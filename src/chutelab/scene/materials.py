"""What particles are made of: a scene's ``[[material]]``, and presets with spread and sources.

A coefficient of restitution or friction belongs to a pair. A material has three: with itself, with
steel (chutes, plates) and with the rubber of a belt.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final, Self

from pydantic import model_validator

from chutelab.scene.units import Amount, Density, Name, Share, Table, described

LIGHTEST: Final = 100.0
"""kg/m³: about expanded polystyrene; balsa has 110 to 140, cork 220."""

DENSEST: Final = 22_590.0
"""kg/m³: osmium; no solid at room conditions is denser."""


class Material(Table):
    """What particles are made of; a pair that is not given is as the material with itself."""

    name: Name = described(..., "Unique name, for particle.material")
    density: Density = described(..., "Density of the solid, without the voids of a heap", "kg/m³")
    restitution: Share = described(..., "Coefficient of restitution with itself")
    friction: Amount = described(..., "Coulomb coefficient of friction µ with itself")
    restitution_steel: Share = described(
        None, "Coefficient of restitution with steel; default: restitution"
    )
    friction_steel: Amount = described(
        None, "Coulomb coefficient of friction µ with steel; default: friction"
    )
    restitution_rubber: Share = described(
        None, "Coefficient of restitution with the rubber of a belt; default: restitution"
    )
    friction_rubber: Amount = described(
        None, "Coulomb coefficient of friction µ with the rubber of a belt; default: friction"
    )

    @model_validator(mode="after")
    def _pairs_default_to_its_own(self) -> Self:
        for key in ("restitution", "friction"):
            for pair in (f"{key}_steel", f"{key}_rubber"):
                if getattr(self, pair) is None:
                    self._fill(pair, getattr(self, key))
        return self


VALUES: Final = tuple(key for key in Material.model_fields if key != "name")
"""The numbers of a material, by key."""


@dataclass(frozen=True)
class Preset:
    """A material that is there by its name."""

    material: Material  # its numbers
    about: str  # what is meant by the name, in a few words
    # the lowest and the highest that is usual, of each of `VALUES`
    spread: Mapping[str, tuple[float, float]]
    sources: Mapping[str, tuple[str, ...]]  # where each of `VALUES` and its spread are from


@cache
def presets() -> dict[str, Preset]:
    """Return `PRESETS`, read from ``materials.toml``, which says what a row holds."""
    tables = tomllib.loads((Path(__file__).parent / "materials.toml").read_text(encoding="utf-8"))
    sources, found = tables.pop("sources"), {}
    for name, table in tables.items():
        about, rows = table.pop("about"), table.items()
        found[name] = Preset(
            Material(name=name, **{key: float(row[0]) for key, row in rows}),
            about,
            {key: (float(row[1]), float(row[2])) for key, row in rows},
            {key: tuple(sources[source] for source in row[3:]) for key, row in rows},
        )
    return found


PRESETS: dict[str, Preset]
"""The materials that every scene may name; few name one, and they take 14 ms to read."""


def __getattr__(name: str) -> dict[str, Preset]:
    if name == "PRESETS":
        return presets()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
