"""The core in memory: WebAssembly run by wasmtime, its arrays as NumPy's.

Nothing else in the package knows that the core is WebAssembly.
"""

from __future__ import annotations

import ctypes
import json
from enum import IntEnum
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
import wasmtime
from numpy.typing import NDArray

PAGE = 65536
"""Bytes of a page of WebAssembly's memory."""

LARGE = 64 * 2**20
"""Bytes beyond which a used memory is let go rather than kept for the next run."""

TYPES = {"double": "<f8", "int": "<i4", "pointer": "<u4"}


@cache
def _layout() -> dict[str, Any]:
    text = (files(__package__) / "core" / "layout.json").read_text(encoding="utf-8")
    described: dict[str, Any] = json.loads(text)
    return described


@cache
def dtype(struct: str) -> np.dtype[Any]:
    """Return a struct of layout.h as a NumPy type."""
    described = _layout()["structs"][struct]
    fields = described["fields"]
    return np.dtype(
        {
            "names": list(fields),
            "formats": [
                (TYPES[kind], (n,)) if n > 1 else TYPES[kind] for _, kind, n in fields.values()
            ],
            "offsets": [offset for offset, _, _ in fields.values()],
            "itemsize": described["size"],
        }
    )


@cache
def _world() -> type[ctypes.Structure]:
    """Return `World` as a structure of ctypes, which is read and set ten times as fast."""
    kinds = {"double": ctypes.c_double, "int": ctypes.c_int32, "pointer": ctypes.c_uint32}
    fields = _layout()["structs"]["World"]["fields"]
    rows = [
        (name, kinds[kind] * n if n > 1 else kinds[kind]) for name, (_, kind, n) in fields.items()
    ]
    return type("World", (ctypes.Structure,), {"_fields_": rows})


@cache
def constants(enum: str) -> dict[str, int]:
    """Return an enum of layout.h."""
    values: dict[str, int] = _layout()["enums"][enum]
    return values


@cache
def number(name: str) -> int:
    """Return a number that layout.h defines."""
    value: int = _layout()["constants"][name]
    return value


class Status(IntEnum):
    """Why the core came back, as in layout.h."""

    DONE = 0
    PAUSED = 1
    FULL_KNOTS = 2
    FULL_EVENTS = 3
    FULL_NEAR = 4
    FULL_CONTACTS = 5
    STALLED = 6


class Module:
    """One instance of the module, with a memory of its own.

    Arrays are placed one after the other behind the module's own data; `forget` frees them all.
    """

    def __init__(self) -> None:
        engine, module = _compiled()
        self._store = wasmtime.Store(engine)
        try:
            exports = wasmtime.Instance(self._store, module, []).exports(self._store)
        except wasmtime.WasmtimeError as error:
            # Addresses for all that it may grow to are set apart, and there may be too few.
            raise MemoryError(" ".join(str(error).split())) from error
        initialize: Any = exports["_initialize"]
        initialize(self._store)
        self._memory: Any = exports["memory"]
        self._run: Any = exports["run"]
        self._prepare: Any = exports["prepare"]
        base: Any = exports["__heap_base"]
        world: Any = exports["world"]
        self._base: int = base.value(self._store)
        self._world: int = world(self._store)
        self.forget()

    def forget(self) -> None:
        """Free all arrays and reset the world."""
        self._end = self._base
        self._look()
        self._bytes[self._world : self._world + ctypes.sizeof(self.world)] = 0

    def _look(self) -> None:
        """Look at the memory anew; it moves when it grows, and with it every array."""
        size = self._memory.data_len(self._store)
        address = ctypes.addressof(self._memory.data_ptr(self._store).contents)
        self._bytes = np.ctypeslib.as_array((ctypes.c_uint8 * size).from_address(address))
        self.world: Any = _world().from_address(address + self._world)

    @property
    def size(self) -> int:
        """Bytes of its memory."""
        return len(self._bytes)

    def place(self, *arrays: tuple[str, np.dtype[Any], int]) -> None:
        """Make room for arrays of zeros, to which `World.name` points from now on."""
        begins, first = [], self._end
        for _, kind, count in arrays:
            begin = (self._end + 15) // 16 * 16
            begins.append(begin)
            self._end = begin + kind.itemsize * max(1, count)
        if self._end > self.size:
            self._memory.grow(self._store, -(-(self._end - self.size) // PAGE))
            self._look()
        self._bytes[first : self._end] = 0
        for (name, _, _), begin in zip(arrays, begins, strict=True):
            setattr(self.world, name, begin)

    def array(self, name: str, kind: np.dtype[Any], count: int) -> NDArray[Any]:
        """Return a view of the array that `World.name` points to; `place` makes it invalid."""
        begin: int = getattr(self.world, name)
        rows: NDArray[Any] = self._bytes[begin : begin + kind.itemsize * count].view(kind)
        return rows

    def prepare(self) -> None:
        """Have the core work out what follows from the arrays as they are filled in."""
        self._prepare(self._store)

    def run(self, steps: int) -> Status:
        """Run on for at most so many steps."""
        return Status(self._run(self._store, steps))


@cache
def _compiled() -> tuple[wasmtime.Engine, wasmtime.Module]:
    engine = wasmtime.Engine()
    return engine, wasmtime.Module(engine, (files(__package__) / "core" / "core.wasm").read_bytes())


_idle: list[Module] = []


def borrow() -> Module:
    """Return a module that is not in use, reset; give it back with `give_back`."""
    try:
        module = _idle.pop()
    except IndexError:
        return Module()
    module.forget()
    return module


def give_back(module: Module) -> None:
    """Keep a module for the next run, unless its memory has grown large."""
    if module.size <= LARGE:
        _idle.append(module)
