"""Boxes and polygons in the contact engine, by closed forms; and against Pymunk."""

from dataclasses import replace
from math import atan2, cos, degrees, hypot, pi, sin, sqrt, tan

import numpy as np
import pytest

import chutelab
from chutelab import SceneError
from chutelab.engines import simulation
from chutelab.machine import build
from chutelab.results import laws
from chutelab.scene import to_dict
from shared import seeds

G, M, W, H = 9.81, 0.1, 0.04, 0.02
"""m/s², kg, and width and height of the box, m."""
INERTIA = M * (W * W + H * H) / 12.0


def turned(points, angle):
    """Return points turned counterclockwise, rad."""
    c, s = cos(angle), sin(angle)
    return [[c * x - s * y, s * x + c * y] for x, y in points]


def corners(width=W, height=H):
    x, y = 0.5 * width, 0.5 * height
    return [(-x, -y), (x, -y), (x, y), (-x, y)]


def scene(at, velocity=(0.0, 0.0), *, angle=0.0, size=(W, H), e=0.0, mu=0.0, surface=None, **more):
    """Return a scene of one box on a floor, released at an angle, rad."""
    floor = {"name": "floor", "from": [-3.0, 0.0], "to": [3.0, 0.0]} | (surface or {})
    particle = {"shape": "box", "size": list(size), "mass": M}
    stream = {"at": list(at), "velocity": list(velocity), "angle_deg": degrees(angle)}
    return {
        "particle": {**particle, "spin": True},
        "surface": [{"restitution": e, "friction": mu, **floor}],
        "stream": stream | more.pop("stream", {}),
        "run": {"until": 0.5} | more.pop("run", {}), **more,
    }  # fmt: skip


def run(tables, engine="contact", **more):
    """Return a run whose laws hold and whose ledger closes."""
    recording = chutelab.simulate(tables, engine=engine, **more)
    assert not recording.laws
    ledger = recording.ledger
    # What parts overlaps is in no entry of Pymunk's.
    share = 1e-11 if engine == "contact" else 1e-2
    assert abs(ledger.residual) <= share * max(ledger.turned_over, 1e-3)
    return recording


def state(recording, t):
    """Return place, velocity, angle and angular velocity of particle 0."""
    now = recording.at(np.array([t]))
    return now.position[0, 0], now.velocity[0, 0], now.angle[0, 0], now.omega[0, 0]


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_a_flight_is_a_parabola_and_an_even_turn(engine):
    u, v, omega, t, first = 0.7, 1.1, 13.0, 0.37, -0.6
    tables = scene((0.0, 2.0), (u, v), angle=first, stream={"omega": omega}, run={"until": 0.4})
    place, velocity, angle, turns = state(run(tables, engine), t)
    assert place == pytest.approx([u * t, 2.0 + v * t - 0.5 * G * t * t], abs=1e-13)
    assert velocity == pytest.approx([u, v - G * t], abs=1e-13)
    assert angle == pytest.approx(first + omega * t, abs=1e-13)
    assert turns == omega


@pytest.mark.parametrize(("engine", "off"), [("contact", 1e-10), ("pymunk", 2e-4)])
@pytest.mark.parametrize("share", [0.9, 0.98, 1.001, 1.2])
def test_a_block_slides_down_a_slope_where_that_is_steeper_than_friction(share, engine, off):
    """a = g (sin - mu cos), and it stays where tan < mu."""
    slope, t = 0.35, 0.4
    mu = share * tan(slope)
    way = {"from": [3.0 * -cos(slope), 3.0 * sin(slope)], "to": [cos(slope), -sin(slope)]}
    at = (0.5 * H * sin(slope), 0.5 * H * cos(slope))
    place, velocity, angle, _ = state(
        run(scene(at, angle=-slope, mu=mu, surface=way, run={"until": t}), engine), t
    )
    gone = 0.5 * max(G * (sin(slope) - mu * cos(slope)), 0.0) * t * t
    assert place == pytest.approx([at[0] + gone * cos(slope), at[1] - gone * sin(slope)], abs=off)
    assert angle == pytest.approx(-slope, abs=off)
    assert hypot(*velocity) == pytest.approx(2.0 * gone / t, abs=off)


@pytest.mark.parametrize("more", [-0.01, 0.01])
def test_a_box_tips_where_its_centre_is_beyond_its_edge(more):
    """On a rough slope of tan = width / height."""
    slope = atan2(0.01, 0.03) + more
    way = {"from": [3.0 * -cos(slope), 3.0 * sin(slope)], "to": [cos(slope), -sin(slope)]}
    at = (0.015 * sin(slope), 0.015 * cos(slope))
    tables = scene(at, angle=-slope, size=(0.01, 0.03), mu=10.0, surface=way, run={"until": 0.3})
    angle = state(run(tables), 0.3)[2]
    assert (abs(angle + slope) < 1e-9) == (more < 0.0)
    assert more < 0.0 or angle + slope < -0.1


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_what_is_turned_at_its_release_does_the_same_as_what_is_written_turned(engine):
    """It falls on its corner, and a release that its turned corner would reach into is refused."""
    first, low = 0.4, -min(y for _, y in turned(corners(), 0.4))
    tables = scene((0.0, low + 0.05), angle=first, e=0.3, mu=0.5, run={"until": 0.3})
    by_key = chutelab.simulate(tables, engine=engine)
    written = {"shape": "polygon", "points": turned(corners(), first), "mass": M, "spin": True}
    stream = tables["stream"] | {"angle_deg": 0.0}
    plain = chutelab.simulate({**tables, "particle": written, "stream": stream}, engine=engine)
    place, velocity, angle, turns = state(by_key, 0.25)
    other = state(plain, 0.25)
    assert place == pytest.approx(other[0], abs=1e-9)
    assert velocity == pytest.approx(other[1], abs=1e-7)
    assert (angle - first, turns) == pytest.approx(other[2:], abs=1e-6)
    assert plain.events["t"][1] == pytest.approx(np.sqrt(0.1 / G), abs=2e-3)
    with pytest.raises(SceneError, match=f"at least {low:g} m"):
        build(chutelab.load({**tables, "stream": tables["stream"] | {"at": [0.0, low - 1e-4]}}))


@pytest.mark.parametrize("size", [(0.04, 0.12), (0.03, 0.06)])
def test_a_rocking_block_loses_as_housner_says(size):
    """omega after each blow is 1 - 3/2 sin² alpha of that before; and its first quarter.

    G. W. Housner, Bull. Seism. Soc. Am. 53 (1963): no bounce, no slip. From the angle theta its
    energy gives the rate: I omega² / 2 = m g R (cos(alpha - theta) - cos(alpha - angle)).
    """
    b, h = 0.5 * size[0], 0.5 * size[1]
    alpha, radius = atan2(b, h), hypot(b, h)
    theta = 0.5 * alpha
    low = min(y for _, y in turned(corners(*size), -theta))
    tables = scene((0.0, -low), angle=-theta, size=size, mu=1e3, run={"until": 1.0, "dt": 5e-4})
    events = run(tables).events
    blows = events[(events["kind"] == chutelab.results.Kind.IMPACT) & (events["t"] > 0.0)][:4]
    ratio = blows["omega_after"] / blows["omega_before"]
    assert ratio == pytest.approx(1.0 - 1.5 * sin(alpha) ** 2, abs=3e-5)
    # With theta - angle = u² the integrand is smooth.
    nodes, weights = np.polynomial.legendre.leggauss(40)
    u = 0.5 * np.sqrt(theta) * (nodes + 1.0)
    rates = np.sqrt(
        1.5 * G / radius * (cos(alpha - theta) - np.cos(alpha - theta + u * u))
    )  # fmt: skip
    quarter = float((0.5 * np.sqrt(theta) * weights * 2.0 * u / rates).sum())
    assert blows["t"][0] == pytest.approx(quarter, rel=1e-5)


