"""`sweep` and `design` with texts as the command line takes them: shorter than values by key."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from chutelab.cli.options import targets, uncertain, varied
from chutelab.studies import design
from chutelab.studies import sweep as sweeps


def _read(read: Any, texts: Any, **how: Any) -> Any:
    texts = [texts] if isinstance(texts, str) else texts
    plain = isinstance(texts, Mapping) or not all(isinstance(one, str) for one in texts)
    return texts if plain else read(list(texts), **how)


def sweep(scene: Any, texts: Any, **options: Any) -> Any:
    """Call `chutelab.studies.sweep.sweep`."""
    return sweeps.sweep(scene, _read(varied, texts, ranges="sample" in options), **options)


def planned(scene: Any, texts: Any, **options: Any) -> Any:
    """Call `chutelab.studies.sweep.planned`."""
    return sweeps.planned(scene, _read(varied, texts, ranges="sample" in options), **options)


def solve(scene: Any, vary: Any, target: Any, **options: Any) -> Any:
    """Call `chutelab.studies.design.solve`."""
    ranges = _read(varied, vary, ranges=True)
    return design.solve(scene, ranges, _read(targets, target), **options)


def minimize(scene: Any, vary: Any, quantity: str, **options: Any) -> Any:
    """Call `chutelab.studies.design.minimize`."""
    return design.minimize(scene, _read(varied, vary, ranges=True), quantity, **options)


def maximize(scene: Any, vary: Any, quantity: str, **options: Any) -> Any:
    """Call `chutelab.studies.design.maximize`."""
    return design.maximize(scene, _read(varied, vary, ranges=True), quantity, **options)


def uncertainty(scene: Any, given: Any, *names: Any, **options: Any) -> Any:
    """Call `chutelab.studies.design.uncertainty`."""
    return design.uncertainty(scene, _read(uncertain, given), *names, **options)


value = design.value
