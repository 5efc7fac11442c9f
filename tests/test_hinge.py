"""What hangs on a hinge: springs, dampers, stops and motors, and what strikes it and lies on it.

Formulas are written here; quadratures, roots and one ODE are SciPy's.
"""

from dataclasses import replace
from itertools import product
from math import cos, exp, pi, radians, sin, sqrt

import numpy as np
import pytest

import chutelab
from chutelab.classroom.lessons import find, machine_of
from chutelab.results.laws import judge
from chutelab.scene import SceneError
from machines import in_a_box
from shared import seeds

pytest.importorskip("scipy")
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

G, R, M = 9.81, 0.01, 0.008


def machine(stream=None, particle=None, run=None, more=(), gravity=G, **keys):
    """A lever from its hinge in the origin to the right, and a disk far away."""
    own = {"name": "lever", "from": [0.0, 0.0], "to": [0.5, 0.0], "hinge": [0.0, 0.0], **keys}
    return {
        "gravity": gravity,
        "particle": {"radius": R, "mass": M, **(particle or {})},
        "surface": [{k: v for k, v in own.items() if v is not None}, *more],
        "stream": stream or {"at": [5.0, 5.0], "velocity": [0.0, 0.0]},
        "run": {"until": 1.0, **(run or {})},
    }


def sound(recording):
    """A run that keeps all laws, and whose ledger closes."""
    assert not recording.laws
    ledger = recording.ledger
    change = sum(b - a for a, b in (ledger.kinetic, ledger.potential, ledger.spring))
    losses = ledger.restitution_loss + ledger.friction_loss + ledger.damper_loss
    given = ledger.belt_work + ledger.drive_work - losses
    # In balance nothing is turned over, and heights are rounded in each step.
    rounds = 1e-11 * ledger.turned_over + max(1e-14 * abs(ledger.potential[0]), 1e-16)
    assert change == pytest.approx(given, abs=rounds)
    assert abs(ledger.residual) <= rounds
    return recording


def run(*args, **keys):
    return sound(chutelab.simulate(machine(*args, **keys)))


def test_a_physical_pendulum_has_the_period_of_the_elliptic_integral():
    """A bar let go level: T = 4 K(sin²(a/2)) sqrt(I / m g d), a = 90°; energy to rounding."""
    recording = run(mass=1.3, run={"until": 3.0})
    inertia, off = 1.3 * 0.5**2 / 3.0, 0.25
    period = 4.0 * ellipk(sin(pi / 4.0) ** 2) * sqrt(inertia / (1.3 * G * off))
    turned = recording.pose("lever", [0.25 * period, 0.5 * period, period, 2.0 * period])[:, 2]
    assert turned == pytest.approx([-pi / 2.0, -pi, 0.0, 0.0], abs=1e-9)
    states = recording.swings
    energy = 0.5 * inertia * states["rate"] ** 2 + 1.3 * G * off * np.sin(states["angle"])
    assert np.abs(energy).max() < 1e-13


def test_a_ball_against_a_sprung_plate_is_momentum_about_the_hinge_then_a_damped_swing():
    """J = (1 + e) v / (1/m + l²/I); then w/w_d exp(-d t) sin(w_d t)."""
    inertia, spring, damper, e, v, lever = 0.01, 2.0, 0.02, 0.6, 3.0, 0.3
    keys = {"to": [0.0, -0.4], "inertia": inertia, "spring": spring, "damper": damper}
    stream = {"at": [-0.3, -lever], "velocity": [v, 0.0]}
    recording = run(stream, gravity=0.0, restitution=e, friction=0.4, **keys)
    (blow,) = recording.select("impact")
    impulse = (1.0 + e) * v / (1.0 / M + lever**2 / inertia)
    begin = (0.3 - R) / v
    assert blow["t"] == pytest.approx(begin, rel=1e-13)
    assert blow["velocity_after"] == pytest.approx([v - impulse / M, 0.0], abs=1e-13)
    rate, decay = impulse * lever / inertia, 0.5 * damper / inertia
    swift = sqrt(spring / inertia - decay**2)
    times = np.linspace(0.01, 0.9, 40)
    expected = [rate / swift * exp(-decay * t) * sin(swift * t) for t in times]
    assert recording.pose("lever", begin + times)[:, 2] == pytest.approx(expected, abs=1e-10)
    ledger = recording.ledger
    reduced = 1.0 / (1.0 / M + lever**2 / inertia)
    assert ledger.restitution_loss == pytest.approx(0.5 * reduced * v**2 * (1.0 - e**2))
    left = ledger.spring[1] + ledger.kinetic[1] - 0.5 * M * (v - impulse / M) ** 2
    assert ledger.damper_loss == pytest.approx(0.5 * inertia * rate**2 - left)
    assert recording.measure("ledger.damper_loss") == ledger.damper_loss
    assert recording.measure("ledger.spring.end") == ledger.spring[1] > 0.0


