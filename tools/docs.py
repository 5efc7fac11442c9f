"""Make the documentation site: pages of HTML that need no server and no network.

    python tools/docs.py [DIRECTORY [SCENE ...]]

They go to the directory, by default ``out/site``, and `index.html` is the first. If scenes are
given, only these are filmed for the gallery, which saves a third of the time. The texts are
those of the repository: README, `docs`, the lessons, the docstrings, CONTRIBUTING. They are laid
out in a temporary folder as they lie in the repository, so that their links hold; then Sphinx is
called, which takes every warning for an error. Needs ``pip install ".[docs]"``.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from importlib import import_module
from inspect import getdoc
from pathlib import Path
from pkgutil import walk_packages
from types import ModuleType
from typing import Any

from PIL import Image
from pydantic import BaseModel
from sphinx.cmd.build import build_main
from sphinx.pycode import ModuleAnalyzer

import chutelab
from chutelab.classroom.lessons import shipped_lessons
from chutelab.classroom.lessons.pages import LIVE, live_page
from chutelab.classroom.lessons.sheets import sheet
from chutelab.engines.simulation import simulate
from chutelab.pictures.animation import animate
from chutelab.pictures.live import write
from chutelab.scene import SceneError, about, load
from chutelab.scene.overrides import schema
from chutelab.scene.quantities import REGISTRY, STATISTICS

ROOT = Path(__file__).resolve().parent.parent
DEVELOPERS = ("CONTRIBUTING", "CODE_OF_CONDUCT", "SECURITY", "CHANGELOG")

TREE = """\
```{{toctree}}
:hidden:
{options}
{pages}
```
"""

PLAY = """\
<details class="play"><summary>Play with it here</summary>
<iframe data-page="{page}" title="{title}"></iframe>
</details>

<p><a href="{page}">Play with it in a window of its own</a></p>
"""


FILM = """\
<p><a class="film" href="../films/{name}.gif" data-stop="Stop the film">Play the film</a></p>
"""
"""Below a picture of the gallery, which moves while the pointer is on it, see ``site.js``."""

HERO = """\
<iframe class="hero" src="live/{name}.html" title="{title}"></iframe>
"""

FRONT = "inclined-20"
"""The scene that plays on the first page."""

PAGES = ("first-machine", "teachers", "engineers")
"""Of `docs`, those that the first page leads to."""

KEYS = """\
# Keys of a scene

What a scene file may say, table by table. Lengths are in m, angles in degrees, all else in SI
units; a text such as `"4 mm"` or `"20 t/h"` stands for a number with its unit. `chutelab new`
writes a file with all of them. For editors, <a href="scene.schema.json">scene.schema.json</a> is
the schema: with `#:schema ./scene.schema.json` as the first line of a file beside it, they
complete the keys and underline what is wrong.
"""

QUANTITIES = """\
# Quantities of a run

These names mean the same in `[[expect]]`, `sweep`, `solve`, `measure` and the JSON of a run.
`SURFACE` is the name of any surface. What each particle has goes by its bare name where there is
one particle; of several, `particles[0].landing.x` is that of the first one, and with {statistics}
it is of all of them, such as `landing.x.mean`; `by_stream.NAME.landing.x.mean` is of one stream.
What is nominal is of particle 0, and what is of a lone particle there is only where it is the
only one. The ledger counts up to `run.until`.

| name | unit | meaning | of |
|---|---|---|---|
"""


def tree(*pages: str, options: str = "") -> str:
    """Return a table of contents, which the site shows beside every page."""
    return TREE.format(pages="\n".join(pages), options=options)


def sections(markdown: str) -> dict[str, str]:
    """Return what stands under each heading of level 2, by heading; before the first, by ""."""
    parts = re.split(r"^## (.+)\n", markdown, flags=re.MULTILINE)
    return {"": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


def public_modules() -> dict[str, ModuleType]:
    """Return chutelab and its packages and modules that say what is public, by name."""
    names = [one.name for one in walk_packages(chutelab.__path__, "chutelab.")]
    wanted = ("chutelab", *sorted(name for name in names if not name.endswith("__main__")))
    found = {name: import_module(name) for name in wanted}
    return {name: module for name, module in found.items() if hasattr(module, "__all__")}


def readme(pages: Path) -> None:
    """Make the first pages of the README."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = sections(text.replace("/exercise.ipynb", "/README.md"))
    title, said = found[""].split("\n", 1)
    hero = HERO.format(name=FRONT, title=load(FRONT).title)
    first = [title, hero, said]
    first += [f"## {name}\n{found[name]}" for name in ("Citing", "Licence")]
    contents = [
        tree(
            *("start", *(f"docs/{name}" for name in PAGES)),
            *("tour", "Gallery <docs/gallery>", "lessons/index", "docs/physics"),
            *("Keys of a scene <keys>", "Quantities <quantities>"),
            *("Accuracy and speed <accuracy>", "api"),
        ),
        tree(*DEVELOPERS, options=":caption: For developers"),
    ]
    (pages / "index.md").write_text("\n".join(first + contents), encoding="utf-8")
    for name, title in (
        ("start", "Start"),
        ("tour", "A short tour"),
        ("accuracy", "How exact is it, and how fast?"),
    ):
        more = tree("scenes/data/index") if name == "tour" else ""
        (pages / f"{name}.md").write_text(f"# {title}\n{found[title]}\n{more}", encoding="utf-8")


