"""Random crowds of disks.

- `crowd`: the machine of a seed: 50 to 500 disks in a box, a funnel, on belts or in a transfer.
- `hollow`: the machine of a seed: 2 to 12 disks in and about the insides of arcs.

Lengths are drawn in radii and speeds in √(G r), so that a scene of 0.1 mm is one of 1 m made small;
G is gravity, or 1 m/s² if that is less.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, inf, radians, sin, sqrt

import numpy as np

from chutelab.machine import build
from chutelab.scene import SceneError, from_dict
from machines import thrown
from references import surface_depths

KINDS = ("box", "funnel", "belts", "transfer")

MOST_STEPS = 4000
"""Steps of `dt` that a crowd is run for, at most."""


def crowd(seed, *, count=None):
    """Return the machine of a seed, and what kind it is; `count` limits the disks."""
    rng = np.random.default_rng(seed)
    while True:
        kind = KINDS[int(rng.integers(len(KINDS)))]
        try:
            return kind, _Draw(rng, count).machine(kind)
        except SceneError:
            continue  # a release inside a surface, a plate that is missed


def hollow(seed):
    """Return the machine of a seed: disks that slide, fly and pile up in one or two hollow arcs.

    The radius r is 0.05 to 0.9 of that of the first arc, which spans 20° to all round; friction and
    restitution are 0 to 1; with and without gravity, spin, a speed of the arcs, and a floor below.
    """
    rng = np.random.default_rng([26, seed])

    def one_of(*values):
        return values[int(rng.integers(len(values)))]

    def pair():
        return {
            "restitution": one_of(0.0, 0.0, 1.0, rng.uniform()),
            "friction": one_of(0.0, 1.0, rng.uniform(), rng.uniform()),
        }

    r = 0.01
    size = r / np.exp(rng.uniform(np.log(0.05), np.log(0.9)))
    gravity = one_of(0.0, 9.81, 9.81, rng.uniform(0.0, 50.0))
    fast = one_of(0.0, 0.3, 1.0, 3.0, rng.uniform(0.0, 10.0))
    arcs = []
    for _ in range(one_of(1, 1, 2)):
        middle = one_of(-90.0, -90.0 + rng.uniform(-90.0, 90.0))
        half = 0.5 * one_of(180.0, 360.0, rng.uniform(20.0, 180.0), rng.uniform(180.0, 360.0))
        away = 2.0 * size * rng.uniform(-1.0, 1.0, 2) if arcs else np.zeros(2)
        arcs.append({
            "name": f"arc{len(arcs)}", "center": away.tolist(),
            "radius": size * (rng.uniform(0.7, 1.3) if arcs else 1.0),
            "from_deg": middle - half, "to_deg": middle + half,
            "speed": one_of(0.0, 0.0, 0.0, rng.uniform(-2.0, 2.0)), **pair(),
        })  # fmt: skip
    low = -4.0 * size
    floor = {"name": "floor", "from": [-20.0 * size, low], "to": [20.0 * size, low], **pair()}
    drawn = {
        "gravity": gravity,
        "particle": {"radius": r, "mass": 0.01, "spin": one_of(True, False)},
        "surface": [*arcs, floor],
        "stream": {"at": [0.0, 9.0 * size], "velocity": [0.0, 0.0], "count": 2, "interact": True,
                   "rate": 1.0, **pair()},
        "run": {"until": 0.5, "max_time": 0.5, "dt": one_of(1e-3, 1e-3, 3e-4, 2e-3)},
    }  # fmt: skip
    built, places, velocities, count = build(from_dict(drawn)), [], [], int(rng.integers(2, 13))
    for _ in range(1000):
        arc, turned = one_of(*arcs), rng.uniform(-np.pi, np.pi)
        room = arc["radius"] - r
        # At the wall, inside, or anywhere near.
        away = one_of(room, room * sqrt(rng.uniform()), arc["radius"] * rng.uniform(0.0, 2.5))
        x = arc["center"] + max(away, 0.0) * np.array([cos(turned), sin(turned)])
        depths = surface_depths(built, x[None], r, 0.0)
        apart = min((np.hypot(*(x - other)) for other in places), default=inf)
        if apart < 2.0 * r or max(float(depth[0]) for depth in depths) > 1e-9 * r:
            continue
        places.append(x)
        angle = turned + one_of(-0.5, 0.5, rng.uniform(-1.0, 1.0)) * np.pi
        velocities.append(fast * rng.uniform() * np.array([cos(angle), sin(angle)]))
        if len(places) == count:
            break
    return thrown(built, places, velocities)


class _Draw:
    def __init__(self, rng, count):
        self.rng = rng
        self.count = int(np.exp(rng.uniform(np.log(50), np.log(500))))
        if count is not None:
            self.count = min(self.count, count)
        self.r = 10.0 ** self.uniform(-4.0, 0.0)
        self.g = self.one_of(9.81, 9.81, self.uniform(0.0, 100.0), 10.0 ** self.uniform(-1, 2), 0.0)
        strength = max(self.g, 1.0)
        self.v = sqrt(strength * self.r) * 10.0 ** self.uniform(0.0, 1.3)
        self.tau = sqrt(self.r / strength)
        drawn = self.one_of(1e-3, 0.05 * self.tau * 10.0 ** self.uniform(-0.5, 0.5))
        self.dt = min(max(drawn, 0.03 * self.tau, 1e-7), 0.1)

    def uniform(self, low, high):
        return float(self.rng.uniform(low, high))

    def one_of(self, *values):
        return values[int(self.rng.integers(len(values)))]

    def pair(self):
        return {
            "restitution": self.one_of(0.0, 1.0, self.uniform(0.0, 1.0), self.uniform(0.2, 0.9)),
            "friction": self.one_of(0.0, self.uniform(0.0, 1.0), self.uniform(0.0, 1.0), 5.0),
        }

    def surface(self, name, points, speed=0.0):
        """Return a surface through points that are given in radii."""
        ends = (self.r * np.array(points)).tolist()
        return {"name": name, "points": ends, "speed": speed, **self.pair()}

    def belt_speed(self):
        return self.one_of(-1.0, 1.0) * self.v * self.uniform(0.1, 1.5)

    def machine(self, kind):
        duration = min(self.tau * self.uniform(60.0, 200.0), MOST_STEPS * self.dt)
        self.wide = 2.0 * self.uniform(4.0, 1.5 * sqrt(self.count))
        # So high that all find room, and half as much again.
        self.high = max(20.0, 6.0 * self.count / self.wide)
        document = {
            "gravity": self.g,
            "particle": {
                "radius": self.r,
                "mass": 10.0 ** self.uniform(-3.0, 1.0),
                "spin": self.one_of(True, False),
            },
            "stream": {
                "count": self.count, "interact": True, "seed": int(self.rng.integers(1000)),
                "bed_height": self.r * self.one_of(0.0, self.uniform(2.0, 20.0)), **self.pair(),
            },
            "run": {
                "until": self.one_of("settled", duration, duration),
                "max_time": duration,
                "dt": self.dt,
            },
            **getattr(self, f"_{kind}")(),
        }  # fmt: skip
        stream = document["stream"]
        stream.update(document.pop("released", {}))
        # From sparse to twice as many as can pass by one after the other.
        layers = 1.0 + stream["bed_height"] / (2.0 * self.r)
        stream["rate"] = layers * self.v / (2.0 * self.r) * self.uniform(0.1, 2.0)
        built = build(from_dict(document))
        lattice = kind != "transfer" and self.one_of(True, False)
        return self.lattice(built) if lattice else built

    def lattice(self, built):
        """All at once, in rows from the release point's height upwards, to and fro at random."""
        rows = max(1, int((self.wide - 2.5) // 2.1))
        k = np.arange(self.count)
        x = 2.1 * (k % rows - 0.5 * (rows - 1))
        y = 2.1 * (k // rows) + self.base
        velocity = 0.5 * self.v * self.rng.normal(size=(self.count, 2))
        return replace(
            built,
            releases=replace(
                built.releases,
                t=np.zeros(self.count),
                position=self.r * np.stack([x, y], axis=1),
                velocity=velocity,
                carried=np.zeros(self.count, dtype=bool),
                omega=np.zeros(self.count),
                angle=np.zeros(self.count),
            ),
            end_time=built.end_time - float(built.releases.t[-1])
            if built.until != "time"
            else built.end_time,
        )

    def pour(self):
        """Release them where `lattice` begins, mostly downwards."""
        angle = self.one_of(self.uniform(-np.pi, np.pi), self.uniform(-1.0, 1.0))
        return {
            "released": {
                "at": [0.0, self.base * self.r],
                "velocity": [self.v * sin(angle), -self.v * cos(angle)],
            }
        }

    def _box(self):
        w, h = 0.5 * self.wide, self.high
        self.base = 1.5 if self.one_of(True, False) else 0.6 * h
        walls = [[-w, h], [-w, 0.0], [w, 0.0], [w, h]]
        closed = self.one_of(True, False)
        if closed:
            # A lid so high that a whole lattice finds room below it.
            top = self.base + 2.2 * self.count / max(1, (self.wide - 2.5) // 2.1) + 4.0
            walls[0][1] = walls[3][1] = max(h, top)
            walls.append(walls[0])
        return {"surface": [self.surface("box", walls)], **self.pour()}

    def _funnel(self):
        w, gap = 0.5 * self.wide + 4.0, 0.5 * self.uniform(2.2, 12.0)
        slope = radians(self.uniform(15.0, 75.0))
        rise = (w - gap) * sin(slope) / cos(slope)
        low = self.uniform(5.0, 40.0)
        self.base = low + rise + 2.0
        top = self.base + 2.2 * self.count / max(1, (self.wide - 2.5) // 2.1) + 6.0
        sides = [
            self.surface(f"side{s:+.0f}", [[s * w, top], [s * w, low + rise], [s * gap, low]])
            for s in (-1.0, 1.0)
        ]
        floor = 2.0 * w
        tray = [[-floor, 10.0], [-floor, 0.0], [floor, 0.0], [floor, 10.0]]
        if self.one_of(True, False):
            sides.append(self.surface("tray", tray))
        else:
            sides.append(self.surface("belt", tray[1:3], self.belt_speed()))
        return {"surface": sides, **self.pour()}

    def _belts(self):
        belts = []
        for n in range(int(self.rng.integers(2, 6))):
            length, angle = self.uniform(10.0, 80.0), self.uniform(-0.6, 0.6)
            x, y = self.uniform(-40.0, 20.0), self.uniform(0.0, 60.0)
            end = [x + length * cos(angle), y + length * sin(angle)]
            belts.append(self.surface(f"belt{n}", [[x, y], end], self.belt_speed()))
        if self.one_of(True, False):
            belts.append(self.surface("floor", [[-120.0, -5.0], [120.0, -5.0]]))
        self.base = 110.0
        return {"surface": belts, **self.pour()}

    def _transfer(self):
        pair, radius = self.pair(), self.uniform(5.0, 100.0)
        adhesion = self.one_of(True, False)
        # Layers that are carried round the pulley run into each other: there is one, if it is slow.
        slow = self.v**2 < self.g * self.r * (radius + 22.0)
        bed = {"released": {"bed_height": 0.0}} if adhesion and slow else {}
        tables = {
            "incoming": {
                "speed": self.v,
                "pulley_radius": self.r * radius,
                "length": self.r * self.uniform(10.0, 100.0),
                "friction": "adhesion" if adhesion else pair["friction"],
                "restitution": pair["restitution"],
            },
            "plate": {
                "distance": self.r * self.uniform(10.0, 150.0),
                "angle_deg": self.uniform(-40.0, 50.0),
                "above": self.r * self.uniform(10.0, 80.0),
                "below": self.r * self.uniform(10.0, 60.0),
                **self.pair(),
            },
            "outgoing": {
                "speed": self.belt_speed(),
                "drop": self.r * (2.0 * radius + self.uniform(20.0, 200.0)),
                "drop_from": "top",
                "start": -self.r * 200.0,
                "length": self.r * 600.0,
                **self.pair(),
            },
        }
        # Nothing pushes back a carried disk: a jam that reaches up to the pulley would be crushed.
        out = tables["outgoing"]
        takes_away = self.g > 0.0 and out["speed"] > 0.3 * self.v and out["friction"] > 0.0
        if not takes_away:
            tables["incoming"]["friction"] = pair["friction"]
        return {**bed, **tables}


def hop_step(machine, longest):
    """Return the longest step, s; a hop g h²/8 is a thousandth of the radius at most."""
    if machine.gravity == 0.0:
        return longest
    return min(longest, sqrt(8e-3 * machine.particle.radius / machine.gravity))
