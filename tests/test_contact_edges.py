"""The contact engine where friction locks, and where what lay on a surface parts from it."""

from math import cos, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

from chutelab.engines import contact, exact, pymunk
from chutelab.engines.contact import run
from chutelab.engines.simulation import simulate
from chutelab.results import REASONS, Kind
from chutelab.results.laws import judge
from chutelab.results.recorder import StalledError
from machines import bent, face, scene_of, thrown
from shared import some
from test_repeats import CROWD

G = 9.81
R = 0.01
"""m; of the disks."""
GRIP = {"friction": 1e6, "restitution": 0.0}
FAR = face("far", (-50.0, -90.0), (50.0, -90.0))


@pytest.mark.parametrize(("count", "alpha", "friction"), some([(3, 0.2, 0.3), (4, 0.25, 1.0)]))
def test_a_nip_that_no_impulses_hold_open_lets_the_belt_slip(count, alpha, friction):
    """A belt drives disks that hardly roll into a wedge: none sinks into what does not give way.

    Rigid bodies have no solution with all of the friction. The lowest disk touches both faces
    where its centre is r / tan(α/2) above their edge. (Three of friction 1 may lock before, at
    some steps.)
    """
    edge, normal = -0.3, np.array([cos(alpha), -sin(alpha)])
    wall = face("wall", (0.0, edge), (0.6 * sin(alpha), edge + 0.6 * cos(alpha)), **GRIP)
    machine = scene_of(
        particle={"radius": R, "spin": True, "rolling_friction": 0.3},
        surface=[face("belt", (0.0, edge), (0.0, 0.3), speed=-1.0, **GRIP), wall],
        stream={"count": 2, "interact": True, "rate": 1.0, "bed_height": 1.0, "at": [0.0, 3.0],
                "restitution": 0.0, "friction": friction},
        run={"until": 0.5},
    )  # fmt: skip
    row = np.multiply.outer(R * (1.0 + 2.01 * np.arange(count)), [cos(0.1), sin(0.1)])
    recording = run(thrown(machine, row + np.array([1e-4, 0.15])))
    places = recording.at(np.linspace(1e-3, 0.499, 200))[0]
    others = np.hypot(*np.moveaxis(places[:, :, None] - places[:, None], -1, 0))
    others[:, range(count), range(count)] = np.inf
    from_wall = -(places - [0.0, edge]) @ normal
    assert min(0.5 * others.min(), places[..., 0].min(), from_wall.min()) > 0.99 * R
    lowest = places[-1, :, 1].min()
    assert lowest == pytest.approx(edge + R / np.tan(0.5 * alpha), abs=0.02 * R / alpha)


def nip(friction, dt, angle, wall=0.0, count=1, until=2.0, **particle):
    """A belt of 2 m/s draws a row of disks under a wall that leans back over it, by `angle`."""
    edge = np.array([0.1, 0.005])
    top = edge + 0.3 * np.array([-cos(angle), sin(angle)])
    faces = [face("belt", (-1.0, 0.0), (1.0, 0.0), speed=2.0, friction=friction, restitution=0.2),
             face("wall", edge, top, friction=wall, restitution=0.3)]  # fmt: skip
    machine = scene_of(particle={"radius": R, "mass": 0.008, **particle}, surface=faces,
                       stream={"restitution": 0.1, "friction": 0.3},
                       run={"until": until, "dt": dt})  # fmt: skip
    row = np.arange(count)
    places = np.stack([-0.5 - 2.05 * R * row, np.where(row == 0, 2.0, 1.2) * R], axis=1)
    return run(thrown(machine, places, [1.0, 0.0]))


def paid(recording, start, end):
    """Power of the three entries of all particles together from one time to another, (3,), W."""
    books = [
        [np.interp([start, end], track["t"], entry) for entry in track["entries"].T]
        for track in map(recording.track, range(recording.count))
    ]
    return np.diff(np.sum(books, axis=0))[:, 0] / (end - start)