def gallery(pages: Path, extra: Path, filmed: list[str]) -> None:
    """Make the gallery: films of all scenes or of some, and the live pages that there can be."""
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    (extra / "live").mkdir(parents=True)
    (extra / "films").mkdir()
    for one in about():
        if one.name in filmed or not filmed:
            film(one.name, extra / "films" / f"{one.name}.gif")
            text = text.replace(
                f"(gallery/{one.name}.png)\n",
                f"(gallery/{one.name}.png)\n\n{FILM.format(name=one.name)}",
            )
        page = extra / "live" / f"{one.name}.html"
        try:
            write(load(one.name), page)
        except SceneError:
            said = "It has parts that a page cannot run yet: run it with the command.\n"
        else:
            said = PLAY.format(page=f"../live/{page.name}", title=one.title)
        # Below its own words, which end with the next heading.
        text = re.sub(
            rf"(^### `{one.name}`: .*?\n)(?=\n##|\Z)",
            lambda found, said=said: f"{found[1]}\n{said}",
            text,
            flags=re.MULTILINE | re.DOTALL,
        )
    (pages / "docs" / "gallery.md").write_text(text, encoding="utf-8")


def film(name: str, path: Path) -> None:
    """Film a scene as large as its picture in the gallery, without numbers."""
    recording = simulate(load(name))
    with Image.open(ROOT / "docs" / "gallery" / f"{name}.png") as still:
        width, height = still.size
    animate(recording, path, fps=10, width=width, height=height, show=("parabola", "trails"))


def lessons(pages: Path, extra: Path) -> None:
    """Make a page of each worksheet, of its explanation, and the live pages."""
    shipped = shipped_lessons()
    shutil.copytree(
        ROOT / "lessons", pages / "lessons", ignore=shutil.ignore_patterns("*.de.*", ".*")
    )
    for one in shipped:
        name = one.folder.name
        text = sheet(one, "student")
        if one.page is not None:
            (extra / "lessons" / name).mkdir(parents=True)
            live_page(one, extra / "lessons" / name / LIVE)
            text += "\n## Try it\n\n" + PLAY.format(page=LIVE, title=one.title)
        folder = pages / "lessons" / name
        listed = tree("Explanation <explanation>")
        (folder / "README.md").write_text(f"{text}\n{listed}", encoding="utf-8")
        (folder / "explanation.md").write_text(sheet(one, "explanation"), encoding="utf-8")
    start = pages / "lessons" / "README.md"
    listed = tree(*(f"{one.folder.name}/index" for one in shipped))
    text = start.read_text(encoding="utf-8").replace("/exercise.ipynb", "/README.md")
    start.write_text(f"{text}\n{listed}", encoding="utf-8")


def reference(pages: Path) -> None:
    """Make a page for each module that has public names: all of them."""
    modules = public_modules()
    homes = {
        id(getattr(module, name)): f"{title}.{name}"
        for title, module in modules.items()
        if title != "chutelab"
        for name in module.__all__
    }
    (pages / "api").mkdir()
    for title, module in modules.items():
        said = [title, "=" * len(title), "", f".. automodule:: {title}", ""]
        for name in module.__all__:
            value = getattr(module, name)
            home = value.__name__ if isinstance(value, ModuleType) else homes.get(id(value))
            if value is sys.modules.get(f"{title}.{name}"):
                continue  # it has a page of its own
            if title == "chutelab" and home is not None:
                summary = str(getdoc(value)).partition("\n\n")[0].splitlines()
                said += data(name, [*summary, "", f"See `{home}`."])
            elif isinstance(value, type):
                said += [f".. autoclass:: {title}.{name}", "   :members:", "", *keys(value), ""]
            elif callable(value):
                said += [f".. autofunction:: {title}.{name}", ""]
            else:
                said += data(name, words_under(name, title))
        (pages / "api" / f"{title}.rst").write_text("\n".join(said), encoding="utf-8")
    listed = "".join(
        f"| [{title}](api/{title}) | {str(getdoc(module)).splitlines()[0]} |\n"
        for title, module in modules.items()
    )
    (pages / "api.md").write_text(
        "# Reference\n\nEvery public name, a page for each package.\n\n"
        f"| package | what it is |\n|---|---|\n{listed}\n"
        + tree(*(f"{title.removeprefix('chutelab.')} <api/{title}>" for title in modules)),
        encoding="utf-8",
    )


def keys(table: type) -> list[str]:
    """Return the keys of a table of scene files, to stand in its class; of others nothing."""
    if not issubclass(table, BaseModel):
        return []
    said = ["   .. list-table::", "      :header-rows: 1", ""]
    for first, *others in (("key", "default", "what it is"), *key_rows(table.model_json_schema())):
        said += [f"      * - {first}", *(f"        - {cell}" for cell in others)]
    return said


