"""Loads: what surfaces bear, against forces by hand, closed forms, and the momentum of all."""

import csv
import json
import tracemalloc
from itertools import pairwise
from math import cos, radians, sin

import numpy as np
import pytest

import chutelab
from chains import tables
from chutelab.checks import stress as laws
from chutelab.checks.agreement import verify
from chutelab.checks.stress import Evidence
from chutelab.results import Recording
from chutelab.results.loads import Bins
from chutelab.scene import SceneError
from chutelab.util.errors import InputError
from shared import call

G = 9.81
ENGINES = ("exact", "contact", "pymunk")


def balance(run):
    return laws.loads(Evidence(run))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scene", ["perpendicular", "slip", "two-sizes", "inclined-conveyor"])
def test_impulses_are_the_change_of_momentum_less_the_weight(scene, engine):
    verdict = balance(chutelab.simulate(scene, engine=engine, loads=0.01))
    assert verdict.holds, verdict
    assert verdict.bound == 1e-9


@pytest.mark.parametrize("engine", ["contact", pytest.param("pymunk", marks=pytest.mark.slow)])
def test_so_they_are_in_a_crowd_that_rides_collides_and_settles(engine):
    run = chutelab.simulate("stream", {"stream.count": 60, "run.loads": 0.01}, engine=engine)
    assert balance(run).holds
    run.impulses.flags.writeable = True
    run.impulses["force"][70, 2] += 1e-7
    assert not balance(run).holds


@pytest.mark.parametrize("seed", [1988, 2676, 2721])
def test_what_rests_in_a_wedge_that_locks_presses_no_harder_with_time(seed):
    """Statics leaves open how hard both walls press, but at rest nothing changes: not the forces,
    which balance the weight and can be a few times as large, nor the energy lost."""
    drawn = tables(seed)
    drawn["run"] |= {"until": 1.6, "loads": 0.1}
    run = chutelab.simulate(drawn, engine="contact")
    loads = [run.loads(row["name"]) for row in drawn["surface"]]
    held = [load for load in loads if load.normal[14] > 0.0]
    assert len(held) == 2
    mass, gravity = drawn["particle"]["mass"], drawn["gravity"]
    weight = mass * gravity
    assert sum(load.force[14] for load in held) == pytest.approx([0.0, -weight], abs=1e-6 * weight)
    for load in held:
        assert load.normal[14] == pytest.approx(load.normal[10], rel=0.01)
        assert load.normal[14] < 10.0 * weight
    lost, y = run.by_surface[:, 1:], run.at([0.0, 1.6])[0][:, 0, 1]
    brought = 0.5 * mass * np.square(drawn["stream"]["velocity"]).sum()
    assert lost.min() >= -1e-9
    assert lost.sum() == pytest.approx(brought + weight * (y[0] - y[-1]), rel=0.01)


def test_a_wedge_takes_as_much_of_what_falls_into_it_in_a_quarter_of_the_step():
    """Once both walls touch a disk, it leaves neither: the other one presses it there."""
    lost = [
        chutelab.simulate(tables(1159), {"run.dt": dt}, engine="contact").by_surface[:, 1:]
        for dt in (1e-3, 0.25e-3)
    ]
    assert lost[0] == pytest.approx(lost[1], rel=0.01)


def test_what_a_disk_in_a_hollow_never_touches_takes_nothing_from_it():
    """The outside of p4 goes on from the other side of a hollow 56 µm wider than the disk."""
    drawn = tables(559)
    run = chutelab.simulate(drawn, engine="contact")
    (p4,) = (row for row in drawn["surface"] if row["name"] == "p4")
    away = np.linalg.norm(run.knots["position"] - p4["center"], axis=1)
    assert (away - p4["radius"] - drawn["particle"]["radius"]).min() > 0.0
    lost = dict(zip(run.surfaces, run.by_surface[:, 1:], strict=False))
    assert lost["p4"].tolist() == [0.0, 0.0]


