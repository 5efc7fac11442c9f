"""``KEY=FROM:TO:COUNT`` and ``KEY=a,b,c``: one scene, varied in one key or more.

- `reading`: what ``--vary`` takes, as it is written.
- `keys`: what the varied keys of a scene are.
- `variants`: every combination of values laid over a scene.
"""

from chutelab.variation.keys import Quantity, quantities, quantity, setting
from chutelab.variation.reading import (
    FORM,
    MOST_VALUES,
    Range,
    Vary,
    VaryError,
    parse,
    parse_range,
)
from chutelab.variation.variants import (
    MOST_VARIED,
    Variant,
    count_of,
    reason,
    variant,
    variants,
)

__all__ = [
    "FORM",
    "MOST_VALUES",
    "MOST_VARIED",
    "Quantity",
    "Range",
    "Variant",
    "Vary",
    "VaryError",
    "count_of",
    "parse",
    "parse_range",
    "quantities",
    "quantity",
    "reason",
    "setting",
    "variant",
    "variants",
]
