"""The configuration of a master with network and slaves, from objects 1016h and 1F80h to 1F8Ah."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ObjectWrite:
    """Value that a master writes to an object of a slave at boot-up, from its concise DCF (1F22h).

    Attributes:
        index: index of the object.
        sub: sub-index of the object.
        data: bytes that the master writes, little endian.
    """

    index: int
    sub: int
    data: bytes


@dataclass(frozen=True, slots=True)
class SlaveAssignment:
    """The values that the master expects of a slave, and its actions for the slave (CiA 302-2).

    An identity, version, date or time of 0 is not checked.

    Attributes:
        node_id: node-ID of the slave, 1..127.
        name: name of the slave in messages.
        boots: whether the master boots and starts the slave (1F81h, bit 2).
        mandatory: whether the network must not start without the slave (1F81h, bit 3).
        reset_communication: whether the master resets the slave at the start (1F81h, bit 4).
            Otherwise the master does not touch a slave that is Operational.
        device_type: expected device type (object 1F84h).
        vendor_id: expected vendor-ID (object 1F85h).
        product_code: expected product code (object 1F86h).
        revision: expected revision number (object 1F87h).
        serial: expected serial number (object 1F88h).
        software_version: expected version of the software (object 1F55h), which is checked unless
            it is 0 (1F81h, bit 5).
        program: software to download if the version in the slave differs (1F58h; 1F81h, bit 6).
        restore_sub: sub-index of 1011h that is written before the configuration (1F8Ah; 1F81h, bit
            7).
        configuration_date: expected date of the configuration (object 1F26h). The configuration is
            skipped if date and time equal those in 1020h.
        configuration_time: expected time of the configuration (object 1F27h).
        writes: values of the concise DCF (object 1F22h), in the order of writing.
        heartbeat_us: consumer heartbeat time (1016h), or 0 for none.
        guard_us: guard time, or 0 for no node guarding (1F81h, bits 16 to 31).
        life_time_factor: number of guard requests without an answer after which the slave is lost
            (1F81h, bits 8 to 15).
    """

    node_id: int
    name: str = ""
    boots: bool = True
    mandatory: bool = False
    reset_communication: bool = True
    device_type: int = 0
    vendor_id: int = 0
    product_code: int = 0
    revision: int = 0
    serial: int = 0
    software_version: int = 0
    program: bytes = b""
    restore_sub: int = 0
    configuration_date: int = 0
    configuration_time: int = 0
    writes: tuple[ObjectWrite, ...] = ()
    heartbeat_us: int = 0
    guard_us: int = 0
    life_time_factor: int = 3


@dataclass(frozen=True, slots=True)
class MasterPlan:
    """The behaviour of the master (CiA 302-2, NMT start-up 1F80h).

    Attributes:
        slaves: slaves of the master.
        node_id: node-ID of the master.
        starts: whether the master enters Operational by itself (bit 2 is 0).
        starts_nodes: whether the master starts slaves (bit 3 is 0).
        starts_all: whether the master starts all slaves at once, after all mandatory slaves have
            booted (bit 1).
        resets_all: whether the loss of a mandatory slave resets all nodes (bit 4).
        stops_all: whether the loss of a mandatory slave stops all nodes (bit 6).
        boot_time_us: time that the master tries to boot a mandatory slave, or 0 for no limit
            (1F89h).
        heartbeat_us: producer heartbeat time (1017h), or 0 for none.
        sync_us: communication cycle period (1006h), or 0 for no SYNC.
        sync_overflow: last value of the counter of SYNC, or 0 for none (1019h).
        sdo_timeout_us: time that the master waits for an SDO response.
    """

    slaves: tuple[SlaveAssignment, ...]
    node_id: int = 127
    starts: bool = True
    starts_nodes: bool = True
    starts_all: bool = False
    resets_all: bool = False
    stops_all: bool = False
    boot_time_us: int = 0
    heartbeat_us: int = 0
    sync_us: int = 0
    sync_overflow: int = 0
    sdo_timeout_us: int = 100_000
