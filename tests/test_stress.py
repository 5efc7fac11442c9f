"""The command stress; a run that gets stuck; a run that is interrupted."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from functools import partial
from math import inf
from pathlib import Path

import pytest
from click.testing import CliRunner

import chutelab
import shared
from chutelab import scene
from chutelab.checks import agreement  # noqa: F401 - or it would keep what a test puts in
from chutelab.checks.stress import LAWS, Evidence, Verdict, judge
from chutelab.cli import main
from chutelab.engines.simulation import follow
from chutelab.machine import build
from chutelab.results.recorder import StalledError
from chutelab.util.files import together
from chutelab.util.signals import raised
from stress.runs import HOP

SOURCES = str(Path(chutelab.__file__).parent.parent)


def listed(folder):
    return sorted(path.name for path in folder.iterdir())


# The command


call = partial(shared.call, "stress")


def test_each_law_is_a_line_with_figure_and_bound():
    shown = call("perpendicular").stdout
    assert shown.startswith("Perpendicular damping plate, 2 m/s\nengine exact\n")
    rows = re.findall(r"^ok  ([a-z ]*[a-z]) +(\d\S*) +(\d\S*)  (.+)$", shown, re.M)
    assert [name for name, *_ in rows] == [
        "finite numbers", "time goes forward", "none lost", "lasts to the end",
        "nothing through", "nothing inside", "bounces off something", "released into room",
        "friction of the pair", "rebound of the pair", "energy never rises", "ledger closes",
        "loads", "laws of every run",
    ]  # fmt: skip
    assert all(0.0 <= float(figure) <= float(bound) for _, figure, bound, _ in rows)
    assert shown.endswith("\nall 14 laws kept\n")
    assert max(len(line) for line in shown.splitlines()) <= 80


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_kinds_that_pass_through_each_other_overlap_by_law(engine):
    """The first two cross slowly, and the third is released inside the second; alone it is not."""
    stream = {"velocity": [0.0, 0.0], "interact": True}
    tables = {
        "gravity": 0.0,
        "particle": [{"name": name, "radius": 0.02, "mass": 0.01} for name in "ab"],
        "pair": [{"between": ["a", "b"], "meet": False}],
        "stream": [
            stream | {"at": [0.0, 0.0], "velocity": [0.1, 0.0], "particle": "a"},
            stream | {"at": [0.05, 0.0], "particle": "b"},
            stream | {"at": [0.05, 0.01], "start": 0.05, "particle": "a"},
        ],
        "run": {"until": 0.25},
    }
    run = Evidence(chutelab.simulate(tables, engine=engine))
    assert not [one for one in judge(run) if one.broken]


def test_the_scene_is_changed_and_run_as_told():
    told = json.loads(
        call("slip", "--set", "gravity=1.6", "--engine", "pymunk", "--dt", 0.002, "--json").stdout
    )
    assert (told["format"], told["scene"], told["broken"]) == (1, "slip", 0)
    assert (told["engine"], told["dt"]) == ("pymunk", 0.002)
    assert told["title"].endswith("; with gravity=1.6")
    assert {one["law"] for one in told["laws"]} <= set(LAWS)
    assert all(one["holds"] and one["figure"] <= one["bound"] for one in told["laws"])


def test_a_broken_law_is_told_and_is_exit_code_1(monkeypatch):
    monkeypatch.setitem(LAWS, "ledger closes", lambda e: Verdict(inf, 1e-12, "of it all"))
    shown = call("perpendicular", code=1).stdout
    assert re.search(r"^FAILED  ledger closes +inf +1e-12  of it all *$", shown, re.M)
    assert shown.endswith("\n1 of 14 laws broken\n")
    told = json.loads(call("perpendicular", "--json", code=1).stdout)
    assert told["broken"] == 1
    (bad,) = (one for one in told["laws"] if not one["holds"])
    assert bad == {
        "law": "ledger closes", "figure": None, "bound": 1e-12, "detail": "of it all",
        "holds": False, "unpromised": "",
    }  # fmt: skip


def test_what_is_not_promised_is_told_with_its_reason():
    arguments = ["stream", "--set", "stream.count=40", "--engine", "pymunk", "--dt", "0.0333"]
    shown = call(*arguments).stdout
    assert re.search(r"^-   nothing through +\d+ +0  ", shown, re.M)
    words = " ".join(shown.split())
    assert re.search(r"not promised: up to \d+ radii in a step, and contacts are", words)
    assert shown.endswith(" laws kept, 2 not promised\n")
    told = json.loads(call(*arguments, "--json").stdout)
    found = {law["law"]: law["holds"] for law in told["laws"] if law["unpromised"]}
    assert (told["broken"], found) == (0, {"nothing through": False, "laws of every run": False})


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "SCENE"),
        (["nonsense"], "nonsense"),
        (["slip", "--engine", "warp"], "warp"),
        (["slip", "--dt", "-1"], "--dt -1"),
        (["stream", "--engine", "exact"], "stream.interact"),
        (["slip", "one-too-many"], "one-too-many"),
    ],
)
def test_bad_input_is_exit_code_2(arguments, said):
    outcome = call(*arguments, code=2)
    assert outcome.stdout == ""
    assert said in outcome.stderr


# A run that gets stuck; a run that is interrupted

ENDLESS = """
[particle]
radius = 0.004
[[surface]]
name = "floor"
from = [-1.0, 0.0]
to = [1.0, 0.0]
restitution = 1.0
[stream]
at = [0.0, 0.005]
velocity = [0.0, 0.0]
[run]
engine = "contact"
until = 1e6
max_time = 1e6
"""


def stuck(loaded, **_options):
    recording = follow(build(scene.from_dict(HOP)), None, None)
    raise StalledError(0, 0.75, (0.25, 0.004), "it rattles", recording)


def run_stuck(monkeypatch, tmp_path, *arguments, code=1):
    monkeypatch.setattr("chutelab.engines.simulation.judged", stuck)
    monkeypatch.chdir(tmp_path)
    outcome = CliRunner().invoke(main, ["run", "perpendicular", *arguments])
    assert outcome.exit_code == code
    return outcome.stderr


def test_a_stuck_run_says_which_particle_and_where_and_writes_nothing(monkeypatch, tmp_path):
    said = run_stuck(monkeypatch, tmp_path, "--out", "out")
    assert "particle 0 is stuck at t = 0.75 s, x = 0.25 m, y = 0.004 m: it rattles" in said
    assert "--partial" in said
    assert listed(tmp_path) == []


def test_a_stuck_run_writes_what_there_is_if_asked(monkeypatch, tmp_path):
    said = run_stuck(monkeypatch, tmp_path, "--out", "out", "--partial", "--only", "npz,csv")
    assert "it rattles; what is written ends there" in said
    assert (listed(tmp_path / "out")) == ["events.csv", "recording.npz", "trajectory.csv"]
    saved = chutelab.Recording.load(tmp_path / "out" / "recording.npz")
    hop = follow(build(scene.from_dict(HOP)), None, None)
    assert saved.knots.tobytes() == hop.knots.tobytes()


def started(folder, *arguments, **environment):
    return subprocess.Popen(
        [sys.executable, "-m", "chutelab", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": SOURCES, **environment},
        # Tests that nohup starts would hand on that HUP is ignored.
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),
    )


def interrupted(folder, *arguments, when, sent=(signal.SIGINT,)):
    """Start a run in a folder, send signals as soon as `when()` is true; return how it ends."""
    process = started(folder, "run", *arguments)
    deadline = time.monotonic() + 60.0
    while not when() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    assert process.poll() is None, process.communicate()
    for one in sent:
        process.send_signal(one)
        # A moment, or the kernel hands over the lower number first.
        time.sleep(0.002)
    _, said = process.communicate(timeout=60.0)
    # Python's last act is to give signals back: one that comes then kills, and shells say the same.
    code = process.returncode
    return code if code >= 0 else 128 - code, said


ENDS = [
    # A second signal does not break off the clean-up of the first.
    ([signal.SIGTERM] * 3, 143, "Terminated."),
    pytest.param([signal.SIGHUP], 129, "Terminated.", marks=pytest.mark.slow),
]


@pytest.fixture
def in_the_middle(tmp_path):
    """Tell when an endless run is in the middle: half a second after its folder is there."""
    (tmp_path / "endless.toml").write_text(ENDLESS)
    begun = []

    def when():
        if list(tmp_path.glob(".chutelab-*")):
            begun.append(time.monotonic())
        return bool(begun) and time.monotonic() > begun[0] + 0.5

    return when


@pytest.mark.parametrize(("sent", "code", "says"), ENDS)
def test_a_signal_during_a_run_leaves_nothing(tmp_path, in_the_middle, sent, code, says):
    ended = interrupted(tmp_path, "endless.toml", "--out", "out", when=in_the_middle, sent=sent)
    assert ended == (code, f"\n{says}\n")
    assert listed(tmp_path) == ["endless.toml"]


@pytest.mark.slow
def test_ctrl_c_during_a_run_leaves_what_was_recorded(tmp_path, in_the_middle):
    code, said = interrupted(
        tmp_path, "endless.toml", "--out", "out", "--only", "json,npz", when=in_the_middle,
        sent=[signal.SIGINT] * 5,
    )  # fmt: skip
    assert (code, said.split("\n")[-2]) == (130, "Interrupted.")
    assert listed(tmp_path) == ["endless.toml", "out"]
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["stopped"]


@pytest.mark.parametrize(
    ("module", "sent", "code", "told"),
    [("click", "SIGINT", 130, "Interrupted."), ("rich", "SIGTERM", 143, "Terminated.")],
)
def test_a_signal_during_the_imports_is_no_traceback(tmp_path, module, sent, code, told):
    """The first is imported before there is a command, the second inside one."""
    (tmp_path / f"{module}.py").write_text(f"import signal; signal.raise_signal(signal.{sent})")
    path = f"{tmp_path}{os.pathsep}{SOURCES}"
    with started(tmp_path, "scenes", PYTHONPATH=path, PYTHONDONTWRITEBYTECODE="1") as process:
        out, said = process.communicate(timeout=60.0)
    assert (process.returncode, out) == (code, "")
    assert said == ("" if module == "click" else f"\n{told}\n")


def test_a_signal_waits_until_all_files_are_in_their_place(tmp_path, monkeypatch):
    def interrupted(self, target, move=Path.replace):
        signal.raise_signal(signal.SIGTERM)
        move(self, target)

    def make():
        with together(tmp_path / "out") as made:
            (made / "lesson").mkdir()
            for name in ("a", "b", "lesson/c"):
                (made / name).write_text(name)

    monkeypatch.setattr(Path, "replace", interrupted)
    with raised(), pytest.raises(KeyboardInterrupt):
        make()
    assert sum(path.is_file() for path in tmp_path.rglob("*")) == 3


def test_a_signal_that_other_code_has_swallowed_ends_the_next_run():
    with raised():
        with suppress(BaseException):
            signal.raise_signal(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt):
            chutelab.simulate("stream", engine="contact")
    chutelab.simulate("perpendicular")


def test_what_is_ignored_or_of_another_program_is_left_alone():
    mine = signal.signal(signal.SIGTERM, lambda *_: None)
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with raised():
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGHUP)
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGTERM, mine)
        signal.signal(signal.SIGHUP, before)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize(
    "words",
    [
        "spoon", "two-sizes --engine pymunk", "inclined-conveyor --engine contact",
        "hopper --set stream.count=50 --set run.max_time=0.6",
        "dominoes --set run.until=0.25", "see-saw", "loop", "cradle",
        *(
            pytest.param(words, marks=pytest.mark.slow)
            for words in (
                "arch", "bucket-elevator", "dominoes", "flap-gate", "damper-plate",
                "domino-gate", "drum",
                "vibrating-feeder", "dominoes --engine pymunk", "see-saw --engine pymunk",
                "spoon --engine contact", "cascade", "two-sizes", "inclined-conveyor",
                "hopper", "hopper --engine pymunk", "heap", "rock-box", "stream",
                "hopper --set stream.count=50 --set run.max_time=0.6 --engine pymunk",
                "spoon --engine pymunk", "cascade --engine contact", "cascade --engine pymunk",
                "inclined-conveyor --engine pymunk",
            )
        ),
    ],
)  # fmt: skip
def test_shipped_scenes_keep_the_laws(words):
    assert re.search(r"\nall \d+ laws kept\n$", call(*words.split()).stdout)
