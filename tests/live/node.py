"""The page's modules in node: scripts of this folder ask them, a question and an answer as JSON."""

from __future__ import annotations

import json
import shutil
import subprocess
from functools import cache
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

import chutelab.pictures.live
from chutelab.pictures.live.describe import describe
from chutelab.scene import from_dict

HERE = Path(__file__).parent
ASSETS = Path(chutelab.pictures.live.__file__).parent / "assets"
NODE = shutil.which("node")
ESBUILD = shutil.which("esbuild", path=HERE / "node_modules" / ".bin")

needs_node = pytest.mark.skipif(
    NODE is None or ESBUILD is None, reason="needs node, and npm ci in tests/live"
)


@cache
def _modules() -> TemporaryDirectory[str]:
    """Return the folder of the modules as JavaScript, one file each, which is built once."""
    folder = TemporaryDirectory()
    flags = ["--bundle", "--splitting", "--format=esm", "--log-level=warning"]
    subprocess.run([ESBUILD, *ASSETS.glob("*.ts"), *flags, f"--outdir={folder.name}"], check=True)
    return folder


def ask(script, question):
    """Return what a script of this folder answers, which loads modules from the folder it is told.

    JSON has no infinite numbers and no NaN: scripts read and write them as text.
    """
    done = subprocess.run(
        [str(NODE), HERE / script, _modules().name], input=json.dumps(question),
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def page_scene(scene):
    """Return a scene as a page begins with it, and the same for Python."""
    given = describe(scene)["scene"]
    return given, from_dict(given)


def plain(value):
    """Return a tree with the numbers that JSON has not as JavaScript writes them."""
    if isinstance(value, float) and not isfinite(value):
        return {"inf": "Infinity", "-inf": "-Infinity", "nan": "NaN"}[str(value)]
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return {key: plain(entry) for key, entry in value.items()} if isinstance(value, dict) else value
