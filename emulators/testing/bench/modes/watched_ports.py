"""A bus of python-can and a port of pyserial, with a watch at them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from time import monotonic_ns
from typing import Any

import can
import serial

from tickrig.emulators.testing.bench.errors import PortGone
from tickrig.emulators.testing.bench.modes.door_watch import DoorWatch, Seen
from tickrig.emulators.testing.rig_file.plan import BusPlan
from tickrig.host.links import can_link
from tickrig.host.links.link import first_line
from tickrig.host.links.ready import let_wait
from tickrig.host.links.serial_link import explain_open_error
from tickrig.host.text.trace import Mark
from tickrig.wire.can import Frames

# A bus of python-can, with a watch at it.


class BusGone(PortGone, can.CanOperationError):
    """A bus is there no more; for hosts, python-can's own error."""


class _Watched(can.BusABC):
    """What a watched bus does beside what its class does."""

    _watch: DoorWatch
    _reads: can_link.BusReceiver

    def recv(self, timeout: float | None = None) -> can.Message | None:
        self._watch.used()
        begun_ns = monotonic_ns()
        with self._told_if_gone():
            message = self._reads.receive(timeout)
            while message is None and timeout is None:
                message = self._reads.receive(timeout)
        if message is not None:
            error = can_link.to_error_frame(message)
            self._pass_on(Mark.FROM_DEVICE, _frames_of(message) if error is None else (error,))
        elif timeout is not None:
            self._watch.waited(round(timeout * 1e6), (monotonic_ns() - begun_ns) // 1_000)
        return message

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._watch.used()
        with self._watch.sending(_frames_of(msg)), self._told_if_gone():
            super().send(msg, timeout)  # type: ignore[safe-super]  # of the class that is watched
        self._pass_on(Mark.TO_DEVICE, _frames_of(msg))

    @contextmanager
    def _told_if_gone(self) -> Iterator[None]:
        try:
            yield
        except (can.CanOperationError, OSError) as error:
            code = error.error_code if isinstance(error, can.CanError) else error.errno
            if code not in can_link.GONE:
                raise
            raise BusGone(f"{self.channel_info}: {first_line(error)}", code) from error

    def _pass_on(self, mark: Mark, frames: Seen) -> None:
        if frames:
            self._watch.passed(mark, frames)


def _frames_of(message: can.Message) -> Frames:
    frame = can_link.to_frame(message)
    return (frame,) if frame else ()


def open_bus(plan: BusPlan, options: dict[str, Any]) -> can.BusABC:
    """Open a bus.

    Args:
        plan: which.
        options: more, as `can.Bus` takes them.

    Raises:
        BusGone: it cannot be opened.
    """
    rate = {} if plan.bit_rate is None else {"bitrate": plan.bit_rate}
    try:
        bus = can.Bus(plan.channel, plan.interface, **{**rate, **dict(plan.options), **options})
    except (can.CanError, OSError, ValueError, ImportError, AttributeError) as error:
        raise BusGone(f"cannot open {name_of(plan)}: {can_link.bus_reason(error)}") from None
    can_link.prepare_bus(bus, plan.interface)
    return bus


def open_watched_bus(plan: BusPlan, watch: DoorWatch, options: dict[str, Any]) -> can.BusABC:
    """Open a bus with a watch at it; see `open_bus`."""
    bus = open_bus(plan, options)
    kind = type(bus)
    reads = can_link.BusReceiver(
        bus,
        name_of(plan),
        gone=BusGone,
        raises=(can.CanError, OSError),
        read=partial(kind.recv, bus),
    )
    bus.__class__ = type(kind.__name__, (_Watched, kind), {"_watch": watch, "_reads": reads})
    return bus


def name_of(plan: BusPlan) -> str:
    """Return what people call a bus, as `socketcan can0`."""
    return plan.interface if plan.channel is None else f"{plan.interface} {plan.channel}"


# A port of pyserial, with a watch at it.


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


def open_watched_serial(url: str, watch: DoorWatch, options: dict[str, Any]) -> serial.SerialBase:
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
