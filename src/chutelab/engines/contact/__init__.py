"""Particles that meet: impacts at their own instants, lasting contacts by contact dynamics.

- `core/`: the engine itself in C, built to `core.wasm` by `python tools/build_core.py`; `layout.h`
  says what it shares with its host, and is a way in.
- `module`: the module in memory, run by wasmtime; numbers in, numbers out.
- `engine`: `run`, from a machine to a recording.
"""

from chutelab.engines.contact.engine import run

__all__ = ["run"]
