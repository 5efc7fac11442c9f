"""`build`: a scene, or a family of them, as a machine.

The core takes a scene as one row of numbers, a family as many rows, and builds the surfaces. Keys
of the scene's tables have the same names in `layout.h`; NaN stands for a key that is not given. The
place where the nominal particle (no spread, lowest layer) meets the unbounded line of the plate
gives the height of the outgoing belt, and that the lower end of the plate. A release that overlaps
a surface is refused, or moved out if it does by rounding only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import chain
from math import ceil, inf, nan, pi, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.core import REAL, Module, borrow, constants, dtype, give_back
from chutelab.machine.parts import (
    Caution,
    Joint,
    Machine,
    Mover,
    Particle,
    Pulley,
    Trigger,
    pace_of,
)
from chutelab.machine.releases import LOOKS, RefusedError, draw
from chutelab.machine.shapes import KINDS, Pieces
from chutelab.scene import Fault, Plate, Scene
from chutelab.scene.look import JOINTS
from chutelab.scene.units import polygon_moment
from chutelab.scene.variants import Family
from chutelab.util.arrays import RADIANS, Floats, Ints, Numbers, Watch, hypot, unwatched

WORDS = {
    "adhesion": inf, "impact": 0.0, "top": 1.0,
    "up": 1.0, "down": -1.0, "right": 2.0, "left": -2.0, "out": 3.0, "in": -3.0,
}  # fmt: skip
"""Numbers for values in words; `drop_from` and `passes` as in layout.h."""

PASSES = -1.0
"""Restitution that marks two kinds that pass through each other; see `meet` in the core's
grid.c."""

LACKS = ("length", "stiffness", "damper")
"""Keys that some joints lack."""

MANY = 100
"""Number of particles from which on a crowd without ``run.dt`` takes longer steps ..."""

MOST_STEP = 2e-3
"""... up to this, s on Earth, in the contact engine."""

WORD = 2**32
"""Seeds are passed as two numbers below this."""


def row(scenes: Scene | Family, friction: Numbers) -> list[Numbers]:
    """Return all numbers of a scene; in a family, varied ones are arrays (N,).

    `friction` is that of the nominal particle on the incoming belt, inf with adhesion.
    """
    scene, value, found = scenes.scene, scenes.value, list[Any]()

    def add(struct: str, table: Any, **own: Any) -> None:
        fields: Any = dtype(struct).fields
        for key, (kind, _) in fields.items():
            name, width = "from_" if key == "from" else key, kind.itemsize // 8
            one = own[name] if name in own else value(table, name)
            if type(one) is float:
                found.append(one)
            elif one is None:
                found.extend([nan] * width)
            elif isinstance(one, tuple):
                flat = [*chain(*one)] if one and isinstance(one[0], tuple) else one
                found.extend([*flat, *[nan] * (width - len(flat))])
            else:
                found.append(WORDS[one] if isinstance(one, str) else one)

    add("SceneKeys", scene)
    for kind in scene.particles:
        add("ParticleKeys", kind, corners=len(kind.outline))
    for stream, number in zip(scene.streams, scene.kinds, strict=True):
        add("StreamKeys", stream, kind=number, seed=(stream.seed % WORD, stream.seed // WORD))
    if scene.incoming is not None:
        adheres = isinstance(value(scene.incoming, "friction"), str)
        add("IncomingKeys", scene.incoming, friction=friction, adheres=adheres)
    for plate in scene.plates:
        add("PlateKeys", plate)
    if scene.outgoing is not None:
        add("OutgoingKeys", scene.outgoing)
    for conveyor in scene.conveyor:
        add("ConveyorKeys", conveyor)
    for surface in scene.surface:
        # What waits for another surface to be touched is not there at first.
        waits = {"closes_at": inf} if surface.closes_when else {}
        add("SurfaceKeys", surface, corners=len(surface.points or ()), **waits)
    for table, joint in scene.joints:
        lacks = {key: None for key in LACKS if not hasattr(joint, key)}
        begin = joint.from_ or getattr(joint, "over", None)
        add("JointKeys", joint, kind=JOINTS.index(table), from_=begin, **lacks)
    for name, one in scene.movers.items():
        shake, travel, motor = one.shake, one.travel, one.motor
        place = {} if one.hinge in (None, "pivot") else {"pivot": value(one, "hinge")}
        add(
            "MoverKeys", one, surface=scene.surfaces.index(name),
            by=None if shake is None else value(shake, "by"),
            frequency=None if shake is None else value(shake, "frequency"),
            phase_deg=None if shake is None else value(shake, "phase_deg"),
            to=None if travel is None else value(travel, "to"),
            at=None if travel is None else value(travel, "at"),
            **{"in": None if travel is None else value(travel, "in_")},
            hangs=one.hinge is not None,
            speed_deg=None if motor is None else value(motor, "speed_deg"),
            torque=None if motor is None else value(motor, "torque"),
            **place,
        )  # fmt: skip
    return [
        *found,
        *chain(*(point for one in scene.surface for point in value(one, "points") or ())),
    ]


def counts(scene: Scene) -> dict[str, int]:
    """Return how many tables of each kind a scene has, as the core's plan counts them."""
    return {
        "particles": len(scene.particles), "streams": len(scene.streams),
        "incoming": scene.incoming is not None, "outgoing": scene.outgoing is not None,
        "plates": len(scene.plates), "conveyors": len(scene.conveyor),
        "surfaces": len(scene.surface), "joints": len(scene.joints),
        "moving": len(scene.movers),
    }  # fmt: skip


