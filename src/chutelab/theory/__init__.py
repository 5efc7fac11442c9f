"""The paper's model in closed form, sharing no code with the engines.

V. Molnár et al., "Energy calculation model of an outgoing conveyor with application of a transfer
chute with the damping plate", Mech. Sci. 7, 167-177, 2016, doi:10.5194/ms-7-167-2016.

- `transfer`: Eqs. (2)-(16) and their generalisations, vectorised: of plain numbers a `Transfer`.
- `slide`: sliding and rolling on a round surface: along a chute, and round the pulley up to
  separation, with adhesion, finite friction, or rolling; reasons for no answer.
- `discharge`: where a bed leaves its pulley by five methods of engineers; loading points.
- `prediction`: `predict`, particle 0 of a scene, or the reason why the closed form does not hold
  for it; `unbounded`, the same without looking at the finite machine.
- `obstacles`: the first surface met in a flight, or on the ride.
- `drag`: an estimate of air drag, which the theory leaves out.
- `paper`: the paper's tables beside computed values.
- `figures`: its figures.

Only NumPy, `chutelab.scene` and `chutelab.util` are imported.
"""

from typing import TYPE_CHECKING, Any

from chutelab.theory.drag import Drag, drag
from chutelab.theory.prediction import predict, unbounded
from chutelab.theory.slide import Reason, Slide, slide
from chutelab.theory.transfer import STAGES, Rebound, Transfer, belt_power, transfer

if TYPE_CHECKING:
    from chutelab.theory.paper import TABLES, Table, table

__all__ = [
    "STAGES", "TABLES", "Drag", "Reason", "Rebound", "Slide", "Table", "Transfer", "belt_power",
    "drag", "predict", "slide", "table", "transfer", "unbounded",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Read the paper's tables once something asks for them: that takes 4 ms."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from chutelab.theory import paper

    return getattr(paper, name)
