"""C code that Python and the page both run; in Python as WebAssembly, run by wasmtime.

`*.c` are the machine of a scene and its releases, the contact engine, the exact engine, and the
laws by which every run is judged; `python tools/build_core.py` builds them to `core.wasm`, and the
part that live pages call to `page.wasm`. `layout.h` defines the data shared with the host; begin
reading there. Here the core is loaded: numbers in, numbers out, its arrays as NumPy's. Nothing else
in the package knows that it is WebAssembly.
"""

from __future__ import annotations

import ctypes
import json
import os
from contextlib import suppress
from enum import IntEnum
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import wasmtime
from numpy.typing import NDArray

from chutelab.util.files import version_of, whole

LARGE = 96 * 2**20
"""A used memory larger than this, in bytes, is freed instead of kept for the next run."""

SUBJECTS = ("Room", "World", "Plan", "Drawing", "Laws", "Exact", "Loads")
"""Structs of layout.h of which the core has exactly one."""

TYPES = {"double": "<f8", "float": "<f4", "int": "<i4", "pointer": "<u4"}

REAL, INTEGER = np.dtype(TYPES["double"]), np.dtype(TYPES["int"])


@cache
def _layout() -> dict[str, Any]:
    text = (files(__package__) / "layout.json").read_text(encoding="utf-8")
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
def _struct(name: str) -> type[ctypes.Structure]:
    """Return a struct as a structure of ctypes, which is ten times as fast to read and set."""
    kinds = {"double": ctypes.c_double, "int": ctypes.c_int32, "pointer": ctypes.c_uint32}
    fields = _layout()["structs"][name]["fields"]
    rows = [
        (field, kinds[kind] * n if n > 1 else kinds[kind]) for field, (_, kind, n) in fields.items()
    ]
    return type(name, (ctypes.Structure,), {"_fields_": rows})


@cache
def constants(enum: str) -> dict[str, int]:
    """Return an enum of layout.h."""
    values: dict[str, int] = _layout()["enums"][enum]
    return values


@cache
def number(name: str) -> Any:
    """Return a number that layout.h defines: a float if it has a point or an exponent."""
    return _layout()["constants"][name]


ASIDE = -1


class Status(IntEnum):
    """Why the core came back, as in layout.h."""

    DONE = 0
    PAUSED = 1
    FULL = 2
    STALLED = 3
    LACKING = 4


class AsideError(Exception):
    """The host has to prepare this run itself, see `ASIDE` of layout.h."""


