"""Cases that last: many bounces, long flights, late releases, piles, coarse steps."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from chutelab.scene import load, to_dict
from chutelab.stress.case import CROWD, TRANSFER, Case, Twin, merged, surface, thrown
from chutelab.stress.conservation import A_CONTACT
from chutelab.stress.evidence import EPS, ROUNDINGS, Verdict
from chutelab.stress.extremes import place_error

if TYPE_CHECKING:
    from chutelab.stress.evidence import Evidence

G = 9.81
LONG = 1e6
"""s; the longest a scene may last, and the latest release."""

COARSE = 1.0 / 30.0


def _bounces() -> list[Case]:
    group = "ten thousand bounces"
    restitution, drop = 0.998, 0.01
    floor = surface("floor", (-50.0, 0.0), (50.0, 0.0), restitution=restitution, friction=0.0)
    tables = {
        "surface": [floor],
        **thrown((0.0, 0.004 + drop), (0.0, 0.0)),
        "run": {"until": "settled", "max_time": 100.0},
    }

    def at_rest(e: Evidence) -> Verdict | None:
        # Flights shrink by ε: after the fall they last 2 u (1 + ε + ε² ...)/g, u the rebound.
        if e.stepped:
            return None
        fall = sqrt(2.0 * drop / G)
        expected = fall + 2.0 * restitution * G * fall / (G * (1.0 - restitution))
        found = float(e.recording.track(0)["t"][-1])
        bound = EPS * (ROUNDINGS + A_CONTACT * e.recording.contacts) * expected
        return Verdict(abs(found - expected), bound, f"s of {expected:.4g} s")

    once = Case("bounces-10000", group, tables, steps=(COARSE,), formula=at_rest, ends=("settled",))
    for_ever = merged(
        tables,
        {"surface": [{**floor, "restitution": 1.0}], "run": {"until": 900.0, "max_time": 900.0}},
    )
    return [once, Case("bounces-10000-elastic", group, for_ever, engines=("exact",))]


def _flights() -> list[Case]:
    group = "10^6 s of flight without gravity"
    free = {
        "gravity": 0.0,
        **thrown((0.125, 0.25), (0.5, -0.25)),
        "run": {"until": LONG, "max_time": LONG},
    }

    steps = "a flight is stepped too: 10^6 s are 3 · 10^7 steps of 1/30 s, several minutes"

    def straight(e: Evidence) -> Verdict:
        return place_error(e, 0.125 + 0.5 * LONG, 0.25 - 0.25 * LONG)

    wall = surface("wall", (4e5, -1e6), (4e5, 1e6), restitution=0.5, friction=0.0)
    walled = merged(free, {"surface": [wall]})

    def returned(e: Evidence) -> Verdict:
        there = (4e5 - 0.004 - 0.125) / 0.5
        x = 4e5 - 0.004 - 0.25 * (LONG - there)
        return place_error(e, x, 0.25 - 0.25 * LONG)

    return [
        Case("flight-1e6", group, free, formula=straight, unpromised={"pymunk": steps}),
        Case("flight-1e6-wall", group, walled, formula=returned, unpromised={"pymunk": steps}),
    ]


def _late() -> list[Case]:
    group = "time far from zero"
    late = merged(TRANSFER, {"stream": {"count": 2, "rate": 1e-6}})
    # Knots are at times as coarse as an ulp of 1e6 s, passed at up to 4 m/s, some at either end.
    bound = 16.0 * float(np.spacing(LONG)) * 4.0
    twin = Twin("delay", late, back=lambda p: p, bound=bound, particle=1)
    pair = merged(late, {"stream": {"interact": True}})
    return [
        Case("late-1e6", group, TRANSFER, twin=twin),
        Case("late-1e6-interacting", group, pair, engines=CROWD),
    ]


def box(width: float, height: float, **materials: float) -> dict[str, object]:
    """Return an open box with its floor on y = 0, as one polyline."""
    half = 0.5 * width
    return surface("box", (-half, height), (-half, 0.0), (half, 0.0), (half, height), **materials)


def _pile(count: int, width: float, radius: float, lasts: float) -> dict[str, object]:
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


def _piles() -> list[Case]:
    group = "a pile left alone"
    small = Case(
        "pile-60",
        group,
        _pile(60, 0.4, 0.02, 2.5),
        engines=CROWD,
        at_rest=True,
        steps=(1e-3, 1.0 / 120.0),
        inside=(-0.2, 0.2, 0.0, 4.0),
        patience=60.0,
    )
    large = small.but(
        name="pile-2000",
        tables=_pile(2000, 1.2, 0.01, 60.0),
        steps=(1e-3,),
        inside=(-0.6, 0.6, 0.0, 4.0),
        full=True,
        patience=7200.0,
    )
    return [small, large]


def _coarse() -> list[Case]:
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
                full=name == "stream-whole", patience=120.0,
            )
            for name, tables in streams.items()
        ),
    ]  # fmt: skip


def cases() -> tuple[Case, ...]:
    """Return the cases; the shipped scenes among them are read now."""
    return (*_bounces(), *_flights(), *_late(), *_piles(), *_coarse())