Told = tuple[dict[str, int], Floats]


def told(scene: Scene) -> Told:
    """Return the data that the core needs to build and run the machine of a scene.

    These are the sizes of the plan, and its row with its terms, see `Plan` in layout.h. A scene
    never changes, so they are computed once.
    """
    found: Told | None = scene._told
    if found is None:
        names, kinds, meeting = scene.surfaces, range(len(scene.particles)), scene.meetings()
        masses, inertias = bodies(scene)
        rolling = [kind.rolling_friction for kind in scene.particles]
        falls = [kind.falls for kind in scene.particles]
        until = scene.run.until
        terms = [scene.run.max_time, nan if isinstance(until, str) else until]
        for kind in kinds:
            terms += masses[kind], inertias[kind], rolling[kind]
        for kind in kinds:
            for other in (*kinds, *names):
                bounces, grips = meeting(kind, other)
                # Adhesion is friction without a bound.
                grips = inf if isinstance(grips, str) else grips
                if not isinstance(other, str) and scene.passes(kind, other):
                    bounces = PASSES
                two = (kind,) if isinstance(other, str) else (kind, other)
                terms += bounces, grips, max(rolling[k] for k in two), max(falls[k] for k in two)
                terms.append(scene.cohesion(kind, other))
        grip = meeting(scene.kinds[0], names[0])[1] if scene.incoming is not None else inf
        line = row(scene, grip)
        sizes = {
            "members": 1, "width": len(line), "term_width": len(terms), "owners": len(names),
        }  # fmt: skip
        numbers = np.array([*line, *terms], dtype=REAL)
        numbers.flags.writeable = False
        found = scene._told = sizes | counts(scene), numbers
    return found


def _terms(scene: Scene) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return what is `told` as rows of the core's `BodyKeys`, (K,), and `Pair`, (K, K + S)."""
    sizes, numbers = told(scene)
    body, pair = dtype("BodyKeys"), dtype("Pair")
    own = numbers[sizes["width"] :].view(np.uint8)[dtype("RunKeys").itemsize :]
    split = sizes["particles"] * body.itemsize
    return own[:split].view(body), own[split:].view(pair).reshape(sizes["particles"], -1)


def hand_over(module: Module, scene: Scene, more: bytes = b"") -> None:
    """Pass a scene to the core, which will build it; with numbers that are to end its terms."""
    sizes, numbers = told(scene)
    plan = module.structs["Plan"]
    for name, size in sizes.items():
        setattr(plan, name, size)
    if more:
        numbers = np.frombuffer(numbers.tobytes() + more, REAL)
        plan.term_width = len(numbers) - plan.width
    if not module.begin_with(numbers):
        module.work("lay_out_plan")
        module.fill("Plan", rows=numbers)


