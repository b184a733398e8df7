"""A port on a rig whose far end is the test, or a device that repeats what it hears."""

from __future__ import annotations

from typing import Any

from tests.emulators.echo import Echo
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.outside.serial_side import SerialSide
from tickrig.emulators.serial.outside.sim_serial import SimSerial
from tickrig.emulators.serial.serial_line import LineEnd, SerialLine
from tickrig.wire.uart import UartSetting

BAUD = 100_000
"""A byte takes 100 us."""

SETTING = UartSetting(BAUD)


class OpenLine:
    """A rig with a line, and nobody at its far end but the test."""

    def __init__(self, *stations: Station[bytes], **options: Any) -> None:
        self.line = SerialLine(BAUD, buffer_bytes=options.pop("buffer_bytes", 4_096))
        self.rig = Rig(*stations)
        device = options.pop("device", SETTING)
        mismatch = options.pop("mismatch", "errors")
        self.side = SerialSide(self.rig, self.line.b, device, mismatch=mismatch)
        self.port = SimSerial(self.side, **options)

    @property
    def far(self) -> LineEnd:
        """The device's end."""
        return self.line.a

    def at(self, t_us: int, data: bytes) -> None:
        """Let the device send something at a time."""
        self.rig.event_queue.put((t_us, data), t_us, lambda now_us: self.far.send(now_us, data))

    def heard(self) -> bytes:
        """Take what the device has received."""
        return self.far.poll(self.rig.now_us)


def echo(**options: Any) -> SimSerial:
    """Open a port at whose far end each byte comes back, a tick later."""
    line = SerialLine(BAUD)
    rig = Rig(Station(Echo(tick_us=1_000), line.a))
    return SimSerial(SerialSide(rig, line.b, SETTING), **options)


def rig_of(port: SimSerial) -> Rig:
    """Return the rig whose time a port makes pass."""
    assert port.side is not None
    return port.side.rig
