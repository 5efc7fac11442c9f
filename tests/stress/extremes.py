"""Cases at the ends of what a scene may hold, and cases that last.

Speed, size, mass, materials, belts and gravity at their limits; many bounces, long flights, late
releases, piles and coarse steps.
"""

from math import sqrt

import numpy as np

from chutelab.checks.stress import A_CONTACT, EPS, ROUNDINGS, Verdict
from chutelab.scene import load, to_dict
from stress.case import CROWD, TRANSFER, Case, Twin, merged, surface, thrown

ALIGNED = 1e-8
"""Relative error that a lone particle may have where only its lasting contacts are stepped."""

THIN = 0.002
"""m; thickness of the plate at which particles are shot."""


def place_error(e, x, y):
    """Distance of particle 0 from where a formula has it at the end, m."""
    found = e.recording.track(0)["position"][-1]
    apart = float(np.hypot(*(found - [x, y])))
    bounds = e.bounds
    late = ALIGNED * bounds.length if e.dt is not None else 0.0
    return Verdict(apart, bounds.rounding + late, "m")


SHOT_UNTIL, SHOT_SPEED, SHOT_RADIUS = 0.01, 200.0, 0.004


def _shot(e):
    # Straight on to the face at x = 1, back at half the speed, falling all the time.
    face = 1.0 - SHOT_RADIUS
    back = 0.5 * SHOT_SPEED * (SHOT_UNTIL - face / SHOT_SPEED)
    return place_error(e, face - back, 0.3 - 0.5 * 9.81 * SHOT_UNTIL**2)


_PLATE = surface(
    "target", (1.0, -0.5), (1.0, 0.8), (1.0 + THIN, 0.8), (1.0 + THIN, -0.5), (1.0, -0.5),
    friction=0.0,
)  # fmt: skip

_SHOT = {"surface": [_PLATE], **thrown((0.0, 0.3), (SHOT_SPEED, 0.0)), "run": {"until": SHOT_UNTIL}}

_FLOOR = surface("floor", (-50.0, 0.0), (50.0, 0.0))


def _fast():
    group = "200 m/s against a 2 mm plate"
    machine = merged(TRANSFER, {"incoming": {"speed": 200.0}, "outgoing": {"speed": 2.0}})
    stream = {"count": 20, "rate": 1000.0, "bed_height": 0.05, "interact": True}
    volley = merged(
        _SHOT, {"particle": {"radius": 0.002}, "stream": stream, "run": {"until": 0.05}}
    )
    return [
        Case("plate-200", group, _SHOT, steps=(1e-3, 1 / 60, 1 / 30), formula=_shot),
        Case("plate-200-inclined", group, _inclined(), steps=(1e-3, 1 / 60, 1 / 30)),
        Case("plate-200-machine", group, machine, ends=("landed", "exit")),
        Case("plate-200-small", group, merged(_SHOT, {"particle": {"radius": 1e-4}})),
        Case("plate-200-volley", group, volley, engines=CROWD),
    ]


def _inclined():
    plate = surface("target", (0.8, -0.5), (1.2, 0.8), restitution=1.0)
    return merged(_SHOT, {"surface": [plate], "particle": {"spin": True}})


def _radii():
    group = "radius"
    out = []
    for r in (1e-6, 1e-5, 1e-4, 1e-3, 0.03):
        name = f"radius-{r:g}"
        out.append(Case(name, group, merged(TRANSFER, {"particle": {"radius": r}})))
    for r in (1e-6, 1e-3, 1.0):
        drop = {
            "particle": {"radius": r, "spin": True},
            "surface": [_FLOOR],
            **thrown((0.0, 5.0 * r + 0.1), (1.0, 0.0)),
            "run": {"until": 2.0},
        }
        out.append(Case(f"radius-{r:g}-drop", group, drop))
    big = {
        "particle": {"radius": 1.0},
        "incoming": {"speed": 4.0, "pulley_radius": 0.5, "length": 4.0},
        "plate": {"distance": 4.0, "above": 4.0},
        "outgoing": {"drop": 8.0, "drop_from": "top", "start": -20.0, "length": 60.0},
    }
    point = merged(TRANSFER, {"particle": {"radius": 0.0}})
    return [
        *out,
        Case("radius-1", group, big, ends=("landed",)),
        Case(
            "radius-0", group, point, refusals=dict.fromkeys(CROWD, "run.engine"), ends=("landed",)
        ),
    ]


def _masses():
    group = "mass"
    out = []
    for mass in (1e-9, 1.0, 1e6):
        lone = merged(TRANSFER, {"particle": {"mass": mass}})
        pair = merged(swarm(20), {"particle": {"mass": mass}})
        out.append(Case(f"mass-{mass:g}", group, lone, ends=("landed",)))
        out.append(Case(f"mass-{mass:g}-swarm", group, pair, engines=CROWD, slow=CROWD))
    return out


