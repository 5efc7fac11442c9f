"""Run cells of a notebook in a separate process that is watched, limited and ended.

Three processes: the caller of `run`; the watcher, `_watch`; and the kernel, `_work`, which runs the
cells in a session and a folder of its own. The watcher ends the kernel and its descendants when the
kernel has finished, takes too much, or `run` is gone. A cell that signals its parent signals the
watcher, which ignores signals. What the cells print is discarded. The kernel reports the checked
answers through a pipe, one JSON object per line; students' code can write there, too, so everything
is checked.

This protects the computer against accidents and clumsy tricks, not against attackers: the cells run
with all rights of the caller.
"""

from __future__ import annotations

import asyncio
import ctypes
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from secrets import token_hex
from threading import Event, Lock, Thread
from time import monotonic, sleep
from typing import IO, Any, Final

MEMORY: Final = 1536 << 20
"""Bytes that a notebook may take, with all processes it starts; the lessons need 300 MB."""

PROCESSES: Final = 64
"""Processes that a notebook may have, itself included."""

LARGEST_FILE: Final = 256 << 20
"""Bytes of a file that a notebook may write."""

START: Final = 60.0
"""s for the kernel to start: its imports on a slow disk."""

LAST_WORD: Final = 1.0
"""s for the kernel to hand over the answers after its time is up."""

PATIENCE: Final = 10.0
"""s for the watcher to end everything and remove the folder; it takes a hundredth of it."""

OFTEN: Final = 0.5
"""s between two reports of the kernel while a cell runs."""

PERIOD: Final = 0.1
"""s between two checks of the watcher."""

LONGEST_LINE: Final = 256 << 10
"""Most bytes of one report of the kernel: the answers of 64 tasks are 30 kB."""

MOST_SAID: Final = 8 << 20
"""Most bytes of all reports of the kernel."""

LONGEST: Final = 200
"""Most characters of a reported error."""

PACKAGES: Final = Path(__file__).parents[2]
"""The folder of this chutelab, for the kernel to find it, too."""

NAME: Final = "chutelab.classroom.kernel"
"""Name of this module, also when it is run as a program."""

ENDS: Final = {
    0: "",
    (TOO_MUCH := 3): f"it took more than {MEMORY >> 20} MB of memory",
    (TOO_MANY := 4): f"it started more than {PROCESSES} processes",
    (LEFT := 5): "some processes that it started could not be ended",
    (SIGNALLED := 6): "it sent its parent process a signal",
}
"""Exit codes of the watcher, and their meaning for the notebook."""

_POSIX: Final = os.name == "posix"
_PR_SET_PDEATHSIG: Final = 1
_PR_SET_CHILD_SUBREAPER: Final = 36


class ForgedError(ValueError):
    """A report from the kernel was not written by chutelab; the text says why."""


@dataclass(frozen=True)
class Ran:
    """Result of running a notebook."""

    # what `report` in `classroom.exercises` gave; not checked, as students' code ran there
    tasks: object
    trouble: str  # what went wrong (the first error), or empty


def run(cells: Sequence[str | None], time_limit: float) -> Ran:
    """Run code cells in order; after an error in one the others still run.

    None stands for a cell whose source is not text. `time_limit` is in s for all cells together,
    without the kernel's start. Raises a `ForgedError` if the kernel reports what chutelab would
    not; an `OSError` if no process can be started.
    """
    paths = [str(PACKAGES), *filter(None, [os.environ.get("PYTHONPATH")])]
    # Each thread of linear algebra takes memory, and there are as many as cores.
    alone = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    watcher = subprocess.Popen(
        [sys.executable, "-P", "-m", NAME, "watch"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **alone, "PYTHONPATH": os.pathsep.join(paths)},
        start_new_session=True,
    )
    assert watcher.stdin is not None
    assert watcher.stdout is not None
    said: SimpleQueue[bytes | None] = SimpleQueue()
    listener = Thread(target=_listen, args=(watcher.stdout.fileno(), said), daemon=True)
    listener.start()
    heard = _Heard(time_limit)
    try:
        with suppress(BrokenPipeError):
            watcher.stdin.write(json.dumps([list(cells), time_limit]).encode() + b"\n")
            watcher.stdin.flush()
        heard.follow(said)
    finally:
        ended = _end(watcher, heard.folder)
        listener.join(PERIOD)
        # It stays open if an escaped process still holds the other end.
        if not listener.is_alive():
            watcher.stdout.close()
    troubles = [heard.trouble, ENDS.get(ended, "")]
    if heard.folder and Path(heard.folder).exists():
        troubles.append(f"its folder {heard.folder} could not be removed")
    return Ran(heard.tasks, "; ".join(filter(None, troubles)))