@pytest.mark.parametrize("omega", [0.0, 5.0])
def test_without_loss_a_box_bounces_on_its_face_and_on_its_corner_with_all_its_energy(omega):
    """A corner's impulse is (1 + e) v / (1/m + r² / I), r its way from below the centre."""
    tables = scene((0.0, 0.3), e=1.0, stream={"omega": omega}, run={"until": 2.0})
    recording = run(tables)
    knots = recording.knots
    energy = 0.5 * M * (knots["velocity"] ** 2).sum(axis=1) + 0.5 * INERTIA * knots["omega"] ** 2
    energy += M * G * knots["position"][:, 1]
    assert energy == pytest.approx(0.5 * INERTIA * omega**2 + M * G * 0.3, rel=1e-13)
    blow = recording.events[1]
    t, v = blow["t"], blow["velocity_before"][1]
    x, y = min(turned(corners(), omega * t), key=lambda corner: corner[1])
    assert blow["position"][1] + y == pytest.approx(0.0, abs=1e-15)
    closing = -(v + omega * x)
    feels = 1.0 / M + (x * x / INERTIA if omega else 0.0)
    assert blow["normal_impulse"] == pytest.approx(2.0 * closing / feels, rel=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.01, -0.02, 0.3])
def test_a_floor_of_pieces_is_a_floor(angle):
    """A box lands across the joints of pieces: both corners at once, however short they are."""
    whole, short = [[-3.0, 0.0], [3.0, 0.0]], [[-3.0 + 0.005 * n, 0.0] for n in range(1201)]
    ways = []
    joints = ([whole[0], [x, 0.0], whole[1]] for x in (0.01, 0.045, 0.06))
    for points in (whole, *joints, short):
        floor = {"name": "floor", "points": points}
        tables = scene((0.0, 0.1), (0.3, 0.0), angle=angle, e=0.5, mu=0.3, surface=floor)
        del tables["surface"][0]["from"], tables["surface"][0]["to"]
        recording = run(tables)
        now = recording.at(np.linspace(0.1, 0.5, 41))
        losses = recording.ledger.restitution_loss, recording.ledger.friction_loss
        ways.append([*now.position[:, 0].flat, *now.angle.flat, *losses])
    assert np.abs(np.array(ways) - ways[0]).max() < 1e-8


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_boxes_that_meet_keep_momentum_and_angular_momentum(friction):
    particle = {"shape": "box", "size": [W, H], "mass": M, "spin": True}
    tables = {
        "gravity": 0.0, "particle": particle,
        "surface": [{"name": "far", "from": [0.5, -0.5], "to": [0.5, 0.5]}],
        "stream": [
            {"at": [0.0, 0.0], "velocity": [0.5, 0.0], "omega": 4.0, "interact": True,
             "restitution": 0.7, "friction": friction},
            {"at": [0.1, 0.013], "velocity": [-0.6, 0.1], "omega": -7.0},
        ],
        "run": {"until": 0.3},
    }  # fmt: skip
    recording = run(tables)
    assert (recording.events["kind"] == chutelab.results.Kind.COLLISION).any()

    def all_of(t):
        now = recording.at(np.array([t]))
        x, v, omega = now.position[0], now.velocity[0], now.omega[0]
        turning = M * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]) + INERTIA * omega
        return [*(M * v).sum(axis=0), turning.sum()]

    assert all_of(0.299) == pytest.approx(all_of(0.0), abs=1e-15)


def test_a_stack_of_three_rests_and_sleeps_and_a_ball_lies_on_it():
    row = {"velocity": [0.0, 0.0], "interact": True, "friction": 0.5, "restitution": 0.2}
    tables = {
        "particle": [
            {"name": "box", "shape": "box", "size": [W, H], "mass": M, "spin": True},
            {"name": "ball", "radius": 0.01, "mass": 0.05, "spin": True},
        ],
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "friction": 0.5}],
        "stream": [
            {"particle": "box", "count": 3, "at": [0.0, 0.01], "to": [0.0, 0.05], **row},
            {"particle": "ball", "at": [0.0, 0.075], "velocity": [0.0, 0.0]},
        ],
        "run": {"until": 2.0},
    }  # fmt: skip
    recording = run(tables)
    now = recording.at(np.array([1.9]))
    heights = [0.01, 0.03, 0.05, 0.07]
    assert now.position[0] == pytest.approx(np.array([[0.0, y] for y in heights]), abs=2e-5)
    assert now.angle[0, :3] == pytest.approx(np.zeros(3), abs=1e-4)
    assert not now.velocity.any()
    assert recording.steps < 1000


def test_a_belt_takes_a_box_along():
    """It gets mu g until it is as fast, by when it is v² / 2 mu g behind the belt."""
    v, mu, t = 0.6, 0.3, 0.5
    belt = {"speed": v}
    place, velocity, angle, _ = state(run(scene((0.0, 0.5 * H), mu=mu, surface=belt)), t - 1e-9)
    assert place[0] == pytest.approx(v * t - v * v / (2.0 * mu * G), abs=1e-6)
    assert velocity == pytest.approx([v, 0.0], abs=1e-9)
    assert angle == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_a_box_waits_until_the_one_in_its_place_has_fallen_out_of_it(engine):
    """By g t² / 2 = h."""
    row = {"velocity": [0.0, 0.0], "interact": True}
    two = scene((0.3, 0.5), (0.0, 0.0), surface={"from": [-1.0, -2.0], "to": [1.0, -2.0]})
    two["stream"] = [{"at": [x, 0.5], **row} for x in (0.3, 0.31)]
    released = chutelab.simulate(two, {"run.until": 0.2}, engine=engine).select("release")["t"]
    assert released.tolist() == pytest.approx([0.0, np.sqrt(2.0 * H / G)], abs=2e-3)


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
@pytest.mark.parametrize("taken", ["by a disk", "by a surface"])
def test_a_box_waits_until_what_is_round_or_a_surface_has_left_its_place(engine, taken):
    """A disk falls by g t² / 2 = r + h / 2, a travel (d in 1 s) begins with 2 d t² = h / 2."""
    r, d, at = 0.015, 0.4, {"at": [0.3, 0.5], "velocity": [0.0, 0.0], "interact": True}
    floor = {"name": "floor", "from": [-1.0, -2.0], "to": [1.0, -2.0]}
    arm = {"name": "arm", "from": [0.2, 0.5], "to": [0.4, 0.5],
           "travel": {"to": [0.2, 0.5 - d], "at": 0.0, "in": 1.0}}  # fmt: skip
    box = {"name": "box", "shape": "box", "size": [W, H], "mass": M}
    disk = {"particle": "disk", **at, "at": [0.3, 0.5 + (taken == "by a surface")]}
    tables = {
        "particle": [box, {"name": "disk", "radius": r, "mass": M}],
        "stream": [disk, {"particle": "box", "start": 0.02, **at}],
        "surface": [floor, arm][: 1 + (taken == "by a surface")], "run": {"until": 0.3},
    }  # fmt: skip
    released = chutelab.simulate(tables, engine=engine).select("release")
    goes = sqrt(2.0 * (r + 0.5 * H) / G) if taken == "by a disk" else sqrt(H / (4.0 * d))
    assert released["t"][released["particle"] == 1] == pytest.approx(goes, abs=2e-3)


