"""All lessons as a folder of web pages: no server, no network, every link relative."""

from __future__ import annotations

import shutil
import tempfile
from errno import ENOTDIR
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Final

from chutelab.lessons.building import PICTURE, build, is_current
from chutelab.lessons.reading import scene_of
from chutelab.lessons.starting import files_of
from chutelab.lessons.worksheets import html_of, pictures_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from chutelab.lessons.models import Lesson

LIVE: Final = "page.html"
STILL: Final = "still.png"
INDEX: Final = "index.html"
_SHARED: Final = ("style.css", "picture.js")


def bundle(
    lessons: Sequence[Lesson],
    folder: str | Path,
    progress: Callable[[float], None] | None = None,
) -> list[Path]:
    """Write pages of lessons into a folder: an index, and a folder with a page for each lesson.

    Everything is made aside first; files that are there already are replaced, others stay.

    Parameters
    ----------
    lessons : sequence of Lesson
        In the order of the index.
    folder : path
        Made if need be.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    SceneError, VaryError, PageError
        If a lesson's scene cannot be run or varied.
    OSError
        If it cannot be written.
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(ENOTDIR, "it is a file, not a folder", str(folder))
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".chutelab-", dir=folder.parent) as unfinished:
        made = Path(unfinished)
        cards = []
        for i, lesson in enumerate(lessons):
            around = (lessons[i - 1] if i else None, (*lessons, None)[i + 1])
            size = _lesson(lesson, made / lesson.folder.name, around, _part(progress, i, lessons))
            cards.append(_filled("card.html", lesson, size))
        many = "One lesson" if len(lessons) == 1 else f"{len(lessons)} lessons"
        index = _page("index.html", cards="".join(cards), count=many)
        (made / INDEX).write_text(index, encoding="utf-8")
        for name in _SHARED:
            (made / name).write_text(_asset(name), encoding="utf-8")
        return _moved(made, folder)


def _lesson(
    lesson: Lesson,
    folder: Path,
    around: tuple[Lesson | None, Lesson | None],
    progress: Callable[[float], None] | None,
) -> tuple[int, int]:
    """Make the folder of one lesson; return the size of its picture, pixels."""
    folder.mkdir()
    for file in files_of(lesson):
        shutil.copyfile(file, folder / file.name)
    if not is_current(lesson):
        build(lesson, folder, force=True)
    size = _still(folder / PICTURE, folder / STILL)
    _live(lesson, folder, progress)
    markdown = lesson.worksheet.read_text(encoding="utf-8") if lesson.worksheet.is_file() else ""
    page = _filled(
        "lesson.html",
        lesson,
        size,
        alt=escape(pictures_of(markdown).get(PICTURE, lesson.title)),
        worksheet=html_of(markdown),
        doors="\n".join(_doors(lesson, folder)),
        before=_link(around[0], "prev", "← {}"),
        after=_link(around[1], "next", "{} →"),
    )
    (folder / INDEX).write_text(page, encoding="utf-8")
    return size


def _live(lesson: Lesson, folder: Path, progress: Callable[[float], None] | None) -> None:
    from chutelab.page import write

    if lesson.page is not None:
        scene = scene_of(lesson, lesson.page.scene, lesson.page.set)
        home = (f"Back to the lesson: {lesson.title}", INDEX)
        write(scene, lesson.page.vary, folder / LIVE, home=home, progress=progress)


def _still(gif: Path, png: Path) -> tuple[int, int]:
    """Write the last frame of a picture, on which everything has happened."""
    from PIL.GifImagePlugin import GifImageFile

    with GifImageFile(gif) as film:
        film.seek(film.n_frames - 1)
        film.convert("RGB").quantize(255).save(png, optimize=True)
        return film.size


def _doors(lesson: Lesson, folder: Path) -> list[str]:
    """Return the ways on from a lesson's page: what there is to play with, and to take along."""
    doors = []
    if (folder / LIVE).is_file():
        doors.append(f'<li><a class="main" href="{LIVE}">Try it: change the machine</a></li>')
    if (folder / "exercise.ipynb").is_file():
        doors.append('<li><a href="exercise.ipynb" download>Exercise (Jupyter notebook)</a></li>')
    own = [name for name in lesson.scenes if (folder / name).is_file()]
    said = [escape(name) for name in own]
    return [*doors, *(f'<li><a href="{name}" download>Scene {name}</a></li>' for name in said)]


def _link(lesson: Lesson | None, relation: str, form: str) -> str:
    if lesson is None:
        return ""
    number = "" if lesson.number is None else f"{lesson.number}. "
    text = form.format(number + escape(lesson.title))
    return f'<a rel="{relation}" href="../{lesson.folder.name}/{INDEX}">{text}</a>'


def _filled(name: str, lesson: Lesson, size: tuple[int, int], **more: str) -> str:
    """Fill an asset with what is known of a lesson."""
    return _page(
        name,
        folder=lesson.folder.name,
        number="" if lesson.number is None else f"{lesson.number}. ",
        title=escape(lesson.title),
        question=escape(lesson.question),
        level=lesson.level,
        minutes=str(lesson.minutes),
        width=str(size[0]),
        height=str(size[1]),
        **more,
    )


def _page(name: str, **values: str) -> str:
    import chutelab

    return Template(_asset(name)).substitute(version=escape(chutelab.__version__), **values)


def _asset(name: str) -> str:
    return (files("chutelab.lessons") / "assets" / name).read_text(encoding="utf-8")


def _part(
    progress: Callable[[float], None] | None, done: int, lessons: Sequence[Lesson]
) -> Callable[[float], None] | None:
    """Return a progress of one lesson's share of all."""
    if progress is None:
        return None
    return lambda share: progress((done + share) / len(lessons))


def _moved(made: Path, folder: Path) -> list[Path]:
    """Move all files of a tree into a folder, replacing those of the same name."""
    written = []
    for file in sorted(path for path in made.rglob("*") if path.is_file()):
        target = folder / file.relative_to(made)
        target.parent.mkdir(parents=True, exist_ok=True)
        file.replace(target)
        written.append(target)
    return written
