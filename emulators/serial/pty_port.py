"""The master side of a pseudo-terminal, under a fixed name."""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
import select
import sys
import termios
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tickrig.device.twin import NonCopyable
from tickrig.emulators.serial.bridge import HostSetting
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import UartSetting

# The name of a pseudo-terminal, and its owner.


class _PtyLink:
    """A symbolic link to a terminal, with a note that shows whether its emulator runs.

    The note is a file `.NAME.emulator` in the folder of the link `NAME`. It names the process and
    the terminal, and is locked while the link is in use. So the link of a killed emulator is
    recognised even if its terminal now belongs to another program.

    Args:
        path: path of the link.
        target: path of the terminal.

    Raises:
        FileExistsError: a running emulator uses this link, or it does not belong to an emulator.
        OSError: the link cannot be made.
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
        """Remove the link, if it still belongs to this emulator, and the note."""
        if _target(self._path) == self._target:
            self._path.unlink()
        self._drop_note()

    def _take_note(self) -> int:
        """Open and lock the note; its owner owns the link."""
        while True:
            lock = os.open(self._note, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # Between `open` and `flock` the owner may have removed the note, and another
                # emulator may have made a new one. Then this lock is on a file that is no longer
                # reachable. Try again.
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
        """Make the link, and write its owner into the note."""
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
        """Whether the link names no terminal, our terminal, or that of an ended emulator."""
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


_BAUDS: Final = {
    code: int(name[1:])
    for name, code in vars(termios).items()
    if name[:1] == "B" and name[1:].isdigit()
}
"""Bit rates by their number in a termios; other rates have no number."""


def _setting_of(terminal: int) -> str:
    """Return rate, bits, parity and stop bits, such as `115200 8N1`.

    Linux keeps the bit rate, the stop bits, and odd parity. A pseudo-terminal always has 8 bits,
    and even parity looks like no parity.
    """
    _, _, flags, _, _, speed, _ = termios.tcgetattr(terminal)
    bits = {termios.CS5: 5, termios.CS6: 6, termios.CS7: 7}.get(flags & termios.CSIZE, 8)
    parity = "O" if flags & termios.PARODD else "E" if flags & termios.PARENB else "N"
    stops = 2 if flags & termios.CSTOPB else 1
    return f"{_BAUDS.get(speed, 'another rate,')} {bits}{parity}{stops}"


_READ_BYTES: Final = 4_096

_IN_OPEN: Final = 0x20
_IN_CLOSE: Final = 0x08 | 0x10


class _PtyVisits(NonCopyable):
    """Wakes the emulator when a host opens or closes the terminal, or sends data.

    Args:
        master: emulator's side of the terminal.
        path: path of the host's side of the terminal.

    Attributes:
        wakes: descriptor to wait on. Without inotify, which exists only on Linux, the descriptor is
            `master`.
    """

    why_not_copied = "it is a pty of this machine"

    def __init__(self, master: int, path: str) -> None:
        self.wakes, self._inotify = master, -1
        if sys.platform == "linux":
            libc = ctypes.CDLL(None, use_errno=True)
            self._inotify = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
            if self._inotify < 0:  # the user has used up all instances
                return
            libc.inotify_add_watch(self._inotify, os.fsencode(path), _IN_OPEN | _IN_CLOSE)
            epoll = select.epoll()
            for fd in (master, self._inotify):
                epoll.register(fd, select.EPOLLIN)
            self.wakes = epoll.fileno()
            self._epoll = epoll

    def any(self) -> bool:
        """Return whether a host opened or closed the terminal since the last call."""
        try:
            return self._inotify >= 0 and bool(os.read(self._inotify, _READ_BYTES))
        except BlockingIOError:
            return False

    def close(self) -> None:
        """Stop watching."""
        if self._inotify >= 0:
            self._epoll.close()
            os.close(self._inotify)
            self._inotify = -1


class PtyPort(NonCopyable):
    """A `Port[bytes]` whose other side any serial program can open.

    The emulator keeps the other side open too, so hosts may open and close it. Data that no host
    has read are kept, up to `buffer_bytes` here and about 4 KiB in the kernel. Beyond that, whole
    sends are dropped and counted.

    A second host that opens the terminal is not refused, because the kernel does not show this side
    which hosts have opened the terminal. TIOCEXCL would exclude the first host as well, but not a
    host that runs as root. With two hosts, data of the device go to the host that reads first.
    Hosts that lock the terminal, as with pyserial's `exclusive=True`, exclude each other.

    Args:
        link: path of a symbolic link to the terminal (see `_PtyLink`), or None for no link. The
            link of a killed emulator is replaced.
        buffer_bytes: largest number of bytes kept for a host that does not read.

    Attributes:
        path: path of the terminal, such as `/dev/pts/7`.
        lost: number of bytes dropped because no host read them.
        spoken: whether a host ever sent data.

    Raises:
        FileExistsError: `link` exists and does not belong to an ended emulator.
        OSError: there is no free pseudo-terminal, or the link cannot be made.
    """

    why_not_copied = "it is a pty of this machine"
    due_us: Final = NEVER  # only the host knows when data arrive

    def __init__(self, link: Path | None = None, buffer_bytes: int = 4_096) -> None:
        # The slave stays open here: on Linux reading the master fails with EIO while no process has
        # it open.
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._visits = _PtyVisits(self._master, self.path)
        self.lost, self.spoken = 0, False
        self._buffer_bytes, self._unsent = buffer_bytes, b""
        self._link: _PtyLink | None = None
        self._setting: HostSetting | None = None
        if link is not None:
            try:
                self._link = _PtyLink(link, self.path)
            except OSError:
                self.close()
                raise

    def fileno(self) -> int:
        """Return the descriptor to wait on for actions of the host."""
        return self._visits.wakes

    @property
    def host_setting(self) -> str:
        """The setting of the host, such as `9600 8N1`, if it differs from the device's.

        The text is empty if both settings are equal, or if the setting of the host is unknown.
        """
        return self._setting.differing if self._setting else ""

    def watch_setting(self, baud: int, notify: Callable[[str], None]) -> None:
        """Set the pty to the device's setting, and report each host that selects another setting.

        Args:
            baud: bit rate of the device in bit/s, with 8N1. A rate without a termios name is not
                checked.
            notify: function that is called with each setting that differs, such as `9600 8N1`.
        """
        codes = [code for code, rate in _BAUDS.items() if rate == baud]
        if not codes:
            return
        slave, attributes = self._slave, termios.tcgetattr(self._slave)
        attributes[4:6] = codes[0], codes[0]
        termios.tcsetattr(slave, termios.TCSANOW, attributes)
        self._setting = HostSetting(lambda: _setting_of(slave), _setting_of(slave), notify)

    def device_uses(self, setting: UartSetting) -> None:
        """Note a new setting of the device, and report each host that has another setting.

        A host with another setting still gets the correct bytes, because a pty has no bit rate.

        Args:
            setting: new setting of the device. A pty does not show the data bits that a host has
                selected, and shows no parity for a host that has selected even parity. Therefore
                the data bits are not compared, and even parity is treated as no parity.
        """
        if self._setting is not None:
            parity = "O" if setting.parity == "O" else "N"
            named = setting.baud in _BAUDS.values()
            shown = f"{setting.baud} 8{parity}{setting.stop_bits:g}"
            self._setting.want(shown if named else "")

    def poll(self, now_us: int, /) -> bytes:
        """Read without blocking."""
        self.attend(now_us)
        try:
            data = os.read(self._master, _READ_BYTES)
        except BlockingIOError:
            return b""
        self.spoken = True
        self._look(now_us, at_once=True)
        return data

    def attend(self, now_us: int, /) -> None:
        """Check the setting of the host, and send buffered data to the host."""
        self._look(now_us, at_once=self._visits.any())
        self._flush()

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Write as much data as fits, and buffer the rest."""
        # A whole send or nothing: half a line would reach the host as another line.
        if len(self._unsent) + len(traffic) > self._buffer_bytes:
            self.lost += len(traffic)
        else:
            self._unsent += traffic
        self._flush()

    def close(self) -> None:
        """Close the pseudo-terminal and remove the link."""
        if self._link is not None:
            self._link.close()
        self._link = self._setting = None
        self._visits.close()
        for fd in (self._master, self._slave):
            if fd >= 0:
                os.close(fd)
        self._master = self._slave = -1

    def _look(self, now_us: int, *, at_once: bool) -> None:
        """Check the setting of the host, and allow the next host to set it again.

        A pseudo-terminal drops even parity and 7 bits. If a request of a host then changes nothing,
        glibc reports EINVAL, so the second host with such a setting would fail. Therefore CLOCAL is
        cleared here. CLOCAL has no effect on a pseudo-terminal, but hosts set it, so their requests
        always change something.
        """
        if self._setting is not None:
            self._setting.look(now_us, at_once=at_once)
        if at_once:
            attributes = termios.tcgetattr(self._slave)
            if attributes[2] & termios.CLOCAL:
                attributes[2] &= ~termios.CLOCAL
                termios.tcsetattr(self._slave, termios.TCSANOW, attributes)

    def _flush(self) -> None:
        if self._unsent:
            try:
                self._unsent = self._unsent[os.write(self._master, self._unsent) :]
            except BlockingIOError:
                return
