"""What particles are made of: a scene's ``[[material]]``, and presets with spread and sources.

A coefficient of restitution or friction belongs to a pair. A material has three: with itself, with
steel (chutes, plates) and with the rubber of a belt.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Self

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
    """A material that is there by its name.

    Attributes
    ----------
    material : Material
        Its numbers.
    about : str
        What is meant by the name, in a few words.
    spread : mapping of str to (float, float)
        The lowest and the highest that is usual, of each of `VALUES`.
    sources : mapping of str to tuple of str
        Where each of `VALUES` and its spread are from.
    """

    material: Material
    about: str
    spread: Mapping[str, tuple[float, float]]
    sources: Mapping[str, tuple[str, ...]]


_SOURCES: Final = {
    "typical": "Typical: a round number within what textbooks, handbooks and calibrations of"
    " particle models use, which differ widely. Measure it where it matters.",
    "crc": "CRC Handbook of Chemistry and Physics, section 15, density of various solids, g/cm³:"
    " anthracite 1.4 to 1.8, bituminous coal 1.2 to 1.5, glass 2.4 to 2.8, granite 2.64 to 2.76,"
    " ice 0.917, limestone 2.68 to 2.76, polyethylene 0.92 to 0.97, quartz 2.65, hard rubber 1.19,"
    " cedar 0.49 to 0.57, oak 0.60 to 0.90.",
    "openstax": "College Physics for AP Courses (OpenStax), table 11.1, densities: iron or steel"
    " 7.8, common glass 2.6, granite 2.7, ice 0.917 g/cm³.",
    "gravity": "Handbook tables of specific gravity: hematite 5.2, magnetite 4.9 to 5.2, limonite"
    " 3.6 to 4.0.",
    "toolbox": "The Engineering ToolBox, friction coefficients, dry: steel on steel 0.42 to 0.62"
    " sliding, steel on rubber 0.64 to 0.86, glass on glass 0.4 sliding, glass on metal 0.5 to 0.7"
    " static, glass on rubber 2, wood on metal 0.2 to 0.6, wood on wood 0.25 to 0.5, steel on"
    " polythene 0.2, brass on ice 0.02 (0 °C) to 0.15 (-80 °C).",
    "lust": "Lust, CDA3000 Engineering Guide, tables 7.21 and 7.23: density of steel 7860 kg/m³;"
    " sliding, dry: steel on steel 0.08 to 0.50, wood on steel 0.30 to 0.60, wood on wood 0.30 to"
    " 0.50, steel on plastic 0.18 to 0.35.",
    "eurocode": "EN 1991-4:2006 (silos), table E.1: wall friction on smooth, medium and rough"
    " walls: wheat 0.24, 0.38, 0.57; sand 0.38, 0.48, 0.57; aggregate 0.39, 0.49, 0.59; coal 0.44,"
    " 0.49, 0.59; iron ore pellets 0.49, 0.54, 0.59. Of the solid in bulk.",
    "iso": "ISO 5048:1989 (belt conveyors): friction of bulk material on the belt 0.5 to 0.7.",
    "foerster": "Foerster, Louge, Chang and Allia, Physics of Fluids 6 (1994) 1108: glass beads of"
    " 3 mm e = 0.97, µ = 0.092; cellulose acetate of 6 mm e = 0.87, µ = 0.25.",
    "hlosta": "Hlosta et al., Processes 8 (2020) 222, as quoted with a particle code: steel balls"
    " e = 0.85, static µ = 0.17.",
    "bounces": "The Physics Factbook, as quoted, on a hard surface: steel ball bearing e = 0.6,"
    " glass marble 0.66, wooden ball 0.6, ball of rubber bands 0.83.",
    "durda": "Durda et al., Icarus 211 (2011) 849: granite spheres of 1 m at about 1 m/s,"
    " e = 0.83 ± 0.06.",
    "teffo": "Teffo and Naudé, J. S. Afr. Inst. Min. Metall. 113 (2013): coefficients measured for"
    " Eskom-grade coal are up to 97 % off the defaults of particle codes.",
    "ice": "Heißelmann et al., Icarus 206 (2010) 424: ice spheres of 15 mm at 0.06 to 0.22 m/s,"
    " e = 0.45 on average, 0.06 to 0.84.",
    "seppyo": "Seppyo, J. Jpn. Soc. Snow and Ice, vol. 61 no. 6: ice on ice at -12 °C µ = 0.01 at"
    " 0.1 m/s, 0.15 at 0.1 mm/s.",
    "icefacts": "The Physics Factbook, coefficients of friction for ice: rubber on ice 0.15,"
    " sliding; 0.40 in a textbook's problem of a car with locked wheels.",
    "tabatabaeefar": "Moisture-dependent physical properties of wheat, Int. Agrophysics 17 (2003)"
    " 207: density 1240 kg/m³ when dry; static friction 0.279 to 0.450 on various surfaces.",
    "greenwheat": "Effect of moisture content on some physical properties of green wheat, J. Food"
    " Engineering 79 (2007) 1467: density 1241 to 1333 kg/m³.",
    "askari": "Asli-Ardeh, CIGR Journal: sliding friction of wheat, means 0.248 on galvanized to"
    " 0.331 on black sheet.",
    "boac": "Boac et al., Trans. ASABE (2010), of another grain: soybeans e = 0.6, µ = 0.45 with"
    " each other, 0.30 with steel.",
}

# In the order of `VALUES`; each number with the lowest and highest that is usual, and its sources.
_TABLE: Final[dict[str, tuple[str, list[tuple[Any, ...]]]]] = {
    "steel": ("balls and shot of hard steel", [
        (7850, 7700, 8000, "lust", "openstax"),
        (0.80, 0.60, 0.95, "hlosta", "bounces", "typical"),
        (0.40, 0.10, 0.60, "toolbox", "lust", "hlosta"),
        (0.80, 0.60, 0.95, "hlosta", "bounces", "typical"),
        (0.40, 0.10, 0.60, "toolbox", "lust", "hlosta"),
        (0.70, 0.50, 0.90, "bounces", "typical"),
        (0.65, 0.40, 0.90, "toolbox", "typical"),
    ]),
    "rubber": ("vulcanized, as a belt's cover", [
        (1100, 950, 1200, "crc", "typical"),
        (0.70, 0.50, 0.90, "bounces", "typical"),
        (1.00, 0.60, 1.50, "typical"),
        (0.70, 0.50, 0.90, "bounces", "typical"),
        (0.65, 0.40, 0.90, "toolbox", "typical"),
        (0.70, 0.50, 0.90, "bounces", "typical"),
        (1.00, 0.60, 1.50, "typical"),
    ]),
    "gravel": ("crushed hard rock, such as granite", [
        (2700, 2600, 3000, "crc", "openstax", "typical"),
        (0.50, 0.20, 0.85, "durda", "typical"),
        (0.60, 0.40, 0.90, "typical"),
        (0.50, 0.20, 0.80, "typical"),
        (0.50, 0.39, 0.59, "eurocode"),
        (0.40, 0.20, 0.70, "typical"),
        (0.60, 0.50, 0.70, "iso"),
    ]),
    "limestone": ("crushed limestone", [
        (2700, 2600, 2800, "crc"),
        (0.50, 0.20, 0.85, "typical"),
        (0.60, 0.40, 0.80, "typical"),
        (0.50, 0.20, 0.80, "typical"),
        (0.50, 0.39, 0.59, "eurocode"),
        (0.40, 0.20, 0.70, "typical"),
        (0.60, 0.50, 0.70, "iso"),
    ]),
    "sand": ("dry grains of quartz", [
        (2650, 2600, 2700, "crc"),
        (0.60, 0.40, 0.90, "typical"),
        (0.45, 0.20, 0.60, "typical"),
        (0.60, 0.40, 0.90, "typical"),
        (0.48, 0.38, 0.57, "eurocode"),
        (0.50, 0.30, 0.70, "typical"),
        (0.60, 0.50, 0.70, "iso"),
    ]),
    "coal": ("dry lumps, bituminous to anthracite", [
        (1400, 1200, 1800, "crc"),
        (0.40, 0.10, 0.65, "typical", "teffo"),
        (0.60, 0.30, 0.90, "typical", "teffo"),
        (0.45, 0.20, 0.70, "typical", "teffo"),
        (0.49, 0.30, 0.60, "eurocode", "typical"),
        (0.40, 0.20, 0.70, "typical", "teffo"),
        (0.60, 0.50, 0.70, "iso"),
    ]),
    "iron-ore": ("dry lumps or pellets", [
        (4000, 3500, 5200, "gravity"),
        (0.40, 0.10, 0.70, "typical"),
        (0.60, 0.40, 0.90, "typical"),
        (0.40, 0.20, 0.70, "typical"),
        (0.54, 0.49, 0.59, "eurocode"),
        (0.35, 0.10, 0.60, "typical"),
        (0.60, 0.50, 0.70, "iso"),
    ]),
    "wheat": ("dry kernels", [
        (1300, 1200, 1400, "tabatabaeefar", "greenwheat", "typical"),
        (0.45, 0.30, 0.60, "boac", "typical"),
        (0.45, 0.30, 0.60, "boac", "typical"),
        (0.50, 0.30, 0.70, "typical"),
        (0.30, 0.24, 0.57, "askari", "tabatabaeefar", "eurocode"),
        (0.45, 0.30, 0.60, "typical"),
        (0.45, 0.30, 0.60, "tabatabaeefar", "typical"),
    ]),
    "wood": ("dry wood, such as oak", [
        (650, 490, 900, "crc"),
        (0.50, 0.30, 0.70, "typical"),
        (0.40, 0.25, 0.50, "toolbox", "lust"),
        (0.60, 0.40, 0.70, "bounces", "typical"),
        (0.40, 0.20, 0.60, "toolbox", "lust"),
        (0.50, 0.30, 0.70, "typical"),
        (0.70, 0.50, 0.95, "typical"),
    ]),
    "polyethylene": ("pellets of plastic", [
        (950, 920, 970, "crc"),
        (0.75, 0.50, 0.90, "foerster", "typical"),
        (0.20, 0.10, 0.40, "foerster", "typical"),
        (0.70, 0.50, 0.90, "typical"),
        (0.20, 0.18, 0.35, "toolbox", "lust"),
        (0.60, 0.40, 0.80, "typical"),
        (0.45, 0.30, 0.70, "typical"),
    ]),
    "glass": ("beads of soda-lime glass", [
        (2500, 2400, 2800, "crc", "openstax"),
        (0.95, 0.65, 0.97, "foerster", "bounces"),
        (0.20, 0.09, 0.40, "foerster", "toolbox"),
        (0.90, 0.65, 0.97, "bounces", "typical"),
        (0.30, 0.10, 0.70, "toolbox", "typical"),
        (0.70, 0.50, 0.90, "typical"),
        (0.80, 0.40, 2.00, "toolbox", "typical"),
    ]),
    "ice": ("frozen water, below the melting point", [
        (917, 900, 920, "crc", "openstax"),
        (0.45, 0.06, 0.84, "ice"),
        (0.05, 0.01, 0.15, "seppyo"),
        (0.45, 0.10, 0.90, "typical"),
        (0.03, 0.02, 0.15, "toolbox", "typical"),
        (0.40, 0.10, 0.70, "typical"),
        (0.15, 0.05, 0.40, "icefacts", "typical"),
    ]),
}  # fmt: skip


def _preset(name: str) -> Preset:
    about, rows = _TABLE[name]
    table = dict(zip(VALUES, rows, strict=True))
    return Preset(
        Material(name=name, **{key: float(row[0]) for key, row in table.items()}),
        about,
        {key: (float(row[1]), float(row[2])) for key, row in table.items()},
        {key: tuple(_SOURCES[source] for source in row[3:]) for key, row in table.items()},
    )


PRESETS: Final[dict[str, Preset]] = {name: _preset(name) for name in _TABLE}
"""The materials that every scene may name."""
