"""Files that are written whole or not at all."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from errno import ENOENT
from pathlib import Path


@contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """Give a path to write to; it becomes `path` at the end, or is removed after an exception.

    It lies in the same directory, so that the last step is one atomic rename.
    """
    path = Path(path)
    if not path.parent.exists():
        # Else the error would name the temporary folder.
        raise FileNotFoundError(ENOENT, "there is no such folder", str(path.parent))
    with tempfile.TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as folder:
        unfinished = Path(folder) / path.name
        yield unfinished
        unfinished.replace(path)
