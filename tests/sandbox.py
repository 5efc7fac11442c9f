"""Machines and mixtures drawn at random: of round particles, and of all that tips and swings.

`tables` draws all that a scene file can say of round particles, `bodies` boxes, polygons and disks
among what hangs, moves, opens and lets through, with joints, in air.
"""

import numpy as np

from chutelab.machine import build
from chutelab.scene import SceneError, from_dict

MATERIALS = ("steel", "gravel", "coal", "glass", "rubber", "wheat", "mine")


def draw(seed):
    """Return the scene of a seed; in every other one particles meet."""
    return from_dict(tables(seed), f"sandbox-{seed}")


def tables(seed):
    """Return a scene that can be built, as its file has it; the same seed gives the same scene.

    Up to three streams of up to three kinds, into a box, a drum or onto a floor, with whatever
    stands in the way. Radii are 4 to 30 mm, lengths 0.05 to 2.4 m and speeds up to 3 m/s; up to 10
    particles that do not meet, 10 to 60 that do; 1 to 1.6 s are run.
    """
    rng = np.random.default_rng(seed)
    while True:
        drawn = Drawing(rng, meet=seed % 2 == 1).tables
        try:
            build(from_dict(drawn))
        except SceneError:
            # A release inside a surface, a box too small, or a plate that is missed.
            continue
        return drawn


def bodies(seed, *, few=False, both=False):
    """Return a scene of boxes, polygons and disks that can be built; `few` is one or two of them.

    Things hang on hinges, or particles are tied by joints, or `both`.

    Sizes are 14 to 130 mm, speeds up to 1 m/s; they fall by up to 1.2 m among up to four things
    that stand, hang or move, or share points.
    """
    rng = np.random.default_rng(seed)
    while True:
        drawn = Bodies(rng, few=few, both=both).tables
        try:
            build(from_dict(drawn))
        except SceneError:
            # Two released in one place, or one in a surface.
            continue
        return drawn


class Dice:
    """Values drawn at random."""

    def __init__(self, rng):
        self.rng = rng

    def number(self, low, high):
        return float(self.rng.uniform(low, high))

    def whole(self, low, high):
        return int(self.rng.integers(low, high + 1))

    def chance(self, share):
        return bool(self.rng.random() < share)

    def one_of(self, *values):
        return values[int(self.rng.integers(len(values)))]


