"""Recordings on disk: to the last bit, whole or not at all, and refused in words."""

import csv
import json
import os
import re
import sys
import tracemalloc
import zipfile
from dataclasses import fields, replace
from functools import cache
from io import BytesIO, StringIO
from math import isnan

import numpy as np
import pytest

from chutelab import scene
from chutelab.engines.simulation import simulate
from chutelab.results import Kind, Recording, storage
from chutelab.results.storage import RecordingError
from chutelab.util.files import aside, together, whole

ARRAYS = (
    "knots", "offsets", "ended", "events", "by_surface", "angle", "totals", "unsolved", "drives",
    "impulses", "lasting", "swings", "hinge_work", "stopped", "springs", "triggered",
)  # fmt: skip


@cache
def run(name="belt-landing", *overrides):
    return simulate(scene.load(scene.find(name), overrides))


def listing(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("belt-landing", ()),
        ("free-fall", ("particle.spin=true",)),
        ("perpendicular", ("run.engine=pymunk", 'title="Größe µ, \\"quoted\\""')),
        ("stream-independent", ("stream.count=100", "run.until=0.3")),
        ("dominoes", ("run.until=0.2",)),
        ("cradle", ("spring=[{from=[0.1,0.0],stiffness=9.0,particle=2}]", "run.until=0.2")),
    ],
)
def test_a_recording_comes_back_to_the_last_bit(tmp_path, name, overrides):
    recording = run(name, *overrides)
    path = tmp_path / "recording.npz"
    assert recording.save(path) == path
    back = Recording.load(path)
    assert listing(tmp_path) == ["recording.npz"]
    for name in ("scene", "title", "particle", "gravity", "surfaces"):
        assert getattr(recording, name) == getattr(back, name)
    for field in fields(Recording):
        if field.name in ("machine", "seconds"):
            continue
        mine, theirs = getattr(recording, field.name), getattr(back, field.name)
        assert type(mine) is type(theirs)
        if field.name in ARRAYS:
            assert (mine.dtype, mine.shape) == (theirs.dtype, theirs.shape)
            assert mine.tobytes() == theirs.tobytes()
            assert not theirs.flags.writeable
        else:
            assert mine == theirs
    # How long it took is no property of the run.
    assert recording.seconds > 0.0
    assert isnan(back.seconds)


def test_any_number_of_particles_may_wait_for_their_release(tmp_path):
    """They are packed as well as what is made to fill the memory, and are 8 bytes each."""
    recording = run("stream-independent", "stream.count=300_000", "run.until=0.001")
    path = recording.save(tmp_path / "many.npz")
    assert recording.offsets.nbytes > 300 * path.stat().st_size
    assert Recording.load(path).offsets.tobytes() == recording.offsets.tobytes()


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, error):
    path = tmp_path / "recording.npz"
    path.write_bytes(b"old")

    def half(file, *_, **__):
        file.write(b"half of it")
        raise error

    monkeypatch.setattr("chutelab.results.storage.npy.write_array", half)
    with pytest.raises(error):
        run().save(path)
    assert listing(tmp_path) == ["recording.npz"]
    assert path.read_bytes() == b"old"


def test_a_file_appears_only_when_it_is_whole(tmp_path):
    path = tmp_path / "new.txt"
    with whole(path) as unfinished:
        unfinished.write_text("some")
        assert not path.exists()
        assert unfinished.parent.parent == tmp_path
    assert path.read_text() == "some"
    # a program that has the old file open goes on reading it
    with path.open() as reader:
        with whole(path) as unfinished:
            unfinished.write_text("more")
        assert reader.read() == "some"
    assert path.read_text() == "more"
    assert listing(tmp_path) == ["new.txt"]
    with pytest.raises(FileNotFoundError, match="no folder") as error, whole(tmp_path / "a/b"):
        pass
    assert error.value.filename == str(tmp_path / "a/b")


