"""Chutelab: one belt, one damping plate, a second belt, and every joule accounted for.

>>> import chutelab
>>> recording = chutelab.simulate("perpendicular")
>>> chutelab.compare(recording).max < 1e-12
True

The rooms of the house; each imports only those below it:

- `cli`: the commands;
- `classroom`: lessons, exercises, grading;
- `pictures`: plots, films, pages;
- `checks`: verify, check, stress, bench;
- `studies`: accuracy, sweeps, design, measured tracks;
- `engines`: exact, contact, pymunk, and `simulate`, which chooses;
- `results`: recordings, ledger, comparison, summary;
- `theory` and `machine`: the paper in closed form; a scene resolved to arrays for the engines;
- `scene`: scene files;
- `core`: what runs in Python and in the page alike, in C: builds machines, runs contact,
  judges runs;
- `util`: small things for all.

What most people need is here: `scenes`, `load`, `Scene`, `SceneError`, `simulate`, `Recording`,
`Kind`, `LawWarning`, `theory`, `compare`, `measure`, `sweep`, `solve`, `overlay`, `animate`,
`live`, and `exercises`, `measured`, `design`, `figures`. Each is imported when it is first asked
for, so that text output never waits for matplotlib, nor the exact engine for pymunk.
"""

from __future__ import annotations

from importlib import import_module

# Not from `typing`: its import takes as long as the rest until the command line waits for signals.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from chutelab import theory
    from chutelab.classroom import exercises
    from chutelab.engines.simulation import simulate
    from chutelab.pictures.animation import animate
    from chutelab.pictures.live import live
    from chutelab.pictures.plots import overlay
    from chutelab.results import Kind, Recording
    from chutelab.results.comparison import compare
    from chutelab.results.quantities import measure
    from chutelab.scene import Scene, SceneError, load
    from chutelab.scene import shipped as scenes
    from chutelab.studies import design, measured
    from chutelab.studies.design import solve
    from chutelab.studies.sweep import sweep
    from chutelab.theory import figures
    from chutelab.util.errors import LawWarning

    __version__: str
    """Of the package that is installed."""

__all__ = [
    "Kind",
    "LawWarning",
    "Recording",
    "Scene",
    "SceneError",
    "__version__",
    "animate",
    "compare",
    "design",
    "exercises",
    "figures",
    "live",
    "load",
    "measure",
    "measured",
    "overlay",
    "scenes",
    "simulate",
    "solve",
    "sweep",
    "theory",
]

_PACKAGES = {
    "design": "chutelab.studies.design",
    "exercises": "chutelab.classroom.exercises",
    "figures": "chutelab.theory.figures",
    "measured": "chutelab.studies.measured",
    "theory": "chutelab.theory",
}

_HOME = {
    "Kind": "chutelab.results",
    "LawWarning": "chutelab.util.errors",
    "Recording": "chutelab.results",
    "Scene": "chutelab.scene",
    "SceneError": "chutelab.scene",
    "animate": "chutelab.pictures.animation",
    "compare": "chutelab.results.comparison",
    "live": "chutelab.pictures.live",
    "load": "chutelab.scene",
    "measure": "chutelab.results.quantities",
    "overlay": "chutelab.pictures.plots",
    "simulate": "chutelab.engines.simulation",
    "solve": "chutelab.studies.design",
    "sweep": "chutelab.studies.sweep",
}


def __getattr__(name: str) -> Any:
    value: Any
    if name == "__version__":
        value = import_module("chutelab.util.versions").own_version()
    elif name in _PACKAGES:
        value = import_module(_PACKAGES[name])
    elif name == "scenes":
        value = import_module("chutelab.scene").shipped
    elif name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
