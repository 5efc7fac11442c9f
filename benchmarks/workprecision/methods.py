"""The methods: what runs, with which parameter, and what it refuses.

A method turns a scene and the value of its parameter into a recording or an answer. Only that is
timed: `load` imports what it needs, `prepare` writes the parameter into the scene, before.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from chutelab.results import Recording
from chutelab.scene import Scene, from_dict, to_dict
from chutelab.util.arrays import Floats
from workprecision.cases import Answer


class UnableError(RuntimeError):
    """A method cannot do a case; says why."""


@dataclass(frozen=True)
class Method:
    """A way to solve a case.

    Attributes
    ----------
    name, title : str
        On the command line, and for people.
    parameter : str
        What trades time for error: ``"dt"`` (s), ``"rtol"``, or "" for nothing.
    needs : str
        Module that is imported before anything is timed.
    values : tuple of float
        Of the parameter, from coarse to fine, for one particle; and in a quick run.
    for_many : tuple of float
        For the cases with many particles, which take longer; the first alone in a quick run.
    """

    name: str
    title: str
    parameter: str
    needs: str
    values: tuple[float, ...]
    quick: tuple[float, ...]
    for_many: tuple[float, ...]

    def chosen(self, case: str, *, quick: bool) -> tuple[float | None, ...]:
        """Return the values of the parameter to run a case with; one None without a parameter."""
        if not self.parameter or UNABLE.get((self.name, case)):
            return (None,)
        if case in MANY:
            return self.for_many[:1] if quick else self.for_many
        return self.quick if quick else self.values

    def load(self) -> None:
        """Import what the method needs.

        Raises
        ------
        UnableError
            If it is not installed.
        """
        try:
            import_module(self.needs)
        except ImportError as error:
            missing = (error.name or self.needs).partition(".")[0]
            raise UnableError(f'{missing} is missing: pip install "chutelab[bench]"') from error

    def prepare(self, scene: Scene, value: float | None) -> Scene:
        """Return the scene with the parameter written into it where the engines look for it."""
        if self.name not in ("contact", "aligned", "fixed"):
            return scene
        tables = to_dict(scene)
        run = {**tables.get("run", {}), "dt": value, "align": self.name != "fixed"}
        return from_dict({**tables, "run": run}, scene.source)

    def run(self, case: str, scene: Scene, value: float | None) -> Recording | Answer | Floats:
        """Solve a prepared scene.

        Raises
        ------
        UnableError
            If the method cannot do the case.
        """
        why = UNABLE.get((self.name, case))
        if why:
            raise UnableError(why)
        if self.name in ("plain", "dop853"):
            function: Any = getattr(import_module(self.needs), case)
            found: Answer | Floats = function(scene, value)
            return found
        from chutelab.engines.simulation import simulate

        return simulate(scene, engine=ENGINES.get(self.name, self.name))


ENGINES = {"aligned": "pymunk", "fixed": "pymunk"}
"""Engine of the methods that are not called as theirs is."""

MANY = ("independent", "interacting")

UNABLE = {
    ("exact", "interacting"): "no contacts between particles",
    ("aligned", "interacting"): "only a lone particle's steps end at contacts",
    ("dop853", "interacting"): "half a million pairs to watch",
}
"""Reasons why a method cannot do a case."""

# Disks of 4 mm that land with 4.4 m/s pass through a belt in longer steps than the fixed ones here.
_STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)

METHODS = {
    method.name: method
    for method in (
        Method("exact", "exact", "", "chutelab.engines.exact", (), (), ()),
        Method(
            "contact", "contact", "dt", "chutelab.engines.contact",
            (1.0 / 60.0, 3e-3, 1e-3, 3e-4, 1e-4), (1.0 / 60.0, 1e-3), (1e-3, 1e-2, 3e-3, 3e-4),
        ),
        Method(
            "aligned", "pymunk, aligned", "dt", "chutelab.engines.pymunk",
            (1.0 / 60.0, 3e-3, 1e-3, 3e-4, 1e-4), (1.0 / 60.0, 1e-3), (1e-3, 1e-2, 3e-3, 3e-4),
        ),
        Method(
            "fixed", "pymunk, fixed step", "dt", "chutelab.engines.pymunk",
            (8e-4, 3e-4, 1e-4), (8e-4, 1e-4), (8e-4, 3e-4),
        ),
        Method(
            "plain", "plain Pymunk", "dt", "workprecision.plain",
            _STEPS, (1e-3, 1e-4, 1e-5), (1e-3, 1e-2, 3e-3, 3e-4, 1e-4),
        ),
        Method(
            "dop853", "SciPy DOP853", "rtol", "workprecision.ode",
            (1e-3, 1e-6, 1e-9, 1e-12), (1e-3, 1e-12), (1e-3, 1e-12),
        ),
    )
}  # fmt: skip
"""All methods by name, in the order in which they are shown."""
