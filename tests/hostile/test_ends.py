"""Commands that are stopped, cannot write, have closed descriptors or odd surroundings."""

import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import chutelab
from hostile.inputs import SWEEP
from hostile.worker import PATIENCE, fault

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals and descriptors of POSIX")

KILLS = int(os.environ.get("CHUTELAB_KILLS", "60"))
"""Kills in all of a slow run."""

COMMANDS = {
    "run": ["run", "perpendicular", "--out", "out"],
    "show": ["show", "good.npz", "--out", "out", "--only", "csv,npz,json,png"],
    "sweep": [*SWEEP, "--out", "rows.csv", "--plot", "rows.png"],
    "jobs": [*SWEEP, "--out", "rows.csv", "--jobs", "2"],
    "solve": ["solve", "perpendicular", "--vary", "plate.restitution=0.1:0.9", "--target",
    "landing.vx=-1",
              "--out", "out"],
    "live": ["live", "inclined-20", "-o", "page.html"],
    "figure": ["figure", "8", "--out", "out"],
}  # fmt: skip
"""A command of each kind that writes."""


def environment(**more):
    """Return what commands run in; None takes a name away."""
    known = {**os.environ, "PYTHONPATH": str(Path(chutelab.__file__).parents[1]), **more}
    return {name: text for name, text in known.items() if text is not None}


