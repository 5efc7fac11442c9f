"""Machines of what other generators never put together, drawn at random.

- Surfaces turn, shake and travel at once, arcs too; hang at or near a stop, with a motor that a
  touch starts; are gates that a touch opens or shuts, one-sided, belts. Arcs go on in lines and
  arcs that share their ends, and particles are released on such a joint.
- Particles are disks, spheres, boxes down to a thirtieth of their width, and polygons of 3 to 8
  corners; they stick together or to surfaces (cohesion), roll with friction, yield when fast.
- Strings are tight, slack or over a pulley; rods, springs, pins. Gravity from any side, none; air.
- `on_conveyors` has conveyors beside them.
- `shaken_bowl` has 33 to 60 disks in an arc that shakes, turns, or both.

What it never draws: the incoming and outgoing belt, plates, fills, pegs in rows, materials, gases;
scenes of more than five particles in anything but a bowl.
"""

from math import cos, pi, radians, sin

import numpy as np

from chutelab.machine import build
from chutelab.scene import SceneError, from_dict
from sandbox import Dice

WALLS = [[-0.5, 0.8], [-0.5, -0.4], [0.5, -0.4], [0.5, 0.8]]


def tables(seed):
    """Return a scene that can be built, as its file has it; the same seed gives the same scene.

    Sizes are 3 to 60 mm, masses 5 g to 2 kg, speeds up to 5 m/s; 0.3 to 0.6 s are run.
    """
    rng = np.random.default_rng([7, seed])
    while True:
        drawn = Oddities(rng).tables
        try:
            build(from_dict(drawn))
        except SceneError:
            # Two released in one place, or one in a surface.
            continue
        return drawn


def on_conveyors(seed):
    """Return such a scene with one or two conveyors in it, level or inclined, at up to 3 m/s."""
    dice = Dice(np.random.default_rng([9, seed]))
    while True:
        belts = []
        for _ in range(dice.whole(1, 2)):
            x, y, slope = dice.number(-0.3, 0.1), dice.number(-0.3, 0.0), dice.number(-0.5, 0.5)
            length = dice.number(0.1, 0.4)
            end = [x + length * cos(slope), y + length * sin(slope)]
            row = {"name": f"belt{len(belts)}", "from": [x, y], "to": end,
                   "pulley_radius": dice.number(0.01, 0.05), "speed": dice.number(-3, 3),
                   "restitution": dice.number(0, 0.9), "friction": dice.number(0, 1)}  # fmt: skip
            belts.append(row)
        drawn = {**Oddities(dice.rng).tables, "conveyor": belts}
        try:
            build(from_dict(drawn))
        except SceneError:
            continue
        return drawn


