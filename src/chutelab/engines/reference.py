"""A lone particle as an ordinary differential equation: an independent answer.

SciPy's DOP853 integrates flight, adhesion ride, sliding and rolling, one phase after the other. A
phase ends where a gap closes or a force changes its sign: each step's dense output is sampled, and
the root is found between two samples by Brent's method. Newton's restitution and Coulomb's friction
are written here again. It shares only the machine's arrays and the `Recording` with the rest of
Chutelab; it needs SciPy.

The events of `solve_ivp` do not suffice: it checks them only at the ends of its steps, which are as
long as a flight here, and it has no maximum step that depends on the speed.

It can miss a contact that begins and ends between two samples, less than `PIECE` apart. It refuses
what it cannot follow: rest in a corner, more than `MOST_PHASES` contacts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import hypot, inf, sqrt
from typing import Any

import numpy as np

from chutelab.machine import Machine
from chutelab.results.record import Record
from chutelab.results.recorder import Recorder
from chutelab.results.rows import Kind
from chutelab.util.arrays import Floats, Progress

Guard = Callable[[Floats], Floats]

RTOL, ATOL = 1e-13, 1e-15
"""Relative and absolute (SI) tolerance of a step: a little above what DOP853 accepts."""

PIECES = 16
"""Samples of a step at which gaps are checked."""

PIECE = 0.003
"""m between two samples, or the radius where that is more."""

ARC = 0.05
"""rad; longest step round a circle, so that the dense output of order 7 is good to 1e-15."""

TOUCH = 1e-12
"""m; nearer surfaces are touched. Positions are accurate to some 1e-15 m."""

REST = 1e-12
"""m/s; a slower rebound counts as none. The remaining bounces would last some 1e-13 s."""

SLIP = 1e-10
"""m/s; slower slip counts as none: the integrator keeps a slip of 0 to some 1e-13 of the speed."""

MOST_PHASES = 3000
"""Phases of a run: at ε = 0.99 a bouncing particle comes to rest after some 2,400."""

# Rows of the state: displacement since the phase began, velocity, spin, belt work, slip heat.
X, V, OMEGA, WORK, HEAT = slice(0, 2), slice(2, 4), 4, 5, 6


class UnableError(RuntimeError):
    """The reference cannot follow this particle; says why."""


@dataclass(frozen=True, eq=False)
class _Surface:
    """Both faces of a segment, without its ends; or a circle round which a centre can move.

    Circles (`reach` > 0) are the pulley, the ends of segments, and the path of a layer of a bed
    round the pulley. `left` is a segment's left normal; for an end the sum over the segments that
    meet there, which points to the middle of the rim between their left faces; 0 for the pulley.
    """

    place: Floats  # first end of a segment, centre of a circle, m
    tangent: Floats  # 0 of a circle
    left: Floats
    length: float
    reach: float  # includes r; 0 of a segment
    speed: float
    restitution: float
    friction: float
    owner: int  # index into `Machine.surfaces`
    # The segments that are tangent to a circle: which, where, and the direction from there.
    joined: tuple[tuple[int, Floats, Floats], ...] = ()

    @property
    def flat(self) -> bool:
        return self.reach == 0.0

    def distance(self, place: Floats) -> float:
        """Distance of a place (2,) from a segment's line, left positive, m."""
        return float(self.left @ (place - self.place))

    def foot(self, place: Floats) -> float:
        """Distance of the nearest point along a segment, m."""
        return float(self.tangent @ (place - self.place))

    def within(self, place: Floats) -> bool:
        """Whether a place lies beside a segment."""
        return -TOUCH <= self.foot(place) <= self.length + TOUCH


@dataclass(frozen=True)
class _Lasting:
    """A lasting contact: the thing touched, its speed, the sign of the slip (0: none)."""

    index: int
    normal: Floats  # where it begins
    belt: float
    slip: int = 0
    carried: bool = False


def run(machine: Machine, progress: Progress | None = None) -> Record:
    """Integrate the only particle of a machine; `progress` gets the share done and may end it.

    Returns
    -------
    Record
        With engine ``"dop853"``.

    Raises
    ------
    UnableError
        If it is not alone, SciPy is missing, or the equations here do not cover its motion.
    """
    try:
        from scipy.integrate import DOP853
        from scipy.optimize import brentq
    except ImportError:
        raise UnableError('SciPy is missing: pip install "chutelab[bench]"') from None
    return _Run(Recorder(machine), DOP853, brentq, progress).result()


