"""What is made of lessons: films and notebooks, new lessons, and all of them as web pages.

``lesson.gif`` is made anew only if what it is made from has changed; the stamp that tells is kept
in a comment of the GIF itself. A new lesson comes from the template or is a copy of another: it
validates and builds at once. The web pages need no server and no network; every link is relative.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from errno import ELOOP, ENOTDIR
from html import escape
from importlib.util import find_spec
from io import BytesIO
from math import prod
from pathlib import Path
from string import Template
from typing import Final
from urllib.parse import quote

from PIL.GifImagePlugin import GifImageFile

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises.catalogue import told
from chutelab.classroom.exercises.in_page import data_of
from chutelab.classroom.lessons.cells import name_of, notebook_of
from chutelab.classroom.lessons.printing import printed
from chutelab.classroom.lessons.reading import Lesson, LessonError, read, scene_of, split, unusable
from chutelab.classroom.lessons.texts import INDEX, html_of, own_words, words_for
from chutelab.classroom.lessons.wheel import write_wheel
from chutelab.classroom.words import Words, words
from chutelab.engines.simulation import judged
from chutelab.scene import Fault, to_dict
from chutelab.util.files import aside, refuse_other, together, whole
from chutelab.util.versions import own_version, version_of

_HERE: Final = Path(__file__).parent
PICTURE: Final = "lesson.gif"
MACHINE: Final = "machine.png"
SPLIT: Final = "split.png"
"""The film, the machine before anything has happened, and the velocity at the plate."""

MOST_PIXELS: Final = 3840 * 2160
"""Of a picture, as `Picture` in `reading` has it."""

LIBRARIES: Final = ("chutelab", "numpy", "pymunk", "matplotlib", "pillow")
"""What decides on the bytes of a picture, besides its inputs."""


@dataclass(frozen=True)
class Built:
    """A lesson's film, or its notebook, after `build`: where, its size, and whether it was made."""

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
    """Make film and machine picture of a lesson, unless they are there, made from the same.

    The same lesson and versions give the same bytes.

    Parameters
    ----------
    folder
        Where to write it (made if need be); default: the lesson's own folder.
    force
        Make it even so.
    progress
        Called with the share of the simulation that is done, 0 to 1.

    Raises
    ------
    SceneError
        If the scene cannot be run.
    OSError
        If the file cannot be written.
    """
    path = (lesson.folder if folder is None else folder) / PICTURE
    lesson = _in_english(lesson)
    wanted = stamp_of(lesson)
    machine = path.with_name(MACHINE)
    made = force or comment_of(path) != wanted or not machine.is_file()
    if made:
        from chutelab.pictures.animation import animate, still
        from chutelab.pictures.plots.figure import split_velocity

        with aside(path.parent, path):
            refuse_other(path)
        scene = scene_of(lesson, lesson.picture.scene, lesson.picture.set)
        # Lesson 8 shows a run that breaks a law.
        recording = judged(scene, progress=progress)
        settings = lesson.picture.model_dump(exclude={"scene", "set", "split"})
        path.parent.mkdir(parents=True, exist_ok=True)
        animate(recording, path, question=lesson.question, predict=True, comment=wanted, **settings)
        still(recording, machine, width=lesson.picture.width, height=lesson.picture.height)
        if lesson.picture.split:
            split_velocity(recording, path.with_name(SPLIT))
    return Built(path, path.stat().st_size, made)


def build_notebook(lesson: Lesson, folder: Path | None = None) -> Built | None:
    """Make the notebook of a lesson, unless it is there already; None if there is none to make.

    That is so if its worksheet has not all the parts of a notebook, see `cells`.

    Raises
    ------
    LessonError
        If a cell of the lesson's own belongs to no part.
    OSError
        If the file cannot be written.
    """
    text = notebook_of(lesson)
    if not text:
        return None
    path = (lesson.folder if folder is None else folder) / name_of(lesson.language)
    made = not path.is_file() or path.read_text(encoding="utf-8") != text
    if made:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8", newline="\n")
    return Built(path, path.stat().st_size, made)


