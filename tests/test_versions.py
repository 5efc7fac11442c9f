"""Libraries that are too old are told from those that do, and pyproject.toml says which."""

import os
import re
import runpy
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

from chutelab.util import errors
from chutelab.util.errors import MissingLibraryError, library, too_old

ROOT = Path(__file__).parent.parent
OWN = ("pydantic>=2.9", "numpy>=1.26", "never-installed>=1", 'scipy>=1.12; extra == "design"')


def installed(folder, name, version, *needs):
    """Make a folder look as if a package was installed in it."""
    about = folder / f"{name}-{version}.dist-info" / "METADATA"
    about.parent.mkdir()
    lines = ["Metadata-Version: 2.1", f"Name: {name}", f"Version: {version}"]
    lines += [f"Requires-Dist: {need}" for need in needs]
    about.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.mark.parametrize(
    ("version", "fits"), [("2.7.0", False), ("2.8.9", False), ("2.9", True), ("2.10.1", True)]
)
def test_a_package_that_is_too_old_is_named(tmp_path, monkeypatch, version, fits):
    installed(tmp_path, "chutelab", "0.1.0", *OWN)
    installed(tmp_path, "pydantic", version)
    installed(tmp_path, "numpy", "2.0.0rc1")
    monkeypatch.syspath_prepend(tmp_path)
    assert too_old() == ([] if fits else [f"pydantic>=2.9 ({version} is installed)"])


def test_packages_are_found_as_python_finds_them(tmp_path, monkeypatch):
    installed(tmp_path, "Some.old_Name", "1.5rc2")
    monkeypatch.syspath_prepend(tmp_path)
    every = [one for one in metadata.distributions() if one.metadata["Name"]]
    (tmp_path / "other_name-2.5-py3.11.egg-info").mkdir()
    found = {name: version for name, (version, _) in errors.installed().items()}
    assert found["some-old-name"] == "1.5rc2"
    assert found.pop("other-name") == "2.5"  # without METADATA Python has no version of it
    names = [re.sub(r"[-_.]+", "-", one.metadata["Name"]).lower() for one in every]
    assert found == dict(zip(names[::-1], [one.version for one in every][::-1], strict=True))


def test_no_command_goes_on_with_a_library_that_is_too_old(tmp_path):
    # pydantic 2.8 writes another JSON Schema, from which no key was found to be varied.
    installed(tmp_path, "chutelab", "0.1.0", *OWN)
    installed(tmp_path, "pydantic", "2.8.2")
    path = os.pathsep.join([str(tmp_path), str(ROOT / "src")])
    done = subprocess.run(
        [sys.executable, "-m", "chutelab", "check", "perpendicular"],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        'Error: chutelab needs pydantic>=2.9 (2.8.2 is installed): pip install "pydantic>=2.9"\n'
    )


def test_nor_does_what_an_extra_brings(tmp_path, monkeypatch):
    installed(tmp_path, "chutelab", "0.1.0", *OWN)
    installed(tmp_path, "scipy", "1.7.0")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingLibraryError, match=r"scipy>=1\.12 \(1\.7\.0 is installed\)"):
        library("scipy.optimize", "SciPy is needed", "design")


def test_what_is_to_be_cited_is_this_version():
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {project['version']}\n" in cited
    assert f"\nlicense: {project['license']}\n" in cited
    assert f"  - name: {project['authors'][0]['name']}\n" in cited
    assert "doi: 10.5194/ms-7-167-2016" in cited


def test_every_dependency_says_its_lowest_version(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "tools")
    lowest = runpy.run_path(str(ROOT / "tools" / "versions.py"))["lowest"]
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    pins = dict(pin.split("==") for pin in lowest(project))
    assert pins["pydantic"] == "2.9"
    assert {"imageio", "scipy", "psutil", "hypothesis"} <= pins.keys()
    with pytest.raises(SystemExit, match="'rich' has no lower bound"):
        lowest({"dependencies": ["rich"], "optional-dependencies": {}})
