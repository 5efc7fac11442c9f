"""What gets loaded: text waits for no pictures, a machine for the core alone."""

import json
import os
import re
import subprocess
import sys
from contextlib import suppress
from functools import reduce
from importlib import import_module
from pathlib import Path

import pytest

import chutelab

SOURCES = str(Path(chutelab.__file__).parent.parent)
PICTURES = {"matplotlib", "imageio", "PIL"}
EVERYTHING = PICTURES | {"numpy", "pydantic", "pymunk", "wasmtime", "scipy", "rich", "click"}

WATCH = """
import json, sys
from chutelab.cli import main
try:
    main(sys.argv[1:])
except SystemExit as end:
    assert end.code == 0, end.code
loaded = sorted(name for name in {everything!r} if name in sys.modules)
print("LOADED " + json.dumps(loaded), file=sys.stderr)
"""


def python(*arguments, cwd=None):
    environment = {**os.environ, "PYTHONPATH": SOURCES}
    return subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
        env=environment,
        cwd=cwd,
    )


def loaded_by(*arguments, cwd=None):
    watch = WATCH.format(everything=sorted(EVERYTHING))
    done = python("-c", watch, *arguments, cwd=cwd)
    return set(json.loads(done.stderr.rpartition("LOADED ")[2]))


@pytest.mark.parametrize(
    ("arguments", "needed"),
    [
        (["--help"], {"click"}),
        (["--version"], {"click"}),
        (["run", "--help"], {"click"}),
        (["scenes", "--json"], {"click", "pydantic"}),
        (["materials", "coal", "--json"], {"click", "pydantic"}),
        (["schema"], {"click", "pydantic"}),
        (["new", "-"], {"click", "pydantic"}),
        (["check", "perpendicular"], {"click", "pydantic", "numpy", "rich", "wasmtime"}),
        (["tables", "4", "--json"], {"click", "numpy"}),
        (["run", "perpendicular", "--json"], {"click", "pydantic", "numpy", "wasmtime"}),
        (["run", "perpendicular", "--quiet"], {"click", "pydantic", "numpy", "wasmtime"}),
        (["run", "perpendicular"], {"click", "pydantic", "numpy", "rich", "wasmtime"}),
        (
            ["run", "perpendicular", "--json", "--engine", "pymunk"],
            {"click", "pydantic", "numpy", "pymunk", "wasmtime"},
        ),
        (
            ["run", "perpendicular", "--json", "--engine", "contact"],
            {"click", "pydantic", "numpy", "wasmtime"},
        ),
        (
            ["run", "stream", "--json", "--set", "stream.count=3"],
            {"click", "pydantic", "numpy", "wasmtime"},
        ),
        (["check", "stream"], {"click", "pydantic", "numpy", "rich", "wasmtime"}),
        (
            ["run", "perpendicular", "--json", "--out", "out", "--only", "csv,npz,json"],
            {"click", "pydantic", "numpy", "wasmtime"},
        ),
    ],
    ids=lambda words: " ".join(sorted(words) if isinstance(words, set) else words),
)
def test_a_command_loads_what_it_needs_and_nothing_else(arguments, needed, tmp_path):
    assert loaded_by(*arguments, cwd=tmp_path) == needed


def test_a_picture_loads_no_engine(tmp_path):
    loaded = loaded_by("run", "perpendicular", "-q", "--out", "out", "--only", "png", cwd=tmp_path)
    assert "matplotlib" in loaded
    assert not loaded & {"pymunk", "scipy", "rich"}


def test_importing_the_package_loads_nothing():
    code = f"import sys, chutelab; print([n for n in {sorted(EVERYTHING)!r} if n in sys.modules])"
    assert python("-c", code).stdout == "[]\n"


def test_the_package_offers_what_it_promises():
    for name in chutelab.__all__:
        assert getattr(chutelab, name) is not None
    assert dir(chutelab) == sorted(chutelab.__all__)
    with pytest.raises(AttributeError, match="no attribute 'belt'"):
        chutelab.belt  # noqa: B018


def named(text):
    return set(re.findall(r"`(chutelab(?:\.\w+)+)`", text))


def resolved(name):
    """Import as much of a dotted name as can be, and get the rest."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        with suppress(ModuleNotFoundError):
            return reduce(getattr, parts[count:], import_module(".".join(parts[:count])))
    raise ModuleNotFoundError(name)


def test_what_docstrings_and_texts_name_is_there():
    root = Path(__file__).parents[1]
    texts = [*(root / "src").rglob("*.py"), *(root / "docs").glob("*.md"), *root.glob("*.md")]
    for name in sorted(set().union(*(named(path.read_text("utf-8")) for path in texts))):
        resolved(name)


OWN = {"core.h": "contact", "exact.h": "exact", "laws.h": "laws", "plan.h": "machine"} | {
    "releases.h": "machine"
}
"""Headers of the core, by what they belong to."""

SHARED = {"layout.h", "memory.h", "trig.h"}
"""Structs, where arrays lie, sine and cosine: no mechanics."""


def test_engines_judge_and_builder_in_the_core_share_no_formula():
    for path in (Path(SOURCES) / "chutelab" / "core").glob("*.[ch]"):
        headers = set(re.findall(r'#include "(\w+\.h)"', path.read_text())) - SHARED
        assert headers <= OWN.keys()
        assert len({OWN[name] for name in headers | ({path.name} & OWN.keys())}) <= 1
