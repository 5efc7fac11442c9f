"""The files of ``--out``: made in a folder of their own, then moved in, all of them or none."""

from __future__ import annotations

import json
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from chutelab.cli.parameters import KINDS
from chutelab.cli.program import RefusedError
from chutelab.cli.progress import progress

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from chutelab.accuracy import Accuracy
    from chutelab.recording import Recording


@contextmanager
def destination(folder: Path | None, kinds: Sequence[str]) -> Iterator[Path | None]:
    """Give an empty folder to write to; at the end its files move to `folder`, which is made.

    To be entered before a long run, so that a folder that cannot be written to is refused at once.
    None stays None.

    Raises
    ------
    RefusedError
        If the folder cannot be written to, or is none.
    """
    if folder is None:
        yield None
        return
    try:
        anchor = folder
        while not anchor.exists():
            anchor = anchor.parent
        if not anchor.is_dir():
            raise RefusedError(f"--out {folder}: {anchor} is a file, not a folder")
        for name in (name for kind in kinds for name in KINDS[kind]):
            if (folder / name).is_dir():
                raise RefusedError(f"--out {folder}: {folder / name} is a folder, not a file")
        with tempfile.TemporaryDirectory(prefix=".chutelab-", dir=anchor) as unfinished:
            yield Path(unfinished)
            folder.mkdir(parents=True, exist_ok=True)
            for file in sorted(Path(unfinished).iterdir()):
                file.replace(folder / file.name)
    except OSError as error:
        reason = error.strerror or str(error)
        raise RefusedError(f"--out {folder}: cannot be written to: {reason}") from error


def write(
    recording: Recording,
    folder: Path,
    kinds: Sequence[str],
    *,
    quiet: bool,
    accuracy: Accuracy | None = None,
) -> None:
    """Write the files of the given `KINDS` into an existing folder."""
    for kind in kinds:
        with progress(f"writing {' and '.join(KINDS[kind])}", quiet=quiet):
            _write(recording, folder, kind, accuracy)


def _write(recording: Recording, folder: Path, kind: str, accuracy: Accuracy | None) -> None:
    match kind:
        case "png":
            from chutelab.plots import overlay

            overlay(recording, path=folder / "overlay.png")
        case "strobe":
            from chutelab.plots import strobe

            strobe(recording, path=folder / "strobe.png")
        case "gif" | "mp4" | "webm":
            from chutelab.animate import animate

            animate(recording, folder / f"lesson.{kind}")
        case "csv":
            recording.to_csv(folder)
        case "npz":
            recording.save(folder / "recording.npz")
        case "json":
            from chutelab.summary import summary

            text = json.dumps(summary(recording, accuracy), indent=1, allow_nan=False)
            (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