def by_formulas(scene):
    """What lesson 13 says of its plate: velocity after the blow, losses, the swing; SI units."""
    plate, m, r = scene.plate, scene.particle.mass, scene.particle.radius
    alpha, v0, top = radians(plate.angle_deg), scene.incoming.speed, scene.incoming.pulley_radius
    normal, along = (-cos(alpha), -sin(alpha)), (sin(alpha), -cos(alpha))
    pivot = top + plate.distance, top

    def away(t):
        return v0 * t - pivot[0], top + r - 0.5 * G * t * t - pivot[1]

    t = brentq(lambda t: np.dot(away(t), normal) - r, 0.0, 1.0, xtol=1e-15)
    lever, into = np.dot(away(t), along), -np.dot((v0, -G * t), normal)
    heavy, inertia, e = plate.inertia / lever**2, plate.inertia, plate.restitution
    after = into * (m - e * heavy) / (m + heavy)
    rate, decay = (after + e * into) / lever, 0.5 * plate.damper / inertia
    swift = sqrt(plate.spring / inertia - decay**2)
    return {
        "vx": v0 + (after - into) * cos(alpha),
        "lost": 0.5 * m * heavy / (m + heavy) * into**2 * (1.0 - e**2),
        "kept": 0.5 * m * after**2,
        "given": 0.5 * inertia * rate**2,
        "blow": scene.incoming.length / v0 + t,
        "swing": lambda t: rate / swift * np.exp(-decay * t) * np.sin(swift * t),
        "back": pi / swift,
        "rate": lambda t: (
            rate * np.exp(-decay * t) * (np.cos(swift * t) - decay / swift * np.sin(swift * t))
        ),
    }


PLATES = [*((2, row) for row in range(6)), *((3, row) for row in (*range(4), None))]
ON_PYMUNK = [
    pytest.param(*plate, "pymunk", marks=[] if plate == (2, 1) else pytest.mark.slow)
    for plate in PLATES
]


@pytest.mark.parametrize(
    ("step", "row", "engine"), [*((*plate, "contact") for plate in PLATES), *ON_PYMUNK]
)
def test_lesson_13_is_right_of_each_of_its_plates(step, row, engine):
    """In the contact engine to rounding, in Pymunk to the order of its step; a leaning one too."""
    lesson = find(13)
    asked = lesson.steps[step]
    scene = machine_of(lesson, asked, None if row is None else asked.rows[row])
    if row is None:
        scene = scene.with_values({"plate.angle_deg": -10.0})
    said = by_formulas(scene)
    recording = chutelab.simulate(scene, {"run.dt": 1e-3}, engine=engine)
    off = 1e-9 if engine == "contact" else 1e-2
    ledger, measure = recording.ledger, recording.measure
    assert len(recording.select("impact", surface="plate")) == 1
    assert measure("impact.vx_after") == pytest.approx(said["vx"], abs=2.0 * off)
    lost = ledger.by_surface["plate"]["restitution_loss"]
    # Of a crowd's and of lasting contacts' gains, which are rounding, each surface has a share.
    assert lost == pytest.approx(said["lost"], rel=max(off, 1e-5))
    track = recording.track(0)
    blow = np.searchsorted(track["t"], recording.select("impact")["t"][0], side="right")
    assert track["entries"][blow - 1, 1] == pytest.approx(said["lost"], rel=off)
    last = recording.swings["t"].max() - said["blow"]
    times = np.minimum([0.3 * said["back"], said["back"], last], last)
    turned = recording.pose("plate", said["blow"] + times)[:, 2]
    angles = said["swing"](times)
    assert turned == pytest.approx(angles, abs=10.0 * off * angles.max())
    kept = 0.5 * scene.plate.spring * angles[-1] ** 2
    left = kept + 0.5 * scene.plate.inertia * said["rate"](last) ** 2
    assert ledger.spring[1] == pytest.approx(kept, abs=10.0 * off * said["given"])
    assert ledger.damper_loss == pytest.approx(said["given"] - left, abs=10.0 * off * said["given"])
    told = f"{said['vx']:.2f}" if step == 2 else f"{said['back']:.3f}"
    assert row is None or told in asked_in(lesson)


def asked_in(lesson):
    """The explanation of a lesson."""
    return next(step.then for step in lesson.steps if step.kind == "explain")


def test_a_motor_turns_with_its_torque_up_to_its_speed():
    """Work = torque times angle; then it holds its speed, and pays what the damper takes."""
    inertia, torque, speed = 0.1, 0.2, 2.0 * pi
    motor = {"speed_deg": np.degrees(speed), "torque": torque}
    keys = {"gravity": 0.0, "inertia": inertia, "motor": motor}
    recording = run(**keys)
    assert recording.pose("lever", [1.0])[0, 2] == pytest.approx(0.5 * torque / inertia)
    assert recording.ledger.drive_work == pytest.approx(torque * 0.5 * torque / inertia)
    assert recording.measure("ledger.by_surface.lever.drive_work") == recording.ledger.drive_work
    recording = run(**keys, damper=0.01, run={"until": 8.0})
    (_, late), (_, end) = recording.pose("lever", [7.0, 8.0])[:, 1:]
    assert end - late == pytest.approx(speed, rel=1e-6)
    # Against dw/dt = (T - c w) / I up to its speed, then c w² for the rest.
    reach = -inertia / 0.01 * np.log(1.0 - 0.01 * speed / torque)
    swept = (torque * reach - inertia * speed) / 0.01
    work = torque * swept + 0.01 * speed**2 * (8.0 - reach)
    assert recording.ledger.drive_work == pytest.approx(work, rel=2e-3)


