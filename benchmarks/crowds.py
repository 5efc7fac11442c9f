"""Run time, overlaps and ledger of particles that meet, beside a bare loop of Pymunk steps.

    python benchmarks/crowds.py [ENGINE] [CASE ...]

ENGINE is contact or pymunk, by default what `auto` takes. The cases, all by default:

    stream  the scene `stream`: 200 until settled, plate and belt
    bed     1,000 at 200/s in a bed of 4 layers, spinning, plate and belt
    long    3,200 in a stream of 16 s
    box     2,000 poured into a box 0.5 m wide, until they sleep
    hopper  1,000 grains of the scene `hopper`, of several sizes, run out through its gate
    board   the scene `galton`: 500 balls fall through 12 rows of pegs
    drum    1,000 in a drum whose rim runs, which never sleep, for 1 s
    boxes   only if asked for: 1,000 into each of twenty boxes 0.3 to 0.6 m wide, until they sleep
    wide    only if asked for: 500, 1,000, 2,000 and 4,000 fall from 0.45 m into boxes of a width in
            proportion, for 2 s; and the power of their number with which the time grows
    deep    the same with boxes of the same width, from heights in proportion

`stream` and `bed` run in turns with the bare loop, three times each; medians are told. The loop has
the same solids and disks, each from its release on, carried by a belt that holds it, then free; it
only calls `space.step(1e-3)`: no recording, no ledger. Its surfaces are segments 4 mm thick, as
without thickness disks at 4 m/s would pass through them. Seconds are processor time of the whole
`simulate`. Overlaps are looked at every 5 ms, as shares of the radius, of pairs that touch and of
disks that touch a surface (the loop's: of pairs).
"""

import sys
from math import acos, cos, inf, log, sin
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np
import pymunk

from chutelab import scene
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.results.ledger import ledger
from chutelab.scene import load

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from references import Depth, inside_surfaces, overlaps, pair_overlaps

ENGINES = ("contact", "pymunk")
REPEATS = 3
STEP = 1e-3
"""s; of the bare loop."""

LOOK = 5e-3
"""s between two looks at the overlaps."""

HALF = 2e-3
"""m; half the thickness of the loop's surfaces."""

SLOP = 1e-3
"""Overlap that the loop's solver allows, in radii; Pymunk's default, 0.1 m, is meant for pixels."""


def box(width, count, speed):
    """Return a scene: so many are poured into a box, at so many m/s, until they sleep."""
    left, right = -0.5 * width, 0.5 * width
    return {
        "title": f"{count:,} poured into a box {width:.2f} m wide",
        "particle": {"radius": 0.004, "mass": 0.0021},
        "surface": [
            {"name": "box", "points": [[left, 3.0], [left, 0.0], [right, 0.0], [right, 3.0]],
             "restitution": 0.5, "friction": 0.3},
        ],
        "stream": {"count": count, "rate": 1000.0, "at": [left + 0.05, 1.0],
                   "velocity": [speed, 0.0], "bed_height": 0.1, "interact": True},
        "run": {"until": "settled", "max_time": 60.0},
    }  # fmt: skip


DRUM = {
    "title": "1,000 in a drum whose rim runs at 0.5 m/s",
    "particle": {"radius": 0.004, "mass": 0.0021, "spin": True},
    "surface": [
        {"name": "drum", "center": [0.0, 0.0], "radius": 0.22, "from_deg": -180.0, "to_deg": 180.0,
         "speed": 0.5, "restitution": 0.5, "friction": 0.5},
    ],
    "stream": {"count": 1000, "fill": [[-0.15, -0.15], [0.15, 0.15]], "velocity": [0.0, 0.0],
               "interact": True, "restitution": 0.5, "friction": 0.3},
    "run": {"until": 1.0},
}  # fmt: skip


def falling(width, height, count):
    """Return a scene: so many fall from places up to a height into a box, for 2 s."""
    poured = box(width, count, 0.0)
    stream = {name: poured["stream"][name] for name in ("count", "velocity", "interact")}
    stream["fill"] = [[-0.5 * width + 0.005, 0.01], [0.5 * width - 0.005, height]]
    stream |= {"restitution": 0.5, "friction": 0.3}
    particle = poured["particle"] | {"spin": True}
    return poured | {"particle": particle, "stream": stream, "run": {"until": 2.0}}


LONG = ["stream.count=3200", "run.max_time=30"]
BED = ["stream.count=1000", "particle.spin=true"]

CASES = {
    "stream": lambda: load("stream"),
    "bed": lambda: load("stream", BED),
    "long": lambda: load("stream", LONG),
    "box": lambda: scene.from_dict(box(0.5, 2000, 2.0)),
    "hopper": lambda: load("hopper", HOPPER),
    "board": lambda: load("galton"),
    "drum": lambda: scene.from_dict(DRUM),
}
HOPPER = ["stream.count=1000", "stream.fill=[[-0.095, 0.08], [0.095, 1.19]]"]
BOXES = {
    f"{width:.4f} m": lambda width=width: scene.from_dict(box(width, 1000, 1.0))
    for width in np.linspace(0.3, 0.6, 20).tolist()
}
NUMBERS = (500, 1000, 2000, 4000)
WIDE = {f"wide {n}": lambda n=n: scene.from_dict(falling(n / 2000.0, 0.45, n)) for n in NUMBERS}
DEEP = {
    f"deep {n}": lambda n=n: scene.from_dict(falling(0.5, n / 1000.0 * 0.45, n)) for n in NUMBERS
}
SEVERAL = {"boxes": BOXES, "wide": WIDE, "deep": DEEP}
COMPARED = ("stream", "bed")


