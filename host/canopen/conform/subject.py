"""The node under test: its properties and its description."""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.host.canopen.conform import check
from tickrig.host.canopen.conform.binding.binding import (
    Binding,
    Bound,
    BoundObject,
    BoundPlace,
    bind,
)
from tickrig.host.canopen.conform.binding.capabilities import EdsClaims, NodeFeatures, find_features
from tickrig.host.canopen.conform.binding.object_reader import ObjectReader
from tickrig.host.canopen.conform.binding.pdo_binding import CARRIED, RPDOS, BoundPdo
from tickrig.host.canopen.conform.bus.sdo import SdoClient, SizeOf, multiplexer
from tickrig.host.canopen.conform.notation import MAP, BoundCheck, Unbound, written_by
from tickrig.host.canopen.conform.permission import MANUFACTURER, PROFILE, PROGRAMS, STORAGE
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_entry import standard_object
from tickrig.wire.canopen.eds.object_table import EntryDescription
from tickrig.wire.canopen.nmt import CAN_ID_MASK, ERROR_CONTROL_COB_ID, EXTENDED, FLAG_30, INVALID
from tickrig.wire.canopen.pdo import fields
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID, RESPONSE_COB_ID

_BIT_7: Final = 0x80
"""Bit 7, which no node-ID has because node-IDs end at 127."""

# Check whether an EDS describes the device that answers.

TOLD: Final = {"device type": (0x1000, 0), "vendor": (0x1018, 1), "product": (0x1018, 2)}
"""Properties that distinguish devices, under the names in `Subject.about`."""


def other_device(device: EdsDevice | None, about: Mapping[str, str]) -> str:
    """Return how the node differs from the device in the EDS, or an empty text if they agree.

    A difference means that the EDS belongs to another device.

    Args:
        device: device that the EDS describes, or None without an EDS. If the EDS gives the value 0
            for a property, the property is not compared.
        about: properties that the node has reported, as texts by name.
    """
    entries = device.entries if device else ()
    values = {(one.index, one.sub): int.from_bytes(one.default, "little") for one in entries}
    said = {name: f"{values[at]:08X}h" for name, at in TOLD.items() if values.get(at)}
    differs = [
        f"{name} {text} in the EDS, {about[name]} in the node"
        for name, text in said.items()
        if about.get(name, text) != text
    ]
    return f"this EDS is of another device: {', '.join(differs)}" if differs else ""


# Values that checks write to an object of a node: allowed ones, and ones to be refused.

_PATTERNS: Final = tuple(
    map(
        bytes.fromhex,
        ("A5345678F1E2D3C4", "5AC3877A1E2D3C4B", "694B9621D2A57896", "962D4BE127C3B45A"),
    )
)
"""Values that share no byte, so that swapped or truncated values are detected."""
_SAMPLE_TEXTS: Final = (b"conformance", b"tested node")
_BOOLEANS: Final = (b"\x01", b"\x00")
_REALS: Final = (1.5, -2.25)
_FORMATS: Final = {DataType.REAL32: "<f", DataType.REAL64: "<d"}


def _sample_value(name: str, attribute: str, bound: BoundObject) -> str:
    """Return a value in hex, in the byte order of the bus.

    Args:
        name: name of the object in the check, used in the message.
        attribute: name of the wanted value. `new` and `other` are two allowed values, if possible
            neither the original value nor the value at the start of checks. `old` is the original
            value. `low` and `high` are the limits of the object, `below` and `above` are values
            beyond them. `map` is the mapping entry of the object, `longmap` is a mapping entry of
            twice the length.
        bound: object of the node.

    Raises:
        Unbound: the object has no such value.
    """
    entry = bound.entry
    match attribute:
        case "map" | "longmap":
            bits = entry.data_type.bits << (attribute == "longmap")
            return bytes([bits, entry.sub, *entry.index.to_bytes(2, "little")]).hex().upper()
        case "new" | "other":
            number = ("new", "other").index(attribute)
            return _allowed(name, bound, number).hex().upper()
        case "old" if bound.value is not None:
            return bound.value.hex().upper()
        case "low" | "high" | "below" | "above":
            return _limit(name, entry, attribute).hex().upper()
    raise Unbound(name, f"{entry.index:04X}h:{entry.sub:02X} has no {attribute}")


