"""Processor time of some fifteen cases, this checkout against an earlier commit, interleaved.

    OMP_NUM_THREADS=1 python benchmarks/against.py COMMIT [--repeats N] [CASE|SCENE...]

A shipped scene is a case of its own. The commit is unpacked into a temporary folder and imported
from there, by a process of its own, as this checkout is by another one. Both run a case in turn, as
often as it takes to fill `SLICE`, so that whatever else the computer does slows both. The ratio is
that of the medians, now over then, beside the quartiles of the ratios of single turns; "bits" tells
whether the recordings are the same to the last bit. Exit code 1 if a ratio is above `WORST`.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from contextlib import ExitStack, redirect_stdout
from pathlib import Path
from statistics import median, quantiles
from time import process_time

ROOT = Path(__file__).resolve().parent.parent
SLICE = 0.5
"""s of processor time that a turn takes at least."""
WORST = 1.1

# Scene and settings of a run.
RUNS = {
    "lone, exact": ["perpendicular", "run.until=settled"],
    "lone, slip": ["slip"],
    "lone, low speed": ["low-speed"],
    "lone, hollow": ["spoon"],
    "lone, contact": ["perpendicular", "run.until=settled", "run.engine=contact"],
    "lone, pymunk": ["perpendicular", "run.engine=pymunk"],
    "10,000 apart": ["stream-independent"],
    "stream": ["stream", "run.until=settled"],
    "hopper": ["hopper", "stream.count=200"],
    "heap": ["heap", "stream.count=100"],
    "pegs": ["galton", "stream.count=150"],
    "mixture": ["mixture", "run.until=2"],
    "cradle, pymunk": ["cradle", "run.until=2"],
    "boxes, pymunk": ["dominoes", "run.until=1"],
}
# Any other command, the words after `chutelab`.
COMMANDS = {
    "sweep": "sweep perpendicular --vary plate.angle_deg=-20:20:3000 -q",
    "summary": "run perpendicular --json",
    "pictures": "run perpendicular --out out --only png,gif -q",
}


def worked(source: str) -> None:
    """Answer lines ``[case, times]`` with seconds and the recording's hash, until input ends."""
    # Ahead of what an editable install may have put there.
    sys.path.insert(0, source)
    import chutelab
    from chutelab.cli import main

    for line in sys.stdin:
        case, times = json.loads(line)
        bits = ""
        try:
            if case not in COMMANDS:
                name, *settings = RUNS.get(case, [case])
                scene = chutelab.load(name, settings)
                begin = process_time()
                for _ in range(times):
                    recording = chutelab.simulate(scene)
                found = recording.knots.tobytes() + recording.events.tobytes()
                bits = hashlib.sha256(found).hexdigest()
            else:
                begin = process_time()
                for _ in range(times):
                    with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere):
                        main(COMMANDS[case].split(), standalone_mode=False)
            answer = [process_time() - begin, bits]
        except Exception as error:
            answer = [None, f"{type(error).__name__}: {error}"]
        print(json.dumps(answer), flush=True)


class Version:
    """A checkout, and the process that runs cases of it."""

    def __init__(self, checkout: Path, folder: Path) -> None:
        folder.mkdir()
        self.process = subprocess.Popen(
            [sys.executable, Path(__file__), "--work", checkout / "src"], cwd=folder, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def turn(self, case: str, times: int) -> tuple[float, str]:
        """Return the processor time of a case, s, and the hash; a RuntimeError if it fails."""
        print(json.dumps([case, times]), file=self.process.stdin, flush=True)
        seconds, bits = json.loads(self.process.stdout.readline())
        if seconds is None:
            raise RuntimeError(bits)
        return seconds, bits


def compared(case: str, then: Version, now: Version, repeats: int) -> float:
    """Run a case in both in turn, print what came of it, and return the ratio; NaN if it fails."""
    try:
        warm = [max(version.turn(case, 1)[0], version.turn(case, 1)[0]) for version in (then, now)]
        times = max(1, round(SLICE / max(*warm, 1e-6)))
        pairs = []
        for turn in range(repeats):
            order = (then, now) if turn % 2 else (now, then)
            found = {version: version.turn(case, times) for version in order}
            pairs.append((found[then], found[now]))
    except RuntimeError as error:
        print(f"{case:18} {error}")
        return float("nan")
    before, after = (median(pair[k][0] for pair in pairs) / times for k in (0, 1))
    low, _, high = quantiles((b[0] / a[0] for a, b in pairs), n=4)
    same = "" if case in COMMANDS else "same" if pairs[0][0][1] == pairs[0][1][1] else "other"
    ratio = after / before
    print(f"{case:18} {before:9.4f} {after:9.4f} {ratio:7.2f} {low:6.2f} ..{high:5.2f}  {same}")
    return ratio


def main() -> int:
    """Compare, and print a line for each case."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("commit")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join([*RUNS, *COMMANDS]))
    parser.add_argument("--repeats", type=int, default=7)
    asked = parser.parse_intermixed_args()
    archive = ["git", "-C", ROOT, "archive", asked.commit, "src", "scenes", "pyproject.toml"]
    with tempfile.TemporaryDirectory(prefix="chutelab-against-") as aside, ExitStack() as stack:
        folder = Path(aside)
        packed = subprocess.run(archive, check=True, capture_output=True).stdout
        (folder / "checkout").mkdir()
        subprocess.run(["tar", "-x", "-C", folder / "checkout"], input=packed, check=True)
        then, now = Version(folder / "checkout", folder / "then"), Version(ROOT, folder / "now")
        for version in (then, now):
            stack.callback(version.process.wait)
            stack.callback(version.process.stdin.close)
        print(f"{'':18} {'then, s':>9} {'now, s':>9} {'ratio':>7}   quartiles   bits")
        cases = asked.cases or [*RUNS, *COMMANDS]
        ratios = [compared(case, then, now, asked.repeats) for case in cases]
    return int(any(not ratio <= WORST for ratio in ratios))


if __name__ == "__main__":
    worked(sys.argv[2]) if sys.argv[1:2] == ["--work"] else sys.exit(main())
