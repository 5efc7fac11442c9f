"""Scenes that differ in numbers only, as one scene whose varied keys hold arrays (N,).

For those who calculate many at once: `chutelab.machine.build` takes a family as it takes a scene.
Nothing else does, unless it says so.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from pydantic import TypeAdapter, ValidationError

from chutelab.scene.loading import plain
from chutelab.scene.models import Scene
from chutelab.scene.overrides import apply
from chutelab.scene.rules import Look, conflicts

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

_PATH: Final = re.compile(r"(?:(\w+)(?:\[(\d+)\])?\.)?(\w+)")

_DEPENDENT: Final = {"plate": "pivot_height", "outgoing": "speed"}
"""Keys whose defaults are other keys."""


def _parted(path: str) -> tuple[str | None, int | None, str] | None:
    """Take ``surface[0].speed`` apart: table, index, key; None if it goes deeper."""
    match = _PATH.fullmatch(path)
    if match is None:
        return None
    return match[1], None if match[2] is None else int(match[2]), match[3]


def is_plain(path: str) -> bool:
    """Tell whether a key holds a number that is no whole one, nor part of a list."""
    parts = _parted(path)
    if parts is None:
        return False
    table, index, key = parts
    if table not in (None, *Scene.tables()) or (index is not None) != (table == "surface"):
        return False
    field = (Scene if table is None else Scene.tables()[table]).model_fields.get(key)
    return (
        field is not None
        and "float" in str(field.annotation)
        and "tuple" not in str(field.annotation)
    )


def accepted(path: str, values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which values a key takes, (N,), if nothing else is looked at."""
    good = np.ones(len(values), dtype=bool)
    try:
        _adapter(path).validate_python(values.tolist())
    except ValidationError as error:
        good[[int(fault["loc"][0]) for fault in error.errors(include_url=False)]] = False
    return good


@cache
def _adapter(path: str) -> TypeAdapter[Any]:
    """Return what validates a list of values of a key as its model does."""
    parts = _parted(path)
    assert parts is not None
    field = (Scene if parts[0] is None else Scene.tables()[parts[0]]).model_fields[parts[2]]
    kind: Any = field.annotation
    for limit in field.metadata:
        kind = Annotated[kind, limit]
    return TypeAdapter(list[kind])


class _Noting(Look):
    """Notes which keys the rules ask for: they cannot depend on another one."""

    def __init__(self, document: Mapping[str, Any], model: Any) -> None:
        super().__init__(document, model)
        self.asked: set[str] = set()

    def __call__(self, table: str, key: str) -> Any:
        self.asked.add(f"{table}.{key}")
        return super().__call__(table, key)


def judged_by(mapping: Mapping[str, Any], overrides: Sequence[str] = ()) -> set[str]:
    """Return the keys of tables whose numbers decide whether a scene contradicts itself.

    Another number under any other key makes no contradiction, nor takes one away.

    Parameters
    ----------
    mapping, overrides
        As `chutelab.scene.from_dict` takes them; each key by itself must be right.
    """
    document = plain(mapping)
    apply(document, overrides)
    look = _Noting(document, Scene)
    for _ in conflicts(look):
        pass
    return look.asked


def family(scene: Scene, columns: Mapping[str, NDArray[np.float64]]) -> Scene:
    """Return scenes that differ in plain numbers; they are not validated.

    Parameters
    ----------
    scene : Scene
        What they share, defaults included.
    columns : mapping of ndarray, (N,)
        Values of each varied key by its full path, such as ``plate.angle_deg``.

    Returns
    -------
    Scene
        With arrays under these keys, and under those whose defaults they are; `Scene.members` is N.
    """
    changes: dict[str, Any] = {}
    for path, values in columns.items():
        parts = _parted(path)
        assert parts is not None
        table, index, key = parts
        if table is None:
            changes[key] = values
        elif index is None:
            given = changes.get(table, getattr(scene, table))
            changes[table] = given.model_copy(update={key: values})
        else:
            surfaces = list(changes.get(table, scene.surface))
            surfaces[index] = surfaces[index].model_copy(update={key: values})
            changes[table] = tuple(surfaces)
    for table, key in _DEPENDENT.items():
        given = changes.get(table, getattr(scene, table))
        if given is not None and key not in given.model_fields_set:
            changes[table] = given.model_copy(update={key: None})
    many = scene.model_copy(update=changes)
    many._source, many._members = scene.source, len(next(iter(columns.values())))
    many._fill_defaults()
    return many
