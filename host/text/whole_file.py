"""Files that are written whole or not at all, and asked before a run whether they could be."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from shutil import rmtree


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
        OSError: the file cannot be written; its `filename` is `path`, and the file is as it was.
    """
    data = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
    with replacing(path) as beside:
        beside.write_bytes(data)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give the path of a new file, which takes the place of a file when the block is done.

    It has the same name, in a folder beside that file. What is no file, as a pipe, is given itself.

    Raises:
        OSError: the file cannot be written; its `filename` is `path`, and the file is as it was.
            An OSError of the block is raised so, too.
    """
    from tempfile import mkdtemp  # noqa: PLC0415 - slow, and a TAB needs none

    folder: Path | None = None
    try:
        place = path.resolve()
        if is_special(place):
            yield place
            return
        _check_place(place)
        folder = Path(mkdtemp(prefix=".tickrig.", dir=place.parent))
        beside = folder / place.name
        yield beside
        _sync(beside)
        if place.exists():
            beside.chmod(place.stat().st_mode & 0o7777)
        beside.replace(place)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        if folder is not None:
            rmtree(folder, ignore_errors=True)


def _check_place(place: Path) -> None:
    """Refuse what a new file would replace though it is a folder, or not to be written."""
    if place.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if place.exists() and not os.access(place, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _sync(path: Path) -> None:
    """Let a file be on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        if sys.platform != "win32":  # there only what is open for writing can be
            os.fsync(descriptor)
    finally:
        os.close(descriptor)
