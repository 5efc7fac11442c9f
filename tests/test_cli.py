"""The command line: what it prints, what it writes, and how it ends."""

import csv
import json
import os
import re
import subprocess
import sys
from importlib import import_module
from io import StringIO
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import chutelab
from chutelab import scene as sc
from chutelab.cli import console, main
from chutelab.cli.options import retitled
from shared import call
from test_summary import TOP

SOURCES = str(Path(chutelab.__file__).parent.parent)
FILES = "events.csv lesson.gif overlay.png recording.npz summary.json trajectory.csv".split()  # noqa: SIM905


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.delenv("CHUTELAB_DEBUG", raising=False)


def refused(*arguments):
    """Call with something that cannot be used: nothing on standard output, nothing on disk."""
    before = sorted(Path().rglob("*"))
    result = call(*arguments, code=2)
    assert result.stdout == ""
    assert sorted(Path().rglob("*")) == before
    return result.stderr


def process(*arguments, **options):
    environment = {**os.environ, "PYTHONPATH": SOURCES, **options.pop("env", {})}
    return subprocess.Popen(
        [sys.executable, "-m", "chutelab", *arguments], stderr=subprocess.PIPE, text=True,
        env=environment, **{"stdout": subprocess.PIPE, **options},
    )  # fmt: skip


# run: what it prints


def test_a_learner_reads_no_rounding_no_engine_and_no_rounds():
    for scene in ("perpendicular", "belt-landing", "free-fall", "inclined-20"):
        text = call("run", scene).stdout
        assert re.search(r"^\d particles?, \d+ contacts?, computed in \S+ s$", text, re.MULTILINE)
        assert not re.search(r"engine|rounds|steps|turned over|residual|e-1\d|-0 ", text)
        assert "ledger cannot explain: 0.000 %" in text
    # Half a millisecond late at 2 m/s, 1 mm of 0.6 m and more: in percent, as errors are.
    plain = ("perpendicular", "--engine", "pymunk", "--set", "run.align=false", "--dt", "0.001")
    text = call("run", *plain).stdout
    percent = float(re.search(r"^max .* (\S+)$", text, re.MULTILINE)[1])
    worst = json.loads(call("run", *plain, "--json").stdout)["error"]["max"]
    assert percent == pytest.approx(100.0 * worst, abs=6e-4)
    assert percent > 0.05


def test_a_run_prints_particle_0_beside_the_theory_the_ledger_and_the_endings():
    result = call("run", "perpendicular", "--details")
    text = result.stdout
    assert result.stderr == ""
    assert "Perpendicular damping plate, 2 m/s\nengine exact, 1 particle, 2 contacts" in text
    assert "ended: 1 landed" in text
    # x2 = d1 - r, t2 = x2 / v, y2 = g t2² / 2; half of the normal velocity comes back.
    t2 = 0.5937 / 2.0
    y2 = 0.5 * 9.81 * t2**2
    for symbol, value in [("x2", 0.5937), ("t2", t2), ("y2", y2), ("v3x", 1.0), ("y3", 0.5)]:
        line = next(line for line in text.splitlines() if line.startswith(f"{symbol} "))
        simulated, theory, error = line.split()[-3:]
        assert simulated == theory == f"{value:.6g}"
        assert float(error) < 1e-14
    # The plate takes ½ m v² (1 - ε²).
    loss = 0.5 * 0.008 * 2.0**2 * (1.0 - 0.5**2)
    assert re.search(rf"^plate +0 +{loss:g} +0$", text, re.MULTILINE)
    assert re.search(r"^residual \S+e-1[6-9] J|^residual 0.0e\+00 J", text, re.MULTILINE)
    assert list(Path().iterdir()) == [], "without --out nothing is written"


def test_a_summary_fits_a_terminal_and_has_no_colours_in_a_pipe():
    leaning = ("--set", "plate.angle_deg=80", "--set", "outgoing.drop_from=top")
    for arguments in (
        ["run", "belt-landing"], ["tables"], ["scenes"], ["verify", "inclined-60"],
        ["check", "stream"], ["check", "free-fall"], ["check", "perpendicular", *leaning],
    ):  # fmt: skip
        text = call(*arguments).stdout
        assert max(map(len, text.splitlines())) <= 80
        assert "\x1b" not in text


def test_where_the_closed_form_ends_the_summary_says_why():
    text = call("run", "free-fall", "--details").stdout
    assert "\nNo closed form; outside the model: there is no incoming" in text
    assert "  theory  " not in text
    assert "ended: 5 settled" in text
    # Its way is told instead: by free fall down to the first ramp.
    assert re.search(r"^meets \S+( +\S+){5}$", text, re.MULTILINE)
    text = call("run", "perpendicular", "--set", "outgoing.length=0.1").stdout
    assert "\nNo closed form from here on; misses the outgoing belt: " in text


