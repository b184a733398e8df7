"""The configuration of a master: network and slaves, 1016h and 1F80h to 1F8Ah as values."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ObjectWrite:
    """A value of the concise DCF, 1F22h.

    Attributes:
        index: of the object.
        sub: of the object.
        data: the bytes, little endian.
    """

    index: int
    sub: int
    data: bytes


@dataclass(frozen=True, slots=True)
class SlaveAssignment:
    """What the master expects of a slave and does for the slave (CiA 302-2).

    An identity, version, date or time of 0 is not checked.

    Attributes:
        node_id: 1..127.
        name: its name in messages.
        boots: whether the master boots and starts it (1F81h, bit 2).
        mandatory: whether the network must not start without the slave (bit 3).
        reset_communication: whether the master resets the slave at the start; otherwise the master
            does not touch a slave that is Operational (bit 4).
        device_type: 1F84h.
        vendor_id: 1F85h.
        product_code: 1F86h.
        revision: 1F87h.
        serial: 1F88h.
        software_version: 1F55h; checked unless it is 0 (bit 5).
        program: software to download if its version differs (1F58h, bit 6).
        restore_sub: sub-index of 1011h that is written before the configuration (1F8Ah, bit 7).
        configuration_date: 1F26h; the configuration is skipped if date and time equal those in
            1020h.
        configuration_time: 1F27h.
        writes: 1F22h, in this order.
        heartbeat_us: consumer heartbeat time (1016h), 0 for none.
        guard_us: guard time, 0 for no node guarding (1F81h, bits 16 to 31).
        life_time_factor: number of guard requests without an answer after which the slave is lost
            (bits 8 to 15).
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
    """The behaviour of the master itself (CiA 302-2, NMT start-up 1F80h).

    Attributes:
        slaves: its slaves.
        node_id: its own node-ID.
        starts: whether it enters Operational by itself (bit 2 is 0).
        starts_nodes: whether it starts slaves (bit 3 is 0).
        starts_all: whether it starts all slaves at once, after all mandatory slaves have booted
            (bit 1).
        resets_all: whether the loss of a mandatory slave resets all nodes (bit 4).
        stops_all: whether the loss of a mandatory slave stops all nodes (bit 6).
        boot_time_us: how long it tries to boot a mandatory slave, 0 for no limit (1F89h).
        heartbeat_us: producer heartbeat time (1017h), 0 for none.
        sync_us: communication cycle period (1006h), 0 for no SYNC.
        sync_overflow: last value of the counter of SYNC, 0 for none (1019h).
        sdo_timeout_us: how long it waits for an SDO response.
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
