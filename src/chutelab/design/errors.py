"""What is asked for and cannot be done, and the packages without which nothing can."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class DesignError(ValueError):
    """A question that makes no sense for the scene; says what was typed, and what is allowed."""

    def __init__(self, typed: str, allowed: str) -> None:
        super().__init__(f"{typed}: {allowed}")


def scipy(name: str) -> Any:
    """Return a module of SciPy, such as ``optimize``.

    Raises
    ------
    ImportError
        Without SciPy; says what to install.
    """
    try:
        return import_module(f"scipy.{name}")
    except ImportError as error:
        text = 'SciPy is needed: pip install "chutelab[design]"'
        raise ImportError(text) from error