def test_a_stop_takes_what_comes_to_it():
    """A bar that falls from level by 30° has made kinetic energy of m g d sin 30°: all is lost."""
    recording = run(mass=1.3, stops_deg=[-30.0, 5.0])
    lost = 1.3 * G * 0.25 * 0.5
    assert recording.ledger.by_surface["lever"]["restitution_loss"] == pytest.approx(lost)
    assert recording.pose("lever", [0.99])[0, 2] == pytest.approx(-pi / 6.0, abs=1e-7)
    inertia = 1.3 * 0.5**2 / 3.0
    speeds = 2.0 * 1.3 * G * 0.25 / inertia
    # t = ∫ da / sqrt(speeds sin a), with a = s².
    found, _ = quad(lambda s: 2.0 / sqrt(speeds * np.sinc(s * s / pi)), 0.0, sqrt(pi / 6.0))
    blow = recording.swings["t"][np.abs(recording.swings["rate"]).argmax()]
    assert blow == pytest.approx(found, abs=1e-9)


@pytest.mark.parametrize("damper", [0.0, 0.01])
def test_what_a_spring_presses_against_its_stop_rests_from_the_start(damper):
    """In a step of 1 ms its 0.3 N m give 0.3 rad/s to 1e-3 kg m², of which none may be told.

    Nor may the damper, which would take 0.01 N m s of a mean square of 0.15² / 3 for 5 s: 4e-4 J.
    """
    recording = run(
        inertia=1e-3, spring=0.3, rest_deg=57.3, stops_deg=[-80.0, 0.0], gravity=0.0, damper=damper,
        run={"until": 5.0},
    )  # fmt: skip
    assert np.abs(recording.swings["rate"]).max() < 1e-3 * 0.3
    assert np.abs(recording.swings["angle"]).max() < 1e-15
    assert abs(recording.ledger.damper_loss) < 1e-10
    assert np.abs(recording.stopped).max() < 1e-10


def balls(left, right, **more):
    """Two balls on a see-saw, at so many m to its left and right, of which the one is heavier."""
    each = {"velocity": [0.0, 0.0], "interact": True}
    return machine(
        **{"from": [-0.3, 0.0], "to": [0.3, 0.0], "mass": 0.1, "friction": 2.0},
        **more,
    ) | {
        "particle": [{"name": "light", "radius": R, "mass": M},
                     {"name": "heavy", "radius": R, "mass": 2.0 * M}],
        "stream": [{"name": "a", "at": [-left, R], "particle": "light", **each},
                   {"name": "b", "at": [right, R], "particle": "heavy", **each}],
    }  # fmt: skip


def test_a_see_saw_in_balance_stays_so():
    """m l = M L: it stays."""
    recording = sound(chutelab.simulate(balls(0.2, 0.1)))
    assert np.abs(recording.swings["angle"]).max() < 1e-9


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_a_see_saw_turns_as_its_equation_says(engine):
    """(I + sum m l²) a = -sum m l (g cos + R w²), to the order of the step squared.

    A disk that does not turn rolls on what turns below it: l = l0 + R angle.
    """
    left, right, end = 0.2, 0.15, 0.3

    def rates(_, y):
        places = ((M, R * y[0] - left), (2.0 * M, R * y[0] + right))
        moment = -sum(m * x * (G * cos(y[0]) + R * y[1] ** 2) for m, x in places)
        return y[1], moment / (0.1 * 0.6**2 / 12.0 + sum(m * x * x for m, x in places))

    exact = solve_ivp(rates, (0.0, end), (0.0, 0.0), method="DOP853", rtol=1e-12, atol=1e-14).y[
        0, -1
    ]
    off = {}
    for dt in (2e-3, 1e-3):
        recording = chutelab.simulate(
            balls(left, right), {"run.dt": dt, "run.until": end}, engine=engine
        )
        assert not recording.laws
        off[dt] = abs(recording.pose("lever", [end])[0, 2] - exact)
    assert off[1e-3] < (1e-6 if engine == "contact" else 1e-4)
    if engine == "contact":
        sound(recording)
        assert off[1e-3] < 0.35 * off[2e-3]


@pytest.mark.slow
def test_the_power_of_a_drums_motor_is_what_its_crowd_loses():
    turns = np.linspace(0.0, 2.0 * pi, 17)
    points = np.stack([0.15 * np.cos(turns), 0.15 * np.sin(turns)], axis=-1)
    points[-1] = points[0]
    scene = machine(
        {"fill": [[-0.1, -0.1], [0.1, 0.1]], "count": 12, "interact": True},
        {"radius": 0.01, "spin": True}, {"until": 2.0},
        **{"from": None, "to": None, "points": points.tolist(), "mass": 0.5, "friction": 0.6},
        motor={"speed_deg": 90.0, "torque": 0.5},
    )  # fmt: skip
    recording = sound(chutelab.simulate(scene))
    ledger = recording.ledger
    kept = sum(b - a for a, b in (ledger.kinetic, ledger.potential))
    losses = ledger.restitution_loss + ledger.friction_loss
    assert ledger.drive_work == pytest.approx(losses + kept, rel=1e-9)
    turned = recording.pose("lever", [1.0, 2.0])[:, 2]
    assert np.diff(turned)[0] == pytest.approx(0.5 * pi, rel=2e-2)


