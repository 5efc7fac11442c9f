"""The command ``chutelab``, which is ``python -m chutelab`` too.

What takes long to import is imported inside `main`, where signals are waited for.
"""

import os
import sys

from chutelab.util.signals import exit_code, raised


def main() -> None:
    """Run the command line; a signal ends it without a traceback, from the first import on."""
    # Commands open no windows: a backend that does not exist here must not stop them.
    os.environ["MPLBACKEND"] = "agg"
    with raised(last=True):
        try:
            from chutelab.cli import main as program

            program()
        except BaseException as error:
            # What `program` raises is a SystemExit, with the code that it should be.
            code = None if isinstance(error, SystemExit) else exit_code(error)
            if code is None:
                raise
            sys.exit(code)


if __name__ == "__main__":
    main()
