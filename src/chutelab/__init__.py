"""Chutelab: one belt, one damping plate, a second belt, and every joule accounted for.

>>> import chutelab
>>> recording = chutelab.simulate("perpendicular")
>>> chutelab.compare(recording).max < 1e-12
True

The packages; each imports only those below it:

- `cli`: the commands;
- `classroom`: lessons, exercises, grading;
- `pictures`: plots, films, pages;
- `checks`: verify, check, stress, bench;
- `studies`: accuracy, sweeps, design, measured tracks;
- `engines`: exact, contact, pymunk, and `simulate`, which chooses;
- `results`: recordings, ledger, comparison, summary;
- `theory` and `machine`: the paper in closed form; a scene resolved to arrays for the engines;
- `scene`: scene files;
- `core`: C code that Python and the page both run: builds machines, runs the exact and the contact
  engine, judges runs;
- `util`: helpers for all of them.

The most important names are here: `scenes`, `load`, `Scene`, `SceneError`, `simulate`, `Recording`,
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

    from chutelab import theory as theory
    from chutelab.classroom import exercises as exercises
    from chutelab.engines.hand import start as start
    from chutelab.engines.simulation import simulate as simulate
    from chutelab.pictures.animation import animate as animate
    from chutelab.pictures.live import live as live
    from chutelab.pictures.plots import overlay as overlay
    from chutelab.results import Kind as Kind
    from chutelab.results import Recording as Recording
    from chutelab.results.quantities import compare as compare
    from chutelab.results.quantities import measure as measure
    from chutelab.scene import Scene as Scene
    from chutelab.scene import SceneError as SceneError
    from chutelab.scene import load as load
    from chutelab.scene import shipped
    from chutelab.studies import design as design
    from chutelab.studies import measured as measured
    from chutelab.studies.design import solve as solve
    from chutelab.studies.sweep import sweep as sweep
    from chutelab.theory import figures as figures
    from chutelab.util.errors import LawWarning as LawWarning

    scenes = shipped
    __version__: str
    """Version of the installed package."""

_HOME = {
    "Kind": "results:Kind", "LawWarning": "util.errors:LawWarning",
    "Recording": "results:Recording", "Scene": "scene:Scene", "SceneError": "scene:SceneError",
    "animate": "pictures.animation:animate", "compare": "results.quantities:compare",
    "design": "studies.design", "exercises": "classroom.exercises", "figures": "theory.figures",
    "live": "pictures.live:live", "load": "scene:load", "measure": "results.quantities:measure",
    "measured": "studies.measured", "overlay": "pictures.plots:overlay", "scenes": "scene:shipped",
    "simulate": "engines.simulation:simulate", "solve": "studies.design:solve",
    "start": "engines.hand:start", "sweep": "studies.sweep:sweep", "theory": "theory",
}  # fmt: skip
"""The module of each public name, or the module itself."""

__all__ = [*_HOME, "__version__"]


def __getattr__(name: str) -> Any:
    value: Any
    if name == "__version__":
        value = import_module("chutelab.util.files").own_version()
    elif name in _HOME:
        module, _, attribute = _HOME[name].partition(":")
        value = import_module(f"chutelab.{module}")
        value = getattr(value, attribute) if attribute else value
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