def begun(words, folder, **options):
    """Begin a command in a session of its own, so that processes that are left over are found."""
    return subprocess.Popen(
        [sys.executable, "-m", "chutelab", *words],
        cwd=folder,
        start_new_session=True,
        **{"env": environment(), "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, **options},
    )


def ended(running, seconds=3.0 * PATIENCE):
    """Wait for a command; return its exit code and what it said."""
    try:
        said, _ = running.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        os.killpg(running.pid, signal.SIGKILL)
        said, _ = running.communicate()
        raise AssertionError(f"not done after {seconds:g} s: {said.decode()}") from None
    return running.returncode, (said or b"").decode("utf-8", "replace")


def alive(session):
    """Return the command lines of the processes of a session; none where there is no /proc."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            if int(fields[3]) == session and fields[0] != "Z":
                found.append((entry / "cmdline").read_text().replace("\0", " "))
        except (OSError, ValueError, IndexError):
            continue
    return found


def listens(process):
    """Tell whether a process waits for TERM, as commands do once the interpreter has started."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return not Path("/proc/self/status").exists()
    caught = next(line for line in status.splitlines() if line.startswith("SigCgt"))
    return bool(int(caught.split()[1], 16) >> (signal.SIGTERM - 1) & 1)


def there(folder):
    """Return all files under a folder, by their paths."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """What each command leaves if it is not disturbed, and how long it takes."""
    known = {}

    def of(name):
        if name not in known:
            folder = prepared(tmp_path_factory.mktemp(name))
            start = time.monotonic()
            code, said = ended(begun(COMMANDS[name], folder))
            assert code == 0, said
            known[name] = there(folder), time.monotonic() - start
        return known[name]

    return of


def prepared(folder):
    """Put a recording into a folder."""
    chutelab.simulate(chutelab.load("perpendicular")).save(folder / "good.npz")
    return folder


def check_left(folder, name, whole, *, killed=False):
    """What is there is whole, by its bytes; besides it there may be a sweep's finished rows."""
    expected = whole(name)[0]
    for path, data in there(folder).items():
        if path.endswith(".part"):
            continue
        if killed and any(part.startswith(".") for part in Path(path).parts):
            continue  # no program can clean up after KILL
        assert path in expected, f"{name} left {path}"
        assert data == expected[path], f"{path} of {name} is torn"


def stopped(name, number, after, folder, whole):
    """Stop a command after a while and look at what there is."""
    running = begun(COMMANDS[name], prepared(folder))
    while not listens(running.pid) and running.poll() is None:
        time.sleep(0.001)
    time.sleep(after)
    running.send_signal(number)
    code, said = ended(running, PATIENCE)
    # In the last moment of the interpreter no handler runs: a shell has 128 + number then too.
    allowed = {0, -9} if number == signal.SIGKILL else {0, 128 + number, -number}
    assert code in allowed, said
    assert "Traceback" not in said
    limit = time.monotonic() + 5.0
    while (left := alive(running.pid)) and time.monotonic() < limit:
        time.sleep(0.05)
    assert not left
    if "what was recorded is written" in said:
        # All files, of a part of the run.
        assert there(folder).keys() == whole(name)[0].keys()
    else:
        check_left(folder, name, whole, killed=number == signal.SIGKILL)
    if (folder / "rows.csv.part").exists():
        code, said = ended(begun([*COMMANDS[name], "--resume"], folder))
        assert code == 0, said
        assert there(folder).items() >= whole(name)[0].items()


STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.parametrize("kill", range(KILLS))
def test_stopped_at_any_time(kill, tmp_path, whole):
    rng = random.Random(kill)
    name, number = list(COMMANDS)[kill % len(COMMANDS)], STOPS[kill // len(COMMANDS) % 3]
    stopped(name, number, rng.random() * whole(name)[1], tmp_path, whole)


FULL = 2000
"""Bytes that a file may have where the disk is full."""


@pytest.mark.parametrize(
    "name",
    ["run", *(pytest.param(n, marks=pytest.mark.slow)
              for n in ("sweep", "solve", "show", "jobs", "live", "figure"))],
)  # fmt: skip
def test_a_full_disk(name, tmp_path):
    prepared(tmp_path)

    def little():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (FULL, FULL))

    # Python itself would leave the first half of what it compiles, for all that come later.
    env = environment(PYTHONDONTWRITEBYTECODE="1")
    code, said = ended(begun(COMMANDS[name], tmp_path, preexec_fn=little, env=env))
    assert code in (1, 2)
    assert "Traceback" not in said
    assert "please report" not in said
    left = [path for path in there(tmp_path) if path != "good.npz" and not path.endswith(".part")]
    assert not left


CLOSED = {
    "no error": "2>&-",
    "no output": ">&-",
    "no input": "<&-",
    "neither": ">&- 2>&-",
    "a full device": ">/dev/full",
    "full devices": ">/dev/full 2>/dev/full",
}
TOLD = (
    "run perpendicular --json", "run perpendicular --out out -q", "--help", "check perpendicular",
    "scenes",
    "verify inclined-60", "sweep perpendicular --vary plate.restitution=0:1:3 --out rows.csv",
    "solve perpendicular --vary plate.restitution=0.1:0.9 --target landing.vx=-1",
    "run no-such-scene",
)  # fmt: skip


def cases():
    for number, (name, how) in enumerate(CLOSED.items()):
        for place, words in enumerate(TOLD):
            # By default every other way once, with one of three commands.
            marks = () if number % 2 and place == number - 1 else (pytest.mark.slow,)
            yield pytest.param(how, words, id=f"{name}-{words.split()[0]}-{place}", marks=marks)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
@pytest.mark.parametrize(("how", "words"), list(cases()))
def test_closed_descriptors(how, words, tmp_path):
    line = f'exec "{sys.executable}" -m chutelab {words} {how}'
    done = subprocess.run(
        ["sh", "-c", line],
        cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False,
        timeout=PATIENCE,
    )  # fmt: skip
    said = done.stdout + done.stderr
    assert "Traceback" not in said
    wrong = words.startswith("run no")
    unheard = ">/dev/full" in how and "-q" not in words
    expected = {2} if wrong else {1} if unheard else {0}
    if "2>&-" not in how and "2>/dev/full" not in how and expected == {1}:
        assert done.stderr
    assert done.returncode in expected | ({0} if wrong is False and ">&-" in how else set()), said


ODD = {
    "C": {"LANG": "C", "LC_ALL": "C"},
    "ascii": {"PYTHONIOENCODING": "ascii"},
    "latin": {"PYTHONIOENCODING": "latin-1", "PYTHONUTF8": "0"},
    "no home": {"HOME": None},
    "home away": {"HOME": "/no-such-folder"},
    "odd backend": {"MPLBACKEND": "no-such-thing"},
    "settings away": {"MPLCONFIGDIR": "/no-such-folder"},
    "temporary away": {"TMPDIR": "/no-such-folder"},
    "narrow": {"COLUMNS": "1"},
    "wide": {"COLUMNS": "100000"},
    "not a width": {"COLUMNS": "wide"},
    "optimised": {"PYTHONOPTIMIZE": "2"},
    "hash": {"PYTHONHASHSEED": "7"},
    "development": {"PYTHONDEVMODE": "1"},
    "dumb": {"TERM": "dumb", "NO_COLOR": "1"},
    "zone": {"TZ": "Nowhere/Land", "SOURCE_DATE_EPOCH": "soon"},
    "no path": {"PATH": ""},
    "bytes": {"PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": "1"},
}


@pytest.mark.parametrize(
    ("name", "odd"),
    [pytest.param(k, v, marks=() if n == 0 else pytest.mark.slow, id=k) for n, (k,
    v) in enumerate(ODD.items())],
)  # fmt: skip
def test_odd_environments(name, odd, tmp_path):
    prepared(tmp_path)
    words = ["show", "good.npz", "--out", "out", "--only", "csv,json,png"]
    code, said = ended(begun(words, tmp_path, env=environment(**odd)))
    assert fault(code, said, []) == ""
    assert code == 0, said
    assert not [path for path in there(tmp_path) if path.startswith(".")]


def test_the_folder_at_hand_has_gone(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    line = f'rmdir "{gone}"; exec "{sys.executable}" -m chutelab run perpendicular --out out'
    done = subprocess.run(
        ["sh", "-c", line],
        cwd=gone, env=environment(), capture_output=True, text=True, check=False, timeout=PATIENCE,
    )  # fmt: skip
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr.strip()
