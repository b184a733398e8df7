"""A listening Unix socket under a path, without leftovers."""

from __future__ import annotations

import errno
import os
import socket
import stat
from pathlib import Path


def listen_at(path: Path) -> socket.socket:
    """Return a listening socket that only this user may connect to, non-blocking.

    The socket file of a killed process is replaced.

    Raises:
        FileExistsError: a live process listens there, or it is not a socket.
        OSError: no socket can be made there.
    """
    if _is_socket(path):
        if _is_live(path):
            raise FileExistsError(errno.EEXIST, "another process listens there", str(path))
        path.unlink()
    listener = socket.socket(socket.AF_UNIX)
    mask = os.umask(0o177)
    try:
        listener.bind(str(path))
        listener.listen()
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRINUSE:
            raise FileExistsError(errno.EEXIST, "File exists", str(path)) from None
        raise OSError(
            error.errno or errno.EINVAL, error.strerror or str(error), str(path)
        ) from None
    finally:
        os.umask(mask)
    listener.setblocking(False)
    return listener


def _is_socket(path: Path) -> bool:
    try:
        return stat.S_ISSOCK(path.lstat().st_mode)
    except OSError:
        return False


def _is_live(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        probe.setblocking(False)
        return probe.connect_ex(str(path)) != errno.ECONNREFUSED
