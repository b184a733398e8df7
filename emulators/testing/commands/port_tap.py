"""A tap between a host and a real port: what passes is recorded, unchanged and at once."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from typing import Final

from tickrig.emulators.serial.pty_port import PtyPort
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.ready import ready
from tickrig.host.links.recording_link import RecordingLink

_LOOK_S: Final = 0.05
"""How often the tap looks whether it is to end."""

_STOPPED_S: Final = 0.5
"""A look that is later than this was not made in time: the process was stopped, or starved."""

_READ_BYTES: Final = 4_096


class PortTap:
    """Passes bytes between the pty of a host and a port.

    One thread reads the port, the caller's reads the pty and what an operator types. A host
    may close the pty and open it again.

    Args:
        link: the port, recorded.
        pty: where the host is.
        typed: called with each line that an operator types.
        late: called with how many seconds the tap had not been running.

    Attributes:
        sent: bytes that went to the device.
        received: bytes that came from it.
        gone: why the port is gone, empty while it is there.
    """

    def __init__(
        self,
        link: RecordingLink[bytes],
        pty: PtyPort,
        typed: Callable[[str], None],
        late: Callable[[float], None],
    ) -> None:
        self._link, self._pty, self._typed, self._late = link, pty, typed, late
        self.sent = self.received = 0
        self.gone, self._stopped = "", False
        self._lock = threading.Lock()
        self._line = b""

    def run(self, terminal: int | None) -> None:
        """Pass bytes until `stop` is called or the port is gone.

        Args:
            terminal: descriptor where the operator types, None if there is nobody.
        """
        reader = threading.Thread(target=self._read_port, daemon=True)
        reader.start()
        watched = [self._pty.fileno(), *([] if terminal is None else [terminal])]
        while not self._stopped and not self.gone:
            began_s = time.monotonic()
            can_be_read, _ = ready(watched, wait_s=_LOOK_S)
            self._read_pty()
            if (
                terminal is not None
                and terminal in can_be_read
                and not self._read_terminal(terminal)
            ):
                watched.remove(terminal)
            if (late_s := time.monotonic() - began_s - _LOOK_S) > _STOPPED_S:
                self._late(late_s)
        self._stopped = True
        reader.join()

    def stop(self) -> None:
        """Let `run` end."""
        self._stopped = True

    def _read_port(self) -> None:
        """Hand on what the device says, in a thread of its own."""
        try:
            while not self._stopped:
                if data := self._link.receive(round(_LOOK_S * 1e6)):
                    self.received += len(data)
                    with self._lock:
                        self._pty.send(0, data)
        except LinkClosed as error:
            self.gone = self.gone or str(error)

    def _read_pty(self) -> None:
        """Hand on what the host says, and what it had no room for before."""
        try:
            with self._lock:
                data = self._pty.poll(self._link.now_us)
            if data:
                self._link.send(data)
                self.sent += len(data)
        except LinkClosed as error:
            self.gone = self.gone or str(error)

    def _read_terminal(self, terminal: int) -> bool:
        """Take what was typed; False at its end."""
        try:
            data = os.read(terminal, _READ_BYTES)
        except OSError:  # it is gone, or this job is in the background
            data = b""
        *lines, self._line = (self._line + data).split(b"\n")
        for line in lines:
            self._typed(line.decode("utf-8", "replace").strip())
        return bool(data)
