"""Engines: they take a `chutelab.machine.Machine` and answer with a `chutelab.results.Recording`.

- `exact`: event-driven, for particles that do not meet each other.
- `contact`: particles that meet; a C core in WebAssembly.
- `pymunk`: the same scene by Pymunk as it is, an independent check.
- `reference`: one particle by SciPy's DOP853, for `chutelab.studies.accuracy` to compare with.
- `simulation`: `simulate`, which chooses.
- `hand`: `start`, a run by hand, step by step.
"""