def swarm(count, **particle):
    """Return a stream that meets itself far from everything, without gravity."""
    return {
        "gravity": 0.0,
        "particle": {"radius": 0.02, "spin": True, **particle},
        **thrown(
            (0.0, 0.0), (1.0, 0.0), count=count, rate=20.0, bed_height=0.3, speed_spread=0.7,
            interact=True, restitution=0.8, friction=0.3,
        ),
        "run": {"until": 5.0},
    }  # fmt: skip


def _materials():
    out = []
    for restitution in (0.0, 0.999, 1.0):
        drop = {
            "surface": [surface("floor", (-5.0, 0.0), (5.0, 0.0), restitution=restitution)],
            **thrown((0.0, 0.3), (0.1, 0.0)),
            "run": {"until": 10.0},
        }
        walls = surface(
            "box", (-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5),
            restitution=restitution, friction=0.0,
        )  # fmt: skip
        box = {
            "gravity": 0.0,
            "surface": [walls],
            **thrown((0.1, 0.0), (1.3, 0.7)),
            "run": {"until": 20.0},
        }
        crowd = merged(swarm(20), {"stream": {"restitution": restitution}})
        name, group = f"restitution-{restitution:g}", "restitution"
        out.append(Case(f"{name}-drop", group, drop, slow=() if restitution else ("pymunk",)))
        out.append(Case(f"{name}-box", group, box, inside=(-0.5, 0.5, -0.5, 0.5)))
        slow = CROWD if restitution else ()
        out.append(Case(f"{name}-swarm", group, crowd, engines=CROWD, slow=slow))
    for friction in (0.0, 1e6):
        for spin in (False, True):
            materials = {"friction": friction, "restitution": 0.5}
            machine = merged(
                TRANSFER,
                {"particle": {"spin": spin}, "plate": materials, "outgoing": materials},
                {"run": {"until": "settled" if friction else 2.0}},
            )
            turning = "-spin" if spin else ""
            out.append(Case(f"friction-{friction:g}{turning}", "friction", machine))
        crowd = merged(swarm(20), {"stream": {"friction": friction}})
        name = f"friction-{friction:g}-swarm"
        out.append(Case(name, "friction", crowd, engines=CROWD, slow=CROWD))
    return out


def _belts():
    group = "belt speed"
    out = []
    for speed in (0.0, -2.0, 100.0):
        belt = {"start": -500.0, "length": 20000.0, "speed": speed}
        machine = merged(TRANSFER, {"outgoing": belt, "run": {"until": "settled"}})

        def carried(e, speed=speed):
            # It settles where it no longer slips: at the speed of the belt.
            found = float(e.recording.track(0)["velocity"][-1, 0])
            late = ALIGNED * max(1.0, abs(speed)) if e.dt is not None else 0.0
            return Verdict(abs(found - speed), e.bounds.rounding + late, "m/s")

        for spin in (False, True):
            tables = merged(machine, {"particle": {"spin": spin}})
            turning = "-spin" if spin else ""
            formula = None if spin else carried
            name = f"belt-{speed:g}{turning}"
            slow = ("pymunk",) if speed == 100.0 else ()
            out.append(Case(name, group, tables, ends=("settled",), formula=formula, slow=slow))
    still = merged(TRANSFER, {"incoming": {"speed": 0.0}, "run": {"until": 2.0}})
    slips = merged(TRANSFER, {"incoming": {"speed": 100.0, "friction": 0.3}})
    return [
        *out,
        Case("belt-incoming-0", group, still),
        Case("belt-incoming-100", group, slips, ends=("landed", "exit")),
    ]


def _weightless():
    group = "g = 0"
    machine = merged(TRANSFER, {"gravity": 0.0, "run": {"until": 3.0}})
    return [
        Case("weightless", group, machine),
        Case("weightless-swarm", group, swarm(40), engines=CROWD, slow=CROWD),
        Case("weightless-swarm-still", group, swarm(40, spin=False), engines=CROWD, slow=CROWD),
    ]


CASES = (*_fast(), *_radii(), *_masses(), *_materials(), *_belts(), *_weightless())
"""Speed, size, mass, materials, belts, gravity."""

G = 9.81
LONG = 1e6
"""s; the longest a scene may last, and the latest release."""

COARSE = 1.0 / 30.0


def _bounces():
    group = "ten thousand bounces"
    restitution, drop = 0.998, 0.01
    floor = surface("floor", (-50.0, 0.0), (50.0, 0.0), restitution=restitution, friction=0.0)
    tables = {
        "surface": [floor],
        **thrown((0.0, 0.004 + drop), (0.0, 0.0)),
        "run": {"until": "settled", "max_time": 100.0},
    }

    def at_rest(e):
        # Flights shrink by ε: after the fall they last 2 u (1 + ε + ε² ...)/g, u the rebound.
        if e.dt is not None:
            return None
        fall = sqrt(2.0 * drop / G)
        expected = fall + 2.0 * restitution * G * fall / (G * (1.0 - restitution))
        found = float(e.recording.track(0)["t"][-1])
        bound = EPS * (ROUNDINGS + A_CONTACT * e.recording.contacts) * expected
        return Verdict(abs(found - expected), bound, f"s of {expected:.4g} s")

    once = Case(
        "bounces-10000", group, tables, steps=(COARSE,), formula=at_rest, ends=("settled",),
        slow=("exact", "pymunk"),
    )  # fmt: skip
    for_ever = merged(
        tables,
        {"surface": [{**floor, "restitution": 1.0}], "run": {"until": 900.0, "max_time": 900.0}},
    )
    return [
        once,
        Case("bounces-10000-elastic", group, for_ever, engines=("exact",), slow=("exact",)),
    ]


