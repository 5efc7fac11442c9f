from __future__ import annotations

import gc
import signal

from hypothesis import settings

from live.browser import browser, opened, shown  # noqa: F401

# What runs in the background of a shell ignores Ctrl-C, and so would the commands that tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same draws everywhere: a red run is red again, on any machine.
settings.register_profile("chutelab", derandomize=True, deadline=None)
settings.load_profile("chutelab")


def pytest_collection_finish(session):
    """Leave all modules and tests out of garbage collections: benchmarks ask for many."""
    del session
    gc.collect()
    gc.freeze()


# Cells of notebooks, not modules.
collect_ignore_glob = ["solutions/*"]
