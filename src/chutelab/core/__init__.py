"""What runs in Python and in the page alike, in C.

- `*.c`: the machine of a scene and its releases, the contact engine, the exact engine, and the laws
  by which every run is judged; built to `core.wasm` by `python tools/build_core.py`. `layout.h`
  says what they share with their host, and is a way in.
- `module`: the core in memory, run by wasmtime; numbers in, numbers out.
"""