def _in_english(lesson: Lesson) -> Lesson:
    """Return a lesson as its film has it, which speaks English whatever the lesson speaks."""
    return lesson if lesson.language == "en" else read(lesson.folder)


def is_current(lesson: Lesson) -> bool:
    """Tell whether a lesson's picture shows what the lesson says, with whatever versions made."""
    found, wanted = comment_of(lesson.folder / PICTURE), stamp_of(lesson)
    return found.split("; ")[:2] == wanted.split("; ")[:2]


def stamp_of(lesson: Lesson) -> str:
    """Return what determines every byte of a lesson's picture, in one line.

    That is a hash of the scene that is filmed and of the picture's settings, then the versions of
    all that simulates and draws.
    """
    lesson = _in_english(lesson)
    scene = to_dict(scene_of(lesson, lesson.picture.scene, lesson.picture.set))
    for table in ("expect", "live"):  # neither shows in its picture
        scene.pop(table, None)
    # Without defaults: they belong to the version.
    settings = lesson.picture.model_dump(exclude_unset=True, exclude={"scene", "set"})
    inputs = {"scene": scene, "picture": settings, "question": lesson.question, "predict": True}
    text = json.dumps(inputs, sort_keys=True, ensure_ascii=True)
    digest = hashlib.sha256(text.encode("ascii")).hexdigest()[:32]
    versions = ", ".join(f"{name} {version_of(name) or 'unknown'}" for name in LIBRARIES)
    return f"chutelab lesson; inputs {digest}; {versions}"


def comment_of(picture: Path) -> str:
    """Return the comment of a GIF file; "" if there is none, or no whole GIF of a sane size."""
    gif = picture.read_bytes() if picture.is_file() else b""
    try:
        with GifImageFile(BytesIO(gif)) as opened:
            size, comment = opened.size, opened.info.get("comment", b"")
    except SyntaxError:
        return ""
    if prod(size) > MOST_PIXELS:
        return ""
    # Every GIF ends with a semicolon.
    return str(comment.decode("ascii", "replace")) if gif.endswith(b";") else ""


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
        raise unusable(path, "is there already; choose another name")
    with aside(path.parent, path) as made:
        unfinished = made / path.name
        unfinished.mkdir()
        if model is None:
            title = split(path)[1].replace("-", " ").capitalize()
            for file in (_HERE / "template").iterdir():
                said = json.dumps(title) if file.suffix == ".toml" else title
                text = file.read_text(encoding="utf-8").replace("TITLE", said)
                (unfinished / file.name).write_text(text, encoding="utf-8")
        else:
            for file in files_of(model):
                shutil.copyfile(file, unfinished / file.name)
        made_lesson = read(unfinished)
        if model is None:
            build_notebook(made_lesson)
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished.rename(path)
    return path


def files_of(lesson: Lesson) -> list[Path]:
    """Return the files of a lesson in alphabetical order, hidden ones left out."""
    found = lesson.folder.iterdir()
    return sorted(path for path in found if path.is_file() and not path.name.startswith("."))


LIVE: Final = "page.html"
EXPLANATION: Final = "explanation.html"
STILL: Final = "still.png"
END: Final = "end.png"
"""The first picture of the film, and the last one: the answer is in it."""

_NOT_GIVEN: Final = re.compile(r"lesson(\..+)?\.toml")
"""The key for the teacher is in it."""

_SHARED: Final = ("style.css", "picture.js")