def test_a_motor_that_holds_its_speed_brakes_what_falls():
    """W = ½ I ω² + m g ρ (1 - cos φ), past the top less again: of both Chipmunk tells no sign."""
    mass, length, speed, t = 0.5, 0.3, 2.0 * pi, 0.9
    motor = {"speed_deg": np.degrees(speed), "torque": 2.0}
    scene = machine(run={"until": t}, to=[0.0, -length], mass=mass, motor=motor)
    for engine, off in (("contact", 1e-7), ("pymunk", 1e-2)):
        recording = chutelab.simulate(scene, engine=engine)
        turned = recording.pose("lever", [t])[0, 2]
        kept = mass * length**2 / 6.0 * speed**2 + 0.5 * mass * G * length * (1.0 - np.cos(turned))
        assert recording.ledger.drive_work == pytest.approx(kept, rel=off)


def drawn(seed):
    """A random machine of three surfaces on hinges, in a box."""
    random = np.random.default_rng(seed)
    surfaces = []
    for n in range(3):
        x, y = 0.22 * (n - 1), random.uniform(-0.12, 0.05)
        dx, dy = random.uniform(-0.09, 0.09, 2)
        own = {"from": [x - dx, y - dy], "to": [x + dx, y + dy]}
        if random.random() < 0.25:
            own = {"center": [x, y], "radius": 0.05, "from_deg": 180.0, "to_deg": 350.0}
        own["hinge"] = (np.array([x, y]) + random.uniform(-0.02, 0.02, 2)).tolist()
        if random.random() < 0.7:
            own["mass"] = 10.0 ** random.uniform(-2.0, 0.5)
        else:
            own["inertia"] = 10.0 ** random.uniform(-4.0, -2.0)
        if random.random() < 0.6:
            own |= {"spring": 10.0 ** random.uniform(-2, 1), "rest_deg": random.uniform(-20, 20)}
        if random.random() < 0.5:
            own["damper"] = 10.0 ** random.uniform(-4.0, -1.0)
        if random.random() < 0.5:
            own["stops_deg"] = [-random.uniform(0.0, 40.0), random.uniform(1.0, 40.0)]
        if random.random() < 0.4:
            torque = 10.0 ** random.uniform(-3.0, 0.0)
            own["motor"] = {"speed_deg": random.uniform(-300.0, 300.0), "torque": torque}
        if random.random() < 0.2:
            own["speed"] = random.uniform(-1.0, 1.0)
        pair = {"restitution": random.uniform(0.0, 0.9), "friction": random.uniform(0.0, 1.0)}
        surfaces.append({"name": f"hung{n}", **own, **pair})
    return in_a_box(random, surfaces)


@pytest.mark.parametrize("seed", seeds(8, 300))
def test_random_machines_keep_the_laws(seed):
    sound(chutelab.simulate(drawn(seed), engine="contact"))


@pytest.mark.parametrize("keys", [{"damper": 7e-3}, {"spring": 4.0, "rest_deg": 0.0}])
def test_what_lies_at_its_stop_is_struck_and_stays_there(keys):
    """A ball turns it beyond the stop at some 10 rad/s; the stop, once a step, takes that whole.

    Its damper, and its spring, take of the angle that this rate comes to in a step (times 1.7e-5
    kg m²: 400/s and 480/s), which the stop must not count as turned.
    """
    stream = {"at": [0.045, 0.2], "velocity": [0.0, 0.0]}
    hung = {"inertia": 1.7e-5, "stops_deg": [0.0, 20.0], "restitution": 0.0, "run": {"until": 0.4}}
    recording = run(stream, to=[0.09, 0.0], hinge=[0.0, 0.0], **hung, **keys)
    assert recording.select("impact").size
    assert recording.swings["angle"].min() > -1e-6


@pytest.mark.parametrize(
    ("side", "shape", "gravity"),
    [(1, "disk", 0.0), (1, "box", 0.0), (1, "disk", G), (1, "box", G), (-1, "disk", 0.0)],
)
def test_a_blow_on_to_a_stop_is_one_on_a_floor_and_one_off_it_turns_the_hinge(side, shape, gravity):
    """Pressed on its stop it does not give way: v' = -e v, and m v² (1 - e²) / 2 is lost.

    A light lever under a heavy particle: if it gave way at first, the stop would take that once the
    step is over, and the contact seem to give what it takes. Off the stop the blow feels
    1 / (1/m + l²/I). By its weight the lever hops on the stop, by less than 1e-5 rad; the stop
    takes that when it is struck.
    """
    e, mass, lever, inertia, weight = 0.5, 1.0, 0.3, 1e-3, 0.01
    body = {"radius": R} if shape == "disk" else {"shape": "box", "size": [2.0 * R, 2.0 * R]}
    stream = {"at": [lever, side * 0.1], "velocity": [0.0, -2.0 * side]}
    scene = machine(stream, gravity=gravity, run={"until": 0.08}, inertia=inertia, mass=weight,
                    stops_deg=[0.0, 20.0], restitution=e)  # fmt: skip
    scene["particle"] = {**body, "mass": mass}
    recording = sound(chutelab.simulate(scene, engine="contact"))
    (blow,) = recording.select("impact")
    before, after = blow["velocity_before"][1], blow["velocity_after"][1]
    feels = mass if side > 0 else 1.0 / (1.0 / mass + lever**2 / inertia)
    near = 1e-11 if gravity else 1e-13
    assert after == pytest.approx(before - (1.0 + e) * before * feels / mass, rel=near)
    lost, hops = 0.5 * feels * before**2 * (1.0 - e**2), weight * gravity * 0.25 * 1e-3 / inertia
    hop = 0.5 * inertia * hops**2
    assert lost - near < recording.ledger.restitution_loss < lost + near + hop
    turned = recording.pose("lever", [blow["t"] + 1e-3])[0, 2]
    assert abs(turned) < 1e-6 if side > 0 else turned > 1e-3


