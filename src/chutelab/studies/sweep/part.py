"""The file of finished rows, kept beside a sweep's file until all rows are finished.

It is locked while the sweep runs, which distinguishes a running sweep from an interrupted one. It
has lines of JSON. The first one describes the sweep and the process that writes. Each other one has
the first number of a block of rows, the rows as text, and the SHA-256 of all lines up to there, so
that a line that is changed, doubled, moved or missing is found. It does not protect against forged
rows with new hashes.

SQLite would lock and sync as well. But it could not name the changed line or the process that still
writes, leaves a journal beside the file when it is killed, and would need the hashes, too.
"""

from __future__ import annotations

import csv
import hashlib
import json
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from pathlib import Path
from time import monotonic
from typing import Any, BinaryIO, Final

import numpy as np

from chutelab.scene import to_dict
from chutelab.studies.sweep.plan import Plan
from chutelab.studies.sweep.rows import Columns, columns_of, synced
from chutelab.util.errors import InputError
from chutelab.util.files import csv_columns, version_of, writing

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

FORMAT: Final = 5
"""Of the file."""

WORDS: Final = {
    "format": "the format of the file",
    "chutelab": "the version of chutelab",
    "scene": "the scene",
    "vary": "what --vary says",
    "samples": "--sample, --design or --seed",
    "engine": "--engine",
    "repeat": "--repeat",
}
"""Properties in which sweeps can differ, in words."""

LONGEST: Final = 2**26
"""Bytes of a line: twice those of the largest block, all of whose rows have a long reason."""

INTERVAL: Final = 0.5
"""Least time between two fsyncs, s: an fsync takes milliseconds, as may a block."""

BEYOND: Final = 2**31 - 2
"""Byte that is locked on Windows, beyond the file's end: a locked byte cannot be read."""


def part_of(out: Path) -> Path:
    """Return where the finished rows are kept while the sweep goes on."""
    return out.with_name(f"{out.name}.part")


@contextmanager
def unfinished(out: Path, plan: Plan, *, resume: bool) -> Iterator[Part]:
    """Keep the finished rows of a sweep until all are; with `resume`, from those that are there.

    Raises an `InputError` if the file belongs to another sweep, was changed, exists without
    `resume`, belongs to a running sweep, or cannot be written.
    """
    part, complete = Part(part_of(out), plan), False
    try:
        with writing(part.path):
            part.take_up(resume=resume)
        yield part
        complete = True
    finally:
        part.close(complete=complete)