def _allowed(name: str, bound: BoundObject, number: int) -> bytes:
    entry = bound.entry
    kind = entry.data_type
    if kind is DataType.BOOLEAN:
        return _BOOLEANS[number]
    if kind in _FORMATS:
        return struct.pack(_FORMATS[kind], _REALS[number])
    if not kind.is_integer:
        return _SAMPLE_TEXTS[number][: entry.max_bytes]
    if entry.low is None and entry.high is None:
        values = [pattern[: kind.size] for pattern in _PATTERNS]
    else:
        low, high = _limits(entry)
        if low == high:
            raise Unbound(name, f"{entry.index:04X}h:{entry.sub:02X} has only the value {low}")
        some = dict.fromkeys((low, high, (low + high) // 2, low + 1))
        values = [value.to_bytes(kind.size, "little", signed=kind.signed) for value in some]
    unused = [value for value in values if value not in {bound.value, entry.default}]
    return [*unused, *(value for value in values if value not in unused)][number]


def _limits(entry: EntryDescription) -> tuple[int, int]:
    lowest, highest = entry.data_type.limits
    low = lowest if entry.low is None else int(entry.low)
    return low, highest if entry.high is None else int(entry.high)


def _limit(name: str, entry: EntryDescription, attribute: str) -> bytes:
    low, high = _limits(entry)
    value = {"low": low, "high": high, "below": low - 1, "above": high + 1}[attribute]
    try:
        return value.to_bytes(entry.size, "little", signed=entry.signed)
    except OverflowError:
        raise Unbound(name, f"no value is {attribute} the limits of {entry.index:04X}h") from None


# The values of names in checks for one node: its COB-IDs, and the bound objects.

_EMCY_COB_ID: Final = 0x80
_SYNC_COB_ID: Final = 0x80
_RPDO1: Final = 0x200
_RPDO2: Final = 0x300
_TPDO1: Final = 0x180
_TPDO2: Final = 0x280
_FREE_CAN_ID: Final = 0x6A2
"""A CAN-ID that is neither restricted nor in the pre-defined connection set."""
_DRIVE: Final = range(0x603F, 0x6100)
"""Indices of CiA 402 objects, such as modes, states and positions."""
_HIGHEST_NODE_ID: Final = 127
_HEARTBEAT: Final = (0x1017, 0)
_BEATS_MS: Final = (100, 90, 110)

_ReadNumber = Callable[[int, int], int | None]
"""Function that reads an unsigned number of the node by index and sub-index, or returns None."""


class _NodeNames:
    """The `Names` of a node.

    Args:
        node_id: node-ID of the node, 1..127.
        binding: objects and PDOs by name.
        number: function that reads a number of the node.
        others: node-IDs of other nodes on the bus.

    Attributes:
        peer: node-ID that no node has, or None if all are taken.
    """

    def __init__(
        self, node_id: int, binding: Binding, number: _ReadNumber, others: Collection[int] = ()
    ) -> None:
        self._binding = binding
        peer = _free_id(node_id, others)
        self.peer = peer
        self._texts: Mapping[str, str] = {
            **_connection_set(node_id, number),
            **_peer(peer),
            "beat": _heartbeat_time(binding, number),
            **_identity(number),
        }

    def text(self, name: str, attribute: str) -> str:
        """Return the value of `$name.attribute`, in hex, in the byte order of the bus."""
        if not attribute and name in self._texts:
            return self._texts[name]
        bound = self._bound(name)
        if isinstance(bound, BoundPdo):
            return _pdo_text(name, attribute, bound)
        if attribute == "map" and isinstance(bound, BoundPlace):
            return f"08{bound.sub:02X}{bound.index & 0xFF:02X}{bound.index >> 8:02X}"
        if not attribute:
            return multiplexer((bound.index, bound.sub))
        if not isinstance(bound, BoundObject):
            raise Unbound(name, f"nothing with a {attribute} exists")
        return _sample_value(name, attribute, bound)

    def address(self, name: str) -> check.Address:
        """Return index and sub-index of an object."""
        if name in self._texts:
            raise Unbound(name, "is a number, not an object")
        bound = self._bound(name)
        return bound.index, 0 if isinstance(bound, BoundPdo) else bound.sub

    def _bound(self, name: str) -> Bound:
        try:
            return self._binding.bound[name]
        except KeyError:
            reason = self._binding.reasons.get(name, "no check has such a name")
            raise Unbound(name, reason) from None


def _connection_set(node_id: int, number: _ReadNumber) -> dict[str, str]:
    emcy, sync = number(0x1014, 0), number(0x1005, 0)
    emcy_id, sync_id = _can_id(emcy) or _EMCY_COB_ID + node_id, _can_id(sync) or _SYNC_COB_ID
    return {
        "node": f"{node_id:02X}",
        "beyond": f"{node_id | _BIT_7:02X}",
        "request_cob": _u32(REQUEST_COB_ID + node_id),
        "response_cob": _u32(RESPONSE_COB_ID + node_id),
        "rpdo1_cob": _u32(_RPDO1 + node_id),
        "tpdo1_cob": _u32(_TPDO1 + node_id | FLAG_30),
        "tpdo1_rtr_cob": _u32(_TPDO1 + node_id),
        "rpdo2": f"{_RPDO2 + node_id:03X}",
        "tpdo2": f"{_TPDO2 + node_id:03X}",
        "emcy_default": _u32(_EMCY_COB_ID + node_id),
        "emcy_off": _u32(emcy_id | INVALID),
        "sync_on": _u32(sync_id | FLAG_30),
        "request": f"{REQUEST_COB_ID + node_id:03X}",
        "response": f"{RESPONSE_COB_ID + node_id:03X}",
        "heartbeat": f"{ERROR_CONTROL_COB_ID + node_id:03X}",
        "emcy": f"{emcy_id:03X}",
        "sync": f"{sync_id:03X}",
    }


def _can_id(cob_id: int | None) -> int:
    return 0 if cob_id is None or cob_id & EXTENDED else cob_id & CAN_ID_MASK


def _free_id(node_id: int, others: Collection[int]) -> int | None:
    """Choose a node-ID that no node has. The tester simulates a node with it."""
    free = (n for n in range(_HIGHEST_NODE_ID - 1, 0, -1) if n != node_id and n not in others)
    return next(free, None)


def _peer(peer: int | None) -> dict[str, str]:
    if peer is None:
        return {}
    return {
        "peer": f"{peer:02X}",
        "peer_heartbeat": f"{ERROR_CONTROL_COB_ID + peer:03X}",
        "peer_request": f"{REQUEST_COB_ID + peer:03X}",
    }


def _heartbeat_time(binding: Binding, number: _ReadNumber) -> str:
    """Choose a heartbeat time in hex.

    The chosen time differs from the original time and from the time in the checks.
    """
    bound = binding.bound.get("heartbeat")
    default = bound.entry.default if isinstance(bound, BoundObject) else b""
    taken = {number(*_HEARTBEAT), int.from_bytes(default, "little")}
    time_ms = next(time_ms for time_ms in _BEATS_MS if time_ms not in taken)
    return time_ms.to_bytes(2, "little").hex().upper()


def _identity(number: _ReadNumber) -> dict[str, str]:
    numbers = {name: number(0x1018, sub) for sub, name in enumerate(_IDENTITY, 1)}
    texts = {name: _u32(value) for name, value in numbers.items() if value is not None}
    others = {name: value for name, value in numbers.items() if value is not None}
    texts |= {f"other_{name}": _u32(value ^ 1) for name, value in others.items()}
    return texts


def _pdo_text(name: str, attribute: str, pdo: BoundPdo) -> str:
    if not pdo.can_id:
        raise Unbound(name, f"{pdo.index:04X}h has no CAN-ID")
    cob_id = pdo.cob_id & ~INVALID
    before, behind = pdo.place(CARRIED.get(name, (0, 0))) or (0, 0)
    other = "00" if pdo.index in RPDOS else ".."
    texts = {
        "before": other * before,
        "behind": other * behind,
        "comm": f"{pdo.index:04X}",
        "map": f"{pdo.mapping_index:04X}",
        "id": f"{pdo.can_id:03X}",
        "on": _u32(cob_id),
        "off": _u32(cob_id | INVALID),
        "rtr": _u32(cob_id & ~FLAG_30),
        "nortr": _u32(cob_id | FLAG_30),
        "long": _u32(cob_id | EXTENDED),
        "moved": _u32(cob_id & ~CAN_ID_MASK | _FREE_CAN_ID),
        "movedid": f"{_FREE_CAN_ID:03X}",
    }
    return texts[attribute] if attribute in texts else _first(name, attribute, pdo)


def _first(name: str, attribute: str, pdo: BoundPdo) -> str:
    """Return the first object in a PDO as `6000:01`, or the zeros after byte 0 of the PDO."""
    mapped, _ = next(fields(pdo.mapping or (0,)))
    index, sub, bits = mapped.index, mapped.sub, mapped.bits
    if index in _DRIVE:
        raise Unbound(name, f"{index:04X}h reports what a drive does: it cannot be written")
    texts = {"first": f"{index:04X}:{sub:02X}", "padding": "00" * ((bits + 7) // 8 - 1)}
    return texts[attribute]


def _u32(number: int) -> str:
    return number.to_bytes(4, "little").hex().upper()


_TEXTS: Final = {0x1008: "name", 0x1009: "hardware version", 0x100A: "software version"}
_IDENTITY: Final = ("vendor", "product", "revision", "serial")
_MANDATORY: Final = {(0x1000, 0): "UE-01", (0x1001, 0): "UE-02", (0x1018, 0): "UE-05"}
"""Mandatory objects of each node, and the check that fails if the object is missing."""
_INDICES: Final = {index for index, _ in _MANDATORY}
_COMMUNICATION: Final = 0x1000
_READ_ONLY: Final = "06010002"


@dataclass(frozen=True, slots=True)
class Subject:
    """The node under test: what the tester has found out about it before the first check.

    Attributes:
        binding: objects and PDOs of the node that are assigned to the names in checks.
        features: features that the node has.
        names: helper that replaces a name in a step by a text or an object address. It uses
            `binding`.
        about: properties that the node has reported, such as its device name, as texts by name.
        values: objects whose values can be read and written, by index and sub-index.
        refused: mandatory objects that the node refuses to read.
    """

    binding: Binding
    features: NodeFeatures
    names: _NodeNames
    about: dict[str, str]
    values: frozenset[check.Address]
    refused: frozenset[check.Address]

    def missing(self, bound: BoundCheck) -> str | None:
        """Return the reason if a missing object prevents a check. Otherwise, return None.

        For each mandatory object, there is one check that is executed even if the object is
        missing. This check then fails. For the object 1000h, it is the check UE-01. Other checks
        that need the object are not executed.
        """
        for at in sorted(bound.written & self.refused | bound.used):
            judge, where = _MANDATORY.get(at, ""), f"{at[0]:04X}h:{at[1]:02X}"
            if at in self.refused and judge != bound.check.id:
                return f"the node has no {where}: {judge}"
            if at not in self.entries and at[0] not in _INDICES:
                return f"{self._where(at[0])} {where}"
        return None

    def fixed(self, steps: Collection[check.Step]) -> str | None:
        """Return why one of the steps of a check cannot be executed, or None if all steps can.

        A step cannot be executed if it writes an object that is read-only, or a value outside the
        limits of the object.
        """
        for step in steps:
            for at in _takes(step):
                entry = self.entries.get(at)
                if entry is not None and not entry.writable:
                    return f"{at[0]:04X}h:{at[1]:02X} is read-only"
            if not isinstance(step.action, check.Write):
                continue
            entry = self.entries.get(step.action.address)
            if entry is not None and not _within(entry, bytes.fromhex(step.action.data)):
                where = f"{entry.index:04X}h:{entry.sub:02X}"
                return f"{where} accepts only {entry.low} to {entry.high}"
        return None

    @property
    def entries(self) -> Mapping[check.Address, EntryDescription]:
        """The descriptions of the node's objects."""
        return self.binding.entries

    def _where(self, index: int) -> str:
        """Return which object is missing and where.

        Without an EDS, only objects of CiA 301 were read.
        """
        if self.binding.known:
            return "the EDS has no"
        asked = _COMMUNICATION <= index < MANUFACTURER
        return "the node has no" if asked else "without an EDS there is no known"

    def restorable(self, level: check.Level) -> list[check.Address]:
        """Return the objects that a run may change, directly by a write or indirectly by a reset.

        The tester reads them before the run, and restores them after it.
        """
        highest = PROFILE if level is check.Level.INTRUSIVE else MANUFACTURER
        apart = {*PROGRAMS, *STORAGE}
        return [
            (entry.index, entry.sub)
            for entry in self.binding.device.entries
            if _COMMUNICATION <= entry.index < highest
            and entry.index not in apart
            and entry.data_type is not DataType.DOMAIN
            and entry.readable
            and entry.writable
        ]


def _takes(step: check.Step) -> Iterator[check.Address]:
    """Yield the written objects that must accept or refuse the value because of their kind."""
    match step.action:
        case check.Write() as action:
            yield action.address
        case check.RefuseWrite(_, _, codes) as action if _READ_ONLY not in codes:
            yield action.address  # the node must refuse for another reason
        case check.Macro(name, words) if name == MAP:
            yield from written_by(name, *words)


def _within(entry: EntryDescription, data: bytes) -> bool:
    """Return whether a value lies within the limits of an object, if the object has limits."""
    if not entry.data_type.is_integer or len(data) != entry.size:
        return True
    value = int.from_bytes(data, "little", signed=entry.signed)
    return (entry.low is None or value >= entry.low) and (entry.high is None or value <= entry.high)


def examine(  # noqa: PLR0913, PLR0917 - all that is known
    client: SdoClient,
    node_id: int,
    plan: check.ConformancePlan,
    device: EdsDevice | None,
    claims: EdsClaims | None,
    others: Collection[int],
) -> Subject:
    """Find out what the tester must know about a node before the first check.

    Nothing is written to the node.

    Raises:
        SdoTimeout: the node does not answer.
    """
    client.size_of = _standard_size if device is None else _sizes(device)
    binding = bind(device, client.upload, allow=plan.allow, never=plan.never)
    features = find_features(binding, client, claims)
    reader = binding.reader  # what it has read is not read again: a sixth of what is read here
    names = _NodeNames(node_id, binding, reader.number, others)
    entries = binding.entries.items()
    values = frozenset([at for at, entry in entries if entry.readable and entry.writable])
    refused = frozenset([at for at in _MANDATORY if reader.number(*at) is None])
    return Subject(binding, features, names, dict(_about(reader)), values, refused)


def _sizes(device: EdsDevice) -> SizeOf:
    """Return the sizes in the EDS. The sizes of texts come from their defaults."""
    return {(entry.index, entry.sub): len(entry.default) for entry in device.entries}.get


def _standard_size(at: check.Address) -> int:
    known = standard_object(at[0])
    kind = known and known.types.get(at[1], known.others)
    return kind.size if kind else 0


def _about(reader: ObjectReader) -> Iterator[tuple[str, str]]:
    device_type = reader.number(0x1000, 0)
    if device_type is not None:
        yield "device type", f"{device_type:08X}h"
    for index, name in _TEXTS.items():
        text = reader.try_read(index, 0)
        if isinstance(text, bytes):
            yield name, "".join(c for c in text.decode("latin-1") if c.isprintable())
    for sub, name in enumerate(_IDENTITY, 1):
        number = reader.number(0x1018, sub)
        if number is not None:
            yield name, f"{number:08X}h"
