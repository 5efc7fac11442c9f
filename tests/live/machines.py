"""A machine as the page's modules have it, from Python's."""

from __future__ import annotations

import numpy as np


def as_page_has_it(machine):
    """Return a machine as nested lists and numbers, by the names of the page."""
    kinds = len(machine.rolling)

    def values(pair):
        return np.broadcast_to(np.asarray(pair), (kinds, *np.shape(pair)[-1:])).T

    def wheel_values(pair):
        return np.broadcast_to(np.asarray(pair), (kinds,)).tolist()

    segments, arcs, wheel = machine.segments, machine.arcs, machine.pulley
    releases, particle, n = machine.releases, machine.particle, machine.count
    common = ("speed", "surface", "appears", "vanishes")

    def rows(pieces, own):
        e, mu = values(pieces.restitution), values(pieces.friction)
        return [
            {
                **{name: column[k].item() for name, column in own.items()},
                **{name: getattr(pieces, name)[k].item() for name in common},
                "restitution": e[k].tolist(),
                "friction": mu[k].tolist(),
            }
            for k in range(len(pieces.surface))
        ]

    return {
        "surfaces": list(machine.surfaces),
        "gravity": machine.gravity,
        "landing": machine.landing,
        "until": machine.until,
        "endTime": float(machine.end_time),
        "dt": machine.dt,
        "interact": machine.interact,
        "segments": rows(
            segments,
            {
                "x": segments.start[:, 0],
                "y": segments.start[:, 1],
                "tx": segments.tangent[:, 0],
                "ty": segments.tangent[:, 1],
                "length": segments.length,
            },
        ),
        "arcs": rows(
            arcs,
            {
                "x": arcs.center[:, 0],
                "y": arcs.center[:, 1],
                "radius": arcs.radius,
                "begin": arcs.begin,
                "extent": arcs.extent,
            },
        ),
        "pulley": None
        if wheel is None
        else {
            "radius": wheel.radius,
            "speed": wheel.speed,
            "incline": float(wheel.incline),
            "surface": wheel.surface,
            "restitution": wheel_values(wheel.restitution),
            "friction": wheel_values(wheel.friction),
        },
        "releases": [
            {
                "t": releases.t[i].item(),
                "x": releases.position[i, 0].item(),
                "y": releases.position[i, 1].item(),
                "vx": releases.velocity[i, 0].item(),
                "vy": releases.velocity[i, 1].item(),
                "exitBox": releases.exit_box[i].tolist(),
                "carried": releases.carried[i].item(),
                "stream": releases.stream[i].item(),
                "kind": releases.kind[i].item(),
            }
            for i in range(n)
        ],
        **{
            name: np.broadcast_to(getattr(particle, name), (n,)).tolist()
            for name in ("radius", "mass", "inertia")
        },
        "pairRestitution": machine.pair_restitution.tolist(),
        "pairFriction": machine.pair_friction.tolist(),
        "rolling": machine.rolling.tolist(),
    }


def plain(value):
    """Return a tree with the numbers that JSON has not as JavaScript writes them."""
    if isinstance(value, float) and not np.isfinite(value):
        return {"inf": "Infinity", "-inf": "-Infinity", "nan": "NaN"}[str(value)]
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    return {key: plain(entry) for key, entry in value.items()} if isinstance(value, dict) else value