def test_only_files_are_replaced_and_links_stay(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to("real.txt")
    with whole(tmp_path / "link.txt") as unfinished:
        unfinished.write_text("new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"
    os.mkfifo(tmp_path / "pipe")
    for name, says in (("pipe", "is a device or a pipe"), (".", "is a folder, not a file")):
        with pytest.raises(OSError, match=says), whole(tmp_path / name):
            pytest.fail("nothing is made for it")
    assert (tmp_path / "pipe").is_fifo()
    assert listing(tmp_path) == ["link.txt", "pipe", "real.txt"]


def test_files_move_together_or_not_at_all(tmp_path):
    (tmp_path / "page" / "index.html").mkdir(parents=True)

    def move():
        with together(tmp_path) as made:
            (made / "page").mkdir()
            for name in ("a.txt", "page/index.html"):
                (made / name).write_text("new")

    with pytest.raises(OSError, match="is a folder, not a file"):
        move()
    assert listing(tmp_path) == ["page"]


def test_an_error_of_a_file_that_is_made_names_the_one_that_was_meant(tmp_path):
    """The error of a full disk names neither the source of a copy nor a temporary folder."""

    def fail(*names):
        with whole(tmp_path / "a.txt") as unfinished:
            raise OSError(28, "No space left", *names, *([str(unfinished)] if names else []))

    for names in ((), ("source.txt", None)):
        with pytest.raises(OSError, match="No space left") as found:
            fail(*names)
        assert found.value.filename == str(tmp_path / "a.txt")
    assert listing(tmp_path) == []


def test_what_a_killed_program_left_is_removed_by_the_next_and_nothing_else(tmp_path):
    """Old and without a lock: a program that is killed loses its locks, one that runs has them."""
    with aside(tmp_path) as running:
        old = [running, tmp_path / f"{running.name[:-8]}abcdefgh", tmp_path / ".chutelab-notes"]
        for folder in old[1:]:
            folder.mkdir()
        (fresh := tmp_path / f"{running.name[:-8]}ijklmnop").mkdir()
        for folder in old:
            os.utime(folder, (0.0, 0.0))
        with whole(tmp_path / "a.txt") as unfinished:
            unfinished.touch()
        assert sorted(tmp_path.iterdir()) == sorted([running, fresh, old[2], tmp_path / "a.txt"])


def altered(path, change_header=None, **arrays):
    """Write a recording with another header or other arrays."""
    with np.load(path) as data:
        held = {name: data[name] for name in data.files}
    if change_header is not None:
        about = json.loads(str(held["about"]))
        held["about"] = np.array(json.dumps(change_header(about)))
    np.savez(path, **{**held, **arrays})


def refused(path):
    with pytest.raises(RecordingError) as raised:
        storage.load(path)
    text = str(raised.value)
    assert str(path) in text
    assert "\n" not in text
    return text


def test_another_version_is_refused(tmp_path):
    path = run().save(tmp_path / "old.npz")
    for version in (0, 4, "1", None):
        altered(path, lambda about, version=version: {**about, "format": version})
        assert "another version" in refused(path)


def test_what_cannot_be_read_is_said(tmp_path):
    assert "no such file" in refused(tmp_path / "nothing.npz")
    assert "cannot be read" in refused(tmp_path)


def test_other_files_are_no_recordings(tmp_path):
    path = tmp_path / "other.npz"
    for content in (b"", b"PK\x03\x04", b"title = 'a scene'\n", bytes(range(256)) * 40):
        path.write_bytes(content)
        assert "not a recording" in refused(path)
    with path.open("wb") as file:
        np.save(file, np.zeros(3))
    assert "not a recording" in refused(path)
    np.savez(path, about=np.array("3"), x=np.zeros(3))
    assert "not a recording" in refused(path)
    np.savez(path, x=np.array([{}], dtype=object))
    assert "not a recording" in refused(path)


def test_arrays_that_do_not_fit_are_refused(tmp_path):
    recording = run()
    surface, kind, particle = (recording.events.copy() for _ in range(3))
    surface["surface"][2], kind["kind"][2], particle["particle"][2] = 99, 9, 1
    wrong = {
        "knots": [recording.knots[:-1], recording.knots["t"].copy()],
        "offsets": [
            recording.offsets + 1,
            np.array([1, len(recording.knots)]),
            np.zeros(0, np.int64),
            np.zeros((1, 2)),
        ],
        "ended": [np.zeros(2, np.int8), np.array([7], np.int8)],
        "events": [surface, kind, particle],
        "by_surface": [np.zeros((2, 3)), np.zeros((4, 3), np.float32)],
    }
    lone = {"knots": recording.knots[:1], "offsets": np.array([0, 1])}
    altered(recording.save(tmp_path / "lone.npz"), **lone)
    assert "not a recording" in refused(tmp_path / "lone.npz")
    for angle in (np.zeros(3), np.zeros(0, dtype="f4"), np.array([np.nan])):
        altered(recording.save(tmp_path / "turned.npz"), angle=angle)
        refused(tmp_path / "turned.npz")
    for name, choices in wrong.items():
        for array in choices:
            path = recording.save(tmp_path / "arrays.npz")
            altered(path, **{name: array})
            assert "not a recording" in refused(path), (name, array)


@pytest.mark.parametrize(
    ("array", "field"),
    [
        *(("knots", field) for field in ("t", "position", "velocity", "omega", "entries")),
        *(("events", field) for field in ("t", "velocity_after", "normal_impulse")),
        ("by_surface", ...),
    ],
)
@pytest.mark.parametrize("value", [np.nan, np.inf, -1e300])
def test_numbers_that_no_run_leaves_are_refused_and_named(tmp_path, array, field, value):
    recording = run()
    wrong = getattr(recording, array).copy()
    wrong[field][-1] = value
    altered(recording.save(tmp_path / "wrong.npz"), **{array: wrong})
    text = refused(tmp_path / "wrong.npz")
    assert f"{array if field is ... else f'{array}.{field}'} has a number" in text


@pytest.mark.parametrize("array", ["knots", "events"])
def test_times_that_go_backward_are_refused(tmp_path, array):
    recording = run("free-fall")
    wrong = getattr(recording, array).copy()
    wrong["t"][1] = -1.0
    altered(recording.save(tmp_path / "back.npz"), **{array: wrong})
    assert "go backward" in refused(tmp_path / "back.npz")


@pytest.mark.parametrize(
    ("key", "values", "told"),
    [
        ("engine", (None, 1, "", "newton", ["exact"]), "engine"),
        ("steps", (None, 1.0, True, -1, "1", [], 10**40), "whole numbers"),
        ("contacts", (None, 0.5, False, -1, {}), "whole numbers"),
        ("title", (None, 5, "another"), "not a recording"),
        ("scene", (None, 5, "", "{", "[]", '{"stream": 3}', "[" * 10_000), "not a recording"),
    ],
)
def test_a_header_of_wrong_types_is_refused(tmp_path, key, values, told):
    recording = run()
    for value in values:
        path = recording.save(tmp_path / "types.npz")
        altered(path, lambda about, value=value: {**about, key: value})
        assert told in refused(path), value


def repacked(path, name, data, method=zipfile.ZIP_DEFLATED):
    """Write an archive anew with other bytes in one entry."""
    with zipfile.ZipFile(path) as old:
        held = {info.filename: old.read(info) for info in old.infolist()}
    with zipfile.ZipFile(path, "w") as new:
        for one, content in {**held, f"{name}.npy": data}.items():
            new.writestr(one, content, method if one == f"{name}.npy" else zipfile.ZIP_DEFLATED)


def npy(array, shape=None):
    """Return an array as a file, with another shape in its header if wanted."""
    out = BytesIO()
    about = {"descr": np.lib.format.dtype_to_descr(array.dtype), "fortran_order": False}
    np.lib.format.write_array_header_1_0(out, {**about, "shape": shape or array.shape})
    return out.getvalue() + array.tobytes()


def test_an_archive_that_would_fill_the_memory_is_refused_before_it_is_unpacked(tmp_path):
    recording = run()
    path = recording.save(tmp_path / "bomb.npz")
    many = 400_000
    repacked(path, "knots", npy(np.zeros(many, recording.knots.dtype)))
    assert path.stat().st_size < 200_000
    tracemalloc.start()
    try:
        assert "knots would be 28.8 MB, unpacked from 0.02" in refused(path)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 2_000_000


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names are of Unix")
def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.npz")
    assert "no regular file" in refused(tmp_path / "pipe.npz")


def test_damage_anywhere_is_refused_or_harmless(tmp_path):
    recording = run("free-fall", "stream.count=1")
    path = recording.save(tmp_path / "damaged.npz")
    good = path.read_bytes()
    rng = np.random.default_rng(0)
    outcomes = set()
    for place in rng.integers(0, len(good), 100).tolist():
        path.write_bytes(good[:place] + bytes([good[place] ^ 0xFF]) + good[place + 1 :])
        try:
            back = storage.load(path)
        except RecordingError as error:
            assert str(path) in str(error)  # noqa: PT017 - some damage is harmless
            outcomes.add("refused")
        else:
            assert back.knots.tobytes() == recording.knots.tobytes()
            assert back.events.tobytes() == recording.events.tobytes()
        path.write_bytes(good[:place])
        refused(path)
    assert outcomes == {"refused"}


def table(path):
    text = path.read_text(encoding="utf-8")
    assert text.endswith("\n")
    return list(csv.reader(StringIO(text)))


def test_events_csv_holds_every_event_digit_for_digit(tmp_path):
    recording = run("free-fall", "particle.spin=true")
    assert recording.to_csv(tmp_path, only=("events",)) == [tmp_path / "events.csv"]
    assert listing(tmp_path) == ["events.csv"]
    header, *rows = table(tmp_path / "events.csv")
    assert header == [
        "t", "particle", "other", "kind", "surface", "x", "y", "vx_before", "vy_before",
        "vx_after", "vy_after", "omega_before", "omega_after", "normal_impulse",
        "tangential_impulse",
    ]  # fmt: skip
    assert len(rows) == len(recording.events)
    for row, e in zip(rows, recording.events, strict=True):
        surface = recording.surfaces[e["surface"]] if e["surface"] >= 0 else ""
        assert row[1:5] == [str(e["particle"]), "", Kind(e["kind"]).name.lower(), surface]
        numbers = [
            e["t"], *e["position"], *e["velocity_before"], *e["velocity_after"],
            e["omega_before"], e["omega_after"], e["normal_impulse"], e["tangential_impulse"],
        ]  # fmt: skip
        assert [row[0], *row[5:]] == [repr(float(number)) for number in numbers]


def test_no_name_of_a_surface_breaks_events_csv_or_is_a_formula(tmp_path):
    names = {"a,b": "a,b", "+1+1": "'+1+1", "a;@SUM(A1:A9)": "a;'@SUM(A1:A9)", "-0": "-0"}
    told = {"stream": {"at": [0.0, 1.0], "velocity": [0.0, 0.0]}, "run": {"until": 2.0}}
    for name, cell in names.items():
        floor = {"name": name, "from": [-1.0, 0.0], "to": [1.0, 0.0]}
        simulate(scene.from_dict({**told, "surface": [floor]})).to_csv(tmp_path, only=["events"])
        header, *rows = table(tmp_path / "events.csv")
        assert {len(row) for row in rows} == {len(header)}
        assert {row[4] for row in rows} == {"", cell}


def test_a_collision_names_its_partner(tmp_path):
    recording = run("free-fall")
    events = recording.events.copy()
    events["other"][3] = 4
    replace(recording, events=events).to_csv(tmp_path)
    assert [row[2] for row in table(tmp_path / "events.csv")[1:]][:5] == ["", "", "", "4", ""]


@pytest.mark.parametrize("step", [None, 0.05, 1])
def test_trajectory_csv_is_sampled_uniformly(tmp_path, step):
    recording = run("free-fall")
    recording.to_csv(tmp_path, step=step)
    header, *rows = table(tmp_path / "trajectory.csv")
    assert header == ["t", "particle", "x", "y", "vx", "vy"]
    end = recording.knots["t"].max()
    times = np.linspace(0.0, end, 200) if step is None else step * np.arange(int(end / step) + 1)
    position, velocity = recording.at(times)
    expected = [
        [repr(float(x)) for x in (t, *position[n, i], *velocity[n, i])]
        for n, t in enumerate(times)
        for i in range(recording.count)
        if np.isfinite(position[n, i, 0])
    ]
    assert [[row[0], *row[2:]] for row in rows] == expected
    assert {row[1] for row in rows} == {str(i) for i in range(recording.count)}


@pytest.mark.parametrize("step", [5e-324, 1e-9, 2e-3])
def test_a_trajectory_that_would_be_too_large_is_refused_with_the_step_that_would_do(
    tmp_path, monkeypatch, step
):
    recording = run("free-fall")
    monkeypatch.setattr(storage, "MOST_ROWS", 1000)
    with pytest.raises(ValueError, match=r"^step = .* would have up to .* 1,000 are") as refused:
        recording.to_csv(tmp_path, step=step)
    assert listing(tmp_path) == []
    least = float(re.search(r"allowed: (\S+) s or more$", str(refused.value))[1])
    recording.to_csv(tmp_path, step=least)
    assert 900 < len(table(tmp_path / "trajectory.csv")) - 1 <= 1000
    assert recording.to_csv(tmp_path, step=step, only=["events"])


@pytest.mark.parametrize("name", ["events", "trajectory"])
def test_frames_are_what_the_csv_files_are_read_as(tmp_path, name):
    pandas = pytest.importorskip("pandas")
    recording = run("stream", "stream.count=5")
    recording.to_csv(tmp_path, step=0.05)
    read = pandas.read_csv(tmp_path / f"{name}.csv")
    found = recording.frame(name, step=0.05)
    pandas.testing.assert_frame_equal(found, read, check_dtype=False, rtol=1e-15)
    with pytest.raises(ValueError, match="table = 'tracks': one of events, trajectory"):
        recording.frame("tracks")
    with pytest.raises(ValueError, match=r"step = -1\.0"):
        recording.frame(name, step=-1.0)


def test_a_frame_without_pandas_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        run("free-fall").frame()
