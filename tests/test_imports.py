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
EVERYTHING = PICTURES | {
    "matplotlib.pyplot",
    "numpy",
    "pydantic",
    "pymunk",
    "wasmtime",
    "scipy",
    "rich",
    "click",
}

WATCH = """
import json, sys
from chutelab.cli import main
for words in json.loads(sys.argv[1]):
    try:
        main(words.split())
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


def loaded_by(*commands, cwd=None):
    """Return what is loaded after each of some commands, one after the other in one process."""
    watch = WATCH.format(everything=sorted(EVERYTHING))
    done = python("-c", watch, json.dumps(commands), cwd=cwd)
    return [set(json.loads(found)) for found in re.findall("^LOADED (.*)", done.stderr, re.M)]


SCENES = {"click", "pydantic"}
RUNS = SCENES | {"numpy", "wasmtime"}
CHAINS = [
    {
        "--help": {"click"}, "--version": {"click"}, "run --help": {"click"},
        "scenes --json": SCENES, "materials coal --json": SCENES, "schema": SCENES, "new -": SCENES,
        "run perpendicular --json": RUNS, "run perpendicular --quiet": RUNS,
        "run perpendicular --json --engine contact": RUNS,
        "run stream --json --set stream.count=3": RUNS,
        "run perpendicular --json --out out --only csv,npz,json": RUNS,
        "run perpendicular --json --engine pymunk": RUNS | {"pymunk"},
    },
    {"tables 4 --json": {"click", "numpy"}, "run perpendicular": RUNS | {"rich"},
     "check perpendicular": RUNS | {"rich"}, "check stream": RUNS | {"rich"}},
]  # fmt: skip
"""Commands, each of which needs all that those before it do, and what is loaded after it."""


@pytest.mark.parametrize("chain", CHAINS)
def test_a_command_loads_what_it_needs_and_nothing_else(chain, tmp_path):
    found = loaded_by(*chain, cwd=tmp_path)
    assert dict(zip(chain, found, strict=True)) == chain


@pytest.mark.slow
def test_pictures_load_no_engine_and_no_pyplot(tmp_path):
    (loaded,) = loaded_by("run perpendicular -q --out out --only png,gif", cwd=tmp_path)
    assert "matplotlib" in loaded
    assert not loaded & {"pymunk", "scipy", "rich", "matplotlib.pyplot"}


def test_a_scene_with_sizes_in_words_needs_no_whole_schema():
    code = (
        "from chutelab.scene import load, overrides; load('galton'); load('coal-transfer');"
        "made = overrides._schema.cache_info().currsize; load('galton', 'gravity=1.6 m/s²');"
        "print(made, overrides._schema.cache_info().currsize)"
    )
    assert python("-c", code).stdout == "0 1\n"


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


OWN = {
    "core.h": "contact",
    "joint.h": "contact",
    "shape.h": "contact",
    "exact.h": "exact",
    "exact_pieces.h": "exact",
    "laws.h": "laws",
    "plan.h": "machine",
} | {"releases.h": "machine"}
"""Headers of the core, by what they belong to."""

SHARED = {"layout.h", "loads.h", "memory.h", "trig.h"}
"""Structs, sums of impulses, where arrays lie, sine and cosine: no mechanics."""


def test_engines_judge_and_builder_in_the_core_share_no_formula():
    for path in (Path(SOURCES) / "chutelab" / "core").glob("*.[ch]"):
        headers = set(re.findall(r'#include "(\w+\.h)"', path.read_text())) - SHARED
        assert headers <= OWN.keys()
        assert len({OWN[name] for name in headers | ({path.name} & OWN.keys())}) <= 1
