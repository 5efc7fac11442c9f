"""SCORM 1.2 packages: a lesson's live page for a learning platform, which keeps its score.

A package is a zip of four files: the manifest; ``index.html``, which is launched; ``scorm.js``,
which speaks with the platform; and the page, in a frame, which speaks with ``scorm.js`` by
messages. After SCORM 1.2, Content Aggregation Model (manifest) and Run-Time Environment (calls).
"""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from string import Template
from typing import Final
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.lessons.building import LIVE, heading, live_page
from chutelab.classroom.lessons.reading import Lesson, LessonError
from chutelab.classroom.words import words
from chutelab.scene import Fault
from chutelab.util.errors import printable
from chutelab.util.files import whole

MANIFEST: Final = "imsmanifest.xml"
_ASSETS: Final = Path(__file__).parent / "assets" / "scorm"
_FILES: Final = (MANIFEST, "index.html", "scorm.js", LIVE)
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)
"""When all files in a package were made: the same lesson makes the same bytes."""


def package(lesson: Lesson, path: str | Path) -> Path:
    """Write the SCORM 1.2 package of a lesson, in its language: a zip file, whole or not at all.

    Raises
    ------
    LessonError
        If the lesson has no live page with an exercise, which is what is in the package.
    OSError
        If it cannot be written.
    """
    if lesson.page is None or lesson.name not in EXERCISES:
        fault = Fault("", None, "a package is a live page with an exercise, and it has none")
        raise LessonError(str(lesson.folder), [fault])
    values = {
        # An XML name begins with a letter and has no spaces.
        "identifier": "chutelab-" + re.sub(r"[^A-Za-z0-9_.-]", "-", lesson.name),
        "title": printable(heading(lesson)),
        "language": lesson.language,
        "page": LIVE,
        "alone": escape(words(lesson.language).say("scorm-alone")),
    }
    with whole(path) as made:
        page = made.with_name(LIVE)
        live_page(lesson, page)
        with ZipFile(made, "w", ZIP_DEFLATED) as archive:
            for name in _FILES:
                info = ZipInfo(name, _EPOCH)
                info.create_system = 3  # Unix, wherever it is made
                info.external_attr = 0o644 << 16
                info.compress_type = ZIP_DEFLATED
                archive.writestr(info, _content(name, page, values))
    return Path(path)


def _content(name: str, page: Path, values: dict[str, str]) -> bytes:
    if name == LIVE:
        return page.read_bytes()
    text = (_ASSETS / name).read_text(encoding="utf-8")
    return (text if name.endswith(".js") else Template(text).substitute(values)).encode()
