"""Lessons 10 and 11: grains in a slot and in a heap do what the explanations say."""

import re
from math import atan, cos, sin

import numpy as np
import pytest
from click.testing import CliRunner

from chutelab.classroom.lessons import scene_of
from chutelab.classroom.lessons.sheets import sheet
from chutelab.classroom.lessons.texts import without_tex
from chutelab.cli import main
from chutelab.engines.simulation import simulate
from chutelab.results import Kind, Recording
from chutelab.scene import from_dict
from shared import find

SEEDS = range(10)


def explained(number):
    return " ".join(without_tex(sheet(find(number), "explanation")).split())


# The hopper


def bin_of(width, seed=0, *settings):
    """Run the bin with a slot of this width, m."""
    slot = (f"surface.slider.from=[{round(width - 0.018, 6)}, 0.0]", f"stream.seed={seed}")
    return simulate(scene_of(find(10), "slot.toml", (*slot, *settings)))


def quarters(recording):
    """When a quarter, half and three quarters of those that fell out had done so, s."""
    left = np.sort(recording.select(Kind.EXIT)["t"])
    return [float(left[int(np.ceil(k * len(left) / 4)) - 1]) for k in (1, 2, 3)]


def flow(recording):
    """Disks a second between a quarter and three quarters; NaN of a bin that did not run out."""
    if len(recording.select(Kind.EXIT)) < recording.count:
        return np.nan
    first, _, last = quarters(recording)
    return 0.5 * recording.count / (last - first)


@pytest.mark.slow
def test_the_summary_says_when_quarters_fell_out(tmp_path):
    told = ["run", str(find(10).folder / "slot.toml"), "--set", "stream.count=60"]
    told += ["--out", str(tmp_path), "--only", "npz"]
    said = " ".join(CliRunner().invoke(main, told).output.split())
    emptied = Recording.load(tmp_path / "recording.npz")
    found = re.search(
        r"(\d+) fell out of the machine: a quarter by ([\d.]+) s, half by ([\d.]+) s, three"
        r" quarters by ([\d.]+) s, the last at ([\d.]+) s\.",
        said,
    )
    times = [float(text) for text in found.groups()[1:]]
    assert int(found[1]) == emptied.count == 60
    ends = np.sort(emptied.select(Kind.EXIT)["t"])
    assert times == pytest.approx([*quarters(emptied), ends[-1]], abs=5.001e-4)
    assert "fell out" not in CliRunner().invoke(main, ["run", "free-fall"]).output


@pytest.mark.slow
def test_disks_run_nearly_as_fast_to_the_end():
    """A tank of water, whose level falls by as much, would take (√¾ - √½) / (√½ - √¼) for it.

    That is the time of the third quarter over that of the second. Of one bin it scatters by 0.16.
    """
    times = [
        quarters(simulate(scene_of(find(10), "slot.toml", (f"stream.seed={seed}",))))
        for seed in range(1, 61)
    ]
    shares = np.array([(last - half) / (half - first) for first, half, last in times])
    error = shares.std(ddof=1) / len(shares) ** 0.5
    assert "takes a tenth longer than the second" in explained(10)
    assert shares.mean() == pytest.approx(1.1, abs=2.0 * error)
    assert "a tank of water would take a third longer" in explained(10)
    water = (0.5**0.5 - 0.25**0.5) / (0.75**0.5 - 0.5**0.5)
    assert shares.mean() + 3.0 * error < water


@pytest.mark.slow
def test_flows_are_those_of_the_table_and_grow_as_the_law_says():
    table = re.findall(r"\| (\d+) \| (\d+) ± (\d+) \| (\d+) \|", explained(10))
    widths, roots = [], []
    for width, mean, spread, root in table:
        flows = np.array([flow(bin_of(int(width) / 1000.0, seed)) for seed in SEEDS])
        held = int(np.isnan(flows).sum())
        assert held == {"24": 5, "30": 1}.get(width, 0)
        assert f"{np.nanmean(flows):.0f}" == mean
        assert np.nanstd(flows) == pytest.approx(float(spread), abs=0.51)
        widths.append(float(width))
        roots.append(float(root))
    assert "five of ten bins did not run out; through 30 mm one of ten." in explained(10)
    rise, begin = np.polyfit(widths, roots, 1)
    assert f"meets the axis at about {-begin / rise:.0f} mm" in explained(10)
    # The power that fits best, with the same loss at the edges, is 3/2 within its scatter.
    power = np.polyfit(np.log(np.array(widths) + begin / rise), 1.5 * np.log(roots), 1)[0]
    assert power == pytest.approx(1.5, abs=0.1)


@pytest.mark.slow
def test_a_fuller_bin_flows_alike_and_smooth_disks_form_no_arch():
    less = [flow(bin_of(0.036, seed)) for seed in SEEDS]
    more = [flow(bin_of(0.036, seed, "stream.count=360")) for seed in SEEDS]
    # Half as many again would be 1.5 of what there was, if it grew with what lies above.
    error = np.hypot(np.std(less), np.std(more)) / np.sqrt(len(SEEDS) - 1)
    assert abs(np.mean(more) - np.mean(less)) < 2.0 * error
    assert error < 0.05 * np.mean(less)
    for seed in SEEDS:
        assert not np.isnan(flow(bin_of(0.024, seed, "stream.friction=0")))