def test_a_changed_machine_does_not_go_by_the_bare_title():
    title = "Perpendicular damping plate, 2 m/s"
    changes = ["--set", "plate.angle_deg=5", "--set", "incoming.speed=3"]
    told = f"{title}; with plate.angle_deg=5, incoming.speed=3"
    assert call("run", "perpendicular", *changes).stdout.splitlines()[0] == told
    call("run", "perpendicular", *changes, "--out", "out", "--only", "npz")
    assert call("show", "out/recording.npz").stdout.splitlines()[0] == told
    # A solution of `solve --set` is a changed scene, changed once more.
    twice = retitled(retitled(sc.load("perpendicular"), ["gravity=3"]), ["plate.angle_deg=5"])
    assert twice.title == f"{title}; with gravity=3, plate.angle_deg=5"
    for same in (["--set", "run.engine=pymunk"], ["--dt", "0.001"], []):
        assert call("run", "perpendicular", *same).stdout.splitlines()[0] == title
    own = call("run", "perpendicular", *changes, "--set", "title=Ours").stdout
    assert own.splitlines()[0] == "Ours"


def test_settings_change_the_run():
    found = json.loads(call("run", "perpendicular", "--json", "--set", "plate.distance=0.3").stdout)
    assert found["impact"]["x"] == [pytest.approx(0.3937, rel=1e-15, abs=0.0)]
    # An option is the setting of its name.
    words = ("run", "perpendicular", "--json", "--set", "run.align=false", "--set", "run.until=0.3")
    coarse, fine, again = (
        json.loads(call(*words, *more).stdout) | {"seconds": 0.0}
        for more in (
            ("--engine", "pymunk"),
            ("--engine", "pymunk", "--dt", "4e-4"),
            ("--set", "run.engine=pymunk", "--set", "run.dt=0.0004"),
        )
    )
    assert fine["engine"] == "pymunk"
    assert fine["steps"] > 2 * coarse["steps"]
    assert again == fine


# run: an accuracy that is asked for


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "perpendicular", "--set", "incoming.speed=2,5"),
        ("sweep", "perpendicular", "--vary", "incoming.speed=2,5:3:2"),
        ("sweep", "perpendicular", "--uncertainty", "incoming.speed=2,5±0.1"),
        ("solve", "perpendicular", "--vary", "incoming.speed=2,5:3", "--target", "x3=1"),
        ("solve", "perpendicular", "--vary", "incoming.speed=1:3", "--target", "x3=2,5"),
    ],
)
def test_a_decimal_comma_is_answered_with_the_point(arguments):
    assert "write 2.5, with a decimal point" in refused(*arguments)


def test_the_papers_energy_and_power_are_marked_and_the_true_power_is_beside_them():
    text = call("run", "belt-landing").stdout
    # 200 of 8 g a second come back with ε v0 = 1 m/s, against a belt of v_b = 2 m/s.
    flow, belt, back = 200.0 * 0.008, 2.0, 1.0
    true = flow * belt * (belt + back)
    papers = 0.5 * flow * (back**2 + belt**2)
    assert re.search(rf"^P +the paper's power, Eq. \(15\), W +{papers:g} +{papers:g}", text, re.M)
    assert re.search(rf"^ +its power, to compare with P, W +{true:g} +{true:g} *$", text, re.M)
    assert "the paper's energy, Eq. (14), J" in text
    assert "Energy ledger until all have settled or left, J" in text
    assert "Energy ledger until the landing, J" in call("run", "perpendicular").stdout
    timed = call("run", "perpendicular", "--set", "run.until=0.7").stdout
    assert "Energy ledger until t = 0.7 s, J" in timed


@pytest.mark.parametrize(
    ("scene", "settings", "said", "usual"),
    [
        # m v_b (v_b - v_x)/3 and m v_b (v_b - v_x), with 8 g, 2 m/s and -1 m/s
        ("belt-landing", ["particle.spin=true", "outgoing.length=8"],
         "1 disk rolls on the outgoing belt without slip, instead of being carried. "
         "The belt work is 0.016 J; carried loads would take 0.048 J", []),
        # One layer, 1 ms apart, 6.3 ms to get out of the way, looked at each ms: 6 and 12 ms late.
        ("stream", ["stream.count=3", "stream.rate=1000", "stream.bed_height=0"],
         "2 particles waited for a free place to be released, 0.012 s at most", ["stream.count=3"]),
        ("stream", ["stream.count=20", "incoming.speed=0.7", "run.until=1.8"],
         "particles ride into others round the pulley, ", ["stream.count=3"]),
        # All are alike, and land at one place but for some 1e-16 m: rounding is no spread.
        ("slip", ["stream.count=20"], "landing.x, m 0.681305 0 ", None),
    ],
)  # fmt: skip
def test_a_run_says_what_is_not_as_usual(scene, settings, said, usual):
    def told(changes, *more):
        settings = [f"--set={change}" for change in changes]
        return " ".join(call("run", scene, *settings, *more).stdout.split())

    assert said in told(settings)
    assert said not in (told(settings, "--details") if usual is None else told(usual))


