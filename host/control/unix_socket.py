"""A listening Unix socket under a path, without leftovers."""

from __future__ import annotations

import errno
import os
import socket
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from pathlib import Path

_MAX_PATH_BYTES: Final = 107
"""Length of the longest path for the kernel, without the zero at the end (unix(7), sun_path)."""


def unix_socket() -> socket.socket:
    """Return a new Unix socket, not yet bound or connected.

    Raises:
        OSError: the system is Windows, where Python has no Unix sockets.
    """
    if sys.platform == "win32":
        raise OSError(errno.EAFNOSUPPORT, "there are no Unix sockets on Windows")
    else:  # noqa: RET506 - mypy leaves out the branch of the other system
        return socket.socket(socket.AF_UNIX)


def listen_at(path: Path) -> socket.socket:
    """Return a non-blocking listening socket at a path, to which only this user may connect.

    A socket file that a killed process has left is replaced.

    Raises:
        FileExistsError: another process listens at the path, or the path is not a socket.
        BlockingIOError: another program holds a lock on the folder for more than a second.
        OSError: the socket cannot be created.
    """
    listener = unix_socket()
    try:
        with _alone_in(path.parent):
            _check(path)
            _publish(listener, path)
    except OSError as error:
        listener.close()
        raise OSError(
            error.errno or errno.EINVAL, error.strerror or str(error), str(path)
        ) from None
    listener.setblocking(False)
    return listener


_LOCK_TRIES: Final = 100
_LOCK_AGAIN_S: Final = 0.01


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Serialize processes that start at the same time. Each process takes milliseconds."""
    held = os.open(folder, os.O_RDONLY)
    try:
        if sys.platform != "win32":
            _lock(held, folder)
        yield
    finally:
        os.close(held)


if sys.platform != "win32":

    def _lock(held: int, folder: Path) -> None:
        """Lock a folder. Raise BlockingIOError if another program holds the lock."""
        import fcntl  # noqa: PLC0415 - not on Windows

        for _ in range(_LOCK_TRIES):
            with suppress(BlockingIOError):
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            time.sleep(_LOCK_AGAIN_S)
        why = f"another program holds a lock on the folder {folder}; name a file in another folder"
        raise BlockingIOError(errno.EWOULDBLOCK, why)


def _check(path: Path) -> None:
    """Raise FileExistsError unless the path is free, or the socket of a killed process."""
    if _is_socket(path) and _is_live(path):
        raise FileExistsError(errno.EEXIST, "another process listens there")
    if path.is_symlink() or (path.exists() and not _is_socket(path)):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))


def _publish(listener: socket.socket, path: Path) -> None:
    """Listen first, then create the path, so that every client that sees the path can connect.

    The socket is renamed, not linked. On the file system of User-Mode Linux, a link would be
    another socket.
    """
    if len(os.fsencode(path)) > _MAX_PATH_BYTES:
        raise OSError(errno.ENAMETOOLONG, "AF_UNIX path too long", str(path))
    hidden = path.with_name(f".{os.getpid()}")
    mask = os.umask(0o177)
    try:
        listener.bind(str(hidden))
        listener.listen()
        hidden.replace(path)
    finally:
        os.umask(mask)
        hidden.unlink(missing_ok=True)


def _is_socket(path: Path) -> bool:
    try:
        return stat.S_ISSOCK(path.lstat().st_mode)
    except OSError:
        return False


def _is_live(path: Path) -> bool:
    with unix_socket() as probe:
        probe.setblocking(False)
        # The file of a killed process stays and refuses; a full queue of a live one
        # (EAGAIN) does not.
        return probe.connect_ex(str(path)) != errno.ECONNREFUSED
