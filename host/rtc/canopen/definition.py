"""System Definitions, which are the settings of the server, and its data from EDS files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Final

from tickrig.host.canopen.eds import read_sound
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_file import EdsError, Finding
from tickrig.wire.canopen.eds.object_table import Access
from tickrig.wire.canopen.pdo import MAX_PDO_BITS, MappedObject
from tickrig.wire.rtc_canopen import PortDirection

# Errors of RTC-CANopen whose messages are for people.
#
# DefinitionError (ValueError)    a System Definition that cannot be used
# ServerRefused (ValueError)      a command that the server cannot execute


class DefinitionError(ValueError):
    """The System Definition (settings of the CANopen server) or an EDS file in it cannot be used.

    Attributes:
        line: number of the line with the error, from 1, or 0 if no line is known.
    """

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(f"line {line}: {message}" if line else message)
        self.line = line


class ServerRefused(ValueError):  # noqa: N818 - what the server did
    """The CANopen server cannot execute a command, for example because a node is not ready."""


# A System Definition: nodes of a bus, and what joins them (NEDO report, Fig. 108; ours: K16).

PDO_COUNT: Final = 512
"""Number of PDOs per direction (CiA 301, object dictionary: 1400h to 15FFh, 1800h to 19FFh)."""

PDO_CAN_IDS: Final = range(0x181, 0x6E0)
"""CAN-IDs that CiA 301 allows for PDOs. Some of them belong to SDO."""


class Role(StrEnum):
    """Type of a device. The type decides how the proxy of the device controls the device."""

    DEVICE_RTC = "device_rtc"
    DEVICE = "device"  # off-the-shelf, CiA 301 alone
    DRIVE = "drive"  # CiA 402


@dataclass(frozen=True, slots=True, order=True)
class PdoName:
    """Name of a PDO of a node in a System Definition, such as `16.tpdo2`.

    Attributes:
        node: node-ID of the node.
        pdo: name of the PDO within the node, such as `tpdo1` if the device sends the PDO, or
            `rpdo1` if the device receives it.
    """

    node: int
    pdo: str

    def __str__(self) -> str:
        """Return the name in the notation of a System Definition."""
        return f"{self.node}.{self.pdo}"

    @property
    def index(self) -> int:
        """The index of the communication parameter: 1400h for `rpdo1`, 1801h for `tpdo2`."""
        return (0x1800 if self.pdo[0] == "t" else 0x1400) + int(self.pdo[4:]) - 1


@dataclass(frozen=True, slots=True)
class BusEntry:
    """Settings in a System Definition with which python-can opens the CAN bus.

    If an attribute is None, the command line gives its value.

    Attributes:
        channel: channel, such as `can0`.
        interface: python-can interface, such as `socketcan`.
        bitrate: bit rate in bit/s.
    """

    channel: str | None = None
    interface: str | None = None
    bitrate: int | None = None


@dataclass(frozen=True, slots=True)
class MasterEntry:
    """Settings of the server itself in a System Definition.

    The server is the NMT master of the bus.

    Attributes:
        node: node-ID of the server.
        heartbeat_ms: producer heartbeat time of the server, or 0 for no heartbeat.
        rate_hz: rate of the execution context of the proxies.
        remove_after_ms: time without a frame of a node after which its proxy is removed.
        reconnect: whether the connections of a proxy are made again when it returns.
        leave: state in which the server leaves the nodes at its end: `pre_operational` or
            `stopped`.
        sync_ms: communication cycle period, or 0 for no SYNC.
    """

    node: int = 127
    heartbeat_ms: int = 100
    rate_hz: float = 100.0
    remove_after_ms: int = field(default=1_000, metadata={"key": "remove_ms"})
    reconnect: bool = True
    leave: str = "pre_operational"
    sync_ms: int = 0


@dataclass(frozen=True, slots=True)
class PdoEntry:
    """Parameters that the server writes into a PDO of a node.

    A value of None keeps the value of the device.

    Attributes:
        mapping: objects that the PDO carries.
        cob_id: COB-ID of the PDO. If bit 31 is set, the PDO stays off. If bit 30 is set, remote
            requests are not allowed.
        type: transmission type.
        inhibit_100us: inhibit time in units of 100 us.
        event_ms: event timer in ms.
    """

    mapping: tuple[MappedObject, ...] | None = None
    cob_id: int | None = None
    type: int | None = None
    inhibit_100us: int | None = None
    event_ms: int | None = None


@dataclass(frozen=True, slots=True)
class SdoPortEntry:
    """Port of a proxy in a System Definition whose value is transferred by SDO instead of a PDO.

    Attributes:
        index: index of the object. All elements of an array are one value.
        direction: `out` if the object is read for the port, `in` if it is written from the port.
        type: name of the data type of the port. With None, the type follows from the data type of
            the object in the EDS.
    """

    index: int
    direction: PortDirection
    type: str | None = None


@dataclass(frozen=True, slots=True)
class NodeEntry:
    """Settings of one node of the bus in a System Definition.

    Attributes:
        id: node-ID of the node.
        name: instance name of the proxy that represents the node.
        eds: path of the node's EDS file, relative to the System Definition.
        role: type of the device: DeviceRTC, CiA 402 drive, or other CANopen device.
        heartbeat_ms: producer heartbeat time of the node.
        ports: names of ports by PDO. The key for the second TPDO is `tpdo2`.
        pdos: settings that the server writes to the node for its PDOs. The keys are as in `ports`.
        restart: maximum number of times in a row that the server restarts the node after its loss.
        sdo_ports: ports of objects that are transferred by SDO, by name.
    """

    id: int
    name: str
    eds: str
    role: Role = Role.DEVICE_RTC
    heartbeat_ms: int = 100
    ports: Mapping[str, str] = field(default_factory=dict)
    pdos: Mapping[str, PdoEntry] = field(default_factory=dict)
    restart: int = 0
    sdo_ports: Mapping[str, SdoPortEntry] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SdoEntry:
    """A value that the server writes into an object of a node while it sets up the node.

    Attributes:
        node: node-ID of the node.
        index: index of the object.
        sub: sub-index of the object.
        value: value to write.
        size: size of the value in bytes: 1, 2, 4 or 8.
    """

    node: int
    index: int
    sub: int
    value: int
    size: int

    @property
    def data(self) -> bytes:
        """The bytes that are written."""
        return self.value.to_bytes(self.size, "little", signed=self.value < 0)


@dataclass(frozen=True, slots=True)
class PdoLink:
    """A link by which one node directly receives a PDO of another node, without the PC.

    Attributes:
        source: TPDO of the sending node.
        target: RPDO of the receiving node.
    """

    source: PdoName
    target: PdoName


@dataclass(frozen=True, slots=True)
class RtConnection:
    """Two ports that are to be connected through the PC, such as `Palette0.ai` and `Logger0.in`."""

    source: str
    target: str
    properties: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class StartEntry:
    """Order in which the server activates the nodes, and whether it does so automatically.

    Attributes:
        order: node-IDs in the order of activation. Nodes that are left out follow in the order of
            the node list.
        autoactivate: whether a node is activated when it is ready and all nodes before it are
            Active.
    """

    order: tuple[int, ...] = ()
    autoactivate: bool = False


@dataclass(frozen=True, slots=True)
class SystemDefinition:
    """Settings of the CANopen server: the nodes of a bus, their links and connections."""

    nodes: tuple[NodeEntry, ...]
    bus: BusEntry = BusEntry()
    master: MasterEntry = MasterEntry()
    sdo: tuple[SdoEntry, ...] = ()
    pdo_links: tuple[PdoLink, ...] = ()
    rt_connections: tuple[RtConnection, ...] = ()
    start: StartEntry = StartEntry()

    @property
    def start_order(self) -> tuple[int, ...]:
        """Node-IDs of all nodes in the order of activation."""
        ids = (node.id for node in self.nodes)
        return tuple(dict.fromkeys((*self.start.order, *ids)))

    @property
    def named_pdos(self) -> Iterator[PdoName]:
        """PDOs that have a port name, parameters or a link."""
        for node in self.nodes:
            for name in (*node.ports, *node.pdos):
                yield PdoName(node.id, name)
        for link in self.pdo_links:
            yield from (link.source, link.target)


_IDENTITY: Final = ((0x1000, 0), (0x1018, 1), (0x1018, 2), (0x1018, 3))
"""Device type, vendor-ID, product code and revision number. A serial number is of one device."""

_ENDINGS: Final = (".eds", ".dcf", ".xdd", ".xdc")
_RPDOS: Final = range(0x1400, 0x1600)
TPDOS: Final = range(0x1800, 0x1A00)


@dataclass(frozen=True, slots=True)
class MappableObject:
    """An object of a device that its PDOs can carry, according to the EDS.

    Attributes:
        mapped: mapping entry of the object.
        name: name of the object in the EDS.
        way: direction of the PDOs that can carry it: Access.TPDO, Access.RPDO or both.
    """

    mapped: MappedObject
    name: str
    way: Access


@dataclass(frozen=True, slots=True)
class DeviceFile:
    """Data about a device type that the server reads from its EDS file.

    Attributes:
        identity: values in the file for the objects 1000h (device type) and 1018h (identity).
        defaults: power-on values in the file, as bytes. If a value depends on the node-ID, the
            node-ID is not added here.
        data_types: data types by index and sub-index.
        pdos: indices of the PDO communication parameters of the device.
        relative: index and sub-index of each value in `defaults` that depends on the node-ID. A
            device adds its node-ID to the value.
        findings: errors in the file. Objects with errors are not used.
        mappable: objects that the PDOs of the device can carry.
    """

    identity: Mapping[tuple[int, int], int]
    data_types: Mapping[tuple[int, int], int]
    pdos: tuple[int, ...]
    defaults: Mapping[tuple[int, int], bytes]
    relative: frozenset[tuple[int, int]] = frozenset()
    findings: tuple[Finding, ...] = ()
    mappable: tuple[MappableObject, ...] = ()


def read_device_file(path: Path) -> DeviceFile:
    """Read the data about a device type from its EDS, DCF, XDD or XDC file.

    Raises:
        DefinitionError: the file cannot be read.
    """
    device, findings = _read(path)
    defaults = {
        (row.index, row.sub): row.default
        for row in device.entries
        if row.has_default and row.data_type.is_integer
    }
    return DeviceFile(
        {key: int.from_bytes(defaults[key], "little") for key in _IDENTITY if key in defaults},
        {(row.index, row.sub): row.data_type for row in device.entries},
        tuple(index for index in device.objects if index in _RPDOS or index in TPDOS),
        defaults,
        frozenset((row.index, row.sub) for row in device.entries if row.relative),
        findings,
        tuple(_mappable(device)),
    )


def _mappable(device: EdsDevice) -> Iterator[MappableObject]:
    for row in device.entries:
        way = row.access & (Access.TPDO | Access.RPDO)
        if way and 0 < row.data_type.bits <= MAX_PDO_BITS:
            mapped = MappedObject(row.index, row.sub, row.data_type.bits)
            info = device.objects[row.index]
            own = row.name if row.sub == 0 or row.name.startswith(info.name) else ""
            yield MappableObject(mapped, own or f"{info.name}: {row.name}", way)


def _read(path: Path) -> tuple[EdsDevice, tuple[Finding, ...]]:
    if path.suffix.lower() not in _ENDINGS:
        raise DefinitionError(f"{path}: the name does not end in {', '.join(_ENDINGS)}")
    try:
        return read_sound(path)
    except OSError as error:
        raise DefinitionError(f"{path}: {error.strerror}") from error
    except EdsError as error:
        raise DefinitionError(str(error)) from error
