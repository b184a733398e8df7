"""The objects of a DeviceRTC, made of its profile (DECISION K2, K3, K17).

>>> table = object_table(RtcProfile(type_name="Empty"))
>>> {f"{row.index:04X}h": row.default.decode() for row in table if row.index == 0x1008}
{'1008h': 'Empty'}
"""

from __future__ import annotations

from typing import Final

from tickrig.wire.canopen.eds.communication_profile import (
    OFF,
    CommunicationProfile,
    Pdo,
    add_communication,
)
from tickrig.wire.canopen.eds.object_table import (
    BIT_RATES,
    MAX_VARIABLE_BYTES,
    RO,
    ROT,
    RW,
    RWW,
    DeviceInfo,
    ObjectTable,
)
from tickrig.wire.rtc_canopen.profile import PlacedPort, PortDirection, RtcProfile

NO_PROFILE: Final = 0
"""Device type of a device without a standardised profile (CiA 301, object 1000h)."""

HEARTBEAT_MS: Final = 100
"""Producer heartbeat time (DECISION K14)."""


def object_table(profile: RtcProfile) -> ObjectTable:
    """Return the objects: those of CiA 301, then one for each port from 2100h on."""
    table = ObjectTable()
    communication = CommunicationProfile(
        device_type=NO_PROFILE,
        name=profile.type_name,
        hardware="DeviceRTC",
        software=profile.version,
        product_code=profile.code,
        revision=profile.revision,
        heartbeat_ms=HEARTBEAT_MS,
        rpdos=_pdos(profile, PortDirection.IN),
        tpdos=_pdos(profile, PortDirection.OUT),
    )
    add_communication(table, communication)
    for port in profile.placed():
        _add_port(table, port)
    return table


def device_info(profile: RtcProfile) -> DeviceInfo:
    """Return the head of the EDS."""
    return DeviceInfo(profile.vendor, profile.type_name, bit_rates=BIT_RATES)


def _pdos(profile: RtcProfile, direction: PortDirection) -> list[Pdo]:
    return [
        Pdo(OFF if port.cob_id is None else port.cob_id, port.mapping, relative=port.relative)
        for port in profile.placed(direction)
    ]


ACCESS: Final = {
    (PortDirection.IN, False): RWW,
    (PortDirection.OUT, False): ROT,
    (PortDirection.IN, True): RW,
    (PortDirection.OUT, True): RO,
}
"""By direction, and whether SDO alone carries the port."""


def _add_port(table: ObjectTable, port: PlacedPort) -> None:
    kind, name = port.profile.port_type, port.profile.name
    access = ACCESS[port.profile.direction, port.profile.by_sdo]
    default, most = None, MAX_VARIABLE_BYTES
    if not kind.data_type.size:
        default, most = kind.default, kind.max_bytes
    if kind.length == 1:
        table.variable(port.index, name, kind.data_type, access, default, max_bytes=most)
    else:
        table.array(port.index, name, kind.length, kind.data_type, access, default, max_bytes=most)
