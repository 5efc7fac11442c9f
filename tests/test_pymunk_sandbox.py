"""The Pymunk engine on arcs, gates, inclined belts, kinds, boxes and strings; laws written here."""

from dataclasses import replace
from math import atan2, cos, hypot, inf, pi, radians, sin, sqrt, tan

import numpy as np
import pytest
from scipy.special import ellipk

from chutelab.engines.pymunk import run, shared, world
from chutelab.engines.simulation import judged, simulate
from chutelab.machine import Joint, build
from chutelab.results import Kind
from chutelab.results.recorder import StalledError
from chutelab.scene import from_dict, load
from machines import bent, face, gated, scene_of, thrown
from shared import seeds, some

G = 9.81


def lone(position, velocity=(0.0, 0.0), *, until=1.0, dt=1e-3, **tables):
    tables["particle"] = {"radius": 0.01, "spin": False} | tables.get("particle", {})
    run_table = {"until": until, "max_time": until, "dt": dt} | tables.pop("run", {})
    machine = scene_of(run=run_table, **tables)
    return thrown(machine, position, velocity)


def energies(recording, knots):
    """Return ½ m v² + ½ I ω² + m g y (J) of one knot of each particle."""
    p = recording.particle
    square = (knots["velocity"] ** 2).sum(axis=-1)
    lift = recording.gravity * knots["position"][..., 1]
    return p.mass * (0.5 * square + lift) + 0.5 * p.inertia * knots["omega"] ** 2


def residual(recording):
    """Return what the ledger leaves over in the end, J: states against what was booked."""
    first, last = recording.ends()
    belt, restitution, friction = last["entries"].T
    change = energies(recording, last) - energies(recording, first)
    return abs(float((change - (belt - restitution - friction)).sum()))


def first_touch(piece, start, velocity, r, end=1.0):
    """Return when a disk on a parabola first touches a piece, or inf: sampled, then bisected."""

    def gap(t):
        t = np.atleast_1d(t)[:, None]
        return piece.gap(start + velocity * t - [0.0, 0.5 * G] * t * t, r)

    times = np.linspace(0.0, end, 20_001)
    touching = gap(times) < 0.0
    if not touching.any():
        return inf
    high = times[np.argmax(touching)]
    low = high - times[1]
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if gap(middle)[0] < 0.0 else (middle, high)
    return high


@pytest.mark.parametrize("seed", seeds(2, 5))
def test_an_arc_is_met_from_wherever_it_is_met_first(seed):
    # From inside, outside and beside it, on its face and on its ends.
    draw = np.random.default_rng(seed)
    begin, extent = draw.uniform(0.0, 2.0 * pi), draw.uniform(0.3, 5.5)
    arc = {"center": (0.0, 0.0), "radius": 0.3, "begin": begin, "extent": extent}
    for _ in range(6):
        start, velocity = draw.uniform(-0.6, 0.6, 2), draw.normal(0.0, 2.0, 2)
        m = bent(lone(start, velocity, until=1.0), arc | {"restitution": 0.5})
        (piece,) = m.pieces
        if piece.gap(start, 0.01) < 0.0:
            continue
        want = first_touch(piece, start, velocity, 0.01)
        hits = run(m).select(Kind.IMPACT)
        got = hits["t"][0] if len(hits) else inf
        assert got == pytest.approx(want, abs=1e-9)


@pytest.mark.parametrize(
    ("side", "radii"),
    some([("hollow", (0.05, 1.0, 0.3)), ("hollow", (1.0, 0.05, 0.3)), ("hollow", (0.3, 0.3, 0.3)),
          ("S", (0.05, 1.0, 0.3)), ("S", (0.3, 1.0, 0.05)), ("S", (1.0, 1.0, 1.0))]),
)  # fmt: skip
def test_arcs_joined_without_a_corner_are_not_felt(side, radii):
    # A smooth way down: three hollow arcs, or a hollow one, a round one and a hollow one, turn by
    # turn tangential, then a straight end; without friction ½ v² = g times the fall of the centre.
    r, heading, place = 0.01, radians(-40.0), np.zeros(2)
    start = r * np.array([-sin(heading), cos(heading)])
    arcs = []
    for n, radius in enumerate(radii):
        way = -1.0 if side == "S" and n == 1 else 1.0
        turn = radians(4.0 if side == "S" and n == 1 else 12.0)
        normal = way * np.array([-sin(heading), cos(heading)])
        center, begin = place + radius * normal, atan2(-normal[1], -normal[0])
        first = begin if way > 0.0 else begin - turn
        arcs.append({"center": center, "radius": radius, "begin": first, "extent": turn})
        heading += way * turn
        place = center + radius * np.array([cos(begin + way * turn), sin(begin + way * turn)])
    end = place + 0.1 * np.array([cos(heading), sin(heading)])
    m = lone(
        start, (0.6 * cos(radians(40.0)), -0.6 * sin(radians(40.0))), until=1.0, dt=1e-3,
        surface=[face("end", tuple(place), tuple(end), friction=0.0)],
    )  # fmt: skip
    got = run(bent(m, *arcs))
    assert not len(got.select(Kind.IMPACT))
    left = got.select(Kind.SEPARATION)[0]
    assert got.surfaces[left["surface"]] == "end"
    speed = sqrt(0.36 + 2.0 * G * (start[1] - left["position"][1]))
    assert hypot(*left["velocity_after"]) == pytest.approx(speed, rel=1e-5)
    above = end + r * np.array([-sin(heading), cos(heading)])
    assert left["position"] == pytest.approx(above, abs=1e-5)


