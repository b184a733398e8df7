"""The control socket of a bench, in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tickrig.emulators.bench.control import EmulatorControl
from tickrig.host.control.requests import RequestDispatcher
from tickrig.host.control.server import ControlServer

LOOK_US: Final = 100_000
"""How often it looks whether it is to end."""

Call = Callable[[Callable[[], bytes]], bytes]
"""Does something between two ticks."""


class ControlThread:
    """Serves a control socket, and has each request answered between two ticks of the rig.

    Args:
        path: of the socket.
        control: answers.
        call: does something between two ticks.

    Raises:
        OSError: no socket can be made there.
    """

    def __init__(self, path: Path, control: EmulatorControl, call: Call) -> None:
        self._server = ControlServer(path, _Answers(control, call))
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="tickrig control", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Hang up, and remove the socket."""
        self._closing = True
        self._thread.join()
        self._server.close()

    def _run(self) -> None:
        while not self._closing:
            self._server.serve(LOOK_US)


class _Answers(RequestDispatcher):
    """Has requests answered elsewhere."""

    def __init__(self, control: EmulatorControl, call: Call) -> None:
        super().__init__({})
        self._control, self._call = control, call

    def answer_line(self, line: bytes) -> bytes:
        return self._call(lambda: self._control.answer_line(line))