def _plain(machine: Machine) -> Machine:
    """Return the machine as plain numbers for its only particle; refuse what is not covered."""
    if machine.count > 1:
        raise UnableError("it integrates one particle")
    kind = int(machine.releases.kind[0])
    parts, wheel = machine.segments, machine.pulley
    bent = any(len(part.surface) for part in machine.parts[1:])
    for there, what in (
        (machine.outlines[kind] is not None or machine.joints, "disks without joints"),
        (bent, "straight surfaces, and the drive pulley"),
        (np.isfinite([parts.appears, parts.vanishes]).any(), "surfaces that are always there"),
        (machine.movers, "surfaces that stay where they are"),
        (machine.scene.one_sided, "surfaces that are solid from both sides"),
        (machine.rolling[kind] > 0.0, "disks without rolling friction"),
        (machine.tilt, "gravity that is straight down"),
        (machine.air > 0.0, "flights without air"),
        (machine.scene.clings, "surfaces without cohesion"),
        (machine.falls[kind] > 0.0, "restitution that is the same at all speeds"),
    ):
        if there:
            raise UnableError(f"it integrates {what}, only")
    if len(machine.rolling) == 1:
        return machine
    pair = {key: getattr(parts, key)[kind] for key in ("restitution", "friction")}
    if wheel is not None:
        met: dict[str, Any] = {key: float(getattr(wheel, key)[kind]) for key in pair}
        wheel = replace(wheel, **met)
    segments = replace(parts, **pair)
    return replace(machine, segments=segments, pulley=wheel, particle=machine.particle.of(0))


