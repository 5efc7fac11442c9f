"""A new lesson, from the template or as a copy of another: it validates and builds at once."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Final

from chutelab.lessons.reading import LessonError, read
from chutelab.scene import Fault

if TYPE_CHECKING:
    from chutelab.lessons.models import Lesson

_TEMPLATE: Final = ("lesson.toml", "README.md", "scene.toml")
_NAME: Final = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_MOST: Final = 60


def start(path: str | Path, model: Lesson | None = None) -> Path:
    """Make the folder of a new lesson, whole or not at all.

    Parameters
    ----------
    path
        The folder; its name is the lesson's: lower-case letters, digits and hyphens.
    model
        A lesson to copy with all its files; by default there is a template.

    Raises
    ------
    LessonError
        If the name will not do, or something is there already: nothing is overwritten.
    OSError
        If it cannot be written.
    """
    path = Path(path)
    if not _NAME.fullmatch(path.name) or len(path.name) > _MOST:
        text = (
            f"must be 1 to {_MOST} lower-case letters, digits and hyphens, such as my-lesson"
            " or 09-my-lesson"
        )
        raise LessonError(str(path), [Fault("name", path.name, text)])
    if path.exists() or path.is_symlink():
        raise LessonError(str(path), [Fault("", None, "is there already; choose another name")])
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as made:
        unfinished = Path(made) / path.name
        unfinished.mkdir()
        if model is None:
            _fill_in(unfinished)
        else:
            for file in files_of(model):
                shutil.copyfile(file, unfinished / file.name)
        read(unfinished)
        unfinished.rename(path)
    return path


def files_of(lesson: Lesson) -> list[Path]:
    """Return the files of a lesson in alphabetical order, hidden ones left out."""
    found = lesson.folder.iterdir()
    return sorted(path for path in found if path.is_file() and not path.name.startswith("."))


def _fill_in(folder: Path) -> None:
    title = re.sub(r"^\d+-", "", folder.name).replace("-", " ").capitalize()
    for name in _TEMPLATE:
        text = (Path(__file__).parent / "template" / name).read_text(encoding="utf-8")
        quoted = json.dumps(title) if name.endswith(".toml") else title
        (folder / name).write_text(text.replace("TITLE", quoted), encoding="utf-8")
