"""The energy ledger of a recording: where every joule came from and where it went.

(K + U) at the end - (K + U) at the start = belt_work - restitution_loss - friction_loss + residual.
Every entry is accumulated from impulses and contact-point velocities, none is a remainder; so the
residual is the numerical error, and is shown as such.
"""

from __future__ import annotations

from dataclasses import dataclass

from chutelab.results.recording import ENTRIES, Recording, balance
from chutelab.util.tables import Sheet, Shown, number


@dataclass(frozen=True, repr=False)
class Ledger(Shown):
    """Energies of all particles together, J.

    Attributes
    ----------
    kinetic, potential : tuple of float
        At the start and at the end: each particle's release, and its own end. Rotation is part of
        the kinetic energy; y = 0 is the zero of the potential energy.
    belt_work : float
        Tangential impulse times belt speed: what the drives pay.
    restitution_loss : float
        Normal part of the losses in impacts.
    friction_loss : float
        Slip heat.
    residual : float
        What the balance leaves over: the numerical error.
    turned_over : float
        Kinetic energy at the start + the sizes of the three entries + the size of the change of
        potential energy.
    by_surface : dict of dict of float
        The three entries of each surface, and of ``"particles"``.
    """

    kinetic: tuple[float, float]
    potential: tuple[float, float]
    belt_work: float
    restitution_loss: float
    friction_loss: float
    residual: float
    turned_over: float
    by_surface: dict[str, dict[str, float]]

    @property
    def relative_residual(self) -> float:
        """|residual| as a share of the energy turned over (0 if nothing was)."""
        return abs(self.residual) / self.turned_over if self.turned_over > 0.0 else 0.0

    def sheet(self) -> Sheet:
        """Return the entries of each surface that has any, their sum, and how the books close."""
        total = (self.belt_work, self.restitution_loss, self.friction_loss)
        moved = (
            f"{name} {number(before)} -> {number(after)} J"
            for name, (before, after) in (("kinetic", self.kinetic), ("potential", self.potential))
        )
        return Sheet(
            "Energy ledger, J",
            ("", *(name.replace("_", " ") for name in ENTRIES)),
            tuple(
                (name, *map(number, entries.values()))
                for name, entries in self.by_surface.items()
                if any(entries.values())
            ),
            foot=(("total", *map(number, total)),),
            notes=(
                ", ".join(moved),
                f"residual {self.residual:.1e} J, {self.relative_residual:.1e} of the"
                f" {number(self.turned_over)} J turned over",
            ),
        )


def ledger(recording: Recording) -> Ledger:
    """Close the books of a recording."""
    first, last = recording.ends()
    kinetic_first, potential_first = recording.energies(first)
    kinetic_last, potential_last = recording.energies(last)
    change = (kinetic_last - kinetic_first) + (potential_last - potential_first)
    belt_work, restitution_loss, friction_loss = last["entries"].sum(axis=0).tolist()
    kinetic = float(kinetic_first.sum()), float(kinetic_last.sum())
    potential = float(potential_first.sum()), float(potential_last.sum())
    sizes = map(abs, (belt_work, restitution_loss, friction_loss, potential[1] - potential[0]))
    return Ledger(
        kinetic=kinetic,
        potential=potential,
        belt_work=belt_work,
        restitution_loss=restitution_loss,
        friction_loss=friction_loss,
        residual=float((change - balance(last["entries"])).sum()),
        turned_over=sum(sizes, kinetic[0]),
        by_surface={
            name: dict(zip(ENTRIES, row, strict=True))
            for name, row in zip(recording.surfaces, recording.by_surface.tolist(), strict=True)
        },
    )
