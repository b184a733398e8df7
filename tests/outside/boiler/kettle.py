"""The host of the kettle: it knows pyserial, and nothing of tickrig."""

from __future__ import annotations

from typing import Any

from boiler import planted

TIMEOUT_S = 0.5


class KettleError(Exception):
    """The kettle does not do what it is asked for."""


class KettleHost:
    """Asks the kettle line by line.

    Args:
        port: an open port of pyserial, at 9600 baud.
    """

    def __init__(self, port: Any) -> None:
        self.port = port
        port.timeout = None if planted("no time-out") else TIMEOUT_S

    def temperature_c(self) -> int:
        """Return the temperature of the water."""
        answer = self._ask(b"temp?")
        if not answer.isdigit():
            raise KettleError(f"the thermometer says {answer!r}")
        return int(answer)

    def heat(self) -> None:
        """Switch the heater on."""
        if (answer := self._ask(b"heat")) != b"ok":
            raise KettleError(f"it does not heat: {answer!r}")

    def stop(self) -> None:
        """Switch the heater off."""
        self._ask(b"stop")

    def _ask(self, line: bytes) -> bytes:
        self.port.reset_input_buffer()
        self.port.write(line + b"\n")
        while (answer := self._line()) == b"boils":
            continue
        return answer

    def _line(self) -> bytes:
        line = bytes(self.port.readline())
        if not line.endswith(b"\n"):
            raise KettleError(f"no whole line in {TIMEOUT_S} s: {line!r}")
        return line[:-1]
