"""Scenes of all parts, each broken in one place: which key is at fault, and what is said of it."""

import copy
import re

MACHINE = {
    "title": "All parts",
    "gravity": 9.81,
    "particle": [{"name": "small", "radius": 0.01, "shape": "sphere", "material": "ore",
     "spin": True, "rolling_friction": 0.1}, {"name": "big", "radius": [0.01, 0.02],
     "density": 2500.0}],
    "material": [{"name": "ore", "density": 3000.0, "restitution": 0.3, "friction": 0.5,
     "friction_steel": 0.4}],
    "pair": [{"between": ["small", "hood"], "restitution": 0.2}, {"between": ["small", "big"],
     "friction": 0.1}],
    "incoming": {"speed": 2.0, "pulley_radius": 0.2, "incline_deg": 10.0, "friction": 0.4},
    "plate": [{"distance": 0.5, "angle_deg": 20.0}, {"name": "flap", "pivot": [1.5, -1.0]}],
    "outgoing": {"drop": 1.2, "drop_from": "top", "speed": 1.0},
    "conveyor": [{"name": "carrier", "from": [2.0, -2.0], "to": [3.0, -1.8], "speed": 1.0}],
    "surface": [{"name": "hood", "from": [3.0, 0.5], "to": [3.5, 0.2], "friction": 0.2},
     {"name": "spoon", "center": [3.0, -0.5], "radius": 0.3, "from_deg": 180.0, "to_deg": 270.0},
     {"name": "gate", "points": [[4.0, 0.0], [4.5, 0.0], [4.6, 0.1]], "opens_at": 0.5,
     "closes_at": 1.0}, {"name": "pegs", "center": [4.0, -1.0], "radius": 0.01, "repeat": [[3, 0.1,
     0.0], [2, 0.05, 0.1]]}],
    "stream": [{"name": "left", "particle": "small", "count": 3, "rate": "12 t/h",
     "bed_height": 0.05}, {"particle": "big", "count": 3, "at": [0.5, 1.0], "to": [0.9, 1.0],
     "velocity": [0.0, 0.0], "rate": 20.0}, {"particle": "big", "count": 4, "fill": [[1.0, 1.0],
     [1.3, 1.3]], "start": 0.1}],
    "run": {"until": 1.0},
}  # fmt: skip
"""Everything that disks can have."""

DOMINOES = {
    "particle": [{"name": "ball", "radius": 0.02}, {"name": "brick", "shape": "box", "size": [0.02,
     0.06], "spin": True}, {"name": "wedge", "shape": "polygon", "points": [[0.0, 0.0], [0.05, 0.0],
     [0.0, 0.04]]}],
    "surface": [{"name": "table", "from": [-1.0, 0.0], "to": [1.0, 0.0]}],
    "string": [{"from": [0.0, 0.5], "particle": 0}],
    "rod": [{"particle": 1, "other": 0}],
    "spring": [{"from": [0.0, 0.5], "particle": 1, "length": 0.2, "stiffness": 50.0,
     "damper": 0.1}],
    "pin": [{"from": [0.2, 0.04], "particle": 2}],
    "stream": [{"particle": "ball", "count": 2, "at": [0.0, 0.2], "to": [0.1, 0.2],
     "velocity": [0.0, 0.0], "interact": True}, {"particle": "brick", "count": 2,
     "at": [0.2, 0.032], "to": [0.4, 0.032], "velocity": [0.0, 0.0]}, {"particle": "wedge",
     "at": [0.6, 0.1], "velocity": [0.0, 0.0]}],
}  # fmt: skip
"""Boxes with joints, which pymunk alone has."""

ALONE = {
    "particle": {"radius": 0.01, "mass": 0.05},
    "plate": {"name": "flap", "pivot": [0.5, 0.5]},
    "surface": [{"name": "drum", "center": [0.0, 0.0], "radius": 0.5, "to_deg": 300.0}],
    "stream": {"count": 2, "at": [0.0, 0.2], "velocity": [0.0, 0.0]},
}
"""One table of each, not a list of them."""

