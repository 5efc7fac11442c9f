"""Cases that lie on a border: grazing, critical speed, ends, corners, contact from the start."""

from math import atan2, degrees, sqrt

import numpy as np

from chutelab.checks.stress import EPS, ROUNDINGS, Verdict
from chutelab.results import Kind
from stress.case import CROWD, LONE, TRANSFER, Case, merged, surface, thrown
from stress.extremes import place_error

G = 9.81


def _grazing():
    group = "grazing plates"
    out = []
    for name, tilt in (("nearing", 1e-12), ("parting", -1e-12), ("parallel", 0.0)):
        # Over 1 m the plate comes nearer by tilt; the disk starts a little more than r away.
        plate = surface("target", (0.0, 0.0), (1.0, tilt))
        slide = {
            "gravity": 0.0,
            "surface": [plate],
            **thrown((0.0, 0.004 + 0.5e-12), (2.0, 0.0)),
            "run": {"until": 2.0},
        }
        out.append(Case(f"graze-{name}", group, slide))
        # Thrown up 0.5 m: at the top of the parabola it is level with the ceiling.
        ceiling = surface("ceiling", (0.0, 0.504), (2.0, 0.504 + 2.0 * tilt))
        level = {
            "surface": [ceiling],
            **thrown((0.0, 0.0), (1.5, sqrt(2.0 * G * 0.5))),
            "run": {"until": 1.0},
        }
        out.append(Case(f"graze-{name}-apex", group, level))
    for name, off in (("less", 1.0 - 1e-12), ("just", 1.0), ("more", 1.0 + 1e-12)):
        # A point that leaves at the top is parallel to the plate where tan α = v²/(2 g d1).
        alpha = degrees(atan2(2.0**2, 2.0 * G * 0.6))
        plate_ = {"angle_deg": alpha * off, "below": 2.0}
        machine = merged(TRANSFER, {"plate": plate_})
        out.append(Case(f"graze-machine-{name}", group, machine))
    level = merged(TRANSFER, {"plate": {"angle_deg": 80.0}, "outgoing": {"drop_from": "impact"}})
    never = dict.fromkeys(LONE, "outgoing.drop_from")
    out.append(Case("graze-missed", group, level, refusals=never))
    return out


def _critical():
    group = "v²/(g R) within 1e-15 of 1"
    critical = sqrt(G * 0.104)
    out = []
    for ulps in (-4, -1, 0, 1, 4):
        speed = critical * (1.0 + ulps * EPS)

        def separation(e, speed=speed):
            # cos φ1 = v²/(g Rc); what rounds the cosine by δ moves φ1 by up to the root of 2 δ.
            left = e.recording.select(Kind.SEPARATION)
            cosine = min(1.0, speed**2 / (G * 0.104))
            phi = sqrt((1.0 - cosine) * (1.0 + cosine))
            found = atan2(*left["position"][0]) if len(left) else np.nan
            return Verdict(abs(found - phi), sqrt(2.0 * ROUNDINGS * EPS), "rad")

        tables = merged(TRANSFER, {"incoming": {"speed": speed}})
        name = f"critical-{ulps:+d}"
        out.append(Case(name, group, tables, formula=separation, ends=("landed",)))
        grip = merged(tables, {"incoming": {"friction": 0.5}})
        out.append(Case(f"{name}-slips", group, grip, ends=("landed",)))
    return out


def _ends():
    group = "a plate's very end"
    out = []
    r = 0.004
    for name, x in (
        ("dead-on", 0.5),
        ("an-ulp-in", 0.5 - EPS),
        ("an-ulp-out", 0.5 + EPS),
        ("tip", 0.5 + r * (1.0 - 1e-12)),
        ("past-the-tip", 0.5 + r * (1.0 + 1e-12)),
    ):
        plate = surface("target", (-0.5, 0.0), (0.5, 0.0))
        for spin in (False, True):
            drop = {
                "particle": {"radius": r, "spin": spin},
                "surface": [plate],
                **thrown((x, 0.2), (0.0, 0.0)),
                "run": {"until": 0.4},
            }
            out.append(Case(f"end-{name}{'-spin' if spin else ''}", group, drop))
    post = {
        "surface": [surface("post", (0.0, -1.0), (0.0, 0.0), restitution=0.5)],
        **thrown((0.0, 0.5), (0.0, 0.0)),
        "run": {"until": 0.5},
    }

    def upright(e):
        # One rebound, straight up; the place after t = 0.5 s.
        fall = sqrt(2.0 * (0.5 - r) / G)
        rest = 0.5 - fall
        return place_error(e, 0.0, r + 0.5 * G * fall * rest - 0.5 * G * rest**2)

    below = merged(TRANSFER, {"plate": {"above": 0.0, "below": 0.0046}})
    machine = merged(TRANSFER, {"plate": {"above": 0.0}})
    return [
        *out,
        Case("end-post", group, post, formula=upright),
        Case("end-machine-above", group, machine),
        Case("end-machine-below", group, below),
    ]