def drawn(seed):
    """A box or polygon that turns and strikes a surface or a disk, rough and elastic as drawn."""
    random = np.random.default_rng(seed)
    count = int(random.integers(3, 7))
    around = (np.arange(count) + random.uniform(-0.3, 0.3, count)) * 2.0 * pi / count
    points = np.stack([np.cos(around), np.sin(around)], axis=1) * random.uniform(0.01, 0.03)
    kind = {"shape": "polygon", "points": points.tolist(), "mass": float(random.uniform(0.02, 0.2)),
            "spin": True, "name": "stone"}  # fmt: skip
    slope = random.uniform(-0.5, 0.5)
    pair = {"restitution": float(random.uniform(0.1, 0.9)),
            "friction": max(float(random.uniform(-0.3, 0.8)), 0.0)}  # fmt: skip
    ends = 0.06 * np.array([cos(slope), sin(slope)])
    surfaces = {
        0: {"from": (-ends).tolist(), "to": ends.tolist()},
        1: {"from": [0.0, 0.0], "to": (9.0 * ends).tolist()},
        2: {"center": [0.0, -0.08], "radius": 0.08, "from_deg": 0.0, "to_deg": 180.0},
        3: {"center": [0.0, -0.05], "radius": 0.05, "from_deg": 0.0, "to_deg": 360.0},
    }
    surface = {"name": "board", **surfaces[int(random.integers(4))], **pair}
    scene = {
        "particle": [kind, {"name": "ball", "radius": 0.012, "mass": 0.05}],
        "surface": [surface],
        "stream": [{"particle": "stone", "at": [random.uniform(-0.03, 0.03), 0.13],
                    "velocity": random.uniform(-0.3, 0.3, 2).tolist(),
                    "omega": random.uniform(-15.0, 15.0)}],
    }  # fmt: skip
    if random.random() < 0.4:
        scene["stream"][0] |= {"interact": True, **pair}
        scene["stream"].append({"particle": "ball", "at": [0.01, 0.05], "velocity": [0.0, 1.0]})
    return scene


TIMES, COARSE, FINE = np.linspace(0.004, 0.296, 74), 1e-4, 1e-5
"""s: when places are compared; steps of Pymunk."""


def ways(tables, engine="contact", dt=1e-3, *, push=0.0, shift=(0.0, 0.0)):
    """Return places, and angles on an arm of 20 mm, (T, N, 3), m; the first is pushed and moved."""
    first, *others = tables["stream"]
    first = {**first, "at": [a + b for a, b in zip(first["at"], shift, strict=True)],
             "velocity": [v + push for v in first["velocity"]]}  # fmt: skip
    run = {"until": 0.3, "dt": dt}
    recording = chutelab.simulate({**tables, "stream": [first, *others], "run": run}, engine=engine)
    now = recording.at(TIMES)
    return np.concatenate([now.position, 0.02 * now.angle[..., None]], axis=2), recording


def off(one, other):
    """Return by how much ways differ at each time, at most so far, (T,), m."""
    return np.maximum.accumulate(np.nan_to_num(np.abs(one - other)).max(axis=(1, 2)))


@pytest.mark.parametrize("seed", seeds(2, 100))
@pytest.mark.filterwarnings("ignore:LAW BROKEN")
def test_both_engines_go_the_same_way(seed):
    """As long as a push of 1e-9 m/s grows to less than fifty times its way.

    Chipmunk finds a blow up to a step late, so by the way of a step further in: that moves the
    ways as much as so large a shift at the start does, of two steps in four directions; where that
    is more than 10 mm they are not compared. A face that it finds at two corners at once, where one
    comes first, is struck otherwise: then a tenth of the step has to be twice as near. Of seed 56 a
    blow on an arc, at 134 rad/s, is 2 % weaker there, which is not explained. Of seed 91 the first
    blow has an arm 0.3 % shorter there, so that at 108 rad/s the next is 0.3 ms late, at any step.
    """
    if seed in (56, 91):
        pytest.xfail("a blow in Chipmunk is weaker, or has another arm, than by Newton's law")
    tables = drawn(seed)
    mine, recording = ways(tables)
    calm = off(ways(tables, push=1e-9)[0], mine) < 50.0 * 1e-9 * TIMES
    way = 2.0 * COARSE * 1.7
    shifts = [(way, 0.0), (-way, 0.0), (0.0, way), (0.0, -way)]
    moved = np.max([off(ways(tables, shift=shift)[0], mine) for shift in shifts], axis=0)
    until = TIMES[calm & (moved < 0.01)].max(initial=0.0)
    events = recording.events
    blows = events["t"][np.isin(events["kind"], [3, 5])]
    if not (blows < until - 0.01).any():
        pytest.skip("no blow that is known well enough")
    known = np.searchsorted(TIMES, until, side="right") - 1
    bound = 2.0 * moved[known] + 8.0 * COARSE
    coarse = off(ways(tables, "pymunk", COARSE)[0], mine)[known]
    if coarse > bound:
        theirs, other = ways(tables, "pymunk", FINE)
        hits, body = other.select("impact"), other.machine.particle
        mass, inertia = (float(np.ravel(part)[0]) for part in (body.mass, body.inertia))
        before, after = (
            mass * (hits[f"velocity_{when}"] ** 2).sum(axis=1)
            + inertia * hits[f"omega_{when}"] ** 2
            for when in ("before", "after")
        )
        if (after > 1.01 * before)[hits["t"] < until].any():
            pytest.skip("a blow gives energy in Chipmunk, where friction is less here")
        fine = off(theirs, mine)[known]
        assert fine < 0.5 * coarse, (coarse, fine, bound)


@pytest.mark.parametrize(
    ("more", "key"),
    [
        ({"particle": {"rolling_friction": 0.1}}, "particle.rolling_friction"),
        ({"pair": [{"between": ["stone", "floor"], "cohesion": 0.1}]}, "pair[0].cohesion"),
    ],
)  # fmt: skip
def test_what_the_engine_lacks_is_refused_by_name_and_left_to_pymunk(more, key):
    tables = scene(
        (0.0, 0.3), **{k: v for k, v in more.items() if k not in ("particle", "surface")}
    )
    tables["particle"] |= {"name": "stone", **more.get("particle", {})}
    tables["surface"] += more.get("surface", [])
    with pytest.raises(SceneError) as told:
        chutelab.simulate(tables, engine="contact")
    assert key in str(told.value)
    assert simulation.choose(build(chutelab.load(tables))) == "pymunk"