def test_a_lever_that_is_struck_off_its_stop_was_at_rest():
    """A ball from below, at any instant of a step: the lever felt its hop on the stop, of g dt / 2.

    v' = v - (1 + e) v / (1 + m l² / I), with l to the ball's centre; it was off by up to 5e-3 m/s.
    """
    e, mass, lever, inertia = 0.5, 0.05, 0.3, 1e-2
    for below in np.linspace(0.05, 0.053, 8):
        stream = {"at": [lever, -below], "velocity": [0.0, 2.0]}
        scene = machine(stream, run={"until": 0.06}, inertia=inertia, mass=0.1,
                        stops_deg=[0.0, 20.0], restitution=e)  # fmt: skip
        scene["particle"] = {"radius": R, "mass": mass}
        (blow,) = sound(chutelab.simulate(scene, engine="contact")).select("impact")
        before, after = blow["velocity_before"][1], blow["velocity_after"][1]
        due = before * (1.0 - (1.0 + e) / (1.0 + mass * lever**2 / inertia))
        assert after == pytest.approx(due, abs=1e-6)


@pytest.mark.parametrize("before", [1e-4, 5e-4, 9e-4])
def test_a_blow_on_another_lever_lifts_none_off_its_stop(before):
    """It ends the step amid the lever's hop. Struck then, the lever still stands: v' = -e v."""
    e, height, far = 0.5, 0.1, 0.2
    lands = [np.sqrt(2.0 * drop / G) for drop in (height - R, far - R)]
    stream = [
        {"at": [0.3, height], "velocity": [0.0, 0.0], "interact": True, "start": 0.1},
        {"at": [2.0, far], "velocity": [0.0, 0.0], "start": 0.1 + lands[0] - lands[1] - before},
    ]
    scene = machine(stream, run={"until": 0.3}, inertia=1e-2, mass=0.1, stops_deg=[0.0, 20.0],
                    restitution=e)  # fmt: skip
    lever = scene["surface"][0]
    ends = {"from": [1.7, 0.0], "to": [2.2, 0.0], "hinge": [1.7, 0.0]}
    scene["surface"].append({**lever, **ends, "name": "other"})
    blows = sound(chutelab.simulate(scene, engine="contact")).select("impact")
    elsewhere, blow = blows[:2]
    assert elsewhere["particle"] == 1
    assert blow["t"] - elsewhere["t"] == pytest.approx(before, abs=1e-5)
    after, speed = blow["velocity_after"][1], -blow["velocity_before"][1]
    assert after == pytest.approx(e * speed, rel=1e-9)


@pytest.mark.parametrize("higher", [4e-4, 7e-4, 1e-3])
def test_a_blow_on_a_lever_strikes_nothing_that_slides_in_an_arc(higher):
    """On its way up in a hop, as fast as v^2 / (R - r) = 10 g makes it, a disk stays in contact."""
    radius, speed = 0.1, 3.0
    bowl = {"name": "bowl", "center": [-4.0, 0.0], "radius": radius, "from_deg": 180.0,
            "to_deg": 360.0, "restitution": 0.5, "friction": 0.0}  # fmt: skip
    stream = [
        {"at": [-4.0 - radius + R, 0.0], "velocity": [0.0, -speed], "interact": True},
        {"at": [0.3, R + 0.01 + higher], "velocity": [0.0, -speed]},
    ]
    scene = machine(stream, run={"until": 0.05}, more=[bowl], inertia=1e-2)
    recording = chutelab.simulate(scene, engine="contact")
    assert {*recording.select("impact")["particle"].tolist()} == {1}
    track = recording.track(0)
    energy = 0.5 * (track["velocity"] ** 2).sum(axis=1) + G * track["position"][:, 1]
    assert energy == pytest.approx(0.5 * speed**2, rel=2e-3)


