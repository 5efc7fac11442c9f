"""Text for people and JSON for programs, on standard output."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.console import RenderableType


def show(*parts: RenderableType) -> None:
    """Print tables and texts; in colour on a terminal, unless NO_COLOR is set."""
    from rich.console import Console

    console = Console(highlight=False)
    with console.capture() as capture:
        for part in parts:
            console.print(part)
    # Through click: it flushes, and knows what to do when the reader has gone.
    click.echo(capture.get(), nl=False)


def show_json(value: Any) -> None:
    """Print one JSON object; NaN is no JSON and must not get here."""
    click.echo(json.dumps(value, allow_nan=False))