class Module:
    """One instance of the module, with a memory of its own.

    Each part of the core has one struct of numbers and pointers to arrays, returned by a function
    of its name; `world` is that of the contact engine. The core allocates its arrays itself;
    `forget` frees them all.
    """

    def __init__(self) -> None:
        engine, module = _compiled()
        self._store = wasmtime.Store(engine)
        try:
            self._exports: Any = wasmtime.Instance(self._store, module, []).exports(self._store)
        except wasmtime.WasmtimeError as error:
            # Addresses for the largest possible memory are reserved, and there may be too few.
            raise MemoryError(" ".join(str(error).split())) from error
        self._functions: dict[str, Any] = {}
        self.call("_initialize")
        self._memory: Any = self._exports["memory"]
        self._bytes = np.empty(0, np.uint8)
        self._begins = {name: self.call(name.lower()) for name in SUBJECTS}
        self._look()
        self._first: int = self.structs["Room"].first
        self._begun = 0
        self.forget()

    def call(self, name: str, *numbers: float) -> Any:
        """Call a function of the core."""
        if name not in self._functions:
            self._functions[name] = function = self._exports[name]
            # Otherwise it would look up its type in every call, half of the time of a call.
            known = function.type(self._store)
            own = SimpleNamespace(params=known.params, results=known.results)
            function.type = lambda _: own
        return self._functions[name](self._store, *numbers)

    def forget(self) -> None:
        """Free all arrays and reset all structs."""
        for rows in self._own:
            rows.fill(0)
        # The core assumes zeros where it has not written yet, so nothing of an old run may remain.
        self._bytes[self._first : self._first + self._begun] = 0

    def work(self, name: str) -> None:
        """Call a function that may allocate memory, after which all views of arrays are invalid.

        Raises a `MemoryError` if there is no more to be had.
        """
        done = self.call(name)
        self._look()
        if not done:
            raise MemoryError(f"the core has {self.size / 2**30:.1f} GiB, and gets no more")

    def _look(self) -> None:
        """Get the memory again: it moves when it grows, and with it every array."""
        size = self._memory.data_len(self._store)
        if size == self.size:
            return
        address = ctypes.addressof(self._memory.data_ptr(self._store).contents)
        self._bytes = np.ctypeslib.as_array((ctypes.c_uint8 * size).from_address(address))
        self.structs: dict[str, Any] = {
            name: _struct(name).from_address(address + begin)
            for name, begin in self._begins.items()
        }
        self.world: Any = self.structs["World"]
        self._own = [
            self._bytes[begin : begin + ctypes.sizeof(_struct(name))]
            for name, begin in self._begins.items()
        ]

    @property
    def size(self) -> int:
        """Bytes of its memory."""
        return len(self._bytes)

    def snapshot(self) -> NDArray[Any]:
        """Return a copy of its memory, for `restore`."""
        return self._bytes.copy()

    def restore(self, kept: NDArray[Any]) -> None:
        """Restore its memory; bytes added since are 0."""
        self._bytes[: len(kept)] = kept
        self._bytes[len(kept) :] = 0

    def array(self, name: str, kind: np.dtype[Any], count: int, of: str = "World") -> NDArray[Any]:
        """Return a view of the array that a field points to, valid until `work` or `run`."""
        begin: int = getattr(self.structs[of], name)
        return np.frombuffer(self._bytes, kind, count, begin)

    def take_events(self, of: str = "World") -> NDArray[Any]:
        """Return all events as the bytes of rows of `results.EVENT`, and make room for others.

        Those of a finished run are not copied: like `array`, valid until the next call.
        """
        struct, room = self.structs[of], self.structs["Room"]
        size: int = room.packed or self.call("pack_events", struct.events, struct.event_count)
        rows, over = self._bytes[struct.events : struct.events + size], bool(room.packed)
        struct.event_count = room.packed = 0
        return rows if over else rows.copy()

    def fill(self, of: str, **arrays: NDArray[Any]) -> None:
        """Copy arrays, flat and contiguous, to where the fields of a struct point."""
        for name, array in arrays.items():
            begin: int = getattr(self.structs[of], name)
            self._bytes[begin : begin + array.nbytes] = array.view(np.uint8)

    def begin_with(self, numbers: NDArray[Any]) -> bool:
        """Copy numbers to the place of the first array; return whether there is room for them."""
        rows = self._bytes[self._first : self._first + numbers.nbytes]
        if fits := len(rows) == numbers.nbytes:
            self._begun = numbers.nbytes
            rows[:] = numbers.view(np.uint8)
        return fits

    def run(self, name: str, steps: int, lacking: int) -> int:
        """Call a function for at most so many steps, as `work`; `lacking` means out of memory."""
        # Passing a number takes as long as the rest of a call.
        self.structs["Room"].budget = steps
        status: int = self.call(name)
        self._look()
        if status == ASIDE:
            raise AsideError
        if status == lacking:
            raise MemoryError(f"the core has {self.size / 2**30:.1f} GiB, and gets no more")
        return status


@cache
def _compiled() -> tuple[wasmtime.Engine, wasmtime.Module]:
    """Return the compiled module: compiling takes 60 ms, loading it from the cache 1 ms."""
    engine, source = wasmtime.Engine(), (files(__package__) / "core.wasm").read_bytes()
    # Kept for this version of wasmtime in the user's cache folder.
    folder = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    name = sha256(source + str(version_of("wasmtime")).encode("ascii")).hexdigest()[:16]
    home = Path(folder) if folder else Path("~/.cache").expanduser()
    kept = home / "chutelab" / f"{name}.core"
    with suppress(OSError, wasmtime.WasmtimeError):
        data, states = kept.read_bytes(), [kept.stat(), kept.parent.stat()]
        # The file is loaded as machine code, so it must be undamaged and writable by this user
        # only. On Windows its folder ensures that.
        own = os.name == "nt" or all(
            one.st_uid == os.geteuid() and not one.st_mode & 0o022 for one in states
        )
        if sha256(data[32:]).digest() == data[:32] and own:
            return engine, wasmtime.Module.deserialize(engine, data[32:])
    module = wasmtime.Module(engine, source)
    code = bytes(module.serialize())
    with suppress(OSError):
        kept.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with whole(kept) as unfinished:
            unfinished.write_bytes(sha256(code).digest() + code)
    return engine, module


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
