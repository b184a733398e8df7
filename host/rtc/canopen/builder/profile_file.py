"""Profiles of DeviceRTCs as TOML."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, TypeVar

from tickrig.wire.rtc_canopen.port_types import (
    INTEGER,
    PORT_TYPES,
    CanopenPortType,
    integer,
)
from tickrig.wire.rtc_canopen.profile import (
    CanopenPortProfile,
    PortDirection,
    PortTransport,
    RtcProfile,
)

Table = Mapping[str, Any]
E = TypeVar("E", bound=Enum)

EXAMPLE: Final = """\
# A DeviceRTC: rtc-canopen-builder gripper.toml --out build
name = "Gripper"
version = "1.0"
vendor = "tickrig"
category = "actuator"
rate_hz = 100           # on_execute, error_check and on_error
node_id = 16            # in the System Definition; 1..127

[[port]]                # objects from 2100h up in this order, each port in a PDO of its own;
                        # texts, and what is wider than 64 bits, are read and written by SDO
name = "target_um"
direction = "in"
type = "Short"          # Table 4: Boolean, Octet, Character, Short, UnsignedShort, Float, ...

[[port]]
name = "forces_mn"
direction = "out"
type = "Short"
length = 3              # more than 1: a sequence
"""

TEXTS: Final = ("version", "vendor", "category")
NUMBERS: Final = ("rate_hz", "product_code")
KEYS: Final = ("name", *TEXTS, *NUMBERS, "node_id", "word_bits", "strict_cia301", "port")
PORT_KEYS: Final = ("name", "direction", "type", "length", "cob_id", "transport")
_KINDS: Final = {str: "no text", int: "no whole number", bool: "neither true nor false"}

DEFAULT_WORD_BITS: Final = 32
DEFAULT_NODE_ID: Final = 16


class ProfileError(ValueError):
    """A profile that cannot be used; one line says where and why."""


@dataclass(frozen=True, slots=True)
class Project:
    """What a profile says.

    Attributes:
        profile: the component with its ports.
        node_id: in the System Definition.
        strict_cia301: whether NMT leads out of Error as CiA 301 has it (DECISION K9).
    """

    profile: RtcProfile
    node_id: int = DEFAULT_NODE_ID
    strict_cia301: bool = False


def parse_project(text: str) -> Project:
    """Read a profile.

    Raises:
        ProfileError: no TOML, an unknown key, a value of another kind, or what no
            DeviceRTC can be.
    """
    from tickrig.host.text.toml_reader import load_toml  # noqa: PLC0415 - a TAB needs none

    try:
        content = load_toml(text)
        _check_keys(content, KEYS)
        ports = _tables(content)
        word_bits = _take(content, "word_bits", int, DEFAULT_WORD_BITS)
        profile = RtcProfile(
            type_name=_take(content, "name", str),
            **{key: _take(content, key, str) for key in TEXTS if key in content},
            **{key: _take(content, key, int) for key in NUMBERS if key in content},
            ports=tuple(_port(number, table, word_bits) for number, table in enumerate(ports, 1)),
        )
        node_id = _take(content, "node_id", int, DEFAULT_NODE_ID)
        if not 1 <= node_id <= 127:
            raise ProfileError(f"node_id {node_id} is not in 1..127")
        return Project(profile, node_id, _take(content, "strict_cia301", bool, False))
    except ValueError as error:
        raise ProfileError(str(error)) from None


def _tables(content: Table) -> list[Table]:
    tables = content.get("port", [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise ProfileError("port: ports are tables [[port]]")
    return tables


def _port(number: int, table: Table, word_bits: int) -> CanopenPortProfile:
    """Read a port; errors say which of them."""
    try:
        _check_keys(table, PORT_KEYS)
        direction = _member(table, "direction", PortDirection)
        return CanopenPortProfile(
            _take(table, "name", str),
            direction,
            _port_type(_take(table, "type", str), _take(table, "length", int, 1), word_bits),
            _take(table, "cob_id", int) if "cob_id" in table else None,
            _member(table, "transport", PortTransport) if "transport" in table else None,
        )
    except ValueError as error:
        raise ProfileError(f"port {number}: {error}") from None


def _member(table: Table, key: str, kind: type[E]) -> E:
    """Return a member of an enumeration by its value."""
    value, known = _take(table, key, str), [str(item.value) for item in kind]
    if value not in known:
        raise ProfileError(f"{key} {value!r} is not one of {', '.join(known)}")
    return kind(value)


def _port_type(name: str, length: int, word_bits: int) -> CanopenPortType[Any]:
    element: CanopenPortType[Any] | None = (
        integer(word_bits) if name == INTEGER else PORT_TYPES.get(name)
    )
    if element is None:
        raise ProfileError(f"type {name!r} is not one of {', '.join((*PORT_TYPES, INTEGER))}")
    return element if length == 1 else element.sequence(length)


def _check_keys(table: Table, known: tuple[str, ...]) -> None:
    for key in table:
        if key not in known:
            raise ProfileError(f"no key {key}; known: {', '.join(known)}")


def _take(table: Table, key: str, kind: type[Any], default: Any = None) -> Any:
    value = table.get(key, default)
    if value is None:
        raise ProfileError(f"{key} is missing")
    if type(value) is not kind:
        raise ProfileError(f"{key} {value!r} is {_KINDS[kind]}")
    return value