def shaken_bowl(seed):
    """Return 33 to 60 disks that fall into an arc that shakes, turns, or both."""
    dice = Dice(np.random.default_rng([8, seed]))
    side = dice.whole(6, 7)
    count = dice.whole(33, min(60, side * 9))
    bowl = {"name": "bowl", "center": [0.0, 0.0], "radius": 0.25, "from_deg": dice.number(150, 200),
            "to_deg": dice.number(340, 400),
            "restitution": dice.number(0, 0.6), "friction": dice.number(0, 0.8)}  # fmt: skip
    shakes = {"shake": {"by": dice.rng.uniform(-0.004, 0.004, 2).tolist(),
                        "frequency": dice.number(3, 25)}}  # fmt: skip
    turns = {"turn": dice.number(-90, 90), "pivot": [dice.number(-0.1, 0.1), -0.1]}
    streams = [
        {"particle": "small" if dice.chance(0.5) else "large",
         "at": [0.04 * (n % side - 0.5 * (side - 1)) + dice.number(-0.003, 0.003),
                -0.1 + 0.04 * (n // side) + dice.number(-0.003, 0.003)],
         "velocity": dice.rng.uniform(-0.3, 0.3, 2).tolist(), "interact": True,
         "restitution": 0.4, "friction": 0.3}
        for n in range(count)
    ]  # fmt: skip
    return {
        "particle": [{"name": "small", "radius": 0.009, "mass": 0.01, "spin": True},
                     {"name": "large", "radius": 0.015, "mass": 0.03, "spin": dice.chance(0.5)}],
        "surface": [bowl | dice.one_of(shakes, turns, shakes | turns)],
        "stream": streams,
        "run": {"until": 0.4},
    }  # fmt: skip


class Oddities(Dice):
    """One attempt at a scene."""

    def __init__(self, rng):
        super().__init__(rng)
        self.tables = {"run": {"until": self.number(0.3, 0.6)}}
        if self.chance(0.25):
            self.tables["gravity"] = self.one_of(0.0, 0.0, 2.0, 30.0)
        if self.chance(0.25):
            self.tables["gravity_deg"] = self.number(-180, 180)
        if self.chance(0.1):
            self.tables["air_density"] = self.one_of(1.2, 50.0)
        self.rows, self.joint = [{"name": "walls", "points": WALLS, **self.values()}], None
        self._kinds()
        for n in range(self.whole(1, 3)):
            self._thing(f"s{n}")
        self._streams()
        if self.chance(0.35):
            self._joints()
        self._pairs()

    def values(self):
        return {
            "restitution": self.one_of(0.0, self.number(0, 0.9), self.number(0, 1), 1.0),
            "friction": self.one_of(0.0, self.number(0, 1), self.number(0, 1), 5.0),
        }

    def decades(self, low, high):
        """Draw a number whose logarithm is uniform."""
        return float(10.0 ** self.rng.uniform(np.log10(low), np.log10(high)))

    def near(self, place, reach):
        return (np.array(place) + self.rng.uniform(-reach, reach, 2)).tolist()

    def _kinds(self):
        self.kinds = []
        for n in range(self.whole(1, 3)):
            size, shape = (
                self.decades(3e-3, 0.06),
                self.one_of(*["disk"] * 2, "sphere", *["box"] * 2, "polygon"),
            )
            row = {
                "name": f"k{n}",
                "shape": shape,
                "mass": self.decades(5e-3, 2.0),
                "spin": self.chance(0.75),
            }
            if shape == "box":
                row["size"] = [size, size * self.one_of(1.0, 0.5, 0.1, 0.03)]
            elif shape == "polygon":
                row["points"] = self._round(0.5 * size, self.whole(3, 8))
            else:
                row["radius"] = 0.5 * size
                if row["spin"] and self.chance(0.4):
                    row["rolling_friction"] = self.number(0.01, 0.5)
                if self.chance(0.15):
                    row["restitution_speed"] = self.decades(0.01, 1.0)
            self.kinds.append(row)
        self.tables["particle"] = self.kinds

    def _round(self, size, count):
        turns = (np.arange(count) + self.rng.uniform(-0.3, 0.3, count)) * 2.0 * pi / count
        return (size * np.array([np.cos(turns), np.sin(turns)]).T).tolist()

    def _thing(self, name):
        at = np.array([self.number(-0.25, 0.25), self.number(-0.25, 0.05)])
        slope = self.number(-1.2, 1.2)
        half = 0.5 * self.decades(0.05, 0.4) * np.array([cos(slope), sin(slope)])
        course = self.one_of("line", "line", "line", "arc", "arc", "peg", "vee", "shape")
        row = {"name": name, **self.values()}
        if course == "line":
            row |= {"from": (at - half).tolist(), "to": (at + half).tolist()}
        elif course == "arc":
            begin = self.number(-180, 180)
            row |= {"center": at.tolist(), "radius": self.number(0.05, 0.25), "from_deg": begin,
                    "to_deg": begin + self.one_of(-1.0, 1.0) * self.number(40, 200)}  # fmt: skip
        elif course == "peg":
            row |= {"center": at.tolist(), "radius": self.number(0.01, 0.08)}
        elif course == "vee":
            low = [at[0] + self.number(-0.05, 0.05), at[1] - self.number(0.02, 0.15)]
            row["points"] = [(at - half).tolist(), low, (at + half).tolist()]
        else:
            corners = at + self._round(self.number(0.03, 0.12), self.whole(3, 8))
            row["points"] = [*corners.tolist(), corners[0].tolist()]
        fate = self.one_of("still", "hangs", "hangs", *["moves"] * 3, "belt", "passes", "gate")
        if fate == "hangs":
            row |= self._hinge(at, half)
        elif fate == "moves":
            row |= self._motion(at)
        elif fate == "belt":
            row["speed"] = self.number(-self.one_of(1, 8), 1)
        elif fate == "passes" and course in ("line", "arc"):
            row["passes"] = (
                self.one_of("in", "out") if course == "arc" else self.one_of("up", "down")
            )
            if self.chance(0.4):
                row["shake"] = self._shake()
        elif fate == "gate":
            row |= self.one_of(
                {self.one_of("opens_at", "closes_at"): self.number(0.02, 0.25)},
                {self.one_of("opens_when", "closes_when"): {"touched": "walls"}},
            )
        self.rows.append(row)
        if fate == "still" and course == "arc":
            self._goes_on(row)

    def _goes_on(self, row):
        """Add a piece that begins where an arc ends, tangential or not; remember the joint."""
        turn = radians(row["to_deg"])
        away = np.array([cos(turn), sin(turn)])
        end = np.array(row["center"]) + row["radius"] * away
        name, size = f"{row['name']}-on", self.number(0.05, 0.2)
        if self.chance(0.5):
            way = np.array([-away[1], away[0]]) * np.sign(row["to_deg"] - row["from_deg"])
            way = way + self.one_of(0.0, 0.5) * away
            on = {"from": end.tolist(), "to": (end + size * way).tolist()}
        else:
            # The other side of the same tangent: hollow goes on as round.
            begin = row["to_deg"] + 180.0
            on = {"center": (end + size * away).tolist(), "radius": size, "from_deg": begin,
                  "to_deg": begin - np.sign(row["to_deg"] - row["from_deg"]) * 70.0}  # fmt: skip
        self.rows.append({"name": name, **on, **self.values()})
        self.joint = end, away

    def _hinge(self, at, half):
        row = {"hinge": self.one_of(at, at + half, self.near(at, 0.1))}
        row["hinge"] = [float(x) for x in row["hinge"]]
        row |= self.one_of({"mass": self.decades(0.01, 5)}, {"inertia": self.decades(1e-4, 0.05)})
        if self.chance(0.5):
            row |= {"spring": self.decades(0.01, 20.0), "rest_deg": self.number(-30, 30)}
        if self.chance(0.4):
            row["damper"] = self.decades(1e-4, 0.3)
        if self.chance(0.4):
            row["stops_deg"] = [-self.one_of(0.0, self.number(0, 40)), self.number(0.1, 40)]
        if self.chance(0.3):
            row["motor"] = {"speed_deg": self.number(-400, 400), "torque": self.decades(1e-3, 3)}
            row |= {"starts_when": {"touched": "walls"}} if self.chance(0.3) else {}
        if self.chance(0.2):
            row["speed"] = self.number(-1, 1)
        return row

    def _shake(self):
        return {"by": self.near([0, 0], 0.01), "frequency": self.decades(1, 40),
                "phase_deg": self.one_of(0.0, self.number(-180, 180))}  # fmt: skip

    def _motion(self, at):
        row = {}
        travel = {"to": self.near(at, 0.1), "at": self.number(0, 0.2), "in": 0.2}
        ways = [{"turn": self.number(-300, 300)}, {"shake": self._shake()}, {"travel": travel}]
        for n in self.rng.permutation(3)[: self.whole(1, 3)]:
            row |= ways[n]
        if {"turn", "travel"} & {*row}:
            row["pivot"] = self.near(at, 0.05)
        if self.chance(0.3):
            row["speed"] = self.number(-1, 1)
        if self.chance(0.2):
            row["starts_when"] = {"touched": "walls"}
        return row

    def _streams(self):
        self.tables |= {"surface": self.rows, "stream": []}
        between = {"interact": True, **self.values()}
        count = self.whole(1, 4)
        for n in range(count):
            kind, fast = self.one_of(*self.kinds), self.one_of(1.0, 1.0, 5.0)
            row = {"particle": kind["name"],
                   "at": [-0.3 + 0.2 * n + self.number(-0.03, 0.03), self.number(0.1, 0.3)],
                   "velocity": [self.number(-fast, fast), self.number(-fast, 0.3 * fast)],
                   **between}  # fmt: skip
            if kind["spin"] and self.chance(0.5):
                row["omega"] = self.number(-20, 20) * self.one_of(1.0, 10.0)
            if kind["shape"] in ("box", "polygon"):
                row["angle_deg"] = self.number(-180, 180)
            self.tables["stream"].append(row)
        if self.joint is not None and self.chance(0.7):
            self._on_the_joint(self.tables["stream"][0])

    def _on_the_joint(self, row):
        """Release it beside the joint of two pieces, just off the surface."""
        end, away = self.joint
        kind = next(kind for kind in self.kinds if kind["name"] == row["particle"])
        size = (
            kind.get("radius")
            or np.hypot(*np.array(kind.get("points", [kind.get("size")])).T).max()
        )
        row["at"] = (end - (1.0 + self.number(0, 0.2)) * size * away).tolist()
        row["velocity"] = self.near([0, 0], 0.3)

    def _joints(self):
        streams = self.tables["stream"]
        spins = {kind["name"]: kind["spin"] for kind in self.kinds}
        for n, row in enumerate(streams):
            kind = self.one_of("string", "string", "rod", "spring", "pin")
            if self.chance(0.5) or (kind == "pin" and not spins[row["particle"]]):
                continue
            joint = {"particle": n, "from": self.near(row["at"], 0.03 if kind == "pin" else 0.25)}
            if kind != "pin" and n and self.chance(0.5):
                joint = {"particle": n, "other": n - 1}
                if kind == "string" and self.chance(0.3):
                    joint["over"] = self.near(row["at"], 0.2)
            far = joint.get("from") or joint.get("over") or streams[n - 1]["at"]
            if kind == "string" and self.chance(0.6):
                # Slack by up to half at first.
                ends = [row["at"], streams[n - 1]["at"]] if "over" in joint else [row["at"]]
                length = sum(np.hypot(*(np.array(far) - end)) for end in ends)
                joint["length"] = float(length) * self.number(1.0, 1.5)
            if kind == "spring":
                joint |= {"stiffness": self.decades(0.5, 500),
                          "damper": self.one_of(0.0, self.decades(1e-3, 1))}  # fmt: skip
            self.tables.setdefault(kind, []).append(joint)

    def _pairs(self):
        names = [kind["name"] for kind in self.kinds]
        others = names if self.chance(0.5) else [row["name"] for row in self.rows]
        if self.chance(0.25):
            self.tables["pair"] = [
                {"between": [self.one_of(*names), self.one_of(*others)],
                 self.one_of("cohesion", "bond_number"): self.decades(0.1, 10)}
            ]  # fmt: skip