# The heap


def heap(seed=0, *settings):
    return simulate(scene_of(find(11), "heap.toml", (f"stream.seed={seed}", *settings)))


def flanks(recording):
    """Angles of the right and left flank, degrees: a line along the highest points between 15 and
    85 % of the heap's height, in strips of 12 mm."""
    place = recording.ends()[1]["position"]
    lies = place[:, 1] > 0.0
    x, top = (
        place[lies, 0],
        place[lies, 1] + np.broadcast_to(recording.particle.radius, lies.shape)[lies],
    )
    angles = []
    for side in (1.0, -1.0):
        strip = np.floor(side * (x - x.mean()) / 0.012).astype(int)
        found = [(n, top[strip == n].max()) for n in np.unique(strip[strip >= 0])]
        n, high = np.array(found).T
        flank = (high > 0.15 * high.max()) & (high < 0.85 * high.max())
        fall = np.polyfit(0.012 * n[flank], high[flank], 1)[0] if flank.sum() > 1 else np.nan
        angles.append(float(np.degrees(np.arctan(-fall))))
    return angles


def test_a_heap_stands_and_all_of_it_lies_still():
    # Settled is less: no contact slips or closes by 1e-3 m/s. A second later all sleep.
    poured = heap(0, "run.until=3.5")
    assert len(poured.select(Kind.EXIT)) == 0
    assert 10.0 < np.mean(flanks(poured)) < 40.0
    assert not poured.ends()[1]["velocity"].any()


@pytest.mark.parametrize(("slope", "moves"), [(0.29, False), (0.31, True)])
def test_a_single_disk_rolls_from_a_slope_of_c_on(slope, moves):
    angle, r = atan(slope), 0.005
    along, away = np.array([cos(angle), sin(angle)]), np.array([-sin(angle), cos(angle)])
    board = from_dict({
        "particle": {"radius": r, "spin": True, "rolling_friction": 0.3},
        "surface": [{"name": "board", "from": (-along).tolist(), "to": along.tolist(),
                     "restitution": 0.0, "friction": 0.5}],
        "stream": {"at": (r * away).tolist(), "velocity": [0.0, 0.0]},
        "run": {"until": 1.0},
    })  # fmt: skip
    track = simulate(board).track(0)
    went = np.hypot(*(track["position"][-1] - track["position"][0]))
    # Rolling, it gains (2/3) g (sin α - c cos α) a second.
    expected = 0.5 * 2.0 / 3.0 * 9.81 * (sin(angle) - 0.3 * cos(angle)) if moves else 0.0
    assert went == pytest.approx(expected, rel=1e-3, abs=1e-6)


@pytest.mark.slow
def test_angles_of_heaps_are_as_the_explanation_says():
    """Means of 25 heaps have a standard error of 1 degree at most: so well they are told.

    Heights are compared in the means of 60.
    """

    def poured(*settings, count=25):
        heaps = [heap(seed, *settings) for seed in range(count)]
        angles = np.mean([flanks(one) for one in heaps], axis=1)
        assert np.std(angles) / np.sqrt(count - 1.0) <= 1.0
        heights = [one.ends()[1]["position"][:, 1].max() for one in heaps]
        return np.mean(angles), np.std(angles), np.mean(heights)

    def told(text):
        (number,) = re.findall(text.replace("N", r"(\d+)"), explained(11))
        return pytest.approx(float(number), abs=1.0)

    usual, spread, _ = poured()
    assert poured("particle.rolling_friction=0.1")[0] == told("a heap of N° or so")
    assert usual == told("with 0.3 one of N°")
    assert poured("particle.rolling_friction=0.8")[0] == told("with 0.8 one of N°")
    slides = poured("stream.friction=0.2", "surface.floor.friction=0.2")
    assert slides[0] == told("a heap has some N°")
    assert spread == told("scatters by N° or so from seed to seed")
    usual, _, height = poured(count=60)
    half = poured("stream.count=75", count=60)
    assert half[0] == told("The smaller ones have N°")
    assert poured("stream.count=75", "stream.rate=40")[0] == told("half as fast they have N°")
    # Triangles of area A have the height √(A tan α).
    assert half[2] / height == pytest.approx(
        np.sqrt(0.5 * np.tan(np.radians(half[0])) / np.tan(np.radians(usual))), abs=0.03
    )
    assert 100.0 * half[2] / height == told("and N % of the height")


@pytest.mark.slow
def test_about_half_of_the_disks_that_roll_freely_leave_the_floor():
    assert "About half of them roll off the floor" in explained(11)
    heaps = [heap(seed, "particle.rolling_friction=0") for seed in range(20)]
    gone = [len(one.select(Kind.EXIT)) / one.count for one in heaps]
    assert np.mean(gone) == pytest.approx(0.5, abs=0.06)
    assert np.std(gone) / 19.0**0.5 < 0.04