def _listen(pipe: int, said: SimpleQueue[bytes | None]) -> None:
    """Pass on what arrives line by line, then None; an empty line means that there was too much."""
    rest, arrived = b"", 0
    # No file object: it could not be closed while a thread waits in it.
    while chunk := os.read(pipe, 1 << 16):
        arrived += len(chunk)
        *lines, rest = (rest + chunk).split(b"\n")
        for line in lines:
            said.put(line)
        if len(rest) > LONGEST_LINE or arrived > MOST_SAID:
            said.put(b"")
            break
    said.put(None)


class _Heard:
    """Reports of one kernel so far."""

    def __init__(self, time_limit: float) -> None:
        self.time_limit = time_limit
        self.folder = ""
        self.tasks: object = []
        self.trouble = ""

    def follow(self, said: SimpleQueue[bytes | None]) -> None:
        """Listen to reports, until the end or until the time is up."""
        until = monotonic() + START
        cell = -1  # -1 before the kernel has started, 0 before the first cell
        while True:
            try:
                line = said.get(timeout=max(0.0, until - monotonic()))
            except Empty:
                line = b'{"end": false}'
            if line is None:
                where = f" in code cell {cell}" if cell > 0 else ""
                died = f"the kernel died{where}" if cell >= 0 else "the kernel did not start"
                self.trouble = self.trouble or died
                return
            message: object = None
            with suppress(ValueError, RecursionError):
                message = json.loads(line)
            match message:
                case {"folder": str(folder)} if not self.folder:
                    self.folder = folder
                case {"cell": 0} if cell < 0:
                    cell = 0
                    until = monotonic() + self.time_limit + LAST_WORD
                case {"cell": int(number)} if number > 0:
                    cell = number
                case {"error": str(error)}:
                    self.trouble = self.trouble or f"code cell {cell}: {error[:LONGEST]}"
                case {"tasks": tasks}:
                    self.tasks = tasks
                case {"end": True}:
                    return
                case {"end": False} if cell < 0:
                    self.trouble = f"the kernel did not start within {START:g} s"
                    return
                case {"end": False}:
                    self.trouble = f"stopped after {self.time_limit:g} s, in code cell {cell}"
                    return
                case _:
                    raise ForgedError("its kernel said what no chutelab says")


def _end(watcher: subprocess.Popen[bytes], folder: str) -> int:
    """Have the watcher end the kernel; return its exit code."""
    assert watcher.stdin is not None
    with suppress(BrokenPipeError):
        watcher.stdin.close()
    if _POSIX:
        # The kernel may have stopped it.
        watcher.send_signal(signal.SIGCONT)
    with suppress(subprocess.TimeoutExpired):
        watcher.wait(PATIENCE)
    if watcher.returncode not in ENDS:
        watcher.kill()
        if folder:
            import psutil

            # Its processes have the folder in their environment.
            for process in psutil.process_iter():
                with suppress(psutil.Error):
                    if process.environ().get("IPYTHONDIR") == folder:
                        process.kill()
            _remove(folder)
    return watcher.wait()


def _remove(folder: str) -> None:
    """Remove a folder of any depth: inner folders move up, and go when they hold no other."""
    top = Path(folder)
    with suppress(OSError):
        top.chmod(0o700)
        while found := _folders(top):
            for one in found:
                one.chmod(0o700)
                for deeper in _folders(one):
                    deeper.chmod(0o700)
                    deeper.rename(top / token_hex(16))
                shutil.rmtree(one)
        shutil.rmtree(top)


def _folders(folder: Path) -> list[Path]:
    return [one for one in folder.iterdir() if one.is_dir() and not one.is_symlink()]


# The watcher