def test_an_accuracy_is_reported_in_text_json_and_file():
    text = call("run", "perpendicular", "--accuracy", "1mm").stdout
    said = text.partition("\nAccuracy\n")[2]
    assert said.startswith("error of places about ")
    assert "; asked for 1 mm, reached\nhow it is known: difference from the closed form\n" in said
    assert max(map(len, text.splitlines())) <= 80
    result = call("run", "slip", "--accuracy", "1e-6", "--json", "--out", "o", "--only", "json")
    found = json.loads(result.stdout)
    assert list(found) == TOP
    assert found["seconds"] > 0.0
    summary = json.loads(Path("o/summary.json").read_text(encoding="utf-8"))
    assert {**found, "seconds": None} == summary
    accuracy = found["accuracy"]
    assert (accuracy["asked"], accuracy["unit"], accuracy["met"]) == (1e-6, "relative", True)
    assert found["error"]["max"] <= accuracy["reached"] < 1e-11
    assert json.loads(call("run", "slip", "--json").stdout)["accuracy"] is None
    # One that is not reached ends with 1, and everything is written.
    result = call("run", "slip", "--accuracy", "1e-15", "--out", "o", "--only", "json", code=1)
    assert "asked for 1e-15, NOT REACHED" in " ".join(result.stdout.split())
    said = r"Error: the accuracy of 1e-15 was not reached; \S+e-1[34] was\n"
    assert re.fullmatch(said, result.stderr)
    assert not json.loads(Path("o/summary.json").read_text(encoding="utf-8"))["accuracy"]["met"]


# run: what it writes


