"""Files that are written atomically, and checked before a run."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from tickrig.host.text.log import log_of


def check_file(path: Path, what: str) -> None:
    """Check before a run that an output file can be written at the end of the run.

    Args:
        path: path of the file.
        what: name of the file in messages, such as `report` or the option `--html`.

    Raises:
        ValueError: the folder of the file does not exist or is not writable, or the path is a
            folder.
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
    """Check that an output file would not overwrite a file that the run reads.

    Args:
        path: path of the output file.
        what: name of the output file in messages, such as `--html`.
        inputs: paths that the run reads. Paths that are not files are ignored.

    Raises:
        ValueError: the output file is one of the inputs.
    """
    if any(_are_one(path, each) for each in inputs):
        raise ValueError(f"{what} {path}: the run reads this file, it would be overwritten")


def _are_one(path: Path, other: Path) -> bool:
    try:
        return path.samefile(other)
    except (OSError, ValueError):
        return False


def is_special(path: Path) -> bool:
    """Return whether a path exists and is neither a file nor a folder, such as a pipe."""
    return path.exists() and not (path.is_file() or path.is_dir())


def check_writable(folder: Path) -> None:
    """Check that files can be created in a folder, by creating a temporary file.

    If the folder does not exist yet, the nearest existing folder above it is checked.

    Raises:
        OSError: no file can be created in the folder.
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
    """Replace the content of a file in one step, so that the file is never incomplete.

    The content is first written to a temporary file, which then replaces the file. A pipe or
    another special file is written directly.

    Raises:
        OSError: the file cannot be written. The attribute `filename` of the exception is `path`,
            and the file is unchanged.
    """
    data = content.encode("utf-8", "backslashreplace") if isinstance(content, str) else content
    with replacing(path) as beside:
        beside.write_bytes(data)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Context manager that replaces a file. It yields a temporary path for the new content.

    The temporary file has the name of the old file, and is in a new folder next to the old file. At
    the end of the block, the temporary file replaces the old file. A file that is not regular, such
    as a pipe, is not replaced. In this case, the path of this file is yielded.

    Raises:
        OSError: the file cannot be written, or the code in the `with` block has raised an OSError.
            The attribute `filename` of the exception is `path`, and the file is unchanged.
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
            from shutil import rmtree  # noqa: PLC0415 - slow

            rmtree(folder, ignore_errors=True)


def _check_place(place: Path) -> None:
    """Refuse to replace a folder or a read-only file."""
    if place.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if place.exists() and not os.access(place, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _sync(path: Path) -> None:
    """Sync a file to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        if sys.platform != "win32":  # there only what is open for writing can be
            os.fsync(descriptor)
    finally:
        os.close(descriptor)


# A recording on its way to a file, line by line.

_logger = log_of(__name__)

_BINARY: Final[int] = getattr(os, "O_BINARY", 0)
"""Line end on all systems, because Windows would write CR LF."""


class LineFile:
    """Text file to which lines are written at once, so that killing the process loses no line.

    It is used for recordings. If writing fails, the recording ends with one warning, and the run
    continues.

    Args:
        path: path of the file. An existing file is replaced.
        first: first line of the file.
        running: text for the warning, such as `the emulator`. It names the program that continues
            without the recording.

    Attributes:
        error: reason why the recording has ended early, or empty if it has not ended early.

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
        """Write the last line and close the file. Closing it again has no effect."""
        self.write([last])
        self._close()

    def _close(self) -> None:
        if self._fd >= 0:
            os.close(self._fd)
        self._fd = -1
