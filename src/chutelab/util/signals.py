"""Signals that tell a program to end: Ctrl-C, TERM and HUP, all raised as a KeyboardInterrupt.

So code that cleans up after Ctrl-C cleans up after all of them. It imports almost nothing, as the
command line uses it before any other import.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Timer
from time import monotonic
from typing import Any

INTERRUPTED = 128 + signal.SIGINT
"""Exit code, as shells have it."""

NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
"""HUP comes when a terminal closes; BREAK is what Windows sends then, and for Ctrl-Break."""

GRACE = 3.0
"""s after a signal during which further signals are ignored, as the first is being handled.

After that a signal is raised again, since code that catches everything may have lost the first.
"""


class Terminated(KeyboardInterrupt):
    """The program was told to end, by the signal `signum`.

    Also for Ctrl-C: if a plain KeyboardInterrupt has passed through `exec`, Python kills itself at
    the end although it was caught.
    """

    def __init__(self, signum: int) -> None:
        super().__init__(signum)
        self.signum = signum


_obeyed: list[tuple[int, float]] = []
"""The signals that were raised, and when, s."""

_answered: list[tuple[int, float]] = []
"""Signals that the running code has caught and handled."""


def answer() -> None:
    """Mark the raised signals as handled: `ctrl_c_waits` does not raise them again."""
    _answered[:] = _obeyed


@contextmanager
def raised(*, last: bool = False) -> Iterator[None]:
    """Raise `Terminated` for each signal of `NAMES`.

    Signals that are ignored (``nohup``, jobs in the background) or have another handler are not
    changed; nor is any in a thread, which cannot set handlers. With `last` the program ends after
    this block. From then on a signal ends the process at once, with the exit code that it would
    have had, since no code would catch an exception.
    """
    usual = (signal.SIG_DFL, signal.default_int_handler)
    known = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {number: now for number in known if (now := signal.getsignal(number)) in usual}
    ignored = sys.unraisablehook

    def again(about: Any) -> None:
        """Raise again a signal that came where Python ignores errors, such as in a finalizer."""
        if not isinstance(about.exc_value, Terminated):
            ignored(about)
            return
        signum, now = about.exc_value.signum, monotonic()
        _obeyed[-1:] = [(signum, now - GRACE)]
        later = Timer(0.01, signal.raise_signal, [signum])
        later.daemon = True
        later.start()

    if before:
        _obeyed.clear()
        _answered.clear()
        sys.unraisablehook = again
    try:
        for number in before:
            with suppress(ValueError):
                signal.signal(number, _obey)
        yield
    finally:
        sys.unraisablehook = ignored
        for number, handler in before.items():
            with suppress(ValueError):
                signal.signal(number, handler)
                if last:
                    signal.signal(number, lambda n, _: os._exit(exit_code(None) or 128 + n))


_kept: list[int] | None = None
"""Signals that came during `held`; None outside of it."""


@contextmanager
def held() -> Iterator[None]:
    """Run a block without interruption: a signal that comes is raised afterwards."""
    global _kept
    kept: list[int] = []
    _kept = kept
    try:
        yield
    finally:
        _kept = None
    if kept:
        _obey(kept[0], None)


@contextmanager
def ctrl_c_waits(*, lazily: bool = False) -> Iterator[Callable[[], None]]:
    """Give a function that raises a delayed Ctrl-C.

    So a run is interrupted at a suitable point, and keeps its results. A signal that comes `GRACE`
    after the first is raised at once. In a thread, and with another handler, nothing changes. If
    `raised` has raised a signal and work still goes on, some code that catches everything (such as
    an import) has lost it; the function then raises it again. With `lazily` signals are delayed
    only from the first call of the function on, as short work needs no handler.
    """
    came: list[float] = []
    before: Any = None
    told = looked = changed = False

    def look() -> None:
        nonlocal told
        if not looked:
            wait()
        if came and callable(before):
            came.clear()
            told = True
            before(signal.SIGINT, None)
        if not told and _obeyed != _answered and _obey in (before, signal.getsignal(_obeyed[0][0])):
            told = True
            raise Terminated(_obeyed[0][0])

    def note(signum: int, frame: Any) -> None:
        if came and callable(before) and monotonic() - came[0] > GRACE:
            before(signum, frame)
        came.append(monotonic())

    def wait() -> None:
        nonlocal before, looked, changed
        before, looked = signal.getsignal(signal.SIGINT), True
        if before in (signal.default_int_handler, _obey):
            with suppress(ValueError):
                signal.signal(signal.SIGINT, note)
                changed = True

    if not lazily:
        wait()
    try:
        yield look
    finally:
        if changed:
            signal.signal(signal.SIGINT, before)
    if came:
        look()


def _obey(signum: int, _frame: object) -> None:
    if _kept is not None:
        _kept.append(signum)
        return
    now = monotonic()
    if _obeyed and now - _obeyed[-1][1] < GRACE:
        return
    _obeyed.append((signum, now))
    raise Terminated(signum)


def exit_code(error: BaseException | None) -> int | None:
    """Return the exit code if a signal caused an error, else None.

    Compiled code may turn a KeyboardInterrupt into another error without a trace of it, so any
    failure after a signal was raised counts as caused by it.
    """
    if _obeyed:
        return 128 + _obeyed[0][0]
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return INTERRUPTED
        error = error.__cause__ or error.__context__
    return None