def test_auto_takes_the_contact_engine_for_boxes():
    assert simulation.choose(build(chutelab.load("dominoes"))) == "contact"


def test_a_box_that_lies_over_the_end_of_an_arc_is_on_its_inside_with_the_corner_in_it():
    """Its centre has left the circle then. Nothing gives energy: what is lost stays lost."""
    step = 2e-4
    run = chutelab.simulate({
        "particle": {"shape": "box", "size": [0.07705265544402617, 0.015410531088805236],
                     "mass": 0.01, "spin": True},
        "surface": [{"name": "bowl", "center": [-0.7375967737249944, -0.35],
                     "radius": 0.08879624971305165, "from_deg": 234.23342208729576,
                     "to_deg": 331.80760496383243, "friction": 0.0, "restitution": 0.0,
                     "hinge": [-0.8711225082101356, -0.40420379797038586], "mass": 1.0,
                     "spring": 3.6465009803206145, "damper": 0.07969766316292792}],
        "stream": {"at": [-0.75, 0.1222183804443886], "to": [-0.75, 0.6422183804443886],
                   "count": 1, "interact": True, "friction": 0.2,
                   "restitution": 0.06993067616040616,
                   "velocity": [-0.15598830904689298, -0.5433514644421094]},
        "run": {"until": 0.52, "dt": step, "engine": "contact"},
    })  # fmt: skip
    lost = run.energy_at(np.arange(0.2, 0.519, step))
    assert np.diff(lost["restitution_loss"]).min() > -1e-7


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("gap", [1e-4, 1e-3])
def test_a_box_that_slides_into_a_bowl_over_its_end_stays_inside(friction, gap):
    """Upright along the wall, it reaches out of the opening: its centre is outside the circle.

    No corner is beyond the arc. Where the box is moved outwards, the law tells.
    """
    tables = scene((-0.09 + gap, 0.0815), angle=0.5 * pi, size=(0.16, 0.02), mu=friction)
    bowl = {"center": [0.0, 0.0], "radius": 0.1, "from_deg": 180.0, "to_deg": 360.0}
    tables["surface"] = [{"name": "bowl", "friction": friction, "restitution": 0.0, **bowl}]
    recording = run(tables | {"run": {"until": 0.1}})

    def beyond(recording):
        now, far = recording.at(np.linspace(0.0, 0.1, 400)[1:-1]), []
        for at, angle in zip(now.position[:, 0], now.angle[:, 0], strict=True):
            x, y = (at + turned(corners(0.16, 0.02), angle)).T
            far += [*np.hypot(x, y)[y < 0.0] - 0.1]
        return max(far)

    assert abs(beyond(recording)) < 1e-5
    knots = recording.knots.copy()
    knots["position"][knots["t"] > 0.07, 0] -= 0.008
    moved = replace(recording, knots=knots)
    (told,) = moved.laws
    assert told.law == laws.INSIDE
    # The end of the arc is less deep in the box than its corner is beyond the arc.
    assert 0.004 < told.amount < beyond(moved) < 0.008


@pytest.mark.parametrize(
    ("omega", "angle"), [(-40.0, 36.0), (0.0, 9.0), (20.0, 54.0), (40.0, 45.0)]
)
def test_what_lands_spinning_without_weight_is_given_no_energy(omega, angle):
    """Of 1/2 m v² + 1/2 I ω² = 6.6 J an arc takes a part: nothing hops faster than it fell."""
    corners = [(0.009 * cos(0.4 * pi * k), 0.009 * sin(0.4 * pi * k)) for k in range(5)]
    run = chutelab.simulate({
        "gravity": 0.0,
        "particle": {"shape": "polygon", "points": corners, "mass": 1.0, "spin": True},
        "surface": [{"name": "dome", "center": [0.0, 0.0], "radius": 0.24, "from_deg": 0.0,
                     "to_deg": 180.0, "friction": 0.2, "restitution": 0.0}],
        "stream": {"at": [0.1, 0.28], "velocity": [-1.0, -3.5], "angle_deg": angle, "omega": omega},
        "run": {"until": 0.03},
    })  # fmt: skip
    lost = run.energy_at(np.linspace(0.0, 0.03, 31)[1:-1])
    total = lost["restitution_loss"] + lost["friction_loss"]
    assert np.diff(total).min() > -1e-9 * 6.6
    assert not run.laws


@pytest.mark.parametrize("without", [None, "keystone", "right foot"])
def test_an_arch_of_five_stones_stands_and_one_with_a_stone_taken_falls(without):
    tables = to_dict(chutelab.load("arch"))
    tables["stream"] = [stone for stone in tables["stream"] if stone["name"] != without]
    places = run({**tables, "expect": []}).at(np.array([0.0, 0.4])).position
    fallen = places[0] - places[1]
    assert (np.abs(fallen).max() < 5e-5) == (without is None)
    assert without is None or fallen[:, 1].max() > 0.01


@pytest.mark.parametrize("rows", [8, 12])
def test_a_wall_of_96_bricks_stands(rows):
    """Each row is half a brick off the next: the centre of every second end is above an edge.

    So it would tip if sweeps left it a hair, step by step, as half of them do.
    """
    wide, high, many = 0.03, 0.02, 96 // rows
    bricks = [
        {"count": 1, "at": [(k - 0.5 * many + 0.25 * (-1) ** n) * wide, (n + 0.5) * high],
         "velocity": [0.0, 0.0], "interact": True, "friction": 0.5, "restitution": 0.2}
        for n in range(rows) for k in range(many)
    ]  # fmt: skip
    recording = run({
        "particle": {"shape": "box", "size": [wide, high], "mass": 0.05, "spin": True},
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "friction": 0.5}],
        "stream": bricks,
        "run": {"until": 1.0},
    })  # fmt: skip
    first, last = recording.at(np.array([0.0, 1.0])).position
    assert np.abs(last - first).max() < 1e-4
    assert not recording.at(1.0).velocity.any()


def apart(one, other):
    """Return by how much two convex polygons are apart along the best of their normals, m."""

    def beyond(own, its):
        edges = np.roll(own, -1, axis=0) - own
        normals = np.stack([edges[:, 1], -edges[:, 0]]) / np.hypot(*edges.T)
        return ((its @ normals).min(axis=0) - (own @ normals).max(axis=0)).max()

    return max(beyond(one, other), beyond(other, one))


