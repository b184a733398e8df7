"""One emulated device on a serial line, with its operator."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

from tickrig.device.twin import NonCopyable
from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.record.recorder import TracedDevice, TraceFile
from tickrig.emulators.record.wire_log import Splitter, WireLog
from tickrig.emulators.rig.clock import Clock
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.rig.faults import FaultType, FaultyPort
from tickrig.emulators.rig.port import ByteLine, Port
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.bridge import Bridge, HostEnd, Tap
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.text.trace import Mark
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import UartSetting


class LineOutside(Port[bytes], Protocol):
    """The port of the host: a pty, a network port, or several of these."""

    @property
    def lost(self) -> int:
        """Number of bytes dropped because the host did not read."""
        ...

    @property
    def host_setting(self) -> str:
        """The setting of the host, if it differs from the device's."""
        ...

    def attend(self, now_us: int, /) -> None:
        """Accept and drop connections of hosts, without reading because the line is full."""

    def device_uses(self, setting: UartSetting, /) -> None:
        """Store the present setting of the device."""


@dataclass(frozen=True, slots=True)
class LineSettings:
    """Parameters of the serial line that belongs to a device type.

    Attributes:
        baud: bit rate in bit/s.
        faults: wire faults that can be armed on the line, by name.
        splitter: function that makes, for each direction, the object that splits bytes into lines
            or frames for the log. The default splits at the ends of lines.
        wire: function that makes the line for a baud rate.
        uart: whether the device has a UART. A device on USB has no UART, and so accepts any setting
            of the host.
    """

    baud: int = 115_200
    faults: Mapping[str, FaultType[bytes]] = field(default_factory=lambda: BYTE_FAULTS)
    splitter: Callable[[Mark], Splitter] | None = None
    wire: Callable[[int], ByteLine] = SerialLine
    uart: bool = True


class Emulator(RunningEmulator):
    """An emulated serial device with its line, its operator, and a rig that runs them.

    Args:
        name: name of the device.
        device: the device.
        outside: port at which the host is connected, such as a pty, or None if the caller is the
            host. Such a caller sends data with the method `send`, and finds the answers of the
            device in `log`.
        clock: clock of the rig, or None to use a `VirtualClock`.
        seed: seed of random wire faults.
        trace: file that records the run, or None to record nothing.
        link: path at which the host finds the device, as text.
        line: parameters of the line.

    Attributes:
        line: the serial line.
        host_end: end of the line at which the caller, or a `SimLink`, acts as the host. The traffic
            at this end is logged.
    """

    def __init__(  # noqa: PLR0913 - options, by keyword
        self,
        name: str,
        device: Emulated[bytes],
        *,
        outside: LineOutside | None = None,
        clock: Clock | None = None,
        seed: int = 0,
        trace: TraceFile | None = None,
        link: str = "",
        line: LineSettings | None = None,
    ) -> None:
        self._outside = outside
        line = line or LineSettings()
        self.line = line.wire(line.baud)
        port = FaultyPort(self.line.a, line.faults, seed)
        super().__init__(name, device, port, link, trace)
        if line.splitter is not None:
            self.log = WireLog(splitter=line.splitter)
        station = Station(TracedDevice(device, trace) if trace else device, port)
        self.host_end = HostEnd(self.line.b, self.log.hear)
        bridges = []
        if outside:
            tap, changed = Tap(outside, self.log.hear), self._line_changed if line.uart else None
            bridges = [Bridge(self.line.b, tap, outside.attend, changed)]
        self.rig = Rig(station, bridges=bridges, clock=clock, event_queue=self.event_queue)
        self.log.follow(self.rig, name)

    def _line_changed(self, setting: UartSetting) -> None:
        assert self._outside is not None  # who asks is its bridge
        self._outside.device_uses(setting)

    @property
    def _host_due_us(self) -> int:
        return NEVER if self._outside else self.host_end.due_us

    def _listen(self, now_us: int) -> None:
        if self._outside is None:
            self.host_end.poll(now_us)

    def send(self, now_us: int, data: bytes) -> None:
        """Send bytes on the line as the host."""
        self.host_end.send(now_us, data)

    @property
    def lost(self) -> dict[str, int]:
        """Number of bytes lost because of a full buffer, on the line or outside."""
        outside = self._outside.lost if self._outside else 0
        return {"lost_bytes": self.line.a.lost + self.line.b.lost + outside}

    def status(self) -> dict[str, str | int]:
        """Return the status of the run, and the port setting of the host."""
        return {
            **super().status(),
            "host_setting": self._outside.host_setting if self._outside else "",
        }


# Several ports on one serial line.


class SerialHub(NonCopyable):
    """Connects several hosts with one emulated serial line, each through its own port.

    Each port receives everything that the device sends, and may send. If several hosts send at the
    same time, their data arrive mixed. Hosts do not receive each other's data.

    Args:
        ports: ports of the hosts: a pty and network ports.
    """

    why_not_copied = "its ports belong to this machine"
    due_us: Final = NEVER  # only the hosts know when data arrive

    def __init__(self, ports: Sequence[LineOutside]) -> None:
        self._ports = tuple(ports)

    @property
    def lost(self) -> int:
        """Number of bytes that a port dropped because its host did not read."""
        return sum(port.lost for port in self._ports)

    @property
    def host_setting(self) -> str:
        """Settings of hosts that differ from the device's, such as `9600 8N1`."""
        return ", ".join(port.host_setting for port in self._ports if port.host_setting)

    def poll(self, now_us: int, /) -> bytes:
        """Return the data of the hosts."""
        return b"".join([port.poll(now_us) for port in self._ports])

    def attend(self, now_us: int, /) -> None:
        """Handle hosts that connect or leave, and send buffered data to hosts."""
        for port in self._ports:
            port.attend(now_us)

    def device_uses(self, setting: UartSetting, /) -> None:
        """Report the present setting of the device to every port."""
        for port in self._ports:
            port.device_uses(setting)

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Send data to every host."""
        for port in self._ports:
            port.send(now_us, traffic)
