"""Scene files: from TOML text to a frozen, validated `Scene`.

- `units`: sizes with their units, and what a key may hold: strict types and ranges.
- `materials`: ``[[material]]``, and presets with their spread and sources.
- `quantities`: the registry of a run's quantities, from which all that names them comes.
- `conflicts`: what no single key can answer for.
- `tables`: the tables of a scene as frozen Pydantic models, with the defaults.
- `schema`: all tables together, and what follows from one for another.
- `overrides`: keys by their full path: JSON Schema, limits, ``KEY=VALUE`` texts.
- `messages`: what Pydantic says of a scene, in words; ``[live]``, whether its keys are there.
- `loading`: `Scene`; read, parse, override, validate, write; the shipped scenes.
- `variants`: one scene with other values: ``--vary``, combinations, families.
"""

from chutelab.scene.loading import (
    About,
    AnyScene,
    Overrides,
    Scene,
    SceneError,
    about,
    find,
    from_dict,
    load,
    parse,
    shipped,
    template,
    to_dict,
    to_toml,
)
from chutelab.scene.overrides import schema
from chutelab.scene.tables import (
    Conveyor,
    Expect,
    Incoming,
    Outgoing,
    Particle,
    Plate,
    Run,
    Stream,
    Surface,
)
from chutelab.scene.units import RESERVED_NAMES
from chutelab.util.errors import MISSING, Fault, shown
from chutelab.util.versions import need_all

__all__ = [
    "MISSING",
    "RESERVED_NAMES",
    "About",
    "AnyScene",
    "Conveyor",
    "Expect",
    "Fault",
    "Incoming",
    "Outgoing",
    "Overrides",
    "Particle",
    "Plate",
    "Run",
    "Scene",
    "SceneError",
    "Stream",
    "Surface",
    "about",
    "find",
    "from_dict",
    "load",
    "parse",
    "schema",
    "shipped",
    "shown",
    "template",
    "to_dict",
    "to_toml",
]

need_all()
