"""temporary"""
from __future__ import annotations
from typing import Any
from chutelab.machine import build
from chutelab.scene import Scene
from chutelab.scene.schema import TABLES, as_written
from chutelab.scene.materials import PRESETS

def describe(scene: Scene) -> dict[str, Any]:
    given = as_written(scene)
    if scene.outgoing is not None and scene.outgoing.drop_from == "impact":
        m = build(scene)
        y = m.segments.start[m.segments.surface == m.landing][0, 1]
        given["outgoing"] = {**given["outgoing"], "drop_from": "top", "drop": scene.incoming.pulley_radius - float(y)}
    tables = {}
    for name, model in TABLES.items():
        tables[name] = {}
        for key, field in model.model_fields.items():
            d = field.default
            tables[name][field.alias or key] = {} if d is None or repr(d) == "PydanticUndefined" else {"default": d}
    tables["scene"] = {"gravity": {"default": 9.81}, "title": {"default": ""}}
    presets = {n: {k: v for k, v in vars(p.material).items() if isinstance(v, (int, float))} for n, p in PRESETS.items()}
    return {"scene": given, "tables": tables, "presets": presets, "live": {}}