def test_a_run_writes_the_whole_set():
    result = call("run", "perpendicular", "--out", "a/b/out", "--json")
    assert (result.stderr, result.stdout.count("\n")) == ("", 1)
    found = json.loads(result.stdout)
    known = chutelab.simulate("perpendicular").summary() | {"seconds": found["seconds"]}
    assert found == json.loads(json.dumps(known))
    assert list(found) == TOP
    out = Path("a/b/out")
    assert sorted(path.name for path in out.iterdir()) == FILES
    assert [path.name for path in Path().rglob(".*")] == [], "no unfinished files are left"

    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary == {**found, "seconds": None}
    with Image.open(out / "overlay.png") as picture:
        picture.load()
        assert picture.format == "PNG"
        assert picture.width >= 1000
    with Image.open(out / "lesson.gif") as film:
        assert film.format == "GIF"
        assert film.n_frames > 20
        assert (film.info["loop"], film.info["duration"]) == (0, 40)
    assert (out / "lesson.gif").stat().st_size < 400_000

    recording = chutelab.Recording.load(out / "recording.npz")
    assert recording.title == "Perpendicular damping plate, 2 m/s"
    with (out / "events.csv").open(encoding="utf-8", newline="") as file:
        events = list(csv.DictReader(file))
    assert [event["kind"] for event in events] == ["release", "separation", "impact", "landing"]
    assert float(events[2]["x"]) == found["impact"]["x"][0]
    with (out / "trajectory.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for row in (rows[7], rows[-1]):
        (position,), (velocity,) = (at[0] for at in recording.at([float(row["t"])]))
        assert [float(row[key]) for key in ("x", "y", "vx", "vy")] == [*position, *velocity]


@pytest.mark.slow
def test_a_table_of_very_many_events_is_written_if_it_is_asked_for(monkeypatch):
    monkeypatch.setattr("chutelab.cli.running.MOST_EVENTS", 3)  # it has 4
    monkeypatch.setattr(
        "chutelab.pictures.animation.animate", lambda _run, path, **_how: path.write_bytes(b"")
    )
    result = call("run", "perpendicular", "--out", "out")
    assert "lesson.gif, trajectory.csv, recording.npz, summary.json\n" in result.stdout
    said = "events.csv is left out: 4 events, about 0 MB; chutelab "
    asked = "show out/recording.npz --out out --only csv"
    assert f"{said}{asked} writes it\n" in result.stdout
    assert not Path("out/events.csv").exists()
    result = call(*asked.split())
    assert "wrote into out: events.csv, trajectory.csv\n" in result.stdout
    assert len(Path("out/events.csv").read_text(encoding="utf-8").splitlines()) == 5


def test_a_run_says_what_it_wrote_only_chooses_and_other_files_are_left():
    Path("out").mkdir()
    Path("out/notes.txt").write_text("mine", encoding="utf-8")
    Path("out/summary.json").write_text("old", encoding="utf-8")
    chosen = ["--only", "json", "--only", "npz,csv"]
    files = ["events.csv", "trajectory.csv", "recording.npz", "summary.json"]
    text = call("run", "perpendicular", "--out", "out", *chosen).stdout
    assert f"wrote into out: {', '.join(files)}\n" in text
    assert {path.name for path in Path("out").iterdir()} == {*files, "notes.txt"}
    assert Path("out/notes.txt").read_text(encoding="utf-8") == "mine"
    assert list(json.loads(Path("out/summary.json").read_text(encoding="utf-8"))) == TOP
    assert call("run", "perpendicular", "--quiet", "--out", "quiet", *chosen).output == ""


def test_a_destination_that_cannot_be_is_refused_before_the_run(monkeypatch):
    def never(*_arguments, **_options):
        raise AssertionError("the run began")

    monkeypatch.setattr("chutelab.engines.simulation.judged", never)
    Path("file").write_text("", encoding="utf-8")
    assert "--out file: cannot be written to: file is a file, not a folder" in refused(
        "run", "slip", "--out", "file"
    )
    assert "file is a file" in refused("run", "slip", "--out", "file/inside/it")
    assert "name of a folder is empty" in refused("run", "slip", "--out", "")
    Path("out/overlay.png").mkdir(parents=True)
    said = refused("run", "slip", "--out", "out")
    assert f"{Path('out/overlay.png')} is a folder, not a file" in said

    def denied(*_arguments, **_options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.mkdtemp", denied)
    said = refused("run", "slip", "--out", "new")
    assert "--out new: cannot be written to: Permission denied" in said


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--only", "png"], "give --out too"),
        (["--out", "out", "--only", "png,jpg"], "choose from png,gif,csv,npz,json"),
        (["--out", "out", "--only", ""], "choose from png,gif,csv,npz,json"),
        (["--engine", "box2d"], "'box2d' is not one of"),
        (["--dt", "soon"], "'soon' is not a valid float"),
        (["--dt", "0"], "run.dt = 0.0: "),
        (["--dt", "0"], "(from --dt 0)"),
        (["--set", "run.dt=0"], "(from --set run.dt=0)"),
        (["--dt", "nan"], "run.dt = nan: "),
        (["--set", "plate.angel_deg=3"], "plate.angle_deg?"),
        (["--set", "plate.distance=-1"], "(from --set plate.distance=-1)"),
        (["--set", "nonsense"], "must be KEY=VALUE"),
        (["--set", "particle.radius=0", "--engine", "pymunk"], "particle.radius"),
        (["--set", "stream.interact=true", "--set", "stream.count=2", "--engine", "exact"],
         "(from --engine exact)"),
        (["--set", "plate.angle_deg=89", "--out", "out"], "outgoing.drop_from"),
        (["--set", "plate.above=0", "--set", "plate.below=0.1", "--out", "out"], "plate.below"),
        (["--accuracy", "0"], "'0': must be a relative error from 1e-15 to 0.5"),
        (["--accuracy=-1"], "'-1': must be"),
        (["--accuracy", "nan"], "'nan': must be"),
        (["--accuracy", "5 parsecs"], "'5 parsecs': must be"),
        (["--accuracy", "1e-30", "--out", "out"], "'1e-30': must be"),
        (["--frames", "3"], "No such option"),
        (["--out", "out", "--format", "avi"], "'avi' is not one of 'gif', 'mp4', 'webm'"),
        (["--format", "mp4"], "give --out too"),
        (["--out", "out", "--only", "png", "--format", "gif"], "add gif to --only"),
        *((["--max-seconds", seconds], "--max-seconds") for seconds in ("0", "nan", "inf", "soon")),
        (["--max-seconds", "1", "--accuracy", "1mm"], "--accuracy"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)  # fmt: skip
def test_bad_options_are_refused(arguments, says):
    assert says in refused("run", "perpendicular", *arguments)


# what goes wrong


def test_no_such_scene_and_a_folder_end_with_2():
    assert "did you mean perpendicular" in refused("run", "perpendiculer")
    Path("folder").mkdir()
    assert "folder: a directory" in refused("run", "folder")
    assert "Missing argument 'SCENE'" in refused("run")


def test_a_failure_of_ours_ends_with_1_one_line_and_nothing_written(monkeypatch):
    def broken(*_arguments, **_options):
        raise ZeroDivisionError("two\nlines")

    monkeypatch.setattr("chutelab.results.storage.to_csv", broken)
    arguments = ("run", "perpendicular", "--out", "out", "--only", "csv,npz,json")
    result = call(*arguments, code=1)
    assert result.stdout == ""
    assert result.stderr.startswith("chutelab failed: ZeroDivisionError: two lines; please report")
    assert result.stderr.count("\n") == 1
    assert list(Path().iterdir()) == []
    for debugged in (
        CliRunner().invoke(main, ["--debug", *arguments]),
        CliRunner().invoke(main, arguments, env={"CHUTELAB_DEBUG": "1"}),
    ):
        assert isinstance(debugged.exception, ZeroDivisionError)

    def huge(*_arguments, **_options):
        raise MemoryError("Unable to allocate 9 TiB")

    monkeypatch.setattr("chutelab.engines.simulation.judged", huge)
    said = call("run", "perpendicular", code=1).stderr
    assert "not enough memory; fewer particles need less. (Unable to allocate" in said


def test_a_reader_that_has_gone_or_a_full_device_is_no_reason_for_a_traceback():
    """The code is that of a tool that SIGPIPE ends, as in `seq 99999 | head -1`."""
    with process("--debug", "schema") as writer:
        writer.stdout.close()
        assert writer.stderr.read() == ""
        assert writer.wait(timeout=60) == 128 + 13
    if Path("/dev/full").exists():
        with Path("/dev/full").open("w") as full, process("--help", stdout=full) as writer:
            said = writer.stderr.read()
        assert (writer.returncode, said) == (
            1, "chutelab failed: standard output: No space left on device\n"
        )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("x" * 300, "xxx...': File name too long"),
        ("a\0b", "'a\\x00b': no file can have this name"),
        ("\ud800", "'\\ud800': no file can have this name"),
        ("d/" * 1000, "more than 200 folders deep"),
    ],
)
@pytest.mark.parametrize(
    "arguments",
    [
        "run slip --out", "live slip -o", "sweep slip --vary plate.angle_deg=0,1 --plot",
        "compare slip --data", "show", "new", "lesson show", "lesson new", "lesson page -o",
        "lesson grade",
    ],
)  # fmt: skip
def test_a_name_that_no_file_can_have_is_refused(arguments, name, says):
    assert says in refused(*arguments.split(), name)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="there is no /proc")