@pytest.mark.parametrize("arm", [0.02, 0.5])
def test_rolling_friction_shares_a_blow_with_friction(arm):
    # Thrown on a rough floor with ω: it sticks, v = -r ω', and either the couple is used up,
    # J3 = arm J_n, and (I + m r²) ω' = I ω - m r v + J3, or nothing turns: ω' = v' = 0.
    r, mass, spin = 0.01, 0.1, 0.5 * 0.1 * 0.01**2
    m = lone((0.0, 0.1), (0.5, 0.0), until=0.14, particle={"spin": True}, surface=[
        face("floor", (-1.0, 0.0), (9.0, 0.0), restitution=0.5, friction=9.0)
    ])  # fmt: skip
    got = run(replace(m, rolling=np.array([arm])))
    hit = got.select(Kind.IMPACT)[0]
    whole = spin + mass * r * r
    couple = min(arm * r * hit["normal_impulse"], mass * r * 0.5)
    assert hit["omega_after"] == pytest.approx((couple - mass * r * 0.5) / whole, abs=1e-9)
    assert hit["velocity_after"][0] == pytest.approx(-r * hit["omega_after"], abs=1e-10)
    assert residual(got) < 1e-13


# Stepped: all in one Space


STEPPED = {"align": False}


@pytest.mark.parametrize("extent", [pytest.param(pi, marks=pytest.mark.slow), 2.0 * pi])
def test_a_drum_drives_a_ball_inside_it(extent):
    # The rim runs clockwise at 1 m/s: at the bottom to the left outside of it, seen from the middle
    # the ball is driven against x, and held up where friction and weight agree.
    found = []
    for run_table in ({}, STEPPED):
        m = lone((0.7, 0.51), until=0.5, particle={"spin": True}, run=run_table)
        drum = {"center": (0.7, 1.0), "radius": 0.5, "begin": pi, "extent": extent}
        m = bent(m, drum | {"speed": 1.0, "friction": 0.5})
        got = run(m)
        last = got.track(0)[-1]
        found.append([*last["position"], last["omega"] * 0.01, *got.by_surface[0, [0, 2]]])
    # A disk that grips: ω r = -(v + rim's speed), all speeds along the rim.
    x, _, rim, work, heat = found[0]
    assert x < 0.7
    assert work > heat > 0.0
    assert rim < 0.0
    assert found[1] == pytest.approx(found[0], rel=2e-3, abs=2e-4)


@pytest.mark.parametrize(("run_table", "off"), [({}, 1e-12), (STEPPED, 3e-3)])
def test_gates_open_and_shut_without_a_push(run_table, off):
    gate = face("gate", (-1.0, 0.0), (1.0, 0.0), restitution=0.0)
    m = lone((0.0, 0.01), until=0.5, dt=1e-3, surface=[gate], run=run_table)
    end = run(gated(m, 0, vanishes=0.25)).track(0)[-1]
    assert end["position"][1] == pytest.approx(0.01 - 0.5 * G * 0.25**2, abs=off)
    # It appears while the disk is in it, and lets it through; the disk comes down on it later.
    m = lone((0.0, -0.3), (0.0, 3.0), until=1.0, surface=[gate], run=run_table)
    through = (3.0 - sqrt(9.0 - 2.0 * G * 0.3)) / G
    hits = run(gated(m, 0, appears=through)).select(Kind.IMPACT)
    assert hits["t"][0] == pytest.approx((3.0 + sqrt(9.0 - 2.0 * G * 0.31)) / G, abs=off)


