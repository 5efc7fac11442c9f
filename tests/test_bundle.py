"""The lessons as web pages: whole, relative, readable by everybody."""

import json
import os
import shutil
import subprocess
import sys
from urllib.parse import unquote
from zipfile import ZipFile

import pytest

from chutelab.classroom.lessons.building import start
from chutelab.classroom.lessons.pages import bundle
from chutelab.classroom.lessons.texts import html_of
from live.browser import axe
from shared import Page, chutelab, find, lessons


@pytest.fixture(scope="module")
def web(tmp_path_factory):
    folder = tmp_path_factory.mktemp("web") / "lessons"
    bundle([find(6), find(2)], folder)
    return folder


def test_a_bundle_has_an_index_and_a_page_for_each_lesson(web):
    assert (web / "index.html").is_file()
    for name in ("02-letting-go", "06-grip-or-slip"):
        files = {path.name for path in (web / name).iterdir()}
        assert files >= {"index.html", "page.html", "explanation.html", "worksheet.pdf"}
        assert files >= {"lesson.gif", "still.png", "machine.png", "end.png"}
        # The teacher's key is in it.
        assert "lesson.toml" not in files
        assert (web / name / "page.html").stat().st_size <= 450_000
    page = (web / "06-grip-or-slip" / "index.html").read_text(encoding="utf-8")
    assert "The textbook angle is the limit" not in page
    told = (web / "06-grip-or-slip" / "explanation.html").read_text(encoding="utf-8")
    assert "The textbook angle is the limit" in told
    assert '<a rel="next" href="../02-letting-go/index.html">2. When does it let go? →</a>' in page
    assert "(lesson.gif)" not in page


def broken_links(web):
    """Addresses in the pages of a bundle that are not relative, or lead nowhere."""
    elsewhere = (
        *("#", "data:,", "https://doi.org/", "https://jupyter.org", "https://www.python.org"),
        "https://opensourcephysics.github.io/tracker-website/",
    )
    broken = set()
    for page in (web / "index.html", *web.glob("*/index.html"), *web.glob("*/explanation.html")):
        for address in Page(page.read_text(encoding="utf-8")).addresses:
            target = (page.parent / unquote(address.partition("#")[0])).resolve()
            inside = target.is_relative_to(web.resolve())
            if not address.startswith(elsewhere) and not (inside and target.is_file()):
                broken.add(address)
    return broken


def test_all_links_of_a_bundle_are_relative_and_lead_somewhere(web):
    assert broken_links(web) == set()


@pytest.mark.slow
def test_the_bundle_of_all_lessons_is_whole_and_small(tmp_path):
    result = chutelab("lesson", "page", "-o", tmp_path / "web")
    assert result.exit_code == 0
    assert broken_links(tmp_path / "web") == set()
    pages = {path.parent.name: path.stat().st_size for path in tmp_path.rglob("page.html")}
    assert len(pages) == len(lessons())
    assert max(pages.values()) <= 450_000
    # A lesson has a page, a film of at most 0.4 million, sheets, pictures; the wheel 2 million.
    size = sum(path.stat().st_size for path in tmp_path.rglob("*.*"))
    assert size < 2_000_000 + 1_300_000 * len(lessons())


@pytest.mark.slow
def test_a_bundle_brings_the_tool_and_says_how_to_install_it(web, tmp_path):
    (wheel,) = web.glob("*.whl")
    index = (web / "index.html").read_text(encoding="utf-8")
    for python in (r".venv\Scripts\python", ".venv/bin/python"):
        assert f'{python} -m pip install "./{wheel.name}[notebook]" notebook' in index
    assert "../index.html#get" in (web / "02-letting-go" / "index.html").read_text("utf-8")
    # Installed from it, here without the libraries it needs, chutelab makes the same wheel again.
    pip = [sys.executable, "-m", "pip", "install", "--no-deps", "--no-index", "--no-compile"]
    there = tmp_path / "there"
    subprocess.run([*pip, "--quiet", "--target", there, wheel], check=True)
    made = "from pathlib import Path; from chutelab.classroom.lessons.pages import write_wheel; "
    made += "write_wheel(Path('web'))"
    given = {**os.environ, "PYTHONPATH": str(there)}
    subprocess.run([sys.executable, "-c", made], check=True, cwd=tmp_path, env=given)
    assert (tmp_path / "web" / wheel.name).read_bytes() == wheel.read_bytes()
    with ZipFile(wheel) as opened:
        assert opened.testzip() is None
        names = set(opened.namelist())
        assert not [name for name in names if name.endswith((".c", ".h", ".pyc"))]
        assert {"chutelab/data/scenes/slip.toml", "chutelab/data/lessons/README.md"} <= names


