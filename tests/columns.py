"""Random tall columns and silos of disks: where contacts wedge, and friction carries on walls.

- `column`: the scene of a seed, and how fast anything in it may be.
- `faults`: what a run of one does that none may do, in words.
"""

from __future__ import annotations

from math import sqrt, tan

import numpy as np

from chutelab.results.ledger import ledger

G = 9.81

WEDGING = (1.5, 2.1)
"""Widths, in diameters, at which disks lie in a zigzag so steep that they wedge."""


def column(seed, count):
    """Return the scene of a seed, with a stream of `count` disks, and the speed of free fall, m/s.

    Half are of a width that wedges, the others 1.05 to 5 diameters wide; two of five have a slot at
    the bottom, and a tray below it.
    """
    rng = np.random.default_rng(seed)
    r = 10.0 ** rng.uniform(-3.0, -1.5)
    d = 2.0 * r
    width = d * (rng.uniform(*WEDGING) if rng.random() < 0.5 else rng.uniform(1.05, 5.0))
    silo = rng.random() < 0.4
    friction, walls = rng.uniform(0.0, 1.0, 2)
    restitution, of_walls = rng.uniform(0.0, 0.6, 2)
    if silo:
        width = max(width, 2.5 * d)
    high = count * d / max(1.0, width / d) + 10.0 * d
    pair = {"friction": walls, "restitution": of_walls}
    half, below = 0.5 * width, 0.0
    if silo:
        slot, below = 0.5 * rng.uniform(1.05, 1.8) * d, 6.0 * d
        rise = (half - slot) * tan(rng.uniform(0.3, 1.2))
        left = [[-half, 1.3 * high], [-half, rise], [-slot, 0.0]]
        tray = [[-8 * width, 3 * d], [-8 * width, -below], [8 * width, -below], [8 * width, 3 * d]]
        surfaces = [
            {"name": "left", "points": left, **pair},
            {"name": "right", "points": [[-x, y] for x, y in left], **pair},
            {"name": "tray", "points": tray, "friction": 0.5, "restitution": 0.3},
        ]
    else:
        box = [[-half, 1.3 * high], [-half, 0.0], [half, 0.0], [half, 1.3 * high]]
        surfaces = [{"name": "box", "points": box, **pair}]
    speed, span = 2.0 * sqrt(G * r), half - 1.01 * r
    rate = speed / d * rng.uniform(0.3, 1.0) * max(1.0, span / d)
    scene = {
        "gravity": G,
        "particle": {"radius": r, "density": 2500.0, "spin": bool(rng.random() < 0.8)},
        "stream": {
            "count": count, "rate": rate, "at": [-span, high], "to": [span, high],
            "velocity": [0.0, -speed], "interact": True, "restitution": restitution,
            "friction": friction,
        },
        "surface": surfaces,
        "run": {"until": count / rate + 60.0 * sqrt(r / G)},
    }  # fmt: skip
    return scene, sqrt(speed**2 + 2.0 * G * (high + below))


def faults(recording, fastest):
    """Return in words what a run did that none may do; `fastest` is the speed of free fall, m/s."""
    found, books = [], ledger(recording)
    speed = float(np.hypot(*recording.knots["velocity"].T).max())
    # A state in contact has half of a step's fall more, or less.
    if not speed <= fastest + G * recording.machine.dt:
        found.append(f"a disk has {speed:.4g} m/s, free fall ends with {fastest:.4g} m/s")
    found += [
        f"{name}: {getattr(books, name):.3g} of {books.turned_over:.3g} J"
        for name in ("restitution_loss", "friction_loss")
        if not getattr(books, name) >= -1e-9 * books.turned_over
    ]
    if not recording.gained <= 1e-12 * books.turned_over:
        found.append(f"solves gained {recording.gained:.3g} of {books.turned_over:.3g} J")
    if not books.relative_residual <= 1e-9:
        found.append(f"the ledger misses {books.relative_residual:.1e}")
    return found
