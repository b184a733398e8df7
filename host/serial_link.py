"""A byte link to a serial port, real, pseudo or remote, by any pyserial URL."""

from __future__ import annotations

import time

import serial

from tickrig.host.errors import LinkClosed


class SerialLink:
    """A `Link[bytes]` over pyserial.

    Args:
        url: a device path or pyserial URL: `/dev/ttyACM0`, `COM3`,
            `socket://host:port`, `rfc2217://host:port`, `loop://`.
        baud: bit rate in bit/s, 8N1.

    Raises:
        LinkClosed: the port cannot be opened.
    """

    def __init__(self, url: str, baud: int = 115_200) -> None:
        try:
            self._port = serial.serial_for_url(url, baudrate=baud, timeout=0, write_timeout=1)
        except (serial.SerialException, ValueError, OSError) as error:
            raise LinkClosed(f"cannot open {url!r}: {error}") from error
        self._url = url

    @property
    def now_us(self) -> int:
        """The machine's monotonic clock."""
        return time.monotonic_ns() // 1_000

    def send(self, traffic: bytes, /) -> None:
        """Write bytes; raises LinkClosed if the port is gone or takes none for 1 s."""
        try:
            self._port.write(traffic)
        except (serial.SerialException, OSError, TypeError) as error:
            raise LinkClosed(f"cannot write to {self._url!r}: {error}") from error

    def receive(self, timeout_us: int, /) -> bytes:
        """Wait for a first byte, then return all that are there."""
        try:
            self._port.timeout = timeout_us / 1e6
            first = self._port.read(1)
            return first + self._port.read(self._port.in_waiting) if first else b""
        except (serial.SerialException, OSError, TypeError) as error:
            raise LinkClosed(f"cannot read from {self._url!r}: {error}") from error

    def close(self) -> None:
        """Close the port."""
        self._port.close()
