"""The whole process: what one waits for a run on the command line, imports and all."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import median
from time import perf_counter

from chutelab.workprecision.records import Record

PROCESS = "process"

COMMANDS = {
    "run": ("-m", "chutelab", "run", "perpendicular", "--json"),
    "numpy": ("-c", "import numpy"),
}
"""What this Python is started with, by the name of the row."""


def whole_process(repeats: int) -> list[Record]:
    """Measure `COMMANDS` in turn, so that a busy machine slows all of them alike.

    The first round is told apart: it may find files that are not in memory yet. Memory is not
    measured.
    """
    rounds = [{name: _clocked(name) for name in COMMANDS} for _ in range(repeats + 1)]
    records = []
    for name in COMMANDS:
        times = [one[name][0] for one in rounds]
        error, failed = rounds[0][name][1:]
        records.append(
            Record(PROCESS, name, failed=failed)
            if failed
            else Record(
                PROCESS,
                name,
                first=times[0],
                repeats=len(times) - 1,
                median=median(times[1:] or times),
                error=error,
            )
        )
    return records


def _clocked(name: str) -> tuple[float, float | None, str]:
    """Return the seconds of a process, the error it reports, and why it failed."""
    sources = str(Path(__file__).parents[2])
    path = os.pathsep.join([sources, *filter(None, [os.environ.get("PYTHONPATH")])])
    begin = perf_counter()
    done = subprocess.run(
        [sys.executable, *COMMANDS[name]],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path},
    )
    seconds = perf_counter() - begin
    if done.returncode:
        said = done.stderr.strip().splitlines()
        return seconds, None, f"exit status {done.returncode}: {said[-1] if said else 'no message'}"
    error = json.loads(done.stdout)["error"]["max"] if done.stdout else None
    return seconds, error, ""
