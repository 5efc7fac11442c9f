from __future__ import annotations

import gc
import importlib
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import settings

from live.browser import browser, idle, opened, page_of, shown  # noqa: F401

ROOT = Path(__file__).parents[1]

# What runs in the background of a shell ignores Ctrl-C, and so would the commands that tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same draws everywhere: a red run is red again, on any machine. Runs with slow tests draw more.
for name, count in (("chutelab", 50), ("many", 200)):
    settings.register_profile(name, derandomize=True, deadline=None, max_examples=count)
settings.load_profile("chutelab")


def pytest_configure(config):
    """Draw more where slow tests are asked for."""
    if "not slow" not in config.option.markexpr:
        settings.load_profile("many")


def pytest_sessionstart(session):
    """Divide the test modules among workers to be compiled: each finds the others' in the cache."""
    told = getattr(session.config, "workerinput", None)
    if told is not None:
        some = slice(int(told["workerid"].removeprefix("gw")), None, told["workercount"])
        for path in sorted(Path(__file__).parent.glob("test_*.py"))[some]:
            # What cannot be imported is told when it is collected.
            with suppress(Exception, pytest.skip.Exception):
                importlib.import_module(path.stem)


# Modules and tests stay: no garbage is looked for among them.
gc.disable()


def pytest_collection_finish(session):
    """Leave all modules and tests out of garbage collections: benchmarks ask for many."""
    del session
    gc.collect()
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Keep neighbours in one process: what tests of a module share is made once, not in each."""
    scheduler = importlib.import_module("xdist.scheduler")
    return scheduler.WorkStealingScheduling(config, log) if config.option.dist == "load" else None


# Cells of notebooks, not modules.
collect_ignore_glob = ["solutions/*"]


@pytest.fixture
def with_fault(tmp_path, monkeypatch):
    """Return a function: from then on the core runs with a text in one of its files replaced."""
    pytest.importorskip("ziglang")
    import wasmtime

    from chutelab import core as module

    def plant(name, text, fault):
        core = tmp_path / "src" / "chutelab" / "core"
        for path in (ROOT / "src").glob("chutelab/core/*.[ch]"):
            core.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, core)
        (tmp_path / "tools").mkdir()
        tool = shutil.copy(ROOT / "tools" / "build_core.py", tmp_path / "tools")
        source = (core / name).read_text()
        assert source.count(text) == 1
        (core / name).write_text(source.replace(text, fault))
        subprocess.run([sys.executable, tool], check=True, timeout=120)
        engine = module._compiled()[0]
        built = wasmtime.Module(engine, (core / "core.wasm").read_bytes())
        monkeypatch.setattr(module, "_compiled", lambda: (engine, built))
        monkeypatch.setattr(module, "_idle", [])

    return plant