@pytest.mark.parametrize(
    "arguments",
    [
        "run slip --out /proc/x", "sweep slip --vary incoming.speed=1,2 --out /proc/x.csv",
        "sweep slip --vary incoming.speed=1,2 --plot /proc/x.png",
        "sweep slip --uncertainty incoming.speed=2±0.1 --plot /proc/x.png",
        "live slip -o /proc/x.html",
        "solve slip --vary incoming.speed=1:2 --minimize belt_work --out /proc/x",
        "compare slip --data perpendicular-track --out /proc/x", "bench slip --out /proc/x",
        "figure 6 --out /proc/x", "lesson build 1 --force --out /proc/x",
        "lesson page 1 -o /proc/x", "lesson new /proc/x",
        "lesson grade mine.ipynb --out /proc/x.csv", "new /proc/x.toml",
    ],
)  # fmt: skip
def test_what_cannot_be_written_to_is_refused_before_the_work(arguments, monkeypatch):
    """Nothing is simulated, searched, drawn or marked."""
    Path("mine.ipynb").write_text("{}", encoding="utf-8")

    def worked(*_arguments, **_options):
        pytest.fail("the work has begun")

    works = (
        "engines.simulation.judged", "studies.sweep.swept_by", "studies.sweep.sweep_to",
        "studies.design.uncertainty", "studies.design.minimize", "studies.measured.residuals",
        "checks.workprecision.measure", "pictures.live.html", "classroom.grading.grade",
        "pictures.plots.paper_figure", "classroom.lessons.building.judged",
        "classroom.lessons.pages._lesson",
    )  # fmt: skip
    # All imported first: one that is imported later would keep what stands for another's.
    modules = [import_module(f"chutelab.{work.rpartition('.')[0]}") for work in works]
    for module, work in zip(modules, works, strict=True):
        monkeypatch.setattr(module, work.rpartition(".")[2], worked)
    said = refused(*arguments.split())
    name = next(word for word in arguments.split() if word.startswith("/proc"))
    assert re.fullmatch(rf"Error: .*{name}\S*: cannot be written.*: No such file .*\n", said)


def test_a_pipe_without_a_writer_is_not_waited_for():
    os.mkfifo("pipe")
    assert "pipe: cannot be read: it is a pipe, not a file" in refused("run", "pipe")
    assert "it is a pipe, not a file" in refused("compare", "slip", "--data", "pipe")


# progress


class Terminal(StringIO):
    def isatty(self):
        return True


def test_a_bar_appears_on_a_terminal_once_patience_is_over(monkeypatch, capsys):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(console, "PATIENCE", 0.0)
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with console.progress("simulating") as update:
        assert update is not None
        for share in np.linspace(0.0, 1.0, 50):
            update(float(share))
    assert "simulating" in terminal.getvalue()
    assert capsys.readouterr().out == ""
    # None for what is over soon, is to be quiet or goes into a pipe.
    monkeypatch.undo()
    for stream, options, told in ((Terminal(), {}, True), (Terminal(), {"quiet": True}, False),
                                  (StringIO(), {}, False)):  # fmt: skip
        monkeypatch.setattr(sys, "stderr", stream)
        with console.progress("simulating", **options) as update:
            assert (update is not None) is told
            if told:
                update(0.5)
        assert stream.getvalue() == ""


# the other commands


def table_of(text):
    """Rows of two columns: name and what; lines go on below."""
    rows = {}
    for line in text.splitlines():
        found = re.fullmatch(r"  (\S.*?)  +(\S.*?) *", line)
        if found:
            rows[name := found[1]] = found[2]
        elif line.startswith("   "):
            rows[name] += f" {line.strip()}"
    return rows


