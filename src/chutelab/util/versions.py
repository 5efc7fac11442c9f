"""Versions of installed packages, and what figures were measured on: nothing that names anybody."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def version_of(package: str) -> str | None:
    """Return the version of a package; None if it is not installed.

    >>> version_of("no such package") is None
    True
    """
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def own_version() -> str:
    """Return chutelab's version, as far as it is known."""
    return version_of("chutelab") or "unknown (not installed)"


PACKAGES = ("chutelab", "numpy", "pymunk", "wasmtime", "scipy")


def environment() -> dict[str, str]:
    """Return processor, number of cores, system, Python and versions of packages.

    What is not installed is left out; no host, user or path is in it.
    """
    cores = os.cpu_count() or 1
    found = {
        "processor": f"{_processor()}, {cores} core{'s' if cores > 1 else ''}",
        "system": platform.system(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
    }
    versions = {package: version_of(package) for package in PACKAGES}
    return found | {package: version for package, version in versions.items() if version}


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return " ".join(line.partition(":")[2].split())
    except OSError:
        pass
    return platform.processor() or platform.machine()
