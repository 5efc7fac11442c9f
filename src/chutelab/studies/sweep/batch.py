"""A block of variants run: many at once where they differ in plain numbers only, else one by one.

Many at once, a variant is a particle with a machine of its own. What is slow one by one, validating
and building, is done on arrays too; numbers agree with those of the variant alone to 1e-12. What
does not fit is left over, to be run alone: that is never wrong, only slower.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from chutelab.engines.exact import CornerError, run
from chutelab.engines.simulation import judged
from chutelab.machine import RefusedError, build
from chutelab.results import Recording
from chutelab.results.recorder import StalledError
from chutelab.scene import Scene, SceneError
from chutelab.scene.variants import Family, accepted, is_plain, judged_by, reason
from chutelab.studies.sweep.rows import REASON, Columns, empty, rows
from chutelab.util.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class Block:
    """Variants to be simulated; can be sent to another process.

    Attributes
    ----------
    scene : Scene
        What is varied.
    paths : tuple of str
        Full paths of the K keys that are, free surfaces by index.
    values : ndarray, (n, K)
        The values of each variant.
    engine : str or None
        Overrides ``run.engine``.
    """

    scene: Scene
    paths: tuple[str, ...]
    values: Floats
    engine: str | None = None

    def settings(self, row: int) -> dict[str, float]:
        """Return the values of one variant by path."""
        return dict(zip(self.paths, self.values[row].tolist(), strict=True))


def screened(block: Block) -> tuple[Scene | None, Ints, dict[int, str]]:
    """Validate the variants of a block, whose keys are plain numbers.

    A value is judged by its key, once for each. Rules between keys judge one variant for each
    combination of the values that they ask for; other keys cannot change what they say.

    Returns
    -------
    scene, sound, faults
        One of the sound variants (None if there is none), the numbers of all of them, and what is
        wrong with each of the others.
    """
    values = block.values
    good = np.stack([accepted(*column) for column in zip(block.paths, values.T, strict=True)]).T
    sound = np.asarray(good.all(axis=1))
    asked = np.full(len(block.paths), not sound.any())
    while True:
        telling = np.where(good & ~asked, 0.0, values)
        _, first, group = np.unique(
            np.hstack([telling, good]), axis=0, return_index=True, return_inverse=True
        )
        more = asked.copy()
        for row in first[sound[first]].tolist():
            by = judged_by(block.scene, block.settings(row))
            more |= [path in by for path in block.paths]
        if (more == asked).all():
            break
        asked = more
    template, wrong = None, dict[int, str]()
    for number, row in enumerate(first.tolist()):
        try:
            scene = block.scene.with_values(block.settings(row))
            template = template or scene
        except SceneError as error:
            wrong[number] = reason(error)
    faults = {n: wrong[g] for n, g in enumerate(group.ravel().tolist()) if g in wrong}
    return template, np.delete(np.arange(len(values)), list(faults)), faults


def alone(block: Block, row: int) -> Columns:
    """Validate and simulate one variant of a block, and return its row."""
    try:
        return row_of(block.scene.with_values(block.settings(row)), block.engine)
    except SceneError as error:
        return because(reason(error))


def row_of(scene: Scene, engine: str | None = None) -> Columns:
    """Simulate a scene and return its row; if it cannot be run, one that says why."""
    try:
        recording = judged(scene, engine=engine)
    except SceneError as error:
        return because(reason(error))
    except StalledError as error:
        return because(f"the run got stuck: {error}")
    if recording.laws:
        return because(str(recording.laws[0]))
    return rows(recording)


def because(why: str) -> Columns:
    """Return a row without numbers."""
    found = empty(1)
    found[REASON][0] = one_line(why)
    return found


def one_line(why: str) -> str:
    """Return a text without line breaks."""
    return " ".join(why.split())


def together(block: Block) -> tuple[list[tuple[Recording, Ints]], dict[int, str], list[int]]:
    """Run what can be run at once of a block whose keys are plain numbers, see `is_plain`.

    Returns
    -------
    runs, faults, left
        Recordings with a particle for each of N variants, of a family, and their rows
        in the block, (N,); why there is no run, by row; and the rows that have to be run alone.
    """
    template, which, faults = screened(block)
    if template is None:
        return [], faults, which.tolist()
    stepped = (block.engine or template.run.engine) in ("contact", "pymunk")
    # Members of a family are released, and have their gates, at the same times.
    timed = any(path.endswith(("opens_at", "closes_at", "stream.start")) for path in block.paths)
    # Whether a release lies on the belt is a matter of the last digits.
    close = {"particle.radius", "incoming.pulley_radius", "incoming.length"} & {*block.paths}
    if stepped or timed or template.count > 1 or (close and template.stream.at is not None):
        return [], faults, which.tolist()

    def scenes(some: Ints) -> Family:
        return Family(template, dict(zip(block.paths, block.values[some].T.copy(), strict=True)))

    groups: list[Ints] = []
    while len(which) and not groups:
        try:
            machine = build(scenes(which))
            groups = [which]
        except RefusedError as refused:
            faults |= {int(which[n]): str(fault) for n, fault in refused.members.items()}
            which = np.delete(which, list(refused.members))
    runs: list[tuple[Recording, Ints]] = []
    left: list[int] = []
    while groups:
        which = groups.pop()
        with suppress(CornerError, StalledError):
            every = len(which) == machine.count
            some = machine if every else build(scenes(which))
            recording = Recording.of(run(some, apart=True))
            if not recording.laws:
                runs.append((recording, which))
                continue
        # Those that do not get through, or break a law, are found by halving.
        halves = np.array_split(which, 2) if len(which) > 1 else []
        groups += halves
        left += [] if halves else which.tolist()
    return runs, faults, left


def swept(block: Block) -> Columns:
    """Return the rows of a block: together where that can be, else one by one."""
    found = empty(len(block.values))

    def put(which: Ints | list[int], columns: Columns) -> None:
        for name, values in columns.items():
            found[name][which] = values

    left = list(range(len(block.values)))
    if all(map(is_plain, block.paths)):
        runs, faults, left = together(block)
        for recording, which in runs:
            put(which, rows(recording, len(which)))
        for row, fault in faults.items():
            found[REASON][row] = one_line(fault)
    for row in left:
        put([row], alone(block, row))
    return found
