"""The paper's equations (2) to (16) in closed form, vectorised, with their generalisations.

Any plate angle, finite particles, friction and spin; the printed Eq. (9) beside the right one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from chutelab.theory.stages import Given, Stages

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from chutelab.theory.results import Transfer

Rebound = Literal["corrected", "as-printed"]


def transfer(
    *,
    speed: ArrayLike,
    pulley_radius: ArrayLike,
    distance: ArrayLike,
    angle: ArrayLike = 0.0,
    pivot_height: ArrayLike | None = None,
    restitution: ArrayLike = 0.5,
    drop: ArrayLike = 0.5,
    belt_speed: ArrayLike | None = None,
    particle_radius: ArrayLike = 0.0,
    mass: ArrayLike = 0.008,
    gravity: ArrayLike = 9.81,
    friction: ArrayLike = np.inf,
    spin: ArrayLike = False,
    plate_friction: ArrayLike = 0.0,
    interval: ArrayLike | None = None,
    rebound: Rebound = "corrected",
    unbounded_plate: bool = True,
) -> Transfer:
    """Carry a particle from the incoming belt over the plate to the outgoing belt.

    Plate and outgoing belt are unbounded here, and after the rebound neither pulley nor incoming
    belt are in the way; `chutelab.theory.predict` takes the finite machine into account.

    Parameters
    ----------
    speed : array_like
        v0 of the incoming belt, m/s, > 0.
    pulley_radius, distance : array_like
        R > 0, and d_okr from the pulley's leading edge x = R to the plate's pivot, m.
    angle : array_like
        Plate angle α, rad, within ±π/2; positive leans the top back toward the incoming belt.
    pivot_height : array_like, optional
        Height of the pivot above the pulley's axis, m; R if not given.
    restitution, plate_friction : array_like
        ε (0..1) and µ of particle and plate.
    drop : array_like
        d2 >= 0, fall of the centre from the impact to the landing, m.
    belt_speed : array_like, optional
        v_dop of the outgoing belt, m/s; `speed` if not given.
    particle_radius, mass : array_like
        r >= 0 (0: the paper's mass point), m; m > 0, kg.
    gravity : array_like
        g >= 0, m/s².
    friction : array_like
        µ of particle and incoming belt or pulley; infinite is adhesion, Eq. (1).
    spin : array_like of bool
        True: a free disk, I = m r²/2; needs r > 0.
    interval : array_like, optional
        Time per particle, s, the t that Eq. (15) leaves open; without it P is NaN.
    rebound : {"corrected", "as-printed"}
        Which Eq. (9). The printed one is defined for α = 0 without plate friction only.
    unbounded_plate : bool
        False: do not object when ride or rebound meet the plate's line elsewhere, as a rebound must
        for α < 0; for callers who know where the plate ends.

    Returns
    -------
    Transfer
        Arrays of the parameters' broadcast shape.

    Raises
    ------
    ValueError
        If `rebound` is neither form, or the parameters do not broadcast.

    Notes
    -----
    V. Molnár et al., Mech. Sci. 7, 167-177, 2016, doi:10.5194/ms-7-167-2016. Relative errors are a
    few units in the last place times the conditioning: 1/|1 - v²/(g Rc)| near the critical speed,
    v2/|v_n| near a grazing impact.

    Examples
    --------
    >>> point = transfer(speed=2.0, pulley_radius=[0.05, 0.1], distance=0.5)
    >>> point.y2.round(3), point.dEk.round(6)
    (array([0.371, 0.441]), array([0.02, 0.02]))
    """
    if rebound not in ("corrected", "as-printed"):
        raise ValueError(f'rebound must be "corrected" or "as-printed", not {rebound!r}')
    given = _broadcast(
        speed=speed,
        pulley_radius=pulley_radius,
        distance=distance,
        angle=angle,
        pivot_height=pulley_radius if pivot_height is None else pivot_height,
        restitution=restitution,
        drop=drop,
        belt_speed=speed if belt_speed is None else belt_speed,
        particle_radius=particle_radius,
        mass=mass,
        gravity=gravity,
        friction=friction,
        spin=spin,
        plate_friction=plate_friction,
        interval=np.nan if interval is None else interval,
    )
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        stages = Stages(given, timed=interval is not None)
        stages.separate()
        stages.fly(unbounded_plate=unbounded_plate)
        stages.rebound(as_printed=rebound == "as-printed")
        stages.fall(unbounded_plate=unbounded_plate)
        return stages.transfer()


def _broadcast(*, spin: ArrayLike, **numbers: ArrayLike) -> Given:
    arrays = [np.asarray(value, dtype=np.float64) for value in numbers.values()]
    whole = np.broadcast_arrays(np.asarray(spin, dtype=np.bool_), *arrays)
    flat = dict(zip(numbers, (array.ravel() for array in whole[1:]), strict=True))
    return Given(shape=whole[0].shape, spin=whole[0].ravel(), **flat)