def _contact():
    group = "released in contact or overlapping"
    floor = surface("floor", (-2.0, 0.0), (2.0, 0.0))
    wall = surface("wall", (2.0, 0.0), (2.0, 1.0))
    out = []
    r = 0.01
    for name, y in (("touch", r), ("tenth", 0.9 * r), ("half", 0.5 * r), ("centred", 0.0)):
        for way, velocity in (("at-rest", (0.0, 0.0)), ("in", (0.5, -1.0)), ("out", (0.5, 1.0))):
            tables = {
                "particle": {"radius": r},
                "surface": [floor, wall],
                **thrown((0.0, y), velocity),
                "run": {"until": 1.0},
            }
            refusals = {} if y == r else dict.fromkeys(LONE, "stream.at")
            out.append(Case(f"contact-{name}-{way}", group, tables, refusals=refusals))
    nook = {
        "particle": {"radius": r},
        "surface": [floor, wall],
        **thrown((2.0 - r, r), (1.0, -1.0)),
        "run": {"until": 1.0},
    }
    crowded = {
        "particle": {"radius": r},
        "surface": [floor, wall],
        **thrown((0.0, 0.5), (0.0, 0.0), count=3, rate=1e9, interact=True),
        "run": {"until": 1.0},
    }
    tight = merged(crowded, {"stream": {"bed_height": 0.04 + 4e-9, "count": 2, "seed": 3}})
    return [
        *out,
        Case("contact-corner", group, nook),
        # All at one place and time: they wait for each other.
        Case("contact-crowd", group, crowded, engines=CROWD, slow=("pymunk",)),
        Case("contact-crowd-tight", group, tight, engines=CROWD, slow=CROWD),
    ]


def _corners():
    group = "two impacts at one instant"
    floor = surface("floor", (0.0, 0.0), (1.0, 0.0), friction=0.0)
    wall = surface("wall", (1.0, 0.0), (1.0, 1.0), friction=0.0)
    square = {
        "gravity": 0.0,
        "surface": [floor, wall],
        **thrown((0.5, 0.5), (1.0, -1.0)),
        "run": {"until": 1.0},
    }

    def back(e):
        # Both components turn round at one time, at half their size.
        t = (0.5 - 0.004) / 1.0
        return place_error(e, 0.996 - 0.5 * (1.0 - t), 0.004 + 0.5 * (1.0 - t))

    one = merged(square, {"surface": [surface("both", (0.0, 0.0), (1.0, 0.0), (1.0, 1.0),
                                              friction=0.0)]})  # fmt: skip
    vee = {
        "surface": [surface("vee", (-0.5, 0.5), (0.0, 0.0), (0.5, 0.5))],
        **thrown((0.0, 0.5), (0.0, 0.0)),
        "run": {"until": 3.0},
    }
    pegs = {
        "particle": {"radius": 0.02, "spin": True},
        "surface": [
            surface("left", (-0.0125, -0.5), (-0.0125, 0.0)),
            surface("right", (0.0125, -0.5), (0.0125, 0.0)),
        ],
        **thrown((0.0, 0.5), (0.0, 0.0)),
        "run": {"until": 2.0},
    }
    nip = {
        "particle": {"radius": 0.01, "spin": True},
        "surface": [
            surface("belt", (-1.0, 0.0), (1.0, 0.0), speed=2.0, friction=0.8, restitution=0.0),
            surface("wall", (1.0, 0.0), (1.0, 1.0), friction=0.8, restitution=0.0),
        ],
        **thrown((0.0, 0.01), (0.0, 0.0)),
        "run": {"until": 4.0},
    }
    sharp = merged(vee, {"surface": [surface("vee", (-0.02, 0.5), (0.0, 0.0), (0.02, 0.5))]})
    return [
        Case("corner-square", group, square, formula=back),
        Case("corner-square-joined", group, one, formula=back),
        Case("corner-vee", group, vee, inside=(-0.5, 0.5, 0.0, 0.5), slow=("pymunk",)),
        Case("corner-vee-sharp", group, sharp, inside=(-0.02, 0.02, 0.0, 0.5)),
        Case("corner-pegs", group, pegs),
        Case("corner-nip", group, nip, refusals={"exact": "run.engine"}, slow=("pymunk",)),
    ]


CASES = (*_grazing(), *_critical(), *_ends(), *_contact(), *_corners())
"""Grazing, critical, on the edge."""
