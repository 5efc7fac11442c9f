"""Keys by their full path: the JSON Schema, values and limits at a path, ``KEY=VALUE`` texts.

``--set plate.angle_deg=20`` lays such a text over a scene's tables.
"""

from __future__ import annotations

import difflib
import json
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import inf, isnan, nextafter
from typing import Any, Final

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from chutelab.scene.look import EITHER
from chutelab.scene.schema import TABLES, SceneTables, to_dict
from chutelab.scene.units import WORDS, read_any, size_in
from chutelab.util.errors import MISSING, Fault, InputError, printable


class _TomlSchema(GenerateJsonSchema):
    """TOML has no null: an optional key is left out, so null is neither offered nor a default."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        described = super().default_schema(schema)
        if described.get("default", 0) is None:
            del described["default"]
        return described

    def field_title_should_be_set(self, schema: Any) -> bool:
        # Titles such as "Pulley Radius" for pulley_radius add nothing to the key.
        return False


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of scene files.

    With the Even Better TOML extension or taplo, the first line ``#:schema ./scene.schema.json``
    of a scene connects the two. Quantities carry their unit as ``x-unit`` too.
    """
    described = SceneTables.model_json_schema(by_alias=True, schema_generator=_TomlSchema)
    described["title"] = "Chutelab scene"
    described["dependentRequired"] = {"plate": ["incoming"], "outgoing": ["incoming"]}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **described}


_schema = cache(schema)

NAMED: Final = ("particle", "material", "plate", "conveyor", "surface", "stream", "sensor")
"""Tables that may occur several times, with names."""

_SEGMENT: Final = re.compile(rf"({WORDS})((?:\[\d{{1,9}}\])*)")
_FORM: Final = "must be KEY=VALUE, such as plate.angle_deg=20 or surface[0].speed=1"
_BARE_KEY: Final = re.compile(r"[\w-]+")


def parts_of(path: str) -> list[str | int]:
    """Return the keys and indices of a full path, or raise an `InputError`.

    >>> parts_of("surface[1].speed")
    ['surface', 1, 'speed']
    """
    parts: list[str | int] = []
    for segment in path.split("."):
        match = _SEGMENT.fullmatch(segment)
        if match is None:
            raise InputError(_FORM)
        parts += [match[1], *(int(index) for index in re.findall(r"\d+", match[2]))]
    return parts


def names_of(document: Mapping[str, Any]) -> dict[str, list[object]]:
    """Return the names of tables that occur several times in a scene's file."""
    return {
        table: [row.get("name") if isinstance(row, Mapping) else None for row in rows]
        for table in NAMED
        if isinstance(rows := document.get(table), list | tuple)
    }


def joined(parts: Sequence[str | int]) -> str:
    """Write a path of keys and indices: ``("surface", 1, "name")`` is ``surface[1].name``."""
    text = ""
    for part in parts:
        if isinstance(part, int):
            text += f"[{part}]"
            continue
        bare = _BARE_KEY.fullmatch(part)
        name = part if bare else printable(json.dumps(part, ensure_ascii=False))
        text += f".{name}" if text else name
    return text


def at_path(document: Any, parts: Sequence[str | int]) -> Any:
    """Follow a path of keys and indices; `MISSING` where it leads nowhere."""
    found = document
    for part in parts:
        try:
            found = getattr(found, str(part)) if isinstance(found, BaseModel) else found[part]
        except (AttributeError, KeyError, IndexError, TypeError):
            return MISSING
    return found


def value_at(scene: SceneTables, path: str) -> Any:
    """Return the value at a path of a scene, defaults filled in.

    `MISSING` if there is none.
    """
    try:
        parts = resolved(to_dict(scene), path)
    except InputError:
        return MISSING
    if len(parts) > 1 and isinstance(parts[1], int):
        parts[0] = EITHER.get(str(parts[0]), parts[0])
    return at_path(scene, parts)


def rule_at(parts: Sequence[str | int]) -> Mapping[str, Any] | None:
    """Return the JSON Schema of a path; None if it leads nowhere."""
    rule: Mapping[str, Any] | None = _schema()
    for part in parts:
        if rule is None:
            return None
        # For a table or a list of tables take the alternative in which the path continues.
        below: list[Any] = []
        for choice in map(_referred, rule.get("anyOf", [rule])):
            if isinstance(part, str):
                keys = choice.get("properties", {})
                below.append(keys.get(part, choice.get("additionalProperties")))
            else:
                first = choice.get("prefixItems", [])
                below.append(first[part] if part < len(first) else choice.get("items"))
        rule = next((found for found in below if isinstance(found, Mapping)), None)
    return None if rule is None else _referred(rule)


def unit_of(parts: Sequence[str | int]) -> str:
    """Return the unit of a key, or of the key that an entry of a list belongs to; "" for none."""
    named = max(depth for depth, part in enumerate(parts) if isinstance(part, str))
    return str((rule_at(parts[: named + 1]) or {}).get("x-unit", ""))


def limits_of(
    rule: Mapping[str, Any], types: Sequence[str] = ("number",)
) -> tuple[float, float] | None:
    """Return the least and the largest float that a rule allows; None if it allows none.

    An excluded bound is moved by one float. `types` are those of JSON Schema that count.
    """
    kinds = [kind for kind in rule.get("anyOf", [rule]) if kind.get("type") in types]
    if not kinds:
        return None
    limits = kinds[0]
    low, high = limits.get("minimum", -inf), limits.get("maximum", inf)
    if "exclusiveMinimum" in limits:
        low = nextafter(limits["exclusiveMinimum"], inf)
    if "exclusiveMaximum" in limits:
        high = nextafter(limits["exclusiveMaximum"], -inf)
    return float(low), float(high)


