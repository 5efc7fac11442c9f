"""What all tables of a scene share."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Table(BaseModel):
    """What all tables share: frozen, and strangers refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    def _fill(self, key: str, value: object) -> None:
        # A default that depends on another key: not counted among the keys that were set, so that
        # a scene taken apart and changed gets it anew.
        object.__setattr__(self, key, value)
