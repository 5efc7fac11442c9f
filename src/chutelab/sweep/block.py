"""Some variants of one scene: a unit of work, for this process or another one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from chutelab.scene.family import is_plain
from chutelab.sweep import batch
from chutelab.sweep.alone import alone
from chutelab.sweep.columns import joined

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chutelab.sweep.columns import Columns


@dataclass(frozen=True, eq=False)
class Block:
    """Variants to be simulated; plain data, so that it can be sent to another process.

    Attributes
    ----------
    document, source : dict, str
        The scene, as `chutelab.scene.to_dict` has it, and what messages call it.
    keys, paths : tuple of str
        What is varied, as it was written, and full paths, with free surfaces by index.
    values : ndarray, (n, K)
        The values of each variant.
    engine : str or None
        Overrides ``run.engine``.
    """

    document: dict[str, Any]
    source: str
    keys: tuple[str, ...]
    paths: tuple[str, ...]
    values: NDArray[np.float64]
    engine: str | None


def swept(block: Block) -> Columns:
    """Return the rows of a block: together where that can be, else one by one."""
    if all(is_plain(path) for path in block.paths):
        return batch.swept(block)
    return joined([alone(block, row) for row in range(len(block.values))])
