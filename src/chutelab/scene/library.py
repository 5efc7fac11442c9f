"""The shipped scenes, found by name, and the starter scene."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chutelab.hints import did_you_mean
from chutelab.scene.errors import Fault, SceneError

_TITLE: Final = re.compile(r"""^title\s*=\s*["'](.*?)["']\s*(?:#.*)?$""", re.MULTILINE)


@dataclass(frozen=True)
class About:
    """What the list of scenes says of one: name, title and what to look at."""

    name: str
    title: str
    look: tuple[str, ...]
    path: Path


def shipped() -> dict[str, Path]:
    """Return the files of the shipped scenes by name, in alphabetical order."""
    folder = _folder()
    found = {path.stem: path for path in folder.glob("*.toml")} if folder else {}
    return dict(sorted(found.items()))


def about() -> list[About]:
    """Describe the shipped scenes by their titles and the comments they begin with."""
    return [_about(name, path) for name, path in shipped().items()]


def find(name_or_path: str | Path) -> Path:
    """Return the file meant: one that exists, or else the shipped scene of this name.

    Raises
    ------
    SceneError
        If there is neither; it suggests shipped scenes.
    """
    source = str(name_or_path)
    path = Path(source)
    try:
        exists, folder = path.exists(), path.is_dir()
    except (OSError, ValueError):
        exists = folder = False
    if exists and not folder:
        return path
    scenes = shipped()
    if (name := source.removesuffix(".toml")) in scenes:
        return scenes[name]
    if folder and source:
        text = "a directory; give a scene file, or the name of a shipped scene"
        raise SceneError(source, [Fault("", None, text)])
    advice = did_you_mean(path.stem, scenes, f"there are {', '.join(scenes)}", most=3)
    text = f"no such file, and no shipped scene of this name; {advice}"
    raise SceneError(source or '""', [Fault("", None, text)])


def template() -> str:
    """Return a complete, commented scene to start from, as TOML text."""
    return (Path(__file__).parent / "starter.toml").read_text(encoding="utf-8")


def _about(name: str, path: Path) -> About:
    text = path.read_text(encoding="utf-8")
    title = _TITLE.search(text)
    look = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith("#:"):
            look.append(line.lstrip("# "))
    return About(name, title[1] if title else name, tuple(look), path)


def _folder() -> Path | None:
    """Find the folder of shipped scenes: in the package or, in a checkout, beside ``src``."""
    # Imported here: a scene given as text or mapping needs no files.
    from importlib.resources import files

    package = Path(str(files("chutelab.scene"))).parent
    packaged = package / "data" / "scenes"
    checkout = package.parent.parent
    if packaged.is_dir():
        return packaged
    if (checkout / "pyproject.toml").is_file() and (checkout / "scenes").is_dir():
        return checkout / "scenes"
    return None
