"""A control socket."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from pathlib import Path

from tickrig.host.control.line_server import LineServer
from tickrig.host.control.requests import RequestDispatcher, refusal_line
from tickrig.host.control.unix_socket import listen_at


class ControlServer(LineServer):
    """Serves a control socket while somebody gives it time.

    Args:
        path: where the socket is; that of a killed process is replaced.
        control: answers the requests.
        clock: monotonic time in seconds.

    Raises:
        FileExistsError: somebody listens there, or something else.
        OSError: no socket can be made there.
    """

    def __init__(
        self, path: Path, control: RequestDispatcher, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(listen_at(path), lambda: control.answer_line, refusal_line, clock=clock)
        self._path, self._inode = path, path.stat().st_ino

    def close(self) -> None:
        """Send what can be sent, hang up, and remove the socket."""
        super().close()
        with contextlib.suppress(FileNotFoundError):
            if self._path.stat().st_ino == self._inode:
                self._path.unlink()
