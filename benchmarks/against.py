"""Processor time of some twenty cases, this checkout against an earlier commit, interleaved.

    OMP_NUM_THREADS=1 python benchmarks/against.py COMMIT [--repeats N] [CASE|SCENE...]

Run it before a release, against the last one. A shipped scene is a case of its own. The commit is
unpacked into a temporary folder and imported from there, by a process of its own, as this checkout
is by another one; both take a scene as the commit has it. Both run a case in turn, as often as it
takes to fill `SLICE`, so that whatever else the computer does slows both. The ratio is that of the
medians, now over then, beside the quartiles of the ratios of single turns; "bits" tells whether the
recordings are the same to the last bit. What the commit cannot do has its time now alone. Cases
that are slower are listed at the end. Exit code 1 if a ratio is above `WORST`, or a case fails now.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import resource
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
SLOWER, WORST = 1.02, 1.1
"""Ratios: what is listed as slower, beyond what two runs of the same differ by, and what fails."""

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
    "cradle, pymunk": ["cradle", "run.until=2", "run.engine=pymunk"],
    "boxes, pymunk": ["dominoes", "run.until=1"],
}
# Any other command, the words after `chutelab`.
ANGLES = "--vary plate.angle_deg=-20:20:101 --out rows.csv -q"
COMMANDS = {
    "summary": "run perpendicular --json",
    "sweep, 10,100": f"sweep perpendicular {ANGLES} --vary incoming.speed=1.5:3:100",
    "sweep, 101,000": f"sweep perpendicular {ANGLES} --vary incoming.speed=1.5:3:1000",
    "verify": "verify perpendicular inclined-20 slip",
    "GIF": "run perpendicular --out out --only gif -q",
    "overlay": "run perpendicular --out out --only png -q",
    "page": "live perpendicular -o page.html -q",
}
# The same in a process of its own.
PROCESSES = {
    "process, help": "--help",
    "process, run": "run perpendicular",
}
# Python: what is prepared, and what is timed.
CALLS = {
    "save and load": (
        "recording = chutelab.simulate(chutelab.load(given('stream-independent')))",
        "recording.save('kept.npz'); chutelab.Recording.load('kept.npz')",
    ),
    "predict": (
        "scene = chutelab.load(given('perpendicular')); from chutelab.theory import predict",
        "predict(scene)",
    ),
}


def worked(checkout: Path, scenes: Path) -> None:
    """Answer lines ``[case, times]`` with seconds and the recording's hash, until input ends."""
    # Ahead of what an editable install may have put there.
    sys.path.insert(0, str(checkout / "src"))
    import chutelab
    from chutelab.cli import main

    def given(word: str) -> str:
        """Return where the earlier commit has a scene, or the word as it is."""
        path = scenes / f"{word}.toml"
        return str(path) if path.is_file() else word

    def timed(case: str, times: int) -> list[object]:
        if case in PROCESSES:
            command = [sys.executable, "-m", "chutelab", *map(given, PROCESSES[case].split())]
            # As where it is installed: modules are compiled once, here beside the checkout.
            own = os.environ | {"PYTHONPATH": sys.path[0], "PYTHONPYCACHEPREFIX": str(Path.cwd())}
            own.pop("PYTHONDONTWRITEBYTECODE", None)
            begin = resource.getrusage(resource.RUSAGE_CHILDREN)
            for _ in range(times):
                subprocess.run(
                    command,
                    check=True,
                    capture_output=True,
                    env=own,
                )
            end = resource.getrusage(resource.RUSAGE_CHILDREN)
            return [end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime, ""]
        if case in COMMANDS:
            words = [*map(given, COMMANDS[case].split())]
            begin = process_time()
            for _ in range(times):
                with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere):
                    main(words, standalone_mode=False)
            return [process_time() - begin, ""]
        if case in CALLS:
            names = {"chutelab": chutelab, "given": given}
            prepared, call = CALLS[case]
            exec(prepared, names)
            code = compile(call, case, "exec")
            begin = process_time()
            for _ in range(times):
                exec(code, names)
            return [process_time() - begin, ""]
        name, *settings = RUNS.get(case, [case])
        scene = chutelab.load(given(name), settings)
        begin = process_time()
        for _ in range(times):
            recording = chutelab.simulate(scene)
        seconds = process_time() - begin
        found = recording.knots.tobytes() + recording.events.tobytes()
        return [seconds, hashlib.sha256(found).hexdigest()]

    for line in sys.stdin:
        try:
            answer = timed(*json.loads(line))
        except Exception as error:
            answer = [None, f"{type(error).__name__}: {error}"]
        print(json.dumps(answer), flush=True)


