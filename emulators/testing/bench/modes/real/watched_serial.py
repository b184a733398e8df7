"""A port of pyserial, with a watch at it."""

from __future__ import annotations

from time import monotonic_ns
from typing import Any

import serial

from tickrig.emulators.testing.bench.errors import PortGone
from tickrig.emulators.testing.bench.modes.real.door_watch import DoorWatch
from tickrig.host.links.ready import let_wait
from tickrig.host.links.serial_link import explain_open_error
from tickrig.host.text.trace import Mark


class SerialGone(PortGone, serial.SerialException):
    """A port is there no more; for hosts, pyserial's own error."""


class WatchedPort(serial.SerialBase):
    """What a watched port does beside what its class does."""

    _watch: DoorWatch

    def read(self, size: int = 1) -> bytes:
        """Read as the port does, and note what came and how late."""
        self._watch.used()
        wanted_s, begun_ns = self.timeout, monotonic_ns()
        try:
            data = super().read(size)
        except serial.PortNotOpenError:
            raise
        except serial.SerialException as error:
            raise SerialGone(f"{self.port}: {error}") from error
        if data:
            self._watch.passed(Mark.FROM_DEVICE, data)
        if len(data) < size and wanted_s is not None:
            took_us = (monotonic_ns() - begun_ns) // 1_000
            self._watch.waited(round(wanted_s * 1e6), took_us)
        return data

    def write(self, data: Any) -> int | None:
        """Write as the port does, and note what went out."""
        self._watch.used()
        try:
            written = super().write(data)
        except (serial.PortNotOpenError, serial.SerialTimeoutException):
            raise
        except serial.SerialException as error:
            raise SerialGone(f"{self.port}: {error}") from error
        self._watch.passed(Mark.TO_DEVICE, bytes(data))
        return written


def open_watched(url: str, watch: DoorWatch, options: dict[str, Any]) -> serial.SerialBase:
    """Open a port.

    Args:
        url: as `serial.serial_for_url` takes it.
        watch: is told what passes.
        options: as `serial.Serial` takes them.

    Raises:
        SerialGone: it cannot be opened.
        ValueError: an option is out of range.
    """
    try:
        port = serial.serial_for_url(url, do_not_open=True, **options)
        kind = type(port)
        port.__class__ = type(kind.__name__, (WatchedPort, kind), {"_watch": watch})
        port.open()
        let_wait(port)
    except (serial.SerialException, OSError) as error:
        raise SerialGone(f"cannot open {url!r}: {explain_open_error(url, error)}") from error
    return port
