"""A scene as an interactive page that any browser opens, and the same in a notebook.

`html` and `write` make one HTML file of a scene: data, style, script, the engine's thread and its
WebAssembly; `live` shows it in a notebook, and alone needs anywidget.

- `describe`: the data of a page about its scene, as JSON.
- ``bundle``: the script of the page and that of the engine's thread, made from the modules by
  `tools/build_page.py`.
- ``assets``: HTML, CSS, the catalogues of words, and the modules of TypeScript; each says at its
  top what it is. ``scene.ts``, ``plan.ts`` and ``machine.ts`` make a machine of keys, ``core.ts``
  and ``worker.ts`` run it with the contact engine, in a thread; ``lab.ts`` has scene and run,
  ``transfer.ts`` and ``prediction.ts`` the closed form, ``task.ts`` and ``exercise.ts`` a lesson's
  exercise, ``stage.ts`` the picture, ``bench.ts`` the editing in it, ``palette.ts`` the parts,
  ``inspector.ts`` the fields, and ``app.ts`` joins all.
"""

from __future__ import annotations

import json
import zlib
from base64 import b64encode
from collections.abc import Mapping
from functools import cache, lru_cache
from hashlib import sha256
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from chutelab.pictures.live.describe import describe
from chutelab.pictures.plots import style
from chutelab.scene import AnyScene, Overrides, Scene, load, to_toml
from chutelab.scene.messages import live_of
from chutelab.scene.quantities import REGISTRY
from chutelab.scene.tables import Live
from chutelab.util.errors import library
from chutelab.util.files import own_version, whole
from chutelab.util.words import words

__all__ = ["live"]

LANGUAGES = ("en", "de")

LETTERS = bytes(code for code in range(33, 127) if code not in b'"<\\')
"""Characters that need no escape in the JSON of a script element."""

COLOURS = ("track", "analytic", "belt", "strike", "stream")


def html(
    scene: Scene | None,
    *,
    language: str = "en",
    home: tuple[str, str] | None = None,
    exercise: Mapping[str, Any] | None = None,
    lesson: Mapping[str, Any] | None = None,
    partly: bool = False,
) -> str:
    """Return the live page of a scene; the same scene and version give the same bytes.

    Parameters
    ----------
    scene : Scene, optional
        A scene without mass points. None begins with an empty machine.
    language : {"en", "de"}
        Language of the page; texts of the scene stay as they are.
    home : tuple of str, optional
        Text and address of a link back, for a page that is one of several.
    exercise : mapping, optional
        An exercise as `chutelab.classroom.exercises.data_of` returns it.
    lesson : mapping, optional
        Title and question of a lesson, and its steps as `chutelab.classroom.lessons.steps.data_of`
        returns them.
    partly : bool
        Whether the page leaves out what it cannot show of the scene, and says so.

    Raises
    ------
    SceneError
        If the scene has something that the contact engine lacks, with its key.
    """
    # The colours of every picture; page.css has those for the dark.
    colours = {
        **{name: getattr(style, name.upper()) for name in COLOURS},
        **{f"velocity-{name}": colour for name, colour in style.VELOCITY.items()},
        **{f"energy-{name}": colour for name, colour in style.ENERGY.items()},
    }
    palette = "".join(f"  --{k.replace('_', '-')}: {v};\n" for k, v in colours.items())
    css = f":root {{\n{palette}}}\n{_file('bundle/page.css')}"
    css += _file(f"bundle/{'sandbox' if lesson is None else 'lesson'}.css")
    core = files("chutelab.core")
    facts = describe(scene, partly=partly)
    strings = _strings(language)
    title = strings["new-machine"] if scene is None else scene.title
    shown_title = strings.get(f"title-{title}", title)
    if scene is None or "lacks" in facts:
        facts["scene"]["title"] = title
        live = Live().model_dump()
    else:
        live = live_of(scene, facts["scene"])
    if given := facts["scene"].get("live"):
        # As in files saved from the page.
        facts["scene"]["live"] = {key: live[key] for key in given}
    shown = [row for row in REGISTRY.values() if row.symbol]
    # Quantities without words in the page's language have the registry's names.
    meanings = {f"number-{row.name}": row.meaning for row in shown}
    (other,) = {*LANGUAGES} - {language}
    # The data is packed because it is long, except the scene; so is the script, which boot.ts puts
    # into the page.
    script = _file(f"bundle/{'app' if lesson is None else 'lessonpage'}.js")
    large = {
        "script": script,
        **{name: facts.pop(name) for name in ("tables", "rules", "presets")},
        "layout": json.loads((core / "layout.json").read_text(encoding="utf-8")),
        "strings": {**meanings, **strings},
        "quantities": {row.name: {"symbol": row.symbol, "unit": row.unit} for row in shown},
        **({} if exercise is None else {"exercise": exercise}),
        **({} if lesson is None else {"lesson": lesson}),
        # A page with a lesson has one language only.
        **(
            {}
            if lesson or exercise
            else {"other": {"language": other, "strings": {**meanings, **_strings(other)}}}
        ),
    }
    data = {
        **facts,
        "live": live,
        "version": own_version(),
        "language": language,
        # Not packed, as the engine's thread starts first of all.
        "worker": _file("bundle/worker.js"),
        "packed": _packed(json.dumps(large, separators=(",", ":")).encode()),
        "wasm": _packed((core / "page.wasm").read_bytes()),
    }
    # Nothing within a script element may look like its end tag.
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    boot = _file("bundle/boot.js")
    return Template(_file("assets/page.html")).substitute(
        language=language,
        title=escape(shown_title),
        version=escape(own_version()),
        broken=escape(strings["broken-page"]),
        home=f'<a class="home" href="{escape(home[1])}">{escape(home[0])}</a>' if home else "",
        css=css,
        css_hash=_hash(css),
        boot=boot,
        boot_hash=_hash(boot),
        script_hash=_hash(script),
        data=text.replace("<", "\\u003c"),
    )


