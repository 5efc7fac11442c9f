"""The code of a notebook file."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

LARGEST = 50 << 20
"""Bytes; a notebook with its pictures is a tenth of it."""


class NotebookError(ValueError):
    """A file that is no notebook; its text says why."""


def code_of(path: Path) -> list[str]:
    """Return the code cells of a notebook, of any version that has cells.

    Raises
    ------
    NotebookError
        If it cannot be read.
    """
    try:
        size = path.stat().st_size
        text = path.read_text(encoding="utf-8") if size <= LARGEST else ""
    except OSError as error:
        raise NotebookError(f"cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise NotebookError("not a notebook: not UTF-8 text") from None
    if size > LARGEST:
        raise NotebookError(f"too large for a notebook, which has at most {LARGEST >> 20} MB")
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise NotebookError("not a notebook: not JSON") from None
    cells = _cells(found)
    if cells is None:
        raise NotebookError("not a notebook: it has no cells")
    return cells


def _cells(found: Any) -> list[str] | None:
    if not isinstance(found, dict) or not isinstance(found.get("cells"), list):
        return None
    code = [
        cell.get("source", "")
        for cell in found["cells"]
        if isinstance(cell, dict) and cell.get("cell_type") == "code"
    ]
    # A source is a text, or a list of lines.
    return ["".join(map(str, source)) for source in code]
