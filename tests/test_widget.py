"""`chutelab.live`: the page in a notebook, and what it tells of the scene."""

import json
import sys

import pytest

import chutelab
from chutelab.pictures.live import SHOWN, widget
from chutelab.scene import SceneError, load, parse

pytest.importorskip("anywidget")

HOST = """<!doctype html><title>a notebook</title><div id="cell"></div><script type="module">
const values = VALUES;
globalThis.told = [];
const model = {
  get: (name) => values[name],
  set: (name, value) => { values[name] = value; },
  save_changes: () => told.push(values.scene),
  on: () => {}, off: () => {},
};
MODULE
globalThis.close = shown.render({ model, el: document.getElementById("cell") });
</script>"""


def test_it_holds_the_page_and_the_scene_and_is_shown_by_jupyter():
    found = chutelab.live("inclined-40", ["plate.distance=0.07"], height=500)
    scene = load("inclined-40", ["plate.distance=0.07"])
    assert parse(found.scene).plate == scene.plate
    assert found.html.startswith("<!doctype html>")
    assert (found.height, found.title) == (500, scene.title)
    assert "application/vnd.jupyter.widget-view+json" in found._repr_mimebundle_()[0]


def test_it_takes_scenes_names_and_files(tmp_path):
    scene = load("perpendicular")
    named = chutelab.live("perpendicular")
    assert chutelab.live(scene).html == named.html
    (tmp_path / "own.toml").write_text(named.scene, encoding="utf-8")
    assert chutelab.live(tmp_path / "own.toml").scene == named.scene
    with pytest.raises(SceneError, match="perpendicular"):
        chutelab.live("perpendiculr")


def test_without_anywidget_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    widget.cache_clear()
    with pytest.raises(ImportError, match=r'pip install "chutelab\[notebook\]"'):
        chutelab.live("perpendicular")


def hosted(opened, path, html):
    """Open a page that shows the widget as Jupyter does."""
    values = {"html": html, "height": 600, "title": "A scene", "scene": ""}
    module = SHOWN.replace("export default", "const shown =")
    text = HOST.replace("MODULE", module)
    packed = json.dumps(values).replace("<", "\\u003c")
    path.write_text(text.replace("VALUES", packed), encoding="utf-8")
    return opened(path)


@pytest.mark.slow
def test_what_the_page_posts_becomes_the_scene_and_nothing_else_does(opened, tmp_path):
    said = """<script>
    const three = {chutelab: "scene", toml: 3}, a = {chutelab: "scene", toml: "a"};
    for (const data of [three, {toml: "b"}, null, a]) parent.postMessage(data, "*");
    </script>"""
    tab = hosted(opened, tmp_path / "host.html", said)
    tab.evaluate('postMessage({chutelab: "scene", toml: "of another"}, "*")')
    tab.wait_for_function("told.length > 0")
    tab.evaluate("close()")
    tab.evaluate('document.querySelector("iframe").srcdoc += " "')
    tab.frame_locator("iframe").locator("body").wait_for(state="attached")
    assert tab.evaluate("told") == ["a"]
    assert tab.get_attribute("iframe", "title") == "A scene"
    assert tab.locator("iframe").bounding_box()["height"] == 600


def test_the_page_runs_in_its_frame_which_has_no_way_out(opened, tmp_path):
    """Worker, WebAssembly and all, from an origin of its own."""
    html = chutelab.live("perpendicular").html
    tab = hosted(opened, tmp_path / "host.html", html)
    frame = tab.frame_locator("iframe")
    frame.locator("#stage canvas").wait_for()
    assert tab.evaluate('document.querySelector("iframe").contentDocument') is None