def write(scene: Scene | None, path: str | Path, **options: Any) -> int:
    """Write the live page of a scene, whole or not at all, and return its size in bytes.

    Options are those of `html`; an existing file is replaced, its folder must exist.
    """
    data = html(scene, **options).encode("utf-8")
    with whole(Path(path)) as unfinished:
        unfinished.write_bytes(data)
    return len(data)


def live(
    scene: AnyScene, overrides: Overrides = (), *, height: int = 640, language: str = "en"
) -> Any:
    """Show a scene in a notebook as an interactive page: drag the plate, and the rest follows.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        What `chutelab.load` takes.
    overrides : mapping, str, or several
        Laid over it, see `chutelab.load`.
    height : int
        Of the page, in pixels.
    language : {"en", "de"}
        Of what the page says.

    Returns
    -------
    LivePage
        Put it last in a cell to see it. Its `scene` is the scene as changed in the page, TOML text
        for `chutelab.scene.parse`.

    Raises
    ------
    SceneError
        If the scene is invalid, or has something that the contact engine lacks.
    MissingLibraryError
        An ImportError, without anywidget.

    Examples
    --------
    >>> import chutelab
    >>> chutelab.live("perpendicular", ["plate.angle_deg=20"])  # doctest: +SKIP
    """
    kind, scene = widget(), load(scene, overrides)
    page = html(scene, language=language)
    return kind(html=page, height=height, title=scene.title, scene=to_toml(scene))


SHOWN = """
export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.title = model.get("title");
    // An origin of its own: the page has no way to the notebook but its messages.
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    frame.style.cssText = "display: block; width: 100%; border: 0";
    const fill = () => { frame.srcdoc = model.get("html"); };
    const grow = () => { frame.style.height = `${model.get("height")}px`; };
    const hear = ({ source, data }) => {
      if (source !== frame.contentWindow || data?.chutelab !== "scene") return;
      if (typeof data.toml !== "string") return;
      model.set("scene", data.toml);
      model.save_changes();
    };
    fill();
    grow();
    model.on("change:html", fill);
    model.on("change:height", grow);
    addEventListener("message", hear);
    el.append(frame);
    return () => {
      removeEventListener("message", hear);
      model.off("change:html", fill);
      model.off("change:height", grow);
    };
  },
};
"""
"""The widget's module, which browsers run."""


@cache
def widget() -> Any:
    """Return the class of live pages in a notebook: a frame with the page in it.

    The page reports changes by ``parent.postMessage({chutelab: "scene", toml}, "*")``. The class is
    made when first needed, since only notebooks need anywidget.
    """
    library("anywidget", "live pages in a notebook need anywidget", "notebook")
    from anywidget import AnyWidget
    from traitlets import Int, Unicode

    class LivePage(AnyWidget):
        """A live page in a notebook.

        Attributes
        ----------
        html : str
            The page.
        height : int
            Of the frame, in pixels.
        title : str
            Name of the frame for screen readers.
        scene : str
            The present scene of the page as TOML text, for `chutelab.scene.parse`.
        """

        _esm = SHOWN
        html = Unicode().tag(sync=True)
        height = Int(min=1).tag(sync=True)
        title = Unicode().tag(sync=True)
        scene = Unicode().tag(sync=True)

    return LivePage


@cache
def _file(name: str) -> str:
    return (files("chutelab.pictures.live") / name).read_text(encoding="utf-8")


def _strings(language: str) -> dict[str, str]:
    """Return all texts of a page; titles of scenes by the titles in their files."""
    titles = words(language).titles().items() if language != "en" else ()
    said: dict[str, str] = json.loads(_file(f"assets/strings/{language}.json"))
    return said | {f"title-{own}": title for own, title in titles}


@lru_cache(8)
def _packed(content: bytes) -> str:
    """Return data compressed, as text: two of 91 letters for 13 bits, one for up to 6 last bits.

    Base64 would be a twelfth longer; the page decodes it in `bytesOf` of ``core.ts``.
    """
    bits = np.unpackbits(np.frombuffer(zlib.compress(content, 9), dtype=np.uint8))
    rest = len(bits) % 13
    bits = np.pad(bits, (0, (6 if 0 < rest <= 6 else 13) - rest if rest else 0))
    pairs = bits[: len(bits) // 13 * 13].reshape(-1, 13) @ (1 << np.arange(12, -1, -1))
    last = bits[len(pairs) * 13 :]
    codes = np.stack(np.divmod(pairs, len(LETTERS)), axis=-1).ravel()
    if len(last):
        codes = np.append(codes, last @ (1 << np.arange(5, -1, -1)))
    return str(np.frombuffer(LETTERS, dtype=np.uint8)[codes].tobytes(), "ascii")


def _hash(text: str) -> str:
    """Return the hash of an inline text for a Content-Security-Policy."""
    return f"sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode('ascii')}"