def poured(count, until):
    """Return a run of boxes poured into a bin, and half of a box's and of the bin's width."""
    half, wide = 0.009, 0.1 * max(count / 60.0, 1.0) ** 0.5
    walls = [("left", [[-wide, 0.0], [-wide, 5.0]]), ("right", [[wide, 0.0], [wide, 5.0]]),
             ("floor", [[-wide, 0.0], [wide, 0.0]])]  # fmt: skip
    high = 0.06 + count * (2.9 * half) ** 2 / (wide - 0.01)
    recording = run({
        "particle": {"shape": "box", "size": [2.0 * half, 2.0 * half], "mass": 0.01, "spin": True},
        "surface": [{"name": name, "from": a, "to": b, "friction": 0.4} for name, (a, b) in walls],
        "stream": {"count": count, "fill": [[0.014 - wide, 0.014], [wide - 0.014, high]],
                   "interact": True, "restitution": 0.2, "friction": 0.4},
        "run": {"until": until},
    })  # fmt: skip
    return recording, half, wide


@pytest.mark.parametrize(("count", "spin"), [(99, 2.0), (99, 100.0), (100, 2.0), (100, 100.0)])
def test_steps_are_as_long_as_hops_allow(count, spin):
    """√(0.008 r / (g + ω² R)), inner radius r and outer R, for the fastest of few.

    0.7 √(0.008 r / g) in a crowd: there contacts alone shorten steps for rotation.
    """
    r, outer = 0.005, 0.005 * sqrt(2.0)
    tables = {
        "particle": {"shape": "box", "size": [2.0 * r, 2.0 * r], "mass": 0.01, "spin": True},
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [9.0, 0.0]}],
        "stream": {"count": count, "at": [0.0, 1.0], "to": [8.0, 1.0], "velocity": [0.0, 0.0],
                   "omega": spin, "interact": True},
        "run": {"until": 0.1},
    }  # fmt: skip
    steps = np.diff(run(tables).totals["t"])
    longest = min(1e-3, sqrt(0.008 * r / (G + spin**2 * outer)))
    if count >= 100:
        longest = 0.7 * sqrt(0.008 * r / G)
    assert np.median(steps) == pytest.approx(longest, rel=1e-9)
    assert steps.max() <= longest * (1.0 + 1e-9)


