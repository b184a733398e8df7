"""Files that are written whole or not at all, and asked before a run whether they could be."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from shutil import rmtree
from typing import Final

from tickrig.host.text.log import log_of


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


# A recording on its way to a file, line by line.

_logger = log_of(__name__)

_BINARY: Final[int] = getattr(os, "O_BINARY", 0)
"""Windows would write CR LF."""


class LineFile:
    """A file of lines; what is written is there at once, so a kill loses nothing.

    Where writing fails the recording ends with one warning, and the run goes on.

    Args:
        path: the file; one that exists is replaced.
        first: its first line.
        running: what goes on without it, for the warning.

    Attributes:
        error: why the recording ended early, empty while all is well.

    Raises:
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path, first: str, running: str = "the emulator") -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | _BINARY, 0o666)
        self._path, self._running = path, running
        self.error = ""
        self.write([first])

    def write(self, lines: Sequence[str]) -> None:
        """Append lines, without LF."""
        if self._fd < 0 or not lines:
            return
        data = "".join(f"{line}\n" for line in lines).encode("ascii")
        try:
            while data:
                data = data[os.write(self._fd, data) :]
        except OSError as error:
            self.error = f"{self._path}: {error.strerror}"
            _logger.warning("recording ended: %s; %s goes on", self.error, self._running)
            self._close()

    def close(self, last: str) -> None:
        """Write the last line and close the file; closing twice is no error."""
        self.write([last])
        self._close()

    def _close(self) -> None:
        if self._fd >= 0:
            os.close(self._fd)
        self._fd = -1