def test_check_says_what_will_happen():
    text = call("check", "perpendicular").stdout
    assert text.startswith("perpendicular: Perpendicular damping plate, 2 m/s\nbuilt\n")
    headings = re.findall(r"^\S.*", text, re.MULTILINE)
    assert headings[1:] == ["built", "skipped", "how it runs", "closed form"]
    # The belt is d2 + r below the impact, the plate ends 0.05 m above the belt.
    belt = 0.1063 - 0.5 * 9.81 * 0.29685**2 - 0.5 - 0.0063
    said = table_of(text)
    assert said["outgoing"] == f"from (-2, {belt:.6g}) to (4, {belt:.6g}) m, moving at 2 m/s"
    assert said["surfaces"] == "the scene has no [[surface]]"
    assert said["engine"] == "exact: a single particle meets only surfaces"
    assert said["ends"].endswith("at most at t = 30 s")
    assert said["contacts"] == "about 2"
    assert said["run time"].startswith("about ")
    assert said["covers"].startswith("phi1, v1, t2, x2, ")
    assert said["covers"].endswith("v3, d3, dEk, P, belt_work, slip_heat")
    assert "warning" not in text
    said = table_of(call("check", "stream").stdout)
    assert said["engine"].startswith("contact: particles meet each other, ")
    assert said["tunnelling"] == "none at any speed: impacts are found at their own times"
    assert said["leaves out"] == "all of it"
    assert "at t = 0.7 s" in call("check", "slip", "--set", "run.until=0.7").stdout


def test_check_warns_and_says_what_to_change():
    settings = ["outgoing.drop=0.15", "outgoing.drop_from=top", "plate.below=0.45"]
    arguments = ["check", "perpendicular", *(f"--set={setting}" for setting in settings)]
    text = call(*arguments).stdout
    said = table_of(text.partition("\nwhat to mind\n")[2])
    assert said["warning"] == "outgoing: it crosses the drive pulley"
    assert said["change"] == "outgoing.drop = 0.223"
    (found,) = json.loads(call(*arguments, "--json").stdout)["scenes"]
    keys = "scene title built skipped engine why ends stepping effort theory advice"
    assert " ".join(found) == keys
    assert found["advice"][-1:] == [{**said, "settings": {"outgoing.drop": 0.223}}]
    settings = ["run.engine=pymunk", "run.align=false", "run.dt=0.01"]
    text = call("check", "perpendicular", *(f"--set={setting}" for setting in settings)).stdout
    passing = "at 4.39 m/s a particle covers 43.9 mm in a step"
    assert table_of(text)["tunnelling"].startswith(f"POSSIBLE: {passing}")
    assert table_of(text)["warning"].startswith("a particle covers 43.9 mm in a step")


def test_check_goes_through_all_scenes_before_it_refuses():
    Path("bad.toml").write_text("[incoming]\nspeed = -1\n", encoding="utf-8")
    result = call("check", "bad.toml", "slip", "nowhere", code=2)
    assert result.stdout.startswith("slip: ")
    assert "built" in result.stdout
    assert "incoming.speed = -1" in result.stderr
    assert "incoming.pulley_radius is missing" in result.stderr
    assert "nowhere: no such file" in result.stderr


def test_the_tables_agree_as_printed_and_mark_what_differs():
    text = call("tables").stdout
    assert re.findall(r"^Table (\d)", text, re.MULTILINE) == ["1", "3", "4", "5"]
    assert text.count("\n0 of ") == 3
    assert "Not reproducible" in text
    assert text.count("*") == 4
    first = call("tables", "1").stdout
    assert call("tables", "1", "--as-printed").stdout == first
    (table,) = json.loads(call("tables", "4", "--json").stdout)["tables"]
    assert (table["number"], table["cells"], table["differing"]) == (4, 66, 0)
    assert "'2' is not one of" in refused("tables", "2")
    assert "*" not in first
    assert re.search(r"^v0 = 2 m/s, R = 0.0500 m +0.550 0.550 +0.371 0.371 +0.137 0.137", first,
                     re.MULTILINE)  # fmt: skip
    corrected = call("tables", "1", "--corrected").stdout
    assert corrected.count("*") == 22
    assert "0.137 0.146*" in corrected
    assert "0.548 0.420*" in corrected


def test_scenes_lists_names_titles_and_what_to_look_at():
    text = call("scenes").stdout
    found = json.loads(call("scenes", "--json").stdout)["scenes"]
    assert [scene["name"] for scene in found] == list(sc.shipped())
    for scene in found:
        assert re.search(rf"^{scene['name']} +{re.escape(scene['title'][:30])}", text, re.MULTILINE)
        assert scene["look"][0][:30] in text
        assert len(scene["look"]) == 3


def test_new_writes_a_scene_that_runs_and_overwrites_nothing():
    result = call("new", "my.toml")
    assert result.stdout == "wrote my.toml; run it with: chutelab run my.toml\n"
    assert "ended: 1 landed" in call("run", "my.toml").stdout
    text = Path("my.toml").read_text(encoding="utf-8")
    assert call("new", "-").stdout == text
    Path("my.toml").write_text("mine", encoding="utf-8")
    assert "my.toml is there already; --force overwrites it" in refused("new", "my.toml")
    assert Path("my.toml").read_text(encoding="utf-8") == "mine"
    call("new", "my.toml", "--force")
    assert Path("my.toml").read_text(encoding="utf-8") == text
    call("new")
    assert Path("scene.toml").read_text(encoding="utf-8") == text
    Path("folder").mkdir()
    assert "folder is a folder" in refused("new", "folder")
    assert "cannot be written: there is no folder nowhere" in refused("new", "nowhere/my.toml")