def _referred(rule: Mapping[str, Any]) -> Mapping[str, Any]:
    if "$ref" not in rule:
        return rule
    found: Mapping[str, Any] = _schema()["$defs"][rule["$ref"].rpartition("/")[2]]
    return found


@dataclass(frozen=True)
class Override:
    """A value to be laid over a scene, at the full path of its key.

    The value is as `tomllib` would have read it; None removes the key, so that it has its default.
    `typed` is the option that it came from, for messages; "" for none.
    """

    key: str
    value: object
    typed: str = ""


def read(text: str) -> Override:
    """Read what ``--set`` takes, ``KEY=VALUE``; VALUE is a TOML value or else a string."""
    key, equals, value = text.partition("=")
    return Override(key.strip() if equals else "", value_of(value), f"--set {text}")


def apply(
    document: dict[str, Any], overrides: Iterable[str | Override]
) -> tuple[list[Fault], dict[str, str]]:
    """Lay overrides over a scene's tables, in place and in order; the last one wins.

    Texts are as `read` takes them; a missing table is made; "4 mm" is a number where one is wanted.
    Returns the faults of overrides that could not be applied, and for the others the typed text by
    the full path that it set.
    """
    faults: list[Fault] = []
    given: dict[str, str] = {}
    for override in overrides:
        one = read(override) if isinstance(override, str) else override
        try:
            path = resolved(document, one.key)
            _put(document, path, sized(one.value, path))
        except InputError as error:
            faults.append(Fault(one.typed or one.key, None, str(error)))
        else:
            given[joined(path)] = one.typed
    return faults, given


def sized(value: Any, path: Sequence[str | int] = ()) -> Any:
    """Copy a document, or what is at a path of one, with numbers for texts such as "4 mm".

    Only if a number is expected, and the text has its unit.
    """
    match value:
        case dict():
            return {key: sized(content, (*path, key)) for key, content in value.items()}
        case list():
            return [sized(item, (*path, index)) for index, item in enumerate(value)]
        case str() if path and value[:1] in "+-.0123456789" and _has_unit_of(value, path):
            if limits_of(rule_at(path) or {}) is not None:
                size = size_in(value, unit_of(path))
                return value if size is None else size
    return value


def _has_unit_of(text: str, path: Sequence[str | int]) -> bool:
    """Whether a text may be a number with the unit of the key at a path.

    Keys of tables tell their units themselves: the whole schema, which takes a tenth of a short
    command, is made only for a text that has the unit.
    """
    (number, unit), keys = read_any(text), [part for part in path if isinstance(part, str)]
    table: type[BaseModel] | None = SceneTables
    if len(keys) > 1:
        table = TABLES.get(keys[0]) if len(keys) == 2 else None
    if isnan(number) or table is None:
        return not isnan(number)
    for name, field in table.model_fields.items():
        if (field.alias or name) == keys[-1]:
            extra = field.json_schema_extra
            return unit == ((isinstance(extra, dict) and extra.get("x-unit")) or "%")
    return False


def value_of(text: str) -> object:
    """Read a TOML value; text that is no such value is taken as a string.

    >>> value_of("0.5"), value_of("[0, 1]"), value_of("adhesion")
    (0.5, [0, 1], 'adhesion')
    """
    try:
        read = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text.strip()
    # A line break in the text could smuggle in further keys.
    return read["value"] if set(read) == {"value"} else text.strip()


def resolved(document: Mapping[str, Any], key: str) -> list[str | int]:
    """Return the parts of a key; tables that occur several times have their index.

    Raises an `InputError` if it is no path, or if it is not clear which of several tables is meant.

    Examples
    --------
    >>> resolved({"surface": [{"name": "floor"}, {"name": "hood"}]}, "surface.hood.speed")
    ['surface', 1, 'speed']
    """
    names, path = names_of(document), parts_of(key)
    table = str(path[0])
    if table not in NAMED or len(path) < 2:
        return path
    if path[1] in names.get(table, ()):
        return [table, names[table].index(path[1]), *path[2:]]
    if table in EITHER and path[1] == 0 and table not in names:
        return [table, *path[2:]]
    if not isinstance(path[1], str) or (table in EITHER and table not in names):
        return path
    if table not in names:
        raise InputError(f"the scene has no [[{table}]]")
    if len(names[table]) == 1 and table in EITHER:
        return [table, 0, *path[1:]]
    if path[1] in (rule_at([table, 0]) or {}).get("properties", {}):
        text = f"the scene has several [[{table}]]: {table}[0].{path[1]}, or by name"
        raise InputError(text)
    known = [name for name in names[table] if isinstance(name, str)]
    near = difflib.get_close_matches(path[1], known, n=1)
    hint = f"did you mean {table}.{near[0]}?" if near else f"there are: {', '.join(known)}"
    raise InputError(f"no {table} has the name {path[1]}; {hint}")


def _put(document: dict[str, Any], path: list[str | int], value: object) -> None:
    place: Any = document
    for depth, part in enumerate(path):
        last = depth == len(path) - 1
        if isinstance(part, int):
            if not isinstance(place, list):
                raise InputError(f"{joined(path[:depth])} is no list")
            if part >= len(place):
                raise InputError(f"{joined(path[:depth])} has {len(place)} entries, from [0]")
        elif not isinstance(place, dict):
            raise InputError(f"{joined(path[:depth])} is no table")
        elif not last and part not in place:
            if isinstance(path[depth + 1], int):
                raise InputError(f"{joined(path[: depth + 1])} is not there; give it whole")
            place[part] = {}
        if last and value is None and isinstance(place, dict):
            place.pop(part, None)
        elif last:
            place[part] = value
        else:
            place = place[part]
