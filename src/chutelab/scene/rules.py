"""What no single key can answer for: keys that contradict or need one another.

Every rule is written so that it speaks only when a comparison is *true*. A `Look` answers NaN for
a key that is itself at fault, and nothing is true of NaN: so the rules can be asked about a
half-broken scene, and all faults of a file come out in one message.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Final

from chutelab.scene.errors import MISSING, Fault
from chutelab.scene.expectations import expectation_conflicts

ON_BELT: Final = 1e-9
"""How near to the belt's height R + r a release counts as lying on the belt, m."""


class ConflictError(ValueError):
    """Carries the faults of a rule through Pydantic's validation."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__("; ".join(str(fault) for fault in faults))
        self.faults = list(faults)


class Look:
    """Read-only look at a scene as nested mappings, sound or not.

    Parameters
    ----------
    document
        The tables as the file has them, or as a scene dumps them.
    model
        The scene's Pydantic model, for the defaults.
    faulty
        Full paths that are already known to be at fault.
    """

    def __init__(self, document: Mapping[str, Any], model: Any, faulty: Collection[str] = ()):
        self._document = document
        self._model = model
        self._faulty = faulty

    def sound(self, path: str) -> bool:
        """Whether neither the key, nor its table, nor anything inside it is at fault."""
        return not any(
            f == path or f.startswith((path + ".", path + "[")) or path.startswith(f + ".")
            for f in self._faulty
        )

    def has(self, table: str) -> bool:
        """Whether the table is there, sound or not; one that is only misspelt is at fault."""
        return self._document.get(table) is not None or table in self._faulty

    def given(self, table: str, key: str) -> bool:
        """Whether the key is written out, sound or not."""
        content = self._document.get(table)
        return isinstance(content, Mapping) and content.get(key) is not None

    def __call__(self, table: str, key: str) -> Any:
        """Return the value of a key, or its default; NaN if it is at fault or its table absent."""
        if not self.sound(f"{table}.{key}"):
            return math.nan
        if self.given(table, key):
            return self._document[table][key]
        if not self.has(table) and self._model.model_fields[table].default is None:
            return math.nan
        return self._model.tables()[table].model_fields[key].default

    def surfaces(self) -> list[Any]:
        """Return the free surfaces, as far as they are tables at all."""
        return self._list("surface")

    def expectations(self) -> list[Any]:
        """Return what the scene is expected to show, likewise."""
        return self._list("expect")

    def _list(self, key: str) -> list[Any]:
        found = self._document.get(key)
        return list(found) if isinstance(found, list | tuple) else []


def conflicts(look: Look) -> Iterator[Fault]:
    """Yield every conflict between keys; each names all the keys concerned."""
    yield from _tables(look)
    yield from _engine(look)
    yield from _release(look)
    yield from _surfaces(look)
    yield from _expectations(look)


def _tables(look: Look) -> Iterator[Fault]:
    needy = [f"[{table}]" for table in ("plate", "outgoing") if look.has(table)]
    if needy and not look.has("incoming"):
        need = "needs" if len(needy) == 1 else "need"
        yield Fault("incoming", MISSING, f"{' and '.join(needy)} {need} the table [incoming]")
    if look("plate", "above") == 0.0 and look("plate", "below") == 0.0:
        yield Fault("plate.above", 0.0, "a plate needs a length; plate.below is 0 too")
    if look("outgoing", "drop_from") == "impact" and not look.has("plate"):
        text = 'needs the table [plate]; without one write outgoing.drop_from = "top"'
        yield Fault("outgoing.drop_from", "impact", text)
    if look("run", "until") == "landed" and not look.has("outgoing"):
        text = 'needs the table [outgoing]; without one "settled" or a number of seconds'
        yield Fault("run.until", "landed", text)


def _engine(look: Look) -> Iterator[Fault]:
    radius, engine = look("particle", "radius"), look("run", "engine")
    interact = look("stream", "interact") is True
    if radius == 0.0:
        if look("particle", "spin") is True:
            text = "particle.radius is 0, and a mass point cannot turn"
            yield Fault("particle.spin", True, text)
        if engine in ("contact", "pymunk"):
            text = f"particle.radius is 0, and {engine} needs disks (> 0)"
            yield Fault("run.engine", engine, text)
        if interact:
            text = "particle.radius is 0, and mass points never meet"
            yield Fault("stream.interact", True, text)
    count = look("stream", "count")
    if interact and engine == "exact" and count > 1:
        text = f"stream.interact with stream.count = {count} needs contact or pymunk"
        yield Fault("run.engine", engine, text)


def _release(look: Look) -> Iterator[Fault]:
    if not look.has("incoming"):
        for key, what in (("at", "release point [x, y], m"), ("velocity", "[vx, vy], m/s")):
            if not look.given("stream", key) and look.sound(f"stream.{key}"):
                yield Fault(f"stream.{key}", MISSING, f"{what}; required without [incoming]")
        return
    if look("incoming", "friction") != "adhesion" or not _on_belt(look):
        return
    advice = 'incoming.friction = "adhesion" releases every particle at incoming.speed'
    if look("stream", "speed_spread") > 0.0:
        text = f"{advice}; give a Coulomb coefficient, or speed_spread = 0"
        yield Fault("stream.speed_spread", look("stream", "speed_spread"), text)
    if look.given("stream", "velocity") and look.sound("stream.velocity"):
        velocity, speed = look("stream", "velocity"), look("incoming", "speed")
        if abs(velocity[0] - speed) > 1e-12 * abs(speed) or velocity[1] != 0.0:
            text = f"{advice}; give a Coulomb coefficient, or leave the velocity out"
            yield Fault("stream.velocity", velocity, text)


def _on_belt(look: Look) -> bool:
    if not look.given("stream", "at"):
        return True
    if not look.sound("stream.at"):
        return False
    x, y = look("stream", "at")
    height = look("incoming", "pulley_radius") + look("particle", "radius")
    return bool(-look("incoming", "length") <= x <= 0.0 and abs(y - height) <= ON_BELT)


def _surfaces(look: Look) -> Iterator[Fault]:
    first: dict[str, int] = {}
    for index, surface in enumerate(look.surfaces()):
        if not isinstance(surface, Mapping):
            continue
        yield from surface_conflicts(f"surface[{index}]", surface)
        name = surface.get("name")
        if isinstance(name, str):
            if name in first:
                text = f"must be unique; surface[{first[name]}].name is the same"
                yield Fault(f"surface[{index}].name", name, text)
            first.setdefault(name, index)


def surface_conflicts(path: str, surface: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield what is wrong with how one free surface is laid out; `path` is the surface's own."""
    start, to, points = (surface.get(key) for key in ("from", "to", "points"))
    if points is not None:
        for key, value in (("from", start), ("to", to)):
            if value is not None:
                text = f"give either from and to, or {path}.points, not both"
                yield Fault(f"{path}.{key}", value, text)
    elif start is None and to is None:
        yield Fault(f"{path}.points", MISSING, "give from and to, or points = [[x, y], ...]")
    elif start is None or to is None:
        key, other = ("from", "to") if start is None else ("to", "from")
        yield Fault(f"{path}.{key}", MISSING, f"a point [x, y], to go with {path}.{other}")
    elif start == to:
        yield Fault(f"{path}.to", to, f"must differ from {path}.from")


def _expectations(look: Look) -> Iterator[Fault]:
    if not look.expectations() or not look.sound("surface"):
        return
    names = [table for table in ("incoming", "plate", "outgoing") if look.has(table)]
    names += [str(free["name"]) for free in look.surfaces()]
    for index, given in enumerate(look.expectations()):
        if isinstance(given, Mapping) and look.sound(f"expect[{index}]"):
            yield from expectation_conflicts(f"expect[{index}]", given, names)
