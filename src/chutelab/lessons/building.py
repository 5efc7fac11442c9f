"""``lesson.gif``: made anew only if what it is made from has changed."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from chutelab.files import whole
from chutelab.lessons.reading import scene_of
from chutelab.lessons.stamp import Stamp
from chutelab.scene import to_dict
from chutelab.simulation import simulate
from chutelab.versions import version_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from chutelab.lessons.models import Lesson
    from chutelab.scene import Scene

PICTURE: Final = "lesson.gif"
LIBRARIES: Final = ("chutelab", "numpy", "pymunk", "matplotlib", "pillow")
"""What decides on the bytes of a picture, besides its inputs."""


@dataclass(frozen=True)
class Built:
    """A lesson's picture after `build`: where it is, its size, and whether it had to be made."""

    path: Path
    size: int
    made: bool


def build(
    lesson: Lesson,
    folder: Path | None = None,
    *,
    force: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Built:
    """Make the picture of a lesson, unless it is there already, made from the same.

    The same lesson and versions give the same bytes.

    Parameters
    ----------
    lesson : Lesson
        From `chutelab.lessons.find`.
    folder : Path, optional
        Where to write it (made if need be); default: the lesson's own folder.
    force : bool
        Make it even so.
    progress : callable, optional
        Called with the share of the simulation that is done, 0 to 1.

    Raises
    ------
    SceneError
        If the scene cannot be run.
    OSError
        If the file cannot be written.
    """
    path = (lesson.folder if folder is None else folder) / PICTURE
    scene = scene_of(lesson, lesson.picture.scene, lesson.picture.set)
    wanted = stamp_of(lesson, scene)
    if not force and path.is_file() and Stamp.of(path.read_bytes()) == wanted:
        return Built(path, path.stat().st_size, made=False)
    from chutelab.animate import animate

    settings = lesson.picture
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole(path) as unfinished:
        animate(
            simulate(scene, progress=progress),
            unfinished,
            fps=settings.fps,
            width=settings.width,
            height=settings.height,
            slow=settings.slow,
            question=lesson.question,
        )
        unfinished.write_bytes(wanted.on(unfinished.read_bytes()))
    return Built(path, path.stat().st_size, made=True)


def is_current(lesson: Lesson) -> bool:
    """Tell whether a lesson's picture shows what the lesson says, with whatever versions made."""
    path = lesson.folder / PICTURE
    if not path.is_file():
        return False
    scene = scene_of(lesson, lesson.picture.scene, lesson.picture.set)
    found = Stamp.of(path.read_bytes())
    return found is not None and found.inputs == stamp_of(lesson, scene).inputs


def stamp_of(lesson: Lesson, scene: Scene) -> Stamp:
    """Return what the picture of a lesson is made from, `scene` being the one that is filmed."""
    # Defaults belong to the version, and what a scene promises does not show in its picture.
    document = {key: value for key, value in to_dict(scene).items() if key != "expect"}
    settings = lesson.picture.model_dump(exclude_unset=True, exclude={"scene", "set"})
    inputs = {"scene": document, "picture": settings, "question": lesson.question}
    text = json.dumps(inputs, sort_keys=True, ensure_ascii=True)
    digest = hashlib.sha256(text.encode("ascii")).hexdigest()[:32]
    return Stamp(digest, ", ".join(f"{name} {version_of(name) or 'unknown'}" for name in LIBRARIES))
