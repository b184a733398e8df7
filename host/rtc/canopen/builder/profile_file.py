"""Profiles of DeviceRTCs as TOML."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Final, TypeVar

from tickrig.wire.rtc_canopen import (
    INTEGER,
    PORT_TYPES,
    CanopenPortProfile,
    CanopenPortType,
    PortDirection,
    PortTransport,
    RtcProfile,
    integer,
)

# Names of a profile as identifiers of Python and C.

_C_KEYWORDS: Final = frozenset(
    (
        *("auto", "bool", "break", "case", "char", "const", "continue", "default", "do", "double"),
        *("else", "enum", "extern", "float", "for", "goto", "if", "inline", "int", "long"),
        *("register", "restrict", "return", "short", "signed", "sizeof", "static", "struct"),
        *("switch", "typedef", "union", "unsigned", "void", "volatile", "while"),
        *("delete", "new", "operator", "private", "public", "template", "this", "throw", "virtual"),
    )
)
"""Reserved words of C, and reserved words of C++ that may occur as names of ports."""

COMPONENT_NAMES: Final = frozenset(
    (
        *("category", "error_check", "inputs", "on_aborting", "on_activated", "on_deactivated"),
        *("on_error", "on_execute", "on_finalize", "on_initialize", "on_reset", "physical"),
        *("ports", "product_code", "profile", "rate_hz", "strict_cia301", "type_name"),
        *("vendor", "version"),
    )
)
"""Attributes of a component in addition to its ports."""

_IMPORTED: Final = frozenset(("CanopenInPort", "CanopenOutPort", "PortTransport", "integer"))
"""Names that the skeleton uses while it declares ports, in addition to the types."""


def python_name(name: str) -> str:
    """Turn the name of a port or object into a Python attribute name of the generated component.

    If the name is reserved or used by the component itself, an underscore is appended.

    >>> python_name("in"), python_name("target_um")
    ('in_', 'target_um')
    """
    taken = keyword.iskeyword(name) or name in COMPONENT_NAMES | _IMPORTED or name.isupper()
    return f"{name}_" if taken else name


def c_name(name: str) -> str:
    """Turn a name into the name of a member of a struct in C."""
    return f"{name}_" if name in _C_KEYWORDS else name


def snake_name(name: str) -> str:
    """Turn a name into lower case with underscores, for names of files and constants.

    >>> snake_name("UnsignedLongLong"), snake_name("Gripper2")
    ('unsigned_long_long', 'gripper2')
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def check_identifiers(type_name: str, ports: Iterable[str]) -> None:
    """Raise ValueError if a name is not allowed in Python and C."""
    if keyword.iskeyword(type_name):
        raise ValueError(f"name {type_name!r} is a keyword of Python")
    names = set(ports)
    for name in sorted(names):
        for other in (python_name(name), c_name(name)):
            if other != name and other in names:
                raise ValueError(f"port {name!r} becomes {other!r}, and so is another called")


_Table = Mapping[str, Any]
_E = TypeVar("_E", bound=Enum)

EXAMPLE: Final = Path(__file__).with_name("example.toml").read_text("utf-8")

_TEXTS: Final = ("version", "vendor", "category")
_NUMBERS: Final = ("rate_hz", "product_code")
_KEYS: Final = ("name", *_TEXTS, *_NUMBERS, "node_id", "word_bits", "strict_cia301", "port")
_PORT_KEYS: Final = ("name", "direction", "type", "length", "cob_id", "transport")
_KINDS: Final = {str: "no text", int: "no whole number", bool: "neither true nor false"}

_DEFAULT_WORD_BITS: Final = 32
_DEFAULT_NODE_ID: Final = 16


@dataclass(frozen=True, slots=True)
class Project:
    """Content of the profile file of a DeviceRTC, from which the builder generates its files.

    Attributes:
        profile: component with its ports.
        node_id: node-ID in the System Definition.
        strict_cia301: whether the NMT commands Start and Enter Pre-operational end the component's
            Error state, as in CiA 301 (DECISION K9). By default, only a reset ends this state.
    """

    profile: RtcProfile
    node_id: int = _DEFAULT_NODE_ID
    strict_cia301: bool = False


def parse_project(text: str) -> Project:
    """Parse the text of a profile file of a DeviceRTC.

    Raises:
        ValueError: the file is not TOML, a key is unknown, a value has the wrong type, or no
            DeviceRTC can have this profile.
    """
    from tickrig.host.text.toml_reader import load_toml  # noqa: PLC0415 - a TAB needs none

    content = load_toml(text)
    _check_keys(content, _KEYS)
    ports = _tables(content)
    word_bits = _take(content, "word_bits", int, _DEFAULT_WORD_BITS)
    profile = RtcProfile(
        type_name=_take(content, "name", str),
        **{key: _take(content, key, str) for key in _TEXTS if key in content},
        **{key: _take(content, key, int) for key in _NUMBERS if key in content},
        ports=tuple(_port(number, table, word_bits) for number, table in enumerate(ports, 1)),
    )
    node_id = _take(content, "node_id", int, _DEFAULT_NODE_ID)
    if not 1 <= node_id <= 127:
        raise ValueError(f"node_id {node_id} is not in 1..127")
    return Project(profile, node_id, _take(content, "strict_cia301", bool, False))


def _tables(content: _Table) -> list[_Table]:
    tables = content.get("port", [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise ValueError("port: ports are tables [[port]]")
    return tables


def _port(number: int, table: _Table, word_bits: int) -> CanopenPortProfile:
    """Read a port. Errors name the port."""
    try:
        _check_keys(table, _PORT_KEYS)
        direction = _member(table, "direction", PortDirection)
        return CanopenPortProfile(
            _take(table, "name", str),
            direction,
            _port_type(_take(table, "type", str), _take(table, "length", int, 1), word_bits),
            _take(table, "cob_id", int) if "cob_id" in table else None,
            _member(table, "transport", PortTransport) if "transport" in table else None,
        )
    except ValueError as error:
        raise ValueError(f"port {number}: {error}") from None


def _member(table: _Table, key: str, kind: type[_E]) -> _E:
    """Return a member of an enumeration by its value."""
    value, known = _take(table, key, str), [str(item.value) for item in kind]
    if value not in known:
        raise ValueError(f"{key} {value!r} is not one of {', '.join(known)}")
    return kind(value)


def _port_type(name: str, length: int, word_bits: int) -> CanopenPortType[Any]:
    element: CanopenPortType[Any] | None = (
        integer(word_bits) if name == INTEGER else PORT_TYPES.get(name)
    )
    if element is None:
        raise ValueError(f"type {name!r} is not one of {', '.join((*PORT_TYPES, INTEGER))}")
    return element if length == 1 else element.sequence(length)


def _check_keys(table: _Table, known: tuple[str, ...]) -> None:
    for key in table:
        if key not in known:
            raise ValueError(f"no key {key}; known: {', '.join(known)}")


def _take(table: _Table, key: str, kind: type[Any], default: Any = None) -> Any:
    value = table.get(key, default)
    if value is None:
        raise ValueError(f"{key} is missing")
    if type(value) is not kind:
        raise ValueError(f"{key} {value!r} is {_KINDS[kind]}")
    return value
