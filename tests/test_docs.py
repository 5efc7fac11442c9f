"""The documentation site: whole, strict, and readable on a phone, in the dark, without network."""

import json
import os
import re
import subprocess
import sys
import zlib
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from urllib.parse import unquote

import pytest

from chutelab.results import EVENT, KNOT

ROOT = Path(__file__).resolve().parent.parent
GALLERY = "perpendicular"
"""The scene that the gallery begins with."""

FILMED = os.environ.get("CHUTELAB_FILMED", "").split()
"""The scenes that are filmed; if none is given, all."""

NEEDED = ("furo", "latex2mathml", "myst_parser", "numpydoc", "sphinx")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    for name in NEEDED:
        pytest.importorskip(name, reason='needs pip install "chutelab[docs]"')
    folder = tmp_path_factory.mktemp("docs") / "site"
    command = [sys.executable, ROOT / "tools" / "docs.py", folder, *FILMED]
    made = subprocess.run(command, capture_output=True, text=True)
    assert made.stderr + made.stdout == ""
    assert made.returncode == 0
    return folder


def pages(site):
    """All pages but the live ones, which have tests of their own."""
    found = [path for path in site.rglob("*.html") if path.name != "page.html"]
    return sorted(path for path in found if path.parent.name != "live")


class Page(HTMLParser):
    """What a page points to, what can be pointed at in it, and its text, code aside."""

    def __init__(self, path):
        super().__init__()
        self.links, self.parts, self.ids, self.text, self.code = [], [], set(), "", 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.ids.add(given.get("id"))
        self.code += tag in ("code", "pre", "script")
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag in ("link", "script", "img", "iframe", "source", "video", "object"):
            told = ("href", "src", "srcset", "data", "data-page")
            self.parts += [given[key] for key in told if key in given]

    def handle_endtag(self, tag):
        self.code -= tag in ("code", "pre", "script")

    def handle_data(self, data):
        self.text += "" if self.code else data


def test_every_link_leads_somewhere_and_no_part_comes_from_outside(site):
    read = {path.resolve(): Page(path) for path in site.rglob("*.html")}
    broken = []
    for path in pages(site):
        page = read[path.resolve()]
        for address in page.links + page.parts:
            if address.startswith(("https://", "mailto:")) and address not in page.parts:
                continue
            name, _, anchor = address.partition("#")
            name = unquote(name.partition("?")[0])
            target = (path.parent / name).resolve() if name else path.resolve()
            found = target.is_file() and target.is_relative_to(site.resolve())
            if not found or (anchor and unquote(anchor) not in read[target].ids):
                broken.append((str(path.relative_to(site)), address))
    assert broken == []


def test_the_chapters_are_there(site):
    scenes = [path.stem for path in (ROOT / "scenes").glob("*.toml")]
    gallery = Page(site / "docs" / "gallery.html")
    assert {f"../_images/{name}.png" for name in scenes} <= set(gallery.parts)
    assert len([part for part in gallery.parts if part.startswith("../live/")]) >= 19
    for lesson in (ROOT / "lessons").glob("*/lesson.toml"):
        page = Page(site / "lessons" / lesson.parent.name / "index.html")
        assert "page.html" in page.parts
    assert "adhesion" in Page(site / "docs" / "physics.html").text
    assert "live/inclined-20.html" in Page(site / "index.html").parts
    said = (site / "keys.html").read_text(encoding="utf-8")
    tables = json.loads((site / "scene.schema.json").read_text(encoding="utf-8"))["$defs"]
    for key in {key for table in tables.values() for key in table["properties"]}:
        assert f'<span class="pre">{key}</span>' in said, key
    for name in (
        *("start", "tour", "accuracy", "CONTRIBUTING", "CODE_OF_CONDUCT", "SECURITY"),
        *("docs/first-machine", "docs/teachers", "docs/engineers"),
    ):
        assert (site / f"{name}.html").is_file()


def public_names():
    """Return the full names that the modules with an `__all__` say are public."""
    for path in (ROOT / "src").rglob("*.py"):
        if "\n__all__ = " in path.read_text(encoding="utf-8"):
            package = ".".join(path.relative_to(ROOT / "src").with_suffix("").parts)
            package = package.removesuffix(".__init__")
            yield from (f"{package}.{name}" for name in import_module(package).__all__)


