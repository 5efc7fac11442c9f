"""Engines: they take a `chutelab.machine.Machine` and answer with a `chutelab.results.Recording`.

- `contact`: particles that meet; a C core in WebAssembly.
- `pymunk`: the same scene by Pymunk as it is, the check from outside.
"""
