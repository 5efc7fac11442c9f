"""A thousand disks that pour into a box for 2 s, beside engines of games: time and overlap.

    OMP_NUM_THREADS=1 NODE_PATH=FOLDER python benchmarks/others.py

Box2D is what `pip install pyb2d3` brings, Rapier `@dimforge/rapier2d-compat` (npm) in FOLDER, for
node; what is missing is left out. Each runs at 1/60, 1/240 and 1/1000 s, on one core, from the same
releases; it only steps: seconds are processor time of the steps, of Chutelab of the whole
`simulate`, with recording, ledger and laws: the least and the most of three turns, as other
programs slow a turn. Box2D and Rapier are made for things of a metre and have a slop of 5 mm: they
get the scene enlarged until a disk is 1 m across, and gravity with it. Their contacts are springs
of 30 Hz, under which a heap of disks of 4 mm is pressed flat: here they are as stiff as Box2D
allows, 1 / step. All else is their default; Box2D takes 4 substeps. Overlaps are those of pairs
every 5 ms, or at each longer step, in % of the radius.
"""

import json
import subprocess
import sys
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

from chutelab import scene
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from crowds import LOOK, bare, box, overlaps, pair_overlaps, told
from references import Depth

END = 2.0
"""s."""

STEPS = (1.0 / 60.0, 1.0 / 240.0, 1e-3)
"""s."""

TURNS = 3

POURED = box(0.5, 1000, 2.0)
POURED["particle"]["spin"] = True
POURED["stream"] |= {"restitution": 0.5, "friction": 0.3}
POURED["run"] = {"until": END}


def crowd_of(machine, step):
    """Return the machine as both others take it: lengths in diameters of a disk."""
    start, s, p = machine.releases, machine.segments, machine.particle
    times = 0.5 / p.radius
    order = np.argsort(start.t, kind="stable")
    rows = np.column_stack([start.t, times * start.position, times * start.velocity])[order]
    return {
        "step": step, "end": END, "every": max(1, round(LOOK / step)), "radius": 0.5,
        "enlarged": float(times), "mass": float(p.mass), "gravity": times * machine.gravity,
        "disks": rows.tolist(),
        "segments": (times * np.stack([s.start, s.end], axis=1)).tolist(),
        "restitution": float(machine.pair_restitution[0, 0]),
        "friction": float(machine.pair_friction[0, 0]),
    }  # fmt: skip


def box2d(crowd):
    """Return the seconds that Box2D's steps took, and places (k, 2) at each look."""
    import pyb2d3 as b2

    material = b2.surface_material(restitution=crowd["restitution"], friction=crowd["friction"])
    rim = b2.shape_def(material=material, density=crowd["mass"] / (np.pi * crowd["radius"] ** 2))
    world = b2.World(gravity=(0.0, -crowd["gravity"]), maximum_linear_speed=1e4)
    # Hz, of the critical damping, m/s; the latter two are the defaults, the last one enlarged.
    world.set_contact_tuning(1.0 / crowd["step"], 10.0, 3.0 * crowd["enlarged"])
    ground = world.create_static_body(position=(0.0, 0.0))
    for a, b in crowd["segments"]:
        ground.create_shape(b2.shape_def(material=material), b2.segment(tuple(a), tuple(b)))
    bodies, looks, seconds = [], [], 0.0
    for n in range(round(crowd["end"] / crowd["step"])):
        for _, x, y, vx, vy in crowd["disks"][len(bodies) :]:
            if crowd["disks"][len(bodies)][0] > n * crowd["step"]:
                break
            body = world.create_dynamic_body(position=(x, y), linear_velocity=(vx, vy))
            body.create_shape(rim, b2.circle(radius=crowd["radius"]))
            bodies.append(body)
        begin = process_time()
        world.step(crowd["step"], 4)
        seconds += process_time() - begin
        if n % crowd["every"] == 0:
            looks.append([(body.position.x, body.position.y) for body in bodies])
    return seconds, looks


def rapier(crowd):
    """Return the seconds that Rapier's steps took, and places (k, 2) at each look."""
    script = Path(__file__).with_name("rapier.cjs")
    done = subprocess.run(
        ["node", script], input=json.dumps(crowd), capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)
    return found["seconds"], found["looks"]


def chutelab(drawn, _):
    """Return the seconds of the whole `simulate`, and the overlaps of pairs."""
    begin = process_time()
    recording = simulate(drawn)
    return process_time() - begin, overlaps(recording, np.arange(0.0, END, LOOK))


def pymunk(drawn, step):
    return bare(build(drawn), END, looks=True, step=step)


def other(engine, drawn, step):
    crowd = crowd_of(build(drawn), step)
    seconds, looks = engine(crowd)
    places = (np.array(x).reshape(-1, 2) for x in looks)
    return seconds, Depth.of(pair_overlaps(one, crowd["radius"]) for one in places)


def main():
    drawn, found = scene.from_dict(POURED), {}
    engines = {
        "chutelab": chutelab, "pymunk": pymunk,
        "box2d": partial(other, box2d), "rapier": partial(other, rapier),
    }  # fmt: skip
    for _ in range(TURNS):
        for name, engine in engines.copy().items():
            for step in (drawn.run.dt,) if name == "chutelab" else STEPS:
                try:
                    found.setdefault((name, step), []).append(engine(drawn, step))
                except (ImportError, OSError, subprocess.CalledProcessError) as error:
                    print(f"{name:10} left out: {error}", file=sys.stderr)
                    del found[name, step], engines[name]
                    break
    print(f"{'':10} {'step, s':>8} {'CPU s':>7} {'most':>7} {'worst':>7} {'99 %':>7}")
    for (name, step), turns in found.items():
        seconds = [one for one, _ in turns]
        print(f"{name:10} {step:8.5f} {min(seconds):7.2f} {max(seconds):7.2f} {told(turns[0][1])}")


if __name__ == "__main__":
    main()