def test_a_bundle_without_the_wheel_says_nothing_of_it(tmp_path):
    result = chutelab("lesson", "page", "2", "--no-wheel", "-o", tmp_path / "web")
    assert result.exit_code == 0
    assert list((tmp_path / "web").glob("*.whl")) == []
    for page in (tmp_path / "web").glob("**/index.html"):
        assert "#get" not in page.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_pages_of_a_bundle_can_be_read_by_everybody(web, opened, scheme):
    for name in ("index.html", "02-letting-go/index.html"):
        page = opened(web / name, color_scheme=scheme)
        assert axe(page) == []
        dark = page.evaluate(
            "getComputedStyle(document.body).backgroundColor.match(/\\d+/g)[0] < 99"
        )
        assert dark == (scheme == "dark")
    lesson = Page((web / "02-letting-go" / "index.html").read_text(encoding="utf-8"))
    said = "The machine: a belt that ends at a large pulley, and a second belt below"
    assert lesson.told("alt", "img") == [said]


@pytest.mark.slow
def test_a_bundle_replaces_its_own_files_with_the_same_bytes_and_leaves_others(web, tmp_path):
    again = tmp_path / "web"
    shutil.copytree(web, again)
    (again / "mine.txt").write_text("keep")
    lesson = again / "02-letting-go"
    for path in (again / "index.html", *(path for path in lesson.rglob("*") if path.is_file())):
        path.write_text("old")
    result = chutelab("lesson", "page", "2", "-o", again)
    assert result.exit_code == 0
    assert "open " in result.stdout
    assert (again / "mine.txt").read_text() == "keep"
    assert "When does it let go?" in (again / "index.html").read_text(encoding="utf-8")
    for path in (path for path in lesson.rglob("*") if path.is_file()):
        # Pages have links to their neighbours.
        if path.name not in ("index.html", "explanation.html"):
            assert path.read_bytes() == (web / path.relative_to(again)).read_bytes()


def test_worksheets_cannot_smuggle_html_in():
    made = html_of("# Title\n\n![x](lesson.gif)\n\n<script>alert(1)</script>")
    assert "<script>" not in made
    assert "<h1>" not in made
    assert "<img" not in made
    # A figure is shown, what lies elsewhere is not.
    assert '<img src="split.png" alt="x" />' in html_of("![x](split.png)")
    for address in ("https://example.com/x.png", "../x.png", "machine.png"):
        assert "<img" not in html_of(f"![x]({address})")


@pytest.mark.slow
def test_a_bundle_works_from_a_file_in_a_browser(web, opened):
    page = opened(web / "index.html", viewport={"width": 360, "height": 740})
    page.click("text=When does it let go?")
    page.wait_for_function("document.documentElement.scrollWidth === 360")
    source = "document.querySelector('#picture').getAttribute('src')"
    assert page.evaluate(source) == "still.png"
    page.click("text=Play the film")
    assert page.evaluate(source) == "lesson.gif"
    page.click("text=Stop the film")
    assert page.evaluate(source) == "still.png"
    page.click("text=Explanation: open it")
    # The formulas are laid out a moment after the page is there.
    page.wait_for_function("document.documentElement.scrollWidth === 360")
    assert page.evaluate(source) == "end.png"
    page.click("text=Back to the lesson")
    page.click("text=Try it")
    page.wait_for_selector("canvas")


EVIL = "<script>alert(1)</script>\"'><img src=x onerror=alert(1)> & $x"


SCENE = "javascript:alert(1)#?.toml"