BASES = {"machine": MACHINE, "dominoes": DOMINOES, "alone": ALONE}

GONE = object()
"""Instead of a value: the key is taken out."""

# Base, what is changed, the key at fault, and a word of what is allowed.
BY_HAND = [
    # keys and names that lead nowhere
    ("machine", {"particle[0].densty": 3.0}, "particle[0].densty", "particle[0].density?"),
    ("machine", {"particle[1].radios": 3.0}, "particle[1].radios", "particle[1].radius?"),
    ("machine", {"stream[1].too": [1.0, 1.0]}, "stream[1].too", "stream[1].to?"),
    ("machine", {"stream[2].fil": [1.0, 1.0]}, "stream[2].fil", "stream[2].fill?"),
    ("machine", {"surface[1].centre": [1.0, 1.0]}, "surface[1].centre", "surface[1].center?"),
    ("machine", {"surface[1].from_degrees": 3}, "surface[1].from_degrees", "surface[1].from_deg?"),
    ("machine", {"conveyor[0].length": 1.0}, "conveyor[0].length", "belongs in"),
    ("machine", {"stream[0].center": [0.0, 0.0]}, "stream[0].center", "belongs in [[surface]]"),
    ("machine", {"stream[1].particle": "x"}, "stream[1].particle", "there are small, big"),
    ("machine", {"particle[1].material": "cheese"}, "particle[1].material", "chutelab materials"),
    ("machine", {"pair[0].between": ["hood", "gate"]}, "pair[0].between", "small, big"),
    ("machine", {"pair[1].between": ["big", "left"]}, "pair[1].between[1]",
     "no such kind or surface"),
    # names that are there twice, or must not be
    ("machine", {"surface[0].name": "carrier"}, "surface[0].name", "conveyor[0].name is the same"),
    ("machine", {"surface[0].name": "flap"}, "surface[0].name", "plate[1].name is the same"),
    ("machine", {"conveyor[0].name": "flap"}, "conveyor[0].name", "plate[1].name is the same"),
    ("machine", {"surface[3].name": "hood"}, "surface[3].name", "surface[0].name is the same"),
    ("machine", {"conveyor[0].name": "incoming"}, "conveyor[0].name", "reserved"),
    ("machine", {"plate[1].name": "plate"}, "plate[1].name", "reserved"),
    ("machine", {"particle[0].name": "a  b"}, "particle[0].name", "1 to 40 characters"),
    ("machine", {"stream[0].name": "a.b"}, "stream[0].name", "1 to 40 characters"),
    ("machine", {"particle[1].name": GONE, "stream[1].particle": "small",
     "stream[2].particle": "small", "pair[1].between": ["small", "gate"]}, "particle[1].name",
     "needed where there are several kinds"),
    ("machine", {"conveyor[0].name": GONE}, "conveyor[0].name", "is missing"),
    ("machine", {"material[0].name": GONE}, "material[0].name", "is missing"),
    ("machine", {"plate[1].name": GONE}, "plate[1].name", "a plate with a pivot needs one"),
    # kinds of particles
    ("machine", {"gravity_deg": 10.0}, "gravity_deg", "0 with [incoming]"),
    ("alone", {"gravity_deg": 720.5}, "gravity_deg", "720"),
    ("alone", {"stream.omega": 3.0}, "stream.omega", "particle.spin true"),
    ("dominoes", {"stream[2].omega": 3.0}, "stream[2].omega", "particle[2].spin true"),
    ("alone", {"stream.angle_deg": 30.0}, "stream.angle_deg", 'particle.shape is "disk"'),
    ("dominoes", {"stream[2].angle_deg": "30"}, "stream[2].angle_deg", "number"),
    ("alone", {"particle.spin": True, "stream.omega": "3"}, "stream.omega", "number"),
    ("machine", {"particle[1].mass": 0.1}, "particle[1].density", "particle[1].mass or this"),
    ("alone", {"particle.density": 1000.0}, "particle.density", "particle.mass or this"),
    ("machine", {"particle[0].radius": -0.01}, "particle[0].radius", "from 1e-09"),
    ("machine", {"particle[1].radius": [0.02, 0.01]}, "particle[1].radius", "from < to"),
    ("machine", {"particle[1].radius": [0.01, 0.01]}, "particle[1].radius", "from < to"),
    ("machine", {"particle[1].radius": [0.0, 0.01]}, "particle[1].radius", "from < to"),
    ("machine", {"particle[1].radius": [0.01]}, "particle[1].radius", "[from, to]"),
    ("machine", {"particle[1].radius": [0.01, 0.02, 0.03]}, "particle[1].radius", "[from, to]"),
    ("machine", {"particle[0].spin": False}, "particle[0].rolling_friction", "spin = true"),
    ("machine", {"particle[0].spin": GONE}, "particle[0].rolling_friction", "spin = true"),
    ("machine", {"particle[0].shape": "ball"}, "particle[0].shape", '"disk", "sphere", "box"'),
    ("machine", {"particle[0].radius": 0.0}, "particle[0].spin", "cannot turn"),
    ("machine", {"particle[1].radius": 0.0}, "particle[1].density", "give a mass"),
    ("machine", {"particle[1].radius": 0.0, "particle[1].density": GONE}, "particle[1].radius",
     "no engine has points beside disks"),
    ("machine", {"particle[1].size": [0.1, 0.1]}, "particle[1].size", 'shape = "box"'),
    ("machine", {"particle[1].points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]}, "particle[1].points",
     'shape = "polygon"'),
    ("dominoes", {"particle[1].size": GONE}, "particle[1].size", "[width, height]"),
    ("dominoes", {"particle[2].points": GONE}, "particle[2].points", "its corners"),
    ("dominoes", {"particle[1].radius": 0.1}, "particle[1].radius", "is for what is round"),
    ("dominoes", {"particle[2].density": 1e3}, "particle[2].density", "is for what is round"),
    ("dominoes", {"particle[1].size": [0.1]}, "particle[1].size", "[width, height]"),
    ("dominoes", {"particle[1].size": [0.1, -0.1]}, "particle[1].size[1]", "a number from 1e-09"),
    ("dominoes", {"particle[2].points": [[0.0, 0.0], [1.0, 0.0]]}, "particle[2].points",
     "3 to 32 points"),
    ("dominoes", {"particle[2].points": [[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]]},
     "particle[2].points", "convex polygon"),
    ("dominoes", {"particle[2].points": [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]},
     "particle[2].points", "convex polygon"),
    ("dominoes", {"particle[2].points": [[float(n), float(n * n)] for n in range(33)]},
     "particle[2].points", "3 to 32 points"),
    # materials and pairs
    ("machine", {"material[0].density": GONE}, "material[0].density", "is missing"),
    # what hangs on a hinge, and what does not meet
    ("machine", {"plate[1].spring": 1.0}, "plate[1].spring", "is for what hangs on a hinge"),
    ("machine", {"plate[1].hinge": "pivot"}, "plate[1].mass", "kg, or inertia, kg m2"),
    ("machine", {"plate[1].hinge": "middle", "plate[1].mass": 1.0}, "plate[1].hinge", "pivot"),
    ("machine", {"plate[1].hinge": [1.0], "plate[1].mass": 1.0}, "plate[1].hinge", "[x, y]"),
    ("machine", {"surface[0].hinge": "pivot", "surface[0].mass": 0.0}, "surface[0].mass", "1e-"),
    ("machine", {"surface[0].hinge": "pivot", "surface[0].mass": 1.0, "surface[0].turn": 5.0},
     "surface[0].hinge", "turn, shake and travel"),
    *(
        ("alone", {"surface[0].hinge": "pivot", "surface[0].mass": 1.0, f"surface[0].{key}": value},
         f"surface[0].{at}", said)
        for key, value, at, said in (
            ("spring", -1.0, "spring", "from 0"),
            ("stops_deg", [5, 20], "stops_deg", "the 0 where it begins"),
            ("stops_deg", [-5], "stops_deg", "two numbers"),
            ("inertia", 1e-12, "inertia", "from 1e-"),
            ("motor", {"torque": 1.0}, "motor.speed_deg", "is missing"),
            ("motor", {"speed_deg": 1.0, "torque": 0.0}, "motor.torque", "> 0"),
            ("motor", {"speed_deg": 1.0, "torque": 1.0, "power": 2}, "motor.power", "unknown"),
        )
    ),
    # what moves
    *(
        ("alone", {f"surface[0].{key}": value}, f"surface[0].{at}", said)
        for key, value, at, said in (
            ("shake", {"by": [0.0, 0.1]}, "shake.frequency", "is missing"),
            ("shake", {"by": [0.0, 0.1], "frequency": 0.0}, "shake.frequency", "from 1e-06"),
            ("travel", {"to": [0.0, 0.0], "at": -1.0, "in": 1.0}, "travel.at", "from 0"),
            ("travel", {"to": [0.0, 0.0], "in": 0.0}, "travel.in", "from 1e-09"),
            ("travel", {"to": [0.0, 0.0], "in": 1.0, "for": 2}, "travel.for", "unknown"),
            ("turn", 1e6, "turn", "to 36000"),
            ("pivot", [0.0, 0.0], "pivot", "is for what moves: give turn, travel or hinge"),
        )
    ),
    # what waits for a touch
    ("alone", {"surface[0].opens_when": {"touched": "bell"}, "stream.interact": True},
     "surface[0].opens_when.touched", "flap, drum"),
    ("alone", {"surface[0].opens_when": {"touched": "drun"}, "stream.interact": True},
     "surface[0].opens_when.touched", "did you mean drum?"),
    ("alone", {"surface[0].closes_when": {}, "stream.interact": True},
     "surface[0].closes_when.touched", "is missing"),
    ("alone", {"surface[0].closes_when": "flap", "stream.interact": True},
     "surface[0].closes_when", "a table"),
    ("alone", {"surface[0].closes_when": {"touched": "flap", "by": "x"}, "stream.interact": True},
     "surface[0].closes_when.by", "unknown key"),
    ("alone", {"surface[0].opens_when": {"touched": "flap"}}, "stream.interact", "have to meet"),
    ("alone", {"surface[0].opens_when": {"touched": "flap"}, "surface[0].opens_at": 1.0,
     "stream.interact": True}, "surface[0].opens_at", "surface[0].opens_when"),
    ("alone", {"surface[0].closes_when": {"touched": "flap"}, "surface[0].closes_at": 1.0,
     "stream.interact": True}, "surface[0].closes_at", "surface[0].closes_when"),
    ("alone", {"surface[0].closes_when": {"touched": "flap"}, "surface[0].opens_when": {"touched":
     "flap"}, "stream.interact": True}, "surface[0].closes_when", "surface[0].opens_when"),
    ("alone", {"surface[0].starts_when": {"touched": "flap"}, "stream.interact": True},
     "surface[0].starts_when", "turn, shake, travel or a motor"),
    ("alone", {"plate.starts_when": {"touched": "drum"}, "stream.interact": True},
     "plate.starts_when", "turn, shake, travel or a motor"),
    # what is solid from one side
    ("machine", {"surface[0].passes": "sideways"}, "surface[0].passes", '"up", "down", "left"'),
    ("machine", {"surface[0].passes": "in"}, "surface[0].passes", "of what is straight"),
    ("machine", {"surface[1].passes": "up"}, "surface[1].passes", '"in" or "out" of an arc'),
    ("machine", {"surface[2].passes": "right"}, "surface[2].passes", "must have y beyond that of"),
    ("machine", {"surface[0].to": [3.0, 0.2], "surface[0].passes": "down"}, "surface[0].passes",
     "must have x beyond that of"),
    ("machine", {"surface[2].points": [[4.0, 0.0], [4.5, 0.0], [4.4, 0.1]], "surface[2].passes":
     "up"}, "surface[2].passes", "another way"),
    ("machine", {"plate[1].passes": "up"}, "plate[1].passes", "unknown key"),
    ("alone", {"surface[0].passes": "in", "run.engine": "exact"}, "run.engine",
     "surface[0].passes needs contact or pymunk"),
    ("machine", {"pair[1].meet": False}, "pair[1].friction", "is of what meets"),
    ("machine", {"pair[0].bond_number": 3.0, "gravity": 0.0}, "pair[0].bond_number",
     "counts weights"),
    ("machine", {"pair[0].bond_number": 3.0, "pair[0].cohesion": 0.1}, "pair[0].bond_number",
     "give either"),
    ("machine", {"pair[0].meet": False, "pair[0].restitution": GONE}, "pair[0].meet",
     "two kinds of particles"),
    ("machine", {"pair[0].between": ["small"]}, "pair[0].between", "two names"),
    ("machine", {"pair[0].between": ["small", "big", "gate"]}, "pair[0].between", "two names"),
    ("machine", {"pair[0].between": GONE}, "pair[0].between", "is missing"),
    # belts and plates
    ("machine", {"conveyor[0].to": [2.0, -2.0]}, "conveyor[0].to", "differ from conveyor[0].from"),
    ("machine", {"conveyor[0].to": GONE}, "conveyor[0].to", "is missing"),
    ("machine", {"conveyor[0].friction": "adhesion"}, "conveyor[0].friction", "a number"),
    ("machine", {"plate[1].pivot": GONE}, "plate[1].distance", "name and pivot = [x, y]"),
    ("alone", {"plate.pivot": GONE}, "plate.distance", "name and pivot = [x, y]"),
    ("machine", {"plate[1].distance": 0.6, "plate[1].pivot": GONE, "plate[1].name": GONE},
     "plate[1].distance", "there is a damping plate already"),
    ("machine", {"plate[1].distance": 0.6}, "plate[1].pivot", "either plate[1].distance"),
    ("machine", {"plate[0].name": "bang"}, "plate[0].name", "is for a further plate"),
    ("machine", {"plate[1].pivot_height": 0.5}, "plate[1].pivot_height", "damping plate's"),
    ("machine", {"plate[1].above": 0.0, "plate[1].below": 0.0}, "plate[1].above", "length"),
    ("alone", {"plate.distance": 0.3, "plate.pivot": GONE, "plate.name": GONE}, "incoming",
     "[plate] needs the table [incoming]"),
    ("machine", {"incoming": GONE}, "incoming", "need the table [incoming]"),
    # surfaces
    ("machine", {"surface[1].to_deg": 180.0}, "surface[1].to_deg", "surface[1].from_deg"),
    ("machine", {"surface[1].to_deg": 541.0}, "surface[1].to_deg", "at most 360"),
    ("machine", {"surface[1].from": [0.0, 0.0]}, "surface[1].from", "surface[1].center"),
    ("machine", {"surface[1].points": [[0.0, 0.0], [1.0, 1.0]]}, "surface[1].points",
     "surface[1].center"),
    ("machine", {"surface[2].opens_at": 1.0}, "surface[2].opens_at", "surface[2].closes_at"),
    ("machine", {"surface[2].points": [[0.0, 0.0]]}, "surface[2].points", "2 to 10000 points"),
    ("machine", {"surface[2].points": [[0.0, 0.0], [0.0, 0.0]]}, "surface[2].points", "differ"),
    ("machine", {"surface[0].material": "wood"}, "surface[0].material", '"steel" or "rubber"'),
    ("machine", {"surface[3].repeat": [3, 0.1, 0.0]}, "surface[3].repeat[0]", "[n, dx, dy]"),
    ("machine", {"surface[3].repeat": [[2.5, 0.1, 0.0]]}, "surface[3].repeat[0][0]",
     "whole number"),
    ("machine", {"surface[3].repeat": [[2, 0.1]]}, "surface[3].repeat[0]", "[n, dx, dy]"),
    ("machine", {"surface[3].repeat": [[2, 0.1, 0.0]] * 3}, "surface[3].repeat", "one or two"),
    # streams
    ("machine", {"stream[0].rate": "120 kg"}, "stream[0].rate", '"120 t/h"'),
    ("machine", {"stream[0].rate": "0 t/h"}, "stream[0].rate", '"120 t/h"'),
    ("machine", {"stream[2].fill": [[1.0, 1.0], [1.01, 1.01]]}, "stream[2].fill", "a larger box"),
    ("machine", {"stream[2].count": 500}, "stream[2].fill", "stream[2].count = "),
    ("machine", {"stream[2].fill": [[1.3, 1.3], [1.0, 1.0]]}, "stream[2].fill",
     "[[left, bottom], [right, top]]"),
    ("machine", {"stream[2].fill": [1.0, 1.0, 1.3, 1.3]}, "stream[2].fill", "[[left, bottom]"),
    ("machine", {"stream[2].fill": [[1.0, 1.0]]}, "stream[2].fill", "[[left, bottom]"),
    ("machine", {"stream[2].fill": [[1.0, 1.0], [1.3]]}, "stream[2].fill[1]", "a point [x, y]"),
    ("machine", {"stream[2].rate": 10.0}, "stream[2].rate", "releases all at once"),
    ("machine", {"stream[2].at": [1.0, 1.0]}, "stream[2].at", "stream[2].fill"),
    ("machine", {"stream[2].to": [1.0, 1.0]}, "stream[2].to", "stream[2].fill"),
    ("machine", {"stream[2].bed_height": 0.1}, "stream[2].bed_height", "releases all at once"),
    ("machine", {"stream[1].bed_height": 0.1}, "stream[1].bed_height", "stream[1].to makes a line"),
    ("machine", {"stream[1].count": 2.5}, "stream[1].count", "a whole number"),
    ("machine", {"stream[0].count": 9_999_999}, "stream[0].count", "10000000 particles in all"),
    ("machine", {"stream": []}, "stream", "tables"),
    ("machine", {"particle": []}, "particle", "tables"),
    ("alone", {"stream.velocity": GONE}, "stream.velocity", "required without [incoming]"),
    ("alone", {"stream.at": GONE}, "stream.at", "required without [incoming]"),
    # a release in something
    ("alone", {"stream.at": [0.0, 0.5]}, "stream.at", "at least 0.01 m from drum"),
    ("machine", {"stream[1].at": [2.0, -1.9]}, "stream[1].at", "carrier"),
    # engines that cannot
    ("machine", {"stream[1].interact": True, "run.engine": "exact"}, "run.engine",
     "stream[1].interact"),
    ("dominoes", {"run.engine": "exact", "string": GONE, "rod": GONE, "spring": GONE, "pin": GONE},
     "run.engine", "needs contact or pymunk"),
    ("alone", {"string": [{"from": [0.0, 0.5]}], "run.engine": "exact"}, "run.engine",
     "string[0] needs contact or pymunk"),
    *(
        ("alone", {table: [{"from": [0.0, 0.5]} | row]}, f"{table}[0].{key}", said)
        for table in ("string", "rod", "spring", "pin")
        for row, key, said in (
            ({"particle": 7}, "particle", "there are"),
            ({"particle": True}, "particle", "whole number"),
            ({"from": [0.0]}, "from", "[x, y]"),
            ({"other": 7}, "other", "there are"),
            ({"other": 0}, "other", "another than"),
            ({"length": 0.0} if table in ("string", "spring") else {"length": 1.0}, "length",
             "from 1e-09" if table in ("string", "spring") else "unknown"),
        )
        if not (key == "other" and table != "pin")
    ),
    *(
        ("alone", {table: [row | ({"stiffness": 9.0} if table == "spring" and key != "stiffness"
         else {})]}, f"{table}[0].{key}", said)
        for table in ("string", "rod", "spring")
        for row, key, said in (
            ({"particle": 0}, "from", "is missing"),
            ({"from": [0.0, 0.5], "other": 0}, "other", "another than"),
            ({"from": [0.0, 0.5], "stiffness": -1.0}, "stiffness",
             "> 0" if table == "spring" else "unknown"),
        )
    ),
    *(("dominoes", {f"{table}": [{"particle": 1, "from": [0.1, 0.2]}]}, f"{table}[0].from",
       "another place") for table in ("string", "rod")),
    ("alone", {"rod": [{"particle": 0, "other": 1}], "stream.interact": True, "stream.rate": 1.0},
     "rod[0].other", "another place"),
    ("alone", {"spring": [{"from": [0.0, 0.5]}]}, "spring[0].stiffness", "missing"),
    ("alone", {"spring": [{"from": [0.0, 0.5], "stiffness": 9.0, "damper": -1.0}]},
     "spring[0].damper", "from 0"),
    ("alone", {"particle.radius": 0.0, "run.engine": "contact"}, "run.engine", "needs disks"),
    ("dominoes", {"string[0].over": [0.0, 0.9]}, "string[0].over", "between two particles"),
    ("dominoes", {"string": [{"over": [0.0, 0.9]}]}, "string[0].from", "is missing"),
    ("dominoes", {"string": [{"other": 1, "over": 0.9}]}, "string[0].over", "[x, y]"),
    ("dominoes", {"string": [{"other": 1, "over": [0.0, 0.9]}], "run.engine": "pymunk"},
     "run.engine", "string[0].over needs contact"),
    ("dominoes", {"rod": [{"other": 1, "over": [0.0, 0.9]}]}, "rod[0].over", "unknown"),
    ("dominoes", {"string[0].particle": 5}, "string[0].particle", "there are 5 particles"),
    ("dominoes", {"string[0].particle": -1}, "string[0].particle", ">= 0"),
    ("dominoes", {"string[0].from": GONE}, "string[0].from", "is missing"),
    ("alone", {"run.until": "landed"}, "run.until", "[outgoing]"),
    # what is expected
    ("machine", {"expect": [{"quantity": "carriage.impact.count", "value": 1.0, "tolerance": "1",
     "source": "me"}]}, "expect[0].quantity", "no such quantity"),
]  # fmt: skip


def leaves(value, path=""):
    """Return the paths of all values of a scene."""
    match value:
        case dict():
            return [leaf for key, one in value.items() for leaf in leaves(one, f"{path}.{key}")]
        case list():
            return [leaf for n, one in enumerate(value) for leaf in leaves(one, f"{path}[{n}]")]
    return [path.removeprefix(".")]


def at(tables, path):
    for step in steps(path):
        tables = tables[step]
    return tables


def steps(path):
    return [int(n) if n else key for n, key in re.findall(r"\[(\d+)\]|([^.\[\]]+)", path)]


def broken(name, changes):
    """Return a base with some values changed, by their paths, [+] for one more of a list."""
    tables = copy.deepcopy(BASES[name])
    for path, value in changes.items():
        if path.endswith("[+]"):
            at(tables, path[:-3]).append(value)
            continue
        *above, last = steps(path)
        table = tables
        for step in above:
            table = table.setdefault(step, {}) if isinstance(table, dict) else table[step]
        if value is GONE:
            del table[last]
        else:
            table[last] = value
    return tables