def test_a_disk_close_to_an_end_falls_freely():
    """It rolls up on one end of a slot, 1.4 µm away from the other, and back. In the slot, where it
    touches neither end, the second difference of its places is that of a free fall."""
    drawn = tables(726)
    (arc,) = drawn["surface"]
    angles = np.radians([arc["from_deg"], arc["to_deg"]])
    ends = arc["radius"] * np.column_stack([np.cos(angles), np.sin(angles)])
    run = chutelab.simulate(drawn, {"run.dt": 1e-3 / 64}, engine="contact")
    tau = 1e-5
    times = np.arange(0.1, 0.2, tau)
    places = run.at(times)[0][:, 0]
    gaps = np.linalg.norm(places[:, None] - ends, axis=2) - drawn["particle"]["radius"]
    at = np.degrees(np.arctan2(places[:, 1], places[:, 0])) % 360.0
    in_slot = (arc["to_deg"] - 360.0 < at) & (at < arc["from_deg"])
    clear = in_slot & (gaps.min(axis=1) > 5e-8)
    apart = clear[:-2] & clear[1:-1] & clear[2:]
    pulled = (places[2:] - 2.0 * places[1:-1] + places[:-2])[apart] / tau**2
    assert len(pulled) > 10
    assert pulled == pytest.approx(np.tile([0.0, -G], (len(pulled), 1)), abs=1e-6)


@pytest.mark.parametrize("engine", ENGINES)
def test_counting_loads_changes_no_bit_of_a_run(engine):
    with_, without = (
        chutelab.simulate("slip", engine=engine, loads=loads) for loads in (0.01, None)
    )
    for name in ("knots", "events", "by_surface"):
        assert getattr(with_, name).tobytes() == getattr(without, name).tobytes()
    assert without.impulses.size == 0