@pytest.fixture
def hostile(tmp_path):
    """A lesson whose texts and names are markup, and whose files' names are addresses."""
    folder = tmp_path / "01-a\"><b onclick='x'>#?%41 & c"
    start(tmp_path / "new").rename(folder)
    (folder / "scene.toml").rename(folder / SCENE)
    said, name = json.dumps(EVIL), json.dumps(SCENE)
    plan = f'title = {said}\nquestion = {said}\nlevel = "start"\nscenes = [{name}]\n'
    plan += f"[[steps]]\nkind = 'explain'\ntext = {said}\nthen = {said}\n"
    plan += f"[[steps.asks]]\ntext = {json.dumps(f'{EVIL} [x](javascript:alert(1))')}\n"
    plan += f"[picture]\nwidth = 320\nheight = 180\nfps = 10\nslow = 1\nmachine = {said}\n"
    (folder / "lesson.toml").write_text(plan, encoding="utf-8")
    return folder


def test_no_text_or_name_becomes_markup_or_script(web, hostile, tmp_path):
    out = tmp_path / "web"
    result = chutelab("lesson", "page", hostile, "-o", out)
    assert result.exit_code == 0, result.output
    for page, usual in (
        (out / hostile.name / "index.html", web / "06-grip-or-slip" / "index.html"),
        (out / "index.html", web / "index.html"),
    ):
        found, other = (Page(one.read_text(encoding="utf-8")) for one in (page, usual))
        assert EVIL in found.text
        known = {(tag, *attributes) for tag, attributes in other.tags}
        assert {(tag, *attributes) for tag, attributes in found.tags} <= known
        for _, attributes in found.tags:
            assert not str(attributes.get("href")).startswith("javascript:")
    assert broken_links(out) == set()
    assert (out / hostile.name / SCENE).is_file()


def test_a_page_of_a_scene_has_its_texts_as_texts(tmp_path):
    names = {}
    for title in ("x", f"{EVIL} </title><!-- \N{LINE SEPARATOR}"):
        path = tmp_path / "page.html"
        override = f"title={json.dumps(title)}"
        assert chutelab("live", "free-fall", "--set", override, "-o", path).exit_code == 0
        found = Page(path.read_text(encoding="utf-8"))
        names[title] = [(tag, *attributes) for tag, attributes in found.tags]
        assert title in found.text
    first, second = names.values()
    assert first == second


def linked(folder, name, target):
    (folder / name).unlink(missing_ok=True)
    try:
        (folder / name).symlink_to(target)
    except OSError:
        pytest.skip("no symbolic links here")


@pytest.mark.parametrize(
    ("command", "name"),
    [("page", "notes.txt"), ("page", "lesson.gif"), ("page", "gone"), ("new", "README.md"),
     ("new", "notes.txt"), ("show", "lesson.toml"), ("build", "README.md"), ("build", "gone")],
)  # fmt: skip
def test_no_lesson_reads_what_lies_elsewhere(tmp_path, name, command):
    folder = start(tmp_path / "mine")
    target = tmp_path / "secret"
    if name != "gone":
        target.write_bytes((folder / name).read_bytes() if (folder / name).exists() else b"secret")
    linked(folder, name, target)
    arguments = {"page": ["-o", tmp_path / "out"], "new": [tmp_path / "copy", "--from"]}
    result = chutelab("lesson", command, *arguments.get(command, []), folder)
    assert result.exit_code == 2
    assert f"{name}: a symbolic link out of the lesson's folder" in result.output
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "copy").exists()


def test_a_link_within_a_lesson_is_a_file(tmp_path):
    folder = start(tmp_path / "mine")
    linked(folder, "again.toml", "scene.toml")
    assert chutelab("lesson", "new", tmp_path / "copy", "--from", folder).exit_code == 0
    copy = tmp_path / "copy" / "again.toml"
    assert not copy.is_symlink()
    assert copy.read_bytes() == (folder / "scene.toml").read_bytes()


@pytest.mark.parametrize("command", [["page", "-o"], ["build", "--out"]])
def test_no_lesson_writes_through_a_link(tmp_path, command):
    folder = start(tmp_path / "mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "elsewhere").mkdir()
    linked(tmp_path / "out", "mine", tmp_path / "elsewhere")
    result = chutelab("lesson", *command, tmp_path / "out", folder)
    assert result.exit_code == 2
    assert "symbolic link" in result.output
    assert list((tmp_path / "elsewhere").iterdir()) == []


def test_lessons_of_one_name_are_refused_before_anything_is_made(tmp_path):
    first, second = start(tmp_path / "a" / "mine"), start(tmp_path / "b" / "mine")
    result = chutelab("lesson", "page", first, second, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert f"{second}: another lesson" in result.output
    assert not (tmp_path / "out").exists()
