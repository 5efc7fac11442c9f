"""``chutelab live``: the file it writes, the browser it opens, and what it refuses."""

import json
import os
import re
import subprocess
import sys
from functools import partial

import pytest

import shared

pytest.importorskip("chutelab.pictures.live.describe")


call = partial(shared.call, "live")


def data_of(path):
    """What the page knows, as it reads it."""
    page = path.read_text(encoding="utf-8")
    return json.loads(
        re.search(r'<script type="application/json" id="lab">(.*?)</script>', page, re.DOTALL)[1]
    )


def test_it_writes_one_file_with_the_scene_in_it(tmp_path):
    path = tmp_path / "lab.html"
    said = call("inclined-40", "--set", "plate.distance=0.07", "-o", path).stdout
    assert said == f"wrote {path}, {path.stat().st_size / 1000:.0f} kB\n"
    assert path.stat().st_size <= 450_000
    found = data_of(path)
    assert found["scene"]["plate"]["distance"] == 0.07
    assert found["scene"]["title"].endswith("; with plate.distance=0.07")
    assert found["language"] == "en"
    assert found["live"] == {
        "predict": False, "controls": None, "panels": None, "ranges": {}, "presets": []
    }  # fmt: skip


def test_what_the_page_offers_can_be_set_and_is_no_change_of_the_machine(tmp_path):
    path = tmp_path / "lab.html"
    settings = ("live.predict=true", 'live.controls=["plate.angle_deg"]')
    call("perpendicular", *(word for one in settings for word in ("--set", one)), "-o", path)
    found = data_of(path)
    assert found["live"]["predict"] is True
    assert found["live"]["controls"] == ["plate.angle_deg"]
    assert "; with" not in found["scene"]["title"]


def shown(tmp_path, **environment):
    """Run it without -o in a process of its own, whose files are in a folder of the test."""
    command = [sys.executable, "-m", "chutelab", "live", "perpendicular"]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=60, check=False,
        env={**os.environ, "TMPDIR": str(tmp_path), **environment},
    )  # fmt: skip


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have browsers of their own")
def test_without_a_file_it_opens_the_page_in_the_browser_and_says_where_it_is(tmp_path):
    browser = tmp_path / "browser.py"
    browser.write_text("import pathlib, sys\npathlib.Path(sys.argv[2]).write_text(sys.argv[1])\n")
    told = tmp_path / "told"
    result = shown(tmp_path, BROWSER=f"{sys.executable} {browser} %s {told}")
    assert result.returncode == 0, result.stderr
    (page,) = tmp_path.glob("*/perpendicular.html")
    assert told.read_text() == page.as_uri()
    assert result.stdout.startswith(f"opened {page}, ")
    assert data_of(page)["scene"]["title"] == "Perpendicular damping plate, 2 m/s"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="other systems have browsers of their own")
def test_without_a_browser_it_says_so_and_where_the_page_is(tmp_path):
    result = shown(tmp_path, PATH=str(tmp_path), BROWSER="", DISPLAY="", WAYLAND_DISPLAY="")
    assert result.returncode == 1
    (page,) = tmp_path.glob("*/perpendicular.html")
    assert f"no browser could be opened; the page is {page}" in result.stderr


@pytest.mark.parametrize(
    ("scene", "changes", "said"),
    [
        ("perpendicular", ["stream.count=100001"], "stream.count = 100001: a page has room for"),
        # The belt goes up at 60° and throws at 6 m/s: the impact is higher than the pulley.
        (
            "inclined-40",
            ["incoming.incline_deg=60", "incoming.speed=6", "plate.angle_deg=0", "plate.above=10"],
            "outgoing.drop = 0.1: more: a page measures the drop from the top",
        ),
        ("hopper", ["stream.fill=[[0, 0.5], [0.001, 0.501]]"], "stream.fill = [[0"),
    ],
)
def test_what_the_page_could_not_begin_with_is_refused(scene, changes, said, tmp_path):
    sets = [word for change in [*changes] for word in ("--set", change)]
    if scene == "inclined-40":
        sets += ["--set", "outgoing.drop=0.1"]
    assert said in call(scene, *sets, "-o", tmp_path / "lab.html", code=2).stderr
    assert not list(tmp_path.iterdir())
