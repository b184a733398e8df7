"""Files that are written whole or not at all, and asked before a run whether they could be."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path


def check_file(path: Path, what: str) -> None:
    """See before a run whether a file could be written after it.

    Args:
        path: of the file.
        what: it is, for the message, as `report` or `--html`.

    Raises:
        ValueError: its folder is not there or takes no file, or it is a folder itself.
    """
    if not path.parent.is_dir():
        raise ValueError(f"{what} {path}: no directory {path.parent}")
    if path.is_dir():
        raise ValueError(f"{what} {path}: it is a directory")
    if not is_special(path):
        try:
            check_writable(path.resolve().parent)
        except OSError as error:
            raise ValueError(f"{what} {path}: {error.strerror}") from None


def check_not_read(path: Path, what: str, inputs: Iterable[Path]) -> None:
    """See that a file is none of those that a run reads.

    Args:
        path: of the file.
        what: it is, for the message, as `--html`.
        inputs: what is read; what is no file is none.

    Raises:
        ValueError: it is one of them.
    """
    if any(_are_one(path, each) for each in inputs):
        raise ValueError(f"{what} {path}: the run reads this file, it would be overwritten")


def _are_one(path: Path, other: Path) -> bool:
    try:
        return path.samefile(other)
    except (OSError, ValueError):
        return False


def is_special(path: Path) -> bool:
    """Return whether it is something else than a file or folder, such as a pipe."""
    return path.exists() and not (path.is_file() or path.is_dir())


def check_writable(folder: Path) -> None:
    """See whether files can be made in a folder, by making one; it may be a folder to be made.

    Raises:
        OSError: none can.
    """
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    beside = folder / f".tickrig.{os.getpid()}"
    try:
        beside.write_bytes(b"")
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)


def write_whole(path: Path, content: str | bytes) -> None:
    """Replace a file when its content is on the disk; what is no file, as a pipe, is written to.

    Raises:
        OSError: the file cannot be written; its `filename` is `path`.
    """
    data = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
    try:
        place = path.resolve()
        if place.exists() and not place.is_file():
            place.write_bytes(data)
        else:
            _replace(place, data)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def _replace(path: Path, data: bytes) -> None:
    beside = path.with_name(f".{path.name[:200]}.{os.getpid()}")
    try:
        beside.unlink(missing_ok=True)  # of a run that was killed
        with beside.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)
