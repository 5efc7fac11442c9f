"""Options of commands, defined once: type and default in the signature, the rest in the docstring.

::

    @command("Find the angle, speed, distance ... that does what you want.")
    def solve(scene: SceneName, *, vary: tuple[str, ...], points: int = 181, quiet: bool) -> None:
        '''Change SCENE until a quantity has the value wanted.

        --vary KEY=FROM:TO  A key of the scene and the range to search. [required]
        --points N  How many values to look at first. [default]
        '''

Parameters before the star are arguments. A tuple may be given several times, a `bool` is a flag, a
`Literal` a choice; ``Annotated`` adds how a value is read, or how a shell completes it. Options
that are not in the docstring are in `SHARED`. A parameter that is a dataclass stands for all its
fields.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import is_dataclass
from errno import EINVAL, ELOOP, ENAMETOOLONG
from functools import cached_property
from inspect import Parameter, cleandoc, signature
from pathlib import Path
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import click
from click.shell_completion import CompletionItem

from chutelab.cli.console import RefusedError, main
from chutelab.util.errors import InputError, cut, printable
from chutelab.util.files import check, refuse_other, together, writing
from chutelab.util.tables import plain

if TYPE_CHECKING:
    from chutelab.scene import Scene
    from chutelab.scene.variants import Vary
    from chutelab.studies.design.uncertainty import Given

SHARED = """
--set KEY=VALUE  Change a key of the scene, such as plate.angle_deg=20 or particle.radius=4mm. May
    be repeated.
--engine  Same as --set run.engine=...
--dt S  Same as --set run.dt=S.
--json  Print one JSON object instead of tables.
--language LANGUAGE  Of the texts: en, or de where they are translated; the rest is in English.
    [default]
--repeat N  Run with N seeds, those of the streams plus 0 to N - 1, the same for all variants: every
    number is a mean ± its standard error, s / √N.
