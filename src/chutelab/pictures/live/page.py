"""One HTML file from a scene: data, style and script joined."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Final

from chutelab.pictures.live.runs import Study, pack, study
from chutelab.pictures.plots import style
from chutelab.scene import Scene
from chutelab.scene.variants import Vary
from chutelab.util.files import whole
from chutelab.util.versions import own_version

SCRIPTS: Final = (
    "tracks.js", "books.js", "view.js", "picture.js", "film.js", "panels.js", "input.js", "main.js",
)  # fmt: skip
"""In the order in which they build on each other."""


@dataclass(frozen=True)
class Written:
    """A page that was written.

    Attributes
    ----------
    path : Path
        Where.
    size : int
        Bytes.
    variants : int
        All of them.
    faults : dict of tuple of float to str
        Values of those that could not be run, and why.
    """

    path: Path
    size: int
    variants: int
    faults: dict[tuple[float, ...], str]


def write(
    scene: Scene,
    varies: Sequence[Vary | str] = (),
    path: str | Path = "page.html",
    *,
    home: tuple[str, str] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Written:
    """Run all variants of a scene and write a page of them, whole or not at all.

    Parameters
    ----------
    scene : Scene
        From `chutelab.load`.
    varies : sequence of Vary or str
        Up to two keys with their values, such as ``"plate.angle_deg=-20:70:46"``; each becomes a
        slider.
    path : path-like
        The file; one that is there is replaced, its folder must be there.
    home : tuple of str, optional
        Text and address of a link back, for a page that is one of several.
    progress : callable, optional
        Called with the share of the variants that are done, 0 to 1.

    Returns
    -------
    Written
        What was written, and which variants could not be run: the page says so on their positions.

    Raises
    ------
    InputError
        If what is to be varied cannot be, there is too much for a page, or no variant runs.

    Notes
    -----
    The same scene, varies and versions give the same bytes.
    """
    done = study(scene, varies, progress)
    data = _html(done, home).encode("utf-8")
    path = Path(path)
    with whole(path) as unfinished:
        unfinished.write_bytes(data)
    faults = {o.values: o.fault for o in done.outcomes if o.fault}
    return Written(path, len(data), len(done.outcomes), faults)


def html(
    scene: Scene, varies: Sequence[Vary | str] = (), *, home: tuple[str, str] | None = None
) -> str:
    """Return the page that `write` would write."""
    return _html(study(scene, varies), home)


def _html(done: Study, home: tuple[str, str] | None) -> str:
    css = f":root {{\n{_palette()}}}\n{_asset('page.css')}"
    script = "\n".join(["(() => {", '"use strict";', *map(_asset, SCRIPTS), "})();"])
    # Within a script element nothing but an end tag must look like one.
    data = json.dumps(pack(done), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    link = f'<a class="home" href="{escape(home[1])}">{escape(home[0])}</a>' if home else ""
    return Template(_asset("page.html")).substitute(
        title=escape(done.scene.title),
        version=escape(own_version()),
        home=link,
        css=css,
        css_hash=_hash(css),
        script=script,
        script_hash=_hash(script),
        data=data,
    )


def _asset(name: str) -> str:
    return (files("chutelab.pictures.live") / "assets" / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    """Return what a Content-Security-Policy calls an inline text it allows."""
    return f"sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode('ascii')}"


def _palette() -> str:
    """Return the colours of every picture as CSS variables; page.css has those for the dark."""
    colours = {
        "track": style.TRACK,
        "analytic": style.ANALYTIC,
        "belt": style.BELT,
        "strike": style.STRIKE,
        "stream": style.STREAM,
        **{f"velocity-{name}": colour for name, colour in style.VELOCITY.items()},
        **{f"energy-{name}": colour for name, colour in style.ENERGY.items()},
    }
    return "".join(f"  --{name.replace('_', '-')}: {value};\n" for name, value in colours.items())
