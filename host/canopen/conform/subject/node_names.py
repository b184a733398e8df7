"""What the names in checks stand for on one node: its COB-IDs, and what was bound to it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Final

from tickrig.host.canopen.conform.binding.binding import Binding, Bound, BoundObject, BoundPlace
from tickrig.host.canopen.conform.binding.pdo_binding import CARRIED, RPDOS, BoundPdo
from tickrig.host.canopen.conform.bus.sdo_frames import multiplexer
from tickrig.host.canopen.conform.notation.names import Address, Unbound
from tickrig.host.canopen.conform.subject.sample_values import sample_value
from tickrig.wire.canopen.cob_id import CAN_ID_MASK, EXTENDED, FLAG_30, INVALID
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID, RESPONSE_COB_ID

EMCY_COB_ID: Final = 0x80
SYNC_COB_ID: Final = 0x80
RPDO1: Final = 0x200
RPDO2: Final = 0x300
TPDO1: Final = 0x180
TPDO2: Final = 0x280
FREE_CAN_ID: Final = 0x6A2
"""A CAN-ID that is neither restricted nor of the pre-defined connection set."""
DRIVE: Final = range(0x603F, 0x6100)
"""Of CiA 402: modes, states and positions."""
HIGHEST_NODE_ID: Final = 127
BIT_7: Final = 0x80
"""Set in no node-ID: they end at 127."""
HEARTBEAT: Final = (0x1017, 0)
BEATS_MS: Final = (100, 90, 110)
IDENTITY: Final = ("vendor", "product", "revision", "serial")

ReadNumber = Callable[[int, int], int | None]
"""Reads an unsigned number of the node by index and sub-index, None if it has none."""


class NodeNames:
    """The `Names` of a node.

    Args:
        node_id: of the node, 1..127.
        binding: objects and PDOs by name.
        number: reads the node.
        others: node-IDs that were heard on the bus.

    Attributes:
        peer: a node-ID that no node has, None if all are taken.
    """

    def __init__(
        self, node_id: int, binding: Binding, number: ReadNumber, others: Collection[int] = ()
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
        """Return what stands for `$name.attribute`, in hex as it goes over the bus."""
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
            raise Unbound(name, f"nothing is there that has a {attribute}")
        return sample_value(name, attribute, bound)

    def address(self, name: str) -> Address:
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


def _connection_set(node_id: int, number: ReadNumber) -> dict[str, str]:
    emcy, sync = number(0x1014, 0), number(0x1005, 0)
    emcy_id, sync_id = _can_id(emcy) or EMCY_COB_ID + node_id, _can_id(sync) or SYNC_COB_ID
    return {
        "node": f"{node_id:02X}",
        "beyond": f"{node_id | BIT_7:02X}",
        "request_cob": _u32(REQUEST_COB_ID + node_id),
        "response_cob": _u32(RESPONSE_COB_ID + node_id),
        "rpdo1_cob": _u32(RPDO1 + node_id),
        "tpdo1_cob": _u32(TPDO1 + node_id | FLAG_30),
        "tpdo1_rtr_cob": _u32(TPDO1 + node_id),
        "rpdo2": f"{RPDO2 + node_id:03X}",
        "tpdo2": f"{TPDO2 + node_id:03X}",
        "emcy_default": _u32(EMCY_COB_ID + node_id),
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
    """Choose a node-ID that nobody has: for a node that the tester plays."""
    free = (n for n in range(HIGHEST_NODE_ID - 1, 0, -1) if n != node_id and n not in others)
    return next(free, None)


def _peer(peer: int | None) -> dict[str, str]:
    if peer is None:
        return {}
    return {
        "peer": f"{peer:02X}",
        "peer_heartbeat": f"{ERROR_CONTROL_COB_ID + peer:03X}",
        "peer_request": f"{REQUEST_COB_ID + peer:03X}",
    }


def _heartbeat_time(binding: Binding, number: ReadNumber) -> str:
    """Choose a heartbeat time, in hex, that the node neither has nor begins with."""
    bound = binding.bound.get("heartbeat")
    default = bound.entry.default if isinstance(bound, BoundObject) else b""
    taken = {number(*HEARTBEAT), int.from_bytes(default, "little")}
    time_ms = next(time_ms for time_ms in BEATS_MS if time_ms not in taken)
    return time_ms.to_bytes(2, "little").hex().upper()


def _identity(number: ReadNumber) -> dict[str, str]:
    numbers = {name: number(0x1018, sub) for sub, name in enumerate(IDENTITY, 1)}
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
        "moved": _u32(cob_id & ~CAN_ID_MASK | FREE_CAN_ID),
        "movedid": f"{FREE_CAN_ID:03X}",
    }
    return texts[attribute] if attribute in texts else _first(name, attribute, pdo)


def _first(name: str, attribute: str, pdo: BoundPdo) -> str:
    """Return the first object that a PDO carries, as `6000:01`, or the zeros behind its byte 0."""
    mapped = pdo.mapping[0] if pdo.mapping else 0
    index, bits = mapped >> 16, mapped & 0xFF
    if index in DRIVE:
        raise Unbound(name, f"{index:04X}h tells what a drive does: nobody can set it")
    texts = {
        "first": f"{index:04X}:{mapped >> 8 & 0xFF:02X}",
        "padding": "00" * ((bits + 7) // 8 - 1),
    }
    return texts[attribute]


def _u32(number: int) -> str:
    return number.to_bytes(4, "little").hex().upper()