--jobs N  Spread the work over N processes; 0 is one for each processor.
--scheduler ADDRESS  Spread it over a Dask cluster instead.
-q, --quiet  Print nothing, and show no progress bar.
"""
"""Options of several commands."""

_ENTRY = re.compile(r"^(-.*?)  +(.*(?:\n    .*)*)\n?", re.MULTILINE)


class Command(click.Command):
    """A command made from a function; its docstring is read when it is first needed.

    At most one command per process needs it, whether it runs or its help is shown.
    """

    callback: Callable[..., None]

    def __init__(self, function: Callable[..., None], short: str | None) -> None:
        super().__init__(function.__name__.rstrip("_"), callback=function, short_help=short)
        self._parts: dict[str, Any] = {}
        del self.params, self.help

    @cached_property
    def params(self) -> list[click.Parameter]:  # type: ignore[override]
        """The parameters of the function."""
        return list(_parameters(self.callback, self._parts))

    @cached_property
    def help(self) -> str:  # type: ignore[override]
        """The docstring without the options."""
        text = _ENTRY.sub("", cleandoc(self.callback.__doc__ or ""))
        return re.sub(r"\n\n+(?=chutelab |.*\n +\S)", "\n\n\b\n", text)

    def invoke(self, ctx: click.Context) -> Any:
        """Call the function; its dataclasses are built from their fields."""
        for name, kind in self._parts.items():
            fields = {one: ctx.params.pop(one) for one in signature(kind).parameters}
            ctx.params[name] = kind(**fields)
        return super().invoke(ctx)


def command(
    short: str | None = None, group: click.Group = main, *, cls: type[Command] = Command
) -> Callable[[Callable[..., None]], Command]:
    """Make a function a command of a group; its docstring becomes the help.

    Paragraphs that begin with ``chutelab``, or have indented lines, keep their lines.
    """

    def made(function: Callable[..., None]) -> Command:
        new = cls(function, short)
        group.add_command(new)
        return new

    return made


def _parameters(taker: Callable[..., Any], parts: dict[str, Any]) -> Iterator[click.Parameter]:
    """Yield the parameters of a function or a dataclass; note its dataclasses in `parts`."""
    entries = _ENTRY.findall(SHARED) + _ENTRY.findall(cleandoc(taker.__doc__ or ""))
    told = {re.findall("--([a-z0-9-]+)", form)[0]: (form, text) for form, text in entries}
    hints = get_type_hints(taker, include_extras=True)
    for name, parameter in signature(taker).parameters.items():
        kind, extras, several = hints[name], list[Any](), False
        if is_dataclass(kind):
            parts[name] = kind
            yield from _parameters(kind, parts)  # type: ignore[arg-type]
            continue
        # `X | None`, `tuple[X, ...]` and `Annotated[X, ...]` take an X.
        while (outer := get_origin(kind)) in (Annotated, tuple, Union, UnionType):
            several = several or outer is tuple
            kind, *others = get_args(kind)
            extras += others if outer is Annotated else []
        usual: Any = FileName(path_type=Path) if kind is Path else kind
        if get_origin(kind) is Literal:
            usual = click.Choice(get_args(kind))
        read = next((one for one in extras if isinstance(one, click.ParamType)), usual)
        needed = parameter.default is Parameter.empty
        offer = next((one for one in extras if one is not read), None)
        settings: dict[str, Any] = {
            "type": read,
            "shell_complete": offer and (lambda _ctx, _parameter, begun, offer=offer: offer(begun)),
        }
        if not (needed or several):
            settings["default"] = parameter.default
        if parameter.kind is not Parameter.KEYWORD_ONLY:
            form = name.upper().removesuffix("S") if several else name.upper()
            form = (form if needed else f"[{form}]") + "..." * several
            nargs = -1 if several else 1
            yield click.Argument([name], metavar=form, nargs=nargs, required=needed, **settings)
            continue
        long = name.rstrip("_").replace("_", "-")
        form, text = told.get(long, (f"--{long}", ""))  # `python -OO` has no docstrings
        words = form.replace(" / ", "/").replace(", ", " ").split()
        if kind is bool:
            settings |= {"type": None, "is_flag": True}
        yield click.Option(
            [name, *(word for word in words if word[0] == "-")],
            metavar=words[-1] if words[-1][0] != "-" else None,
            multiple=several,
            help=re.sub(r" \[(default|required)\]$", "", " ".join(text.split())),
            show_default=text.endswith("[default]"),
            required=text.endswith("[required]"),
            **settings,
        )


def complete_scene(begun: str) -> list[CompletionItem]:
    """Offer the shipped scenes that begin with a text, and files."""
    from chutelab.scene import about

    titles = {scene.name: scene.title for scene in about()}
    return [*beginning(titles, begun), CompletionItem(begun, type="file")]


def beginning(told: Mapping[str, str], begun: str) -> list[CompletionItem]:
    """Offer the names that begin with a text, each with its description."""
    return [CompletionItem(n, help=text) for n, text in told.items() if n.startswith(begun)]


class Number(click.FloatRange):
    """A number in a range; click's messages call it "number"."""

    name = "number"


class Count(click.IntRange):
    """A whole number in a range; click's messages call it "whole number"."""

    name = "whole number"


DEEPEST = 200
"""Most nested folders in a name, since making them is recursive."""


class FileName(click.Path):
    """The name of a file or folder; refused if the system allows no such name."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the name as `click.Path` does."""
        said = cut(printable(str(value)), 60)
        try:
            os.lstat(value)
        except ValueError:
            self.fail(f"'{said}': no file can have this name.", param, ctx)
        except OSError as error:
            if error.errno in (EINVAL, ELOOP, ENAMETOOLONG):
                self.fail(f"'{said}': {error.strerror}.", param, ctx)
        if len(Path(value).parts) > DEEPEST:
            self.fail(f"'{said}': more than {DEEPEST} folders deep.", param, ctx)
        return super().convert(value, param, ctx)


class FolderName(FileName):
    """The name of a folder; it is made if there is none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the name as a path."""
        if value == "":
            self.fail("the name of a folder is empty", param, ctx)
        return Path(super().convert(value, param, ctx))