def test_every_public_name_is_in_the_reference(site):
    inventory = (site / "objects.inv").read_bytes().split(b"\n", 4)[4]
    lines = zlib.decompress(inventory).decode("utf-8").splitlines()
    documented = {line.split()[0] for line in lines if " py:" in line}
    names = set(public_names())
    assert len(names) > 100
    assert names - documented == set()
    fields = (site / "api" / "chutelab.results.html").read_text(encoding="utf-8")
    assert all(f'<span class="pre">{name}</span>' in fields for name in EVENT.names + KNOT.names)


def test_formulas_are_mathematics(site):
    physics = (site / "docs" / "physics.html").read_text(encoding="utf-8")
    assert physics.count("<math") > 150
    assert re.search(r"<mi>cos</mi>\s*<mspace", physics)  # "cos φ", not "cosφ"
    for path in pages(site):
        assert re.search(r"\$[^$]+\$", Page(path).text) is None, path


# What sticks out of the window, unless a part of the page that it is in scrolls by itself.
CUT_OFF = """() => {
  const scrolls = (part) => {
    for (let one = part; one.tagName !== "ARTICLE"; one = one.parentElement) {
      if (/auto|scroll/.test(getComputedStyle(one).overflowX)) return true;
    }
    return false;
  };
  const out = [];
  for (const part of document.querySelectorAll("article *")) {
    const { right, width } = part.getBoundingClientRect();
    if (width > 1 && right > innerWidth + 0.5 && !scrolls(part)) out.push(part.outerHTML);
  }
  return out.map((text) => text.slice(0, 200));
}"""

COLOURS = """() => ["color", "backgroundColor"].map(
  (key) => getComputedStyle(document.body)[key].match(/[\\d.]+/g).slice(0, 3).map(Number))"""


def test_every_page_opens_on_a_phone_in_the_dark(site, opened):
    page = opened(site / "index.html", viewport={"width": 360, "height": 740}, color_scheme="dark")
    for path in pages(site):
        page.goto(path.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") == 360, path
        assert page.evaluate(CUT_OFF) == [], path
        ink, paper = page.evaluate(COLOURS)
        assert sum(ink) > 3 * 150, path
        assert sum(paper) < 3 * 60, path


def test_a_scene_of_the_gallery_runs_in_its_page(site, opened):
    page = opened(site / "docs" / "gallery.html")
    play = page.locator("details.play").first
    assert {frame.url for frame in page.frames[1:]} == {"about:blank"}
    play.locator("summary").click()
    play.locator("iframe").content_frame.locator("canvas").first.wait_for()


def test_pictures_of_the_gallery_move_on_hover_and_focus_but_not_against_a_readers_will(
    site, opened
):
    films = sorted(path.stem for path in (site / "films").glob("*.gif"))
    scenes = FILMED or [path.stem for path in (ROOT / "scenes").glob("*.toml")]
    assert films == sorted(scenes)
    assert max(path.stat().st_size for path in (site / "films").glob("*.gif")) < 500_000
    shown = "document.querySelector('section section img').src.split('/').at(-1)"
    for motion in ("no-preference", "reduce"):
        page = opened(site / "docs" / "gallery.html", reduced_motion=motion)
        moves, still = f"{GALLERY}.gif", f"{GALLERY}.png"
        picture, link = page.locator("section section img").first, page.locator("a.film").first
        assert page.evaluate(shown) == still
        box = picture.bounding_box()
        picture.hover()
        assert page.evaluate(shown) == (still if motion == "reduce" else moves)
        assert picture.bounding_box()["height"] == pytest.approx(box["height"], abs=1.0)
        page.mouse.move(0, 0)
        assert page.evaluate(shown) == still
        # A click on it starts it.
        link.click()
        assert (page.evaluate(shown), link.inner_text()) == (moves, "Stop the film")
        link.click()
        assert (page.evaluate(shown), link.inner_text()) == (still, "Play the film")
        page.evaluate("document.activeElement.blur()")
        while not link.evaluate("(one) => one === document.activeElement"):
            page.keyboard.press("Tab")
        assert page.evaluate(shown) == (still if motion == "reduce" else moves)
        page.keyboard.press("Tab")
        assert page.evaluate(shown) == still


def test_the_search_finds_without_a_server(site, opened):
    page = opened(site / "search.html", "?q=restitution")
    page.wait_for_selector("#search-results li a")
