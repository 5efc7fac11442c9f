"""The shipped lessons, found by number, by name or by folder."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from chutelab.hints import did_you_mean
from chutelab.lessons.reading import PLAN, LessonError, read
from chutelab.scene import Fault
from chutelab.scene import shipped as shipped_scenes

if TYPE_CHECKING:
    from chutelab.lessons.models import Lesson


def shipped() -> list[Lesson]:
    """Return the shipped lessons in the order of their numbers.

    Raises
    ------
    LessonError
        With the faults of the first that is broken.
    """
    return [read(folder) for folder in _folders()]


def find(wanted: str | int | Path) -> Lesson:
    """Return one lesson.

    Parameters
    ----------
    wanted
        A number (3, "3" or "03"), a name ("the-bounce" or "03-the-bounce"), or a folder that holds
        a ``lesson.toml``.

    Raises
    ------
    LessonError
        If there is none; it suggests shipped lessons. Or with the faults of the lesson.
    """
    said = str(wanted).strip().rstrip("/")
    folders = _folders()
    for folder in folders:
        number, name = folder.name.split("-", 1)
        same_number = said.isdecimal() and int(said) == int(number)
        if same_number or said.lower() in (name, folder.name):
            return read(folder)
    path = Path(said)
    if (path / PLAN).is_file():
        return read(path)
    if path.name == PLAN and path.is_file():
        return read(path.parent)
    names = [folder.name.split("-", 1)[1] for folder in folders]
    listed = ", ".join(folder.name for folder in folders)
    advice = did_you_mean(said.lower(), names, f"there are {listed}", most=2)
    text = f"no lesson of this number or name, and no folder with a {PLAN}; {advice}"
    raise LessonError(said or '""', [Fault("", None, text)])


def home() -> Path | None:
    """Return the folder of the shipped lessons: beside that of the scenes, wherever that is."""
    for scene in shipped_scenes().values():
        folder = scene.parent.parent / "lessons"
        return folder if folder.is_dir() else None
    return None


def _folders() -> list[Path]:
    folder = home()
    found = folder.glob("*/" + PLAN) if folder else ()
    numbered = [path.parent for path in found if re.match(r"\d+-.", path.parent.name)]
    return sorted(numbered, key=lambda path: (int(path.name.split("-")[0]), path.name))