def lay(
    module: Module, scenes: Scene | Family, friction: Numbers
) -> tuple[dict[str, NDArray[Any]], NDArray[Any], tuple[Mover, ...]]:
    """Have the core build the surfaces of a scene, or of all N scenes of a family.

    If no corners have to be told before, it also draws the releases, or begins to.

    Returns
    -------
    parts : dict of ndarray, (S,) or (N, S)
        Rows of each of `KINDS`, as in layout.h, by the part of a machine.
    nominal : ndarray, () or (N,)
        As `Nominal`.
    movers : tuple of Mover
        How surfaces move; in a family none does.
    """
    scene, plan = scenes.scene, module.structs["Plan"]
    shape = (len(scenes),) if isinstance(scenes, Family) else ()
    every = prod(shape)
    if shape:
        numbers = row(scenes, friction)
        plan.members, plan.width = every, len(numbers)
        for name, count in counts(scene).items():
            setattr(plan, name, count)
        module.work("lay_out_plan")
        rows = module.array("rows", REAL, every * len(numbers), of="Plan").reshape(every, -1)
        varies = [n for n, number in enumerate(numbers) if isinstance(number, np.ndarray)]
        rows[:] = [nan if n in varies else number for n, number in enumerate(numbers)]
        for column in varies:
            rows[:, column] = numbers[column]
    else:
        hand_over(module, scene)
    module.structs["Drawing"].looks = LOOKS
    module.work("build")
    plan = module.structs["Plan"]

    def found(name: str, kind: str, *count: int) -> NDArray[Any]:
        rows = module.array(name, dtype(kind), every * prod(count), of="Plan")
        return rows.copy().reshape((*shape, *count))

    movers = tuple[Mover, ...]()
    if scene.movers:
        rows = module.array("movers", dtype("Mover"), len(scene.movers), of="Plan")
        movers = tuple(map(Mover.of, rows))
    parts = {
        f"{kind.lower()}s": found(f"{kind.lower()}s", kind, getattr(plan, f"{kind.lower()}_count"))
        for kind in KINDS
    }
    return parts, found("nominal", "Nominal"), movers


