"""What is known of an object: its name, type and unit, and who says so; states of a drive.

>>> drive_state(0x0237), drive_state(0x0250), drive_state(0x0010)
('operation enabled', 'switch on disabled', 'not ready to switch on')
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NamedTuple

from tickrig.host.canopen.master.cia402.drive_state import DriveState, state_of
from tickrig.host.text.steps import content_lines
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.errors import FieldError

_STATUSWORD_BITS: Final = {
    "ready_to_switch_on": 0,
    "switched_on": 1,
    "operation_enabled": 2,
    "fault": 3,
    "voltage_enabled": 4,
    "quick_stop": 5,
    "switch_on_disabled": 6,
    "warning": 7,
    "remote": 9,
    "target_reached": 10,
    "internal_limit_active": 11,
}
_CONTROLWORD_BITS: Final = {
    "switch_on": 0,
    "enable_voltage": 1,
    "quick_stop": 2,
    "enable_operation": 3,
    "fault_reset": 7,
    "halt": 8,
}
BITS: Final = {"statusword": _STATUSWORD_BITS, "controlword": _CONTROLWORD_BITS}
"""Bits by name, of the objects whose bits have names."""


_BY_BITS: Final = tuple(
    "" if (state := state_of(bits)) is DriveState.UNKNOWN else state.value.lower()
    for bits in range(0x80)
)


def drive_state(statusword: int) -> str:
    """Return the state; empty for bits that are none."""
    return _BY_BITS[statusword & 0x7F]


_MAX_NUMBER_BYTES: Final = 8

_OTHERS: Final = re.compile(r"[^0-9a-z]+")


class ObjectText(NamedTuple):
    """An object as people know it.

    Attributes:
        name: as `Signal.name`.
        kind: its data type, None where nobody said it.
        unit: empty where nobody said it.
        factor: by which the number is multiplied to be in that unit.
        source: as `Decoded.source`.
        in_hex: a set of bits, or an identifier.
    """

    name: str = ""
    kind: DataType | None = None
    unit: str = ""
    factor: float = 1
    source: str = ""
    in_hex: bool = False

    def fitted(self, data: bytes, *, sized: bool = True) -> bytes:
        """Return the bytes that the type has, of more that an SDO carried.

        Args:
            data: as they were carried.
            sized: their number was told. Where it was not, those behind mean nothing; where it
                was, they are left out only if they fill the value up.
        """
        size = 0 if self.kind is None else self.kind.size
        if not 0 < size < len(data):
            return data
        value, rest = data[:size], data[size:]
        fill = b"\xff" if self.kind and self.kind.signed and value[-1] >> 7 else b"\0"
        filled = self.kind is not None and self.kind.is_integer and rest == fill * len(rest)
        return value if filled or not sized else data

    def read(self, data: bytes, *, sized: bool = True) -> tuple[Value, str]:
        """Return value and text of some bytes, as `fitted` has them.

        A type that does not fit them is not used.
        """
        data = self.fitted(data, sized=sized)
        if self.kind is not None and not self.in_hex:
            try:
                return self._scaled(self.kind.decode(data))
            except FieldError:
                pass
        if self.in_hex or self.kind is None or self.kind.is_integer:
            return _number(data)
        return data, write_bytes(data)

    def _scaled(self, value: Value) -> tuple[Value, str]:
        if isinstance(value, bytes):
            return value, write_bytes(value)
        if isinstance(value, str):
            return value, repr(value.rstrip("\0"))
        if self.factor != 1:
            value *= self.factor
        return value, f"{value:g}" if isinstance(value, float) else str(value)


def _number(data: bytes) -> tuple[Value, str]:
    """Read bytes as a number without a type."""
    if not 1 <= len(data) <= _MAX_NUMBER_BYTES:
        return data, write_bytes(data)
    number = int.from_bytes(data, "little")
    return number, f"0x{number:0{2 * len(data)}X}"


def slug(name: str) -> str:
    """Return a name as filters write it.

    >>> slug("Velocity actual value"), slug("COB-ID used by PDO")
    ('velocity_actual_value', 'cob_id_used_by_pdo')
    """
    return _OTHERS.sub("_", name.lower()).strip("_")


def write_bytes(data: bytes) -> str:
    r"""Write some bytes: as text where they are text.

    >>> write_bytes(b"EPOS"), write_bytes(b"\x01\xff")
    ("'EPOS'", '01 FF')
    """
    text = data.rstrip(b"\0")
    if text and all(0x20 <= code < 0x7F for code in text):
        return repr(text.decode("ascii"))
    return data.hex(" ").upper()


U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
_TEXT: Final = DataType.VISIBLE_STRING

_PROFILES: Final = 0x6000
_ROWS: Final = [
    (int(index, 16), name, DataType[kind])
    for _, line in content_lines(Path(__file__).with_name("objects.txt").read_text("ascii"))
    for index, kind, name in [line.split()]
]
_ARRAYS: Final = {at: (name[:-2], kind) for at, name, kind in _ROWS if name.endswith("[]")}
_VARIABLES: Final = {at: (name, kind) for at, name, kind in _ROWS if at not in _ARRAYS}
_RECORDS: Final[dict[int, tuple[str, tuple[tuple[str, DataType], ...]]]] = {
    0x1018: ("identity", (("vendor", U32), ("product", U32), ("revision", U32), ("serial", U32)))
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


def describe_standard(index: int, sub: int) -> ObjectText | None:
    """Return what CiA 301 says of an object; None if it says nothing.

    >>> describe_standard(0x1801, 5).name, describe_standard(0x6041, 0)
    ('tpdo2.event_timer', None)
    """
    if index >= _PROFILES:
        return None
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
    is_known = index >= _PROFILES and index in _VARIABLES and sub == 0
    return _text(*_VARIABLES[index]) if is_known else None


def _member(name: str, members: tuple[tuple[str, DataType], ...], sub: int) -> ObjectText:
    if sub == 0:
        return _text(f"{name}.count", U8)
    if sub <= len(members):
        member, kind = members[sub - 1]
        return _text(f"{name}.{member}", kind)
    return ObjectText(f"{name}.{sub}", None if members else U32, in_hex=not members)


def _text(name: str, kind: DataType) -> ObjectText:
    return ObjectText(name, kind, in_hex=name.rpartition(".")[2] in _IN_HEX or "cob_id" in name)