def kinds(machine, kind, radius, mass, restitution, friction=0.0):
    """Return the machine with kinds of particles (N,), and their pairs' values (K, K)."""
    kind, restitution = np.array(kind), np.array(restitution)
    count, parts = len(restitution), machine.segments
    return replace(
        machine, releases=replace(machine.releases, kind=kind),
        particle=replace(
            machine.particle, radius=np.array(radius)[kind], mass=np.array(mass)[kind],
            inertia=np.zeros(len(kind)),
        ),
        segments=replace(
            parts, restitution=np.tile(parts.restitution, (count, 1)),
            friction=np.tile(parts.friction, (count, 1)),
        ),
        pair_restitution=restitution, pair_friction=np.full((count, count), friction),
        rolling=np.zeros(count), falls=np.zeros(count), outlines=(None,) * count,
    )  # fmt: skip


def test_pairs_have_the_values_of_their_kinds():
    # J = (1 + e) v m1 m2/(m1 + m2), e of a table that no product of two values gives.
    table = [[0.9, 0.2], [0.2, 0.8]]
    for one, other in ((0, 0), (0, 1), (1, 1)):
        m = lone((0.0, 0.0), gravity=0.0, until=0.6, stream={"count": 2, "interact": True})
        m = thrown(m, [(0.0, 0.0), (0.3, 0.0)], [(1.0, 0.0), (0.0, 0.0)])
        radius, mass = [0.01, 0.02], [0.1, 0.4]
        m = kinds(m, [one, other], radius, mass, table)
        got = run(m)
        hit = got.select(Kind.COLLISION)[0]
        assert hit["t"] == pytest.approx(0.3 - radius[one] - radius[other], abs=1.1e-3)
        reduced = mass[one] * mass[other] / (mass[one] + mass[other])
        e = table[one][other]
        assert hit["normal_impulse"] == pytest.approx((1.0 + e) * reduced, rel=1e-9)
        loss = got.by_surface[-1, 1]
        assert loss == pytest.approx(0.5 * reduced * (1.0 - e * e), rel=1e-9)
        assert residual(got) < 1e-12


def test_stepped_rolling_friction_stops_and_holds():
    floor = face("floor", (-1.0, 0.0), (9.0, 0.0), restitution=0.0, friction=0.6)
    m = lone(
        (0.0, 0.01), (0.25, 0.0), until=20.0, particle={"spin": True}, surface=[floor], run=STEPPED
    )
    m = replace(m, rolling=np.array([0.02]), until="settled")
    got = run(m)
    # Slides, r dω/dt = 2 g (µ - arm/r), until it rolls, then to rest: a = g arm/r · 2/3. A step
    # that takes 1 mm/s or less is calm, and 0.1 s of that are rest.
    slides = 0.25 / (G * (3.0 * 0.6 - 2.0 * 0.02))
    rolls = (0.25 - 0.6 * G * slides) / (0.02 * G / 1.5)
    assert got.select(Kind.SETTLE)["t"][0] == pytest.approx(slides + rolls + 0.1, abs=0.01)
    assert got.by_surface[0, 2] == pytest.approx(0.5 * 0.1 * 0.25**2, rel=1e-6)
    assert residual(got) < 1e-12
    beta = radians(1.0)
    along = np.array([cos(beta), -sin(beta)])
    ramp = face("ramp", (-along).tolist(), along.tolist(), restitution=0.0, friction=0.6)
    m = lone(
        (0.01 * sin(beta), 0.01 * cos(beta)), until=1.0, particle={"spin": True}, surface=[ramp],
        run=STEPPED,
    )  # fmt: skip
    ends = run(replace(m, rolling=np.array([tan(radians(1.5))]))).track(0)["position"][[0, -1]]
    assert hypot(*(ends[1] - ends[0])) < 1e-5


def conveyor(slope, length, speed, friction, run_table, radius=0.1, dt=1e-3):
    """A conveyor that rises: its belt from (0, 0) on top, pulleys below both ends, return below."""
    along, up = np.array([cos(slope), sin(slope)]), np.array([-sin(slope), cos(slope)])
    low = -2.0 * radius * up
    surface = face("top", (0.0, 0.0), (length * along).tolist(), friction=friction, speed=speed)
    back = face(
        "back", (length * along + low).tolist(), low.tolist(), friction=friction, speed=speed
    )
    start = 0.01 * up + 0.2 * along
    m = lone(start, until=3.0, dt=dt, surface=[surface, back], run=run_table)
    m = replace(m, segments=replace(m.segments, restitution=np.zeros(2)))
    wheel = {"speed": speed, "friction": friction}
    centers = [tuple(end - radius * up) for end in (0.0 * along, length * along)]
    whole = {"radius": radius, "begin": 0.0, "extent": 2.0 * pi, **wheel}
    return bent(m, *({"center": center, **whole} for center in centers)), along