@pytest.mark.parametrize("dt", [1e-3, 5e-4])
@pytest.mark.parametrize("friction", [0.3, 1.6, 1.9])
def test_a_belt_slips_under_what_it_cannot_move_and_stalls_where_that_locks(friction, dt):
    """The smooth wall gives N2 sin α = µ N1, the belt N1 = m g + N2 cos α: N1 = m g/(1 - µ cot α).

    The belt pays µ N1 v. At µ = tan α no load holds the nip open: from there on it stalls.
    """
    angle = radians(60.0)
    recording = nip(friction, dt, angle, spin=False)
    locks = friction > np.tan(angle)
    load = 0.0 if locks else 0.008 * G / (1.0 - friction / np.tan(angle))
    power, restitution, heat = paid(recording, 1.5, 2.0)
    assert [power, heat] == pytest.approx(
        2 * [0.0 if locks else friction * load * 2.0], rel=1e-6, abs=1e-9
    )
    assert abs(restitution) < 1e-9
    assert np.hypot(*recording.track(0)["velocity"][-1]) < 1e-9


@pytest.mark.parametrize(
    ("count", "dt", "friction", "angle"),
    [
        *((n, dt, mu, 60.0) for n, dt in ((2, 5e-4), (4, 1e-3)) for mu in (0.3, 1.0)),
        *((2, 5e-4, 0.3, 30.0), (4, 1e-3, 0.3, 30.0)),
        pytest.param(2, 5e-4, 1.0, 30.0, marks=pytest.mark.slow),
        pytest.param(4, 1e-3, 1.0, 30.0, marks=pytest.mark.slow),
    ],
)
def test_in_a_row_that_is_pushed_into_a_nip_each_pays_for_its_load(count, friction, angle, dt):
    """The others push the first with F = (n - 1) µ m g: N2 sin α = µ N1 + F, N1 = m g + N2 cos α.

    So N1 = (m g + F cot α) / (1 - µ cot α), and the belt pays (F + µ N1) v. Where µ > tan α the
    first stalls it, and the others, which are blocked, slip on.
    """
    recording = nip(friction, dt, radians(angle), count=count, until=0.8, spin=False)
    weight, slope = 0.008 * G, 1.0 / np.tan(radians(angle))
    push = (count - 1) * friction * weight
    first = (weight + push * slope) / (1.0 - friction * slope)
    force = push + (friction * first if friction * slope < 1.0 else 0.0)
    power, _, heat = paid(recording, 0.6, 0.8)
    assert [power, heat] == pytest.approx(2 * [force * 2.0], rel=2e-3)
    assert judge(recording) == ()


@pytest.mark.parametrize(
    ("count", "angle", "wall", "dt"),
    [(1, 60.0, 0.0, 1e-3), (2, 30.0, 0.0, 5e-4), (2, 60.0, 0.5, 1e-3), (4, 30.0, 0.0, 1e-3)],
)
def test_a_row_on_a_belt_that_grips_without_bound_stalls_it(count, angle, wall, dt):
    """What cannot move blocks it, and nothing is paid; before, a blow costs m v² at most.

    From the first touch of the wall on there are at most 200 blows on each.
    """
    recording = nip(1e6, dt, radians(angle), wall, count, until=0.6, spin=False)
    assert np.abs(paid(recording, 0.35, 0.6)).max() < 1e-6 * 0.008 * G * 2.0
    assert 0.0 < recording.by_surface[:, 0].sum() < 200.0 * count * 0.008 * 2.0**2
    assert judge(recording) == ()


def test_a_column_that_locks_between_two_belts_stalls_them():
    """It leans on a belt that goes down, and stands on one that pulls its foot below that belt.

    Its disks do not turn, and the tangent of its lean is less than the floor's friction: no load
    makes it slip, so rigid bodies have a solution only if belts stall. There are at most 200 blows
    of m v² on each disk.
    """
    lean, speed, count = radians(5.0), 5.0, 80
    surfaces = [
        face("floor", (-9.0, 0.0), (3.0, 0.0), speed=-speed, friction=0.25, restitution=0.0),
        face("belt", (0.0, 4.0), (0.0, 0.0), speed=speed, friction=5.0, restitution=0.0),
    ]
    machine = scene_of(particle={"radius": R, "spin": False}, surface=surfaces,
                       stream={"restitution": 0.0, "friction": 0.9, "at": [-2.0, 1.0]},
                       run={"until": 0.1, "dt": 1e-3})  # fmt: skip
    up, above = np.array([-sin(lean), cos(lean)]), 2.0 * R * np.arange(count)
    row = 1.0001 * R + np.outer(above, up) + [above[-1] * sin(lean), 0.0]
    recording = run(thrown(machine, row, -2.0 * up))
    assert judge(recording) == ()
    assert recording.steps < 2.0 * 0.1 / 1e-3, "impacts without end would cut steps short"
    paid = recording.by_surface[:, 0].sum()
    assert paid < 200.0 * count * machine.particle.mass * speed**2