def _watch() -> None:
    """Run the kernel until it has finished, takes too much, or standard input ends."""
    import psutil

    asked = sys.stdin.buffer.readline()
    if not asked.endswith(b"\n"):
        return
    if _POSIX:
        # Orphans that left the kernel's session become children of this process.
        _prctl(_PR_SET_CHILD_SUBREAPER, 1)
        signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    code = 0
    gone = Event()

    def follow() -> None:
        while os.read(0, 1):
            pass
        gone.set()

    Thread(target=follow, daemon=True).start()
    folder = tempfile.mkdtemp(prefix="chutelab-grade-")
    try:
        _say(sys.stdout.buffer, folder=folder)
        kernel = subprocess.Popen(
            [sys.executable, "-m", NAME, "work"],
            cwd=folder,
            stdin=subprocess.PIPE,
            # The caller's start-up files and history are left out.
            env={**os.environ, "IPYTHONDIR": folder},
            start_new_session=True,
        )
        assert kernel.stdin is not None
        with suppress(BrokenPipeError):
            kernel.stdin.write(asked)
            kernel.stdin.close()
        while kernel.poll() is None and not gone.wait(PERIOD):
            started = _alive()
            if len(started) > PROCESSES:
                code = TOO_MANY
                break
            held = 0
            for one in started:
                with suppress(psutil.Error):
                    held += one.memory_info().rss
            if held > MEMORY:
                code = TOO_MUCH
                break
        if _POSIX:
            # All at once, or a process that forks faster than this kills would survive.
            with suppress(ProcessLookupError):
                os.killpg(kernel.pid, signal.SIGKILL)
        until = monotonic() + PATIENCE / 2
        while _any_left():
            for process in _alive():
                with suppress(psutil.Error):
                    process.kill()
            if monotonic() > until:
                code = LEFT
                break
            sleep(PERIOD / 10)
        if _POSIX and code == 0 and signal.sigpending() - {signal.SIGCHLD, signal.SIGCONT}:
            code = SIGNALLED
    finally:
        _remove(folder)
        # Not by the interpreter's normal end, since a thread still reads standard input.
        os._exit(code)


def _alive() -> list[Any]:
    """Return all descendants of this process that are not over."""
    import psutil

    alive = []
    for process in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            if process.status() != psutil.STATUS_ZOMBIE:
                alive.append(process)
    return alive


def _any_left() -> bool:
    """Tell whether a descendant of this process is left; children that are over are reaped.

    A list of processes may miss one whose parent ends while the list is made. But where orphans
    become children of this process, it has a child as long as there is any descendant.
    """
    if _POSIX:
        try:
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        except ChildProcessError:
            pass
        else:
            return True
    return sys.platform != "linux" and bool(_alive())


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def _say(stream: IO[bytes], **message: object) -> None:
    stream.write(json.dumps(message).encode() + b"\n")
    stream.flush()


# The kernel


def _work() -> None:
    """Run the cells that standard input holds."""
    if _POSIX:
        import resource

        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        signal.pthread_sigmask(signal.SIG_SETMASK, [])
        for what, most in (
            (resource.RLIMIT_CORE, 0),
            (resource.RLIMIT_FSIZE, LARGEST_FILE),
            # Not the address space: WebAssembly reserves much more than it uses.
            (resource.RLIMIT_DATA, MEMORY),
        ):
            with suppress(ValueError, OSError):
                resource.setrlimit(what, (most, most))
    cells, time_limit = json.loads(sys.stdin.buffer.read())
    pipe = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    from IPython.core.interactiveshell import InteractiveShell
    from traitlets.config import Config

    from chutelab.classroom import exercises

    class Shell(InteractiveShell):
        def enable_gui(self, gui: str | None = None) -> None:
            """Do nothing: there are no windows."""

        def ask_exit(self) -> None:
            """Do nothing: the next cell runs."""

    config = Config()
    config.HistoryManager.enabled = False
    # Tracebacks take time and are not read.
    config.InteractiveShell.xmode = "Minimal"
    shell = Shell.instance(config=config)
    turn = Lock()
    last: list[object] = []

    def tell(**message: object) -> None:
        with turn:
            _say(pipe, **message)

    def hand_over() -> None:
        # Cells can change this module; its results are judged again elsewhere.
        with suppress(Exception), turn:
            found = exercises.report()
            if last != found:
                _say(pipe, tasks=found)
                last[:] = found

    def watch_time() -> None:
        # Report now and then as well: a cell may end the kernel, or let no other thread run.
        until = monotonic() + time_limit
        while (left := until - monotonic()) > 0.0:
            sleep(min(left, OFTEN))
            hand_over()
        tell(end=False)

    async def go() -> None:
        for number, source in enumerate(cells, start=1):
            tell(cell=number)
            try:
                error: BaseException | None = TypeError("its source is no text")
                if source is not None:
                    code = shell.transform_cell(source)  # type: ignore[no-untyped-call]
                    ran = await shell.run_cell_async(source, transformed_cell=code)
                    error = ran.error_before_exec or ran.error_in_exec
            except BaseException as raised:  # whatever it is, the next cell runs
                error = raised
            if error is not None:
                name = type(error).__name__
                with suppress(BaseException):  # its text may fail, too
                    name = f"{name}: {error}".removesuffix(": ")[:LONGEST]
                tell(error=name)
            hand_over()

    tell(cell=0)
    Thread(target=watch_time, daemon=True).start()
    # In a loop that runs, as in Jupyter.
    asyncio.run(go())
    hand_over()
    tell(end=True)
    # Do not wait for threads or exit handlers.
    os._exit(0)


if __name__ == "__main__":
    {"watch": _watch, "work": _work}[sys.argv[1]]()