def moments(machine):
    """Return (time, particle, carried, place, velocity) of each beginning of a ride and flight."""
    found, start = [], machine.releases
    for n, (t, (x, y), (v, vy)) in enumerate(
        zip(start.t, start.position, start.velocity, strict=True)
    ):
        found.append((t, n, bool(start.carried[n]), (x, y), (v, vy)))
        if start.carried[n]:
            phi = acos(min(1.0, v**2 / (machine.gravity * y)))
            place, course = (y * sin(phi), y * cos(phi)), (v * cos(phi), -v * sin(phi))
            found.append((t + (y * phi - x) / v, n, False, place, course))
    return sorted(found, reverse=True)


def space_of(machine):
    """Return a space with the surfaces, and elasticity and friction of a disk.

    Chipmunk takes the product of two shapes' values for a pair.
    """
    space = pymunk.Space()
    space.gravity = (0.0, -machine.gravity)
    space.collision_slop = SLOP * machine.particle.radius
    own, grip = machine.pair_restitution[0, 0] ** 0.5, machine.pair_friction[0, 0] ** 0.5
    s, wheel = machine.segments, machine.pulley
    for k, (a, b) in enumerate(zip(s.start.tolist(), s.end.tolist(), strict=True)):
        shape = pymunk.Segment(space.static_body, a, b, HALF)
        shape.surface_velocity = tuple((s.speed[k] * s.tangent[k]).tolist())
        shape.elasticity = s.restitution[k] / own
        shape.friction = min(s.friction[k], 1e3) / grip
        space.add(shape)
    if wheel is not None:
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.angular_velocity = -wheel.speed / wheel.radius
        shape = pymunk.Circle(body, wheel.radius)
        shape.elasticity, shape.friction = wheel.restitution / own, min(wheel.friction, 1e3) / grip
        space.add(body, shape)
    return space, own, grip


def bare(machine, end, *, looks, step=STEP):
    """Return the seconds that `space.step` took until a time, and the overlaps if looked at."""
    space, own, grip = space_of(machine)
    p, waiting = machine.particle, moments(machine)
    free = pymunk.ShapeFilter(categories=1)
    held = pymunk.ShapeFilter(categories=2, mask=1)
    bodies, seconds, found, every = {}, 0.0, [], max(1, round(LOOK / step))
    for n in range(round(end / step)):
        while waiting and waiting[-1][0] <= n * step:
            _, k, carried, place, course = waiting.pop()
            if k in bodies:
                space.remove(bodies[k], *bodies[k].shapes)
            if carried:
                body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            else:
                body = pymunk.Body(p.mass, p.inertia if p.inertia > 0.0 else inf)
            body.position, body.velocity = place, course
            shape = pymunk.Circle(body, p.radius)
            shape.elasticity, shape.friction = own, grip
            shape.filter = held if carried else free
            space.add(body, shape)
            bodies[k] = body
        begin = process_time()
        space.step(step)
        seconds += process_time() - begin
        if looks and n % every == 0:
            moved = [b.position for b in bodies.values() if b.body_type == pymunk.Body.DYNAMIC]
            found.append(pair_overlaps(np.array(moved).reshape(-1, 2), p.radius))
    return seconds, Depth.of(found)


def told(depth):
    return f"{100 * depth.worst:7.2f} {100 * depth.percentile_99:7.3f}"


def measure(name, engine):
    """Print what a case takes, and return its seconds."""
    drawn = (CASES | BOXES | WIDE | DEEP)[name]()
    machine = build(drawn)
    ours, theirs, compared = [], [], name in COMPARED
    for _ in range(REPEATS if compared else 1):
        begin = process_time()
        recording = simulate(drawn, engine=engine)
        ours.append(process_time() - begin)
        end = float(recording.ends()[1]["t"].max())
        if compared:
            theirs.append(bare(machine, end, looks=False)[0])
    times = np.arange(0.0, end, LOOK)
    pairs, walls = overlaps(recording, times), inside_surfaces(recording, machine, times)
    residual = ledger(recording).relative_residual
    print(
        f"{name:9} {recording.engine:8} {recording.count:6} {end:7.2f} {median(ours):8.2f}"
        f" {told(pairs)} {told(walls)} {residual:9.1e}"
    )
    if compared:
        depth = bare(machine, end, looks=True)[1]
        print(
            f"{'':9} {'bare':8} {recording.count:6} {end:7.2f} {median(theirs):8.2f} {told(depth)}"
        )
        print(f"{'':9} ratio {median(ours) / median(theirs):.2f}")
    return median(ours)


def main(arguments):
    engine = arguments.pop(0) if arguments and arguments[0] in ENGINES else None
    print(f"{'':33} {'':8} {'pairs, % of r':>15} {'surfaces, % of r':>17}")
    print(
        f"{'case':9} {'engine':8} {'disks':>6} {'until s':>7} {'CPU s':>8} {'worst':>7} {'99 %':>7}"
        f" {'worst':>7} {'99 %':>7} {'residual':>9}"
    )
    for name in arguments or CASES:
        seconds = [measure(one, engine) for one in SEVERAL.get(name, [name])]
        if name in ("wide", "deep"):
            power = log(seconds[-1] / seconds[0]) / log(NUMBERS[-1] / NUMBERS[0])
            print(f"{name:9} seconds grow with the number to the power of {power:.2f}")


if __name__ == "__main__":
    main(sys.argv[1:])
