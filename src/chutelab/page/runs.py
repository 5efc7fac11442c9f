"""Every variant of a scene simulated, and how much a page can hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from chutelab.machine import build
from chutelab.plots import analytic_of, window_of
from chutelab.recorder import StalledError
from chutelab.scene import SceneError, from_dict, to_dict
from chutelab.simulation import simulate
from chutelab.theory import predict
from chutelab.variation import Quantity, Variant, Vary, parse, quantities, reason, variants

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from chutelab.machine import Machine
    from chutelab.plots import Arc, Window
    from chutelab.recording import Recording
    from chutelab.scene import Scene

MOST_VARIANTS: Final = 1_000
"""Variants on one page: two sliders of some 30 positions each."""

MOST_STEPPED: Final = 24
"""Variants on one page of a scene that is stepped, because each may take seconds."""

MOST_PARTICLES: Final = 200
"""Particles on one page: a phone draws all of them 60 times a second."""

MOST_KNOTS: Final = 100_000
"""Knots of all variants together: a page of about 10 MB."""

_PLAYERS: Final = ("title", "gravity", "particle", "incoming", "plate", "surface", "stream")


class PageError(ValueError):
    """What cannot be made a page of; the text says why, and what can."""


@dataclass(frozen=True, eq=False)
class Run:
    """One variant that ran.

    Attributes
    ----------
    scene, machine, recording : Scene, Machine, Recording
        What was run, and what came of it.
    arcs, began : tuple of Arc, float
        The analytic parabola, and the time (s) of the recording at which it begins.
    reason : str
        Why the analytic parabola ends early, or is not there; "" if it goes to the landing.
    window : Window
        Where something happens.
    """

    scene: Scene
    machine: Machine
    recording: Recording
    arcs: tuple[Arc, ...]
    began: float
    reason: str
    window: Window


@dataclass(frozen=True, eq=False)
class Outcome:
    """A variant: what became of it, or why nothing did.

    Attributes
    ----------
    values : tuple of float
        One for each slider.
    run : Run or None
        None if these values make no scene, or it cannot be run. With a fault it is the run of the
        scene without its outgoing belt, which shows why that has no place.
    fault : str
        What is wrong with these values, "" if nothing is.
    """

    values: tuple[float, ...]
    run: Run | None
    fault: str = ""


@dataclass(frozen=True, eq=False)
class Study:
    """A scene and all its variants, run.

    Attributes
    ----------
    scene : Scene
        As it was before it was varied.
    varies, quantities : tuple
        The sliders: their values, and what they are.
    outcomes : tuple of Outcome
        Of all combinations; the last slider runs fastest.
    """

    scene: Scene
    varies: tuple[Vary, ...]
    quantities: tuple[Quantity, ...]
    outcomes: tuple[Outcome, ...]

    @property
    def runs(self) -> tuple[Run, ...]:
        """What there is to draw."""
        return tuple(outcome.run for outcome in self.outcomes if outcome.run is not None)

    @property
    def sound(self) -> tuple[Run, ...]:
        """Runs of the variants that have no fault."""
        return tuple(o.run for o in self.outcomes if o.run is not None and not o.fault)


def study(
    scene: Scene,
    varies: Sequence[Vary | str] = (),
    progress: Callable[[float], None] | None = None,
) -> Study:
    """Run all variants of a scene.

    Parameters
    ----------
    scene : Scene
        From `chutelab.load`.
    varies : sequence of Vary or str
        Up to two; a text as ``--vary`` takes it.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Raises
    ------
    VaryError
        If what is to be varied cannot be.
    PageError
        If there is too much for a page, or no variant runs.
    """
    varied = tuple(parse(vary) if isinstance(vary, str) else vary for vary in varies)
    found = variants(scene, varied, MOST_VARIANTS)
    _check(found)
    outcomes: list[Outcome] = []
    knots = 0
    for number, variant in enumerate(found):
        outcomes.append(_outcome(variant))
        run = outcomes[-1].run
        knots += 0 if run is None else len(run.recording.knots)
        if knots > MOST_KNOTS:
            raise PageError(
                f"{number + 1} of {len(found)} variants have {knots} knots already, at most"
                f" {MOST_KNOTS} fit on a page: vary in fewer steps, or take fewer particles with"
                " --set stream.count=..."
            )
        if progress is not None:
            progress((number + 1) / len(found))
    result = Study(scene, varied, quantities(scene, varied), tuple(outcomes))
    if not result.sound:
        raise PageError(f"{scene.source}: no variant can be run; the first: {outcomes[0].fault}")
    return result


def _check(found: Sequence[Variant]) -> None:
    """Refuse, before anything runs, what would be too much for a page or for the one who waits."""
    scenes = [variant.scene for variant in found if variant.scene is not None]
    most = max((scene.stream.count for scene in scenes), default=0)
    if most > MOST_PARTICLES:
        raise PageError(
            f"stream.count = {most}: a page shows at most {MOST_PARTICLES} particles; add"
            f" --set stream.count={MOST_PARTICLES}"
        )
    stepped = sum(
        scene.run.engine == "pymunk" or (scene.stream.interact and scene.stream.count > 1)
        for scene in scenes
    )
    if stepped > MOST_STEPPED:
        raise PageError(
            f"{stepped} variants are stepped, at most {MOST_STEPPED} are allowed,"
            " because each may take seconds: vary in fewer steps, or add"
            " --set stream.interact=false --set run.engine=exact"
        )


def _outcome(variant: Variant) -> Outcome:
    if variant.scene is None:
        return Outcome(variant.values, None, variant.fault)
    try:
        return Outcome(variant.values, _run(variant.scene))
    except SceneError as error:
        return Outcome(variant.values, _without_belt(variant.scene), reason(error))
    except StalledError as error:
        return Outcome(variant.values, None, f"the run got stuck: {error}")


def _without_belt(scene: Scene) -> Run | None:
    """Run a scene whose outgoing belt has no place, because the flight misses the plate."""
    if scene.outgoing is None:
        return None
    document = {name: table for name, table in to_dict(scene).items() if name in _PLAYERS}
    try:
        return _run(from_dict(document, scene.source))
    except (SceneError, StalledError):
        return None


def _run(scene: Scene) -> Run:
    machine = build(scene)
    recording = simulate(scene)
    prediction = predict(scene)
    arcs, began = analytic_of(recording, prediction)
    return Run(
        scene=scene,
        machine=machine,
        recording=recording,
        arcs=arcs,
        began=began,
        reason=str(prediction.reason),
        window=window_of(recording, machine),
    )