def test_a_lever_that_a_blow_left_on_its_stop_stands_under_the_next_one():
    """It is at rest up to rounding, which may turn it off the stop by 1e-14 rad/s: v' = -e v.

    The first case had 0.21 v and is one of some 300 draws.
    """
    random = np.random.default_rng(3)
    cases = [(13.2, 0.01, 0.99, 0.28, 0.25, 1.2, 1e-3)]
    for _ in range(60):
        stop, inertia, e = (random.uniform(*span) for span in ((3, 25), (3e-3, 3e-2), (0.3, 1.0)))
        places = [random.uniform(*span) for span in ((0.2, 0.45), (0.15, 0.4), (1.0, 2.0))]
        cases.append((stop, inertia, e, *places, random.choice([3e-4, 1e-3, 2e-3]).item()))
    struck = 0
    for stop, inertia, e, first, second, height, dt in cases:
        stream = [
            {"at": [first, 0.05], "velocity": [0.0, -3.0], "interact": True},
            {"at": [second, height], "velocity": [0.0, -3.0]},
        ]
        recording = run(stream, {"mass": 0.1}, {"dt": dt}, gravity=0.0, inertia=inertia,
                        stops_deg=[-stop, 20.0], restitution=e, friction=0.0)  # fmt: skip
        blows = recording.select("impact")
        blow = blows[blows["particle"] == 1][0]
        if abs(recording.pose("lever", [blow["t"]])[0, 2] + radians(stop)) > 1e-9:
            continue
        struck += 1
        normal = [sin(radians(stop)), cos(radians(stop))]
        before, after = (blow[key] @ normal for key in ("velocity_before", "velocity_after"))
        assert after == pytest.approx(-e * before, rel=1e-11)
    assert struck > 50


def test_a_pair_of_blow_and_friction_that_feel_each_other_gives_no_energy():
    """A pivot off the line of the plate couples them; with e = 1, too, nothing is gained."""
    for x, y in np.random.default_rng(4).uniform(-0.3, 0.3, (40, 2)):
        stream = {"at": [0.25, 0.3], "velocity": [3.0 * x / 0.3, -2.0]}
        keys = {"inertia": 1e-4, "restitution": 1.0, "friction": 1.5, "gravity": 0.0}
        recording = run(stream, hinge=[0.2 + x, y], **keys)
        assert recording.ledger.friction_loss >= -1e-15
        assert recording.ledger.restitution_loss == pytest.approx(0.0, abs=1e-15)


def blow_on_lever(u, by, mu, arm, e):
    """Return the impulses of a blow, with friction, rolling friction and whether both were reduced.

    `by` says how they change normal velocity, slip and relative rotation. Of the nine ways in which
    both stop or act at their bounds, one is consistent. If it creates energy, both are smaller.
    """
    found = []
    for slide, turn in product((-1, 0, 1), repeat=2):
        rows, right = by.copy(), np.array([-(1.0 + e) * u[0], -u[1], -u[2]])
        for n, way, bound in ((1, slide, mu), (2, turn, arm)):
            if way:
                rows[n], right[n] = -way * bound * np.eye(3)[0] + np.eye(3)[n], 0.0
        j = np.linalg.solve(rows, right)
        after = u + by @ j
        fits = abs(j[1:]) <= np.array([mu, arm]) * j[0] * (1.0 + 1e-9)
        opposes = [way * after[n] <= 1e-12 for n, way in ((1, slide), (2, turn))]
        if j[0] >= 0.0 and fits.all() and all(opposes):
            found.append(j)
    assert found
    assert all(np.allclose(one, found[0]) for one in found)

    def work(share):
        j = np.append(0.0, share * found[0][1:])
        j[0] = (-(1.0 + e) * u[0] - by[0] @ j) / by[0, 0]
        return j, j[1:] @ (u + 0.5 * by @ j)[1:]

    if work(1.0)[1] <= 1e-15:
        return found[0], False
    least = 1e-9
    share = brentq(lambda s: work(s)[1], least, 1.0) if work(least)[1] < 0.0 else 0.0
    return work(share)[0], True


def test_a_disk_that_rolls_on_a_light_lever_is_struck_once_and_gives_no_energy():
    """Normal impulse, friction and rolling friction act on each other through the lever."""
    reduced = 0
    for seed in range(40):
        random = np.random.default_rng(seed)
        pivot, at = random.uniform([-0.1, -0.1], [0.1, 0.0]), random.uniform(0.05, 0.45)
        e, mu, rolling = random.uniform(0.0, [0.8, 0.6, 0.4])
        inertia, spin = 10.0 ** random.uniform(-7.0, -4.0), random.uniform(-100.0, 100.0)
        velocity = np.array([random.uniform(-1.0, 1.0), -1.0])
        start = np.array([at, R]) - 0.05 * velocity
        found = run(
            {"at": start.tolist(), "velocity": velocity.tolist(), "omega": spin},
            {"spin": True, "rolling_friction": rolling}, {"until": 0.0505}, gravity=0.0,
            hinge=pivot.tolist(), inertia=inertia, restitution=e, friction=mu,
        )  # fmt: skip
        own, lever = 0.5 * M * R**2, np.array([at - pivot[0], pivot[1], 1.0])
        roll, u = np.array([0.0, R, 1.0]), np.array([-1.0, velocity[0] + R * spin, spin])
        by = np.diag([1.0 / M, 1.0 / M, 0.0]) + np.outer(roll, roll) / own
        by += np.outer(lever, lever) / inertia
        j, less = blow_on_lever(u, by, mu, rolling * R, e)
        reduced += less
        (blow,) = found.select("impact")
        assert blow["velocity_after"] == pytest.approx(velocity + j[[1, 0]] / M, abs=1e-11)
        assert blow["omega_after"] == pytest.approx(spin + roll @ j / own, abs=1e-9)
        assert found.swings["rate"][-1] == pytest.approx(-lever @ j / inertia, abs=1e-9)
    assert 0 < reduced < 20


