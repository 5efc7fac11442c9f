"""The finished rows of a sweep that is not finished: a file beside the one that it is to write.

The first line says what is swept; then come blocks of rows, each headed by where it begins and how
many rows it has. Blocks are added at the end and forced to the disk; one that was cut off is not
there.
"""

from __future__ import annotations

import hashlib
import json
import os
from time import monotonic
from typing import TYPE_CHECKING, Any, BinaryIO, Final, Self

from chutelab.versions import version_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path
    from types import TracebackType

    from chutelab.sweep.plan import Plan

FORMAT: Final = 1

INTERVAL: Final = 0.5
"""s between two times that the file is forced to the disk: what an interruption may cost."""

WORDS: Final = {
    "format": "the format of the file",
    "chutelab": "the version of chutelab",
    "scene": "the scene",
    "vary": "what --vary says",
    "samples": "--sample, --design or --seed",
    "engine": "--engine",
}
"""What a sweep can differ in, for people."""


class PartError(ValueError):
    """A file of finished rows that cannot be used; the text says what to do."""


def head_of(plan: Plan) -> dict[str, Any]:
    """Return what decides the rows of a sweep."""
    samples = None
    if plan.samples is not None:
        samples = hashlib.sha256(plan.samples.tobytes()).hexdigest()
    return {
        "format": FORMAT,
        "chutelab": version_of("chutelab"),
        "scene": json.loads(json.dumps(plan.document)),
        "vary": [[vary.key, list(vary.values)] for vary in plan.varies],
        "samples": samples,
        "engine": plan.engine,
    }


class Part:
    """The file of finished rows; use it in a ``with`` statement.

    Parameters
    ----------
    out : Path
        The file that the sweep is to write.
    plan : Plan
        What is swept.
    resume : bool
        Whether to go on with a file that is there; without, there must be none.

    Attributes
    ----------
    done : dict of int to str
        Rows that are there already, as text, by where their block begins.

    Raises
    ------
    PartError
        If the file is of another sweep, there although it should not be, or cannot be written.
    """

    def __init__(self, out: Path, plan: Plan, *, resume: bool) -> None:
        self.path = part_of(out)
        self.done: dict[int, str] = {}
        self._last, self._added = monotonic(), False
        self._file: BinaryIO
        head = head_of(plan)
        line = json.dumps(head).encode() + b"\n"
        try:
            # It may have been cut off in its first line.
            if not self.path.exists() or _begins(self.path, line):
                self._file = self.path.open("wb")
                self._file.write(line)
                self._sync()
                return
            if not resume:
                raise PartError(
                    f"{self.path} holds the finished rows of a sweep that was interrupted: go on"
                    " with --resume, or remove the file"
                )
            length = self._read(head)
            self._file = self.path.open("r+b")
            self._file.truncate(length)
            self._file.seek(length)
        except OSError as error:
            raise PartError(f"{self.path}: {error.strerror or error}") from error

    def _read(self, head: Mapping[str, Any]) -> int:
        """Read the file that is there, and return the length of what is whole."""
        data = self.path.read_bytes()
        first, newline, _ = data.partition(b"\n")
        try:
            found = json.loads(first) if newline else None
        except ValueError:
            found = None
        if not isinstance(found, dict):
            raise PartError(f"{self.path} holds no rows of a sweep: remove it, or choose --out")
        other = [words for key, words in WORDS.items() if found.get(key) != head[key]]
        if other:
            raise PartError(
                f"{self.path} is of another sweep, with a difference in {', '.join(other)}: repeat"
                " that command, or remove the file and begin anew"
            )
        length = len(first) + 1
        for begin, text, end in _blocks(data, length):
            self.done[begin] = text
            length = end
        return length

    def add(self, begin: int, count: int, text: str) -> None:
        """Append a block of rows."""
        self._added = True
        self._file.write(f"@{begin},{count}\n{text}".encode())
        if monotonic() - self._last >= INTERVAL:
            self._sync()

    @property
    def empty(self) -> bool:
        """Whether there are no rows yet."""
        return not self.done and not self._added

    def _sync(self) -> None:
        self._file.flush()
        os.fsync(self._file.fileno())
        self._last = monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._sync()
        self._file.close()
        if kind is None or self.empty:
            self.path.unlink()


def _begins(path: Path, line: bytes) -> bool:
    """Tell whether a file holds a part of a line and nothing else."""
    with path.open("rb") as file:
        data = file.read(len(line))
    return len(data) < len(line) and line.startswith(data)


def part_of(out: Path) -> Path:
    """Return where the finished rows are kept while the sweep goes on."""
    return out.with_name(f"{out.name}.part")


def _blocks(data: bytes, begin: int) -> Iterator[tuple[int, str, int]]:
    """Yield where a block of rows begins, its text, and where it ends in the file."""
    lines = data[begin:].split(b"\n")[:-1]
    at = 0
    while at < len(lines):
        try:
            first, count = map(int, lines[at].removeprefix(b"@").split(b","))
            rows = lines[at + 1 : at + 1 + count]
            text = b"".join(row + b"\n" for row in rows).decode()
        except ValueError:
            return
        if not lines[at].startswith(b"@") or len(rows) < count:
            return
        begin += len(lines[at]) + 1 + sum(len(row) + 1 for row in rows)
        at += 1 + count
        yield first, text, begin
