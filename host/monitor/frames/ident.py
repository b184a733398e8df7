"""One number for each kind of frame: the CAN-ID with flags above it."""

from __future__ import annotations

from typing import Final

from tickrig.wire.can import EXTENDED_MAX, CanFrame

EXTENDED: Final = 1 << 31
REMOTE: Final = 1 << 30
ERROR: Final = 1 << 29


def ident_of(frame: CanFrame) -> int:
    """Return the CAN-ID with a bit each for an extended and for a remote frame.

    >>> hex(ident_of(CanFrame.parse("00000605#R")))
    '0xc0000605'
    """
    return frame.can_id | frame.extended << 31 | frame.remote << 30


def ident_text(ident: int) -> str:
    """Write it as candump does, with an R for remote frames.

    >>> ident_text(0x181), ident_text(0xC000_0605)
    ('181', '00000605R')
    """
    can_id = ident & EXTENDED_MAX
    return (f"{can_id:08X}" if ident & EXTENDED else f"{can_id:03X}") + "R" * bool(ident & REMOTE)


def parse_ident(text: str) -> int:
    """Read what `ident_text` writes: 3 digits for 11-bit identifiers, 8 for 29-bit ones.

    Raises:
        ValueError: not an identifier.

    >>> parse_ident("181"), parse_ident("181R") == 0x181 | REMOTE
    (385, True)
    """
    digits = text.removesuffix("R")
    most = {3: 0x7FF, 8: EXTENDED_MAX}.get(len(digits))
    if most is None or not set(digits) <= set("0123456789abcdefABCDEF") or int(digits, 16) > most:
        raise ValueError(f"{text!r} is not a CAN-ID: write 3 or 8 hex digits, as 181 or 00000605")
    flags = EXTENDED * (len(digits) == 8) | REMOTE * text.endswith("R")
    return int(digits, 16) | flags


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