@pytest.mark.parametrize("faces", [8, 16, 32])
def test_a_wheel_of_many_faces_is_struck_in_pymunk_as_in_contact(faces):
    """Each face is a body of its own there, and a blow on one has to turn them all."""
    turns = np.arange(faces + 1) % faces * (2.0 * pi / faces)
    corners = 0.1 * np.stack([np.sin(turns), np.cos(turns)], axis=1)
    keys = {"points": corners.tolist(), "from": None, "to": None, "mass": 1.0}
    scene = machine({"at": [0.03, 0.2], "velocity": [0.0, 0.0]}, run={"until": 0.2}, **keys)
    contact, pymunk = (chutelab.simulate(scene, engine=name) for name in ("contact", "pymunk"))
    assert not pymunk.laws
    _, _, angle = contact.pose("lever", [0.2])[0]
    assert abs(angle) > 5e-4
    assert pymunk.pose("lever", [0.2])[0][2] == pytest.approx(angle, rel=0.05)
    assert pymunk.at([0.2])[0][0, 0] == pytest.approx(contact.at([0.2])[0][0, 0], abs=2e-3)


def test_pymunk_with_its_own_joints_agrees_to_the_order_of_its_step():
    keys = {"to": [0.0, -0.4], "mass": 0.2, "spring": 2.0, "damper": 0.02, "restitution": 0.6,
            "stops_deg": [-60.0, 8.0]}  # fmt: skip
    scene = machine({"at": [-0.3, -0.2], "velocity": [3.0, 0.0]}, **keys, run={"until": 0.4})
    contact = sound(chutelab.simulate(scene, engine="contact"))
    times, off = np.linspace(0.02, 0.39, 30), {}
    for dt in (1e-3, 2.5e-4):
        pymunk = chutelab.simulate(scene, {"run.dt": dt}, engine="pymunk")
        assert not pymunk.laws
        off[dt] = np.abs(pymunk.pose("lever", times) - contact.pose("lever", times)).max()
        assert abs(pymunk.ledger.residual) < 30.0 * dt * pymunk.ledger.turned_over
    assert off[2.5e-4] < 0.5 * off[1e-3] < 0.02
    for name in ("restitution_loss", "damper_loss"):
        assert getattr(pymunk.ledger, name) == pytest.approx(
            getattr(contact.ledger, name), rel=0.02
        )


def test_a_recording_keeps_how_it_swung(tmp_path):
    recording = run(mass=1.0)
    again = chutelab.Recording.load(recording.save(tmp_path / "a.npz"))
    times = np.linspace(-0.1, 1.1, 7)
    assert np.array_equal(again.pose("lever", times), recording.pose("lever", times))
    assert again.ledger == recording.ledger
    mover = recording.machine.movers[0]
    h = 1e-6
    rate = (mover.pose(times + h)[:, 2] - mover.pose(times - h)[:, 2]) / (2.0 * h)
    inside = slice(1, -1)
    assert mover.velocity(times)[inside, 2] == pytest.approx(rate[inside], abs=1e-6)


def test_a_particle_inside_what_hangs_breaks_a_law():
    scene = machine({"at": [0.2, R], "velocity": [0.0, 0.0]}, inertia=0.1, spring=5.0, damper=0.5)
    recording = sound(chutelab.simulate(scene))
    swings = recording.swings.copy()
    swings["angle"] += 0.05 * (swings["t"] > 0.3)
    spoilt = replace(recording, swings=swings)
    assert "lever" in {one.surface for one in judge(spoilt)}


@pytest.mark.parametrize("torque", [0.0, 0.3])
def test_bars_tell_what_a_motor_gives_from_what_the_hinge_keeps_and_its_stop_takes(torque):
    """All along they are the whole ledger of a run that ends then."""
    from chutelab.pictures.plots.scenery import energies

    keys = {"mass": 0.2, "damper": 0.002, "spring": 0.5, "stops_deg": [-20.0, 30.0]}
    if torque:
        keys["motor"] = {"speed_deg": 100.0, "torque": torque}
    stream = {"at": [0.3, 0.2], "velocity": [0.0, 0.0]}
    recording = run(stream, **keys)
    for until in (0.15, 0.5, 1.0):
        whole = run(stream, run={"until": until}, **keys).ledger
        bars = {name: one[0] for name, one in energies(recording, np.array([until])).items()}
        off = 1e-3 * whole.turned_over
        assert bars["belt_work"] == pytest.approx(whole.drive_work, abs=off)
        assert torque or abs(bars["belt_work"]) < 1e-6
        for name in ("restitution_loss", "friction_loss", "damper_loss"):
            assert bars[name] == pytest.approx(getattr(whole, name), abs=off)
        assert abs(bars["residual"]) < 1e-9


