"""One variant at a time: any key, any engine. What all faster ways are measured against."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chutelab.recorder import StalledError
from chutelab.scene import SceneError
from chutelab.simulation import simulate
from chutelab.sweep.columns import REASON, empty
from chutelab.sweep.rows import rows
from chutelab.variation import reason, variant

if TYPE_CHECKING:
    from chutelab.scene import Scene
    from chutelab.sweep.block import Block
    from chutelab.sweep.columns import Columns


def alone(block: Block, row: int) -> Columns:
    """Validate and simulate one variant of a block, and return its row."""
    made = variant(block.document, block.source, block.keys, tuple(block.values[row].tolist()))
    return because(made.fault) if made.scene is None else row_of(made.scene, block.engine)


def row_of(scene: Scene, engine: str | None = None) -> Columns:
    """Simulate a scene and return its row; if it cannot be run, one that says why."""
    try:
        recording = simulate(scene, engine)
    except SceneError as error:
        return because(reason(error))
    except StalledError as error:
        return because(f"the run got stuck: {error}")
    return rows(recording, scene)


def because(why: str) -> Columns:
    """Return a row without numbers."""
    found = empty(1)
    found[REASON][0] = one_line(why)
    return found


def one_line(why: str) -> str:
    """Return a text without line breaks."""
    return " ".join(why.split())
