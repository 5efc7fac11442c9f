"""Scenes, machines, arguments and tracks with mistakes, see `hostile.inputs`."""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

import chutelab
from hostile.inputs import KINDS
from hostile.worker import PATIENCE

TESTS = Path(__file__).parents[1]
MEMORY = 2 << 20
"""kB that a process may have had at its peak."""

SHARES = {
    "scenes": 0.2,
    "machines": 0.2,
    "keys": 0.3,
    "arguments": 0.2,
    "tracks": 0.15,
}
ASKED = int(os.environ.get("CHUTELAB_HOSTILE", "2000"))
"""Cases of a slow run, of which each kind has its share."""


def results(kind, seed, count, folder):
    """Run cases; a case in which the process ended is begun anew after it, and counts as wrong."""
    paths = [str(Path(chutelab.__file__).parents[1]), str(TESTS)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    found = []
    first = 0
    while first < count:
        home = folder / f"{kind}-{seed}-{first}"
        home.mkdir()
        command = [sys.executable, "-m", "hostile.worker", kind, str(seed), str(first), str(count)]
        with (home / "said").open("wb") as said:
            subprocess.run(
                command,
                cwd=home,
                env=environment,
                stdout=said,
                stderr=subprocess.STDOUT,
                check=False,
            )
        lines = (home / "said").read_text("utf-8", "replace").splitlines()
        rows = [json.loads(line) for line in lines if line.startswith('{"case"')]
        found += [row for row in rows if "code" in row]
        assert rows, "\n".join(lines)[-3000:]
        if "code" in rows[-1]:
            break
        found.append({**rows[-1], "wrong": "the process ended", "said": "\n".join(lines)[-2000:]})
        first = rows[-1]["case"] + 1
    return found


@pytest.mark.parametrize(
    ("kind", "seed", "count"),
    [
        ("all", 0, 10),
        *(pytest.param(kind, 1, round(ASKED * SHARES[kind]), marks=pytest.mark.slow)
          for kind in KINDS),
    ],
)  # fmt: skip
def test_what_is_wrong_is_refused_and_nothing_else_happens(kind, seed, count, tmp_path):
    found = results(kind, seed, count, tmp_path)
    assert len(found) == count
    wrong = [row for row in found if row["wrong"]]
    told = "\n\n".join(
        f"{row['case']} {row.get('words')}: {row['wrong']}\n{row['said']}" for row in wrong[:8]
    )
    assert not wrong, f"{len(wrong)} of {count} cases, in {tmp_path}:\n{told}"
    assert max(row["seconds"] for row in found) < PATIENCE
    # Both what may be and what may not has to occur, or the mutants are too wild or too tame.
    codes = {row["code"] for row in found}
    assert 2 in codes
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < MEMORY