@pytest.mark.parametrize(
    ("angle", "friction", "wall"), [(30.0, 0.5, 0.8), (60.0, 0.5, 0.1), (30.0, 1e6, 0.1)]
)
def test_what_a_nip_costs_is_the_same_at_a_finer_step(angle, friction, wall):
    """A disk that turns rolls on the belt as far as the wall lets it."""
    costs = [nip(friction, dt, radians(angle), wall, spin=True) for dt in (1e-3, 5e-4)]
    coarse, fine = (run.by_surface.sum(axis=0) for run in costs)
    np.testing.assert_allclose(coarse, fine, rtol=0.02)
    assert (costs[0].by_surface[:, 1:] >= 0.0).all()


@pytest.mark.parametrize("crowded", [False, True])
def test_what_is_struck_off_a_ramp_has_left_the_ramp(crowded):
    """It slides down at 45 degrees onto the ground, without friction, and is thrown off both.

    v^2 = 2 g s sin 45 along the ramp; half of v sin 45 comes back, off the ramp.
    """
    smooth, side = {"friction": 0.0, "restitution": 0.5}, np.sqrt(0.5)
    ramp = face("ramp", (-1.0, 1.0), (0.0, 0.0), **smooth)
    machine = scene_of(surface=[ramp, face("ground", (-1.0, 0.0), (3.0, 0.0), **smooth)],
                       run={"until": 0.55})  # fmt: skip
    # It meets the ground where its centre is r above it, and on the ramp.
    foot, way = np.array([R * (np.sqrt(2.0) - 1.0), R]), 0.5
    start = foot + way * side * np.array([-1.0, 1.0])
    recording = run(thrown(machine, [start, (2.5, R)] if crowded else start))
    left = recording.select(Kind.SEPARATION)[0]
    blow = next(one for one in recording.select(Kind.IMPACT) if one["surface"] == 1)
    speed = np.sqrt(2.0 * G * way * side)
    assert machine.surfaces[left["surface"]] == "ramp"
    assert blow["t"] <= left["t"] <= blow["t"] + machine.dt
    np.testing.assert_allclose(blow["position"], foot, rtol=0, atol=1e-3 * R)
    np.testing.assert_allclose(
        blow["velocity_after"], speed * side * np.array([1.0, 0.5]), rtol=2e-3
    )


@pytest.mark.parametrize("crowded", [False, True])
@pytest.mark.parametrize("aside", [0.1, 0.4])
@pytest.mark.parametrize("share", [1.0, 1.003])
def test_a_disk_squeezes_through_the_gap_of_a_ring_and_feels_both_ends(share, aside, crowded):
    """The gap is hardly wider than the disk: next to one end it may not be in the other.

    It falls in through the top, and comes to lie at the bottom of the ring. A thousandth of the
    radius of overlap is left alone.
    """
    ring, half = 5.0 * R, np.arcsin(share / 5.0)
    arc = {"center": (0.0, 0.0), "radius": ring, "begin": 0.5 * pi + half,
           "extent": 2.0 * (pi - half), "friction": 0.0, "restitution": 0.0}  # fmt: skip
    machine = bent(scene_of(surface=[FAR], run={"until": 0.3}), arc)
    ends = ring * np.array([[sin(half), cos(half)], [-sin(half), cos(half)]])
    for speed in (1.0, 3.0):
        places = [(aside * R, 0.08), (5.0, 5.0)] if crowded else [(aside * R, 0.08)]
        recording = run(thrown(machine, places, [0.0, -speed]))
        way = np.concatenate([
            recording.track(0)["position"], recording.at(np.linspace(0.0, 0.299, 1000))[0][:, 0]
        ])  # fmt: skip
        assert np.hypot(*(way[:, None] - ends).transpose(2, 0, 1)).min() > 0.999 * R
        assert np.hypot(*way[-1]) < ring - 0.999 * R


