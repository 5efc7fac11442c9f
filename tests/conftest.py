from __future__ import annotations

from hypothesis import settings

# The same draws everywhere: a red run is red again, on any machine.
settings.register_profile("chutelab", derandomize=True, deadline=None)
settings.load_profile("chutelab")

# Cells of notebooks, not modules.
collect_ignore_glob = ["solutions/*"]