def test_octagons_that_whirl_in_a_crowd_are_struck_by_balls_when_these_reach_them():
    """50 pairs approach at 1 m/s; the octagons rotate by 0.8 rad in a step of the crowd, 2 ms.

    The distance of a ball from edges and corners, in strides in which it cannot close.
    """
    radius, ball, spin, rows = 0.1, 0.02, 400.0, []
    corners = [(radius * cos(a), radius * sin(a)) for a in np.arange(8) * pi / 4.0]
    aims = np.random.default_rng(5).uniform([-0.1, 0.0], [0.1, 0.7], (50, 2))
    for n, (off, angle) in enumerate(aims):
        for name, x, y, v, more in (("octagon", 0.0, 0.0, 0.5, {"angle_deg": degrees(angle)}),
                                    ("ball", 0.2, off, -0.5, {})):  # fmt: skip
            rows.append({"particle": name, "at": [0.5 * n + x, 1.0 + y], "velocity": [v, 0.0],
                         "interact": True, "omega": spin if more else 0.0, **more})  # fmt: skip
    recording = run({
        "particle": [{"name": "octagon", "shape": "polygon", "points": corners, "mass": 0.01,
                      "spin": True}, {"name": "ball", "radius": ball, "mass": 0.01, "spin": True}],
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [26.0, 0.0]}],
        "stream": rows, "run": {"until": 0.2},
    })  # fmt: skip
    struck, met = recording.select("collision"), 0
    for n, (off, angle) in enumerate(aims):

        def clear(t, off=off, angle=angle):
            one = np.array(turned(corners, angle + spin * t))
            to, away = np.roll(one, -1, axis=0) - one, np.array([0.2 - t, off]) - one
            share = np.clip((away * to).sum(axis=1) / (to**2).sum(axis=1), 0.0, 1.0)
            return np.hypot(*(away - share[:, None] * to).T).min() - ball

        t, gap = 0.0, 1.0
        while t < 0.2 and gap > 1e-10:
            gap = clear(t)
            t += max(gap, 0.0) / (1.0 + spin * radius)
        own = struck[(struck["particle"] // 2 == n) | (struck["other"] // 2 == n)][:1]
        # Some pass each other, only graze, or are struck by what flies off.
        is_first = all(own["particle"] // 2 == own["other"] // 2)
        if is_first and gap < 1e-10 and clear(t + 1e-5) < -1e-6:
            met += 1
            assert own["t"] == pytest.approx(t, abs=1e-7), n
    assert met > 25


def test_a_tip_that_passes_a_tip_strikes_it():
    """Of two triangles: between two looks one would go by, and no corner is inside then.

    By separating axes they come into each other by no more than what counts as touching.
    """
    triangle = np.array([[0.0558, 0.0102], [-0.0325, 0.0220], [-0.0233, -0.0321]])
    row = {"interact": True, "restitution": 0.387, "friction": 1.0}
    recording = run({
        "particle": {"shape": "polygon", "points": triangle.tolist(), "mass": 1.0, "spin": True},
        "surface": [{"name": "far", "from": [-1.0, -2.0], "to": [1.0, -2.0]}],
        "stream": [
            {"at": [0.0, 0.0], "velocity": [-0.355, -0.095], **row,
             "angle_deg": 359.62, "omega": 0.567},
            {"at": [0.00427, 0.03566], "velocity": [0.058, -0.857], **row,
             "angle_deg": 324.2, "omega": 8.935},
        ],
        "run": {"until": 0.02},
    })  # fmt: skip
    now = recording.at(np.linspace(0.0, 0.02, 201))
    for places, angles in zip(now.position, now.angle, strict=True):
        one, other = (at + turned(triangle, by) for at, by in zip(places, angles, strict=True))
        assert apart(one, other) > -1e-5


def thrown(seed):
    """Return outlines, places, velocities, angles and spins of two polygons at the start."""
    random = np.random.default_rng(seed)
    shapes = []
    for size in 10.0 ** random.uniform(-2.3, -1.0, 2):
        count = int(random.integers(3, 9))
        turns = (np.arange(count) + random.uniform(-0.3, 0.3, count)) * 2.0 * pi / count
        x, y = points = 0.5 * size * np.stack([np.cos(turns), np.sin(turns)])
        across = x * np.roll(y, -1) - y * np.roll(x, -1)
        middle = (points + np.roll(points, -1, axis=1)) @ across / (3.0 * across.sum())
        shapes.append((points - middle[:, None]).T)
    places = np.array([[-0.15, 0.0], [0.15, random.uniform(-0.05, 0.05)]])
    speeds = np.array([[1.0], [-1.0]]) * random.uniform(0.3, 4.0, (2, 1))
    velocities = np.hstack([speeds, random.uniform(-0.3, 0.3, (2, 1))])
    return shapes, places, velocities, random.uniform(-pi, pi, 2), random.uniform(-60.0, 60.0, 2)


def test_needles_that_whirl_past_each_other_strike_with_their_tips():
    """A tip sweeps through another one between two looks. By separating axes, as below."""
    random, met, r, middle = np.random.default_rng(8), 0, 0.01, 1e-3
    needle = np.array([[-0.5 * r, -0.075 * r], [r, 0.0], [-0.5 * r, 0.075 * r]])
    kind = {"shape": "polygon", "points": needle.tolist(), "mass": 0.01, "spin": True}
    for draw in range(40):
        spins = random.choice([-1.0, 1.0], 2) * random.uniform(200.0, 600.0, 2)
        angles = np.array([0.0, pi]) + random.uniform(-0.01, 0.01, 2) - spins * middle
        places = np.array([[0.0, 0.0], [2.0 * r - random.uniform(2e-5, 2e-4), 0.0]])
        recording = run({
            "gravity": 0.0, "particle": kind,
            "surface": [{"name": "far", "from": [-5.0, -5.0], "to": [5.0, -5.0]}],
            "stream": [{"at": at.tolist(), "velocity": [0.0, 0.0], "angle_deg": degrees(angle),
                        "omega": spin, "interact": True}
                       for at, angle, spin in zip(places, angles, spins, strict=True)],
            "run": {"until": 2.0 * middle},
        })  # fmt: skip

        def gap(t, places=places, angles=angles, spins=spins):
            ways = zip(places, angles + spins * t, strict=True)
            return apart(*(at + turned(needle, angle) for at, angle in ways))

        t = 0.0
        while t < 2.0 * middle and gap(t) > 1e-10:
            t += gap(t) / (r * np.abs(spins).sum())
        if t < 2.0 * middle and min(gap(t + 1e-7 * n) for n in range(9)) < -1e-7:
            met += 1
            struck = recording.select("collision")["t"]
            assert len(struck), draw
            assert struck[0] == pytest.approx(t, abs=1e-9), draw
    assert met > 20


# Of draws 12, 97, 383 and 442 two tips pass just before a corner enters.
@pytest.mark.parametrize("draws", [range(100), [383, 442]])
def test_polygons_strike_each_other_when_they_begin_to_overlap(draws):
    """By separating axes, in strides in which their fastest corners cannot close the gap."""
    met = 0
    for seed in draws:
        shapes, places, velocities, angles, spins = thrown(seed)
        until = 0.3 / (velocities[0, 0] - velocities[1, 0]) + 0.05
        recording = chutelab.simulate({
            "gravity": 0.0,
            "particle": [{"name": name, "shape": "polygon", "points": one.tolist(), "mass": 0.1,
                          "spin": True} for name, one in zip("ab", shapes, strict=True)],
            "surface": [{"name": "far", "from": [-5.0, -5.0], "to": [5.0, -5.0]}],
            "stream": [{"particle": name, "at": at.tolist(), "velocity": v.tolist(),
                        "angle_deg": degrees(angle), "omega": spin, "interact": True}
                       for name, at, v, angle, spin
                       in zip("ab", places, velocities, angles, spins, strict=True)],
            "run": {"until": until, "engine": "contact"},
        })  # fmt: skip

        def gap(t, shapes=shapes, places=places, velocities=velocities, angles=angles, spins=spins):
            ways = zip(places + velocities * t, shapes, angles + spins * t, strict=True)
            return apart(*(at + turned(shape, angle) for at, shape, angle in ways))

        sizes = [np.hypot(*one.T).max() for one in shapes]
        fastest = np.hypot(*(velocities[0] - velocities[1])) + np.abs(spins) @ sizes
        t = 0.0
        while t < until and gap(t) > 1e-9:
            t += gap(t) / fastest
        # Others pass, or graze.
        if t < until and gap(t + 1e-5) < -1e-6:
            met += 1
            assert recording.select("collision")["t"][0] == pytest.approx(t, abs=1e-7), seed
    assert met >= len(draws) // 3


@pytest.mark.parametrize(
    ("count", "until"), [(25, 0.8), pytest.param(300, 2.0, marks=pytest.mark.slow)]
)
def test_poured_boxes_get_into_each_other_and_into_walls_as_little_as_disks_do(count, until):
    """Half a percent of the radius inside, 99 of 100; one and a half at most.

    By separating axes, of all that are near.
    """
    recording, half, wide = poured(count, until)
    box, deep = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]), []
    now = recording.at(np.linspace(0.05, 0.99 * until, 60))
    for places, angles in zip(now.position, now.angle, strict=True):
        shown = [at + turned(box, angle) for at, angle in zip(places, angles, strict=True)]
        all_of_them = np.array(shown)
        deep += [*-all_of_them[..., 1].min(axis=1)]
        deep += [*np.abs(all_of_them[..., 0]).max(axis=1) - wide]
        for n, one in enumerate(shown):
            near = np.hypot(*(places[:n] - places[n]).T) < 3.0 * half
            deep += [-apart(one, shown[k]) for k in np.flatnonzero(near)]
    touching = np.array([one for one in deep if one > 0.0])
    assert np.quantile(touching, 0.99) < 5e-3 * half
    assert touching.max() < 1.5e-2 * half
    # All of them lie by then, on each other or on the floor, and sleep.
    assert now.position[-1, :, 1].max() < 0.2 * (count / 25.0) ** 0.5
    assert not now.velocity[-1].any()


@pytest.mark.parametrize("e", [0.05, 0.2])
@pytest.mark.parametrize(
    ("at", "velocities", "angles", "spins"),
    [
        ([[0.0, 0.025368], [0.0, 0.050293]], [[0.0, 0.469], [0.0, -3.605]], (134.563, 48.136),
         (68.24, 1.0)),
        ([[-0.012353, 0.060448], [0.0, 0.081536]], [[-0.49, -0.222], [0.0, -3.519]], (31.05, 0.0),
         (22.11, 0.0)),
    ],
)  # fmt: skip
def test_what_slides_along_a_face_that_spins_does_not_get_into_it(at, velocities, angles, spins, e):
    """A blow spins one of two; the other's corner moves at v along the face that spins at w.

    So it comes nearer by w v t^2, 1 mm in a step of 2 ms, after it has not approached at all.
    """
    side = 0.018
    recording = run({
        "particle": {"shape": "box", "size": [side, side], "mass": 0.01, "spin": True},
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "restitution": e}],
        "stream": [
            {"at": place, "velocity": v, "angle_deg": angle, "omega": spin, "interact": True,
             "restitution": e}
            for place, v, angle, spin in zip(at, velocities, angles, spins, strict=True)
        ],
        "run": {"until": 0.01},
    })  # fmt: skip
    box, now = np.array(corners(side, side)), recording.at(np.linspace(0.0, 0.01, 201))
    gaps = [
        apart(*(place + turned(box, by) for place, by in zip(places, turns, strict=True)))
        for places, turns in zip(now.position, now.angle, strict=True)
    ]
    assert min(gaps) > -2e-3 * 0.5 * side


