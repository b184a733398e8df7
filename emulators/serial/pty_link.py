"""The name under which a pseudo-terminal is found, and who gave it."""

from __future__ import annotations

import errno
import fcntl
import os
from pathlib import Path


class PtyLink:
    """A symbolic link to a terminal that tells whether its emulator lives.

    Beside `NAME` lies `.NAME.emulator`, locked for as long as the link is in use: it names the
    process and the terminal. So a link that a killed emulator left over is known for one even
    when its terminal belongs to somebody else by now.

    Args:
        path: where the link is to be.
        target: the terminal.

    Raises:
        FileExistsError: a running emulator has this link, or it is none of an emulator's.
        OSError: no link can be made there.
    """

    def __init__(self, path: Path, target: str) -> None:
        self._path, self._target = path, target
        self._note = path.with_name(f".{path.name}.emulator")
        try:
            self._lock = self._take_note()
            self._make()
        except FileExistsError as error:
            raise FileExistsError(errno.EEXIST, error.strerror, str(path)) from None
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(path)) from None

    def close(self) -> None:
        """Remove the link, if it is still this one, and the note."""
        if _target(self._path) == self._target:
            self._path.unlink()
        self._drop_note()

    def _take_note(self) -> int:
        """Open and lock the note; whoever has it has the link."""
        while True:
            lock = os.open(self._note, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if os.path.samestat(os.fstat(lock), self._note.stat()):
                    return lock
            except BlockingIOError:
                process = os.read(lock, 100).partition(b" ")[0].decode("ascii", "replace") or "?"
                os.close(lock)
                used = f"another emulator uses it (process {process})"
                raise FileExistsError(errno.EEXIST, used) from None
            except FileNotFoundError:  # its owner has just removed it
                pass
            os.close(lock)

    def _make(self) -> None:
        """Make the link, and note whose it is."""
        try:
            if self._is_left_over():
                self._path.unlink()
            if self._path.exists():
                raise FileExistsError(errno.EEXIST, "exists; remove it if no emulator uses it")
            self._path.symlink_to(self._target)
            os.ftruncate(self._lock, 0)
            os.pwrite(self._lock, f"{os.getpid()} {self._target}\n".encode(), 0)
        except OSError:
            self._drop_note()
            raise

    def _is_left_over(self) -> bool:
        """Whether the link names no terminal, ours, or that of an emulator which has ended."""
        target = _target(self._path)
        noted = os.read(self._lock, 4_096).decode("ascii", "replace").split()
        return target is not None and (
            target in (self._target, *noted[1:]) or not self._path.exists()
        )

    def _drop_note(self) -> None:
        self._note.unlink(missing_ok=True)
        os.close(self._lock)


def _target(path: Path) -> str | None:
    return os.readlink(path) if path.is_symlink() else None