@pytest.mark.parametrize("run_table", [{}, STEPPED])
def test_an_inclined_conveyor_lifts_what_grips_it_and_throws_it_off_its_pulley(run_table):
    # a = g (µ cos β - sin β) up to the belt's speed v, then carried; v² >= g ρ cos β leaves at the
    # tangent point; the belt pays m (g rise + v²/2) and the slip's heat.
    slope, length, speed, friction = radians(10.0), 1.5, 1.5, 0.5
    m, along = conveyor(slope, length, speed, friction, run_table)
    got = run(m)
    a = G * (friction * cos(slope) - sin(slope))
    t = speed / a + (length - 0.2 - speed**2 / (2.0 * a)) / speed
    left = got.select(Kind.SEPARATION)[-1]
    off = 5e-3 if run_table else 1e-5
    assert left["t"] == pytest.approx(t, abs=3.0 * off)
    assert left["velocity_after"] == pytest.approx(speed * along, abs=3.0 * off)
    work, heat = got.by_surface[:, 0].sum(), got.by_surface[:, 2].sum()
    slips = 0.1 * G * friction * cos(slope) * (speed**2 / (2.0 * a))
    assert heat == pytest.approx(slips, rel=0.02 if run_table else 1e-6)
    rise = (length - 0.2) * sin(slope)
    assert work == pytest.approx(0.1 * (G * rise + 0.5 * speed**2) + slips, rel=5e-3)
    assert residual(got) < 1e-4
    assert not len(got.select(Kind.IMPACT))


# Strings


def hung(machine, position, length, anchors):
    machine = thrown(machine, position)
    joints = (Joint("string", n, length, tuple(a)) for n, a in enumerate(anchors))
    return replace(machine, joints=tuple(joints))


def test_a_pendulum_swings_as_its_equation_and_its_string_takes_nothing():
    # From rest at θ0 it hangs straight down after 5/4 of its period 4 sqrt(L/g) K(sin²(θ0/2)).
    length, angle, errors = 0.5, radians(50.0), []
    end = 5.0 * sqrt(length / G) * ellipk(sin(0.5 * angle) ** 2)
    for dt in (4e-3, 1e-3):
        m = lone((0.0, 0.0), until=end, dt=dt)
        m = hung(m, [(length * sin(angle), -length * cos(angle))], length, [(0.0, 0.0)])
        got = run(m)
        x, y = got.track(0)[-1]["position"]
        errors.append(abs(atan2(x, -y)))
        assert residual(got) < 1e-12
        taken = got.by_surface[-1, 1] / (0.1 * G * length * (1.0 - cos(angle)))
        assert abs(taken) < 2e-4 * (dt / 4e-3)
    assert errors[-1] < 2e-4
    assert errors[0] / errors[-1] > 12.0


def test_a_string_whose_particle_still_rides_the_belt_is_not_tied_when_time_ends():
    """Tied once the ride is over, after 0.5 s: a run that ends before has a track to its end."""
    tables = {
        "incoming": {"speed": 2.0, "pulley_radius": 0.1},
        "string": [{"from": [0.0, 2.0], "length": 5.0}],
    }
    for until, ways in ((0.1, 0.2), (0.7, 1.4)):
        track = run(build(from_dict({**tables, "run": {"until": until}}))).track(0)
        assert track["t"][-1] == pytest.approx(until, rel=1e-12)
        assert track["position"][-1, 0] - track["position"][0, 0] == pytest.approx(ways, rel=1e-12)


# Boxes


def boxed(machine, size, position, *, restitution=0.0, friction=0.5, slope=0.0):
    """Return the machine with boxes of some width and height, turned by -`slope` (rad)."""
    machine, (w, h) = thrown(machine, position), size
    corners = 0.5 * np.array([[-w, -h], [w, -h], [w, h], [-w, h]])
    c, s = cos(slope), sin(slope)
    mass = machine.particle.mass
    return replace(
        machine, outlines=(corners @ np.array([[c, -s], [s, c]]),),
        particle=replace(
            machine.particle, radius=0.5 * hypot(w, h), inertia=mass * (w * w + h * h) / 12.0
        ),
        pair_restitution=np.full((1, 1), restitution), pair_friction=np.full((1, 1), friction),
    )  # fmt: skip