@pytest.mark.parametrize("e", [0.0, 0.3])
@pytest.mark.parametrize("gap", [0.002, 0.01])
@pytest.mark.parametrize("omega", [5.0, 20.0])
def test_a_tip_that_comes_on_a_tip_while_others_touch_passes_nothing(omega, gap, e):
    """Two like triangles, base on base, of which one turns about a tip until the bases meet.

    At the other end no corner is inside anything then, and by separating axes both overlap.
    """
    side = 0.016
    high = 0.5 * side * sqrt(3.0)
    triangle = np.array([(-0.5 * side, -high / 3.0), (0.5 * side, -high / 3.0), (0.0, high / 1.5)])
    tip = np.array([-0.5 * side, 0.0])
    arm = np.array(turned([(0.5 * side, high / 3.0)], gap)[0])
    row = {"interact": True, "restitution": e, "friction": 0.3}
    recording = run({
        "gravity": 0.0,
        "particle": {"shape": "polygon", "points": triangle.tolist(), "mass": 0.05, "spin": True},
        "surface": [{"name": "far", "from": [-5.0, -5.0], "to": [5.0, -5.0]}],
        "stream": [
            {"at": [0.0, -high / 3.0], "velocity": [0.0, 0.0], "angle_deg": 180.0, **row},
            {"at": (tip + arm + [0.0, 1e-9]).tolist(), "angle_deg": degrees(gap), "omega": -omega,
             "velocity": [omega * arm[1], -omega * arm[0]], **row},
        ],
        "run": {"until": 0.02},
    })  # fmt: skip
    now = recording.at(np.linspace(0.0, 0.02, 201))
    gaps = [
        apart(*(place + turned(triangle, by) for place, by in zip(places, turns, strict=True)))
        for places, turns in zip(now.position, now.angle, strict=True)
    ]
    assert min(gaps) > -1e-3 * high / 3.0


def streamed(seed):
    """Return a scene: a stream of boxes or pentagons, all alike, falls in one place of a bin."""
    random = np.random.default_rng(seed)
    wide, rate = (float(random.choice(some)) for some in ((0.05, 0.1, 0.2), (30, 60, 100, 150)))
    count = int(random.choice((60, 120, 200)))
    contact = {"friction": float(random.choice((0.0, 0.2, 0.4, 0.8))),
               "restitution": float(random.choice((0.0, 0.2, 0.5)))}  # fmt: skip
    pentagon = [(0.012 * cos(a), 0.012 * sin(a)) for a in 0.4 * pi * np.arange(5)]
    shape = ({"shape": "box", "size": [0.018, 0.018]}, {"shape": "box", "size": [0.036, 0.0135]},
             {"shape": "polygon", "points": pentagon})[random.integers(3)]  # fmt: skip
    release = {"angle_deg": float(random.choice((0.0, 10.0, 30.0, 45.0))),
               "omega": float(random.choice((0.0, 1.0, 10.0, 30.0))),
               "velocity": [float(random.choice((0.0, 0.3))), -0.5]}  # fmt: skip
    walls = [[-wide, 5.0], [-wide, 0.0], [wide, 0.0], [wide, 5.0]]
    return {
        "particle": {**shape, "mass": 0.01, "spin": True},
        "surface": [{"name": "bin", "points": walls, **contact}],
        "stream": {"count": count, "rate": rate, "at": [0.0, 0.7], "interact": True,
                   **release, **contact},
        "run": {"until": count / rate + 0.7},
    }  # fmt: skip


@pytest.mark.parametrize("seed", seeds(2, 60))
def test_a_stream_of_boxes_that_falls_in_one_place_keeps_the_laws(seed):
    """Towers that fall: what lies still is struck, spins and slides off what spins."""
    run(streamed(seed))


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
@pytest.mark.parametrize("mu", [0.5, 0.05], ids=["sticks", "slips"])
def test_a_flat_blow_loses_in_the_bounce_and_to_friction_what_newton_and_coulomb_say(engine, mu):
    """It does not turn, so both corners have the velocity of the centre before and after.

    J_n = m (1 + e) v_n loses m (1 - e^2) v_n^2 / 2, and J_t = min(m v_t, mu J_n), which makes w_t
    of v_t, loses J_t (v_t + w_t) / 2 to friction, however the corners share it.
    """
    e, along, down, fall = 0.5, 0.3, 1.6, 2e-3
    more = {"stream": {"interact": True}, "run": {"until": 2.5e-3, "dt": 2e-6}}
    tables = scene([0.0, W / 2.0 + fall], [along, -down], size=(W, W), e=e, mu=mu, **more)
    books = run(tables, engine).ledger.by_surface["floor"]
    struck = sqrt(down * down + 2.0 * G * fall)
    pull = min(M * along, mu * M * (1.0 + e) * struck)
    off = {"rel": 1e-4 if engine == "pymunk" else 1e-12}
    lost = 0.5 * M * struck * struck * (1.0 - e * e)
    assert books["restitution_loss"] == pytest.approx(lost, **off)
    assert books["friction_loss"] == pytest.approx(pull * (along - 0.5 * pull / M), **off)


def test_a_box_falls_flat_on_its_like_in_line_with_it():
    """Their sides are in one line, so that no corner is ever inside by more than rounding."""
    wide, high, speed = 0.106, 0.021, 4.9
    scene = {
        "gravity": 0.0,
        "particle": [{"name": "box", "shape": "box", "size": [wide, high], "mass": 0.01}],
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], "restitution": 0.0}],
        "stream": [
            {"at": [0.1 / 3.0, 0.5 * high], "velocity": [0.0, 0.0], "interact": True},
            {"at": [0.1 / 3.0, 0.2], "velocity": [0.0, -speed], "interact": True},
        ],
        "run": {"until": 0.1},
    }  # fmt: skip
    recording = chutelab.simulate(scene, engine="contact")
    first = recording.select("collision")[0]
    assert first["t"] == pytest.approx((0.2 - 1.5 * high) / speed, abs=1e-12)
    assert not recording.laws


@pytest.mark.slow
def test_the_ledger_closes_and_nothing_gains_however_far_sweeps_have_come(with_fault):
    """What is lost is told by the impulses and velocities that were applied, not by a solution."""
    swept = "sweep_contacts(list, to - from, rounds, W.sweeps,"
    with_fault("solver.c", swept, swept.replace("rounds, W.sweeps", "MIN(rounds, 1), 2"))
    recording = poured(25, 0.4)[0]
    assert recording.unsolved.max() > 1e-3
    assert recording.gained <= 1e-12 * recording.ledger.turned_over


def test_where_boxes_are_in_the_end():
    """On a board that has turned lie a box and on it a disk; beside it a box is near.

    Its circle reaches into the board: half a diagonal is 58 mm, half its height 30 mm.
    """
    scene = {
        "particle": [
            {"name": "crate", "shape": "box", "size": [0.1, 0.06], "mass": 0.5, "spin": True},
            {"name": "coin", "radius": 0.02, "mass": 0.1},
        ],
        "pair": [{"between": ["crate", "coin"], "friction": 0.8, "restitution": 0.0}],
        "surface": [
            {
                "name": "board", "from": [-0.5, 0.0], "to": [0.5, 0.0], "hinge": [0.0, 0.0],
                "mass": 1.0, "stops_deg": [-30.0, 30.0], "restitution": 0.0, "friction": 0.8,
            }
        ],
        "stream": [
            {"particle": "crate", "at": [0.3, 0.031], "velocity": [0.0, 0.0], "interact": True},
            {"particle": "coin", "at": [0.3, 0.082], "velocity": [0.0, 0.0]},
            {"particle": "crate", "at": [-0.488, 0.045], "velocity": [0.0, 2.0], "start": 1.8},
        ],
        "run": {"until": 2.0},
    }  # fmt: skip
    recording = chutelab.simulate(scene)
    assert recording.pose("board", [2.0])[0, 2] == pytest.approx(np.radians(-30.0))
    off = recording.at([2.0]).position[0, 2] - 0.5 * np.array([-cos(pi / 6.0), sin(pi / 6.0)])
    assert hypot(*off) < hypot(0.05, 0.03)
    assert off[0] < -0.05
    assert recording.summary()["fates"] == {"on board": 2, "in the air": 1}


