"""The command ``chutelab``, which is ``python -m chutelab`` too.

What takes long to import is imported inside `main`, where signals are waited for.
"""

import atexit
import gc
import os
import sys
from contextlib import suppress

from chutelab.util.signals import exit_code, raised


def main() -> None:
    """Run the command line; a signal ends it without a traceback, from the first import on."""
    # Commands open no windows: a backend that does not exist here must not stop them.
    os.environ["MPLBACKEND"] = "agg"
    # Most of what a command makes are modules and their classes, which stay: to look for garbage
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
            # At once: what was interrupted midway may bring down the interpreter's own end.
            with suppress(OSError, ValueError):
                sys.stdout.flush()
            atexit._run_exitfuncs()
            os._exit(code)


if __name__ == "__main__":
    main()
