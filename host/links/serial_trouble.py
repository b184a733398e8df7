"""Why a serial port cannot be opened, in one line, and what to do about it."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import Final

LOCKS: Final = Path("/proc/locks")
COMMAND_SHOWN: Final = 100


def trouble(url: str, error: Exception) -> str:
    """Say what is wrong with a port.

    Args:
        url: the port, as it was asked for.
        error: what opening it raised.
    """
    number = error.errno if isinstance(error, OSError) else None
    if number in (errno.EAGAIN, errno.EBUSY):
        return f"another program uses it{_holder(url)}"
    if number == errno.EACCES:
        return f"permission denied{_remedy(url)}"
    return os.strerror(number) if number else str(error)


def _holder(path: str) -> str:
    """Return `: COMMAND (process NUMBER)` of who has locked a file, empty if it is not shown."""
    try:
        found = os.stat(path)
        locks = LOCKS.read_text("ascii").splitlines()
    except OSError:
        return ""
    device = f"{os.major(found.st_dev):02x}:{os.minor(found.st_dev):02x}:{found.st_ino}"
    for lock in locks:
        _, kind, _, _, process, file, *_ = lock.split()
        if kind == "FLOCK" and file == device:
            return f": {_command(process)} (process {process})"
    return ""


def _command(process: str) -> str:
    try:
        words = Path(f"/proc/{process}/cmdline").read_bytes().rstrip(b"\0")
    except OSError:
        return "?"
    command = " ".join(words.replace(b"\0", b" ").decode("utf-8", "replace").split())
    return command if len(command) <= COMMAND_SHOWN else f"{command[:COMMAND_SHOWN]}..."


def _remedy(path: str) -> str:
    """Say how to be let in: by the group of the file, if that may read and write."""
    import grp  # noqa: PLC0415 - not on Windows, which has no such files either

    try:
        found = os.stat(path)
        group = grp.getgrgid(found.st_gid).gr_name
    except (OSError, KeyError):
        return ""
    if found.st_mode & stat.S_IRWXG < stat.S_IRGRP | stat.S_IWGRP:
        return "; its owner alone may use it"
    return f"; join its group: sudo usermod -aG {group} $USER, then log in again"
