"""Samples of several ranges at once: Latin hypercube, or Sobol points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from chutelab.variation import Quantity, Vary

DESIGNS: Final = {"lhs": "LatinHypercube", "sobol": "Sobol"}
"""Names of the designs, and of the classes of `scipy.stats.qmc` that draw them."""


class SampleError(ValueError):
    """Samples that cannot be drawn; the text says what is allowed."""


def drawn(
    varies: Sequence[Vary],
    about: Sequence[Quantity],
    count: int,
    design: str,
    seed: int,
    most: int,
) -> NDArray[np.float64]:
    """Draw samples, (count, K), between the two values of each `Vary`.

    Whole numbers are drawn with both ends, all equally likely. The same seed draws the same
    samples.

    Raises
    ------
    SampleError
        If the design is unknown, there are too many samples, or SciPy is not installed.
    """
    if design not in DESIGNS:
        raise SampleError(f"--design {design}: one of {', '.join(DESIGNS)}")
    if not 1 <= count <= most:
        raise SampleError(f"--sample {count}: a whole number from 1 to {most}")
    if seed < 0:
        raise SampleError(f"--seed {seed}: a whole number from 0")
    try:
        from scipy.stats import qmc
    except ImportError:
        raise SampleError('--sample needs SciPy: pip install "chutelab[design]"') from None
    sampler = getattr(qmc, DESIGNS[design])(d=len(varies), seed=np.random.default_rng(seed))
    if design == "sobol":
        # Of a power of two points the first ones: SciPy warns of all other numbers.
        shares = sampler.random_base2((count - 1).bit_length())[:count]
    else:
        shares = sampler.random(count)
    low, high = (np.array([vary.values[end] for vary in varies]) for end in (0, 1))
    whole = np.array([one.whole for one in about])
    points = low + shares * (high - low)
    steps = low + np.floor(shares * (high - low + 1.0))
    return np.asarray(np.where(whole, np.minimum(steps, high), points))
