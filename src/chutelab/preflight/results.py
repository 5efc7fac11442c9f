"""What a look at a scene finds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Part:
    """Something that is built, or skipped: its name, and how or why in words."""

    name: str
    what: str


@dataclass(frozen=True)
class Stepping:
    """What finite steps mean for a scene.

    Attributes
    ----------
    dt : float
        Longest step, s.
    aligned : bool
        Whether blows are met at their own instants; then nothing is passed through at any speed.
    speed : float or None
        Highest speed seen in the trial run, m/s; None if there was none.
    way : float or None
        What a particle covers in a step at that speed, m.
    bound : float
        What it must stay below if steps are not aligned: the radius, m.
    longest : float or None
        The longest step that would, s.
    """

    dt: float
    aligned: bool
    speed: float | None
    way: float | None
    bound: float
    longest: float | None

    @property
    def safe(self) -> bool:
        """Whether no particle can pass through a surface unseen."""
        return self.aligned or self.way is None or self.way < self.bound


@dataclass(frozen=True)
class Effort:
    """What a run is expected to cost.

    Attributes
    ----------
    contacts : int
        Impacts and collisions, about.
    seconds : float
        Run time here and now, about.
    at_least : bool
        True if the trial run was cut off: both are lower bounds then.
    how : str
        What the estimate rests on.
    """

    contacts: int
    seconds: float
    at_least: bool
    how: str


@dataclass(frozen=True)
class Coverage:
    """What the closed form has to say of a scene.

    Attributes
    ----------
    covers, leaves_out : tuple of str
        The paper's symbols that it gives, and that it does not.
    reason : str
        Why it stops, as `chutelab.theory` has it; "" if it does not.
    words : str
        The same for people.
    """

    covers: tuple[str, ...]
    leaves_out: tuple[str, ...]
    reason: str
    words: str


@dataclass(frozen=True)
class Advice:
    """Something that works but may surprise, and what would change it.

    Attributes
    ----------
    warning : str
        What is the matter.
    change : str
        What to do; a setting such as ``outgoing.drop = 0.3`` has been tried and does it.
    """

    warning: str
    change: str


@dataclass(frozen=True)
class Preflight:
    """All that `chutelab check` says of a scene.

    Attributes
    ----------
    title : str
        Of the scene.
    built, skipped : tuple of Part
        What the machine consists of, and what it does without.
    engine, why : str
        Which engine runs, and for what reason.
    ends : str
        When the run is over.
    stepping : Stepping or None
        None if the exact engine runs.
    effort : Effort
        Contacts and run time.
    theory : Coverage
        What the closed form answers.
    advice : tuple of Advice
        Warnings.
    """

    title: str
    built: tuple[Part, ...]
    skipped: tuple[Part, ...]
    engine: str
    why: str
    ends: str
    stepping: Stepping | None
    effort: Effort
    theory: Coverage
    advice: tuple[Advice, ...]