def build(scenes: Scene | Family, watch: Watch = unwatched) -> Machine:
    """Resolve a validated scene, or a family of them.

    Parameters
    ----------
    scenes : Scene or Family
        In a family each scene is resolved as if alone; the machine has the particles of all, each
        with its own surfaces.
    watch : callable, optional
        Called now and then while particles get their places, which may take long; an exception that
        it raises ends the building.

    Raises
    ------
    RefusedError
        If the geometry contradicts itself: the nominal flight misses the plate whose impact should
        place the outgoing belt, the impact lies off the finite plate, or a particle starts inside a
        surface.
    """
    family = scenes if isinstance(scenes, Family) else None
    scene, value, names = scenes.scene, scenes.value, scenes.scene.surfaces
    met: Met
    if family is None:
        weights, pairs = _terms(scene)
        masses, inertias = weights["mass"].tolist(), weights["inertia"].tolist()
        kinds = len(weights)
        met = [[pair[:2] for pair in each] for each in zip(*pairs[:, kinds:].tolist(), strict=True)]
        two = pairs[:, :kinds]
        rolling, falls = weights["rolling"].copy(), two["falls"].diagonal().copy()
    else:
        meeting, kinds, (masses, inertias) = scene.meetings(value), 1, bodies(family)
        met = [[meeting(0, name)] for name in names]
        # Adhesion is friction without a bound.
        met = [[(e, inf if isinstance(mu, str) else mu)] for [(e, mu)] in met]
        grip = meeting(scene.kinds[0], names[0])[1] if scene.incoming is not None else inf
        # Particles of a family never meet each other.
        pairs = two = np.zeros((1, 1), dtype("Pair"))
        rolling = np.array([value(kind, "rolling_friction") for kind in scene.particles])
        speeds = [value(kind, "restitution_speed") for kind in scene.particles]
        falls = 1.0 / np.array([inf if one is None else one for one in speeds])
    module = borrow()
    try:
        if family is None:
            rows, nominal, movers = lay(module, scenes, inf)
        else:
            firsts = np.ravel(grip)[:: family.each] if np.ndim(grip) else grip
            rows, nominal, movers = lay(module, family.firsts, firsts)
        _weigh_hinges(scene, movers)
        warnings = _judged(scenes if family is None else family.firsts, nominal)
        releases, radius = draw(module, scenes, watch)
    finally:
        give_back(module)
    each = 1 if family is None else family.each
    parts: dict[str, Any] = {
        name: _pieces(kind, own, met, kinds, each) if own.size else _no_pieces(kind, kinds)
        for (name, own), kind in zip(rows.items(), KINDS.values(), strict=True)
    }
    belt = scene.incoming
    until: Any = value(scene.run, "until")
    particle = _particle(scenes, masses, inertias, releases.kind, radius)
    latest: Any = releases.t.max().item()
    if family is not None:
        latest = releases.t.reshape(-1, family.each).max(axis=1).repeat(family.each)
    bound = latest + value(scene.run, "max_time")
    pulley = None
    if belt is not None:
        bounces, grips = zip(*met[0], strict=True)
        pulley = Pulley(
            radius=value(belt, "pulley_radius"),
            speed=value(belt, "speed"),
            friction=np.array(grips) if len(grips) > 1 else grips[0],
            restitution=np.array(bounces) if len(grips) > 1 else bounces[0],
            surface=0,
            incline=value(belt, "incline_deg") * RADIANS,
        )
    joints = []
    for table, one in scene.joints if family is None else ():
        own = {key: getattr(one, key) for key in LACKS[1:] if hasattr(one, key)}
        begin, second = one.from_ or getattr(one, "over", None), one.other
        joint = Joint(table, one.particle, 0.0, begin, -1 if second is None else second, **own)
        rest = getattr(one, "length", None) or joint.reach(releases.position)
        if rest < NEAR and table in ("string", "rod"):
            key, n = "from" if one.from_ else "other", getattr(scene, table).index(one)
            fault = Fault(f"{table}[{n}].{key}", one.from_ or one.other, ONE_PLACE)
            raise RefusedError(scene.source, {0: fault})
        joints.append(replace(joint, length=rest))
    triggers = tuple(
        Trigger(names.index(name), doing, names.index(by)) for name, doing, by in scene.triggers
    )
    machine = Machine(
        **(_keys(scenes) if family is not None or scene._ahead is None else scene._ahead[0]),
        gravity=value(scene, "gravity"),
        particle=particle,
        **parts,
        pulley=pulley,
        releases=releases,
        end_time=bound if isinstance(until, str) else np.minimum(bound, until),
        pair_restitution=two["restitution"].copy(),
        pair_friction=two["friction"].copy(),
        rolling=rolling,
        falls=falls,
        cohesion=pairs["cohesion"].copy(),
        joints=tuple(joints),
        movers=movers,
        triggers=triggers,
        streams=tuple(str(stream.name) for stream in scene.streams),
        plate_warnings=warnings,
    )
    _weigh_in_air(machine)
    return machine.when(np.full(len(triggers), inf)) if triggers else machine


def chooses(scene: Scene) -> bool:
    """Return whether the contact engine chooses its steps: in a large crowd without ``run.dt``.

    How well joints and hinges keep their energy depends on the step.
    """
    given = "dt" in scene.run.model_fields_set or scene.joints or scene.hinges
    return scene.crowded and scene.count >= MANY and not given


def ahead(scene: Scene) -> Machine:
    """Return the machine of a scene; it is built when more than its keys is needed."""
    if (known := scene._ahead) is None:
        if scene.hinges or scene.triggers or scene.air_density:
            # Hinges, and what air slows down, can be checked only after they are weighed.
            return build(scene)
        without = {name: () for name in ("joints", "movers") if not getattr(scene, name)}
        only = {"build": build, "count": scene.count, "triggers": (), **without}
        known = scene._ahead = _keys(scene), only
    machine = object.__new__(Machine)
    for part in known:
        vars(machine).update(part)
    return machine


