"""Build the core: C to WebAssembly, and its memory layout to JSON.

    python tools/build_core.py           # writes the files below beside the C files
    python tools/build_core.py --check   # builds anew and compares the bytes with what is there

core.wasm is what Python runs, page.wasm what a page carries: the same without the engines and the
batches that only Python has, a quarter less. layout.json says where in memory everything is.

Needs the compiler of the `ziglang` package in the version that `pyproject.toml` pins (the `dev`
extra): the same version gives the same bytes on every machine.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

CORE = Path(__file__).parents[1] / "src" / "chutelab" / "core"

EXPORTS = (
    "room", "world", "lay_out_world", "prepare", "prepare_to_judge", "run", "run_and_judge", "plan",
    "lay_out_plan", "build", "drawing", "draw", "exact", "lay_out_exact", "follow_and_judge",
    "run_exact", "run_world", "loads", "lay_out_bins", "laws", "lay_out_laws", "judge", "opened",
    "sine", "cosine", "angle_of", "angle_of_cosine", "push_disk", "turn_hinge", "steer",
    "pack_events", "judge_plan",
)  # fmt: skip
"""What a host can call."""

PYTHON = (
    "prepare_to_judge", "run_and_judge", "exact", "lay_out_exact", "follow_and_judge", "run_exact",
    "run_world", "opened", "steer", "pack_events", "judge_plan",
)  # fmt: skip
"""Of these what no page calls."""

BUILT = {"core.wasm": EXPORTS, "page.wasm": [name for name in EXPORTS if name not in PYTHON]}

FLAGS = (
    "-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c99", "-O3", "-msimd128", "-flto",
    "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-fvisibility=hidden", "-Wl,--strip-all",
)  # fmt: skip
"""No fused multiply-add: every engine that runs the file has to round alike. Vectors of two doubles
round as doubles do."""

MUSL = (
    "__math_divzero", "__math_invalid", "__math_oflow", "__math_uflow", "__math_xflow", "atan2",
    "exp_data", "pow", "pow_data",
)  # fmt: skip
"""Files of the C library in C with what the core calls; the linker tells if one is missing."""

ONCE = (
    "exact_cuts", "exact_joints", "exact_pieces", "hand", "loads", "nominal", "plan", "prepare",
    "random", "releases", "room",
)  # fmt: skip
"""Files that a run passes through once, or once an event: they are compiled for size, which leaves
the page room and costs no time that can be measured."""

SMALL = """#pragma clang attribute push(__attribute__((minsize)), apply_to = function)
{}
#pragma clang attribute pop
"""

SIZES = {"double": 8, "float": 4, "int": 4, "pointer": 4}


def layout(text: str) -> dict[str, object]:
    """Read structs and enums of layout.h: field -> [offset, type, how many].

    Raises
    ------
    ValueError
        If a line is neither, or of a type that is not known.
    """
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    numbers = re.findall(r"#define (\w+) ([\d.e-]+)", text)
    constants = {name: int(one) if one.isdigit() else float(one) for name, one in numbers}
    enums = {
        name: {value.strip(): n for n, value in enumerate(values.split(","))}
        for name, values in re.findall(r"enum (\w+) \{([^}]*)\}", text)
    }
    structs: dict[str, dict[str, object]] = {}
    for body, struct in re.findall(r"typedef struct \{([^}]*)\} (\w+);", text):
        fields, offset = {}, 0
        for line in filter(None, map(str.strip, body.split(";"))):
            kind, names = line.split(maxsplit=1)
            for part in names.split(","):
                match = re.fullmatch(r"\s*(\*?)(\w+)(?:\[(\w+)\])?\s*", part)
                if match is None:
                    raise ValueError(f"layout.h, {struct}: {line!r}")
                star, name, many = match.groups()
                count = int(constants.get(many, many)) if many else 1
                type_ = "pointer" if star else kind
                size = SIZES[type_]
                offset = -(-offset // size) * size
                fields[name] = [offset, type_, count]
                offset += size * count
        structs[struct] = {"size": -(-offset // 8) * 8, "fields": fields}
    return {"structs": structs, "enums": enums, "constants": constants}


def checks(described: Any) -> str:
    """Return C that does not compile where the compiler lays a struct out otherwise."""
    lines = ["#include <stddef.h>", '#include "layout.h"']
    for struct, its in described["structs"].items():
        lines.append(f'_Static_assert(sizeof({struct}) == {its["size"]}, "{struct}");')
        for name, (offset, _, _) in its["fields"].items():
            same = f"offsetof({struct}, {name}) == {offset}"
            lines.append(f'_Static_assert({same}, "{struct}.{name}");')
    return "\n".join(lines) + "\n"


def compiled(*commands: list[str | Path]) -> None:
    """Run commands of the compiler beside each other."""
    compilers = [
        subprocess.Popen([sys.executable, "-m", "ziglang", *command], cwd=CORE)
        for command in commands
    ]
    codes = [compiler.wait() for compiler in compilers]
    if any(codes):
        raise SystemExit(1)


def library(place: Path) -> list[str | Path]:
    """Compile what the core needs of the C library; return it and the flags to use it with.

    The compiler itself would build all of it, which takes longer than the core.
    """
    spec = find_spec("ziglang")
    if spec is None or spec.origin is None:
        raise SystemExit("needs the compiler: pip install ziglang, as pyproject.toml pins it")
    lib = Path(spec.origin).parent / "lib"
    target = ("-target", "wasm32-wasi")
    musl = lib / "libc" / "musl"
    math = [musl / "src" / "math" / f"{name}.c" for name in MUSL]
    sources = [*math, lib / "libc" / "wasi" / "libc-bottom-half" / "crt" / "crt1-reactor.c"]
    inside = ("-I", musl / "src" / "internal", "-I", musl / "arch" / "generic")
    c = ("cc", *target, "-c", "-O3", "-ffp-contract=off", "-Dhidden=", *inside)
    zig = ("build-obj", *target, "-O", "ReleaseFast", "-fstrip", "-lc")
    roots = [lib / "c.zig", lib / "compiler_rt.zig"]
    made = {source: place / f"{source.stem}.o" for source in (*roots, *sources)}
    compiled(
        *([*zig, source, f"-femit-bin={made[source]}"] for source in roots),
        *([*c, source, "-o", made[source]] for source in sources),
    )
    headers = [lib / "libc" / "include" / name for name in ("wasm-wasi-musl", "generic-musl")]
    return ["-nostdlib", *(part for one in headers for part in ("-isystem", one)), *made.values()]


def build(folder: Path) -> None:
    """Write both cores and layout.json into a folder."""
    described = layout((CORE / "layout.h").read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as place:
        sources: list[str | Path] = []
        for source in sorted(CORE.glob("*.c")):
            small = Path(place) / source.name
            text = source.read_text(encoding="utf-8")
            small.write_text(SMALL.replace("{}", text), encoding="utf-8")
            sources.append(small if source.stem in ONCE else source)
        check = Path(place) / "layout.c"
        check.write_text(checks(described), encoding="utf-8")
        linked = library(Path(place))
        compiled(
            *(
                [
                    "cc", *FLAGS, "-I", CORE, *(f"-Wl,--export={one}" for one in exports),
                    "-o", folder / name, *sources, check, *linked,
                ]
                for name, exports in BUILT.items()
            )
        )  # fmt: skip
    text = json.dumps(described) + "\n"
    (folder / "layout.json").write_text(text, encoding="utf-8")


def main() -> int:
    """Build, or compare with what is committed; 1 if that is not what the sources give."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    if not parser.parse_args().check:
        build(CORE)
        for name in BUILT:
            print(f"{name}: {(CORE / name).stat().st_size} bytes")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        build(Path(folder))
        old = [
            name
            for name in (*BUILT, "layout.json")
            if (Path(folder) / name).read_bytes() != (CORE / name).read_bytes()
        ]
    if old:
        print(f"{', '.join(old)}: not what the sources give; run python tools/build_core.py")
    return bool(old)


if __name__ == "__main__":
    sys.exit(main())