class Version:
    """A checkout, and the process that runs cases of it."""

    def __init__(self, checkout: Path, folder: Path, scenes: Path) -> None:
        folder.mkdir()
        self.process = subprocess.Popen(
            [sys.executable, Path(__file__), "--work", checkout, scenes], cwd=folder, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def turn(self, case: str, times: int) -> tuple[float, str]:
        """Return the processor time of a case, s, and the hash; a RuntimeError if it fails."""
        print(json.dumps([case, times]), file=self.process.stdin, flush=True)
        seconds, bits = json.loads(self.process.stdout.readline())
        if seconds is None:
            raise RuntimeError(bits)
        return seconds, bits


def compared(case: str, then: Version, now: Version, repeats: int) -> float | None:
    """Run a case in both in turn, print what came of it, and return the ratio.

    NaN if it fails now, None if it failed then.
    """
    warm = []
    for version in (now, then):
        try:
            warm.append(min(version.turn(case, 1)[0], version.turn(case, 1)[0]))
        except RuntimeError as error:
            if version is now:
                print(f"{case:18} {error}")
                return float("nan")
            print(f"{case:18} {'':9} {warm[0]:9.4f}  then: {str(error).partition(',')[0]}")
            return None
    times = max(1, round(SLICE / max(*warm, 1e-6)))
    pairs = []
    for turn in range(repeats):
        order = (then, now) if turn % 2 else (now, then)
        found = {version: version.turn(case, times) for version in order}
        pairs.append((found[then], found[now]))
    before, after = (median(pair[k][0] for pair in pairs) / times for k in (0, 1))
    low, _, high = quantiles((b[0] / a[0] for a, b in pairs), n=4)
    bits = pairs[0][0][1], pairs[0][1][1]
    same = "" if not bits[0] else "same" if bits[0] == bits[1] else "other"
    ratio = after / before
    print(f"{case:18} {before:9.4f} {after:9.4f} {ratio:7.2f} {low:6.2f} ..{high:5.2f}  {same}")
    return ratio


def main() -> int:
    """Compare, and print a line for each case."""
    known = [*RUNS, *COMMANDS, *PROCESSES, *CALLS]
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("commit")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(known))
    parser.add_argument("--repeats", type=int, default=7)
    asked = parser.parse_intermixed_args()
    archive = ["git", "-C", ROOT, "archive", asked.commit, "src", "scenes", "pyproject.toml"]
    with tempfile.TemporaryDirectory(prefix="chutelab-against-") as aside, ExitStack() as stack:
        folder = Path(aside)
        packed = subprocess.run(archive, check=True, capture_output=True).stdout
        earlier = folder / "checkout"
        earlier.mkdir()
        subprocess.run(["tar", "-x", "-C", earlier], input=packed, check=True)
        then, now = (
            Version(checkout, folder / name, earlier / "scenes")
            for checkout, name in ((earlier, "then"), (ROOT, "now"))
        )
        for version in (then, now):
            stack.callback(version.process.wait)
            stack.callback(version.process.stdin.close)
        print(f"{'':18} {'then, s':>9} {'now, s':>9} {'ratio':>7}   quartiles   bits")
        cases = asked.cases or known
        ratios = {case: compared(case, then, now, asked.repeats) for case in cases}
    found = {case: ratio for case, ratio in ratios.items() if ratio is not None}
    slower = [f"{case} {ratio:.2f}" for case, ratio in found.items() if not ratio <= SLOWER]
    print(f"slower: {', '.join(slower) or 'none'}")
    return int(any(not ratio <= WORST for ratio in found.values()))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--work"]:
        worked(*map(Path, sys.argv[2:]))
    else:
        sys.exit(main())