class Part:
    """The file, open and locked."""

    def __init__(self, path: Path, plan: Plan) -> None:
        # The finished rows as text and as columns, by the numbers that their blocks begin with.
        self.done: dict[int, tuple[str, Columns]] = {}
        self.path, self._plan = path, plan
        self._chain = hashlib.sha256()
        self._synced = -INTERVAL
        self._ours = False  # not what an earlier sweep or another program left
        self._file = _locked(path)

    def take_up(self, *, resume: bool) -> None:
        """Read the existing rows, and prepare to add to them."""
        samples = self._plan.samples
        head = {
            "format": FORMAT,
            "chutelab": version_of("chutelab"),
            "scene": to_dict(self._plan.scene),
            "vary": [[vary.key, vary.values] for vary in self._plan.varies],
            "samples": None if samples is None else hashlib.sha256(samples.tobytes()).hexdigest(),
            "engine": self._plan.engine,
            "repeat": self._plan.repeat,
        }
        start = json.dumps(head).encode()[:-1]
        # Of equal length for every process, since a resumed sweep writes over it.
        mine = start + b', "process": %10d}\n' % os.getpid()
        self._chain.update(start)
        first = self._file.readline(LONGEST)
        found = _object(first)
        # It may have been cut off in its first line, and then has no rows.
        new = not first.endswith(b"\n") and (mine.startswith(first) or first.startswith(start))
        self._ours = new
        told = json.loads(mine)
        other = ", ".join(words for key, words in WORDS.items() if found.get(key) != told[key])
        faults = (
            (
                not resume,
                " holds the finished rows of a sweep that was interrupted: go on with --resume, or"
                " remove the file",
            ),
            (not found, " holds no rows of a sweep: remove it, or choose --out"),
            (
                other,
                f" is of another sweep, with a difference in {other}: repeat that command, or"
                " remove the file and begin anew",
            ),
            (
                len(first) != len(mine) or not first.startswith(start),
                ", line 1: not as it was written: remove the file",
            ),
        )
        wrong = "" if new else next((said for bad, said in faults if bad), "")
        if wrong:
            raise InputError(f"{self.path}{wrong}")
        self._file.seek(0)
        self._file.write(mine)
        self._file.flush()
        length = len(mine) + (0 if new else self._read())
        self._file.truncate(length)
        self._file.seek(length)
        synced(self.path)
        self._ours = True

    def _read(self) -> int:
        """Read the finished blocks, and return how many bytes they take."""
        length = 0
        for number in count(2):
            line = self._file.readline(LONGEST)
            # The last one may have been cut off.
            if not line.endswith(b"\n") and len(line) < LONGEST:
                break
            sound, plan = False, self._plan
            with suppress(ValueError, TypeError, RecursionError, csv.Error):
                begin, text, _ = json.loads(line)
                genuine = line == self._line(begin, text) and begin not in self.done
                columns = columns_of(plan.columns, text)
                given = np.stack([columns[key] for key in plan.keys], axis=1)
                planned = plan.block(begin, begin + plan.begins.step).values
                sound = genuine and begin in plan.begins and np.array_equal(given, planned)
            if not sound:
                raise InputError(
                    f"{self.path}, line {number}: not as it was written: rows have been changed,"
                    " doubled, moved or removed. Remove this line and all after it and go on with"
                    " --resume, which simulates them again; or remove the file and begin anew"
                )
            self.done[begin] = text, columns
            length += len(line)
        return length

    def add(self, begin: int, columns: Columns) -> None:
        """Add a finished block."""
        text = csv_columns(columns.values())
        self._file.write(self._line(begin, text))
        self._file.flush()
        self.done[begin] = text, columns
        if monotonic() - self._synced >= INTERVAL:
            self._sync()

    def close(self, *, complete: bool) -> None:
        """Close the file and unlock it; remove it if the sweep is complete, or it has no rows."""
        remove = complete or (self._ours and not self.done)
        with suppress(OSError):  # Errors in writing were reported before.
            if not remove:
                self._sync()
            elif sys.platform != "win32":  # Before it is unlocked; Windows removes no open file.
                self.path.unlink()
        with suppress(OSError):
            self._file.close()
        if remove and sys.platform == "win32":
            self.path.unlink()

    def _sync(self) -> None:
        self._file.flush()
        os.fsync(self._file.fileno())
        self._synced = monotonic()

    def _line(self, begin: int, text: str) -> bytes:
        """Return the next line of the file."""
        body = json.dumps([begin, text]).encode()[:-1]
        self._chain.update(body)
        return body + b', "%s"]\n' % self._chain.hexdigest().encode()


def _locked(path: Path) -> BinaryIO:
    """Open the file, made if there is none, and lock it; refuse one that is locked."""
    while True:
        with ExitStack() as stack:
            with writing(path):
                if path.exists() and not path.is_file():
                    raise InputError(f"{path} is no file of finished rows: remove it")
                number = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666)
            file = stack.enter_context(os.fdopen(number, "r+b"))
            try:
                if sys.platform == "win32":
                    file.seek(BEYOND)
                    msvcrt.locking(number, msvcrt.LK_NBLCK, 1)
                else:
                    fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except (BlockingIOError, PermissionError):
                file.seek(0)
                found = _object(file.readline(LONGEST)).get("process")
                process = f" (process {found})" if isinstance(found, int) else ""
                raise InputError(
                    f"{path}: the sweep that writes it is still running{process}: wait for it, end"
                    " it, or choose another --out"
                ) from None
            except OSError:
                pass  # There are file systems without locks.
            file.seek(0)
            # Its owner may have removed it just now; then make it again.
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(number), path.stat()):
                    stack.pop_all()
                    return file


def _object(line: bytes) -> dict[str, Any]:
    """Return the JSON object of a line, an empty one if it is no JSON object."""
    try:
        found = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
