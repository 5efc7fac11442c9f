"""Random tall columns and silos of disks: where contacts wedge, and friction carries on walls."""

from math import sqrt, tan

import numpy as np

G = 9.81

WEDGING = (1.5, 2.1)
"""Widths, in diameters, at which disks lie in a zigzag so steep that they wedge."""


def column(seed, count):
    """Return the scene of a seed, with a stream of `count` disks.

    Half are of a width that wedges, the others 1.05 to 5 diameters wide; two of five have a slot at
    the bottom, and a tray below it; of three, one has disks of several sizes; of four, one has
    belts as walls; where there is room one of two has ledges. Times go with sqrt(r/g): it is filled
    in some 60 of that, and runs as long again.
    """
    rng = np.random.default_rng(seed)
    r = 10.0 ** rng.uniform(-3.0, -1.5)
    d, tick = 2.0 * r, sqrt(r / G)
    width = d * (rng.uniform(*WEDGING) if rng.random() < 0.5 else rng.uniform(1.05, 5.0))
    silo = rng.random() < 0.4
    friction, walls = rng.uniform(0.0, 1.0, 2).tolist()
    restitution, of_walls = rng.uniform(0.0, 0.6, 2).tolist()
    mixed, moving = rng.random() < 0.33, rng.random() < 0.25
    if silo:
        width = max(width, 2.5 * d)
    layers = count / max(1.0, width / d)
    high = layers * d + 10.0 * d
    pair = {"friction": walls, "restitution": of_walls}
    if moving:
        pair["speed"] = float(rng.uniform(-1.0, 1.0)) * sqrt(G * r)
    half, top = 0.5 * width, 1.3 * high
    if silo:
        slot, below = 0.5 * rng.uniform(1.3, 2.2) * d, 6.0 * d
        rise = (half - slot) * tan(rng.uniform(0.3, 1.2))
        left = [[-half, top], [-half, rise], [-slot, 0.0]]
        tray = [[-8 * width, 3 * d], [-8 * width, -below], [8 * width, -below], [8 * width, 3 * d]]
        floor = {"name": "tray", "points": tray, "friction": 0.5, "restitution": 0.3}
    else:
        left = [[-half, top], [-half, 0.0]]
        floor = {"name": "floor", "from": [-half, 0.0], "to": [half, 0.0], "friction": walls}
    surfaces = [
        {"name": "left", "points": left, **pair},
        {"name": "right", "points": [[-x, y] for x, y in left], **pair},
        floor,
    ]
    if width > 3.5 * d and rng.random() < 0.5:
        ledge = {"from": [-half, 12.0 * d], "to": [-half + 0.8 * d, 11.0 * d]}
        times = max(1, int(0.7 * high / (20.0 * d)))
        surfaces.append({"name": "ledges", **ledge, "repeat": [[times, 0.0, 20.0 * d]]})
    speed, span = max(2.0 * r, layers * d / 60.0) / tick, max(0.0, half - 1.35 * r)
    rate = speed / d * rng.uniform(0.5, 1.0) * max(1.0, width / d - 0.5)
    return {
        "gravity": G,
        "particle": {
            "radius": [0.7 * r, 1.3 * r] if mixed else r,
            "density": 2500.0,
            "spin": bool(rng.random() < 0.8),
        },
        "stream": {
            "count": count, "rate": rate, "at": [-span, high], "to": [span, high],
            "velocity": [0.0, -speed], "interact": True, "restitution": restitution,
            "friction": friction, "seed": seed,
        },
        "surface": surfaces,
        "run": {"until": count / rate + 60.0 * tick, "dt": min(1e-3, sqrt(8e-3) * tick)},
    }  # fmt: skip