def bundle(
    lessons: Sequence[Lesson],
    folder: str | Path,
    progress: Callable[[float], None] | None = None,
    *,
    wheel: bool = True,
) -> list[Path]:
    """Write web pages into a folder: an index of the lessons, and a folder with a page for each.

    Everything is made aside first; files that are there already are replaced, others stay.

    Parameters
    ----------
    lessons
        In the order of the index.
    folder
        Made if need be.
    progress
        Called with the share that is done, 0 to 1.
    wheel
        Put the wheel of this chutelab in, and how to install from it.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    InputError
        If a lesson's scene cannot be run, or shown as a live page.
    MissingLibraryError
        If chutelab is not installed, so that there is no wheel.
    OSError
        If it cannot be written.
    """
    folder = Path(folder)
    _check_places(lessons, folder)
    for name in (INDEX, *_SHARED):
        refuse_other(folder / name)
    for lesson in lessons:
        if (there := folder / lesson.folder.name).exists() and not there.is_dir():
            raise NotADirectoryError(ENOTDIR, "it is a file, not a folder", str(there))
    with together(folder) as made:
        cards = ""
        for i, lesson in enumerate(lessons):
            before = _link(lessons[i - 1], "prev", "← {}") if i > 0 else ""
            after = _link(lessons[i + 1], "next", "{} →") if i + 1 < len(lessons) else ""
            folders = [one.folder.name for one in lessons]
            cards += _lesson(lesson, made, folders, before, after, wheel=wheel)
            if progress is not None:
                progress((i + 1) / len(lessons))
        said = words(lessons[0].language if lessons else "en")
        key = "page-count-one" if len(lessons) == 1 else "page-count"
        values = {"cards": cards, "count": said.say(key, count=len(lessons))}
        values["install"] = (
            _page("install.html", said, wheel=write_wheel(made).name) if wheel else ""
        )
        (made / INDEX).write_text(_page("index.html", said, **values), encoding="utf-8")
        for name in _SHARED:
            shutil.copyfile(_HERE / "assets" / name, made / name)
        files = [path.relative_to(made) for path in made.rglob("*") if path.is_file()]
    return [folder / file for file in sorted(files)]


def _check_places(lessons: Sequence[Lesson], folder: Path) -> None:
    """Refuse, before anything is made, what would be written over another's or out of a folder."""
    names = [INDEX, *_SHARED]
    for lesson in lessons:
        name = lesson.folder.name
        if not name or name in names:
            text = "another lesson, or a file of the pages, has the same name; rename the folder"
            raise unusable(lesson.folder, text)
        names.append(name)
        check_inside(folder / name)


def check_inside(folder: Path) -> None:
    """Refuse to write into a folder that is a link: an `OSError`."""
    if folder.is_symlink():
        raise OSError(ELOOP, "it is a symbolic link, which may lead anywhere", str(folder))


def _address(*names: str) -> str:
    """Return a relative address, in which no name is markup, a scheme, or the start of a query."""
    return "/".join(quote(os.fsencode(name)) for name in names)


def _lesson(
    lesson: Lesson, made: Path, folders: Sequence[str], before: str, after: str, *, wheel: bool
) -> str:
    """Make the folder of one of the lessons, with links to its neighbours; return its card."""
    folder = made / lesson.folder.name
    folder.mkdir()
    for file in files_of(lesson):
        if not _NOT_GIVEN.fullmatch(file.name):
            shutil.copyfile(file, folder / file.name)
    if not is_current(lesson):
        build(lesson, folder, force=True)
    with GifImageFile(folder / PICTURE) as film:
        for name, index in ((STILL, 0), (END, film.n_frames - 1)):
            film.seek(index)
            shown = film.convert("RGB").quantize(255)
            shown.info.pop("transparency", None)
            shown.save(folder / name, optimize=True)
        width, height = film.size
    said = words(lesson.language)
    say = said.say
    worksheet, explanation = lesson.text("README"), lesson.text("explanation")
    # What there is to play with, and to take along.
    doors = []
    if lesson.page is not None:
        home = (say("page-back", title=lesson.title), INDEX)
        live_page(lesson, folder / LIVE, home=home)
        doors.append(f'<li><a class="main" href="{LIVE}">{say("page-try")}</a></li>')
    kind = "pdf" if find_spec("typst") else "html"
    with suppress(LessonError):  # a worksheet of other parts is on the page alone
        (folder / f"worksheet.{kind}").write_bytes(printed(lesson, "student", kind))
        doors.append(f'<li><a href="worksheet.{kind}">{say("page-print")}</a></li>')
    names = (name_of(language) for language in (lesson.language, "en"))
    if book := next((name for name in names if (folder / name).is_file()), ""):
        door = f'<li><a href="{book}" download>{say("page-notebook")}</a></li>'
        doors.append(door)
        if wheel:
            doors.append(f'<li><a href="../{INDEX}#get">{say("page-get-door")}</a></li>')
    for name in lesson.scenes:
        if (folder / name).is_file():
            scene_door = escape(say("page-scene", name=name))
            doors.append(f'<li><a href="{_address(name)}" download>{scene_door}</a></li>')
    note = f"<p><em>{say('untranslated')}</em></p>\n" if lesson.untranslated else ""
    facts = {
        "folder": _address(lesson.folder.name),
        "title": heading(lesson),
        "question": escape(lesson.question),
        "about": say("show-about", level=say(f"level-{lesson.level}"), minutes=lesson.minutes),
        "width": str(width),
        "height": str(height),
    }
    page = _page(
        "lesson.html",
        said,
        **facts,
        alt=escape(words_for(MACHINE, worksheet) or lesson.title),
        worksheet=note + html_of(worksheet, folders),
        doors="\n".join(doors),
        before=before,
        after=after,
    )
    (folder / INDEX).write_text(page, encoding="utf-8")
    page = _page(
        "explanation.html",
        said,
        **facts,
        alt=escape(words_for(PICTURE, explanation) or lesson.title),
        explanation=html_of(explanation, folders),
        back=escape(say("page-back", title=lesson.title)),
    )
    (folder / EXPLANATION).write_text(page, encoding="utf-8")
    return _page("card.html", said, **facts)


