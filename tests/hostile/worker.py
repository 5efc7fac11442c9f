"""Runs cases in a process of its own, and prints what became of each: a line of JSON.

    python -m hostile.worker KIND SEED FIRST LAST

KIND is one of `inputs.KINDS`, or "all" for cases of each in turn.
It works in a folder that it makes in the current one. A case that hangs ends the process, with what
it was doing on standard error; the line before it says which one it was.
"""

import faulthandler
import json
import os
import random
import shutil
import sys
import warnings
from pathlib import Path
from time import perf_counter

from click.testing import CliRunner

from chutelab.cli import main
from hostile import inputs

PATIENCE = 20.0
"""s that a case may take."""

PROMISED = (
    "got stuck", "was not reached", "no solution", "outside the tolerance", "broken",
    "no browser could be opened", "LAW BROKEN",
)  # fmt: skip
"""What an exit code of 1 says, where help promises it."""


def fault(code, said, left):
    """Return what is wrong with what became of a case; "" if nothing is."""
    if "Traceback" in said or "please report" in said:
        return "a failure of ours"
    if code not in (0, 2) and not (code == 1 and any(text in said for text in PROMISED)):
        return f"exit code {code}"
    if code and not said.strip():
        return "no message"
    if "\x1b" in said or "\x07" in said:
        return "control characters"
    if left:
        return f"left over: {', '.join(left)}"
    return ""


def outcome(kind, seed, number):
    """Run one case in a new folder, which becomes the current one; say what became of it."""
    if kind == "all":
        kind = list(inputs.KINDS)[number % len(inputs.KINDS)]
    words = inputs.KINDS[kind](random.Random(f"{kind} {seed} {number}"))
    began = perf_counter()
    faulthandler.dump_traceback_later(PATIENCE, exit=True)
    found = CliRunner().invoke(main, words)
    faulthandler.cancel_dump_traceback_later()
    error = found.exception
    said = found.output
    if error is not None and not isinstance(error, SystemExit):
        said += f"Traceback: {type(error).__name__}: {error}"
    left = [path.name for path in Path().rglob(".*")]
    wrong = fault(found.exit_code, said, left)
    return {
        "words": words, "code": found.exit_code, "wrong": wrong, "said": said[-1000:],
        "seconds": perf_counter() - began,
    }  # fmt: skip


def run(kind, seed, first, last):
    """Run the cases from `first` to `last`, `last` not included."""
    warnings.simplefilter("error")
    home = Path.cwd()
    here = home / "work" / "case"
    for number in range(first, last):
        here.mkdir(parents=True)
        os.chdir(here)
        if number == first:
            inputs.begin()
        print(json.dumps({"case": number}), flush=True)  # noqa: T201
        found = outcome(kind, seed, number)
        print(json.dumps({"case": number, **found}), flush=True)  # noqa: T201
        os.chdir(home)
        if not found["wrong"]:
            shutil.rmtree(here)
        else:
            here.rename(home / f"wrong-{number}")


if __name__ == "__main__":
    run(sys.argv[1], *map(int, sys.argv[2:5]))
