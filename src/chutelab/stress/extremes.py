"""Cases at the ends of what a scene may hold: speed, size, mass, materials, belts, gravity."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.stress.case import CROWD, TRANSFER, Case, merged, surface, thrown
from chutelab.stress.evidence import Verdict

if TYPE_CHECKING:
    from chutelab.stress.evidence import Evidence

ALIGNED = 1e-8
"""Relative error that a lone particle may have where only its lasting contacts are stepped."""

THIN = 0.002
"""m; thickness of the plate at which particles are shot."""


def place_error(e: Evidence, x: float, y: float) -> Verdict:
    """Distance of particle 0 from where a formula has it at the end, m."""
    found = e.recording.track(0)["position"][-1]
    apart = float(np.hypot(*(found - [x, y])))
    return Verdict(apart, e.rounding + (ALIGNED * e.length if e.stepped else 0.0), "m")


SHOT_UNTIL, SHOT_SPEED, SHOT_RADIUS = 0.01, 200.0, 0.004


def _shot(e: Evidence) -> Verdict:
    # Straight on to the face at x = 1, back at half the speed, falling all the time.
    face = 1.0 - SHOT_RADIUS
    back = 0.5 * SHOT_SPEED * (SHOT_UNTIL - face / SHOT_SPEED)
    return place_error(e, face - back, 0.3 - 0.5 * 9.81 * SHOT_UNTIL**2)


_PLATE = surface(
    "target", (1.0, -0.5), (1.0, 0.8), (1.0 + THIN, 0.8), (1.0 + THIN, -0.5), (1.0, -0.5),
    friction=0.0,
)  # fmt: skip

_SHOT = {
    "surface": [_PLATE],
    **thrown((0.0, 0.3), (SHOT_SPEED, 0.0)),
    "run": {"until": SHOT_UNTIL},
}

_FLOOR = surface("floor", (-50.0, 0.0), (50.0, 0.0))


def _fast() -> list[Case]:
    group = "200 m/s against a 2 mm plate"
    machine = merged(TRANSFER, {"incoming": {"speed": 200.0}, "outgoing": {"speed": 2.0}})
    stream = {"count": 20, "rate": 1000.0, "bed_height": 0.05, "interact": True}
    volley = merged(
        _SHOT,
        {"particle": {"radius": 0.002}, "stream": stream, "run": {"until": 0.05}},
    )
    return [
        Case("plate-200", group, _SHOT, steps=(1e-3, 1 / 60, 1 / 30), formula=_shot),
        Case("plate-200-inclined", group, _inclined(), steps=(1e-3, 1 / 60, 1 / 30)),
        Case("plate-200-machine", group, machine, ends=("landed", "exit")),
        Case("plate-200-small", group, merged(_SHOT, {"particle": {"radius": 1e-4}})),
        Case("plate-200-volley", group, volley, engines=CROWD),
    ]


def _inclined() -> dict[str, object]:
    plate = surface("target", (0.8, -0.5), (1.2, 0.8), restitution=1.0)
    return merged(_SHOT, {"surface": [plate], "particle": {"spin": True}})


def _radii() -> list[Case]:
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


def _masses() -> list[Case]:
    group = "mass"
    out = []
    for mass in (1e-9, 1.0, 1e6):
        lone = merged(TRANSFER, {"particle": {"mass": mass}})
        pair = merged(swarm(20), {"particle": {"mass": mass}})
        out.append(Case(f"mass-{mass:g}", group, lone, ends=("landed",)))
        out.append(Case(f"mass-{mass:g}-swarm", group, pair, engines=CROWD))
    return out


def swarm(count: int, **particle: object) -> dict[str, object]:
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


def _materials() -> list[Case]:
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
        out.append(Case(f"{name}-drop", group, drop))
        out.append(Case(f"{name}-box", group, box, inside=(-0.5, 0.5, -0.5, 0.5)))
        out.append(Case(f"{name}-swarm", group, crowd, engines=CROWD))
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
        out.append(Case(f"friction-{friction:g}-swarm", "friction", crowd, engines=CROWD))
    return out


def _belts() -> list[Case]:
    group = "belt speed"
    out = []
    for speed in (0.0, -2.0, 100.0):
        belt = {"start": -500.0, "length": 20000.0, "speed": speed}
        machine = merged(TRANSFER, {"outgoing": belt, "run": {"until": "settled"}})

        def carried(e: Evidence, speed: float = speed) -> Verdict:
            # It settles where it no longer slips: at the speed of the belt.
            found = float(e.recording.track(0)["velocity"][-1, 0])
            bound = e.rounding + (ALIGNED * max(1.0, abs(speed)) if e.stepped else 0.0)
            return Verdict(abs(found - speed), bound, "m/s")

        for spin in (False, True):
            tables = merged(machine, {"particle": {"spin": spin}})
            turning = "-spin" if spin else ""
            formula = None if spin else carried
            name = f"belt-{speed:g}{turning}"
            out.append(Case(name, group, tables, ends=("settled",), formula=formula))
    still = merged(TRANSFER, {"incoming": {"speed": 0.0}, "run": {"until": 2.0}})
    slips = merged(TRANSFER, {"incoming": {"speed": 100.0, "friction": 0.3}})
    return [
        *out,
        Case("belt-incoming-0", group, still),
        Case("belt-incoming-100", group, slips, ends=("landed", "exit")),
    ]


def _weightless() -> list[Case]:
    group = "g = 0"
    machine = merged(TRANSFER, {"gravity": 0.0, "run": {"until": 3.0}})
    return [
        Case("weightless", group, machine),
        Case("weightless-swarm", group, swarm(40), engines=CROWD),
        Case("weightless-swarm-still", group, swarm(40, spin=False), engines=CROWD),
    ]


CASES = (*_fast(), *_radii(), *_masses(), *_materials(), *_belts(), *_weightless())
"""Speed, size, mass, materials, belts, gravity."""
