"""Which node an identifier belongs to, by the predefined connection set (CiA 301)."""

from __future__ import annotations

from typing import Final

from tickrig.host.monitor.frames.ident import REMOTE

NODE_BITS: Final = 7
NODE_MASK: Final = 0x7F

FUNCTIONS: Final = frozenset([1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14])
"""Function codes that go with a node-ID: EMCY, PDO1 to PDO4, SDO, error control."""

SENDING: Final = frozenset([1, 3, 5, 7, 9, 11, 14])
"""Those of them that the node itself sends with: EMCY, TPDO1 to TPDO4, SDO, error control."""


def node_of(ident: int) -> int | None:
    """Return the node-ID; None where the identifier has none by default.

    A COB-ID that was configured may belong to another node.

    >>> node_of(0x181), node_of(0x701), node_of(0x080), node_of(0x7E5)
    (1, 1, None, None)
    """
    can_id = ident & ~REMOTE
    node = can_id & NODE_MASK
    return node if node and can_id >> NODE_BITS in FUNCTIONS else None


def sender_of(ident: int) -> int | None:
    """Return the node-ID that sends with an identifier; None where others do, or nobody by default.

    >>> sender_of(0x181), sender_of(0x581), sender_of(0x201), sender_of(0x701 | REMOTE)
    (1, 1, None, None)
    """
    node = ident & NODE_MASK
    return node if node and ident >> NODE_BITS in SENDING else None