def _keys(scenes: Scene | Family) -> dict[str, Any]:
    """Return the parts of a machine that follow from keys alone."""
    scene, value, names = scenes.scene, scenes.value, scenes.scene.surfaces
    until, gravity = value(scene.run, "until"), value(scene, "gravity")
    return {
        "scenes": scenes,
        "surfaces": names,
        "landing": names.index("outgoing") if "outgoing" in names else -1,
        "until": until if isinstance(until, str) else "time",
        "dt": MOST_STEP / pace_of(gravity) if chooses(scene) else value(scene.run, "dt"),
        "air": value(scene, "air_density"),
        "align": scene.run.align and not scene.air_density,
        "interact": scene.crowded,
        "engine": scene.run.engine,
        "outlines": _outlines(scene),
    }


def _outlines(scene: Scene) -> tuple[Floats | None, ...]:
    return tuple(np.array(kind.outline) if kind.outline else None for kind in scene.particles)


Met = Sequence[Sequence[tuple[Any, Any]]]
"""Restitution and friction of each surface with each kind of particles; numbers or arrays (N,)."""


def _pieces(kind: type[Pieces], rows: NDArray[Any], met: Met, kinds: int, each: int) -> Pieces:
    """Return one kind of pieces from their rows, (S,) or in a family (V, S), `each` times."""
    shape = tuple(count * each for count in rows.shape[:-1])
    given = rows.dtype.names or ()
    own = {name: rows[name] for name in kind.__dataclass_fields__ if name in given}
    if rows.ndim > 1:
        # Pieces of all members lie side by side and belong to the same surfaces.
        own = {
            name: array[0].copy() if name == "surface" else array.T.repeat(each, axis=-1).T
            for name, array in own.items()
        }
    surface = own["surface"].astype(np.int64)
    values = np.empty((2, len(met), kinds, *shape))
    for number, pairs in enumerate(met):
        for n, pair in enumerate(pairs):
            values[0, number, n], values[1, number, n] = pair
    values = values[:, surface]
    restitution, friction = values[:, :, 0] if kinds == 1 else values
    return kind(**own | {"surface": surface}, restitution=restitution.T, friction=friction.T)


@cache
def _no_pieces(kind: type[Pieces], kinds: int) -> Pieces:
    """Return no pieces of a kind; there is nothing per scene then."""
    return _pieces(kind, np.empty(0, dtype(kind.__name__.removesuffix("s"))), (), kinds, 1)


def bodies(scenes: Scene | Family) -> tuple[list[Any], list[Any]]:
    """Return mass (kg) and moment of inertia (kg m²) of each kind of particles, of mean radius."""
    masses, inertias = list[Any](), list[Any]()
    for one in scenes.scene.particles:
        mass, size = scenes.value(one, "mass"), scenes.value(one, "radius")
        turning = one.moment * mass * (size * size)
        if one.outline:
            turning = mass * polygon_moment(one.outline) if one.spin else 0.0
        masses.append(mass)
        inertias.append(turning)
    return masses, inertias


def _particle(
    scenes: Scene | Family,
    masses: list[Any],
    inertias: list[Any],
    kind: Ints,
    radius: Floats | None,
) -> Particle:
    """Return the particles: numbers if all are alike, else arrays (N,)."""
    scene = scenes.scene
    nominal: Any
    if isinstance(scenes, Family):
        nominal, first = scenes.value(scene.particle, "radius"), scene.kinds[0]
        mass, inertia = masses[first], inertias[first]
        if radius is None:
            return Particle(nominal, mass, inertia)
    elif radius is None and (len(masses) == 1 or len({*zip(masses, inertias, strict=True)}) == 1):
        return Particle(scene.particle.radius, masses[0], inertias[0])
    else:
        nominal = np.array([one.radius for one in scene.particles])[kind]
        mass, inertia = np.array(masses)[kind], np.array(inertias)[kind]
    radius = nominal if radius is None else radius
    # A mass point is as heavy as it is given.
    sized = np.not_equal(nominal, 0.0)
    size = np.divide(radius, nominal, out=np.ones(np.shape(radius)), where=sized)
    # Powers by libraries differ in the last bit.
    square = size * size
    cube = square * size
    return Particle(radius, mass * cube, inertia * (cube * square))