class Drawing(Dice):
    """One attempt at a scene."""

    def __init__(self, rng, *, meet):
        super().__init__(rng)
        self.meet = meet
        self.end = self.number(1.0, 1.6)
        self.transfer = self.chance(0.4)
        self.adheres = self.transfer and self.chance(0.5)
        self.tables = {
            # Without any, what lies on a belt grazes the pulley or not as rounding says.
            "gravity": self.one_of(
                *[9.81] * 5, 0.05 if self.transfer else 0.0, 0.05, self.number(1.0, 20.0)
            ),
            "run": {"until": self.end},
        }
        self._kinds()
        self._belts()
        self._surfaces()
        self._streams()
        self._pairs()
        if self.transfer and self.chance(0.3):
            ending = "landed" if "outgoing" in self.tables else "settled"
            self.tables["run"] = {"until": ending, "max_time": self.end}

    def vector(self, reach):
        return self.rng.uniform(-reach, reach, 2).tolist()

    def place(self, reach=0.7):
        """Draw a place; beyond the pulley where nothing that rides can give way to what it meets.

        Adhesion moves riders as if they had no end of mass: between one of them and a wall on the
        belt nothing has room.
        """
        x, y = self.vector(reach)
        return [x + (1.5 if self.adheres and self.meet else 0.0), y]

    def some(self, **drawn):
        """Leave out half of the values, so that defaults are drawn as well."""
        return {key: value for key, value in drawn.items() if self.chance(0.5)}

    def values(self):
        return self.some(
            restitution=self.one_of(0.0, self.number(0.0, 0.9), self.number(0.2, 0.7)),
            friction=self.one_of(0.0, self.number(0.0, 1.0), self.number(0.0, 1.0)),
        )

    def _kinds(self):
        count = self.whole(1, 3)
        self.kinds = [f"kind-{n}" for n in range(count)]
        rows = []
        for name in self.kinds:
            size = float(10.0 ** self.number(-2.4, -1.6 if self.meet else -1.5))
            ranged = self.chance(0.3)
            row = {
                "radius": [size, size * self.number(1.05, 1.8)] if ranged else size,
                **self.some(shape=self.one_of("disk", "sphere"), spin=self.chance(0.7)),
            }
            if count > 1 or self.chance(0.5):
                row["name"] = name
            row |= self.one_of(
                {},
                {"mass": self.number(0.005, 0.5)},
                {"density": self.number(500.0, 8000.0)},
                {"material": self.one_of(*MATERIALS)},
                {"material": self.one_of(*MATERIALS), "mass": self.number(0.005, 0.5)},
            )
            if row.get("spin") and self.chance(0.4):
                row["rolling_friction"] = self.number(0.01, 0.4)
            rows.append(row)
        self.tables["particle"] = rows if count > 1 or self.chance(0.2) else rows[0]
        if any(row.get("material") == "mine" for row in rows):
            own = {"name": "mine", "density": 1234.0, "restitution": 0.35, "friction": 0.25}
            faces = self.some(restitution_steel=0.3, friction_steel=0.2, friction_rubber=0.7)
            self.tables["material"] = [own | faces]
        self.named = [row["name"] for row in rows if "name" in row]

    def _belts(self):
        if not self.transfer:
            return
        speed, wheel = self.number(0.3, 3.0), self.number(0.05, 0.3)
        belt = {"speed": speed, "pulley_radius": wheel}
        belt |= self.some(length=self.number(0.3, 0.8), restitution=self.number(0.0, 0.6))
        belt |= {"incline_deg": self.number(-25.0, 35.0)} if self.chance(0.6) else {}
        if not self.adheres:
            belt["friction"] = self.number(0.0, 1.0)
        self.tables["incoming"] = belt
        if self.chance(0.5):
            self.tables["outgoing"] = {
                "drop": 2.0 * wheel + self.number(0.3, 0.8),
                "drop_from": "top",
                **self.some(speed=self.number(-2.0, 3.0), start=-1.0, length=3.0),
                **self.values(),
            }
        plates = []
        if self.chance(0.5):
            plates.append({
                "distance": self.number(0.2, 0.8),
                **self.some(angle_deg=self.number(-40.0, 40.0), above=self.number(0.1, 0.4)),
                **self.values(),
            })  # fmt: skip
        if self.chance(0.3):
            plates.append(self._hanging())
        if plates:
            self.tables["plate"] = plates if len(plates) > 1 else plates[0]

    def _hanging(self):
        x, y = self.place()
        return {
            "name": "flap", "pivot": [x, y], "above": self.number(0.0, 0.2),
            **self.some(angle_deg=self.number(-60.0, 60.0), below=self.number(0.1, 0.4)),
            **self.values(),
        }  # fmt: skip

    def _surfaces(self):
        rows = [] if self.transfer else [self._container()]
        for n in range(self.whole(0, 4)):
            row = {"name": f"s{n}", **self._course(), **self.values()}
            row |= self.some(speed=self.one_of(0.0, self.number(-1.5, 1.5)))
            row |= self.some(material=self.one_of("steel", "rubber"))
            if self.chance(0.3):
                row |= self.some(opens_at=self.number(0.1, 0.9), closes_at=self.number(0.1, 0.9))
            rows.append(row)
        if self.chance(0.3):
            dx, dy = self.number(0.15, 0.3), self.number(0.15, 0.3)
            rows.append({
                "name": "pegs", "center": [-2.0 * dx, -0.5], "radius": self.number(0.01, 0.04),
                "repeat": [[self.whole(2, 5), dx, 0.0], [self.whole(1, 3), 0.5 * dx, dy]],
                **self.values(),
            })  # fmt: skip
        if rows:
            self.tables["surface"] = rows
        if not self.transfer and self.chance(0.2):
            self.tables["plate"] = self._hanging()
        if self.chance(0.3):
            start = np.array(self.place())
            way = np.array([self.number(0.3, 0.8) * self.one_of(-1.0, 1.0), self.number(-0.3, 0.3)])
            self.tables["conveyor"] = [{
                "name": "carrier", "from": start.tolist(), "to": (start + way).tolist(),
                "speed": self.number(-2.0, 2.0), **self.some(pulley_radius=self.number(0.04, 0.12)),
                **self.values(),
            }]  # fmt: skip

    def _container(self):
        kind = self.whole(0, 2)
        if kind == 0:
            corners = [[-1.2, 1.2], [-1.2, -1.2], [1.2, -1.2], [1.2, 1.2]]
            return {"name": "box", "points": corners, **self.values()}
        if kind == 1:
            turning = self.some(speed=self.number(-1.0, 1.0))
            return {"name": "drum", "center": [0.0, 0.0], "radius": 1.2, **turning, **self.values()}
        return {"name": "floor", "from": [-3.0, -1.0], "to": [3.0, -1.0], **self.values()}

    def _course(self):
        start = np.array(self.place())
        if self.chance(0.4):
            begin, extent = self.number(-180.0, 180.0), self.one_of(-1.0, 1.0)
            whole = self.chance(0.2)
            return {
                "center": start.tolist(), "radius": self.number(0.08, 0.5),
                **({} if whole else {
                    "from_deg": begin, "to_deg": begin + extent * self.number(30.0, 300.0),
                }),
            }  # fmt: skip
        points = [start]
        for _ in range(self.one_of(1, 1, 2, 3)):
            angle = self.number(-np.pi, np.pi)
            onward = self.number(0.15, 0.6) * np.array([np.cos(angle), np.sin(angle)])
            points.append(points[-1] + onward)
        ends = [point.tolist() for point in points]
        return {"from": ends[0], "to": ends[1]} if len(ends) == 2 else {"points": ends}

    def _streams(self):
        count = self.whole(1, 3)
        most = 60 if self.meet else 10
        counts = self.rng.multinomial(self.whole(max(count, most // 6), most) - count,
                                      [1.0 / count] * count) + 1  # fmt: skip
        rows = []
        for n, every in enumerate(counts.tolist()):
            row = {"count": every, **self.some(seed=self.whole(0, 99))}
            row |= {"start": self.number(0.0, 0.3)} if self.chance(0.3) else {}
            row |= {"name": f"stream-{n}"} if self.chance(0.3) else {}
            if self.named and self.chance(0.7):
                row["particle"] = self.one_of(*self.named)
            if self.meet and (n == 0 or self.chance(0.5)):
                row["interact"] = True
            if self.meet:
                row |= self.values()
            way = self.whole(0, 3)
            if self.transfer and n == 0:
                self._on_belt(row)
            elif way == 0:
                self._at_a_point(row)
            elif way == 3:
                side = self.number(0.15, 0.5)
                x, y = self.place(0.5)
                row["fill"] = [[x, y], [x + side, y + self.number(0.15, 0.6)]]
                row |= self.some(velocity=self.vector(1.0))
            else:
                self._along_a_line(row)
            rows.append(row)
        self.tables["stream"] = rows if count > 1 else rows[0]

    def _on_belt(self, row):
        # Layers of an adhesive bed ride into each other round the pulley, of which `check` warns.
        row["rate"] = self._rate()
        if not self.adheres:
            row |= self.some(speed_spread=self.number(0.0, 0.2))
        if not (self.adheres and self.meet):
            row |= self.some(bed_height=self.number(0.0, 0.1))

    def _at_a_point(self, row):
        row |= {"at": self.place(), "velocity": self.vector(2.0), "rate": self._rate()}
        row |= self.some(bed_height=self.number(0.0, 0.2), speed_spread=self.number(0.0, 0.5))

    def _along_a_line(self, row):
        start = self.place()
        row |= {"at": start, "to": [start[0] + self.number(0.2, 0.6), start[1]]}
        row["velocity"] = self.vector(1.5)
        if self.chance(0.5):
            row["rate"] = self._rate()
        elif self.meet:
            # All at once, beside each other: in a row that is long enough for all.
            row["to"] = [start[0] + 0.11 * row["count"], start[1] + self.number(-0.1, 0.1)]

    def _rate(self):
        return self.one_of(self.number(20.0, 200.0), f"{self.number(1.0, 8.0):.3g} t/h")

    def _pairs(self):
        if not self.named or self.chance(0.7):
            return
        surfaces = [
            row["name"] for key in ("surface", "conveyor") for row in self.tables.get(key, [])
        ]
        surfaces += [table for table in ("incoming", "outgoing") if table in self.tables]
        between = [self.one_of(*self.named), self.one_of(*self.named, *surfaces)]
        self.tables["pair"] = [{"between": between, **self.values()}]


class Bodies(Dice):
    """One attempt at a scene of boxes, polygons and disks; with hinges, with joints, or `both`."""

    def __init__(self, rng, *, few, both):
        super().__init__(rng)
        self.few, self.hangs, self.rows = few, self.chance(0.6) or both, []
        self.tables = {"run": {"until": 0.35 if few else self.number(0.6, 1.0)}}
        if self.chance(0.2):
            self.tables |= self.one_of(
                {"air_density": 1.2}, {"gravity": 2.0}, {"gravity_deg": 20.0}
            )
        self._kinds()
        self._furniture()
        self._streams()
        if both or not self.hangs:
            self._joints()

    def values(self):
        return {"restitution": self.one_of(0.0, 0.3, self.number(0.0, 0.9)),
                "friction": self.one_of(0.0, 0.2, 1.0, self.number(0.0, 1.0))}  # fmt: skip

    def near(self, x, y, reach):
        return [x + self.number(-reach, reach), y + self.number(-reach, reach)]

    def _kinds(self):
        self.tables["particle"] = rows = []
        for n in range(self.whole(1, 2 if self.few else 3)):
            size = self.one_of(0.02, 0.05, 0.1) * self.number(0.7, 1.3)
            row = {"name": f"kind-{n}", "mass": self.one_of(0.01, 0.1, 1.0), "spin": True}
            shape = self.one_of("box", "box", "polygon", "polygon", "disk") if n else "polygon"
            count = self.whole(3, 8)
            turns = (np.arange(count) + self.rng.uniform(-0.3, 0.3, count)) * 2.0 * np.pi / count
            points = 0.5 * size * np.array([np.cos(turns), np.sin(turns)]).T
            if shape == "polygon" and self.chance(0.5):
                row |= {"shape": shape, "points": points.tolist()}
            elif shape == "disk":
                row["radius"] = 0.5 * size
            else:
                row |= {"shape": "box", "size": [size, size * self.one_of(1.0, 1.0, 0.5, 0.2)]}
            rows.append(row)

    def _furniture(self):
        self.tables["surface"] = self.rows
        floor = self.one_of([[-1.0, -0.8], [1.0, -0.8]], [[-1.0, -0.5], [0.0, -0.8], [1.0, -0.5]])
        way = [[-1.0, 1.5], *floor, [1.0, 1.5]]
        self.rows.append({"name": "walls", "points": way, **self.values()})
        for n in range(self.whole(1, 2 if self.few else 4)):
            x = self.number(-0.15, 0.15) if self.few else 0.45 * (n - 1.5) + self.number(-0.1, 0.1)
            y = -0.15 * n if self.few else -0.6 + 0.25 * self.whole(0, 2)
            self._thing(f"thing-{n}", x, y)
        shut = [row for row in self.rows if "turn" in row or "shake" in row or "travel" in row]
        for row in shut:
            if self.chance(0.2):
                row["starts_when"] = {"touched": "walls"}

    def _thing(self, name, x, y):
        half = (
            0.5 * self.number(0.1, 0.5) * np.array([np.cos(a := self.number(-0.6, 0.6)), np.sin(a)])
        )
        start, end = [x - half[0], y - half[1]], [x + half[0], y + half[1]]
        course = self.one_of("line", "line", "line", "bowl", "peg", "bow", "vee", "shape")
        if self.few and course in ("bowl", "bow"):
            # Pymunk's arcs are thousands of segments.
            course = "vee"
        row, radius = {"name": name, **self.values()}, self.number(0.06, 0.25)
        if course == "line":
            row |= {"from": start, "to": end}
        elif course in ("bowl", "bow"):
            begin, end = self.number(-30.0, 60.0), self.number(90.0, 210.0)
            up = 180.0 if course == "bowl" else 0.0
            row |= {"center": [x, y], "radius": radius, "from_deg": up + begin, "to_deg": up + end}
        elif course == "peg":
            row |= {"center": [x, y], "radius": 0.5 * radius, "from_deg": 0.0, "to_deg": 360.0}
        elif course == "vee":
            row["points"] = [start, [x, y - self.number(0.02, 0.15)], end]
        else:
            count = self.whole(3, 12)
            turns = np.arange(count + 1) % count * 2.0 * np.pi / count + self.number(0.0, 1.0)
            row["points"] = (
                [x, y] + 0.6 * radius * np.array([np.cos(turns), np.sin(turns)]).T
            ).tolist()
        fate = self.one_of("still", "hangs", "hangs", "moves", "moves", "passes", "opens", "belt")
        if fate == "hangs" and self.hangs:
            row |= self._hinge(x, y, half)
        elif fate == "moves":
            row |= self._motion(x, y, start if course == "line" else None)
        elif fate == "passes" and course in ("line", "vee", "bowl", "bow"):
            row["passes"] = (
                self.one_of("up", "down") if "center" not in row else self.one_of("in", "out")
            )
        elif fate == "opens":
            row[self.one_of("opens_when", "closes_when")] = {"touched": "walls"}
        elif fate == "belt":
            row["speed"] = self.number(-1.0, 1.0)
        self.rows.append(row)
        if (
            course == "bowl"
            and self.chance(0.5)
            and not {"hinge", "turn", "shake", "travel", "passes"} & {*row}
        ):
            # A line that begins where the arc ends.
            turn = np.deg2rad(row["to_deg"])
            tip = np.array([x, y]) + radius * np.array([np.cos(turn), np.sin(turn)])
            on = tip + self.number(0.05, 0.2) * np.array([-np.sin(turn), np.cos(turn)])
            self.rows.append({"name": f"{name}-on", "from": tip.tolist(), "to": on.tolist(),
                              **self.values()})  # fmt: skip

    def _hinge(self, x, y, half):
        off = self.one_of(0.0, 1.0, -1.0, 0.2) * half
        row = {"hinge": [x + off[0], y + off[1]], "mass": self.one_of(0.1, 1.0, 5.0)}
        if self.chance(0.6):
            row["stops_deg"] = [-self.number(0.0, 40.0), self.number(1.0, 40.0)]
        if self.chance(0.4):
            row |= {"spring": self.number(0.2, 5.0), "damper": self.number(0.0, 0.1)}
        if self.chance(0.2):
            row["motor"] = {
                "speed_deg": self.number(-200.0, 200.0),
                "torque": self.number(0.2, 2.0),
            }
        return row

    def _motion(self, x, y, start):
        to = self.near(*start, 0.1) if start else None
        return self.one_of(
            {"turn": self.number(-150.0, 150.0), "pivot": self.near(x, y, 0.05)},
            {"shake": {"by": self.near(0.0, 0.0, 0.005), "frequency": self.number(1.0, 15.0)}},
            {"travel": {"to": to, "at": 0.1, "in": 0.3}} if to else {"speed": 0.7},
        )

    def _streams(self):
        kinds = [row["name"] for row in self.tables["particle"]]
        self.tables["stream"] = rows = []
        count, most = (self.whole(1, 2), 1) if self.few else (self.whole(1, 5), self.whole(1, 6))
        x, step = (-0.75, 1.6 / count) if self.hangs else (-0.3, 0.15)
        if self.few:
            x, step = -0.05, 0.1
        many = self.whole(0, count - 1)
        for n in range(count):
            kind = self.whole(0, len(kinds) - 1)
            y = self.number(0.12, 0.22 if self.few else 0.4)
            row = {"particle": kinds[kind], "at": [x + n * step, y],
                   "velocity": self.near(0.0, 0.0, 1.0), "interact": True,
                   **self.values()}  # fmt: skip
            row |= {"omega": self.number(-20.0, 20.0)} if self.chance(0.4) else {}
            if self.chance(0.6) and "shape" in self.tables["particle"][kind]:
                row["angle_deg"] = self.one_of(45.0, self.number(-180.0, 180.0))
            if n == many and most > 1:
                # Equal ones, above each other.
                up = 0.16 if self.chance(0.5) else 0.13
                row |= {"count": most, "to": [row["at"][0], row["at"][1] + up * (most - 1)]}
            rows.append(row)

    def _joints(self):
        streams = [row for row in self.tables["stream"] for _ in range(row.get("count", 1))]
        count = len(streams)
        for i in range(count):
            if "count" in streams[i] or self.chance(0.4):
                continue
            kind = self.one_of("string", "rod", "spring", "pin")
            x, y = streams[i]["at"]
            row = {"particle": i, "from": [x + self.number(-0.3, 0.3), y + self.number(0.1, 0.4)]}
            other = self.whole(0, count - 1)
            if kind == "pin":
                row["from"] = self.near(x, y, 0.05)
            near = kind != "pin" or abs(streams[other]["at"][0] - x) < 0.2
            if other != i and "count" not in streams[other] and near and self.chance(0.7):
                row["other"] = other
                if kind != "pin":
                    del row["from"]
            if kind == "spring":
                row |= {"stiffness": self.one_of(5.0, 50.0), "damper": self.one_of(0.0, 0.1)}
            self.tables.setdefault(kind, []).append(row)