@pytest.mark.parametrize(("x", "speed"), [(-0.122, 0.76), (0.041, -0.76)])
def test_a_box_strikes_the_end_of_a_bowl(x, speed):
    """Near one of its corners, from above; the other end of the bowl is out of another edge."""
    bowl = {"center": [0.0, 0.0], "radius": 0.25, "from_deg": 180.0, "to_deg": 360.0}
    thrown = scene((x, 0.8), (speed, 0.18), size=(0.13, 0.13), e=0.8, mu=0.6, surface=bowl)
    del thrown["surface"][0]["from"], thrown["surface"][0]["to"]
    recording = chutelab.simulate(thrown, {"run.until": 1.5}, engine="contact")
    (blow, *_) = recording.events[recording.events["kind"] == 3]
    # Its lower edge is at the height of the ends then.
    assert blow["position"][1] == pytest.approx(0.065, abs=1e-9)
    assert not recording.laws


TURNED = {"from": [-0.5, 0.0], "to": [0.5, 0.0], "turn": -230.0, "pivot": [0.0, 0.0]}
BOWL = {"center": [0.0, 0.0], "radius": 0.05, "from_deg": 180.0, "to_deg": 360.0}


@pytest.mark.parametrize(
    ("surface", "long", "begin", "spins"),
    [
        (TURNED, 0.035, lambda gap: (-0.05, -0.0035 - gap), (0.0, -4.0, -8.0, -10.0)),
        (
            BOWL, 0.004, lambda gap: (0.0, 0.0004 - ((0.05 - gap) ** 2 - 0.002**2) ** 0.5),
            (0.0, -70.0, 63.0, 140.0),
        ),
    ],
)  # fmt: skip
def test_a_corner_that_comes_slowly_stays_on_its_side(surface, long, begin, spins):
    """Thin boxes slide along what turns under them, or bends towards them: 2 ω v or v²/R, m/s².

    A corner that comes so from close by is too slow for a blow, and within a step it is beyond the
    surface by more than what counts as touching there: where its box is tells its side.
    """
    gaps = np.geomspace(2e-6, 2e-4, 10) * long / 0.035
    streams = [
        {"particle": "thin", "at": list(begin(gap)), "velocity": [3.5, 0.0], "omega": spin}
        for gap in gaps
        for spin in spins
    ]
    tables = {
        "gravity": 0.0,
        "particle": [
            {"name": "thin", "shape": "box", "size": [long, long / 5], "mass": 0.01, "spin": True}
        ],
        "surface": [{"name": "surface", "restitution": 0.3, "friction": 0.6} | surface],
        "stream": streams,
        "run": {"until": 0.03, "engine": "contact"},
    }
    recording = chutelab.simulate(tables)
    assert not recording.laws


@pytest.mark.parametrize(("tilt", "mu"), [(44.0, 0.5), (45.0, 0.0), (50.0, 0.0)])
def test_a_tip_that_comes_to_where_two_walls_meet_is_above_the_floor(tilt, mu):
    """Sunk a little into both it is beyond the end of each; then it tips over and lies flat.

    Its centre is as high as an edge is from it: (1/300, 0) m from the line through (-0.03, 0) and
    (0.02, 0.012).
    """
    tables = {
        "particle": {"shape": "polygon", "points": [[-0.03, 0], [0.02, 0.012], [0.02, -0.012]],
                     "mass": 0.1, "spin": True},
        "surface": [{"name": "walls", "points": [[0.0, 0.5], [0.0, 0.0], [0.5, 0.0]],
                     "restitution": 0.0, "friction": mu}],
        "stream": {"at": [0.06, 0.06], "velocity": [-0.5, -0.2], "angle_deg": tilt},
        "run": {"until": 0.6},
    }  # fmt: skip
    recording = chutelab.simulate(tables, engine="contact")
    assert not recording.laws
    height = 0.012 * (0.03 + 0.01 / 3.0) / hypot(0.05, 0.012)
    assert recording.ends()[1]["position"][0, 1] == pytest.approx(height, abs=3e-7)


@pytest.mark.parametrize("gap", [1e-8, 1e-7])
def test_a_corner_that_passes_the_tip_of_two_walls_outside_is_not_struck_from_inside(gap):
    """A box moves along its own edge, a little above the tip: nothing is in its way.

    Before its corner gets there, it crosses the line by which a wall would continue.
    """
    size, tilt, speed = [0.004, 0.01], 0.035, 0.8
    walls = [[0.05, 0.001], [0.0, 0.0], [-0.04, -0.04]]
    along, out = np.array([cos(tilt), sin(tilt)]), np.array([-sin(tilt), cos(tilt)])
    middle = (0.5 * size[0] - 5e-4) * along + (gap + 0.5 * size[1]) * out
    run = chutelab.simulate({
        "gravity": 0.0, "particle": {"shape": "box", "size": size, "mass": 0.01},
        "surface": [{"name": "walls", "points": walls, "restitution": 0.5}],
        "stream": {"at": middle.tolist(), "velocity": (speed * along).tolist(),
                   "angle_deg": degrees(tilt)},
        "run": {"until": 0.02, "engine": "contact"},
    })  # fmt: skip
    assert {*run.events["kind"].tolist()} == {chutelab.Kind.RELEASE}
    end = run.ends()[1]["velocity"][0]
    assert end == pytest.approx(speed * along, rel=1e-12)


@pytest.mark.parametrize("angle", [52.0, 116.0, 188.0, 268.0, 336.0])
def test_what_a_blow_on_something_round_spins_strikes_it_with_its_next_corner(angle):
    """Within the step: its first corner leaves as the next comes, at some 370 rad/s.

    Left to the next step, it would be up to 1 mm inside by then; nothing is, so no law is broken.
    """
    points = [[0.0089, -0.0011], [0.0005, 0.009], [-0.0071, 0.0056],
              [-0.0075, -0.005], [0.003, -0.0085]]  # fmt: skip
    tables = {
        "particle": {"shape": "polygon", "points": points, "mass": 1.0, "spin": True},
        "surface": [{"name": "dome", "center": [0.0, 0.0], "radius": 0.238, "from_deg": 0.0,
                     "to_deg": 180.0, "friction": 0.25, "restitution": 0.3}],
        "stream": {"at": [0.21, 0.18], "velocity": [-0.73, -3.46], "omega": -17.4,
                   "angle_deg": angle, "friction": 0.2, "restitution": 0.0},
        "run": {"until": 0.02},
    }  # fmt: skip
    recording = chutelab.simulate(tables, engine="contact")
    assert not recording.laws
    first, then = recording.select("impact")[:2]
    assert then["t"] - first["t"] < 1e-3
