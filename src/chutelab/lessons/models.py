"""``lesson.toml`` as a frozen Pydantic model: what a lesson asks, shows and varies.

Each key says in words what it allows, so that a fault can be explained without a second list.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from pydantic import Field, PrivateAttr

from chutelab.scene.quantities import Number, Text, Whole
from chutelab.scene.tables import Table

if TYPE_CHECKING:
    from pathlib import Path

LEVELS: Final = ("start", "core", "advanced")
MOST: Final = 20
"""Entries of a list at most: a lesson that needs more is two lessons."""

LONGEST: Final = 200
"""Characters of a text at most: it has to go on one slide."""

VARIED: Final = 2
"""Sliders of a page at most."""

Said = Annotated[Text, Field(min_length=1, max_length=LONGEST)]
Names = Annotated[tuple[Said, ...], Field(max_length=MOST)]


def key(default: Any, what: str, allowed: str, **limits: Any) -> Any:
    """Describe one key: its default, its definition in a sentence, and what it allows."""
    return Field(default, description=f"{what}.", json_schema_extra={"allowed": allowed}, **limits)


class Picture(Table):
    """How ``lesson.gif`` is made."""

    scene: Said | None = key(
        None, "The scene that is filmed; default: the first", "one of the names in scenes"
    )
    set: Names = key(
        (), "Keys of that scene to change", f'a list of at most {MOST} texts such as "run.dt=0.01"'
    )
    slow: Number | None = key(
        None,
        "Seconds on the screen for one of the recording; default: a round one that suits",
        "a number from 0.01 to 1000",
        ge=0.01,
        le=1000.0,
    )
    fps: Literal[10, 20, 25, 50] = key(25, "Pictures a second", "10, 20, 25 or 50")
    width: Whole = key(800, "Width, pixels", "a whole number from 320 to 3840", ge=320, le=3840)
    height: Whole = key(450, "Height, pixels", "a whole number from 180 to 2160", ge=180, le=2160)


class Page(Table):
    """What the page of the lesson lets one vary; without this table it has none."""

    scene: Said | None = key(
        None, "The scene of the page; default: the first", "one of the names in scenes"
    )
    set: Names = key(
        (), "Keys of that scene to change", f'a list of at most {MOST} texts such as "run.dt=0.01"'
    )
    vary: Annotated[tuple[Said, ...], Field(min_length=1, max_length=VARIED)] = key(
        ...,
        "A slider each",
        f'a list of 1 to {VARIED} texts such as "plate.angle_deg=-20:70:46" (from, to, how many)',
    )


class Lesson(Table):
    """A validated lesson; its files lie in `folder`."""

    title: Said = key(..., "What the lesson is called", f"a text of 1 to {LONGEST} characters")
    level: Literal["start", "core", "advanced"] = key(
        ..., "For whom", ", ".join(f'"{level}"' for level in LEVELS[:-1]) + f' or "{LEVELS[-1]}"'
    )
    minutes: Whole = key(45, "Time it takes in class", "a whole number from 5 to 600", ge=5, le=600)
    question: Said = key(
        ..., "What one should be able to answer afterwards", f"a text of 1 to {LONGEST} characters"
    )
    scenes: Annotated[Names, Field(min_length=1)] = key(
        ...,
        "What is simulated",
        f"a list of 1 to {MOST} names: of shipped scenes, or of .toml files beside lesson.toml",
    )
    quantities: Annotated[dict[Said, Said], Field(max_length=MOST)] = key(
        {},
        "What one looks at, and what it is in words",
        f'a table of at most {MOST} lines such as x3 = "way back from the plate"; names with dots'
        " in quotes",
    )
    picture: Picture = key(Picture(), "How lesson.gif is made", "a table of keys and values")
    page: Page | None = key(None, "What its page varies", "a table of keys and values")

    _folder: Path = PrivateAttr()

    @property
    def folder(self) -> Path:
        """Where the lesson's files are."""
        return self._folder

    @property
    def name(self) -> str:
        """The name without its number: ``the-bounce`` of ``03-the-bounce``."""
        return re.sub(r"^\d+-", "", self._folder.name)

    @property
    def number(self) -> int | None:
        """The number its folder begins with; None for one that has none."""
        match = re.match(r"(\d+)-", self._folder.name)
        return int(match[1]) if match else None

    @property
    def worksheet(self) -> Path:
        """The worksheet, in Markdown."""
        return self._folder / "README.md"


TABLES: Final[dict[str, type[Table]]] = {"picture": Picture, "page": Page}
"""Model of each table by its key."""
