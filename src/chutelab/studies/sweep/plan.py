"""What is to be swept: which keys, over which values, in which order.

Values are grids, or samples of several ranges at once: Latin hypercube or Sobol points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from chutelab.engines.simulation import ENGINES
from chutelab.scene import AnyScene, Scene, load
from chutelab.scene.variants import (
    Quantity,
    Range,
    Varied,
    Vary,
    count_of,
    is_plain,
    quantities,
    varied,
)
from chutelab.studies.sweep.batch import Block
from chutelab.util.arrays import Floats
from chutelab.util.errors import InputError
from chutelab.util.versions import library

DESIGNS: Final = {"lhs": "LatinHypercube", "sobol": "Sobol"}
"""Names of the designs, and of the classes of `scipy.stats.qmc` that draw them."""


MOST_VARIANTS: Final = 1_000_000
"""Rows of one sweep: some 300 MB while it runs."""

MOST_KEYS: Final = 20
"""Keys varied at once."""

TOGETHER: Final = 8192
"""Variants in a block that goes through the exact engine at once."""

EXACT: Final = 16
"""The same of variants that go one by one, a millisecond each."""

STEPPED: Final = 1
"""The same of variants that are stepped: each may take seconds."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A scene and the variants of it, numbered from 0.

    Attributes
    ----------
    scene : Scene
        What is varied.
    varies : tuple of Vary
        Keys, and the values of each in a grid, or the ends of what samples are drawn from.
    quantities : tuple of Quantity
        What the K keys are.
    engine : str or None
        Overrides ``run.engine``.
    samples : ndarray, (N, K), or None
        Values of the keys; None for the grid, in which the last key runs fastest.
    """

    scene: Scene
    varies: tuple[Vary, ...]
    quantities: tuple[Quantity, ...]
    engine: str | None
    samples: Floats | None

    @property
    def keys(self) -> tuple[str, ...]:
        """The varied keys, as they were written."""
        return tuple(vary.key for vary in self.varies)

    @property
    def count(self) -> int:
        """Number of variants N."""
        return count_of(self.varies) if self.samples is None else len(self.samples)

    @property
    def begins(self) -> range:
        """The numbers that blocks begin with; they depend on the plan only, so it can resume."""
        stream = self.scene.stream
        one = stream.count == 1 and "stream.count" not in self.keys
        wanted = self.engine or self.scene.run.engine
        if wanted in ("contact", "pymunk") or (stream.interact and not one):
            size = STEPPED
        else:
            plain = all(is_plain(quantity.path) for quantity in self.quantities)
            size = TOGETHER if one and plain else EXACT
        return range(0, self.count, size)

    def block(self, first: int, last: int) -> Block:
        """Return the variants from `first` up to `last`, or the end."""
        last = min(last, self.count)
        if self.samples is not None:
            values = self.samples[first:last]
        else:
            axes = [np.array(vary.values) for vary in self.varies]
            places = np.unravel_index(np.arange(first, last), tuple(map(len, axes)))
            values = np.stack([axis[at] for axis, at in zip(axes, places, strict=True)], axis=1)
        paths = tuple(quantity.path for quantity in self.quantities)
        # + 0.0: there is one zero.
        return Block(self.scene, paths, values + 0.0, self.engine)


def planned(
    scene: AnyScene,
    varies: Varied,
    *,
    sample: int | None = None,
    design: str = "lhs",
    seed: int = 0,
    engine: str | None = None,
) -> Plan:
    """Look whether a sweep can be done, before anything runs; takes what `sweep` does.

    Raises
    ------
    InputError
        If a key cannot be varied so, there is too much, or samples cannot be drawn so.
    ValueError
        If there is no engine of that name.
    """
    if engine is not None and engine not in ENGINES:
        raise ValueError(f"engine = {engine!r}: one of {', '.join(ENGINES)}")
    scene, kind = load(scene), Vary if sample is None else Range
    varying = tuple(varied(varies, kind))
    for vary in varying:
        if not isinstance(vary, kind):
            raise InputError("samples are drawn between two ends, not from lists", vary.typed)
    if not varying:
        raise InputError("at least one key is to be varied, such as plate.angle_deg", "--vary")
    if len(varying) > MOST_KEYS:
        raise InputError(f"at most {MOST_KEYS} keys can be varied", varying[MOST_KEYS].typed)
    about = quantities(scene, varying)
    for vary, one in zip(varying, about, strict=True):
        if one.whole and not all(value.is_integer() for value in vary.values):
            raise InputError(f"{one.path} takes whole numbers only", vary.typed)
    if sample is None:
        count_of(varying, MOST_VARIANTS)
        return Plan(scene, varying, about, engine, None)
    return Plan(scene, varying, about, engine, _drawn(varying, about, sample, design, seed))


def _drawn(
    varies: Sequence[Vary], about: Sequence[Quantity], count: int, design: str, seed: int
) -> Floats:
    """Draw samples, (count, K); whole numbers with both ends, all equally likely."""
    if design not in DESIGNS:
        raise InputError(f"--design {design}: one of {', '.join(DESIGNS)}")
    if not 1 <= count <= MOST_VARIANTS:
        raise InputError(f"--sample {count}: a whole number from 1 to {MOST_VARIANTS}")
    if seed < 0:
        raise InputError(f"--seed {seed}: a whole number from 0")
    qmc = library("scipy.stats.qmc", "--sample needs SciPy", "design")
    sampler = getattr(qmc, DESIGNS[design])(d=len(varies), seed=np.random.default_rng(seed))
    if design == "sobol":
        # Of a power of two points the first ones: SciPy warns of all other numbers.
        shares = sampler.random_base2((count - 1).bit_length())[:count]
    else:
        shares = sampler.random(count)
    low, high = np.array([vary.values for vary in varies]).T
    whole = np.array([one.whole for one in about])
    points = low + shares * (high - low)
    steps = low + np.floor(shares * (high - low + 1.0))
    return np.asarray(np.where(whole, np.minimum(steps, high), points))
