"""Lone scenes drawn at random, with every option of a scene file; whether they show blows only."""

import numpy as np

from chutelab.machine import build
from chutelab.results import Kind
from chutelab.scene import SceneError, from_dict

LASTING = (Kind.SLIP, Kind.STICK, Kind.SETTLE)
"""Events that only a lasting contact has."""

BALLISTIC = 1e-9
"""Share of the speeds involved by which velocities in free flight may differ from v - g t."""


def draw(seed, *, points=True):
    """Return the scene of a seed: one particle in a machine that can be built.

    The same seed gives the same scene. One particle in eight is a mass point (radius 0), which the
    exact engine alone takes, unless `points` is false. Speeds are 0.3 to 6 m/s, lengths 0.03 to 2 m
    and disks 1 to 40 mm; at most 6 s are run.
    """
    rng = np.random.default_rng(seed)
    while True:
        try:
            scene = from_dict(_tables(rng, points), f"drawn-{seed}")
            build(scene)
        except SceneError:
            # The plate that should place the belt is missed, or the release is inside something.
            continue
        return scene


def only_blows(recording, apart=0.0):
    """Tell whether all contacts are blows, at least `apart` (s) from each other.

    Read off events and knots: what touches nothing keeps its spin, and v + g t. The ride of an
    adhesive belt, up to the first separation, does not count as a contact.
    """
    if np.isin(recording.events["kind"], LASTING).any():
        return False
    carried = recording.machine.releases.carried
    for particle in range(recording.count):
        own = recording.events[recording.events["particle"] == particle]
        knots = recording.track(particle)
        leaves = own["t"][own["kind"] == Kind.SEPARATION]
        if carried[particle]:
            knots = knots[knots["t"] >= leaves[0]] if len(leaves) else knots[:0]
        blows = own["t"][np.isin(own["kind"], (Kind.IMPACT, Kind.LANDING))]
        if (np.diff(blows) < apart).any():
            return False
        time = np.diff(knots["t"])
        velocity = np.diff(knots["velocity"], axis=0)
        velocity[:, 1] += recording.gravity * time
        scale = BALLISTIC * (np.abs(knots["velocity"]).max(initial=0.0) + recording.gravity)
        turn = np.abs(np.diff(knots["omega"])) * recording.particle.radius
        forced = (np.abs(velocity).max(axis=1, initial=0.0) > scale) | (turn > scale)
        if (forced & (time > 0.0)).any():
            return False
    return True


def _tables(rng, points):
    def uniform(low, high):
        return float(rng.uniform(low, high))

    def chance(share):
        return bool(rng.random() < share)

    def one_of(*values):
        return values[int(rng.integers(len(values)))]

    def some(**drawn):
        """Leave out half of the values, so that their defaults are drawn as well."""
        return {key: value for key, value in drawn.items() if chance(0.5)}

    def pair():
        return {
            "restitution": one_of(0.0, uniform(0.0, 1.0), uniform(0.2, 0.9), 1.0),
            "friction": one_of(0.0, uniform(0.0, 1.0), uniform(0.0, 1.0), 5.0),
        }

    radius = 0.0 if points and chance(0.125) else float(10.0 ** uniform(-3.0, -1.4))
    tables = {
        "gravity": one_of(9.81, 9.81, 9.81, uniform(1.0, 25.0), 0.0 if chance(0.2) else 1.62),
        "particle": {
            "radius": radius,
            "spin": radius > 0.0 and chance(0.5),
            **some(mass=uniform(1e-3, 2.0)),
        },
        "run": {"max_time": uniform(4.0, 6.0), **some(until=one_of("settled", uniform(1.5, 5.0)))},
        "stream": {},
    }
    thrown = {
        "at": [uniform(-0.6, 0.6), uniform(0.4, 1.0)],
        "velocity": [uniform(-2.0, 4.0), uniform(-2.0, 2.0)],
    }
    belt = chance(0.9)
    if belt:
        speed, pulley = uniform(0.3, 6.0), uniform(0.03, 0.6)
        tables["incoming"] = {
            "speed": speed,
            "pulley_radius": pulley,
            **some(length=uniform(0.2, 2.0), restitution=uniform(0.0, 0.9)),
            **some(friction=one_of(0.0, uniform(0.0, 0.3), uniform(0.1, 2.0), uniform(0.1, 2.0))),
        }
        if chance(0.9):
            reach = some(above=uniform(0.1, 1.0), below=uniform(0.2, 1.0))
            tables["plate"] = {
                "distance": uniform(0.1, 1.5),
                **some(angle_deg=uniform(-60.0, 60.0), pivot_height=pulley + uniform(-0.2, 0.3)),
                **pair(),
                **reach,
            }
        if chance(0.9):
            low = "plate" not in tables or chance(0.3)
            tables["outgoing"] = {
                "drop": uniform(0.2, 1.5) + (2.0 * pulley if low else 0.0),
                "drop_from": "top" if low else "impact",
                **some(
                    speed=uniform(-3.0, 5.0), start=uniform(-2.0, 0.5), length=uniform(2.0, 6.0)
                ),
                **some(**pair()),
            }
        if chance(0.1):
            tables["stream"] = thrown
        elif chance(0.15):
            # Put on the belt somewhere, or with a speed of its own where friction allows it.
            tables["stream"]["at"] = [-uniform(0.0, 0.2), pulley + radius]
            if "friction" in tables["incoming"]:
                tables["stream"]["velocity"] = [speed * uniform(0.2, 2.0), 0.0]
    else:
        tables["stream"] = thrown
    count = int(rng.integers(0 if belt else 1, 4)) if chance(0.3) or not belt else 0
    tables["surface"] = [_surface(n, uniform, one_of, pair) for n in range(count)]
    return tables


def _surface(n, uniform, one_of, pair):
    points = [np.array([uniform(-0.8, 1.8), uniform(-1.5, 0.6)])]
    for _ in range(one_of(1, 1, 2, 3)):
        angle, length = uniform(-np.pi, np.pi), uniform(0.1, 0.8)
        points.append(points[-1] + length * np.array([np.cos(angle), np.sin(angle)]))
    ends = [point.tolist() for point in points]
    course = {"from": ends[0], "to": ends[1]} if len(ends) == 2 else {"points": ends}
    return {"name": f"s{n}", **course, **pair(), "speed": one_of(0.0, 0.0, uniform(-3.0, 3.0))}
