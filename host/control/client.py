"""Client of a control socket, which sends requests to a running emulator."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final, Self

from tickrig.host.control.requests import VERSION, Object
from tickrig.host.control.unix_socket import unix_socket

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

TIMEOUT_S: Final = 5.0


class ControlRefused(ValueError):  # noqa: N818 - what the emulator did
    """The emulator refused a request. The message contains the reason."""


class ControlClient:
    """Client that sends requests to a running emulator at its control socket.

    Args:
        path: path of the control socket.
        timeout_s: time to wait for each answer, in seconds.

    Raises:
        OSError: no emulator listens at the path, or the emulator does not answer.
    """

    def __init__(self, path: Path | str, timeout_s: float = TIMEOUT_S) -> None:
        self._socket = unix_socket()
        self._socket.settimeout(timeout_s)
        self._received = b""
        try:
            self._socket.connect(str(path))
        except OSError:
            self._socket.close()
            raise

    def request(self, do: str, **fields: object) -> Object:
        """Send a request and return the answer.

        Raises:
            ControlRefused: the emulator refused the request.
            OSError: the emulator does not answer in time, or has closed the connection.
            ValueError: the answer is invalid.
        """
        request = json.dumps({"v": VERSION, "do": do, **fields})
        self._socket.sendall(request.encode() + b"\n")
        try:
            answer = json.loads(self._receive_line())
        except RecursionError:
            answer = None
        if not isinstance(answer, dict):
            raise ValueError("the answer is not a JSON object")
        if not answer.get("ok"):
            raise ControlRefused(str(answer.get("error")))
        return answer

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def __enter__(self) -> Self:
        """Return the client."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the connection."""
        self.close()

    def _receive_line(self) -> bytes:
        pieces = [self._received]
        while b"\n" not in pieces[-1]:
            pieces.append(self._socket.recv(65_536))
            if not pieces[-1]:
                raise ConnectionResetError("the emulator closed the connection")
        line, _, self._received = b"".join(pieces).partition(b"\n")
        return line