PICTURES = (".png", ".svg", ".pdf")
"""Suffixes of pictures."""

Texts = tuple[str, ...]
SceneName = Annotated[str, complete_scene]
Engine = Literal["auto", "exact", "contact", "pymunk"] | None
Seconds = Annotated[float, Number(min=0.0, min_open=True)]
Coefficient = Annotated[float | None, Number(min=0.0, min_open=True)]
Jobs = Annotated[int, Count(min=0)]
Repeat = Annotated[int, Count(min=1)]
Folder = Annotated[Path | None, FolderName()]


def loaded_as_told(
    name: str,
    overrides: Sequence[str],
    engine: str | None = None,
    dt: float | None = None,
    loads: float | None = None,
) -> Scene:
    """Load a scene changed by ``--set`` and by options for keys; the title names the changes."""
    from chutelab.scene import load
    from chutelab.scene.overrides import Override

    settings: list[str | Override] = list(overrides)
    if engine is not None:
        settings.append(Override("run.engine", engine, f"--engine {engine}"))
    if dt is not None:
        settings.append(Override("run.dt", dt, f"--dt {dt:.12g}"))
    if loads is not None:
        settings.append(Override("run.loads", loads, f"--loads {loads:.12g}"))
    return retitled(load(name, settings), overrides)


def retitled(scene: Scene, changes: Sequence[str]) -> Scene:
    """Return a scene whose title says what was changed of its machine, each ``KEY=VALUE``.

    A title such as "2 m/s" would be wrong for a changed machine.
    """
    if any(change.partition("=")[0].strip() == "title" for change in changes):
        return scene
    stripped = [change.strip() for change in changes]
    told = [change for change in stripped if not change.startswith(("run.", "live."))]
    if not told:
        return scene
    joint = ", " if "; with " in scene.title else "; with "
    title = joint.join((scene.title, ", ".join(told)))
    return scene.model_copy(update={"title": title if len(title) <= 200 else f"{title[:198]} …"})


@contextmanager
def destination(folder: Path | None, names: Iterable[str] = ()) -> Iterator[Path | None]:
    """Give an empty folder to write to; at the end its files move to `folder`, made if need be.

    Enter it before a long run: a `folder` that cannot be written to, is not a folder, or has
    folders with the names of the files (`names`) is refused at once. None stays None.
    """
    if folder is None:
        yield None
        return
    try:
        for name in names:
            refuse_other(folder / name)
        with together(folder) as unfinished:
            yield unfinished
    except OSError as error:
        named = Path(error.filename or folder)
        if named not in (folder, *folder.parents) and folder not in named.parents:
            raise
        reason = error.strerror or str(error)
        raise RefusedError(f"--out {folder}: cannot be written to: {reason}") from error


def check_file(option: str, path: Path | None, suffixes: Sequence[str] = ()) -> None:
    """Refuse the file of an option, before anything runs, if it cannot be written.

    With `suffixes` it must end in one of them.
    """
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise RefusedError(f"{option} {path}: give a name that ends in {' or '.join(suffixes)}")
    with writing(f"{option} {path}".strip()):
        check(path)


def write_json(value: Any, path: Path) -> None:
    """Write one JSON object into a file, see `chutelab.util.tables.plain`."""
    path.write_text(json.dumps(plain(value), indent=1, allow_nan=False) + "\n", encoding="utf-8")


def varied(texts: Sequence[str], *, ranges: bool) -> list[Vary]:
    """Read what ``--vary`` takes: KEY=FROM:TO:COUNT or KEY=a,b,c; with `ranges` KEY=FROM:TO.

    Numbers may have units, such as 0.5mm. Raises an `InputError`.
    """
    from chutelab.scene.variants import Range, Vary, numbers

    form = "must be KEY=FROM:TO, such as plate.angle_deg=-20:70"
    if not ranges:
        form = "must be KEY=FROM:TO:COUNT, such as plate.angle_deg=-20:70:46, or KEY=a,b,c"
    found: list[Vary] = []
    for text in texts:
        typed = f"--vary {text}"
        key, given = _halves(text, typed, form)
        parts = given.split(":")
        if ranges and len(parts) != 2:
            raise InputError(f"a range is between two ends: it {form}", typed)
        if not ranges and len(parts) not in (1, 3):
            raise InputError(form, typed)
        count = parts.pop().strip() if len(parts) == 3 else None
        if len(parts) == 1:
            parts = given.split(",")
            if len(parts) > MOST_VALUES:
                raise InputError(f"{len(parts)} values, at most {MOST_VALUES} are allowed", typed)
        values, unit = numbers(typed, parts, form)
        if count is not None:
            values = _spaced(values[0], values[1], count, typed)
        found.append((Range if ranges else Vary)(key, values, typed, unit))
    return found


