"""The values of master and slaves in a bus.yml, with their places."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tickrig.host.text.document import FilePlace, Item
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.nmt import INVALID
from tickrig.wire.canopen.pdo import MappedObject

_Extra = Mapping[str, Item]
"""The mapping `tickrig:` of the file, unchanged."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Device type and identity that the master expects of a slave at boot-up (1F84h to 1F88h).

    The master does not check a value of 0.

    Attributes:
        device_type: device type (object 1000h).
        vendor_id: vendor-ID (object 1018h:01).
        product_code: product code (object 1018h:02).
        revision_number: revision number (object 1018h:03).
        serial_number: serial number (object 1018h:04).
    """

    device_type: int = 0
    vendor_id: int = 0
    product_code: int = 0
    revision_number: int = 0
    serial_number: int = 0


@dataclass(frozen=True, slots=True)
class BusWrite:
    """One SDO write with which the master configures a slave at boot-up, an entry of a concise DCF.

    Attributes:
        index: index of the object, 0x0000..0xFFFF.
        sub_index: sub-index of the object, 0..255.
        data: bytes that the master writes, little endian.
        place: path of the bus.yml, and number of its line that requires the write.
    """

    index: int
    sub_index: int
    data: bytes
    place: FilePlace


@dataclass(frozen=True, slots=True)
class BusPdo:
    """Settings of one PDO of a slave, from the bus.yml and the EDS.

    Attributes:
        number: number of the PDO, 1..512.
        transmit: whether the slave sends the PDO (TPDO). Otherwise the slave receives it (RPDO).
        cob_id: COB-ID as in the communication parameter. If bit 31 is set, the PDO is disabled.
        transmission: transmission type, 0..255.
        inhibit_time_100us: inhibit time of a TPDO, in units of 100 µs.
        event_timer_ms: event timer of a TPDO, or deadline of an RPDO.
        sync_start: SYNC start value of a TPDO.
        mapping: mapped objects in order. An index below 0020h is a dummy object.
    """

    number: int
    transmit: bool
    cob_id: int
    transmission: int = 0
    inhibit_time_100us: int = 0
    event_timer_ms: int = 0
    sync_start: int = 0
    mapping: tuple[MappedObject, ...] = ()

    @property
    def enabled(self) -> bool:
        """Whether the PDO is enabled."""
        return not self.cob_id & INVALID


@dataclass(frozen=True, slots=True)
class DriveChannel:
    """Scales and offsets of one drive axis, as the CiA 402 driver of ros2_canopen uses them.

    The scales convert between the units of the user, such as rad, and the units of the device.

    Attributes:
        name: name of the joint that the axis moves.
        scale_pos_to_dev: device units per unit of position.
        scale_pos_from_dev: units of position per device unit.
        scale_vel_to_dev: device units per unit of speed.
        scale_vel_from_dev: units of speed per device unit.
        scale_eff_to_dev: device units per unit of effort.
        scale_eff_from_dev: units of effort per device unit.
        offset_pos_to_dev: offset added to a position, in device units.
        offset_pos_from_dev: offset added to a position, in units of position.
    """

    name: str
    scale_pos_to_dev: float = 1000.0
    scale_pos_from_dev: float = 0.001
    scale_vel_to_dev: float = 1000.0
    scale_vel_from_dev: float = 0.001
    scale_eff_to_dev: float = 1000.0
    scale_eff_from_dev: float = 0.001
    offset_pos_to_dev: float = 0.0
    offset_pos_from_dev: float = 0.0


@dataclass(frozen=True, slots=True)
class BusSlave:
    """A slave of the bus: the values that the master expects of the slave and writes to it.

    Attributes:
        name: name of the slave, which is the name of its section.
        node_id: node-ID of the slave, 1..127.
        place: file and line of the slave's section.
        sheet: EDS or DCF of the slave.
        device: the device that the EDS or DCF describes.
        identity: identity that the master checks at boot-up.
        writes: concise DCF, in the order in which the master writes it.
        pdos: all PDOs of the dictionary as they are after `writes`, RPDOs first.
        master_pdos: PDOs that enter the master's own dictionary, TPDOs of the slave first.
        heartbeat_producer_ms: producer heartbeat time of the slave after the writes, or 0 for no
            heartbeat.
        heartbeat_consumer: whether the slave watches the master's heartbeat.
        heartbeat_multiplier: time that the master waits for a heartbeat, as a multiple of the
            producer heartbeat time.
        guard_time_ms: guard time, or 0 for no node guarding.
        life_time_factor: life time factor of node guarding.
        emcy_cob_id: COB-ID of the EMCY message with its upper bits.
        boot: whether the master configures and boots the slave (1F81h, bit 2).
        mandatory: whether the master needs the slave to start the network (1F81h, bit 3).
        reset_communication: whether the master may reset the slave at boot-up (1F81h, bit 4).
        retry_factor: number of attempts of node guarding.
        software_file: path of the firmware file, empty if there is none.
        software_version: software version that the master expects (1F55h), or 0 for any.
        restore_configuration: sub-index of 1011h that the master restores before the writes, or 0
            to restore nothing.
        boot_timeout_ms: time that ros2_canopen waits for the slave, or None for the default of
            ros2_canopen.
        driver: driver class of ros2_canopen, empty without a driver.
        package: package of the driver.
        channels: axes of the drive. A node without `num_channels` has one axis.
        settings: all other keys of the driver in the file, unchanged.
        extra: mapping `tickrig:` of the slave.
    """

    name: str
    node_id: int
    place: FilePlace
    sheet: Path
    device: EdsDevice
    identity: Identity
    writes: tuple[BusWrite, ...] = ()
    pdos: tuple[BusPdo, ...] = ()
    master_pdos: tuple[BusPdo, ...] = ()
    heartbeat_producer_ms: int = 0
    heartbeat_consumer: bool = False
    heartbeat_multiplier: float = 3.0
    guard_time_ms: int = 0
    life_time_factor: int = 0
    emcy_cob_id: int = INVALID
    boot: bool = True
    mandatory: bool = False
    reset_communication: bool = True
    retry_factor: int = 3
    software_file: str = ""
    software_version: int = 0
    restore_configuration: int = 0
    boot_timeout_ms: int | None = None
    driver: str = ""
    package: str = ""
    channels: tuple[DriveChannel, ...] = ()
    settings: Mapping[str, Item] = field(default_factory=dict)
    extra: _Extra = field(default_factory=dict)

    @property
    def num_channels(self) -> int:
        """Number of axes."""
        return len(self.channels)

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the axes."""
        return tuple(channel.name for channel in self.channels)


