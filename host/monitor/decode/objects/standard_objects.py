"""Objects that are the same in every device (CiA 301, object dictionary), and those of drives."""

from __future__ import annotations

from typing import Final

from tickrig.host.monitor.decode.objects.object_text import ObjectText
from tickrig.wire.canopen.datatypes import DataType

U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
TEXT: Final = DataType.VISIBLE_STRING

_VARIABLES: Final[dict[int, tuple[str, DataType]]] = {
    0x1000: ("device_type", U32),
    0x1001: ("error_register", U8),
    0x1002: ("manufacturer_status", U32),
    0x1005: ("cob_id_sync", U32),
    0x1006: ("sync_period", U32),
    0x1007: ("sync_window", U32),
    0x1008: ("device_name", TEXT),
    0x1009: ("hardware_version", TEXT),
    0x100A: ("software_version", TEXT),
    0x100C: ("guard_time", U16),
    0x100D: ("life_time_factor", U8),
    0x1012: ("cob_id_time", U32),
    0x1014: ("cob_id_emcy", U32),
    0x1015: ("inhibit_time_emcy", U16),
    0x1017: ("heartbeat_time", U16),
    0x1019: ("sync_overflow", U8),
    0x1F80: ("nmt_startup", U32),
}
_ARRAYS: Final[dict[int, tuple[str, DataType]]] = {
    0x1003: ("error_field", U32),
    0x1010: ("store", U32),
    0x1011: ("restore", U32),
    0x1016: ("heartbeat_consumer", U32),
    0x1028: ("emcy_consumer", U32),
    0x1029: ("error_behaviour", U8),
}
_RECORDS: Final[dict[int, tuple[str, tuple[tuple[str, DataType], ...]]]] = {
    0x1018: (
        "identity",
        (("vendor", U32), ("product", U32), ("revision", U32), ("serial", U32)),
    ),
}
_SDO: Final = (("request_cob_id", U32), ("response_cob_id", U32), ("node_id", U8))
_PDO: Final = (
    *(("cob_id", U32), ("type", U8), ("inhibit_time", U16)),
    *(("reserved", U8), ("event_timer", U16), ("sync_start", U8)),
)
_RANGES: Final = (
    (range(0x1200, 0x1280), "sdo_server", _SDO),
    (range(0x1280, 0x1300), "sdo_client", _SDO),
    (range(0x1400, 0x1600), "rpdo", _PDO),
    (range(0x1600, 0x1800), "rpdo_mapping", ()),
    (range(0x1800, 0x1A00), "tpdo", _PDO),
    (range(0x1A00, 0x1C00), "tpdo_mapping", ()),
)
_IN_HEX: Final = {
    *("device_type", "error_register", "error_code", "controlword", "statusword"),
    *("vendor", "product", "revision", "serial"),
}
_DRIVE: Final[dict[int, tuple[str, DataType]]] = {
    0x603F: ("error_code", U16),
    0x6040: ("controlword", U16),
    0x6041: ("statusword", U16),
    0x6060: ("modes_of_operation", DataType.INTEGER8),
    0x6061: ("modes_of_operation_display", DataType.INTEGER8),
    0x6064: ("position_actual_value", DataType.INTEGER32),
    0x606B: ("velocity_demand_value", DataType.INTEGER32),
    0x606C: ("velocity_actual_value", DataType.INTEGER32),
    0x6071: ("target_torque", DataType.INTEGER16),
    0x6077: ("torque_actual_value", DataType.INTEGER16),
    0x607A: ("target_position", DataType.INTEGER32),
    0x6081: ("profile_velocity", U32),
    0x6083: ("profile_acceleration", U32),
    0x6084: ("profile_deceleration", U32),
    0x60FF: ("target_velocity", DataType.INTEGER32),
}


def describe_standard(index: int, sub: int) -> ObjectText | None:
    """Return what CiA 301 says of an object; None if it says nothing.

    >>> describe_standard(0x1801, 5).name, describe_standard(0x6041, 0)
    ('tpdo2.event_timer', None)
    """
    if index in _VARIABLES:
        return _text(*_VARIABLES[index]) if sub == 0 else None
    if index in _ARRAYS:
        name, kind = _ARRAYS[index]
        return (
            ObjectText(f"{name}.{sub}", kind, in_hex=kind is U32)
            if sub
            else _text(f"{name}.count", U8)
        )
    if index in _RECORDS:
        return _member(*_RECORDS[index], sub)
    for indices, name, members in _RANGES:
        if index in indices:
            return _member(f"{name}{index - indices.start + 1}", members, sub)
    return None


def describe_drive(index: int, sub: int) -> ObjectText | None:
    """Return what CiA 402 says of an object of a drive with one axis; None for others."""
    return _text(*_DRIVE[index]) if index in _DRIVE and sub == 0 else None


def _member(name: str, members: tuple[tuple[str, DataType], ...], sub: int) -> ObjectText:
    if sub == 0:
        return _text(f"{name}.count", U8)
    if sub <= len(members):
        member, kind = members[sub - 1]
        return _text(f"{name}.{member}", kind)
    return ObjectText(f"{name}.{sub}", None if members else U32, in_hex=not members)


def _text(name: str, kind: DataType) -> ObjectText:
    return ObjectText(name, kind, in_hex=name.rpartition(".")[2] in _IN_HEX or "cob_id" in name)