@pytest.mark.parametrize("engine", [contact, exact])
@pytest.mark.parametrize("seed", range(4))
def test_a_corner_is_of_the_first_piece_that_ends_there(engine, seed):
    """Onto the top where two hollow belts meet: it leaves as fast along as the first of them runs.

    Where a piece ends is rounded for each by itself; that does not decide.
    """
    draw = np.random.default_rng(seed)
    x, y, *sizes = draw.uniform(0.2, 1.0, 4)
    arcs = [
        {"center": (x - size * cos(at), y - size * sin(at)), "radius": size, "begin": begin,
         "extent": radians(50.0), "friction": 10.0, "restitution": 0.5}
        for at, begin, size in zip(
            np.radians([220.0, 320.0]), np.radians([220.0, 270.0]), sizes, strict=True
        )
    ][:: 1 - 2 * (seed % 2)]  # fmt: skip
    machine = scene_of(
        particle={"radius": 0.02, "spin": False},
        surface=[FAR],
        stream={"at": [x, y + 0.1]},
        run={"until": 0.2},
    )
    roof = [arc | {"speed": 0.5 + n} for n, arc in enumerate(arcs)]
    hit = engine.run(bent(machine, *roof)).select(Kind.IMPACT)[0]
    assert abs(hit["velocity_after"][0]) == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize("engine", [exact, contact])
