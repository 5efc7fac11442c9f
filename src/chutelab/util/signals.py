"""Signals that tell a program to end: Ctrl-C, TERM and HUP, all raised as a KeyboardInterrupt.

So whatever cleans up after Ctrl-C cleans up after all of them. It imports next to nothing: the
command line is guarded by it before anything else is imported.
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
"""s after a signal in which further ones are passed over, for the first is being obeyed.

Later ones are raised again: the first may have been lost in code that catches everything.
"""


class Terminated(KeyboardInterrupt):
    """The program was told to end, by the signal `signum`.

    Ctrl-C too: of a plain KeyboardInterrupt that has passed through `exec`, Python remembers it to
    the end, and kills itself then although it was caught.
    """

    def __init__(self, signum: int) -> None:
        super().__init__(signum)
        self.signum = signum


_obeyed: list[tuple[int, float]] = []
"""The signals that were raised, and when, s."""

_answered: list[tuple[int, float]] = []
"""Those of them that are answered: what goes on knows of them."""


def answer() -> None:
    """Go on after a signal that was caught: `ctrl_c_waits` raises it no more."""
    _answered[:] = _obeyed


@contextmanager
def raised(*, last: bool = False) -> Iterator[None]:
    """Raise `Terminated` for each signal of `NAMES`.

    Signals that are ignored (``nohup``, jobs in the background) or have another handler are left
    alone, and so are all in a thread, which can set none. With `last` the program
    ends after this: then a signal no longer raises anything, since nothing would catch it, but ends
    the process at once with the exit code that it would have had.
    """
    usual = (signal.SIG_DFL, signal.default_int_handler)
    known = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    before = {number: now for number in known if (now := signal.getsignal(number)) in usual}
    ignored = sys.unraisablehook

    def again(about: Any) -> None:
        """Raise a signal again that came where Python passes over errors: in a finalizer, say."""
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
    """Let what happens here happen whole: a signal that comes is raised afterwards."""
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
    """Give a function that raises what a Ctrl-C would have raised before.

    So a run is interrupted where it can be, and keeps what it has. One that comes `GRACE` after the
    first is obeyed at once. In a thread, and where there is another handler, nothing changes. The
    function also raises again what `raised` has raised: work that goes on shows that some code
    which catches everything, an import say, has lost it. With `lazily` nothing waits before the
    function is called: what is over sooner needs no handler.
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
    """Return the exit code if a signal is behind an error, else None.

    Compiled code may turn a KeyboardInterrupt into an error of its own, and keep no trace of it:
    whatever fails after a signal was raised fails because of it.
    """
    if _obeyed:
        return 128 + _obeyed[0][0]
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return INTERRUPTED
        error = error.__cause__ or error.__context__
    return None
