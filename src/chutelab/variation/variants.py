"""One scene, varied: every combination of values laid over it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import prod
from typing import TYPE_CHECKING, Any, Final

from chutelab.scene import Scene, SceneError, from_dict, to_dict
from chutelab.variation.keys import quantities, setting
from chutelab.variation.reading import Vary, VaryError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

MOST_VARIED: Final = 2
"""Keys varied at once: a slider each, or the two axes of a picture."""


@dataclass(frozen=True)
class Variant:
    """One combination of values.

    Attributes
    ----------
    values : tuple of float
        One for each varied key.
    scene : Scene or None
        None if these values make no scene.
    fault : str
        Why not, in words; "" if they do.
    """

    values: tuple[float, ...]
    scene: Scene | None
    fault: str = ""


def variants(scene: Scene, varies: Sequence[Vary], most: int = 1_000) -> tuple[Variant, ...]:
    """Lay every combination of values over a scene; the last key runs fastest.

    Parameters
    ----------
    scene : Scene
        From `chutelab.load`.
    varies : sequence of Vary
        Up to `MOST_VARIED`; none gives the scene itself.
    most : int
        Combinations allowed.

    Returns
    -------
    tuple of Variant
        A combination that makes no scene is there with its fault.

    Raises
    ------
    VaryError
        If there are too many keys or combinations, or a key cannot be varied.
    """
    if len(varies) > MOST_VARIED:
        raise VaryError(varies[MOST_VARIED].typed, f"at most {MOST_VARIED} keys can be varied")
    quantities(scene, varies)
    count_of(varies, most)
    document = to_dict(scene)
    return tuple(
        variant(document, scene.source, [vary.key for vary in varies], values)
        for values in product(*(vary.values for vary in varies))
    )


def count_of(varies: Sequence[Vary], most: int) -> int:
    """Return how many combinations there are.

    Raises
    ------
    VaryError
        If there are more than `most`.
    """
    total = prod(len(vary.values) for vary in varies)
    if total > most:
        counts = "".join(f"{len(vary.values)} × " for vary in varies[:-1])
        raise VaryError(
            varies[-1].typed,
            f"{counts}{len(varies[-1].values)} variants, at most {most} are allowed",
        )
    return total


def variant(
    document: Mapping[str, Any], source: str, keys: Sequence[str], values: tuple[float, ...]
) -> Variant:
    """Lay one combination of values over a scene.

    Parameters
    ----------
    document, source : mapping and str
        The scene, as `chutelab.scene.to_dict` has it, and what messages call it.
    keys, values : sequence of str, tuple of float
        What is varied, and what it is.
    """
    settings = [setting(key, value) for key, value in zip(keys, values, strict=True)]
    try:
        return Variant(values, from_dict(document, source, settings))
    except SceneError as error:
        return Variant(values, None, reason(error))


def reason(error: SceneError) -> str:
    """Return the faults of a scene without its file, in one line."""
    return "; ".join(str(fault) for fault in error.faults)