@dataclass(frozen=True, slots=True)
class BusMaster:
    """The master of the bus.

    Attributes:
        node_id: node-ID of the master, 1..127, or 255 if the file does not set a node-ID.
        place: file and line of the master's section.
        baudrate: bit rate of the bus in kbit/s.
        identity: identity of the master.
        sync_period_us: period of SYNC, or 0 for no SYNC.
        sync_window_us: synchronous window length (object 1007h).
        sync_overflow: synchronous counter overflow value (object 1019h).
        heartbeat_producer_ms: producer heartbeat time of the master, or 0 for no heartbeat.
        heartbeat_consumer: whether the master watches the heartbeats of the slaves.
        heartbeat_multiplier: time that the slaves wait for a heartbeat, as a multiple of the
            producer heartbeat time.
        emcy_inhibit_time_100us: inhibit time of EMCY messages (object 1015h).
        nmt_inhibit_time_100us: inhibit time of NMT commands (object 102Ah).
        error_behavior: error behavior (object 1029h) by sub-index.
        time_cob_id: COB-ID of the TIME message (object 1012h).
        start: whether the master enters Operational by itself.
        start_nodes: whether the master starts the slaves.
        start_all_nodes: whether the master starts the slaves with one command.
        reset_all_nodes: whether the master resets all slaves if it loses a mandatory slave.
        stop_all_nodes: whether the master stops all slaves if it loses a mandatory slave.
        boot_time_ms: time that the master waits for the mandatory slaves (1F89h), or 0 for no
            limit.
        boot_timeout_ms: time that ros2_canopen waits for all slaves, or None for the default of
            ros2_canopen.
        driver: driver class of ros2_canopen, empty without a driver.
        package: package of the driver.
        extra: mapping `tickrig:` of the master.
    """

    node_id: int
    place: FilePlace
    baudrate: int = 1000
    identity: Identity = Identity()
    sync_period_us: int = 0
    sync_window_us: int = 0
    sync_overflow: int = 0
    heartbeat_producer_ms: int = 0
    heartbeat_consumer: bool = True
    heartbeat_multiplier: float = 3.0
    emcy_inhibit_time_100us: int = 0
    nmt_inhibit_time_100us: int = 0
    error_behavior: Mapping[int, int] = field(default_factory=lambda: {1: 0})
    time_cob_id: int = 0x100
    start: bool = True
    start_nodes: bool = True
    start_all_nodes: bool = False
    reset_all_nodes: bool = False
    stop_all_nodes: bool = False
    boot_time_ms: int = 0
    boot_timeout_ms: int | None = None
    driver: str = ""
    package: str = ""
    extra: _Extra = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class BusDefaults:
    """The section `options` of a bus.yml: default settings for all nodes.

    Attributes:
        dcf_path: folder in which the master looks for the DCF files at run time, as written in the
            file.
        heartbeat_multiplier: time that a consumer waits for a heartbeat, as a multiple of the
            producer heartbeat time.
        retry_factor: number of attempts of node guarding.
        extra: content of the key `tickrig:` of the section.
    """

    dcf_path: str = ""
    heartbeat_multiplier: float = 3.0
    retry_factor: int = 3
    extra: _Extra = field(default_factory=dict)