def turned(recording, particle):
    """Return by how much a particle turned, rad: ω is linear between knots."""
    track = recording.track(particle)
    return float((0.5 * (track["omega"][1:] + track["omega"][:-1]) * np.diff(track["t"])).sum())


def ramp_of(slope, friction):
    along = np.array([cos(slope), -sin(slope)])
    surface = face("ramp", (-along).tolist(), (9.0 * along).tolist(), friction=friction)
    return surface | {"restitution": 0.0}, along, np.array([sin(slope), cos(slope)])


@pytest.mark.parametrize(("degrees", "tips"), [(25.0, False), (28.0, True)])
def test_a_box_tips_where_its_weight_is_beyond_its_edge(degrees, tips):
    # Width over height is 0.5: tan β = 0.5 at 26.6°.
    slope = radians(degrees)
    surface, _, normal = ramp_of(slope, 2.0)
    m = lone((0.0, 1.0), until=0.5, surface=[surface])
    got = run(boxed(m, (0.05, 0.1), [0.05 * normal], slope=slope))
    assert abs(turned(got, 0)) > 1.0 if tips else abs(turned(got, 0)) < 1e-3


def test_a_box_that_falls_flat_bounces_as_a_point_does_and_comes_to_rest():
    floor = face("floor", (-1.0, 0.0), (1.0, 0.0), restitution=0.3, friction=0.5)
    left = []
    for dt in (2e-3, 5e-4):
        m = boxed(lone((0.0, 1.0), until=1.0, dt=dt, surface=[floor]), (0.1, 0.06), [(0.0, 0.2)])
        got = run(m)
        hit = got.select(Kind.IMPACT)[0]
        # One event for both corners: J = m (1 + e) v, and the weight of a step.
        v = -hit["velocity_before"][1]
        assert v == pytest.approx(sqrt(2.0 * G * 0.17), abs=G * 2.0 * dt)
        assert hit["normal_impulse"] == pytest.approx(0.1 * (1.3 * v + G * dt), rel=1e-8)
        last = got.track(0)[-1]
        assert last["position"] == pytest.approx([0.0, 0.03], abs=2e-4)
        assert np.abs(last["velocity"]).max() < 1e-4
        left.append(residual(got) / (0.1 * G * 0.17))
    # What the overlap at a blow lifts it by is no impulse's work.
    assert left[-1] < 1e-3
    assert left[0] / left[-1] > 3.0


def test_the_angle_of_a_box_is_that_of_its_body():
    """Dropped on an edge it tumbles and lies: its lowest corner is on the floor, at y = 0.

    Of a box w wide and h high at an angle a that is (w |sin a| + h |cos a|)/2 below its centre.
    What parts overlaps turns it without an ω, so the sum of ω is off by more.
    """
    floor = face("floor", (-1.0, 0.0), (1.0, 0.0), restitution=0.3, friction=0.5)
    width, height, slope = 0.1, 0.06, radians(30.0)
    m = lone((0.0, 1.0), until=1.5, surface=[floor])
    m = boxed(m, (width, height), [(0.0, 0.2)], restitution=0.3, slope=slope)
    got = run(m)
    assert got.angle.shape == got.knots.shape
    assert got.angle[0] == 0.0

    def above(angle):
        a = angle - slope
        return got.knots["position"][-1, 1] - 0.5 * (width * abs(sin(a)) + height * abs(cos(a)))

    assert abs(turned(got, 0)) > 0.3
    assert above(got.angle[-1]) == pytest.approx(0.0, abs=1e-4)
    assert abs(above(turned(got, 0))) > 5.0 * abs(above(got.angle[-1]))


def test_what_goes_round_without_getting_on_is_told(monkeypatch):
    """In a bowl 50 nm wider than the disk it swings 2,000 times a second."""
    monkeypatch.setattr("chutelab.engines.pymunk.lone.WINDOW", 3000)
    machine = lone([0.004, 0.3], particle={"radius": 0.05 - 5e-8, "spin": True})
    bowl = {"center": (0.0, 0.0), "radius": 0.05, "begin": -pi, "extent": pi, "friction": 0.4}
    machine = bent(machine, bowl)
    with pytest.raises(StalledError, match=r"3000 steps gain less than 100 times run\.dt"):
        run(machine)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "most"), [("galton", 0.05), ("heap", 0.02)])
