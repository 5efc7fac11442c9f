"""`write`: a scene and its variants as one HTML file that needs no installation and no network.

===============  ==================================================================================
`runs`           every variant simulated, and what a page can hold
`figures`        the numbers of a variant, simulated and from the analytic parabola
`packing`        knots and surfaces as binary columns, the rest as JSON
`document`       `write` and `html`: the assets joined into one file
``assets``       HTML, CSS and JavaScript: ``tracks.js`` (curves between knots), ``books.js`` (the
                 energy ledger), ``view.js``, ``picture.js`` and ``film.js`` (the canvas: scale,
                 what rests, what moves), ``panels.js`` (bars and numbers), ``input.js`` (keyboard
                 and touch), ``main.js`` (sliders and clock)
===============  ==================================================================================

No physics is in the page: it draws the cubic Hermite curves through the knots that the engine left.
"""

from chutelab.page.document import Written, html, write
from chutelab.page.runs import MOST_KNOTS, MOST_PARTICLES, MOST_STEPPED, MOST_VARIANTS, PageError

__all__ = [
    "MOST_KNOTS",
    "MOST_PARTICLES",
    "MOST_STEPPED",
    "MOST_VARIANTS",
    "PageError",
    "Written",
    "html",
    "write",
]