NEAR = 1e-9
"""m; least length of a string or rod."""

ONE_PLACE = "another place than the particle's at the release; a [[pin]] joins what is in one place"

SWIFTEST = 1e5
"""rad/s; the shortest time of a hinge, and that in which air stops a particle, is at least its
inverse, as steps have to be shorter."""

VISCOSITY = 1.8e-5
"""Pa s; of air at 20 °C."""


def _weigh_hinges(scene: Scene, movers: tuple[Mover, ...]) -> None:
    """Raise if a hinged surface has an impossible inertia, or is too stiff to be run."""
    for mover in movers:
        if (hinge := mover.hinge) is None:
            continue
        name = scene.surfaces[mover.surface]
        least = hypot(*hinge.moment) ** 2 / hinge.mass if hinge.mass > 0.0 else 0.0
        stiff = max(hinge.spring / SWIFTEST**2, hinge.damper / SWIFTEST)
        if hinge.inertia < (1.0 - 1e-9) * least:
            text = f"at least {least:.6g} kg m2, mass times the square of its centre's distance"
            fault = Fault(f"{name}.inertia", hinge.inertia, text)
        elif hinge.inertia < stiff:
            text = f"at least {stiff:.6g} kg m2 with this spring and damper"
            fault = Fault(f"{name}.inertia", hinge.inertia, f"{text}: it swings in less than 10 us")
        else:
            continue
        raise RefusedError(scene.source, {0: fault})


def _weigh_in_air(machine: Machine) -> None:
    """Raise if air stops a slow particle (Stokes) sooner than steps can follow."""
    if not np.any(machine.air):
        return
    least = 6.0 * pi * VISCOSITY * machine.broad / SWIFTEST
    mass = np.broadcast_to(machine.particle.mass, machine.count)
    if (mass >= least).all():
        return
    i = int((least / mass).argmax())
    kind = f"[{machine.releases.kind[i]}]" if len(machine.scene.particles) > 1 else ""
    text = f"at least {least[i]:.3g} kg with air_density: air stops it in less than 10 us"
    fault = Fault(f"particle{kind}.mass", float(mass[i]), text)
    raise RefusedError(machine.scene.source, {0: fault})


def _judged(scenes: Scene | Family, nominal: NDArray[Any]) -> tuple[Caution, ...]:
    """Return cautions about the plate; raise if the geometry contradicts itself."""
    scene, members = scenes.scene, nominal.reshape(-1)
    plate = scene.plate
    faults = {
        n: _fault(scenes, plate, members[n], n)
        for n in members["contradiction"].nonzero()[0].tolist()
    }
    if faults:
        raise RefusedError(scene.source, faults)
    if plate is None:
        return ()
    found = []
    if np.count_nonzero(np.isnan(members["hit"])):
        found.append(Caution("plate"))
    off = members["off"].nonzero()[0]
    if len(off):
        found.append(Caution("plate", hit=members["along"][off[0]].item()))
    return tuple(found)


def _fault(scenes: Scene | Family, plate: Plate | None, nominal: Any, member: int) -> Fault:
    """Return in words what is wrong with the geometry of a scene, or a member of a family."""
    kinds = constants("Contradiction")
    if nominal["contradiction"] == kinds["NO_IMPACT"]:
        text = (
            "the nominal particle never meets the plate, so there is no impact to measure from;"
            ' set outgoing.drop_from = "top"'
        )
        return Fault("outgoing.drop_from", "impact", text)
    assert plate is not None
    above = np.ravel(scenes.value(plate, "above"))
    above = above[member if len(above) > 1 else 0].item()
    if nominal["contradiction"] == kinds["NO_LENGTH"]:
        return Fault("plate.above", above, "above + below must be more than 0 m")
    hit = nominal["along"].item()
    allowed = (
        f"{Caution('plate', hit=hit).text}: lengthen it to at least"
        f' {ceil(1e4 * abs(hit)) / 1e4:g} m, or set outgoing.drop_from = "top"'
    )
    if nominal["contradiction"] == kinds["HIT_ABOVE"]:
        return Fault("plate.above", above, allowed)
    return Fault("plate.below", nominal["below"].item(), allowed)
