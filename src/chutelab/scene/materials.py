"""Particles and their materials: ``[[material]]``, and presets with spread and sources.

A coefficient of restitution or friction belongs to a pair. A material has three: with itself, with
steel (chutes, plates) and with the rubber of a belt.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal, Self

from pydantic import model_validator

from chutelab.scene.units import (
    Amount,
    Corners,
    Density,
    Mass,
    Name,
    Pace,
    Radius,
    Resolved,
    Share,
    Size,
    Switch,
    Table,
    Text,
    Two,
    about_centroid,
    described,
    pair_friction,
    pair_restitution,
)

LIGHTEST: Final = 100.0
"""kg/m³: about expanded polystyrene; balsa has 110 to 140, cork 220."""

DENSEST: Final = 22_590.0
"""kg/m³: osmium; no solid at room conditions is denser."""


class Material(Table):
    """The material of particles; for a pair without values, those with itself hold."""

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


class Particle(Resolved):
    """One kind of particles: disks, or mass points with radius 0; boxes and polygons."""

    name: Name | None = described(None, "Name of this kind; needed where there are several")
    shape: Literal["disk", "sphere", "box", "polygon"] = described(
        "disk",
        "Shape; with spin a disk has I = m r²/2, a sphere 2/5 m r²; boxes and polygons are for the"
        " engines contact and pymunk",
    )
    radius: Radius = described(
        0.0063,
        "Radius r, 0 is a mass point; or [from, to], drawn evenly for each particle (the first has"
        " the mean)",
        "m",
    )
    size: Size | None = described(None, "Size [width, height] of a box", "m")
    points: Corners | None = described(
        None, "Corners [[x, y], ...] of a convex polygon; it turns about its centroid", "m"
    )
    mass: Mass = described(0.008, "Mass m; or a density, or a material that has one", "kg")
    density: Density | None = described(
        None, "Density, instead of a mass: that of a solid sphere of the radius", "kg/m³"
    )
    material: Text | None = described(
        None,
        "Material that gives density, restitution and friction if they are not given: a name of"
        " `chutelab materials`, or of a [[material]]",
        max_length=40,
    )
    spin: Switch = described(False, "Whether it can rotate")
    rolling_friction: Amount = described(
        0.0, "Rolling friction: lever arm of the normal force over the radius; needs spin"
    )
    restitution_speed: Pace | None = described(
        None,
        "Speed of approach above which the contact yields and restitution falls as speed^(-1/4);"
        " default: restitution does not depend on speed",
        "m/s",
    )

    @property
    def falls(self) -> float:
        """1 over `restitution_speed`, s/m; 0 without."""
        return 0.0 if self.restitution_speed is None else 1.0 / self.restitution_speed

    @property
    def outline(self) -> tuple[tuple[float, float], ...]:
        """Corners of a box or polygon about its centroid, m; () if it is round."""
        if self.size is not None:
            x, y = 0.5 * self.size[0], 0.5 * self.size[1]
            return ((-x, -y), (x, -y), (x, y), (-x, y))
        return about_centroid(self.points) if self.points is not None else ()

    @property
    def span(self) -> tuple[float, float] | None:
        """The range of its radii, m; None if all are equal."""
        span: tuple[float, float] | None = self._typed.get("radius")  # type: ignore[assignment]
        return span

    def mean_of(self, mass: Any) -> Any:
        """Return the mean mass, kg, given the mass (kg) at the mean radius; mass goes with r³."""
        if self.span is None:
            return mass
        low, high = self.span
        cube = self.radius * self.radius * self.radius
        return mass * 0.25 * (low + high) * (low * low + high * high) / cube

    @property
    def moment(self) -> float:
        """I/(m r²) of a disk or sphere that rotates, 0 of one that does not."""
        return 0.0 if not self.spin else 0.4 if self.shape == "sphere" else 0.5


class Pair(Table):
    """Values of a pair, which override those of tables and materials."""

    between: Two = described(..., "Two kinds of particles by name, or one and a surface")
    restitution: Share | None = pair_restitution(None, "of these two")
    friction: Amount | None = pair_friction(None, "of these two")
    cohesion: Amount = described(0.0, "Force that pulls them apart where they touch", "N")
    bond_number: Amount = described(
        0.0, "Cohesion over the weight of the lighter particle, instead of cohesion"
    )
    meet: Switch = described(True, "Whether two kinds meet; if not, they pass through each other")

    @property
    def clings(self) -> str | None:
        """The key of the cohesion of the pair, or None."""
        return next((key for key in ("cohesion", "bond_number") if getattr(self, key)), None)


@dataclass(frozen=True)
class Preset:
    """A built-in material."""

    material: Material  # its numbers
    about: str  # meaning of the name, in a few words
    # the usual range of each of `VALUES`
    spread: Mapping[str, tuple[float, float]]
    sources: Mapping[str, tuple[str, ...]]  # source of each of `VALUES` and its spread


@cache
def presets() -> dict[str, Preset]:
    """Return `PRESETS`, read from ``materials.toml``, where the rows are explained."""
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
"""The built-in materials; read when first needed, since that takes 14 ms and few scenes name
one."""


def __getattr__(name: str) -> dict[str, Preset]:
    if name == "PRESETS":
        return presets()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