MOST_VALUES = 10_000
"""Most values of one key; more would be a typing error."""


def _spaced(first: float, last: float, written: str, typed: str) -> tuple[float, ...]:
    """Return COUNT numbers from one to another."""
    count = int(written) if written.isdecimal() else 0
    if not 1 <= count <= MOST_VALUES:
        found = f"COUNT = {written or 'nothing'}"
        raise InputError(f"{found}; it must be a whole number from 1 to {MOST_VALUES}", typed)
    if count == 1:
        return (first,)
    if first == last:
        raise InputError(f"the range is empty: from {first:g} to {last:g}", typed)
    # Rounded, so that 0.3 is not 0.30000000000000004 and a rounded 0 is 0.
    nothing = 1e-13 * max(abs(first), abs(last))
    inside = (first + (last - first) * i / (count - 1) for i in range(1, count - 1))
    rounded = (0.0 if abs(value) < nothing else float(f"{value:.12g}") for value in inside)
    return (first, *rounded, last)


def targets(texts: Sequence[str]) -> list[tuple[str, str]]:
    """Read what ``--target`` takes, QUANTITY=VALUE; raises an `InputError`."""
    form = "must be QUANTITY=VALUE, such as landing.x=1.2 or landing.vx=outgoing.speed"
    return [_halves(text, f"--target {text}", form) for text in texts]


def limits(texts: Sequence[str]) -> dict[str, tuple[str | None, str | None]]:
    """Read what ``--subject-to`` takes, QUANTITY>=VALUE or <=; raises an `InputError`."""
    found: dict[str, tuple[str | None, str | None]] = {}
    for text in texts:
        match = re.fullmatch(r"\s*([^<>=]+?)\s*([<>])=?\s*([^<>=]+?)\s*", text)
        if match is None:
            form = "must be QUANTITY>=VALUE or QUANTITY<=VALUE, such as arrival.share>=0.95"
            raise InputError(form, f"--subject-to {text}")
        name, sense, value = match.groups()
        least, most = found.get(name, (None, None))
        if (least if sense == ">" else most) is not None:
            raise InputError(f"{name} has such a limit already", f"--subject-to {text}")
        found[name] = (value, most) if sense == ">" else (least, value)
    return found


def uncertain(texts: Sequence[str]) -> list[Given]:
    """Read what ``--uncertainty`` takes, KEY=MEAN±SPREAD:LAW; raises an `InputError`."""
    from chutelab.studies.design.uncertainty import Given

    found = []
    for text in texts:
        match = re.fullmatch(r"([^=]+)=([^:]*?)(?:±|\+/-|\+-)([^:]*?)(?::(.*))?", text)
        if match is None:
            raise InputError(
                "must be KEY=MEAN±SPREAD, such as restitution=0.5±0.05 or incoming.speed=2+-1% (or"
                " ±SPREAD alone, around the scene's value); :uniform at the end makes SPREAD a"
                " half-width",
                f"--uncertainty {text}",
            )
        key, mean, spread, law = (part.strip() for part in match.groups(default=""))
        found.append(Given(key, mean or None, spread, law or "normal"))
    return found


def _halves(text: str, typed: str, form: str) -> tuple[str, str]:
    """Return what is left and right of the first equals sign."""
    left, _, right = (part.strip() for part in text.partition("="))
    if not (left and right):
        raise InputError(form, typed)
    return left, right
