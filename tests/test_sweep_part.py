"""The file of finished rows: it goes on after any interruption, and believes nothing unchecked."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep

import pytest

import chutelab
from chutelab.scene import load
from chutelab.studies.sweep import crew, sweep_to
from chutelab.studies.sweep.part import part_of
from chutelab.util.errors import InputError
from shared import some
from typed import planned


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    """A sweep of 16 rows in blocks of one, its file, and the rows kept while it was written."""
    folder = tmp_path_factory.mktemp("whole")
    plan = planned(load("perpendicular"), ["plate.angle_deg=-20:20:16"], engine="pymunk")
    with crew() as team:
        sweep_to(plan, folder / "rows.csv", team)
        with pytest.raises(KeyboardInterrupt):
            sweep_to(plan, folder / "cut.csv", team, progress=stop_at(0.99))
    kept = part_of(folder / "cut.csv").read_bytes()
    return plan, (folder / "rows.csv").read_bytes(), kept


def stop_at(share):
    def update(done):
        if done >= share:
            raise KeyboardInterrupt

    return update


@pytest.mark.parametrize(
    ("share", "form"), [(0.01, "csv"), (0.5, "csv"), (0.98, "csv"), (1.0, "csv"), (0.77, "parquet")]
)
def test_a_sweep_goes_on_and_writes_the_same_bytes(interrupted, share, form):
    plan, whole, kept = interrupted
    out = Path(f"rows.{form}")
    # Cut anywhere, in the middle of a line or of a number.
    part_of(out).write_bytes(kept[: int(share * len(kept))])
    ran = []
    with crew() as team:
        sweep_to(plan, out, team, resume=True, progress=ran.append)
        if form == "parquet":
            sweep_to(plan, "again.parquet", team)
            whole = Path("again.parquet").read_bytes()
    assert out.read_bytes() == whole
    assert not part_of(out).exists()
    if share > 0.2:
        assert len(ran) < plan.count


def test_rows_of_another_sweep_are_refused(interrupted):
    plan, _, kept = interrupted
    scene = load("perpendicular")
    part_of(Path("rows.csv")).write_bytes(kept)
    others = {
        "what --vary says": planned(scene, ["plate.angle_deg=-20:20:17"], engine="pymunk"),
        "--engine": planned(scene, ["plate.angle_deg=-20:20:16"], engine="exact"),
        "the scene": planned(
            load("perpendicular", ["gravity=9.8"]), ["plate.angle_deg=-20:20:16"], engine="pymunk"
        ),
        "--sample": planned(scene, ["plate.angle_deg=-20:20"], engine="pymunk", sample=16),
    }
    with crew() as team:
        for difference, other in others.items():
            with pytest.raises(InputError, match=difference):
                sweep_to(other, "rows.csv", team, resume=True)
        with pytest.raises(InputError, match="--resume"):
            sweep_to(plan, "rows.csv", team)
        assert part_of(Path("rows.csv")).read_bytes() == kept
        part_of(Path("rows.csv")).write_bytes(b"my notes\n")
        with pytest.raises(InputError, match="no rows of a sweep"):
            sweep_to(plan, "rows.csv", team, resume=True)


# what is not as it was written -------------------------------------------------------------------


def edited(lines):
    lines[4] = lines[4].replace(b"1", b"2", 1)


def rehashed(lines):
    lines[4] = re.sub(rb'"\w{64}"', b'"' + b"0" * 64 + b'"', lines[4])


def doubled(lines):
    lines.insert(4, lines[3])


def removed(lines):
    del lines[4]


def swapped(lines):
    lines[4], lines[5] = lines[5], lines[4]


def deep(lines):
    lines[4] = b"[" * 100_000 + b"\n"


def binary(lines):
    lines[4] = b"\xff\xfe" + lines[4]


HARM = [edited, rehashed, doubled, removed, swapped, deep, binary]


@pytest.mark.parametrize("harm", some(HARM, 2))
def test_rows_that_were_changed_are_refused_with_their_line(interrupted, harm):
    plan, whole, kept = interrupted
    lines = kept.splitlines(keepends=True)
    harm(lines)
    part = part_of(Path("rows.csv"))
    part.write_bytes(b"".join(lines))
    with crew() as team:
        with pytest.raises(InputError, match=r"rows\.csv\.part, line 5: .*remove the file"):
            sweep_to(plan, "rows.csv", team, resume=True)
        assert part.read_bytes().splitlines()[1:] == b"".join(lines).splitlines()[1:]
        assert not Path("rows.csv").exists()
        # What the message advises: the lines before are sound.
        part.write_bytes(b"".join(lines[:4]))
        ran = []
        sweep_to(plan, "rows.csv", team, resume=True, progress=ran.append)
    assert len(ran) == plan.count - 3
    assert Path("rows.csv").read_bytes() == whole


def test_a_first_line_that_was_changed_is_refused(interrupted):
    plan, _, kept = interrupted
    part = part_of(Path("rows.csv"))
    for changed in (
        kept.replace(b'", "', b'",  "', 1),
        kept.replace(b"}\n", b', "more": 1}\n', 1),
        b"[" * 100_000 + b"\n" + kept,
        b"\n" + kept,
    ):
        part.write_bytes(changed)
        with crew() as team, pytest.raises(InputError, match=r"line 1: not|no rows of a sweep"):
            sweep_to(plan, "rows.csv", team, resume=True)
        assert part.read_bytes() == changed


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no FIFO")
def test_the_file_of_finished_rows_is_a_file():
    plan = planned(load("perpendicular"), ["plate.angle_deg=0:20:5"])
    os.mkfifo("pipe.csv.part")
    Path("folder.csv.part").mkdir()
    with crew() as team:
        for name in ("pipe.csv", "folder.csv"):
            with pytest.raises(InputError, match=r"\.part is no file"):
                sweep_to(plan, name, team)
        with pytest.raises(InputError, match="cannot be written: File name too long"):
            sweep_to(plan, "n" * 250 + ".csv", team)


# its writer ------------------------------------------------------------------------------------


def test_a_sweep_that_runs_is_told_from_one_that_was_interrupted(interrupted):
    plan, whole, _ = interrupted
    told = []

    def begin_another(_):
        part = part_of(Path("rows.csv"))
        for resume in (False, True):
            before = part.read_bytes()
            with crew() as team, pytest.raises(InputError) as refused:
                sweep_to(plan, "rows.csv", team, resume=resume)
            told.append(str(refused.value))
            assert part.read_bytes() == before

    with crew() as team:
        sweep_to(plan, "rows.csv", team, progress=begin_another)
    assert len(told) == 2 * plan.count
    assert all(f"still running (process {os.getpid()})" in text for text in told)
    assert Path("rows.csv").read_bytes() == whole
    assert not part_of(Path("rows.csv")).exists()


def test_rows_are_on_the_disk_before_anything_relies_on_them(interrupted, monkeypatch):
    plan, _, _ = interrupted
    synced = []
    known = os.fsync

    def fsync(number):
        known(number)
        about = os.fstat(number)
        synced.append((about.st_ino, about.st_size, part_of(Path("rows.csv")).exists()))

    monkeypatch.setattr("os.fsync", fsync)
    with crew() as team:
        with pytest.raises(KeyboardInterrupt):
            sweep_to(plan, "rows.csv", team, progress=stop_at(0.9))
        about = part_of(Path("rows.csv")).stat()
        assert synced[-1][:2] == (about.st_ino, about.st_size)
        sweep_to(plan, "rows.csv", team, resume=True)
    about = Path("rows.csv").stat()
    assert (about.st_ino, about.st_size, True) in synced
    # At most one each half second, two files, and two folders.
    assert len(synced) < plan.count


@pytest.mark.parametrize("room", [0, 6000])
def test_a_full_disk_loses_nothing(interrupted, room):
    resource = pytest.importorskip("resource")
    plan, whole, kept = interrupted
    assert len(kept) > 6000
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
        with crew() as team, pytest.raises(InputError, match=r"rows\.csv.*: cannot be written: "):
            sweep_to(plan, "rows.csv", team)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    left = [path.name for path in Path().iterdir()]
    assert left == ([] if room == 0 else ["rows.csv.part"])
    with crew() as team:
        sweep_to(plan, "rows.csv", team, resume=True)
    assert Path("rows.csv").read_bytes() == whole


# signals -----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    "signum",
    [
        signal.SIGTERM,
        *(pytest.param(n, marks=pytest.mark.slow) for n in (signal.SIGINT, signal.SIGKILL)),
    ],
)
def test_a_signal_keeps_the_finished_rows_and_leaves_no_process(signum):
    sources = str(Path(chutelab.__file__).parent.parent)
    command = ["sweep", "perpendicular", "--vary", "plate.angle_deg=-20:20:100"]
    command += ["--vary", "plate.restitution=0:1:100", "--engine", "pymunk", "--jobs", "2"]
    running = subprocess.Popen(
        [sys.executable, "-m", "chutelab", *command, "--out", "rows.csv"],
        env={**os.environ, "PYTHONPATH": sources, "TMPDIR": str(Path().absolute())},
        stderr=subprocess.PIPE,
        text=True,
    )
    part, patience = part_of(Path("rows.csv")), monotonic() + 60.0
    while not (part.exists() and part.read_bytes().count(b"\n") > 5) and monotonic() < patience:
        sleep(0.05)
    running.send_signal(signum)
    # Workers have the same standard error: this returns when the last of them has ended.
    _, said = running.communicate(timeout=30)
    assert running.returncode == (-signum if signum == signal.SIGKILL else 128 + signum)
    assert "Traceback" not in said
    if signum != signal.SIGKILL:
        assert "rows.csv.part has the finished rows; --resume goes on" in said
    assert [path.name for path in Path().iterdir()] == [part.name]