def test_the_ledger_of_a_shipped_crowd_closes_but_for_some_percent(name, most):
    """Its overlaps are pressed apart, which is in no entry."""
    assert simulate(load(name), engine="pymunk").ledger.relative_residual < most


@pytest.mark.slow
def test_grains_that_fall_by_more_than_a_radius_in_a_step_go_through_a_floor_and_it_is_told():
    """They fall 0.6 m and are 2 to 3 mm large: v dt = 3.4 mm, and others press on them."""
    recording = judged(load("mixture"), engine="pymunk")
    (broken,) = (one for one in recording.laws if one.law == "nothing through a surface")
    assert broken.surface == "first_bin"
    assert recording.radius[broken.particle] < sqrt(2.0 * 9.81 * 0.6) * recording.machine.dt
    assert recording.ledger.relative_residual < 0.05


@pytest.mark.parametrize("seed", [0, 1])
def test_boxes_in_a_bowl_lose_to_friction_and_do_not_gain_from_it(seed):
    """Contacts of a step are solved together: one may seem to give what others take.

    Contact by contact J_t (u_t + u'_t) / 2 came to +0.022 and +0.005 J on the bowl. The sum over
    the contacts of a step is what it was, so the ledger closes as well as the step allows.
    """
    bowl = {"name": "bowl", "center": [0.0, 0.3], "radius": 0.3, "from_deg": 190, "to_deg": 350}
    scene = {
        "particle": {"shape": "box", "size": [0.04, 0.03], "mass": 0.1, "spin": True},
        "surface": [{**bowl, "friction": 0.5, "restitution": 0.0}],
        "stream": {"count": 6, "fill": [[-0.15, 0.15], [0.15, 0.35]], "interact": True,
                   "friction": 0.5, "restitution": 0.0, "seed": seed},
        "run": {"until": 1.0, "dt": 1e-3},
    }  # fmt: skip
    ledger = simulate(from_dict(scene), engine="pymunk").ledger
    assert ledger.by_surface["bowl"]["friction_loss"] > 0.0
    assert ledger.friction_loss > ledger.by_surface["bowl"]["friction_loss"]
    assert abs(ledger.residual) < 5e-3 * ledger.turned_over


def test_losses_at_rest_are_set_against_each_other_only_if_they_are_more_than_rounding(monkeypatch):
    """In a heap at rest nothing is lost: what is booked is rounding, of an impulse p it is ε p²/m.

    In 8 layers p is up to 8 m g dt, so n disks with less than four contacts each are off by less
    than 4 n ε p²/m. The ledger is that of a run in which all steps are set off, to rounding.
    """
    scene = from_dict({
        "particle": {"radius": 0.02, "mass": 0.05},
        "surface": [
            {"name": "floor", "from": [-0.1, 0.0], "to": [0.1, 0.0]},
            {"name": "left", "from": [-0.1, 0.0], "to": [-0.1, 2.0]},
            {"name": "right", "from": [0.1, 0.0], "to": [0.1, 2.0]},
        ],
        "stream": {"count": 30, "fill": [[-0.08, 0.03], [0.08, 0.6]], "interact": True},
        "run": {"until": 2.0, "dt": 2e-3},
    })  # fmt: skip
    steps, gained, real = [], [], shared.balance

    def watched(losses, *contacts):
        before, gain = losses.copy(), -np.minimum(losses, 0.0).sum()
        real(losses, *contacts)
        if (losses != before).any():
            gained.append(gain)

    monkeypatch.setattr(shared, "balance", watched)
    ledgers = []
    for rounding in (world.ROUNDING, 0.0):
        monkeypatch.setattr(world, "ROUNDING", rounding)
        ledgers.append(simulate(scene, engine="pymunk").ledger)
        steps.append(len(gained))
    least = np.finfo(float).eps * (8.0 * 0.05 * 9.81 * 2e-3) ** 2 / 0.05
    assert min(gained[: steps[0]]) > 0.01 * least
    assert 20 < steps[0] < 0.5 * (steps[1] - steps[0])
    assert 0.0 < max(gained[steps[0] :][-300:]) < 4.0 * 30 * least
    turned = ledgers[0].turned_over
    for name in ("friction_loss", "restitution_loss", "residual"):
        one, other = (getattr(ledger, name) for ledger in ledgers)
        assert one == pytest.approx(other, abs=1e-14 * turned)
