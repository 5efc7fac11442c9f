"""The command ``chutelab``, which is ``python -m chutelab`` too.

Slow imports are inside `main`, where signals are already handled.
"""

import atexit
import gc
import os
import sys
from contextlib import suppress

from chutelab.util.signals import exit_code, raised


def main() -> None:
    """Run the command line; a signal ends it without a traceback, from the first import on."""
    # Commands open no windows, so a backend that does not exist here must not stop them.
    os.environ["MPLBACKEND"] = "agg"
    # Scenes use no plugins of Pydantic; searching all installed packages for some takes 8 ms.
    os.environ["PYDANTIC_DISABLE_PLUGINS"] = "__all__"
    # A command creates mostly modules and classes, which live until the end. Collecting garbage
    # among them after every 700 objects, and at the end, takes a quarter of a short run.
    gc.set_threshold(50_000)
    atexit.register(gc.freeze)
    with raised(last=True):
        try:
            from chutelab.cli import main as program

            program()
        except BaseException as error:
            code = exit_code(error)
            if code is None:
                raise
            # Exit at once: after an interruption midway the interpreter's own shutdown may fail.
            with suppress(OSError, ValueError):
                sys.stdout.flush()
            atexit._run_exitfuncs()
            os._exit(code)


if __name__ == "__main__":
    main()
