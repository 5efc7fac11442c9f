"""A scene as TOML text, to be loaded again."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from chutelab.scene import to_dict

if TYPE_CHECKING:
    from chutelab.scene import Scene


def to_toml(scene: Scene, comment: str = "") -> str:
    """Return the keys of a scene that were set, as the text of a scene file.

    Its ``[[expect]]`` are left out: they were promised for another scene.

    Parameters
    ----------
    comment : str
        Lines to begin with.

    Examples
    --------
    >>> from chutelab.scene import load, parse
    >>> scene = load("perpendicular")
    >>> parse(to_toml(scene)).plate == scene.plate
    True
    """
    document = {key: value for key, value in to_dict(scene).items() if key != "expect"}
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    lines += [""] if lines else []
    for key, value in document.items():
        if not isinstance(value, dict) and not _tables(value):
            lines.append(f"{key} = {_value(value)}")
    for key, value in document.items():
        for table in value if _tables(value) else [value]:
            if isinstance(table, dict):
                lines += ["", f"[[{key}]]" if _tables(value) else f"[{key}]"]
                lines += [f"{k} = {_value(v)}" for k, v in table.items() if v is not None]
    return "\n".join(lines) + "\n"


def _tables(value: Any) -> bool:
    return isinstance(value, (list, tuple)) and bool(value) and isinstance(value[0], dict)


def _value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            # JSON's strings are TOML's, but for one character that only TOML wants escaped.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case list() | tuple():
            return f"[{', '.join(map(_value, value))}]"
    return repr(value)