def sliding(engine, **run):
    """15° down, µ = 0.1, from rest: a = g (sin - µ cos)."""
    a = radians(15.0)
    ramp = {"name": "ramp", "from": [0.0, 0.0], "to": [2 * cos(a), -2 * sin(a)]}
    at = [0.1 * cos(a) + 0.01 * sin(a), -0.1 * sin(a) + 0.01 * cos(a)]
    return chutelab.simulate(
        {
            "particle": {"radius": 0.01, "mass": 0.5, "spin": False},
            "surface": [{**ramp, "restitution": 0.0, "friction": 0.1}],
            "stream": {"at": at, "velocity": [0.0, 0.0]},
            "run": {"until": 0.9, "loads": 0.01, **run},
        },
        engine=engine,
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_what_slides_presses_by_its_weight_and_drags_by_its_friction(engine):
    a, m = radians(15.0), 0.5
    load = sliding(engine).loads("ramp", every=0.1)
    press = m * G * cos(a)
    assert load.normal[1:-1] == pytest.approx(press, rel=1e-6)
    assert load.along[1:-1] == pytest.approx(0.1 * press, rel=1e-6)
    # s = 0.1 m + a t²/2, its mean over a bin from t to t + h; the torque is about the upper end.
    pace, t, h = G * (sin(a) - 0.1 * cos(a)), load.edges[1:-2], 0.1
    way = 0.1 + 0.5 * pace * (t * t + t * h + h * h / 3.0)
    assert np.hypot(*load.place[1:-1].T) == pytest.approx(way, abs=2e-4)
    assert load.torque[1:-1] == pytest.approx(-press * way, rel=2e-3)
    assert load.pivot == (0.0, 0.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_belt_bears_less_where_it_goes_round_the_pulley(engine):
    """On the pulley N = m (g cos φ - v²/ρ), φ = v (t - 0.5 s) / ρ, and -m g sin φ holds it."""
    v, rho, m = 0.8, 0.1063, 0.008
    keys = {"speed": v, "friction": "adhesion", "pulley_radius": 0.1, "length": 0.4}
    changes = {"incoming": keys, "particle.radius": 0.0063, "run.loads": 0.01}
    load = chutelab.simulate("slip", changes, engine=engine).loads("incoming")
    middle = 0.5 * (load.edges[1:] + load.edges[:-1])
    phi = v * (middle - 0.4 / v) / rho
    free = np.arccos(v * v / (G * rho))
    flat, round_it = (middle > 0.01) & (phi < -0.05), (phi > 0.05) & (phi < free - 0.05)
    assert load.normal[flat] == pytest.approx(m * G, rel=1e-9)
    assert round_it.sum() > 8
    assert load.normal[round_it] == pytest.approx(
        m * (G * np.cos(phi) - v * v / rho)[round_it], abs=2e-3 * m * G
    )
    assert load.along[round_it] == pytest.approx((m * G * np.sin(phi))[round_it], abs=2e-3 * m * G)
    # The drive holds it: about the axis the torque is along times R, clockwise for forward.
    assert load.torque[round_it] == pytest.approx(
        -0.1 * load.along[round_it], abs=2e-3 * 0.1 * m * G
    )


def test_a_stream_on_a_15_degree_plate_presses_by_its_flow_times_its_change_of_velocity():
    """200 a second of 8 g: F = ṁ (1 + ε) v_n, with v_n from the impacts of a lone particle."""
    keys = {"plate.angle_deg": 15.0, "stream.bed_height": 0.0, "stream.count": 400}
    run = chutelab.simulate("stream-independent", {**keys, "run.loads": 0.05})
    hits = run.first(run.select("impact", surface="plate"))
    lean = radians(15.0)
    into = hits["velocity_before"] @ [cos(lean), sin(lean)]
    press = run.mass[0] * run.scene.stream.rate * (1.0 + run.scene.plate.restitution) * into.mean()
    load = run.loads("plate")
    full = np.flatnonzero(load.normal)[2:-2]
    # Twenty to a bin, and one more or less where it begins.
    assert load.normal[full].mean() == pytest.approx(press, rel=3e-3)
    assert load.force[full, 0].mean() == pytest.approx(press * cos(lean), rel=3e-3)


def disks(at, walls, **stream):
    """Disks of 10 mm and 0.1 kg that lie on walls without friction, one another's too."""
    return chutelab.simulate(
        {
            "particle": {"radius": 0.01, "mass": 0.1, "spin": False},
            "surface": [{"restitution": 0.0, "friction": 0.0, **wall} for wall in walls],
            "stream": [
                {"at": place, "velocity": [0.0, 0.0], "interact": True, "restitution": 0.0,
                 "friction": 0.0, **stream}
                for place in at
            ],
            "run": {"until": 2.0, "loads": 0.1},
        },
        engine="contact",
    )  # fmt: skip


def test_a_disk_in_a_groove_leans_on_both_walls():
    """60° and 30° from the ground: N_a sin 60° = N_b sin 30°, N_a cos 60° + N_b cos 30° = m g."""
    steep = {"name": "steep", "from": [-0.5 * cos(radians(60)), 0.5 * sin(radians(60))],
             "to": [0.0, 0.0]}  # fmt: skip
    flat = {"name": "flat", "from": [0.0, 0.0], "to": [0.5 * cos(radians(30)), 0.25]}
    corner = 0.01 * np.array([[sin(radians(60)), cos(radians(60))],
                              [-sin(radians(30)), cos(radians(30))]]).sum(axis=0)  # fmt: skip
    run = disks([corner.tolist()], [steep, flat])
    assert run.loads("steep").normal[-5:] == pytest.approx(0.1 * G * sin(radians(30)), rel=1e-6)
    assert run.loads("flat").normal[-5:] == pytest.approx(0.1 * G * sin(radians(60)), rel=1e-6)
    assert balance(run).holds


def test_a_pyramid_of_three_disks_by_hand():
    """The lower ones are 2.2 r apart, sin θ = 0.55: it presses each by m g/2 (tan θ, 1)."""
    r, m, lean = 0.01, 0.1, np.arcsin(0.55)
    floor = [{"name": "left", "from": [-0.021, 0.0], "to": [0.0, 0.0]},
             {"name": "right", "from": [0.0, 0.0], "to": [0.021, 0.0]}]  # fmt: skip
    wall = {"name": "wall", "from": [0.021, 0.0], "to": [0.021, 0.1]}
    back = {"name": "back", "from": [-0.021, 0.0], "to": [-0.021, 0.1]}
    top = [0.0, r + 2 * r * cos(lean)]
    run = disks([[-1.1 * r, r], [1.1 * r, r], top], [*floor, wall, back])
    for name in ("left", "right"):
        assert run.loads(name).normal[-5:] == pytest.approx(1.5 * m * G, rel=1e-3)
    for name in ("wall", "back"):
        push = 0.5 * m * G * np.tan(lean)
        assert run.loads(name).normal[-5:] == pytest.approx(push, rel=1e-2)


def test_a_heap_that_sleeps_presses_by_its_weight():
    """Also before it sleeps, but for what still moves; and each disk where it lies."""
    floor = {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "friction": 0.5}
    at = [[0.02 * n, 0.01] for n in range(-3, 4)] + [[0.02 * n + 0.01, 0.028] for n in range(-3, 3)]
    run = disks(at, [floor, {"name": "end", "from": [-0.07, 0.0], "to": [-0.07, 0.1]},
                     {"name": "far", "from": [0.07, 0.0], "to": [0.07, 0.1]}])  # fmt: skip
    load = run.loads("floor")
    assert load.normal[-5:] == pytest.approx(13 * 0.1 * G, rel=1e-9)
    assert load.normal[2:] == pytest.approx(13 * 0.1 * G, rel=1e-2)
    assert load.place[-5:, 0] == pytest.approx(0.0, abs=1e-4)
    assert balance(run).holds


@pytest.mark.slow
def test_the_pressure_under_a_heap_follows_its_height():
    """A floor in tiles: together they bear the weight, each about what lies above it, φ ρ g h(x).

    Poured disks are no fluid: arches carry the weight of the middle to the flanks, so that the
    pressure is largest beside the middle, not below the top. Six heaps are taken together.
    """
    edges = np.linspace(-0.2, 0.2, 11)
    tiles = [
        {"name": f"tile{n}", "from": [a, 0.0], "to": [b, 0.0], "restitution": 0.0, "friction": 0.6}
        for n, (a, b) in enumerate(pairwise(edges.tolist()))
    ]
    borne, above = np.zeros((2, len(tiles)))
    for seed in range(3, 9):
        run = chutelab.simulate(
            {"particle": {"radius": [0.004, 0.006], "density": 2500, "spin": True,
                          "rolling_friction": 0.3},
             "surface": tiles,
             "stream": {"count": 200, "rate": 100.0, "at": [-0.005, 0.25], "to": [0.005, 0.25],
                        "velocity": [0.0, -1.0], "interact": True, "restitution": 0.2,
                        "friction": 0.5, "seed": seed},
             "run": {"until": 4.0, "loads": 0.05}}
        )  # fmt: skip
        place, mass = run.at([4.0]).position[0], run.mass
        here = np.isfinite(place[:, 0])
        # A tile that none has reached has no load.
        own = np.nan_to_num([run.loads(tile["name"]).part("normal").end for tile in tiles])
        assert sum(own) == pytest.approx(mass[here].sum() * G, rel=1e-3)
        borne += own
        above += np.histogram(place[here, 0], edges, weights=G * mass[here])[0]
    assert np.corrcoef(borne, above)[0, 1] > 0.8
    assert borne[:5].sum() == pytest.approx(borne[5:].sum(), rel=0.15)
    assert borne[[0, 9]].max() < 0.2 * borne[4:6].max()
    # The dip below the top: the flanks bear a part of the middle.
    assert 0.6 < borne[4:6].sum() / above[4:6].sum() < 0.95
    assert borne[[1, 2, 7, 8]].sum() > above[[1, 2, 7, 8]].sum()


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_torques_are_about_what_a_surface_turns_about(engine):
    """A free hinge: I Δω is the torque's impulse; at an even pace the drive works -T ω Δt."""

    def struck(moves):
        flap = {"name": "flap", "from": [0.0, 0.0], "to": [0.2, 0.0], "friction": 0.2, **moves}
        return chutelab.simulate(
            {
                "particle": {"radius": 0.01, "mass": 0.05, "spin": False},
                "surface": [flap],
                "stream": {"at": [0.15, 0.1], "velocity": [0.3, 0.0]},
                "run": {"until": 0.2, "loads": 0.01},
            },
            engine=engine,
        )

    hung = struck({"hinge": [0.1, -0.05], "inertia": 0.01})
    rate = hung.machine.mover(0).hinge.states["rate"]
    turned = 0.01 * hung.loads("flap").torque.sum()
    # Chipmunk's blow takes a step of its weight with it.
    assert turned == pytest.approx(
        0.01 * (rate[-1] - rate[0]), rel=1e-9 if engine == "contact" else 2e-4
    )
    load = (driven := struck({"pivot": [0.1, -0.05], "turn": 30.0})).loads("flap")
    assert load.pivot == (0.1, -0.05)
    work = -radians(30.0) * 0.01 * load.torque.sum()
    assert work == pytest.approx(driven.ledger.by_surface["flap"]["drive_work"], rel=1e-9)
    shaken = struck({"shake": {"by": [0.005, 0.0], "frequency": 10.0}}).loads("flap")
    hit = int(np.argmax(shaken.normal))
    arm = shaken.place[hit] - [0.005 * sin(20.0 * np.pi * (hit + 0.5) * 0.01), 0.0]
    assert shaken.torque[hit] == pytest.approx(
        arm[0] * shaken.force[hit, 1] - arm[1] * shaken.force[hit, 0], rel=1e-9
    )


def test_bins_are_summed_stored_and_refused(tmp_path):
    run = chutelab.simulate("two-sizes", loads=0.01)
    fine, wide = run.loads("outgoing"), run.loads("outgoing", every=0.05)
    sums = np.add.reduceat(fine.normal, np.arange(0, len(fine.normal), 5)) / 5
    assert wide.normal == pytest.approx(sums)
    assert wide.edges[1] == pytest.approx(0.05)
    run.save(tmp_path / "run.npz")
    loaded = Recording.load(tmp_path / "run.npz")
    assert loaded.impulses.tobytes() == run.impulses.tobytes()
    assert loaded.measure("loads.outgoing.normal.peak") == fine.normal.max()
    assert run.measure("loads.plate.torque.rms") > 0.0
    with pytest.raises(InputError, match=r"every = 0\.015: 0\.01 s, or a multiple of it"):
        run.loads("outgoing", every=0.015)
    # A width that is a whole number of bins but for rounding is one.
    for off, whole in ((2e-10, True), (5e-8, False)):
        if whole:
            assert run.loads("outgoing", every=0.05 * (1.0 + off)).normal == pytest.approx(sums)
        else:
            with pytest.raises(InputError, match="multiple"):
                run.loads("outgoing", every=0.05 * (1.0 + off))
    with pytest.raises(InputError, match="outgoing"):
        run.loads("outgoin")
    with pytest.raises(InputError, match=r"such as 0\.01 s"):
        chutelab.simulate("two-sizes").loads("outgoing")
    with pytest.raises(InputError, match="1,048,576 bins or fewer"):
        chutelab.simulate("perpendicular", {"stream.start": 100.0, "run.loads": 1e-5})
    expect = {"quantity": "loads.plate.normal.mean", "value": 1.0, "tolerance": 0.1, "source": "-"}
    with pytest.raises(SceneError, match=r"it needs run\.loads"):
        chutelab.load("two-sizes", {"expect": [expect]})
    chutelab.load("two-sizes", {"expect": [expect], "run.loads": 0.01})


def test_what_is_counted_is_summed_up_as_it_comes():
    """A run of many steps needs no more memory for its loads than its bins."""
    bins = Bins(chutelab.simulate("perpendicular", loads=0.01).machine)
    ahead = np.array([0.0, 1.0])
    tracemalloc.start()
    for n in range(4000):
        bins.bear(0, 1e-6 * n, 1e-6 * (n + 1), ahead, ahead, ahead)
    assert tracemalloc.get_traced_memory()[1] < 6e5
    tracemalloc.stop()
    assert bins.counted()["normal"].sum() == pytest.approx(4000)


def test_command_writes_table_and_picture(tmp_path):
    called = ["run", "perpendicular", "--out", str(tmp_path), "--only", "loads"]
    result = call(*called)
    assert "Loads" in result.stdout
    rows = list(csv.DictReader((tmp_path / "loads.csv").read_text("utf-8").splitlines()))
    assert {row["surface"] for row in rows} == {"incoming", "plate", "outgoing"}
    on_plate = [float(row["normal"]) for row in rows if row["surface"] == "plate"]
    # One impact: m (1 + ε) v = 8 g × 1.5 × 2 m/s in 10 ms.
    assert max(on_plate) == pytest.approx(0.008 * 1.5 * 2.0 / 0.01)
    assert (tmp_path / "loads.png").stat().st_size > 5_000
    told = json.loads(call("run", "slip", "--loads", "0.1", "--json").stdout)
    assert told["loads"]["incoming"]["normal"]["mean"] > 0.0


def test_a_sweep_has_loads_of_each_variant():
    scene = chutelab.load("perpendicular", {"run.loads": 0.01})
    peaks = chutelab.sweep(scene, {"incoming.speed": [2.0, 3.0]}).columns["loads.plate.normal.peak"]
    assert peaks == pytest.approx([2.4, 3.6])


def test_the_end_is_the_last_bin_that_the_run_filled():
    """What slides off presses no more at the end; what rests presses by its weight."""
    load = sliding("contact").loads("ramp")
    assert load.part("normal").end == load.normal[load.filled - 1]
    assert load.part("normal").end == pytest.approx(0.5 * G * cos(radians(15.0)), rel=1e-6)
    gone = sliding("exact", until=1.8).loads("ramp")
    assert gone.part("normal").end == 0.0


def test_verify_holds_a_load_to_what_is_expected():
    expect = {"quantity": "loads.plate.normal.peak", "value": 2.4, "tolerance": 1e-9, "source": "-"}
    found = verify(chutelab.load("perpendicular", {"expect": [expect], "run.loads": 0.01}))
    assert [one.holds for one in found.findings] == [True] * len(found.findings)


@pytest.mark.slow
def test_a_silo_follows_janssen_once_its_floor_gives_way():
    """F = γ B²/(2 µ K) (1 - exp(-2 µ K z/B)), so F/W = (1 - e^-x)/x with x = 2 µ K z/B.

    Until the floor goes down by 4 mm friction at the walls may point either way, and the floor
    bears more. K is fitted to three depths of ten seeds each.
    """
    width, mu = 0.05, 0.4
    depths, shares = [], []
    for count in (50, 100, 200):
        for seed in range(10):
            half, top = 0.5 * width, 1.6 * count * 0.006**2 * 1.05 / width + 0.03
            wall = {"restitution": 0.0, "friction": mu}
            surfaces = [
                {"name": "left", "from": [-half, -0.05], "to": [-half, top + 0.1]},
                {"name": "right", "from": [half, -0.05], "to": [half, top + 0.1]},
                {"name": "floor", "from": [-half, 0.0], "to": [half, 0.0],
                 "travel": {"to": [-half, -0.004], "at": 0.6, "in": 0.6}},
            ]  # fmt: skip
            fill = [[-half + 0.004, 0.004], [half - 0.004, top]]
            run = chutelab.simulate(
                {"particle": {"radius": [0.0025, 0.0035], "density": 2500, "spin": True},
                 "surface": [{**one, **wall} for one in surfaces],
                 "stream": {"count": count, "fill": fill, "interact": True, "seed": seed, **wall},
                 "run": {"until": 1.5, "loads": 0.05}},
                engine="contact",
            )  # fmt: skip
            weight = run.mass.sum() * G
            end = run.measure("loads.floor.normal.end")
            assert run.loads("floor").normal[10] > 1.05 * end
            shares.append(end / weight)
            depths.append(run.at([1.49]).position[0, :, 1].max() + 0.007)
    z, share = np.array(depths), np.array(shares)

    def law(k):
        x = 2.0 * mu * k * z / width
        return (1.0 - np.exp(-x)) / x

    tried = np.linspace(0.1, 2.0, 1901)
    k = tried[np.argmin([((law(one) - share) ** 2).sum() for one in tried])]
    slope = (law(k + 1e-4) - law(k - 1e-4)) / 2e-4
    scatter = np.sqrt(((law(k) - share) ** 2).sum() / (len(z) - 1))
    error = scatter / np.sqrt((slope**2).sum())
    assert 0.5 < k < 1.0
    assert error < 0.1
    assert scatter < 0.1
    # A column that leaned on no wall would press by all of its weight.
    deepest = share[-10:]
    assert deepest.mean() + 3.0 * deepest.std(ddof=1) / 10**0.5 < 0.6


def test_a_gas_presses_by_its_energy_and_shares_it_alike():
    """A fill with a spread of speeds: p A = E (1 + 2 φ), n m v²/2 for points, as ½ m v² is kT.

    2 φ is the second virial coefficient of disks that cover φ of the area A of their centres.
    Light and heavy ones start with one spread of speeds, so with 1 : 4 of energy each, and end
    with 1 : 1; so do both directions.
    """
    radius, side, count, end = 0.008, 1.0, 60, 16.0
    box = {"name": "box", "points": [[0, 0], [side, 0], [side, side], [0, side], [0, 0]],
           "restitution": 1.0, "friction": 0.0}  # fmt: skip
    kinds = [{"name": name, "radius": radius, "mass": m} for name, m in (("a", 1e-3), ("b", 4e-3))]
    streams = [
        {"particle": kind["name"], "count": count, "fill": [[0.01, 0.01], [0.99, 0.99]],
         "speed_spread": 1.0, "seed": n, "interact": True, "restitution": 1.0, "friction": 0.0}
        for n, kind in enumerate(kinds)
    ]  # fmt: skip
    run = chutelab.simulate({
        "gravity": 0.0, "particle": kinds, "surface": [box], "stream": streams,
        "run": {"until": end, "loads": 1.0},
    })  # fmt: skip
    assert not run.laws
    energy = run.ledger.kinetic[0]
    assert run.ledger.kinetic[1] == pytest.approx(energy, rel=1e-10)
    late, room = 4.0, side - 2.0 * radius
    pushes = run.loads("box").normal[int(late) :].sum() / (end - late)  # N, of four walls
    covered = 2 * count * np.pi * radius**2 / room**2
    assert pushes * room / 4.0 == pytest.approx(energy * (1.0 + 2.0 * covered), rel=0.03)
    v = run.at(np.arange(late, end, 0.1)).velocity
    mass = np.repeat([1e-3, 4e-3], count)[:, None]
    (ax, ay), (bx, by) = (
        (0.5 * mass * v**2)[:, half].mean(axis=(0, 1))
        for half in (slice(count), slice(count, None))
    )
    assert [ax, ay, bx, by] == pytest.approx([energy / (4 * count)] * 4, rel=0.15)
