"""What is wrong with an input, drawn at random."""

from math import inf, nan, nextafter

NUMBERS = (
    0, -1, 1, 2**31, -(2**63), 10**400, 0.0, -0.0, 1e-320, 1e-9, 0.5, 1.5, 1e9, 1e308, -1e308,
    float("nan"), float("inf"), float("-inf"),
)  # fmt: skip
TEXTS = (
    "", " ", "$x$", "$", r"\frac{1}{0}", "=1+1", "@SUM(A1)", "a,b", 'a"b', "a;b",
    "<script>alert(1)</script>",
    "&amp;", "\x1b[31mred\x1b[0m", "\x07", "\x00", "\u202eabc", "𝔘🐉", "e\u0301" * 50, "x" * 300,
    "x" * 100_000, "../../x", "/no-such-folder/file",
    "C:\\x", "NaN", "inf", "true", "auto", "exact", "contact", "pymunk", "landed", "1:2", "0:1:3",
    "1,2",
    "1e999", "0x10", "1_000", "{}", "[]", "%s%n", "${HOME}",
)  # fmt: skip
TOKENS = (
    b"", b"\x00", b"\xff\xfe", b"\xed\xa0\x80", b"\r", b"\n\n", b'"', b"'''", b"[", b"]", b"[[",
    b"{", b"}", b"=", b".",
    b",", b";", b"\t", b"#", b"-", b"nan", b"inf", b"1e400", b"9" * 400, b"null", b"true",
    b"[" * 3000, b"a." * 2000,
    b"\\u0000", b"\\ud800",
)  # fmt: skip


def value(rng):
    """Return something that stands where another value belongs."""
    plain = (True, False, rng.choice(NUMBERS), rng.choice(NUMBERS), rng.choice(TEXTS))
    return rng.choice(
        (*plain, [], {}, [rng.choice(plain)], [rng.choice(NUMBERS), rng.choice(NUMBERS)],
         [[0.0, 0.0], [rng.choice(NUMBERS), 1.0]], {"x": rng.choice(plain)})
    )  # fmt: skip


def extreme(rng, rule):
    """Return a value at or beyond an end of what a JSON schema's rule allows, or a wrong one."""
    if "anyOf" in rule:
        rule = rng.choice(rule["anyOf"])
    if rng.random() < 0.15:
        return value(rng)
    kind = rule.get("type")
    if "enum" in rule:
        return rng.choice((*rule["enum"], ""))
    if kind in ("number", "integer"):
        names = ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum", "default")
        ends = [rule[name] for name in names if rule.get(name) is not None]
        beyond = [nextafter(end, side) for end in ends for side in (-inf, inf)]
        tiny = (0, -0.0, -1, 5e-324, 1e-300, 1e-12, 1e12, 1e300, 10**30, nan, inf, -inf)
        return rng.choice((*ends, *ends, *beyond, *tiny))
    if kind == "boolean":
        return rng.choice((True, False))
    if kind == "array" and "prefixItems" in rule:
        items = [extreme(rng, item) for item in rule["prefixItems"]]
        return items[: rng.choice((0, 1, 2, 2, 2, 2))]
    if kind == "array" and "items" in rule and "$ref" not in rule["items"]:
        return [extreme(rng, rule["items"]) for _ in range(rng.choice((0, 1, 2, 40)))]
    return value(rng)


def garbled(rng, data):
    """Return bytes with some of them changed, lost, doubled, moved, or something put in between."""
    for _ in range(rng.choice((1, 1, 1, 2, 4, 16))):
        at, end = sorted(rng.randrange(len(data) + 1) for _ in range(2))
        end = min(end, at + rng.choice((1, 8, 64, 4096)))
        way = rng.randrange(6)
        if way == 0:
            data = data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]
        elif way == 1:
            data = data[:at] + data[end:]
        elif way == 2:
            data = data[:end] + data[at:]
        elif way == 3:
            data = data[:at]
        elif way == 4:
            data = data[end:] + data[:at]
        else:
            data = data[:at] + rng.choice(TOKENS) + data[at:]
    return data


def changed(rng, tables):
    """Return nested tables and lists with one thing replaced, removed, doubled or renamed."""
    if isinstance(tables, int | float) and rng.random() < 0.6:
        return tables * rng.choice((-1, 0, 2, 10, 1000, 0.5, 1e-3, 1.0 + 1e-15))
    if not isinstance(tables, dict | list) or not tables or rng.random() < 0.02:
        return value(rng)
    items = dict(tables) if isinstance(tables, dict) else dict(enumerate(tables))
    key = rng.choice(list(items))
    way = rng.random()
    if way < 0.75:
        items[key] = changed(rng, items[key])
    elif way < 0.85:
        del items[key]
    elif isinstance(tables, dict):
        items[rng.choice(TEXTS)] = items.pop(key) if way < 0.92 else value(rng)
    else:
        items[len(items)] = items[key]
    return items if isinstance(tables, dict) else list(items.values())
