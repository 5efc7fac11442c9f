"""Tables of a scene as they are written, valid or not: what the rules look at."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any, Final

from chutelab.util.errors import MISSING, Fault

EITHER: Final = {"particle": "particles", "plate": "plates", "stream": "streams"}
"""Tables that a file has once, ``[stream]``, or several times, ``[[stream]]``; lists in code."""

ALWAYS: Final = ("particle", "stream", "run")
"""Tables that a scene has even if they are not written."""

JOINTS: Final = ("string", "rod", "spring", "pin")
"""Tables of joints between particles, or with points; as `Tie` in layout.h."""

MOTIONS: Final = ("turn", "shake", "travel")
"""Keys by which the motion of a surface is prescribed."""

WAITS = ("opens_when", "closes_when", "starts_when")
"""Keys of triggers, which wait until another surface is touched."""

NO_MACHINE: Final = ("sensor", "expect", "view", "live")
"""Tables that do not concern the machine."""

LIST: Final = (list, tuple)

SURFACES: Final = ("plate", "conveyor", "surface")
"""Lists of tables that are surfaces with names of their own."""


class Row:
    """A table, or one of several, valid or not; keys that are not written have their defaults."""

    def __init__(self, look: Look, table: str, number: int) -> None:
        found: Any = look.document.get(table)
        several = isinstance(found, LIST)
        if several:
            found = found[number] if number < len(found) else None
        self.head = f"{table}[{number}]" if several else table
        self.content: dict[str, Any] = found if isinstance(found, dict) else {}
        self._look = look
        self._defaults = look.defaults[table]
        self._there = table in ALWAYS or look.has(table)

    def path(self, key: str) -> str:
        """Return the full path of a key."""
        return f"{self.head}.{key}"

    def given(self, key: str) -> bool:
        """Whether the key is written, valid or not."""
        return self.content.get(key) is not None

    def sound(self, key: str = "") -> bool:
        """Whether a key, or the whole table, is valid."""
        return self._look.sound(self.path(key) if key else self.head)

    def __getitem__(self, key: str) -> Any:
        """Return the value of a key, or its default; NaN if it is invalid or its table absent.

        A name in code, such as `from_`, is accepted for the key.
        """
        key = key.rstrip("_")
        path, look = f"{self.head}.{key}", self._look
        look.asked.add(path)
        if look.faulty and not look.sound(path):
            return math.nan
        value = self.content.get(key)
        if value is not None:
            return value
        return self._defaults[key] if self._there else math.nan

    def fault(self, key: str, allowed: str) -> Fault:
        """Report that a key has a value that it should not have."""
        return Fault(self.path(key), self[key], allowed)

    def missing(self, key: str, wanted: str) -> Fault:
        """Report that a key is missing."""
        return Fault(self.path(key), MISSING, wanted)


class Look:
    """Read-only view of a scene's tables, as in its file or dumped, valid or not.

    `defaults` has the defaults of the keys of each table; `faulty` the full paths of invalid keys;
    `asked` the keys that were read, on which alone the rules can depend.
    """

    def __init__(
        self,
        document: Mapping[str, Any],
        defaults: Mapping[str, Mapping[str, Any]],
        faulty: Collection[str] = (),
    ) -> None:
        self.document = document
        self.defaults = defaults
        self.faulty = faulty
        self.asked: set[str] = set()
        self._rows: dict[str, list[Row]] = {}

    def sound(self, path: str) -> bool:
        """Whether the key, its table and everything inside it are valid."""
        return not self.faulty or not any(
            f == path
            or f.startswith((path + ".", path + "["))
            or path.startswith((f + ".", f + "["))
            for f in self.faulty
        )

    def has(self, table: str) -> bool:
        """Whether the table exists, valid or not; a misspelt one counts as invalid."""
        return self.document.get(table) not in (None, (), []) or table in self.faulty

    def row(self, table: str) -> Row:
        """Return a table, or the first of several."""
        return Row(self, table, 0)

    def rows(self, table: str, least: int = 0) -> list[Row]:
        """Return all rows of a table; at least so many."""
        if table not in self._rows:
            found = self.document.get(table)
            one = isinstance(found, dict) and table in EITHER
            count = len(found) if isinstance(found, LIST) else int(one)
            self._rows[table] = [Row(self, table, number) for number in range(count)]
        return self._rows[table] or [Row(self, table, number) for number in range(least)]

    @property
    def gravity(self) -> Any:
        """The scene's gravity, valid or not; None if it is not written."""
        self.asked.add("gravity")
        return self.document.get("gravity")

    @property
    def damps(self) -> bool:
        """Whether there is a damping plate."""
        return any(plate.given("distance") for plate in self.rows("plate"))
