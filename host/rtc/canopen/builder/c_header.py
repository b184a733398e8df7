"""The object dictionary of a DeviceRTC as a C header, for a real microcontroller."""

from __future__ import annotations

from collections.abc import Iterator
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
"""Data types of ports."""

NODE_ID: Final = 0x80
"""Bit of `access` beside those of `Access`: the node-ID is added to the default."""

_HEAD: Final = """\
/* {type_name} {version}: object dictionary of a DeviceRTC, written by rtc-canopen-builder.
 *
 * Define {upper}_OD_DEFINE in one C file before this header; the table is put there.
 */
#ifndef {upper}_OD_H
#define {upper}_OD_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {{
#endif

#define {upper}_RATE_HZ {rate_hz}u
#define {upper}_OD_COUNT {count}u
#define {upper}_NO_PORT 0xFFFFu
#define {upper}_TEXT {text}u /* characters of a text port; a 0 follows them */

/* Bits of `access`. */
#define {upper}_READ 0x01u
#define {upper}_WRITE 0x02u
#define {upper}_CONST 0x04u
#define {upper}_TPDO 0x08u
#define {upper}_RPDO 0x10u
#define {upper}_NODE_ID 0x80u /* the node-ID is added to the default */

/* What a callback returns (OMG RTC, ReturnCode_t); anything but 0 leads to Error. */
typedef enum {{ {upper}_RTC_OK = 0, {upper}_RTC_ERROR = 1 }} {lower}_result;
"""

_ENTRY: Final = """
typedef struct {{
    uint16_t index;
    uint8_t sub;
    uint8_t data_type;  /* CiA 301; A0h is one character */
    uint8_t access;
    uint8_t size;       /* bytes of a number or of a wide character, 0 of a text */
    uint16_t port;      /* offset in {lower}_ports, or {upper}_NO_PORT */
    uint64_t number;    /* default of a number, bit by bit */
    const char *text;   /* default of a text */
}} {lower}_od_entry;

extern {lower}_ports {lower}_values;
extern const {lower}_od_entry {lower}_od[{upper}_OD_COUNT];
"""

_FOOT: Final = """
#ifdef __cplusplus
}}
#endif

#endif /* {upper}_OD_H */
"""


def write_header(profile: RtcProfile) -> str:
    """Return the text of a header: ports, callbacks, and every object with its default."""
    rows = list(object_table(profile))
    lower = snake_name(profile.type_name)
    words = {
        "type_name": profile.type_name,
        "version": profile.version,
        "rate_hz": profile.rate_hz,
        "count": len(rows),
        "text": MAX_TEXT,
        "lower": lower,
        "upper": lower.upper(),
    }
    return "\n".join(
        [
            _HEAD.format(**words),
            *_ports(profile, lower, lower.upper()),
            _ENTRY.format(**words),
            *_prototypes(lower),
            *_table(profile, rows, lower),
            _FOOT.format(**words),
        ]
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
    access = row.access.value | (NODE_ID if row.relative else 0)
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