def key_rows(table: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield key, default and meaning of each key of a table's schema."""
    for key, told in table["properties"].items():
        default = told.get("default")
        shown = "" if default is None else f"``{json.dumps(default, ensure_ascii=False)}``"
        shown = "must be given" if key in table.get("required", ()) else shown
        yield f"``{key}``", shown, re.sub(r"([*`|\\_])", r"\\\1", told.get("description", ""))


def data(name: str, said: list[str]) -> list[str]:
    """Return the directive for a value of the package at hand."""
    return [f".. py:data:: {name}", "", *(f"   {line}" for line in said), ""]


def words_under(name: str, package: str) -> list[str]:
    """Return what stands under a value, in the module of the package where it is given."""
    said: list[str] = []
    having = [one for one in sys.modules if one.startswith(package)]
    for module in [one for one in having if name in vars(sys.modules[one])]:
        said = ModuleAnalyzer.for_module(module).find_attr_docs().get(("", name), said)
    return said


def quantities(pages: Path) -> None:
    """Make the page of the registry."""
    rows = [
        f"| `{row.name}` | {row.unit} | {row.meaning} | {row.of} |\n" for row in REGISTRY.values()
    ]
    text = QUANTITIES.format(statistics=", ".join(f"`.{name}`" for name in STATISTICS))
    (pages / "quantities.md").write_text(text + "".join(rows), encoding="utf-8")


def scene_keys(pages: Path, extra: Path) -> None:
    """Make the page of all keys of a scene, and the schema beside it."""
    told = schema()
    (extra / "scene.schema.json").write_text(json.dumps(told), encoding="utf-8")
    order = list(told["properties"])
    said, heads = [KEYS], dict[str, str]()
    for name, key in told["properties"].items():
        for kind in re.findall(r"#/\$defs/(\w+)", json.dumps(key)):
            heads[kind] = name
    # Tables in tables: the first that has them names them.
    for outer, table in sorted(told["$defs"].items(), key=lambda one: one[0] not in heads):
        for name, key in table.get("properties", {}).items():
            for kind in re.findall(r"#/\$defs/(\w+)", json.dumps(key)):
                heads.setdefault(kind, f"{heads[outer]}.{name}")
    tables = sorted(
        told["$defs"].items(), key=lambda one: order.index(heads[one[0]].partition(".")[0])
    )
    for kind, table in (("", told), *tables):
        head = f"`[{heads[kind]}]`" if kind else "Of the scene itself"
        rows = [row for row in key_rows(table) if kind or row[0].strip("`") not in heads.values()]
        lines = ["key", "default", "what it is"], ["---"] * 3, *rows
        said += [f"\n## {head}\n\n{table['description']}\n\n" if kind else f"\n## {head}\n\n"]
        said += ["| " + " | ".join(cells) + " |\n" for cells in lines]
    (pages / "keys.md").write_text("".join(said), encoding="utf-8")


def gather(pages: Path, extra: Path, filmed: list[str]) -> None:
    """Lay out the sources of all pages, and beside them what is copied as it is."""
    readme(pages)
    kept = shutil.ignore_patterns("site", "gallery.md")
    shutil.copytree(ROOT / "docs", pages / "docs", ignore=kept)
    shutil.copytree(ROOT / "scenes" / "data", pages / "scenes" / "data")
    for name in (*(f"{one}.md" for one in DEVELOPERS), "CITATION.cff", "LICENSE"):
        shutil.copyfile(ROOT / name, pages / name)
    gallery(pages, extra, filmed)
    lessons(pages, extra)
    quantities(pages)
    scene_keys(pages, extra)
    reference(pages)
    # A folder's README is its first page.
    for page in pages.rglob("*.md"):
        text = re.sub(r"(\]\([^)]*)\bREADME\.md", r"\1index.md", page.read_text(encoding="utf-8"))
        page.write_text(text, encoding="utf-8")
        if page.name == "README.md":
            page.rename(page.with_name("index.md"))


def make(folder: Path, filmed: list[str]) -> int:
    """Make the site in a folder, which is replaced; return Sphinx's exit code."""
    with tempfile.TemporaryDirectory(prefix="chutelab-docs-") as aside:
        pages, extra = Path(aside) / "pages", Path(aside) / "extra"
        pages.mkdir()
        extra.mkdir()
        gather(pages, extra, filmed)
        shutil.rmtree(folder, ignore_errors=True)
        strict = ("--fail-on-warning", "--keep-going", "--quiet", "--fresh-env")
        places = ("--conf-dir", ROOT / "docs" / "site", "--doctree-dir", Path(aside) / "made")
        copied = ("--define", f"html_extra_path={extra}")
        return build_main([str(part) for part in (*strict, *places, *copied, pages, folder)])


if __name__ == "__main__":
    if any(argument.startswith("-") for argument in sys.argv[1:]):
        sys.exit(__doc__)
    sys.exit(make(Path(sys.argv[1]) if sys.argv[1:] else ROOT / "out" / "site", sys.argv[2:]))