@pytest.mark.parametrize("ways", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
@pytest.mark.parametrize("frictions", [(0.1, 0.2), (0.3, 0.1)])
@pytest.mark.parametrize("begins", [-1.0, 0.2])
def test_of_two_faces_on_each_other_the_first_in_the_file_acts(engine, ways, frictions, begins):
    """A slide down a slope of angle β: v² grows by 2 g (sin β - µ cos β) s, with the µ of one face.

    That is the first, from where it begins; before, it is the second.
    """
    beta, v0, start, end = 0.3, 1.0, -0.1, 0.3
    along, normal = np.array([cos(beta), -sin(beta)]), np.array([sin(beta), cos(beta)])
    surface = [
        face(name, *[along * s for s in span[::way]], friction=mu, restitution=0.0)
        for name, span, way, mu in zip(
            ("one", "two"), ((begins, end), (-0.7, end)), ways, frictions, strict=True
        )
    ]
    machine = scene_of(particle={"spin": False}, surface=surface, run={"until": 0.5, "dt": 2e-4})
    recording = engine.run(thrown(machine, start * along + 0.01 * normal, v0 * along))
    pulls = G * (sin(beta) - np.array(frictions) * cos(beta))
    on_one = end - max(begins, start)
    speed = sqrt(v0**2 + 2.0 * pulls @ [on_one, end - start - on_one])
    left = recording.select(Kind.SEPARATION)["velocity_before"][0]
    # A step has the friction of one of them: all of it rubs as the other would, at most.
    off = 1e-12 if engine is exact else G * abs(np.diff(frictions)[0]) * machine.dt
    np.testing.assert_allclose(left, speed * along, rtol=0, atol=off)
    assert recording.by_surface[1].any() == (begins > start)


@pytest.mark.parametrize("engine", [exact, contact])
def test_what_belts_drive_to_and_fro_without_end_is_told(engine):
    """Two fast belts meet in a wedge into which they throw a disk that does not turn.

    Each round of four blows is like the one before in a wedge that is narrower: it takes a constant
    share less of time, so that infinitely many take a finite one, and gives as much work. The sum
    has no bound, so no engine has an answer.
    """
    machine = scene_of(
        particle={"radius": 0.004, "spin": False},
        surface=[
            face("up", (-0.5, -1.0), (0.6, 1.0), speed=100.0, friction=1e6, restitution=0.999),
            face("down", (-0.35, 0.3), (0.75, -0.4), speed=100.0, friction=0.6, restitution=0.999),
        ],
        stream={"at": [0.0, -0.02], "velocity": [1.7, -0.3]},
        run={"until": 1.0},
    )  # fmt: skip
    with pytest.raises(StalledError) as told:
        engine.run(machine)
    recording = told.value.recording
    at = recording.select(Kind.IMPACT)["t"][20:2021:4]
    after = np.flatnonzero(np.diff(recording.knots["t"]) == 0.0) + 1
    work, rounds = np.diff(recording.knots["entries"][after, 0][20:2021:4]), np.diff(at)
    shares = rounds[1:] / rounds[:-1]
    assert np.abs(work / work[0] - 1.0).max() < 1e-5
    assert np.abs(shares / shares[0] - 1.0).max() < 1e-5
    end = at[0] + rounds[0] / (1.0 - shares[0])
    # Exact goes on until rounding ends it, contact says so where a step has too many blows.
    assert told.value.t == pytest.approx(end, abs={exact: 1e-4, contact: 6e-3}[engine])
    assert told.value.t < end + 1e-4


@pytest.mark.parametrize("engine", [exact, contact, pymunk])
def test_a_belt_that_throws_into_a_mirror_works_without_end(engine):
    """A belt with endless grip carries a disk that does not turn under a smooth plate of ε = 1.

    The plate reflects it to (-v cos 2β, -v sin 2β), β between plate and belt; the belt stops what
    falls and pulls the rest back to -v: work m v · v (1 - cos 2β) each time, and no time between.
    """
    beta, v, high = 0.5, 2.0, 0.05
    machine = scene_of(
        particle={"radius": R, "spin": False},
        surface=[
            face("belt", (0.0, 0.0), (1.0, 0.0), speed=-v, **GRIP),
            face("mirror", (0.0, 0.0), (cos(beta), sin(beta)), restitution=1.0, friction=0.0),
        ],
        stream={"at": [0.5, R + high]},
        run={"until": 1.0},
    )  # fmt: skip
    with pytest.raises(StalledError) as told:
        engine.run(machine)
    recording = told.value.recording
    reached = sqrt(2.0 * high / G) + (0.5 - R / tan(beta / 2.0)) / v
    assert told.value.t == pytest.approx(reached, abs=1e-5)
    blows = recording.select(Kind.IMPACT)[2:22]
    assert blows["surface"].tolist() == 10 * [0, 1] or blows["surface"].tolist() == 10 * [1, 0]
    given = blows["tangential_impulse"][blows["surface"] == 0]
    work = recording.particle.mass * v**2 * (1.0 - cos(2.0 * beta))
    # Where a step begins, contact adds what the weight does in it.
    rtol = G * machine.dt / v if engine is contact else 1e-5
    np.testing.assert_allclose(abs(given) * v, work, rtol=rtol)


def test_what_is_held_between_carried_disks_rattles_no_longer_than_it_helps():
    """Round a pulley, where v² is about g ρ, those below leave first, under others that ride on.

    Nothing moves what is carried, so there may be no room between two of these, or one and the
    belt: blows would go on without end, and each cut the step to a fiftieth. What the solve of all
    leaves open stays open to the step's end, so steps are as many as the time has, and a few.
    """
    slower = CROWD.with_values({"incoming.speed": 1.9})
    recording = simulate(slower, engine="contact", max_seconds=20.0)
    assert (recording.ended == REASONS.index("landed")).all()
    assert recording.steps < 1.1 * recording.knots["t"].max() / slower.run.dt


def test_what_rolls_on_to_a_next_face_does_so_as_if_nothing_else_lay_at_rest():
    """A disk that slid rolls at 2/3 of its speed, spin -v/r; one on a belt is calm but awake."""
    rough = {"friction": 0.3, "restitution": 0.0}
    faces = [face("first", (0.0, 0.0), (1.0, 0.0), **rough),
             face("next", (1.0, 0.0), (2.5, 0.0), **rough),
             face("belt", (-5.0, 1.0), (5.0, 1.0), speed=0.05, **rough)]  # fmt: skip
    rides = {"at": [-1.0, 1.0 + R], "velocity": [0.05, 0.0]}
    rolls = {"at": [0.5, R], "velocity": [1.8, 0.0], "interact": True}
    scene = {"particle": {"radius": R, "mass": 0.1, "spin": True}, "surface": faces,
             "stream": [rolls, rides], "run": {"until": "settled", "max_time": 1.0}}  # fmt: skip
    recording = simulate(scene, engine="contact")
    (passed,) = recording.select("stick", surface="next")
    assert passed["velocity_before"] == pytest.approx([1.2, 0.0], rel=1e-9, abs=1e-9)
    assert passed["omega_before"] == pytest.approx(-1.2 / R, rel=1e-9)
    assert passed["position"] == pytest.approx([1.0, R], abs=1e-6)