def live_page(lesson: Lesson, path: str | Path, home: tuple[str, str] | None = None) -> int:
    """Write the live page of a lesson with its exercise, in its language; return the size in bytes.

    In a frame it tells the page around it, by ``postMessage``, ``{chutelab: "ready", lesson}``. A
    page that answers ``{chutelab: "begin", student, suspend_data}``, "" for the first time, says
    who this is and keeps what becomes of it: after each change it is told ``{chutelab: "progress",
    lesson, student, done, total, score, status, suspend_data, result}``, with a score of 100 for
    all, the status "incomplete" or "completed", at most 4000 characters of data to go on from, and
    the result as `chutelab.classroom.grading` takes it.

    Parameters
    ----------
    lesson
        One with a table ``[page]``.
    path
        A file; one that is there is replaced.
    home
        Text and address of a link back.

    Raises
    ------
    LessonError
        If the lesson says of no page what it is to offer.
    InputError
        If its scene cannot be shown as a live page.
    OSError
        If the page cannot be written.
    """
    from chutelab.pictures.live.page import write

    if lesson.page is None:
        text = "is missing: what the lesson's page offers; an empty table offers everything"
        raise LessonError(str(lesson.folder), [Fault("page", None, text)])
    scene = scene_of(lesson, lesson.page.scene, lesson.page.settings)
    exercise = None
    if lesson.name in EXERCISES:
        asked = own_words(lesson.text("README"))
        exercise = data_of(told(lesson.name, lesson.language), explain=asked or lesson.question)
    return write(scene, path, language=lesson.language, home=home, exercise=exercise)


def heading(lesson: Lesson) -> str:
    """Return number and title of a lesson, as HTML."""
    return escape(lesson.title if lesson.number is None else f"{lesson.number}. {lesson.title}")


def _link(lesson: Lesson, relation: str, form: str) -> str:
    text = form.format(heading(lesson))
    return f'<a rel="{relation}" href="../{_address(lesson.folder.name, INDEX)}">{text}</a>'


def _page(name: str, said: Words, **values: str) -> str:
    """Fill in a page: ``$page_all`` is what the catalogue has for "page-all"."""
    page = Template((_HERE / "assets" / name).read_text(encoding="utf-8"))
    version = own_version()
    values |= {
        name: escape(said.say(name.replace("_", "-")))
        for name in page.get_identifiers()
        if name.startswith("page_")
    }
    made_with = escape(said.say("page-made-with", version=version))
    known = {"language": said.language, "version": escape(version), "made_with": made_with}
    return page.substitute(values, **known)
