"""Chutelab: one belt, one damping plate, a second belt, and every joule accounted for.

>>> import chutelab
>>> recording = chutelab.simulate(chutelab.load("perpendicular"))
>>> chutelab.compare(recording).max < 1e-12
True

- `load`, `Scene`, `SceneError`: scene files, see `chutelab.scene`;
- `simulate`, `Recording`: run a scene, keep what happened;
- `theory`: the paper's equations in closed form;
- `compare`: simulated against theory;
- `overlay`, `animate`: pictures;
- `exercises`, `measured`, `design`, `figures`: questions that answer back, points from a film, what
  to build, the paper's figures.

Each is imported when it is first asked for, so that text output never waits for matplotlib, nor the
exact engine for pymunk or wasmtime.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from chutelab import design, exercises, figures, measured, theory
    from chutelab.animate import animate
    from chutelab.compare import compare
    from chutelab.plots import overlay
    from chutelab.recording import Recording
    from chutelab.scene import Scene, SceneError, load
    from chutelab.simulation import simulate

    __version__: str

__all__ = [
    "Recording",
    "Scene",
    "SceneError",
    "__version__",
    "animate",
    "compare",
    "design",
    "exercises",
    "figures",
    "load",
    "measured",
    "overlay",
    "simulate",
    "theory",
]

_PACKAGES = {"design", "exercises", "figures", "measured", "theory"}

_HOME = {
    "Recording": "chutelab.recording",
    "Scene": "chutelab.scene",
    "SceneError": "chutelab.scene",
    "animate": "chutelab.animate",
    "compare": "chutelab.compare",
    "load": "chutelab.scene",
    "overlay": "chutelab.plots",
    "simulate": "chutelab.simulation",
}


class _Package(ModuleType):
    """A package whose functions `compare` and `animate` win over their modules of the same name."""

    def __setattr__(self, name: str, value: Any) -> None:
        # Importing chutelab.compare binds the module here; callers mean the function.
        if isinstance(value, ModuleType) and _HOME.get(name) == value.__name__:
            value = getattr(value, name)
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    value: Any
    if name == "__version__":
        value = _version()
    elif name in _PACKAGES:
        value = import_module(f"chutelab.{name}")
    elif name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _version() -> str:
    from chutelab.versions import version_of

    return version_of("chutelab") or "unknown (not installed)"
