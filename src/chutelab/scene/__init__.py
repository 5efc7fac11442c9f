"""Scene files: from TOML text to a frozen, validated `Scene`.

- `errors`: a fault (key, value found, what is allowed) and the one message that lists them all.
- `quantities`: what a key may hold: strict types, units, ranges.
- `units`: sizes with their units, as people write them.
- `models`: the tables of a scene as frozen Pydantic models, with the defaults; `tables`: what they
  share.
- `measures`, `expectations`: what a scene can be expected to show, and ``[[expect]]``.
- `rules`: what no table can judge alone: conflicts between tables.
- `wording`: Pydantic's errors as faults, with the allowed values said in words.
- `overrides`: ``KEY=VALUE`` texts, as ``--set`` takes them, laid over a scene.
- `loading`: read, parse, override, validate.
- `editor`: the JSON Schema, for editors that complete scene files.
- `paths`: values and limits at a key's full path.
- `family`: many scenes that differ in numbers, as one.
- `library`: the shipped scenes, found by name; the starter scene.
"""

from chutelab.scene.errors import MISSING, Fault, SceneError, shown
from chutelab.scene.loading import (
    About,
    about,
    find,
    from_dict,
    load,
    overridden,
    parse,
    shipped,
    template,
    to_dict,
)
from chutelab.scene.overrides import schema
from chutelab.scene.rules import Expect
from chutelab.scene.schema import Incoming, Outgoing, Particle, Plate, Run, Scene, Stream, Surface
from chutelab.scene.units import RESERVED_NAMES

__all__ = [
    "MISSING",
    "RESERVED_NAMES",
    "About",
    "Expect",
    "Fault",
    "Incoming",
    "Outgoing",
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
    "overridden",
    "parse",
    "schema",
    "shipped",
    "shown",
    "template",
    "to_dict",
]