class _Run:
    """One particle on its way; `base` is where the phase began, `t0` when."""

    def __init__(self, log: Recorder, solver: Any, root: Any, progress: Progress | None) -> None:
        machine = _plain(log.near)
        self.log = log
        self.machine, self.solver, self.root, self.progress = machine, solver, root, progress
        p, releases = machine.particle, machine.releases
        self.r, self.g = p.radius, -machine.gravity * machine.up
        # m r²/I: change of the rim's speed over the change of velocity by a tangential impulse.
        self.lever = p.mass * p.radius**2 / p.inertia if p.inertia else 0.0
        self.t0, self.base = float(releases.t[0]), releases.position[0].copy()
        self.state = np.zeros(7)
        self.state[V] = releases.velocity[0]
        self.state[OMEGA] = releases.omega[0]
        self.things = _surfaces(machine)
        # For each segment, whether its left face was struck last.
        self.sides: dict[int, bool] = {}
        self.steps, self.landed, self.reason = 0, False, ""

    def result(self) -> Record:
        self.tell(Kind.RELEASE, -1)
        self.knot()
        carried = self.machine.releases.carried[0]
        lasting = self.lasting(0, carried=True) if carried else self.contact()
        for _ in range(MOST_PHASES):
            if self.reason:
                break
            lasting = self.phase(lasting)
        else:
            raise UnableError(f"more than {MOST_PHASES} phases")
        self.log.ended[0] = ("time", "landed", "settled", "exit").index(self.reason)
        return self.log.finish(engine="dop853", steps=self.steps)

    # What touches.

    def normal(self, index: int) -> Floats:
        """Return the unit normal (2,) from a surface to the particle."""
        thing = self.things[index]
        if not thing.flat:
            away = self.base - thing.place
            return np.asarray(away / hypot(*away))
        # A mass point on a line is on neither side: take the face that it struck last.
        side = thing.distance(self.base) >= 0.0 if self.r > 0.0 else self.sides.get(index, True)
        return thing.left if side else -thing.left

    def lasting(self, index: int, *, carried: bool = False) -> _Lasting:
        """Return the contact with a thing in the present state, without slip."""
        thing, n = self.things[index], self.normal(index)
        belt = thing.speed if n @ thing.left >= 0.0 else -thing.speed
        return _Lasting(index, n, belt, carried=carried)

    def touching(self) -> dict[int, Floats]:
        """Return what the particle touches, with normals; not ends of touched segments."""
        found: dict[int, Floats] = {}
        for k, thing in enumerate(self.things):
            if thing.flat:
                touches = abs(abs(thing.distance(self.base)) - self.r) < TOUCH
                touches = touches and thing.within(self.base)
            else:
                touches = abs(hypot(*(self.base - thing.place)) - thing.reach) < TOUCH
                touches = touches and not any(j in found for j, _, _ in thing.joined)
            if touches:
                found[k] = self.normal(k)
        return found

    def contact(self) -> _Lasting | None:
        """Resolve impacts until nothing touched is approached; return the lasting contact."""
        v, touched = self.state[V], self.touching()
        for _ in range(MOST_PHASES):
            hit = next((k for k, n in touched.items() if v @ n < -REST), None)
            if hit is None:
                break
            self.blow(hit)
            if self.reason:
                return None
        else:
            raise UnableError("it rattles in a corner")
        pressed = []
        for k, n in touched.items():
            if v @ n < REST and self.load(self.lasting(k)) > 0.0:
                v -= (v @ n) * n
                pressed.append(k)
        if len(pressed) > 1:
            raise UnableError("it lies in a corner")
        return self.law(pressed[0], begins=True) if pressed else None

    def law(self, index: int, *, begins: bool = False) -> _Lasting | None:
        """Choose between slip and grip on what the particle lies on."""
        thing, v, on = self.things[index], self.state[V], self.lasting(index)
        n, load, _, slip, need = (part[..., 0] for part in self.forces(on, self.state[:, None]))
        sign = 0
        if abs(slip) > SLIP:
            if thing.friction == inf:
                raise UnableError("a belt that grips drives it into something")
            sign = 1 if slip > 0.0 else -1
        else:
            if self.lever:
                self.state[OMEGA] -= slip / self.r
            else:
                v -= slip * np.array([n[1], -n[0]])
            if abs(need) > thing.friction * load:
                sign = 1 if need < 0.0 else -1
        if sign == 0:
            if begins:
                self.tell(Kind.STICK, thing.owner)
            steady = (need == 0.0 or not self.lever) and (thing.flat or not v.any())
            rests = on.belt == 0.0 or thing.owner == self.machine.landing
            if self.machine.until == "settled" and steady and rests:
                self.tell(Kind.SETTLE, thing.owner)
                self.reason = "settled"
                return None
        on = replace(on, slip=sign)
        push = self.rates(on, self.state)[V]
        for k, m in self.touching().items() if begins else ():
            if k != index and v @ m < REST and push @ m < -1e-9:
                raise UnableError("it is held between two surfaces")
        return on

    # Forces and rates.

    def forces(self, on: _Lasting, y: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Return normal, load, friction, slip and the holding force (per mass) at states (7, k)."""
        thing = self.things[on.index]
        if thing.flat:
            n = on.normal[:, None] + np.zeros_like(y[X])
            bend = 0.0
        else:
            n = y[X] + (self.base - thing.place)[:, None]
            n = n / np.hypot(*n)
            bend = (y[2] * n[1] - y[3] * n[0]) ** 2 / thing.reach
        load = -(self.g @ n) - bend
        pull = self.g[0] * n[1] - self.g[1] * n[0]
        slip = y[2] * n[1] - y[3] * n[0] + self.r * y[OMEGA] - on.belt
        need = -pull / (1.0 + (0.0 if on.carried else self.lever))
        force = need if on.slip == 0 else -on.slip * thing.friction * load
        return n, load, force, slip, need

    def load(self, on: _Lasting) -> float:
        """Return the normal force per mass now, m/s²."""
        return float(self.forces(on, self.state[:, None])[1][0])

    def rates(self, on: _Lasting | None, y: Floats) -> Floats:
        """Return the time derivative of a state (7,)."""
        out = np.zeros(7)
        out[X], out[V] = y[V], self.g
        if on is not None:
            n, load, force, slip, _ = (part[..., 0] for part in self.forces(on, y[:, None]))
            out[V] += load * n + force * np.array([n[1], -n[0]])
            if not on.carried and self.lever:
                out[OMEGA] = self.lever * force / self.r
            out[WORK] = force * on.belt
            out[HEAT] = -force * slip if on.slip else 0.0
        return out

    def blow(self, index: int) -> None:
        """Strike a thing: Newton's restitution, Coulomb's friction."""
        thing, mass, v = self.things[index], self.machine.particle.mass, self.state[V]
        before, spin, on = v.copy(), float(self.state[OMEGA]), self.lasting(index)
        n, belt = on.normal, on.belt
        along, closing = np.array([n[1], -n[0]]), -float(v @ n)
        slip = float(v @ along) + self.r * spin - belt
        normal = (1.0 + thing.restitution) * closing
        bound = inf if thing.friction == inf else thing.friction * normal
        tangential = min(max(-slip / (1.0 + self.lever), -bound), bound)
        v += normal * n + tangential * along
        if self.lever:
            self.state[OMEGA] += self.lever * tangential / self.r
        after = slip + (1.0 + self.lever) * tangential
        loss = 0.5 * mass * (1.0 - thing.restitution**2) * closing**2
        self.log.book(0, thing.owner, mass * tangential * belt, loss,
                      -0.5 * mass * tangential * (slip + after))  # fmt: skip
        self.log.contacts += 1
        lands = thing.owner == self.machine.landing and not self.landed
        self.landed |= lands
        self.tell(
            Kind.LANDING if lands else Kind.IMPACT, thing.owner, before, spin,
            mass * normal, mass * tangential,
        )  # fmt: skip
        self.knot()
        if lands and self.machine.until == "landed":
            self.reason = "landed"

    # Phases.

    def phase(self, on: _Lasting | None) -> _Lasting | None:
        """Integrate until something happens, and resolve it."""
        self.state[X] = self.state[WORK] = self.state[HEAT] = 0.0
        guards = list(self.meetings(on))
        guards += [("exit", -1, self.to_exit)] if on is None else self.changes(on)
        left, first = self.machine.end_time - self.t0, None
        if on is None:
            for n in self.touching().values():
                away, fall = float(self.state[V] @ n), -float(self.g @ n)
                if away >= REST and fall > 0.0:
                    first = min(first or inf, 0.5 * away / fall)
        what = self.integrate(on, guards, left, first)
        if on is not None:
            owner, mass = self.things[on.index].owner, self.machine.particle.mass
            self.log.book(0, owner, mass * self.state[WORK], 0.0, mass * self.state[HEAT])
        self.base = self.base + self.state[X]
        self.state[X] = 0.0
        self.knot()
        return self.next(on, what)

    def integrate(
        self, on: _Lasting | None, guards: list[tuple[str, int, Guard]], left: float,
        first: float | None,
    ) -> tuple[str, int]:  # fmt: skip
        """Step until the first guard falls to 0; leave state and time there, and say which."""
        if left <= 0.0:
            return "time", -1
        reach = PIECES * max(PIECE, self.r)
        if on is not None and not self.things[on.index].flat:
            reach = min(reach, ARC * self.things[on.index].reach)

        def longest(y: Floats) -> float:
            # At this speed and under gravity a step covers at most `reach`.
            pace = hypot(*y[V]) + sqrt(2.0 * self.machine.gravity * reach)
            return reach / pace if pace > 0.0 else left

        step = self.solver(
            lambda _t, y: self.rates(on, y), 0.0, self.state, left, rtol=RTOL, atol=ATOL,
            first_step=min(first or left, longest(self.state), left),
        )  # fmt: skip
        values = [guard(self.state[:, None])[0] for _, _, guard in guards]
        while step.status == "running":
            step.max_step = longest(step.y)
            with np.errstate(over="ignore", invalid="ignore"):
                step.step()  # which may try a step that is far too long and reject it
            self.steps += 1
            if self.progress is not None:
                self.progress(min(1.0, (self.t0 + step.t) / self.machine.end_time))
            if step.status == "failed":
                raise UnableError("DOP853 needs a step shorter than rounding")
            dense = step.dense_output()
            times = np.linspace(step.t_old, step.t, PIECES + 1)[1:]
            found = np.hstack([dense(times[:-1]), step.y[:, None]])
            earliest, which = inf, -1
            for k, (name, index, guard) in enumerate(guards):
                seen = np.concatenate([[values[k]], guard(found)])
                values[k] = seen[-1]
                for at in np.flatnonzero((seen[:-1] > 0.0) & (seen[1:] <= 0.0)).tolist():
                    low = step.t_old if at == 0 else times[at - 1]

                    def value(t: float, dense: Any = dense, guard: Guard = guard) -> float:
                        return float(guard(dense(t)[:, None])[0])

                    t = times[at]  # the sample is the root, to rounding, unless
                    if value(t) < 0.0 < value(low):
                        t = float(self.root(value, low, t, xtol=1e-300, rtol=8.9e-16))
                    place = self.base + dense(t)[X]
                    beside = name not in ("left", "right") or self.things[index].within(place)
                    if t < earliest and beside:
                        earliest, which = t, k
            if which >= 0:
                self.state, self.t0 = dense(earliest), self.t0 + earliest
                return guards[which][:2]
            if on is not None:
                self.knot(step.t, step.y)
        self.state, self.t0 = step.y.copy(), self.machine.end_time
        return "time", -1

    def meetings(self, on: _Lasting | None) -> Iterator[tuple[str, int, Guard]]:
        """Yield the gaps to all but the supporting surface and those that continue it."""
        for k, thing in enumerate(self.things):
            if on is not None:
                joined = on.index in [j for j, _, _ in thing.joined]
                ridden = on.carried and thing.owner == self.things[on.index].owner
                if k == on.index or joined or ridden:
                    continue
            if thing.flat:
                yield "left", k, self.to_line(thing, 1.0)
                yield "right", k, self.to_line(thing, -1.0)
            else:
                yield "meets", k, self.to_circle(thing)

    def to_line(self, thing: _Surface, side: float) -> Guard:
        """Return the gap to a face; if it is touched the gap starts at exactly 0."""
        gap = side * thing.distance(self.base) - self.r
        gap = 0.0 if abs(gap) < TOUCH else gap
        return lambda y: gap + side * (thing.left @ y[X])

    def to_circle(self, thing: _Surface) -> Guard:
        """Return the gap to a circle, likewise."""
        away = self.base - thing.place
        far = hypot(*away)
        ahead = 0.0 if abs(far - thing.reach) < TOUCH else far - thing.reach

        def left(y: Floats) -> Floats:
            d = y[X]
            now = np.hypot(away[0] + d[0], away[1] + d[1])
            # |a + d| - |a|, without cancellation.
            return np.asarray(ahead + (2.0 * (away @ d) + (d * d).sum(axis=0)) / (now + far))

        return left

    def to_exit(self, y: Floats) -> Floats:
        """Return the distance to the exit box."""
        low, high = self.machine.releases.exit_box[0].reshape(2, 2) - self.base
        return np.asarray(np.minimum(y[X].T - low, high - y[X].T).min(axis=1))

    def changes(self, on: _Lasting) -> Iterator[tuple[str, int, Guard]]:
        """Yield what ends a contact: no load, no slip, too little friction, the end of a face."""
        thing = self.things[on.index]
        if not thing.flat or not on.carried:
            yield "lifts", on.index, lambda y: self.forces(on, y)[1]
        if on.slip:
            yield "grips", on.index, lambda y: on.slip * self.forces(on, y)[3]
        elif not on.carried and thing.friction != inf:

            def spare(y: Floats) -> Floats:
                _, load, _, _, need = self.forces(on, y)
                return np.asarray(thing.friction * load - np.abs(need))

            yield "slips", on.index, spare
        if thing.flat:
            along = thing.foot(self.base)
            yield "ends", 0, lambda y: along + thing.tangent @ y[X]
            yield "ends", 1, lambda y: thing.length - along - thing.tangent @ y[X]
            return
        for k, point, inward in thing.joined:
            # Beside the end of a segment, where its face continues if it lies in that direction.
            from_end = self.base - point

            def outside(y: Floats, a: Floats = from_end, i: Floats = inward) -> Floats:
                place = a[:, None] + y[X]
                near = np.hypot(*place) < 1.5 * self.r
                return np.where(near, -(i @ place), np.nan)

            yield "joins", k, outside
        if thing.left.any():
            tip = self.base - thing.place
            side = 1.0 if tip @ thing.left >= 0.0 else -1.0
            yield "lasts", on.index, lambda y: side * (thing.left @ (tip[:, None] + y[X]))

    def next(self, on: _Lasting | None, what: tuple[str, int]) -> _Lasting | None:
        """Resolve what ended a phase; return the lasting contact, if there is one."""
        name, k = what
        if name in ("time", "exit"):
            if name == "exit":
                self.tell(Kind.EXIT, -1)
            self.reason = name
            return None
        if name in ("left", "right", "meets"):
            if on is not None and on.carried:
                raise UnableError("something is in the way of the ride")
            self.sides[k] = name != "right"
            self.blow(k)
            lasting = None if self.reason else self.contact()
            if on is not None and (lasting is None or lasting.index != on.index):
                self.tell(Kind.SEPARATION, self.things[on.index].owner)
            return lasting
        assert on is not None
        if name == "lifts":
            self.tell(Kind.SEPARATION, self.things[k].owner)
            return None
        if name == "ends":
            return self.round_the_end(on, k)
        if name in ("joins", "lasts"):
            return self.law(k)
        if name == "slips":
            self.tell(Kind.SLIP, self.things[k].owner)
            need = self.forces(on, self.state[:, None])[4]
            return replace(on, slip=-1 if need[0] > 0.0 else 1)
        return self.law(k, begins=True)

    def round_the_end(self, on: _Lasting, end: int) -> _Lasting | None:
        """Go on at the end of a face: round the pulley, round the end, or in flight."""
        face = self.things[on.index]
        point = face.place + (face.length if end else 0.0) * face.tangent
        for k, thing in enumerate(self.things):
            if any(
                j == on.index and np.allclose(at, point, atol=TOUCH) for j, at, _ in thing.joined
            ):
                if on.carried:
                    k = len(self.things)
                    self.things.append(replace(thing, reach=hypot(*self.base), joined=()))
                onward = self.lasting(k, carried=on.carried)
                if self.load(onward) > 0.0:
                    return onward if on.carried else self.law(k)
                break
        self.tell(Kind.SEPARATION, face.owner)
        return None

    # What is written down.

    def knot(self, later: float = 0.0, y: Floats | None = None) -> None:
        y = self.state if y is None else y
        self.log.knots(0, self.t0 + later, self.base + y[X], y[V], y[OMEGA])

    def tell(
        self, kind: Kind, surface: int, before: Floats | None = None, spin: float | None = None,
        normal: float = 0.0, tangential: float = 0.0,
    ) -> None:  # fmt: skip
        self.log.events(
            kind, 0, self.t0, self.base, self.state[V].copy(), self.state[OMEGA],
            velocity_before=before, omega_before=spin, surface=surface,
            normal_impulse=normal, tangential_impulse=tangential,
        )  # fmt: skip


def _surfaces(machine: Machine) -> list[_Surface]:
    """Return segments, then the pulley, then free ends of segments."""
    parts, r, wheel = machine.segments, machine.particle.radius, machine.pulley
    radius, nothing = wheel.radius if wheel else 0.0, np.zeros(2)
    things: list[_Surface] = []
    ends: list[tuple[int, Floats, Floats]] = []
    for k, tangent in enumerate(parts.tangent):
        left = np.array([-tangent[1], tangent[0]])
        things.append(
            _Surface(
                parts.start[k], tangent, left, float(parts.length[k]), 0.0, float(parts.speed[k]),
                float(parts.restitution[k]), float(parts.friction[k]), int(parts.surface[k]),
            )
        )  # fmt: skip
        ends += [(k, parts.start[k], tangent), (k, parts.end[k], -tangent)]
    if wheel is not None:
        on_rim = tuple(end for end in ends if abs(hypot(*end[1]) - radius) <= TOUCH)
        things.append(
            _Surface(
                nothing, nothing, nothing, 0.0, radius + r, wheel.speed, wheel.restitution,
                wheel.friction, wheel.surface, on_rim,
            )
        )  # fmt: skip
        ends = [end for end in ends if hypot(*end[1]) > radius + TOUCH]
    for k, point, _ in ends if r > 0.0 else []:
        joined = tuple(end for end in ends if np.abs(end[1] - point).max() <= TOUCH)
        if joined[0][0] == k:  # of several that end here, the first
            line, those = things[k], [things[j] for j, _, _ in joined]
            left = np.sum([thing.left for thing in those if thing.owner == line.owner], axis=0)
            circle = {"place": point, "tangent": nothing, "left": left, "length": 0.0, "reach": r}
            things.append(replace(line, joined=joined, **circle))
    return things
