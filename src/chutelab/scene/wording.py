"""Pydantic's validation errors as faults: the key's full path, and what is allowed in words.

What is allowed is not written down twice: it is read from the type and the limits of the field, so
it cannot disagree with what the models accept.
"""

from __future__ import annotations

import difflib
import types
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen
from pydantic.fields import FieldInfo

from chutelab.scene.errors import MISSING, Fault, at_path, joined
from chutelab.scene.models import Scene
from chutelab.scene.quantities import MOST_POINTS, Point
from chutelab.scene.rules import ConflictError
from chutelab.scene.tables import Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from pydantic import ValidationError

Location = tuple[str | int, ...]
"""Path of keys and indices, as Pydantic gives it."""

_NEAR: Final = 0.55
"""Likeness of a misspelt key and the one that was meant: pivot is taken for pivot_height."""

LISTS: Final = ("surface", "expect")
"""Tables of which there may be several."""

_WORDS: Final[dict[Any, str]] = {
    float: "a number",
    int: "a whole number",
    bool: "true or false",
    str: "a string",
}


def faults_of(error: ValidationError, document: Mapping[str, Any]) -> list[Fault]:
    """Say every error of a validation in words, one fault a key, in the order of the models' keys.

    Conflicts between keys are left out: `chutelab.scene.rules` finds them, also in a scene whose
    validation never came to them.
    """
    faults: dict[Location, Fault] = {}
    for detail in error.errors(include_url=False):
        cause = detail.get("ctx", {}).get("error")
        if isinstance(cause, ConflictError):
            continue
        parts, missing = detail["loc"], detail["type"] == "missing"
        if detail["type"] == "extra_forbidden":
            text = _unknown(parts)
        else:
            if missing and isinstance(parts[-1], int):
                # A point with one coordinate: show what is there, not what is not.
                parts, missing = parts[:-1], False
            # The location of a union's error ends with the name of the member that refused.
            parts, allowed = _allowed(parts)
            text = str(cause) if cause else allowed if missing else f"must be {allowed}"
        value = MISSING if missing else at_path(document, parts)
        faults.setdefault(parts, Fault(joined(parts), value, text))
    # A list whose entries are refused is refused as too short, too.
    broken_lists = {
        parts[:depth]
        for parts in faults
        for depth in range(1, len(parts))
        if all(isinstance(part, int) for part in parts[depth:])
    }
    return [fault for parts, fault in faults.items() if parts not in broken_lists]


def misspelt_tables(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield the tables that an unknown top-level key was probably meant to be."""
    for key in document:
        if key not in Scene.model_fields:
            yield from _nearest(key, Scene.model_fields)


def _keys(table: type[Table] | type[Scene]) -> dict[str, FieldInfo]:
    return {field.alias or name: field for name, field in table.model_fields.items()}


def _allowed(parts: Location) -> tuple[Location, str]:
    """Say what is allowed at a location, and cut off what follows the last key or index."""
    head = str(parts[0])
    table = Scene.tables().get(head)
    field, depth = Scene.model_fields[head], 1
    annotation, metadata = field.annotation, field.metadata
    if head in LISTS and len(parts) > 1:
        annotation, metadata, depth = table, [], 2
    if table is not None and len(parts) > depth:
        field = _keys(table)[str(parts[depth])]
        annotation, metadata, depth = field.annotation, field.metadata, depth + 1
    while depth < len(parts) and isinstance(parts[depth], int):
        annotation, metadata, depth = _item(annotation), [], depth + 1
    extra = field.json_schema_extra
    unit = f", in {extra['x-unit']}" if isinstance(extra, dict) else ""
    return parts[:depth], _listed(_phrases(annotation, metadata)) + unit


def _item(annotation: Any) -> Any:
    """Return the type of the entries of a tuple, optional or not."""
    if get_origin(annotation) is tuple:
        return get_args(annotation)[0]
    return _item(get_args(annotation)[0])


def _phrases(annotation: Any, metadata: Iterable[Any] = ()) -> list[str]:
    """Say a type with its limits in words: a phrase for each alternative."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _phrases(arguments[0], [*_flat(arguments[1:]), *metadata])
    if origin in (Union, types.UnionType):
        members = [member for member in arguments if member is not types.NoneType]
        return [phrase for member in members for phrase in _phrases(member, metadata)]
    if origin is Literal:
        return [f'"{choice}"' for choice in arguments]
    if annotation == Point:
        return ["a point [x, y] of two numbers"]
    if annotation == tuple[Point, ...]:
        return [f"a list of 2 to {MOST_POINTS} points [[x, y], ...]"]
    if origin is tuple:
        (most,) = (limit.max_length for limit in metadata if isinstance(limit, MaxLen))
        return [f"at most {most} tables, each headed by [[{arguments[0].__name__.lower()}]]"]
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return ["a table of keys and values"]
    return [_WORDS[annotation] + _range(metadata)]


def _flat(metadata: Iterable[Any]) -> Iterator[Any]:
    # A Field inside Annotated carries its limits one level down.
    for item in metadata:
        if isinstance(item, FieldInfo):
            yield from item.metadata
        else:
            yield item


def _range(metadata: Iterable[Any]) -> str:
    lower, upper = "", ""
    for limit in metadata:
        match limit:
            case Ge(ge=bound):
                lower = f">= {_bound(bound)}"
            case Gt(gt=bound):
                lower = f"> {_bound(bound)}"
            case Le(le=bound):
                upper = f"<= {_bound(bound)}"
            case Lt(lt=bound):
                upper = f"< {_bound(bound)}"
            case MaxLen(max_length=bound):
                upper = f"of at most {bound} characters"
    if lower.startswith(">= ") and upper.startswith("<= "):
        return f" from {lower[3:]} to {upper[3:]}"
    limits = " and ".join(part for part in (lower, upper) if part)
    return f" {limits}" if limits else ""


def _bound(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) and abs(value) < 1e6 else str(int(value))


def _listed(choices: Iterable[str]) -> str:
    *first, last = choices
    return f"{', '.join(first)} or {last}" if first else last


def _nearest(key: str, known: Iterable[str]) -> list[str]:
    return difflib.get_close_matches(key, list(known), n=1, cutoff=_NEAR)


def _unknown(parts: Location) -> str:
    """Say that a key is unknown, and which one was probably meant."""
    *above, last = parts
    key = str(last)
    table = Scene.tables()[str(above[0])] if above else Scene
    known = _keys(table)
    if near := _nearest(key, known):
        return f"unknown key; did you mean {joined((*above, *near))}?"
    homes = [
        f"[[{name}]]" if name in LISTS else f"[{name}]"
        for name, other in Scene.tables().items()
        if key in _keys(other)
    ]
    if homes:
        return f"unknown key here; it belongs in {_listed(homes)}"
    return f"unknown key; known here are {', '.join(known)}"