def test_a_film_draws_it_where_it_is_and_a_picture_where_it_ends():
    from chutelab.pictures.animation.actors import gates
    from chutelab.pictures.plots import Picture, draw_view

    recording = run(mass=1.0)
    ax = Picture((6.0, 4.0)).add_axes((0.0, 0.0, 1.0, 1.0))
    ((line, show),) = gates(ax, recording.machine, np.array([0.0, 0.4]))
    show(1)
    angle = recording.pose("lever", [0.4])[0, 2]
    expected = [[0.0, 0.0], [0.5 * cos(angle), 0.5 * sin(angle)]]
    assert line.get_xydata() == pytest.approx(np.array(expected), abs=1e-12)
    ax = Picture((6.0, 4.0)).add_axes((0.1, 0.1, 0.8, 0.8))
    (line,) = (one for one in draw_view(ax, recording, ()).lines if one.get_gid() == "last lever")
    angle = recording.pose("lever", [1.0])[0, 2]
    expected = [[0.0, 0.0], [0.5 * cos(angle), 0.5 * sin(angle)]]
    assert line.get_xydata() == pytest.approx(np.array(expected), abs=1e-9)


def test_the_damping_plate_may_hang():
    changes = {"plate.hinge": "pivot", "plate.inertia": 2e-3, "plate.spring": 0.5}
    recording = sound(chutelab.simulate("perpendicular", changes))
    assert recording.engine == "contact"
    assert recording.prediction.reason.item().endswith("plate moves")
    with pytest.raises(SceneError, match=r"plate.hinge moves it: contact or pymunk has that"):
        chutelab.load("perpendicular", {**changes, "run.engine": "exact"})


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"mass": 1.0, "inertia": 0.01}, "at least 0.0625 kg m2, mass times the square"),
        ({"inertia": 1e-6, "spring": 1e6}, "at least 0.0001 kg m2 with this spring"),
    ],
)
def test_an_inertia_that_cannot_be_is_refused(keys, said):
    with pytest.raises(ValueError, match=said):
        chutelab.simulate(machine(**keys))


def test_several_particles_that_do_not_meet_are_refused():
    scene = machine({"fill": [[0.1, 0.1], [0.3, 0.3]], "count": 3}, mass=1.0)
    with pytest.raises(SceneError, match="couples particles: several of them have to meet"):
        chutelab.load(scene)


@pytest.mark.parametrize(
    ("change", "law"),
    [
        ({"spring": 0.6}, "the ledger closes"),
        ({"mass": 0.25}, "the ledger closes"),
        ({"damper": 0.02}, "energy rises only by drives"),
        ({"stops_deg": [-30, 40]}, "nothing inside a surface"),
        ({"motor": {"speed_deg": 200.0, "torque": 0.01}}, "energy rises only by drives"),
    ],
)
def test_a_hinge_that_is_not_that_of_the_scene_breaks_a_law(change, law):
    """Its ledger may close in itself: it is judged by the scene and its states."""
    own = {"mass": 0.3, "spring": 0.5, "damper": 0.015, "stops_deg": [-60, 40]}
    own["motor"] = {"speed_deg": 200.0, "torque": 0.05}
    stream = {"at": [0.3, 0.4], "velocity": [0.0, 0.0]}
    recording = run(stream, **own)
    other = chutelab.simulate(machine(stream, **own | change)).machine
    hinges = [replace(m, hinge=replace(m.hinge, states=recording.swings)) for m in other.movers]
    wrong = replace(recording, machine=replace(other, movers=tuple(hinges)))
    assert law in {broken.law for broken in judge(wrong)}
    assert {broken.surface for broken in judge(wrong)} == {"lever"}


def test_what_goes_over_between_two_boards_at_their_stops_is_told_where_it_is():
    """Where two stops are met in a row a step has no length: all numbers of events are finite."""
    at_stops = {"restitution": 0.0, "friction": 50.0}
    recording = chutelab.simulate({
        "particle": {"radius": 0.006, "spin": True, "mass": 0.198},
        "surface": [
            {"name": "heavy", "from": [-0.014, 0.554], "to": [0.031, 0.406], "mass": 4.258,
             "hinge": [0.009, 0.48], "stops_deg": [-47.343, 55.691], "spring": 0.774,
             "rest_deg": -11.091, **at_stops},
            {"name": "light", "from": [-0.028, 0.404], "to": [0.009, 0.591], "mass": 0.061,
             "hinge": [-0.028, 0.404], "stops_deg": [-29.288, 51.315], "spring": 5.413,
             "rest_deg": -32.702, "motor": {"speed_deg": 195.881, "torque": 0.062}, **at_stops,
             "restitution": 0.496},
        ],
        "stream": {"count": 30, "at": [-0.05, 0.75], "to": [0.05, 0.75], "velocity": [0.0, -0.922],
                   "rate": 100.0, "interact": True, "restitution": 0.0, "friction": 5.0,
                   "seed": 3},
        "run": {"until": 0.35, "engine": "contact"},
    })  # fmt: skip
    assert np.isfinite(recording.events["position"]).all()
    assert not recording.laws
