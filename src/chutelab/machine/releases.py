"""Where, when and how fast each particle of the streams starts; the core draws it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import acos, degrees
from typing import Any

import numpy as np

from chutelab.core import INTEGER, Module, constants, dtype
from chutelab.scene import Fault, Scene, SceneError
from chutelab.scene.variants import Family
from chutelab.util.arrays import RADIANS, Bools, Floats, Ints, Numbers, Watch, sin_cos
from chutelab.util.tables import number

LOOKS = 1_000_000
"""Particles and places that the core tries between two checks of the clock; 10 ms."""

DEEP = 0.01
"""Share of the radius. Riders of one layer that touch, 2 r apart along the arc, are nearer on the
chord by r³/(3 ρ²), less than this if r < ρ/6."""


@dataclass(frozen=True, eq=False)
class Releases:
    """Start of each particle, read-only arrays of N rows."""

    t: Floats  # s, ascending
    # (N, 2), m and m/s
    position: Floats
    velocity: Floats
    omega: Floats  # rad/s
    angle: Floats  # rad; angle of boxes and polygons from their shape as written
    # rides the incoming belt by adhesion, at radius R + r + h round the pulley, until separation
    carried: Bools
    stream: Ints  # its number: particles of the first stream come first, then those of the next
    kind: Ints  # its row in the machine's tables of pairs; in a family each has its own row
    # (N, 4), m: left, bottom, right and top of the box outside of which it has left the scene. With
    # gravity only the bottom is finite, as particles that fly up come back. The box holds releases,
    # too, since particles may be released below all surfaces, or hang on a string. Where particles
    # do not meet, it holds only the particle's own release, so each does the same with others
    exit_box: Floats

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.setflags(write=False)


@dataclass(frozen=True)
class Squeeze:
    """Particles riding by adhesion that overlap round the pulley.

    All layers of a bed have the belt's speed, the lower ones on smaller circles. If they do not
    leave at the top of the pulley, they turn ahead, into the layers above them.
    """

    particles: int  # number of particles that overlap another by more than `DEEP`
    deepest: float  # largest overlap, m
    grip: float  # v²/(g ρ) of the highest one: it leaves the pulley where cos φ has this value

    def __str__(self) -> str:
        return (
            f"{self.particles} particles ride into others round the pulley,"
            f" {number(self.deepest)} m deep at most: adhesion carries all layers at one speed, the"
            f" lower ones on smaller circles, and v²/(g rho) = {self.grip:.3g} keeps the highest"
            f" there for {degrees(acos(self.grip)):.3g}°, past the top"
        )


def squeeze(
    scene: Scene, t: Floats, position: Floats, radius: Numbers | None = None
) -> Squeeze | None:
    """Return the particles that ride into others; None if none does.

    They are released at `t` (N,), s, and `position` (N, 2), m, as planned or in a run. Their radii,
    m, are by default that of the first kind of particles. A ride that ends early counts as if it
    went on. Two that would overlap already on the belt do not count, since one of them waits.
    """
    belt = scene.incoming
    if belt is None or not len(t) or not isinstance(belt.friction, str):
        return None
    if not scene.crowded or belt.speed == 0.0 or scene.gravity == 0.0:
        return None
    (sine, cosine), (x, y) = sin_cos(belt.incline_deg * RADIANS), position.T
    along, rho = x * cosine + y * sine, y * cosine - x * sine
    top = t - along / belt.speed
    grip = belt.speed**2 / (scene.gravity * rho)
    turn = np.arccos(np.minimum(grip, 1.0)) + np.radians(belt.incline_deg)
    turn = np.where(grip >= cosine, 0.0, turn)
    order = np.argsort(top)
    top, rho = top[order], rho[order]
    radii = np.broadcast_to(scene.particle.radius if radius is None else radius, t.shape)[order]
    leaves = top + rho * turn[order] / belt.speed
    depth = np.zeros(len(top))
    for lag in range(1, len(top)):
        # Both are on the pulley from when the later one reaches its top until one leaves.
        begin, end = top[lag:], np.minimum(leaves[:-lag], leaves[lag:])
        if (begin >= leaves[:-lag]).all():
            break
        rho_a, rho_b, reach = rho[:-lag], rho[lag:], radii[:-lag] + radii[lag:]
        waits_for = np.hypot(belt.speed * (begin - top[:-lag]), rho_a - rho_b) < reach
        angle = belt.speed * np.array(
            [(now - top[:-lag]) / rho_a - (now - begin) / rho_b for now in (begin, end)]
        )
        angle = np.where(angle[1] > 0.0, angle.min(axis=0), 0.0)
        apart = np.hypot(rho_a - rho_b, 2.0 * np.sqrt(rho_a * rho_b) * np.sin(0.5 * angle))
        found = np.where((begin < end) & ~waits_for, reach - apart, 0.0)
        depth[:-lag] = np.maximum(depth[:-lag], found)
        depth[lag:] = np.maximum(depth[lag:], found)
    particles = int(np.count_nonzero(depth > DEEP * radii))
    return Squeeze(particles, float(depth.max()), float(grip.min())) if particles else None


class RefusedError(SceneError):
    """Scenes of a family that contradict themselves; its faults are those of the first one.

    Parameters
    ----------
    source : str
        What messages call the scenes.
    members : mapping of int to Fault
        What is wrong with each, by their numbers; a scene that is no family is number 0.
    """

    def __init__(self, source: str, members: Mapping[int, Fault]) -> None:
        super().__init__(source, [members[min(members)]])
        self.members = dict(members)


def draw(module: Module, scenes: Scene | Family, watch: Watch) -> tuple[Releases, Floats | None]:
    """Have the core draw the releases of a scene; the same scene and seed give the same numbers.

    All streams are drawn, one after the other, in a module in which the scene's surfaces are built,
    see `machine.builder.lay`; in a family scene by scene. Also returned are the radii, (N,), m, or
    None if all particles are alike. `watch` is called now and then; an exception that it raises
    ends the drawing.

    Particles that meet start where no other of their stream is, as far as the bed has room; the
    engine delays the others until their place is free. None starts inside a surface; one that does
    by rounding is moved out.

    Raises a `RefusedError` if a box has not room for all, a particle would start inside a surface,
    or a belt that grips by adhesion does not allow its speed.
    """
    scene, family = scenes.scene, scenes if isinstance(scenes, Family) else None
    counts = [stream.count for stream in scene.streams]
    corners = [corner for kind in scene.particles for corner in kind.outline]
    members, streams = module.structs["Plan"].members, len(counts)
    drawing = module.structs["Drawing"]
    if corners:
        module.fill("Drawing", corners=np.array(corners).reshape(-1))
    while drawing.member < members:
        watch()
        module.call("draw")

    def array(name: str, kind: np.dtype[Any], each: int) -> Any:
        return module.array(name, kind, members * each, of="Drawing")

    refused = array("refusals", dtype("Refusal"), 1)
    if np.count_nonzero(refused["why"]):
        which = refused["why"].nonzero()[0].tolist()
        one_each = scenes if family is None else family.firsts
        raise RefusedError(scene.source, {n: _fault(one_each, refused[n], n) for n in which})
    starts = array("starts", dtype("Start"), drawing.count)
    carried = array("carried", INTEGER, streams).astype(bool)
    releases = Releases(
        t=starts["t"].copy(),
        position=starts["position"].copy(),
        velocity=starts["velocity"].copy(),
        omega=starts["omega"].copy(),
        angle=starts["angle"].copy(),
        carried=carried.repeat(counts * members),
        stream=np.array([*range(streams)] * members).repeat(counts * members),
        kind=np.array(scene.kinds).repeat(counts) if family is None else np.arange(len(family)),
        exit_box=starts["exit_box"].copy(),
    )
    radius = starts["radius"].copy()
    alike = len(radius) == 1 if family is None else family.each == 1
    alike = alike or bool((radius == radius[0]).all())
    return releases, None if alike else radius


def _fault(scenes: Scene | Family, refusal: Any, member: int) -> Fault:
    """Return in words why the releases of a scene, or of one of a family, cannot be drawn."""
    scene, why, reasons = scenes.scene, refusal["why"], constants("Refused")
    which, particle = refusal["stream"].item(), refusal["particle"].item()
    several = f"[{which}]" * (len(scene.streams) > 1)
    stream, reach = scene.streams[which], refusal["reach"].item()
    advice = (
        'incoming.friction = "adhesion" releases every particle at incoming.speed; give a Coulomb'
    )

    def own(key: str) -> Any:
        """Return a member's value of a key of the stream, points and vectors as lists."""
        found = scenes.value(stream, key)
        if found is None:
            return None
        numbers = [np.ravel(one) for one in (found if isinstance(found, tuple) else [found])]
        each = [one[member % len(one)].item() for one in numbers]
        return each if isinstance(found, tuple) else each[0]

    if why == reasons["SPREAD_ADHERES"]:
        allowed = f"{advice} coefficient, or speed_spread = 0"
        return Fault(f"stream{several}.speed_spread", own("speed_spread"), allowed)
    if why == reasons["VELOCITY_ADHERES"]:
        allowed = f"{advice} coefficient, or leave the velocity out"
        return Fault(f"stream{several}.velocity", own("velocity"), allowed)
    if why == reasons["SPIN_ADHERES"]:
        allowed = f"{advice} coefficient, or omega = 0"
        return Fault(f"stream{several}.omega", own("omega"), allowed)
    if why == reasons["BOX_FULL"]:
        fewer = f", or stream{several}.count = {particle} at most" if particle else ""
        allowed = (
            f"a larger box{fewer}: {particle or 'none'} of radius {reach:.4g} m fit into this one,"
            " away from all surfaces"
        )
        value = [list(corner) for corner in stream.fill or ()]
        return Fault(f"stream{several}.fill", value, allowed)
    key, name = f"stream{several}.at", scene.surfaces[refusal["surface"]]
    allowed = (
        f"at least {reach:g} m from {name}: particle {particle} would start"
        f" {refusal['distance']:.6g} m from it, inside; move {key}, or the surface"
    )
    return Fault(key, own("at"), allowed)