def test_show_prints_the_summary_of_the_run_and_makes_its_files_again():
    ran = call("run", "perpendicular", "--out", "out", "--only", "npz,json").stdout
    shown = call("show", "out/recording.npz").stdout
    ran = ran.replace("wrote into out: recording.npz, summary.json\n", "")
    assert shown == re.sub(r"(contacts), computed in \S+ s$", r"\1", ran, flags=re.MULTILINE)
    assert shown != ran
    summary = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    assert json.loads(call("show", "out/recording.npz", "--json").stdout) == summary
    call("show", "out/recording.npz", "--out", "again", "--only", "csv,json,npz")
    assert json.loads(Path("again/summary.json").read_text(encoding="utf-8")) == summary
    assert Path("again/trajectory.csv").read_text(encoding="utf-8").startswith("t,particle,x,y")


def test_show_says_what_was_probably_meant():
    said = refused("show", "perpendicular")
    advice = "show takes a recording.npz; for a scene: chutelab run "
    assert said == f"Error: perpendicular: no such file; {advice}perpendicular\n"
    Path("mine.toml").write_text("", encoding="utf-8")
    assert f"; {advice}mine.toml\n" in refused("show", "mine.toml")
    Path("out").mkdir()
    assert "did you mean" not in refused("show", "out")
    Path("out/recording.npz").write_bytes(b"")
    assert f"; did you mean {Path('out/recording.npz')}?\n" in refused("show", "out")
    assert "chutelab run" not in refused("show", "nowhere.npz")


def test_verify_finds_what_is_expected_and_the_answers_in_agreement():
    text = call("verify", "perpendicular-fast").stdout
    assert text.startswith("perpendicular-fast: Perpendicular damping plate, 4 m/s\n")
    # Under each quantity and its source a line for each answer, ending in a verdict.
    row = r"  (exact|contact|pymunk|theory) +(\S+) +(\S+) +(\S+(?: mm)?) +(\S+(?: mm)?)  ok$"
    part = text.partition("\nd3, m: Table 5: R = 0.1 m, d_okr = 0.5 m\n")[2]
    found = re.findall(row, part.partition("\nx3")[0], re.MULTILINE)
    height = 0.5 * 9.81 * 0.148425**2 + 0.5
    assert [answer[0] for answer in found] == ["exact", "contact", "pymunk", "theory"]
    for _, expected, simulated, error, tolerance in found:
        assert (float(expected), tolerance) == (0.61, "5 mm")
        assert float(simulated) == pytest.approx(height, rel=1e-7)
        assert error == f"{1e3 * (0.61 - height):.1f} mm"
    pairs = re.findall(r"(\S+ - (?:exact|theory)): .+? +(\S+) +(\S+)  ok$", text, re.MULTILINE)
    assert len(pairs) == 7  # four answers with the theory, three with exact
    assert all(float(row[1]) <= float(row[2]) for row in pairs)
    known = {"exact": 1e-12, "dop853": 1e-12, "contact": 1e-10, "pymunk": 1e-9}
    for pair, _, tolerance in pairs:
        assert 1.0 <= float(tolerance) / known[pair.split()[0]] < 2.0
    assert re.search(r"^theory +closed form, NumPy +nothing, not even the machine *$", text, re.M)
    assert "FAILED" not in text
    assert text.endswith("relative where they have no unit.\nall within the tolerance\n")
    assert max(map(len, text.splitlines())) <= 80


def test_verify_ends_with_1_when_a_scene_shows_something_else():
    text = sc.shipped()["perpendicular-fast"].read_text(encoding="utf-8")
    Path("other.toml").write_text(text.replace("value = 0.61", "value = 0.62"), encoding="utf-8")
    said = call("verify", "other.toml", code=1).stdout
    assert re.findall(r"^  (\S+) .* 12 mm +5 mm  FAILED$", said, re.MULTILINE) == [
        "exact", "contact", "pymunk", "theory",
    ]  # fmt: skip
    assert said.endswith("4 outside the tolerance\n")
    found = json.loads(
        call("verify", "other.toml", "inclined-60", "--jobs", "1", "--json", code=1).stdout
    )
    assert found["failures"] == 4
    other, inclined = found["scenes"]
    assert list(other) == ["scene", "title", "expectations", "agreement", "skipped"]
    keys = "quantity unit source engine expected simulated error tolerance relative holds"
    assert " ".join(other["expectations"][0]) == keys
    wrong = [row for row in other["expectations"] if not row["holds"]]
    assert [(row["quantity"], row["expected"]) for row in wrong] == [("d3", 0.62)] * 4
    assert all(row["holds"] for row in inclined["expectations"])
    keys = "pair quantity difference tolerance least holds"
    assert " ".join(inclined["agreement"][0]) == keys


