"""Devices on their wires: on a serial line, or nodes on a CAN bus."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final

from tickrig.device.twin import Copyable
from tickrig.emulators.bench.operator import WireFaults
from tickrig.emulators.canopen import late
from tickrig.emulators.record.recorder import TraceRecorder
from tickrig.emulators.rig.emulated import Emulated, HasSignals
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.port import ByteLine
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.bridge import Tap
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.host.text.bench_header import DeviceEntry, WireEntry, WireType
from tickrig.wire.can import Frames

if TYPE_CHECKING:
    from tickrig.device.canopen.slave import CanopenSlave
    from tickrig.emulators.can.end import CanEnd
    from tickrig.emulators.can.faults import CanFaults

BIT_RATE: Final = 1_000_000


class LineMount(Copyable):
    """A serial line of a bench with its devices. Only an RS485 line may have several devices.

    Args:
        name: name of the line.
        settings: parameters of the line.
        line: the line, or None to make it from `settings`. The ends of the line belong to the
            devices, except `line.b`, which is the host's end.

    Attributes:
        line: the line.
        devices: devices by name.
        entries: description of each device for the header of a trace, by name of the device.
        tap: object that reports the traffic at the first device's end of the line. The reported
            bytes are those that the host sends or receives: traffic to the device before a fault
            has changed it, and traffic from the device after a fault has changed it.
    """

    def __init__(self, name: str, settings: LineSettings, line: ByteLine | None = None) -> None:
        self.name, self.settings = name, settings
        self.line = line or settings.wire(settings.baud)
        self._free = [self.line.a, *getattr(self.line, "ends", ())[2:]]
        self.tap = Tap(self._free[0])
        self.devices: dict[str, Emulated[bytes]] = {}
        self.entries: dict[str, DeviceEntry] = {}
        self._ports: list[FaultyPort[bytes]] = []

    def add(
        self, name: str, device: Emulated[bytes], entry: DeviceEntry | None = None, seed: int = 0
    ) -> None:
        """Put a device on the serial line, at the next free end.

        Args:
            name: name of the device.
            device: the device.
            entry: description of the device in the header of a trace, from which a replay makes the
                device. With None a replay cannot make the device.
            seed: seed of random faults at the device's end.

        Raises:
            ValueError: the line has no free end for the device.
        """
        if not self._free:
            raise ValueError(f"{self.name} has no end for {name}: it is for {len(self.devices)}")
        end = self._free.pop(0)
        port = FaultyPort(end if self.devices else self.tap, self.settings.faults, seed)
        self.devices[name], self.entries[name] = device, entry or DeviceEntry(self.name)
        self._ports.append(port)

    @property
    def faults(self) -> FaultyPort[bytes]:
        """The port on which faults are armed: the first device's end."""
        return self._ports[0]

    @property
    def chances(self) -> Sequence[FaultyPort[bytes]]:
        """Objects with random faults."""
        return self._ports

    @property
    def parts(self) -> Mapping[str, HasSignals]:
        """The physical side of each device."""
        return self.devices

    @property
    def wire_entry(self) -> WireEntry:
        """Trace entry of the line."""
        return WireEntry(WireType.SERIAL, {"baud": self.settings.baud})

    def stations(self, recorder: TraceRecorder | None) -> Iterator[Station[bytes]]:
        """Yield the devices on the line; with a recorder they are recorded."""
        for (name, device), port in zip(self.devices.items(), self._ports, strict=True):
            yield Station(recorder.device(name, device) if recorder else device, port)

    @property
    def lost(self) -> int:
        """Number of bytes lost because of a full buffer."""
        return self.line.a.lost + self.line.b.lost


class BusMount(Copyable):
    """A CAN bus of a bench with its CANopen nodes.

    The bus has an additional end that acknowledges all frames. Therefore a node can send even if
    there is no host and no other node on the bus.

    Args:
        name: name of the bus.
        bit_rate: bit rate in bit/s.
        seed: seed of random faults on the bus.

    Attributes:
        wire: the bus.
        nodes: nodes by name.
        node_faults: objects that start faults. There is one object for each node, by name of the
            node.
        entries: description of each node for the header of a trace, by name of the node.
    """

    def __init__(self, name: str, bit_rate: int = BIT_RATE, seed: int = 0) -> None:
        self.name, self.wire = name, late.CanWire(bit_rate, seed)
        self.nodes: dict[str, late.Node] = {}
        self.node_faults: dict[str, late.NodeFaults] = {}
        self.entries: dict[str, DeviceEntry] = {}
        self.open_end(frozenset())

    def add(self, name: str, slave: CanopenSlave, entry: DeviceEntry | None = None) -> None:
        """Put a CANopen slave on the bus.

        Args:
            name: name of the node.
            slave: the slave.
            entry: description of the slave in the header of a trace, from which a replay makes the
                slave. With None a replay cannot make the slave.
        """
        node = self.nodes[name] = late.Node(name, slave, self.wire)
        self.node_faults[name] = late.NodeFaults(node, self.wire)
        self.entries[name] = entry or DeviceEntry(self.name)

    def open_end(self, accepts: frozenset[int] | None = None) -> CanEnd:
        """Connect an end for a host, which recovers from bus-off at once."""
        end = self.wire.end(accepts)
        end.auto_recovery = True
        return end

    @property
    def faults(self) -> WireFaults:
        """The object on which faults of the bus are armed."""
        return self.wire.faults

    @property
    def chances(self) -> Sequence[CanFaults]:
        """Objects with random faults."""
        return [self.wire.faults]

    @property
    def parts(self) -> Mapping[str, HasSignals]:
        """The physical side of each node."""
        return {name: late.NodeSide(node) for name, node in self.nodes.items()}

    @property
    def wire_entry(self) -> WireEntry:
        """Trace entry of the bus."""
        return WireEntry(WireType.CAN, {"bit_rate": self.wire.bit_rate})

    def stations(self, recorder: TraceRecorder | None) -> Iterator[Station[Frames]]:
        """Yield the nodes on the bus; with a recorder they are recorded."""
        for name, node in self.nodes.items():
            station = Station(recorder.device(name, node) if recorder else node, node.port)
            self.node_faults[name].station = station
            yield station

    @property
    def lost(self) -> int:
        """Number of frames lost because of a full queue."""
        return sum(node.port.lost for node in self.nodes.values())


Mount = LineMount | BusMount
