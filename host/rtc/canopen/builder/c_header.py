"""The object dictionary of a DeviceRTC as a C header, for a real microcontroller."""

from __future__ import annotations

import string
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tickrig.host.rtc.canopen.builder.profile_file import c_name, snake_name
from tickrig.host.rtc.canopen.builder.skeleton import CALLBACKS
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.rtc_canopen import MAX_TEXT, PlacedPort, RtcProfile, object_table

_C_TYPES: Final = {
    DataType.BOOLEAN: "uint8_t",
    DataType.INTEGER8: "int8_t",
    DataType.INTEGER16: "int16_t",
    DataType.INTEGER32: "int32_t",
    DataType.INTEGER64: "int64_t",
    DataType.UNSIGNED8: "uint8_t",
    DataType.UNSIGNED16: "uint16_t",
    DataType.UNSIGNED32: "uint32_t",
    DataType.UNSIGNED64: "uint64_t",
    DataType.REAL32: "float",
    DataType.REAL64: "double",
    DataType.VISIBLE_CHAR: "char",
    DataType.VISIBLE_STRING: "char",
    DataType.UNICODE_STRING: "uint16_t",
}
"""C types by the data types of ports."""

_NODE_ID: Final = 0x80
"""Bit of `access`, in addition to those of `Access`: the node-ID is added to the default."""

_TEMPLATE: Final = string.Template(Path(__file__).with_name("header.txt").read_text("utf-8"))


def write_header(profile: RtcProfile) -> str:
    """Return the text of a C header for the firmware of a DeviceRTC.

    The header contains the ports, the callbacks, and every object with its default value.
    """
    rows = list(object_table(profile))
    lower = snake_name(profile.type_name)
    upper = lower.upper()
    return _TEMPLATE.substitute(
        type_name=profile.type_name,
        version=profile.version,
        rate_hz=profile.rate_hz,
        count=len(rows),
        text=MAX_TEXT,
        lower=lower,
        upper=upper,
        ports="\n".join(_ports(profile, lower, upper)),
        prototypes="\n".join(_prototypes(lower)),
        table="\n".join(_table(profile, rows, lower)),
    )


def _ports(profile: RtcProfile, lower: str, upper: str) -> Iterator[str]:
    yield "/* What RPDOs write and TPDOs send; ports that SDO alone carries are marked so. */"
    yield "typedef struct {"
    for port in profile.placed():
        kind = port.profile.port_type
        length = f"[{kind.length}]" if kind.length > 1 else ""
        length += "" if kind.element_bits else f"[{upper}_TEXT + 1]"
        by_sdo = ", by SDO" if port.profile.by_sdo else ""
        place = f"{port.profile.direction.value}-port, {port.index:04X}h{by_sdo}"
        member = f"{_C_TYPES[kind.data_type]} {c_name(port.profile.name)}{length};"
        yield f"    {member} /* {place} */"
    if not profile.ports:
        yield "    char none; /* a struct has a member */"
    yield f"}} {lower}_ports;"


def _prototypes(lower: str) -> Iterator[str]:
    for name, result, text in CALLBACKS:
        kind = "void" if result == "None" else f"{lower}_result"
        yield f"{kind} {lower}_{name}(void); /* {text} */"


def _table(profile: RtcProfile, rows: list[EntryDescription], lower: str) -> Iterator[str]:
    ports = {port.index: port for port in profile.placed()}
    upper = lower.upper()
    yield ""
    yield f"#ifdef {upper}_OD_DEFINE"
    yield f"{lower}_ports {lower}_values;"
    yield ""
    yield f"const {lower}_od_entry {lower}_od[{upper}_OD_COUNT] = {{"
    for row in rows:
        yield f"    {_entry(row, ports.get(row.index), lower)}, /* {row.name} */"
    yield "};"
    yield f"#endif /* {upper}_OD_DEFINE */"


def _entry(row: EntryDescription, port: PlacedPort | None, lower: str) -> str:
    access = row.access.value | (_NODE_ID if row.relative else 0)
    number, text, size = "0u", "NULL", row.data_type.size
    if port is not None and port.profile.port_type.width and row.sub in port.subs:
        size = port.profile.port_type.max_bytes
    if size:
        number = f"0x{int.from_bytes(row.default, 'little'):X}u"
    else:
        text = f'"{row.default.decode("ascii")}"'
    return (
        f"{{0x{row.index:04X}u, {row.sub}u, 0x{row.data_type:02X}u, 0x{access:02X}u, "
        f"{size}u, {_offset(row, port, lower)}, {number}, {text}}}"
    )


def _offset(row: EntryDescription, port: PlacedPort | None, lower: str) -> str:
    if port is None or row.sub not in port.subs:
        return f"{lower.upper()}_NO_PORT"
    member = c_name(port.profile.name)
    element = f"[{row.sub - 1}]" if row.sub else ""
    return f"offsetof({lower}_ports, {member}{element})"