def _flights():
    group = "10^6 s of flight without gravity"
    free = {
        "gravity": 0.0,
        **thrown((0.125, 0.25), (0.5, -0.25)),
        "run": {"until": LONG, "max_time": LONG},
    }

    steps = "a flight is stepped too: 10^6 s are 3 · 10^7 steps of 1/30 s, several minutes"

    # Far beyond where the flight ends: what leaves the box of all surfaces has ended.
    post = surface("post", (6e5, 3e5), (6e5, -3e5))
    room = merged(free, {"surface": [post]})

    def straight(e):
        return place_error(e, 0.125 + 0.5 * LONG, 0.25 - 0.25 * LONG)

    wall = surface("wall", (4e5, -1e6), (4e5, 1e6), restitution=0.5, friction=0.0)
    walled = merged(free, {"surface": [wall]})

    def returned(e):
        there = (4e5 - 0.004 - 0.125) / 0.5
        x = 4e5 - 0.004 - 0.25 * (LONG - there)
        return place_error(e, x, 0.25 - 0.25 * LONG)

    return [
        Case("flight-1e6", group, room, formula=straight, unpromised={"pymunk": steps}),
        Case("flight-1e6-wall", group, walled, formula=returned, unpromised={"pymunk": steps}),
    ]


def _late():
    group = "time far from zero"
    late = merged(TRANSFER, {"stream": {"count": 2, "rate": 1e-6}})
    # Knots are at times as coarse as an ulp of 1e6 s, passed at up to 4 m/s, some at either end.
    bound = 16.0 * float(np.spacing(LONG)) * 4.0
    twin = Twin("delay", late, back=lambda p: p, bound=bound, particle=1)
    pair = merged(late, {"stream": {"interact": True}})
    return [
        Case("late-1e6", group, TRANSFER, twin=twin),
        Case("late-1e6-interacting", group, pair, engines=CROWD, slow=("pymunk",)),
    ]


def box(width, height, **materials):
    """Return an open box with its floor on y = 0, as one polyline."""
    half = 0.5 * width
    return surface("box", (-half, height), (-half, 0.0), (half, 0.0), (half, height), **materials)


def _pile(count, width, radius, lasts):
    """Return a box into which particles are thrown, five box widths a second, and left alone.

    Those that come back from the far wall have fallen below where the next are released.
    """
    rate = 5.0 * width / radius
    return {
        "particle": {"radius": radius, "spin": True},
        "surface": [box(width, 4.0)],
        **thrown(
            (-0.4 * width, 1.5), (2.5 * width, 0.0), count=count, rate=rate, bed_height=0.5,
            interact=True,
        ),
        "run": {"until": count / rate + lasts, "max_time": lasts},
    }  # fmt: skip


def _piles():
    group = "a pile left alone"
    small = Case(
        "pile-60",
        group,
        _pile(60, 0.4, 0.02, 2.5),
        engines=CROWD,
        at_rest=True,
        steps=(1e-3, 1.0 / 120.0),
        inside=(-0.2, 0.2, 0.0, 4.0),
        slow=CROWD,
        patience=60.0,
    )
    # Pymunk steps what lies still, too: a minute of 2,000 takes it an hour.
    middle = small.but(
        name="pile-400",
        tables=_pile(400, 0.6, 0.01, 10.0),
        steps=(1e-3,),
        inside=(-0.3, 0.3, 0.0, 4.0),
        patience=300.0,
    )
    large = small.but(
        name="pile-2000",
        tables=_pile(2000, 1.2, 0.01, 60.0),
        engines=("contact",),
        steps=(1e-3,),
        inside=(-0.6, 0.6, 0.0, 4.0),
        patience=300.0,
    )
    return [small, middle, large]


def _coarse():
    group = "dt 1/30"
    names = ("perpendicular", "inclined-40", "low-speed", "belt-landing", "slip", "free-fall")
    shipped = {name: to_dict(load(name)) for name in names}
    streams = {
        "stream": to_dict(load("stream", ["stream.count=40"])),
        "stream-whole": to_dict(load("stream")),
    }
    steps = (COARSE,)
    return [
        *(Case(f"coarse-{name}", group, tables, steps=steps) for name, tables in shipped.items()),
        *(
            Case(
                f"coarse-{name}", group, tables, engines=CROWD, steps=steps,
                slow=CROWD if name == "stream-whole" else (), patience=120.0,
            )
            for name, tables in streams.items()
        ),
    ]  # fmt: skip


def lasting_cases():
    """Return the cases; the shipped scenes among them are read now."""
    return (*_bounces(), *_flights(), *_late(), *_piles(), *_coarse())
