"""Lessons as web pages that need no server and no network, and as packages for learning platforms.

All links are relative. A package follows SCORM 1.2 (Content Aggregation Model, Run-Time
Environment): a zip of the manifest; ``index.html``, which is launched; ``scorm.js``, which speaks
with the platform; and the live page, in a frame, which speaks with ``scorm.js`` by messages.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from base64 import b64encode, urlsafe_b64encode
from collections.abc import Callable, Mapping, Sequence
from errno import ENOTDIR
from hashlib import sha256
from html import escape
from importlib.metadata import PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Final
from urllib.parse import quote
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from PIL.GifImagePlugin import GifImageFile

from chutelab.classroom.exercises import EXERCISES, data_of, told
from chutelab.classroom.lessons import Lesson, LessonError, called_in, scene_of, unusable
from chutelab.classroom.lessons.building import (
    MACHINE,
    PICTURE,
    build,
    check_inside,
    files_of,
    is_current,
    name_of,
)
from chutelab.classroom.lessons.sheets import printed, sheet, values_of, worksheet
from chutelab.classroom.lessons.steps import data_of as data_of_steps
from chutelab.classroom.lessons.texts import ASSETS, INDEX, asset, html_of, without_tex
from chutelab.scene import Fault
from chutelab.util.errors import MissingLibraryError, printable
from chutelab.util.files import own_version, refuse_other, together, whole
from chutelab.util.words import LANGUAGES, Words, words

LIVE: Final = "page.html"
EXPLANATION: Final = "explanation.html"
STILL: Final = "still.png"
END: Final = "end.png"
"""The first picture of the film, and the last one: the answer is in it."""

_NOT_GIVEN: Final = re.compile(r"lesson(\..+)?\.toml")
"""Not given to students: it contains the answers."""

_SHARED: Final = ("style.css", "picture.js")


def bundle(
    lessons: Sequence[Lesson],
    folder: str | Path,
    progress: Callable[[float], None] | None = None,
    *,
    wheel: bool = True,
) -> list[Path]:
    """Write web pages into a folder: an index of the lessons, and a folder with a page for each.

    Everything is made aside first; files that are there already are replaced, others stay. The
    index has the lessons in the order given. With `wheel` the wheel of this chutelab is put in, and
    how to install from it. `progress` is called with the share that is done, 0 to 1. Returns the
    files written.

    Raises an `InputError` if a lesson's scene cannot be run, or shown as a live page; a
    `MissingLibraryError` if chutelab is not installed, so that there is no wheel; an `OSError` if
    it cannot be written.
    """
    folder = Path(folder)
    names = [INDEX, *_SHARED]
    for name in names:
        refuse_other(folder / name)
    for lesson in lessons:
        there = folder / lesson.folder.name
        if not there.name or there.name in names:
            text = "another lesson, or a file of the pages, has the same name; rename the folder"
            raise unusable(lesson.folder, text)
        names.append(there.name)
        check_inside(there)
        if there.exists() and not there.is_dir():
            raise NotADirectoryError(ENOTDIR, "it is a file, not a folder", str(there))
    with together(folder) as made:
        cards = ""
        for i, lesson in enumerate(lessons):
            before = _link(lessons[i - 1], "prev", "← {}") if i > 0 else ""
            after = _link(lessons[i + 1], "next", "{} →") if i + 1 < len(lessons) else ""
            cards += _lesson(lesson, made, before, after, wheel=wheel)
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
            shutil.copyfile(ASSETS / name, made / name)
        files = [path.relative_to(made) for path in made.rglob("*") if path.is_file()]
    return [folder / file for file in sorted(files)]


def _address(*names: str) -> str:
    """Return a relative address with quoted names: no markup, scheme or query."""
    return "/".join(quote(os.fsencode(name)) for name in names)


def _lesson(lesson: Lesson, made: Path, before: str, after: str, *, wheel: bool) -> str:
    """Make the folder of one of the lessons, with links to its neighbours; return its card."""
    folder = made / lesson.folder.name
    folder.mkdir()
    others = {
        called_in(name, one)
        for one in LANGUAGES
        for name in (PICTURE, MACHINE)
        if one != lesson.language
    }
    for file in files_of(lesson):
        if not _NOT_GIVEN.fullmatch(file.name) and file.name not in others:
            shutil.copyfile(file, folder / file.name)
    if not is_current(lesson):
        build(lesson, folder, force=True)
    film_name = called_in(PICTURE, lesson.language)
    with GifImageFile(folder / film_name) as film:
        for name, index in ((STILL, 0), (END, film.n_frames - 1)):
            film.seek(index)
            shown = film.convert("RGB").quantize(255)
            shown.info.pop("transparency", None)
            shown.save(folder / name, optimize=True)
        width, height = film.size
    said = words(lesson.language)
    say = said.say
    asked, explanation = worksheet(lesson), sheet(lesson, "explanation")
    # Links to the live page, the sheet, the notebook and the scenes.
    doors = []
    if lesson.page is not None:
        home = (say("page-back", title=lesson.title), INDEX)
        live_page(lesson, folder / LIVE, home=home)
        doors.append(f'<li><a class="main" href="{LIVE}">{say("page-try")}</a></li>')
    kind = "pdf" if find_spec("typst") else "html"
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
        "title": escape(lesson.heading),
        "question": escape(lesson.question),
        "about": say("show-about", level=say(f"level-{lesson.level}"), minutes=lesson.minutes),
        "film": film_name,
        "width": str(width),
        "height": str(height),
    }
    page = _page(
        "lesson.html",
        said,
        **facts,
        alt=escape(lesson.picture.machine or lesson.title),
        worksheet=note + html_of(asked),
        doors="\n".join(doors),
        before=before,
        after=after,
    )
    (folder / INDEX).write_text(page, encoding="utf-8")
    page = _page(
        "explanation.html",
        said,
        **facts,
        alt=escape(lesson.picture.film or lesson.title),
        explanation=html_of(explanation),
        back=escape(say("page-back", title=lesson.title)),
    )
    (folder / EXPLANATION).write_text(page, encoding="utf-8")
    return _page("card.html", said, **facts)


def live_page(lesson: Lesson, path: str | Path, home: tuple[str, str] | None = None) -> int:
    """Write the live page of a lesson with its exercise, in its language; return the size in bytes.

    A file that is there is replaced; `home` is text and address of a link back. In a frame the page
    tells the page around it, by ``postMessage``, ``{chutelab: "ready", lesson}``. A page that
    answers ``{chutelab: "begin", student, suspend_data}``, "" for the first time, names the student
    and keeps the state: after each change it is told ``{chutelab: "progress", lesson, student,
    done, total, score, status, suspend_data, result}``, with a score of 100 for all, the status
    "incomplete" or "completed", at most 4000 characters of data to go on from, and the result as
    `chutelab.classroom.grading` takes it.

    Raises a `LessonError` if the lesson has no table ``[page]``, which says what the page offers;
    an `InputError` if its scene cannot be shown as a live page; an `OSError` if the page cannot be
    written.
    """
    from chutelab.pictures.live import write

    if lesson.page is None:
        text = "is missing: what the lesson's page offers; an empty table offers everything"
        raise LessonError(str(lesson.folder), [Fault("page", None, text)])
    scene = scene_of(lesson, lesson.page.scene, lesson.page.settings)
    exercise, said = None, words(lesson.language)
    steps = data_of_steps(lesson.steps, tuple(scene.live.controls or ()), said)
    for step, data in zip(lesson.steps, steps, strict=True):
        # Text until the page puts a field in its place, and on paper.
        value = values_of(lesson, step)
        for key in dict.fromkeys(_FIELD.findall(data["text"])):
            place = f'<span data-key="{key}">'
            data["text"] = data["text"].replace(place, place + value(key))
    told_lesson = {
        "name": lesson.name,
        "title": lesson.heading,
        "question": lesson.question,
        "steps": steps,
    }
    if lesson.name in EXERCISES:
        own = [ask.text for one in lesson.steps if one.kind == "explain" for ask in one.asks]
        explain = without_tex(" ".join(own[-1].split())) if own else lesson.question
        exercise = data_of(told(lesson.name, lesson.language), explain=explain)

    def inlined(found: re.Match[str]) -> str:
        """Return a picture beside the lesson as an address that holds it: a page is one file."""
        data = b64encode((lesson.folder / found[0]).read_bytes()).decode("ascii")
        return f"data:image/png;base64,{data}"

    told_lesson = json.loads(_PICTURE.sub(inlined, json.dumps(told_lesson)))
    return write(
        scene, path, language=lesson.language, home=home, exercise=exercise, lesson=told_lesson
    )


_FIELD = re.compile(r'<span data-key="([\w.]+)">')
"""The place of a value in a text, and its key."""

_PICTURE = re.compile(r'(?<= src=\\")[\w.-]+\.png(?=\\")')
"""The file of a picture in a text of a lesson, in JSON."""


def _link(lesson: Lesson, relation: str, form: str) -> str:
    text = form.format(escape(lesson.heading))
    return f'<a rel="{relation}" href="../{_address(lesson.folder.name, INDEX)}">{text}</a>'


def _page(name: str, said: Words, **values: str) -> str:
    """Fill in a page: ``$page_all`` is what the catalogue has for "page-all"."""
    page = Template(asset(name))
    version = own_version()
    values |= {
        name: escape(said.say(name.replace("_", "-")))
        for name in page.get_identifiers()
        if name.startswith("page_")
    }
    made_with = escape(said.say("page-made-with", version=version))
    known = {"language": said.language, "version": escape(version), "made_with": made_with}
    return page.substitute(values, **known)


_PACKED: Final = ("imsmanifest.xml", "index.html", "scorm.js")
"""Files of a package besides the live page."""


def package(lesson: Lesson, path: str | Path) -> Path:
    """Write the SCORM 1.2 package of a lesson, in its language: a zip file, whole or not at all.

    Raises a `LessonError` if the lesson has no live page with an exercise, which is what is in the
    package; an `OSError` if it cannot be written.
    """
    if lesson.page is None or lesson.name not in EXERCISES:
        text = "a package is a live page with an exercise, and it has none"
        raise unusable(lesson.folder, text)
    values = {
        # An XML name begins with a letter and has no spaces.
        "identifier": "chutelab-" + re.sub(r"[^A-Za-z0-9_.-]", "-", lesson.name),
        "title": printable(escape(lesson.heading)),
        "language": lesson.language,
        "page": LIVE,
        "alone": escape(words(lesson.language).say("scorm-alone")),
    }
    contents = {}
    for name in _PACKED:
        text = asset(f"scorm/{name}")
        said = text if name.endswith(".js") else Template(text).substitute(values)
        contents[name] = said.encode("utf-8")
    with whole(path) as made:
        live_page(lesson, page := made.with_name(LIVE))
        _zip(made, {**contents, LIVE: page.read_bytes()})
    return Path(path)


def _zip(path: Path, contents: Mapping[str, bytes]) -> None:
    """Write a zip file; the same contents make the same bytes."""
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for name, data in contents.items():
            entry = ZipInfo(name)  # of 1980
            entry.create_system = 3  # Unix, wherever it is made
            entry.external_attr = 0o644 << 16
            entry.compress_type = ZIP_DEFLATED
            archive.writestr(entry, data)


_SOURCES: Final = (".c", ".h", ".pyc", ".ts")
"""Endings of files that are left out of the wheel."""

_FORM: Final = b"""\
Wheel-Version: 1.0
Generator: chutelab
Root-Is-Purelib: true
Tag: py3-none-any
"""


def write_wheel(folder: Path) -> Path:
    """Write the wheel of this chutelab into a folder, made if need be, for users of the pages.

    It is made of chutelab's own files, in a checkout with the scenes and lessons beside ``src``,
    and of what the installer keeps: no network, no tools for building. The form is that of the
    binary distribution format, PEP 427. The same chutelab gives the same bytes.

    Raises a `MissingLibraryError` if chutelab is not installed, so that nothing says what it needs;
    an `OSError` if it cannot be written.
    """
    try:
        installed = distribution("chutelab")
    except PackageNotFoundError as error:
        text = "the wheel for students is made of an installed chutelab; install it, or --no-wheel"
        raise MissingLibraryError(text) from error
    package = Path(__file__).parents[2]
    places = {"chutelab": package}
    if not (package / "data").is_dir():
        beside = package.parents[1]
        places |= {f"chutelab/data/{one}": beside / one for one in ("scenes", "lessons")}
    contents = {}
    for place, home in places.items():
        for path in home.rglob("*"):
            name = path.relative_to(home)
            hidden = any(part.startswith(".") for part in name.parts)
            if path.is_file() and path.suffix not in _SOURCES and not hidden:
                contents[f"{place}/{name.as_posix()}"] = path.read_bytes()
    contents = dict(sorted(contents.items()))
    about = f"chutelab-{installed.version}.dist-info"
    for file in ("METADATA", "entry_points.txt", "licenses/LICENSE"):
        contents[f"{about}/{file}"] = (installed.read_text(file) or "").encode("utf-8")
    contents[f"{about}/WHEEL"] = _FORM
    record = ""
    for file, data in contents.items():
        digest = urlsafe_b64encode(sha256(data).digest()).rstrip(b"=").decode("ascii")
        record += f"{file},sha256={digest},{len(data)}\n"
    contents[f"{about}/RECORD"] = f"{record}{about}/RECORD,,\n".encode()
    folder.mkdir(parents=True, exist_ok=True)
    made = folder / f"chutelab-{installed.version}-py3-none-any.whl"
    _zip(made, contents)
    return made