def test_verify_says_what_cannot_be_compared():
    Path("point.toml").write_text(
        "[incoming]\nspeed = 2\npulley_radius = 0.1\n[plate]\ndistance = 0.5\n"
        "[outgoing]\ndrop = 0.5\n[particle]\nradius = 0\n",
        encoding="utf-8",
    )
    assert (
        "pymunk: left out: must be more than 0 with run.engine"
        in call("verify", "point.toml").stdout
    )
    assert "nowhere: no such file" in refused("verify", "nowhere")
    text = call("verify", "free-fall").stdout
    assert "exact - theory: outside the model: there is no incoming conveyor" in text


# the command itself


def test_help_lists_the_commands():
    text = call("--help").stdout
    commands = re.findall(r"^  ([a-z]+)  ", text.partition("Commands:")[2], re.MULTILINE)
    assert " ".join(commands) == (
        "run live check show sweep solve compare discharge field report lesson figure tables "
        "scenes materials quantities new schema verify stress bench"
    )
    assert call("--version").stdout == f"chutelab {chutelab.__version__}\n"
    schema = json.loads(call("schema").stdout)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert call("-h").stdout == text
    for command in commands:
        assert call(command, "--help").stdout.startswith(f"Usage: main {command} ")


def test_options_and_docstrings_name_the_same():
    """What a docstring tells of an option is of one that is there, and each option is told."""

    def commands(group):
        for one in group.commands.values():
            yield from commands(one) if isinstance(one, click.Group) else [one]

    for command in commands(main):
        options = [one for one in command.params if isinstance(one, click.Option)]
        names = {name for one in options for name in (*one.opts, *one.secondary_opts)}
        assert all(one.help for one in options)
        told = re.findall(r"^    (-[^\n]*?)  ", command.callback.__doc__, re.MULTILINE)
        assert {name for form in told for name in re.findall(r"--?[a-z][\w-]*", form)} <= names
        assert not re.search(r"^-.*?  ", command.help, re.MULTILINE)


def test_shells_complete_scenes_and_kinds():
    def completed(*words):
        env = {
            "_CHUTELAB_COMPLETE": "bash_complete",
            "COMP_WORDS": " ".join(["chutelab", *words]),
            "COMP_CWORD": str(len(words)),
        }
        code = "from chutelab.cli import main; main(prog_name='chutelab')"
        return subprocess.run(
            [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": SOURCES, **env},
            capture_output=True, text=True, check=False, timeout=60,
        ).stdout.split()  # fmt: skip

    expected = ["plain,perpendicular", "plain,perpendicular-fast", "file,perp"]
    assert sorted(completed("run", "perp")) == sorted(expected)
    assert completed("run", "slip", "--only", "png,c") == ["plain,png,csv"]
    assert completed("materials", "g") == ["plain,gravel", "plain,glass"]


def test_a_run_that_takes_too_long_ends_with_what_is_recorded():
    """Exit code 0; tables, JSON and `show` say that it was stopped, and the files are all there."""
    # Places are drawn before the run begins, a million looks at a time: a time that is over by then
    # is refused.
    many = ("--set", "stream.count=5000", "--set", "stream.rate=5000")
    assert "stream.count = 5000" in refused("run", "stream", *many, "--max-seconds", "1e-9")
    flat = ("--set", "stream.bed_height=0")
    files = ["overlay.png", "recording.npz", "summary.json"]
    run = (
        "run",
        "stream",
        *flat,
        "--max-seconds",
        "1e-9",
        "--out",
        "out",
        "--only",
        "png,npz,json",
    )
    text = " ".join(call(*run).stdout.split())
    assert re.search(r"ended: 200 stopped .* STOPPED before the end, with \d+ particles", text)
    assert re.search(r"under way and 1\d\d", text)
    assert sorted(path.name for path in Path("out").iterdir()) == files
    told = json.loads(Path("out/summary.json").read_text())
    assert told["ended"]["reason"] == 200 * ["stopped"]
    assert told["stopped"]["particles"] + told["stopped"]["unreleased"] == 200
    lasted = re.search(r", computed in [-\d.e]+ s(?= ended)", text)[0]  # what no recording tells
    assert " ".join(call("show", "out/recording.npz").stdout.split()) in text.replace(lasted, "")
    assert json.loads(call("run", "perpendicular", "--json").stdout)["stopped"] is None


def test_a_trajectory_that_had_to_be_thinned_says_so(monkeypatch):
    run = ("run", "free-fall", "--out", "out", "--only", "csv")
    assert "instants" not in call(*run).stdout
    monkeypatch.setattr("chutelab.results.storage.MOST_ROWS", 60)
    said = "trajectory.csv has 20 instants, not 200: with more it would have over 60 rows\n"
    assert call(*run).stdout.endswith(said)
    assert call(*run, "--json").stderr == said
    assert call(*run, "-q").stdout == call(*run, "-q").stderr == ""
